//! A method that is ready for the drives of a comparison.

use crate::trial::context::TrialContext;
use crate::trial::drive::Drive;
use crate::trial::sensors::OwnedInput;
use catseye::error::{BadInput, Result};
use catseye::scene::waveform::Waveform;
use catseye::simulate::Frame;
use catseye_lane::LaneEstimator;

/// Of the vehicle's bus.
pub const SPEED_STD_MPS: f64 = 0.1;

/// Adds to a look what a radar's frame, or a sensor of its own, gives to one method.
pub type Sense = Box<dyn FnMut(&Drive<'_>, Option<&Frame>, u32, &mut OwnedInput) -> Result<()>>;

/// What a method is to find.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Finds {
    /// The two lines of the vehicle's own lane.
    OwnLines,
    /// The barriers that bound the road: lines, offset, heading and curvature are theirs.
    RoadEdges,
}

/// A method that is ready to drive.
pub struct ReadyMethod {
    pub estimator: Box<dyn LaneEstimator + Send>,
    pub finds: Finds,
    /// Radar whose frames it takes.
    pub radar: Option<usize>,
    /// Points of that radar's detector go to it.
    pub points: bool,
    /// Tracks of what moves, from that radar.
    pub tracks: bool,
    pub sense: Option<Sense>,
}

impl ReadyMethod {
    /// One that takes the points of a radar.
    pub fn of_points(estimator: impl LaneEstimator + Send + 'static, radar: usize) -> ReadyMethod {
        ReadyMethod {
            estimator: Box::new(estimator),
            finds: Finds::OwnLines,
            radar: Some(radar),
            points: true,
            tracks: false,
            sense: None,
        }
    }
}

/// The first radar with chirps and directions.
pub fn chirp_radar(given: &TrialContext<'_>) -> Result<usize> {
    let suits = |w: &Waveform| matches!(w, Waveform::Fmcw(s) if s.ramps.len() == 1);
    let radars = &given.scenario.radars;
    radars.iter().position(|r| suits(&r.waveform) && r.virtual_channels() > 1).ok_or_else(|| {
        BadInput::new("no radar of the scenario has chirps and several channels")
            .file(given.path)
            .key("radar")
            .remedy("add one, as in radar = \"feng77\"")
            .into()
    })
}
