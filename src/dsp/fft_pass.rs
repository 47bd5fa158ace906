//! Transforms of any length on the device by passes over global memory: mixed radix, and Bluestein's
//! transform for lengths with a large prime factor (CONVENTIONS eq. 86).

use super::fft_params::FftPassParams;
use super::{fft_any, fft_chirp, fft_radix8, fft_radix16};
use crate::gpu::{AnyBuffer, Buffer, Recorder, Threads};
use num_complex::{Complex32, Complex64};
use std::f64::consts::TAU;

/// Values of a block of lines where blocks have to fit a cache.
pub(super) const CACHE: usize = 1 << 18;

/// Largest prime factor that a pass takes as a plain sum.
const LARGEST_PRIME: usize = 31;

/// The radices of the passes of a length; None when a prime factor is too large.
fn radices(length: usize) -> Option<Vec<usize>> {
    let mut out = Vec::new();
    let twos = length.trailing_zeros() as usize;
    match twos {
        0 => {}
        1 | 2 => out.push(1 << twos),
        5 => out.extend([8, 4]),
        // 4 a + 3 b = twos with the fewest.
        _ => {
            let eights = (4 - twos % 4) % 4;
            out.extend(std::iter::repeat_n(16, (twos - 3 * eights) / 4));
            out.extend(std::iter::repeat_n(8, eights));
        }
    }
    let mut rest = length >> twos;
    let mut prime = 3;
    while rest > 1 {
        if prime > LARGEST_PRIME {
            return None;
        }
        if rest.is_multiple_of(prime) {
            out.push(prime);
            rest /= prime;
        } else {
            prime += 2;
        }
    }
    if out.is_empty() {
        out.push(1);
    }
    Some(out)
}

/// Length of the transforms that a transform of this length is made from: itself, or the power of two that
/// holds Bluestein's convolution.
pub(super) fn work_length(length: usize) -> usize {
    if radices(length).is_some() { length } else { (2 * length - 1).next_power_of_two() }
}

fn narrow(values: impl IntoIterator<Item = Complex64>) -> Vec<Complex32> {
    values.into_iter().map(|z| Complex32::new(z.re as f32, z.im as f32)).collect()
}

/// e^(-j 2 pi i / n).
pub(super) fn twiddles(n: usize) -> Vec<Complex32> {
    narrow((0..n).map(|i| Complex64::cis(-TAU * i as f64 / n as f64)))
}

/// Where the values of lines lie, and which positions of their spectra are kept.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct PassLayout {
    pub lines: usize,
    pub in_base: u32,
    pub in_line: u32,
    /// Step from value to value of the input; negative steps wrap.
    pub in_step: u32,
    pub out_base: u32,
    pub out_line: u32,
    pub out_step: u32,
    pub shift: u32,
    pub first: u32,
    pub kept: u32,
    /// Lines, and not values of a line, lie side by side in memory.
    pub side_by_side: bool,
}

/// Buffers between passes, which one recorder's transforms share.
#[derive(Default)]
pub(super) struct Scratch([Option<Buffer<Complex32>>; 2]);

impl Scratch {
    fn get(&mut self, recorder: &mut Recorder<'_>, which: usize, len: usize) -> Buffer<Complex32> {
        match &self.0[which] {
            Some(buffer) if buffer.len() >= len => buffer.clone(),
            _ => {
                let buffer = recorder.buffer("fft passes", len);
                self.0[which] = Some(buffer.clone());
                buffer
            }
        }
    }
}

/// Tables of one axis on the device.
pub(super) struct Passes {
    length: usize,
    /// Number of values of an input line.
    count: usize,
    plan: Plan,
    twiddles: Buffer<Complex32>,
    weights: Buffer<Complex32>,
    radices: Vec<usize>,
    /// Lines that go through the passes together.
    block_lines: usize,
}

enum Plan {
    Direct,
    Bluestein { length: usize, ones: Buffer<Complex32>, kernel: Buffer<Complex32>, after: Buffer<Complex32> },
}

impl Passes {
    /// For lines of `weights.len()` values, multiplied by these.
    pub fn new(recorder: &mut Recorder<'_>, hardware: bool, length: usize, weights: &[f64]) -> Passes {
        let work = work_length(length);
        // A GPU wants many threads; with a CPU's driver what lies between passes stays in the cache.
        let block_lines = if hardware { usize::MAX } else { (CACHE / work).max(64) };
        let chirp = (work != length).then(|| fft_chirp::chirp(length));
        let weights: Vec<Complex32> = match &chirp {
            None => weights.iter().map(|w| Complex32::new(*w as f32, 0.0)).collect(),
            Some(chirp) => narrow(weights.iter().zip(chirp).map(|(w, c)| c * w)),
        };
        let plan = match chirp {
            None => Plan::Direct,
            Some(chirp) => Plan::Bluestein {
                length: work,
                ones: recorder.upload("ones", &vec![Complex32::new(1.0, 0.0); work]),
                kernel: recorder.upload("chirp spectrum", &narrow(fft_chirp::kernel(length, work))),
                after: recorder.upload("chirp", &narrow(chirp)),
            },
        };
        Passes {
            length,
            count: weights.len(),
            plan,
            twiddles: recorder.upload("twiddles", &twiddles(work)),
            weights: recorder.upload("weights", &weights),
            radices: radices(work).unwrap_or_default(),
            block_lines,
        }
    }

    /// Records the transform of all lines, in blocks.
    pub fn record(
        &self,
        recorder: &mut Recorder<'_>,
        scratch: &mut Scratch,
        from: &dyn AnyBuffer,
        to: &dyn AnyBuffer,
        layout: PassLayout,
    ) {
        for first in (0..layout.lines).step_by(self.block_lines) {
            let at = first as u32;
            let block = PassLayout {
                lines: self.block_lines.min(layout.lines - first),
                in_base: layout.in_base.wrapping_add(at * layout.in_line),
                out_base: layout.out_base + at * layout.out_line,
                ..layout
            };
            self.record_block(recorder, scratch, from, to, block);
        }
    }

    fn record_block(
        &self,
        recorder: &mut Recorder<'_>,
        scratch: &mut Scratch,
        from: &dyn AnyBuffer,
        to: &dyn AnyBuffer,
        layout: PassLayout,
    ) {
        let Plan::Bluestein { length, ones, kernel, after } = &self.plan else {
            self.passes(recorder, scratch, (from, self.count, &self.weights), to, layout);
            return;
        };
        let len = layout.lines * length;
        let (a, b) = (
            recorder.buffer::<Complex32>("chirp values", len),
            recorder.buffer::<Complex32>("chirp spectra", len),
        );
        let inner = self.between(layout, *length);
        let chirp =
            |length: usize, count: usize, l: &PassLayout, conjugate: [u32; 2]| fft_chirp::FftChirpParams {
                lines: l.lines as u32,
                length: length as u32,
                count: count as u32,
                in_base: l.in_base,
                in_line: l.in_line,
                in_step: l.in_step,
                out_base: l.out_base,
                out_line: l.out_line,
                out_step: l.out_step,
                shift: l.shift,
                first: l.first,
                kept: l.kept,
                lines_first: u32::from(l.side_by_side),
                conjugate_in: conjugate[0],
                conjugate_out: conjugate[1],
            };
        let multiply =
            |recorder: &mut Recorder<'_>, p: fft_chirp::FftChirpParams, storage: [&dyn AnyBuffer; 3]| {
                let threads = grid(p.lines, p.length, p.lines_first == 1);
                recorder.dispatch(&fft_chirp::KERNEL, &p, &storage, threads);
            };
        let before = PassLayout {
            out_base: 0,
            out_line: inner.out_line,
            out_step: inner.out_step,
            shift: 0,
            first: 0,
            kept: *length as u32,
            ..layout
        };
        multiply(recorder, chirp(*length, self.count, &before, [0, 0]), [from, &self.weights, &a]);
        self.passes(recorder, scratch, (&a, *length, ones), &b, inner);
        multiply(recorder, chirp(*length, *length, &inner, [0, 1]), [&b, kernel, &a]);
        self.passes(recorder, scratch, (&a, *length, ones), &b, inner);
        let last = PassLayout { in_base: 0, in_line: inner.in_line, in_step: inner.in_step, ..layout };
        multiply(recorder, chirp(self.length, self.length, &last, [1, 0]), [&b, after, to]);
    }

    /// Whole lines of `length` values from and to buffers of our own.
    fn between(&self, layout: PassLayout, length: usize) -> PassLayout {
        let lines = layout.lines as u32;
        let (line, step) = if layout.side_by_side { (1, lines) } else { (length as u32, 1) };
        PassLayout {
            in_base: 0,
            in_line: line,
            in_step: step,
            out_base: 0,
            out_line: line,
            out_step: step,
            shift: 0,
            first: 0,
            kept: length as u32,
            ..layout
        }
    }

    fn passes(
        &self,
        recorder: &mut Recorder<'_>,
        scratch: &mut Scratch,
        (from, count, weights): (&dyn AnyBuffer, usize, &Buffer<Complex32>),
        to: &dyn AnyBuffer,
        layout: PassLayout,
    ) {
        let length = self.twiddles.len();
        let inner = self.between(layout, length);
        let last = self.radices.len() - 1;
        let mut done = 1;
        let mut source: Option<Buffer<Complex32>> = None;
        for (i, radix) in self.radices.iter().enumerate() {
            let target = (i != last).then(|| scratch.get(recorder, i % 2, layout.lines * length));
            let (input, output) =
                (if i == 0 { layout } else { inner }, if i == last { layout } else { inner });
            let butterflies = length / radix;
            let threads = if matches!(radix, 8 | 16) { butterflies } else { length };
            // Lanes go where there are many.
            let lines_first = layout.side_by_side || threads < 32;
            let params = FftPassParams {
                lines: layout.lines as u32,
                length: length as u32,
                butterflies: butterflies as u32,
                done: done as u32,
                turn: if i == 0 { 0 } else { (butterflies / done) as u32 },
                count: if i == 0 { count } else { length } as u32,
                in_base: input.in_base,
                in_line: input.in_line,
                in_step: input.in_step,
                out_base: output.out_base,
                out_line: output.out_line,
                out_step: output.out_step,
                shift: output.shift,
                first: output.first,
                kept: output.kept,
                lines_first: u32::from(lines_first),
            };
            let values: &dyn AnyBuffer = match &source {
                Some(buffer) => buffer,
                None => from,
            };
            let multipliers = if i == 0 { weights } else { &self.twiddles };
            let result: &dyn AnyBuffer = match &target {
                Some(buffer) => buffer,
                None => to,
            };
            let threads = grid(params.lines, threads as u32, lines_first);
            match radix {
                16 => {
                    recorder.dispatch(&fft_radix16::KERNEL, &params, &[values, multipliers, result], threads)
                }
                8 => recorder.dispatch(&fft_radix8::KERNEL, &params, &[values, multipliers, result], threads),
                _ => recorder.dispatch(
                    &fft_any::KERNEL,
                    &params,
                    &[values, multipliers, &self.twiddles, result],
                    threads,
                ),
            }
            done *= radix;
            source = target;
        }
    }
}

/// Threads of a pass: lines by work of a line, either along x; what y holds not goes on in z.
pub(super) fn grid(lines: u32, work: u32, lines_first: bool) -> Threads {
    let (fast, slow) = if lines_first { (lines, work) } else { (work, lines) };
    Threads::Grid([fast, slow.min(1 << 15), slow.div_ceil(1 << 15)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radices_make_up_the_length() {
        for length in 1..5000 {
            match radices(length) {
                Some(r) => assert_eq!(r.iter().product::<usize>(), length),
                None => {
                    assert!(work_length(length).is_power_of_two() && work_length(length) >= 2 * length - 1)
                }
            }
        }
        for (log2, passes) in [(4, 1), (6, 2), (9, 3), (10, 3), (12, 3), (14, 4)] {
            assert_eq!(radices(1 << log2).unwrap().len(), passes);
        }
        assert_eq!(radices(37), None);
    }

    /// Bluestein's identity by slow sums.
    #[test]
    fn chirps_make_a_transform() {
        let n = 37;
        let m = work_length(n);
        let x: Vec<Complex64> = (0..n).map(|i| Complex64::cis(0.3 * (i * i) as f64)).collect();
        let c = fft_chirp::chirp(n);
        let kernel = fft_chirp::kernel(n, m);
        let mut a: Vec<Complex64> = (0..m).map(|i| if i < n { x[i] * c[i] } else { 0.0.into() }).collect();
        catseye_math::fft::forward(m).process(&mut a);
        a.iter_mut().zip(&kernel).for_each(|(a, k)| *a *= k);
        catseye_math::fft::inverse(m).process(&mut a);
        for k in 0..n {
            let want: Complex64 =
                (0..n).map(|i| x[i] * Complex64::cis(-TAU * (i * k % n) as f64 / n as f64)).sum();
            assert!((a[k] * c[k] - want).norm() < 1e-12);
        }
    }
}
