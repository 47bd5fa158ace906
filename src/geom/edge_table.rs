//! The edges of a scene's faces, for visibility by lines: the lines at which something can begin or cease to hide.
//!
//! Sides of faces that share a line are split at each other's corners until they share whole edges, so that every edge knows all
//! half-faces that meet in it. Sides inside a patch cancel. Lines in which faces of different patches cross are edges with four
//! half-faces. Points at which an edge pierces a face are listed with the edge. All of it follows from positions alone.

use super::faces::{Face, Faces, LIES_M, bounds, misses_segment};
use super::hash::FastMap;
use super::tree::BoxTree;
use crate::base::tasks::Tasks;
use glam::DVec3;
use rayon::prelude::*;

/// Corners nearer to one another than this are one, m, and corners so near to a side split it: above the rounding of files in f32 at the
/// distances of a scene, and of the order of what faces may be off their planes.
const WELD_M: f64 = 1e-6;
/// Shorter edges are left out, m.
const SHORTEST_M: f64 = 1e-9;

/// The side of an edge on which a face lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HalfFace {
    /// Index of the face.
    pub face: u32,
    /// Unit vector in the plane of the face, at right angles to the edge, into the face.
    pub inward: DVec3,
}

/// A straight edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// Both ends, m.
    pub ends_m: [DVec3; 2],
    halves: [u32; 2],
    pierced: [u32; 2],
}

impl Edge {
    /// The point at a share of its length, m.
    pub fn at(&self, share: f64) -> DVec3 {
        self.ends_m[0] + (self.ends_m[1] - self.ends_m[0]) * share
    }
}

/// All edges of a scene, in the order of the tree over them.
#[derive(Debug, Default)]
pub struct EdgeTable {
    /// The edges.
    pub edges: Vec<Edge>,
    halves: Vec<HalfFace>,
    /// Corners of all faces as in `Faces::corners`, those at one position equal to the bit.
    corners: Vec<DVec3>,
    /// Shares of the length at which edges pierce faces.
    pierced: Vec<f64>,
    pub(crate) tree: BoxTree,
}

impl EdgeTable {
    /// The half-faces that meet in an edge.
    pub fn halves(&self, edge: &Edge) -> &[HalfFace] {
        &self.halves[edge.halves[0] as usize..edge.halves[1] as usize]
    }

    /// The shares of its length at which an edge pierces faces.
    pub fn pierced(&self, edge: &Edge) -> &[f64] {
        &self.pierced[edge.pierced[0] as usize..edge.pierced[1] as usize]
    }

    /// Corners of a face in order, m; those of faces that meet in one position are equal to the bit.
    pub fn corners(&self, face: &Face) -> &[DVec3] {
        &self.corners[face.first as usize..(face.first + face.count) as usize]
    }

    /// Corners of all faces, in the order of `Faces::corners`, m.
    pub(crate) fn all_corners(&self) -> &[DVec3] {
        &self.corners
    }

    /// Finds the edges of faces.
    pub fn new(faces: &Faces) -> EdgeTable {
        let (numbers, points) = welded(&faces.corners);
        let mut found = sides(faces, &numbers, &points);
        found.extend(crossings(faces, &numbers));
        let boxes: Vec<_> =
            found.iter().map(|(ends, _)| (ends[0].min(ends[1]), ends[0].max(ends[1]))).collect();
        let (tree, order) = BoxTree::new(&boxes, 4);
        let found: Vec<_> = order.iter().map(|i| &found[*i as usize]).collect();
        let pierced: Vec<Vec<f64>> =
            found.par_iter().map_tasks(|(ends, halves)| piercings(faces, *ends, halves)).collect();
        let corners = numbers.iter().map(|i| points[*i as usize]).collect();
        let mut table = EdgeTable { tree, corners, ..EdgeTable::default() };
        for ((ends, halves), pierced) in found.into_iter().zip(pierced) {
            let from = [table.halves.len() as u32, table.pierced.len() as u32];
            table.halves.extend(halves);
            table.pierced.extend(pierced);
            let to = [table.halves.len() as u32, table.pierced.len() as u32];
            table.edges.push(Edge { ends_m: *ends, halves: [from[0], to[0]], pierced: [from[1], to[1]] });
        }
        table
    }
}

type Found = ([DVec3; 2], Vec<HalfFace>);

/// Corners by number, equal for those at one position.
fn welded(corners: &[DVec3]) -> (Vec<u32>, Vec<DVec3>) {
    let cell = 16.0 * WELD_M;
    let mut grid: FastMap<[i64; 3], Vec<u32>> =
        FastMap::with_capacity_and_hasher(corners.len(), Default::default());
    let (mut numbers, mut points): (Vec<u32>, Vec<DVec3>) = (Vec::with_capacity(corners.len()), Vec::new());
    let key = |p: DVec3| (p / cell).floor().as_i64vec3().to_array();
    for p in corners {
        let [lo, hi] = [key(*p - WELD_M), key(*p + WELD_M)];
        let mut cells = (lo[0]..=hi[0])
            .flat_map(|x| (lo[1]..=hi[1]).flat_map(move |y| (lo[2]..=hi[2]).map(move |z| [x, y, z])));
        let known = cells
            .find_map(|c| grid.get(&c)?.iter().copied().find(|i| points[*i as usize].distance(*p) <= WELD_M));
        numbers.push(known.unwrap_or_else(|| {
            points.push(*p);
            let new = points.len() as u32 - 1;
            grid.entry(key(*p)).or_default().push(new);
            new
        }));
    }
    (numbers, points)
}

/// The sides of all faces, split where corners lie on them, without those inside a patch.
fn sides(faces: &Faces, numbers: &[u32], points: &[DVec3]) -> Vec<Found> {
    let boxes: Vec<_> = points.iter().map(|p| (*p, *p)).collect();
    let (tree, order) = BoxTree::new(&boxes, 8);
    let on_side = |a: u32, b: u32, on: &mut Vec<(f64, u32)>| {
        let (p, q) = (points[a as usize], points[b as usize]);
        let along = q - p;
        let l2 = along.length_squared();
        let misses = misses_segment(p, q, WELD_M);
        tree.visit(misses, |i| {
            let k = order[i as usize];
            let d = points[k as usize] - p;
            let t = d.dot(along) / l2;
            if k != a && k != b && t > 0.0 && t < 1.0 && (d - along * t).length_squared() <= WELD_M * WELD_M {
                on.push((t, k));
            }
            false
        });
        on.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
    };
    let of_face = |i: usize| {
        let face = &faces.faces[i];
        let range = face.first as usize..(face.first + face.count) as usize;
        let ids = &numbers[range];
        let mut out = Vec::with_capacity(ids.len());
        let mut on = Vec::new();
        for k in 0..ids.len() {
            let (a, b) = (ids[k], ids[(k + 1) % ids.len()]);
            if a == b {
                continue;
            }
            let inward = face.normal.cross(points[b as usize] - points[a as usize]).normalize_or_zero();
            on.clear();
            on_side(a, b, &mut on);
            let mut from = a;
            for to in on.iter().map(|o| o.1).chain([b]) {
                out.push(((from.min(to), from.max(to)), HalfFace { face: i as u32, inward }));
                from = to;
            }
        }
        out
    };
    let lists: Vec<Vec<_>> = (0..faces.faces.len()).into_par_iter().map_tasks(of_face).collect();
    let mut all: Vec<((u32, u32), HalfFace)> = lists.into_iter().flatten().collect();
    all.sort_by_key(|(ends, half)| (*ends, half.face));
    let patch = |h: &HalfFace| faces.faces[h.face as usize].patch;
    let edge = |group: &[((u32, u32), HalfFace)]| {
        let halves: Vec<HalfFace> = group.iter().map(|g| g.1).collect();
        // Two faces of one patch on either side, and nothing else.
        let is_inside = matches!(&halves[..], [a, b] if patch(a) == patch(b) && a.inward.dot(b.inward) < 0.0);
        let (a, b) = group[0].0;
        let ends = [points[a as usize], points[b as usize]];
        (!is_inside && ends[0].distance(ends[1]) > SHORTEST_M).then_some((ends, halves))
    };
    all.chunk_by(|x, y| x.0 == y.0).filter_map(edge).collect()
}

/// The lines in which faces of different patches cross. Faces that share a side meet in it and nowhere else, also where noise bends them.
fn crossings(faces: &Faces, numbers: &[u32]) -> Vec<Found> {
    let ids = |f: &Face| &numbers[f.first as usize..(f.first + f.count) as usize];
    let are_neighbours = |f: &Face, g: &Face| ids(f).iter().filter(|i| ids(g).contains(i)).count() >= 2;
    let plane_side = |face: &Face, corners: &[DVec3]| {
        let d = corners.iter().map(|p| face.normal.dot(*p) - face.offset_m);
        d.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), d| (lo.min(d), hi.max(d)))
    };
    // What lies on the plane of another body does not cross it: one hides the other (CONVENTIONS eq. 65b).
    let lies_on = |f: &Face, g: &Face| {
        f.body != g.body && {
            let (lo, hi) = plane_side(g, faces.corners(f));
            lo >= -LIES_M && hi <= LIES_M
        }
    };
    let is_across = |f: &Face, g: &Face| {
        let (lo, hi) = plane_side(g, faces.corners(f));
        lo < -faces.flat_m && hi > faces.flat_m
    };
    let of_face = |i: usize| {
        let f = &faces.faces[i];
        let (lo, hi) = bounds(faces.corners(f));
        let (centre, half) = (0.5 * (lo + hi), 0.5 * (hi - lo));
        let mut out = Vec::new();
        let apart = |c: DVec3, size: DVec3| (centre - c).abs().cmpgt(size + half).any();
        faces.visit_boxes(apart, |j| {
            let g = &faces.faces[j as usize];
            if j as usize > i
                && g.patch != f.patch
                && is_across(f, g)
                && is_across(g, f)
                && !lies_on(f, g)
                && !lies_on(g, f)
                && !are_neighbours(f, g)
            {
                out.extend(crossing(faces, [i as u32, j]));
            }
        });
        out
    };
    let lists: Vec<Vec<Found>> = (0..faces.faces.len()).into_par_iter().map_tasks(of_face).collect();
    lists.into_iter().flatten().collect()
}

/// The line in which two faces cross.
fn crossing(faces: &Faces, numbers: [u32; 2]) -> Option<Found> {
    let [f, g] = numbers.map(|i| &faces.faces[i as usize]);
    let across = f.normal.cross(g.normal);
    let d = across.try_normalize()?;
    // The point of both planes that is nearest to the corner of the first.
    let start = faces.corners(f)[0];
    let h = [f, g].map(|p| p.offset_m - p.normal.dot(start));
    let c = f.normal.dot(g.normal);
    let det = 1.0 - c * c;
    let o = start + (f.normal * (h[0] - c * h[1]) + g.normal * (h[1] - c * h[0])) / det;
    // Both ends: the share of the line and the place on the side that ends it, also where that side is a little off its face's plane.
    let (mut lo, mut hi) = ((f64::NEG_INFINITY, start), (f64::INFINITY, start));
    for (face, other) in [(f, g), (g, f)] {
        let corners = faces.corners(face);
        for (k, a) in corners.iter().enumerate() {
            let b = corners[(k + 1) % corners.len()];
            let inward = face.normal.cross(b - *a).normalize_or_zero();
            let (slope, at) = (inward.dot(d), inward.dot(o - *a));
            let share = -at / slope;
            let [p, q] = [*a, b].map(|c| other.normal.dot(c) - other.offset_m);
            let on_side = *a + (b - *a) * (p / (p - q)).clamp(0.0, 1.0);
            if slope.abs() < 1e-14 {
                if at < 0.0 {
                    return None;
                }
            } else if slope > 0.0 && share > lo.0 {
                lo = (share, on_side);
            } else if slope < 0.0 && share < hi.0 {
                hi = (share, on_side);
            }
        }
    }
    if hi.0 - lo.0 <= SHORTEST_M {
        return None;
    }
    let halves = [f, g].into_iter().zip(numbers).flat_map(|(face, number)| {
        let inward = face.normal.cross(d);
        [1.0, -1.0].map(|sign| HalfFace { face: number, inward: inward * sign })
    });
    Some(([lo.1, hi.1], halves.collect()))
}

/// The shares of its length at which an edge goes through faces other than its own.
fn piercings(faces: &Faces, [a, b]: [DVec3; 2], halves: &[HalfFace]) -> Vec<f64> {
    let mut out = Vec::new();
    faces.visit_segment(a, b, 0.0, |i| {
        let face = &faces.faces[i as usize];
        let (p, q) = (face.normal.dot(a) - face.offset_m, face.normal.dot(b) - face.offset_m);
        let t = p / (p - q);
        if (p > 0.0) != (q > 0.0)
            && (t > 0.0 && t < 1.0)
            && !halves.iter().any(|h| h.face == i)
            && faces.is_inside(face, a + (b - a) * t, WELD_M)
        {
            out.push(t);
        }
        false
    });
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::frames::Pose;
    use crate::geom::Geometry;
    use crate::road::shape::cuboid;
    use crate::scene::{Material, Scene};

    fn table(boxes: &[(DVec3, DVec3)]) -> (EdgeTable, Faces) {
        let mut scene = Scene { materials: vec![Material::pec()], ..Scene::default() };
        for (size, centre) in boxes {
            scene.add_mesh("box", "", cuboid(*size, *centre, 0), Pose::IDENTITY);
        }
        let faces = Geometry::build(&scene, 0.0, 77e9).unwrap().find_faces();
        (EdgeTable::new(&faces), faces)
    }

    #[test]
    fn a_box_has_twelve_edges_of_two_halves() {
        let (t, _) = table(&[(DVec3::new(1.0, 2.0, 3.0), DVec3::ZERO)]);
        assert_eq!(t.edges.len(), 12);
        assert!(t.edges.iter().all(|e| t.halves(e).len() == 2 && t.pierced(e).is_empty()));
        let length: f64 = t.edges.iter().map(|e| e.ends_m[0].distance(e.ends_m[1])).sum();
        assert!((length - 4.0 * 6.0).abs() < 1e-12);
    }

    /// A small box on a large one's top: its foot lies in the top and pierces nothing. Beside it one that goes through the side.
    #[test]
    fn boxes_that_cross_have_edges_of_four_halves() {
        let (t, _) =
            table(&[(DVec3::splat(2.0), DVec3::ZERO), (DVec3::splat(0.5), DVec3::new(1.0, 0.0, 0.0))]);
        let crossing: Vec<_> = t.edges.iter().filter(|e| t.halves(e).len() == 4).collect();
        // Four sides of a square, each crossed by one face of the small box.
        assert_eq!(crossing.len(), 4);
        let length: f64 = crossing.iter().map(|e| e.ends_m[0].distance(e.ends_m[1])).sum();
        assert!((length - 2.0).abs() < 1e-9, "{length}");
        let pierced: usize = t.edges.iter().map(|e| t.pierced(e).len()).sum();
        assert_eq!(pierced, 4);
    }

    /// Sides of different length that share a line are split at each other's corners.
    #[test]
    fn sides_are_split_at_corners_of_neighbours() {
        let (t, _) = table(&[(DVec3::splat(2.0), DVec3::ZERO), (DVec3::ONE, DVec3::new(0.5, 0.0, 1.5))]);
        // The small box's side lies in the plane of the large one's; its foot has one side on the large one's edge.
        let shared: Vec<_> = t.edges.iter().filter(|e| t.halves(e).len() == 4).collect();
        assert_eq!(shared.len(), 1, "{shared:?}");
        assert!((shared[0].ends_m[0].distance(shared[0].ends_m[1]) - 1.0).abs() < 1e-12);
    }
}
