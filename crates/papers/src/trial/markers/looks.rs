//! A look with all that rows, tables and pictures need.

use crate::trial::markers::tally::Tally;
use crate::trial::stats::over_runs;
use catseye_lane::markers::Markers;
use catseye_lane::{LaneEstimate, LanePoint};
use serde::{Deserialize, Serialize};

/// What is kept of a frame.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Kept {
    pub points: Vec<LanePoint>,
    /// The object that made each point, for the tables and pictures only; "" for none.
    pub classes: Vec<String>,
}

/// One look with all that pictures and tables need.
pub struct MarkerLook {
    pub run: u32,
    pub frame: u32,
    pub time_s: f64,
    pub kept: Kept,
    /// Of the look by itself.
    pub single: LaneEstimate,
    pub followed: LaneEstimate,
    pub steps: catseye_lane::markers::Steps,
    pub tally: Tally,
    pub markers: Vec<[f64; 2]>,
    pub every_marker: Vec<[f64; 2]>,
    pub true_speed_mps: f64,
    pub true_yaw_rate: f64,
}

pub fn of_runs(seen: &[MarkerLook], of: impl Fn(&[&MarkerLook]) -> Option<f64>) -> Vec<f64> {
    over_runs(seen, |s| s.run, of)
}

/// Range (m), level seen and level expected (dBsm) of each member of each line.
pub fn excess_db(s: &MarkerLook, estimator: &Markers) -> Vec<Vec<(f64, f64, f64)>> {
    s.single
        .lines
        .iter()
        .map(|l| {
            l.members
                .iter()
                .filter_map(|i| {
                    let p = s.kept.points.get(*i)?;
                    let curve = &l.fitted.curve;
                    let foot = curve.foot(glam::DVec2::from_array(p.at_m));
                    let expected = estimator.expected_dbsm(p, curve.at(foot.s_m).heading_rad)?;
                    Some((p.range_m, p.rcs_dbsm, expected))
                })
                .collect()
        })
        .collect()
}

pub fn is_marker(s: &MarkerLook, i: usize) -> bool {
    s.kept.classes.get(i).is_some_and(|c| c == "marker")
}
