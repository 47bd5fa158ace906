//! Skins: the tracer knows rigid bodies, so a mesh whose vertices follow several joints is cut into rigid parts.
//!
//! Joints that stand still against each other count as one body. A triangle goes with the body that has the largest
//! share of its corners' weights, and keeps the shape that linear blending gives it where nothing is animated: there the
//! parts together are the blended mesh, and a triangle whose corners follow one body is exact at all times. Where
//! parts meet, edges open or overlap by what blending would have bent.

use super::importer::{Importer, Inherited};
use super::options::MAX_VERTICES;
use crate::base::error::Result;
use crate::scene::Mesh;
use crate::scene::tidy::{drop_flat_normals, drop_unused_vertices, has_area};
use crate::scene::toml_file::clip;
use glam::{DAffine3, DMat3, DMat4, DVec3};
use gltf::json;
use json::mesh::Semantic;
use json::validation::Checked;
use std::collections::HashMap;

/// A rigid part of a skinned mesh.
pub(super) struct Part {
    /// Name of its joint; None for a mesh that is one part.
    pub(super) joint: Option<String>,
    /// Where it hangs.
    pub(super) frame: Inherited,
    pub(super) mesh: Mesh,
}

/// Joints that stand still against each other.
struct Body {
    name: String,
    frame: Inherited,
    /// Transform from the file's world to the vertices of the part.
    inward: DAffine3,
    mesh: Mesh,
    /// (primitive, vertex) to vertex of the part.
    known: HashMap<(usize, u32), u32>,
}

/// Where a vertex is and on whom it hangs.
struct Blend {
    /// Transform from the mesh to the file's world.
    to_world: DAffine3,
    /// (body, share), in all one.
    shares: Vec<(usize, f64)>,
}

impl Importer<'_> {
    /// The parts of mesh `m` of node `i`, which hangs on a skin.
    pub(super) fn skinned(
        &mut self,
        i: usize,
        m: usize,
        skin: usize,
        inherited: &[Option<Inherited>],
    ) -> Result<Vec<Part>> {
        let who = self.node_called(i);
        let (mut bodies, body_of, matrices) = self.bodies(&who, skin, inherited)?;
        let mut worst = (1.0, 0);
        let mut stored: usize = self.scene.meshes.iter().map(|m| m.triangles.len()).sum();
        for p in 0..self.root.meshes[m].primitives.len() {
            let Some(primitive) = self.primitive(m, p)? else { continue };
            let what = format!("{}.attributes.POSITION", primitive.key);
            let points = self.elements::<3>(primitive.positions, &what)?;
            self.vertices += points.len();
            if self.vertices > MAX_VERTICES {
                return Err(self
                    .bad(what, "too many vertices")
                    .allowed(format!("up to {MAX_VERTICES} in all"))
                    .remedy("split the scene")
                    .into());
            }
            let what = format!("{}.attributes.NORMAL", primitive.key);
            let normals = primitive.normals.map(|a| self.elements::<3>(a, &what)).transpose()?;
            if let Some(n) = normals.as_ref().filter(|n| n.len() != points.len()) {
                return Err(self
                    .bad(what, format!("{} normals for {} vertices", n.len(), points.len()))
                    .remedy("the mesh is damaged; export it again")
                    .into());
            }
            let blends = self.blends(&who, m, p, points.len(), &body_of, &matrices)?;
            let triangles = self.triangles(&primitive, points.len() as u32, stored)?;
            stored += triangles.len();
            for corners in triangles {
                let (b, share) = strongest(&blends, corners);
                if share < worst.0 {
                    worst = (share, b);
                }
                let body = &mut bodies[b];
                let mut abc = [0; 3];
                for (at, c) in abc.iter_mut().zip(corners) {
                    *at = match body.known.get(&(p, c)) {
                        Some(v) => *v,
                        None => {
                            let to_part = body.inward * blends[c as usize].to_world;
                            let place = to_part.transform_point3(points[c as usize].into());
                            if !(place.is_finite() && place.length() < 1e9) {
                                return Err(self
                                    .bad(
                                        &primitive.key,
                                        format!("vertex {c} of {who} is not a finite position"),
                                    )
                                    .value(clip(&format!("{:?}", points[c as usize])))
                                    .remedy("clean the mesh and its skin and export them again")
                                    .into());
                            }
                            let turn = to_part.matrix3.inverse().transpose();
                            let normal = normals.as_ref().map_or(DVec3::ZERO, |n| {
                                (turn * DVec3::from(n[c as usize])).normalize_or_zero()
                            });
                            body.mesh.positions_m.push(place);
                            body.mesh.normals.push(normal);
                            let v = body.mesh.positions_m.len() as u32 - 1;
                            body.known.insert((p, c), v);
                            v
                        }
                    };
                }
                let turned = body.inward.matrix3 * blends[corners[0] as usize].to_world.matrix3;
                if turned.determinant() < 0.0 {
                    abc.swap(1, 2);
                }
                if !has_area(abc.map(|v| body.mesh.positions_m[v as usize])) {
                    self.scene.import.degenerate_triangles_dropped += 1;
                    continue;
                }
                body.mesh.triangles.push(abc);
                body.mesh.material.push(primitive.material);
            }
        }
        let worst_body = bodies[worst.1].name.clone();
        bodies.retain(|b| !b.mesh.triangles.is_empty());
        match bodies.len() {
            0 => self.note(format!("{who} has no triangle with an area and is left out")),
            1 => {}
            n if worst.0 < 1.0 => self.note(format!(
                "{who} has a skin and is cut into {n} rigid parts; the minimum share of a triangle's weight in its part is {:.0} %, at '{}'",
                100.0 * worst.0,
                clip(&worst_body)
            )),
            n => self.note(format!("{who} has a skin and is cut into {n} rigid parts")),
        }
        let several = bodies.len() > 1;
        let part = |mut b: Body| {
            drop_flat_normals(&mut b.mesh);
            drop_unused_vertices(&mut b.mesh);
            Part { joint: several.then_some(b.name), frame: b.frame, mesh: b.mesh }
        };
        Ok(bodies.into_iter().map(part).collect())
    }

    /// The bodies of a skin; for each joint its body, and its matrix from the mesh to the file's world.
    fn bodies(
        &self,
        who: &str,
        skin: usize,
        inherited: &[Option<Inherited>],
    ) -> Result<(Vec<Body>, Vec<usize>, Vec<DAffine3>)> {
        let Some(s) = self.root.skins.get(skin) else {
            return Err(self.out_of_range(format!("skin of {who}"), skin, self.root.skins.len()).into());
        };
        let key = format!("skins[{skin}]");
        if s.joints.is_empty() {
            return Err(self
                .bad(format!("{key}.joints"), format!("the skin of {who} has no joints"))
                .remedy("export the file again")
                .into());
        }
        let bind = match s.inverse_bind_matrices {
            Some(a) => self.elements::<16>(a.value(), &format!("{key}.inverseBindMatrices"))?,
            None => vec![DMat4::IDENTITY.to_cols_array(); s.joints.len()],
        };
        if bind.len() < s.joints.len() {
            return Err(self
                .bad(
                    format!("{key}.inverseBindMatrices"),
                    format!("{} matrices for the {} joints of the skin of {who}", bind.len(), s.joints.len()),
                )
                .remedy("export the file again")
                .into());
        }
        let mut bodies: Vec<Body> = Vec::new();
        let mut known: HashMap<Option<usize>, usize> = HashMap::new();
        let (mut body_of, mut matrices) = (Vec::new(), Vec::new());
        for (k, joint) in s.joints.iter().enumerate() {
            let j = joint.value();
            let Some(here) = inherited.get(j).and_then(Option::as_ref) else {
                return Err(self
                    .bad(
                        format!("{key}.joints[{k}]"),
                        format!("the skin of {who} has a joint that is not in the scene"),
                    )
                    .value(j)
                    .remedy("export the file again with its joints")
                    .into());
            };
            let m = &bind[k];
            let affine =
                m[3].abs() < 1e-6 && m[7].abs() < 1e-6 && m[11].abs() < 1e-6 && (m[15] - 1.0).abs() < 1e-6;
            if !affine || m.iter().any(|x| !x.is_finite()) {
                return Err(self
                    .bad(
                        format!("{key}.inverseBindMatrices"),
                        format!("matrix {k} of the skin of {who} is not affine"),
                    )
                    .allowed("finite, with a last row of 0, 0, 0, 1 (column-major)")
                    .remedy("export the file again")
                    .into());
            }
            let column = |c: usize| DVec3::new(m[c], m[c + 1], m[c + 2]);
            let bind = DAffine3 {
                matrix3: DMat3::from_cols(column(0), column(4), column(8)),
                translation: column(12),
            };
            matrices.push(here.transform * bind);
            let body = match known.get(&here.mover) {
                Some(b) => *b,
                None => {
                    // The frame of what moves; of joints that stand, the first one's.
                    let node = here.mover.unwrap_or(j);
                    let frame = inherited[node].clone().unwrap_or_default();
                    let rest = match &frame.chain {
                        Some(chain) => chain.rest,
                        None => self.place(&frame.transform).1,
                    };
                    let back = frame.transform.inverse();
                    if !(back.matrix3.is_finite() && back.translation.is_finite()) {
                        return Err(self
                            .bad(
                                format!("nodes[{node}]"),
                                format!(
                                    "the skin of {who} has the joint {}, whose scale is zero",
                                    self.node_called(node)
                                ),
                            )
                            .remedy("give it another scale, or remove the skin")
                            .into());
                    }
                    let to_iso = rest * self.axes * self.options.unit_m;
                    let name = self.root.nodes[node].name.clone().filter(|n| !n.is_empty());
                    bodies.push(Body {
                        name: name.unwrap_or(format!("node {node}")),
                        frame,
                        inward: DAffine3::from_mat3(to_iso) * back,
                        mesh: Mesh::default(),
                        known: HashMap::new(),
                    });
                    known.insert(here.mover, bodies.len() - 1);
                    bodies.len() - 1
                }
            };
            body_of.push(body);
        }
        Ok((bodies, body_of, matrices))
    }

    /// What the joints make of each of `count` vertices.
    fn blends(
        &self,
        who: &str,
        m: usize,
        p: usize,
        count: usize,
        body_of: &[usize],
        matrices: &[DAffine3],
    ) -> Result<Vec<Blend>> {
        let attributes = &self.root.meshes[m].primitives[p].attributes;
        let accessor = |s: Semantic| attributes.get(&Checked::Valid(s)).map(|a| a.value());
        let mut sets = Vec::new();
        for n in 0.. {
            let key = |name: &str| format!("meshes[{m}].primitives[{p}].attributes.{name}_{n}");
            let (joints, weights) = (accessor(Semantic::Joints(n)), accessor(Semantic::Weights(n)));
            let (joints, weights) = match (joints, weights) {
                (Some(j), Some(w)) => (j, w),
                (None, None) if n > 0 => break,
                (None, _) => {
                    return Err(self
                        .bad(key("JOINTS"), format!("is missing, and {who} has a skin"))
                        .remedy("remove the skin from the node, or export the file again")
                        .into());
                }
                (_, None) => {
                    return Err(self
                        .bad(key("WEIGHTS"), format!("is missing, and {who} has a skin"))
                        .remedy("remove the skin from the node, or export the file again")
                        .into());
                }
            };
            let set =
                (self.elements::<4>(joints, &key("JOINTS"))?, self.elements::<4>(weights, &key("WEIGHTS"))?);
            for (name, len) in [("JOINTS", set.0.len()), ("WEIGHTS", set.1.len())] {
                if len != count {
                    return Err(self
                        .bad(key(name), format!("{len} rows for {count} vertices of {who}"))
                        .remedy("the mesh is damaged; export it again")
                        .into());
                }
            }
            sets.push(set);
        }
        (0..count)
            .map(|v| {
                let mut total = 0.0;
                let mut to_world = DAffine3 { matrix3: DMat3::ZERO, translation: DVec3::ZERO };
                let mut shares: Vec<(usize, f64)> = Vec::new();
                for (joint, weight) in sets.iter().flat_map(|(j, w)| j[v].into_iter().zip(w[v])) {
                    let bad = |what: &str| {
                        self.bad(
                            format!("meshes[{m}].primitives[{p}]"),
                            format!("vertex {v} of {who} {what}"),
                        )
                        .remedy("the skin is damaged; export it again")
                    };
                    if !(weight.is_finite() && weight >= 0.0) {
                        return Err(bad("has a weight that is not 0 or more").value(weight).into());
                    }
                    if weight == 0.0 {
                        continue;
                    }
                    let k = joint as usize;
                    let Some(matrix) = matrices.get(k).filter(|_| joint == k as f64) else {
                        return Err(bad("names a joint that the skin does not have")
                            .value(joint)
                            .allowed(format!("0..={}", matrices.len() - 1))
                            .into());
                    };
                    total += weight;
                    to_world.matrix3 += matrix.matrix3 * weight;
                    to_world.translation += matrix.translation * weight;
                    match shares.iter_mut().find(|(b, _)| *b == body_of[k]) {
                        Some((_, w)) => *w += weight,
                        None => shares.push((body_of[k], weight)),
                    }
                }
                if !(total > 0.0 && total.is_finite()) {
                    return Err(self
                        .bad(
                            format!("meshes[{m}].primitives[{p}]"),
                            format!("vertex {v} of {who} has no joint"),
                        )
                        .remedy("give it a weight above 0; export the file again")
                        .into());
                }
                to_world.matrix3 *= 1.0 / total;
                to_world.translation /= total;
                shares.iter_mut().for_each(|(_, w)| *w /= total);
                Ok(Blend { to_world, shares })
            })
            .collect()
    }
}

/// The body with the largest share of three corners' weights, the first of equals, and that share.
fn strongest(blends: &[Blend], corners: [u32; 3]) -> (usize, f64) {
    let mut sums: Vec<(usize, f64)> = Vec::with_capacity(12);
    for (b, w) in corners.iter().flat_map(|c| &blends[*c as usize].shares) {
        match sums.iter_mut().find(|(known, _)| known == b) {
            Some((_, sum)) => *sum += w,
            None => sums.push((*b, *w)),
        }
    }
    let better = |a: (usize, f64), b: (usize, f64)| if b.1 > a.1 || b.1 == a.1 && b.0 < a.0 { b } else { a };
    let (b, sum) = sums.into_iter().fold((usize::MAX, f64::NEG_INFINITY), better);
    (b, (sum / 3.0).min(1.0))
}
