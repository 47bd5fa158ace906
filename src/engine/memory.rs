//! How much memory a frame takes, before it is made.

use super::{Engine, Precision};
use crate::adc::shaping::Shaping;
use crate::base::error::{BadInput, Result};
use crate::base::machine;
use crate::scene::radar::Radar;
use crate::scene::waveform::Multiplex;

/// Bytes of one frame's arrays, and the most that are held at once. Small things (tables of windows, points) are not counted.
/// Numbers are f64, which does not overflow however large the counts are.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct FrameMemory {
    /// Samples as the converter delivers them.
    pub cube_bytes: f64,
    /// Spectrum of one ramp, with both transforms' lengths.
    pub spectrum_bytes: f64,
    /// Range-Doppler maps of all ramps with the detector's mask.
    pub map_bytes: f64,
    /// Bytes of the echoes.
    pub echo_bytes: f64,
    /// The most that synthesis or processing holds in the host's memory.
    pub peak_bytes: f64,
}

impl FrameMemory {
    /// Of a radar's frame with so many echoes. On the gpu engine spectra stay on the adapter, and samples come back through
    /// a second copy.
    pub fn of(radar: &Radar, echoes: usize, precision: Precision, on_gpu: bool) -> FrameMemory {
        let (complex, real) = match precision {
            Precision::F32 => (8.0, 4.0),
            Precision::F64 => (16.0, 8.0),
        };
        let product = |list: &[usize]| list.iter().map(|n| *n as f64).product::<f64>();
        let p = &radar.processing;
        let parts = radar.waveform.parts();
        let bands = match radar.multiplex {
            Multiplex::Ddm { bands } => bands,
            _ => 1,
        };
        let shaped = Shaping::of(radar, 0.0).is_some();
        let cube_bytes = complex * product(&[radar.rows(), radar.channels(), radar.samples]);
        // Lines of one ramp, of every pair of a transmitter and a receiver.
        let ways = radar.channels().max(radar.virtual_channels());
        let lines_bytes = complex * product(&[radar.chirps, ways, radar.lines().count]);
        let apart = parts > 1 || shaped || ways > radar.channels();
        let spectrum_bytes = complex * product(&[p.doppler_fft, radar.channels(), radar.range_bins()]);
        // In the engine's precision and handed on in f64, with a mask.
        let cells = product(&[radar.doppler_rows(), radar.range_bins()]);
        let maps = (parts * radar.migration_ambiguities().count()) as f64;
        let map_bytes = 9.0 * cells * maps;
        let beams = product(&[p.azimuth_bins, p.elevation_bins]);
        let angle_bytes = beams * (8.0 + complex * (radar.virtual_channels() * bands) as f64);
        let echo_bytes = (echoes * size_of::<crate::trace::Echo>()) as f64;
        let synthesis =
            cube_bytes * if parts > 1 { 2.0 } else { 1.0 } + if apart { lines_bytes } else { 0.0 };
        let copied = if p.remove_static || shaped { lines_bytes } else { 0.0 };
        let spectra = if p.keystone { 2.0 } else { 1.0 } * spectrum_bytes;
        let processing = match on_gpu {
            true => 2.0 * cube_bytes,
            false => cube_bytes + copied + spectra,
        } + map_bytes
            + real * cells;
        let peak_bytes = echo_bytes + synthesis.max(processing).max(cube_bytes + map_bytes + angle_bytes);
        FrameMemory { cube_bytes, spectrum_bytes, map_bytes, echo_bytes, peak_bytes }
    }

    /// Refuses a frame that needs more than the machine has, with what asks for most of it.
    ///
    /// # Errors
    /// Returns an error if the frame needs more memory than the machine has.
    pub fn check(&self, radar: &Radar) -> Result<()> {
        let Err(e) = machine::require(self.peak_bytes, "its frames") else { return Ok(()) };
        let p = &radar.processing;
        let of = |key: &str, list: &[usize]| {
            let values: Vec<String> = list.iter().map(usize::to_string).collect();
            (key.to_string(), values.join(" x "))
        };
        let samples = [radar.rows(), radar.channels(), radar.samples];
        let least = self.cube_bytes.max(self.spectrum_bytes + self.map_bytes);
        let (key, value) = match () {
            () if self.echo_bytes > 0.5 * self.peak_bytes => ("trace".into(), "the echoes".into()),
            () if self.peak_bytes > 8.0 * least => {
                of("processing.azimuth_bins x processing.elevation_bins", &[p.azimuth_bins, p.elevation_bins])
            }
            () if self.cube_bytes >= self.spectrum_bytes => of("chirps x channels x samples", &samples),
            () => of(
                "processing.doppler_fft x channels x range cells of processing.range_fft",
                &[p.doppler_fft, radar.channels(), radar.range_bins()],
            ),
        };
        let named = match radar.name.as_str() {
            "" => key,
            name => format!("radar '{name}': {key}"),
        };
        Err(BadInput { key: Some(named), value: Some(value), ..*e }.into())
    }
}

/// The most that the buffers of one submission of many frames take, bytes. So much the device keeps for the next one.
const MOST_BATCH_BYTES: u64 = 1 << 30;
/// They take at most so many times what the adapter binds at once, which is all that it tells of its memory.
const BATCH_BINDINGS: u64 = 8;
/// They take at most one part in so many of the memory that is free: software adapters live in it, results come back to it, and other
/// workers have frames too.
const BATCH_SHARE: u64 = 8;

impl Engine {
    /// The most that the frames of one submission take together, bytes: 1 GiB, 8 times the largest binding of the adapter, or an
    /// eighth of the free memory, whichever is least. A single frame may take more.
    pub fn batch_bytes(&self) -> u64 {
        let of_adapter = match self {
            Engine::Cpu(_) => u64::MAX,
            Engine::Gpu(gpu) => gpu.max_binding_bytes().saturating_mul(BATCH_BINDINGS),
        };
        let of_host = machine::available_bytes().map_or(u64::MAX, |bytes| bytes / BATCH_SHARE);
        MOST_BATCH_BYTES.min(of_adapter).min(of_host)
    }

    /// What a frame of this radar with so many echoes takes on this engine.
    pub fn memory(&self, radar: &Radar, echoes: usize) -> FrameMemory {
        match self {
            Engine::Cpu(precision) => FrameMemory::of(radar, echoes, *precision, false),
            Engine::Gpu(_) => FrameMemory::of(radar, echoes, Precision::F32, true),
        }
    }

    /// Checks that a frame fits into the memory.
    ///
    /// # Errors
    /// Returns an error if a frame of this radar with so many echoes needs more memory than the machine has.
    pub fn check_memory(&self, radar: &Radar, echoes: usize) -> Result<()> {
        self.memory(radar, echoes).check(radar)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::radar_toml::preset;

    #[test]
    fn arrays_are_as_large_as_those_that_are_made() {
        let mut radar = preset("front77").unwrap();
        let m = FrameMemory::of(&radar, 0, Precision::F32, false);
        let samples = radar.rows() * radar.channels() * radar.samples;
        assert_eq!(m.cube_bytes, 8.0 * samples as f64);
        assert!(m.peak_bytes > m.cube_bytes + m.spectrum_bytes);
        assert_eq!(FrameMemory::of(&radar, 0, Precision::F64, false).cube_bytes, 2.0 * m.cube_bytes);
        (radar.processing.range_fft, radar.processing.doppler_fft) = (1 << 18, 1 << 18);
        let large = FrameMemory::of(&radar, 0, Precision::F32, false);
        assert!(large.spectrum_bytes >= 8.0 * 2f64.powi(35), "{large:?}");
        radar.processing.elevation_bins = 65536;
        radar.processing.azimuth_bins = 65536;
        assert!(FrameMemory::of(&radar, 0, Precision::F32, true).peak_bytes > 8.0 * 2f64.powi(32));
    }
}
