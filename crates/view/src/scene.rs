//! A scene for the page: meshes, objects, and where they are at the times of the frames.

use super::pack;
use catseye::base::error::{BadInput, Result};
use catseye::scene::{Object, Scene, Shape};
use serde_json::{Value, json};

/// Most triangles of a scene that a page takes.
pub const MOST_TRIANGLES: usize = 2_000_000;

/// Complains about a scene of more triangles than a page takes.
pub fn small(name: &str, scene: &Scene) -> Result<()> {
    if scene.triangle_count() <= MOST_TRIANGLES {
        return Ok(());
    }
    Err(BadInput::new("has too many triangles for a page")
        .key(name)
        .value(scene.triangle_count())
        .allowed(format!("up to {MOST_TRIANGLES}"))
        .remedy("show a coarser mesh")
        .into())
}

/// Meshes, materials and objects; of those that move, where they are at each of the times.
pub fn scene(scene: &Scene, times_s: &[f64]) -> Value {
    let meshes: Vec<Value> = scene
        .meshes
        .iter()
        .map(|m| {
            json!({
                "positions": pack::f32s(m.positions_m.iter().flat_map(|p| p.as_vec3().to_array())),
                "triangles": pack::u32s(m.triangles.iter().flatten().copied()),
                "materials": runs(&m.material),
            })
        })
        .collect();
    let materials: Vec<Value> = scene.materials.iter().map(|m| json!(m.name)).collect();
    let objects: Vec<Value> = scene.objects.iter().map(|o| object(o, times_s)).collect();
    json!({ "meshes": meshes, "materials": materials, "objects": objects })
}

fn object(o: &Object, times_s: &[f64]) -> Value {
    let moves = o.motion.is_some() || o.velocity_mps != glam::DVec3::ZERO;
    let first = times_s.first().copied().unwrap_or(0.0);
    let times = if moves { times_s } else { &[][..] };
    let times: &[f64] = if times.is_empty() { &[first] } else { times };
    let poses = times.iter().flat_map(|t| {
        let pose = o.at(*t).pose();
        let (p, q) = (pose.translation_m.as_vec3(), pose.rotation.as_quat());
        [p.x, p.y, p.z, q.x, q.y, q.z, q.w]
    });
    let shape = match o.shape {
        Shape::Mesh(m) => json!({ "mesh": m }),
        Shape::Point { rcs_dbsm } => json!({ "rcs_dbsm": rcs_dbsm }),
        Shape::Table(_) => json!({ "table": true }),
    };
    json!({ "id": o.id, "name": o.name, "class": o.class, "radar": o.radar, "shape": shape, "poses": pack::f32s(poses) })
}

/// Materials of triangles one after another as pairs of (material, number of triangles).
fn runs(materials: &[u32]) -> Vec<[u32; 2]> {
    let mut out: Vec<[u32; 2]> = Vec::new();
    for m in materials {
        match out.last_mut() {
            Some([last, n]) if last == m => *n += 1,
            _ => out.push([*m, 1]),
        }
    }
    out
}
