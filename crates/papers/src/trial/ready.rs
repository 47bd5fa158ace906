//! What every lane method provides: settings with ranges, a trial of its own, and its variants for a
//! comparison.

use crate::trial::context::TrialContext;
use crate::trial::drive::Drive;
use crate::trial::report::Trial;
use crate::trial::sensors::OwnedInput;
use catseye::base::error::{BadInput, Result};
use catseye::scene::radar::Radar;
use catseye::scene::waveform::Waveform;
use catseye::simulate::Frame;
use catseye_lane::LaneEstimator;

/// Standard deviation of the speed on the vehicle's bus in a comparison, m/s.
pub const SPEED_STD_MPS: f64 = 0.1;

/// A method with the settings of its table below `[lane]`.
pub trait LaneMethod {
    /// Drives the scenario, runs the method and scores its estimates.
    ///
    /// # Errors
    /// Returns an error for settings outside their ranges, for what the scenario lacks for the method, and
    /// the errors of the frames.
    fn trial(&self, given: &TrialContext<'_>) -> Result<Trial>;

    /// Makes the method ready for a drive of a comparison, by variant: one, or one for each choice of sensors
    /// and light.
    ///
    /// # Errors
    /// Returns `BadInput` for what the scenario lacks for the method, and the errors of files and engine.
    fn ready(
        &self,
        given: &TrialContext<'_>,
        drive: &Drive<'_>,
        run: u32,
    ) -> Result<Vec<(String, ReadyMethod)>>;
}

/// Function that adds to a look what a radar's frame or a separate sensor gives to one method.
pub type Sense = Box<dyn FnMut(&Drive<'_>, Option<&Frame>, u32, &mut OwnedInput) -> Result<()>>;

/// The lines that a method is to find.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Finds {
    /// The two lines of the vehicle's own lane.
    OwnLines,
    /// The barriers that bound the road; lines, offset, heading and curvature are theirs.
    RoadEdges,
    /// The outer edges of the drivable lanes beside each other in which the vehicle is; offset, heading and curvature are
    /// those of all of them together.
    LaneRegion,
}

/// A method that is ready for a drive.
pub struct ReadyMethod {
    /// The estimator.
    pub estimator: Box<dyn LaneEstimator + Send>,
    /// The lines that it is to find.
    pub finds: Finds,
    /// Index of the radar whose frames it uses.
    pub radar: Option<usize>,
    /// Whether it uses the points of that radar's detector.
    pub points: bool,
    /// Whether it uses tracks of moving things from that radar.
    pub tracks: bool,
    /// Function that adds data of other sensors.
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

    /// Makes a method that uses the points of a radar.
    pub fn of_points(estimator: impl LaneEstimator + Send + 'static, radar: usize) -> ReadyMethod {
        ReadyMethod { radar: Some(radar), points: true, ..ReadyMethod::new(estimator) }
    }

    /// Makes a method that has a sensor of its own.
    pub fn sensing(estimator: impl LaneEstimator + Send + 'static, sense: Sense) -> ReadyMethod {
        ReadyMethod { sense: Some(sense), ..ReadyMethod::new(estimator) }
    }

    /// The list of variants with this one alone, under an empty name.
    pub fn alone(self) -> Vec<(String, ReadyMethod)> {
        vec![(String::new(), self)]
    }
}

/// Makes the error of a method for which a scenario has no suitable radar; it lists those of the scenario.
/// `method` is the method's name on the command line, `allowed` the kind of radar that it uses.
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
    let bad = BadInput::new(format!("the method {method} cannot use any radar of the scenario"));
    bad.key("radar").value(value).allowed(allowed).remedy(remedy)
}

/// Returns the radar that was found, or else the error of [`no_radar`].
///
/// # Errors
/// Returns an error if `found` is None.
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

/// Index of the first FMCW radar with one ramp and two channels or more, for a comparison of `method`.
///
/// # Errors
/// Returns an error if the scenario has no such radar.
pub fn chirp_radar(given: &TrialContext<'_>, method: &str) -> Result<usize> {
    let suits = |w: &Waveform| matches!(w, Waveform::Fmcw(s) if s.ramps.len() == 1);
    let found = given.scenario.radars.iter().position(|r| suits(&r.waveform) && r.virtual_channels() > 1);
    let allowed = "an FMCW radar with one ramp and two channels or more";
    needed(found, given, method, allowed, "add one, as in radar = \"feng77\"")
}
