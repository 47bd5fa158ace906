//! Wide BVH over triangles: built by obvhs (CWBVH, Ylitie et al. 2017), traversed here by obvhs with
//! facets tested in f64, and in WGSL by `shaders/shared/bvh.wgsl`.

use super::Triangle;
use glam::{DVec3, UVec2, Vec3A};
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh, node::CwBvhNode};
use obvhs::{Boundable, BvhBuildParams, aabb::Aabb, ray::Ray, traverse};
use std::time::Duration;

/// Up to this many triangles a plain loop is faster than the tree.
const LOOP_LIMIT: usize = 6;

pub struct Bvh {
    pub cwbvh: CwBvh,
    /// obvhs' node test ignores everything nearer than 1e-4 in units of the direction's length, so
    /// directions are shortened until that is below `t_min`.
    unit_m: f64,
    t_min_m: f64,
}

impl std::fmt::Debug for Bvh {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Bvh({} nodes)", self.cwbvh.nodes.len())
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance in metres (for unit directions).
    pub t: f64,
    /// Index into `Geometry::triangles`.
    pub triangle: u32,
}

struct Padded(Aabb);

impl Boundable for Padded {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

impl Bvh {
    /// Builds the tree and puts `triangles` into the order of its leaves. Boxes are padded by `t_min_m`
    /// so that the f32 box test never misses what the f64 facet test would hit.
    pub fn build(triangles: &mut Vec<Triangle>, t_min_m: f64) -> Bvh {
        let boxes: Vec<Padded> = triangles
            .iter()
            .map(|t| {
                let c = t.corners();
                let lo = c[0].min(c[1]).min(c[2]) - DVec3::splat(t_min_m);
                let hi = c[0].max(c[1]).max(c[2]) + DVec3::splat(t_min_m);
                Padded(Aabb::new(lo.as_vec3a(), hi.as_vec3a()))
            })
            .collect();
        let cwbvh = if boxes.is_empty() {
            CwBvh::default()
        } else {
            build_cwbvh(&boxes, BvhBuildParams::medium_build(), &mut Duration::default())
        };
        *triangles = cwbvh.primitive_indices.iter().map(|&i| triangles[i as usize]).collect();
        Bvh { cwbvh, unit_m: 5e-3 * (t_min_m / 1e-6), t_min_m }
    }

    /// Nearest triangle along the unit vector `dir`, at a distance in (t_min, t_max), not of `skip_patch`.
    #[inline]
    pub fn closest_hit(
        &self,
        triangles: &[Triangle],
        origin: DVec3,
        dir: DVec3,
        skip_patch: u32,
        t_max: f64,
    ) -> Option<Hit> {
        let mut best = Hit { t: t_max, triangle: u32::MAX };
        self.visit(triangles, origin, dir, t_max, |i, tri| {
            if tri.patch != skip_patch
                && let Some(t) = tri.intersect(origin, dir)
                && t > self.t_min_m
                // The lower index wins a tie, so the answer does not depend on the order of the visit.
                && (t < best.t || (t == best.t && i < best.triangle))
            {
                best = Hit { t, triangle: i };
            }
            Some(best.t)
        });
        (best.triangle != u32::MAX).then_some(best)
    }

    /// Whether anything but `skip_patch` stands within (t_min, t_max).
    #[inline]
    pub fn any_hit(
        &self,
        triangles: &[Triangle],
        origin: DVec3,
        dir: DVec3,
        skip_patch: u32,
        t_max: f64,
    ) -> bool {
        let mut found = false;
        self.visit(triangles, origin, dir, t_max, |_, tri| {
            found |= tri.patch != skip_patch
                && tri.intersect(origin, dir).is_some_and(|t| t > self.t_min_m && t < t_max);
            (!found).then_some(t_max)
        });
        found
    }

    /// Calls `test` on candidates; it returns the distance beyond which nothing matters, or None to stop.
    #[inline]
    fn visit(
        &self,
        triangles: &[Triangle],
        origin: DVec3,
        dir: DVec3,
        t_max: f64,
        mut test: impl FnMut(u32, &Triangle) -> Option<f64>,
    ) {
        if triangles.len() <= LOOP_LIMIT {
            for (i, tri) in triangles.iter().enumerate() {
                if test(i as u32, tri).is_none() {
                    return;
                }
            }
            return;
        }
        // Upper bound in f32: rounding must not cut off the hit itself.
        let bound = |t: f64| ((t + self.t_min_m) / self.unit_m) as f32 * (1.0 + 1e-6);
        let d: Vec3A = (dir * self.unit_m).as_vec3a();
        let mut ray =
            Ray::new(origin.as_vec3a(), d, 0.0, if t_max.is_finite() { bound(t_max) } else { f32::MAX });
        let mut state = self.cwbvh.new_traversal(ray.direction);
        let mut node: &CwBvhNode;
        traverse!(self.cwbvh, node, state, node.intersect_ray(&ray, state.oct_inv4), {
            match test(state.primitive_id, &triangles[state.primitive_id as usize]) {
                Some(t) if t.is_finite() => ray.tmax = bound(t),
                Some(_) => {}
                None => break,
            }
        });
    }
}
