//! Mie series: the exact field that a sphere scatters.
//!
//! Time factor e^{+jωt} and the scattering matrix of CONVENTIONS eq. (3). With ψₙ(x) = x jₙ(x) and
//! ξₙ(x) = x hₙ⁽²⁾(x) the far field of a sphere is the sum of Bohren and Huffman, *Absorption and
//! Scattering of Light by Small Particles* (1983), eq. (4.74),
//! S₁ = Σ (2n+1)/(n(n+1)) (aₙπₙ + bₙτₙ), S₂ = Σ (2n+1)/(n(n+1)) (aₙτₙ + bₙπₙ),
//! with their coefficients conjugated for this time factor. What the sphere is made of enters only
//! through aₙ and bₙ (CONVENTIONS eq. 25).
//!
//! Coefficients of dielectric and coated spheres come from logarithmic derivatives by recursions
//! that neither overflow nor lose digits in large, lossy or thin shells: Dₙ = ψₙ′/ψₙ downwards
//! (Bohren and Huffman, appendix A), ξₙ′/ξₙ upwards, and from shell to shell the form of Yang,
//! "Improved recursive algorithm for light scattering by a multilayered sphere", *Applied Optics* 42
//! (2003) 1710, with the ratio of ψ and ξ in two radii built from products of ξ, which has no zeros.

use crate::base::error::{BadInput, Result};
use crate::base::units::wavenumber;
use num_complex::Complex64;

/// Sizes k·radius for which the series is summed.
pub const KA_RANGE: (f64, f64) = (1e-6, 1e5);

/// Largest |refractive index| · k · radius inside a sphere.
pub const INNER_SIZE_MAX: f64 = 1e6;

/// The innermost part of a layered sphere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Core {
    /// A perfect conductor.
    Pec {
        /// Radius, m.
        radius_m: f64,
    },
    /// Relative permittivity eps' - j eps''.
    Dielectric {
        /// Radius, m.
        radius_m: f64,
        /// Relative permittivity eps' - j eps''.
        eps_r: Complex64,
    },
}

impl Core {
    /// Radius of the core, m.
    pub fn radius_m(&self) -> f64 {
        match *self {
            Core::Pec { radius_m } | Core::Dielectric { radius_m, .. } => radius_m,
        }
    }
}

/// A shell of relative permittivity eps' - j eps'' that ends at `radius_m`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shell {
    /// Outer radius, m.
    pub radius_m: f64,
    /// Relative permittivity eps' - j eps''.
    pub eps_r: Complex64,
}

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
    ///
    /// # Errors
    /// Returns an error for a size outside [`KA_RANGE`], for radii that do not grow, or for a permittivity that is not
    /// finite.
    pub fn pec(radius_m: f64, freq_hz: f64) -> Result<SphereSeries> {
        let k = wavenumber(freq_hz);
        let x = k * radius_m;
        check_size(x)?;
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

    /// A homogeneous sphere of relative permittivity `eps_r` = eps' - j eps''. Fails outside
    /// [`KA_RANGE`], for an eps'' below zero, and where |sqrt(eps_r)| k·radius exceeds
    /// [`INNER_SIZE_MAX`].
    ///
    /// # Errors
    /// Returns an error for a size outside [`KA_RANGE`], for radii that do not grow, or for a permittivity that is not
    /// finite.
    pub fn dielectric(radius_m: f64, eps_r: Complex64, freq_hz: f64) -> Result<SphereSeries> {
        SphereSeries::layered(Core::Dielectric { radius_m, eps_r }, &[], freq_hz)
    }

    /// A core in one shell of relative permittivity `shell_eps_r` out to `radius_m`. Fails as
    /// [`layered`](SphereSeries::layered).
    ///
    /// # Errors
    /// Returns an error for a size outside [`KA_RANGE`], for radii that do not grow, or for a permittivity that is not
    /// finite.
    pub fn coated(core: Core, radius_m: f64, shell_eps_r: Complex64, freq_hz: f64) -> Result<SphereSeries> {
        SphereSeries::layered(core, &[Shell { radius_m, eps_r: shell_eps_r }], freq_hz)
    }

    /// A core in shells, from inside outwards. Fails unless the radii grow, k·(outer radius) lies in
    /// [`KA_RANGE`], and as [`dielectric`](SphereSeries::dielectric).
    ///
    /// # Errors
    /// Returns an error for a size outside [`KA_RANGE`], for radii that do not grow, or for a permittivity that is not
    /// finite.
    pub fn layered(core: Core, shells: &[Shell], freq_hz: f64) -> Result<SphereSeries> {
        let k = wavenumber(freq_hz);
        let radii: Vec<f64> =
            std::iter::once(core.radius_m()).chain(shells.iter().map(|s| s.radius_m)).collect();
        let x = k * radii[radii.len() - 1];
        check_size(x)?;
        if radii.windows(2).any(|r| r[0].partial_cmp(&r[1]).is_none_or(|o| o.is_ge())) || radii[0] <= 0.0 {
            return Err(BadInput::new("the radii of the shells do not increase outwards")
                .key("radius_m")
                .value(format!("{radii:?}"))
                .remedy("list core and shells from the inside to the outside")
                .into());
        }
        let terms = terms(x);
        let shells = shells.iter().map(|s| Ok((k * s.radius_m, index(s.eps_r, k * s.radius_m)?)));
        let shells = shells.collect::<Result<Vec<(f64, Complex64)>>>()?;
        // Logarithmic derivatives at the outer radius of what has been passed, relative to the wave number
        // there: H_a/m enters a, H_b m enters b (Yang eq. 7, 8). Index 0 is unused.
        let zero = vec![Complex64::ZERO; terms + 1];
        let mut inner_x = k * core.radius_m();
        let (mut over_m, mut times_m, mut magnetic_wall) = match core {
            Core::Pec { .. } => (zero.clone(), zero, true),
            Core::Dielectric { eps_r, .. } => {
                let m = index(eps_r, inner_x)?;
                let d = psi_log_derivative(m * inner_x, terms);
                (d.iter().map(|d| d / m).collect(), d.iter().map(|d| d * m).collect(), false)
            }
        };
        for (outer_x, m) in shells {
            let (z1, z2) = (m * inner_x, m * outer_x);
            let (psi1, psi2) = (psi_log_derivative(z1, terms), psi_log_derivative(z2, terms));
            let (xi1, xi2) = (xi_log_derivative(z1, terms), xi_log_derivative(z2, terms));
            // xi_n(z2)/xi_n(z1), which never grows.
            let mut ratio = (Complex64::I * (z2 - z1)).exp();
            for n in 1..=terms {
                let order = n as f64;
                ratio *= (xi1[n] + order / z1) / (xi2[n] + order / z2);
                // psi/xi in z1 over psi/xi in z2, times (psi2 - xi2): the Wronskian gives psi xi = j/(psi - xi).
                let q = ratio * ratio / (psi1[n] - xi1[n]);
                let pass = |g1: Complex64, g2: Complex64| {
                    let q = q * g1 / g2;
                    (psi2[n] - q * (psi2[n] - xi2[n]) * xi2[n]) / (1.0 - q * (psi2[n] - xi2[n]))
                };
                let h_a = over_m[n] * m;
                over_m[n] = pass(h_a - psi1[n], h_a - xi1[n]) / m;
                let h_b = times_m[n] / m;
                times_m[n] = if magnetic_wall {
                    pass(Complex64::ONE, Complex64::ONE)
                } else {
                    pass(h_b - psi1[n], h_b - xi1[n])
                } * m;
            }
            inner_x = outer_x;
            magnetic_wall = false;
        }
        let r = Riccati::new(x, terms);
        let (a, b) = (1..=terms)
            .map(|n| {
                // In this part the wave is e^{-jwt}, as in the books; the result is conjugated.
                let (psi, xi) = (r.psi[n], r.xi(n).conj());
                let (psi_before, xi_before) = (r.psi[n - 1], r.xi(n - 1).conj());
                let order = n as f64 / x;
                let coefficient =
                    |d: Complex64| ((d + order) * psi - psi_before) / ((d + order) * xi - xi_before);
                let a = coefficient(over_m[n]);
                let b = if magnetic_wall { psi / xi } else { coefficient(times_m[n]) };
                (a.conj(), b.conj())
            })
            .unzip();
        Ok(SphereSeries { wavenumber: k, a, b })
    }

    /// Power taken out of a plane wave and power scattered, each over the intensity, in m^2 (Bohren and
    /// Huffman eq. 4.61, 4.62): what is absorbed is their difference.
    ///
    /// # Example
    /// A rain drop of 2 mm absorbs part of what it takes out of a wave at 77 GHz; a glass bead without loss only
    /// scatters.
    ///
    /// ```
    /// use catseye::em::{mie::SphereSeries, weather::water_eps};
    /// use num_complex::Complex64;
    ///
    /// let drop = SphereSeries::dielectric(1e-3, water_eps(77e9, 10.0), 77e9)?;
    /// let (extinction_m2, scattering_m2) = drop.extinction_and_scattering_m2();
    /// assert!(extinction_m2 > 1.2 * scattering_m2);
    /// let bead = SphereSeries::dielectric(1e-3, Complex64::from(6.0), 77e9)?;
    /// let (extinction_m2, scattering_m2) = bead.extinction_and_scattering_m2();
    /// assert!((extinction_m2 / scattering_m2 - 1.0).abs() < 1e-9);
    /// # Ok::<(), catseye::Error>(())
    /// ```
    pub fn extinction_and_scattering_m2(&self) -> (f64, f64) {
        let (mut extinction, mut scattering) = (0.0, 0.0);
        for (i, (a, b)) in self.a.iter().zip(&self.b).enumerate() {
            let w = (2 * i + 3) as f64;
            extinction += w * (a + b).re;
            scattering += w * (a.norm_sqr() + b.norm_sqr());
        }
        let scale = std::f64::consts::TAU / (self.wavenumber * self.wavenumber);
        (scale * extinction, scale * scattering)
    }

    /// Amplitude S_vv = S_hh towards the source, metres, referred to the centre.
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

fn check_size(x: f64) -> Result<()> {
    if (KA_RANGE.0..=KA_RANGE.1).contains(&x) {
        return Ok(());
    }
    Err(BadInput::new("the Mie series cannot be summed for this size of sphere")
        .key("k * radius")
        .value(x)
        .allowed(format!("{:e}..{:e}", KA_RANGE.0, KA_RANGE.1))
        .into())
}

/// Refractive index in the convention e^{-jwt} of the recursions: Im m >= 0.
fn index(eps_r: Complex64, x: f64) -> Result<Complex64> {
    let bad = |problem: &str| BadInput::new(problem.to_string()).key("eps_r").value(eps_r);
    if !eps_r.is_finite() || eps_r.im > 0.0 || eps_r == Complex64::ZERO {
        return Err(bad("is not a passive permittivity eps' - j eps''")
            .allowed("eps'' of 0 or more")
            .remedy("check the sign of the loss")
            .into());
    }
    let m = eps_r.conj().sqrt();
    if m.norm() * x > INNER_SIZE_MAX {
        return Err(bad("the Mie series cannot be summed for this permittivity and size of sphere")
            .allowed(format!("|sqrt(eps_r)| * k * radius up to {INNER_SIZE_MAX:e}"))
            .remedy("model a good conductor as a perfect one")
            .into());
    }
    Ok(m)
}

/// psi_n'(z)/psi_n(z) for n = 0 ... terms, downwards from where the start no longer matters.
fn psi_log_derivative(z: Complex64, terms: usize) -> Vec<Complex64> {
    let inner = z.norm();
    let start = terms.max((inner + 8.0 * inner.cbrt()) as usize) + 40;
    let mut d = vec![Complex64::ZERO; terms + 1];
    let mut here = Complex64::ZERO;
    for n in (1..=start).rev() {
        if n <= terms {
            d[n] = here;
        }
        let order = n as f64 / z;
        here = order - 1.0 / (here + order);
    }
    d[0] = here;
    d
}

/// xi_n'(z)/xi_n(z) of the outgoing wave, e^{-jwt}, for n = 0 ... terms, upwards.
fn xi_log_derivative(z: Complex64, terms: usize) -> Vec<Complex64> {
    let mut d = Vec::with_capacity(terms + 1);
    let mut here = Complex64::I;
    d.push(here);
    for n in 1..=terms {
        let order = n as f64 / z;
        here = 1.0 / (order - here) - order;
        d.push(here);
    }
    d
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
    use crate::base::units::{C0, db_from_power};
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

    fn z(re: f64, im: f64) -> Complex64 {
        Complex64::new(re, im)
    }

    fn backscatter(core: Core, shells: &[Shell]) -> Complex64 {
        SphereSeries::layered(core, shells, F).unwrap().backscatter_m()
    }

    /// Efficiencies of Bohren and Huffman's two worked examples, printed with their programs BHMIE and
    /// BHCOAT (appendices A and B).
    #[test]
    fn examples_of_bohren_and_huffman() {
        // Water drop's neighbour: index 1.55, x = 2 pi 0.525/0.6328.
        let k = wavenumber(F);
        let radius = 2.0 * PI * 0.525 / 0.6328 / k;
        let s = SphereSeries::dielectric(radius, z(1.55 * 1.55, 0.0), F).unwrap();
        let area = PI * radius * radius;
        let (extinction, scattering) = s.extinction_and_scattering_m2();
        assert!((extinction / area - 3.10543).abs() < 1e-5, "{}", extinction / area);
        assert!((scattering / area - 3.10543).abs() < 1e-5);
        let back = 4.0 * PI * s.backscatter_m().norm_sqr() / area;
        assert!((back - 2.92534).abs() < 1e-5, "{back}");
        // Core 1.59 + 0.66 i of 0.171, mantle 1.409 + 0.1747 i of 6.265, wavelength 3.
        let scale = 2.0 * PI / 3.0 / k;
        let (core, shell) = (z(1.59, -0.66), z(1.409, -0.1747));
        let s = SphereSeries::coated(
            Core::Dielectric { radius_m: 0.171 * scale, eps_r: core * core },
            6.265 * scale,
            shell * shell,
            F,
        );
        let s = s.unwrap();
        let area = PI * (6.265 * scale).powi(2);
        let (extinction, scattering) = s.extinction_and_scattering_m2();
        assert!((extinction / area - 2.32803).abs() < 1e-5, "{}", extinction / area);
        assert!((scattering / area - 1.14341).abs() < 1e-5, "{}", scattering / area);
        let back = 4.0 * PI * s.backscatter_m().norm_sqr() / area;
        assert!((back - 0.0285099).abs() < 1e-7, "{back}");
    }

    /// A small sphere is an electric dipole: S = k^2 a^3 (eps - 1)/(eps + 2), and a coated one that of
    /// Bohren and Huffman eq. (5.36).
    #[test]
    fn small_dielectric_spheres() {
        let k = wavenumber(F);
        for ka in [1e-4, 1e-3] {
            let a = radius(ka);
            for eps in [z(4.0, -0.1), z(2.0, 0.0), z(7.6, -13.9)] {
                let s = SphereSeries::dielectric(a, eps, F).unwrap().backscatter_m();
                let dipole = k * k * a.powi(3) * (eps - 1.0) / (eps + 2.0);
                assert!((s - dipole).norm() < 20.0 * ka * ka * dipole.norm(), "{s} {dipole}");
                let (inner, shell, f) = (z(3.0, -0.5), eps, 0.5f64.powi(3));
                let polarisability = ((shell - 1.0) * (inner + 2.0 * shell)
                    + f * (inner - shell) * (1.0 + 2.0 * shell))
                    / ((shell + 2.0) * (inner + 2.0 * shell) + f * (2.0 * shell - 2.0) * (inner - shell));
                let core = Core::Dielectric { radius_m: 0.5 * a, eps_r: inner };
                let s = SphereSeries::coated(core, a, shell, F).unwrap().backscatter_m();
                let dipole = k * k * a.powi(3) * polarisability;
                assert!((s - dipole).norm() < 20.0 * ka * ka * dipole.norm(), "{s} {dipole}");
            }
        }
    }

    /// Shells of the core's own material or of air, metal behind opaque shells, and shells too thin to see.
    #[test]
    fn shells_that_do_not_matter() {
        for ka in [0.3, 4.0, 33.3, 250.0] {
            let a = radius(ka);
            for eps in [z(2.56, -0.0189), z(6.0, 0.0), z(7.6, -13.9), z(1.0, -2e3)] {
                let whole = SphereSeries::dielectric(a, eps, F).unwrap().backscatter_m();
                let close = |s: Complex64, tolerance: f64| {
                    assert!((s - whole).norm() < tolerance * whole.norm(), "{ka} {eps}: {s} {whole}");
                };
                for part in [0.1, 0.5, 0.999] {
                    let core = Core::Dielectric { radius_m: part * a, eps_r: eps };
                    close(backscatter(core, &[Shell { radius_m: a, eps_r: eps }]), 1e-9);
                }
                let core = Core::Dielectric { radius_m: a, eps_r: eps };
                close(backscatter(core, &[Shell { radius_m: 1.7 * a, eps_r: z(1.0, 0.0) }]), 1e-9);
                let thin = Shell { radius_m: a * (1.0 + 1e-13), eps_r: z(9.0, -1.0) };
                close(backscatter(core, &[thin]), 1e-9);
            }
            let bare = SphereSeries::pec(a, F).unwrap();
            let again = SphereSeries::layered(Core::Pec { radius_m: a }, &[], F).unwrap();
            for (x, y) in bare.a.iter().chain(&bare.b).zip(again.a.iter().chain(&again.b)) {
                assert!((x - y).norm() < 1e-13);
            }
            let air = Shell { radius_m: 1.3 * a, eps_r: z(1.0, 0.0) };
            let s = backscatter(Core::Pec { radius_m: a }, &[air]);
            let bare = bare.backscatter_m();
            assert!((s - bare).norm() < 1e-9 * bare.norm(), "{ka}: {s} {bare}");
            // Metal inside an opaque shell is not seen; a good conductor is nearly a perfect one.
            let water = z(7.6, -13.9);
            let whole = SphereSeries::dielectric(a + 0.02, water, F).unwrap().backscatter_m();
            let s = backscatter(Core::Pec { radius_m: a }, &[Shell { radius_m: a + 0.02, eps_r: water }]);
            assert!((s - whole).norm() < 1e-9 * whole.norm(), "{ka}: {s} {whole}");
            let metal = SphereSeries::dielectric(a, z(1.0, -1e7), F);
            let metal = metal.unwrap().backscatter_m();
            assert!((metal - bare).norm() < 3e-3 * bare.norm(), "{ka}: {metal} {bare}");
        }
    }

    /// Geometric optics of a large coated ball: the plane stack's reflection at normal incidence times a/2,
    /// both that of a lossy coat on metal and of a clear one.
    #[test]
    fn large_coated_balls_reflect_as_the_plane_stack() {
        use crate::em::layers::{Backing, Layer, Stack};
        let k = wavenumber(F);
        for (eps, d) in [(z(6.0, -0.12), 3e-4), (z(7.6, -13.9), 1e-4), (z(2.0, 0.0), 5e-4)] {
            for ka in [2000.0, 8000.0] {
                let a = radius(ka);
                let s =
                    SphereSeries::coated(Core::Pec { radius_m: a - d }, a, eps, F).unwrap().backscatter_m();
                let stack =
                    Stack { layers: vec![Layer { eps_r: eps, thickness_m: d }], backing: Backing::Pec };
                let flat = stack.reflection(k, 1.0).0 * 0.5 * a * Complex64::cis(2.0 * ka);
                assert!((s - flat).norm() < 10.0 / ka * flat.norm(), "{eps} {ka}: {s} {flat}");
            }
        }
    }

    #[test]
    fn absorbs_what_it_does_not_scatter() {
        for ka in [0.5, 7.0, 120.0] {
            let a = radius(ka);
            let clear = SphereSeries::dielectric(a, z(5.0, 0.0), F).unwrap();
            let (e, s) = clear.extinction_and_scattering_m2();
            assert!((e / s - 1.0).abs() < 1e-10, "{e} {s}");
            // The optical theorem with the forward amplitude, as in the test above.
            let forward = -4.0 * PI / wavenumber(F) * clear.bistatic_m(PI).0.im;
            assert!((forward / e - 1.0).abs() < 1e-10);
            let coat = z(4.0, -0.3);
            let lossy = SphereSeries::coated(Core::Pec { radius_m: 0.8 * a }, a, coat, F).unwrap();
            let (e, s) = lossy.extinction_and_scattering_m2();
            assert!(e > s && s > 0.0);
            let (v, h) = lossy.bistatic_m(0.0);
            assert!((v - h).norm() <= 1e-10 * v.norm());
        }
    }

    #[test]
    fn refuses_what_is_not_a_sphere() {
        let core = Core::Pec { radius_m: 0.02 };
        for (r, eps) in
            [(0.01, z(2.0, 0.0)), (0.02, z(2.0, 0.0)), (f64::NAN, z(2.0, 0.0)), (0.03, z(2.0, 0.1))]
        {
            assert_eq!(SphereSeries::coated(core, r, eps, F).unwrap_err().exit_code(), 2);
        }
        let e = SphereSeries::dielectric(1.0, z(1.0, -1e12), F).unwrap_err().to_string();
        assert!(e.contains("perfect one"), "{e}");
    }
}
