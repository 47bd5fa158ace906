//! What all steps of the method share: the markers' pattern, a scan, and where a line has its markers.

use crate::{LanePoint, Line, Measured};
use glam::DVec2;
use std::f64::consts::TAU;

/// What is known of the markers, and how far points may be off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MarkerOptions {
    /// Along the row, d_ps, m.
    pub spacing_m: f64,
    /// By which distances of neighbours may differ from it, d_pt, m.
    pub tolerance_m: f64,
    /// Least points of a group, n_min.
    pub least: usize,
    /// Least points of a path.
    pub path_least: usize,
    /// Largest change of direction from one step of a path to the next, and of that change itself, rad.
    pub turn_rad: [f64; 2],
    /// Points nearer than this lie in the clutter of the ground, m: they start no row, and belong to one that leads to them.
    pub nearest_m: f64,
    /// A gap of up to so many spacings joins two paths: markers may be missed.
    pub gap: usize,
    /// Standard deviations by which a point at rest may seem to move, or a member stand beside its line.
    pub sigmas: f64,
    /// What range rates miss beyond their noise, m/s: a part of a Doppler cell.
    pub rate_error_mps: f64,
    /// What azimuths miss beyond their noise, rad: arrays are not alike, cells hold more than one echo.
    pub azimuth_error_rad: f64,
    /// Half the width of a Doppler lobe, m/s: weak points beside a strong echo within it are that echo's again.
    pub lobe_mps: f64,
    /// Of the radar over the road, m.
    pub radar_height_m: f64,
    /// Whether points that no path took are searched for curves by Hough's transform.
    pub hough: bool,
}

impl Default for MarkerOptions {
    /// The document's: 2 m, 0.2 m, 4 and 5 points, 10 degrees, 5 m, radar at 0.15 m with Doppler cells of 0.02 m/s.
    fn default() -> Self {
        MarkerOptions {
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

/// A marker's cross section (dBsm) at a point, seen from the radar, where the row runs in the direction given (rad).
pub type ExpectedRcs<'a> = dyn Fn(&LanePoint, f64) -> f64 + 'a;

/// One scan.
#[derive(Clone, Copy)]
pub struct Scan<'a> {
    /// Time of the scan, s.
    pub time_s: f64,
    /// The points of the scan.
    pub points: &'a [LanePoint],
    /// Of the radar over the ground, along x. None: taken from the points.
    pub speed_mps: Option<Measured>,
    /// With it, points whose level does not go with that of the row are taken out.
    pub expected_rcs_dbsm: Option<&'a ExpectedRcs<'a>>,
}

/// How far lines are taken to go on, m.
pub(super) const REACH_M: f64 = 40.0;

/// Stations along a line, and beyond its end, where it has markers: at the spacing that its members keep best.
pub(super) fn stations(scan: &Scan<'_>, line: &Line, patterns: &[MarkerOptions]) -> Vec<f64> {
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
