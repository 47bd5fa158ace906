//! Compares estimates with the true lines: one measure for all methods.

use super::{LaneEstimate, Line};
use crate::curve::Clothoid;
use crate::numeric::spread;
use glam::DVec2;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Distance within which a point of a line counts as found, m (the threshold of common lane benchmarks).
pub const WITHIN_M: f64 = 0.3;
/// Distances from the vehicle at which lateral errors are stated, m.
pub const DISTANCES_M: [f64; 4] = [10.0, 20.0, 40.0, 60.0];
/// Half the width of a narrow lane, m.
const HALF_LANE_M: f64 = 1.5;
/// Spacing of the points along lines that are compared, m.
const STEP_M: f64 = 0.5;

/// The true lines around the vehicle in its level frame, and other true values of its lane.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct TrueLanes {
    /// Lines that are to be found.
    pub lines: Vec<Vec<[f64; 2]>>,
    /// Lines that are right when they are found and not missed when they are not: of other lanes, rails,
    /// walls.
    #[serde(default)]
    pub also: Vec<Vec<[f64; 2]>>,
    /// Index of the line to the right and to the left of the vehicle's lane.
    pub own: [Option<usize>; 2],
    /// Offset of the vehicle from the lane's centre line, m, positive to the left.
    pub offset_m: Option<f64>,
    /// Heading of the vehicle relative to the lane, rad, positive to the left.
    pub heading_rad: Option<f64>,
    /// Curvature of the lane beside the vehicle, 1/m, positive left.
    pub curvature_per_m: Option<f64>,
    /// Number of the lane in a map.
    pub lane_number: Option<i32>,
    /// Least and largest distance from the vehicle at which lines are to be found, m: what the sensor can
    /// see.
    pub range_m: [f64; 2],
}

/// Score of one estimate.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Score {
    /// Share of the points of estimated lines within [`WITHIN_M`] of a true line; None without lines.
    pub precision: Option<f64>,
    /// Share of the points of true lines within [`WITHIN_M`] of an estimated one; None where there is nothing
    /// to find.
    pub recall: Option<f64>,
    /// Harmonic mean of precision and recall; None where there is nothing to find.
    pub f1: Option<f64>,
    /// Mean distance of the vehicle's own lines from the truth at [`DISTANCES_M`], m; None where a line does
    /// not reach.
    pub lateral_m: [Option<f64>; 4],
    /// Estimated minus true offset, m.
    pub offset_error_m: Option<f64>,
    /// Estimated minus true heading, rad.
    pub heading_error_rad: Option<f64>,
    /// Estimated minus true curvature, 1/m.
    pub curvature_error_per_m: Option<f64>,
    /// Whether the estimated lane number is the true one.
    pub lane_right: Option<bool>,
}

/// Distance of a point from a polyline, m.
fn distance(line: &[[f64; 2]], p: DVec2) -> f64 {
    let of = |w: &[[f64; 2]]| {
        let (a, d) = (DVec2::from_array(w[0]), DVec2::from_array(w[1]) - DVec2::from_array(w[0]));
        let t = ((p - a).dot(d) / d.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        (p - a - d * t).length()
    };
    line.windows(2).map(of).fold(f64::INFINITY, f64::min)
}

/// Point at which a polyline last leaves a circle around the vehicle ahead of it.
fn crossing(line: &[[f64; 2]], radius_m: f64) -> Option<DVec2> {
    line.windows(2)
        .filter_map(|w| {
            let (a, b) = (DVec2::from_array(w[0]), DVec2::from_array(w[1]));
            let (ra, rb) = (a.length() - radius_m, b.length() - radius_m);
            let at = a.lerp(b, ra / (ra - rb));
            (ra * rb <= 0.0 && ra != rb && at.x > 0.0).then_some(at)
        })
        .next_back()
}

/// Scores an estimate against the truth.
pub fn score(estimate: &LaneEstimate, truth: &TrueLanes) -> Score {
    let seen = |p: &DVec2| (truth.range_m[0]..=truth.range_m[1]).contains(&p.length());
    let curves: Vec<&Clothoid> = estimate.lines.iter().map(|l| &l.fitted.curve).collect();
    let drawn: Vec<Vec<[f64; 2]>> =
        curves.iter().map(|c| c.sample(STEP_M).iter().map(DVec2::to_array).collect()).collect();
    let share = |of: &[Vec<[f64; 2]>], to: &[&[Vec<[f64; 2]>]]| {
        let points = |l: &Vec<[f64; 2]>| l.iter().copied().map(DVec2::from_array).collect::<Vec<_>>();
        let all: Vec<DVec2> = of.iter().flat_map(|l| spread(&points(l), STEP_M)).filter(seen).collect();
        let near = |p: &DVec2| to.iter().copied().flatten().any(|l| distance(l, *p) <= WITHIN_M);
        (!all.is_empty()).then(|| all.iter().filter(|p| near(p)).count() as f64 / all.len() as f64)
    };
    let precision = share(&drawn, &[&truth.lines, &truth.also]);
    let recall = share(&truth.lines, &[&drawn]);
    let f1 = match (precision, recall) {
        (_, None) => None,
        (None, Some(_)) => Some(0.0),
        (Some(p), Some(r)) => Some(if p + r > 0.0 { 2.0 * p * r / (p + r) } else { 0.0 }),
    };
    let own: Vec<&Vec<[f64; 2]>> = truth.own.iter().flatten().filter_map(|i| truth.lines.get(*i)).collect();
    let lateral_m = DISTANCES_M.map(|d| {
        let errors: Vec<f64> = own
            .iter()
            .filter_map(|line| {
                let at = crossing(line, d)?;
                let reaches = |l: &&Line| {
                    let foot = l.fitted.curve.foot(at);
                    (-2.0..=l.fitted.curve.length_m + 2.0).contains(&foot.s_m)
                };
                let near = |l: &Line| l.fitted.curve.foot(at).left_m.abs();
                // The nearest line is compared; a farther one belongs to another lane.
                let nearest = estimate.lines.iter().filter(reaches).map(near).min_by(f64::total_cmp)?;
                (nearest < HALF_LANE_M).then_some(nearest)
            })
            .collect();
        (!errors.is_empty()).then(|| errors.iter().sum::<f64>() / errors.len() as f64)
    });
    let error = |got: Option<super::Measured>, want: Option<f64>| Some(got?.value - want?);
    Score {
        precision,
        recall,
        f1,
        lateral_m,
        offset_error_m: error(estimate.offset_m, truth.offset_m),
        heading_error_rad: error(estimate.heading_rad, truth.heading_rad),
        curvature_error_per_m: error(estimate.curvature_per_m, truth.curvature_per_m),
        lane_right: truth.lane_number.and_then(|n| estimate.lane_number.map(|m| m == n)),
    }
}

/// Mean of a value over runs, with its 95 % confidence interval (Student's t).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// Mean of the values.
    pub mean: f64,
    /// Half the width of the interval; infinite for a single run.
    pub half: f64,
    /// Number of values.
    pub runs: usize,
}

impl Figure {
    /// Computes mean and interval; None without values.
    pub fn of(values: &[f64]) -> Option<Figure> {
        let n = values.len();
        if n == 0 {
            return None;
        }
        let mean = values.iter().sum::<f64>() / n as f64;
        let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
        // A single value has no distribution.
        let student = StudentsT::new(0.0, 1.0, (n - 1) as f64).map(|t| t.inverse_cdf(0.975));
        let half = student.map_or(f64::INFINITY, |t| t * (squares / (n - 1) as f64 / n as f64).sqrt());
        Some(Figure { mean, half, runs: n })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::{Fitted, Shape};

    fn line(y: f64, from: f64, to: f64) -> Line {
        let curve = Clothoid {
            start_m: [from, y],
            heading_rad: 0.0,
            curvature_per_m: 0.0,
            curvature_rate_per_m2: 0.0,
            length_m: to - from,
        };
        let mut covariance = [[0.0; 4]; 4];
        (covariance[0][0], covariance[1][1]) = (0.01, 1e-4);
        let fitted = Fitted { curve, shape: Shape::Line, covariance, residual: 1.0 };
        Line { fitted, confidence: 0.9, members: vec![0, 1] }
    }

    fn truth() -> TrueLanes {
        let straight = |y: f64| (0..=80).map(|x| [f64::from(x), y]).collect();
        TrueLanes {
            lines: vec![straight(-1.75), straight(1.75)],
            own: [Some(0), Some(1)],
            offset_m: Some(0.0),
            heading_rad: Some(0.0),
            range_m: [5.0, 50.0],
            ..Default::default()
        }
    }

    #[test]
    fn the_truth_scores_full() {
        let e = LaneEstimate::of_lines("test", 0.0, 4, vec![line(1.75, 0.0, 60.0), line(-1.75, 0.0, 60.0)]);
        let s = score(&e, &truth());
        assert_eq!((s.precision, s.recall, s.f1), (Some(1.0), Some(1.0), Some(1.0)));
        assert!(s.lateral_m.iter().all(|l| l.unwrap() < 1e-9), "{s:?}");
        assert_eq!((s.offset_error_m, s.heading_error_rad), (Some(0.0), Some(0.0)));
        assert!((e.width_m.unwrap().value - 3.5).abs() < 1e-9);
    }

    /// Half of one line, and the other 0.4 m off.
    #[test]
    fn wrong_lines_cost_what_is_wrong() {
        let e = LaneEstimate::of_lines("test", 0.0, 4, vec![line(2.15, 0.0, 60.0), line(-1.75, 5.0, 27.5)]);
        let s = score(&e, &truth());
        let (p, r) = (s.precision.unwrap(), s.recall.unwrap());
        // One line of 45 m is off; of the other 22.5 of 45 m stand.
        assert!((p - 22.5 / 67.5).abs() < 0.02 && (r - 22.5 / 90.0).abs() < 0.02, "{p} {r}");
        assert!((s.lateral_m[0].unwrap() - 0.2).abs() < 1e-6 && (s.lateral_m[2].unwrap() - 0.4).abs() < 1e-6);
        assert!((s.offset_error_m.unwrap() + 0.2).abs() < 1e-9);
        let none = LaneEstimate::none("test", 0.0, 0, crate::LaneError::Empty);
        let s = score(&none, &truth());
        assert_eq!((s.precision, s.recall, s.f1), (None, Some(0.0), Some(0.0)));
    }

    /// A rail that is found is no mistake, and one that is not is not missed.
    #[test]
    fn other_lines_are_neither_wrong_nor_missed() {
        let t = TrueLanes { also: vec![(0..=80).map(|x| [f64::from(x), 5.0]).collect()], ..truth() };
        let both = || vec![line(1.75, 0.0, 60.0), line(-1.75, 0.0, 60.0)];
        let s = score(&LaneEstimate::of_lines("test", 0.0, 4, both()), &t);
        assert_eq!((s.precision, s.recall), (Some(1.0), Some(1.0)));
        let more = [both(), vec![line(5.0, 0.0, 60.0)]].concat();
        let s = score(&LaneEstimate::of_lines("test", 0.0, 6, more), &t);
        assert_eq!((s.precision, s.recall), (Some(1.0), Some(1.0)));
        let s = score(&LaneEstimate::of_lines("test", 0.0, 2, vec![line(5.0, 0.0, 60.0)]), &t);
        assert_eq!((s.precision, s.recall), (Some(1.0), Some(0.0)));
    }

    #[test]
    fn intervals_hold_the_mean_as_often_as_they_say() {
        // Of 0, 1 and 2 the mean is 1 with a deviation of 1, and Student's t of two degrees 4.302653.
        assert!((Figure::of(&[0.0, 1.0, 2.0]).unwrap().half - 4.302_653 / 3f64.sqrt()).abs() < 1e-6);
        let mut held = 0;
        let mut x = 88_172_645_463_325_252u64;
        let mut uniform = || {
            x ^= x << 13;
            x ^= x >> 7;
            x ^= x << 17;
            (x >> 11) as f64 / (1u64 << 53) as f64
        };
        for _ in 0..2000 {
            let v: Vec<f64> = (0..8).map(|_| (0..12).map(|_| uniform()).sum::<f64>() - 6.0).collect();
            let f = Figure::of(&v).unwrap();
            held += usize::from(f.mean.abs() <= f.half);
        }
        // 0.95 within four standard deviations of 0.0049.
        assert!((held as f64 / 2000.0 - 0.95).abs() < 0.02, "{held}");
        assert!(Figure::of(&[]).is_none() && Figure::of(&[1.0]).unwrap().half.is_infinite());
    }
}
