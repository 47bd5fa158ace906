//! Exclusive prefix sums on the device: the slots of variable-size output.

use crate::gpu::{Access, Buffer, Kernel, Recorder, Threads, Tolerance};
use crate::gpu_struct;

gpu_struct! {
    /// Uniform of `shaders/trace/scan.wgsl`.
    pub struct PrefixSumParams {
        pub count: u32,
        pub mode: u32,
    }
}

/// The kernel's row: sources, parameters, bindings and tolerance.
pub static KERNEL: Kernel = Kernel {
    stem: "trace/scan",
    sources: &[
        include_str!("../../shaders/shared/linear.wgsl"),
        include_str!("../../shaders/trace/scan.wgsl"),
    ],
    workgroup: [256, 1, 1],
    params: Some(PrefixSumParams::LAYOUT),
    storage: &[Access::ReadWrite, Access::ReadWrite],
    structs: &[],
    tolerance: Tolerance { relative_l2: 0.0, reason: "integers" },
};

const BLOCK: usize = 1024;

/// Replaces `values` by their exclusive prefix sums; the buffer returned holds their total in its
/// first word.
pub fn record(recorder: &mut Recorder<'_>, values: &Buffer<u32>, count: usize) -> Buffer<u32> {
    let blocks = count.div_ceil(BLOCK).max(1);
    let totals = recorder.zeros::<u32>("scan totals", blocks);
    let threads = Threads::Linear((blocks * BLOCK / 4) as u64);
    recorder.dispatch(
        &KERNEL,
        &PrefixSumParams { count: count as u32, mode: 0 },
        &[values, &totals],
        threads,
    );
    if blocks == 1 {
        return totals;
    }
    let total = record(recorder, &totals, blocks);
    recorder.dispatch(
        &KERNEL,
        &PrefixSumParams { count: count as u32, mode: 1 },
        &[values, &totals],
        threads,
    );
    total
}
