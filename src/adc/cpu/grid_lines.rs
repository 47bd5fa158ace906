//! Adds up the lines of a block at each of its samples (CONVENTIONS eq. 84).

use super::grid_fft::{SILENCE, TILE, Tile};
use super::synthesis::madd;
use crate::adc::gridding::GridLayout;
use crate::base::simd::Vectorised;
use crate::base::tasks::Tasks;
use crate::scene::radar::Sampling;
use num_complex::{Complex, Complex32, Complex64};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// What is the same for all blocks and channels, `[chirp of a block, tile]`.
pub struct Table {
    lines: usize,
    middle: usize,
    tiles: usize,
    /// e^{2πj t Δ} of eq. 84.
    step: Vec<Tile>,
    factor: Vec<Tile>,
}

impl Table {
    /// The factors of a layout.
    pub fn new(layout: &GridLayout) -> Table {
        let tiles = layout.samples.div_ceil(TILE);
        let finish = layout.finish();
        let made = (0..layout.block * tiles).into_par_iter().map_tasks(|at| {
            let (i, tile) = (at / tiles, at % tiles);
            let (mut step, mut factor) = (SILENCE, SILENCE);
            for k in 0..TILE.min(layout.samples - tile * TILE) {
                let (turns, shared, magnitude) = finish.at(i, tile * TILE + k);
                let z = Complex64::cis(TAU * turns);
                let f = magnitude * Complex64::cis(TAU * (shared - shared.round()));
                (step.re[k], step.im[k]) = (z.re as f32, z.im as f32);
                (factor.re[k], factor.im[k]) = (f.re as f32, f.im as f32);
            }
            (step, factor)
        });
        let (step, factor) = made.unzip();
        Table { lines: layout.lines, middle: layout.middle_line(), tiles, step, factor }
    }
}

/// What to do with a sum.
pub struct Out {
    /// Whether samples are real or complex.
    pub sampling: Sampling,
    /// Whether the sums are added to what is there.
    pub add: bool,
}

/// Adds up the lines at each sample of a block of chirps of one channel: two polynomials in
/// e^{±2πj t Δ}, from the outermost lines to the middle.
pub struct Lines<'a, 'r> {
    /// Factors of each sample.
    pub table: &'a Table,
    /// Lines of the block as tiles.
    pub tiles: &'a [Tile],
    /// What to do with a sum.
    pub out: Out,
    /// Rows of the cube that the block covers, one a chirp.
    pub rows: &'a mut [&'r mut [Complex32]],
}

/// sum z + h, with z or its conjugate.
#[inline(always)]
fn horner<const FMA: bool, const CONJUGATE: bool>(sum: &mut Tile, z: &Tile, h: &Tile) {
    for i in 0..TILE {
        let (x, y, c) = (sum.re[i], sum.im[i], z.re[i]);
        let s = if CONJUGATE { -z.im[i] } else { z.im[i] };
        sum.re[i] = madd::<FMA>(-y, s, madd::<FMA>(x, c, h.re[i]));
        sum.im[i] = madd::<FMA>(x, s, madd::<FMA>(y, c, h.im[i]));
    }
}

/// The same twice.
#[inline(always)]
fn horner2<const FMA: bool, const CONJUGATE: bool>(sum: &mut Tile, z: &Tile, h: &Tile, g: &Tile) {
    for i in 0..TILE {
        let (x, y, c) = (sum.re[i], sum.im[i], z.re[i]);
        let s = if CONJUGATE { -z.im[i] } else { z.im[i] };
        let u = madd::<FMA>(-y, s, madd::<FMA>(x, c, h.re[i]));
        let v = madd::<FMA>(x, s, madd::<FMA>(y, c, h.im[i]));
        sum.re[i] = madd::<FMA>(-v, s, madd::<FMA>(u, c, g.re[i]));
        sum.im[i] = madd::<FMA>(u, s, madd::<FMA>(v, c, g.im[i]));
    }
}

impl Vectorised for Lines<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<const FMA: bool>(self) {
        let Lines { table, tiles, out, rows } = self;
        for (tile, h) in tiles.chunks_exact(table.lines).enumerate() {
            let (below, above) = h.split_at(table.middle);
            for (i, row) in rows.iter_mut().enumerate() {
                let at = i * table.tiles + tile;
                let z = &table.step[at];
                // Above the middle line and on it.
                let mut upper = SILENCE;
                let (odd, pairs) = above.as_rchunks::<2>();
                for [g, h] in pairs.iter().rev() {
                    horner2::<FMA, false>(&mut upper, z, h, g);
                }
                for h in odd {
                    horner::<FMA, false>(&mut upper, z, h);
                }
                // Below it, down to −1, and then one step more.
                let mut lower = SILENCE;
                let (pairs, odd) = below.as_chunks::<2>();
                for [h, g] in pairs {
                    horner2::<FMA, true>(&mut lower, z, h, g);
                }
                for h in odd {
                    horner::<FMA, true>(&mut lower, z, h);
                }
                horner::<FMA, true>(&mut lower, z, &upper);
                horner::<FMA, false>(&mut lower, &table.factor[at], &SILENCE);
                let from = tile * TILE;
                let end = row.len().min(from + TILE);
                out.write(&mut row[from..end], &lower);
            }
        }
    }
}

impl Out {
    #[inline(always)]
    fn write(&self, row: &mut [Complex32], sum: &Tile) {
        let real = self.sampling == Sampling::Real;
        for (i, to) in row.iter_mut().enumerate() {
            let mut z = Complex::new(sum.re[i], sum.im[i]);
            if real {
                z = Complex::new(std::f32::consts::SQRT_2 * z.re, 0.0);
            }
            if self.add {
                z = Complex::new(to.re + z.re, to.im + z.im);
            }
            *to = z;
        }
    }
}
