//! Datasets: made from recipes, checked, read.

use crate::arrays::{Records, array, plain};
use crate::errors::{OrRaise, refuse};
use crate::radar::Radar;
use crate::work::{Afterwards, run_to};
use crate::{engine, work};
use catseye::base::error::BadInput;
use catseye::formats::stage::distinct;
use catseye_cli::draw_frame;
use catseye_io::dataset::{DATASET, DatasetFile};
use catseye_io::kept_dataset::KeptDataset;
use catseye_io::kept_radar::{KeptRadar, RadarsOfScenes, check_same};
use catseye_io::produce::{self, produce};
use catseye_io::recipe::{Recipe, SPLITS};
use catseye_io::store::{Array, Column, Data, DatasetLayout, Table};
use catseye_io::verify as checks;
use numpy::IntoPyArray;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// Makes a dataset from a recipe, or the missing shards of one. The bytes are those of `catseye dataset`, whatever the number of workers and
/// interruptions.
///
/// recipe: path of a recipe TOML. out: output folder. shards: (first, end) of the shards to make, default all; the others are left to other runs.
/// jobs: number of workers, each with its share of the cores (default: one per core, on a GPU one). batch: number of frames that a GPU computes at
/// once, as far as memory allows (default 64); the bytes do not depend on it, and the CPU computes one at a time. seed: replaces the recipe's seed.
/// trace: "host" or "device", where beams are traced, as for Engine. mixed_devices: continue a dataset that another device began. source: folder of a
/// dataset whose recipe drew the same scenes and stored its echoes (keep.echoes = true): no beams are traced, and this recipe's radar receives the
/// stored echoes, as with `catseye dataset --from`. force: start over in a folder that holds another dataset. progress: called with the number of
/// frames done and the total.
///
/// Returns a dictionary: folder, frames, shards, shards_complete, shards_resumed, shards_repaired, frames_made, complete, tally, bytes. Raises
/// BadInput for a folder of another recipe or device. Ctrl-C stops after the frames in progress; the same call resumes.
#[pyfunction]
#[pyo3(signature = (recipe, out, *, shards = None, jobs = None, batch = None, seed = None, engine = None, trace = None, mixed_devices = false, source = None,
    force = false, progress = None))]
#[allow(clippy::too_many_arguments)] // keywords
pub fn dataset(
    py: Python<'_>,
    recipe: PathBuf,
    out: PathBuf,
    shards: Option<(u64, u64)>,
    jobs: Option<usize>,
    batch: Option<usize>,
    seed: Option<u64>,
    engine: Option<&Bound<'_, PyAny>>,
    trace: Option<&str>,
    mixed_devices: bool,
    source: Option<PathBuf>,
    force: bool,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Py<PyAny>> {
    if jobs == Some(0) {
        return refuse(
            py,
            BadInput::new("at least one worker is needed").key("jobs").value(0).allowed("1 or more"),
        );
    }
    if batch == Some(0) {
        return refuse(
            py,
            BadInput::new("a batch needs at least one frame").key("batch").value(0).allowed("1 or more"),
        );
    }
    let kept = |recipe: Recipe| match &source {
        Some(source) => {
            distinct(&[&out], &[source])?;
            KeptDataset::open(source)?.serving(recipe)
        }
        None => Ok(recipe),
    };
    let recipe = py.detach(|| kept(Recipe::load(&recipe, seed)?)).or_raise(py)?;
    let engine = engine::resolve_for_frames(py, engine, trace)?;
    let report = run_to(py, progress, Afterwards::Awaited, move |watch| {
        let options = produce::Options {
            jobs,
            batch,
            shards: shards.map(|(a, b)| a..b),
            mixed_devices,
            force,
            cancel: watch.cancelled(),
            progress: &|p| {
                if p.phase == produce::Phase::Frames {
                    watch.expect(p.all);
                    watch.set(p.done);
                }
            },
            pictures: &draw_frame,
            say: &|_| (),
            rule: None,
        };
        produce(&engine, &recipe, &out, &options)
    })?;
    plain(py, &report)
}

/// Returns the sizes of the dataset that a recipe makes: {"name", "seed", "scenes", "frames_per_scene", "frames", "frames_per_shard", "shards",
/// "format"}. seed: replaces the recipe's seed.
///
/// Raises BadInput for a recipe that is not valid.
#[pyfunction]
#[pyo3(signature = (path, *, seed = None))]
pub fn recipe_facts(py: Python<'_>, path: PathBuf, seed: Option<u64>) -> PyResult<Py<PyAny>> {
    let r = py.detach(|| Recipe::load(&path, seed)).or_raise(py)?;
    plain(
        py,
        &serde_json::json!({
            "name": r.name,
            "seed": r.seed,
            "scenes": r.scenes,
            "frames_per_scene": r.frames_per_scene,
            "frames": r.frames(),
            "frames_per_shard": r.frames_per_shard,
            "shards": r.frames().div_ceil(r.frames_per_shard),
            "format": r.format.name(),
        }),
    )
}

/// Checks that a dataset is complete and undamaged, as `catseye verify --json` does. Returns {"frames", "shards", "shards_complete", "files",
/// "bytes", "problems": [{"problem", "names", "remedy"}, ...]}; `problems` is empty for an undamaged dataset. progress: called with the number of
/// files read and the total.
#[pyfunction]
#[pyo3(signature = (folder, *, progress = None))]
pub fn verify(py: Python<'_>, folder: PathBuf, progress: Option<&Bound<'_, PyAny>>) -> PyResult<Py<PyAny>> {
    let found = work::run(py, progress, move |watch| {
        checks::verify(&folder, &|all| {
            watch.expect(all);
            watch.step(1);
        })
    })?;
    plain(py, &found)
}

/// Reads the files of a dataset. Programs use `Dataset`, which is built on it.
#[pyclass(module = "catseye._catseye", frozen)]
pub struct Store {
    folder: PathBuf,
    layout: Arc<DatasetLayout>,
    /// Content of dataset.json, once it was read.
    file: Mutex<Option<Arc<DatasetFile>>>,
    /// By shard, the radars of scenes that differ from those of dataset.json.
    radars: Mutex<HashMap<u64, Arc<RadarsOfScenes>>>,
}

impl Store {
    fn file(&self) -> catseye::Result<Arc<DatasetFile>> {
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(file) = &*file {
            return Ok(file.clone());
        }
        let read = Arc::new(DatasetFile::read(&self.folder)?);
        Ok(file.insert(read).clone())
    }

    /// The radar of this name in the scene of a frame.
    fn kept(&self, frame: u64, name: &str) -> catseye::Result<KeptRadar> {
        if frame >= self.layout.frames {
            let bad = BadInput::new("the dataset has no such frame").key("frame").value(frame);
            return Err(bad.allowed(format!("0 to {}", self.layout.frames.saturating_sub(1))).into());
        }
        let file = self.file()?;
        let Some(usual) = &file.radars else {
            let bad = BadInput::new("the dataset was made before datasets contained their radars");
            return Err(bad
                .file(&self.folder)
                .key("radar")
                .remedy("give radar=, the file of its recipe")
                .into());
        };
        let scene = (frame / u64::from(file.frames_per_scene.max(1))) as u32;
        let shard = self.layout.shard_of(frame);
        let mut known = self.radars.lock().unwrap_or_else(PoisonError::into_inner);
        let others = match known.get(&shard) {
            Some(others) => others.clone(),
            // Those of the first scene are in dataset.json, also where its shard is not made.
            None if scene == 0 => Arc::default(),
            None => {
                let read = Arc::new(DatasetFile::radars_of_shard(&self.folder, shard)?);
                known.entry(shard).or_insert(read).clone()
            }
        };
        let radars = others.get(&scene).unwrap_or(usual);
        // Of drawn radars each scene's may have a name of its own.
        let only = match (&usual[..], &radars[..]) {
            ([one], [other]) if one.name == name => Some(other),
            _ => None,
        };
        let found = only.or_else(|| radars.iter().find(|r| r.name == name)).ok_or_else(|| {
            let names: Vec<&str> = radars.iter().map(|r| r.name.as_str()).collect();
            let bad = BadInput::new("the dataset has no radar of this name").file(&self.folder);
            bad.key("radar").value(name).allowed(names.join(", "))
        })?;
        Ok(found.clone())
    }

    fn radar_of(&self, frame: u64, name: &str) -> catseye::Result<catseye::scene::radar::Radar> {
        self.kept(frame, name)?.radar(&self.folder.join(DATASET))
    }
}

/// An absolute path, so that it stays the same when the process works elsewhere.
fn absolute(folder: &Path) -> PathBuf {
    std::path::absolute(folder).unwrap_or_else(|_| folder.into())
}

#[pymethods]
impl Store {
    #[new]
    fn new(py: Python<'_>, folder: PathBuf) -> PyResult<Store> {
        let folder = absolute(&folder);
        let layout = Arc::new(py.detach(|| DatasetLayout::open(&folder)).or_raise(py)?);
        Ok(Store { folder, layout, file: Mutex::default(), radars: Mutex::default() })
    }

    fn __len__(&self) -> usize {
        self.layout.frames as usize
    }

    /// Layout of the dataset, a dictionary: format, compression, frames, frames_per_shard, arrays, tables, attributes.
    #[getter]
    fn layout(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        plain(py, &*self.layout)
    }

    /// Names of the radars that the dataset contains; None for a dataset made before datasets contained radars.
    fn radar_names(&self, py: Python<'_>) -> PyResult<Option<Vec<String>>> {
        let names = |file: Arc<DatasetFile>| {
            file.radars.as_ref().map(|all| all.iter().map(|r| r.name.clone()).collect())
        };
        py.detach(|| self.file().map(names)).or_raise(py)
    }

    /// Returns the radar of this name that recorded a frame's samples. Raises BadInput for a name that the dataset does not contain, for a frame
    /// whose shard is missing, and for a dataset that contains no radars.
    fn radar(&self, py: Python<'_>, frame: u64, name: &str) -> PyResult<Radar> {
        let radar = py.detach(|| self.radar_of(frame, name)).or_raise(py)?;
        Ok(Radar { radar: Arc::new(radar) })
    }

    /// Returns the TOML text of the radar of this name in a frame; equal texts describe equal radars.
    fn radar_text(&self, py: Python<'_>, frame: u64, name: &str) -> PyResult<String> {
        let kept = py.detach(|| self.kept(frame, name)).or_raise(py)?;
        Ok(kept.toml + kept.calibration.as_deref().unwrap_or_default())
    }

    /// Compares `radar` with the radar of this name that recorded a frame's samples. Raises BadInput with the key and both values where `radar` would
    /// compute other tensors: a different waveform, sampling, antenna position or order, window or transform length.
    fn check_radar(&self, py: Python<'_>, frame: u64, name: &str, radar: &Radar) -> PyResult<()> {
        let given = radar.radar.clone();
        py.detach(|| check_same(&self.radar_of(frame, name)?, &given)).or_raise(py)
    }

    /// Returns the frame numbers of each split, {"train", "validation", "test"}: int64 arrays. Raises BadInput where dataset.json is missing.
    fn splits<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let read = || -> catseye::Result<[Vec<i64>; 3]> {
            let file = self.file()?;
            let recipe = file.recipe(&self.folder)?;
            let mut frames: [Vec<i64>; 3] = Default::default();
            for scene in 0..recipe.scenes {
                let which = SPLITS.iter().position(|s| *s == recipe.split(scene)).unwrap_or(0);
                let first = i64::from(scene) * i64::from(recipe.frames_per_scene);
                frames[which].extend(first..first + i64::from(recipe.frames_per_scene));
            }
            Ok(frames)
        };
        let all = py.detach(read).or_raise(py)?;
        let splits = PyDict::new(py);
        for (name, frames) in SPLITS.iter().zip(all) {
            splits.set_item(name, frames.into_pyarray(py))?;
        }
        Ok(splits)
    }

    /// Reads one frame and returns {"frame": int, name: array, ...}: arrays in the shape of the layout, tables as structured arrays. arrays, tables:
    /// names of those to read, default all.
    #[pyo3(signature = (frame, *, arrays = None, tables = None))]
    fn read<'py>(
        &self,
        py: Python<'py>,
        frame: u64,
        arrays: Option<Vec<String>>,
        tables: Option<Vec<String>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (folder, layout) = (self.folder.clone(), self.layout.clone());
        let found = work::run(py, None, move |_| {
            let arrays = arrays.unwrap_or_else(|| layout.arrays.iter().map(|a| a.name.clone()).collect());
            let tables = tables.unwrap_or_else(|| layout.tables.iter().map(|t| t.name.clone()).collect());
            let arrays = arrays.iter().map(|a| layout.read_array(&folder, a, frame));
            let arrays = arrays.collect::<catseye::Result<Vec<Array>>>()?;
            let tables = tables.iter().map(|t| layout.read_table(&folder, t, frame));
            Ok((arrays, tables.collect::<catseye::Result<Vec<Table>>>()?))
        })?;
        let all = PyDict::new(py);
        all.set_item("frame", frame)?;
        for a in found.0 {
            let data = match a.data {
                Data::C32(v) => array(py, v, &a.shape),
                Data::F32(v) => array(py, v, &a.shape),
                Data::U8(v) => array(py, v, &a.shape),
                Data::I32(v) => array(py, v, &a.shape),
            };
            all.set_item(a.name, data?)?;
        }
        for t in found.1 {
            all.set_item(t.name.clone(), rows(py, t)?)?;
        }
        Ok(all)
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> (Bound<'py, PyAny>, (PathBuf,)) {
        (py.get_type::<Store>().into_any(), (self.folder.clone(),))
    }
}

/// A structured array [row]; text as Python strings.
fn rows(py: Python<'_>, table: Table) -> PyResult<Bound<'_, PyAny>> {
    let mut records = Records::new(table.rows());
    for (name, column) in table.columns {
        records = match column {
            Column::I64(v) => records.numbers(py, &name, v, "i8"),
            Column::U32(v) => records.numbers(py, &name, v, "u4"),
            Column::F64(v) => records.numbers(py, &name, v, "f8"),
            Column::F32(v) => records.numbers(py, &name, v, "f4"),
            Column::Bool(v) => records.numbers(py, &name, v, "?"),
            Column::Text(v) => records.text(py, &name, v.iter().map(String::as_str).collect(), "O")?,
        };
    }
    records.build(py)
}
