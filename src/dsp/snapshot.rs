//! The channels of the detected cells: the host side of the kernel.

use super::device_spectrum::DeviceSpectrum;
use crate::gpu::{Access, Buffer, Kernel, Recorder, Threads, Tolerance};
use crate::gpu_struct;
use num_complex::Complex32;

gpu_struct! {
    /// Uniform of `shaders/dsp/snapshot.wgsl`.
    pub struct SnapshotParams {
        pub capacity: u32,
        pub channels: u32,
        pub range_bins: u32,
        pub first_channel: u32,
        pub chunk_channels: u32,
        pub first_range: u32,
        pub ranges: u32,
        pub bands: u32,
        pub doppler_bins: u32,
    }
}

/// The kernel's row: sources, parameters, bindings and tolerance.
pub static KERNEL: Kernel = Kernel {
    stem: "dsp/snapshot",
    sources: &[
        include_str!("../../shaders/shared/linear.wgsl"),
        include_str!("../../shaders/dsp/snapshot.wgsl"),
    ],
    workgroup: [64, 1, 1],
    params: Some(SnapshotParams::LAYOUT),
    storage: &[Access::Read, Access::Read, Access::ReadWrite],
    structs: &[],
    tolerance: Tolerance { relative_l2: 0.0, reason: "copies" },
};

/// Records the gathering of `[cell, channel]` for the cells of a list as [`super::peaks::record`] makes it, with room
/// for as many as that has.
pub fn record(
    recorder: &mut Recorder<'_>,
    spectrum: &DeviceSpectrum,
    list: &Buffer<u32>,
) -> Buffer<Complex32> {
    let snapshots = recorder.buffer::<Complex32>("snapshots", (list.len() - 1) * spectrum.channels);
    add(recorder, spectrum, list, &snapshots, (0, spectrum.channels / spectrum.bands));
    snapshots
}

/// Those of a spectrum whose channels are the ones from the `first`-th on of `all` of the cube.
pub(crate) fn add(
    recorder: &mut Recorder<'_>,
    spectrum: &DeviceSpectrum,
    list: &Buffer<u32>,
    snapshots: &Buffer<Complex32>,
    (first, all): (usize, usize),
) {
    let capacity = list.len() - 1;
    for chunk in &spectrum.chunks {
        let params = SnapshotParams {
            capacity: capacity as u32,
            channels: all as u32,
            range_bins: spectrum.range_bins as u32,
            first_channel: (first + chunk.first_channel) as u32,
            chunk_channels: chunk.channels as u32,
            first_range: chunk.first_range as u32,
            ranges: chunk.ranges as u32,
            bands: spectrum.bands as u32,
            doppler_bins: spectrum.doppler_bins as u32,
        };
        let threads = Threads::Linear((capacity * chunk.channels * spectrum.bands) as u64);
        recorder.dispatch(&KERNEL, &params, &[&chunk.spectrum, list, snapshots], threads);
    }
}
