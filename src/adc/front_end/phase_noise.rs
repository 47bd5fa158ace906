//! Phase noise of the oscillator (CONVENTIONS eq. 100-102).
//!
//! φ(t) is Gaussian and stationary with the two-sided spectral density L(|f|) of the profile, up to offsets
//! of f_s/2; what the profile has beyond is left out. It runs on over all ramps of a frame, so ramps keep
//! the correlation that the profile gives them.

use super::draws::{PHASE_NOISE_STREAM, normals};
use super::timing::Timing;
use crate::scene::front_end::PhaseNoise;
use num_complex::Complex64;
use std::f64::consts::PI;
use std::ops::Range;

/// Longest stretch that is drawn as one, in half samples. Of longer frames the stretches are independent
/// of each other. (feng77 takes three for 2048 ramps.)
const LONGEST: usize = 1 << 22;

impl PhaseNoise {
    /// Phase noise L(f) as a power ratio in 1/Hz at the offset |f|: straight lines in dB over lg f, level beyond the
    /// ends.
    pub fn density_per_hz(&self, offset_hz: f64) -> f64 {
        let (f, l) = (&self.offset_hz, &self.dbc_per_hz);
        let x = offset_hz.abs();
        let db = match f.partition_point(|a| *a <= x) {
            0 => l[0],
            i if i == f.len() => l[i - 1],
            i => l[i - 1] + (l[i] - l[i - 1]) * (x / f[i - 1]).ln() / (f[i] / f[i - 1]).ln(),
        };
        crate::base::units::power_from_db(db)
    }

    /// Spectral density at offset f of the noise beside an echo of delay τ, over the echo, in 1/Hz:
    /// 4 sin²(π f τ) L(f) (Budge and Burt, "Range correlation effects in radars", IEEE National Radar
    /// Conference 1993).
    pub fn residual_density_per_hz(&self, offset_hz: f64, delay_s: f64) -> f64 {
        4.0 * (PI * offset_hz * delay_s).sin().powi(2) * self.density_per_hz(offset_hz)
    }
}

/// Number of samples by which noise at the largest offset moves an echo in time, (f_s/2)/S; it is also half the longest
/// delay.
pub fn reach(timing: &Timing) -> usize {
    (0.5 * timing.sample_rate_hz.powi(2) / timing.slope_hz_per_s.abs()).ceil() as usize
}

/// A stretch of φ that several ramps share.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stretch {
    /// Ramps of the stretch, as indices into `Timing::starts_s`.
    pub ramps: Range<usize>,
    /// Place of the first sample of each of these ramps, in half samples from the stretch's beginning.
    pub first: Vec<usize>,
    /// Number of half samples of the stretch; φ is periodic in it.
    pub length: usize,
}

/// Cuts a frame into stretches, each with `before` and `after` half samples around its records.
pub fn stretches(timing: &Timing, samples: usize, before: usize, after: usize) -> Vec<Stretch> {
    let rate = 2.0 * timing.sample_rate_hz;
    let starts = &timing.starts_s;
    let mut out = Vec::new();
    let mut from = 0;
    while from < starts.len() {
        let place = |i: usize| before + ((starts[i] - starts[from]) * rate).round().max(0.0) as usize;
        let end = |i: usize| place(i) + 2 * samples + after;
        let mut to = from + 1;
        while to < starts.len() && end(to) <= LONGEST {
            to += 1;
        }
        let length = fast_length((from..to).map(end).max().unwrap_or(0));
        out.push(Stretch { ramps: from..to, first: (from..to).map(place).collect(), length });
        from = to;
    }
    out
}

/// Line k of stretch `number`: φ(n) = Re Σ_k line(k) e^{2πj k n/length}. Lines are k with 0 < |f| ≤ f_s/2;
/// their variance is 2 L(f) Δf, which gives φ the variance Σ L Δf.
pub fn line(noise: &PhaseNoise, spacing_hz: f64, k: i64, seed: u64, frame: u32, number: usize) -> Complex64 {
    let sigma = (noise.density_per_hz(k as f64 * spacing_hz) * spacing_hz).sqrt();
    let index = (number as u64) << 32 | u64::from(k as i32 as u32);
    let [re, im] = normals(seed, frame, PHASE_NOISE_STREAM, index);
    Complex64::new(sigma * re, sigma * im)
}

/// The smallest number from `n` on with no prime factor above 5: transforms of it are quick.
pub fn fast_length(n: usize) -> usize {
    (n.max(1)..)
        .find(|n| {
            let mut rest = *n;
            for p in [2, 3, 5] {
                while rest % p == 0 {
                    rest /= p;
                }
            }
            rest == 1
        })
        .unwrap_or(n)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn profile_is_a_line_in_decibels_per_decade() {
        let p = PhaseNoise { offset_hz: vec![1e4, 1e6, 1e7], dbc_per_hz: vec![-80.0, -100.0, -130.0] };
        let db = |f: f64| 10.0 * p.density_per_hz(f).log10();
        for (f, l) in [(1.0, -80.0), (1e4, -80.0), (1e5, -90.0), (1e6, -100.0), (-1e5, -90.0), (1e9, -130.0)]
        {
            assert!((db(f) - l).abs() < 1e-9, "{f}: {}", db(f));
        }
        assert!((db(10f64.powf(6.5)) + 115.0).abs() < 1e-9);
        // Nothing at zero delay, four times the oscillator where half a period lies between, nothing again.
        assert_eq!(p.residual_density_per_hz(1e5, 0.0), 0.0);
        assert!((p.residual_density_per_hz(1e6, 0.5e-6) / p.density_per_hz(1e6) - 4.0).abs() < 1e-12);
        assert!(p.residual_density_per_hz(1e6, 1e-6) < 1e-30);
    }

    #[test]
    fn lengths() {
        assert_eq!([1, 7, 11, 513, 1021].map(fast_length), [1, 8, 12, 540, 1024]);
    }
}
