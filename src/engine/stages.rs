//! The stages of the chain by themselves, on arrays of the host: each gives to the bit what the chain ([`Engine::range_doppler`]) gives
//! on the same engine.

use super::{AnyCube, Engine, Precision};
use crate::adc::Cube;
use crate::base::error::{Error, Result};
use crate::dsp::cpu::{self, lines::prepared as lines};
use crate::dsp::doa_beamform::Beamformer;
use crate::dsp::transform::Transform;
use crate::dsp::{self, Cell, Detection, PowerMap, Real, Snapshots, Spectrum};
use crate::scene::radar::{Cfar, Radar};
use num_complex::{Complex, Complex64};
use std::borrow::Cow;

/// A range-Doppler spectrum in the precision of its engine.
#[derive(Debug, Clone, PartialEq)]
pub enum AnySpectrum {
    /// In single precision.
    F32(Spectrum<f32>),
    /// In double precision.
    F64(Spectrum<f64>),
}

impl AnySpectrum {
    /// Doppler rows, channels (times Doppler bands) and range columns.
    pub fn shape(&self) -> [usize; 3] {
        match self {
            AnySpectrum::F32(s) => [s.doppler_bins, s.channels, s.range_bins],
            AnySpectrum::F64(s) => [s.doppler_bins, s.channels, s.range_bins],
        }
    }

    /// The channels of a cell, √W, widened exactly.
    pub fn snapshot(&self, cell: Cell) -> Vec<Complex64> {
        fn of<T: Real>(s: &Spectrum<T>, cell: Cell) -> Vec<Complex64> {
            let start = cell.doppler as usize * s.channels * s.range_bins + cell.range as usize;
            let at = |c: usize| s.data[start + c * s.range_bins];
            (0..s.channels).map(|c| Complex64::new(at(c).re.wide(), at(c).im.wide())).collect()
        }
        match self {
            AnySpectrum::F32(s) => of(s, cell),
            AnySpectrum::F64(s) => of(s, cell),
        }
    }
}

/// What the detector finds in a map.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundCells {
    /// The decision in each cell.
    pub detection: Detection<f64>,
    /// The peaks among the detected cells, strongest first.
    pub cells: Vec<Cell>,
    /// Estimated mean noise power in each of `cells`, W.
    pub noise_w: Vec<f64>,
}

fn wide_map(map: PowerMap<f32>) -> PowerMap<f64> {
    PowerMap {
        doppler_bins: map.doppler_bins,
        range_bins: map.range_bins,
        data: map.data.into_iter().map(f64::from).collect(),
    }
}

fn narrow_map(map: &PowerMap<f64>) -> PowerMap<f32> {
    PowerMap {
        doppler_bins: map.doppler_bins,
        range_bins: map.range_bins,
        data: map.data.iter().map(|p| *p as f32).collect(),
    }
}

fn wide(list: Vec<f32>) -> Vec<f64> {
    list.into_iter().map(f64::from).collect()
}

/// A cube whose samples are range bins.
fn ranges_of<T: Real>(cube: &Cube<T>, t: &Transform) -> Result<Cube<T>> {
    t.check_separable()?;
    let mut out = Cube::zeros(t.chirps, t.channels, t.range_bins);
    cpu::fft::range(cube, t, &mut out.data);
    Ok(out)
}

fn doppler_of<T: Real>(ranges: &Cube<T>, t: &Transform) -> Result<Spectrum<T>> {
    t.check_ranges([ranges.chirps, ranges.channels, ranges.samples])?;
    t.check_separable()?;
    let mut data = vec![Complex::default(); t.doppler_fft * t.columns()];
    data[..ranges.data.len()].copy_from_slice(&ranges.data);
    cpu::fft::doppler(t, &mut data);
    let [doppler_bins, channels] = [t.doppler_rows(), t.channels * t.bands];
    Ok(Spectrum { doppler_bins, channels, range_bins: t.range_bins, data })
}

fn mean_power<T: Real>(spectrum: &Spectrum<T>, t: &Transform) -> Result<PowerMap<T>> {
    t.check_spectrum([spectrum.doppler_bins, spectrum.channels, spectrum.range_bins])?;
    Ok(cpu::scaled_power(spectrum, t))
}

fn mixed<T>() -> Result<T> {
    Err(Error::Failed("the precision of the array differs from that of the engine".into()))
}

impl Engine {
    /// The range transform of every chirp of one ramp (`radar` is [`Radar::part`] of it), `[chirp, channel, range]`, √W: windowed,
    /// normalised and, where the radar's settings say so, without what stands still (CONVENTIONS eq. 14, 88).
    ///
    /// # Errors
    /// Returns an error if the cube's shape is not the radar's, for a keystone transform, which comes before that of range, for samples
    /// in another precision than the engine's, or if the adapter fails.
    pub fn range_spectrum(&self, radar: &Radar, cube: &AnyCube) -> Result<AnyCube> {
        Ok(match (self, cube) {
            (Engine::Cpu(_), AnyCube::F64(cube)) => {
                let cube = &*lines(cube, radar)?;
                AnyCube::F64(ranges_of(cube, &Transform::of_cube(cube, radar)?)?)
            }
            (Engine::Cpu(_), AnyCube::F32(cube)) => {
                let cube = &*lines(cube, radar)?;
                AnyCube::F32(ranges_of(cube, &Transform::of_cube(cube, radar)?)?)
            }
            (Engine::Gpu(gpu), AnyCube::F32(cube)) => {
                let cube = &*lines(cube, radar)?;
                AnyCube::F32(dsp::spectrum::range_alone(gpu, cube, &Transform::of_cube(cube, radar)?)?)
            }
            (Engine::Gpu(_), AnyCube::F64(_)) => return mixed(),
        })
    }

    /// The Doppler transform of what [`Engine::range_spectrum`] gives, `[doppler, channel, range]`.
    ///
    /// # Errors
    /// Returns an error for spectra of another shape, and the errors of [`Engine::range_spectrum`].
    pub fn doppler_spectrum(&self, radar: &Radar, ranges: &AnyCube) -> Result<AnySpectrum> {
        let t = transform(radar)?;
        Ok(match (self, ranges) {
            (Engine::Cpu(_), AnyCube::F64(ranges)) => AnySpectrum::F64(doppler_of(ranges, &t)?),
            (Engine::Cpu(_), AnyCube::F32(ranges)) => AnySpectrum::F32(doppler_of(ranges, &t)?),
            (Engine::Gpu(gpu), AnyCube::F32(ranges)) => {
                AnySpectrum::F32(dsp::spectrum::doppler_alone(gpu, ranges, &t)?)
            }
            (Engine::Gpu(_), AnyCube::F64(_)) => return mixed(),
        })
    }

    /// Both transforms of one ramp, of the Doppler fold zero, `[doppler, channel, range]`, √W.
    ///
    /// # Errors
    /// Returns an error if the cube's shape is not the radar's, for samples in another precision than the engine's, or if the adapter
    /// fails.
    pub fn spectrum(&self, radar: &Radar, cube: &AnyCube) -> Result<AnySpectrum> {
        Ok(match (self, cube) {
            (Engine::Cpu(_), AnyCube::F64(cube)) => {
                let cube = &*lines(cube, radar)?;
                AnySpectrum::F64(cpu::spectrum(cube, &Transform::of_cube(cube, radar)?)?)
            }
            (Engine::Cpu(_), AnyCube::F32(cube)) => {
                let cube = &*lines(cube, radar)?;
                AnySpectrum::F32(cpu::spectrum(cube, &Transform::of_cube(cube, radar)?)?)
            }
            (Engine::Gpu(gpu), AnyCube::F32(cube)) => {
                let cube: Cow<'_, Cube<f32>> = lines(cube, radar)?;
                let mut recorder = gpu.recorder("spectrum");
                let t = Transform::of_cube(&*cube, radar)?;
                let made = dsp::spectrum::record(&mut recorder, gpu, &cube, &t)?;
                recorder.submit()?;
                AnySpectrum::F32(made.read(gpu)?)
            }
            (Engine::Gpu(_), AnyCube::F64(_)) => return mixed(),
        })
    }

    /// The power map of a spectrum, W: the mean over its channels.
    ///
    /// # Errors
    /// Returns an error for a spectrum that is not of the radar's shape or in another precision than the engine's, or if the adapter
    /// fails.
    pub fn power(&self, radar: &Radar, spectrum: &AnySpectrum) -> Result<PowerMap<f64>> {
        let t = transform(radar)?;
        Ok(match (self, spectrum) {
            (Engine::Cpu(_), AnySpectrum::F64(s)) => mean_power(s, &t)?,
            (Engine::Cpu(_), AnySpectrum::F32(s)) => wide_map(mean_power(s, &t)?),
            (Engine::Gpu(gpu), AnySpectrum::F32(s)) => wide_map(dsp::device::power(gpu, s, &t)?),
            (Engine::Gpu(_), AnySpectrum::F64(_)) => return mixed(),
        })
    }

    /// The detector that `cfar` names, on a map that is the mean over `channels` looks, with the peaks among what it finds and the noise
    /// there.
    ///
    /// # Errors
    /// Returns an error for a map that is empty or not finite, for a detector that does not fit it, or if the adapter fails.
    pub fn cells(&self, map: &PowerMap<f64>, cfar: &Cfar, channels: usize) -> Result<FoundCells> {
        if let Engine::Cpu(Precision::F64) = self {
            let detection = cpu::detect(map, cfar, channels)?;
            let cells = cpu::peaks::peaks(map, &detection.mask);
            let noise_w = cpu::noise(map, cfar, channels, &cells)?;
            return Ok(FoundCells { detection, cells, noise_w });
        }
        let map = narrow_map(map);
        let detection = match self {
            Engine::Cpu(_) => cpu::detect(&map, cfar, channels)?,
            Engine::Gpu(gpu) => dsp::device::detect(gpu, &map, cfar, channels)?,
        };
        // Peaks are found by comparisons alone, on either engine alike.
        let cells = cpu::peaks::peaks(&map, &detection.mask);
        let noise_w = wide(self.narrow_noise(&map, cfar, channels, &cells)?);
        let detection = Detection { mask: detection.mask, ratio: wide(detection.ratio) };
        Ok(FoundCells { detection, cells, noise_w })
    }

    /// The power in W that each cell of a map has to exceed to be detected, `[doppler, range]`.
    ///
    /// # Errors
    /// Returns the errors of [`Engine::cells`].
    pub fn threshold(&self, map: &PowerMap<f64>, cfar: &Cfar, channels: usize) -> Result<Vec<f64>> {
        match self {
            Engine::Cpu(Precision::F64) => cpu::threshold(map, cfar, channels),
            Engine::Cpu(_) => Ok(wide(cpu::threshold(&narrow_map(map), cfar, channels)?)),
            Engine::Gpu(_) => {
                let map = narrow_map(map);
                let columns = map.range_bins;
                let cell = |i: usize| Cell { doppler: (i / columns) as u32, range: (i % columns) as u32 };
                let every: Vec<Cell> = (0..map.data.len()).map(cell).collect();
                let made = dsp::cfar::columns(cfar, channels, map.doppler_bins, columns)?;
                let ratio: Vec<f32> = dsp::cfar::ratios(&made);
                let noise = self.narrow_noise(&map, cfar, channels, &every)?;
                Ok(noise.iter().enumerate().map(|(i, w)| f64::from(w * ratio[i % columns])).collect())
            }
        }
    }

    fn narrow_noise(
        &self,
        map: &PowerMap<f32>,
        cfar: &Cfar,
        channels: usize,
        cells: &[Cell],
    ) -> Result<Vec<f32>> {
        match self {
            _ if cells.is_empty() => Ok(Vec::new()),
            Engine::Cpu(_) => cpu::noise(map, cfar, channels, cells),
            Engine::Gpu(gpu) => dsp::device::noise(gpu, map, cfar, channels, cells),
        }
    }

    /// The beamformer's amplitudes y in √W over its grid, `[cell, elevation, azimuth]` (CONVENTIONS eq. 19), of snapshots whose turns between
    /// transmitters are out. They are summed on the host, on either engine, in its precision.
    pub fn angular_amplitude(&self, beam: &Beamformer, snapshots: &Snapshots<f64>) -> Vec<Complex64> {
        let rates = vec![0.0; snapshots.data.len() / snapshots.channels.max(1)];
        match self {
            Engine::Cpu(Precision::F64) => cpu::doa_beamform::amplitudes(beam, snapshots, &rates),
            _ => cpu::doa_beamform::amplitudes(beam, &snapshots.narrowed(), &rates)
                .into_iter()
                .map(|z| Complex64::new(z.re.into(), z.im.into()))
                .collect(),
        }
    }
}

/// The transforms of a radar's lines.
pub(crate) fn transform(radar: &Radar) -> Result<Transform> {
    Transform::of_shape([radar.chirps, radar.channels(), radar.lines().count], radar)
}
