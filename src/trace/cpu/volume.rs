//! Echoes of rain: samples of the volume in front of the antennas (CONVENTIONS eq. 154, 155).

use crate::base::frames::{Pose, Sensor, World, direction_from_angles};
use crate::base::rng::philox4x32_10;
use crate::base::tasks::Tasks;
use crate::base::units::C0;
use crate::geom::Geometry;
use crate::scene::radar::{Antenna, Radar, Sampling};
use crate::trace::air::{Air, FALLS};
use crate::trace::{Echo, MAX_BOUNCES, TraceOptions};
use glam::DVec3;
use num_complex::Complex64;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// Rain nearer than this is left out, m: there it is in the antennas' near field.
pub const NEAREST_M: f64 = 1.0;
/// Directions among which samples are drawn: steps of azimuth and of the sine of elevation.
const STEPS: [usize; 2] = [180, 90];
/// Gain relative to the peak, both ways, that directions have at least when samples are drawn: side lobes get theirs.
const GAIN_FLOOR: f64 = 1e-2;
/// Word of the random counter.
const STREAM: u32 = 0x5eed_7a17;

/// About `options.rays` echoes of the rain within the radar's unambiguous range, as many for each metre of range, most of them where the
/// antennas look. Each is an amount of drops with one size's fall velocity and a complex Gaussian amplitude; they are
/// new in each frame. What the air takes on the way is not in them yet.
pub fn echoes(
    geometry: &Geometry,
    radar: &Radar,
    pose: &Pose<Sensor, World>,
    velocity_mps: DVec3,
    air: &Air,
    options: &TraceOptions,
) -> Vec<Echo> {
    let farthest = farthest_m(radar);
    let Some(rain) = air.rain.filter(|_| options.rays > 0 && farthest > NEAREST_M) else {
        return Vec::new();
    };
    let looks = Looks::of(radar);
    let count = options.rays;
    let key = [options.seed as u32, (options.seed >> 32) as u32];
    let step = (farthest - NEAREST_M) / count as f64;
    let to_world = pose.rotation;
    let to_sensor = to_world.inverse();
    let echo = |i: u64| {
        let draws = |k: u32| {
            let counter = [i as u32, (i >> 32) as u32, options.frame, STREAM ^ k];
            philox4x32_10(counter, key).map(|w| (f64::from(w) + 0.5) / 2f64.powi(32))
        };
        let ([pick, a, b, along], [size, u, v, _]) = (draws(0), draws(1));
        let (seen, per_sr) = looks.draw(pick, a, b);
        let r = NEAREST_M + (i as f64 + along) * step;
        let dir = to_world * seen;
        if !geometry.sees(pose.translation_m, pose.translation_m + dir * r) {
            return None;
        }
        // 4 pi |S|^2 of all drops in the r^2 dr dOmega that it stands for.
        let sigma = rain.eta_per_m * r * r * step / per_sr;
        let s = Complex64::from_polar((-u.ln() * sigma / (4.0 * PI)).sqrt() / (r * r), TAU * v);
        let fall = rain.fall_mps[((size * FALLS as f64) as usize).min(FALLS - 1)];
        let drop_mps = rain.wind_mps - DVec3::Z * fall;
        let velocity_mps =
            to_sensor * (drop_mps - velocity_mps - options.radar_spin_rad_per_s.cross(dir * r));
        Some(Echo {
            path_length_m: 2.0 * r,
            path_rate_mps: 2.0 * seen.dot(velocity_mps),
            path_acceleration_and_jerk: [0.0; 2],
            departure: seen,
            first_range_m: r,
            first_velocity_mps: velocity_mps,
            arrival: seen,
            last_range_m: r,
            last_velocity_mps: velocity_mps,
            path_gain: [[s, Complex64::ZERO], [Complex64::ZERO, s]],
            chain: [0; MAX_BOUNCES],
            bounces: 1,
            between_m: Box::default(),
        })
    };
    (0..count).into_par_iter().filter_map_tasks(echo).collect()
}

/// Greatest range whose echoes the samples can tell.
fn farthest_m(radar: &Radar) -> f64 {
    let all = (0..radar.waveform.parts()).map(|i| C0 / (2.0 * radar.part(i).step_hz().abs()));
    let range = all.fold(0.0, f64::max);
    match radar.sampling {
        Sampling::Iq => range,
        Sampling::Real => 0.5 * range,
    }
}

/// Directions by how strongly the antennas see them.
struct Looks {
    /// Share of the samples up to each cell, azimuth fastest.
    up_to: Vec<f64>,
}

impl Looks {
    fn of(radar: &Radar) -> Looks {
        let [na, ne] = STEPS;
        let mut weights = Vec::with_capacity(na * ne);
        for j in 0..ne {
            for i in 0..na {
                let (azimuth, elevation) = Looks::angles(i as f64 + 0.5, j as f64 + 0.5);
                let best = |list: &[Antenna]| {
                    list.iter().map(|a| a.pattern.power_gain(azimuth, elevation)).fold(0.0, f64::max)
                };
                let gain = best(&radar.tx) * best(&radar.rx);
                weights.push(if gain > 0.0 { gain + GAIN_FLOOR } else { 0.0 });
            }
        }
        let total: f64 = weights.iter().sum();
        let mut sum = 0.0;
        for w in &mut weights {
            sum += *w / total;
            *w = sum;
        }
        Looks { up_to: weights }
    }

    /// Azimuth and elevation of a place on the grid of cells, rad.
    fn angles(i: f64, j: f64) -> (f64, f64) {
        let [na, ne] = STEPS;
        (TAU * (i / na as f64 - 0.5), (2.0 * j / ne as f64 - 1.0).clamp(-1.0, 1.0).asin())
    }

    /// A direction and how many of all samples a steradian about it gets.
    fn draw(&self, pick: f64, a: f64, b: f64) -> (DVec3, f64) {
        let [na, ne] = STEPS;
        let cell = self.up_to.partition_point(|x| *x < pick).min(na * ne - 1);
        let before = if cell == 0 { 0.0 } else { self.up_to[cell - 1] };
        let (azimuth, elevation) = Looks::angles((cell % na) as f64 + a, (cell / na) as f64 + b);
        let solid = 4.0 * PI / (na * ne) as f64;
        (direction_from_angles(azimuth, elevation), (self.up_to[cell] - before) / solid)
    }
}
