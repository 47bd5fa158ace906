//! Spreads echoes over a grid of cells and lines (CONVENTIONS eq. 83).

use super::synthesis::{LANES, cis, fixed, madd};
use crate::adc::grid_echoes::GridEchoes;
use crate::adc::gridding::{DEGREE, GridLayout, TAPS};
use crate::base::simd::{Vectorised, vectorised};
use num_complex::Complex32;
use std::ops::Range;

/// Echoes whose places are worked out together.
const GROUP: usize = 64;
/// Cells before and behind a line, which belong to its other end.
pub const PAD: usize = TAPS / 2;

/// Spreads the echoes of one channel over the grid, lines of cells with [`PAD`] on either side, as seen
/// from chirp `middle`. Sums are put aside at the end of each of `portions` (`GridLayout::portions`).
pub fn spread(
    layout: &GridLayout,
    echoes: &GridEchoes,
    portions: &[usize],
    channel: usize,
    middle: f64,
    grid: &mut [Complex32],
) {
    let base = channel * echoes.count;
    let mut start = 0;
    let mut some = Vec::new();
    for (i, &end) in portions.iter().enumerate() {
        let of = base + start..base + end;
        start = end;
        if i == 0 {
            vectorised(Spread { layout, echoes, of, middle, grid: bytemuck::cast_slice_mut(grid) });
            continue;
        }
        some.clear();
        some.resize(2 * grid.len(), 0.0f32);
        vectorised(Spread { layout, echoes, of, middle, grid: &mut some });
        vectorised(Add { some: &some, to: bytemuck::cast_slice_mut(grid) });
    }
    let cells = layout.cells;
    for line in grid.chunks_exact_mut(cells + 2 * PAD) {
        for k in 0..PAD {
            let (before, behind) = (line[k], line[cells + PAD + k]);
            line[cells + k] += before;
            line[PAD + k] += behind;
        }
    }
}

/// Adds one grid to another. An operator on complex numbers may be compiled as a call for each.
struct Add<'a> {
    some: &'a [f32],
    to: &'a mut [f32],
}

impl Vectorised for Add<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FMA: bool>(self) {
        for (sum, x) in self.to.iter_mut().zip(self.some) {
            *sum += x;
        }
    }
}

struct Spread<'a> {
    layout: &'a GridLayout,
    echoes: &'a GridEchoes,
    of: Range<usize>,
    middle: f64,
    grid: &'a mut [f32],
}

/// Weights of a group of echoes, tap after tap, from the distance of each echo's first tap in cells.
/// Loops run over all taps of the group, which suits vectors.
#[inline(always)]
fn weigh<const FMA: bool>(bell: &[f32; DEGREE + 1], first: &[f32; GROUP], weights: &mut Weights) {
    for (i, w) in weights.0.iter_mut().enumerate() {
        *w = first[i / TAPS] + (i % TAPS) as f32;
    }
    for w in &mut weights.0 {
        let d = *w * (2.0 / TAPS as f32);
        // The outermost tap may round beyond the edge.
        let s = madd::<FMA>(-d, d, 1.0).max(0.0);
        let mut sum = bell[DEGREE];
        for k in (0..DEGREE).rev() {
            sum = madd::<FMA>(sum, s, bell[k]);
        }
        *w = sum;
    }
}

/// An integer below 2³¹ from its f64: vectors have no other way.
#[inline(always)]
fn integer(x: f64) -> i32 {
    (x + 6_755_399_441_055_744.0).to_bits() as i32
}

#[repr(align(64))]
struct Weights([f32; GROUP * TAPS]);

impl Vectorised for Spread<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FMA: bool>(self) {
        let (layout, e, m) = (self.layout, self.echoes, self.middle);
        let cells = layout.cells as f64;
        let width = 2 * (layout.cells + 2 * PAD);
        let many = layout.lines > 1;
        let per_step = if many { 1.0 / layout.line_step } else { 0.0 };
        let half = 0.5 * TAPS as f64;
        let level = layout.level();
        let (mut phase, mut rates) = ([0u32; GROUP], [0f64; GROUP]);
        let (mut cell, mut line) = ([0i32; GROUP], [0i32; GROUP]);
        let (mut first_cell, mut first_line) = ([0f32; GROUP], [0f32; GROUP]);
        let (mut w, mut u) = (Weights([0.0; GROUP * TAPS]), Weights([0.0; GROUP * TAPS]));
        for start in self.of.clone().step_by(GROUP) {
            let count = GROUP.min(self.of.end - start);
            let at = start..start + count;
            let (a0, a1, a2) = (&e.a0[at.clone()], &e.a1[at.clone()], &e.a2[at.clone()]);
            let (b0, b1) = (&e.b0[at.clone()], &e.b1[at.clone()]);
            let (a3, b2) = (&e.a3[at.clone()], &e.b2[at.clone()]);
            for i in 0..count {
                // What the warp does not follow of the bend and of the change of b0, without its mean and slope over the block.
                let rate = a1[i] + m * (2.0 * a2[i] + 3.0 * m * a3[i]);
                let bend = a2[i] + 3.0 * m * a3[i] - layout.warp.a2.at(rate);
                let mixed = b1[i] + 2.0 * m * b2[i] - layout.warp.b1.at(rate);
                rates[i] = rate + level.slope * bend;
                phase[i] = fixed(a0[i] + m * (a1[i] + m * (a2[i] + m * a3[i])) + level.mean * bend);
                let b = b0[i] + m * (b1[i] + m * b2[i]) + level.centre * mixed;
                let place = (b - b.floor()) * cells;
                let first = (place - half).ceil();
                cell[i] = integer(first + half);
                first_cell[i] = (first - place) as f32;
            }
            weigh::<FMA>(&layout.cell_bell.polynomial, &first_cell, &mut w);
            if many {
                for i in 0..count {
                    let place = (rates[i] - layout.first_line) * per_step;
                    let first = (place - half).ceil();
                    line[i] = integer(first);
                    first_line[i] = (first - place) as f32;
                }
                weigh::<FMA>(&layout.line_bell.polynomial, &first_line, &mut u);
            }
            for (group, phase) in phase.as_chunks::<LANES>().0.iter().enumerate().take(count.div_ceil(LANES))
            {
                let (c, s) = cis::<FMA>(phase);
                for l in 0..LANES.min(count - group * LANES) {
                    let i = group * LANES + l;
                    let a = e.amplitude[start + i];
                    let (re, im) = (a.re * c[l] - a.im * s[l], a.re * s[l] + a.im * c[l]);
                    let mut x = [0.0; 2 * TAPS];
                    let w = &w.0[i * TAPS..(i + 1) * TAPS];
                    for t in 0..TAPS {
                        (x[2 * t], x[2 * t + 1]) = (re * w[t], im * w[t]);
                    }
                    let from = 2 * cell[i] as usize;
                    if !many {
                        let to = &mut self.grid[from..from + 2 * TAPS];
                        for t in 0..2 * TAPS {
                            to[t] += x[t];
                        }
                        continue;
                    }
                    let first = line[i] as usize;
                    for (row, u) in u.0[i * TAPS..(i + 1) * TAPS].iter().enumerate() {
                        let from = (first + row) * width + from;
                        let to = &mut self.grid[from..from + 2 * TAPS];
                        for t in 0..2 * TAPS {
                            to[t] = madd::<FMA>(*u, x[t], to[t]);
                        }
                    }
                }
            }
        }
    }
}
