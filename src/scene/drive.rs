//! How a vehicle goes along a road, without the road: speed, lane changes and sway over time. `road` turns it into a motion.

use super::toml_file::{At, Document};
use crate::base::error::Result;
use schemars::JsonSchema;
use serde::Deserialize;
use std::f64::consts::TAU;

/// Speed and lateral motion of a vehicle on a road.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DriveTable {
    /// Constant speed along the lane, m/s.
    #[schemars(range(min = -150.0, max = 150.0))]
    pub speed_mps: At<f64>,
    /// Speed over time in place of `speed_mps`: pairs [time in s, speed in m/s] with linear interpolation,
    /// constant before the first and after the last.
    pub speed_profile: At<Vec<[f64; 2]>>,
    /// Lateral moves (lane changes), ordered by time.
    pub lane_change: Vec<LaneChange>,
    /// Sinusoidal sway about the lane centre.
    pub sway: Option<Sway>,
    /// Heading of the vehicle relative to its direction of travel, degrees, positive to the left.
    #[schemars(range(min = -180.0, max = 180.0))]
    pub heading_error_deg: f64,
}

/// A lateral move along a polynomial of fifth degree, without a step of acceleration.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LaneChange {
    /// Start time of the move, s.
    #[schemars(range(min = -1e6, max = 1e6))]
    pub at_s: f64,
    /// Lateral distance of the move, m, positive to the left in the direction of travel.
    #[schemars(range(min = -100.0, max = 100.0))]
    pub by_m: f64,
    /// Duration of the move, s.
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0))]
    pub over_s: f64,
}

/// Sinusoidal sway about the lane centre.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sway {
    /// Amplitude, m.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub amplitude_m: f64,
    /// Period, s.
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0))]
    pub period_s: f64,
    /// Phase at time zero as a fraction of a period.
    #[serde(default)]
    #[schemars(range(min = -1.0, max = 1.0))]
    pub phase: f64,
}

/// Speed and lateral motion that have been checked.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Drive {
    /// Pairs (time in s, speed in m/s), one or more, with rising times.
    pub speed: Vec<[f64; 2]>,
    /// Moves to the side.
    pub lane_changes: Vec<LaneChange>,
    /// Sinusoidal sway about the lane centre.
    pub sway: Option<Sway>,
    /// Angle between the vehicle and its way, rad.
    pub heading_error_rad: f64,
}

impl Drive {
    /// A drive at one speed along the middle of the lane.
    pub fn steady(speed_mps: f64) -> Drive {
        Drive { speed: vec![[0.0, speed_mps]], ..Drive::default() }
    }

    /// Whether speed and lateral place stay as they are.
    pub fn is_steady(&self) -> bool {
        self.speed.len() == 1 && self.lane_changes.is_empty() && self.sway.is_none()
    }

    /// Whether nothing moves.
    pub fn is_at_rest(&self) -> bool {
        self.is_steady() && self.speed[0][1] == 0.0
    }

    /// Speed at a time, m/s.
    pub fn speed_mps(&self, time_s: f64) -> f64 {
        let after = self.speed.partition_point(|p| p[0] <= time_s);
        match (after.checked_sub(1).map(|i| self.speed[i]), self.speed.get(after)) {
            (Some([t, v]), Some([u, w])) => v + (w - v) * (time_s - t) / (u - t),
            (Some([_, v]), None) => v,
            (None, Some([_, v])) => *v,
            (None, None) => 0.0,
        }
    }

    /// Distance travelled since time zero, m: the integral of the speed, exactly.
    pub fn distance_m(&self, time_s: f64) -> f64 {
        let (from, to) = if time_s >= 0.0 { (0.0, time_s) } else { (time_s, 0.0) };
        let inner = self.speed.iter().map(|p| p[0]).filter(|t| (from..to).contains(t) && *t > from);
        let mut way = 0.0;
        let mut last = from;
        for t in inner.chain([to]) {
            way += (t - last) * 0.5 * (self.speed_mps(last) + self.speed_mps(t));
            last = t;
        }
        if time_s >= 0.0 { way } else { -way }
    }

    /// Distance at `time_s` to the left of the vehicle's lateral place, m, from lane changes and sway.
    pub fn shift_m(&self, time_s: f64) -> f64 {
        let changes = self.lane_changes.iter().map(|c| {
            let u = ((time_s - c.at_s) / c.over_s).clamp(0.0, 1.0);
            c.by_m * u * u * u * (10.0 + u * (6.0 * u - 15.0))
        });
        let sway = self.sway.map_or(0.0, |s| s.amplitude_m * (TAU * (time_s / s.period_s + s.phase)).sin());
        changes.sum::<f64>() + sway
    }
}

/// Reads and checks a table.
///
/// # Errors
/// Returns an error if both keys state the speed, or if the times of the profile do not ascend.
pub fn build(doc: &Document<'_>, t: &DriveTable) -> Result<Drive> {
    let profile = &t.speed_profile;
    let speed = match profile.value.is_empty() {
        true => vec![[0.0, t.speed_mps.value]],
        false => {
            if t.speed_mps.value != 0.0 {
                let e = doc.bad(&t.speed_mps.span, "speed_mps and speed_profile exclude each other");
                return Err(e.remedy("keep one of them").into());
            }
            let ascends = profile.value.windows(2).all(|w| w[0][0] < w[1][0]);
            let allowed = |v: f64| (-150.0..=150.0).contains(&v);
            if !ascends || !profile.value.iter().all(|p| p[0].is_finite() && allowed(p[1])) {
                return Err(doc
                    .bad(&profile.span, "is not a speed over time")
                    .allowed("[time in s, speed in -150..=150 m/s], times ascending")
                    .remedy("give pairs, as in [[0, 20], [4, 12]]")
                    .into());
            }
            profile.value.clone()
        }
    };
    Ok(Drive {
        speed,
        lane_changes: t.lane_change.clone(),
        sway: t.sway,
        heading_error_rad: t.heading_error_deg.to_radians(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn way_is_the_integral_of_speed() {
        let d = Drive { speed: vec![[-1.0, 10.0], [1.0, 20.0], [3.0, 0.0]], ..Drive::default() };
        assert_eq!(
            (d.speed_mps(-5.0), d.speed_mps(0.0), d.speed_mps(2.0), d.speed_mps(9.0)),
            (10.0, 15.0, 10.0, 0.0)
        );
        for t in [-4.0, -0.7, 0.4, 1.0, 2.5, 8.0] {
            let n = 200_000;
            let sum: f64 = (0..n).map(|i| d.speed_mps(t * (f64::from(i) + 0.5) / f64::from(n))).sum();
            assert!((d.distance_m(t) - sum * t / f64::from(n)).abs() < 1e-6, "{t}");
        }
        let change = LaneChange { at_s: 1.0, by_m: -3.5, over_s: 4.0 };
        let d = Drive { lane_changes: vec![change], ..Drive::steady(10.0) };
        assert_eq!((d.shift_m(0.9), d.shift_m(3.0), d.shift_m(7.0)), (0.0, -1.75, -3.5));
    }
}
