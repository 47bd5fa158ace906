//! Meshes from files by the extension of their names: glTF (`gltf`), STL and OBJ; and scenes as STL and OBJ.
//!
//! STL and OBJ state neither unit nor up axis, and STL no material: all of it has to be given. A file of either kind with y up has
//! glTF's axes (+Z forward, +X left). An OBJ's `o` becomes an object, its `usemtl` the name of a material as in glTF, and its `vn` smooth
//! normals; groups, texture coordinates and .mtl files are passed over. STL is read by words, OBJ by lines, as their formats are. A mesh may also be given as arrays ([`from_arrays`]).

mod arrays;
mod contents;
mod obj;
mod stl;
mod table;
mod write;

use super::gltf::{self, ImportOptions};
use super::tidy::{drop_degenerate, drop_unused_vertices, tidy};
use super::{Object, Scene, Shape};
use crate::base::error::{BadInput, Result};
use crate::base::frames::Pose;
use crate::formats::input;
pub use arrays::{MeshArrays, from_arrays};
use contents::Contents;
pub use contents::extension;
use std::collections::HashMap;
use std::ops::RangeInclusive;
use std::path::Path;
pub use table::{ImportTable, check_stated};
pub use write::{Written, write};

const WHAT: &str = "a .glb, .gltf, .stl or .obj file";

/// Larger files are refused before they are read.
const MAX_BYTES: u64 = 6 << 30;

/// Extensions of the files that are read.
pub const READ: [&str; 4] = ["glb", "gltf", "stl", "obj"];

/// Size of an object, m, that needs no unit.
pub const OBJECT_M: RangeInclusive<f64> = 1e-3..=100.0;

/// Size of a whole scene, m, that needs no unit.
pub const SCENE_M: RangeInclusive<f64> = 1e-3..=1e5;

/// Whether a text that may also name something else is meant as a file: it has a folder or an extension, or there is such a file.
pub fn is_file_name(text: &str) -> bool {
    let path = Path::new(text);
    // "type1:width_m=0.16" has no extension "16".
    let ends = |e: &str| e.len() <= 8 && e.bytes().all(|b| b.is_ascii_alphanumeric()) && !text.contains('=');
    let lettered = |e: &str| ends(e) && e.bytes().any(|b| b.is_ascii_alphabetic());
    READ.contains(&extension(path).as_str())
        || lettered(&extension(path))
        || text.contains(['/', '\\']) && !text.contains('=')
        || path.exists()
}

/// What a file of this name leaves open and the options do not say: (in words, option, key with an example).
fn missing(path: &Path, options: &ImportOptions) -> Vec<(&'static str, &'static str, &'static str)> {
    let kind = extension(path);
    if !["stl", "obj"].contains(&kind.as_str()) {
        return Vec::new();
    }
    let mut out = Vec::new();
    if !options.unit_given {
        out.push(("unit", "--unit mm (m, cm, in, ft)", "unit = \"mm\" (m, cm, in, ft)"));
    }
    if !options.up_given {
        out.push(("up axis", "--up z (y)", "up = \"z\" (y)"));
    }
    if kind == "stl" && options.default_material.is_none() {
        out.push(("material", "--default-material pec", "default_material = \"pec\""));
    }
    out
}

/// Whether nobody has said the unit of a file of this name, and its format does not either.
pub fn leaves_unit_open(path: &Path, options: &ImportOptions) -> bool {
    missing(path, options).iter().any(|(what, ..)| *what == "unit")
}

/// "states no unit, no up axis and no material; add …", in the words of a file's keys or of the command line's options.
fn ask(missing: &[(&str, &str, &str)], keys: bool) -> Option<(String, String)> {
    let list = |words: Vec<String>| match words.split_last() {
        Some((last, [])) => last.clone(),
        Some((last, rest)) => format!("{} and {last}", rest.join(", ")),
        None => String::new(),
    };
    let stated = list(missing.iter().map(|(what, ..)| format!("no {what}")).collect());
    let add = list(missing.iter().map(|m| if keys { m.2 } else { m.1 }.to_string()).collect());
    (!missing.is_empty()).then(|| (format!("states {stated}"), format!("add {add}")))
}

/// Reads a mesh file of any kind.
///
/// # Errors
/// Returns an error of one line, with the place in the file, for anything that is wrong with it, for another kind of
/// file, or for an STL or OBJ whose unit, up axis or material is not given.
pub fn import(path: &Path, options: &ImportOptions) -> Result<Scene> {
    let kind = extension(path);
    let read = match kind.as_str() {
        "glb" | "gltf" => {
            let mut scene = gltf::import(path, options)?;
            scene.import.unit_assumed = !options.unit_given;
            return Ok(scene);
        }
        "stl" => stl::read,
        "obj" => obj::read,
        _ => {
            input::regular(path, WHAT)?;
            let bad = BadInput::new("meshes of this file type cannot be read").file(path);
            let list = READ.map(|e| format!(".{e}")).join(", ");
            return Err(bad.allowed(list).remedy("export the mesh as one of these").into());
        }
    };
    input::regular(path, WHAT)?;
    if let Some((problem, remedy)) = ask(&missing(path, options), false) {
        return Err(BadInput::new(problem).file(path).remedy(remedy).into());
    }
    let bytes = input::read(path, WHAT, MAX_BYTES)?;
    let bad = |problem: &str| BadInput::new(problem).file(path);
    if bytes.is_empty() {
        return Err(bad("the file is empty").remedy("export it again").into());
    }
    let contents = read(&bytes, path)?;
    drop(bytes);
    scene_of(contents, path, options)
}

/// Imports as [`import`] a file that holds things of `size_m` and not a landscape: exporters write millimetres where
/// glTF has metres.
///
/// # Errors
/// Returns the errors of [`import`], and an error if the size is beyond that range and the unit was not stated.
pub fn import_sized(path: &Path, options: &ImportOptions, size_m: RangeInclusive<f64>) -> Result<Scene> {
    let scene = import(path, options)?;
    let is_mesh = |o: &Object| matches!(o.shape, Shape::Mesh(_));
    let Some((low, high)) = scene.bounds_m(0.0).filter(|_| scene.objects.iter().any(is_mesh)) else {
        return Ok(scene);
    };
    let longest_m = (high - low).max_element();
    if options.unit_given || size_m.contains(&longest_m) {
        return Ok(scene);
    }
    Err(BadInput::new(format!("the mesh is {longest_m:.3e} m long: its unit must be given"))
        .file(path)
        .key("unit")
        .allowed(format!("{} m to {} m without a unit", size_m.start(), size_m.end()))
        .remedy("give --unit mm (in a scenario unit = \"mm\"), or --unit m if the size is right")
        .into())
}

/// A line for a target whose unit was assumed and that is longer than a house: exporters write millimetres where glTF has metres.
pub fn unit_line(scene: &Scene) -> Option<String> {
    const HOUSE_M: f64 = 20.0;
    let (low, high) = scene.bounds_m(0.0)?;
    let longest_m = (high - low).max_element();
    (scene.import.unit_assumed && longest_m > HOUSE_M).then(|| {
        format!(
            "size: the target is {longest_m:.1} m long in the metres that glTF prescribes; give --unit mm (Python and files: unit = \"mm\") if it was \
             drawn in millimetres, or --unit m if that is its size"
        )
    })
}

/// The scene of what a file says, in metres and ISO axes, with materials by the rules that hold for glTF.
fn scene_of(contents: Contents, file: &Path, options: &ImportOptions) -> Result<Scene> {
    options.check_unit()?;
    gltf::check_material_map(file, &contents.materials, options)?;
    let axes = options.up.axes();
    let mut scene = Scene::default();
    scene.import.notes.extend(contents.contradiction(options));
    scene.import.notes.extend(contents.notes);
    let mut known: HashMap<u32, u32> = HashMap::new();
    for (name, mut mesh) in contents.parts {
        for p in &mut mesh.positions_m {
            *p = axes * *p * options.unit_m;
            if !(p.is_finite() && p.length() < 1e9) {
                return Err(BadInput::new("a vertex is not a finite position below 1e9 m")
                    .file(file)
                    .value(format!("{p} m"))
                    .remedy("check the unit, or clean the mesh and export it again")
                    .into());
            }
        }
        mesh.normals.iter_mut().for_each(|n| *n = (axes * *n).normalize_or_zero());
        scene.import.degenerate_triangles_dropped += drop_degenerate(&mut mesh);
        if mesh.triangles.is_empty() {
            continue;
        }
        for m in &mut mesh.material {
            *m = match known.get(m) {
                Some(index) => *index,
                None => {
                    let name = contents.materials.get(*m as usize).map(String::as_str);
                    let (material, note) = gltf::choose_material(file, "usemtl", name, options)?;
                    scene.import.notes.extend(note);
                    let index = scene.material_index(&material);
                    known.insert(*m, index);
                    index
                }
            };
        }
        drop_unused_vertices(&mut mesh);
        scene.add_mesh(&name, "", mesh, Pose::IDENTITY);
    }
    if scene.objects.is_empty() {
        let dropped = scene.import.degenerate_triangles_dropped;
        let why = if dropped > 0 { format!(" ({dropped} had no area)") } else { String::new() };
        return Err(BadInput::new(format!("the file has no triangles{why}"))
            .file(file)
            .remedy("export a mesh of triangles or polygons")
            .into());
    }
    tidy(&mut scene, options.smooth_deg, true);
    scene.import.triangles = scene.triangle_count();
    Ok(scene)
}
