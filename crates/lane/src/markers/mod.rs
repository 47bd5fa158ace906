//! Lanes from rows of markers at a known spacing (Feng 2019, section 5.1). The steps are: points at rest,
//! points at the spacing less those that are denser, paths of little turn through them, curves through many
//! points, and a curve through each row.

pub mod estimator;
pub mod hough;
mod mirror;
mod options;
mod pattern;
mod rest;
mod row;
mod scan;
#[cfg(test)]
mod tests;

pub use estimator::{MarkerSearch, Markers};
pub use options::{MarkersOptions, from_json};
pub use pattern::{PatternPoint, dis_cluster, exact, paths, spaced};
pub use rest::{RadarMotion, at_rest, motion_from_rest, speed_from_rest};
pub use scan::{ExpectedRcs, MarkerPattern, Scan};
use scan::{REACH_M, stations};

use super::curve::Clothoid;
use super::track::meet;
use super::{LaneError, LaneEstimate, LanePoint, Line};
use glam::DVec2;

/// The method's name, as on the command line.
pub const METHOD: &str = "markers";

/// Intermediate results of one scan; all lists hold indices of points.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Steps {
    /// Motion of the radar over the ground; None where it is unknown.
    pub motion: Option<RadarMotion>,
    /// Points at rest and outside the ground clutter.
    pub at_rest: Vec<usize>,
    /// {p1}: points in groups at the spacing.
    pub grouped: Vec<usize>,
    /// {p2}: points in denser groups.
    pub dense: Vec<usize>,
    /// {p1} less {p2}, and of these the points that are still at the spacing.
    pub left: Vec<usize>,
    /// Paths through points at the markers' spacing.
    pub paths: Vec<Vec<usize>>,
    /// Rows that only the Hough transform found.
    pub by_hough: Vec<Vec<usize>>,
}

/// Estimates lines and lane from one scan.
pub fn estimate(scan: &Scan<'_>, options: &MarkerPattern) -> LaneEstimate {
    estimate_all(scan, std::slice::from_ref(options)).0
}

/// Estimates as [`estimate`] does, for rows of several spacings; the patterns may differ only in the spacing.
/// Also returns the intermediate results of the first pattern.
pub fn estimate_all(scan: &Scan<'_>, patterns: &[MarkerPattern]) -> (LaneEstimate, Steps) {
    let given = scan.points.len();
    let mut steps = Steps::default();
    let none = |why| LaneEstimate::none(METHOD, scan.time_s, given, why);
    let Some(first) = patterns.first() else {
        return (none(LaneError::NotGiven { what: "the spacing of the markers".into() }), steps);
    };
    if given == 0 {
        return (none(LaneError::Empty), steps);
    }
    let finite = |p: &LanePoint| {
        let all = [p.at_m[0], p.at_m[1], p.std_m[0], p.std_m[1], p.range_rate_mps, p.range_m, p.azimuth_rad];
        all.iter().chain([&p.range_rate_std_mps]).all(|x| x.is_finite() && x.abs() < 1e6)
    };
    let sound: Vec<usize> = (0..given).filter(|i| finite(&scan.points[*i])).collect();
    if sound.is_empty() {
        return (none(LaneError::NotFinite { points: given }), steps);
    }
    let some: Vec<LanePoint> = sound.iter().map(|i| scan.points[*i]).collect();
    let speed = scan.speed_mps.filter(|s| s.value.is_finite() && s.std.is_finite());
    let Some(motion) = motion_from_rest(&some, speed, first) else {
        return (none(LaneError::NoSpeed), steps);
    };
    steps.motion = Some(motion);
    let stands = at_rest(&some, &motion, first);
    let rest: Vec<usize> = sound.iter().zip(stands).filter(|(_, s)| *s).map(|(i, _)| *i).collect();
    if rest.is_empty() {
        return (none(LaneError::NothingAtRest), steps);
    }
    let rest = suppress_sidelobes(scan, &rest, first);
    let far: Vec<usize> =
        rest.iter().copied().filter(|i| scan.points[*i].range_m >= first.nearest_m).collect();
    steps.at_rest = far.clone();
    let doubted: Vec<LanePoint> = scan
        .points
        .iter()
        .map(|p| LanePoint {
            std_m: [p.std_m[0], p.std_m[1].hypot(first.azimuth_error_rad * p.range_m)],
            ..*p
        })
        .collect();
    let scan = &Scan { points: &doubted, ..*scan };
    let mut lines: Vec<Line> = Vec::new();
    for (k, options) in patterns.iter().enumerate() {
        lines.extend(rows(scan, &rest, &far, options, if k == 0 { Some(&mut steps) } else { None }));
    }
    let lines = without_between(scan, dedup(lines), patterns);
    let lines = unlike(mirror::without_images(scan, &rest, lines, patterns));
    if lines.is_empty() {
        return (none(LaneError::NoPattern { at_rest: far.len() }), steps);
    }
    (LaneEstimate::of_lines(METHOD, scan.time_s, given, lines), steps)
}

/// Sidelobe limits: the least level below a stronger echo (dB), and the largest distance from it (m and rad).
const SKIRT_DB: f64 = 8.0;
const SKIRT_M: f64 = 0.4;
const SKIRT_RAD: f64 = 0.03;

/// Removes points in the sidelobes of stronger ones: where a cell beside an echo's peak holds another echo
/// too, a method that finds two directions in it repeats the echo, weaker and less certain.
fn suppress_sidelobes(scan: &Scan<'_>, of: &[usize], options: &MarkerPattern) -> Vec<usize> {
    let skirt = |i: usize, j: usize| {
        let (p, q) = (&scan.points[i], &scan.points[j]);
        q.rcs_dbsm - p.rcs_dbsm > SKIRT_DB
            && (q.range_m - p.range_m).abs() < SKIRT_M
            && (q.azimuth_rad - p.azimuth_rad).abs() < SKIRT_RAD
            && (q.range_rate_mps - p.range_rate_mps).abs() < options.lobe_mps
    };
    of.iter().copied().filter(|i| !of.iter().any(|j| skirt(*i, *j))).collect()
}

/// Lines at one spacing among the points `far`. Their markers are taken from all points at rest, since a
/// line's course tells markers from the clutter next to the radar.
fn rows(
    scan: &Scan<'_>,
    rest: &[usize],
    far: &[usize],
    options: &MarkerPattern,
    steps: Option<&mut Steps>,
) -> Vec<Line> {
    let places: Vec<PatternPoint> = far.iter().map(|i| PatternPoint::of(&scan.points[*i])).collect();
    let candidates = spaced(&places, options);
    let on_paths: Vec<PatternPoint> = candidates.iter().map(|k| places[*k]).collect();
    let paths: Vec<Vec<usize>> = paths(&on_paths, options)
        .into_iter()
        .map(|path| path.into_iter().map(|k| far[candidates[k]]).collect())
        .collect();
    let (mut lines, mut taken): (Vec<Line>, Vec<usize>) = (Vec::new(), Vec::new());
    let take = |path: &[usize], lines: &mut Vec<Line>, taken: &mut Vec<usize>| {
        // A piece of a row that is found already.
        if path.iter().filter(|i| taken.contains(*i)).count() * 2 >= path.len() {
            return false;
        }
        let free: Vec<usize> = rest.iter().copied().filter(|i| !taken.contains(i)).collect();
        let new = row::line(scan, &free, path.to_vec(), options);
        let found = new.is_some();
        if let Some(new) = new {
            taken.extend(&new.members);
            lines.push(new);
        }
        found
    };
    for path in &paths {
        // The rest of a path that led from one row to another.
        if take(path, &mut lines, &mut taken) {
            let left: Vec<usize> = path.iter().copied().filter(|i| !taken.contains(i)).collect();
            if left.len() >= options.path_least {
                take(&left, &mut lines, &mut taken);
            }
        }
    }
    let mut by_hough = Vec::new();
    if options.hough {
        let free: Vec<usize> = far.iter().copied().filter(|i| !taken.contains(i)).collect();
        let free_points: Vec<PatternPoint> =
            free.iter().map(|i| PatternPoint::of(&scan.points[*i])).collect();
        for found in hough::rows(&free_points, options) {
            let path: Vec<usize> = found.members.iter().map(|k| free[*k]).collect();
            if take(&path, &mut lines, &mut taken) {
                by_hough.push(path);
            }
        }
    }
    if let Some(steps) = steps {
        let (d_ps, d_pt) = (options.spacing_m, options.tolerance_m);
        let half = 0.5 * (d_ps - d_pt);
        let flat = |groups: Vec<Vec<usize>>| {
            let mut all: Vec<usize> = groups.into_iter().flatten().map(|k| far[k]).collect();
            all.sort_unstable();
            all
        };
        steps.grouped = flat(dis_cluster(&places, d_ps, d_pt, options.least));
        steps.dense = flat(dis_cluster(&places, half, half, options.least));
        steps.left = candidates.iter().map(|k| far[*k]).collect();
        (steps.paths, steps.by_hough) = (paths, by_hough);
    }
    lines
}

/// Keeps the line with more points of lines that share half of the smaller one's points.
fn dedup(mut lines: Vec<Line>) -> Vec<Line> {
    lines.sort_by_key(|l| std::cmp::Reverse(l.members.len()));
    let mut out: Vec<Line> = Vec::new();
    for l in lines {
        let shares =
            |o: &Line| l.members.iter().filter(|i| o.members.contains(*i)).count() * 2 >= l.members.len();
        if !out.iter().any(shares) {
            out.push(l);
        }
    }
    out
}

/// Largest difference in range of two markers in one cell, m.
const ONE_CELL_M: f64 = 0.2;

/// Removes lines whose points are unresolved pairs: where two other lines have, or would have when extended,
/// a marker each at the point's range, one on each side of it, the point is both of them.
fn without_between(scan: &Scan<'_>, lines: Vec<Line>, patterns: &[MarkerPattern]) -> Vec<Line> {
    // Each line extended ahead, and its markers' positions.
    let ahead: Vec<(Clothoid, Vec<DVec2>)> = lines
        .iter()
        .map(|l| {
            let curve = l.fitted.curve.extended(0.0, REACH_M);
            let markers = stations(scan, l, patterns).into_iter().map(|s| curve.at(s).at_m).collect();
            (curve, markers)
        })
        .collect();
    let between = |k: usize| {
        let members = &lines[k].members;
        let pair = |i: &&usize| {
            let p = &scan.points[**i];
            let radar = DVec2::from_array(p.at_m) - DVec2::from_angle(p.azimuth_rad) * p.range_m;
            let (mut left, mut right) = (false, false);
            for (_, (curve, markers)) in ahead.iter().enumerate().filter(|(j, _)| *j != k) {
                let foot = curve.foot(DVec2::from_array(p.at_m));
                if foot.left_m.abs() > MOST_APART_M {
                    continue;
                }
                let near = markers.iter().any(|m| (m.distance(radar) - p.range_m).abs() < ONE_CELL_M);
                if near {
                    left |= foot.left_m < 0.0;
                    right |= foot.left_m > 0.0;
                }
            }
            left && right
        };
        members.iter().filter(pair).count() * 2 > members.len()
    };
    let drop: Vec<bool> = (0..lines.len()).map(between).collect();
    lines.into_iter().zip(drop).filter(|(_, d)| !d).map(|(l, _)| l).collect()
}

/// Largest distance from a point of a line of its pair, m.
const MOST_APART_M: f64 = 8.0;

/// Keeps the line with more points of lines that meet: rows do not cross.
fn unlike(lines: Vec<Line>) -> Vec<Line> {
    let mut out: Vec<Line> = Vec::new();
    for l in lines {
        if !out.iter().any(|o| meet(&l.fitted.curve, &o.fitted.curve, SAME_M)) {
            out.push(l);
        }
    }
    out
}

/// Distance within which two lines are the same, m.
const SAME_M: f64 = 0.5;
