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
//! `extras.catseye` of a material: `eps_r` [eps', eps''], `conductivity_s_per_m`, `roughness_rms_m`, `backscatter`, `layers`,
//! `correlation_length_m`, `valid_hz` [low, high], `source`, and `like`, the row of the table to start
//! from (by default the row with the material's name, if there is one).

use super::backscatter::Backscatter;
use super::material::{self, Layer, Material, MaterialKind};
use super::scatterer::ScatteringTable;
use super::toml_file::clip;
use super::{Mesh, Object, Scene, Shape};
use crate::error::{BadInput, Error, Result, nearest};
use crate::frames::Pose;
use glam::{DAffine3, DMat3, DQuat, DVec3};
use gltf::json;
use json::accessor::{ComponentType, Type};
use json::mesh::{Mode, Semantic};
use json::validation::Checked;
use serde::Deserialize;
use serde_json::{Map, Value};
use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

/// Which axis of the file points up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Up {
    /// As glTF prescribes: +Z forward, +X left.
    #[default]
    Y,
    /// The file already has ISO 8855 axes: +X forward, +Y left, +Z up.
    Z,
}

/// How to read a glTF file.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportOptions {
    /// Length of the file's unit in metres (glTF prescribes 1).
    pub unit_m: f64,
    pub up: Up,
    /// Table name of the material for surfaces without one, or with one that nothing else explains.
    pub default_material: Option<String>,
    /// (material of the file, table name).
    pub material_map: Vec<(String, String)>,
}

impl Default for ImportOptions {
    fn default() -> Self {
        ImportOptions { unit_m: 1.0, up: Up::Y, default_material: None, material_map: Vec::new() }
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
            .remedy("give the unit of the glTF file's coordinates")
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
            .remedy("glTF files have y up")
            .into()),
    }
}

/// Vertices and triangles above these are refused: a small file can claim many by repetition.
const MAX_VERTICES: usize = 50_000_000;
const MAX_TRIANGLES: usize = 100_000_000;
/// Elements of an accessor that no bytes back.
const MAX_UNBACKED: u64 = 1 << 22;
const MAX_OBJECTS: usize = 10_000_000;
/// A 3x3 matrix this close to a rotation is one (single-precision rounding of its entries).
const RIGID: f64 = 2e-6;
/// Extensions that may be required because they leave positions and names alone.
const HARMLESS: [&str; 5] =
    ["KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_punctual", "KHR_xmp_json_ld"];

/// Reads a `.gltf` or `.glb` file.
///
/// Errors: anything that is wrong with the file, in one line with the place in it.
pub fn import(path: &Path, options: &ImportOptions) -> Result<Scene> {
    let bad = |problem: &str| BadInput::new(problem).file(path);
    match std::fs::metadata(path) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
            return Err(bad("no such file").remedy("check the path").into());
        }
        Err(e) => return Err(Error::io(path, e)),
        Ok(m) if m.is_dir() => {
            return Err(bad("is a directory").remedy("give a .glb or .gltf file").into());
        }
        Ok(_) => {}
    }
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, e))?;
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

/// The parts of nodes that `gltf::json` keeps in single precision or not at all.
#[derive(Deserialize)]
struct Precise {
    #[serde(default)]
    nodes: Vec<PreciseNode>,
}

#[derive(Deserialize)]
struct PreciseNode {
    translation: Option<[f64; 3]>,
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
    matrix: Option<[f64; 16]>,
}

struct Importer<'a> {
    file: &'a Path,
    folder: Option<&'a Path>,
    options: &'a ImportOptions,
    root: json::Root,
    nodes: Vec<PreciseNode>,
    buffers: Vec<Cow<'a, [u8]>>,
    /// ISO axes from the file's.
    axes: DMat3,
    scene: Scene,
    vertices: usize,
    /// Scene material of each glTF material, and of surfaces without one (last).
    materials: Vec<Option<u32>>,
    /// (glTF mesh, bits of the baked matrix) to scene mesh; None when nothing is left of it.
    meshes: HashMap<(usize, [u64; 9]), Option<usize>>,
    /// Files of scattering tables that have been read, and their place in the scene.
    tables: HashMap<PathBuf, usize>,
    notes: HashSet<String>,
}

/// What a node hands down to its children.
#[derive(Clone)]
struct Inherited {
    transform: DAffine3,
    class: String,
    velocity_mps: DVec3,
}

impl<'a> Importer<'a> {
    fn open(
        bytes: &'a [u8],
        file: &'a Path,
        folder: Option<&'a Path>,
        options: &'a ImportOptions,
    ) -> Result<Self> {
        let bad = |problem: String| BadInput::new(problem).file(file);
        if !(options.unit_m.is_finite() && (1e-9..=1e6).contains(&options.unit_m)) {
            return Err(BadInput::new("is out of range")
                .key("unit")
                .value(options.unit_m)
                .allowed("1e-9..=1e6 m")
                .into());
        }
        if bytes.is_empty() {
            return Err(bad("the file is empty".into()).remedy("give a .glb or .gltf file").into());
        }
        let (text, blob) = split_glb(bytes)
            .map_err(|problem| bad(problem).remedy("export the file again as binary glTF 2.0"))?;
        let not_json = |e: serde_json::Error| {
            let place = if e.line() > 0 {
                format!("line {} column {}: ", e.line(), e.column())
            } else {
                String::new()
            };
            let e = e.to_string();
            let e = e.split(" at line ").next().unwrap_or("").replace('\n', " ");
            bad(format!("is not glTF JSON: {place}{}", clip(&e))).remedy("give a .glb or .gltf file")
        };
        let root = json::Root::from_slice(text).map_err(not_json)?;
        let precise: Precise = serde_json::from_slice(text).map_err(not_json)?;
        if root.asset.version.split('.').next() != Some("2") {
            return Err(bad("is not glTF 2".into())
                .key("asset.version")
                .value(clip(&root.asset.version))
                .allowed("2.x")
                .remedy("export as glTF 2.0")
                .into());
        }
        let known = |e: &str| {
            e == "KHR_mesh_quantization"
                || e == "EXT_mesh_gpu_instancing"
                || HARMLESS.iter().any(|h| e.starts_with(h))
        };
        if let Some(e) = root.extensions_required.iter().find(|e| !known(e)) {
            return Err(bad(format!("requires the extension {}, which is not supported", clip(e)))
                .key("extensionsRequired")
                .remedy("export without it (uncompressed geometry)")
                .into());
        }
        let mut buffers = Vec::with_capacity(root.buffers.len());
        for (i, b) in root.buffers.iter().enumerate() {
            let data = match &b.uri {
                Some(uri) => Cow::Owned(load_uri(file, folder, i, uri)?),
                None => match blob {
                    Some(blob) if i == 0 => Cow::Borrowed(blob),
                    _ => {
                        return Err(bad("has neither a URI nor a binary chunk".into())
                            .key(format!("buffers[{i}]"))
                            .remedy("export the file again")
                            .into());
                    }
                },
            };
            if (data.len() as u64) < b.byte_length.0 {
                return Err(bad(format!("the buffer holds only {} bytes", data.len()))
                    .key(format!("buffers[{i}].byteLength"))
                    .value(b.byte_length.0)
                    .remedy("the data is cut off; export the file again")
                    .into());
            }
            buffers.push(data);
        }
        let axes = match options.up {
            Up::Y => DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X),
            Up::Z => DMat3::IDENTITY,
        };
        let materials = vec![None; root.materials.len() + 1];
        Ok(Importer {
            file,
            folder,
            options,
            root,
            nodes: precise.nodes,
            buffers,
            axes,
            scene: Scene::default(),
            vertices: 0,
            materials,
            meshes: HashMap::new(),
            tables: HashMap::new(),
            notes: HashSet::new(),
        })
    }

    fn bad(&self, key: impl Into<String>, problem: impl Into<String>) -> BadInput {
        BadInput::new(problem).file(self.file).key(key)
    }

    /// Each note once, in the order in which they came up.
    fn note(&mut self, text: String) {
        if self.scene.import.notes.len() < 100 && self.notes.insert(text.clone()) {
            self.scene.import.notes.push(text);
        }
    }

    fn run(mut self) -> Result<Scene> {
        let roots = self.roots()?;
        let order = self.walk(&roots);
        self.resolve_materials(&order)?;
        if !self.root.animations.is_empty() {
            self.note(format!(
                "{} animations are left out: objects move by velocity_mps",
                self.root.animations.len()
            ));
        }
        let start =
            Inherited { transform: DAffine3::IDENTITY, class: String::new(), velocity_mps: DVec3::ZERO };
        let mut inherited: Vec<Option<Inherited>> = vec![None; self.nodes.len()];
        // Ids that the file gives come first, so that the others can avoid them.
        let mut ids: HashSet<u32> = HashSet::new();
        let mut given: Vec<Option<u32>> = Vec::new();
        for (node, parent) in &order {
            let above = parent.and_then(|p| inherited[p].clone()).unwrap_or_else(|| start.clone());
            let here = self.node(*node, &above, &mut ids, &mut given)?;
            inherited[*node] = Some(here);
        }
        let mut next = 1;
        for (object, given) in self.scene.objects.iter_mut().zip(given) {
            object.id = match given {
                Some(id) => id,
                None => {
                    while ids.contains(&next) {
                        next += 1;
                    }
                    next += 1;
                    next - 1
                }
            };
        }
        if self.scene.objects.is_empty() {
            let dropped = self.scene.import.degenerate_triangles_dropped;
            let why = if dropped > 0 { format!(" ({dropped} had no area)") } else { String::new() };
            return Err(BadInput::new(format!("the scene has no triangles{why} and no point targets"))
                .file(self.file)
                .remedy("export meshes, or give a node extras.catseye.rcs_dbsm")
                .into());
        }
        self.scene.import.triangles = self.scene.triangle_count();
        Ok(self.scene)
    }

    /// The nodes from which the scene hangs. Errors: cycles, two parents, indices out of range.
    fn roots(&self) -> Result<Vec<usize>> {
        let n = self.root.nodes.len();
        let mut parent: Vec<Option<usize>> = vec![None; n];
        for (i, node) in self.root.nodes.iter().enumerate() {
            for c in node.children.iter().flatten() {
                let c = c.value();
                let key = || format!("nodes[{i}].children");
                if c >= n {
                    return Err(self.out_of_range(key(), c, n).into());
                }
                if let Some(p) = parent[c] {
                    let problem = if p == i {
                        "names a child twice".into()
                    } else {
                        format!("node {c} has two parents, {p} and {i}")
                    };
                    return Err(self
                        .bad(key(), problem)
                        .remedy("the nodes must form a tree; export the file again")
                        .into());
                }
                parent[c] = Some(i);
            }
        }
        let tops: Vec<usize> = (0..n).filter(|i| parent[*i].is_none()).collect();
        // With one parent each, whatever cannot be reached from a parentless node is on a cycle.
        let mut reached = vec![false; n];
        let mut stack = tops.clone();
        while let Some(i) = stack.pop() {
            reached[i] = true;
            stack.extend(self.root.nodes[i].children.iter().flatten().map(|c| c.value()));
        }
        if let Some(i) = reached.iter().position(|r| !r) {
            return Err(self
                .bad(format!("nodes[{i}]"), "is its own ancestor")
                .remedy("the nodes must form a tree; export the file again")
                .into());
        }
        if self.root.scenes.is_empty() {
            return Ok(tops);
        }
        let s = self.root.scene.map_or(0, |s| s.value());
        let Some(scene) = self.root.scenes.get(s) else {
            return Err(self.out_of_range("scene".into(), s, self.root.scenes.len()).into());
        };
        let mut seen = HashSet::new();
        for r in &scene.nodes {
            let r = r.value();
            let key = || format!("scenes[{s}].nodes");
            if r >= n {
                return Err(self.out_of_range(key(), r, n).into());
            }
            if parent[r].is_some() || !seen.insert(r) {
                return Err(self
                    .bad(key(), format!("node {r} is in the scene twice"))
                    .remedy("list only the topmost nodes, once each")
                    .into());
            }
        }
        Ok(scene.nodes.iter().map(|r| r.value()).collect())
    }

    fn out_of_range(&self, key: String, index: usize, len: usize) -> BadInput {
        let allowed =
            if len == 0 { "none, there are no such entries".into() } else { format!("0..={}", len - 1) };
        self.bad(key, "is out of range").value(index).allowed(allowed).remedy("export the file again")
    }

    /// (node, parent) in file order, parents first.
    fn walk(&self, roots: &[usize]) -> Vec<(usize, Option<usize>)> {
        let mut order = Vec::new();
        let mut stack: Vec<_> = roots.iter().rev().map(|r| (*r, None)).collect();
        while let Some((i, parent)) = stack.pop() {
            order.push((i, parent));
            let children: Vec<_> = self.root.nodes[i].children.iter().flatten().collect();
            stack.extend(children.into_iter().rev().map(|c| (c.value(), Some(i))));
        }
        order
    }

    fn node(
        &mut self,
        i: usize,
        above: &Inherited,
        ids: &mut HashSet<u32>,
        given: &mut Vec<Option<u32>>,
    ) -> Result<Inherited> {
        let mut here = Inherited { transform: above.transform * self.local(i)?, ..above.clone() };
        let t = here.transform;
        if !(t.matrix3.is_finite() && t.translation.is_finite() && t.translation.length() < 1e12) {
            return Err(self
                .bad(format!("nodes[{i}]"), "its transform is not finite")
                .remedy("check its scale and its parents'")
                .into());
        }
        let node = &self.root.nodes[i];
        let mesh = node.mesh.map(|m| m.value());
        let name = node.name.clone().filter(|n| !n.is_empty());
        let skinned = node.skin.is_some();
        let instancing =
            node.extensions.as_ref().and_then(|e| e.others.get("EXT_mesh_gpu_instancing")).cloned();
        let extras = self.extras(&node.extras, &format!("nodes[{i}].extras.catseye"))?;
        let mut id = None;
        let mut rcs_dbsm = None;
        let mut rcs_table = None;
        for (k, v) in extras.iter().flat_map(|m| m.iter()) {
            let key = format!("nodes[{i}].extras.catseye.{k}");
            match k.as_str() {
                "class" => match v.as_str() {
                    Some(c) if c.len() <= 200 && !c.contains(char::is_control) => here.class = c.into(),
                    _ => {
                        return Err(self
                            .bad(key, "is not a class name")
                            .value(clip(&v.to_string()))
                            .remedy("give a string")
                            .into());
                    }
                },
                "velocity_mps" => here.velocity_mps = self.numbers::<3>(v, &key, 1e5)?.into(),
                "id" => match v.as_u64().and_then(|x| u32::try_from(x).ok()).filter(|x| *x > 0) {
                    Some(x) => id = Some(x),
                    None => {
                        return Err(self
                            .bad(key, "is not an id")
                            .value(clip(&v.to_string()))
                            .allowed("1..=4294967295")
                            .remedy("give a whole number")
                            .into());
                    }
                },
                "rcs_dbsm" => rcs_dbsm = Some(self.number(v, &key, -200.0..=200.0)?),
                "rcs_table" => match v.as_str() {
                    Some(name) => rcs_table = Some(self.table(&key, name)?),
                    None => {
                        return Err(self
                            .bad(key, "is not the path of a file")
                            .value(clip(&v.to_string()))
                            .remedy("give a string")
                            .into());
                    }
                },
                _ => {
                    return Err(self
                        .unknown_key(
                            &format!("nodes[{i}].extras.catseye"),
                            k,
                            &["class", "velocity_mps", "id", "rcs_dbsm", "rcs_table"],
                        )
                        .into());
                }
            }
        }
        let key = format!("nodes[{i}]");
        if rcs_dbsm.is_some() && mesh.is_some() {
            return Err(self
                .bad(key, "has a mesh and rcs_dbsm")
                .remedy("give rcs_dbsm to a node without a mesh")
                .into());
        }
        if rcs_dbsm.is_some() && rcs_table.is_some() {
            return Err(self.bad(key, "has rcs_dbsm and rcs_table").remedy("keep one of the two").into());
        }
        if let Some(id) = id {
            if mesh.is_none() && rcs_dbsm.is_none() && rcs_table.is_none() || instancing.is_some() {
                return Err(self
                    .bad(format!("{key}.extras.catseye.id"), "belongs to a node that is one object")
                    .remedy("give ids to the nodes with a mesh, rcs_dbsm or rcs_table, without instancing")
                    .into());
            }
            if !ids.insert(id) {
                return Err(self
                    .bad(format!("{key}.extras.catseye.id"), "is given twice")
                    .value(id)
                    .remedy("ids are unique; leave it out to have one assigned")
                    .into());
            }
        }
        let (class, velocity_mps) = (here.class.clone(), here.velocity_mps);
        let mut add = |me: &mut Self, name: String, shape: Shape, pose| -> Result<()> {
            if me.scene.objects.len() >= MAX_OBJECTS {
                return Err(me
                    .bad("nodes", "too many objects")
                    .allowed(format!("up to {MAX_OBJECTS}"))
                    .remedy("split the scene")
                    .into());
            }
            given.push(id);
            me.scene.objects.push(Object {
                id: 0,
                name,
                class: class.clone(),
                shape,
                pose,
                velocity_mps,
                motion: None,
            });
            Ok(())
        };
        if let Some(rcs_dbsm) = rcs_dbsm {
            let pose = self.place(&here.transform).0;
            add(self, name.unwrap_or(format!("point {i}")), Shape::Point { rcs_dbsm }, pose)?;
            return Ok(here);
        }
        if let (Some(table), None) = (rcs_table, mesh) {
            let pose = self.unscaled(&here.transform, &key)?;
            add(self, name.unwrap_or(format!("table {i}")), Shape::Table(table), pose)?;
            return Ok(here);
        }
        let Some(m) = mesh else {
            if instancing.is_some() {
                self.note(format!("node {i} is instanced but has no mesh"));
            }
            return Ok(here);
        };
        if m >= self.root.meshes.len() {
            return Err(self.out_of_range(format!("{key}.mesh"), m, self.root.meshes.len()).into());
        }
        if skinned {
            self.note(format!("node {i} is skinned: its mesh is taken as it stands, without bones"));
        }
        let base = name
            .or_else(|| self.root.meshes[m].name.clone().filter(|n| !n.is_empty()))
            .unwrap_or(format!("node {i}"));
        let instances = match instancing {
            Some(v) => Some(self.instances(i, &v)?),
            None => None,
        };
        let transforms = match &instances {
            Some(list) => list.iter().map(|local| here.transform * *local).collect(),
            None => vec![here.transform],
        };
        if rcs_table.is_some() {
            self.note(format!(
                "node {i} ('{}') scatters as its rcs_table says; its mesh does not",
                clip(&base)
            ));
        }
        for (k, transform) in transforms.iter().enumerate() {
            let name = if instances.is_some() { format!("{base} {k}") } else { base.clone() };
            if let Some(table) = rcs_table {
                let pose = self.unscaled(transform, &key)?;
                add(self, name, Shape::Table(table), pose)?;
                continue;
            }
            let (pose, bake) = self.place(transform);
            let Some(shape) = self.mesh(m, bake)? else {
                self.note(format!(
                    "node {i} ('{}') has no triangle with an area and is left out",
                    clip(&base)
                ));
                continue;
            };
            add(self, name, Shape::Mesh(shape), pose)?;
        }
        Ok(here)
    }

    /// Index of the scattering table in the file of this name, which is read once.
    fn table(&mut self, key: &str, name: &str) -> Result<usize> {
        let path = beside(self.file, self.folder, key, name)?;
        if let Some(t) = self.tables.get(&path) {
            return Ok(*t);
        }
        let table = Arc::new(ScatteringTable::read(&path)?);
        for note in table.notes() {
            self.note(note.clone());
        }
        let t = self.scene.table_index(&table);
        self.tables.insert(path, t);
        Ok(t)
    }

    /// Pose of a node whose scattering is known in metres.
    fn unscaled(&self, t: &DAffine3, key: &str) -> Result<Pose<crate::frames::Target, crate::frames::World>> {
        let (pose, bake) = self.place(t);
        if bake != DMat3::IDENTITY {
            return Err(self
                .bad(key, "is scaled or mirrored and has an rcs_table")
                .remedy("a table cannot be scaled; apply the node's scale")
                .into());
        }
        Ok(pose)
    }

    /// The node's own transform in the file's axes and unit.
    fn local(&self, i: usize) -> Result<DAffine3> {
        let key = format!("nodes[{i}]");
        let n = self.nodes.get(i).ok_or_else(|| self.bad(&key, "is not readable"))?;
        if let Some(m) = n.matrix {
            if n.translation.is_some() || n.rotation.is_some() || n.scale.is_some() {
                return Err(self
                    .bad(key, "has a matrix and translation, rotation or scale")
                    .remedy("keep one of the two")
                    .into());
            }
            let affine =
                m[3].abs() < 1e-6 && m[7].abs() < 1e-6 && m[11].abs() < 1e-6 && (m[15] - 1.0).abs() < 1e-6;
            if !affine {
                return Err(self
                    .bad(format!("{key}.matrix"), "is not affine")
                    .allowed("a last row of 0, 0, 0, 1 (column-major)")
                    .remedy("export the file again")
                    .into());
            }
            let c = |k: usize| DVec3::new(m[k], m[k + 1], m[k + 2]);
            return Ok(DAffine3 { matrix3: DMat3::from_cols(c(0), c(4), c(8)), translation: c(12) });
        }
        let q = self.quaternion(n.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]), &key)?;
        let s = DVec3::from(n.scale.unwrap_or([1.0; 3]));
        let t = DVec3::from(n.translation.unwrap_or([0.0; 3]));
        Ok(DAffine3::from_scale_rotation_translation(s, q, t))
    }

    fn quaternion(&self, r: [f64; 4], key: &str) -> Result<DQuat> {
        let q = DQuat::from_array(r);
        if (q.length() - 1.0).abs() < 0.01 {
            return Ok(q.normalize());
        }
        Err(self
            .bad(format!("{key}.rotation"), "is not a unit quaternion")
            .value(clip(&format!("{r:?}")))
            .remedy("export the file again")
            .into())
    }

    /// The rigid part of a transform as a pose in ISO axes and metres, and what is left of it to bake
    /// into the vertices (ISO axes; identity when there is nothing).
    fn place(&self, t: &DAffine3) -> (Pose<crate::frames::Target, crate::frames::World>, DMat3) {
        let a = self.axes * t.matrix3 * self.axes.transpose();
        let translation = self.axes * t.translation * self.options.unit_m;
        // Gram-Schmidt: a proper rotation that keeps the direction of the first column.
        let x = a.x_axis.normalize_or_zero();
        let y = (a.y_axis - x * x.dot(a.y_axis)).normalize_or_zero();
        let rotation = DMat3::from_cols(x, y, x.cross(y));
        let proper = (rotation.determinant() - 1.0).abs() < 1e-9;
        let rotation = if proper { rotation } else { DMat3::IDENTITY };
        let mut bake = rotation.transpose() * a;
        if bake.abs_diff_eq(DMat3::IDENTITY, RIGID) {
            bake = DMat3::IDENTITY;
        }
        (Pose::new(DQuat::from_mat3(&rotation).normalize(), translation), bake)
    }

    fn instances(&mut self, i: usize, v: &Value) -> Result<Vec<DAffine3>> {
        let key = format!("nodes[{i}].extensions.EXT_mesh_gpu_instancing.attributes");
        let empty = Map::new();
        let attributes = v.get("attributes").and_then(Value::as_object).unwrap_or(&empty);
        let index = |name: &str| -> Result<Option<usize>> {
            match attributes.get(name) {
                None => Ok(None),
                Some(a) => match a.as_u64() {
                    Some(a) => Ok(Some(a as usize)),
                    None => Err(self
                        .bad(format!("{key}.{name}"), "is not an accessor")
                        .value(clip(&a.to_string()))
                        .into()),
                },
            }
        };
        let (t, r, s) = (index("TRANSLATION")?, index("ROTATION")?, index("SCALE")?);
        let t = t.map(|a| self.elements::<3>(a, &format!("{key}.TRANSLATION"))).transpose()?;
        let r = r.map(|a| self.elements::<4>(a, &format!("{key}.ROTATION"))).transpose()?;
        let s = s.map(|a| self.elements::<3>(a, &format!("{key}.SCALE"))).transpose()?;
        let counts: Vec<usize> =
            [t.as_ref().map(Vec::len), r.as_ref().map(Vec::len), s.as_ref().map(Vec::len)]
                .into_iter()
                .flatten()
                .collect();
        let Some(&n) = counts.first() else {
            return Err(self
                .bad(key, "has none of TRANSLATION, ROTATION and SCALE")
                .remedy("export the file again")
                .into());
        };
        if counts.iter().any(|c| *c != n) {
            return Err(self
                .bad(key, format!("the attributes have different counts, {counts:?}"))
                .remedy("export the file again")
                .into());
        }
        (0..n)
            .map(|k| {
                let q = r.as_ref().map_or(Ok(DQuat::IDENTITY), |r| self.quaternion(r[k], &key))?;
                let at = |list: &Option<Vec<[f64; 3]>>, default: DVec3| {
                    list.as_ref().map_or(default, |l| l[k].into())
                };
                let (t, s) = (at(&t, DVec3::ZERO), at(&s, DVec3::ONE));
                if !(t.is_finite() && s.is_finite()) {
                    return Err(self
                        .bad(&key, format!("instance {k} is not finite"))
                        .remedy("export the file again")
                        .into());
                }
                Ok(DAffine3::from_scale_rotation_translation(s, q, t))
            })
            .collect()
    }

    /// Scene mesh of glTF mesh `m` with its vertices multiplied by `bake`.
    fn mesh(&mut self, m: usize, bake: DMat3) -> Result<Option<usize>> {
        let key = (m, bake.to_cols_array().map(|x| (x + 0.0).to_bits()));
        if let Some(known) = self.meshes.get(&key) {
            return Ok(*known);
        }
        let built = self.build_mesh(m, bake)?;
        let index = (!built.triangles.is_empty()).then(|| {
            self.scene.meshes.push(built);
            self.scene.meshes.len() - 1
        });
        self.meshes.insert(key, index);
        Ok(index)
    }

    fn build_mesh(&mut self, m: usize, bake: DMat3) -> Result<Mesh> {
        let to_iso = bake * self.axes * self.options.unit_m;
        let mirrored = bake.determinant() < 0.0;
        let mut all = Mesh::default();
        // Primitives that share their positions share the vertices here too.
        let mut bases: HashMap<(usize, Option<usize>), usize> = HashMap::new();
        let turn_normals = to_iso.inverse().transpose();
        let stored: usize = self.scene.meshes.iter().map(|m| m.triangles.len()).sum();
        for p in 0..self.root.meshes[m].primitives.len() {
            let key = format!("meshes[{m}].primitives[{p}]");
            let primitive = &self.root.meshes[m].primitives[p];
            let Checked::Valid(mode) = primitive.mode else {
                return Err(self
                    .bad(format!("{key}.mode"), "is not a primitive mode")
                    .allowed("0..=6")
                    .remedy("export the file again")
                    .into());
            };
            let (positions, indices) = (
                primitive.attributes.get(&Checked::Valid(Semantic::Positions)).map(|a| a.value()),
                primitive.indices.map(|a| a.value()),
            );
            let normals = primitive.attributes.get(&Checked::Valid(Semantic::Normals)).map(|a| a.value());
            let (material, morphs) = (primitive.material.map(|m| m.value()), primitive.targets.is_some());
            if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
                self.note(format!("{key} holds points or lines, which have no area, and is left out"));
                continue;
            }
            let Some(accessor) = positions else {
                self.note(format!("{key} has no positions and is left out"));
                continue;
            };
            if morphs {
                self.note(format!("{key} has morph targets, which are left out"));
            }
            let slot = material.unwrap_or(self.root.materials.len());
            let Some(Some(material)) = self.materials.get(slot).copied() else {
                return Err(self
                    .out_of_range(format!("{key}.material"), slot, self.root.materials.len())
                    .into());
            };
            let base = match bases.get(&(accessor, normals)) {
                Some(b) => *b,
                None => {
                    let base = all.positions_m.len();
                    let what = format!("{key}.attributes.POSITION");
                    let points = self.elements::<3>(accessor, &what)?;
                    if self.vertices + base + points.len() > MAX_VERTICES {
                        return Err(self
                            .bad(what, "too many vertices")
                            .allowed(format!("up to {MAX_VERTICES} in all"))
                            .remedy("split the scene")
                            .into());
                    }
                    for (k, p) in points.iter().enumerate() {
                        let p = to_iso * DVec3::from(*p);
                        if !(p.is_finite() && p.length() < 1e9) {
                            return Err(self
                                .bad(&what, format!("vertex {k} is not a finite position"))
                                .value(clip(&format!("{:?}", points[k])))
                                .remedy("clean the mesh and export it again")
                                .into());
                        }
                        all.positions_m.push(p);
                    }
                    // A primitive without normals is flat; a file that has none costs no memory here.
                    if let Some(normals) = normals {
                        let what = format!("{key}.attributes.NORMAL");
                        let rows = self.elements::<3>(normals, &what)?;
                        if rows.len() != points.len() {
                            return Err(self
                                .bad(what, format!("{} normals for {} vertices", rows.len(), points.len()))
                                .remedy("the mesh is damaged; export it again")
                                .into());
                        }
                        all.normals.resize(base, DVec3::ZERO);
                        // What is not finite or has no length says nothing about the surface.
                        all.normals.extend(
                            rows.iter().map(|n| (turn_normals * DVec3::from(*n)).normalize_or_zero()),
                        );
                    } else if !all.normals.is_empty() {
                        all.normals.resize(all.positions_m.len(), DVec3::ZERO);
                    }
                    bases.insert((accessor, normals), base);
                    base
                }
            };
            let count = self.count(accessor) as u32;
            let corners: Vec<u32> = match indices {
                Some(a) => self.indices(a, count, &format!("{key}.indices"))?,
                None => (0..count).collect(),
            };
            let n = corners.len();
            let triangles = if mode == Mode::Triangles { n / 3 } else { n.saturating_sub(2) };
            if mode == Mode::Triangles && !n.is_multiple_of(3) {
                self.note(format!("{key} has {} corners more than whole triangles", n % 3));
            }
            if stored + all.triangles.len() + triangles > MAX_TRIANGLES {
                return Err(self
                    .bad(key, "too many triangles")
                    .allowed(format!("up to {MAX_TRIANGLES} in all"))
                    .remedy("split the scene")
                    .into());
            }
            for t in 0..triangles {
                // Strips and fans as in section 3.7.2.1 of the glTF 2.0 specification.
                let mut abc = match mode {
                    Mode::Triangles => [3 * t, 3 * t + 1, 3 * t + 2],
                    Mode::TriangleStrip => [t, t + 1 + t % 2, t + 2 - t % 2],
                    _ => [t + 1, t + 2, 0],
                }
                .map(|c| corners[c] + base as u32);
                if mirrored {
                    abc.swap(1, 2);
                }
                let [a, b, c] = abc.map(|c| all.positions_m[c as usize]);
                let (u, v) = (b - a, c - a);
                let longest = u.length_squared().max(v.length_squared()).max((v - u).length_squared());
                if u.cross(v).length() <= 1e-12 * longest {
                    self.scene.import.degenerate_triangles_dropped += 1;
                    continue;
                }
                all.triangles.push(abc);
                all.material.push(material);
            }
        }
        drop_flat_normals(&mut all);
        drop_unused_vertices(&mut all);
        self.vertices += all.positions_m.len();
        Ok(all)
    }

    /// Number of elements of an accessor that has been read, so it fits.
    fn count(&self, accessor: usize) -> u64 {
        self.root.accessors[accessor].count.0
    }

    fn indices(&self, accessor: usize, vertices: u32, what: &str) -> Result<Vec<u32>> {
        let list = self.scalars(accessor, what)?;
        if let Some(k) = list.iter().position(|i| *i >= vertices) {
            return Err(self
                .bad(what, format!("index {k} points past the {vertices} vertices"))
                .value(list[k])
                .remedy("the mesh is damaged; export it again")
                .into());
        }
        Ok(list)
    }

    /// Bytes and stride of a buffer view. Errors: indices and lengths that do not fit.
    fn view(&self, index: usize, what: &str) -> Result<(&[u8], Option<usize>)> {
        let Some(v) = self.root.buffer_views.get(index) else {
            return Err(self
                .out_of_range(format!("{what} bufferView"), index, self.root.buffer_views.len())
                .into());
        };
        let key = format!("bufferViews[{index}]");
        let Some(buffer) = self.buffers.get(v.buffer.value()) else {
            return Err(self
                .out_of_range(format!("{key}.buffer"), v.buffer.value(), self.buffers.len())
                .into());
        };
        let start = v.byte_offset.map_or(0, |o| o.0);
        let bytes = start
            .checked_add(v.byte_length.0)
            .and_then(|end| buffer.get(usize::try_from(start).ok()?..usize::try_from(end).ok()?));
        let Some(bytes) = bytes else {
            return Err(self
                .bad(
                    key,
                    format!(
                        "bytes {start} to {} lie outside the buffer",
                        start.saturating_add(v.byte_length.0)
                    ),
                )
                .allowed(format!("up to {}", buffer.len()))
                .remedy("the data is cut off; export the file again")
                .into());
        };
        Ok((bytes, v.byte_stride.map(|s| s.0).filter(|s| *s > 0)))
    }

    /// `count` elements of `size` bytes in a view: their starts lie `stride` apart from `offset`.
    fn span(&self, view: usize, offset: u64, count: u64, size: usize, what: &str) -> Result<(&[u8], usize)> {
        let (bytes, stride) = self.view(view, what)?;
        let stride = stride.unwrap_or(size);
        if stride < size {
            return Err(self
                .bad(
                    format!("bufferViews[{view}].byteStride"),
                    format!("is less than an element of {size} bytes"),
                )
                .value(stride)
                .into());
        }
        // In 128 bits nothing here can overflow.
        let end = offset as u128
            + (count as u128).saturating_sub(1) * stride as u128
            + if count == 0 { 0 } else { size as u128 };
        if end > bytes.len() as u128 {
            return Err(self
                .bad(
                    what,
                    format!("{count} elements need {end} bytes, but the buffer view holds {}", bytes.len()),
                )
                .remedy("the file is damaged; export it again")
                .into());
        }
        Ok((&bytes[offset as usize..], stride))
    }

    /// Calls `put(element, bytes)` for each element of an accessor, sparse replacements last. Elements
    /// that no bytes back are not called.
    fn visit(
        &self,
        index: usize,
        what: &str,
        dimensions: (Type, usize),
        mut put: impl FnMut(usize, usize, ComponentType, &[u8]) -> Result<()>,
    ) -> Result<()> {
        let Some(a) = self.root.accessors.get(index) else {
            return Err(self.out_of_range(what.into(), index, self.root.accessors.len()).into());
        };
        let key = format!("{what} accessors[{index}]");
        let (Checked::Valid(component), Checked::Valid(type_)) = (a.component_type, a.type_) else {
            return Err(self
                .bad(key, "has an unknown component type or type")
                .remedy("export the file again")
                .into());
        };
        if type_ != dimensions.0 {
            return Err(self
                .bad(key, format!("has elements of type {type_:?}"))
                .allowed(format!("{:?}", dimensions.0))
                .remedy("export the file again")
                .into());
        }
        let (component, count) = (component.0, a.count.0);
        let size = component.size() * dimensions.1;
        match a.buffer_view {
            Some(v) => {
                let (bytes, stride) =
                    self.span(v.value(), a.byte_offset.map_or(0, |o| o.0), count, size, &key)?;
                put(count as usize, usize::MAX, component, &[])?;
                for k in 0..count as usize {
                    put(count as usize, k, component, &bytes[k * stride..k * stride + size])?;
                }
            }
            None if count > MAX_UNBACKED => {
                return Err(self
                    .bad(key, "claims elements that no bytes back")
                    .value(count)
                    .allowed(format!("up to {MAX_UNBACKED}"))
                    .remedy("the file is damaged; export it again")
                    .into());
            }
            None => put(count as usize, usize::MAX, component, &[])?,
        }
        if let Some(s) = &a.sparse {
            let Checked::Valid(index_type) = s.indices.component_type else {
                return Err(self
                    .bad(key, "has sparse indices of an unknown type")
                    .remedy("export the file again")
                    .into());
            };
            let n = s.count.0;
            let at = self.span(
                s.indices.buffer_view.value(),
                s.indices.byte_offset.0,
                n,
                index_type.0.size(),
                &key,
            )?;
            let from = self.span(s.values.buffer_view.value(), s.values.byte_offset.0, n, size, &key)?;
            for k in 0..n as usize {
                let element = unsigned(index_type.0, &at.0[k * at.1..]) as usize;
                if element as u64 >= count {
                    return Err(self
                        .bad(key, format!("sparse index {k} points past the {count} elements"))
                        .value(element)
                        .remedy("export the file again")
                        .into());
                }
                put(count as usize, element, component, &from.0[k * from.1..k * from.1 + size])?;
            }
        }
        Ok(())
    }

    /// Vectors of `N` numbers: floats, or integers as KHR_mesh_quantization and instancing have them.
    fn elements<const N: usize>(&self, index: usize, what: &str) -> Result<Vec<[f64; N]>> {
        let type_ = if N == 3 { Type::Vec3 } else { Type::Vec4 };
        let normalized = self.root.accessors.get(index).is_some_and(|a| a.normalized);
        let mut out: Vec<[f64; N]> = Vec::new();
        self.visit(index, what, (type_, N), |count, k, component, bytes| {
            if k == usize::MAX {
                out.resize(count, [0.0; N]);
                return Ok(());
            }
            let size = component.size();
            for (j, x) in out[k].iter_mut().enumerate() {
                *x = float(component, normalized, &bytes[j * size..]);
            }
            Ok(())
        })?;
        Ok(out)
    }

    fn scalars(&self, index: usize, what: &str) -> Result<Vec<u32>> {
        let mut out: Vec<u32> = Vec::new();
        self.visit(index, what, (Type::Scalar, 1), |count, k, component, bytes| {
            if !matches!(component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32) {
                return Err(self
                    .bad(what, format!("has components of type {component:?}"))
                    .allowed("U8, U16, U32")
                    .remedy("export the file again")
                    .into());
            }
            if k == usize::MAX {
                out.resize(count, 0);
            } else {
                out[k] = unsigned(component, bytes);
            }
            Ok(())
        })?;
        Ok(out)
    }

    /// `extras.catseye` as an object.
    fn extras(&self, extras: &json::Extras, key: &str) -> Result<Option<Map<String, Value>>> {
        let Some(raw) = extras else { return Ok(None) };
        let Ok(Value::Object(mut all)) = serde_json::from_str::<Value>(raw.get()) else { return Ok(None) };
        match all.remove("catseye") {
            None => Ok(None),
            Some(Value::Object(m)) => Ok(Some(m)),
            Some(v) => Err(self
                .bad(key, "is not an object")
                .value(clip(&v.to_string()))
                .remedy("give {\"key\": value, ...}")
                .into()),
        }
    }

    fn unknown_key(&self, prefix: &str, key: &str, known: &[&str]) -> BadInput {
        let b = self.bad(format!("{prefix}.{}", clip(key)), "unknown key").allowed(known.join(", "));
        match nearest(key, known.iter().copied()) {
            Some(n) => b.remedy(format!("did you mean '{n}'?")),
            None => b.remedy("take the key out"),
        }
    }

    fn number(&self, v: &Value, key: &str, range: std::ops::RangeInclusive<f64>) -> Result<f64> {
        v.as_f64().filter(|x| range.contains(x)).ok_or_else(|| {
            self.bad(key, "is not a number in range")
                .value(clip(&v.to_string()))
                .allowed(format!("{}..={}", range.start(), range.end()))
                .remedy("correct it")
                .into()
        })
    }

    fn numbers<const N: usize>(&self, v: &Value, key: &str, limit: f64) -> Result<[f64; N]> {
        let list: Option<Vec<f64>> = v.as_array().map(|a| a.iter().filter_map(Value::as_f64).collect());
        list.filter(|l| v.as_array().is_some_and(|a| a.len() == l.len()))
            .and_then(|l| <[f64; N]>::try_from(l).ok())
            .filter(|l| l.iter().all(|x| x.abs() <= limit))
            .ok_or_else(|| {
                self.bad(key, format!("is not {N} numbers"))
                    .value(clip(&v.to_string()))
                    .allowed(format!("-{limit}..={limit} each"))
                    .remedy("correct it")
                    .into()
            })
    }

    /// Fills `self.materials` for the materials that the scene uses, in file order.
    fn resolve_materials(&mut self, order: &[(usize, Option<usize>)]) -> Result<()> {
        let count = self.root.materials.len();
        let mut used = vec![false; count + 1];
        for (node, _) in order {
            let key = format!("nodes[{node}].extras.catseye");
            if self.extras(&self.root.nodes[*node].extras, &key)?.is_some_and(|m| m.contains_key("rcs_table"))
            {
                continue;
            }
            let Some(mesh) = self.root.nodes[*node].mesh.and_then(|m| self.root.meshes.get(m.value())) else {
                continue;
            };
            for p in &mesh.primitives {
                let solid = matches!(
                    p.mode,
                    Checked::Valid(Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)
                );
                let slot = p.material.map_or(count, |m| m.value());
                if let Some(u) = used.get_mut(slot).filter(|_| solid) {
                    *u |= slot < count || p.material.is_none();
                }
            }
        }
        let names: Vec<String> =
            self.root.materials.iter().map(|m| m.name.clone().unwrap_or_default()).collect();
        for (from, to) in &self.options.material_map {
            material::parse_spec(to)?;
            if !names.contains(from) {
                let b = self.bad("material", "no material of the file has this name").value(clip(from));
                let listed: Vec<&str> = names.iter().filter(|n| !n.is_empty()).map(String::as_str).collect();
                let b = b.allowed(clip_list(&listed));
                return Err(match nearest(from, listed) {
                    Some(n) => b.remedy(format!("did you mean '{n}'?")),
                    None => b.remedy("correct the name"),
                }
                .into());
            }
        }
        let default = self.options.default_material.as_deref().map(material::parse_spec).transpose()?;
        for slot in (0..=count).filter(|s| used[*s]) {
            let m = if slot == count {
                default.clone().ok_or_else(|| {
                    BadInput::new("a surface has no material")
                        .file(self.file)
                        .allowed(material::names().collect::<Vec<_>>().join(", "))
                        .remedy("give --default-material MATERIAL, or materials in the file")
                })?
            } else {
                self.material(slot, &names[slot], default.as_ref())?
            };
            self.materials[slot] = Some(self.scene.material_index(&m));
        }
        Ok(())
    }

    fn material(&mut self, slot: usize, name: &str, default: Option<&Material>) -> Result<Material> {
        if let Some((_, to)) = self.options.material_map.iter().find(|(from, _)| from == name) {
            return material::parse_spec(to);
        }
        let key = format!("materials[{slot}].extras.catseye");
        let extras = self.extras(&self.root.materials[slot].extras, &key)?;
        // Blender numbers copies: "steel.001" is steel.
        let plain =
            name.rsplit_once('.').filter(|(_, n)| n.len() == 3 && n.bytes().all(|b| b.is_ascii_digit()));
        let row =
            material::parse_spec(name).or_else(|e| plain.map_or(Err(e), |(base, _)| material::by_name(base)));
        let Some(extras) = extras else {
            return match (row, default) {
                (Ok(m), _) => Ok(m),
                (Err(_), Some(d)) => {
                    self.note(format!("material '{}' is taken as {}, the default", clip(name), d.name));
                    Ok(d.clone())
                }
                (Err(Error::Input(e)), None) => {
                    Err(e.file(self.file).key(format!("materials[{slot}].name")).value(clip(name)).into())
                }
                (Err(e), None) => Err(e),
            };
        };
        self.custom_material(&key, name, &extras, row.ok())
    }

    /// `[{"material": "water", "thickness_m": 1e-4}, ...]`, the outermost first. Instead of a material's
    /// name, or with it, a layer may have the other keys of a material.
    fn layers(&self, key: &str, value: &Value) -> Result<Vec<Layer>> {
        let list = value.as_array().ok_or_else(|| {
            self.bad(key, "is not a list of layers")
                .value(clip(&value.to_string()))
                .allowed(r#"[{"material": NAME, "thickness_m": x}, ...], the outermost first"#)
        })?;
        list.iter()
            .enumerate()
            .map(|(i, layer)| {
                let key = format!("{key}[{i}]");
                let mut own = layer
                    .as_object()
                    .ok_or_else(|| self.bad(&key, "is not an object").value(clip(&layer.to_string())))?
                    .clone();
                let thickness_key = format!("{key}.thickness_m");
                let (lo, hi) = material::THICKNESS_M;
                let thickness = own.remove("thickness_m").ok_or_else(|| {
                    self.bad(&thickness_key, "is missing")
                        .allowed(format!("{lo:e}..{hi} m"))
                        .remedy("give the layer's thickness in metres")
                })?;
                let thickness_m = self.number(&thickness, &thickness_key, lo..=hi)?;
                let mut text = |name: &str| -> Result<Option<String>> {
                    own.remove(name)
                        .map(|v| {
                            v.as_str().map(str::to_string).ok_or_else(|| {
                                self.bad(format!("{key}.{name}"), "is not a name")
                                    .value(clip(&v.to_string()))
                                    .into()
                            })
                        })
                        .transpose()
                };
                let (row, given) = (text("material")?, text("name")?);
                let name = given.or(row.clone()).unwrap_or_else(|| "layer".into());
                let row = row
                    .map(|n| material::by_name(&n).map_err(|e| self.at(&format!("{key}.material"), e)))
                    .transpose()?;
                let material = match row {
                    Some(m) if own.is_empty() => Material { name, ..m },
                    row => self.custom_material(&key, &name, &own, row)?,
                };
                Layer::new(material, thickness_m).map_err(|e| self.at(&key, e))
            })
            .collect()
    }

    /// A complaint from elsewhere with this file and key.
    fn at(&self, key: &str, e: Error) -> Error {
        match e {
            Error::Input(b) => b.file(self.file).key(key).into(),
            e => e,
        }
    }

    fn custom_material(
        &self,
        prefix: &str,
        name: &str,
        extras: &Map<String, Value>,
        row: Option<Material>,
    ) -> Result<Material> {
        const KEYS: [&str; 9] = [
            "like",
            "eps_r",
            "conductivity_s_per_m",
            "roughness_rms_m",
            "correlation_length_m",
            "backscatter",
            "valid_hz",
            "source",
            "layers",
        ];
        let mut base = row;
        if let Some(like) = extras.get("like") {
            let key = format!("{prefix}.like");
            let like = like
                .as_str()
                .ok_or_else(|| self.bad(&key, "is not a name").value(clip(&like.to_string())))?;
            base = Some(material::parse_spec(like).map_err(|e| match e {
                Error::Input(b) => b.file(self.file).key(key).into(),
                e => e,
            })?);
        }
        let mut eps_r = None;
        let mut conductivity = None;
        let (mut roughness, mut correlation, mut backscatter) = (None, None, None);
        let (mut valid_hz, mut source) = (None, None);
        let mut layers = None;
        for (k, v) in extras {
            let key = format!("{prefix}.{k}");
            match k.as_str() {
                "like" => {}
                "eps_r" => {
                    let [re, loss] = self.numbers::<2>(v, &key, 1e9)?;
                    if re <= 0.0 || loss < 0.0 {
                        return Err(self
                            .bad(
                                key,
                                if loss < 0.0 {
                                    "eps'' is negative, which is gain"
                                } else {
                                    "eps' is not positive"
                                },
                            )
                            .value(clip(&v.to_string()))
                            .allowed("eps' above 0, eps'' (loss) 0 or more")
                            .remedy("give [eps', eps''] with eps = eps' - j eps''")
                            .into());
                    }
                    eps_r = Some([re, loss]);
                }
                "conductivity_s_per_m" => conductivity = Some(self.number(v, &key, 0.0..=1e12)?),
                "roughness_rms_m" => roughness = Some(self.number(v, &key, 0.0..=1.0)?),
                "correlation_length_m" => correlation = Some(self.number(v, &key, 0.0..=1000.0)?),
                "backscatter" => {
                    let text = v
                        .as_str()
                        .ok_or_else(|| self.bad(&key, "is not a string").value(clip(&v.to_string())))?;
                    backscatter = Some(Backscatter::parse(text).map_err(|e| self.at(&key, e))?);
                }
                "valid_hz" => {
                    let list = self.numbers::<2>(v, &key, 1e18)?;
                    if list[0] < 0.0 || list[0] >= list[1] {
                        return Err(self
                            .bad(key, "is not a range")
                            .value(clip(&v.to_string()))
                            .remedy("give [lowest, highest] in hertz")
                            .into());
                    }
                    valid_hz = Some((list[0], list[1]));
                }
                "source" => {
                    source = Some(
                        v.as_str()
                            .ok_or_else(|| self.bad(&key, "is not a string").value(clip(&v.to_string())))?
                            .to_string(),
                    )
                }
                "layers" => layers = Some(self.layers(&key, v)?),
                _ => return Err(self.unknown_key(prefix, k, &KEYS).into()),
            }
        }
        let kind = match (eps_r, conductivity) {
            (Some([eps_real, eps_loss]), s) => {
                Some(MaterialKind::Dielectric { eps_real, eps_loss, conductivity_s_per_m: s.unwrap_or(0.0) })
            }
            (None, Some(conductivity_s_per_m)) => Some(MaterialKind::Conductor { conductivity_s_per_m }),
            (None, None) => None,
        };
        let mut m = match (kind, base) {
            (Some(kind), base) => Material {
                name: name.into(),
                kind,
                roughness_rms_m: base.as_ref().map_or(0.0, |b| b.roughness_rms_m),
                correlation_length_m: base.as_ref().map_or(0.0, |b| b.correlation_length_m),
                backscatter: base.as_ref().and_then(|b| b.backscatter),
                valid_hz: (0.0, f64::INFINITY),
                source: GIVEN.into(),
                layers: base.map_or(Vec::new(), |b| b.layers),
            },
            (None, Some(base)) => Material { name: name.into(), ..base },
            (None, None) => {
                return Err(self
                    .bad(prefix, format!("says nothing of what '{}' is made of", clip(name)))
                    .allowed(KEYS.join(", "))
                    .remedy("give eps_r, conductivity_s_per_m, or like = the name of a table row")
                    .into());
            }
        };
        m.roughness_rms_m = roughness.unwrap_or(m.roughness_rms_m);
        m.correlation_length_m = correlation.unwrap_or(m.correlation_length_m);
        m.backscatter = backscatter.or(m.backscatter);
        m.valid_hz = valid_hz.unwrap_or(m.valid_hz);
        m.source = source.unwrap_or(m.source);
        if let Some(layers) = layers {
            m = m.with_layers(layers).map_err(|e| self.at(prefix, e))?;
        }
        Ok(m)
    }
}

/// Source of a material whose values stand in the file.
const GIVEN: &str = "given in the glTF file";

fn clip_list(list: &[&str]) -> String {
    let shown: Vec<String> = list.iter().take(40).map(|n| clip(n)).collect();
    if shown.is_empty() {
        return "none, the file has no named materials".into();
    }
    shown.join(", ") + if list.len() > 40 { ", ..." } else { "" }
}

/// Forgets the normals of a mesh whose facets are all flat: most files have normals, and most of them
/// say only what the facets say.
fn drop_flat_normals(mesh: &mut Mesh) {
    /// Cosine of the angle between a facet and the normal at its corner that still counts as flat: the
    /// rounding of single precision, on facets a hundred times longer than wide.
    const FLAT: f64 = 1.0 - 1e-8;
    let flat = |t: usize| {
        let [a, b, c] = mesh.triangles[t].map(|i| mesh.positions_m[i as usize]);
        let facet = (b - a).cross(c - a).normalize_or_zero();
        mesh.corner_normals(t).is_none_or(|n| n.iter().all(|n| n.dot(facet) > FLAT))
    };
    if !mesh.normals.is_empty() && (0..mesh.triangles.len()).all(flat) {
        mesh.normals.clear();
    }
}

fn drop_unused_vertices(mesh: &mut Mesh) {
    let mut new: Vec<u32> = vec![u32::MAX; mesh.positions_m.len()];
    for c in mesh.triangles.iter().flatten() {
        new[*c as usize] = 0;
    }
    let mut kept = 0;
    for (old, n) in new.iter_mut().enumerate() {
        if *n == 0 {
            mesh.positions_m[kept] = mesh.positions_m[old];
            if !mesh.normals.is_empty() {
                mesh.normals[kept] = mesh.normals[old];
            }
            *n = kept as u32;
            kept += 1;
        }
    }
    mesh.positions_m.truncate(kept);
    mesh.normals.truncate(kept);
    mesh.triangles.iter_mut().flatten().for_each(|c| *c = new[*c as usize]);
}

/// JSON and binary chunk; plain JSON is returned as it is.
fn split_glb(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    const HEADER: usize = 12;
    if !bytes.starts_with(b"glTF") {
        let first = bytes.iter().find(|b| !b.is_ascii_whitespace());
        // A byte-order mark is allowed by some writers.
        let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        return match first {
            Some(b'{') | Some(0xef) => Ok((text, None)),
            _ => Err("is neither binary glTF (it does not begin with 'glTF') nor JSON".into()),
        };
    }
    let word = |at: usize| -> Option<usize> {
        Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?) as usize)
    };
    let cut = || format!("is cut off after {} bytes", bytes.len());
    let (version, length) = (word(4).ok_or_else(cut)?, word(8).ok_or_else(cut)?);
    if version != 2 {
        return Err(format!("is binary glTF of version {version}, not 2"));
    }
    if length > bytes.len() {
        return Err(format!("is cut off: {} bytes of {length}", bytes.len()));
    }
    let (mut json, mut blob) = (None, None);
    let mut at = HEADER;
    while at + 8 <= length {
        let (size, kind) = (word(at).ok_or_else(cut)?, &bytes[at + 4..at + 8]);
        let Some(data) = bytes.get(at + 8..at + 8 + size) else {
            return Err(format!("has a chunk of {size} bytes that reaches past its end"));
        };
        match kind {
            b"JSON" if json.is_none() => json = Some(data),
            b"BIN\0" if blob.is_none() => blob = Some(data),
            _ => {} // The specification: clients ignore chunks of unknown types.
        }
        at += 8 + size.next_multiple_of(4);
    }
    match json {
        Some(json) => Ok((json, blob)),
        None => Err("is binary glTF without a JSON chunk".into()),
    }
}

/// The bytes behind a buffer's URI: data in base64, or a file in or below the folder.
fn load_uri(file: &Path, folder: Option<&Path>, index: usize, uri: &str) -> Result<Vec<u8>> {
    let bad = |problem: String| {
        BadInput::new(problem).file(file).key(format!("buffers[{index}].uri")).value(clip(uri))
    };
    if let Some(data) = uri.strip_prefix("data:") {
        let Some((_, text)) = data.split_once(";base64,") else {
            return Err(bad("is a data URI without base64".into()).remedy("export as .glb").into());
        };
        return base64(text)
            .ok_or_else(|| bad("is not base64".into()).remedy("export the file again").into());
    }
    let path = beside(file, folder, &format!("buffers[{index}].uri"), uri)?;
    std::fs::read(&path).map_err(|e| Error::io(&path, e))
}

/// The file behind a URI, which lies in or below the folder.
fn beside(file: &Path, folder: Option<&Path>, key: &str, uri: &str) -> Result<PathBuf> {
    let bad = |problem: String| BadInput::new(problem).file(file).key(key).value(clip(uri));
    let outside = || {
        bad("leaves the folder of the file".into())
            .allowed("a relative path in or below that folder, or a data URI")
            .remedy("put it beside the file")
    };
    let name = percent_decoded(uri)
        .ok_or_else(|| bad("is not a valid URI".into()).remedy("export the file again"))?;
    let relative = PathBuf::from(&name);
    let inside = relative.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
    if name.is_empty() || name.contains([':', '\\', '\0']) || !inside {
        return Err(outside().into());
    }
    let Some(folder) = folder else {
        return Err(bad("is a file, and there is no folder to look in".into())
            .remedy("give a .glb file")
            .into());
    };
    let path = folder.join(&relative);
    let missing = |e: std::io::Error| -> Error {
        if e.kind() == std::io::ErrorKind::NotFound {
            bad("the file is missing".into()).remedy("put it beside the .gltf file").into()
        } else {
            Error::io(&path, e)
        }
    };
    // A link may lead anywhere: compare what the names resolve to.
    let real = path.canonicalize().map_err(missing)?;
    let real_folder = folder.canonicalize().map_err(|e| Error::io(folder, e))?;
    if !real.starts_with(&real_folder) {
        return Err(outside().into());
    }
    if !real.is_file() {
        return Err(bad("is not a file".into()).remedy("put it beside the .gltf file").into());
    }
    Ok(real)
}

fn percent_decoded(s: &str) -> Option<String> {
    let mut out = Vec::with_capacity(s.len());
    let mut bytes = s.bytes();
    while let Some(b) = bytes.next() {
        out.push(match b {
            b'%' => {
                let digit = |b: Option<u8>| (b? as char).to_digit(16);
                (digit(bytes.next())? * 16 + digit(bytes.next())?) as u8
            }
            b => b,
        });
    }
    String::from_utf8(out).ok()
}

fn base64(text: &str) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut held) = (0u32, 0);
    let text = text.trim_end_matches('=');
    for c in text.bytes() {
        let v = match c {
            b'A'..=b'Z' => c - b'A',
            b'a'..=b'z' => c - b'a' + 26,
            b'0'..=b'9' => c - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            _ => return None,
        };
        bits = bits << 6 | v as u32;
        held += 6;
        if held >= 8 {
            held -= 8;
            out.push((bits >> held) as u8);
        }
    }
    // A single character left over holds no whole byte.
    (held != 6).then_some(out)
}

fn unsigned(component: ComponentType, bytes: &[u8]) -> u32 {
    match component {
        ComponentType::U8 => bytes[0] as u32,
        ComponentType::U16 => u16::from_le_bytes([bytes[0], bytes[1]]) as u32,
        _ => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
    }
}

/// Integers scaled as section 3.6.2.2 of the glTF 2.0 specification when `normalized`.
fn float(component: ComponentType, normalized: bool, b: &[u8]) -> f64 {
    let (x, max) = match component {
        ComponentType::F32 => return f32::from_le_bytes([b[0], b[1], b[2], b[3]]) as f64,
        ComponentType::I8 => (b[0] as i8 as f64, 127.0),
        ComponentType::U8 => (b[0] as f64, 255.0),
        ComponentType::I16 => (i16::from_le_bytes([b[0], b[1]]) as f64, 32767.0),
        ComponentType::U16 => (u16::from_le_bytes([b[0], b[1]]) as f64, 65535.0),
        ComponentType::U32 => (unsigned(component, b) as f64, u32::MAX as f64),
    };
    if normalized { (x / max).max(-1.0) } else { x }
}

/// Writes the scene as a `.glb` file (under a temporary name, then renamed), and copies its scattering tables
/// to its side. Positions are rounded to single precision, poses are not.
pub fn export(scene: &Scene, path: &Path) -> Result<()> {
    let bytes = to_glb(scene)?;
    for table in &scene.tables {
        let beside = path.with_file_name(table_name(table)?);
        let here = |p: &Path| p.canonicalize().ok();
        if here(&beside).is_some() && here(&beside) == here(table.source()) {
            continue;
        }
        if beside.exists() && !ScatteringTable::read(&beside).is_ok_and(|t| t.sha256() == table.sha256()) {
            return Err(BadInput::new(
                "another file has the name of a scattering table that is to be copied",
            )
            .file(&beside)
            .remedy("write into another folder")
            .into());
        }
        std::fs::copy(table.source(), &beside).map_err(|e| Error::io(&beside, e))?;
    }
    let mut partial = path.as_os_str().to_owned();
    partial.push(".partial");
    let partial = PathBuf::from(partial);
    std::fs::write(&partial, bytes).map_err(|e| Error::io(&partial, e))?;
    std::fs::rename(&partial, path).map_err(|e| Error::io(path, e))
}

fn table_name(table: &ScatteringTable) -> Result<&str> {
    let name = table.source().file_name().and_then(|n| n.to_str());
    name.ok_or_else(|| Error::Failed(format!("no file name: {}", table.source().display())))
}

/// The scene as binary glTF that [`import`] reads back to the same scene; scattering tables by the names of
/// their files. Errors: numbers that are
/// not finite, objects without triangles, more than 4 GiB.
pub fn to_glb(scene: &Scene) -> Result<Vec<u8>> {
    use serde_json::json;
    let failed = |what: String| Error::Failed(format!("cannot write glTF: {what}"));
    let axes = DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X).transpose();
    let mut bin: Vec<u8> = Vec::new();
    let (mut views, mut accessors, mut meshes) = (Vec::new(), Vec::new(), Vec::new());
    for (m, mesh) in scene.meshes.iter().enumerate() {
        if mesh.triangles.is_empty() {
            if scene.objects.iter().any(|o| o.shape == Shape::Mesh(m)) {
                return Err(failed(format!("mesh {m} has no triangles")));
            }
            // Keeps the numbering; a node never refers to it.
            meshes.push(json!({"name": format!("mesh {m}"), "primitives": []}));
            continue;
        }
        let points: Vec<[f32; 3]> =
            mesh.positions_m.iter().map(|p| (axes * *p).as_vec3().to_array()).collect();
        if let Some(p) = points.iter().flatten().find(|x| !x.is_finite()) {
            return Err(failed(format!("mesh {m} has a vertex at {p}")));
        }
        let fold = |f: fn(f32, f32) -> f32| {
            points.iter().skip(1).fold(points[0], |a, p| [f(a[0], p[0]), f(a[1], p[1]), f(a[2], p[2])])
        };
        let (low, high) = (fold(f32::min), fold(f32::max));
        views.push(
            json!({"buffer": 0, "byteOffset": bin.len(), "byteLength": points.len() * 12, "target": 34962}),
        );
        bin.extend(points.iter().flatten().flat_map(|x| x.to_le_bytes()));
        let position = accessors.len();
        accessors.push(json!({"bufferView": views.len() - 1, "componentType": 5126, "type": "VEC3",
            "count": points.len(), "min": low, "max": high}));
        let curved: Vec<bool> = match mesh.normals.is_empty() {
            true => vec![false; mesh.triangles.len()],
            false if mesh.normals.len() != points.len() => {
                return Err(failed(format!("mesh {m} has {} normals", mesh.normals.len())));
            }
            false => (0..mesh.triangles.len()).map(|t| mesh.corner_normals(t).is_some()).collect(),
        };
        let normal = accessors.len();
        if curved.contains(&true) {
            // Flat facets are in primitives of their own without normals, as the format has it; their
            // vertices still need a row here.
            let rows: Vec<[f32; 3]> = (mesh.normals.iter())
                .map(|n| (axes * *n).try_normalize().unwrap_or(DVec3::Y).as_vec3().to_array())
                .collect();
            views.push(
                json!({"buffer": 0, "byteOffset": bin.len(), "byteLength": rows.len() * 12, "target": 34962}),
            );
            bin.extend(rows.iter().flatten().flat_map(|x| x.to_le_bytes()));
            accessors.push(json!({"bufferView": views.len() - 1, "componentType": 5126, "type": "VEC3", "count": rows.len()}));
        }
        // Runs of one material and kind of facet, so that the order of the triangles survives.
        let mut primitives = Vec::new();
        let mut start = 0;
        while start < mesh.triangles.len() {
            let material =
                *mesh.material.get(start).ok_or_else(|| failed(format!("mesh {m} lacks materials")))?;
            let smooth = curved[start];
            let run = mesh.material[start..]
                .iter()
                .zip(&curved[start..])
                .take_while(|x| x == &(&material, &smooth));
            let end = start + run.count();
            let corners = &mesh.triangles[start..end];
            if corners.iter().flatten().any(|c| *c as usize >= points.len())
                || material as usize >= scene.materials.len()
            {
                return Err(failed(format!("mesh {m} points past its vertices or materials")));
            }
            views.push(json!({"buffer": 0, "byteOffset": bin.len(), "byteLength": corners.len() * 12, "target": 34963}));
            bin.extend(corners.iter().flatten().flat_map(|c| c.to_le_bytes()));
            accessors.push(json!({"bufferView": views.len() - 1, "componentType": 5125, "type": "SCALAR", "count": corners.len() * 3}));
            let mut attributes = json!({"POSITION": position});
            if smooth {
                attributes["NORMAL"] = json!(normal);
            }
            primitives.push(
                json!({"attributes": attributes, "indices": accessors.len() - 1, "material": material}),
            );
            start = end;
        }
        meshes.push(json!({"name": format!("mesh {m}"), "primitives": primitives}));
    }
    let mut materials = Vec::new();
    for m in &scene.materials {
        materials.push(material_json(m).map_err(failed)?);
    }
    let mut nodes = Vec::new();
    for o in &scene.objects {
        let mut catseye = json!({"id": o.id});
        if !o.class.is_empty() {
            catseye["class"] = json!(o.class);
        }
        if o.velocity_mps != DVec3::ZERO {
            catseye["velocity_mps"] = json!(o.velocity_mps.to_array());
        }
        let q = o.pose.rotation;
        let (t, v) = (axes * o.pose.translation_m, axes * DVec3::new(q.x, q.y, q.z));
        if !(t.is_finite() && q.is_finite() && o.velocity_mps.is_finite()) {
            return Err(failed(format!("object '{}' has a pose that is not finite", o.name)));
        }
        let mut node = json!({"name": o.name, "translation": t.to_array(), "rotation": [v.x, v.y, v.z, q.w]});
        match o.shape {
            Shape::Mesh(m) if m < scene.meshes.len() => node["mesh"] = json!(m),
            Shape::Mesh(_) => return Err(failed(format!("object '{}' has no mesh", o.name))),
            Shape::Point { rcs_dbsm } if rcs_dbsm.is_finite() => catseye["rcs_dbsm"] = json!(rcs_dbsm),
            Shape::Point { .. } => return Err(failed(format!("object '{}' has no finite RCS", o.name))),
            Shape::Table(t) => match scene.tables.get(t) {
                Some(table) => catseye["rcs_table"] = json!(table_name(table)?),
                None => return Err(failed(format!("object '{}' has no scattering table", o.name))),
            },
        }
        node["extras"] = json!({"catseye": catseye});
        nodes.push(node);
    }
    let mut root = json!({
        "asset": {"version": "2.0", "generator": concat!("catseye ", env!("CARGO_PKG_VERSION"))},
        "scene": 0,
        "scenes": [{"nodes": (0..nodes.len()).collect::<Vec<_>>()}],
    });
    for (key, list) in [
        ("nodes", nodes),
        ("meshes", meshes),
        ("materials", materials),
        ("accessors", accessors),
        ("bufferViews", views),
    ] {
        if !list.is_empty() {
            root[key] = Value::Array(list);
        }
    }
    if !bin.is_empty() {
        root["buffers"] = json!([{"byteLength": bin.len()}]);
    }
    let mut text = serde_json::to_vec(&root).map_err(|e| failed(e.to_string()))?;
    text.resize(text.len().next_multiple_of(4), b' ');
    let bin_chunk = if bin.is_empty() { 0 } else { 8 + bin.len() };
    let total =
        u32::try_from(12 + 8 + text.len() + bin_chunk).map_err(|_| failed("more than 4 GiB".into()))?;
    let mut out = Vec::with_capacity(total as usize);
    out.extend(b"glTF");
    out.extend(2u32.to_le_bytes());
    out.extend(total.to_le_bytes());
    out.extend((text.len() as u32).to_le_bytes());
    out.extend(b"JSON");
    out.extend(text);
    if !bin.is_empty() {
        out.extend((bin.len() as u32).to_le_bytes());
        out.extend(b"BIN\0");
        out.extend(bin);
    }
    Ok(out)
}

fn material_json(m: &Material) -> Result<Value, String> {
    use serde_json::json;
    let shine = match m.kind {
        MaterialKind::Pec | MaterialKind::Conductor { .. } if m.layers.is_empty() => {
            json!({"baseColorFactor": [0.7, 0.72, 0.75, 1.0], "metallicFactor": 1.0, "roughnessFactor": 0.4})
        }
        _ => json!({"baseColorFactor": [0.3, 0.3, 0.3, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.9}),
    };
    let mut out = json!({"name": m.name, "doubleSided": true, "pbrMetallicRoughness": shine});
    let extras = material_extras(m)?;
    if !extras.is_empty() {
        out["extras"] = json!({"catseye": extras});
    }
    Ok(out)
}

/// What has to be said of a material beside its name for import to find it again.
fn material_extras(m: &Material) -> Result<Map<String, Value>, String> {
    use serde_json::json;
    let row = material::parse_spec(&m.name).ok();
    let mut extras = Map::new();
    if row.as_ref() == Some(m) {
        return Ok(extras);
    }
    // What import takes for the rest when it reads this back.
    let mut assumed = Material {
        valid_hz: (0.0, f64::INFINITY),
        source: GIVEN.into(),
        roughness_rms_m: row.as_ref().map_or(0.0, |r| r.roughness_rms_m),
        correlation_length_m: row.as_ref().map_or(0.0, |r| r.correlation_length_m),
        backscatter: row.as_ref().and_then(|r| r.backscatter),
        layers: row.as_ref().map_or(Vec::new(), |r| r.layers.clone()),
        ..m.clone()
    };
    match (&m.kind, row.filter(|r| r.kind == m.kind)) {
        (_, Some(r)) => assumed = r,
        (MaterialKind::Conductor { conductivity_s_per_m }, None) => {
            extras.insert("conductivity_s_per_m".into(), json!(conductivity_s_per_m));
        }
        (MaterialKind::Dielectric { eps_real, eps_loss, conductivity_s_per_m }, None) => {
            extras.insert("eps_r".into(), json!([eps_real, eps_loss]));
            extras.insert("conductivity_s_per_m".into(), json!(conductivity_s_per_m));
        }
        (kind, None) => match material::table().iter().find(|r| r.kind == *kind) {
            Some(r) => {
                extras.insert("like".into(), json!(r.name));
                assumed = r.clone();
            }
            None => return Err(format!("material '{}' follows a law that is in no table row", m.name)),
        },
    }
    if m.roughness_rms_m != assumed.roughness_rms_m {
        extras.insert("roughness_rms_m".into(), json!(m.roughness_rms_m));
    }
    if m.correlation_length_m != assumed.correlation_length_m {
        extras.insert("correlation_length_m".into(), json!(m.correlation_length_m));
    }
    match m.backscatter {
        Some(b) if m.backscatter != assumed.backscatter => {
            extras.insert("backscatter".into(), json!(b.to_string()));
        }
        _ => {}
    }
    if m.valid_hz != assumed.valid_hz {
        extras.insert("valid_hz".into(), json!([m.valid_hz.0, m.valid_hz.1.min(1e18)]));
    }
    if m.source != assumed.source {
        extras.insert("source".into(), json!(m.source));
    }
    if m.layers != assumed.layers {
        let layers = m.layers.iter().map(layer_json).collect::<Result<Vec<_>, _>>()?;
        extras.insert("layers".into(), layers.into());
    }
    Ok(extras)
}

fn layer_json(layer: &Layer) -> Result<Value, String> {
    let m = &layer.material;
    let mut out = material_extras(m)?;
    let is_row = material::by_name(&m.name).is_ok();
    out.insert(if is_row { "material" } else { "name" }.into(), m.name.clone().into());
    out.insert("thickness_m".into(), layer.thickness_m.into());
    Ok(out.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use serde_json::json;

    fn encode(bytes: &[u8]) -> String {
        const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        let mut out = String::new();
        for chunk in bytes.chunks(3) {
            let word = chunk.iter().fold(0u32, |w, b| w << 8 | *b as u32) << (8 * (3 - chunk.len()));
            for k in 0..4 {
                let c = ALPHABET[(word >> (18 - 6 * k) & 63) as usize] as char;
                out.push(if k > chunk.len() { '=' } else { c });
            }
        }
        out
    }

    /// A document with one buffer view and accessor for each list.
    fn document(floats: &[&[[f32; 3]]], indices: &[(u32, &[u32])]) -> Value {
        let mut bin: Vec<u8> = Vec::new();
        let (mut views, mut accessors) = (Vec::new(), Vec::new());
        for list in floats {
            views.push(json!({"buffer": 0, "byteOffset": bin.len(), "byteLength": list.len() * 12}));
            accessors.push(json!({"bufferView": views.len() - 1, "componentType": 5126, "type": "VEC3", "count": list.len()}));
            bin.extend(list.iter().flatten().flat_map(|x| x.to_le_bytes()));
        }
        for (component, list) in indices {
            let size = match component {
                5121 => 1,
                5123 => 2,
                _ => 4,
            };
            views.push(json!({"buffer": 0, "byteOffset": bin.len(), "byteLength": list.len() * size}));
            accessors.push(json!({"bufferView": views.len() - 1, "componentType": component, "type": "SCALAR", "count": list.len()}));
            bin.extend(list.iter().flat_map(|x| x.to_le_bytes()[..size].to_vec()));
            bin.resize(bin.len().next_multiple_of(4), 0);
        }
        json!({
            "asset": {"version": "2.0"},
            "buffers": [{"byteLength": bin.len(), "uri": format!("data:application/octet-stream;base64,{}", encode(&bin))}],
            "bufferViews": views, "accessors": accessors,
            "materials": [{"name": "steel"}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
            "nodes": [{"mesh": 0, "name": "n"}],
        })
    }

    fn read_with(v: &Value, options: &ImportOptions) -> Result<Scene> {
        import_bytes(v.to_string().as_bytes(), Path::new("t.gltf"), None, options)
    }
    fn read(v: &Value) -> Scene {
        read_with(v, &ImportOptions::default()).unwrap()
    }
    fn complaint(v: &Value) -> String {
        let e = read_with(v, &ImportOptions::default()).unwrap_err();
        assert_eq!(e.exit_code(), 2);
        let e = e.to_string();
        assert!(e.starts_with("t.gltf: ") && !e.contains('\n'), "{e}");
        e
    }

    const SQUARE: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

    /// World corners of every triangle, with its material's name.
    fn soup(s: &Scene) -> Vec<([DVec3; 3], String)> {
        let mut out = Vec::new();
        for o in &s.objects {
            let Shape::Mesh(m) = o.shape else { continue };
            let m = &s.meshes[m];
            for (t, k) in m.triangles.iter().zip(&m.material) {
                let corners = t.map(|c| o.pose.point(m.positions_m[c as usize]));
                out.push((corners, s.materials[*k as usize].name.clone()));
            }
        }
        out
    }
    fn area(t: &[DVec3; 3]) -> DVec3 {
        0.5 * (t[1] - t[0]).cross(t[2] - t[0])
    }

    #[test]
    fn axes_unit_and_names() {
        let v = document(&[&[[1.0, 2.0, 3.0], [2.0, 2.0, 3.0], [1.0, 4.0, 3.0]]], &[]);
        let s = read(&v);
        assert_eq!(s.meshes[0].positions_m[0], DVec3::new(3.0, 1.0, 2.0));
        assert_eq!((s.objects[0].name.as_str(), s.objects[0].id), ("n", 1));
        assert_eq!(s.import.triangles, 1);
        // The normal of glTF +Z is forward.
        assert_eq!(area(&soup(&s)[0].0), DVec3::new(1.0, 0.0, 0.0));
        let o = ImportOptions { unit_m: unit_m("mm").unwrap(), up: Up::Z, ..Default::default() };
        let s = read_with(&v, &o).unwrap();
        assert!((s.meshes[0].positions_m[0] - DVec3::new(0.001, 0.002, 0.003)).length() < 1e-12);
        assert!(unit_m("furlong").unwrap_err().to_string().contains("m, cm, mm, in, ft"));
    }

    #[test]
    fn indices_of_every_kind_strips_and_fans() {
        let square: &[[f32; 3]] = &SQUARE;
        let strip: [[f32; 3]; 4] = [SQUARE[0], SQUARE[1], SQUARE[3], SQUARE[2]];
        for (component, mode, points, corners) in [
            (5121, 4, square, &[0u32, 1, 2, 0, 2, 3][..]),
            (5123, 4, square, &[0, 1, 2, 0, 2, 3]),
            (5125, 4, square, &[0, 1, 2, 0, 2, 3]),
            (5123, 5, square, &[0, 1, 3, 2]),
            (5125, 6, square, &[0, 1, 2, 3]),
            (0, 5, &strip[..], &[]),
            (0, 6, square, &[]),
        ] {
            let mut v = if component == 0 {
                document(&[points], &[])
            } else {
                document(&[points], &[(component, corners)])
            };
            let p = &mut v["meshes"][0]["primitives"][0];
            p["mode"] = json!(mode);
            if component != 0 {
                p["indices"] = json!(1);
            }
            let s = read(&v);
            let t = soup(&s);
            assert_eq!(t.len(), 2, "{component} {mode}");
            for (t, _) in &t {
                assert_eq!(area(t), DVec3::new(0.5, 0.0, 0.0), "{component} {mode}");
            }
            assert_eq!(s.meshes[0].positions_m.len(), 4);
        }
    }

    #[test]
    fn stride_sparse_and_quantised_positions() {
        // Position and normal interleaved.
        let rows: Vec<[f32; 3]> = SQUARE[..3].iter().flat_map(|p| [*p, [9.0, 9.0, 9.0]]).collect();
        let mut v = document(&[&rows], &[]);
        v["bufferViews"][0]["byteStride"] = json!(24);
        v["accessors"][0]["count"] = json!(3);
        assert_eq!(area(&soup(&read(&v))[0].0), DVec3::new(0.5, 0.0, 0.0));

        // Corner 2 of the triangle is replaced; then all come from the replacement, over zeros.
        let mut v = document(&[&SQUARE[..3], &[[0.0, 2.0, 0.0]]], &[(5123, &[2])]);
        let sparse = json!({"count": 1, "indices": {"bufferView": 2, "componentType": 5123}, "values": {"bufferView": 1}});
        v["accessors"][0]["sparse"] = sparse;
        assert_eq!(area(&soup(&read(&v))[0].0), DVec3::new(1.0, 0.0, 0.0));
        let mut v = document(&[&SQUARE[..3]], &[(5121, &[1, 2, 3])]);
        let a = &mut v["accessors"][0];
        a["count"] = json!(4);
        a.as_object_mut().unwrap().remove("bufferView");
        a["sparse"] = json!({"count": 3, "indices": {"bufferView": 1, "componentType": 5121}, "values": {"bufferView": 0}});
        v["meshes"][0]["primitives"][0]["mode"] = json!(5);
        // Vertices 0, S0 = 0, S1, S2: the first triangle has no area, the second is S0, S2, S1.
        let s = read(&v);
        assert_eq!(s.import.degenerate_triangles_dropped, 1);
        assert_eq!(area(&soup(&s)[0].0), DVec3::new(-0.5, 0.0, 0.0));

        // Bytes: 127 is 1 when normalised.
        let bytes: Vec<u32> = vec![0, 0, 0, 0, 127, 0, 0, 0, 127, 127, 0, 0];
        let mut v = document(&[], &[(5121, &bytes)]);
        v["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        v["bufferViews"][0]["byteStride"] = json!(4);
        v["accessors"][0] =
            json!({"bufferView": 0, "componentType": 5120, "normalized": true, "type": "VEC3", "count": 3});
        assert_eq!(area(&soup(&read(&v))[0].0), DVec3::new(0.5, 0.0, 0.0));
    }

    #[test]
    fn hierarchy_scale_and_mirror() {
        let mut v = document(&[&SQUARE], &[(5123, &[0, 1, 2, 0, 2, 3])]);
        v["meshes"][0]["primitives"][0]["indices"] = json!(1);
        let h = std::f64::consts::FRAC_1_SQRT_2;
        // 90 degrees about glTF Y (up), that is a yaw of 90 degrees to the left.
        v["nodes"] = json!([
            {"children": [1, 2, 3], "rotation": [0, h, 0, h], "translation": [0, 0, 10.000000001]},
            {"mesh": 0, "name": "plain"},
            {"mesh": 0, "name": "twice", "scale": [2, 2, 2], "translation": [5, 0, 0]},
            {"mesh": 0, "name": "mirrored", "matrix": [-1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]},
        ]);
        let s = read(&v);
        assert_eq!(
            s.objects.iter().map(|o| o.name.as_str()).collect::<Vec<_>>(),
            ["plain", "twice", "mirrored"]
        );
        assert_eq!(s.meshes.len(), 3, "scaled and mirrored copies");
        let t = soup(&s);
        // +Z of glTF (forward) turned left is +y; the translation keeps its double precision.
        for (k, normal) in [(0, 0.5), (2, 2.0), (4, 0.5)] {
            assert!((area(&t[k].0) - DVec3::new(0.0, normal, 0.0)).length() < 1e-12, "{k} {:?}", t[k]);
        }
        assert_eq!(s.objects[0].pose.translation_m.x, 10.000000001);
        // glTF +X is left; turned left it points back.
        let at = s.objects[1].pose.translation_m;
        assert!((at - DVec3::new(10.000000001 - 5.0, 0.0, 0.0)).length() < 1e-12, "{at}");
        // Left of the node is behind it in the world; the mirrored one reaches to the other side.
        let reach = |k: usize| {
            let x: Vec<f64> = t[k..k + 2].iter().flat_map(|(c, _)| c.map(|p| p.x - 10.0)).collect();
            (
                x.iter().copied().fold(f64::INFINITY, f64::min),
                x.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            )
        };
        assert!((reach(0).0 + 1.0).abs() < 1e-8 && reach(0).1.abs() < 1e-8, "{:?}", reach(0));
        assert!((reach(4).1 - 1.0).abs() < 1e-8 && reach(4).0.abs() < 1e-8, "{:?}", reach(4));
        for o in &s.objects {
            assert!((o.pose.rotation.length() - 1.0).abs() < 1e-12);
        }
    }

    /// A chain of arbitrary transforms gives the same points as the product of their 4x4 matrices.
    fn transform() -> impl Strategy<Value = (Value, DAffine3)> {
        let v = || prop::array::uniform3(-3.0f64..3.0);
        (v(), prop::array::uniform4(-1.0f64..1.0), v(), prop::bool::ANY).prop_filter_map(
            "degenerate",
            |(t, q, s, scaled)| {
                let q = DQuat::from_array(q);
                if q.length() < 0.1 || s.iter().any(|x| x.abs() < 0.1) {
                    return None;
                }
                let (q, s) = (q.normalize(), if scaled { s } else { [1.0; 3] });
                let m = DAffine3::from_scale_rotation_translation(s.into(), q, t.into());
                Some((json!({"translation": t, "rotation": q.to_array(), "scale": s}), m))
            },
        )
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn chains_of_nodes_are_matrix_products(chain in prop::collection::vec(transform(), 1..5)) {
            let mut v = document(&[&SQUARE[..3]], &[]);
            let mut product = DAffine3::IDENTITY;
            let mut nodes = Vec::new();
            for (i, (node, m)) in chain.iter().enumerate() {
                let mut node = node.clone();
                if i + 1 < chain.len() { node["children"] = json!([i + 1]); } else { node["mesh"] = json!(0); }
                nodes.push(node);
                product *= *m;
            }
            v["nodes"] = json!(nodes);
            let s = read(&v);
            let expected: Vec<DVec3> = SQUARE[..3].iter().map(|p| {
                let p = product.transform_point3(DVec3::new(p[0] as f64, p[1] as f64, p[2] as f64));
                DVec3::new(p.z, p.x, p.y)
            }).collect();
            let mut got = soup(&s)[0].0;
            if product.matrix3.determinant() < 0.0 {
                got.swap(1, 2);
            }
            // Rotations within 2e-6 of rigid are made rigid, so single-precision tolerance.
            for (a, b) in got.iter().zip(&expected) {
                prop_assert!((*a - *b).length() < 1e-5 * (1.0 + b.length()), "{a} {b}");
            }
        }
    }

    #[test]
    fn instances_share_their_mesh() {
        let mut v = document(&[&SQUARE[..3], &[[0.0, 0.0, 0.0], [0.0, 0.0, 4.0], [1.0, 0.0, 8.0]]], &[]);
        v["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
        v["nodes"] = json!([
            {"mesh": 0, "name": "post", "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 1}}}},
            {"mesh": 0, "name": "other"},
        ]);
        let s = read(&v);
        assert_eq!((s.meshes.len(), s.objects.len()), (1, 4));
        assert_eq!(s.objects[2].name, "post 2");
        assert_eq!(s.objects[2].pose.translation_m, DVec3::new(8.0, 1.0, 0.0));
        let ids: HashSet<u32> = s.objects.iter().map(|o| o.id).collect();
        assert_eq!(ids.len(), 4);
    }

    #[test]
    fn extras_of_nodes() {
        let mut v = document(&[&SQUARE[..3]], &[]);
        v["nodes"] = json!([
            {"children": [1, 2, 3], "extras": {"catseye": {"class": "car", "velocity_mps": [10, 0.5, 0]}, "other": 1}},
            {"mesh": 0, "extras": {"catseye": {"class": "wheel", "id": 1}}},
            {"mesh": 0},
            {"name": "lamp", "translation": [1, 2, 3], "extras": {"catseye": {"rcs_dbsm": -3.5, "id": 7}}},
        ]);
        let s = read(&v);
        let got: Vec<_> = s.objects.iter().map(|o| (o.id, o.class.as_str())).collect();
        assert_eq!(got, [(1, "wheel"), (2, "car"), (7, "car")]);
        assert!(s.objects.iter().all(|o| o.velocity_mps == DVec3::new(10.0, 0.5, 0.0)));
        assert_eq!(s.objects[2].shape, Shape::Point { rcs_dbsm: -3.5 });
        assert_eq!(s.objects[2].pose.translation_m, DVec3::new(3.0, 1.0, 2.0));
        for (extras, expect) in [
            (
                json!({"clas": "x"}),
                "nodes[0].extras.catseye.clas: unknown key; allowed: class, velocity_mps, id, rcs_dbsm, rcs_table; did you mean 'class'?",
            ),
            (json!({"id": 0}), "is not an id; allowed: 1..=4294967295"),
            (json!({"velocity_mps": [1, 2]}), "is not 3 numbers"),
            (json!({"velocity_mps": [1, 2, "3"]}), "is not 3 numbers"),
            (json!({"rcs_dbsm": 3}), "has a mesh and rcs_dbsm"),
            (json!({"class": 3}), "is not a class name"),
            (json!([]), "is not an object"),
        ] {
            v["nodes"] = json!([{"mesh": 0, "extras": {"catseye": extras}}]);
            let e = complaint(&v);
            assert!(e.contains(expect), "{e}");
        }
        v["nodes"] = json!([{"mesh": 0, "extras": {"catseye": {"id": 3}}}, {"mesh": 0, "extras": {"catseye": {"id": 3}}}]);
        assert!(complaint(&v).contains("nodes[1].extras.catseye.id = 3: is given twice"));
    }

    #[test]
    fn materials() {
        let mut v = document(&[&SQUARE[..3]], &[]);
        let given = |v: &Value| read(v).materials[0].clone();
        v["materials"] = json!([{"name": "steel.002"}]);
        assert_eq!(given(&v).name, "steel");
        v["materials"] = json!([{"name": "asphalt", "extras": {"catseye": {"roughness_rms_m": 0.0005}}}]);
        let m = given(&v);
        assert_eq!((m.roughness_rms_m, m.kind), (0.0005, material::by_name("asphalt").unwrap().kind));
        v["materials"] = json!([{"name": "mud", "extras": {"catseye": {"eps_r": [9, 2.5], "correlation_length_m": 0.01}}}]);
        let m = given(&v);
        let eps = m.eps_r(24e9).unwrap().unwrap();
        assert_eq!((eps.re, eps.im, m.correlation_length_m), (9.0, -2.5, 0.01));
        for (extras, expect) in [
            (json!({"eps_r": [3, -0.1]}), "eps_r = [3,-0.1]: eps'' is negative, which is gain"),
            (json!({"eps_r": [0, 0.1]}), "eps' is not positive"),
            (json!({"eps_r": 3}), "is not 2 numbers"),
            (json!({"eps": [3, 1]}), "materials[0].extras.catseye.eps: unknown key; allowed: like, eps_r"),
            (json!({"layers": []}), "says nothing of what 'mud' is made of"),
            (json!({"like": "steel", "layers": 3}), "extras.catseye.layers = 3: is not a list of layers"),
            (
                json!({"like": "steel", "layers": [{"material": "water"}]}),
                "layers[0].thickness_m: is missing",
            ),
            (
                json!({"like": "steel", "layers": [{"material": "water", "thickness_m": -1}]}),
                "layers[0].thickness_m = -1: is not a number in range; allowed: 0.000000001..=10",
            ),
            (
                json!({"like": "steel", "layers": [{"material": "watre", "thickness_m": 1e-4}]}),
                "layers[0].material: no material is named 'watre'",
            ),
            (
                json!({"like": "steel", "layers": [{"material": "water", "thickness_m": 1e-4, "wet": 1}]}),
                "layers[0].wet: unknown key",
            ),
            (
                json!({"like": "steel", "layers": [{"material": "pec", "thickness_m": 1e-4}]}),
                "layers[0] = 0.0001: a perfect conductor hides what is under it",
            ),
            (
                json!({"like": "steel", "layers": vec![json!({"material": "ice", "thickness_m": 1e-4}); 17]}),
                "too many layers; allowed: at most 16",
            ),
            (json!({"like": "stell"}), "did you mean 'steel'?"),
            (json!({"conductivity_s_per_m": -1}), "is not a number in range; allowed: 0..="),
            (json!({}), "says nothing of what 'mud' is made of"),
        ] {
            v["materials"] = json!([{"name": "mud", "extras": {"catseye": extras}}]);
            let e = complaint(&v);
            assert!(e.contains(expect), "{e}");
        }
        v["materials"] = json!([{"name": "Stahl"}]);
        let e = complaint(&v);
        assert!(
            e.contains("materials[0].name = Stahl: no material is named")
                && e.contains("asphalt")
                && e.contains("--default-material"),
            "{e}"
        );
        let mut o = ImportOptions { default_material: Some("copper".into()), ..Default::default() };
        let s = read_with(&v, &o).unwrap();
        assert_eq!(s.materials[0].name, "copper");
        assert!(s.import.notes[0].contains("'Stahl' is taken as copper"));
        o.material_map = vec![("Stahl".into(), "steel".into())];
        assert_eq!(read_with(&v, &o).unwrap().materials[0].name, "steel");
        o.material_map = vec![("Stahll".into(), "steel".into())];
        assert!(read_with(&v, &o).unwrap_err().to_string().contains("did you mean 'Stahl'?"));
        o.material_map = vec![("Stahl".into(), "stee".into())];
        assert!(read_with(&v, &o).unwrap_err().to_string().contains("did you mean 'steel'?"));
        v["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("material");
        assert!(complaint(&v).contains("a surface has no material"));
        o.material_map.clear();
        assert_eq!(read_with(&v, &o).unwrap().materials[0].name, "copper");
    }

    #[test]
    fn degenerate_triangles_are_dropped_and_counted() {
        let mut v = document(&[&SQUARE], &[(5123, &[0, 1, 2, 0, 0, 1, 0, 1, 1, 0, 2, 3])]);
        v["meshes"][0]["primitives"][0]["indices"] = json!(1);
        let s = read(&v);
        assert_eq!((s.import.triangles, s.import.degenerate_triangles_dropped), (2, 2));
        v["nodes"][0]["scale"] = json!([1, 0, 1]);
        assert!(complaint(&v).contains("the scene has no triangles (4 had no area) and no point targets"));
        v["nodes"][0] = json!({"mesh": 0});
        v["meshes"][0]["primitives"][0]["mode"] = json!(1);
        assert!(complaint(&v).contains("no triangles"));
    }

    fn example() -> Scene {
        let mut s = Scene::default();
        for name in ["steel", "asphalt", "water", "pec"] {
            s.materials.push(material::by_name(name).unwrap());
        }
        s.materials.push(Material {
            name: "mud".into(),
            kind: MaterialKind::Dielectric { eps_real: 9.5, eps_loss: 2.25, conductivity_s_per_m: 0.125 },
            roughness_rms_m: 0.001,
            correlation_length_m: 0.02,
            backscatter: Some(Backscatter::parse("gamma:-18.5,cross_db=-9").unwrap()),
            valid_hz: (76e9, 81e9),
            source: "a guess".into(),
            layers: Vec::new(),
        });
        let snow = Some(Backscatter::parse("kulemin:snow").unwrap());
        s.materials.push(Material { backscatter: snow, ..material::by_name("ice").unwrap() });
        s.materials.push(Material { name: "puddle".into(), ..material::by_name("water").unwrap() });
        s.materials.push(Material { roughness_rms_m: 0.0004, ..material::by_name("concrete").unwrap() });
        s.materials.push(material::parse_spec("air+glass:0.004").unwrap());
        let wet = Material {
            name: "wet paint".into(),
            ..material::parse_spec("steel+paint-white:0.0003").unwrap()
        };
        let brine = Material {
            name: "brine".into(),
            kind: MaterialKind::Dielectric { eps_real: 8.0, eps_loss: 15.0, conductivity_s_per_m: 5.0 },
            valid_hz: (70e9, 80e9),
            source: "a test".into(),
            ..Material::pec()
        };
        let mut layers = wet.layers.clone();
        layers.insert(0, Layer { material: brine, thickness_m: 1e-4 });
        layers.insert(
            0,
            Layer {
                material: Material { roughness_rms_m: 1e-4, ..material::by_name("ice").unwrap() },
                thickness_m: 2e-4,
            },
        );
        s.materials.push(wet.with_layers(layers).unwrap());
        s.materials.push(Material {
            name: "tin".into(),
            kind: MaterialKind::Conductor { conductivity_s_per_m: 8.7e6 },
            roughness_rms_m: 0.0,
            correlation_length_m: 0.0,
            backscatter: None,
            valid_hz: (0.0, f64::INFINITY),
            source: GIVEN.into(),
            layers: Vec::new(),
        });
        let n = s.materials.len() as u32;
        let points = (0..n + 2).map(|k| DVec3::new((k * k) as f64, k as f64, (k % 3) as f64 * 0.5)).collect();
        let triangles: Vec<[u32; 3]> = (0..n).map(|k| [k, k + 1, k + 2]).collect();
        let pose = Pose::from_yaw_pitch_roll(DVec3::new(12.345678901234, -3.5, 0.25), 0.7, -0.1, 0.05);
        let mesh = Mesh { positions_m: points, triangles, material: (0..n).collect(), normals: Vec::new() };
        let shared = s.add_mesh("body \"x\"", "car", mesh, pose);
        s.add_object("again", "", Shape::Mesh(0), Pose::IDENTITY, DVec3::new(1.0, -2.0, 0.5));
        s.add_object("lamp", "pole", Shape::Point { rcs_dbsm: -12.5 }, pose, DVec3::ZERO);
        s.objects[0].id = shared + 40;
        s
    }

    #[test]
    fn export_reads_back_to_the_same_scene() {
        let a = example();
        let bytes = to_glb(&a).unwrap();
        let b = import_bytes(&bytes, Path::new("x.glb"), None, &ImportOptions::default()).unwrap();
        assert_eq!(a.materials, b.materials);
        assert_eq!(a.meshes, b.meshes, "these vertices are exact in single precision");
        assert_eq!(a.objects.len(), b.objects.len());
        for (x, y) in a.objects.iter().zip(&b.objects) {
            assert_eq!(
                (x.id, &x.name, &x.class, x.shape, x.velocity_mps),
                (y.id, &y.name, &y.class, y.shape, y.velocity_mps)
            );
            assert_eq!(x.pose.translation_m, y.pose.translation_m);
            let (p, q) = (x.pose.rotation, y.pose.rotation);
            assert!((p.dot(q).abs() - 1.0).abs() < 1e-15, "{p} {q}");
        }
        // And what is read writes the same bytes but for the last digit of rotations.
        let c =
            import_bytes(&to_glb(&b).unwrap(), Path::new("x.glb"), None, &ImportOptions::default()).unwrap();
        assert_eq!(b.meshes, c.meshes);
    }

    #[test]
    fn export_refuses_what_cannot_be_read() {
        let mut s = example();
        s.objects[0].pose.translation_m.x = f64::NAN;
        assert!(to_glb(&s).unwrap_err().to_string().contains("not finite"));
        let mut s = example();
        s.meshes[0].positions_m[1].z = 1e300;
        assert!(to_glb(&s).unwrap_err().to_string().contains("has a vertex at inf"));
        let mut s = example();
        s.meshes[0].triangles[0][0] = 99;
        assert!(to_glb(&s).is_err());
    }
}
