//! Deterministic maximum likelihood (CONVENTIONS eq. 94): the directions whose steering vectors hold
//! most of the measured power. One source is the matched filter against the manifold or S_cal; several
//! are found by alternating projection (Ziskind & Wax, IEEE Trans. ASSP-36, 1553, 1988). Coherent
//! sources and single snapshots do no harm.

use super::doa_beamform::Grid;
use super::doa_manifold::{Manifold, Matrix};
use super::doa_search::{minima, refine};
use super::doa_spectrum::{Steering, form};
use num_complex::Complex64;

/// Adds sources to `found` (directions from the strongest maximum of the plain matched filter) until
/// there are `count`, then moves each in turn to its best place given the others. `factor`: F with
/// F F^H = R. `table`: the manifold's steering vectors over the grid.
///
/// Where lobes of the array add up (sparse arrays, coherent sources), the strongest maximum may belong
/// to no source: other maxima within 3 dB of it are tried as the first one too, and the best fit is
/// kept.
pub fn alternating_projection(
    manifold: &Manifold,
    grid: &Grid,
    table: &Steering,
    factor: &Matrix,
    found: Vec<(f64, f64)>,
    count: usize,
) -> Vec<(f64, f64)> {
    // What `refine` is good for.
    const SAME: f64 = 1e-8;
    const SWEEPS: usize = 100;
    const STARTS: usize = 6;
    let look = GridSearch { manifold, grid, table, factor };
    if count < 2 {
        return if found.len() < count { look.grown(found, count) } else { found };
    }
    let mut starts = Vec::new();
    let alone = Others::new(manifold, factor, &[]);
    let cost: Vec<f64> = table.data.chunks_exact(table.channels).map(|a| alone.cost(a)).collect();
    let tops = minima(&cost, grid);
    let enough = |i: &&usize| cost[**i] <= 0.5 * cost[tops[0]];
    // The strongest is what `found` begins with.
    let skip = usize::from(!found.is_empty());
    starts.push(found);
    starts.extend(tops.iter().skip(skip).take_while(enough).take(STARTS).map(|i| vec![look.direction(*i)]));
    let best = starts
        .into_iter()
        .map(|s| {
            let mut s = look.grown(s, count);
            // The first sweeps look everywhere, as a wrong guess can hold the others.
            look.sweep(&mut s, true);
            look.sweep(&mut s, true);
            (look.explained(&s), s)
        })
        .reduce(|a, b| if b.0 > a.0 * (1.0 + 1e-9) { b } else { a });
    let mut found = best.map_or(Vec::new(), |b| b.1);
    for _ in 0..SWEEPS {
        if look.sweep(&mut found, false) < SAME {
            break;
        }
    }
    found
}

/// Where and on what to look.
struct GridSearch<'a> {
    manifold: &'a Manifold,
    grid: &'a Grid,
    table: &'a Steering,
    factor: &'a Matrix,
}

impl GridSearch<'_> {
    fn direction(&self, index: usize) -> (f64, f64) {
        let cols = self.grid.azimuth_rad.len();
        (self.grid.azimuth_rad[index % cols], self.grid.elevation_rad[index / cols])
    }

    fn grown(&self, mut found: Vec<(f64, f64)>, count: usize) -> Vec<(f64, f64)> {
        while found.len() < count {
            let others = Others::new(self.manifold, self.factor, &found);
            found.push(self.best(&others));
        }
        found
    }

    /// Each source to its best place given the others; returns the largest move in rad.
    fn sweep(&self, found: &mut [(f64, f64)], everywhere: bool) -> f64 {
        let mut moved = 0.0f64;
        for s in 0..found.len() {
            let here = found[s];
            let rest: Vec<(f64, f64)> =
                found.iter().enumerate().filter(|(i, _)| *i != s).map(|(_, d)| *d).collect();
            let others = Others::new(self.manifold, self.factor, &rest);
            let there = if everywhere { self.best(&others) } else { self.refined(&others, here, 0.05) };
            moved = moved.max((there.0 - here.0).abs()).max((there.1 - here.1).abs());
            found[s] = there;
        }
        moved
    }

    fn best(&self, others: &Others) -> (f64, f64) {
        let cost: Vec<f64> =
            self.table.data.chunks_exact(self.table.channels).map(|a| others.cost(a)).collect();
        let top = minima(&cost, self.grid).first().copied().unwrap_or(0);
        self.refined(others, self.direction(top), 1.0)
    }

    fn refined(&self, others: &Others, from: (f64, f64), scale: f64) -> (f64, f64) {
        refine(|a, e| others.cost(&self.manifold.steering(a, e)), self.grid, from, scale)
    }

    /// tr(P_A R).
    fn explained(&self, found: &[(f64, f64)]) -> f64 {
        let q = self.manifold.matrix(found).thin_q();
        (q.adjoint() * self.factor).squared_norm_l2()
    }
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
        let q = manifold.matrix(directions).thin_q();
        let left = factor - &q * (q.adjoint() * factor);
        Others { basis: Some(q), factor: left }
    }

    /// -b^H R b/|b|^2 with b the part of the steering vector that the others do not explain.
    fn cost(&self, a: &[Complex64]) -> f64 {
        let own: f64 = a.iter().map(|z| z.norm_sqr()).sum();
        let free = own - self.basis.as_ref().map_or(0.0, |q| form(q, a));
        // A place with less than a milliradian of phase to another source is taken: closer pairs explain
        // the same power to rounding, and a pair that has fallen together would not part again.
        if free < 1e-6 * own { 0.0 } else { -form(&self.factor, a) / free }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn twins_in_one_lobe_part() {
        // Two equal waves in phase at the first element, within one lobe of the array: given one source
        // in its middle, the best place for the other is next to it.
        let lambda = 0.004;
        let axis = |count: usize| (0..count).map(|i| -0.8 + 1.6 * i as f64 / (count - 1) as f64).collect();
        for (n, bins) in [(5, 181), (5, 180), (8, 181), (16, 181), (48, 724)] {
            let p = (0..n).map(|i| DVec3::Y * (0.5 * lambda * i as f64)).collect();
            let m = Manifold::receivers(p, lambda).unwrap();
            let grid = Grid { azimuth_rad: axis(bins), elevation_rad: vec![0.0] };
            let table = Steering::new(&m, &grid);
            for width in [0.25, 0.44, 0.7] {
                let half = width / n as f64;
                for middle in [0.0, 3e-5, 1e-3] {
                    let truth = [middle - half, middle + half];
                    let a = m.matrix(&truth.map(|az| (az, 0.0)));
                    let x = Matrix::from_fn(n, 1, |c, _| a[(c, 0)] + a[(c, 1)]);
                    let mut got = alternating_projection(&m, &grid, &table, &x, Vec::new(), 2);
                    got.sort_by(|a, b| a.0.total_cmp(&b.0));
                    for (g, t) in got.iter().zip(truth) {
                        assert!((g.0 - t).abs() < 1e-3 * half, "{n} {bins} {width} {middle}: {got:?}");
                    }
                }
            }
        }
    }
}
