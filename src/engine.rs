//! Choice between engines.

use crate::dsp;
use crate::gpu::{Kernel, selftest};

/// The row of every shader in `shaders/`.
pub fn all_kernels() -> Vec<&'static Kernel> {
    vec![
        &selftest::KERNEL,
        &dsp::fft::KERNEL,
        &dsp::power::KERNEL,
        &dsp::cfar_ca::KERNEL,
        &dsp::cfar_os::KERNEL,
        &dsp::peaks::KERNEL,
        &dsp::snapshot::KERNEL,
        &dsp::doa_beamform::KERNEL,
    ]
}
