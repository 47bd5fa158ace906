//! What points are called resolved, over radars drawn well and badly: none of them is off.

use catseye::adc::synthesis::point_echo;
use catseye::base::control::Control;
use catseye::base::rng::Draws;
use catseye::detect::ambiguity::{Ambiguity, FASTEST_MPS};
use catseye::detect::locate;
use catseye::engine::{Engine, Precision};
use catseye::scene::radar::Radar;
use catseye::scene::radar_toml::parse;
use catseye::scene::waveform::{Ramp, RampOrder, Slopes, Waveform};
use catseye::trace::Echoes;
use glam::DVec3;
use std::path::Path;

/// A number that is one of a list.
fn one_of<T: Copy>(d: &mut Draws, list: &[T]) -> T {
    list[((d.uniform() * list.len() as f64) as usize).min(list.len() - 1)]
}

/// Transmitters `apart` half wavelengths from each other, receivers one.
fn radar(multiplex: &str, period_s: f64, chirps: usize, [tx, rx, apart]: [usize; 3], fov_deg: f64) -> Radar {
    let antenna = |kind: &str, at: usize| format!("[[{kind}]]\nposition_half_wavelengths = [0, {at}, 0]\n");
    let all: String =
        (0..tx).map(|k| antenna("tx", apart * k)).chain((0..rx).map(|k| antenna("rx", k))).collect();
    let text = format!(
        "name = \"drawn\"\n[waveform]\ncarrier_hz = 77e9\nbandwidth_hz = 0.3e9\nramp_time_s = {}\n\
         chirp_period_s = {period_s}\nchirps = {chirps}\n{multiplex}\n[receiver]\nsampling = \"iq\"\n\
         sample_rate_hz = {}\nsamples = 128\nnoise_figure_db = 10\nthermal_noise = true\n\
         [transmitter]\npower_dbm = 13\n{all}[processing]\nazimuth_max_deg = {fov_deg}\n",
        0.8 * period_s,
        128.0 / (0.8 * period_s),
    );
    parse(Path::new("drawn.toml"), &text).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn in_turn(radar: &mut Radar, ramps: &[(f64, f64)], time_s: f64) {
    let ramp = |(b, period): &(f64, f64)| Ramp { bandwidth_hz: *b, time_s, period_s: *period };
    radar.waveform =
        Waveform::Fmcw(Slopes { ramps: ramps.iter().map(ramp).collect(), this: 0, order: RampOrder::InTurn });
}

fn in_bursts(radar: &mut Radar, periods_s: &[f64], time_s: f64) {
    let ramps: Vec<(f64, f64)> = periods_s.iter().map(|p| (0.3e9, *p)).collect();
    in_turn(radar, &ramps, time_s);
    if let Waveform::Fmcw(s) = &mut radar.waveform {
        s.order = RampOrder::Bursts;
    }
}

/// A radar of one kind with parameters that a user may choose.
fn drawn(kind: &str, d: &mut Draws) -> Radar {
    let tx = one_of(d, &[2, 3, 4]);
    let rx = one_of(d, &[2, 3, 4, 8]);
    let array = [tx, rx, one_of(d, &[rx, rx, 1, 2, 2 * rx])];
    let fov = one_of(d, &[30.0, 60.0, 85.0]);
    match kind {
        "turns" => {
            let period = one_of(d, &[7e-6, 9e-6, 15e-6, 30e-6, 57e-6]);
            radar("", period, 64, array, fov)
        }
        "staggered turns" => {
            let (a, b) =
                one_of(d, &[(25e-6, 35e-6), (30e-6, 33e-6), (20e-6, 40e-6), (25e-6, 25e-6), (21e-6, 34e-6)]);
            let mut radar = radar("", a, 32, array, fov);
            in_turn(&mut radar, &[(0.3e9, a), (0.3e9, b)], 16e-6);
            radar
        }
        "bursts" => {
            let tx = one_of(d, &[1, 1, 2, 3]);
            let periods = one_of(
                d,
                &[
                    &[25e-6, 28e-6][..],
                    &[20e-6, 23e-6, 27.5e-6],
                    &[33e-6, 35e-6, 38e-6],
                    &[22e-6, 33e-6],
                    &[40e-6, 43e-6, 45e-6, 49e-6],
                ],
            );
            let (multiplex, chirps) = match one_of(d, &["tdm", "tdm", "bpm", "ddm"]) {
                "ddm" => {
                    let empty = one_of(d, &[0, 0, 1]);
                    (format!("multiplex = \"ddm\"\nempty_bands = {empty}"), 48 * (tx + empty))
                }
                "bpm" if tx < 3 => ("multiplex = \"bpm\"".into(), 64),
                _ => (String::new(), 64),
            };
            let mut radar = radar(&multiplex, periods[0], chirps, [tx, rx, rx], fov);
            in_bursts(&mut radar, periods, 16e-6);
            radar.sample_rate_hz = 128.0 / (0.8 * 16e-6);
            radar
        }
        "bands" => {
            let period = one_of(d, &[7e-6, 12e-6, 25e-6]);
            let empty = one_of(d, &[1, 1, 2]);
            let chirps = 48 * (tx + empty);
            radar(&format!("multiplex = \"ddm\"\nempty_bands = {empty}"), period, chirps, array, fov)
        }
        _ => {
            let (time, chirps) = one_of(d, &[(1e-3, 8), (20e-6, 64), (100e-6, 32)]);
            let rx = one_of(d, &[1, 4, 8]);
            let mut radar = radar("", 1.1 * time, chirps, [1, rx, 1], fov);
            let third = one_of(d, &[None, Some(0.2e9), Some(0.29e9)]);
            let ramps: Vec<(f64, f64)> =
                [0.3e9, -0.3e9].into_iter().chain(third).map(|b| (b, 1.1 * time)).collect();
            in_turn(&mut radar, &ramps, time);
            radar.sample_rate_hz = 128.0 / (0.8 * time);
            radar
        }
    }
}

/// Over radars of every kind and bodies of every speed up to the limit, some of them in one cell, beyond the directions that are
/// searched, or too weak for one of the maps: a range rate that is called resolved is within five of its standard deviations,
/// which hold for one body in a cell (two that slopes see as one were 4.4 of them off), and half a cell of the map for what
/// interpolation and migration cost.
#[test]
fn what_is_called_resolved_is_not_off() {
    let engine = Engine::Cpu(Precision::F64);
    for (kind, frames, least) in [
        ("turns", 260, 0.02),
        ("staggered turns", 200, 0.0),
        ("bursts", 400, 0.3),
        ("bands", 200, 0.1),
        ("slopes", 200, 0.02),
    ] {
        let (mut points, mut resolved, mut off, mut ambiguous) = (0, 0, Vec::new(), 0);
        for frame in 0..frames {
            let mut d = Draws::new(frame, 4711);
            let radar = drawn(kind, &mut d);
            let cell_mps = 2.0 * radar.part(0).max_velocity_mps() / radar.chirps as f64;
            let count = one_of(&mut d, &[1, 1, 2, 3]);
            let mut bodies: Vec<(f64, f64)> = Vec::new();
            let mut all = Echoes::default();
            for _ in 0..count {
                let mut range = radar.range_bin_m() * (15.0 + 60.0 * d.uniform());
                let mut rate = FASTEST_MPS * (2.0 * d.uniform() - 1.0);
                if let Some((r, v)) = bodies.last().copied().filter(|_| d.uniform() < 0.5) {
                    // In the cell of the one before, by another fold.
                    let interval = 2.0 * radar.part(0).max_velocity_mps();
                    range = r + radar.range_bin_m() * (d.uniform() - 0.5);
                    rate = v
                        + interval * f64::from(one_of(&mut d, &[-2, -1, 0, 1, 2]))
                        + cell_mps * (d.uniform() - 0.5);
                    if rate.abs() > FASTEST_MPS {
                        rate = v;
                    }
                }
                let azimuth = 1.4 * (2.0 * d.uniform() - 1.0);
                let u = DVec3::new(azimuth.cos(), azimuth.sin(), 0.0);
                // From where noise decides to some 60 dB over it.
                let sigma = 10f64.powf(4.5 * d.uniform() - 2.5) * (range / 30.0).powi(4);
                all.list.push(point_echo(u * range, u * rate, sigma, bodies.len() as u32 + 1));
                bodies.push((range, rate));
            }
            let (cube, _) = engine.cube(&radar, &all, &[], u64::from(frame), 0, Control::default()).unwrap();
            let mut maps = engine.maps(&radar, &cube).unwrap();
            for p in locate::points(&engine, &radar, &mut maps, None).unwrap() {
                points += 1;
                ambiguous += u32::from(p.ambiguity == Ambiguity::Ambiguous);
                if p.ambiguity != Ambiguity::Resolved {
                    continue;
                }
                resolved += 1;
                let slack = 5.0 * p.std.range_rate_mps + 0.5 * cell_mps;
                let error =
                    bodies.iter().map(|(_, v)| (p.range_rate_mps - v).abs()).fold(f64::INFINITY, f64::min);
                if error > slack {
                    off.push(format!(
                        "frame {frame}: {:.2} m, {:.2} +- {:.3} m/s at {:.1} dB, off by {error:.2}; {bodies:?}",
                        p.range_m, p.range_rate_mps, p.std.range_rate_mps, p.snr_db
                    ));
                }
            }
        }
        println!("{kind}: {points} points, {resolved} resolved, {ambiguous} ambiguous, {} off", off.len());
        off.iter().take(12).for_each(|o| println!("  {o}"));
        assert!(off.is_empty(), "{kind}: {} of {resolved} are off", off.len());
        assert!(f64::from(resolved) >= least * f64::from(points), "{kind}: {resolved} of {points} resolved");
    }
}
