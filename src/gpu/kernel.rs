//! One row per shader, and the pipeline built from it.

use super::numbers::{DOUBLES, PAIRS};
use super::spirv;
use wgpu::{BindGroupLayoutEntry, BindingType, BufferBindingType, ShaderStages};

/// How a kernel uses a storage buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    /// It is only read.
    Read,
    /// It is read and written.
    ReadWrite,
}

/// Bound on the difference of the GPU's result from the f64 engine's, and its reason.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// Bound of |gpu - cpu| / |cpu|, both as Euclidean norms.
    pub relative_l2: f64,
    /// Why it is this large.
    pub reason: &'static str,
}

/// Layout in Rust of a struct that WGSL declares under the same name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StructLayout {
    /// Name of the struct in WGSL.
    pub name: &'static str,
    /// Size, bytes.
    pub size: usize,
    /// Name and byte offset of each field in order. Names that begin with `pad` need no WGSL member.
    pub fields: &'static [(&'static str, usize)],
}

/// Everything the host has to know about a shader. `layout::check_kernel` compares it with the WGSL.
#[derive(Debug, Clone, Copy)]
pub struct Kernel {
    /// `dsp/fft` stands for `shaders/dsp/fft.wgsl`, `src/dsp/fft.rs` and `src/dsp/cpu/fft.rs`.
    pub stem: &'static str,
    /// `include_str!` of the shared parts, then of the entry file; concatenated.
    pub sources: &'static [&'static str],
    /// `@workgroup_size` of the entry point `main`.
    pub workgroup: [u32; 3],
    /// The uniform at `@group(0) @binding(0)`. Without one, storage still begins at binding 1.
    pub params: Option<StructLayout>,
    /// Storage buffer i is `@group(0) @binding(i + 1)`.
    pub storage: &'static [Access],
    /// Other structs that both sides declare.
    pub structs: &'static [StructLayout],
    /// How far its result may lie from the f64 engine's.
    pub tolerance: Tolerance,
}

impl Kernel {
    /// The assembled WGSL.
    pub fn source(&self) -> String {
        self.sources.join("\n")
    }

    /// The assembled WGSL for an adapter that computes in f64, or for one that does not.
    pub fn source_for(&self, has_f64: bool) -> String {
        let of = |part: &&'static str| if has_f64 && *part == PAIRS { DOUBLES } else { part };
        self.sources.iter().map(of).collect::<Vec<_>>().join("\n")
    }
}

pub(super) struct Pipeline {
    pub pipeline: wgpu::ComputePipeline,
    pub layout: wgpu::BindGroupLayout,
}

/// Builds the pipeline, from `cache` where it holds it. To be called inside error scopes. The layout is explicit because an automatic
/// one leaves out bindings that the shader does not use.
pub(super) fn build_pipeline(
    device: &wgpu::Device,
    kernel: &Kernel,
    has_f64: bool,
    cache: Option<&wgpu::PipelineCache>,
) -> Result<Pipeline, String> {
    let buffer = |binding: u32, ty: BufferBindingType| BindGroupLayoutEntry {
        binding,
        visibility: ShaderStages::COMPUTE,
        ty: BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
        count: None,
    };
    let uniform = kernel.params.map(|_| buffer(0, BufferBindingType::Uniform));
    let storage = kernel.storage.iter().zip(1..).map(|(access, binding)| {
        buffer(binding, BufferBindingType::Storage { read_only: *access == Access::Read })
    });
    let entries: Vec<_> = uniform.into_iter().chain(storage).collect();
    let label = Some(kernel.stem);
    let layout =
        device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label, entries: &entries });
    let module = module(device, kernel, kernel.source_for(has_f64))?;
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label,
        bind_group_layouts: &[Some(&layout)],
        immediate_size: 0,
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label,
        layout: Some(&pipeline_layout),
        module: &module,
        entry_point: Some("main"),
        compilation_options: Default::default(),
        cache,
    });
    Ok(Pipeline { pipeline, layout })
}

/// The compiled shader. Where beams are cut, no operations are joined if the device can be told so (see [`spirv`](super::spirv)).
#[allow(unsafe_code)] // what passes by wgpu's tools is not validated by them
fn module(device: &wgpu::Device, kernel: &Kernel, source: String) -> Result<wgpu::ShaderModule, String> {
    let label = Some(kernel.stem);
    let cuts_beams = ["trace/", "rcs/"].iter().any(|room| kernel.stem.starts_with(room));
    if !cuts_beams || !device.features().contains(wgpu::Features::PASSTHROUGH_SHADERS) {
        return Ok(device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label,
            source: wgpu::ShaderSource::Wgsl(source.into()),
        }));
    }
    let first = u32::from(kernel.params.is_none());
    let bindings = first..kernel.storage.len() as u32 + 1;
    let words = spirv::uncontracted(kernel.stem, &source, bindings)?;
    let (name, [x, y, z]) = ("main".into(), kernel.workgroup);
    let entry_points = [wgpu::PassthroughShaderEntryPoint { name, workgroup_size: (x, y, z) }];
    let described = wgpu::ShaderModuleDescriptorPassthrough {
        label,
        entry_points: entry_points.as_slice().into(),
        spirv: Some(words.into()),
        ..Default::default()
    };
    // SAFETY: naga wrote the words for a module that it validated, with checks of all indices; only decorations were added.
    Ok(unsafe { device.create_shader_module_passthrough(described) })
}
