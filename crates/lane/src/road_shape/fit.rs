//! Robust weighted least squares of one edge, or of two parallel ones, starting from the result of the vote.
//!
//! In addition to Miyake's Hough transform: points have errors along both axes, so each is compared with its
//! foot on the curve along its own covariance (total least squares by Gauss–Newton). Tukey's biweight
//! suppresses points of other things (Beaton and Tukey 1974).

use super::clothoid::EdgeMeasurement;
use super::hough::unsupported;
use super::{Side, StaticPoint};
use crate::error::{LaneError, Result, finite, not_negative, positive};
use crate::matrix::{inverse, quadratic, times};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Curve that is fitted to an edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Curve {
    /// Parabola y = a x² + b (Miyake eq. 23). For a circle visible up to x its a is too large by about ¾ (x/R)² · ⅞.
    Parabola,
    /// Circle of curvature 2a that is tangent to this parabola at x = 0.
    Arc,
}

/// Settings of the fit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FitSettings {
    /// Curve that is fitted to an edge.
    pub curve: Curve,
    /// Distance from the curve beyond which points have no weight, in standard deviations (Tukey's c).
    pub cutoff: f64,
    /// Standard deviation of the road's direction at x = 0 from the car's, rad: the direction is estimated
    /// with this prior; 0 for Miyake's model.
    pub heading_std_rad: f64,
    /// Roughness of a wall, added to each point's standard deviation, m.
    pub floor_std_m: f64,
    /// Random walk of the road's c1 ahead of the car, 1/m² per √m, as in
    /// [`super::ClothoidSettings::c1_walk`]. Its effect on the shape up to x counts as an error of the points
    /// there and enters the covariance. 0 where c1 is constant.
    pub c1_walk: f64,
    /// Uncertainty of the start value of b, m.
    pub start_b_m: f64,
    /// Uncertainty of the start value of a, 1/m.
    pub start_a_per_m: f64,
    /// Least distance ahead of points that are used, m.
    pub x_min_m: f64,
    /// Largest distance ahead of points that are used, m.
    pub x_max_m: f64,
    /// Least number of points that support an edge.
    pub min_points: usize,
    /// Least stretch of road that the points cover, m.
    pub min_extent_m: f64,
    /// Largest number of iterations of the reweighted fit.
    pub max_iterations: usize,
}

impl Default for FitSettings {
    fn default() -> Self {
        Self {
            curve: Curve::Arc,
            cutoff: 4.685,
            heading_std_rad: 0.0,
            floor_std_m: 0.1,
            c1_walk: 6e-6,
            start_b_m: 0.25,
            start_a_per_m: 1.25e-4,
            x_min_m: 0.0,
            x_max_m: 90.0,
            min_points: 6,
            min_extent_m: 15.0,
            max_iterations: 40,
        }
    }
}

impl FitSettings {
    /// Checks every setting.
    ///
    /// # Errors
    /// Returns an error for the first setting outside its range.
    pub fn validate(&self) -> Result<()> {
        positive("cutoff", self.cutoff)?;
        not_negative("heading_std_rad", self.heading_std_rad)?;
        positive("floor_std_m", self.floor_std_m)?;
        not_negative("c1_walk", self.c1_walk)?;
        not_negative("start_b_m", self.start_b_m)?;
        not_negative("start_a_per_m", self.start_a_per_m)?;
        not_negative("min_extent_m", self.min_extent_m)?;
        positive("x_max_m - x_min_m", self.x_max_m - self.x_min_m).map(|_| ())
    }
}

/// A fitted edge y = b + heading·x + (curve of a), and its measurement of a clothoid.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct EdgeFit {
    /// The side of the vehicle on which the edge lies.
    pub side: Side,
    /// Half the curvature at x = 0, 1/m, positive to the left.
    pub a_per_m: f64,
    /// Place of the edge beside the vehicle, m, positive to the left.
    pub b_m: f64,
    /// Direction of the road relative to the car's, rad, positive to the left; 0 where it is not estimated.
    pub heading_rad: f64,
    /// Covariance of (a, b), in units 1/m², 1, 1, m².
    pub covariance: [[f64; 2]; 2],
    /// Amounts that c1 = 1/m² would add to a and to b of a curve without c1, m and m³.
    pub cubic: [f64; 2],
    /// Number of points that the fit used.
    pub points: usize,
    /// Distance ahead of the first point that supports the edge, m.
    pub x_min_m: f64,
    /// Distance ahead of the last point that supports the edge, m.
    pub x_max_m: f64,
    /// Ratio of the spread of the residuals to the stated standard deviations: 1 where they are right. Where
    /// it is significantly larger, the covariance includes its square.
    pub spread: f64,
}

impl EdgeFit {
    /// The measurement for [`super::ClothoidFilter`].
    pub fn measurement(&self) -> EdgeMeasurement {
        EdgeMeasurement {
            a_per_m: self.a_per_m,
            b_m: self.b_m,
            covariance: self.covariance,
            cubic: self.cubic,
        }
    }
}

/// Values y, dy/dx and dy/dκ of the bend alone.
pub(super) fn bend(curve: Curve, kappa: f64, x: f64) -> Option<(f64, f64, f64)> {
    match curve {
        Curve::Parabola => Some((0.5 * kappa * x * x, kappa * x, 0.5 * x * x)),
        Curve::Arc => {
            let sin = kappa * x;
            if sin.is_nan() || sin.abs() >= 0.95 {
                return None;
            }
            let cos = (1.0 - sin * sin).sqrt();
            Some((kappa * x * x / (1.0 + cos), sin / cos, x * x / (cos * (1.0 + cos))))
        }
    }
}

/// Fits the edge near `start` = (a, b).
///
/// # Errors
/// Returns an error for an invalid setting or start, for too few points near it or over too short a stretch,
/// or for a fit that leaves the allowed curves.
pub fn fit_edge(
    points: &[StaticPoint],
    start: (f64, f64),
    side: Side,
    settings: &FitSettings,
) -> Result<EdgeFit> {
    let mut starts = [None, None];
    starts[side.index()] = Some(start);
    fit(points, starts, false, settings)?[side.index()].take().ok_or_else(|| unsupported(side))
}

/// Fits both edges with one reference curve (curvature c on the car's x axis, c/(1 − b c) at distance b).
///
/// The required extent may come from either edge.
///
/// # Errors
/// Returns the errors of [`fit_edge`]; each edge needs two points.
pub fn fit_parallel(
    points: &[StaticPoint],
    starts: [(f64, f64); 2],
    settings: &FitSettings,
) -> Result<[EdgeFit; 2]> {
    let [left, right] = fit(points, starts.map(Some), true, settings)?;
    let given = |fit: Option<EdgeFit>, side| fit.ok_or_else(|| unsupported(side));
    Ok([given(left, Side::Left)?, given(right, Side::Right)?])
}

/// Parameters: a (of the edge, or of the reference curve), b of the left and right edge, heading.
const A: usize = 0;
const HEADING: usize = 3;
/// Steps of the road's walk over the settings' stretch.
const KNOTS: usize = 16;

struct Sums {
    /// Σ w J Jᵀ and Σ w J e: of the step.
    normal: [[f64; 4]; 4],
    gradient: [f64; 4],
    /// Σ J Jᵀ/s² of the points with weight, s² = σ² + what the road may do; Σ J Jᵀ σ²/s⁴.
    plain: [[f64; 4]; 4],
    noise: [[f64; 4]; 4],
    /// Σ J x³/6s², and the same for a c1 that starts at each knot.
    cubic: [f64; 4],
    knots: [[f64; 4]; KNOTS],
    weight: f64,
    weighted_square: f64,
    used: [usize; 2],
    span: [[f64; 2]; 2],
}

fn fit(
    points: &[StaticPoint],
    starts: [Option<(f64, f64)>; 2],
    parallel: bool,
    s: &FitSettings,
) -> Result<[Option<EdgeFit>; 2]> {
    s.validate()?;
    for (a, b) in starts.iter().flatten() {
        finite("start of a", *a)?;
        finite("start of b", *b)?;
    }
    let active = starts.map(|p| p.is_some());
    let given = || starts.iter().flatten();
    let mut theta = [0.0; 4];
    // For parallel edges a of the reference curve: κ = κ_i/(1 + b κ_i).
    let reference = |a: f64, b: f64| if parallel { a / (1.0 + 2.0 * a * b) } else { a };
    theta[A] = given().map(|(a, b)| reference(*a, *b)).sum::<f64>() / given().count().max(1) as f64;
    for (i, start) in starts.iter().enumerate() {
        theta[1 + i] = start.map_or(0.0, |p| p.1);
    }
    let use_heading = s.heading_std_rad > 0.0;
    let mut sums = None;
    let mut settled = false;
    for iteration in 0..s.max_iterations.max(5) {
        // Deviations widened by what the start leaves open, then as they are.
        let slack = [2.0, 1.0, 0.5, 0.25].get(iteration).copied().unwrap_or(0.0);
        let now = accumulate(points, &theta, active, parallel, slack, s);
        let mut normal = now.normal;
        let mut gradient = now.gradient;
        fix(&mut normal, &mut gradient, active, use_heading, theta[HEADING], s);
        let enough = now.used.iter().sum::<usize>();
        if enough < s.min_points {
            return Err(LaneError::too_few("points", enough, s.min_points));
        }
        let Some(inv) = inverse(&normal) else { return Err(LaneError::undetermined("the curve")) };
        let step = times(&inv, &gradient);
        for (t, d) in theta.iter_mut().zip(step) {
            *t += d;
        }
        if theta.iter().any(|t| !t.is_finite()) || theta[A].abs() > 0.05 {
            return Err(LaneError::refused("the fit left the range of allowed curves"));
        }
        let reach = s.x_max_m * s.x_max_m;
        settled = step[A].abs() * reach + step[1].abs() + step[2].abs() + step[3].abs() * s.x_max_m < 1e-6;
        sums = Some(now);
        if settled && slack == 0.0 {
            break;
        }
        settled = false;
    }
    // A point at the cut-off can make the iterations cycle: within a tenth of the standard deviation that is
    // harmless.
    let Some(last) = sums else { return Err(LaneError::undetermined("the curve")) };
    let mut plain = last.plain;
    fix(&mut plain, &mut [0.0; 4], active, use_heading, 0.0, s);
    let Some(inv) = inverse(&plain) else { return Err(LaneError::undetermined("the curve")) };
    if !settled {
        let now = accumulate(points, &theta, active, parallel, 0.0, s);
        let mut normal = now.normal;
        let mut gradient = now.gradient;
        fix(&mut normal, &mut gradient, active, use_heading, theta[HEADING], s);
        let step =
            inverse(&normal).map(|i| times(&i, &gradient)).ok_or(LaneError::undetermined("the curve"))?;
        if (0..4).any(|i| step[i] * step[i] > 0.01 * inv[i][i]) && quadratic(&normal, &step) > 0.04 {
            return Err(LaneError::refused("the fit left the range of allowed curves"));
        }
    }
    let total = last.used.iter().sum::<usize>();
    let parameters = 1 + active.iter().filter(|a| **a).count();
    let extent = (0..2)
        .filter(|i| active[*i] && last.used[*i] > 0)
        .map(|i| last.span[i][1] - last.span[i][0])
        .fold(0.0, f64::max);
    if extent < s.min_extent_m {
        return Err(super::hough::too_short(extent, s.min_extent_m));
    }
    let (w0, w2, efficiency) = tukey_moments(s.cutoff);
    let freedom = total.saturating_sub(parameters).max(1) as f64;
    let square = last.weighted_square / last.weight / (w2 / w0) * total as f64 / freedom;
    // Larger than chance allows (99 %, Wilson and Hilferty 1931): then the deviations are too small.
    let h = 2.0 / (9.0 * freedom);
    let limit = (1.0 - h + 2.326 * h.sqrt()).powi(3);
    let factor = if square > limit { square } else { 1.0 } / efficiency;
    let leak = times(&inv, &last.cubic);
    let mut noise = last.noise;
    if use_heading {
        noise[HEADING][HEADING] += 1.0 / (s.heading_std_rad * s.heading_std_rad);
    }
    let walks = last.knots.map(|k| times(&inv, &k));
    let walk_variance = s.c1_walk * s.c1_walk * s.x_max_m.max(0.0) / KNOTS as f64;
    let covariance = |i: usize, j: usize| {
        let right = times(&noise, &inv[j]);
        let points: f64 = (0..4).map(|k| inv[i][k] * right[k]).sum();
        factor * points + walk_variance * walks.iter().map(|w| w[i] * w[j]).sum::<f64>()
    };
    Ok(Side::BOTH.map(|side| {
        let i = side.index();
        let b = 1 + i;
        let gain = if parallel { 1.0 / (1.0 - 2.0 * theta[A] * theta[b]) } else { 1.0 };
        let own_side = side.sign() * theta[b] > 0.0;
        (active[i] && own_side && last.used[i] >= 2).then(|| EdgeFit {
            side,
            a_per_m: gain * theta[A],
            b_m: theta[b],
            heading_rad: theta[HEADING],
            covariance: [
                [gain * gain * covariance(A, A), gain * covariance(A, b)],
                [gain * covariance(A, b), covariance(b, b)],
            ],
            cubic: [gain * leak[A], leak[b]],
            points: last.used[i],
            x_min_m: last.span[i][0],
            x_max_m: last.span[i][1],
            spread: square.sqrt(),
        })
    }))
}

/// Adds the heading's prior, and fixes what is not estimated.
fn fix(
    normal: &mut [[f64; 4]; 4],
    rhs: &mut [f64; 4],
    active: [bool; 2],
    use_heading: bool,
    heading: f64,
    s: &FitSettings,
) {
    if use_heading {
        let weight = 1.0 / (s.heading_std_rad * s.heading_std_rad);
        normal[HEADING][HEADING] += weight;
        rhs[HEADING] -= weight * heading;
    }
    for (k, keep) in [(1, active[0]), (2, active[1]), (HEADING, use_heading)] {
        if !keep {
            for row in normal.iter_mut() {
                row[k] = 0.0;
            }
            normal[k] = [0.0; 4];
            normal[k][k] = 1.0;
            rhs[k] = 0.0;
        }
    }
}

fn accumulate(
    points: &[StaticPoint],
    theta: &[f64; 4],
    active: [bool; 2],
    parallel: bool,
    slack: f64,
    s: &FitSettings,
) -> Sums {
    let mut sums = Sums {
        normal: [[0.0; 4]; 4],
        gradient: [0.0; 4],
        plain: [[0.0; 4]; 4],
        noise: [[0.0; 4]; 4],
        cubic: [0.0; 4],
        knots: [[0.0; 4]; KNOTS],
        weight: 0.0,
        weighted_square: 0.0,
        used: [0; 2],
        span: [[f64::INFINITY, f64::NEG_INFINITY]; 2],
    };
    for p in points {
        let [xx, xy, yy] = p.covariance_m2;
        let usable = [p.x_m, p.y_m, xx, xy, yy].iter().all(|v| v.is_finite()) && xx >= 0.0 && yy >= 0.0;
        if !usable || p.x_m < s.x_min_m || p.x_m > s.x_max_m {
            continue;
        }
        let floor =
            s.floor_std_m * s.floor_std_m + (slack * (s.start_b_m + s.start_a_per_m * p.x_m * p.x_m)).powi(2);
        let (xx, yy) = (xx + floor, yy + floor);
        // A point belongs to the edge that it is nearer to.
        let nearest = (0..2)
            .filter(|i| active[*i])
            .filter_map(|i| {
                let gain = if parallel { 1.0 / (1.0 - 2.0 * theta[A] * theta[1 + i]) } else { 1.0 };
                let kappa = 2.0 * theta[A] * gain;
                let residual = |x: f64| {
                    let (y, slope, by_kappa) = bend(s.curve, kappa, x)?;
                    let slope = slope + theta[HEADING];
                    let off = p.y_m - theta[1 + i] - theta[HEADING] * x - y;
                    // Against the tangent at x, where p may lie beside it.
                    let e = off - slope * (p.x_m - x);
                    let variance = yy - 2.0 * slope * xy + slope * slope * xx;
                    (variance > 0.0).then_some((e, slope, by_kappa, variance))
                };
                let mut x = p.x_m;
                let mut at = residual(x)?;
                for _ in 0..2 {
                    // An outlier's foot means nothing, and one this far has no weight.
                    if at.0 * at.0 > 4.0 * s.cutoff * s.cutoff * at.3 {
                        break;
                    }
                    x = p.x_m - (xy - at.1 * xx) * at.0 / at.3;
                    at = residual(x)?;
                }
                Some((i, x, gain, at))
            })
            .min_by(|p, q| (p.3.0 * p.3.0 / p.3.3).total_cmp(&(q.3.0 * q.3.0 / q.3.3)));
        let Some((i, x, gain, (e, _, by_kappa, variance))) = nearest else { continue };
        let u2 = e * e / variance / (s.cutoff * s.cutoff);
        if u2.is_nan() || u2 >= 1.0 {
            continue;
        }
        let weight = (1.0 - u2) * (1.0 - u2);
        let mut j = [0.0; 4];
        j[A] = 2.0 * gain * by_kappa;
        j[1 + i] = 1.0;
        if s.heading_std_rad > 0.0 {
            j[HEADING] = x;
        }
        // ∫ (x − s)⁶/36 ds: c1 that walks from x = 0 on.
        let total = variance + s.c1_walk * s.c1_walk * x.max(0.0).powi(7) / 252.0;
        let knots: [f64; KNOTS] = std::array::from_fn(|k| {
            let from = (k as f64 + 0.5) * s.x_max_m / KNOTS as f64;
            (x - from).max(0.0).powi(3) / 6.0
        });
        for r in (0..4).filter(|r| j[*r] != 0.0) {
            let row = j[r] / total;
            sums.gradient[r] += weight * row * e;
            sums.cubic[r] += row * x * x * x / 6.0;
            for (k, knot) in knots.iter().enumerate() {
                sums.knots[k][r] += row * knot;
            }
            for (c, jc) in j.iter().enumerate() {
                sums.normal[r][c] += weight * row * jc;
                sums.plain[r][c] += row * jc;
                sums.noise[r][c] += row * jc * variance / total;
            }
        }
        sums.weight += weight;
        sums.weighted_square += weight * e * e / variance;
        sums.used[i] += 1;
        sums.span[i] = [sums.span[i][0].min(p.x_m), sums.span[i][1].max(p.x_m)];
    }
    sums
}

/// For standard normal u and Tukey's weight w: E w, E w u², and the efficiency (E ψ')²/E ψ², by
/// Simpson's rule within the cut-off.
fn tukey_moments(c: f64) -> (f64, f64, f64) {
    const STEPS: usize = 400;
    let end = c.min(9.0);
    let (mut w0, mut w2, mut psi2, mut slope) = (0.0, 0.0, 0.0, 0.0);
    for k in 0..=STEPS {
        let u = end * k as f64 / STEPS as f64;
        let simpson = if k == 0 || k == STEPS { 1.0 } else { 2.0 + 2.0 * (k % 2) as f64 };
        let density = simpson * (-0.5 * u * u).exp();
        let q = 1.0 - u * u / (c * c);
        let w = q * q;
        w0 += density * w;
        w2 += density * w * u * u;
        psi2 += density * (w * u).powi(2);
        slope += density * (w - 4.0 * q * u * u / (c * c));
    }
    // The half line's integral, doubled, over √2π.
    let norm = 2.0 * end / STEPS as f64 / 3.0 / (2.0 * std::f64::consts::PI).sqrt();
    (w0 * norm, w2 * norm, (slope * slope) * norm / psi2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tukeys_constants_are_the_known_ones() {
        let (w0, w2, efficiency) = tukey_moments(4.685);
        // Moments of the normal distribution: E w = 1 − 2/c² + 3/c⁴, E w u² = 1 − 6/c² + 15/c⁴ (uncut).
        let c2 = 4.685_f64.powi(2);
        assert!((w0 - (1.0 - 2.0 / c2 + 3.0 / (c2 * c2))).abs() < 1e-4, "{w0}");
        assert!((w2 - (1.0 - 6.0 / c2 + 15.0 / (c2 * c2))).abs() < 1e-3, "{w2}");
        assert!((efficiency - 0.95).abs() < 1e-3, "{efficiency}");
        assert!(tukey_moments(100.0).2 > 0.9999);
    }

    #[test]
    fn slopes_of_the_arc_are_differences() {
        for (k, x) in [(1.0 / 160.0, 60.0), (-1.0 / 90.0, 70.0), (1e-9, 50.0)] {
            let d = 1e-6;
            let at = |k: f64, x: f64| bend(Curve::Arc, k, x).unwrap().0;
            let (y, slope, by_kappa) = bend(Curve::Arc, k, x).unwrap();
            let circle =
                if k.abs() > 1e-6 { (1.0 - (1.0 - k * k * x * x).sqrt()) / k } else { 0.5 * k * x * x };
            assert!((y - circle).abs() < 1e-9);
            assert!((slope - (at(k, x + d) - at(k, x - d)) / (2.0 * d)).abs() < 1e-6);
            let dk = 1e-8;
            let numeric = (at(k + dk, x) - at(k - dk, x)) / (2.0 * dk);
            assert!((by_kappa / numeric - 1.0).abs() < 1e-5, "{by_kappa} {numeric}");
        }
        assert_eq!(bend(Curve::Arc, 0.1, 20.0), None);
    }
}
