//! Samples of any waveform to lines (CONVENTIONS eq. 12c), on the host for both engines: what follows need not know what
//! was sent, but that lines of falling frequency are read backwards (`Transform::reversed`).

use super::zero_doppler;
use crate::adc::Cube;
use crate::adc::shaping;
use crate::base::error::{BadInput, Result};
use crate::base::tasks::Tasks;
use crate::dsp::zero_doppler::AtRest;
use crate::dsp::{Real, window};
use crate::scene::radar::{Radar, Sampling};
use crate::scene::waveform::Waveform;
use num_complex::{Complex, Complex64};
use rayon::prelude::*;
use std::borrow::Cow;
use std::f64::consts::SQRT_2;

/// [`lines`] without what stands still, if the radar's settings ask for that.
///
/// # Errors
/// Returns an error if the cube's shape is not the radar's.
pub fn prepared<'a, T: Real>(cube: &'a Cube<T>, radar: &Radar) -> Result<Cow<'a, Cube<T>>> {
    let mut lines = lines(cube, radar)?;
    if radar.processing.remove_static {
        let columns = lines.channels * lines.samples;
        zero_doppler::remove(&mut lines.to_mut().data, columns, &AtRest::of(radar));
    }
    Ok(lines)
}

/// The lines of one ramp (`radar` is `Radar::part` of it), `[chirp, channel, line]`, borrowed where they are the
/// samples as they stand.
///
/// # Errors
/// Returns an error if the cube's shape is not the radar's.
pub fn lines<'a, T: Real>(cube: &'a Cube<T>, radar: &Radar) -> Result<Cow<'a, Cube<T>>> {
    let want = [radar.rows(), radar.channels(), radar.samples];
    let shape = [cube.chirps, cube.channels, cube.samples];
    if shape != want || cube.data.len() != want.iter().product::<usize>() {
        return Err(BadInput::new("the cube does not have the radar's shape [chirp, channel, sample]")
            .key("cube")
            .value(format!("{shape:?} ({} samples)", cube.data.len()))
            .allowed(format!("{want:?}"))
            .remedy("give the radar that recorded the cube")
            .into());
    }
    match &radar.waveform {
        Waveform::Fmcw(s) if s.ramps.len() > 1 => Ok(Cow::Owned(picked(cube, s.ramps.len(), s.this))),
        Waveform::Fmcw(_) | Waveform::Stepped { .. } => Ok(Cow::Borrowed(cube)),
        Waveform::Pulse { .. } | Waveform::Coded { .. } => Ok(Cow::Owned(compressed(cube, radar)?)),
    }
}

/// Rows `first`, `first` + `step`, ….
fn picked<T: Real>(cube: &Cube<T>, step: usize, first: usize) -> Cube<T> {
    let mut out = Cube::zeros(cube.chirps / step, cube.channels, cube.samples);
    let row = cube.channels * cube.samples;
    out.data.par_chunks_mut(row).enumerate().for_each_tasks(|(m, out)| {
        out.copy_from_slice(&cube.data[(m * step + first) * row..][..row]);
    });
    out
}

/// Spectrum of the samples times that of the pulse or code (matched filter), scaled so that an echo keeps its amplitude through
/// the range window and transform.
fn compressed<T: Real>(cube: &Cube<T>, radar: &Radar) -> Result<Cube<T>> {
    let lines = radar.lines();
    let n = radar.samples;
    let spectrum = shaping::spectrum(radar, &lines);
    let weights = window::coefficients(radar.processing.range_window, lines.count)?;
    let total: f64 = weights.iter().sum();
    let kept: f64 = weights.iter().zip(&spectrum).map(|(w, s)| w * s.norm_sqr()).sum();
    let real = if radar.sampling == Sampling::Real { SQRT_2 } else { 1.0 };
    let scale = real * total / (kept * n as f64);
    let narrow = |z: Complex64| Complex::new(T::of(z.re), T::of(z.im));
    let filter: Vec<Complex<T>> = spectrum.iter().map(|s| narrow(s * scale)).collect();
    let first = shaping::index(radar, &lines, n);
    let fft = catseye_math::fft::inverse::<T>(n);
    let buffers = || (vec![Complex::default(); n], vec![Complex::default(); fft.get_inplace_scratch_len()]);
    let mut out = Cube::zeros(cube.chirps, cube.channels, lines.count);
    out.data.par_chunks_mut(lines.count).zip(cube.data.par_chunks(n)).for_each_init_tasks(
        buffers,
        |(row, scratch), (out, samples)| {
            row.copy_from_slice(samples);
            fft.process_with_scratch(row, scratch);
            for (k, (o, f)) in out.iter_mut().zip(&filter).enumerate() {
                *o = row[(first + k) % n] * *f;
            }
        },
    );
    Ok(out)
}
