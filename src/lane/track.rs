//! Lines over successive looks: each line of a look is joined to the line that ego motion lets expect, as their covariances weigh them
//! (Feng 2019, section 5.1.6 names tracking as the way to more accuracy). Takes the estimates of any method.

use super::curve::{Clothoid, Fitted, Shape};
use super::{LaneEstimate, Line, Measured};
use glam::{DMat4, DVec2, DVec4};

/// How lines are followed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackOptions {
    /// By which lateral place (m), heading (rad), curvature (1/m) and its rate (1/m^2) of a line drift in a second, beyond what ego
    /// motion says.
    pub drift: [f64; 4],
    /// A line is the same if it lies within so many standard deviations, or within `near_m`.
    pub sigmas: f64,
    pub near_m: f64,
    /// And turns away from it by less, rad.
    pub turned_rad: f64,
    /// A line that is not seen again is dropped after this time, s.
    pub keep_s: f64,
    /// What lies farther behind is forgotten, m.
    pub behind_m: f64,
}

impl Default for TrackOptions {
    fn default() -> Self {
        TrackOptions {
            drift: [0.05, 0.01, 1e-3, 1e-4],
            sigmas: 3.5,
            near_m: 0.25,
            turned_rad: 0.2,
            keep_s: 0.5,
            behind_m: 5.0,
        }
    }
}

/// How the vehicle moves; its path is an arc between looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EgoStep {
    pub speed_mps: Measured,
    /// Positive to the left.
    pub yaw_rate_rad_per_s: Measured,
}

#[derive(Debug, Clone, PartialEq)]
struct Track {
    line: Line,
    looks: u32,
    unseen_s: f64,
}

/// A filter over lane estimates.
#[derive(Debug, Clone, PartialEq)]
pub struct LineTracker {
    pub options: TrackOptions,
    tracks: Vec<Track>,
    last_s: Option<f64>,
}

/// Looks farther apart have nothing to do with one another, s.
const APART_S: f64 = 2.0;

impl LineTracker {
    pub fn new(options: TrackOptions) -> LineTracker {
        LineTracker { options, tracks: Vec::new(), last_s: None }
    }

    /// Forgets everything.
    pub fn reset(&mut self) {
        (self.tracks, self.last_s) = (Vec::new(), None);
    }

    /// The look's estimate with what earlier looks say. `step`: the motion since the look before; None: not known, nothing is carried
    /// over. A time that runs back starts anew.
    pub fn update(&mut self, now: LaneEstimate, step: Option<EgoStep>) -> LaneEstimate {
        let dt = self.last_s.map(|t| now.time_s - t);
        let finite = |s: &EgoStep| {
            [s.speed_mps, s.yaw_rate_rad_per_s].iter().all(|m| m.value.is_finite() && m.std.is_finite())
        };
        match (dt, step.filter(finite)) {
            (Some(dt), Some(step)) if dt > 0.0 && dt <= APART_S => self.predict(&step, dt),
            (Some(0.0), _) => {}
            _ => self.tracks.clear(),
        }
        self.last_s = now.time_s.is_finite().then_some(now.time_s);
        self.correct(&now.lines, dt.unwrap_or(0.0));
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
        let all = LaneEstimate::of_lines(&now.provenance.method, now.time_s, now.provenance.given, lines);
        LaneEstimate { lane_number: now.lane_number, ..all }
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
            let f = &mut t.line.fitted;
            let start = back.rotate(DVec2::from_array(f.curve.start_m) - moved_m);
            f.curve.start_m = start.to_array();
            f.curve.heading_rad -= turn;
            let direction = DVec2::from_angle(f.curve.heading_rad);
            let left = direction.perp();
            // A turn that was not as stated moves the start and turns the line; a way that was not shifts it.
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
        // Nothing of it is left.
        self.tracks.retain(|t| t.line.fitted.curve.length_m > 0.0);
    }

    fn correct(&mut self, lines: &[Line], dt: f64) {
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
        for (t, j) in self.tracks.iter_mut().zip(of_track) {
            let Some(l) = j.map(|j| &lines[j]) else {
                t.unseen_s += dt.max(0.0);
                continue;
            };
            if let Some(fitted) = joined(&t.line.fitted, &l.fitted) {
                t.line.fitted = fitted;
            } else {
                t.line.fitted = with_doubt(&l.fitted);
            }
            let both = 1.0 - (1.0 - 0.9 * t.line.confidence) * (1.0 - l.confidence);
            t.line.confidence = both.clamp(0.0, 1.0);
            t.line.members = l.members.clone();
            t.looks += 1;
            t.unseen_s = 0.0;
        }
        // What was seen once only was chance more often than not.
        let keep_s = self.options.keep_s;
        self.tracks.retain(|t| t.unseen_s == 0.0 || (t.looks > 1 && t.unseen_s < keep_s));
        for (l, _) in lines.iter().zip(&used).filter(|(_, u)| !**u) {
            let line = Line { fitted: with_doubt(&l.fitted), ..l.clone() };
            self.tracks.push(Track { line, looks: 1, unseen_s: 0.0 });
        }
        // Lines do not cross: of two that have come together the one that was seen more often stays.
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

    /// How far a line lies from where a followed one is expected, in standard deviations; None where it is another.
    fn distance(&self, track: &Fitted, line: &Fitted) -> Option<f64> {
        let o = &self.options;
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
        // However unsure: beyond a metre it is the next line.
        ((off < o.sigmas && far_m < 1.0) || far_m < o.near_m).then_some(off)
    }
}

/// Whether a curve comes nearer to another than `near_m`, at one of five places along it.
pub fn meet(a: &Clothoid, b: &Clothoid, near_m: f64) -> bool {
    [0.0, 0.25, 0.5, 0.75, 1.0].iter().any(|part| {
        let foot = b.foot(a.at(part * a.length_m).at_m);
        foot.left_m.abs() < near_m && (-near_m..b.length_m + near_m).contains(&foot.s_m)
    })
}

/// Lines may begin so far before or behind one another, m.
const REACH_M: f64 = 15.0;

/// With the doubt about the parameters that a simpler shape does not have, as a fit of theirs to as many points spread evenly over the
/// length would give it; where the line bends after all, its place and heading at the start are others too.
fn with_doubt(f: &Fitted) -> Fitted {
    let mut out = *f;
    let l = f.curve.length_m.max(1.0);
    let across = f.lateral_std_m(0.5 * l).max(0.005);
    // What polynomials of lower degree leave of s²/2 and s³/6 over 0 to l (Legendre), and what they take for them.
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

/// The curve from the place `s_m` on, which may lie before its start, with its covariance carried along.
pub fn moved(f: &Fitted, s_m: f64) -> Fitted {
    let curve = match s_m < 0.0 {
        true => f.curve.extended(-s_m, 0.0),
        false => f.curve.part(s_m, f.curve.length_m),
    };
    let by = displaced(&f.curve, s_m);
    // What moves along the curve comes to another heading and curvature.
    let bend = f.curve.curvature_per_m + s_m * f.curve.curvature_rate_per_m2;
    let heading = [0.0, 1.0, s_m, 0.5 * s_m * s_m];
    let curvature = [0.0, 0.0, 1.0, s_m];
    let rows: [[f64; 4]; 4] = [
        by.map(|d| d.y),
        std::array::from_fn(|k| heading[k] - bend * by[k].x),
        std::array::from_fn(|k| curvature[k] - f.curve.curvature_rate_per_m2 * by[k].x),
        [0.0, 0.0, 0.0, 1.0],
    ];
    let c = &f.covariance;
    let covariance = std::array::from_fn(|a| {
        std::array::from_fn(|b| {
            (0..4).map(|k| (0..4).map(|l| rows[a][k] * c[k][l] * rows[b][l]).sum::<f64>()).sum()
        })
    });
    Fitted { curve, covariance, ..*f }
}

/// Derivatives of the place at `s_m`, along (x) and left (y) of the curve there, by lateral place, heading, curvature and its rate at
/// the start, by small steps.
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

/// Both curves as their covariances weigh them, over the length of both. None for covariances that are none.
fn joined(old: &Fitted, new: &Fitted) -> Option<Fitted> {
    let new = with_doubt(new);
    // Both at the new one's start.
    let foot = old.curve.extended(0.0, REACH_M).foot(DVec2::from_array(new.curve.start_m));
    let before = moved(old, foot.s_m);
    let turn = DVec2::from_angle(new.curve.heading_rad - before.curve.heading_rad).to_angle();
    let off = DVec4::new(
        foot.left_m,
        turn,
        new.curve.curvature_per_m - before.curve.curvature_per_m,
        new.curve.curvature_rate_per_m2 - before.curve.curvature_rate_per_m2,
    );
    // In units in which all four count alike over the length.
    let length = new.curve.length_m.max(5.0);
    let unit = [1.0, length.recip(), length.powi(-2), length.powi(-3)];
    let matrix = |c: &[[f64; 4]; 4]| {
        DMat4::from_cols_array_2d(&std::array::from_fn(|a| {
            std::array::from_fn(|b| c[b][a] / (unit[a] * unit[b]))
        }))
    };
    let (p, r) = (matrix(&before.covariance), matrix(&new.covariance));
    let sum = p + r;
    let determinant = sum.determinant().abs();
    if determinant.is_nan() || determinant <= 1e-40 {
        return None;
    }
    let gain = p * sum.inverse();
    let step = gain * (off / DVec4::from_array(unit));
    let rest = DMat4::IDENTITY - gain;
    // Joseph's form stays a covariance.
    let left = rest * p * rest.transpose() + gain * r * gain.transpose();
    let mut out = before;
    let d: [f64; 4] = std::array::from_fn(|k| step[k] * unit[k]);
    let start =
        DVec2::from_array(before.curve.start_m) + DVec2::from_angle(before.curve.heading_rad).perp() * d[0];
    out.curve.start_m = start.to_array();
    out.curve.heading_rad += d[1];
    out.curve.curvature_per_m += d[2];
    out.curve.curvature_rate_per_m2 += d[3];
    out.curve.length_m = before.curve.length_m.max(new.curve.length_m);
    out.shape = old.shape.max(new.shape);
    out.residual = new.residual;
    out.covariance = std::array::from_fn(|a| std::array::from_fn(|b| left.col(b)[a] * unit[a] * unit[b]));
    let sound = d.iter().all(|x| x.is_finite()) && out.covariance.iter().flatten().all(|x| x.is_finite());
    if !sound {
        return None;
    }
    // What was seen before the new one's start stays.
    Some(if foot.s_m > 0.0 { moved(&out, -foot.s_m) } else { out })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lane::NoLane;
    use crate::lane::curve::fit;
    use crate::rng::Draws;

    const STEP: EgoStep = EgoStep {
        speed_mps: Measured { value: 10.0, std: 0.02 },
        yaw_rate_rad_per_s: Measured { value: 0.0, std: 0.001 },
    };

    fn look(curve: &Clothoid, time_s: f64, draws: &mut Draws, shape: Shape) -> LaneEstimate {
        let std = 0.1;
        let at: Vec<DVec2> =
            curve.sample(2.0).iter().map(|p| *p + DVec2::new(draws.normal(), draws.normal()) * std).collect();
        let fitted = fit(&at, &vec![std; at.len()], shape).unwrap();
        let line = Line { fitted, confidence: 0.7, members: (0..at.len()).collect() };
        LaneEstimate::of_lines("test", time_s, at.len(), vec![line])
    }

    fn straight(y: f64) -> Clothoid {
        Clothoid {
            start_m: [6.0, y],
            heading_rad: 0.0,
            curvature_per_m: 0.0,
            curvature_rate_per_m2: 0.0,
            length_m: 24.0,
        }
    }

    /// Over many drives: the error of the followed line is smaller than that of a look, and as large as its covariance says.
    #[test]
    fn following_lowers_the_error_and_says_so() {
        let (mut of_look, mut of_track, mut ratio) = (0.0, 0.0, 0.0);
        let drives = 150;
        for drive in 0..drives {
            let mut draws = Draws::new(drive, 1);
            let mut tracker = LineTracker::new(TrackOptions { drift: [0.0; 4], ..Default::default() });
            let still = EgoStep { yaw_rate_rad_per_s: Measured { value: 0.0, std: 0.0 }, ..STEP };
            let mut last = None;
            for k in 0..8 {
                let e = look(&straight(1.5), 0.05 * f64::from(k), &mut draws, Shape::Line);
                let f = tracker.update(e.clone(), Some(still));
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
        // The doubt about a bend makes it say a little more than there is.
        assert!((0.5..1.4).contains(&c), "{c}");
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
        let arc = Clothoid {
            curvature_per_m: 1.0 / (radius - 1.5),
            start_m: [0.0, 1.5],
            length_m: 20.0,
            ..straight(1.5)
        };
        for k in 0..10 {
            let f = tracker.update(look(&arc, 0.05 * f64::from(k), &mut draws, Shape::Arc), Some(step));
            assert_eq!(f.lines.len(), 1, "{k}");
        }
        // Not seen for a while: where the arc has gone on to.
        let none = LaneEstimate::none("test", 0.55, 0, NoLane::Empty);
        let f = tracker.update(none, Some(step));
        let foot = f.lines[0].fitted.curve.foot(arc.at(8.0).at_m);
        assert!(foot.left_m.abs() < 0.15 && f.lines[0].members.is_empty(), "{foot:?}");
        let late = tracker.update(LaneEstimate::none("test", 1.6, 0, NoLane::Empty), Some(step));
        assert_eq!(late.no_lane, Some(NoLane::Empty));
    }

    #[test]
    fn other_lines_are_others() {
        let mut draws = Draws::new(5, 2);
        let mut tracker = LineTracker::new(TrackOptions::default());
        tracker.update(look(&straight(1.5), 0.0, &mut draws, Shape::Line), Some(STEP));
        let f = tracker.update(look(&straight(-1.5), 0.05, &mut draws, Shape::Line), Some(STEP));
        // The first was seen once only.
        assert_eq!(f.lines.len(), 1);
        assert!(f.lines[0].fitted.curve.start_m[1] < 0.0);
        // Without motion, or with time running back, nothing is carried over.
        let f = tracker.update(look(&straight(-1.5), 0.1, &mut draws, Shape::Line), None);
        assert_eq!(f.lines.len(), 1);
        let f = tracker.update(look(&straight(1.5), 0.0, &mut draws, Shape::Line), Some(STEP));
        assert_eq!(f.lines.len(), 1);
        let nan = EgoStep { speed_mps: Measured { value: f64::NAN, std: 1.0 }, ..STEP };
        assert_eq!(
            tracker.update(look(&straight(1.5), 0.05, &mut draws, Shape::Line), Some(nan)).lines.len(),
            1
        );
    }

    #[test]
    fn moved_is_the_same_curve() {
        let mut draws = Draws::new(9, 2);
        let arc = Clothoid { curvature_per_m: 0.02, ..straight(1.0) };
        let f = look(&arc, 0.0, &mut draws, Shape::Clothoid).lines[0].fitted;
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
