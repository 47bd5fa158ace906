//! Synthesis by gridding on the processor (CONVENTIONS eq. 80-84). Echoes are spread in their own
//! order by one thread for each block and channel, so the same bytes come out whatever the number of
//! threads.

use super::synthesis::{Control, LANES, cis, fixed, madd, synthesise_sets, v};
use crate::adc::Cube;
use crate::adc::gridding::{Bell, Costs, DEGREE, Echoes, Layout, Methods, TAPS, portions};
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
    spread: [14.0, 26.0],
    transform: 0.42,
    line: 0.25,
    sample: 2.0,
    table: 60.0,
    power_of_two: false,
    longest: usize::MAX,
    lines: 1024,
};

/// Echoes that are spread by one task when all go into one chirp.
const STILL_PART: usize = 4096;
/// Echoes whose places are worked out together.
const GROUP: usize = 64;
/// Chirps whose sums over lines go on together: as many as the registers hold.
const SIDE_BY_SIDE: usize = 4;
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

#[inline(always)]
fn weights<const FMA: bool>(bell: &Bell, first: f32) -> [f32; TAPS] {
    let s: [f32; TAPS] = std::array::from_fn(|i| {
        let d = (first + i as f32) * (2.0 / TAPS as f32);
        // The outermost distance may round beyond the edge.
        madd::<FMA>(-d, d, 1.0).max(0.0)
    });
    let mut sum = [bell.polynomial[DEGREE]; TAPS];
    for k in (0..DEGREE).rev() {
        sum = std::array::from_fn(|i| madd::<FMA>(sum[i], s[i], bell.polynomial[k]));
    }
    sum
}

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
        let (cell_bell, line_bell) = (layout.cell_bell.clone(), layout.line_bell.clone());
        for start in self.of.clone().step_by(GROUP) {
            let count = GROUP.min(self.of.end - start);
            let mut phase = [0u32; GROUP];
            let (mut cell, mut line) = ([0u32; GROUP], [0u32; GROUP]);
            let (mut first_cell, mut first_line) = ([0f32; GROUP], [0f32; GROUP]);
            let at = start..start + count;
            let (a0, a1, a2) = (&e.a0[at.clone()], &e.a1[at.clone()], &e.a2[at.clone()]);
            let (b0, b1) = (&e.b0[at.clone()], &e.b1[at.clone()]);
            for i in 0..count {
                let turns = a0[i] + m * (a1[i] + m * a2[i]);
                phase[i] = fixed(turns - turns.round());
                let b = b0[i] + m * b1[i];
                let place = (b - b.floor()) * cells;
                let first = (place - half).ceil();
                cell[i] = (first + half) as i32 as u32;
                first_cell[i] = (first - place) as f32;
                let place = (a1[i] + 2.0 * m * a2[i] - layout.first_line) * per_step;
                let first = (place - half).ceil();
                line[i] = first as i32 as u32;
                first_line[i] = (first - place) as f32;
            }
            for group in (0..count).step_by(LANES) {
                let turned: [u32; LANES] = std::array::from_fn(|l| phase[group + l]);
                let (c, s) = cis::<FMA>(&turned);
                for l in 0..LANES.min(count - group) {
                    let i = group + l;
                    let a = e.amplitude[start + i];
                    let (re, im) = (a.re * c[l] - a.im * s[l], a.re * s[l] + a.im * c[l]);
                    let w = weights::<FMA>(&cell_bell, first_cell[i]);
                    let x: [f32; 2 * TAPS] =
                        std::array::from_fn(|k| w[k / 2] * if k % 2 == 0 { re } else { im });
                    let from = 2 * cell[i] as usize;
                    if !many {
                        let to = &mut self.grid[from..from + 2 * TAPS];
                        for k in 0..2 * TAPS {
                            to[k] += x[k];
                        }
                        continue;
                    }
                    let u = weights::<FMA>(&line_bell, first_line[i]);
                    for (j, u) in u.iter().enumerate() {
                        let to = &mut self.grid[(line[i] as usize + j) * width + from..][..2 * TAPS];
                        for k in 0..2 * TAPS {
                            to[k] = madd::<FMA>(*u, x[k], to[k]);
                        }
                    }
                }
            }
        }
    }
}

/// Buffers of one thread.
struct Scratch {
    fft: Vec<Complex32>,
    /// `[eight samples, line, (re, im), sample]`.
    tiles: Vec<[[f32; LANES]; 2]>,
}

impl Scratch {
    fn new(layout: &Layout, fft: &Arc<dyn Fft<f32>>) -> Scratch {
        let tiles = layout.samples.div_ceil(LANES) * layout.lines;
        Scratch {
            fft: vec![Complex32::ZERO; fft.get_inplace_scratch_len()],
            tiles: vec![[[0.0; LANES]; 2]; tiles],
        }
    }
}

/// Each line from cells to samples. Lines that nothing was spread on stay zero.
fn transform(layout: &Layout, fft: &dyn Fft<f32>, grid: &mut [Complex32], scratch: &mut Scratch) {
    let (cells, samples, lines) = (layout.cells, layout.samples, layout.lines);
    for (l, line) in grid.chunks_exact_mut(cells + 2 * PAD).enumerate() {
        let line = &mut line[PAD..PAD + cells];
        if line.iter().any(|z| *z != Complex32::ZERO) {
            fft.process_with_scratch(line, &mut scratch.fft);
        }
        // Samples are counted from the middle of the ramp, negative ones stand at the end.
        let before = samples / 2;
        let (head, tail) = (&line[cells - before..], &line[..samples - before]);
        let mut values = head.iter().chain(tail);
        for tile in scratch.tiles.iter_mut().skip(l).step_by(lines) {
            for i in 0..LANES {
                let z = values.next().copied().unwrap_or_default();
                (tile[0][i], tile[1][i]) = (z.re, z.im);
            }
        }
    }
}

/// What is the same for all blocks and channels, `[chirp of a block, eight samples]`.
struct Table {
    lines: usize,
    middle: usize,
    tiles: usize,
    /// e^{2πj t Δ} of eq. 84.
    step: Vec<[[f32; LANES]; 2]>,
    factor: Vec<[[f32; LANES]; 2]>,
}

impl Table {
    fn new(layout: &Layout) -> Table {
        let tiles = layout.samples.div_ceil(LANES);
        let made = (0..layout.block * tiles).into_par_iter().with_min_len(64).map(|at| {
            let (i, tile) = (at / tiles, at % tiles);
            let (mut step, mut factor) = ([[0.0; LANES]; 2], [[0.0; LANES]; 2]);
            for k in 0..LANES {
                let (turns, shared, magnitude) = layout.finish(i, (tile * LANES + k).min(layout.samples - 1));
                let z = Complex64::cis(TAU * turns);
                let f = magnitude * Complex64::cis(TAU * (shared - shared.round()));
                (step[0][k], step[1][k]) = (z.re as f32, z.im as f32);
                (factor[0][k], factor[1][k]) = (f.re as f32, f.im as f32);
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
/// e^{±2πj t Δ}, from the middle line outwards.
struct Lines<'a, 'r> {
    table: &'a Table,
    tiles: &'a [[[f32; LANES]; 2]],
    out: Out<'a>,
    rows: &'a mut [&'r mut [Complex32]],
}

impl Vectorised for Lines<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<const FMA: bool>(self) {
        let Lines { table, tiles, out, rows } = self;
        for (tile, h) in tiles.chunks_exact(table.lines).enumerate() {
            let (below, above) = h.split_at(table.middle);
            for (group, rows) in rows.chunks_mut(SIDE_BY_SIDE).enumerate() {
                let first = group * SIDE_BY_SIDE;
                let mut step = [[[0.0; LANES]; 2]; SIDE_BY_SIDE];
                for (k, s) in step.iter_mut().take(rows.len()).enumerate() {
                    *s = table.step[(first + k) * table.tiles + tile];
                }
                let (mut re, mut im) = ([[0.0f32; LANES]; SIDE_BY_SIDE], [[0.0f32; LANES]; SIDE_BY_SIDE]);
                // Σ h_l z̄^(middle − l), then one more z̄ is in the recurrence itself.
                for h in below {
                    for k in 0..SIDE_BY_SIDE {
                        let [c, s] = &step[k];
                        let (x, y) = (v(|i| re[k][i] + h[0][i]), v(|i| im[k][i] + h[1][i]));
                        re[k] = v(|i| madd::<FMA>(y[i], s[i], x[i] * c[i]));
                        im[k] = v(|i| madd::<FMA>(-x[i], s[i], y[i] * c[i]));
                    }
                }
                let (lower_re, lower_im) = (re, im);
                (re, im) = ([[0.0; LANES]; SIDE_BY_SIDE], [[0.0; LANES]; SIDE_BY_SIDE]);
                for h in above.iter().rev() {
                    for k in 0..SIDE_BY_SIDE {
                        let [c, s] = &step[k];
                        let (x, y) = (re[k], im[k]);
                        re[k] = v(|i| madd::<FMA>(-y[i], s[i], madd::<FMA>(x[i], c[i], h[0][i])));
                        im[k] = v(|i| madd::<FMA>(x[i], s[i], madd::<FMA>(y[i], c[i], h[1][i])));
                    }
                }
                for (k, row) in rows.iter_mut().enumerate() {
                    let [c, s] = &table.factor[(first + k) * table.tiles + tile];
                    let x = v(|i| re[k][i] + lower_re[k][i]);
                    let y = v(|i| im[k][i] + lower_im[k][i]);
                    let zr = v(|i| x[i] * c[i] - y[i] * s[i]);
                    let zi = v(|i| x[i] * s[i] + y[i] * c[i]);
                    let at = tile * LANES;
                    let end = row.len().min(at + LANES);
                    let real = out.sampling == Sampling::Real;
                    for (i, to) in row[at..end].iter_mut().enumerate() {
                        let mut z = Complex::new(zr[i], zi[i]);
                        if real {
                            z = Complex::new(std::f32::consts::SQRT_2 * zr[i], 0.0);
                        }
                        if let Some(base) = out.base {
                            z += base[at + i];
                        }
                        *to = if out.add { *to + z } else { z };
                    }
                }
            }
        }
    }
}
