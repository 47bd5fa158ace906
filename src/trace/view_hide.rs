//! What nearer faces leave of the polygons of a frame, on the gpu engine.

use super::views::ViewParams;
use crate::gpu::{Access, Kernel, Tolerance};

/// The kernel's row: sources, parameters, bindings and tolerance.
pub static KERNEL: Kernel = Kernel {
    stem: "trace/view_hide",
    sources: &[
        include_str!("../../shaders/shared/linear.wgsl"),
        include_str!("../../shaders/shared/view_params.wgsl"),
        include_str!("../../shaders/shared/views.wgsl"),
        include_str!("../../shaders/trace/view_hide.wgsl"),
    ],
    workgroup: [64, 1, 1],
    params: Some(ViewParams::LAYOUT),
    storage: &[
        Access::Read,
        Access::Read,
        Access::Read,
        Access::ReadWrite,
        Access::ReadWrite,
        Access::ReadWrite,
        Access::Read,
        Access::ReadWrite,
    ],
    structs: &[],
    tolerance: Tolerance {
        relative_l2: 1e-4,
        reason: "judged by the echoes that its polygons give: where a polygon is cut differs from f64 by slivers",
    },
};
