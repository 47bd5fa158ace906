//! Mie series: the exact field that a sphere scatters.
//!
//! Time factor e^{+jωt} and the scattering matrix of CONVENTIONS eq. (3). With ψₙ(x) = x jₙ(x) and
//! ξₙ(x) = x hₙ⁽²⁾(x) the far field of a sphere is the sum of Bohren and Huffman, *Absorption and
//! Scattering of Light by Small Particles* (1983), eq. (4.74),
//! S₁ = Σ (2n+1)/(n(n+1)) (aₙπₙ + bₙτₙ), S₂ = Σ (2n+1)/(n(n+1)) (aₙτₙ + bₙπₙ),
//! with their coefficients conjugated for this time factor. What the sphere is made of enters only
//! through aₙ and bₙ.

use crate::error::{BadInput, Result};
use crate::units::wavenumber;
use num_complex::Complex64;

/// Sizes k·radius for which the series is summed.
pub const KA_RANGE: (f64, f64) = (1e-6, 1e5);

/// The series of one sphere at one frequency.
#[derive(Debug, Clone, PartialEq)]
pub struct SphereSeries {
    wavenumber: f64,
    /// Electric and magnetic multipoles, n = 1, 2, …
    a: Vec<Complex64>,
    b: Vec<Complex64>,
}

impl SphereSeries {
    /// A perfectly conducting sphere: aₙ = ψₙ′/ξₙ′, bₙ = ψₙ/ξₙ at x = k·radius (Bohren and Huffman
    /// eq. 4.53 for infinite refractive index). Fails unless k·radius lies in [`KA_RANGE`].
    pub fn pec(radius_m: f64, freq_hz: f64) -> Result<SphereSeries> {
        let k = wavenumber(freq_hz);
        let x = k * radius_m;
        if !(KA_RANGE.0..=KA_RANGE.1).contains(&x) {
            return Err(BadInput::new("the Mie series is not summed for this size of sphere")
                .key("k * radius")
                .value(x)
                .allowed(format!("{:e}..{:e}", KA_RANGE.0, KA_RANGE.1))
                .into());
        }
        let r = Riccati::new(x, terms(x));
        let (a, b) = (1..r.psi.len())
            .map(|n| {
                let (psi, xi) = (r.psi[n], r.xi(n));
                let order = n as f64 / x;
                let psi_prime = r.psi[n - 1] - order * psi;
                let xi_prime = r.xi(n - 1) - order * xi;
                (psi_prime / xi_prime, psi / xi)
            })
            .unzip();
        Ok(SphereSeries { wavenumber: k, a, b })
    }

    /// S_vv = S_hh towards the source, metres, referred to the centre.
    pub fn backscatter_m(&self) -> Complex64 {
        self.bistatic_m(0.0).0
    }

    /// (S across, S along) in metres for the angle at the sphere between the directions to the
    /// transmitter and to the receiver (radians, 0 is backscatter, pi is forward). "Across" is the
    /// polarisation normal to the plane of both directions: V when both are level (CONVENTIONS
    /// eq. 2); "along" lies in that plane: H then.
    pub fn bistatic_m(&self, bistatic_angle: f64) -> (Complex64, Complex64) {
        // Cosine of the scattering angle, which is measured from the forward direction.
        let mu = -bistatic_angle.cos();
        let (mut pi_before, mut pi) = (0.0, 1.0);
        let (mut s1, mut s2) = (Complex64::ZERO, Complex64::ZERO);
        for (i, (a, b)) in self.a.iter().zip(&self.b).enumerate() {
            let n = (i + 1) as f64;
            let tau = n * mu * pi - (n + 1.0) * pi_before;
            let w = (2.0 * n + 1.0) / (n * (n + 1.0));
            s1 += w * (a * pi + b * tau);
            s2 += w * (a * tau + b * pi);
            let next = ((2.0 * n + 1.0) * mu * pi - (n + 1.0) * pi_before) / n;
            (pi_before, pi) = (pi, next);
        }
        // E_s = S E_i e^{-jkr}/(jkr). The in-plane vector of the receiving side points against
        // Bohren and Huffman's, because both directions here lead away from the target.
        let scale = Complex64::new(0.0, -1.0 / self.wavenumber);
        (scale * s1, -scale * s2)
    }
}

/// Number of terms beyond which the rest is below rounding error: Wiscombe's criterion (*Applied
/// Optics* 19, 1980, 1505), which asks for x + 4 x^{1/3} + 2, with room for full f64 precision.
fn terms(x: f64) -> usize {
    (x + 8.0 * x.cbrt() + 10.0).ceil() as usize
}

/// Riccati–Bessel functions ψₙ(x) = x jₙ(x) and ηₙ(x) = x yₙ(x), n = 0 … terms.
struct Riccati {
    psi: Vec<f64>,
    eta: Vec<f64>,
}

impl Riccati {
    fn new(x: f64, terms: usize) -> Riccati {
        let (s, c) = x.sin_cos();
        // yₙ grows with n beyond x, so upward recurrence is stable.
        let mut eta = Vec::with_capacity(terms + 1);
        eta.push(-c);
        eta.push(-c / x - s);
        for n in 1..terms {
            eta.push((2 * n + 1) as f64 / x * eta[n] - eta[n - 1]);
        }
        // jₙ shrinks there: Miller's downward recurrence from well above, scaled at the end.
        let start = terms + 40;
        let mut psi = vec![0.0; terms + 1];
        let (mut above, mut here) = (0.0, 1e-250);
        for n in (0..=start).rev() {
            if n <= terms {
                psi[n] = here;
            }
            if n > 0 {
                let below = (2 * n + 1) as f64 / x * here - above;
                (above, here) = (here, below);
                if here.abs() > 1e200 {
                    (above, here) = (above * 1e-200, here * 1e-200);
                    for p in psi.iter_mut().skip(n) {
                        *p *= 1e-200;
                    }
                }
            }
        }
        // ψ₀ = sin x and ψ₁ = sin x / x - cos x have no common zero; take the larger.
        let psi_1 =
            if x < 0.1 { x * x / 3.0 * (1.0 - x * x / 10.0 * (1.0 - x * x / 28.0)) } else { s / x - c };
        let scale = if s.abs() >= psi_1.abs() { s / psi[0] } else { psi_1 / psi[1] };
        for p in &mut psi {
            *p *= scale;
        }
        Riccati { psi, eta }
    }

    fn xi(&self, n: usize) -> Complex64 {
        Complex64::new(self.psi[n], -self.eta[n])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::{C0, db_from_power};
    use std::f64::consts::PI;

    const F: f64 = 77e9;

    fn radius(ka: f64) -> f64 {
        ka / wavenumber(F)
    }

    #[test]
    fn bessel_functions_keep_their_wronskian() {
        for x in [1e-6, 1e-3, 0.5, PI, 10.0, 2.0 * PI, 161.4, 2000.0, 1e5] {
            let r = Riccati::new(x, terms(x));
            for n in 1..r.psi.len() {
                let w = r.psi[n] * r.eta[n - 1] - r.psi[n - 1] * r.eta[n];
                assert!((w - 1.0).abs() < 1e-13 * (10.0 + x), "x {x} n {n}: {w}");
            }
        }
    }

    #[test]
    fn bessel_functions_of_order_two() {
        for x in [0.7, 3.0, 40.0f64] {
            let r = Riccati::new(x, terms(x));
            let (s, c) = x.sin_cos();
            assert!((r.psi[2] - ((3.0 / (x * x) - 1.0) * s - 3.0 / x * c)).abs() < 1e-14);
            assert!((r.eta[2] - ((1.0 - 3.0 / (x * x)) * c - 3.0 / x * s)).abs() < 1e-13);
        }
    }

    /// Large spheres return the mirror image of the source: -(a/2) e^{+2jka}, which checks sign and
    /// phase. The first correction of geometric optics is of relative size 1/(2ka).
    #[test]
    fn optical_limit_with_its_phase() {
        for ka in [200.0, 1999.5, 3e4] {
            let a = radius(ka);
            let s = SphereSeries::pec(a, F).unwrap().backscatter_m();
            let optics = Complex64::from_polar(0.5 * a, 2.0 * ka + PI);
            assert!((s - optics).norm() / optics.norm() < 0.6 / ka, "{ka}: {s} {optics}");
        }
    }

    /// Rayleigh: electric and magnetic dipole, backscatter 9 (ka)⁴ pi a², and the null of both dipoles'
    /// interference at a bistatic angle of 120 degrees in the in-plane polarisation.
    #[test]
    fn rayleigh_limit() {
        for ka in [1e-5, 1e-3, 1e-2] {
            let a = radius(ka);
            let m = SphereSeries::pec(a, F).unwrap();
            let sigma = 4.0 * PI * m.backscatter_m().norm_sqr();
            assert!((sigma / (9.0 * ka.powi(4) * PI * a * a) - 1.0).abs() < 2.0 * ka * ka + 1e-9);
            let across = m.bistatic_m(0.0).0.norm();
            // S_along ~ cos(scattering angle) - 1/2: zero at a scattering angle of 60 degrees.
            let (_, along) = m.bistatic_m(PI - PI / 3.0);
            assert!(along.norm() < 2.0 * ka * ka * across + 1e-9 * across);
        }
    }

    /// Total scattered power equals what the forward amplitude takes out of the wave.
    #[test]
    fn optical_theorem() {
        for ka in [0.5, 5.0, 40.0] {
            let a = radius(ka);
            let m = SphereSeries::pec(a, F).unwrap();
            let k = wavenumber(F);
            // Forward scattering theorem for e^{+jwt}: extinction = -(4 pi/k) Im S(forward).
            let extinction = -4.0 * PI / k * m.bistatic_m(PI).0.im;
            // The midpoint rule errs by (forward slope) h²/24: 1e-5 at 4000 steps and ka = 40.
            let n = 40_000;
            let mut scattered = 0.0;
            for i in 0..n {
                let beta = PI * (i as f64 + 0.5) / n as f64;
                let (v, h) = m.bistatic_m(beta);
                scattered += (v.norm_sqr() + h.norm_sqr()) * beta.sin() * PI * PI / n as f64;
            }
            assert!((scattered / extinction - 1.0).abs() < 1e-6, "{ka}: {scattered} {extinction}");
        }
    }

    #[test]
    fn backscatter_has_no_preferred_polarisation() {
        for ka in [0.01, 1.0, 64.4, 500.0] {
            let (v, h) = SphereSeries::pec(radius(ka), F).unwrap().bistatic_m(0.0);
            assert!((v - h).norm() <= 1e-10 * v.norm());
        }
    }

    /// The first maximum of the resonance region lies 5.6 dB over pi a², near ka = 1 (Skolnik,
    /// *Introduction to Radar Systems*, 2nd ed., section 2.7).
    #[test]
    fn first_resonance() {
        let level = |ka: f64| {
            let a = radius(ka);
            let s = SphereSeries::pec(a, F).unwrap().backscatter_m();
            4.0 * PI * s.norm_sqr() / (PI * a * a)
        };
        let best = (0..200).map(|i| 0.9 + 1e-3 * f64::from(i)).max_by(|x, y| level(*x).total_cmp(&level(*y)));
        let best = best.unwrap();
        assert!((best - 1.03).abs() < 0.02, "{best}");
        assert!((db_from_power(level(best)) - 5.6).abs() < 0.05, "{}", level(best));
    }

    #[test]
    fn refuses_other_sizes() {
        for (radius_m, f) in [(0.0, F), (-1.0, F), (f64::NAN, F), (1e9, F), (1.0, 0.0), (1.0, C0 * 1e9)] {
            assert_eq!(SphereSeries::pec(radius_m, f).unwrap_err().exit_code(), 2);
        }
    }
}
