//! How a command's file of a mesh is to be read.

use catseye::base::error::{BadInput, Error, Result};
use catseye::scene::gltf::{self, ImportOptions};
use catseye::scene::material;
use catseye::scene::tidy;
use clap::Args;

/// How to read a file of a mesh.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Reading a glTF file")]
pub struct ImportArgs {
    /// Radar material for a material name of the file (repeatable); layers with their thickness in metres as
    /// in aluminium+water:0.0005
    #[arg(long = "material", value_name = "NAME=MATERIAL")]
    pub materials: Vec<String>,
    /// Radar material of surfaces without a known material
    #[arg(long, value_name = "MATERIAL")]
    pub default_material: Option<String>,
    /// Unit of the file's coordinates: m, cm, mm, in, ft (required for STL and OBJ). Without it glTF is in m,
    /// and sizes outside 1 mm to 100 m are refused
    #[arg(long)]
    pub unit: Option<String>,
    /// Up axis of the file: y or z (default for glTF: y; required for STL and OBJ)
    #[arg(long)]
    pub up: Option<String>,
    /// Animations of the file that are played: all that do not contradict each other, none, or the name of one
    #[arg(long, value_name = "NAME", default_value = "all")]
    pub animation: String,
    /// Crease angle: edges at which adjacent facets turn by more are creases, degrees; below it smooth
    /// surfaces are detected by the evenness of the turn. 0: every facet is flat. Default 30; a glTF file
    /// without normals is flat
    #[arg(long, value_name = "DEG")]
    pub smooth_deg: Option<f64>,
}

impl ImportArgs {
    pub fn options(&self) -> Result<ImportOptions> {
        let material_map = self
            .materials
            .iter()
            .map(|m| match m.split_once('=') {
                Some((a, b)) => {
                    known("--material", m, b)?;
                    Ok((a.to_string(), b.to_string()))
                }
                None => Err(BadInput::new("expected NAME=MATERIAL").key("--material").value(m).into()),
            })
            .collect::<Result<Vec<_>>>()?;
        if let Some(m) = &self.default_material {
            known("--default-material", m, m)?;
        }
        Ok(ImportOptions {
            unit_m: self.unit.as_deref().map_or(Ok(1.0), gltf::unit_m)?,
            unit_given: self.unit.is_some(),
            up: self.up.as_deref().map_or(Ok(gltf::Up::Y), gltf::up)?,
            up_given: self.up.is_some(),
            default_material: self.default_material.clone(),
            material_map,
            animations: gltf::Animations::from_name(&self.animation),
            smooth_deg: self.smooth_deg.map(smooth_deg).transpose()?,
        })
    }
}

fn smooth_deg(degrees: f64) -> Result<f64> {
    tidy::check_smooth_deg(degrees).map_err(|e| match e {
        Error::Input(b) => b.key("--smooth-deg").into(),
        e => e,
    })
}

/// Errors: an option, given as `value`, names a radar material that does not exist.
fn known(option: &str, value: &str, name: &str) -> Result<()> {
    material::parse_spec(name).map(drop).map_err(|e| match e {
        Error::Input(b) => b.key(option).value(value).into(),
        e => e,
    })
}
