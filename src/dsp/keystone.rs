//! Keystone transform: the range-Doppler spectrum without range migration (CONVENTIONS eq. 89). Its scales, and
//! the host side of the kernel, which takes the place of the Doppler transform in [`super::fft`].

use super::fft::{Axis, Method, Piece, fits_workgroup};
use super::fft_pass::{CACHE, PassLayout, Scratch, grid};
use super::transform::{Keystone, Transform};
use crate::base::error::{BadInput, Result};
use crate::gpu::{Access, AnyBuffer, Buffer, Gpu, Kernel, Recorder, Tolerance};
use crate::gpu_struct;
use num_complex::Complex32;

gpu_struct! {
    /// Uniform of `shaders/dsp/keystone.wgsl`.
    pub struct KeystoneParams {
        pub step: u32,
        pub lines: u32,
        pub samples: u32,
        pub first_sample: u32,
        pub length: u32,
        pub first: u32,
        pub count: u32,
        pub chirps: u32,
        pub rows: u32,
        pub half: u32,
        pub base: u32,
        pub position_step: u32,
        pub channel_step: u32,
        pub turn: u32,
        pub ramp_low: u32,
        pub ramp_high: u32,
    }
}

/// The kernel's row: sources, parameters, bindings and tolerance.
pub static KERNEL: Kernel = Kernel {
    stem: "dsp/keystone",
    sources: &[
        // For products of 64 bits.
        include_str!("../../shaders/shared/rng.wgsl"),
        include_str!("../../shaders/shared/complex.wgsl"),
        include_str!("../../shaders/shared/phase.wgsl"),
        include_str!("../../shaders/dsp/keystone.wgsl"),
    ],
    workgroup: [64, 1, 1],
    params: Some(KeystoneParams::LAYOUT),
    storage: &[Access::Read, Access::Read, Access::Read, Access::ReadWrite],
    structs: &[],
    tolerance: Tolerance {
        relative_l2: 8.5e-7,
        reason: "c eps sqrt(3 log2 L + log2 N) for three transforms over chirps and one over samples with c = 1, as \
                 of the FFT: sqrt 50 at L = 8192 and N = 2048; four factors of 5e-8 add little to that",
    },
};

const BEFORE: u32 = 0;

const CHIRP: u32 = 1;

const PRODUCT: u32 = 2;

const AFTER: u32 = 3;

/// Values between two passes at most: enough threads for any GPU, and little of its memory.
const MOST: usize = 1 << 24;

/// The fraction of `turns` in units of 2^-64.
fn fraction(turns: f64) -> u64 {
    // 1 - 2^-54 rounds to one, whose fraction is none.
    ((turns - turns.floor()) * 2f64.powi(64)) as u128 as u64
}

fn words(x: u64) -> [u32; 2] {
    [x as u32, (x >> 32) as u32]
}

/// What all channels of a spectrum share.
pub(super) struct Warp {
    axis: Axis,
    /// Length of the convolution.
    length: usize,
    /// Lines that are transformed together.
    lines: usize,
    steps: Buffer<[u32; 4]>,
    weights: Buffer<Complex32>,
    fold: i32,
}

impl Warp {
    /// Prepares the warp of a cube with this transform.
    ///
    /// # Errors
    /// Returns an error for a wrong scale, or for a line too long for the adapter.
    pub fn new(
        recorder: &mut Recorder<'_>,
        gpu: &Gpu,
        t: &Transform,
        keystone: &Keystone,
        method: Option<Method>,
    ) -> Result<Warp> {
        Keystone::check(&keystone.scale, t.samples)?;
        let length = (t.doppler_rows() + t.chirps - 1).next_power_of_two();
        let fits = (gpu.max_binding_bytes() as usize / size_of::<Complex32>()).min(MOST.max(length)) / length;
        // A CPU's driver wants what lies between passes in the cache.
        let lines = if gpu.is_hardware() { fits } else { fits.min((CACHE / length).max(64)) };
        if lines == 0 {
            return Err(BadInput::new(
                "a buffer of this adapter cannot hold the keystone transform of one sample",
            )
            .key("processing.doppler_fft")
            .value(t.doppler_fft)
            .allowed(format!("{} bytes a buffer", gpu.max_binding_bytes()))
            .remedy("use --device cpu")
            .into());
        }
        let method = method.filter(|m| *m == Method::Passes || fits_workgroup(length));
        let method = method.unwrap_or_else(|| Method::of(gpu, length));
        let fold = f64::from(keystone.fold) / t.bands as f64;
        let steps: Vec<[u32; 4]> = keystone
            .scale
            .iter()
            .map(|s| {
                let [a, b] = words(fraction(s / (8.0 * t.doppler_fft as f64)));
                let [c, d] = words(fraction(0.5 * fold * s));
                [a, b, c, d]
            })
            .collect();
        let weights: Vec<Complex32> =
            t.doppler_window.iter().map(|w| Complex32::new(*w as f32, 0.0)).collect();
        Ok(Warp {
            axis: Axis::new(gpu, recorder, method, length, &vec![1.0; length]),
            length,
            lines,
            steps: recorder.upload("keystone steps", &steps),
            weights: recorder.upload("window", &weights),
            fold: keystone.fold,
        })
    }

    /// Records the warped transform from chirps to rows of `channels` channels, whose samples are in `pieces`; `out`
    /// holds `[row, channel, sample]` of all bands' rows in turn, each buffer from its row on.
    pub fn record(
        &self,
        recorder: &mut Recorder<'_>,
        scratch: &mut Scratch,
        t: &Transform,
        pieces: &[Piece<'_>],
        channels: usize,
        out: &[(usize, Buffer<Complex32>)],
    ) {
        let samples = self.lines.min(t.samples);
        let together = (self.lines / samples).clamp(1, channels);
        let room = self.length * samples * together;
        let a: Buffer<Complex32> = recorder.buffer("keystone values", room);
        let b: Buffer<Complex32> = recorder.buffer("keystone spectra", room);
        let chirps: Buffer<Complex32> = recorder.buffer("chirp spectra", self.length * samples);
        for first_sample in (0..t.samples).step_by(samples) {
            let samples = samples.min(t.samples - first_sample);
            let block = |channels: usize| KeystoneParams {
                step: CHIRP,
                lines: (samples * channels) as u32,
                samples: samples as u32,
                first_sample: first_sample as u32,
                length: self.length as u32,
                first: 0,
                count: self.length as u32,
                chirps: t.chirps as u32,
                rows: t.doppler_rows() as u32,
                half: (t.doppler_rows() / 2) as u32,
                base: 0,
                position_step: 0,
                channel_step: 0,
                turn: 0,
                ramp_low: 0,
                ramp_high: 0,
            };
            self.multiply(recorder, &block(1), &self.weights, &self.weights, &a);
            self.transform(recorder, scratch, samples, &a, &chirps);
            for first_channel in (0..channels).step_by(together) {
                let p = block(together.min(channels - first_channel));
                for stored in 0..t.bands {
                    self.before(recorder, t, pieces, (first_channel, stored), &p, &a);
                    self.transform(recorder, scratch, p.lines as usize, &a, &b);
                    self.multiply(recorder, &KeystoneParams { step: PRODUCT, ..p }, &b, &chirps, &a);
                    self.transform(recorder, scratch, p.lines as usize, &a, &b);
                    self.after(recorder, t, (channels, first_channel, stored), &p, &b, out);
                }
            }
        }
    }

    fn multiply(
        &self,
        recorder: &mut Recorder<'_>,
        p: &KeystoneParams,
        values: &dyn AnyBuffer,
        factors: &dyn AnyBuffer,
        to: &dyn AnyBuffer,
    ) {
        recorder.dispatch(&KERNEL, p, &[values, factors, &self.steps, to], grid(p.lines, p.count, true));
    }

    fn transform(
        &self,
        recorder: &mut Recorder<'_>,
        scratch: &mut Scratch,
        lines: usize,
        from: &Buffer<Complex32>,
        to: &Buffer<Complex32>,
    ) {
        let step = lines as u32;
        let layout = PassLayout {
            lines,
            in_line: 1,
            in_step: step,
            out_line: 1,
            out_step: step,
            kept: self.length as u32,
            side_by_side: lines > 1,
            ..Default::default()
        };
        self.axis.record(recorder, scratch, from, to, layout);
    }

    fn before(
        &self,
        recorder: &mut Recorder<'_>,
        t: &Transform,
        pieces: &[Piece<'_>],
        (first_channel, stored): (usize, usize),
        p: &KeystoneParams,
        to: &Buffer<Complex32>,
    ) {
        // The transmitter whose echoes of this fold the band holds is turned back from chirp to chirp.
        let bands = t.bands as i64;
        let tx = (i64::from(self.fold) - stored as i64).rem_euclid(bands);
        let [ramp_low, ramp_high] = words(fraction(tx as f64 / bands as f64));
        let middle = 0.5 * (t.chirps as f64 - 1.0);
        let common = f64::from(self.fold) / bands as f64 * middle;
        for piece in pieces {
            let last = piece.first_chirp + piece.chirps == t.chirps;
            let end = if last { self.length } else { piece.first_chirp + piece.chirps };
            let row = (piece.channels * t.samples) as u32;
            let base = ((piece.first_channel + first_channel) * t.samples) as u32;
            let params = KeystoneParams {
                step: BEFORE,
                first: piece.first_chirp as u32,
                count: (end - piece.first_chirp) as u32,
                base: base.wrapping_sub(piece.first_chirp as u32 * row),
                position_step: row,
                channel_step: t.samples as u32,
                turn: words(fraction(common))[1],
                ramp_low,
                ramp_high,
                ..*p
            };
            self.multiply(recorder, &params, piece.data, &self.weights, to);
        }
    }

    fn after(
        &self,
        recorder: &mut Recorder<'_>,
        t: &Transform,
        (channels, first_channel, stored): (usize, usize, usize),
        p: &KeystoneParams,
        from: &Buffer<Complex32>,
        out: &[(usize, Buffer<Complex32>)],
    ) {
        let row = channels * t.samples;
        let [ramp_low, ramp_high] = words(fraction((t.chirps as f64 - 1.0) / (2.0 * t.doppler_fft as f64)));
        let band = stored * t.doppler_rows()..(stored + 1) * t.doppler_rows();
        for (first, buffer) in out {
            let rows = band.start.max(*first)..band.end.min(first + buffer.len() / row);
            if rows.is_empty() {
                continue;
            }
            let base = (first_channel * t.samples) as u32;
            let params = KeystoneParams {
                step: AFTER,
                first: (rows.start - band.start) as u32,
                count: rows.len() as u32,
                base: base
                    .wrapping_add((band.start as u32).wrapping_sub(*first as u32).wrapping_mul(row as u32)),
                position_step: row as u32,
                channel_step: t.samples as u32,
                ramp_low,
                ramp_high,
                ..*p
            };
            self.multiply(recorder, &params, from, &self.weights, buffer);
        }
    }
}
