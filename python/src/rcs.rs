//! Cross sections.

use crate::arrays::{angles, array, floats, values};
use crate::errors::OrRaise;
use crate::{drawn, engine, scene, work};
use catseye::base::convention::{Convention, MAX_BOUNCES};
use catseye::base::error::{BadInput, Error};
use catseye::base::matrix::Matrix2;
use catseye::base::units::{DEFAULT_FREQUENCY_HZ, dbsm_from_amplitude};
use catseye::engine::Purpose;
use catseye::engine::sweep::{Sweep, check_size};
use catseye::formats::rcs_csv::RawRow;
use catseye::rcs::polarisation::Derived;
use catseye::rcs::{Aspect, Diffraction, Distance, Ground, RcsOptions, Scattering};
use catseye::road::target::Target;
use catseye::scene::material;
use catseye_plot::{Picture, RcsRow, RcsStyle, rcs_picture};
use num_complex::Complex64;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Arc;

/// Scattering matrices of a sweep over frequency and direction. The axes of `s` are [frequency, elevation, azimuth, rx, tx], and [frequency,
/// elevation, azimuth, bistatic_elevation, bistatic_azimuth, rx, tx] for a receiver at another position; no axis is ever dropped. rx and tx are
/// polarisations, 0 vertical and 1 horizontal.
#[pyclass(module = "catseye", frozen)]
pub struct RcsResult {
    /// Name of the target.
    #[pyo3(get)]
    pub target: String,
    /// Frequencies in Hz, float64 [frequency].
    #[pyo3(get)]
    frequency_hz: Py<PyAny>,
    /// Azimuths of the transmitter in degrees, positive left, float64 [azimuth].
    #[pyo3(get)]
    azimuth_deg: Py<PyAny>,
    /// Elevations of the transmitter in degrees, positive up, float64 [elevation].
    #[pyo3(get)]
    elevation_deg: Py<PyAny>,
    /// Azimuths of the receiver in degrees, float64 [bistatic_azimuth]; None where it is at the transmitter.
    #[pyo3(get)]
    bistatic_azimuth_deg: Option<Py<PyAny>>,
    /// Elevations of the receiver in degrees, float64 [bistatic_elevation]; None where it is at the transmitter.
    #[pyo3(get)]
    bistatic_elevation_deg: Option<Py<PyAny>>,
    /// Scattering matrices S in m, complex128: sigma = 4 pi |S|^2, phase referred to the target's origin (CONVENTIONS eq. 3).
    #[pyo3(get)]
    s: Py<PyAny>,
    /// Radar cross sections in dBsm, float64 in the shape of `s`.
    #[pyo3(get)]
    dbsm: Py<PyAny>,
    /// Bounces that radiate: "every" or "last".
    #[pyo3(get)]
    pub convention: &'static str,
    /// Change against a finer run in dB where cells or curved facets are involved; None where flat facets are exact.
    #[pyo3(get)]
    convergence_db: Option<f64>,
    /// Rotation of the target, (yaw, pitch, roll) in degrees.
    #[pyo3(get)]
    turned_deg: (f64, f64, f64),
    /// Rule by which "auto" chose the engine; None where there was no choice, as on a machine without a hardware GPU.
    #[pyo3(get)]
    engine_rule: Option<&'static str>,
    /// Possible causes of a wrong result, one text each; each was also reported with `warnings.warn`.
    #[pyo3(get)]
    warnings: Vec<String>,
    matrices: Vec<Matrix2>,
    shape: Vec<usize>,
}

impl RcsResult {
    fn entry(&self, py: Python<'_>, rx: usize, tx: usize) -> PyResult<Py<PyAny>> {
        let levels = self.matrices.iter().map(|s| dbsm_from_amplitude(s[rx][tx].norm())).collect();
        array(py, levels, &self.shape)
    }

    /// The rows of the table that `catseye rcs` would write, in the order of the axes.
    pub fn rows(&self, py: Python<'_>) -> PyResult<Vec<RawRow>> {
        let axis = |a: &Py<PyAny>| floats(a.bind(py));
        let (frequencies, elevations, azimuths) =
            (axis(&self.frequency_hz)?, axis(&self.elevation_deg)?, axis(&self.azimuth_deg)?);
        let receivers: Vec<Option<(f64, f64)>> =
            match (&self.bistatic_elevation_deg, &self.bistatic_azimuth_deg) {
                (Some(el), Some(az)) => {
                    let az = axis(az)?;
                    axis(el)?.into_iter().flat_map(|el| az.iter().map(move |az| Some((*az, el)))).collect()
                }
                _ => vec![None],
            };
        let mut rows = Vec::with_capacity(self.matrices.len());
        let mut matrices = self.matrices.iter();
        for &frequency_hz in &frequencies {
            for &elevation_deg in &elevations {
                for &azimuth_deg in &azimuths {
                    for (&receive_deg, s) in receivers.iter().zip(&mut matrices) {
                        let dbsm = [(0, 0), (0, 1), (1, 0), (1, 1)];
                        let dbsm = dbsm.map(|(rx, tx)| dbsm_from_amplitude(s[rx][tx].norm()));
                        let line = rows.len() + 1;
                        rows.push(RawRow {
                            line,
                            frequency_hz,
                            azimuth_deg,
                            elevation_deg,
                            receive_deg,
                            dbsm,
                            s: *s,
                        });
                    }
                }
            }
        }
        Ok(rows)
    }
}

#[pymethods]
impl RcsResult {
    /// Cross section in dBsm with V received and V transmitted, float64 [frequency, elevation, azimuth(, ...)].
    #[getter]
    fn vv_dbsm(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.entry(py, 0, 0)
    }

    /// Cross section in dBsm with V received and H transmitted, in the shape of `vv_dbsm`.
    #[getter]
    fn vh_dbsm(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.entry(py, 0, 1)
    }

    /// Cross section in dBsm with H received and V transmitted, in the shape of `vv_dbsm`.
    #[getter]
    fn hv_dbsm(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.entry(py, 1, 0)
    }

    /// Cross section in dBsm with H received and H transmitted, in the shape of `vv_dbsm`.
    #[getter]
    fn hh_dbsm(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.entry(py, 1, 1)
    }

    /// Returns S in another pair of polarisations (CONVENTIONS eq. 40-42), complex128 in the shape of `s`. name: "linear45" (0 at +45, 1 at -45 deg)
    /// or "circular" (0 right-hand, 1 left-hand, IEEE Std 145).
    fn in_polarisation(&self, py: Python<'_>, name: &str) -> PyResult<Py<PyAny>> {
        let derived = derived(name).or_raise(py)?;
        let all: Vec<_> = self.matrices.iter().map(|s| derived.of(s)).collect();
        array(py, entries(&all), &with_matrix(&self.shape))
    }

    /// Draws a cut through the table in dBsm with matplotlib; returns the Axes.
    ///
    /// polarisation: one of "vv", "vh", "hv", "hh" (first letter received), of "rr", "rl", "lr", "ll" (circular) or of "p45p45", "p45m45", "m45p45",
    /// "m45m45" (linear at +45 and -45 deg), or several in a sequence; "circular" and "linear45" select all four of their kind; default "vv". over:
    /// the axis of the curves, as "azimuth_deg", default the longest. at: values of other axes by their names, as {"elevation_deg": 1.0}; without it
    /// each value has a curve, ten at most. polar: draw on a disc with 0 up and positive azimuth left. ax: Axes to draw into. Raises ImportError
    /// without matplotlib.
    #[pyo3(signature = (polarisation = None, *, over = None, at = None, polar = false, ax = None))]
    fn plot(
        slf: &Bound<'_, Self>,
        polarisation: Option<&Bound<'_, PyAny>>,
        over: Option<&str>,
        at: Option<&Bound<'_, PyAny>>,
        polar: bool,
        ax: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Py<PyAny>> {
        let py = slf.py();
        let keywords = PyDict::new(py);
        keywords.set_item("polarisation", polarisation)?;
        keywords.set_item("over", over)?;
        keywords.set_item("at", at)?;
        keywords.set_item("polar", polar)?;
        keywords.set_item("ax", ax)?;
        drawn::call(slf, "plot_rcs", Some(&keywords))
    }

    /// Writes the plot of `catseye rcs --plot` with all polarisations and frequencies, and returns its path; needs no matplotlib.
    ///
    /// path: the file, PNG, or SVG or PDF when its name ends so. polarisation: further ones to draw, "linear45", "circular", or both in a sequence.
    /// force: replace an existing file. Raises BadInput for another ending, for a file that exists, and for a result of only one direction.
    #[pyo3(signature = (path, *, polarisation = None, force = false))]
    fn save_plot(
        &self,
        py: Python<'_>,
        path: std::path::PathBuf,
        polarisation: Option<&Bound<'_, PyAny>>,
        force: bool,
    ) -> PyResult<std::path::PathBuf> {
        let names = match polarisation {
            None => Vec::new(),
            Some(one) => {
                one.extract::<String>().map(|n| vec![n]).or_else(|_| one.extract::<Vec<String>>())?
            }
        };
        let more = names.iter().map(|n| derived(n)).collect::<catseye::Result<Vec<_>>>().or_raise(py)?;
        let (title, rows) = (self.target.clone(), self.rows(py)?);
        work::run(py, None, move |_| rcs_plot(&title, &rows, &more)?.write(path, force))
    }

    /// Writes the page of `catseye view` for this table and returns it as a View, which a notebook shows in the cell; `.open()` shows it in the
    /// browser.
    ///
    /// output: the HTML file to write, default a temporary one. force: replace an existing file.
    #[pyo3(signature = (*, output = None, force = false))]
    fn view(slf: &Bound<'_, Self>, output: Option<std::path::PathBuf>, force: bool) -> PyResult<Py<PyAny>> {
        let keywords = PyDict::new(slf.py());
        keywords.set_item("output", output)?;
        keywords.set_item("force", force)?;
        drawn::call(slf, "view", Some(&keywords))
    }

    fn _repr_html_(slf: &Bound<'_, Self>) -> PyResult<Py<PyAny>> {
        drawn::call(slf, "rcs_html", None)
    }

    fn __repr__(&self) -> String {
        format!("<catseye.RcsResult of {}, shape {:?}>", self.target, with_matrix(&self.shape))
    }
}

/// The plot of a table of cross sections, with these polarisations beside VV, HH, VH and HV.
///
/// Errors: one direction alone, which makes no curve.
pub fn rcs_plot(title: &str, rows: &[RawRow], derived: &[Derived]) -> catseye::Result<Picture> {
    let pair = |r: &RawRow, d: Derived| {
        let [[a, b], [c, d]] = d.of(&r.s).map(|row| row.map(|z| dbsm_from_amplitude(z.norm())));
        [a, b, c, d]
    };
    let row = |r: &RawRow| RcsRow {
        frequency_hz: r.frequency_hz,
        azimuth_deg: r.azimuth_deg,
        elevation_deg: r.elevation_deg,
        vv_dbsm: r.dbsm[0],
        vh_dbsm: r.dbsm[1],
        hv_dbsm: r.dbsm[2],
        hh_dbsm: r.dbsm[3],
        derived_dbsm: Derived::ALL.map(|d| derived.contains(&d).then(|| pair(r, d))),
        receive_deg: r.receive_deg.map(|(az, el)| [az, el]),
    };
    rcs_picture(title, &rows.iter().map(row).collect::<Vec<_>>(), RcsStyle::Auto)
}

fn entries(s: &[Matrix2]) -> Vec<Complex64> {
    s.as_flattened().as_flattened().to_vec()
}

fn with_matrix(shape: &[usize]) -> Vec<usize> {
    [shape, &[2, 2]].concat()
}

/// A pair of polarisations by its name.
fn derived(name: &str) -> catseye::Result<Derived> {
    match name {
        "linear45" => Ok(Derived::Linear45),
        "circular" => Ok(Derived::Circular),
        other => Err(unknown("polarisation", other, "linear45, circular")),
    }
}

fn unknown(key: &str, value: &str, allowed: &str) -> Error {
    BadInput::new("unknown name").key(key).value(value).allowed(allowed).into()
}

/// Elevation outermost.
fn aspects(elevations: &[f64], azimuths: &[f64]) -> Vec<Aspect> {
    let aspect = |el: f64, az: &f64| Aspect { azimuth: az.to_radians(), elevation: el.to_radians() };
    elevations.iter().flat_map(|el| azimuths.iter().map(move |az| aspect(*el, az))).collect()
}

fn ground(name: &str) -> catseye::Result<Ground> {
    match name {
        "none" => Ok(Ground::None),
        name => match material::parse_spec(name) {
            Ok(m) => Ok(Ground::Plane(m)),
            Err(Error::Input(b)) => Err(b.key("ground").value(name).into()),
            Err(e) => Err(e),
        },
    }
}

/// Computes scattering matrix and radar cross section of a target over frequency and direction, and returns an RcsResult.
///
/// target: a Scene, a glTF file, or a reflector as in "type1:width_m=0.16". frequency_hz, azimuth_deg, elevation_deg: a number or a sequence; the
/// result has every combination. The angles give the direction of the radar seen from the target's origin, azimuth positive left, elevation positive
/// up. range_m: distance of the radar from the target's origin, inf for a plane wave. With height_m, angles and range_m refer to the point of the
/// ground below the origin, while the cross sections still refer to the distance of the origin. bistatic_azimuth_deg, bistatic_elevation_deg:
/// direction of a receiver that is not at the transmitter. bounces: reflections of one beam, 1 to 8; None traces as many as change the result within
/// accuracy_db. convention: "every" or "last", the bounces that radiate. accuracy_db: accuracy in dB of curved surfaces and of finite range.
/// diffraction: "none" or "ptd". ground: "none", "pec" or a material, the infinite plane z = 0; height_m is the height of the target's origin above
/// it. yaw_deg, pitch_deg, roll_deg: rotate the target about its origin: yaw about z, positive left, then pitch about its new y axis, positive front
/// down, then roll about its new x axis, positive right side down. engine: an Engine or the name of a device. progress: called with the number of
/// directions done and the total.
///
/// Raises BadInput for the inputs that `catseye rcs` rejects. Ctrl-C stops it within a batch of 1024 directions.
#[pyfunction]
#[pyo3(signature = (target, *, frequency_hz = None, azimuth_deg = None, elevation_deg = None, range_m = f64::INFINITY,
    bistatic_azimuth_deg = None, bistatic_elevation_deg = None, bounces = None, convention = "every", accuracy_db = 0.1,
    diffraction = "none", ground = "none", height_m = 0.0, yaw_deg = 0.0, pitch_deg = 0.0, roll_deg = 0.0, engine = None,
    progress = None))]
#[allow(clippy::too_many_arguments)] // keywords
pub fn rcs(
    py: Python<'_>,
    target: &Bound<'_, PyAny>,
    frequency_hz: Option<&Bound<'_, PyAny>>,
    azimuth_deg: Option<&Bound<'_, PyAny>>,
    elevation_deg: Option<&Bound<'_, PyAny>>,
    range_m: f64,
    bistatic_azimuth_deg: Option<&Bound<'_, PyAny>>,
    bistatic_elevation_deg: Option<&Bound<'_, PyAny>>,
    bounces: Option<usize>,
    convention: &str,
    accuracy_db: f64,
    diffraction: &str,
    ground: &str,
    height_m: f64,
    yaw_deg: f64,
    pitch_deg: f64,
    roll_deg: f64,
    engine: Option<&Bound<'_, PyAny>>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<RcsResult> {
    let list = |key: &str, given: Option<&Bound<'_, PyAny>>, default: f64| {
        given.map_or(Ok(vec![default]), |g| values(key, g))
    };
    let frequencies_hz = list("frequency_hz", frequency_hz, DEFAULT_FREQUENCY_HZ)?;
    let (azimuths, elevations) =
        (list("azimuth_deg", azimuth_deg, 0.0)?, list("elevation_deg", elevation_deg, 0.0)?);
    let receivers = match (bistatic_azimuth_deg, bistatic_elevation_deg) {
        (None, None) => None,
        (az, el) => Some((list("bistatic_azimuth_deg", az, 0.0)?, list("bistatic_elevation_deg", el, 0.0)?)),
    };
    let (convention, name) = match convention {
        "every" => (Convention::Every, "every"),
        "last" => (Convention::Last, "last"),
        other => return Err(unknown("convention", other, "every, last")).or_raise(py),
    };
    let options = RcsOptions {
        bounces: bounces.unwrap_or(3),
        most_bounces: bounces.unwrap_or(MAX_BOUNCES),
        distance: if range_m == f64::INFINITY { Distance::Infinite } else { Distance::At(range_m) },
        accuracy_db,
        diffraction: match diffraction {
            "none" => Diffraction::None,
            "ptd" => Diffraction::Ptd,
            other => return Err(unknown("diffraction", other, "none, ptd")).or_raise(py),
        },
        ground: self::ground(ground).or_raise(py)?,
        height_m,
        last: convention == Convention::Last,
    };
    let mut shape = vec![frequencies_hz.len(), elevations.len(), azimuths.len()];
    shape.extend(receivers.iter().flat_map(|(az, el)| [el.len(), az.len()]));
    // A product that memory cannot hold is refused before it is laid out.
    check_size(shape.iter().copied()).or_raise(py)?;
    let sweep = Sweep {
        frequencies_hz,
        transmit: aspects(&elevations, &azimuths),
        receive: receivers.as_ref().map(|(az, el)| aspects(el, az)),
        options,
    };
    sweep.check().or_raise(py)?;

    let looks = shape[1..].iter().product::<usize>() as u64;
    let [yaw, pitch, roll] = angles(py, yaw_deg, pitch_deg, roll_deg)?;
    let target = scene::resolve(target)?;
    let (frequencies_hz, target_name) = (sweep.frequencies_hz.clone(), target.name);
    let mut contents = target.contents;
    if [yaw, pitch, roll] != [0.0; 3] {
        let scene = Arc::unwrap_or_clone(contents);
        let mut turned = Target { name: String::new(), scene, boresight_deg: target.boresight_deg };
        turned.turn(yaw, pitch, roll);
        contents = Arc::new(turned.scene);
    }
    let purpose = match engine::has_choice(engine) {
        true => Purpose::of_target(&contents, &frequencies_hz, sweep.options.accuracy_db).or_raise(py)?,
        false => Purpose::General,
    };
    let (engine, engine_rule) = engine::resolve_for(py, engine, None, purpose)?;
    let (swept, told) = work::run(py, progress, move |watch| {
        watch.expect(looks);
        let mut told = scene::warnings(&contents, sweep.frequencies_hz[0])?;
        let swept = sweep.take(&*engine, &contents, &mut |w| told.push(w.into()), &|n| watch.step(n))?;
        Ok((swept, told))
    })?;
    let warn = py.import("warnings")?.getattr("warn")?;
    for line in &told {
        warn.call1((line,))?;
    }
    let matrices: Vec<_> = swept.scattering.iter().map(|s: &Scattering| *s.of(convention)).collect();
    let all = entries(&matrices);
    let levels: Vec<f64> = all.iter().map(|z| dbsm_from_amplitude(z.norm())).collect();
    let full = with_matrix(&shape);
    let axis = |data: Vec<f64>| {
        let n = data.len();
        array(py, data, &[n])
    };
    let (bistatic_azimuth_deg, bistatic_elevation_deg) = receivers.unzip();
    Ok(RcsResult {
        target: target_name,
        frequency_hz: axis(frequencies_hz)?,
        azimuth_deg: axis(azimuths)?,
        elevation_deg: axis(elevations)?,
        bistatic_azimuth_deg: bistatic_azimuth_deg.map(axis).transpose()?,
        bistatic_elevation_deg: bistatic_elevation_deg.map(axis).transpose()?,
        s: array(py, all, &full)?,
        dbsm: array(py, levels, &full)?,
        convention: name,
        convergence_db: swept.accuracy.db(),
        turned_deg: (yaw_deg, pitch_deg, roll_deg),
        engine_rule,
        warnings: told,
        matrices,
        shape,
    })
}
