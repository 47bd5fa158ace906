//! Decompositions, by nalgebra.

use crate::{Matrix, NoConvergence};
use nalgebra::{DMatrix, Dyn, SVD, Schur, SymmetricEigen};
use num_complex::Complex64;

/// Deviation at which an iteration ends, and the number of steps after which it is given up.
const EPS: f64 = f64::EPSILON;
const STEPS: usize = 10_000;

fn copy(m: &Matrix) -> DMatrix<Complex64> {
    DMatrix::from_column_slice(m.nrows(), m.ncols(), m.as_slice())
}

fn owned(m: &DMatrix<Complex64>) -> Matrix {
    Matrix::from_fn(m.nrows(), m.ncols(), |i, j| m[(i, j)])
}

impl Matrix {
    /// A copy, for iterations that would not end on values that are not finite.
    fn finite(&self) -> Result<DMatrix<Complex64>, NoConvergence> {
        if self.is_finite() { Ok(copy(self)) } else { Err(NoConvergence) }
    }

    /// Eigenvalues of a Hermitian matrix, largest first, and orthonormal eigenvectors in columns. Only
    /// the triangle below the diagonal is read.
    pub fn hermitian_eigen(&self) -> Result<(Vec<f64>, Matrix), NoConvergence> {
        let n = self.nrows();
        if n == 0 {
            return Ok((Vec::new(), Matrix::zeros(0, 0)));
        }
        let mut whole = self.finite()?;
        whole.fill_upper_triangle_with_lower_triangle();
        for j in 0..n {
            whole[(j, j)].im = 0.0;
            whole.view_mut((0, j), (j, 1)).apply(|z| *z = z.conj());
        }
        let eigen = SymmetricEigen::try_new(whole, EPS, STEPS).ok_or(NoConvergence)?;
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|&i, &j| eigen.eigenvalues[j].total_cmp(&eigen.eigenvalues[i]));
        let values = order.iter().map(|&i| eigen.eigenvalues[i]).collect();
        Ok((values, Matrix::from_fn(n, n, |i, j| eigen.eigenvectors[(i, order[j])])))
    }

    fn schur(&self) -> Result<(DMatrix<Complex64>, DMatrix<Complex64>), NoConvergence> {
        if self.nrows() == 0 {
            return Ok(Default::default());
        }
        Ok(Schur::try_new(self.finite()?, EPS, STEPS).ok_or(NoConvergence)?.unpack())
    }

    /// Eigenvalues of any square matrix, in no particular order.
    pub fn eigenvalues(&self) -> Result<Vec<Complex64>, NoConvergence> {
        Ok(self.schur()?.1.diagonal().iter().copied().collect())
    }

    /// Eigenvectors of any square matrix in columns, in no particular order.
    pub fn eigenvectors(&self) -> Result<Matrix, NoConvergence> {
        let (q, t) = self.schur()?;
        let n = t.nrows();
        let mut vectors = DMatrix::<Complex64>::identity(n, n);
        for k in 0..n {
            // (T - t_kk) v = 0 from the diagonal upwards.
            for i in (0..k).rev() {
                let sum: Complex64 = (i + 1..=k).map(|j| t[(i, j)] * vectors[(j, k)]).sum();
                let gap = t[(k, k)] - t[(i, i)];
                // Of a value that comes twice, a neighbour's vector within rounding.
                let gap = if gap.norm() < EPS * t.norm() { Complex64::from(EPS * t.norm()) } else { gap };
                vectors[(i, k)] = sum / gap;
            }
        }
        let mut vectors = q * vectors;
        for mut column in vectors.column_iter_mut() {
            let norm = column.norm();
            column /= Complex64::from(norm);
        }
        Ok(owned(&vectors))
    }

    fn decomposed(&self, vectors: bool) -> Result<SVD<Complex64, Dyn, Dyn>, NoConvergence> {
        SVD::try_new(self.finite()?, false, vectors, EPS, STEPS).ok_or(NoConvergence)
    }

    /// Largest first.
    pub fn singular_values(&self) -> Result<Vec<f64>, NoConvergence> {
        Ok(self.decomposed(false)?.singular_values.iter().copied().collect())
    }

    /// Orthonormal columns that span what the columns span: Householder's Q, no more columns than the
    /// matrix has.
    pub fn thin_q(&self) -> Matrix {
        owned(&copy(self).qr().q())
    }

    /// Householder's Q, square: columns past those of [`Self::thin_q`] are orthogonal to all of the
    /// matrix.
    pub fn full_q(&self) -> Matrix {
        let mut all = DMatrix::identity(self.nrows(), self.nrows());
        copy(self).qr().q_tr_mul(&mut all);
        owned(&all.adjoint())
    }

    /// By elimination with partial pivoting. The inverse of a singular matrix is not finite, or huge.
    pub fn inverse(&self) -> Matrix {
        let n = self.nrows();
        let lu = copy(self).lu();
        owned(
            &lu.try_inverse().unwrap_or_else(|| DMatrix::from_element(n, n, Complex64::from(f64::INFINITY))),
        )
    }

    /// V of U S V^H, all its columns, those of the largest singular values first.
    pub fn right_singular_vectors(&self) -> Result<Matrix, NoConvergence> {
        let v = owned(&self.decomposed(true)?.v_t.ok_or(NoConvergence)?.adjoint());
        Ok(match v.nrows() == v.ncols() {
            true => v,
            false => v.full_q(),
        })
    }
}
