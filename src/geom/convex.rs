//! Bodies that see nothing of themselves.

use crate::scene::{Scene, Shape};
use glam::DVec3;
use rayon::prelude::*;
use std::collections::HashMap;

/// Whether nothing of the scene can see another part of it: one mesh that is flat, or closed and convex. Large ones are not looked at.
pub fn is_convex(scene: &Scene) -> bool {
    /// Pairs of a facet and a corner.
    const MOST: usize = 20_000_000;
    let mut seen = scene.objects.iter().filter(|o| o.radar);
    let (Some(Shape::Mesh(m)), None) = (seen.next().map(|o| o.shape), seen.next()) else { return false };
    let mesh = &scene.meshes[m];
    if mesh.triangles.len().saturating_mul(mesh.positions_m.len()) > MOST {
        return false;
    }
    let bits = |i: u32| (mesh.positions_m[i as usize] + DVec3::ZERO).to_array().map(f64::to_bits);
    let mut edges: HashMap<[[u64; 3]; 2], usize> = HashMap::new();
    for t in &mesh.triangles {
        for k in 0..3 {
            let (a, b) = (bits(t[k]), bits(t[(k + 1) % 3]));
            *edges.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    let is_closed = edges.values().all(|n| *n == 2);
    let (lo, hi) =
        mesh.positions_m.iter().fold((DVec3::MAX, DVec3::MIN), |(lo, hi), p| (lo.min(*p), hi.max(*p)));
    let near_m = 1e-9 * (hi - lo).length();
    let is_outer = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| mesh.positions_m[i as usize]);
        let n = (b - a).cross(c - a).normalize_or_zero();
        let heights = mesh.positions_m.iter().map(|p| n.dot(*p - a));
        let (least, most) = heights.fold((0f64, 0f64), |(lo, hi), h| (lo.min(h), hi.max(h)));
        let is_flat = most <= near_m && least >= -near_m;
        is_flat || is_closed && (most <= near_m || least >= -near_m)
    };
    mesh.triangles.par_iter().all(is_outer)
}
