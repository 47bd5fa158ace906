//! Synthesis by gridding on the processor (CONVENTIONS eq. 80-84). Echoes are spread in their own
//! order by one thread for each block and channel, so the same bytes come out whatever the number of
//! threads.

use super::grid_fft::{Scratch, transform};
use super::grid_lines::{Lines, Out, Table};
use super::grid_spread::{PAD, spread};
use super::synthesis::{Control, synthesise_some};
use crate::adc::Cube;
use crate::adc::gridding::{Costs, ECHOES_KEPT, GridEchoes, Layout, moving_portions};
use crate::adc::methods::Methods;
use crate::adc::synthesis::{Plan, Set};
use crate::error::{Error, Result};
use crate::scene::radar::Sampling;
use crate::simd::vectorised;
use num_complex::Complex32;
use rayon::prelude::*;
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
    largest_grid: usize::MAX,
};

/// Echoes that are spread by one task when all go into one chirp: what a second-level cache holds.
const STILL_PART: usize = 1024;

/// The cube of one frame without noise, √W, and how it was made: each set of echoes by gridding where that is cheaper
/// than the direct sum and accurate.
///
/// # Errors
/// Only when cancelled.
pub fn synthesise(plan: &Plan, control: Control) -> Result<(Cube<f32>, Methods)> {
    synthesise_with(plan, &COSTS, control)
}

/// The same with given costs, by which tests force one method or another.
///
/// # Errors
/// Interrupted, when `control` is cancelled.
pub fn synthesise_with(plan: &Plan, costs: &Costs, control: Control) -> Result<(Cube<f32>, Methods)> {
    let cancelled = || control.cancel.is_some_and(|c| c.load(Ordering::Relaxed));
    let stop = || Error::Failed("synthesis was cancelled".into());
    let still = still_rows(plan, costs, &cancelled);
    let mut methods = Methods::default();
    if let Some((_, layout)) = &still {
        methods.still = layout.method();
    }
    // Layouts first, so that what is summed directly is known.
    let (mut moving, mut directly) = (Vec::new(), Vec::new());
    let portions = moving_portions(plan, ECHOES_KEPT);
    let all = plan.set(Set::Moving).len();
    for portion in portions {
        let echoes = GridEchoes::new(plan, portion, 0..plan.channels);
        match Layout::choose(plan.chirps, plan.samples, &echoes, costs) {
            // Coefficients are kept where there are few in all, and made again where there are more.
            Some(layout) => {
                moving.push((layout, portion, (all * plan.channels <= ECHOES_KEPT).then_some(echoes)));
            }
            None => directly.extend_from_slice(portion),
        }
    }
    let worst = moving.iter().map(|(l, ..)| l).max_by(|a, b| a.error.total_cmp(&b.error));
    if let Some(layout) = worst {
        methods.moving = layout.method();
    }
    let still_directly = if still.is_none() { plan.set(Set::Still) } else { &[] };
    let nothing = directly.is_empty() && still_directly.is_empty();
    let (chirps, channels, samples) = (plan.chirps, plan.channels, plan.samples);
    let total = (chirps * channels) as u64;
    let mut cube = if nothing {
        Cube::zeros(chirps, channels, samples)
    } else {
        let quiet = Control { progress: if moving.is_empty() { control.progress } else { None }, ..control };
        synthesise_some::<f32>(plan, still_directly, &directly, quiet)?
    };
    let done = AtomicU64::new(0);
    for (i, (layout, portion, echoes)) in moving.iter().enumerate() {
        let made;
        let echoes = match echoes {
            Some(echoes) => echoes,
            None => {
                made = GridEchoes::new(plan, portion, 0..channels);
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
        let add = !nothing;
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
    let residuals = AtomicU64::new(0);
    let mut grids = vec![Complex32::ZERO; channels * width];
    // A bounded number of grids at a time. A part goes into all channels while it is in the cache.
    for some in set.chunks(64 * STILL_PART) {
        let made: Vec<Vec<Complex32>> = some
            .par_chunks(STILL_PART)
            .map(|indices| {
                let mut part = vec![Complex32::ZERO; channels * width];
                for (channel, grid) in part.chunks_exact_mut(width).enumerate() {
                    if cancelled() {
                        break;
                    }
                    let echoes = GridEchoes::new(plan, indices, channel..channel + 1);
                    let residual = Layout::still_residual(&echoes, samples);
                    residuals.fetch_max(residual.to_bits(), Ordering::Relaxed);
                    spread(&layout, &echoes, 0, 0.0, grid);
                }
                part
            })
            .collect();
        for part in made {
            grids.iter_mut().zip(part).for_each(|(a, b)| *a += b);
        }
    }
    // The bits of positive numbers are ordered as they are.
    if f64::from_bits(residuals.into_inner()) > layout.error {
        return None;
    }
    let table = Table::new(&layout);
    let fft = catseye_math::fft::inverse(layout.cells);
    let mut rows = vec![Complex32::ZERO; channels * samples];
    rows.par_chunks_mut(samples).zip(grids.par_chunks_mut(width)).for_each(|(row, grid)| {
        let mut scratch = Scratch::new(&layout, &fft);
        transform(&layout, &*fft, grid, &mut scratch);
        let out = Out { sampling: plan.sampling, base: None, add: false };
        vectorised(Lines { table: &table, tiles: &scratch.tiles, out, rows: &mut [row] });
    });
    Some((rows, layout))
}

/// Adds echoes to a cube of the layout's size: the part of
/// [`synthesise`] that knows no radar.
pub fn add(sampling: Sampling, layout: &Layout, echoes: &GridEchoes, cube: &mut Cube<f32>) {
    add_moving(sampling, layout, echoes, None, cube, &|| false, &|_| ());
}

fn add_moving(
    sampling: Sampling,
    layout: &Layout,
    echoes: &GridEchoes,
    base: Option<&[Complex32]>,
    cube: &mut Cube<f32>,
    cancelled: &(dyn Fn() -> bool + Sync),
    rows_done: &(dyn Fn(usize) + Sync),
) {
    let (channels, samples) = (cube.channels, cube.samples);
    let table = Table::new(layout);
    let fft = catseye_math::fft::inverse(layout.cells);
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
