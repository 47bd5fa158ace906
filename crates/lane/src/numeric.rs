//! Small numerical tools that several methods need.

use glam::DVec2;
use std::f64::consts::{FRAC_2_SQRT_PI, PI, TAU};

/// Wraps an angle to (-π, π].
pub(crate) fn wrapped(angle_rad: f64) -> f64 {
    let a = angle_rad.rem_euclid(TAU);
    if a > PI { a - TAU } else { a }
}

/// Position of the vertex of the parabola through three even samples from the middle one, in steps, -0.5 to
/// 0.5; 0 where it opens upwards.
pub(crate) fn vertex(before: f64, top: f64, after: f64) -> f64 {
    let bend = before - 2.0 * top + after;
    if bend < 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 }
}

/// Median: the middle value, or the upper one of the two middle values. None for an empty list.
pub(crate) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// Outer product u uᵀ.
pub(crate) fn outer(u: DVec2) -> glam::DMat2 {
    glam::DMat2::from_cols(u * u.x, u * u.y)
}

/// The error function, to rounding (that of statrs has errors of 1e-10): 2/sqrt(pi) e^(-x²) sum of 2^n x^(2n+1) / (2n+1)!! (Abramowitz and
/// Stegun 7.1.6), whose terms are all of one sign.
pub(crate) fn erf(x: f64) -> f64 {
    if x.abs() > 6.0 {
        return x.signum();
    }
    let (mut term, mut sum) = (x, x);
    let mut n = 1.0;
    while n < 300.0 && term.abs() > 1e-17 * sum.abs() {
        term *= 2.0 * x * x / (2.0 * n + 1.0);
        sum += term;
        n += 1.0;
    }
    FRAC_2_SQRT_PI * (-x * x).exp() * sum
}

/// Points along a polyline, `step_m` apart, starting at its first point.
pub(crate) fn spread(line: &[DVec2], step_m: f64) -> Vec<DVec2> {
    let mut out = Vec::new();
    let mut left = 0.0;
    for w in line.windows(2) {
        let length = w[0].distance(w[1]);
        while left < length {
            out.push(w[0].lerp(w[1], left / length));
            left += step_m;
        }
        left -= length;
    }
    out
}

/// Mean of points, and the direction of their greatest spread, rad.
pub(crate) fn principal_axis(points: &[DVec2]) -> (DVec2, f64) {
    let mean = points.iter().sum::<DVec2>() / points.len() as f64;
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for p in points {
        let d = *p - mean;
        (xx, xy, yy) = (xx + d.x * d.x, xy + d.x * d.y, yy + d.y * d.y);
    }
    (mean, 0.5 * (2.0 * xy).atan2(xx - yy))
}

/// Bilinear form aᵀ m b.
pub(crate) fn bilinear<const N: usize>(a: &[f64; N], m: &[[f64; N]; N], b: &[f64; N]) -> f64 {
    (0..N).map(|k| (0..N).map(|l| a[k] * m[k][l] * b[l]).sum::<f64>()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_function_is_exact() {
        for (x, y) in [
            (0.0, 0.0),
            (1e-9, 1.128_379_167_095_512_6e-9),
            (0.5, 0.520_499_877_813_046_5),
            (1.0, 0.842_700_792_949_714_9),
            (3.0, 0.999_977_909_503_001_4),
            (5.5, 0.999_999_999_999_992_6),
            (40.0, 1.0),
        ] {
            assert!((erf(x) - y).abs() <= 4e-16 * y.max(1e-9) / y.max(1e-9), "{x} {}", erf(x));
            assert_eq!(erf(-x), -erf(x));
        }
    }
}
