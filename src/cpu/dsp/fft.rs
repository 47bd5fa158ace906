//! Range and Doppler transforms with rustfft, any length (CONVENTIONS eq. 14).

use crate::adc::Cube;
use crate::dsp::fft::Transform;
use crate::dsp::{Real, Spectrum};
use num_complex::Complex;
use rayon::prelude::*;
use rustfft::FftPlanner;

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

/// The same in memory that was used before: new pages cost as much as half the transform.
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

/// Range transform of lines of samples, one after another, into lines of range bins. Where the bins are half
/// of the transform the samples are real, and two lines go through it as one: of z = a + jb,
/// A = (Z[k] + Z*[N-k])/2 and B = (Z[k] - Z*[N-k])/2j.
pub fn range_of<T: Real>(samples: &[Complex<T>], transform: &Transform, out: &mut [Complex<T>]) {
    let n = transform.range_fft;
    let fft = FftPlanner::<T>::new().plan_fft_forward(n);
    let window: Vec<T> = transform.range_window.iter().map(|w| T::of(*w)).collect();
    let buffers =
        || (vec![Complex::<T>::default(); n], vec![Complex::<T>::default(); fft.get_inplace_scratch_len()]);
    let real = transform.range_bins < n;
    let lines = if real { 2 } else { 1 };
    let (bins, count) = (transform.range_bins, transform.samples);
    out.par_chunks_mut(lines * bins).zip(samples.par_chunks(lines * count)).with_min_len(16).for_each_init(
        buffers,
        |(line, scratch), (out, samples)| {
            let (first, second) = samples.split_at(count);
            if real {
                for (l, x) in line.iter_mut().zip(first) {
                    *l = Complex::new(x.re, T::zero());
                }
                for (l, x) in line.iter_mut().zip(second) {
                    l.im = x.re;
                }
            } else {
                line[..count].copy_from_slice(first);
            }
            if transform.reversed {
                line[..count].reverse();
            }
            for (l, w) in line.iter_mut().zip(&window) {
                *l = l.scale(*w);
            }
            line[count..].fill(Complex::default());
            fft.process_with_scratch(line, scratch);
            if real {
                let half = T::of(0.5);
                let (first, second) = out.split_at_mut(bins);
                for (k, a) in first.iter_mut().enumerate() {
                    let (z, mirrored) = (line[k], line[(n - k) % n].conj());
                    *a = (z + mirrored).scale(half);
                    if let Some(b) = second.get_mut(k) {
                        let d = (z - mirrored).scale(half);
                        *b = Complex::new(d.im, -d.re);
                    }
                }
            } else {
                out.copy_from_slice(&line[..bins]);
            }
        },
    );
}

/// Doppler transform in place: the first `chirps` rows of `data` go in, all `doppler_fft` rows come
/// out, zero Doppler in the middle.
pub fn doppler<T: Real>(transform: &Transform, data: &mut [Complex<T>]) {
    let (rows, chirps) = (transform.doppler_fft, transform.chirps);
    let columns = data.len() / rows;
    let fft = FftPlanner::<T>::new().plan_fft_forward(rows);
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
    blocks.into_par_iter().for_each_init(buffers, |(lines, tile, scratch), mut block| {
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
