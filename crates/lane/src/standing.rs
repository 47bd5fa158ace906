//! What stands still: points whose range rate is that of the radar's own motion.

use crate::Measured;
use glam::DVec2;

/// Velocity of a radar over the ground in the vehicle's axes, m/s, where it stands at `arm_m` from the vehicle's reference point.
pub(crate) fn radar_velocity_mps(speed_mps: f64, yaw_rate_rad_per_s: f64, arm_m: DVec2) -> DVec2 {
    DVec2::new(speed_mps - yaw_rate_rad_per_s * arm_m.y, yaw_rate_rad_per_s * arm_m.x)
}

/// The gate of range rates of what stands still.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct StandingGate {
    /// Of the radar over the ground, in the axes from which azimuths count.
    pub velocity_mps: DVec2,
    pub speed_std_mps: f64,
    pub yaw_rate_std_rad_per_s: f64,
    /// From the vehicle's reference point to the radar.
    pub arm_m: DVec2,
    /// Half the gate in standard deviations of the difference.
    pub sigmas: f64,
    /// Range rates of standing things scatter by this beyond their noise.
    pub tolerance_mps: f64,
    /// Range rates are known modulo this.
    pub fold_mps: Option<f64>,
}

impl StandingGate {
    /// The gate of a radar on a vehicle that goes at this speed and turns at this rate.
    pub fn of_vehicle(speed: Measured, yaw_rate: Measured, arm_m: DVec2) -> StandingGate {
        StandingGate {
            velocity_mps: radar_velocity_mps(speed.value, yaw_rate.value, arm_m),
            speed_std_mps: speed.std,
            yaw_rate_std_rad_per_s: yaw_rate.std,
            arm_m,
            ..StandingGate::default()
        }
    }

    /// Whether a point with this azimuth (rad) and range rate (m/s) stands. A non-finite one does not; of standard deviations those
    /// that are non-finite do not count.
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
