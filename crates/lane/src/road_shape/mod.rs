//! Road shape from the stationary echoes of walls and barriers (Miyake, sections III to V).
//!
//! From the peaks of one scan [`points::static_points`] keeps what is stationary, [`hough::VoteMap`] votes
//! for curves y = a x² + b (Miyake eq. 23, 24) and finds one edge on each side, [`fit`] refines them by
//! robust least squares, and [`clothoid::ClothoidFilter`] follows curvature, its rate and the edge's position
//! (Miyake eq. 25–27). [`tracker::RoadTracker`] runs all of it scan after scan.
//!
//! Vehicle frame: x forward, y left, origin anywhere on the car's x axis as long as the radar's mounting
//! is given in it. Miyake's x is our y and Miyake's y our x; a > 0 bends to the left, a = c/2 with c the curvature.

pub use crate::side::Side;

pub mod clothoid;
pub mod estimator;
pub mod fit;
pub mod hough;
pub mod image;
pub mod options;
pub mod points;
#[cfg(test)]
#[path = "tests/synthetic.rs"]
mod synthetic;
#[cfg(test)]
mod tests;
pub mod tracker;

pub use clothoid::{ClothoidFilter, ClothoidSettings, EdgeMeasurement, Update};
pub use estimator::{RoadShapeEstimator, RoadShapeSetup};
pub use fit::{Curve, EdgeFit, FitSettings, fit_edge, fit_parallel};
pub use hough::{EdgePeak, HoughSettings, RoadWidth, VoteMap};
pub use options::{RoadShapeOptions, from_json};
pub use points::{
    Ego, Peak, RadarMount, StaticGate, StaticPoint, StaticScan, ego_speed, expected_range_rate_mps,
    static_points,
};
pub use tracker::{EdgeStatus, EdgeTrack, RoadShape, RoadTracker, TrackerSettings};
