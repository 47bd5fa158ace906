//! Energies of a drive without markers: their histogram and the threshold (Kim section 4, figure 7).

use crate::error::{LaneError, all_finite, checked, within};
use serde::Serialize;

/// Counts of energies in bins, for plots.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Histogram {
    /// Rising bin edges, one more than bins.
    pub edges: Vec<f64>,
    /// Number of values in each bin. Bin i holds values from `edges[i]` up to below `edges[i + 1]`; the last
    /// bin includes its upper edge.
    pub counts: Vec<u64>,
    /// Number of values below the first and above the last edge.
    pub outside: [u64; 2],
}

impl Histogram {
    /// Counts values in bins of the given edges, so that drives with and without markers share one axis.
    ///
    /// # Errors
    /// Returns an error for an empty or non-finite list, fewer than two edges, or edges that do not rise.
    pub fn with_edges(values: &[f64], edges: Vec<f64>) -> Result<Self, LaneError> {
        all_finite("energies", values)?;
        all_finite("bin edges", &edges)?;
        if edges.len() < 2 {
            return Err(LaneError::too_few("bin edges", edges.len(), 2));
        }
        if let Some(w) = edges.windows(2).find(|w| w[1] <= w[0]) {
            let allowed = "each edge above the one before";
            return Err(LaneError::out_of_range("a bin edge", w[1], allowed));
        }
        let bins = edges.len() - 1;
        let mut counts = vec![0; bins];
        let mut outside = [0; 2];
        for &v in values {
            if v < edges[0] {
                outside[0] += 1;
            } else if v > edges[bins] {
                outside[1] += 1;
            } else {
                counts[edges.partition_point(|&e| e <= v).saturating_sub(1).min(bins - 1)] += 1;
            }
        }
        Ok(Histogram { edges, counts, outside })
    }
}

/// Method by which a threshold was found.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum ThresholdMethod {
    /// The greatest energy of the scans.
    Maximum,
    /// The quantile of a generalised Pareto tail of this shape, fitted to the highest `excesses` energies.
    ExtremeValue {
        /// Shape of the tail.
        shape: f64,
        /// Number of the highest energies to which the tail was fitted.
        excesses: usize,
    },
}

/// Energy above which a scan may show a marker.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Threshold {
    /// Energy above which a scan shows a marker.
    pub energy: f64,
    /// Expected share of new scans of the same road without markers that lie above it.
    pub false_alarm_probability: f64,
    /// Mean energy of the scans without markers.
    pub floor_energy: f64,
    /// Number of scans without markers from which it was found.
    pub samples: usize,
    /// How the threshold was found.
    pub method: ThresholdMethod,
}

impl Threshold {
    /// Threshold at the greatest energy without markers (the document's choice): no false alarm on these
    /// scans. On new scans of the same road one scan in `samples + 1` exceeds it on average, whatever the
    /// distribution.
    ///
    /// # Errors
    /// Returns an error for an empty list, or an energy that is non-finite or negative.
    pub fn maximum(energies: &[f64]) -> Result<Self, LaneError> {
        check_energies(energies)?;
        let samples = energies.len();
        Ok(Threshold {
            energy: extent(energies).1,
            false_alarm_probability: 1.0 / (samples as f64 + 1.0),
            floor_energy: mean(energies),
            samples,
            method: ThresholdMethod::Maximum,
        })
    }

    /// Threshold for a probability beyond what the scans show: a generalised Pareto tail fitted by
    /// probability-weighted moments (Hosking and Wallis 1987) to the highest twentieth of the energies, at
    /// least 50. It is valid as far as the scans are independent and the tail continues as it begins.
    ///
    /// # Errors
    /// Returns an error for fewer than 100 energies, an invalid energy or probability, or highest energies
    /// without spread.
    pub fn extreme_value(energies: &[f64], false_alarm_probability: f64) -> Result<Self, LaneError> {
        check_energies(energies)?;
        let n = energies.len();
        let excesses = (n / 20).max(50);
        if n < 2 * excesses {
            return Err(LaneError::too_few("energies for a tail", n, 100));
        }
        let mut sorted = energies.to_vec();
        sorted.sort_by(f64::total_cmp);
        let base = sorted[n - excesses - 1];
        let share = excesses as f64 / n as f64;
        let p = checked(
            "false-alarm probability",
            false_alarm_probability,
            false_alarm_probability > 0.0 && false_alarm_probability <= share,
            "above 0, at most the share of scans in the fitted tail",
        )?;
        let m = excesses as f64;
        let (mut a0, mut a1) = (0.0, 0.0);
        for (i, e) in sorted[n - excesses..].iter().enumerate() {
            a0 += (e - base) / m;
            a1 += (e - base) * (m - 1.0 - i as f64) / ((m - 1.0) * m);
        }
        let spread = a0 - 2.0 * a1;
        let allowed = "above 0: the highest energies must differ";
        if spread.is_nan() || spread <= 0.0 || a0 <= 0.0 {
            return Err(LaneError::out_of_range("variation of the highest energies", spread, allowed));
        }
        let shape = 2.0 - a0 / spread;
        let scale = 2.0 * a0 * a1 / spread;
        let log_return = (share / p).ln();
        let x = shape * log_return;
        // (e^x - 1) / x, whose limit at shape zero is 1.
        let growth = if x.abs() < 1e-12 { 1.0 } else { x.exp_m1() / x };
        let energy = checked("extreme-value threshold", base + scale * log_return * growth, true, "")?;
        Ok(Threshold {
            energy,
            false_alarm_probability: p,
            floor_energy: mean(energies),
            samples: n,
            method: ThresholdMethod::ExtremeValue { shape, excesses },
        })
    }

    /// Energy below which a marker pass ends: `fraction` of the way from the floor to the threshold, 0 to 1.
    ///
    /// # Errors
    /// Returns an error if `fraction` is outside 0 to 1.
    pub fn release_energy(&self, fraction: f64) -> Result<f64, LaneError> {
        within("release fraction", fraction, 0.0..=1.0)?;
        Ok(self.floor_energy + fraction * (self.energy - self.floor_energy))
    }
}

/// Share of the energies above the threshold: the detection rate of a drive with markers, the false-alarm
/// rate of one without.
///
/// # Errors
/// Returns an error for an empty list or a non-finite value.
pub fn exceedance_rate(energies: &[f64], threshold: f64) -> Result<f64, LaneError> {
    all_finite("energies", energies)?;
    checked("threshold", threshold, true, "")?;
    Ok(energies.iter().filter(|&&e| e > threshold).count() as f64 / energies.len() as f64)
}

fn check_energies(energies: &[f64]) -> Result<(), LaneError> {
    all_finite("energies", energies)?;
    match energies.iter().find(|&&e| e < 0.0) {
        Some(&value) => Err(LaneError::out_of_range("an energy", value, "0 or more")),
        None => Ok(()),
    }
}

fn extent(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &v| (a.min(v), b.max(v)))
}

/// Computed as a sum of shares, so that huge values do not overflow.
fn mean(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    values.iter().map(|v| v / n).sum()
}
