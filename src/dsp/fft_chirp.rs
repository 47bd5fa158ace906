//! Products of lines with a vector: the host side of the kernel, and the vectors of Bluestein's transform
//! (CONVENTIONS eq. 86).

use crate::gpu::{Access, Kernel, Tolerance};
use crate::gpu_struct;
use num_complex::Complex64;
use std::f64::consts::PI;

gpu_struct! {
    /// Uniform of `shaders/dsp/fft_chirp.wgsl`.
    pub struct FftChirpParams {
        pub lines: u32,
        pub length: u32,
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
        pub conjugate_in: u32,
        pub conjugate_out: u32,
    }
}

/// The kernel's row: sources, parameters, bindings and tolerance.
pub static KERNEL: Kernel = Kernel {
    stem: "dsp/fft_chirp",
    sources: &[
        include_str!("../../shaders/shared/complex.wgsl"),
        include_str!("../../shaders/dsp/fft_chirp.wgsl"),
    ],
    workgroup: [64, 1, 1],
    params: Some(FftChirpParams::LAYOUT),
    storage: &[Access::Read, Access::Read, Access::ReadWrite],
    structs: &[],
    tolerance: Tolerance { relative_l2: 2e-7, reason: "one complex product a value" },
};

/// The chirp e^(-j pi i^2 / n) for i in 0..n; the square is reduced as a whole number.
pub fn chirp(n: usize) -> Vec<Complex64> {
    (0..n as u64).map(|i| Complex64::cis(-PI * (i * i % (2 * n as u64)) as f64 / n as f64)).collect()
}

/// Transform of length `m` >= 2n - 1 of the conjugate chirp, wrapped around, over m: the product with it
/// convolves.
pub fn kernel(n: usize, m: usize) -> Vec<Complex64> {
    let mut b = vec![Complex64::default(); m];
    for (i, c) in chirp(n).into_iter().enumerate() {
        b[i] = c.conj() / m as f64;
        b[(m - i) % m] = b[i];
    }
    catseye_math::fft::forward(m).process(&mut b);
    b
}
