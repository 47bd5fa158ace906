//! glTF 2.0 import and export. This is the one place where axes change: x (forward) = glTF +Z,
//! y (left) = glTF +X, z (up) = glTF +Y, and back.
//!
//! A node with a mesh becomes an object. Rotation and translation become its pose; scale, shear and
//! mirroring are baked into a copy of the mesh (a mirror turns the winding round). Nodes that share a
//! mesh, and the instances of EXT_mesh_gpu_instancing, share a [`Mesh`](super::Mesh).
//!
//! `extras.catseye` of a node: `class`; `velocity_mps` [forward, left, up] in the world, in these ISO
//! axes and not in glTF's; both hold for the nodes below as well. `id` (1 or more, unique) and
//! `rcs_dbsm`, which makes a node without a mesh a point target. `rcs_table`, the path of an RCS table (CSV)
//! in or below the glTF file's folder: the node scatters as the table says, with x, y and z of its target frame along
//! the node's ISO axes, and its mesh, if it has one, does not scatter. Such a node may not be scaled. `radar` = false, for the
//! node and those below it, says that the radar sees through them, while labels, pictures and lidar show them.
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
mod buffer;
mod chain;
mod container;
mod extras;
mod importer;
mod joints;
mod material;
mod mesh;
#[cfg(test)]
mod motion_tests;
mod nodes;
mod options;
mod place;
mod read;
mod show;
mod skin;
#[cfg(test)]
mod tests;
mod write;

use super::Scene;
use crate::base::error::Result;
use crate::formats::input;
pub(super) use material::{check_material_map, choose_material, is_known_by_name};

use importer::Importer;
use options::MAX_BYTES;
pub use options::{Animations, ImportOptions, Up, unit_m, up};
pub(super) use options::{MAX_TRIANGLES, MAX_VERTICES};
use std::path::Path;
pub use write::{export, to_glb};

/// The bytes of a `.gltf` or `.glb` file.
///
/// # Errors
/// Returns an error if the path is no regular file, or if the file is too large or cannot be read.
pub fn read_bytes(path: &Path) -> Result<Vec<u8>> {
    input::read(path, "a .glb or .gltf file", MAX_BYTES)
}

/// Reads a `.gltf` or `.glb` file.
///
/// # Errors
/// Returns an error of one line, with the place in the file, for anything that is wrong with it.
pub fn import(path: &Path, options: &ImportOptions) -> Result<Scene> {
    let bytes = read_bytes(path)?;
    let folder = path.parent().map(|p| if p.as_os_str().is_empty() { Path::new(".") } else { p });
    import_bytes(&bytes, path, folder, options)
}

/// Reads the bytes of a `.gltf` or `.glb` file. `name` is used in errors; buffers in other files are
/// looked for in `folder`, and are an error without one.
///
/// # Errors
/// Returns the errors of [`import`].
pub fn import_bytes(
    bytes: &[u8],
    name: &Path,
    folder: Option<&Path>,
    options: &ImportOptions,
) -> Result<Scene> {
    Importer::open(bytes, name, folder, options)?.run()
}
