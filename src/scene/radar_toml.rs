//! The radar TOML: what the keys are, their checks, the presets, and writing a radar back.

use super::front_end::{self, FrontEndSettings, FrontEndTable, JitterTable};
use super::radar::{
    AngleMethod, AngleSettings, Antenna, CalibrationFile, Cfar, CfarKind, Pattern, Polarisation, Processing,
    Radar, Sources, Window,
};

use super::toml_file::{At, Document, clip, read_beside, read_text};
use super::waveform::{Multiplex, Waveform};
use super::waveform_toml::{self, ReceiverTable, WaveformTable};
use crate::base::error::{BadInput, Error, Result, nearest};
use crate::base::frames::{Pose, Sensor, Vehicle};
use crate::formats::csv::Table;
use glam::{DVec3, EulerRot};
use num_complex::Complex64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_1_SQRT_2;
use std::ops::{Range, RangeInclusive};
use std::path::Path;

/// A radar file. Lengths are in metres, times in seconds, angles in degrees.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "catseye radar")]
pub struct RadarFile {
    /// Name of the radar, shown in results.
    pub name: String,
    /// Transmitted waveform.
    pub waveform: WaveformTable,
    /// Sampling of the received signal.
    pub receiver: ReceiverTable,
    /// Transmit power.
    pub transmitter: TransmitterTable,
    /// Front-end impairments; default an ideal front end.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub front_end: Option<FrontEndTable>,
    /// Default properties of all antennas; a `[[tx]]` or `[[rx]]` table may override them.
    #[serde(default)]
    pub antenna: AntennaTable,
    /// Transmit antennas, in the order in which they transmit.
    #[schemars(length(min = 1, max = 1024))]
    pub tx: Vec<ElementTable>,
    /// Receive antennas.
    #[schemars(length(min = 1, max = 1024))]
    pub rx: Vec<ElementTable>,
    /// Pose of the radar on the vehicle.
    #[serde(default)]
    pub mounting: MountingTable,
    /// Signal processing of the samples.
    #[serde(default)]
    pub processing: ProcessingTable,
}

/// Transmit power.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TransmitterTable {
    /// Power of one transmitter at its antenna input, dBm.
    #[schemars(range(min = -100.0, max = 100.0))]
    pub power_dbm: f64,
}

/// Antenna pattern.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum PatternName {
    /// The same gain in all directions.
    Isotropic,
    /// Power cos(azimuth)^azimuth_exponent cos(elevation)^elevation_exponent, zero in the rear hemisphere.
    CosinePower,
    /// A table, from a CSV file (`table_file`) or from the three `table_…` lists.
    Table,
}

/// Antenna properties; all keys are optional.
#[derive(Debug, Clone, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AntennaTable {
    /// Polarisation: V, H, +45, -45, RHCP or LHCP (default V).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub polarisation: Option<At<String>>,
    /// Peak gain, dBi; default 0, and for a table its largest value.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -100.0, max = 100.0))]
    pub gain_dbi: Option<f64>,
    /// Antenna pattern; default "isotropic".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pattern: Option<At<PatternName>>,
    /// Exponent of the cosine pattern over azimuth.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 10_000.0))]
    pub azimuth_exponent: Option<At<f64>>,
    /// Exponent of the cosine pattern over elevation.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 10_000.0))]
    pub elevation_exponent: Option<At<f64>>,
    /// CSV file, relative to the radar file, with the header azimuth_deg,elevation_deg,gain_db and one row
    /// for each point of a full grid. The gain is interpolated bilinearly; its largest value is the peak
    /// gain.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub table_file: Option<At<String>>,
    /// Azimuths of the pattern's columns, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 1), inner(range(min = -180.0, max = 180.0)))]
    pub table_azimuth_deg: Option<At<Vec<f64>>>,
    /// Elevations of the pattern's rows, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 1), inner(range(min = -90.0, max = 90.0)))]
    pub table_elevation_deg: Option<At<Vec<f64>>>,
    /// Gains of the pattern, dB, row by row: azimuth varies fastest.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 1), inner(range(min = -500.0, max = 500.0)))]
    pub table_gain_db: Option<At<Vec<f64>>>,
}

/// One transmit or receive antenna; missing keys are taken from `[antenna]`.
#[derive(Debug, Clone, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ElementTable {
    /// Position of the phase centre, [forward, left, up] from the radar's phase centre, m; alternative to
    /// `position_half_wavelengths`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_m: Option<At<[f64; 3]>>,
    /// The same position in half wavelengths at `carrier_hz`; alternative to `position_m`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_half_wavelengths: Option<At<[f64; 3]>>,
    /// Polarisation, as in `[antenna]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub polarisation: Option<At<String>>,
    /// Peak gain, dBi.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -100.0, max = 100.0))]
    pub gain_dbi: Option<f64>,
    /// Antenna pattern.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pattern: Option<At<PatternName>>,
    /// Exponent of the cosine pattern over azimuth.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 10_000.0))]
    pub azimuth_exponent: Option<At<f64>>,
    /// Exponent of the cosine pattern over elevation.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 10_000.0))]
    pub elevation_exponent: Option<At<f64>>,
    /// CSV file of the pattern, as in `[antenna]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub table_file: Option<At<String>>,
    /// Azimuths of the pattern's columns, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 1), inner(range(min = -180.0, max = 180.0)))]
    pub table_azimuth_deg: Option<At<Vec<f64>>>,
    /// Elevations of the pattern's rows, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 1), inner(range(min = -90.0, max = 90.0)))]
    pub table_elevation_deg: Option<At<Vec<f64>>>,
    /// Gains of the pattern, dB, row by row: azimuth varies fastest.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 1), inner(range(min = -500.0, max = 500.0)))]
    pub table_gain_db: Option<At<Vec<f64>>>,
}

/// Pose of the radar on the vehicle, relative to the rear-axle centre at the height that `ego.position_m`
/// gives (default 0, so that heights are above the road).
#[derive(Debug, Clone, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MountingTable {
    /// Position of the radar, [forward, left, up] from the rear-axle centre, m.
    #[serde(default)]
    pub position_m: At<[f64; 3]>,
    /// Yaw of the radar, degrees, positive to the left.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub yaw_deg: f64,
    /// Pitch of the radar, degrees, positive nose down.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub pitch_deg: f64,
    /// Roll of the radar, degrees, positive left side up.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub roll_deg: f64,
}

/// Name of a window without parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum WindowName {
    /// Rectangular, that is, no window.
    Rectangle,
    /// Hann window.
    Hann,
    /// Hamming window.
    Hamming,
    /// Blackman window.
    Blackman,
    /// Dolph-Chebyshev window.
    DolphChebyshev,
}

/// A window with its parameters.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WindowTable {
    /// Name of the window.
    pub kind: At<WindowName>,
    /// Side-lobe attenuation below the peak, dB; required by dolph-chebyshev and only allowed there.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 20.0, max = 200.0))]
    pub side_lobe_db: Option<At<f64>>,
}

impl From<WindowName> for WindowTable {
    fn from(kind: WindowName) -> Self {
        WindowTable { kind: kind.into(), side_lobe_db: None }
    }
}

/// Signal processing of the samples; all keys are optional.
#[derive(Debug, Clone, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProcessingTable {
    /// Window along range; default Hann.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range_window: Option<WindowTable>,
    /// Window along Doppler; default Hann.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub doppler_window: Option<WindowTable>,
    /// Window over the virtual array; default Hann.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angle_window: Option<WindowTable>,
    /// Length of the range FFT, at least the number of lines of a chirp, which equals the number of samples
    /// except for pulses and codes (default: the next power of two).
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = 262_144))]
    pub range_fft: Option<At<usize>>,
    /// Length of the Doppler FFT, at least `chirps` (default: the next power of two).
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = 262_144))]
    pub doppler_fft: Option<At<usize>>,
    /// Number of beams from -azimuth_max_deg to azimuth_max_deg; default 64.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 65_536))]
    pub azimuth_bins: Option<usize>,
    /// Maximum azimuth of a beam, degrees; default 60.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = 90.0), extend("exclusiveMinimum" = 0.0))]
    pub azimuth_max_deg: Option<f64>,
    /// Number of beams in elevation; default 1: elevation is not estimated.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 65_536))]
    pub elevation_bins: Option<usize>,
    /// Maximum elevation of a beam, degrees; default 20.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = 90.0), extend("exclusiveMinimum" = 0.0))]
    pub elevation_max_deg: Option<f64>,
    /// Maximum number of points in a frame; the strongest are kept; default 4096.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 10_000_000))]
    pub max_points: Option<usize>,
    /// true: the mean over the chirps is subtracted, which removes targets without range rate; default false.
    #[serde(default, skip_serializing_if = "is_false")]
    pub remove_static: bool,
    /// Correction of range migration, that is, of targets that move through range cells during the frame; default "none".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range_migration: Option<At<MigrationName>>,
    /// "keystone": largest range rate for which range migration is corrected, m/s, also in ambiguity
    /// intervals other than the first. Each interval costs one more transform of the frame. Default 0: the
    /// first interval alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 200.0))]
    pub range_migration_max_mps: Option<At<f64>>,
    /// Number of range cells within which a peak is merged with a stronger one; default 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = 4096))]
    pub group_range_cells: Option<usize>,
    /// Number of Doppler cells within which a peak is merged with a stronger one; default 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = 4096))]
    pub group_doppler_cells: Option<usize>,
    /// Angle estimation (direction of arrival).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angle: Option<AngleTable>,
    /// CFAR detector.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cfar: Option<CfarTable>,
}

/// Most Doppler folds for which targets are held in their range cells.
const MOST_FOLDS: usize = 31;

/// Correction of range migration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MigrationName {
    /// No correction.
    None,
    /// The keystone transform keeps each target in its range cell at the middle of the frame.
    Keystone,
}

fn is_false(x: &bool) -> bool {
    !x
}

/// Angle estimation (direction of arrival).
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AngleTable {
    /// Angle estimation method.
    pub method: At<AngleMethod>,
    /// Number of sources in a cell, or the criterion that estimates it: "mdl", "aic" or "residual" (default:
    /// sources are added until only noise remains).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sources: Option<At<SourcesTable>>,
    /// Maximum number of sources in a cell; default 3.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 64))]
    pub max_sources: Option<usize>,
    /// Rows and columns of the subarrays for spatial smoothing; default chosen from the array.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub subarray: Option<At<[usize; 2]>>,
    /// true: forward-backward averaging; default true where there are subarrays.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub forward_backward: Option<bool>,
    /// "bi-svd": forgetting factor of the subspace tracker; default 0.9.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.01, max = 1.0))]
    pub forgetting: Option<At<f64>>,
    /// File of measured steering vectors (`catseye calibrate` writes one), relative to the radar file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub calibration_file: Option<At<String>>,
}

/// Number of sources in a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum SourcesTable {
    /// A fixed number.
    Given(usize),
    /// A criterion that estimates the number.
    By(SourcesName),
}

/// Criteria that estimate the number of sources.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum SourcesName {
    /// Minimum description length.
    Mdl,
    /// Akaike's information criterion.
    Aic,
    /// Residual power: sources are added until the residual is noise.
    Residual,
}

/// CFAR statistic of the training cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum CfarName {
    /// CA-CFAR: mean of the training cells.
    Ca,
    /// GO-CFAR: larger of the means of the leading and lagging training cells.
    Go,
    /// SO-CFAR: smaller of these two means.
    So,
    /// OS-CFAR: the `rank`-th smallest training cell.
    Os,
}

/// Probabilities of false alarm for which a detector computes its threshold.
pub const FALSE_ALARM: RangeInclusive<f64> = 1e-12..=0.5;

/// CFAR detector. A one-dimensional detector along range has no guard and training cells in Doppler.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CfarTable {
    /// CFAR statistic of the training cells.
    pub kind: At<CfarName>,
    /// "os": rank of the training cell that is used, from 1 for the smallest; default three quarters of their number.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1))]
    pub rank: Option<At<usize>>,
    /// Number of guard cells in range on each side.
    #[serde(default)]
    #[schemars(range(max = 4096))]
    pub guard_range_cells: usize,
    /// Number of guard cells in Doppler on each side.
    #[serde(default)]
    #[schemars(range(max = 4096))]
    pub guard_doppler_cells: usize,
    /// Number of training cells in range on each side, outside the guard cells.
    #[serde(default)]
    #[schemars(range(max = 4096))]
    pub train_range_cells: At<usize>,
    /// Number of training cells in Doppler on each side, outside the guard cells.
    #[serde(default)]
    #[schemars(range(max = 4096))]
    pub train_doppler_cells: At<usize>,
    /// Probability of false alarm in a cell that contains only noise.
    #[schemars(range(min = *FALSE_ALARM.start(), max = *FALSE_ALARM.end()))]
    pub false_alarm_probability: f64,
}

/// Built-in radars: name and TOML text.
pub const PRESETS: [(&str, &str); 15] = [
    ("feng77", include_str!("../../scenes/presets/feng77.toml")),
    ("front77", include_str!("../../scenes/presets/front77.toml")),
    ("demo77", include_str!("../../scenes/presets/demo77.toml")),
    ("fmcw76", include_str!("../../scenes/presets/fmcw76.toml")),
    ("uwb9", include_str!("../../scenes/presets/uwb9.toml")),
    ("awr1843", include_str!("../../scenes/presets/awr1843.toml")),
    ("iwr6843", include_str!("../../scenes/presets/iwr6843.toml")),
    ("iwr6843aop", include_str!("../../scenes/presets/iwr6843aop.toml")),
    ("cascade77", include_str!("../../scenes/presets/cascade77.toml")),
    ("ars408-far", include_str!("../../scenes/presets/ars408-far.toml")),
    ("ars408-near", include_str!("../../scenes/presets/ars408-near.toml")),
    ("lrr77", include_str!("../../scenes/presets/lrr77.toml")),
    ("lrr77-bursts", include_str!("../../scenes/presets/lrr77-bursts.toml")),
    ("corner77", include_str!("../../scenes/presets/corner77.toml")),
    ("imaging77", include_str!("../../scenes/presets/imaging77.toml")),
];

/// The built-in radar of that name.
///
/// # Errors
/// Returns an error for an unknown name, with the nearest.
pub fn preset(name: &str) -> Result<Radar> {
    match PRESETS.iter().find(|(n, _)| *n == name) {
        Some((_, text)) => parse(Path::new(&format!("{name}.toml")), text),
        None => Err(unknown_preset(name).into()),
    }
}

fn unknown_preset(name: &str) -> BadInput {
    let names = || PRESETS.iter().map(|(n, _)| *n);
    let b = BadInput::new("is neither a preset nor a radar file")
        .value(clip(name))
        .allowed(format!("{}, or the path of a .toml file", names().collect::<Vec<_>>().join(", ")));
    match nearest(name, names()) {
        Some(n) => b.remedy(format!("did you mean '{n}'?")),
        None => b.remedy("catseye init radar writes a file to start from"),
    }
}

/// A preset by name, else the radar of a TOML file; a relative path is taken from `folder`.
///
/// # Errors
/// Returns an error for the first value that is missing, unknown or outside its range, with file, line, key and remedy.
pub fn load(name_or_path: &str, folder: &Path) -> Result<Radar> {
    if PRESETS.iter().any(|(n, _)| *n == name_or_path) {
        return preset(name_or_path);
    }
    let path = folder.join(name_or_path);
    if !name_or_path.ends_with(".toml") && !path.exists() {
        return Err(unknown_preset(name_or_path).into());
    }
    parse(&path, &read_text(&path)?)
}

/// The radar that the value at `span` of another file names.
///
/// # Errors
/// Returns an error that names the place in `doc` for an unknown preset or a missing file, and the errors of [`load`].
pub fn named(doc: &Document<'_>, name: &str, span: &Range<usize>) -> Result<Radar> {
    let folder = doc.file().parent().unwrap_or(Path::new(""));
    if name.ends_with(".toml") {
        doc.existing(span, &folder.join(name))?;
    }
    load(name, folder).map_err(|e| match e {
        Error::Input(b) if b.file.is_none() => b.placed(doc.bad(span, "")).into(),
        e => e,
    })
}

/// The radar of a TOML text; `file` is named in errors, and pattern tables are looked for beside it.
///
/// # Errors
/// Returns an error for the first value that is missing, unknown or outside its range, with file, line, key and remedy.
pub fn parse(file: &Path, text: &str) -> Result<Radar> {
    let doc = Document::parse(file, text)?;
    let table: RadarFile = doc.read()?;
    build(&doc, &table)
}

/// Checks a radar that was read as part of `doc`.
///
/// # Errors
/// Returns an error for the first value that is missing, unknown or outside its range, with file, line, key and remedy.
pub fn build(doc: &Document<'_>, f: &RadarFile) -> Result<Radar> {
    let w = &f.waveform;
    let r = &f.receiver;
    let (carrier_hz, chirps, samples) = (w.carrier_hz.value, w.chirps.value, r.samples.value);
    let tx = elements(doc, &f.tx, f, "tx", carrier_hz)?;
    let rx = elements(doc, &f.rx, f, "rx", carrier_hz)?;
    let front_end = match &f.front_end {
        Some(t) => front_end::build(doc, t, tx.len() * rx.len())?,
        None => FrontEndSettings::default(),
    };
    let (waveform, multiplex) = waveform_toml::build(doc, w, r, tx.len())?;
    check_front_end(doc, f, &waveform, multiplex)?;
    let mut radar = Radar {
        name: f.name.clone(),
        carrier_hz,
        waveform,
        multiplex,
        adc_start_s: r.adc_start_s,
        sample_rate_hz: r.sample_rate_hz.value,
        samples,
        chirps,
        sampling: r.sampling,
        tx,
        rx,
        tx_power_dbm: f.transmitter.power_dbm,
        noise_figure_db: r.noise_figure_db,
        thermal_noise: r.thermal_noise,
        front_end,
        mounting: mounting(doc, &f.mounting)?,
        motion: None,
        processing: Processing {
            range_window: Window::Hann,
            doppler_window: Window::Hann,
            angle_window: Window::Hann,
            range_fft: samples.next_power_of_two(),
            doppler_fft: chirps.next_power_of_two(),
            azimuth_bins: 64,
            azimuth_fov_rad: 60f64.to_radians(),
            elevation_bins: 1,
            elevation_fov_rad: 0.0,
            angle: AngleSettings::default(),
            remove_static: false,
            keystone: false,
            migration_max_mps: 0.0,
            group: [0; 2],
            cfar: Cfar { kind: CfarKind::Ca, guard: [0; 2], train: [0; 2], pfa: 1e-4 },
            max_points: 4096,
        },
    };
    processing(doc, &f.processing, &mut radar)?;
    Ok(radar)
}

/// Returns an error for effects that are modelled for ramps alone, with another waveform, and for leakage where
/// transmitters send at once.
fn check_front_end(
    doc: &Document<'_>,
    f: &RadarFile,
    waveform: &Waveform,
    multiplex: Multiplex,
) -> Result<()> {
    let Some(t) = &f.front_end else { return Ok(()) };
    let of_ramps = [
        ("phase_noise", t.phase_noise.as_ref().map(|p| &p.span)),
        ("leakage", t.leakage.as_ref().map(|l| &l.span)),
        ("bumper", t.bumper.as_ref().map(|b| &b.span)),
        ("high_pass", t.high_pass.as_ref().map(|h| &h.span)),
        ("low_pass", t.low_pass.as_ref().map(|l| &l.span)),
        ("jitter", t.jitter.as_ref().filter(|j| j.value != JitterTable::default()).map(|j| &j.span)),
    ];
    for (i, (key, span)) in of_ramps.into_iter().enumerate() {
        let Some(span) = span else { continue };
        if !matches!(waveform, Waveform::Fmcw(_)) {
            return Err(doc
                .bad(span, format!("front_end.{key} is modelled only for linear ramps"))
                .allowed("waveform.kind = \"fmcw\"")
                .remedy("remove it")
                .into());
        }
        if multiplex != Multiplex::Tdm && (1..=2).contains(&i) {
            return Err(doc
                .bad(span, format!("front_end.{key} is modelled only for TDM transmitters"))
                .allowed("waveform.multiplex = \"tdm\"")
                .remedy("remove it")
                .into());
        }
    }
    Ok(())
}

/// Pose of the radar on the vehicle.
///
/// # Errors
/// Returns an error for the first value that is missing, unknown or outside its range, with file, line, key and remedy.
pub fn mounting(doc: &Document<'_>, m: &MountingTable) -> Result<Pose<Sensor, Vehicle>> {
    let [yaw, pitch, roll] = [m.yaw_deg, m.pitch_deg, m.roll_deg].map(f64::to_radians);
    Ok(Pose::from_yaw_pitch_roll(doc.vector(&m.position_m)?, yaw, pitch, roll))
}

/// Checks a processing that was read as part of `doc`, and gives it to a radar.
pub(super) fn processing(doc: &Document<'_>, f: &ProcessingTable, radar: &mut Radar) -> Result<()> {
    let window = |t: &Option<WindowTable>| -> Result<Window> {
        let Some(t) = t else { return Ok(Window::Hann) };
        if let Some(s) = &t.side_lobe_db
            && t.kind.value != WindowName::DolphChebyshev
        {
            return Err(doc
                .bad(&s.span, "only a dolph-chebyshev window has a side-lobe level")
                .remedy("remove it or set kind = \"dolph-chebyshev\"")
                .into());
        }
        Ok(match t.kind.value {
            WindowName::Rectangle => Window::Rectangle,
            WindowName::Hann => Window::Hann,
            WindowName::Hamming => Window::Hamming,
            WindowName::Blackman => Window::Blackman,
            WindowName::DolphChebyshev => {
                let s = t.side_lobe_db.as_ref().ok_or_else(|| {
                    doc.bad(&t.kind.span, "a dolph-chebyshev window needs its side-lobe level")
                        .remedy("add side_lobe_db, as in 80")
                })?;
                Window::DolphChebyshev { side_lobe_db: s.value }
            }
        })
    };
    let fft = |t: &Option<At<usize>>, at_least: usize, of: &str| -> Result<usize> {
        match t {
            None => Ok(at_least.next_power_of_two()),
            Some(t) if t.value < at_least => {
                let allowed = format!("{of} = {at_least} or more");
                Err(doc.bad(&t.span, "is out of range").allowed(allowed).into())
            }
            Some(t) => Ok(t.value),
        }
    };
    let lines = radar.lines().count;
    let p = &mut radar.processing;
    p.range_window = window(&f.range_window)?;
    p.doppler_window = window(&f.doppler_window)?;
    p.angle_window = window(&f.angle_window)?;
    p.range_fft = fft(&f.range_fft, lines, "the lines of a chirp")?;
    p.doppler_fft = fft(&f.doppler_fft, radar.chirps, "chirps")?;
    if let Multiplex::Ddm { bands } = radar.multiplex
        && !p.doppler_fft.is_multiple_of(bands)
    {
        p.doppler_fft = match &f.doppler_fft {
            None => radar.chirps,
            Some(t) => {
                return Err(doc
                    .bad(&t.span, format!("is not a multiple of the {bands} Doppler bands"))
                    .allowed(format!("a multiple of {bands}"))
                    .into());
            }
        };
    }
    p.azimuth_bins = f.azimuth_bins.unwrap_or(64);
    p.azimuth_fov_rad = f.azimuth_max_deg.unwrap_or(60.0).to_radians();
    p.elevation_bins = f.elevation_bins.unwrap_or(1);
    let elevation = f.elevation_max_deg.unwrap_or(20.0).to_radians();
    p.elevation_fov_rad = if p.elevation_bins == 1 { 0.0 } else { elevation };
    p.max_points = f.max_points.unwrap_or(4096);
    if let Some(t) = &f.angle {
        p.angle = angle(doc, t)?;
    }
    p.remove_static = f.remove_static;
    p.keystone = f.range_migration.as_ref().is_some_and(|m| m.value == MigrationName::Keystone);
    p.migration_max_mps = match &f.range_migration_max_mps {
        None => 0.0,
        Some(t) if !p.keystone => {
            return Err(doc
                .bad(&t.span, "applies only to the keystone transform")
                .remedy("add range_migration = \"keystone\"")
                .into());
        }
        Some(t) => t.value,
    };
    p.group = [f.group_doppler_cells, f.group_range_cells].map(Option::unwrap_or_default);
    let folds = radar.migration_ambiguities().count();
    if let Some(t) = f.range_migration_max_mps.as_ref().filter(|_| folds > MOST_FOLDS) {
        let most = MOST_FOLDS as f64 * radar.max_velocity_mps();
        return Err(doc
            .bad(&t.span, format!("covers {folds} Doppler ambiguity intervals"))
            .allowed(format!("up to {most:.1} m/s, or {MOST_FOLDS} intervals"))
            .into());
    }
    let (doppler_bins, range_bins) = (radar.doppler_rows(), radar.range_bins());
    radar.processing.cfar = match &f.cfar {
        Some(c) => cfar(doc, c, doppler_bins, range_bins)?,
        None => default_cfar(doppler_bins, range_bins),
    };
    Ok(())
}

fn angle(doc: &Document<'_>, t: &AngleTable) -> Result<AngleSettings> {
    let default = AngleSettings::default();
    let sources = match &t.sources {
        None => default.sources,
        Some(s) => match s.value {
            SourcesTable::Given(n) if (1..=64).contains(&n) => Sources::Given(n),
            SourcesTable::Given(_) => {
                return Err(doc
                    .bad(&s.span, "is out of range")
                    .allowed("1..=64, \"mdl\", \"aic\", \"residual\"")
                    .remedy("give the number of sources in one cell")
                    .into());
            }
            SourcesTable::By(SourcesName::Mdl) => Sources::Mdl,
            SourcesTable::By(SourcesName::Aic) => Sources::Aic,
            SourcesTable::By(SourcesName::Residual) => Sources::Residual,
        },
    };
    let bi_svd = t.method.value == AngleMethod::BiSvd;
    let forgetting = match &t.forgetting {
        Some(a) if !bi_svd => {
            return Err(doc
                .bad(&a.span, "only bi-svd has a forgetting factor")
                .remedy("remove it or set method = \"bi-svd\"")
                .into());
        }
        Some(a) => a.value,
        None => default.forgetting,
    };
    if let Some(s) = &t.subarray
        && s.value.contains(&0)
    {
        return Err(doc.bad(&s.span, "a subarray has no elements").allowed("[1, 2] or more").into());
    }
    let calibration = match &t.calibration_file {
        None => None,
        Some(name) => {
            let (path, text) = read_beside(doc, name)?;
            Some(CalibrationFile { path, text })
        }
    };
    Ok(AngleSettings {
        method: t.method.value,
        sources,
        max_sources: t.max_sources.unwrap_or(default.max_sources),
        subarray: t.subarray.as_ref().map(|s| s.value),
        forward_backward: t.forward_backward,
        forgetting,
        calibration,
    })
}

fn angle_table(a: &AngleSettings) -> AngleTable {
    AngleTable {
        method: a.method.into(),
        sources: Some(
            match a.sources {
                Sources::Given(n) => SourcesTable::Given(n),
                Sources::Mdl => SourcesTable::By(SourcesName::Mdl),
                Sources::Aic => SourcesTable::By(SourcesName::Aic),
                Sources::Residual => SourcesTable::By(SourcesName::Residual),
            }
            .into(),
        ),
        max_sources: Some(a.max_sources),
        subarray: a.subarray.map(At::from),
        forward_backward: a.forward_backward,
        forgetting: (a.method == AngleMethod::BiSvd).then(|| a.forgetting.into()),
        calibration_file: a
            .calibration
            .as_ref()
            .and_then(|c| c.path.file_name().map(|n| n.to_string_lossy().into_owned().into())),
    }
}

/// Cell averaging over up to 8 x 4 cells each side, shrunk until it fits a small map.
fn default_cfar(doppler_bins: usize, range_bins: usize) -> Cfar {
    let fit = |bins: usize, guard: usize, train: usize| {
        let room = bins.saturating_sub(1) / 2;
        let g = guard.min(room / 2);
        (g, train.min(room - g))
    };
    let (gd, td) = fit(doppler_bins, 2, 8);
    let (gr, tr) = fit(range_bins, 1, 4);
    Cfar { kind: CfarKind::Ca, guard: [gd, gr], train: [td, tr], pfa: 1e-5 }
}

fn cfar(doc: &Document<'_>, c: &CfarTable, doppler_bins: usize, range_bins: usize) -> Result<Cfar> {
    let guard = [c.guard_doppler_cells, c.guard_range_cells];
    let train = [c.train_doppler_cells.value, c.train_range_cells.value];
    let window = [2 * (guard[0] + train[0]) + 1, 2 * (guard[1] + train[1]) + 1];
    for (i, (bins, axis, at)) in
        [(doppler_bins, "Doppler", &c.train_doppler_cells), (range_bins, "range", &c.train_range_cells)]
            .into_iter()
            .enumerate()
    {
        if window[i] > bins {
            return Err(doc
                .bad(
                    if at.span.is_empty() { &c.kind.span } else { &at.span },
                    format!("the detector's window is {} {axis} cells long", window[i]),
                )
                .allowed(format!("up to the map's {bins} {axis} cells"))
                .remedy("use fewer guard or training cells")
                .into());
        }
    }
    let training = window[0] * window[1] - (2 * guard[0] + 1) * (2 * guard[1] + 1);
    if training == 0 {
        return Err(doc
            .bad(&c.kind.span, "the detector has no training cells")
            .remedy("set train_range_cells or train_doppler_cells")
            .into());
    }
    let kind = match (c.kind.value, &c.rank) {
        (CfarName::Ca, None) => CfarKind::Ca,
        (CfarName::Go, None) => CfarKind::Go,
        (CfarName::So, None) => CfarKind::So,
        (CfarName::Ca | CfarName::Go | CfarName::So, Some(r)) => {
            return Err(doc
                .bad(&r.span, "only an \"os\" detector has a rank")
                .remedy("remove it or set kind = \"os\"")
                .into());
        }
        (CfarName::Os, None) => CfarKind::Os { rank: (3 * training).div_ceil(4) },
        (CfarName::Os, Some(r)) => CfarKind::Os {
            rank: doc.in_range(r, 1..=training, "counted from the smallest of the training cells")?,
        },
    };
    Ok(Cfar { kind, guard, train, pfa: c.false_alarm_probability })
}

fn elements(
    doc: &Document<'_>,
    list: &[ElementTable],
    f: &RadarFile,
    which: &str,
    carrier_hz: f64,
) -> Result<Vec<Antenna>> {
    let half_wavelength = 0.5 * crate::base::units::wavelength_m(carrier_hz);
    let mut out: Vec<Antenna> = Vec::with_capacity(list.len());
    for (i, e) in list.iter().enumerate() {
        let (position_m, at) = match (&e.position_m, &e.position_half_wavelengths) {
            (Some(m), None) => (doc.vector(m)?, m),
            (None, Some(h)) => (doc.vector(h)? * half_wavelength, h),
            (Some(_), Some(h)) => {
                return Err(doc
                    .bad(&h.span, "position_m and position_half_wavelengths exclude each other")
                    .remedy("keep one of them")
                    .into());
            }
            (None, None) => {
                return Err(BadInput::new("an antenna needs its position")
                    .file(doc.file())
                    .key(format!("{which}[{i}]"))
                    .remedy("add position_m = [x, y, z] or position_half_wavelengths = [x, y, z]")
                    .into());
            }
        };
        if position_m.length() > 100.0 {
            return Err(doc
                .bad(&at.span, "the antenna is far from the radar's phase centre")
                .allowed("within 100 m")
                .remedy("check the unit: position_m or position_half_wavelengths")
                .into());
        }
        let a = antenna(doc, e, &f.antenna, position_m)?;
        if let Some(j) = out.iter().position(|o| {
            o.position_m.distance(a.position_m) < 1e-6 * half_wavelength && o.polarisation == a.polarisation
        }) {
            return Err(doc
                .bad(&at.span, format!("{which}[{i}] has the position of {which}[{j}]"))
                .remedy("move one, or give it another polarisation")
                .into());
        }
        out.push(a);
    }
    Ok(out)
}

fn antenna(doc: &Document<'_>, e: &ElementTable, d: &AntennaTable, position_m: DVec3) -> Result<Antenna> {
    let polarisation = match e.polarisation.as_ref().or(d.polarisation.as_ref()) {
        None => Polarisation::V,
        Some(p) => Polarisation::from_name(&p.value).ok_or_else(|| {
            doc.bad(&p.span, "is not a polarisation")
                .allowed(Polarisation::NAMES.map(|(n, _)| n).join(", "))
                .remedy("use V for up, H for left, +45 for the direction between them")
        })?,
    };
    // The keys of a pattern belong together: an element that names a pattern brings all of them.
    let own = e.pattern.is_some();
    let pick =
        |a: &Option<At<f64>>, b: &Option<At<f64>>| if own { a.clone() } else { a.clone().or(b.clone()) };
    let name = e.pattern.as_ref().or(d.pattern.as_ref());
    let kind = name.map_or(PatternName::Isotropic, |p| p.value);
    let exponents =
        [pick(&e.azimuth_exponent, &d.azimuth_exponent), pick(&e.elevation_exponent, &d.elevation_exponent)];
    let file =
        if own { &e.table_file } else { e.table_file.as_ref().map_or(&d.table_file, |_| &e.table_file) };
    let lists = if own || e.table_gain_db.is_some() {
        [&e.table_azimuth_deg, &e.table_elevation_deg, &e.table_gain_db]
    } else {
        [&d.table_azimuth_deg, &d.table_elevation_deg, &d.table_gain_db]
    };
    if kind != PatternName::CosinePower
        && let Some(x) = exponents.iter().flatten().next()
    {
        return Err(doc
            .bad(&x.span, "only a cosine-power pattern has exponents")
            .remedy("remove it or set pattern = \"cosine-power\"")
            .into());
    }
    if kind != PatternName::Table {
        let span = file.as_ref().map(|f| &f.span).or(lists.iter().copied().flatten().map(|l| &l.span).next());
        if let Some(span) = span {
            return Err(doc
                .bad(span, "only a table pattern has a table")
                .remedy("remove it or set pattern = \"table\"")
                .into());
        }
    }
    let mut table_peak = None;
    let pattern = match kind {
        PatternName::Isotropic => Pattern::Isotropic,
        PatternName::CosinePower => {
            let exponent = |x: &Option<At<f64>>, what: &str| -> Result<f64> {
                match x {
                    Some(x) => Ok(x.value),
                    None => Err(doc
                        .bad(
                            &name.map_or(0..0, |n| n.span.clone()),
                            format!("a cosine-power pattern needs {what}"),
                        )
                        .remedy(format!("add {what}, as in 2"))
                        .into()),
                }
            };
            Pattern::CosinePower {
                azimuth_exponent: exponent(&exponents[0], "azimuth_exponent")?,
                elevation_exponent: exponent(&exponents[1], "elevation_exponent")?,
            }
        }
        PatternName::Table => {
            let (pattern, peak) = match (file, lists) {
                (Some(f), [None, None, None]) => table_file(doc, f)?,
                (None, [Some(az), Some(el), Some(gain)]) => {
                    let n = az.value.len() * el.value.len();
                    if n != gain.value.len() {
                        return Err(doc
                            .bad(&gain.span, format!("has {} gains", gain.value.len()))
                            .allowed(format!("one for each pair of the lists: {n}"))
                            .remedy("give the gains row by row, azimuth fastest")
                            .into());
                    }
                    for list in [az, el] {
                        if !list.value.windows(2).all(|w| w[0] < w[1]) {
                            return Err(doc
                                .bad(&list.span, "is not in ascending order")
                                .remedy("sort the angles, the smallest first")
                                .into());
                        }
                    }
                    normalised(&az.value, &el.value, gain.value.clone())
                }
                _ => {
                    return Err(doc
                        .bad(
                            &name.map_or(0..0, |n| n.span.clone()),
                            "a table pattern needs table_file, or table_azimuth_deg, table_elevation_deg and table_gain_db",
                        )
                        .remedy("give one of the two")
                        .into());
                }
            };
            table_peak = Some(peak);
            pattern
        }
    };
    let gain_dbi = e.gain_dbi.or(d.gain_dbi).or(table_peak).unwrap_or(0.0);
    Ok(Antenna { position_m, polarisation, gain_dbi, pattern })
}

/// The pattern relative to its peak, and the peak.
fn normalised(azimuth_deg: &[f64], elevation_deg: &[f64], mut gain_db: Vec<f64>) -> (Pattern, f64) {
    let peak = gain_db.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    gain_db.iter_mut().for_each(|g| *g -= peak);
    let radians = |d: &[f64]| d.iter().map(|x| x.to_radians()).collect();
    let (azimuth_rad, elevation_rad) = (radians(azimuth_deg), radians(elevation_deg));
    (Pattern::Table { azimuth_rad, elevation_rad, gain_db }, peak)
}

fn table_file(doc: &Document<'_>, name: &At<String>) -> Result<(Pattern, f64)> {
    let (path, text) = read_beside(doc, name)?;
    pattern_csv(&path, &text)
}

/// Reads a table of `azimuth_deg`, `elevation_deg` and `gain_db` whose rows, in any order, fill a grid; returns the pattern relative
/// to its peak and the peak.
///
/// # Errors
/// Returns an error of one line with the line number if a row is wrong, missing or given twice.
pub fn pattern_csv(file: &Path, text: &str) -> Result<(Pattern, f64)> {
    const COLUMNS: [&str; 3] = ["azimuth_deg", "elevation_deg", "gain_db"];
    const LARGEST: [f64; 3] = [180.0, 90.0, 500.0];
    let bad = |line: usize, problem: &str| BadInput::new(problem).file(file).line(line);
    let table = Table::parse(file, text.into())?;
    let mut rows = vec![([0.0; 3], 0); table.len()];
    for (k, (name, largest)) in COLUMNS.iter().zip(LARGEST).enumerate() {
        for (i, x) in table.numbers(name)?.into_iter().enumerate() {
            rows[i].0[k] = x;
            rows[i].1 = table.line(i);
            if x.is_nan() || x.abs() > largest {
                return Err(bad(table.line(i), "is out of range")
                    .key(*name)
                    .value(x)
                    .allowed(format!("-{largest}..={largest}"))
                    .remedy("give angles in degrees and gains in decibels")
                    .into());
            }
        }
    }
    table.only(&COLUMNS)?;
    let axis = |k: usize| {
        let mut a: Vec<f64> = rows.iter().map(|r| r.0[k]).collect();
        a.sort_by(f64::total_cmp);
        a.dedup();
        a
    };
    let (az, el) = (axis(0), axis(1));
    if rows.is_empty() {
        return Err(BadInput::new("has no rows").file(file).remedy("add the pattern").into());
    }
    // A full grid has as many rows as points; a repeated point then leaves another one missing.
    let mut gain = vec![f64::NAN; if az.len() * el.len() == rows.len() { rows.len() } else { 0 }];
    for ([a, e, g], line) in &rows {
        let at = |axis: &[f64], x: f64| axis.partition_point(|v| *v < x);
        let Some(cell) = gain.get_mut(at(&el, *e) * az.len() + at(&az, *a)) else {
            return Err(BadInput::new(format!(
                "{} rows do not fill a grid of {} azimuths and {} elevations",
                rows.len(),
                az.len(),
                el.len()
            ))
            .file(file)
            .allowed("one row for each pair")
            .remedy("add the missing rows")
            .into());
        };
        if !cell.is_nan() {
            return Err(bad(*line, "repeats a direction")
                .value(format!("{a},{e}"))
                .remedy("remove it")
                .into());
        }
        *cell = *g;
    }
    Ok(normalised(&az, &el, gain))
}

impl Polarisation {
    /// Vertical polarisation, up.
    pub const V: Self = Self::new(1.0, 0.0, 0.0, 0.0);
    /// Horizontal polarisation, to the left.
    pub const H: Self = Self::new(0.0, 0.0, 1.0, 0.0);

    const fn new(v_re: f64, v_im: f64, h_re: f64, h_im: f64) -> Self {
        Polarisation { v: Complex64::new(v_re, v_im), h: Complex64::new(h_re, h_im) }
    }

    /// Names and Jones vectors in (V, H). +45 lies between up and left as the radar sees it. RHCP is
    /// right-handed in the sense of IEEE Std 145 for the transmitted wave: with e^{+j omega t} and
    /// the look direction H x V, E = V cos(wt) - H sin(wt). The same vector serves on receive
    /// (CONVENTIONS eq. 2 and 9), so an antenna hears best the hand that it sends.
    pub const NAMES: [(&'static str, Polarisation); 6] = [
        ("V", Self::V),
        ("H", Self::H),
        ("+45", Self::new(FRAC_1_SQRT_2, 0.0, FRAC_1_SQRT_2, 0.0)),
        ("-45", Self::new(FRAC_1_SQRT_2, 0.0, -FRAC_1_SQRT_2, 0.0)),
        ("RHCP", Self::new(FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2)),
        ("LHCP", Self::new(FRAC_1_SQRT_2, 0.0, 0.0, -FRAC_1_SQRT_2)),
    ];

    /// The polarisation of a name of the radar file.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::NAMES.iter().find(|(n, _)| *n == name).map(|(_, p)| *p)
    }

    /// Name of the polarisation in the radar file, where it has one.
    pub fn name(&self) -> Option<&'static str> {
        Self::NAMES.iter().find(|(_, p)| p == self).map(|(n, _)| *n)
    }
}

/// The processing of a radar as the table of its file, with every key written out.
pub(super) fn processing_table(radar: &Radar) -> ProcessingTable {
    let window = |w: &Window| {
        Some(match *w {
            Window::Rectangle => WindowName::Rectangle.into(),
            Window::Hann => WindowName::Hann.into(),
            Window::Hamming => WindowName::Hamming.into(),
            Window::Blackman => WindowName::Blackman.into(),
            Window::DolphChebyshev { side_lobe_db } => WindowTable {
                kind: WindowName::DolphChebyshev.into(),
                side_lobe_db: Some(side_lobe_db.into()),
            },
        })
    };
    let p = &radar.processing;
    let (kind, rank) = match p.cfar.kind {
        CfarKind::Ca => (CfarName::Ca, None),
        CfarKind::Go => (CfarName::Go, None),
        CfarKind::So => (CfarName::So, None),
        CfarKind::Os { rank } => (CfarName::Os, Some(rank.into())),
    };
    ProcessingTable {
        range_window: window(&p.range_window),
        doppler_window: window(&p.doppler_window),
        angle_window: window(&p.angle_window),
        range_fft: Some(p.range_fft.into()),
        doppler_fft: Some(p.doppler_fft.into()),
        azimuth_bins: Some(p.azimuth_bins),
        azimuth_max_deg: Some(p.azimuth_fov_rad.to_degrees()),
        elevation_bins: Some(p.elevation_bins),
        elevation_max_deg: (p.elevation_bins > 1).then(|| p.elevation_fov_rad.to_degrees()),
        max_points: Some(p.max_points),
        remove_static: p.remove_static,
        range_migration: p.keystone.then(|| MigrationName::Keystone.into()),
        range_migration_max_mps: (p.migration_max_mps > 0.0).then(|| p.migration_max_mps.into()),
        group_range_cells: (p.group[1] > 0).then_some(p.group[1]),
        group_doppler_cells: (p.group[0] > 0).then_some(p.group[0]),
        angle: Some(angle_table(&p.angle)),
        cfar: Some(CfarTable {
            kind: kind.into(),
            rank,
            guard_range_cells: p.cfar.guard[1],
            guard_doppler_cells: p.cfar.guard[0],
            train_range_cells: p.cfar.train[1].into(),
            train_doppler_cells: p.cfar.train[0].into(),
            false_alarm_probability: p.cfar.pfa,
        }),
    }
}

/// The radar as a TOML text with every key written out, which [`parse`] reads back to the same radar (angles to
/// rounding).
///
/// # Errors
/// Returns an error for a polarisation without a name.
pub fn to_toml(radar: &Radar) -> Result<String> {
    let element = |a: &Antenna| -> Result<ElementTable> {
        let polarisation = a.polarisation.name().ok_or_else(|| {
            Error::Failed(format!("radar '{}' has a polarisation that no name describes", radar.name))
        })?;
        let mut e = ElementTable {
            position_m: Some(At::from(a.position_m.to_array())),
            polarisation: Some(At::from(polarisation.to_string())),
            gain_dbi: Some(a.gain_dbi),
            ..Default::default()
        };
        match &a.pattern {
            Pattern::Isotropic => e.pattern = Some(PatternName::Isotropic.into()),
            Pattern::CosinePower { azimuth_exponent, elevation_exponent } => {
                e.pattern = Some(PatternName::CosinePower.into());
                e.azimuth_exponent = Some((*azimuth_exponent).into());
                e.elevation_exponent = Some((*elevation_exponent).into());
            }
            Pattern::Table { azimuth_rad, elevation_rad, gain_db } => {
                let degrees = |r: &[f64]| r.iter().map(|x| x.to_degrees()).collect::<Vec<_>>();
                e.pattern = Some(PatternName::Table.into());
                e.table_azimuth_deg = Some(degrees(azimuth_rad).into());
                e.table_elevation_deg = Some(degrees(elevation_rad).into());
                e.table_gain_db = Some(gain_db.clone().into());
            }
        }
        Ok(e)
    };
    let (yaw, pitch, roll) = radar.mounting.rotation.to_euler(EulerRot::ZYX);
    let file = RadarFile {
        name: radar.name.clone(),
        waveform: waveform_toml::table(
            radar.carrier_hz,
            &radar.waveform,
            radar.multiplex,
            radar.chirps,
            radar.tx.len(),
        ),
        receiver: ReceiverTable {
            sampling: radar.sampling,
            sample_rate_hz: radar.sample_rate_hz.into(),
            samples: radar.samples.into(),
            adc_start_s: radar.adc_start_s,
            noise_figure_db: radar.noise_figure_db,
            thermal_noise: radar.thermal_noise,
        },
        transmitter: TransmitterTable { power_dbm: radar.tx_power_dbm },
        front_end: (radar.front_end != FrontEndSettings::default())
            .then(|| FrontEndTable::from(&radar.front_end)),
        antenna: AntennaTable::default(),
        tx: radar.tx.iter().map(element).collect::<Result<_>>()?,
        rx: radar.rx.iter().map(element).collect::<Result<_>>()?,
        mounting: MountingTable {
            position_m: radar.mounting.translation_m.to_array().into(),
            yaw_deg: yaw.to_degrees(),
            pitch_deg: pitch.to_degrees(),
            roll_deg: roll.to_degrees(),
        },
        processing: processing_table(radar),
    };
    toml::to_string(&file).map_err(|e| Error::Failed(format!("radar '{}' as TOML: {e}", radar.name)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::{C0, db_from_power};
    use crate::scene::radar::Sampling;
    use proptest::prelude::*;

    fn close(a: f64, b: f64, tolerance: f64) {
        assert!((a - b).abs() <= tolerance, "{a} is not {b} within {tolerance}");
    }

    #[test]
    fn feng77_is_the_radar_of_the_document() {
        let r = preset("feng77").unwrap();
        close(r.start_hz(), 77e9, 1.0);
        close(r.max_range_m(), 62.4, 0.05);
        close(r.range_bin_m(), C0 / (2.0 * 2.46e9), 1e-4);
        // The document takes the wavelength at the sweep's start; the centre of the sweep gives 1.6 % less.
        close(C0 / r.start_hz() / (4.0 * r.loop_period_s()), 20.3, 0.05);
        close(r.max_velocity_mps(), 19.96, 0.01);
        close(r.velocity_bin_mps(), 0.02, 0.001);
        assert_eq!((r.samples, r.chirps, r.sampling), (2048, 1024, Sampling::Real));
        assert_eq!((r.tx.len(), r.rx.len(), r.range_bins()), (1, 8, 1024));
        assert_eq!(r.processing.range_window, Window::DolphChebyshev { side_lobe_db: 111.0 });
        assert_eq!(r.processing.doppler_window, Window::DolphChebyshev { side_lobe_db: 141.5 });
        let c = r.processing.cfar;
        assert_eq!((c.kind, c.guard, c.train), (CfarKind::Os { rank: 50 }, [0, 5], [0, 50]));
    }

    #[test]
    fn front77_is_w3_with_a_filled_row() {
        let r = preset("front77").unwrap();
        assert_eq!((r.samples, r.chirps, r.channels()), (512, 256, 12));
        close(r.chirp_period_s(), 55e-6, 1e-18);
        close(r.bandwidth_hz(), 1e9, 0.0);
        close(r.samples as f64 / r.sample_rate_hz, r.waveform.ramp().unwrap().time_s, 1e-15);
        for name in ["front77", "demo77"] {
            let r = preset(name).unwrap();
            let mut y: Vec<f64> = Vec::new();
            for t in &r.tx {
                y.extend(r.rx.iter().map(|x| t.position_m.y + x.position_m.y));
            }
            let mean = y.iter().sum::<f64>() / 12.0;
            close(mean, 0.0, 1e-15);
            for (i, pair) in y.windows(2).enumerate() {
                let gap = (pair[1] - pair[0]) / (0.5 * r.wavelength_m());
                assert!((gap - 1.0).abs() < 1e-12, "{name}: gap {i} is {gap} half-wavelengths");
            }
        }
        let d = preset("demo77").unwrap();
        assert!(d.max_range_m() > 100.0 && d.max_velocity_mps() > 20.0);
    }

    /// Gain cannot exceed the directivity 4 pi / (integral of the pattern over the sphere), and printed antennas with their lines lose up
    /// to 3.5 dB.
    #[test]
    fn preset_antennas_are_passive() {
        for (name, _) in PRESETS {
            let r = preset(name).unwrap();
            for a in r.tx.iter().chain(&r.rx) {
                let n = 360;
                let step = std::f64::consts::PI / n as f64;
                let mut sum = 0.0;
                for i in 0..2 * n {
                    for j in 0..n {
                        let az = -std::f64::consts::PI + (i as f64 + 0.5) * step;
                        let el = -0.5 * std::f64::consts::PI + (j as f64 + 0.5) * step;
                        sum += a.pattern.power_gain(az, el) * el.cos() * step * step;
                    }
                }
                let directivity = db_from_power(4.0 * std::f64::consts::PI / sum);
                assert!(
                    a.gain_dbi <= directivity && a.gain_dbi > directivity - 3.5,
                    "{name}: {} against {directivity}",
                    a.gain_dbi
                );
            }
        }
    }

    #[test]
    fn a_radar_reads_back_from_what_it_writes() {
        for (name, _) in PRESETS {
            let mut a = preset(name).unwrap();
            a.mounting = Pose::from_yaw_pitch_roll(DVec3::new(3.4, 0.1, 0.5), 0.3, -0.05, 0.02);
            a.rx[0].polarisation = Polarisation::from_name("LHCP").unwrap();
            let last = a.rx.len() - 1;
            a.rx[last].pattern = Pattern::Table {
                azimuth_rad: vec![-0.5, 0.0, 0.5],
                elevation_rad: vec![-0.1, 0.1],
                gain_db: vec![-6.0, -1.0, -6.0, -5.0, 0.0, -5.0],
            };
            let text = to_toml(&a).unwrap();
            let b = parse(Path::new("x.toml"), &text).unwrap();
            assert!(a.mounting.rotation.angle_between(b.mounting.rotation) < 1e-7);
            let mut b2 = b.clone();
            b2.mounting = a.mounting;
            b2.processing.azimuth_fov_rad = a.processing.azimuth_fov_rad;
            let (Pattern::Table { azimuth_rad: x, .. }, Pattern::Table { azimuth_rad: y, .. }) =
                (&a.rx[last].pattern, &b.rx[last].pattern)
            else {
                panic!("the table was lost")
            };
            close(x[2], y[2], 1e-15);
            b2.rx[last].pattern = a.rx[last].pattern.clone();
            assert_eq!(a, b2);
        }
    }

    #[test]
    fn polarisations_are_unit_and_orthogonal_in_pairs() {
        let p = |n: &str| Polarisation::from_name(n).unwrap();
        for (a, b) in [("V", "H"), ("+45", "-45"), ("RHCP", "LHCP")] {
            let (a, b) = (p(a), p(b));
            close(a.v.norm_sqr() + a.h.norm_sqr(), 1.0, 1e-15);
            // Hermitian product, as fields.
            close((a.v * b.v.conj() + a.h * b.h.conj()).norm(), 0.0, 1e-15);
        }
        // A sphere (S = identity) returns the other hand: the same antenna hears nothing.
        let r = p("RHCP");
        close((r.v * r.v + r.h * r.h).norm(), 0.0, 1e-15);
        // Seen along the direction of travel x = H x V, E turns from up (V) towards the right (-H).
        let at = |wt: f64| (r.h * Complex64::from_polar(1.0, wt)).re;
        assert!(at(0.0).abs() < 1e-15 && at(0.1) < 0.0);
    }

    fn changed(from: &str, to: &str) -> String {
        let text = PRESETS[1].1;
        assert!(text.contains(from), "the preset does not hold '{from}'");
        parse(Path::new("r.toml"), &text.replacen(from, to, 1)).unwrap_err().to_string()
    }

    #[test]
    fn mistakes_are_one_line_with_the_remedy() {
        for (from, to, expect) in [
            ("carrier_hz = 77e9", "carrier_hz = -1", "waveform.carrier_hz = -1: is out of range; allowed: 1"),
            ("carrier_hz = 77e9", "carrier_hz = nan", "waveform.carrier_hz = nan: is out of range"),
            ("carrier_hz", "carier_hz", "waveform.carier_hz: unknown key"),
            ("ramp_time_s = 40e-6", "ramp_time_s = 60e-6", "is shorter than the ramp"),
            ("ramp_time_s = 40e-6", "ramp_time_s = 39e-6", "but the ramp lasts"),
            ("samples = 512", "samples = 513", "at most 512 samples here"),
            ("samples = 512", "samples = 0", "receiver.samples = 0: is out of range; allowed: 2..=65536"),
            ("samples = 512", "samples = 1e3", "allowed: a whole number"),
            ("sampling = \"iq\"", "sampling = \"IQ\"", "allowed: real, iq"),
            ("noise_figure_db = ", "noise_figure_db = -", "receiver.noise_figure_db = -"),
            ("false_alarm_probability = 1e-5", "false_alarm_probability = 2", "processing.cfar.false_alarm"),
            ("train_range_cells = 8", "train_range_cells = 300", "up to the map's 512 range cells"),
            ("[processing]", "[processing]\nrange_fft = 256", "the lines of a chirp = 512 or more"),
            ("polarisation = \"V\"", "polarisation = \"X\"", "allowed: V, H, +45, -45, RHCP, LHCP"),
            ("pattern = \"cosine-power\"", "pattern = \"isotropic\"", "only a cosine-power pattern has"),
            (
                "position_half_wavelengths = [0, 0.5, 0]",
                "position_half_wavelengths = [0, -0.5, 0]",
                "has the position of",
            ),
            ("position_half_wavelengths = [0, 0.5, 0]", "position_m = [0, 1e9, 0]", "three finite numbers"),
            ("position_half_wavelengths = [0, 0.5, 0]", "position_m = [0, 999, 0]", "within 100 m"),
            ("position_half_wavelengths = [0, 0.5, 0]", "", "an antenna needs its position"),
        ] {
            let e = changed(from, to);
            assert!(
                e.contains(expect) && e.starts_with("r.toml:") && !e.contains('\n'),
                "{from} -> {to}: {e}"
            );
        }
        let e = load("front7", Path::new("")).unwrap_err().to_string();
        assert!(e.contains("did you mean 'front77'?"), "{e}");
        let e = load("gone.toml", Path::new("/nowhere")).unwrap_err().to_string();
        assert!(e.contains("/nowhere/gone.toml: no such file"), "{e}");
    }

    #[test]
    fn pattern_tables() {
        let csv =
            "# horn\nazimuth_deg,elevation_deg,gain_db\n-10,0,8\n10,0,9\n0,0,11\n0,5,6\n-10,5,3\n10,5,4\n";
        let (p, peak) = pattern_csv(Path::new("p.csv"), csv).unwrap();
        assert_eq!(peak, 11.0);
        close(db_from_power(p.power_gain(0.0, 0.0)), 0.0, 1e-12);
        close(db_from_power(p.power_gain(5f64.to_radians(), 2.5f64.to_radians())), -3.5, 1e-12);
        close(db_from_power(p.power_gain(2.0, -1.0)), -2.0, 1e-12);
        for (from, to, expect) in [
            ("0,5,6\n", "", "do not fill a grid"),
            ("0,5,6", "0,0,6", "p.csv:6: 0,0: repeats a direction"),
            ("0,5,6", "0,5,x", "p.csv:6: gain_db = x: not a number"),
            ("0,5,6", "0,5,", "p.csv:6: gain_db = NaN: is out of range"),
            ("0,5,6", "0,5,6,5", "p.csv:6: 4: the row has a wrong number of values"),
            ("0,5,6", "0,95,6", "p.csv:6: elevation_deg = 95: is out of range; allowed: -90..=90"),
            ("azimuth_deg,", "azimuth_rad,", "p.csv:2: azimuth_deg: no such column (nearest: azimuth_rad)"),
            ("gain_db\n", "gain_db,phase_deg\n", "wrong number of values"),
        ] {
            let e = pattern_csv(Path::new("p.csv"), &csv.replacen(from, to, 1)).unwrap_err().to_string();
            assert!(e.contains(expect), "{e}");
        }
        assert!(pattern_csv(Path::new("p.csv"), "").is_err());
        let wider = "azimuth_deg,elevation_deg,gain_db,phase_deg\n0,0,1,2\n";
        let e = pattern_csv(Path::new("p.csv"), wider).unwrap_err().to_string();
        assert!(e.starts_with("p.csv:1: phase_deg: has a column that is not read"), "{e}");
        // The order of the columns and comments say nothing.
        let turned = "gain_db,azimuth_deg,elevation_deg # horn\r\n8,-10,0 # left\r\n9,10,0\r\n11,0,0\r\n";
        let flat = "azimuth_deg,elevation_deg,gain_db\n-10,0,8\n10,0,9\n0,0,11\n";
        let [a, b] = [turned, flat].map(|t| pattern_csv(Path::new("p.csv"), t).unwrap());
        assert_eq!(format!("{a:?}"), format!("{b:?}"));

        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("horn.csv"), csv).unwrap();
        let text = PRESETS[1].1.replacen(
            "pattern = \"cosine-power\"",
            "pattern = \"table\"\ntable_file = \"horn.csv\"",
            1,
        );
        let text: String = text
            .lines()
            .filter(|l| !l.contains("_exponent") && !l.starts_with("gain_dbi"))
            .map(|l| format!("{l}\n"))
            .collect();
        let r = parse(&dir.path().join("r.toml"), &text).unwrap();
        assert_eq!(r.tx[0].gain_dbi, 11.0);
        let e = parse(&dir.path().join("r.toml"), &text.replace("horn.csv", "../horn.csv")).unwrap_err();
        assert!(e.to_string().contains("leaves the folder"), "{e}");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        /// Any number in any place: a radar that passes the checks, or one line.
        #[test]
        fn numbers_never_panic(which in 0usize..60, x in prop_oneof![Just("0".to_string()), Just("-1".into()),
            Just("1e308".into()), Just("-1e-308".into()), Just("nan".into()), Just("inf".into()),
            Just("9223372036854775807".into()), "[0-9]{1,6}", "[0-9]{1,3}e-?[0-9]"])
        {
            let text = PRESETS[1].1;
            let mut seen = 0;
            let changed: String = text.lines().map(|l| {
                let number = l.split_once(" = ").filter(|(_, v)| v.starts_with(|c: char| c.is_ascii_digit()));
                let l = match number {
                    Some((k, _)) => { seen += 1; if seen == which + 1 { format!("{k} = {x}") } else { l.into() } }
                    None => l.to_string(),
                };
                l + "\n"
            }).collect();
            match parse(Path::new("r.toml"), &changed) {
                Ok(r) => { prop_assert!(r.max_range_m().is_finite() && r.range_bins() > 0); }
                Err(e) => { prop_assert!(!e.to_string().contains('\n')); }
            }
        }
    }
}
