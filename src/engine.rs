//! Choice between engines.

use crate::gpu::{Kernel, selftest};
use crate::trace;

/// The row of every shader in `shaders/`.
pub fn all_kernels() -> Vec<&'static Kernel> {
    vec![&selftest::KERNEL, &trace::closest::KERNEL]
}
