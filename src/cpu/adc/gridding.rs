//! Synthesis by gridding on the processor (CONVENTIONS eq. 80-84). Echoes are spread in their own
//! order by one thread for each block and channel, so the same bytes come out whatever the number of
//! threads.

use super::synthesis::{Control, LANES, cis, fixed, madd, synthesise_sets};
use crate::adc::Cube;
use crate::adc::gridding::{Costs, DEGREE, Echoes, Layout, Methods, TAPS, portions};
use crate::adc::synthesis::{Plan, Set};
use crate::cpu::simd::{Vectorised, vectorised};
use crate::error::{Error, Result};
use crate::scene::radar::Sampling;
use num_complex::{Complex, Complex32, Complex64};
use rayon::prelude::*;
use rustfft::{Fft, FftPlanner};
use std::f64::consts::TAU;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Measured with AVX2, ns of one core.
pub const COSTS: Costs = Costs {
    direct: 0.31,
    spread: [12.0, 32.0],
    transform: 0.27,
    line: 0.27,
    sample: 2.0,
    table: 120.0,
    power_of_two: false,
    longest: usize::MAX,
    lines: 1024,
};

/// Echoes that are spread by one task when all go into one chirp.
const STILL_PART: usize = 4096;
/// Echoes whose places are worked out together.
const GROUP: usize = 64;
/// Cells before and behind a line, which belong to its other end.
const PAD: usize = TAPS / 2;

/// The cube of one frame without noise, √W, and how it was made: each set of echoes by gridding
/// where that is cheaper than the direct sum and accurate. Errors only when cancelled.
pub fn synthesise(plan: &Plan, control: Control) -> Result<(Cube<f32>, Methods)> {
    synthesise_with(plan, &COSTS, control)
}

/// The same with given costs, by which tests force one method or another.
pub fn synthesise_with(plan: &Plan, costs: &Costs, control: Control) -> Result<(Cube<f32>, Methods)> {
    let cancelled = || control.cancel.is_some_and(|c| c.load(Ordering::Relaxed));
    let stop = || Error::Failed("synthesis was cancelled".into());
    let still = still_rows(plan, costs, &cancelled);
    let mut methods = Methods::default();
    if let Some((_, layout)) = &still {
        methods.still = layout.method();
    }
    // Layouts first: one portion that is summed directly means that all are.
    let mut moving = Vec::new();
    let portions: Vec<&[u32]> = portions(plan, Set::Moving).collect();
    for portion in &portions {
        let echoes = Echoes::new(plan, portion, 0..plan.channels);
        let Some(layout) = Layout::choose(plan, &echoes, costs) else {
            moving.clear();
            break;
        };
        // Coefficients are kept where there is one portion, and made again where there are more.
        moving.push((layout, (portions.len() == 1).then_some(echoes)));
    }
    let worst = moving.iter().map(|(l, _)| l).max_by(|a, b| a.error.total_cmp(&b.error));
    if let Some(layout) = worst {
        methods.moving = layout.method();
    }
    let mut directly = Vec::new();
    if still.is_none() && !plan.set(Set::Still).is_empty() {
        directly.push(Set::Still);
    }
    if moving.is_empty() && !portions.is_empty() {
        directly.push(Set::Moving);
    }
    let (chirps, channels, samples) = (plan.chirps, plan.channels, plan.samples);
    let total = (chirps * channels) as u64;
    let mut cube = if directly.is_empty() {
        Cube::zeros(chirps, channels, samples)
    } else {
        let quiet = Control { progress: if moving.is_empty() { control.progress } else { None }, ..control };
        synthesise_sets::<f32>(plan, &directly, quiet)?
    };
    let done = AtomicU64::new(0);
    for (i, (layout, echoes)) in moving.iter().enumerate() {
        let made;
        let echoes = match echoes {
            Some(echoes) => echoes,
            None => {
                made = Echoes::new(plan, portions[i], 0..channels);
                &made
            }
        };
        let base = still.as_ref().filter(|_| i == 0).map(|(rows, _)| &rows[..]);
        let last = i + 1 == moving.len();
        let rows_done = |rows: usize| {
            if let (true, Some(progress)) = (last, control.progress) {
                progress(done.fetch_add(rows as u64, Ordering::Relaxed) + rows as u64, total);
            }
        };
        add_moving(plan.sampling, layout, echoes, base, &mut cube, &cancelled, &rows_done);
    }
    if let (true, Some((rows, _))) = (moving.is_empty(), &still) {
        let add = !directly.is_empty();
        cube.data.par_chunks_mut((channels * samples).max(1)).for_each(|chirp| {
            if !add {
                chirp.copy_from_slice(rows);
                return;
            }
            for (z, s) in chirp.iter_mut().zip(rows) {
                *z += s;
            }
        });
        if let (false, Some(progress)) = (add, control.progress) {
            progress(total, total);
        }
    }
    if cancelled() { Err(stop()) } else { Ok((cube, methods)) }
}

/// One chirp of each channel, `[channel, sample]`, of the echoes that do not change from chirp to
/// chirp, if gridding them pays and is accurate.
fn still_rows(
    plan: &Plan,
    costs: &Costs,
    cancelled: &(dyn Fn() -> bool + Sync),
) -> Option<(Vec<Complex32>, Layout)> {
    let (set, samples, channels) = (plan.set(Set::Still), plan.samples, plan.channels);
    if set.is_empty() || samples == 0 || channels == 0 || !Layout::still_pays(set.len(), samples, costs) {
        return None;
    }
    let layout = Layout::still(samples, costs);
    let width = layout.cells + 2 * PAD;
    let half = 0.5 * samples as f64;
    let drifts = AtomicU64::new(0);
    let parts = set.len().div_ceil(STILL_PART);
    let mut grids = vec![Complex32::ZERO; channels * width];
    // A bounded number of grids at a time.
    for some in (0..parts).collect::<Vec<_>>().chunks(64) {
        let made: Vec<Vec<Complex32>> = (0..channels * some.len())
            .into_par_iter()
            .map(|task| {
                let (channel, part) = (task / some.len(), some[task % some.len()]);
                let mut grid = vec![Complex32::ZERO; width];
                if cancelled() {
                    return grid;
                }
                let indices = &set[part * STILL_PART..((part + 1) * STILL_PART).min(set.len())];
                let echoes = Echoes::new(plan, indices, channel..channel + 1);
                let drift = echoes.c.iter().map(|c| c.abs()).fold(0.0, f64::max);
                drifts.fetch_max((TAU * drift * half * half).to_bits(), Ordering::Relaxed);
                spread(&layout, &echoes, 0, 0.0, &mut grid);
                grid
            })
            .collect();
        for (task, grid) in made.iter().enumerate() {
            let to = &mut grids[task / some.len() * width..][..width];
            to.iter_mut().zip(grid).for_each(|(a, b)| *a += b);
        }
    }
    // The bits of positive numbers are ordered as they are.
    if f64::from_bits(drifts.into_inner()) > layout.error {
        return None;
    }
    let table = Table::new(&layout);
    let fft = FftPlanner::new().plan_fft_inverse(layout.cells);
    let mut rows = vec![Complex32::ZERO; channels * samples];
    rows.par_chunks_mut(samples).zip(grids.par_chunks_mut(width)).for_each(|(row, grid)| {
        let mut scratch = Scratch::new(&layout, &fft);
        transform(&layout, &*fft, grid, &mut scratch);
        let out = Out { sampling: plan.sampling, base: None, add: false };
        vectorised(Lines { table: &table, tiles: &scratch.tiles, out, rows: &mut [row] });
    });
    Some((rows, layout))
}

/// Adds the echoes of a layout to the cube, or writes them over it where there is a `base` (one chirp
/// of each channel), which is then added.
fn add_moving(
    sampling: Sampling,
    layout: &Layout,
    echoes: &Echoes,
    base: Option<&[Complex32]>,
    cube: &mut Cube<f32>,
    cancelled: &(dyn Fn() -> bool + Sync),
    rows_done: &(dyn Fn(usize) + Sync),
) {
    let (channels, samples) = (cube.channels, cube.samples);
    let table = Table::new(layout);
    let fft = FftPlanner::new().plan_fft_inverse(layout.cells);
    let mut tasks: Vec<Vec<&mut [Complex32]>> =
        (0..layout.blocks() * channels).map(|_| Vec::with_capacity(layout.block)).collect();
    for (i, row) in cube.data.chunks_mut(samples).enumerate() {
        tasks[i / channels / layout.block * channels + i % channels].push(row);
    }
    let width = layout.cells + 2 * PAD;
    tasks.into_par_iter().enumerate().for_each_init(
        || (vec![Complex32::ZERO; layout.lines * width], Scratch::new(layout, &fft)),
        |(grid, scratch), (task, mut rows)| {
            if cancelled() {
                return;
            }
            let (block, channel) = (task / channels, task % channels);
            grid.fill(Complex32::ZERO);
            spread(layout, echoes, channel, layout.middle(block), grid);
            transform(layout, &*fft, grid, scratch);
            let base = base.map(|b| &b[channel * samples..][..samples]);
            let out = Out { sampling, base, add: true };
            vectorised(Lines { table: &table, tiles: &scratch.tiles, out, rows: &mut rows });
            rows_done(rows.len());
        },
    );
}

/// Spreads the echoes of one channel over the grid, lines of cells with [`PAD`] on either side, as seen
/// from chirp `middle`.
fn spread(layout: &Layout, echoes: &Echoes, channel: usize, middle: f64, grid: &mut [Complex32]) {
    let of = channel * echoes.count..(channel + 1) * echoes.count;
    vectorised(Spread { layout, echoes, of, middle, grid: bytemuck::cast_slice_mut(grid) });
    let cells = layout.cells;
    for line in grid.chunks_exact_mut(cells + 2 * PAD) {
        for k in 0..PAD {
            let (before, behind) = (line[k], line[cells + PAD + k]);
            line[cells + k] += before;
            line[PAD + k] += behind;
        }
    }
}

struct Spread<'a> {
    layout: &'a Layout,
    echoes: &'a Echoes,
    of: Range<usize>,
    middle: f64,
    grid: &'a mut [f32],
}

/// Weights of a group of echoes, tap after tap, from the distance of each echo's first tap in cells.
/// Loops run over all taps of the group, which suits vectors.
#[inline(always)]
fn weigh<const FMA: bool>(bell: &[f32; DEGREE + 1], first: &[f32; GROUP], weights: &mut Weights) {
    for (w, first) in weights.0.as_chunks_mut::<TAPS>().0.iter_mut().zip(first) {
        for (i, w) in w.iter_mut().enumerate() {
            *w = first + i as f32;
        }
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
        let mut phase = [0u32; GROUP];
        let (mut cell, mut line) = ([0i32; GROUP], [0i32; GROUP]);
        let (mut first_cell, mut first_line) = ([0f32; GROUP], [0f32; GROUP]);
        let (mut w, mut u) = (Weights([0.0; GROUP * TAPS]), Weights([0.0; GROUP * TAPS]));
        for start in self.of.clone().step_by(GROUP) {
            let count = GROUP.min(self.of.end - start);
            let at = start..start + count;
            let (a0, a1, a2) = (&e.a0[at.clone()], &e.a1[at.clone()], &e.a2[at.clone()]);
            let (b0, b1) = (&e.b0[at.clone()], &e.b1[at.clone()]);
            for i in 0..count {
                phase[i] = fixed(a0[i] + m * (a1[i] + m * a2[i]));
                let b = b0[i] + m * b1[i];
                let place = (b - b.floor()) * cells;
                let first = (place - half).ceil();
                cell[i] = integer(first + half);
                first_cell[i] = (first - place) as f32;
            }
            weigh::<FMA>(&layout.cell_bell.polynomial, &first_cell, &mut w);
            if many {
                for i in 0..count {
                    let place = (a1[i] + 2.0 * m * a2[i] - layout.first_line) * per_step;
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
                    for (x, w) in x.as_chunks_mut::<2>().0.iter_mut().zip(&w.0[i * TAPS..]) {
                        *x = [re * w, im * w];
                    }
                    let from = 2 * cell[i] as usize;
                    if !many {
                        for (to, x) in self.grid[from..from + 2 * TAPS].iter_mut().zip(&x) {
                            *to += x;
                        }
                        continue;
                    }
                    let first = line[i] as usize;
                    let lines = self.grid[first * width..(first + TAPS) * width].chunks_exact_mut(width);
                    for (line, u) in lines.zip(&u.0[i * TAPS..]) {
                        for (to, x) in line[from..from + 2 * TAPS].iter_mut().zip(&x) {
                            *to = madd::<FMA>(*u, *x, *to);
                        }
                    }
                }
            }
        }
    }
}

/// Samples whose lines are added up together.
const TILE: usize = 64;

/// Real and imaginary parts of a tile.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Tile {
    re: [f32; TILE],
    im: [f32; TILE],
}

const SILENCE: Tile = Tile { re: [0.0; TILE], im: [0.0; TILE] };

/// Buffers of one thread.
struct Scratch {
    fft: Vec<Complex32>,
    samples: Vec<Complex32>,
    /// `[tile, line]`.
    tiles: Vec<Tile>,
}

impl Scratch {
    fn new(layout: &Layout, fft: &Arc<dyn Fft<f32>>) -> Scratch {
        let tiles = layout.samples.div_ceil(TILE);
        Scratch {
            fft: vec![Complex32::ZERO; fft.get_inplace_scratch_len()],
            samples: vec![Complex32::ZERO; tiles * TILE],
            tiles: vec![SILENCE; tiles * layout.lines],
        }
    }
}

/// Each line from cells to samples. Lines that nothing was spread on stay zero.
fn transform(layout: &Layout, fft: &dyn Fft<f32>, grid: &mut [Complex32], scratch: &mut Scratch) {
    let (cells, samples, lines) = (layout.cells, layout.samples, layout.lines);
    // Samples are counted from the middle of the ramp, negative ones stand at the end.
    let before = samples / 2;
    for (l, line) in grid.chunks_exact_mut(cells + 2 * PAD).enumerate() {
        let line = &mut line[PAD..PAD + cells];
        if line.iter().any(|z| *z != Complex32::ZERO) {
            fft.process_with_scratch(line, &mut scratch.fft);
        }
        scratch.samples[..before].copy_from_slice(&line[cells - before..]);
        scratch.samples[before..samples].copy_from_slice(&line[..samples - before]);
        let tiles = scratch.tiles.iter_mut().skip(l).step_by(lines);
        for (tile, values) in tiles.zip(scratch.samples.as_chunks::<TILE>().0) {
            for i in 0..TILE {
                (tile.re[i], tile.im[i]) = (values[i].re, values[i].im);
            }
        }
    }
}

/// What is the same for all blocks and channels, `[chirp of a block, tile]`.
struct Table {
    lines: usize,
    middle: usize,
    tiles: usize,
    /// e^{2πj t Δ} of eq. 84.
    step: Vec<Tile>,
    factor: Vec<Tile>,
}

impl Table {
    fn new(layout: &Layout) -> Table {
        let tiles = layout.samples.div_ceil(TILE);
        let finish = layout.finish();
        let made = (0..layout.block * tiles).into_par_iter().map(|at| {
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

struct Out<'a> {
    sampling: Sampling,
    base: Option<&'a [Complex32]>,
    add: bool,
}

/// Adds up the lines at each sample of a block of chirps of one channel: two polynomials in
/// e^{±2πj t Δ}, from the outermost lines to the middle.
struct Lines<'a, 'r> {
    table: &'a Table,
    tiles: &'a [Tile],
    out: Out<'a>,
    rows: &'a mut [&'r mut [Complex32]],
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
                out.write(&mut row[from..end], from, &lower);
            }
        }
    }
}

impl Out<'_> {
    #[inline(always)]
    fn write(&self, row: &mut [Complex32], from: usize, sum: &Tile) {
        let real = self.sampling == Sampling::Real;
        for (i, to) in row.iter_mut().enumerate() {
            let mut z = Complex::new(sum.re[i], sum.im[i]);
            if real {
                z = Complex::new(std::f32::consts::SQRT_2 * z.re, 0.0);
            }
            if let Some(base) = self.base {
                z += base[from + i];
            }
            *to = if self.add { *to + z } else { z };
        }
    }
}
