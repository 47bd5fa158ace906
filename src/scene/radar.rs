//! The radar description: what the TOML says, checked, in SI.

use crate::frames::{Pose, Sensor, Vehicle};
use glam::DVec3;
use num_complex::Complex64;

#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Sampling {
    /// One real mixer: N/2 range cells.
    Real,
    /// Complex (I and Q): N range cells.
    Iq,
}

/// Unit Jones vector in the (V, H) basis of CONVENTIONS eq. 2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Polarisation {
    pub v: Complex64,
    pub h: Complex64,
}

/// Power gain over direction relative to the antenna's peak, applied once on transmit and once on receive.
#[derive(Debug, Clone, PartialEq)]
pub enum Pattern {
    Isotropic,
    /// cos^n of azimuth times cos^m of elevation in power; zero behind.
    CosinePower {
        azimuth_exponent: f64,
        elevation_exponent: f64,
    },
    /// Gain relative to the peak in dB on a regular or irregular grid; bilinear between, clamped
    /// outside the grid.
    Table {
        azimuth_rad: Vec<f64>,
        elevation_rad: Vec<f64>,
        gain_db: Vec<f64>,
    },
}

impl Pattern {
    /// Relative power gain (1 at the peak) towards (azimuth, elevation) in radians, sensor frame.
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
                crate::units::power_from_db(db)
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

#[derive(Debug, Clone, PartialEq)]
pub struct Antenna {
    /// Phase centre in the sensor frame.
    pub position_m: DVec3,
    pub polarisation: Polarisation,
    /// Peak gain over isotropic.
    pub gain_dbi: f64,
    pub pattern: Pattern,
}

#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Window {
    Rectangle,
    Hann,
    Hamming,
    Blackman,
    DolphChebyshev { side_lobe_db: f64 },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum CfarKind {
    /// Cell averaging.
    Ca,
    /// k-th smallest training cell.
    Os { rank: usize },
}

/// Detector settings. A 1-D detector along range has `guard[0] = train[0] = 0`.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Cfar {
    pub kind: CfarKind,
    /// Guard cells each side: [doppler, range].
    pub guard: [usize; 2],
    /// Training cells each side, outside the guard: [doppler, range].
    pub train: [usize; 2],
    /// Probability of false alarm per cell on noise alone.
    pub pfa: f64,
}

#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Processing {
    pub range_window: Window,
    pub doppler_window: Window,
    pub angle_window: Window,
    /// FFT lengths; at least the number of samples and chirps (zero padded), powers of two.
    pub range_fft: usize,
    pub doppler_fft: usize,
    /// Beamformer grid over azimuth in -fov..fov.
    pub azimuth_bins: usize,
    pub azimuth_fov_rad: f64,
    /// 1 when the array has no rows in elevation.
    pub elevation_bins: usize,
    pub elevation_fov_rad: f64,
    pub cfar: Cfar,
    /// Keep at most this many points a frame, strongest first.
    pub max_points: usize,
}

/// An FMCW fast-chirp radar with TDM MIMO. Virtual channel c = tx * rx.len() + rx.
#[derive(Debug, Clone, PartialEq)]
pub struct Radar {
    pub name: String,
    /// Centre of the sweep.
    pub carrier_hz: f64,
    /// Swept during `ramp_time_s`; rising.
    pub bandwidth_hz: f64,
    pub ramp_time_s: f64,
    /// From the start of one chirp to the start of the next (any TX).
    pub chirp_period_s: f64,
    /// From the start of the ramp to the first sample.
    pub adc_start_s: f64,
    pub sample_rate_hz: f64,
    pub samples: usize,
    /// Loops: chirps of each TX in a frame.
    pub chirps: usize,
    pub sampling: Sampling,
    pub tx: Vec<Antenna>,
    pub rx: Vec<Antenna>,
    pub tx_power_dbm: f64,
    pub noise_figure_db: f64,
    /// Thermal noise on or off.
    pub thermal_noise: bool,
    pub mounting: Pose<Sensor, Vehicle>,
    pub processing: Processing,
}

impl Radar {
    pub fn channels(&self) -> usize {
        self.tx.len() * self.rx.len()
    }
    pub fn wavelength_m(&self) -> f64 {
        crate::units::wavelength_m(self.carrier_hz)
    }
    /// Chirp slope in Hz/s.
    pub fn slope_hz_per_s(&self) -> f64 {
        self.bandwidth_hz / self.ramp_time_s
    }
    /// Sweep start: the frequency at ramp time zero.
    pub fn start_hz(&self) -> f64 {
        self.carrier_hz - 0.5 * self.bandwidth_hz
    }
    /// Time between chirps of the same TX.
    pub fn loop_period_s(&self) -> f64 {
        self.chirp_period_s * self.tx.len() as f64
    }
    pub fn frame_time_s(&self) -> f64 {
        self.loop_period_s() * self.chirps as f64
    }
    /// Start of chirp (loop m, transmitter k) relative to the middle of the frame, where positions
    /// are taken (CONVENTIONS eq. 10).
    pub fn chirp_start_s(&self, chirp: usize, tx: usize) -> f64 {
        (chirp * self.tx.len() + tx) as f64 * self.chirp_period_s - 0.5 * self.frame_time_s()
    }
    /// Range cells kept: half the FFT for real sampling.
    pub fn range_bins(&self) -> usize {
        match self.sampling {
            Sampling::Real => self.processing.range_fft / 2,
            Sampling::Iq => self.processing.range_fft,
        }
    }
    /// Width of a range cell (FFT bin): c fs / (2 S N_fft).
    pub fn range_bin_m(&self) -> f64 {
        crate::units::C0 * self.sample_rate_hz
            / (2.0 * self.slope_hz_per_s() * self.processing.range_fft as f64)
    }
    /// Width of a Doppler cell in m/s of range rate.
    pub fn velocity_bin_mps(&self) -> f64 {
        self.wavelength_m() / (2.0 * self.loop_period_s() * self.processing.doppler_fft as f64)
    }
    /// Largest unambiguous range.
    pub fn max_range_m(&self) -> f64 {
        self.range_bin_m() * self.range_bins() as f64
    }
    /// Largest unambiguous |range rate|.
    pub fn max_velocity_mps(&self) -> f64 {
        self.wavelength_m() / (4.0 * self.loop_period_s())
    }
}
