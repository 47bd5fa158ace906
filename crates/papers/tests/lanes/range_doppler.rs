//! Lane from the range-Doppler map alone: through the whole chain, look after look, and with hostile input.

use catseye::base::error::Error;
use catseye::base::rng::Draws;
use catseye::engine::{Engine, Precision};
use catseye::scene::scenario::Scenario;
use catseye_lane::range_doppler::{LaneSettings, Options, RangeDopplerLane, Sign};
use catseye_lane::{LaneError, LaneEstimator, LanePoint, Measured, SensorInput};
use catseye_papers::trial::range_doppler::{Case, Settings};
use catseye_papers::trial::{LaneMethod, Trial, TrialContext};
use std::path::{Path, PathBuf};

fn folder(name: &str) -> PathBuf {
    let dir = std::env::temp_dir().join(format!("catseye_lane_range_doppler_{}_{name}", std::process::id()));
    let _ = std::fs::remove_dir_all(&dir);
    std::fs::create_dir_all(&dir).unwrap();
    dir
}

/// A scenario of the preset with two of its channels, which is enough: angles are not read.
fn scenario(dir: &Path, text: &str) -> (PathBuf, Scenario) {
    let path = dir.join("scenario.toml");
    std::fs::write(&path, text).unwrap();
    let mut scenario = Scenario::load(&path).unwrap();
    for radar in &mut scenario.radars {
        radar.rx.truncate(2);
    }
    (path, scenario)
}

const STANDING: &str =
    "name = \"t\"\nseed = 5\nradar = \"feng77\"\n[ego]\nspeed_mps = 10\n[trace]\nfloor_db = -20\n";

fn trial(dir: &Path, text: &str, settings: &Settings, keep: Option<PathBuf>) -> Result<Trial, Error> {
    let (path, scenario) = scenario(dir, text);
    let engine = Engine::open("cpu", Precision::F32).unwrap();
    let given =
        TrialContext { scenario: &scenario, path: &path, engine: &engine, runs: 1, keep, watch: &|_, _| () };
    settings.trial(&given)
}

/// The value in a row of a sheet.
fn value(trial: &Trial, row: usize, column: &str) -> f64 {
    let sheet = trial.sheets.iter().find(|s| s.name == "looks").unwrap();
    let i = sheet.columns.iter().position(|c| c == column).unwrap();
    sheet.rows[row][i].parse().unwrap_or(f64::NAN)
}

#[test]
fn poses_come_back_through_the_whole_chain() {
    let case = |name: &str, offset_m: f64, heading_deg: f64, radius_m: f64, equal: bool| Case {
        name: name.into(),
        offset_m,
        heading_deg,
        radius_m,
        equal,
        ..Case::default()
    };
    let settings = Settings {
        row_distance_m: 3.0,
        lane_width_m: 3.4,
        pictures: 1,
        case: vec![
            case("right", -1.0, 0.0, 0.0, false),
            case("turned", 0.3, 45.0, 0.0, false),
            case("bend", 0.0, 0.0, -15.0, false),
            case("even", -0.8, 0.0, 0.0, true),
        ],
        ..Settings::default()
    };
    let dir = folder("poses");
    let t = trial(&dir, STANDING, &settings, None).unwrap();
    assert_eq!(t.steps.len(), 4);
    for (i, case) in settings.case.iter().enumerate() {
        let step = &t.steps[i];
        assert_eq!(step.estimate.no_lane, None, "{}", case.name);
        // With equal spacings the size only, and it is said.
        let sign = if case.equal { -1.0 } else { 1.0 };
        assert_eq!(value(&t, i, "mirror"), f64::from(u8::from(case.equal)), "{}", case.name);
        let (offset, std) = (sign * value(&t, i, "offset_m"), value(&t, i, "offset_std_m"));
        assert!((offset - case.offset_m).abs() < (5.0 * std).min(0.15), "{}: {offset} ± {std}", case.name);
        let (heading, std) = (sign * value(&t, i, "heading_deg"), value(&t, i, "heading_std_deg"));
        assert!(
            (heading - case.heading_deg).abs() < (5.0 * std).min(1.5),
            "{}: {heading} ± {std}",
            case.name
        );
    }
    let k = value(&t, 2, "curvature_per_m");
    assert!((k * -15.0 - 1.0).abs() < 0.05, "{k}");
    assert!((value(&t, 2, "bend_after_m") - 10.0).abs() < 0.5);
    // A straight lane is not taken for a bend.
    assert!(value(&t, 0, "curvature_per_m").abs() < 4.0 * value(&t, 0, "curvature_std_per_m"));
    assert!(t.steps[0].score.f1.unwrap() > 0.9, "{:?}", t.steps[0].score);
    assert!(t.pictures.iter().any(|p| p.0 == "map_right") && t.pictures.iter().any(|p| p.0 == "range_rates"));
    t.write(&dir).unwrap();
    assert!(dir.join("report.md").exists() && dir.join("looks.csv").exists());
    std::fs::remove_dir_all(&dir).unwrap();
}

/// What was kept of an interrupted trial gives the same bytes as frames made anew.
#[test]
fn a_drive_repeats_and_goes_on() {
    let dir = folder("drive");
    let road = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("scenes/road/road_lane_3m.toml");
    let text = format!(
        "name = \"t\"\nseed = 6\nradar = \"feng77\"\n[scene]\nroad = {road:?}\n[ego.on_road]\nroad = \"lane\"\nlane = 1\n\
         s_m = 15\noffset_m = -0.6\n[ego.drive]\nspeed_mps = 10\n[trace]\nfloor_db = -20\n[frames]\ncount = 2\n\
         interval_s = 0.1\n"
    );
    let settings = Settings { max_heading_deg: 20.0, pictures: 1, ..Settings::default() };
    let keep = dir.join("keep");
    std::fs::create_dir_all(&keep).unwrap();
    let first = trial(&dir, &text, &settings, Some(keep.clone())).unwrap();
    std::fs::remove_file(keep.join("run0_frame1.json")).unwrap();
    let again = trial(&dir, &text, &settings, Some(keep)).unwrap();
    assert_eq!(first.rows, again.rows);
    let estimates = |t: &Trial| t.steps.iter().map(|s| s.estimate.clone()).collect::<Vec<_>>();
    assert_eq!(estimates(&first), estimates(&again));
    assert_eq!(first.sheets, again.sheets);
    for (i, s) in first.steps.iter().enumerate() {
        let e = s.score.offset_error_m.unwrap();
        assert!(e.abs() < 0.15, "look {i}: {e}");
        assert!(s.estimate.offset_m.unwrap().value < -0.4, "on its side");
    }
    // The second look starts from the first.
    assert_eq!((value(&first, 0, "searched"), value(&first, 1, "searched")), (1.0, 0.0));
    std::fs::remove_dir_all(&dir).unwrap();
}

#[test]
fn settings_and_radars_that_do_not_do_are_named() {
    let dir = folder("bad");
    let bad = |s: Settings, key: &str| {
        let e = s.check().unwrap_err().to_string();
        assert!(e.contains(key) && e.contains("allowed"), "{e}");
    };
    let d = Settings::default;
    bad(Settings { row_distance_m: -1.0, ..d() }, "lane.range_doppler.row_distance_m");
    bad(Settings { far_m: f64::NAN, ..d() }, "lane.range_doppler.far_m");
    bad(Settings { search_every: 0, ..d() }, "search_every");
    bad(Settings { case: vec![Case { radius_m: 1.0, ..Case::default() }], ..d() }, "case[0].radius_m");
    bad(Settings { case: vec![Case { name: "a/b".into(), ..Case::default() }], ..d() }, "case[0].name");
    let twice = Settings { case: vec![Case::default(), Case::default()], ..d() };
    assert!(twice.check().unwrap_err().to_string().contains("same name"));
    let impulse = STANDING.replace("feng77", "uwb9");
    let e = trial(&dir, &impulse, &d(), None).unwrap_err().to_string();
    assert!(e.contains("radar") && e.contains("feng77"), "{e}");
    let still = STANDING.replace("speed_mps = 10", "speed_mps = 0");
    let one = Settings { case: vec![Case::default()], ..d() };
    let e = trial(&dir, &still, &one, None).unwrap_err().to_string();
    assert!(e.contains("ego.speed_mps"), "{e}");
    std::fs::remove_dir_all(&dir).unwrap();
}

/// Points of two straight rows 3 m apart, some 15 % of them lost and as many false ones.
fn points(along_m: f64, offset_m: f64, heading_rad: f64, spacings: [f64; 2], seed: u32) -> Vec<LanePoint> {
    let mut d = Draws::new(seed, 3);
    let mut out = Vec::new();
    for (y, spacing) in [(1.5, spacings[0]), (-1.5, spacings[1])] {
        for i in 0..80 {
            let x = spacing * f64::from(i) + 0.4 - along_m;
            let range = (x * x + (y - offset_m).powi(2) + 0.15f64.powi(2)).sqrt();
            let ahead = x * heading_rad.cos() + (y - offset_m) * heading_rad.sin();
            let draws = [d.uniform(), d.normal(), d.normal()];
            if range > 1.5 && range < 40.0 && ahead > 0.0 && draws[0] > 0.15 {
                out.push(point(range + 0.05 * draws[1], -10.0 * ahead / range + 0.03 * draws[2]));
            } else if range < 40.0 && ahead > 0.0 {
                out.push(point(2.0 + 38.0 * d.uniform(), -10.0 + 4.0 * d.uniform()));
            }
        }
    }
    out
}

fn point(range_m: f64, range_rate_mps: f64) -> LanePoint {
    LanePoint {
        at_m: [range_m, 0.0],
        std_m: [0.05, 1e6],
        range_rate_mps,
        range_rate_std_mps: 0.03,
        range_m,
        // Never read.
        azimuth_rad: f64::NAN,
        rcs_dbsm: 0.0,
        snr_db: 20.0,
        power_dbm: None,
    }
}

fn known(value: f64) -> Option<Measured> {
    Some(Measured { value, std: 0.05 })
}

#[test]
fn looks_that_follow_each_other_keep_the_lane() {
    let spacings = [1.5, 2.0];
    let mut lane = RangeDopplerLane::new(Options { search_every: 8, ..Options::default() }).unwrap();
    let (mut searched, mut chi2) = (0, 0.0);
    for i in 0..16u32 {
        let t = 0.1 * f64::from(i);
        let (offset, heading) = (-0.5 + 0.6 * t, 0.06);
        let cloud = points(20.0 + t * 10.0, offset, heading, spacings, i);
        let look =
            SensorInput { time_s: t, speed_mps: known(10.0), points: &cloud, ..SensorInput::default() };
        let found = lane.look(&look);
        let l = found.lane.unwrap_or_else(|| panic!("look {i}: {:?}", found.estimate.no_lane));
        assert!(!found.estimate.mirror && l.sign == Sign::Known, "look {i}");
        let e = [
            (l.offset_m.value - offset) / l.offset_m.std,
            (l.heading_rad.value - heading) / l.heading_rad.std,
        ];
        assert!(e[0].abs() < 5.0 && e[1].abs() < 5.0, "look {i}: {e:?}");
        chi2 += e[0] * e[0];
        searched += u32::from(found.searched);
    }
    // Every eighth, and where much less is explained than in the look before, as chance brings it.
    assert!((2..=6).contains(&searched), "{searched} of 16");
    assert!(chi2 / 16.0 < 3.0, "{chi2}");
    // A lane that jumps is found again by itself.
    let cloud = points(40.0, 1.2, -0.2, spacings, 99);
    let look = SensorInput { time_s: 1.7, speed_mps: known(10.0), points: &cloud, ..SensorInput::default() };
    let l = lane.look(&look).lane.expect("a lane");
    assert!((l.offset_m.value - 1.2).abs() < 0.2 && (l.heading_rad.value + 0.2).abs() < 0.03, "{l:?}");
}

#[test]
fn a_radar_ahead_of_the_axle_tells_the_place_of_the_axle() {
    // Turning to the left, the front moves to the left: the motion's heading is not the vehicle's.
    let (yaw, lever) = (0.3, 3.6);
    let slip = f64::atan2(yaw * lever, 10.0);
    let heading = 0.1;
    let speed = f64::hypot(10.0, yaw * lever);
    let mut cloud = points(20.0, 0.4, heading + slip, [1.5, 2.0], 4);
    for p in &mut cloud {
        p.range_rate_mps *= speed / 10.0;
    }
    let options = Options { radar_at_m: [lever, 0.0], ..Options::default() };
    let look = SensorInput {
        speed_mps: known(10.0),
        yaw_rate_rad_per_s: Some(Measured { value: yaw, std: 0.001 }),
        points: &cloud,
        ..SensorInput::default()
    };
    let e = RangeDopplerLane::new(options).unwrap().estimate(&look);
    let (h, o) = (e.heading_rad.unwrap(), e.offset_m.unwrap());
    assert!((h.value - heading).abs() < 5.0 * h.std, "{h:?}");
    assert!((o.value - (0.4 - lever * heading.sin())).abs() < 5.0 * o.std, "{o:?}");
    // The rows lie where they are: 1.5 m from the middle of the lane, seen from the axle.
    assert_eq!(e.lines.len(), 2);
    let at = e.lines[1].fitted.curve.foot(glam::DVec2::ZERO).left_m;
    assert!((at.abs() - (1.5 - o.value)).abs() < 0.02, "{at}");
}

#[test]
fn hostile_looks_are_refused_with_their_reason() {
    let mut lane = RangeDopplerLane::new(Options::default()).unwrap();
    let cloud = points(20.0, 0.3, 0.0, [1.5, 2.0], 1);
    let mut why = |points: &[LanePoint], speed_mps: Option<Measured>| {
        let e = lane.estimate(&SensorInput { speed_mps, points, ..SensorInput::default() });
        assert!(e.lines.is_empty() && e.offset_m.is_none() && e.confidence == 0.0, "{e:?}");
        e.no_lane.expect("no lane")
    };
    assert_eq!(why(&[], known(10.0)), LaneError::Empty);
    let nan: Vec<LanePoint> = cloud.iter().map(|p| LanePoint { range_m: f64::NAN, ..*p }).collect();
    assert_eq!(why(&nan, known(10.0)), LaneError::NotFinite { points: cloud.len() });
    let unsure: Vec<LanePoint> =
        cloud.iter().map(|p| LanePoint { range_rate_std_mps: f64::INFINITY, ..*p }).collect();
    assert!(matches!(why(&unsure, known(10.0)), LaneError::NotFinite { .. }));
    assert!(matches!(why(&cloud[..1], known(10.0)), LaneError::NoPattern { .. }));
    assert_eq!(why(&cloud, known(0.0)), LaneError::NothingAtRest);
    assert_eq!(why(&cloud, known(-10.0)), LaneError::NothingAtRest);
    let still: Vec<LanePoint> = cloud.iter().map(|p| LanePoint { range_rate_mps: 0.0, ..*p }).collect();
    assert!(matches!(why(&still, known(0.0)), LaneError::Refused { .. }));
    let behind: Vec<LanePoint> =
        cloud.iter().map(|p| LanePoint { range_rate_mps: -p.range_rate_mps, ..*p }).collect();
    assert_eq!(why(&behind, known(10.0)), LaneError::NothingAtRest);
    let far: Vec<LanePoint> = cloud.iter().map(|p| LanePoint { range_m: 500.0, ..*p }).collect();
    assert_eq!(why(&far, known(10.0)), LaneError::NothingAtRest);
    let weak: Vec<LanePoint> = cloud.iter().map(|p| LanePoint { snr_db: -3.0, ..*p }).collect();
    assert_eq!(why(&weak, known(10.0)), LaneError::NothingAtRest);
    // The ground at rest all over the map, and one thing over and over, are no rows.
    let mut d = Draws::new(1, 5);
    let clutter: Vec<LanePoint> =
        (0..60).map(|_| point(2.0 + 38.0 * d.uniform(), -10.0 * d.uniform())).collect();
    assert!(matches!(why(&clutter, known(10.0)), LaneError::NoPattern { .. }));
    // Without a speed from anywhere.
    let silent = Options { speed_from_map: false, ..Options::default() };
    let mut lane = RangeDopplerLane::new(silent).unwrap();
    for speed_mps in [None, Some(Measured { value: f64::NAN, std: 0.1 })] {
        let e = lane.estimate(&SensorInput { speed_mps, points: &cloud, ..SensorInput::default() });
        assert_eq!(e.no_lane, Some(LaneError::NoSpeed));
    }
    // One point over and over: whatever comes, no panic.
    let same = vec![point(10.0, -9.0); 40];
    let _ = lane.estimate(&SensorInput { speed_mps: known(10.0), points: &same, ..SensorInput::default() });
    let e = lane.estimate(&SensorInput {
        time_s: f64::NAN,
        speed_mps: known(10.0),
        points: &cloud,
        ..SensorInput::default()
    });
    assert!(matches!(e.no_lane, Some(LaneError::NotGiven { .. })));
    let bad = Options {
        lane: LaneSettings { lane_width_m: -1.0, ..LaneSettings::default() },
        ..Options::default()
    };
    assert!(RangeDopplerLane::new(bad).is_err());
    assert!(RangeDopplerLane::new(Options { search_every: 0, ..Options::default() }).is_err());
}

/// Without the bus the edge of the map gives the speed, and the lane.
#[test]
fn the_map_gives_the_speed_where_the_bus_is_silent() {
    let cloud = points(20.0, -0.4, 0.1, [1.5, 2.0], 2);
    let mut lane = RangeDopplerLane::new(Options::default()).unwrap();
    let l = lane.look(&SensorInput { points: &cloud, ..SensorInput::default() }).lane.expect("a lane");
    assert!((l.speed_mps.value - 10.0).abs() < 0.1, "{:?}", l.speed_mps);
    assert!((l.offset_m.value + 0.4).abs() < 0.15 && (l.heading_rad.value - 0.1).abs() < 0.02, "{l:?}");
}
