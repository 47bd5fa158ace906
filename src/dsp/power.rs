//! Mean power over channels: the host side of the kernel (CONVENTIONS eq. 14).

use super::device_spectrum::DeviceSpectrum;
use crate::gpu::{Access, Buffer, Kernel, Recorder, Threads, Tolerance};
use crate::gpu_struct;

gpu_struct! {
    /// Uniform of `shaders/dsp/power.wgsl`.
    pub struct PowerMapParams {
        pub doppler_bins: u32,
        pub channels: u32,
        pub ranges: u32,
        pub first_range: u32,
        pub range_bins: u32,
        pub start: u32,
        pub scale: f32,
        pub bands: u32,
    }
}

/// The kernel's row: sources, parameters, bindings and tolerance.
pub static KERNEL: Kernel = Kernel {
    stem: "dsp/power",
    sources: &[
        include_str!("../../shaders/shared/linear.wgsl"),
        include_str!("../../shaders/shared/complex.wgsl"),
        include_str!("../../shaders/dsp/power.wgsl"),
    ],
    workgroup: [64, 1, 1],
    params: Some(PowerMapParams::LAYOUT),
    storage: &[Access::Read, Access::ReadWrite],
    structs: &[],
    tolerance: Tolerance {
        relative_l2: 1.5e-6,
        reason: "twice the 6e-7 of the amplitudes, and the rounding of a sum of positive terms, at most \
                 eps/2 a channel where they are all alike and far less on average",
    },
};

/// Records the power map of a spectrum, `[doppler, range]`, in W.
pub fn record(recorder: &mut Recorder<'_>, spectrum: &DeviceSpectrum) -> Buffer<f32> {
    let map = recorder.buffer::<f32>("map", spectrum.doppler_bins * spectrum.range_bins);
    add(recorder, spectrum, &map, (0, spectrum.channels / spectrum.bands));
    map
}

/// Adds the power of a spectrum to `map`: its channels are those from the `first`-th on of `all` channels of the
/// cube, of which the first begin the map and the last turn the sum into the mean.
pub(crate) fn add(
    recorder: &mut Recorder<'_>,
    spectrum: &DeviceSpectrum,
    map: &Buffer<f32>,
    (first, all): (usize, usize),
) {
    for chunk in &spectrum.chunks {
        let first = first + chunk.first_channel;
        let last = first + chunk.channels == all;
        let params = PowerMapParams {
            doppler_bins: spectrum.doppler_bins as u32,
            channels: chunk.channels as u32,
            ranges: chunk.ranges as u32,
            first_range: chunk.first_range as u32,
            range_bins: spectrum.range_bins as u32,
            start: u32::from(first == 0),
            scale: if last { (spectrum.map_scale / (all * spectrum.bands) as f64) as f32 } else { 1.0 },
            bands: spectrum.bands as u32,
        };
        let threads = Threads::Linear((spectrum.doppler_bins * chunk.ranges) as u64);
        recorder.dispatch(&KERNEL, &params, &[&chunk.spectrum, map], threads);
    }
}
