//! ESPRIT by total least squares on lines and rectangles (CONVENTIONS eq. 95; Roy & Kailath, IEEE
//! Trans. ASSP-37, 984, 1989).

use super::doa_manifold::Matrix;
use crate::base::error::{BadInput, Error, Result};
use catseye_math::NoConvergence;
use num_complex::Complex64;

/// Phase advance from row to row and from column to column, rad within ±pi, of each source.
/// `signal`: orthonormal columns of the signal subspace on an array of `size` (rows, columns), row by
/// row. On one row the first is 0. On a rectangle the two phases of a source are paired through the
/// eigenvectors that both rotations share (of a weighted sum of the two).
///
/// # Errors
/// Returns an error for more sources than either axis can tell apart.
///
/// # Example
/// Two sources at −5° and 12° on eight receivers, 40 snapshots without noise: the phases from one receiver to the next
/// are those of both directions, found without a search.
///
/// ```
/// use catseye::base::rng::Draws;
/// use catseye::dsp::{doa_covariance::{covariance, eigen}, doa_esprit::esprit};
/// use num_complex::Complex64;
/// use std::f64::consts::PI;
///
/// let mut draws = Draws::new(1, 0);
/// let snapshots: Vec<Complex64> = (0..40)
///     .flat_map(|_| {
///         let amplitude = [0, 1].map(|_| Complex64::new(draws.normal(), draws.normal()));
///         let turn = [-5f64, 12.0].map(|deg| -PI * deg.to_radians().sin());
///         (0..8).map(move |c| (0..2).map(|s| amplitude[s] * Complex64::cis(turn[s] * f64::from(c))).sum())
///     })
///     .collect();
/// let eigen = eigen(&covariance(&snapshots, 8))?;
/// assert!(eigen.values[2] < 1e-12 * eigen.values[1]);
/// let phases = esprit(&eigen.signal(2), [1, 8])?;
/// let mut azimuths_deg: Vec<f64> = phases.iter().map(|p| (-p[1] / PI).asin().to_degrees()).collect();
/// azimuths_deg.sort_by(f64::total_cmp);
/// assert!((azimuths_deg[0] + 5.0).abs() < 1e-6 && (azimuths_deg[1] - 12.0).abs() < 1e-6);
/// # Ok::<(), catseye::Error>(())
/// ```
pub fn esprit(signal: &Matrix, size: [usize; 2]) -> Result<Vec<[f64; 2]>> {
    let l = signal.ncols();
    let [rows, cols] = size;
    let along_columns = rotation(signal, size, 1)?;
    if rows == 1 {
        let phases = along_columns.eigenvalues().map_err(failed)?;
        return Ok(phases.iter().map(|z| [0.0, z.arg()]).collect());
    }
    if cols == 1 {
        let phases = rotation(signal, size, 0)?.eigenvalues().map_err(failed)?;
        return Ok(phases.iter().map(|z| [z.arg(), 0.0]).collect());
    }
    let along_rows = rotation(signal, size, 0)?;
    // Any weight serves unless two sources have equal sums: an irrational one makes that unlikely.
    let mixed = &along_columns + along_rows.clone() * Complex64::new(0.618_033_988_75, 0.414_213_562_37);
    let vectors = mixed.eigenvectors().map_err(failed)?;
    let back = vectors.inverse();
    let diagonal = |m: &Matrix| {
        let d = &back * (m * &vectors);
        (0..l).map(|i| d[(i, i)].arg()).collect::<Vec<f64>>()
    };
    let (r, c) = (diagonal(&along_rows), diagonal(&along_columns));
    Ok(r.into_iter().zip(c).map(|(r, c)| [r, c]).collect())
}

/// Psi of eq. 95 for shifts along rows (axis 0: row index) or columns (axis 1).
fn rotation(signal: &Matrix, size: [usize; 2], axis: usize) -> Result<Matrix> {
    let l = signal.ncols();
    let [rows, cols] = size;
    let (kept_rows, kept_cols) = if axis == 0 { (rows.max(1) - 1, cols) } else { (rows, cols.max(1) - 1) };
    let kept = kept_rows * kept_cols;
    if axis == 1 && cols == 1 {
        return Ok(Matrix::identity(l, l));
    }
    if l > kept {
        return Err(BadInput::new("too many sources for ESPRIT on this array")
            .key("sources")
            .value(l)
            .allowed(format!("at most {kept}"))
            .into());
    }
    let shift = if axis == 0 { cols } else { 1 };
    let at = |i: usize| (i / kept_cols) * cols + i % kept_cols;
    // Right singular vectors of [E1 E2]: the least ones are [V12; V22], Psi = -V12 V22^-1.
    let both = Matrix::from_fn(kept, 2 * l, |i, j| signal[(at(i) + if j < l { 0 } else { shift }, j % l)]);
    let v = both.right_singular_vectors().map_err(failed)?;
    let v12 = Matrix::from_fn(l, l, |i, j| -v[(i, l + j)]);
    let v22 = Matrix::from_fn(l, l, |i, j| v[(l + i, l + j)]);
    Ok(v12 * v22.inverse())
}

fn failed(e: NoConvergence) -> Error {
    Error::Failed(format!("ESPRIT: {e}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dsp::doa_music::wrapped;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn noise_free_lines(a in -3.0..3.0f64, gap in 0.2..3.0f64, n in 3usize..9) {
            let phases = [a, wrapped(a + gap)];
            let v = Matrix::from_fn(n, 2, |i, j| Complex64::cis(phases[j] * i as f64));
            let got = esprit(&v.thin_q(), [1, n]).unwrap();
            for p in phases {
                prop_assert!(got.iter().any(|g| wrapped(g[1] - p).abs() < 1e-7), "{got:?} {phases:?}");
            }
        }

        #[test]
        fn noise_free_rectangles_keep_the_pairs(r in -3.0..3.0f64, c in -3.0..3.0f64, gap in 0.4..2.0f64) {
            // Three sources, two of which share a row phase and two a column phase.
            let truth = [[r, c], [r, wrapped(c + gap)], [wrapped(r + gap), c]];
            let (rows, cols) = (4, 3);
            let phase = |i: usize, s: usize| truth[s][0] * (i / cols) as f64 + truth[s][1] * (i % cols) as f64;
            let v = Matrix::from_fn(rows * cols, 3, |i, s| Complex64::cis(phase(i, s)));
            let got = esprit(&v.thin_q(), [rows, cols]).unwrap();
            for t in truth {
                let hit = got.iter().any(|g| (0..2).all(|k| wrapped(g[k] - t[k]).abs() < 1e-6));
                prop_assert!(hit, "{got:?} {truth:?}");
            }
        }
    }

    #[test]
    fn too_many_sources() {
        let e = esprit(&Matrix::identity(3, 3), [1, 3]).unwrap_err().to_string();
        assert_eq!(e, "sources = 3: too many sources for ESPRIT on this array; allowed: at most 2");
    }
}
