//! Decompositions, by faer.

use crate::{Matrix, NoConvergence};
use faer::linalg::solvers::DenseSolveCore;
use faer::{MatRef, Side};
use num_complex::Complex64;

fn view(m: &Matrix) -> MatRef<'_, Complex64> {
    MatRef::from_column_major_slice(m.as_slice(), m.nrows(), m.ncols())
}

fn owned(m: MatRef<'_, Complex64>) -> Matrix {
    Matrix::from_fn(m.nrows(), m.ncols(), |i, j| m[(i, j)])
}

impl Matrix {
    /// Eigenvalues of a Hermitian matrix, largest first, and orthonormal eigenvectors in columns. Only
    /// the triangle below the diagonal is read.
    pub fn hermitian_eigen(&self) -> Result<(Vec<f64>, Matrix), NoConvergence> {
        let n = self.nrows();
        let eigen = view(self).self_adjoint_eigen(Side::Lower).map_err(|_| NoConvergence)?;
        let (s, u) = (eigen.S(), eigen.U());
        let values = (0..n).rev().map(|i| s[i].re).collect();
        Ok((values, Matrix::from_fn(n, n, |i, j| u[(i, n - 1 - j)])))
    }

    /// Eigenvalues of any square matrix, in no particular order.
    pub fn eigenvalues(&self) -> Result<Vec<Complex64>, NoConvergence> {
        view(self).eigenvalues().map_err(|_| NoConvergence)
    }

    /// Eigenvectors of any square matrix in columns, in no particular order.
    pub fn eigenvectors(&self) -> Result<Matrix, NoConvergence> {
        view(self).eigen().map(|e| owned(e.U())).map_err(|_| NoConvergence)
    }

    /// Largest first.
    pub fn singular_values(&self) -> Result<Vec<f64>, NoConvergence> {
        view(self).singular_values().map_err(|_| NoConvergence)
    }

    /// V of U S V^H, all its columns, those of the largest singular values first.
    pub fn right_singular_vectors(&self) -> Result<Matrix, NoConvergence> {
        view(self).svd().map(|d| owned(d.V())).map_err(|_| NoConvergence)
    }

    /// Orthonormal columns that span what the columns span: Householder's Q, no more columns than the
    /// matrix has.
    pub fn thin_q(&self) -> Matrix {
        owned(view(self).qr().compute_thin_Q().as_ref())
    }

    /// Householder's Q, square: columns past those of [`Self::thin_q`] are orthogonal to all of the
    /// matrix.
    pub fn full_q(&self) -> Matrix {
        owned(view(self).qr().compute_Q().as_ref())
    }

    /// By elimination with partial pivoting. The inverse of a singular matrix is not finite, or huge.
    pub fn inverse(&self) -> Matrix {
        owned(view(self).partial_piv_lu().inverse().as_ref())
    }
}
