//! Fringe currents of a perfectly conducting wedge: what the exact solution of the infinite wedge holds
//! beyond physical optics (CONVENTIONS eq. 30–35).
//!
//! Ufimtsev's physical theory of diffraction adds to the physical-optics current of a face the fringe
//! current, which is bound to the edge. Sommerfeld's integral gives it on each face as a spectrum of waves
//! that run away from the edge; its radiation integral over a strip that leaves the edge along the
//! grazing diffracted ray **û** has a closed form by residues. That choice of strip is Michaeli's
//! (*Elimination of infinities in equivalent edge currents, part I: fringe current components*, IEEE
//! Trans. Antennas Propag. AP-34, 912–918, 1986): on the Keller cone any choice gives the same, away from
//! it this one stays finite. The residues are summed here in a form of their own (32), which is smooth
//! through the shadow and reflection boundaries.

use glam::{DMat3, DVec3};
use num_complex::Complex64;
use std::f64::consts::PI;

/// A source nearer to the plane of a face than this (radians) lies in it.
const IN_PLANE: f64 = 1e-9;
/// Sine of the smallest angle between incidence and edge; a wave closer to the edge is taken there.
const ALONG_EDGE: f64 = 1e-6;
/// Distance of ξ from π below which the observer stands in the grazing ray.
const GRAZING: f64 = 1e-7;

/// A straight edge with its two faces. The space outside the metal lies at angles 0 … nπ from face 0.
///
/// # Example
/// The edge of a cube, whose metal fills x < 0, y < 0: an exterior angle of 3π/2, and a diffracted field that is
/// transverse to the direction of scattering.
///
/// ```
/// use catseye::em::wedge::Wedge;
/// use glam::DVec3;
///
/// let cube = Wedge::new([DVec3::NEG_X, DVec3::NEG_Y], DVec3::Y).ok_or("the edge is not convex")?;
/// assert!((cube.n - 1.5).abs() < 1e-12);
/// assert!(cube.is_outside(DVec3::X) && !cube.is_outside(DVec3::new(-0.6, -0.8, 0.0)));
/// let (incident, scattered) = (DVec3::new(-0.8, -0.6, 0.0), DVec3::new(0.6, 0.0, 0.8));
/// let field = cube.fringe(incident, scattered) * DVec3::Z;
/// assert!(field.length() > 0.0 && field.dot(scattered).abs() < 1e-12 * field.length());
/// # Ok::<(), &str>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wedge {
    /// Unit vector along the edge: `into[0]` × `normal[0]`.
    pub tangent: DVec3,
    /// Unit vector in each face, at right angles to the edge and away from it.
    pub into: [DVec3; 2],
    /// Unit normals of the faces, out of the metal.
    pub normal: [DVec3; 2],
    /// Exterior angle over π: in (1, 2], 2 for a half-plane, 3/2 for a cube.
    pub n: f64,
}

impl Wedge {
    /// The wedge of two half-planes that leave an edge along the unit vectors `into`, the first with the
    /// outward normal `normal`; all three at right angles to the edge. None when the outside is not larger
    /// than a half-space: such an edge has no fringe of first order.
    pub fn new(into: [DVec3; 2], normal: DVec3) -> Option<Wedge> {
        let tangent = into[0].cross(normal);
        let angle = into[1].dot(normal).atan2(into[1].dot(into[0]));
        // Folded back on itself within rounding is a half-plane, whose back face lies at 2π, not at 0.
        let angle = if angle < IN_PLANE { angle + 2.0 * PI } else { angle };
        let n = (angle / PI).min(2.0);
        if !(n > 1.0 && tangent.is_finite()) {
            return None;
        }
        Some(Wedge { tangent, into, normal: [normal, into[1].cross(tangent)], n })
    }

    /// The wedge of a half-plane that leaves its edge along `into`.
    pub fn half_plane(into: DVec3, normal: DVec3) -> Wedge {
        Wedge { tangent: into.cross(normal), into: [into, into], normal: [normal, -normal], n: 2.0 }
    }

    /// Angle of the direction `u` about the edge, from face 0 through the space outside, 0 … 2π.
    pub fn angle(&self, u: DVec3) -> f64 {
        let a = u.dot(self.normal[0]).atan2(u.dot(self.into[0]));
        if a < -IN_PLANE { a + 2.0 * PI } else { a.max(0.0) }
    }

    /// Whether the direction `u` points out of the metal.
    pub fn is_outside(&self, u: DVec3) -> bool {
        self.angle(u) <= self.n * PI + IN_PLANE
    }

    /// The dyad D of (30): real, without unit, free of frequency. `incident` is the direction in which the
    /// plane wave travels, `scattered` the one from the edge to the receiver, both unit vectors. Zero for
    /// a source inside the metal.
    ///
    /// Finite for all directions but one pair: incidence that glides inwards along a face (φ′ = π) together
    /// with observation in the ray's continuation, where the fringe current does not decay (Ufimtsev's
    /// singularity); the value there is large and means nothing.
    ///
    /// D maps a field that is transverse to `incident` to one transverse to `scattered`.
    pub fn fringe(&self, incident: DVec3, scattered: DVec3) -> DMat3 {
        if !self.is_outside(-incident) {
            return DMat3::ZERO;
        }
        let phi = self.angle(-incident).clamp(0.0, self.n * PI);
        // A wave in the plane of a face is half-way between one that lights the face and one that finds it
        // hidden: by the metal of a wedge, which returns nothing, or lit from the other side of a sheet.
        let one_side = |phi| 0.5 * self.of_faces(phi, incident, scattered);
        if self.n == 2.0 && (phi < IN_PLANE || 2.0 * PI - phi < IN_PLANE) {
            return one_side(0.0) + one_side(2.0 * PI);
        }
        if phi < IN_PLANE || self.n * PI - phi < IN_PLANE {
            return one_side(phi);
        }
        self.of_faces(phi, incident, scattered)
    }

    fn of_faces(&self, phi: f64, incident: DVec3, scattered: DVec3) -> DMat3 {
        // The second face sees the first one's picture in a mirror.
        self.of_face(0, phi, incident, scattered) + self.of_face(1, self.n * PI - phi, incident, scattered)
    }

    /// D of one face, with φ′ measured from it (30–34).
    fn of_face(&self, face: usize, phi: f64, incident: DVec3, scattered: DVec3) -> DMat3 {
        let x = self.into[face];
        let z = x.cross(self.normal[face]);
        let cos_b = incident.dot(z).clamp(-1.0, 1.0);
        let sin_b = incident.cross(z).length().max(ALONG_EDGE);
        let ray = x * sin_b + z * cos_b;
        let mu = ((scattered.dot(ray) - cos_b * cos_b) / (sin_b * sin_b)).min(GRAZING.cos());
        let c = coefficients(self.n, phi, mu);
        // Dyads from the incident E to eta times the fringe current of one metre of edge.
        let of_e = z * (c.soft / (sin_b * sin_b));
        let of_h = x * (c.hard / sin_b) + z * (c.hard_along * cos_b / (sin_b * sin_b));
        // eta H = k x E, so eta H_z = (z x k) . E.
        let current = outer(of_e, z) + outer(of_h, z.cross(incident));
        // Fields have no part along their ray: without it D stays finite for waves along the edge too.
        let across = |u: DVec3| DMat3::IDENTITY - outer(u, u);
        across(scattered) * current * across(incident)
    }
}

/// a bᵀ.
fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// The three numbers of (32) for one face.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Coefficients {
    soft: f64,
    hard: f64,
    /// μ R_h − h(0).
    hard_along: f64,
}

/// (31) to (33): wedge of exterior angle nπ, incidence φ′ from this face, μ < 1 of (31).
fn coefficients(n: f64, phi: f64, mu: f64) -> Coefficients {
    let lit = phi < PI;
    // cos ξ = −μ, on the imaginary axis where μ < −1.
    let (xi, sin_xi) = if mu >= -1.0 {
        let xi = (-mu).acos();
        (Complex64::new(xi, 0.0), Complex64::new(xi.sin(), 0.0))
    } else {
        let b = (-mu).acosh();
        (Complex64::new(0.0, b), Complex64::new(0.0, b.sinh()))
    };
    let (difference, sum) = (kernel(n, lit, xi - phi), kernel(n, lit, xi + phi));
    let soft = (difference - sum).re;
    let hard = if xi.norm() < 1e-5 {
        // Both terms cancel as ξ → 0; the next order is ξ².
        2.0 * kernel_slope(n, lit, phi)
    } else {
        ((difference + sum) / sin_xi).re
    };
    let at_edge = 2.0 / n - if lit { 2.0 } else { 0.0 };
    Coefficients { soft, hard, hard_along: mu * hard - at_edge }
}

/// Q(x) = (1/n) cot(x/2n) − U cot(x/2), U = 1 on a lit face, else 0. The pole at 0 of a lit face cancels.
fn kernel(n: f64, lit: bool, x: Complex64) -> Complex64 {
    if !lit {
        return cot(x / (2.0 * n)) / n;
    }
    if x.norm() < SERIES {
        // cot y = 1/y − y/3 − y³/45 − 2y⁵/945 − y⁷/4725 − …
        let (h2, q2) = (x * x / 4.0, 1.0 / (n * n));
        let term = |c: f64, power: i32| c * (1.0 - q2.powi(power));
        let series = ((h2 * term(1.0 / 4725.0, 4) + term(2.0 / 945.0, 3)) * h2 + term(1.0 / 45.0, 2)) * h2
            + term(1.0 / 3.0, 1);
        return x / 2.0 * series;
    }
    cot(x / (2.0 * n)) / n - cot(x / 2.0)
}

/// Below this the series of [`kernel`] has only rounding error: the next term is 2y⁹/93555, y = x/2.
const SERIES: f64 = 0.1;

/// dQ/dx for real x.
fn kernel_slope(n: f64, lit: bool, x: f64) -> f64 {
    let csc2 = |y: f64| 1.0 / y.sin().powi(2);
    if !lit {
        return -csc2(x / (2.0 * n)) / (2.0 * n * n);
    }
    if x.abs() < SERIES {
        let (h2, q2) = (x * x / 4.0, 1.0 / (n * n));
        let term = |c: f64, power: i32| c * (1.0 - q2.powi(power));
        let series = ((7.0 * h2 * term(1.0 / 4725.0, 4) + 5.0 * term(2.0 / 945.0, 3)) * h2
            + 3.0 * term(1.0 / 45.0, 2))
            * h2
            + term(1.0 / 3.0, 1);
        return series / 2.0;
    }
    csc2(x / 2.0) / 2.0 - csc2(x / (2.0 * n)) / (2.0 * n * n)
}

/// Cotangent that does not overflow far from the real axis.
fn cot(z: Complex64) -> Complex64 {
    if z.im == 0.0 {
        return Complex64::new(z.re.cos() / z.re.sin(), 0.0);
    }
    // cot z = −j s (1 + q)/(1 − q) with q = e^{2jsz}, |q| < 1.
    let s = z.im.signum();
    let q = (Complex64::new(0.0, 2.0 * s) * z).exp();
    Complex64::new(0.0, -s) * (1.0 + q) / (1.0 - q)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::frames::polarisation_basis;
    use proptest::prelude::*;
    use statrs::function::gamma::gamma;

    /// A wedge about +z with face 0 in the half-plane y = 0, x > 0.
    fn wedge(n: f64) -> Wedge {
        let (s, c) = (n * PI).sin_cos();
        let w = Wedge::new([DVec3::X, DVec3::new(c, s, 0.0)], DVec3::Y).unwrap();
        assert!((w.n - n).abs() < 1e-12 && (w.tangent - DVec3::Z).length() < 1e-12, "{w:?}");
        w
    }

    /// Direction from the edge at angle φ about it, β from +z.
    fn direction(phi: f64, beta: f64) -> DVec3 {
        DVec3::new(beta.sin() * phi.cos(), beta.sin() * phi.sin(), beta.cos())
    }

    /// The edge's share of physical optics: J = 2 n × H on each lit face, integrated along the same ray.
    fn of_physical_optics(w: &Wedge, incident: DVec3, s: DVec3) -> DMat3 {
        let mut d = DMat3::ZERO;
        for f in 0..2 {
            let (x, y) = (w.into[f], w.normal[f]);
            let z = x.cross(y);
            if incident.dot(y) >= 0.0 {
                continue;
            }
            let (cos_b, sin_b) = (incident.dot(z), incident.cross(z).length());
            let ray = x * sin_b + z * cos_b;
            // Phase of current and path per metre along the ray, over k.
            let rate = (s - incident).dot(ray);
            let radiated = |e: DVec3| {
                let j = 2.0 * y.cross(incident.cross(e)) * (sin_b / rate);
                j - s * s.dot(j)
            };
            d += DMat3::from_cols(radiated(DVec3::X), radiated(DVec3::Y), radiated(DVec3::Z));
        }
        d
    }

    /// Keller's coefficients without the factor e^{-jπ/4}/(√(2πk) sin β) (Kouyoumjian and Pathak, Proc. IEEE
    /// 62, 1448–1461, 1974, eq. 11), for E_z and H_z.
    fn keller(n: f64, phi_in: f64, phi: f64) -> (f64, f64) {
        let term = |a: f64| 1.0 / ((PI / n).cos() - (a / n).cos());
        let (d, s) = (term(phi - phi_in), term(phi + phi_in));
        let c = (PI / n).sin() / n;
        (c * (d - s), c * (d + s))
    }

    proptest! {
        #[test]
        fn with_physical_optics_it_is_kellers_wedge(
            n in 1.02f64..=2.0, a in 0.02f64..0.98, b in 0.02f64..0.98, beta in 0.2f64..2.9,
        ) {
            let w = wedge(n);
            let (phi_in, phi) = (a * n * PI, b * n * PI);
            let incident = -direction(phi_in, PI - beta);
            let s = direction(phi, beta);
            let (soft, hard) = keller(n, phi_in, phi);
            let d = w.fringe(incident, s) + of_physical_optics(&w, incident, s);
            // E along z alone, then H along z alone, of the incident wave, both of unit size.
            let z_part = (DVec3::Z - incident * incident.z).normalize();
            let e_soft = d * z_part;
            let h_hard = d * z_part.cross(incident);
            // Stationary phase along the edge turns (1/4π) D into Keller's coefficient.
            let soft_here = e_soft.z / (2.0 * z_part.z);
            let eta_h = s.cross(h_hard);
            let hard_here = eta_h.z / (2.0 * incident.cross(z_part.cross(incident)).z);
            let scale = soft.abs() + hard.abs() + 1.0;
            prop_assert!((soft_here - soft).abs() < 1e-9 * scale, "soft {soft_here} {soft}");
            prop_assert!((hard_here - hard).abs() < 1e-9 * scale, "hard {hard_here} {hard}");
            // Neither turns the polarisation on the cone.
            prop_assert!(s.cross(e_soft).z.abs() < 1e-9 * scale && h_hard.z.abs() < 1e-9 * scale);
        }

        #[test]
        fn the_two_faces_are_alike(
            n in 1.02f64..=2.0, a in 0.0f64..1.0, beta in 0.1f64..3.0, phi in 0.0f64..6.2, beta_s in 0.1f64..3.0,
        ) {
            let w = wedge(n);
            let swapped = Wedge::new([w.into[1], w.into[0]], w.normal[1]).unwrap();
            let (i, s) = (-direction(a * n * PI, beta), direction(phi, beta_s));
            let (d, e) = (w.fringe(i, s), swapped.fringe(i, s));
            let size = d.to_cols_array().iter().fold(1.0f64, |m, x| m.max(x.abs()));
            prop_assert!((d - e).to_cols_array().iter().all(|x| x.abs() < 1e-6 * size), "{d} {e}");
        }

        #[test]
        fn finite_everywhere(
            n in prop_oneof![Just(2.0), Just(1.5), 1.0001f64..2.0],
            a in prop_oneof![Just(0.0), Just(0.5), Just(1.0), 0.0f64..1.0],
            beta in prop_oneof![Just(0.0), Just(PI), Just(PI / 2.0), 1e-9f64..1e-3, 0.0..PI],
            phi in prop_oneof![Just(0.0), Just(PI), 0.0f64..6.3],
            beta_s in prop_oneof![Just(0.0), Just(PI), Just(PI / 2.0), 0.0..PI],
            monostatic in any::<bool>(),
        ) {
            let to_source = direction(a * n * PI, beta);
            let s = if monostatic { to_source } else { direction(phi, beta_s) };
            let d = wedge(n).fringe(-to_source, s);
            // Large values occur only at Ufimtsev's singularity.
            let glides = (a * n * PI - PI).abs() < 1e-2 || ((1.0 - a) * n * PI - PI).abs() < 1e-2;
            let bound = if glides { 1e9 } else { 1e4 };
            prop_assert!(d.to_cols_array().iter().all(|x| x.abs() < bound), "{d}");
        }
    }

    /// I_ν(t), power series (Abramowitz and Stegun 9.6.10).
    fn bessel_i(nu: f64, t: f64) -> f64 {
        let mut term = (0.5 * t).powf(nu) / gamma(nu + 1.0);
        let mut sum = term;
        let mut k = 1.0;
        while term > 1e-18 * sum {
            term *= 0.25 * t * t / (k * (k + nu));
            sum += term;
            k += 1.0;
        }
        sum
    }

    /// R_s and R_h by integrating the current of the eigenfunction series (Balanis, *Advanced Engineering
    /// Electromagnetics*, 2nd ed., section 13.3.1) less physical optics, along the axis x = −jt/k sin β′ on
    /// which both decay.
    fn by_integration(n: f64, phi: f64, mu: f64) -> (f64, f64) {
        let lit = if phi < PI { 1.0 } else { 0.0 };
        let currents = |t: f64| {
            let (mut e, mut h) = (0.0, bessel_i(0.0, t));
            for m in 1..120 {
                let nu = f64::from(m) / n;
                let i = bessel_i(nu, t);
                e += 2.0 * nu * i * (nu * phi).sin() / t;
                h += 2.0 * i * (nu * phi).cos();
                if nu > t && i < 1e-17 * h.abs() {
                    break;
                }
            }
            let po = 2.0 * lit * (t * phi.cos()).exp();
            (2.0 / n * e - po * phi.sin(), 2.0 / n * h - po)
        };
        // Midpoint rule in s with t = s⁴, which takes the edge's t^{1/n − 1} away.
        let (steps, t_end) = (800, 14.0f64);
        let s_end = t_end.powf(0.25);
        let (mut soft, mut hard) = (0.0, 0.0);
        for i in 0..steps {
            let s = (f64::from(i) + 0.5) * s_end / f64::from(steps);
            let t = s.powi(4);
            let (e, h) = currents(t);
            let weight = 4.0 * s.powi(3) * s_end / f64::from(steps) * (mu * t).exp();
            soft -= e * weight;
            hard -= h * weight;
        }
        (soft, hard)
    }

    #[test]
    fn off_the_cone_it_is_the_integral_of_the_exact_current() {
        for n in [1.1, 1.5, 1.75, 2.0] {
            for phi in [0.3, 1.2, 2.6, 4.0, 5.9] {
                if phi > n * PI {
                    continue;
                }
                for mu in [-0.6, -1.0, -2.5] {
                    let c = coefficients(n, phi, mu);
                    let (soft, hard) = by_integration(n, phi, mu);
                    let error = (c.soft - soft).abs().max((c.hard - hard).abs());
                    assert!(error < 2e-5, "n {n} phi {phi} mu {mu}: {c:?} {soft} {hard}");
                }
            }
        }
    }

    /// Michaeli's closed form of one side of a half-plane, and its shadow side.
    #[test]
    fn half_plane_in_closed_form() {
        for phi in [0.2, 1.0, 2.0, 3.0, 3.3, 4.5, 6.0f64] {
            for mu in [-5.0, -1.0, -0.999, -0.3, 0.4, 0.99] {
                if mu == -0.3 && phi == 1.0 {
                    continue;
                }
                let (c, big_c, s) = (((1.0 - mu) / 2.0f64).sqrt(), (phi / 2.0).cos(), (phi / 2.0).sin());
                let rate = phi.cos() + mu;
                // On the shadow side cos(φ′/2) < 0, and the same formula holds without the subtraction.
                let (soft, hard) = if phi < PI {
                    (2.0 * s * (c - big_c) / rate, -(1.0 - big_c / c) / rate)
                } else {
                    (2.0 * s * (c + big_c) / rate, (1.0 + big_c / c) / rate)
                };
                let r = coefficients(2.0, phi, mu);
                let scale = 1.0 + soft.abs() + hard.abs();
                assert!((r.soft - soft).abs() < 1e-10 * scale, "{phi} {mu}: {r:?} {soft}");
                assert!((r.hard - hard).abs() < 1e-10 * scale, "{phi} {mu}: {r:?} {hard}");
            }
        }
    }

    /// Through the reflection and the shadow boundary the fringe field moves as smoothly as elsewhere,
    /// while physical optics and Keller's field are infinite there.
    #[test]
    fn boundaries_are_crossed_smoothly() {
        let w = wedge(1.5);
        let (phi_in, beta) = (0.7, 1.3);
        let incident = -direction(phi_in, PI - beta);
        for boundary in [PI - phi_in, PI + phi_in] {
            let step = 1e-4;
            let at = |i: i32| w.fringe(incident, direction(boundary + f64::from(i) * step, beta));
            for i in -300..300 {
                // The second difference is step² times the curvature.
                let bend = at(i + 1) - 2.0 * at(i) + at(i - 1);
                assert!(bend.to_cols_array().iter().all(|x| x.abs() < 100.0 * step * step), "{i}: {bend}");
            }
            let po = of_physical_optics(&w, incident, direction(boundary + 1e-9, beta));
            assert!(po.to_cols_array().iter().any(|x| x.abs() > 1e6));
        }
    }

    /// The coefficients' small-argument forms join the general ones.
    #[test]
    fn series_join() {
        for n in [1.05f64, 1.5, 2.0] {
            for x in [0.0999f64, 0.1001] {
                let direct = 1.0 / (x / (2.0 * n)).tan() / n - 1.0 / (x / 2.0f64).tan();
                assert!((kernel(n, true, Complex64::new(x, 0.0)).re - direct).abs() < 1e-13);
                let slope = (kernel(n, true, Complex64::new(x + 1e-6, 0.0))
                    - kernel(n, true, Complex64::new(x - 1e-6, 0.0)))
                .re / 2e-6;
                assert!((kernel_slope(n, true, x) - slope).abs() < 1e-6);
            }
            for phi in [0.0, 0.05, 1.0, 3.1, 3.3] {
                let (a, b) = (coefficients(n, phi, -1.0 + 1e-9), coefficients(n, phi, -1.0 + 1e-11));
                let c = coefficients(n, phi, -1.0 - 1e-9);
                assert!(
                    (a.hard - b.hard).abs() < 1e-6 && (a.hard - c.hard).abs() < 1e-6,
                    "{a:?} {b:?} {c:?}"
                );
                assert!((a.soft - b.soft).abs() < 2e-4 && (a.soft - c.soft).abs() < 2e-4);
            }
        }
    }

    #[test]
    fn a_wave_in_the_plane_of_a_sheet_and_across_it_returns_nothing() {
        let w = Wedge::half_plane(DVec3::X, DVec3::Y);
        for beta in [0.5 * PI, 1.0] {
            let to_source = direction(0.0, beta);
            let (v, h) = polarisation_basis(to_source);
            let d = w.fringe(-to_source, to_source);
            // Here H = y stands on the sheet.
            assert!((h - DVec3::Y).length() < 1e-12);
            assert!(h.dot(d * h).abs() < 1e-9 && v.dot(d * h).abs() < 1e-9, "{d}");
        }
    }

    #[test]
    fn no_wedge_where_the_outside_is_no_larger_than_half_of_space() {
        assert!(Wedge::new([DVec3::X, -DVec3::X], DVec3::Y).is_none());
        assert!(Wedge::new([DVec3::X, DVec3::Y], DVec3::Y).is_none());
        // Half lit in the plane of a face.
        let (w, s) = (wedge(1.5), direction(0.0, 1.0));
        let (at, above) = (w.fringe(-s, DVec3::Y), w.fringe(-direction(1e-7, 1.0), DVec3::Y));
        assert!((2.0 * at - above).to_cols_array().iter().all(|x| x.abs() < 1e-5), "{at} {above}");
        assert_eq!(Wedge::new([DVec3::X, DVec3::X], DVec3::Y).unwrap().n, 2.0);
        assert_eq!(wedge(1.5).fringe(-direction(1.75 * PI, 1.0), DVec3::X), DMat3::ZERO);
    }
}
