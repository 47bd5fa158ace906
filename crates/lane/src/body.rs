//! Estimates where the middle of a vehicle lies, given the place at which a radar sees it.
//!
//! A vehicle echoes from few places: its corners and wheel houses, each seen from its own side, and its flat
//! ends, which reflect specularly only what falls on them squarely (Bühren and Yang, "Simulation of
//! automotive radar target lists using a novel approach of object representation", IEEE Intelligent Vehicles
//! Symposium 2006). So the echo lies on the side that faces the radar, half a width from the middle. Where
//! the radar stands behind or ahead of the vehicle, within its width, the echo may lie anywhere on that
//! width.

use super::Measured;
use crate::numeric::erf;
use glam::{DMat2, DVec2};
use std::f64::consts::{PI, SQRT_2};

/// Distance of the wheel houses from the middle as a share of the vehicle's length: a wheelbase is about 0.6
/// of it.
const WHEEL_HOUSE: f64 = 0.3;

/// Size of a vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Body {
    /// Length over all, m.
    pub length_m: f64,
    /// Width over all, m.
    pub width_m: f64,
    /// Standard deviation of the width from vehicle to vehicle, m.
    pub width_std_m: f64,
}

/// The step from an echo to the middle of its vehicle, with its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// The step from the echo to the middle, m.
    pub by_m: DVec2,
    /// Covariance of that step, m².
    pub covariance_m2: DMat2,
}

impl Body {
    /// A typical passenger car.
    pub const CAR: Body = Body { length_m: 4.5, width_m: 1.8, width_std_m: 0.15 };

    /// Returns how far to the left of the echo the vehicle's middle lies, m, with its standard deviation.
    /// `radar_left_m` is how far to the left of the echo the radar stands; both are measured across the
    /// vehicle. `std_m` is the error of the radar's place: range times the error of the vehicle's direction.
    ///
    /// Let u be the radar's place and s its error, with every place of the middle equally likely. Then the
    /// radar is beyond the left side with weight Φ(u/s), beyond the right side with Φ(-u/s), and within the
    /// width W with W φ(u/s)/s. In the last case the echo lies on the radar's own line along the vehicle, and
    /// u is nothing but error.
    pub fn left_m(&self, radar_left_m: f64, std_m: f64) -> Measured {
        let half = 0.5 * self.width_m;
        let unknown = Measured { value: 0.0, std: self.width_m / 12f64.sqrt() };
        if !(radar_left_m.is_finite() && std_m.is_finite() && std_m >= 0.0) {
            return unknown;
        }
        let std_m = std_m.max(1e-6);
        let z = radar_left_m / std_m;
        let within = self.width_m / std_m * (-0.5 * z * z).exp() / (2.0 * PI).sqrt();
        let side = 1.0 / (1.0 + within);
        let value = -half * side * erf(z / SQRT_2);
        let square = side * (half * half + 0.25 * self.width_std_m.powi(2))
            + (1.0 - side) * (unknown.std * unknown.std);
        Measured { value, std: (square - value * value).max(0.0).sqrt() }
    }

    /// Returns the step from the echo to the vehicle's middle. The echo is at `from_m` from the radar, and
    /// the vehicle points along `heading_rad`; `direction_std_rad` is the error of that direction and
    /// `across_std_m` the error of the echo across the vehicle.
    ///
    /// Along the vehicle the echo comes from the corner of the end that faces the radar or from one of the
    /// wheel houses on that side. The step uses the mean of these three, with the end weighted by how wide it
    /// is seen.
    pub fn to_middle(
        &self,
        from_m: DVec2,
        heading_rad: f64,
        direction_std_rad: f64,
        across_std_m: f64,
    ) -> Step {
        let ahead = DVec2::from_angle(heading_rad);
        let seen = from_m.perp_dot(ahead);
        let left = self.left_m(seen, (from_m.length() * direction_std_rad).hypot(across_std_m));
        let places = [0.5, WHEEL_HOUSE, -WHEEL_HOUSE];
        let mean = places.iter().sum::<f64>() / 3.0;
        let spread = places.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / 3.0;
        let facing = from_m.normalize_or_zero().dot(ahead);
        let turn = DMat2::from_cols(ahead, ahead.perp());
        let own = DVec2::new(spread * self.length_m.powi(2), left.std.powi(2));
        Step {
            by_m: ahead * (mean * self.length_m * facing) + ahead.perp() * left.value,
            covariance_m2: turn * DMat2::from_diagonal(own) * turn.transpose(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAR: Body = Body { width_std_m: 0.0, ..Body::CAR };

    #[test]
    fn the_middle_lies_away_from_the_radar() {
        for (radar, middle) in [(5.0, -0.9), (-5.0, 0.9), (1e9, -0.9)] {
            let m = CAR.left_m(radar, 0.3);
            assert!((m.value - middle).abs() < 1e-9 && m.std < 1e-4, "{radar} {m:?}");
        }
        // Seen squarely from behind it lies anywhere on the width.
        let square = CAR.left_m(0.0, 0.01);
        assert!(square.value == 0.0 && (square.std - 1.8 / 12f64.sqrt()).abs() < 0.01, "{square:?}");
        // A direction that tells nothing leaves both sides.
        let blind = CAR.left_m(0.5, 1e4);
        assert!(blind.value.abs() < 1e-4 && (blind.std - 0.9).abs() < 1e-3, "{blind:?}");
        // The width's own spread stays.
        assert!((Body::CAR.left_m(9.0, 0.3).std - 0.075).abs() < 1e-6);
        for bad in [(f64::NAN, 1.0), (1.0, f64::NAN), (1.0, -1.0), (f64::INFINITY, 1.0)] {
            assert_eq!(CAR.left_m(bad.0, bad.1).value, 0.0);
        }
        assert_eq!(CAR.left_m(1.0, 0.0).value, -0.9);
    }

    /// Against draws: radars at random beside vehicles that return from their nearest place across.
    #[test]
    fn the_mean_and_its_spread_are_those_of_draws() {
        let mut draws = catseye::base::rng::Draws::new(3, 0);
        let std = 0.6;
        // By where the radar seems to be: how far the middle lies to the left of the echo.
        let mut seen: Vec<Vec<f64>> = vec![Vec::new(); 12];
        for _ in 0..400_000 {
            let radar = 12.0 * draws.uniform() - 6.0;
            let echo = radar.clamp(-0.9, 0.9);
            let bin = (radar - echo + std * draws.normal()) / 0.25;
            if (0.0..12.0).contains(&bin) {
                seen[bin as usize].push(-echo);
            }
        }
        for (i, v) in seen.iter().enumerate() {
            let n = v.len() as f64;
            let mean = v.iter().sum::<f64>() / n;
            let spread = (v.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt();
            let said = CAR.left_m(0.25 * (i as f64 + 0.5), std);
            let close = (said.value - mean).abs() < 0.03 && (said.std - spread).abs() < 0.03;
            assert!(close, "{i}: {said:?} {mean} {spread}");
        }
    }

    #[test]
    fn steps_turn_with_the_vehicle() {
        // From behind and to the right, 20 m away, the vehicle points along y.
        let heading = 0.5 * PI;
        let from = DVec2::new(-4.0, 20.0);
        let step = CAR.to_middle(from, heading, 0.01, 0.05);
        // The echo is its right side: the middle lies to its left, and ahead.
        assert!((step.by_m.x + 0.9).abs() < 1e-6, "{step:?}");
        assert!(step.by_m.y > 0.0 && step.by_m.y < 0.75, "{step:?}");
        let c = step.covariance_m2;
        assert!(c.x_axis.x < 0.01 && (c.y_axis.y.sqrt() - 1.53).abs() < 0.01 && c.x_axis.y.abs() < 1e-9);
        // Turned with all that it is made of, the step turns too.
        let turn = DVec2::from_angle(0.7);
        let turned = CAR.to_middle(turn.rotate(from), heading + 0.7, 0.01, 0.05);
        assert!(turned.by_m.distance(turn.rotate(step.by_m)) < 1e-12);
        // One that comes towards the radar is seen on its front.
        assert!(CAR.to_middle(DVec2::new(30.0, 0.0), PI, 0.01, 0.05).by_m.x > 0.7);
    }
}
