//! Results of the drives under each rule.

use crate::trial::kit::*;
use crate::trial::uwb::drives::{ImpulseRadar, Passed, Scans};
use crate::trial::uwb::settings::Settings;
use crate::trial::uwb::tuning::{Rule, Tuned, energy, failed};
use catseye_lane::uwb::{self, Histogram};

/// Bins of the histograms.
const BINS: usize = 60;

/// Converts a ratio of powers to decibels.
pub fn db(ratio: f64) -> f64 {
    10.0 * ratio.log10()
}

/// Result of one run by one radar under one rule.
pub struct RunResult {
    pub energies: Vec<f64>,
    pub result: uwb::LaneEstimate,
    pub score: uwb::RunScore,
    /// Number of departure warnings where no marker of the own line was due; `warnings_wrong` counts those
    /// where one was.
    pub warnings_right: usize,
    pub warnings_wrong: usize,
    /// Errors of the distance at the last scan by counted markers and by the speed alone, m.
    pub odometer_m: Option<[f64; 2]>,
}

/// One run.
pub struct Run {
    pub times_s: Vec<f64>,
    /// Passages of markers, by radar.
    pub passes: Vec<Vec<Passed>>,
    pub beside: Vec<Vec<Option<f64>>>,
    pub covers: Vec<Vec<f64>>,
    /// Results by `[rule][radar]`.
    pub seen: Vec<Vec<RunResult>>,
    pub scans: Scans,
}

/// The slow drive past the plates.
pub struct Slow {
    pub beside: Vec<Vec<Option<f64>>>,
    pub scans: Scans,
}

/// All data from which values and pictures are made.
pub struct UwbResults<'a> {
    pub settings: &'a Settings,
    pub impulse_radars: Vec<ImpulseRadar>,
    pub rules: Vec<Rule>,
    /// Tuned options by `[rule][radar]`.
    pub tuned: Vec<Vec<Tuned>>,
    pub quiet: Scans,
    pub slow: Vec<Slow>,
    pub runs: Vec<Run>,
    /// Lateral distance (m) and scan of the first radar.
    pub sweep: Vec<(f64, Vec<f32>)>,
}

impl UwbResults<'_> {
    /// Histograms of the bare road and of scans beside plates in the slow drive, on common edges in units of
    /// the bare road's mean.
    pub fn histograms(&self, r: usize, e: usize) -> Result<Option<(Histogram, Histogram)>> {
        let tuned = &self.tuned[r][e];
        let floor = tuned.threshold.floor_energy;
        let mut marked = Vec::new();
        for slow in &self.slow {
            for (scan, _) in slow.scans.iter().zip(&slow.beside[e]).filter(|(_, b)| b.is_some()) {
                marked.push(energy(&tuned.options, &scan[e])?.energy / floor);
            }
        }
        let bare: Vec<f64> = tuned.bare.iter().map(|v| v / floor).collect();
        let Some((low, high)) = finite_range(bare.iter().chain(&marked).copied()) else { return Ok(None) };
        let high = if high > low { high } else { low + 1e-3 };
        let edges: Vec<f64> = (0..=BINS).map(|i| low + (high - low) * i as f64 / BINS as f64).collect();
        let of = |values: &[f64]| match values.is_empty() {
            true => Ok(Histogram { edges: edges.clone(), counts: vec![0; BINS], outside: [0; 2] }),
            false => Histogram::with_edges(values, edges.clone()).map_err(|r| failed("histogram", r)),
        };
        Ok(Some((of(&bare)?, of(&marked)?)))
    }
}
