//! Staggered repetition: bursts of one slope with different periods in one frame.

use catseye::adc::Cube;
use catseye::adc::synthesis::point_echo;
use catseye::base::control::Control;
use catseye::base::frames::direction_from_angles;
use catseye::base::rng::Draws;
use catseye::detect::Point;
use catseye::detect::ambiguity::Ambiguity;
use catseye::detect::locate;
use catseye::engine::{AnyCube, Engine, Precision};
use catseye::scene::radar::Radar;
use catseye::scene::radar_figures::RadarFigures;
use catseye::scene::radar_toml::{parse, to_toml};
use catseye::trace::Echoes;
use glam::DVec3;
use std::path::Path;

/// A detector that lets much noise through.
const CFAR: &str = "[processing.cfar]\nkind = \"ca\"\nguard_range_cells = 2\nguard_doppler_cells = 2\n\
                    train_range_cells = 8\ntrain_doppler_cells = 4\nfalse_alarm_probability = 1e-3\n";

/// A long-range radar with `tx` transmitters in turn and eight receivers, in bursts of these periods.
fn radar(periods_s: &[f64], chirps: usize, tx: usize, more: &str) -> Radar {
    let burst = |p: &f64| {
        format!("[[waveform.ramp]]\nbandwidth_hz = 0.3e9\nramp_time_s = 17e-6\nchirp_period_s = {p}\n")
    };
    let bursts: String = periods_s.iter().map(burst).collect();
    let order = if periods_s.len() > 1 { "ramp_order = \"bursts\"\n" } else { "" };
    let antenna = |kind: &str, at: usize| format!("[[{kind}]]\nposition_half_wavelengths = [0, {at}, 0]\n");
    let array: String =
        (0..tx).map(|k| antenna("tx", 8 * k)).chain((0..8).map(|k| antenna("rx", k))).collect();
    let text = format!(
        "name = \"bursts\"\n[waveform]\ncarrier_hz = 76.5e9\nchirps = {chirps}\n{order}{bursts}\
         [receiver]\nsampling = \"iq\"\nsample_rate_hz = 20e6\nsamples = 320\nnoise_figure_db = 12\n\
         [transmitter]\npower_dbm = 12\n{array}[processing]\nazimuth_max_deg = 60\n{more}"
    );
    parse(Path::new("bursts.toml"), &text).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn cube(engine: &Engine, radar: &Radar, echoes: &Echoes) -> Cube<f64> {
    let (cube, _) = engine.cube(radar, echoes, &[], 5, 0, Control::default()).unwrap();
    match cube {
        AnyCube::F64(c) => c,
        AnyCube::F32(c) => c.to_f64(),
    }
}

/// Points of targets of equal level at (range, azimuth, range rate), by the whole chain without tracing.
fn points(radar: &Radar, targets: &[(f64, f64, f64)], seed: u64) -> Vec<Point> {
    let engine = Engine::Cpu(Precision::F32);
    let list = targets
        .iter()
        .zip(1..)
        .map(|((range, azimuth, rate), id)| {
            let u = direction_from_angles(*azimuth, 0.0);
            point_echo(u * *range, u * *rate, 3e4, id)
        })
        .collect();
    let echoes = Echoes { list, ..Default::default() };
    let (cube, _) = engine.cube(radar, &echoes, &[], seed, 0, Control::default()).unwrap();
    locate::points(&engine, radar, &mut engine.maps(radar, &cube).unwrap(), None).unwrap()
}

/// Each burst is what a radar with that burst alone would see at the burst's own middle.
#[test]
fn each_burst_is_a_frame_of_its_own_at_its_time() {
    let periods = [20e-6, 23e-6, 27.5e-6];
    for tx in [1, 2] {
        let mut all = radar(&periods, 32, tx, "");
        all.thermal_noise = false;
        let lengths: Vec<f64> = periods.iter().map(|p| p * 32.0 * tx as f64).collect();
        let total: f64 = lengths.iter().sum();
        assert!((all.frame_time_s() - total).abs() < 1e-15);
        let engine = Engine::Cpu(Precision::F64);
        let at = DVec3::new(80.0, 11.0, 0.5);
        let velocity = at.normalize() * -41.0;
        let echo = |at: DVec3| Echoes { list: vec![point_echo(at, velocity, 1.0, 1)], ..Default::default() };
        let seen = cube(&engine, &all, &echo(at));
        let mut before = 0.0;
        for (i, length) in lengths.iter().enumerate() {
            let middle_s = before + 0.5 * length - 0.5 * total;
            before += length;
            let mut alone = radar(&periods[i..=i], 32, tx, "");
            alone.thermal_noise = false;
            let mut echoes = echo(at);
            // Along the path that an echo moves with: its range rate is constant.
            echoes.list[0].path_length_m += echoes.list[0].path_rate_mps * middle_s;
            let want = cube(&engine, &alone, &echoes);
            let row = seen.channels * seen.samples;
            let largest = want.data.iter().map(|z| z.norm()).fold(0.0, f64::max);
            for m in 0..32 {
                let got = &seen.data[(m * periods.len() + i) * row..][..row];
                for (g, w) in got.iter().zip(&want.data[m * row..][..row]) {
                    assert!((g - w).norm() < 1e-5 * largest, "burst {i}, chirp {m}: {g} {w}");
                }
            }
        }
    }
}

#[test]
fn the_gpu_agrees_on_bursts() {
    let gpu = Engine::Gpu(Box::new(catseye::gpu::compare::opened_for_tests()));
    let radar = radar(&[20e-6, 24.5e-6], 64, 2, "");
    let list = (0..5)
        .map(|i| {
            let i = f64::from(i);
            point_echo(DVec3::new(30.0 + 17.0 * i, 4.0 - 3.0 * i, 0.0), DVec3::X * (20.0 * i - 55.0), 10.0, 1)
        })
        .collect();
    let echoes = Echoes { list, ..Default::default() };
    let (got, want) = (cube(&gpu, &radar, &echoes), cube(&Engine::Cpu(Precision::F64), &radar, &echoes));
    let squares = |it: &mut dyn Iterator<Item = f64>| it.sum::<f64>().sqrt();
    let error = squares(&mut got.data.iter().zip(&want.data).map(|(a, b)| (a - b).norm_sqr()))
        / squares(&mut want.data.iter().map(|z| z.norm_sqr()));
    println!("{error:.1e}");
    assert!(error < 1e-4, "{error}");
}

/// Range rates drawn from −98 to 98 m/s, far beyond the ±48 to ±24 m/s (±7 with two transmitters) of one burst: all are told, with
/// ranges of the middle of the frame.
#[test]
fn drawn_range_rates_are_unfolded() {
    let mut d = Draws::new(3, 118);
    for (periods, chirps, tx) in [
        (&[20e-6, 23e-6, 27.5e-6][..], 128, 1),
        (&[20e-6, 23.1e-6], 256, 1),
        (&[35e-6, 38e-6, 41.5e-6], 96, 1),
        (&[30e-6, 33e-6, 37.5e-6], 64, 2),
        (&[40e-6, 43e-6, 45.7e-6, 49e-6], 64, 3),
    ] {
        let radar = radar(periods, chirps, tx, "");
        let cell = RadarFigures::of(&radar).speed_resolution_mps.unwrap();
        let (mut resolved, mut seen) = (0, 0);
        for frame in 0..6 {
            // Far enough apart that none hides another.
            let targets: Vec<(f64, f64, f64)> = (0..8)
                .map(|i| (30.0 + 12.0 * f64::from(i), 0.8 * (d.uniform() - 0.5), 196.0 * d.uniform() - 98.0))
                .collect();
            let found = points(&radar, &targets, frame);
            for (range, azimuth, rate) in targets {
                let near = |p: &&Point| {
                    (p.range_m - range).abs() < 0.5
                        && (p.azimuth_rad - azimuth).abs() < 0.03
                        && p.snr_db > 15.0
                };
                let Some(p) = found.iter().find(near) else { continue };
                seen += 1;
                resolved += usize::from(p.ambiguity == Ambiguity::Resolved);
                // What is called resolved is right, and nothing else is off by anything but folds.
                if p.ambiguity == Ambiguity::Resolved {
                    assert!((p.range_rate_mps - rate).abs() < 0.5 * cell, "{rate}: {p:?}");
                    assert!((p.range_m - range).abs() < 5.0 * p.std.range_m + 0.02, "{range}: {p:?}");
                }
            }
        }
        println!("{periods:?}, {tx} transmitters: {resolved} of {seen} of 48 resolved");
        assert!(seen >= 46 && resolved >= seen - 1, "{periods:?}: {resolved} {seen}");
    }
}

/// Periods that fold alike say that they do; figures follow from them.
#[test]
fn periods_that_tell_too_little_say_so() {
    // 20 and 30 µs meet again at λ/2 over their greatest common measure of 10 µs; two bursts of 20 µs never part.
    for (periods, unambiguous_mps) in [(&[20e-6, 30e-6][..], 1.0 / 10e-6), (&[20e-6, 20e-6], 1.0 / 20e-6)] {
        let radar = radar(periods, 128, 1, "");
        let want = 0.25 * radar.wavelength_m() * unambiguous_mps;
        let got = RadarFigures::of(&radar).max_speed_mps.unwrap();
        assert!((got - want).abs() < 0.01 * want, "{periods:?}: {got} {want}");
        let found = points(&radar, &[(60.0, 0.1, -90.0)], 1);
        let p = &found[0];
        let folds = (p.range_rate_mps + 90.0) / (2.0 * want);
        // Another rate within ±100 m/s looks like it unless the span is wider than that.
        assert_eq!(p.ambiguity == Ambiguity::Resolved, 2.0 * want - 90.0 > 100.0, "{p:?}");
        assert!((folds - folds.round()).abs() * want < 1.0, "{p:?}");
    }
}

/// Of three bursts two are enough, and what one of them alone shows is not resolved.
#[test]
fn a_body_may_be_missing_in_one_of_three_bursts() {
    let radar = radar(&[20e-6, 23e-6, 27.5e-6], 128, 1, "");
    let engine = Engine::Cpu(Precision::F64);
    let rate = -90.0;
    let u = direction_from_angles(0.1, 0.0);
    let echoes = Echoes { list: vec![point_echo(u * 60.0, u * rate, 3e4, 1)], ..Default::default() };
    let whole = cube(&engine, &radar, &echoes);
    let row = whole.channels * whole.samples;
    for blank in [&[0][..], &[1], &[2], &[0, 1], &[1, 2]] {
        let mut seen = whole.clone();
        for (i, samples) in seen.data.chunks_mut(row).enumerate() {
            if blank.contains(&(i % 3)) {
                samples.fill(num_complex::Complex64::ZERO);
            }
        }
        let mut maps = engine.maps(&radar, &AnyCube::F64(seen)).unwrap();
        let found = locate::points(&engine, &radar, &mut maps, None).unwrap();
        let near = |p: &&Point| (p.azimuth_rad - 0.1).abs() < 0.03 && p.snr_db > 15.0;
        let p = found.iter().find(near).unwrap_or_else(|| panic!("{blank:?}: {found:?}"));
        let is_told = p.ambiguity == Ambiguity::Resolved;
        assert_eq!(is_told, blank.len() < 2, "{blank:?}: {p:?}");
        assert!(!is_told || (p.range_rate_mps - rate).abs() < 0.3, "{blank:?}: {p:?}");
    }
}

/// Noise alone makes bodies of several bursts by accident only.
#[test]
fn noise_alone_resolves_nothing() {
    for (periods, scale) in
        [(&[20e-6, 23e-6, 27.5e-6][..], 1.0), (&[20e-6, 23.1e-6], 1.0), (&[20e-6, 22.6e-6, 25.4e-6], 5.0)]
    {
        let periods: Vec<f64> = periods.iter().map(|p| p * scale).collect();
        let radar = radar(&periods, 128, 1, CFAR);
        let (mut all, mut resolved) = (0, 0);
        for frame in 0..20 {
            let found = points(&radar, &[], frame);
            all += found.len();
            resolved += found.iter().filter(|p| p.ambiguity == Ambiguity::Resolved).count();
        }
        println!("{periods:?}: {resolved} of {all} points of noise are resolved");
        assert!(all > 200 && resolved * 200 <= all, "{periods:?}: {resolved} of {all}");
    }
}

#[test]
fn files_keep_the_order() {
    let given = radar(&[20e-6, 23e-6], 128, 2, "");
    let text = to_toml(&given).unwrap();
    assert!(text.contains("ramp_order = \"bursts\""), "{text}");
    assert_eq!(parse(Path::new("again.toml"), &text).unwrap().waveform, given.waveform);
    // λ/2T of each burst.
    let folds: Vec<f64> = (0..2).map(|i| 2.0 * given.part(i).max_velocity_mps()).collect();
    for (fold, period) in folds.iter().zip([20e-6, 23e-6]) {
        let want = 0.5 * given.sample_wavelength_m() / (2.0 * period);
        assert!((fold / want - 1.0).abs() < 1e-12, "{fold} {want}");
    }
    let alone = "name = \"x\"\n[waveform]\ncarrier_hz = 77e9\nbandwidth_hz = 1e9\nramp_time_s = 40e-6\n\
                 chirp_period_s = 55e-6\nramp_order = \"bursts\"\nchirps = 16\n[receiver]\nsampling = \"iq\"\n\
                 sample_rate_hz = 10e6\nsamples = 128\nnoise_figure_db = 10\n[transmitter]\npower_dbm = 10\n\
                 [[tx]]\nposition_m = [0, 0, 0]\n[[rx]]\nposition_m = [0, 0, 0]\n";
    let error = parse(Path::new("alone.toml"), alone).unwrap_err().to_string();
    assert!(error.contains("alone.toml:7") && error.contains("a single ramp has no order"), "{error}");
}
