//! Trihedral corners of triangular and of square faces.

use super::kind::{Builder, CORNER_ELEVATION_DEG, Kind, Param, kind_of, length, thickened, thickness};
use crate::road::shape::{polygon, weld};
use crate::scene::Mesh;
use glam::DVec3;
use serde::Deserialize;

/// Three mutually perpendicular right isosceles triangles: apex at the origin, one face on the
/// ground, symmetry axis above +x (azimuth 0, elevation 35.2644 degrees): 3 triangles. Geometric
/// optics on boresight: 4 pi leg⁴ / (3 lambda²). With thickness a closed body behind the faces.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Trihedral {
    /// Length of an edge at the apex, m.
    pub leg_m: f64,
    /// Thickness of the plates, m; 0 for sheets.
    pub thickness_m: f64,
}

/// A trihedral with square faces: 6 triangles; 12 pi leg⁴ / lambda² on boresight.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct SquareTrihedral {
    /// Length of an edge at the apex, m.
    pub leg_m: f64,
    /// Thickness of the plates, m; 0 for sheets.
    pub thickness_m: f64,
}

const POSE: &str = "apex at the origin, one face horizontal, symmetry axis above +x";
const PARAMS: &[Param] = &[length("leg_m", 0.1, "length of each of the three inner edges"), thickness(0.0)];

/// The triangular trihedral in the registry.
pub static KIND: Kind = Kind {
    name: "trihedral",
    summary: "corner of three triangular plates",
    pose: POSE,
    params: PARAMS,
    boresight_deg: (0.0, CORNER_ELEVATION_DEG),
    ..kind_of::<Trihedral>()
};

/// The square trihedral in the registry.
pub static SQUARE_KIND: Kind = Kind {
    name: "square-trihedral",
    summary: "corner of three square plates",
    pose: POSE,
    params: PARAMS,
    boresight_deg: (0.0, CORNER_ELEVATION_DEG),
    ..kind_of::<SquareTrihedral>()
};

/// The legs in right-handed order: right, left, up.
fn legs(leg_m: f64) -> [DVec3; 3] {
    let d = leg_m * std::f64::consts::FRAC_1_SQRT_2;
    [DVec3::new(d, -d, 0.0), DVec3::new(d, d, 0.0), DVec3::new(0.0, 0.0, leg_m)]
}

impl Builder for Trihedral {
    fn mesh(&self) -> Mesh {
        let l = legs(self.leg_m);
        let sheet = Mesh {
            positions_m: vec![DVec3::ZERO, l[0], l[1], l[2]],
            triangles: vec![[0, 1, 2], [0, 2, 3], [0, 3, 1]],
            material: vec![0; 3],
            ..Mesh::default()
        };
        thickened(sheet, self.thickness_m)
    }
}

impl Builder for SquareTrihedral {
    fn mesh(&self) -> Mesh {
        let l = legs(self.leg_m);
        let mut mesh = Mesh::default();
        for i in 0..3 {
            let (a, b) = (l[i], l[(i + 1) % 3]);
            polygon(&mut mesh, &[DVec3::ZERO, a, a + b, b], 0);
        }
        thickened(weld(mesh), self.thickness_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::frames::direction_from_angles;
    use crate::road::shape::{area_m2, area_vector_m2};

    fn check(m: &Mesh, faces: usize, area: f64) {
        let n: Vec<DVec3> = (0..m.triangles.len()).map(|t| area_vector_m2(m, t).normalize()).collect();
        let axis = direction_from_angles(0.0, CORNER_ELEVATION_DEG.to_radians());
        for a in &n {
            // Every face makes the same angle with the symmetry axis, and looks along it.
            assert!((a.dot(axis) - (1.0f64 / 3.0).sqrt()).abs() < 1e-12);
            for b in &n {
                let d = a.dot(*b);
                assert!(d.abs() < 1e-12 || (d - 1.0).abs() < 1e-12);
            }
        }
        assert_eq!(m.triangles.len(), faces);
        assert!((area_m2(m) - area).abs() < 1e-15);
        assert!((n[0] - DVec3::Z).length() < 1e-12, "the first face lies on the ground");
        assert!(
            m.triangles.iter().all(|t| m.positions_m[t[0] as usize] == DVec3::ZERO),
            "apex at the origin"
        );
    }

    #[test]
    fn right_angles_and_axis() {
        check(&Trihedral { leg_m: 0.1, thickness_m: 0.0 }.mesh(), 3, 0.015);
        check(&SquareTrihedral { leg_m: 0.1, thickness_m: 0.0 }.mesh(), 6, 0.03);
    }
}
