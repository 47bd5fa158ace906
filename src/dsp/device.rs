//! The chain on the GPU: one submission from the cube to the detected cells, with the spectrum left
//! there.

use super::fft::Transform;
use super::peaks;
use super::{
    Cell, Detection, PowerMap, RangeDoppler, Snapshots, Spectrum, cfar, cfar_ca, cfar_os, fft, power,
    snapshot,
};
use crate::adc::Cube;
use crate::error::{Error, Result};
use crate::gpu::{Buffer, Gpu, Recorder};
use crate::scene::radar::{Cfar, CfarKind, Radar};
use num_complex::Complex32;

/// Some channels and range columns of the spectrum, `[doppler, channel, range]`.
#[derive(Clone)]
pub(crate) struct Chunk {
    pub spectrum: Buffer<Complex32>,
    pub first_channel: usize,
    pub channels: usize,
    pub first_range: usize,
    pub ranges: usize,
}

/// A spectrum in the adapter's memory, in chunks that it can bind.
#[derive(Clone)]
pub struct DeviceSpectrum {
    pub(crate) chunks: Vec<Chunk>,
    pub doppler_bins: usize,
    pub channels: usize,
    pub range_bins: usize,
}

impl DeviceSpectrum {
    /// How many buffers it fills.
    pub fn chunks(&self) -> usize {
        self.chunks.len()
    }

    /// Copies it to the host.
    pub fn read(&self, gpu: &Gpu) -> Result<Spectrum<f32>> {
        let mut recorder = gpu.recorder("spectrum");
        let pending: Vec<_> = self.chunks.iter().map(|c| recorder.read(&c.spectrum)).collect();
        let mut done = recorder.submit()?;
        let mut data = vec![Complex32::default(); self.doppler_bins * self.channels * self.range_bins];
        for (chunk, pending) in self.chunks.iter().zip(pending) {
            let part = done.take(pending);
            for (line, from) in part.chunks_exact(chunk.ranges).enumerate() {
                let (d, c) = (line / chunk.channels, line % chunk.channels);
                let at = (d * self.channels + chunk.first_channel + c) * self.range_bins + chunk.first_range;
                data[at..at + chunk.ranges].copy_from_slice(from);
            }
        }
        Ok(Spectrum {
            doppler_bins: self.doppler_bins,
            channels: self.channels,
            range_bins: self.range_bins,
            data,
        })
    }
}

/// Mask (0 or 1) and noise in W of each cell, and the columns they were judged by.
pub(crate) struct DeviceDetection {
    pub mask: Buffer<u32>,
    pub noise: Buffer<f32>,
}

/// Records the detector that `cfar` names on a map in device memory.
pub(crate) fn record_cfar(
    recorder: &mut Recorder<'_>,
    map: &Buffer<f32>,
    size: [usize; 2],
    cfar: &Cfar,
    columns: &[cfar::Column],
) -> Result<DeviceDetection> {
    let (kernel, passes) = match cfar.kind {
        CfarKind::Ca => (&cfar_ca::KERNEL, cfar_ca::PASSES),
        CfarKind::Os { .. } => (&cfar_os::KERNEL, cfar_os::PASSES),
    };
    cfar::check_window(cfar, passes)?;
    Ok(cfar::record(recorder, kernel, map, size, cfar, columns))
}

fn detection(mask: Vec<u32>, noise: Vec<f32>, columns: &[cfar::Column]) -> Detection<f32> {
    Detection { mask: mask.iter().map(|m| *m != 0).collect(), noise, ratio: cfar::ratios(columns) }
}

/// The detector alone, on a map from the host: the twin of the cpu engine's `detect`.
pub fn detect(gpu: &Gpu, map: &PowerMap<f32>, cfar: &Cfar, channels: usize) -> Result<Detection<f32>> {
    cfar::check_map(map)?;
    let columns = cfar::columns(cfar, channels, map.doppler_bins, map.range_bins)?;
    let mut recorder = gpu.recorder("cfar");
    let buffer = recorder.upload("map", &map.data);
    let found = record_cfar(&mut recorder, &buffer, [map.doppler_bins, map.range_bins], cfar, &columns)?;
    let (mask, noise) = (recorder.read(&found.mask), recorder.read(&found.noise));
    let mut done = recorder.submit()?;
    Ok(detection(done.take(mask), done.take(noise), &columns))
}

/// Room for this many detected cells; a frame with more costs a second, small submission.
const CELLS: usize = 4096;

/// From the cube to detected cells in one submission: the twin of the cpu engine's `process`. Errors:
/// a cube that is not this radar's, bad settings, FFT lengths that the GPU does not have, samples
/// that are not finite, failures of the adapter.
pub fn process(gpu: &Gpu, cube: &Cube<f32>, radar: &Radar) -> Result<(DeviceSpectrum, RangeDoppler<f32>)> {
    let transform = Transform::of_cube(cube, radar)?;
    let size = [transform.doppler_fft, transform.range_bins];
    let cfar = &radar.processing.cfar;
    let columns = cfar::columns(cfar, transform.channels, size[0], size[1])?;

    let mut recorder = gpu.recorder("processing");
    let spectrum = fft::record(&mut recorder, gpu, cube, &transform)?;
    let map = power::record(&mut recorder, &spectrum);
    let found = record_cfar(&mut recorder, &map, size, cfar, &columns)?;
    let limit = (gpu.max_binding_bytes() as usize / (8 * transform.channels)).max(1);
    let (list, channels) = record_cells(&mut recorder, &spectrum, &map, &found.mask, CELLS.min(limit));
    let map_read = recorder.read(&map);
    let (mask, noise) = (recorder.read(&found.mask), recorder.read(&found.noise));
    let (list_read, channels_read) = (recorder.read(&list), recorder.read(&channels));
    let mut done = recorder.submit()?;

    let power = PowerMap { doppler_bins: size[0], range_bins: size[1], data: done.take(map_read) };
    cfar::check_map(&power)?;
    let detection = detection(done.take(mask), done.take(noise), &columns);
    let (mut list, mut channels) = (done.take(list_read), done.take(channels_read));
    let count = list[0] as usize;
    if count > list.len() - 1 {
        if count > limit {
            return Err(Error::Failed(format!(
                "{count} detected cells, of which the adapter holds the channels of {limit} in one buffer"
            )));
        }
        let mut recorder = gpu.recorder("detected cells");
        let (more, snapshots) = record_cells(&mut recorder, &spectrum, &map, &found.mask, count);
        let (more, snapshots) = (recorder.read(&more), recorder.read(&snapshots));
        let mut done = recorder.submit()?;
        (list, channels) = (done.take(more), done.take(snapshots));
    }
    let (cells, snapshots) = sorted(&power, &list[1..=count], &channels, transform.channels);
    Ok((spectrum, RangeDoppler { map: power, detection, cells, snapshots }))
}

fn record_cells(
    recorder: &mut Recorder<'_>,
    spectrum: &DeviceSpectrum,
    map: &Buffer<f32>,
    mask: &Buffer<u32>,
    capacity: usize,
) -> (Buffer<u32>, Buffer<Complex32>) {
    let list = peaks::record(recorder, map, mask, [spectrum.doppler_bins, spectrum.range_bins], capacity);
    let snapshots = snapshot::record(recorder, spectrum, &list);
    (list, snapshots)
}

/// Cells and their snapshots from the order of the map to that of power.
fn sorted(
    map: &PowerMap<f32>,
    list: &[u32],
    channels: &[Complex32],
    count: usize,
) -> (Vec<Cell>, Snapshots<f32>) {
    let cell = |at: u32| Cell { doppler: at / map.range_bins as u32, range: at % map.range_bins as u32 };
    let mut order: Vec<usize> = (0..list.len()).collect();
    // The list is in the order of the map, which a stable sort keeps among equals.
    order.sort_by(|a, b| map.data[list[*b] as usize].total_cmp(&map.data[list[*a] as usize]));
    let data = order.iter().flat_map(|i| channels[i * count..(i + 1) * count].iter().copied()).collect();
    (order.iter().map(|i| cell(list[*i])).collect(), Snapshots { channels: count, data })
}
