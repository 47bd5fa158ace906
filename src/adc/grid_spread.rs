//! Echoes onto a grid: host side of the kernel (CONVENTIONS eq. 83).

use super::grid_echoes::GridEchoes;
use super::gridding::{Bell, GridLayout, TAPS};
use super::synthesis::fixed_turns;
use crate::gpu::{Access, Buffer, Kernel, Recorder, Threads, Tolerance};
use crate::gpu_struct;
use num_complex::Complex32;
use std::ops::Range;

gpu_struct! {
    /// Uniform of `shaders/adc/grid_spread.wgsl`.
    pub struct GridSpreadParams {
        pub cell_a: [f32; 4],
        pub cell_b: [f32; 4],
        pub cell_c: [f32; 4],
        pub cell_d: [f32; 4],
        pub line_a: [f32; 4],
        pub line_b: [f32; 4],
        pub line_c: [f32; 4],
        pub line_d: [f32; 4],
        pub echoes: u32,
        pub channels: u32,
        pub blocks: u32,
        pub lines: u32,
        pub log2_cells: u32,
        pub block: u32,
        pub first_middle: i32,
        pub per_step: f32,
        pub whole: u32,
        pub bend_slope: f32,
        pub mixed_slope: f32,
        pub pad: u32,
    }
}

gpu_struct! {
    /// One echo as the shader reads it.
    pub struct DeviceEcho {
        pub amplitude: [f32; 2],
        pub a0: u32,
        pub a1: u32,
        pub b0: u32,
        pub b1: f32,
        pub a2: f32,
        pub line: i32,
        pub beyond: f32,
        pub a3: f32,
        pub b2: f32,
        pub bend: f32,
        pub mixed: f32,
        pub pad: u32,
    }
}

gpu_struct! {
    /// Echoes that can reach a line.
    pub struct Span {
        pub first: u32,
        pub end: u32,
    }
}

/// The kernel's row: sources, parameters, bindings and tolerance.
pub static KERNEL: Kernel = Kernel {
    stem: "adc/grid_spread",
    sources: &[
        include_str!("../../shaders/shared/linear.wgsl"),
        include_str!("../../shaders/shared/complex.wgsl"),
        include_str!("../../shaders/shared/phase.wgsl"),
        include_str!("../../shaders/adc/grid_spread.wgsl"),
    ],
    workgroup: [64, 1, 1],
    params: Some(GridSpreadParams::LAYOUT),
    storage: &[Access::Read, Access::Read, Access::ReadWrite],
    structs: &[DeviceEcho::LAYOUT, Span::LAYOUT],
    tolerance: Tolerance {
        relative_l2: 2e-5,
        reason: "of the whole synthesis: images of the grid and what the warp leaves over 1.5e-5 together, f32 2e-6",
    },
};

/// Echoes that one thread walks over: below [`LOOP_LIMIT`](crate::gpu::LOOP_LIMIT).
const SPAN: usize = 60_000;

fn quarters(bell: &Bell) -> [[f32; 4]; 4] {
    let mut q = [[0.0; 4]; 4];
    for (to, c) in q.as_flattened_mut().iter_mut().zip(&bell.polynomial) {
        *to = *c;
    }
    q
}

/// Echoes of a set in an order that suits the lines.
pub struct Sorted {
    order: Vec<u32>,
    /// Echoes that can reach each line.
    spans: Vec<Range<usize>>,
    whole: bool,
}

impl Sorted {
    /// Shares the echoes out among the lines in equal numbers, for echoes that go into one line each.
    pub fn shared_out(echoes: &GridEchoes, lines: usize) -> Sorted {
        let n = echoes.count;
        Sorted {
            order: (0..n as u32).collect(),
            spans: (0..lines).map(|l| n * l / lines..n * (l + 1) / lines).collect(),
            whole: true,
        }
    }

    /// Sorts the echoes by their place among the lines of the layout.
    pub fn by_line(echoes: &GridEchoes, layout: &GridLayout) -> Sorted {
        if layout.lines == 1 {
            return Sorted {
                order: (0..echoes.count as u32).collect(),
                spans: std::iter::once(0..echoes.count).collect(),
                whole: true,
            };
        }
        let place = |a1: f64| (a1 - layout.first_line) / layout.line_step;
        let n = echoes.count;
        let mut order: Vec<u32> = (0..n as u32).collect();
        order.sort_by(|i, j| echoes.a1[*i as usize].total_cmp(&echoes.a1[*j as usize]));
        // The order is that of the first channel in the middle of the frame; others are a little off.
        let furthest = layout.middle(0).abs().max(layout.middle(layout.blocks() - 1).abs());
        let bent = |i: usize| furthest * (2.0 * echoes.a2[i].abs() + 3.0 * furthest * echoes.a3[i].abs());
        let off = |i: usize| (echoes.a1[i] - echoes.a1[i % n]).abs() + bent(i);
        let slack = (0..echoes.a1.len()).map(off).fold(0.0, f64::max) / layout.line_step;
        // What a bend adds to the slope in a block of an even number of chirps stays below a quarter of a line.
        let reach = 0.5 * TAPS as f64 + slack + 0.25;
        let places: Vec<f64> = order.iter().map(|i| place(echoes.a1[*i as usize])).collect();
        let spans = (0..layout.lines)
            .map(|l| {
                let l = l as f64;
                places.partition_point(|p| *p < l - reach)..places.partition_point(|p| *p <= l + reach)
            })
            .collect();
        Sorted { order, spans, whole: false }
    }

    /// Number of lines that hold an echo.
    pub fn lines(&self) -> usize {
        self.spans.len()
    }
}

/// Records the spreading of some channels over a grid `[channel, block, line, cell]`.
pub fn record(
    recorder: &mut Recorder,
    layout: &GridLayout,
    echoes: &GridEchoes,
    sorted: &Sorted,
    channels: Range<usize>,
) -> Buffer<Complex32> {
    let (count, lines, blocks) = (echoes.count, sorted.lines(), layout.blocks());
    let grid = recorder.zeros("grid", channels.len() * blocks * lines * layout.cells);
    let mut list = Vec::with_capacity(channels.len() * count);
    for channel in channels.clone() {
        list.extend(sorted.order.iter().map(|i| {
            let i = channel * count + *i as usize;
            let place = match layout.line_step {
                0.0 => 0.0,
                step => (echoes.a1[i] - layout.first_line) / step,
            };
            DeviceEcho {
                amplitude: [echoes.amplitude[i].re, echoes.amplitude[i].im],
                a0: fixed_turns(echoes.a0[i]),
                a1: fixed_turns(echoes.a1[i]),
                b0: fixed_turns(echoes.b0[i]),
                b1: echoes.b1[i] as f32,
                a2: echoes.a2[i] as f32,
                line: place.floor() as i32,
                beyond: (place - place.floor()) as f32,
                a3: echoes.a3[i] as f32,
                b2: echoes.b2[i] as f32,
                bend: (echoes.a2[i] - layout.warp.a2.at(echoes.a1[i])) as f32,
                mixed: (echoes.b1[i] - layout.warp.b1.at(echoes.a1[i])) as f32,
                pad: 0,
            }
        }));
    }
    let list = recorder.upload("echoes", &list);
    let ([cell_a, cell_b, cell_c, cell_d], [line_a, line_b, line_c, line_d]) =
        (quarters(&layout.cell_bell), quarters(&layout.line_bell));
    let params = GridSpreadParams {
        cell_a,
        cell_b,
        cell_c,
        cell_d,
        line_a,
        line_b,
        line_c,
        line_d,
        echoes: count as u32,
        channels: channels.len() as u32,
        blocks: blocks as u32,
        lines: lines as u32,
        log2_cells: layout.cells.ilog2(),
        block: layout.block as u32,
        first_middle: layout.middle(0) as i32,
        per_step: if layout.line_step == 0.0 { 0.0 } else { (1.0 / layout.line_step) as f32 },
        whole: u32::from(sorted.whole),
        bend_slope: layout.warp.a2.slope as f32,
        mixed_slope: layout.warp.b1.slope as f32,
        pad: 0,
    };
    let threads = (channels.len() * blocks * lines) as u64;
    let longest = sorted.spans.iter().map(Range::len).max().unwrap_or(0);
    for from in (0..longest).step_by(SPAN) {
        let spans: Vec<Span> = sorted
            .spans
            .iter()
            .map(|s| Span {
                first: (s.start + from).min(s.end) as u32,
                end: (s.start + from + SPAN).min(s.end) as u32,
            })
            .collect();
        let spans = recorder.upload("spans", &spans);
        recorder.dispatch(&KERNEL, &params, &[&list, &spans, &grid], Threads::Linear(threads));
    }
    grid
}
