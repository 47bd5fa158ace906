//! The two transforms of a cube: sizes, windows and the order of rows (CONVENTIONS eq. 14).

use super::window;
use crate::adc::Cube;
use crate::base::error::{BadInput, Result};
use crate::scene::radar::{Processing, Radar, Sampling};
use crate::scene::waveform::Multiplex;

/// The two transforms of a cube: `[chirp, channel, sample]` to `[doppler, channel, range]`.
/// The windows are scaled so that eq. 14 holds with a plain sum: they carry 1/sum(w), and sqrt 2 for
/// real sampling.
#[derive(Debug, Clone, PartialEq)]
pub struct Transform {
    /// Number of chirps.
    pub chirps: usize,
    /// Number of virtual channels.
    pub channels: usize,
    /// Number of samples of a chirp.
    pub samples: usize,
    /// Length of the range transform.
    pub range_fft: usize,
    /// Bins kept: half of `range_fft` for real sampling.
    pub range_bins: usize,
    /// Length of the Doppler transform.
    pub doppler_fft: usize,
    /// Doppler bands that become channels (DDM), else 1: spectrum `[doppler / bands, band, channel, range]`.
    pub bands: usize,
    /// Factor of the power map: bands over transmitters (CONVENTIONS eq. 19a), since empty ones hold noise alone.
    pub map_scale: f64,
    /// Keystone transform, in place of the Doppler transform.
    pub keystone: Option<Keystone>,
    /// Samples are taken from the last to the first, as of a falling chirp.
    pub reversed: bool,
    /// Weights of the range transform, one for each sample, in the order in which they are taken.
    pub range_window: Vec<f64>,
    /// Weights of the Doppler transform, one for each chirp.
    pub doppler_window: Vec<f64>,
}

impl Transform {
    /// The transforms of a cube of this shape.
    ///
    /// # Errors
    /// Returns an error for an empty cube, or a transform shorter than the data.
    pub fn new(
        chirps: usize,
        channels: usize,
        samples: usize,
        sampling: Sampling,
        processing: &Processing,
    ) -> Result<Self> {
        for (key, count, fft) in [
            ("processing.range_fft", samples, processing.range_fft),
            ("processing.doppler_fft", chirps, processing.doppler_fft),
        ] {
            if count == 0 || channels == 0 {
                return Err(BadInput::new("the cube is empty")
                    .key("cube")
                    .value(format!("{chirps} x {channels} x {samples}"))
                    .allowed("at least one chirp, channel and sample")
                    .into());
            }
            if fft < count {
                return Err(BadInput::new("the FFT is shorter than the data")
                    .key(key)
                    .value(fft)
                    .allowed(format!("{count} or more"))
                    .into());
            }
        }
        let (range_bins, gain) = match sampling {
            Sampling::Real if processing.range_fft < 2 => {
                return Err(BadInput::new("real sampling needs a range FFT of at least 2")
                    .key("processing.range_fft")
                    .value(processing.range_fft)
                    .into());
            }
            Sampling::Real => (processing.range_fft / 2, std::f64::consts::SQRT_2),
            Sampling::Iq => (processing.range_fft, 1.0),
        };
        let scaled = |w: Vec<f64>, gain: f64| {
            let sum: f64 = w.iter().sum();
            w.iter().map(|v| v * gain / sum).collect()
        };
        Ok(Transform {
            chirps,
            channels,
            samples,
            range_fft: processing.range_fft,
            range_bins,
            doppler_fft: processing.doppler_fft,
            bands: 1,
            map_scale: 1.0,
            keystone: None,
            reversed: false,
            range_window: scaled(window::coefficients(processing.range_window, samples)?, gain),
            doppler_window: scaled(window::coefficients(processing.doppler_window, chirps)?, 1.0),
        })
    }

    /// The transform for a cube that holds this radar's lines.
    ///
    /// # Errors
    /// Returns an error for a cube whose shape is not the radar's.
    pub fn of_cube<T>(cube: &Cube<T>, radar: &Radar) -> Result<Self> {
        let shape = [cube.chirps, cube.channels, cube.samples];
        if cube.data.len() != shape.iter().product::<usize>() {
            return Err(BadInput::new("the number of samples does not fit the shape of the cube")
                .key("cube")
                .value(format!("{shape:?} ({} samples)", cube.data.len()))
                .into());
        }
        Self::of_shape(shape, radar)
    }

    /// The transform for a cube of this shape.
    ///
    /// # Errors
    /// Returns an error for a shape that is not the one expected.
    pub fn of_shape(shape: [usize; 3], radar: &Radar) -> Result<Self> {
        let want = [radar.chirps, radar.channels(), radar.lines().count];
        if shape != want {
            return Err(BadInput::new("the cube does not have the radar's shape [chirp, channel, sample]")
                .key("cube")
                .value(format!("{shape:?}"))
                .allowed(format!("{want:?}"))
                .remedy("give the radar that recorded the cube")
                .into());
        }
        let mut t = Self::new(shape[0], shape[1], shape[2], radar.line_sampling(), &radar.processing)?;
        if let Multiplex::Ddm { bands } = radar.multiplex {
            t.bands = bands;
            t.map_scale = bands as f64 / radar.tx.len() as f64;
        }
        if radar.processing.keystone {
            t.keystone = Some(Keystone { scale: line_scale(radar), fold: 0 });
        }
        t.reversed = radar.step_hz() < 0.0;
        Ok(t)
    }

    /// Checks that a shape `[chirps, channels, samples]` is this transform's.
    ///
    /// # Errors
    /// Returns an error for a shape that is not the one expected.
    pub fn check_shape(&self, shape: [usize; 3]) -> Result<()> {
        let problem = "the cube does not have the transform's shape [chirp, channel, sample]";
        agreed(
            shape,
            [self.chirps, self.channels, self.samples],
            problem,
            "cube",
            "give a cube of this radar",
        )
    }

    /// Checks that a shape `[chirps, channels, range bins]` is that of this transform's range spectra.
    ///
    /// # Errors
    /// Returns an error for a shape that is not the one expected.
    pub fn check_ranges(&self, shape: [usize; 3]) -> Result<()> {
        let problem = "the array is not a range spectrum of this radar, [chirp, channel, range]";
        let remedy = "give the output of the range transform with the same radar";
        agreed(shape, [self.chirps, self.channels, self.range_bins], problem, "range_spectrum", remedy)
    }

    /// Checks that a shape `[doppler, channels and bands, range bins]` is that of this transform's spectra.
    ///
    /// # Errors
    /// Returns an error for a shape that is not the one expected.
    pub fn check_spectrum(&self, shape: [usize; 3]) -> Result<()> {
        let want = [self.doppler_rows(), self.channels * self.bands, self.range_bins];
        let problem = "the array is not a range-Doppler spectrum of this radar, [doppler, channel, range]";
        agreed(shape, want, problem, "spectrum", "give the output of the transforms with the same radar")
    }

    /// Checks that the two transforms can be done one after the other.
    ///
    /// # Errors
    /// Returns an error for a keystone transform, which goes before that of range.
    pub fn check_separable(&self) -> Result<()> {
        if self.keystone.is_none() {
            return Ok(());
        }
        Err(BadInput::new(
            "the keystone transform precedes the range transform and cannot be computed separately from it",
        )
        .key("processing.range_migration")
        .value("keystone")
        .allowed("none")
        .remedy("request the range-Doppler spectrum, or leave out the keystone transform")
        .into())
    }

    /// Number of columns of the spectrum: channels x range bins.
    pub fn columns(&self) -> usize {
        self.channels * self.range_bins
    }

    /// Number of rows of the map.
    pub fn doppler_rows(&self) -> usize {
        self.doppler_fft / self.bands
    }

    /// Row of the map to which transform bin `k` goes: zero Doppler to row M/2. With B bands row and band as row · B +
    /// band: transmitter b is found b M/B rows before its range rate, and fills band b of the row at it.
    pub fn doppler_row(&self, k: usize) -> usize {
        let rows = self.doppler_rows();
        let band = (self.bands - (k + rows / 2) / rows % self.bands) % self.bands;
        (k + rows / 2) % rows * self.bands + band
    }
}

/// Checks that an array has the shape that a transform takes.
fn agreed(found: [usize; 3], wanted: [usize; 3], problem: &str, key: &str, remedy: &str) -> Result<()> {
    if found == wanted {
        return Ok(());
    }
    let bad = BadInput::new(problem).key(key).value(format!("{found:?}")).allowed(format!("{wanted:?}"));
    Err(bad.remedy(remedy).into())
}

/// Frequency of each line over that in the middle of the samples, in the order of the samples.
pub fn line_scale(radar: &Radar) -> Vec<f64> {
    let lines = radar.lines();
    let centre_hz = radar.sample_centre_hz();
    (0..lines.count).map(|n| (lines.first_hz + n as f64 * lines.step_hz) / centre_hz).collect()
}

/// How the keystone transform holds targets in their range cells.
#[derive(Debug, Clone, PartialEq)]
pub struct Keystone {
    /// The instantaneous frequency over that in the middle of the samples, for each sample ([`line_scale`] for a radar).
    pub scale: Vec<f64>,
    /// Number of unambiguous intervals of the map that a target of interest moves faster than its row says: targets of
    /// another fold are not focused.
    pub fold: i32,
}

impl Keystone {
    /// Checks the scale of a keystone transform.
    ///
    /// # Errors
    /// Returns an error for a scale that is not one positive number a sample.
    pub fn check(scale: &[f64], samples: usize) -> Result<()> {
        if scale.len() == samples && scale.iter().all(|s| s.is_finite() && *s > 0.0) {
            return Ok(());
        }
        Err(BadInput::new("the keystone transform needs one positive scale for each sample")
            .key("scale")
            .value(format!("{} values", scale.len()))
            .allowed(format!("{samples} positive numbers"))
            .into())
    }
}
