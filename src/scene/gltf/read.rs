//! The importer: what it holds, and the order in which it reads.

use super::container::{load_uri, split_glb};
use super::importer::Channels;
use super::importer::{Ids, Importer, Inherited, NodeExtras, Precise};
use super::options::{HARMLESS, ImportOptions};
use crate::base::error::{BadInput, Error, Result, json_in_words};
use crate::formats::text::of_other_kind;
use crate::scene::Scene;
use crate::scene::tidy::tidy;
use crate::scene::toml_file::clip;
use gltf::json;
use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// The document without the channels that move something else than a node (KHR_animation_pointer), for which
/// `gltf::json` has no place; None when that is not what is wrong with it.
fn without_pointers(text: &[u8]) -> Option<json::Root> {
    let mut root: serde_json::Value = serde_json::from_slice(text).ok()?;
    let mut found = false;
    for channels in
        root.get_mut("animations")?.as_array_mut()?.iter_mut().filter_map(|a| a.get_mut("channels"))
    {
        channels.as_array_mut()?.retain(|c| {
            let keep = c.pointer("/target/node").is_some();
            found |= !keep;
            keep
        });
    }
    if found { json::Root::from_slice(&serde_json::to_vec(&root).ok()?).ok() } else { None }
}

impl<'a> Importer<'a> {
    pub(super) fn open(
        bytes: &'a [u8],
        file: &'a Path,
        folder: Option<&'a Path>,
        options: &'a ImportOptions,
    ) -> Result<Self> {
        let bad = |problem: String| BadInput::new(problem).file(file);
        options.check_unit()?;
        if bytes.is_empty() {
            return Err(bad("the file is empty".into()).remedy("give a .glb or .gltf file").into());
        }
        let (text, blob) = split_glb(bytes).map_err(|problem| {
            let other = of_other_kind(bytes, file, "glTF").filter(|_| !bytes.starts_with(b"glTF"));
            other.unwrap_or_else(|| bad(problem).remedy("export the file again as binary glTF 2.0"))
        })?;
        let not_json = |e: serde_json::Error| {
            let place = if e.line() > 0 {
                format!("line {} column {}: ", e.line(), e.column())
            } else {
                String::new()
            };
            bad(format!("is not glTF JSON: {place}{}", clip(&json_in_words(&e))))
                .remedy("give a .glb or .gltf file")
        };
        let mut pointers = false;
        let root = json::Root::from_slice(text)
            .or_else(|e| {
                pointers = true;
                without_pointers(text).ok_or(e)
            })
            .map_err(not_json)?;
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
        let materials = vec![None; root.materials.len() + 1];
        let mut importer = Importer {
            file,
            folder,
            options,
            root,
            nodes: precise.nodes,
            buffers,
            axes: options.up.axes(),
            scene: Scene::default(),
            vertices: 0,
            materials,
            meshes: HashMap::new(),
            tables: HashMap::new(),
            moves: HashMap::new(),
            joints: 0,
            channels: Channels::default(),
            notes: HashSet::new(),
        };
        if pointers {
            importer.note("animations that move more than nodes are left out".into());
        }
        Ok(importer)
    }

    pub(super) fn bad(&self, key: impl Into<String>, problem: impl Into<String>) -> BadInput {
        BadInput::new(problem).file(self.file).key(key)
    }

    /// Each note once, in the order in which they came up.
    pub(super) fn note(&mut self, text: String) {
        if self.scene.import.notes.len() < 100 && self.notes.insert(text.clone()) {
            self.scene.import.notes.push(text);
        }
    }

    pub(super) fn run(mut self) -> Result<Scene> {
        let roots = self.roots()?;
        let order = self.walk(&roots);
        self.resolve_materials(&order)?;
        self.read_channels()?;
        let mut extras: Vec<NodeExtras> = Vec::new();
        extras.resize_with(self.nodes.len(), NodeExtras::default);
        for (node, _) in &order {
            extras[*node] = self.node_extras(*node)?;
        }
        let own: Vec<bool> = extras.iter().map(|e| e.motion.is_some()).collect();
        self.read_animations(&own)?;
        let start = Inherited { radar: true, ..Inherited::default() };
        let mut inherited: Vec<Option<Inherited>> = vec![None; self.nodes.len()];
        for (node, parent) in &order {
            let above = parent.and_then(|p| inherited[p].as_ref()).unwrap_or(&start);
            let here = self.inherit(*node, above, &extras[*node])?;
            inherited[*node] = Some(here);
        }
        // Ids that the file gives come first, so that the others can avoid them.
        let mut ids = Ids::default();
        for (node, _) in &order {
            self.node(*node, &extras[*node], &inherited, &mut ids)?;
        }
        let mut next = 1;
        for (object, given) in self.scene.objects.iter_mut().zip(ids.given) {
            object.id = match given {
                Some(id) => id,
                None => {
                    while ids.all.contains(&next) {
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
        // What this program wrote needs no second look: its normals are those of its surfaces.
        let is_own = self.root.asset.generator.as_ref().is_some_and(|g| g.starts_with("catseye "));
        if !is_own || self.options.smooth_deg.is_some() {
            tidy(&mut self.scene, self.options.smooth_deg, false);
        }
        self.scene.import.triangles = self.scene.triangle_count();
        Ok(self.scene)
    }

    /// The nodes from which the scene hangs. Errors: cycles, two parents, indices out of range.
    pub(super) fn roots(&self) -> Result<Vec<usize>> {
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
                        "lists a child twice".into()
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

    pub(super) fn out_of_range(&self, key: String, index: usize, len: usize) -> BadInput {
        let allowed =
            if len == 0 { "none, there are no such entries".into() } else { format!("0..={}", len - 1) };
        self.bad(key, "is out of range").value(index).allowed(allowed).remedy("export the file again")
    }

    /// (node, parent) in file order, parents first.
    pub(super) fn walk(&self, roots: &[usize]) -> Vec<(usize, Option<usize>)> {
        let mut order = Vec::new();
        let mut stack: Vec<_> = roots.iter().rev().map(|r| (*r, None)).collect();
        while let Some((i, parent)) = stack.pop() {
            order.push((i, parent));
            let children: Vec<_> = self.root.nodes[i].children.iter().flatten().collect();
            stack.extend(children.into_iter().rev().map(|c| (c.value(), Some(i))));
        }
        order
    }

    /// A complaint from elsewhere with this file and key.
    pub(super) fn at(&self, key: &str, e: Error) -> Error {
        match e {
            Error::Input(b) => b.file(self.file).key(key).into(),
            e => e,
        }
    }
}
