//! Roads with known shape and the peaks that a radar would give of their edges, for tests.

use super::{Ego, Peak, RadarMount, expected_range_rate_mps};

/// SplitMix64 with Box–Muller.
pub struct Noise(pub u64);

impl Noise {
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    pub fn normal(&mut self) -> f64 {
        let r = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        r * (2.0 * std::f64::consts::PI * self.uniform()).cos()
    }
}

/// The road's curvature at arc length s along the line that the car's origin drives, 1/m.
pub type Curvature<'a> = &'a dyn Fn(f64) -> f64;

const STEP_M: f64 = 0.25;

/// The line at distance `b` to the left, in the frame of a car at `s0` that is turned by `heading` to the
/// left of the road: from 10 m behind to `length` ahead.
pub fn edge_line(curvature: Curvature, s0: f64, b: f64, heading: f64, length: f64) -> Vec<[f64; 2]> {
    let go = |sign: f64, length: f64| {
        let mut line = Vec::new();
        let (mut x, mut y, mut t, mut s) = (0.0, 0.0, -heading, s0);
        for _ in 0..=(length / STEP_M) as usize {
            line.push([x - b * f64::sin(t), y + b * f64::cos(t)]);
            let ds = sign * STEP_M;
            let middle = t + 0.5 * ds * curvature(s + 0.25 * ds);
            x += ds * middle.cos();
            y += ds * middle.sin();
            t += ds * curvature(s + 0.5 * ds);
            s += ds;
        }
        line
    };
    let mut back = go(-1.0, 10.0);
    back.reverse();
    back.pop();
    back.extend(go(1.0, length));
    back
}

/// y of a line at `x`.
pub fn lateral(line: &[[f64; 2]], x: f64) -> f64 {
    let w = line.windows(2).find(|w| w[0][0] <= x && w[1][0] > x).expect("the line reaches x");
    w[0][1] + (w[1][1] - w[0][1]) * (x - w[0][0]) / (w[1][0] - w[0][0])
}

/// c0, c1 and b that the edge truly has at x = 0, for a heading of 0.
pub fn edge_state(c: f64, c1: f64, b: f64) -> [f64; 3] {
    [c / (1.0 - b * c), c1 / (1.0 - b * c).powi(3), b]
}

#[derive(Clone, Copy)]
pub struct Sight {
    pub near_m: f64,
    pub far_m: f64,
    pub spacing_m: f64,
    pub range_std_m: f64,
    pub azimuth_std_rad: f64,
    pub rate_std_mps: f64,
    /// Share of the points that are not detected.
    pub missing: f64,
    /// Spread of a wall's scatterers about its line, along both axes.
    pub rough_m: f64,
    pub mount: RadarMount,
}

impl Sight {
    pub fn with_azimuth_deg(deg: f64) -> Self {
        Self {
            near_m: 8.0,
            far_m: 80.0,
            spacing_m: 2.0,
            range_std_m: 0.15,
            azimuth_std_rad: deg.to_radians(),
            rate_std_mps: 0.1,
            missing: 0.2,
            rough_m: 0.1,
            mount: RadarMount::default(),
        }
    }
}

/// A peak of a body at (x, y) with velocity (vx, vy), both in vehicle axes, as the radar measures it.
pub fn peak(
    at: [f64; 2],
    velocity: [f64; 2],
    power: f64,
    ego: &Ego,
    sight: &Sight,
    noise: &mut Noise,
) -> Peak {
    let d = [at[0] - sight.mount.x_m, at[1] - sight.mount.y_m];
    let range = d[0].hypot(d[1]);
    let azimuth = d[1].atan2(d[0]) - sight.mount.yaw_rad;
    let own = (velocity[0] * d[0] + velocity[1] * d[1]) / range;
    let rate = expected_range_rate_mps(azimuth, &sight.mount, ego) + own;
    Peak {
        range_m: range + sight.range_std_m * noise.normal(),
        azimuth_rad: azimuth + sight.azimuth_std_rad * noise.normal(),
        range_rate_mps: rate + sight.rate_std_mps * noise.normal(),
        power,
        range_std_m: sight.range_std_m,
        azimuth_std_rad: sight.azimuth_std_rad,
        range_rate_std_mps: sight.rate_std_mps,
    }
}

/// Peaks of a standing line, one in `spacing_m` at a random place, exponential in power.
pub fn wall(line: &[[f64; 2]], ego: &Ego, sight: &Sight, noise: &mut Noise) -> Vec<Peak> {
    let mut peaks = Vec::new();
    let stride = (sight.spacing_m / STEP_M) as usize;
    for piece in line.windows(2).step_by(stride.max(1)) {
        let f = noise.uniform();
        let at =
            [0, 1].map(|k| piece[0][k] + f * (piece[1][k] - piece[0][k]) + sight.rough_m * noise.normal());
        let power = -(1.0 - noise.uniform()).ln();
        let seen = noise.uniform() >= sight.missing;
        if seen && at[0] >= sight.near_m && at[0].hypot(at[1]) <= sight.far_m {
            peaks.push(peak(at, [0.0; 2], power.max(1e-6), ego, sight, noise));
        }
    }
    peaks
}

/// A car of four peaks around (x, y).
pub fn car(at: [f64; 2], velocity: [f64; 2], ego: &Ego, sight: &Sight, noise: &mut Noise) -> Vec<Peak> {
    [[0.0, -0.8], [0.0, 0.8], [0.0, 0.0], [2.0, 0.0]]
        .iter()
        .map(|d| peak([at[0] + d[0], at[1] + d[1]], velocity, 30.0, ego, sight, noise))
        .collect()
}
