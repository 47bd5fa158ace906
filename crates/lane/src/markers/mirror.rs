//! Rows that are reflections of other rows in a wall, recognised by their positions alone: the wall shows by
//! what stands along it.

use super::pattern::PatternPoint;
use super::scan::{MarkerPattern, Scan, stations};
use crate::Line;
use crate::curve::Clothoid;
use crate::numeric::median;
use glam::DVec2;

/// Largest distance of things along a wall before or behind its face, m: posts, joints, flanges.
const FACE_M: f64 = 0.5;
/// Largest spacing of things along a wall, m: posts of rails and sound walls are 4 to 5 m apart.
const APART_M: f64 = 5.0;
/// Least level of a wall's echoes above its mirror images of markers, dB.
const STRONGER_DB: f64 = 10.0;
/// Number of bisection steps that find the wall.
const HALVINGS: usize = 40;

/// The mirror between the radar and `image` that would reflect something on the curve `row` to there, if it
/// stands along the row: its distance to the left of the row, the position along the row where it is met, and
/// the place that is mirrored.
pub(super) struct Mirrored {
    pub left_m: f64,
    pub s_m: f64,
    pub place: DVec2,
}

/// Finds the mirror for an image. A radar sees the image where a ray that the wall deflects would have gone
/// straight on: the wall's tangent where the ray meets it mirrors the one to the other, in bends too.
pub(super) fn mirrored(row: &Clothoid, radar: DVec2, image: DVec2) -> Option<Mirrored> {
    let at = |t: f64| {
        let met = radar.lerp(image, t);
        let foot = row.foot(met);
        let wall = DVec2::from_angle(row.at(foot.s_m).heading_rad);
        let d = image - met;
        let place = met + wall * (2.0 * d.dot(wall)) - d;
        let off = row.foot(place).left_m;
        (off, Mirrored { left_m: foot.left_m, s_m: foot.s_m, place })
    };
    let side = row.foot(image).left_m.signum();
    // Next to the image the mirrored place is the image itself; next to the radar it is beyond the row.
    let (mut near, mut far) = (0.0, 1.0);
    if at(near).0 * side >= 0.0 {
        return None;
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (near + far);
        if at(middle).0 * side < 0.0 { near = middle } else { far = middle }
    }
    // Radar and row stand on the same side of the wall, the image behind it.
    let met = at(0.5 * (near + far)).1;
    let beyond = |left_m: f64| (left_m - met.left_m) * met.left_m > 0.0;
    (beyond(row.foot(image).left_m) && !beyond(row.foot(radar).left_m)).then_some(met)
}

/// Removes rows that are images of nearer ones: rows most of whose points, mirrored at a wall, fall on
/// markers of the other row, where things stand along that wall which are stronger than the row. A row of
/// markers is no wall: its echoes are as weak as the next row's.
pub(super) fn without_images(
    scan: &Scan<'_>,
    rest: &[usize],
    lines: Vec<Line>,
    patterns: &[MarkerPattern],
) -> Vec<Line> {
    let place = |i: usize| DVec2::from_array(scan.points[i].at_m);
    let image_of = |image: &Line, row: &Line| {
        // A row goes on beyond its ends: images of markers that are missed in the row itself are still seen.
        let curve = row.fitted.curve.extended(BEYOND_M, BEYOND_M);
        let markers: Vec<f64> = stations(scan, row, patterns);
        let Some(step) = markers.get(1).map(|second| second - markers[0]) else { return false };
        let phase = markers[0] + BEYOND_M;
        let tolerance_m = patterns.iter().map(|o| o.tolerance_m).fold(0.0, f64::max);
        let levels = image.members.iter().map(|i| scan.points[*i].rcs_dbsm).collect();
        let Some(level) = median(levels) else { return false };
        // Points along the row that may be a wall.
        let walls: Vec<(f64, f64)> = rest
            .iter()
            .filter(|i| scan.points[**i].rcs_dbsm > level + STRONGER_DB)
            .map(|i| curve.foot(place(*i)))
            .map(|f| (f.s_m, f.left_m))
            .collect();
        let like = |i: &&usize| {
            let p = &scan.points[**i];
            let radar = place(**i) - DVec2::from_angle(p.azimuth_rad) * p.range_m;
            let Some(m) = mirrored(&curve, radar, place(**i)) else { return false };
            let shown = |w: &&(f64, f64)| (w.0 - m.s_m).abs() < APART_M && (w.1 - m.left_m).abs() < FACE_M;
            let s = curve.foot(m.place).s_m;
            let off = (s - phase) / step;
            let off_m = (off - off.round()).abs() * step;
            let along = DVec2::from_angle(curve.at(s).heading_rad);
            off_m < tolerance_m.hypot(2.0 * PatternPoint::of(p).along_m(along))
                && walls.iter().filter(shown).count() >= 1
        };
        image.members.iter().filter(like).count() * 2 > image.members.len()
    };
    let nearest = |l: &Line| l.fitted.curve.foot(DVec2::ZERO).left_m.abs();
    let drop: Vec<bool> = lines
        .iter()
        .map(|l| lines.iter().any(|o| !std::ptr::eq(o, l) && nearest(o) < nearest(l) && image_of(l, o)))
        .collect();
    lines.into_iter().zip(drop).filter(|(_, d)| !d).map(|(l, _)| l).collect()
}

/// Distance by which rows are extended beyond their ends, m.
const BEYOND_M: f64 = 30.0;
