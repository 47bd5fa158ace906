//! Range and Doppler transforms with rustfft, any length (CONVENTIONS eq. 14).

use crate::adc::Cube;
use crate::base::tasks::Tasks;
use crate::dsp::transform::Transform;
use crate::dsp::{Real, Spectrum};
use num_complex::Complex;
use rayon::prelude::*;

/// Columns of one block of the Doppler transform, of which each row fills whole cache lines.
const BLOCK: usize = 64;
/// Values between the lines of a block beyond their length: lines a power of two apart would all lie in
/// the same places of a cache.
const PAD: usize = 8;
/// Rows that are gathered together.
const TILE: usize = 8;

/// The spectrum of a cube whose shape is the transform's.
pub fn spectrum<T: Real>(cube: &Cube<T>, transform: &Transform) -> Spectrum<T> {
    spectrum_in(cube, transform, Vec::new())
}

/// Computes the spectrum in memory that was used before: new pages cost as much as half the transform.
pub fn spectrum_in<T: Real>(cube: &Cube<T>, transform: &Transform, mut data: Vec<Complex<T>>) -> Spectrum<T> {
    let len = transform.doppler_fft * transform.columns();
    if data.capacity() < len {
        // From the allocator's zeros, which touches no page twice.
        data = vec![Complex::default(); len];
    }
    data.resize(len, Complex::default());
    range(cube, transform, &mut data[..transform.chirps * transform.columns()]);
    doppler(transform, &mut data);
    Spectrum {
        doppler_bins: transform.doppler_fft / transform.bands,
        channels: transform.channels * transform.bands,
        range_bins: transform.range_bins,
        data,
    }
}

/// Range transform of every chirp into `out`, `[chirp, channel, range]`.
pub fn range<T: Real>(cube: &Cube<T>, transform: &Transform, out: &mut [Complex<T>]) {
    range_of(&cube.data, transform, out);
}

/// Range transform of lines of samples, `[chirp, channel]`, into lines of range bins. Where the bins are half
/// of the transform the samples are real.
pub fn range_of<T: Real>(samples: &[Complex<T>], transform: &Transform, out: &mut [Complex<T>]) {
    if transform.range_bins < transform.range_fft {
        real_lines(samples, transform, out);
    } else {
        complex_lines(samples, transform, out);
    }
}

/// A line's window and transform, and memory for it.
struct Line<'a, T: Real> {
    transform: &'a Transform,
    window: &'a [T],
    fft: &'a dyn catseye_math::fft::Fft<T>,
    values: Vec<Complex<T>>,
    scratch: Vec<Complex<T>>,
}

impl<'a, T: Real> Line<'a, T> {
    fn new(transform: &'a Transform, window: &'a [T], fft: &'a dyn catseye_math::fft::Fft<T>) -> Self {
        let values = vec![Complex::default(); transform.range_fft];
        Line {
            transform,
            window,
            fft,
            values,
            scratch: vec![Complex::default(); fft.get_inplace_scratch_len()],
        }
    }

    /// Windows and transforms what was put into the first values.
    fn process(&mut self) {
        let count = self.transform.samples;
        if self.transform.reversed {
            self.values[..count].reverse();
        }
        for (x, w) in self.values.iter_mut().zip(self.window) {
            *x = x.scale(*w);
        }
        self.values[count..].fill(Complex::default());
        self.fft.process_with_scratch(&mut self.values, &mut self.scratch);
    }
}

pub(super) fn complex_lines<T: Real>(samples: &[Complex<T>], transform: &Transform, out: &mut [Complex<T>]) {
    let (bins, count) = (transform.range_bins, transform.samples);
    let fft = catseye_math::fft::forward::<T>(transform.range_fft);
    let window: Vec<T> = transform.range_window.iter().map(|w| T::of(*w)).collect();
    out.par_chunks_mut(bins).zip(samples.par_chunks(count)).with_min_len(16).for_each_init_tasks(
        || Line::new(transform, &window, &*fft),
        |line, (out, samples)| {
            line.values[..count].copy_from_slice(samples);
            line.process();
            out.copy_from_slice(&line.values[..bins]);
        },
    );
}

/// Two real lines a, b go through the transform as z = a + jb: A = (Z[k] + Z*[N-k])/2 and
/// B = (Z[k] - Z*[N-k])/2j. They are two chirps of one channel, so that a channel's rounding does not depend
/// on which others are there.
fn real_lines<T: Real>(samples: &[Complex<T>], transform: &Transform, out: &mut [Complex<T>]) {
    let (n, bins, count) = (transform.range_fft, transform.range_bins, transform.samples);
    let channels = samples.len() / (transform.chirps * count);
    let fft = catseye_math::fft::forward::<T>(n);
    let window: Vec<T> = transform.range_window.iter().map(|w| T::of(*w)).collect();
    let half = T::of(0.5);
    out.par_chunks_mut(2 * channels * bins)
        .zip(samples.par_chunks(2 * channels * count))
        .for_each_init_tasks(
            || Line::new(transform, &window, &*fft),
            |line, (out, samples)| {
                let (a, b) = samples.split_at(channels * count);
                let (out_a, out_b) = out.split_at_mut(channels * bins);
                for channel in 0..channels {
                    let (from, to) = (channel * count, channel * bins);
                    for (z, x) in line.values.iter_mut().zip(&a[from..from + count]) {
                        *z = Complex::new(x.re, T::zero());
                    }
                    if !b.is_empty() {
                        for (z, x) in line.values.iter_mut().zip(&b[from..from + count]) {
                            z.im = x.re;
                        }
                    }
                    line.process();
                    for k in 0..bins {
                        let (z, mirrored) = (line.values[k], line.values[(n - k) % n].conj());
                        out_a[to + k] = (z + mirrored).scale(half);
                        if !b.is_empty() {
                            let d = (z - mirrored).scale(half);
                            out_b[to + k] = Complex::new(d.im, -d.re);
                        }
                    }
                }
            },
        );
}

/// Doppler transform in place: the first `chirps` rows of `data` go in, all `doppler_fft` rows come
/// out, zero Doppler in the middle.
pub fn doppler<T: Real>(transform: &Transform, data: &mut [Complex<T>]) {
    let (rows, chirps) = (transform.doppler_fft, transform.chirps);
    let columns = data.len() / rows;
    let fft = catseye_math::fft::forward::<T>(rows);
    let window: Vec<T> = transform.doppler_window.iter().map(|w| T::of(*w)).collect();
    // A block of neighbouring columns is gathered, so that each cache line is used whole.
    let mut blocks: Vec<Vec<&mut [Complex<T>]>> =
        (0..columns.div_ceil(BLOCK)).map(|_| Vec::with_capacity(rows)).collect();
    for row in data.chunks_mut(columns) {
        for (block, part) in blocks.iter_mut().zip(row.chunks_mut(BLOCK)) {
            block.push(part);
        }
    }
    let pitch = rows + PAD;
    let buffers = || {
        (
            vec![Complex::<T>::default(); pitch * BLOCK],
            [[Complex::<T>::default(); BLOCK]; TILE],
            vec![Complex::<T>::default(); fft.get_inplace_scratch_len()],
        )
    };
    blocks.into_par_iter().for_each_init_tasks(buffers, |(lines, tile, scratch), mut block| {
        let width = block[0].len();
        for first in (0..chirps).step_by(TILE) {
            // Through a small tile: rows of a cube lie so far apart that their parts displace each other.
            let count = TILE.min(chirps - first);
            for (tile, row) in tile.iter_mut().zip(&block[first..first + count]) {
                tile[..width].copy_from_slice(row);
            }
            for (c, line) in lines.chunks_exact_mut(pitch).take(width).enumerate() {
                let line = &mut line[first..first + count];
                for ((x, row), w) in line.iter_mut().zip(&*tile).zip(&window[first..]) {
                    *x = row[c].scale(*w);
                }
            }
        }
        for line in lines.chunks_exact_mut(pitch).take(width) {
            line[chirps..rows].fill(Complex::default());
            fft.process_with_scratch(&mut line[..rows], scratch);
        }
        for first in (0..rows).step_by(TILE) {
            let count = TILE.min(rows - first);
            for (c, line) in lines.chunks_exact(pitch).take(width).enumerate() {
                for (row, x) in tile.iter_mut().zip(&line[first..first + count]) {
                    row[c] = *x;
                }
            }
            for (k, row) in (first..first + count).zip(&*tile) {
                block[transform.doppler_row(k)].copy_from_slice(&row[..width]);
            }
        }
    });
}
