//! The noise in listed cells: the host side of the kernel (CONVENTIONS eq. 17, 85).

use super::cfar_window::{self, Column, DeviceColumn, Window};
use crate::gpu::{Access, Buffer, Kernel, Recorder, Threads, Tolerance};
use crate::gpu_struct;
use crate::scene::radar::Cfar;

gpu_struct! {
    /// Uniform of `shaders/dsp/cfar_noise.wgsl`.
    pub struct CfarNoiseParams {
        pub doppler_bins: u32,
        pub range_bins: u32,
        pub guard_doppler: u32,
        pub half_doppler: u32,
        pub guard_range: u32,
        pub half_range: u32,
        pub kind: u32,
        pub along_doppler: u32,
        pub capacity: u32,
    }
}

/// The kernel's row: sources, parameters, bindings and tolerance.
pub static KERNEL: Kernel = Kernel {
    stem: "dsp/cfar_noise",
    sources: &[
        include_str!("../../shaders/shared/linear.wgsl"),
        include_str!("../../shaders/dsp/cfar_noise.wgsl"),
    ],
    workgroup: [64, 1, 1],
    params: Some(CfarNoiseParams::LAYOUT),
    storage: &[Access::Read, Access::Read, Access::Read, Access::ReadWrite],
    structs: &[DeviceColumn::LAYOUT],
    tolerance: Tolerance {
        relative_l2: 1e-6,
        reason: "the sums of cfar_ca; an order statistic is exact but for the rounding of its scale",
    },
};

/// Times at most that a thread goes through its training cells: once for their bounds, and once for each
/// bit of a positive f32, by which the bounds close in.
pub(crate) const PASSES: usize = 32;

/// The noise of each cell of a list as [`super::peaks::record`] makes it, with room for as many as that has.
pub(crate) fn record(
    recorder: &mut Recorder<'_>,
    map: &Buffer<f32>,
    size: [usize; 2],
    cfar: &Cfar,
    columns: &[Column],
    list: &Buffer<u32>,
) -> Buffer<f32> {
    let capacity = list.len() - 1;
    let w = Window::new(size, cfar);
    let params = CfarNoiseParams {
        doppler_bins: w.doppler_bins,
        range_bins: w.range_bins,
        guard_doppler: w.guard_doppler,
        half_doppler: w.half_doppler,
        guard_range: w.guard_range,
        half_range: w.half_range,
        kind: cfar_window::kind_number(cfar.kind),
        along_doppler: u32::from(cfar_window::halves(cfar) == cfar_window::Halves::AlongDoppler),
        capacity: capacity as u32,
    };
    let columns = cfar_window::upload_columns(recorder, columns);
    let noise = recorder.buffer::<f32>("cfar noise", capacity);
    recorder.dispatch(&KERNEL, &params, &[map, &columns, list, &noise], Threads::Linear(capacity as u64));
    noise
}
