//! Order-statistic CFAR: the factor and the host side of the kernel (CONVENTIONS eq. 17; Rohling,
//! IEEE Trans. AES-19 (1983) 608, for one look).

use super::cfar::{DeviceColumn, Params, check_pfa, ln_series, solve_factor};
use crate::error::Result;
use crate::gpu::{Access, Kernel, Tolerance};
use statrs::function::gamma::ln_gamma;

/// Run by [`super::cfar::record`].
pub static KERNEL: Kernel = Kernel {
    stem: "dsp/cfar_os",
    sources: &[include_str!("../../shaders/dsp/cfar_os.wgsl")],
    workgroup: [16, 16, 1],
    params: Some(Params::LAYOUT),
    storage: &[Access::Read, Access::Read, Access::ReadWrite, Access::ReadWrite],
    structs: &[DeviceColumn::LAYOUT],
    tolerance: Tolerance {
        relative_l2: 1e-7,
        reason: "one rounding of the product with the scale; the mask and the statistic are exact",
    },
};

/// Times at most that a thread goes through its training cells: once for their bounds, and once for each
/// bit of a positive f32, by which the bounds close in.
pub(crate) const PASSES: usize = 32;

/// The factor on the order statistic, and what that statistic is on average on noise of unit mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OsFactor {
    pub factor: f64,
    pub expectation: f64,
}

/// ln Q(k, x), the logarithm of the upper regularised incomplete gamma function for whole k:
/// e^-x sum_{j<k} x^j / j!.
fn ln_upper(k: usize, x: f64) -> f64 {
    let top = (k - 1) as f64;
    if x < k as f64 {
        -x + ln_series((1..k).map(|j| x / j as f64))
    } else {
        // From the largest term down.
        -x + top * x.ln() - ln_gamma(top + 1.0) + ln_series((1..k).rev().map(|j| j as f64 / x))
    }
}

/// ln P(k, x), the logarithm of the lower regularised incomplete gamma function.
fn ln_lower(k: usize, x: f64) -> f64 {
    let kf = k as f64;
    if x < kf + 1.0 {
        -x + kf * x.ln() - ln_gamma(kf + 1.0) + ln_series((1..10_000).map(|j| x / (kf + j as f64)))
    } else {
        (-ln_upper(k, x).exp()).ln_1p()
    }
}

/// The factor on the `rank`-th smallest of `training` cells that gives `pfa` when every cell is
/// the mean of `channels` independent exponentials.
///
/// pfa = integral of Q(K, alpha x) f_(k)(x) dx with f_(k) the density of the order statistic of
/// Gamma(K) cells, taken by the trapezoidal rule over ln x: both logarithms are concave there, so
/// the integrand is a single smooth bump that decays exponentially, on which that rule converges
/// faster than any power. Errors: pfa outside 0..1.
pub fn factor(channels: usize, training: usize, rank: usize, pfa: f64) -> Result<OsFactor> {
    check_pfa(pfa)?;
    let (k, n, r) = (channels as f64, training as f64, rank as f64);
    let ln_count = ln_gamma(n + 1.0) - ln_gamma(r) - ln_gamma(n - r + 1.0) - ln_gamma(k);
    // Logarithm of the density of t = ln x.
    let h = |t: f64| {
        let x = t.exp();
        ln_count + (r - 1.0) * ln_lower(channels, x) + (n - r) * ln_upper(channels, x) + k * t - x
    };
    let (lowest, highest) = (-300.0, (k + 50.0 * k.sqrt() + 1000.0).ln());
    let mode = maximum(&h, lowest, highest);
    // Q(K, alpha x) <= 1, and the integral is pfa: what lies this far under the mode is nothing.
    let level = h(mode) + pfa.ln() - 45.0;
    let from = crossing(&h, lowest, mode, level);
    let to = crossing(&h, highest, mode, level);
    const POINTS: usize = 600;
    let step = (to - from) / POINTS as f64;
    let grid: Vec<(f64, f64)> = (0..=POINTS)
        .map(|i| {
            let t = from + step * i as f64;
            (t.exp(), h(t))
        })
        .collect();
    let ln_pfa = |alpha: f64| {
        let logs = || grid.iter().map(|(x, h)| h + ln_upper(channels, alpha * x));
        let top = logs().fold(f64::NEG_INFINITY, f64::max);
        top + (step * logs().map(|l| (l - top).exp()).sum::<f64>()).ln()
    };
    let factor = solve_factor(ln_pfa, pfa.ln())?;
    let expectation = step * grid.iter().map(|(x, h)| x * h.exp()).sum::<f64>() / k;
    Ok(OsFactor { factor, expectation })
}

/// Where a concave function is largest, by golden section.
fn maximum(h: &impl Fn(f64) -> f64, mut a: f64, mut b: f64) -> f64 {
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
fn crossing(h: &impl Fn(f64) -> f64, outside: f64, mode: f64, level: f64) -> f64 {
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

#[cfg(test)]
mod tests {
    use super::*;
    use statrs::function::gamma::{gamma_lr, gamma_ur};

    #[test]
    fn incomplete_gamma() {
        for k in [1, 2, 12, 48, 192] {
            for x in [1e-3, 0.3, 1.0, 5.0, 12.0, 50.0, 190.0, 193.5, 250.0, 400.0] {
                let (p, q) = (gamma_lr(k as f64, x), gamma_ur(k as f64, x));
                if p > 1e-280 {
                    assert!((ln_lower(k, x) - p.ln()).abs() < 1e-9 * (1.0 + p.ln().abs()), "P {k} {x}");
                }
                if q > 1e-280 {
                    assert!((ln_upper(k, x) - q.ln()).abs() < 1e-9 * (1.0 + q.ln().abs()), "Q {k} {x}");
                }
            }
        }
        // Beyond f64: Q(3, x) = e^-x (1 + x + x^2/2).
        assert!((ln_upper(3, 2000.0) - (-2000.0 + (1.0 + 2000.0 + 2e6f64).ln())).abs() < 1e-9);
    }

    /// One look in closed form: pfa = prod_{i<k} (N - i)/(N - i + alpha).
    #[test]
    fn single_look_closed_form() {
        for (n, rank) in [(20, 15), (1, 1), (7, 1), (7, 7), (216, 162), (2000, 1500), (2000, 1), (2000, 2000)]
        {
            for pfa in [0.5, 1e-1, 1e-3, 1e-6, 1e-12] {
                let os = factor(1, n, rank, pfa).unwrap();
                let back: f64 = (0..rank).map(|i| ((n - i) as f64 / ((n - i) as f64 + os.factor)).ln()).sum();
                assert!((back - f64::ln(pfa)).abs() < 1e-9, "N {n} k {rank} pfa {pfa}: {}", back.exp());
                let mean: f64 = (0..rank).map(|i| 1.0 / (n - i) as f64).sum();
                assert!((os.expectation / mean - 1.0).abs() < 1e-10, "N {n} k {rank}: {}", os.expectation);
            }
        }
    }

    #[test]
    fn known_factors() {
        assert!((factor(1, 20, 15, 1e-3).unwrap().factor - 6.8554).abs() < 5e-5);
        let os = factor(12, 216, 162, 1e-3).unwrap();
        assert!((os.factor - 1.82).abs() < 5e-3, "{}", os.factor);
        assert!((factor(1, 216, 162, 1e-3).unwrap().factor - 5.13).abs() < 5e-3);
    }

    /// N = 1: the quotient of two Gamma(K) is F(2K, 2K), which is CA with one cell.
    #[test]
    fn one_training_cell_is_cell_averaging() {
        for k in [1, 3, 12, 192] {
            for pfa in [0.3, 1e-3, 1e-9] {
                let (os, ca) =
                    (factor(k, 1, 1, pfa).unwrap(), super::super::cfar_ca::factor(k, 1, pfa).unwrap());
                assert!((os.factor / ca - 1.0).abs() < 1e-9);
                assert!((os.expectation - 1.0).abs() < 1e-10);
            }
        }
    }

    #[test]
    fn largest_sizes() {
        for (k, n, r) in [(192, 2000, 1500), (192, 2000, 1), (192, 2000, 2000), (192, 8, 6)] {
            let mut last = 0.0;
            for pfa in [1e-1, 1e-3, 1e-6, 1e-12] {
                let os = factor(k, n, r, pfa).unwrap();
                assert!(os.factor > last && os.factor < 10.0 && os.expectation > 0.5 && os.expectation < 1.5);
                last = os.factor;
            }
        }
    }
}
