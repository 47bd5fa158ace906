//! Choice between engines.

use crate::adc;
use crate::dsp;
use crate::gpu::{Kernel, selftest};
use crate::rcs::po_sum;
use crate::trace::{closest, contribute, rays, scan};

/// The row of every shader in `shaders/`.
pub fn all_kernels() -> Vec<&'static Kernel> {
    vec![
        &selftest::KERNEL,
        &closest::KERNEL,
        &rays::KERNEL,
        &scan::KERNEL,
        &contribute::KERNEL,
        &po_sum::KERNEL,
        &adc::synthesis::KERNEL,
        &adc::noise::KERNEL,
        &dsp::fft::KERNEL,
        &dsp::power::KERNEL,
        &dsp::cfar_ca::KERNEL,
        &dsp::cfar_os::KERNEL,
        &dsp::peaks::KERNEL,
        &dsp::snapshot::KERNEL,
        &dsp::doa_beamform::KERNEL,
    ]
}
