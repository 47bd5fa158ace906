//! Range and Doppler transforms: sizes, windows, and the host side of the kernel for what a workgroup holds
//! (CONVENTIONS eq. 14); other lengths go by passes over global memory (eq. 86).

use super::device::{Chunk, DeviceSpectrum};
use super::fft_pass::{Layout, Passes, Scratch, twiddles, work_length};
use super::keystone::{self, Keystone, Warp};
use super::window;
use crate::adc::{Cube, DeviceCube};
use crate::error::{BadInput, Result};
use crate::gpu::{Access, AnyBuffer, Buffer, Gpu, Kernel, Recorder, Threads, Tolerance};
use crate::gpu_struct;
use crate::scene::radar::{Processing, Radar, Sampling};
use crate::scene::waveform::Multiplex;
use num_complex::Complex32;

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
    /// Factor of the power map: bands over transmitters (CONVENTIONS eq. 19a), since empty ones hold noise alone.
    pub map_scale: f64,
    /// In place of the Doppler transform.
    pub keystone: Option<Keystone>,
    /// Samples are taken from the last to the first, as of a falling chirp.
    pub reversed: bool,
    /// One weight a sample, in the order in which they are taken.
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
            map_scale: 1.0,
            keystone: None,
            reversed: false,
            range_window: scaled(window::coefficients(processing.range_window, samples)?, gain),
            doppler_window: scaled(window::coefficients(processing.doppler_window, chirps)?, 1.0),
        })
    }

    /// For a cube of this radar's lines. Errors: a cube whose shape is not the radar's.
    pub fn of_cube<T>(cube: &Cube<T>, radar: &Radar) -> Result<Self> {
        let shape = [cube.chirps, cube.channels, cube.samples];
        if cube.data.len() != shape.iter().product::<usize>() {
            return Err(BadInput::new("the cube's size is not its shape's")
                .key("cube")
                .value(format!("{shape:?} ({} samples)", cube.data.len()))
                .into());
        }
        Self::of_shape(shape, radar)
    }

    /// The same for the shape alone.
    pub fn of_shape(shape: [usize; 3], radar: &Radar) -> Result<Self> {
        let want = [radar.chirps, radar.channels(), radar.lines().count];
        if shape != want {
            return Err(BadInput::new("the cube does not have the radar's shape [chirp, channel, sample]")
                .key("cube")
                .value(format!("{shape:?}"))
                .allowed(format!("{want:?}"))
                .remedy("give the radar that the cube was taken with")
                .into());
        }
        let mut t = Self::new(shape[0], shape[1], shape[2], radar.line_sampling(), &radar.processing)?;
        if let Multiplex::Ddm { bands } = radar.multiplex {
            t.bands = bands;
            t.map_scale = bands as f64 / radar.tx.len() as f64;
        }
        if radar.processing.keystone {
            t.keystone = Some(Keystone { scale: keystone::scale(radar), fold: 0 });
        }
        t.reversed = radar.step_hz() < 0.0;
        Ok(t)
    }

    /// Refuses another shape `[chirps, channels, samples]` than this transform's.
    pub fn check_shape(&self, shape: [usize; 3]) -> Result<()> {
        let want = [self.chirps, self.channels, self.samples];
        if shape == want {
            return Ok(());
        }
        Err(BadInput::new("the cube does not have the transform's shape [chirp, channel, sample]")
            .key("cube")
            .value(format!("{shape:?}"))
            .allowed(format!("{want:?}"))
            .into())
    }

    /// Columns of the spectrum: channels x range bins.
    pub fn columns(&self) -> usize {
        self.channels * self.range_bins
    }

    /// Rows of the map.
    pub fn doppler_rows(&self) -> usize {
        self.doppler_fft / self.bands
    }

    /// The row that transform bin `k` goes to: zero Doppler to row M/2. With B bands row and band as row · B + band: transmitter b is
    /// found b M/B rows before its range rate, and fills band b of the row at it.
    pub fn doppler_row(&self, k: usize) -> usize {
        let rows = self.doppler_rows();
        let band = (self.bands - (k + rows / 2) / rows % self.bands) % self.bands;
        (k + rows / 2) % rows * self.bands + band
    }
}

/// Longest transform that a workgroup's 32 KiB hold.
pub const LONGEST_IN_WORKGROUP: usize = 4096;

pub(super) fn fits_workgroup(length: usize) -> bool {
    length.is_power_of_two() && length <= LONGEST_IN_WORKGROUP
}

/// How the device takes a transform.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// A line in one workgroup's memory: powers of two up to [`LONGEST_IN_WORKGROUP`].
    Workgroup,
    /// Passes over global memory: every length.
    Passes,
}

impl Method {
    /// The faster one for this length. On a CPU's driver workgroup memory is memory like any other, and
    /// each barrier costs a change of context.
    pub fn of(gpu: &Gpu, length: usize) -> Method {
        if fits_workgroup(length) && gpu.report().is_hardware { Method::Workgroup } else { Method::Passes }
    }
}

gpu_struct! {
    /// Uniform of `shaders/dsp/fft.wgsl`.
    pub struct Params {
        pub lines: u32,
        pub log2_length: u32,
        pub count: u32,
        pub in_base: u32,
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

/// Shortest tile of a workgroup: four values for each of its threads.
const SHORTEST_TILE: usize = 1024;

/// One axis of the transform on the device.
pub(super) enum Axis {
    Workgroup { length: usize, weights: Buffer<f32>, twiddles: Buffer<Complex32>, hardware: bool },
    Passes(Passes),
}

impl Axis {
    pub fn new(
        gpu: &Gpu,
        recorder: &mut Recorder<'_>,
        method: Method,
        length: usize,
        window: &[f64],
    ) -> Axis {
        if method == Method::Passes {
            let hardware = gpu.report().is_hardware;
            return Axis::Passes(Passes::new(recorder, hardware, length, window));
        }
        let weights: Vec<f32> = window.iter().map(|w| *w as f32).collect();
        Axis::Workgroup {
            length,
            weights: recorder.upload("window", &weights),
            twiddles: recorder.upload("twiddles", &twiddles(length)),
            hardware: gpu.report().is_hardware,
        }
    }

    pub fn record(
        &self,
        recorder: &mut Recorder<'_>,
        scratch: &mut Scratch,
        from: &dyn AnyBuffer,
        to: &dyn AnyBuffer,
        layout: Layout,
    ) {
        let (length, weights, twiddles, hardware) = match self {
            Axis::Passes(passes) => return passes.record(recorder, scratch, from, to, layout),
            Axis::Workgroup { length, weights, twiddles, hardware } => {
                (*length, weights, twiddles, *hardware)
            }
        };
        // On a strided axis a GPU wants many lines together; a CPU's driver wants its cache. The numbers
        // that come out are the same.
        let wide = layout.side_by_side && hardware;
        let tile = if wide { LONGEST_IN_WORKGROUP } else { length.max(SHORTEST_TILE) };
        let groups = (layout.lines as u64).div_ceil((tile / length) as u64);
        let params = Params {
            lines: layout.lines as u32,
            log2_length: length.ilog2(),
            count: weights.len() as u32,
            in_base: layout.in_base,
            in_line: layout.in_line,
            in_step: layout.in_step,
            out_base: layout.out_base,
            out_line: layout.out_line,
            out_step: layout.out_step,
            shift: layout.shift,
            first: layout.first,
            kept: layout.kept,
            side_by_side: u32::from(layout.side_by_side),
            log2_tile: tile.ilog2(),
        };
        let threads = Threads::Linear(groups * u64::from(KERNEL.workgroup[0]));
        recorder.dispatch(&KERNEL, &params, &[from, weights, twiddles, to], threads);
    }
}

/// How a cube is cut so that no buffer passes `limit` bytes: channels together while they fit, then
/// range columns of one channel.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cut {
    channels: usize,
    ranges: usize,
    /// Chirps that are transformed together.
    chirps: usize,
    /// The same of rows whose range transform comes last.
    rows: usize,
}

impl Cut {
    fn new(t: &Transform, limit: u64) -> Result<Self> {
        let fits = (limit / size_of::<Complex32>() as u64) as usize;
        let (range, doppler) = (work_length(t.range_fft).max(t.samples), work_length(t.doppler_fft));
        let (doppler, columns) = match t.keystone {
            Some(_) => (t.doppler_fft, t.range_bins.max(t.samples)),
            None => (doppler, t.range_bins),
        };
        let channels = (fits / (doppler * columns)).clamp(1, t.channels);
        let ranges = (fits / (doppler * channels)).min(t.range_bins);
        let chirps = (fits / (channels * range)).min(t.chirps);
        let rows = (fits / (channels * range)).min(t.doppler_fft);
        if ranges == 0 || chirps == 0 || rows == 0 {
            return Err(BadInput::new(
                "not one channel of one range bin or chirp fits into a buffer of this adapter",
            )
            .key("cube")
            .value(format!("{} x {} x {}", t.chirps, t.channels, t.samples))
            .allowed(format!("{limit} bytes a buffer"))
            .remedy("choose the device cpu")
            .into());
        }
        Ok(Cut { channels, ranges, chirps, rows })
    }
}

/// Samples on the device, `[chirp, channel, sample]` of some chirps.
pub(super) struct Piece<'a> {
    pub first_chirp: usize,
    pub chirps: usize,
    /// That it holds, and the first of those that are wanted.
    pub channels: usize,
    pub first_channel: usize,
    pub data: &'a dyn AnyBuffer,
}

/// Chirps to rows.
enum Slow {
    Doppler(Axis),
    /// Before the range transform.
    Keystone(Warp),
}

/// What the transforms of one recorder share.
struct Plan<'a> {
    t: &'a Transform,
    cut: Cut,
    range: Axis,
    slow: Slow,
    scratch: Scratch,
}

impl<'a> Plan<'a> {
    fn new(
        recorder: &mut Recorder<'_>,
        gpu: &Gpu,
        t: &'a Transform,
        method: Option<Method>,
    ) -> Result<Plan<'a>> {
        let of = |length: usize| method.unwrap_or_else(|| Method::of(gpu, length));
        // The keystone transform has lengths of its own.
        let doppler = t.keystone.is_none().then_some(("processing.doppler_fft", t.doppler_fft));
        for (key, length) in [("processing.range_fft", t.range_fft)].into_iter().chain(doppler) {
            if of(length) == Method::Workgroup && !fits_workgroup(length) {
                return Err(BadInput::new("a workgroup has no FFT of this length")
                    .key(key)
                    .value(length)
                    .allowed(format!("a power of two up to {LONGEST_IN_WORKGROUP}"))
                    .remedy("take the passes over global memory")
                    .into());
            }
        }
        let cut = Cut::new(t, gpu.max_binding_bytes())?;
        let range = Axis::new(gpu, recorder, of(t.range_fft), t.range_fft, &t.range_window);
        let slow = match &t.keystone {
            Some(keystone) => Slow::Keystone(Warp::new(recorder, gpu, t, keystone, method)?),
            None => {
                let length = t.doppler_fft;
                Slow::Doppler(Axis::new(gpu, recorder, of(length), length, &t.doppler_window))
            }
        };
        Ok(Plan { t, cut, range, slow, scratch: Scratch::default() })
    }

    /// The spectrum of `channels` channels from the `first_channel`-th on, whose samples are in `pieces`.
    fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        pieces: &[Piece<'_>],
        (first_channel, channels): (usize, usize),
        chunks: &mut Vec<Chunk>,
    ) {
        let t = self.t;
        // What the keystone transform leaves in place of chirps: `[row, channel, sample]`, cut along rows.
        let mut warped: Vec<(usize, Buffer<Complex32>)> = Vec::new();
        if let Slow::Keystone(warp) = &self.slow {
            for first in (0..t.doppler_fft).step_by(self.cut.rows) {
                let rows = self.cut.rows.min(t.doppler_fft - first);
                warped.push((first, recorder.buffer("warped rows", rows * channels * t.samples)));
            }
            warp.record(recorder, &mut self.scratch, t, pieces, channels, &warped);
        }
        for first_range in (0..t.range_bins).step_by(self.cut.ranges) {
            let ranges = self.cut.ranges.min(t.range_bins - first_range);
            let columns = channels * ranges;
            let spectrum = recorder.buffer::<Complex32>("spectrum", t.doppler_fft * columns);
            let range = (first_range, ranges);
            for (first_chirp, data) in &warped {
                let chirps = data.len() / (channels * t.samples);
                let piece = Piece { first_chirp: *first_chirp, chirps, channels, first_channel: 0, data };
                self.record_range(recorder, &piece, (0, chirps), range, channels, &spectrum);
            }
            if let Slow::Doppler(_) = self.slow {
                let between = recorder.buffer::<Complex32>("range spectrum", t.chirps * columns);
                for piece in pieces {
                    for first in (0..piece.chirps).step_by(self.cut.chirps) {
                        let chirps = (first, self.cut.chirps.min(piece.chirps - first));
                        self.record_range(recorder, piece, chirps, range, channels, &between);
                    }
                }
                self.record_doppler(recorder, columns, &between, &spectrum);
            }
            chunks.push(Chunk { spectrum, first_channel, channels, first_range, ranges });
        }
    }

    fn record_doppler(
        &mut self,
        recorder: &mut Recorder<'_>,
        columns: usize,
        from: &Buffer<Complex32>,
        to: &Buffer<Complex32>,
    ) {
        let t = self.t;
        let layout = Layout {
            lines: columns,
            in_line: 1,
            in_step: columns as u32,
            out_line: 1,
            out_step: columns as u32,
            shift: (t.doppler_rows() / 2) as u32,
            kept: t.doppler_fft as u32,
            side_by_side: columns > 1,
            ..Default::default()
        };
        if let Slow::Doppler(axis) = &self.slow {
            axis.record(recorder, &mut self.scratch, from, to, layout);
        }
    }

    fn record_range(
        &mut self,
        recorder: &mut Recorder<'_>,
        piece: &Piece<'_>,
        (first, chirps): (usize, usize),
        (first_range, ranges): (usize, usize),
        channels: usize,
        to: &Buffer<Complex32>,
    ) {
        let t = self.t;
        // Lines follow one another where all channels are wanted.
        let whole = channels == piece.channels;
        for channel in 0..if whole { 1 } else { channels } {
            let start = (first * piece.channels + piece.first_channel + channel) * t.samples;
            let layout = Layout {
                lines: if whole { chirps * channels } else { chirps },
                in_base: (start + if t.reversed { t.samples - 1 } else { 0 }) as u32,
                in_line: (if whole { t.samples } else { piece.channels * t.samples }) as u32,
                in_step: if t.reversed { u32::MAX } else { 1 },
                out_base: (((piece.first_chirp + first) * channels + channel) * ranges) as u32,
                out_line: (if whole { ranges } else { channels * ranges }) as u32,
                out_step: 1,
                shift: 0,
                first: first_range as u32,
                kept: ranges as u32,
                side_by_side: false,
            };
            self.range.record(recorder, &mut self.scratch, piece.data, to, layout);
        }
    }
}

fn spectrum(t: &Transform, chunks: Vec<Chunk>) -> DeviceSpectrum {
    DeviceSpectrum {
        chunks,
        doppler_bins: t.doppler_rows(),
        bands: t.bands,
        map_scale: t.map_scale,
        channels: t.channels * t.bands,
        range_bins: t.range_bins,
    }
}

/// Both transforms of a cube, which is uploaded here, in chunks that the adapter can bind. Nothing
/// runs before the recorder is submitted. Errors: a single column too large for the adapter.
pub fn record(
    recorder: &mut Recorder<'_>,
    gpu: &Gpu,
    cube: &Cube<f32>,
    t: &Transform,
) -> Result<DeviceSpectrum> {
    record_by(recorder, gpu, cube, t, None)
}

/// [`record`] with a method of choice.
pub fn record_by(
    recorder: &mut Recorder<'_>,
    gpu: &Gpu,
    cube: &Cube<f32>,
    t: &Transform,
    method: Option<Method>,
) -> Result<DeviceSpectrum> {
    let mut plan = Plan::new(recorder, gpu, t, method)?;
    let mut chunks = Vec::new();
    for first_channel in (0..t.channels).step_by(plan.cut.channels) {
        let channels = plan.cut.channels.min(t.channels - first_channel);
        let buffers: Vec<(usize, Buffer<Complex32>)> = (0..t.chirps)
            .step_by(plan.cut.chirps)
            .map(|first| {
                let chirps = first..(first + plan.cut.chirps).min(t.chirps);
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
        let pieces: Vec<Piece<'_>> = buffers
            .iter()
            .map(|(first_chirp, data)| Piece {
                first_chirp: *first_chirp,
                chirps: data.len() / (channels * t.samples),
                channels,
                first_channel: 0,
                data,
            })
            .collect();
        plan.record(recorder, &pieces, (first_channel, channels), &mut chunks);
    }
    Ok(spectrum(t, chunks))
}

/// [`record`] for a cube that is on the device already, whose shape has to be the transform's.
pub fn record_device(
    recorder: &mut Recorder<'_>,
    gpu: &Gpu,
    cube: &DeviceCube,
    t: &Transform,
) -> Result<DeviceSpectrum> {
    t.check_shape([cube.chirps, cube.channels, cube.samples])?;
    let mut plan = Plan::new(recorder, gpu, t, None)?;
    let mut chunks = Vec::new();
    for first_channel in (0..t.channels).step_by(plan.cut.channels) {
        let pieces: Vec<Piece<'_>> = cube
            .pieces
            .iter()
            .map(|p| Piece {
                first_chirp: p.first_chirp,
                chirps: p.chirps,
                channels: t.channels,
                first_channel,
                data: &p.data,
            })
            .collect();
        let channels = plan.cut.channels.min(t.channels - first_channel);
        plan.record(recorder, &pieces, (first_channel, channels), &mut chunks);
    }
    Ok(spectrum(t, chunks))
}
