//! A scene as binary glTF.

use super::buffer::{ARRAY, Buffer};
use super::material::material_json;
use super::{joints, show};
use crate::base::error::{BadInput, Error, Result};
use crate::scene::scatterer::ScatteringTable;
use crate::scene::{Scene, Shape};
use glam::{DMat3, DVec3};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Writes the scene as a `.glb` file (under a temporary name, then renamed), and copies its scattering tables
/// to its side. Positions are rounded to single precision, poses are not.
///
/// # Errors
/// Returns an error for a scene that glTF cannot hold, or if the file cannot be written.
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

pub(super) fn table_name(table: &ScatteringTable) -> Result<&str> {
    let name = table.source().file_name().and_then(|n| n.to_str());
    name.ok_or_else(|| Error::Failed(format!("no file name: {}", table.source().display())))
}

/// The scene as binary glTF that [`super::import`] reads back to the same scene; scattering tables by the names of
/// their files. Motions are exact in `extras`, and for other programs an animation shows what moves.
///
/// # Errors
/// Returns an error for numbers that are not finite, objects without triangles, or more than 4 GiB.
pub fn to_glb(scene: &Scene) -> Result<Vec<u8>> {
    let failed = |what: String| Error::Failed(format!("cannot write glTF: {what}"));
    let axes = DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X).transpose();
    let mut buffer = Buffer::default();
    let mut meshes = Vec::new();
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
        let position = buffer.floats(&points, json!({"target": ARRAY}), json!({"min": low, "max": high}));
        let curved: Vec<bool> = match mesh.normals.is_empty() {
            true => vec![false; mesh.triangles.len()],
            false if mesh.normals.len() != points.len() => {
                return Err(failed(format!("mesh {m} has {} normals", mesh.normals.len())));
            }
            false => (0..mesh.triangles.len()).map(|t| mesh.corner_normals(t).is_some()).collect(),
        };
        let mut normal = 0;
        if curved.contains(&true) {
            // Flat facets are in primitives of their own without normals, as the format has it; their
            // vertices still need a row here.
            let rows: Vec<[f32; 3]> = (mesh.normals.iter())
                .map(|n| (axes * *n).try_normalize().unwrap_or(DVec3::Y).as_vec3().to_array())
                .collect();
            normal = buffer.floats(&rows, json!({"target": ARRAY}), json!({}));
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
                return Err(failed(format!("mesh {m} names vertices or materials that do not exist")));
            }
            let indices = buffer.indices(corners);
            let mut attributes = json!({"POSITION": position});
            if smooth {
                attributes["NORMAL"] = json!(normal);
            }
            primitives.push(json!({"attributes": attributes, "indices": indices, "material": material}));
            start = end;
        }
        meshes.push(json!({"name": format!("mesh {m}"), "primitives": primitives}));
    }
    let mut materials = Vec::new();
    for m in &scene.materials {
        materials.push(material_json(m).map_err(failed)?);
    }
    let mut nodes = Vec::new();
    let mut motions = joints::Writer::default();
    for o in &scene.objects {
        let mut catseye = json!({"id": o.id});
        if !o.class.is_empty() {
            catseye["class"] = json!(o.class);
        }
        if !o.radar {
            catseye["radar"] = json!(false);
        }
        match &o.motion {
            Some(motion) => {
                let motion = motions.motion(&motion.joints);
                catseye["motion"] = motion.map_err(|e| failed(format!("object '{}': {e}", o.name)))?;
            }
            None if o.velocity_mps != DVec3::ZERO => {
                catseye["velocity_mps"] = json!(o.velocity_mps.to_array());
            }
            None => {}
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
    let animations: Vec<Value> = show::animation(scene, &mut buffer, axes).into_iter().collect();
    let mut root = json!({
        "asset": {"version": "2.0", "generator": concat!("catseye ", env!("CARGO_PKG_VERSION"))},
        "scene": 0,
        "scenes": [{"nodes": (0..nodes.len()).collect::<Vec<_>>()}],
    });
    for (key, list) in [
        ("nodes", nodes),
        ("meshes", meshes),
        ("materials", materials),
        ("animations", animations),
        ("accessors", buffer.accessors),
        ("bufferViews", buffer.views),
    ] {
        if !list.is_empty() {
            root[key] = Value::Array(list);
        }
    }
    let bin = buffer.bin;
    if !bin.is_empty() {
        root["buffers"] = json!([{"byteLength": bin.len()}]);
    }
    if let Some(channels) = motions.channels().map_err(failed)? {
        root["extras"] = json!({"catseye": {"channels": channels}});
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
