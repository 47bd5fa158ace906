//! Lateral offset from a marker line, its trend, and the conversion of marker energy to offset.

use crate::error::{LaneError, all_finite, checked};
use serde::{Deserialize, Serialize};

/// Lateral distance between radar and marker line from the slant range, m: x² = d² − H_r². A range below the
/// height, as noise gives it near the line, counts as zero. The result is unsigned: one radar cannot tell on
/// which side of the line it is.
///
/// # Errors
/// Returns an error if a value is non-finite or not positive.
pub fn offset_from_range_m(range_m: f64, height_m: f64) -> Result<f64, LaneError> {
    checked("range of the marker", range_m, range_m > 0.0, "above 0 m")?;
    checked("height of the radar", height_m, height_m > 0.0, "above 0 m")?;
    Ok(((range_m - height_m) * (range_m + height_m)).max(0.0).sqrt())
}

/// Measured marker energy as a function of lateral offset; energy falls as offset grows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<[f64; 2]>", into = "Vec<[f64; 2]>")]
pub struct OffsetCurve {
    points: Vec<[f64; 2]>,
}

impl OffsetCurve {
    /// Makes a curve from points `[offset_m, energy]`: at least two, offsets rising from 0 or more and
    /// energies falling.
    ///
    /// # Errors
    /// Returns an error for fewer than two points, non-finite values, or points out of order.
    pub fn new(points: Vec<[f64; 2]>) -> Result<Self, LaneError> {
        if points.len() < 2 {
            return Err(LaneError::too_few("points of the offset curve", points.len(), 2));
        }
        all_finite("offset of point", &points.iter().map(|p| p[0]).collect::<Vec<_>>())?;
        all_finite("energy of point", &points.iter().map(|p| p[1]).collect::<Vec<_>>())?;
        checked("first offset of the curve", points[0][0], points[0][0] >= 0.0, "0 m or more")?;
        for w in points.windows(2) {
            checked("an offset of the curve", w[1][0], w[1][0] > w[0][0], "above the one before")?;
            checked("an energy of the curve", w[1][1], w[1][1] < w[0][1], "below the one before")?;
        }
        Ok(OffsetCurve { points })
    }

    /// Lateral offset at which markers have this mean energy, m; beyond the curve's ends it is the end's
    /// offset.
    ///
    /// # Errors
    /// Returns an error if `energy` is non-finite or the curve is empty.
    pub fn offset_m(&self, energy: f64) -> Result<f64, LaneError> {
        checked("marker energy", energy, true, "")?;
        let after = self.points.partition_point(|p| p[1] > energy);
        let at = match (after.checked_sub(1).and_then(|i| self.points.get(i)), self.points.get(after)) {
            (Some(a), Some(b)) => a[0] + (b[0] - a[0]) * (a[1] - energy) / (a[1] - b[1]),
            (Some(end), None) | (None, Some(end)) => end[0],
            (None, None) => return Err(LaneError::Missing { what: "points of the offset curve" }),
        };
        Ok(at)
    }
}

impl TryFrom<Vec<[f64; 2]>> for OffsetCurve {
    type Error = LaneError;
    fn try_from(points: Vec<[f64; 2]>) -> Result<Self, LaneError> {
        OffsetCurve::new(points)
    }
}

impl From<OffsetCurve> for Vec<[f64; 2]> {
    fn from(curve: OffsetCurve) -> Self {
        curve.points
    }
}

/// A straight line through the offsets of the last markers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct OffsetTrend {
    /// Offset of the line at the last marker, m.
    pub offset_m: f64,
    /// Metres of offset per metre of road, which is the tangent of the heading relative to the line; positive
    /// away from it.
    pub slope: f64,
    /// Standard error of the slope; `None` with two markers.
    pub slope_error: Option<f64>,
    /// Number of markers in the trend.
    pub markers: usize,
}

impl OffsetTrend {
    /// Fits a least-squares line to `(distance_m, offset_m)`: at least two points, distances rising.
    ///
    /// # Errors
    /// Returns an error for fewer than two points, non-finite values, or distances that do not rise.
    pub fn fit(points: &[(f64, f64)]) -> Result<Self, LaneError> {
        let n = points.len();
        if n < 2 {
            return Err(LaneError::too_few("marker offsets", n, 2));
        }
        for (i, p) in points.iter().enumerate() {
            if !(p.0.is_finite() && p.1.is_finite()) {
                return Err(LaneError::NotANumber { what: "offset point", index: Some(i) });
            }
        }
        if let Some(w) = points.windows(2).find(|w| w[1].0 <= w[0].0) {
            let allowed = "beyond the one before";
            return Err(LaneError::out_of_range("distance of a marker", w[1].0, allowed));
        }
        let count = n as f64;
        let (mx, my) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / count, y + p.1 / count));
        let sxx: f64 = points.iter().map(|p| (p.0 - mx).powi(2)).sum();
        let sxy: f64 = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum();
        let slope = checked("slope of the offsets", sxy / sxx, sxx > 0.0, "distances that differ")?;
        let residual: f64 = points.iter().map(|p| (p.1 - my - slope * (p.0 - mx)).powi(2)).sum();
        let slope_error = (n > 2).then(|| (residual / (count - 2.0) / sxx).sqrt());
        Ok(OffsetTrend { offset_m: my + slope * (points[n - 1].0 - mx), slope, slope_error, markers: n })
    }
}
