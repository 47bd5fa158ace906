//! Lanes by an impulse radar and metal plates (document K): hostile looks through the interface of all estimators, and drives
//! through the whole chain.

use catseye::engine::{Engine, Precision};
use catseye::road::site::Site;
use catseye::scene::scenario::Scenario;
use catseye_lane::uwb::{
    Background, Centre, EventKind, OffsetSource, RangeAxis, RangeGate, Side, Threshold, Uwb, UwbConfig,
    UwbLanes, UwbSetup,
};
use catseye_lane::{LaneError, LaneEstimate, LaneEstimator, Measured, SensorInput};
use catseye_papers::trial::uwb::Settings;
use catseye_papers::trial::{Drive, LaneMethod, Trial, TrialContext};
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

const INTERVAL_S: f64 = 0.05;
const SPEED_MPS: f64 = 7.0;
const HEIGHT_M: f64 = 1.32;

fn axis() -> RangeAxis {
    RangeAxis { start_m: 0.6, step_m: 0.01 }
}

/// A scan with one echo: a short wave packet of this amplitude at this range.
fn scan(echoes: &[(f64, f64)]) -> Vec<f64> {
    let at = |i: usize| axis().start_m + i as f64 * axis().step_m;
    let one = |r: f64, (amplitude, range_m): (f64, f64)| {
        let d = r - range_m;
        amplitude * (-(d / 0.05).powi(2)).exp() * (TAU * d / 0.06).cos()
    };
    (0..300).map(|i| echoes.iter().map(|e| one(at(i), *e)).sum()).collect()
}

fn options(side: Side) -> UwbSetup {
    let gate = RangeGate::new(HEIGHT_M, 3.2).unwrap();
    let bare = gate.echo(&scan(&[(0.1, 2.5)]), &axis()).unwrap().energy;
    let threshold = Threshold::maximum(&[bare, 1.5 * bare]).unwrap();
    let config = UwbConfig {
        offset: OffsetSource::Range { height_m: HEIGHT_M },
        ..UwbConfig::new(8.0, 3.0, &threshold).unwrap()
    };
    let y = if side == Side::Left { 0.95 } else { -0.95 };
    UwbSetup {
        axis: axis(),
        gate,
        background: None,
        config,
        side,
        at_m: [2.0, y],
        offset_std_m: 0.05,
        lane_width_m: Some(3.5),
    }
}

/// The scan `way_m` along the road, with plates from 2 to 5 m, from 10 to 13 m and so on, so far to the side; none after `end_m`.
fn road_scan(way_m: f64, lateral_m: f64, end_m: f64) -> Vec<f64> {
    let beside = (way_m - 2.0).rem_euclid(8.0) < 3.0 && (2.0..end_m).contains(&way_m);
    match beside {
        true => scan(&[(0.1, 2.5), (1.0, HEIGHT_M.hypot(lateral_m))]),
        false => scan(&[(0.1, 2.5)]),
    }
}

fn look(index: usize, pulse: &[f64]) -> SensorInput<'_> {
    let speed_mps = Some(Measured { value: SPEED_MPS, std: 0.1 });
    SensorInput { time_s: index as f64 * INTERVAL_S, speed_mps, pulse: Some(pulse), ..SensorInput::default() }
}

fn way_m(index: usize) -> f64 {
    index as f64 * INTERVAL_S * SPEED_MPS
}

fn why(e: &LaneEstimate) -> String {
    assert!(e.lines.is_empty() && e.offset_m.is_none() && e.confidence == 0.0, "{e:?}");
    e.no_lane.as_ref().expect("a reason").to_string()
}

#[test]
fn plates_at_the_spacing_are_a_lane_with_its_line_and_their_absence_is_none() {
    let mut uwb = UwbLanes::new(options(Side::Right)).unwrap();
    let mut warned = None;
    let mut last = None;
    for i in 0..160 {
        let pulse = road_scan(way_m(i), 0.4, 30.0);
        let e = uwb.estimate(&look(i, &pulse));
        if let Some(EventKind::Departure(d)) = uwb.event().map(|e| e.kind) {
            warned = Some((way_m(i), d.expected_m));
        }
        match way_m(i) {
            w if w < 10.0 => assert!(why(&e).contains("no plates at the spacing of 8 m"), "{w}"),
            w if (16.0..35.0).contains(&w) => {
                assert!(e.no_lane.is_none() && e.lines.len() == 1, "{w} {e:?}");
                // The radar is 0.95 m to the right, the plate 0.4 m further: 1.35 m; the lane's middle 1.75 m left of it.
                let line = e.lines[0].fitted.curve.at(0.0).at_m.y;
                assert!(
                    (line + 1.35).abs() < 0.03 && (e.offset_m.unwrap().value + 0.40).abs() < 0.03,
                    "{w} {line}"
                );
                assert!(e.width_m.is_none() && e.curvature_per_m.is_none());
            }
            w if w > 38.0 => assert!(why(&e).contains("is missing"), "{w}"),
            _ => {}
        }
        last = Some(e);
    }
    // Plates stand at 3.5, 11.5, 19.5 and 27.5 m: the next one is due at 35.5 m and a metre later it is missing.
    let (at, expected) = warned.expect("a warning");
    assert!((expected - 35.5).abs() < 0.5 && (36.0..37.5).contains(&at), "{at} {expected}");
    assert_eq!(last.unwrap().provenance.method, "uwb");
}

#[test]
fn hostile_looks_are_refused_with_their_reason_and_leave_the_state() {
    let mut uwb = UwbLanes::new(options(Side::Right)).unwrap();
    for i in 0..60 {
        let pulse = road_scan(way_m(i), 0.4, 100.0);
        uwb.estimate(&look(i, &pulse));
    }
    assert!(uwb.core().lane_present());
    let before = uwb.core().distance_m();
    let good = road_scan(way_m(60), 0.4, 100.0);
    let (mut nan, mut huge) = (good.clone(), good.clone());
    (nan[7], nan[8]) = (f64::NAN, f64::INFINITY);
    huge[150] = 1e200;
    let at = |pulse| look(60, pulse);
    let with = |speed_mps: Option<f64>| SensorInput {
        speed_mps: speed_mps.map(|value| Measured { value, std: 0.1 }),
        ..look(60, &good)
    };
    let looks: Vec<(SensorInput<'_>, &str)> = vec![
        (SensorInput { pulse: None, ..at(&good) }, "a scan of an impulse radar"),
        (at(&[]), "no points"),
        (at(&good[..1]), "do not cover the gate"),
        (at(&good[..100]), "do not cover the gate"),
        (at(&nan), "none of 2 points"),
        (at(&huge), "power of range sample"),
        (with(None), "speed of the vehicle is unknown"),
        (with(Some(f64::NAN)), "speed is not a finite number"),
        (with(Some(-3.0)), "speed is -3"),
        (with(Some(1e300)), "up to 150 m/s"),
        (SensorInput { time_s: 1.0, ..at(&good) }, "scan time is 1"),
        (SensorInput { time_s: f64::NAN, ..at(&good) }, "scan time"),
    ];
    for (look, part) in looks {
        let e = uwb.estimate(&look);
        let reason = why(&e);
        assert!(reason.contains(part), "{part}: {reason}");
        assert_eq!(uwb.core().distance_m(), before, "{part}");
    }
    // At rest nothing changes, whatever is there.
    let mut uwb = UwbLanes::new(options(Side::Right)).unwrap();
    for i in 0..400 {
        let pulse = road_scan(3.0, 0.4, 100.0);
        let speed_mps = Some(Measured { value: 0.0, std: 0.0 });
        let e = uwb.estimate(&SensorInput { speed_mps, ..look(i, &pulse) });
        assert!(e.no_lane.is_some());
    }
    // One scan is no lane.
    let mut uwb = UwbLanes::new(options(Side::Right)).unwrap();
    assert!(why(&uwb.estimate(&look(0, &good))).contains("no plates"));
    // Settings that contradict each other are refused, too.
    let wrong = UwbSetup { offset_std_m: f64::NAN, ..options(Side::Right) };
    assert!(UwbLanes::new(wrong).is_err());
    let wrong = UwbSetup { gate: RangeGate { min_m: 3.0, max_m: 1.0 }, ..options(Side::Right) };
    assert!(UwbLanes::new(wrong).is_err());
}

#[test]
fn two_radars_give_offset_and_width() {
    let mut pair = UwbLanes::pair(options(Side::Left), options(Side::Right)).unwrap();
    let mut last = None;
    for i in 0..100 {
        // The left line is 0.7 m from the left radar, the right one 0.4 m from the right one.
        let pulse: Vec<f64> = [road_scan(way_m(i), 0.7, 100.0), road_scan(way_m(i), 0.4, 100.0)].concat();
        last = Some(pair.estimate(&look(i, &pulse)));
    }
    let e = last.unwrap();
    assert!(e.no_lane.is_none() && e.lines.len() == 2, "{e:?}");
    let sides: Vec<f64> = e.lines.iter().map(|l| l.fitted.curve.at(0.0).at_m.y).collect();
    assert!((sides[0] + 1.35).abs() < 0.03 && (sides[1] - 1.65).abs() < 0.03, "{sides:?}");
    assert!((e.width_m.unwrap().value - 3.0).abs() < 0.05 && (e.offset_m.unwrap().value + 0.15).abs() < 0.03);
    // An odd number of samples is not two scans.
    let odd = [0.0; 601];
    assert!(why(&pair.estimate(&look(200, &odd))).contains("into two scans"));
    let swapped = UwbLanes::pair(options(Side::Right), options(Side::Left));
    assert!(swapped.is_err(), "the right radar stands left of the left one");
}

#[test]
fn a_background_leaves_what_is_not_always_there() {
    let bare = scan(&[(50.0, HEIGHT_M)]);
    let b = Background::of([bare.as_slice(), &bare]).unwrap();
    let with = scan(&[(50.0, HEIGHT_M), (1.0, 1.8)]);
    let rest = b.taken_from(&with).unwrap();
    let alone = scan(&[(1.0, 1.8)]);
    assert!(rest.iter().zip(&alone).all(|(a, b)| (a - b).abs() < 1e-12));
    assert!(b.taken_from(&with[1..]).is_err() && Background::of([]).is_err());
    assert!(
        Background::of([&[1.0, f64::NAN][..]]).is_err() && Background::of([&[1.0][..], &[1.0, 2.0]]).is_err()
    );
    // Its length is that of the scans.
    let mut o = options(Side::Right);
    o.background = Some(b);
    let mut uwb = UwbLanes::new(o).unwrap();
    assert!(why(&uwb.estimate(&look(0, &with[..290]))).contains("290 values where 300 are expected"));
}

/// A radar that drifts across a side lobe sees a plate brighten six times from end to end.
#[test]
fn the_level_finds_the_middle_of_a_plate_that_brightens() {
    let centre_of = |centre: Centre| {
        let threshold = Threshold::maximum(&[0.5, 1.0, 2.0]).unwrap();
        let config = UwbConfig { centre, ..UwbConfig::new(8.0, 3.0, &threshold).unwrap() };
        let (n, step_m) = (200, 0.1);
        let energy = |i: usize| {
            let x = i as f64 * step_m;
            match (6.0..=9.0).contains(&x) {
                true => 10.0 * 6f64.powf((x - 6.0) / 3.0),
                false => 1.0,
            }
        };
        let energies: Vec<f64> = (0..n).map(energy).collect();
        let times: Vec<f64> = (0..n).map(|i| 0.1 * i as f64).collect();
        let run = Uwb::estimate(config, &energies, &[], &times, &vec![1.0; n]).unwrap();
        assert_eq!(run.markers.len(), 1);
        run.markers[0].pass.distance_m - 7.5
    };
    let [level, matched, greatest] = [Centre::Level, Centre::Matched, Centre::Maximum].map(centre_of);
    assert!(level.abs() < 0.1 && matched > 0.25 && greatest > 1.3, "{level} {matched} {greatest}");
}

/// Energies of scans 20 a second at this speed past plates of 3 m every 8 m from 10 m on, the one of the number `without` left out. Scans
/// fall anywhere on a plate, and one at a plate's end may be too weak to count.
fn fast_drive(speed_mps: f64, without: Option<u32>, seed: u32) -> catseye_lane::uwb::LaneEstimate {
    let threshold = Threshold::maximum(&[0.5, 1.0, 2.0]).unwrap();
    let config = UwbConfig { centre: Centre::Level, ..UwbConfig::new(8.0, 3.0, &threshold).unwrap() };
    let mut draws = catseye::base::rng::Draws::new(seed, 7);
    let (step_m, begin_m) = (speed_mps / 20.0, draws.uniform());
    let energies: Vec<f64> = (0..(250.0 / step_m) as usize)
        .map(|i| {
            let from_m = begin_m + i as f64 * step_m - 10.0;
            let plate = (from_m / 8.0).floor();
            let on_m = from_m - 8.0 * plate;
            let there = plate >= 0.0 && on_m < 3.0 && without.is_none_or(|k| plate != f64::from(k));
            let weak = draws.uniform() < 0.5 && !(0.4..=2.6).contains(&on_m);
            if there && !weak { 10.0 } else { 0.5 }
        })
        .collect();
    let n = energies.len();
    let times: Vec<f64> = (0..n).map(|i| 0.05 * i as f64).collect();
    Uwb::estimate(config, &energies, &[], &times, &vec![speed_mps; n]).unwrap()
}

/// At 20 m/s scans are a metre apart, which is all that a spacing may be off by at the speeds of the document.
#[test]
fn a_lane_is_kept_where_scans_lie_far_apart() {
    for speed_mps in [7.0, 15.0, 20.0, 25.0] {
        let lost: usize = (0..50).map(|seed| fast_drive(speed_mps, None, seed).departures().count()).sum();
        assert_eq!(lost, 0, "{speed_mps} m/s");
    }
}

/// The warning comes, and the lane is there again with the next plate instead of the one after that.
#[test]
fn a_plate_that_is_missed_does_not_end_the_row() {
    for speed_mps in [7.0, 15.0, 20.0] {
        for seed in 0..20 {
            let run = fast_drive(speed_mps, Some(10), seed);
            assert_eq!(run.departures().count(), 1, "{speed_mps} m/s, {seed}");
            let off: Vec<f64> = (0..run.lane_present.len())
                .filter(|i| !run.lane_present[*i] && run.distance_m[*i] > 40.0)
                .map(|i| run.distance_m[i])
                .collect();
            let gap_m = off[off.len() - 1] - off[0];
            // From the place of the missing plate's middle to the end of the next one, and the scans that tell both.
            assert!(gap_m < 8.0 + 1.5 + 1.5 + speed_mps / 20.0, "{speed_mps} m/s, {seed}: {gap_m} m");
        }
    }
}

// Through the whole chain.

fn scenes(file: &str) -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("scenes/lane").join(file)
}

fn quick() -> Settings {
    Settings { quiet_scans: 100, histogram_scans: 0, offset_sweep: false, ..Settings::default() }
}

fn drive_through(file: &str, frames: u32, settings: &Settings, keep: Option<PathBuf>) -> Trial {
    let path = scenes(file);
    let mut scenario = Scenario::load(&path).unwrap();
    scenario.frames.count = frames;
    scenario.trace.rays = 500;
    let engine = Engine::open("cpu", Precision::F32).unwrap();
    let given =
        TrialContext { scenario: &scenario, path: &path, engine: &engine, runs: 1, keep, watch: &|_, _| {} };
    settings.trial(&given).unwrap()
}

fn value(trial: &Trial, name: &str) -> Option<f64> {
    trial.rows.iter().find(|r| r.quantity == name).and_then(|r| r.ours)
}

#[test]
fn plates_of_a_simulated_road_are_found_at_their_spacing() {
    let settings = Settings { quiet_scans: 500, ..quick() };
    let trial = drive_through("uwb_scenario_3.toml", 90, &settings, None);
    let ours = |name: &str| value(&trial, &format!("settings' rule: {name}"));
    assert_eq!(ours("plates found"), Some(100.0));
    assert_eq!(ours("spacings right"), Some(100.0));
    // The largest of 500 energies is passed by one of the next 60 with a chance of 0.11, by two with 0.007.
    assert!(ours("passes without a plate, a run").unwrap() <= 1.0);
    assert_eq!(ours("warnings where a plate was due, a run"), Some(0.0));
    assert!(ours("worst spacing error").unwrap() < 1.0);
    assert!((value(&trial, "far end of the gate").unwrap() - 3.248).abs() < 1e-3);
    let found: Vec<&_> = trial.steps.iter().filter(|s| s.estimate.no_lane.is_none()).collect();
    assert!(found.len() > 30, "{}", found.len());
    for s in found {
        assert!(s.score.offset_error_m.unwrap().abs() < 0.3, "{:?}", s.score);
        assert_eq!(s.estimate.lines.len(), 1);
    }
    assert!(trial.steps[0].estimate.no_lane.is_some());
    assert!(trial.pictures.len() >= 5 && trial.sheets.len() == 3);
}

#[test]
fn leaving_the_lane_is_told_and_a_bare_road_has_none() {
    let trial = drive_through("uwb_scenario_4.toml", 125, &quick(), None);
    assert_eq!(value(&trial, "settings' rule: runs with a warning where no plate was due"), Some(100.0));
    assert_eq!(value(&trial, "settings' rule: warnings where a plate was due, a run"), Some(0.0));
    let last = &trial.steps.last().unwrap().estimate;
    assert!(
        matches!(&last.no_lane, Some(LaneError::Refused { why }) if why.contains("is missing")),
        "{last:?}"
    );

    let trial = drive_through("uwb_scenario_1.toml", 60, &quick(), None);
    assert!(trial.steps.iter().all(|s| s.estimate.no_lane.is_some() && s.truth.lines.is_empty()));
    assert_eq!(value(&trial, "settings' rule: scans with a lane"), Some(0.0));
}

#[test]
fn the_same_drive_gives_the_same_also_when_it_goes_on() {
    let keep = std::env::temp_dir().join(format!("catseye-uwb-{}", std::process::id()));
    std::fs::create_dir_all(&keep).unwrap();
    let settings = Settings { quiet_scans: 30, ..quick() };
    let of = |t: &Trial| {
        let rows = t.rows.iter().map(|r| format!("{:?}", r)).collect::<Vec<_>>().join("\n");
        let steps = t.steps.iter().map(|s| format!("{:?} {:?}", s.estimate, s.score));
        (rows, steps.collect::<Vec<_>>().join("\n"))
    };
    let first = drive_through("uwb_scenario_3.toml", 45, &settings, None);
    let kept = drive_through("uwb_scenario_3.toml", 45, &settings, Some(keep.clone()));
    let mut files: Vec<PathBuf> = std::fs::read_dir(&keep).unwrap().map(|f| f.unwrap().path()).collect();
    files.sort();
    // As if it had been interrupted.
    std::fs::remove_file(&files[1]).unwrap();
    let again = drive_through("uwb_scenario_3.toml", 45, &settings, Some(keep.clone()));
    std::fs::remove_dir_all(&keep).unwrap();
    assert!(files.len() > 2 && of(&first) == of(&kept) && of(&kept) == of(&again));
}

/// A flat strip of width w has its nulls where 2 w sin(theta) is a whole number of waves: 0.152 m and 0.310 m to the side of a radar
/// 1.32 m high for 0.15 m and 8.748 GHz. The plate's own echo is what a scan has more than that of the bare road.
#[test]
fn a_plate_has_side_lobes_where_a_strip_has_them() {
    let dir = std::env::temp_dir().join(format!("catseye-uwb-lobes-{}", std::process::id()));
    std::fs::create_dir_all(&dir).unwrap();
    let road = |plates: bool| {
        let mut text = String::from(
            "name = \"r\"\n[[road]]\nname = \"road\"\nsurface = \"concrete-pavement\"\n\
             plan = [{ kind = \"straight\", length_m = 20 }]\n\
             right = [{ width_m = 3.5, number = 1 }, { width_m = 3, number = 2 }]\n",
        );
        if plates {
            text += "[[road.markers]]\nreflector = \"plate:width_m=0.15,height_m=3,material=steel\"\n\
                     lateral = { lane = 1, side = \"right\" }\nfrom_m = 10\ncount = 1\nspacing_m = 8\npitch_deg = -90\n";
        }
        text
    };
    let engine = Engine::open("cpu", Precision::F32).unwrap();
    let gate = RangeGate::new(HEIGHT_M, 3.2).unwrap();
    let pulse = |plates: bool, lateral_m: f64| {
        std::fs::write(dir.join("road.toml"), road(plates)).unwrap();
        // The line is 1.75 m to the right of the lane's middle, the radar 0.95 m.
        let text = format!(
            "name = \"s\"\nradar = \"uwb9\"\n[scene]\nroad = \"road.toml\"\n[trace]\nrays = 200\nbounces = 1\n\
             [ego]\non_road = {{ lane = 1, s_m = 8, offset_m = {} }}\n",
            lateral_m - 0.8
        );
        let path = dir.join("s.toml");
        std::fs::write(&path, text).unwrap();
        let mut scenario = Scenario::load(&path).unwrap();
        scenario.radars[0].thermal_noise = false;
        let site = Site::new(&scenario).unwrap();
        let cube =
            Drive::new(&site, &engine).unwrap().frame(0, 0).unwrap().take_samples().unwrap().into_f32();
        cube.row(0, 0).iter().map(|z| f64::from(z.re)).collect::<Vec<f64>>()
    };
    let echo = |lateral_m: f64| {
        let b = Background::of([pulse(false, lateral_m).as_slice()]).unwrap();
        let radar = Scenario::load(&dir.join("s.toml")).unwrap().radars[0].clone();
        let axis = RangeAxis::from_time(radar.adc_start_s, radar.sample_rate_hz).unwrap();
        let rest = b.taken_from(&pulse(true, lateral_m)).unwrap();
        10.0 * gate.echo(&rest, &axis).unwrap().energy.log10()
    };
    let [null, lobe, second_null, second] = [0.152, 0.228, 0.310, 0.392].map(echo);
    std::fs::remove_dir_all(&dir).unwrap();
    assert!(
        lobe > null + 6.0 && lobe > second_null + 6.0 && second > second_null + 6.0,
        "{null} {lobe} {second_null} {second}"
    );
}

#[test]
fn scenarios_and_settings_that_cannot_be_are_refused_with_a_remedy() {
    let dir = std::env::temp_dir().join(format!("catseye-uwb-bad-{}", std::process::id()));
    std::fs::create_dir_all(&dir).unwrap();
    let engine = Engine::open("cpu", Precision::F32).unwrap();
    let refusal = |text: &str, settings: &Settings| {
        let path = dir.join("s.toml");
        std::fs::write(&path, text).unwrap();
        let scenario = Scenario::load(&path).unwrap();
        let given = TrialContext {
            scenario: &scenario,
            path: &path,
            engine: &engine,
            runs: 1,
            keep: None,
            watch: &|_, _| {},
        };
        let e = settings.trial(&given).unwrap_err();
        assert_eq!(e.exit_code(), 2, "{e}");
        e.to_string()
    };
    let s = quick();
    let road =
        std::fs::canonicalize(scenes("uwb_scenario_1.toml").with_file_name("../road/road_plates.toml"))
            .unwrap()
            .display()
            .to_string();
    let on = |rest: &str| format!("name = \"s\"\nradar = \"uwb9\"\n{rest}\n[scene]\nroad = \"{road}\"\n");
    assert!(
        refusal("name = \"s\"\nradar = \"front77\"\n[scene]\nbuiltin = \"marked-road\"\n", &s)
            .contains("front77 (fmcw, 12 channels): the method uwb cannot use any radar of the scenario; allowed: an impulse radar")
    );
    let none =
        refusal("name = \"s\"\nradar = \"uwb9\"\n[[point]]\nposition_m = [3, 0, 0]\nrcs_dbsm = 0\n", &s);
    assert!(none.contains("ego.on_road"), "{none}");
    let standing = on("[ego]\nspeed_mps = 7\n");
    assert!(refusal(&standing, &s).contains("a vehicle on a road"));
    let fast = on("[ego]\non_road = { lane = 2, s_m = 5 }\ndrive = { speed_mps = 90 }\n");
    assert!(refusal(&fast, &s).contains("exceeds the length of a plate"));
    let backwards =
        on("[ego]\non_road = { lane = 2, s_m = 50 }\ndrive = { speed_mps = -2 }\n[frames]\ncount = 3\n");
    let few = Settings { quiet_scans: 20, ..s.clone() };
    assert!(refusal(&backwards, &few).contains("moves forward"));
    let lane = on("[ego]\non_road = { lane = 2, s_m = 5 }\n");
    let gate = Settings { gate_m: Some([1.0, 20.0]), ..s.clone() };
    assert!(refusal(&lane, &gate).contains("do not cover the gate"));
    let missing = Settings { quiet_road: Some("nowhere.toml".to_string().into()), ..s.clone() };
    let path = dir.join("s.toml");
    std::fs::write(&path, &lane).unwrap();
    let scenario = Scenario::load(&path).unwrap();
    let given = TrialContext {
        scenario: &scenario,
        path: &path,
        engine: &engine,
        runs: 1,
        keep: None,
        watch: &|_, _| {},
    };
    assert!(missing.trial(&given).unwrap_err().to_string().contains("nowhere.toml"));
    std::fs::remove_dir_all(&dir).unwrap();

    for (bad, key) in [
        (Settings { spacing_m: f64::NAN, ..s.clone() }, "spacing_m"),
        (Settings { plate_length_m: 9.0, ..s.clone() }, "plate_length_m"),
        (Settings { car_width_m: 5.0, ..s.clone() }, "car_width_m"),
        (Settings { gate_m: Some([2.0, 1.0]), ..s.clone() }, "gate_m[1]"),
        (Settings { largest_error_m: Some(7.0), ..s.clone() }, "largest_error_m"),
        (Settings { quiet_scans: 1, ..s.clone() }, "quiet_scans"),
        (Settings { false_alarm_probability: Some(0.5), ..s.clone() }, "false_alarm_probability"),
        (Settings { false_alarm_probability: Some(1e-4), ..s.clone() }, "quiet_scans"),
        (Settings { speed_range_kmh: Some([30.0, 20.0]), ..s.clone() }, "speed_range_kmh[1]"),
        (Settings { confirm_spacings: 0, ..s.clone() }, "confirm_spacings"),
    ] {
        let e = bad.check().unwrap_err();
        assert!(e.exit_code() == 2 && e.to_string().contains(&format!("lane.uwb.{key}")), "{key}: {e}");
    }
}
