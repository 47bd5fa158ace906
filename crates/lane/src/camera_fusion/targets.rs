//! The far part: paths of the cars ahead from a radar's tracks, in the present vehicle frame.

use super::curve::{Arc, Parabola, fit_parabola};
use crate::error::{LaneError, checked, finite, positive};
use crate::numeric::wrapped;
use glam::DVec2;

/// The vehicle's own motion from `time_s` until the next sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EgoSample {
    /// Time of the sample, s.
    pub time_s: f64,
    /// Speed, m/s, negative in reverse.
    pub speed_mps: f64,
    /// Curvature of the driven path, 1/m, positive to the left: from the camera's lane line as in the
    /// document, or yaw rate over speed. It has no effect at standstill.
    pub curvature_1pm: f64,
}

/// The vehicle's poses over time, in the frame of the first sample.
#[derive(Debug, Clone, PartialEq)]
pub struct EgoPath {
    samples: Vec<EgoSample>,
    poses: Vec<Arc>,
}

impl EgoPath {
    /// Builds the path from samples in order of time; the last one's motion goes on for `hold_s`.
    ///
    /// # Errors
    /// Returns an error for no sample, a non-finite sample or path, times that run backwards, or a negative
    /// or non-finite `hold_s`.
    pub fn new(samples: &[EgoSample], hold_s: f64) -> Result<EgoPath, LaneError> {
        let Some(last) = samples.last() else {
            return Err(LaneError::too_few("samples of the car's motion", 0, 1));
        };
        checked("the hold time", hold_s, hold_s >= 0.0 && hold_s.is_finite(), "0 or more")?;
        for s in samples {
            finite("a sample of the car's motion", s.time_s + s.speed_mps + s.curvature_1pm)?;
        }
        let mut samples = samples.to_vec();
        samples.push(EgoSample { time_s: last.time_s + hold_s, ..*last });
        let mut pose =
            Arc { point_m: DVec2::ZERO, heading_rad: 0.0, curvature_1pm: samples[0].curvature_1pm };
        let mut poses = vec![pose];
        for pair in samples.windows(2) {
            let dt = pair[1].time_s - pair[0].time_s;
            if dt < 0.0 {
                return Err(LaneError::out_of_range("a step of time", dt, "0 or more"));
            }
            let s = pair[0].speed_mps * dt;
            pose = Arc {
                point_m: pose.point(s),
                heading_rad: pose.heading_at(s),
                curvature_1pm: pair[1].curvature_1pm,
            };
            poses.push(pose);
        }
        match poses.iter().all(|p| p.point_m.is_finite() && p.heading_rad.is_finite()) {
            true => Ok(EgoPath { samples, poses }),
            false => Err(LaneError::not_finite("the car's track")),
        }
    }

    /// Position (m) and heading (rad) at a time.
    ///
    /// # Errors
    /// Returns an error if `time_s` lies outside the samples.
    pub fn pose(&self, time_s: f64) -> Result<(DVec2, f64), LaneError> {
        let outside =
            !(time_s >= self.samples[0].time_s && time_s <= self.samples[self.samples.len() - 1].time_s);
        if outside {
            return Err(LaneError::out_of_range("a time", time_s, "within the car's motion"));
        }
        let i = self.samples.partition_point(|s| s.time_s <= time_s).saturating_sub(1);
        let s = self.samples[i].speed_mps * (time_s - self.samples[i].time_s);
        Ok((self.poses[i].point(s), self.poses[i].heading_at(s)))
    }

    /// Maps a point seen at `then_s` into the vehicle frame of `now_s`: Sangeetha Lakshmi section 3.1 with
    /// corrected signs, and with the chord of the driven path in place of its first-order term.
    ///
    /// # Errors
    /// Returns an error if a time lies outside the samples or the point is non-finite.
    pub fn moved(&self, point_m: DVec2, then_s: f64, now_s: f64) -> Result<DVec2, LaneError> {
        let ((p0, h0), (p1, h1)) = (self.pose(then_s)?, self.pose(now_s)?);
        let out = DVec2::from_angle(-h1).rotate(p0 + DVec2::from_angle(h0).rotate(point_m) - p1);
        if out.is_finite() { Ok(out) } else { Err(LaneError::not_finite("a point of a track")) }
    }
}

/// The path of one car ahead: a parabola inside its span and arcs that extend it (Sangeetha Lakshmi section
/// 3.2).
#[derive(Debug, Clone, PartialEq)]
pub struct Trail {
    /// The parabola through the points.
    pub curve: Parabola,
    /// Arc at the near end; its heading points away from the vehicle.
    pub near: Arc,
    /// Arc at the far end.
    pub far: Arc,
}

impl Trail {
    /// Fits a path to at least four points in the present frame; the end nearer to the vehicle becomes the
    /// start.
    ///
    /// # Errors
    /// Returns the errors of [`fit_parabola`] and of [`Trail::new`].
    pub fn fit(points_m: &[DVec2]) -> Result<Trail, LaneError> {
        let (Some(first), Some(last)) = (points_m.first(), points_m.last()) else {
            return Err(LaneError::too_few("points of the curve", 0, 4));
        };
        if last.length() < first.length() {
            let back: Vec<DVec2> = points_m.iter().rev().copied().collect();
            return Trail::new(fit_parabola(&back, None, None)?);
        }
        Trail::new(fit_parabola(points_m, None, None)?)
    }

    /// Makes a path with arcs through three marginal points of the curve at each end: the end, and one and
    /// two quarters of the length inward.
    ///
    /// # Errors
    /// Returns an error if points of the curve are non-finite or coincide.
    pub fn new(curve: Parabola) -> Result<Trail, LaneError> {
        let [a, b] = curve.span_m;
        let quarter = 0.25 * (b - a);
        let near = Arc::through(curve.point(a), curve.point(a + quarter), curve.point(a + 2.0 * quarter))?;
        let back = Arc::through(curve.point(b), curve.point(b - quarter), curve.point(b - 2.0 * quarter))?;
        let far = Arc {
            heading_rad: wrapped(back.heading_rad + std::f64::consts::PI),
            curvature_1pm: -back.curvature_1pm,
            ..back
        };
        Ok(Trail { curve, near, far })
    }

    /// Position (m) and direction (rad) at u of the curve; outside its span on the arcs.
    pub fn at(&self, u_m: f64) -> (DVec2, f64) {
        let [a, b] = self.curve.span_m;
        if u_m < a {
            (self.near.point(u_m - a), self.near.heading_at(u_m - a))
        } else if u_m > b {
            (self.far.point(u_m - b), self.far.heading_at(u_m - b))
        } else {
            (self.curve.point(u_m), self.curve.heading_rad(u_m))
        }
    }

    /// Distance by which u lies outside the points, m.
    fn extension(&self, u_m: f64) -> f64 {
        (self.curve.span_m[0] - u_m).max(u_m - self.curve.span_m[1]).max(0.0)
    }

    /// Distance from this path to another along this one's normals (Sangeetha Lakshmi figure 7, points E and
    /// F), positive when the other lies to the left. It is taken where the two need the least extension, at
    /// most `extension_m` for each.
    ///
    /// # Errors
    /// Returns an error if `extension_m` is not positive, or if no normal meets the other path within that
    /// extension.
    pub fn offset_to(&self, other: &Trail, extension_m: f64) -> Result<LaneOffset, LaneError> {
        positive("the longest extension", extension_m)?;
        let grid = |t: &Trail, n: usize| -> Vec<f64> {
            let [a, b] = [t.curve.span_m[0] - extension_m, t.curve.span_m[1] + extension_m];
            (0..=n).map(|i| a + (b - a) * i as f64 / n as f64).collect()
        };
        let theirs: Vec<(f64, DVec2)> = grid(other, 400).into_iter().map(|u| (u, other.at(u).0)).collect();
        let mut found: Vec<(f64, f64)> = Vec::new();
        for u in grid(self, 100) {
            let (e, heading) = self.at(u);
            let t = DVec2::from_angle(heading);
            let best = theirs
                .windows(2)
                .filter_map(|w| {
                    let (d0, d1) = ((w[0].1 - e).dot(t), (w[1].1 - e).dot(t));
                    if (d0 > 0.0) == (d1 > 0.0) {
                        return None;
                    }
                    let k = d0 / (d0 - d1);
                    let f = w[0].1.lerp(w[1].1, k);
                    Some(((f - e).dot(t.perp()), w[0].0 + k * (w[1].0 - w[0].0)))
                })
                .min_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
            if let Some((offset, v)) = best {
                found.push((self.extension(u) + other.extension(v), offset));
            }
        }
        let least = found.iter().map(|f| f.0).fold(f64::INFINITY, f64::min);
        if !least.is_finite() {
            return Err(LaneError::undetermined(
                "the distance of two tracks, because no normal of one meets the other",
            ));
        }
        let mut near: Vec<f64> = found.iter().filter(|f| f.0 <= least + 1.0).map(|f| f.1).collect();
        near.sort_by(f64::total_cmp);
        Ok(LaneOffset { offset_m: near[near.len() / 2], extension_m: least })
    }
}

/// The distance of one path from another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LaneOffset {
    /// Distance, m, positive to the left.
    pub offset_m: f64,
    /// Length of arc that had to be added to the two paths together, m.
    pub extension_m: f64,
}

/// A target's lane relative to the first target's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LanePlace {
    /// The lane, counted from the first target's, positive to the left.
    pub lane: i32,
    /// Distance of the path from the first target's, m, positive to the left.
    pub offset_m: f64,
    /// Distance from the border between two lanes, m, at most half a lane; a small value means an unsure
    /// lane.
    pub margin_m: f64,
    /// Length of arc that had to be added to the two paths together, m.
    pub extension_m: f64,
}

/// Finds which targets share a lane (Sangeetha Lakshmi section 3.2, figures 5 to 7): the distance of each
/// path from the first one's is divided by the lane's width and rounded. A target whose path meets no normal
/// gets the reason in place of a lane.
///
/// # Errors
/// Returns an error if `lane_width_m` is not positive or there is no path.
pub fn separate_lanes(
    trails: &[Trail],
    lane_width_m: f64,
    extension_m: f64,
) -> Result<Vec<Result<LanePlace, LaneError>>, LaneError> {
    positive("the lane's width", lane_width_m)?;
    let Some(first) = trails.first() else {
        return Err(LaneError::too_few("tracks of targets", 0, 1));
    };
    let place = |o: LaneOffset| {
        let lane = (o.offset_m / lane_width_m).round();
        let margin_m = 0.5 * lane_width_m - (o.offset_m - lane * lane_width_m).abs();
        LanePlace { lane: lane as i32, offset_m: o.offset_m, margin_m, extension_m: o.extension_m }
    };
    let own = place(LaneOffset { offset_m: 0.0, extension_m: 0.0 });
    let others = trails[1..].iter().map(|t| first.offset_to(t, extension_m).map(place));
    Ok(std::iter::once(Ok(own)).chain(others).collect())
}

#[cfg(test)]
mod tests {
    use super::super::synth::{Draws, Road, way};
    use super::*;

    /// A car ahead on a road, watched from a car on the same road: its track must come out on the road.
    #[test]
    fn tracks_lie_on_the_road() {
        let (speed, dt) = (20.0, 0.05);
        for k in [0.0, 1.0 / 200.0, -1.0 / 80.0] {
            let road = Arc { point_m: DVec2::ZERO, heading_rad: 0.0, curvature_1pm: k };
            let ego: Vec<EgoSample> = (0..40)
                .map(|i| EgoSample { time_s: i as f64 * dt, speed_mps: speed, curvature_1pm: k })
                .collect();
            let path = EgoPath::new(&ego, dt).unwrap();
            let track: Vec<(f64, DVec2)> = ego
                .iter()
                .map(|e| {
                    let s = speed * e.time_s;
                    let seen = road.point(s + 30.0 + 0.5 * s) - road.point(s);
                    let position_m = DVec2::from_angle(-road.heading_at(s)).rotate(seen);
                    (e.time_s, position_m)
                })
                .collect();
            let now = 40.0 * dt;
            for (time_s, seen) in track {
                let p = path.moved(seen, time_s, now).unwrap();
                let want = road.point(30.0 + 1.5 * speed * time_s - speed * now);
                assert!(p.distance(want) < 1e-9, "{k}: {p} {want}");
            }
            assert!(path.moved(DVec2::X, -1.0, 0.0).is_err() && path.moved(DVec2::X, 0.0, f64::NAN).is_err());
        }
    }

    #[test]
    fn standstill_and_hostile_motion() {
        let still = |t: f64| EgoSample { time_s: t, speed_mps: 0.0, curvature_1pm: 0.3 };
        let path = EgoPath::new(&[still(0.0), still(1.0)], 0.0).unwrap();
        assert_eq!(path.moved(DVec2::new(9.0, 1.0), 0.0, 1.0).unwrap(), DVec2::new(9.0, 1.0));
        assert!(EgoPath::new(&[], 0.0).is_err() && EgoPath::new(&[still(0.0)], f64::NAN).is_err());
        assert!(EgoPath::new(&[still(1.0), still(0.0)], 0.0).is_err());
        assert!(EgoPath::new(&[EgoSample { speed_mps: f64::NAN, ..still(0.0) }], 0.0).is_err());
        assert!(
            EgoPath::new(&[EgoSample { speed_mps: 1e308, curvature_1pm: 1e308, ..still(0.0) }], 9.0).is_err()
        );
        assert!(Trail::fit(&[]).is_err() && Trail::fit(&[DVec2::X]).is_err());
        assert!(separate_lanes(&[], 3.5, 20.0).is_err());
    }

    #[test]
    fn arc_extension_meets_the_road() {
        for (radius, left) in [(100.0, true), (200.0, false), (500.0, true)] {
            let road = Road::curve(radius, left);
            let trail = Trail::fit(&way(&road, 35.0, 65.0, 0.0, 30, 0.0, 1)).unwrap();
            let start = trail.curve.span_m[0];
            let e = road.frenet(trail.at(start - 25.0).0).1.abs();
            println!("radius {radius} m: the way from 35 m extended by 25 m to the car lies {e:.3} m off");
            assert!(e < 0.3);
            assert!(trail.at(start - 1e-9).0.distance(trail.at(start + 1e-9).0) < 1e-6);
        }
        // An oncoming order of points gives the same way.
        let points = way(&Road::curve(150.0, true), 30.0, 60.0, 0.0, 20, 0.0, 1);
        let back: Vec<DVec2> = points.iter().rev().copied().collect();
        let (a, b) = (Trail::fit(&points).unwrap(), Trail::fit(&back).unwrap());
        assert!(a.at(a.curve.span_m[0]).0.distance(b.at(b.curve.span_m[0]).0) < 1e-9);
    }

    #[test]
    fn lanes_of_three_targets() {
        let mut draws = Draws::new(12, 0);
        for noise in [0.0, 0.15, 0.3] {
            let (mut right, mut all) = (0, 0);
            for run in 0..100 {
                let road = Road::curve(120.0 + 600.0 * draws.uniform(), draws.uniform() < 0.5);
                let lanes: Vec<i32> = (0..3).map(|_| (3.0 * draws.uniform()) as i32 - 1).collect();
                let trails: Vec<Trail> = lanes
                    .iter()
                    .enumerate()
                    .map(|(i, lane)| {
                        let from = 25.0 + 12.0 * i as f64;
                        let points = way(
                            &road,
                            from,
                            from + 30.0,
                            3.5 * f64::from(*lane),
                            40,
                            noise,
                            100 * run + i as u64,
                        );
                        Trail::fit(&points).unwrap()
                    })
                    .collect();
                for (place, lane) in separate_lanes(&trails, 3.5, 40.0).unwrap().iter().zip(&lanes).skip(1) {
                    all += 1;
                    right += usize::from(place.as_ref().is_ok_and(|p| p.lane == lane - lanes[0]));
                }
            }
            println!("noise {noise} m: {right} of {all} targets in their lane");
            assert!(right * 100 >= all * 98, "{noise}");
        }
    }

    #[test]
    fn far_apart_targets_need_extension() {
        let road = Road::curve(250.0, true);
        let a = Trail::fit(&way(&road, 20.0, 40.0, 0.0, 30, 0.0, 1)).unwrap();
        let b = Trail::fit(&way(&road, 60.0, 90.0, 3.5, 30, 0.0, 1)).unwrap();
        let o = a.offset_to(&b, 40.0).unwrap();
        assert!((o.offset_m - 3.5).abs() < 0.2 && (o.extension_m - 20.0).abs() < 2.0, "{o:?}");
        assert!(a.offset_to(&b, 5.0).is_err());
        assert!(a.offset_to(&b, f64::NAN).is_err());
    }
}
