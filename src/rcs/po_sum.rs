//! Physical-optics sum of all tubes over the aspects of a sweep, on the gpu engine.

use super::{Aspect, Distance, RayGrid, Scattering};
use crate::base::error::Result;
use crate::base::frames::direction_from_angles;
use crate::base::units::{wavelength_m, wavenumber};
use crate::geom::Geometry;
use crate::geom::upload::{GeometryArrays, split, split3};
use crate::gpu::{Access, Gpu, Kernel, Threads, Tolerance};
use crate::gpu_struct;
use crate::trace::launch::{Fan, PlaneGrid};
use crate::trace::upload::{GeometryBuffers, cell_words, columns};
use num_complex::Complex64;

gpu_struct! {
    /// Uniform of `shaders/rcs/po_sum.wgsl`.
    pub struct PoSumParams {
        pub inv_wavelength: [f32; 2],
        pub wavenumber: f32,
        pub t_min: f32,
        pub bounces: u32,
        pub tubes_per_block: u32,
        pub spherical: u32,
        pub zero: u32,
    }
}

mod layout {
    crate::gpu_struct! {
        /// One aspect as the shader reads it.
        pub struct Aspect {
            pub dir_hi: [f32; 3],
            pub count0: u32,
            pub dir_lo: [f32; 3],
            pub tubes: u32,
            pub first_hi: [f32; 3],
            pub lead_hi: f32,
            pub first_lo: [f32; 3],
            pub lead_lo: f32,
            pub step0_hi: [f32; 3],
            pub near: f32,
            pub step0_lo: [f32; 3],
            pub pad1: u32,
            pub step1_hi: [f32; 3],
            pub pad2: u32,
            pub step1_lo: [f32; 3],
            pub pad3: u32,
            pub axis0: [f32; 3],
            pub pad4: u32,
            pub axis1: [f32; 3],
            pub pad5: u32,
            pub axis2: [f32; 3],
            pub pad6: u32,
        }
    }
    crate::gpu_struct! {
        /// Sums of one block of tubes.
        pub struct Sum {
            pub every_v: [f32; 4],
            pub every_h: [f32; 4],
            pub last_v: [f32; 4],
            pub last_h: [f32; 4],
        }
    }
}

/// The kernel's row: sources, parameters, bindings and tolerance.
pub static KERNEL: Kernel = Kernel {
    stem: "rcs/po_sum",
    sources: &[
        include_str!("../../shaders/shared/complex.wgsl"),
        include_str!("../../shaders/shared/phase.wgsl"),
        include_str!("../../shaders/shared/df64.wgsl"),
        include_str!("../../shaders/shared/bvh.wgsl"),
        include_str!("../../shaders/shared/facet.wgsl"),
        include_str!("../../shaders/shared/field.wgsl"),
        include_str!("../../shaders/rcs/po_sum.wgsl"),
    ],
    workgroup: [64, 1, 1],
    params: Some(PoSumParams::LAYOUT),
    storage: &[
        Access::Read,
        Access::Read,
        Access::Read,
        Access::Read,
        Access::Read,
        Access::Read,
        Access::Read,
        Access::ReadWrite,
    ],
    structs: &[layout::Aspect::LAYOUT, layout::Sum::LAYOUT],
    tolerance: Tolerance {
        relative_l2: 1e-4,
        reason: "f32 fields; and the few tubes that run within f32 rounding of an edge and fall on its other side",
    },
};

/// Tubes that one workgroup adds up: four a thread, which keeps all loops of a thread together far below
/// [`LOOP_LIMIT`](crate::gpu::LOOP_LIMIT).
const TUBES_PER_BLOCK: u32 = 256;
/// Blocks in one dispatch: short enough for the time limits of desktop drivers, under the limit of
/// workgroups per dimension.
const BLOCKS_PER_DISPATCH: usize = 8192;

/// Computes S of the geometry for each aspect (monostatic) with a grid of rays on the device, as
/// `rcs::cpu::po_sum::by_rays` does.
///
/// # Errors
/// Returns an error if the adapter fails.
pub fn by_rays(
    gpu: &Gpu,
    geometry: &Geometry,
    aspects: &[Aspect],
    options: &RayGrid,
) -> Result<Vec<Scattering>> {
    if geometry.triangles.is_empty() {
        return Ok(vec![Scattering::default(); aspects.len()]);
    }
    let arrays = GeometryArrays::new(geometry)?;
    let mut recorder = gpu.recorder("geometry");
    let buffers = GeometryBuffers::upload(&mut recorder, &arrays);
    recorder.submit()?;
    match options.distance {
        Distance::Infinite => {
            let grids: Vec<layout::Aspect> = aspects
                .iter()
                .map(|a| {
                    let u = direction_from_angles(a.azimuth, a.elevation);
                    let grid = PlaneGrid::cover(geometry, -u, options.rays_per_wavelength);
                    let [dir_hi, dir_lo] = split3(grid.dir);
                    let [first_hi, first_lo] = split3(grid.first_m);
                    let [lead_hi, lead_lo] = split(grid.lead_m);
                    let [step0_hi, step0_lo] = split3(grid.step[0]);
                    let [step1_hi, step1_lo] = split3(grid.step[1]);
                    layout::Aspect {
                        dir_hi,
                        count0: grid.count[0],
                        dir_lo,
                        tubes: grid.len().min(u32::MAX as u64) as u32,
                        first_hi,
                        lead_hi,
                        first_lo,
                        lead_lo,
                        step0_hi,
                        step0_lo,
                        step1_hi,
                        step1_lo,
                        ..Default::default()
                    }
                })
                .collect();
            sums(gpu, geometry, &buffers, &grids, &[[0.0; 4]; 2], options, 1.0)
        }
        Distance::At(r0) => {
            let mut out = Vec::with_capacity(aspects.len());
            for a in aspects {
                let u = direction_from_angles(a.azimuth, a.elevation);
                let fan = Fan::grid(geometry, u * r0, options.rays_per_wavelength);
                let [first_hi, first_lo] = split3(fan.origin_m);
                // The reference is the way to the origin and back.
                let [lead_hi, lead_lo] = split(2.0 * r0);
                let [axis0, axis1, axis2] = columns(fan.rotation);
                let (centre, radius) = geometry.bounding_sphere_m();
                let near = ((centre - fan.origin_m).length() - 1.01 * radius).max(0.0) as f32;
                // Chunks that fit a binding.
                let chunk = (gpu.max_binding_bytes() / 32).clamp(1, 1 << 22) as usize;
                let mut s = Scattering::default();
                for cells in fan.cells.chunks(chunk) {
                    let aspect = layout::Aspect {
                        tubes: cells.len() as u32,
                        first_hi,
                        lead_hi,
                        first_lo,
                        lead_lo,
                        near,
                        axis0,
                        axis1,
                        axis2,
                        ..Default::default()
                    };
                    let words = cell_words(&fan, cells);
                    s.add(&sums(gpu, geometry, &buffers, &[aspect], &words, options, r0 * r0)?[0]);
                }
                out.push(s);
            }
            Ok(out)
        }
    }
}

fn sums(
    gpu: &Gpu,
    geometry: &Geometry,
    buffers: &GeometryBuffers,
    aspects: &[layout::Aspect],
    cells: &[[f32; 4]],
    options: &RayGrid,
    scale: f64,
) -> Result<Vec<Scattering>> {
    let blocks: Vec<[u32; 2]> = aspects
        .iter()
        .enumerate()
        .flat_map(|(i, a)| {
            (0..a.tubes.div_ceil(TUBES_PER_BLOCK)).map(move |b| [i as u32, b * TUBES_PER_BLOCK])
        })
        .collect();
    let [inv_hi, inv_lo] = split(1.0 / wavelength_m(geometry.freq_hz));
    let mut out = vec![Scattering::default(); aspects.len()];
    // Aspects and block sums of one submit stay far below any binding limit.
    for blocks in blocks.chunks(BLOCKS_PER_DISPATCH) {
        let first_aspect = blocks[0][0];
        let last_aspect = blocks[blocks.len() - 1][0];
        let local: Vec<[u32; 2]> = blocks.iter().map(|b| [b[0] - first_aspect, b[1]]).collect();
        let mut recorder = gpu.recorder("rcs sweep");
        let aspect_buffer =
            recorder.upload("aspects", &aspects[first_aspect as usize..=last_aspect as usize]);
        let block_buffer = recorder.upload("blocks", &local);
        let cell_buffer = recorder.upload("cells", cells);
        let sum_buffer = recorder.buffer::<layout::Sum>("sums", blocks.len());
        let params = PoSumParams {
            inv_wavelength: [inv_hi, inv_lo],
            wavenumber: wavenumber(geometry.freq_hz) as f32,
            t_min: geometry.t_min_m as f32,
            bounces: options.bounces as u32,
            tubes_per_block: TUBES_PER_BLOCK,
            spherical: matches!(options.distance, Distance::At(_)) as u32,
            zero: 0,
        };
        recorder.dispatch(
            &KERNEL,
            &params,
            &[
                &buffers.nodes,
                &buffers.triangles,
                &buffers.planes,
                &buffers.surfaces,
                &aspect_buffer,
                &block_buffer,
                &cell_buffer,
                &sum_buffer,
            ],
            Threads::Workgroups([blocks.len() as u32, 1, 1]),
        );
        let read = recorder.read(&sum_buffer);
        let mut done = recorder.submit()?;
        for (block, sum) in blocks.iter().zip(done.take(read)) {
            let s = &mut out[block[0] as usize];
            let z = |a: &[f32; 4], i: usize| Complex64::new(a[2 * i] as f64, a[2 * i + 1] as f64) * scale;
            for rx in 0..2 {
                s.every[rx][0] += z(&sum.every_v, rx);
                s.every[rx][1] += z(&sum.every_h, rx);
                s.last[rx][0] += z(&sum.last_v, rx);
                s.last[rx][1] += z(&sum.last_h, rx);
            }
        }
    }
    Ok(out)
}
