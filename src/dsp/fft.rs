//! Range and Doppler transforms: sizes, windows and the host side of the kernel (CONVENTIONS
//! eq. 14).

use super::window;
use crate::adc::Cube;
use crate::error::{BadInput, Result};
use crate::scene::radar::{Processing, Radar, Sampling};

/// The two transforms of a cube: `[chirp, channel, sample]` to `[doppler, channel, range]`.
/// The windows are scaled so that eq. 14 holds with a plain sum: they carry 1/sum(w), and sqrt 2 for
/// real sampling.
#[derive(Debug, Clone, PartialEq)]
pub struct Transform {
    pub chirps: usize,
    pub channels: usize,
    pub samples: usize,
    pub range_fft: usize,
    /// Bins kept: half of `range_fft` for real sampling.
    pub range_bins: usize,
    pub doppler_fft: usize,
    /// One weight a sample.
    pub range_window: Vec<f64>,
    /// One weight a chirp.
    pub doppler_window: Vec<f64>,
}

impl Transform {
    /// Errors: an empty cube, or a transform shorter than the data.
    pub fn new(
        chirps: usize,
        channels: usize,
        samples: usize,
        sampling: Sampling,
        processing: &Processing,
    ) -> Result<Self> {
        for (key, count, fft) in [
            ("processing.range_fft", samples, processing.range_fft),
            ("processing.doppler_fft", chirps, processing.doppler_fft),
        ] {
            if count == 0 || channels == 0 {
                return Err(BadInput::new("the cube is empty")
                    .key("cube")
                    .value(format!("{chirps} x {channels} x {samples}"))
                    .allowed("at least one chirp, channel and sample")
                    .into());
            }
            if fft < count {
                return Err(BadInput::new("the FFT is shorter than the data")
                    .key(key)
                    .value(fft)
                    .allowed(format!("{count} or more"))
                    .into());
            }
        }
        let (range_bins, gain) = match sampling {
            Sampling::Real if processing.range_fft < 2 => {
                return Err(BadInput::new("real sampling needs a range FFT of at least 2")
                    .key("processing.range_fft")
                    .value(processing.range_fft)
                    .into());
            }
            Sampling::Real => (processing.range_fft / 2, std::f64::consts::SQRT_2),
            Sampling::Iq => (processing.range_fft, 1.0),
        };
        let scaled = |w: Vec<f64>, gain: f64| {
            let sum: f64 = w.iter().sum();
            w.iter().map(|v| v * gain / sum).collect()
        };
        Ok(Transform {
            chirps,
            channels,
            samples,
            range_fft: processing.range_fft,
            range_bins,
            doppler_fft: processing.doppler_fft,
            range_window: scaled(window::coefficients(processing.range_window, samples)?, gain),
            doppler_window: scaled(window::coefficients(processing.doppler_window, chirps)?, 1.0),
        })
    }

    /// For a cube of this radar. Errors: a cube whose shape is not the radar's.
    pub fn of_cube<T>(cube: &Cube<T>, radar: &Radar) -> Result<Self> {
        let (shape, want) =
            ([cube.chirps, cube.channels, cube.samples], [radar.chirps, radar.channels(), radar.samples]);
        if shape != want || cube.data.len() != want.iter().product::<usize>() {
            return Err(BadInput::new("the cube does not have the radar's shape [chirp, channel, sample]")
                .key("cube")
                .value(format!("{shape:?} ({} samples)", cube.data.len()))
                .allowed(format!("{want:?}"))
                .remedy("give the radar that the cube was taken with")
                .into());
        }
        Self::new(cube.chirps, cube.channels, cube.samples, radar.sampling, &radar.processing)
    }

    /// Columns of the spectrum: channels x range bins.
    pub fn columns(&self) -> usize {
        self.channels * self.range_bins
    }

    /// The row that transform bin `k` goes to: zero Doppler to row M/2.
    pub fn doppler_row(&self, k: usize) -> usize {
        (k + self.doppler_fft / 2) % self.doppler_fft
    }
}
