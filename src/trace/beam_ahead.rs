//! Faces that stand ahead of reflected beams, and what leaves between them, on the gpu engine.

use super::beams::BeamParams;
use crate::gpu::{Access, Kernel, Tolerance};

/// The kernel's row: sources, parameters, bindings and tolerance.
pub static KERNEL: Kernel = Kernel {
    stem: "trace/beam_ahead",
    sources: &[
        include_str!("../../shaders/shared/linear.wgsl"),
        include_str!("../../shaders/shared/polygon.wgsl"),
        include_str!("../../shaders/shared/beams.wgsl"),
        include_str!("../../shaders/trace/beam_ahead.wgsl"),
    ],
    workgroup: [64, 1, 1],
    params: Some(BeamParams::LAYOUT),
    storage: &[
        Access::Read,
        Access::Read,
        Access::Read,
        Access::ReadWrite,
        Access::ReadWrite,
        Access::ReadWrite,
        Access::ReadWrite,
        Access::ReadWrite,
    ],
    structs: &[],
    tolerance: Tolerance {
        relative_l2: 1e-4,
        reason: "judged by the fields that its polygons radiate: where a polygon is cut differs from f64 by slivers",
    },
};
