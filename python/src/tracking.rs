//! Clusters of points, plots of clusters, and tracks.

use crate::arrays::{Records, array, floats};
use crate::errors::{OrRaise, refuse};
use catseye::base::error::BadInput;
use catseye::detect::cluster::{ClusterPoint, Dbscan};
use catseye::detect::kalman::Station;
use catseye::detect::plot::{Plot, plots_of_clusters};
use catseye::detect::track_table::{TRACKS, TrackRow};
use catseye::detect::tracker::{Coverage, Scan, Tracker as Follower, TrackerSettings};
use glam::DVec2;
use pyo3::prelude::*;
use std::sync::Mutex;

/// A column of a structured array or a dictionary. Errors: it is missing, or not as long as the others.
fn column(table: &Bound<'_, PyAny>, key: &str, name: &str, rows: &mut Option<usize>) -> PyResult<Vec<f64>> {
    let py = table.py();
    let Ok(ob) = table.get_item(name) else {
        let b = BadInput::new("the column is missing").key(format!("{key}.{name}"));
        return refuse(py, b.remedy("give a structured array or a dictionary of columns"));
    };
    let list = floats(&ob)?;
    if *rows.get_or_insert(list.len()) != list.len() {
        let b = BadInput::new("columns differ in length").key(format!("{key}.{name}")).value(list.len());
        return refuse(py, b);
    }
    Ok(list)
}

/// Clusters points; returns the cluster of each point, -1 for none, int64 [point].
#[pyfunction]
pub fn dsp_cluster(
    py: Python<'_>,
    points: &Bound<'_, PyAny>,
    position_m: f64,
    range_rate_mps: f64,
    min_points: usize,
) -> PyResult<Py<PyAny>> {
    let mut rows = None;
    let names = ["x_m", "y_m", "range_rate_mps"];
    let [x, y, rate] = names.map(|name| column(points, "points", name, &mut rows));
    let (x, y, rate) = (x?, y?, rate?);
    let place = |i: usize| ClusterPoint { x_m: x[i], y_m: y[i], range_rate_mps: rate[i] };
    let places: Vec<ClusterPoint> = (0..x.len()).map(place).collect();
    let labels =
        py.detach(|| Dbscan { position_m, range_rate_mps, min_points }.labels(&places)).or_raise(py)?;
    let count = labels.len();
    array::<i64>(py, labels.into_iter().map(|l| l.map_or(-1, |c| c as i64)).collect(), &[count])
}

const PLOT: [&str; 6] =
    ["range_m", "range_rate_mps", "azimuth_deg", "range_std_m", "range_rate_std_mps", "azimuth_std_deg"];

/// Returns plots, a structured array [plot]: range_m, range_rate_mps, azimuth_deg and their standard deviations, and the number of points.
#[pyfunction]
#[pyo3(signature = (points, labels = None))]
pub fn dsp_plots(py: Python<'_>, points: &Bound<'_, PyAny>, labels: Option<Vec<i64>>) -> PyResult<Py<PyAny>> {
    let mut rows = None;
    let mut columns = Vec::new();
    for name in PLOT.into_iter().chain(["elevation_deg"]) {
        columns.push(column(points, "points", name, &mut rows)?);
    }
    let count = rows.unwrap_or(0);
    let labels = match labels {
        Some(l) if l.len() != count => {
            let b = BadInput::new("labels must have one cluster for each point").key("labels").value(l.len());
            return refuse(py, b.allowed(count.to_string()));
        }
        Some(l) => l.into_iter().map(|c| usize::try_from(c).ok()).collect(),
        // Each point by itself.
        None => (0..count).map(Some).collect::<Vec<_>>(),
    };
    let mut plots = Vec::new();
    let mut own = Vec::new();
    for i in 0..count {
        let at = |k: usize| columns[k][i];
        // An elevation that the array cannot measure is set to that of the boresight.
        let elevation = if at(6).is_finite() { at(6).to_radians() } else { 0.0 };
        let place = [at(0), at(1), at(2).to_radians(), elevation];
        let plot = Plot::of_point(place, [at(3), at(4), at(5).to_radians()]);
        if labels[i].is_some() {
            plot.check(i).or_raise(py)?;
        }
        plots.push(plot);
        own.push(labels[i]);
    }
    // Numbers without members are no clusters.
    let mut known: Vec<usize> = own.iter().flatten().copied().collect();
    known.sort_unstable();
    known.dedup();
    let dense: Vec<Option<usize>> =
        own.iter().map(|l| l.and_then(|c| known.binary_search(&c).ok())).collect();
    let made = plots_of_clusters(&plots, &dense);
    let of = |f: fn(&Plot) -> f64| made.iter().map(f).collect::<Vec<f64>>();
    let table = Records::new(made.len())
        .numbers(py, PLOT[0], of(|p| p.range_m), "f8")
        .numbers(py, PLOT[1], of(|p| p.range_rate_mps), "f8")
        .numbers(py, PLOT[2], of(|p| p.azimuth_rad.to_degrees()), "f8")
        .numbers(py, PLOT[3], of(|p| p.range_std_m), "f8")
        .numbers(py, PLOT[4], of(|p| p.range_rate_std_mps), "f8")
        .numbers(py, PLOT[5], of(|p| p.azimuth_std_rad.to_degrees()), "f8")
        .numbers(py, "points", made.iter().map(|p| p.points as i64).collect(), "i8");
    Ok(table.build(py)?.unbind())
}

/// A tracker of many bodies that move with constant velocity in the plane of the road.
///
/// acceleration_psd: spectral density of the white acceleration, m²/s³. across_std_mps: standard deviation of the speed across the line of sight when
/// a body is first detected. gate_probability: probability that the correct plot is within the gate of its track. confirm_hits, confirm_scans:
/// confirm_hits plots in confirm_scans scans confirm a track. max_misses, max_coast_s: max_misses scans in a row without a plot, or max_coast_s
/// seconds without one, end a track.
///
/// Raises BadInput for a setting outside its range.
#[pyclass(module = "catseye._catseye", frozen)]
pub struct Tracker {
    inner: Mutex<Follower>,
}

#[pymethods]
impl Tracker {
    #[new]
    #[pyo3(signature = (*, acceleration_psd = 1.0, across_std_mps = 8.0, gate_probability = 0.99, confirm_hits = 3, confirm_scans = 5,
        max_misses = 5, max_coast_s = 1.0))]
    #[allow(clippy::too_many_arguments)] // keywords
    fn new(
        py: Python<'_>,
        acceleration_psd: f64,
        across_std_mps: f64,
        gate_probability: f64,
        confirm_hits: u32,
        confirm_scans: u32,
        max_misses: u32,
        max_coast_s: f64,
    ) -> PyResult<Tracker> {
        let settings = TrackerSettings {
            acceleration_psd,
            across_std_mps,
            gate_probability,
            confirm_hits,
            confirm_scans,
            max_misses,
            max_coast_s,
        };
        Ok(Tracker { inner: Mutex::new(Follower::new(settings).or_raise(py)?) })
    }

    /// Updates the tracks with the plots of one scan, and returns them as a structured array with the columns of tracks.csv.
    ///
    /// time_s: time of the scan, not before that of the previous one. plots: structured array or dictionary of columns as dsp.plots returns.
    /// position_m, heading_deg, velocity_mps: of the sensor in the plane of the tracks. max_range_m, max_azimuth_deg: field of view of the sensor,
    /// both or neither. tentative: return unconfirmed tracks too.
    #[pyo3(signature = (time_s, plots, *, position_m = [0.0, 0.0], heading_deg = 0.0, velocity_mps = [0.0, 0.0], max_range_m = None,
        max_azimuth_deg = None, tentative = false, frame = 0))]
    #[allow(clippy::too_many_arguments)] // keywords
    fn step(
        &self,
        py: Python<'_>,
        time_s: f64,
        plots: &Bound<'_, PyAny>,
        position_m: [f64; 2],
        heading_deg: f64,
        velocity_mps: [f64; 2],
        max_range_m: Option<f64>,
        max_azimuth_deg: Option<f64>,
        tentative: bool,
        frame: u32,
    ) -> PyResult<Py<PyAny>> {
        let place = [position_m[0], position_m[1], heading_deg, velocity_mps[0], velocity_mps[1]];
        if place.iter().any(|v| !v.is_finite()) {
            let b = BadInput::new("the position or motion of the sensor is not finite");
            return refuse(py, b.key("position_m, heading_deg, velocity_mps"));
        }
        let coverage = match (max_range_m, max_azimuth_deg) {
            (Some(range), Some(azimuth)) => {
                Some(Coverage { max_range_m: range, azimuth_rad: azimuth.to_radians() })
            }
            (None, None) => None,
            _ => {
                let b = BadInput::new("max_range_m and max_azimuth_deg must be given together");
                return refuse(py, b.key("max_range_m, max_azimuth_deg").remedy("give both or neither"));
            }
        };
        let mut rows = None;
        let mut columns = Vec::new();
        for name in PLOT.into_iter().chain(["points"]) {
            columns.push(column(plots, "plots", name, &mut rows)?);
        }
        let plot = |i: usize| Plot {
            range_m: columns[0][i],
            range_rate_mps: columns[1][i],
            azimuth_rad: columns[2][i].to_radians(),
            range_std_m: columns[3][i],
            range_rate_std_mps: columns[4][i],
            azimuth_std_rad: columns[5][i].to_radians(),
            points: columns[6][i].max(0.0) as usize,
        };
        let list: Vec<Plot> = (0..rows.unwrap_or(0)).map(plot).collect();
        let station = Station {
            position_m: DVec2::from_array(position_m),
            heading_rad: heading_deg.to_radians(),
            velocity_mps: DVec2::from_array(velocity_mps),
            velocity_std_mps: 0.0,
        };
        let Ok(mut inner) = self.inner.lock() else {
            return refuse(py, BadInput::new("the tracker failed in an earlier call; make a new one"));
        };
        inner.step(&Scan { time_s, station, coverage, plots: &list }).or_raise(py)?;
        let all = TrackRow::of_frame(frame, time_s, &inner, tentative);
        let table = Records::new(all.len()).columns(py, &TRACKS, &all)?;
        Ok(table.build(py)?.unbind())
    }

    fn __repr__(&self) -> String {
        let count = self.inner.lock().map_or(0, |t| t.tracks().len());
        format!("<catseye.dsp.Tracker: {count} tracks>")
    }
}
