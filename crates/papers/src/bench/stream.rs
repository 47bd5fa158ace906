//! W4s: the seed's cube, 2048 chirps × 2048 samples × 16 channels, by blocks of channels.

use super::sheet::{Outcome, Settings, Sheet, peak_memory};
use catseye::base::error::Result;
use catseye::base::rng::philox4x32_10;
use catseye::engine::Engine;
use catseye::scene::radar::{Cfar, CfarKind, Radar, Window};
use catseye::scene::radar_toml;
use num_complex::{Complex32, Complex64};
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::ops::Range;

/// Chirps, samples, channels.
const SHAPE: [usize; 3] = [2048, 2048, 16];
/// Cells (Doppler row, range bin) of the targets, at cell centres.
const TARGETS: [[usize; 2]; 4] = [[1024, 100], [1100, 640], [300, 1500], [1900, 1999]];
/// Amplitude of a target relative to the noise of a sample, which has power one: 20 dB below it.
const AMPLITUDE: f64 = 0.1;

fn radar() -> Result<Radar> {
    let mut radar = radar_toml::preset("front77")?;
    [radar.chirps, radar.samples] = [SHAPE[0], SHAPE[1]];
    radar.tx.truncate(1);
    let half = 0.5 * radar.wavelength_m();
    let receiver = radar.rx[0].clone();
    radar.rx = (0..SHAPE[2])
        .map(|i| {
            let mut a = receiver.clone();
            a.position_m.y = (i as f64 - 7.5) * half;
            a
        })
        .collect();
    let p = &mut radar.processing;
    [p.doppler_fft, p.range_fft] = [SHAPE[0], SHAPE[1]];
    (p.range_window, p.doppler_window) = (Window::Hann, Window::Hann);
    p.cfar = Cfar { kind: CfarKind::Os { rank: 162 }, guard: [1, 2], train: [4, 8], pfa: 1e-6 };
    Ok(radar)
}

/// Samples of some channels, `[chirp, channel, sample]`: a stand-in for a recorder, cheap compared with what
/// is measured.
fn fill(seed: u64, channels: Range<usize>, out: &mut [Complex32]) {
    let [chirps, samples, all] = SHAPE;
    let count = channels.len();
    out.par_chunks_mut(samples).enumerate().for_each(|(row, out)| {
        let (chirp, channel) = (row / count, channels.start + row % count);
        let word = philox4x32_10([chirp as u32, channel as u32, all as u32, 9], [seed as u32, 0]);
        let mut state = u64::from(word[0]) << 32 | u64::from(word[1]) | 1;
        let mut phasors = TARGETS.map(|[d, r]| {
            let doppler = d as f64 / chirps as f64 - 0.5;
            let turns = doppler * chirp as f64 + 0.13 * channel as f64;
            let step = Complex64::cis(TAU * r as f64 / samples as f64);
            (Complex64::cis(TAU * turns.fract()) * AMPLITUDE, step)
        });
        for z in out {
            // Uniform noise of power one (xorshift64*): the transforms make it normal.
            state ^= state >> 12;
            state ^= state << 25;
            state ^= state >> 27;
            let bits = state.wrapping_mul(0x2545_F491_4F6C_DD1D);
            let part = |b: u32| f64::from(b as i32) * (1.5f64.sqrt() / 2_147_483_648.0);
            let mut sum = Complex64::new(part((bits >> 32) as u32), part(bits as u32));
            for (p, step) in &mut phasors {
                sum += *p;
                *p *= *step;
            }
            *z = Complex32::new(sum.re as f32, sum.im as f32);
        }
    });
}

pub(super) fn w4s(engine: &Engine, settings: &Settings, mut sheet: Sheet<'_>) -> Result<Outcome> {
    let radar = radar()?;
    sheet.count("samples", SHAPE.iter().product::<usize>());
    sheet.count("bytes_complex64", 8 * SHAPE.iter().product::<usize>());
    let mut one = vec![Complex32::default(); SHAPE[0] * SHAPE[1]];
    sheet.part("source_of_one_channel", || {
        fill(settings.seed, 0..1, &mut one);
        Ok(())
    })?;
    drop(one);
    let found = sheet.stage("range_doppler", || {
        engine.range_doppler_streamed(&radar, &mut |channels, out| {
            fill(settings.seed, channels, out);
            Ok(())
        })
    })?;
    sheet.count("cells", found.cells.len());
    if let Some(bytes) = peak_memory() {
        sheet.count("peak_memory_bytes_of_the_process", bytes);
    }
    // A target's power, and that of the noise in a cell: Hann's sum of squares on both axes.
    let noise = (1.5f64 / SHAPE[0] as f64) * (1.5 / SHAPE[1] as f64);
    let worst = TARGETS
        .iter()
        .map(|[d, r]| (10.0 * (found.map.at(*d, *r) / (AMPLITUDE * AMPLITUDE + noise)).log10()).abs())
        .fold(0.0, f64::max);
    sheet.accuracy("targets_worst_level_error_db", worst);
    let seen = |t: &&[usize; 2]| found.cells.iter().any(|c| [c.doppler as usize, c.range as usize] == **t);
    sheet.accuracy("targets_found", TARGETS.iter().filter(seen).count());
    sheet.accuracy("targets", TARGETS.len());
    sheet.note(
        "the source makes each block of channels when it is asked for, up to twice; its time is part of the stage",
    );
    Ok(sheet.finish())
}
