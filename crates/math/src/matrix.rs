//! The matrix and its arithmetic, written out: products of matrices this small need no blocking.

use num_complex::Complex64;
use std::ops::{Add, Index, IndexMut, Mul, MulAssign, Sub};

/// A complex matrix, column after column.
///
/// Operators and decompositions panic where shapes do not fit, as slices do where an index does not.
#[derive(Debug, Clone, PartialEq)]
pub struct Matrix {
    rows: usize,
    cols: usize,
    data: Vec<Complex64>,
}

impl Matrix {
    /// A matrix of zeros.
    pub fn zeros(rows: usize, cols: usize) -> Self {
        Matrix { rows, cols, data: vec![Complex64::ZERO; rows * cols] }
    }

    /// Ones on the diagonal, also of a matrix that is not square.
    pub fn identity(rows: usize, cols: usize) -> Self {
        Self::from_fn(rows, cols, |i, j| if i == j { Complex64::ONE } else { Complex64::ZERO })
    }

    /// `f(row, column)`, called column by column.
    pub fn from_fn(rows: usize, cols: usize, mut f: impl FnMut(usize, usize) -> Complex64) -> Self {
        let mut data = Vec::with_capacity(rows * cols);
        for j in 0..cols {
            data.extend((0..rows).map(|i| f(i, j)));
        }
        Matrix { rows, cols, data }
    }

    /// Number of rows.
    #[inline]
    pub fn nrows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    #[inline]
    pub fn ncols(&self) -> usize {
        self.cols
    }

    /// Column `j`, from the first row down.
    #[inline]
    pub fn column(&self, j: usize) -> &[Complex64] {
        &self.data[j * self.rows..(j + 1) * self.rows]
    }

    /// Column `j`, from the first row down, to be changed.
    #[inline]
    pub fn column_mut(&mut self, j: usize) -> &mut [Complex64] {
        &mut self.data[j * self.rows..(j + 1) * self.rows]
    }

    /// `count` columns from `first` on.
    pub fn columns(&self, first: usize, count: usize) -> Matrix {
        let data = self.data[first * self.rows..(first + count) * self.rows].to_vec();
        Matrix { rows: self.rows, cols: count, data }
    }

    /// All values, column after column.
    #[inline]
    pub fn as_slice(&self) -> &[Complex64] {
        &self.data
    }

    /// Conjugate transpose.
    pub fn adjoint(&self) -> Matrix {
        Matrix::from_fn(self.cols, self.rows, |i, j| self[(j, i)].conj())
    }

    /// Sum of |z|^2.
    pub fn squared_norm_l2(&self) -> f64 {
        self.data.iter().map(|z| z.norm_sqr()).sum()
    }

    /// Frobenius norm.
    pub fn norm_l2(&self) -> f64 {
        self.squared_norm_l2().sqrt()
    }

    /// Whether all elements are finite.
    pub fn is_finite(&self) -> bool {
        self.data.iter().all(|z| z.is_finite())
    }

    fn product(&self, other: &Matrix) -> Matrix {
        assert_eq!(self.cols, other.rows, "columns of the left and rows of the right factor");
        let mut out = Matrix::zeros(self.rows, other.cols);
        for j in 0..other.cols {
            let sum = out.column_mut(j);
            for (k, b) in other.column(j).iter().enumerate() {
                for (sum, a) in sum.iter_mut().zip(self.column(k)) {
                    *sum += a * b;
                }
            }
        }
        out
    }

    fn zipped(&self, other: &Matrix, f: impl Fn(Complex64, Complex64) -> Complex64) -> Matrix {
        assert_eq!((self.rows, self.cols), (other.rows, other.cols), "shapes of the two matrices");
        let data = self.data.iter().zip(&other.data).map(|(a, b)| f(*a, *b)).collect();
        Matrix { rows: self.rows, cols: self.cols, data }
    }
}

impl Index<(usize, usize)> for Matrix {
    type Output = Complex64;

    #[inline]
    fn index(&self, (i, j): (usize, usize)) -> &Complex64 {
        &self.column(j)[i]
    }
}

impl IndexMut<(usize, usize)> for Matrix {
    #[inline]
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut Complex64 {
        &mut self.column_mut(j)[i]
    }
}

/// An operator on references and the same on values.
macro_rules! operator {
    ($trait:ident, $method:ident, $of:expr) => {
        operator!($trait, $method, $of, &Matrix, &Matrix, |a, b| (a, b));
        operator!($trait, $method, $of, &Matrix, Matrix, |a, b| (a, &b));
        operator!($trait, $method, $of, Matrix, &Matrix, |a, b| (&a, b));
        operator!($trait, $method, $of, Matrix, Matrix, |a, b| (&a, &b));
    };
    ($trait:ident, $method:ident, $of:expr, $left:ty, $right:ty, |$a:ident, $b:ident| $pair:expr) => {
        impl $trait<$right> for $left {
            type Output = Matrix;

            fn $method(self, other: $right) -> Matrix {
                let ($a, $b) = (self, other);
                let (a, b): (&Matrix, &Matrix) = $pair;
                $of(a, b)
            }
        }
    };
}

operator!(Mul, mul, Matrix::product);
operator!(Add, add, |a: &Matrix, b: &Matrix| a.zipped(b, |a, b| a + b));
operator!(Sub, sub, |a: &Matrix, b: &Matrix| a.zipped(b, |a, b| a - b));

impl MulAssign<f64> for Matrix {
    fn mul_assign(&mut self, scale: f64) {
        self.data.iter_mut().for_each(|z| *z *= scale);
    }
}

impl Mul<f64> for Matrix {
    type Output = Matrix;

    fn mul(mut self, scale: f64) -> Matrix {
        self *= scale;
        self
    }
}

impl Mul<Complex64> for Matrix {
    type Output = Matrix;

    fn mul(mut self, scale: Complex64) -> Matrix {
        self.data.iter_mut().for_each(|z| *z *= scale);
        self
    }
}
