//! Devices, and the engine that is opened on one.

use crate::arrays::plain;
use crate::errors::{Failed, refuse};
use crate::work;
use catseye::base::error::{BadInput, Result};
use catseye::engine::{Engine as Opened, Precision, Purpose, Tracing};
use pyo3::prelude::*;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

/// The rule by which "auto" chose an engine.
type Rule = Option<&'static str>;

/// An engine, and the rule where there was a choice.
type Chosen = (Arc<Opened>, Rule);

/// Returns the adapters of this machine as `catseye devices --json` prints them: {"auto": "gpu" or "cpu", "cpu_threads": int, "adapters": [{"name",
/// "driver", ..., "self_test"}, ...]}.
#[pyfunction]
pub fn devices(py: Python<'_>) -> PyResult<Py<PyAny>> {
    let listing = work::run(py, None, |_| Ok(catseye::engine::devices::listing()))?;
    plain(py, &listing)
}

/// The device that computes: the cpu, or a GPU.
///
/// device: "auto" (a hardware GPU, else the cpu), "cpu", "gpu" (a hardware GPU), or part of an adapter's name. The engine never silently uses another
/// device than the one asked for. precision: "f32" or "f64" (cpu only) of cube, FFT and detection; geometry, phase and fields are always f64. trace:
/// where the beams of frames are traced: "device" (the default on a GPU), "lines" (on a GPU, with lines instead of polygons; experimental) or "host"
/// (in f64; the only choice on the cpu, and faster than a software driver).
///
/// Raises BadInput for a device that does not exist and for trace = "device" or "lines" on the cpu, and Failed for a device that does not pass its
/// self-test.
#[pyclass(module = "catseye", frozen)]
pub struct Engine {
    opened: Arc<Opened>,
    pid: u32,
    arguments: (String, String, Option<String>),
}

#[pymethods]
impl Engine {
    #[new]
    #[pyo3(signature = (device = "auto", *, precision = "f32", trace = None))]
    fn new(py: Python<'_>, device: &str, precision: &str, trace: Option<&str>) -> PyResult<Engine> {
        let wanted = match precision {
            "f32" => Precision::F32,
            "f64" => Precision::F64,
            other => {
                let e = BadInput::new("unknown precision").key("precision").value(other).allowed("f32, f64");
                return refuse(py, e);
            }
        };
        let (name, place) = (device.to_string(), trace.map(String::from));
        let opened = Arc::new(work::run(py, None, move |_| open(&name, wanted, place.as_deref()))?);
        let arguments = (device.into(), precision.into(), trace.map(String::from));
        Ok(Engine { opened, pid: std::process::id(), arguments })
    }

    /// Engine, adapter and driver in one line.
    #[getter]
    fn description(&self) -> String {
        self.opened.describe()
    }

    /// Name of the adapter; "cpu" on the cpu.
    #[getter]
    fn adapter(&self) -> String {
        self.opened.report().adapter
    }

    /// Kind of the device: "cpu" or "gpu".
    #[getter]
    fn kind(&self) -> &'static str {
        self.opened.report().engine
    }

    /// Precision of cube, FFT and detection: "f32" or "f64".
    #[getter]
    fn precision(&self) -> &'static str {
        match self.opened.report().precision {
            Precision::F32 => "f32",
            Precision::F64 => "f64",
        }
    }

    /// Where the beams of frames are traced: "host", "device" or "lines".
    #[getter]
    fn trace(&self) -> &'static str {
        self.opened.tracing().word()
    }

    /// Pickles the arguments; unpickling opens the device again.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (String,))> {
        let kind = py.get_type::<Engine>();
        let partial = py.import("functools")?.getattr("partial")?;
        let keywords = pyo3::types::PyDict::new(py);
        keywords.set_item("precision", &self.arguments.1)?;
        keywords.set_item("trace", self.arguments.2.as_deref())?;
        let open = partial.call((kind,), Some(&keywords))?;
        Ok((open, (self.arguments.0.clone(),)))
    }

    fn __repr__(&self) -> String {
        format!("<catseye.Engine {}>", self.opened.describe())
    }
}

impl Engine {
    /// Errors: a GPU that another process opened, of which a fork has only a shadow.
    fn opened(&self) -> PyResult<Arc<Opened>> {
        if self.pid != std::process::id() && matches!(*self.opened, Opened::Gpu(_)) {
            return Err(Failed::new_err(
                "the GPU was opened by the parent process; open an Engine in each process, or start processes with 'spawn'",
            ));
        }
        Ok(self.opened.clone())
    }
}

/// Opens an engine that follows beams in the place of this word, or in its own where none is given.
fn open(device: &str, precision: Precision, trace: Option<&str>) -> Result<Opened> {
    Ok(open_for(device, precision, trace, Purpose::General)?.0)
}

/// [`open`] for work of this purpose, with the rule by which "auto" chose where there was a choice.
fn open_for(
    device: &str,
    precision: Precision,
    trace: Option<&str>,
    purpose: Purpose,
) -> Result<(Opened, Rule)> {
    let place = trace.map(Tracing::parse).transpose()?;
    let (engine, rule) = Opened::open_for(device, precision, purpose)?;
    let engine = match place {
        Some(place) => engine.with_tracing(place)?,
        None => engine,
    };
    Ok((engine, rule))
}

/// The engine that arguments mean: an Engine, or a device by name with the place where it follows beams, which is opened once in a
/// process. An Engine has its place already.
pub fn resolve(
    py: Python<'_>,
    argument: Option<&Bound<'_, PyAny>>,
    trace: Option<&str>,
) -> PyResult<Arc<Opened>> {
    Ok(resolve_for(py, argument, trace, Purpose::General)?.0)
}

/// [`resolve`] for frames of scenes, for which "auto" has a rule of its own.
pub fn resolve_for_frames(
    py: Python<'_>,
    argument: Option<&Bound<'_, PyAny>>,
    trace: Option<&str>,
) -> PyResult<Arc<Opened>> {
    let purpose = if trace == Some("device") { Purpose::General } else { Purpose::Frames };
    Ok(resolve_for(py, argument, trace, purpose)?.0)
}

/// Whether the purpose decides which engine an argument means.
pub fn has_choice(argument: Option<&Bound<'_, PyAny>>) -> bool {
    let device = argument.map_or(Ok("auto".to_string()), |a| a.extract::<String>());
    device.is_ok_and(|device| Opened::has_choice(&device, Precision::F32))
}

/// [`resolve`] for work of this purpose, with the rule by which "auto" chose; None where there was no choice.
pub fn resolve_for(
    py: Python<'_>,
    argument: Option<&Bound<'_, PyAny>>,
    trace: Option<&str>,
    purpose: Purpose,
) -> PyResult<Chosen> {
    type Known = HashMap<(u32, String, Option<String>, Purpose), Chosen>;
    static KNOWN: Mutex<Option<Known>> = Mutex::new(None);
    let device = match argument {
        None => "auto".to_string(),
        Some(a) => match a.cast::<Engine>() {
            Ok(engine) => {
                let opened = engine.get().opened()?;
                if let Some(word) = trace
                    && word != opened.tracing().word()
                {
                    let e = BadInput::new("this Engine traces elsewhere").key("trace").value(word);
                    let e = e.allowed(opened.tracing().word());
                    return refuse(py, e.remedy("give trace to Engine(...)"));
                }
                return Ok((opened, None));
            }
            Err(_) => a.extract::<String>().map_err(|_| {
                pyo3::exceptions::PyTypeError::new_err("engine is neither an Engine nor the name of a device")
            })?,
        },
    };
    let place = trace.map(String::from);
    let key = (std::process::id(), device.clone(), place.clone(), purpose);
    let known = |f: &mut dyn FnMut(&mut Known) -> Option<Chosen>| {
        f(KNOWN.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert_default())
    };
    if let Some(engine) = known(&mut |k| k.get(&key).cloned()) {
        return Ok(engine);
    }
    let (engine, rule) =
        work::run(py, None, move |_| open_for(&device, Precision::F32, place.as_deref(), purpose))?;
    let opened = (Arc::new(engine), rule);
    known(&mut |k| k.insert(key.clone(), opened.clone()));
    Ok(opened)
}
