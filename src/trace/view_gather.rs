//! Polygons of a frame put side by side, on the gpu engine.

use super::views::ViewParams;
use crate::gpu::{Access, Kernel, Tolerance};

/// The kernel's row: sources, parameters, bindings and tolerance.
pub static KERNEL: Kernel = Kernel {
    stem: "trace/view_gather",
    sources: &[
        include_str!("../../shaders/shared/linear.wgsl"),
        include_str!("../../shaders/shared/view_params.wgsl"),
        include_str!("../../shaders/trace/view_gather.wgsl"),
    ],
    workgroup: [64, 1, 1],
    params: Some(ViewParams::LAYOUT),
    storage: &[Access::Read, Access::Read, Access::Read, Access::ReadWrite, Access::ReadWrite],
    structs: &[],
    tolerance: Tolerance { relative_l2: 0.0, reason: "it copies" },
};
