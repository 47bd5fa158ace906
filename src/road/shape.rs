//! Small mesh operations that the builders share. All lengths in metres.

use crate::frames::Pose;
use crate::scene::Mesh;
use glam::{DVec2, DVec3};
use std::collections::HashMap;

/// Adds a convex planar polygon as a fan from its first corner. Counter-clockwise seen from the
/// side to which the normal is to point.
pub fn polygon(mesh: &mut Mesh, corners: &[DVec3], material: u32) {
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
    mesh.positions_m.extend(part.positions_m.iter().map(|p| pose.point(*p)));
    mesh.triangles.extend(part.triangles.iter().map(|t| t.map(|i| i + first)));
    mesh.material.extend_from_slice(&part.material);
}

/// Merges vertices at exactly the same place and drops unused ones. Order is kept.
pub fn weld(mesh: Mesh) -> Mesh {
    let mut seen: HashMap<[u64; 3], u32> = HashMap::with_capacity(mesh.positions_m.len());
    let mut positions_m = Vec::new();
    let mut index = |i: u32| {
        // Adding zero turns -0.0 into 0.0.
        let p = mesh.positions_m[i as usize] + DVec3::ZERO;
        *seen.entry(p.to_array().map(f64::to_bits)).or_insert_with(|| {
            positions_m.push(p);
            positions_m.len() as u32 - 1
        })
    };
    let triangles = mesh.triangles.iter().map(|t| t.map(&mut index)).collect();
    Mesh { positions_m, triangles, material: mesh.material }
}

/// A closed box with edges `size_m` along x, y, z, centred at `centre_m`: 12 triangles.
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
pub fn revolve_z(outline: &[DVec2], segments: usize, start: f64, material: u32) -> Mesh {
    let mut mesh = Mesh::default();
    let corner = |p: DVec2, i: usize| {
        let (s, c) = (start + std::f64::consts::TAU * (i % segments) as f64 / segments as f64).sin_cos();
        DVec3::new(p.x * c, p.x * s, p.y)
    };
    for pair in outline.windows(2) {
        let (p, q) = (pair[0], pair[1]);
        for i in 0..segments {
            match (p.x == 0.0, q.x == 0.0) {
                (true, true) => {}
                (true, false) => {
                    polygon(&mut mesh, &[corner(p, i), corner(q, i + 1), corner(q, i)], material)
                }
                (false, true) => {
                    polygon(&mut mesh, &[corner(p, i), corner(p, i + 1), corner(q, i)], material)
                }
                (false, false) => polygon(
                    &mut mesh,
                    &[corner(p, i), corner(p, i + 1), corner(q, i + 1), corner(q, i)],
                    material,
                ),
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
    let welded = weld(mesh.clone());
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
    use crate::frames::{Target, World};

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
        let cone = revolve_z(&[v(0.0, 0.0), v(1.0, 0.0), v(0.0, 3.0)], 4, 0.3, 0);
        assert!(is_watertight(&cone));
        assert!((volume_m3(&cone) - 2.0).abs() < 1e-12);
        let tube = revolve_z(&[v(1.0, -1.0), v(1.0, 1.0)], 6, 0.0, 0);
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
