//! Curves of lanes: clothoids, whose curvature changes linearly along the curve, fitted to points with their
//! covariance.

use crate::numeric::bilinear;
use glam::{DMat4, DVec2, DVec4};
use serde::{Deserialize, Serialize};

/// A straight line, arc or clothoid that begins at `start_m`. Lengths along it are in m; headings are in rad
/// from the x axis, positive to the left.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Clothoid {
    /// Where the curve starts, m.
    pub start_m: [f64; 2],
    /// Direction at the start, rad from the x axis.
    pub heading_rad: f64,
    /// Curvature at the start, 1/m, positive to the left.
    pub curvature_per_m: f64,
    /// Change of the curvature along the curve, 1/m².
    pub curvature_rate_per_m2: f64,
    /// Length of the curve, m.
    pub length_m: f64,
}

/// A point on a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurvePoint {
    /// Position, m.
    pub at_m: DVec2,
    /// Direction of the curve there, rad from the x axis.
    pub heading_rad: f64,
    /// Curvature there, 1/m, positive to the left.
    pub curvature_per_m: f64,
}

/// The perpendicular foot of a point on a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foot {
    /// Length along the curve, m; below 0 and beyond the length it lies on the tangents at the ends.
    pub s_m: f64,
    /// Distance of the point to the left of the curve, m.
    pub left_m: f64,
}

/// The family that a curve belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Shape {
    /// A straight line.
    Line,
    /// A circular arc.
    Arc,
    /// A clothoid.
    Clothoid,
}

impl Shape {
    /// Number of parameters: lateral position and heading at the start, then curvature, then its rate.
    pub fn parameters(self) -> usize {
        match self {
            Shape::Line => 2,
            Shape::Arc => 3,
            Shape::Clothoid => 4,
        }
    }
}

/// A fitted curve.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Fitted {
    /// The curve itself.
    pub curve: Clothoid,
    /// Its shape, which says how many parameters were fitted.
    pub shape: Shape,
    /// Covariance of lateral position (m), heading (rad), curvature (1/m) and its rate (1/m²) at the start;
    /// zero for what the shape does not have.
    pub covariance: [[f64; 4]; 4],
    /// Root mean square of the lateral residuals divided by their standard deviations.
    pub residual: f64,
}

/// Nodes and weights of Gauss' five-point rule on -1 to 1.
pub(crate) const GAUSS: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
];
/// Longest turn of one panel of the rule, rad: its remainder is then below 1e-12 of the length.
const PANEL_RAD: f64 = 1.0;
/// Largest number of iterations of a fit.
const ROUNDS: usize = 20;

/// The displacement from the start to a place, and what the derivatives need of it.
struct PathIntegrals {
    to_m: DVec2,
    /// Integral of the position over the length; `second` is that of the position times the length.
    first: DVec2,
    second: DVec2,
}

impl Clothoid {
    fn heading_at(&self, s: f64) -> f64 {
        self.heading_rad + s * (self.curvature_per_m + 0.5 * s * self.curvature_rate_per_m2)
    }

    fn way(&self, s: f64) -> PathIntegrals {
        let most =
            self.curvature_per_m.abs().max((self.curvature_per_m + s * self.curvature_rate_per_m2).abs());
        if most == 0.0 {
            let t = DVec2::from_angle(self.heading_rad);
            return PathIntegrals { to_m: t * s, first: t * (s * s / 2.0), second: t * (s * s * s / 3.0) };
        }
        let panels = (s.abs() * most / PANEL_RAD).ceil().clamp(1.0, 10_000.0);
        let step = s / panels;
        let mut way = PathIntegrals { to_m: DVec2::ZERO, first: DVec2::ZERO, second: DVec2::ZERO };
        for k in 0..panels as usize {
            let (a, b) = (step * k as f64, step * (k + 1) as f64);
            let (mut to, mut first, mut second) = (DVec2::ZERO, DVec2::ZERO, DVec2::ZERO);
            for (x, w) in GAUSS {
                let u = 0.5 * (a + b) + 0.5 * step * x;
                let t = DVec2::from_angle(self.heading_at(u)) * (0.5 * step * w);
                to += t;
                first += t * (b - u);
                second += t * (0.5 * (b * b - u * u));
            }
            way.second += way.to_m * (0.5 * (b * b - a * a)) + second;
            way.first += way.to_m * step + first;
            way.to_m += to;
        }
        way
    }

    /// The point at `s_m` along the curve; beyond its ends on the tangents.
    pub fn at(&self, s_m: f64) -> CurvePoint {
        let s = s_m.clamp(0.0, self.length_m.max(0.0));
        let heading_rad = self.heading_at(s);
        let at = DVec2::from_array(self.start_m) + self.way(s).to_m;
        CurvePoint {
            at_m: at + DVec2::from_angle(heading_rad) * (s_m - s),
            heading_rad,
            curvature_per_m: self.curvature_per_m + s * self.curvature_rate_per_m2,
        }
    }

    /// Points about `step_m` apart, both ends included, m.
    pub fn sample(&self, step_m: f64) -> Vec<DVec2> {
        let n = (self.length_m / step_m.max(1e-3)).ceil().clamp(1.0, 1e6) as usize;
        (0..=n).map(|i| self.at(self.length_m * i as f64 / n as f64).at_m).collect()
    }

    /// The foot of `p` on the curve that is nearest to it.
    pub fn foot(&self, p: DVec2) -> Foot {
        // Coarse search first: a curve that turns back has several feet.
        let n = ((self.length_m
            * (self.curvature_per_m.abs() + self.length_m * self.curvature_rate_per_m2.abs())
            / 0.3)
            .max(self.length_m / 25.0))
        .ceil()
        .clamp(2.0, 2000.0) as usize;
        let coarse = (0..=n).map(|i| self.length_m * i as f64 / n as f64);
        let distance = |s: f64| self.at(s).at_m.distance_squared(p);
        let first = coarse.map(|s| (distance(s), s)).min_by(|a, b| a.0.total_cmp(&b.0));
        self.foot_near(p, first.map_or(0.0, |f| f.1))
    }

    /// The foot of `p` that Newton's method reaches from the place `s_m`.
    fn foot_near(&self, p: DVec2, s_m: f64) -> Foot {
        let mut s = s_m;
        for _ in 0..12 {
            let here = self.at(s);
            let d = p - here.at_m;
            let t = DVec2::from_angle(here.heading_rad);
            // Newton's method on d . t = 0; on the tangents there is no curvature.
            let inside = (0.0..=self.length_m).contains(&s);
            let bent = if inside { here.curvature_per_m * t.perp_dot(d) } else { 0.0 };
            let step = d.dot(t) / (1.0 - bent).max(0.2);
            s += step;
            if step.abs() < 1e-10 * (1.0 + s.abs()) {
                break;
            }
        }
        let here = self.at(s);
        Foot { s_m: s, left_m: DVec2::from_angle(here.heading_rad).perp_dot(p - here.at_m) }
    }

    /// The same curve, longer by `before_m` and `after_m` at its ends.
    pub fn extended(&self, before_m: f64, after_m: f64) -> Clothoid {
        Clothoid {
            start_m: (DVec2::from_array(self.start_m) + self.way(-before_m).to_m).to_array(),
            heading_rad: self.heading_at(-before_m),
            curvature_per_m: self.curvature_per_m - before_m * self.curvature_rate_per_m2,
            length_m: before_m + self.length_m + after_m,
            ..*self
        }
    }

    /// The part of the curve from `from_m` to `to_m` along it.
    pub fn part(&self, from_m: f64, to_m: f64) -> Clothoid {
        let start = self.at(from_m);
        Clothoid {
            start_m: start.at_m.to_array(),
            heading_rad: start.heading_rad,
            curvature_per_m: start.curvature_per_m,
            length_m: (to_m - from_m).max(0.0),
            ..*self
        }
    }
}

impl Fitted {
    /// Derivatives of the lateral position at `s_m` with respect to the four parameters.
    fn sideways(&self, s_m: f64) -> [f64; 4] {
        sideways(&self.curve, s_m)
    }

    /// Standard deviation of the lateral position at `s_m` along the curve, m.
    pub fn lateral_std_m(&self, s_m: f64) -> f64 {
        let j = self.sideways(s_m);
        bilinear(&j, &self.covariance, &j).max(0.0).sqrt()
    }
}

/// Derivatives of the lateral position with respect to lateral position and heading at the start, curvature
/// and its rate.
fn sideways(curve: &Clothoid, s: f64) -> [f64; 4] {
    let way = curve.way(s);
    let t = DVec2::from_angle(curve.heading_at(s));
    [
        t.dot(DVec2::from_angle(curve.heading_rad)),
        t.dot(way.to_m),
        t.dot(way.to_m * s - way.first),
        t.dot(way.to_m * (0.5 * s * s) - way.second),
    ]
}

/// Fits a curve by least squares of the lateral distances of points in order along the curve, with their
/// standard deviations (m). None for fewer points than the shape has parameters, points in one place, or
/// non-finite values.
pub fn fit(points: &[DVec2], std_m: &[f64], shape: Shape) -> Option<Fitted> {
    let n = shape.parameters();
    let sound = |s: &f64| s.is_finite() && *s > 0.0;
    if points.len() < n || points.len() != std_m.len() || !std_m.iter().all(sound) {
        return None;
    }
    if points.iter().any(|p| !p.is_finite()) {
        return None;
    }
    let chord = *points.last()? - points[0];
    let way: f64 = points.windows(2).map(|w| w[0].distance(w[1])).sum();
    if way <= 0.0 {
        return None;
    }
    let mut curve = begin(points, chord, way, shape)?;
    let mut normal = DMat4::IDENTITY;
    let mut at: Vec<f64> = points.iter().map(|p| curve.foot(*p).s_m).collect();
    for _ in 0..ROUNDS {
        let (mut a, mut b) = ([[0.0; 4]; 4], [0.0; 4]);
        for ((p, std), s) in points.iter().zip(std_m).zip(&mut at) {
            let foot = curve.foot_near(*p, *s);
            *s = foot.s_m;
            let j = sideways(&curve, foot.s_m);
            let weight = 1.0 / (std * std);
            for r in 0..n {
                b[r] += weight * j[r] * foot.left_m;
                for c in 0..n {
                    a[r][c] += weight * j[r] * j[c];
                }
            }
        }
        // Parameters that the shape does not have stay unchanged.
        (n..4).for_each(|k| a[k][k] = 1.0);
        // Scaled, since a heading over a long curve weighs more than a position.
        let scale = [0, 1, 2, 3].map(|k| if a[k][k] > 0.0 { a[k][k].sqrt() } else { 1.0 });
        let scaled = DMat4::from_cols_array_2d(
            &[0, 1, 2, 3].map(|c| [0, 1, 2, 3].map(|r| a[r][c] / (scale[r] * scale[c]))),
        );
        let determinant = scaled.determinant().abs();
        if determinant.is_nan() || determinant <= 1e-14 {
            return None;
        }
        let inverse = scaled.inverse();
        let step = inverse * DVec4::from_array([0, 1, 2, 3].map(|k| b[k] / scale[k]));
        let step = [0, 1, 2, 3].map(|k| step[k] / scale[k]);
        normal = DMat4::from_cols_array_2d(
            &[0, 1, 2, 3].map(|c| [0, 1, 2, 3].map(|r| inverse.col(c)[r] / (scale[r] * scale[c]))),
        );
        let left = DVec2::from_angle(curve.heading_rad).perp();
        curve.start_m = (DVec2::from_array(curve.start_m) + left * step[0]).to_array();
        curve.heading_rad += step[1];
        curve.curvature_per_m += step[2];
        curve.curvature_rate_per_m2 += step[3];
        if ![curve.heading_rad, curve.curvature_per_m, curve.curvature_rate_per_m2, step[0]]
            .iter()
            .all(|x| x.is_finite())
            || (curve.curvature_per_m.abs() + curve.curvature_rate_per_m2.abs() * way) * way > 20.0
        {
            return None;
        }
        if step[0].abs() < 1e-8 && step[1].abs() * way < 1e-8 && step[2].abs() * way * way < 1e-8 {
            break;
        }
    }
    // The curve runs from the first foot to the last.
    let feet: Vec<Foot> = points.iter().map(|p| curve.foot(*p)).collect();
    let squares: f64 = feet.iter().zip(std_m).map(|(f, s)| (f.left_m / s).powi(2)).sum();
    let (first, last) =
        feet.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), f| (lo.min(f.s_m), hi.max(f.s_m)));
    curve.length_m = last.max(0.0);
    let mut covariance = [[0.0; 4]; 4];
    for (r, row) in covariance.iter_mut().enumerate().take(n) {
        for (c, x) in row.iter_mut().enumerate().take(n) {
            *x = normal.col(c)[r];
        }
    }
    let mut out =
        Fitted { curve, shape, covariance, residual: (squares / (points.len() - n).max(1) as f64).sqrt() };
    if first > 0.0 && first < last {
        out = moved(&out, first);
    }
    Some(out)
}

/// The curve from a place on it onwards, with its covariance propagated.
fn moved(f: &Fitted, s: f64) -> Fitted {
    let j = sideways(&f.curve, s);
    // Heading, curvature and rate by the four parameters: the heading gains s per curvature, s²/2 per rate.
    let rows = [j, [0.0, 1.0, s, 0.5 * s * s], [0.0, 0.0, 1.0, s], [0.0, 0.0, 0.0, 1.0]];
    let covariance = rows.map(|a| rows.map(|b| bilinear(&a, &f.covariance, &b)));
    Fitted { curve: f.curve.part(s, f.curve.length_m), covariance, ..*f }
}

/// A start curve of the fit: through the first point, with the curvature of the whole turn.
fn begin(points: &[DVec2], chord: DVec2, way: f64, shape: Shape) -> Option<Clothoid> {
    let mut heading =
        if chord.length() > 1e-6 * way { chord.to_angle() } else { (points[1] - points[0]).to_angle() };
    let mut curvature = 0.0;
    if shape != Shape::Line {
        // The circle through the first, the middle and the last point, or the turn of the chords where those
        // coincide.
        let (a, b, c) = (points[0], points[points.len() / 2], *points.last()?);
        let sides = a.distance(b) * b.distance(c) * c.distance(a);
        if sides > 1e-9 * way.powi(3) {
            curvature = 2.0 * (b - a).perp_dot(c - b) / sides;
        }
        // Half the turn from a to b lies before the chord's direction.
        let ab = b - a;
        heading = ab.to_angle() - (0.5 * curvature * ab.length()).clamp(-1.0, 1.0).asin();
    }
    Some(Clothoid {
        start_m: points[0].to_array(),
        heading_rad: heading,
        curvature_per_m: curvature,
        curvature_rate_per_m2: 0.0,
        length_m: 1.2 * way,
    })
}

/// Fits the simplest of line, arc and clothoid that the points support: a further parameter has to lower the
/// sum of squared residuals (in standard deviations) by more than `gain`.
pub fn fit_simplest(points: &[DVec2], std_m: &[f64], gain: f64) -> Option<Fitted> {
    let squares = |f: &Fitted| f.residual * f.residual * (points.len() - f.shape.parameters()).max(1) as f64;
    let mut best: Option<Fitted> = None;
    for shape in [Shape::Line, Shape::Arc, Shape::Clothoid] {
        let Some(new) = fit(points, std_m, shape) else { continue };
        let more = best.as_ref().map_or(0, |b| shape.parameters() - b.shape.parameters());
        if best.as_ref().is_none_or(|b| squares(b) - squares(&new) > gain * more as f64) {
            best = Some(new);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(k: u64) -> f64 {
        // Sum of twelve uniform numbers: unit variance.
        let mut x = k.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x1234_5678_9abc_def1;
        (0..12)
            .map(|_| {
                x ^= x << 13;
                x ^= x >> 7;
                x ^= x << 17;
                (x >> 11) as f64 / (1u64 << 53) as f64
            })
            .sum::<f64>()
            - 6.0
    }

    const CURVE: Clothoid = Clothoid {
        start_m: [3.0, -2.0],
        heading_rad: 0.2,
        curvature_per_m: 0.004,
        curvature_rate_per_m2: 0.0005,
        length_m: 60.0,
    };

    #[test]
    fn an_arc_is_a_circle() {
        let c = Clothoid {
            start_m: [10.0, 0.0],
            heading_rad: std::f64::consts::FRAC_PI_2,
            curvature_per_m: 0.1,
            curvature_rate_per_m2: 0.0,
            length_m: 62.0,
        };
        for s in [0.0, 5.0, 31.4, 60.0] {
            let p = c.at(s);
            assert!((p.at_m.length() - 10.0).abs() < 1e-9, "{p:?}");
            assert!(p.at_m.distance(DVec2::from_angle(0.1 * s) * 10.0) < 1e-9);
        }
    }

    /// The derivatives against differences of places.
    #[test]
    fn derivatives_are_those_of_the_curve() {
        let h = 1e-6;
        for s in [4.0, 25.0, 60.0] {
            let j = sideways(&CURVE, s);
            let left = DVec2::from_angle(CURVE.at(s).heading_rad).perp();
            let n0 = DVec2::from_angle(CURVE.heading_rad).perp() * h;
            let with = [
                Clothoid { start_m: (DVec2::from_array(CURVE.start_m) + n0).to_array(), ..CURVE },
                Clothoid { heading_rad: CURVE.heading_rad + h, ..CURVE },
                Clothoid { curvature_per_m: CURVE.curvature_per_m + h, ..CURVE },
                Clothoid { curvature_rate_per_m2: CURVE.curvature_rate_per_m2 + h, ..CURVE },
            ];
            for (k, c) in with.iter().enumerate() {
                let by_step = (c.at(s).at_m - CURVE.at(s).at_m).dot(left) / h;
                assert!((by_step - j[k]).abs() < 1e-3 * (1.0 + j[k].abs()), "{s} {k}: {by_step} {}", j[k]);
            }
        }
    }

    #[test]
    fn feet_are_where_points_were_set_out() {
        for i in 0..40 {
            let (s, left) = (1.5 * f64::from(i), -3.0 + 0.17 * f64::from(i));
            let at = CURVE.at(s);
            let foot = CURVE.foot(at.at_m + DVec2::from_angle(at.heading_rad).perp() * left);
            assert!((foot.s_m - s).abs() < 1e-6 && (foot.left_m - left).abs() < 1e-7, "{s} {left} {foot:?}");
        }
    }

    #[test]
    fn a_fit_finds_the_curve_that_the_points_lie_on() {
        let points: Vec<DVec2> = CURVE.sample(2.0);
        let f = fit(&points, &vec![0.1; points.len()], Shape::Clothoid).unwrap();
        let worst = points.iter().map(|p| f.curve.foot(*p).left_m.abs()).fold(0.0, f64::max);
        assert!(worst < 1e-6 && (f.curve.curvature_rate_per_m2 - 0.0005).abs() < 1e-7, "{worst} {f:?}");
        assert!((f.curve.length_m - 60.0).abs() < 0.1);
        // Half a circle, as in the test field.
        let half = Clothoid {
            start_m: [0.0, 0.0],
            heading_rad: 0.0,
            curvature_per_m: 0.1,
            curvature_rate_per_m2: 0.0,
            length_m: 31.4,
        };
        let points: Vec<DVec2> = half.sample(1.5);
        let f = fit(&points, &vec![0.05; points.len()], Shape::Arc).unwrap();
        assert!((f.curve.curvature_per_m - 0.1).abs() < 1e-7, "{f:?}");
    }

    /// Over many draws the errors of the lateral place are as large as the covariance says, and residuals are 1.
    #[test]
    fn the_covariance_is_that_of_the_errors() {
        let clean = CURVE.sample(2.0);
        let std = 0.1;
        let (runs, mut ratio, mut residual) = (300u64, 0.0, 0.0);
        for run in 0..runs {
            let points: Vec<DVec2> = clean
                .iter()
                .enumerate()
                .map(|(i, p)| {
                    *p + DVec2::new(noise(run * 1000 + i as u64), noise(run * 1000 + 500 + i as u64)) * std
                })
                .collect();
            let f = fit(&points, &vec![std; points.len()], Shape::Clothoid).unwrap();
            let truth = CURVE.at(40.0).at_m;
            let foot = f.curve.foot(truth);
            ratio += (foot.left_m / f.lateral_std_m(foot.s_m)).powi(2);
            residual += f.residual * f.residual;
        }
        // Chi-square of 300: standard deviation 0.082.
        assert!((ratio / runs as f64 - 1.0).abs() < 0.3, "{}", ratio / runs as f64);
        assert!((residual / runs as f64 - 1.0).abs() < 0.1, "{}", residual / runs as f64);
    }

    #[test]
    fn the_simplest_curve_is_taken() {
        let line = Clothoid { curvature_per_m: 0.0, curvature_rate_per_m2: 0.0, ..CURVE };
        let arc = Clothoid { curvature_rate_per_m2: 0.0, ..CURVE };
        for (truth, shape) in [(line, Shape::Line), (arc, Shape::Arc), (CURVE, Shape::Clothoid)] {
            let points: Vec<DVec2> = truth
                .sample(2.0)
                .iter()
                .enumerate()
                .map(|(i, p)| *p + DVec2::new(0.0, noise(i as u64)) * 0.02)
                .collect();
            let f = fit_simplest(&points, &vec![0.02; points.len()], 9.0).unwrap();
            assert_eq!(f.shape, shape);
        }
    }

    #[test]
    fn a_longer_curve_is_the_same_curve() {
        let long = CURVE.extended(12.0, 7.0);
        assert!((long.length_m - 79.0).abs() < 1e-12);
        for s in [0.0, 20.0, 60.0] {
            let (a, b) = (CURVE.at(s), long.at(s + 12.0));
            assert!(
                a.at_m.distance(b.at_m) < 1e-9 && (a.heading_rad - b.heading_rad).abs() < 1e-12,
                "{a:?} {b:?}"
            );
        }
    }

    #[test]
    fn nothing_comes_of_nothing() {
        let p = DVec2::ZERO;
        assert!(fit(&[], &[], Shape::Line).is_none());
        assert!(fit(&[p], &[0.1], Shape::Line).is_none());
        assert!(fit(&[p, p, p], &[0.1; 3], Shape::Line).is_none());
        assert!(fit(&[p, DVec2::X, DVec2::NAN], &[0.1; 3], Shape::Line).is_none());
        assert!(fit(&[p, DVec2::X, DVec2::Y], &[0.1, 0.0, 0.1], Shape::Arc).is_none());
        assert!(fit(&[p, DVec2::X], &[0.1; 2], Shape::Arc).is_none());
    }
}
