//! Gridded synthesis on the device: which echoes are gridded and how, and the passes in order.

use super::gridding::{Costs, ECHOES_KEPT, GridEchoes, Layout, moving_portions};
use super::methods::{Method, Methods};
use super::synthesis::{Plan, Set};
use super::{DeviceCube, grid_fft, grid_lines, grid_spread};
use crate::error::Result;
use crate::gpu::{Gpu, Recorder};
use num_complex::Complex32;

/// Measured on llvmpipe, ns of two cores; ratios count.
pub const DEVICE_COSTS: Costs = Costs {
    direct: 0.28,
    spread: [60.0, 190.0],
    transform: 0.6,
    line: 0.25,
    sample: 3.0,
    table: 100.0,
    power_of_two: true,
    longest: grid_fft::LONGEST,
    lines: 4096,
    largest_grid: 1 << 24,
};

/// Lines that echoes at rest are shared out over, so that so many threads spread them.
const STILL_LINES: usize = 64;

/// Records the synthesis of the cube without noise, each set of echoes by gridding where that is cheaper than the
/// direct sum and accurate.
///
/// # Errors
/// As [`Plan::record`] where a set is summed directly.
pub fn record(plan: &Plan, gpu: &Gpu, recorder: &mut Recorder) -> Result<(DeviceCube, Methods)> {
    record_with(plan, gpu, recorder, &DEVICE_COSTS)
}

/// The same with given costs, by which tests force one method or another.
///
/// # Errors
/// A plan that is larger than the adapter holds; failures of the adapter; interrupted, when cancelled.
pub fn record_with(
    plan: &Plan,
    gpu: &Gpu,
    recorder: &mut Recorder,
    costs: &Costs,
) -> Result<(DeviceCube, Methods)> {
    let limit = gpu.max_binding_bytes() as usize;
    let kept = ECHOES_KEPT.min(limit / size_of::<grid_spread::DeviceEcho>());
    // One channel's grid has to fit a binding.
    let costs = &Costs { largest_grid: costs.largest_grid.min(limit / size_of::<Complex32>()), ..*costs };
    let mut methods = Methods::default();
    // A thread adds up all echoes of its line in a row, so they must not crowd.
    let fits = |l: &Layout, set| {
        l.block * l.samples * size_of::<[f32; 4]>() <= limit && (set == Set::Still || l.portion == usize::MAX)
    };
    let (mut still, mut moving) = (Vec::new(), Vec::new());
    for portion in plan.set(Set::Still).chunks((kept / plan.channels.max(1)).max(1)) {
        let echoes = GridEchoes::new(plan, portion, 0..plan.channels);
        let Some(layout) = Layout::choose_still(plan.samples, &echoes, costs).filter(|l| fits(l, Set::Still))
        else {
            still.clear();
            break;
        };
        still.push((Set::Still, layout, echoes));
    }
    let still_directly = if still.is_empty() { plan.set(Set::Still) } else { &[] };
    let mut directly = Vec::new();
    for portion in moving_portions(plan, kept) {
        let echoes = GridEchoes::new(plan, portion, 0..plan.channels);
        let layout = Layout::choose(plan.chirps, plan.samples, &echoes, costs);
        match layout.filter(|l| fits(l, Set::Moving)) {
            Some(layout) => moving.push((Set::Moving, layout, echoes)),
            None => directly.extend_from_slice(portion),
        }
    }
    let worst = |jobs: &[(Set, Layout, GridEchoes)]| {
        let layouts = jobs.iter().map(|(_, l, _)| l);
        layouts.max_by(|a, b| a.error.total_cmp(&b.error)).map_or(Method::Direct, Layout::method)
    };
    (methods.still, methods.moving) = (worst(&still), worst(&moving));
    let cube = plan.record_some(gpu, recorder, still_directly, &directly)?;
    let jobs: Vec<_> = still.into_iter().chain(moving).collect();
    for (set, layout, echoes) in &jobs {
        let sorted = match set {
            Set::Still => {
                let most = (limit / size_of::<Complex32>() / layout.cells).max(1);
                grid_spread::Sorted::shared_out(echoes, STILL_LINES.min(echoes.count).min(most))
            }
            Set::Moving => grid_spread::Sorted::by_line(echoes, layout),
        };
        let grid_bytes = layout.blocks() * sorted.lines() * layout.cells * size_of::<Complex32>();
        let echo_bytes = echoes.count * size_of::<grid_spread::DeviceEcho>();
        let together = (limit / grid_bytes.max(echo_bytes).max(1)).clamp(1, plan.channels.max(1));
        let steps = recorder.upload("steps", &grid_lines::steps(layout));
        for first in (0..plan.channels).step_by(together) {
            let channels = first..(first + together).min(plan.channels);
            let grid = grid_spread::record(recorder, layout, echoes, &sorted, channels.clone());
            let lines = grid_fft::record(recorder, layout, &grid);
            let into = grid_lines::Into { cube: &cube, channels, copies: *set == Set::Still };
            grid_lines::record(recorder, layout, plan.sampling, &lines, &steps, into);
        }
    }
    Ok((cube, methods))
}
