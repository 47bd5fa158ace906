//! Coplanar neighbours of a mesh, by union over shared edges.

use crate::geom::hash::FastMap;
use glam::DVec3;

/// Sine of the largest angle between normals that still counts as one plane where beams are concerned. Far below the angle that
/// matters to a phase (a metre-wide facet tilted by it moves by a nanometre), far above rounding in f32
/// files would be wrong: those keep their patches apart and are only traced, not merged.
pub(super) const COPLANAR: f64 = 1e-9;

/// Patch number of each triangle (0-based) and the number of patches; `sine` of the largest angle between normals that counts as one
/// plane.
pub(crate) fn coplanar_patches(positions_m: &[DVec3], triangles: &[[u32; 3]], sine: f64) -> (Vec<u32>, u32) {
    let n = triangles.len();
    let normal: Vec<DVec3> = triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|i| positions_m[i as usize]);
            (b - a).cross(c - a).normalize_or_zero()
        })
        .collect();
    let mut parent: Vec<u32> = (0..n as u32).collect();
    let place = places(positions_m);
    let mut edge_owner: FastMap<u64, u32> = FastMap::with_capacity_and_hasher(2 * n, Default::default());
    for (i, t) in triangles.iter().enumerate() {
        let i = i as u32;
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            let (a, b) = (place[a as usize], place[b as usize]);
            let edge = u64::from(a.min(b)) << 32 | u64::from(a.max(b));
            let j = *edge_owner.entry(edge).or_insert(i);
            if j != i && normal[i as usize].cross(normal[j as usize]).length() < sine {
                let (ri, rj) = (root(&mut parent, i), root(&mut parent, j));
                parent[ri.max(rj) as usize] = ri.min(rj);
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

/// Surfaces of a mesh: neighbours that turn little from one to the next.
pub(crate) struct SurfaceParts {
    /// Number of each triangle's surface, from 0.
    pub(crate) of: Vec<u32>,
    /// The triangles of each.
    pub(crate) lists: Vec<Vec<usize>>,
    /// Length of the edges around each, m: those that it does not go on beyond.
    pub(crate) border_m: Vec<f64>,
    /// How far flat facets are off the curved surface through their corners, of each, m.
    pub(crate) sagitta_m: Vec<f64>,
}

impl SurfaceParts {
    /// Joins triangles over edges that turn by `turn_rad` or less, however they are wound. Sagittas are those of triangles that are `faceted`.
    pub(crate) fn of(
        positions_m: &[DVec3],
        triangles: &[[u32; 3]],
        turn_rad: f64,
        faceted: impl Fn(usize) -> bool,
    ) -> SurfaceParts {
        let n = triangles.len();
        let place = places(positions_m);
        let at = |i: u32| positions_m[i as usize];
        let area_m2 = |t: &[u32; 3]| 0.5 * (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])).length();
        let mut parent: Vec<u32> = (0..n as u32).collect();
        // Sagitta of the edges of each triangle.
        let mut sagitta_m = vec![0f64; n];
        let mut owner: FastMap<u64, (u32, DVec3, usize)> =
            FastMap::with_capacity_and_hasher(2 * n, Default::default());
        let mut joined = vec![false; 3 * n];
        for (i, t) in triangles.iter().enumerate() {
            for k in 0..3 {
                let (a, b, c) = (t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
                let (p, q) = (place[a as usize], place[b as usize]);
                let along = (at(b) - at(a)).normalize_or_zero();
                let out = at(c) - at(a);
                let inwards = (out - along * along.dot(out)).normalize_or_zero();
                let edge = u64::from(p.min(q)) << 32 | u64::from(p.max(q));
                let (j, other, side) = *owner.entry(edge).or_insert((i as u32, inwards, 3 * i + k));
                // Facets of one plane run away from their edge against each other.
                let turn = inwards.cross(other).length().atan2(-inwards.dot(other));
                if j as usize == i || turn > turn_rad || inwards == DVec3::ZERO || other == DVec3::ZERO {
                    continue;
                }
                (joined[3 * i + k], joined[side]) = (true, true);
                let wide_m = (area_m2(t) + area_m2(&triangles[j as usize])) / at(a).distance(at(b));
                if faceted(i) && faceted(j as usize) {
                    sagitta_m[i] = sagitta_m[i].max(wide_m * turn / 8.0);
                }
                let (ri, rj) = (root(&mut parent, i as u32), root(&mut parent, j));
                parent[ri.max(rj) as usize] = ri.min(rj);
            }
        }
        let mut number = vec![u32::MAX; n];
        let mut out = SurfaceParts {
            of: Vec::with_capacity(n),
            lists: Vec::new(),
            border_m: Vec::new(),
            sagitta_m: Vec::new(),
        };
        for (i, sagitta) in sagitta_m.iter().enumerate() {
            let r = root(&mut parent, i as u32) as usize;
            if number[r] == u32::MAX {
                number[r] = out.lists.len() as u32;
                out.lists.push(Vec::new());
                out.border_m.push(0.0);
                out.sagitta_m.push(0.0);
            }
            let part = number[r] as usize;
            out.of.push(part as u32);
            out.lists[part].push(i);
            out.sagitta_m[part] = out.sagitta_m[part].max(*sagitta);
            let t = triangles[i];
            let sides = (0..3).filter(|k| !joined[3 * i + k]);
            out.border_m[part] += sides.map(|k| at(t[k]).distance(at(t[(k + 1) % 3]))).sum::<f64>();
        }
        out
    }
}

/// The first vertex that lies where each one lies: exporters duplicate vertices for flat shading.
pub(super) fn places(positions_m: &[DVec3]) -> Vec<u32> {
    let mut first: FastMap<[u64; 3], u32> =
        FastMap::with_capacity_and_hasher(positions_m.len(), Default::default());
    let mut place = Vec::with_capacity(positions_m.len());
    for (i, p) in positions_m.iter().enumerate() {
        // Zeros of either sign are one place.
        let key = [(p.x + 0.0).to_bits(), (p.y + 0.0).to_bits(), (p.z + 0.0).to_bits()];
        place.push(*first.entry(key).or_insert(i as u32));
    }
    place
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
    use crate::scene::Mesh;

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
        let (patch, count) = coplanar_patches(&mesh.positions_m, &mesh.triangles, COPLANAR);
        assert_eq!((patch, count), (vec![0, 0, 1, 1], 2));
    }
}
