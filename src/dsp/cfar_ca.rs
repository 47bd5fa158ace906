//! Cell-averaging CFAR: the factor and the host side of the kernel (CONVENTIONS eq. 17).

use super::cfar_factor::{check_pfa, ln_series, solve_factor};
use super::cfar_window::{CfarWindowParams, DeviceColumn};
use crate::base::error::Result;
use crate::gpu::{Access, Kernel, Tolerance};

/// Run by `cfar::record`.
pub static KERNEL: Kernel = Kernel {
    stem: "dsp/cfar_ca",
    sources: &[include_str!("../../shaders/dsp/cfar_ca.wgsl")],
    workgroup: [16, 16, 1],
    params: Some(CfarWindowParams::LAYOUT),
    storage: &[Access::Read, Access::Read, Access::ReadWrite],
    structs: &[DeviceColumn::LAYOUT],
    tolerance: Tolerance {
        relative_l2: 1e-6,
        reason: "a sum of positive terms by rows: at most (rows + columns) eps/2 of it, 16 eps for W4's 21 x 11 window, \
                 and far less on average. A cell whose power is within that of its threshold may be judged otherwise",
    },
};

/// The factor on the mean of `training` cells that gives `pfa` when every cell is the mean of
/// `channels` independent exponentials: F^-1(1 - pfa; 2K, 2KN).
///
/// With w = N/(N + alpha), pfa = I_w(KN, K) = w^(KN) sum_{j<K} (KN)_j / j! (1 - w)^j, a sum of positive terms because
/// K is whole; solved in logarithms, so it holds for any pfa that f64 has.
///
/// # Errors
/// Returns an error if `pfa` is not between 0 and 1.
///
/// # Example
/// For a single channel the factor is N(pfa^(−1/N) − 1). It tends to −ln pfa when the noise is known exactly, and the
/// difference is the loss of CFAR: 1.0 dB with 32 training cells and a false-alarm probability of 10⁻⁶.
///
/// ```
/// use catseye::dsp::cfar_ca::factor;
///
/// let (cells, pfa) = (32, 1e-6_f64);
/// let alpha = factor(1, cells, pfa)?;
/// assert!((alpha / (32.0 * (pfa.powf(-1.0 / 32.0) - 1.0)) - 1.0).abs() < 1e-9);
/// let loss_db = 10.0 * (alpha / -pfa.ln()).log10();
/// assert!((loss_db - 1.0).abs() < 0.05, "{loss_db}");
/// # Ok::<(), catseye::Error>(())
/// ```
pub fn factor(channels: usize, training: usize, pfa: f64) -> Result<f64> {
    check_pfa(pfa)?;
    let (k, n) = (channels as f64, training as f64);
    let ln_pfa = |alpha: f64| {
        let z = alpha / (n + alpha);
        -k * n * (alpha / n).ln_1p()
            + ln_series((1..channels).map(|j| (k * n + j as f64 - 1.0) / j as f64 * z))
    };
    solve_factor(ln_pfa, pfa.ln())
}

#[cfg(test)]
mod tests {
    use super::*;
    use statrs::function::beta::beta_reg;

    #[test]
    fn known_factors() {
        // Single look: N (pfa^(-1/N) - 1).
        for (n, pfa) in [(100, 0.1), (1, 1e-2), (16, 1e-6), (2000, 1e-12), (8, 0.9)] {
            let want = n as f64 * (-f64::ln(pfa) / n as f64).exp_m1();
            let got = factor(1, n, pfa).unwrap();
            assert!((got / want - 1.0).abs() < 1e-12, "{n} {pfa}: {got} {want}");
        }
        assert!((factor(1, 100, 0.1).unwrap() - 2.3293).abs() < 5e-5);
        assert!((factor(12, 216, 1e-3).unwrap() - 2.138).abs() < 5e-4);
    }

    #[test]
    fn agrees_with_the_beta_distribution() {
        for k in [1, 2, 12, 16, 48, 192] {
            for n in [1, 2, 16, 216, 2000] {
                for pfa in [0.5, 1e-1, 1e-3, 1e-6, 1e-10] {
                    let alpha = factor(k, n, pfa).unwrap();
                    let (kf, nf) = (k as f64, n as f64);
                    let back = beta_reg(kf * nf, kf, nf / (nf + alpha));
                    assert!((back / pfa - 1.0).abs() < 1e-6, "K {k} N {n} pfa {pfa}: {back}");
                }
            }
        }
    }
}
