//! Cubes larger than memory: the chain by blocks of channels (CONVENTIONS eq. 87).

use super::{detect, fft, keystone, noise, peaks};
use crate::adc::Cube;
use crate::base::error::Result;
use crate::base::tasks::Tasks;
use crate::dsp::stream::{Source, blocks, check_bands};
use crate::dsp::transform::Transform;
use crate::dsp::{PowerMap, RangeDoppler, Real, Snapshots};
use crate::scene::radar::Cfar;
use num_complex::Complex;
use rayon::prelude::*;

/// As [`super::process`], to the bit, without the cube or its spectrum in memory. `source` is asked for every
/// block of channels once, and once more for the snapshots unless one block is all. Blocks are as large as
/// `budget_bytes` allows for samples and spectrum, and one channel at least.
///
/// # Errors
/// Returns what `source` fails with, the errors of [`super::process`], and an error for a radar with Doppler bands.
pub fn process<T: Real>(
    transform: &Transform,
    cfar: &Cfar,
    budget_bytes: usize,
    source: &mut Source<'_, T>,
) -> Result<RangeDoppler<T>> {
    check_bands(transform)?;
    let (channels, bins) = (transform.channels, transform.range_bins);
    let one = transform.chirps * transform.samples + transform.doppler_fft * bins;
    let blocks = blocks(channels, budget_bytes / (one * size_of::<Complex<T>>()));
    let mut map = vec![T::zero(); transform.doppler_fft * bins];
    let mut block = Block::new(transform);
    for range in &blocks {
        block.transform(range.clone(), source)?;
        block.add_power(&mut map);
    }
    let share = T::of(1.0 / channels as f64);
    map.par_iter_mut().with_min_len(1 << 14).for_each(|p| *p = *p * share);
    let map = PowerMap { doppler_bins: transform.doppler_fft, range_bins: bins, data: map };
    let detection = detect(&map, cfar, channels)?;
    let cells = peaks::peaks(&map, &detection.mask);
    let noise = noise(&map, cfar, channels, &cells)?;
    let mut data = vec![Complex::default(); cells.len() * channels];
    for range in blocks.iter().filter(|_| !cells.is_empty()) {
        if blocks.len() > 1 {
            block.transform(range.clone(), source)?;
        }
        for (cell, out) in cells.iter().zip(data.chunks_exact_mut(channels)) {
            let row = cell.doppler as usize * range.len() * bins + cell.range as usize;
            for (c, x) in out[range.clone()].iter_mut().enumerate() {
                *x = block.spectrum[row + c * bins];
            }
        }
    }
    Ok(RangeDoppler { map, detection, cells, noise, snapshots: Snapshots { channels, data } })
}

/// Memory of one block of channels, used for all.
struct Block<'a, T> {
    transform: &'a Transform,
    channels: usize,
    samples: Vec<Complex<T>>,
    /// `[doppler, channel, range]`.
    spectrum: Vec<Complex<T>>,
}

impl<'a, T: Real> Block<'a, T> {
    fn new(transform: &'a Transform) -> Self {
        Block { transform, channels: 0, samples: Vec::new(), spectrum: Vec::new() }
    }

    fn transform(&mut self, range: std::ops::Range<usize>, source: &mut Source<'_, T>) -> Result<()> {
        let t = self.transform;
        self.channels = range.len();
        let columns = self.channels * t.range_bins;
        self.samples.resize(t.chirps * self.channels * t.samples, Complex::default());
        self.spectrum.resize(t.doppler_fft * columns, Complex::default());
        source(range, &mut self.samples)?;
        if let Some(k) = &t.keystone {
            let data = std::mem::take(&mut self.samples);
            let cube = Cube { chirps: t.chirps, channels: self.channels, samples: t.samples, data };
            let part = Transform { channels: self.channels, ..t.clone() };
            self.spectrum = keystone::spectrum(&cube, &part, &k.scale, k.fold)?.data;
            self.samples = cube.data;
            return Ok(());
        }
        fft::range_of(&self.samples, t, &mut self.spectrum[..t.chirps * columns]);
        fft::doppler(t, &mut self.spectrum);
        Ok(())
    }

    /// Adds |X|^2, channel after channel.
    fn add_power(&self, map: &mut [T]) {
        let bins = self.transform.range_bins;
        map.par_chunks_mut(bins).zip(self.spectrum.par_chunks(self.channels * bins)).for_each_tasks(
            |(out, row)| {
                for channel in row.chunks_exact(bins) {
                    for (p, x) in out.iter_mut().zip(channel) {
                        *p = *p + x.norm_sqr();
                    }
                }
            },
        );
    }
}
