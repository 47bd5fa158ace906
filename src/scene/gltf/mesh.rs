//! Meshes, with what a pose cannot say baked into their vertices.

use super::importer::Importer;
use super::options::{MAX_TRIANGLES, MAX_VERTICES};
use crate::base::error::Result;
use crate::scene::Mesh;
use crate::scene::tidy::{drop_flat_normals, drop_unused_vertices, has_area};
use crate::scene::toml_file::clip;
use glam::{DMat3, DVec3};
use gltf::json;
use json::mesh::{Mode, Semantic};
use json::validation::Checked;
use std::collections::HashMap;

impl Importer<'_> {
    /// Scene mesh of glTF mesh `m` with its vertices multiplied by `bake`.
    pub(super) fn mesh(&mut self, m: usize, bake: DMat3) -> Result<Option<usize>> {
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

    pub(super) fn build_mesh(&mut self, m: usize, bake: DMat3) -> Result<Mesh> {
        let to_iso = bake * self.axes * self.options.unit_m;
        let mirrored = bake.determinant() < 0.0;
        let mut all = Mesh::default();
        // Primitives that share their positions share the vertices here too.
        let mut bases: HashMap<(usize, Option<usize>), usize> = HashMap::new();
        let turn_normals = to_iso.inverse().transpose();
        let stored: usize = self.scene.meshes.iter().map(|m| m.triangles.len()).sum();
        for p in 0..self.root.meshes[m].primitives.len() {
            let Some(primitive) = self.primitive(m, p)? else { continue };
            let Primitive { key, positions: accessor, normals, material, .. } = primitive.clone();
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
            for corners in self.triangles(&primitive, count, stored + all.triangles.len())? {
                let mut abc = corners.map(|c| c + base as u32);
                if mirrored {
                    abc.swap(1, 2);
                }
                if !has_area(abc.map(|c| all.positions_m[c as usize])) {
                    self.scene.import.degenerate_triangles_dropped += 1;
                    continue;
                }
                all.triangles.push(abc);
                all.material.push(material);
            }
        }
        drop_flat_normals(&mut all);
        drop_unused_vertices(&mut all);
        self.note_coarse_places(m, &all);
        self.vertices += all.positions_m.len();
        Ok(all)
    }

    /// Notes vertices that lie so far from their origin that f32, in which glTF has them, no longer resolves a part of a wavelength: map
    /// coordinates that belong into the node.
    fn note_coarse_places(&mut self, m: usize, mesh: &Mesh) {
        /// A step of f32 that changes the echo of a plate at 77 GHz by 0.1 dB, m.
        const COARSE_M: f64 = 5e-5;
        let far = |k: usize| mesh.positions_m.iter().map(|p| p[k].abs()).fold(0.0, f64::max);
        let span = |k: usize| {
            let (low, high) =
                mesh.positions_m.iter().fold((f64::MAX, f64::MIN), |(a, b), p| (a.min(p[k]), b.max(p[k])));
            high - low
        };
        for k in 0..3 {
            let far_m = far(k);
            let step_m = far_m * f64::from(f32::EPSILON);
            if step_m > COARSE_M && far_m > 4.0 * span(k) {
                self.note(format!(
                    "meshes[{m}]: vertices lie {far_m:.0} m from their origin, where f32 has steps of {:.2} mm; put the offset into the node and \
                     export again",
                    1e3 * step_m
                ));
                return;
            }
        }
    }

    /// What a primitive is made of; None, with a note, where it has no surface.
    pub(super) fn primitive(&mut self, m: usize, p: usize) -> Result<Option<Primitive>> {
        let key = format!("meshes[{m}].primitives[{p}]");
        let primitive = &self.root.meshes[m].primitives[p];
        let Checked::Valid(mode) = primitive.mode else {
            return Err(self
                .bad(format!("{key}.mode"), "is not a primitive mode")
                .allowed("0..=6")
                .remedy("export the file again")
                .into());
        };
        let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions)).map(|a| a.value());
        let indices = primitive.indices.map(|a| a.value());
        let normals = primitive.attributes.get(&Checked::Valid(Semantic::Normals)).map(|a| a.value());
        let (material, morphs) = (primitive.material.map(|m| m.value()), primitive.targets.is_some());
        if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
            self.note(format!("{key} holds points or lines, which have no area, and is left out"));
            return Ok(None);
        }
        let Some(positions) = positions else {
            self.note(format!("{key} has no positions and is left out"));
            return Ok(None);
        };
        if morphs {
            self.note(format!("{key} has morph targets, which are left out"));
        }
        let slot = material.unwrap_or(self.root.materials.len());
        let Some(Some(material)) = self.materials.get(slot).copied() else {
            return Err(self.out_of_range(format!("{key}.material"), slot, self.root.materials.len()).into());
        };
        Ok(Some(Primitive { key, mode, positions, normals, indices, material }))
    }

    /// Corners of the triangles of a primitive with `count` vertices, when there are `stored` triangles already.
    pub(super) fn triangles(
        &mut self,
        primitive: &Primitive,
        count: u32,
        stored: usize,
    ) -> Result<Vec<[u32; 3]>> {
        let (key, mode) = (&primitive.key, primitive.mode);
        let corners: Vec<u32> = match primitive.indices {
            Some(a) => self.indices(a, count, &format!("{key}.indices"))?,
            None => (0..count).collect(),
        };
        let n = corners.len();
        let triangles = if mode == Mode::Triangles { n / 3 } else { n.saturating_sub(2) };
        if mode == Mode::Triangles && !n.is_multiple_of(3) {
            self.note(format!("{key} has {} corners more than whole triangles", n % 3));
        }
        if stored + triangles > MAX_TRIANGLES {
            return Err(self
                .bad(key, "too many triangles")
                .allowed(format!("up to {MAX_TRIANGLES} in all"))
                .remedy("split the scene")
                .into());
        }
        // Strips and fans as in section 3.7.2.1 of the glTF 2.0 specification.
        let abc = |t: usize| match mode {
            Mode::Triangles => [3 * t, 3 * t + 1, 3 * t + 2],
            Mode::TriangleStrip => [t, t + 1 + t % 2, t + 2 - t % 2],
            _ => [t + 1, t + 2, 0],
        };
        Ok((0..triangles).map(|t| abc(t).map(|c| corners[c])).collect())
    }
}

/// Triangles of one material, with the accessors of their vertices.
#[derive(Clone)]
pub(super) struct Primitive {
    pub(super) key: String,
    mode: Mode,
    pub(super) positions: usize,
    pub(super) normals: Option<usize>,
    indices: Option<usize>,
    pub(super) material: u32,
}
