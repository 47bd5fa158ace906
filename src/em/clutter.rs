//! Backscatter per area of ground against the grazing angle (CONVENTIONS eq. 145-147).
//!
//! Means over many cells. Kulemin's laws and constant gamma are cut where the half-space, if it got everywhere what goes back, would
//! get more power than comes: for a town below 2.7 degrees of grazing. Angles outside the range of a law's measurements are continued as its function
//! says; a grazing angle above 30 degrees in Kulemin's law as constant gamma.

use crate::base::units::{C0, power_from_db};
use crate::scene::backscatter::{Backscatter, Ground, Law};
use std::f64::consts::{PI, TAU};

/// Backscattering coefficients, cross section over area: V along the plane of incidence, H across. `hv` is the one of VH and HV,
/// which reciprocity makes equal.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sigma0 {
    /// Vertical to vertical, cross section over area.
    pub vv: f64,
    /// Horizontal to horizontal, cross section over area.
    pub hh: f64,
    /// Between the two polarisations, cross section over area.
    pub hv: f64,
}

/// Properties of a surface on which Oh's law depends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Front {
    /// |R|^2 of the smooth surface, [perpendicular, parallel].
    pub reflectivity: [f64; 2],
    /// |R|^2 of the smooth surface at normal incidence.
    pub nadir_reflectivity: f64,
    /// Standard deviation of the height, m.
    pub roughness_rms_m: f64,
}

/// Grazing angle up to which Kulemin's law was measured, degrees.
pub const KULEMIN_GRAZING_DEG: f64 = 30.0;

/// Backscatter per area of the ground at incidence cosine `cos_i` in (0, 1] and `wavenumber` rad/m.
pub fn sigma0(backscatter: &Backscatter, wavenumber: f64, front: &Front, cos_i: f64) -> Sigma0 {
    let alike = |law: f64| {
        let across = backscatter.cross_db.map_or(0.0, power_from_db);
        let co = law.min(2.0 * cos_i / (1.0 + across));
        Sigma0 { vv: co, hh: co, hv: co * across }
    };
    match backscatter.law {
        Law::ConstantGamma { gamma_db } => alike(power_from_db(gamma_db) * cos_i),
        Law::Kulemin(ground) => alike(kulemin(ground, wavenumber * C0 / TAU, cos_i)),
        Law::Oh => {
            let kh = wavenumber * front.roughness_rms_m;
            let s = oh(kh, front, cos_i);
            // No more than the mirror reflection leaves.
            let most = |i: usize| {
                let coherent = front.reflectivity[i] * (-(2.0 * kh * cos_i).powi(2)).exp();
                (2.0 * cos_i * (1.0 - coherent) - s.hv).max(0.0)
            };
            Sigma0 { vv: s.vv.min(most(1)), hh: s.hh.min(most(0)), hv: s.hv }
        }
    }
}

/// sigma0 in dB = A1 + A2 lg(grazing angle / 20 deg) + A3 lg(f / 10 GHz), 3-100 GHz, grazing angles up to
/// [`KULEMIN_GRAZING_DEG`], both polarisations: Kulemin, *Millimeter-Wave Radar Targets and Clutter* (Artech House 2003),
/// chapter 2. For low grass he gives A1 = -25 to -30; the middle is taken. The rows were not compared with the printed table.
///
/// # Example
/// At 77 GHz and 5° of grazing, high grass returns 29 dB more per area than concrete does.
///
/// ```
/// use catseye::base::units::db_from_power;
/// use catseye::em::clutter::kulemin;
/// use catseye::scene::backscatter::Ground;
///
/// // The cosine of the angle of incidence is the sine of the grazing angle.
/// let db = |ground| db_from_power(kulemin(ground, 77e9, 5f64.to_radians().sin()));
/// let expected_db = -49.0 + 32.0 * 0.25f64.log10() + 20.0 * 7.7f64.log10();
/// assert!((db(Ground::Concrete) - expected_db).abs() < 1e-9);
/// assert!((db(Ground::HighGrass) - db(Ground::Concrete) - 28.8).abs() < 0.1);
/// ```
pub fn kulemin(ground: Ground, freq_hz: f64, cos_i: f64) -> f64 {
    let [a1, a2, a3] = match ground {
        Ground::Concrete => [-49.0, 32.0, 20.0],
        Ground::ArableLand => [-37.0, 18.0, 15.0],
        Ground::Snow => [-34.0, 25.0, 15.0],
        Ground::ForestInSummer => [-20.0, 10.0, 6.0],
        Ground::ForestInWinter => [-40.0, 10.0, 6.0],
        Ground::HighGrass => [-21.0, 10.0, 6.0],
        Ground::LowGrass => [-27.5, 10.0, 6.0],
        Ground::Town => [-8.5, 5.0, 3.0],
    };
    let grazing_deg = cos_i.clamp(0.0, 1.0).asin().to_degrees();
    let measured = grazing_deg.min(KULEMIN_GRAZING_DEG);
    let db = a1 + a2 * (measured / 20.0).log10() + a3 * (freq_hz / 10e9).log10();
    let beyond = if grazing_deg > measured { cos_i / measured.to_radians().sin() } else { 1.0 };
    power_from_db(db) * beyond
}

/// Backscatter of bare rough surfaces (Oh, Sarabandi and Ulaby, *IEEE Trans. Geosci. Remote Sens.* 30 (1992) 370): of k
/// h 0.1 to 6, correlation lengths k l 2.6 to 20 and incidence 10 to 70 degrees; measured up to 9.5 GHz and a function
/// of k h, so it holds at others for what the surface alone scatters. `kh` is wavenumber times standard deviation of
/// the height.
pub fn oh(kh: f64, front: &Front, cos_i: f64) -> Sigma0 {
    let gamma0 = front.nadir_reflectivity;
    if kh == 0.0 || gamma0 == 0.0 {
        return Sigma0::default();
    }
    let theta = cos_i.clamp(0.0, 1.0).acos();
    let root_p = 1.0 - (2.0 * theta / PI).powf(1.0 / (3.0 * gamma0)) * (-kh).exp();
    let q = 0.23 * gamma0.sqrt() * (1.0 - (-kh).exp());
    let g = 0.7 * (1.0 - (-0.65 * kh.powf(1.8)).exp());
    let common = g * cos_i.powi(3) * (front.reflectivity[0] + front.reflectivity[1]);
    let vv = common / root_p;
    Sigma0 { vv, hh: common * root_p, hv: q * vv }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::{db_from_power, wavenumber};
    use crate::em::fresnel;
    use crate::em::roughness::Shares;
    use num_complex::Complex64;

    fn front(eps: Option<Complex64>, roughness_rms_m: f64, cos_i: f64) -> Front {
        let (perp, par) = fresnel::reflection(eps, cos_i);
        Front {
            reflectivity: [perp.norm_sqr(), par.norm_sqr()],
            nadir_reflectivity: fresnel::reflection(eps, 1.0).0.norm_sqr(),
            roughness_rms_m,
        }
    }

    /// By hand at 77 GHz: concrete at 20 deg -49 + 20 lg 7.7 = -31.27 dB, at 5 deg 32 lg 4 less; snow at 10 deg
    /// -34 - 25 lg 2 + 15 lg 7.7.
    #[test]
    fn kulemin_by_hand() {
        let db = |g, deg: f64| db_from_power(kulemin(g, 77e9, deg.to_radians().sin()));
        assert!((db(Ground::Concrete, 20.0) + 31.2702).abs() < 1e-3);
        assert!((db(Ground::Concrete, 5.0) + 31.2702 + 19.2659).abs() < 1e-3);
        assert!((db(Ground::Snow, 10.0) + 34.0 + 7.5257 - 13.2974).abs() < 1e-3);
        // Constant gamma beyond 30 degrees, without a step.
        assert!((db(Ground::Snow, 90.0) - db(Ground::Snow, 30.0) - 3.0103).abs() < 1e-3);
        assert!((db(Ground::Town, 30.0001) - db(Ground::Town, 29.9999)).abs() < 1e-3);
    }

    /// Oh's law at k h = 0.4, eps 9, 40 degrees, put together by hand: Gamma_0 = 1/4, p = (1 - (4/9)^{4/3} e^-0.4)^2,
    /// g = 0.7 (1 - e^{-0.65 0.4^1.8}), |R|^2 of 40 degrees 0.3498 and 0.1548.
    #[test]
    fn oh_by_hand() {
        let cos_i = 40f64.to_radians().cos();
        let f = front(Some(Complex64::new(9.0, 0.0)), 0.0, cos_i);
        assert!((f.nadir_reflectivity - 0.25).abs() < 1e-12);
        let s = oh(0.4, &f, cos_i);
        let root_p = 1.0 - (4f64 / 9.0).powf(4.0 / 3.0) * 0.670_320_046;
        assert!(((s.hh / s.vv).sqrt() - root_p).abs() < 1e-9);
        assert!((s.hv / s.vv - 0.23 * 0.5 * 0.329_679_954).abs() < 1e-9);
        let g = 0.7 * (1.0 - (-0.65 * 0.4f64.powf(1.8)).exp());
        let both = f.reflectivity[0] + f.reflectivity[1];
        assert!(((s.vv * s.hh).sqrt() / (g * cos_i.powi(3) * both) - 1.0).abs() < 1e-12);
        assert_eq!(oh(0.0, &f, cos_i), Sigma0::default());
    }

    /// If the half-space got everywhere what goes back, power would not grow: coherent + sigma0 / (2 cos) <= 1.
    #[test]
    fn no_law_gives_power() {
        let k = wavenumber(77e9);
        let laws = Ground::ALL.iter().map(|(_, g)| Law::Kulemin(*g));
        let gamma = Law::ConstantGamma { gamma_db: crate::scene::backscatter::GAMMA_DB_MAX - 0.01 };
        for law in laws.chain([Law::Oh, gamma]) {
            for eps in [None, Some(Complex64::new(8.6, 0.0)), Some(Complex64::new(2.5, -0.1))] {
                for h in [5e-5, 2e-4, 5e-4, 1e-3, 3.7e-3] {
                    for i in 1..=200 {
                        let cos_i = i as f64 / 200.0;
                        let f = front(eps, h, cos_i);
                        let s = sigma0(&Backscatter::of(law), k, &f, cos_i);
                        let (perp, par) = fresnel::reflection(eps, cos_i);
                        for (r, co) in [(perp, s.hh), (par, s.vv)] {
                            // Only the laws that know the surface can be weighed against its mirror reflection.
                            let coherent =
                                if law == Law::Oh { Shares::of(r, k, h, cos_i).coherent } else { 0.0 };
                            let all = coherent + (co + s.hv) / (2.0 * cos_i);
                            assert!(
                                all <= 1.0 + 1e-12 && all.is_finite(),
                                "{law:?} {eps:?} {h} {cos_i}: {all}"
                            );
                        }
                    }
                }
            }
        }
    }
}
