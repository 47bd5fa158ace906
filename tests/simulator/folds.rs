//! Range migration of targets in other Doppler folds than the first (CONVENTIONS eq. 89a).

use catseye::adc::synthesis::point_echo;
use catseye::base::control::Control;
use catseye::base::units::db_from_power;
use catseye::dsp::RangeDoppler;
use catseye::dsp::peaks::{Peak, place};
use catseye::engine::{AnyCube, Engine, Precision};
use catseye::gpu::compare::opened_for_tests;
use catseye::scene::radar::Radar;
use catseye::scene::radar_toml::parse;
use catseye::trace::Echoes;
use glam::DVec3;
use std::path::Path;

fn text(bandwidth_hz: f64, period_s: f64, chirps: usize, transmitters: usize, migration: &str) -> String {
    let tx: String = (0..transmitters)
        .map(|i| format!("[[tx]]\nposition_half_wavelengths = [0, {}, 0]\n", 2 * i))
        .collect();
    format!(
        "name = \"f\"\n[waveform]\ncarrier_hz = 77e9\nbandwidth_hz = {bandwidth_hz}\nramp_time_s = 20e-6\n\
         chirp_period_s = {period_s}\nchirps = {chirps}\n[receiver]\nsampling = \"iq\"\nsample_rate_hz = 12.8e6\n\
         samples = 256\nnoise_figure_db = 10\n[transmitter]\npower_dbm = 10\n{tx}\
         [[rx]]\nposition_half_wavelengths = [0, 0, 0]\n[[rx]]\nposition_half_wavelengths = [0, 1, 0]\n\
         [processing]\n{migration}\
         [processing.cfar]\nkind = \"ca\"\nguard_range_cells = 3\nguard_doppler_cells = 3\n\
         train_range_cells = 8\ntrain_doppler_cells = 4\nfalse_alarm_probability = 1e-6\n"
    )
}

fn radar(bandwidth_hz: f64, period_s: f64, chirps: usize, transmitters: usize, max_mps: f64) -> Radar {
    let migration = format!("range_migration = \"keystone\"\nrange_migration_max_mps = {max_mps}\n");
    let text = text(bandwidth_hz, period_s, chirps, transmitters, &migration);
    parse(Path::new("f.toml"), &text).unwrap_or_else(|e| panic!("{e}"))
}

fn cube(engine: &Engine, radar: &Radar, targets: &[(f64, f64, f64)]) -> AnyCube {
    let list =
        targets.iter().map(|(range, rate, sigma)| point_echo(DVec3::X * *range, DVec3::X * *rate, *sigma, 1));
    let echoes = Echoes { list: list.collect(), ..Default::default() };
    engine.cube(radar, &echoes, &[], 3, 0, Control::default()).unwrap().0
}

fn strongest(found: &RangeDoppler<f64>) -> Peak {
    place(&found.map, found.cells[0], [None, None])
}

/// What cannot be compensated is refused, with the line, the key and what is allowed.
#[test]
fn folds_that_cannot_be_are_refused() {
    let refused = |period_s: f64, migration: &str| {
        let text = text(1e9, period_s, 512, 1, migration);
        parse(Path::new("f.toml"), &text).unwrap_err().to_string()
    };
    let keystone = |max: &str| format!("range_migration = \"keystone\"\nrange_migration_max_mps = {max}\n");
    let said = [
        refused(40e-6, "range_migration_max_mps = 30\n"),
        refused(40e-6, &keystone("-1")),
        refused(40e-6, &keystone("201")),
        refused(40e-6, &keystone("nan")),
        // v_max = lambda / (4 * 0.4 ms) = 2.43 m/s: 31 folds reach to 75.4 m/s.
        refused(400e-6, &keystone("80")),
    ];
    let words = [
        "add range_migration = \"keystone\"",
        "0..=200",
        "0..=200",
        "0..=200",
        "up to 75.4 m/s, or 31 intervals",
    ];
    for (said, word) in said.iter().zip(words) {
        assert!(
            said.contains("range_migration_max_mps") && said.contains("f.toml:") && said.contains(word),
            "{said}"
        );
    }
    assert!(parse(Path::new("f.toml"), &text(1e9, 400e-6, 512, 1, &keystone("75"))).is_ok());
}

/// 60 m/s and -45 m/s beyond the unambiguous interval, two waveforms: in their range cells, with less than 1 dB less than at 2 m/s.
#[test]
fn a_target_of_another_fold_stays_in_its_cell() {
    let gpu = Engine::Gpu(Box::new(opened_for_tests()));
    for (engine, name) in [(Engine::Cpu(Precision::F64), "cpu"), (gpu, "gpu")] {
        for (rate, folds, make) in [
            (60.0, 3, (|max| radar(1e9, 40e-6, 512, 1, max)) as fn(f64) -> Radar),
            (-45.0, 5, |max| radar(0.8e9, 30e-6, 512, 2, max)),
            (60.0, 5, |max| radar(1e9, 30e-6, 512, 2, max)),
        ] {
            let (all, first) = (make(65.0), make(0.0));
            assert_eq!(
                (all.migration_ambiguities().count(), first.migration_ambiguities().count()),
                (folds, 1)
            );
            let power = |radar: &Radar, rate: f64| {
                let found =
                    engine.range_doppler(radar, &cube(&engine, radar, &[(20.0, rate, 30.0)])).unwrap();
                (strongest(&found).power, found)
            };
            let (slow, _) = power(&all, 2.0);
            let (fast, found) = power(&all, rate);
            let (walked, _) = power(&first, rate);
            let loss = |p: f64| db_from_power(slow / p);
            let walk = rate.abs() * all.frame_time_s() / all.range_bin_m();
            println!(
                "{name} {rate} m/s of ±{:.1}, {walk:.1} cells: {:.2} dB lost, {:.2} with the first fold alone",
                all.max_velocity_mps(),
                loss(fast),
                loss(walked)
            );
            assert!(loss(fast).abs() < 1.0 && loss(walked) > 4.0);
            // In the cell of mid-frame, and nowhere else.
            let bin = (20.0 + rate * all.range_per_rate_s() - all.first_range_m()) / all.range_bin_m();
            let peak = strongest(&found);
            assert!((peak.range - bin).abs() < 0.3, "{} {bin}", peak.range);
            for cell in &found.cells {
                assert!((f64::from(cell.range) - bin).abs() < 3.0, "{cell:?}");
            }
        }
    }
}

/// What is in the first fold is found as without the others, beside a stronger target of another fold.
#[test]
fn targets_of_all_folds_are_found_together() {
    let engine = Engine::Cpu(Precision::F64);
    let (all, first) = (radar(1e9, 40e-6, 512, 1, 65.0), radar(1e9, 40e-6, 512, 1, 0.0));
    let targets = [(30.0, 5.0, 3.0), (22.0, -11.0, 3.0), (20.0, 60.0, 100.0), (12.0, -45.0, 3.0)];
    let samples = cube(&engine, &all, &targets);
    let (found, alone) =
        (engine.range_doppler(&all, &samples).unwrap(), engine.range_doppler(&first, &samples).unwrap());
    let near = |found: &RangeDoppler<f64>, range: f64, rate: f64| {
        let bin = (range + rate * all.range_per_rate_s() - all.first_range_m()) / all.range_bin_m();
        found.cells.iter().position(|c| (f64::from(c.range) - bin).abs() < 2.0)
    };
    assert!(found.cells.len() < 9, "{:?}", found.cells);
    for (range, rate, _) in targets {
        assert!(near(&found, range, rate).is_some(), "{range} m, {rate} m/s");
    }
    for (range, rate, _) in &targets[..2] {
        let (i, j) = (near(&found, *range, *rate).unwrap(), near(&alone, *range, *rate).unwrap());
        assert_eq!((found.cells[i], found.noise[i]), (alone.cells[j], alone.noise[j]));
        assert_eq!(found.snapshots.of(i), alone.snapshots.of(j));
        assert_eq!(
            place(&found.map, found.cells[i], [None; 2]),
            place(&alone.map, alone.cells[j], [None; 2])
        );
    }
}

/// On noise alone all folds together have no more false alarms than were asked for, and not many fewer.
#[test]
fn false_alarms_are_those_asked_for() {
    let engine = Engine::Cpu(Precision::F64);
    let (mut all, mut first) = (radar(1e9, 30e-6, 256, 2, 65.0), radar(1e9, 30e-6, 256, 2, 0.0));
    (all.processing.cfar.pfa, first.processing.cfar.pfa) = (1e-3, 1e-3);
    let (mut many, mut one) = (0, 0);
    for seed in 0..4 {
        let echoes = Echoes::default();
        let noise = engine.cube(&all, &echoes, &[], seed, 0, Control::default()).unwrap().0;
        many += engine.range_doppler(&all, &noise).unwrap().cells.len();
        one += engine.range_doppler(&first, &noise).unwrap().cells.len();
    }
    let asked = 4e-3 * (all.doppler_rows() * all.range_bins()) as f64;
    println!("{many} over 5 folds, {one} with one, {asked:.0} asked for");
    assert!((many as f64) < asked + 4.0 * asked.sqrt() && many * 2 > one);
}
