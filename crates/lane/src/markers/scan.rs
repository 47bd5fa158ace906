//! What all steps of the method share: the markers' pattern, a scan, and the places of a line's markers.

use crate::{LanePoint, Line, Measured};
use glam::DVec2;
use std::f64::consts::TAU;

/// Pattern of the markers and tolerances of the points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MarkerPattern {
    /// Spacing of the markers along the row, d_ps, m.
    pub spacing_m: f64,
    /// Largest difference of neighbours' distances from the spacing, d_pt, m.
    pub tolerance_m: f64,
    /// Least number of points of a group, n_min.
    pub least: usize,
    /// Minimum number of points of a path.
    pub path_least: usize,
    /// Largest change of direction from one step of a path to the next, and largest change of that change,
    /// rad.
    pub turn_rad: [f64; 2],
    /// Range within which points lie in the ground clutter, m: they start no row but may belong to one that
    /// leads to them.
    pub nearest_m: f64,
    /// Largest gap that joins two paths, in spacings, as markers may be missed.
    pub gap: usize,
    /// Number of standard deviations by which a stationary point may seem to move, or a member lie off its
    /// line.
    pub sigmas: f64,
    /// Error of range rates beyond their noise, m/s: a part of a Doppler cell.
    pub rate_error_mps: f64,
    /// Error of azimuths beyond their noise, rad: arrays differ, and cells hold more than one echo.
    pub azimuth_error_rad: f64,
    /// Half the width of a Doppler lobe, m/s: weak points within it beside a strong echo are its sidelobes.
    pub lobe_mps: f64,
    /// Height of the radar above the road, m.
    pub radar_height_m: f64,
    /// Whether points that no path took are searched for curves by a Hough transform.
    pub hough: bool,
}

impl Default for MarkerPattern {
    /// The document's: 2 m, 0.2 m, 4 and 5 points, 10 degrees, 5 m, radar at 0.15 m with Doppler cells of 0.02 m/s.
    fn default() -> Self {
        MarkerPattern {
            spacing_m: 2.0,
            tolerance_m: 0.2,
            least: 4,
            path_least: 5,
            turn_rad: [20f64.to_radians(), 10f64.to_radians()],
            nearest_m: 5.0,
            gap: 5,
            sigmas: 3.5,
            rate_error_mps: 0.005,
            azimuth_error_rad: 0.3f64.to_radians(),
            lobe_mps: 0.1,
            radar_height_m: 0.15,
            hough: true,
        }
    }
}

/// Function that returns the expected cross section (dBsm) of a marker at a point, given the direction of its
/// row (rad).
pub type ExpectedRcs<'a> = dyn Fn(&LanePoint, f64) -> f64 + 'a;

/// One scan of the radar.
#[derive(Clone, Copy)]
pub struct Scan<'a> {
    /// Time of the scan, s.
    pub time_s: f64,
    /// The points of the scan.
    pub points: &'a [LanePoint],
    /// Speed of the radar over the ground along x, m/s. None: estimated from the points.
    pub speed_mps: Option<Measured>,
    /// Expected cross section of markers. If given, points whose level disagrees with their row are removed.
    pub expected_rcs_dbsm: Option<&'a ExpectedRcs<'a>>,
}

/// Distance by which lines are extended ahead, m.
pub(super) const REACH_M: f64 = 40.0;

/// Stations along a line and beyond its end at which it has markers, m: at the spacing that its members fit
/// best.
pub(super) fn stations(scan: &Scan<'_>, line: &Line, patterns: &[MarkerPattern]) -> Vec<f64> {
    let curve = &line.fitted.curve;
    let at: Vec<f64> =
        line.members.iter().map(|i| curve.foot(DVec2::from_array(scan.points[*i].at_m)).s_m).collect();
    let turns = |d: f64| at.iter().map(|s| DVec2::from_angle(TAU * s / d)).sum::<DVec2>();
    let Some(step) =
        patterns.iter().map(|o| o.spacing_m).max_by(|a, b| turns(*a).length().total_cmp(&turns(*b).length()))
    else {
        return Vec::new();
    };
    let phase = (turns(step).to_angle() / TAU * step).rem_euclid(step);
    let count = ((curve.length_m + REACH_M) / step) as usize;
    (0..=count).map(|k| phase + step * k as f64).collect()
}
