//! Scenes: from files, from road descriptions, from reflectors, and put together.

use crate::arrays::{angles, array, dictionary, plain, rows_of_three, vector};
use crate::errors::{OrRaise, refuse};
use crate::{drawn, work};
use catseye::base::error::BadInput;
use catseye::base::frames::Pose;
use catseye::base::units::DEFAULT_FREQUENCY_HZ;
use catseye::formats::{check_extension, stage};
use catseye::geom::remarks::of_targets;
use catseye::geom::validate::check_scene;
use catseye::road::labels::RoadTruth;
use catseye::road::reflector::Reflector;
use catseye::road::{build, glb, reflector as library, scene_toml, target, truth_boxes};
use catseye::scene::gltf::{self, ImportOptions};
use catseye::scene::mesh_file::{MeshArrays, from_arrays};
use catseye::scene::scenario::{Label, Placement};
use catseye::scene::tidy::check_smooth_deg;
use catseye::scene::{Scene as Contents, Shape, material, mesh_file};
use numpy::IntoPyArray;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

/// A scene: all objects that can return an echo, meshes with radar materials and point targets, in metres and in ISO 8855 axes (x forward, y left, z
/// up). `Scene()` is empty; `Scene.load`, `reflector` and `road_scene` return a filled scene.
#[pyclass(module = "catseye")]
#[derive(Clone)]
pub struct Scene {
    pub name: String,
    pub contents: Arc<Contents>,
    pub truth: Option<Arc<RoadTruth>>,
    /// (azimuth, elevation).
    pub boresight_deg: (f64, f64),
}

/// How a file of a mesh is read, from keyword arguments.
fn import_options(
    py: Python<'_>,
    unit: Option<&str>,
    up: Option<&str>,
    default_material: Option<String>,
    materials: BTreeMap<String, String>,
    smooth_deg: Option<f64>,
) -> PyResult<ImportOptions> {
    for m in materials.values().chain(&default_material) {
        material::parse_spec(m).or_raise(py)?;
    }
    Ok(ImportOptions {
        unit_m: unit.map_or(Ok(1.0), gltf::unit_m).or_raise(py)?,
        unit_given: unit.is_some(),
        up: up.map_or(Ok(gltf::Up::Y), gltf::up).or_raise(py)?,
        up_given: up.is_some(),
        default_material,
        material_map: materials.into_iter().collect(),
        smooth_deg: smooth_deg.map(check_smooth_deg).transpose().or_raise(py)?,
        ..ImportOptions::default()
    })
}

impl Scene {
    fn of(name: String, contents: Contents) -> Scene {
        Scene { name, contents: Arc::new(contents), truth: None, boresight_deg: (0.0, 0.0) }
    }

    fn loaded(py: Python<'_>, name: String, options: ImportOptions) -> PyResult<Scene> {
        work::run(py, None, move |_| {
            let t = target::load(&name, &options)?;
            // What `catseye scene` left in the file; other files have none.
            let truth = std::fs::read(&name).ok().map(|b| glb::truth_of(&b)).transpose()?.flatten();
            Ok(Scene {
                truth: truth.map(Arc::new),
                boresight_deg: t.boresight_deg,
                ..Scene::of(t.name, t.scene)
            })
        })
    }
}

#[pymethods]
impl Scene {
    #[new]
    fn new() -> Scene {
        Scene::of(String::new(), Contents::default())
    }

    /// Loads a .glb, .gltf, .stl or .obj file, or builds a reflector from its specification.
    ///
    /// unit: unit of the file's coordinates (m, cm, mm, in, ft); up: its axis that points up (y, z). glTF is in m with y up; the other formats state
    /// neither. materials: radar material for each material name of the file; default_material: radar material of triangles without one. smooth_deg:
    /// edges with a larger angle between their facets are creases (0 takes every facet as flat); None is 30 degrees, and takes a glTF file without
    /// normals as flat.
    #[staticmethod]
    #[pyo3(signature = (path, *, unit = None, up = None, default_material = None, materials = BTreeMap::new(), smooth_deg = None))]
    fn load(
        py: Python<'_>,
        path: PathBuf,
        unit: Option<&str>,
        up: Option<&str>,
        default_material: Option<String>,
        materials: BTreeMap<String, String>,
        smooth_deg: Option<f64>,
    ) -> PyResult<Scene> {
        let mut options = import_options(py, unit, up, default_material, materials, smooth_deg)?;
        // A glTF file of whole roads is loaded in the same way: no size is doubted.
        options.unit_given |= !mesh_file::leaves_unit_open(&path, &options);
        Scene::loaded(py, path.to_string_lossy().into_owned(), options)
    }

    /// Loads a scene from the bytes of a .glb file. Arguments as for `load`.
    #[staticmethod]
    #[pyo3(signature = (data, *, unit = None, up = None, default_material = None, materials = BTreeMap::new(), smooth_deg = None))]
    fn from_glb(
        py: Python<'_>,
        data: Vec<u8>,
        unit: Option<&str>,
        up: Option<&str>,
        default_material: Option<String>,
        materials: BTreeMap<String, String>,
        smooth_deg: Option<f64>,
    ) -> PyResult<Scene> {
        let options = import_options(py, unit, up, default_material, materials, smooth_deg)?;
        work::run(py, None, move |_| {
            let contents = gltf::import_bytes(&data, "data".as_ref(), None, &options)?;
            let truth = glb::truth_of(&data)?.map(Arc::new);
            Ok(Scene { truth, ..Scene::of(String::new(), contents) })
        })
    }

    /// Builds a scene of one object whose mesh is given by arrays.
    ///
    /// vertices_m: float64 [vertex, 3], positions in m: x forward, y left, z up. triangles: int [triangle, 3], indices of the vertices of each
    /// triangle, from 0, counter-clockwise seen from outside. material: name of the radar material as in `materials()`, or a sequence with one name
    /// for each triangle. normals: float64 [vertex, 3] of any length, normals of the smooth surface that the facets represent; zero where the surface
    /// is flat; None when it is flat everywhere. smooth_deg: edges with a larger angle between their facets are creases; with it, a mesh without
    /// normals gets the normals of its smooth surfaces. name, class_name: of the object. Unused vertices and triangles without area are removed;
    /// `notes` reports the latter.
    ///
    /// Raises BadInput for an array of another shape or type, numbers that are not finite, indices of vertices that do not exist, an unknown
    /// material, and a mesh without a triangle.
    #[staticmethod]
    #[pyo3(signature = (vertices_m, triangles, *, material = None, normals = None, smooth_deg = None, name = "", class_name = ""))]
    fn from_mesh(
        vertices_m: &Bound<'_, PyAny>,
        triangles: &Bound<'_, PyAny>,
        material: Option<&Bound<'_, PyAny>>,
        normals: Option<&Bound<'_, PyAny>>,
        smooth_deg: Option<f64>,
        name: &str,
        class_name: &str,
    ) -> PyResult<Scene> {
        let py = vertices_m.py();
        let vectors = |key: &str, ob: &Bound<'_, PyAny>| -> PyResult<Vec<glam::DVec3>> {
            Ok(rows_of_three(key, ob, "float64")?.into_iter().map(glam::DVec3::from_array).collect())
        };
        let materials = match material {
            None => vec!["pec".into()],
            Some(one) => match one.extract::<String>() {
                Ok(one) => vec![one],
                Err(_) => one.extract::<Vec<String>>().map_err(|_| {
                    PyTypeError::new_err("material is neither a name nor a sequence of names")
                })?,
            },
        };
        let arrays = MeshArrays {
            vertices_m: vectors("vertices_m", vertices_m)?,
            triangles: rows_of_three("triangles", triangles, "int64")?,
            normals: normals.map(|n| vectors("normals", n)).transpose()?,
            materials,
            smooth_deg,
        };
        let (name, class) = (name.to_string(), class_name.to_string());
        work::run(py, None, move |_| {
            let contents = from_arrays(&name, &class, arrays)?;
            Ok(Scene::of(name, contents))
        })
    }

    #[getter]
    fn name(&self) -> &str {
        &self.name
    }

    /// Direction from which the scene is meant to be seen, (azimuth, elevation) in degrees.
    #[getter]
    fn boresight_deg(&self) -> (f64, f64) {
        self.boresight_deg
    }

    #[getter]
    fn triangle_count(&self) -> usize {
        self.contents.triangle_count()
    }

    /// Names of the radar materials in the scene.
    #[getter]
    fn materials(&self) -> Vec<&str> {
        self.contents.materials.iter().map(|m| m.name.as_str()).collect()
    }

    /// Notes of the importer on what it removed or assumed, one text each.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.contents.import.notes.clone()
    }

    /// Objects of the scene, a list of dictionaries: id, name, class, triangles, position_m (at time 0), velocity_mps, rcs_dbsm (of a point target,
    /// else None).
    #[getter]
    fn objects(&self, py: Python<'_>) -> PyResult<Vec<Py<PyAny>>> {
        self.contents
            .objects
            .iter()
            .map(|o| {
                let (triangles, rcs_dbsm) = match o.shape {
                    Shape::Mesh(m) => (self.contents.meshes[m].triangles.len(), None),
                    Shape::Point { rcs_dbsm } => (0, Some(rcs_dbsm)),
                    Shape::Table(_) => (0, None),
                };
                let object = dictionary(
                    py,
                    &[
                        ("id", o.id.into_pyobject(py)?.into_any().unbind()),
                        ("name", (&o.name).into_pyobject(py)?.into_any().unbind()),
                        ("class", (&o.class).into_pyobject(py)?.into_any().unbind()),
                        ("triangles", triangles.into_pyobject(py)?.into_any().unbind()),
                        ("position_m", array(py, o.pose.translation_m.to_array().to_vec(), &[3])?),
                        ("velocity_mps", array(py, o.velocity_mps.to_array().to_vec(), &[3])?),
                        ("rcs_dbsm", rcs_dbsm.into_pyobject(py)?.into_any().unbind()),
                    ],
                )?;
                Ok(object.into_any().unbind())
            })
            .collect()
    }

    /// Labels of a built road as dictionaries: lanes, lines, edges, free space, markers; None without a road.
    #[getter]
    fn truth(&self, py: Python<'_>) -> PyResult<Option<Py<PyAny>>> {
        self.truth.as_deref().map(|t| plain(py, t)).transpose()
    }

    /// Returns the minimum and the maximum corner of the scene in the world at a time in m, float64 [2, 3]; None for an empty scene.
    #[pyo3(signature = (*, time_s = 0.0))]
    fn bounds_m(&self, py: Python<'_>, time_s: f64) -> PyResult<Option<Py<PyAny>>> {
        let corners = |(lo, hi): (glam::DVec3, glam::DVec3)| [lo.to_array(), hi.to_array()].concat();
        self.contents.bounds_m(time_s).map(|b| array(py, corners(b), &[2, 3])).transpose()
    }

    /// Returns the boxes of all objects in the world at a time, a list of dictionaries: id, name, class, centre_m, size_m, rotation_xyzw, yaw_rad,
    /// velocity_mps, spin_rad_per_s.
    #[pyo3(signature = (*, time_s = 0.0))]
    fn boxes(&self, py: Python<'_>, time_s: f64) -> PyResult<Py<PyAny>> {
        plain(py, &truth_boxes(&self.contents, time_s))
    }

    /// Returns all triangles in the world at a time: {"corners_m": float64 [triangle, 3, 3], "object_id": uint32 [triangle], "material": uint32
    /// [triangle], an index into `materials`}.
    #[pyo3(signature = (*, time_s = 0.0))]
    fn triangles(&self, py: Python<'_>, time_s: f64) -> PyResult<Py<PyAny>> {
        let n = self.contents.triangle_count();
        let (mut corners, mut ids, mut materials) = (Vec::with_capacity(9 * n), Vec::new(), Vec::new());
        for o in &self.contents.objects {
            let Shape::Mesh(m) = o.shape else { continue };
            let (mesh, pose) = (&self.contents.meshes[m], o.at(time_s).pose());
            for (t, material) in mesh.triangles.iter().zip(&mesh.material) {
                corners.extend(t.iter().flat_map(|i| pose.point(mesh.positions_m[*i as usize]).to_array()));
                ids.push(o.id);
                materials.push(*material);
            }
        }
        let all = dictionary(
            py,
            &[
                ("corners_m", array(py, corners, &[n, 3, 3])?),
                ("object_id", ids.into_pyarray(py).into_any().unbind()),
                ("material", materials.into_pyarray(py).into_any().unbind()),
            ],
        )?;
        Ok(all.into_any().unbind())
    }

    /// Checks the meshes and returns warnings, one text each: defects of meshes, dielectric bodies that are open or curved, metal that is present
    /// twice. `notes` reports where the importer deviated from the file.
    ///
    /// Raises BadInput for a mesh that cannot be used.
    #[pyo3(signature = (*, frequency_hz = DEFAULT_FREQUENCY_HZ))]
    fn check(&self, py: Python<'_>, frequency_hz: f64) -> PyResult<Vec<String>> {
        let contents = self.contents.clone();
        work::run(py, None, move |_| of_targets(&contents, frequency_hz))
    }

    /// Adds a point target and returns its id. velocity_mps: velocity in the world, default at rest.
    #[pyo3(signature = (*, position_m, rcs_dbsm, velocity_mps = None, name = "", class_name = ""))]
    fn add_point(
        &mut self,
        py: Python<'_>,
        position_m: &Bound<'_, PyAny>,
        rcs_dbsm: f64,
        velocity_mps: Option<&Bound<'_, PyAny>>,
        name: &str,
        class_name: &str,
    ) -> PyResult<u32> {
        if !(-200.0..=200.0).contains(&rcs_dbsm) {
            let e = BadInput::new("out of range").key("rcs_dbsm").value(rcs_dbsm).allowed("-200..200");
            return refuse(py, e);
        }
        let pose = Pose::new(glam::DQuat::IDENTITY, vector("position_m", Some(position_m))?);
        let velocity = vector("velocity_mps", velocity_mps)?;
        let contents = Arc::make_mut(&mut self.contents);
        Ok(contents.add_object(name, class_name, Shape::Point { rcs_dbsm }, pose, velocity))
    }

    /// Adds all objects of another scene (or of a file or reflector given by name), moved as one body, and returns their ids. Yaw is positive to the
    /// left, pitch nose down, roll left side up; a reflector's boresight is its x axis. velocity_mps (world) is added to the objects' own velocities.
    #[pyo3(signature = (other, *, position_m = None, yaw_deg = 0.0, pitch_deg = 0.0, roll_deg = 0.0, velocity_mps = None, name = "", class_name = ""))]
    #[allow(clippy::too_many_arguments)] // keywords
    fn add(
        slf: &Bound<'_, Self>,
        other: &Bound<'_, PyAny>,
        position_m: Option<&Bound<'_, PyAny>>,
        yaw_deg: f64,
        pitch_deg: f64,
        roll_deg: f64,
        velocity_mps: Option<&Bound<'_, PyAny>>,
        name: &str,
        class_name: &str,
    ) -> PyResult<Vec<u32>> {
        let py = slf.py();
        let [yaw, pitch, roll] = angles(py, yaw_deg, pitch_deg, roll_deg)?;
        // Before this scene is borrowed: it may be the same one.
        let added = resolve(other)?.contents;
        let pose = Pose::from_yaw_pitch_roll(vector("position_m", position_m)?, yaw, pitch, roll);
        let velocity = vector("velocity_mps", velocity_mps)?;
        let mut this = slf.try_borrow_mut()?;
        let contents = Arc::make_mut(&mut this.contents);
        let first = contents.add_meshes(&added);
        contents.import.notes.extend(added.import.notes.iter().cloned());
        let placement = Placement { pose, velocity_mps: velocity, joints: None };
        Ok(contents.place(&added, first, Label { name, class: class_name }, &placement, &|joints| joints))
    }

    /// Returns the scene as the bytes of a .glb file, from which `from_glb` reads the same scene (positions are rounded to single precision).
    fn to_glb<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = self.glb_bytes(py)?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Writes a .glb file and returns its path. The file appears under its name only when it is complete. force: replace an existing file.
    #[pyo3(signature = (path, *, force = false))]
    fn save(&self, py: Python<'_>, path: PathBuf, force: bool) -> PyResult<PathBuf> {
        let bytes = self.glb_bytes(py)?;
        work::run(py, None, move |_| {
            check_extension(&path, &["glb"])?;
            stage::write_file(&path, force, &bytes)
        })
    }

    /// Writes the page of `catseye view` for this scene and returns it as a View, which a notebook shows in the cell; `.open()` shows it in the
    /// browser.
    ///
    /// output: the HTML file to write, default a temporary one. force: replace an existing file.
    #[pyo3(signature = (*, output = None, force = false))]
    fn view(slf: &Bound<'_, Self>, output: Option<PathBuf>, force: bool) -> PyResult<Py<PyAny>> {
        let keywords = PyDict::new(slf.py());
        keywords.set_item("output", output)?;
        keywords.set_item("force", force)?;
        drawn::call(slf, "view", Some(&keywords))
    }

    fn _repr_html_(slf: &Bound<'_, Self>) -> PyResult<Py<PyAny>> {
        drawn::call(slf, "scene_html", None)
    }

    fn __len__(&self) -> usize {
        self.contents.objects.len()
    }

    fn __repr__(&self) -> String {
        let name = if self.name.is_empty() { String::new() } else { format!(" {}:", self.name) };
        let (objects, triangles) = (self.contents.objects.len(), self.contents.triangle_count());
        format!("<catseye.Scene{name} {objects} objects, {triangles} triangles>")
    }
}

impl Scene {
    fn glb_bytes(&self, py: Python<'_>) -> PyResult<Vec<u8>> {
        let (contents, truth) = (self.contents.clone(), self.truth.clone());
        work::run(py, None, move |_| match &truth {
            Some(truth) => glb::to_glb(&contents, truth),
            None => gltf::to_glb(&contents),
        })
    }
}

/// Warnings about the meshes of a scene. Errors: one that cannot be used.
pub fn warnings(contents: &Contents, frequency_hz: f64) -> catseye::Result<Vec<String>> {
    let mut lines = Vec::new();
    for (name, report) in check_scene(contents, frequency_hz)? {
        if let Some(e) = report.error() {
            return Err(e.key(format!("object '{name}'")).into());
        }
        lines.extend(report.warnings().iter().map(|w| format!("{name}: {w}")));
    }
    Ok(lines)
}

/// The scene that an argument means: a Scene, a reflector's specification, or a file of a mesh.
pub fn resolve(argument: &Bound<'_, PyAny>) -> PyResult<Scene> {
    if let Ok(scene) = argument.cast::<Scene>() {
        return Ok(scene.try_borrow()?.clone());
    }
    let name: PathBuf = argument.extract().map_err(|_| {
        PyTypeError::new_err("expected a Scene, a path, or a reflector as in 'plate:width_m=1'")
    })?;
    Scene::loaded(argument.py(), name.to_string_lossy().into_owned(), ImportOptions::default())
}

/// Builds a reflector of the library and returns it as a Scene. spec: "KIND", or "KIND:name=value,name=value" as in
/// "type1:width_m=0.16,height_m=0.004"; parameters may also be given as keywords. `reflector_kinds()` lists the kinds.
#[pyfunction]
#[pyo3(signature = (spec, **parameters))]
pub fn reflector(py: Python<'_>, spec: &str, parameters: Option<&Bound<'_, PyDict>>) -> PyResult<Scene> {
    let mut pairs: Vec<(String, String)> = Vec::new();
    for (name, value) in parameters.iter().flat_map(|p| p.iter()) {
        pairs.push((name.extract()?, value.str()?.to_string()));
    }
    if spec.contains(':') && !pairs.is_empty() {
        let e = BadInput::new("parameters after ':' and keyword parameters exclude each other")
            .key("spec")
            .value(spec)
            .remedy("use one of the two");
        return refuse(py, e);
    }
    let spec = spec.to_string();
    work::run(py, None, move |_| {
        let pairs: Vec<(&str, &str)> = pairs.iter().map(|(a, b)| (a.as_str(), b.as_str())).collect();
        let r = match pairs.is_empty() {
            true => Reflector::parse(&spec)?,
            false => Reflector::from_pairs(&spec, &pairs)?,
        };
        let scene = r.to_scene(&material::parse_spec)?;
        Ok(Scene { boresight_deg: r.kind().boresight_deg, ..Scene::of(r.spec(), scene) })
    })
}

/// Returns the kinds of reflectors and their parameters: {kind: {"summary", "pose", "parameters": {name: {"doc", "range", "default"}}}}.
#[pyfunction]
pub fn reflector_kinds(py: Python<'_>) -> PyResult<Py<PyAny>> {
    let kinds: serde_json::Map<String, serde_json::Value> = library::kinds()
        .iter()
        .map(|k| {
            let parameter = |p: &library::Param| {
                let value = serde_json::json!({
                    "doc": p.doc,
                    "range": p.range.to_string(),
                    "default": p.range.default_value().to_string(),
                });
                (p.name.to_string(), value)
            };
            let parameters: serde_json::Map<_, _> = k.params.iter().map(parameter).collect();
            let kind = serde_json::json!({ "summary": k.summary, "pose": k.pose, "parameters": parameters });
            (k.name.to_string(), kind)
        })
        .collect();
    plain(py, &kinds)
}

/// Returns the names of the radar materials. A layer on a material is written with its thickness in m, as in "aluminium+water:0.0005".
#[pyfunction]
pub fn materials() -> Vec<&'static str> {
    material::names().collect()
}

/// Builds a road scene from a TOML file or from TOML text (a string with more than one line), with its labels in `Scene.truth`. folder: where files
/// that the text names are looked for.
#[pyfunction]
#[pyo3(signature = (path_or_text, *, folder = PathBuf::new()))]
pub fn road_scene(py: Python<'_>, path_or_text: PathBuf, folder: PathBuf) -> PyResult<Scene> {
    work::run(py, None, move |_| {
        let text = path_or_text.to_string_lossy();
        let plan = match text.contains('\n') {
            true => scene_toml::parse(&folder.join("road.toml"), &text)?,
            false => scene_toml::load(&path_or_text)?,
        };
        let (contents, truth) = build::build(&plan)?;
        Ok(Scene { truth: Some(Arc::new(truth)), ..Scene::of(plan.name, contents) })
    })
}
