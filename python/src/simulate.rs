//! Scenarios and their frames.

use crate::arrays::{Records, array, dictionary, plain_of_json};
use crate::errors::{OrRaise, refuse};
use crate::radar::Radar;
use crate::scene::Scene;
use crate::{drawn, engine, work};
use catseye::base::error::{BadInput, Error};
use catseye::detect::{Point, columns};
use catseye::dsp::RangeDoppler;
use catseye::engine::{AnyCube, Engine};
use catseye::road::labels::RoadTruth;
use catseye::road::site::Site;
use catseye::scene::radar::Radar as Described;
use catseye::scene::scenario;
use catseye::simulate::{Frame as Made, Prepared, remarks};
use catseye::trace::Echoes;
use catseye_io::files::Truth;
use catseye_io::kept_run::KeptRun;
use catseye_io::manifest::Axes;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

/// A scenario: objects, the vehicle's motion, radars and frames. `Scenario(path)` reads a TOML file, `Scenario.parse` reads text.
///
/// Raises BadInput with the line of the file that is not valid.
#[pyclass(module = "catseye", frozen)]
pub struct Scenario {
    scenario: Arc<scenario::Scenario>,
}

#[pymethods]
impl Scenario {
    #[new]
    fn new(py: Python<'_>, path: PathBuf) -> PyResult<Scenario> {
        let scenario = py.detach(|| scenario::Scenario::load(&path)).or_raise(py)?;
        Ok(Scenario { scenario: Arc::new(scenario) })
    }

    /// Reads a scenario from TOML text. folder: where files that the text names are looked for.
    #[staticmethod]
    #[pyo3(signature = (text, *, folder = PathBuf::new()))]
    fn parse(py: Python<'_>, text: &str, folder: PathBuf) -> PyResult<Scenario> {
        let scenario = py.detach(|| scenario::parse(&folder.join("scenario.toml"), text)).or_raise(py)?;
        Ok(Scenario { scenario: Arc::new(scenario) })
    }

    #[getter]
    fn name(&self) -> &str {
        &self.scenario.name
    }

    #[getter]
    fn seed(&self) -> u64 {
        self.scenario.seed
    }

    /// Number of frames.
    #[getter]
    fn frames(&self) -> u32 {
        self.scenario.frames.count
    }

    /// Time in s from the middle of a frame to the middle of the next.
    #[getter]
    fn interval_s(&self) -> f64 {
        self.scenario.frames.interval_s
    }

    #[getter]
    fn radars(&self) -> Vec<Radar> {
        self.scenario.radars.iter().map(|r| Radar { radar: Arc::new(r.clone()) }).collect()
    }

    /// Returns the scene with all its points and objects.
    fn scene(&self, py: Python<'_>) -> PyResult<Scene> {
        let (scenario, name) = (self.scenario.clone(), self.scenario.name.clone());
        let site = work::run(py, None, move |_| Site::new(&scenario))?;
        let truth = site.road.map(Arc::new);
        Ok(Scene { name, contents: Arc::new(site.scene), truth, boresight_deg: (0.0, 0.0) })
    }

    fn __repr__(&self) -> String {
        let s = &self.scenario;
        let radars: Vec<&str> = s.radars.iter().map(|r| r.name.as_str()).collect();
        format!("<catseye.Scenario {}: {} frames, radar {}>", s.name, s.frames.count, radars.join(", "))
    }
}

/// An iterator of Frame; each frame is computed when it is requested.
#[pyclass(module = "catseye")]
pub struct Frames {
    engine: Arc<Engine>,
    scenario: Arc<scenario::SitedScenario>,
    scene: Arc<catseye::scene::Scene>,
    labels: Option<Arc<RoadTruth>>,
    /// The labels of the road as Python objects.
    road: Option<Py<PyAny>>,
    /// (frame, radar).
    wanted: Vec<(u32, usize)>,
    next: usize,
    /// Where echoes come from that are not traced.
    kept: Option<Arc<KeptRun>>,
    /// The scene with what its frames share, made with the first of them.
    prepared: Arc<OnceLock<Prepared<'static>>>,
    /// Warnings about meshes of the scene that may affect the frames, one text each; each was also reported with `warnings.warn`.
    #[pyo3(get)]
    remarks: Vec<String>,
}

#[pymethods]
impl Frames {
    fn __iter__(slf: PyRef<'_, Self>) -> PyRef<'_, Self> {
        slf
    }

    /// Number of frames that remain.
    fn __len__(&self) -> usize {
        self.wanted.len() - self.next
    }

    fn __next__(slf: &Bound<'_, Self>) -> PyResult<Option<Frame>> {
        let py = slf.py();
        let (engine, scenario, scene, labels, (index, which), road) = {
            let this = slf.try_borrow()?;
            let Some(wanted) = this.wanted.get(this.next) else { return Ok(None) };
            let road = this.road.as_ref().map(|r| r.clone_ref(py));
            (
                this.engine.clone(),
                this.scenario.clone(),
                this.scene.clone(),
                this.labels.clone(),
                *wanted,
                road,
            )
        };
        let (kept, prepared) = {
            let this = slf.try_borrow()?;
            (this.kept.clone(), this.prepared.clone())
        };
        let radar = scenario.radars[which].clone();
        let (made, truth) = work::run(py, None, move |watch| {
            let prepared = match prepared.get() {
                Some(known) => known,
                None => {
                    let new = Prepared::shared(&scenario, &scene)?;
                    let new = match kept {
                        None => new,
                        Some(kept) => {
                            let scenario = scenario.clone();
                            new.recalling(Box::new(move |which, index| {
                                kept.trace(&scenario, &scenario.radars[which].name, index)
                            }))
                        }
                    };
                    prepared.get_or_init(|| new)
                }
            };
            let frame = prepared.frame(&engine, which, index, watch.control())?;
            let truth = Truth::new(&scenario, &scene, &frame, labels.as_deref());
            let truth = serde_json::to_string(&truth).map_err(|e| Error::Failed(format!("truth: {e}")))?;
            Ok((frame, truth))
        })?;
        let frame = Frame::of(py, made, radar, truth, road)?;
        // A frame that failed or was interrupted is tried again.
        slf.try_borrow_mut()?.next += 1;
        Ok(Some(frame))
    }

    fn __repr__(&self) -> String {
        format!("<catseye.Frames of {}: {} to come>", self.scenario.name, self.__len__())
    }
}

/// One frame of one radar.
#[pyclass(module = "catseye", frozen)]
pub struct Frame {
    #[pyo3(get)]
    index: u32,
    /// Name of the radar.
    #[pyo3(get)]
    radar: String,
    /// Time of the middle of the frame in s, from the middle of frame 0.
    #[pyo3(get)]
    time_s: f64,
    /// Position of the radar in the world in m, float64 [3].
    #[pyo3(get)]
    position_m: Py<PyAny>,
    /// Rotation from the radar to the world, quaternion x, y, z, w, float64 [4].
    #[pyo3(get)]
    rotation_xyzw: Py<PyAny>,
    /// Velocity of the radar in the world in m/s, float64 [3].
    #[pyo3(get)]
    velocity_mps: Py<PyAny>,
    /// Samples in sqrt(W) at the receiver's input, complex64 [chirp, rx_virtual, sample] (complex128 with an f64 engine).
    #[pyo3(get)]
    adc: Py<PyAny>,
    /// Range-Doppler map of the first ramp, float32 [doppler, range] (float64 with an f64 engine): power in W, zero Doppler in the middle row.
    #[pyo3(get)]
    range_doppler: Py<PyAny>,
    /// Maps of all ramps, the first of which is `range_doppler`.
    #[pyo3(get)]
    maps: Vec<Py<PyAny>>,
    /// Ranges of the columns of the map in m, float64 [range].
    #[pyo3(get)]
    range_m: Py<PyAny>,
    /// Range rates of the rows of the map in m/s, float64 [doppler], positive receding.
    #[pyo3(get)]
    range_rate_mps: Py<PyAny>,
    /// Points, a structured array [point] with the columns of points.csv, in the sensor frame, strongest first.
    #[pyo3(get)]
    points: Py<PyAny>,
    #[pyo3(get)]
    triangles: usize,
    /// Computing time of each stage in s.
    #[pyo3(get)]
    seconds: Py<PyAny>,
    echoes: Echoes,
    described: Described,
    truth: String,
    road: Option<Py<PyAny>>,
}

#[pymethods]
impl Frame {
    /// Echoes, a structured array [echo]: range_m, range_rate_mps, azimuth_deg, elevation_deg (of arrival), power_dbm (of this echo alone, mean over
    /// channels), chain [8] (ids of the objects met in order, then zeros), bounces, path_length_m, spread [2, 2] (path gain S/(R_t R_r) in 1/m,
    /// complex128 [rx, tx], 0 vertical).
    #[getter]
    fn returns<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let received = columns::received(&self.described, &self.echoes);
        let all = &self.echoes.list;
        Records::new(received.len())
            .columns(py, &columns::echoes(), &received)?
            .numbers(py, "path_length_m", all.iter().map(|r| r.path_length_m).collect(), "f8")
            .vectors(py, "spread", all.iter().flat_map(|r| r.path_gain.concat()).collect(), "c16", &[2, 2])
            .build(py)
    }

    /// Truth of the frame, a dictionary as in truth.json: frame, time_s, ego, radar, boxes, lanes, markers; road: the labels of a scene that has
    /// them.
    #[getter]
    fn truth(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let truth = plain_of_json(py, &self.truth)?;
        if let Some(road) = &self.road {
            truth.bind(py).set_item("road", road)?;
        }
        Ok(truth)
    }

    /// Draws the frame with matplotlib; returns the Axes.
    ///
    /// kind: "range_doppler", the map in dBm with the points, or "birds_eye", the points in the radar's frame (x forward, y left, m), coloured by
    /// range rate, over the boxes of the objects. points: draw the points. ax: Axes to draw into. Raises ImportError without matplotlib.
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

    fn __repr__(&self) -> String {
        format!("<catseye.Frame {} of {} at {} s>", self.index, self.radar, self.time_s)
    }
}

impl Frame {
    fn of(
        py: Python<'_>,
        made: Made,
        radar: Described,
        truth: String,
        road: Option<Py<PyAny>>,
    ) -> PyResult<Frame> {
        let mut made = made;
        let cube = made.take_samples().or_raise(py)?;
        let wide = matches!(cube, AnyCube::F64(_));
        let maps = maps(py, made.maps, wide)?;
        let [range_m, range_rate_mps] = axes(py, &radar)?;
        let s = &made.stages;
        let stages = [
            ("geometry", s.geometry_s),
            ("trace", s.trace_s),
            ("synthesis", s.synthesis_s),
            ("processing", s.processing_s),
            ("angles", s.angles_s),
        ];
        let stages = stages.map(|(k, v)| Ok((k, v.into_pyobject(py)?.into_any().unbind())));
        let stages = stages.into_iter().collect::<PyResult<Vec<_>>>()?;
        Ok(Frame {
            index: made.index,
            radar: radar.name.clone(),
            time_s: made.time_s,
            position_m: array(py, made.pose.translation_m.to_array().to_vec(), &[3])?,
            rotation_xyzw: array(py, made.pose.rotation.to_array().to_vec(), &[4])?,
            velocity_mps: array(py, made.velocity_mps.to_array().to_vec(), &[3])?,
            adc: match cube {
                AnyCube::F32(c) => array(py, c.data, &[c.chirps, c.channels, c.samples])?,
                AnyCube::F64(c) => array(py, c.data, &[c.chirps, c.channels, c.samples])?,
            },
            range_doppler: maps[0].clone_ref(py),
            maps,
            range_m,
            range_rate_mps,
            points: points(py, &made.points)?,
            triangles: made.triangles,
            seconds: dictionary(py, &stages)?.into_any().unbind(),
            echoes: made.echoes,
            described: radar,
            truth,
            road,
        })
    }
}

/// Keywords of the plots of frames.
pub fn plot_keywords<'py>(
    py: Python<'py>,
    kind: &str,
    points: bool,
    ax: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let keywords = PyDict::new(py);
    keywords.set_item("kind", kind)?;
    keywords.set_item("points", points)?;
    keywords.set_item("ax", ax)?;
    Ok(keywords)
}

/// Power maps [doppler, range]; what an f32 engine made is f32 again, exactly.
pub fn maps(py: Python<'_>, maps: Vec<RangeDoppler<f64>>, wide: bool) -> PyResult<Vec<Py<PyAny>>> {
    maps.into_iter()
        .map(|m| {
            let shape = [m.map.doppler_bins, m.map.range_bins];
            match wide {
                true => array(py, m.map.data, &shape),
                false => array(py, m.map.data.iter().map(|p| *p as f32).collect(), &shape),
            }
        })
        .collect()
}

/// [range_m, range_rate_mps] of the maps.
pub fn axes(py: Python<'_>, radar: &Described) -> PyResult<[Py<PyAny>; 2]> {
    let axes = Axes::of(radar);
    Ok([
        array(py, axes.range_m.values(), &[axes.range_m.count])?,
        array(py, axes.range_rate_mps.values(), &[axes.range_rate_mps.count])?,
    ])
}

/// Points with the columns of points.csv; NaN for an angle that the array cannot measure.
pub fn points(py: Python<'_>, list: &[Point]) -> PyResult<Py<PyAny>> {
    Ok(Records::new(list.len()).columns(py, &columns::POINTS, list)?.build(py)?.unbind())
}

/// Simulates the frames of a scenario and returns them as Frames, an iterator that computes each frame when it is requested. The same scenario, seed,
/// engine and index give the same frame, whatever was computed before.
///
/// scenario: a Scenario or the path of one. frames: number of frames, or a sequence of frame indices; default: those of the scenario. seed: replaces
/// the scenario's seed. radar: name of one radar of several; default: all, one Frame per radar. scene: a Scene that replaces the scenario's scene.
/// engine: an Engine or the name of a device. trace: "host" or "device", where beams are traced, as for Engine. source: folder of a run of the same
/// scene and drive that stored its echoes (`[output] echoes = true`): the scenario's radar, waveform, array and front end receive these echoes and no
/// beams are traced, as with `catseye simulate --from`.
///
/// Ctrl-C stops the current frame; the iterator can continue with the same frame.
#[pyfunction]
#[pyo3(signature = (scenario, *, frames = None, seed = None, radar = None, scene = None, engine = None, trace = None, source = None))]
#[allow(clippy::too_many_arguments)] // keywords
pub fn simulate(
    py: Python<'_>,
    scenario: &Bound<'_, PyAny>,
    frames: Option<&Bound<'_, PyAny>>,
    seed: Option<u64>,
    radar: Option<&str>,
    scene: Option<&Bound<'_, Scene>>,
    engine: Option<&Bound<'_, PyAny>>,
    trace: Option<&str>,
    source: Option<PathBuf>,
) -> PyResult<Frames> {
    let mut scenario = match scenario.cast::<Scenario>() {
        Ok(s) => s.get().scenario.clone(),
        Err(_) => Scenario::new(py, scenario.extract()?)?.scenario,
    };
    if let Some(seed) = seed {
        Arc::make_mut(&mut scenario).seed = seed;
    }
    let indices: Vec<u32> = match frames {
        None => (0..scenario.frames.count).collect(),
        Some(f) => match f.extract::<u32>() {
            Ok(0) => {
                let e =
                    BadInput::new("a run has at least one frame").key("frames").value(0).allowed("1 or more");
                return refuse(py, e);
            }
            Ok(n) => (0..n).collect(),
            Err(_) => f.try_iter()?.map(|i| i?.extract()).collect::<PyResult<Vec<u32>>>()?,
        },
    };
    let names = || scenario.radars.iter().map(|r| r.name.as_str());
    let which: Vec<usize> = match radar {
        None => (0..scenario.radars.len()).collect(),
        Some(name) => match names().position(|n| n == name) {
            Some(i) => vec![i],
            None => {
                let allowed = names().collect::<Vec<_>>().join(", ");
                let e =
                    BadInput::new("the scenario has no such radar").key("radar").value(name).allowed(allowed);
                return refuse(py, e);
            }
        },
    };
    let engine = engine::resolve_for_frames(py, engine, trace)?;
    let (scenario, scene, labels) = match scene {
        Some(s) => {
            let Ok(scenario) = scenario::Scenario::clone(&scenario).without_roads() else {
                let e = BadInput::new("the ego vehicle follows the scenario's own road");
                return refuse(
                    py,
                    e.key("scene").remedy("leave out scene, or give ego a position and a speed"),
                );
            };
            let s = s.try_borrow()?;
            (Arc::new(scenario), s.contents.clone(), s.truth.clone())
        }
        None => {
            let site = work::run(py, None, move |_| Site::new(&scenario))?;
            (Arc::new(site.scenario), Arc::new(site.scene), site.road.map(Arc::new))
        }
    };
    let kept = match source {
        None => None,
        Some(folder) => {
            // The number of requested frames, which may be smaller than the scenario's.
            let mut asked = scenario::SitedScenario::clone(&scenario);
            asked.frames.count = indices.iter().max().map_or(0, |last| last + 1);
            let open = move |_: &work::Watch| {
                let kept = KeptRun::open(&folder)?;
                kept.check(&asked)?;
                Ok(kept)
            };
            Some(Arc::new(work::run(py, None, open)?))
        }
    };
    let remarks = {
        let (scenario, scene) = (scenario.clone(), scene.clone());
        let first = which.first().copied().unwrap_or(0);
        work::run(py, None, move |_| remarks(&scenario, &scene, first))?
    };
    let warn = py.import("warnings")?.getattr("warn")?;
    for line in &remarks {
        warn.call1((line,))?;
    }
    let road = labels.as_deref().map(|t| crate::arrays::plain(py, t)).transpose()?;
    let wanted = indices.into_iter().flat_map(|i| which.iter().map(move |w| (i, *w))).collect();
    Ok(Frames {
        engine,
        scenario,
        scene,
        labels,
        road,
        wanted,
        next: 0,
        kept,
        prepared: Arc::default(),
        remarks,
    })
}
