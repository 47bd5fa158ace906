//! Covariance of snapshots: averages in time and over subarrays (CONVENTIONS eq. 91, 92), and its
//! eigendecomposition.

use super::doa_manifold::{Lattice, Matrix};
use crate::base::error::{BadInput, Error, Result};
use num_complex::Complex64;

/// Covariance R, the mean of x x^H over snapshots `[snapshot, channel]`.
pub fn covariance(snapshots: &[Complex64], channels: usize) -> Matrix {
    let count = (snapshots.len() / channels).max(1) as f64;
    let mut r = Matrix::zeros(channels, channels);
    for x in snapshots.chunks_exact(channels) {
        add_outer(&mut r, x, 1.0 / count);
    }
    r
}

/// Adds weight x x^H to R.
pub fn add_outer(r: &mut Matrix, x: &[Complex64], weight: f64) {
    for (j, b) in x.iter().enumerate() {
        let b = b.conj() * weight;
        for (r, a) in r.column_mut(j).iter_mut().zip(x) {
            *r += a * b;
        }
    }
}

/// Running covariance R(t) = alpha R(t-1) + (1 - alpha) x x^H (eq. 91), scaled by 1/(1 - alpha^t) so
/// that it is unbiased from the first snapshot on.
#[derive(Debug, Clone, PartialEq)]
pub struct Forgetting {
    alpha: f64,
    sum: Matrix,
    weight: f64,
}

impl Forgetting {
    /// An average with forgetting factor `alpha`.
    ///
    /// # Errors
    /// Returns an error for a factor outside 0 < alpha < 1.
    pub fn new(channels: usize, alpha: f64) -> Result<Self> {
        check_forgetting(alpha)?;
        Ok(Forgetting { alpha, sum: Matrix::zeros(channels, channels), weight: 0.0 })
    }

    /// Takes one snapshot, `[channel]`, into the average.
    pub fn push(&mut self, snapshot: &[Complex64]) {
        self.sum *= self.alpha;
        add_outer(&mut self.sum, snapshot, 1.0 - self.alpha);
        self.weight = self.alpha * self.weight + (1.0 - self.alpha);
    }

    /// The covariance so far; all zeros before the first snapshot.
    pub fn covariance(&self) -> Matrix {
        let scale = if self.weight > 0.0 { 1.0 / self.weight } else { 0.0 };
        self.sum.clone() * scale
    }

    /// Number of equally weighted snapshots whose mean is as noisy: (1 + alpha)/(1 - alpha) in the end.
    pub fn looks(&self) -> f64 {
        let (a, w) = (self.alpha, self.weight);
        // sum of weights squared: (1-a)^2 (1 - a^2t)/(1 - a^2), and a^t = 1 - w.
        let squares = (1.0 - a) / (1.0 + a) * (1.0 - (1.0 - w) * (1.0 - w));
        if squares > 0.0 { w * w / squares } else { 0.0 }
    }
}

pub(super) fn check_forgetting(alpha: f64) -> Result<()> {
    if alpha > 0.0 && alpha < 1.0 {
        return Ok(());
    }
    Err(BadInput::new("is not a forgetting factor")
        .key("forgetting")
        .value(alpha)
        .allowed("0 < alpha < 1")
        .into())
}

/// Channels of each subarray of `size` (rows, columns) of a lattice: all its shifts, row by row.
///
/// # Errors
/// Returns an error for a subarray larger than the array or without elements.
pub fn subarrays(lattice: &Lattice, size: [usize; 2]) -> Result<Vec<Vec<usize>>> {
    let [rows, cols] = lattice.size;
    if size[0] == 0 || size[1] == 0 || size[0] > rows || size[1] > cols {
        return Err(BadInput::new("the subarray does not fit the array")
            .key("subarray")
            .value(format!("{} x {}", size[0], size[1]))
            .allowed(format!("1 x 1 to {rows} x {cols}"))
            .into());
    }
    let mut out = Vec::new();
    for r in 0..=rows - size[0] {
        for c in 0..=cols - size[1] {
            let at = |i: usize| lattice.channel[(r + i / size[1]) * cols + c + i % size[1]];
            out.push((0..size[0] * size[1]).map(at).collect());
        }
    }
    Ok(out)
}

/// The snapshots of all subarrays, `[snapshot, subarray, element]`: coherent sources reach them with
/// different relative phases (Shan, Wax & Kailath, IEEE Trans. ASSP-33, 806, 1985).
pub fn subarray_snapshots(
    snapshots: &[Complex64],
    channels: usize,
    subarrays: &[Vec<usize>],
) -> Vec<Complex64> {
    snapshots
        .chunks_exact(channels)
        .flat_map(|x| subarrays.iter().flat_map(move |s| s.iter().map(move |c| x[*c])))
        .collect()
}

/// Averages forwards and backwards: (R + J R* J)/2 with J the exchange of each channel and its mirror image (eq. 92;
/// Pillai & Kwon, IEEE Trans. ASSP-37, 8, 1989).
pub fn forward_backward(r: &Matrix, mirror: &[usize]) -> Matrix {
    Matrix::from_fn(r.nrows(), r.ncols(), |i, j| 0.5 * (r[(i, j)] + r[(mirror[i], mirror[j])].conj()))
}

/// Appends to each snapshot its conjugate with mirrored channels, whose outer products are J R* J.
pub fn with_backward(snapshots: &[Complex64], channels: usize, mirror: &[usize]) -> Vec<Complex64> {
    snapshots
        .chunks_exact(channels)
        .flat_map(|x| x.iter().copied().chain(mirror.iter().map(|c| x[*c].conj())))
        .collect()
}

/// Adds `loading` times tr(R)/N to the diagonal of R (eq. 92).
pub fn load(r: &mut Matrix, loading: f64) {
    let n = r.nrows();
    let mean = (0..n).map(|i| r[(i, i)].re).sum::<f64>() / n as f64;
    for i in 0..n {
        r[(i, i)] += loading * mean;
    }
}

/// Eigenvalues, largest first, and eigenvectors in columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Eigen {
    /// Eigenvalues, largest first.
    pub values: Vec<f64>,
    /// Eigenvectors in columns, in that order.
    pub vectors: Matrix,
}

/// Eigendecomposition of a Hermitian matrix.
///
/// # Errors
/// Returns an error for values that are not finite.
pub fn eigen(r: &Matrix) -> Result<Eigen> {
    if !r.is_finite() {
        return Err(BadInput::new("snapshots hold values that are not finite").into());
    }
    let (values, vectors) =
        r.hermitian_eigen().map_err(|e| Error::Failed(format!("eigendecomposition of a covariance: {e}")))?;
    Ok(Eigen { values, vectors })
}

impl Eigen {
    /// Eigenvectors of the `count` largest eigenvalues.
    pub fn signal(&self, count: usize) -> Matrix {
        self.vectors.columns(0, count)
    }

    /// Eigenvectors of the noise subspace: all but the `count` largest.
    pub fn noise(&self, count: usize) -> Matrix {
        self.vectors.columns(count, self.vectors.ncols() - count)
    }
}

/// Largest principal angle between the spaces that orthonormal columns span, rad.
///
/// # Errors
/// Returns an error for matrices of different size, or values that are not finite.
pub fn principal_angle(a: &Matrix, b: &Matrix) -> Result<f64> {
    // From the sine, which keeps small angles: the largest singular value of (I - A A^H) B.
    let outside = b - a * (a.adjoint() * b);
    let s = outside.singular_values().map_err(|e| Error::Failed(format!("singular values: {e}")))?;
    Ok(s.first().map_or(0.0, |s| s.min(1.0).asin()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn complex() -> impl Strategy<Value = Complex64> {
        (-1.0..1.0f64, -1.0..1.0f64).prop_map(|(re, im)| Complex64::new(re, im))
    }

    proptest! {
        #[test]
        fn eigenvectors_rebuild_the_matrix(x in proptest::collection::vec(complex(), 24)) {
            let r = covariance(&x, 4);
            let e = eigen(&r).unwrap();
            prop_assert!(e.values.windows(2).all(|w| w[0] >= w[1]));
            for i in 0..4 {
                for j in 0..4 {
                    let sum: Complex64 =
                        (0..4).map(|k| e.vectors[(i, k)] * e.values[k] * e.vectors[(j, k)].conj()).sum();
                    prop_assert!((sum - r[(i, j)]).norm() < 1e-12);
                }
            }
        }

        #[test]
        fn backward_snapshots_give_the_forward_backward_mean(x in proptest::collection::vec(complex(), 12)) {
            let mirror = [3, 2, 1, 0];
            let fb = forward_backward(&covariance(&x, 4), &mirror);
            let both = covariance(&with_backward(&x, 4, &mirror), 4);
            prop_assert!((&fb - &both).norm_l2() < 1e-13);
        }
    }

    #[test]
    fn forgetting_is_the_weighted_mean() {
        let x: Vec<Complex64> = (0..10).map(|i| Complex64::new(i as f64, 1.0 - (i * i) as f64)).collect();
        let mut f = Forgetting::new(2, 0.7).unwrap();
        let mut want = Matrix::zeros(2, 2);
        let weight = |t: i32| 0.3 * 0.7f64.powi(4 - t);
        let (mut sum, mut squares) = (0.0, 0.0);
        for (t, x) in x.chunks(2).enumerate() {
            f.push(x);
            add_outer(&mut want, x, weight(t as i32));
            sum += weight(t as i32);
            squares += weight(t as i32).powi(2);
        }
        assert!((f.covariance() - want * (1.0 / sum)).norm_l2() < 1e-12);
        assert!((f.looks() - sum * sum / squares).abs() < 1e-12);
        assert!(Forgetting::new(2, 1.0).unwrap_err().to_string().contains("0 < alpha < 1"));
    }

    #[test]
    fn angle_between_planes() {
        let c = Complex64::from;
        let a = Matrix::from_fn(3, 1, |i, _| c([1.0, 0.0, 0.0][i]));
        let b = Matrix::from_fn(3, 1, |i, _| c([0.3f64.cos(), 0.3f64.sin(), 0.0][i]));
        assert!((principal_angle(&a, &b).unwrap() - 0.3).abs() < 1e-14);
    }

    #[test]
    fn subarrays_of_a_rectangle() {
        let lattice = Lattice {
            size: [2, 3],
            step_m: [glam::DVec3::Z, glam::DVec3::Y],
            channel: vec![5, 4, 3, 2, 1, 0],
        };
        let s = subarrays(&lattice, [2, 2]).unwrap();
        assert_eq!(s, [vec![5, 4, 2, 1], vec![4, 3, 1, 0]]);
        let e = subarrays(&lattice, [3, 1]).unwrap_err().to_string();
        assert_eq!(e, "subarray = 3 x 1: the subarray does not fit the array; allowed: 1 x 1 to 2 x 3");
    }
}
