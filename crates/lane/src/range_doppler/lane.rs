//! What is assumed of a lane, and the lane that is found.

use super::cells::Parameter;
use crate::error::{self, LaneError};
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// Number of fitted values.
pub const VALUES: usize = 7;

pub(super) const OFFSET: usize = 0;

pub(super) const HEADING: usize = 1;

pub(super) const CURVATURE: usize = 2;

pub(super) const START: usize = 3;

pub(super) const LEFT: usize = 4;

pub(super) const RIGHT: usize = 5;

pub(super) const SPEED: usize = 6;

pub(super) type Vector = [f64; VALUES];

pub(super) type Matrix = [[f64; VALUES]; VALUES];

/// What is known of the radar's speed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Speed {
    /// Known speed of the radar over ground.
    Known {
        /// The speed, m/s.
        mps: f64,
        /// Its standard deviation, m/s.
        std_mps: f64,
    },
    /// Unknown: the speed is taken from the edge of the map, then fitted with the rest.
    FromMap,
}

/// The line along which the spacings are measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Along {
    /// The middle of the lane.
    Middle,
    /// Each row itself.
    Row,
}

/// Length of the straight part of the lane in front of the radar.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum CurveStart {
    /// Its length is known, m; zero where the radar is in the bend.
    Known(f64),
    /// Its length is fitted, between zero and this, m.
    UpTo(f64),
}

/// What is known of the lane, and the range of the search.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LaneSettings {
    /// Distance between the two rows, m.
    pub lane_width_m: f64,
    /// Spacing of the markers of the left row, m.
    pub left_spacing_m: f64,
    /// Spacing of the markers of the right row, m.
    pub right_spacing_m: f64,
    /// The line along which spacings are measured in a bend.
    pub along: Along,
    /// What is known of where the bend starts.
    pub curve_start: CurveStart,
    /// Height of the radar above the markers, m.
    pub radar_height_m: f64,
    /// Largest offset that is searched to both sides, m.
    pub max_offset_m: f64,
    /// Largest heading that is searched to both sides, rad.
    pub max_heading_rad: f64,
    /// Least radius of the bend that is searched, m.
    pub min_radius_m: f64,
    /// Turn after which the bend ends, rad.
    pub max_turn_rad: f64,
    /// Least range at which markers are seen, m.
    pub near_m: f64,
    /// Largest range at which markers are seen, m.
    pub far_m: f64,
    /// Half the field of view about the direction of motion, rad.
    pub half_view_rad: f64,
    /// Probability that a marker in view is detected.
    pub detection_probability: f64,
    /// Share of the cells that are not markers.
    pub extra_share: f64,
    /// Log odds from which on one of two readings is taken as true.
    pub sure_log_odds: f64,
}

impl Default for LaneSettings {
    fn default() -> Self {
        Self {
            lane_width_m: 3.0,
            left_spacing_m: 1.5,
            right_spacing_m: 2.0,
            along: Along::Middle,
            curve_start: CurveStart::UpTo(30.0),
            radar_height_m: 0.15,
            max_offset_m: 1.5,
            max_heading_rad: PI / 3.0,
            min_radius_m: 5.0,
            max_turn_rad: PI,
            near_m: 0.5,
            far_m: 40.0,
            half_view_rad: PI / 2.0,
            detection_probability: 0.9,
            extra_share: 0.1,
            sure_log_odds: 4.6,
        }
    }
}

/// Whether the signs of offset, heading and curvature are known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Sign {
    /// The cells tell the side.
    Known,
    /// The mirrored lane fits about as well. With equal spacings it fits exactly as well; the lane reported
    /// is then the one with its offset to the left (or, where that is zero within its standard deviation, its
    /// heading, then its curvature).
    Unknown,
}

/// Another lane that fits about as well, not the mirrored one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct OtherLane {
    /// Offset of the radar from the lane's middle, m, positive left.
    pub offset_m: f64,
    /// Heading of the radar's motion against the lane, rad, positive left.
    pub heading_rad: f64,
    /// Curvature of the bend, 1/m, positive left.
    pub curvature_per_m: f64,
    /// Log odds by which it is less likely.
    pub log_odds: f64,
}

/// The lane as fitted to the cells of a map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LaneFromMap {
    /// Offset of the radar from the lane's centre line, m, positive to the left.
    pub offset_m: Parameter,
    /// Heading of the motion relative to the lane, rad, positive to the left.
    pub heading_rad: Parameter,
    /// Curvature of the bend, 1/m, positive to the left.
    pub curvature_per_m: Parameter,
    /// Distance along the lane from the radar to the bend, m. It is not observed where the lane is straight.
    pub curve_start_m: Parameter,
    /// Distance along the lane from the radar to the first marker of the left row ahead, m.
    pub left_phase_m: Parameter,
    /// Distance along the lane from the radar to the first marker of the right row ahead, m.
    pub right_phase_m: Parameter,
    /// Speed of the radar, m/s.
    pub speed_mps: Parameter,
    /// Covariance in the order of the values above.
    pub covariance: Matrix,
    /// Whether the side is known.
    pub sign: Sign,
    /// Log odds of this lane over the mirrored one; infinite where no mirrored one fits.
    pub sign_log_odds: f64,
    /// Another lane that fits about as well.
    pub other: Option<OtherLane>,
    /// Expected number of cells that are markers.
    pub explained: f64,
    /// Logarithm of the likelihood at its maximum.
    pub log_likelihood: f64,
}

impl LaneFromMap {
    /// Unsigned radius of the bend, and the radii at one standard deviation of the curvature to either side,
    /// m. None where the curvature is less than two standard deviations from zero.
    pub fn radius_m(&self) -> Option<[f64; 3]> {
        let (k, s) = (self.curvature_per_m.value.abs(), self.curvature_per_m.std);
        (k > 2.0 * s).then(|| [1.0 / k, 1.0 / (k + s), 1.0 / (k - s)])
    }
}

impl LaneFromMap {
    /// Predicts the lane after the radar has moved by `ahead_m` along the lane and by `left_m` to its side
    /// and has turned by `turn_rad`, as the start of a search by [`lane_near`](super::lane_near).
    pub fn moved(&self, ahead_m: f64, left_m: f64, turn_rad: f64) -> LaneFromMap {
        let by = |p: Parameter, d: f64| Parameter { value: p.value + d, ..p };
        let mut out = self.clone();
        let start = self.curve_start_m.value;
        // In the bend the lane's direction turns along.
        let bent = if self.curve_start_m.observed {
            (ahead_m - start.max(0.0)).clamp(0.0, ahead_m.max(0.0))
        } else {
            0.0
        };
        out.offset_m = by(self.offset_m, left_m);
        out.heading_rad = by(self.heading_rad, turn_rad - bent * self.curvature_per_m.value);
        if self.curve_start_m.observed {
            out.curve_start_m.value = (start - ahead_m).max(0.0);
        }
        out.left_phase_m = by(self.left_phase_m, -ahead_m);
        out.right_phase_m = by(self.right_phase_m, -ahead_m);
        out
    }
}

impl LaneSettings {
    /// Checks the settings.
    ///
    /// # Errors
    /// Returns an error with the name of the first setting that lies outside its range.
    pub fn check(&self) -> Result<(), LaneError> {
        let positive = |x: f64| x.is_finite() && x > 0.0;
        let start = match self.curve_start {
            CurveStart::Known(m) | CurveStart::UpTo(m) => m,
        };
        let rules: [(&'static str, bool); 15] = [
            ("lane_width_m", positive(self.lane_width_m)),
            ("left_spacing_m", positive(self.left_spacing_m) && self.left_spacing_m >= 0.05),
            ("right_spacing_m", positive(self.right_spacing_m) && self.right_spacing_m >= 0.05),
            ("curve_start", start.is_finite() && (0.0..=500.0).contains(&start)),
            ("radar_height_m", self.radar_height_m.is_finite() && self.radar_height_m >= 0.0),
            ("max_offset_m", positive(self.max_offset_m) && self.max_offset_m <= 20.0),
            ("max_heading_rad", positive(self.max_heading_rad) && self.max_heading_rad <= PI / 2.0),
            ("min_radius_m", self.min_radius_m > 0.5 * self.lane_width_m),
            ("max_turn_rad", positive(self.max_turn_rad) && self.max_turn_rad <= TAU),
            ("near_m", self.near_m.is_finite() && self.near_m >= 0.0),
            ("far_m", positive(self.far_m) && self.far_m > self.near_m && self.far_m <= 500.0),
            ("half_view_rad", positive(self.half_view_rad) && self.half_view_rad <= PI),
            ("detection_probability", self.detection_probability > 0.0 && self.detection_probability < 1.0),
            ("extra_share", self.extra_share > 0.0 && self.extra_share < 1.0),
            ("sure_log_odds", positive(self.sure_log_odds)),
        ];
        error::settings(&rules)
    }
}

/// Log-likelihoods and lanes, best first.
pub(super) type Modes = Vec<(f64, Vector)>;

pub(super) fn mirrored(p: &Vector) -> Vector {
    let mut q = *p;
    for i in [OFFSET, HEADING, CURVATURE] {
        q[i] = -q[i];
    }
    q
}

pub(super) fn mirrored_covariance(c: &Matrix) -> Matrix {
    let to = [OFFSET, HEADING, CURVATURE, START, RIGHT, LEFT, SPEED];
    let sign = [-1.0, -1.0, -1.0, 1.0, 1.0, 1.0, 1.0];
    let mut out = [[0.0; VALUES]; VALUES];
    for i in 0..VALUES {
        for j in 0..VALUES {
            out[to[i]][to[j]] = sign[i] * sign[j] * c[i][j];
        }
    }
    out
}
