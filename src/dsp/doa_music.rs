//! MUSIC (CONVENTIONS eq. 94): spectrum N/(a^H E_n E_n^H a) of the noise subspace (Schmidt, IEEE Trans.
//! AP-34, 276, 1986), and root-MUSIC (eq. 95), which finds its peaks on a uniform line as roots of a
//! polynomial (Barabell, ICASSP 1983).

use super::doa_manifold::Matrix;
use crate::base::error::{Error, Result};
use num_complex::Complex64;

/// Orthonormal columns that span what the orthonormal columns of `signal` leave.
///
/// # Errors
/// Returns an error for columns that are not finite.
pub fn complement(signal: &Matrix) -> Result<Matrix> {
    let (n, l) = (signal.nrows(), signal.ncols());
    if !signal.is_finite() {
        return Err(Error::Failed("the signal subspace is not finite".into()));
    }
    // Columns past the rank of Householder's Q are orthogonal to the first.
    Ok(signal.full_q().columns(l, n - l))
}

/// Finds the phase advance per element, rad within ±pi, of each of `count` sources on a uniform line: -k times the step
/// along the direction. `noise`: orthonormal columns of the noise subspace.
///
/// # Errors
/// Returns the errors of [`polynomial_roots`].
pub fn root_music(noise: &Matrix, count: usize) -> Result<Vec<f64>> {
    let n = noise.nrows();
    let c = noise * noise.adjoint();
    // sum_d c_d z^(d + n - 1), c_d the sum of the d-th diagonal: a^H C a for z = e^{j phase}.
    let degree = 2 * (n - 1);
    let coefficient: Vec<Complex64> = (0..=degree)
        .map(|i| {
            let d = i as isize - (n as isize - 1);
            (0..n as isize)
                .filter(|r| (0..n as isize).contains(&(r + d)))
                .map(|r| c[(r as usize, (r + d) as usize)])
                .sum()
        })
        .collect();
    let mut roots = polynomial_roots(&coefficient)?;
    // Roots come in pairs z, 1/z*: the nearest to the circle, one of each pair.
    roots.sort_by(|a, b| {
        a.norm().ln().abs().total_cmp(&b.norm().ln().abs()).then(a.arg().total_cmp(&b.arg()))
    });
    let mut found = Vec::new();
    while found.len() < count && !roots.is_empty() {
        let z = roots.remove(0);
        let partner = 1.0 / z.conj();
        let nearest = (0..roots.len())
            .min_by(|a, b| (roots[*a] - partner).norm().total_cmp(&(roots[*b] - partner).norm()));
        // Of a double root on the circle, split by rounding, the middle is right.
        let phase = match nearest {
            Some(i) => (z / z.norm() + {
                let w = roots.remove(i);
                w / w.norm()
            })
            .arg(),
            None => z.arg(),
        };
        found.push(phase);
    }
    Ok(found)
}

/// Finds all roots of sum_i c_i z^i, as eigenvalues of the companion matrix.
///
/// # Errors
/// Returns an error for coefficients that are not finite or all but vanish.
pub fn polynomial_roots(coefficients: &[Complex64]) -> Result<Vec<Complex64>> {
    let scale = coefficients.iter().map(|c| c.norm()).fold(0.0, f64::max);
    if !(scale > 0.0 && scale.is_finite()) {
        return Err(Error::Failed("a polynomial without finite coefficients has no roots".into()));
    }
    let small = |c: &Complex64| c.norm() <= f64::EPSILON * scale;
    let mut c = coefficients;
    while c.len() > 1 && small(&c[c.len() - 1]) {
        c = &c[..c.len() - 1];
    }
    let degree = c.len() - 1;
    if degree == 0 {
        return Ok(Vec::new());
    }
    let companion = Matrix::from_fn(degree, degree, |i, j| {
        if j == degree - 1 {
            -c[i] / c[degree]
        } else if i == j + 1 {
            Complex64::ONE
        } else {
            Complex64::ZERO
        }
    });
    companion.eigenvalues().map_err(|e| Error::Failed(format!("roots of a polynomial: {e}")))
}

/// Phase in (-pi, pi].
#[cfg(test)]
pub(super) fn wrapped(phase: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    PI - (PI - phase).rem_euclid(TAU)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn roots_of_a_cubic() {
        // (z - 1)(z - 2j)(z + 3)
        let roots = [Complex64::ONE, Complex64::new(0.0, 2.0), Complex64::new(-3.0, 0.0)];
        let mut c = vec![Complex64::ONE];
        for r in roots {
            let mut next = vec![Complex64::ZERO; c.len() + 1];
            for (i, v) in c.iter().enumerate() {
                next[i + 1] += v;
                next[i] -= v * r;
            }
            c = next;
        }
        let got = polynomial_roots(&c).unwrap();
        for r in roots {
            assert!(got.iter().any(|g| (g - r).norm() < 1e-12), "{got:?}");
        }
        assert!(polynomial_roots(&[Complex64::ZERO; 3]).is_err());
    }

    proptest! {
        #[test]
        fn noise_free_phases_come_back(a in -3.0..3.0f64, gap in 0.25..3.0f64, n in 4usize..9) {
            let phases = [a, wrapped(a + gap)];
            let v = Matrix::from_fn(n, 2, |i, j| Complex64::cis(phases[j] * i as f64));
            let signal = v.thin_q();
            let got = root_music(&complement(&signal).unwrap(), 2).unwrap();
            for p in phases {
                // A double root is known to the square root of the rounding errors.
                let off = got.iter().map(|g| wrapped(g - p).abs()).fold(9.0, f64::min);
                prop_assert!(off < 1e-6, "{:?} {:?}", got, phases);
            }
        }
    }
}
