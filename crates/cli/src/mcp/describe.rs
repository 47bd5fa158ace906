//! What a result is: counts, axes, bands, classes.

use super::arguments::DescribeInput;
use super::check::{self, radar_json};
use super::program::in_words_of_inputs;
use super::root::Root;
use crate::target::ImportArgs;
use catseye::base::error::{BadInput, Error, Result, json_in_words};
use catseye::formats::csv::Table;
use catseye::formats::input::LARGEST_TEXT;
use catseye::formats::stage::MANIFEST;
use catseye::formats::{npy, rcs_csv, text};
use catseye::scene::{Shape, mesh_file, radar_toml};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Frames whose points are counted by class; more would be read for minutes.
const COUNTED_FRAMES: usize = 500;
/// Objects of a scene that are listed.
const LISTED_OBJECTS: usize = 200;

/// Describes a file or folder.
///
/// # Errors
/// Returns an error for what is outside the root, is not there, or is no result that catseye reads.
pub fn describe(root: &Root, input: &DescribeInput) -> Result<Value> {
    let path = root.inside("path", &input.path)?;
    if !path.exists() {
        let folder = format!("paths are relative to {}", root.folder().display());
        return Err(BadInput::new("no such file or folder")
            .key("path")
            .value(&input.path)
            .remedy(folder)
            .into());
    }
    if path.is_dir() {
        return folder(root, &path);
    }
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    match extension.as_str() {
        "csv" => table(&path),
        "npy" => array(&path),
        "glb" | "gltf" | "stl" | "obj" => mesh(&path, input).map_err(in_words_of_inputs),
        "toml" => {
            let path = root.inside_with_named("path", &path)?;
            let text = catseye::scene::toml_file::read_text(&path)?;
            let kind = check::kind_of(&path, &text)?;
            Ok(
                json!({ "what": format!("{kind} file"), "path": path, "holds": check::read(kind, &path, &text)? }),
            )
        }
        _ => Err(no_result(&path)),
    }
}

fn no_result(path: &Path) -> Error {
    BadInput::new("this kind of file or folder cannot be described")
        .file(path)
        .allowed("the folder of a run, a frame or a dataset; .csv, .npy, .glb, .gltf, .stl, .obj, .toml")
        .remedy("give a file or folder that catseye wrote")
        .into()
}

fn folder(root: &Root, path: &Path) -> Result<Value> {
    let manifest = path.join(MANIFEST);
    if manifest.is_file() {
        root.inside("path", &manifest)?;
        let manifest = json_file(&manifest)?;
        if manifest["frames"].is_array() && !manifest["axes"].is_null() {
            return run(root, path, &manifest);
        }
        if manifest["recipe"].is_string() {
            return dataset(root, path, &manifest);
        }
        return Err(no_result(path));
    }
    let above = path.parent().map(|p| if p.as_os_str().is_empty() { Path::new(".") } else { p });
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    if let Some(above) = above.filter(|p| name.starts_with("frame_") && p.join(MANIFEST).is_file()) {
        root.inside("path", above.join(MANIFEST))?;
        let manifest = json_file(&above.join(MANIFEST))?;
        let mut files = Vec::new();
        for radar in radars(&manifest) {
            files.push(frame(root, path, &radar)?);
        }
        return Ok(json!({ "what": "frame of a run", "path": path, "run": above, "radars": files }));
    }
    Err(no_result(path))
}

fn json_file(path: &Path) -> Result<Value> {
    let text = text::read(path, "a JSON file", LARGEST_TEXT)?;
    serde_json::from_str(&text)
        .map_err(|e| BadInput::new(format!("is not JSON: {}", json_in_words(&e))).file(path).into())
}

/// Names of the radars of a run that has several; one empty name for the radar of one that has one.
fn radars(manifest: &Value) -> Vec<String> {
    manifest["radar"].as_object().map_or_else(|| vec![String::new()], |m| m.keys().cloned().collect())
}

/// Folders of a run's frames with the radars whose files lie there, in the order of the frames.
pub fn frames(manifest: &Value, folder: &Path) -> Vec<(u64, String, PathBuf)> {
    let mut indices: Vec<u64> =
        manifest["frames"].as_array().into_iter().flatten().filter_map(|f| f["index"].as_u64()).collect();
    indices.dedup();
    let radars = radars(manifest);
    let of = |i: u64| {
        let radars = radars.clone();
        radars.into_iter().map(move |r| (i, r.clone(), folder.join(format!("frame_{i:06}")).join(r)))
    };
    indices.into_iter().flat_map(of).collect()
}

/// A run by its folder.
///
/// # Errors
/// Returns an error for a folder that holds no run.
pub fn run_in(root: &Root, path: &Path) -> Result<(Value, Value)> {
    let manifest = json_file(&path.join(MANIFEST))?;
    Ok((run(root, path, &manifest)?, manifest))
}

fn run(root: &Root, path: &Path, manifest: &Value) -> Result<Value> {
    let mut of_radars = Vec::new();
    for name in radars(manifest) {
        let pick = |key: &str| match name.is_empty() {
            true => manifest[key].clone(),
            false => manifest[key][&name].clone(),
        };
        let text = pick("radar");
        let radar = radar_toml::parse(&path.join("radar.toml"), text.as_str().unwrap_or_default())?;
        let mut about = radar_json(&radar);
        let mut axes = pick("axes");
        if let Some(axes) = axes.as_object_mut() {
            // Hundreds of directions say no more than their ends.
            for key in ["azimuth_deg", "elevation_deg"] {
                let ends = axes
                    .get(key)
                    .and_then(Value::as_array)
                    .map(|l| numbers(l.iter().filter_map(Value::as_f64)));
                if let Some(ends) = ends {
                    axes.insert(key.into(), ends);
                }
            }
        }
        about["axes"] = axes;
        of_radars.push(about);
    }
    let records = manifest["frames"].as_array().map(Vec::as_slice).unwrap_or_default();
    let sum = |key: &str| records.iter().filter_map(|r| r[key].as_u64()).sum::<u64>();
    let all = frames(manifest, path);
    let mut classes: BTreeMap<String, u64> = BTreeMap::new();
    let counted = all.len().min(COUNTED_FRAMES);
    for (_, _, dir) in &all[..counted] {
        let points = dir.join("points.csv");
        if points.is_file() {
            let table = Table::read(root.inside("path", &points)?)?;
            for class in table.text("class")? {
                *classes.entry(if class.is_empty() { "none".into() } else { class.into() }).or_default() += 1;
            }
        }
    }
    let first =
        all.first().map(|(_, radar, _)| frame(root, &path.join("frame_000000"), radar)).transpose()?;
    Ok(json!({
        "what": match manifest["kind"].as_str() { Some("run") | None => "run".into(), Some(k) => format!("run ({k})") },
        "path": path,
        "name": manifest["scenario_name"],
        "catseye": manifest["catseye"],
        "engine": manifest["engine"],
        "seed": manifest["seed"],
        "frames": all.len() / radars(manifest).len().max(1),
        "radars": of_radars,
        "echoes": sum("returns"),
        "points": sum("points"),
        "points_by_class": classes,
        "frames_counted_by_class": counted,
        "remarks": manifest["remarks"],
        "first_frame": first,
    }))
}

/// The files of a frame.
fn frame(root: &Root, folder: &Path, radar: &str) -> Result<Value> {
    let dir = root.inside("path", folder.join(radar))?;
    let mut files: Vec<String> = Vec::new();
    for entry in std::fs::read_dir(&dir).map_err(|e| Error::io(&dir, e))? {
        let entry = entry.map_err(|e| Error::io(&dir, e))?;
        if entry.path().is_file() {
            files.push(entry.file_name().to_string_lossy().into_owned());
        }
    }
    files.sort();
    let (pictures, files): (Vec<String>, Vec<String>) = files.into_iter().partition(|f| f.ends_with(".png"));
    let mut arrays = Map::new();
    for name in files.iter().filter(|f| f.ends_with(".npy")) {
        let header = npy::read_header(root.inside("path", dir.join(name))?)?;
        arrays.insert(
            name.clone(),
            json!({ "type": header.dtype(), "shape": header.shape, "axes": axes_of(name) }),
        );
    }
    Ok(json!({ "radar": radar, "folder": dir, "arrays": arrays, "files": files, "pictures": pictures }))
}

/// What the axes of a frame's arrays are.
fn axes_of(name: &str) -> Option<&'static str> {
    Some(match name {
        "adc.npy" => "chirp, virtual channel, sample",
        "range_doppler.npy" | "cfar_threshold.npy" => {
            "range rate (zero in the middle, positive receding), range"
        }
        _ => return None,
    })
}

fn dataset(root: &Root, path: &Path, manifest: &Value) -> Result<Value> {
    let stated = |name: &str| -> Result<Value> {
        let file = path.join(name);
        if file.is_file() { json_file(&root.inside("path", file)?) } else { Ok(Value::Null) }
    };
    let arrays = stated("schema.json")?;
    let statistics = stated("statistics.json")?;
    Ok(json!({
        "what": "dataset",
        "path": path,
        "name": manifest["name"],
        "catseye": manifest["catseye"],
        "seed": manifest["seed"],
        "devices": manifest["devices"],
        "frames": manifest["frames"],
        "shards": manifest["shards"],
        "files": manifest["checksums"].as_object().map_or(0, Map::len),
        "schema": arrays,
        "statistics": statistics,
    }))
}

/// Number of different values, the least and the largest.
fn numbers(values: impl Iterator<Item = f64>) -> Value {
    let mut all: Vec<f64> = values.filter(|x| x.is_finite()).collect();
    all.sort_by(f64::total_cmp);
    all.dedup();
    json!({ "values": all.len(), "least": all.first(), "largest": all.last() })
}

fn table(path: &Path) -> Result<Value> {
    let table = Table::read(path)?;
    if table.has("vv_dbsm") && table.has("frequency_hz") {
        return rcs(path);
    }
    Ok(json!({
        "what": "table",
        "path": path,
        "columns": table.header,
        "rows": table.len(),
        "comments": table.comments,
    }))
}

fn rcs(path: &Path) -> Result<Value> {
    let (comments, rows) = rcs_csv::read(path)?;
    let mut peaks = Map::new();
    for (k, name) in ["vv_dbsm", "vh_dbsm", "hv_dbsm", "hh_dbsm"].into_iter().enumerate() {
        let received = rows.iter().filter(|r| r.dbsm[k].is_finite());
        if let Some(r) = received.max_by(|a, b| a.dbsm[k].total_cmp(&b.dbsm[k])) {
            let at = json!({ "dbsm": r.dbsm[k], "frequency_hz": r.frequency_hz, "azimuth_deg": r.azimuth_deg,
                "elevation_deg": r.elevation_deg });
            peaks.insert(name.into(), at);
        }
    }
    Ok(json!({
        "what": "table of radar cross sections",
        "path": path,
        "rows": rows.len(),
        "frequency_hz": numbers(rows.iter().map(|r| r.frequency_hz)),
        "azimuth_deg": numbers(rows.iter().map(|r| r.azimuth_deg)),
        "elevation_deg": numbers(rows.iter().map(|r| r.elevation_deg)),
        "bistatic": rows.iter().any(|r| r.receive_deg.is_some()),
        "peaks": peaks,
        "comments": comments,
    }))
}

fn array(path: &Path) -> Result<Value> {
    let header = npy::read_header(path)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    Ok(json!({
        "what": "array",
        "path": path,
        "type": header.dtype(),
        "shape": header.shape,
        "fortran_order": header.fortran_order,
        "axes": axes_of(&name),
    }))
}

fn mesh(path: &Path, input: &DescribeInput) -> Result<Value> {
    let import = ImportArgs {
        materials: Vec::new(),
        default_material: None,
        unit: input.unit.clone(),
        up: input.up.clone(),
        animation: "all".into(),
        smooth_deg: None,
    };
    let scene = mesh_file::import(path, &import.options()?)?;
    let (least, largest) = scene.bounds_m(0.0).map(|(a, b)| (a.to_array(), b.to_array())).unzip();
    let objects: Vec<Value> = scene
        .objects
        .iter()
        .take(LISTED_OBJECTS)
        .map(|o| {
            let (shape, triangles, materials) = match &o.shape {
                Shape::Mesh(m) => {
                    let mesh = &scene.meshes[*m];
                    let mut used = mesh.material.clone();
                    used.sort_unstable();
                    used.dedup();
                    let names = used.iter().map(|i| scene.materials[*i as usize].name.clone()).collect();
                    ("mesh", mesh.triangles.len(), names)
                }
                Shape::Point { .. } => ("point", 0, Vec::<String>::new()),
                Shape::Table(_) => ("table", 0, Vec::new()),
            };
            json!({ "id": o.id, "name": o.name, "class": o.class, "shape": shape, "triangles": triangles,
                "materials": materials })
        })
        .collect();
    Ok(json!({
        "what": "mesh",
        "path": path,
        "triangles": scene.triangle_count(),
        "objects": scene.objects.len(),
        "listed_objects": objects,
        "least_m": least,
        "largest_m": largest,
        "axes": "x forward, y left, z up",
        "notes": scene.import.notes,
    }))
}

/// The rows of a table, with numbers where all cells of a column are numbers or empty.
///
/// # Errors
/// Returns an error for a table that cannot be read.
pub fn rows(path: &Path) -> Result<(Vec<String>, Vec<Vec<Value>>)> {
    let table = Table::read(path)?;
    let mut rows = vec![Vec::with_capacity(table.header.len()); table.len()];
    for name in &table.header {
        let cells = table.text(name)?;
        let number = |c: &str| -> Option<Value> {
            if c.is_empty() { Some(Value::Null) } else { c.trim().parse::<f64>().ok().map(|x| json!(x)) }
        };
        let numeric = cells.iter().any(|c| !c.is_empty()) && cells.iter().all(|c| number(c).is_some());
        for (row, cell) in rows.iter_mut().zip(&cells) {
            row.push(number(cell).filter(|_| numeric).unwrap_or_else(|| json!(cell)));
        }
    }
    Ok((table.header.clone(), rows))
}
