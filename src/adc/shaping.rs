//! From lines to samples for waveforms that are not mixed with themselves: pulses and codes (CONVENTIONS eq. 12b).
//!
//! A pulse that is repeated with a period T′ is a sum of harmonics; each comes back with the scene's response at its
//! frequency, which is a line of eq. 12a. The samples are therefore the inverse transform of pulse spectrum times
//! response. T′ is longer than the record by more than a pulse, so nothing that wraps round is kept.
//!
//! An echo moves while it is sampled. With u from −1 to 1 over the record and θ = 2πf τ̇ T/2, its line turns by e^{jθu};
//! the series of the exponential gives a few sets of lines with weights (jθ)^q/q! that are multiplied by u^q after
//! the transform. What does not move needs only the first.

use super::synthesis::Plan;
use crate::base::error::{BadInput, Result};
use crate::base::units::C0;
use crate::scene::radar::{Radar, Sampling};
use crate::scene::waveform::{FrequencySamples, Waveform};
use crate::trace::Echoes;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Relative size of the first term of the exponential series that is left out.
const SERIES_END: f64 = 1e-9;
/// Largest θ: terms grow to e^θ before they fall.
const LARGEST_TURN: f64 = 5.0;

/// How lines of one radar become samples.
pub struct Shaping {
    /// What is to be synthesised.
    pub lines: FrequencySamples,
    /// Conjugate spectrum of the pulse or code at each line.
    spectrum: Vec<Complex64>,
    /// Length of the transform, T′ in samples.
    pub period: usize,
    /// Index of the first line in the transform; the others follow it round.
    pub first: usize,
    /// Number of samples of a chirp.
    pub samples: usize,
    /// Real samples are √2 Re of what comes out.
    pub sampling: Sampling,
    /// Half the time of the record.
    half_s: f64,
}

impl Shaping {
    /// The shaping for echoes up to this |path rate|, m/s. None for waveforms whose lines are the samples.
    pub fn of(radar: &Radar, largest_path_rate_mps: f64) -> Option<Shaping> {
        let fs = radar.sample_rate_hz;
        let (period, half_band_hz) = match &radar.waveform {
            Waveform::Fmcw(_) | Waveform::Stepped { .. } => return None,
            Waveform::Pulse { shape, .. } => {
                let (before, after) = shape.extent_s();
                // An echo that enters or leaves the record during the frame must not come back at its other end.
                let walk = largest_path_rate_mps * radar.frame_time_s() / C0;
                let longest = (2.0 * before.max(after) + walk) * fs;
                (transform_length(radar.samples + longest.ceil() as usize + 2), shape.half_band_hz())
            }
            Waveform::Coded { chip_rate_hz, .. } => (radar.samples, 0.5 * chip_rate_hz),
        };
        let lines = radar.harmonics(fs / period as f64, half_band_hz);
        // Sample n is taken at adc_start + n/f_s.
        let zero = zero_hz(radar);
        let turns = |k: usize| (lines.first_hz + k as f64 * lines.step_hz - zero) * radar.adc_start_s;
        let spectrum = spectrum(radar, &lines)
            .iter()
            .enumerate()
            .map(|(k, s)| s.conj() * Complex64::cis(-TAU * turns(k).fract()))
            .collect();
        Some(Shaping {
            first: index(radar, &lines, period),
            lines,
            spectrum,
            period,
            samples: radar.samples,
            sampling: radar.sampling,
            half_s: 0.5 * radar.samples as f64 / fs,
        })
    }

    /// Number of terms of the exponential series that echoes up to this |path rate|, m/s, need.
    ///
    /// # Errors
    /// Returns an error for an echo whose phase turns so far within one record that the series would cancel its own
    /// digits.
    pub fn orders(&self, largest_path_rate_mps: f64) -> Result<u32> {
        let top_hz = self.lines.first_hz + self.lines.count as f64 * self.lines.step_hz;
        let theta = TAU * top_hz * largest_path_rate_mps / C0 * self.half_s;
        if theta > LARGEST_TURN {
            return Err(BadInput::new("the phase of an echo rotates too far within one record")
                .key("receiver.samples")
                .value(format!("{theta:.1} rad for half of it"))
                .allowed(format!("up to {LARGEST_TURN} rad"))
                .remedy("use a shorter code or record, or slower bodies")
                .into());
        }
        let (mut term, mut orders) = (theta, 1);
        while term > SERIES_END {
            orders += 1;
            term *= theta / f64::from(orders);
        }
        Ok(orders)
    }

    /// Plans the synthesis of the echoes as set `order` of lines needs them.
    ///
    /// # Errors
    /// Returns an error if an echo is not finite.
    pub fn plan<'a>(&self, radar: &'a Radar, echoes: &'a Echoes, order: u32) -> Result<Plan<'a>> {
        let plan = Plan::with_lines(radar, self.lines, echoes)?;
        if order == 0 {
            return Ok(plan);
        }
        let per_rate = TAU * self.lines.first_hz / C0 * self.half_s;
        Ok(plan.weighted(|r| {
            let theta = per_rate * r.path_rate_mps / (1.0 + 0.5 * r.path_rate_mps / C0);
            (1..=order).fold(Complex64::ONE, |p, q| p * Complex64::new(0.0, theta / f64::from(q)))
        }))
    }

    /// Factors by which the lines of set `order` are multiplied.
    pub fn weights(&self, order: u32) -> Vec<Complex64> {
        let first_hz = self.lines.first_hz;
        let relative = |k: usize| (first_hz + k as f64 * self.lines.step_hz) / first_hz;
        self.spectrum.iter().enumerate().map(|(k, s)| s * relative(k).powi(order as i32)).collect()
    }

    /// Factors by which the samples that come out of set `order` are multiplied.
    pub fn times(&self, order: u32) -> Vec<f64> {
        let middle = 0.5 * (self.samples as f64 - 1.0);
        let half = 0.5 * self.samples as f64;
        (0..self.samples).map(|n| ((n as f64 - middle) / half).powi(order as i32)).collect()
    }
}

/// The frequency that the samples have at zero: IQ samples are over the carrier, real ones are the wave itself.
fn zero_hz(radar: &Radar) -> f64 {
    match radar.sampling {
        Sampling::Iq => radar.carrier_hz,
        Sampling::Real => 0.0,
    }
}

/// Index of the first line in a transform of `period` samples.
pub fn index(radar: &Radar, lines: &FrequencySamples, period: usize) -> usize {
    ((lines.first_hz - zero_hz(radar)) / lines.step_hz).round().rem_euclid(period as f64) as usize
}

/// Fourier coefficients, at each line, of the pulse or code when it is repeated at the rate of the lines' spacing.
pub fn spectrum(radar: &Radar, lines: &FrequencySamples) -> Vec<Complex64> {
    (0..lines.count)
        .map(|k| {
            let f = lines.first_hz + k as f64 * lines.step_hz - radar.carrier_hz;
            match &radar.waveform {
                Waveform::Pulse { shape, .. } => shape.spectrum(f) * lines.step_hz,
                Waveform::Coded { code, .. } => {
                    let (h, n) = ((f / lines.step_hz).round(), code.len() as f64);
                    let turn = |i: usize| Complex64::cis(-TAU * (h * i as f64 / n).fract());
                    code.iter().enumerate().map(|(i, c)| f64::from(*c) * turn(i)).sum::<Complex64>() / n
                }
                Waveform::Fmcw(_) | Waveform::Stepped { .. } => Complex64::ONE,
            }
        })
        .collect()
}

/// The next odd length without large prime factors: odd, so that no line stands at the end of the band, where it would be
/// its own image.
fn transform_length(at_least: usize) -> usize {
    (at_least..)
        .find(|n| {
            let mut m = *n;
            for p in [3, 5, 7] {
                while m.is_multiple_of(p) {
                    m /= p;
                }
            }
            m == 1
        })
        .unwrap_or(at_least)
}
