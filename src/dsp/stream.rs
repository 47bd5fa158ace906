//! Cubes larger than memory: the chain by blocks of channels, on the device (CONVENTIONS eq. 87).

use super::device::{CELLS, ListedCells, detection, too_many};
use super::spectrum;
use super::transform::Transform;
use super::{PowerMap, RangeDoppler, cfar, cfar_noise, peaks, power, snapshot};
use crate::adc::Cube;
use crate::base::error::{Error, Result};
use crate::gpu::{Buffer, Gpu, Recorder};
use crate::scene::radar::Cfar;
use num_complex::{Complex, Complex32};
use std::ops::Range;

/// Fills a slice with the samples of these channels, `[chirp, channel, sample]`.
pub type Source<'a, T> = dyn FnMut(Range<usize>, &mut [Complex<T>]) -> Result<()> + 'a;

/// A cube in memory as a source.
pub fn from_cube<T: Copy>(cube: &Cube<T>) -> impl FnMut(Range<usize>, &mut [Complex<T>]) -> Result<()> {
    |channels: Range<usize>, out: &mut [Complex<T>]| {
        for (m, part) in out.chunks_exact_mut(channels.len() * cube.samples).enumerate() {
            let at = (m * cube.channels + channels.start) * cube.samples;
            part.copy_from_slice(&cube.data[at..at + part.len()]);
        }
        Ok(())
    }
}

/// Channels in blocks of at most `most`, at least one.
pub(crate) fn blocks(channels: usize, most: usize) -> Vec<Range<usize>> {
    let most = most.clamp(1, channels.max(1));
    (0..channels).step_by(most).map(|first| first..(first + most).min(channels)).collect()
}

/// Refuses Doppler bands (DDM), whose sums have another order over channels.
pub(crate) fn check_bands(t: &Transform) -> Result<()> {
    match t.bands {
        1 => Ok(()),
        _ => Err(Error::Failed("Doppler bands (DDM) cannot be processed in blocks of channels".into())),
    }
}

/// As [`super::device::process`], to the bit, with one block of channels on the device at a time and a
/// submission for each. `source` is asked for every block twice, the second time for the snapshots, once
/// where one block is all or nothing was detected. Blocks are as large as one buffer of the adapter holds.
///
/// # Errors
/// Returns what `source` fails with, the errors of [`super::device::process`], and an error for a radar with Doppler
/// bands.
pub fn process(
    gpu: &Gpu,
    transform: &Transform,
    cfar: &Cfar,
    source: &mut Source<'_, f32>,
) -> Result<RangeDoppler<f32>> {
    let t = transform;
    check_bands(t)?;
    let size = [t.doppler_fft, t.range_bins];
    let columns = cfar::columns(cfar, t.channels, size[0], size[1])?;
    let one = (t.chirps * t.samples.max(t.range_fft)).max(t.doppler_fft * t.range_bins);
    let fits = gpu.max_binding_bytes() as usize / size_of::<Complex32>();
    let blocks = blocks(t.channels, fits / one);

    let mut recorder = gpu.recorder("map");
    let map = recorder.zeros::<f32>("map", size[0] * size[1]);
    recorder.submit()?;
    let mut samples = Vec::new();
    let mut block = |recorder: &mut Recorder<'_>, range: &Range<usize>| {
        let count = t.chirps * range.len() * t.samples;
        samples.resize(count, Complex32::default());
        source(range.clone(), &mut samples)?;
        let cube = Cube {
            chirps: t.chirps,
            channels: range.len(),
            samples: t.samples,
            data: std::mem::take(&mut samples),
        };
        let part = Transform { channels: range.len(), ..t.clone() };
        let spectrum = spectrum::record(recorder, gpu, &cube, &part);
        samples = cube.data;
        spectrum
    };
    let mut last = None;
    for range in &blocks {
        let mut recorder = gpu.recorder("block of channels");
        let spectrum = block(&mut recorder, range)?;
        power::add(&mut recorder, &spectrum, &map, (range.start, t.channels));
        recorder.submit()?;
        last = (blocks.len() == 1).then_some(spectrum);
    }

    let mut recorder = gpu.recorder("detection");
    let mask = cfar::record(&mut recorder, &map, size, cfar, &columns)?;
    let list = peaks::record(&mut recorder, &map, &mask, size, CELLS);
    let (map_read, mask_read) = (recorder.read(&map), recorder.read(&mask));
    let list_read = recorder.read(&list);
    let mut done = recorder.submit()?;
    let power = PowerMap { doppler_bins: size[0], range_bins: size[1], data: done.take(map_read) };
    cfar::check_map(&power)?;
    let count = done.take(list_read)[0] as usize;
    let limit = fits / t.channels;
    if count > limit {
        return Err(too_many(count, limit));
    }
    let detection = detection(done.take(mask_read), &columns);

    let mut recorder = gpu.recorder("detected cells");
    let list = peaks::record(&mut recorder, &map, &mask, size, count);
    let noise = cfar_noise::record(&mut recorder, &map, size, cfar, &columns, &list);
    let snapshots: Buffer<Complex32> = recorder.buffer("snapshots", count * t.channels);
    let (list_read, noise) = (recorder.read(&list), recorder.read(&noise));
    let mut done = recorder.submit()?;
    let (cells, noise) = (done.take(list_read), done.take(noise));
    for range in blocks.iter().filter(|_| count > 0) {
        let mut recorder = gpu.recorder("block of channels");
        let spectrum = match last.take() {
            Some(spectrum) => spectrum,
            None => block(&mut recorder, range)?,
        };
        snapshot::add(&mut recorder, &spectrum, &list, &snapshots, (range.start, t.channels));
        recorder.submit()?;
    }
    let mut recorder = gpu.recorder("snapshots");
    let read = recorder.read(&snapshots);
    let listed = ListedCells { list: cells, noise, channels: recorder.submit()?.take(read) };
    let (cells, noise, snapshots) = listed.sorted(&power, t.channels);
    Ok(RangeDoppler { map: power, detection, cells, noise, snapshots })
}
