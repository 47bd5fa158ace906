//! Values to compare with the document: detection rates and spacing errors.

use super::LaneEstimate;
use crate::error::{LaneError, all_finite, checked};
use serde::Serialize;

/// Statistics of spacing errors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SpacingErrors {
    /// Number of errors.
    pub count: usize,
    /// Mean of the absolute errors, m.
    pub mean_m: f64,
    /// Root mean square of the errors, m.
    pub rms_m: f64,
    /// Largest absolute error, m.
    pub worst_m: f64,
    /// Mean of the signed errors (estimate minus truth), m.
    pub bias_m: f64,
}

/// Computes the statistics of signed errors, m.
///
/// # Errors
/// Returns an error for an empty list or a non-finite value.
pub fn spacing_errors(errors_m: &[f64]) -> Result<SpacingErrors, LaneError> {
    all_finite("spacing errors", errors_m)?;
    let n = errors_m.len() as f64;
    let mean = |f: &dyn Fn(f64) -> f64| errors_m.iter().map(|&e| f(e) / n).sum::<f64>();
    Ok(SpacingErrors {
        count: errors_m.len(),
        mean_m: mean(&f64::abs),
        rms_m: mean(&|e| e * e).sqrt(),
        worst_m: errors_m.iter().fold(0.0, |w, e| e.abs().max(w)),
        bias_m: mean(&|e| e),
    })
}

/// Score of a drive against the times at which the radar passed each marker's centre.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunScore {
    /// Number of markers that were passed.
    pub markers: usize,
    /// Number of markers with a pass in time.
    pub detected: usize,
    /// Number of passes without a marker.
    pub false_passes: usize,
    /// Number of neighbouring markers, both detected, whose passes are one spacing apart within the largest
    /// error.
    pub spacings_right: usize,
    /// Number of spacings between markers: one less than markers.
    pub spacings: usize,
    /// Estimated minus true spacing of neighbouring markers that were both detected, m.
    pub spacing_errors_m: Vec<f64>,
}

impl RunScore {
    /// Share of markers that were detected; `None` when none was passed.
    pub fn marker_rate(&self) -> Option<f64> {
        (self.markers > 0).then(|| self.detected as f64 / self.markers as f64)
    }

    /// Share of spacings that were right; `None` when fewer than two markers were passed.
    pub fn spacing_rate(&self) -> Option<f64> {
        (self.spacings > 0).then(|| self.spacings_right as f64 / self.spacings as f64)
    }
}

/// Matches each marker with the pass nearest in time within `match_s`; no pass is used twice.
/// `marker_times_s` must rise.
///
/// # Errors
/// Returns an error for marker times that are missing, non-finite or do not rise, or for a setting that is
/// not positive.
pub fn score_run(
    run: &LaneEstimate,
    marker_times_s: &[f64],
    match_s: f64,
    spacing_m: f64,
    max_spacing_error_m: f64,
) -> Result<RunScore, LaneError> {
    if !marker_times_s.is_empty() {
        all_finite("marker time", marker_times_s)?;
    }
    if let Some(w) = marker_times_s.windows(2).find(|w| w[1] <= w[0]) {
        return Err(LaneError::out_of_range("a marker time", w[1], "after the one before"));
    }
    checked("matching time", match_s, match_s > 0.0, "above 0 s")?;
    checked("marker spacing", spacing_m, spacing_m > 0.0, "above 0 m")?;
    checked("largest error", max_spacing_error_m, max_spacing_error_m > 0.0, "above 0 m")?;
    let mut used = vec![false; run.markers.len()];
    let mut found = Vec::with_capacity(marker_times_s.len());
    for &t in marker_times_s {
        let gap = |i: &usize| (run.markers[*i].pass.time_s - t).abs();
        let best = (0..run.markers.len())
            .filter(|&i| !used[i])
            .min_by(|a, b| gap(a).total_cmp(&gap(b)))
            .filter(|i| gap(i) <= match_s);
        if let Some(i) = best {
            used[i] = true;
        }
        found.push(best.map(|i| run.markers[i].pass.distance_m));
    }
    let errors: Vec<f64> = found.windows(2).filter_map(|w| Some(w[1]? - w[0]? - spacing_m)).collect();
    Ok(RunScore {
        markers: found.len(),
        detected: found.iter().flatten().count(),
        false_passes: used.iter().filter(|u| !**u).count(),
        spacings_right: errors.iter().filter(|e| e.abs() < max_spacing_error_m).count(),
        spacings: found.len().saturating_sub(1),
        spacing_errors_m: errors,
    })
}
