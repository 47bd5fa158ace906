//! A triangle of the world, and where a ray meets it.
//!
//! Distances and barycentric coordinates come from vectors that are stored with the triangle, in f64. Both sides are
//! met; a ray in the plane of the triangle meets nothing.

use glam::DVec3;

/// Two corners closer than this many times the mesh's size make a triangle degenerate.
const DEGENERATE: f64 = 1e-12;

/// One facet in the world. A point of the plane has barycentric coordinates
/// (u, v) = ((p - v0) . du, (p - v0) . dv), inside when u, v >= 0 and u + v <= 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Triangle {
    /// First corner, m.
    pub v0: DVec3,
    /// Edge from the first corner to the second, m.
    pub e1: DVec3,
    /// Edge from the first corner to the third, m.
    pub e2: DVec3,
    /// Unit normal, right-handed about v0, v1, v2.
    pub normal: DVec3,
    du: DVec3,
    dv: DVec3,
    /// Coplanar neighbours share a patch: a ray that leaves a patch cannot meet it again.
    pub patch: u32,
    /// Index into `Geometry::bodies`.
    pub body: u32,
    /// Index into `Geometry::surfaces`.
    pub surface: u32,
}

impl Triangle {
    /// A triangle with these corners; None when they are (nearly) on one line.
    pub fn new(v: [DVec3; 3], patch: u32, body: u32, surface: u32) -> Option<Self> {
        let (e1, e2) = (v[1] - v[0], v[2] - v[0]);
        let n = e1.cross(e2);
        let scale = e1.length_squared().max(e2.length_squared()).max((e2 - e1).length_squared());
        let area2 = n.length();
        if !(area2.is_finite() && area2 > DEGENERATE * scale && area2 > 0.0) {
            return None;
        }
        let normal = n / area2;
        Some(Triangle {
            v0: v[0],
            e1,
            e2,
            normal,
            du: e2.cross(normal) / area2,
            dv: normal.cross(e1) / area2,
            patch,
            body,
            surface,
        })
    }

    /// The three corners, m.
    pub fn corners(&self) -> [DVec3; 3] {
        [self.v0, self.v0 + self.e1, self.v0 + self.e2]
    }

    /// Area, m².
    pub fn area_m2(&self) -> f64 {
        0.5 * self.e1.cross(self.e2).length()
    }

    /// Distance along `dir` (in its units) to the triangle's plane if the ray passes through it.
    #[inline]
    pub fn intersect(&self, origin: DVec3, dir: DVec3) -> Option<f64> {
        self.intersect_within(origin, dir, 0.0)
    }

    /// As [`Triangle::intersect`] of a triangle whose edges lie farther out by this share of its size. A slack above rounding closes
    /// the gaps through which a ray slips that meets the edge between two triangles exactly; the distance stays that to the plane.
    #[inline]
    pub fn intersect_within(&self, origin: DVec3, dir: DVec3, slack: f64) -> Option<f64> {
        let r = self.v0 - origin;
        let t = r.dot(self.normal) / dir.dot(self.normal);
        // Negative and NaN (ray in the plane) both fail here.
        if t <= 0.0 || !t.is_finite() {
            return None;
        }
        let p = dir * t - r;
        let (u, v) = (p.dot(self.du), p.dot(self.dv));
        (u >= -slack && v >= -slack && u + v <= 1.0 + slack).then_some(t)
    }
}
