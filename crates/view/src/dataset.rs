//! A dataset: its frames with points, maps, masks and boxes, as its shards hold them.

use super::html::With;
use super::{Frames, Page, pack};
use catseye::base::error::Result;
use catseye::base::units::dbm_from_w;
use catseye::road::mask::Grid;
use catseye_io::dataset::DatasetFile;
use catseye_io::store::{Column, Data, DatasetLayout, Record, Table};
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};

/// Rows of a table of lanes are stations; a lane ends where the name or number changes.
const LANE_KEYS: [&str; 2] = ["road", "lane"];

/// The page of a dataset.
///
/// # Errors
/// Returns `BadInput` for a folder that holds no dataset, and for shards that are missing or damaged.
pub fn page(folder: &Path) -> Result<Page> {
    let about = DatasetFile::read(folder)?;
    let layout = DatasetLayout::open(folder)?;
    let first = layout.read(folder, 0)?;
    let radars = radar_names(&first);
    let shown: Vec<Value> = radars.iter().map(|name| radar_json(&first, name)).collect();
    let mut frames = Vec::new();
    let mut notes = Vec::new();
    for i in 0..layout.frames {
        let table = layout.read_table(folder, "frames", i)?;
        let time_s = numbers(&table, "time_ns").first().map_or(0.0, |t| t * 1e-9);
        let scene = numbers(&table, "scene").first().copied().unwrap_or(0.0);
        frames.push(
            json!({ "index": i, "time_s": time_s, "scene": scene, "split": text(&table, "split").first() }),
        );
        if let Ok(points) = layout.read_table(folder, "points", i) {
            let of = text(&points, "radar");
            for name in &radars {
                let n = of.iter().filter(|r| *r == name).count();
                notes.push(json!({ "index": i, "radar": name, "time_s": time_s, "points": n }));
            }
        }
    }
    let title = about.name.clone();
    let data = json!({
        "kind": "run",
        "title": title,
        "about": {
            "catseye": about.catseye, "engine": { "adapter": about.device.adapter }, "seed": about.seed,
            "dataset": format!("{} scenes, {} frames", about.scenes, layout.frames),
        },
        "radars": shown,
        "frames": frames,
        "notes": notes,
        "scene": null,
        "tables": {},
    });
    let (folder, count): (PathBuf, usize) = (folder.to_path_buf(), layout.frames as usize);
    let of = move |i: usize| {
        let record = layout.read(&folder, i as u64)?;
        Ok(frame(&record, &radars))
    };
    Ok(Page { title: about.name, data, with: With::Nothing, frames: Frames { count, of: Box::new(of) } })
}

fn table<'a>(record: &'a Record, name: &str) -> Option<&'a Table> {
    record.tables.iter().find(|t| t.name == name)
}

fn column<'a>(table: &'a Table, name: &str) -> Option<&'a Column> {
    table.columns.iter().find(|(n, _)| n == name).map(|(_, c)| c)
}

fn numbers(table: &Table, name: &str) -> Vec<f64> {
    match column(table, name) {
        Some(Column::I64(v)) => v.iter().map(|x| *x as f64).collect(),
        Some(Column::U32(v)) => v.iter().map(|x| f64::from(*x)).collect(),
        Some(Column::F64(v)) => v.clone(),
        Some(Column::F32(v)) => v.iter().map(|x| f64::from(*x)).collect(),
        Some(Column::Bool(v)) => v.iter().map(|x| f64::from(u8::from(*x))).collect(),
        Some(Column::Text(_)) | None => Vec::new(),
    }
}

fn text(table: &Table, name: &str) -> Vec<String> {
    match column(table, name) {
        Some(Column::Text(v)) => v.clone(),
        _ => Vec::new(),
    }
}

fn radar_names(record: &Record) -> Vec<String> {
    table(record, "radars").map(|t| text(t, "radar")).unwrap_or_default()
}

/// Row of a radar in the table of radars.
fn radar_row(record: &Record, name: &str) -> Option<(usize, usize)> {
    let names = radar_names(record);
    names.iter().position(|n| n == name).map(|i| (i, names.len()))
}

/// Name of a radar's array, as the dataset has it.
fn array_name(base: &str, radar: &str, radars: usize) -> String {
    match radars {
        1 => base.to_string(),
        _ => format!("{base}_{}", radar.to_ascii_lowercase().replace('-', "_")),
    }
}

fn radar_json(record: &Record, name: &str) -> Value {
    let Some((row, radars)) = radar_row(record, name) else { return Value::Null };
    let value =
        |key: &str| table(record, "radars").and_then(|t| numbers(t, key).get(row).copied()).unwrap_or(0.0);
    let map = array_name("range_doppler", name, radars);
    let shape = record.arrays.iter().find(|a| a.name == map).map(|a| a.shape.clone());
    // Without a map the axes have their step alone, for folds that are not drawn.
    let [rows, columns] = shape.as_deref().and_then(|s| s.try_into().ok()).unwrap_or([0, 0]);
    let rate_rows = (-2.0 * value("first_range_rate_mps") / value("range_rate_bin_mps")).round() as usize;
    json!({
        "name": name,
        "range_m": { "first": value("first_range_m"), "step": value("range_bin_m"), "count": columns },
        "range_rate_mps": {
            "first": value("first_range_rate_mps"), "step": value("range_rate_bin_mps"),
            "count": if rows > 0 { rows } else { rate_rows },
        },
        "azimuth_deg": [],
        "max_azimuth_deg": 60.0,
        "max_range_m": 80.0,
        "carrier_hz": value("carrier_hz"),
    })
}

fn pose(table: &Table, row: usize) -> Vec<f64> {
    ["x_m", "y_m", "z_m", "rotation_x", "rotation_y", "rotation_z", "rotation_w"]
        .iter()
        .filter_map(|c| numbers(table, c).get(row).copied())
        .collect()
}

/// A column as the page takes it, of the rows that are wanted.
fn part(column: &Column, keep: &[usize]) -> Value {
    let number = |x: f64| if x.is_finite() { json!(x) } else { Value::Null };
    match column {
        Column::I64(v) => keep.iter().map(|i| json!(v[*i])).collect(),
        Column::U32(v) => keep.iter().map(|i| json!(v[*i])).collect(),
        Column::F64(v) => keep.iter().map(|i| number(v[*i])).collect(),
        Column::F32(v) => keep.iter().map(|i| number(f64::from(v[*i]))).collect(),
        Column::Bool(v) => keep.iter().map(|i| json!(u8::from(v[*i]))).collect(),
        Column::Text(v) => keep.iter().map(|i| json!(v[*i])).collect(),
    }
}

fn frame(record: &Record, radars: &[String]) -> Value {
    let mut out = json!({ "index": record.frame });
    if let Some(t) = table(record, "frames") {
        out["time_s"] = json!(numbers(t, "time_ns").first().map_or(0.0, |t| t * 1e-9));
        out["ego"] = json!(pose(t, 0));
        let scene = numbers(t, "scene").first().copied().unwrap_or(0.0);
        out["told"] =
            json!(format!("scene {scene}, {}", text(t, "split").first().map_or("", String::as_str)));
    }
    if let Some(t) = table(record, "boxes") {
        out["boxes"] = boxes(t);
    }
    if let Some(t) = table(record, "lanes") {
        out["lanes"] = lanes(t);
    }
    let of = |name: &String| {
        let mut own = Map::new();
        if let (Some(t), Some((row, _))) = (table(record, "radars"), radar_row(record, name)) {
            own.insert("pose".into(), json!(pose(t, row)));
        }
        if let Some(t) = table(record, "points") {
            let whose = text(t, "radar");
            let keep: Vec<usize> = (0..whose.len()).filter(|i| whose[*i] == *name).collect();
            let columns = t.columns.iter().filter(|(n, _)| n != "radar");
            own.insert("points".into(), columns.map(|(n, c)| (n.clone(), part(c, &keep))).collect());
        }
        let array = |base: &str| {
            let wanted = array_name(base, name, radars.len());
            record.arrays.iter().find(|a| a.name == wanted)
        };
        if let Some(Data::F32(w)) = array("range_doppler").map(|a| &a.data) {
            let levels: Vec<f64> = w.iter().map(|w| dbm_from_w(f64::from(*w))).collect();
            own.insert("map".into(), pack::levels(&levels));
        }
        for (base, grid) in [("mask_road", Grid::ROAD), ("mask_markers", Grid::MARKERS)] {
            if let Some(Data::U8(classes)) = array(base).map(|a| &a.data) {
                own.insert(base.into(), json!({
                    "rows": grid.rows, "columns": grid.columns, "ahead_m": grid.ahead_m, "across_m": grid.across_m,
                    "classes": pack::u8s(classes),
                }));
            }
        }
        Value::Object(own)
    };
    out["radars"] = radars.iter().map(of).collect();
    out
}

/// Boxes of whole objects.
fn boxes(t: &Table) -> Value {
    let (ids, parents) = (numbers(t, "id"), numbers(t, "parent_id"));
    let (names, classes) = (text(t, "name"), text(t, "class"));
    let [length, width, height] = ["length_m", "width_m", "height_m"].map(|c| numbers(t, c));
    (0..ids.len())
        .filter(|i| ids[*i] == parents[*i])
        .map(|i| {
            json!({
                "id": ids[i], "name": names[i], "class": classes[i], "size": [length[i], width[i], height[i]],
                "pose": pose(t, i),
            })
        })
        .collect()
}

fn lanes(t: &Table) -> Value {
    let (road, lane) = (text(t, LANE_KEYS[0]), numbers(t, LANE_KEYS[1]));
    let side = |name: &str| ["x", "y", "z"].map(|axis| numbers(t, &format!("{name}_{axis}_m")));
    let (left, right) = (side("left"), side("right"));
    let mut out = Vec::new();
    let mut from = 0;
    for i in 1..=road.len() {
        if i < road.len() && road[i] == road[from] && lane[i] == lane[from] {
            continue;
        }
        let line =
            |l: &[Vec<f64>; 3]| pack::f32s((from..i).flat_map(|k| l.iter().map(move |axis| axis[k] as f32)));
        out.push(
            json!({ "road": road[from], "number": lane[from], "left": line(&left), "right": line(&right) }),
        );
        from = i;
    }
    out.into()
}
