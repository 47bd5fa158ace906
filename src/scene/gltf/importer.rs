//! What is known while a glTF file is read.

use super::options::ImportOptions;
use crate::scene::Scene;
use crate::scene::motion::{Channel, Interpolation, Joint};
use glam::{DAffine3, DMat3, DQuat, DVec3};
use gltf::json;
use serde::Deserialize;
use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The parts of nodes that `gltf::json` keeps in single precision or not at all.
#[derive(Deserialize)]
pub(super) struct Precise {
    #[serde(default)]
    pub(super) nodes: Vec<PreciseNode>,
}

#[derive(Deserialize)]
pub(super) struct PreciseNode {
    pub(super) translation: Option<[f64; 3]>,
    pub(super) rotation: Option<[f64; 4]>,
    pub(super) scale: Option<[f64; 3]>,
    pub(super) matrix: Option<[f64; 16]>,
}

/// What a node hands down to its children.
#[derive(Clone, Default)]
pub(super) struct Inherited {
    /// Where nothing is animated, in the file's axes and unit.
    pub(super) transform: DAffine3,
    /// Where something is.
    pub(super) chain: Option<Chain>,
    /// The innermost node that is animated, this one or one above.
    pub(super) mover: Option<usize>,
    pub(super) class: String,
    pub(super) velocity_mps: DVec3,
    pub(super) radar: bool,
}

pub(super) struct Importer<'a> {
    pub(super) file: &'a Path,
    pub(super) folder: Option<&'a Path>,
    pub(super) options: &'a ImportOptions,
    pub(super) root: json::Root,
    pub(super) nodes: Vec<PreciseNode>,
    pub(super) buffers: Vec<Cow<'a, [u8]>>,
    /// ISO axes from the file's.
    pub(super) axes: DMat3,
    pub(super) scene: Scene,
    pub(super) vertices: usize,
    /// Scene material of each glTF material, and of surfaces without one (last).
    pub(super) materials: Vec<Option<u32>>,
    /// (glTF mesh, bits of the baked matrix) to scene mesh; None when nothing is left of it.
    pub(super) meshes: HashMap<(usize, [u64; 9]), Option<usize>>,
    /// Files of scattering tables that have been read, and their place in the scene.
    pub(super) tables: HashMap<PathBuf, usize>,
    /// What animations move, by node.
    pub(super) moves: HashMap<usize, Moves>,
    /// Joints of all chains so far.
    pub(super) joints: usize,
    pub(super) channels: Channels,
    pub(super) notes: HashSet<String>,
}

/// Keys of one property of a node, in the file's axes and unit.
#[derive(Debug)]
pub(super) struct Keys<const N: usize> {
    pub(super) times_s: Vec<f64>,
    pub(super) values: Vec<[f64; N]>,
    /// (into, out of) each value, per second, of a cubic.
    pub(super) tangents: Vec<([f64; N], [f64; N])>,
    pub(super) interpolation: Interpolation,
    pub(super) repeat_s: Option<f64>,
}

/// What moves a node.
#[derive(Debug, Default)]
pub(super) struct Moves {
    pub(super) translation: Option<Keys<3>>,
    pub(super) rotation: Option<Keys<4>>,
    /// Does not change.
    pub(super) scale: Option<[f64; 3]>,
}

/// From a node to the world where something on the way moves. A point p of the node (ISO axes, metres) is at
/// joints(rest p).
#[derive(Debug, Clone)]
pub(super) struct Chain {
    /// The outermost first.
    pub(super) joints: Vec<Joint>,
    /// Scale, shear and mirror, which go into the vertices.
    pub(super) rest: DMat3,
}

/// The channels that the joints of a file share.
#[derive(Debug, Default)]
pub(super) struct Channels {
    pub(super) distances_m: Vec<Arc<Channel<f64>>>,
    pub(super) positions_m: Vec<Arc<Channel<DVec3>>>,
    pub(super) rotations: Vec<Arc<Channel<DQuat>>>,
}

/// What `extras.catseye` of a node says.
#[derive(Default)]
pub(super) struct NodeExtras {
    pub(super) class: Option<String>,
    pub(super) velocity_mps: Option<DVec3>,
    pub(super) id: Option<u32>,
    pub(super) rcs_dbsm: Option<f64>,
    pub(super) rcs_table: Option<usize>,
    pub(super) motion: Option<Vec<Joint>>,
    pub(super) radar: Option<bool>,
}

/// Ids that the file gives, and those of the objects so far.
#[derive(Default)]
pub(super) struct Ids {
    pub(super) all: HashSet<u32>,
    pub(super) given: Vec<Option<u32>>,
}
