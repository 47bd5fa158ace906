//! A run, or one frame of it.

use super::causes::Returns;
use super::html::With;
use super::lanes::{Lanes, OfRun};
use super::{Frames, Page, pack, scene, table};
use catseye::base::error::{BadInput, Result, json_in_words};
use catseye::base::units::dbm_from_w;
use catseye::formats::csv::Table;
use catseye::formats::input::{LARGEST_TEXT, read};
use catseye::formats::npy;
use catseye::formats::stage::MANIFEST;
use catseye::scene::gltf::{self, ImportOptions};
use catseye::scene::radar::Radar;
use catseye::scene::{Scene, radar_toml};
use catseye_io::files::{Truth, frame_name};
use catseye_io::manifest::{Axes, PerRadar};
use serde::Deserialize;
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};

/// Most points of a frame that a page draws: of more it has the strongest, and says so. A million with their echoes are 500 MiB of
/// script, which a browser does not open.
const MOST_POINTS: usize = 20_000;

/// What of a run's manifest a page needs.
#[derive(Deserialize)]
struct RunManifest {
    #[serde(default)]
    catseye: String,
    engine: Value,
    #[serde(default)]
    seed: Option<u64>,
    #[serde(default)]
    scenario: Option<String>,
    #[serde(default)]
    scenario_name: String,
    radar: PerRadar<String>,
    axes: PerRadar<Axes>,
    frames: Vec<FrameNote>,
    #[serde(default)]
    remarks: Vec<String>,
}

#[derive(Deserialize)]
struct FrameNote {
    index: u32,
    radar: String,
    time_s: f64,
    points: u64,
    #[serde(default)]
    returns: u64,
}

struct RunRadar {
    name: String,
    radar: Radar,
    axes: Axes,
}

/// A run's folder, opened.
struct Run {
    folder: PathBuf,
    radars: Vec<RunRadar>,
    /// Number and time of each frame that is shown.
    frames: Vec<(u32, f64)>,
    /// Whether the scene itself is there; else boxes stand for it.
    has_scene: bool,
    /// Lanes that a method found in this drive.
    lanes: Option<Lanes>,
}

/// The page of a run; of one frame of it where `only` is given, and with the estimates of `lanes` where they are.
///
/// # Errors
/// Returns `BadInput` for a folder without a run's manifest, and for files of it that are cut short or do not fit.
pub fn page(folder: &Path, only: Option<u32>, lanes: Option<&Path>) -> Result<Page> {
    let path = folder.join(MANIFEST);
    let bytes = read(&path, "a run's manifest", LARGEST_TEXT)?;
    let manifest: RunManifest = serde_json::from_slice(&bytes).map_err(|e| {
        // A manifest of another version may lack what this one reads.
        let other = serde_json::from_slice::<Value>(&bytes)
            .ok()
            .and_then(|v| Some(v.get("catseye")?.as_str()?.to_string()));
        let told = match other.filter(|v| v != env!("CARGO_PKG_VERSION")) {
            Some(v) => format!(
                "was written by catseye {v}, and this is catseye {}: {}",
                env!("CARGO_PKG_VERSION"),
                json_in_words(&e)
            ),
            None => format!("is not a manifest of a run: {}", json_in_words(&e)),
        };
        BadInput::new(told)
            .file(&path)
            .remedy("give a folder that `catseye simulate` of this version completed")
    })?;
    let mut frames: Vec<(u32, f64)> = manifest.frames.iter().map(|f| (f.index, f.time_s)).collect();
    frames.dedup_by_key(|f| f.0);
    if let Some(index) = only {
        frames.retain(|f| f.0 == index);
    }
    if frames.is_empty() {
        return Err(BadInput::new("has no such frame")
            .file(folder)
            .allowed(format!("{} frames", manifest.frames.len()))
            .remedy("give the folder of the run, or one of its frames")
            .into());
    }
    let of_run = OfRun { seed: manifest.seed, scenario: manifest.scenario.as_deref(), frames: &frames };
    let lanes = lanes.map(|path| Lanes::read(path, &of_run)).transpose()?;
    let texts: Vec<(String, &String)> = match &manifest.radar {
        PerRadar::One(text) => vec![(String::new(), text)],
        PerRadar::Several(by_name) => by_name.iter().map(|(n, t)| (n.clone(), t)).collect(),
    };
    let mut radars = Vec::new();
    for (name, text) in texts {
        let radar = radar_toml::parse(&folder.join("radar.toml"), text)?;
        let axes = manifest.axes.get(&name).cloned().unwrap_or_else(|| Axes::of(&radar));
        radars.push(RunRadar { name, radar, axes });
    }
    let glb = folder.join("scene.glb");
    let times_s: Vec<f64> = frames.iter().map(|f| f.1).collect();
    let (whole, has_scene): (Option<Scene>, bool) = match glb.is_file() {
        true => {
            let bytes = gltf::read_bytes(&glb)?;
            let scene = gltf::import_bytes(&bytes, &glb, Some(folder), &ImportOptions::default())?;
            let few = scene.triangle_count() <= scene::MOST_TRIANGLES;
            (few.then_some(scene), few)
        }
        false => (None, false),
    };
    let mut tables = Map::new();
    for name in ["tracks", "ego_motion"] {
        let path = folder.join(format!("{name}.csv"));
        if path.is_file() {
            tables.insert(name.into(), table::columns(&path)?.0);
        }
    }
    let notes: Vec<Value> = manifest
        .frames
        .iter()
        .filter(|f| frames.iter().any(|(i, _)| *i == f.index))
        .map(|f| json!({ "index": f.index, "radar": f.radar, "time_s": f.time_s, "points": f.points, "returns": f.returns }))
        .collect();
    let title = match manifest.scenario_name.as_str() {
        "" => folder.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        name => name.to_string(),
    };
    let data = json!({
        "kind": "run",
        "title": title,
        "about": { "catseye": manifest.catseye, "engine": manifest.engine, "seed": manifest.seed, "remarks": manifest.remarks },
        "radars": radars.iter().map(radar_json).collect::<Vec<_>>(),
        "frames": frames.iter().map(|(i, t)| json!({ "index": i, "time_s": t })).collect::<Vec<_>>(),
        "notes": notes,
        "scene": whole.as_ref().map(|s| scene::scene(s, &times_s)),
        "tables": tables,
        "lanes": lanes.as_ref().map(|l| json!({ "method": l.method, "remark": l.remark })),
    });
    let run = Run { folder: folder.to_path_buf(), radars, frames, has_scene, lanes };
    let count = run.frames.len();
    Ok(Page {
        title,
        data,
        with: With::Nothing,
        frames: Frames { count, of: Box::new(move |i| run.frame(i)) },
    })
}

fn radar_json(r: &RunRadar) -> Value {
    let Axes { range_m, range_rate_mps, azimuth_deg, elevation_deg, .. } = &r.axes;
    let axis = |a: &catseye_io::manifest::Axis| json!({ "first": a.first, "step": a.step, "count": a.count });
    json!({
        "name": if r.name.is_empty() { &r.radar.name } else { &r.name },
        "range_m": axis(range_m),
        "range_rate_mps": axis(range_rate_mps),
        "azimuth_deg": azimuth_deg,
        "elevation_deg": elevation_deg,
        "max_azimuth_deg": r.radar.processing.azimuth_fov_rad.to_degrees(),
        "max_range_m": r.radar.max_range_m(),
        "carrier_hz": r.radar.carrier_hz,
        "channels": r.radar.virtual_channels(),
    })
}

impl Run {
    fn frame(&self, i: usize) -> Result<Value> {
        let (index, time_s) = self.frames[i];
        let dir = self.folder.join(frame_name(index));
        if !dir.is_dir() {
            return Err(BadInput::new("is missing").file(&dir).remedy("simulate the run again").into());
        }
        let mut out = json!({ "index": index, "time_s": time_s });
        let mut radars = Vec::new();
        for (which, r) in self.radars.iter().enumerate() {
            let dir = if self.radars.len() > 1 { dir.join(&r.name) } else { dir.clone() };
            let mut own = Map::new();
            let truth = dir.join("truth.json");
            if truth.is_file() {
                let bytes = read(&truth, "the truth of a frame", LARGEST_TEXT)?;
                let truth: Truth = serde_json::from_slice(&bytes).map_err(|e| {
                    BadInput::new(format!("is not the truth of a frame: {}", json_in_words(&e)))
                        .file(&truth)
                        .remedy("simulate the run again, since the file is truncated or changed")
                })?;
                let pose =
                    |p: &catseye_io::files::PoseRecord| [&p.position_m[..], &p.rotation_xyzw[..]].concat();
                own.insert("pose".into(), json!(pose(&truth.radar)));
                if which == 0 {
                    if let Some(lanes) = &self.lanes {
                        out["estimate"] = lanes.frame(index, &truth.ego);
                    }
                    out["ego"] = json!(pose(&truth.ego));
                    out["lanes"] = truth.lanes.iter().map(lane).collect();
                    out["actors"] =
                        truth.actors.iter().map(|a| serde_json::to_value(a).unwrap_or_default()).collect();
                    if !self.has_scene {
                        out["boxes"] = truth.boxes.iter().map(boxed).collect();
                    }
                }
            }
            if which == 0 && self.lanes.is_some() && !truth.is_file() {
                let bad =
                    BadInput::new("is missing, and states the position of the vehicle of the lane estimates");
                return Err(bad.file(&truth).remedy("simulate the run with [output] truth = true").into());
            }
            let points = dir.join("points.csv");
            if points.is_file() {
                let whole = Table::read(&points)?;
                let rows = table::largest(&whole, "power_dbm", MOST_POINTS)?;
                own.insert("points".into(), table::columns_of(&whole, rows.as_deref())?);
                if let Some(returns) = Returns::read(&dir)? {
                    own.insert("causes".into(), causes(&whole, rows.as_deref(), &r.radar, &returns)?);
                }
                if let Some(rows) = rows {
                    own.insert("points_in_file".into(), json!(whole.len()));
                    own.insert("point_rows".into(), pack::u32s(rows));
                }
            }
            let cells = [r.axes.range_rate_mps.count, r.axes.range_m.count];
            for (key, file) in [("map", "range_doppler.npy"), ("threshold", "cfar_threshold.npy")] {
                let path = dir.join(file);
                if path.is_file() {
                    own.insert(key.into(), map(&path, cells)?);
                }
            }
            let spectra = dir.join("angle_spectra.npy");
            if spectra.is_file() {
                let array = npy::read_f32(&spectra)?;
                let levels: Vec<f64> = array.data.iter().map(|w| dbm_from_w(f64::from(*w))).collect();
                own.insert(
                    "spectra".into(),
                    json!({ "shape": array.shape, "levels": pack::levels(&levels) }),
                );
                own.insert("spectrum_cells".into(), table::columns(&dir.join("angle_cells.csv"))?.0);
            }
            radars.push(Value::Object(own));
        }
        out["radars"] = radars.into();
        Ok(out)
    }
}

/// The echoes behind each point, or behind those of these rows, in the order of `points.csv`.
fn causes(table: &Table, rows: Option<&[u32]>, radar: &Radar, returns: &Returns) -> Result<Value> {
    let [range, rate, azimuth, elevation] =
        ["range_m", "range_rate_mps", "azimuth_deg", "elevation_deg"].map(|c| table.numbers(c));
    let (range, rate, azimuth, elevation) = (range?, rate?, azimuth?, elevation?);
    let or_level = |deg: f64| if deg.is_finite() { deg } else { 0.0 };
    let all = 0..rows.map_or(table.len(), <[u32]>::len);
    Ok(all
        .map(|i| rows.map_or(i, |r| r[i] as usize))
        .map(|i| returns.of(radar, range[i], rate[i], or_level(azimuth[i]), or_level(elevation[i])))
        .collect())
}

/// A map as levels in dBm, `[doppler, range]`.
fn map(path: &Path, cells: [usize; 2]) -> Result<Value> {
    let array = npy::read_f32(path)?;
    if array.shape != cells {
        return Err(BadInput::new("the shape differs from the axes of the manifest")
            .file(path)
            .value(format!("{:?}", array.shape))
            .allowed(format!("{cells:?}"))
            .remedy("simulate the run again")
            .into());
    }
    let levels: Vec<f64> = array.data.iter().map(|w| dbm_from_w(f64::from(*w))).collect();
    Ok(pack::levels(&levels))
}

fn lane(l: &catseye::road::near::LaneTruth) -> Value {
    let line = |points: &[[f64; 3]]| pack::f32s(points.iter().flatten().map(|x| *x as f32));
    json!({ "road": l.road, "number": l.number, "left": line(&l.left_m), "right": line(&l.right_m) })
}

fn boxed(b: &catseye::road::TruthBox) -> Value {
    let pose = [&b.centre_m[..], &b.rotation_xyzw[..]].concat();
    json!({ "id": b.id, "name": b.name, "class": b.class, "size": b.size_m, "pose": pose })
}
