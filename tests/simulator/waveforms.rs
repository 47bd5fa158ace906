//! Every waveform against its own formula evaluated sample by sample, and through the chain.

use catseye::adc::synthesis::point_echo;
use catseye::base::control::Control;
use catseye::base::units::C0;
use catseye::detect::ambiguity::Ambiguity;
use catseye::detect::locate;
use catseye::detect::points::range_rate_mps;
use catseye::engine::{AnyCube, Engine, Extent, FrameInput, Precision};
use catseye::scene::radar::{Cfar, CfarKind, Radar};
use catseye::scene::radar_toml::parse;
use catseye::scene::waveform::{Multiplex, PulseShape, Ramp, RampOrder, Slopes, Waveform};
use catseye::trace::{Echo, Echoes};
use glam::DVec3;
use num_complex::Complex64;
use std::f64::consts::{PI, SQRT_2, TAU};
use std::path::Path;

/// A radar with one transmitter and one receiver, isotropic, without noise and with plain windows.
fn radar(waveform: &str, receiver: &str) -> Radar {
    let text = format!(
        "name = \"w\"\n[waveform]\n{waveform}\n[receiver]\nnoise_figure_db = 10\nthermal_noise = false\n{receiver}\n\
         [transmitter]\npower_dbm = 10\n[[tx]]\nposition_m = [0, 0, 0]\n[[rx]]\nposition_m = [0, 0, 0]\n"
    );
    parse(Path::new("w.toml"), &text).unwrap_or_else(|e| panic!("{e}"))
}

fn stepped() -> Radar {
    radar(
        "kind = \"stepped-frequency\"\ncarrier_hz = 77e9\nstep_hz = 2e6\nchirp_period_s = 60e-6\nchirps = 16",
        "sampling = \"iq\"\nsample_rate_hz = 5e6\nsamples = 256",
    )
}

fn falling(sampling: &str) -> Radar {
    radar(
        "carrier_hz = 77e9\nbandwidth_hz = -0.5e9\nramp_time_s = 40e-6\nchirp_period_s = 55e-6\nchirps = 16",
        &format!("sampling = \"{sampling}\"\nsample_rate_hz = 12.8e6\nsamples = 480\nadc_start_s = 1e-6"),
    )
}

fn triangle() -> Radar {
    let ramp = |b: &str| {
        format!("[[waveform.ramp]]\nbandwidth_hz = {b}\nramp_time_s = 1e-3\nchirp_period_s = 1.1e-3\n")
    };
    radar(
        &format!("carrier_hz = 76.5e9\nchirps = 8\n{}{}", ramp("150e6"), ramp("-150e6")),
        "sampling = \"iq\"\nsample_rate_hz = 512e3\nsamples = 512",
    )
}

fn pulse(sampling: &str) -> Radar {
    let rate = if sampling == "real" { 23.328e9 } else { 6e9 };
    let samples = if sampling == "real" { 1536 } else { 400 };
    radar(
        "kind = \"pulse\"\ncarrier_hz = 8.748e9\nbandwidth_hz = 1.5e9\nchirp_period_s = 0.05\nchirps = 4",
        &format!(
            "sampling = \"{sampling}\"\nsample_rate_hz = {rate}\nsamples = {samples}\nadc_start_s = 8.8e-9"
        ),
    )
}

fn coded() -> Radar {
    radar(
        "kind = \"pmcw\"\ncarrier_hz = 79e9\nchip_rate_hz = 1e9\ncode_degree = 9\nchirp_period_s = 20e-6\nchirps = 32",
        "sampling = \"iq\"\nsample_rate_hz = 2e9\nsamples = 1022",
    )
}

/// Echoes at these ranges with these range rates.
fn echoes(all: &[(f64, f64)]) -> Echoes {
    let all = all
        .iter()
        .enumerate()
        .map(|(i, (range, rate))| {
            let u = DVec3::new(1.0, 0.1 * i as f64, 0.0).normalize();
            point_echo(u * *range, u * *rate, 1.0 + i as f64, i as u32 + 1)
        })
        .collect();
    Echoes { list: all, ..Default::default() }
}

fn cube(radar: &Radar, echoes: &Echoes) -> catseye::adc::Cube<f64> {
    match Engine::Cpu(Precision::F64).cube(radar, echoes, &[], 0, 0, Control::default()).unwrap() {
        (AnyCube::F64(c), front_end) => {
            assert_eq!(front_end.dropped, 0, "an echo was not received");
            c
        }
        _ => panic!("not in f64"),
    }
}

/// conj(a) of eq. 9 for isotropic antennas of one place, √W.
fn amplitude(radar: &Radar, r: &Echo) -> Complex64 {
    let power = 1e-3 * 10f64.powf(radar.tx_power_dbm / 10.0);
    (power.sqrt() * (C0 / radar.carrier_hz) / (4.0 * PI) * r.path_gain[0][0]).conj()
}

/// Delay at time t (eq. 11).
fn delay(r: &Echo, t: f64) -> f64 {
    (r.path_length_m + r.path_rate_mps * t) / (C0 + 0.5 * r.path_rate_mps)
}

/// Largest difference over the largest sample.
fn worst(radar: &Radar, echoes: &Echoes, sample: impl Fn(&Echo, usize, usize) -> Complex64) -> f64 {
    let got = cube(radar, echoes);
    let (mut error, mut peak) = (0.0f64, 0.0f64);
    for m in 0..got.chirps {
        for (n, z) in got.row(m, 0).iter().enumerate() {
            let want: Complex64 = echoes.list.iter().map(|r| sample(r, m, n)).sum();
            error = error.max((z - want).norm());
            peak = peak.max(want.norm());
        }
    }
    assert!(peak > 0.0 && error.is_finite());
    error / peak
}

/// Start of chirp m of a radar with one ramp.
fn start(radar: &Radar, m: usize, period: f64) -> f64 {
    (m as f64 - 0.5 * radar.chirps as f64) * period
}

#[test]
fn stepped_frequency_is_a_tone_at_a_time() {
    let radar = stepped();
    let all = echoes(&[(20.0, 0.0), (33.0, -30.0), (5.0, 14.0)]);
    let error = worst(&radar, &all, |r, m, n| {
        let t = start(&radar, m, 60e-6) + n as f64 / 5e6;
        let f = 77e9 + (n as f64 - 128.0) * 2e6;
        amplitude(&radar, r) * Complex64::cis(TAU * f * delay(r, t))
    });
    println!("{error:.1e}");
    assert!(error < 1e-7, "{error}");
}

#[test]
fn a_falling_ramp_has_its_formula() {
    for sampling in ["iq", "real"] {
        let radar = falling(sampling);
        let all = echoes(&[(20.0, 0.0), (33.0, -30.0), (5.0, 14.0)]);
        let error = worst(&radar, &all, |r, m, n| {
            let ramp_time = 1e-6 + n as f64 / 12.8e6;
            let tau = delay(r, start(&radar, m, 55e-6) + ramp_time);
            let (f0, slope) = (77e9 + 0.25e9, -0.5e9 / 40e-6);
            let z = amplitude(&radar, r)
                * Complex64::cis(TAU * (f0 * tau + slope * ramp_time * tau - 0.5 * slope * tau * tau));
            if sampling == "real" { Complex64::new(SQRT_2 * z.re, 0.0) } else { z }
        });
        println!("{sampling}: {error:.1e}");
        assert!(error < 1e-7, "{sampling}: {error}");
    }
}

#[test]
fn ramps_come_in_turn() {
    let radar = triangle();
    let all = echoes(&[(40.0, -12.0)]);
    let error = worst(&radar, &all, |r, row, n| {
        let sign = if row % 2 == 0 { 1.0 } else { -1.0 };
        let ramp_time = n as f64 / 512e3;
        let tau = delay(r, (row as f64 - 8.0) * 1.1e-3 + ramp_time);
        let (f0, slope) = (76.5e9 - sign * 75e6, sign * 150e9);
        amplitude(&radar, r)
            * Complex64::cis(TAU * (f0 * tau + slope * ramp_time * tau - 0.5 * slope * tau * tau))
    });
    println!("{error:.1e}");
    assert!(error < 1e-7, "{error}");
}

#[test]
fn pulses_come_back_with_their_shape() {
    for sampling in ["iq", "real"] {
        let radar = pulse(sampling);
        let Waveform::Pulse { shape, .. } = &radar.waveform else { panic!("no pulse") };
        let all = echoes(&[(2.0, 0.0), (5.0, -30.0), (9.5, 55.0)]);
        let error = worst(&radar, &all, |r, m, n| {
            let after = 8.8e-9 + n as f64 / radar.sample_rate_hz;
            let tau = delay(r, start(&radar, m, 0.05) + after);
            let z = amplitude(&radar, r) * shape.at(after - tau).conj() * Complex64::cis(TAU * 8.748e9 * tau);
            match sampling {
                "real" => Complex64::new(SQRT_2 * (z * Complex64::cis(-TAU * 8.748e9 * after)).re, 0.0),
                _ => z,
            }
        });
        println!("{sampling}: {error:.1e}");
        assert!(error < 2e-6, "{sampling}: {error}");
    }
}

#[test]
fn a_given_pulse_is_sent_as_given() {
    let mut radar = pulse("iq");
    let envelope =
        vec![Complex64::new(0.2, 0.1), Complex64::ONE, Complex64::new(-0.5, 0.3), Complex64::new(0.1, 0.0)];
    radar.waveform = Waveform::Pulse {
        shape: PulseShape::Samples { rate_hz: 6e9, envelope: envelope.clone(), zero: 1 },
        period_s: 0.05,
    };
    // Sampled at the rate of the shape, an echo whose delay is a whole sample shows the samples themselves.
    let range = 0.5 * C0 * (8.8e-9 + 100.0 / 6e9);
    let all = echoes(&[(range, 0.0)]);
    let got = cube(&radar, &all);
    let a = amplitude(&radar, &all.list[0]) * Complex64::cis(TAU * 8.748e9 * all.list[0].path_length_m / C0);
    for (n, z) in got.row(0, 0).iter().enumerate() {
        let want = match n {
            99..=102 => a * envelope[n - 99].conj(),
            _ => Complex64::ZERO,
        };
        assert!((z - want).norm() < 2e-3 * a.norm(), "sample {n}: {z} for {want}");
    }
}

/// At one sample a chip an echo with a whole number of chips of delay is the code shifted, exactly; a moving one turns by its
/// Doppler shift from sample to sample.
#[test]
fn a_code_comes_back_shifted() {
    let mut radar = coded();
    (radar.sample_rate_hz, radar.samples) = (1e9, 511);
    let Waveform::Coded { code, .. } = &radar.waveform else { panic!("no code") };
    let all = echoes(&[(0.5 * C0 * 37e-9, 0.0), (0.5 * C0 * 200e-9, 0.0)]);
    let error = worst(&radar, &all, |r, _, n| {
        let tau = r.path_length_m / C0;
        let chips = (tau * 1e9).round() as usize;
        amplitude(&radar, r) * f64::from(code[(n + 511 - chips) % 511]) * Complex64::cis(TAU * 79e9 * tau)
    });
    assert!(error < 1e-6, "{error}");
    // Fourier series of the code, with the delay of each sample.
    let radar = coded();
    let Waveform::Coded { code, .. } = &radar.waveform else { panic!("no code") };
    let spectrum: Vec<(f64, Complex64)> = (-255..=255)
        .map(|k| {
            let turn = |i: usize| Complex64::cis(-TAU * f64::from(k) * i as f64 / 511.0);
            (
                f64::from(k),
                code.iter().enumerate().map(|(i, c)| f64::from(*c) * turn(i)).sum::<Complex64>() / 511.0,
            )
        })
        .collect();
    let all = echoes(&[(31.7, 60.0)]);
    let r = &all.list[0];
    let got = cube(&radar, &all);
    for (m, n) in [(0, 0), (0, 1021), (7, 300), (31, 1000)] {
        let after = n as f64 / 2e9;
        let tau = delay(r, start(&radar, m, 20e-6) + after);
        let envelope: Complex64 =
            spectrum.iter().map(|(k, c)| c * Complex64::cis(TAU * k * 1e9 / 511.0 * (after - tau))).sum();
        let want = amplitude(&radar, r) * envelope.conj() * Complex64::cis(TAU * 79e9 * tau);
        let z = got.row(m, 0)[n];
        assert!((z - want).norm() < 1e-6 * amplitude(&radar, r).norm(), "{m}, {n}: {z} for {want}");
    }
}

/// Every waveform puts a target at its range and range rate, with the sign, and reads its power.
#[test]
fn targets_stand_where_they_are() {
    for (name, radar, range, rate, tolerance) in [
        ("stepped", stepped(), 20.0, -9.0, 0.05),
        ("falling iq", falling("iq"), 30.0, 11.0, 0.05),
        ("falling real", falling("real"), 15.0, -11.0, 0.05),
        ("pulse iq", pulse("iq"), 6.0, 0.04, 0.02),
        ("pulse real", pulse("real"), 6.0, -0.05, 0.02),
        ("code", coded(), 40.0, -8.0, 0.04),
    ] {
        let all = echoes(&[(range, rate)]);
        let engine = Engine::Cpu(Precision::F64);
        let cube = AnyCube::F64(cube(&radar, &all));
        let found = engine.range_doppler(&radar, &cube).unwrap();
        let at = (0..found.map.data.len())
            .max_by(|a, b| found.map.data[*a].total_cmp(&found.map.data[*b]))
            .unwrap();
        let cell = catseye::dsp::Cell {
            doppler: (at / found.map.range_bins) as u32,
            range: (at % found.map.range_bins) as u32,
        };
        let peak = catseye::dsp::peaks::place(&found.map, cell, [None, None]);
        let v = catseye::detect::points::range_rate_mps(&radar, peak.doppler);
        let r = catseye::detect::points::range_m(&radar, peak.range, v, radar.range_per_rate_s());
        let level = 10.0 * (found.map.data[at] / amplitude(&radar, &all.list[0]).norm_sqr()).log10();
        println!("{name}: {r:.3} m for {range}, {v:.3} m/s for {rate}, {level:.2} dB");
        assert!((r - range).abs() < tolerance, "{name}: {r}");
        assert!((v - rate).abs() < 0.3 * radar.velocity_bin_mps(), "{name}: {v}");
        // Between cells two Hann windows lose up to 2.84 dB.
        assert!((-2.9..0.05).contains(&level), "{name}: {level}");
    }
}

/// Both slopes see a target; its motion moves the beat up on one and down on the other (M, FM-CW).
#[test]
fn slopes_shift_a_moving_target_to_opposite_sides() {
    let radar = triangle();
    let (range, rate) = (60.0, -15.0);
    let all = echoes(&[(range, rate)]);
    let engine = Engine::Cpu(Precision::F64);
    let cube = AnyCube::F64(cube(&radar, &all));
    let mut seen = Vec::new();
    for i in 0..2 {
        let part = radar.part(i);
        let found = engine.range_doppler(&part, &cube).unwrap();
        let at = (0..found.map.data.len())
            .max_by(|a, b| found.map.data[*a].total_cmp(&found.map.data[*b]))
            .unwrap();
        let cell = catseye::dsp::Cell {
            doppler: (at / found.map.range_bins) as u32,
            range: (at % found.map.range_bins) as u32,
        };
        seen.push(catseye::dsp::peaks::place(&found.map, cell, [None, None]).range * part.range_bin_m());
        let coupling_s = [0.51, -0.51][i] * part.sample_centre_hz() / part.carrier_hz;
        assert!((part.range_per_rate_s() - part.middle_s() - coupling_s).abs() < 1e-9);
    }
    let middle = 0.5 * (seen[0] + seen[1]);
    let half = 0.5 * (seen[0] - seen[1]);
    println!("{seen:?}");
    assert!((middle - range).abs() < 0.2, "{middle}");
    assert!((half / 0.51 - rate).abs() < 0.4, "{half}");
}

fn mimo(multiplex: &str, chirps: usize) -> Radar {
    let text = format!(
        "name = \"m\"\n[waveform]\ncarrier_hz = 77e9\nbandwidth_hz = 0.5e9\nramp_time_s = 20e-6\nchirp_period_s = 25e-6\n\
         chirps = {chirps}\n{multiplex}\n[receiver]\nsampling = \"iq\"\nsample_rate_hz = 12.8e6\nsamples = 256\n\
         noise_figure_db = 10\nthermal_noise = false\n[transmitter]\npower_dbm = 10\n\
         [[tx]]\nposition_half_wavelengths = [0, 0, 0]\n[[tx]]\nposition_half_wavelengths = [0, 4, 0]\n\
         [[tx]]\nposition_half_wavelengths = [0, 8, 0]\n\
         [[rx]]\nposition_half_wavelengths = [0, 0, 0]\n[[rx]]\nposition_half_wavelengths = [0, 1, 0]\n\
         [[rx]]\nposition_half_wavelengths = [0, 2, 0]\n[[rx]]\nposition_half_wavelengths = [0, 3, 0]\n"
    );
    parse(Path::new("m.toml"), &text).unwrap_or_else(|e| panic!("{e}"))
}

/// Whatever the multiplex, the decoded channels are the plane wave over the virtual array.
#[test]
fn transmitters_are_told_apart() {
    for (multiplex, chirps, rate) in [
        ("", 64, 7.3),
        ("multiplex = \"bpm\"", 64, -6.1),
        ("multiplex = \"ddm\"", 256, 8.0),
        ("multiplex = \"ddm\"", 256, 21.0),
        ("multiplex = \"ddm\"", 256, -31.0),
    ] {
        let radar = mimo(multiplex, chirps);
        let u = DVec3::new(0.9, 0.3, 0.0).normalize();
        let mut all = echoes(&[(25.0, 0.0)]);
        all.list[0] = point_echo(u * 25.0, u * rate, 1.0, 1);
        let engine = Engine::Cpu(Precision::F64);
        let cube = AnyCube::F64(cube(&radar, &all));
        let found = engine.range_doppler(&radar, &cube).unwrap();
        let cell = found.cells[0];
        let row = catseye::dsp::peaks::place(&found.map, cell, [None, None]).doppler;
        let folded = catseye::detect::points::range_rate_mps(&radar, row);
        let decoded = catseye::dsp::multiplex::decode(&radar, found.snapshots.of(0), folded);
        println!("{multiplex}: {folded:.2} -> {:.2} m/s for {rate}", decoded.range_rate_mps);
        assert!((decoded.range_rate_mps - rate).abs() < 0.1, "{multiplex}: {}", decoded.range_rate_mps);
        let first = decoded.channels[0];
        assert_eq!(decoded.channels.len(), 12);
        for (c, z) in decoded.channels.iter().enumerate() {
            // Virtual element c stands c half-wavelengths to the left; eq. 12 conjugates.
            let want = Complex64::cis(-PI * u.y * c as f64);
            let got = z / first;
            assert!((got - want).norm() < 0.06, "{multiplex}, channel {c}: {got} for {want}");
        }
    }
}

/// Level and noise of a point in closed form: its cross section, and an SNR that goes with the energy that one transmitter sends
/// in the frame, whatever the multiplex. Doppler bands of an odd number of rows, and an odd number of rows in all.
#[test]
fn levels_and_noise_of_points_of_every_multiplex() {
    let sigma_m2 = 1000.0f64;
    // The rate in cells of the frame's whole Doppler axis.
    for (multiplex, chirps, rows, cells) in [
        (Multiplex::Tdm, 64, 64, -9),
        (Multiplex::Bpm, 48, 64, 11),
        (Multiplex::Ddm { bands: 4 }, 192, 192, 17),
        (Multiplex::Ddm { bands: 4 }, 132, 132, -14),
        (Multiplex::Ddm { bands: 4 }, 132, 132, 37),
        (Multiplex::Ddm { bands: 5 }, 135, 135, 16),
        (Multiplex::Ddm { bands: 5 }, 135, 135, -41),
    ] {
        let mut radar = mimo("", chirps);
        radar.multiplex = multiplex;
        (radar.chirps, radar.processing.doppler_fft) = (chirps, rows);
        radar.thermal_noise = true;
        radar.processing.cfar = Cfar { kind: CfarKind::Ca, guard: [3, 3], train: [6, 12], pfa: 1e-6 };
        let rate = f64::from(cells) * radar.velocity_bin_mps();
        // In the middle of a cell, so that windows lose nothing.
        let range = 84.0 * radar.range_bin_m() - rate * radar.range_per_rate_s();
        let u = DVec3::new(0.95, 0.2, 0.0).normalize();
        let all = Echoes { list: vec![point_echo(u * range, u * rate, sigma_m2, 1)], ..Default::default() };
        // Eq. 9 and 13; a Hann window over N samples lets through 1.5/N of white noise.
        let echo_w = 1e-3 * 10f64.powf(radar.tx_power_dbm / 10.0) * radar.wavelength_m().powi(2) * sigma_m2
            / ((4.0 * PI).powi(3) * range.powi(4));
        let noise_w = 1.380649e-23 * 290.0 * 10f64.powf(radar.noise_figure_db / 10.0) * radar.sample_rate_hz;
        let sent = chirps * if multiplex == Multiplex::Bpm { 4 } else { 1 };
        let want_db = 10.0 * (echo_w / (noise_w * 1.5 / 256.0 * 1.5 / sent as f64)).log10();
        let engine = Engine::Cpu(Precision::F64);
        const FRAMES: u64 = 6;
        let (mut snr, mut rcs) = (0.0, 0.0);
        for seed in 0..FRAMES {
            let (cube, _) = engine.cube(&radar, &all, &[], seed, 0, Control::default()).unwrap();
            let mut maps = engine.maps(&radar, &cube).unwrap();
            let p = locate::points(&engine, &radar, &mut maps, None).unwrap().swap_remove(0);
            assert!((p.range_rate_mps - rate).abs() < 0.1 * radar.velocity_bin_mps(), "{multiplex:?}: {p:?}");
            assert!((p.range_m - range).abs() < 0.03, "{multiplex:?}: {p:?}");
            assert!((p.azimuth_rad - u.y.asin()).abs() < 0.01, "{multiplex:?}: {p:?}");
            snr += p.snr_db / FRAMES as f64;
            rcs += p.rcs_dbsm / FRAMES as f64;
        }
        println!("{multiplex:?} {rows} rows, {rate:.1} m/s: {snr:.2} dB for {want_db:.2}, {rcs:.2} dBsm");
        assert!((rcs - 30.0).abs() < 0.2, "{multiplex:?}: {rcs} dBsm");
        assert!((snr - want_db).abs() < 0.2, "{multiplex:?}: {snr} for {want_db}");
    }
}

/// Ramps (bandwidth, period) of 20 us in turn, of a radar whose three transmitters take turns within each.
fn ramps_in_turn(all: &[(f64, f64)]) -> Radar {
    let mut radar = mimo("", 64);
    let ramps = all.iter().map(|(b, period)| Ramp { bandwidth_hz: *b, time_s: 20e-6, period_s: *period });
    radar.waveform = Waveform::Fmcw(Slopes { ramps: ramps.collect(), this: 0, order: RampOrder::InTurn });
    radar
}

/// With several ramps a loop is longer than the turns of the transmitters: which fold a rate is in, and the phases that it makes
/// between turns, go by the ramp's own period and by that of the loop.
#[test]
fn folds_are_found_with_several_ramps() {
    let u = DVec3::new(0.9, 0.3, 0.0).normalize();
    let azimuth = u.y.atan2(u.x);
    let engine = Engine::Cpu(Precision::F64);
    for (ramps, rate) in [
        ([(0.5e9, 25e-6), (-0.5e9, 25e-6)], 12.0),
        ([(0.5e9, 25e-6), (-0.5e9, 35e-6)], -17.0),
        ([(0.5e9, 35e-6), (0.5e9, 25e-6)], 23.0),
        ([(0.5e9, 25e-6), (0.5e9, 35e-6)], 2.0),
    ] {
        let radar = ramps_in_turn(&ramps);
        // λ/2T_loop, three turns of each ramp.
        let period = 3.0 * (ramps[0].1 + ramps[1].1);
        let all = Echoes { list: vec![point_echo(u * 25.0, u * rate, 1.0, 1)], ..Default::default() };
        let cube = AnyCube::F64(cube(&radar, &all));
        let mut maps = engine.maps(&radar, &cube).unwrap();
        for (i, map) in maps.iter().enumerate() {
            let part = radar.part(i);
            let interval = part.sample_wavelength_m() / (2.0 * period);
            assert!((2.0 * part.max_velocity_mps() - interval).abs() < 1e-9);
            // With the true rate the decoded channels are a plane wave.
            let decoded = catseye::dsp::multiplex::decode(&part, map.snapshots.of(0), rate).channels;
            for (c, z) in decoded.iter().enumerate() {
                let want = Complex64::cis(-PI * u.y * c as f64);
                assert!(
                    (z / decoded[0] - want).norm() < 0.06,
                    "{ramps:?} {i}: {} for {want}",
                    z / decoded[0]
                );
            }
            let found =
                locate::detected(&engine, &part, &mut map.clone(), &locate::accuracy(&part).unwrap(), None)
                    .unwrap()[0];
            let got = range_rate_mps(&part, found.doppler_row) + found.unfolded_mps;
            println!("{ramps:?} {i}: {got:.2} m/s for {rate}, interval {interval:.2}, {:?}", found.ambiguity);
            // Alone each ramp knows it but for what its turns cannot tell.
            let turns = period / ramps[i].1;
            let is_whole = (turns - turns.round()).abs() < 1e-9;
            let modulo_mps = if is_whole { turns * interval } else { interval };
            assert_eq!(found.ambiguity, Ambiguity::Ambiguous);
            assert!((found.modulo_mps - modulo_mps).abs() < 1e-9, "{}", found.modulo_mps);
            assert!((got - rate).abs() < 0.1, "{ramps:?} {i}: {got}");
            assert!((found.azimuth_rad - azimuth).abs() < 0.01, "{ramps:?} {i}: {}", found.azimuth_rad);
        }
        if ramps[0].0 == ramps[1].0 {
            let points = locate::points(&engine, &radar, &mut maps, None).unwrap();
            let p = &points[0];
            assert!((p.range_rate_mps - rate).abs() < 0.1 && (p.range_m - 25.0).abs() < 0.05, "{p:?}");
            assert!((p.azimuth_rad - azimuth).abs() < 0.01 && p.ambiguity == Ambiguity::Ambiguous, "{p:?}");
        }
    }
}

/// FM-CW with two transmitters: bodies are many folds fast, slopes say how fast, and the folds that look alike
/// leave the right angle.
#[test]
fn slow_ramps_have_the_right_angle() {
    let mut radar = triangle();
    let two = mimo("", 64);
    (radar.tx, radar.rx) = (two.tx[..2].to_vec(), two.rx.clone());
    for (range, rate) in [(60.0, -14.8), (45.0, 7.6), (80.0, 0.0)] {
        let u = DVec3::new(0.95, -0.25, 0.0).normalize();
        let all = Echoes { list: vec![point_echo(u * range, u * rate, 1.0, 1)], ..Default::default() };
        let engine = Engine::Cpu(Precision::F64);
        let cube = AnyCube::F64(cube(&radar, &all));
        let points = locate::points(&engine, &radar, &mut engine.maps(&radar, &cube).unwrap(), None).unwrap();
        let p = &points[0];
        println!("{:.4} m, {:.2} m/s, {:.4} rad", p.range_m, p.range_rate_mps, p.azimuth_rad);
        assert!((p.range_m - range).abs() < 0.05 && (p.range_rate_mps - rate).abs() < 0.3, "{p:?}");
        assert!((p.azimuth_rad - u.y.atan2(u.x)).abs() < 0.01, "{}", p.azimuth_rad);
    }
}

/// Ramps up, up and down: the two that are alike count as one slope, seen twice.
#[test]
fn equal_slopes_are_put_together() {
    let engine = Engine::Cpu(Precision::F64);
    let with = |bands: &[f64]| {
        let mut radar = triangle();
        let ramps = bands.iter().map(|b| Ramp { bandwidth_hz: *b, time_s: 1e-3, period_s: 1.1e-3 });
        radar.waveform = Waveform::Fmcw(Slopes { ramps: ramps.collect(), this: 0, order: RampOrder::InTurn });
        radar.thermal_noise = true;
        radar
    };
    let range = 60.0;
    let seen = |bands: &[f64], rate: f64, seed: u64| {
        let radar = with(bands);
        let all = Echoes {
            list: vec![point_echo(DVec3::X * range, DVec3::X * rate, 1e3, 1)],
            ..Default::default()
        };
        let (cube, _) = engine.cube(&radar, &all, &[], seed, 0, Control::default()).unwrap();
        let points = locate::points(&engine, &radar, &mut engine.maps(&radar, &cube).unwrap(), None).unwrap();
        points.into_iter().next().unwrap_or_else(|| panic!("{bands:?}: nothing seen"))
    };
    let (a, b) = (150e6, 100e6);
    for bands in [&[a, a, -a][..], &[-a, a, a], &[a, -a, -a], &[a, a, -a, b]] {
        for (rate, seed) in [(-15.0, 0), (-15.0, 1), (8.0, 2), (0.0, 3)] {
            let p = seen(bands, rate, seed);
            println!("{bands:?}: {:.3} +- {:.3} m, {:.2} m/s", p.range_m, p.std.range_m, p.range_rate_mps);
            // Two peaks of one receiver, eight rows and a level agree by chance too often; a third slope does not.
            let sure = if bands.len() == 4 { Ambiguity::Resolved } else { Ambiguity::Ambiguous };
            assert_eq!(p.ambiguity, sure, "{bands:?}");
            // What moves crosses half a cell in the frame, which costs up to a twentieth of one between rows.
            assert!((p.range_m - range).abs() < 5.0 * p.std.range_m + 0.05, "{bands:?}: {p:?}");
            assert!((p.range_rate_mps - rate).abs() < 5.0 * p.std.range_rate_mps + 0.1, "{bands:?}: {p:?}");
        }
    }
    // Where two see it, the noise falls by the root of two: 0.71 of the deviation of one ramp, √(3/4) of that of a pair. The noise is
    // estimated in eight rows, so the mean of some frames counts.
    let std = |bands: &[f64]| (0..16).map(|seed| seen(bands, 0.0, seed).std.range_m).sum::<f64>() / 16.0;
    let [one, two, pair, three, four] = [&[a][..], &[a, a], &[a, -a], &[a, a, -a], &[a, a, -a, b]].map(std);
    println!("range to {one:.4}, {two:.4}, {pair:.4}, {three:.4}, {four:.4} m");
    assert!((two / one - 0.707).abs() < 0.04, "{two} {one}");
    assert!((three / pair - 0.866).abs() < 0.04, "{three} {pair}");
    assert!(four < three, "{four} {three}");
    // One slope: the rate is the row's.
    let p = seen(&[a, a], -15.0, 1);
    let interval = 2.0 * with(&[a, a]).max_velocity_mps();
    let off = (p.range_rate_mps + 15.0) / interval;
    assert!((off - off.round()).abs() * interval < 0.1, "{p:?}");
}

/// Both engines make the same cubes and maps of every waveform, with a converter in between and with what stands taken out.
#[test]
fn the_gpu_agrees_with_f64() {
    use catseye::gpu::compare::opened_for_tests;
    use catseye::scene::front_end::{Adc, QuantiserKind};
    let gpu = Engine::Gpu(Box::new(opened_for_tests()));
    let truth = Engine::Cpu(Precision::F64);
    let all = echoes(&[(6.0, 0.0), (5.0, -0.8), (8.5, 0.3)]);
    let run = |engine: &Engine, radar: &Radar| {
        let (echoes, interference) = (&all, &[]);
        let input = FrameInput { radar, echoes, interference, seed: 5, frame: 1, extent: Extent::WHOLE };
        let made = engine.frame(&input, Control::default()).unwrap();
        let cube = match made.cube.unwrap() {
            AnyCube::F32(c) => c.to_f64(),
            AnyCube::F64(c) => c,
        };
        (cube.data, made.maps)
    };
    let mut static_removed = stepped();
    static_removed.processing.remove_static = true;
    let mut converted = falling("iq");
    // Fine steps, so that the few samples that fall to other sides of a threshold do not show.
    converted.front_end.adc = Some(Adc { bits: 24, full_scale_dbm: -40.0, kind: QuantiserKind::MidTread });
    for (name, radar) in [
        ("stepped", stepped()),
        ("static removed", static_removed),
        ("falling iq", falling("iq")),
        ("falling real", falling("real")),
        ("converted", converted),
        ("triangle", triangle()),
        ("pulse iq", pulse("iq")),
        ("pulse real", pulse("real")),
        ("code", coded()),
        ("tdm", mimo("", 64)),
        ("bpm", mimo("multiplex = \"bpm\"", 64)),
        ("ddm", mimo("multiplex = \"ddm\"", 96)),
    ] {
        let ((got, got_maps), (want, want_maps)) = (run(&gpu, &radar), run(&truth, &radar));
        let error = (got.iter().zip(&want).map(|(a, b)| (a - b).norm_sqr()).sum::<f64>()
            / want.iter().map(Complex64::norm_sqr).sum::<f64>())
        .sqrt();
        println!("{name}: {error:.1e}");
        assert!(error < 1e-4, "{name}: {error}");
        assert_eq!((got_maps.len(), want_maps.len()), (radar.waveform.parts(), radar.waveform.parts()));
        for (a, b) in got_maps.iter().zip(&want_maps) {
            let error = (a.map.data.iter().zip(&b.map.data).map(|(x, y)| (x - y).powi(2)).sum::<f64>()
                / b.map.data.iter().map(|x| x * x).sum::<f64>())
            .sqrt();
            assert!(error < 1e-4, "{name}, map: {error}");
        }
    }
}

/// A range belongs to the middle of the frame, not to that of its ramp: in a frame too short for a walk through cells, both ramps
/// of a triangle say the same, though one comes 1.1 ms after the other, in which the body moves by 16 mm.
#[test]
fn ranges_belong_to_the_middle_of_the_frame() {
    let mut radar = triangle();
    (radar.chirps, radar.processing.doppler_fft) = (4, 4);
    (radar.processing.cfar.guard[0], radar.processing.cfar.train[0]) = (0, 0);
    for (range, rate) in [(60.0, -15.0), (45.3, 15.0), (70.6, -9.0)] {
        let all = Echoes {
            list: vec![point_echo(DVec3::X * range, DVec3::X * rate, 1.0, 1)],
            ..Default::default()
        };
        let cube = cube(&radar, &all);
        let seen: Vec<f64> = (0..2)
            .map(|i| {
                let part = radar.part(i);
                let map = catseye::dsp::cpu::process(
                    &*catseye::dsp::cpu::lines::prepared(&cube, &part).unwrap(),
                    &part,
                )
                .unwrap()
                .1
                .map;
                let at = (0..map.data.len()).max_by(|a, b| map.data[*a].total_cmp(&map.data[*b])).unwrap();
                let cell = catseye::dsp::Cell {
                    doppler: (at / map.range_bins) as u32,
                    range: (at % map.range_bins) as u32,
                };
                let accuracy = locate::accuracy(&part).unwrap();
                let peak = catseye::dsp::peaks::place(&map, cell, [None, accuracy.range.response.as_ref()]);
                catseye::detect::points::range_m(&part, peak.range, rate, accuracy.coupling_s)
            })
            .collect();
        println!(
            "{range} m, {rate} m/s: {:.1} and {:.1} mm off",
            1e3 * (seen[0] - range),
            1e3 * (seen[1] - range)
        );
        assert!(seen.iter().all(|r| (r - range).abs() < 5e-3), "{seen:?} for {range}");
    }
}
