//! A scene's surfaces as STL and OBJ, with z up.

use super::contents::extension;
use crate::base::error::{BadInput, Error, Result};
use crate::scene::gltf;
use crate::scene::{Scene, Shape};
use glam::DVec3;
use std::fmt::Write;
use std::path::Path;

/// A file's bytes, and what it does not say.
#[derive(Debug)]
pub struct Written {
    /// The file.
    pub bytes: Vec<u8>,
    /// What it does not say, one remark a line.
    pub notes: Vec<String>,
}

/// The scene in the format of the path's extension: STL or OBJ in `unit` ("mm" unless given) with x forward, y left and z up, all else
/// is glTF in metres. Objects stand where they are at time zero.
///
/// # Errors
/// Returns an error for a unit with glTF, an unknown unit, or objects without a surface for STL and OBJ, and the errors
/// of [`gltf::to_glb`].
pub fn write(scene: &Scene, path: &Path, unit: Option<&str>) -> Result<Written> {
    let kind = extension(path);
    if !["stl", "obj"].contains(&kind.as_str()) {
        return match unit {
            None => Ok(Written { bytes: gltf::to_glb(scene)?, notes: Vec::new() }),
            Some(unit) => {
                Err(BadInput::new("glTF is in metres").key("--unit").value(unit).remedy("remove it").into())
            }
        };
    }
    let unit = unit.unwrap_or("mm");
    let per_m = 1.0 / gltf::unit_m(unit)?;
    if let Some(o) = scene.objects.iter().find(|o| !matches!(o.shape, Shape::Mesh(_))) {
        return Err(BadInput::new(format!("'{}' has no surface, which .{kind} needs", o.name))
            .file(path)
            .remedy("write a .glb file")
            .into());
    }
    let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let what = format!("{name} is in {unit} with x forward, y left and z up, which the file cannot state");
    let mut used: Vec<u32> = triangles(scene).map(|t| t.material).collect();
    used.sort_unstable();
    used.dedup();
    let names: Vec<&str> =
        used.iter().filter_map(|m| scene.materials.get(*m as usize)).map(|m| m.name.as_str()).collect();
    let mut notes = Vec::new();
    let bytes = if kind == "stl" {
        let default = names.first().unwrap_or(&"pec");
        notes.push(format!("{what}: read it with --unit {unit} --up z --default-material {default}"));
        if names.len() > 1 {
            notes.push(format!("STL does not keep its materials ({}); .obj and .glb do", names.join(", ")));
        }
        let smooth = |o| matches!(o, &Shape::Mesh(m) if scene.meshes[m].is_smooth());
        if scene.objects.iter().any(|o| smooth(&o.shape)) {
            notes.push(
                "STL keeps only the facets of curved surfaces; .obj and .glb also keep the curvature".into(),
            );
        }
        stl(scene, unit, per_m)?
    } else {
        notes.push(format!("{what}: read it with --unit {unit} --up z"));
        let kept = |m: &u32| scene.materials.get(*m as usize).is_none_or(gltf::is_known_by_name);
        for m in used.iter().filter(|m| !kept(m)) {
            let name = &scene.materials[*m as usize].name;
            notes.push(format!(
                "OBJ keeps only the name of the material '{name}'; .glb also keeps its values"
            ));
        }
        obj(scene, unit, per_m)?
    };
    Ok(Written { bytes, notes })
}

/// A triangle in the world, m.
struct Facet {
    corners: [DVec3; 3],
    material: u32,
}

fn triangles(scene: &Scene) -> impl Iterator<Item = Facet> + '_ {
    scene.objects.iter().flat_map(|o| {
        let pose = o.at(0.0).pose();
        let mesh = match o.shape {
            Shape::Mesh(m) => Some(&scene.meshes[m]),
            _ => None,
        };
        mesh.into_iter().flat_map(move |mesh| {
            mesh.triangles.iter().zip(&mesh.material).map(move |(t, material)| Facet {
                corners: t.map(|c| pose.point(mesh.positions_m[c as usize])),
                material: *material,
            })
        })
    })
}

/// Binary. The header states what the format has no place for, and does not begin with "solid".
fn stl(scene: &Scene, unit: &str, per_m: f64) -> Result<Vec<u8>> {
    let count = scene.triangle_count();
    let failed = |what: String| Error::Failed(format!("cannot write STL: {what}"));
    let count = u32::try_from(count).map_err(|_| failed(format!("{count} triangles")))?;
    let mut out = format!("catseye: unit {unit}, x forward, y left, z up").into_bytes();
    out.resize(80, b' ');
    out.extend(count.to_le_bytes());
    for t in triangles(scene) {
        let [a, b, c] = t.corners;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        for p in [normal, a * per_m, b * per_m, c * per_m] {
            let p = p.as_vec3();
            if !p.is_finite() {
                return Err(failed(format!("a vertex at {p}")));
            }
            out.extend(p.to_array().iter().flat_map(|x| x.to_le_bytes()));
        }
        out.extend([0, 0]);
    }
    Ok(out)
}

fn obj(scene: &Scene, unit: &str, per_m: f64) -> Result<Vec<u8>> {
    let mut out =
        format!("# catseye {}\n# unit {unit}, x forward, y left, z up\n", env!("CARGO_PKG_VERSION"));
    let failed = |e: std::fmt::Error| Error::Failed(format!("cannot write OBJ: {e}"));
    let (mut points, mut normals, mut material) = (0, 0, None);
    for o in &scene.objects {
        let Shape::Mesh(m) = o.shape else { continue };
        let (mesh, pose) = (&scene.meshes[m], o.at(0.0).pose());
        writeln!(out, "o {}", o.name.replace(char::is_control, " ")).map_err(failed)?;
        for p in &mesh.positions_m {
            let p = pose.point(*p) * per_m;
            writeln!(out, "v {} {} {}", p.x, p.y, p.z).map_err(failed)?;
        }
        for n in &mesh.normals {
            let n = pose.rotation * *n;
            writeln!(out, "vn {} {} {}", n.x, n.y, n.z).map_err(failed)?;
        }
        for (t, corners) in mesh.triangles.iter().enumerate() {
            if material.replace(mesh.material[t]) != Some(mesh.material[t]) {
                let name = scene.materials.get(mesh.material[t] as usize).map_or("", |m| m.name.as_str());
                writeln!(out, "usemtl {name}").map_err(failed)?;
            }
            out.push('f');
            for c in corners.map(|c| c as usize + 1) {
                // Facets without normals are flat.
                match mesh.corner_normals(t) {
                    Some(_) => write!(out, " {}//{}", points + c, normals + c),
                    None => write!(out, " {}", points + c),
                }
                .map_err(failed)?;
            }
            out.push('\n');
        }
        points += mesh.positions_m.len();
        normals += mesh.normals.len();
    }
    Ok(out.into_bytes())
}
