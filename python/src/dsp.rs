//! The stages of the chain one by one, tensors of cubes, and labels of tensors.

use crate::arrays::{Records, array, floats};
use crate::errors::{OrRaise, refuse};
use crate::{engine, radar, work};
use catseye::adc::Cube;
use catseye::base::error::BadInput;
use catseye::base::frames::Pose;
use catseye::detect::ambiguity::Ambiguity;
use catseye::detect::view_labels::{SeenBody, View, confidence, masks};
use catseye::detect::{directions, tensors};
use catseye::dsp::doa_beamform::{Beamformer, Grid};
use catseye::dsp::doa_estimate::Cells;
use catseye::dsp::{Cell, Detection, PowerMap, RangeDoppler, Snapshots, Spectrum};
use catseye::engine::stages::AnySpectrum;
use catseye::engine::{AnyCube, Engine, Precision};
use catseye::scene::radar::{Cfar, CfarKind, Radar};
use catseye::scene::radar_toml::FALSE_ALARM;
use glam::{DQuat, DVec3};
use num_complex::{Complex, Complex32, Complex64};
use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArrayDyn, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::IntoPyDict;
use std::sync::Arc;

/// Whether arrays of an engine are in double precision.
fn is_wide(engine: &Engine) -> bool {
    matches!(engine, Engine::Cpu(Precision::F64))
}

/// Numbers of an array argument with its shape. Errors: what is no array of numbers, another number of axes, values that are not
/// finite.
struct Given<T> {
    shape: Vec<usize>,
    data: Vec<T>,
}

/// Type of NumPy that an argument is turned into.
trait Number: numpy::Element + Copy {
    const NAME: &'static str;
    fn is_finite(&self) -> bool;
}

impl Number for Complex32 {
    const NAME: &'static str = "complex64";
    fn is_finite(&self) -> bool {
        Complex::is_finite(*self)
    }
}

impl Number for Complex64 {
    const NAME: &'static str = "complex128";
    fn is_finite(&self) -> bool {
        Complex::is_finite(*self)
    }
}

impl Number for f64 {
    const NAME: &'static str = "float64";
    fn is_finite(&self) -> bool {
        f64::is_finite(*self)
    }
}

fn given<T: Number>(key: &str, axes: &[&str], ob: &Bound<'_, PyAny>) -> PyResult<Given<T>> {
    let py = ob.py();
    let bad = |problem: &str, value: String| {
        let b = BadInput::new(problem).key(key).value(value);
        b.allowed(format!("numbers over [{}]", axes.join(", ")))
    };
    let any = py.import("numpy")?.call_method1("asarray", (ob,))?;
    let untyped = any.cast::<PyUntypedArray>()?;
    let kind: String = any.getattr("dtype")?.getattr("kind")?.extract()?;
    let allowed = if T::NAME.starts_with("complex") { "biufc" } else { "biuf" };
    if !allowed.contains(&kind) {
        let name: String = any.getattr("dtype")?.str()?.extract()?;
        return refuse(py, bad("the array has another type of numbers", name));
    }
    let shape = untyped.shape().to_vec();
    if shape.len() != axes.len() {
        return refuse(py, bad("the array has another number of axes", format!("{shape:?}")));
    }
    let keywords = [("order", "C"), ("casting", "unsafe")].into_py_dict(py)?;
    let cast = any.getattr("astype")?.call((T::NAME,), Some(&keywords))?;
    let read: PyReadonlyArrayDyn<'_, T> = cast.extract()?;
    let data = read.as_slice()?.to_vec();
    match data.iter().position(|z| !z.is_finite()) {
        None => Ok(Given { shape, data }),
        Some(i) => {
            let mut at = i;
            let mut place: Vec<usize> = shape
                .iter()
                .rev()
                .map(|n| {
                    let k = at % n;
                    at /= n;
                    k
                })
                .collect();
            place.reverse();
            let b = BadInput::new("a value is not a finite number").key(format!("{key}{place:?}"));
            refuse(py, b.remedy("correct the value, or leave it out"))
        }
    }
}

/// One ramp of the radar that an argument means.
fn part(argument: &Bound<'_, PyAny>, ramp: usize) -> PyResult<Arc<Radar>> {
    let all = radar::resolve(argument)?;
    let parts = all.waveform.parts();
    if ramp >= parts {
        let b = BadInput::new("the radar has no such ramp").key("ramp").value(ramp);
        return refuse(argument.py(), b.allowed(format!("0 to {}", parts - 1)));
    }
    Ok(if parts == 1 { all } else { Arc::new(all.part(ramp)) })
}

const CUBE: [&str; 3] = ["chirp", "rx_virtual", "sample"];

/// A cube of [chirp, channel, sample or range] in the precision of the engine.
fn cube(key: &str, axes: &[&str; 3], ob: &Bound<'_, PyAny>, wide: bool) -> PyResult<AnyCube> {
    fn of<T: Number>(g: Given<T>) -> (usize, usize, usize, Vec<T>) {
        (g.shape[0], g.shape[1], g.shape[2], g.data)
    }
    Ok(match wide {
        true => {
            let (chirps, channels, samples, data) = of(given::<Complex64>(key, axes, ob)?);
            AnyCube::F64(Cube { chirps, channels, samples, data })
        }
        false => {
            let (chirps, channels, samples, data) = of(given::<Complex32>(key, axes, ob)?);
            AnyCube::F32(Cube { chirps, channels, samples, data })
        }
    })
}

fn spectrum_of(ob: &Bound<'_, PyAny>, wide: bool) -> PyResult<AnySpectrum> {
    Ok(match cube("spectrum", &["doppler", "channel", "range"], ob, wide)? {
        AnyCube::F64(c) => AnySpectrum::F64(Spectrum {
            doppler_bins: c.chirps,
            channels: c.channels,
            range_bins: c.samples,
            data: c.data,
        }),
        AnyCube::F32(c) => AnySpectrum::F32(Spectrum {
            doppler_bins: c.chirps,
            channels: c.channels,
            range_bins: c.samples,
            data: c.data,
        }),
    })
}

fn map_of(ob: &Bound<'_, PyAny>) -> PyResult<PowerMap<f64>> {
    let g = given::<f64>("power", &["doppler", "range"], ob)?;
    if let Some(i) = g.data.iter().position(|p| *p < 0.0) {
        let b = BadInput::new("a power is negative").key("power").value(g.data[i]);
        return refuse(ob.py(), b.allowed("0 or more").remedy("give power in W, not in dB"));
    }
    if g.data.is_empty() {
        let b = BadInput::new("the map is empty").key("power").value(format!("{:?}", g.shape));
        return refuse(ob.py(), b);
    }
    Ok(PowerMap { doppler_bins: g.shape[0], range_bins: g.shape[1], data: g.data })
}

/// Real values that came from an engine, in its precision.
fn reals(py: Python<'_>, data: Vec<f64>, shape: &[usize], wide: bool) -> PyResult<Py<PyAny>> {
    match wide {
        true => array(py, data, shape),
        false => array(py, data.iter().map(|x| *x as f32).collect(), shape),
    }
}

fn complexes(py: Python<'_>, data: Vec<Complex64>, shape: &[usize], wide: bool) -> PyResult<Py<PyAny>> {
    let narrow = |z: &Complex64| Complex32::new(z.re as f32, z.im as f32);
    match wide {
        true => array(py, data, shape),
        false => array(py, data.iter().map(narrow).collect(), shape),
    }
}

fn spectrum_array(py: Python<'_>, spectrum: AnySpectrum) -> PyResult<Py<PyAny>> {
    let shape = spectrum.shape();
    match spectrum {
        AnySpectrum::F32(s) => array(py, s.data, &shape),
        AnySpectrum::F64(s) => array(py, s.data, &shape),
    }
}

/// Returns the range transform of every chirp of one ramp, complex [chirp, channel, range].
#[pyfunction]
#[pyo3(signature = (adc, radar, ramp = 0, engine = None))]
pub fn dsp_range_transform(
    py: Python<'_>,
    adc: &Bound<'_, PyAny>,
    radar: &Bound<'_, PyAny>,
    ramp: usize,
    engine: Option<&Bound<'_, PyAny>>,
) -> PyResult<Py<PyAny>> {
    let (radar, engine) = (part(radar, ramp)?, engine::resolve(py, engine, None)?);
    let cube = cube("adc", &CUBE, adc, is_wide(&engine))?;
    match work::run(py, None, move |_| engine.range_spectrum(&radar, &cube))? {
        AnyCube::F32(c) => array(py, c.data, &[c.chirps, c.channels, c.samples]),
        AnyCube::F64(c) => array(py, c.data, &[c.chirps, c.channels, c.samples]),
    }
}

/// Returns the Doppler transform of a range spectrum, complex [doppler, channel, range].
#[pyfunction]
#[pyo3(signature = (range_spectrum, radar, ramp = 0, engine = None))]
pub fn dsp_doppler_transform(
    py: Python<'_>,
    range_spectrum: &Bound<'_, PyAny>,
    radar: &Bound<'_, PyAny>,
    ramp: usize,
    engine: Option<&Bound<'_, PyAny>>,
) -> PyResult<Py<PyAny>> {
    let (radar, engine) = (part(radar, ramp)?, engine::resolve(py, engine, None)?);
    let axes = ["chirp", "channel", "range"];
    let ranges = cube("range_spectrum", &axes, range_spectrum, is_wide(&engine))?;
    spectrum_array(py, work::run(py, None, move |_| engine.doppler_spectrum(&radar, &ranges))?)
}

/// Returns range and Doppler transform of one ramp, complex [doppler, channel, range].
#[pyfunction]
#[pyo3(signature = (adc, radar, ramp = 0, engine = None))]
pub fn dsp_range_doppler(
    py: Python<'_>,
    adc: &Bound<'_, PyAny>,
    radar: &Bound<'_, PyAny>,
    ramp: usize,
    engine: Option<&Bound<'_, PyAny>>,
) -> PyResult<Py<PyAny>> {
    let (radar, engine) = (part(radar, ramp)?, engine::resolve(py, engine, None)?);
    let cube = cube("adc", &CUBE, adc, is_wide(&engine))?;
    spectrum_array(py, work::run(py, None, move |_| engine.spectrum(&radar, &cube))?)
}

/// Returns the mean power of a spectrum over its channels in W, [doppler, range].
#[pyfunction]
#[pyo3(signature = (spectrum, radar, ramp = 0, engine = None))]
pub fn dsp_power(
    py: Python<'_>,
    spectrum: &Bound<'_, PyAny>,
    radar: &Bound<'_, PyAny>,
    ramp: usize,
    engine: Option<&Bound<'_, PyAny>>,
) -> PyResult<Py<PyAny>> {
    let (radar, engine) = (part(radar, ramp)?, engine::resolve(py, engine, None)?);
    let wide = is_wide(&engine);
    let spectrum = spectrum_of(spectrum, wide)?;
    let map = work::run(py, None, move |_| engine.power(&radar, &spectrum))?;
    reals(py, map.data, &[map.doppler_bins, map.range_bins], wide)
}

/// Settings of a detector and the number of looks (independent powers in a cell) of its map: (kind, rank, (guard, train) in cells [doppler, range],
/// false alarm probability, looks); the radar gives the values that are None.
type Detector =
    (Option<String>, Option<usize>, Option<[usize; 2]>, Option<[usize; 2]>, Option<f64>, Option<usize>);

fn missing<T>(py: Python<'_>, key: &str) -> PyResult<T> {
    let b = BadInput::new("is missing, and no radar is given that states it").key(key);
    refuse(py, b.remedy("give radar, or all of kind, guard, train, false_alarm_probability and looks"))
}

fn detector(
    py: Python<'_>,
    radar: Option<&Bound<'_, PyAny>>,
    (kind, rank, guard, train, pfa, looks): Detector,
) -> PyResult<(Cfar, usize)> {
    let radar = radar.map(|r| part(r, 0)).transpose()?;
    let own = radar.as_ref().map(|r| r.processing.cfar);
    let from = |key: &str, given: Option<[usize; 2]>, own: Option<[usize; 2]>| match given.or(own) {
        Some(cells) if cells.iter().all(|c| *c <= 4096) => Ok(cells),
        Some(cells) => {
            let b = BadInput::new("the window is too wide").key(key).value(format!("{cells:?}"));
            refuse(py, b.allowed("up to 4096 cells [doppler, range] to each side"))
        }
        None => missing(py, key),
    };
    let [guard, train] =
        [from("guard", guard, own.map(|c| c.guard))?, from("train", train, own.map(|c| c.train))?];
    let Some(pfa) = pfa.or(own.map(|c| c.pfa)) else { return missing(py, "false_alarm_probability") };
    if !FALSE_ALARM.contains(&pfa) {
        let b = BadInput::new("is out of range").key("false_alarm_probability").value(pfa);
        return refuse(py, b.allowed(format!("{:e}..={}", FALSE_ALARM.start(), FALSE_ALARM.end())));
    }
    // As a radar file has it: three quarters of the training cells.
    let sizes = [0, 1].map(|i| [2 * (guard[i] + train[i]) + 1, 2 * guard[i] + 1]);
    let cells = sizes[0][0] * sizes[1][0] - sizes[0][1] * sizes[1][1];
    let is_own = own.is_some_and(|c| c.guard == guard && c.train == train);
    let kind = match (kind.as_deref(), own.map(|c| c.kind), rank) {
        (None, None, _) => return missing(py, "kind"),
        (Some("ca"), _, None) => CfarKind::Ca,
        (Some("go"), _, None) => CfarKind::Go,
        (Some("so"), _, None) => CfarKind::So,
        (None, Some(CfarKind::Os { .. }), Some(rank)) | (Some("os"), _, Some(rank)) => CfarKind::Os { rank },
        (None | Some("os"), Some(CfarKind::Os { rank }), None) if is_own => CfarKind::Os { rank },
        (None, Some(CfarKind::Os { .. }), None) | (Some("os"), _, None) => {
            CfarKind::Os { rank: (3 * cells).div_ceil(4) }
        }
        (None, Some(kind), None) => kind,
        (None, ..) | (Some("ca" | "go" | "so"), _, Some(_)) => {
            let b = BadInput::new("only an \"os\" detector has a rank").key("rank");
            return refuse(py, b.value(rank.unwrap_or(0)).remedy("leave it out, or give kind=\"os\""));
        }
        (Some(other), ..) => {
            let b = BadInput::new("is not a kind of detector").key("kind").value(other);
            return refuse(py, b.allowed("ca, go, so, os"));
        }
    };
    let bands = |r: &Arc<Radar>| r.channels() * (r.processing.doppler_fft / r.doppler_rows().max(1));
    let Some(looks) = looks.or(radar.as_ref().map(bands)) else { return missing(py, "looks") };
    if looks == 0 {
        return refuse(py, BadInput::new("is out of range").key("looks").value(0).allowed("1 or more"));
    }
    Ok((Cfar { kind, guard, train, pfa }, looks))
}

/// Detects cells of a map; returns (mask bool [doppler, range], cells int64 [cell, 2], noise_w [cell]).
#[pyfunction]
#[pyo3(signature = (power, radar, detector, engine = None))]
pub fn dsp_cfar(
    py: Python<'_>,
    power: &Bound<'_, PyAny>,
    radar: Option<&Bound<'_, PyAny>>,
    detector: Detector,
    engine: Option<&Bound<'_, PyAny>>,
) -> PyResult<(Py<PyAny>, Py<PyAny>, Py<PyAny>)> {
    let (cfar, looks) = self::detector(py, radar, detector)?;
    let (map, engine) = (map_of(power)?, engine::resolve(py, engine, None)?);
    let shape = [map.doppler_bins, map.range_bins];
    let wide = is_wide(&engine);
    let found = work::run(py, None, move |_| engine.cells(&map, &cfar, looks))?;
    let cells = found.cells.iter().flat_map(|c| [i64::from(c.doppler), i64::from(c.range)]).collect();
    let count = found.cells.len();
    Ok((
        array(py, found.detection.mask, &shape)?,
        array::<i64>(py, cells, &[count, 2])?,
        reals(py, found.noise_w, &[count], wide)?,
    ))
}

/// Returns the detection threshold of each cell in W, [doppler, range].
#[pyfunction]
#[pyo3(signature = (power, radar, detector, engine = None))]
pub fn dsp_threshold(
    py: Python<'_>,
    power: &Bound<'_, PyAny>,
    radar: Option<&Bound<'_, PyAny>>,
    detector: Detector,
    engine: Option<&Bound<'_, PyAny>>,
) -> PyResult<Py<PyAny>> {
    let (cfar, looks) = self::detector(py, radar, detector)?;
    let (map, engine) = (map_of(power)?, engine::resolve(py, engine, None)?);
    let shape = [map.doppler_bins, map.range_bins];
    let wide = is_wide(&engine);
    let found = work::run(py, None, move |_| engine.threshold(&map, &cfar, looks))?;
    reals(py, found, &shape, wide)
}

/// Cells [cell, 2] of a map of this size.
fn cells_of(ob: &Bound<'_, PyAny>, [rows, columns]: [usize; 2]) -> PyResult<Vec<Cell>> {
    let py = ob.py();
    let numpy = py.import("numpy")?;
    let keywords = [("dtype", "int64")].into_py_dict(py)?;
    let cast = numpy.getattr("asarray")?.call((ob,), Some(&keywords))?;
    let Ok(list) = cast.extract::<PyReadonlyArray2<'_, i64>>() else {
        let b = BadInput::new("is not a list of cells").key("cells");
        return refuse(py, b.allowed("whole numbers over [cell, 2]: Doppler row, range column"));
    };
    let mut cells = Vec::new();
    for row in list.as_array().rows() {
        let is_pair = row.len() == 2;
        let inside = |i: usize, n: usize| row.get(i).is_some_and(|v| *v >= 0 && (*v as usize) < n);
        if !is_pair || !inside(0, rows) || !inside(1, columns) {
            let b = BadInput::new("the cell lies outside the map")
                .key("cells")
                .value(format!("{:?}", row.to_vec()));
            return refuse(py, b.allowed(format!("rows below {rows}, columns below {columns}")));
        }
        cells.push(Cell { doppler: row[0] as u32, range: row[1] as u32 });
    }
    Ok(cells)
}

/// Snapshots, noise, range rates and ambiguities of cells.
type CellArrays = (Py<PyAny>, Py<PyAny>, Py<PyAny>, Vec<&'static str>, Py<PyAny>);

/// Separates the transmitters of cells; returns (snapshots complex128 [cell, virtual channel], noise_w [cell], range_rate_mps [cell], ambiguity list
/// [cell], range_m [cell]).
#[pyfunction]
#[pyo3(signature = (power, cells, noise_w, snapshots, radar, ramp = 0, velocity_mps = None))]
#[allow(clippy::too_many_arguments)] // what the chain knows of a cell
pub fn dsp_separate(
    py: Python<'_>,
    power: &Bound<'_, PyAny>,
    cells: &Bound<'_, PyAny>,
    noise_w: &Bound<'_, PyAny>,
    snapshots: &Bound<'_, PyAny>,
    radar: &Bound<'_, PyAny>,
    ramp: usize,
    velocity_mps: Option<[f64; 3]>,
) -> PyResult<CellArrays> {
    let radar = part(radar, ramp)?;
    let map = map_of(power)?;
    let want = [radar.doppler_rows(), radar.range_bins()];
    if [map.doppler_bins, map.range_bins] != want {
        let b = BadInput::new("the shape of the map does not fit this radar").key("power");
        let b = b.value(format!("[{}, {}]", map.doppler_bins, map.range_bins));
        return refuse(py, b.allowed(format!("{want:?}: [doppler, range]")));
    }
    let cells = cells_of(cells, want)?;
    let looks = given::<Complex64>("snapshots", &["cell", "channel"], snapshots)?;
    let noise = given::<f64>("noise_w", &["cell"], noise_w)?.data;
    let channels = radar.channels() * (radar.processing.doppler_fft / radar.doppler_rows().max(1));
    if looks.shape != [cells.len(), channels] || noise.len() != cells.len() {
        let b = BadInput::new("each cell needs its snapshot and its noise").key("snapshots, noise_w");
        let b = b.value(format!("{:?}, [{}]", looks.shape, noise.len()));
        return refuse(py, b.allowed(format!("[{0}, {channels}], [{0}]", cells.len())));
    }
    let detection = Detection { mask: Vec::new(), ratio: Vec::new() };
    let snapshots = Snapshots { channels, data: looks.data };
    let found = RangeDoppler { map, detection, cells, noise, snapshots };
    let velocity = velocity_mps.map(DVec3::from_array);
    let all = work::run(py, None, move |_| directions::separated(&radar, &found, velocity))?;
    let count = all.noise_w.len();
    Ok((
        array(py, all.snapshots.data, &[count, all.snapshots.channels])?,
        array(py, all.noise_w, &[count])?,
        array(py, all.range_rates_mps, &[count])?,
        all.ambiguity.into_iter().map(Ambiguity::name).collect(),
        array(py, all.ranges_m, &[count])?,
    ))
}

/// Snapshots [cell, snapshot, channel], or snapshots that have the given covariances [cell, channel,
/// channel].
fn looks_of(
    py: Python<'_>,
    radar: &Radar,
    snapshots: Option<&Bound<'_, PyAny>>,
    covariance: Option<&Bound<'_, PyAny>>,
) -> PyResult<(usize, Vec<Complex64>)> {
    let of_shape = |shape: &[usize], what: &str| {
        let n = radar.virtual_channels();
        let b = BadInput::new("the array is not of this radar's virtual channels").key(what);
        let b = b.value(format!("{shape:?}")).allowed(format!("{n} channels on the last axis"));
        b.remedy("separate the transmitters first (separate), and give the radar of the snapshots")
    };
    match (snapshots, covariance) {
        (Some(s), None) => {
            let g = given::<Complex64>("snapshots", &["cell", "snapshot", "channel"], s)?;
            if g.shape[2] != radar.virtual_channels() || g.shape[1] == 0 {
                return refuse(py, of_shape(&g.shape, "snapshots"));
            }
            Ok((g.shape[1], g.data))
        }
        (None, Some(r)) => {
            let g = given::<Complex64>("covariance", &["cell", "channel", "channel"], r)?;
            let n = radar.virtual_channels();
            if g.shape[1..] != [n, n] {
                return refuse(py, of_shape(&g.shape, "covariance"));
            }
            let mut all = Vec::new();
            for one in g.data.chunks_exact(n * n) {
                all.extend(directions::snapshots_of_covariance(radar, one).or_raise(py)?);
            }
            Ok((n, all))
        }
        _ => refuse(py, BadInput::new("give either snapshots or covariance").key("snapshots, covariance")),
    }
}

fn noise_of(noise_w: Option<&Bound<'_, PyAny>>) -> PyResult<Option<Vec<f64>>> {
    noise_w.map(|n| Ok(given::<f64>("noise_w", &["cell"], n)?.data)).transpose()
}

/// Estimates directions of arrival; returns a structured array [source]: cell, azimuth_deg, elevation_deg, power_w, azimuth_std_deg,
/// elevation_std_deg, ambiguous.
#[pyfunction]
#[pyo3(signature = (snapshots, covariance, noise_w, radar, engine = None, range_m = None))]
pub fn dsp_directions(
    py: Python<'_>,
    snapshots: Option<&Bound<'_, PyAny>>,
    covariance: Option<&Bound<'_, PyAny>>,
    noise_w: Option<&Bound<'_, PyAny>>,
    radar: &Bound<'_, PyAny>,
    engine: Option<&Bound<'_, PyAny>>,
    range_m: Option<&Bound<'_, PyAny>>,
) -> PyResult<Py<PyAny>> {
    let (radar, engine) = (part(radar, 0)?, engine::resolve(py, engine, None)?);
    let ranges = range_m.map(floats).transpose()?;
    let ((looks, data), noise) = (looks_of(py, &radar, snapshots, covariance)?, noise_of(noise_w)?);
    let found = work::run(py, None, move |_| {
        let cells = Cells { snapshots: looks, data: &data, noise_w: noise.as_deref() };
        directions::directions(&engine, &radar, &cells, ranges.as_deref())
    })?;
    let all: Vec<_> =
        found.iter().enumerate().flat_map(|(i, l)| l.iter().map(move |s| (i as i64, s))).collect();
    let column = |f: fn(&catseye::dsp::doa_estimate::Source) -> f64| all.iter().map(|(_, s)| f(s)).collect();
    let table = Records::new(all.len())
        .numbers::<i64>(py, "cell", all.iter().map(|(i, _)| *i).collect(), "i8")
        .numbers::<f64>(py, "azimuth_deg", column(|s| s.azimuth_rad.to_degrees()), "f8")
        .numbers::<f64>(py, "elevation_deg", column(|s| s.elevation_rad.to_degrees()), "f8")
        .numbers::<f64>(py, "power_w", column(|s| s.power_w), "f8")
        .numbers::<f64>(py, "azimuth_std_deg", column(|s| s.azimuth_std_rad.to_degrees()), "f8")
        .numbers::<f64>(py, "elevation_std_deg", column(|s| s.elevation_std_rad.to_degrees()), "f8")
        .numbers::<bool>(py, "ambiguous", all.iter().map(|(_, s)| s.ambiguous).collect(), "?");
    Ok(table.build(py)?.unbind())
}

fn degrees(py: Python<'_>, axis: &[f64]) -> PyResult<Py<PyAny>> {
    array(py, axis.iter().map(|a| a.to_degrees()).collect(), &[axis.len()])
}

/// Returns the spectrum over angle: (values [cell, elevation, azimuth], azimuth_deg, elevation_deg).
#[pyfunction]
#[pyo3(signature = (snapshots, covariance, noise_w, radar, engine = None))]
pub fn dsp_angle_spectrum(
    py: Python<'_>,
    snapshots: Option<&Bound<'_, PyAny>>,
    covariance: Option<&Bound<'_, PyAny>>,
    noise_w: Option<&Bound<'_, PyAny>>,
    radar: &Bound<'_, PyAny>,
    engine: Option<&Bound<'_, PyAny>>,
) -> PyResult<(Py<PyAny>, Py<PyAny>, Py<PyAny>)> {
    let (radar, engine) = (part(radar, 0)?, engine::resolve(py, engine, None)?);
    let ((looks, data), noise) = (looks_of(py, &radar, snapshots, covariance)?, noise_of(noise_w)?);
    let (grid, values) = work::run(py, None, move |_| {
        let cells = Cells { snapshots: looks, data: &data, noise_w: noise.as_deref() };
        directions::spectra(&engine, &radar, &cells)
    })?;
    let count = values.len() / grid.len();
    let shape = [count, grid.elevation_rad.len(), grid.azimuth_rad.len()];
    Ok((array(py, values, &shape)?, degrees(py, &grid.azimuth_rad)?, degrees(py, &grid.elevation_rad)?))
}

/// The directions that arguments mean: None for the radar's own, a number of Fourier bins, or angles in degrees.
fn grid(
    py: Python<'_>,
    radar: &Radar,
    azimuth: Option<&Bound<'_, PyAny>>,
    elevation: Option<&Bound<'_, PyAny>>,
) -> PyResult<Grid> {
    let own = Grid::new(radar).or_raise(py)?;
    let angles = |ob: &Bound<'_, PyAny>| -> PyResult<Vec<f64>> {
        Ok(floats(ob)?.iter().map(|a| a.to_radians()).collect())
    };
    let azimuth_rad = match azimuth {
        None => own.azimuth_rad,
        Some(a) => match a.extract::<usize>() {
            Ok(bins @ 2..=65536) => tensors::fourier_azimuths(bins),
            Ok(bins) => {
                let b =
                    BadInput::new("the number of Fourier bins is out of range").key("azimuth").value(bins);
                return refuse(py, b.allowed("2 to 65536"));
            }
            Err(_) => angles(a)?,
        },
    };
    Ok(Grid { azimuth_rad, elevation_rad: elevation.map_or(Ok(own.elevation_rad), angles)? })
}

fn beam(
    py: Python<'_>,
    radar: &Radar,
    azimuth: Option<&Bound<'_, PyAny>>,
    elevation: Option<&Bound<'_, PyAny>>,
) -> PyResult<Beamformer> {
    tensors::beamformer(radar, grid(py, radar, azimuth, elevation)?).or_raise(py)
}

/// Returns the axes of a tensor with these arguments: (azimuth_deg, elevation_deg).
#[pyfunction]
#[pyo3(signature = (radar, azimuth = None, elevation = None))]
pub fn dsp_grid(
    py: Python<'_>,
    radar: &Bound<'_, PyAny>,
    azimuth: Option<&Bound<'_, PyAny>>,
    elevation: Option<&Bound<'_, PyAny>>,
) -> PyResult<(Py<PyAny>, Py<PyAny>)> {
    let g = beam(py, &*part(radar, 0)?, azimuth, elevation)?.grid;
    Ok((degrees(py, &g.azimuth_rad)?, degrees(py, &g.elevation_rad)?))
}

/// Returns powers over the axes that `keep` selects of (doppler, range, elevation, azimuth), W.
#[pyfunction]
#[pyo3(signature = (spectrum, radar, keep, reduce, ramp = 0, azimuth = None, elevation = None, engine = None))]
#[allow(clippy::too_many_arguments)] // keywords
pub fn dsp_tensor(
    py: Python<'_>,
    spectrum: &Bound<'_, PyAny>,
    radar: &Bound<'_, PyAny>,
    keep: [bool; 4],
    reduce: &str,
    ramp: usize,
    azimuth: Option<&Bound<'_, PyAny>>,
    elevation: Option<&Bound<'_, PyAny>>,
    engine: Option<&Bound<'_, PyAny>>,
) -> PyResult<Py<PyAny>> {
    let (radar, engine) = (part(radar, ramp)?, engine::resolve(py, engine, None)?);
    let wide = is_wide(&engine);
    let reduce = tensors::Reduce::parse(reduce).or_raise(py)?;
    let beam = beam(py, &radar, azimuth, elevation)?;
    let spectrum = spectrum_of(spectrum, wide)?;
    let [rows, _, columns] = spectrum.shape();
    let size = [rows, columns, beam.grid.elevation_rad.len(), beam.grid.azimuth_rad.len()];
    let found =
        work::run(py, None, move |_| tensors::powers(&engine, &radar, &spectrum, &beam, keep, reduce))?;
    let shape: Vec<usize> = (0..4).filter(|a| keep[*a]).map(|a| size[a]).collect();
    reals(py, found, &shape, wide)
}

/// Returns amplitudes over all axes, complex [doppler, range, elevation, azimuth] in sqrt(W).
#[pyfunction]
#[pyo3(signature = (spectrum, radar, ramp = 0, azimuth = None, elevation = None, engine = None))]
pub fn dsp_amplitudes(
    py: Python<'_>,
    spectrum: &Bound<'_, PyAny>,
    radar: &Bound<'_, PyAny>,
    ramp: usize,
    azimuth: Option<&Bound<'_, PyAny>>,
    elevation: Option<&Bound<'_, PyAny>>,
    engine: Option<&Bound<'_, PyAny>>,
) -> PyResult<Py<PyAny>> {
    let (radar, engine) = (part(radar, ramp)?, engine::resolve(py, engine, None)?);
    let wide = is_wide(&engine);
    let beam = beam(py, &radar, azimuth, elevation)?;
    let spectrum = spectrum_of(spectrum, wide)?;
    let [rows, _, columns] = spectrum.shape();
    let shape = [rows, columns, beam.grid.elevation_rad.len(), beam.grid.azimuth_rad.len()];
    let found = work::run(py, None, move |_| tensors::amplitudes(&engine, &radar, &spectrum, &beam))?;
    complexes(py, found, &shape, wide)
}

/// Returns amplitudes of some chirps of a range spectrum, complex [chirp, range, elevation, azimuth] in sqrt(W).
#[pyfunction]
#[pyo3(signature = (range_spectrum, radar, chirps, ramp = 0, azimuth = None, elevation = None, engine = None))]
#[allow(clippy::too_many_arguments)] // keywords
pub fn dsp_chirp_amplitudes(
    py: Python<'_>,
    range_spectrum: &Bound<'_, PyAny>,
    radar: &Bound<'_, PyAny>,
    chirps: Vec<usize>,
    ramp: usize,
    azimuth: Option<&Bound<'_, PyAny>>,
    elevation: Option<&Bound<'_, PyAny>>,
    engine: Option<&Bound<'_, PyAny>>,
) -> PyResult<Py<PyAny>> {
    let (radar, engine) = (part(radar, ramp)?, engine::resolve(py, engine, None)?);
    let wide = is_wide(&engine);
    let beam = beam(py, &radar, azimuth, elevation)?;
    let ranges = cube("range_spectrum", &["chirp", "channel", "range"], range_spectrum, wide)?;
    let size = [chirps.len(), radar.range_bins(), beam.grid.elevation_rad.len(), beam.grid.azimuth_rad.len()];
    let found =
        work::run(py, None, move |_| tensors::chirp_amplitudes(&engine, &radar, &ranges, &beam, &chirps))?;
    complexes(py, found, &size, wide)
}

/// Returns indices into the flat array of the strongest share of cells, strongest first, int64 [cell].
#[pyfunction]
pub fn dsp_strongest(py: Python<'_>, tensor: &Bound<'_, PyAny>, share: f64) -> PyResult<Py<PyAny>> {
    let found = match tensor.extract::<PyReadonlyArray1<'_, f32>>() {
        Ok(narrow) => {
            let data = narrow.as_array().to_vec();
            work::run(py, None, move |_| tensors::strongest(&data, share))?
        }
        Err(_) => {
            let data = given::<f64>("tensor", &["cell"], tensor)?.data;
            work::run(py, None, move |_| tensors::strongest(&data, share))?
        }
    };
    let count = found.len();
    array::<i64>(py, found.into_iter().map(|i| i as i64).collect(), &[count])
}

/// Rows [object, 16] of numbers: middle, size, rotation x, y, z, w, velocity and turn rate.
fn bodies(classes: &Bound<'_, PyAny>, rows: &Bound<'_, PyAny>) -> PyResult<Vec<SeenBody>> {
    let py = rows.py();
    let g = given::<f64>("objects", &["object", "number"], rows)?;
    let classes: PyReadonlyArray1<'_, i64> = classes.extract()?;
    let classes = classes.as_array();
    if g.shape[1] != 16 || classes.len() != g.shape[0] {
        let b = BadInput::new("the array is not a table of objects").key("objects");
        return refuse(py, b.value(format!("{:?}", g.shape)).remedy("give the result of dsp.objects"));
    }
    let vector = |r: &[f64]| DVec3::new(r[0], r[1], r[2]);
    let body = |(class, r): (&i64, &[f64])| SeenBody {
        class: (*class).max(0) as usize,
        centre_m: vector(r),
        size_m: vector(&r[3..]),
        rotation: DQuat::from_xyzw(r[6], r[7], r[8], r[9]),
        velocity_mps: vector(&r[10..]),
        spin_rad_per_s: vector(&r[13..]),
    };
    Ok(classes.iter().zip(g.data.chunks_exact(16)).map(body).collect())
}

/// Converts rows of world objects to the sensor's frame. Returns rows [object, 19]: the numbers of the argument in the sensor's frame, then yaw in
/// degrees, range and range rate.
#[pyfunction]
pub fn dsp_seen(
    py: Python<'_>,
    classes: &Bound<'_, PyAny>,
    rows: &Bound<'_, PyAny>,
    position_m: [f64; 3],
    rotation_xyzw: [f64; 4],
    velocity_mps: [f64; 3],
) -> PyResult<Py<PyAny>> {
    let radar = Pose::new(DQuat::from_array(rotation_xyzw), DVec3::from_array(position_m));
    let all = bodies(classes, rows)?;
    let count = all.len();
    let row = |b: SeenBody| {
        let s = b.of_world(&radar, DVec3::from_array(velocity_mps));
        let ahead = s.rotation * DVec3::X;
        let (range, rate) = s.range_and_rate();
        let mut row = Vec::with_capacity(19);
        row.extend(s.centre_m.to_array());
        row.extend(s.size_m.to_array());
        row.extend(s.rotation.to_array());
        row.extend(s.velocity_mps.to_array());
        row.extend(s.spin_rad_per_s.to_array());
        row.extend([ahead.y.atan2(ahead.x).to_degrees(), range, rate]);
        row
    };
    array(py, all.into_iter().flat_map(row).collect(), &[count, 19])
}

fn view(
    py: Python<'_>,
    radar: &Bound<'_, PyAny>,
    ramp: usize,
    azimuth: Option<&Bound<'_, PyAny>>,
) -> PyResult<View> {
    let radar = part(radar, ramp)?;
    View::new(&radar, &grid(py, &radar, azimuth, None)?.azimuth_rad).or_raise(py)
}

/// Returns the class masks (uint8 [range, azimuth], uint8 [doppler, range], uint8 [azimuth, doppler]).
#[pyfunction]
#[pyo3(signature = (classes, rows, radar, ramp = 0, azimuth = None))]
pub fn dsp_masks(
    py: Python<'_>,
    classes: &Bound<'_, PyAny>,
    rows: &Bound<'_, PyAny>,
    radar: &Bound<'_, PyAny>,
    ramp: usize,
    azimuth: Option<&Bound<'_, PyAny>>,
) -> PyResult<(Py<PyAny>, Py<PyAny>, Py<PyAny>)> {
    let (view, all) = (view(py, radar, ramp, azimuth)?, bodies(classes, rows)?);
    let [ranges, dopplers, azimuths] = view.size();
    let found = work::run(py, None, move |_| masks(&view, &all))?;
    Ok((
        array(py, found.range_azimuth, &[ranges, azimuths])?,
        array(py, found.range_doppler, &[dopplers, ranges])?,
        array(py, found.angle_doppler, &[azimuths, dopplers])?,
    ))
}

/// Returns confidence maps, float32 [class, range, azimuth].
#[pyfunction]
#[pyo3(signature = (classes, rows, count, sigma_m, radar, ramp = 0, azimuth = None))]
#[allow(clippy::too_many_arguments)] // keywords
pub fn dsp_confidence(
    py: Python<'_>,
    classes: &Bound<'_, PyAny>,
    rows: &Bound<'_, PyAny>,
    count: usize,
    sigma_m: &Bound<'_, PyAny>,
    radar: &Bound<'_, PyAny>,
    ramp: usize,
    azimuth: Option<&Bound<'_, PyAny>>,
) -> PyResult<Py<PyAny>> {
    let (view, all) = (view(py, radar, ramp, azimuth)?, bodies(classes, rows)?);
    let sigma = given::<f64>("sigma_m", &["object"], sigma_m)?.data;
    let [ranges, _, azimuths] = view.size();
    let found = work::run(py, None, move |_| confidence(&view, &all, count, &sigma))?;
    array(py, found, &[count, ranges, azimuths])
}

/// Returns Doppler row, range column and azimuth column of the middle of each object, -1 where it is outside, int64 [object, 3].
#[pyfunction]
#[pyo3(signature = (classes, rows, radar, ramp = 0, azimuth = None))]
pub fn dsp_object_cells(
    py: Python<'_>,
    classes: &Bound<'_, PyAny>,
    rows: &Bound<'_, PyAny>,
    radar: &Bound<'_, PyAny>,
    ramp: usize,
    azimuth: Option<&Bound<'_, PyAny>>,
) -> PyResult<Py<PyAny>> {
    let (view, all) = (view(py, radar, ramp, azimuth)?, bodies(classes, rows)?);
    let place = |at: Option<usize>| at.map_or(-1, |i| i as i64);
    let cells = all.iter().flat_map(|b| {
        let cell = view.cell(b.centre_m, b.velocity_mps);
        [cell.doppler as i64, place(cell.range), place(cell.azimuth)]
    });
    let data: Vec<i64> = cells.collect();
    array(py, data, &[all.len(), 3])
}
