//! Jitter of the ramp's start and of the sampling instants (CONVENTIONS eq. 103, 104).

use super::draws::{APERTURE_JITTER_STREAM, CHIRP_JITTER_STREAM, normals};
use std::f64::consts::TAU;

/// Delay with which ramp `ramp` (loop · slots + slot) starts, s. Mixer and transmitter share the ramp, so a beat tone
/// of frequency f_b turns by −2π f_b δ and nothing else changes.
pub fn chirp_start_s(rms_s: f64, seed: u64, frame: u32, ramp: usize) -> f64 {
    rms_s * normals(seed, frame, CHIRP_JITTER_STREAM, ramp as u64)[0]
}

/// Delay with which sample `sample` of ramp `ramp` is taken, s: the same in all channels, which share the clock.
pub fn aperture_s(rms_s: f64, seed: u64, frame: u32, ramp: usize, sample: usize) -> f64 {
    let index = (ramp as u64) << 32 | sample as u64;
    rms_s * normals(seed, frame, APERTURE_JITTER_STREAM, index)[0]
}

/// Signal to noise of a tone sampled with jitter, dB: −20 lg(2π f σ).
pub fn snr_db(freq_hz: f64, rms_s: f64) -> f64 {
    -20.0 * (TAU * freq_hz * rms_s).log10()
}
