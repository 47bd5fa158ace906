//! Lane lines from a camera near the car and from a radar's tracks of the cars ahead (document S).
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

use std::fmt;

mod camera;
mod curve;
mod edges;
mod estimator;
mod matching;
mod near;
mod pnn;
mod recognise;
mod reconstruct;
#[cfg(test)]
mod synth;
mod targets;

pub use camera::{Camera, Image, Trapezoid};
pub use curve::{
    Arc, BSpline, Circle, FitComparison, Parabola, circle_through, compare_fits, fit_b_spline, fit_parabola,
};
pub use edges::{Edge, EdgeSettings, Edges, HoughLine, HoughSettings, edges, hough_lines};
pub use estimator::{CameraFusion, FusionOptions, Insight, Way};
pub use matching::{LaneMatch, MatchSettings, match_lane, r_squared};
pub use near::{NearLane, NearLine, NearSettings, find_near_lane};
pub use pnn::{Bend, BendSettings, Choice, Pnn, generate_bends};
pub use recognise::{
    Blinding, CameraView, Part, RecogniseInput, RecogniseSettings, Recogniser, Recognition, Sources,
    recognise, windows,
};
pub use reconstruct::{EdgeOfPart, Middle, RoadModel, reconstruct};
pub use targets::{
    EgoPath, EgoSample, LaneOffset, LanePlace, TrackPoint, Trail, step_to_present, tell_lanes_apart,
};

/// Why there is no result. `Display` gives one plain sentence.
#[derive(Debug, Clone, PartialEq)]
pub enum Refusal {
    /// A number is NaN or infinite.
    NotFinite { what: &'static str },
    /// Fewer data than the step needs.
    TooFew { what: &'static str, got: usize, need: usize },
    /// A setting or an input outside what is allowed.
    OutOfRange { what: &'static str, value: f64, allowed: &'static str },
    /// The data do not determine the result.
    Degenerate { what: &'static str },
    /// A point is not in front of the camera.
    BehindCamera,
    /// A pixel's ray does not meet the ground ahead.
    AboveHorizon,
    /// The image shows no line that can be a lane's.
    NoLaneLine,
    /// The far part fits no lane beside the near part.
    NoMatch { best_r_squared: f64, slope_gap_rad: f64 },
    /// The tangents at the two edges do not meet between them, so the road model cannot join them.
    TangentsDoNotMeet { model: RoadModel },
    /// Neither sensor has anything to say.
    NothingSeen,
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Refusal::NotFinite { what } => write!(f, "{what} is not a finite number."),
            Refusal::TooFew { what, got, need } => write!(f, "{got} {what} are given and {need} are needed."),
            Refusal::OutOfRange { what, value, allowed } => {
                write!(f, "{what} is {value}, and allowed is {allowed}.")
            }
            Refusal::Degenerate { what } => write!(f, "The data leave open {what}."),
            Refusal::BehindCamera => write!(f, "The point is not in front of the camera."),
            Refusal::AboveHorizon => write!(f, "The pixel's ray does not meet the ground ahead."),
            Refusal::NoLaneLine => write!(f, "The image shows no line that can be a lane's."),
            Refusal::NoMatch { best_r_squared, slope_gap_rad } => write!(
                f,
                "The far part continues no lane near the car: the best goodness of fit is \
                 {best_r_squared:.3} with slopes {slope_gap_rad:.3} rad apart."
            ),
            Refusal::TangentsDoNotMeet { model } => {
                write!(f, "The tangents at the edges do not meet between them as the model '{model}' needs.")
            }
            Refusal::NothingSeen => write!(f, "Neither the camera nor the radar sees a lane."),
        }
    }
}

impl std::error::Error for Refusal {}

/// `value` when it is finite.
fn finite(what: &'static str, value: f64) -> Result<f64, Refusal> {
    if value.is_finite() { Ok(value) } else { Err(Refusal::NotFinite { what }) }
}

/// `value` when it is finite and above zero.
fn positive(what: &'static str, value: f64) -> Result<f64, Refusal> {
    match finite(what, value)? > 0.0 {
        true => Ok(value),
        false => Err(Refusal::OutOfRange { what, value, allowed: "above 0" }),
    }
}

/// An angle brought into (-pi, pi].
fn wrapped(angle_rad: f64) -> f64 {
    let a = angle_rad.rem_euclid(std::f64::consts::TAU);
    if a > std::f64::consts::PI { a - std::f64::consts::TAU } else { a }
}
