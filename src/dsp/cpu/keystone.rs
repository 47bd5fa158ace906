//! Range-Doppler transform without range migration (CONVENTIONS eq. 89).

use super::fft::complex_lines;
use crate::adc::Cube;
use crate::base::error::Result;
use crate::base::tasks::Tasks;
use crate::dsp::transform::Keystone;
use crate::dsp::transform::Transform;
use crate::dsp::{Real, Spectrum};
use num_complex::{Complex, Complex64};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Samples that share a pass over the cube.
const BLOCK: usize = 16;

/// As `fft::spectrum`, with each sample's Doppler axis stretched by its instantaneous frequency over the
/// carrier, `scale[n]` (`dsp::transform::line_scale` for a linear chirp), so that a moving target stays in the
/// range cell where it is in the middle of the frame. `fold` counts the unambiguous intervals of the map (whole turns a
/// chirp, over the Doppler bands) that a target of interest lies above: targets of another fold are not focused.
///
/// With Doppler bands (DDM) the band that transmitter k fills at this fold is first turned back by the k/B of a turn
/// that it gains from chirp to chirp, whatever the sample's frequency.
///
/// The sums over chirps are exact: a chirp-z transform by Bluestein's convolution for each sample.
///
/// # Errors
/// Returns an error for a cube of another shape, or a scale that is not one positive number a sample.
pub fn spectrum<T: Real>(
    cube: &Cube<T>,
    transform: &Transform,
    scale: &[f64],
    fold: i32,
) -> Result<Spectrum<T>> {
    let t = transform;
    t.check_shape([cube.chirps, cube.channels, cube.samples])?;
    Keystone::check(scale, t.samples)?;
    let (rows, bands, chirps, channels, samples) =
        (t.doppler_rows(), t.bands, t.chirps, t.channels, t.samples);
    let length = (rows + chirps - 1).next_power_of_two();

    let (forward, inverse) = (catseye_math::fft::forward(length), catseye_math::fft::inverse(length));
    let wide = catseye_math::fft::forward::<f64>(length);
    // [doppler, band, channel, sample], in blocks of samples that one thread owns.
    let mut between = vec![Complex::<T>::default(); rows * bands * channels * samples];
    let mut blocks: Vec<Vec<&mut [Complex<T>]>> =
        (0..samples.div_ceil(BLOCK)).map(|_| Vec::with_capacity(rows * bands * channels)).collect();
    for line in between.chunks_mut(samples) {
        for (block, part) in blocks.iter_mut().zip(line.chunks_mut(BLOCK)) {
            block.push(part);
        }
    }
    let round = |z: Complex64| Complex::new(T::of(z.re), T::of(z.im));
    blocks.into_par_iter().enumerate().for_each_tasks(|(i, mut block)| {
        let mut line = vec![Complex::<T>::default(); length];
        let mut scratch = vec![
            Complex::<T>::default();
            forward.get_inplace_scratch_len().max(inverse.get_inplace_scratch_len())
        ];
        for (n, s) in scale.iter().enumerate().skip(i * BLOCK).take(BLOCK) {
            let tables = Tables::new(t, *s, fold, length, &*wide);
            let kernel: Vec<_> = tables.kernel.iter().map(|z| round(*z)).collect();
            let after: Vec<_> = tables.after.iter().map(|z| round(*z)).collect();
            for band in 0..bands {
                let ramp = ramp(bands, band as i64 + i64::from(fold));
                let before = tables.before.iter().enumerate().map(|(m, z)| round(z * ramp[m % bands]));
                let before: Vec<_> = before.collect();
                for channel in 0..channels {
                    for (m, (x, b)) in line.iter_mut().zip(&before).enumerate() {
                        *x = cube.data[(m * channels + channel) * samples + n] * *b;
                    }
                    line[chirps..].fill(Complex::default());
                    forward.process_with_scratch(&mut line, &mut scratch);
                    line.iter_mut().zip(&kernel).for_each(|(x, k)| *x = *x * *k);
                    inverse.process_with_scratch(&mut line, &mut scratch);
                    for (row, (x, a)) in line.iter().zip(&after).enumerate() {
                        block[(row * bands + band) * channels + channel][n - i * BLOCK] = *x * *a;
                    }
                }
            }
        }
    });
    let mut data = vec![Complex::default(); rows * bands * t.columns()];
    // Of real samples, too, these are complex.
    complex_lines(&between, t, &mut data);
    Ok(Spectrum { doppler_bins: rows, channels: channels * bands, range_bins: t.range_bins, data })
}

/// e^(j 2 pi tx m / bands) over the first chirps m.
fn ramp(bands: usize, tx: i64) -> Vec<Complex64> {
    let b = bands as i64;
    (0..b).map(|m| Complex64::cis(TAU * (m * tx).rem_euclid(b) as f64 / b as f64)).collect()
}

/// What the chirp-z transform of one sample multiplies by: sum over m of
/// w_m x_m e^(-j 2 pi nu (c + s (m - c))) for nu = q/M + fold/B, q = row - M/2B, c the middle chirp. With
/// a = s/M and u = m - c, q u = (q^2 + u^2 - (q - u)^2)/2.
struct Tables {
    before: Vec<Complex64>,
    kernel: Vec<Complex64>,
    after: Vec<Complex64>,
}

impl Tables {
    fn new(t: &Transform, s: f64, fold: i32, length: usize, fft: &dyn catseye_math::fft::Fft<f64>) -> Tables {
        let (rows, chirps) = (t.doppler_fft as f64, t.chirps);
        let centre = 0.5 * (chirps as f64 - 1.0);
        let a = s / rows;
        let lowest = -((t.doppler_rows() / 2) as f64);
        let fold = f64::from(fold) / t.bands as f64;
        let cis = |turns: f64| Complex64::cis(TAU * (turns - turns.round()));
        let u = |m: usize| m as f64 - centre;
        let before = (0..chirps)
            .map(|m| cis(-0.5 * a * u(m) * u(m) - fold * (centre + s * u(m))) * t.doppler_window[m])
            .collect();
        // Row r takes from chirp m the kernel at q - u = (lowest + centre) + (r - m).
        let mut kernel = vec![Complex64::default(); length];
        for d in -(chirps as i64 - 1)..t.doppler_rows() as i64 {
            let x = lowest + centre + d as f64;
            kernel[d.rem_euclid(length as i64) as usize] = cis(0.5 * a * x * x) / length as f64;
        }
        fft.process(&mut kernel);
        let after = (0..t.doppler_rows())
            .map(|r| {
                let q = lowest + r as f64;
                cis(-0.5 * a * q * q - q * centre / rows)
            })
            .collect();
        Tables { before, kernel, after }
    }
}
