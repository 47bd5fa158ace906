//! What a cross section is taken of: a file of a mesh, or a reflector of the library with its parameters.

use super::reflector::{Reflector, kinds};
use crate::error::Result;
use crate::scene::gltf::ImportOptions;
use crate::scene::mesh_file;
use crate::scene::{Scene, material};
use std::path::Path;

/// A target with its name and the direction from which it is meant to be seen.
pub struct Target {
    /// Name of the target.
    pub name: String,
    /// The target as a scene.
    pub scene: Scene,
    /// (azimuth, elevation).
    pub boresight_deg: (f64, f64),
}

/// A target by its name: a file of a mesh, or a reflector as [`Reflector::parse`] reads it ([`is_file`] tells). `options` are those of
/// the file; their default material is also that of a reflector that names none.
///
/// # Errors
/// Those of the importer, of reflectors and of materials.
pub fn load(target: &str, options: &ImportOptions) -> Result<Target> {
    let path = Path::new(target);
    if is_file(target) {
        let scene = mesh_file::import_sized(path, options, mesh_file::OBJECT_M)?;
        return Ok(Target { name: target.into(), scene, boresight_deg: (0.0, 0.0) });
    }
    let mut reflector = Reflector::parse(target)?;
    if let Some(m) = &options.default_material
        && !target.contains("material=")
    {
        reflector.material = m.clone();
    }
    Ok(Target {
        name: reflector.spec(),
        scene: reflector.to_scene(&material::parse_spec)?,
        boresight_deg: reflector.kind().boresight_deg,
    })
}

/// Whether a target is meant as a file: no kind of reflector has its name, and it looks like a file's.
pub fn is_file(target: &str) -> bool {
    let kind = target.split_once(':').map_or(target, |(kind, _)| kind).trim();
    !kinds().iter().any(|k| k.name == kind) && mesh_file::is_file_name(target)
}
