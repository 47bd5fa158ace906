//! What lies between the ideal mixer and the samples: parameters in, closed forms out. The effects are
//! applied to a cube by `adc::cpu::front_end`, in this order (CONVENTIONS eq. 100-111):
//!
//! 1. leakage and cover as further echoes ([`spill`]); the filters' gain at its beat frequency and the error of
//!    its channel are part of each echo, [`Chain::echo_gain`] ([`filters`], [`channels`]);
//! 2. jitter of the ramp's start, phase noise, jitter of the sampling instants ([`jitter`], [`phase_noise`]);
//! 3. other radars (`adc::interference`), without the noise of the own oscillator;
//! 4. thermal noise, shaped by the filters;
//! 5. imbalance of I and Q and constant of the mixer, saturation, quantiser (`adc::convert`).
//!
//! Levels are those at the receiver's input, √W. What is off leaves the cube as it was, to the bit.

pub mod channels;
pub mod filters;
pub mod jitter;
pub mod phase_noise;
pub mod spill;

use crate::rng::philox4x32_10;
use crate::scene::front_end::FrontEndSettings;
use crate::scene::radar::{Radar, Sampling};
use num_complex::Complex64;
use spill::Spill;
use std::f64::consts::{SQRT_2, TAU};

/// Philox streams of the front end; 0 is the thermal noise.
pub const PHASE_NOISE_STREAM: u32 = 1;
pub const CHIRP_JITTER_STREAM: u32 = 2;
pub const APERTURE_JITTER_STREAM: u32 = 3;
pub const CHANNEL_GAIN_STREAM: u32 = 4;
pub const POSITION_STREAM: u32 = 5;
pub const INTERFERENCE_STREAM: u32 = 6;

/// Two independent normal numbers of variance one: Box–Muller on the first two words of Philox4x32-10
/// with counter (index lo, index hi, seed hi, stream) and key (seed lo, frame).
pub fn normals(seed: u64, frame: u32, stream: u32, index: u64) -> [f64; 2] {
    let w = words(seed, frame, stream, index);
    let u = (f64::from(w[0]) + 1.0) * 2f64.powi(-32);
    let (sin, cos) = (f64::from(w[1]) * 2f64.powi(-32) * TAU).sin_cos();
    let r = (-2.0 * u.ln()).sqrt();
    [r * cos, r * sin]
}

/// Four words of the same generator.
pub fn words(seed: u64, frame: u32, stream: u32, index: u64) -> [u32; 4] {
    philox4x32_10([index as u32, (index >> 32) as u32, (seed >> 32) as u32, stream], [seed as u32, frame])
}

/// When and how fast the cube was sampled.
#[derive(Debug, Clone, PartialEq)]
pub struct Timing {
    pub sampling: Sampling,
    pub sample_rate_hz: f64,
    /// Rise of the sent frequency, Hz/s; falling when negative.
    pub slope_hz_per_s: f64,
    /// Sent frequency at the ramp's start.
    pub start_hz: f64,
    /// From the ramp's start to the first sample.
    pub adc_start_s: f64,
    /// Ramps of this slope that one loop holds. Channels of one ramp follow each other,
    /// so that channel c of C belongs to ramp ⌊c slots/C⌋.
    pub slots: usize,
    /// Start of each ramp, `[loop, slot]`, s.
    pub starts_s: Vec<f64>,
}

impl Timing {
    pub fn of(radar: &Radar) -> Timing {
        let slots = radar.slots();
        let starts = |m| (0..slots).map(move |k| radar.chirp_start_s(m, k));
        Timing {
            sampling: radar.sampling,
            sample_rate_hz: radar.sample_rate_hz,
            slope_hz_per_s: radar.slope_hz_per_s(),
            start_hz: radar.start_hz(),
            adc_start_s: radar.adc_start_s,
            slots,
            starts_s: (0..radar.chirps).flat_map(starts).collect(),
        }
    }

    /// The sample of a phasor (eq. 12): itself, or √2 of its real part.
    pub fn sampled(&self, z: Complex64) -> Complex64 {
        match self.sampling {
            Sampling::Iq => z,
            Sampling::Real => Complex64::new(SQRT_2 * z.re, 0.0),
        }
    }

    /// Beat frequency of a delay at rest, Hz.
    pub fn beat_hz(&self, delay_s: f64) -> f64 {
        self.slope_hz_per_s * delay_s
    }
}

/// The front end of one radar.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    pub settings: FrontEndSettings,
    pub timing: Timing,
    /// Leakage and cover, without the filters' gain.
    pub spills: Vec<Spill>,
    /// Factor of each channel; empty when there are no channel errors.
    pub channel_gains: Vec<Complex64>,
}

impl Chain {
    pub fn new(radar: &Radar, settings: &FrontEndSettings) -> Chain {
        let channel_gains = match &settings.channels {
            Some(e) => channels::gains(e, radar.tx.len(), radar.rx.len()),
            None => Vec::new(),
        };
        Chain {
            settings: settings.clone(),
            timing: Timing::of(radar),
            spills: spill::spills(radar, settings),
            channel_gains,
        }
    }

    /// What the amplitude conj(a₀) e^{jφ} of an echo is multiplied by in `channel`: the filters at its beat
    /// frequency and the channel's error.
    pub fn echo_gain(&self, channel: usize, beat_hz: f64) -> Complex64 {
        let error = self.channel_gains.get(channel).copied().unwrap_or(Complex64::ONE);
        error * self.settings.filters.gain(beat_hz)
    }

    /// Samples that the cube has to hold before the first and after the last one of each ramp so that the
    /// oscillator's effects are exact at the ends of the record; 0 when none of them is on. The echoes go
    /// on there as if the ramp did. With fewer the front end works, and they are wrong by at most their own
    /// size over a share f_s/B of the record.
    pub fn margin(&self) -> usize {
        let s = &self.settings;
        if s.phase_noise.is_some() {
            phase_noise::reach(&self.timing) + TAPER
        } else if s.chirp_jitter_rms_s.is_some() || s.aperture_jitter_rms_s.is_some() {
            TAPER
        } else {
            0
        }
    }
}

/// Samples over which the margin falls to nothing.
pub const TAPER: usize = 64;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_are_normal_and_streams_differ() {
        let n = 200_000u64;
        let (mut sum, mut square, mut fourth, mut cross) = (0.0, 0.0, 0.0, 0.0);
        for i in 0..n {
            let [a, b] = normals(5, 2, PHASE_NOISE_STREAM, i);
            sum += a + b;
            square += a * a + b * b;
            fourth += a.powi(4) + b.powi(4);
            cross += a * b;
        }
        let n2 = 2.0 * n as f64;
        // Four standard deviations of each mean: 1, 2, 96 and 1 (per draw).
        assert!((sum / n2).abs() < 4.0 * n2.powf(-0.5));
        assert!((square / n2 - 1.0).abs() < 4.0 * (2.0 / n2).sqrt());
        assert!((fourth / n2 - 3.0).abs() < 4.0 * (96.0 / n2).sqrt());
        assert!((cross / n as f64).abs() < 4.0 * (n as f64).powf(-0.5));
        assert_ne!(normals(5, 2, 1, 0), normals(5, 2, 2, 0));
        assert_ne!(normals(5, 2, 1, 0), normals(5, 3, 1, 0));
        assert_ne!(normals(5, 2, 1, 0), normals(5 | 1 << 40, 2, 1, 0));
    }
}
