//! Range gate and energy of a scan: Kim (2)-(6).

use crate::error::{LaneError, checked};
use crate::numeric::vertex;
use serde::{Deserialize, Serialize};

const SPEED_OF_LIGHT_MPS: f64 = 299_792_458.0;

/// The mounting and the markers that determine the range gate; all lengths in m.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MarkedLane {
    /// Height of the radar above the road, H_r, m.
    pub height_m: f64,
    /// Width of the lane, W_l, m.
    pub lane_width_m: f64,
    /// Width of the car, W_c, m.
    pub car_width_m: f64,
    /// Distance from one plate's start to the next one's, L_s, m.
    pub spacing_m: f64,
    /// Length of a plate, L_l, m.
    pub plate_length_m: f64,
}

/// The one-way ranges over which echoes are summed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RangeGate {
    /// Nearest range, m.
    pub min_m: f64,
    /// Farthest range, m.
    pub max_m: f64,
}

/// One-way ranges of the samples of a scan: sample i lies at `start_m + i step_m`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RangeAxis {
    /// Range of the first sample, m.
    pub start_m: f64,
    /// Spacing of samples in range, m.
    pub step_m: f64,
}

/// Energy of one scan in the gate and the range of its strongest sample.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GateEcho {
    /// Energy E_k of Kim (6).
    pub energy: f64,
    /// Range of the largest |r|² in the gate, m, interpolated by a parabola; `None` when all are zero.
    pub strongest_range_m: Option<f64>,
}

impl RangeAxis {
    /// Makes the axis of samples `1 / sample_rate_hz` apart, the first `start_s` after the pulse: range = c t
    /// / 2.
    ///
    /// # Errors
    /// Returns an error if a value is non-finite, `start_s` is negative or `sample_rate_hz` is not positive.
    pub fn from_time(start_s: f64, sample_rate_hz: f64) -> Result<Self, LaneError> {
        checked("start of the samples", start_s, start_s >= 0.0, "0 s or more")?;
        checked("sample rate", sample_rate_hz, sample_rate_hz > 0.0, "above 0 Hz")?;
        let axis = RangeAxis {
            start_m: SPEED_OF_LIGHT_MPS * start_s / 2.0,
            step_m: SPEED_OF_LIGHT_MPS / (2.0 * sample_rate_hz),
        };
        axis.check()?;
        Ok(axis)
    }

    fn check(&self) -> Result<(), LaneError> {
        checked("start of the range axis", self.start_m, true, "")?;
        checked("step of the range axis", self.step_m, self.step_m > 0.0, "above 0 m")?;
        Ok(())
    }
}

impl RangeGate {
    /// Makes a gate from `min_m` to `max_m`, both included.
    ///
    /// # Errors
    /// Returns an error if a value is non-finite, `min_m` is negative or `max_m` is not above `min_m`.
    pub fn new(min_m: f64, max_m: f64) -> Result<Self, LaneError> {
        checked("nearest range of the gate", min_m, min_m >= 0.0, "0 m or more")?;
        checked("farthest range of the gate", max_m, max_m > min_m, "above the nearest range")?;
        Ok(RangeGate { min_m, max_m })
    }

    /// Makes the gate of Kim (2) and (3): d_min = H_r, d_max² = (W_c − W_l)² + ((L_s − L_l)/2)² + H_r².
    ///
    /// # Errors
    /// Returns an error if a length is non-finite or not positive, the car is wider than the lane, or plates
    /// are not shorter than their spacing.
    pub fn from_marked_lane(lane: &MarkedLane) -> Result<Self, LaneError> {
        checked("height of the radar", lane.height_m, lane.height_m > 0.0, "above 0 m")?;
        checked("lane width", lane.lane_width_m, lane.lane_width_m > 0.0, "above 0 m")?;
        let fits = lane.car_width_m > 0.0 && lane.car_width_m <= lane.lane_width_m;
        checked("car width", lane.car_width_m, fits, "above 0 m, at most the lane width")?;
        checked("marker spacing", lane.spacing_m, lane.spacing_m > 0.0, "above 0 m")?;
        let fits = lane.plate_length_m > 0.0 && lane.plate_length_m < lane.spacing_m;
        checked("plate length", lane.plate_length_m, fits, "above 0 m, below the marker spacing")?;
        let across_m = lane.car_width_m - lane.lane_width_m;
        let along_m = (lane.spacing_m - lane.plate_length_m) / 2.0;
        RangeGate::new(lane.height_m, across_m.hypot(along_m).hypot(lane.height_m))
    }

    /// The gate with both ends moved outwards by `margin_m`, the near one not below zero: room for the
    /// pulse's own length, c / 2B, which Kim (2) and (3) leave out.
    ///
    /// # Errors
    /// Returns an error if `margin_m` is negative or non-finite.
    pub fn widened(&self, margin_m: f64) -> Result<Self, LaneError> {
        checked("margin of the gate", margin_m, margin_m >= 0.0, "0 m or more")?;
        RangeGate::new((self.min_m - margin_m).max(0.0), self.max_m + margin_m)
    }

    /// Energy of Kim (6) for a scan of real samples (the wave itself).
    ///
    /// # Errors
    /// Returns an error for an invalid gate or axis, an empty scan, samples that do not cover the gate, or
    /// non-finite power.
    pub fn echo(&self, scan: &[f64], axis: &RangeAxis) -> Result<GateEcho, LaneError> {
        let (len, power) = (scan.len(), |i: usize| scan[i] * scan[i]);
        RangeGate::new(self.min_m, self.max_m)?;
        axis.check()?;
        if len == 0 {
            return Err(LaneError::Missing { what: "range samples" });
        }
        let last_m = axis.start_m + (len - 1) as f64 * axis.step_m;
        // Half a step of tolerance, so that a gate cut to the samples' own ends passes.
        if self.min_m < axis.start_m - axis.step_m / 2.0 || self.max_m > last_m + axis.step_m / 2.0 {
            return Err(LaneError::refused(format!(
                "the range samples from {} m to {last_m} m do not cover the gate from {} m to {} m",
                axis.start_m, self.min_m, self.max_m
            )));
        }
        let rounding = 1e-9;
        let first = ((self.min_m - axis.start_m) / axis.step_m - rounding).ceil().max(0.0) as usize;
        let end = ((self.max_m - axis.start_m) / axis.step_m + rounding).floor().max(0.0) as usize + 1;
        let end = end.min(len);
        if first >= end {
            return Err(LaneError::too_few("range samples in the gate", 0, 1));
        }
        let mut energy = 0.0;
        let mut strongest = (first, 0.0);
        for i in first..end {
            let p = power(i);
            if !p.is_finite() {
                return Err(LaneError::NotANumber { what: "power of range sample", index: Some(i) });
            }
            energy += p;
            if p > strongest.1 {
                strongest = (i, p);
            }
        }
        checked("energy in the gate", energy, true, "")?;
        let (i, p) = strongest;
        let strongest_range_m = (p > 0.0).then(|| {
            let between = if i > first && i + 1 < end { vertex(power(i - 1), p, power(i + 1)) } else { 0.0 };
            axis.start_m + (i as f64 + between) * axis.step_m
        });
        Ok(GateEcho { energy, strongest_range_m })
    }
}
