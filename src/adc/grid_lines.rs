//! Sums over lines: host side of the kernel (CONVENTIONS eq. 84).

use super::DeviceCube;
use super::gridding::GridLayout;
use crate::base::tasks::Tasks;
use crate::gpu::{Access, Buffer, Kernel, Recorder, Threads, Tolerance};
use crate::gpu_struct;
use crate::scene::radar::Sampling;
use num_complex::{Complex32, Complex64};
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::ops::Range;

gpu_struct! {
    /// Uniform of `shaders/adc/grid_lines.wgsl`.
    pub struct GridLinesParams {
        pub first_chirp: u32,
        pub chirps: u32,
        pub cube_channels: u32,
        pub first_channel: u32,
        pub channels: u32,
        pub samples: u32,
        pub blocks: u32,
        pub block: u32,
        pub lines: u32,
        pub accumulate: u32,
        pub is_real: u32,
        pub copies: u32,
    }
}

/// The kernel's row: sources, parameters, bindings and tolerance.
pub static KERNEL: Kernel = Kernel {
    stem: "adc/grid_lines",
    sources: &[
        include_str!("../../shaders/shared/linear.wgsl"),
        include_str!("../../shaders/shared/complex.wgsl"),
        include_str!("../../shaders/adc/grid_lines.wgsl"),
    ],
    workgroup: [64, 1, 1],
    params: Some(GridLinesParams::LAYOUT),
    storage: &[Access::Read, Access::Read, Access::ReadWrite],
    structs: &[],
    tolerance: Tolerance {
        relative_l2: 2e-5,
        reason: "of the whole synthesis: images of the grid and what the warp leaves over 1.5e-5 together, f32 2e-6",
    },
};

/// Step from line to line and factor of the sum, `[chirp of a block, sample]`.
pub fn steps(layout: &GridLayout) -> Vec<[f32; 4]> {
    let finish = layout.finish();
    let mut steps = vec![[0.0; 4]; layout.block * layout.samples];
    steps.par_chunks_mut(layout.samples).enumerate().for_each_tasks(|(i, row)| {
        for (n, to) in row.iter_mut().enumerate() {
            let (turns, shared, magnitude) = finish.at(i, n);
            let z = Complex64::cis(TAU * turns);
            let f = magnitude * Complex64::cis(TAU * (shared - shared.round()));
            *to = [z.re as f32, z.im as f32, f.re as f32, f.im as f32];
        }
    });
    steps
}

/// The cube to which sums are written.
pub struct Into<'a> {
    /// The cube that receives them.
    pub cube: &'a DeviceCube,
    /// The channels of it that are summed now.
    pub channels: Range<usize>,
    /// The one chirp of the layout goes into every chirp of the cube.
    pub copies: bool,
}

/// Records the addition of `lines`, `[channel, block, line, sample]`, to a cube.
pub fn record(
    recorder: &mut Recorder,
    layout: &GridLayout,
    sampling: Sampling,
    lines: &Buffer<Complex32>,
    steps: &Buffer<[f32; 4]>,
    into: Into<'_>,
) {
    let Into { cube, channels, copies } = into;
    let blocks = layout.blocks();
    let in_block = lines.len() / (channels.len() * blocks * layout.samples).max(1);
    for piece in &cube.pieces {
        let params = GridLinesParams {
            first_chirp: piece.first_chirp as u32,
            chirps: piece.chirps as u32,
            cube_channels: cube.channels as u32,
            first_channel: channels.start as u32,
            channels: channels.len() as u32,
            samples: layout.samples as u32,
            blocks: blocks as u32,
            block: layout.block as u32,
            lines: in_block as u32,
            accumulate: 1,
            is_real: u32::from(sampling == Sampling::Real),
            copies: u32::from(copies),
        };
        let threads = channels.len() * blocks * layout.block.div_ceil(4) * layout.samples;
        recorder.dispatch(&KERNEL, &params, &[lines, steps, &piece.data], Threads::Linear(threads as u64));
    }
}
