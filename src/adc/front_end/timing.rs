//! When a cube is sampled.

use crate::scene::radar::{Radar, Sampling};
use num_complex::Complex64;
use std::f64::consts::SQRT_2;

/// When and how fast the cube was sampled.
#[derive(Debug, Clone, PartialEq)]
pub struct Timing {
    /// Whether samples are real or complex.
    pub sampling: Sampling,
    /// Samples a second, Hz.
    pub sample_rate_hz: f64,
    /// Rise of the sent frequency, Hz/s; falling when negative.
    pub slope_hz_per_s: f64,
    /// Sent frequency at the ramp's start.
    pub start_hz: f64,
    /// Time from the ramp's start to the first sample, s.
    pub adc_start_s: f64,
    /// Ramps of this slope that one loop holds. Channels of one ramp follow each other,
    /// so that channel c of C belongs to ramp ⌊c slots/C⌋.
    pub slots: usize,
    /// Start of each ramp, `[loop, slot]`, s.
    pub starts_s: Vec<f64>,
}

impl Timing {
    /// The timing of a radar's cube.
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
