//! Peaks: their order, their place between cells (CONVENTIONS eq. 18), and the host side of the
//! kernel that lists them.

use super::{Cell, PowerMap, Real};
use crate::gpu::{Access, Buffer, Kernel, Recorder, Threads, Tolerance};
use crate::gpu_struct;

gpu_struct! {
    /// Uniform of `shaders/dsp/peaks.wgsl`.
    pub struct Params {
        pub doppler_bins: u32,
        pub range_bins: u32,
        pub capacity: u32,
        pub phase: u32,
        pub blocks: u32,
    }
}

pub static KERNEL: Kernel = Kernel {
    stem: "dsp/peaks",
    sources: &[
        include_str!("../../shaders/shared/linear.wgsl"),
        include_str!("../../shaders/dsp/peaks.wgsl"),
    ],
    workgroup: [256, 1, 1],
    params: Some(Params::LAYOUT),
    storage: &[Access::Read, Access::Read, Access::ReadWrite, Access::ReadWrite],
    structs: &[],
    tolerance: Tolerance { relative_l2: 0.0, reason: "compares and counts" },
};

/// Cells that one workgroup looks at: its threads x the stretch of each in the shader.
const BLOCK: usize = 256 * 16;

/// Lists the peaks of a map of `[doppler bins, range bins]` among its masked cells: first how many there
/// are, then up to `capacity` of them as doppler x range_bins + range, in the order of the map.
pub fn record(
    recorder: &mut Recorder<'_>,
    map: &Buffer<f32>,
    mask: &Buffer<u32>,
    size: [usize; 2],
    capacity: usize,
) -> Buffer<u32> {
    let list = recorder.buffer::<u32>("detected cells", capacity + 1);
    let blocks = (size[0] * size[1]).div_ceil(BLOCK);
    let places = recorder.buffer::<u32>("places of detected cells", blocks);
    let threads = (blocks * KERNEL.workgroup[0] as usize) as u64;
    for (phase, threads) in
        [(0, Threads::Linear(threads)), (1, Threads::Workgroups([1, 1, 1])), (2, Threads::Linear(threads))]
    {
        let params = Params {
            doppler_bins: size[0] as u32,
            range_bins: size[1] as u32,
            capacity: capacity as u32,
            phase,
            blocks: blocks as u32,
        };
        recorder.dispatch(&KERNEL, &params, &[map, mask, &places, &list], threads);
    }
    list
}

/// Where a peak lies between cells, and its height there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peak {
    /// Row of the map, with a fraction.
    pub doppler: f64,
    /// Column of the map, with a fraction.
    pub range: f64,
    /// Power at the top of the parabola in W. Between cells it overshoots, with a Hann window by up to
    /// 0.33 dB an axis; eq. 20 takes its power from the beamformer instead.
    pub power: f64,
}

/// Offset in cells, within +-0.5, and height of the parabola through the logarithms of three powers
/// of which the middle is the largest. When the middle is not the largest, or one is not positive,
/// the peak is left on its cell.
pub fn parabola(before: f64, at: f64, after: f64) -> (f64, f64) {
    if !(before > 0.0 && after > 0.0 && at >= before && at >= after) {
        return (0.0, at);
    }
    // Ratios, so that powers near the ends of the number range stay exact.
    let (a, c) = ((before / at).ln(), (after / at).ln());
    let curvature = a + c;
    if curvature >= 0.0 {
        return (0.0, at);
    }
    let offset = 0.5 * (a - c) / curvature;
    (offset, at * (-0.25 * (a - c) * offset).exp())
}

/// The parabolas of eq. 18 on both axes; the Doppler axis wraps, and a peak in the first or last
/// range column stays on it.
pub fn interpolate<T: Real>(map: &PowerMap<T>, cell: Cell) -> Peak {
    let (d, r, rows) = (cell.doppler as usize, cell.range as usize, map.doppler_bins);
    let p = |d: usize, r: usize| map.at(d % rows, r).wide();
    let centre = p(d, r);
    let (doppler, by_doppler) =
        if rows < 3 { (0.0, centre) } else { parabola(p(d + rows - 1, r), centre, p(d + 1, r)) };
    let (range, by_range) = if r == 0 || r + 1 >= map.range_bins {
        (0.0, centre)
    } else {
        parabola(p(d, r - 1), centre, p(d, r + 1))
    };
    // A separable peak: the gains of the two axes multiply.
    let power = if centre > 0.0 { by_doppler * (by_range / centre) } else { centre };
    Peak { doppler: d as f64 + doppler, range: r as f64 + range, power }
}

/// Strongest first; equal powers by row, then column.
pub fn sort<T: Real>(map: &PowerMap<T>, cells: &mut [Cell]) {
    let power = |c: &Cell| map.at(c.doppler as usize, c.range as usize).wide();
    cells.sort_by(|a, b| power(b).total_cmp(&power(a)).then((a.doppler, a.range).cmp(&(b.doppler, b.range))));
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_gaussian_is_found_exactly() {
        let (d0, r0) = (7.3, 4.8);
        let mut map = PowerMap { doppler_bins: 16, range_bins: 10, data: vec![0.0; 160] };
        for d in 0..16 {
            for r in 0..10 {
                let (x, y) = (d as f64 - d0, r as f64 - r0);
                map.data[d * 10 + r] = 3e-12 * (-0.7 * x * x - 1.1 * y * y).exp();
            }
        }
        let peak = interpolate(&map, Cell { doppler: 7, range: 5 });
        assert!((peak.doppler - d0).abs() < 1e-12 && (peak.range - r0).abs() < 1e-12);
        assert!((peak.power / 3e-12 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn edges_and_zeros_stay_on_the_cell() {
        let map = PowerMap { doppler_bins: 3, range_bins: 2, data: vec![0.0, 0.0, 1.0, 0.5, 0.2, 0.1f64] };
        let peak = interpolate(&map, Cell { doppler: 1, range: 0 });
        assert_eq!((peak.doppler, peak.range, peak.power), (1.0, 0.0, 1.0));
        assert_eq!(parabola(2.0, 1.0, 0.5), (0.0, 1.0));
        assert_eq!(parabola(1.0, 1.0, 1.0), (0.0, 1.0));
    }

    #[test]
    fn doppler_wraps() {
        let map = PowerMap { doppler_bins: 4, range_bins: 1, data: vec![1.0, 0.5, 0.1, 0.8f64] };
        let peak = interpolate(&map, Cell { doppler: 0, range: 0 });
        assert!(peak.doppler < 0.0 && peak.doppler > -0.5);
    }

    proptest! {
        #[test]
        fn offset_is_within_half_a_cell(a in 1e-30..1.0f64, b in 1e-30..1.0f64, c in 1e-30..1.0f64) {
            let top = a.max(b).max(c);
            let (offset, height) = parabola(a, top, c);
            prop_assert!(offset.abs() <= 0.5 && height >= top * (1.0 - 1e-12));
        }
    }
}
