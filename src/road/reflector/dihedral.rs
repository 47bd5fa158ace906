//! Right-angled dihedral corner.

use super::kind::{Builder, Kind, kind_of, length, thickened, thickness};
use crate::road::shape::polygon;
use crate::scene::Mesh;
use glam::DVec3;
use serde::Deserialize;

/// Two rectangles at a right angle, each `width_m` wide and `height_m` high, that share a seam along
/// the z axis centred at the origin and open to +x: 4 triangles. Face on, geometric optics gives
/// 8 pi width² height² / lambda². With thickness a closed body behind them.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Dihedral {
    /// Width of each plate, m.
    pub width_m: f64,
    /// Height, m.
    pub height_m: f64,
    /// Thickness of the plates, m; 0 for sheets.
    pub thickness_m: f64,
}

/// The dihedral in the registry.
pub static KIND: Kind = Kind {
    name: "dihedral",
    summary: "two plates at a right angle",
    pose: "seam along z centred at the origin, opening to +x",
    params: &[
        length("width_m", 0.1, "width of each plate"),
        length("height_m", 0.1, "extent along z, the seam"),
        thickness(0.0),
    ],
    ..kind_of::<Dihedral>()
};

impl Builder for Dihedral {
    fn mesh(&self) -> Mesh {
        let d = self.width_m * std::f64::consts::FRAC_1_SQRT_2;
        let z = DVec3::Z * (0.5 * self.height_m);
        let (left, right) = (DVec3::new(d, d, 0.0), DVec3::new(d, -d, 0.0));
        let mut mesh = Mesh::default();
        polygon(&mut mesh, &[-z, left - z, left + z, z], 0);
        polygon(&mut mesh, &[right - z, -z, z, right + z], 0);
        thickened(mesh, self.thickness_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::road::shape::{area_m2, area_vector_m2};

    #[test]
    fn right_angle_open_to_x() {
        let m = Dihedral { width_m: 0.1, height_m: 0.3, thickness_m: 0.0 }.mesh();
        assert_eq!(m.triangles.len(), 4);
        assert!((area_m2(&m) - 0.06).abs() < 1e-15);
        let n: Vec<DVec3> = (0..4).map(|t| area_vector_m2(&m, t).normalize()).collect();
        assert!(n[0].dot(n[2]).abs() < 1e-12 && (n[0] - n[1]).length() < 1e-12);
        let bisector = (n[0] + n[2]).normalize();
        assert!((bisector - DVec3::X).length() < 1e-12);
        // The left plate looks right and the other way round.
        assert!(n[0].y < 0.0 && n[2].y > 0.0);
        assert!(m.positions_m.iter().all(|p| p.x >= 0.0));
    }
}
