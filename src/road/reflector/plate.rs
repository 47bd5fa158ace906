//! Flat rectangular plate.

use super::kind::{Builder, Kind, kind_of, length, thickened, thickness};
use crate::road::shape::polygon;
use crate::scene::Mesh;
use glam::DVec3;
use serde::Deserialize;

/// A rectangle in the y-z plane centred at the origin, normal +x, width along y: 2 triangles.
/// With thickness a closed body behind it.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Plate {
    /// Width, m.
    pub width_m: f64,
    /// Height, m.
    pub height_m: f64,
    /// Thickness, m; 0 for a sheet.
    pub thickness_m: f64,
}

/// The plate in the registry.
pub static KIND: Kind = Kind {
    name: "plate",
    summary: "flat rectangular plate",
    pose: "normal +x, width along y, height along z, centred at the origin",
    params: &[
        length("width_m", 0.1, "extent along y"),
        length("height_m", 0.1, "extent along z"),
        thickness(0.0),
    ],
    ..kind_of::<Plate>()
};

impl Builder for Plate {
    fn mesh(&self) -> Mesh {
        let (y, z) = (0.5 * self.width_m, 0.5 * self.height_m);
        let mut mesh = Mesh::default();
        let corners = [(-y, -z), (y, -z), (y, z), (-y, z)].map(|(y, z)| DVec3::new(0.0, y, z));
        polygon(&mut mesh, &corners, 0);
        thickened(mesh, self.thickness_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::road::shape::{area_m2, area_vector_m2};

    #[test]
    fn two_triangles_facing_x() {
        let m = Plate { width_m: 0.2, height_m: 0.05, thickness_m: 0.0 }.mesh();
        assert_eq!(m.triangles.len(), 2);
        assert!((area_m2(&m) - 0.01).abs() < 1e-15);
        for t in 0..2 {
            let n = area_vector_m2(&m, t);
            assert!((n - DVec3::X * 0.005).length() < 1e-15);
        }
        let widest = m.positions_m.iter().map(|p| p.y.abs()).fold(0.0, f64::max);
        assert_eq!(widest, 0.1);
    }
}
