//! `echoes.npy` and `echoes.json` of a frame: all its echoes in full, with what they follow from. `simulate --from` and `dataset --from` make
//! frames of another radar from them.

use catseye::base::error::{BadInput, Error, Result, json_in_words};
use catseye::formats::input::{LARGEST_TEXT, read};
use catseye::formats::npy::{self, Array};
use catseye::simulate::kept::{KeptTrace, TraceOrigin};
use catseye::trace::{Echo, Echoes, MAX_BOUNCES};
use glam::DVec3;
use num_complex::Complex64;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::path::Path;

/// Version of both files.
pub const VERSION: u32 = 1;
/// Name of the table.
pub const TABLE: &str = "echoes.npy";
/// Name of what the echoes follow from.
pub const ORIGIN: &str = "echoes.json";

/// Table of a dataset with a row for each echo.
pub const ECHOES: &str = "echoes";
/// Table of a dataset with a row for each radar: what its trace follows from.
pub const TRACES: &str = "traces";

/// Columns of [`TABLE`], float64, in SI units and the sensor's axes; rows are the echoes in the order of the trace.
pub const COLUMNS: [&str; 27 + MAX_BOUNCES + 1] = [
    "path_length_m",
    "path_rate_mps",
    "path_acceleration_mps2",
    "path_jerk_mps3",
    "departure_x",
    "departure_y",
    "departure_z",
    "first_range_m",
    "first_velocity_x_mps",
    "first_velocity_y_mps",
    "first_velocity_z_mps",
    "arrival_x",
    "arrival_y",
    "arrival_z",
    "last_range_m",
    "last_velocity_x_mps",
    "last_velocity_y_mps",
    "last_velocity_z_mps",
    "gain_vv_re",
    "gain_vv_im",
    "gain_vh_re",
    "gain_vh_im",
    "gain_hv_re",
    "gain_hv_im",
    "gain_hh_re",
    "gain_hh_im",
    // 1 for an estimate of what one bounce more would bring, which is no echo of the frame.
    "beyond_the_last_bounce",
    "object_1",
    "object_2",
    "object_3",
    "object_4",
    "object_5",
    "object_6",
    "object_7",
    "object_8",
    "bounces",
];

/// Function that gives the kept trace of a frame: number of the scene, of the frame in it, name of the radar, and whether it is the only one.
pub type Give = dyn Fn(u32, u32, &str, bool) -> Result<KeptTrace> + Send + Sync;

/// Where the echoes of a dataset's frames come from that are not traced.
pub struct KeptEchoes {
    /// SHA-256 of the dataset that holds them.
    pub digest: String,
    /// Function that gives those of a frame.
    pub give: Box<Give>,
}

impl std::fmt::Debug for KeptEchoes {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "KeptEchoes({})", self.digest)
    }
}

/// Numbers of the places between the first and the last bounce.
const BETWEEN: usize = 3 * (MAX_BOUNCES - 2);

/// Content of [`ORIGIN`].
#[derive(Debug, Serialize, Deserialize)]
struct Kept {
    version: u32,
    columns: Vec<String>,
    triangles: usize,
    rays: u64,
    beyond_reach: u64,
    merged: u64,
    bounces: usize,
    power_w: f64,
    cut_power_w: f64,
    broken: u64,
    on_device: bool,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    fallback: Option<String>,
    origin: TraceOrigin,
}

/// Numbers in a row of the table.
fn width(places: bool) -> usize {
    COLUMNS.len() + if places { BETWEEN } else { 0 }
}

/// Size of the table's numbers, bytes.
pub fn table_bytes(kept: &KeptTrace) -> u64 {
    let rows = kept.echoes.list.len() + kept.echoes.cut.len();
    8 * (rows * width(kept.origin.settings.places)) as u64
}

/// Writes both files into the folder of a frame.
///
/// # Errors
/// Returns an error if a file cannot be written.
pub fn write(dir: &Path, kept: &KeptTrace) -> Result<()> {
    let places = kept.origin.settings.places;
    let width = width(places);
    let mut rows = Vec::with_capacity((kept.echoes.list.len() + kept.echoes.cut.len()) * width);
    for (echo, is_cut) in all(kept) {
        rows.extend(row(echo, is_cut));
        if places {
            let at = rows.len();
            rows.extend(echo.between_m.iter().flat_map(|p| p.to_array()));
            rows.resize(at + BETWEEN, 0.0);
        }
    }
    npy::write(dir.join(TABLE), &[rows.len() / width, width], &rows)?;
    let path = dir.join(ORIGIN);
    std::fs::write(&path, origin_text(kept, places)?).map_err(|e| Error::io(&path, e))
}

/// All echoes of a trace, and whether each is an estimate of what one bounce more would bring.
pub fn all(kept: &KeptTrace) -> impl Iterator<Item = (&Echo, bool)> {
    let echoes = kept.echoes.list.iter().map(|e| (e, false));
    echoes.chain(kept.echoes.cut.iter().map(|e| (e, true)))
}

/// Text of [`ORIGIN`], on one line, with or without the places of all bounces in the table.
///
/// # Errors
/// Returns an error if it cannot be serialized.
pub fn origin_text(kept: &KeptTrace, places: bool) -> Result<String> {
    let e = &kept.echoes;
    let mut columns: Vec<String> = COLUMNS.map(String::from).into();
    if places {
        let axes = ["x", "y", "z"];
        columns.extend((0..BETWEEN).map(|i| format!("place_{}_{}_m", i / 3 + 2, axes[i % 3])));
    }
    let mut origin = kept.origin.clone();
    origin.settings.places = places;
    serde_json::to_string(&Kept {
        version: VERSION,
        columns,
        triangles: kept.triangles,
        rays: e.rays,
        beyond_reach: e.beyond_reach,
        merged: e.merged,
        bounces: e.bounces,
        power_w: e.power_w,
        cut_power_w: e.cut_power_w,
        broken: e.broken,
        on_device: e.on_device,
        fallback: e.fallback.as_deref().map(String::from),
        origin,
    })
    .map_err(|e| Error::Failed(format!("{ORIGIN}: {e}")))
}

/// The numbers of an echo in the order of [`COLUMNS`].
pub fn row(e: &Echo, is_cut: bool) -> [f64; COLUMNS.len()] {
    let mut numbers = [0.0; COLUMNS.len()];
    let all = [e.path_length_m, e.path_rate_mps]
        .into_iter()
        .chain(e.path_acceleration_and_jerk)
        .chain(e.departure.to_array())
        .chain([e.first_range_m])
        .chain(e.first_velocity_mps.to_array())
        .chain(e.arrival.to_array())
        .chain([e.last_range_m])
        .chain(e.last_velocity_mps.to_array())
        .chain(e.path_gain.iter().flatten().flat_map(|z| [z.re, z.im]))
        .chain([f64::from(u8::from(is_cut))])
        .chain(e.chain.map(f64::from))
        .chain([f64::from(e.bounces)]);
    numbers.iter_mut().zip(all).for_each(|(to, x)| *to = x);
    numbers
}

/// Reads both files from the folder of a frame.
///
/// # Errors
/// Returns `BadInput` if a file is missing, is of another version, or holds what no trace gives.
pub fn read_from(dir: &Path) -> Result<KeptTrace> {
    let origin_path = dir.join(ORIGIN);
    if !origin_path.is_file() {
        return Err(BadInput::new("the frame was written without its echoes")
            .file(dir)
            .key(ORIGIN)
            .remedy("set output.echoes = true in the scenario and simulate it again")
            .into());
    }
    let bytes = read(&origin_path, "a file of echoes", LARGEST_TEXT)?;
    let table = dir.join(TABLE);
    assembled(&bytes, &origin_path, &table, &|width| {
        let rows: Array<f64> = npy::read(&table)?;
        if rows.shape.len() != 2 || rows.shape[1] != width {
            return Err(BadInput::new("the shape of the table is not that of a table of echoes")
                .file(&table)
                .value(format!("{:?}", rows.shape))
                .allowed(format!("[echoes, {width}]"))
                .remedy(AGAIN)
                .into());
        }
        npy::check_finite(&table, &rows, f64::is_finite)?;
        Ok(rows.data)
    })
}

/// The trace of an origin's text, and of the table whose numbers `rows` gives for the width of a row. `origin_path` and `table` name both in
/// errors.
///
/// # Errors
/// Returns `BadInput` for another version, or for what no trace gives, and the errors of `rows`.
pub fn assembled(
    origin: &[u8],
    origin_path: &Path,
    table: &Path,
    rows: &dyn Fn(usize) -> Result<Vec<f64>>,
) -> Result<KeptTrace> {
    let bad = |problem: String| BadInput::new(problem).file(origin_path).remedy(AGAIN);
    let version: Versioned =
        serde_json::from_slice(origin).map_err(|e| bad(format!("damaged: {}", json_in_words(&e))))?;
    if version.version != VERSION {
        return Err(bad("the echoes were written by another version of catseye".into())
            .key("version")
            .value(version.version)
            .allowed(VERSION.to_string())
            .into());
    }
    let kept: Kept =
        serde_json::from_slice(origin).map_err(|e| bad(format!("damaged: {}", json_in_words(&e))))?;
    let width = width(kept.origin.settings.places);
    let rows = rows(width)?;
    let mut echoes = Echoes {
        rays: kept.rays,
        beyond_reach: kept.beyond_reach,
        merged: kept.merged,
        bounces: kept.bounces,
        power_w: kept.power_w,
        cut_power_w: kept.cut_power_w,
        broken: kept.broken,
        on_device: kept.on_device,
        fallback: kept.fallback.map(Cow::Owned),
        ..Default::default()
    };
    for (number, row) in rows.chunks_exact(width).enumerate() {
        let is_cut = row[26] != 0.0;
        let echo = echo_of(row).filter(|e| is_cut || is_possible(e)).ok_or_else(|| {
            BadInput::new("is not a possible echo")
                .file(table)
                .key(format!("row {number}"))
                .allowed("unit directions, ranges of zero or more, whole object ids, 1 to 8 bounces")
                .remedy(AGAIN)
        })?;
        if is_cut { &mut echoes.cut } else { &mut echoes.list }.push(echo);
    }
    Ok(KeptTrace { origin: kept.origin, triangles: kept.triangles, echoes, file: Some(origin_path.into()) })
}

/// Remedy for files that are damaged or of another version.
pub(crate) const AGAIN: &str = "simulate the run again";

#[derive(Deserialize)]
struct Versioned {
    version: u32,
}

/// The echo of a row; None for numbers that no echo has.
fn echo_of(row: &[f64]) -> Option<Echo> {
    let vector = |at: usize| DVec3::new(row[at], row[at + 1], row[at + 2]);
    let gain = |at: usize| Complex64::new(row[at], row[at + 1]);
    let whole = |x: f64, most: f64| (x >= 0.0 && x <= most && x.fract() == 0.0).then_some(x);
    let mut chain = [0; MAX_BOUNCES];
    for (to, x) in chain.iter_mut().zip(&row[27..]) {
        *to = whole(*x, f64::from(u32::MAX))? as u32;
    }
    let bounces = whole(row[27 + MAX_BOUNCES], MAX_BOUNCES as f64)? as u8;
    let between = usize::from(bounces).saturating_sub(2);
    let places = row[COLUMNS.len()..].chunks_exact(3).take(between);
    Some(Echo {
        path_length_m: row[0],
        path_rate_mps: row[1],
        path_acceleration_and_jerk: [row[2], row[3]],
        departure: vector(4),
        first_range_m: row[7],
        first_velocity_mps: vector(8),
        arrival: vector(11),
        last_range_m: row[14],
        last_velocity_mps: vector(15),
        path_gain: [[gain(18), gain(20)], [gain(22), gain(24)]],
        chain,
        bounces,
        between_m: places.map(|p| DVec3::new(p[0], p[1], p[2])).collect(),
    })
}

fn is_possible(echo: &Echo) -> bool {
    let unit = |d: DVec3| (d.length() - 1.0).abs() < 1e-6;
    let ranges = [echo.path_length_m, echo.first_range_m, echo.last_range_m];
    unit(echo.departure) && unit(echo.arrival) && ranges.iter().all(|r| *r >= 0.0)
}
