//! Cubes, from wherever, to maps and points.

use crate::errors::refuse;
use crate::simulate::{axes, maps, plot_keywords, points};
use crate::{arrays, drawn, engine, radar, work};
use catseye::adc::Cube;
use catseye::base::error::BadInput;
use catseye::detect::Bodies;
use catseye::detect::conjugate::looks_conjugate;
use catseye::dsp::lost_chirps::LostChirps;
use catseye::dsp::sample_checks;
use catseye::engine::{AnyCube, Engine, Precision};
use catseye::scene::unusual;
use catseye::simulate::{Stages, detect};
use catseye::trace::Echoes;
use num_complex::{Complex32, Complex64};
use numpy::{PyReadonlyArray3, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::{PyUserWarning, PyValueError};
use pyo3::prelude::*;
use pyo3::types::IntoPyDict;

/// Result of `process`: the power maps, detections and points of one cube.
#[pyclass(module = "catseye", frozen)]
pub struct Detections {
    /// Range-Doppler map of the first ramp, float32 [doppler, range] (float64 with an f64 engine): power in W, zero Doppler in the middle row.
    #[pyo3(get)]
    range_doppler: Py<PyAny>,
    /// Maps of all ramps, the first of which is `range_doppler`.
    #[pyo3(get)]
    maps: Vec<Py<PyAny>>,
    /// Detected cells of the first map, bool [doppler, range].
    #[pyo3(get)]
    mask: Py<PyAny>,
    /// Ranges of the columns of the map in m, float64 [range].
    #[pyo3(get)]
    range_m: Py<PyAny>,
    /// Range rates of the rows of the map in m/s, float64 [doppler], positive receding.
    #[pyo3(get)]
    range_rate_mps: Py<PyAny>,
    /// Structured array [point] with the columns of points.csv, in the sensor frame, without labels.
    #[pyo3(get)]
    points: Py<PyAny>,
}

#[pymethods]
impl Detections {
    /// Draws the range-Doppler map in dBm, or the points from above, with matplotlib; returns the Axes.
    ///
    /// kind: "range_doppler" or "birds_eye", as for `Frame.plot`. points: draw the points too. ax: Axes to draw into. Raises ImportError without
    /// matplotlib.
    #[pyo3(signature = (kind = "range_doppler", *, points = true, ax = None))]
    fn plot(
        slf: &Bound<'_, Self>,
        kind: &str,
        points: bool,
        ax: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Py<PyAny>> {
        drawn::call(slf, "plot_frame", Some(&plot_keywords(slf.py(), kind, points, ax)?))
    }

    fn _repr_html_(slf: &Bound<'_, Self>) -> PyResult<Py<PyAny>> {
        drawn::call(slf, "frame_html", None)
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("<catseye.Detections: {} points>", self.points.bind(py).len()?))
    }
}

/// The samples as the engine takes them. Errors: another shape or type.
fn cube(adc: &Bound<'_, PyAny>, wide: bool, expected: [usize; 3]) -> PyResult<AnyCube> {
    let py = adc.py();
    let untyped = adc.cast::<PyUntypedArray>()?;
    if untyped.shape() != expected {
        let e = BadInput::new("the array is not a cube of this radar")
            .key("shape")
            .value(format!("{:?}", untyped.shape()))
            .allowed(format!("{expected:?}: [chirp, rx_virtual, sample]"));
        return refuse(py, e);
    }
    let [chirps, channels, samples] = expected;
    let cast = |name: &str| -> PyResult<Bound<'_, PyAny>> {
        let keywords = [("order", "C"), ("casting", "same_kind")].into_py_dict(py)?;
        adc.getattr("astype")?.call((name,), Some(&keywords))
    };
    Ok(match wide {
        true => {
            let data: PyReadonlyArray3<'_, Complex64> = cast("complex128")?.extract()?;
            AnyCube::F64(Cube { chirps, channels, samples, data: data.as_slice()?.to_vec() })
        }
        false => {
            let data: PyReadonlyArray3<'_, Complex32> = cast("complex64")?.extract()?;
            AnyCube::F32(Cube { chirps, channels, samples, data: data.as_slice()?.to_vec() })
        }
    })
}

/// Fills lost chirps, and gives a line for each thing of which the user has to know.
fn repaired<T: catseye::dsp::Real>(shape: [usize; 3], data: &mut [num_complex::Complex<T>]) -> Vec<String> {
    let lost = LostChirps::find(shape, data);
    let lines = sample_checks::lines(shape, data);
    lost.fill(data);
    lost.lines().into_iter().chain(lines).collect()
}

/// Computes range-Doppler map, detections and points of a cube and returns them as Detections.
///
/// adc: array [chirp, rx_virtual, sample], complex or real, in sqrt(W) at the receiver's input (other units give relative powers). radar: a Radar, a
/// preset or a path. engine: an Engine or the name of a device. Chirps with runs of zeros, as lost packets leave them, are filled by prediction, with
/// a UserWarning. A UserWarning also reports a cube that looks like the complex conjugate of what the radar would record, and unusual values of the
/// radar.
///
/// Raises BadInput for an array of another shape or with values that are not finite.
#[pyfunction]
#[pyo3(signature = (adc, *, radar, engine = None))]
pub fn process(
    py: Python<'_>,
    adc: &Bound<'_, PyAny>,
    radar: &Bound<'_, PyAny>,
    engine: Option<&Bound<'_, PyAny>>,
) -> PyResult<Detections> {
    let radar = radar::resolve(radar)?;
    let engine = engine::resolve(py, engine, None)?;
    let wide = matches!(*engine, Engine::Cpu(Precision::F64));
    let shape = [radar.rows(), radar.channels(), radar.samples];
    let mut cube = cube(adc, wide, shape)?;
    let finite = match &cube {
        AnyCube::F32(c) => c.data.iter().all(|z| z.is_finite()),
        AnyCube::F64(c) => c.data.iter().all(|z| z.is_finite()),
    };
    if !finite {
        let e = BadInput::new("a sample is not a finite number").key("adc");
        return refuse(py, e.remedy("repair the recording"));
    }
    let lost = match &mut cube {
        AnyCube::F32(c) => repaired(shape, &mut c.data),
        AnyCube::F64(c) => repaired(shape, &mut c.data),
    };
    let described = radar.clone();
    let (found, cloud) = work::run(py, None, move |_| {
        let nothing = (&Echoes::default(), &Bodies::default());
        detect(&engine, &described, &cube, None, nothing, &mut Stages::default())
    })?;
    let conjugate = looks_conjugate(&radar, &found[0].map).map(|line| line + " (numpy.conj)");
    for line in unusual::of_radar(&radar).into_iter().chain(lost).chain(conjugate) {
        let text = std::ffi::CString::new(line).map_err(|e| PyValueError::new_err(e.to_string()))?;
        PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 1)?;
    }
    let shape = [found[0].map.doppler_bins, found[0].map.range_bins];
    let mask = arrays::array(py, found[0].detection.mask.clone(), &shape)?;
    let maps = maps(py, found, wide)?;
    let [range_m, range_rate_mps] = axes(py, &radar)?;
    Ok(Detections {
        range_doppler: maps[0].clone_ref(py),
        maps,
        mask,
        range_m,
        range_rate_mps,
        points: points(py, &cloud)?,
    })
}
