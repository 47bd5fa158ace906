//! Radars.

use crate::arrays::{array, plain};
use crate::errors::{Failed, OrRaise};
use catseye::scene::processing_changes::with_processing;
use catseye::scene::radar::{Antenna, Radar as Described};
use catseye::scene::radar_toml;
use catseye_io::manifest::Axes;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Returns the names of the built-in radars.
#[pyfunction]
pub fn presets() -> Vec<&'static str> {
    radar_toml::PRESETS.iter().map(|(name, _)| *name).collect()
}

/// A radar with antennas, waveform and processing. name: a preset (`catseye.presets()`) or the path of a radar TOML. `Radar.parse` reads a radar from
/// text.
///
/// Raises BadInput with the line of the file that is not valid.
#[pyclass(module = "catseye", frozen)]
pub struct Radar {
    pub radar: Arc<Described>,
}

fn places(py: Python<'_>, antennas: &[Antenna]) -> PyResult<Py<PyAny>> {
    let data = antennas.iter().flat_map(|a| a.position_m.to_array()).collect();
    array(py, data, &[antennas.len(), 3])
}

#[pymethods]
impl Radar {
    #[new]
    fn new(py: Python<'_>, name: PathBuf) -> PyResult<Radar> {
        let name = name.to_string_lossy().into_owned();
        let radar = py.detach(|| radar_toml::load(&name, Path::new(""))).or_raise(py)?;
        Ok(Radar { radar: Arc::new(radar) })
    }

    /// Reads a radar from TOML text. folder: where files that the text names are looked for. Raises BadInput with the line that is not valid.
    #[staticmethod]
    #[pyo3(signature = (text, *, folder = PathBuf::new()))]
    fn parse(py: Python<'_>, text: &str, folder: PathBuf) -> PyResult<Radar> {
        let radar = radar_toml::parse(&folder.join("radar.toml"), text).or_raise(py)?;
        Ok(Radar { radar: Arc::new(radar) })
    }

    /// Returns the complete radar as TOML text.
    fn to_toml(&self, py: Python<'_>) -> PyResult<String> {
        radar_toml::to_toml(&self.radar).or_raise(py)
    }

    /// Returns a radar with other settings of its processing. The keywords are the keys of `[processing]` of a radar file. A window may be given by
    /// its name; `angle` and `cfar` are dictionaries that change the keys they name.
    ///
    /// Raises BadInput for an unknown key and for a value outside its range.
    #[pyo3(signature = (**changes))]
    fn with_processing(&self, py: Python<'_>, changes: Option<&Bound<'_, PyDict>>) -> PyResult<Radar> {
        let Some(changes) = changes else { return Ok(Radar { radar: self.radar.clone() }) };
        let text: String = py.import("json")?.call_method1("dumps", (changes,))?.extract()?;
        let changes = serde_json::from_str(&text).map_err(|e| Failed::new_err(format!("JSON: {e}")))?;
        let radar = with_processing(&self.radar, &changes).or_raise(py)?;
        Ok(Radar { radar: Arc::new(radar) })
    }

    /// Settings of the processing, a dictionary; angles in radians.
    #[getter]
    fn processing(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        plain(py, &self.radar.processing)
    }

    /// Pickles the radar as its TOML text (angles to rounding).
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (String,))> {
        Ok((py.get_type::<Radar>().getattr("parse")?, (self.to_toml(py)?,)))
    }

    #[getter]
    fn name(&self) -> &str {
        &self.radar.name
    }

    /// Centre frequency of the sweep or band, Hz.
    #[getter]
    fn carrier_hz(&self) -> f64 {
        self.radar.carrier_hz
    }

    #[getter]
    fn wavelength_m(&self) -> f64 {
        self.radar.wavelength_m()
    }

    #[getter]
    fn bandwidth_hz(&self) -> f64 {
        self.radar.bandwidth_hz()
    }

    #[getter]
    fn sample_rate_hz(&self) -> f64 {
        self.radar.sample_rate_hz
    }

    #[getter]
    fn frame_time_s(&self) -> f64 {
        self.radar.frame_time_s()
    }

    /// Shape of a cube of samples: (chirp, rx_virtual, sample).
    #[getter]
    fn shape(&self) -> (usize, usize, usize) {
        (self.radar.rows(), self.radar.channels(), self.radar.samples)
    }

    #[getter]
    fn range_bin_m(&self) -> f64 {
        self.radar.range_bin_m()
    }

    #[getter]
    fn velocity_bin_mps(&self) -> f64 {
        self.radar.velocity_bin_mps()
    }

    /// Maximum unambiguous range, m.
    #[getter]
    fn max_range_m(&self) -> f64 {
        self.radar.max_range_m()
    }

    /// Maximum unambiguous |range rate| of a row of the map, m/s.
    #[getter]
    fn max_velocity_mps(&self) -> f64 {
        self.radar.max_velocity_mps()
    }

    /// Ranges of the columns of the range-Doppler map in m, float64 [range].
    #[getter]
    fn range_m(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        axis(py, Axes::of(&self.radar).range_m.values())
    }

    /// Range rates of the rows of the range-Doppler map in m/s, float64 [doppler], positive receding.
    #[getter]
    fn range_rate_mps(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        axis(py, Axes::of(&self.radar).range_rate_mps.values())
    }

    /// Phase centres of the transmitters in the sensor frame (x boresight, y left, z up) in m, float64 [transmitter, 3].
    #[getter]
    fn tx_position_m(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        places(py, &self.radar.tx)
    }

    /// Phase centres of the receivers in the sensor frame in m, float64 [receiver, 3].
    #[getter]
    fn rx_position_m(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        places(py, &self.radar.rx)
    }

    fn __repr__(&self) -> String {
        let (chirps, channels, samples) = self.shape();
        let ghz = 1e-9 * self.radar.carrier_hz;
        format!("<catseye.Radar {}: {ghz} GHz, {chirps} x {channels} x {samples}>", self.radar.name)
    }
}

fn axis(py: Python<'_>, data: Vec<f64>) -> PyResult<Py<PyAny>> {
    let n = data.len();
    array(py, data, &[n])
}

/// The radar that an argument means: a Radar, a preset, or a path.
pub fn resolve(argument: &Bound<'_, PyAny>) -> PyResult<Arc<Described>> {
    if let Ok(radar) = argument.cast::<Radar>() {
        return Ok(radar.get().radar.clone());
    }
    Ok(Radar::new(argument.py(), argument.extract()?)?.radar)
}
