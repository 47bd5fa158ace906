//! Filters between mixer and converter (CONVENTIONS eq. 105, 106).
//!
//! The filters are real and the same in I and Q, so H(−f) = H(f)*. They act on settled tones: what they do
//! after the ramp's start is taken to be over when sampling begins. An echo is multiplied by H at its own
//! beat frequency before it is sampled, so one that a given low-pass lets through above the
//! band comes back aliased, as it does in the hardware.

use super::timing::Timing;
use crate::scene::front_end::{Butterworth, Filters};
use crate::scene::radar::Sampling;
use num_complex::Complex64;
use std::f64::consts::PI;

/// Images of the band that are summed one by one; the rest is an integral.
const IMAGES: i32 = 32;

impl Butterworth {
    /// Response of the low-pass, Π 1/(jf/f_c − p_k), p_k = e^{jπ(2k+n+1)/2n}; it is 1 at f = 0.
    pub fn low_pass(&self, freq_hz: f64) -> Complex64 {
        self.prototype(freq_hz / self.corner_hz)
    }

    /// Response of the high-pass: that of the low-pass at −f_c/f in place of f/f_c.
    pub fn high_pass(&self, freq_hz: f64) -> Complex64 {
        if freq_hz == 0.0 { Complex64::ZERO } else { self.prototype(-self.corner_hz / freq_hz) }
    }

    /// Power response |H|² of the low-pass, 1/(1 + (f/f_c)^2n).
    pub fn low_pass_power(&self, freq_hz: f64) -> f64 {
        1.0 / (1.0 + (freq_hz / self.corner_hz).powi(2 * self.order as i32))
    }

    /// Power response |H|² of the high-pass, 1/(1 + (f_c/f)^2n).
    pub fn high_pass_power(&self, freq_hz: f64) -> f64 {
        1.0 / (1.0 + (self.corner_hz / freq_hz).powi(2 * self.order as i32))
    }

    fn prototype(&self, w: f64) -> Complex64 {
        let n = self.order;
        // Far outside, the product of factors would overflow before its inverse is zero.
        if w.abs().powi(n as i32) > 1e150 {
            return Complex64::ZERO;
        }
        let mut product = Complex64::ONE;
        for k in 0..n {
            let pole = Complex64::cis(PI * (2 * k + n + 1) as f64 / (2 * n) as f64);
            product *= Complex64::new(0.0, w) - pole;
        }
        product.inv()
    }
}

impl Filters {
    /// Whether no filter acts.
    pub fn is_off(&self) -> bool {
        self.high_pass.is_none() && self.low_pass.is_none()
    }

    /// Factor of a tone at the mixer's output, without the ideal low-pass.
    pub fn gain(&self, beat_hz: f64) -> Complex64 {
        let mut h = Complex64::ONE;
        if let Some(f) = &self.high_pass {
            h *= f.high_pass(beat_hz);
        }
        if let Some(f) = &self.low_pass {
            h *= f.low_pass(beat_hz);
        }
        h
    }

    /// Power response |H|² of the filters at `beat_hz`.
    pub fn power(&self, beat_hz: f64) -> f64 {
        self.high_pass.map_or(1.0, |f| f.high_pass_power(beat_hz))
            * self.low_pass.map_or(1.0, |f| f.low_pass_power(beat_hz))
    }

    /// Whether an echo is left out: outside the band when the low-pass is ideal, below 10⁻⁸ in amplitude
    /// (−160 dB) otherwise.
    pub fn stops(&self, sampling: Sampling, sample_rate_hz: f64, beat_hz: f64) -> bool {
        match (self.low_pass, sampling) {
            (Some(_), _) => self.power(beat_hz) < 1e-16,
            (None, Sampling::Iq) => !(0.0..sample_rate_hz).contains(&beat_hz),
            (None, Sampling::Real) => beat_hz.abs() >= 0.5 * sample_rate_hz,
        }
    }

    /// Spectral density of the sampled noise over that of the white noise of eq. 13, at `freq_hz` of the
    /// band: Σ_m |H(f + m f_s)|² over all images, or |H|² alone when the low-pass is ideal.
    pub fn noise_density(&self, sample_rate_hz: f64, freq_hz: f64) -> f64 {
        let Some(low) = &self.low_pass else { return self.power(freq_hz) };
        let images = IMAGES + (8.0 * low.corner_hz / sample_rate_hz).min(1e6) as i32;
        let near: f64 = (-images..=images).map(|m| self.power(freq_hz + f64::from(m) * sample_rate_hz)).sum();
        // The sum from there on as the integral from half an image earlier: ∫ dx/(1 + x^2n), x = f/f_c > 1, by
        // its first two terms.
        let n = 2.0 * low.order as f64;
        let tail = |edge_hz: f64| {
            let x = edge_hz / low.corner_hz;
            x.powf(1.0 - n) / (n - 1.0) - x.powf(1.0 - 2.0 * n) / (2.0 * n - 1.0)
        };
        let edge_hz = (f64::from(images) + 0.5) * sample_rate_hz;
        near + low.corner_hz / sample_rate_hz * (tail(edge_hz + freq_hz) + tail(edge_hz - freq_hz))
    }

    /// Square root of [`Filters::noise_density`] at the `samples` frequencies of the transform of one record, in its
    /// order; None when all is ideal.
    pub fn noise_shape(&self, timing: &Timing, samples: usize) -> Option<Vec<f64>> {
        if self.is_off() {
            return None;
        }
        let fs = timing.sample_rate_hz;
        let at = |k: usize| {
            let f = k as f64 * fs / samples as f64;
            // The ideal band of "iq" is 0..f_s (its mirror on a falling ramp), that of "real" −f_s/2..f_s/2.
            let f = match timing.sampling {
                Sampling::Iq if timing.slope_hz_per_s < 0.0 && k > 0 => f - fs,
                Sampling::Iq => f,
                Sampling::Real if 2 * k > samples => f - fs,
                Sampling::Real => f,
            };
            self.noise_density(fs, f).sqrt()
        };
        Some((0..samples).map(at).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn both(order: usize, low: f64, high: f64) -> Filters {
        Filters {
            high_pass: Some(Butterworth { order, corner_hz: high }),
            low_pass: Some(Butterworth { order, corner_hz: low }),
        }
    }

    proptest! {
        #[test]
        fn magnitude_is_butterworths(order in 1usize..=16, f in 1e-3f64..1e3) {
            let b = Butterworth { order, corner_hz: 1.0 };
            let w = f.powi(2 * order as i32);
            let low = b.low_pass(f).norm_sqr();
            prop_assert!((low * (1.0 + w) - 1.0).abs() < 1e-10 || (w > 1e250 && low == 0.0));
            let high = b.high_pass(f).norm_sqr();
            prop_assert!((high * (1.0 + 1.0 / w) - 1.0).abs() < 1e-10 || (w < 1e-250 && high == 0.0));
            prop_assert!((b.low_pass_power(f) - low).abs() < 1e-10 && (b.high_pass_power(f) - high).abs() < 1e-10);
            let both = Filters { high_pass: Some(b), low_pass: Some(Butterworth { order: 2, corner_hz: 3.0 }) };
            prop_assert!((both.power(f) - both.gain(f).norm_sqr()).abs() < 1e-10);
            // The response of a real filter.
            prop_assert!((b.low_pass(-f) - b.low_pass(f).conj()).norm() <= 1e-12 * b.low_pass(f).norm());
            prop_assert!((b.high_pass(-f) - b.high_pass(f).conj()).norm() <= 1e-12 * b.high_pass(f).norm());
        }
    }

    /// First and second order as circuits: 1/(1 + ju) and 1/(1 + √2 ju − u²).
    #[test]
    fn phase_is_that_of_the_circuit() {
        for u in [-3.0, -0.7, 0.0, 0.1, 1.0, 20.0] {
            let b = |order| Butterworth { order, corner_hz: 2e6 }.low_pass(u * 2e6);
            assert!((b(1) - (Complex64::new(1.0, u)).inv()).norm() < 1e-14);
            assert!(
                (b(2) - (Complex64::new(1.0 - u * u, std::f64::consts::SQRT_2 * u)).inv()).norm() < 1e-14
            );
        }
        // s/(1 + s).
        let h = Butterworth { order: 1, corner_hz: 1.0 }.high_pass(0.5);
        assert!((h - Complex64::new(0.0, 0.5) / Complex64::new(1.0, 0.5)).norm() < 1e-14);
        let h = Butterworth { order: 3, corner_hz: 1.0 };
        assert_eq!((h.high_pass(0.0), h.high_pass_power(0.0)), (Complex64::ZERO, 0.0));
    }

    /// Far below a corner of order n the high-pass rises by 20n dB a decade: with n = 2 it makes up for
    /// the R⁻⁴ of the radar equation.
    #[test]
    fn second_order_makes_up_for_distance() {
        let f = Filters { high_pass: Some(Butterworth { order: 2, corner_hz: 20e6 }), low_pass: None };
        let received = |r: f64| f.gain(r * 1e5).norm_sqr() * r.powi(-4);
        assert!((10.0 * (received(40.0) / received(5.0)).log10()).abs() < 0.02);
    }

    /// Σ_m 1/(1 + ((f + m)/c)²) = πc sinh 2πc / (cosh 2πc − cos 2πf).
    #[test]
    fn noise_of_all_images() {
        for (f, c) in [(0.0f64, 0.5f64), (0.3, 0.5), (0.5, 0.2), (0.9, 3.0)] {
            let filters =
                Filters { high_pass: None, low_pass: Some(Butterworth { order: 1, corner_hz: c * 10e6 }) };
            let (a, b) = (2.0 * PI * c, 2.0 * PI * f);
            let sum = PI * c * a.sinh() / (a.cosh() - b.cos());
            let ours = filters.noise_density(10e6, f * 10e6);
            assert!((ours / sum - 1.0).abs() < 1e-5, "{f} {c}: {ours} {sum}");
        }
        // The mean over the band is the whole noise bandwidth over f_s: order 4 has f_c (π/2n)/sin(π/2n) a side.
        let filters = Filters { high_pass: None, low_pass: Some(Butterworth { order: 4, corner_hz: 4e6 }) };
        let mean = (0..1000).map(|k| filters.noise_density(10e6, k as f64 * 1e4)).sum::<f64>() / 1000.0;
        let x = PI / 8.0;
        assert!((mean / (0.8 * x / x.sin()) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn band() {
        let ideal = Filters::default();
        assert!(ideal.is_off() && ideal.gain(3e6) == Complex64::ONE);
        assert!(ideal.stops(Sampling::Iq, 1e7, -1.0) && !ideal.stops(Sampling::Iq, 1e7, 9e6));
        assert!(ideal.stops(Sampling::Real, 1e7, 5e6) && !ideal.stops(Sampling::Real, 1e7, -4e6));
        let real = both(4, 4e6, 1e5);
        assert!(!real.stops(Sampling::Real, 1e7, 9e6), "it has to alias");
        assert!(real.stops(Sampling::Real, 1e7, 4e6 * 101.0));
    }
}
