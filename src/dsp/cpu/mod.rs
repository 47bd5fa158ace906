//! Processing on the cpu, in f32 or f64.

mod cfar;
pub mod cfar_ca;
pub mod cfar_go_so;
pub mod cfar_noise;
pub mod cfar_os;
pub mod doa_beamform;
pub mod doa_spectrum;
pub mod fft;
pub mod keystone;
pub mod lines;
pub mod peaks;
pub mod power;
pub mod snapshot;
pub mod stream;
pub mod zero_doppler;

use crate::adc::Cube;
use crate::base::error::Result;
use crate::dsp::transform::Transform;
use crate::dsp::{self, Cell, Detection, PowerMap, RangeDoppler, Real, Spectrum};
use crate::scene::radar::{Cfar, CfarKind, Radar};

/// Processes a cube to detected cells: windows, range and Doppler transform, power, CFAR, peaks, snapshots.
///
/// # Errors
/// Returns an error if the cube's shape is not the radar's, a setting is out of its range, or a sample is not finite.
pub fn process<T: Real>(cube: &Cube<T>, radar: &Radar) -> Result<(Spectrum<T>, RangeDoppler<T>)> {
    process_by(cube, &Transform::of_cube(cube, radar)?, &radar.processing.cfar)
}

/// [`process`] by a transform of one's choice.
///
/// # Errors
/// Returns the errors of [`process`].
pub fn process_by<T: Real>(
    cube: &Cube<T>,
    transform: &Transform,
    cfar: &Cfar,
) -> Result<(Spectrum<T>, RangeDoppler<T>)> {
    let spectrum = spectrum(cube, transform)?;
    let map = scaled_power(&spectrum, transform);
    let detection = detect(&map, cfar, spectrum.channels)?;
    let cells = peaks::peaks(&map, &detection.mask);
    let noise = noise(&map, cfar, spectrum.channels, &cells)?;
    let snapshots = snapshot::snapshots(&spectrum, &cells);
    Ok((spectrum, RangeDoppler { map, detection, cells, noise, snapshots }))
}

/// [`process_by`] to the power map alone, without a detector.
///
/// # Errors
/// Returns the errors of [`process`].
pub fn map_by<T: Real>(cube: &Cube<T>, transform: &Transform) -> Result<RangeDoppler<T>> {
    let spectrum = spectrum(cube, transform)?;
    let map = scaled_power(&spectrum, transform);
    dsp::cfar::check_map(&map)?;
    Ok(RangeDoppler::of_map(map, spectrum.channels))
}

/// The power map of a spectrum, W: of Doppler bands as if none of them were empty (CONVENTIONS eq. 19a).
pub fn scaled_power<T: Real>(spectrum: &Spectrum<T>, transform: &Transform) -> PowerMap<T> {
    let mut map = power::power(spectrum);
    if transform.bands > 1 {
        let share = T::of(transform.map_scale);
        map.data.iter_mut().for_each(|p| *p = *p * share);
    }
    map
}

/// Computes both transforms of a cube whose shape is theirs, without range migration if they ask for that.
///
/// # Errors
/// Returns the errors of [`keystone::spectrum`].
pub fn spectrum<T: Real>(cube: &Cube<T>, transform: &Transform) -> Result<Spectrum<T>> {
    match &transform.keystone {
        Some(k) => keystone::spectrum(cube, transform, &k.scale, k.fold),
        None => Ok(fft::spectrum(cube, transform)),
    }
}

/// The detector that `cfar` names, on a map that is the mean over `channels` looks.
///
/// # Errors
/// Returns an error for a map that is empty or not finite, or for a detector that does not fit it.
///
/// # Example
/// On noise alone the share of cells over the threshold is the probability of false alarm, here 1 % of 16,384 cells.
///
/// ```
/// use catseye::base::rng::Draws;
/// use catseye::dsp::{PowerMap, cpu::detect};
/// use catseye::scene::radar::{Cfar, CfarKind};
///
/// let mut draws = Draws::new(3, 0);
/// let (doppler_bins, range_bins) = (64, 256);
/// let data: Vec<f64> = (0..doppler_bins * range_bins).map(|_| -draws.uniform().ln()).collect();
/// let map = PowerMap { doppler_bins, range_bins, data };
/// let cfar = Cfar { kind: CfarKind::Ca, guard: [1, 1], train: [2, 4], pfa: 0.01 };
/// let alarms = detect(&map, &cfar, 1)?.mask.iter().filter(|is_over| **is_over).count();
/// // 164 are expected, with a standard deviation of about 13.
/// assert!((120..=210).contains(&alarms), "{alarms}");
/// # Ok::<(), catseye::Error>(())
/// ```
pub fn detect<T: Real>(map: &PowerMap<T>, cfar: &Cfar, channels: usize) -> Result<Detection<T>> {
    dsp::cfar::check_map(map)?;
    let columns = dsp::cfar::columns(cfar, channels, map.doppler_bins, map.range_bins)?;
    let mask = match cfar.kind {
        CfarKind::Ca => cfar_ca::cfar_ca(map, cfar, &columns),
        CfarKind::Go | CfarKind::So => cfar_go_so::cfar_go_so(map, cfar, &columns),
        CfarKind::Os { .. } => cfar_os::cfar_os(map, cfar, &columns),
    };
    Ok(Detection { mask, ratio: dsp::cfar::ratios(&columns) })
}

/// The noise power in W in these cells, detected or not, as the detector estimates it. Whole pictures are not needed
/// for detection, and the order statistic of every cell costs ten times what the mask does.
///
/// # Errors
/// Returns the errors of [`detect`], and an error if a cell lies outside the map.
pub fn noise<T: Real>(map: &PowerMap<T>, cfar: &Cfar, channels: usize, cells: &[Cell]) -> Result<Vec<T>> {
    dsp::cfar::check_map(map)?;
    dsp::cfar::check_cells(map, cells)?;
    let columns = dsp::cfar::columns(cfar, channels, map.doppler_bins, map.range_bins)?;
    Ok(cfar_noise::noise(map, cfar, &columns, cells))
}

/// The power in W that each cell of a map has to exceed to be detected, `[doppler, range]`.
///
/// # Errors
/// Returns the errors of [`detect`].
pub fn threshold<T: Real>(map: &PowerMap<T>, cfar: &Cfar, channels: usize) -> Result<Vec<T>> {
    let (rows, columns) = (map.doppler_bins, map.range_bins);
    let cell = |i: usize| Cell { doppler: (i / columns) as u32, range: (i % columns) as u32 };
    let every: Vec<Cell> = (0..rows * columns).map(cell).collect();
    let ratio: Vec<T> = dsp::cfar::ratios(&dsp::cfar::columns(cfar, channels, rows, columns)?);
    let noise = noise(map, cfar, channels, &every)?;
    Ok(noise.into_iter().enumerate().map(|(i, w)| w * ratio[i % columns]).collect())
}
