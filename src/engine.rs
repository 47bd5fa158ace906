//! Choice between engines.

use crate::adc;
use crate::gpu::{Kernel, selftest};

/// The row of every shader in `shaders/`.
pub fn all_kernels() -> Vec<&'static Kernel> {
    vec![&selftest::KERNEL, &adc::synthesis::KERNEL, &adc::noise::KERNEL]
}
