//! What a rough surface scatters beside its coherent reflection, with the power conserved
//! (CONVENTIONS eq. 27).
//!
//! The coherent field loses the factor of [`rayleigh_factor`]; its power goes into a lobe
//! over the half-space in front, of which the shape is chosen and the strength follows. Heights of
//! the surface have to vary slowly on the scale of the wavelength (Kirchhoff); shadowing and multiple
//! scattering are left out, and the lobe does not depend on the correlation length.

use super::fresnel::rayleigh_factor;
use crate::base::error::{BadInput, Result};
use num_complex::Complex64;
use std::f64::consts::PI;

/// Largest exponent of [`Lobe::Directive`].
pub const EXPONENT_MAX: u32 = 50;

/// Shape of the diffuse lobe.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lobe {
    /// Proportional to the cosine of the scattering angle.
    Lambert,
    /// ((1 + cos psi)/2)^exponent about the mirror direction, psi the angle from it (Degli-Esposti,
    /// Fuschini, Vitucci, Falciasecca, *IEEE Trans. Antennas Propag.* 55 (2007) 143, eq. 6-8). Exponents
    /// from 1 to [`EXPONENT_MAX`].
    Directive {
        /// Width of the lobe: the larger, the narrower.
        exponent: u32,
    },
}

/// Shares of the incident power that leave a rough surface coherently and diffusely; their sum is
/// |r|^2.
///
/// # Example
/// What the coherent reflection of a rough surface loses is scattered diffusely; nothing gets lost.
///
/// ```
/// use catseye::base::units::wavenumber;
/// use catseye::em::roughness::{Lobe, Shares};
/// use num_complex::Complex64;
///
/// let (reflection, cos_i) = (Complex64::new(-0.4, 0.1), 0.5);
/// let shares = Shares::of(reflection, wavenumber(77e9), 0.3e-3, cos_i);
/// assert!((shares.coherent + shares.diffuse - reflection.norm_sqr()).abs() < 1e-15);
/// // Backscatter per area of a Lambert lobe: 4 D cos².
/// let sigma0 = Lobe::Lambert.backscatter_sigma0(shares.diffuse, cos_i);
/// assert!((sigma0 - 4.0 * shares.diffuse * cos_i * cos_i).abs() < 1e-15);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shares {
    /// Share of the power in the coherent reflection.
    pub coherent: f64,
    /// Share of the power in the diffuse lobe.
    pub diffuse: f64,
}

impl Shares {
    /// Shares for a wave at incidence cosine `cos_i` on a surface that reflects `r` when smooth; `wavenumber` in rad/m.
    pub fn of(r: Complex64, wavenumber: f64, roughness_rms_m: f64, cos_i: f64) -> Shares {
        let kept = rayleigh_factor(wavenumber, roughness_rms_m, cos_i).powi(2);
        Shares { coherent: r.norm_sqr() * kept, diffuse: r.norm_sqr() * (1.0 - kept) }
    }
}

impl Lobe {
    /// A lobe about the mirror direction.
    ///
    /// # Errors
    /// Returns an error for an exponent of 0 or above [`EXPONENT_MAX`].
    pub fn directive(exponent: u32) -> Result<Lobe> {
        if (1..=EXPONENT_MAX).contains(&exponent) {
            return Ok(Lobe::Directive { exponent });
        }
        Err(BadInput::new("is not an exponent of a diffuse lobe")
            .key("exponent")
            .value(exponent)
            .allowed(format!("1..{EXPONENT_MAX}"))
            .remedy("1 is the widest lobe")
            .into())
    }

    /// Bistatic scattering coefficient sigma0 (radar cross section per area of the surface) for the
    /// diffuse share of the power, at incidence cosine `cos_i`, scattering cosine `cos_s` (0 below the
    /// surface), `cos_mirror` the cosine of the angle between scattered and mirror direction. The mean over
    /// the half-space keeps the power: (1/4 pi) integral of sigma0 over the solid angle = share · cos_i.
    pub fn sigma0(&self, diffuse_share: f64, cos_i: f64, cos_s: f64, cos_mirror: f64) -> f64 {
        if cos_s <= 0.0 {
            return 0.0;
        }
        match *self {
            Lobe::Lambert => 4.0 * diffuse_share * cos_i * cos_s,
            Lobe::Directive { exponent } => {
                let shape = (0.5 * (1.0 + cos_mirror)).powi(exponent as i32);
                4.0 * PI * diffuse_share * cos_i * shape / directive_integral(exponent, cos_i)
            }
        }
    }

    /// Backscatter: `sigma0` towards the source, at incidence cosine `cos_i`.
    pub fn backscatter_sigma0(&self, diffuse_share: f64, cos_i: f64) -> f64 {
        self.sigma0(diffuse_share, cos_i, cos_i, 2.0 * cos_i * cos_i - 1.0)
    }
}

/// Integral of ((1 + cos psi)/2)^n over the half-space in front of the surface, psi from the mirror
/// direction at `cos_i`: Degli-Esposti et al. 2007, eq. 8.
fn directive_integral(n: u32, cos_i: f64) -> f64 {
    let sin2 = 1.0 - cos_i * cos_i;
    let mut binomial = 1.0;
    // Of C(2w, w) (sin/2)^{2w}, from w = 0 to (j - 1)/2.
    let (mut sum, mut term) = (0.0, 1.0);
    let mut total = 0.0;
    for j in 0..=n {
        // Odd powers of cos psi see that the half-space is not centred on the mirror direction.
        let mut lost = 1.0;
        if j % 2 == 1 {
            sum += term;
            let w = f64::from(j / 2);
            term *= (2.0 * w + 1.0) / (2.0 * w + 2.0) * sin2;
            lost = cos_i * sum;
        }
        total += binomial * 2.0 * PI / f64::from(j + 1) * lost;
        binomial *= f64::from(n - j) / f64::from(j + 1);
    }
    total * 0.5f64.powi(n as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean of f over the half-space by the midpoint rule in both angles: (1/4 pi) integral.
    fn mean(f: impl Fn(f64, f64) -> f64) -> f64 {
        let (nt, na) = (600, 64);
        let mut sum = 0.0;
        for i in 0..nt {
            let (s, c) = (0.5 * PI * (i as f64 + 0.5) / nt as f64).sin_cos();
            for j in 0..na {
                sum += f(c, s * (2.0 * PI * (j as f64 + 0.5) / na as f64).cos()) * s;
            }
        }
        sum * 0.5 * PI * 2.0 * PI / (nt * na) as f64 / (4.0 * PI)
    }

    #[test]
    fn coherent_and_diffuse_power_add_up() {
        let r = Complex64::new(-0.6, 0.3);
        let k = crate::base::units::wavenumber(77e9);
        for rough in [0.0, 1e-4, 5e-4, 3e-3] {
            for cos_i in [0.02, 0.3, 0.7, 1.0] {
                let shares = Shares::of(r, k, rough, cos_i);
                assert!((shares.coherent + shares.diffuse - r.norm_sqr()).abs() < 1e-15);
                let sin_i = (1.0f64 - cos_i * cos_i).sqrt();
                let lobes = [1, 2, 3, 4, 7, 20].map(|e| Lobe::directive(e).unwrap());
                for lobe in lobes.into_iter().chain([Lobe::Lambert]) {
                    // Power scattered over power incident on the area.
                    let scattered =
                        mean(|c, x| lobe.sigma0(shares.diffuse, cos_i, c, c * cos_i + x * sin_i)) / cos_i;
                    let total = shares.coherent + scattered;
                    assert!((total - r.norm_sqr()).abs() < 1e-5, "{lobe:?} {rough} {cos_i}: {total}");
                }
            }
        }
    }

    #[test]
    fn shapes() {
        // Lambert's law at normal incidence: sigma0 = 4 gamma cos^2 for all power diffuse.
        assert!((Lobe::Lambert.backscatter_sigma0(0.25, 1.0) - 1.0).abs() < 1e-15);
        // The directive lobe has its maximum in the mirror direction and falls to both sides.
        let lobe = Lobe::directive(4).unwrap();
        let at = |c: f64| lobe.sigma0(1.0, 0.5, 0.5, c);
        assert!(at(1.0) > at(0.9) && at(0.9) > at(0.0));
        // Nothing below the surface.
        assert_eq!(lobe.sigma0(1.0, 0.5, -0.1, 0.3), 0.0);
        assert_eq!(Lobe::directive(0).unwrap_err().exit_code(), 2);
        assert_eq!(Lobe::directive(51).unwrap_err().exit_code(), 2);
    }

    /// Very rough: nothing coherent is left and all of |r|^2 is diffuse.
    #[test]
    fn limits_of_roughness() {
        let r = Complex64::new(-1.0, 0.0);
        assert_eq!(Shares::of(r, 1600.0, 0.0, 0.5), Shares { coherent: 1.0, diffuse: 0.0 });
        let rough = Shares::of(r, 1600.0, 0.01, 0.5);
        assert!(rough.coherent < 1e-20 && (rough.diffuse - 1.0).abs() < 1e-15);
    }
}
