//! Thermal noise, drawn in f64 for cubes of either precision (CONVENTIONS eq. 13).

use super::synthesis::Precision;
use crate::adc::Cube;
use crate::adc::noise::Noise;
use crate::rng::philox4x32_10;
use crate::scene::radar::Sampling;
use num_complex::{Complex, Complex64};
use rayon::prelude::*;
use std::ops::AddAssign;

/// Adds `noise` to every sample.
pub fn add<T: Precision + AddAssign>(cube: &mut Cube<T>, noise: &Noise)
where
    Complex<T>: AddAssign,
{
    const BLOCK: usize = 4096;
    cube.data.par_chunks_mut(BLOCK).enumerate().for_each(|(block, samples)| {
        for (i, z) in samples.iter_mut().enumerate() {
            *z += T::round(sample(noise, (block * BLOCK + i) as u64));
        }
    });
}

/// The noise of one sample of the cube, √W.
pub fn sample(noise: &Noise, index: u64) -> Complex64 {
    let w = philox4x32_10(noise.counter(index), noise.key());
    let u = ((w[0] >> 8) + 1) as f64 * 2f64.powi(-24);
    let (sin, cos) = (w[1] as f64 * 2f64.powi(-32) * std::f64::consts::TAU).sin_cos();
    let r = noise.sigma * (-2.0 * u.ln()).sqrt();
    match noise.sampling {
        Sampling::Iq => Complex64::new(r * cos, r * sin),
        Sampling::Real => Complex64::new(r * cos, 0.0),
    }
}
