//! Faces on which segments throw their shadows, on the gpu engine.

use super::line_arrays::LineParams;
use crate::gpu::numbers::PAIRS;
use crate::gpu::{Access, Kernel, Tolerance};

/// The kernel's row: sources, parameters, bindings and tolerance.
pub static KERNEL: Kernel = Kernel {
    stem: "trace/line_shadow",
    sources: &[
        include_str!("../../shaders/shared/linear.wgsl"),
        include_str!("../../shaders/shared/df64.wgsl"),
        PAIRS,
        include_str!("../../shaders/shared/line_params.wgsl"),
        include_str!("../../shaders/shared/lines.wgsl"),
        include_str!("../../shaders/trace/line_shadow.wgsl"),
    ],
    workgroup: [64, 1, 1],
    params: Some(LineParams::LAYOUT),
    storage: &[Access::Read, Access::Read, Access::ReadWrite, Access::ReadWrite, Access::ReadWrite],
    structs: &[],
    tolerance: Tolerance {
        relative_l2: 1e-4,
        reason: "judged by the areas of what it lights: where a line touches another, rounding decides",
    },
};
