//! Volumes that dielectric faces close, alone or together with metal (CONVENTIONS eq. 70).

use super::welded::{Welded, sides};
use glam::DVec3;

/// Index that stands for no volume.
pub const NO_CELL: u32 = u32::MAX;

/// Faces that meet at a smaller angle, rad, lie on each other.
const COINCIDENT: f64 = 1e-6;

/// A volume filled with one dielectric.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// Index into `Geometry::surfaces` of what it is made of.
    pub surface: u32,
    /// Volume, m³.
    pub volume_m3: f64,
    /// Area of all that bounds the cell, metal too, m².
    pub area_m2: f64,
}

impl Cell {
    /// Mean length of the straight lines that cross a convex body (Cauchy: 4 V / A), m.
    pub fn mean_chord_m(&self) -> f64 {
        4.0 * self.volume_m3 / self.area_m2
    }
}

/// A triangle's side: `true` is the one that its normal points to.
type Sheet = (u32, bool);

/// The volume behind each triangle (empty when there is none), and the volumes.
///
/// From the back of a dielectric triangle the search goes on over each edge to the side that is met first
/// when one turns about the edge through the volume. What is found bounds the volume, also where metal
/// sheets close it, which have no outside. It is a body when no dielectric shows its front there, all
/// dielectric is of one material and the volume is positive. `enters` says of each surface whether it is the front of a
/// dielectric volume.
pub(super) fn find(enters: &[bool], mesh: &Welded) -> (Vec<u32>, Vec<Cell>) {
    let triangles = mesh.of;
    let dielectric = |t: u32| enters[triangles[t as usize].surface as usize];
    let n = mesh.triangles.len();
    if !(0..n as u32).any(dielectric) {
        return (Vec::new(), Vec::new());
    }
    let (mut of, mut cells) = (vec![NO_CELL; n], Vec::new());
    // The search that came to a side last.
    let mut seen = vec![[u32::MAX; 2]; n];
    let mut done = vec![false; n];
    for start in (0..n as u32).filter(|t| dielectric(*t)) {
        if done[start as usize] {
            continue;
        }
        seen[start as usize][0] = start;
        let surface = triangles[start as usize].surface;
        let origin = mesh.points[mesh.triangles[start as usize][0] as usize];
        let mut bounds: Vec<Sheet> = vec![(start, false)];
        let (mut at, mut volume_m3, mut area_m2, mut whole) = (0, 0.0, 0.0, true);
        while at < bounds.len() {
            let (t, front) = bounds[at];
            at += 1;
            whole &= !dielectric(t) || (!front && triangles[t as usize].surface == surface);
            let [a, b, c] = mesh.triangles[t as usize].map(|v| mesh.points[v as usize] - origin);
            volume_m3 += a.dot(b.cross(c)) / if front { -6.0 } else { 6.0 };
            area_m2 += 0.5 * (b - a).cross(c - a).length();
            for edge in sides(&mesh.triangles[t as usize]) {
                let same = |u: u32| triangles[u as usize].surface == surface;
                let (next, side) = next_side(mesh, (t, front), edge, same);
                if std::mem::replace(&mut seen[next as usize][side as usize], start) != start {
                    bounds.push((next, side));
                }
            }
        }
        // Of other materials than the one that looks for its bounds nothing is known yet.
        let of_it = bounds.iter().filter(|(t, _)| triangles[*t as usize].surface == surface);
        of_it.for_each(|(t, front)| done[*t as usize] |= !front);
        if whole && volume_m3 > 0.0 {
            let behind = bounds.iter().filter(|(t, front)| dielectric(*t) && !front);
            behind.for_each(|(t, _)| of[*t as usize] = cells.len() as u32);
            cells.push(Cell { surface, volume_m3, area_m2 });
        }
    }
    (of, cells)
}

/// What is met first when one turns about an edge from a side into the space before it; `same` are the
/// triangles of the body's material.
fn next_side(mesh: &Welded, (t, front): Sheet, (from, to): (u32, u32), same: impl Fn(u32) -> bool) -> Sheet {
    let a = mesh.points[from as usize];
    let along = (mesh.points[to as usize] - a).normalize();
    // Unit vector in the triangle, from the edge inwards.
    let inwards = |t: u32| {
        let corner = mesh.triangles[t as usize].into_iter().find(|v| *v != from && *v != to);
        let d = corner.map_or(DVec3::ZERO, |v| mesh.points[v as usize] - a);
        (d - along * along.dot(d)).normalize_or_zero()
    };
    let normal = |t: u32| {
        let [a, b, c] = mesh.triangles[t as usize].map(|v| mesh.points[v as usize]);
        (b - a).cross(c - a)
    };
    let x = inwards(t);
    let y = normal(t).normalize_or_zero() * if front { 1.0 } else { -1.0 };
    let mut best: (f64, Sheet) = (f64::INFINITY, (t, !front));
    for &(u, _) in &mesh.edges[&(from.min(to), from.max(to))] {
        if u == t {
            continue;
        }
        let d = inwards(u);
        let angle = d.dot(y).atan2(d.dot(x)).rem_euclid(std::f64::consts::TAU);
        let coincident = !(COINCIDENT..std::f64::consts::TAU - COINCIDENT).contains(&angle);
        // Of two that lie on each other the body's own face bounds it.
        let own = (angle - best.0).abs() < COINCIDENT && same(u) && !same(best.1.0);
        let others = (angle - best.0).abs() < COINCIDENT && same(best.1.0);
        if coincident || others || (angle >= best.0 && !own) {
            continue;
        }
        let (sin, cos) = angle.sin_cos();
        best = (angle, (u, normal(u).dot(y * cos - x * sin) < 0.0));
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::frames::Pose;
    use crate::geom::Geometry;
    use crate::geom::faces::Faces;
    use crate::road::reflector::Reflector;
    use crate::scene::{Material, Mesh, Scene, material};

    fn faces_of(mesh: Mesh, materials: &[&str]) -> Faces {
        let mut scene = Scene::default();
        scene.materials.extend(materials.iter().map(|m| material::by_name(m).unwrap()));
        scene.add_mesh("m", "", mesh, Pose::IDENTITY);
        Geometry::build(&scene, 0.0, 77e9).unwrap().find_faces()
    }

    /// A box of 1 x 2 x 3 m with its faces bottom, top, and round; those of `leave` are left out.
    fn cuboid(leave: &[usize], flip: bool) -> Mesh {
        let corner = |i: u32| DVec3::new((i & 1) as f64, 2.0 * (i >> 1 & 1) as f64, 3.0 * (i >> 2) as f64);
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let mut m = Mesh { positions_m: (0..8).map(corner).collect(), ..Default::default() };
        for (_, q) in quads.iter().enumerate().filter(|(i, _)| !leave.contains(i)) {
            let t = [[q[0], q[1], q[2]], [q[0], q[2], q[3]]];
            m.triangles.extend(t.map(|t| if flip { [t[0], t[2], t[1]] } else { t }));
            m.material.extend([0, 0]);
        }
        m
    }

    #[test]
    fn a_box_of_plastic_is_a_body_and_an_open_or_turned_one_is_not() {
        let whole = faces_of(cuboid(&[], false), &["polypropylene"]);
        assert_eq!(whole.cells.len(), 1);
        assert!((whole.cells[0].volume_m3 - 6.0).abs() < 1e-12);
        assert!((whole.cells[0].area_m2 - 22.0).abs() < 1e-12);
        assert!((whole.cells[0].mean_chord_m() - 24.0 / 22.0).abs() < 1e-12);
        assert!(whole.faces.iter().all(|f| f.cell == 0));
        for (mesh, material) in [
            (cuboid(&[1], false), "polypropylene"),
            (cuboid(&[], true), "polypropylene"),
            (cuboid(&[], false), "steel"),
            (cuboid(&[], false), "pec"),
        ] {
            let f = faces_of(mesh, &[material]);
            assert!(f.cells.is_empty() && f.faces.iter().all(|f| f.cell == NO_CELL), "{material}");
        }
    }

    /// Metal closes it whichever way it looks, and also where it goes on beyond the edge or lies on it.
    #[test]
    fn metal_closes_a_body() {
        for flip in [false, true] {
            let mut m = cuboid(&[], false);
            m.material[0..2].fill(1);
            if flip {
                m.triangles[0..2].iter_mut().for_each(|t| t.swap(1, 2));
            }
            let f = faces_of(m.clone(), &["pmma", "pec"]);
            assert_eq!((f.cells.len(), f.cells[0].surface), (1, 0));
            assert!((f.cells[0].volume_m3 - 6.0).abs() < 1e-12);
            assert_eq!(f.faces.iter().filter(|f| f.cell == 0).count(), 5);
            // A sheet that goes on upwards from an edge of the top, and a fin inside.
            let n = m.positions_m.len() as u32;
            m.positions_m.extend([DVec3::new(0.0, 0.0, 4.0), DVec3::new(1.0, 0.0, 4.0)]);
            m.positions_m.push(DVec3::new(0.5, 1.0, 1.0));
            m.triangles.extend([[4, 5, n + 1], [4, n + 1, n], [0, 1, n + 2]]);
            m.material.extend([1, 1, 1]);
            let f = faces_of(m, &["pmma", "pec"]);
            assert_eq!(f.cells.len(), 1);
            assert!((f.cells[0].volume_m3 - 6.0).abs() < 1e-12);
        }
        // Metal on its bottom, corner to corner.
        let mut m = cuboid(&[], false);
        m.triangles.extend([[0, 1, 2], [1, 3, 2]]);
        m.material.extend([1, 1]);
        let f = faces_of(m, &["pmma", "pec"]);
        assert!(f.cells.len() == 1 && (f.cells[0].volume_m3 - 6.0).abs() < 1e-12);
        // The wall of a pit around it, of another dielectric that looks inwards.
        let mut m = cuboid(&[], false);
        m.triangles.extend([[0, 5, 1], [0, 4, 5], [0, 2, 1], [1, 2, 3]]);
        m.material.extend([1; 4]);
        let f = faces_of(m, &["pmma", "asphalt"]);
        assert!(f.cells.len() == 1 && (f.cells[0].volume_m3 - 6.0).abs() < 1e-12);
        // A box of two plastics is none that a wave could be followed in.
        let mut m = cuboid(&[], false);
        m.material[0..2].fill(1);
        assert!(faces_of(m, &["pmma", "polypropylene"]).cells.is_empty());
    }

    #[test]
    fn the_filling_of_a_marker_is_a_body() {
        for (spec, volume) in [
            ("type1:height_m=0.01,length_m=0.05,fill=polypropylene", (0.08 * 0.08 + 0.16 * 0.05) * 0.01),
            (
                "type1:height_m=0.01,length_m=0.05,fill=polypropylene,thickness_m=0.001",
                (0.08 * 0.08 + 0.16 * 0.05) * 0.01,
            ),
            ("type1:height_m=0.01,length_m=0.0,fill=ice,fill_height_m=0.004", 0.08 * 0.08 * 0.004),
            (
                "type1:height_m=0.01,length_m=0.02,fill=ice,fill_height_m=0.014",
                (0.08 * 0.08 + 0.16 * 0.02) * 0.014,
            ),
            (
                "type1:height_m=0.01,length_m=0.02,fill=ice,depth_m=0.01,raise_deg=2",
                (0.08 * 0.08 + 0.16 * 0.02) * 0.01,
            ),
        ] {
            let scene = Reflector::parse(spec).unwrap().to_scene(&material::by_name).unwrap();
            let g = Geometry::build(&scene, 0.0, 77e9).unwrap();
            let f = g.faces();
            assert_eq!(f.cells.len(), 1, "{spec}");
            assert!((f.cells[0].volume_m3 / volume - 1.0).abs() < 1e-9, "{spec}: {}", f.cells[0].volume_m3);
            for face in &f.faces {
                let filling = g.materials[face.surface as usize] != Material::pec();
                assert_eq!(face.cell != NO_CELL, filling, "{spec}");
            }
        }
    }
}
