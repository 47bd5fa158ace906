//! Greatest-of and smallest-of CFAR: the factor and the host side of the kernel (CONVENTIONS eq. 85;
//! Hansen and Sawyers, IEEE Trans. AES-16 (1980) 115, and Trunk, AES-14 (1978) 750, for one look).

use super::cfar_ca;
use super::cfar_factor::{Factor, check_pfa, crossing, ln_lower, ln_upper, maximum, solve_factor};
use super::cfar_window::DeviceColumn;
use crate::base::error::Result;
use crate::gpu::{Access, Kernel, Tolerance};
use crate::gpu_struct;
use crate::scene::radar::CfarKind;
use statrs::function::gamma::ln_gamma;

gpu_struct! {
    /// Uniform of `shaders/dsp/cfar_go_so.wgsl`.
    pub struct CfarGoSoParams {
        pub doppler_bins: u32,
        pub range_bins: u32,
        pub guard_doppler: u32,
        pub half_doppler: u32,
        pub guard_range: u32,
        pub half_range: u32,
        pub kind: u32,
        pub along_doppler: u32,
    }
}

/// Run by `cfar::record`.
pub static KERNEL: Kernel = Kernel {
    stem: "dsp/cfar_go_so",
    sources: &[include_str!("../../shaders/dsp/cfar_go_so.wgsl")],
    workgroup: [16, 16, 1],
    params: Some(CfarGoSoParams::LAYOUT),
    storage: &[Access::Read, Access::Read, Access::ReadWrite],
    structs: &[DeviceColumn::LAYOUT],
    tolerance: Tolerance { relative_l2: 1e-6, reason: "the sums of cfar_ca over half as many cells" },
};

/// Nodes of a panel of the quadrature.
const NODES: usize = 16;

/// The factor on the greater (GO) or smaller (SO) of the means of two halves of `parts` training cells that
/// gives `pfa` when every cell is the mean of `channels` independent exponentials. With one half empty it
/// is that of the other alone.
///
/// pfa = integral of Q(K, alpha x) f(x) dx, where f is f_1 F_2 + f_2 F_1 (GO) or f_1 (1 - F_2) + f_2 (1 - F_1) (SO)
/// with f_i and F_i the density and distribution of a Gamma(K n_i) over n_i. It is taken over ln x by Gauss-Legendre
/// panels of two standard deviations of the narrower one that is there.
///
/// # Errors
/// Returns an error if `pfa` is not between 0 and 1.
pub fn factor(kind: CfarKind, channels: usize, parts: [usize; 2], pfa: f64) -> Result<Factor> {
    check_pfa(pfa)?;
    if parts.contains(&0) {
        let alone = cfar_ca::factor(channels, parts[0] + parts[1], pfa)?;
        return Ok(Factor { factor: alone, expectation: 1.0 });
    }
    let k = channels as f64;
    let shapes = parts.map(|n| channels * n);
    let n = parts.map(|n| n as f64);
    let ln_norm = shapes.map(|a| ln_gamma(a as f64));
    let greatest = kind == CfarKind::Go;
    // Logarithm of the density of t = ln x.
    let h = |t: f64| {
        let x = t.exp();
        let part = |i: usize| {
            let other = if greatest { ln_lower } else { ln_upper };
            let y = n[i] * x;
            shapes[i] as f64 * y.ln() - y - ln_norm[i] + other(shapes[1 - i], n[1 - i] * x)
        };
        let (a, b) = (part(0), part(1));
        let (low, high) = (a.min(b), a.max(b));
        high + (low - high).exp().ln_1p()
    };
    let middle = k.ln();
    let (lowest, highest) = (-300.0, (k + 50.0 * k.sqrt() + 1000.0).ln());
    let mode = maximum(&h, lowest, highest);
    // Q(K, alpha x) <= 1, and the integral is pfa: what lies this far under the mode is nothing.
    let level = h(mode) + pfa.ln() - 45.0;
    let (from, to) = (crossing(&h, lowest, mode, level), crossing(&h, highest, mode, level));
    // Standard deviations of the two in t; the narrower one lies within 12 of its own around the mean.
    let widths = shapes.map(|a| 1.0 / (a as f64).sqrt());
    let (narrow, wide) = (widths[0].min(widths[1]), widths[0].max(widths[1]));
    let zone = [middle - 12.0 * narrow, middle + 12.0 * narrow].map(|t| t.clamp(from, to));
    let nodes = gauss_legendre();
    let mut grid: Vec<(f64, f64)> = Vec::new();
    for (a, b, panel) in [(from, zone[0], wide), (zone[0], zone[1], narrow), (zone[1], to, wide)] {
        let panels = (0.5 * (b - a) / panel).ceil() as usize;
        let half = 0.5 * (b - a) / panels as f64;
        for i in 0..panels {
            for (node, weight) in &nodes {
                let t = a + half * (2.0 * i as f64 + 1.0 + node);
                grid.push((t.exp(), h(t) + (weight * half).ln()));
            }
        }
    }
    let ln_pfa = |alpha: f64| {
        let logs = || grid.iter().map(|(x, h)| h + ln_upper(channels, alpha * x));
        let top = logs().fold(f64::NEG_INFINITY, f64::max);
        top + logs().map(|l| (l - top).exp()).sum::<f64>().ln()
    };
    let factor = solve_factor(ln_pfa, pfa.ln())?;
    let expectation = grid.iter().map(|(x, h)| x * h.exp()).sum::<f64>() / k;
    Ok(Factor { factor, expectation })
}

/// Nodes and weights on -1..1: zeros of the Legendre polynomial by Newton's method.
fn gauss_legendre() -> [(f64, f64); NODES] {
    let n = NODES as f64;
    std::array::from_fn(|i| {
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..8 {
            let (mut p, mut before) = (1.0, 0.0);
            for j in 0..NODES {
                let j = j as f64;
                (p, before) = (((2.0 * j + 1.0) * x * p - j * before) / (j + 1.0), p);
            }
            slope = n * (x * p - before) / (x * x - 1.0);
            x -= p / slope;
        }
        (x, 2.0 / ((1.0 - x * x) * slope * slope))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quadrature_is_exact_for_polynomials() {
        for power in 0..2 * NODES {
            let got: f64 = gauss_legendre().iter().map(|(x, w)| w * x.powi(power as i32)).sum();
            let want = if power % 2 == 0 { 2.0 / (power as f64 + 1.0) } else { 0.0 };
            assert!((got - want).abs() < 1e-14, "{power}: {got} {want}");
        }
    }

    /// One look and equal halves in closed form, with t = alpha/n:
    /// pfa(SO) = 2 sum_{i<n} C(n-1+i, i) (2 + t)^-(n+i), pfa(GO) = 2 (1 + t)^-n - pfa(SO).
    #[test]
    fn single_look_closed_forms() {
        for n in [1usize, 4, 16, 50] {
            for pfa in [0.1, 1e-3, 1e-6] {
                for kind in [CfarKind::Go, CfarKind::So] {
                    let got = factor(kind, 1, [n, n], pfa).unwrap();
                    let t = got.factor / n as f64;
                    let (mut binomial, mut smallest) = (1.0, 0.0);
                    for i in 0..n {
                        smallest += 2.0 * binomial * (2.0 + t).powi(-((n + i) as i32));
                        binomial *= (n + i) as f64 / (i + 1) as f64;
                    }
                    let back = match kind {
                        CfarKind::Go => 2.0 * (1.0 + t).powi(-(n as i32)) - smallest,
                        _ => smallest,
                    };
                    assert!((back / pfa - 1.0).abs() < 1e-8, "{kind:?} n {n} pfa {pfa}: {back}");
                }
            }
        }
    }

    /// The greater and the smaller add up to both halves, whose means are 1; and pfa of the two factors
    /// adds up in the same way: P(X > a max) + P(X > a min) = P(X > a M_1) + P(X > a M_2).
    #[test]
    fn the_two_kinds_complete_each_other() {
        for k in [1, 3, 12, 192] {
            for parts in [[1, 1], [5, 5], [104, 104], [3, 40], [1, 100]] {
                for pfa in [0.2, 1e-3, 1e-8] {
                    let go = factor(CfarKind::Go, k, parts, pfa).unwrap();
                    let so = factor(CfarKind::So, k, parts, pfa).unwrap();
                    let sum = go.expectation + so.expectation;
                    assert!((sum - 2.0).abs() < 1e-9, "K {k} {parts:?} pfa {pfa}: {sum}");
                    assert!(go.expectation > 1.0 && so.factor > go.factor);
                    assert_eq!(go.factor, factor(CfarKind::Go, k, [parts[1], parts[0]], pfa).unwrap().factor);
                    // The CA factors of the halves lie between.
                    for n in parts {
                        let ca = cfar_ca::factor(k, n, pfa).unwrap();
                        assert!(so.factor > ca || parts[0] != parts[1], "K {k} {parts:?} pfa {pfa}");
                    }
                }
            }
        }
    }

    #[test]
    fn one_half_alone_is_cell_averaging() {
        let got = factor(CfarKind::Go, 12, [0, 50], 1e-3).unwrap();
        assert_eq!(got.factor, cfar_ca::factor(12, 50, 1e-3).unwrap());
        assert_eq!(got.expectation, 1.0);
    }

    /// Against counting integrals: halves of one cell each and K looks, by a plain Riemann sum in x.
    #[test]
    fn against_a_plain_sum() {
        let (k, pfa) = (3usize, 0.05);
        let q = |x: f64| (-x).exp() * (1.0 + x + 0.5 * x * x);
        for kind in [CfarKind::Go, CfarKind::So] {
            let got = factor(kind, k, [1, 2], pfa).unwrap();
            let (step, mut sum) = (1e-3, 0.0);
            for i in 0..60_000 {
                let x = (i as f64 + 0.5) * step;
                // Gamma(3) and the mean of two of them: Gamma(6) at 2x.
                let f1 = 0.5 * x * x * (-x).exp();
                let y = 2.0 * x;
                let f2 = 2.0 * y.powi(5) / 120.0 * (-y).exp();
                let q2: f64 =
                    (-y).exp() * (0..6).map(|j| y.powi(j) / (1..=j).product::<i32>() as f64).sum::<f64>();
                let density = match kind {
                    CfarKind::Go => f1 * (1.0 - q2) + f2 * (1.0 - q(x)),
                    _ => f1 * q2 + f2 * q(x),
                };
                sum += step * density * q(got.factor * x);
            }
            assert!((sum / pfa - 1.0).abs() < 1e-5, "{kind:?}: {sum}");
        }
    }
}
