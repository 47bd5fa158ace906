//! glTF 2.0 import and export. This is the one place where axes change: x (forward) = glTF +Z,
//! y (left) = glTF +X, z (up) = glTF +Y, and back.
//!
//! A node with a mesh becomes an object. Rotation and translation become its pose; scale, shear and
//! mirroring are baked into a copy of the mesh (a mirror turns the winding round). Nodes that share a
//! mesh, and the instances of EXT_mesh_gpu_instancing, share a [`Mesh`].
//!
//! `extras.catseye` of a node: `class`; `velocity_mps` [forward, left, up] in the world, in these ISO
//! axes and not in glTF's; both hold for the nodes below as well. `id` (1 or more, unique) and
//! `rcs_dbsm`, which makes a node without a mesh a point target. `rcs_table`, the path of an RCS table (CSV)
//! in or below the glTF file's folder: the node scatters as the table says, with x, y and z of its target frame along
//! the node's ISO axes, and its mesh, if it has one, does not scatter. Such a node may not be scaled.
//!
//! Animated nodes move what hangs on them (CONVENTIONS eq. 140): a hierarchy becomes a chain of rigid joints in which each
//! animated node is a track with its keys as they are (STEP, LINEAR, CUBICSPLINE); before its first key and after its last
//! it stands still, or starts again after the animation's last key with `{"repeat": true}` in the animation's
//! `extras.catseye`. A `velocity_mps` comes on top. Scales have to stay as they are, and be the same in all directions
//! above a node that turns. Time zero of a scene is that of its animations. [`Animations`] says which are taken. Skins are
//! cut into rigid parts (`skin.rs`), one object for each with the name `mesh/joint`; morph targets are left out.
//!
//! `motion` in `extras.catseye` of a node is a list of joints from the body outwards, in ISO axes, metres, seconds
//! and radians (`joints.rs`), which takes the place of the node's transform and of all animation of it; the channels
//! that its joints refer to stand in `extras.catseye.channels` of the file. [`to_glb`] writes motions so, and beside
//! it an animation that shows them to other programs, marked `{"shows_extras": true}`, which import passes over.
//!
//! `extras.catseye` of a material: `eps_r` [eps', eps''], `conductivity_s_per_m`, `roughness_rms_m`, `backscatter`, `layers`,
//! `correlation_length_m`, `valid_hz` [low, high], `source`, and `like`, the row of the table to start
//! from (by default the row with the material's name, if there is one).

mod accessor;
mod animation;
mod chain;
mod container;
mod extras;
mod joints;
mod material;
mod mesh;
#[cfg(test)]
mod motion_tests;
mod nodes;
mod place;
mod read;
mod show;
mod skin;
#[cfg(test)]
mod tests;
mod write;

use super::Scene;
use super::toml_file::clip;
use crate::error::{BadInput, Result};
use crate::formats::input;
use glam::{DMat3, DVec3};
pub(super) use material::{check_material_map, choose_material, is_known_by_name};
pub(super) use mesh::{drop_flat_normals, drop_unused_vertices, has_area};
use read::Importer;
use std::path::Path;
pub use write::{export, to_glb};

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
    /// ISO axes from the file's.
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
    /// In the order of the file, but those that move what an earlier one moves already.
    #[default]
    All,
    /// Nodes stand where the file puts them.
    None,
    /// Those of this name; without a name an animation has its number.
    Named(String),
}

impl Animations {
    /// "all", "none" or a name.
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
    pub up: Up,
    /// Somebody has said it.
    pub up_given: bool,
    /// Table name of the material for surfaces without one, or with one that nothing else explains.
    pub default_material: Option<String>,
    /// (material of the file, table name).
    pub material_map: Vec<(String, String)>,
    pub animations: Animations,
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
        }
    }
}

impl ImportOptions {
    /// Errors: a unit of no sensible length.
    pub(super) fn check_unit(&self) -> Result<()> {
        if self.unit_m.is_finite() && (1e-9..=1e6).contains(&self.unit_m) {
            return Ok(());
        }
        Err(BadInput::new("is out of range").key("unit").value(self.unit_m).allowed("1e-9..=1e6 m").into())
    }
}

/// Length in metres of "m", "cm", "mm", "in" or "ft".
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

/// "y" or "z".
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
const MAX_BYTES: u64 = 1 << 36;
/// Vertices and triangles above these are refused: a small file can claim many by repetition.
pub(super) const MAX_VERTICES: usize = 50_000_000;
pub(super) const MAX_TRIANGLES: usize = 100_000_000;
/// Elements of an accessor that no bytes back.
const MAX_UNBACKED: u64 = 1 << 22;
const MAX_OBJECTS: usize = 10_000_000;
/// Keys of all animations, and joints of all objects.
const MAX_KEYS: usize = 10_000_000;
const MAX_JOINTS: usize = 2_000_000;
/// A 3x3 matrix this close to a rotation is one (single-precision rounding of its entries).
const RIGID: f64 = 2e-6;
/// Extensions that may be required because they leave positions and names alone.
const HARMLESS: [&str; 5] =
    ["KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_punctual", "KHR_xmp_json_ld"];

/// The bytes of a `.gltf` or `.glb` file. Errors: what is no regular file, or too large.
pub fn read_bytes(path: &Path) -> Result<Vec<u8>> {
    input::read(path, "a .glb or .gltf file", MAX_BYTES)
}

/// Reads a `.gltf` or `.glb` file.
///
/// Errors: anything that is wrong with the file, in one line with the place in it.
pub fn import(path: &Path, options: &ImportOptions) -> Result<Scene> {
    let bytes = read_bytes(path)?;
    let folder = path.parent().map(|p| if p.as_os_str().is_empty() { Path::new(".") } else { p });
    import_bytes(&bytes, path, folder, options)
}

/// Reads the bytes of a `.gltf` or `.glb` file. `name` is used in errors; buffers in other files are
/// looked for in `folder`, and are an error without one.
pub fn import_bytes(
    bytes: &[u8],
    name: &Path,
    folder: Option<&Path>,
    options: &ImportOptions,
) -> Result<Scene> {
    Importer::open(bytes, name, folder, options)?.run()
}
