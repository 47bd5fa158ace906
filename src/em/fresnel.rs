//! Reflection at a plane surface (CONVENTIONS eq. 4), smooth or with heights of Gaussian distribution that vary slowly
//! on the scale of the wavelength (Ament).

use num_complex::Complex64;

/// Reflection coefficients (R_perp, R_par) at incidence cosine `cos_i` in (0, 1] from a medium of relative permittivity
/// `eps_r` = eps' - j eps''; None is a perfect conductor.
///
/// # Example
/// At Brewster's angle tan θ = √ε the wave with E in the plane of incidence enters without reflection; at grazing
/// incidence both coefficients tend to −1, whatever the material.
///
/// ```
/// use catseye::em::fresnel::reflection;
/// use num_complex::Complex64;
///
/// let glass = Some(Complex64::new(6.0, 0.0));
/// let brewster_rad = 6f64.sqrt().atan();
/// let (perp, par) = reflection(glass, brewster_rad.cos());
/// assert!(par.norm() < 1e-15 && (perp.norm() - 5.0 / 7.0).abs() < 1e-12);
/// let (perp, par) = reflection(glass, 1e-6);
/// assert!((perp + 1.0).norm() < 1e-5 && (par + 1.0).norm() < 2e-5);
/// ```
pub fn reflection(eps_r: Option<Complex64>, cos_i: f64) -> (Complex64, Complex64) {
    let one = Complex64::new(1.0, 0.0);
    let Some(eps) = eps_r else {
        return (-one, one);
    };
    let mut q = (eps - (1.0 - cos_i * cos_i)).sqrt();
    // The transmitted wave decays into the medium: Im q <= 0 with e^{+j omega t}.
    if q.im > 0.0 {
        q = -q;
    }
    ((cos_i - q) / (cos_i + q), (eps * cos_i - q) / (eps * cos_i + q))
}

/// Loss of the coherent field on a Gaussian rough surface: exp(-2 (k h cos)^2) (Ament 1953).
///
/// # Example
/// Asphalt with 0.3 mm of roughness at 77 GHz, for a radar 0.5 m above the road that looks 20 m ahead and one that
/// looks straight down: near grazing the surface is smooth for the wave.
///
/// ```
/// use catseye::base::units::wavenumber;
/// use catseye::em::fresnel::rayleigh_factor;
///
/// let kept_db = |cos_i: f64| 20.0 * rayleigh_factor(wavenumber(77e9), 0.3e-3, cos_i).log10();
/// assert!(kept_db(0.5f64.atan2(20.0).sin()) > -0.01);
/// assert!((kept_db(1.0) + 4.1).abs() < 0.1);
/// ```
pub fn rayleigh_factor(wavenumber: f64, roughness_rms_m: f64, cos_i: f64) -> f64 {
    let x = wavenumber * roughness_rms_m * cos_i;
    (-2.0 * x * x).exp()
}

/// Loss of the coherent field that passes a rough front of a medium `eps_r`: a height h changes the
/// phase by k h (q - cos), so exp(-(k h Re(q - cos))^2 / 2), as in Ament's reflection, where the change is
/// 2 k h cos (CONVENTIONS eq. 24).
pub fn transmission_roughness_factor(
    wavenumber: f64,
    roughness_rms_m: f64,
    eps_r: Complex64,
    cos_i: f64,
) -> f64 {
    let q = (eps_r - (1.0 - cos_i * cos_i)).sqrt();
    let x = wavenumber * roughness_rms_m * (q.re - cos_i);
    (-0.5 * x * x).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits() {
        let glass = Some(Complex64::new(4.0, 0.0));
        // Normal incidence: (1 - n)/(1 + n) and its negative, with these field vectors.
        let (s, p) = reflection(glass, 1.0);
        assert!((s - Complex64::new(-1.0 / 3.0, 0.0)).norm() < 1e-15);
        assert!((p - Complex64::new(1.0 / 3.0, 0.0)).norm() < 1e-15);
        // Brewster's angle: tan = n.
        let cos_b = 1.0 / (1.0 + 4.0f64).sqrt();
        assert!(reflection(glass, cos_b).1.norm() < 1e-15);
        // Grazing: both go to -1.
        let (s, p) = reflection(glass, 1e-9);
        assert!((s + 1.0).norm() < 1e-8 && (p + 1.0).norm() < 1e-7);
        // Metal is nearly a perfect conductor.
        let metal =
            Some(Complex64::new(1.0, -3.56e7 / (std::f64::consts::TAU * 77e9 * crate::base::units::EPS0)));
        let (s, p) = reflection(metal, 0.5);
        assert!((s + 1.0).norm() < 2e-3 && (p - 1.0).norm() < 5e-3);
    }

    #[test]
    fn rough_fronts() {
        // Through air with a "rough" front nothing is lost; on reflection the phase change doubles.
        assert_eq!(transmission_roughness_factor(1600.0, 1e-3, Complex64::new(1.0, 0.0), 0.4), 1.0);
        let through = transmission_roughness_factor(1600.0, 1e-4, Complex64::new(9.0, 0.0), 1.0);
        assert!((through - rayleigh_factor(1600.0, 1e-4, 1.0)).abs() < 1e-15);
    }

    #[test]
    fn passive_everywhere() {
        for eps in [(2.0, 0.0), (5.0, 0.5), (2.5, 3.0), (1.0, 1e7), (0.5, 0.0)] {
            for i in 1..=1000 {
                let (s, p) = reflection(Some(Complex64::new(eps.0, -eps.1)), i as f64 / 1000.0);
                assert!(s.norm() <= 1.0 + 1e-12 && p.norm() <= 1.0 + 1e-12, "{eps:?} {i}");
            }
        }
    }
}
