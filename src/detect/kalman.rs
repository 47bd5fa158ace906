//! The filter of one track: constant velocity in the plane, measured in range, azimuth and range rate
//! (CONVENTIONS eq. 120, 121).
//!
//! The measurement stays polar, with Jacobian and Hessian, rather than converted: range rate is a
//! function of the whole state, and a new track knows nothing of its speed across the line of sight,
//! where first order alone makes the filter far too sure of itself.
//!
//! A body 50 m ahead that approaches at 10 m/s. Prediction moves it and makes its position less certain; a plot of the
//! next scan makes it more certain again, and after some scans the speed across the line of sight is known too:
//!
//! ```
//! use catseye::detect::kalman::{Estimate, Station};
//! use catseye::detect::plot::Plot;
//!
//! let plot = |range_m: f64| Plot::of_point([range_m, -10.0, 0.0, 0.0], [0.2, 0.1, 0.005]);
//! let across_std_mps = 10.0;
//! let mut estimate = Estimate::of_plot(&plot(50.0), &Station::ORIGIN, across_std_mps);
//! for scan in 1..=10 {
//!     let predicted = estimate.predicted(0.1, 0.5);
//!     let innovation = predicted.expectation(&Station::ORIGIN).innovation(&plot(50.0 - f64::from(scan)));
//!     let updated = predicted.updated(&innovation);
//!     assert!(innovation.distance2 < 1.0);
//!     assert!(updated.covariance.x_axis.x < predicted.covariance.x_axis.x);
//!     estimate = updated;
//! }
//! assert!((estimate.position_m().x - 40.0).abs() < 0.1);
//! assert!(estimate.covariance.w_axis.w.sqrt() < 1.0);
//! ```

use super::plot::Plot;
use glam::{DMat3, DMat4, DVec2, DVec3, DVec4};
use std::f64::consts::{PI, TAU};

/// Place and motion of the sensor in the road-fixed plane in which tracks live.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Station {
    /// Place of the sensor, m.
    pub position_m: DVec2,
    /// Direction of boresight, rad, from the plane's x axis, positive to the left.
    pub heading_rad: f64,
    /// Velocity of the sensor, m/s.
    pub velocity_mps: DVec2,
    /// How well that velocity is known, on each axis; added to the range rate's error.
    pub velocity_std_mps: f64,
}

impl Station {
    /// A sensor at rest in the origin, looking along x.
    pub const ORIGIN: Station = Station {
        position_m: DVec2::ZERO,
        heading_rad: 0.0,
        velocity_mps: DVec2::ZERO,
        velocity_std_mps: 0.0,
    };

    /// A sensor at `mount_m` with boresight `mount_rad` on a vehicle whose origin is at `position_m`,
    /// heading `heading_rad`, moving forward at `speed_mps` and turning left at `yaw_rate_rps`.
    pub fn on_vehicle(
        (mount_m, mount_rad): (DVec2, f64),
        position_m: DVec2,
        heading_rad: f64,
        speed_mps: f64,
        yaw_rate_rps: f64,
    ) -> Station {
        let forward = DVec2::from_angle(heading_rad);
        let arm = forward.rotate(mount_m);
        Station {
            position_m: position_m + arm,
            heading_rad: heading_rad + mount_rad,
            velocity_mps: speed_mps * forward + yaw_rate_rps * arm.perp(),
            velocity_std_mps: 0.0,
        }
    }
}

/// Place and motion of a body, (x, y, v_x, v_y), with their covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// State (x, y, v_x, v_y) in m and m/s.
    pub state: DVec4,
    /// Covariance of the state.
    pub covariance: DMat4,
}

/// What a sensor should measure of a body, without the errors of the measurement itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expectation {
    /// Range, azimuth, range rate.
    pub value: DVec3,
    /// Covariance of what is measured.
    pub covariance: DMat3,
    /// P hᵀ for each of the three.
    towards: [DVec4; 3],
}

/// Difference of a plot from what was expected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Innovation {
    /// Plot less expectation: range, azimuth (wrapped), range rate.
    pub residual: DVec3,
    /// S: of the expectation and of the plot.
    pub covariance: DMat3,
    /// Mahalanobis distance squared: chi-square with three degrees of freedom for the right plot.
    pub distance2: f64,
    gain: [DVec4; 3],
}

impl Innovation {
    /// Logarithm of the determinant of S, ln det S.
    pub fn log_determinant(&self) -> f64 {
        self.covariance.determinant().ln()
    }
}

impl Expectation {
    /// Covariance S for plots with these standard deviations of range, azimuth and range rate.
    pub fn spread(&self, std: DVec3) -> DMat3 {
        self.covariance + DMat3::from_diagonal(std * std)
    }

    /// Compares a plot with what is expected.
    pub fn innovation(&self, plot: &Plot) -> Innovation {
        let covariance =
            self.spread(DVec3::new(plot.range_std_m, plot.azimuth_std_rad, plot.range_rate_std_mps));
        let mut residual = DVec3::new(plot.range_m, plot.azimuth_rad, plot.range_rate_mps) - self.value;
        residual.y = (residual.y + PI).rem_euclid(TAU) - PI;
        let inverse = covariance.inverse();
        let [a, b, c] = self.towards;
        let gain = [0, 1, 2].map(|i| {
            let k = inverse.col(i);
            a * k.x + b * k.y + c * k.z
        });
        Innovation { residual, covariance, distance2: residual.dot(inverse * residual), gain }
    }
}

/// a bᵀ.
fn outer(a: DVec4, b: DVec4) -> DMat4 {
    DMat4::from_cols(a * b.x, a * b.y, a * b.z, a * b.w)
}

fn symmetric(m: DMat4) -> DMat4 {
    (m + m.transpose()) * 0.5
}

fn join(p: DVec2, v: DVec2) -> DVec4 {
    DVec4::new(p.x, p.y, v.x, v.y)
}

/// Expectation of the measurement and its derivatives at a state.
struct Expected {
    value: DVec3,
    jacobian: [DVec4; 3],
    hessian: [DMat4; 3],
}

fn expected(state: DVec4, station: &Station) -> Expected {
    let (p, v) = (DVec2::new(state.x, state.y), DVec2::new(state.z, state.w));
    let (d, w) = (p - station.position_m, v - station.velocity_mps);
    // The azimuth of the sensor's own place is undefined; a millimetre is inside every antenna.
    let range = d.length().max(1e-3);
    let u = d.try_normalize().unwrap_or(DVec2::from_angle(station.heading_rad));
    let n = u.perp();
    let (along, across) = (w.dot(u), w.dot(n));
    let (up, np) = (join(u, DVec2::ZERO), join(n, DVec2::ZERO));
    let (uv, nv) = (join(DVec2::ZERO, u), join(DVec2::ZERO, n));
    let mixed = outer(up, np) + outer(np, up);
    Expected {
        value: DVec3::new(range, u.to_angle() - station.heading_rad, along),
        jacobian: [up, np / range, np * (across / range) + uv],
        hessian: [
            outer(np, np) * (1.0 / range),
            mixed * (-1.0 / (range * range)),
            (mixed * across + outer(np, np) * along) * (-1.0 / (range * range))
                + (outer(np, nv) + outer(nv, np)) * (1.0 / range),
        ],
    }
}

fn trace(m: DMat4) -> f64 {
    m.x_axis.x + m.y_axis.y + m.z_axis.z + m.w_axis.w
}

impl Estimate {
    /// Makes an estimate from one plot (eq. 120): the place, and of the velocity what the range rate says. Across the
    /// line of sight the body is taken to stand, give or take `across_std_mps`.
    pub fn of_plot(plot: &Plot, station: &Station, across_std_mps: f64) -> Estimate {
        let u = DVec2::from_angle(station.heading_rad + plot.azimuth_rad);
        let n = u.perp();
        let (r, sigma_a) = (plot.range_m, plot.azimuth_std_rad);
        let own = station.velocity_mps;
        let along = plot.range_rate_mps + own.dot(u);
        // To second order an arc of directions has its centre inside it.
        let sag = 0.5 * r * sigma_a * sigma_a;
        let turned = join(n * r, n * along + u * own.dot(n));
        let term = |direction: DVec4, std: f64| outer(direction, direction) * (std * std);
        // The speed across, unknown, is seen along a direction that is off by the error of azimuth.
        let rate_std =
            plot.range_rate_std_mps.hypot(station.velocity_std_mps).hypot(across_std_mps * sigma_a);
        Estimate {
            state: join(station.position_m + u * (r - sag), u * along),
            covariance: term(join(u, DVec2::ZERO), plot.range_std_m.hypot(sag * 2f64.sqrt()))
                + term(turned, sigma_a)
                + term(join(DVec2::ZERO, u), rate_std)
                + term(join(DVec2::ZERO, n), across_std_mps),
        }
    }

    /// Position of the body, m.
    pub fn position_m(&self) -> DVec2 {
        DVec2::new(self.state.x, self.state.y)
    }

    /// Velocity of the body, m/s.
    pub fn velocity_mps(&self) -> DVec2 {
        DVec2::new(self.state.z, self.state.w)
    }

    /// The estimate after `dt_s` seconds of constant velocity disturbed by white acceleration of spectral density `psd`
    /// in m²/s³ on each axis: two steps are the same as one of their sum.
    pub fn predicted(&self, dt_s: f64, psd: f64) -> Estimate {
        let mut f = DMat4::IDENTITY;
        f.z_axis.x = dt_s;
        f.w_axis.y = dt_s;
        let (q11, q12, q22) = (psd * dt_s.powi(3) / 3.0, psd * dt_s.powi(2) / 2.0, psd * dt_s);
        let noise = DMat4::from_cols(
            DVec4::new(q11, 0.0, q12, 0.0),
            DVec4::new(0.0, q11, 0.0, q12),
            DVec4::new(q12, 0.0, q22, 0.0),
            DVec4::new(0.0, q12, 0.0, q22),
        );
        Estimate { state: f * self.state, covariance: symmetric(f * self.covariance * f.transpose() + noise) }
    }

    /// What a sensor should measure, to second order (eq. 121): value and covariance hold the curvature of
    /// the measurement over the estimate's spread (Athans, Wishner and Bertolini, IEEE Trans. AC-13
    /// (1968) 504), the covariance twice: what the curvature does repeats from scan to scan while the
    /// filter takes it for new each time, and with it once the filter is up to a quarter too sure of
    /// itself (NEES 5 of 4) while it learns the speed across.
    pub fn expectation(&self, station: &Station) -> Expectation {
        let e = expected(self.state, station);
        let bent = e.hessian.map(|h| h * self.covariance);
        let towards = e.jacobian.map(|h| self.covariance * h);
        let s = |i: usize, j: usize| e.jacobian[i].dot(towards[j]) + trace(bent[i] * bent[j]);
        let mut covariance = DMat3::from_cols(
            DVec3::new(s(0, 0), s(1, 0), s(2, 0)),
            DVec3::new(s(0, 1), s(1, 1), s(2, 1)),
            DVec3::new(s(0, 2), s(1, 2), s(2, 2)),
        );
        covariance.z_axis.z += station.velocity_std_mps.powi(2);
        Expectation { value: e.value + DVec3::from(bent.map(trace)) * 0.5, covariance, towards }
    }

    /// The estimate with the plot of `innovation` taken in.
    pub fn updated(&self, innovation: &Innovation) -> Estimate {
        let [a, b, c] = innovation.gain;
        let r = innovation.residual;
        let s = innovation.covariance;
        let mut less = DMat4::ZERO;
        for (j, gj) in innovation.gain.iter().enumerate() {
            less += outer(a * s.col(j).x + b * s.col(j).y + c * s.col(j).z, *gj);
        }
        Estimate {
            state: self.state + a * r.x + b * r.y + c * r.z,
            covariance: symmetric(self.covariance - less),
        }
    }

    /// Normalised estimation error squared against the truth: chi-square with four degrees of freedom
    /// when the covariance is right.
    pub fn nees(&self, truth: DVec4) -> f64 {
        let e = self.state - truth;
        e.dot(self.covariance.inverse() * e)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const STATION: Station = Station {
        position_m: DVec2::new(3.0, -1.0),
        heading_rad: 0.7,
        velocity_mps: DVec2::new(8.0, 2.0),
        velocity_std_mps: 0.0,
    };

    fn plot(range_m: f64, azimuth_rad: f64, range_rate_mps: f64) -> Plot {
        Plot::of_point([range_m, range_rate_mps, azimuth_rad, 0.0], [0.1, 0.2, 0.02])
    }

    proptest! {
        #[test]
        fn derivatives_are_those_of_the_measurement(
            x in -30.0..30.0f64,
            y in 5.0..30.0f64,
            vx in -20.0..20.0f64,
            vy in -20.0..20.0f64,
        ) {
            let state = DVec4::new(x, y, vx, vy);
            let e = expected(state, &STATION);
            let h = 1e-4;
            let value = |s: DVec4| {
                let v = expected(s, &STATION).value;
                // Azimuth relative to that at the middle, clear of its jump.
                let a = (v.y - e.value.y + PI).rem_euclid(TAU) - PI;
                DVec3::new(v.x, a, v.z)
            };
            let unit = |i: usize| {
                let mut d = DVec4::ZERO;
                d[i] = h;
                d
            };
            for i in 0..4 {
                let slope = (value(state + unit(i)) - value(state - unit(i))) / (2.0 * h);
                for k in 0..3 {
                    prop_assert!((slope[k] - e.jacobian[k][i]).abs() < 1e-6 * (1.0 + slope[k].abs()));
                }
                for j in 0..4 {
                    let (a, b) = (unit(i), unit(j));
                    let bend = (value(state + a + b) - value(state + a - b) - value(state - a + b)
                        + value(state - a - b)) / (4.0 * h * h);
                    for k in 0..3 {
                        prop_assert!((bend[k] - e.hessian[k].col(j)[i]).abs() < 1e-4 * (1.0 + bend[k].abs()));
                    }
                }
            }
        }

        #[test]
        fn two_steps_are_one(dt in 0.0..0.5f64, more in 0.0..0.5f64) {
            let e = Estimate::of_plot(&plot(20.0, 0.3, -4.0), &STATION, 10.0);
            let (two, one) = (e.predicted(dt, 2.0).predicted(more, 2.0), e.predicted(dt + more, 2.0));
            prop_assert!((two.state - one.state).length() < 1e-9);
            prop_assert!(two.covariance.abs_diff_eq(one.covariance, 1e-9));
        }
    }

    #[test]
    fn a_first_plot_is_what_the_sensor_saw() {
        let p = Plot { azimuth_std_rad: 1e-6, ..plot(20.0, 0.3, -4.0) };
        let e = Estimate::of_plot(&p, &STATION, 10.0);
        let seen = expected(e.state, &STATION).value;
        assert!((seen.x - 20.0).abs() < 1e-9 && (seen.y - 0.3).abs() < 1e-9, "{seen}");
        // The body is taken to stand across the line of sight; along it the rate holds.
        assert!((seen.z + 4.0).abs() < 1e-9, "{seen}");
    }

    #[test]
    fn sharp_plots_leave_their_own_spread() {
        // A plot far sharper than what was known: the estimate becomes the plot.
        let e = Estimate {
            state: DVec4::new(40.0, 10.0, 1.0, 2.0),
            covariance: DMat4::from_diagonal(DVec4::new(1e-3, 1e-3, 1e-3, 1e-3)),
        };
        let p = Plot {
            range_std_m: 1e-5,
            azimuth_std_rad: 1e-6,
            range_rate_std_mps: 1e-5,
            ..plot(0.0, 0.0, 0.0)
        };
        let at = e.expectation(&Station::ORIGIN).value;
        let p = Plot { range_m: at.x + 0.01, azimuth_rad: at.y, range_rate_mps: at.z, ..p };
        let after = e.updated(&e.expectation(&Station::ORIGIN).innovation(&p));
        assert!((after.position_m().length() - p.range_m).abs() < 1e-4);
        let u = after.position_m().normalize();
        let along = join(u, DVec2::ZERO);
        assert!((along.dot(after.covariance * along)).sqrt() < 1.5e-4);
    }

    #[test]
    fn stations_ride_on_their_vehicle() {
        let s = Station::on_vehicle(
            (DVec2::new(3.0, 1.0), 0.5),
            DVec2::new(10.0, 20.0),
            std::f64::consts::FRAC_PI_2,
            5.0,
            0.1,
        );
        assert!((s.position_m - DVec2::new(9.0, 23.0)).length() < 1e-12);
        // ω × arm with arm = (−1, 3).
        assert!((s.velocity_mps - DVec2::new(-0.3, 4.9)).length() < 1e-12);
        assert!((s.heading_rad - (0.5 + std::f64::consts::FRAC_PI_2)).abs() < 1e-12);
    }
}
