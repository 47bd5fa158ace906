//! How many sources a covariance holds (CONVENTIONS eq. 93). The criteria assume white noise of equal power in all
//! channels, and more snapshots than sources.

use statrs::function::gamma::gamma_ur;

/// Information criterion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Criterion {
    /// Minimum description length: consistent, finds the right number as looks grow.
    Mdl,
    /// Akaike: keeps a chance of one too many.
    Aic,
}

/// Number of sources by Wax & Kailath (IEEE Trans. ASSP-33, 387, 1985) from eigenvalues, largest
/// first, of a mean over `looks` independent snapshots; with forward-backward averaging by the count
/// of free parameters of Xu, Pierre & Kaveh (IEEE Trans. SP-42, 1994). At most `eigenvalues - 1`.
///
/// Where looks are fewer than eigenvalues, the smallest are zero by construction and say nothing:
/// they are left out, and the number found is then below `looks`.
///
/// # Example
/// Eigenvalues of eight channels and 100 snapshots: two stand out of the noise of power 1.
///
/// ```
/// use catseye::dsp::doa_order::{Criterion, source_number};
///
/// let eigenvalues = [40.0, 6.0, 1.35, 1.2, 1.05, 0.9, 0.8, 0.7];
/// assert_eq!(source_number(&eigenvalues, 100.0, Criterion::Mdl, false), 2);
/// assert_eq!(source_number(&eigenvalues[2..], 100.0, Criterion::Mdl, false), 0);
/// ```
pub fn source_number(eigenvalues: &[f64], looks: f64, criterion: Criterion, forward_backward: bool) -> usize {
    let n = eigenvalues.len();
    // A forward-backward look counts as two for the rank.
    let rank = (looks.floor() as usize).saturating_mul(1 + usize::from(forward_backward)).clamp(1, n);
    let top = eigenvalues.first().copied().unwrap_or(0.0);
    if top <= 0.0 {
        return 0;
    }
    let used: Vec<f64> = eigenvalues[..rank].iter().map(|v| v.max(top * f64::EPSILON)).collect();
    let score = |k: usize| {
        let rest = &used[k..];
        let m = rest.len() as f64;
        let mean = rest.iter().sum::<f64>() / m;
        let log_ratio = rest.iter().map(|v| v.ln()).sum::<f64>() / m - mean.ln();
        let (k, n) = (k as f64, rank as f64);
        let free = if forward_backward { 0.5 * k * (2.0 * n - k + 1.0) } else { k * (2.0 * n - k) };
        let penalty = match criterion {
            Criterion::Mdl => 0.5 * free * looks.max(1.0).ln(),
            Criterion::Aic => free,
        };
        penalty - looks * m * log_ratio
    };
    (0..rank).map(|k| (score(k), k)).min_by(|a, b| a.0.total_cmp(&b.0)).map_or(0, |s| s.1)
}

/// Probability that noise alone leaves as much power as `residual_w` (sum over channels, mean over
/// snapshots) where the noise power of a channel is known: the residual over it, times `snapshots`, is
/// gamma distributed with `freedom` complex degrees of freedom.
pub fn residual_probability(residual_w: f64, noise_w: f64, snapshots: f64, freedom: f64) -> f64 {
    let x = residual_w * snapshots / noise_w;
    if x.is_nan() || x <= 0.0 {
        return 1.0;
    }
    if x.is_infinite() { 0.0 } else { gamma_ur(freedom.max(0.5), x) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_eigenvalues_are_noise() {
        for c in [Criterion::Mdl, Criterion::Aic] {
            assert_eq!(source_number(&[2.0; 6], 50.0, c, false), 0);
            assert_eq!(source_number(&[0.0; 6], 50.0, c, false), 0);
        }
    }

    #[test]
    fn strong_eigenvalues_are_counted() {
        let v = [100.0, 30.0, 1.1, 1.0, 0.95, 0.9];
        for (criterion, fb) in [(Criterion::Mdl, false), (Criterion::Aic, true), (Criterion::Mdl, true)] {
            assert_eq!(source_number(&v, 40.0, criterion, fb), 2);
        }
    }

    #[test]
    fn a_closed_form_of_two_eigenvalues() {
        // One source if L ln(am/gm)^2 exceeds the penalty of three parameters, MDL 1.5 ln L.
        let am_over_gm_squared = 4.0f64 / 3.0;
        let gain = |l: f64| l * am_over_gm_squared.ln() - 1.5 * l.ln();
        for looks in [5.0, 10.0, 14.0, 16.0, 20.0, 40.0] {
            let found = source_number(&[3.0, 1.0], looks, Criterion::Mdl, false);
            assert_eq!(found, usize::from(gain(looks) > 0.0), "{looks}");
        }
    }

    #[test]
    fn probability_of_one_and_two_degrees() {
        // Exponential: e^-x; two: (1 + x) e^-x.
        let p = residual_probability(6.0, 2.0, 1.0, 1.0);
        assert!((p - (-3.0f64).exp()).abs() < 1e-12);
        let p = residual_probability(3.0, 2.0, 2.0, 2.0);
        assert!((p - 4.0 * (-3.0f64).exp()).abs() < 1e-12);
        assert_eq!(residual_probability(0.0, 2.0, 1.0, 1.0), 1.0);
        assert_eq!(residual_probability(1.0, 0.0, 1.0, 1.0), 0.0);
    }
}
