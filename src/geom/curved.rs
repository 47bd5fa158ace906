//! Curved surfaces for exact beams: facets with smooth normals are cut finer until their edges bend by no
//! more than is asked for (CONVENTIONS eq. 55-57).
//!
//! Whether and where an edge is cut depends on nothing but what meets in the edge, so that neighbours agree
//! and no crack opens. Neighbours that share places and normals at both ends of their edge are one smooth
//! surface; where the normals differ the edge is a crease, and stays one: its new points lie on both
//! surfaces. Facets that are flat and touch a curved one are cut in their plane.

use super::coarser::coarser;
use super::smooth::{Arc, Surface, is_curved};
pub use super::smooth::{Limit, MOST_FACETS};
use crate::base::error::{BadInput, Error, Result};
use crate::base::tasks::Tasks;
use crate::scene::{Mesh, Scene, Shape};
use glam::DVec3;
use rayon::prelude::*;
use std::borrow::Cow;

/// Greatest phase 2 k s, rad, of an edge with sagitta s for an error of 0.1 dB: what the worst of 50 directions
/// has on spheres of ka 40 to 160. Facets are a grating, whose orders interfere with the echo to first order in
/// this phase.
const TAU_AT_TENTH_DB: f64 = 0.025;
/// Greatest sagitta of an edge, m, for an error of `accuracy_db`, which goes with it (CONVENTIONS eq. 56).
pub fn sagitta_m(accuracy_db: f64, wavenumber: f64) -> f64 {
    TAU_AT_TENTH_DB * accuracy_db / 0.1 / (2.0 * wavenumber)
}

/// The scene with its curved meshes cut as far as facets whose bend is part of their echoes have to be at `accuracy_db`, with their
/// corners on the surface. Where that gives more triangles than `most` and than the scene has they are made coarser, or left as they are.
///
/// # Errors
/// Returns the errors of [`refined`], except that too many facets are no error.
pub fn sized_within(scene: &Scene, accuracy_db: f64, wavenumber: f64, most: usize) -> Result<Cow<'_, Scene>> {
    scene_of(scene, |mesh| check_normals(mesh).map(|()| None))?;
    let most = most.max(scene.triangle_count());
    for times in 0..COARSER {
        let limit = Limit::curved(accuracy_db, wavenumber).coarser(times);
        // Normals that belong to no surface may ask for more facets than there can be.
        let Ok(sized) = scene_of(scene, |mesh| sized_below(mesh, limit, most)) else { continue };
        if sized.triangle_count() <= most {
            return Ok(sized);
        }
    }
    Ok(Cow::Borrowed(scene))
}

/// Times that facets are made twice as coarse before they are left as they are.
const COARSER: i32 = 3;

/// The scene with its curved meshes cut until no edge bends by more than `sagitta_m`, and moved to the mean
/// height of the surface. A scene without curved facets comes back as it is.
///
/// # Errors
/// Returns the errors of [`refined`].
pub fn refined_scene(scene: &Scene, sagitta_m: f64) -> Result<Cow<'_, Scene>> {
    scene_of(scene, |mesh| refined(mesh, sagitta_m))
}

/// Largest sagitta of an edge of a curved facet, m; 0 without one.
pub fn largest_sagitta_m(scene: &Scene) -> f64 {
    let of_facet = |mesh: &Mesh, t: usize| {
        let normals = mesh.corner_normals(t).filter(|_| is_curved(mesh, t))?;
        let corners = mesh.triangles[t].map(|i| mesh.positions_m[i as usize]);
        let arc = |k: usize| Arc::new(corners[(k + 1) % 3] - corners[k], [normals[k], normals[(k + 1) % 3]]);
        Some((0..3).map(|k| arc(k).sagitta).fold(0.0, f64::max))
    };
    let of_mesh =
        |mesh: &Mesh| (0..mesh.triangles.len()).filter_map(|t| of_facet(mesh, t)).fold(0.0, f64::max);
    scene.meshes.iter().map(of_mesh).fold(0.0, f64::max)
}

/// The scene with those of its meshes made anew for which `made` gives another one.
fn scene_of(scene: &Scene, made: impl Fn(&Mesh) -> Result<Option<Mesh>> + Sync) -> Result<Cow<'_, Scene>> {
    let named = |i: usize, e| match e {
        Error::Input(bad) => {
            let owner = scene.objects.iter().find(|o| o.shape == Shape::Mesh(i));
            let name = owner.map_or(format!("mesh {i}"), |o| format!("object '{}'", o.name));
            bad.key(name).into()
        }
        e => e,
    };
    let one = |(i, mesh): (usize, &Mesh)| match made(mesh) {
        Ok(mesh) => Ok(mesh.map(|m| (i, m))),
        Err(e) => Err(named(i, e)),
    };
    let made: Vec<Result<Option<(usize, Mesh)>>> =
        scene.meshes.par_iter().enumerate().map_tasks(one).collect();
    let mut new = Vec::new();
    for mesh in made {
        new.extend(mesh?);
    }
    if new.is_empty() {
        return Ok(Cow::Borrowed(scene));
    }
    let mut scene = scene.clone();
    for (i, mesh) in new {
        scene.meshes[i] = mesh;
    }
    Ok(Cow::Owned(scene))
}

/// The mesh cut until no edge bends by more than `sagitta_m`; None when no facet is curved.
///
/// A facet is curved when its three corners have normals, not all of them its own, and each within 45
/// degrees of it (or each within 45 degrees of its back); else it is flat.
///
/// # Errors
/// Returns an error for another number of normals than of positions, for a normal that is neither a unit vector nor
/// zero, or for more than [`MOST_FACETS`] facets.
pub fn refined(mesh: &Mesh, sagitta_m: f64) -> Result<Option<Mesh>> {
    let limit = Limit::flat(sagitta_m);
    let Some(mut surface) = surface(mesh)? else { return Ok(None) };
    surface.cut_to(limit, MOST_FACETS)?;
    surface.raise_to_mean_height();
    Ok(Some(surface.into_mesh()))
}

/// The mesh with its curved facets joined and cut until no edge bends by more than `limit` allows and none could be longer, its corners
/// on the surface; None when no facet is curved.
///
/// # Errors
/// Returns the errors of [`refined`].
pub fn sized(mesh: &Mesh, limit: Limit) -> Result<Option<Mesh>> {
    sized_below(mesh, limit, MOST_FACETS)
}

/// The same with another number of facets that are too many.
fn sized_below(mesh: &Mesh, limit: Limit, most: usize) -> Result<Option<Mesh>> {
    let Some(surface) = surface(mesh)? else { return Ok(None) };
    let mut surface = coarser(surface, limit);
    surface.cut_to(limit, most)?;
    Ok(Some(surface.into_mesh()))
}

/// None when no facet is curved.
fn surface(mesh: &Mesh) -> Result<Option<Surface>> {
    if mesh.normals.is_empty() {
        return Ok(None);
    }
    check_normals(mesh)?;
    let curved: Vec<bool> = (0..mesh.triangles.len()).map(|t| is_curved(mesh, t)).collect();
    if !curved.contains(&true) {
        return Ok(None);
    }
    Ok(Some(Surface::new(mesh, &curved)))
}

fn check_normals(mesh: &Mesh) -> Result<()> {
    if mesh.normals.is_empty() {
        return Ok(());
    }
    if mesh.normals.len() != mesh.positions_m.len() {
        return Err(BadInput::new("not every vertex has a normal")
            .value(format!("{} normals", mesh.normals.len()))
            .allowed(format!("none, or {}, one for each vertex", mesh.positions_m.len()))
            .remedy("repair the mesh")
            .into());
    }
    let unit = |n: &DVec3| *n == DVec3::ZERO || (n.length_squared() - 1.0).abs() < 2e-3;
    if let Some(bad) = mesh.normals.iter().position(|n| !unit(n)) {
        return Err(BadInput::new(format!("the normal of vertex {bad} has no direction"))
            .value(mesh.normals[bad])
            .allowed("a unit vector, or zero where the facets are flat")
            .remedy("repair the mesh")
            .into());
    }
    Ok(())
}

/// Whether any facet of the mesh is curved, as [`refined`] has it.
pub fn has_curved(mesh: &Mesh) -> bool {
    !mesh.normals.is_empty() && (0..mesh.triangles.len()).any(|t| is_curved(mesh, t))
}
