//! Wide BVH over triangles: built by obvhs (CWBVH, Ylitie et al. 2017), traversed here by obvhs with
//! facets tested in f64, and in WGSL by `shaders/shared/bvh.wgsl`.

use super::triangle::Triangle;
use glam::{DVec3, UVec2, Vec3A};
use obvhs::bvh2::{Bvh2, reinsertion::ReinsertionOptimizer};
use obvhs::cwbvh::{CwBvh, bvh2_to_cwbvh::bvh2_to_cwbvh, node::CwBvhNode};
use obvhs::ploc::PlocBuilder;
use obvhs::{Boundable, BvhBuildParams, aabb::Aabb, ray::Ray, traverse};

/// Up to this many triangles a plain loop is faster than the tree.
const LOOP_LIMIT: usize = 6;

/// The wide tree over a scene's triangles.
pub struct Bvh {
    /// Nodes and triangles as obvhs packs them.
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

/// The place where a ray meets its nearest triangle.
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

/// The binary tree with which obvhs' own builders begin. They read a clock, which the browser does not have.
pub(super) fn binary_tree<T: Boundable>(boxes: &[T], params: &BvhBuildParams) -> Bvh2 {
    let mut tree = PlocBuilder::with_capacity(boxes.len()).build(
        params.ploc_search_distance,
        boxes,
        (0..boxes.len() as u32).collect(),
        params.sort_precision,
        params.search_depth_threshold,
    );
    ReinsertionOptimizer::default().run(&mut tree, params.reinsertion_batch_ratio, None);
    tree
}

/// The tree that `obvhs::cwbvh::builder::build_cwbvh` makes, by the same steps.
fn wide_tree<T: Boundable>(boxes: &[T], params: &BvhBuildParams) -> CwBvh {
    bvh2_to_cwbvh(&binary_tree(boxes, params), params.max_prims_per_leaf.clamp(1, 3), true, false)
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
            wide_tree(&boxes, &BvhBuildParams::medium_build())
        };
        *triangles = cwbvh.primitive_indices.iter().map(|&i| triangles[i as usize]).collect();
        Bvh { cwbvh, unit_m: 5e-3 * (t_min_m / 1e-6), t_min_m }
    }

    /// Finds the nearest triangle along the unit vector `dir`, at a distance in (t_min, t_max), except those of
    /// `skip_patch`.
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

    /// Finds the nearest triangle along the unit vector `dir`, at a distance in (t_min, t_max), where no ray slips between two triangles
    /// that share an edge ([`Triangle::intersect_within`]).
    #[inline]
    pub fn closest_without_gaps(
        &self,
        triangles: &[Triangle],
        origin: DVec3,
        dir: DVec3,
        slack: f64,
        t_max: f64,
    ) -> Option<Hit> {
        let mut best = Hit { t: t_max, triangle: u32::MAX };
        self.visit(triangles, origin, dir, t_max, |i, tri| {
            if let Some(t) = tri.intersect_within(origin, dir, slack)
                && t > self.t_min_m
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
        // Not `Ray::new`: it takes components below 1.2e-7 for that, which turns the ray by as much. The
        // sign of -0 must be that of `d < 0`, by which the node test sorts the planes.
        let inverse = |d: f32| if d < 0.0 { 1.0 / d.min(-1e-18) } else { 1.0 / d.max(1e-18) };
        let mut ray = Ray {
            origin: origin.as_vec3a(),
            direction: d,
            inv_direction: Vec3A::from(d.to_array().map(inverse)),
            tmin: 0.0,
            tmax: if t_max.is_finite() { bound(t_max) } else { f32::MAX },
        };
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_wide_tree_is_that_of_the_library() {
        for n in [1, 3, 40, 700] {
            let boxes: Vec<Aabb> = soup(n as u64, n, false)
                .iter()
                .map(|t| {
                    let c = t.corners().map(|p| p.as_vec3a());
                    Aabb::new(c[0].min(c[1]).min(c[2]), c[0].max(c[1]).max(c[2]))
                })
                .collect();
            let params = BvhBuildParams::medium_build();
            let own = wide_tree(&boxes, &params);
            let other = obvhs::cwbvh::builder::build_cwbvh(&boxes, params, &mut Default::default());
            assert_eq!(own.primitive_indices, other.primitive_indices);
            let bytes = |t: &CwBvh| bytemuck::cast_slice::<CwBvhNode, u8>(&t.nodes).to_vec();
            assert_eq!(bytes(&own), bytes(&other), "{n}");
        }
    }

    fn soup(seed: u64, n: usize, snap: bool) -> Vec<Triangle> {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            let x = (state >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0;
            // Coordinates on a coarse lattice make flat boxes, shared planes and axis-parallel edges.
            if snap { (x * 4.0).round() / 4.0 } else { x }
        };
        (0..n)
            .filter_map(|i| {
                let c = DVec3::new(next(), next(), next());
                let mut corner = || c + 0.3 * DVec3::new(next(), next(), next());
                Triangle::new([corner(), corner(), corner()], i as u32, 0, 0)
            })
            .collect()
    }

    fn nearest_of_all(triangles: &[Triangle], o: DVec3, d: DVec3, skip: u32, t_min: f64) -> Option<f64> {
        triangles
            .iter()
            .filter(|t| t.patch != skip)
            .filter_map(|t| t.intersect(o, d))
            .filter(|t| *t > t_min)
            .min_by(f64::total_cmp)
    }

    proptest! {
        #[test]
        fn agrees_with_every_triangle(
            seed in any::<u64>(),
            n in 7usize..200,
            snap in any::<bool>(),
            o in prop::array::uniform3(-2.0f64..2.0),
            d in prop::array::uniform3(prop_oneof![Just(0.0), Just(-0.0), Just(1e-9), -1.0f64..1.0]),
            skip in 0u32..10,
            scale in prop_oneof![Just(1.0), Just(1e-3), Just(100.0)],
        ) {
            let dir = DVec3::from_array(d);
            let dir = dir.try_normalize().unwrap_or(DVec3::X);
            let mut triangles: Vec<Triangle> = soup(seed, n, snap)
                .iter()
                .filter_map(|t| Triangle::new(t.corners().map(|c| c * scale), t.patch, 0, 0))
                .collect();
            let t_min = 1e-6 * scale;
            let origin = DVec3::from_array(o) * scale;
            let truth = nearest_of_all(&triangles, origin, dir, skip, t_min);
            let bvh = Bvh::build(&mut triangles, t_min);
            let hit = bvh.closest_hit(&triangles, origin, dir, skip, f64::INFINITY);
            prop_assert_eq!(hit.map(|h| h.t), truth);
            for t_max in [0.5 * scale, f64::INFINITY] {
                let any = bvh.any_hit(&triangles, origin, dir, skip, t_max);
                prop_assert_eq!(any, truth.is_some_and(|t| t < t_max));
            }
        }
    }
}
