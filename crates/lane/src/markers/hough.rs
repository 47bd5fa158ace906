//! Rows with missing markers: lines, circles and parabolas through many points, by a Hough transform (Feng
//! 2019, section 5.1.3 and table 5.1), and among those points the ones at the markers' spacing along the
//! curve.
//!
//! Points vote in pairs (lines) and triples (circles, parabolas) that may be markers of one row, so that the
//! vote space stays small whatever the number of parameters (Xu, Oja and Kultanen, Pattern Recognition
//! Letters 11, 331, 1990; all sets in place of random ones).

use super::pattern::{PatternPoint, turn};
use super::scan::MarkerPattern;
use glam::DVec2;
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

/// A curve of table 5.1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Curve {
    /// The line x cos(angle) + y sin(angle) = distance.
    Line {
        /// Direction of the line's normal, rad.
        angle_rad: f64,
        /// Distance of the line from the origin, m.
        distance_m: f64,
    },
    /// A circle.
    Circle {
        /// Centre of the circle, m.
        centre_m: [f64; 2],
        /// Radius of the circle, m.
        radius_m: f64,
    },
    /// The parabola y² = 4 r x in axes turned by the angle, with the vertex as origin.
    Parabola {
        /// Vertex of the parabola, m.
        vertex_m: [f64; 2],
        /// Focal length r, m.
        focal_m: f64,
        /// Direction in which the parabola opens, rad.
        angle_rad: f64,
    },
}

impl Curve {
    /// Position along the curve and distance from it, both in m.
    pub fn place(&self, p: DVec2) -> (f64, f64) {
        match *self {
            Curve::Line { angle_rad, distance_m } => {
                let normal = DVec2::from_angle(angle_rad);
                (normal.perp().dot(p), (normal.dot(p) - distance_m).abs())
            }
            Curve::Circle { centre_m, radius_m } => {
                // Angles jump on the far side of the circle, seen from the direction of the origin.
                let centre = DVec2::from_array(centre_m);
                let d = p - centre;
                let cut = (centre.to_angle() + 0.5 * PI).rem_euclid(TAU);
                ((d.to_angle() - cut).rem_euclid(TAU) * radius_m, (d.length() - radius_m).abs())
            }
            Curve::Parabola { vertex_m, focal_m, angle_rad } => {
                let d = DVec2::from_angle(-angle_rad).rotate(p - DVec2::from_array(vertex_m));
                // Arc length from the vertex, and the distance to first order.
                let (a, y) = (0.25 / focal_m, d.y);
                let slope = 2.0 * a * y;
                let length = 0.5 * y * (1.0 + slope * slope).sqrt() + 0.25 / a * slope.asinh();
                (length, (d.x - a * y * y).abs() / (1.0 + slope * slope).sqrt())
            }
        }
    }

    fn parameters(&self) -> usize {
        match self {
            Curve::Line { .. } => 2,
            Curve::Circle { .. } => 3,
            Curve::Parabola { .. } => 4,
        }
    }
}

/// Least distance within which points lie on a curve, m; two standard deviations are added.
const WITHIN_M: f64 = 0.15;
/// Largest number of spacings between neighbours in a row: adjacent missing markers plus one.
const MOST_GAP: usize = 3;
/// Range of radii of circles, and of parabolas at their vertex, m.
const RADIUS_M: std::ops::Range<f64> = 6.0..300.0;

/// A row found: the curve and the points on it.
#[derive(Debug, Clone, PartialEq)]
pub struct MarkerRow {
    /// The curve that the points lie on.
    pub curve: Curve,
    /// Indices of the points, in their order along the curve.
    pub members: Vec<usize>,
}

/// Largest number of point sets that vote: a bound for crowds.
const MOST_SETS: usize = 6_000;
/// Number of cells of each kind of curve that are examined, those with most votes.
const LOOKED_AT: usize = 6;
/// Number of points that a further parameter has to bring.
const MORE_POINTS: usize = 2;
/// Number of directions of a parabola's axis that are tried.
const AXES: usize = 6;
/// Largest number of rows.
const MOST_ROWS: usize = 8;

/// A cell of the vote space: the number of votes and the sum of their parameters.
struct Cell {
    votes: u32,
    sum: [f64; 4],
}

/// Finds rows among the points, the one with most points first; each point belongs to one row at most.
pub fn rows(points: &[PatternPoint], options: &MarkerPattern) -> Vec<MarkerRow> {
    let mut free: Vec<usize> = (0..points.len()).collect();
    let mut out = Vec::new();
    while free.len() >= options.path_least && out.len() < MOST_ROWS {
        let Some(best) = best(points, &free, options) else { break };
        free.retain(|i| !best.members.contains(i));
        out.push(best);
    }
    out
}

fn best(points: &[PatternPoint], free: &[usize], options: &MarkerPattern) -> Option<MarkerRow> {
    let beside = beside(points, free, options);
    let mut found: Option<(usize, MarkerRow)> = None;
    for curve in candidates(points, free, &beside) {
        let members = members(points, free, &curve, options);
        // Simpler curves first.
        let worth = (members.len() + 2 * MORE_POINTS).saturating_sub(MORE_POINTS * (curve.parameters() - 2));
        if members.len() >= options.path_least && found.as_ref().is_none_or(|f| worth > f.0) {
            found = Some((worth, MarkerRow { curve, members }));
        }
    }
    found.map(|f| f.1)
}

/// For each free point (by its index in `free`) those a whole number of spacings away.
fn beside(points: &[PatternPoint], free: &[usize], options: &MarkerPattern) -> Vec<Vec<usize>> {
    let off = |a: &PatternPoint, b: &PatternPoint| {
        let step = b.at_m - a.at_m;
        let steps = step.length() / options.spacing_m;
        let direction = step.normalize_or(DVec2::X);
        let noise = 2.0 * a.along_m(direction).hypot(b.along_m(direction));
        let whole = steps.round();
        let fits = (steps - whole).abs() * options.spacing_m
            < options.tolerance_m.hypot(noise).min(0.3 * options.spacing_m);
        whole >= 1.0 && whole <= options.gap.min(MOST_GAP) as f64 && fits
    };
    free.iter()
        .enumerate()
        .map(|(k, i)| (0..free.len()).filter(|l| *l != k && off(&points[*i], &points[free[*l]])).collect())
        .collect()
}

fn candidates(points: &[PatternPoint], free: &[usize], beside: &[Vec<usize>]) -> Vec<Curve> {
    let at = |k: usize| points[free[k]].at_m;
    let [mut lines, mut circles, mut parabolas]: [BTreeMap<[i32; 4], Cell>; 3] = Default::default();
    let vote = |cells: &mut BTreeMap<[i32; 4], Cell>, key: [f64; 4], value: [f64; 4]| {
        let cell = cells.entry(key.map(|x| x.round() as i32)).or_insert(Cell { votes: 0, sum: [0.0; 4] });
        cell.votes += 1;
        cell.sum.iter_mut().zip(value).for_each(|(s, v)| *s += v);
    };
    let (mut pairs, mut triples) = (0, 0);
    for k in 0..free.len() {
        for &l in beside[k].iter() {
            if l > k && pairs < MOST_SETS {
                pairs += 1;
                let along = at(l) - at(k);
                let mut angle = (along.to_angle() + 0.5 * PI).rem_euclid(TAU);
                let mut distance = DVec2::from_angle(angle).dot(at(k));
                if distance < 0.0 {
                    (angle, distance) = ((angle + PI).rem_euclid(TAU), -distance);
                }
                vote(
                    &mut lines,
                    [angle / LINE_RAD, distance / CELL_M, 0.0, 0.0],
                    [angle, distance, 0.0, 0.0],
                );
            }
            for &m in beside[l].iter() {
                // Each triple once, with little turn in the middle.
                if m <= k || triples >= MOST_SETS {
                    continue;
                }
                let (a, b, c) = (at(k), at(l), at(m));
                if turn(b - a, c - b).abs() > MOST_TURN_RAD {
                    continue;
                }
                triples += 1;
                if let Some((centre, radius)) = circle(a, b, c)
                    && RADIUS_M.contains(&radius)
                {
                    // A large circle shows its curvature, not its centre.
                    let key = [centre.to_angle() / 0.1, centre.length().ln() / 0.1, radius.ln() / 0.1, 0.0];
                    vote(&mut circles, key, [centre.x, centre.y, radius, 0.0]);
                }
                for axis in 0..AXES {
                    let angle = TAU * axis as f64 / AXES as f64;
                    if let Some((vertex, focal)) = parabola(a, b, c, angle)
                        && RADIUS_M.contains(&(2.0 * focal))
                    {
                        let key = [vertex.x, vertex.y, focal.ln() / 0.2, axis as f64];
                        vote(&mut parabolas, key, [vertex.x, vertex.y, focal, angle]);
                    }
                }
            }
        }
    }
    let mut out = Vec::new();
    let top = |cells: BTreeMap<[i32; 4], Cell>| -> Vec<[f64; 4]> {
        let mut all: Vec<([i32; 4], Cell)> = cells.into_iter().filter(|(_, c)| c.votes >= 3).collect();
        all.sort_by_key(|(key, c)| (std::cmp::Reverse(c.votes), *key));
        all.truncate(LOOKED_AT);
        all.into_iter().map(|(_, c)| c.sum.map(|s| s / f64::from(c.votes))).collect()
    };
    out.extend(top(lines).into_iter().map(|v| Curve::Line { angle_rad: v[0], distance_m: v[1] }));
    out.extend(top(circles).into_iter().map(|v| Curve::Circle { centre_m: [v[0], v[1]], radius_m: v[2] }));
    out.extend(top(parabolas).into_iter().map(|v| Curve::Parabola {
        vertex_m: [v[0], v[1]],
        focal_m: v[2],
        angle_rad: v[3],
    }));
    out
}

/// Sizes of the cells of lines.
const LINE_RAD: f64 = 0.035;
const CELL_M: f64 = 0.3;
/// Largest turn from one step of a row to the next, rad, gaps included.
const MOST_TURN_RAD: f64 = 0.7;

/// The circle through three points.
fn circle(a: DVec2, b: DVec2, c: DVec2) -> Option<(DVec2, f64)> {
    let (p, q) = (b - a, c - a);
    let d = 2.0 * p.perp_dot(q);
    if d.abs() < 1e-6 {
        return None;
    }
    let u = DVec2::new(
        q.y * p.length_squared() - p.y * q.length_squared(),
        p.x * q.length_squared() - q.x * p.length_squared(),
    ) / d;
    Some((a + u, u.length()))
}

/// The parabola through three points that opens along `angle_rad`: its vertex and focal length.
fn parabola(a: DVec2, b: DVec2, c: DVec2, angle_rad: f64) -> Option<(DVec2, f64)> {
    let back = DVec2::from_angle(-angle_rad);
    let [a, b, c] = [a, b, c].map(|p| back.rotate(p));
    let d = (a.y - b.y) * (a.y - c.y) * (b.y - c.y);
    if d.abs() < 1e-6 {
        return None;
    }
    // x = s y² + t y + u
    let s = (c.y * (b.x - a.x) + b.y * (a.x - c.x) + a.y * (c.x - b.x)) / d;
    let t = (c.y * c.y * (a.x - b.x) + b.y * b.y * (c.x - a.x) + a.y * a.y * (b.x - c.x)) / d;
    if s <= 1e-6 {
        return None;
    }
    let y = -0.5 * t / s;
    let x = a.x + s * (y * y - a.y * a.y) + t * (y - a.y);
    Some((DVec2::from_angle(angle_rad).rotate(DVec2::new(x, y)), 0.25 / s))
}

/// The free points on a curve that stand at the spacing along it: at each place the nearest point, and of the
/// stretches between gaps the longest.
fn members(points: &[PatternPoint], free: &[usize], curve: &Curve, options: &MarkerPattern) -> Vec<usize> {
    let d = options.spacing_m;
    let mut on: Vec<(f64, f64, usize, f64)> = free
        .iter()
        .filter_map(|i| {
            let p = &points[*i];
            let (s, off) = curve.place(p.at_m);
            let (ahead, across) = curve_axes(curve, p.at_m);
            let within = WITHIN_M.hypot(2.0 * p.along_m(across)).min(0.4 * d);
            let slack = options.tolerance_m.hypot(2.0 * p.along_m(ahead)).min(0.3 * d);
            (off < within && s.is_finite()).then_some((s, off, *i, slack))
        })
        .collect();
    on.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));
    if on.len() < options.path_least {
        return Vec::new();
    }
    // A relative error of the length along the curve shifts far markers: phases are those of a stretch around
    // each point.
    let mut best: Vec<usize> = Vec::new();
    for (begin, _, first, _) in &on {
        let mut row = vec![*first];
        let mut last = *begin;
        loop {
            let step = |s: f64| (s - last) / d;
            let next = on
                .iter()
                .filter(|(s, _, i, slack)| {
                    let n = step(*s).round();
                    n >= 1.0
                        && n <= options.gap.min(MOST_GAP) as f64
                        && (step(*s) - n).abs() * d < *slack
                        && !row.contains(i)
                })
                .min_by(|a, b| step(a.0).round().total_cmp(&step(b.0).round()).then(a.1.total_cmp(&b.1)));
            let Some((s, _, i, _)) = next else { break };
            row.push(*i);
            last = *s;
        }
        if row.len() > best.len() {
            best = row;
        }
    }
    best
}

/// Directions along and across a curve near a point.
fn curve_axes(curve: &Curve, p: DVec2) -> (DVec2, DVec2) {
    let across = match *curve {
        Curve::Line { angle_rad, .. } => DVec2::from_angle(angle_rad),
        Curve::Circle { centre_m, .. } => (p - DVec2::from_array(centre_m)).normalize_or(DVec2::X),
        Curve::Parabola { vertex_m, focal_m, angle_rad } => {
            let d = DVec2::from_angle(-angle_rad).rotate(p - DVec2::from_array(vertex_m));
            DVec2::from_angle(angle_rad).rotate(DVec2::new(1.0, -0.5 * d.y / focal_m)).normalize_or(DVec2::X)
        }
    };
    (across.perp(), across)
}

#[cfg(test)]
mod tests {
    use super::super::exact;
    use super::*;

    fn options() -> MarkerPattern {
        MarkerPattern::default()
    }

    /// Every other marker is there: no two stand at the spacing, so no path has a step.
    #[test]
    fn a_line_with_every_other_marker_missing_is_found() {
        let points: Vec<DVec2> =
            (0..8).map(|k| DVec2::new(6.0 + 4.0 * f64::from(k), 1.5 + 0.02 * f64::from(k))).collect();
        let found = rows(&exact(&points), &options());
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].members.len(), 8);
        assert!(matches!(found[0].curve, Curve::Line { .. }), "{found:?}");
    }

    #[test]
    fn circles_and_parabolas_are_told_by_their_shape() {
        let centre = DVec2::new(6.0, 10.0);
        let points: Vec<DVec2> = (0..14)
            .filter(|k| k % 4 != 2)
            .map(|k| centre + DVec2::from_angle(f64::from(k) * 0.2 - 1.57) * 10.0)
            .collect();
        let found = rows(&exact(&points), &options());
        let Some(MarkerRow { curve: Curve::Circle { centre_m, radius_m }, members }) = found.first() else {
            panic!("{found:?}")
        };
        assert!((radius_m - 10.0).abs() < 0.2 && DVec2::from_array(*centre_m).distance(centre) < 0.3);
        assert!(members.len() >= 10, "{members:?}");
        // y² = 4 r x, markers at the spacing along it.
        let focal = 6.0;
        let truth = Curve::Parabola { vertex_m: [8.0, 0.0], focal_m: focal, angle_rad: 0.0 };
        let mut points = Vec::new();
        let mut due = -11.0;
        for i in -2000..2000 {
            let y = f64::from(i) * 0.01;
            let p = DVec2::new(8.0 + y * y / (4.0 * focal), y);
            if truth.place(p).0 >= due && due < 12.0 {
                points.push(p);
                due += 2.0;
            }
        }
        assert!(points.len() == 12);
        let found = rows(&exact(&points), &options());
        assert!(found[0].members.len() >= 10, "{} of 12: {found:?}", found[0].members.len());
    }

    #[test]
    fn places_along_and_beside() {
        let line = Curve::Line { angle_rad: 0.5 * PI, distance_m: 2.0 };
        assert!((line.place(DVec2::new(-3.0, 2.5)).1 - 0.5).abs() < 1e-12);
        let p = parabola(DVec2::new(1.0, 2.0), DVec2::new(0.0, 0.0), DVec2::new(1.0, -2.0), 0.0).unwrap();
        assert!(p.0.length() < 1e-9 && (p.1 - 1.0).abs() < 1e-9, "{p:?}");
        let (c, r) = circle(DVec2::X, DVec2::Y, -DVec2::X).unwrap();
        assert!(c.length() < 1e-12 && (r - 1.0).abs() < 1e-12);
        assert!(circle(DVec2::ZERO, DVec2::X, DVec2::X * 2.0).is_none());
    }

    #[test]
    fn crowds_and_nothing_end() {
        assert!(rows(&[], &options()).is_empty());
        let same = vec![DVec2::ONE; 300];
        assert!(rows(&exact(&same), &options()).is_empty());
        let grid: Vec<DVec2> =
            (0..400).map(|k| DVec2::new(f64::from(k % 20) * 2.0, f64::from(k / 20) * 2.0)).collect();
        assert!(rows(&exact(&grid), &options()).len() <= MOST_ROWS);
    }
}
