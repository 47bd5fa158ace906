//! Order-statistic CFAR: the factor and the host side of the kernel (CONVENTIONS eq. 17; Rohling,
//! IEEE Trans. AES-19 (1983) 608, for one look).

use super::cfar_factor::{Factor, check_pfa, crossing, ln_lower, ln_upper, maximum, solve_factor};
use super::cfar_window::{CfarWindowParams, DeviceColumn};
use crate::base::error::Result;
use crate::gpu::{Access, Kernel, Tolerance};
use statrs::function::gamma::ln_gamma;

/// Run by `cfar::record`.
pub static KERNEL: Kernel = Kernel {
    stem: "dsp/cfar_os",
    sources: &[include_str!("../../shaders/dsp/cfar_os.wgsl")],
    workgroup: [16, 16, 1],
    params: Some(CfarWindowParams::LAYOUT),
    storage: &[Access::Read, Access::Read, Access::ReadWrite],
    structs: &[DeviceColumn::LAYOUT],
    tolerance: Tolerance { relative_l2: 0.0, reason: "compares and counts products of two numbers" },
};

/// The factor on the `rank`-th smallest of `training` cells that gives `pfa` when every cell is
/// the mean of `channels` independent exponentials.
///
/// pfa = integral of Q(K, alpha x) f_(k)(x) dx with f_(k) the density of the order statistic of Gamma(K) cells, taken
/// by the trapezoidal rule over ln x: both logarithms are concave there, so the integrand is a single smooth bump
/// that decays exponentially, on which that rule converges faster than any power.
///
/// # Errors
/// Returns an error if `pfa` is not between 0 and 1.
///
/// # Example
/// For a single channel Rohling's product gives the false-alarm probability of the k-th of N cells, Π (N − i)/(N − i +
/// α) over i = 0 … k − 1.
///
/// ```
/// use catseye::dsp::cfar_os::factor;
///
/// let (cells, rank, pfa) = (24, 18, 1e-5);
/// let found = factor(1, cells, rank, pfa)?;
/// let product: f64 = (0..rank).map(|i| (cells - i) as f64).map(|n| n / (n + found.factor)).product();
/// assert!((product / pfa - 1.0).abs() < 1e-6);
/// // The mean of the 18th smallest of 24 exponentials: 1/24 + 1/23 + … + 1/7.
/// let mean: f64 = (7..=24).map(|n| 1.0 / f64::from(n)).sum();
/// assert!((found.expectation / mean - 1.0).abs() < 1e-6);
/// # Ok::<(), catseye::Error>(())
/// ```
pub fn factor(channels: usize, training: usize, rank: usize, pfa: f64) -> Result<Factor> {
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
    const POINTS: usize = 240;
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
    Ok(Factor { factor, expectation })
}

#[cfg(test)]
mod tests {
    use super::*;

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
