//! From echoes to the samples that the radar's converter would deliver.

pub mod noise;
pub mod synthesis;

use num_complex::Complex;

/// Samples of one frame, `[chirp, channel, sample]`, row-major, in sqrt(W) at the receiver input.
/// `chirp` counts loops of each transmitter; channel = tx * n_rx + rx (CONVENTIONS eq. 10-12).
#[derive(Debug, Clone, PartialEq)]
pub struct Cube<T> {
    pub chirps: usize,
    pub channels: usize,
    pub samples: usize,
    pub data: Vec<Complex<T>>,
}

impl<T: Clone + Default> Cube<T> {
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
    pub fn to_f64(&self) -> Cube<f64> {
        Cube {
            chirps: self.chirps,
            channels: self.channels,
            samples: self.samples,
            data: self.data.iter().map(|z| Complex::new(z.re as f64, z.im as f64)).collect(),
        }
    }
}
