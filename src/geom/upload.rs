//! The geometry as the arrays that the shaders read.

use super::Geometry;
use crate::error::{BadInput, Result};
use glam::DVec3;

/// Bodies are packed two to a word in the shaders' returns.
const MAX_BODIES: usize = 65_536;
/// Stack entries of the WGSL traversal; one entry a level of the tree is an upper bound.
const MAX_DEPTH: usize = 24;

/// Arrays for the bindings `bvh_nodes`, `bvh_triangles`, `planes`, `surfaces`, `body_velocities`.
#[derive(Debug, Clone, PartialEq)]
pub struct GeometryArrays {
    /// Five words of four a node (obvhs' CWBVH node).
    pub nodes: Vec<[u32; 4]>,
    /// (v0, patch), (e1, body), (e2, surface) of each triangle, integers as bits.
    pub triangles: Vec<[f32; 4]>,
    /// (normal, offset) high and low parts: normal . p = offset.
    pub planes: Vec<[f32; 4]>,
    /// (eps', -eps'', height deviation in m, 1 for a perfect conductor).
    pub surfaces: Vec<[f32; 4]>,
    pub body_velocities: Vec<[f32; 4]>,
}

/// The f32 nearest to `x` and the f32 nearest to what is left.
pub fn split(x: f64) -> [f32; 2] {
    let hi = x as f32;
    [hi, (x - hi as f64) as f32]
}

/// High and low parts of a vector.
pub fn split3(v: DVec3) -> [[f32; 3]; 2] {
    let s = v.to_array().map(split);
    [s.map(|x| x[0]), s.map(|x| x[1])]
}

impl GeometryArrays {
    /// Errors: more bodies or a deeper tree than the shaders can hold.
    pub fn new(geometry: &Geometry) -> Result<Self> {
        if geometry.bodies.len() > MAX_BODIES {
            return Err(BadInput::new("too many objects for the gpu engine")
                .key("objects")
                .value(geometry.bodies.len())
                .allowed(format!("at most {MAX_BODIES}"))
                .remedy("join objects or use --device cpu")
                .into());
        }
        let cwbvh = &geometry.bvh.cwbvh;
        let depth = depth(cwbvh);
        if depth > MAX_DEPTH {
            return Err(BadInput::new("the scene's tree is too deep for the gpu engine")
                .key("depth")
                .value(depth)
                .allowed(format!("at most {MAX_DEPTH}"))
                .remedy("use --device cpu")
                .into());
        }
        let mut arrays = GeometryArrays {
            nodes: bytemuck::cast_slice(&cwbvh.nodes).to_vec(),
            triangles: Vec::with_capacity(3 * geometry.triangles.len()),
            planes: Vec::with_capacity(2 * geometry.triangles.len()),
            surfaces: Vec::new(),
            body_velocities: Vec::new(),
        };
        for t in &geometry.triangles {
            for (v, bits) in [(t.v0, t.patch), (t.e1, t.body), (t.e2, t.surface)] {
                let [x, y, z] = v.to_array().map(|x| x as f32);
                arrays.triangles.push([x, y, z, f32::from_bits(bits)]);
            }
            let [n_hi, n_lo] = split3(t.normal);
            let [d_hi, d_lo] = split(t.normal.dot(t.v0));
            arrays.planes.push([n_hi[0], n_hi[1], n_hi[2], d_hi]);
            arrays.planes.push([n_lo[0], n_lo[1], n_lo[2], d_lo]);
        }
        for s in &geometry.surfaces {
            let rough = s.roughness_rms_m as f32;
            arrays.surfaces.push(match s.eps_r {
                None => [0.0, 0.0, rough, 1.0],
                Some(e) => [e.re as f32, e.im as f32, rough, 0.0],
            });
        }
        for b in &geometry.bodies {
            let v = b.velocity_mps.as_vec3();
            arrays.body_velocities.push([v.x, v.y, v.z, 0.0]);
        }
        Ok(arrays)
    }
}

/// Levels of the tree.
fn depth(bvh: &obvhs::cwbvh::CwBvh) -> usize {
    let mut deepest = 0;
    let mut stack = if bvh.nodes.is_empty() { vec![] } else { vec![(0usize, 1usize)] };
    while let Some((node, level)) = stack.pop() {
        deepest = deepest.max(level);
        let n = &bvh.nodes[node];
        for child in 0..n.imask.count_ones() as usize {
            stack.push((n.child_base_idx as usize + child, level + 1));
        }
    }
    deepest
}
