//! The front end against closed forms and brute force (CONVENTIONS eq. 100-112).

use catseye::adc::Cube;
use catseye::adc::convert::{self, Convert, full_scale_snr_db, peak};
use catseye::adc::cpu::front_end::{Inputs, Runner, apply};
use catseye::adc::front_end::phase_noise::{line, stretches};
use catseye::adc::front_end::{Chain, jitter};
use catseye::adc::interference::{self, Arrival, RadarState, burst_s, ghost_range_m};
use catseye::adc::noise::Noise;
use catseye::base::frames::Pose;
use catseye::base::units::{BOLTZMANN, C0, T0_K, power_from_db, w_from_dbm};
use catseye::scene::front_end::*;
use catseye::scene::interferer::Interferer;
use catseye::scene::radar::{Radar, Sampling};
use catseye::scene::radar_toml;
use glam::DVec3;
use num_complex::{Complex, Complex64};
use std::f64::consts::{PI, SQRT_2, TAU};

/// 1 GHz in 40 µs, 512 samples at 12.8 MHz, one transmitter and `rx` receivers.
fn radar(sampling: Sampling, chirps: usize, rx: usize) -> Radar {
    let elements: String =
        (0..rx).map(|i| format!("[[rx]]\nposition_half_wavelengths = [0, {i}, 0]\n")).collect();
    let text = format!(
        r#"name = "test"
[waveform]
carrier_hz = 77e9
bandwidth_hz = 1e9
ramp_time_s = 40e-6
chirp_period_s = 55e-6
chirps = {chirps}
[receiver]
sampling = "{}"
sample_rate_hz = 12.8e6
samples = 512
noise_figure_db = 12
[transmitter]
power_dbm = 12
[[tx]]
position_half_wavelengths = [0, -2, 0]
{elements}"#,
        if sampling == Sampling::Iq { "iq" } else { "real" }
    );
    radar_toml::parse(std::path::Path::new("test.toml"), &text).unwrap()
}

/// Echoes at rest, (amplitude, delay): eq. 12, `margin` samples longer at both ends.
fn echoes(chain: &Chain, rows: usize, samples: usize, margin: usize, list: &[(f64, f64)]) -> Cube<f64> {
    let t = &chain.timing;
    let row: Vec<Complex64> = (0..samples + 2 * margin)
        .map(|n| {
            let time = t.adc_start_s + (n as f64 - margin as f64) / t.sample_rate_hz;
            t.sampled(list.iter().map(|(a, tau)| a * beat(chain, *tau, time)).sum())
        })
        .collect();
    Cube { chirps: rows, channels: 1, samples: samples + 2 * margin, data: row.repeat(rows) }
}

fn beat(chain: &Chain, tau: f64, time: f64) -> Complex64 {
    let t = &chain.timing;
    let turns = t.start_hz * tau + t.slope_hz_per_s * tau * (time - 0.5 * tau);
    Complex64::cis(TAU * (turns - turns.round()))
}

fn off(radar: &Radar) -> Chain {
    Chain::new(radar, &FrontEndSettings::default())
}

fn with(radar: &Radar, change: impl FnOnce(&mut FrontEndSettings)) -> Chain {
    let mut s = FrontEndSettings::default();
    change(&mut s);
    Chain::new(radar, &s)
}

fn quiet(seed: u64) -> Inputs<'static> {
    Inputs { seed, interference_seed: seed, ..Default::default() }
}

fn spectrum(x: &[Complex64]) -> Vec<Complex64> {
    let mut y = x.to_vec();
    catseye_math::fft::forward(x.len()).process(&mut y);
    y
}

fn relative(a: &[Complex64], b: &[Complex64], scale: &[Complex64]) -> f64 {
    let d: f64 = a.iter().zip(b).map(|(a, b)| (a - b).norm_sqr()).sum();
    (d / scale.iter().map(|z| z.norm_sqr()).sum::<f64>()).sqrt()
}

#[test]
fn what_is_off_changes_no_bit() {
    for sampling in [Sampling::Iq, Sampling::Real] {
        let r = radar(sampling, 3, 1);
        let chain = off(&r);
        let cube = echoes(&chain, 3, 512, 0, &[(1e-6, 1e-7), (3e-7, 2.2e-7)]);
        assert_eq!(chain.margin(), 0);
        assert_eq!(apply(cube.clone(), 0, &chain, quiet(1)).unwrap(), cube);
        assert_eq!(apply(cube.to_f32(), 0, &chain, quiet(1)).unwrap(), cube.to_f32());
    }
}

/// A synthesiser: level within the loop, 20 dB a decade outside.
fn profile() -> PhaseNoise {
    profile_at(-85.0)
}

fn profile_at(level: f64) -> PhaseNoise {
    PhaseNoise { offset_hz: vec![5e5, 5e6, 5e7], dbc_per_hz: vec![level, level - 20.0, level - 40.0] }
}

/// φ of the drawn stretch at any instant, in half samples from its beginning: its own Fourier sum.
struct Oscillator {
    lines: Vec<(f64, Complex64)>,
}

impl Oscillator {
    fn new(p: &PhaseNoise, sample_rate_hz: f64, length: usize, seed: u64) -> Oscillator {
        let most = (length / 4) as i64;
        let spacing = 2.0 * sample_rate_hz / length as f64;
        let lines = (-most..=most)
            .filter(|k| *k != 0)
            .map(|k| (k as f64 / length as f64, line(p, spacing, k, seed, 0, 0)))
            .collect();
        Oscillator { lines }
    }

    fn phase(&self, half_samples: f64) -> f64 {
        self.lines.iter().map(|(f, z)| (z * Complex64::cis(TAU * f * half_samples)).re).sum()
    }
}

/// The error of the noise over the noise, against the sum over echoes with the exact phase of each.
fn error_of_phase_noise(level: f64, sampling: Sampling, falling: bool, margin_share: usize) -> f64 {
    let profile = || profile_at(level);
    let r = radar(sampling, 2, 1);
    let mut chain = with(&r, |s| s.phase_noise = Some(profile()));
    if falling {
        chain.timing.slope_hz_per_s *= -1.0;
        chain.timing.start_hz += r.bandwidth_hz();
    }
    let margin = chain.margin() * margin_share;
    // "real" hears half as far.
    let reach = if sampling == Sampling::Real { 0.5 } else { 1.0 };
    let list =
        [(1.0, 0.031e-6), (0.4, 0.1503e-6), (0.7, 0.3021e-6), (0.2, 0.47e-6)].map(|(a, t)| (a, t * reach));
    let cube = echoes(&chain, 2, 512, margin, &list);
    let clean = echoes(&chain, 2, 512, 0, &list);
    let got = apply(cube, margin, &chain, quiet(9)).unwrap();
    // The same stretch: its length follows from the transforms' grid, which is not public; any `before` and
    // `after` that give the length and place do.
    let n = catseye::adc::front_end::phase_noise::fast_length(
        (512 + 2 * margin).max(512 + 2 * catseye::adc::front_end::phase_noise::reach(&chain.timing) + 64),
    );
    let stretch = &stretches(&chain.timing, 512, 2 * n, 2 * n)[0];
    let osc = Oscillator::new(&profile(), 12.8e6, stretch.length, 9);
    let mut truth = Vec::new();
    for first in &stretch.first {
        for n in (0..512).step_by(3) {
            let here = *first as f64 + 2.0 * n as f64;
            let now = osc.phase(here);
            let time = chain.timing.adc_start_s + n as f64 / 12.8e6;
            let sum = list.iter().map(|(a, tau)| {
                a * beat(&chain, *tau, time) * Complex64::cis(now - osc.phase(here - 2.0 * 12.8e6 * tau))
            });
            truth.push(chain.timing.sampled(sum.sum()));
        }
    }
    let third = |c: &Cube<f64>| -> Vec<Complex64> {
        c.data.chunks(512).flat_map(|row| row.iter().step_by(3).copied()).collect()
    };
    let noise: Vec<Complex64> = truth.iter().zip(third(&clean)).map(|(a, b)| a - b).collect();
    relative(&third(&got), &truth, &noise)
}

/// To first order in φ exact. To second order its products beyond an offset of f_s/2 leave the band of the transforms:
/// φ² of the noise for an rms of φ of 0.08 rad at −85 dBc/Hz.
#[test]
fn phase_noise_is_that_of_each_echo() {
    for sampling in [Sampling::Iq, Sampling::Real] {
        for falling in [false, true] {
            let error = |level, margin| error_of_phase_noise(level, sampling, falling, margin);
            let (strong, weak, cut) = (error(-85.0, 1), error(-125.0, 1), error(-125.0, 0));
            println!(
                "{sampling:?} falling {falling}: error over noise {strong:.1e} at -85 dBc/Hz, {weak:.1e} at -125 dBc/Hz, {cut:.1e} without margin"
            );
            assert!(strong < 1e-2 && weak < 1e-4, "{strong} {weak}");
            // The share f_s/B of the record is wrong by its own size at most.
            assert!(cut < 2.0 * (12.8e6f64 / 1e9).sqrt(), "{cut}");
        }
    }
}

/// Density of the skirts at several ranges against 4 sin²(πfτ) L(f), averaged over groups of cells.
#[test]
fn skirts_have_the_range_correlation() {
    let ramps = 256;
    let r = radar(Sampling::Iq, ramps, 1);
    let chain = with(&r, |s| s.phase_noise = Some(profile()));
    let margin = chain.margin();
    let window: Vec<f64> = (0..512).map(|n| 0.5 - 0.5 * (TAU * n as f64 / 512.0).cos()).collect();
    let energy: f64 = window.iter().map(|w| w * w).sum();
    for tau in [0.02e-6, 0.1e-6, 0.2567e-6, 0.45e-6] {
        let cube = echoes(&chain, ramps, 512, margin, &[(1.0, tau)]);
        let clean = echoes(&chain, 1, 512, 0, &[(1.0, tau)]);
        let noisy = apply(cube, margin, &chain, quiet(77)).unwrap();
        let mut power = vec![0.0; 512];
        for m in 0..ramps {
            let psi: Vec<Complex64> = noisy
                .row(m, 0)
                .iter()
                .zip(&clean.data)
                .zip(&window)
                .map(|((y, x), w)| Complex64::from((y / x).arg() * w))
                .collect();
            for (p, z) in power.iter_mut().zip(spectrum(&psi)) {
                *p += z.norm_sqr() / (12.8e6 * energy * ramps as f64);
            }
        }
        for group in (6..246).step_by(24) {
            let cells = group..group + 24;
            let measured: f64 = cells.clone().map(|k| power[k]).sum::<f64>() / 24.0;
            let stated: f64 =
                cells.map(|k| profile().residual_density_per_hz(k as f64 * 25e3, tau)).sum::<f64>() / 24.0;
            // Cells of a Hann window are correlated: 24 of them are worth about 12. A mean of
            // 256 · 12 exponential draws, 99.9 % two-sided.
            let interval = 3.3 / (256.0 * 12.0f64).sqrt();
            assert!(
                (measured / stated - 1.0).abs() < interval,
                "{tau}: cell {group}: {measured:e} for {stated:e}"
            );
        }
    }
}

/// Noise close to the carrier stays close to it in Doppler: the slow-time density is that of the profile.
#[test]
fn ramps_keep_their_correlation() {
    let ramps = 1024;
    let r = radar(Sampling::Iq, ramps, 1);
    let p = PhaseNoise { offset_hz: vec![3e3, 4e3], dbc_per_hz: vec![-50.0, -200.0] };
    let chain = with(&r, |s| s.phase_noise = Some(p.clone()));
    let tau = 0.45e-6;
    let (mut measured, mut outside) = (0.0, 0.0);
    let frames = 6;
    for seed in 0..frames {
        let cube = echoes(&chain, ramps, 512, chain.margin(), &[(1.0, tau)]);
        let clean = echoes(&chain, 1, 512, 0, &[(1.0, tau)]);
        let noisy = apply(cube, chain.margin(), &chain, quiet(seed)).unwrap();
        let slow: Vec<Complex64> = (0..ramps)
            .map(|m| {
                let mean: f64 =
                    noisy.row(m, 0).iter().zip(&clean.data).map(|(y, x)| (y / x).arg()).sum::<f64>() / 512.0;
                let w = 0.5 - 0.5 * (TAU * m as f64 / ramps as f64).cos();
                Complex64::from(mean * w)
            })
            .collect();
        let rate = 1.0 / 55e-6;
        let density = |k: usize, z: &Complex64| {
            let f = k as f64 * rate / ramps as f64;
            // The mean over 40 µs lowers it by sinc², which is 0.95 at 3 kHz.
            let mean = (PI * f * 40e-6).sin() / (PI * f * 40e-6);
            (f, z.norm_sqr() / (rate * 0.375 * ramps as f64 * mean * mean))
        };
        for (k, z) in spectrum(&slow).iter().enumerate().skip(20).take(ramps / 2 - 20) {
            let (f, s) = density(k, z);
            if f < 2.8e3 {
                measured += s / p.residual_density_per_hz(f, tau);
            } else if f > 4.5e3 {
                outside += s / p.residual_density_per_hz(2e3, tau);
            }
        }
    }
    let cells = (2.8e3 * 55e-6 * ramps as f64).floor() - 20.0;
    let mean = measured / (cells * frames as f64);
    assert!((mean - 1.0).abs() < 3.3 / (cells * frames as f64 / 2.0).sqrt(), "{mean}");
    assert!(outside / frames as f64 / 250.0 < 1e-3, "{outside}");
}

#[test]
fn a_late_ramp_turns_each_tone_by_its_frequency() {
    let r = radar(Sampling::Iq, 8, 1);
    let chain = with(&r, |s| s.chirp_jitter_rms_s = Some(2e-9));
    let list = [(1.0, 0.0507e-6), (0.5, 0.3333e-6)];
    let got = apply(echoes(&chain, 8, 512, chain.margin(), &list), chain.margin(), &chain, quiet(4)).unwrap();
    let mut truth = Vec::new();
    for m in 0..8 {
        let late = jitter::chirp_start_s(2e-9, 4, 0, m);
        for n in 0..512 {
            // The ramp has run for less: t becomes t − δ.
            let time = n as f64 / 12.8e6 - late;
            truth.push(list.iter().map(|(a, tau)| a * beat(&chain, *tau, time)).sum::<Complex64>());
        }
    }
    let e = relative(&got.data, &truth, &truth);
    assert!(e < 1e-6, "{e}");
}

#[test]
fn jitter_of_the_clock_has_its_signal_to_noise() {
    let rms = 50e-12;
    for sampling in [Sampling::Iq, Sampling::Real] {
        let r = radar(sampling, 64, 1);
        let chain = with(&r, |s| s.aperture_jitter_rms_s = Some(rms));
        let tau = 0.21e-6;
        let f = chain.timing.beat_hz(tau);
        let m = chain.margin();
        let got = apply(echoes(&chain, 64, 512, m, &[(1.0, tau)]), m, &chain, quiet(2)).unwrap();
        let clean = echoes(&chain, 64, 512, 0, &[(1.0, tau)]);
        let (mut truth, mut power, mut noise) = (Vec::new(), 0.0, 0.0);
        for ramp in 0..64 {
            for n in 0..512 {
                let late = jitter::aperture_s(rms, 2, 0, ramp, n);
                truth.push(chain.timing.sampled(beat(&chain, tau, n as f64 / 12.8e6 + late)));
            }
        }
        let e = relative(&got.data, &truth, &truth);
        assert!(e < 1e-6, "{sampling:?} {e}");
        for (y, x) in got.data.iter().zip(&clean.data) {
            power += x.norm_sqr();
            noise += (y - x).norm_sqr();
        }
        let snr = 10.0 * (power / noise).log10();
        // 32768 draws: their variance is known to 0.8 % (one standard deviation), 0.034 dB.
        assert!((snr - jitter::snr_db(f, rms)).abs() < 0.12, "{sampling:?} {snr} {}", jitter::snr_db(f, rms));
    }
}

#[test]
fn leakage_and_cover_have_their_power_and_place() {
    let r = radar(Sampling::Iq, 2, 4);
    let distance = 0.6;
    let chain = with(&r, |s| {
        s.leakage = Some(Leakage { isolation_db: 30.0, delay_s: 1.5e-9 });
    });
    let cube = apply(Cube::<f64>::zeros(2, 4, 512), 0, &chain, quiet(0)).unwrap();
    let sent = w_from_dbm(12.0);
    for (i, z) in cube.data.iter().enumerate() {
        let n = i % 512;
        let truth = (sent * 1e-3).sqrt() * beat(&chain, 1.5e-9, n as f64 / 12.8e6);
        assert!((z - truth).norm() < 1e-9 * sent.sqrt());
    }
    let chain = with(&r, |s| s.bumper = Some(Bumper { reflection_db: -15.0, distance_m: distance }));
    let cube = apply(Cube::<f64>::zeros(2, 4, 512), 0, &chain, quiet(0)).unwrap();
    let half = 0.5 * r.wavelength_m();
    for c in 0..4 {
        // Isotropic antennas (2 + c) half wavelengths apart, and the image 1.2 m away.
        let way = (2.0 * distance).hypot((2 + c) as f64 * half);
        let a = sent.sqrt() * r.wavelength_m() / (4.0 * PI * way) * 10f64.powf(-0.75);
        for (n, z) in cube.row(1, c).iter().enumerate() {
            let truth = -a * beat(&chain, way / C0, n as f64 / 12.8e6);
            assert!((z - truth).norm() < 1e-7 * a, "{c} {n}");
        }
    }
}

#[test]
fn filters_shape_the_noise() {
    for (sampling, low) in
        [(Sampling::Iq, None), (Sampling::Real, None), (Sampling::Real, Some(5e6)), (Sampling::Iq, Some(9e6))]
    {
        let r = radar(sampling, 512, 1);
        let chain = with(&r, |s| {
            s.filters.high_pass = Some(Butterworth { order: 2, corner_hz: 2e6 });
            s.filters.low_pass = low.map(|corner_hz| Butterworth { order: 3, corner_hz });
        });
        let noise = Noise::thermal(&r, 3, 1).unwrap();
        let inputs =
            Inputs { noise: Some(&noise), seed: 3, interference_seed: 3, frame: 1, ..Default::default() };
        let cube = apply(Cube::<f64>::zeros(512, 1, 512), 0, &chain, inputs).unwrap();
        let mut density = vec![0.0; 512];
        for m in 0..512 {
            for (d, z) in density.iter_mut().zip(spectrum(cube.row(m, 0))) {
                *d += z.norm_sqr() / (512.0 * 512.0);
            }
        }
        let white = BOLTZMANN
            * T0_K
            * power_from_db(12.0)
            * 12.8e6
            * if sampling == Sampling::Real { 0.5 } else { 1.0 };
        let mut all = 0.0;
        for group in (16..256).step_by(16) {
            let stated: f64 = (group..group + 16)
                .map(|k| white * chain.settings.filters.noise_density(12.8e6, k as f64 * 25e3))
                .sum::<f64>()
                / 16.0;
            let measured = density[group..group + 16].iter().sum::<f64>() / 16.0;
            all += measured / stated;
            // 16 · 512 exponential draws.
            assert!(
                (measured / stated - 1.0).abs() < 4.0 / 8192f64.sqrt(),
                "{sampling:?} {group} {measured:e} {stated:e}"
            );
        }
        assert!((all / 15.0 - 1.0).abs() < 4.0 / (15.0 * 8192f64).sqrt());
        if sampling == Sampling::Real {
            assert!(cube.data.iter().all(|z| z.im == 0.0));
        }
    }
}

/// A tone of amplitude `a` (√W) at cell `cell` through the per-sample map.
fn tone(chain: &Chain, a: f64, cell: f64) -> Vec<Complex64> {
    let t = &chain.timing;
    let x: Vec<Complex64> =
        (0..512).map(|n| t.sampled(a * Complex64::cis(TAU * cell * n as f64 / 512.0 + 0.3))).collect();
    let cube = Cube { chirps: 1, channels: 1, samples: 512, data: x };
    apply(cube, 0, chain, quiet(0)).unwrap().data
}

#[test]
fn quantiser_has_its_signal_to_noise() {
    for sampling in [Sampling::Iq, Sampling::Real] {
        for kind in [QuantiserKind::MidTread, QuantiserKind::MidRise] {
            for bits in [6, 8, 12] {
                let r = radar(sampling, 1, 1);
                let chain = with(&r, |s| s.adc = Some(Adc { bits, full_scale_dbm: -20.0, kind }));
                let full = w_from_dbm(-20.0).sqrt();
                let (mut snr, mut count) = (0.0, 0.0);
                for i in 0..200 {
                    let cell = 3.0 + 0.618 * i as f64;
                    // Amplitudes over a whole step, just inside the range: the error of one of them is not quite
                    // uniform (Bennett 1948), by J0(2π a/Δ).
                    let a = full * (1.0 - 2f64.powi(1 - bits as i32) * (1.0 + i as f64 / 200.0));
                    let t = &chain.timing;
                    for (n, y) in tone(&chain, a, cell).iter().enumerate() {
                        let x = t.sampled(a * Complex64::cis(TAU * cell * n as f64 / 512.0 + 0.3));
                        snr += (y - x).norm_sqr() / (full * full);
                        count += 1.0;
                    }
                }
                let snr = -10.0 * (snr / count).log10();
                assert!((snr - full_scale_snr_db(bits)).abs() < 0.05, "{sampling:?} {kind:?} {bits}: {snr}");
            }
        }
    }
}

#[test]
fn quantiser_has_its_levels() {
    let r = radar(Sampling::Real, 1, 1);
    for (kind, levels) in
        [(QuantiserKind::MidTread, [-2.0, -1.0, 0.0, 1.0]), (QuantiserKind::MidRise, [-1.5, -0.5, 0.5, 1.5])]
    {
        let chain = with(&r, |s| s.adc = Some(Adc { bits: 2, full_scale_dbm: 30.0, kind }));
        let step = 2.0 * SQRT_2 / 4.0;
        let c = Convert::new(&chain.settings, Sampling::Real).unwrap();
        let mut seen = std::collections::BTreeSet::new();
        for i in -400..=400 {
            let x = i as f64 * 0.01;
            let y = catseye::adc::cpu::convert::sample(&c, Complex64::new(x, 5.0));
            assert_eq!(y.im, 0.0);
            let level = levels.iter().find(|l| (y.re / step - **l).abs() < 1e-12).expect("a level");
            seen.insert((level * 2.0) as i64);
            let inside = x > (levels[0] - 0.5) * step && x < (levels[3] + 0.5) * step;
            assert!(!inside || (y.re - x).abs() <= 0.5 * step + 1e-12, "{kind:?} {x} {}", y.re);
        }
        assert_eq!(seen.len(), 4);
    }
}

#[test]
fn saturation_has_its_harmonics() {
    let r = radar(Sampling::Real, 1, 1);
    let limit = SQRT_2 * w_from_dbm(-20.0).sqrt();
    assert!((peak(-20.0, Sampling::Real) - limit).abs() < 1e-15);
    let amplitude = |x: &[Complex64], cell: usize| 2.0 * spectrum(x)[cell].norm() / 512.0;
    // Hard, twice over the limit: describing function of a clipper (2/π)(asin k + k√(1 − k²)), k = A/a.
    let chain =
        with(&r, |s| s.saturation = Some(Saturation { kind: SaturationKind::Hard, full_scale_dbm: -20.0 }));
    let a = 2.0 * limit;
    let k = 0.5f64;
    let first = a * 2.0 / PI * (k.asin() + k * (1.0 - k * k).sqrt());
    // Cell 5 of 512: harmonics that alias lie above the hundredth.
    let y = tone(&chain, a / SQRT_2, 5.0);
    assert!((amplitude(&y, 5) / first - 1.0).abs() < 1e-4, "{}", amplitude(&y, 5) / first);
    // Soft and weak: tanh x = x − x³/3: 1 − u²/4 at the tone, u²/12 at three times it, u = a/A.
    let chain =
        with(&r, |s| s.saturation = Some(Saturation { kind: SaturationKind::Soft, full_scale_dbm: -20.0 }));
    let a = 0.1 * limit;
    let y = tone(&chain, a / SQRT_2, 5.0);
    assert!((amplitude(&y, 5) / a - (1.0 - 0.01 / 4.0)).abs() < 2e-5);
    assert!((amplitude(&y, 15) / a / (0.01 / 12.0) - 1.0).abs() < 0.01);
}

#[test]
fn imbalance_makes_an_image_and_the_constant_a_line() {
    let iq = IqImbalance { gain_db: 0.7, phase_rad: -0.05 };
    let chain = with(&radar(Sampling::Iq, 1, 1), |s| {
        s.iq = Some(iq);
        s.dc = Some(DcOffset { i: 2e-3, q: -1e-3 });
    });
    let s = spectrum(&tone(&chain, 1.0, 37.0));
    let db = 10.0 * (s[37].norm_sqr() / s[512 - 37].norm_sqr()).log10();
    assert!((db - iq.image_rejection_db()).abs() < 1e-9, "{db}");
    let (k1, k2) = iq.factors();
    assert!((s[37] / 512.0 - k1 * Complex64::cis(0.3)).norm() < 1e-12);
    assert!((s[475] / 512.0 - k2 * Complex64::cis(-0.3)).norm() < 1e-12);
    assert!((s[0] / 512.0 - Complex64::new(2e-3, -1e-3)).norm() < 1e-12);
    // One mixer has no image.
    let chain = with(&radar(Sampling::Real, 1, 1), |s| s.iq = Some(iq));
    assert_eq!(tone(&chain, 1.0, 37.0), tone(&off(&radar(Sampling::Real, 1, 1)), 1.0, 37.0));
}

fn sender() -> Interferer {
    let r = radar(Sampling::Iq, 1, 1);
    Interferer {
        name: "other".into(),
        start_hz: 76.5e9,
        slope_hz_per_s: 1e9 / 40e-6,
        ramp_time_s: 40e-6,
        period_s: 55e-6,
        start_s: Some(0.0),
        coherent: true,
        power_dbm: 10.0,
        antenna: catseye::scene::radar::Antenna {
            position_m: DVec3::ZERO,
            gain_dbi: 12.0,
            ..r.tx[0].clone()
        },
        pose: Pose::from_yaw_pitch_roll(DVec3::new(60.0, 0.0, 0.5), PI, 0.0, 0.0),
        velocity_mps: DVec3::ZERO,
        motion: None,
    }
}

fn here() -> RadarState {
    RadarState {
        pose: Pose::from_yaw_pitch_roll(DVec3::new(0.0, 0.0, 0.5), 0.0, 0.0, 0.0),
        velocity_mps: DVec3::ZERO,
    }
}

fn place(i: &Interferer) -> RadarState {
    RadarState { pose: i.pose, velocity_mps: i.velocity_mps }
}

fn add(chain: &Chain, chirps: usize, arrivals: &[Arrival]) -> Cube<f64> {
    let rx = arrivals[0].receivers.len();
    let inputs = Inputs { interference: arrivals, seed: 5, interference_seed: 5, ..Default::default() };
    apply(Cube::zeros(chirps, rx, 512), 0, chain, inputs).unwrap()
}

/// 10 dBm, 12 dBi, 0 dBi, 60 m, λ 3.893 mm: 22 dBm − 20 lg(4π · 60/λ) = 22 − 105.74 dBm.
#[test]
fn an_interferer_has_the_power_of_one_way() {
    let r = radar(Sampling::Iq, 1, 2);
    let s = sender();
    let a = interference::direct(&s, 0, place(&s), &r, here()).unwrap();
    for (z, length) in &a.receivers {
        assert!((10.0 * z.norm_sqr().log10() + 30.0 - (22.0 - 105.741)).abs() < 1e-3);
        assert!((length - 60.0).abs() < 1e-4);
    }
    // Polarisation: crossed at 90°, half the power at 45°, the same hand hears itself.
    let pol = |t: &str, x: &str| {
        let (mut s, mut r) = (sender(), radar(Sampling::Iq, 1, 1));
        s.antenna.polarisation = catseye::scene::radar::Polarisation::from_name(t).unwrap();
        r.rx[0].polarisation = catseye::scene::radar::Polarisation::from_name(x).unwrap();
        let b = interference::direct(&s, 0, place(&s), &r, here()).unwrap();
        b.receivers[0].0.norm_sqr() / a.receivers[0].0.norm_sqr()
    };
    for (t, x, share) in [
        ("V", "H", 0.0),
        ("H", "H", 1.0),
        ("V", "+45", 0.5),
        // +45 as each sees it: face to face they are crossed.
        ("+45", "+45", 0.0),
        ("+45", "-45", 1.0),
        ("RHCP", "RHCP", 1.0),
        ("RHCP", "LHCP", 0.0),
        ("RHCP", "V", 0.5),
    ] {
        assert!((pol(t, x) - share).abs() < 1e-9, "{t} {x}: {}", pol(t, x));
    }
    // By way of 10 dBsm at 30 m from both: 10 + 12 + 20 lg λ + 10 − 30 lg 4π − 40 lg 30.
    let body = (DVec3::new(30.0, 0.0, 0.5), DVec3::ZERO, 10.0);
    let b = interference::scattered(&s, 0, place(&s), &r, here(), body);
    let db = 22.0 + 20.0 * r.wavelength_m().log10() + 10.0 - 30.0 * (4.0 * PI).log10() - 40.0 * 30f64.log10();
    assert!((10.0 * b.receivers[0].0.norm_sqr().log10() + 30.0 - db).abs() < 1e-3);
}

#[test]
fn equal_slopes_make_a_ghost() {
    let r = radar(Sampling::Iq, 16, 1);
    let mut s = sender();
    s.start_hz = 76.5e9 + 1e6;
    s.velocity_mps = DVec3::new(-10.0, 0.0, 0.0);
    let chain = off(&r);
    // Ramps of the victim start at −16/2 · 55 µs + m 55 µs; one of the other 0.3 µs later.
    s.start_s = Some(0.3e-6);
    let a = interference::direct(&s, 0, place(&s), &r, here()).unwrap();
    assert_eq!(a.path_rate_mps, -10.0);
    let cube = add(&chain, 16, std::slice::from_ref(&a));
    let range = ghost_range_m(r.slope_hz_per_s(), 0.3e-6 + 60.0 / C0, 1e6);
    let cell = range / (C0 * 12.8e6 / (2.0 * r.slope_hz_per_s() * 512.0));
    let z = spectrum(cube.row(3, 0));
    let best = (0..512).max_by(|a, b| z[*a].norm().total_cmp(&z[*b].norm())).unwrap();
    assert!((best as f64 - cell).abs() < 0.6, "{best} {cell}");
    // One way: over loops the phase grows by f L̇/c a second; f₀ + S t in the middle of the ramp.
    let f = r.carrier_hz;
    let turn = (spectrum(cube.row(4, 0))[best] / z[best]).arg() / TAU;
    let stated = -10.0 / C0 * f * 55e-6;
    assert!((turn - stated).rem_euclid(1.0).min((stated - turn).rem_euclid(1.0)) < 2e-4, "{turn} {stated}");
    // The ghost has the full power of one way after the transform.
    let all: f64 = cube.row(3, 0).iter().map(|z| z.norm_sqr()).sum::<f64>() / 512.0;
    let on = cube.row(3, 0).iter().filter(|z| z.norm() > 0.0).count() as f64 / 512.0;
    assert!((all / (a.receivers[0].0.norm_sqr() * on) - 1.0).abs() < 1e-9 && on > 0.95, "{on}");
}

#[test]
fn crossing_slopes_make_bursts() {
    for (sampling, slope) in [(Sampling::Iq, -1e13), (Sampling::Real, -1e13), (Sampling::Real, 1.8e13)] {
        let r = radar(sampling, 64, 1);
        let chain = off(&r);
        let mut s = sender();
        s.slope_hz_per_s = slope;
        s.start_hz = 77e9 - 20e-6 * slope;
        s.coherent = false;
        let a = interference::direct(&s, 0, place(&s), &r, here()).unwrap();
        let cube = add(&chain, 64, std::slice::from_ref(&a));
        let length = burst_s(12.8e6, r.slope_hz_per_s(), slope) * 12.8e6;
        let power = a.receivers[0].0.norm_sqr();
        // As the periods are equal, one burst in each ramp: about 20 µs after its start.
        for m in 0..64 {
            let row = cube.row(m, 0);
            let inside: Vec<usize> = (0..512).filter(|n| row[*n].norm() > 0.0).collect();
            assert!((inside.len() as f64 - length).abs() <= 2.0, "{} {length}", inside.len());
            assert_eq!(inside.last().unwrap() - inside[0] + 1, inside.len());
            let mean = inside.iter().map(|n| row[*n].norm_sqr()).sum::<f64>() / inside.len() as f64;
            // A real sample has the power of the phasor on average over its phases: below for all ramps.
            assert!(sampling == Sampling::Real || (mean / power - 1.0).abs() < 1e-9, "{mean:e} {power:e}");
        }
        let all = cube.data.iter().map(|z| z.norm_sqr()).sum::<f64>() / cube.data.len() as f64;
        // Whole samples, and for real ones the squares of 64 · length cosines.
        let allowed =
            1.0 / length + if sampling == Sampling::Iq { 0.0 } else { 4.0 / (128.0 * length).sqrt() };
        assert!((all / (power * length / 512.0) - 1.0).abs() < allowed, "{}", all / (power * length / 512.0));
    }
}

/// The floor that bursts raise after the range transform: on average over all cells P n/N², n samples of burst.
#[test]
fn bursts_raise_the_floor() {
    let r = radar(Sampling::Iq, 64, 1);
    let chain = off(&r);
    let mut s = sender();
    s.slope_hz_per_s = 2e13;
    s.start_hz = 77e9 - 20e-6 * s.slope_hz_per_s;
    s.coherent = false;
    s.start_s = Some(0.0);
    let a = interference::direct(&s, 0, place(&s), &r, here()).unwrap();
    let cube = add(&chain, 64, std::slice::from_ref(&a));
    let mut floor = 0.0;
    for m in 0..64 {
        let z = spectrum(cube.row(m, 0));
        floor += z.iter().map(|z| (z / 512.0).norm_sqr()).sum::<f64>() / (512.0 * 64.0);
    }
    let burst = burst_s(12.8e6, r.slope_hz_per_s(), 2e13) * 12.8e6;
    let stated = a.receivers[0].0.norm_sqr() * burst / 512.0 / 512.0;
    println!("floor {:.2} dBm, stated {:.2} dBm", 10.0 * floor.log10() + 30.0, 10.0 * stated.log10() + 30.0);
    // A whole number of samples.
    assert!((floor / stated - 1.0).abs() < 1.0 / burst, "{}", floor / stated);
    // No cell inside stays out of it; at the ends of the band, where the burst begins and ends, some do.
    let cells: Vec<Vec<Complex64>> = (0..64).map(|m| spectrum(cube.row(m, 0))).collect();
    let mean = |k: usize| cells.iter().map(|z| (z[k] / 512.0).norm_sqr()).sum::<f64>() / 64.0;
    assert!((64..448).map(mean).fold(f64::MAX, f64::min) > 0.1 * stated);
}

/// The phase of every sample against one integral per sample, in quadruple care: frequencies in turns per
/// sample step, taken apart by hand.
#[test]
fn the_phase_of_a_burst_is_that_of_both_ramps() {
    let r = radar(Sampling::Iq, 4, 1);
    let chain = with(&r, |s| s.filters.low_pass = Some(Butterworth { order: 4, corner_hz: 5e6 }));
    let mut s = sender();
    s.slope_hz_per_s = 2.1e13;
    s.start_hz = 76.58e9;
    s.start_s = Some(1.1e-6);
    s.velocity_mps = DVec3::new(-20.0, 0.0, 0.0);
    let a = interference::direct(&s, 0, place(&s), &r, here()).unwrap();
    let cube = add(&chain, 4, std::slice::from_ref(&a));
    let (amplitude, length) = a.receivers[0];
    let mut compared = 0;
    for m in 0..4 {
        // Differences of neighbouring samples give the frequency, which is the difference of the ramps'.
        for n in 1..512 {
            let (x, y) = (cube.row(m, 0)[n - 1], cube.row(m, 0)[n]);
            let begin = (m as f64 - 2.0) * 55e-6;
            let time = (n as f64 - 0.5) / 12.8e6;
            let t = begin + time;
            let beta = -20.0 / C0;
            let u = (t * (1.0 - beta) - length / C0 - 1.1e-6).rem_euclid(55e-6);
            if !(1e-7..39.8e-6).contains(&u) || x.norm() == 0.0 || y.norm() == 0.0 {
                continue;
            }
            let f = 76.5e9 + 2.5e13 * time - (76.58e9 + 2.1e13 * u) * (1.0 - beta);
            let gain = |f: f64| Butterworth { order: 4, corner_hz: 5e6 }.low_pass(f);
            let df = 0.5 / 12.8e6 * (2.5e13 - 2.1e13);
            let stated = TAU * f / 12.8e6 + (gain(f + df) / gain(f - df)).arg();
            let d = ((y / x).arg() - stated).rem_euclid(TAU);
            assert!(d.min(TAU - d) < 2e-5, "{m} {n}: {d}");
            let level = y.norm() / amplitude.norm();
            assert!((level / gain(f + df).norm() - 1.0).abs() < 1e-4);
            compared += 1;
        }
    }
    assert!(compared > 200, "{compared}");
}

fn everything(s: &mut FrontEndSettings) {
    s.phase_noise = Some(profile());
    s.leakage = Some(Leakage { isolation_db: 40.0, delay_s: 0.5e-9 });
    s.bumper = Some(Bumper { reflection_db: -20.0, distance_m: 0.05 });
    s.filters.high_pass = Some(Butterworth { order: 1, corner_hz: 2e5 });
    s.filters.low_pass = Some(Butterworth { order: 5, corner_hz: 5e6 });
    s.saturation = Some(Saturation { kind: SaturationKind::Soft, full_scale_dbm: -20.0 });
    s.adc = Some(Adc { bits: 12, full_scale_dbm: -20.0, kind: QuantiserKind::MidTread });
    s.aperture_jitter_rms_s = Some(1e-12);
    s.chirp_jitter_rms_s = Some(1e-11);
    s.iq = Some(IqImbalance { gain_db: 0.3, phase_rad: 0.02 });
    s.dc = Some(DcOffset { i: 1e-6, q: 0.0 });
    s.channels = Some(ChannelErrors { gain_rms_db: 0.5, phase_rms_rad: 0.1, ..Default::default() });
}

/// The same bytes from any number of threads; other ones from another seed or frame.
#[test]
fn all_of_it_repeats() {
    let r = radar(Sampling::Iq, 12, 3);
    let chain = with(&r, everything);
    let margin = chain.margin();
    let noise = |seed, frame| Noise::thermal(&r, seed, frame).unwrap();
    let mut s = sender();
    (s.start_s, s.coherent) = (None, false);
    let arrivals = [interference::direct(&s, 0, place(&s), &r, here()).unwrap()];
    let run = |threads: usize, seed: u64, frame: u32| {
        let n = noise(seed, frame);
        let inputs =
            Inputs { noise: Some(&n), interference: &arrivals, seed, interference_seed: seed, frame };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| apply(Cube::<f32>::zeros(12, 3, 512 + 2 * margin), margin, &chain, inputs).unwrap())
    };
    let one = run(1, 6, 0);
    assert_eq!((one.chirps, one.channels, one.samples), (12, 3, 512));
    assert!(one.data.iter().all(|z| z.re.is_finite() && z.im.is_finite()));
    assert_eq!(one, run(3, 6, 0));
    assert_ne!(one, run(1, 7, 0));
    assert_ne!(one, run(1, 6, 1));
    // In blocks of loops, and in any order, the same.
    let n = noise(6, 0);
    let inputs = Inputs { noise: Some(&n), interference: &arrivals, seed: 6, interference_seed: 6, frame: 0 };
    let runner = Runner::new(&chain, 512 + 2 * margin, margin, inputs).unwrap();
    for (from, loops) in [(7, 5), (0, 7)] {
        let block = runner.block(Cube::<f32>::zeros(loops, 3, 512 + 2 * margin), from).unwrap();
        assert_eq!(block.data, one.data[from * 3 * 512..(from + loops) * 3 * 512]);
    }
}

/// Without filters the noise is that of eq. 13, to the bit.
#[test]
fn white_noise_is_the_plain_one() {
    let r = radar(Sampling::Iq, 9, 2);
    let noise = Noise::thermal(&r, 8, 2).unwrap();
    let inputs =
        Inputs { noise: Some(&noise), seed: 8, interference_seed: 8, frame: 2, ..Default::default() };
    let got = apply(Cube::<f32>::zeros(9, 2, 512), 0, &off(&r), inputs).unwrap();
    let mut plain = Cube::<f32>::zeros(9, 2, 512);
    catseye::adc::cpu::noise::add(&mut plain, &noise);
    assert!(got == plain);
}

#[test]
fn a_cube_that_does_not_fit_is_refused() {
    let r = radar(Sampling::Iq, 4, 2);
    let chain = with(&r, everything);
    for (chirps, channels, samples, margin) in [(5, 2, 640, 64), (4, 3, 640, 64), (4, 2, 128, 64)] {
        let cube = Cube::<f32>::zeros(chirps, channels, samples);
        assert!(apply(cube, margin, &chain, quiet(0)).is_err(), "{chirps} {channels} {samples}");
    }
    let mut slow = chain.clone();
    slow.timing.slope_hz_per_s = 1e9;
    let e = apply(Cube::<f32>::zeros(4, 2, 512), 0, &slow, quiet(0)).unwrap_err().to_string();
    assert!(e.contains("swept"), "{e}");
}

/// Echoes above the band come back where they alias, through the filter's gain at their own frequency.
#[test]
fn an_echo_beyond_the_band_aliases() {
    let r = radar(Sampling::Real, 1, 1);
    let chain = with(&r, |s| s.filters.low_pass = Some(Butterworth { order: 4, corner_hz: 5e6 }));
    let f = &chain.settings.filters;
    let tau = 0.34e-6;
    let beat_hz = chain.timing.beat_hz(tau);
    assert!(beat_hz > 6.4e6 && !f.stops(Sampling::Real, 12.8e6, beat_hz));
    let gain = chain.echo_gain(0, beat_hz);
    let x: Vec<Complex64> =
        (0..512).map(|n| chain.timing.sampled(gain * beat(&chain, tau, n as f64 / 12.8e6))).collect();
    let z = spectrum(&x);
    let best = (1..256).max_by(|a, b| z[*a].norm().total_cmp(&z[*b].norm())).unwrap();
    assert!((best as f64 - (12.8e6 - beat_hz) / 25e3).abs() <= 0.5);
    let power = x.iter().map(|z| z.norm_sqr()).sum::<f64>() / 512.0;
    let stated = 1.0 / (1.0 + (beat_hz / 5e6).powi(8));
    assert!((power / stated - 1.0).abs() < 0.01, "{power} {stated}");
}

#[test]
fn kernel_agrees_with_the_processor() {
    let gpu = catseye::gpu::compare::test_gpu();
    catseye::gpu::layout::check_kernel(&convert::KERNEL).unwrap();
    for (sampling, kind, level) in [
        (Sampling::Iq, SaturationKind::Soft, QuantiserKind::MidTread),
        (Sampling::Real, SaturationKind::Hard, QuantiserKind::MidRise),
    ] {
        let r = radar(sampling, 40, 1);
        let mut chain = with(&r, everything);
        chain.settings.saturation = Some(Saturation { kind, full_scale_dbm: -22.0 });
        chain.settings.adc = Some(Adc { bits: 12, full_scale_dbm: -20.0, kind: level });
        let c = Convert::new(&chain.settings, sampling).unwrap();
        let mut host = echoes(&off(&r), 40, 512, 0, &[(2e-3, 1e-7), (1e-3, 2.1e-7), (1e-6, 1.5e-7)]).to_f32();
        let mut recorder = gpu.recorder("convert");
        let pieces = host
            .data
            .chunks(13 * 512)
            .enumerate()
            .map(|(i, part)| {
                let values: Vec<[f32; 2]> = part.iter().map(|z| [z.re, z.im]).collect();
                catseye::adc::CubePiece {
                    first_chirp: 13 * i,
                    chirps: part.len() / 512,
                    data: recorder.upload("cube", &values),
                }
            })
            .collect();
        let device = catseye::adc::DeviceCube { chirps: 40, channels: 1, samples: 512, pieces };
        c.record(&mut recorder, &device);
        let pending = device.read(&mut recorder);
        let got = device.take(&mut recorder.submit().unwrap(), pending);
        catseye::adc::cpu::convert::apply(&mut host, &c);
        let wide = |c: &Cube<f32>| -> Vec<Complex64> {
            c.data.iter().map(|z: &Complex<f32>| Complex64::new(z.re as f64, z.im as f64)).collect()
        };
        let e = relative(&wide(&got), &wide(&host), &wide(&host));
        println!("convert {sampling:?}: {e:.2e}");
        assert!(e < convert::KERNEL.tolerance.relative_l2, "{e}");
        assert!(e < 1e-4 && host.data.iter().any(|z| z.re != 0.0));
    }
}
