//! Curves through points: least squares, parabolas, cubic B-splines and extensions by arcs.

use crate::error::{LaneError, finite};
use crate::numeric::{principal_axis, wrapped};
use glam::DVec2;

/// The solution of an over-determined linear system.
pub(super) struct Solution {
    pub coefficients: Vec<f64>,
    /// Inverse of the normal matrix, n x n, row by row.
    pub inverse_normal: Vec<f64>,
    /// The diagonal of the hat matrix.
    pub leverages: Vec<f64>,
    pub residuals: Vec<f64>,
}

impl Solution {
    /// Residual variance with `m - n` degrees of freedom.
    pub fn variance(&self) -> f64 {
        let freedom = self.residuals.len().saturating_sub(self.coefficients.len()).max(1);
        self.residuals.iter().map(|r| r * r).sum::<f64>() / freedom as f64
    }

    /// Root mean square of the leave-one-out residuals r / (1 - h), where h is the leverage.
    pub fn leave_one_out_rms(&self) -> f64 {
        let sum: f64 = (self.residuals.iter().zip(&self.leverages))
            .map(|(r, h)| (r / (1.0 - h).max(1e-12)).powi(2))
            .sum();
        (sum / self.residuals.len().max(1) as f64).sqrt()
    }
}

/// Solves least squares by Gram-Schmidt with a second pass. `columns` holds n columns of m values.
pub(super) fn least_squares(columns: &[Vec<f64>], rhs: &[f64]) -> Result<Solution, LaneError> {
    let (n, m) = (columns.len(), rhs.len());
    if m <= n {
        return Err(LaneError::too_few("points for the fit", m, n + 1));
    }
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let mut q: Vec<Vec<f64>> = Vec::with_capacity(n);
    let mut r = vec![0.0; n * n];
    for (j, column) in columns.iter().enumerate() {
        let mut c = column.clone();
        let size = dot(&c, &c).sqrt();
        for _ in 0..2 {
            for (i, qi) in q.iter().enumerate() {
                let p = dot(qi, &c);
                r[i * n + j] += p;
                c.iter_mut().zip(qi).for_each(|(x, y)| *x -= p * y);
            }
        }
        let left = dot(&c, &c).sqrt();
        if !left.is_finite() {
            return Err(LaneError::not_finite("a sum of the fit"));
        }
        if left <= 1e-9 * size || left == 0.0 {
            return Err(LaneError::undetermined("the fit, because the points are too close together"));
        }
        r[j * n + j] = left;
        c.iter_mut().for_each(|x| *x /= left);
        q.push(c);
    }
    let mut inverse = vec![0.0; n * n];
    for j in 0..n {
        for i in (0..=j).rev() {
            let e = if i == j { 1.0 } else { 0.0 };
            let s: f64 = (i + 1..=j).map(|k| r[i * n + k] * inverse[k * n + j]).sum();
            inverse[i * n + j] = (e - s) / r[i * n + i];
        }
    }
    let qb: Vec<f64> = q.iter().map(|c| dot(c, rhs)).collect();
    let coefficients: Vec<f64> = (0..n).map(|i| dot(&inverse[i * n..(i + 1) * n], &qb)).collect();
    let mut inverse_normal = vec![0.0; n * n];
    for i in 0..n {
        for j in 0..n {
            inverse_normal[i * n + j] = dot(&inverse[i * n..(i + 1) * n], &inverse[j * n..(j + 1) * n]);
        }
    }
    let residuals: Vec<f64> =
        (0..m).map(|k| rhs[k] - q.iter().zip(&qb).map(|(c, b)| c[k] * b).sum::<f64>()).collect();
    let leverages = (0..m).map(|k| q.iter().map(|c| c[k] * c[k]).sum()).collect();
    if coefficients.iter().chain(&inverse_normal).any(|c: &f64| !c.is_finite()) {
        return Err(LaneError::not_finite("a coefficient of the fit"));
    }
    Ok(Solution { coefficients, inverse_normal, leverages, residuals })
}

/// The parabola w = a0 + a1 u + a2 u² (Sangeetha Lakshmi section 3.2) in its own frame, so that a road across
/// the car's axis needs no special case: u runs along `axis_rad` from `origin_m`, and w points to the left of
/// it.
#[derive(Debug, Clone, PartialEq)]
pub struct Parabola {
    /// Origin of the parabola's own frame, in the vehicle frame, m.
    pub origin_m: DVec2,
    /// Direction of the u axis, rad from the vehicle's x axis.
    pub axis_rad: f64,
    /// Coefficients: a0 in m, a1 dimensionless, a2 in 1/m.
    pub a: [f64; 3],
    /// Coordinates u of the first and the last point, m.
    pub span_m: [f64; 2],
    /// Covariance of `a`, estimated from the residuals.
    pub covariance: [[f64; 3]; 3],
    /// Standard deviation of one point about the curve, m.
    pub residual_m: f64,
    /// Number of points fitted.
    pub count: usize,
}

impl Parabola {
    fn along(&self) -> DVec2 {
        DVec2::from_angle(self.axis_rad)
    }

    /// Coordinate u of a point given in the vehicle frame, m.
    pub fn coordinate(&self, point_m: DVec2) -> f64 {
        (point_m - self.origin_m).dot(self.along())
    }

    /// Point of the curve at u, in the vehicle frame, m.
    pub fn point(&self, u_m: f64) -> DVec2 {
        let w = self.a[0] + u_m * (self.a[1] + u_m * self.a[2]);
        let e = self.along();
        self.origin_m + e * u_m + e.perp() * w
    }

    /// Direction of the curve at u, rad from the vehicle's x axis.
    pub fn heading_rad(&self, u_m: f64) -> f64 {
        wrapped(self.axis_rad + (self.a[1] + 2.0 * self.a[2] * u_m).atan())
    }

    /// Curvature at u, 1/m, positive when the curve bends to the left.
    pub fn curvature_1pm(&self, u_m: f64) -> f64 {
        let slope = self.a[1] + 2.0 * self.a[2] * u_m;
        2.0 * self.a[2] / (1.0 + slope * slope).powf(1.5)
    }

    /// Standard deviation of w at u, m, from the covariance of the fit.
    pub fn sigma_m(&self, u_m: f64) -> f64 {
        let b = [1.0, u_m, u_m * u_m];
        let mut sum = 0.0;
        for (i, bi) in b.iter().enumerate() {
            for (j, bj) in b.iter().enumerate() {
                sum += bi * self.covariance[i][j] * bj;
            }
        }
        sum.max(0.0).sqrt()
    }

    /// Standard deviation of the slope dw/du at u, from the covariance of the fit.
    pub fn sigma_slope(&self, u_m: f64) -> f64 {
        let [b, c] = [1.0, 2.0 * u_m];
        let of = &self.covariance;
        (b * b * of[1][1] + 2.0 * b * c * of[1][2] + c * c * of[2][2]).max(0.0).sqrt()
    }

    /// Standard deviation of the curvature near the frame's origin, 1/m: twice that of a2.
    pub fn sigma_curvature_1pm(&self) -> f64 {
        2.0 * self.covariance[2][2].max(0.0).sqrt()
    }

    /// Length of the span along u, m.
    pub fn length_m(&self) -> f64 {
        self.span_m[1] - self.span_m[0]
    }

    /// Position, direction and curvature at u, from which an arc extension starts.
    pub fn arc(&self, u_m: f64) -> Arc {
        Arc {
            point_m: self.point(u_m),
            heading_rad: self.heading_rad(u_m),
            curvature_1pm: self.curvature_1pm(u_m),
        }
    }

    /// Returns `count` points equally spaced in u from end to end, each moved by `left_m` to the left along
    /// the normal.
    pub fn samples(&self, count: usize, left_m: f64) -> Vec<DVec2> {
        let step = self.length_m() / count.saturating_sub(1).max(1) as f64;
        (0..count)
            .map(|i| {
                let u = self.span_m[0] + step * i as f64;
                self.point(u) + DVec2::from_angle(self.heading_rad(u)).perp() * left_m
            })
            .collect()
    }
}

/// Checks the points and returns (origin, axis): their mean, and the given axis or else the direction of
/// greatest spread, pointing from the first point to the last.
fn frame(points_m: &[DVec2], axis_rad: Option<f64>) -> Result<(DVec2, f64), LaneError> {
    if points_m.iter().any(|p| !p.is_finite()) {
        return Err(LaneError::not_finite("a point of the curve"));
    }
    let (Some(first), Some(last)) = (points_m.first(), points_m.last()) else {
        return Err(LaneError::too_few("points of the curve", 0, 4));
    };
    let (mean, widest) = principal_axis(points_m);
    if let Some(axis) = axis_rad {
        return Ok((mean, finite("the axis of the fit", axis)?));
    }
    let back = DVec2::from_angle(widest).dot(*last - *first) < 0.0;
    let axis = if back { wrapped(widest + std::f64::consts::PI) } else { widest };
    if mean.is_finite() && axis.is_finite() {
        Ok((mean, axis))
    } else {
        Err(LaneError::not_finite("the mean point"))
    }
}

fn in_frame(points_m: &[DVec2], origin_m: DVec2, axis_rad: f64) -> (Vec<f64>, Vec<f64>, [f64; 2]) {
    let e = DVec2::from_angle(axis_rad);
    let u: Vec<f64> = points_m.iter().map(|p| (*p - origin_m).dot(e)).collect();
    let w = points_m.iter().map(|p| (*p - origin_m).dot(e.perp())).collect();
    let span = [
        u.iter().copied().fold(f64::INFINITY, f64::min),
        u.iter().copied().fold(f64::NEG_INFINITY, f64::max),
    ];
    (u, w, span)
}

/// Fits a least-squares parabola (Sangeetha Lakshmi section 3.2) to at least four points in their order along
/// the road. `weights` are relative (inverse variances). Without `axis_rad` the u axis follows the greatest
/// spread.
///
/// # Errors
/// Returns an error for fewer than four points, for weights that are not one positive number per point, for
/// non-finite values, or if the points do not spread enough to determine the curve.
pub fn fit_parabola(
    points_m: &[DVec2],
    weights: Option<&[f64]>,
    axis_rad: Option<f64>,
) -> Result<Parabola, LaneError> {
    if points_m.len() < 4 {
        return Err(LaneError::too_few("points of the curve", points_m.len(), 4));
    }
    if let Some(w) = weights
        && (w.len() != points_m.len() || w.iter().any(|w| !(w.is_finite() && *w > 0.0)))
    {
        return Err(LaneError::out_of_range("a weight", f64::NAN, "a value above 0 for each point"));
    }
    let (origin_m, axis_rad) = frame(points_m, axis_rad)?;
    let (u, w, span_m) = in_frame(points_m, origin_m, axis_rad);
    let scale = 0.5 * (span_m[1] - span_m[0]);
    if scale.is_nan() || scale <= 1e-9 {
        return Err(LaneError::undetermined("the curve, because its points coincide"));
    }
    // Mean weight one keeps the residuals in metres.
    let mean_weight = weights.map_or(1.0, |w| w.iter().sum::<f64>() / w.len() as f64);
    let root: Vec<f64> = (0..u.len()).map(|i| weights.map_or(1.0, |w| (w[i] / mean_weight).sqrt())).collect();
    let column = |p: i32| -> Vec<f64> { u.iter().zip(&root).map(|(u, r)| r * (u / scale).powi(p)).collect() };
    let rhs: Vec<f64> = w.iter().zip(&root).map(|(w, r)| w * r).collect();
    let s = least_squares(&[column(0), column(1), column(2)], &rhs)?;
    let unit = |i: usize| scale.powi(-(i as i32));
    let variance = s.variance();
    let a = std::array::from_fn(|i| s.coefficients[i] * unit(i));
    let covariance = std::array::from_fn(|i| {
        std::array::from_fn(|j| s.inverse_normal[i * 3 + j] * variance * unit(i) * unit(j))
    });
    Ok(Parabola { origin_m, axis_rad, a, span_m, covariance, residual_m: variance.sqrt(), count: u.len() })
}

/// A uniform clamped cubic B-spline w(u) in a frame like that of [`Parabola`], with control values fitted by
/// least squares.
#[derive(Debug, Clone, PartialEq)]
pub struct BSpline {
    /// Origin of the spline's own frame, in the vehicle frame, m.
    pub origin_m: DVec2,
    /// Direction of the u axis, rad from the vehicle's x axis.
    pub axis_rad: f64,
    /// Coordinates u of the first and the last point, m.
    pub span_m: [f64; 2],
    /// Control values, m; there are `pieces + 3` of them.
    pub control_m: Vec<f64>,
}

/// The four non-zero basis values at `t` in [0, pieces] and the index of the first (Cox and de Boor).
fn cubic_basis(t: f64, pieces: usize) -> (usize, [f64; 4]) {
    let knot = |i: usize| (i as f64 - 3.0).clamp(0.0, pieces as f64);
    let k = (t.max(0.0).floor() as usize).min(pieces - 1) + 3;
    let mut b = [1.0, 0.0, 0.0, 0.0];
    for d in 1..=3 {
        let mut carry = 0.0;
        for (i, value) in b.iter_mut().enumerate().take(d) {
            let (right, left) = (knot(k + i + 1), knot(k + 1 + i - d));
            let part = *value / (right - left);
            *value = carry + (right - t) * part;
            carry = (t - left) * part;
        }
        b[d] = carry;
    }
    (k - 3, b)
}

impl BSpline {
    /// Point of the curve at u, in the vehicle frame, m; u is clamped to the span.
    pub fn point(&self, u_m: f64) -> DVec2 {
        let pieces = self.control_m.len().saturating_sub(3).max(1);
        let u = u_m.clamp(self.span_m[0], self.span_m[1]);
        let (first, b) =
            cubic_basis((u - self.span_m[0]) / (self.span_m[1] - self.span_m[0]) * pieces as f64, pieces);
        let w: f64 = b
            .iter()
            .enumerate()
            .map(|(i, b)| b * self.control_m.get(first + i).copied().unwrap_or(0.0))
            .sum();
        let e = DVec2::from_angle(self.axis_rad);
        self.origin_m + e * u + e.perp() * w
    }
}

/// Fits a spline of `pieces` equal pieces by least squares to at least `pieces + 4` points.
fn spline_solution(points_m: &[DVec2], pieces: usize) -> Result<(BSpline, Solution), LaneError> {
    if pieces == 0 || pieces > 1000 {
        return Err(LaneError::out_of_range("the number of spline segments", pieces as f64, "1 to 1000"));
    }
    if points_m.len() < pieces + 4 {
        return Err(LaneError::too_few("points of the spline", points_m.len(), pieces + 4));
    }
    let (origin_m, axis_rad) = frame(points_m, None)?;
    let (u, w, span_m) = in_frame(points_m, origin_m, axis_rad);
    let length = span_m[1] - span_m[0];
    if length.is_nan() || length <= 1e-9 {
        return Err(LaneError::undetermined("the curve, because its points coincide"));
    }
    let mut columns = vec![vec![0.0; u.len()]; pieces + 3];
    for (i, u) in u.iter().enumerate() {
        let (first, b) = cubic_basis((u - span_m[0]) / (span_m[1] - span_m[0]) * pieces as f64, pieces);
        b.iter().enumerate().for_each(|(j, b)| columns[first + j][i] = *b);
    }
    let s = least_squares(&columns, &w)?;
    Ok((BSpline { origin_m, axis_rad, span_m, control_m: s.coefficients.clone() }, s))
}

/// A parabola and a spline fitted to the same points, compared by leave-one-out: each point against the fit
/// without it.
#[derive(Debug, Clone, PartialEq)]
pub struct FitComparison {
    /// The parabola through the points.
    pub parabola: Parabola,
    /// The spline through the same points.
    pub spline: BSpline,
    /// Root mean square of the parabola's leave-one-out residuals, m.
    pub parabola_left_out_rms_m: f64,
    /// Root mean square of the spline's leave-one-out residuals, m.
    pub spline_left_out_rms_m: f64,
}

impl FitComparison {
    /// Whether the parabola's leave-one-out residuals are no larger than the spline's.
    pub fn parabola_is_better(&self) -> bool {
        self.parabola_left_out_rms_m <= self.spline_left_out_rms_m
    }
}

/// Fits a parabola and a spline of `pieces` pieces and tells which follows a track better (Sangeetha Lakshmi
/// section 3.2, figure 4).
///
/// # Errors
/// Returns an error for too few points (4, or `pieces + 4`), for `pieces` outside 1 to 1000, for non-finite
/// points, or if the points do not spread enough.
pub fn compare_fits(points_m: &[DVec2], pieces: usize) -> Result<FitComparison, LaneError> {
    let parabola = fit_parabola(points_m, None, None)?;
    let (u, w, _) = in_frame(points_m, parabola.origin_m, parabola.axis_rad);
    let columns: Vec<Vec<f64>> = (0..3).map(|p| u.iter().map(|u| u.powi(p)).collect()).collect();
    let p = least_squares(&columns, &w)?;
    let (spline, s) = spline_solution(points_m, pieces)?;
    Ok(FitComparison {
        parabola,
        spline,
        parabola_left_out_rms_m: p.leave_one_out_rms(),
        spline_left_out_rms_m: s.leave_one_out_rms(),
    })
}

/// The function sin(x) / x, 1 at 0.
fn sinc(x: f64) -> f64 {
    if x.abs() < 1e-8 { 1.0 } else { x.sin() / x }
}

/// A piece of road as a circular arc; a straight piece has curvature zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arc {
    /// Start of the arc in the vehicle frame, m.
    pub point_m: DVec2,
    /// Direction at the start, rad from the vehicle's x axis.
    pub heading_rad: f64,
    /// Curvature, 1/m, positive to the left.
    pub curvature_1pm: f64,
}

impl Arc {
    /// The arc that starts at `a_m` and passes through `b_m` to `c_m` (Sangeetha Lakshmi figure 6); it is
    /// straight when the three lie on one line.
    ///
    /// # Errors
    /// Returns an error if a point or the result is non-finite, or if two of the points coincide.
    pub fn through(a_m: DVec2, b_m: DVec2, c_m: DVec2) -> Result<Arc, LaneError> {
        let chord = c_m - a_m;
        if !(chord.is_finite() && b_m.is_finite()) {
            return Err(LaneError::not_finite("a point of the arc"));
        }
        let scale = (b_m - a_m).length() * (c_m - b_m).length() * chord.length();
        if scale.is_nan() || scale <= 0.0 {
            return Err(LaneError::undetermined("the arc, because two of its points coincide"));
        }
        // Signed curvature of three points: four times the area over the product of the sides.
        let curvature_1pm = 2.0 * (b_m - a_m).perp_dot(chord) / scale;
        // Between tangent and chord AB at A is the angle that AB is seen under from C.
        let at_c = chord.angle_to(c_m - b_m);
        let heading_rad = wrapped((b_m - a_m).to_angle() - at_c);
        match heading_rad.is_finite() && curvature_1pm.is_finite() {
            true => Ok(Arc { point_m: a_m, heading_rad, curvature_1pm }),
            false => Err(LaneError::not_finite("the arc")),
        }
    }

    /// Point after the arc length `s_m`, which may be negative, m.
    pub fn point(&self, s_m: f64) -> DVec2 {
        let half = 0.5 * self.curvature_1pm * s_m;
        self.point_m + DVec2::from_angle(self.heading_rad + half) * (s_m * sinc(half))
    }

    /// Direction after the arc length `s_m`, rad.
    pub fn heading_at(&self, s_m: f64) -> f64 {
        wrapped(self.heading_rad + self.curvature_1pm * s_m)
    }
}

#[cfg(test)]
mod tests {
    use super::super::synth::Draws;
    use super::*;

    fn line(n: usize, f: impl Fn(f64) -> f64) -> Vec<DVec2> {
        (0..n).map(|i| 10.0 + 2.0 * i as f64).map(|x| DVec2::new(x, f(x))).collect()
    }

    #[test]
    fn parabola_is_found_again_in_any_direction() {
        for turn in [0.0, 0.7, 1.6, -2.5, 3.1] {
            let points: Vec<DVec2> = line(20, |x| 0.3 - 0.02 * x + 1e-3 * x * x)
                .iter()
                .map(|p| DVec2::from_angle(turn).rotate(*p))
                .collect();
            let p = fit_parabola(&points, None, Some(turn)).unwrap();
            assert!(points.iter().all(|q| p.point(p.coordinate(*q)).distance(*q) < 1e-9));
            assert!((p.a[2] - 1e-3).abs() < 1e-12 && p.residual_m < 1e-9, "{:?}", p.a);
            // The slope at x = 10 is atan(-0.02 + 2e-3 * 10) = 0 before the turn.
            assert!(wrapped(p.heading_rad(p.span_m[0]) - turn).abs() < 1e-9);
            assert!((p.curvature_1pm(p.span_m[0]) - 2e-3).abs() < 1e-9);
        }
        let across: Vec<DVec2> = (0..9).map(|i| DVec2::new(40.0, i as f64)).collect();
        let p = fit_parabola(&across, None, None).unwrap();
        assert!((p.heading_rad(0.0) - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
    }

    #[test]
    fn covariance_is_what_repeats_scatter_by() {
        let mut draws = Draws::new(5, 0);
        let (mut sum, mut square, mut claimed) = (0.0, 0.0, 0.0);
        let runs = 2000;
        for _ in 0..runs {
            let points: Vec<DVec2> =
                line(30, |x| 1e-3 * x * x).iter().map(|p| *p + DVec2::Y * 0.2 * draws.normal()).collect();
            let p = fit_parabola(&points, None, Some(0.0)).unwrap();
            let e = p.point(p.span_m[1]).y - 1e-3 * 68.0 * 68.0;
            (sum, square, claimed) = (sum + e, square + e * e, claimed + p.sigma_m(p.span_m[1]).powi(2));
        }
        let (mean, variance, claimed) = (sum / runs as f64, square / runs as f64, claimed / runs as f64);
        // The mean has standard error sqrt(var/runs), a variance sqrt(2/runs) of itself; four of each.
        assert!(mean.abs() < 4.0 * (claimed / runs as f64).sqrt(), "{mean}");
        assert!((variance / claimed - 1.0).abs() < 4.0 * (2.0 / runs as f64).sqrt(), "{variance} {claimed}");
    }

    #[test]
    fn weights_pull_the_curve() {
        let mut points = line(10, |_| 0.0);
        points.extend(line(10, |_| 1.0));
        points.sort_by(|a, b| a.x.total_cmp(&b.x));
        let weights: Vec<f64> = points.iter().map(|p| if p.y > 0.5 { 3.0 } else { 1.0 }).collect();
        let p = fit_parabola(&points, Some(&weights), Some(0.0)).unwrap();
        assert!((p.point(0.0).y - 0.75).abs() < 1e-9);
        assert!(fit_parabola(&points, Some(&weights[1..]), None).is_err());
        assert!(fit_parabola(&points, Some(&[0.0; 20]), None).is_err());
    }

    #[test]
    fn spline_basis_sums_to_one_and_keeps_cubics() {
        for pieces in 1..6 {
            for i in 0..=50 {
                let (_, b) = cubic_basis(pieces as f64 * i as f64 / 50.0, pieces);
                assert!((b.iter().sum::<f64>() - 1.0).abs() < 1e-12 && b.iter().all(|b| *b > -1e-12));
            }
        }
        // A cubic without correlation to u, so that the spline's own frame is the cubic's.
        let u = |i: i32| f64::from(i) - 19.5;
        let ratio = (0..40).map(|i| u(i).powi(4)).sum::<f64>() / (0..40).map(|i| u(i).powi(2)).sum::<f64>();
        let own: Vec<DVec2> =
            (0..40).map(|i| DVec2::new(u(i), 1e-4 * u(i) * (u(i) * u(i) - ratio))).collect();
        for pieces in [1, 3, 5] {
            let s = spline_solution(&own, pieces).unwrap().0;
            assert!(s.axis_rad.abs() < 1e-9);
            let worst = own.iter().map(|p| s.point(p.x - s.origin_m.x).distance(*p)).fold(0.0, f64::max);
            assert!(worst < 1e-6, "{pieces} {worst}");
        }
    }

    /// Sangeetha Lakshmi section 3.2: the parabola follows a noisy track better than the spline.
    #[test]
    fn parabola_beats_the_spline_on_tracks() {
        let mut draws = Draws::new(6, 0);
        let (mut wins, mut p_error, mut s_error) = (0, 0.0, 0.0);
        for _ in 0..200 {
            let bend = 4e-3 * (draws.uniform() - 0.5);
            let truth = line(40, |x| 0.5 * bend * x * x);
            let noisy: Vec<DVec2> =
                truth.iter().map(|p| *p + DVec2::new(draws.normal(), draws.normal()) * 0.3).collect();
            let c = compare_fits(&noisy, 5).unwrap();
            wins += usize::from(c.parabola_is_better());
            for t in &truth {
                let near = |q: DVec2| (q - *t).dot(DVec2::from_angle((bend * t.x).atan()).perp()).powi(2);
                p_error += near(c.parabola.point(c.parabola.coordinate(*t)));
                s_error += near(c.spline.point(c.parabola.coordinate(*t)));
            }
        }
        let (p_rms, s_rms) = ((p_error / 8000.0f64).sqrt(), (s_error / 8000.0f64).sqrt());
        println!("parabola {p_rms:.3} m, spline of 5 pieces {s_rms:.3} m, parabola chosen {wins} of 200");
        // Variance goes with the number of coefficients, 3 against 8: 0.3 sqrt(3/40) = 0.08 and 0.13 m.
        assert!(p_rms < 0.1 && s_rms > 1.3 * p_rms && wins > 160);
    }

    #[test]
    fn an_arc_goes_through_its_points() {
        let mut draws = Draws::new(7, 0);
        for _ in 0..200 {
            let centre = DVec2::new(draws.normal(), draws.normal()) * 30.0;
            let radius = 20.0 + 300.0 * draws.uniform();
            let (start, way) = (6.0 * draws.uniform(), if draws.uniform() < 0.5 { 1.0 } else { -1.0 });
            let at = |s: f64| centre + DVec2::from_angle(start + way * s / radius) * radius;
            let arc = Arc::through(at(0.0), at(7.0), at(15.0)).unwrap();
            assert!((arc.curvature_1pm - way / radius).abs() < 1e-9);
            for s in [-40.0, -3.0, 0.0, 7.0, 15.0, 60.0] {
                assert!(arc.point(s).distance(at(s)) < 1e-6, "{s} {arc:?}");
            }
        }
        let x = |v: f64| DVec2::new(v, 2.0);
        assert_eq!(Arc::through(x(0.0), x(1.0), x(5.0)).unwrap().point(-4.0), x(-4.0));
        assert!(Arc::through(x(1.0), x(1.0), x(2.0)).is_err());
    }

    #[test]
    fn hostile_points_are_refused() {
        let bad =
            [DVec2::new(f64::NAN, 0.0), DVec2::ZERO, DVec2::X, DVec2::new(2.0, 0.0), DVec2::new(3.0, 0.0)];
        assert_eq!(fit_parabola(&bad, None, None), Err(LaneError::not_finite("a point of the curve")));
        for points in [
            vec![],
            vec![DVec2::X],
            vec![DVec2::X; 9],
            vec![DVec2::splat(1e308), DVec2::X, DVec2::Y, DVec2::ZERO, DVec2::splat(-1e308)],
        ] {
            assert!(fit_parabola(&points, None, None).is_err());
            assert!(compare_fits(&points, 3).is_err());
        }
        assert!(compare_fits(&line(20, |x| x), 0).is_err());
        // A spline piece without a point leaves its control values open.
        let gap: Vec<DVec2> = line(40, |_| 1.0).into_iter().filter(|p| p.x < 20.0 || p.x > 80.0).collect();
        assert!(compare_fits(&gap, 8).is_err());
    }
}
