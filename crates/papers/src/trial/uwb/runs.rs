//! What the drives gave under each rule.

use crate::trial::uwb::drives::{ImpulseRadar, Passed, Scans};
use crate::trial::uwb::settings::Settings;
use crate::trial::uwb::tuning::{Rule, Tuned};
use catseye_lane::uwb;

/// One run as one eye sees it under one rule.
pub struct RunResult {
    pub energies: Vec<f64>,
    pub result: uwb::LaneEstimate,
    pub score: uwb::RunScore,
    /// Departure warnings where no marker of the own line was due, and where one was.
    pub warnings_right: usize,
    pub warnings_wrong: usize,
    /// By counted markers, and by the speed alone: error at the last scan, m.
    pub odometer_m: Option<[f64; 2]>,
}

/// One run.
pub struct Run {
    pub times_s: Vec<f64>,
    /// By eye.
    pub passes: Vec<Vec<Passed>>,
    pub beside: Vec<Vec<Option<f64>>>,
    pub covers: Vec<Vec<f64>>,
    /// `[rule][eye]`.
    pub seen: Vec<Vec<RunResult>>,
    pub scans: Scans,
}

/// The slow drive past the plates.
pub struct Slow {
    pub beside: Vec<Vec<Option<f64>>>,
    pub scans: Scans,
}

/// All that figures are made from.
pub struct UwbResults<'a> {
    pub settings: &'a Settings,
    pub impulse_radars: Vec<ImpulseRadar>,
    pub rules: Vec<Rule>,
    /// `[rule][eye]`.
    pub tuned: Vec<Vec<Tuned>>,
    pub quiet: Scans,
    pub slow: Vec<Slow>,
    pub runs: Vec<Run>,
    /// Lateral distance and scan of the first eye.
    pub sweep: Vec<(f64, Vec<f32>)>,
}
