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
        pub log2_parts: u32,
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
    workgroup: [128, 1, 1],
    params: Some(GridFftParams::LAYOUT),
    storage: &[Access::Read, Access::Read, Access::ReadWrite],
    structs: &[],
    tolerance: Tolerance {
        relative_l2: 6e-7,
        reason: "c eps sqrt(log2 N) with c = 1.5, N up to 4096, eps = 1.19e-7",
    },
};

/// Number of the values that a workgroup works on: what the 16 KiB hold that every adapter has.
const TILE: usize = 2048;

/// Length of the longest line, which two workgroups share.
pub const LONGEST: usize = 2 * TILE;

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
    let parts = cells.div_ceil(TILE);
    let params = GridFftParams {
        lines: lines as u32,
        log2_cells: cells.ilog2(),
        samples: samples as u32,
        log2_parts: parts.ilog2(),
    };
    let groups = (lines * parts).div_ceil(TILE * parts / cells) as u64;
    let threads = Threads::Linear(groups * u64::from(KERNEL.workgroup[0]));
    recorder.dispatch(&KERNEL, &params, &[grid, &turns, &out], threads);
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adc::grid_device::DEVICE_COSTS;
    use crate::base::rng::philox4x32_10;
    use crate::gpu::compare::{check_close, opened_for_tests, test_gpu};
    use crate::gpu::{Gpu, Profile};
    use catseye_math::fft::inverse;

    /// The layout with the most samples for which a line has so many cells.
    fn layout(cells: usize) -> GridLayout {
        let samples = (cells as f64 / 1.375).floor() as usize;
        let layout = GridLayout::still(samples, &DEVICE_COSTS);
        assert_eq!(layout.cells, cells);
        layout
    }

    fn values(len: usize) -> Vec<Complex32> {
        let unit = |w: u32| (f64::from(w) / 4_294_967_296.0 - 0.5) as f32;
        (0..len as u32)
            .map(|i| {
                let [re, im, ..] = philox4x32_10([i, 0, 0, 0], [7, 0]);
                Complex32::new(unit(re), unit(im))
            })
            .collect()
    }

    fn transformed(gpu: &Gpu, layout: &GridLayout, grid: &[Complex32]) -> Vec<Complex32> {
        let mut recorder = gpu.recorder("grid fft");
        let grid = recorder.upload("grid", grid);
        let out = record(&mut recorder, layout, &grid);
        let out = recorder.read(&out);
        recorder.submit().unwrap().take(out)
    }

    /// Every length that lines have, with lines that do not fill the last workgroup.
    #[test]
    fn all_lengths_agree_with_f64() {
        for log2_cells in 4..=LONGEST.ilog2() {
            let layout = layout(1 << log2_cells);
            let (cells, samples, lines) = (layout.cells, layout.samples, 2 * LONGEST / layout.cells + 3);
            let grid = values(lines * cells);
            let got = transformed(test_gpu(), &layout, &grid);
            let fft = inverse::<f64>(cells);
            let mut want = Vec::with_capacity(lines * samples);
            for line in grid.chunks_exact(cells) {
                let mut wide: Vec<Complex64> =
                    line.iter().map(|z| Complex64::new(z.re.into(), z.im.into())).collect();
                fft.process(&mut wide);
                want.extend((0..samples).map(|s| wide[(s + cells - samples / 2) % cells]));
            }
            check_close(
                bytemuck::cast_slice(&got),
                bytemuck::cast_slice(&want),
                KERNEL.tolerance.relative_l2,
            )
            .unwrap_or_else(|e| panic!("{cells} cells: {e}"));
        }
    }

    /// Time of 4 Mi cells in lines of each length, by the device's clock, the least of five.
    #[test]
    #[ignore = "times, not checks"]
    fn speed() {
        let gpu = opened_for_tests().with_profiling();
        for log2_cells in 4..=LONGEST.ilog2() {
            let layout = layout(1 << log2_cells);
            let grid = values(1 << 22);
            let time = || {
                let before = gpu.profile();
                transformed(&gpu, &layout, &grid);
                let used = gpu.profile().zip(before).map(|(now, before)| now.since(&before));
                used.as_ref().and_then(Profile::seconds).unwrap_or(f64::NAN)
            };
            let least = (0..5).map(|_| time()).fold(f64::INFINITY, f64::min);
            println!("{:5} cells: {:8.3} ms", layout.cells, 1e3 * least);
        }
    }
}
