//! The spectra over angle behind the points of a map.

use super::ambiguity::Standing;
use super::bursts::Known;
use super::locate::{Decoded, accuracy, decoded, fold_test, known_of, manifold, options};
use super::points::{peaks, range_m, wavelength_ratio};
use crate::base::error::Result;
use crate::dsp::RangeDoppler;
use crate::dsp::doa_beamform::{Beamformer, Grid};
use crate::dsp::doa_estimate::{Cells, Estimator};
use crate::engine::Engine;
use crate::scene::radar::{AngleMethod, Radar};
use glam::DVec3;

/// What the processing saw in every direction that it searched, for the cells of one map that it searched.
#[derive(Debug, Clone, PartialEq)]
pub struct AngleSpectra {
    /// Directions of the columns and rows.
    pub grid: Grid,
    /// The cells, in the order of the map's.
    pub cells: Vec<SpectrumCell>,
    /// Values `[cell, elevation, azimuth]`: power in W, but for MUSIC and Bi-SVD a number of 1 or more that is large where a source is.
    pub values: Vec<f64>,
}

/// A cell whose directions were searched.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct SpectrumCell {
    /// Column of the map.
    pub range_bin: u32,
    /// Row of the map.
    pub doppler_row: u32,
    /// Range of the peak between the cells, m.
    pub range_m: f64,
    /// Range rate of the peak, unfolded as far as it is known, m/s.
    pub range_rate_mps: f64,
}

/// The spectra over angle behind the points of each ramp's map of a frame. `maps` are those after [`points`](super::locate::points) has chosen
/// their cells; `velocity_mps` is the radar's own in its frame, where it is known.
///
/// # Errors
/// Returns an error if the radar's angle method has no spectrum (ESPRIT and root-MUSIC), if its array or calibration does not suit the
/// method, or if the engine fails.
pub fn angle_spectra(
    engine: &Engine,
    radar: &Radar,
    maps: &[RangeDoppler<f64>],
    velocity_mps: Option<DVec3>,
) -> Result<Vec<AngleSpectra>> {
    let known = known_of(radar, maps)?;
    let ramps = maps.iter().zip(&known).enumerate();
    ramps.map(|(i, (found, known))| of_map(engine, &radar.part(i), found, velocity_mps, known)).collect()
}

/// Those of one map. `radar` is that of its ramp, `known` what other bursts know of its cells' range rates.
fn of_map(
    engine: &Engine,
    radar: &Radar,
    found: &RangeDoppler<f64>,
    velocity_mps: Option<DVec3>,
    known: &[Option<Known>],
) -> Result<AngleSpectra> {
    let grid = Grid::new(radar)?;
    let accuracy = accuracy(radar)?;
    let (tops, rates) = peaks(radar, found, &accuracy);
    if tops.is_empty() {
        return Ok(AngleSpectra { grid, cells: Vec::new(), values: Vec::new() });
    }
    let folds = fold_test(radar)?;
    let standing = velocity_mps.map(|velocity_mps| Standing::seen_by(radar, velocity_mps));
    let Decoded { snapshots, noise, rates, .. } =
        decoded(radar, found, &rates, folds.as_ref(), standing.as_ref(), known);
    let angle = &radar.processing.angle;
    let values = if angle.method == AngleMethod::Bartlett && angle.calibration.is_none() {
        engine.angular_power(&Beamformer::new(radar)?, &snapshots, &vec![0.0; tops.len()])?
    } else {
        let estimator = Estimator::new(manifold(radar)?, grid.clone(), options(angle))?;
        let cells = Cells { snapshots: 1, data: &snapshots.data, noise_w: Some(&noise) };
        estimator.spectra(&cells, |steering, forms| engine.forms(steering, forms))?
    };
    let cells = tops
        .iter()
        .zip(&found.cells)
        .zip(&rates)
        .map(|((top, cell), (range_rate_mps, ..))| {
            let range_m = range_m(radar, top.range, *range_rate_mps, accuracy.coupling_s);
            SpectrumCell {
                range_bin: cell.range,
                doppler_row: cell.doppler,
                range_m,
                range_rate_mps: *range_rate_mps * wavelength_ratio(radar, range_m.max(0.0)),
            }
        })
        .collect();
    Ok(AngleSpectra { grid, cells, values })
}
