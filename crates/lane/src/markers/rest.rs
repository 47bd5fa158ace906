//! Stationary points: the radar's own velocity from the points, and the points that agree with it (Feng 2019,
//! section 5.1.1).

use super::scan::MarkerPattern;
use crate::{LanePoint, Measured};
use catseye::detect::ego_motion::{EgoModel, EgoSettings, Radial, ego_motion};
use glam::{DMat2, DVec2};

/// Motion of the radar over the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RadarMotion {
    /// Velocity along x and y of the vehicle's level frame, m/s.
    pub velocity_mps: [f64; 2],
    /// Covariance of the velocity, m²/s².
    pub covariance: [[f64; 2]; 2],
}

impl RadarMotion {
    /// Makes a motion straight ahead.
    pub fn along_x(speed: Measured) -> RadarMotion {
        RadarMotion {
            velocity_mps: [speed.value, 0.0],
            covariance: [[speed.std * speed.std, 0.0], [0.0, 0.0]],
        }
    }

    /// Speed towards an azimuth, m/s, with its standard deviation.
    pub fn towards(&self, azimuth_rad: f64) -> Measured {
        let u = DVec2::from_angle(azimuth_rad);
        let c = &self.covariance;
        let spread = u.x * u.x * c[0][0] + 2.0 * u.x * u.y * c[0][1] + u.y * u.y * c[1][1];
        Measured { value: u.dot(DVec2::from_array(self.velocity_mps)), std: spread.max(0.0).sqrt() }
    }

    /// Effect of a point's azimuth error on its expected range rate, m/s.
    fn turned_mps(&self, p: &LanePoint) -> f64 {
        let across = DVec2::from_angle(p.azimuth_rad).perp_dot(DVec2::from_array(self.velocity_mps));
        across.abs() * (p.std_m[1] / p.range_m.max(0.1)).min(1.0)
    }
}

/// Speed along x on which most points agree if they are stationary: the middle of the densest half
/// (half-sample mode) of -range rate / cos azimuth. None for fewer than three points within 60 degrees of the
/// x axis.
pub fn speed_from_rest(points: &[LanePoint]) -> Option<Measured> {
    let mut all: Vec<f64> = points
        .iter()
        .filter(|p| p.azimuth_rad.cos().abs() > 0.5)
        .map(|p| -p.range_rate_mps / p.azimuth_rad.cos())
        .filter(|v| v.is_finite())
        .collect();
    if all.len() < 3 {
        return None;
    }
    all.sort_by(f64::total_cmp);
    let mut some = &all[..];
    while some.len() > 3 {
        let half = some.len().div_ceil(2);
        let spread = |k: &usize| some[k + half - 1] - some[*k];
        let k = (0..=some.len() - half).min_by(|a, b| spread(a).total_cmp(&spread(b)))?;
        some = &some[k..k + half];
    }
    let mode = some[some.len() / 2];
    // The points around the mode tell its uncertainty.
    let typical = points.iter().map(|p| p.range_rate_std_mps).sum::<f64>() / points.len() as f64;
    let near: Vec<f64> = all.iter().copied().filter(|v| (v - mode).abs() < 4.0 * typical.max(1e-3)).collect();
    let n = near.len().max(1) as f64;
    let mean = near.iter().sum::<f64>() / n;
    Some(Measured { value: if mean.is_finite() { mean } else { mode }, std: typical / n.sqrt() })
}

/// Resolution of the search for the ego-motion, m/s.
const COARSE_MPS: f64 = 0.05;
/// Standard deviation of the radar's sideways speed, m/s. It keeps rows straight ahead, which do not
/// determine that speed, from giving it.
const SIDEWAYS_MPS: f64 = 1.0;
/// Iterations of the reweighted fit.
const ROUNDS: usize = 8;

/// Range rate as it would be level with the radar: markers lie on the road, `radar_height_m` below it.
fn level_rate_mps(p: &LanePoint, options: &MarkerPattern) -> f64 {
    let sine = (options.radar_height_m / p.range_m.max(options.radar_height_m).max(1e-3)).min(0.9);
    p.range_rate_mps / (1.0 - sine * sine).sqrt()
}

/// Velocity of the radar on which most points agree if they are stationary, near `speed` where that is known.
/// It is the best of random samples (`detect::ego_motion`), refined by least squares with Cauchy weights.
/// None where neither the points nor `speed` determine it.
pub fn motion_from_rest(
    points: &[LanePoint],
    speed: Option<Measured>,
    options: &MarkerPattern,
) -> Option<RadarMotion> {
    let radials: Vec<Radial> = points
        .iter()
        .map(|p| Radial {
            azimuth_rad: p.azimuth_rad,
            elevation_rad: 0.0,
            range_rate_mps: level_rate_mps(p, options),
            range_rate_std_mps: p.range_rate_std_mps.abs(),
            ambiguity_mps: f64::INFINITY,
            radar: 0,
        })
        .collect();
    let settings = EgoSettings { tolerance_mps: COARSE_MPS, min_inliers: 0.25, ..EgoSettings::default() };
    let searched = ego_motion(&radials, &EgoModel::Sensor, &settings).ok().map(|m| RadarMotion {
        velocity_mps: [m.value[0], m.value[1]],
        covariance: [[m.covariance[0][0], m.covariance[0][1]], [m.covariance[1][0], m.covariance[1][1]]],
    });
    // A convoy may outnumber what is stationary; the bus knows better.
    let near = |m: &RadarMotion| {
        let off = |s: Measured| (m.velocity_mps[0] - s.value).abs();
        speed.is_none_or(|s| off(s) <= options.sigmas * s.std.hypot(m.covariance[0][0].sqrt()) + COARSE_MPS)
            && m.velocity_mps[1].abs() < 3.0 * SIDEWAYS_MPS
    };
    let start = searched
        .filter(near)
        .or_else(|| speed.or_else(|| speed_from_rest(points)).map(RadarMotion::along_x))?;
    if !start.velocity_mps.iter().all(|v| v.is_finite()) {
        return None;
    }
    Some(refined(points, start, speed, options).unwrap_or(start))
}

fn refined(
    points: &[LanePoint],
    start: RadarMotion,
    speed: Option<Measured>,
    options: &MarkerPattern,
) -> Option<RadarMotion> {
    let mut now = start;
    for _ in 0..ROUNDS {
        let mut a = DMat2::from_diagonal(DVec2::new(0.0, SIDEWAYS_MPS.powi(-2)));
        let mut b = DVec2::ZERO;
        if let Some(s) = speed {
            let weight = s.std.max(1e-6).powi(-2);
            a.x_axis.x += weight;
            b.x += weight * s.value;
        }
        let (mut sum, mut count) = (0.0, 0.0);
        for p in points {
            let u = DVec2::from_angle(p.azimuth_rad);
            let closing = -level_rate_mps(p, options);
            let off = closing - now.towards(p.azimuth_rad).value;
            let std = p.range_rate_std_mps.hypot(now.turned_mps(p)).hypot(options.rate_error_mps).max(1e-4);
            if !off.is_finite() || off.abs() > options.sigmas * std.hypot(COARSE_MPS) {
                continue;
            }
            let weight = (std * std + off * off).recip();
            a += DMat2::from_cols(u * (u.x * weight), u * (u.y * weight));
            b += u * (closing * weight);
            sum += off * off / (std * std + off * off);
            count += 1.0;
        }
        let determinant = a.determinant();
        if count < 2.0 || determinant.is_nan() || determinant <= 1e-12 {
            return None;
        }
        let inverse = a.inverse();
        let v = inverse * b;
        // Cauchy weights of noise alone sum to half the count.
        let spread = (2.0 * sum / count).max(1.0);
        now = RadarMotion {
            velocity_mps: v.to_array(),
            covariance: (inverse * spread).transpose().to_cols_array_2d(),
        };
    }
    now.velocity_mps.iter().all(|v| v.is_finite()).then_some(now)
}

/// Largest difference in range of two directions in one cell, m.
const ONE_CELL_M: f64 = 0.5;

/// Tells for each point whether it agrees with the radar's motion as stationary. A cell that holds two
/// directions has one range rate, which has to lie between the rates expected of the two.
///
/// Where left and right markers fall into one cell and the array does not resolve them, the point appears
/// between them with the range rate of their true angle: such points look like moving ones.
pub fn at_rest(points: &[LanePoint], motion: &RadarMotion, options: &MarkerPattern) -> Vec<bool> {
    // Expected closing speed, and its tolerance.
    let due: Vec<(f64, f64)> = points
        .iter()
        .map(|p| {
            let towards = motion.towards(p.azimuth_rad);
            let std = p.range_rate_std_mps.hypot(towards.std).hypot(motion.turned_mps(p));
            (towards.value, options.sigmas * std + options.rate_error_mps)
        })
        .collect();
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|a, b| points[*a].range_rate_mps.total_cmp(&points[*b].range_rate_mps));
    let mut place = vec![0; points.len()];
    order.iter().enumerate().for_each(|(k, i)| place[*i] = k);
    (0..points.len())
        .map(|i| {
            let p = &points[i];
            let one_cell = |j: &usize| {
                points[*j].range_rate_mps == p.range_rate_mps
                    && (points[*j].range_m - p.range_m).abs() < ONE_CELL_M
            };
            let same_rate = |j: &&usize| points[**j].range_rate_mps == p.range_rate_mps;
            let after = order[place[i]..].iter().take_while(same_rate);
            let before = order[..place[i]].iter().rev().take_while(same_rate);
            let mut reach = (f64::INFINITY, f64::NEG_INFINITY);
            for j in after.chain(before).filter(|j| one_cell(j)) {
                reach = (reach.0.min(due[*j].0 - due[*j].1), reach.1.max(due[*j].0 + due[*j].1));
            }
            (reach.0..=reach.1).contains(&-level_rate_mps(p, options))
        })
        .collect()
}
