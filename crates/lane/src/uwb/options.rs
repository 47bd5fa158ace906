//! Options of the method uwb for one radar without a scenario, in JSON and in Python.

use super::estimator::METHOD;
use super::tuning::Tuning;
use super::{Centre, MarkedLane, RangeAxis, RangeGate, UwbLanes, UwbSetup};
use crate::LaneEstimator;
use crate::limits::{self, Limit};
use crate::side::Side;
use catseye::base::error::Result;
use serde::{Deserialize, Serialize};

/// Options of the method uwb (Kim). A scenario's table `[lane.uwb]` has no radar, side or quiet scans in it: a
/// trial takes these from the scenario's radars and from a drive on the road without markers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UwbOptions {
    /// Range of the first sample of a scan, m.
    pub range_start_m: f64,
    /// Spacing of the samples in range, m.
    pub range_step_m: f64,
    /// Height of the radar above the road, m.
    pub height_m: f64,
    /// Position of the radar on the vehicle: forward, left, m.
    pub at_m: [f64; 2],
    /// Side of the line that it observes: left or right.
    pub side: Side,
    /// Scans of the road without markers, at least 20, from which background and threshold are computed.
    pub quiet: Vec<Vec<f64>>,
    /// Distance from the beginning of a plate to that of the next, m. Default 8.
    #[serde(default = "spacing_m")]
    pub spacing_m: f64,
    /// Length of a plate, m. Default 3.
    #[serde(default = "plate_length_m")]
    pub plate_length_m: f64,
    /// Width of the lane, m. Default 3.5.
    #[serde(default = "lane_width_m")]
    pub lane_width_m: f64,
    /// Width of the vehicle, m. Default 1.9.
    #[serde(default = "car_width_m")]
    pub car_width_m: f64,
}

/// Default distance from the beginning of a plate to that of the next, m.
pub fn spacing_m() -> f64 {
    8.0
}

/// Default length of a plate, m.
pub fn plate_length_m() -> f64 {
    3.0
}

/// Default width of the lane, m.
pub fn lane_width_m() -> f64 {
    3.5
}

/// Default width of the vehicle, m.
pub fn car_width_m() -> f64 {
    1.9
}

/// Default standard deviation of the lateral distance to a line, m.
pub const OFFSET_STD_M: f64 = 0.1;

/// Ranges of the lengths of plates, lane and vehicle (m) in a scenario's table and in these options.
pub fn lane_limits(
    spacing_m: f64,
    plate_length_m: f64,
    lane_width_m: f64,
    car_width_m: f64,
) -> [Limit<'static>; 4] {
    let longest = 0.95 * spacing_m;
    [
        ("spacing_m", spacing_m, 0.5, 1000.0, "give metres from plate to plate, as in 8"),
        ("plate_length_m", plate_length_m, 0.05, longest, "plates are shorter than their spacing"),
        ("lane_width_m", lane_width_m, 1.0, 10.0, "give metres, as in 3.5"),
        ("car_width_m", car_width_m, 0.3, lane_width_m, "a car is no wider than its lane"),
    ]
}

impl UwbOptions {
    /// Checks the options.
    ///
    /// # Errors
    /// Returns an error for the first value outside its range.
    pub fn check(&self) -> Result<()> {
        let [x, y] = self.at_m;
        limits::check(
            "uwb",
            &[
                ("range_start_m", self.range_start_m, -1000.0, 1000.0, "give metres"),
                ("range_step_m", self.range_step_m, f64::MIN_POSITIVE, 100.0, "give metres above 0"),
                ("height_m", self.height_m, f64::MIN_POSITIVE, 100.0, "give metres above the road"),
                ("at_m[0]", x, -1000.0, 1000.0, "give metres forward"),
                ("at_m[1]", y, -1000.0, 1000.0, "give metres to the left"),
            ],
        )?;
        let lane = lane_limits(self.spacing_m, self.plate_length_m, self.lane_width_m, self.car_width_m);
        limits::check("uwb", &lane)
    }

    /// What the estimator works with.
    ///
    /// # Errors
    /// Returns an error for the first value outside its range, or if the quiet scans give no background or no
    /// threshold.
    pub fn setup(&self) -> Result<UwbSetup> {
        self.check()?;
        let UwbOptions { height_m, at_m, side, spacing_m, plate_length_m, .. } = *self;
        let UwbOptions { lane_width_m, car_width_m, .. } = *self;
        let lane = MarkedLane { height_m, lane_width_m, car_width_m, spacing_m, plate_length_m };
        let tuning = Tuning {
            axis: RangeAxis { start_m: self.range_start_m, step_m: self.range_step_m },
            gate: RangeGate::from_marked_lane(&lane).map_err(|e| limits::refused(METHOD, e))?,
            side,
            height_m,
            at_m,
            spacing_m,
            plate_length_m,
            lane_width_m,
            take_background: true,
            centre: Centre::Matched,
            largest_error_m: plate_length_m / 3.0,
            confirm_spacings: 1,
            misses_to_warn: 1,
            false_alarm_probability: None,
            offset_std_m: OFFSET_STD_M,
        };
        let tuned = tuning.tune(&self.quiet);
        Ok(tuned.map_err(|(what, e)| limits::refused(METHOD, format!("{what}: {e}")))?.options)
    }
}

/// Makes the estimator from options as JSON.
///
/// # Errors
/// Returns an error for options that are unknown, missing or outside their ranges.
pub fn from_json(options: &str) -> Result<Box<dyn LaneEstimator + Send>> {
    let options: UwbOptions = limits::read_json(METHOD, options)?;
    let estimator = UwbLanes::new(options.setup()?);
    Ok(Box::new(estimator.map_err(|e| limits::refused(METHOD, e))?))
}
