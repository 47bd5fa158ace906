//! What a cross section is taken of: a glTF file, or a reflector of the library with its parameters.

use super::reflector::Reflector;
use crate::error::Result;
use crate::scene::gltf::{self, ImportOptions};
use crate::scene::{Scene, material};
use std::path::Path;

/// A target with its name and the direction from which it is meant to be seen.
pub struct Target {
    pub name: String,
    pub scene: Scene,
    /// (azimuth, elevation).
    pub boresight_deg: (f64, f64),
}

/// A target by its name: a path ends in .glb or .gltf, everything else is a reflector as [`Reflector::parse`] reads it. `options` are
/// those of the file; their default material is also that of a reflector that names none.
///
/// Errors: those of the importer, of reflectors and of materials.
pub fn load(target: &str, options: &ImportOptions) -> Result<Target> {
    let path = Path::new(target);
    let is_file = path
        .extension()
        .and_then(|e| e.to_str())
        .is_some_and(|e| e.eq_ignore_ascii_case("glb") || e.eq_ignore_ascii_case("gltf"));
    if is_file || path.is_dir() {
        let scene = gltf::import_sized(path, options, gltf::OBJECT_M)?;
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
