//! From a node to its objects.

use super::container::beside;
use super::importer::{Chain, Ids, Moves, NodeExtras};
use super::importer::{Importer, Inherited};
use super::options::MAX_OBJECTS;
use crate::base::error::Result;
use crate::base::frames::{Pose, Target, World};
use crate::scene::motion::Motion;
use crate::scene::scatterer::ScatteringTable;
use crate::scene::toml_file::clip;
use crate::scene::{Object, Shape};
use glam::{DAffine3, DMat3, DQuat, DVec3};
use serde_json::{Map, Value};
use std::sync::Arc;

/// Where an object is and how it moves there.
enum Stand {
    Still(Pose<Target, World>),
    Moving(Motion),
}

impl Importer<'_> {
    pub(super) fn node_extras(&mut self, i: usize) -> Result<NodeExtras> {
        const KEYS: [&str; 7] = ["class", "velocity_mps", "id", "rcs_dbsm", "rcs_table", "motion", "radar"];
        let place = format!("nodes[{i}].extras.catseye");
        let mut known = NodeExtras::default();
        let extras = self.extras(&self.root.nodes[i].extras, &place)?;
        for (k, v) in extras.iter().flat_map(|m| m.iter()) {
            let key = format!("{place}.{k}");
            match k.as_str() {
                "class" => match v.as_str() {
                    Some(c) if c.len() <= 200 && !c.contains(char::is_control) => {
                        known.class = Some(c.into())
                    }
                    _ => {
                        return Err(self
                            .bad(key, "is not a class name")
                            .value(clip(&v.to_string()))
                            .remedy("give a string")
                            .into());
                    }
                },
                "velocity_mps" => known.velocity_mps = Some(self.numbers::<3>(v, &key, 1e5)?.into()),
                "id" => match v.as_u64().and_then(|x| u32::try_from(x).ok()).filter(|x| *x > 0) {
                    Some(x) => known.id = Some(x),
                    None => {
                        return Err(self
                            .bad(key, "is not an id")
                            .value(clip(&v.to_string()))
                            .allowed("1..=4294967295")
                            .remedy("give a whole number")
                            .into());
                    }
                },
                "rcs_dbsm" => known.rcs_dbsm = Some(self.number(v, &key, -200.0..=200.0)?),
                "rcs_table" => match v.as_str() {
                    Some(name) => known.rcs_table = Some(self.table(&key, name)?),
                    None => {
                        return Err(self
                            .bad(key, "is not the path of a file")
                            .value(clip(&v.to_string()))
                            .remedy("give a string")
                            .into());
                    }
                },
                "motion" => known.motion = Some(self.joints(&key, v)?),
                "radar" => match v.as_bool() {
                    Some(seen) => known.radar = Some(seen),
                    None => {
                        return Err(self
                            .bad(key, "is not true or false")
                            .value(clip(&v.to_string()))
                            .allowed("true, false")
                            .remedy("give false for a body that only labels, images and lidar show")
                            .into());
                    }
                },
                _ => return Err(self.unknown_key(&place, k, &KEYS).into()),
            }
        }
        Ok(known)
    }

    /// What a node hands down, from what it has been handed.
    pub(super) fn inherit(&mut self, i: usize, above: &Inherited, extras: &NodeExtras) -> Result<Inherited> {
        let mut here = Inherited { transform: above.transform * self.local(i)?, ..above.clone() };
        let t = here.transform;
        if !(t.matrix3.is_finite() && t.translation.is_finite() && t.translation.length() < 1e12) {
            return Err(self
                .bad(format!("nodes[{i}]"), "its transform is not finite")
                .remedy("check its scale and its parents'")
                .into());
        }
        if let Some(class) = &extras.class {
            here.class.clone_from(class);
        }
        here.velocity_mps = extras.velocity_mps.unwrap_or(here.velocity_mps);
        here.radar = extras.radar.unwrap_or(here.radar);
        let moves = extras.motion.is_some() || self.moves.get(&i).is_some_and(Moves::any);
        if moves {
            here.mover = Some(i);
        }
        here.chain = match &above.chain {
            Some(chain) => Some(self.follow(chain, i, extras.motion.as_deref())?),
            None if moves => {
                let (pose, rest) = self.place(&above.transform);
                Some(self.follow(&Chain::new(&pose, rest), i, extras.motion.as_deref())?)
            }
            None => None,
        };
        Ok(here)
    }

    /// Adds the objects of a node.
    pub(super) fn node(
        &mut self,
        i: usize,
        extras: &NodeExtras,
        inherited: &[Option<Inherited>],
        ids: &mut Ids,
    ) -> Result<()> {
        let Some(here) = &inherited[i] else { return Ok(()) };
        let &NodeExtras { id, rcs_dbsm, rcs_table, .. } = extras;
        let node = &self.root.nodes[i];
        let mesh = node.mesh.map(|m| m.value());
        let skin = node.skin.map(|s| s.value()).filter(|_| rcs_table.is_none());
        let name = node.name.clone().filter(|n| !n.is_empty());
        let instancing =
            node.extensions.as_ref().and_then(|e| e.others.get("EXT_mesh_gpu_instancing")).cloned();
        let key = format!("nodes[{i}]");
        if rcs_dbsm.is_some() && mesh.is_some() {
            return Err(self
                .bad(key, "a mesh and rcs_dbsm exclude each other")
                .remedy("give rcs_dbsm to a node without a mesh")
                .into());
        }
        if rcs_dbsm.is_some() && rcs_table.is_some() {
            return Err(self
                .bad(key, "rcs_dbsm and rcs_table exclude each other")
                .remedy("keep one of the two")
                .into());
        }
        if let Some(id) = id {
            let several = instancing.is_some() || mesh.is_some() && skin.is_some();
            if mesh.is_none() && rcs_dbsm.is_none() && rcs_table.is_none() || several {
                return Err(self
                    .bad(format!("{key}.extras.catseye.id"), "an id is only allowed on a node that is one object")
                    .remedy("give ids to the nodes with a mesh, rcs_dbsm or rcs_table, without instancing or skin")
                    .into());
            }
            if !ids.all.insert(id) {
                return Err(self
                    .bad(format!("{key}.extras.catseye.id"), "another node has this id")
                    .value(id)
                    .remedy("give a unique id, or leave it out to have one assigned")
                    .into());
            }
        }
        if let Some(rcs_dbsm) = rcs_dbsm {
            let (stand, _) = self.stand(here, None)?;
            let name = name.unwrap_or(format!("point {i}"));
            return self.add(ids, id, name, here, Shape::Point { rcs_dbsm }, stand);
        }
        if let (Some(table), None) = (rcs_table, mesh) {
            let stand = self.unscaled(here, None, &key)?;
            let name = name.unwrap_or(format!("table {i}"));
            return self.add(ids, id, name, here, Shape::Table(table), stand);
        }
        let Some(m) = mesh else {
            if instancing.is_some() {
                self.note(format!("node {i} is instanced but has no mesh"));
            }
            return Ok(());
        };
        if m >= self.root.meshes.len() {
            return Err(self.out_of_range(format!("{key}.mesh"), m, self.root.meshes.len()).into());
        }
        let base = name
            .or_else(|| self.root.meshes[m].name.clone().filter(|n| !n.is_empty()))
            .unwrap_or(format!("node {i}"));
        if let Some(skin) = skin {
            if instancing.is_some() {
                return Err(self
                    .bad(key, format!("{} has a skin and is instanced", self.node_called(i)))
                    .remedy("make copies of it instead of instances")
                    .into());
            }
            for part in self.skinned(i, m, skin, inherited)? {
                let name = match &part.joint {
                    Some(joint) => format!("{base}/{joint}"),
                    None => base.clone(),
                };
                let velocity_mps = match part.frame.velocity_mps {
                    DVec3::ZERO => here.velocity_mps,
                    given => given,
                };
                let frame =
                    Inherited { velocity_mps, class: here.class.clone(), radar: here.radar, ..part.frame };
                let (stand, _) = self.stand(&frame, None)?;
                self.scene.meshes.push(part.mesh);
                let shape = Shape::Mesh(self.scene.meshes.len() - 1);
                self.add(ids, None, name, &frame, shape, stand)?;
            }
            return Ok(());
        }
        let instances = match instancing {
            Some(v) => self.instances(i, &v)?.into_iter().map(Some).collect(),
            None => vec![None],
        };
        if rcs_table.is_some() {
            self.note(format!(
                "node {i} ('{}') scatters as its rcs_table states; its mesh does not scatter",
                clip(&base)
            ));
        }
        for (k, local) in instances.iter().enumerate() {
            let name = if local.is_some() { format!("{base} {k}") } else { base.clone() };
            if let Some(table) = rcs_table {
                let stand = self.unscaled(here, local.as_ref(), &key)?;
                self.add(ids, id, name, here, Shape::Table(table), stand)?;
                continue;
            }
            let (stand, bake) = self.stand(here, local.as_ref())?;
            let Some(shape) = self.mesh(m, bake)? else {
                self.note(format!(
                    "node {i} ('{}') has no triangle with an area and is left out",
                    clip(&base)
                ));
                continue;
            };
            self.add(ids, id, name, here, Shape::Mesh(shape), stand)?;
        }
        Ok(())
    }

    fn add(
        &mut self,
        ids: &mut Ids,
        id: Option<u32>,
        name: String,
        here: &Inherited,
        shape: Shape,
        stand: Stand,
    ) -> Result<()> {
        if self.scene.objects.len() >= MAX_OBJECTS {
            return Err(self
                .bad("nodes", "too many objects")
                .allowed(format!("up to {MAX_OBJECTS}"))
                .remedy("split the scene")
                .into());
        }
        ids.given.push(id);
        let pose = if let Stand::Still(pose) = stand { pose } else { Pose::IDENTITY };
        let mut object = Object {
            id: 0,
            name,
            class: here.class.clone(),
            shape,
            pose,
            velocity_mps: here.velocity_mps,
            motion: None,
            radar: here.radar,
        };
        if let Stand::Moving(motion) = stand {
            object.set_motion(motion);
        }
        self.scene.objects.push(object);
        Ok(())
    }

    /// Where an object of a node is, at `local` in it if given, and what has to be baked into its vertices.
    fn stand(&mut self, here: &Inherited, local: Option<&DAffine3>) -> Result<(Stand, DMat3)> {
        let Some(chain) = &here.chain else {
            let (pose, bake) = self.place(&local.map_or(here.transform, |l| here.transform * *l));
            return Ok((Stand::Still(pose), bake));
        };
        self.count_joints(chain.len() + 1)?;
        let mut chain = chain.clone();
        if let Some(local) = local {
            chain.still(self.in_iso(local.matrix3), self.axes * local.translation * self.options.unit_m);
        }
        Ok((Stand::Moving(chain.motion(here.velocity_mps)), chain.rest))
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

    /// Where a node is whose scattering is known in metres.
    fn unscaled(&mut self, here: &Inherited, local: Option<&DAffine3>, key: &str) -> Result<Stand> {
        let (stand, bake) = self.stand(here, local)?;
        if bake != DMat3::IDENTITY {
            return Err(self
                .bad(key, "the node has an rcs_table, but is scaled or mirrored")
                .remedy("apply the node's scale, since a table cannot be scaled")
                .into());
        }
        Ok(stand)
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
}
