//! A look with all data for rows, tables and pictures.

use crate::trial::kit::*;
use crate::trial::markers::tally::{Tally, View, tally};
use catseye_lane::Line;
use catseye_lane::markers::Markers;

/// Data kept of a frame.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Kept {
    pub points: Vec<LanePoint>,
    /// Class of the object that made each point, for the tables and pictures only; "" for none.
    pub classes: Vec<String>,
}

/// One look with all data for pictures and tables.
pub struct MarkerLook {
    /// The step with the estimate that tracks lines over looks.
    pub step: Step,
    pub kept: Kept,
    /// Estimate of the look without tracking.
    pub single: LaneEstimate,
    pub steps: catseye_lane::markers::Steps,
    pub tally: Tally,
    /// Markers in view, in the level frame, m.
    pub markers: Vec<[f64; 2]>,
    pub every_marker: Vec<[f64; 2]>,
    pub true_speed_mps: f64,
    pub true_yaw_rate: f64,
}

impl MarkerLook {
    pub fn time_s(&self) -> f64 {
        self.step.estimate.time_s
    }
}

pub fn of_runs(seen: &[MarkerLook], of: impl Fn(&[&MarkerLook]) -> Option<f64>) -> Vec<f64> {
    over_runs(seen, |s| s.step.run, of)
}

/// Range (m), measured level and expected level (dBsm) of each member of each line.
pub fn excess_db(s: &MarkerLook, estimator: &Markers) -> Vec<Vec<(f64, f64, f64)>> {
    let of_line = |l: &Line| {
        let curve = &l.fitted.curve;
        let of_member = |i: &usize| {
            let p = s.kept.points.get(*i)?;
            let foot = curve.foot(DVec2::from_array(p.at_m));
            let expected = estimator.expected_dbsm(p, curve.at(foot.s_m).heading_rad)?;
            Some((p.range_m, p.rcs_dbsm, expected))
        };
        l.members.iter().filter_map(of_member).collect()
    };
    s.single.lines.iter().map(of_line).collect()
}

/// Counts over all looks without tracking, in a part of the view.
pub fn tally_within(seen: &[MarkerLook], ring: &View, within_m: f64) -> Tally {
    let mut sum = Tally::default();
    for s in seen {
        let inside = |m: &[f64; 2]| ring.holds(DVec2::from_array(*m));
        let markers: Vec<[f64; 2]> = s.markers.iter().copied().filter(inside).collect();
        sum.add(&tally(&s.single, &s.kept.points, &markers, &s.every_marker, ring, within_m));
    }
    sum
}
