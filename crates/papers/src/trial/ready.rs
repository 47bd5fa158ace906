//! What every lane method has: settings with ranges, a trial of its own, and what a comparison drives.

use crate::trial::context::TrialContext;
use crate::trial::drive::Drive;
use crate::trial::report::Trial;
use crate::trial::sensors::OwnedInput;
use catseye::base::error::{BadInput, Result};
use catseye::scene::radar::Radar;
use catseye::scene::waveform::Waveform;
use catseye::simulate::Frame;
use catseye_lane::LaneEstimator;

/// Standard deviation of the speed that the vehicle's bus tells in a comparison, m/s.
pub const SPEED_STD_MPS: f64 = 0.1;

/// A method by the settings of its table below `[lane]`.
pub trait LaneMethod {
    /// Drives the scenario, lets the method say what it finds, and judges that.
    ///
    /// # Errors
    /// Settings out of their ranges; what the scenario lacks for the method; those of the frames.
    fn trial(&self, given: &TrialContext<'_>) -> Result<Trial>;

    /// The method ready for a drive of a comparison, by variant: one, or one for each choice of sensors and light.
    ///
    /// # Errors
    /// What the scenario lacks for it, as bad input.
    fn ready(
        &self,
        given: &TrialContext<'_>,
        drive: &Drive<'_>,
        run: u32,
    ) -> Result<Vec<(String, ReadyMethod)>>;
}

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
    /// The estimator.
    pub estimator: Box<dyn LaneEstimator + Send>,
    /// What it is to find.
    pub finds: Finds,
    /// Radar whose frames it takes.
    pub radar: Option<usize>,
    /// Points of that radar's detector go to it.
    pub points: bool,
    /// Tracks of what moves, from that radar.
    pub tracks: bool,
    /// What else the vehicle senses for it.
    pub sense: Option<Sense>,
}

impl ReadyMethod {
    fn new(estimator: impl LaneEstimator + Send + 'static) -> ReadyMethod {
        let estimator = Box::new(estimator);
        ReadyMethod {
            estimator,
            finds: Finds::OwnLines,
            radar: None,
            points: false,
            tracks: false,
            sense: None,
        }
    }

    /// One that takes the points of a radar.
    pub fn of_points(estimator: impl LaneEstimator + Send + 'static, radar: usize) -> ReadyMethod {
        ReadyMethod { radar: Some(radar), points: true, ..ReadyMethod::new(estimator) }
    }

    /// One that has a sensor of its own.
    pub fn sensing(estimator: impl LaneEstimator + Send + 'static, sense: Sense) -> ReadyMethod {
        ReadyMethod { sense: Some(sense), ..ReadyMethod::new(estimator) }
    }

    /// As the only variant.
    pub fn alone(self) -> Vec<(String, ReadyMethod)> {
        vec![(String::new(), self)]
    }
}

/// Says that a method finds no radar that it can take among those of a scenario, which it lists. `method` is the method's name on the
/// command line, `allowed` the kind of radar that it takes.
pub fn no_radar(radars: &[Radar], method: &str, allowed: &str, remedy: &str) -> BadInput {
    let kind = |r: &Radar| match &r.waveform {
        Waveform::Fmcw(_) => "fmcw",
        Waveform::Stepped { .. } => "stepped",
        Waveform::Pulse { .. } => "pulse",
        Waveform::Coded { .. } => "coded",
    };
    let told = |r: &Radar| match r.virtual_channels() {
        1 => format!("{} ({}, 1 channel)", r.name, kind(r)),
        n => format!("{} ({}, {n} channels)", r.name, kind(r)),
    };
    let value = radars.iter().map(told).collect::<Vec<_>>().join(", ");
    let bad = BadInput::new(format!("the method {method} can take no radar of the scenario"));
    bad.key("radar").value(value).allowed(allowed).remedy(remedy)
}

/// The radar that was found, or what the method `method` takes and what to do about it.
///
/// # Errors
/// There is none.
pub fn needed(
    found: Option<usize>,
    given: &TrialContext<'_>,
    method: &str,
    allowed: &str,
    remedy: &str,
) -> Result<usize> {
    let bad = || no_radar(&given.scenario.radars, method, allowed, remedy).file(given.path).into();
    found.ok_or_else(bad)
}

/// The first radar with chirps and directions, for a comparison of `method`.
///
/// # Errors
/// There is none.
pub fn chirp_radar(given: &TrialContext<'_>, method: &str) -> Result<usize> {
    let suits = |w: &Waveform| matches!(w, Waveform::Fmcw(s) if s.ramps.len() == 1);
    let found = given.scenario.radars.iter().position(|r| suits(&r.waveform) && r.virtual_channels() > 1);
    let allowed = "an FMCW radar with one ramp and two channels or more";
    needed(found, given, method, allowed, "add one, as in radar = \"feng77\"")
}
