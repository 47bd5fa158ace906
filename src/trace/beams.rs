//! Exact beams (CONVENTIONS eq. 50-54): polygons of rays that are clipped against the faces they meet, so
//! that each chain of flat facets is one closed-form integral.

use glam::{DVec2, DVec3};

/// Corners that a polygon may have while it is cut.
pub const CAP: usize = 24;

/// The quadratic phase, rad, that a cell may have across half its width when an error of 0.2 dB is allowed
/// at finite range.
const TAU_AT_FIFTH_DB: f64 = 0.25;

/// How to follow beams and how finely to integrate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeamOptions {
    pub bounces: usize,
    /// Quadratic phase across half a cell, rad (finite range only).
    pub tau: f64,
    /// Also find where beams leave the target, for the convention "last".
    pub last: bool,
}

impl BeamOptions {
    /// The error of the quadratic phase grows with its square.
    pub fn new(bounces: usize, accuracy_db: f64, last: bool) -> Self {
        BeamOptions { bounces, tau: TAU_AT_FIFTH_DB * (accuracy_db / 0.2).sqrt(), last }
    }
}

/// A place or a direction from which waves come or to which they go.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Port {
    /// Unit vector from the target towards the radar at infinity.
    Far(DVec3),
    At(DVec3),
}

/// Where a beam's rays run. For a plane wave through `origin` the ray at (u, v) is
/// origin + u axis_u + v axis_v + w axis_k; from a point it is origin + t (axis_k + u axis_u + v axis_v).
///
/// A mirror takes the frame with it, and then the coordinates (u, v) of a place on the mirror are the same
/// before and after, and so is the length of the path there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    pub origin: DVec3,
    pub u: DVec3,
    pub v: DVec3,
    pub k: DVec3,
    pub from_point: bool,
    /// Length to add to the distance from `origin` (plane waves: phase zero is at the world's origin).
    pub lead_m: f64,
}

impl Frame {
    /// Rays from `port` towards a target around `centre`.
    pub fn new(port: Port, centre: DVec3) -> Frame {
        let (origin, k, from_point, lead_m) = match port {
            Port::Far(towards) => (centre, -towards, false, -towards.dot(centre)),
            Port::At(p) => (p, (centre - p).normalize(), true, 0.0),
        };
        let (u, v) = k.any_orthonormal_pair();
        Frame { origin, u, v, k, from_point, lead_m }
    }

    /// Negative where the plane's front is lit. For a point source in metres, else the cosine.
    #[inline]
    pub fn facing(&self, normal: DVec3, offset: f64) -> f64 {
        if self.from_point { offset - normal.dot(self.origin) } else { normal.dot(self.k) }
    }

    #[inline]
    pub fn project(&self, p: DVec3) -> DVec2 {
        let d = p - self.origin;
        let uv = DVec2::new(self.u.dot(d), self.v.dot(d));
        if self.from_point { uv / self.k.dot(d) } else { uv }
    }

    /// Coefficients (a, b, c) of nearness a u + b v + c of a plane: the larger, the nearer to the source.
    #[inline]
    pub fn nearness(&self, normal: DVec3, offset: f64) -> DVec3 {
        let (nu, nv, nk) = (normal.dot(self.u), normal.dot(self.v), normal.dot(self.k));
        let h = offset - normal.dot(self.origin);
        if self.from_point { DVec3::new(nu, nv, nk) / h } else { DVec3::new(nu, nv, -h) / nk }
    }

    /// Where the ray at `uv` meets the plane.
    #[inline]
    pub fn lift(&self, uv: DVec2, nearness: DVec3) -> DVec3 {
        let q = nearness.x * uv.x + nearness.y * uv.y + nearness.z;
        let across = self.u * uv.x + self.v * uv.y;
        if self.from_point { self.origin + (self.k + across) / q } else { self.origin + across - self.k * q }
    }

    /// Direction of the ray at `uv`.
    #[inline]
    pub fn direction(&self, uv: DVec2) -> DVec3 {
        if self.from_point { (self.k + self.u * uv.x + self.v * uv.y).normalize() } else { self.k }
    }

    /// Length of the path to `p`, which the frame's mirror images share.
    #[inline]
    pub fn length_m(&self, p: DVec3) -> f64 {
        let d = p - self.origin;
        self.lead_m + if self.from_point { d.length() } else { self.k.dot(d) }
    }

    pub fn mirrored(&self, normal: DVec3, offset: f64) -> Frame {
        let flip = |d: DVec3| d - normal * (2.0 * normal.dot(d));
        Frame {
            origin: self.origin - normal * (2.0 * (normal.dot(self.origin) - offset)),
            u: flip(self.u),
            v: flip(self.v),
            k: flip(self.k),
            ..*self
        }
    }
}
