//! Compares the results of the document's steps with the true lane.

use crate::trial::kit::*;
use crate::trial::report::number;
use catseye_lane::camera_fusion::CameraFusionOptions;
use catseye_lane::camera_fusion::{Insight, Part, RoadModel, compare_fits, separate_lanes};
use std::collections::BTreeMap;

/// Pieces of the spline that is compared with the parabola, as in the core's tests.
const SPLINE_PIECES: usize = 5;
/// Longest arc extension when lanes of targets are separated, m.
const EXTENSION_M: f64 = 20.0;

/// The truth with only the two lines of the own lane.
pub(super) fn own_lines(t: TrueLanes) -> Option<TrueLanes> {
    Some(own_alone(&t)).filter(|t| t.lines.len() == 2)
}

/// Distance to the left of a polyline, and its direction there; None beyond its ends.
fn beside(line: &[[f64; 2]], p: DVec2) -> Option<(f64, f64)> {
    let mut best: Option<(f64, f64, f64)> = None;
    for (i, w) in line.windows(2).enumerate() {
        let (a, b) = (DVec2::from_array(w[0]), DVec2::from_array(w[1]));
        let d = b - a;
        let t = (p - a).dot(d) / d.length_squared().max(f64::MIN_POSITIVE);
        let outside = (t < 0.0 && i == 0) || (t > 1.0 && i + 2 == line.len());
        let q = a + d * t.clamp(0.0, 1.0);
        let distance = if outside { f64::INFINITY } else { p.distance(q) };
        if best.is_none_or(|b| distance < b.0) {
            let left = d.perp_dot(p - a).signum() * distance;
            best = Some((distance, left, d.to_angle()));
        }
    }
    best.filter(|b| b.0.is_finite()).map(|b| (b.1, b.2))
}

/// Distance to the left of the lane's centre line between the two lines (m), and its direction (rad).
fn of_middle(t: &TrueLanes, p: DVec2) -> Option<(f64, f64)> {
    let (right, left) = (beside(&t.lines[0], p)?, beside(&t.lines[1], p)?);
    Some((0.5 * (right.0 + left.0), right.1))
}

/// The road model of a lane that turns by this much between its parts, where the turn belongs to one.
fn true_model(turn_rad: f64) -> Option<RoadModel> {
    let left = turn_rad > 0.0;
    match turn_rad.abs().to_degrees() {
        t if t <= 4.0 => Some(RoadModel::Straight),
        t if (10.0..=60.0).contains(&t) => {
            Some(if left { RoadModel::CurveLeft } else { RoadModel::CurveRight })
        }
        t if (80.0..=100.0).contains(&t) => {
            Some(if left { RoadModel::RightAngleLeft } else { RoadModel::RightAngleRight })
        }
        _ => None,
    }
}

/// Number of successes and of trials.
#[derive(Debug, Clone, Copy, Default)]
struct Share {
    hits: usize,
    of: usize,
}

impl Share {
    fn add(&mut self, hit: bool) {
        self.hits += usize::from(hit);
        self.of += 1;
    }

    /// Adds its row, where there was a trial.
    fn row(self, rows: &mut Vec<Row>, name: &str, document: Option<f64>, why: &str) {
        if self.of == 0 {
            return;
        }
        // Wilson's interval, of which half the width is stated.
        let (n, p, z) = (self.of as f64, self.hits as f64 / self.of as f64, 1.96f64);
        let half = z / (1.0 + z * z / n) * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
        let row = rows.one(name, "%", Some(100.0 * self.hits as f64 / self.of as f64));
        row.document(document).why(format!("{} of {}; {why}", self.hits, self.of));
        row.half = Some(100.0 * half);
    }
}

/// Counts over all looks of camera and radar in the first condition.
#[derive(Debug, Clone, Default)]
pub(super) struct Judged {
    parabola_better: Share,
    /// Errors of parabolas and splines, of ways, and of each part, m.
    fits: [Vec<f64>; 2],
    ways: Vec<f64>,
    apart: Share,
    matched: Share,
    joined: Share,
    models: BTreeMap<(String, String), usize>,
    model_right: Share,
    parts: [Vec<f64>; 3],
}

impl Judged {
    pub(super) fn take(&mut self, insight: &Insight, truth: &TrueLanes, settings: &CameraFusionOptions) {
        let lane_of = |p: DVec2| of_middle(truth, p).map(|m| (m.0 / settings.lane_width_m).round() as i32);
        let mut known = Vec::new();
        for way in &insight.ways {
            let middle = way.points_m[way.points_m.len() / 2];
            known.push(lane_of(middle));
            if let Ok(c) = compare_fits(&way.points_m, SPLINE_PIECES) {
                self.parabola_better.add(c.parabola_is_better());
                let [a, b] = c.parabola.span_m;
                let lane = lane_of(middle).map(|n| f64::from(n) * settings.lane_width_m);
                for k in 0..=20 {
                    let u = a + (b - a) * f64::from(k) / 20.0;
                    for (sum, p) in self.fits.iter_mut().zip([c.parabola.point(u), c.spline.point(u)]) {
                        if let (Some(lane), Some(m)) = (lane, of_middle(truth, p)) {
                            sum.push(m.0 - lane);
                        }
                    }
                }
                for p in &way.points_m {
                    if let (Some(lane), Some(m)) = (lane, of_middle(truth, *p)) {
                        self.ways.push(m.0 - lane);
                    }
                }
            }
        }
        let trails: Vec<_> = insight.ways.iter().map(|w| w.trail.clone()).collect();
        if trails.len() > 1
            && let Ok(separated) = separate_lanes(&trails, settings.lane_width_m, EXTENSION_M)
        {
            for (i, lane) in separated.iter().enumerate().skip(1) {
                if let (Some(a), Some(b)) = (known[0], known[i]) {
                    self.apart.add(lane.as_ref().is_ok_and(|l| l.lane == b - a));
                }
            }
        }
        let Some(r) = &insight.recognition else { return };
        if insight.near.is_some() && !insight.ways.is_empty() {
            self.joined.add(r.choice.is_some());
        }
        if let Some((i, lane, _)) = &r.way
            && let Some(Some(true_lane)) = known.get(*i)
        {
            self.matched.add(lane == true_lane);
        }
        if let Some(choice) = &r.choice {
            let place = |part: Part, last: bool| {
                let mut of = r.parts.iter().zip(&r.middle_m).filter(|(p, _)| **p == part).map(|(_, m)| *m);
                if last { of.next_back() } else { of.next() }
            };
            let heading = |p: Option<DVec2>| of_middle(truth, p?).map(|m| m.1);
            let ends = (heading(place(Part::Camera, true)), heading(place(Part::Radar, false)));
            if let (Some(a), Some(b)) = ends {
                let turn = DVec2::from_angle(a).angle_to(DVec2::from_angle(b));
                let truly = true_model(turn);
                let name = truly.map_or("between two models".to_string(), |m| m.to_string());
                *self.models.entry((name, choice.model.to_string())).or_default() += 1;
                if let Some(m) = truly {
                    self.model_right.add(m == choice.model);
                }
            }
        }
        for (line, points) in truth.lines.iter().zip([&r.right_m, &r.left_m]) {
            for (part, p) in r.parts.iter().zip(points) {
                if let Some((left, _)) = beside(line, *p) {
                    let k = match part {
                        Part::Camera => 0,
                        Part::Middle => 1,
                        Part::Radar => 2,
                    };
                    self.parts[k].push(left);
                }
            }
        }
    }

    pub(super) fn rows(&self, rows: &mut Vec<Row>) {
        let why = "by leave-one-out; document: figure 4, by eye";
        let name = "tracks for which the parabola is better than the B-spline";
        self.parabola_better.row(rows, name, Some(100.0), why);
        let middles = "of their middles, with lane.camera_fusion.to_middle";
        for (name, errors, why) in [
            ("tracks of cars, from the lane's middle (rms)", &self.ways, middles),
            ("parabolas through them (rms)", &self.fits[0], ""),
            ("B-splines through them (rms)", &self.fits[1], ""),
            ("near lines of the camera (rms)", &self.parts[0], "over its whole visible length"),
            ("built middle (rms)", &self.parts[1], "over the blind middle, both lines"),
            ("far lines of the radar (rms)", &self.parts[2], "half a lane beside the track of a car"),
        ] {
            if let Some(rms) = rms(errors.iter().copied()) {
                rows.one(name, "m", Some(rms)).why(why);
            }
        }
        for (name, share, why) in [
            ("lanes of several targets separated", self.apart, "by arc extension, against the first target"),
            ("frames whose parts were joined", self.joined, "of those with a near lane and a track"),
            ("tracks assigned to their true lane", self.matched, "by goodness of fit and slope"),
            ("correct road models on the drive", self.model_right, "of the turns that belong to a model"),
        ] {
            share.row(rows, name, None, why);
        }
    }

    pub(super) fn sheet(&self) -> Sheet {
        let mut s = Sheet::new("models", "true_model chosen_model looks").noted(format!(
            "Result of the network on the drive. Tracks of cars are {} m (rms) from the lane's middle.",
            number(rms(self.ways.iter().copied()))
        ));
        for ((truly, chosen), n) in &self.models {
            s.row(&[truly, chosen, n]);
        }
        s
    }
}
