//! Thermal noise (CONVENTIONS eq. 13): the same draws for cubes of either precision, turned into
//! samples in f64, or by vectors in f32.

use super::synthesis::{LANES, cis, madd};
use crate::adc::Cube;
use crate::adc::noise::Noise;
use crate::base::rng::philox4x32_10;
use crate::base::simd::{Vectorised, lanes, vectorised};
use crate::base::tasks::Tasks;
use crate::scene::radar::Sampling;
use num_complex::{Complex, Complex32, Complex64};
use rayon::prelude::*;

/// Precision of a cube that noise is added to: f64 or f32.
pub trait Precision: Copy + Send + Sync {
    #[doc(hidden)]
    fn add_from(noise: &Noise, first: u64, samples: &mut [Complex<Self>]);
}

impl Precision for f64 {
    fn add_from(noise: &Noise, first: u64, samples: &mut [Complex64]) {
        for (z, index) in samples.iter_mut().zip(first..) {
            *z += sample(noise, index);
        }
    }
}

impl Precision for f32 {
    fn add_from(noise: &Noise, first: u64, samples: &mut [Complex32]) {
        vectorised(Draws { noise, first, samples });
    }
}

/// Adds `noise` to every sample.
pub fn add<T: Precision>(cube: &mut Cube<T>, noise: &Noise) {
    const BLOCK: usize = 4096;
    cube.data.par_chunks_mut(BLOCK).enumerate().for_each_tasks(|(block, samples)| {
        T::add_from(noise, (block * BLOCK) as u64, samples);
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

struct Draws<'a> {
    noise: &'a Noise,
    first: u64,
    samples: &'a mut [Complex32],
}

/// Samples whose draws go through each step together.
const GROUP: usize = 64;

impl Vectorised for Draws<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FMA: bool>(self) {
        let mut words = [0u32; GROUP];
        let (mut radius, mut cosines, mut sines) = ([0f32; GROUP], [0f32; GROUP], [0f32; GROUP]);
        let sigma = self.noise.sigma as f32;
        let real = self.noise.sampling == Sampling::Real;
        for (group, samples) in self.samples.chunks_mut(GROUP).enumerate() {
            let first = self.first + (group * GROUP) as u64;
            for g in 0..GROUP / LANES {
                let counter = self.noise.counter(first + (g * LANES) as u64);
                let (word, angle) = philox(counter, self.noise.key());
                let (cosine, sine) = cis::<FMA>(&angle);
                for l in 0..LANES {
                    (words[g * LANES + l], cosines[g * LANES + l], sines[g * LANES + l]) =
                        (word[l], cosine[l], sine[l]);
                }
            }
            for i in 0..GROUP {
                // From 2⁻²⁴ to 1 and exact, so that −2 ln u is not negative.
                let u = ((words[i] >> 8) + 1) as f32 * (1.0 / 16_777_216.0);
                radius[i] = sigma * (-2.0 * ln::<FMA>(u)).max(0.0).sqrt();
            }
            if real {
                sines.fill(0.0);
            }
            for (i, z) in samples.iter_mut().enumerate() {
                z.re += radius[i] * cosines[i];
                z.im += radius[i] * sines[i];
            }
        }
    }
}

/// The first two words of [`philox4x32_10`] of consecutive counters. Words stand in the lower halves of
/// u64, whose upper halves hold anything: that is what vectors multiply.
#[inline(always)]
fn philox(counter: [u32; 4], key: [u32; 2]) -> ([u32; LANES], [u32; LANES]) {
    type Words = [u64; LANES];
    let first = u64::from(counter[1]) << 32 | u64::from(counter[0]);
    let mut c0: Words = lanes!(LANES, l => first.wrapping_add(l as u64));
    let mut c1: Words = lanes!(LANES, l => c0[l] >> 32);
    let (mut c2, mut c3) = ([u64::from(counter[2]); LANES], [u64::from(counter[3]); LANES]);
    let (mut k0, mut k1) = (u64::from(key[0]), u64::from(key[1]));
    for _ in 0..10 {
        let p: Words = lanes!(LANES, l => (c0[l] & 0xffff_ffff) * 0xD251_1F53);
        let q: Words = lanes!(LANES, l => (c2[l] & 0xffff_ffff) * 0xCD9E_8D57);
        c0 = lanes!(LANES, l => (q[l] >> 32) ^ c1[l] ^ k0);
        c2 = lanes!(LANES, l => (p[l] >> 32) ^ c3[l] ^ k1);
        (c1, c3) = (q, p);
        k0 = k0.wrapping_add(0x9E37_79B9);
        k1 = k1.wrapping_add(0xBB67_AE85);
    }
    (lanes!(LANES, l => c0[l] as u32), lanes!(LANES, l => c1[l] as u32))
}

/// Natural logarithm of a normal positive number, to about 1e-7 of itself: the polynomial of
/// `logf` in Moshier's Cephes library, for mantissas from √½ to √2.
#[inline(always)]
fn ln<const FMA: bool>(u: f32) -> f32 {
    // Exponents change at √½, whose bits are taken off and put back.
    const ROOT_HALF: u32 = 0x3f35_04f3;
    let bits = u.to_bits().wrapping_sub(ROOT_HALF);
    let exponent = (bits as i32 >> 23) as f32;
    let f = f32::from_bits((bits & 0x007f_ffff) + ROOT_HALF) - 1.0;
    let mut p = 7.037_683_6e-2;
    for c in [
        -1.151_461e-1,
        1.167_699_9e-1,
        -1.242_014_1e-1,
        1.424_932_3e-1,
        -1.666_805_7e-1,
        2.000_071_5e-1,
        -2.499_999_4e-1,
        3.333_333e-1,
    ] {
        p = madd::<FMA>(p, f, c);
    }
    let z = f * f;
    let rest = madd::<FMA>(p * f, z, -0.5 * z) + f;
    madd::<FMA>(exponent, std::f32::consts::LN_2, rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(sampling: Sampling, seed: u64) -> Noise {
        Noise { sigma: 2.5e-7, sampling, seed, frame: 3 }
    }

    #[test]
    fn f32_draws_are_the_f64_ones() {
        for (sampling, seed) in [(Sampling::Iq, 0x1234_5678_9abc_def0), (Sampling::Real, 7)] {
            let n = noise(sampling, seed);
            // Odd numbers of samples; counters that pass 2³².
            for (first, count) in [(0u64, 100_003), (u64::from(u32::MAX) - 37, 200), (5, 1)] {
                let mut got = vec![Complex32::ZERO; count];
                f32::add_from(&n, first, &mut got);
                for (z, index) in got.iter().zip(first..) {
                    let want = sample(&n, index);
                    let error = (Complex64::new(z.re.into(), z.im.into()) - want).norm();
                    assert!(error <= 6e-7 * want.norm(), "{index}: {z} {want}");
                }
            }
        }
    }

    #[test]
    fn logarithm_over_its_whole_domain() {
        for i in (1..=1u32 << 24).step_by(37).chain([1, 2, 3, (1 << 24) - 1, 1 << 24]) {
            let u = i as f32 / 16_777_216.0;
            let want = f64::from(u).ln();
            let error = (f64::from(ln::<false>(u)) - want).abs();
            assert!(error <= 2.5e-7 * want.abs(), "{u}: {error:e}");
        }
    }
}
