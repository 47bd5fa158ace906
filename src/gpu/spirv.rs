//! Shaders in SPIR-V with every operation rounded by itself.
//!
//! Vulkan lets a driver join a product and a sum into one operation that is rounded once, and drivers of GPUs do so. Then a·b − c·d is
//! not the negative of c·d − a·b, and two faces that share an edge no longer agree on which side of it a corner lies: mirrors lose parts
//! (1 % of an echo, seen on an NVIDIA H200). WGSL has no word against it; SPIR-V has, the decoration `NoContraction`.

use super::wgsl::module_from_wgsl;
use naga::back::spv;
use naga::proc::{BoundsCheckPolicies, BoundsCheckPolicy};
use std::ops::Range;

/// Words of the header.
const HEADER: usize = 5;
/// Codes of instructions (SPIR-V 1.6, section 3.3).
const DECORATE: u32 = 71;
const MEMBER_DECORATE: u32 = 72;
const FIRST_TYPE: u32 = 19;
const LAST_TYPE: u32 = 39;
/// Arithmetic on floating-point numbers, which has its result in word 2: negation, sum, difference, product, quotient, remainders, and
/// products of vectors and matrices.
const ARITHMETIC: [u32; 14] = [127, 129, 131, 133, 136, 140, 141, 142, 143, 144, 145, 146, 147, 148];
/// The decoration.
const NO_CONTRACTION: u32 = 42;

/// A shader in SPIR-V whose operations a driver may not join. `bindings` are those of its buffers in WGSL, which are numbered as wgpu
/// numbers them on Vulkan, one after the other. `label` begins messages.
///
/// # Errors
/// Returns a text if the source is not valid.
pub(super) fn uncontracted(label: &str, source: &str, bindings: Range<u32>) -> Result<Vec<u32>, String> {
    let (module, info) = module_from_wgsl(label, source)?;
    let place = |binding| naga::ResourceBinding { group: 0, binding };
    let info_of = |at| spv::BindingInfo { descriptor_set: 0, binding: at, binding_array_size: None };
    let options = spv::Options {
        lang_version: (1, 0),
        flags: spv::WriterFlags::empty(),
        binding_map: bindings.zip(0..).map(|(binding, at)| (place(binding), info_of(at))).collect(),
        bounds_check_policies: BoundsCheckPolicies {
            index: BoundsCheckPolicy::Restrict,
            buffer: BoundsCheckPolicy::Restrict,
            ..Default::default()
        },
        zero_initialize_workgroup_memory: spv::ZeroInitializeWorkgroupMemoryMode::Polyfill,
        ..Default::default()
    };
    let entry =
        spv::PipelineOptions { shader_stage: naga::ShaderStage::Compute, entry_point: "main".to_string() };
    let words =
        spv::write_vec(&module, &info, &options, Some(&entry)).map_err(|e| format!("{label}: {e}"))?;
    decorated(&words).ok_or_else(|| format!("{label}: naga wrote incomplete SPIR-V"))
}

/// The same module with all arithmetic decorated; None if its instructions do not add up.
fn decorated(words: &[u32]) -> Option<Vec<u32>> {
    let (mut results, mut annotations) = (Vec::new(), None);
    let mut at = HEADER;
    while at < words.len() {
        let (code, length) = (words[at] & 0xffff, (words[at] >> 16) as usize);
        if length == 0 || at + length > words.len() {
            return None;
        }
        if annotations.is_none()
            && (code == DECORATE || code == MEMBER_DECORATE || (FIRST_TYPE..=LAST_TYPE).contains(&code))
        {
            annotations = Some(at);
        }
        if ARITHMETIC.contains(&code) {
            results.push(*words.get(at + 2)?);
        }
        at += length;
    }
    let annotations = annotations?;
    let marks = results.iter().flat_map(|id| [3 << 16 | DECORATE, *id, NO_CONTRACTION]);
    let (before, after) = (&words[..annotations], &words[annotations..]);
    Some(before.iter().copied().chain(marks).chain(after.iter().copied()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOURCE: &str = "@group(0) @binding(1) var<storage, read_write> x: array<vec2<f32>>;
        @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
            let a = x[id.x];
            let b = x[id.x + 1u];
            x[id.x] = vec2<f32>(a.x * b.y - a.y * b.x, dot(a, b) / (a.x + 1.0)) * 2.0;
        }";

    /// The decorations name each sum and product, in front of the types, and nothing else is changed.
    #[test]
    fn every_operation_is_decorated() {
        let words = uncontracted("a test", SOURCE, 1..2).unwrap();
        let (mut marked, mut there) = (Vec::new(), Vec::new());
        let mut at = HEADER;
        while at < words.len() {
            let code = words[at] & 0xffff;
            if code == DECORATE && words[at + 2] == NO_CONTRACTION {
                marked.push(words[at + 1]);
            }
            if ARITHMETIC.contains(&code) {
                there.push(words[at + 2]);
            }
            at += (words[at] >> 16) as usize;
        }
        // Two products and their difference, a dot, a sum, a quotient, and a vector times a number.
        assert_eq!(there.len(), 7);
        assert_eq!(marked, there);
        // In the middle of the last store, behind which stand the return and the end of the function.
        assert_eq!(decorated(&words[..words.len() - 3]), None);
    }
}
