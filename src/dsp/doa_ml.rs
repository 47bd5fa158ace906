//! Deterministic maximum likelihood (CONVENTIONS eq. 94): the directions whose steering vectors hold
//! most of the measured power. One source is the matched filter against the manifold or S_cal; several are found by
//! alternating projection (Ziskind & Wax, IEEE Trans. ASSP-36, 1553, 1988). Coherent sources and single
//! snapshots do no harm.

use super::doa_beamform::Grid;
use super::doa_manifold::{Manifold, Matrix};
use super::doa_search::{minima, refine};
use num_complex::Complex64;

/// Adds sources to `found` (directions from the strongest maximum of the plain matched filter) until
/// there are `count`, then moves each in turn to its best place given the others. `factor`: F with
/// F F^H = R.
pub fn alternating_projection(
    manifold: &Manifold,
    grid: &Grid,
    factor: &Matrix,
    found: Vec<(f64, f64)>,
    count: usize,
) -> Vec<(f64, f64)> {
    // Changes below a thousandth of the least step that `refine` takes are rounding.
    const SAME: f64 = 1e-9;
    const SWEEPS: usize = 100;
    let mut found = found;
    while found.len() < count {
        let others = Others::new(manifold, factor, &found);
        found.push(others.best(manifold, grid));
    }
    for sweep in 0..if count > 1 { SWEEPS } else { 0 } {
        let mut moved = 0.0f64;
        for s in 0..count {
            let mut rest = found.clone();
            let here = rest.remove(s);
            let others = Others::new(manifold, factor, &rest);
            // The first sweeps look everywhere, as a wrong first guess can hold the others.
            let from = if sweep < 2 { others.best(manifold, grid) } else { here };
            let there = refine(|a, e| others.cost(&manifold.steering(a, e)), grid, from);
            moved = moved.max((there.0 - here.0).abs()).max((there.1 - here.1).abs());
            found[s] = there;
        }
        if moved < SAME {
            break;
        }
    }
    found
}

/// What the other sources leave.
struct Others {
    basis: Option<Matrix>,
    factor: Matrix,
}

impl Others {
    fn new(manifold: &Manifold, factor: &Matrix, directions: &[(f64, f64)]) -> Self {
        if directions.is_empty() {
            return Others { basis: None, factor: factor.clone() };
        }
        let q = manifold.matrix(directions).qr().compute_thin_Q();
        let left = factor - &q * (q.adjoint() * factor);
        Others { basis: Some(q), factor: left }
    }

    /// -b^H R b/|b|^2 with b the part of the steering vector that the others do not explain.
    fn cost(&self, a: &[Complex64]) -> f64 {
        let project = |m: &Matrix| -> f64 {
            (0..m.ncols())
                .map(|j| {
                    a.iter().enumerate().map(|(c, a)| m[(c, j)].conj() * a).sum::<Complex64>().norm_sqr()
                })
                .sum()
        };
        let own: f64 = a.iter().map(|z| z.norm_sqr()).sum();
        let free = own - self.basis.as_ref().map_or(0.0, project);
        // Next to another source nothing of the vector is left but rounding.
        if free < 1e-9 * own { 0.0 } else { -project(&self.factor) / free }
    }

    fn best(&self, manifold: &Manifold, grid: &Grid) -> (f64, f64) {
        let angles: Vec<(f64, f64)> =
            grid.elevation_rad.iter().flat_map(|e| grid.azimuth_rad.iter().map(move |a| (*a, *e))).collect();
        let cost: Vec<f64> = angles.iter().map(|(a, e)| self.cost(&manifold.steering(*a, *e))).collect();
        let start = minima(&cost, grid).first().map_or((0.0, 0.0), |i| angles[*i]);
        refine(|a, e| self.cost(&manifold.steering(a, e)), grid, start)
    }
}
