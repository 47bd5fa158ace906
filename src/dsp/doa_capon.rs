//! Capon's beamformer (minimum variance distortionless response; CONVENTIONS eq. 94): power
//! 1/(a^H R^-1 a) in each direction (Capon, Proc. IEEE 57, 1408, 1969).

use super::doa_covariance::Eigen;
use super::doa_manifold::Matrix;
use crate::base::error::{BadInput, Result};
use num_complex::Complex64;

/// Computes F with F F^H = R^-1, from the eigendecomposition of R.
///
/// # Errors
/// Returns an error for a covariance that cannot be inverted (fewer snapshots than channels and no loading).
pub fn factor(eigen: &Eigen) -> Result<Matrix> {
    let n = eigen.values.len();
    let (top, least) = (eigen.values[0], eigen.values[n - 1]);
    // Below this ratio the smallest eigenvalues are rounding errors.
    if least.is_nan() || least <= top * n as f64 * f64::EPSILON {
        return Err(BadInput::new("Capon cannot invert this covariance: fewer snapshots than channels")
            .key("loading")
            .allowed("above 0")
            .remedy("use diagonal loading, give more snapshots, or average over subarrays")
            .into());
    }
    Ok(Matrix::from_fn(n, n, |i, j| eigen.vectors[(i, j)] / Complex64::from(eigen.values[j].sqrt())))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dsp::doa_covariance::{covariance, eigen, load};

    #[test]
    fn one_source_in_white_noise() {
        // R = P a a^H + s I: a^H R^-1 a = N/(s + N P).
        let (n, p, s) = (6, 3.0, 0.25);
        let a: Vec<Complex64> = (0..n).map(|i| Complex64::cis(0.7 * i as f64)).collect();
        let mut r = covariance(&a.iter().map(|z| z * f64::sqrt(p)).collect::<Vec<_>>(), n);
        for i in 0..n {
            r[(i, i)] += s;
        }
        let f = factor(&eigen(&r).unwrap()).unwrap();
        let q: f64 =
            (0..n).map(|k| (0..n).map(|i| f[(i, k)].conj() * a[i]).sum::<Complex64>().norm_sqr()).sum();
        assert!((q - n as f64 / (s + n as f64 * p)).abs() < 1e-12);
    }

    #[test]
    fn a_singular_covariance_is_refused_unless_loaded() {
        let mut r = covariance(&[Complex64::ONE; 3], 3);
        let e = factor(&eigen(&r).unwrap()).unwrap_err().to_string();
        assert!(e.starts_with("loading: Capon cannot invert"), "{e}");
        load(&mut r, 0.01);
        assert!(factor(&eigen(&r).unwrap()).is_ok());
    }
}
