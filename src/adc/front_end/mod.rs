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
pub mod draws;
pub mod filters;
pub mod jitter;
pub mod phase_noise;
pub mod spill;
pub mod timing;

use crate::scene::front_end::FrontEndSettings;
use crate::scene::radar::Radar;
use num_complex::Complex64;
use spill::Spill;
use timing::Timing;

/// The front end of one radar.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    /// What the file asks for.
    pub settings: FrontEndSettings,
    /// When and how fast the radar samples.
    pub timing: Timing,
    /// Leakage and cover, without the filters' gain.
    pub spills: Vec<Spill>,
    /// Factor of each channel; empty when there are no channel errors.
    pub channel_gains: Vec<Complex64>,
}

impl Chain {
    /// The chain of a radar with these settings.
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

    /// Factor by which the front end multiplies the amplitude conj(a₀) e^{jφ} of an echo in `channel`: the filters at
    /// its beat frequency and the channel's error.
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
    use super::draws::{PHASE_NOISE_STREAM, normals};

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
