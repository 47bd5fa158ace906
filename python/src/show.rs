//! What notebooks and browsers are shown: pictures as PNG, and pages of `catseye view`.

use crate::arrays::plain;
use crate::errors::{OrRaise, refuse};
use crate::rcs::{RcsResult, rcs_plot};
use crate::scene::Scene;
use crate::work::{Afterwards, run_to};
use catseye::base::error::BadInput;
use catseye::formats::stage;
use catseye::road::truth_boxes;
use catseye::scene::gltf::ImportOptions;
use catseye::scene::{Scene as Contents, Shape};
use catseye_cli::outlines;
use catseye_plot::{BirdsEye, Picture, RangeDoppler, SolidView, birds_eye, range_doppler, solid_picture};
use catseye_view::{Page, RcsTable};
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyList, PyTuple};
use std::cell::Cell;
use std::path::{Path, PathBuf};
use std::sync::Arc;

fn png(py: Python<'_>, draw: impl FnOnce() -> catseye::Result<Picture> + Send) -> PyResult<Py<PyBytes>> {
    let bytes = py.detach(|| draw()?.png()).or_raise(py)?;
    Ok(PyBytes::new(py, &bytes).unbind())
}

/// Returns a PNG of a range-Doppler map. power_w: float32, the rows [doppler, range] one after another; range_m, range_rate_mps: the axes;
/// detections: (range, range rate) of each point.
///
/// Raises BadInput where the axes do not match the map.
#[pyfunction]
#[pyo3(signature = (title, power_w, range_m, range_rate_mps, detections))]
pub fn picture_map(
    py: Python<'_>,
    title: String,
    power_w: PyReadonlyArray1<'_, f32>,
    range_m: Vec<f64>,
    range_rate_mps: Vec<f64>,
    detections: Vec<[f64; 2]>,
) -> PyResult<Py<PyBytes>> {
    let power_w = power_w.as_slice()?.to_vec();
    png(py, move || {
        range_doppler(&RangeDoppler {
            title: &title,
            power_w: &power_w,
            range_m: &range_m,
            range_rate_mps: &range_rate_mps,
            detections: &detections,
            unmarked: &[],
        })
    })
}

/// Returns a PNG of a table of cross sections, as `catseye rcs --plot` draws it.
///
/// Raises BadInput for a table of only one direction, which has no curve.
#[pyfunction]
pub fn picture_rcs(py: Python<'_>, result: &Bound<'_, RcsResult>) -> PyResult<Py<PyBytes>> {
    let result = result.get();
    let rows = result.rows(py)?;
    let title = result.target.clone();
    png(py, move || rcs_plot(&title, &rows, &[]))
}

/// Returns a PNG of a scene: its single body with its dimensions, or all objects from above at time 0.
///
/// Raises BadInput for an empty scene.
#[pyfunction]
pub fn picture_scene(py: Python<'_>, scene: &Bound<'_, Scene>) -> PyResult<Py<PyBytes>> {
    let (title, contents) = {
        let this = scene.try_borrow()?;
        (this.name.clone(), this.contents.clone())
    };
    if contents.objects.is_empty() {
        return refuse(py, BadInput::new("the scene is empty").key("scene").remedy("add an object to it"));
    }
    png(py, move || match contents.objects[..] {
        [ref only] if let Shape::Mesh(m) = only.shape => {
            // A reflector's name lists every parameter, which is more than a title holds.
            let kind = title.split(':').next().unwrap_or_default();
            solid_picture(&SolidView::new(kind, &[], &contents.meshes[m]))
        }
        _ => birds_eye(&BirdsEye {
            title: &title,
            objects: &outlines(&contents, &truth_boxes(&contents, 0.0), 0.0),
            ..BirdsEye::default()
        }),
    })
}

/// What a page is made of, taken out of the interpreter's hands.
enum Shown {
    Scene(String, Arc<Contents>),
    /// Results, beside their target where it is given.
    Tables(Option<Arc<Contents>>, Vec<RcsTable>),
    Paths(Vec<PathBuf>),
}

impl Shown {
    fn of(thing: &Bound<'_, PyAny>) -> PyResult<Shown> {
        let py = thing.py();
        if let Ok(scene) = thing.cast::<Scene>() {
            let scene = scene.try_borrow()?;
            let name = if scene.name.is_empty() { "scene" } else { &scene.name };
            return Ok(Shown::Scene(name.into(), scene.contents.clone()));
        }
        let things: Vec<Bound<'_, PyAny>> = match thing.cast::<PyList>() {
            Ok(list) => list.iter().collect(),
            Err(_) => match thing.cast::<PyTuple>() {
                Ok(list) => list.iter().collect(),
                Err(_) => vec![thing.clone()],
            },
        };
        if things.is_empty() {
            let e = BadInput::new("there is nothing to show").key("thing");
            return refuse(py, e.allowed("a path, a Scene, an RcsResult, or several paths or RcsResults"));
        }
        let table = |t: &Bound<'_, PyAny>| -> PyResult<RcsTable> {
            let result = t.cast::<RcsResult>()?.get();
            let comments = vec![
                format!("target: {}", result.target),
                format!("convention: {}", result.convention),
                format!("catseye {}", env!("CARGO_PKG_VERSION")),
            ];
            Ok(RcsTable { name: result.target.clone(), comments, rows: result.rows(py)? })
        };
        let (target, results) = match &things[..] {
            [first, rest @ ..] if !rest.is_empty() && first.cast::<Scene>().is_ok() => {
                (Some(first.cast::<Scene>()?.try_borrow()?.contents.clone()), rest)
            }
            all => (None, all),
        };
        if results.iter().all(|t| t.cast::<RcsResult>().is_ok()) {
            return Ok(Shown::Tables(target, results.iter().map(table).collect::<PyResult<_>>()?));
        }
        let path = |t: &Bound<'_, PyAny>| {
            t.extract::<PathBuf>().map_err(|_| {
                pyo3::exceptions::PyTypeError::new_err(
                    "expected a path, a Scene, an RcsResult, several paths, or several RcsResults after their Scene or without it",
                )
            })
        };
        Ok(Shown::Paths(things.iter().map(path).collect::<PyResult<_>>()?))
    }

    fn page(&self) -> catseye::Result<Page> {
        match self {
            Shown::Scene(name, contents) => Page::of_scene(name, contents),
            Shown::Tables(target, tables) => Page::of_rcs(tables, target.as_deref()),
            Shown::Paths(paths) => Page::of(paths, &ImportOptions::default(), &|_| ()),
        }
    }

    fn inputs(&self) -> Vec<&Path> {
        match self {
            Shown::Paths(paths) => paths.iter().map(PathBuf::as_path).collect(),
            _ => Vec::new(),
        }
    }
}

/// Writes a page as `catseye view` does and returns {"page", "bytes", "frames", "beside"}: the file, its size, the number of frames, and the folder
/// of the frames that do not fit into the file (else None).
///
/// thing: a path, a Scene, an RcsResult, or several paths or RcsResults. progress: called with the number of frames done and the total.
#[pyfunction]
#[pyo3(signature = (thing, output, force = false, progress = None))]
pub fn write_page(
    thing: &Bound<'_, PyAny>,
    output: PathBuf,
    force: bool,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Py<PyAny>> {
    let py = thing.py();
    let shown = Shown::of(thing)?;
    let written = run_to(py, progress, Afterwards::Awaited, move |watch| {
        catseye::formats::check_extension(&output, &["html"])?;
        stage::distinct(&[&output], &shown.inputs())?;
        let page = shown.page()?;
        watch.expect(page.frames() as u64);
        let before = Cell::new(0);
        page.write(&output, force, catseye_view::INLINE_BYTES, &|done| {
            let new = done.saturating_sub(before.replace(done));
            watch.step(new as u64);
        })
    })?;
    plain(py, &written)
}
