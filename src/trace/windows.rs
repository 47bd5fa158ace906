//! The directions that a radar amid a scene looks into, cut into six square windows.

use super::beams::Frame;
use crate::base::frames::{Pose, Sensor, World, angles_from_direction};
use crate::scene::radar::Radar;
use glam::DVec3;

/// Windows in which the transmit antennas' gain is nowhere above this share of isotropic are left out.
const GAIN_FLOOR: f64 = 1e-9;
/// Directions along each side of a window at which the gain is looked up.
const SAMPLES: usize = 33;

/// The sides of a cube around the radar that its antennas light, the front first. Each is a frame of
/// perspective from the radar's phase centre; the directions with |u|, |v| <= 1 are its own.
pub fn windows(radar: &Radar, pose: &Pose<Sensor, World>) -> Vec<Frame> {
    lit_sides(radar).into_iter().zip(around(pose)).filter(|(is_lit, _)| *is_lit).map(|(_, w)| w).collect()
}

/// Which sides of a cube around the radar its transmit antennas light: ahead, left, right, behind, up, down.
pub fn lit_sides(radar: &Radar) -> [bool; 6] {
    let lit = |d: DVec3| {
        let (azimuth, elevation) = angles_from_direction(d);
        radar.tx.iter().any(|t| t.pattern.power_gain(azimuth, elevation) > GAIN_FLOOR)
    };
    SIDES.map(|[k, u, v]| {
        let at = |i: usize| 2.0 * i as f64 / (SAMPLES - 1) as f64 - 1.0;
        (0..SAMPLES * SAMPLES).any(|i| lit((k + u * at(i % SAMPLES) + v * at(i / SAMPLES)).normalize()))
    })
}

/// The frames of all six sides of a cube around the radar.
pub fn around(pose: &Pose<Sensor, World>) -> [Frame; 6] {
    SIDES.map(|side| {
        let [k, u, v] = side.map(|d| pose.rotation * d);
        Frame { origin: pose.translation_m, u, v, k, from_point: true, lead_m: 0.0 }
    })
}

/// Axes (k, u, v) of the windows, sensor frame.
const SIDES: [[DVec3; 3]; 6] = [
    [DVec3::X, DVec3::Y, DVec3::Z],
    [DVec3::Y, DVec3::NEG_X, DVec3::Z],
    [DVec3::NEG_Y, DVec3::X, DVec3::Z],
    [DVec3::NEG_X, DVec3::NEG_Y, DVec3::Z],
    [DVec3::Z, DVec3::Y, DVec3::NEG_X],
    [DVec3::NEG_Z, DVec3::Y, DVec3::X],
];
