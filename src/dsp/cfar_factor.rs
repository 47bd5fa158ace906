//! Factors of the CFAR detectors by solving for the probability of false alarm, in logarithms (CONVENTIONS eq. 17).

use crate::base::error::{BadInput, Error, Result};
use statrs::function::gamma::ln_gamma;

/// A factor on a statistic of the training cells, and what that statistic is on average on noise of unit
/// mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Factor {
    /// Factor on the statistic.
    pub factor: f64,
    /// Mean of the statistic on noise of unit mean.
    pub expectation: f64,
}

pub(crate) fn check_pfa(pfa: f64) -> Result<()> {
    if pfa > 0.0 && pfa < 1.0 {
        return Ok(());
    }
    Err(BadInput::new("is not a probability of false alarm")
        .key("cfar.pfa")
        .value(pfa)
        .allowed("0 < pfa < 1")
        .into())
}

/// A sum of positive terms, each the last times a ratio, that may pass the range of f64. The ratios never
/// grow. Returns the logarithm.
pub(crate) fn ln_series(ratios: impl Iterator<Item = f64>) -> f64 {
    const BIG: f64 = 1e280;
    let (mut term, mut sum, mut shift) = (1.0f64, 1.0f64, 0.0f64);
    for ratio in ratios {
        term *= ratio;
        sum += term;
        if sum > BIG {
            sum /= BIG;
            term /= BIG;
            shift += BIG.ln();
        }
        // What follows is less than a geometric series.
        if ratio < 1.0 && term < 1e-17 * (1.0 - ratio) * sum {
            break;
        }
    }
    shift + sum.ln()
}

/// ln Q(k, x), the logarithm of the upper regularised incomplete gamma function for whole k:
/// e^-x sum_{j<k} x^j / j!.
pub(crate) fn ln_upper(k: usize, x: f64) -> f64 {
    let top = (k - 1) as f64;
    if k > 32 && x < top {
        // The terms of the complement fall from the first on; it is about one half at most.
        (-ln_lower(k, x).exp()).ln_1p()
    } else if x < k as f64 {
        -x + ln_series((1..k).map(|j| x / j as f64))
    } else {
        // From the largest term down.
        -x + top * x.ln() - ln_gamma(top + 1.0) + ln_series((1..k).rev().map(|j| j as f64 / x))
    }
}

/// ln P(k, x), the logarithm of the lower regularised incomplete gamma function.
pub(crate) fn ln_lower(k: usize, x: f64) -> f64 {
    let kf = k as f64;
    if x < kf + 1.0 {
        -x + kf * x.ln() - ln_gamma(kf + 1.0) + ln_series((1..10_000).map(|j| x / (kf + j as f64)))
    } else {
        (-ln_upper(k, x).exp()).ln_1p()
    }
}

/// Where a concave function is largest, by golden section.
pub(crate) fn maximum(h: &impl Fn(f64) -> f64, mut a: f64, mut b: f64) -> f64 {
    let g = 0.5 * (5f64.sqrt() - 1.0);
    let (mut c, mut d) = (b - g * (b - a), a + g * (b - a));
    let (mut hc, mut hd) = (h(c), h(d));
    while b - a > 1e-6 {
        if hc > hd {
            b = d;
            (d, hd) = (c, hc);
            c = b - g * (b - a);
            hc = h(c);
        } else {
            a = c;
            (c, hc) = (d, hd);
            d = a + g * (b - a);
            hd = h(d);
        }
    }
    0.5 * (a + b)
}

/// Where a function that rises from `outside` to `mode` passes `level`; `outside` if it never does.
pub(crate) fn crossing(h: &impl Fn(f64) -> f64, outside: f64, mode: f64, level: f64) -> f64 {
    let (mut a, mut b) = (outside, mode);
    if h(a) > level {
        return a;
    }
    for _ in 0..60 {
        let c = 0.5 * (a + b);
        if h(c) > level { b = c } else { a = c }
    }
    a
}

/// The factor at which the falling function `ln_pfa` of the factor meets `ln_wanted`.
pub(crate) fn solve_factor(ln_pfa: impl Fn(f64) -> f64, ln_wanted: f64) -> Result<f64> {
    let f = |s: f64| ln_pfa(s.exp()) - ln_wanted;
    let (mut a, mut b) = (0.0f64, 0.0f64);
    let (mut fa, mut fb) = (f(a), f(a));
    // Grow the bracket from factor 1 until fa >= 0 >= fb.
    let mut step = 0.5;
    while fb > 0.0 {
        (a, fa) = (b, fb);
        b += step;
        fb = f(b);
        step *= 1.5;
        if b > 600.0 {
            return Err(Error::Failed("the CFAR factor has no solution below e^600".into()));
        }
    }
    step = 0.5;
    while fa < 0.0 {
        (b, fb) = (a, fa);
        a -= step;
        fa = f(a);
        step *= 1.5;
        if a < -600.0 {
            return Err(Error::Failed("the CFAR factor has no solution above e^-600".into()));
        }
    }
    // Regula falsi (Illinois), with a bisection whenever it does not halve the bracket.
    for _ in 0..200 {
        if fa == 0.0 {
            return Ok(a.exp());
        }
        if fb == 0.0 || (b - a) <= 4e-15 * (1.0 + a.abs().max(b.abs())) {
            return Ok(b.exp());
        }
        let width = b - a;
        for halve in [false, true] {
            if halve && (b - a) <= 0.5 * width {
                break;
            }
            let c = if halve { 0.5 * (a + b) } else { (a * fb - b * fa) / (fb - fa) };
            let c = if c > a && c < b { c } else { 0.5 * (a + b) };
            let fc = f(c);
            if fc > 0.0 {
                (a, fa) = (c, fc);
            } else {
                (b, fb) = (c, fc);
            }
        }
    }
    Ok((0.5 * (a + b)).exp())
}
