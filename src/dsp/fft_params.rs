//! Parameters of the kernels that do one pass of a transform over global memory.

use crate::gpu::Tolerance;
use crate::gpu_struct;

gpu_struct! {
    /// Uniform of the passes (`shaders/shared/fft_pass.wgsl`).
    pub struct FftPassParams {
        pub lines: u32,
        pub length: u32,
        pub butterflies: u32,
        pub done: u32,
        pub turn: u32,
        pub count: u32,
        pub in_base: u32,
        pub in_line: u32,
        pub in_step: u32,
        pub out_base: u32,
        pub out_line: u32,
        pub out_step: u32,
        pub shift: u32,
        pub first: u32,
        pub kept: u32,
        pub lines_first: u32,
    }
}

pub(super) const TOLERANCE: Tolerance = Tolerance {
    relative_l2: 6e-7,
    reason: "c eps sqrt(log2 N + log2 M) for two transforms with c = 1, as in one workgroup",
};
