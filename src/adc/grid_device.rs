//! Gridded synthesis on the device: which echoes are gridded and how, and the passes in order.

use super::grid_echoes::GridEchoes;
use super::gridding::{Costs, ECHOES_KEPT, GridLayout};
use super::methods::{Method, Methods};
use super::schedule::Schedule;
use super::synthesis::{Plan, Set};
use super::{DeviceCube, grid_fft, grid_lines, grid_spread};
use crate::base::error::Result;
use crate::gpu::{Buffer, Gpu, Recorder};
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
/// Returns the errors of [`Plan::record`] where a set is summed directly.
pub fn record(plan: &Plan, gpu: &Gpu, recorder: &mut Recorder) -> Result<(DeviceCube, Methods)> {
    record_with(plan, gpu, recorder, &DEVICE_COSTS)
}

/// Records as [`record`] with given costs, by which tests force one method or another.
///
/// # Errors
/// Returns the errors of [`Plan::record`] where a set is summed directly.
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
    // A thread adds up all echoes of its line in a row, so they must not crowd.
    let table_fits = |l: &GridLayout| l.block * l.samples * size_of::<[f32; 4]>() <= limit;
    let set = plan.set(Set::Still);
    let still = Some(GridLayout::still(plan.samples, costs)).filter(|l| {
        !set.is_empty() && GridLayout::still_pays(set.len(), plan.samples, costs) && table_fits(l)
    });
    let mut schedule = Schedule::new(plan, costs);
    schedule.keep(|indices, layout| {
        let crowded =
            || indices.chunks(kept).any(|some| layout.is_crowded(&GridEchoes::new(plan, some, 0..1)));
        table_fits(layout) && !crowded()
    });
    let methods = Methods {
        still: still.as_ref().map_or(Method::Direct, |layout| Method::Gridded(layout.gridded(0.0))),
        moving: schedule.method(),
    };
    let still_directly = if still.is_none() { set } else { &[] };
    let cube = plan.record_some(gpu, recorder, still_directly, &schedule.directly)?;
    let mut recording = Recording { plan, recorder, cube: &cube, limit, kept };
    if let Some(layout) = &still {
        recording.grid(Set::Still, set, layout);
    }
    for (indices, layout) in &schedule.grids {
        recording.grid(Set::Moving, indices, layout);
    }
    Ok((cube, methods))
}

/// What the passes of a grid need beside the echoes.
struct Recording<'a, 'r, 'g> {
    plan: &'a Plan<'a>,
    recorder: &'r mut Recorder<'g>,
    cube: &'a DeviceCube,
    /// Bytes of a binding.
    limit: usize,
    /// Echoes times channels whose coefficients are kept at a time.
    kept: usize,
}

impl Recording<'_, '_, '_> {
    /// Adds some echoes to the cube.
    fn grid(&mut self, set: Set, indices: &[u32], layout: &GridLayout) {
        for run in self.plan.channels_by_code() {
            let layout = &layout.turned(self.plan.code_turns(run.start));
            let steps = self.recorder.upload("steps", &grid_lines::steps(layout));
            for some in indices.chunks(self.kept) {
                let together = (self.kept / some.len()).max(1);
                for first in run.clone().step_by(together) {
                    let channels = first..(first + together).min(run.end);
                    let echoes = GridEchoes::new(self.plan, some, channels.clone());
                    self.passes(set, layout, &echoes, channels.start, &steps);
                }
            }
        }
    }

    /// The passes for echoes whose first channel is number `base` of the cube.
    fn passes(
        &mut self,
        set: Set,
        layout: &GridLayout,
        echoes: &GridEchoes,
        base: usize,
        steps: &Buffer<[f32; 4]>,
    ) {
        let sorted = match set {
            Set::Still => {
                let most = (self.limit / size_of::<Complex32>() / layout.cells).max(1);
                grid_spread::Sorted::shared_out(echoes, STILL_LINES.min(echoes.count).min(most))
            }
            Set::Moving => grid_spread::Sorted::by_line(echoes, layout),
        };
        let grid_bytes = layout.blocks() * sorted.lines() * layout.cells * size_of::<Complex32>();
        let echo_bytes = echoes.count * size_of::<grid_spread::DeviceEcho>();
        let together = (self.limit / grid_bytes.max(echo_bytes).max(1)).clamp(1, echoes.channels.max(1));
        for first in (0..echoes.channels).step_by(together) {
            let channels = first..(first + together).min(echoes.channels);
            let grid = grid_spread::record(self.recorder, layout, echoes, &sorted, channels.clone());
            let lines = grid_fft::record(self.recorder, layout, &grid);
            let channels = base + channels.start..base + channels.end;
            let into = grid_lines::Into { cube: self.cube, channels, copies: set == Set::Still };
            grid_lines::record(self.recorder, layout, self.plan.sampling, &lines, steps, into);
        }
    }
}
