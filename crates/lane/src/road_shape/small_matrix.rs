//! Inverse of a small symmetric positive definite matrix.

/// None where the matrix is not positive definite to working precision.
pub fn inverse<const N: usize>(m: &[[f64; N]; N]) -> Option<[[f64; N]; N]> {
    // Scaled to ones on the diagonal: columns in m⁴ and in 1 stand side by side.
    let mut scale = [0.0; N];
    for i in 0..N {
        if !(m[i][i] > 0.0 && m[i][i].is_finite()) {
            return None;
        }
        scale[i] = 1.0 / m[i][i].sqrt();
    }
    let mut l = [[0.0; N]; N];
    for i in 0..N {
        for j in 0..=i {
            let mut s = m[i][j] * scale[i] * scale[j];
            s -= l[i].iter().zip(&l[j]).take(j).map(|(p, q)| p * q).sum::<f64>();
            if i == j {
                if !(s > 1e-13 && s.is_finite()) {
                    return None;
                }
                l[i][i] = s.sqrt();
            } else {
                l[i][j] = s / l[j][j];
            }
        }
    }
    // Columns of L⁻¹, then L⁻ᵀ L⁻¹.
    let mut inv = [[0.0_f64; N]; N];
    for i in 0..N {
        let row: [f64; N] = std::array::from_fn(|c| {
            let one = f64::from(u8::from(c == i));
            let sum: f64 = (0..i).map(|k| l[i][k] * inv[k][c]).sum();
            (one - sum) / l[i][i]
        });
        inv[i] = row;
    }
    let mut out = [[0.0; N]; N];
    for i in 0..N {
        for j in 0..N {
            for row in inv.iter().skip(i.max(j)) {
                out[i][j] += row[i] * row[j];
            }
            out[i][j] *= scale[i] * scale[j];
        }
    }
    Some(out)
}

pub fn times<const N: usize>(m: &[[f64; N]; N], v: &[f64; N]) -> [f64; N] {
    std::array::from_fn(|i| (0..N).map(|j| m[i][j] * v[j]).sum())
}

pub fn quadratic<const N: usize>(m: &[[f64; N]; N], v: &[f64; N]) -> f64 {
    let mv = times(m, v);
    (0..N).map(|i| v[i] * mv[i]).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_times_the_matrix_is_one() {
        let m = [[4e7, 2e3, 1e5], [2e3, 3.0, 20.0], [1e5, 20.0, 900.0]];
        let inv = inverse(&m).unwrap();
        for i in 0..3_usize {
            let row = times(&m, &inv.map(|row| row[i]));
            for (j, v) in row.iter().enumerate() {
                assert!((v - f64::from(u8::from(i == j))).abs() < 1e-9, "{i} {j} {v}");
            }
        }
        assert_eq!(inverse(&[[1.0, 1.0], [1.0, 1.0]]), None);
        assert_eq!(inverse(&[[f64::NAN, 0.0], [0.0, 1.0]]), None);
    }
}
