//! Pass of radix 8: the host side of the kernel, which `fft_pass` records.

use super::fft_params::{self, FftPassParams};
use crate::gpu::{Access, Kernel};

/// The kernel's row: sources, parameters, bindings and tolerance.
pub static KERNEL: Kernel = Kernel {
    stem: "dsp/fft_radix8",
    sources: &[
        include_str!("../../shaders/shared/complex.wgsl"),
        include_str!("../../shaders/shared/fft_pass.wgsl"),
        include_str!("../../shaders/dsp/fft_radix8.wgsl"),
    ],
    workgroup: [64, 1, 1],
    params: Some(FftPassParams::LAYOUT),
    storage: &[Access::Read, Access::Read, Access::ReadWrite],
    structs: &[],
    tolerance: fft_params::TOLERANCE,
};
