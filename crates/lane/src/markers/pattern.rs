//! Points at a known spacing: groups by distance, less what is denser, and paths of little turn through them.

use super::scan::MarkerPattern;
use crate::LanePoint;
use glam::DVec2;

/// A point as input of the pattern search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PatternPoint {
    /// Position in the vehicle's level frame, m.
    pub at_m: DVec2,
    /// Standard deviations along and across the direction `ahead`, m.
    pub std_m: [f64; 2],
    /// Unit vector from the radar to the point.
    pub ahead: DVec2,
}

impl PatternPoint {
    /// Converts a lane point.
    pub fn of(p: &LanePoint) -> PatternPoint {
        PatternPoint {
            at_m: DVec2::from_array(p.at_m),
            std_m: p.std_m,
            ahead: DVec2::from_angle(p.azimuth_rad),
        }
    }

    /// Standard deviation along a unit vector, m.
    pub fn along_m(&self, direction: DVec2) -> f64 {
        let (along, across) = (self.ahead.dot(direction), self.ahead.perp_dot(direction));
        (along * self.std_m[0]).hypot(across * self.std_m[1])
    }
}

/// Pairs of points at least `lo_m` and less than `hi_m` apart, each once, in the points' order. Both limits
/// are widened by twice the effect of noise (at most a quarter of the least distance).
fn edges(points: &[PatternPoint], lo_m: f64, hi_m: f64) -> Vec<(usize, usize)> {
    let most = 0.25 * lo_m;
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|a, b| points[*a].at_m.x.total_cmp(&points[*b].at_m.x));
    let mut out = Vec::new();
    for (k, &i) in order.iter().enumerate() {
        for &j in &order[k + 1..] {
            if points[j].at_m.x - points[i].at_m.x >= hi_m + most {
                break;
            }
            let step = points[j].at_m - points[i].at_m;
            let (d, direction) = (step.length(), step.normalize_or(DVec2::X));
            let noise = points[i].along_m(direction).hypot(points[j].along_m(direction));
            // The tolerance already covers part of the noise.
            let half = 0.5 * (hi_m - lo_m);
            let wider = (half.hypot(2.0 * noise) - half).min(most);
            if d >= lo_m - wider && d < hi_m + wider {
                out.push((i.min(j), i.max(j)));
            }
        }
    }
    out.sort_unstable();
    out
}

/// Makes points whose positions are known exactly.
pub fn exact(points: &[DVec2]) -> Vec<PatternPoint> {
    points.iter().map(|p| PatternPoint { at_m: *p, std_m: [0.0; 2], ahead: DVec2::X }).collect()
}

/// Groups of at least `least` points joined by distances of at least d_ps - d_pt and less than d_ps + d_pt, m
/// (Feng 2019, eq. 5.1), each in the points' order.
pub fn dis_cluster(points: &[PatternPoint], d_ps: f64, d_pt: f64, least: usize) -> Vec<Vec<usize>> {
    let mut head: Vec<usize> = (0..points.len()).collect();
    fn root(head: &mut [usize], mut i: usize) -> usize {
        while head[i] != i {
            head[i] = head[head[i]];
            i = head[i];
        }
        i
    }
    let mut joined = vec![false; points.len()];
    for (i, j) in edges(points, d_ps - d_pt, d_ps + d_pt) {
        let (a, b) = (root(&mut head, i), root(&mut head, j));
        head[a.max(b)] = a.min(b);
        (joined[i], joined[j]) = (true, true);
    }
    let mut groups: Vec<Vec<usize>> = vec![Vec::new(); points.len()];
    for i in (0..points.len()).filter(|i| joined[*i]) {
        let r = root(&mut head, i);
        groups[r].push(i);
    }
    groups.retain(|g| g.len() >= least.max(1));
    groups
}

/// Points at the spacing that are not among denser ones: {p1} - {p1} ∩ {p2}, and of these the ones still at
/// the spacing (Feng 2019, eq. 5.2, 5.3). Indices in the points' order.
pub fn spaced(points: &[PatternPoint], options: &MarkerPattern) -> Vec<usize> {
    let (d_ps, d_pt) = (options.spacing_m, options.tolerance_m);
    let first = dis_cluster(points, d_ps, d_pt, options.least);
    let half = 0.5 * (d_ps - d_pt);
    let mut dense = vec![false; points.len()];
    dis_cluster(points, half, half, options.least).iter().flatten().for_each(|i| dense[*i] = true);
    let mut left: Vec<usize> = first.into_iter().flatten().filter(|i| !dense[*i]).collect();
    left.sort_unstable();
    let places: Vec<PatternPoint> = left.iter().map(|i| points[*i]).collect();
    let again = dis_cluster(&places, d_ps, d_pt, options.least);
    let mut out: Vec<usize> = again.into_iter().flatten().map(|k| left[k]).collect();
    out.sort_unstable();
    out
}

/// Largest turn of a row from step to step, whatever the noise, rad.
const SHARPEST: f64 = 0.8;
/// Largest number of steps of the search for one path: a bound for crowds, which are no rows.
const MOST_STEPS: usize = 20_000;

/// Paths through points with steps at the spacing and little change of direction (Feng 2019, section 5.1.4):
/// the longest first, each point in at most one path, three points or more. Ends are joined over gaps of
/// whole spacings.
pub fn paths(points: &[PatternPoint], options: &MarkerPattern) -> Vec<Vec<usize>> {
    let (d_ps, d_pt) = (options.spacing_m, options.tolerance_m);
    let mut beside: Vec<Vec<usize>> = vec![Vec::new(); points.len()];
    for (i, j) in edges(points, d_ps - d_pt, d_ps + d_pt) {
        beside[i].push(j);
        beside[j].push(i);
    }
    let mut free = vec![true; points.len()];
    let mut found: Vec<Vec<usize>> = Vec::new();
    loop {
        let mut best: Vec<usize> = Vec::new();
        for i in (0..points.len()).filter(|i| free[*i]) {
            for &j in beside[i].iter().filter(|j| free[**j]) {
                let path = longest(points, &beside, &free, [i, j], options);
                if path.len() > best.len() {
                    best = path;
                }
            }
        }
        // Short pieces count where a gap may join them.
        if best.len() < 2 {
            break;
        }
        best.iter().for_each(|i| free[*i] = false);
        found.push(best);
    }
    let mut found = join(points, found, options);
    found.retain(|p| p.len() >= 3);
    found.sort_by_key(|p| (std::cmp::Reverse(p.len()), p[0]));
    found
}

/// Change of direction from one step to the next, rad, positive to the left.
pub(super) fn turn(a: DVec2, b: DVec2) -> f64 {
    a.perp_dot(b).atan2(a.dot(b))
}

/// Standard deviation of the turn from one step to the next, rad: three points, the middle one twice.
fn turn_std(a: &PatternPoint, b: &PatternPoint, c: &PatternPoint, spacing_m: f64) -> f64 {
    let across = (c.at_m - a.at_m).normalize_or(DVec2::X).perp();
    let [a, b, c] = [a, b, c].map(|p| p.along_m(across) / spacing_m);
    (a * a + 4.0 * b * b + c * c).sqrt()
}

fn longest(
    points: &[PatternPoint],
    beside: &[Vec<usize>],
    free: &[bool],
    begin: [usize; 2],
    options: &MarkerPattern,
) -> Vec<usize> {
    let mut best = begin.to_vec();
    let mut path = best.clone();
    // For each point of the path the neighbours that were not yet tried, those of least turn last.
    let mut turns = vec![0.0];
    let onward = |path: &[usize], turns: &[f64]| -> Vec<(usize, f64)> {
        let n = path.len();
        let (last, from) = (&points[path[n - 1]], &points[path[n - 2]]);
        let step = last.at_m - from.at_m;
        let mut next: Vec<(usize, f64)> = beside[path[n - 1]]
            .iter()
            .filter(|k| free[**k] && !path.contains(*k))
            .map(|k| (*k, turn(step, points[*k].at_m - last.at_m)))
            .filter(|(k, t)| {
                let before = turns.last().copied().filter(|_| turns.len() > 1);
                let noise = 2.0 * turn_std(from, last, &points[*k], options.spacing_m);
                // The turn before has its own noise.
                let [most, change] =
                    [options.turn_rad[0].hypot(noise), options.turn_rad[1].hypot(1.5 * noise)];
                t.abs() < most.min(SHARPEST) && before.is_none_or(|b| (t - b).abs() < change)
            })
            .collect();
        let before = if turns.len() > 1 { turns[turns.len() - 1] } else { 0.0 };
        next.sort_by(|a, b| (b.1 - before).abs().total_cmp(&(a.1 - before).abs()));
        next
    };
    let mut stack = vec![onward(&path, &turns)];
    for _ in 0..MOST_STEPS {
        let Some(top) = stack.last_mut() else { break };
        match top.pop() {
            Some((k, t)) => {
                path.push(k);
                turns.push(t);
                if path.len() > best.len() {
                    best = path.clone();
                }
                let next = onward(&path, &turns);
                stack.push(next);
            }
            None => {
                stack.pop();
                path.pop();
                turns.pop();
            }
        }
    }
    best
}

/// Joins paths whose ends face each other over a gap of two to `gap` spacings.
fn join(points: &[PatternPoint], mut paths: Vec<Vec<usize>>, options: &MarkerPattern) -> Vec<Vec<usize>> {
    loop {
        let mut best: Option<(f64, usize, usize, bool, bool)> = None;
        for a in 0..paths.len() {
            for b in a + 1..paths.len() {
                for (flip_a, flip_b) in [(false, false), (false, true), (true, false), (true, true)] {
                    let end = |p: &[usize], flip: bool, k: usize| {
                        points[if flip { p[k] } else { p[p.len() - 1 - k] }]
                    };
                    let pairs = [(flip_a, &paths[a]), (!flip_b, &paths[b])]
                        .map(|(f, p)| [0, 1].map(|k| end(p, f, k)));
                    // The last two of a, then the first two of b.
                    let [[s1, s0], [t0, t1]] = pairs;
                    let [a0, a1, b0, b1] = [s0, s1, t0, t1].map(|s| s.at_m);
                    let gap = a1.distance(b0) / options.spacing_m;
                    let whole = gap.round();
                    if whole < 2.0 || whole > options.gap as f64 {
                        continue;
                    }
                    // In a bend the straight line over the gap is shorter.
                    let off = (gap - whole).abs() * options.spacing_m;
                    let (into, out) = (turn(a1 - a0, b0 - a1), turn(b0 - a1, b1 - b0));
                    let noise = 2.0
                        * turn_std(&s0, &s1, &t0, options.spacing_m).hypot(turn_std(
                            &s1,
                            &t0,
                            &t1,
                            options.spacing_m,
                        ));
                    let most = (options.turn_rad[0] * whole).hypot(noise);
                    if off < options.tolerance_m * whole.sqrt()
                        && into.abs() < most
                        && out.abs() < most
                        && (into - out).abs() < options.turn_rad[1].hypot(noise)
                        && best.is_none_or(|b| whole + (into - out).abs() < b.0)
                    {
                        best = Some((whole + (into - out).abs(), a, b, flip_a, flip_b));
                    }
                }
            }
        }
        let Some((_, a, b, flip_a, flip_b)) = best else { return paths };
        let mut tail = paths.remove(b);
        if flip_b {
            tail.reverse();
        }
        if flip_a {
            paths[a].reverse();
        }
        paths[a].extend(tail);
    }
}
