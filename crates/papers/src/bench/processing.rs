//! W4: from a cube of noise and targets to beams, compared with the same in f64.

use super::sheet::{Outcome, Settings, Sheet, relative_l2};
use catseye::adc::Cube;
use catseye::adc::noise::Noise;
use catseye::base::error::Result;
use catseye::detect::{locate, points};
use catseye::dsp::doa_beamform::Beamformer;
use catseye::dsp::transform::Transform;
use catseye::dsp::{self, Snapshots};
use catseye::engine::{AnyCube, Engine};
use catseye::scene::radar::{Cfar, CfarKind, Radar, Window};
use catseye::scene::radar_toml;
use num_complex::{Complex32, Complex64};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Number of cells for which beams are formed.
pub const CELLS: usize = 2000;
/// Number of chirps and samples of the cube; it has twelve channels.
pub const SHAPE: [usize; 2] = [512, 1024];
/// Probability of false alarm so high that more than [`CELLS`] peaks of the noise pass.
const PFA: f64 = 1e-2;
/// Relative distance of a cell's power from its threshold within which it may fall on either side in f32.
const TIE: f64 = 1e-5;

/// The radar preset `front77` with W4's cube and detector.
///
/// # Errors
/// Returns an error if the preset cannot be read.
pub fn radar() -> Result<Radar> {
    let mut radar = radar_toml::preset("front77")?;
    [radar.chirps, radar.samples] = SHAPE;
    let p = &mut radar.processing;
    [p.doppler_fft, p.range_fft] = SHAPE;
    (p.range_window, p.doppler_window) = (Window::Hann, Window::Hann);
    p.cfar = Cfar { kind: CfarKind::Os { rank: 162 }, guard: [1, 2], train: [4, 8], pfa: PFA };
    (p.azimuth_bins, p.elevation_bins) = (64, 1);
    p.max_points = CELLS;
    Ok(radar)
}

/// Makes a cube of noise of power 1 W and sixteen targets, 20 dB and more below it, at various ranges,
/// Dopplers and azimuths.
pub fn cube(radar: &Radar, seed: u64) -> Cube<f32> {
    let noise = Noise { sigma: 0.5f64.sqrt(), sampling: radar.sampling, seed, frame: 0 };
    let mut cube = Cube::<f32>::zeros(radar.chirps, radar.channels(), radar.samples);
    let (channels, samples) = (cube.channels, cube.samples);
    cube.data.par_chunks_mut(samples).enumerate().for_each(|(row, out)| {
        let (chirp, channel) = (row / channels, row % channels);
        for (n, z) in out.iter_mut().enumerate() {
            let mut sum = catseye::adc::cpu::noise::sample(&noise, (row * samples + n) as u64);
            for t in 0..16 {
                let t = f64::from(t);
                let turns = (0.03 + 0.0571 * t) * n as f64
                    + (0.41 + 0.1234 * t) * chirp as f64
                    + 0.5 * (-0.8 + 0.1 * t) * channel as f64;
                sum += Complex64::cis(TAU * turns) * (0.1 * 10f64.powf(-0.05 * t));
            }
            *z = Complex32::new(sum.re as f32, sum.im as f32);
        }
    });
    cube
}

pub(super) fn w4(engine: &Engine, settings: &Settings, mut sheet: Sheet<'_>) -> Result<Outcome> {
    let radar = radar()?;
    let cube = cube(&radar, settings.seed);
    let wide = cube.to_f64();
    sheet.count("samples", cube.data.len());
    parts(engine, &radar, &cube, &wide, &mut sheet)?;
    let any = match engine {
        Engine::Cpu(catseye::engine::Precision::F64) => AnyCube::F64(wide.clone()),
        _ => AnyCube::F32(cube),
    };
    let found = sheet.stage("range_doppler", || engine.range_doppler(&radar, &any))?;
    drop(any);
    let rates = points::peaks(&radar, &found, &locate::accuracy(&radar)?).1;
    let beam = Beamformer::new(&radar)?;
    let power = sheet.stage("beamforming", || engine.angular_power(&beam, &found.snapshots, &rates))?;
    sheet.count("detections", found.detection.mask.iter().filter(|m| **m).count());
    sheet.count("peaks", found.cells.len());
    sheet.count("cells_beamformed", rates.len());

    let (spectrum, truth) = catseye::dsp::cpu::process(&wide, &radar)?;
    sheet.accuracy(
        "map_relative_l2",
        relative_l2(found.map.data.iter().copied(), truth.map.data.iter().copied()),
    );
    let bins = truth.map.range_bins;
    let differ: Vec<usize> =
        (0..truth.map.data.len()).filter(|i| truth.detection.mask[*i] != found.detection.mask[*i]).collect();
    let cells: Vec<dsp::Cell> =
        differ.iter().map(|i| dsp::Cell { doppler: (i / bins) as u32, range: (i % bins) as u32 }).collect();
    let noise = catseye::dsp::cpu::noise(&truth.map, &radar.processing.cfar, radar.channels(), &cells)?;
    let close = |(i, noise): (&usize, &f64)| {
        (truth.map.data[*i] / (noise * truth.detection.ratio[i % bins]) - 1.0).abs() <= TIE
    };
    sheet.accuracy("mask_cells", truth.map.data.len());
    sheet.accuracy("mask_differs", differ.len());
    sheet.accuracy("mask_differs_other_than_ties", differ.iter().zip(&noise).filter(|x| !close(*x)).count());
    let at: Vec<dsp::Cell> = found.cells.iter().take(rates.len()).copied().collect();
    let snapshots: Snapshots<f64> = catseye::dsp::cpu::snapshot::snapshots(&spectrum, &at);
    let beams = catseye::dsp::cpu::doa_beamform::spectra(&beam, &snapshots, &rates);
    sheet.accuracy("beams_relative_l2", relative_l2(power.iter().copied(), beams.iter().copied()));
    sheet.note(format!(
        "range_doppler is the whole chain from the cube on the host to cells; fft, power and cfar are its parts, \
         measured alone. Probability of false alarm {PFA}, so that {CELLS} cells are there; a tie is a cell within \
         {TIE:e} of its threshold"
    ));
    Ok(sheet.finish())
}

/// Times the stages of the chain one by one.
fn parts(
    engine: &Engine,
    radar: &Radar,
    cube: &Cube<f32>,
    wide: &Cube<f64>,
    sheet: &mut Sheet<'_>,
) -> Result<()> {
    let (cfar, channels) = (&radar.processing.cfar, radar.channels());
    let transform = Transform::of_cube(cube, radar)?;
    match engine {
        Engine::Cpu(catseye::engine::Precision::F32) => {
            let spectrum = sheet.part("fft", || Ok(catseye::dsp::cpu::fft::spectrum(cube, &transform)))?;
            let map = sheet.part("power", || Ok(catseye::dsp::cpu::power::power(&spectrum)))?;
            sheet.part("cfar", || catseye::dsp::cpu::detect(&map, cfar, channels))?;
        }
        Engine::Cpu(catseye::engine::Precision::F64) => {
            let spectrum = sheet.part("fft", || Ok(catseye::dsp::cpu::fft::spectrum(wide, &transform)))?;
            let map = sheet.part("power", || Ok(catseye::dsp::cpu::power::power(&spectrum)))?;
            sheet.part("cfar", || catseye::dsp::cpu::detect(&map, cfar, channels))?;
        }
        Engine::Gpu(gpu) => {
            let spectrum = sheet.part("fft", || {
                let mut recorder = gpu.recorder("fft");
                let spectrum = dsp::spectrum::record(&mut recorder, gpu, cube, &transform)?;
                recorder.submit()?;
                Ok(spectrum)
            })?;
            let map = sheet.part("power", || {
                let mut recorder = gpu.recorder("power");
                let map = dsp::power::record(&mut recorder, &spectrum);
                let pending = recorder.read(&map);
                Ok(recorder.submit()?.take(pending))
            })?;
            let map = dsp::PowerMap {
                doppler_bins: transform.doppler_fft,
                range_bins: transform.range_bins,
                data: map,
            };
            sheet.part("cfar", || dsp::device::detect(gpu, &map, cfar, channels))?;
        }
    }
    Ok(())
}
