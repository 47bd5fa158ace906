//! Lateral offset from a marker line, its trend, and the place between two lines.

use super::{Reason, all_finite, checked};
use serde::{Deserialize, Serialize};

/// Lateral distance between radar and marker line from the slant range: x² = d² − H_r². A range below the
/// height, as noise gives it near the line, counts as zero. Unsigned: one radar cannot tell on which side of
/// the line it is.
pub fn offset_from_range_m(range_m: f64, height_m: f64) -> Result<f64, Reason> {
    checked("range of the marker", range_m, range_m > 0.0, "above 0 m")?;
    checked("height of the radar", height_m, height_m > 0.0, "above 0 m")?;
    Ok(((range_m - height_m) * (range_m + height_m)).max(0.0).sqrt())
}

/// Measured marker energy against lateral offset; energy falls as offset grows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<[f64; 2]>", into = "Vec<[f64; 2]>")]
pub struct OffsetCurve {
    points: Vec<[f64; 2]>,
}

impl OffsetCurve {
    /// Points `[offset_m, energy]`, at least two, offsets rising from 0 or more and energies falling.
    pub fn new(points: Vec<[f64; 2]>) -> Result<Self, Reason> {
        if points.len() < 2 {
            return Err(Reason::TooFew {
                what: "points of the offset curve",
                found: points.len(),
                needed: 2,
            });
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

    /// The offset at which markers have this mean energy; energies beyond the curve's ends give the end's
    /// offset.
    pub fn offset_m(&self, energy: f64) -> Result<f64, Reason> {
        checked("marker energy", energy, true, "")?;
        let after = self.points.partition_point(|p| p[1] > energy);
        let at = match (after.checked_sub(1).and_then(|i| self.points.get(i)), self.points.get(after)) {
            (Some(a), Some(b)) => a[0] + (b[0] - a[0]) * (a[1] - energy) / (a[1] - b[1]),
            (Some(end), None) | (None, Some(end)) => end[0],
            (None, None) => return Err(Reason::Empty { what: "points of the offset curve" }),
        };
        Ok(at)
    }
}

impl TryFrom<Vec<[f64; 2]>> for OffsetCurve {
    type Error = Reason;
    fn try_from(points: Vec<[f64; 2]>) -> Result<Self, Reason> {
        OffsetCurve::new(points)
    }
}

impl From<OffsetCurve> for Vec<[f64; 2]> {
    fn from(curve: OffsetCurve) -> Self {
        curve.points
    }
}

/// Straight line through the offsets of the last markers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct OffsetTrend {
    /// Offset on the line at the last marker.
    pub offset_m: f64,
    /// Metres of offset per metre of road, the tangent of the heading against the line; positive away from
    /// it.
    pub slope: f64,
    /// Standard error of the slope; `None` with two markers.
    pub slope_error: Option<f64>,
    pub markers: usize,
}

impl OffsetTrend {
    /// Least-squares line through `(distance_m, offset_m)`, distances rising, at least two.
    pub fn fit(points: &[(f64, f64)]) -> Result<Self, Reason> {
        let n = points.len();
        if n < 2 {
            return Err(Reason::TooFew { what: "marker offsets", found: n, needed: 2 });
        }
        for (i, p) in points.iter().enumerate() {
            if !(p.0.is_finite() && p.1.is_finite()) {
                return Err(Reason::NotFinite { what: "offset point", index: Some(i) });
            }
        }
        if let Some(w) = points.windows(2).find(|w| w[1].0 <= w[0].0) {
            let allowed = "beyond the one before";
            return Err(Reason::OutOfRange { what: "distance of a marker", value: w[1].0, allowed });
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

    /// Road until the offset reaches `limit_m` at this slope; `None` when it moves away from it or is level.
    /// Zero when it is there already, seen from the side it moves to.
    pub fn distance_to_m(&self, limit_m: f64) -> Option<f64> {
        let rest_m = (limit_m - self.offset_m) / self.slope;
        (self.slope != 0.0 && rest_m.is_finite() && rest_m >= 0.0).then_some(rest_m)
    }
}

/// Which lines a place came from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum LinesSeen {
    Both,
    Left,
    Right,
}

/// The car between its lane lines.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LanePlace {
    /// Car's centre from the lane's centre, positive left.
    pub offset_left_m: f64,
    /// Distance between the lines: measured with both, else the width that was given.
    pub lane_width_m: f64,
    pub lines: LinesSeen,
}

/// Place between the lines from the offsets of the two radars, each from its own line towards the lane's
/// inside positive. `radar_span_m` is the distance between the radars, across; the car's centre lies midway.
pub fn lane_place(
    left_offset_m: Option<f64>,
    right_offset_m: Option<f64>,
    radar_span_m: f64,
    lane_width_m: f64,
) -> Result<LanePlace, Reason> {
    checked("distance between the radars", radar_span_m, radar_span_m >= 0.0, "0 m or more")?;
    checked("lane width", lane_width_m, lane_width_m > 0.0, "above 0 m")?;
    for offset_m in [left_offset_m, right_offset_m].into_iter().flatten() {
        checked("lateral offset", offset_m, true, "")?;
    }
    let spare_m = (lane_width_m - radar_span_m) / 2.0;
    match (left_offset_m, right_offset_m) {
        (Some(l), Some(r)) => Ok(LanePlace {
            offset_left_m: (r - l) / 2.0,
            lane_width_m: radar_span_m + l + r,
            lines: LinesSeen::Both,
        }),
        (Some(l), None) => Ok(LanePlace { offset_left_m: spare_m - l, lane_width_m, lines: LinesSeen::Left }),
        (None, Some(r)) => {
            Ok(LanePlace { offset_left_m: r - spare_m, lane_width_m, lines: LinesSeen::Right })
        }
        (None, None) => Err(Reason::Empty { what: "lateral offsets" }),
    }
}

/// How far the left line's markers lie beyond the right line's, modulo the spacing, within half a spacing
/// either way: the circular mean of each sequence's phase.
pub fn stagger_m(left_m: &[f64], right_m: &[f64], spacing_m: f64) -> Result<f64, Reason> {
    checked("marker spacing", spacing_m, spacing_m > 0.0, "above 0 m")?;
    all_finite("left marker", left_m)?;
    all_finite("right marker", right_m)?;
    let turn = std::f64::consts::TAU;
    let sum = |places: &[f64]| {
        places
            .iter()
            .map(|p| turn * (p / spacing_m).fract())
            .fold((0.0, 0.0), |(c, s), a| (c + a.cos(), s + a.sin()))
    };
    let (lc, ls) = sum(left_m);
    let (rc, rs) = sum(right_m);
    let enough = |c: f64, s: f64, n: usize| c.hypot(s) / n as f64 > 0.1;
    if !enough(lc, ls, left_m.len()) || !enough(rc, rs, right_m.len()) {
        let allowed = "places one spacing apart, so that they have a common phase";
        let value = (lc.hypot(ls) / left_m.len() as f64).min(rc.hypot(rs) / right_m.len() as f64);
        return Err(Reason::OutOfRange { what: "agreement of the marker phases", value, allowed });
    }
    let angle = (ls * rc - lc * rs).atan2(lc * rc + ls * rs);
    Ok(angle / turn * spacing_m)
}
