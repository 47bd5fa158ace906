//! Tracks lines over successive looks. The points of a line are remembered and moved with the vehicle, so
//! that a line is fitted to all that was seen of it, and its position beside the vehicle to what was seen
//! before it was passed (Feng 2019, section 5.1.6 names tracking as the way to more accuracy). It takes the
//! estimates of any method whose lines rest on points.

use super::curve::{Clothoid, Fitted, Shape};
use super::numeric::{bilinear, outer};
use super::robust::{WEIGHINGS, robust};
use super::{LaneEstimate, LanePoint, Line, Measured, UNKNOWN_M};
use catseye_math::Matrix;
use glam::{DMat2, DVec2};

/// Options of [`LineTracker`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackOptions {
    /// Drift of a line's lateral position (m), heading (rad), curvature (1/m) and its rate (1/m²) in a
    /// second, beyond the ego-motion. Remembered points drift as the position does.
    pub drift: [f64; 4],
    /// Standard deviation of a point as a position on the line, m.
    pub place_m: f64,
    /// Error of azimuths beyond their noise, rad.
    pub azimuth_error_rad: f64,
    /// Largest distance between a line and a track of the same line, in standard deviations.
    pub sigmas: f64,
    /// Distance from a track within which a line is always the same, m.
    pub near_m: f64,
    /// Largest angle between a line and a track of the same line, rad.
    pub turned_rad: f64,
    /// Time after which a line that is not seen again is dropped, s.
    pub keep_s: f64,
    /// Distance behind the vehicle beyond which points are dropped, m.
    pub behind_m: f64,
    /// Largest standard deviation of an offset that is stated, m.
    pub most_offset_std_m: f64,
    /// Largest standard deviation of a heading that is stated, rad.
    pub most_heading_std_rad: f64,
}

impl Default for TrackOptions {
    fn default() -> Self {
        TrackOptions {
            drift: [0.05, 0.01, 1e-3, 1e-4],
            place_m: 0.02,
            azimuth_error_rad: 0.3f64.to_radians(),
            sigmas: 3.5,
            near_m: 0.25,
            turned_rad: 0.2,
            keep_s: 0.5,
            behind_m: 5.0,
            // Three standard deviations are half a narrow lane, beyond which it may be the next one.
            most_offset_std_m: 0.5,
            most_heading_std_rad: 0.1,
        }
    }
}

/// Motion of the vehicle; its path is an arc between looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EgoStep {
    /// Speed of the vehicle, m/s.
    pub speed_mps: Measured,
    /// Yaw rate of the vehicle, rad/s, positive to the left.
    pub yaw_rate_rad_per_s: Measured,
}

impl EgoStep {
    /// Curvature of the vehicle's path, 1/m. It is unknown at standstill.
    fn path_per_m(&self) -> Measured {
        let v = self.speed_mps.value;
        if v.abs() < SLOWEST_MPS {
            return Measured { value: 0.0, std: SHARPEST_PER_M };
        }
        Measured {
            value: (self.yaw_rate_rad_per_s.value / v).clamp(-SHARPEST_PER_M, SHARPEST_PER_M),
            std: (self.yaw_rate_rad_per_s.std / v.abs()).min(SHARPEST_PER_M),
        }
    }
}

/// Speed below which a vehicle hardly moves along a path, m/s.
const SLOWEST_MPS: f64 = 0.5;
/// Largest curvature of a vehicle's path, 1/m.
const SHARPEST_PER_M: f64 = 0.2;

/// A remembered point of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Mark {
    at_m: DVec2,
    covariance: DMat2,
}

impl Mark {
    fn of(p: &LanePoint, o: &TrackOptions) -> Mark {
        let u = DVec2::from_angle(p.azimuth_rad);
        let place = o.place_m.powi(2);
        let along = p.std_m[0].powi(2) + place;
        let across = p.std_m[1].powi(2) + (o.azimuth_error_rad * p.range_m).powi(2) + place;
        Mark { at_m: DVec2::from_array(p.at_m), covariance: outer(u) * along + outer(u.perp()) * across }
    }

    /// Standard deviation along a direction, m.
    fn std_m(&self, direction: DVec2) -> f64 {
        direction.dot(self.covariance * direction).max(0.0).sqrt()
    }

    /// Combines both marks, weighted by their covariances; where they disagree, the more certain one is
    /// returned.
    fn with(&self, o: &Mark, sigmas: f64) -> Mark {
        let sum = self.covariance + o.covariance;
        let off = o.at_m - self.at_m;
        let determinant = sum.determinant();
        let together = determinant > 0.0 && off.dot(sum.inverse() * off) <= sigmas * sigmas;
        if !together {
            return if o.covariance.determinant() < self.covariance.determinant() { *o } else { *self };
        }
        let gain = self.covariance * sum.inverse();
        let covariance = (DMat2::IDENTITY - gain) * self.covariance;
        Mark { at_m: self.at_m + gain * off, covariance: (covariance + covariance.transpose()) * 0.5 }
    }
}

#[derive(Debug, Clone, PartialEq)]
struct Track {
    line: Line,
    looks: u32,
    unseen_s: f64,
    /// Marks in the order of the line, away from the vehicle.
    marks: Vec<Mark>,
}

/// Distance within which two marks are one, m: no row has its markers so close.
const ONE_PLACE_M: f64 = 0.5;
/// Least decrease of Cauchy's measure for a further parameter.
const GAIN: f64 = 12.0;
/// Least share of a line's marks that lies on its curve.
const MOST_ON: f64 = 0.8;

impl Track {
    fn new(l: &Line, points: &[LanePoint], o: &TrackOptions) -> Track {
        let marks = l.members.iter().filter_map(|i| points.get(*i)).map(|p| Mark::of(p, o)).collect();
        Track { line: l.clone(), looks: 1, unseen_s: 0.0, marks }
    }

    fn remember(&mut self, m: Mark, o: &TrackOptions) {
        let distance = |k: usize| self.marks[k].at_m.distance(m.at_m);
        let nearest = (0..self.marks.len()).min_by(|a, b| distance(*a).total_cmp(&distance(*b)));
        if let Some(k) = nearest.filter(|k| distance(*k) < ONE_PLACE_M) {
            self.marks[k] = self.marks[k].with(&m, o.sigmas);
            return;
        }
        // Insert it where it lengthens the path through all marks least.
        let longer = |k: usize| {
            let before = k.checked_sub(1).map(distance);
            let after = (k < self.marks.len()).then(|| distance(k));
            match (before, after) {
                (Some(a), Some(b)) => a + b - self.marks[k - 1].at_m.distance(self.marks[k].at_m),
                (a, b) => a.or(b).unwrap_or(0.0),
            }
        };
        let at = (0..=self.marks.len()).min_by(|a, b| longer(*a).total_cmp(&longer(*b))).unwrap_or(0);
        self.marks.insert(at, m);
    }

    /// The curve through the marks, from as far behind as one curve fits; drops marks beside it.
    fn refit(&mut self, o: &TrackOptions) -> Option<Fitted> {
        for from in 0..=self.marks.len() / 2 {
            let marks = &self.marks[from..];
            let places: Vec<DVec2> = marks.iter().map(|m| m.at_m).collect();
            let n = places.len();
            let std: Vec<f64> = (0..n)
                .map(|k| {
                    let (a, b) = (k.saturating_sub(2), (k + 2).min(n - 1));
                    marks[k].std_m((places[b] - places[a]).normalize_or(DVec2::X).perp()).max(0.5 * o.place_m)
                })
                .collect();
            let fitted = robust(&places, &std, GAIN, WEIGHINGS)?;
            let off = |k: usize| fitted.curve.foot(places[k]).left_m.abs();
            let on: Vec<bool> = (0..n).map(|k| off(k) < (o.sigmas * std[k]).max(0.5 * o.near_m)).collect();
            if on.iter().filter(|x| **x).count() as f64 >= MOST_ON * n as f64 {
                let mut on = vec![true; from].into_iter().chain(on);
                self.marks.retain(|_| on.next().unwrap_or(true));
                return Some(fitted);
            }
        }
        None
    }
}

/// A line at the vehicle: its distance to the left, its direction relative to the vehicle, and its curvature.
#[derive(Debug, Clone, Copy)]
struct Beside {
    left_m: Measured,
    turned_rad: Measured,
    curvature_per_m: Measured,
}

/// Distance from the vehicle along the path within which marks tell the line's position beside it, m.
const TELLS_M: f64 = 40.0;
/// Largest turn of the path, and largest angle of a line to it, within which marks are used, rad.
const TELLS_RAD: f64 = 1.2;
const AWAY_RAD: f64 = 0.7;
/// Difference between the curvature of a lane and that of a vehicle's path in it, 1/m: sway of 0.15 m over 4
/// s at 15 m/s.
const SWAY_PER_M: f64 = 0.002;
/// Distance over which the curvature of a bend may end or begin, m; and distance over which that of a
/// seemingly straight road may become `SWAY_PER_M` (a clothoid of A = 100 m).
const BENDS_OVER_M: f64 = 4.0;
const SETS_IN_OVER_M: f64 = 20.0;
/// Standard deviations of position (m) and direction (rad) before anything is seen.
const ANYWHERE_M: f64 = 10.0;
const ANY_TURN_RAD: f64 = 0.5;

impl Track {
    /// The line beside the vehicle, from the marks along its path of given curvature. The course of the line
    /// where nothing was seen of it is unknown: its curvature there may wander (a Wiener process) as much as
    /// where it was seen.
    fn beside(&self, path_per_m: Measured) -> Option<Beside> {
        let reach = TELLS_M.min(TELLS_RAD / path_per_m.value.abs().max(1e-9));
        let path = Clothoid {
            start_m: [0.0; 2],
            heading_rad: 0.0,
            curvature_per_m: path_per_m.value,
            curvature_rate_per_m2: 0.0,
            length_m: 0.0,
        }
        .extended(reach, reach);
        let c = &self.line.fitted.curve;
        let away = |m: &Mark, heading_rad: f64| {
            DVec2::from_angle(c.at(c.foot(m.at_m).s_m).heading_rad - heading_rad).to_angle()
        };
        // Distance along the path, position to its left and the standard deviation of that position.
        let seen: Vec<[f64; 3]> = self
            .marks
            .iter()
            .filter_map(|m| {
                let foot = path.foot(m.at_m);
                let heading_rad = path.at(foot.s_m).heading_rad;
                let left = DVec2::from_angle(heading_rad).perp();
                // A line may be given in either direction.
                let along = away(m, heading_rad).sin().abs() < AWAY_RAD.sin();
                let inside = (0.0..=2.0 * reach).contains(&foot.s_m) && along;
                inside.then(|| [foot.s_m - reach, foot.left_m, m.std_m(left)])
            })
            .collect();
        let n = seen.len();
        if n < 2 {
            return None;
        }
        let bends: [f64; 5] = std::array::from_fn(|k| c.at(0.25 * k as f64 * c.length_m).curvature_per_m);
        let most = |than: f64| bends.iter().map(|k| (k - than).abs()).fold(0.0, f64::max);
        // It bends here as the vehicle's path does or as where it was seen, and may change as far as to
        // straight.
        let bend = most(path_per_m.value).max(SWAY_PER_M);
        let change = most(0.0).powi(2) / BENDS_OVER_M + SWAY_PER_M.powi(2) / SETS_IN_OVER_M;
        let prior = [ANYWHERE_M.powi(2), ANY_TURN_RAD.powi(2), bend.powi(2) + path_per_m.std.powi(2)];
        let by = |s: f64| [1.0, s, 0.5 * s * s];
        let all = Matrix::from_fn(n, n, |i, j| {
            let (a, b) = (by(seen[i][0]), by(seen[j][0]));
            let known: f64 = (0..3).map(|k| a[k] * prior[k] * b[k]).sum();
            let own = if i == j { seen[i][2].powi(2) } else { 0.0 };
            (known + change * wander(seen[i][0], seen[j][0]) + own).into()
        });
        let inverse = all.inverse();
        if !inverse.is_finite() {
            return None;
        }
        let solved = |right: &dyn Fn(usize) -> f64| -> Vec<f64> {
            (0..n).map(|i| (0..n).map(|j| inverse[(i, j)].re * right(j)).sum()).collect()
        };
        let left = solved(&|j| seen[j][1]);
        let measured = |k: usize| {
            let column = |j: usize| by(seen[j][0])[k];
            let value = prior[k] * (0..n).map(|j| column(j) * left[j]).sum::<f64>();
            let told: f64 = solved(&column).iter().enumerate().map(|(j, x)| column(j) * x).sum();
            Measured { value, std: (prior[k] - prior[k] * prior[k] * told).max(0.0).sqrt().max(1e-6) }
        };
        let bent = measured(2);
        Some(Beside {
            left_m: measured(0),
            turned_rad: measured(1),
            curvature_per_m: Measured { value: path_per_m.value + bent.value, ..bent },
        })
    }
}

/// Covariance of the positions, at two distances from the vehicle, of a line that starts straight and whose
/// curvature is a Wiener process of unit density to both sides: the integral of (s - u)²(t - u)²/4 over u up
/// to the shorter distance.
fn wander(s: f64, t: f64) -> f64 {
    if s * t <= 0.0 {
        return 0.0;
    }
    let (near, far) = (s.abs().min(t.abs()), s.abs().max(t.abs()));
    let d = far - near;
    (near.powi(5) / 5.0 + d * near.powi(4) / 2.0 + d * d * near.powi(3) / 3.0) / 4.0
}

/// The lane at the vehicle, from its lines there; what is less certain than the options allow is not stated.
fn with_lane(mut e: LaneEstimate, beside: &[Beside], o: &TrackOptions) -> LaneEstimate {
    let near = |a: &&&Beside, b: &&&Beside| a.left_m.value.abs().total_cmp(&b.left_m.value.abs());
    let known: Vec<&Beside> = beside.iter().filter(|b| b.left_m.std < UNKNOWN_M).collect();
    let left = known.iter().filter(|b| b.left_m.value > 0.0).min_by(near).copied();
    let right = known.iter().filter(|b| b.left_m.value <= 0.0).min_by(near).copied();
    (e.width_m, e.offset_m) = (None, None);
    if let (Some(l), Some(r)) = (left, right) {
        let (l, r) = (l.left_m, r.left_m);
        // Both lines bend alike where they were not seen, so the errors of the offset add up.
        let offset = Measured { value: -0.5 * (l.value + r.value), std: 0.5 * (l.std + r.std) };
        let width = Measured { value: l.value - r.value, std: l.std.hypot(r.std) };
        if offset.std < o.most_offset_std_m {
            (e.width_m, e.offset_m) = (Some(width), Some(offset));
        }
    }
    let mean = |of: &dyn Fn(&Beside) -> Measured| {
        let all = [left, right].into_iter().flatten().map(of);
        // As uncertain as the more certain one: they bend alike.
        let std = all.clone().map(|m| m.std).fold(f64::INFINITY, f64::min);
        Measured::mean(all).map(|m| Measured { std, ..m })
    };
    e.heading_rad = mean(&|b| Measured { value: -b.turned_rad.value, ..b.turned_rad })
        .filter(|h| h.std < o.most_heading_std_rad);
    e.curvature_per_m = mean(&|b| b.curvature_per_m);
    e
}

/// A tracking filter over lane estimates.
#[derive(Debug, Clone, PartialEq)]
pub struct LineTracker {
    /// Options of the tracker.
    pub options: TrackOptions,
    tracks: Vec<Track>,
    last_s: Option<f64>,
}

/// Longest time between looks that belong together, s.
const APART_S: f64 = 2.0;

impl LineTracker {
    /// Makes a tracker that has seen nothing yet.
    pub fn new(options: TrackOptions) -> LineTracker {
        LineTracker { options, tracks: Vec::new(), last_s: None }
    }

    /// Combines the look's estimate with earlier looks. `points` are those that the members of the estimate's
    /// lines index. `step` is the motion since the last look; None if it is unknown, and nothing is then
    /// carried over. Time that runs backwards restarts the tracker.
    ///
    /// Offset, width, heading and curvature come from what was seen of the lines next to the vehicle, and are
    /// None where that is too little.
    pub fn update(&mut self, now: LaneEstimate, points: &[LanePoint], step: Option<EgoStep>) -> LaneEstimate {
        let dt = self.last_s.map(|t| now.time_s - t);
        let finite = |s: &EgoStep| {
            [s.speed_mps, s.yaw_rate_rad_per_s].iter().all(|m| m.value.is_finite() && m.std.is_finite())
        };
        let step = step.filter(finite);
        match (dt, step) {
            (Some(dt), Some(step)) if dt > 0.0 && dt <= APART_S => self.predict(&step, dt),
            (Some(0.0), _) => {}
            _ => self.tracks.clear(),
        }
        self.last_s = now.time_s.is_finite().then_some(now.time_s);
        self.correct(&now.lines, points, dt.unwrap_or(0.0));
        let lines: Vec<Line> = self
            .tracks
            .iter()
            .map(|t| {
                let fade = (1.0 - t.unseen_s / self.options.keep_s.max(1e-9)).clamp(0.0, 1.0);
                let members = if t.unseen_s > 0.0 { Vec::new() } else { t.line.members.clone() };
                Line { confidence: t.line.confidence * fade, members, ..t.line.clone() }
            })
            .collect();
        if lines.is_empty() {
            return now;
        }
        let path = step.map_or(Measured { value: 0.0, std: SHARPEST_PER_M }, |s| s.path_per_m());
        let beside: Vec<Beside> = self.tracks.iter().filter_map(|t| t.beside(path)).collect();
        let all = LaneEstimate::of_lines(&now.provenance.method, now.time_s, now.provenance.given, lines);
        with_lane(LaneEstimate { lane_number: now.lane_number, ..all }, &beside, &self.options)
    }

    fn predict(&mut self, step: &EgoStep, dt: f64) {
        let (v, w) = (step.speed_mps.value, step.yaw_rate_rad_per_s.value);
        let turn = w * dt;
        // Along the chord of the arc.
        let chord = if turn.abs() > 1e-9 { 2.0 * (0.5 * turn).sin() / turn } else { 1.0 };
        let moved_m = DVec2::from_angle(0.5 * turn) * (v * dt * chord);
        let back = DVec2::from_angle(-turn);
        let turn_std = step.yaw_rate_rad_per_s.std * dt;
        let along_std = step.speed_mps.std * dt;
        for t in &mut self.tracks {
            for m in &mut t.marks {
                m.at_m = back.rotate(m.at_m - moved_m);
                let turned = DMat2::from_angle(-turn);
                m.covariance = turned * m.covariance * turned.transpose()
                    + outer(m.at_m.perp()) * (turn_std * turn_std)
                    + outer(DVec2::X) * (along_std * along_std)
                    + DMat2::IDENTITY * (self.options.drift[0].powi(2) * dt);
            }
            t.marks.retain(|m| m.at_m.length() < self.options.behind_m || m.at_m.x > 0.0);
            let f = &mut t.line.fitted;
            let start = back.rotate(DVec2::from_array(f.curve.start_m) - moved_m);
            f.curve.start_m = start.to_array();
            f.curve.heading_rad -= turn;
            let direction = DVec2::from_angle(f.curve.heading_rad);
            let left = direction.perp();
            // An error of the turn moves the start and rotates the line; an error of the distance shifts it.
            let by_turn = [left.dot(start.perp()), 1.0, 0.0, 0.0];
            let by_way = left.x;
            for a in 0..4 {
                for b in 0..4 {
                    f.covariance[a][b] += turn_std * turn_std * by_turn[a] * by_turn[b];
                }
                f.covariance[a][a] += self.options.drift[a].powi(2) * dt;
            }
            f.covariance[0][0] += (along_std * by_way).powi(2);
            let here = f.curve.foot(DVec2::ZERO).s_m;
            if here - self.options.behind_m > 0.0 {
                *f = moved(f, (here - self.options.behind_m).min(f.curve.length_m));
            }
        }
        // Nothing of the line is left.
        self.tracks.retain(|t| t.line.fitted.curve.length_m > 0.0);
    }

    fn correct(&mut self, lines: &[Line], points: &[LanePoint], dt: f64) {
        let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
        for (i, t) in self.tracks.iter().enumerate() {
            for (j, l) in lines.iter().enumerate() {
                if let Some(off) = self.distance(&t.line.fitted, &l.fitted) {
                    pairs.push((off, i, j));
                }
            }
        }
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        let mut of_track: Vec<Option<usize>> = vec![None; self.tracks.len()];
        let mut used = vec![false; lines.len()];
        for (_, i, j) in pairs {
            if of_track[i].is_none() && !used[j] {
                (of_track[i], used[j]) = (Some(j), true);
            }
        }
        let o = self.options;
        for (t, j) in self.tracks.iter_mut().zip(of_track) {
            let Some(l) = j.map(|j| &lines[j]) else {
                t.unseen_s += dt.max(0.0);
                continue;
            };
            l.members.iter().filter_map(|i| points.get(*i)).for_each(|p| t.remember(Mark::of(p, &o), &o));
            t.line.fitted = t.refit(&o).unwrap_or(l.fitted);
            let both = 1.0 - (1.0 - 0.9 * t.line.confidence) * (1.0 - l.confidence);
            t.line.confidence = both.clamp(0.0, 1.0);
            t.line.members = l.members.clone();
            t.looks += 1;
            t.unseen_s = 0.0;
        }
        // What was seen only once was a false line more often than not.
        let keep_s = self.options.keep_s;
        self.tracks.retain(|t| t.unseen_s == 0.0 || (t.looks > 1 && t.unseen_s < keep_s));
        for (l, _) in lines.iter().zip(&used).filter(|(_, u)| !**u) {
            self.tracks.push(Track::new(l, points, &o));
        }
        // Lines do not cross: of two that have met, the one that was seen more often stays.
        self.tracks.sort_by_key(|t| (t.unseen_s > 0.0, std::cmp::Reverse(t.looks)));
        let mut kept: Vec<Track> = Vec::new();
        for t in self.tracks.drain(..) {
            if !kept
                .iter()
                .any(|k| meet(&t.line.fitted.curve, &k.line.fitted.curve, 2.0 * self.options.near_m))
            {
                kept.push(t);
            }
        }
        self.tracks = kept;
    }

    /// Distance of a line from the expected position of a track, in standard deviations; None where it is
    /// another line.
    fn distance(&self, track: &Fitted, line: &Fitted) -> Option<f64> {
        let o = &self.options;
        let (track, line) = (&with_doubt(track), &with_doubt(line));
        let curve = track.curve.extended(0.0, REACH_M);
        let (mut sum, mut far_m): (f64, f64) = (0.0, 0.0);
        let parts = [0.0, 0.3, 0.6];
        for part in parts {
            let s = part * line.curve.length_m;
            let at = line.curve.at(s);
            let foot = curve.foot(at.at_m);
            if !(-REACH_M..=curve.length_m).contains(&foot.s_m) {
                return None;
            }
            let turn = DVec2::from_angle(curve.at(foot.s_m).heading_rad - at.heading_rad);
            if turn.to_angle().abs() > o.turned_rad {
                return None;
            }
            let std = track.lateral_std_m(foot.s_m.max(0.0)).hypot(line.lateral_std_m(s)).max(0.01);
            sum += (foot.left_m / std).powi(2);
            far_m = far_m.max(foot.left_m.abs());
        }
        let off = (sum / parts.len() as f64).sqrt();
        // However uncertain: beyond a metre it is another line.
        ((off < o.sigmas && far_m < 1.0) || far_m < o.near_m).then_some(off)
    }
}

/// Whether a curve comes closer to another than `near_m`, at one of five places along it.
pub fn meet(a: &Clothoid, b: &Clothoid, near_m: f64) -> bool {
    [0.0, 0.25, 0.5, 0.75, 1.0].iter().any(|part| {
        let foot = b.foot(a.at(part * a.length_m).at_m);
        foot.left_m.abs() < near_m && (-near_m..b.length_m + near_m).contains(&foot.s_m)
    })
}

/// Largest distance between the starts of two lines along them, m.
const REACH_M: f64 = 15.0;

/// Adds the uncertainty of the parameters that a simpler shape does not have, as if they were fitted to as
/// many points spread evenly over the length. Where the line bends after all, its position and heading at the
/// start change, too.
fn with_doubt(f: &Fitted) -> Fitted {
    let mut out = *f;
    let l = f.curve.length_m.max(1.0);
    let across = f.lateral_std_m(0.5 * l).max(0.005);
    // What polynomials of lower degree leave of s²/2 and s³/6 over 0 to l (Legendre), and what they absorb.
    let mut add = |std: f64, with: [f64; 4]| {
        for a in 0..4 {
            for b in 0..4 {
                out.covariance[a][b] += std * std * with[a] * with[b];
            }
        }
    };
    if f.shape == Shape::Line {
        add(2.0 * 180f64.sqrt() * across / (l * l), [l * l / 12.0, -0.5 * l, 1.0, 0.0]);
    }
    if f.shape != Shape::Clothoid {
        add(6.0 * 2800f64.sqrt() * across / l.powi(3), [-l.powi(3) / 120.0, 0.1 * l * l, -0.5 * l, 1.0]);
    }
    out
}

/// The curve from the place `s_m` onwards, which may lie before its start, with its covariance propagated.
pub fn moved(f: &Fitted, s_m: f64) -> Fitted {
    let curve = match s_m < 0.0 {
        true => f.curve.extended(-s_m, 0.0),
        false => f.curve.part(s_m, f.curve.length_m),
    };
    let by = displaced(&f.curve, s_m);
    // A displacement along the curve changes heading and curvature.
    let bend = f.curve.curvature_per_m + s_m * f.curve.curvature_rate_per_m2;
    let heading = [0.0, 1.0, s_m, 0.5 * s_m * s_m];
    let curvature = [0.0, 0.0, 1.0, s_m];
    let rows: [[f64; 4]; 4] = [
        by.map(|d| d.y),
        std::array::from_fn(|k| heading[k] - bend * by[k].x),
        std::array::from_fn(|k| curvature[k] - f.curve.curvature_rate_per_m2 * by[k].x),
        [0.0, 0.0, 0.0, 1.0],
    ];
    let covariance = rows.map(|a| rows.map(|b| bilinear(&a, &f.covariance, &b)));
    Fitted { curve, covariance, ..*f }
}

/// Numerical derivatives of the position at `s_m`, along (x) and left (y) of the curve there, with respect to
/// lateral position, heading, curvature and its rate at the start.
fn displaced(curve: &Clothoid, s_m: f64) -> [DVec2; 4] {
    let place = |c: &Clothoid| match s_m < 0.0 {
        true => DVec2::from_array(c.extended(-s_m, 0.0).start_m),
        false => Clothoid { length_m: s_m, ..*c }.at(s_m).at_m,
    };
    let heading = curve.heading_rad + s_m * (curve.curvature_per_m + 0.5 * s_m * curve.curvature_rate_per_m2);
    let back = DVec2::from_angle(-heading);
    let reach = s_m.abs().max(1.0);
    let steps = [1e-5, 1e-5 / reach, 1e-5 / (reach * reach), 1e-5 / reach.powi(3)];
    std::array::from_fn(|k| {
        let with = |h: f64| {
            let mut c = *curve;
            match k {
                0 => {
                    let start = DVec2::from_array(c.start_m) + DVec2::from_angle(c.heading_rad).perp() * h;
                    c.start_m = start.to_array();
                }
                1 => c.heading_rad += h,
                2 => c.curvature_per_m += h,
                _ => c.curvature_rate_per_m2 += h,
            }
            place(&c)
        };
        back.rotate(with(steps[k]) - with(-steps[k])) / (2.0 * steps[k])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LaneError;
    use crate::curve::fit;
    use catseye::base::rng::Draws;

    const STEP: EgoStep = EgoStep {
        speed_mps: Measured { value: 10.0, std: 0.02 },
        yaw_rate_rad_per_s: Measured { value: 0.0, std: 0.001 },
    };

    /// A look at places of one line, which radar and reference point of the vehicle see alike.
    fn look(
        places: &[DVec2],
        time_s: f64,
        draws: &mut Draws,
        std: f64,
        gain: f64,
    ) -> (LaneEstimate, Vec<LanePoint>) {
        let points: Vec<LanePoint> = places
            .iter()
            .map(|p| *p + DVec2::new(draws.normal(), draws.normal()) * std)
            .map(|at| LanePoint {
                at_m: at.to_array(),
                std_m: [std; 2],
                range_rate_mps: 0.0,
                range_rate_std_mps: 0.01,
                range_m: at.length(),
                azimuth_rad: at.to_angle(),
                rcs_dbsm: -20.0,
                snr_db: 20.0,
                power_dbm: None,
            })
            .collect();
        let at: Vec<DVec2> = points.iter().map(|p| DVec2::from_array(p.at_m)).collect();
        let fitted = robust(&at, &vec![std; at.len()], gain, 0).unwrap();
        let line = Line { fitted, confidence: 0.7, members: (0..at.len()).collect() };
        (LaneEstimate::of_lines("test", time_s, at.len(), vec![line]), points)
    }

    /// Of a row at `y` along the world's x axis what is 6 to 30 m ahead.
    fn straight(y: f64, from_m: f64) -> Vec<DVec2> {
        (0..40)
            .map(|k| DVec2::new(2.0 * f64::from(k) - from_m, y))
            .filter(|p| (6.0..30.0).contains(&p.x))
            .collect()
    }

    /// Over many drives: the error of the followed line is smaller than that of a look, and as large as its covariance says.
    #[test]
    fn following_lowers_the_error_and_says_so() {
        let (mut of_look, mut of_track, mut ratio) = (0.0, 0.0, 0.0);
        let drives = 150;
        let options =
            TrackOptions { drift: [0.0; 4], place_m: 0.0, azimuth_error_rad: 0.0, ..Default::default() };
        for drive in 0..drives {
            let mut draws = Draws::new(drive, 1);
            let mut tracker = LineTracker::new(options);
            let still = Measured { value: 0.0, std: 0.0 };
            let step =
                EgoStep { speed_mps: Measured { std: 0.0, ..STEP.speed_mps }, yaw_rate_rad_per_s: still };
            let mut last = None;
            for k in 0..8 {
                let (e, points) =
                    look(&straight(1.5, 0.5 * f64::from(k)), 0.05 * f64::from(k), &mut draws, 0.1, 1e9);
                let f = tracker.update(e.clone(), &points, Some(step));
                assert_eq!(f.lines.len(), 1, "{drive} {k}");
                last = Some((e, f));
            }
            let (e, f) = last.unwrap();
            let error = |e: &LaneEstimate| e.lines[0].fitted.curve.foot(DVec2::new(18.0, 1.5));
            let (a, b) = (error(&e), error(&f));
            of_look += a.left_m * a.left_m;
            of_track += b.left_m * b.left_m;
            ratio += (b.left_m / f.lines[0].fitted.lateral_std_m(b.s_m)).powi(2);
        }
        let n = f64::from(drives);
        let (a, b, c) = ((of_look / n).sqrt(), (of_track / n).sqrt(), ratio / n);
        assert!(b < 0.6 * a, "{a} {b}");
        // The weights of outliers make it say a little more than there is.
        assert!((0.5..1.4).contains(&c), "{c}");
    }

    /// Markers on a circle round (0, radius), as a vehicle on it sees them after it has turned by `turned_rad`.
    fn circle(radius: f64, of_row: f64, turned_rad: f64, to_rad: f64) -> Vec<DVec2> {
        let centre = DVec2::new(0.0, radius);
        (0..60)
            .map(|k| f64::from(k) * 2.0 / of_row - turned_rad)
            .filter(|a| (0.1..to_rad).contains(a))
            .map(|a| centre + DVec2::from_angle(a - std::f64::consts::FRAC_PI_2) * of_row)
            .collect()
    }

    #[test]
    fn ego_motion_carries_lines_round_a_bend() {
        let mut draws = Draws::new(3, 2);
        let radius = 30.0;
        let mut tracker = LineTracker::new(TrackOptions::default());
        let step = EgoStep {
            speed_mps: Measured { value: 6.0, std: 0.01 },
            yaw_rate_rad_per_s: Measured { value: 6.0 / radius, std: 0.002 },
        };
        let turned = |t: f64| t * 6.0 / radius;
        for k in 0..10 {
            let time_s = 0.05 * f64::from(k);
            let (e, points) =
                look(&circle(radius, radius - 1.5, turned(time_s), 0.7), time_s, &mut draws, 0.1, 12.0);
            let f = tracker.update(e, &points, Some(step));
            assert_eq!(f.lines.len(), 1, "{k}");
        }
        // Not seen for a while: where the arc has gone on to.
        let none = LaneEstimate::none("test", 0.55, 0, LaneError::Empty);
        let f = tracker.update(none, &[], Some(step));
        let at = circle(radius, radius - 1.5, turned(0.55), 0.5)[2];
        let foot = f.lines[0].fitted.curve.foot(at);
        assert!(foot.left_m.abs() < 0.15 && f.lines[0].members.is_empty(), "{foot:?}");
        let late = tracker.update(LaneEstimate::none("test", 1.6, 0, LaneError::Empty), &[], Some(step));
        assert_eq!(late.no_lane, Some(LaneError::Empty));
    }

    #[test]
    fn other_lines_are_others() {
        let mut draws = Draws::new(5, 2);
        let mut tracker = LineTracker::new(TrackOptions::default());
        let mut told = |tracker: &mut LineTracker, y: f64, time_s: f64, step: Option<EgoStep>| {
            let (e, points) = look(&straight(y, 10.0 * time_s), time_s, &mut draws, 0.1, 1e9);
            tracker.update(e, &points, step)
        };
        told(&mut tracker, 1.5, 0.0, Some(STEP));
        let f = told(&mut tracker, -1.5, 0.05, Some(STEP));
        // The first was seen once only.
        assert_eq!(f.lines.len(), 1);
        assert!(f.lines[0].fitted.curve.start_m[1] < 0.0);
        // Without motion, or with time running back, nothing is carried over.
        assert_eq!(told(&mut tracker, -1.5, 0.1, None).lines.len(), 1);
        assert_eq!(told(&mut tracker, 1.5, 0.0, Some(STEP)).lines.len(), 1);
        let nan = EgoStep { speed_mps: Measured { value: f64::NAN, std: 1.0 }, ..STEP };
        assert_eq!(told(&mut tracker, 1.5, 0.05, Some(nan)).lines.len(), 1);
    }

    /// Markers of a road that is straight up to x = 20 m and then turns right by a right angle of 12 m radius.
    fn before_a_turn(y: f64) -> Vec<DVec2> {
        let radius = 12.0 + y;
        let arc = (0..9).map(|k| f64::from(k) * 2.0 / radius);
        let place = |a: f64| DVec2::new(20.0 + radius * a.sin(), y - radius * (1.0 - a.cos()));
        (0..10).map(|k| DVec2::new(2.0 * f64::from(k), y)).chain(arc.map(place)).collect()
    }

    /// Towards a turn of which a look sees little but the bend: what was seen before tells the offset, and where nothing was, none is
    /// told. The errors are as large as said.
    #[test]
    fn the_lane_beside_the_vehicle_is_remembered() {
        let (mut squares, mut ratios, mut stated, mut first) = (0.0, 0.0, 0, 0);
        for drive in 0..20 {
            let mut draws = Draws::new(drive, 7);
            let mut tracker = LineTracker::new(TrackOptions::default());
            let step = EgoStep { speed_mps: Measured { value: 4.0, std: 0.01 }, ..STEP };
            for k in 0..13 {
                let x = 8.0 + f64::from(k);
                let mut points = Vec::new();
                let mut lines = Vec::new();
                for y in [1.5, -2.0] {
                    let seen: Vec<DVec2> = before_a_turn(y)
                        .into_iter()
                        .map(|p| p - DVec2::new(x, 0.0))
                        .filter(|p| (7.0..22.0).contains(&p.length()) && p.x > 0.0)
                        .collect();
                    let (e, p) = look(&seen, 0.25 * f64::from(k), &mut draws, 0.03, 12.0);
                    let members = (points.len()..points.len() + p.len()).collect();
                    lines.push(Line { members, ..e.lines[0].clone() });
                    points.extend(p);
                }
                let e = LaneEstimate::of_lines("test", 0.25 * f64::from(k), points.len(), lines);
                let f = tracker.update(e, &points, Some(step));
                if let Some(o) = f.offset_m {
                    let error = o.value - 0.25;
                    squares += error * error;
                    ratios += (error / o.std).powi(2);
                    stated += 1;
                    // All markers next to the vehicle were seen: the last looks are sure.
                    assert!(k < 10 || (o.std < 0.2 && error.abs() < 0.2), "{drive} {k}: {error} {}", o.std);
                    first += usize::from(k == 0);
                } else {
                    assert!(k < 10, "{drive} {k}");
                }
            }
        }
        let (rms, ratio) = ((squares / f64::from(stated)).sqrt(), ratios / f64::from(stated));
        println!("{stated} of 260 offsets, {first} in first looks, {rms} m, squared {ratio} of what is said");
        assert!(rms < 0.2 && ratio < 1.5, "{rms} {ratio}");
    }

    /// The places of a curve whose curvature is a sum of small steps.
    #[test]
    fn wander_is_the_variance_of_a_wandering_line() {
        let h: f64 = 0.01;
        let place = |s: f64, u: f64| if u < s { 0.5 * (s - u).powi(2) } else { 0.0 };
        for (s, t) in [(3.0, 3.0), (2.0, 5.0), (5.0, 2.0)] {
            let sum: f64 =
                (0..1000).map(|k| (f64::from(k) + 0.5) * h).map(|u| place(s, u) * place(t, u) * h).sum();
            assert!((wander(s, t) / sum - 1.0).abs() < 1e-3, "{s} {t}");
            assert_eq!((wander(-s, -t), wander(s, -t)), (wander(s, t), 0.0));
        }
    }

    #[test]
    fn moved_is_the_same_curve() {
        let mut draws = Draws::new(9, 2);
        let at: Vec<DVec2> = circle(50.0, 51.0, 0.0, 0.6);
        let noisy: Vec<DVec2> =
            at.iter().map(|p| *p + DVec2::new(draws.normal(), draws.normal()) * 0.1).collect();
        let f = fit(&noisy, &vec![0.1; at.len()], Shape::Clothoid).unwrap();
        for s in [-7.0, 0.0, 9.0] {
            let m = moved(&f, s);
            for at in [10.0, 15.0, 20.0] {
                let (a, b) = (f.curve.at(at).at_m, m.curve.at(at - s).at_m);
                assert!(a.distance(b) < 1e-9, "{s} {at}");
                let (a, b) = (f.lateral_std_m(at), m.lateral_std_m(at - s));
                assert!((a / b - 1.0).abs() < 1e-3, "{s} {at}: {a} {b}");
            }
        }
    }
}
