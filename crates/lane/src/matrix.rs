//! Small symmetric positive definite matrices. They are first scaled to a unit diagonal, as values in m⁴ and
//! in 1 stand side by side.

pub(crate) type Square<const N: usize> = [[f64; N]; N];

/// Lower Cholesky factor of the scaled matrix, and the scale. None where the matrix is not positive definite to working precision.
fn cholesky<const N: usize>(m: &Square<N>) -> Option<(Square<N>, [f64; N])> {
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
            let dot: f64 = (0..j).map(|k| l[i][k] * l[j][k]).sum();
            let s = m[i][j] * scale[i] * scale[j] - dot;
            if i != j {
                l[i][j] = s / l[j][j];
            } else if s > 1e-13 && s.is_finite() {
                l[i][i] = s.sqrt();
            } else {
                return None;
            }
        }
    }
    Some((l, scale))
}

/// Solves m x = b. None for a matrix that is not positive definite, or a non-finite x.
pub(crate) fn solve<const N: usize>(m: &Square<N>, b: &[f64; N]) -> Option<[f64; N]> {
    let (l, scale) = cholesky(m)?;
    let mut x = [0.0; N];
    for i in 0..N {
        let dot: f64 = (0..i).map(|k| l[i][k] * x[k]).sum();
        x[i] = (b[i] * scale[i] - dot) / l[i][i];
    }
    for i in (0..N).rev() {
        let dot: f64 = (i + 1..N).map(|k| l[k][i] * x[k]).sum();
        x[i] = (x[i] - dot) / l[i][i];
    }
    for i in 0..N {
        x[i] *= scale[i];
    }
    x.iter().all(|v| v.is_finite()).then_some(x)
}

/// Inverts a matrix. None where it is not positive definite to working precision.
pub(crate) fn inverse<const N: usize>(m: &Square<N>) -> Option<Square<N>> {
    let (l, scale) = cholesky(m)?;
    // Columns of L⁻¹, then L⁻ᵀ L⁻¹.
    let mut inv = [[0.0_f64; N]; N];
    for i in 0..N {
        inv[i] = std::array::from_fn(|c| {
            let one = f64::from(u8::from(c == i));
            let sum: f64 = (0..i).map(|k| l[i][k] * inv[k][c]).sum();
            (one - sum) / l[i][i]
        });
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

pub(crate) fn times<const N: usize>(m: &Square<N>, v: &[f64; N]) -> [f64; N] {
    std::array::from_fn(|i| (0..N).map(|j| m[i][j] * v[j]).sum())
}

pub(crate) fn quadratic<const N: usize>(m: &Square<N>, v: &[f64; N]) -> f64 {
    let mv = times(m, v);
    (0..N).map(|i| v[i] * mv[i]).sum()
}
