//! From the cube to range-Doppler cells, detections and angles.
//!
//! Types, tables and planning that both engines share, and the host side of the kernels. The order
//! of the chain is [`fft`] (range, then Doppler) -> [`power`] -> [`cfar_ca`], [`cfar_go_so`] or [`cfar_os`] ->
//! [`peaks`] -> [`cfar_noise`], [`snapshot`] -> [`doa_beamform`].
//!
//! From an echo to the strongest cell of the map: a point of 10 dBsm, 30 m ahead, that approaches at 5 m/s.
//!
//! ```
//! use catseye::adc::synthesis::point_echo;
//! use catseye::base::control::Control;
//! use catseye::detect::points::range_rate_mps;
//! use catseye::engine::{Engine, Precision};
//! use catseye::scene::radar_toml::preset;
//! use catseye::trace::Echoes;
//! use glam::DVec3;
//!
//! let radar = preset("demo77")?;
//! let echo = point_echo(DVec3::new(30.0, 0.0, 0.0), DVec3::new(-5.0, 0.0, 0.0), 10.0, 1);
//! let echoes = Echoes { list: vec![echo], ..Default::default() };
//! let engine = Engine::open("cpu", Precision::F32)?;
//! let (seed, frame) = (1, 0);
//! let (cube, _) = engine.cube(&radar, &echoes, &[], seed, frame, Control::default())?;
//! let found = engine.range_doppler(&radar, &cube)?;
//! let strongest = found.cells[0];
//! let range_m = f64::from(strongest.range) * radar.range_bin_m();
//! assert!((range_m - 30.0).abs() < radar.range_bin_m());
//! let rate_mps = range_rate_mps(&radar, f64::from(strongest.doppler));
//! assert!((rate_mps + 5.0).abs() < radar.velocity_bin_mps());
//! # Ok::<(), catseye::Error>(())
//! ```

pub use catseye_math::Real;
use num_complex::Complex;

pub mod cfar;
pub mod cfar_ca;
pub mod cfar_factor;
pub mod cfar_go_so;
pub mod cfar_noise;
pub mod cfar_os;
pub mod cfar_window;
pub mod cpu;
pub mod device;
pub mod device_spectrum;
pub mod doa_beamform;
pub mod doa_bisvd;
pub mod doa_calibration;
pub mod doa_capon;
pub mod doa_covariance;
pub mod doa_crb;
pub mod doa_esprit;
pub mod doa_estimate;
pub mod doa_manifold;
pub mod doa_ml;
pub mod doa_music;
pub mod doa_options;
pub mod doa_order;
mod doa_residual;
pub mod doa_search;
pub mod doa_spectrum;
pub mod doa_view;
pub mod fft;
pub mod fft_any;
pub mod fft_chirp;
mod fft_params;
mod fft_pass;
pub mod fft_radix16;
pub mod fft_radix8;
pub mod folds;
pub mod integrate;
pub mod keystone;
pub mod lost_chirps;
pub mod multiplex;
pub mod peaks;
pub mod power;
pub mod sample_checks;
pub mod snapshot;
pub mod spectrum;
pub mod stream;
pub mod transform;
pub mod window;
pub mod zero_doppler;

/// The complex range-Doppler spectrum, `[doppler, channel, range]`, zero Doppler in the middle row,
/// rows growing with range rate. Normalised so that |X|^2 of a target in the middle of its cell is
/// its received power in W, whatever the windows.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrum<T> {
    /// Number of Doppler rows.
    pub doppler_bins: usize,
    /// Number of virtual channels.
    pub channels: usize,
    /// Number of range columns.
    pub range_bins: usize,
    /// Values, `[doppler, channel, range]`, √W.
    pub data: Vec<Complex<T>>,
}

/// Mean power over channels in W, `[doppler, range]`.
#[derive(Debug, Clone, PartialEq)]
pub struct PowerMap<T> {
    /// Number of Doppler rows.
    pub doppler_bins: usize,
    /// Number of range columns.
    pub range_bins: usize,
    /// Values, `[doppler, range]`, W.
    pub data: Vec<T>,
}

impl<T: Copy> PowerMap<T> {
    /// The power in a cell, W.
    pub fn at(&self, doppler: usize, range: usize) -> T {
        self.data[doppler * self.range_bins + range]
    }
}

/// A cell of the map that passed the detector and is the largest of its neighbourhood.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// Row of the cell.
    pub doppler: u32,
    /// Column of the cell.
    pub range: u32,
}

/// The detector's decision in each cell, `[doppler, range]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Detection<T> {
    /// Whether each cell passed the detector, `[doppler, range]`.
    pub mask: Vec<bool>,
    /// The power that a cell has to exceed over the noise in it, one number for each range column (it
    /// changes at the edges).
    pub ratio: Vec<T>,
}

/// The spectrum of every channel in the detected cells, `[cell, channel]`, in sqrt(W).
#[derive(Debug, Clone, PartialEq)]
pub struct Snapshots<T> {
    /// Number of virtual channels.
    pub channels: usize,
    /// Values, `[cell, channel]`, √W.
    pub data: Vec<Complex<T>>,
}

impl<T> Snapshots<T> {
    /// Values of all channels in one cell.
    pub fn of(&self, cell: usize) -> &[Complex<T>] {
        &self.data[cell * self.channels..(cell + 1) * self.channels]
    }
}

/// Detected cells of a frame with all that the chain says about them except angles.
#[derive(Debug, Clone, PartialEq)]
pub struct RangeDoppler<T> {
    /// Mean power of every cell.
    pub map: PowerMap<T>,
    /// What the detector found in it.
    pub detection: Detection<T>,
    /// Cells that were detected, strongest first.
    pub cells: Vec<Cell>,
    /// Estimated mean noise power in W in each of `cells`: for CA the mean of the training cells, for GO, SO
    /// and OS their statistic divided by its expectation on noise of unit mean.
    pub noise: Vec<T>,
    /// Snapshots in the order of `cells`.
    pub snapshots: Snapshots<T>,
}

impl<T> RangeDoppler<T> {
    /// A map in which no detector has looked for cells, of a spectrum with so many channels.
    pub fn of_map(map: PowerMap<T>, channels: usize) -> RangeDoppler<T> {
        RangeDoppler {
            map,
            detection: Detection { mask: Vec::new(), ratio: Vec::new() },
            cells: Vec::new(),
            noise: Vec::new(),
            snapshots: Snapshots { channels, data: Vec::new() },
        }
    }
}

impl RangeDoppler<f32> {
    /// The same detections in f64, exactly.
    pub fn widened(self) -> RangeDoppler<f64> {
        let wide = |v: Vec<f32>| v.into_iter().map(f64::from).collect();
        RangeDoppler {
            map: PowerMap {
                doppler_bins: self.map.doppler_bins,
                range_bins: self.map.range_bins,
                data: wide(self.map.data),
            },
            detection: Detection { mask: self.detection.mask, ratio: wide(self.detection.ratio) },
            cells: self.cells,
            noise: wide(self.noise),
            snapshots: Snapshots {
                channels: self.snapshots.channels,
                data: self.snapshots.data.iter().map(|z| Complex::new(z.re.into(), z.im.into())).collect(),
            },
        }
    }
}

impl Snapshots<f64> {
    /// The snapshots rounded to f32 (exact when they came from there).
    pub fn narrowed(&self) -> Snapshots<f32> {
        Snapshots {
            channels: self.channels,
            data: self.data.iter().map(|z| Complex::new(z.re as f32, z.im as f32)).collect(),
        }
    }
}
