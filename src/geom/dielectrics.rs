//! Bodies of dielectrics that waves pass, before anything is traced: whether they are closed, and whether they are curved, since waves inside
//! curved bodies are not followed.

use super::cells::{self, NO_CELL};
use super::smooth::is_curved;
use super::surface::Surface;
use super::triangle::Triangle;
use super::welded::{Welded, sides, weld};
use crate::base::frames::Pose;
use crate::em::layers::Backing;
use crate::scene::{Mesh, Scene, Shape};
use glam::DVec3;
use std::borrow::Cow;
use std::collections::BTreeMap;

/// A body whose mean chord weakens a wave by more than this, Np (60 dB), is opaque.
pub const OPAQUE_NP: f64 = 6.907755278982137;
/// Facets of a body count as flat for waves inside it where the surface turns by less over the body's mean chord, rad.
const FLAT_RAD: f64 = 0.2;
/// What is open and faces one way with more than this share of its area is a sheet and no body.
const SHEET: f64 = 0.5;
/// Corners of a sphere are as far from its centre within this share of its radius: f32 of files.
const ROUND: f64 = 1e-5;

/// What stands in the way of waves that would enter a body.
#[derive(Debug, Clone, PartialEq)]
pub enum Obstacle {
    /// The body is not closed, and counts as opaque.
    Open {
        /// Triangles that bound no volume.
        triangles: usize,
        /// Edges of the body that have one facet only.
        edges: usize,
        /// Ends of the longest of them, in the object's frame, m.
        hole_m: Option<[DVec3; 2]>,
        /// It encloses nothing: a sheet, such as a road.
        is_sheet: bool,
    },
    /// The body has thin curved walls, which are taken as the flat facets that they have.
    Walls {
        /// Angle by which its surface turns over its mean chord, rad.
        turn_rad: f64,
    },
    /// The body is curved.
    Curved {
        /// Angle by which its surface turns over its mean chord, rad.
        turn_rad: f64,
        /// Its centre in the object's frame and its radius, m, where it is a whole sphere.
        sphere_m: Option<(DVec3, f64)>,
    },
}

/// A body of an object with what stands in the way of waves.
#[derive(Debug, Clone, PartialEq)]
pub struct Doubt {
    /// Index of the object in the scene.
    pub object: usize,
    /// Index of the body's material in the scene.
    pub material: u32,
    /// The obstacle.
    pub obstacle: Obstacle,
}

impl Doubt {
    /// One line without the object's name.
    pub fn line(&self, scene: &Scene) -> String {
        let material = scene.materials.get(self.material as usize).map_or("", |m| m.name.as_str());
        match &self.obstacle {
            Obstacle::Open { is_sheet: true, .. } => format!(
                "the sheet of '{material}' has no thickness and is treated as the surface of a half-space, which transmits nothing; give it \
                 a thickness as a layer on 'air', or model it as a closed body"
            ),
            Obstacle::Open { triangles, edges, hole_m, .. } => {
                let place = |p: &DVec3| format!("({:.6}, {:.6}, {:.6})", p.x, p.y, p.z);
                let hole = match hole_m {
                    Some([a, b]) => format!(
                        "{edges} of its edges have one facet only, the longest from {} to {} m",
                        place(a),
                        place(b)
                    ),
                    None => "it has no open edge, but facets have opposite orientations or cross".to_string(),
                };
                format!(
                    "the body of '{material}' is not closed, so no wave enters it and its {triangles} \
                     triangles are treated as opaque: {hole}; close it, or model a thin wall as a sheet (a \
                     layer of '{material}' on air)"
                )
            }
            Obstacle::Walls { turn_rad } => format!(
                "the curved walls of '{material}' are treated as the flat facets of the mesh (they turn by {:.1} deg over their mean \
                 chord): transmission is correct, but their own reflection is that of the facets",
                turn_rad.to_degrees()
            ),
            Obstacle::Curved { turn_rad, .. } => format!(
                "the body of '{material}' is curved, by {:.0} deg over its mean chord: waves inside curved bodies are not traced",
                turn_rad.to_degrees()
            ),
        }
    }
}

/// Obstacles of all objects that the radar sees, at the frequency of `surfaces` (one for each material). Bodies that waves do not pass
/// have none.
pub fn doubts(scene: &Scene, surfaces: &[Surface], wavenumber: f64) -> Vec<Doubt> {
    let enters: Vec<bool> = (scene.materials.iter().zip(surfaces))
        .map(|(m, s)| m.is_dielectric() && matches!(s.stack.backing, Backing::HalfSpace(_)))
        .collect();
    let mut of_mesh: Vec<Option<Vec<(u32, Obstacle)>>> = vec![None; scene.meshes.len()];
    let mut out = Vec::new();
    for (object, o) in scene.objects.iter().enumerate().filter(|(_, o)| o.radar) {
        let Shape::Mesh(m) = o.shape else { continue };
        let list = of_mesh[m].get_or_insert_with(|| in_mesh(&scene.meshes[m], &enters, surfaces, wavenumber));
        out.extend(list.iter().map(|(material, obstacle)| Doubt {
            object,
            material: *material,
            obstacle: obstacle.clone(),
        }));
    }
    out
}

/// Whether the scene is one whole sphere that waves enter, and nothing else: its centre and radius in the world, m, and its material.
pub fn lone_sphere(scene: &Scene, doubts: &[Doubt]) -> Option<(DVec3, f64, u32)> {
    let [Doubt { object, material, obstacle: Obstacle::Curved { sphere_m: Some((centre, radius_m)), .. } }] =
        doubts
    else {
        return None;
    };
    let seen = scene.objects.iter().filter(|o| o.radar).count();
    let o = &scene.objects[*object];
    let Shape::Mesh(m) = o.shape else { return None };
    // All of the mesh is that sphere.
    let whole = scene.meshes[m].positions_m.iter().all(|p| is_on(*p, *centre, *radius_m));
    let pose: &Pose<_, _> = &o.pose;
    (seen == 1 && whole).then(|| (pose.point(*centre), *radius_m, *material))
}

/// The scene with thin curved walls as flat facets: cut more finely they would have more faces, and pass the same.
pub fn with_flat_walls<'a>(scene: &'a Scene, doubts: &[Doubt]) -> Cow<'a, Scene> {
    let walls: Vec<&Doubt> = doubts.iter().filter(|d| matches!(d.obstacle, Obstacle::Walls { .. })).collect();
    if walls.is_empty() {
        return Cow::Borrowed(scene);
    }
    let mut new = scene.clone();
    for d in walls {
        let Shape::Mesh(m) = scene.objects[d.object].shape else { continue };
        let mesh = &mut new.meshes[m];
        for t in (0..mesh.triangles.len()).filter(|t| scene.meshes[m].material[*t] == d.material) {
            let first = mesh.positions_m.len() as u32;
            let places = mesh.triangles[t].map(|i| mesh.positions_m[i as usize]);
            mesh.positions_m.extend(places);
            mesh.normals.extend([DVec3::ZERO; 3]);
            mesh.triangles[t] = [first, first + 1, first + 2];
        }
    }
    Cow::Owned(new)
}

fn is_on(p: DVec3, centre: DVec3, radius_m: f64) -> bool {
    (p.distance(centre) - radius_m).abs() <= ROUND * radius_m
}

fn decay_np_per_m(surface: &Surface, wavenumber: f64) -> Option<f64> {
    match surface.stack.backing {
        Backing::HalfSpace(eps) => Some(wavenumber * eps.sqrt().im.abs()),
        _ => None,
    }
}

fn in_mesh(mesh: &Mesh, enters: &[bool], surfaces: &[Surface], wavenumber: f64) -> Vec<(u32, Obstacle)> {
    let dielectric = |m: u32| enters.get(m as usize).copied().unwrap_or(false);
    if !mesh.material.iter().any(|m| dielectric(*m)) {
        return Vec::new();
    }
    let (mut corners, mut triangles, mut number) = (Vec::new(), Vec::new(), Vec::new());
    for (t, (abc, material)) in mesh.triangles.iter().zip(&mesh.material).enumerate() {
        let places = abc.map(|i| mesh.positions_m[i as usize]);
        if let Some(triangle) = Triangle::new(places, 0, 0, *material) {
            corners.push(places);
            triangles.push(triangle);
            number.push(t);
        }
    }
    let (points, welded) = weld(&corners);
    let welded = Welded::new(&triangles, &points, &welded);
    let (mut of, found) = cells::find(enters, &welded);
    of.resize(triangles.len(), NO_CELL);
    let mut out = Vec::new();
    for (cell, body) in found.iter().enumerate() {
        let decay = surfaces.get(body.surface as usize).and_then(|s| decay_np_per_m(s, wavenumber));
        let chord_m = body.mean_chord_m();
        if decay.is_none_or(|d| d * chord_m >= OPAQUE_NP) {
            continue;
        }
        let own: Vec<usize> = (0..of.len()).filter(|t| of[*t] == cell as u32).map(|t| number[t]).collect();
        let per_m = own.iter().map(|t| curvature_per_m(mesh, *t)).fold(0.0, f64::max);
        let turn_rad = per_m * chord_m;
        if turn_rad > FLAT_RAD {
            out.push((body.surface, Obstacle::Curved { turn_rad, sphere_m: sphere(mesh, &own, body) }));
        } else if turn_rad > 0.0 {
            out.push((body.surface, Obstacle::Walls { turn_rad }));
        }
    }
    let unbound = (0..of.len()).filter(|t| of[*t] == NO_CELL).map(|t| triangles[t].surface);
    let mut counts: BTreeMap<u32, usize> = BTreeMap::new();
    unbound.filter(|m| dielectric(*m)).for_each(|m| *counts.entry(m).or_default() += 1);
    for (material, triangles_open) in counts {
        let open = |t: u32| of[t as usize] == NO_CELL && triangles[t as usize].surface == material;
        let (mut lo, mut hi) = (DVec3::MAX, DVec3::MIN);
        for p in (0..of.len() as u32).filter(|t| open(*t)).flat_map(|t| triangles[t as usize].corners()) {
            (lo, hi) = (lo.min(p), hi.max(p));
        }
        let decay = surfaces.get(material as usize).and_then(|s| decay_np_per_m(s, wavenumber));
        if decay.is_none_or(|d| d * 0.5 * (hi - lo).length() >= OPAQUE_NP) {
            continue;
        }
        let (mut edges, mut longest) = (0, None::<[DVec3; 2]>);
        let (mut facing, mut area_m2) = (DVec3::ZERO, 0.0);
        for t in (0..of.len() as u32).filter(|t| open(*t)) {
            let [a, b, c] = triangles[t as usize].corners();
            let doubled = (b - a).cross(c - a);
            (facing, area_m2) = (facing + doubled, area_m2 + doubled.length());
        }
        for t in (0..of.len() as u32).filter(|t| open(*t)) {
            for (a, b) in sides(&welded.triangles[t as usize]) {
                if welded.edges[&(a.min(b), a.max(b))].len() != 1 {
                    continue;
                }
                edges += 1;
                let ends = [a, b].map(|i| points[i as usize]);
                if longest.is_none_or(|[p, q]| ends[0].distance(ends[1]) > p.distance(q)) {
                    longest = Some(ends);
                }
            }
        }
        // The areas of a closed body face all ways, unless facets are wound against each other: a sheet has an edge.
        let is_sheet = edges > 0 && facing.length() > SHEET * area_m2;
        out.push((material, Obstacle::Open { triangles: triangles_open, edges, hole_m: longest, is_sheet }));
    }
    out
}

/// Largest curvature of the surface along the sides of a facet, 1/m; 0 where it is flat.
fn curvature_per_m(mesh: &Mesh, t: usize) -> f64 {
    if !is_curved(mesh, t) {
        return 0.0;
    }
    let Some(normals) = mesh.corner_normals(t) else { return 0.0 };
    let corners = mesh.triangles[t].map(|i| mesh.positions_m[i as usize]);
    (0..3)
        .map(|k| {
            let (chord, turn) = (corners[(k + 1) % 3] - corners[k], normals[(k + 1) % 3] - normals[k]);
            turn.dot(chord).abs() / chord.length_squared()
        })
        .fold(0.0, f64::max)
}

/// Centre and radius of the sphere that all facets of a body lie on.
fn sphere(mesh: &Mesh, facets: &[usize], body: &cells::Cell) -> Option<(DVec3, f64)> {
    let places = || facets.iter().flat_map(|t| mesh.triangles[*t]).map(|i| mesh.positions_m[i as usize]);
    if facets.iter().any(|t| !is_curved(mesh, *t)) {
        return None;
    }
    let (lo, hi) = places().fold((DVec3::MAX, DVec3::MIN), |(lo, hi), p| (lo.min(p), hi.max(p)));
    // The centre from four corners that span most: least squares over all would say the same of a sphere.
    let centre = centre_of(&places().collect::<Vec<_>>())?;
    let radius_m = places().map(|p| p.distance(centre)).sum::<f64>() / (3 * facets.len()) as f64;
    let round = places().all(|p| is_on(p, centre, radius_m));
    // A shell has two such surfaces, and a cap not all of one.
    let whole = body.area_m2 > 0.5 * 4.0 * std::f64::consts::PI * radius_m * radius_m
        && (hi - lo).min_element() > 1.5 * radius_m;
    (round && whole).then_some((centre, radius_m))
}

/// Centre of the sphere through places that lie on one, by least squares.
fn centre_of(places: &[DVec3]) -> Option<DVec3> {
    let mean = places.iter().sum::<DVec3>() / places.len().max(1) as f64;
    // |p|^2 = 2 p . c + const, about the mean.
    let (mut m, mut r) = (glam::DMat3::ZERO, DVec3::ZERO);
    let square =
        places.iter().map(|p| (*p - mean).length_squared()).sum::<f64>() / places.len().max(1) as f64;
    for p in places.iter().map(|p| *p - mean) {
        m += glam::DMat3::from_cols(p * p.x, p * p.y, p * p.z);
        r += p * (0.5 * (p.length_squared() - square));
    }
    (m.determinant() != 0.0).then(|| mean + m.inverse() * r)
}
