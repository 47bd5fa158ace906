//! The chain of facets that a tube's axis meets.

use crate::geom::Geometry;
use crate::trace::MAX_BOUNCES;
use crate::trace::launch::Tube;
use glam::DVec3;

/// Facets in the order met, with the point of each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chain {
    /// Indices of the facets.
    pub triangle: [u32; MAX_BOUNCES],
    /// Where each was met, m.
    pub point: [DVec3; MAX_BOUNCES],
    /// Number of facets met.
    pub len: usize,
    /// The ray left the scene after the last facet (false: it was not followed further).
    pub left: bool,
}

/// Follows the axis over at most `bounces` facets; with `see_exit` one step more, to learn whether it
/// then leaves.
#[inline]
pub fn follow(geometry: &Geometry, tube: &Tube, bounces: usize, see_exit: bool) -> Chain {
    let mut chain =
        Chain { triangle: [u32::MAX; MAX_BOUNCES], point: [DVec3::ZERO; MAX_BOUNCES], len: 0, left: false };
    let (mut origin, mut dir, mut skip) = (tube.origin_m, tube.dir, u32::MAX);
    loop {
        if chain.len == bounces && !see_exit {
            return chain;
        }
        let Some(hit) = geometry.bvh.closest_hit(&geometry.triangles, origin, dir, skip, f64::INFINITY)
        else {
            chain.left = true;
            return chain;
        };
        if chain.len == bounces {
            return chain;
        }
        let tri = &geometry.triangles[hit.triangle as usize];
        origin += dir * hit.t;
        chain.triangle[chain.len] = hit.triangle;
        chain.point[chain.len] = origin;
        chain.len += 1;
        dir -= tri.normal * (2.0 * dir.dot(tri.normal));
        skip = tri.patch;
    }
}
