//! Arithmetic against its definition.

use catseye_math::Matrix;
use num_complex::Complex64;
use proptest::prelude::*;

fn c(re: f64, im: f64) -> Complex64 {
    Complex64::new(re, im)
}

/// Whole numbers, whose sums and products are exact.
fn whole(rows: usize, cols: usize, seed: i64) -> Matrix {
    let value = |i: usize, j: usize, k: i64| ((seed + 7 * i as i64 + 13 * j as i64 + k) * 31 % 17 - 8) as f64;
    Matrix::from_fn(rows, cols, |i, j| c(value(i, j, 0), value(i, j, 5)))
}

proptest! {
    #[test]
    fn product_is_the_sum_over_the_inner_index(m in 0usize..6, k in 0usize..6, n in 0usize..6, seed in 0..99i64) {
        let (a, b) = (whole(m, k, seed), whole(k, n, seed + 3));
        let want = Matrix::from_fn(m, n, |i, j| (0..k).map(|l| a[(i, l)] * b[(l, j)]).sum());
        prop_assert_eq!(&(&a * &b), &want);
        prop_assert_eq!(&(a.clone() * &b), &want);
        prop_assert_eq!(&(&a * b.clone()), &want);
        prop_assert_eq!((b.adjoint() * a.adjoint()).adjoint(), want);
    }

    #[test]
    fn sums_and_scalings(m in 0usize..5, n in 0usize..5, seed in 0..99i64) {
        let (a, b) = (whole(m, n, seed), whole(m, n, seed + 1));
        prop_assert_eq!(&(&a + &b), &Matrix::from_fn(m, n, |i, j| a[(i, j)] + b[(i, j)]));
        prop_assert_eq!(&(&a - &b), &Matrix::from_fn(m, n, |i, j| a[(i, j)] - b[(i, j)]));
        let z = c(2.0, -3.0);
        prop_assert_eq!(&(a.clone() * z), &Matrix::from_fn(m, n, |i, j| a[(i, j)] * z));
        prop_assert_eq!(&(a.clone() * 0.5), &Matrix::from_fn(m, n, |i, j| a[(i, j)] * 0.5));
        let squares: f64 = (0..m).map(|i| (0..n).map(|j| a[(i, j)].norm_sqr()).sum::<f64>()).sum();
        prop_assert_eq!(a.squared_norm_l2(), squares);
        prop_assert_eq!(a.norm_l2(), squares.sqrt());
    }
}

#[test]
fn columns_stand_one_after_the_other() {
    let mut a = Matrix::from_fn(2, 3, |i, j| c(i as f64, j as f64));
    assert_eq!((a.nrows(), a.ncols()), (2, 3));
    assert_eq!(a.column(1), [c(0.0, 1.0), c(1.0, 1.0)]);
    assert_eq!(a.as_slice()[4..], [c(0.0, 2.0), c(1.0, 2.0)]);
    assert_eq!(a.columns(1, 2), Matrix::from_fn(2, 2, |i, j| c(i as f64, 1.0 + j as f64)));
    assert_eq!(a.columns(3, 0), Matrix::zeros(2, 0));
    assert_eq!(a.adjoint()[(2, 1)], c(1.0, -2.0));
    a[(1, 2)] = c(9.0, 0.0);
    a.column_mut(0)[1] = c(f64::INFINITY, 0.0);
    assert_eq!(a[(1, 2)], c(9.0, 0.0));
    assert!(!a.is_finite() && Matrix::identity(2, 3).is_finite());
    assert_eq!(Matrix::identity(2, 3).column(2), [Complex64::ZERO; 2]);
}

#[test]
#[should_panic(expected = "columns of the left")]
fn factors_must_fit() {
    let _ = Matrix::zeros(2, 3) * Matrix::zeros(2, 3);
}

#[test]
#[should_panic(expected = "shapes of the two")]
fn summands_must_fit() {
    // As many values, in another shape.
    let _ = Matrix::zeros(2, 3) + Matrix::zeros(3, 2);
}

#[test]
#[should_panic]
fn a_row_beyond_the_last_is_not_the_next_column() {
    let _ = Matrix::zeros(2, 3)[(2, 0)];
}
