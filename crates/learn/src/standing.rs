//! Where the radar of a frame stood, as a vehicle knows it from its own odometry.

use crate::joint::Place;
use crate::source::{Place as At, Source};
use catseye::base::error::{BadInput, Result, json_in_words};
use catseye::formats::input;
use catseye_io::store::Column;
use glam::{DQuat, DVec3};
use serde::Deserialize;

/// Largest `truth.json` that is read, bytes.
const MOST_BYTES: u64 = 1 << 28;

#[derive(Deserialize)]
struct TruthFile {
    radar: Standing,
}

#[derive(Deserialize)]
struct Standing {
    position_m: [f64; 3],
    rotation_xyzw: [f64; 4],
}

/// The place of a frame's radar: of a run from `truth.json`, of a dataset from the table `radars`. Nothing else is taken from there.
///
/// # Errors
/// Returns `BadInput` where it is not told.
pub fn place_of(source: &Source) -> Result<Place> {
    let (position_m, rotation_xyzw) = match &source.at {
        At::Folder(frame) => {
            let path = frame.join("truth.json");
            if !path.is_file() {
                let bad = BadInput::new(
                    "scans of a run are combined with the poses of its truth, which is missing",
                );
                return Err(bad
                    .file(&path)
                    .remedy("set truth = true in [output] of the scenario, or use one scan")
                    .into());
            }
            let bytes = input::read(&path, "the truth of a frame", MOST_BYTES)?;
            let truth: TruthFile = serde_json::from_slice(&bytes)
                .map_err(|e| BadInput::new(format!("is damaged: {}", json_in_words(&e))).file(&path))
                .map_err(|b| b.remedy("simulate the run again, or use one scan"))?;
            (truth.radar.position_m, truth.radar.rotation_xyzw)
        }
        At::Stored { store, frame, suffix } => {
            let table = store.layout.read_table(&store.dir, "radars", *frame)?;
            let bad = || {
                let bad =
                    BadInput::new("the table has no such column of numbers").file(&store.dir).key("radars");
                bad.remedy("make the dataset with this version of catseye, or use one scan")
            };
            let column = |name: &str| table.columns.iter().find(|(n, _)| n == name).map(|(_, c)| c);
            let row = match (suffix.strip_prefix('_'), column("radar")) {
                (Some(radar), Some(Column::Text(names))) => {
                    names.iter().position(|n| n.to_ascii_lowercase().replace('-', "_") == radar)
                }
                _ => Some(0),
            };
            let value = |name: &str| -> Result<f64> {
                match (column(name), row) {
                    (Some(Column::F64(values)), Some(row)) if row < values.len() => Ok(values[row]),
                    _ => Err(bad().value(name).into()),
                }
            };
            let position = [value("x_m")?, value("y_m")?, value("z_m")?];
            let parts = ["rotation_x", "rotation_y", "rotation_z", "rotation_w"].map(value);
            let [x, y, z, w] = parts;
            (position, [x?, y?, z?, w?])
        }
    };
    let ahead = (DQuat::from_array(rotation_xyzw) * DVec3::X).truncate();
    let at_m = DVec3::from_array(position_m).truncate();
    match ahead.try_normalize().filter(|_| at_m.is_finite()) {
        Some(ahead) => Ok(Place { at_m, ahead }),
        None => Err(BadInput::new("the radar points straight up, or its position is not finite")
            .key("rotation_xyzw")
            .value(format!("{rotation_xyzw:?}"))
            .remedy("use one scan")
            .into()),
    }
}
