//! A row of markers as a line: the curve through a path, without outliers, with the markers that crowds had
//! hidden.

use super::pattern::PatternPoint;
use super::scan::{MarkerPattern, Scan};
use crate::curve::{Fitted, Shape, fit, fit_simplest};
use crate::numeric::median;
use crate::robust::{WEIGHINGS, at_first, robust, weighed};
use crate::{LanePoint, Line};
use glam::DVec2;
use std::f64::consts::TAU;

/// Uncertainty of a marker's position, m: the echo comes from somewhere on the marker, which was not laid to
/// the millimetre.
const PLACE_M: f64 = 0.02;

/// Standard deviation of a point across a direction, m.
fn across_m(p: &LanePoint, direction: DVec2) -> f64 {
    PatternPoint::of(p).along_m(direction.perp()).hypot(PLACE_M)
}

/// Positions of points in their order, and their standard deviations across the curve through them.
fn across(scan: &Scan<'_>, members: &[usize]) -> (Vec<DVec2>, Vec<f64>) {
    let places: Vec<DVec2> = members.iter().map(|i| DVec2::from_array(scan.points[*i].at_m)).collect();
    let n = places.len();
    let std = (0..n)
        .map(|k| {
            let (a, b) = (k.saturating_sub(2), (k + 2).min(n - 1));
            across_m(&scan.points[members[k]], (places[b] - places[a]).normalize_or(DVec2::X))
        })
        .collect();
    (places, std)
}

/// Fits a curve to the points of a growing row, of the simplest shape that they support or of the given one.
/// Points beside what the others agree on have little weight: cells that hold several echoes give directions
/// with errors beyond the noise.
fn growing(scan: &Scan<'_>, members: &[usize], shape: Option<Shape>) -> Option<Fitted> {
    let (places, std) = across(scan, members);
    let first = at_first(&std);
    let fitted = match shape {
        Some(shape) => fit(&places, &first, shape),
        None => fit_simplest(&places, &first, WHILE_GROWING),
    }?;
    Some(weighed(fitted, &places, &std))
}

/// Members of a path that lie on one curve, and the curve. The fit starts from a few consecutive ones, those
/// next to the radar first as the most certain, and goes on outwards: far markers of two unresolved rows
/// appear between the rows, and a path may lead from a row to them.
fn agreeing(scan: &Scan<'_>, path: &[usize], options: &MarkerPattern) -> Option<(Vec<usize>, Fitted)> {
    let n = path.len();
    let seed = options.path_least.min(n).max(3);
    let place = |i: usize| DVec2::from_array(scan.points[i].at_m);
    let mut best: Option<(Vec<usize>, Fitted)> = None;
    // Straight unless the few show a bend, and bent where most of the path then lies beside it: five markers
    // show no bend that 0.08 m would hide.
    let begins = [0, n / 3, 2 * n / 3].map(|b| b.min(n - seed.min(n)));
    for (begin, shape) in begins.iter().flat_map(|b| [(*b, None), (*b, Some(Shape::Arc))]) {
        let mut taken: Vec<usize> = (begin..(begin + seed).min(n)).collect();
        let fit_of = |taken: &[usize]| {
            let members: Vec<usize> = taken.iter().map(|k| path[*k]).collect();
            growing(scan, &members, None)
        };
        let few: Vec<usize> = taken.iter().map(|k| path[*k]).collect();
        let Some(mut fitted) = growing(scan, &few, shape) else { continue };
        let on = |f: &Fitted, k: usize| {
            // In a bend the next marker stands on the curve, not on its tangent.
            let more = 2.5 * options.spacing_m;
            let curve = f.curve.extended(more, more);
            let foot = curve.foot(place(path[k]));
            let direction = DVec2::from_angle(curve.at(foot.s_m).heading_rad);
            let std = across_m(&scan.points[path[k]], direction).hypot(f.lateral_std_m(foot.s_m - more));
            foot.left_m.abs() <= options.sigmas * std
        };
        taken.retain(|k| on(&fitted, *k));
        let ahead = (begin + seed..n).collect::<Vec<_>>();
        let behind = (0..begin).rev().collect::<Vec<_>>();
        let mut new = 0;
        for k in ahead.into_iter().chain(behind) {
            if !on(&fitted, k) {
                continue;
            }
            taken.push(k);
            new += 1;
            if new == REFIT {
                taken.sort_unstable();
                fitted = fit_of(&taken).unwrap_or(fitted);
                new = 0;
            }
        }
        taken.sort_unstable();
        if taken.len() < 3 {
            continue;
        }
        let Some(fitted) = fit_of(&taken) else { continue };
        let enough = taken.len() * 2 >= n;
        if best.as_ref().is_none_or(|b| taken.len() > b.0.len()) {
            best = Some((taken.into_iter().map(|k| path[k]).collect(), fitted));
        }
        if enough {
            break;
        }
    }
    best
}

/// Number of new members after which the curve is fitted again.
const REFIT: usize = 2;

/// The line of a path: fitted, without points off it or of another level, with the markers that crowds had
/// hidden.
pub(super) fn line(
    scan: &Scan<'_>,
    rest: &[usize],
    mut members: Vec<usize>,
    options: &MarkerPattern,
) -> Option<Line> {
    // Order the members away from the radar.
    let range = |i: usize| scan.points[i].range_m;
    if range(*members.first()?) > range(*members.last()?) {
        members.reverse();
    }
    let place = |i: usize| DVec2::from_array(scan.points[i].at_m);
    let (mut members, mut fitted) = agreeing(scan, &members, options)?;
    for _ in 0..ROUNDS {
        let mut more = hidden(scan, rest, &members, &fitted, STEPS_ON, options);
        if more.is_empty() {
            // Over a gap, unless more of the row would then be missing than may be.
            more = hidden(scan, rest, &members, &fitted, options.gap as f64 + 0.5, options);
            let all: Vec<f64> =
                members.iter().chain(&more).map(|i| fitted.curve.foot(place(*i)).s_m).collect();
            if more.is_empty() || fullness(&all, options) < LEAST_FULL {
                break;
            }
        }
        members.extend(more);
        let at: Vec<f64> = members.iter().map(|i| fitted.curve.foot(place(*i)).s_m).collect();
        let mut order: Vec<usize> = (0..members.len()).collect();
        order.sort_by(|a, b| at[*a].total_cmp(&at[*b]));
        members = order.into_iter().map(|k| members[k]).collect();
        fitted = growing(scan, &members, None)?;
    }
    let at = |i: usize| fitted.curve.foot(place(i)).s_m;
    let mut level = 1.0;
    if let Some(expected) = scan.expected_rcs_dbsm {
        let heading = |i: usize| fitted.curve.at(at(i)).heading_rad;
        let over: Vec<f64> = members
            .iter()
            .map(|i| scan.points[*i].rcs_dbsm - expected(&scan.points[*i], heading(*i)))
            .collect();
        // Water or dirt weakens a whole row alike, so only differences count.
        let middle = median(over.iter().copied().filter(|x| x.is_finite()).collect())?;
        let before = members.len();
        let mut k = 0;
        members.retain(|_| {
            k += 1;
            (over[k - 1] - middle).abs() <= LEVEL_DB
        });
        level = members.len() as f64 / before as f64;
        if members.len() < options.path_least {
            return None;
        }
    }
    let (places, std) = across(scan, &members);
    fitted = robust(&places, &std, IN_THE_END, WEIGHINGS)?;
    // Each further parameter of the curve needs one more point.
    if members.len() < options.path_least + fitted.shape.parameters() - 2 {
        return None;
    }
    let at: Vec<f64> = members.iter().map(|i| fitted.curve.foot(place(*i)).s_m).collect();
    let full = fullness(&at, options);
    let levels: Vec<f64> = members.iter().map(|i| scan.points[*i].rcs_dbsm).collect();
    let few = members.len() < options.path_least || full < LEAST_FULL;
    if few || every_second(&at, &levels, options) || unlike(&at, &levels) {
        return None;
    }
    // Each marker beyond the least lowers the chance of coincidence by the share of places within the
    // tolerance.
    let by_chance =
        (2.0 * options.tolerance_m / options.spacing_m).powi((members.len() + 2 - options.path_least) as i32);
    Some(Line { confidence: (full * level * (1.0 - by_chance)).clamp(0.0, 1.0), fitted, members })
}

/// Least decrease of the sum of squares for a further parameter of the curve. It is larger while a row grows,
/// as a bend that noise feigns leads away from the next marker.
const WHILE_GROWING: f64 = 25.0;
const IN_THE_END: f64 = 12.0;
/// Least share of the markers of a row of this length that must be seen.
const LEAST_FULL: f64 = 0.6;
/// Number of searches for hidden markers, and the number of spacings beyond the known ends that each covers.
const ROUNDS: usize = 12;
const STEPS_ON: f64 = 2.5;

/// Share of the markers between the first and the last of these places that are there.
fn fullness(at_m: &[f64], options: &MarkerPattern) -> f64 {
    let (first, last) =
        at_m.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), s| (a.min(*s), b.max(*s)));
    (at_m.len() as f64 / (((last - first) / options.spacing_m).round() + 1.0)).min(1.0)
}

/// Phase of the markers along the row, m, modulo the spacing.
fn phase_m(at_m: &[f64], spacing_m: f64) -> f64 {
    let turns: DVec2 = at_m.iter().map(|s| DVec2::from_angle(TAU * s / spacing_m)).sum();
    turns.to_angle() / TAU * spacing_m
}

/// Whether hardly anything, or something of another kind, stands at every other place: posts at twice the
/// spacing, with stray points between them.
fn every_second(at_m: &[f64], levels: &[f64], options: &MarkerPattern) -> bool {
    let phase = phase_m(at_m, options.spacing_m);
    let place = |s: f64| ((s - phase) / options.spacing_m).round().rem_euclid(2.0);
    let of = |odd: f64| -> Vec<f64> {
        at_m.iter().zip(levels).filter(|(s, _)| place(**s) == odd).map(|(_, l)| *l).collect()
    };
    let (even, odd) = (of(0.0), of(1.0));
    let few = even.len().min(odd.len()) * FEW_BETWEEN < even.len().max(odd.len());
    few || median(even).zip(median(odd)).is_some_and(|(a, b)| (a - b).abs() > LEVEL_DB)
}

/// Markers missed by chance leave at least one in so many at every other place.
const FEW_BETWEEN: usize = 3;

/// Whether levels jump between most neighbours: the road weakens a row over many markers, while chance mixes
/// levels.
fn unlike(at_m: &[f64], levels: &[f64]) -> bool {
    let mut along: Vec<(f64, f64)> = at_m.iter().copied().zip(levels.iter().copied()).collect();
    along.sort_by(|a, b| a.0.total_cmp(&b.0));
    median(along.windows(2).map(|w| (w[1].1 - w[0].1).abs()).collect()).is_some_and(|m| m > LEVEL_DB)
}

/// Stationary points that stand where the row predicts a marker and are not among its members: those beside a
/// car are dense and were left out, those far away were lost to noise.
fn hidden(
    scan: &Scan<'_>,
    rest: &[usize],
    members: &[usize],
    fitted: &Fitted,
    steps_on: f64,
    options: &MarkerPattern,
) -> Vec<usize> {
    let d_ps = options.spacing_m;
    // In a bend the next marker stands on the curve, not on its tangent.
    let more = steps_on * d_ps;
    let curve = fitted.curve.extended(more, more);
    let foot = |i: usize| curve.foot(DVec2::from_array(scan.points[i].at_m));
    let mut taken: Vec<f64> = members.iter().map(|i| foot(*i).s_m).collect();
    let phase = phase_m(&taken, d_ps);
    let (first, last) = taken.iter().fold((f64::INFINITY, 0.0f64), |(a, b), s| (a.min(*s), b.max(*s)));
    let mut near: Vec<(f64, usize, f64)> = Vec::new();
    for &i in rest.iter().filter(|i| !members.contains(i)) {
        let f = foot(i);
        if !(first - more..last + more).contains(&f.s_m) {
            continue;
        }
        let direction = DVec2::from_angle(curve.at(f.s_m).heading_rad);
        let p = &scan.points[i];
        let across = f.left_m.abs() / across_m(p, direction).hypot(fitted.lateral_std_m(f.s_m - more));
        let off = (f.s_m - phase) / d_ps;
        let off_m = (off - off.round()).abs() * d_ps;
        let along = off_m / options.tolerance_m.hypot(2.0 * PatternPoint::of(p).along_m(direction));
        if across <= 3.0 && along < 1.0 && f.left_m.abs() < 0.5 * d_ps {
            near.push((across.hypot(along), i, f.s_m));
        }
    }
    // The best point at each place.
    near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut out = Vec::new();
    for (_, i, s) in near {
        if taken.iter().all(|t| (t - s).abs() > 0.5 * d_ps) {
            taken.push(s);
            out.push(i);
        }
    }
    out
}

/// Largest difference between the level of a marker and its expected level, dB: fading over the road and
/// scalloping.
const LEVEL_DB: f64 = 8.0;
