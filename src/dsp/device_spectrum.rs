//! The spectrum on the device, in as many buffers as the adapter asks for.

use super::Spectrum;
use crate::base::error::Result;
use crate::gpu::{Buffer, Gpu};
use num_complex::Complex32;

/// Some channels of the receiver and range columns of the spectrum, `[band, doppler, channel, range]`. Bands (eq. 19a) lie
/// as the transform leaves them: the first, then from the last down.
#[derive(Clone)]
pub(crate) struct Chunk {
    pub spectrum: Buffer<Complex32>,
    pub first_channel: usize,
    pub channels: usize,
    pub first_range: usize,
    pub ranges: usize,
}

/// A spectrum in the adapter's memory, in chunks that it can bind.
#[derive(Clone)]
pub struct DeviceSpectrum {
    pub(crate) chunks: Vec<Chunk>,
    /// Rows of the map.
    pub doppler_bins: usize,
    /// Doppler bands (DDM), else 1.
    pub bands: usize,
    /// Factor of the map ([`Transform::map_scale`](super::transform::Transform::map_scale)).
    pub map_scale: f64,
    /// Bands times the channels of the cube.
    pub channels: usize,
    /// Number of range columns.
    pub range_bins: usize,
}

impl DeviceSpectrum {
    /// Number of buffers that the spectrum fills.
    pub fn chunks(&self) -> usize {
        self.chunks.len()
    }

    /// Copies the spectrum to the host.
    ///
    /// # Errors
    /// Returns an error if the adapter fails.
    pub fn read(&self, gpu: &Gpu) -> Result<Spectrum<f32>> {
        let mut recorder = gpu.recorder("spectrum");
        let pending: Vec<_> = self.chunks.iter().map(|c| recorder.read(&c.spectrum)).collect();
        let mut done = recorder.submit()?;
        let mut data = vec![Complex32::default(); self.doppler_bins * self.channels * self.range_bins];
        for (chunk, pending) in self.chunks.iter().zip(pending) {
            let part = done.take(pending);
            for (line, from) in part.chunks_exact(chunk.ranges).enumerate() {
                let (row, c) = (line / chunk.channels, line % chunk.channels);
                let (stored, d) = (row / self.doppler_bins, row % self.doppler_bins);
                let band = (self.bands - stored) % self.bands;
                let c = band * (self.channels / self.bands) + chunk.first_channel + c;
                let at = (d * self.channels + c) * self.range_bins + chunk.first_range;
                data[at..at + chunk.ranges].copy_from_slice(from);
            }
        }
        Ok(Spectrum {
            doppler_bins: self.doppler_bins,
            channels: self.channels,
            range_bins: self.range_bins,
            data,
        })
    }
}
