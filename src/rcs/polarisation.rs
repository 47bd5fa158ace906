//! Polarisations that follow from V and H (CONVENTIONS eq. 40–42).
//!
//! An antenna's polarisation is the unit vector **e** of the field that it sends, in the V and H of eq. (2) with
//! **u** from the target to the antenna. The same vector serves for receiving (backscatter alignment), where the
//! voltage is **e**ᵣᵀ **E**ₛ without a conjugate, so S_pq = **e**ₚᵀ S **e**_q, first letter received.

use crate::base::matrix::Matrix2;
use num_complex::Complex64;
use std::f64::consts::FRAC_1_SQRT_2;

/// A pair of polarisations other than V and H.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Derived {
    /// Linear at +45° (V + H)/√2 and at −45° (V − H)/√2. H points to the left of a radar that looks out along −**u**,
    /// that is, to its right when seen from the target.
    Linear45,
    /// Right- and left-hand circular by IEEE Std 145: the field of a right-hand wave turns clockwise for one
    /// who looks after it. Time factor e^{+jωt} and propagation along −**u** give R = (V − jH)/√2, L = (V + jH)/√2.
    Circular,
}

impl Derived {
    /// Both pairs, in the order of their columns.
    pub const ALL: [Derived; 2] = [Derived::Linear45, Derived::Circular];

    /// The two unit vectors of the pair, each as its (V, H) components.
    pub fn basis(self) -> Matrix2 {
        let c = |re: f64, im: f64| Complex64::new(re, im) * FRAC_1_SQRT_2;
        match self {
            Derived::Linear45 => [[c(1.0, 0.0), c(1.0, 0.0)], [c(1.0, 0.0), c(-1.0, 0.0)]],
            Derived::Circular => [[c(1.0, 0.0), c(0.0, -1.0)], [c(1.0, 0.0), c(0.0, 1.0)]],
        }
    }

    /// Names of the entries in the order of [`of`](Self::of), row by row.
    pub fn names(self) -> [&'static str; 4] {
        match self {
            Derived::Linear45 => ["p45p45", "p45m45", "m45p45", "m45m45"],
            Derived::Circular => ["rr", "rl", "lr", "ll"],
        }
    }

    /// Converts `S[rx][tx]` from V and H to these polarisations.
    ///
    /// # Example
    /// An odd number of bounces changes the hand of a circular wave, an even number keeps it: a sphere (S = I) returns
    /// the opposite hand, and a dihedral (S = diag(1, −1)) the transmitted one (CONVENTIONS eq. 42).
    ///
    /// ```
    /// use catseye::rcs::polarisation::Derived;
    /// use num_complex::Complex64;
    ///
    /// let diagonal = |vv: f64, hh: f64| {
    ///     [[Complex64::from(vv), Complex64::ZERO], [Complex64::ZERO, Complex64::from(hh)]]
    /// };
    /// let (sphere, dihedral) = (diagonal(1.0, 1.0), diagonal(1.0, -1.0));
    /// let [[rr, _], [lr, _]] = Derived::Circular.of(&sphere);
    /// assert!(rr.norm() < 1e-15 && (lr.norm() - 1.0).abs() < 1e-15);
    /// let [[rr, _], [lr, _]] = Derived::Circular.of(&dihedral);
    /// assert!((rr.norm() - 1.0).abs() < 1e-15 && lr.norm() < 1e-15);
    /// ```
    pub fn of(self, s: &Matrix2) -> Matrix2 {
        let e = self.basis();
        let mut out = [[Complex64::ZERO; 2]; 2];
        for (p, row) in out.iter_mut().enumerate() {
            for (q, z) in row.iter_mut().enumerate() {
                for rx in 0..2 {
                    for tx in 0..2 {
                        *z += e[p][rx] * s[rx][tx] * e[q][tx];
                    }
                }
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::frames::{Pose, direction_from_angles, polarisation_basis};
    use crate::geom::Geometry;
    use crate::rcs::cpu::po_sum::by_rays;
    use crate::rcs::{Aspect, Distance, RayGrid};
    use crate::scene::{Material, Mesh, Scene};
    use glam::DVec3;
    use proptest::prelude::*;

    /// The hand of the wave that `e` sends, by following its field in time at one place: positive when it
    /// turns with the right hand whose thumb points along the propagation.
    fn turn(e: [Complex64; 2], u: DVec3) -> f64 {
        let (v, h) = polarisation_basis(u);
        let field = |phase: f64| {
            let t = Complex64::cis(phase);
            v * (e[0] * t).re + h * (e[1] * t).re
        };
        field(0.3).cross(field(0.4)).dot(-u)
    }

    #[test]
    fn right_is_right() {
        for (a, el) in [(0.0, 0.0), (1.0, 0.5), (-2.5, -1.1)] {
            let u = direction_from_angles(a, el);
            let [r, l] = Derived::Circular.basis();
            assert!(turn(r, u) > 0.0 && turn(l, u) < 0.0);
            let [p, m] = Derived::Linear45.basis();
            assert!(turn(p, u).abs() < 1e-15 && turn(m, u).abs() < 1e-15);
        }
    }

    fn scattering(corners: &[[DVec3; 3]], roll: f64, aspect: Aspect) -> Matrix2 {
        let mut scene = Scene::default();
        scene.materials.push(Material::pec());
        let mesh = Mesh {
            positions_m: corners.iter().flatten().copied().collect(),
            triangles: (0..corners.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            material: vec![0; corners.len()],
            normals: Vec::new(),
        };
        scene.add_mesh("t", "", mesh, Pose::from_yaw_pitch_roll(DVec3::ZERO, 0.0, 0.0, roll));
        let geometry = Geometry::build(&scene, 0.0, 77e9).unwrap();
        let grid = RayGrid { bounces: 3, rays_per_wavelength: 4.0, distance: Distance::Infinite };
        by_rays(&geometry, &[aspect], &grid)[0].last
    }

    fn db(z: Complex64, over: Complex64) -> f64 {
        20.0 * (z.norm() / over.norm()).log10()
    }

    #[test]
    fn odd_bounces_change_the_hand_and_even_ones_keep_it() {
        let p = DVec3::new;
        let (a, b) = (0.05, 0.05 * FRAC_1_SQRT_2);
        let ahead = Aspect { azimuth: 0.0, elevation: 0.0 };
        let plate = [[p(0., -b, -a), p(0., b, -a), p(0., b, a)], [p(0., -b, -a), p(0., b, a), p(0., -b, a)]];
        let trihedral = [
            [p(0., 0., 0.), p(a, -a, 0.), p(a, a, 0.)],
            [p(0., 0., 0.), p(a, a, 0.), p(0., 0., a)],
            [p(0., 0., 0.), p(0., 0., a), p(a, -a, 0.)],
        ];
        let corner = Aspect { azimuth: 0.0, elevation: FRAC_1_SQRT_2.atan() };
        for (target, aspect) in [(&plate[..], ahead), (&trihedral[..], corner)] {
            let [[rr, rl], [lr, ll]] = Derived::Circular.of(&scattering(target, 0.0, aspect));
            // Only rounding and, for the corner, the ends of its tubes are left in the same hand.
            assert!(db(rr, lr) < -40.0 && db(ll, rl) < -40.0, "{rr} {rl} {lr} {ll}");
            let [[pp, pm], [mp, mm]] = Derived::Linear45.of(&scattering(target, 0.0, aspect));
            assert!(db(pm, pp) < -40.0 && db(mp, mm) < -40.0, "{pp} {pm} {mp} {mm}");
        }
        let dihedral = [
            [p(0., 0., -a), p(0., 0., a), p(b, b, a)],
            [p(0., 0., -a), p(b, b, a), p(b, b, -a)],
            [p(0., 0., -a), p(b, -b, a), p(0., 0., a)],
            [p(0., 0., -a), p(b, -b, -a), p(b, -b, a)],
        ];
        let s = scattering(&dihedral, 0.0, ahead);
        let [[rr, rl], [lr, ll]] = Derived::Circular.of(&s);
        assert!(db(rl, rr) < -60.0 && db(lr, ll) < -60.0, "{rr} {rl} {lr} {ll}");
        // Level at 45°: all in the other linear polarisation; turned by 45° itself: all in the cross of V and H.
        let [[pp, pm], [mp, mm]] = Derived::Linear45.of(&s);
        assert!(db(pp, mp) < -60.0 && db(mm, pm) < -60.0, "{pp} {pm} {mp} {mm}");
        let [[vv, vh], [hv, hh]] = scattering(&dihedral, std::f64::consts::FRAC_PI_4, ahead);
        // The grid of tubes lies askew to the outline here.
        assert!(db(vv, vh) < -40.0 && db(hh, hv) < -40.0, "{vv} {vh} {hv} {hh}");
        assert!((vh.norm() / s[0][0].norm() - 1.0).abs() < 0.02);
    }

    proptest! {
        /// A change of basis keeps the power, and turning the target by half a turn about the line of sight
        /// changes no circular amplitude but only its phase.
        #[test]
        fn power_is_kept(x in prop::array::uniform8(-1.0f64..1.0), turn in 0.0f64..6.0) {
            let z = |i: usize| Complex64::new(x[2 * i], x[2 * i + 1]);
            let s = [[z(0), z(1)], [z(2), z(3)]];
            let span = |m: &Matrix2| m.as_flattened().iter().map(|z| z.norm_sqr()).sum::<f64>();
            for d in Derived::ALL {
                prop_assert!((span(&d.of(&s)) - span(&s)).abs() < 1e-12);
            }
            let (sin, cos) = turn.sin_cos();
            let r = [[cos, -sin], [sin, cos]];
            let mut turned = [[Complex64::ZERO; 2]; 2];
            for (i, row) in turned.iter_mut().enumerate() {
                for (j, z) in row.iter_mut().enumerate() {
                    *z = (0..2).flat_map(|a| (0..2).map(move |b| (a, b))).map(|(a, b)| s[a][b] * (r[i][a] * r[j][b])).sum();
                }
            }
            let (a, b) = (Derived::Circular.of(&s), Derived::Circular.of(&turned));
            for (p, q) in a.as_flattened().iter().zip(b.as_flattened()) {
                prop_assert!((p.norm() - q.norm()).abs() < 1e-12);
            }
        }
    }
}
