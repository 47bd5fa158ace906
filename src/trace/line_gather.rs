//! What segments have brought, side by side, on the gpu engine.

use super::line_arrays::LineParams;
use crate::gpu::{Access, Kernel, Tolerance};

/// The kernel's row: sources, parameters, bindings and tolerance.
pub static KERNEL: Kernel = Kernel {
    stem: "trace/line_gather",
    sources: &[
        include_str!("../../shaders/shared/linear.wgsl"),
        include_str!("../../shaders/shared/line_params.wgsl"),
        include_str!("../../shaders/trace/line_gather.wgsl"),
    ],
    workgroup: [64, 1, 1],
    params: Some(LineParams::LAYOUT),
    storage: &[Access::Read, Access::Read, Access::ReadWrite, Access::ReadWrite, Access::ReadWrite],
    structs: &[],
    tolerance: Tolerance { relative_l2: 0.0, reason: "it copies" },
};
