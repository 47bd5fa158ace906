//! The radar description: what the TOML says, checked, in SI.
//!
//! Antennas are phase centres in the sensor frame, each with a polarisation, a peak gain and a pattern. A pair of a
//! transmitter and a receiver is a virtual channel, whose phase centre is the sum of both positions (CONVENTIONS eq.
//! 19). The waveform gives lines (eq. 12a), the processing its windows and transforms; cells of range and range rate
//! follow from both (eq. 14-16) and are computed here, so that no file states them. Range rates and directions are
//! measured at the frequency in the middle of the samples (eq. 15a), not at the carrier.

use super::front_end::FrontEndSettings;
use super::motion::{Motion, Moving};
use super::waveform::{FrequencySamples, Multiplex, Waveform};
use crate::base::frames::{Pose, Sensor, Vehicle};
use glam::DVec3;
use num_complex::Complex64;
use std::sync::Arc;

/// Real or complex sampling.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Sampling {
    /// Real samples of one mixer: N/2 range cells.
    Real,
    /// Complex samples (I and Q): N range cells.
    Iq,
}

/// Unit Jones vector in the (V, H) basis of CONVENTIONS eq. 2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Polarisation {
    /// Component along V.
    pub v: Complex64,
    /// Component along H.
    pub h: Complex64,
}

/// Power gain over direction relative to the antenna's peak, applied once on transmit and once on receive.
#[derive(Debug, Clone, PartialEq)]
pub enum Pattern {
    /// The same in all directions.
    Isotropic,
    /// cos^n of azimuth times cos^m of elevation in power; zero behind.
    CosinePower {
        /// n.
        azimuth_exponent: f64,
        /// m.
        elevation_exponent: f64,
    },
    /// Gain relative to the peak in dB on a regular or irregular grid; bilinear between, clamped
    /// outside the grid.
    Table {
        /// Azimuths of the columns, rad.
        azimuth_rad: Vec<f64>,
        /// Elevations of the rows, rad.
        elevation_rad: Vec<f64>,
        /// Gain, `[elevation, azimuth]`, dB.
        gain_db: Vec<f64>,
    },
}

impl Pattern {
    /// Relative power gain (1 at the peak) towards (azimuth, elevation) in radians, sensor frame.
    ///
    /// # Example
    /// The half-power beam of cos^1.6 is 99° wide: 49.5° to either side.
    ///
    /// ```
    /// use catseye::scene::radar::Pattern;
    ///
    /// let pattern = Pattern::CosinePower { azimuth_exponent: 1.6, elevation_exponent: 36.0 };
    /// assert_eq!(pattern.power_gain(0.0, 0.0), 1.0);
    /// assert!((pattern.power_gain(49.5f64.to_radians(), 0.0) - 0.5).abs() < 0.005);
    /// assert_eq!(pattern.power_gain(120f64.to_radians(), 0.0), 0.0);
    /// ```
    pub fn power_gain(&self, azimuth: f64, elevation: f64) -> f64 {
        match self {
            Pattern::Isotropic => 1.0,
            Pattern::CosinePower { azimuth_exponent, elevation_exponent } => {
                let (ca, ce) = (azimuth.cos(), elevation.cos());
                if ca <= 0.0 { 0.0 } else { ca.powf(*azimuth_exponent) * ce.powf(*elevation_exponent) }
            }
            Pattern::Table { azimuth_rad, elevation_rad, gain_db } => {
                let (i, u) = cell(azimuth_rad, azimuth);
                let (j, v) = cell(elevation_rad, elevation);
                let at = |i: usize, j: usize| gain_db[j * azimuth_rad.len() + i];
                let (i1, j1) = ((i + 1).min(azimuth_rad.len() - 1), (j + 1).min(elevation_rad.len() - 1));
                let db = (1.0 - v) * ((1.0 - u) * at(i, j) + u * at(i1, j))
                    + v * ((1.0 - u) * at(i, j1) + u * at(i1, j1));
                crate::base::units::power_from_db(db)
            }
        }
    }
}

/// Cell index and fraction of `x` on an ascending axis, clamped to its ends.
fn cell(axis: &[f64], x: f64) -> (usize, f64) {
    let n = axis.len();
    if n < 2 || x <= axis[0] {
        return (0, 0.0);
    }
    if x >= axis[n - 1] {
        return (n - 1, 0.0);
    }
    let i = axis.partition_point(|a| *a <= x) - 1;
    (i, (x - axis[i]) / (axis[i + 1] - axis[i]))
}

/// One transmit or receive antenna.
#[derive(Debug, Clone, PartialEq)]
pub struct Antenna {
    /// Phase centre in the sensor frame.
    pub position_m: DVec3,
    /// What it sends and receives.
    pub polarisation: Polarisation,
    /// Peak gain over isotropic.
    pub gain_dbi: f64,
    /// Gain over direction.
    pub pattern: Pattern,
}

/// A window of a transform.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Window {
    /// Rectangular, that is, no window.
    Rectangle,
    /// Hann window.
    Hann,
    /// Hamming window.
    Hamming,
    /// Blackman window.
    Blackman,
    /// Dolph-Chebyshev window.
    DolphChebyshev {
        /// Level of the side lobes under the main lobe, dB.
        side_lobe_db: f64,
    },
}

impl Window {
    /// Index of the centroid of `count` coefficients: periodic windows have their maximum half a value after the middle of the data.
    pub fn centroid(self, count: usize) -> f64 {
        let n = count as f64;
        match self {
            _ if count < 2 => 0.0,
            Window::Rectangle | Window::DolphChebyshev { .. } => 0.5 * (n - 1.0),
            Window::Hann | Window::Blackman => 0.5 * n,
            // The first coefficient, 0.08, has no partner: 0.08 n/2 of a sum of 0.54 n.
            Window::Hamming => 0.5 * n - 0.08 / 1.08,
        }
    }
}

/// CFAR statistic of the training cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum CfarKind {
    /// Cell averaging.
    Ca,
    /// Greatest of: the larger mean of the training cells before and behind.
    Go,
    /// Smallest of: the smaller mean of the two.
    So,
    /// k-th smallest training cell.
    Os {
        /// Place in ascending order, from 1.
        rank: usize,
    },
}

/// Detector settings. A 1-D detector along range has `guard[0] = train[0] = 0`.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Cfar {
    /// The statistic.
    pub kind: CfarKind,
    /// Guard cells each side: [doppler, range].
    pub guard: [usize; 2],
    /// Training cells each side, outside the guard: [doppler, range].
    pub train: [usize; 2],
    /// Probability of false alarm per cell on noise alone.
    pub pfa: f64,
}

/// Angle estimation method for a detected cell (CONVENTIONS eq. 19, 90-99).
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum AngleMethod {
    /// Conventional beamformer (Bartlett); one point for each cell.
    #[default]
    Bartlett,
    /// Capon's beamformer.
    Capon,
    /// Deterministic maximum likelihood.
    Ml,
    /// MUSIC.
    Music,
    /// Root-MUSIC, for uniform linear arrays.
    RootMusic,
    /// ESPRIT, for uniform linear and rectangular arrays.
    Esprit,
    /// MUSIC on a signal subspace that is tracked over snapshots.
    BiSvd,
}

impl AngleMethod {
    /// Whether it finds directions without looking in each of a grid's, so that it has no spectrum.
    pub fn is_gridless(self) -> bool {
        matches!(self, AngleMethod::RootMusic | AngleMethod::Esprit)
    }
}

/// Number of sources in a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub enum Sources {
    /// The number is given.
    Given(usize),
    /// Minimum description length.
    Mdl,
    /// Akaike's criterion.
    Aic,
    /// As many as a maximum-likelihood fit needs to leave noise alone.
    Residual,
}

/// A calibration file and what is in it.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct CalibrationFile {
    /// The file.
    pub path: std::path::PathBuf,
    /// Its text.
    pub text: String,
}

/// Angle estimation (direction of arrival).
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct AngleSettings {
    /// Angle estimation method.
    pub method: AngleMethod,
    /// Number of sources in a cell.
    pub sources: Sources,
    /// Largest number of sources of one cell.
    pub max_sources: usize,
    /// Rows and columns of the subarrays for spatial smoothing; None: chosen.
    pub subarray: Option<[usize; 2]>,
    /// Whether averaging goes forwards and backwards; None does so wherever there are subarrays.
    pub forward_backward: Option<bool>,
    /// Forgetting factor of the Bi-SVD.
    pub forgetting: f64,
    /// Measured steering vectors in place of the ideal array's.
    pub calibration: Option<CalibrationFile>,
}

impl Default for AngleSettings {
    fn default() -> Self {
        AngleSettings {
            method: AngleMethod::Bartlett,
            sources: Sources::Residual,
            max_sources: 3,
            subarray: None,
            forward_backward: None,
            forgetting: 0.9,
            calibration: None,
        }
    }
}

/// Settings of the processing of samples.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Processing {
    /// Window of the range transform.
    pub range_window: Window,
    /// Window of the Doppler transform.
    pub doppler_window: Window,
    /// Window over the array.
    pub angle_window: Window,
    /// FFT lengths; at least the number of samples and chirps (zero padded), powers of two.
    pub range_fft: usize,
    /// Length of the Doppler transform.
    pub doppler_fft: usize,
    /// Beamformer grid over azimuth in -fov..fov.
    pub azimuth_bins: usize,
    /// Largest azimuth to either side, rad.
    pub azimuth_fov_rad: f64,
    /// Number of beams in elevation; 1 when the array has no rows in elevation.
    pub elevation_bins: usize,
    /// Largest elevation up and down, rad.
    pub elevation_fov_rad: f64,
    /// Angle estimation (direction of arrival).
    pub angle: AngleSettings,
    /// Take out what does not change from chirp to chirp.
    pub remove_static: bool,
    /// Keep targets in one range cell over the frame (keystone transform).
    pub keystone: bool,
    /// Range rate up to which targets are kept so, in whatever Doppler fold they are, m/s; zero: those of the first fold.
    pub migration_max_mps: f64,
    /// Peaks within so many [doppler, range] cells of a stronger one belong to it; zero for all peaks.
    pub group: [usize; 2],
    /// CFAR detector.
    pub cfar: Cfar,
    /// Keep at most this many points a frame, strongest first.
    pub max_points: usize,
}

/// A radar. Channel c = slot * rx.len() + rx, with a slot for each transmitter (TDM) or sign pattern (BPM), and one
/// slot when transmitters are told apart by Doppler bands (DDM).
///
/// # Example
/// What follows from a waveform: the range cell c/2B, and the range rate λ/4T_loop beyond which the Doppler map is
/// ambiguous.
///
/// ```
/// use catseye::base::units::C0;
/// use catseye::scene::radar_toml::preset;
///
/// let radar = preset("demo77")?;
/// // The whole ramp of 375 MHz is sampled, complex, without zero padding: 0.40 m to a cell, 102 m in all.
/// assert!((radar.range_bin_m() / (C0 / (2.0 * 375e6)) - 1.0).abs() < 1e-12);
/// assert!((radar.max_range_m() - 102.3).abs() < 0.1);
/// // Three transmitters one after another, 16 us each.
/// assert!((radar.loop_period_s() - 48e-6).abs() < 1e-15);
/// let limit_mps = radar.sample_wavelength_m() / (4.0 * 48e-6);
/// assert!((radar.max_velocity_mps() / limit_mps - 1.0).abs() < 1e-12 && (limit_mps - 20.3).abs() < 0.1);
/// assert_eq!((radar.virtual_channels(), radar.channels()), (12, 12));
/// # Ok::<(), catseye::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Radar {
    /// Name of the radar.
    pub name: String,
    /// Centre of the sweep or band.
    pub carrier_hz: f64,
    /// What it sends.
    pub waveform: Waveform,
    /// Multiplexing of the transmitters.
    pub multiplex: Multiplex,
    /// Time from the start of a chirp (run, pulse, code) to the first sample, s.
    pub adc_start_s: f64,
    /// Sample rate, Hz.
    pub sample_rate_hz: f64,
    /// Samples of a chirp.
    pub samples: usize,
    /// Loops: chirps of each ramp and slot in a frame.
    pub chirps: usize,
    /// Real or complex sampling.
    pub sampling: Sampling,
    /// Transmit antennas.
    pub tx: Vec<Antenna>,
    /// Receive antennas.
    pub rx: Vec<Antenna>,
    /// Power of one transmitter, dBm.
    pub tx_power_dbm: f64,
    /// Noise figure, dB.
    pub noise_figure_db: f64,
    /// Thermal noise on or off.
    pub thermal_noise: bool,
    /// What else the receiver does to the samples.
    pub front_end: FrontEndSettings,
    /// Pose of the radar on its vehicle, at time zero.
    pub mounting: Pose<Sensor, Vehicle>,
    /// How it moves on its vehicle, where it is not fixed to it.
    pub motion: Option<Arc<Motion>>,
    /// Signal processing of the samples.
    pub processing: Processing,
}

impl Radar {
    /// Gives the radar a motion on its vehicle; its mounting becomes that of time zero.
    pub fn move_by(&mut self, motion: Arc<Motion>) {
        let now = motion.at(0.0);
        self.mounting = Pose::new(now.rotation, now.translation_m);
        self.motion = Some(motion);
    }

    /// Pose of the radar on the vehicle, and how that changes, at a time from the middle of frame 0.
    pub fn on_vehicle(&self, time_s: f64) -> Moving {
        self.motion.as_ref().map_or_else(|| Moving::at_rest(&self.mounting), |motion| motion.at(time_s))
    }

    /// Number of channels of a cube.
    pub fn channels(&self) -> usize {
        self.slots() * self.rx.len()
    }
    /// Number of pairs of a transmitter and a receiver.
    pub fn virtual_channels(&self) -> usize {
        self.tx.len() * self.rx.len()
    }
    /// Number of chirps of one loop of one ramp.
    pub fn slots(&self) -> usize {
        self.multiplex.slots(self.tx.len())
    }
    /// Number of rows of a cube: loops, each with one chirp of every ramp.
    pub fn rows(&self) -> usize {
        self.chirps * self.waveform.parts()
    }
    /// Wavelength at the carrier, m.
    pub fn wavelength_m(&self) -> f64 {
        crate::base::units::wavelength_m(self.carrier_hz)
    }
    /// Frequency in the middle of a chirp's samples under the range window, Hz. Range rates and directions are measured at this frequency,
    /// which is the carrier only where the samples are taken about the middle of the ramp (CONVENTIONS eq. 15a).
    pub fn sample_centre_hz(&self) -> f64 {
        let lines = self.lines();
        let centroid = self.processing.range_window.centroid(lines.count);
        // Lines of falling frequency are read backwards.
        let index = if lines.step_hz < 0.0 { lines.count as f64 - 1.0 - centroid } else { centroid };
        lines.first_hz + index * lines.step_hz
    }
    /// Wavelength at [`Self::sample_centre_hz`], m.
    pub fn sample_wavelength_m(&self) -> f64 {
        crate::base::units::wavelength_m(self.sample_centre_hz())
    }
    /// The radar as its `i`-th ramp sees it: with a cube of every `parts`-th chirp.
    pub fn part(&self, i: usize) -> Radar {
        let mut part = self.clone();
        if let Waveform::Fmcw(s) = &mut part.waveform {
            s.this = i;
        }
        part
    }
    /// Band of the waveform, Hz.
    pub fn bandwidth_hz(&self) -> f64 {
        match &self.waveform {
            Waveform::Fmcw(s) => s.ramps.iter().map(|r| r.bandwidth_hz.abs()).fold(0.0, f64::max),
            Waveform::Stepped { step_hz, .. } => step_hz.abs() * self.samples as f64,
            Waveform::Pulse { shape, .. } => 2.0 * shape.half_band_hz(),
            Waveform::Coded { chip_rate_hz, .. } => *chip_rate_hz,
        }
    }
    /// Time from the start of one chirp to the start of the next, of any transmitter, s.
    pub fn chirp_period_s(&self) -> f64 {
        self.waveform.period_s()
    }
    /// Slope of the ramp in Hz/s, negative when it falls; for other waveforms the change of frequency from line
    /// to line over the time of a sample.
    pub fn slope_hz_per_s(&self) -> f64 {
        self.step_hz() * self.sample_rate_hz
    }
    /// Frequency at the start of the ramp or run, Hz.
    pub fn start_hz(&self) -> f64 {
        match &self.waveform {
            Waveform::Fmcw(s) => self.carrier_hz - 0.5 * s.ramps[s.this].bandwidth_hz,
            _ => self.carrier_hz - 0.5 * self.step_hz() * self.samples as f64,
        }
    }
    /// Change of frequency from one line to the next, Hz.
    pub fn step_hz(&self) -> f64 {
        match &self.waveform {
            Waveform::Fmcw(s) => {
                let r = &s.ramps[s.this];
                r.bandwidth_hz / r.time_s / self.sample_rate_hz
            }
            Waveform::Stepped { step_hz, .. } => *step_hz,
            Waveform::Pulse { .. } | Waveform::Coded { .. } => self.sample_rate_hz / self.samples as f64,
        }
    }
    /// Lines of one chirp as processing sees them, in the order of the samples.
    pub fn lines(&self) -> FrequencySamples {
        let step_hz = self.step_hz();
        let samples = |first_hz: f64, dechirped: bool| FrequencySamples {
            count: self.samples,
            first_hz,
            step_hz,
            step_s: 1.0 / self.sample_rate_hz,
            start_s: self.adc_start_s,
            dechirped,
        };
        match &self.waveform {
            Waveform::Fmcw(_) => samples(self.start_hz() + self.slope_hz_per_s() * self.adc_start_s, true),
            Waveform::Stepped { .. } => samples(self.start_hz(), false),
            Waveform::Pulse { shape, .. } => self.harmonics(step_hz, 0.5 * shape.band_hz()),
            Waveform::Coded { chip_rate_hz, .. } => self.harmonics(step_hz, 0.5 * chip_rate_hz),
        }
    }
    /// Harmonics of a period 1/`step_hz` up to `half_band_hz` on both sides of the carrier, all taken in the middle of
    /// the samples.
    pub fn harmonics(&self, step_hz: f64, half_band_hz: f64) -> FrequencySamples {
        let most = (0.5 * self.sample_rate_hz / step_hz - 0.5).floor();
        let each_side = (half_band_hz / step_hz * (1.0 + 1e-12)).floor().min(most).max(0.0);
        // Real samples are of the wave itself, so its harmonics count from zero frequency.
        let middle = match self.sampling {
            Sampling::Iq => self.carrier_hz,
            Sampling::Real => (self.carrier_hz / step_hz).round() * step_hz,
        };
        FrequencySamples {
            count: 2 * each_side as usize + 1,
            first_hz: middle - each_side * step_hz,
            step_hz,
            step_s: 0.0,
            start_s: self.adc_start_s + 0.5 * (self.samples as f64 - 1.0) / self.sample_rate_hz,
            dechirped: false,
        }
    }
    /// Time between chirps of the same slot and ramp, s.
    pub fn loop_period_s(&self) -> f64 {
        let own = match self.waveform.is_in_bursts() {
            true => self.waveform.period_s(),
            false => self.waveform.periods_s().0,
        };
        own * self.slots() as f64
    }
    /// Time over which the chirps of this ramp are spread, s: the frame, or this burst of it. Range rates are resolved to
    /// λ over twice this time.
    pub fn burst_time_s(&self) -> f64 {
        self.loop_period_s() * self.chirps as f64
    }
    /// Length of a frame, s.
    pub fn frame_time_s(&self) -> f64 {
        self.waveform.periods_s().0 * self.slots() as f64 * self.chirps as f64
    }
    /// Start of the chirp of a loop and a slot relative to the middle of the frame, where positions
    /// are taken (CONVENTIONS eq. 10).
    pub fn chirp_start_s(&self, chirp: usize, slot: usize) -> f64 {
        let (_, before) = self.waveform.periods_s();
        // Bursts wait for all chirps of those before them.
        let before = if self.waveform.is_in_bursts() { before * self.chirps as f64 } else { before };
        chirp as f64 * self.loop_period_s()
            + before * self.slots() as f64
            + slot as f64 * self.chirp_period_s()
            - 0.5 * self.frame_time_s()
    }
    /// Whether lines come as real numbers: what is mixed with the sweep by one mixer.
    pub fn line_sampling(&self) -> Sampling {
        match self.waveform {
            Waveform::Fmcw(_) | Waveform::Stepped { .. } => self.sampling,
            _ => Sampling::Iq,
        }
    }
    /// Number of range cells that are kept: half the FFT where real samples are mixed with the sweep.
    pub fn range_bins(&self) -> usize {
        match self.line_sampling() {
            Sampling::Real => self.processing.range_fft / 2,
            Sampling::Iq => self.processing.range_fft,
        }
    }
    /// Width of a range cell (FFT bin), m: c / (2 Δf N_fft), Δf from line to line.
    pub fn range_bin_m(&self) -> f64 {
        crate::base::units::C0 / (2.0 * self.step_hz().abs() * self.processing.range_fft as f64)
    }
    /// Range of cell 0, m: that of the first sample for pulses and codes, else 0.
    pub fn first_range_m(&self) -> f64 {
        match self.waveform {
            Waveform::Pulse { .. } | Waveform::Coded { .. } => {
                0.5 * crate::base::units::C0 * self.adc_start_s
            }
            _ => 0.0,
        }
    }
    /// Width of a Doppler cell, m/s of range rate.
    pub fn velocity_bin_mps(&self) -> f64 {
        self.sample_wavelength_m() / (2.0 * self.loop_period_s() * self.processing.doppler_fft as f64)
    }
    /// Resolution along Doppler λ/2T with the time T of this ramp's chirps, m/s of range rate.
    pub fn velocity_cell_mps(&self) -> f64 {
        0.5 * self.sample_wavelength_m() / self.burst_time_s()
    }
    /// Number of rows of the range-Doppler map: the Doppler FFT, or its share of one band (DDM).
    pub fn doppler_rows(&self) -> usize {
        match self.multiplex {
            Multiplex::Ddm { bands } => self.processing.doppler_fft / bands,
            _ => self.processing.doppler_fft,
        }
    }
    /// Largest unambiguous range, m.
    pub fn max_range_m(&self) -> f64 {
        self.first_range_m() + self.range_bin_m() * self.range_bins() as f64
    }
    /// Largest unambiguous |range rate| of a row of the map, m/s.
    pub fn max_velocity_mps(&self) -> f64 {
        0.5 * self.velocity_bin_mps() * self.doppler_rows() as f64
    }
    /// Doppler folds for which targets are kept in their range cells: whole unambiguous intervals of the map, from the least to
    /// the largest; zero alone where none were asked for.
    pub fn migration_ambiguities(&self) -> std::ops::RangeInclusive<i32> {
        let most = match self.processing.keystone {
            true => (0.5 * (self.processing.migration_max_mps / self.max_velocity_mps() - 1.0)).ceil(),
            false => 0.0,
        };
        -(most.max(0.0) as i32)..=most.max(0.0) as i32
    }
    /// Range by which a target of 1 m/s seems farther than it is in the middle of the frame: its Doppler shift changes the beat, and
    /// the middle of its samples is not that of the frame (eq. 15).
    pub fn range_per_rate_s(&self) -> f64 {
        let lines = self.lines();
        lines.step_s * self.sample_centre_hz() / lines.step_hz + self.middle_s()
    }
    /// Time of the middle of all samples of this ramp, from the middle of the frame, s.
    pub fn middle_s(&self) -> f64 {
        let lines = self.lines();
        self.chirp_start_s(0, 0)
            + 0.5 * (self.chirps as f64 - 1.0) * self.loop_period_s()
            + 0.5 * (self.slots() as f64 - 1.0) * self.chirp_period_s()
            + lines.start_s
            + 0.5 * (lines.count as f64 - 1.0) * lines.step_s
    }
}
