//! Synthesis by gridding on the processor (CONVENTIONS eq. 80-84). Echoes are spread in their own
//! order by one thread for each block and channel, so the same bytes come out whatever the number of
//! threads.

use super::grid_fft::{Scratch, transform};
use super::grid_lines::{Lines, Out, Table};
use super::grid_spread::{PAD, spread};
use super::synthesis::synthesise_some;
use crate::adc::Cube;
use crate::adc::grid_echoes::GridEchoes;
use crate::adc::gridding::{Costs, ECHOES_KEPT, GridLayout};
use crate::adc::methods::{Method, Methods};
use crate::adc::schedule::Schedule;
use crate::adc::synthesis::{Plan, Set};
use crate::base::control::Control;
use crate::base::error::{Error, Result};
use crate::base::simd::{self, vectorised};
use crate::base::tasks::Tasks;
use crate::scene::radar::Sampling;
use num_complex::Complex32;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

/// What the work costs with the instructions that this machine has: constants, so that the same frame is summed the same way
/// whatever else the machine does.
pub fn costs() -> &'static Costs {
    match simd::level() {
        "avx512" => &COSTS_AVX512,
        _ => &COSTS,
    }
}

/// Measured with AVX-512, ns of one core.
const COSTS_AVX512: Costs =
    Costs { direct: 0.2, spread: [5.0, 11.0], transform: 0.1, line: 0.07, sample: 3.5, table: 60.0, ..COSTS };

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
    largest_grid: usize::MAX,
};

/// Echoes that are spread by one task when all go into one chirp: what a second-level cache holds.
const STILL_PART: usize = 1024;

/// The cube of one frame without noise, √W, and how it was made: each set of echoes by gridding where that is cheaper
/// than the direct sum and accurate.
///
/// # Errors
/// Returns an error only if `control` is cancelled.
pub fn synthesise(plan: &Plan, control: Control) -> Result<(Cube<f32>, Methods)> {
    synthesise_with(plan, costs(), control)
}

/// Synthesises as [`synthesise`] with given costs, by which tests force one method or another.
///
/// # Errors
/// Returns an error if `control` is cancelled.
pub fn synthesise_with(plan: &Plan, costs: &Costs, control: Control) -> Result<(Cube<f32>, Methods)> {
    let cancelled = || control.cancel.is_some_and(|c| c.load(Ordering::Relaxed));
    let still = still_rows(plan, costs, &cancelled);
    let schedule = Schedule::new(plan, costs);
    let methods = Methods {
        still: still.as_ref().map_or(Method::Direct, |(_, layout)| Method::Gridded(layout.gridded(0.0))),
        moving: schedule.method(),
    };
    let still_directly = if still.is_none() { plan.set(Set::Still) } else { &[] };
    let (chirps, channels, samples) = (plan.chirps, plan.channels, plan.samples);
    let total = (chirps * channels) as u64;
    let mut cube = if schedule.directly.is_empty() && still_directly.is_empty() {
        Cube::zeros(chirps, channels, samples)
    } else {
        let last = schedule.grids.is_empty();
        let quiet = Control { progress: if last { control.progress } else { None }, ..control };
        synthesise_some::<f32>(plan, still_directly, &schedule.directly, quiet)?
    };
    if let Some((rows, _)) = &still {
        cube.data.par_chunks_mut((channels * samples).max(1)).for_each_tasks(|chirp| add_slices(rows, chirp));
        if let (true, Some(progress)) = (schedule.grids.is_empty(), control.progress) {
            progress(total, total);
        }
    }
    let done = AtomicU64::new(0);
    for (i, (indices, layout)) in schedule.grids.iter().enumerate() {
        let last = i + 1 == schedule.grids.len();
        for (k, some) in indices.chunks(ECHOES_KEPT).enumerate() {
            let last = last && (k + 1) * ECHOES_KEPT >= indices.len();
            let rows_done = |rows: usize| {
                if let (true, Some(progress)) = (last, control.progress) {
                    progress(done.fetch_add(rows as u64, Ordering::Relaxed) + rows as u64, total);
                }
            };
            let together = (ECHOES_KEPT / some.len()).max(1);
            for run in plan.channels_by_code() {
                let layout = &layout.turned(plan.code_turns(run.start));
                let table = Table::new(layout);
                for first in run.clone().step_by(together) {
                    let channels = first..(first + together).min(run.end);
                    let echoes = GridEchoes::new(plan, some, channels.clone());
                    let work = Work { sampling: plan.sampling, layout, table: &table, echoes: &echoes };
                    work.add(first, &mut cube, &cancelled, &rows_done);
                }
            }
        }
    }
    if cancelled() { Err(Error::Failed("synthesis was cancelled".into())) } else { Ok((cube, methods)) }
}

/// Adds one row to another, as real numbers.
fn add_slices(some: &[Complex32], to: &mut [Complex32]) {
    let (some, to): (&[f32], &mut [f32]) = (bytemuck::cast_slice(some), bytemuck::cast_slice_mut(to));
    to.iter_mut().zip(some).for_each(|(sum, x)| *sum += x);
}

/// One chirp of each channel, `[channel, sample]`, of the echoes that do not change from chirp to
/// chirp, if gridding them pays and is accurate.
fn still_rows(
    plan: &Plan,
    costs: &Costs,
    cancelled: &(dyn Fn() -> bool + Sync),
) -> Option<(Vec<Complex32>, GridLayout)> {
    let (set, samples, channels) = (plan.set(Set::Still), plan.samples, plan.channels);
    if set.is_empty() || samples == 0 || channels == 0 || !GridLayout::still_pays(set.len(), samples, costs) {
        return None;
    }
    let layout = GridLayout::still(samples, costs);
    let width = layout.cells + 2 * PAD;
    let mut grids = vec![Complex32::ZERO; channels * width];
    // A bounded number of grids at a time. A part goes into all channels while it is in the cache.
    for some in set.chunks(64 * STILL_PART) {
        let made: Vec<Vec<Complex32>> = some
            .par_chunks(STILL_PART)
            .map_tasks(|indices| {
                let mut part = vec![Complex32::ZERO; channels * width];
                for (channel, grid) in part.chunks_exact_mut(width).enumerate() {
                    if cancelled() {
                        break;
                    }
                    let echoes = GridEchoes::new(plan, indices, channel..channel + 1);
                    spread(&layout, &echoes, &layout.portions(&echoes), 0, 0.0, grid);
                }
                part
            })
            .collect();
        for part in made {
            add_slices(&part, &mut grids);
        }
    }
    let table = Table::new(&layout);
    let fft = catseye_math::fft::inverse(layout.cells);
    let mut rows = vec![Complex32::ZERO; channels * samples];
    rows.par_chunks_mut(samples).zip(grids.par_chunks_mut(width)).for_each_tasks(|(row, grid)| {
        let mut scratch = Scratch::new(&layout, &fft);
        transform(&layout, &*fft, grid, &mut scratch);
        let out = Out { sampling: plan.sampling, add: false };
        vectorised(Lines { table: &table, tiles: &scratch.tiles, out, rows: &mut [row] });
    });
    Some((rows, layout))
}

/// Adds echoes to a cube of the layout's size and their channels: the part of
/// [`synthesise`] that knows no radar.
pub fn add(sampling: Sampling, layout: &GridLayout, echoes: &GridEchoes, cube: &mut Cube<f32>) {
    let work = Work { sampling, layout, table: &Table::new(layout), echoes };
    work.add(0, cube, &|| false, &|_| ());
}

/// Some echoes with their grid.
struct Work<'a> {
    sampling: Sampling,
    layout: &'a GridLayout,
    table: &'a Table,
    echoes: &'a GridEchoes,
}

impl Work<'_> {
    /// Adds them to the channels of the cube from `first` on.
    fn add(
        &self,
        first: usize,
        cube: &mut Cube<f32>,
        cancelled: &(dyn Fn() -> bool + Sync),
        rows_done: &(dyn Fn(usize) + Sync),
    ) {
        let Work { sampling, layout, table, echoes } = *self;
        let (all, samples, channels) = (cube.channels, cube.samples, echoes.channels);
        let fft = catseye_math::fft::inverse(layout.cells);
        let portions = layout.portions(echoes);
        let mut tasks: Vec<Vec<&mut [Complex32]>> =
            (0..layout.blocks() * channels).map(|_| Vec::with_capacity(layout.block)).collect();
        for (chirp, rows) in cube.data.chunks_mut(all * samples).enumerate() {
            for (channel, row) in rows.chunks_mut(samples).skip(first).take(channels).enumerate() {
                tasks[chirp / layout.block * channels + channel].push(row);
            }
        }
        let width = layout.cells + 2 * PAD;
        tasks.into_par_iter().enumerate().for_each_init_tasks(
            || (vec![Complex32::ZERO; layout.lines * width], Scratch::new(layout, &fft)),
            |(grid, scratch), (task, mut rows)| {
                if cancelled() {
                    return;
                }
                let (block, channel) = (task / channels, task % channels);
                grid.fill(Complex32::ZERO);
                spread(layout, echoes, &portions, channel, layout.middle(block), grid);
                transform(layout, &*fft, grid, scratch);
                let out = Out { sampling, add: true };
                vectorised(Lines { table, tiles: &scratch.tiles, out, rows: &mut rows });
                rows_done(rows.len());
            },
        );
    }
}
