//! The marker method behind the interface of all lane estimators: markers of one look, followed over looks.

use super::{METHOD, MarkerPattern, Scan, Steps, estimate_all};
use crate::track::{EgoStep, LineTracker, TrackOptions};
use crate::{LaneEstimate, LaneEstimator, LanePoint, Measured, SensorInput};
use catseye::base::error::{BadInput, Result};
use std::f64::consts::{PI, TAU};

/// Radar cross section of a marker (dBsm) over the direction from which it is seen: azimuth from its
/// boresight and elevation, rad.
#[derive(Debug, Clone, PartialEq)]
pub struct MarkerRcs {
    azimuth_rad: Vec<f64>,
    elevation_rad: Vec<f64>,
    /// Levels in dBsm, `[elevation, azimuth]`.
    dbsm: Vec<f64>,
}

/// Largest depth below the strongest level to which levels are kept, dB.
const DEEPEST_DB: f64 = 60.0;

impl MarkerRcs {
    /// Makes the table. Azimuths and elevations rise and hold one value or more each; `dbsm` holds the
    /// azimuths of the first elevation, then those of the next. Levels of minus infinity (no echo) are
    /// allowed.
    ///
    /// # Errors
    /// Returns an error if an axis is empty, non-finite or does not rise, if the number of levels does not
    /// match the axes, or if a level is NaN or no level is finite.
    pub fn new(azimuth_rad: Vec<f64>, elevation_rad: Vec<f64>, dbsm: Vec<f64>) -> Result<MarkerRcs> {
        let bad = |what: &str| Err(BadInput::new(what).key("the marker's cross section").into());
        let rising =
            |v: &[f64]| !v.is_empty() && v.iter().all(|x| x.is_finite()) && v.windows(2).all(|w| w[0] < w[1]);
        if !rising(&azimuth_rad) || !rising(&elevation_rad) {
            return bad("the angles do not ascend");
        }
        if dbsm.len() != azimuth_rad.len() * elevation_rad.len() {
            return bad("the table needs one cross section for each azimuth and elevation");
        }
        let top = dbsm.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        if dbsm.iter().any(|d| d.is_nan()) || !top.is_finite() {
            return bad("a cross section is NaN, or none is finite");
        }
        let dbsm = dbsm.into_iter().map(|d| d.max(top - DEEPEST_DB)).collect();
        Ok(MarkerRcs { azimuth_rad, elevation_rad, dbsm })
    }

    /// Cross section in a direction, dBsm: interpolated inside the table, and constant beyond its edges.
    pub fn dbsm(&self, azimuth_rad: f64, elevation_rad: f64) -> f64 {
        let azimuth = (azimuth_rad + PI).rem_euclid(TAU) - PI;
        let ((i, t), (j, u)) =
            (between(&self.azimuth_rad, azimuth), between(&self.elevation_rad, elevation_rad));
        let n = self.azimuth_rad.len();
        let at = |j: usize, i: usize| self.dbsm[j.min(self.elevation_rad.len() - 1) * n + i.min(n - 1)];
        let along = |j: usize| at(j, i) * (1.0 - t) + at(j, i + 1) * t;
        along(j) * (1.0 - u) + along(j + 1) * u
    }
}

fn between(axis: &[f64], x: f64) -> (usize, f64) {
    let i = axis.partition_point(|a| *a <= x).clamp(1, axis.len().max(2) - 1) - 1;
    match axis.get(i + 1) {
        None => (i, 0.0),
        Some(next) => (i, ((x - axis[i]) / (next - axis[i])).clamp(0.0, 1.0)),
    }
}

/// What [`Markers`] looks for, as [`super::MarkersOptions`] makes it of a radar and a road.
#[derive(Debug, Clone, PartialEq)]
pub struct MarkerSearch {
    /// Patterns of markers, one for each spacing that is sought; the first gives all settings other than the
    /// spacing.
    pub patterns: Vec<MarkerPattern>,
    /// Options of the tracker; None to treat each look by itself.
    pub track: Option<TrackOptions>,
    /// Distance of the radar ahead of the axle that does not slip sideways, m: it gives the yaw rate where
    /// the bus does not.
    pub radar_ahead_m: f64,
    /// Cross section of a marker. If given, the levels along a row have to agree with the marker's pose.
    pub rcs: Option<MarkerRcs>,
}

impl Default for MarkerSearch {
    fn default() -> Self {
        MarkerSearch {
            patterns: vec![MarkerPattern::default()],
            track: Some(TrackOptions::default()),
            radar_ahead_m: 3.6,
            rcs: None,
        }
    }
}

/// Estimates lanes from rows of markers.
#[derive(Debug, Clone)]
pub struct Markers {
    search: MarkerSearch,
    tracker: Option<LineTracker>,
    /// Intermediate results of the last look.
    pub steps: Steps,
    /// Estimate of the last look without tracking.
    pub by_itself: Option<LaneEstimate>,
    /// Motion at the last look.
    last: Option<EgoStep>,
}

impl Markers {
    /// Makes an estimator that has seen nothing yet.
    pub fn new(search: MarkerSearch) -> Markers {
        Markers {
            tracker: search.track.map(LineTracker::new),
            search,
            steps: Steps::default(),
            by_itself: None,
            last: None,
        }
    }

    /// What the estimator looks for.
    pub fn search(&self) -> &MarkerSearch {
        &self.search
    }

    /// Level that is expected of a marker at a point of a row with that direction, dBsm. Markers face back
    /// along their row. None without a cross section or pattern.
    pub fn expected_dbsm(&self, p: &LanePoint, row_rad: f64) -> Option<f64> {
        let height = self.search.patterns.first()?.radar_height_m;
        let elevation = (height / p.range_m.max(height).max(1e-3)).min(1.0).asin();
        Some(self.search.rcs.as_ref()?.dbsm(p.azimuth_rad - row_rad, elevation))
    }

    /// The vehicle's motion: from the bus, and from points at rest where the bus is silent.
    fn ego(&self, input: &SensorInput<'_>) -> Option<EgoStep> {
        let motion = self.steps.motion?;
        let [x, y] = motion.velocity_mps;
        let std = |k: usize| motion.covariance[k][k].max(0.0).sqrt();
        let by_points = || {
            let ahead = self.search.radar_ahead_m;
            (ahead.abs() > 0.5).then(|| Measured { value: y / ahead, std: std(1) / ahead.abs() })
        };
        let unknown = Measured { value: 0.0, std: 0.2 };
        Some(EgoStep {
            speed_mps: Measured { value: x, std: std(0) },
            yaw_rate_rad_per_s: input.yaw_rate_rad_per_s.or_else(by_points).unwrap_or(unknown),
        })
    }
}

/// Motion between two looks from the motions at both: when it changed in between is not known.
fn between_looks(before: &EgoStep, now: &EgoStep) -> EgoStep {
    let mean = |a: Measured, b: Measured| {
        let std = 0.5 * a.std.hypot(b.std);
        Measured { value: 0.5 * (a.value + b.value), std: std.hypot((b.value - a.value) / 12f64.sqrt()) }
    };
    EgoStep {
        speed_mps: mean(before.speed_mps, now.speed_mps),
        yaw_rate_rad_per_s: mean(before.yaw_rate_rad_per_s, now.yaw_rate_rad_per_s),
    }
}

impl LaneEstimator for Markers {
    fn method(&self) -> &'static str {
        METHOD
    }

    fn estimate(&mut self, input: &SensorInput<'_>) -> LaneEstimate {
        let expected = |p: &LanePoint, row_rad: f64| self.expected_dbsm(p, row_rad).unwrap_or(0.0);
        let scan = Scan {
            time_s: input.time_s,
            points: input.points,
            speed_mps: input.speed_mps,
            expected_rcs_dbsm: if self.search.rcs.is_some() { Some(&expected) } else { None },
        };
        let (estimate, steps) = estimate_all(&scan, &self.search.patterns);
        self.steps = steps;
        self.by_itself = Some(estimate.clone());
        let now = self.ego(input);
        let ego = now.map(|n| self.last.map_or(n, |l| between_looks(&l, &n)));
        self.last = now;
        match &mut self.tracker {
            None => estimate,
            Some(tracker) => tracker.update(estimate, input.points, ego),
        }
    }
}
