//! Kalman filter of a clothoid edge, state [c0, c1, b] (Miyake, eq. 25–27).
//!
//! The curvature at distance x ahead is c0 + c1 x. As the car advances by ds = v dt, c0 grows by c1 ds
//! (Miyake eq. 26) and c1 stays (eq. 27), each up to process noise stated per metre driven. c1 and b are
//! random walks, so a standing car learns and forgets nothing.

use crate::Measured;
use crate::error::{LaneError, Result, checked, finite, not_negative, positive};
use crate::matrix::quadratic;
use serde::{Deserialize, Serialize};

/// An edge as measured by a fit: `a = c0/2 + cubic[0] c1` and `b + cubic[1] c1`, with their covariance.
///
/// `cubic` = [0, 0] is Miyake's measurement, which takes the parabola for the clothoid's start.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct EdgeMeasurement {
    /// Measured a, half the curvature, 1/m, positive to the left.
    pub a_per_m: f64,
    /// Place of the edge beside the vehicle, m, positive to the left.
    pub b_m: f64,
    /// Covariance of (a, b), in units 1/m², 1, 1, m².
    pub covariance: [[f64; 2]; 2],
    /// Contributions of c1 to a and to b, m and m³.
    pub cubic: [f64; 2],
}

impl EdgeMeasurement {
    /// Checks that the values are finite and the covariance is positive definite.
    ///
    /// # Errors
    /// Returns an error for the first value that is non-finite or not possible.
    pub fn validate(&self) -> Result<()> {
        finite("measured a", self.a_per_m)?;
        finite("measured b", self.b_m)?;
        finite("part of c1 in a", self.cubic[0])?;
        finite("part of c1 in b", self.cubic[1])?;
        let [[aa, ab], [ba, bb]] = self.covariance;
        positive("variance of a", aa)?;
        positive("variance of b", bb)?;
        finite("covariance of a and b", ab)?;
        let asymmetry = (ab - ba).abs();
        if !ba.is_finite() || asymmetry > 1e-9 * (aa * bb).sqrt() || ab * ab > aa * bb {
            return Err(LaneError::out_of_range(
                "covariance of a and b",
                ab,
                "symmetric, and what the variances allow",
            ));
        }
        Ok(())
    }
}

/// Settings of the filter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ClothoidSettings {
    /// Random walk of c1: standard deviation after one metre, 1/m² per √m.
    pub c1_walk: f64,
    /// Random walk of b: standard deviation after one metre, m per √m.
    pub b_walk: f64,
    /// Standard deviation of c1 at the start, 1/m².
    pub c1_std: f64,
    /// Probability of the gate: a measurement is accepted if it lies within this share of all correct ones.
    pub gate_probability: f64,
}

impl Default for ClothoidSettings {
    fn default() -> Self {
        // c1 of a clothoid from straight to R = 300 m over 80 m is 4e-5; it comes within some 30 m.
        Self { c1_walk: 6e-6, b_walk: 0.05, c1_std: 5e-5, gate_probability: 0.999 }
    }
}

impl ClothoidSettings {
    /// Checks every setting.
    ///
    /// # Errors
    /// Returns an error for the first setting outside its range.
    pub fn validate(&self) -> Result<()> {
        not_negative("c1_walk", self.c1_walk)?;
        not_negative("b_walk", self.b_walk)?;
        positive("c1_std", self.c1_std)?;
        let p = self.gate_probability;
        checked("gate_probability", p, p > 0.0 && p < 1.0, "above 0, below 1").map(|_| ())
    }
}

/// Outcome of a measurement.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Update {
    /// Normalised innovation squared: χ² with `freedom` degrees of freedom where model and noise are right.
    pub nis: f64,
    /// Degrees of freedom of the innovation.
    pub freedom: usize,
    /// Whether the gate accepted it; otherwise the state is unchanged.
    pub accepted: bool,
}

/// Kalman filter that follows one edge.
#[derive(Debug, Clone, PartialEq)]
pub struct ClothoidFilter {
    /// c0 in 1/m, c1 in 1/m², b in m, positive to the left.
    state: [f64; 3],
    covariance: [[f64; 3]; 3],
    settings: ClothoidSettings,
}

impl ClothoidFilter {
    /// Starts from one measurement with c1 = 0 ± `c1_std`, as nothing else is known.
    ///
    /// # Errors
    /// Returns an error for an invalid measurement or setting.
    pub fn new(measurement: &EdgeMeasurement, settings: &ClothoidSettings) -> Result<Self> {
        measurement.validate()?;
        settings.validate()?;
        let [g, h] = measurement.cubic;
        let [[aa, ab], [_, bb]] = measurement.covariance;
        let q = settings.c1_std * settings.c1_std;
        let state = [2.0 * measurement.a_per_m, 0.0, measurement.b_m];
        let covariance = [
            [4.0 * (aa + g * g * q), -2.0 * g * q, 2.0 * (ab + g * h * q)],
            [-2.0 * g * q, q, -h * q],
            [2.0 * (ab + g * h * q), -h * q, bb + h * h * q],
        ];
        Self::from_state(state, covariance, settings)
    }

    /// Starts from a state and its covariance.
    ///
    /// # Errors
    /// Returns an error for an invalid setting, a non-finite value, a negative variance or an invalid
    /// covariance.
    pub fn from_state(
        state: [f64; 3],
        covariance: [[f64; 3]; 3],
        settings: &ClothoidSettings,
    ) -> Result<Self> {
        settings.validate()?;
        for v in state.iter().chain(covariance.iter().flatten()) {
            finite("state or covariance", *v)?;
        }
        for (i, row) in covariance.iter().enumerate() {
            not_negative("variance of the state", row[i])?;
            for (j, v) in row.iter().enumerate() {
                let bound = row[i] * covariance[j][j];
                if (v - covariance[j][i]).abs() > 1e-9 * bound.sqrt() || v * v > bound * (1.0 + 1e-9) {
                    return Err(LaneError::out_of_range(
                        "covariance of the state",
                        *v,
                        "symmetric, and what the variances allow",
                    ));
                }
            }
        }
        Ok(Self { state, covariance, settings: settings.clone() })
    }

    /// State: c0 in 1/m, c1 in 1/m², b in m.
    pub fn state(&self) -> [f64; 3] {
        self.state
    }

    /// Covariance of [`Self::state`], in its units.
    pub fn covariance(&self) -> [[f64; 3]; 3] {
        self.covariance
    }

    /// Predicts the state `dt_s` later at `speed_mps` (Miyake eq. 26, 27); backwards where the speed is
    /// negative.
    ///
    /// # Errors
    /// Returns an error for a negative time, non-finite values, or a distance that makes the state
    /// non-finite; the state is then unchanged.
    pub fn predict(&mut self, dt_s: f64, speed_mps: f64) -> Result<()> {
        not_negative("time step", dt_s)?;
        finite("speed", speed_mps)?;
        let ds = speed_mps * dt_s;
        finite("distance driven", ds)?;
        let p = &self.covariance;
        let q = self.settings.c1_walk * self.settings.c1_walk;
        let [mut c00, mut c01, mut c02] = p[0];
        c00 += 2.0 * ds * p[0][1] + ds * ds * p[1][1] + q * ds.abs().powi(3) / 3.0;
        c01 += ds * p[1][1] + q * ds * ds.abs() / 2.0;
        c02 += ds * p[1][2];
        let c11 = p[1][1] + q * ds.abs();
        let c22 = p[2][2] + self.settings.b_walk * self.settings.b_walk * ds.abs();
        let c12 = p[1][2];
        let c0 = self.state[0] + self.state[1] * ds;
        if ![c0, c00, c01, c02, c11, c22].iter().all(|v| v.is_finite()) {
            return Err(LaneError::out_of_range(
                "distance driven",
                ds,
                "a distance that keeps the state finite",
            ));
        }
        self.state[0] = c0;
        self.covariance = [[c00, c01, c02], [c01, c11, c12], [c02, c12, c22]];
        Ok(())
    }

    /// Updates the state with a measurement of a and b, if it passes the gate.
    ///
    /// # Errors
    /// Returns an error for an invalid measurement or one that leaves the state undetermined; the state is
    /// then unchanged.
    pub fn update(&mut self, measurement: &EdgeMeasurement) -> Result<Update> {
        measurement.validate()?;
        let (update, new) = self.try_update(measurement)?;
        if let Some((state, covariance)) = new {
            if !state.iter().chain(covariance.iter().flatten()).all(|v| v.is_finite()) {
                return Err(LaneError::undetermined("the curve"));
            }
            (self.state, self.covariance) = (state, covariance);
        }
        Ok(update)
    }

    /// The update that [`Self::update`] would make, without changing the state.
    ///
    /// # Errors
    /// Returns an error for an invalid measurement or one that leaves the state undetermined.
    pub fn gate(&self, measurement: &EdgeMeasurement) -> Result<Update> {
        measurement.validate()?;
        Ok(self.try_update(measurement)?.0)
    }

    #[allow(clippy::type_complexity, reason = "state and covariance of one place")]
    fn try_update(&self, m: &EdgeMeasurement) -> Result<(Update, Option<([f64; 3], [[f64; 3]; 3])>)> {
        let rows = [[0.5, m.cubic[0], 0.0], [0.0, m.cubic[1], 1.0]];
        let r = m.covariance;
        let ph = rows.map(|h| crate::matrix::times(&self.covariance, &h));
        let dot = |u: &[f64; 3], v: &[f64; 3]| u.iter().zip(v).map(|(a, b)| a * b).sum::<f64>();
        let s = [
            [dot(&rows[0], &ph[0]) + r[0][0], dot(&rows[0], &ph[1]) + r[0][1]],
            [dot(&rows[1], &ph[0]) + r[0][1], dot(&rows[1], &ph[1]) + r[1][1]],
        ];
        let s = [[s[0][0], 0.5 * (s[0][1] + s[1][0])], [0.5 * (s[0][1] + s[1][0]), s[1][1]]];
        let inv = crate::matrix::inverse(&s).ok_or(LaneError::undetermined("the curve"))?;
        let innovation = [m.a_per_m - dot(&rows[0], &self.state), m.b_m - dot(&rows[1], &self.state)];
        let nis = quadratic(&inv, &innovation);
        // χ² with two degrees: P(> t) = exp(−t/2).
        let accepted = nis <= -2.0 * (1.0 - self.settings.gate_probability).ln();
        let update = Update { nis, freedom: 2, accepted };
        if !accepted {
            return Ok((update, None));
        }
        let gain: [[f64; 2]; 3] =
            std::array::from_fn(|i| std::array::from_fn(|k| ph[0][i] * inv[0][k] + ph[1][i] * inv[1][k]));
        let state =
            std::array::from_fn(|i| self.state[i] + gain[i][0] * innovation[0] + gain[i][1] * innovation[1]);
        // Joseph's form: (1 − KH) P (1 − KH)ᵀ + K R Kᵀ stays positive.
        let left: [[f64; 3]; 3] = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                f64::from(u8::from(i == j)) - gain[i][0] * rows[0][j] - gain[i][1] * rows[1][j]
            })
        });
        let lp: [[f64; 3]; 3] = std::array::from_fn(|i| crate::matrix::times(&self.covariance, &left[i]));
        let full = |i: usize, j: usize| {
            dot(&lp[i], &left[j])
                + (0..2)
                    .flat_map(|k| (0..2).map(move |l| (k, l)))
                    .map(|(k, l)| gain[i][k] * r[k.min(l)][k.max(l)] * gain[j][l])
                    .sum::<f64>()
        };
        let covariance = std::array::from_fn(|i| std::array::from_fn(|j| 0.5 * (full(i, j) + full(j, i))));
        Ok((update, Some((state, covariance))))
    }

    /// Updates the state with a curvature alone, as when only the other edge is seen: `a_per_m` = c0/2 +
    /// `cubic` c1.
    ///
    /// # Errors
    /// Returns an error for a non-finite value or a variance that is not positive.
    pub fn update_curvature(&mut self, a_per_m: f64, variance: f64, cubic: f64) -> Result<Update> {
        finite("measured a", a_per_m)?;
        positive("variance of a", variance)?;
        finite("part of c1 in a", cubic)?;
        let h = [0.5, cubic, 0.0];
        let ph = crate::matrix::times(&self.covariance, &h);
        let s = quadratic(&self.covariance, &h) + variance;
        let innovation = a_per_m - 0.5 * self.state[0] - cubic * self.state[1];
        let nis = innovation * innovation / s;
        // χ² with one degree has no closed quantile; that of two degrees at the same level is wider.
        let accepted = nis <= -2.0 * (1.0 - self.settings.gate_probability).ln();
        if accepted {
            let old = self.covariance;
            for i in 0..3 {
                self.state[i] += ph[i] / s * innovation;
                for j in 0..3 {
                    self.covariance[i][j] = old[i][j] - ph[i] * ph[j] / s;
                }
            }
        }
        Ok(Update { nis, freedom: 1, accepted })
    }

    /// Curvature at `x_m` ahead, 1/m: c0 + c1 x.
    pub fn curvature_per_m(&self, x_m: f64) -> Measured {
        let h = [1.0, x_m, 0.0];
        Measured {
            value: self.state[0] + self.state[1] * x_m,
            std: quadratic(&self.covariance, &h).max(0.0).sqrt(),
        }
    }
}
