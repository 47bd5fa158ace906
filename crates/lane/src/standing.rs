//! Test for stationary points: points whose range rate agrees with the radar's own motion.

use crate::Measured;
use glam::DVec2;

/// Velocity of a radar over the ground in the vehicle's axes, m/s, if the radar is at `arm_m` from the
/// vehicle's reference point.
pub(crate) fn radar_velocity_mps(speed_mps: f64, yaw_rate_rad_per_s: f64, arm_m: DVec2) -> DVec2 {
    DVec2::new(speed_mps - yaw_rate_rad_per_s * arm_m.y, yaw_rate_rad_per_s * arm_m.x)
}

/// Gate for the range rates of stationary points.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct StandingGate {
    /// Velocity of the radar over the ground, in the axes in which azimuths are measured, m/s.
    pub velocity_mps: DVec2,
    pub speed_std_mps: f64,
    pub yaw_rate_std_rad_per_s: f64,
    /// Vector from the vehicle's reference point to the radar, m.
    pub arm_m: DVec2,
    /// Half width of the gate in standard deviations of the difference.
    pub sigmas: f64,
    /// Error of stationary points' range rates beyond their noise, m/s.
    pub tolerance_mps: f64,
    /// Interval modulo which range rates are known, m/s.
    pub fold_mps: Option<f64>,
}

impl StandingGate {
    /// Makes the gate of a radar on a vehicle with this speed and yaw rate.
    pub fn of_vehicle(speed: Measured, yaw_rate: Measured, arm_m: DVec2) -> StandingGate {
        StandingGate {
            velocity_mps: radar_velocity_mps(speed.value, yaw_rate.value, arm_m),
            speed_std_mps: speed.std,
            yaw_rate_std_rad_per_s: yaw_rate.std,
            arm_m,
            ..StandingGate::default()
        }
    }

    /// Whether a point with this azimuth (rad) and range rate (m/s) is stationary. A non-finite point is not;
    /// non-finite standard deviations are ignored.
    pub fn passes(&self, azimuth_rad: f64, azimuth_std_rad: f64, range_rate: Measured) -> bool {
        let u = DVec2::from_angle(azimuth_rad);
        let mut off = range_rate.value + self.velocity_mps.dot(u);
        if let Some(fold) = self.fold_mps.filter(|f| *f > 0.0) {
            off -= fold * (off / fold).round();
        }
        // The azimuth's error turns the expected rate.
        let turn = self.velocity_mps.perp_dot(u) * azimuth_std_rad;
        let lever = self.yaw_rate_std_rad_per_s * self.arm_m.perp_dot(u);
        let std = [range_rate.std, self.speed_std_mps * u.x, turn, lever, self.tolerance_mps];
        let variance: f64 = std.iter().filter(|s| s.is_finite()).map(|s| s * s).sum();
        off.abs() <= self.sigmas * variance.sqrt()
    }
}
