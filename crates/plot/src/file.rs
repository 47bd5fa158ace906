//! Pictures of result files: what a file holds is told from its columns or its array type.

use super::birds_eye::{BirdsEye, BirdsEyePoint, FieldOfView, birds_eye};
use super::canvas::Picture;
use super::chart::{ColourMap, Scale, heat_map};
use super::range_doppler::{RangeDoppler, decibel_limits, ends, noise_scale, range_doppler};
use super::rcs::{RcsRow, RcsStyle, rcs_picture};
use catseye::base::error::{BadInput, Result, json_in_words};
use catseye::base::units::dbm_from_w;
use catseye::formats::{csv::Table, input, npy, stage::MANIFEST};
use catseye::rcs::polarisation::Derived;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// How a result file is drawn.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PlotOptions {
    /// Replaces the title that is made from the file's name.
    pub title: Option<String>,
    /// For RCS tables.
    pub rcs_style: RcsStyle,
    /// Replace an existing picture.
    pub force: bool,
}

const KINDS: &str = "an RCS table (CSV with vv_dbsm), points.csv, returns.csv, range_doppler.npy (float32 [doppler, range]), \
                     adc.npy (complex64 [chirp, channel, sample])";

/// A picture that has been written.
#[derive(Debug, Clone, PartialEq)]
pub struct Plotted {
    /// The picture's file.
    pub path: PathBuf,
    /// Values of the file that are no numbers: the picture has gaps there.
    pub gaps: usize,
}

/// Draws the file at `path` into the picture at `out`: PNG, or SVG or PDF when its name ends so.
///
/// A `range_doppler.npy` takes its axes from the nearest `manifest.json` in its folder or up to three
/// above: `axes.range_m` and `axes.range_rate_mps` (or `axes.RADAR.…`, RADAR being the folder's name),
/// each a list of numbers or `{"first": …, "step": …}`; without them the axes count bins. Detections come
/// from a `points.csv` beside it.
///
/// # Errors
/// `BadInput` for a file that is none of these or holds no number to draw, and when `out` exists without `force`.
pub fn plot_file(path: impl AsRef<Path>, out: impl AsRef<Path>, options: &PlotOptions) -> Result<Plotted> {
    let (picture, gaps) = picture_of_file(path.as_ref(), options)?;
    Ok(Plotted { path: picture.write(out, options.force)?, gaps })
}

/// How many of the values, or of sums of a row's values, are no numbers. Errors: all are. Minus infinity is a power of zero and has its place.
fn gaps(path: &Path, values: impl IntoIterator<Item = f64>) -> Result<usize> {
    let (mut all, mut gaps) = (0, 0);
    for v in values {
        all += 1;
        gaps += usize::from(v.is_nan() || v == f64::INFINITY);
    }
    match all > 0 && gaps == all {
        true => Err(BadInput::new("contains no number that can be drawn")
            .file(path)
            .value(format!("{all} values"))
            .remedy("check how the file was made")
            .into()),
        false => Ok(gaps),
    }
}

/// The picture, and how many values of the file are no numbers.
pub(super) fn picture_of_file(path: &Path, options: &PlotOptions) -> Result<(Picture, usize)> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let title = options.title.clone().unwrap_or_else(|| title_from(path));
    match extension.as_deref() {
        Some("csv") => csv_picture(path, &title, options),
        Some("npy") => npy_picture(path, &title),
        _ => Err(BadInput::new("cannot be plotted").file(path).allowed(KINDS).into()),
    }
}

/// The file's name, with its folder's when that says more (`frame_000000/points.csv`).
fn title_from(path: &Path) -> String {
    let last: Vec<String> =
        path.components().rev().take(2).map(|c| c.as_os_str().to_string_lossy().into_owned()).collect();
    match &last[..] {
        [file, folder] if folder.starts_with("frame_") => format!("{folder}/{file}"),
        [file, ..] => file.clone(),
        [] => String::new(),
    }
}

fn csv_picture(path: &Path, title: &str, options: &PlotOptions) -> Result<(Picture, usize)> {
    let table = Table::read(path)?;
    if table.has("vv_dbsm") {
        let rows = rcs_rows(&table)?;
        let sums = rows.iter().flat_map(|r| {
            let place = 0.0 * (r.frequency_hz + r.azimuth_deg + r.elevation_deg);
            [r.vv_dbsm, r.vh_dbsm, r.hv_dbsm, r.hh_dbsm].map(|v| v + place)
        });
        let gaps = gaps(path, sums)?;
        let picture = rcs_picture(title, &rows, options.rcs_style).map_err(|e| in_file(e, path))?;
        return Ok((picture, gaps));
    }
    let radar = [FieldOfView::default()];
    let has = |names: [&str; 3]| names.iter().all(|n| table.has(n));
    let (points, colour_label) = if has(["x_m", "y_m", "range_rate_mps"]) {
        let [x, y, v] = columns(&table, ["x_m", "y_m", "range_rate_mps"])?;
        (points(&x, &y, &v), None)
    } else if has(["range_m", "azimuth_deg", "power_dbm"]) {
        let (places, power) = (places(&table)?.unwrap_or_default(), table.numbers("power_dbm")?);
        let (x, y): (Vec<f64>, Vec<f64>) = places.into_iter().map(|[x, y]| (x, y)).unzip();
        (points(&x, &y, &power), Some("power (dBm)"))
    } else {
        return Err(BadInput::new("this table cannot be plotted").file(path).allowed(KINDS).into());
    };
    let gaps = gaps(path, points.iter().map(|p| p.x_m + p.y_m + p.value))?;
    let input = BirdsEye { title, points: &points, radars: &radar, colour_label, ..Default::default() };
    Ok((birds_eye(&input)?, gaps))
}

/// The rows of an RCS table.
pub(super) fn rcs_rows(table: &Table) -> Result<Vec<RcsRow>> {
    let [f, az, el] = columns(table, ["frequency_hz", "azimuth_deg", "elevation_deg"])?;
    let [vv, vh, hv, hh] = columns(table, ["vv_dbsm", "vh_dbsm", "hv_dbsm", "hh_dbsm"])?;
    let receive = match table.has("rx_azimuth_deg") {
        true => Some(columns(table, ["rx_azimuth_deg", "rx_elevation_deg"])?),
        false => None,
    };
    let mut derived = [const { None }; 2];
    for (levels, pair) in derived.iter_mut().zip(Derived::ALL) {
        let names = pair.names().map(|n| format!("{n}_dbsm"));
        if names.iter().all(|n| table.has(n)) {
            *levels = Some(columns(table, names.each_ref().map(String::as_str))?);
        }
    }
    let row = |i: usize| RcsRow {
        frequency_hz: f[i],
        azimuth_deg: az[i],
        elevation_deg: el[i],
        vv_dbsm: vv[i],
        vh_dbsm: vh[i],
        hv_dbsm: hv[i],
        hh_dbsm: hh[i],
        derived_dbsm: derived.each_ref().map(|d| d.as_ref().map(|d| d.each_ref().map(|column| column[i]))),
        receive_deg: receive.as_ref().map(|[az, el]| [az[i], el[i]]),
    };
    Ok((0..table.len()).map(row).collect())
}

/// Places of points or echoes seen from above, (x forward, y left) in m; None for a table that holds neither.
pub(super) fn places(table: &Table) -> Result<Option<Vec<[f64; 2]>>> {
    if table.has("x_m") && table.has("y_m") {
        let [x, y] = columns(table, ["x_m", "y_m"])?;
        return Ok(Some(x.into_iter().zip(y).map(|(x, y)| [x, y]).collect()));
    }
    if !table.has("range_m") || !table.has("azimuth_deg") {
        return Ok(None);
    }
    let [r, az] = columns(table, ["range_m", "azimuth_deg"])?;
    let el = if table.has("elevation_deg") { table.numbers("elevation_deg")? } else { vec![0.0; r.len()] };
    let place = |i: usize| {
        let (across, azimuth) = (r[i] * el[i].to_radians().cos(), az[i].to_radians());
        [across * azimuth.cos(), across * azimuth.sin()]
    };
    Ok(Some((0..r.len()).map(place).collect()))
}

/// Columns of numbers, in the order of their names.
fn columns<const N: usize>(table: &Table, names: [&str; N]) -> Result<[Vec<f64>; N]> {
    let mut out = [const { Vec::new() }; N];
    for (column, name) in out.iter_mut().zip(names) {
        *column = table.numbers(name)?;
    }
    Ok(out)
}

fn points(x: &[f64], y: &[f64], value: &[f64]) -> Vec<BirdsEyePoint> {
    (0..x.len()).map(|i| BirdsEyePoint { x_m: x[i], y_m: y[i], value: value[i] }).collect()
}

fn npy_picture(path: &Path, title: &str) -> Result<(Picture, usize)> {
    let header = npy::read_header(path)?;
    match (header.dtype(), &header.shape[..]) {
        ("float32" | "float64", [rows, columns]) if rows * columns > 0 => {
            let map = npy::read_f32(path)?;
            let gaps = gaps(path, map.data.iter().map(|p| dbm_from_w(f64::from(*p))))?;
            let axes = Axes::beside(path)?;
            let range = axes.axis("range_m", *columns, path)?;
            let rate = axes.axis("range_rate_mps", *rows, path)?;
            if let (Some(range_m), Some(range_rate_mps)) = (range, rate) {
                let detections = detections_beside(path)?;
                let (range_m, range_rate_mps) = (&range_m[..], &range_rate_mps[..]);
                let input = RangeDoppler {
                    title,
                    power_w: &map.data,
                    range_m,
                    range_rate_mps,
                    detections: &detections,
                    ..Default::default()
                };
                return Ok((range_doppler(&input)?, gaps));
            }
            let values: Vec<f64> = map.data.iter().map(|p| dbm_from_w(f64::from(*p))).collect();
            let scale = noise_scale(&values);
            Ok((bins(title, ("range bin", "Doppler bin"), (*rows, *columns), values, scale)?, gaps))
        }
        ("complex64" | "complex128" | "float32" | "float64", [chirps, channels, samples])
            if chirps * channels * samples > 0 =>
        {
            let cube = npy::read_complex32(path)?;
            let values: Vec<f64> = (0..*chirps)
                .flat_map(|m| &cube.data[m * channels * samples..][..*samples])
                .map(|z| dbm_from_w(f64::from(z.norm_sqr())))
                .collect();
            let gaps = gaps(path, values.iter().copied())?;
            let title = format!("{title}, channel 0");
            // Samples are loud all over: the scale holds what is under their median.
            let (lo, hi) = decibel_limits(&values, 15.0, 90.0);
            let scale = Scale::new(ColourMap::Viridis, "power (dBm)", lo, hi);
            Ok((bins(&title, ("sample", "chirp"), (*chirps, *samples), values, scale)?, gaps))
        }
        (dtype, shape) => Err(BadInput::new("an array of this kind cannot be plotted")
            .file(path)
            .value(format!("{dtype} {shape:?}"))
            .allowed(KINDS)
            .into()),
    }
}

fn bins(
    title: &str,
    (x, y): (&str, &str),
    (rows, columns): (usize, usize),
    values: Vec<f64>,
    scale: Scale,
) -> Result<Picture> {
    let last = |n: usize| (0.0, (n - 1) as f64);
    let mut chart = heat_map(title, (x, last(columns)), (y, last(rows)), (rows, columns), values, scale);
    (chart.width, chart.height) = (640.0, 440.0);
    chart.draw()
}

/// The axes of the nearest manifest.
struct Axes {
    manifest: Option<(PathBuf, Value)>,
}

impl Axes {
    fn beside(path: &Path) -> Result<Axes> {
        let full = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
        let found = full.ancestors().skip(1).take(4).map(|d| d.join(MANIFEST)).find(|m| m.is_file());
        let manifest = match found {
            None => None,
            Some(file) => {
                let text = input::read(&file, "a manifest", input::LARGEST_TEXT)?;
                let value = serde_json::from_slice(&text).map_err(|e| {
                    BadInput::new(format!("is not JSON: {}", json_in_words(&e))).file(&file).line(e.line())
                })?;
                Some((file, value))
            }
        };
        Ok(Axes { manifest })
    }

    /// None when the manifest has no such axis.
    fn axis(&self, name: &str, count: usize, of: &Path) -> Result<Option<Vec<f64>>> {
        let Some((file, manifest)) = &self.manifest else {
            return Ok(None);
        };
        let radar = of.parent().and_then(Path::file_name).and_then(|n| n.to_str()).unwrap_or("");
        let axes = &manifest["axes"];
        let value = [&axes[radar][name], &axes[name]].into_iter().find(|v| !v.is_null());
        let values = match value {
            None => return Ok(None),
            Some(Value::Array(list)) => list.iter().map(Value::as_f64).collect::<Option<Vec<f64>>>(),
            Some(v) => v["first"].as_f64().zip(v["step"].as_f64()).map(|(first, step)| {
                let n = v["count"].as_u64().map_or(count, |n| n.min(1 << 32) as usize);
                if n == count { (0..n).map(|i| first + step * i as f64).collect() } else { Vec::new() }
            }),
        };
        match values {
            Some(v) if v.len() == count && ends_differ(&v) => Ok(Some(v)),
            _ => Err(BadInput::new("does not fit the array")
                .file(file)
                .key(format!("axes.{name}"))
                .allowed(format!("{count} growing numbers, or {{\"first\": …, \"step\": …}}"))
                .into()),
        }
    }
}

fn ends_differ(v: &[f64]) -> bool {
    let (first, last) = ends(v);
    first.is_finite() && last.is_finite() && (v.len() < 2 || last > first)
}

fn detections_beside(path: &Path) -> Result<Vec<[f64; 2]>> {
    let file = path.with_file_name("points.csv");
    if !file.is_file() {
        return Ok(Vec::new());
    }
    let table = Table::read(&file)?;
    let (r, v) = (table.numbers("range_m")?, table.numbers("range_rate_mps")?);
    Ok(r.into_iter().zip(v).map(|(r, v)| [r, v]).collect())
}

/// Adds the file's name to an error that came from a room which does not know it.
pub(super) fn in_file(e: catseye::base::error::Error, path: &Path) -> catseye::base::error::Error {
    match e {
        catseye::base::error::Error::Input(b) if b.file.is_none() => b.file(path).into(),
        e => e,
    }
}
