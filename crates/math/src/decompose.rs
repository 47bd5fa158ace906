//! Decompositions, by nalgebra.

use crate::{Matrix, NoConvergence};
use nalgebra::{DMatrix, Schur, SymmetricEigen};
use num_complex::Complex64;

/// Deviation at which an iteration ends, and the number of steps after which it is given up.
const EPS: f64 = f64::EPSILON;
const STEPS: usize = 10_000;
const SWEEPS: usize = 60;

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
    ///
    /// # Errors
    /// Values that are not finite, or a decomposition that does not converge.
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
    ///
    /// # Errors
    /// Values that are not finite, or a decomposition that does not converge.
    pub fn eigenvalues(&self) -> Result<Vec<Complex64>, NoConvergence> {
        Ok(self.schur()?.1.diagonal().iter().copied().collect())
    }

    /// Eigenvectors of any square matrix in columns, in no particular order.
    ///
    /// # Errors
    /// Values that are not finite, or a decomposition that does not converge.
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

    /// Singular values, largest first, as many as there are columns, and V of U S V^H: by one-sided Jacobi rotations (Golub and Van
    /// Loan, Matrix Computations, section 8.6.3). nalgebra's decomposition errs by 1e-4 where singular values vanish.
    fn singular(&self) -> Result<(Vec<f64>, Matrix), NoConvergence> {
        let n = self.ncols();
        let (mut u, mut v) = (self.finite()?, DMatrix::<Complex64>::identity(n, n));
        let least = EPS * EPS * u.norm_squared();
        let turn = |m: &mut DMatrix<Complex64>, [p, q]: [usize; 2], c: f64, s: Complex64| {
            for i in 0..m.nrows() {
                let (x, y) = (m[(i, p)], m[(i, q)]);
                (m[(i, p)], m[(i, q)]) = (c * x - s.conj() * y, s * x + c * y);
            }
        };
        for _ in 0..SWEEPS {
            let mut settled = true;
            for p in 0..n {
                for q in p + 1..n {
                    let (a, b) = (u.column(p).norm_squared(), u.column(q).norm_squared());
                    let between = u.column(p).dotc(&u.column(q));
                    let size = between.norm();
                    if size <= EPS * (a * b).sqrt() || size <= least {
                        continue;
                    }
                    settled = false;
                    let zeta = (b - a) / (2.0 * size);
                    let t = zeta.signum() / (zeta.abs() + zeta.hypot(1.0));
                    let c = 1.0 / t.hypot(1.0);
                    let s = c * t * (between / size);
                    turn(&mut u, [p, q], c, s);
                    turn(&mut v, [p, q], c, s);
                }
            }
            if settled {
                let length: Vec<f64> = u.column_iter().map(|x| x.norm()).collect();
                let mut order: Vec<usize> = (0..n).collect();
                order.sort_by(|&i, &j| length[j].total_cmp(&length[i]));
                let values = order.iter().map(|&i| length[i]).collect();
                return Ok((values, Matrix::from_fn(n, n, |i, j| v[(i, order[j])])));
            }
        }
        Err(NoConvergence)
    }

    /// Largest first.
    ///
    /// # Errors
    /// Values that are not finite, or a decomposition that does not converge.
    pub fn singular_values(&self) -> Result<Vec<f64>, NoConvergence> {
        let mut values = self.singular()?.0;
        values.truncate(self.nrows());
        Ok(values)
    }

    /// V of U S V^H, all its columns, those of the largest singular values first.
    ///
    /// # Errors
    /// Values that are not finite, or a decomposition that does not converge.
    pub fn right_singular_vectors(&self) -> Result<Matrix, NoConvergence> {
        Ok(self.singular()?.1)
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
}
