//! From echoes to the samples that the radar's converter would deliver.
//!
//! Each echo is a phasor in each channel (CONVENTIONS eq. 9–12) whose phase is a polynomial of chirp and sample, so
//! that range migration and the coupling of range and Doppler are in it. The direct sum costs echoes × samples; for
//! many echoes [`gridding`] spreads them on a grid and takes an FFT. Thermal noise ([`noise`], eq. 13), other radars
//! ([`interference`], eq. 112) and the converter ([`convert`], eq. 109–111) follow. [`crate::engine::Engine::cube`]
//! does all of it.

pub mod budget;
pub mod convert;
pub mod cpu;
pub mod front_end;
pub mod grid_device;
pub mod grid_echoes;
pub mod grid_fft;
pub mod grid_lines;
pub mod grid_spread;
pub mod gridding;
pub mod interference;
pub mod methods;
pub mod noise;
pub mod schedule;
pub mod shaping;
pub mod synthesis;

use crate::gpu::{Buffer, Done, Pending, Recorder};
use num_complex::Complex;

/// Samples of one frame, `[chirp, channel, sample]`, row-major, in sqrt(W) at the receiver input.
/// `chirp` counts loops of each transmitter; channel = tx * n_rx + rx (CONVENTIONS eq. 10-12).
#[derive(Debug, Clone, PartialEq)]
pub struct Cube<T> {
    /// Number of chirps.
    pub chirps: usize,
    /// Number of virtual channels.
    pub channels: usize,
    /// Number of samples of a chirp.
    pub samples: usize,
    /// Samples, `[chirp, channel, sample]`, √W.
    pub data: Vec<Complex<T>>,
}

impl<T: Clone + Default> Cube<T> {
    /// A cube of zeros.
    pub fn zeros(chirps: usize, channels: usize, samples: usize) -> Self {
        Cube { chirps, channels, samples, data: vec![Complex::default(); chirps * channels * samples] }
    }

    /// Samples of one chirp of one channel.
    pub fn row(&self, chirp: usize, channel: usize) -> &[Complex<T>] {
        let at = (chirp * self.channels + channel) * self.samples;
        &self.data[at..at + self.samples]
    }
}

impl Cube<f64> {
    /// The same cube in single precision.
    pub fn to_f32(&self) -> Cube<f32> {
        Cube {
            chirps: self.chirps,
            channels: self.channels,
            samples: self.samples,
            data: self.data.iter().map(|z| Complex::new(z.re as f32, z.im as f32)).collect(),
        }
    }
}

impl Cube<f32> {
    /// The same cube in double precision.
    pub fn to_f64(&self) -> Cube<f64> {
        Cube {
            chirps: self.chirps,
            channels: self.channels,
            samples: self.samples,
            data: self.data.iter().map(|z| Complex::new(z.re as f64, z.im as f64)).collect(),
        }
    }
}

/// A cube on the device, in pieces of whole chirps that each fit one binding.
pub struct DeviceCube {
    /// Number of chirps.
    pub chirps: usize,
    /// Number of virtual channels.
    pub channels: usize,
    /// Number of samples of a chirp.
    pub samples: usize,
    /// Pieces in the order of chirps; together they are the whole cube.
    pub pieces: Vec<CubePiece>,
}

/// A piece of the cube: chirps `first_chirp..first_chirp + chirps`, `[chirp, channel, sample]`, (I, Q) in √W.
pub struct CubePiece {
    /// First chirp of the piece.
    pub first_chirp: usize,
    /// Number of chirps of the piece.
    pub chirps: usize,
    /// Samples on the device.
    pub data: Buffer<[f32; 2]>,
}

impl DeviceCube {
    /// Records the read-back, to be taken with [`DeviceCube::take`].
    pub fn read(&self, recorder: &mut Recorder) -> Vec<Pending<[f32; 2]>> {
        self.pieces.iter().map(|p| recorder.read(&p.data)).collect()
    }

    /// Gathers the pieces that were read back into one cube on the host.
    pub fn take(&self, done: &mut Done, pending: Vec<Pending<[f32; 2]>>) -> Cube<f32> {
        let mut data = Vec::with_capacity(self.chirps * self.channels * self.samples);
        for p in pending {
            data.extend(done.take(p).into_iter().map(|[re, im]| Complex::new(re, im)));
        }
        Cube { chirps: self.chirps, channels: self.channels, samples: self.samples, data }
    }
}
