//! Circular cylinder, faceted.

use super::kind::{Builder, Kind, SAGITTA, choice, kind_of, length};
use crate::base::error::Result;
use crate::road::shape::revolve_z;
use crate::scene::Mesh;
use glam::DVec2;
use serde::Deserialize;
use std::f64::consts::PI;

/// Whether the ends have lids.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Ends {
    /// The cylinder has lids.
    Closed,
    /// The cylinder has no lids.
    Open,
}

/// A prism about the z axis, centred at the origin, with a facet square to +x and its corners on the circle.
///
/// It carries the cylinder's normals, so cross sections cut it as finely as their accuracy asks, from however
/// few facets (`geom::curved`).
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Cylinder {
    /// Radius, m.
    pub radius_m: f64,
    /// Length, m.
    pub length_m: f64,
    /// Greatest distance of a facet from the arc through its edges.
    pub sagitta_m: f64,
    /// Whether it has end discs (a solid) or not (a tube).
    pub ends: Ends,
}

/// The cylinder in the registry.
pub static KIND: Kind = Kind {
    name: "cylinder",
    summary: "circular cylinder",
    pose: "axis along z, centred at the origin",
    params: &[
        length("radius_m", 0.003, "radius"),
        length("length_m", 0.15, "extent along z"),
        SAGITTA,
        choice("ends", &["closed", "open"], "with or without end discs"),
    ],
    ..kind_of::<Cylinder>()
};

impl Cylinder {
    /// Number of facets round the circle: the fewest, but at least 8, that keep the sagitta.
    pub fn segments(&self) -> usize {
        segments(self.radius_m, self.sagitta_m)
    }
}

/// Facets round a circle of `radius_m` so that none lies more than `sagitta_m` inside its arc.
pub(super) fn segments(radius_m: f64, sagitta_m: f64) -> usize {
    // 1 - cos(pi/n) = 2 sin²(pi/2n) keeps its digits for a small sagitta.
    let half = (0.5 * sagitta_m / radius_m).min(1.0).sqrt().asin();
    ((0.5 * PI / half).ceil() as usize).max(8)
}

/// Area of the polygon of so many facets over that of its circle.
#[cfg(test)]
pub(super) fn disc_share(radius_m: f64, sagitta_m: f64) -> f64 {
    let a = 2.0 * PI / segments(radius_m, sagitta_m) as f64;
    a.sin() / a
}

impl Builder for Cylinder {
    fn check(&self, kind: &Kind) -> Result<()> {
        kind.check_triangles(4.0 * self.segments() as f64)
    }

    fn mesh(&self) -> Mesh {
        let n = self.segments();
        let (rho, z) = (self.radius_m, 0.5 * self.length_m);
        let (bottom, top) = (DVec2::new(rho, -z), DVec2::new(rho, z));
        let axis = |z| DVec2::new(0.0, z);
        let start = -PI / n as f64;
        if self.ends == Ends::Closed {
            revolve_z(&[axis(-z), bottom, top, axis(z)], n, start, true, 0)
        } else {
            revolve_z(&[bottom, top], n, start, true, 0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::road::shape::{area_vector_m2, is_watertight, volume_m3};

    #[test]
    fn volume_sagitta_and_facing() {
        for (radius_m, sagitta_m) in [(0.003, 1.5573e-5), (0.1, 1e-4), (2.0, 0.01), (0.001, 1.0)] {
            let c = Cylinder { radius_m, length_m: 0.15, sagitta_m, ends: Ends::Closed };
            let m = c.mesh();
            assert!(is_watertight(&m));
            let exact = PI * radius_m * radius_m * 0.15 * disc_share(radius_m, sagitta_m);
            assert!((volume_m3(&m) / exact - 1.0).abs() < 1e-12);
            // Side facets: distance of the plane from the axis against the corner radius.
            let mut rho = 0.0f64;
            let mut inner = f64::INFINITY;
            for t in 0..m.triangles.len() {
                let n = area_vector_m2(&m, t).normalize();
                let p = m.positions_m[m.triangles[t][1] as usize];
                if n.z.abs() < 0.5 {
                    rho = rho.max(p.x.hypot(p.y));
                    inner = inner.min(n.dot(p));
                }
            }
            assert!(
                c.segments() == 8 || rho - inner <= sagitta_m * (1.0 + 1e-9),
                "{} {}",
                rho - inner,
                sagitta_m
            );
            assert!(c.segments() == 8 || rho - inner > 0.5 * sagitta_m, "too fine");
            assert!((rho - radius_m).abs() < 1e-12 && inner < radius_m);
            let square_to_x = (0..m.triangles.len())
                .any(|t| (area_vector_m2(&m, t).normalize() - glam::DVec3::X).length() < 1e-9);
            assert!(square_to_x);
        }
        let tube = Cylinder { radius_m: 0.003, length_m: 0.15, sagitta_m: 1e-5, ends: Ends::Open };
        assert_eq!(tube.mesh().triangles.len(), 2 * tube.segments());
    }
}
