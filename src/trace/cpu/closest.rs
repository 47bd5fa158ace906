//! The nearest triangle along given rays: obvhs' traversal in f32, spread over the cores.

use crate::base::tasks::Tasks;
use crate::trace::closest::{Find, Hit, NO_TRIANGLE, Ray};
use glam::{UVec2, Vec3A, Vec4};
use obvhs::cwbvh::{CwBvh, node::CwBvhNode};
use obvhs::traverse;
use rayon::prelude::*;

/// obvhs' node test passes over whatever is nearer than 1e-4 in units of the direction's length. Its rays
/// get directions of about this length in m: 1e-8 m remains.
const SHORT_M: f32 = 1.0 / 16384.0;
/// Its node test rounds like f32; the far end of the ray gives way by as much.
const LONGER: f32 = 1.0 + 1e-6;
/// Rounding error of an edge function in units of its largest term.
const EDGE_SLACK: f32 = 4e-7;

/// The hits of all rays. `triangles` are three rows each, (v0, patch), (v1 - v0, ..), (v2 - v0, ..), in the
/// order of the tree's leaves; `skip_patches` holds for each ray the patch that it leaves.
///
/// The tree's boxes should be a few units in the last place larger than the triangles: obvhs rounds box
/// distances to nearest.
///
/// # Panics
/// If `rays` and `skip_patches` differ in length.
pub fn hits(
    tree: &CwBvh,
    triangles: &[[f32; 4]],
    find: Find,
    rays: &[Ray],
    skip_patches: &[u32],
) -> Vec<Hit> {
    assert_eq!(rays.len(), skip_patches.len());
    rays.par_iter()
        .zip(skip_patches)
        .with_min_len(256)
        .map_tasks(|(ray, &skip)| hit(tree, triangles, find, ray, skip))
        .collect()
}

fn hit(tree: &CwBvh, triangles: &[[f32; 4]], find: Find, ray: &Ray, skip_patch: u32) -> Hit {
    let mut best = Hit { t: ray.t_max, u: 0.0, v: 0.0, triangle: NO_TRIANGLE };
    if tree.nodes.is_empty() {
        return best;
    }
    let (origin, dir) = (Vec3A::from(ray.origin), Vec3A::from(ray.dir));
    // By a power of two, so that nothing is rounded.
    let size = f32::from_bits(dir.abs().max_element().max(1e-30).to_bits() & 0x7f80_0000);
    let shorter = SHORT_M / size;
    let direction = dir * shorter;
    // Not `Ray::new`: it takes components below 1.2e-7 for that, which turns the ray by as much.
    // The sign of -0 must be that of `d < 0`, by which the node test sorts the planes.
    let inverse = |d: f32| if d < 0.0 { 1.0 / d.min(-1e-18) } else { 1.0 / d.max(1e-18) };
    let mut boxes = obvhs::ray::Ray {
        origin,
        direction,
        inv_direction: Vec3A::from(direction.to_array().map(inverse)),
        tmin: 0.0,
        tmax: ray.t_max / shorter * LONGER,
    };
    let mut state = tree.new_traversal(direction);
    let mut node: &CwBvhNode;
    traverse!(tree, node, state, node.intersect_ray(&boxes, state.oct_inv4), {
        let index = state.primitive_id;
        let rows = &triangles[3 * index as usize..3 * index as usize + 3];
        if rows[0][3].to_bits() != skip_patch
            && let Some([t, u, v]) = intersect(rows, origin, dir)
            && t > ray.t_min
            && (t < best.t || (t == best.t && index < best.triangle && best.triangle != NO_TRIANGLE))
        {
            best = Hit { t, u, v, triangle: index };
            boxes.tmax = t / shorter * LONGER;
            if find == Find::Any {
                break;
            }
        }
    });
    best
}

/// (t, u, v) where the ray meets the triangle, from either side, its edges softened by their rounding error.
#[inline]
fn intersect(rows: &[[f32; 4]], origin: Vec3A, dir: Vec3A) -> Option<[f32; 3]> {
    let [v0, e1, e2] = [0, 1, 2].map(|i| Vec3A::from_vec4(Vec4::from_array(rows[i])));
    let to = v0 - origin;
    let normal = e1.cross(e2);
    let det = normal.dot(dir);
    let twist = dir.cross(to);
    let (u, v) = (-twist.dot(e2), twist.dot(e1));
    // Compared without a division, in which a tiny determinant would overflow.
    let (u, v) = if det < 0.0 { (-u, -v) } else { (u, v) };
    let size = det.abs();
    let reach = |v: Vec3A| v.abs().element_sum();
    let slack = EDGE_SLACK * reach(to) * reach(dir) * e1.abs().max(e2.abs()).max_element();
    let inside = size > 0.0 && u >= -slack && v >= -slack && u + v <= size + slack;
    inside.then(|| [normal.dot(to) / det, u / size, v / size])
}
