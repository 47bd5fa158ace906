//! Front ends that are known, and what a fit makes of cubes that they made.

use catseye::adc::Cube;
use catseye::adc::cpu::front_end::{Inputs, apply};
use catseye::adc::front_end::Chain;
use catseye::adc::noise::Noise;
use catseye::base::units::{C0, db_from_power, w_from_dbm};
use catseye::scene::front_end::{
    Adc, ChannelErrors, DcOffset, FrontEndSettings, IqImbalance, Leakage, PhaseNoise, QuantiserKind,
};
use catseye::scene::radar::Radar;
use catseye::scene::radar_toml;
use catseye::scene::waveform::Multiplex;
use catseye_io::cube::{CubeOptions, open_cube};
use catseye_io::cube_layout::Axis;
use catseye_io::sensor_fit::compare::{
    Levels, assumed_radar_toml, beside, effects, fitted, kolmogorov_smirnov,
};
use catseye_io::sensor_fit::estimate::{Fit, FitOptions, fit};
use glam::DVec3;
use num_complex::Complex64;
use std::f64::consts::TAU;
use std::path::Path;

fn radar(shape: [usize; 3], front_end: FrontEndSettings) -> Radar {
    let mut radar = radar_toml::parse(Path::new("r.toml"), &assumed_radar_toml(shape)).unwrap();
    radar.front_end = front_end;
    radar
}

/// A target at rest of this beat frequency and power.
fn cube(radar: &Radar, bin: f64, power_dbm: f64, seed: u64) -> Cube<f64> {
    let chain = Chain::new(radar, &radar.front_end);
    let (margin, n) = (chain.margin(), radar.samples);
    let mut cube = Cube::<f64>::zeros(radar.chirps, radar.channels(), n + 2 * margin);
    let bin_hz = radar.sample_rate_hz / n as f64;
    for (row, data) in cube.data.chunks_mut(n + 2 * margin).enumerate() {
        let gain = chain.echo_gain(row % radar.channels(), bin * bin_hz) * w_from_dbm(power_dbm).sqrt();
        for (i, z) in data.iter_mut().enumerate() {
            *z = gain * Complex64::cis(TAU * bin * (i as f64 - margin as f64) / n as f64);
        }
    }
    let noise = Noise::thermal(radar, seed, 0);
    apply(cube, margin, &chain, Inputs { noise: noise.as_ref(), seed, ..Default::default() }).unwrap()
}

fn near(what: &str, ours: f64, expected: f64, within: f64) {
    println!("{what}: {ours} (known {expected})");
    assert!((ours - expected).abs() <= within, "{what}: {ours}, known {expected}, within {within}");
}

fn fit_of(cube: &Cube<f64>) -> Fit {
    let radar = radar([cube.chirps, cube.channels, cube.samples], FrontEndSettings::default());
    fit(Path::new("a.npy"), cube, &radar, FitOptions { is_boresight: true, knows_antennas: true }).unwrap()
}

#[test]
fn a_known_front_end_comes_back() {
    let shape = [64, 4, 256];
    let known = FrontEndSettings {
        adc: Some(Adc { bits: 12, full_scale_dbm: -45.0, kind: QuantiserKind::MidTread }),
        iq: Some(IqImbalance { gain_db: 0.8, phase_rad: 3f64.to_radians() }),
        dc: Some(DcOffset { i: 2e-5, q: -1e-5 }),
        // 1.6 bins of 39.06 kHz at 30 MHz/µs.
        leakage: Some(Leakage { isolation_db: 70.0, delay_s: 1.6 * 39062.5 / 30e12 }),
        channels: Some(ChannelErrors {
            gain_db: vec![0.0, 1.0, -1.0, 0.5],
            phase_rad: [0.0, 10.0, -20.0, 30.0f64].map(f64::to_radians).to_vec(),
            ..Default::default()
        }),
        ..Default::default()
    };
    let radar = radar(shape, known.clone());
    let made = cube(&radar, 60.3, -55.0, 3);
    let found = fit_of(&made);
    let out = fitted(Path::new("a.npy"), &found, &radar, Levels::Absolute, Some(12)).unwrap();
    let f = &out.radar.front_end;
    let (adc, iq, dc, leak) = (f.adc.unwrap(), f.iq.unwrap(), f.dc.unwrap(), f.leakage.unwrap());
    assert_eq!((adc.bits, adc.kind), (12, QuantiserKind::MidTread));
    near("full scale, dBm", adc.full_scale_dbm, -45.0, 1e-4);
    near("gain of Q, dB", iq.gain_db, 0.8, 0.02);
    near("phase of Q, deg", iq.phase_rad.to_degrees(), 3.0, 0.15);
    near("constant in I", dc.i * 1e5, 2.0, 0.02);
    near("constant in Q", dc.q * 1e5, -1.0, 0.02);
    // Gains are counted from the channels' mean power, which the leakage has, too.
    let mean = [0.0, 1.0, -1.0, 0.5f64].iter().map(|g| 10f64.powf(0.1 * g)).sum::<f64>() / 4.0;
    near("isolation, dB", leak.isolation_db, 70.0 - db_from_power(mean), 0.02);
    near("delay, bins", leak.delay_s * 30e12 / 39062.5, 1.6, 0.02);
    // A median of 244 cells in each of 256 bins, and third differences that share chirps.
    near("noise figure, dB", out.radar.noise_figure_db, 15.0, 0.15);
    near("slope, dB over all bins", found.floor_slope_db * 256.0, 0.0, 0.3);
    let line = found.line.as_ref().unwrap();
    near("line, bins", line.bin, 60.3, 2e-3);
    let c = f.channels.as_ref().unwrap();
    // The fit counts from the mean, and from the mean direction of the phasors.
    for (k, (gain, phase)) in [(0.0, 0.0), (1.0, 10.0), (-1.0, -20.0), (0.5, 30.0)].into_iter().enumerate() {
        near("gain, dB", c.gain_db[k] - c.gain_db[0], gain, 0.03);
        near("phase, deg", (c.phase_rad[k] - c.phase_rad[0]).to_degrees(), phase, 0.2);
    }
    let [largest, _] = found.correlations().unwrap();
    assert!(largest < 5.0 * found.chance_correlation, "{largest} {}", found.chance_correlation);
    assert!(f.phase_noise.is_none(), "{:?}", f.phase_noise);
    // What it makes is alike in every respect.
    let again = out.simulated(Path::new("a.npy"), &found, 8).unwrap();
    let compared = beside([&made, &again], [&found, &fit_of(&again)]);
    println!("{:?} {:?} {:?}", compared.noise_test, compared.floor_db, compared.main_lobe_db);
    assert!(compared.noise_test.p_value > 0.01, "{:?}", compared.noise_test);
    assert!(compared.floor_db[0] < 1.0 && compared.main_lobe_db.unwrap()[1] < 0.1, "{:?}", compared.floor_db);
    // Another noise is told apart.
    let mut louder = radar.clone();
    louder.noise_figure_db += 1.0;
    let other = cube(&louder, 60.3, -55.0, 9);
    let compared = beside([&made, &other], [&found, &fit_of(&other)]);
    assert!(compared.noise_test.p_value < 1e-3, "{:?}", compared.noise_test);
    // Each floor is uncertain by half a decibel a bin.
    near("floor, dB", compared.floor_db[0], 1.25, 0.35);
}

#[test]
fn phase_noise_comes_back_from_the_sidebands() {
    let known = PhaseNoise { offset_hz: vec![1e5, 5e5, 2e6], dbc_per_hz: vec![-90.0, -95.0, -140.0] };
    let settings = FrontEndSettings { phase_noise: Some(known.clone()), ..Default::default() };
    let radar = radar([128, 1, 512], settings);
    let made = cube(&radar, 200.4, -45.0, 5);
    let found = fit_of(&made);
    let out = fitted(Path::new("a.npy"), &found, &radar, Levels::Absolute, None).unwrap();
    let p = out.radar.front_end.phase_noise.unwrap();
    for (f, l) in p.offset_hz.iter().zip(&p.dbc_per_hz) {
        println!("{f:.3e} Hz: {l:.1} dBc/Hz, known {:.1}", db_from_power(known.density_per_hz(*f)));
    }
    let within = |f: &f64| (2e5..8e5).contains(f);
    assert!(p.offset_hz.iter().filter(|f| within(f)).count() >= 2, "{p:?}");
    for (f, l) in p.offset_hz.iter().zip(&p.dbc_per_hz).filter(|(f, _)| within(f)) {
        near("phase noise, dBc/Hz", *l, db_from_power(known.density_per_hz(*f)), 2.5);
    }
}

/// A cube of points (range in bins, Doppler in bins of the frame, sine of azimuth, power in dBm) for an ideal radar with 2 Tx (TDM) and
/// 4 Rx, with the phase between slots and the drift over range bins that the motion gives.
fn points(radar: &Radar, points: &[[f64; 4]], seed: u64) -> Cube<f64> {
    let (m, k, n) = (radar.chirps, radar.channels(), radar.samples);
    let mut cube = Cube::<f64>::zeros(m, k, n);
    let band = radar.slope_hz_per_s() * n as f64 / radar.sample_rate_hz;
    for (row, data) in cube.data.chunks_mut(n).enumerate() {
        let (chirp, channel) = (row / k, row % k);
        let slot = channel / radar.rx.len();
        let time = chirp as f64 + slot as f64 / radar.slots() as f64;
        for [bin, doppler, sine, dbm] in points {
            // Spherical waves: +2π/λ times the path beyond that by way of the origin.
            let range = 0.5 * C0 * bin * radar.sample_rate_hz / n as f64 / radar.slope_hz_per_s();
            let target = range * DVec3::new((1.0 - sine * sine).sqrt(), *sine, 0.0);
            let (tx, rx) = (&radar.tx[slot], &radar.rx[channel % radar.rx.len()]);
            let path = (target - tx.position_m).length() + (target - rx.position_m).length() - 2.0 * range;
            let cycles = doppler * time / m as f64 + path / radar.wavelength_m();
            let bin = bin + doppler * band / radar.carrier_hz * (time / m as f64 - 0.5);
            for (i, z) in data.iter_mut().enumerate() {
                *z += w_from_dbm(*dbm).sqrt() * Complex64::cis(TAU * (cycles + bin * i as f64 / n as f64));
            }
        }
    }
    let noise = Noise::thermal(radar, seed, 0);
    let chain = Chain::new(radar, &radar.front_end);
    apply(cube, 0, &chain, Inputs { noise: noise.as_ref(), seed, ..Default::default() }).unwrap()
}

/// Each effect is found by chance with a probability of 1e-6 (`channels::FALSE_ALARM`), in all cubes here of less than 1e-3. Seeds are
/// fixed.
#[test]
fn an_ideal_radar_has_no_front_end() {
    let text = assumed_radar_toml([64, 4, 128])
        .replace("[[tx]]", "[[tx]]\nposition_half_wavelengths = [0, -4, 0]\n[[tx]]");
    let radar = radar_toml::parse(Path::new("r.toml"), &text).unwrap();
    let cubes: [&[[f64; 4]]; 11] = [
        &[],
        &[[40.3, 0.0, 0.0, -70.0]],
        &[[40.3, 0.0, 0.4, -70.0]],
        &[[40.3, 0.0, 0.4, -112.0]],
        &[[40.3, 7.3, 0.4, -70.0]],
        &[[40.3, 1.2, 0.4, -70.0]],
        &[[40.3, 64.0, 0.4, -70.0]],
        &[[40.3, 150.4, -0.2, -70.0], [60.7, -20.2, 0.3, -75.0]],
        &[[40.3, 0.0, 0.4, -70.0], [40.6, 0.0, -0.3, -73.0]],
        &[[40.3, 0.0, 0.0, -70.0], [87.9, 0.0, 0.1, -73.0]],
        &[[12.3, 0.0, 0.3, -60.0], [40.0, 20.0, 0.1, -73.0]],
    ];
    for (i, cube) in cubes.iter().enumerate() {
        let made = points(&radar, cube, 20 + i as u64);
        let options = FitOptions { is_boresight: false, knows_antennas: true };
        let found = fit(Path::new("a.npy"), &made, &radar, options).unwrap();
        let out = fitted(Path::new("a.npy"), &found, &radar, Levels::Absolute, None).unwrap();
        assert_eq!(out.radar.front_end, FrontEndSettings::default(), "cube {i}: {:#?}", out.remarks);
        assert!(effects(&found, &out).iter().all(|e| !e.is_significant));
    }
}

/// Transmitters that send at once: the cube of DDM has the receivers' channels alone, that of BPM one channel for each code and receiver. What
/// is found is a front end that the same radar's file takes.
#[test]
fn channels_come_back_where_transmitters_send_at_once() {
    let text = assumed_radar_toml([66, 4, 128])
        .replace("[[tx]]", "[[tx]]\nposition_half_wavelengths = [0, -4, 0]\n[[tx]]");
    let gain_db = [0.9, -1.2, 0.4, -0.3];
    let phase_deg = [14.0f64, -21.0, 3.0, 8.0];
    for multiplex in ["ddm", "bpm"] {
        let text = text.replace("\"tdm\"", &format!("\"{multiplex}\""));
        let ideal = radar_toml::parse(Path::new("r.toml"), &text).unwrap();
        for is_ideal in [true, false] {
            let mut radar = ideal.clone();
            if !is_ideal {
                // The same for each transmitter.
                radar.front_end.channels = Some(ChannelErrors {
                    gain_db: [gain_db, gain_db].concat(),
                    phase_rad: [phase_deg, phase_deg].concat().iter().map(|p: &f64| p.to_radians()).collect(),
                    ..Default::default()
                });
            }
            let errors = Chain::new(&radar, &radar.front_end);
            let (k, n) = (radar.channels(), radar.samples);
            let mut made = Cube::<f64>::zeros(radar.chirps, k, n);
            for (row, data) in made.data.chunks_mut(n).enumerate() {
                let (chirp, channel) = (row / k, row % k);
                let (slot, rx) = (channel / radar.rx.len(), channel % radar.rx.len());
                for tx in 0..radar.tx.len() {
                    let sent = match radar.multiplex {
                        Multiplex::Ddm { bands } => Complex64::cis(TAU * (chirp * tx) as f64 / bands as f64),
                        _ => Complex64::from(radar.multiplex.weight(slot, tx)),
                    };
                    let gain = errors.echo_gain(tx * radar.rx.len() + rx, 0.0) * w_from_dbm(-70.0).sqrt();
                    for (i, z) in data.iter_mut().enumerate() {
                        *z += gain * sent * Complex64::cis(TAU * 40.3 * i as f64 / n as f64);
                    }
                }
            }
            let noise = Noise::thermal(&ideal, 5, 0);
            let chain = Chain::new(&ideal, &ideal.front_end);
            let inputs = Inputs { noise: noise.as_ref(), seed: 5, ..Default::default() };
            let made = apply(made, 0, &chain, inputs).unwrap();
            let options = FitOptions { is_boresight: true, knows_antennas: true };
            let found = fit(Path::new("a.npy"), &made, &ideal, options).unwrap();
            let out = fitted(Path::new("a.npy"), &found, &ideal, Levels::Absolute, None).unwrap();
            let cube = out.simulated(Path::new("a.npy"), &found, 1).unwrap();
            assert_eq!((cube.chirps, cube.channels, cube.samples), (made.chirps, k, n));
            if is_ideal {
                assert_eq!(
                    out.radar.front_end,
                    FrontEndSettings::default(),
                    "{multiplex}: {:#?}",
                    out.remarks
                );
                continue;
            }
            let channels = out.radar.front_end.channels.as_ref().unwrap();
            assert_eq!(channels.gain_db.len(), 8);
            for c in 1..8 {
                let [g, p] = [
                    channels.gain_db[c] - channels.gain_db[0],
                    (channels.phase_rad[c] - channels.phase_rad[0]).to_degrees(),
                ];
                near("gain", g, gain_db[c % 4] - gain_db[0], 0.05);
                near("phase", p, phase_deg[c % 4] - phase_deg[0], 0.5);
            }
        }
    }
}

#[test]
fn distributions_are_told_apart() {
    let line = |n: usize, by: f64| -> Vec<f64> { (0..n).map(|i| i as f64 / n as f64 + by).collect() };
    let same = kolmogorov_smirnov(&line(1000, 0.0), &line(500, 0.0));
    assert!(same.distance < 2e-3 && same.p_value > 0.999, "{same:?}");
    // Moved by a tenth: distance 0.1, and Q(λ) with λ = 0.1 (√n + 0.12 + 0.11/√n), n = 500.
    let moved = kolmogorov_smirnov(&line(1000, 0.0), &line(1000, 0.1));
    assert!((moved.distance - 0.1).abs() < 2e-3, "{moved:?}");
    let z = moved.distance * (500f64.sqrt() + 0.12 + 0.11 / 500f64.sqrt());
    let q = 2.0 * ((-2.0 * z * z).exp() - (-8.0 * z * z).exp());
    assert!((moved.p_value - q).abs() < 1e-9, "{moved:?} {q}");
}

#[test]
fn levels_are_found_whatever_occurs() {
    // Every third level of 0.25 from −7·0.25 on, but one in between.
    let levels = [-7, -4, -1, 2, 5, 8, 9];
    let mut c = Cube::<f64>::zeros(32, 1, 64);
    // A linear congruential generator: noise enough for a floor.
    let mut state = 1u64;
    let mut next = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        0.25 * f64::from(levels[(state >> 33) as usize % 7])
    };
    c.data.iter_mut().for_each(|z| *z = Complex64::new(next(), next()));
    let q = fit_of(&c).quantiser.unwrap();
    assert_eq!((q.step, q.kind, q.least_bits), (0.25, QuantiserKind::MidTread, 5));
    c.data.iter_mut().for_each(|z| *z += Complex64::new(0.125, 0.125));
    assert_eq!(fit_of(&c).quantiser.unwrap().kind, QuantiserKind::MidRise);
    for (i, z) in c.data.iter_mut().enumerate() {
        *z += Complex64::new((i as f64).sin(), (i as f64).cos());
    }
    assert_eq!(fit_of(&c).quantiser, None);
}

/// One frame of a board: figures that docs/guides/sensor-twin.md states.
#[test]
fn a_measured_frame_gives_these_figures() {
    let path =
        Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data/openradar/simple_frame_1.npy"));
    let axes = Some(vec![Axis::Chirp, Axis::Sample]);
    let mut source =
        open_cube(path, &CubeOptions { axes, unsigned_words: true, ..Default::default() }, None).unwrap();
    let data = source.frame::<f64>(0).unwrap();
    let measured = Cube { chirps: 128, channels: 1, samples: 128, data };
    let radar = radar([128, 1, 128], FrontEndSettings::default());
    let found = fit(path, &measured, &radar, FitOptions::default()).unwrap();
    let q = found.quantiser.unwrap();
    assert_eq!((q.step, q.least_bits, q.largest), (1.0, 9, 188.0));
    let out = fitted(path, &found, &radar, Levels::NoiseFigure, Some(16)).unwrap();
    near("noise figure, dB", out.radar.noise_figure_db, 15.0, 1e-6);
    println!("{}", out.toml(&[]).unwrap());
    let simulated = out.simulated(path, &found, 0).unwrap();
    let again = fit(path, &simulated, &radar, FitOptions::default()).unwrap();
    let c = beside([&measured, &simulated], [&found, &again]);
    println!(
        "{:?} {:?} {:?} {:?} {:?}",
        c.noise_test, c.sample_test, c.floor_db, c.main_lobe_db, c.side_lobe_db
    );
    near("constant, I", found.mean_dc().re, 8.510, 1e-3);
    near("constant, Q", found.mean_dc().im, 11.505, 1e-3);
    near("noise, rms of a part", (0.5 * found.noise_variance).sqrt(), 4.786, 1e-3);
    let leak = found.leak.as_ref().unwrap();
    near("leakage, bins", leak.bin, 1.170, 1e-3);
    near("leakage, u", leak.rms, 40.856, 1e-3);
    near("line, bins", found.line.as_ref().unwrap().bin, 106.666, 1e-3);
    assert!(!found.imbalance.as_ref().unwrap().is_significant);
    assert!(out.radar.front_end.phase_noise.is_none());
    // The frame's echoes are not simulated, so its samples differ; its noise does not.
    assert!(c.noise_test.p_value > 0.01 && c.sample_test.p_value < 1e-6);
    assert!(c.floor_db[0] < 1.6 && c.main_lobe_db.unwrap()[0] < 0.5, "{:?} {:?}", c.floor_db, c.main_lobe_db);
}
