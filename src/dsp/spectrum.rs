//! The two transforms of a cube on the device, cut so that no buffer passes the adapter's limit.

use super::Spectrum;
use super::device_spectrum::{Chunk, DeviceSpectrum};
use super::fft::{Axis, LONGEST_IN_WORKGROUP, Method, Piece, fits_workgroup};
use super::fft_pass::{PassLayout, Scratch, work_length};
use super::keystone::Warp;
use super::transform::Transform;
use crate::adc::{Cube, DeviceCube};
use crate::base::error::{BadInput, Result};
use crate::gpu::{Buffer, Gpu, Recorder};
use num_complex::Complex32;

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
                "a buffer of this adapter cannot hold one channel of one range bin or chirp",
            )
            .key("cube")
            .value(format!("{} x {} x {}", t.chirps, t.channels, t.samples))
            .allowed(format!("{limit} bytes a buffer"))
            .remedy("use --device cpu")
            .into());
        }
        Ok(Cut { channels, ranges, chirps, rows })
    }
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
                return Err(BadInput::new("an FFT in a workgroup cannot have this length")
                    .key(key)
                    .value(length)
                    .allowed(format!("a power of two up to {LONGEST_IN_WORKGROUP}"))
                    .remedy("use the passes over global memory")
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
                let between = self.record_ranges(recorder, pieces, range, channels);
                self.record_doppler(recorder, columns, &between, &spectrum);
            }
            chunks.push(Chunk { spectrum, first_channel, channels, first_range, ranges });
        }
    }

    /// The range spectrum of all pieces, `[chirp, channel, range]`.
    fn record_ranges(
        &mut self,
        recorder: &mut Recorder<'_>,
        pieces: &[Piece<'_>],
        range: (usize, usize),
        channels: usize,
    ) -> Buffer<Complex32> {
        let count = self.t.chirps * channels * range.1;
        let between = recorder.buffer::<Complex32>("range spectrum", count);
        for piece in pieces {
            for first in (0..piece.chirps).step_by(self.cut.chirps) {
                let chirps = (first, self.cut.chirps.min(piece.chirps - first));
                self.record_range(recorder, piece, chirps, range, channels, &between);
            }
        }
        between
    }

    fn record_doppler(
        &mut self,
        recorder: &mut Recorder<'_>,
        columns: usize,
        from: &Buffer<Complex32>,
        to: &Buffer<Complex32>,
    ) {
        let t = self.t;
        let layout = PassLayout {
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
            let layout = PassLayout {
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

/// Uploads some channels of a cube, `chirps` of them together: the first chirp of each piece and its samples.
fn uploaded(
    recorder: &mut Recorder<'_>,
    cube: &Cube<f32>,
    chirps: usize,
    (first_channel, channels): (usize, usize),
) -> Vec<(usize, Buffer<Complex32>)> {
    (0..cube.chirps)
        .step_by(chirps)
        .map(|first| {
            let chirps = first..(first + chirps).min(cube.chirps);
            let data = if channels == cube.channels {
                let row = channels * cube.samples;
                recorder.upload("cube", &cube.data[chirps.start * row..chirps.end * row])
            } else {
                let mut part = Vec::with_capacity(chirps.len() * channels * cube.samples);
                for m in chirps {
                    let at = (m * cube.channels + first_channel) * cube.samples;
                    part.extend_from_slice(&cube.data[at..at + channels * cube.samples]);
                }
                recorder.upload("cube", &part)
            };
            (first, data)
        })
        .collect()
}

/// What [`uploaded`] put on the device, as the transforms take it.
fn pieces_of(buffers: &[(usize, Buffer<Complex32>)], channels: usize, samples: usize) -> Vec<Piece<'_>> {
    buffers
        .iter()
        .map(|(first_chirp, data)| Piece {
            first_chirp: *first_chirp,
            chirps: data.len() / (channels * samples),
            channels,
            first_channel: 0,
            data,
        })
        .collect()
}

/// The range transform alone, `[chirp, channel, range]`: to the bit what [`record`] hands to the Doppler transform.
///
/// # Errors
/// Returns an error for a keystone transform, which comes before that of range, for a single column too large for the adapter, or if the
/// adapter fails.
pub fn range_alone(gpu: &Gpu, cube: &Cube<f32>, t: &Transform) -> Result<Cube<f32>> {
    t.check_shape([cube.chirps, cube.channels, cube.samples])?;
    t.check_separable()?;
    let mut recorder = gpu.recorder("range spectrum");
    let mut plan = Plan::new(&mut recorder, gpu, t, None)?;
    let mut pending = Vec::new();
    for first_channel in (0..t.channels).step_by(plan.cut.channels) {
        let channels = plan.cut.channels.min(t.channels - first_channel);
        let buffers = uploaded(&mut recorder, cube, plan.cut.chirps, (first_channel, channels));
        let pieces = pieces_of(&buffers, channels, t.samples);
        for first_range in (0..t.range_bins).step_by(plan.cut.ranges) {
            let ranges = plan.cut.ranges.min(t.range_bins - first_range);
            let range = (first_range, ranges);
            let between = plan.record_ranges(&mut recorder, &pieces, range, channels);
            pending.push(((first_channel, channels), range, recorder.read(&between)));
        }
    }
    let mut done = recorder.submit()?;
    let mut out = Cube::zeros(t.chirps, t.channels, t.range_bins);
    for ((first_channel, channels), (first_range, ranges), part) in pending {
        for (line, from) in done.take(part).chunks_exact(ranges).enumerate() {
            let row = line / channels * t.channels + first_channel + line % channels;
            let at = row * t.range_bins + first_range;
            out.data[at..at + ranges].copy_from_slice(from);
        }
    }
    Ok(out)
}

/// The Doppler transform alone, of what [`range_alone`] gives.
///
/// # Errors
/// Returns an error for spectra of another shape, and the errors of [`range_alone`].
pub fn doppler_alone(gpu: &Gpu, ranges: &Cube<f32>, t: &Transform) -> Result<Spectrum<f32>> {
    t.check_ranges([ranges.chirps, ranges.channels, ranges.samples])?;
    t.check_separable()?;
    let mut recorder = gpu.recorder("Doppler spectrum");
    let mut plan = Plan::new(&mut recorder, gpu, t, None)?;
    let mut chunks = Vec::new();
    for first_channel in (0..t.channels).step_by(plan.cut.channels) {
        let channels = plan.cut.channels.min(t.channels - first_channel);
        for first_range in (0..t.range_bins).step_by(plan.cut.ranges) {
            let count = plan.cut.ranges.min(t.range_bins - first_range);
            let mut part = Vec::with_capacity(t.chirps * channels * count);
            for row in 0..t.chirps * channels {
                let row = row / channels * t.channels + first_channel + row % channels;
                let at = row * t.range_bins + first_range;
                part.extend_from_slice(&ranges.data[at..at + count]);
            }
            let columns = channels * count;
            let between = recorder.upload("range spectrum", &part);
            let out = recorder.buffer::<Complex32>("spectrum", t.doppler_fft * columns);
            plan.record_doppler(&mut recorder, columns, &between, &out);
            chunks.push(Chunk { spectrum: out, first_channel, channels, first_range, ranges: count });
        }
    }
    recorder.submit()?;
    spectrum(t, chunks).read(gpu)
}

/// Records both transforms of a cube, which is uploaded here, in chunks that the adapter can bind. Nothing runs before
/// the recorder is submitted.
///
/// # Errors
/// Returns an error for a single column too large for the adapter.
pub fn record(
    recorder: &mut Recorder<'_>,
    gpu: &Gpu,
    cube: &Cube<f32>,
    t: &Transform,
) -> Result<DeviceSpectrum> {
    record_by(recorder, gpu, cube, t, None)
}

/// Records as [`record`] with the method that is given.
///
/// # Errors
/// Returns an error for a cube that is larger than the adapter holds, or if the adapter fails.
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
        let buffers = uploaded(recorder, cube, plan.cut.chirps, (first_channel, channels));
        let pieces = pieces_of(&buffers, channels, t.samples);
        plan.record(recorder, &pieces, (first_channel, channels), &mut chunks);
    }
    Ok(spectrum(t, chunks))
}

/// Records as [`record`] for a cube that is on the device already and has the transform's shape.
///
/// # Errors
/// Returns an error for a cube that is larger than the adapter holds, or if the adapter fails.
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
