//! What can be asked of the estimators of angle, and what they answer.

use super::doa_order::Criterion;
use num_complex::Complex64;

/// Estimator of angle (CONVENTIONS eq. 94, 95, 98).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// Bartlett's beamformer.
    Bartlett,
    /// Capon's beamformer (minimum variance).
    Capon,
    /// Deterministic maximum likelihood.
    Ml,
    /// MUSIC.
    Music,
    /// MUSIC's peaks as roots; uniform lines.
    RootMusic,
    /// Uniform lines and rectangles.
    Esprit,
    /// MUSIC on the subspace that the bi-iteration tracks through the snapshots.
    BiSvd {
        /// alpha of eq. 98.
        forgetting: f64,
    },
}

impl Method {
    /// The method's name in files.
    pub fn name(self) -> &'static str {
        match self {
            Method::Bartlett => "Bartlett",
            Method::Capon => "Capon",
            Method::Ml => "maximum likelihood",
            Method::Music => "MUSIC",
            Method::RootMusic => "root-MUSIC",
            Method::Esprit => "ESPRIT",
            Method::BiSvd { .. } => "Bi-SVD",
        }
    }

    /// Whether the method splits a covariance into signal and noise.
    pub fn uses_subspace(self) -> bool {
        matches!(self, Method::Music | Method::RootMusic | Method::Esprit | Method::BiSvd { .. })
    }

    pub(super) fn averages_subarrays(self) -> bool {
        self.uses_subspace() || self == Method::Capon
    }

    pub(super) fn is_gridless(self) -> bool {
        matches!(self, Method::RootMusic | Method::Esprit)
    }
}

/// Number of sources in a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SourceNumber {
    /// The number is given.
    Given(usize),
    /// By information criterion (eq. 93), at most [`Options::max_sources`]; cells where it finds none
    /// give none.
    Found(Criterion),
    /// As many as a maximum-likelihood fit needs until what it leaves is noise of the known power
    /// ([`Cells::noise_w`]), or a share of the cell's power that the model's own errors may leave; at
    /// most [`Options::max_sources`]. Works on single snapshots and any array.
    Residual {
        /// Probability that noise is taken for one more source.
        false_alarm: f64,
        /// Power that is left over the cell's power, e.g. 1e-3.
        model_error: f64,
    },
}

/// Averages over subarrays of a line or rectangle (eq. 92).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Smoothing {
    /// Where the array is even and there are fewer snapshots than channels: subarrays of two thirds of
    /// each axis, rounded up (on a line at least one element more than given sources), and
    /// forward-backward averaging.
    Auto,
    /// Nothing is averaged.
    Off,
    /// Rows and columns of the subarray.
    Subarray([usize; 2]),
}

/// Settings of an estimator of angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Angle estimation method.
    pub method: Method,
    /// Number of sources in a cell.
    pub sources: SourceNumber,
    /// Largest number of sources of one cell.
    pub max_sources: usize,
    /// Averages over subarrays.
    pub smoothing: Smoothing,
    /// Forward-backward averaging; None: wherever there are subarrays.
    pub forward_backward: Option<bool>,
    /// Added to the diagonal, over the mean of the diagonal. Capon only.
    pub loading: f64,
    /// Bartlett and Capon also drop peaks this much under the strongest.
    pub below_db: f64,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            method: Method::Music,
            sources: SourceNumber::Given(1),
            max_sources: 4,
            smoothing: Smoothing::Auto,
            forward_backward: None,
            loading: 1e-2,
            below_db: 12.0,
        }
    }
}

/// One direction of arrival.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Source {
    /// Azimuth, rad.
    pub azimuth_rad: f64,
    /// Elevation, rad.
    pub elevation_rad: f64,
    /// Least-squares power per channel in W, mean over the snapshots (eq. 97).
    pub power_w: f64,
    /// Cramér-Rao bound at the measured powers (eq. 97). Infinite where it is unknown, zero where the
    /// axis is not estimated.
    pub azimuth_std_rad: f64,
    /// Standard deviation of the elevation, rad.
    pub elevation_std_rad: f64,
    /// Another direction within the grid has the same steering vector to 1 part in 50 (eq. 99).
    pub ambiguous: bool,
}

/// Detected cells, whose phases between transmitters have been taken out
/// ([`super::doa_beamform::Beamformer::correction`]).
#[derive(Debug, Clone, Copy)]
pub struct Cells<'a> {
    /// Snapshots of each cell.
    pub snapshots: usize,
    /// Data, `[cell, snapshot, channel]`, sqrt(W).
    pub data: &'a [Complex64],
    /// Noise power of a channel in each cell, W. Without it the power that the sources leave is taken.
    pub noise_w: Option<&'a [f64]>,
}
