//! Lines of a grid from cells to samples: host side of the kernel (CONVENTIONS eq. 83).

use super::gridding::GridLayout;
use crate::gpu::{Access, Buffer, Kernel, Recorder, Threads, Tolerance};
use crate::gpu_struct;
use num_complex::{Complex32, Complex64};
use std::f64::consts::TAU;

gpu_struct! {
    /// Uniform of `shaders/adc/grid_fft.wgsl`.
    pub struct GridFftParams {
        pub lines: u32,
        pub log2_cells: u32,
        pub samples: u32,
    }
}

/// The kernel's row: sources, parameters, bindings and tolerance.
pub static KERNEL: Kernel = Kernel {
    stem: "adc/grid_fft",
    sources: &[
        include_str!("../../shaders/shared/linear.wgsl"),
        include_str!("../../shaders/shared/complex.wgsl"),
        include_str!("../../shaders/adc/grid_fft.wgsl"),
    ],
    workgroup: [256, 1, 1],
    params: Some(GridFftParams::LAYOUT),
    storage: &[Access::Read, Access::Read, Access::ReadWrite],
    structs: &[],
    tolerance: Tolerance {
        relative_l2: 6e-7,
        reason: "c eps sqrt(log2 N) with c = 1.5, N up to 4096, eps = 1.19e-7",
    },
};

/// Length of the longest line, and number of the values that a workgroup works on: what its 32 KiB hold.
pub const LONGEST: usize = 4096;

/// Records the transform of all lines of a grid: `[line, sample]`.
pub fn record(recorder: &mut Recorder, layout: &GridLayout, grid: &Buffer<Complex32>) -> Buffer<Complex32> {
    let (cells, samples) = (layout.cells, layout.samples);
    let lines = grid.len() / cells;
    let turns: Vec<Complex32> = (0..cells)
        .map(|i| {
            let z = Complex64::cis(TAU * i as f64 / cells as f64);
            Complex32::new(z.re as f32, z.im as f32)
        })
        .collect();
    let turns = recorder.upload("turns", &turns);
    let out = recorder.buffer("lines", lines * samples);
    let params = GridFftParams { lines: lines as u32, log2_cells: cells.ilog2(), samples: samples as u32 };
    let groups = lines.div_ceil(LONGEST / cells) as u64;
    let threads = Threads::Linear(groups * u64::from(KERNEL.workgroup[0]));
    recorder.dispatch(&KERNEL, &params, &[grid, &turns, &out], threads);
    out
}
