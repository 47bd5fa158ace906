//! What is done to every mesh that comes from outside: vertices put together, creases found, what has no area left out.

use super::creases::{SMOOTH_DEG, Smoothed, smooth};
use super::weld::weld;
use super::{Mesh, Scene, Shape};
use crate::base::error::{BadInput, Result};
use glam::DVec3;
use rayon::prelude::*;

/// Largest angle between facets of one smooth surface that may be asked for, degrees.
pub const MOST_SMOOTH_DEG: f64 = 60.0;

/// Checks a largest angle between facets of one smooth surface.
///
/// # Errors
/// Returns an error for an angle out of 0 to [`MOST_SMOOTH_DEG`].
pub fn check_smooth_deg(degrees: f64) -> Result<f64> {
    match (0.0..=MOST_SMOOTH_DEG).contains(&degrees) {
        true => Ok(degrees),
        false => Err(BadInput::new("the angle is out of range")
            .key("smooth_deg")
            .value(degrees)
            .allowed(format!("0..={MOST_SMOOTH_DEG}; 0 treats every facet as flat"))
            .into()),
    }
}

/// Welds the vertices of each mesh and decides which of its edges are creases. `smooth_deg` is what somebody has said, else
/// [`SMOOTH_DEG`] holds. A mesh without normals stays flat unless `invents` them or somebody has said the angle.
pub fn tidy(scene: &mut Scene, smooth_deg: Option<f64>, invents: bool) {
    let angle = smooth_deg.unwrap_or(SMOOTH_DEG);
    let invents = invents || smooth_deg.is_some();
    let done: Vec<Tidied> = scene.meshes.par_iter_mut().map(|m| tidied(m, angle, invents)).collect();
    for (i, did) in done.iter().enumerate() {
        scene.import.degenerate_triangles_dropped += did.dropped;
        let owner = scene.objects.iter().find(|o| o.shape == Shape::Mesh(i));
        let Some(name) = owner.map(|o| o.name.clone()) else { continue };
        let lines = did.lines(angle);
        scene.import.notes.extend(lines.into_iter().map(|l| format!("object '{name}': {l}")));
    }
}

struct Tidied {
    welded: usize,
    dropped: usize,
    invented: bool,
    smoothed: Smoothed,
}

impl Tidied {
    fn lines(&self, angle: f64) -> Vec<String> {
        let mut lines = Vec::new();
        if self.welded > 0 {
            lines.push(format!(
                "{} vertices are within a millionth of the object's size of others and were joined to them",
                self.welded
            ));
        }
        if self.invented && self.smoothed.curved > 0 {
            lines.push(format!(
                "{} facets have no normals and are treated as a curved surface, because they turn evenly and by at most {angle} deg (smooth_deg; 0 treats them as flat)",
                self.smoothed.curved
            ));
        }
        if self.smoothed.mended > 0 {
            lines.push(format!(
                "normals of {} corners are means over creases and were computed again from the facets (smooth_deg = {angle})",
                self.smoothed.mended
            ));
        }
        lines
    }
}

fn tidied(mesh: &mut Mesh, smooth_deg: f64, invents: bool) -> Tidied {
    let mut welded_mesh = mesh.clone();
    let welded = weld(&mut welded_mesh);
    let mut dropped = 0;
    if welded > 0 {
        let gone = drop_degenerate(&mut welded_mesh);
        // A thing smaller than the tolerance is left as it is.
        if !welded_mesh.triangles.is_empty() {
            (*mesh, dropped) = (welded_mesh, gone);
        }
    }
    if mesh.normals.iter().all(|n| *n == DVec3::ZERO) {
        mesh.normals.clear();
    }
    let invented = mesh.normals.is_empty();
    let smoothed = match invented && !invents {
        true => Smoothed::default(),
        false => smooth(mesh, smooth_deg),
    };
    drop_flat_normals(mesh);
    drop_unused_vertices(mesh);
    Tidied { welded, dropped, invented, smoothed }
}

/// Drops triangles without area, and tells how many they were.
pub fn drop_degenerate(mesh: &mut Mesh) -> usize {
    let area: Vec<bool> =
        mesh.triangles.iter().map(|t| has_area(t.map(|c| mesh.positions_m[c as usize]))).collect();
    let (mut keep, mut keep_too) = (area.iter(), area.iter());
    mesh.triangles.retain(|_| keep.next() == Some(&true));
    mesh.material.retain(|_| keep_too.next() == Some(&true));
    area.iter().filter(|a| !**a).count()
}

/// Whether a triangle has an area worth the name.
pub fn has_area([a, b, c]: [DVec3; 3]) -> bool {
    let (u, v) = (b - a, c - a);
    let longest = u.length_squared().max(v.length_squared()).max((v - u).length_squared());
    u.cross(v).length() > 1e-12 * longest
}

/// Forgets the normals of a mesh whose facets are all flat: most files have normals, and most of them
/// say only what the facets say.
pub fn drop_flat_normals(mesh: &mut Mesh) {
    /// Cosine of the angle between a facet and the normal at its corner that still counts as flat: the
    /// rounding of single precision, on facets a hundred times longer than wide.
    const FLAT: f64 = 1.0 - 1e-8;
    let flat = |t: usize| {
        let [a, b, c] = mesh.triangles[t].map(|i| mesh.positions_m[i as usize]);
        let facet = (b - a).cross(c - a).normalize_or_zero();
        mesh.corner_normals(t).is_none_or(|n| n.iter().all(|n| n.dot(facet) > FLAT))
    };
    if !mesh.normals.is_empty() && (0..mesh.triangles.len()).all(flat) {
        mesh.normals.clear();
    }
}

/// Forgets vertices that no triangle has.
pub fn drop_unused_vertices(mesh: &mut Mesh) {
    let mut new: Vec<u32> = vec![u32::MAX; mesh.positions_m.len()];
    for c in mesh.triangles.iter().flatten() {
        new[*c as usize] = 0;
    }
    let mut kept = 0;
    for (old, n) in new.iter_mut().enumerate() {
        if *n == 0 {
            mesh.positions_m[kept] = mesh.positions_m[old];
            if !mesh.normals.is_empty() {
                mesh.normals[kept] = mesh.normals[old];
            }
            *n = kept as u32;
            kept += 1;
        }
    }
    mesh.positions_m.truncate(kept);
    mesh.normals.truncate(kept);
    mesh.triangles.iter_mut().flatten().for_each(|c| *c = new[*c as usize]);
}
