//! Decompositions against their definitions and closed forms.

use catseye_math::{Matrix, NoConvergence};
use num_complex::Complex64;
use proptest::prelude::*;

fn c(re: f64, im: f64) -> Complex64 {
    Complex64::new(re, im)
}

fn matrices(rows: usize, cols: usize) -> impl Strategy<Value = Matrix> {
    let entry = (-1.0..1.0f64, -1.0..1.0f64);
    proptest::collection::vec(entry, rows * cols).prop_map(move |v| {
        Matrix::from_fn(rows, cols, |i, j| {
            let (re, im) = v[j * rows + i];
            c(re, im)
        })
    })
}

fn diagonal(values: &[Complex64]) -> Matrix {
    let n = values.len();
    Matrix::from_fn(n, n, |i, j| if i == j { values[i] } else { Complex64::ZERO })
}

/// |A^H A - 1|.
fn skewness(a: &Matrix) -> f64 {
    (a.adjoint() * a - Matrix::identity(a.ncols(), a.ncols())).norm_l2()
}

/// Wide, square, tall, and larger than the blocks of the algorithms.
const SHAPES: [(usize, usize); 6] = [(2, 6), (5, 5), (7, 3), (1, 1), (1, 4), (80, 70)];

/// Values without structure, the same in every run.
fn scattered(rows: usize, cols: usize) -> Matrix {
    let value = |i: usize, k: f64| (f64::sin(i as f64 * 12.9898 + k) * 43_758.545).fract();
    Matrix::from_fn(rows, cols, |i, j| c(value(j * rows + i, 1.0), value(j * rows + i, 2.0)))
}

proptest! {
    #[test]
    fn hermitian_eigenvectors_rebuild_the_matrix(a in matrices(5, 5)) {
        let h = &a + a.adjoint();
        let (values, v) = h.hermitian_eigen().unwrap();
        prop_assert!(values.windows(2).all(|w| w[0] >= w[1]));
        prop_assert!(skewness(&v) < 1e-13);
        let d = diagonal(&values.iter().map(|x| Complex64::from(*x)).collect::<Vec<_>>());
        prop_assert!((&v * d * v.adjoint() - &h).norm_l2() < 1e-12);
    }

    #[test]
    fn eigenvectors_are_stretched_by_eigenvalues(a in matrices(4, 4)) {
        let v = a.eigenvectors().unwrap();
        let values = a.eigenvalues().unwrap();
        for k in 0..4 {
            let x = v.columns(k, 1);
            let y = &a * &x;
            // Rayleigh's quotient of an eigenvector is its eigenvalue.
            let value = (x.adjoint() * &y)[(0, 0)] / x.squared_norm_l2();
            prop_assert!((y - x.clone() * value).norm_l2() < 1e-11 * x.norm_l2());
            // An eigenvalue that is nearly double is known to the root of the rounding errors.
            prop_assert!(values.iter().any(|z| (z - value).norm() < 1e-6));
        }
        let trace: Complex64 = (0..4).map(|i| a[(i, i)]).sum();
        prop_assert!((values.iter().sum::<Complex64>() - trace).norm() < 1e-12);
    }

    #[test]
    fn the_inverse_undoes(a in matrices(6, 6)) {
        let back = a.inverse();
        let condition = a.norm_l2() * back.norm_l2();
        prop_assume!(condition < 1e6);
        prop_assert!((&a * &back - Matrix::identity(6, 6)).norm_l2() < 1e-14 * condition);
        prop_assert!((&back * &a - Matrix::identity(6, 6)).norm_l2() < 1e-14 * condition);
    }
}

#[test]
fn eigenvalues_of_two_by_two() {
    let h = Matrix::from_fn(2, 2, |i, j| [[c(2.0, 0.0), c(0.0, -1.0)], [c(0.0, 1.0), c(2.0, 0.0)]][i][j]);
    let (values, v) = h.hermitian_eigen().unwrap();
    assert!((values[0] - 3.0).abs() < 1e-15 && (values[1] - 1.0).abs() < 1e-15);
    // (1, j)/sqrt 2 belongs to 3.
    assert!((v[(1, 0)] / v[(0, 0)] - c(0.0, 1.0)).norm() < 1e-14);
    let turn = Matrix::from_fn(2, 2, |i, j| c([[0.0, -1.0], [1.0, 0.0]][i][j], 0.0));
    let mut values = turn.eigenvalues().unwrap();
    values.sort_by(|a, b| a.im.total_cmp(&b.im));
    assert!((values[0] - c(0.0, -1.0)).norm() < 1e-15 && (values[1] - c(0.0, 1.0)).norm() < 1e-15);
}

#[test]
fn only_the_lower_triangle_is_read() {
    let a = scattered(4, 4);
    let h = &a + a.adjoint();
    let lower = Matrix::from_fn(4, 4, |i, j| if i >= j { h[(i, j)] } else { c(7.0, 7.0) });
    assert_eq!(lower.hermitian_eigen(), h.hermitian_eigen());
}

#[test]
fn singular_values_and_right_vectors() {
    for (rows, cols) in SHAPES {
        let a = scattered(rows, cols);
        let s = a.singular_values().unwrap();
        let v = a.right_singular_vectors().unwrap();
        assert_eq!((s.len(), v.nrows(), v.ncols()), (rows.min(cols), cols, cols));
        assert!(s.windows(2).all(|w| w[0] >= w[1] && w[1] >= 0.0));
        assert!(skewness(&v) < 1e-12, "{rows} x {cols}");
        // A V = U S: orthogonal columns of the lengths s, and nothing beyond.
        let long = &a * &v;
        let squares: Vec<Complex64> =
            (0..cols).map(|j| Complex64::from(s.get(j).map_or(0.0, |s| s * s))).collect();
        assert!((long.adjoint() * &long - diagonal(&squares)).norm_l2() < 1e-12 * a.squared_norm_l2());
    }
    let d = diagonal(&[c(0.0, 0.5), c(-3.0, 0.0), c(1.0, 0.0)]);
    for (got, want) in d.singular_values().unwrap().iter().zip([3.0, 1.0, 0.5]) {
        assert!((got - want).abs() < 1e-15);
    }
}

#[test]
fn what_a_matrix_takes_to_zero() {
    // Two directions among six columns, as of two echoes without noise.
    for rows in [2, 4, 9] {
        let a = scattered(rows, 2) * scattered(2, 6);
        let (s, v) = (a.singular_values().unwrap(), a.right_singular_vectors().unwrap());
        assert!(s[2..].iter().all(|s| *s < 1e-14 * a.norm_l2()), "{s:?}");
        assert!(skewness(&v) < 1e-13 && (&a * v.columns(2, 4)).norm_l2() < 1e-13 * a.norm_l2());
    }
    let zeros = Matrix::zeros(3, 2);
    assert_eq!(
        (zeros.singular_values().unwrap(), skewness(&zeros.right_singular_vectors().unwrap())),
        (vec![0.0; 2], 0.0)
    );
}

#[test]
fn householders_q_spans_the_columns() {
    for (rows, cols) in SHAPES {
        let a = scattered(rows, cols);
        let (thin, full) = (a.thin_q(), a.full_q());
        assert_eq!((thin.nrows(), thin.ncols()), (rows, rows.min(cols)));
        assert_eq!((full.nrows(), full.ncols()), (rows, rows));
        assert!(skewness(&thin) < 1e-12 && skewness(&full) < 1e-12);
        assert!((&thin * (thin.adjoint() * &a) - &a).norm_l2() < 1e-12 * a.norm_l2());
        if rows > cols {
            let rest = full.columns(cols, rows - cols);
            assert!((rest.adjoint() * &a).norm_l2() < 1e-12 * a.norm_l2());
        }
    }
}

#[test]
fn inverses_that_need_a_pivot_or_do_not_exist() {
    // Zeros on the diagonal.
    let cycle = Matrix::from_fn(3, 3, |i, j| if j == (i + 1) % 3 { c(0.0, 2.0) } else { Complex64::ZERO });
    assert!((cycle.inverse() - cycle.adjoint() * 0.25).norm_l2() < 1e-15);
    assert!(!Matrix::zeros(2, 2).inverse().is_finite());
    let large = scattered(120, 120);
    assert!((&large * large.inverse() - Matrix::identity(120, 120)).norm_l2() < 1e-9);
}

#[test]
fn what_is_not_finite_does_not_converge() {
    let mut a = scattered(4, 4);
    a[(2, 1)] = c(f64::NAN, 0.0);
    assert_eq!(a.hermitian_eigen().unwrap_err(), NoConvergence);
    assert_eq!(a.eigenvalues().unwrap_err(), NoConvergence);
    assert_eq!(a.eigenvectors().unwrap_err(), NoConvergence);
    assert_eq!(a.singular_values().unwrap_err(), NoConvergence);
    assert_eq!(a.right_singular_vectors().unwrap_err(), NoConvergence);
}

#[test]
fn matrices_without_entries() {
    let none = Matrix::zeros(0, 0);
    assert_eq!(none.hermitian_eigen(), Ok((vec![], none.clone())));
    assert_eq!(none.eigenvalues(), Ok(vec![]));
    assert_eq!(none.inverse(), none);
    let narrow = Matrix::zeros(3, 0);
    assert_eq!(narrow.thin_q(), narrow);
    assert!((narrow.full_q() - Matrix::identity(3, 3)).norm_l2() == 0.0);
}
