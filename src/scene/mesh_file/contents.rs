//! What a mesh file holds, whatever its format.

use crate::base::error::{BadInput, Result};
use crate::scene::Mesh;
use crate::scene::gltf;
use glam::DVec3;
use std::path::Path;

/// What a file says: parts with their names, and the names of materials, which the parts' triangles count from 0. `Mesh::material` is
/// [`NO_MATERIAL`] for a triangle without one. Positions are in the file's unit and axes.
#[derive(Default)]
pub(super) struct Contents {
    pub(super) parts: Vec<(String, Mesh)>,
    pub(super) materials: Vec<String>,
    pub(super) notes: Vec<String>,
}

pub(super) const NO_MATERIAL: u32 = u32::MAX;

/// The extension in small letters, "" without one.
pub fn extension(path: &Path) -> String {
    path.extension().map_or_else(String::new, |e| e.to_string_lossy().to_ascii_lowercase())
}

/// The name of a part that has none.
pub(super) fn stem(file: &Path) -> String {
    file.file_stem().map_or_else(String::new, |n| n.to_string_lossy().into_owned())
}

/// Three finite numbers from words.
pub(super) fn vector<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<DVec3> {
    let mut next = || words.next()?.parse().ok().filter(|x: &f64| x.is_finite());
    Some(DVec3::new(next()?, next()?, next()?))
}

/// Returns an error for more triangles or vertices than are read.
pub(super) fn check_counts(file: &Path, triangles: usize, vertices: usize) -> Result<()> {
    for (count, most, what) in
        [(triangles, gltf::MAX_TRIANGLES, "triangles"), (vertices, gltf::MAX_VERTICES, "vertices")]
    {
        if count > most {
            return Err(BadInput::new(format!("too many {what}"))
                .file(file)
                .allowed(format!("up to {most} in all"))
                .remedy("split the file")
                .into());
        }
    }
    Ok(())
}
