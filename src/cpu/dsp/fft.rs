//! Range and Doppler transforms with rustfft (CONVENTIONS eq. 14).

use crate::adc::Cube;
use crate::dsp::fft::Transform;
use crate::dsp::{Real, Spectrum};
use num_complex::Complex;
use rayon::prelude::*;
use rustfft::FftPlanner;

/// Bytes that the columns of one block of the Doppler transform may fill: a share of a core's cache.
const BLOCK_BYTES: usize = 256 * 1024;

/// The spectrum of a cube whose shape is the transform's.
pub fn spectrum<T: Real>(cube: &Cube<T>, transform: &Transform) -> Spectrum<T> {
    let mut data = vec![Complex::default(); transform.doppler_fft * transform.columns()];
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
    let fft = FftPlanner::<T>::new().plan_fft_forward(transform.range_fft);
    let window: Vec<T> = transform.range_window.iter().map(|w| T::of(*w)).collect();
    let buffers = || {
        (
            vec![Complex::<T>::default(); transform.range_fft],
            vec![Complex::<T>::default(); fft.get_inplace_scratch_len()],
        )
    };
    out.par_chunks_mut(transform.range_bins)
        .zip(cube.data.par_chunks(transform.samples))
        .with_min_len(16)
        .for_each_init(buffers, |(line, scratch), (out, samples)| {
            for ((l, x), w) in line.iter_mut().zip(samples).zip(&window) {
                *l = x.scale(*w);
            }
            line[transform.samples..].fill(Complex::default());
            fft.process_with_scratch(line, scratch);
            out.copy_from_slice(&line[..transform.range_bins]);
        });
}

/// Doppler transform in place: the first `chirps` rows of `data` go in, all `doppler_fft` rows come
/// out, zero Doppler in the middle.
pub fn doppler<T: Real>(transform: &Transform, data: &mut [Complex<T>]) {
    let (rows, chirps, columns) = (transform.doppler_fft, transform.chirps, transform.columns());
    let fft = FftPlanner::<T>::new().plan_fft_forward(rows);
    let window: Vec<T> = transform.doppler_window.iter().map(|w| T::of(*w)).collect();
    // A block of neighbouring columns is gathered, so that each cache line is used whole.
    let width = (BLOCK_BYTES / (rows * size_of::<Complex<T>>())).clamp(8, 64).min(columns);
    let mut blocks: Vec<Vec<&mut [Complex<T>]>> =
        (0..columns.div_ceil(width)).map(|_| Vec::with_capacity(rows)).collect();
    for row in data.chunks_mut(columns) {
        for (block, part) in blocks.iter_mut().zip(row.chunks_mut(width)) {
            block.push(part);
        }
    }
    let buffers = || {
        (
            vec![Complex::<T>::default(); rows * width],
            vec![Complex::<T>::default(); fft.get_inplace_scratch_len()],
        )
    };
    blocks.into_par_iter().for_each_init(buffers, |(lines, scratch), mut block| {
        let width = block[0].len();
        let lines = &mut lines[..rows * width];
        for (m, (row, w)) in block.iter().zip(&window).enumerate() {
            for (line, x) in lines.chunks_exact_mut(rows).zip(row.iter()) {
                line[m] = x.scale(*w);
            }
        }
        for line in lines.chunks_exact_mut(rows) {
            line[chirps..].fill(Complex::default());
        }
        fft.process_with_scratch(lines, scratch);
        for k in 0..rows {
            for (x, line) in block[transform.doppler_row(k)].iter_mut().zip(lines.chunks_exact(rows)) {
                *x = line[k];
            }
        }
    });
}
