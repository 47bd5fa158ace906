//! Range and Doppler transforms: sizes, windows, and the host side of the kernel for what a workgroup holds
//! (CONVENTIONS eq. 14); other lengths go by passes over global memory (eq. 86).

use super::fft_pass::{PassLayout, Passes, Scratch, twiddles};
use crate::gpu::{Access, AnyBuffer, Buffer, Gpu, Kernel, Recorder, Threads, Tolerance};
use crate::gpu_struct;
use num_complex::Complex32;

/// Length of the longest transform whose real or imaginary parts the 16 KiB hold that a workgroup has on every adapter.
pub const LONGEST_IN_WORKGROUP: usize = 4096;

pub(super) fn fits_workgroup(length: usize) -> bool {
    length.is_power_of_two() && length <= LONGEST_IN_WORKGROUP
}

/// How the device computes a transform.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// A line in one workgroup's memory: powers of two up to [`LONGEST_IN_WORKGROUP`].
    Workgroup,
    /// Passes over global memory: every length.
    Passes,
}

impl Method {
    /// The faster one for this length. On a CPU's driver workgroup memory is memory like any other, and
    /// each barrier costs a change of context.
    pub fn of(gpu: &Gpu, length: usize) -> Method {
        if fits_workgroup(length) && gpu.is_hardware() { Method::Workgroup } else { Method::Passes }
    }
}

gpu_struct! {
    /// Uniform of `shaders/dsp/fft.wgsl`.
    pub struct WorkgroupFftParams {
        pub lines: u32,
        pub log2_length: u32,
        pub count: u32,
        pub in_base: u32,
        pub in_line: u32,
        pub in_step: u32,
        pub out_base: u32,
        pub out_line: u32,
        pub out_step: u32,
        pub shift: u32,
        pub first: u32,
        pub kept: u32,
        pub side_by_side: u32,
        pub log2_tile: u32,
    }
}

/// The kernel's row: sources, parameters, bindings and tolerance.
pub static KERNEL: Kernel = Kernel {
    stem: "dsp/fft",
    sources: &[
        include_str!("../../shaders/shared/linear.wgsl"),
        include_str!("../../shaders/shared/complex.wgsl"),
        include_str!("../../shaders/dsp/fft.wgsl"),
    ],
    workgroup: [256, 1, 1],
    params: Some(WorkgroupFftParams::LAYOUT),
    storage: &[Access::Read, Access::Read, Access::Read, Access::ReadWrite],
    structs: &[],
    tolerance: Tolerance {
        relative_l2: 6e-7,
        reason: "c eps sqrt(log2 N + log2 M) for two transforms with c = 1: rounding errors of the passes add \
                 like noise; sqrt 24 at the longest lengths and eps = 1.19e-7",
    },
};

/// Shortest tile of a workgroup: four values for each of its threads.
const SHORTEST_TILE: usize = 1024;

/// One axis of the transform on the device.
pub(super) enum Axis {
    Workgroup { length: usize, weights: Buffer<f32>, twiddles: Buffer<Complex32>, hardware: bool },
    Passes(Passes),
}

impl Axis {
    pub fn new(
        gpu: &Gpu,
        recorder: &mut Recorder<'_>,
        method: Method,
        length: usize,
        window: &[f64],
    ) -> Axis {
        if method == Method::Passes {
            let hardware = gpu.is_hardware();
            return Axis::Passes(Passes::new(recorder, hardware, length, window));
        }
        let weights: Vec<f32> = window.iter().map(|w| *w as f32).collect();
        Axis::Workgroup {
            length,
            weights: recorder.upload("window", &weights),
            twiddles: recorder.upload("twiddles", &twiddles(length)),
            hardware: gpu.is_hardware(),
        }
    }

    pub fn record(
        &self,
        recorder: &mut Recorder<'_>,
        scratch: &mut Scratch,
        from: &dyn AnyBuffer,
        to: &dyn AnyBuffer,
        layout: PassLayout,
    ) {
        let (length, weights, twiddles, hardware) = match self {
            Axis::Passes(passes) => return passes.record(recorder, scratch, from, to, layout),
            Axis::Workgroup { length, weights, twiddles, hardware } => {
                (*length, weights, twiddles, *hardware)
            }
        };
        // On a strided axis a GPU wants many lines together; a CPU's driver wants its cache. The numbers
        // that come out are the same.
        let wide = layout.side_by_side && hardware;
        let tile = if wide { LONGEST_IN_WORKGROUP } else { length.max(SHORTEST_TILE) };
        let groups = (layout.lines as u64).div_ceil((tile / length) as u64);
        let params = WorkgroupFftParams {
            lines: layout.lines as u32,
            log2_length: length.ilog2(),
            count: weights.len() as u32,
            in_base: layout.in_base,
            in_line: layout.in_line,
            in_step: layout.in_step,
            out_base: layout.out_base,
            out_line: layout.out_line,
            out_step: layout.out_step,
            shift: layout.shift,
            first: layout.first,
            kept: layout.kept,
            side_by_side: u32::from(layout.side_by_side),
            log2_tile: tile.ilog2(),
        };
        let threads = Threads::Linear(groups * u64::from(KERNEL.workgroup[0]));
        recorder.dispatch(&KERNEL, &params, &[from, weights, twiddles, to], threads);
    }
}

/// Samples on the device, `[chirp, channel, sample]` of some chirps.
pub(super) struct Piece<'a> {
    pub first_chirp: usize,
    pub chirps: usize,
    /// That it holds, and the first of those that are wanted.
    pub channels: usize,
    pub first_channel: usize,
    pub data: &'a dyn AnyBuffer,
}
