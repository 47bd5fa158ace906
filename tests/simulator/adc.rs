//! Synthesis and noise against closed forms and the formulas evaluated sample by sample.

use catseye::adc::cpu::noise;
use catseye::adc::cpu::synthesis::{Precision, synthesise};
use catseye::adc::noise::Noise;
use catseye::adc::synthesis::{
    Plan, beat_frequency_hz, channel_path_m, passes_filter, point_echo, power_gain,
};
use catseye::adc::{Cube, synthesis};
use catseye::base::control::Control;
use catseye::base::frames::{Pose, direction_from_angles};
use catseye::base::units::{C0, db_from_power, dbm_from_w, w_from_dbm};
use catseye::gpu::Gpu;
use catseye::gpu::compare::{check_close, opened_for_tests, test_device_name, test_gpu};
use catseye::scene::radar::*;
use catseye::scene::waveform::{Multiplex, Waveform};
use catseye::trace::{Echo, Echoes};
use glam::DVec3;
use num_complex::Complex64;
use std::f64::consts::{PI, TAU};

const V: Polarisation = Polarisation { v: Complex64::ONE, h: Complex64::ZERO };

fn antenna(x: f64, y: f64, z: f64) -> Antenna {
    Antenna {
        position_m: DVec3::new(x, y, z),
        polarisation: V,
        gain_dbi: 10.0,
        pattern: Pattern::CosinePower { azimuth_exponent: 2.0, elevation_exponent: 6.0 },
    }
}

/// 77 GHz, 2 TX and 3 RX with rows and columns.
fn radar() -> Radar {
    let half = 0.5 * C0 / 77e9;
    Radar {
        name: "test".into(),
        carrier_hz: 77e9,
        waveform: Waveform::chirp(1e9, 40e-6, 55e-6),
        multiplex: Multiplex::Tdm,
        adc_start_s: 0.5e-6,
        sample_rate_hz: 12.8e6,
        samples: 300,
        chirps: 16,
        sampling: Sampling::Iq,
        tx: vec![antenna(0.0, 0.0, 0.0), antenna(0.0, 3.0 * half, half)],
        rx: vec![antenna(0.0, 0.0, 0.0), antenna(0.0, half, 0.0), antenna(0.0, 2.0 * half, 0.0)],
        tx_power_dbm: 12.0,
        noise_figure_db: 12.0,
        thermal_noise: true,
        front_end: Default::default(),
        mounting: Pose::IDENTITY,
        motion: None,
        processing: Processing {
            range_window: Window::Rectangle,
            doppler_window: Window::Rectangle,
            angle_window: Window::Rectangle,
            range_fft: 512,
            doppler_fft: 16,
            azimuth_bins: 64,
            azimuth_fov_rad: 1.0,
            elevation_bins: 1,
            elevation_fov_rad: 0.3,
            angle: AngleSettings::default(),
            remove_static: false,
            keystone: false,
            migration_max_mps: 0.0,
            group: [0; 2],
            cfar: Cfar { kind: CfarKind::Ca, guard: [0, 2], train: [0, 8], pfa: 1e-3 },
            max_points: 100,
        },
    }
}

fn echoes(all: Vec<Echo>) -> Echoes {
    Echoes { list: all, ..Default::default() }
}

fn cube<T: Precision>(radar: &Radar, all: &Echoes) -> Cube<T> {
    synthesise(&Plan::new(radar, all).unwrap(), Control::default()).unwrap()
}

/// Equations 9-12 as they stand, one sample of one echo.
fn direct(radar: &Radar, r: &Echo, chirp: usize, channel: usize, n: usize) -> Complex64 {
    let (k, rx) = (channel / radar.rx.len(), channel % radar.rx.len());
    let (t, q) = (&radar.tx[k], &radar.rx[rx]);
    let ramp = radar.waveform.ramp().unwrap();
    let start = (chirp * radar.tx.len() + k) as f64 * ramp.period_s
        - 0.5 * (radar.chirps * radar.tx.len()) as f64 * ramp.period_s;
    let ramp_time = radar.adc_start_s + n as f64 / radar.sample_rate_hz;
    // The element's own path (eq. 144).
    let ends = [
        (r.departure * r.first_range_m, r.first_velocity_mps, t.position_m),
        (r.arrival * r.last_range_m, r.last_velocity_mps, q.position_m),
    ];
    let excess = |time: f64| -> f64 {
        ends.iter().map(|(p, v, e)| (p + v * time - e).length() - (p + v * time).length()).sum()
    };
    let time = start + ramp_time;
    let rate = r.path_rate_mps + (excess(5e-4) - excess(-5e-4)) / 1e-3;
    let tau = (r.path_length_m + excess(time) + r.path_rate_mps * time) / (C0 + 0.5 * rate);
    let slope = ramp.bandwidth_hz / ramp.time_s;
    let f0 = radar.carrier_hz - 0.5 * ramp.bandwidth_hz;
    let phi = TAU * (f0 * tau + slope * ramp_time * tau - 0.5 * slope * tau * tau);
    let mut jones = Complex64::ZERO;
    for (i, p) in [q.polarisation.v, q.polarisation.h].into_iter().enumerate() {
        for (j, e) in [t.polarisation.v, t.polarisation.h].into_iter().enumerate() {
            jones += p * r.path_gain[i][j] * e;
        }
    }
    let gain = (power_gain(t, r.departure) * power_gain(q, r.arrival)).sqrt();
    let a0 = w_from_dbm(radar.tx_power_dbm).sqrt() * (C0 / radar.carrier_hz) / (4.0 * PI) * gain * jones;
    let z = a0.conj() * Complex64::cis(phi);
    match radar.sampling {
        Sampling::Iq => z,
        Sampling::Real => Complex64::new(2f64.sqrt() * z.re, 0.0),
    }
}

/// Largest error over the peak, and the relative L2 error.
fn errors(got: &Cube<f64>, truth: &Cube<f64>) -> (f64, f64) {
    assert_eq!(got.data.len(), truth.data.len());
    let peak = truth.data.iter().map(|z| z.norm()).fold(0.0, f64::max);
    let worst = got.data.iter().zip(&truth.data).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    let l2 = got.data.iter().zip(&truth.data).map(|(a, b)| (a - b).norm_sqr()).sum::<f64>();
    assert!(worst.is_finite());
    (worst / peak, (l2 / truth.data.iter().map(|z| z.norm_sqr()).sum::<f64>()).sqrt())
}

fn direct_cube(radar: &Radar, all: &Echoes) -> Cube<f64> {
    let mut cube = Cube::zeros(radar.chirps, radar.channels(), radar.samples);
    let (channels, samples) = (cube.channels, cube.samples);
    for (i, z) in cube.data.iter_mut().enumerate() {
        let (m, c, n) = (i / (channels * samples), i / samples % channels, i % samples);
        let received = all.list.iter().filter(|r| passes_filter(radar, beat_frequency_hz(radar, r)));
        *z = received.map(|r| direct(radar, r, m, c, n)).sum();
    }
    cube
}

/// A repeatable spread of echoes with every entry of S, moving and still.
fn many(count: usize, speed: f64) -> Echoes {
    let word = |i: usize, j: usize| {
        catseye::base::rng::philox4x32_10([i as u32, j as u32, 0, 7], [1, 2])[0] as f64 / 4_294_967_296.0
    };
    echoes(
        (0..count)
            .map(|i| {
                let range = 2.0 + 50.0 * word(i, 0);
                let u = direction_from_angles(word(i, 1) - 0.5, 0.3 * (word(i, 2) - 0.5));
                let w = direction_from_angles(word(i, 3) - 0.5, 0.3 * (word(i, 4) - 0.5));
                let mut r = point_echo(u * range, DVec3::ZERO, 1.0, 1);
                r.arrival = w;
                r.last_range_m = range * (0.5 + word(i, 5));
                r.path_rate_mps = if i % 3 == 0 { 0.0 } else { 2.0 * speed * (2.0 * word(i, 6) - 1.0) };
                for (k, s) in r.path_gain.iter_mut().flatten().enumerate() {
                    *s = Complex64::from_polar(word(i, 7 + k), TAU * word(i, 11 + k)) / (range * range);
                }
                r
            })
            .collect(),
    )
}

#[test]
fn phase_at_every_sample_is_that_of_the_formula() {
    // The gate's case: -20 m/s, 2.46 GHz over a ramp of 48 us, of which 32.8 us are sampled.
    let mut radar = radar();
    radar.carrier_hz = 77e9 + 1.23e9;
    radar.waveform = Waveform::chirp(2.46e9, 48e-6, 55e-6);
    radar.sample_rate_hz = 62.5e6;
    radar.samples = 2050;
    radar.sampling = Sampling::Iq;
    let all = echoes(vec![point_echo(DVec3::new(30.0, 4.0, 0.5), DVec3::new(-20.0, 0.0, 0.0), 10.0, 1)]);
    let got = cube::<f64>(&radar, &all);
    let mut worst = 0.0f64;
    for m in 0..radar.chirps {
        for c in 0..radar.channels() {
            for (n, z) in got.row(m, c).iter().enumerate() {
                let truth = direct(&radar, &all.list[0], m, c, n);
                worst = worst.max((z * truth.conj()).arg().abs());
                assert!((z.norm() / truth.norm() - 1.0).abs() < 1e-9);
            }
        }
    }
    println!("worst phase error {worst:.2e} rad");
    assert!(worst < 1e-6, "{worst}");
}

#[test]
fn stop_and_hop_would_be_off_by_two_radians() {
    let mut radar = radar();
    radar.waveform = Waveform::chirp(2.46e9, 32.8e-6, 55e-6);
    radar.sample_rate_hz = 62.5e6;
    radar.adc_start_s = 0.0;
    radar.samples = 2050;
    radar.chirps = 1;
    (radar.tx, radar.rx) = (vec![antenna(0.0, 0.0, 0.0)], vec![antenna(0.0, 0.0, 0.0)]);
    let all = echoes(vec![point_echo(DVec3::new(30.0, 0.0, 0.0), DVec3::new(-20.0, 0.0, 0.0), 10.0, 1)]);
    let got = cube::<f64>(&radar, &all);
    // The delay of the ramp's start, held through the ramp.
    let tau = 2.0 * (30.0 - 20.0 * -0.5 * radar.chirp_period_s()) / (C0 - 20.0);
    let stopped = |n: usize| TAU * radar.slope_hz_per_s() * tau * n as f64 / radar.sample_rate_hz;
    let last = radar.samples - 1;
    let gained = (got.data[last] * got.data[0].conj()).arg() - stopped(last);
    let gained = gained - TAU * (gained / TAU).round();
    // 2 pi (f0 + B) 2 v T / c, with the sweep centred on 77 GHz.
    println!("stop and hop differs by {gained:.3} rad");
    assert!((gained + 2.15).abs() < 0.01, "{gained}");
}

#[test]
fn cube_equals_the_sum_of_the_formulas() {
    for sampling in [Sampling::Iq, Sampling::Real] {
        let mut radar = radar();
        radar.sampling = sampling;
        radar.rx[1].polarisation = Polarisation { v: Complex64::new(0.6, 0.0), h: Complex64::new(0.0, 0.8) };
        radar.tx[1].gain_dbi = 7.0;
        let all = many(37, 30.0);
        let truth = direct_cube(&radar, &all);
        let (worst, l2) = errors(&cube::<f64>(&radar, &all), &truth);
        println!("f64 {sampling:?}: worst {worst:.1e} of the peak, L2 {l2:.1e}");
        assert!(worst < 1e-9);
        let (worst, l2) = errors(&cube::<f32>(&radar, &all).to_f64(), &truth);
        println!("f32 {sampling:?}: worst {worst:.1e} of the peak, L2 {l2:.1e}");
        assert!(worst < 1e-4 && l2 < 1e-4);
    }
}

#[test]
fn single_precision_keeps_80_db_for_any_echo_and_radar() {
    // One echo at a time, so that errors cannot average out; short and steep ramps make the beat frequency drift.
    for (samples, bandwidth, ramp, rate) in [
        (512, 1e9, 40e-6, 12.8e6),
        (64, 4e9, 30e-6, 2.2e6),
        (16, 4e9, 60e-6, 0.3e6),
        (2048, 2.46e9, 48e-6, 62.5e6),
    ] {
        let mut radar = radar();
        (radar.samples, radar.sample_rate_hz) = (samples, rate);
        radar.waveform = Waveform::chirp(bandwidth, ramp, 55e-6);
        radar.chirps = 8;
        let r_max = C0 * rate / (2.0 * radar.slope_hz_per_s());
        for (part, speed) in
            [(0.001, 0.0), (0.1, -70.0), (0.25, 70.0), (0.3, -20.0), (0.5, 70.0), (0.9, -70.0), (0.999, 0.0)]
        {
            let all = echoes(vec![point_echo(
                DVec3::new(part * r_max, 0.1 * part * r_max, 0.0),
                DVec3::new(speed, 0.0, 0.0),
                1.0,
                1,
            )]);
            if Plan::new(&radar, &all).unwrap().echo_summary.dropped > 0 {
                continue;
            }
            let truth = cube::<f64>(&radar, &all);
            let (worst, l2) = errors(&cube::<f32>(&radar, &all).to_f64(), &truth);
            println!("{samples} samples, {part} r_max, {speed} m/s: worst {worst:.1e}, L2 {l2:.1e}");
            assert!(worst < 1e-4);
        }
    }
}

/// Power of a cube's channel at a beat frequency, summed coherently over all samples and averaged over chirps.
fn dft_power_w(radar: &Radar, cube: &Cube<f64>, channel: usize, hz: f64) -> f64 {
    let n = radar.samples as f64;
    (0..radar.chirps)
        .map(|m| {
            let row = cube.row(m, channel);
            let x: Complex64 = row
                .iter()
                .enumerate()
                .map(|(i, z)| z * Complex64::cis(-TAU * hz * i as f64 / radar.sample_rate_hz))
                .sum();
            x.norm_sqr() / (n * n)
        })
        .sum::<f64>()
        / radar.chirps as f64
}

#[test]
fn ten_dbsm_at_50_m_by_hand() {
    // 12 dBm + 10 dBi + 10 dBi + 20 lg(lambda) + 10 dBsm - 30 lg(4 pi) - 40 lg(50), lambda 3.89340 mm:
    // 42 - 48.1935 - 32.9763 - 67.9588 dBm.
    let hand = -107.1286;
    for sampling in [Sampling::Iq, Sampling::Real] {
        let mut radar = radar();
        radar.sampling = sampling;
        radar.samples = 512;
        let all = echoes(vec![point_echo(DVec3::new(50.0, 0.0, 0.0), DVec3::ZERO, 10.0, 1)]);
        let cube = cube::<f64>(&radar, &all);
        let beat = radar.slope_hz_per_s() * 2.0 * 50.0 / C0;
        // Half of a real signal's power lies at the negative frequency.
        let half = if sampling == Sampling::Real { 2.0 } else { 1.0 };
        if sampling == Sampling::Real {
            assert_eq!(
                Plan::new(&radar, &all).unwrap().echo_summary.dropped,
                1,
                "50 m lies beyond N/2 cells here"
            );
            continue;
        }
        let power = dbm_from_w(half * dft_power_w(&radar, &cube, 0, beat));
        println!("{sampling:?}: {power:.4} dBm, by hand {hand}");
        assert!((power - hand).abs() < 0.05, "{power}");
    }
    let mut radar = radar();
    radar.sampling = Sampling::Real;
    radar.samples = 512;
    radar.waveform = Waveform::chirp(0.4e9, 40e-6, 55e-6);
    let all = echoes(vec![point_echo(DVec3::new(50.0, 0.0, 0.0), DVec3::ZERO, 10.0, 1)]);
    let beat = radar.slope_hz_per_s() * 2.0 * 50.0 / C0;
    let power = dbm_from_w(2.0 * dft_power_w(&radar, &cube::<f64>(&radar, &all), 0, beat));
    println!("real: {power:.4} dBm, by hand {hand}");
    assert!((power - hand).abs() < 0.05, "{power}");
}

/// Phase step from one row to another at the same sample, radians in -pi..pi.
fn step(cube: &Cube<f64>, from: (usize, usize), to: (usize, usize)) -> f64 {
    (cube.row(to.0, to.1)[10] * cube.row(from.0, from.1)[10].conj()).arg()
}

#[test]
fn signs_of_doppler_azimuth_and_elevation() {
    let mut radar = radar();
    let half = 0.5 * radar.wavelength_m();
    radar.rx[2] = antenna(0.0, 0.0, half);
    radar.tx.truncate(1);
    let at = |azimuth: f64, elevation: f64, v: f64| {
        let u = direction_from_angles(azimuth, elevation);
        let all = echoes(vec![point_echo(u * 30.0, u * v, 1.0, 1)]);
        cube::<f64>(&radar, &all)
    };
    // Slow-time frequency +2v/lambda: positive when receding.
    let loop_period = radar.loop_period_s();
    for v in [-6.0, 6.0] {
        let expected = TAU * 2.0 * v / radar.wavelength_m() * loop_period;
        assert!(expected.abs() < PI);
        assert!((step(&at(0.0, 0.0, v), (0, 0), (1, 0)) - expected).abs() < 0.02, "{v}");
    }
    // An element further left has the shorter path to a target on the left: the phase falls by k u.p.
    for a in [-0.4f64, 0.4] {
        assert!((step(&at(a, 0.0, 0.0), (0, 0), (0, 1)) + PI * a.sin()).abs() < 0.02, "{a}");
        assert!((step(&at(0.0, a, 0.0), (0, 0), (0, 2)) + PI * a.sin()).abs() < 0.02, "{a}");
    }
}

#[test]
fn transmitters_take_turns() {
    let mut radar = radar();
    // Two transmitters in one place: their channels differ by the time between their chirps alone.
    radar.tx[1] = radar.tx[0].clone();
    let v = 3.0;
    let all = echoes(vec![point_echo(DVec3::new(30.0, 0.0, 0.0), DVec3::new(v, 0.0, 0.0), 1.0, 1)]);
    let cube = cube::<f64>(&radar, &all);
    let expected = TAU * 2.0 * v / radar.wavelength_m() * radar.chirp_period_s();
    assert!((step(&cube, (4, 0), (4, 3)) - expected).abs() < 0.01);
    assert!((step(&cube, (4, 3), (5, 0)) - expected).abs() < 0.01);
    // Time zero is the middle of the frame: the middle chirp sees the range as given.
    let m = radar.chirps / 2;
    let still = echoes(vec![point_echo(DVec3::new(30.0, 0.0, 0.0), DVec3::ZERO, 1.0, 1)]);
    let moved = (cube.row(m, 0)[0] * self::cube::<f64>(&radar, &still).row(m, 0)[0].conj()).arg();
    assert!(moved.abs() < TAU * 2.0 * v / radar.wavelength_m() * 2e-6 + 0.01, "{moved}");
}

#[test]
fn still_scenes_repeat_in_every_loop_and_mix_with_moving_ones() {
    let radar = radar();
    let all = many(30, 0.0);
    let cube = cube::<f32>(&radar, &all);
    assert_eq!(Plan::new(&radar, &all).unwrap().echo_summary.moving, 0);
    let row = radar.channels() * radar.samples;
    assert!((1..radar.chirps).all(|m| cube.data[..row] == cube.data[m * row..(m + 1) * row]));
}

#[test]
fn same_bytes_whatever_the_number_of_threads() {
    let radar = radar();
    let all = many(3000, 20.0);
    let plan = Plan::new(&radar, &all).unwrap();
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut cube: Cube<f32> = synthesise(&plan, Control::default()).unwrap();
            noise::add(&mut cube, &Noise::thermal(&radar, 5, 2).unwrap());
            cube
        })
    };
    assert!(run(1) == run(3));
}

#[test]
fn progress_and_cancel() {
    use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
    let radar = radar();
    let all = many(5, 20.0);
    let plan = Plan::new(&radar, &all).unwrap();
    let (most, total) = (AtomicU64::new(0), AtomicU64::new(0));
    let progress = |done: u64, of: u64| {
        most.fetch_max(done, Ordering::Relaxed);
        total.store(of, Ordering::Relaxed);
    };
    synthesise::<f32>(&plan, Control { progress: Some(&progress), cancel: None }).unwrap();
    assert_eq!(most.load(Ordering::Relaxed), total.load(Ordering::Relaxed));
    let stop = AtomicBool::new(true);
    assert!(synthesise::<f32>(&plan, Control { progress: None, cancel: Some(&stop) }).is_err());
}

#[test]
fn anti_alias_filter_decides_what_wraps() {
    let mut radar = radar();
    radar.samples = 512;
    let r_max = C0 * radar.sample_rate_hz / (2.0 * radar.slope_hz_per_s());
    let at = |r: f64, v: f64| point_echo(DVec3::new(r, 0.0, 0.0), DVec3::new(v, 0.0, 0.0), 1.0, 1);
    let all = echoes(vec![at(r_max - 0.5, 0.0), at(r_max + 0.5, 0.0), at(0.01, -30.0), at(5.0, -30.0)]);
    let plan = Plan::new(&radar, &all).unwrap();
    assert_eq!(plan.echo_summary.dropped, 2);
    assert_eq!(plan.echo_summary.moving, 1);
    let a = &radar.tx[0];
    let expected = |r: f64| {
        w_from_dbm(12.0) * power_gain(a, DVec3::X).powi(2) * radar.wavelength_m().powi(2)
            / ((4.0 * PI).powi(3) * r.powi(4))
    };
    let power = plan.echo_summary.dropped_power_w;
    assert!((power / (expected(r_max + 0.5) + expected(0.01)) - 1.0).abs() < 1e-9);
    // A real mixer hears negative beat frequencies too.
    radar.sampling = Sampling::Real;
    assert_eq!(Plan::new(&radar, &all).unwrap().echo_summary.dropped, 2);
    assert!(beat_frequency_hz(&radar, &all.list[2]) < 0.0);
    assert!(passes_filter(&radar, beat_frequency_hz(&radar, &all.list[2])));
}

#[test]
fn beat_frequency_is_the_slope_of_the_phase() {
    let radar = radar();
    for r in &many(20, 40.0).list {
        let mut radar = radar.clone();
        radar.tx = vec![antenna(0.0, 0.0, 0.0)];
        radar.rx = radar.tx.clone();
        radar.samples = 257;
        let all = echoes(vec![r.clone()]);
        let plan = Plan::new(&radar, &all).unwrap();
        let k = plan.coefficients(0, 0);
        let slope = k.about(0.5 * radar.chirps as f64, 128.0).b0 * radar.sample_rate_hz;
        // The beat frequency drifts by some ten hertz from the frame's middle to the sample's time.
        assert!((slope - beat_frequency_hz(&radar, r)).abs() < 100.0);
    }
}

#[test]
fn echoes_that_are_not_numbers_are_refused() {
    let radar = radar();
    let mut all = many(3, 1.0);
    all.list[1].path_gain[1][0] = Complex64::new(f64::NAN, 0.0);
    let message = Plan::new(&radar, &all).err().unwrap().to_string();
    assert!(message.contains("echo 1"), "{message}");
}

#[test]
fn channel_paths_are_those_of_spheres() {
    let radar = radar();
    let p = DVec3::new(1.5, -0.7, 0.2);
    let r = point_echo(p, DVec3::ZERO, 1.0, 1);
    for (k, t) in radar.tx.iter().enumerate() {
        for (q, a) in radar.rx.iter().enumerate() {
            let truth = (p - t.position_m).length() + (p - a.position_m).length();
            assert!((channel_path_m(&radar, &r, k, q) - truth).abs() < 1e-14);
        }
    }
}

/// A point over flat ground with reflection -1: direct, up-down, down-up, and both by the image.
fn over_ground(distance: f64, radar_height: f64, target_height: f64, sigma: f64) -> Echoes {
    let up = DVec3::new(distance, 0.0, target_height - radar_height);
    let down = DVec3::new(distance, 0.0, -target_height - radar_height);
    let leg = |image: bool| if image { down } else { up };
    let mut all = Vec::new();
    for out in [false, true] {
        for back in [false, true] {
            let (d, a) = (leg(out), leg(back));
            let mut r = point_echo(up, DVec3::ZERO, sigma, 1);
            (r.departure, r.first_range_m) = (d.normalize(), d.length());
            (r.arrival, r.last_range_m) = (a.normalize(), a.length());
            r.path_length_m = d.length() + a.length();
            let sign = if out == back { 1.0 } else { -1.0 };
            let s = sign * (sigma / (4.0 * PI)).sqrt() / (d.length() * a.length());
            r.path_gain = [[Complex64::from(s), Complex64::ZERO], [Complex64::ZERO, Complex64::from(s)]];
            all.push(r);
        }
    }
    echoes(all)
}

#[test]
fn two_rays_over_ground_make_the_known_nulls_and_peaks() {
    let mut radar = radar();
    let iso =
        Antenna { position_m: DVec3::ZERO, polarisation: V, gain_dbi: 0.0, pattern: Pattern::Isotropic };
    (radar.tx, radar.rx) = (vec![iso.clone()], vec![iso]);
    (radar.chirps, radar.samples) = (1, 16);
    // A narrow sweep, so that one wavelength holds.
    radar.waveform = Waveform::chirp(1e5, 40e-6, 55e-6);
    // Power over that of free space, which is 16 sin^4(k h1 h2 / d).
    let gain = |d: f64| {
        let all = over_ground(d, 0.15, 0.35, 1.0);
        let mean = |all: &Echoes| {
            cube::<f64>(&radar, all).data.iter().map(|z| z.norm_sqr()).sum::<f64>() / radar.samples as f64
        };
        db_from_power(mean(&all) / mean(&echoes(vec![all.list[0].clone()])))
    };
    let extreme = |about: f64, sign: f64| {
        let d = |i: i32| about * (1.0 + 0.0005 * i as f64);
        let best = (-100..=100).max_by(|a, b| (sign * gain(d(*a))).total_cmp(&(sign * gain(d(*b))))).unwrap();
        (d(best), gain(d(best)))
    };
    for null in [26.97, 13.48, 8.98, 6.73] {
        let (d, g) = extreme(null, -1.0);
        println!("null {null}: at {d:.3} m, {g:.1} dB");
        assert!((d / null - 1.0).abs() < 0.01 && g < -40.0, "{null}: {d} {g}");
    }
    for peak in [53.9, 17.98, 10.78, 7.70] {
        let (d, g) = extreme(peak, 1.0);
        println!("peak {peak}: at {d:.3} m, {g:.2} dB");
        assert!((d / peak - 1.0).abs() < 0.01 && (g - 12.04).abs() < 0.1, "{peak}: {d} {g}");
    }
}

#[test]
fn noise_has_the_right_power_and_is_white() {
    for sampling in [Sampling::Iq, Sampling::Real] {
        let mut radar = radar();
        radar.sampling = sampling;
        let n = 1 << 20;
        let mut cube = Cube::<f64>::zeros(1, 1, n);
        noise::add(&mut cube, &Noise::thermal(&radar, 0x1234_5678_9abc_def0, 3).unwrap());
        let power = 1.380649e-23 * 290.0 * 10f64.powf(1.2) * 12.8e6;
        let mean = |f: &dyn Fn(&Complex64) -> f64| cube.data.iter().map(f).sum::<f64>() / n as f64;
        let (i2, q2, iq) = (mean(&|z| z.re * z.re), mean(&|z| z.im * z.im), mean(&|z| z.re * z.im));
        let i4 = mean(&|z| z.re.powi(4));
        // 1 % is seven standard deviations of a variance over 2^20 samples.
        assert!((i2 / (0.5 * power) - 1.0).abs() < 0.01, "{}", i2 / power);
        assert!((i4 / (3.0 * i2 * i2) - 1.0).abs() < 0.02, "kurtosis {}", i4 / (i2 * i2));
        assert!(mean(&|z| z.re).abs() < 5.0 * (i2 / n as f64).sqrt());
        match sampling {
            Sampling::Iq => {
                assert!((q2 / (0.5 * power) - 1.0).abs() < 0.01);
                assert!(iq.abs() / i2 < 5.0 / (n as f64).sqrt(), "{}", iq / i2);
            }
            Sampling::Real => assert!(cube.data.iter().all(|z| z.im == 0.0)),
        }
        let lag: Complex64 = cube.data.windows(2).map(|w| w[1] * w[0].conj()).sum::<Complex64>() / n as f64;
        assert!(lag.norm() / (i2 + q2) < 5.0 / (n as f64).sqrt(), "{}", lag.norm() / (i2 + q2));
    }
}

#[test]
fn noise_depends_on_seed_and_frame_alone() {
    let radar = radar();
    let draw = |seed, frame| {
        let mut cube = Cube::<f32>::zeros(2, 3, 50);
        noise::add(&mut cube, &Noise::thermal(&radar, seed, frame).unwrap());
        cube.data
    };
    assert_eq!(draw(1, 0), draw(1, 0));
    for (seed, frame) in [(2, 0), (1, 1), (1 | 1 << 32, 0)] {
        assert!(draw(1, 0).iter().zip(&draw(seed, frame)).all(|(a, b)| a != b));
    }
    let mut quiet = radar.clone();
    quiet.thermal_noise = false;
    assert!(Noise::thermal(&quiet, 1, 0).is_none());
}

fn on_gpu(gpu: &Gpu, plan: &Plan, noise: Option<Noise>) -> Cube<f32> {
    let mut recorder = gpu.recorder("adc");
    let cube = plan.record(gpu, &mut recorder).unwrap();
    if let Some(noise) = noise {
        noise.record(&mut recorder, &cube);
    }
    let pending = cube.read(&mut recorder);
    let mut done = recorder.submit().unwrap();
    cube.take(&mut done, pending)
}

fn parts<T: Copy>(cube: &Cube<T>) -> Vec<T> {
    cube.data.iter().flat_map(|z| [z.re, z.im]).collect()
}

#[test]
fn gpu_synthesis_agrees_with_f64() {
    let tolerance = catseye::adc::synthesis::KERNEL.tolerance.relative_l2;
    for (sampling, samples, bandwidth, ramp, rate, speed) in [
        (Sampling::Iq, 300, 1e9, 40e-6, 12.8e6, 30.0),
        (Sampling::Real, 512, 1e9, 40e-6, 25.6e6, 30.0),
        (Sampling::Iq, 2048, 2.46e9, 48e-6, 62.5e6, 20.0),
        (Sampling::Iq, 64, 1e9, 40e-6, 12.8e6, 70.0),
        (Sampling::Iq, 128, 1e9, 40e-6, 12.8e6, 0.0),
    ] {
        let mut radar = radar();
        (radar.sampling, radar.samples) = (sampling, samples);
        radar.sample_rate_hz = rate;
        radar.waveform = Waveform::chirp(bandwidth, ramp, 55e-6);
        for all in [many(201, speed), many(1, speed), many(0, 0.0)] {
            let plan = Plan::new(&radar, &all).unwrap();
            let want = cube::<f64>(&radar, &all);
            let got = on_gpu(test_gpu(), &plan, None);
            let d = check_close(&parts(&got), &parts(&want), tolerance).unwrap();
            println!("{sampling:?} {samples}, {} echoes: {:.1e}", all.list.len(), d.relative_l2);
            if all.list.len() == 201 {
                let (worst, _) = errors(&got.to_f64(), &want);
                assert!(worst < 1e-4);
            }
        }
    }
}

#[test]
fn gpu_pieces_are_the_whole() {
    let mut radar = radar();
    radar.chirps = 7;
    let all = many(50, 20.0);
    let plan = Plan::new(&radar, &all).unwrap();
    let noise = Noise::thermal(&radar, 9, 4);
    let whole = on_gpu(test_gpu(), &plan, noise);
    // Two chirps in a piece; all echoes in one upload, so the sums keep their order.
    let limit = |bytes| opened_for_tests().with_poisoned_buffers().with_binding_limit(bytes);
    let pieces = on_gpu(&limit(2 * 6 * 300 * 8 + 100), &plan, noise);
    assert!(parts(&whole) == parts(&pieces));
    // Echoes in several uploads: the same up to rounding. Few samples, so that a chirp still fits.
    radar.samples = 20;
    let plan = Plan::new(&radar, &all).unwrap();
    let whole = on_gpu(test_gpu(), &plan, None);
    let pieces = on_gpu(&limit(6 * 32 * 7), &plan, None);
    check_close(&parts(&pieces), &parts(&whole.to_f64()), 1e-6).unwrap();
    let few = limit(300);
    let mut recorder = few.recorder("adc");
    assert!(plan.record(&few, &mut recorder).err().unwrap().to_string().contains("300 bytes"));
}

#[test]
fn gpu_adds_up_more_echoes_than_a_software_driver_loops() {
    let mut radar = radar();
    (radar.samples, radar.chirps) = (16, 2);
    radar.tx.truncate(1);
    radar.rx.truncate(1);
    // Still and moving ones, 70,000 of each, nearly in phase; a loop cut short would miss 6 %.
    for rate in [0.0, 1.0] {
        let one = |i: usize| {
            let at = DVec3::new(20.0 + 1e-9 * i as f64, 0.3, 0.1);
            point_echo(at, DVec3::new(rate, 0.0, 0.0), 1.0, 1)
        };
        let all = echoes((0..70_000).map(one).collect());
        let plan = Plan::new(&radar, &all).unwrap();
        let truth: Cube<f64> = synthesise(&plan, Control::default()).unwrap();
        // -80 dB: 16,384 terms of one sign in a row round more than the kernel's tolerance foresees (2e-5).
        check_close(&parts(&on_gpu(test_gpu(), &plan, None)), &parts(&truth), 1e-4).unwrap();
    }
}

#[test]
fn gpu_refuses_a_drift_that_it_cannot_follow() {
    let mut radar = radar();
    (radar.samples, radar.sample_rate_hz) = (16, 0.3e6);
    radar.waveform = Waveform::chirp(4e9, 60e-6, 60e-6);
    let all = echoes(vec![point_echo(DVec3::new(0.3, 0.0, 0.0), DVec3::new(70.0, 0.0, 0.0), 1.0, 1)]);
    let plan = Plan::new(&radar, &all).unwrap();
    assert_eq!(plan.echo_summary.dropped, 0);
    let mut recorder = test_gpu().recorder("adc");
    assert!(plan.record(test_gpu(), &mut recorder).err().unwrap().to_string().contains("drifts"));
}

#[test]
fn gpu_noise_is_that_of_the_cpu() {
    for sampling in [Sampling::Iq, Sampling::Real] {
        let mut radar = radar();
        (radar.sampling, radar.chirps, radar.samples) = (sampling, 40, 512);
        let none = echoes(Vec::new());
        let noise = Noise::thermal(&radar, 0xfeed_0123_4567_89ab, 77).unwrap();
        let got = on_gpu(test_gpu(), &Plan::new(&radar, &none).unwrap(), Some(noise));
        let mut want = cube::<f64>(&radar, &none);
        noise::add(&mut want, &noise);
        let tolerance = catseye::adc::noise::KERNEL.tolerance.relative_l2;
        let d = check_close(&parts(&got), &parts(&want), tolerance).unwrap();
        println!("noise {sampling:?}: {:.1e}", d.relative_l2);
    }
}

/// `cargo test --release -p catseye --test simulator adc -- --ignored --nocapture speed`
#[test]
#[ignore = "a measurement"]
fn speed() {
    let mut radar = radar();
    radar.samples = 512;
    radar.chirps = 16;
    let all = many(3 * 4000, 20.0);
    let plan = Plan::new(&radar, &all).unwrap();
    println!("{:?}, {}", plan.echo_summary, catseye::base::simd::level());
    let still = plan.set(synthesis::Set::Still).len();
    let work = (plan.echo_summary.moving as usize * plan.chirps + still) * plan.channels * plan.samples;
    // The best of several: others use this machine too.
    let best = |f: &mut dyn FnMut() -> f64| (0..8).map(|_| f()).fold(f64::INFINITY, f64::min);
    let timed = |f: &mut dyn FnMut()| {
        best(&mut || {
            let t = std::time::Instant::now();
            f();
            t.elapsed().as_secs_f64()
        })
    };
    let per = |seconds: f64| 1e9 * seconds / work as f64;
    let (mut a, mut b) = (Cube::zeros(0, 0, 0), Cube::zeros(0, 0, 0));
    let f32_s = timed(&mut || a = synthesise::<f32>(&plan, Control::default()).unwrap());
    let f64_s = timed(&mut || b = synthesise::<f64>(&plan, Control::default()).unwrap());
    let (worst, l2) = errors(&a.to_f64(), &b);
    println!("cpu f32 {:.4} ns, f64 {:.4} ns per echo and sample", per(f32_s), per(f64_s));
    println!("f32 against f64: worst {worst:.1e} of the peak, L2 {l2:.1e}");
    let noise_s = timed(&mut || noise::add(&mut a, &Noise::thermal(&radar, 1, 0).unwrap()));
    println!("noise {:.2} ns per sample", 1e9 * noise_s / a.data.len() as f64);
    let mut record_s = f64::INFINITY;
    let gpu_s = best(&mut || {
        let mut recorder = test_gpu().recorder("adc");
        let t = std::time::Instant::now();
        let cube = plan.record(test_gpu(), &mut recorder).unwrap();
        record_s = record_s.min(t.elapsed().as_secs_f64());
        let pending = cube.read(&mut recorder);
        let mut done = recorder.submit().unwrap();
        cube.take(&mut done, pending);
        done.seconds()
    });
    println!(
        "{}: {:.4} ns per echo and sample; record {:.1} ns per echo and channel",
        test_device_name(),
        per(gpu_s),
        1e9 * record_s / (all.list.len() * plan.channels) as f64
    );
}
