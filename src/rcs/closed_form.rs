//! Cross sections with a closed form: what the ray engines are measured against.
//!
//! Amplitudes are the S of CONVENTIONS eq. (3) in metres, phase referred to the target's origin, for
//! the poses of `road::reflector` and a radar in the direction **u** (from the target). The
//! physical-optics current of a perfect conductor is **J** = 2 **n**×**H**, and (5) towards the source gives for
//! any lit shape without double bounces
//! S_vv = S_hh = −(jk/2π) ∫ (**n**·**u**) e^{2jk **u**·**r**} dA, S_vh = S_hv = 0,
//! which is the integral evaluated by the functions `po_*`. "GO" is geometric optics: the closed form
//! for the double or triple bounce alone, and the same as convention "last" on boresight.

use crate::base::error::Result;
use crate::base::units::{wavelength_m, wavenumber};
use crate::em::mie::SphereSeries;
use glam::DVec3;
use num_complex::Complex64;
use std::f64::consts::{FRAC_PI_2, PI};

/// The function sin x / x, which is 1 at 0.
pub fn sinc(x: f64) -> f64 {
    if x.abs() < 1e-4 { 1.0 - x * x / 6.0 } else { x.sin() / x }
}

/// Cross section σ = 4π|S|², m², of an amplitude S in metres.
pub fn rcs_m2(s: Complex64) -> f64 {
    4.0 * PI * s.norm_sqr()
}

/// Rectangular plate with normal +x, width along y, two-sided, for VV and HH alike:
/// S = −(jk/2π) |u_x| w h sinc(k w u_y) sinc(k h u_z). (Balanis, *Advanced Engineering
/// Electromagnetics*, 2nd ed., section 11.3, in both planes at once.)
///
/// # Example
/// A plate of 10 cm × 10 cm at 77 GHz returns 4πA²/λ² = 19.2 dBsm along its normal, nothing at sin θ = λ/2w, and a
/// first side lobe 13.3 dB below the main lobe.
///
/// ```
/// use catseye::base::frames::direction_from_angles;
/// use catseye::base::units::{db_from_power, wavelength_m, wavenumber};
/// use catseye::rcs::closed_form::{po_plate, rcs_m2};
///
/// let (side_m, freq_hz) = (0.1, 77e9);
/// let at = |sine: f64| rcs_m2(po_plate(side_m, side_m, freq_hz, direction_from_angles(sine.asin(), 0.0)));
/// assert!((db_from_power(at(0.0)) - 19.19).abs() < 0.01);
/// assert!(at(wavelength_m(freq_hz) / (2.0 * side_m)) < 1e-20 * at(0.0));
/// // sin x / x has its first side lobe at x = 4.4934.
/// let side_lobe = 4.4934 / (wavenumber(freq_hz) * side_m);
/// assert!((db_from_power(at(side_lobe) / at(0.0)) + 13.26).abs() < 0.02);
/// ```
pub fn po_plate(width_m: f64, height_m: f64, freq_hz: f64, u: DVec3) -> Complex64 {
    let k = wavenumber(freq_hz);
    let pattern = sinc(k * width_m * u.y) * sinc(k * height_m * u.z);
    Complex64::new(0.0, -k / (2.0 * PI) * u.x.abs() * width_m * height_m * pattern)
}

/// Flat disc of normal +z at height `z_m` on the z axis, seen from above (u_z > 0):
/// S = −(jk/2π) u_z π a² · 2 J₁(x)/x · e^{2jk z u_z}, x = 2 k a √(1 − u_z²).
pub fn po_disc(radius_m: f64, z_m: f64, freq_hz: f64, u: DVec3) -> Complex64 {
    if u.z <= 0.0 {
        return Complex64::ZERO;
    }
    let k = wavenumber(freq_hz);
    let x = 2.0 * k * radius_m * u.x.hypot(u.y);
    // J₁(x)/x = (1/π) ∫₀^π cos(x cos t) sin² t dt (Abramowitz and Stegun 9.1.20), periodic in t.
    let n = quadrature_steps(x);
    let mean: f64 = (0..n)
        .map(|i| {
            let (s, c) = (PI * i as f64 / n as f64).sin_cos();
            (x * c).cos() * s * s
        })
        .sum::<f64>()
        / n as f64;
    let magnitude = k / (2.0 * PI) * u.z * PI * radius_m * radius_m * 2.0 * mean;
    Complex64::new(0.0, -magnitude) * Complex64::cis(2.0 * k * z_m * u.z)
}

/// The mantle of a circular cylinder about z, centred at the origin, exact physical optics:
/// S = −(jk/2π) L sinc(k L u_z) a ρ ∫ cos φ e^{2jkaρ cos φ} dφ over −π/2 … π/2, ρ = √(1 − u_z²). The integral is
/// done numerically to rounding error.
pub fn po_cylinder_mantle(radius_m: f64, length_m: f64, freq_hz: f64, u: DVec3) -> Complex64 {
    let k = wavenumber(freq_hz);
    let rho = u.x.hypot(u.y);
    let x = 2.0 * k * radius_m * rho;
    // Even in φ, so half the arc, doubled below.
    let sum = gauss_panels(0.0, FRAC_PI_2, panels(x), |phi| {
        let c = phi.cos();
        Complex64::cis(x * c) * c
    });
    let scale = k / (2.0 * PI) * length_m * sinc(k * length_m * u.z) * radius_m * rho * 2.0;
    Complex64::new(0.0, -scale) * sum
}

/// Closed cylinder: mantle and the end disc that is lit.
///
/// # Example
/// A post of 10 cm diameter and 50 cm height, seen from its side, has k a L² (Knott, Shaeffer and Tuley): 13.0 dBsm at
/// 77 GHz.
///
/// ```
/// use catseye::base::units::{db_from_power, wavenumber};
/// use catseye::rcs::closed_form::{cylinder_stationary_phase_m2, po_cylinder, rcs_m2};
/// use glam::DVec3;
///
/// let (radius_m, length_m, freq_hz) = (0.05, 0.5, 77e9);
/// let exact_dbsm = db_from_power(rcs_m2(po_cylinder(radius_m, length_m, freq_hz, DVec3::X)));
/// let usual_m2 = cylinder_stationary_phase_m2(radius_m, length_m, freq_hz, DVec3::X);
/// assert!((usual_m2 / (wavenumber(freq_hz) * radius_m * length_m * length_m) - 1.0).abs() < 1e-12);
/// assert!((exact_dbsm - db_from_power(usual_m2)).abs() < 0.12);
/// ```
pub fn po_cylinder(radius_m: f64, length_m: f64, freq_hz: f64, u: DVec3) -> Complex64 {
    let up = DVec3::new(u.x, u.y, u.z.abs());
    po_cylinder_mantle(radius_m, length_m, freq_hz, u) + po_disc(radius_m, 0.5 * length_m, freq_hz, up)
}

/// The usual approximation of the mantle for k a ≫ 1, σ = k a L² ρ sinc²(k L u_z), ρ the cosine of the
/// angle from broadside (Knott, Shaeffer and Tuley, *Radar Cross Section*, 2nd ed.), m².
pub fn cylinder_stationary_phase_m2(radius_m: f64, length_m: f64, freq_hz: f64, u: DVec3) -> f64 {
    let k = wavenumber(freq_hz);
    k * radius_m * length_m * length_m * u.x.hypot(u.y) * sinc(k * length_m * u.z).powi(2)
}

/// Sphere at the origin, exact physical optics: with x = 2ka,
/// S = −jka² [e^{jx}/(jx) + (e^{jx} − 1)/x²]. The second term is the shadow boundary's, which a real
/// sphere does not have.
pub fn po_sphere(radius_m: f64, freq_hz: f64) -> Complex64 {
    let k = wavenumber(freq_hz);
    let x = 2.0 * k * radius_m;
    let e = Complex64::cis(x);
    let integral = e / Complex64::new(0.0, x) + (e - 1.0) / (x * x);
    Complex64::new(0.0, -k * radius_m * radius_m) * integral
}

/// Amplitude of a sphere at the origin, exact (Mie series).
///
/// # Errors
/// Returns an error if the sphere's size lies outside `em::mie::KA_RANGE`.
///
/// # Example
/// A sphere that is large against the wavelength has its optical cross section πa². One that is small has Rayleigh's
/// 9πa²(ka)⁴, which falls with the fourth power of the frequency.
///
/// ```
/// use catseye::base::units::{db_from_power, wavenumber};
/// use catseye::rcs::closed_form::{mie_sphere, rcs_m2};
/// use std::f64::consts::PI;
///
/// let freq_hz = 77e9;
/// let large_m2 = rcs_m2(mie_sphere(0.1, freq_hz)?);
/// assert!(db_from_power(large_m2 / (PI * 0.1_f64.powi(2))).abs() < 0.1);
/// let radius_m = 0.05e-3;
/// let rayleigh_m2 = 9.0 * PI * radius_m * radius_m * (wavenumber(freq_hz) * radius_m).powi(4);
/// let small_m2 = rcs_m2(mie_sphere(radius_m, freq_hz)?);
/// assert!(db_from_power(small_m2 / rayleigh_m2).abs() < 0.1);
/// # Ok::<(), catseye::Error>(())
/// ```
pub fn mie_sphere(radius_m: f64, freq_hz: f64) -> Result<Complex64> {
    Ok(SphereSeries::pec(radius_m, freq_hz)?.backscatter_m())
}

/// Flat area A seen along its normal: σ = 4πA²/λ², m².
fn flat_m2(area_m2: f64, freq_hz: f64) -> f64 {
    4.0 * PI * (area_m2 / wavelength_m(freq_hz)).powi(2)
}

/// Right dihedral of two plates w x h face on, GO: 8π w² h² / λ², m²: the flat area √2 w h of its
/// opening.
pub fn go_dihedral_m2(width_m: f64, height_m: f64, freq_hz: f64) -> f64 {
    flat_m2(std::f64::consts::SQRT_2 * width_m * height_m, freq_hz)
}

/// Direction cosines of `u` on the three legs of a trihedral in its pose, smallest first; None when
/// one of the faces is not lit.
fn corner_cosines(u: DVec3) -> Option<[f64; 3]> {
    let d = std::f64::consts::FRAC_1_SQRT_2;
    let mut c = [d * (u.x - u.y), d * (u.x + u.y), u.z];
    c.sort_by(f64::total_cmp);
    (c[0] > 0.0).then_some(c)
}

/// Trihedral of triangular faces, triple bounce in GO, any direction: σ = 4πA²/λ² with the area that
/// is common to the opening and its image through the apex, for direction cosines l ≤ m ≤ n:
/// A = leg² · 4lm/(l+m+n) where l + m ≤ n, else leg² (l + m + n − 2/(l+m+n)) (R. C. Spencer, *Optical
/// theory of the corner reflector*, MIT Radiation Laboratory report 433, 1944). On boresight
/// 4π leg⁴/(3λ²). Zero where a face is not lit.
///
/// # Example
/// The usual calibration target of automotive radars: legs of 10 cm at 77 GHz have 14.4 dBsm on boresight. The value
/// falls off boresight: between its half powers the pattern is about 48° wide in azimuth.
///
/// ```
/// use catseye::base::frames::direction_from_angles;
/// use catseye::base::units::{db_from_power, wavelength_m};
/// use catseye::rcs::closed_form::go_trihedral_m2;
/// use std::f64::consts::PI;
///
/// let (leg_m, freq_hz, boresight_rad) = (0.1_f64, 77e9, 0.5f64.sqrt().atan());
/// let at = |azimuth_deg: f64| {
///     go_trihedral_m2(leg_m, freq_hz, direction_from_angles(azimuth_deg.to_radians(), boresight_rad))
/// };
/// let peak_m2 = 4.0 * PI * leg_m.powi(4) / (3.0 * wavelength_m(freq_hz).powi(2));
/// assert!((at(0.0) / peak_m2 - 1.0).abs() < 1e-12);
/// assert!((db_from_power(peak_m2) - 14.41).abs() < 0.01);
/// assert!(at(23.0) > 0.5 * peak_m2 && at(25.0) < 0.5 * peak_m2);
/// ```
pub fn go_trihedral_m2(leg_m: f64, freq_hz: f64, u: DVec3) -> f64 {
    let Some([l, m, n]) = corner_cosines(u) else { return 0.0 };
    let sum = l + m + n;
    let area = if l + m <= n { 4.0 * l * m / sum } else { sum - 2.0 / sum };
    flat_m2(leg_m * leg_m * area, freq_hz)
}

/// Trihedral of square faces, triple bounce in GO: A = leg² · 4lm/n where m ≤ n/2, else
/// leg² · l (4 − n/m), from the same report. On boresight 12π leg⁴/λ². Zero where a face is not lit.
pub fn go_square_trihedral_m2(leg_m: f64, freq_hz: f64, u: DVec3) -> f64 {
    let Some([l, m, n]) = corner_cosines(u) else { return 0.0 };
    let area = if m <= 0.5 * n { 4.0 * l * m / n } else { l * (4.0 - n / m) };
    flat_m2(leg_m * leg_m * area, freq_hz)
}

/// Steps for a periodic integrand whose phase turns by x.
fn quadrature_steps(x: f64) -> usize {
    (2.0 * x) as usize + 64
}

/// Panels of two radians or less, for which eight Gauss points leave only rounding error.
fn panels(x: f64) -> usize {
    (x / 2.0) as usize + 4
}

/// Composite 8-point Gauss–Legendre rule.
fn gauss_panels(a: f64, b: f64, panels: usize, f: impl Fn(f64) -> Complex64) -> Complex64 {
    const NODES: [(f64, f64); 4] = [
        (0.183_434_642_495_649_8, 0.362_683_783_378_362),
        (0.525_532_409_916_329, 0.313_706_645_877_887_3),
        (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
        (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
    ];
    let h = 0.5 * (b - a) / panels as f64;
    (0..panels)
        .map(|i| {
            let mid = a + (2 * i + 1) as f64 * h;
            NODES.iter().map(|(x, w)| (f(mid - h * x) + f(mid + h * x)) * (w * h)).sum::<Complex64>()
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::frames::direction_from_angles;
    use crate::base::units::{db_from_power, dbsm_from_amplitude};
    use proptest::prelude::*;

    const F: f64 = 77e9;

    fn boresight() -> DVec3 {
        DVec3::new(2f64.sqrt(), 0.0, 1.0) / 3f64.sqrt()
    }

    #[test]
    fn values_by_hand() {
        // lambda = 3.89341 mm; the decibels were worked out on paper.
        for (value, dbsm) in [
            (go_trihedral_m2(0.1, F, boresight()), 14.414),
            (go_trihedral_m2(0.008, F, boresight()), -29.462),
            (go_square_trihedral_m2(0.1, F, boresight()), 23.957),
            (go_dihedral_m2(0.1, 0.1, F), 22.196),
            (rcs_m2(po_plate(0.1, 0.1, F, DVec3::X)), 19.186),
        ] {
            assert!((db_from_power(value) - dbsm).abs() < 1e-3, "{} {dbsm}", db_from_power(value));
        }
    }

    #[test]
    fn plate_nulls_and_first_lobe() {
        let w = 0.1;
        let at = |t: f64| rcs_m2(po_plate(w, 0.05, F, DVec3::new((1.0 - t * t).sqrt(), t, 0.0)));
        // First null at sin = lambda / 2w; first side lobe 13.26 dB down at x = 4.4934.
        let null = wavelength_m(F) / (2.0 * w);
        assert!(at(null) < 1e-20 * at(0.0));
        let lobe = 4.493_409_457_909_064 / (wavenumber(F) * w);
        let db = db_from_power(at(lobe) / at(0.0));
        assert!((db + 13.2615 - 10.0 * (1.0 - lobe * lobe).log10()).abs() < 1e-3, "{db}");
        // The two planes swap with the two sides, and the back returns as the front does.
        let (y, z) = (direction_from_angles(0.1, 0.0), direction_from_angles(0.0, 0.1));
        assert!((po_plate(0.1, 0.04, F, y) - po_plate(0.04, 0.1, F, z)).norm() < 1e-12);
        assert_eq!(po_plate(0.1, 0.04, F, -y), po_plate(0.1, 0.04, F, y));
    }

    #[test]
    fn cylinder_tends_to_the_stationary_phase_value() {
        for (ka, tolerance_db) in [(5.0, 0.5), (50.0, 0.12), (500.0, 0.02)] {
            let a = ka / wavenumber(F);
            for e in [0.0f64, 0.3] {
                let u = direction_from_angles(1.0, e);
                let exact = db_from_power(rcs_m2(po_cylinder_mantle(a, 0.15, F, u)));
                let usual = db_from_power(cylinder_stationary_phase_m2(a, 0.15, F, u));
                assert!((exact - usual).abs() < tolerance_db, "{ka} {e}: {exact} {usual}");
            }
        }
        // Broadside with Struve and Bessel functions: the integral of cos φ e^{jx cos φ} over the quarter
        // circle is 1 − (π/2) H₁(x) + j (π/2) J₁(x) (Abramowitz and Stegun 12.1.7, 9.1.20). At x = 5 their
        // power series give H₁ = 0.807811945794, J₁ = −0.327579137591.
        let s = gauss_panels(0.0, FRAC_PI_2, panels(5.0), |p| Complex64::cis(5.0 * p.cos()) * p.cos());
        let exact = Complex64::new(1.0 - FRAC_PI_2 * 0.807_811_945_794, -FRAC_PI_2 * 0.327_579_137_591);
        assert!((s - exact).norm() < 1e-11, "{s} {exact}");
        // End on, only the disc returns, as a plate of its area.
        let end_on = rcs_m2(po_cylinder(0.02, 0.15, F, DVec3::Z));
        assert!((end_on / flat_m2(PI * 0.02 * 0.02, F) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn disc_has_airys_first_null() {
        let x = 3.831_705_970_207_512;
        let s = x / (2.0 * wavenumber(F) * 0.05);
        let null = po_disc(0.05, 0.01, F, DVec3::new(s, 0.0, (1.0 - s * s).sqrt()));
        assert!(null.norm() < 1e-12 * po_disc(0.05, 0.01, F, DVec3::Z).norm());
        assert_eq!(po_disc(0.05, 0.01, F, -DVec3::Z), Complex64::ZERO);
    }

    /// TRUTH: physical optics of a sphere within 0.15 dB of Mie for ka >= 40, and in phase.
    #[test]
    fn sphere_from_both_sides() {
        for ka in [40.0, 41.3, 80.7, 161.4, 1000.0] {
            let a = ka / wavenumber(F);
            let (po, mie) = (po_sphere(a, F), mie_sphere(a, F).unwrap());
            let db = dbsm_from_amplitude(po.norm()) - dbsm_from_amplitude(mie.norm());
            assert!(db.abs() < 0.15, "{ka}: {db}");
            assert!((po / mie).arg().abs() < 1.0 / ka, "{ka}: {}", (po / mie).arg());
        }
    }

    #[test]
    fn corner_areas_join_and_end() {
        // Both branches agree where they meet, and nothing comes back past a face.
        let meet = DVec3::new(0.3, 0.3, 0.6).normalize();
        let (l, m, n) = (meet.x, meet.y, meet.z);
        let sum = l + m + n;
        assert!((4.0 * l * m / sum - (sum - 2.0 / sum)).abs() < 1e-12);
        for u in [direction_from_angles(0.8, 0.6), direction_from_angles(0.0, -0.1)] {
            assert_eq!(go_trihedral_m2(0.1, F, u), 0.0);
            assert_eq!(go_square_trihedral_m2(0.1, F, u), 0.0);
        }
    }

    /// Area by brute force: the overlap of the opening's projection with its image through the apex.
    fn overlap(u: DVec3, square: bool) -> f64 {
        let d = std::f64::consts::FRAC_1_SQRT_2;
        let legs = [DVec3::new(d, -d, 0.0), DVec3::new(d, d, 0.0), DVec3::Z];
        let (v, h) = crate::base::frames::polarisation_basis(u);
        let inside = |p: DVec3| {
            // The ray through p along u meets one of the faces in its outline.
            (0..3).any(|i| {
                let (a, b, n) = (legs[i], legs[(i + 1) % 3], legs[(i + 2) % 3]);
                let hit = p - u * (p.dot(n) / u.dot(n));
                let (s, t) = (hit.dot(a), hit.dot(b));
                let within = if square { s <= 1.0 && t <= 1.0 } else { s + t <= 1.0 };
                s >= 0.0 && t >= 0.0 && within
            })
        };
        let n = 700;
        let step = 3.0 / f64::from(n);
        let mut hits = 0u32;
        for i in 0..n {
            for j in 0..n {
                let p = (v * (f64::from(i) + 0.5) + h * (f64::from(j) + 0.5)) * step - (v + h) * 1.5;
                hits += u32::from(inside(p) && inside(-p));
            }
        }
        f64::from(hits) * step * step
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]
        #[test]
        fn corner_areas_by_brute_force(az in -0.7f64..0.7, el in 0.1f64..1.4) {
            let u = direction_from_angles(az, el);
            for square in [false, true] {
                let sigma = if square { go_square_trihedral_m2(1.0, F, u) } else { go_trihedral_m2(1.0, F, u) };
                let area = (sigma / (4.0 * PI)).sqrt() * wavelength_m(F);
                prop_assert!((area - overlap(u, square)).abs() < 0.01, "{} {} {}", square, area, overlap(u, square));
            }
        }
    }
}
