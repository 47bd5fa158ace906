//! Peaks of a scan, and the selection of stationary ones (Miyake, sections III and IV).

use crate::Measured;
use crate::error::{LaneError, Result, finite, not_negative, positive};
use crate::standing::{StandingGate, radar_velocity_mps};
use glam::DVec2;
use serde::{Deserialize, Serialize};

/// A peak of the radar image in the sensor frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Peak {
    /// Range, m.
    pub range_m: f64,
    /// Azimuth, rad, positive to the left of the radar's boresight.
    pub azimuth_rad: f64,
    /// Range rate, m/s, positive when receding; unfolded.
    pub range_rate_mps: f64,
    /// Power, linear, in any unit common to all peaks of a scan; a MUSIC spectrum serves, too.
    pub power: f64,
    /// Standard deviation of the range, m.
    pub range_std_m: f64,
    /// Standard deviation of the azimuth, rad.
    pub azimuth_std_rad: f64,
    /// Standard deviation of the range rate, m/s.
    pub range_rate_std_mps: f64,
}

/// Position and yaw of the radar in the vehicle frame.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RadarMount {
    /// Distance of the radar forward of the vehicle's origin, m.
    pub x_m: f64,
    /// Distance of the radar to the left of the vehicle's origin, m.
    pub y_m: f64,
    /// Direction of the radar's boresight from the vehicle's x axis, rad, positive left.
    pub yaw_rad: f64,
}

/// Motion of the vehicle's origin along its own x axis (without side slip there).
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ego {
    /// Speed along the vehicle's x axis, m/s.
    pub speed_mps: f64,
    /// Standard deviation of the speed, m/s.
    #[serde(default)]
    pub speed_std_mps: f64,
    /// Yaw rate, rad/s, positive to the left; 0 where it is unknown.
    #[serde(default)]
    pub yaw_rate_radps: f64,
    /// Standard deviation of the yaw rate, rad/s.
    #[serde(default)]
    pub yaw_rate_std_radps: f64,
}

/// Gate of the stationary points.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct StaticGate {
    /// Half width of the gate in standard deviations.
    pub sigmas: f64,
    /// Error of the range rate beyond the peak's own standard deviation, added to it, m/s.
    pub floor_mps: f64,
    /// Least range of points that are used, m.
    pub min_range_m: f64,
    /// Largest range of points that are used, m.
    pub max_range_m: f64,
    /// Ambiguity of the range rate, m/s: where it is known only modulo this (λ/2T of a chirp sequence), the
    /// gate accepts any fold.
    pub fold_mps: Option<f64>,
}

impl Default for StaticGate {
    fn default() -> Self {
        Self { sigmas: 3.0, floor_mps: 0.1, min_range_m: 2.0, max_range_m: 150.0, fold_mps: None }
    }
}

/// A stationary point in the vehicle frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StaticPoint {
    /// Distance forward of the vehicle's origin, m.
    pub x_m: f64,
    /// Distance to the left of the vehicle's origin, m.
    pub y_m: f64,
    /// Covariance of (x, y): xx, xy, yy, m².
    pub covariance_m2: [f64; 3],
    /// Power of the peak, in the peaks' unit.
    pub power: f64,
}

/// Result of [`static_points`] for a scan. The three counts and the points add up to the number of peaks.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct StaticScan {
    /// The stationary points.
    pub points: Vec<StaticPoint>,
    /// Number of peaks whose range rate is not that of a stationary point.
    pub moving: usize,
    /// Number of peaks outside the gate's range.
    pub out_of_range: usize,
    /// Number of peaks with a non-finite value, a negative standard deviation or no power.
    pub unusable: usize,
}

/// Range rate of a stationary point at this azimuth, m/s: −**u**·**v** with **v** the radar's velocity
/// (Miyake, section IV: −speed straight ahead; yaw rate and lever arm are added here).
pub fn expected_range_rate_mps(azimuth_rad: f64, mount: &RadarMount, ego: &Ego) -> f64 {
    let arm_m = DVec2::new(mount.x_m, mount.y_m);
    let v = radar_velocity_mps(ego.speed_mps, ego.yaw_rate_radps, arm_m);
    -DVec2::from_angle(azimuth_rad + mount.yaw_rad).dot(v)
}

/// Selects the stationary points of a scan and converts them to the vehicle frame.
///
/// The gate is `sigmas` times the standard deviation of measured minus expected range rate: the peak's own,
/// that of speed and yaw rate, the effect of the azimuth's standard deviation on −v cos(az), and the floor. A
/// car that crosses or stands passes. Invalid peaks are counted, not refused.
///
/// # Errors
/// Returns an error if a value of `mount`, `ego` or `gate` is non-finite or of the wrong sign.
pub fn static_points(peaks: &[Peak], mount: &RadarMount, ego: &Ego, gate: &StaticGate) -> Result<StaticScan> {
    check_mount(mount)?;
    finite("ego speed", ego.speed_mps)?;
    not_negative("standard deviation of the ego speed", ego.speed_std_mps)?;
    finite("ego yaw rate", ego.yaw_rate_radps)?;
    not_negative("standard deviation of the yaw rate", ego.yaw_rate_std_radps)?;
    positive("gate of the range rate", gate.sigmas)?;
    not_negative("floor of the range-rate gate", gate.floor_mps)?;
    not_negative("least range", gate.min_range_m)?;
    positive("greatest range", gate.max_range_m)?;
    if let Some(fold) = gate.fold_mps {
        positive("ambiguity interval of the range rate", fold)?;
    }
    let speed = Measured { value: ego.speed_mps, std: ego.speed_std_mps };
    let yaw_rate = Measured { value: ego.yaw_rate_radps, std: ego.yaw_rate_std_radps };
    let standing = StandingGate {
        sigmas: gate.sigmas,
        tolerance_mps: gate.floor_mps,
        fold_mps: gate.fold_mps,
        ..StandingGate::of_vehicle(speed, yaw_rate, DVec2::new(mount.x_m, mount.y_m))
    };
    let mut scan = StaticScan::default();
    for p in peaks {
        if !usable(p) {
            scan.unusable += 1;
            continue;
        }
        if p.range_m < gate.min_range_m || p.range_m > gate.max_range_m {
            scan.out_of_range += 1;
            continue;
        }
        let (sin, cos) = (p.azimuth_rad + mount.yaw_rad).sin_cos();
        let range_rate = Measured { value: p.range_rate_mps, std: p.range_rate_std_mps };
        if !standing.passes(p.azimuth_rad + mount.yaw_rad, p.azimuth_std_rad, range_rate) {
            scan.moving += 1;
            continue;
        }
        // Azimuth noise pulls the mean position towards the radar by exp(−σ²/2).
        let range_m = p.range_m * (0.5 * p.azimuth_std_rad.powi(2)).exp();
        let (along, across) = (p.range_std_m.powi(2), (p.range_m * p.azimuth_std_rad).powi(2));
        scan.points.push(StaticPoint {
            x_m: mount.x_m + range_m * cos,
            y_m: mount.y_m + range_m * sin,
            covariance_m2: [
                cos * cos * along + sin * sin * across,
                sin * cos * (along - across),
                sin * sin * along + cos * cos * across,
            ],
            power: p.power,
        });
    }
    Ok(scan)
}

fn check_mount(mount: &RadarMount) -> Result<()> {
    finite("mounting x", mount.x_m)?;
    finite("mounting y", mount.y_m)?;
    finite("mounting yaw", mount.yaw_rad).map(|_| ())
}

fn usable(p: &Peak) -> bool {
    let std = [p.range_std_m, p.azimuth_std_rad, p.range_rate_std_mps];
    p.range_m.is_finite()
        && p.range_m >= 0.0
        && p.azimuth_rad.is_finite()
        && p.range_rate_mps.is_finite()
        && p.power.is_finite()
        && p.power > 0.0
        && std.iter().all(|s| s.is_finite() && *s >= 0.0)
        && p.azimuth_std_rad < 1.0
}

/// Estimates the ego speed from the peaks themselves, for a car that does not turn: the speed on which most
/// peaks agree, then their weighted mean. `min_share` of the peaks within ±60° must agree (0.3 is usual; a
/// jam that crawls along with the car fails it or, worse, wins).
///
/// # Errors
/// Returns an error for an invalid `mount`, `gate` or `min_share`, for too few peaks, or if there is no
/// common speed.
pub fn ego_speed(peaks: &[Peak], mount: &RadarMount, gate: &StaticGate, min_share: f64) -> Result<Ego> {
    check_mount(mount)?;
    positive("least share", min_share)?;
    positive("gate of the range rate", gate.sigmas)?;
    not_negative("floor of the range-rate gate", gate.floor_mps)?;
    let speeds: Vec<(f64, f64)> = peaks
        .iter()
        .filter(|p| usable(p))
        .filter_map(|p| {
            let (sin, cos) = (p.azimuth_rad + mount.yaw_rad).sin_cos();
            let v = -p.range_rate_mps / cos;
            let variance = (p.range_rate_std_mps.powi(2) + gate.floor_mps.powi(2)) / (cos * cos)
                + (v * sin / cos * p.azimuth_std_rad).powi(2);
            (cos > 0.5 && variance > 0.0).then_some((v, variance))
        })
        .collect();
    const NEEDED: usize = 4;
    if speeds.len() < NEEDED {
        return Err(LaneError::too_few("points", speeds.len(), NEEDED));
    }
    let near = |centre: f64| {
        let limit = gate.sigmas * gate.sigmas;
        speeds.iter().filter(move |(v, var)| (v - centre).powi(2) <= limit * var)
    };
    // Ties go to the first peak.
    let (mut centre, mut best) = (0.0, 0);
    for (v, _) in &speeds {
        let n = near(*v).count();
        if n > best {
            (centre, best) = (*v, n);
        }
    }
    let share = best as f64 / speeds.len() as f64;
    if share < min_share || best < NEEDED {
        return Err(LaneError::refused(format!(
            "the best speed explains a share of {share:.2} of the peaks where {min_share:.2} is needed"
        )));
    }
    let mut variance = 0.0;
    for _ in 0..3 {
        let (sum, weight) = near(centre).fold((0.0, 0.0), |(s, w), (v, var)| (s + v / var, w + 1.0 / var));
        if weight <= 0.0 {
            return Err(LaneError::undetermined("the curve"));
        }
        (centre, variance) = (sum / weight, 1.0 / weight);
    }
    Ok(Ego { speed_mps: centre, speed_std_mps: variance.sqrt(), ..Ego::default() })
}
