//! Lane lines from a camera near the car and from a radar's tracks of the cars ahead (Sangeetha Lakshmi).
//!
//! The camera sees painted lines up to some tens of metres; the radar sees how the cars ahead have driven.
//! The parts are fitted ([`NearLane`], [`Trail`]), matched ([`match_lane`]), the blind middle between them is
//! built from one of five road models ([`RoadModel`]) that a probabilistic neural network chooses ([`Pnn`]),
//! and successive recognitions overlap by half their time ([`Recogniser`]). A camera that sees nothing is an
//! input ([`CameraView::Blinded`]): the radar is then used alone and the result says so ([`Sources`]).
//!
//! All positions are in the present vehicle frame (ISO 8855: x forward, y left, metres) on a flat road;
//! slopes are angles from the x axis, positive to the left, so that no road has an infinite slope. The
//! document's own axes are x to the side and y forward.

mod camera;
mod curve;
mod edges;
mod estimator;
mod matching;
mod near;
mod options;
mod pnn;
mod recognise;
mod reconstruct;
#[cfg(test)]
#[path = "tests/synthetic.rs"]
mod synth;
mod targets;

pub use camera::{Camera, Image, Trapezoid};
pub use curve::{Arc, BSpline, FitComparison, Parabola, compare_fits, fit_parabola};
pub use edges::{Edge, EdgeSettings, Edges, HoughLine, HoughSettings, edges, hough_lines};
pub use estimator::{CameraFusion, FusionSetup, Insight, LeadPath, METHOD};
pub use matching::{LaneMatch, MatchSettings, match_lane, r_squared};
pub use near::{NearLane, NearLine, NearSettings, find_near_lane};
pub use options::{CameraFusionOptions, CameraTable, Condition, from_json};
pub use pnn::{Bend, BendSettings, Choice, Pnn, generate_bends};
pub use recognise::{
    Blinding, CameraView, Part, RecogniseInput, RecogniseSettings, Recogniser, Recognition, Sources,
    recognise,
};
pub use reconstruct::{EdgeOfPart, Middle, RoadModel, reconstruct};
pub use targets::{EgoPath, EgoSample, LaneOffset, LanePlace, Trail, separate_lanes};
