//! What a command is pointed at: a glTF file, or a reflector of the library with its parameters.

use crate::error::{BadInput, Result};
use crate::road::reflector::Reflector;
use crate::scene::gltf::{self, ImportOptions};
use crate::scene::{Scene, material};
use clap::Args;
use std::path::Path;

/// How to read a glTF file.
#[derive(Debug, Clone, Args)]
pub struct ImportArgs {
    /// Radar material for a material name of the file (may be given several times); layers of so many metres
    /// on it as in aluminium+water:0.0005
    #[arg(long = "material", value_name = "NAME=MATERIAL")]
    pub materials: Vec<String>,
    /// Radar material for everything that has none
    #[arg(long, value_name = "MATERIAL")]
    pub default_material: Option<String>,
    /// Unit of the file's coordinates: m, cm, mm, in, ft
    #[arg(long, default_value = "m")]
    pub unit: String,
    /// The file's up axis: y or z
    #[arg(long, default_value = "y")]
    pub up: String,
    /// Which of the file's animations move it: all that do not contradict each other, none, or one by its name
    #[arg(long, value_name = "NAME", default_value = "all")]
    pub animation: String,
}

impl ImportArgs {
    pub fn options(&self) -> Result<ImportOptions> {
        let material_map = self
            .materials
            .iter()
            .map(|m| match m.split_once('=') {
                Some((a, b)) => {
                    material::parse_spec(b)?;
                    Ok((a.to_string(), b.to_string()))
                }
                None => Err(BadInput::new("expected NAME=MATERIAL").key("--material").value(m).into()),
            })
            .collect::<Result<Vec<_>>>()?;
        if let Some(m) = &self.default_material {
            material::parse_spec(m)?;
        }
        Ok(ImportOptions {
            unit_m: gltf::unit_m(&self.unit)?,
            up: gltf::up(&self.up)?,
            default_material: self.default_material.clone(),
            material_map,
            animations: gltf::Animations::from_name(&self.animation),
        })
    }
}

/// A target with its name and the direction from which it is meant to be seen.
pub struct Target {
    pub name: String,
    pub scene: Scene,
    /// (azimuth, elevation).
    pub boresight_deg: (f64, f64),
}

/// Reads TARGET. A path ends in .glb or .gltf; everything else is a KIND.
pub fn load(target: &str, import: &ImportArgs) -> Result<Target> {
    let path = Path::new(target);
    let is_file = path
        .extension()
        .and_then(|e| e.to_str())
        .is_some_and(|e| e.eq_ignore_ascii_case("glb") || e.eq_ignore_ascii_case("gltf"));
    let options = import.options()?;
    if is_file || path.is_dir() {
        let scene = gltf::import(path, &options)?;
        return Ok(Target { name: target.into(), scene, boresight_deg: (0.0, 0.0) });
    }
    let mut reflector = Reflector::parse(target)?;
    if let Some(m) = &import.default_material
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
