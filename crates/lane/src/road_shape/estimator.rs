//! The road shape method behind the interface of all lane methods.

use super::{
    EdgeStatus, Ego, Peak, RadarMount, RoadShape, RoadTracker, Side, TrackerSettings, ego_speed,
    static_points,
};
use crate::curve::{Clothoid, Fitted, Shape};
use crate::{LaneError, LaneEstimate, LaneEstimator, LanePoint, Line, SensorInput};
use glam::DVec2;

/// The method's name, as on the command line.
pub const METHOD: &str = "road-shape";

/// What [`RoadShapeEstimator`] works with, as [`super::RoadShapeOptions`] makes it for a radar.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RoadShapeSetup {
    /// Settings of gate, vote, fit and filter. The mounting in them is not used: points bring their position
    /// in the vehicle's frame with them.
    pub tracker: TrackerSettings,
    /// Where no look gives the speed, it is taken from the points if this share of them agrees on one; 0:
    /// never.
    pub own_speed_share: f64,
}

/// Finds the edges of the road (walls, barriers) from points of any radar, scan after scan (Miyake, sections
/// IV and V). Its lines are edges of the road, not lane lines; there are at most two, one on each side of the
/// vehicle.
#[derive(Debug, Clone)]
pub struct RoadShapeEstimator {
    options: RoadShapeSetup,
    tracker: RoadTracker,
    last_s: Option<f64>,
    /// Distance ahead up to which points support each edge, m.
    reach_m: [f64; 2],
    latest: Option<RoadShape>,
}

/// Direction and position of the radar that saw a point, from the point's range and position.
fn seen_from(p: &LanePoint) -> RadarMount {
    let back = DVec2::from_angle(p.azimuth_rad) * p.range_m;
    RadarMount { x_m: p.at_m[0] - back.x, y_m: p.at_m[1] - back.y, yaw_rad: 0.0 }
}

fn is_finite(p: &LanePoint) -> bool {
    let all = [p.at_m[0], p.at_m[1], p.std_m[0], p.std_m[1], p.range_rate_mps, p.range_rate_std_mps];
    all.iter().all(|v| v.is_finite())
        && p.range_m.is_finite()
        && p.azimuth_rad.is_finite()
        && p.snr_db.is_finite()
        && p.range_m > 0.0
}

fn peak(p: &LanePoint) -> Peak {
    Peak {
        range_m: p.range_m,
        azimuth_rad: p.azimuth_rad,
        range_rate_mps: p.range_rate_mps,
        power: 10f64.powf(0.1 * p.snr_db.clamp(-100.0, 100.0)),
        range_std_m: p.std_m[0],
        azimuth_std_rad: p.std_m[1] / p.range_m,
        range_rate_std_mps: p.range_rate_std_mps,
    }
}

impl RoadShapeEstimator {
    /// Makes the estimator with its options.
    ///
    /// # Errors
    /// Returns an error for the first option or setting outside its range.
    pub fn new(options: RoadShapeSetup) -> crate::error::Result<RoadShapeEstimator> {
        crate::error::not_negative("own_speed_share", options.own_speed_share)?;
        let tracker = RoadTracker::new(&options.tracker)?;
        Ok(RoadShapeEstimator { options, tracker, last_s: None, reach_m: [0.0; 2], latest: None })
    }

    /// Points, fits and tracks of the latest look; None where it could not be used.
    pub fn latest(&self) -> Option<&RoadShape> {
        self.latest.as_ref()
    }

    fn ego(&self, input: &SensorInput<'_>, points: &[LanePoint]) -> Result<Ego, LaneError> {
        let sound = |m: &crate::Measured| m.value.is_finite() && m.std.is_finite() && m.std >= 0.0;
        let yaw = input.yaw_rate_rad_per_s.filter(sound);
        let known = match input.speed_mps.filter(sound) {
            Some(v) => Ego { speed_mps: v.value, speed_std_mps: v.std, ..Ego::default() },
            None if self.options.own_speed_share > 0.0 => {
                let Some(first) = points.first() else { return Err(LaneError::Empty) };
                let peaks: Vec<Peak> = points.iter().map(peak).collect();
                let gate = &self.options.tracker.gate;
                ego_speed(&peaks, &seen_from(first), gate, self.options.own_speed_share)
                    .map_err(|_| LaneError::NoSpeed)?
            }
            None => return Err(LaneError::NoSpeed),
        };
        Ok(Ego {
            yaw_rate_radps: yaw.map_or(0.0, |y| y.value),
            yaw_rate_std_radps: yaw.map_or(0.0, |y| y.std),
            ..known
        })
    }

    fn step(&mut self, input: &SensorInput<'_>) -> Result<LaneEstimate, LaneError> {
        self.latest = None;
        if input.points.is_empty() {
            // What is not seen is not stated; the tracks coast on at the next look.
            return Err(LaneError::Empty);
        }
        let sound: Vec<(usize, LanePoint)> =
            input.points.iter().copied().enumerate().filter(|(_, p)| is_finite(p)).collect();
        if sound.is_empty() {
            return Err(LaneError::NotFinite { points: input.points.len() });
        }
        let dt_s = match self.last_s {
            _ if !input.time_s.is_finite() => {
                return Err(LaneError::not_finite("the time of the frame"));
            }
            Some(last) if input.time_s < last => {
                return Err(LaneError::refused(format!(
                    "the frame at {} s follows the frame at {last} s",
                    input.time_s
                )));
            }
            Some(last) => input.time_s - last,
            None => 0.0,
        };
        let all: Vec<LanePoint> = sound.iter().map(|(_, p)| *p).collect();
        let ego = self.ego(input, &all)?;
        let mut rest = Vec::new();
        let mut members = Vec::new();
        let mut moving = 0;
        for (i, p) in &sound {
            // Each by the place of its own radar.
            let mount = seen_from(p);
            let scan = static_points(&[peak(p)], &mount, &ego, &self.options.tracker.gate)?;
            moving += scan.moving;
            members.extend(scan.points.iter().map(|_| *i));
            rest.extend(scan.points);
        }
        let at_rest = rest.len();
        let shape = self.tracker.step_points(rest, moving, dt_s, &ego)?;
        self.last_s = Some(input.time_s);
        let driven_m = ego.speed_mps * dt_s;
        let mut lines = Vec::new();
        let mut reasons = Vec::new();
        for side in Side::BOTH {
            let k = side.index();
            self.reach_m[k] = match &shape.fits[k] {
                Ok(fit) => fit.x_max_m,
                Err(_) => self.reach_m[k] - driven_m.max(0.0),
            };
            match self.line(&shape, side, &members) {
                Ok(line) => lines.push(line),
                Err(why) => reasons.push(format!("{side} side: {why}")),
            }
        }
        self.latest = Some(shape);
        if lines.is_empty() {
            return Err(match at_rest {
                0 => LaneError::NothingAtRest,
                _ => LaneError::refused(reasons.join("; ")),
            });
        }
        let mut out = LaneEstimate::of_lines(METHOD, input.time_s, input.points.len(), lines);
        if self.options.tracker.fit.heading_std_rad <= 0.0 {
            // The model has no heading: what is not estimated is not stated.
            out.heading_rad = None;
        }
        Ok(out)
    }

    fn line(&self, shape: &RoadShape, side: Side, members: &[usize]) -> Result<Line, String> {
        let k = side.index();
        let Some(track) = shape.edge(side) else {
            return Err(match &shape.fits[k] {
                Err(reason) => reason.to_string(),
                Ok(_) => "the edge is new".into(),
            });
        };
        let s = &self.options.tracker;
        if track.status == EdgeStatus::Tentative {
            return Err(format!(
                "an edge was detected in {} of the {} scans that confirm it",
                track.hits, s.confirm_scans
            ));
        }
        let [c0, c1, b] = track.filter.state();
        let reach_m = self.reach_m[k];
        if reach_m <= 1.0 {
            return Err("the detected edge is behind the vehicle".into());
        }
        let heading_rad = match &shape.fits[k] {
            Ok(fit) => fit.heading_rad,
            Err(_) => 0.0,
        };
        let curve = Clothoid {
            start_m: [0.0, b],
            heading_rad,
            curvature_per_m: c0,
            curvature_rate_per_m2: c1,
            length_m: reach_m,
        };
        // State [c0, c1, b]; the curve's lateral place, heading, curvature, rate.
        let p = track.filter.covariance();
        let place = [Some(2), None, Some(0), Some(1)];
        let mut covariance = [[0.0; 4]; 4];
        for (i, row) in covariance.iter_mut().enumerate() {
            for (j, v) in row.iter_mut().enumerate() {
                if let (Some(a), Some(b)) = (place[i], place[j]) {
                    *v = p[a][b];
                }
            }
        }
        covariance[1][1] = s.fit.heading_std_rad.powi(2);
        let mut fitted = Fitted { curve, shape: Shape::Clothoid, covariance, residual: 0.0 };
        let mut on = Vec::new();
        let mut squares = 0.0;
        for (point, index) in shape.points.iter().zip(members) {
            let foot = curve.foot(DVec2::new(point.x_m, point.y_m));
            let [xx, xy, yy] = point.covariance_m2;
            let left = DVec2::from_angle(curve.at(foot.s_m).heading_rad).perp();
            let own = left.x * left.x * xx + 2.0 * left.x * left.y * xy + left.y * left.y * yy;
            let variance = own + s.fit.floor_std_m.powi(2) + fitted.lateral_std_m(foot.s_m).powi(2);
            if (0.0..=reach_m + 1.0).contains(&foot.s_m) && foot.left_m.powi(2) <= 9.0 * variance {
                squares += foot.left_m.powi(2) / variance;
                on.push(*index);
            }
        }
        fitted.residual = (squares / on.len().max(1) as f64).sqrt();
        // Half where the edge is uncertain by half a metre in the middle of what is seen, less the longer it is not seen.
        let std_m = fitted.lateral_std_m(0.5 * reach_m);
        let seen = (-track.unseen_s / s.coast_s.max(1e-3)).exp();
        let confidence = seen / (1.0 + (std_m / 0.5).powi(2));
        Ok(Line { fitted, confidence, members: on })
    }
}

impl LaneEstimator for RoadShapeEstimator {
    fn method(&self) -> &'static str {
        METHOD
    }

    fn estimate(&mut self, input: &SensorInput<'_>) -> LaneEstimate {
        match self.step(input) {
            Ok(estimate) => estimate,
            Err(why) => LaneEstimate::none(METHOD, input.time_s, input.points.len(), why),
        }
    }
}
