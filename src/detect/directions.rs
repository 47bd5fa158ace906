//! Directions of arrival of any snapshots, by the method and with the settings of a radar: what the chain does in its detected cells.

use super::ambiguity::{Ambiguity, Standing};
use super::locate::{accuracy, decoded, fold_test, manifold, options};
use super::points::{peaks, range_m, stretched, wavelength_ratio};
use crate::base::error::{BadInput, Result};
use crate::dsp::doa_beamform::{Beamformer, Grid};
use crate::dsp::doa_covariance::eigen;
use crate::dsp::doa_estimate::{Cells, Estimator, Source, SourceNumber};
use crate::dsp::doa_manifold::Matrix;
use crate::dsp::peaks::Peak;
use crate::dsp::{RangeDoppler, Snapshots};
use crate::engine::Engine;
use crate::scene::radar::{AngleMethod, Radar};
use glam::DVec3;
use num_complex::Complex64;

/// The snapshots of detected cells with their transmitters told apart, as the chain hands them to its estimator of angle.
#[derive(Debug, Clone, PartialEq)]
pub struct SeparatedCells {
    /// Snapshots over the virtual channels, `[cell, tx x rx]`, √W, without the turns between transmitters.
    pub snapshots: Snapshots<f64>,
    /// Noise of a virtual channel in each cell, W.
    pub noise_w: Vec<f64>,
    /// Range rate of each cell's peak, unfolded as far as the cell itself tells, m/s.
    pub range_rates_mps: Vec<f64>,
    /// What is known of the folds of each range rate.
    pub ambiguity: Vec<Ambiguity>,
    /// Range of each cell's peak from the middle of the array (CONVENTIONS eq. 15), m.
    pub ranges_m: Vec<f64>,
}

/// Tells the transmitters of detected cells apart. `radar` is that of the map's ramp ([`Radar::part`]) and `velocity_mps` the radar's own in
/// its frame, where it is known. What other bursts of the frame know of the range rates is not asked.
///
/// # Errors
/// Returns an error if a window of the radar's settings cannot be computed.
pub fn separated(
    radar: &Radar,
    found: &RangeDoppler<f64>,
    velocity_mps: Option<DVec3>,
) -> Result<SeparatedCells> {
    let mut taken = found.clone();
    let accuracy = accuracy(radar)?;
    let (tops, rates) = peaks(radar, &taken, &accuracy);
    taken.cells.truncate(tops.len());
    taken.noise.truncate(tops.len());
    taken.snapshots.data.truncate(tops.len() * taken.snapshots.channels);
    let folds = fold_test(radar)?;
    let standing = velocity_mps.map(|v| Standing::seen_by(radar, v));
    let all = decoded(radar, &taken, &rates, folds.as_ref(), standing.as_ref(), &[]);
    let range = |(top, rate): (&Peak, f64)| range_m(radar, top.range, rate, accuracy.coupling_s);
    let ranges_m: Vec<f64> = tops.iter().zip(all.rates.iter().map(|r| r.0)).map(range).collect();
    // Eq. 16a, as points have their range rates.
    let longer = |(rate, range): (f64, &f64)| rate * wavelength_ratio(radar, range.max(0.0));
    Ok(SeparatedCells {
        snapshots: all.snapshots,
        noise_w: all.noise,
        range_rates_mps: all.rates.iter().map(|r| r.0).zip(&ranges_m).map(longer).collect(),
        ranges_m,
        ambiguity: all.rates.iter().map(|r| r.1).collect(),
    })
}

/// Whether the chain's beamformer with its window looks for directions, and not one of the estimators.
fn is_beamformer(radar: &Radar) -> bool {
    radar.processing.angle.method == AngleMethod::Bartlett && radar.processing.angle.calibration.is_none()
}

fn check(cells: &Cells<'_>, channels: usize) -> Result<usize> {
    let values = cells.snapshots * channels;
    if values == 0 || !cells.data.len().is_multiple_of(values) {
        return Err(BadInput::new("the snapshots do not fit the array of this radar")
            .key("snapshots")
            .value(format!("{} values", cells.data.len()))
            .allowed(format!("{} x {channels} virtual channels for each cell", cells.snapshots))
            .remedy("separate the transmitters first, and give the radar of the snapshots")
            .into());
    }
    match cells.data.iter().position(|z| !z.is_finite()) {
        Some(i) => Err(BadInput::new("a snapshot is not finite")
            .key(format!("snapshots, cell {}, channel {}", i / values, i % channels))
            .value(cells.data[i])
            .remedy("leave out the cell")
            .into()),
        None => Ok(cells.data.len() / values),
    }
}

/// Mean power of the beamformer over the snapshots of each cell, W, `[cell, elevation, azimuth]`.
fn mean_powers(engine: &Engine, beam: &Beamformer, cells: &Cells<'_>) -> Result<Vec<f64>> {
    let looks = Snapshots { channels: beam.channels(), data: cells.data.to_vec() };
    let rates = vec![0.0; looks.data.len() / looks.channels];
    let powers = engine.angular_power(beam, &looks, &rates)?;
    if cells.snapshots == 1 {
        return Ok(powers);
    }
    let (grid, share) = (beam.grid.len(), 1.0 / cells.snapshots as f64);
    let cell = |p: &[f64]| -> Vec<f64> {
        (0..grid).map(|d| share * p.iter().skip(d).step_by(grid).sum::<f64>()).collect()
    };
    Ok(powers.chunks_exact(grid * cells.snapshots).flat_map(cell).collect())
}

/// Angles of sources by the wavelength with which they come back from `ranges_m`, one for each cell (eq. 16a).
fn by_range(radar: &Radar, ranges_m: &[f64], found: &mut [Vec<Source>]) -> Result<()> {
    if ranges_m.len() != found.len() || ranges_m.iter().any(|r| !r.is_finite()) {
        return Err(BadInput::new(
            "the number of ranges differs from the number of cells, or a range is not finite",
        )
        .key("range_m")
        .value(format!("{} values", ranges_m.len()))
        .allowed(format!("{} finite numbers, in metres", found.len()))
        .remedy("give the ranges with which the cells were separated")
        .into());
    }
    let std = accuracy(radar)?.std(1.0, 0.0, 0.0);
    let measured = [std.azimuth_rad.is_some(), std.elevation_rad.is_some()];
    for (sources, range_m) in found.iter_mut().zip(ranges_m) {
        let longer = wavelength_ratio(radar, range_m.max(0.0));
        for s in sources {
            [s.azimuth_rad, s.elevation_rad] = stretched([s.azimuth_rad, s.elevation_rad], measured, longer);
        }
    }
    Ok(())
}

/// The sources of each cell, strongest first, by the method of the radar's settings. With `bartlett` and no calibration that is the
/// strongest peak of the beamformer with the angle window (CONVENTIONS eq. 19), whose standard deviations are not a number here, else what
/// [`Estimator::estimate_cells`] finds. With `ranges_m`, one for each cell, angles are by the wavelength with which a ramp comes back from
/// there (eq. 16a), as those of points are; without, by the radar's own.
///
/// # Errors
/// Returns an error for snapshots that are not of the radar's virtual channels or not finite, for an array that does not suit the method,
/// without the noise where the number of sources is found by it, or if the engine fails.
pub fn directions(
    engine: &Engine,
    radar: &Radar,
    cells: &Cells<'_>,
    ranges_m: Option<&[f64]>,
) -> Result<Vec<Vec<Source>>> {
    let mut found = by_carrier(engine, radar, cells)?;
    if let Some(ranges) = ranges_m {
        by_range(radar, ranges, &mut found)?;
    }
    Ok(found)
}

/// As [`directions`], by the radar's own wavelength.
fn by_carrier(engine: &Engine, radar: &Radar, cells: &Cells<'_>) -> Result<Vec<Vec<Source>>> {
    let count = check(cells, radar.virtual_channels())?;
    if !is_beamformer(radar) {
        let estimator =
            Estimator::new(manifold(radar)?, Grid::new(radar)?, options(&radar.processing.angle))?;
        return estimator.estimate_cells(cells, |steering, forms| engine.forms(steering, forms));
    }
    let beam = Beamformer::new(radar)?;
    let powers = mean_powers(engine, &beam, cells)?;
    let values = cells.snapshots * beam.channels();
    Ok((0..count)
        .map(|i| {
            let looks = &cells.data[i * values..(i + 1) * values];
            let power = &powers[i * beam.grid.len()..(i + 1) * beam.grid.len()];
            let first = &looks[..beam.channels()];
            let Some(top) = beam.strongest(power, first, 0.0) else { return Vec::new() };
            let of = |x: &[Complex64]| beam.amplitude(x, 0.0, top.azimuth_rad, top.elevation_rad).norm_sqr();
            let sum: f64 = looks.chunks_exact(beam.channels()).map(of).sum();
            let power_w = if cells.snapshots == 1 { sum } else { sum / cells.snapshots as f64 };
            vec![Source {
                azimuth_rad: top.azimuth_rad,
                elevation_rad: top.elevation_rad,
                power_w,
                azimuth_std_rad: f64::NAN,
                elevation_std_rad: f64::NAN,
                ambiguous: false,
            }]
        })
        .collect())
}

/// The spectrum over angle of each cell, `[cell, elevation, azimuth]`, by the method of the radar's settings: as
/// [`angle_spectra`](super::spectra::angle_spectra) has it, in W but for MUSIC and Bi-SVD.
///
/// # Errors
/// Returns the errors of [`directions`], and an error for a method that has no spectrum.
pub fn spectra(engine: &Engine, radar: &Radar, cells: &Cells<'_>) -> Result<(Grid, Vec<f64>)> {
    check(cells, radar.virtual_channels())?;
    let grid = Grid::new(radar)?;
    if is_beamformer(radar) {
        let values = mean_powers(engine, &Beamformer::new(radar)?, cells)?;
        return Ok((grid, values));
    }
    let estimator = Estimator::new(manifold(radar)?, grid.clone(), options(&radar.processing.angle))?;
    let values = estimator.spectra(cells, |steering, forms| engine.forms(steering, forms))?;
    Ok((grid, values))
}

/// As many snapshots as channels whose covariance is `covariance`, `[channel, channel]`, to rounding: what estimators ask of a covariance they
/// ask of these.
///
/// # Errors
/// Returns an error for a matrix that is not square, Hermitian and positive to rounding, or not of the radar's virtual channels, and where the
/// number of sources is to be found by a criterion, which asks how many snapshots there were.
pub fn snapshots_of_covariance(radar: &Radar, covariance: &[Complex64]) -> Result<Vec<Complex64>> {
    let n = radar.virtual_channels();
    let bad = |problem: &str| {
        BadInput::new(problem)
            .key("covariance")
            .allowed(format!("Hermitian, {n} x {n}, without negative eigenvalues"))
            .remedy("give the mean of x x^H over snapshots of the virtual channels")
    };
    if covariance.len() != n * n {
        return Err(bad("does not fit the array of this radar")
            .value(format!("{} values", covariance.len()))
            .into());
    }
    if covariance.iter().any(|z| !z.is_finite()) {
        return Err(bad("is not finite").into());
    }
    let largest = covariance.iter().map(|z| z.norm()).fold(0.0, f64::max);
    let slack = 1e-5 * largest;
    let at = |i: usize, j: usize| covariance[i * n + j];
    if (0..n).any(|i| (0..=i).any(|j| (at(i, j) - at(j, i).conj()).norm() > slack)) {
        return Err(bad("is not Hermitian").into());
    }
    if let SourceNumber::Found(_) = options(&radar.processing.angle).sources {
        return Err(BadInput::new(
            "a criterion needs the number of snapshots, which a covariance does not state",
        )
        .key("angle.sources")
        .allowed("the number of sources, or \"residual\" with the noise")
        .remedy("give the snapshots themselves, or the number of sources")
        .into());
    }
    let e = eigen(&Matrix::from_fn(n, n, |i, j| 0.5 * (at(i, j) + at(j, i).conj())))?;
    if e.values.iter().any(|v| *v < -slack) {
        return Err(bad("has a negative eigenvalue").into());
    }
    let mut looks = Vec::with_capacity(n * n);
    for t in 0..n {
        let scale = (n as f64 * e.values[t].max(0.0)).sqrt();
        looks.extend((0..n).map(|c| e.vectors[(c, t)] * scale));
    }
    Ok(looks)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::Precision;
    use crate::scene::processing_changes::with_processing;
    use crate::scene::radar_toml::preset;

    fn radar(method: &str) -> Radar {
        let changes = serde_json::json!({ "angle": { "method": method, "sources": 1 }, "azimuth_bins": 128 });
        with_processing(&preset("demo77").unwrap(), changes.as_object().unwrap()).unwrap()
    }

    #[test]
    fn every_method_finds_a_plane_wave() {
        let engine = Engine::Cpu(Precision::F64);
        let azimuth = 0.3;
        for method in ["bartlett", "capon", "ml", "music", "root-music", "esprit", "bi-svd"] {
            let radar = radar(method);
            let x = manifold(&radar).unwrap().steering(azimuth, 0.0);
            let cells = Cells { snapshots: 1, data: &x, noise_w: None };
            let found = directions(&engine, &radar, &cells, None).unwrap();
            let off = found[0][0].azimuth_rad - azimuth;
            // Between the beamformer's directions a parabola stands for the window's own response.
            assert!(off.abs() < if method == "bartlett" { 2e-3 } else { 1e-4 }, "{method}: {off}");
            assert!((found[0][0].power_w - 1.0).abs() < 2e-3, "{method}: {}", found[0][0].power_w);
            // The covariance says the same.
            let n = x.len();
            let r: Vec<Complex64> = (0..n * n).map(|i| x[i / n] * x[i % n].conj()).collect();
            let looks = snapshots_of_covariance(&radar, &r).unwrap();
            let cells = Cells { snapshots: n, data: &looks, noise_w: None };
            let again = directions(&engine, &radar, &cells, None).unwrap();
            assert!((again[0][0].azimuth_rad - azimuth).abs() < 2e-3, "{method} by covariance");
        }
    }

    #[test]
    fn what_is_no_covariance_is_refused() {
        let radar = radar("music");
        let n = radar.virtual_channels();
        let unit = |i: usize| Complex64::from(f64::from(u8::from(i.is_multiple_of(n + 1))));
        let good: Vec<Complex64> = (0..n * n).map(unit).collect();
        assert!(snapshots_of_covariance(&radar, &good).is_ok());
        let mut skew = good.clone();
        skew[1] = Complex64::I;
        let negative: Vec<Complex64> = good.iter().map(|z| -z).collect();
        for (bad, part) in
            [(&good[1..], "array"), (&skew[..], "Hermitian"), (&negative[..], "negative eigenvalue")]
        {
            let e = snapshots_of_covariance(&radar, bad).unwrap_err();
            assert!(e.exit_code() == 2 && e.to_string().contains(part), "{e}");
        }
    }
}
