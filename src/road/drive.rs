//! Vehicles that follow a road: their drive as a motion in the world (CONVENTIONS eq. 143).

use crate::base::error::Result;
use crate::road::axis::RoadPoint;
use crate::road::layout::{Lateral, Road};
use crate::scene::drive::Drive;
use crate::scene::motion::{Channel, Interpolation, Joint, Motion};
use crate::scene::trajectory::STANDING_MPS;
use glam::{DQuat, DVec3};
use std::ops::Range;
use std::sync::Arc;

/// Between two keys of a motion: what a cubic through them leaves out of a road with clothoids is below a micrometre.
const KEY_S: f64 = 0.05;
/// Step with which the slopes at the keys are computed, s.
const STEP_S: f64 = 1e-4;
/// A way that leaves a straight line by less is one, m.
const STRAIGHT_M: f64 = 1e-9;

/// A vehicle on a road.
pub struct OnRoad<'a> {
    /// The road.
    pub road: &'a Road,
    /// Station of the vehicle at time zero, m.
    pub s_m: f64,
    /// Lateral place at which the vehicle goes.
    pub lateral: &'a Lateral,
    /// Whether it goes against the direction of the road.
    pub against: bool,
    /// Its speed and lateral motion.
    pub drive: &'a Drive,
}

fn keys(window_s: Range<f64>) -> Vec<f64> {
    let count = ((window_s.end - window_s.start) / KEY_S).ceil().max(1.0) as usize;
    (0..=count).map(|i| window_s.start + KEY_S * i as f64).collect()
}

impl OnRoad<'_> {
    fn place(&self, time_s: f64) -> (f64, DVec3) {
        let sign = if self.against { -1.0 } else { 1.0 };
        let s_m = self.s_m + sign * self.drive.distance_m(time_s);
        let t_m = self.road.t_m(self.lateral, s_m) + sign * self.drive.shift_m(time_s);
        (s_m, self.road.axis.world(RoadPoint { s_m, t_m, h_m: 0.0 }))
    }

    /// Place on the road's surface, and axes: x the way that it goes, z away from the surface.
    fn at(&self, time_s: f64) -> (DVec3, DQuat) {
        let (s_m, place) = self.place(time_s);
        let way = (self.place(time_s + STEP_S).1 - self.place(time_s - STEP_S).1) / (2.0 * STEP_S);
        let axis = self.road.axis.at(s_m);
        let along = glam::DVec2::from_angle(axis.heading_rad) * if self.against { -1.0 } else { 1.0 };
        // Backwards it keeps looking ahead; at rest it looks along the road.
        let ahead = match way.truncate().length() > 1e-3 {
            true => way.truncate() * way.truncate().dot(along).signum(),
            false => along,
        };
        let t_m = self.road.t_m(self.lateral, s_m);
        let up = self.road.axis.normal(s_m, t_m);
        let heading = ahead.to_angle() + self.drive.heading_error_rad;
        (place, crate::road::axis::tilt(up) * DQuat::from_rotation_z(heading))
    }

    /// Motion of the vehicle over a stretch of time, before and after which it stands still in it; as joints without
    /// keys where it goes straight on at a steady speed.
    ///
    /// # Errors
    /// Returns an error if the vehicle leaves the road, or turns sharper than the road allows.
    pub fn motion(&self, window_s: Range<f64>) -> Result<Motion> {
        let times = keys(window_s);
        let (place, turn) = self.at(0.0);
        // Of a straight way any two places give it, far ones without rounding.
        let velocity = 0.5 * (self.place(1.0).1 - self.place(-1.0).1);
        let places: Vec<(DVec3, DQuat)> = times.iter().map(|t| self.at(*t)).collect();
        let straight = self.drive.is_steady()
            && times.iter().zip(&places).all(|(t, (p, q))| {
                p.distance(place + velocity * *t) < STRAIGHT_M * (1.0 + t.abs() * velocity.length())
                    && q.dot(turn).abs() > 1.0 - 1e-15
            });
        if straight {
            let mut joints = vec![Joint::Fixed(turn, place)];
            if !self.drive.is_at_rest() {
                joints.push(Joint::Line(velocity));
            }
            return Ok(Motion { joints });
        }
        // Neighbouring quaternions on the same side, so that a cubic between them is short.
        let near = |q: DQuat, to: DQuat| if q.dot(to) < 0.0 { -q } else { q };
        let mut rotations = vec![places[0].1];
        for (_, q) in &places[1..] {
            rotations.push(near(*q, rotations[rotations.len() - 1]));
        }
        let slopes = times.iter().zip(&rotations).map(|(t, q)| {
            let (a, b) = (self.at(t - STEP_S), self.at(t + STEP_S));
            ((b.0 - a.0) / (2.0 * STEP_S), (near(b.1, *q) - near(a.1, *q)) * (0.5 / STEP_S))
        });
        let slopes: Vec<(DVec3, DQuat)> = slopes.collect();
        let kind = Interpolation::Cubic;
        let position = Channel::new(
            times.clone(),
            places.iter().map(|p| p.0).collect(),
            slopes.iter().map(|s| (s.0, s.0)).collect(),
            kind,
        )?;
        let rotation = Channel::new(times, rotations, slopes.iter().map(|s| (s.1, s.1)).collect(), kind)?;
        let joint = Joint::Track { position_m: Some(Arc::new(position)), rotation: Some(Arc::new(rotation)) };
        Ok(Motion { joints: vec![joint] })
    }

    /// Mean speed over that stretch of time while it moves, m/s; negative where it goes backwards.
    pub fn mean_speed_mps(&self, window_s: Range<f64>) -> f64 {
        let speeds = keys(window_s).into_iter().map(|t| self.drive.speed_mps(t));
        let (sum, count) = speeds
            .filter(|v| v.abs() > STANDING_MPS)
            .fold((0.0, 0.0), |(sum, count), v| (sum + v, count + 1.0));
        if count == 0.0 { 0.0 } else { sum / count }
    }

    /// Distance travelled since time zero over that stretch of time, m; None at a steady speed.
    ///
    /// # Errors
    /// Returns an error if the vehicle leaves the road, or turns sharper than the road allows.
    pub fn way_m(&self, window_s: Range<f64>) -> Result<Option<Channel<f64>>> {
        if self.drive.speed.len() == 1 {
            return Ok(None);
        }
        let times = keys(window_s);
        let way = times.iter().map(|t| self.drive.distance_m(*t)).collect();
        let speeds = times.iter().map(|t| [self.drive.speed_mps(*t); 2].into()).collect();
        Channel::new(times, way, speeds, Interpolation::Cubic).map(Some)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::road::scene_toml;
    use crate::scene::drive::LaneChange;
    use std::path::Path;

    fn road(plan: &str) -> Road {
        let text = format!(
            "name = \"r\"\n[[road]]\nname = \"a\"\nplan = [{plan}]\ngrade_percent = 3\n\
             right = [{{ width_m = 3.5 }}, {{ width_m = 3.5 }}]\nleft = [{{ width_m = 3.5 }}]\n"
        );
        scene_toml::parse(Path::new("r.toml"), &text).unwrap().roads.remove(0).road
    }

    /// Speed along the lane is what was asked for; velocity and spin are the slopes of place and rotation; in a left curve it turns left;
    /// against the road it looks back.
    #[test]
    fn follows_a_curve() {
        let road = road(
            "{ kind = \"straight\", length_m = 20 }, { kind = \"clothoid\", length_m = 40, to_radius_m = 60 }, \
             { kind = \"arc\", length_m = 60, radius_m = 60 }",
        );
        let lateral = Lateral::axis(-1.75);
        let drive = Drive { speed: vec![[0.0, 10.0], [2.0, 16.0]], ..Drive::default() };
        let on = OnRoad { road: &road, s_m: 5.0, lateral: &lateral, against: false, drive: &drive };
        let m = on.motion(-1.0..6.0).unwrap();
        let h = 1e-5;
        for t in [0.013, 0.9, 1.77, 3.21, 4.46] {
            let (a, b, c) = (m.at(t - h), m.at(t), m.at(t + h));
            assert!(((c.translation_m - a.translation_m) / (2.0 * h) - b.velocity_mps).length() < 1e-6);
            assert!(b.translation_m.distance(on.at(t).0) < 2e-6, "{t}");
            let s = 5.0 + drive.distance_m(t);
            let k = road.axis.at(s).curvature_per_m;
            // The lane lies outside of a left curve.
            let plan = b.velocity_mps.truncate().length() / (drive.speed_mps(t) * (1.0 + 1.75 * k));
            // At time zero the acceleration steps, which a cubic rounds off.
            assert!((plan - 1.0).abs() < 1e-5, "{t}: {plan}");
            let ahead = b.rotation * DVec3::X;
            assert!(ahead.truncate().angle_to(b.velocity_mps.truncate()).abs() < 1e-4);
            assert!(
                (b.spin_rad_per_s.z - k * drive.speed_mps(t)).abs() < 2e-3,
                "{t} {:?} {k}",
                b.spin_rad_per_s
            );
        }
        let against = OnRoad { against: true, s_m: 100.0, ..on };
        let m = against.motion(0.0..2.0).unwrap();
        let (on_s, then) = (road.axis.at(90.0).heading_rad, m.at(1.0));
        let ahead = then.rotation * DVec3::X;
        assert!(
            ahead.truncate().dot(glam::DVec2::from_angle(on_s)) < -0.9 && then.velocity_mps.dot(ahead) > 9.0
        );
    }

    #[test]
    fn straight_on_is_a_line_and_lanes_change() {
        let road = road("{ kind = \"straight\", length_m = 300 }");
        let lateral = Lateral::axis(-1.75);
        let drive = Drive::steady(20.0);
        let on = OnRoad { road: &road, s_m: 5.0, lateral: &lateral, against: false, drive: &drive };
        let line = on.motion(-1.0..10.0).unwrap();
        assert!(matches!(line.joints[..], [Joint::Fixed(..), Joint::Line(_)]), "{line:?}");
        let change = LaneChange { at_s: 1.0, by_m: 3.5, over_s: 4.0 };
        let drive = Drive { lane_changes: vec![change], ..Drive::steady(20.0) };
        let m = OnRoad { drive: &drive, ..on }.motion(-1.0..10.0).unwrap();
        assert!((m.at(0.5).translation_m.y + 1.75).abs() < 1e-9);
        assert!((m.at(6.0).translation_m.y - 1.75).abs() < 1e-9);
        // In the middle of the change: 1.875 by/over to the left.
        assert!((m.at(3.0).velocity_mps.y - 1.875 * 3.5 / 4.0).abs() < 1e-5);
    }
}
