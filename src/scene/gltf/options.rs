//! How a glTF file is to be read, and the limits of what is.

use crate::base::error::{BadInput, Result};
use crate::scene::toml_file::clip;
use glam::{DMat3, DVec3};

/// Which axis of the file points up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Up {
    /// As glTF prescribes: +Z forward, +X left.
    #[default]
    Y,
    /// The file already has ISO 8855 axes: +X forward, +Y left, +Z up.
    Z,
}

impl Up {
    /// Rotation from the file's axes to ISO axes.
    pub fn axes(self) -> DMat3 {
        match self {
            Up::Y => DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X),
            Up::Z => DMat3::IDENTITY,
        }
    }
}

/// Which animations of a file move its nodes.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Animations {
    /// All animations in the order of the file, except those that move what an earlier one moves already.
    #[default]
    All,
    /// Nodes stand where the file puts them.
    None,
    /// The animations of this name; without a name an animation has its number.
    Named(String),
}

impl Animations {
    /// Reads "all", "none" or the name of an animation.
    pub fn from_name(name: &str) -> Animations {
        match name {
            "all" => Animations::All,
            "none" => Animations::None,
            name => Animations::Named(name.into()),
        }
    }
}

/// How to read a glTF file, or another file of a mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportOptions {
    /// Length of the file's unit in metres (glTF prescribes 1).
    pub unit_m: f64,
    /// Somebody has said that unit: no size is then doubted.
    pub unit_given: bool,
    /// Which axis of the file points up.
    pub up: Up,
    /// Somebody has said it.
    pub up_given: bool,
    /// Table name of the material for surfaces without one, or with one that nothing else explains.
    pub default_material: Option<String>,
    /// Pairs (material of the file, material of the table).
    pub material_map: Vec<(String, String)>,
    /// How animations in the file are used.
    pub animations: Animations,
    /// Edges that turn by more are creases, degrees; None where nobody has said it ([`crate::scene::creases`]).
    pub smooth_deg: Option<f64>,
}

impl Default for ImportOptions {
    fn default() -> Self {
        ImportOptions {
            unit_m: 1.0,
            unit_given: false,
            up: Up::Y,
            up_given: false,
            default_material: None,
            material_map: Vec::new(),
            animations: Animations::All,
            smooth_deg: None,
        }
    }
}

impl ImportOptions {
    /// Returns an error for a unit of no sensible length.
    pub(in crate::scene) fn check_unit(&self) -> Result<()> {
        if self.unit_m.is_finite() && (1e-9..=1e6).contains(&self.unit_m) {
            return Ok(());
        }
        Err(BadInput::new("is out of range").key("unit").value(self.unit_m).allowed("1e-9..=1e6 m").into())
    }
}

/// Length in metres of "m", "cm", "mm", "in" or "ft".
///
/// # Errors
/// Returns an error if `name` is none of these.
pub fn unit_m(name: &str) -> Result<f64> {
    const UNITS: [(&str, f64); 5] = [("m", 1.0), ("cm", 0.01), ("mm", 0.001), ("in", 0.0254), ("ft", 0.3048)];
    UNITS.iter().find(|(n, _)| *n == name).map(|(_, m)| *m).ok_or_else(|| {
        BadInput::new("is not a unit of length")
            .key("unit")
            .value(clip(name))
            .allowed(UNITS.map(|(n, _)| n).join(", "))
            .remedy("give the unit of the file's coordinates")
            .into()
    })
}

/// Reads the upward axis "y" or "z".
///
/// # Errors
/// Returns an error if `name` is neither.
pub fn up(name: &str) -> Result<Up> {
    match name {
        "y" | "Y" => Ok(Up::Y),
        "z" | "Z" => Ok(Up::Z),
        _ => Err(BadInput::new("is not an up axis")
            .key("up")
            .value(clip(name))
            .allowed("y, z")
            .remedy("glTF files have y up, CAD files mostly z")
            .into()),
    }
}

/// Larger files, and buffers beside them, are refused before they are read.
pub(super) const MAX_BYTES: u64 = 1 << 36;

/// Vertices and triangles above these are refused: a small file can claim many by repetition.
pub(in crate::scene) const MAX_VERTICES: usize = 50_000_000;

pub(in crate::scene) const MAX_TRIANGLES: usize = 100_000_000;

/// Elements of an accessor that no bytes back.
pub(super) const MAX_UNBACKED: u64 = 1 << 22;

pub(super) const MAX_OBJECTS: usize = 10_000_000;

/// Keys of all animations, and joints of all objects.
pub(super) const MAX_KEYS: usize = 10_000_000;

pub(super) const MAX_JOINTS: usize = 2_000_000;

/// A 3x3 matrix this close to a rotation is one (single-precision rounding of its entries).
pub(super) const RIGID: f64 = 2e-6;

/// Extensions that may be required because they leave positions and names alone.
pub(super) const HARMLESS: [&str; 5] =
    ["KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_punctual", "KHR_xmp_json_ld"];
