//! The standard deviation of every column that has one, over 200 draws of a lone target in thermal noise, on radars of all kinds: errors
//! over deviations are chi-square.

use crate::owners::{framed, point, radars};
use catseye::base::rng::Draws;
use catseye::base::units::C0;
use catseye::detect::Point;
use catseye::engine::{Engine, Precision};
use catseye::road::Library;
use catseye::scene::radar::{Processing, Radar};
use catseye::scene::radar_toml;
use catseye::scene::waveform::Waveform;
use catseye::simulate::simulate;
use glam::DVec3;
use rayon::prelude::*;
use std::path::Path;

const DRAWS: u32 = 200;

/// Errors over deviations of range, range rate, azimuth and elevation of the target's point; None where no point is the target's.
fn errors(p: &Point, at: DVec3, velocity: DVec3) -> [Option<f64>; 4] {
    let range = at.length();
    let u = at / range;
    let elevation = p.std.elevation_rad.map(|s| (p.elevation_rad - u.z.asin()) / s);
    // A row of antennas measures u_y.
    let azimuth = if p.std.elevation_rad.is_some() { u.y.atan2(u.x) } else { u.y.asin() };
    [
        Some((p.range_m - range) / p.std.range_m),
        p.std.range_rate_mps.is_finite().then(|| (p.range_rate_mps - velocity.dot(u)) / p.std.range_rate_mps),
        p.std.azimuth_rad.map(|s| (p.azimuth_rad - azimuth) / s),
        elevation,
    ]
}

#[test]
fn deviations_hold_on_every_radar() {
    let mut all = radars();
    // Azimuth and elevation; four slopes; antennas a wavelength and a half apart.
    let preset = |name: &str, chirps: usize| {
        let mut radar = radar_toml::preset(name).unwrap();
        radar.chirps = chirps;
        radar.processing.doppler_fft = chirps;
        radar
    };
    all.push(("iwr6843aop", preset("iwr6843aop", 64)));
    all.push(("lrr77", preset("lrr77", 128)));
    let slopes: String = [300e6, -300e6, 180e6, -120e6]
        .iter()
        .map(|b| {
            format!("[[waveform.ramp]]\nbandwidth_hz = {b:e}\nramp_time_s = 1e-3\nchirp_period_s = 1.1e-3\n")
        })
        .collect();
    let text = format!(
        "name = \"four slopes\"\n[waveform]\ncarrier_hz = 76.5e9\nchirps = 16\n{slopes}[receiver]\nsampling = \"real\"\n\
         sample_rate_hz = 1e6\nsamples = 960\nadc_start_s = 2e-5\nnoise_figure_db = 10\n[transmitter]\npower_dbm = 10\n\
         [antenna]\npolarisation = \"V\"\ngain_dbi = 12\npattern = \"cosine-power\"\nazimuth_exponent = 2\n\
         elevation_exponent = 10\n[[tx]]\nposition_half_wavelengths = [0, 0, 0]\n\
         [[rx]]\nposition_half_wavelengths = [0, 0, 0]\n[[rx]]\nposition_half_wavelengths = [0, 1, 0]\n\
         [[rx]]\nposition_half_wavelengths = [0, 2, 0]\n[[rx]]\nposition_half_wavelengths = [0, 3, 0]\n\
         [mounting]\nposition_m = [3.6, 0, 0.6]\n[processing]\nrange_window = {{ kind = \"hann\" }}\n\
         doppler_window = {{ kind = \"hann\" }}\nazimuth_bins = 64\nazimuth_max_deg = 60\n[processing.cfar]\nkind = \"ca\"\n\
         guard_range_cells = 2\nguard_doppler_cells = 2\ntrain_range_cells = 6\ntrain_doppler_cells = 2\n\
         false_alarm_probability = 1e-6\n"
    );
    all.push(("four slopes", radar_toml::parse(Path::new("r.toml"), &text).unwrap()));
    let mut wrong = Vec::new();
    for (name, radar) in all {
        let narrow = radar.processing.azimuth_fov_rad < 0.5;
        let with_elevation = name == "iwr6843aop";
        let drawn = |draw: u32| -> Option<[Option<f64>; 4]> {
            let mut d = Draws::new(draw, 91);
            let azimuth = (if narrow { 0.2 } else { 0.9 }) * (d.uniform() - 0.5);
            let elevation = if with_elevation { 0.5 * (d.uniform() - 0.5) } else { 0.0 };
            let range = 15.0 + 20.0 * d.uniform();
            let u =
                DVec3::new(azimuth.cos() * elevation.cos(), azimuth.sin() * elevation.cos(), elevation.sin());
            let velocity = u * (6.0 * (d.uniform() - 0.5));
            let at = u * range;
            // So strong that the target is found in most draws, and so weak that noise outweighs what interpolation leaves.
            let rcs_dbsm = match name {
                "lrr77" => -22.0,
                "four slopes" => -12.0,
                _ => 2.0,
            } + 12.0 * d.uniform();
            let mount = radar.mounting.translation_m;
            let mut s = framed(&point((at + mount).to_array(), velocity.to_array(), rcs_dbsm), &radar, true);
            s.ego.speed_mps = 0.0;
            s.seed = u64::from(draw) + 1000;
            let scene = s.build(&Library).unwrap();
            let frame = simulate(&Engine::Cpu(Precision::F32), &s, &scene, 0).unwrap();
            let mine = frame.points.iter().filter(|p| p.object_id != 0 && p.is_in_place());
            let best = mine.max_by(|a, b| a.power_dbm.total_cmp(&b.power_dbm))?;
            Some(errors(best, at, velocity))
        };
        let found: Vec<_> = (0..DRAWS).into_par_iter().filter_map(drawn).collect();
        let names = ["range", "range rate", "azimuth", "elevation"];
        let mut line = format!("{name:28} {:3} of {DRAWS}", found.len());
        for (k, column) in names.iter().enumerate() {
            let z: Vec<f64> = found.iter().filter_map(|e| e[k]).collect();
            if z.is_empty() {
                continue;
            }
            let n = z.len() as f64;
            let mean = z.iter().map(|z| z * z).sum::<f64>() / n;
            let bias = z.iter().sum::<f64>() / n;
            let most = z.iter().fold(0.0f64, |m, z| m.max(z.abs()));
            line += &format!("  {column} {mean:.2} ({bias:+.2}, {most:.1})");
            // The mean of 200 squares is within a third of one to 3 deviations; interpolation and migration are allowed
            // for by up to a tenth.
            if !(0.6..1.4).contains(&mean) || most > 5.0 {
                wrong.push(format!("{name} {column}: {mean:.2}, bias {bias:+.2}, largest {most:.1}"));
            }
        }
        println!("{line}");
        if found.len() < (DRAWS as usize * 95) / 100 {
            wrong.push(format!("{name}: {} of {DRAWS} draws found", found.len()));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Samples taken early or late on the ramp: a target at 30 degrees and −10 m/s, without noise, where the sampled band lies up to 0.5 % from
/// the carrier. Rates and angles by the carrier would be off by that much.
#[test]
fn rates_and_angles_refer_to_the_middle_of_the_samples() {
    let late = |radar: &Radar, start_s: f64, samples: usize| Radar {
        adc_start_s: start_s,
        samples,
        thermal_noise: false,
        processing: Processing { range_fft: 256, ..radar.processing.clone() },
        ..radar.clone()
    };
    let named = |name: &str| radars().into_iter().find(|r| r.0.starts_with(name)).unwrap().1;
    let (tdm, falling, real) = (named("tdm"), named("falling"), named("real"));
    let mut keystone = late(&falling, 23e-6, 160);
    keystone.processing.keystone = true;
    let mut sixty = late(&falling, 1e-6, 160);
    sixty.carrier_hz = 61e9;
    for (name, radar) in [
        ("rising, early", late(&tdm, 0.1e-6, 96)),
        ("rising, late", late(&tdm, 11e-6, 96)),
        ("falling, early", late(&falling, 0.1e-6, 160)),
        ("falling, late", late(&falling, 23e-6, 160)),
        ("falling, 60 GHz", sixty),
        ("real, late", late(&real, 10e-6, 112)),
        ("keystone", keystone),
    ] {
        let off = radar.sample_centre_hz() / radar.carrier_hz - 1.0;
        let azimuth = 30f64.to_radians();
        let u = DVec3::new(azimuth.cos(), azimuth.sin(), 0.0);
        let mount = radar.mounting.translation_m;
        let mut s =
            framed(&point((20.0 * u + mount).to_array(), (-10.0 * u).to_array(), 20.0), &radar, false);
        s.ego.speed_mps = 0.0;
        let scene = s.build(&Library).unwrap();
        let frame = simulate(&Engine::Cpu(Precision::F64), &s, &scene, 0).unwrap();
        let p = frame.points.iter().max_by(|a, b| a.power_dbm.total_cmp(&b.power_dbm)).unwrap();
        let fold = 2.0 * radar.max_velocity_mps();
        let rate = p.range_rate_mps + 10.0;
        let rate = rate - fold * (rate / fold).round();
        println!(
            "{name:18} {:+.4} %: rate {:+.5} m/s, azimuth {:+.4} deg, range {:+.5} m",
            1e2 * off,
            rate,
            p.azimuth_rad.to_degrees() - 30.0,
            p.range_m - 20.0
        );
        assert!(off.abs() > 1e-4, "{name} is sampled about its carrier");
        // What the carrier would give is off by more than this.
        assert!(rate.abs() < 0.3 * (10.0 * off.abs()).max(2e-3), "{name}: {rate}");
        assert!(
            (p.azimuth_rad.tan() / azimuth.tan() - 1.0).abs() < 0.3 * off.abs().max(2e-3),
            "{name}: {}",
            p.azimuth_rad.to_degrees()
        );
    }
}

/// A ramp comes back at the frequency that was sent 2R/c before: at 60 m and 70 MHz/µs the wavelength is 0.036 % longer than that of what
/// is sent (CONVENTIONS eq. 16a). Rates and angles without it would be off by as much.
#[test]
fn far_targets_of_steep_ramps_are_seen_at_their_own_wavelength() {
    let base = radars().into_iter().find(|r| r.0 == "tdm").unwrap().1;
    for (name, bandwidth_hz) in [("rising", 1.4e9), ("falling", -1e9)] {
        let mut radar = Radar { sample_rate_hz: 32e6, samples: 512, thermal_noise: false, ..base.clone() };
        radar.adc_start_s = 2e-6;
        radar.processing.range_fft = 1024;
        if let Waveform::Fmcw(s) = &mut radar.waveform {
            s.ramps[0].bandwidth_hz = bandwidth_hz;
        }
        let azimuth = 30f64.to_radians();
        let u = DVec3::new(azimuth.cos(), azimuth.sin(), 0.0);
        for (range, rate) in [(60.0, -18.0), (60.0, 18.0), (8.0, -18.0)] {
            let mount = radar.mounting.translation_m;
            let mut s =
                framed(&point((range * u + mount).to_array(), (rate * u).to_array(), 20.0), &radar, false);
            s.ego.speed_mps = 0.0;
            let scene = s.build(&Library).unwrap();
            let frame = simulate(&Engine::Cpu(Precision::F64), &s, &scene, 0).unwrap();
            let p = frame.points.iter().max_by(|a, b| a.power_dbm.total_cmp(&b.power_dbm)).unwrap();
            let later = radar.slope_hz_per_s() * 2.0 * range / C0 / radar.sample_centre_hz();
            let (off_mps, off_deg) = (p.range_rate_mps - rate, p.azimuth_rad.to_degrees() - 30.0);
            println!(
                "{name} at {range} m, {rate:+} m/s: rate {off_mps:+.5} of {:.5} m/s, azimuth {off_deg:+.4} of {:.4} deg",
                rate * later,
                (azimuth.tan() * later).to_degrees()
            );
            let share = if range > 50.0 { 0.2 } else { 1.0 };
            assert!(off_mps.abs() < share * (rate * later).abs(), "{name}: {off_mps}");
            // The beam between the grid's directions errs by up to 0.003 degrees.
            assert!(off_deg.abs() < 4e-3, "{name}: {off_deg}");
        }
    }
}
