//! Options of the method road-shape: the table `[lane.road_shape]` of a scenario, and the same keys in JSON
//! and in Python.

use super::estimator::{METHOD, RoadShapeEstimator, RoadShapeSetup};
use super::fit::Curve;
use super::image::{Angles, ImageSettings};
use super::tracker::TrackerSettings;
use crate::LaneEstimator;
use crate::limits::{self, LEAVE_OUT};
use catseye::base::error::{BadInput, Result};
use catseye::scene::radar::Radar;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Source of the points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Source {
    /// The image if the radar has two chirp types, otherwise the detector.
    Auto,
    /// An angular spectrum for each beat frequency, as in Miyake.
    Image,
    /// The radar's own detector and angle estimation.
    Points,
}

/// Task of the evaluation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Task {
    /// Edges of the road over a drive (Miyake, Figs. 3 to 7).
    Edges,
    /// Two corner reflectors at one range, by several angle estimation methods (Miyake, Figs. 1 and 2, Table
    /// I).
    Corners,
}

/// The table `[lane.road_shape]` of a scenario.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Settings")]
pub struct RoadShapeOptions {
    /// Task of the evaluation. Default edges.
    pub task: Task,
    /// Source of the points. Default auto.
    pub source: Source,
    /// Angle estimation method for a row of the image: bi-svd, music, esprit, bartlett. Default bi-svd.
    pub angles: Angles,
    /// Maximum number of sources in a row of the image. Default 2, as in Miyake.
    #[schemars(range(min = 1, max = 16))]
    pub sources: usize,
    /// Forgetting factor alpha of the subspace tracker, for each snapshot. Default 0.9.
    #[schemars(range(min = 1e-3, max = 0.9999))]
    pub forgetting: f64,
    /// Number of elements of the subarrays for spatial smoothing, which two coherent echoes need; 0: the
    /// whole array. Default 0.
    #[schemars(range(max = 1024))]
    pub subarray: usize,
    /// Minimum mean power of a row above the noise, dB. Default 3.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub row_db: f64,
    /// Minimum power of a source above the noise after all channels and chirps, dB. Default 13.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub source_db: f64,
    /// Maximum range of points, m. Default 100.
    #[schemars(range(min = 5.0, max = 1000.0))]
    pub max_range_m: f64,
    /// Standard deviation of the speed on the vehicle bus, m/s. Default 0.1.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub speed_std_mps: f64,
    /// Standard deviation of the yaw rate on the vehicle bus, deg/s. Default 0.2.
    #[schemars(range(min = 0.0, max = 90.0))]
    pub yaw_rate_std_deg_per_s: f64,
    /// Half width of the range-rate gate of stationary points, in standard deviations. Default 3.
    #[schemars(range(min = 0.1, max = 20.0))]
    pub gate_sigmas: f64,
    /// Error of a range rate in addition to its standard deviation, m/s. Default 0.2.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub gate_floor_mps: f64,
    /// Curve of the refinement after the vote: arc, or parabola as in Miyake. Default arc.
    pub curve: Curve,
    /// Standard deviation of the vehicle's heading relative to the road, degrees; 0: the road begins straight
    /// ahead, as in Miyake. Default 0.
    #[schemars(range(min = 0.0, max = 20.0))]
    pub heading_std_deg: f64,
    /// true: both edges have the same curvature. Default false.
    pub parallel: bool,
    /// Process noise of the curvature rate (random walk), 1/m² per √m. Default 6e-6.
    #[schemars(range(min = 0.0, max = 1e-2))]
    pub c1_walk: f64,
    /// Process noise of an edge's distance (random walk), m per √m. Default 0.05.
    #[schemars(range(min = 0.0, max = 5.0))]
    pub b_walk: f64,
    /// Number of scans with an edge before it is reported. Default 3.
    #[schemars(range(min = 1, max = 100))]
    pub confirm_scans: usize,
    /// Minimum distance from the vehicle at which edges are scored, m. Default 10.
    #[schemars(range(min = 0.0, max = 500.0))]
    pub from_m: f64,
    /// Maximum distance from the vehicle at which edges are scored, m. Default 60.
    pub to_m: f64,
    /// Frame that the plots show. Default the middle one.
    pub picture_frame: Option<u32>,
    /// Largest curvature that the publication states for this drive, 1/m, printed beside the result.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub document_curvature_per_m: Option<f64>,
    /// "corners": standard deviation of the reflectors' positions along the line of sight, m, drawn anew in
    /// each run. Default 0.002, half a wavelength, so that their phases are arbitrary.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub placement_std_m: f64,
}

impl Default for RoadShapeOptions {
    fn default() -> Self {
        RoadShapeOptions {
            task: Task::Edges,
            source: Source::Auto,
            angles: Angles::BiSvd,
            sources: 2,
            forgetting: 0.9,
            subarray: 0,
            row_db: 3.0,
            source_db: 13.0,
            max_range_m: 100.0,
            speed_std_mps: 0.1,
            yaw_rate_std_deg_per_s: 0.2,
            gate_sigmas: 3.0,
            gate_floor_mps: 0.2,
            curve: Curve::Arc,
            heading_std_deg: 0.0,
            parallel: false,
            c1_walk: 6e-6,
            b_walk: 0.05,
            confirm_scans: 3,
            from_m: 10.0,
            to_m: 60.0,
            picture_frame: None,
            document_curvature_per_m: None,
            placement_std_m: 0.002,
        }
    }
}

impl RoadShapeOptions {
    /// Checks the options.
    ///
    /// # Errors
    /// Returns an error for the first value outside its range.
    pub fn check(&self) -> Result<()> {
        limits::check_bounds("road_shape", self)?;
        limits::check("road_shape", &[("to_m", self.to_m, self.from_m + 1.0, 500.0, LEAVE_OUT)])
    }

    /// Makes the estimator for a radar's points, or for those of its image.
    ///
    /// # Errors
    /// Returns an error for settings that contradict each other or the radar.
    pub fn estimator(&self, radar: &Radar, by_image: bool) -> Result<RoadShapeEstimator> {
        // One slope tells range rates up to its folds only.
        let fold = (!by_image && radar.waveform.parts() < 2).then(|| 2.0 * radar.max_velocity_mps());
        RoadShapeEstimator::new(self.setup(fold))
            .map_err(|r| BadInput::new(r.to_string()).key("lane.road_shape").into())
    }

    /// Settings of the radar image.
    pub fn image(&self) -> ImageSettings {
        ImageSettings {
            angles: self.angles,
            sources: self.sources,
            forgetting: self.forgetting,
            subarray: self.subarray,
            row_db: self.row_db,
            source_db: self.source_db,
            max_range_m: self.max_range_m,
            ..ImageSettings::default()
        }
    }

    /// What the estimator works with; `fold_mps` as in [`super::StaticGate`].
    pub fn setup(&self, fold_mps: Option<f64>) -> RoadShapeSetup {
        let mut tracker = TrackerSettings {
            parallel: self.parallel,
            confirm_scans: self.confirm_scans,
            ..TrackerSettings::default()
        };
        tracker.gate.sigmas = self.gate_sigmas;
        tracker.gate.floor_mps = self.gate_floor_mps;
        tracker.gate.max_range_m = self.max_range_m;
        tracker.gate.fold_mps = fold_mps;
        tracker.fit.curve = self.curve;
        tracker.fit.heading_std_rad = self.heading_std_deg.to_radians();
        tracker.fit.c1_walk = self.c1_walk;
        tracker.filter.c1_walk = self.c1_walk;
        tracker.filter.b_walk = self.b_walk;
        RoadShapeSetup { tracker, own_speed_share: 0.0 }
    }
}

/// Makes the estimator from options as JSON. The keys of a trial (`from_m`, `picture_frame` and the like) are
/// allowed and have no effect on it.
///
/// # Errors
/// Returns an error for options that are unknown or outside their ranges, or that contradict each other.
pub fn from_json(options: &str) -> Result<Box<dyn LaneEstimator + Send>> {
    let options: RoadShapeOptions = limits::read_json(METHOD, options)?;
    options.check()?;
    let estimator = RoadShapeEstimator::new(options.setup(None));
    Ok(Box::new(estimator.map_err(|e| limits::refused(METHOD, e))?))
}
