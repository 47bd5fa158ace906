//! The spectrum on the device, in as many buffers as the adapter asks for.

use super::Spectrum;
use super::transform::Transform;
use crate::base::error::{BadInput, Result};
use crate::gpu::{Buffer, Gpu, Recorder};
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
    /// Uploads a spectrum with as many Doppler bands as `t` has, in chunks of channels that the adapter can bind.
    ///
    /// # Errors
    /// Returns an error for a spectrum of another shape than that of `t`, or of which not one channel fits a buffer of the adapter.
    pub(crate) fn upload(
        recorder: &mut Recorder<'_>,
        gpu: &Gpu,
        of: &Spectrum<f32>,
        t: &Transform,
    ) -> Result<DeviceSpectrum> {
        t.check_spectrum([of.doppler_bins, of.channels, of.range_bins])?;
        let (rows, ranges, bands) = (of.doppler_bins, of.range_bins, t.bands);
        let own = of.channels / bands;
        let fits = gpu.max_binding_bytes() as usize / size_of::<Complex32>();
        let together = (fits / (bands * rows * ranges)).min(own);
        if together == 0 {
            return Err(BadInput::new("a buffer of this adapter cannot hold one channel of the spectrum")
                .key("spectrum")
                .value(format!("{rows} x {} x {ranges}", of.channels))
                .allowed(format!("{} bytes a buffer", gpu.max_binding_bytes()))
                .remedy("use --device cpu")
                .into());
        }
        let mut chunks = Vec::new();
        for first_channel in (0..own).step_by(together) {
            let channels = together.min(own - first_channel);
            let mut part = Vec::with_capacity(bands * rows * channels * ranges);
            // As the transform leaves them: the first band, then from the last down.
            for band in (0..bands).map(|stored| (bands - stored) % bands) {
                for row in 0..rows {
                    let at = (row * of.channels + band * own + first_channel) * ranges;
                    part.extend_from_slice(&of.data[at..at + channels * ranges]);
                }
            }
            let spectrum = recorder.upload("spectrum", &part);
            chunks.push(Chunk { spectrum, first_channel, channels, first_range: 0, ranges });
        }
        Ok(DeviceSpectrum {
            chunks,
            doppler_bins: rows,
            bands,
            map_scale: t.map_scale,
            channels: of.channels,
            range_bins: ranges,
        })
    }

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
