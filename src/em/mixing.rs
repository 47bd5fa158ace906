//! Permittivity of mixtures from that of their parts, by volume (CONVENTIONS eq. 26).
//!
//! All are quasi-static: the grains have to be small against the wavelength in the mixture.
//! [`grain_limit_m`] gives the usual rule. Above it grains scatter: what they can take out of a wave
//! is bounded by [`independent_scattering_eps`], which is exact for few grains and too much for packed ones.
//!
//! The formulas differ by the shape of the grains that they assume, and all lie between the bounds for layers across
//! and along the field (Wiener). Quartz grains that fill 30 % of the volume:
//!
//! ```
//! use catseye::em::mixing::{bruggeman, looyenga, maxwell_garnett};
//! use num_complex::Complex64;
//!
//! let (air, quartz, fraction) = (Complex64::ONE, Complex64::new(4.7, -0.07), 0.3);
//! let across = 1.0 / ((1.0 - fraction) / air + fraction / quartz);
//! let along = (1.0 - fraction) * air + fraction * quartz;
//! let apart = maxwell_garnett(air, quartz, fraction)?;
//! let random = bruggeman(air, quartz, fraction)?;
//! let any = looyenga(&[(quartz, fraction), (air, 1.0 - fraction)])?;
//! let real = [across, apart, random, any, along].map(|eps| eps.re);
//! assert!(real.is_sorted(), "{real:?}");
//! assert!((any.re - 1.74).abs() < 0.01 && any.im < 0.0);
//! # Ok::<(), catseye::Error>(())
//! ```

use super::mie::SphereSeries;
use crate::base::error::{BadInput, Result};
use crate::base::units::{wavelength_m, wavenumber};
use num_complex::Complex64;
use std::f64::consts::PI;

fn check_fraction(fraction: f64) -> Result<()> {
    if (0.0..=1.0).contains(&fraction) {
        return Ok(());
    }
    Err(BadInput::new("is not a volume fraction")
        .key("fraction")
        .value(fraction)
        .allowed("0..1")
        .remedy("give the volume of the part divided by the volume of the mixture")
        .into())
}

/// eps^(1/3) = sum of f_i eps_i^(1/3): grains of any shape and fraction, small contrast (Looyenga,
/// *Physica* 31 (1965) 401; Landau and Lifshitz, *Electrodynamics of Continuous Media*, section 9).
/// `parts` are (permittivity, volume fraction). Fails unless the fractions are shares that add up to 1.
///
/// # Errors
/// Returns an error for fractions outside 0..1 or that do not add up to 1, or for a permittivity that is not finite.
pub fn looyenga(parts: &[(Complex64, f64)]) -> Result<Complex64> {
    for p in parts {
        check_fraction(p.1)?;
    }
    let total: f64 = parts.iter().map(|p| p.1).sum();
    if (total - 1.0).abs() > 1e-9 {
        return Err(BadInput::new("the volume fractions do not add up to 1")
            .key("sum of fractions")
            .value(total)
            .remedy("add the fraction of air")
            .into());
    }
    // eps' - j eps'' with eps'' >= 0 has its principal cube root in the same half-plane.
    Ok(parts.iter().map(|(eps, f)| eps.cbrt_passive() * f).sum::<Complex64>().powu(3))
}

/// Spheres of `inclusion` in `host`, of volume fraction `fraction`: well separated grains (Maxwell
/// Garnett 1904; Sihvola, *Electromagnetic Mixing Formulas and Applications* (1999), eq. 3.27).
///
/// # Errors
/// Returns an error for fractions outside 0..1 or that do not add up to 1, or for a permittivity that is not finite.
pub fn maxwell_garnett(host: Complex64, inclusion: Complex64, fraction: f64) -> Result<Complex64> {
    check_fraction(fraction)?;
    let contrast = inclusion - host;
    let sum = inclusion + 2.0 * host;
    Ok(host + 3.0 * fraction * host * contrast / (sum - fraction * contrast))
}

/// Grains of two kinds of which neither is the host (Bruggeman 1935; Sihvola 1999, section 9.1):
/// (1 - f)(eps_1 - eps)/(eps_1 + 2 eps) + f (eps_2 - eps)/(eps_2 + 2 eps) = 0.
///
/// # Errors
/// Returns an error for fractions outside 0..1 or that do not add up to 1, or for a permittivity that is not finite.
pub fn bruggeman(first: Complex64, second: Complex64, second_fraction: f64) -> Result<Complex64> {
    check_fraction(second_fraction)?;
    let f = second_fraction;
    let b = (3.0 * f - 1.0) * second + (2.0 - 3.0 * f) * first;
    let root = (b * b + 8.0 * first * second).sqrt();
    // Of the two roots one is a permittivity: that with the positive real part.
    let up = (b + root) / 4.0;
    let down = (b - root) / 4.0;
    Ok(if up.re >= down.re { up } else { down })
}

/// Largest grain diameter for which the formulas are commonly held to be good: a tenth of the
/// wavelength in the mixture (rule of thumb, Sihvola 1999, chapter 3).
pub fn grain_limit_m(mixture: Complex64, freq_hz: f64) -> f64 {
    0.1 * wavelength_m(freq_hz) / mixture.sqrt().re
}

/// Permittivity of spheres in air with the loss that each would cause alone: n C_ext = 2 k Im-part of the
/// wave number, from the exact extinction of one grain (Mie), on top of the real part of `mixture`.
/// Twersky's and Foldy's first order (Ishimaru, *Wave Propagation and Scattering in Random Media*
/// (1978), chapter 14), valid for fractions of a few per cent. Grains that touch shadow and order each
/// other, so in a packing this is an upper bound of the loss and `mixture` alone a lower one.
///
/// # Errors
/// Returns an error for a fraction outside 0..1, or for grains that the Mie series does not take.
pub fn independent_scattering_eps(
    mixture: Complex64,
    grain: Complex64,
    fraction: f64,
    diameter_m: f64,
    freq_hz: f64,
) -> Result<Complex64> {
    check_fraction(fraction)?;
    let (extinction, _) =
        SphereSeries::dielectric(0.5 * diameter_m, grain, freq_hz)?.extinction_and_scattering_m2();
    let per_volume = fraction / (PI / 6.0 * diameter_m.powi(3));
    let decay = 0.5 * per_volume * extinction / wavenumber(freq_hz);
    let index = Complex64::new(mixture.sqrt().re, -decay);
    Ok(index * index)
}

trait PassiveRoot {
    fn cbrt_passive(self) -> Complex64;
}

impl PassiveRoot for Complex64 {
    fn cbrt_passive(self) -> Complex64 {
        // A real permittivity must not gain a sign from -0.0.
        if self.im == 0.0 { Complex64::new(self.re.cbrt(), 0.0) } else { self.powf(1.0 / 3.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn z(re: f64, im: f64) -> Complex64 {
        Complex64::new(re, im)
    }

    #[test]
    fn ends_of_the_scale() {
        let (a, b) = (z(1.0, 0.0), z(4.7, -0.07));
        for (f, end) in [(0.0, a), (1.0, b)] {
            assert!((looyenga(&[(a, 1.0 - f), (b, f)]).unwrap() - end).norm() < 1e-14);
            assert!((maxwell_garnett(a, b, f).unwrap() - end).norm() < 1e-14);
            assert!((bruggeman(a, b, f).unwrap() - end).norm() < 1e-14);
        }
        for f in [-0.1, 1.1, f64::NAN] {
            assert_eq!(bruggeman(a, b, f).unwrap_err().exit_code(), 2);
            assert_eq!(maxwell_garnett(a, b, f).unwrap_err().exit_code(), 2);
            assert_eq!(looyenga(&[(a, f)]).unwrap_err().exit_code(), 2);
        }
        assert!(looyenga(&[(a, 0.5), (b, 0.4)]).is_err());
    }

    /// Few grains: their polarisabilities add up; the next order is of the fraction squared.
    #[test]
    fn few_grains() {
        let (air, grain) = (z(1.0, 0.0), z(4.7, -0.07));
        for f in [1e-3, 1e-4] {
            let sum = 1.0 + 3.0 * f * (grain - 1.0) / (grain + 2.0);
            assert!((maxwell_garnett(air, grain, f).unwrap() - sum).norm() < 3.0 * f * f);
            assert!((bruggeman(air, grain, f).unwrap() - sum).norm() < 10.0 * f * f);
        }
        // Looyenga's formula is exact to the second order of a small contrast, as the others are.
        let f = 0.3;
        for contrast in [0.01, 0.001] {
            let weak = z(1.0 + contrast, 0.0);
            let l = looyenga(&[(air, 1.0 - f), (weak, f)]).unwrap();
            let m = maxwell_garnett(air, weak, f).unwrap();
            assert!((l - m).norm() < 0.1 * contrast.powi(3), "{l} {m}");
        }
    }

    /// Snow, of which the permittivity is known: dry, 0.3 g/cm3, 1.53 to 1.56 at 1 GHz (Maetzler 1996,
    /// 1 + 1.5995 rho + 1.861 rho^3).
    #[test]
    fn dry_snow() {
        let f = 0.3 / 0.917;
        let snow = looyenga(&[(z(1.0, 0.0), 1.0 - f), (z(3.18, 0.0), f)]).unwrap().re;
        let measured = 1.0 + 1.5995 * 0.3 + 1.861 * 0.3f64.powi(3);
        assert!((snow / measured - 1.0).abs() < 0.02, "{snow} {measured}");
    }

    proptest! {
        /// Between Hashin's and Shtrikman's bounds (the two ways round of Maxwell Garnett) without loss, and
        /// passive with it. Looyenga's formula may leave the bounds at large contrast, so its is small here.
        #[test]
        fn bounds(a in 1.0..12.0f64, b in 1.0..12.0f64, f in 0.0..1.0f64, loss in 0.0..5.0f64) {
            let (x, y) = (z(a, 0.0), z(b, 0.0));
            let mg = maxwell_garnett(x, y, f).unwrap().re;
            let gm = maxwell_garnett(y, x, 1.0 - f).unwrap().re;
            let (lo, hi) = (mg.min(gm) - 1e-9, mg.max(gm) + 1e-9);
            let br = bruggeman(x, y, f).unwrap().re;
            prop_assert!((lo..=hi).contains(&br), "{br} in {lo}..{hi}");
            prop_assert!((br - bruggeman(y, x, 1.0 - f).unwrap().re).abs() < 1e-9);
            let lossy = z(b, -loss);
            for e in [
                maxwell_garnett(x, lossy, f).unwrap(),
                bruggeman(x, lossy, f).unwrap(),
                looyenga(&[(x, 1.0 - f), (lossy, f)]).unwrap(),
            ] {
                prop_assert!(e.im <= 1e-12 && e.re >= 0.99, "{e}");
            }
            if (a / b).ln().abs() < 0.4 {
                let l = looyenga(&[(x, 1.0 - f), (y, f)]).unwrap().re;
                prop_assert!((lo - 1e-3..=hi + 1e-3).contains(&l), "{l} in {lo}..{hi}");
            }
        }
    }

    /// Small grains take as much as their absorption, which the mixing formula holds too: few, small, lossy.
    #[test]
    fn loss_of_few_small_grains() {
        let (f, d, grain) = (0.01, 2e-5, z(4.7, -0.5));
        let mg = maxwell_garnett(z(1.0, 0.0), grain, f).unwrap();
        let foldy = independent_scattering_eps(mg, grain, f, d, 77e9).unwrap();
        assert!((foldy.im / mg.im - 1.0).abs() < 0.03, "{foldy} {mg}");
    }
}
