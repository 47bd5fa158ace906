//! Small mesh operations that the builders share. All lengths in metres.

use crate::base::frames::Pose;
use crate::scene::Mesh;
use glam::{DVec2, DVec3};
use std::collections::HashMap;

/// Adds a convex planar polygon as a fan from its first corner. Counter-clockwise seen from the
/// side to which the normal is to point.
pub fn polygon(mesh: &mut Mesh, corners: &[DVec3], material: u32) {
    fan(mesh, corners, material);
    if !mesh.normals.is_empty() {
        mesh.normals.resize(mesh.positions_m.len(), DVec3::ZERO);
    }
}

/// Adds a facet of a curved surface, with that surface's unit normals at the corners.
pub fn curved_polygon(mesh: &mut Mesh, corners: &[DVec3], normals: &[DVec3], material: u32) {
    mesh.normals.resize(mesh.positions_m.len(), DVec3::ZERO);
    fan(mesh, corners, material);
    mesh.normals.extend_from_slice(normals);
}

fn fan(mesh: &mut Mesh, corners: &[DVec3], material: u32) {
    let first = mesh.positions_m.len() as u32;
    mesh.positions_m.extend_from_slice(corners);
    for i in 1..corners.len().saturating_sub(1) as u32 {
        mesh.triangles.push([first, first + i, first + i + 1]);
        mesh.material.push(material);
    }
}

/// Adds a copy of `part`, moved by `pose`.
pub fn append<A, B>(mesh: &mut Mesh, part: &Mesh, pose: &Pose<A, B>) {
    let first = mesh.positions_m.len() as u32;
    if !part.normals.is_empty() {
        mesh.normals.resize(mesh.positions_m.len(), DVec3::ZERO);
        mesh.normals.extend(part.normals.iter().map(|n| pose.direction(*n)));
    }
    mesh.positions_m.extend(part.positions_m.iter().map(|p| pose.point(*p)));
    if !mesh.normals.is_empty() {
        mesh.normals.resize(mesh.positions_m.len(), DVec3::ZERO);
    }
    mesh.triangles.extend(part.triangles.iter().map(|t| t.map(|i| i + first)));
    mesh.material.extend_from_slice(&part.material);
}

/// Moves a mesh by a rigid motion.
pub fn moved<A, B>(mut mesh: Mesh, pose: &Pose<A, B>) -> Mesh {
    for p in &mut mesh.positions_m {
        *p = pose.point(*p);
    }
    for n in &mut mesh.normals {
        *n = pose.direction(*n);
    }
    mesh
}

/// Merges vertices at exactly the same place with the same normal and drops unused ones. Order is kept.
pub fn weld(mesh: Mesh) -> Mesh {
    let mut seen: HashMap<[u64; 6], u32> = HashMap::with_capacity(mesh.positions_m.len());
    let (mut positions_m, mut normals) = (Vec::new(), Vec::new());
    let mut index = |i: u32| {
        // Adding zero turns -0.0 into 0.0.
        let p = mesh.positions_m[i as usize] + DVec3::ZERO;
        let n = mesh.normals.get(i as usize).copied().unwrap_or(DVec3::ZERO) + DVec3::ZERO;
        *seen.entry([p.x, p.y, p.z, n.x, n.y, n.z].map(f64::to_bits)).or_insert_with(|| {
            positions_m.push(p);
            if !mesh.normals.is_empty() {
                normals.push(n);
            }
            positions_m.len() as u32 - 1
        })
    };
    let triangles = mesh.triangles.iter().map(|t| t.map(&mut index)).collect();
    Mesh { positions_m, triangles, material: mesh.material, normals }
}

/// Gives a sheet the thickness `thickness_m`: the sheet stays where it is as the face of the metal, which
/// grows away from the side to which the normals point. Each vertex moves to where the planes of its
/// facets meet once they are moved back, so that flat plates stay flat and of even thickness.
///
/// The sheet must be orientable, with at most two facets at each edge and no more than three planes at
/// a vertex. None when the metal would fold over itself because a bend is too tight for it.
pub fn thicken(sheet: &Mesh, thickness_m: f64) -> Option<Mesh> {
    let n = sheet.positions_m.len();
    let mut place: HashMap<[u64; 3], usize> = HashMap::with_capacity(n);
    let at: Vec<usize> = (sheet.positions_m.iter().enumerate())
        .map(|(i, p)| *place.entry((*p + DVec3::ZERO).to_array().map(f64::to_bits)).or_insert(i))
        .collect();
    let mut planes: Vec<Vec<DVec3>> = vec![Vec::new(); n];
    for t in 0..sheet.triangles.len() {
        let normal = area_vector_m2(sheet, t).normalize();
        for corner in sheet.triangles[t] {
            let known = &mut planes[at[corner as usize]];
            if known.iter().all(|k| k.cross(normal).length() > 1e-9 || k.dot(normal) < 0.0) {
                known.push(normal);
            }
        }
    }
    let behind: Vec<DVec3> =
        (0..n).map(|i| sheet.positions_m[i] + thickness_m * backwards(&planes[at[i]])).collect();

    let mut solid = sheet.clone();
    let mut edges: HashMap<(usize, usize), (u32, u32)> = HashMap::new();
    let back = n as u32;
    solid.positions_m.extend_from_slice(&behind);
    if !sheet.normals.is_empty() {
        solid.normals.extend(sheet.normals.iter().map(|n| -*n));
    }
    for (t, &[a, b, c]) in sheet.triangles.iter().enumerate() {
        solid.triangles.push([back + a, back + c, back + b]);
        solid.material.push(sheet.material[t]);
        let reversed = area_vector_m2(&solid, solid.triangles.len() - 1);
        if reversed.dot(area_vector_m2(sheet, t)) >= 0.0 {
            return None;
        }
        for (p, q) in [(a, b), (b, c), (c, a)] {
            let (from, to) = (at[p as usize], at[q as usize]);
            if edges.remove(&(to, from)).is_none() {
                edges.insert((from, to), (p, q));
            }
        }
    }
    let mut rim: Vec<(u32, u32)> = edges.into_values().collect();
    rim.sort_unstable();
    let material = sheet.material.first().copied().unwrap_or(0);
    for (a, b) in rim {
        let front = |i: u32| sheet.positions_m[i as usize];
        let far = |i: u32| behind[i as usize];
        polygon(&mut solid, &[front(b), front(a), far(a), far(b)], material);
    }
    Some(solid)
}

/// The shortest step that takes a vertex a unit behind all planes through it.
fn backwards(normals: &[DVec3]) -> DVec3 {
    match normals {
        [] => DVec3::ZERO,
        [n] => -*n,
        [a, b] => -(*a + *b) / (1.0 + a.dot(*b)),
        _ => {
            let mut best = (0.0, DVec3::ZERO);
            for i in 0..normals.len() {
                for j in 0..i {
                    for k in 0..j {
                        let (a, b, c) = (normals[i], normals[j], normals[k]);
                        let det = a.dot(b.cross(c));
                        if det.abs() > f64::abs(best.0) {
                            best = (det, -(a.cross(b) + b.cross(c) + c.cross(a)) / det);
                        }
                    }
                }
            }
            best.1
        }
    }
}

/// A convex polygon of a ground plan, counter-clockwise, with the height of its upper side.
pub struct Terrace {
    /// Corners, m.
    pub corners: Vec<DVec2>,
    /// Height of the upper side, m.
    pub level_m: f64,
}

/// The closed body between z = `base_m` and the levels of a ground plan whose polygons meet corner to
/// corner; fans from their first corners have no empty triangle. Every level lies above the base. Walls are cut at each level, so that edges meet.
pub fn terraces(plan: &[Terrace], base_m: f64, material: u32) -> Mesh {
    let key = |p: DVec2| (p + DVec2::ZERO).to_array().map(f64::to_bits);
    let mut levels: Vec<f64> = plan.iter().map(|c| c.level_m).chain([base_m]).collect();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    let sides = |c: &Terrace| -> Vec<(DVec2, DVec2)> {
        (0..c.corners.len()).map(|i| (c.corners[i], c.corners[(i + 1) % c.corners.len()])).collect()
    };
    let mut beside: HashMap<([u64; 2], [u64; 2]), f64> = HashMap::new();
    for cell in plan {
        for (a, b) in sides(cell) {
            beside.insert((key(a), key(b)), cell.level_m);
        }
    }
    let mut mesh = Mesh::default();
    for cell in plan {
        let at = |z: f64| cell.corners.iter().map(move |p| p.extend(z));
        polygon(&mut mesh, &at(cell.level_m).collect::<Vec<_>>(), material);
        // The same fan from below, so that corners on a straight side stay no fan's tip.
        let first = mesh.positions_m.len() as u32;
        mesh.positions_m.extend(at(base_m));
        for i in 1..cell.corners.len() as u32 - 1 {
            mesh.triangles.push([first, first + i + 1, first + i]);
            mesh.material.push(material);
        }
        for (a, b) in sides(cell) {
            let foot = beside.get(&(key(b), key(a))).copied().unwrap_or(base_m);
            for pair in levels.windows(2).filter(|p| p[0] >= foot && p[1] <= cell.level_m) {
                let (low, high) = (pair[0], pair[1]);
                polygon(&mut mesh, &[a.extend(low), b.extend(low), b.extend(high), a.extend(high)], material);
            }
        }
    }
    weld(mesh)
}

/// A closed box with edges `size_m` along x, y, z, centred at `centre_m`: 12 triangles.
///
/// # Example
/// ```
/// use catseye::road::shape::{area_m2, cuboid, is_watertight, volume_m3};
/// use glam::DVec3;
///
/// let body = cuboid(DVec3::new(4.5, 1.8, 1.5), DVec3::new(0.0, 0.0, 0.75), 0);
/// assert!(is_watertight(&body));
/// assert!((volume_m3(&body) - 4.5 * 1.8 * 1.5).abs() < 1e-12);
/// assert!((area_m2(&body) - 2.0 * (4.5 * 1.8 + 4.5 * 1.5 + 1.8 * 1.5)).abs() < 1e-12);
/// ```
pub fn cuboid(size_m: DVec3, centre_m: DVec3, material: u32) -> Mesh {
    let h = 0.5 * size_m;
    let profile = [(-h.y, -h.z), (h.y, -h.z), (h.y, h.z), (-h.y, h.z)].map(|(y, z)| DVec2::new(y, z));
    let mut mesh = Mesh::default();
    extrude_x(&mut mesh, &profile, (-h.x, h.x), Profile::Closed, material);
    for p in &mut mesh.positions_m {
        *p += centre_m;
    }
    weld(mesh)
}

/// How an outline is swept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Profile {
    /// A sheet along the polyline: where it rises the normal has a positive y.
    Open,
    /// A solid with ends; the outline must be convex and counter-clockwise with y to the right and
    /// z up.
    Closed,
}

/// Sweeps an outline of (y, z) points along x from `x.0` to `x.1` > `x.0`.
pub fn extrude_x(mesh: &mut Mesh, outline: &[DVec2], x: (f64, f64), kind: Profile, material: u32) {
    let at = |x: f64, p: &DVec2| DVec3::new(x, p.x, p.y);
    let n = outline.len();
    let sides = if kind == Profile::Closed { n } else { n - 1 };
    for i in 0..sides {
        let (p, q) = (&outline[i], &outline[(i + 1) % n]);
        polygon(mesh, &[at(x.0, p), at(x.0, q), at(x.1, q), at(x.1, p)], material);
    }
    if kind == Profile::Closed {
        let front: Vec<DVec3> = outline.iter().map(|p| at(x.1, p)).collect();
        let back: Vec<DVec3> = outline.iter().rev().map(|p| at(x.0, p)).collect();
        polygon(mesh, &front, material);
        polygon(mesh, &back, material);
    }
}

/// Turns an outline of (radius, z) points about the z axis in `segments` steps, the first corner at
/// the azimuth `start` (radians). The outline runs so that outside lies to its right, seen with the
/// radius to the right and z up; a point of radius zero becomes the tip of a fan.
///
/// `round` says that the facets stand for a round surface: then all but level rings keep its normals.
pub fn revolve_z(outline: &[DVec2], segments: usize, start: f64, round: bool, material: u32) -> Mesh {
    let mut mesh = Mesh::default();
    let turn = |p: DVec2, i: f64| {
        let (s, c) = (start + std::f64::consts::TAU * i / segments as f64).sin_cos();
        DVec3::new(p.x * c, p.x * s, p.y)
    };
    let corner = |p: DVec2, i: usize| turn(p, (i % segments) as f64);
    for pair in outline.windows(2) {
        let (p, q) = (pair[0], pair[1]);
        if p.x == 0.0 && q.x == 0.0 {
            continue;
        }
        let outward = DVec2::new(q.y - p.y, p.x - q.x).normalize_or_zero();
        for i in 0..segments {
            // A tip has no normal of its own: the one in the middle of its facet.
            let tip = |p: DVec2| turn(outward, i as f64 + if p.x == 0.0 { 0.5 } else { 0.0 });
            let next = |p: DVec2| if p.x == 0.0 { tip(p) } else { corner(outward, i + 1) };
            let mut corners = vec![(corner(p, i), tip(p))];
            if p.x != 0.0 {
                corners.push((corner(p, i + 1), next(p)));
            }
            if q.x != 0.0 {
                corners.push((corner(q, i + 1), next(q)));
            }
            corners.push((corner(q, i), tip(q)));
            let (places, normals): (Vec<DVec3>, Vec<DVec3>) = corners.into_iter().unzip();
            match round && p.y != q.y {
                true => curved_polygon(&mut mesh, &places, &normals, material),
                false => polygon(&mut mesh, &places, material),
            }
        }
    }
    weld(mesh)
}

/// Area of a triangle times its unit normal, m².
pub fn area_vector_m2(mesh: &Mesh, triangle: usize) -> DVec3 {
    let [a, b, c] = mesh.triangles[triangle].map(|i| mesh.positions_m[i as usize]);
    0.5 * (b - a).cross(c - a)
}

/// Sum of the areas of all triangles, m².
pub fn area_m2(mesh: &Mesh) -> f64 {
    (0..mesh.triangles.len()).map(|t| area_vector_m2(mesh, t).length()).sum()
}

/// Enclosed volume of a closed mesh, m³; positive when its normals point outwards.
pub fn volume_m3(mesh: &Mesh) -> f64 {
    mesh.triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|i| mesh.positions_m[i as usize]);
            a.dot(b.cross(c)) / 6.0
        })
        .sum()
}

/// True when each directed edge is met exactly once in each direction (after welding), so that the
/// mesh bounds a volume.
pub fn is_watertight(mesh: &Mesh) -> bool {
    let welded = weld(Mesh { normals: Vec::new(), ..mesh.clone() });
    let mut edges: HashMap<(u32, u32), i32> = HashMap::new();
    for t in &welded.triangles {
        for i in 0..3 {
            *edges.entry((t[i], t[(i + 1) % 3])).or_default() += 1;
        }
    }
    !edges.is_empty() && edges.iter().all(|(&(a, b), &n)| n == 1 && edges.get(&(b, a)) == Some(&1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::frames::{Target, World};

    #[test]
    fn cuboid_is_closed_and_outward() {
        let m = cuboid(DVec3::new(2.0, 3.0, 4.0), DVec3::new(10.0, -5.0, 1.0), 7);
        assert_eq!((m.triangles.len(), m.positions_m.len()), (12, 8));
        assert!(is_watertight(&m));
        assert!((volume_m3(&m) - 24.0).abs() < 1e-12);
        assert!((area_m2(&m) - 52.0).abs() < 1e-12);
        assert!(m.material.iter().all(|&i| i == 7));
        for t in 0..12 {
            let centre = m.triangles[t].iter().map(|&i| m.positions_m[i as usize]).sum::<DVec3>() / 3.0
                - DVec3::new(10.0, -5.0, 1.0);
            assert!(area_vector_m2(&m, t).dot(centre) > 0.0);
        }
    }

    #[test]
    fn watertight_notices_a_hole_and_a_flipped_face() {
        let mut holed = cuboid(DVec3::ONE, DVec3::ZERO, 0);
        holed.triangles.pop();
        assert!(!is_watertight(&holed));
        let mut flipped = cuboid(DVec3::ONE, DVec3::ZERO, 0);
        flipped.triangles[3].swap(0, 1);
        assert!(!is_watertight(&flipped));
        assert!(!is_watertight(&Mesh::default()));
    }

    #[test]
    fn revolved_cone_and_tube() {
        let v = |r, z| DVec2::new(r, z);
        // A cone of a square base: volume = base * height / 3.
        let cone = revolve_z(&[v(0.0, 0.0), v(1.0, 0.0), v(0.0, 3.0)], 4, 0.3, false, 0);
        assert!(is_watertight(&cone));
        assert!((volume_m3(&cone) - 2.0).abs() < 1e-12);
        let tube = revolve_z(&[v(1.0, -1.0), v(1.0, 1.0)], 6, 0.0, true, 0);
        assert_eq!(tube.triangles.len(), 12);
        assert!(!is_watertight(&tube));
    }

    #[test]
    fn append_moves_and_renumbers() {
        let unit = cuboid(DVec3::ONE, DVec3::ZERO, 1);
        let mut both = unit.clone();
        let pose = Pose::<Target, World>::from_yaw_pitch_roll(DVec3::new(5.0, 0.0, 0.0), 0.4, 0.0, 0.0);
        append(&mut both, &unit, &pose);
        assert!(is_watertight(&both) && (volume_m3(&both) - 2.0).abs() < 1e-12);
    }
}
