//! Road shape from the standing echoes of walls and barriers (seed M, sections III to V).
//!
//! From the peaks of one scan: [`points::static_points`] keeps what stands still, [`hough::VoteMap`] votes
//! for curves y = a x² + b (M eq. 23, 24) and finds one edge on each side, [`fit`] refines them by robust
//! least squares, [`clothoid::ClothoidFilter`] follows curvature, its rate and the edge's place (M eq.
//! 25–27), and [`tracker::RoadTracker`] runs all of it scan after scan.
//!
//! Vehicle frame: x forward, y left, origin anywhere on the car's x axis as long as the radar's mounting
//! is given in it. M's x is our y and M's y our x; a > 0 bends to the left, a = c/2 with c the curvature.

pub mod clothoid;
pub mod estimator;
pub mod fit;
pub mod hough;
pub mod image;
pub mod points;
mod small_matrix;
#[cfg(test)]
mod synthetic;
#[cfg(test)]
mod tests;
pub mod tracker;

pub use clothoid::{ClothoidFilter, ClothoidSettings, EdgeMeasurement, Estimate, Update};
pub use estimator::{RoadShapeEstimator, RoadShapeOptions};
pub use fit::{Curve, EdgeFit, FitSettings, fit_edge, fit_parallel};
pub use hough::{EdgePeak, HoughSettings, RoadWidth, VoteMap};
pub use points::{
    Ego, ImageStd, Peak, RadarImage, RadarMount, StaticGate, StaticPoint, StaticScan, ego_speed,
    expected_range_rate_mps, image_peaks, static_points,
};
pub use tracker::{EdgeStatus, EdgeTrack, RoadShape, RoadTracker, TrackerSettings};

use serde::{Deserialize, Serialize};
use std::fmt;

/// Which edge of the road, seen in the direction of travel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    Left,
    Right,
}

impl Side {
    pub const BOTH: [Side; 2] = [Side::Left, Side::Right];

    /// +1 on the left, −1 on the right.
    pub fn sign(self) -> f64 {
        match self {
            Side::Left => 1.0,
            Side::Right => -1.0,
        }
    }

    pub(crate) fn index(self) -> usize {
        self as usize
    }
}

impl fmt::Display for Side {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Side::Left => "left",
            Side::Right => "right",
        })
    }
}

/// Why there is no result.
#[derive(Debug, Clone, PartialEq)]
pub enum Reason {
    /// An argument is NaN, infinite or of the wrong sign.
    BadInput { what: &'static str, value: f64 },
    /// Lengths of an image and its axes do not agree.
    BadShape { what: &'static str, found: usize, expected: usize },
    /// Fewer points than the settings ask for.
    TooFewPoints { found: usize, needed: usize },
    /// The points cover too short a stretch of road to tell a bend from a shift.
    TooShort { extent_m: f64, needed_m: f64 },
    /// No curve on this side has enough support.
    NoEdge { side: Side },
    /// The points next to the best curve are no more than scattered ones would put there.
    ByChance { found: f64, expected: f64 },
    /// The equations do not fix the parameters.
    Singular,
    /// The fit left the curves that are allowed.
    Diverged,
    /// The curve turns away before this distance.
    OutOfReach { x_m: f64 },
    /// No speed explains enough of the peaks.
    NoCommonSpeed { share: f64, needed: f64 },
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Reason::BadInput { what, value } => write!(f, "{what} is {value}, which is not allowed."),
            Reason::BadShape { what, found, expected } => {
                write!(f, "{what} has {found} values where {expected} are expected.")
            }
            Reason::TooFewPoints { found, needed } => {
                write!(f, "Only {found} of {needed} needed points were found.")
            }
            Reason::TooShort { extent_m, needed_m } => {
                write!(f, "The points cover {extent_m:.1} m of road where {needed_m:.1} m are needed.")
            }
            Reason::NoEdge { side } => write!(f, "No curve on the {side} side has enough support."),
            Reason::ByChance { found, expected } => {
                write!(f, "The best curve has {found:.1} points, too few where chance gives {expected:.1}.")
            }
            Reason::Singular => f.write_str("The points do not fix the curve."),
            Reason::Diverged => f.write_str("The fit ran away from the curves that are allowed."),
            Reason::OutOfReach { x_m } => write!(f, "The curve turns away before it comes {x_m:.1} m ahead."),
            Reason::NoCommonSpeed { share, needed } => write!(
                f,
                "The best speed explains a share of {share:.2} of the peaks where {needed:.2} is needed."
            ),
        }
    }
}

impl std::error::Error for Reason {}

pub type Result<T> = std::result::Result<T, Reason>;

pub(crate) fn finite(what: &'static str, value: f64) -> Result<()> {
    if value.is_finite() { Ok(()) } else { Err(Reason::BadInput { what, value }) }
}

pub(crate) fn positive(what: &'static str, value: f64) -> Result<()> {
    if value.is_finite() && value > 0.0 { Ok(()) } else { Err(Reason::BadInput { what, value }) }
}

pub(crate) fn not_negative(what: &'static str, value: f64) -> Result<()> {
    if value.is_finite() && value >= 0.0 { Ok(()) } else { Err(Reason::BadInput { what, value }) }
}
