//! Random numbers of the front end: one Philox stream for each cause.

use crate::base::rng::philox4x32_10;
use std::f64::consts::TAU;

/// Philox streams of the front end; 0 is the thermal noise.
pub const PHASE_NOISE_STREAM: u32 = 1;

/// Stream of the jitter of chirps' starts.
pub const CHIRP_JITTER_STREAM: u32 = 2;

/// Stream of the jitter of sampling instants.
pub const APERTURE_JITTER_STREAM: u32 = 3;

/// Stream of the errors of channels' gains and phases.
pub const CHANNEL_GAIN_STREAM: u32 = 4;

/// Stream of the errors of elements' positions.
pub const POSITION_STREAM: u32 = 5;

/// Stream of the interferers' start times.
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

/// Four random words of the generator of [`normals`].
pub fn words(seed: u64, frame: u32, stream: u32, index: u64) -> [u32; 4] {
    philox4x32_10([index as u32, (index >> 32) as u32, (seed >> 32) as u32, stream], [seed as u32, frame])
}
