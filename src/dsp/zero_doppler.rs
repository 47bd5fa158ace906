//! Removal of everything at rest: the host side of the kernel (CONVENTIONS eq. 88).

use crate::adc::DeviceCube;
use crate::gpu::{Access, Kernel, Recorder, Threads, Tolerance};
use crate::gpu_struct;

gpu_struct! {
    /// Uniform of `shaders/dsp/zero_doppler.wgsl`.
    pub struct Params {
        pub chirps: u32,
        pub columns: u32,
        pub phase: u32,
        pub start: u32,
        pub share: f32,
    }
}

pub static KERNEL: Kernel = Kernel {
    stem: "dsp/zero_doppler",
    sources: &[
        include_str!("../../shaders/shared/linear.wgsl"),
        include_str!("../../shaders/shared/complex.wgsl"),
        include_str!("../../shaders/dsp/zero_doppler.wgsl"),
    ],
    workgroup: [64, 1, 1],
    params: Some(Params::LAYOUT),
    storage: &[Access::ReadWrite, Access::ReadWrite],
    structs: &[],
    tolerance: Tolerance {
        relative_l2: 2e-6,
        reason: "a running sum over chirps, whose rounding grows like their square root: eps/2 sqrt(512) of the \
                 mean; relative to the samples before the removal",
    },
};

/// Takes the mean over chirps out of a cube, in place.
pub fn record(recorder: &mut Recorder<'_>, cube: &DeviceCube) {
    let columns = cube.channels * cube.samples;
    let sums = recorder.buffer::<[f32; 2]>("means over chirps", columns);
    for phase in [0, 1] {
        for (i, piece) in cube.pieces.iter().enumerate() {
            let params = Params {
                chirps: piece.chirps as u32,
                columns: columns as u32,
                phase,
                start: u32::from(i == 0),
                share: (1.0 / cube.chirps as f64) as f32,
            };
            recorder.dispatch(&KERNEL, &params, &[&piece.data, &sums], Threads::Linear(columns as u64));
        }
    }
}
