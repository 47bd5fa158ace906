//! Subspace tracking by bi-iteration SVD (CONVENTIONS eq. 98; Miyake, Natsume & Hoshino, "Road-shape
//! recognition using on-vehicle millimeter-wave radar", eqs. 9-22; Strobach, IEEE Trans. SP-45, 1222,
//! 1997): each snapshot turns an orthonormal basis of the signal subspace, without an
//! eigendecomposition. MUSIC takes it through [`super::doa_music::complement`] or eq. 22 there.
//!
//! The recursion is written over a [`Tally`], so that the arithmetic that runs is the arithmetic that
//! is counted.

use super::doa_covariance::check_forgetting;
use super::doa_manifold::Matrix;
use crate::base::error::{BadInput, Result};
use num_complex::Complex64;

/// Counts the arithmetic that is done. `()` counts nothing and costs nothing.
pub trait Tally {
    /// Complex products, each added to a sum.
    fn products(&mut self, _count: usize) {}
    /// Complex numbers times real ones.
    fn scalings(&mut self, _count: usize) {}
    /// Sums of |z|^2.
    fn squares(&mut self, _count: usize) {}
    /// Complex sums without a product.
    fn sums(&mut self, _count: usize) {}
    /// Products of two real numbers.
    fn real_products(&mut self, _count: usize) {}
    /// Divisions of real numbers.
    fn divisions(&mut self, _count: usize) {}
    /// Square roots.
    fn roots(&mut self, _count: usize) {}
}

impl Tally for () {}

/// Operations on real numbers: a complex product is 4 multiplications and 2 additions and its
/// accumulation 2 more additions; a complex number times a real one 2 multiplications; |z|^2 added to a
/// sum 2 and 2.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Operations {
    /// Real multiplications.
    pub multiplications: u64,
    /// Real additions.
    pub additions: u64,
    /// Real divisions.
    pub divisions: u64,
    /// Real square roots.
    pub square_roots: u64,
}

impl Tally for Operations {
    fn products(&mut self, count: usize) {
        self.multiplications += 4 * count as u64;
        self.additions += 4 * count as u64;
    }
    fn scalings(&mut self, count: usize) {
        self.multiplications += 2 * count as u64;
    }
    fn squares(&mut self, count: usize) {
        self.multiplications += 2 * count as u64;
        self.additions += 2 * count as u64;
    }
    fn sums(&mut self, count: usize) {
        self.additions += 2 * count as u64;
    }
    fn real_products(&mut self, count: usize) {
        self.multiplications += count as u64;
    }
    fn divisions(&mut self, count: usize) {
        self.divisions += count as u64;
    }
    fn roots(&mut self, count: usize) {
        self.square_roots += count as u64;
    }
}

/// The tracker of a signal subspace. Matrices are row-major.
#[derive(Debug, Clone, PartialEq)]
pub struct BiSvd {
    channels: usize,
    rank: usize,
    /// sqrt(alpha), sqrt(1 - alpha).
    keep: f64,
    take: f64,
    /// Q_A, `[channel, rank]`.
    basis: Vec<Complex64>,
    /// R_A, R_B and Theta_A, `[rank, rank]`.
    r_a: Vec<Complex64>,
    r_b: Vec<Complex64>,
    turn: Vec<Complex64>,
    scratch: Scratch,
}

#[derive(Debug, Clone, PartialEq, Default)]
struct Scratch {
    h: Vec<Complex64>,
    across: Vec<Complex64>,
    tall: Vec<Complex64>,
    q: Vec<Complex64>,
    row: Vec<Complex64>,
}

impl BiSvd {
    /// A tracker of `rank` sources (L) with `forgetting` factor alpha of eq. 98, nearer 1 for longer memory.
    ///
    /// # Errors
    /// Returns an error for a rank that is not below the number of channels, or for alpha outside 0..1.
    pub fn new(channels: usize, rank: usize, forgetting: f64) -> Result<Self> {
        check_forgetting(forgetting)?;
        if rank == 0 || rank >= channels {
            return Err(BadInput::new("the signal subspace must be smaller than the array")
                .key("sources")
                .value(rank)
                .allowed(format!("1 to {}", channels.saturating_sub(1)))
                .into());
        }
        let one = |i: usize, j: usize| if i == j { Complex64::ONE } else { Complex64::ZERO };
        let zeros = vec![Complex64::ZERO; rank * rank];
        Ok(BiSvd {
            channels,
            rank,
            keep: forgetting.sqrt(),
            take: (1.0 - forgetting).sqrt(),
            basis: (0..channels * rank).map(|i| one(i / rank, i % rank)).collect(),
            r_a: zeros.clone(),
            r_b: zeros,
            turn: (0..rank * rank).map(|i| one(i / rank, i % rank)).collect(),
            scratch: Scratch {
                h: vec![Complex64::ZERO; rank],
                across: vec![Complex64::ZERO; channels],
                tall: vec![Complex64::ZERO; (rank + 1) * rank],
                q: vec![Complex64::ZERO; (rank + 1) * rank],
                row: vec![Complex64::ZERO; rank],
            },
        })
    }

    /// Takes in one snapshot of all channels.
    pub fn update(&mut self, snapshot: &[Complex64]) {
        self.update_counted(snapshot, &mut ());
    }

    /// Takes in a snapshot as [`Self::update`] does, and counts its operations in `tally`.
    pub fn update_counted<T: Tally>(&mut self, snapshot: &[Complex64], tally: &mut T) {
        let (n, l) = (self.channels, self.rank);
        let Scratch { h, across, tall, q, row } = &mut self.scratch;
        // h = Q_A^H x and the part of x across the subspace.
        h.fill(Complex64::ZERO);
        for (x, basis) in snapshot.iter().zip(self.basis.chunks_exact(l)) {
            for (h, b) in h.iter_mut().zip(basis) {
                *h += b.conj() * x;
            }
        }
        tally.products(n * l);
        let (mut size, mut whole) = (0.0, 0.0);
        for ((out, x), basis) in across.iter_mut().zip(snapshot).zip(self.basis.chunks_exact(l)) {
            let inside: Complex64 = basis.iter().zip(h.iter()).map(|(b, h)| b * h).sum();
            *out = x - inside;
            size += out.norm_sqr();
            whole += x.norm_sqr();
        }
        tally.products(n * l);
        tally.squares(2 * n);
        // Below this the rest is rounding, and its direction is no direction.
        let size = if size > 1e-24 * whole { size.sqrt() } else { 0.0 };
        tally.roots(1);
        if size > 0.0 {
            let scale = 1.0 / size;
            across.iter_mut().for_each(|z| *z *= scale);
            tally.divisions(1);
            tally.scalings(n);
        }

        // B = Q_B R_B from [sqrt(alpha) R_B Theta_A; sqrt(1 - alpha) h^H].
        product(&self.r_b, &self.turn, l, self.keep, &mut tall[..l * l], tally);
        for (out, h) in tall[l * l..].iter_mut().zip(h.iter()) {
            *out = h.conj() * self.take;
        }
        tally.scalings(l);
        triangle(tall, q, l, &mut self.r_b, tally);
        row.copy_from_slice(&q[l * l..]);

        // A = Q_A R_A from [sqrt(alpha) R_A G_1 + sqrt(1 - alpha) h g^H; sqrt(1 - alpha) |x_perp| g^H].
        product(&self.r_a, &q[..l * l], l, self.keep, &mut tall[..l * l], tally);
        row.iter_mut().for_each(|g| *g *= self.take);
        tally.scalings(l);
        for (out, h) in tall[..l * l].chunks_exact_mut(l).zip(h.iter()) {
            for (out, g) in out.iter_mut().zip(row.iter()) {
                *out += h * g;
            }
        }
        tally.products(l * l);
        for (out, g) in tall[l * l..].iter_mut().zip(row.iter()) {
            *out = g * size;
        }
        tally.scalings(l);
        triangle(tall, q, l, &mut self.r_a, tally);

        // Q_A Theta_A + x_perp f^H: the rows of the thin factor are Theta_A and f^H.
        self.turn.copy_from_slice(&q[..l * l]);
        let f = &q[l * l..];
        for (basis, x) in self.basis.chunks_exact_mut(l).zip(across.iter()) {
            for (j, out) in row.iter_mut().enumerate() {
                *out = x * f[j];
                for (i, b) in basis.iter().enumerate() {
                    *out += b * self.turn[i * l + j];
                }
            }
            basis.copy_from_slice(row);
        }
        tally.products(n * l * (l + 1));
    }

    /// Orthonormal columns Q_A that span the signal subspace, `[channel, rank]`.
    pub fn basis(&self) -> Matrix {
        Matrix::from_fn(self.channels, self.rank, |i, j| self.basis[i * self.rank + j])
    }

    /// Largest singular values of the data matrix, as the diagonal of R_A has them.
    pub fn singular_values(&self) -> Vec<f64> {
        (0..self.rank).map(|i| self.r_a[i * self.rank + i].norm()).collect()
    }
}

/// out = scale a b, all `[l, l]`.
fn product<T: Tally>(
    a: &[Complex64],
    b: &[Complex64],
    l: usize,
    scale: f64,
    out: &mut [Complex64],
    tally: &mut T,
) {
    // a is upper triangular.
    for (i, out) in out.chunks_exact_mut(l).enumerate() {
        for (j, out) in out.iter_mut().enumerate() {
            *out = (i..l).map(|k| a[i * l + k] * b[k * l + j]).sum::<Complex64>() * scale;
        }
    }
    tally.products(l * l * (l + 1) / 2);
    tally.scalings(l * l);
}

/// `tall` = q r with q of l orthonormal columns, `[l + 1, l]`, and r upper triangular with a real
/// diagonal: Householder. `tall` is used up.
fn triangle<T: Tally>(
    tall: &mut [Complex64],
    q: &mut [Complex64],
    l: usize,
    r: &mut [Complex64],
    tally: &mut T,
) {
    let m = l + 1;
    // The mirrors v stay below and on the diagonal of `tall`; `r` takes the diagonal itself.
    r.fill(Complex64::ZERO);
    for k in 0..l {
        let norm = (k..m).map(|i| tall[i * l + k].norm_sqr()).sum::<f64>().sqrt();
        tally.squares(m - k);
        tally.roots(1);
        for j in 0..k {
            r[j * l + k] = tall[j * l + k];
        }
        if norm == 0.0 {
            continue;
        }
        let head = tall[k * l + k];
        let size = head.norm();
        let phase = if size > 0.0 { head / size } else { Complex64::ONE };
        tally.squares(1);
        tally.roots(1);
        tally.divisions(1);
        tally.scalings(2);
        // v = x + phase |x| e_k, and 2/|v|^2 = 1/(|x|(|x| + |x_k|)).
        tall[k * l + k] += phase * norm;
        tally.sums(1);
        r[k * l + k] = -phase * norm;
        let weight = 1.0 / (norm * (norm + size));
        tally.real_products(1);
        tally.divisions(1);
        for j in k + 1..l {
            let dot: Complex64 = (k..m).map(|i| tall[i * l + k].conj() * tall[i * l + j]).sum();
            let dot = dot * weight;
            for i in k..m {
                let v = tall[i * l + k];
                tall[i * l + j] -= v * dot;
            }
            tally.products(2 * (m - k));
            tally.scalings(1);
        }
        // Kept as v sqrt(weight), so that the second pass needs no more of this column.
        let root = weight.sqrt();
        (k..m).for_each(|i| tall[i * l + k] *= root);
        tally.roots(1);
        tally.scalings(m - k);
    }
    q.fill(Complex64::ZERO);
    for j in 0..l {
        q[j * l + j] = Complex64::ONE;
    }
    for k in (0..l).rev() {
        for j in k..l {
            let dot: Complex64 = (k..m).map(|i| tall[i * l + k].conj() * q[i * l + j]).sum();
            for i in k..m {
                q[i * l + j] -= tall[i * l + k] * dot;
            }
            tally.products(2 * (m - k));
        }
    }
}

/// Eigenvalues and eigenvectors (in columns, row-major) of a Hermitian matrix by cyclic Jacobi
/// rotations (Golub & Van Loan, *Matrix Computations*, section 8.5), told to `tally`: the full
/// decomposition that the tracker is weighed against. Unsorted. Stops when the entries off the diagonal
/// are below `tolerance` of the matrix's norm.
pub fn jacobi<T: Tally>(
    matrix: &[Complex64],
    n: usize,
    tolerance: f64,
    tally: &mut T,
) -> (Vec<f64>, Vec<Complex64>) {
    let mut a = matrix.to_vec();
    let one = |i: usize| if i / n == i % n { Complex64::ONE } else { Complex64::ZERO };
    let mut v: Vec<Complex64> = (0..n * n).map(one).collect();
    let norm: f64 = a.iter().map(|z| z.norm_sqr()).sum();
    for _ in 0..30 {
        let off: f64 = (0..n * n).filter(|i| i / n < i % n).map(|i| 2.0 * a[i].norm_sqr()).sum();
        tally.squares(n * (n - 1) / 2);
        if off <= tolerance * tolerance * norm {
            break;
        }
        for p in 0..n {
            for q in p + 1..n {
                let z = a[p * n + q];
                let size = z.norm();
                tally.squares(1);
                tally.roots(1);
                if size == 0.0 {
                    continue;
                }
                let phase = z / size;
                let tau = (a[q * n + q].re - a[p * n + p].re) / (2.0 * size);
                let t = tau.signum() / (tau.abs() + (1.0 + tau * tau).sqrt());
                let c = 1.0 / (1.0 + t * t).sqrt();
                let s = phase * (t * c);
                tally.divisions(4);
                tally.roots(2);
                tally.real_products(4);
                tally.scalings(1);
                // Columns, then rows: x_p' = c x_p - conj(s) x_q, x_q' = s x_p + c x_q.
                for i in 0..n {
                    let (x, y) = (a[i * n + p], a[i * n + q]);
                    (a[i * n + p], a[i * n + q]) = (x * c - y * s.conj(), x * s + y * c);
                    let (x, y) = (v[i * n + p], v[i * n + q]);
                    (v[i * n + p], v[i * n + q]) = (x * c - y * s.conj(), x * s + y * c);
                }
                for i in 0..n {
                    let (x, y) = (a[p * n + i], a[q * n + i]);
                    (a[p * n + i], a[q * n + i]) = (x * c - y * s, x * s.conj() + y * c);
                }
                // Half of the matrix is the conjugate of the other: rows and columns together cost one
                // pass.
                tally.products(2 * 2 * n);
                tally.scalings(2 * 2 * n);
            }
        }
    }
    ((0..n).map(|i| a[i * n + i].re).collect(), v)
}

/// Operations that one snapshot costs with the tracker and with the full decomposition.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Costs {
    /// Cost of one update of the tracker.
    pub tracking: Operations,
    /// Update of the covariance (its upper half) and Jacobi's decomposition to 1e-6.
    pub decomposition: Operations,
}

/// Counts the operations of both on the last of `snapshots`, `[snapshot, channel]`, after all others.
///
/// # Errors
/// Returns an error for a rank or a number of channels that the tracker does not take.
pub fn costs(snapshots: &[Complex64], channels: usize, rank: usize, forgetting: f64) -> Result<Costs> {
    let mut tracker = BiSvd::new(channels, rank, forgetting)?;
    let mut r = vec![Complex64::ZERO; channels * channels];
    let mut costs = Costs { tracking: Operations::default(), decomposition: Operations::default() };
    for x in snapshots.chunks_exact(channels) {
        costs = Costs { tracking: Operations::default(), decomposition: Operations::default() };
        tracker.update_counted(x, &mut costs.tracking);
        for i in 0..channels {
            for j in 0..channels {
                let z = &mut r[i * channels + j];
                *z = *z * forgetting + x[i] * x[j].conj() * (1.0 - forgetting);
            }
        }
    }
    let half = channels * (channels + 1) / 2;
    costs.decomposition.scalings(half + channels);
    costs.decomposition.products(half);
    jacobi(&r, channels, 1e-6, &mut costs.decomposition);
    Ok(costs)
}

/// Time for all snapshots, s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Times {
    /// Number of snapshots that were timed.
    pub snapshots: usize,
    /// Time of the tracker, s.
    pub tracking_s: f64,
    /// Covariance and the library's Hermitian eigendecomposition for each snapshot.
    pub decomposition_s: f64,
}

/// Times the tracker and the full decomposition over the same snapshots, `[snapshot, channel]`, on one thread.
///
/// # Errors
/// Returns an error for a rank or a number of channels that the tracker does not take.
pub fn times(snapshots: &[Complex64], channels: usize, rank: usize, forgetting: f64) -> Result<Times> {
    use super::doa_covariance::{Forgetting, eigen};
    let mut tracker = BiSvd::new(channels, rank, forgetting)?;
    let start = std::time::Instant::now();
    for x in snapshots.chunks_exact(channels) {
        tracker.update(x);
        std::hint::black_box(&tracker.basis);
    }
    let tracking_s = start.elapsed().as_secs_f64();
    let mut running = Forgetting::new(channels, forgetting)?;
    let start = std::time::Instant::now();
    for x in snapshots.chunks_exact(channels) {
        running.push(x);
        std::hint::black_box(eigen(&running.covariance())?);
    }
    let decomposition_s = start.elapsed().as_secs_f64();
    Ok(Times { snapshots: snapshots.len() / channels, tracking_s, decomposition_s })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::rng::philox4x32_10;
    use crate::dsp::doa_covariance::{Forgetting, covariance, eigen, principal_angle};
    use proptest::prelude::*;

    fn gaussian(t: u32, c: u32, seed: u32) -> Complex64 {
        let u = philox4x32_10([t, c, 0, 0], [seed, 0]).map(|u| (f64::from(u) + 0.5) / 4_294_967_296.0);
        Complex64::from_polar((-u[0].ln()).sqrt(), std::f64::consts::TAU * u[1])
    }

    /// Two sources on five elements in noise, `[snapshot, channel]`.
    fn scene(count: u32, noise: f64) -> Vec<Complex64> {
        let phases = [0.9, -0.4];
        (0..count)
            .flat_map(|t| {
                (0..5u32).map(move |c| {
                    let wave = |s: usize| {
                        gaussian(t, 100 + s as u32, 1)
                            * [1.0, 0.6][s]
                            * Complex64::cis(phases[s] * f64::from(c))
                    };
                    wave(0) + wave(1) + gaussian(t, c, 2) * noise
                })
            })
            .collect()
    }

    fn orthonormality(b: &Matrix) -> f64 {
        (b.adjoint() * b - Matrix::identity(b.ncols(), b.ncols())).norm_l2()
    }

    #[test]
    fn follows_the_eigenvectors() {
        let x = scene(400, 0.03);
        let mut tracker = BiSvd::new(5, 2, 0.97).unwrap();
        let mut running = Forgetting::new(5, 0.97).unwrap();
        for (t, x) in x.chunks(5).enumerate() {
            tracker.update(x);
            running.push(x);
            let e = eigen(&running.covariance()).unwrap();
            let angle = principal_angle(&e.signal(2), &tracker.basis()).unwrap();
            // One iteration a snapshot lags by the noise's share: well inside the subspace's own spread.
            assert!(t < 20 || angle < 5e-3, "{t}: {angle}");
        }
        let e = eigen(&running.covariance()).unwrap();
        for (got, want) in tracker.singular_values().iter().zip(&e.values) {
            assert!((got / want.sqrt() - 1.0).abs() < 0.02, "{got} {want}");
        }
    }

    #[test]
    fn without_noise_the_subspace_is_exact() {
        let x = scene(60, 0.0);
        let mut tracker = BiSvd::new(5, 2, 0.9).unwrap();
        x.chunks(5).for_each(|x| tracker.update(x));
        let truth = eigen(&covariance(&x, 5)).unwrap().signal(2);
        let angle = principal_angle(&truth, &tracker.basis()).unwrap();
        assert!(angle < 1e-9, "{angle}");
        assert!(orthonormality(&tracker.basis()) < 1e-12);
    }

    #[test]
    fn a_hundred_thousand_snapshots_leave_the_basis_orthonormal() {
        let x = scene(2000, 0.1);
        let mut tracker = BiSvd::new(5, 2, 0.98).unwrap();
        for _ in 0..50 {
            x.chunks(5).for_each(|x| tracker.update(x));
        }
        let off = orthonormality(&tracker.basis());
        assert!(off < 1e-10, "{off}");
    }

    #[test]
    fn the_update_is_that_of_the_document() {
        // (17), (19)-(21) with x_perp of unit length: Q_A(t) = Q_A(t-1) Theta_A + x_perp f^H.
        let x = scene(31, 0.1);
        let mut tracker = BiSvd::new(5, 2, 0.9).unwrap();
        let (before, last) = x.split_at(30 * 5);
        before.chunks(5).for_each(|x| tracker.update(x));
        let old = tracker.basis();
        tracker.update(last);
        let new = tracker.basis();
        let v = Matrix::from_fn(5, 1, |i, _| last[i]);
        let across = &v - &old * (old.adjoint() * &v);
        let length = across.norm_l2();
        let across = across * (1.0 / length);
        let turn = old.adjoint() * &new;
        let f = new.adjoint() * &across;
        let rebuilt = &old * turn + &across * f.adjoint();
        assert!((rebuilt - new).norm_l2() < 1e-13);
    }

    #[test]
    fn follows_a_source_that_moves() {
        let mut tracker = BiSvd::new(6, 1, 0.8).unwrap();
        let at = |phase: f64| Matrix::from_fn(6, 1, |c, _| Complex64::cis(phase * c as f64) / 6f64.sqrt());
        let mut worst = 0.0f64;
        for t in 0..500u32 {
            let phase = 0.004 * f64::from(t);
            let a = at(phase);
            let x: Vec<Complex64> =
                (0..6).map(|c| a[(c as usize, 0)] * gaussian(t, 7, 3) + gaussian(t, c, 4) * 0.003).collect();
            tracker.update(&x);
            if t > 30 {
                worst = worst.max(principal_angle(&a, &tracker.basis()).unwrap());
            }
        }
        // A memory of five snapshots lags by some 0.02 rad of phase, times the vector's length
        // sqrt(35/12) = 1.7.
        assert!(worst < 0.2, "{worst}");
    }

    #[test]
    fn operations_for_two_of_five() {
        let x = scene(50, 0.03);
        let c = costs(&x, 5, 2, 0.95).unwrap();
        println!("{c:?}");
        assert!(c.decomposition.multiplications > 3 * c.tracking.multiplications);
        let e = BiSvd::new(5, 5, 0.9).unwrap_err().to_string();
        assert_eq!(e, "sources = 5: the signal subspace must be smaller than the array; allowed: 1 to 4");
    }

    #[test]
    fn times_of_both() {
        let t = times(&scene(20_000, 0.03), 5, 2, 0.95).unwrap();
        println!("{t:?} ratio {}", t.tracking_s / t.decomposition_s);
        assert_eq!(t.snapshots, 20_000);
    }

    proptest! {
        #[test]
        fn jacobi_is_the_decomposition(x in proptest::collection::vec((-1.0..1.0f64, -1.0..1.0f64), 30)) {
            let x: Vec<Complex64> = x.into_iter().map(|(a, b)| Complex64::new(a, b)).collect();
            let r = covariance(&x, 5);
            let flat: Vec<Complex64> = (0..25).map(|i| r[(i / 5, i % 5)]).collect();
            let (mut values, v) = jacobi(&flat, 5, 1e-14, &mut ());
            for k in 0..5 {
                for i in 0..5 {
                    let y: Complex64 = (0..5).map(|j| flat[i * 5 + j] * v[j * 5 + k]).sum();
                    prop_assert!((y - v[i * 5 + k] * values[k]).norm() < 1e-12);
                }
            }
            values.sort_by(|a, b| b.total_cmp(a));
            for (a, b) in values.iter().zip(eigen(&r).unwrap().values) {
                prop_assert!((a - b).abs() < 1e-12);
            }
        }
    }
}
