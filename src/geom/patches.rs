//! Coplanar neighbours of a mesh, by union over shared edges.

use crate::geom::hash::FastMap;
use crate::scene::Mesh;
use glam::DVec3;

/// Sine of the largest angle between normals that still counts as one plane. Far below the angle that
/// matters to a phase (a metre-wide facet tilted by it moves by a nanometre), far above rounding in f32
/// files would be wrong: those keep their patches apart and are only traced, not merged.
const COPLANAR: f64 = 1e-9;

/// Patch number of each triangle (0-based) and the number of patches.
pub fn coplanar_patches(mesh: &Mesh) -> (Vec<u32>, u32) {
    let n = mesh.triangles.len();
    let normal: Vec<DVec3> = mesh
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|i| mesh.positions_m[i as usize]);
            (b - a).cross(c - a).normalize_or_zero()
        })
        .collect();
    let mut parent: Vec<u32> = (0..n as u32).collect();
    // Vertices are compared by position: exporters duplicate them for flat shading.
    let key = |i: u32| mesh.positions_m[i as usize].to_array().map(|x| (x + 0.0).to_bits());
    let mut edge_owner: FastMap<([u64; 3], [u64; 3]), u32> =
        FastMap::with_capacity_and_hasher(2 * n, Default::default());
    for (i, t) in mesh.triangles.iter().enumerate() {
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            let (ka, kb) = (key(a), key(b));
            let edge = if ka < kb { (ka, kb) } else { (kb, ka) };
            match edge_owner.get(&edge) {
                Some(&j) if normal[i].cross(normal[j as usize]).length() < COPLANAR => {
                    let (ri, rj) = (root(&mut parent, i as u32), root(&mut parent, j));
                    parent[ri.max(rj) as usize] = ri.min(rj);
                }
                Some(_) => {}
                None => {
                    edge_owner.insert(edge, i as u32);
                }
            }
        }
    }
    let mut number = vec![u32::MAX; n];
    let mut count = 0;
    let patch = (0..n as u32)
        .map(|i| {
            let r = root(&mut parent, i) as usize;
            if number[r] == u32::MAX {
                number[r] = count;
                count += 1;
            }
            number[r]
        })
        .collect();
    (patch, count)
}

fn root(parent: &mut [u32], mut i: u32) -> u32 {
    while parent[i as usize] != i {
        parent[i as usize] = parent[parent[i as usize] as usize];
        i = parent[i as usize];
    }
    i
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folded_sheet_has_two_patches() {
        let p = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let mesh = Mesh {
            // The seam's corners are duplicated, as exporters do.
            positions_m: vec![
                p(0., 0., 0.),
                p(1., 0., 0.),
                p(1., 1., 0.),
                p(0., 1., 0.),
                p(0., 0., 0.),
                p(0., 1., 0.),
                p(0., 1., 1.),
                p(0., 0., 1.),
            ],
            triangles: vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]],
            material: vec![0; 4],
            ..Mesh::default()
        };
        let (patch, count) = coplanar_patches(&mesh);
        assert_eq!((patch, count), (vec![0, 0, 1, 1], 2));
    }
}
