//! Tensors of a cube for learning: powers and amplitudes of every cell in every direction, and what is left of them when axes are taken
//! out (CONVENTIONS eq. 165).

use crate::adc::Cube;
use crate::base::error::{BadInput, Result};
use crate::base::tasks::Tasks;
use crate::dsp::doa_beamform::{Beamformer, Grid};
use crate::dsp::multiplex::decode;
use crate::dsp::{Cell, Real, Snapshots};
use crate::engine::stages::{AnySpectrum, transform};
use crate::engine::{AnyCube, Engine};
use crate::scene::radar::Radar;
use crate::scene::waveform::Multiplex;
use num_complex::Complex64;
use rayon::prelude::*;

/// How cells along an axis that is taken out become one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reduce {
    /// The largest of them: a target keeps its power.
    Max,
    /// Their sum.
    Sum,
    /// Their mean.
    Mean,
}

impl Reduce {
    /// The rule of this name.
    ///
    /// # Errors
    /// Returns an error for an unknown name.
    pub fn parse(name: &str) -> Result<Reduce> {
        match name {
            "max" => Ok(Reduce::Max),
            "sum" => Ok(Reduce::Sum),
            "mean" => Ok(Reduce::Mean),
            other => Err(BadInput::new("is not a way to reduce an axis")
                .key("reduce")
                .value(other)
                .allowed("max, sum, mean")
                .into()),
        }
    }
}

/// The bins of a Fourier transform over a line of antennas half a wavelength apart as azimuths, rad: sin = -1, -1 + 2/N, … 1 - 2/N, so
/// that the middle bin N/2 looks ahead and later bins look to the left. The beamformer towards them is that transform of the line, padded
/// with zeros to N and shifted.
pub fn fourier_azimuths(bins: usize) -> Vec<f64> {
    (0..bins).map(|k| ((2 * k) as f64 / bins as f64 - 2.0 * (bins / 2) as f64 / bins as f64).asin()).collect()
}

/// The radar's beamformer towards the directions of a grid.
///
/// # Errors
/// Returns an error for an empty grid or one with a direction that is not finite or behind the radar, and the errors of
/// [`Beamformer::new`].
pub fn beamformer(radar: &Radar, grid: Grid) -> Result<Beamformer> {
    for (key, axis) in [("azimuth", &grid.azimuth_rad), ("elevation", &grid.elevation_rad)] {
        let most = std::f64::consts::FRAC_PI_2 + 1e-9;
        if axis.is_empty() {
            return Err(BadInput::new("no direction is given").key(key).allowed("one or more angles").into());
        }
        if let Some(bad) = axis.iter().find(|a| a.is_nan() || a.abs() > most) {
            return Err(BadInput::new("the direction is not ahead of the radar")
                .key(key)
                .value(format!("{:.3} deg", bad.to_degrees()))
                .allowed("-90 to 90 deg")
                .into());
        }
    }
    let mut beam = Beamformer::new(radar)?;
    beam.grid = grid;
    Ok(beam)
}

/// Bytes of the powers that are looked at together.
const BLOCK_BYTES: usize = 64 << 20;

/// The virtual channels of cells `first`.. of a spectrum, in the order of the map, turned back by the range rate of their rows.
fn block(radar: &Radar, spectrum: &AnySpectrum, cells: std::ops::Range<usize>) -> Snapshots<f64> {
    let [rows, _, columns] = spectrum.shape();
    let own: Vec<Vec<Complex64>> = cells
        .into_par_iter()
        .map_tasks(|i| {
            let cell = Cell { doppler: (i / columns) as u32, range: (i % columns) as u32 };
            let rate = ((i / columns) as f64 - (rows / 2) as f64) * radar.velocity_bin_mps();
            let rate = if rows < 2 { 0.0 } else { rate };
            decode(radar, &spectrum.snapshot(cell), rate).channels
        })
        .collect();
    Snapshots { channels: radar.virtual_channels(), data: own.concat() }
}

/// Powers in W over Doppler rows, range columns and the directions of `beam`, with the axes that are not in `keep` (Doppler, range,
/// elevation, azimuth) taken out by `reduce`: an array over the axes that are kept, in that order. The transmitters of each cell are told
/// apart with the range rate of its row (eq. 19a), without a test of its folds. Sums are f64, in the order of the cells.
///
/// # Errors
/// Returns an error for a spectrum that is not of the radar's shape, or if the adapter fails.
pub fn powers(
    engine: &Engine,
    radar: &Radar,
    spectrum: &AnySpectrum,
    beam: &Beamformer,
    keep: [bool; 4],
    reduce: Reduce,
) -> Result<Vec<f64>> {
    let [rows, columns] = check(radar, spectrum)?;
    let size = [rows, columns, beam.grid.elevation_rad.len(), beam.grid.azimuth_rad.len()];
    let mut stride = [0; 4];
    let mut cells = 1;
    for axis in (0..4).rev().filter(|a| keep[*a]) {
        stride[axis] = cells;
        cells *= size[axis];
    }
    let grid = beam.grid.len();
    // Where each direction goes beside the place of its cell.
    let places: Vec<usize> = (0..grid).map(|d| d / size[3] * stride[2] + d % size[3] * stride[3]).collect();
    let together = (BLOCK_BYTES / (8 * grid)).max(1);
    let first = if reduce == Reduce::Max { f64::NEG_INFINITY } else { 0.0 };
    let is_whole = keep == [true; 4];
    let mut out = if is_whole { Vec::with_capacity(cells) } else { vec![first; cells] };
    for start in (0..rows * columns).step_by(together) {
        let end = (start + together).min(rows * columns);
        let looks = block(radar, spectrum, start..end);
        let found = engine.angular_power(beam, &looks, &vec![0.0; end - start])?;
        if is_whole {
            out.extend(found);
            continue;
        }
        for (i, powers) in (start..end).zip(found.chunks_exact(grid)) {
            let base = (i / columns) * stride[0] + (i % columns) * stride[1];
            for (place, p) in places.iter().zip(powers) {
                let at = &mut out[base + place];
                *at = if reduce == Reduce::Max { at.max(*p) } else { *at + p };
            }
        }
    }
    if reduce == Reduce::Mean {
        let gone: usize = (0..4).filter(|a| !keep[*a]).map(|a| size[a]).product();
        out.iter_mut().for_each(|p| *p /= gone as f64);
    }
    Ok(out)
}

/// Amplitudes in √W, `[doppler, range, elevation, azimuth]`: the complex values behind [`powers`] with all axes kept.
///
/// # Errors
/// Returns an error for a spectrum that is not of the radar's shape.
pub fn amplitudes(
    engine: &Engine,
    radar: &Radar,
    spectrum: &AnySpectrum,
    beam: &Beamformer,
) -> Result<Vec<Complex64>> {
    let [rows, columns] = check(radar, spectrum)?;
    Ok(engine.angular_amplitude(beam, &block(radar, spectrum, 0..rows * columns)))
}

/// Amplitudes of single chirps before the Doppler transform, √W, `[chirp, range, elevation, azimuth]`. `ranges` is a range spectrum
/// ([`Engine::range_spectrum`]) and `chirps` the loops that are wanted; the transmitters of a loop are told apart as if nothing moved.
///
/// # Errors
/// Returns an error for spectra that are not of the radar's shape, for a chirp that is not there, and for transmitters that are told apart
/// by Doppler bands, which takes all chirps.
pub fn chirp_amplitudes(
    engine: &Engine,
    radar: &Radar,
    ranges: &AnyCube,
    beam: &Beamformer,
    chirps: &[usize],
) -> Result<Vec<Complex64>> {
    let shape = match ranges {
        AnyCube::F32(c) => [c.chirps, c.channels, c.samples],
        AnyCube::F64(c) => [c.chirps, c.channels, c.samples],
    };
    let want = [radar.chirps, radar.channels(), radar.range_bins()];
    if shape != want {
        return Err(BadInput::new(
            "the array is not a range spectrum of this radar, [chirp, channel, range]",
        )
        .key("range_spectrum")
        .value(format!("{shape:?}"))
        .allowed(format!("{want:?}"))
        .into());
    }
    if let Some(bad) = chirps.iter().find(|m| **m >= radar.chirps) {
        return Err(BadInput::new("the frame has no such chirp")
            .key("chirps")
            .value(bad)
            .allowed(format!("0 to {}", radar.chirps - 1))
            .into());
    }
    if let Multiplex::Ddm { .. } = radar.multiplex {
        return Err(BadInput::new("transmitters in Doppler bands cannot be separated with one chirp")
            .key("chirps")
            .remedy("use a tensor of all chirps, such as rad")
            .into());
    }
    fn column<T: Real>(cube: &Cube<T>, chirp: usize, range: usize) -> Vec<Complex64> {
        let at = |c: usize| cube.data[(chirp * cube.channels + c) * cube.samples + range];
        (0..cube.channels).map(|c| Complex64::new(at(c).re.wide(), at(c).im.wide())).collect()
    }
    let own: Vec<Vec<Complex64>> = (0..chirps.len() * shape[2])
        .into_par_iter()
        .map_tasks(|i| {
            let (chirp, range) = (chirps[i / shape[2]], i % shape[2]);
            let snapshot = match ranges {
                AnyCube::F32(c) => column(c, chirp, range),
                AnyCube::F64(c) => column(c, chirp, range),
            };
            decode(radar, &snapshot, 0.0).channels
        })
        .collect();
    let looks = Snapshots { channels: radar.virtual_channels(), data: own.concat() };
    Ok(engine.angular_amplitude(beam, &looks))
}

/// The strongest cells of a tensor, strongest first, of equal ones the first: `share` of all of them, rounded up.
///
/// # Errors
/// Returns an error for a share that is not above 0 and at most 1, and for a value that is not finite.
pub fn strongest<T: Real>(tensor: &[T], share: f64) -> Result<Vec<usize>> {
    if !(share > 0.0 && share <= 1.0) {
        return Err(BadInput::new("is not a share of cells")
            .key("share")
            .value(share)
            .allowed("above 0, at most 1")
            .into());
    }
    if let Some(i) = tensor.iter().position(|p| !p.is_finite()) {
        return Err(BadInput::new("a value is not a finite number").key(format!("tensor, cell {i}")).into());
    }
    let count = ((share * tensor.len() as f64).ceil() as usize).min(tensor.len());
    let falling = |a: &T, b: &T| b.wide().total_cmp(&a.wide());
    let mut picked: Vec<usize> = if count < tensor.len() {
        // A copy of the values says which of them is the last that is taken; places take twice as much memory.
        let mut values = tensor.to_vec();
        let (above, last, _) = values.select_nth_unstable_by(count, falling);
        // Of those that equal the first value left out as many as there is room for, in their order.
        let mut room = count - above.iter().filter(|p| **p > *last).count();
        let last = *last;
        let takes = |(i, p): (usize, &T)| {
            let equal = *p == last && room > 0;
            room -= usize::from(equal);
            (equal || *p > last).then_some(i)
        };
        tensor.iter().enumerate().filter_map(takes).collect()
    } else {
        (0..tensor.len()).collect()
    };
    picked.par_sort_unstable_by(|a, b| falling(&tensor[*a], &tensor[*b]).then(a.cmp(b)));
    Ok(picked)
}

fn check(radar: &Radar, spectrum: &AnySpectrum) -> Result<[usize; 2]> {
    let shape = spectrum.shape();
    transform(radar)?.check_spectrum(shape)?;
    Ok([shape[0], shape[2]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::Precision;
    use crate::scene::radar_toml::preset;

    #[test]
    fn fourier_bins_look_where_the_transform_does() {
        let even = fourier_azimuths(8);
        assert_eq!((even[0].sin(), even[4]), (-1.0, 0.0));
        let odd = fourier_azimuths(5);
        assert!(odd[2] == 0.0 && (odd[4].sin() - 0.8).abs() < 1e-15 && (odd[0].sin() + 0.8).abs() < 1e-15);
    }

    #[test]
    fn the_strongest_are_a_share() {
        let tensor = [1.0, 5.0, 2.0, 5.0, 0.0, 3.0, 4.0];
        assert_eq!(strongest(&tensor, 0.5).unwrap(), [1, 3, 6, 5]);
        assert_eq!(strongest(&tensor, 1.0).unwrap(), [1, 3, 6, 5, 2, 0, 4]);
        assert_eq!(strongest(&tensor, 1e-9).unwrap(), [1]);
        for bad in [0.0, 1.1, f64::NAN] {
            assert_eq!(strongest(&tensor, bad).unwrap_err().exit_code(), 2);
        }
    }

    /// A cell that holds a plane wave, at rest: its power in that direction is that of the wave, and marginals are those of the whole.
    #[test]
    fn axes_are_taken_out() {
        let mut radar = preset("demo77").unwrap();
        (radar.processing.doppler_fft, radar.processing.range_fft) = (128, 256);
        let engine = Engine::Cpu(Precision::F64);
        let azimuths = fourier_azimuths(16);
        let grid = Grid { azimuth_rad: azimuths.clone(), elevation_rad: vec![0.0] };
        let beam = beamformer(&radar, grid).unwrap();
        let x = crate::detect::locate::manifold(&radar).unwrap().steering(azimuths[11], 0.0);
        let (rows, columns) = (128, 256);
        let mut data = vec![Complex64::ZERO; rows * 12 * columns];
        for (c, x) in x.iter().enumerate() {
            data[(64 * 12 + c) * columns + 40] = 3.0 * x;
        }
        let spectrum = crate::dsp::Spectrum { doppler_bins: rows, channels: 12, range_bins: columns, data };
        let spectrum = AnySpectrum::F64(spectrum);
        let of = |keep, reduce| powers(&engine, &radar, &spectrum, &beam, keep, reduce).unwrap();
        let all = of([true; 4], Reduce::Max);
        assert!((all[(64 * columns + 40) * 16 + 11] - 9.0).abs() < 1e-12);
        let values = amplitudes(&engine, &radar, &spectrum, &beam).unwrap();
        assert!(all.iter().zip(&values).all(|(p, y)| *p == y.norm_sqr()));
        let range_azimuth = of([false, true, false, true], Reduce::Sum);
        assert_eq!(range_azimuth.len(), columns * 16);
        assert_eq!(range_azimuth[40 * 16 + 11], all[(64 * columns + 40) * 16 + 11]);
        let mean = of([false, true, false, true], Reduce::Mean);
        assert_eq!(mean[40 * 16 + 11], range_azimuth[40 * 16 + 11] / rows as f64);
        let angle_doppler = of([true, false, false, true], Reduce::Max);
        assert_eq!(angle_doppler[64 * 16 + 11], range_azimuth[40 * 16 + 11]);
        assert!(beamformer(&radar, Grid { azimuth_rad: vec![2.0], elevation_rad: vec![0.0] }).is_err());
    }
}
