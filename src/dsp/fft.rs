//! Range and Doppler transforms: sizes, windows and the host side of the kernel (CONVENTIONS
//! eq. 14).

use super::device::{Chunk, DeviceSpectrum};
use super::window;
use crate::adc::Cube;
use crate::error::{BadInput, Result};
use crate::gpu::{Access, Buffer, Gpu, Kernel, Recorder, Threads, Tolerance};
use crate::gpu_struct;
use crate::scene::radar::{Processing, Radar, Sampling};
use crate::scene::waveform::Multiplex;
use num_complex::{Complex32, Complex64};
use std::f64::consts::TAU;

/// The two transforms of a cube: `[chirp, channel, sample]` to `[doppler, channel, range]`.
/// The windows are scaled so that eq. 14 holds with a plain sum: they carry 1/sum(w), and sqrt 2 for
/// real sampling.
#[derive(Debug, Clone, PartialEq)]
pub struct Transform {
    pub chirps: usize,
    pub channels: usize,
    pub samples: usize,
    pub range_fft: usize,
    /// Bins kept: half of `range_fft` for real sampling.
    pub range_bins: usize,
    pub doppler_fft: usize,
    /// Doppler bands that become channels (DDM), else 1: spectrum `[doppler / bands, band, channel, range]`.
    pub bands: usize,
    /// One weight a sample.
    pub range_window: Vec<f64>,
    /// One weight a chirp.
    pub doppler_window: Vec<f64>,
}

impl Transform {
    /// Errors: an empty cube, or a transform shorter than the data.
    pub fn new(
        chirps: usize,
        channels: usize,
        samples: usize,
        sampling: Sampling,
        processing: &Processing,
    ) -> Result<Self> {
        for (key, count, fft) in [
            ("processing.range_fft", samples, processing.range_fft),
            ("processing.doppler_fft", chirps, processing.doppler_fft),
        ] {
            if count == 0 || channels == 0 {
                return Err(BadInput::new("the cube is empty")
                    .key("cube")
                    .value(format!("{chirps} x {channels} x {samples}"))
                    .allowed("at least one chirp, channel and sample")
                    .into());
            }
            if fft < count {
                return Err(BadInput::new("the FFT is shorter than the data")
                    .key(key)
                    .value(fft)
                    .allowed(format!("{count} or more"))
                    .into());
            }
        }
        let (range_bins, gain) = match sampling {
            Sampling::Real if processing.range_fft < 2 => {
                return Err(BadInput::new("real sampling needs a range FFT of at least 2")
                    .key("processing.range_fft")
                    .value(processing.range_fft)
                    .into());
            }
            Sampling::Real => (processing.range_fft / 2, std::f64::consts::SQRT_2),
            Sampling::Iq => (processing.range_fft, 1.0),
        };
        let scaled = |w: Vec<f64>, gain: f64| {
            let sum: f64 = w.iter().sum();
            w.iter().map(|v| v * gain / sum).collect()
        };
        Ok(Transform {
            chirps,
            channels,
            samples,
            range_fft: processing.range_fft,
            range_bins,
            doppler_fft: processing.doppler_fft,
            bands: 1,
            range_window: scaled(window::coefficients(processing.range_window, samples)?, gain),
            doppler_window: scaled(window::coefficients(processing.doppler_window, chirps)?, 1.0),
        })
    }

    /// For a cube of this radar. Errors: a cube whose shape is not the radar's.
    pub fn of_cube<T>(cube: &Cube<T>, radar: &Radar) -> Result<Self> {
        let (shape, want) = (
            [cube.chirps, cube.channels, cube.samples],
            [radar.chirps, radar.channels(), radar.lines().count],
        );
        if shape != want || cube.data.len() != want.iter().product::<usize>() {
            return Err(BadInput::new("the cube does not have the radar's shape [chirp, channel, sample]")
                .key("cube")
                .value(format!("{shape:?} ({} samples)", cube.data.len()))
                .allowed(format!("{want:?}"))
                .remedy("give the radar that the cube was taken with")
                .into());
        }
        let mut t =
            Self::new(cube.chirps, cube.channels, cube.samples, radar.line_sampling(), &radar.processing)?;
        if let Multiplex::Ddm { bands } = radar.multiplex {
            t.bands = bands;
        }
        Ok(t)
    }

    /// Columns of the spectrum: channels x range bins.
    pub fn columns(&self) -> usize {
        self.channels * self.range_bins
    }

    /// The row that transform bin `k` goes to: zero Doppler to row M/2. With B bands row and band as row · B + band: transmitter b is
    /// found b M/B rows before its range rate, and fills band b of the row at it.
    pub fn doppler_row(&self, k: usize) -> usize {
        let rows = self.doppler_fft / self.bands;
        let band = (self.bands - (k + rows / 2) / rows % self.bands) % self.bands;
        (k + rows / 2) % rows * self.bands + band
    }
}

/// Longest transform on the GPU: what a workgroup's 32 KiB hold.
pub const LONGEST: usize = 4096;

gpu_struct! {
    /// Uniform of `shaders/dsp/fft.wgsl`.
    pub struct Params {
        pub lines: u32,
        pub log2_length: u32,
        pub count: u32,
        pub in_line: u32,
        pub in_step: u32,
        pub out_base: u32,
        pub out_line: u32,
        pub out_step: u32,
        pub shift: u32,
        pub first: u32,
        pub kept: u32,
        pub side_by_side: u32,
        pub log2_tile: u32,
    }
}

pub static KERNEL: Kernel = Kernel {
    stem: "dsp/fft",
    sources: &[
        include_str!("../../shaders/shared/linear.wgsl"),
        include_str!("../../shaders/shared/complex.wgsl"),
        include_str!("../../shaders/dsp/fft.wgsl"),
    ],
    workgroup: [256, 1, 1],
    params: Some(Params::LAYOUT),
    storage: &[Access::Read, Access::Read, Access::Read, Access::ReadWrite],
    structs: &[],
    tolerance: Tolerance {
        relative_l2: 6e-7,
        reason: "c eps sqrt(log2 N + log2 M) for two transforms with c = 1: rounding errors of the passes add \
                 like noise; sqrt 24 at the longest lengths and eps = 1.19e-7",
    },
};

/// e^(-j 2 pi i / n).
fn twiddles(n: usize) -> Vec<Complex32> {
    (0..n)
        .map(|i| {
            let z = Complex64::cis(-TAU * i as f64 / n as f64);
            Complex32::new(z.re as f32, z.im as f32)
        })
        .collect()
}

/// Shortest tile of a workgroup: four values for each of its threads.
const SHORTEST_TILE: usize = 1024;

/// One axis of the transform on the device.
struct Axis {
    length: usize,
    weights: Buffer<f32>,
    twiddles: Buffer<Complex32>,
    hardware: bool,
}

impl Axis {
    fn new(gpu: &Gpu, recorder: &mut Recorder<'_>, key: &str, length: usize, window: &[f64]) -> Result<Self> {
        if !length.is_power_of_two() || length > LONGEST {
            return Err(BadInput::new("the GPU has no FFT of this length")
                .key(key)
                .value(length)
                .allowed(format!("a power of two up to {LONGEST}"))
                .remedy("choose such a length, or the device cpu")
                .into());
        }
        let weights: Vec<f32> = window.iter().map(|w| *w as f32).collect();
        Ok(Axis {
            length,
            weights: recorder.upload("window", &weights),
            twiddles: recorder.upload("twiddles", &twiddles(length)),
            hardware: gpu.report().is_hardware,
        })
    }

    fn record(
        &self,
        recorder: &mut Recorder<'_>,
        from: &Buffer<Complex32>,
        to: &Buffer<Complex32>,
        params: Params,
    ) {
        let side_by_side = params.in_line == 1 && params.in_step > 1;
        // On a strided axis a GPU wants many lines together; a CPU's driver wants its cache. The numbers
        // that come out are the same.
        let tile = if side_by_side && self.hardware { LONGEST } else { self.length.max(SHORTEST_TILE) };
        let groups = u64::from(params.lines).div_ceil((tile / self.length) as u64);
        let params = Params {
            log2_length: self.length.ilog2(),
            count: self.weights.len() as u32,
            side_by_side: u32::from(side_by_side),
            log2_tile: tile.ilog2(),
            ..params
        };
        let storage: [&dyn crate::gpu::AnyBuffer; 4] = [from, &self.weights, &self.twiddles, to];
        recorder.dispatch(
            &KERNEL,
            &params,
            &storage,
            Threads::Linear(groups * u64::from(KERNEL.workgroup[0])),
        );
    }
}

/// How a cube is cut so that no buffer passes `limit` bytes: channels together while they fit, then
/// range columns of one channel.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cut {
    channels: usize,
    ranges: usize,
    /// Chirps of one uploaded piece.
    chirps: usize,
}

impl Cut {
    fn new(t: &Transform, limit: u64) -> Result<Self> {
        let fits = (limit / size_of::<Complex32>() as u64) as usize;
        let channels = (fits / (t.doppler_fft * t.range_bins)).clamp(1, t.channels);
        let ranges = (fits / (t.doppler_fft * channels)).min(t.range_bins);
        let chirps = (fits / (channels * t.samples)).min(t.chirps);
        if ranges == 0 || chirps == 0 {
            return Err(BadInput::new(
                "not one channel of one range bin or chirp fits into a buffer of this adapter",
            )
            .key("cube")
            .value(format!("{} x {} x {}", t.chirps, t.channels, t.samples))
            .allowed(format!("{limit} bytes a buffer"))
            .remedy("choose the device cpu")
            .into());
        }
        Ok(Cut { channels, ranges, chirps })
    }
}

/// Both transforms of a cube, which is uploaded here, in chunks that the adapter can bind. Nothing
/// runs before the recorder is submitted. Errors: lengths that are not powers of two up to
/// [`LONGEST`]; a single column too large for the adapter.
pub fn record(
    recorder: &mut Recorder<'_>,
    gpu: &Gpu,
    cube: &Cube<f32>,
    t: &Transform,
) -> Result<DeviceSpectrum> {
    let range = Axis::new(gpu, recorder, "processing.range_fft", t.range_fft, &t.range_window)?;
    let doppler = Axis::new(gpu, recorder, "processing.doppler_fft", t.doppler_fft, &t.doppler_window)?;
    let cut = Cut::new(t, gpu.max_binding_bytes())?;
    let mut chunks = Vec::new();
    for first_channel in (0..t.channels).step_by(cut.channels) {
        let channels = cut.channels.min(t.channels - first_channel);
        let pieces: Vec<(usize, Buffer<Complex32>)> = (0..t.chirps)
            .step_by(cut.chirps)
            .map(|first| {
                let chirps = first..(first + cut.chirps).min(t.chirps);
                let data = if channels == t.channels {
                    let row = channels * t.samples;
                    recorder.upload("cube", &cube.data[chirps.start * row..chirps.end * row])
                } else {
                    let mut part = Vec::with_capacity(chirps.len() * channels * t.samples);
                    for m in chirps {
                        let at = (m * t.channels + first_channel) * t.samples;
                        part.extend_from_slice(&cube.data[at..at + channels * t.samples]);
                    }
                    recorder.upload("cube", &part)
                };
                (first, data)
            })
            .collect();
        for first_range in (0..t.range_bins).step_by(cut.ranges) {
            let ranges = cut.ranges.min(t.range_bins - first_range);
            let columns = channels * ranges;
            let between = recorder.buffer::<Complex32>("range spectrum", t.chirps * columns);
            for (first_chirp, piece) in &pieces {
                let params = Params {
                    lines: (piece.len() / t.samples) as u32,
                    in_line: t.samples as u32,
                    in_step: 1,
                    out_base: (first_chirp * columns) as u32,
                    out_line: ranges as u32,
                    out_step: 1,
                    first: first_range as u32,
                    kept: ranges as u32,
                    ..Default::default()
                };
                range.record(recorder, piece, &between, params);
            }
            let spectrum = recorder.buffer::<Complex32>("spectrum", t.doppler_fft * columns);
            let params = Params {
                lines: columns as u32,
                in_line: 1,
                in_step: columns as u32,
                out_line: 1,
                out_step: columns as u32,
                shift: t.doppler_row(0) as u32,
                kept: t.doppler_fft as u32,
                ..Default::default()
            };
            doppler.record(recorder, &between, &spectrum, params);
            chunks.push(Chunk { spectrum, first_channel, channels, first_range, ranges });
        }
    }
    Ok(DeviceSpectrum { chunks, doppler_bins: t.doppler_fft, channels: t.channels, range_bins: t.range_bins })
}
