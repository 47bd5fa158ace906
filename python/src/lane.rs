//! Lanes: methods on scenarios, and estimators for anybody's points.

use crate::arrays::{plain, vector};
use crate::errors::{OrRaise, refuse};
use crate::work::{Afterwards, run_to};
use crate::{arrays, engine};
use catseye::base::error::BadInput;
use catseye::base::frames::{Pose, Sensor, Vehicle};
use catseye_lane::{LaneEstimator as Estimator, LanePoint, LaneTrack, Measured, Registry, SensorInput};
use catseye_papers::trial::{self, Method, RunOptions};
use glam::DVec3;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;
use std::sync::Mutex;

/// Spacing of the points of a line, m.
const LINE_STEP_M: f64 = 1.0;

/// Estimates lanes with one method on the drive of a scenario, as `catseye lane METHOD SCENARIO -o OUT` does: writes estimates, scores, report and
/// plots to the folder `out`.
///
/// method: one of lane_methods(). scenario: path of a scenario TOML, whose table [lane] holds the method's settings. runs: number of drives, each
/// with another seed. frames: number of frames of a drive. trace: "host" or "device", where beams are traced, as for Engine. progress: called with
/// the number of frames done and the total.
///
/// Returns a dictionary: folder, method, title, rows (each quantity, unit, document, ours, half, why), notes. Raises BadInput for a scenario that the
/// method does not support. The same call resumes after an interruption.
#[pyfunction]
#[pyo3(signature = (method, scenario, out, *, runs = None, frames = None, seed = None, engine = None, trace = None, force = false, progress = None))]
#[allow(clippy::too_many_arguments)] // keywords
pub fn lane(
    py: Python<'_>,
    method: &str,
    scenario: PathBuf,
    out: PathBuf,
    runs: Option<u32>,
    frames: Option<u32>,
    seed: Option<u64>,
    engine: Option<&Bound<'_, PyAny>>,
    trace: Option<&str>,
    force: bool,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Py<PyAny>> {
    let method = Method::named(method).or_raise(py)?;
    let engine = engine::resolve_for_frames(py, engine, trace)?;
    let report = run_to(py, progress, Afterwards::LeftAlone, move |watch| {
        let options = RunOptions {
            force,
            runs,
            frames,
            seed,
            watch: &|done, all| {
                watch.expect(all);
                watch.set(done);
                watch.step(0);
            },
        };
        trial::run(&engine, method, &scenario, &out, &options)
    })?;
    plain(py, &report)
}

/// Compares all methods on the same drives, as `catseye lane compare SCENARIO... -o OUT` does. Arguments and result are those of `lane`.
#[pyfunction]
#[pyo3(signature = (scenarios, out, *, runs = None, frames = None, seed = None, engine = None, trace = None, force = false, progress = None))]
#[allow(clippy::too_many_arguments)] // keywords
pub fn lane_compare(
    py: Python<'_>,
    scenarios: Vec<PathBuf>,
    out: PathBuf,
    runs: Option<u32>,
    frames: Option<u32>,
    seed: Option<u64>,
    engine: Option<&Bound<'_, PyAny>>,
    trace: Option<&str>,
    force: bool,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Py<PyAny>> {
    let engine = engine::resolve_for_frames(py, engine, trace)?;
    let report = run_to(py, progress, Afterwards::LeftAlone, move |watch| {
        let options = RunOptions {
            force,
            runs,
            frames,
            seed,
            watch: &|done, all| {
                watch.expect(all);
                watch.set(done);
                watch.step(0);
            },
        };
        trial::compare::compare(&engine, &scenarios, &out, &options)
    })?;
    plain(py, &report)
}

/// Returns the names of the lane methods that this package contains.
#[pyfunction]
pub fn lane_methods() -> Vec<String> {
    Registry::of_methods().names().map(String::from).collect()
}

/// An estimator of lanes for points, tracks, pulses or images from any source, given frame by frame.
///
/// method: one of lane_methods(). options: a dictionary of the method's options (docs/lanes.md); the defaults are those of the publication.
#[pyclass(module = "catseye._catseye", frozen)]
pub struct LaneEstimator {
    method: &'static str,
    inner: Mutex<Box<dyn Estimator + Send>>,
}

#[pymethods]
impl LaneEstimator {
    #[new]
    #[pyo3(signature = (method, options = None))]
    fn new(py: Python<'_>, method: &str, options: Option<&Bound<'_, PyAny>>) -> PyResult<LaneEstimator> {
        let text: Option<String> =
            options.map(|o| py.import("json")?.call_method1("dumps", (o,))?.extract()).transpose()?;
        let inner = Registry::of_methods().make(method, text.as_deref()).or_raise(py)?;
        Ok(LaneEstimator { method: inner.method(), inner: Mutex::new(inner) })
    }

    #[getter]
    fn method(&self) -> &'static str {
        self.method
    }

    /// Estimates the lane after the data of one frame.
    ///
    /// points: a structured array or a dictionary of columns, as Frame.points: range_m, azimuth_deg (positive left) and range_rate_mps (positive
    /// receding) in the radar's frame, and, where known, elevation_deg, range_std_m, range_rate_std_mps, azimuth_std_deg, rcs_dbsm, snr_db,
    /// power_dbm. mounting: (x, y, z) of the radar on the vehicle, m; yaw_deg: its yaw. speed_mps, speed_std_mps, yaw_rate_dps: of the vehicle.
    /// tracks: columns id, x_m, y_m, vx_mps, vy_mps (vehicle's frame, over the ground) and, where known, x_std_m, y_std_m. pulse: samples of an
    /// impulse radar's scan. image: grey image [height, width], 0 to 1. place: (latitude_deg, longitude_deg, height_m, azimuth_deg) of the radar on
    /// the earth, azimuth clockwise from north.
    ///
    /// Returns a dictionary: lines (each with points_m [n][2] in the vehicle's frame, confidence, fitted), lane_number, width_m, offset_m,
    /// heading_rad, curvature_per_m (each {value, std} or None), confidence, no_lane (None, or the reason why there is no lane), provenance.
    #[pyo3(signature = (time_s, *, points = None, mounting = None, yaw_deg = 0.0, speed_mps = None, speed_std_mps = 0.1, yaw_rate_dps = None,
        tracks = None, pulse = None, image = None, place = None))]
    #[allow(clippy::too_many_arguments)] // keywords
    fn estimate(
        &self,
        py: Python<'_>,
        time_s: f64,
        points: Option<&Bound<'_, PyAny>>,
        mounting: Option<&Bound<'_, PyAny>>,
        yaw_deg: f64,
        speed_mps: Option<f64>,
        speed_std_mps: f64,
        yaw_rate_dps: Option<f64>,
        tracks: Option<&Bound<'_, PyAny>>,
        pulse: Option<&Bound<'_, PyAny>>,
        image: Option<&Bound<'_, PyAny>>,
        place: Option<[f64; 4]>,
    ) -> PyResult<Py<PyAny>> {
        let mount: Pose<Sensor, Vehicle> =
            Pose::from_yaw_pitch_roll(vector("mounting", mounting)?, yaw_deg.to_radians(), 0.0, 0.0);
        let points = points.map(|p| lane_points(p, &mount)).transpose()?.unwrap_or_default();
        let tracks = tracks.map(lane_tracks).transpose()?.unwrap_or_default();
        let pulse = pulse.map(|p| arrays::floats(p)).transpose()?;
        let image = image.map(|i| picture(i)).transpose()?;
        let look = SensorInput {
            time_s,
            speed_mps: speed_mps.map(|value| Measured { value, std: speed_std_mps }),
            yaw_rate_rad_per_s: yaw_rate_dps
                .map(|v| Measured { value: v.to_radians(), std: 0.5f64.to_radians() }),
            points: &points,
            tracks: &tracks,
            pulse: pulse.as_deref(),
            scans: &[],
            image: image.as_ref(),
            place: place.map(|[lat, lon, height, azimuth]| catseye_lane::hd_map::RadarPose {
                position: catseye_lane::hd_map::Wgs84::new(lat, lon, height),
                azimuth_rad: azimuth.to_radians(),
            }),
        };
        let estimate = match self.inner.lock() {
            Ok(mut inner) => inner.estimate(&look),
            Err(_) => {
                return refuse(py, BadInput::new("the estimator failed in an earlier call; make a new one"));
            }
        };
        let out = plain(py, &estimate)?;
        let out = out.bind(py).cast::<PyDict>()?;
        if let Some(lines) = out.get_item("lines")? {
            for (i, line) in estimate.lines.iter().enumerate() {
                let at: Vec<[f64; 2]> =
                    line.fitted.curve.sample(LINE_STEP_M).iter().map(|p| p.to_array()).collect();
                lines.get_item(i)?.set_item("points_m", at)?;
            }
        }
        if let Some(why) = &estimate.no_lane {
            out.set_item("no_lane", why.to_string())?;
        }
        Ok(out.clone().into_any().unbind())
    }

    fn __repr__(&self) -> String {
        format!("<catseye.LaneEstimator {}>", self.method)
    }
}

/// A column of a structured array, a data frame or a dictionary.
fn column(table: &Bound<'_, PyAny>, name: &str) -> PyResult<Option<Vec<f64>>> {
    match table.get_item(name) {
        Ok(c) => arrays::floats(&c).map(Some),
        Err(_) => Ok(None),
    }
}

/// Columns of one length, with the value that replaces a missing column; None: the column is required.
fn columns<const N: usize>(
    key: &str,
    table: &Bound<'_, PyAny>,
    names: [(&str, Option<f64>); N],
) -> PyResult<[Vec<f64>; N]> {
    let py = table.py();
    let mut out: [Vec<f64>; N] = std::array::from_fn(|_| Vec::new());
    let mut rows = None;
    for (k, (name, missing)) in names.iter().enumerate() {
        match (column(table, name)?, missing) {
            (Some(c), _) => {
                if *rows.get_or_insert(c.len()) != c.len() {
                    let b = BadInput::new("columns differ in length").key(format!("{key}.{name}"));
                    return refuse(py, b.value(c.len()));
                }
                out[k] = c;
            }
            (None, Some(_)) => {}
            (None, None) => {
                let b = BadInput::new("the column is missing").key(format!("{key}.{name}"));
                return refuse(py, b.remedy("give a structured array or a dictionary of columns"));
            }
        }
    }
    for (c, (_, missing)) in out.iter_mut().zip(names) {
        if let (true, Some(value)) = (c.is_empty(), missing) {
            *c = vec![value; rows.unwrap_or(0)];
        }
    }
    Ok(out)
}

fn lane_points(table: &Bound<'_, PyAny>, mount: &Pose<Sensor, Vehicle>) -> PyResult<Vec<LanePoint>> {
    let [range, azimuth, rate, elevation, range_std, rate_std, azimuth_std, rcs, snr, power] = columns(
        "points",
        table,
        [
            ("range_m", None),
            ("azimuth_deg", None),
            ("range_rate_mps", None),
            ("elevation_deg", Some(0.0)),
            ("range_std_m", Some(0.1)),
            ("range_rate_std_mps", Some(0.1)),
            ("azimuth_std_deg", Some(1.0)),
            ("rcs_dbsm", Some(0.0)),
            ("snr_db", Some(20.0)),
            ("power_dbm", Some(f64::NAN)),
        ],
    )?;
    Ok((0..range.len())
        .map(|i| {
            let (a, e) = (azimuth[i].to_radians(), elevation[i].to_radians());
            let from = DVec3::new(e.cos() * a.cos(), e.cos() * a.sin(), e.sin()) * range[i];
            let at = mount.point(from);
            let level = at - mount.translation_m;
            LanePoint {
                at_m: [at.x, at.y],
                std_m: [range_std[i], level.truncate().length() * azimuth_std[i].to_radians()],
                range_rate_mps: rate[i],
                range_rate_std_mps: rate_std[i],
                range_m: range[i],
                azimuth_rad: level.y.atan2(level.x),
                rcs_dbsm: rcs[i],
                snr_db: snr[i],
                power_dbm: Some(power[i]).filter(|p| p.is_finite()),
            }
        })
        .collect())
}

fn lane_tracks(table: &Bound<'_, PyAny>) -> PyResult<Vec<LaneTrack>> {
    let [id, x, y, vx, vy, x_std, y_std] = columns(
        "tracks",
        table,
        [
            ("id", None),
            ("x_m", None),
            ("y_m", None),
            ("vx_mps", None),
            ("vy_mps", None),
            ("x_std_m", Some(0.3)),
            ("y_std_m", Some(0.3)),
        ],
    )?;
    Ok((0..id.len())
        .map(|i| LaneTrack {
            id: id[i].max(0.0) as u64,
            at_m: [x[i], y[i]],
            std_m: [x_std[i], y_std[i]],
            velocity_mps: [vx[i], vy[i]],
        })
        .collect())
}

fn picture(array: &Bound<'_, PyAny>) -> PyResult<catseye_lane::camera_fusion::Image> {
    let py = array.py();
    let shape: Vec<usize> = py.import("numpy")?.call_method1("shape", (array,))?.extract()?;
    let [height, width] = shape[..] else {
        let b = BadInput::new("is not a grey image").key("image").value(format!("{shape:?}"));
        return refuse(py, b.allowed("two axes: height, width"));
    };
    let flat = arrays::floats(&array.call_method1("reshape", (-1,))?)?;
    catseye_lane::camera_fusion::Image::new(width, height, flat.iter().map(|v| *v as f32).collect())
        .or_else(|e| refuse(py, BadInput::new(e.to_string()).key("image")))
}
