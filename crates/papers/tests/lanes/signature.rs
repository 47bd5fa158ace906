//! The signature method from a road file to the lane, through the whole simulated chain, and hostile input.

use catseye::base::rng::Draws;
use catseye::engine::{Engine, Precision};
use catseye::scene::scenario::{Ego, EgoPlan, Scenario};
use catseye_lane::curve::Clothoid;
use catseye_lane::signature::codewords::{Alphabet, Code, Zone};
use catseye_lane::signature::estimator::{MapLane, MapLanes, Signature, SignatureSetup, scan_point};
use catseye_lane::signature::map::{MapSettings, Pose, SignatureMap};
use catseye_lane::signature::row::{RowOptions, RowReader};
use catseye_lane::{LaneError, LaneEstimator, LanePoint, Measured, SensorInput};
use catseye_papers::trial::signature::{CodeName, GapsTable, RowTable, Settings};
use catseye_papers::trial::{LaneMethod, Trial, TrialContext};
use glam::{DVec2, DVec3};
use std::path::PathBuf;

const ROAD: &str = r#"
name = "short road"
[[road]]
name = "main"
plan = [{ kind = "straight", length_m = 60 }]
right = [{ number = 1, width_m = 3.5, line = "solid" }]
lane_offset_m = 1.75
[[road.markers]]
name = "right"
reflector = "type1:width_m=0.16,height_m=0.004,length_m=0.117,material=aluminium"
lateral = { lane = 1, side = "right", offset_m = 0.15 }
from_m = 1
gaps_m = [2, 1.5, 1.5, 2, 2, 1.5, 2, 1.5, 1.5, 1.5, 2, 2, 1.5, 2, 2, 1.5, 1.5, 2, 1.5, 2, 1.5, 2]
[[road.markers]]
name = "left"
reflector = "type1:width_m=0.16,height_m=0.004,length_m=0.117,material=aluminium"
lateral = { lane = 1, side = "left", offset_m = -0.15 }
from_m = 1.7
gaps_m = [1.5, 2, 1.5, 1.5, 2, 1.5, 1.5, 2, 2, 2, 1.5, 2, 1.5, 2, 1.5, 1.5, 2, 1.5, 2, 2, 1.5, 2]
[[road.vehicle]]
kind = "passenger-car"
s_m = 40
lateral = { lane = 1 }
speed_mps = 9
"#;

const SCENARIO: &str = r#"
name = "short drive"
seed = 5
radar = "front77"
[scene]
road = "road.toml"
[ego]
on_road = { lane = 1, s_m = 4, offset_m = 0.4 }
drive = { speed_mps = 5 }
[frames]
count = 4
interval_s = 0.4
[trace]
rays = 5_000
accuracy_db = 1.0
facets = 0
floor_db = -10
"#;

fn files(name: &str) -> PathBuf {
    let dir = std::env::temp_dir().join(format!("catseye_signature_{name}_{}", std::process::id()));
    std::fs::create_dir_all(&dir).unwrap();
    std::fs::write(dir.join("road.toml"), ROAD).unwrap();
    std::fs::write(dir.join("scenario.toml"), SCENARIO).unwrap();
    dir.join("scenario.toml")
}

fn trial(name: &str, scenario: impl Fn(&mut Scenario), settings: &Settings) -> catseye::Result<Trial> {
    let path = files(name);
    let mut loaded = Scenario::load(&path).unwrap();
    scenario(&mut loaded);
    let engine = Engine::open("cpu", Precision::F32).unwrap();
    let given = TrialContext {
        scenario: &loaded,
        path: &path,
        engine: &engine,
        runs: 1,
        keep: None,
        watch: &|_, _| {},
    };
    let out = settings.trial(&given);
    std::fs::remove_dir_all(path.parent().unwrap()).unwrap();
    out
}

fn settings() -> Settings {
    Settings {
        map_frames: 9,
        map_interval_s: 0.4,
        map_offset_m: -0.3,
        map_s_m: Some(2.0),
        ..Settings::default()
    }
}

#[test]
fn a_drive_is_located_in_another_ones_map() {
    let t = trial("place", |_| {}, &settings()).unwrap();
    let row = |name: &str| {
        let found = t.rows.iter().find(|r| r.quantity == name);
        found.and_then(|r| r.ours).unwrap_or_else(|| panic!("{name}: {:?}", t.rows))
    };
    assert_eq!(row("frames with a position"), 100.0);
    // Inertial poses are good to 0.03 m along each axis.
    assert!(row("largest position error") < 0.2, "{}", t.markdown());
    assert!(row("offset error (rms)") < 0.12 && row("F1 within 0.3 m") > 95.0, "{}", t.markdown());
    assert_eq!((row("lane number right"), row("first search along the whole map right")), (100.0, 100.0));
    assert!(row("points of moving objects removed") > 90.0, "{}", t.markdown());
    assert!(t.steps.iter().all(|s| s.estimate.lines.len() == 2 && s.estimate.confidence > 0.9));
    assert!(t.pictures.iter().any(|p| p.0 == "map") && t.sheets.iter().any(|s| s.name == "places"));
}

/// Nothing but the seed decides.
#[test]
fn the_same_seed_gives_the_same_bytes() {
    let short = Settings { map_frames: 4, ..settings() };
    let of = |k| trial(&format!("bytes{k}"), |s| s.frames.count = 1, &short).unwrap();
    let (a, b) = (of(0), of(1));
    assert_eq!((a.markdown(), &a.sheets), (b.markdown(), &b.sheets));
    assert_eq!(a.steps[0].estimate, b.steps[0].estimate);
}

#[test]
fn scenarios_that_cannot_be_mapped_are_refused() {
    let with = |change: &dyn Fn(&mut Scenario)| match trial("refused", change, &settings()) {
        Err(e) => e.to_string(),
        Ok(_) => panic!("is no error"),
    };
    let standing = Ego { position_m: DVec3::ZERO, yaw_rad: 0.0, speed_mps: 0.0, motion: None };
    assert!(with(&|s| s.ego = EgoPlan::Free(standing.clone())).contains("ego.on_road"));
    let nothing = catseye::scene::scenario::SceneSource::Builtin(catseye::scene::scenario::Builtin::Empty);
    assert!(with(&|s| s.scene = nothing.clone()).contains("scene.road"));
    let row = RowTable {
        name: "r".into(),
        beside_m: [0.5, 2.5],
        code: CodeName::Bch15x7,
        gaps: Some(GapsTable { zero_m: 1.5, one_m: 2.0, sync_m: Some(2.75) }),
        sides: None,
        word: None,
    };
    let bad = [
        Settings { map_frames: 0, ..settings() },
        Settings { map_interval_s: f64::NAN, ..settings() },
        Settings { range_m: [30.0, 10.0], ..settings() },
        Settings { worse: 0.9, ..settings() },
        Settings { row: vec![RowTable { gaps: None, ..row.clone() }], ..settings() },
        Settings { row: vec![RowTable { word: Some("101".into()), ..row.clone() }], ..settings() },
        Settings { row: vec![RowTable { word: Some("0".repeat(15)), ..row.clone() }], ..settings() },
        Settings { row: vec![RowTable { beside_m: [2.0, 1.0], ..row.clone() }], ..settings() },
    ];
    for s in bad {
        let e = s.check().unwrap_err().to_string();
        assert!(e.contains("lane.signature."), "{e}");
    }
    Settings { row: vec![row], ..settings() }.check().unwrap();
}

fn seen(at: DVec2, from: DVec2, speed: f64, d: &mut Draws) -> LanePoint {
    let v = at - from;
    let range_m = v.length() + 0.02 * d.normal();
    let azimuth_rad = v.to_angle() + 0.004 * d.normal();
    LanePoint {
        at_m: (from + DVec2::from_angle(azimuth_rad) * range_m).to_array(),
        std_m: [0.02, 0.004 * range_m],
        range_rate_mps: -speed * v.to_angle().cos(),
        range_rate_std_mps: 0.01,
        range_m,
        azimuth_rad,
        rcs_dbsm: 0.0,
        snr_db: 20.0,
        power_dbm: None,
    }
}

const RADAR: DVec2 = DVec2::new(3.6, 0.0);

/// Markers at gaps that do not repeat, on both sides.
fn markers() -> Vec<DVec2> {
    let mut d = Draws::new(3, 1);
    let mut out = Vec::new();
    for y in [-1.6, 1.6] {
        let mut x = 0.0;
        while x < 120.0 {
            out.push(DVec2::new(x, y));
            x += if d.uniform() < 0.5 { 1.5 } else { 2.0 };
        }
    }
    out
}

fn scan(at_m: DVec2, speed: f64, d: &mut Draws) -> Vec<LanePoint> {
    let places = markers().into_iter().map(|m| m - at_m);
    places.filter(|p| p.x > 7.0 && p.length() < 40.0).map(|p| seen(p, RADAR, speed, d)).collect()
}

fn estimator() -> Signature {
    let mut map = SignatureMap::new(MapSettings::default()).unwrap();
    let mut d = Draws::new(4, 1);
    for i in 0..60 {
        let at = DVec2::new(f64::from(i), 0.1);
        let points: Vec<_> = scan(at, 5.0, &mut d).iter().map(scan_point).collect();
        let pose = Pose { x_m: at.x + RADAR.x, y_m: at.y, heading_rad: 0.0 };
        map.add_scan(pose, [0.02, 0.02, 0.001], None, &points).unwrap();
    }
    map.prune(3, 0.3);
    let lines_m = vec![vec![[-50.0, -1.75], [200.0, -1.75]], vec![[-50.0, 1.75], [200.0, 1.75]]];
    let lanes = MapLanes { lines_m, std_m: 0.02, lanes: vec![MapLane { number: 1, right: 0, left: 1 }] };
    let mut options = SignatureSetup::default();
    options.at_rest.radar_m = RADAR.to_array();
    Signature::new(map, lanes, options).unwrap()
}

fn look(points: &[LanePoint], time_s: f64) -> SensorInput<'_> {
    SensorInput {
        time_s,
        speed_mps: Some(Measured { value: 5.0, std: 0.05 }),
        points,
        ..SensorInput::default()
    }
}

#[test]
fn an_estimator_tracks_and_finds_itself_again() {
    let mut e = estimator();
    let mut d = Draws::new(8, 1);
    for i in 0..6 {
        let at = DVec2::new(20.0 + 0.25 * f64::from(i), 0.4);
        let points = scan(at, 5.0, &mut d);
        let time_s = 0.05 * f64::from(i);
        // Two empty scans in between.
        let empty = i == 2 || i == 3;
        let answer = e.estimate(&look(if empty { &[] } else { &points }, time_s));
        if empty {
            assert_eq!(answer.no_lane, Some(LaneError::Empty));
            assert!(e.place().is_none());
            continue;
        }
        let place = e.place().unwrap();
        assert!((place.vehicle.x_m - at.x).hypot(place.vehicle.y_m - at.y) < 0.1, "{place:?}");
        assert_eq!((place.tracked, answer.lane_number), (i != 0, Some(1)));
        let offset = answer.offset_m.unwrap();
        assert!((offset.value - 0.4).abs() < 4.0 * offset.std && offset.std < 0.1, "{offset:?}");
        assert!((answer.width_m.unwrap().value - 3.5).abs() < 1e-6);
        let line = &answer.lines[0].fitted;
        // A pose is known best where the points are, some 20 m ahead.
        assert!(line.lateral_std_m(80.0) > line.lateral_std_m(25.0));
        assert!(line.lateral_std_m(0.0) > line.lateral_std_m(25.0));
        let Clothoid { start_m, .. } = line.curve;
        assert!((start_m[1] + 2.15).abs() < 0.1 && start_m[0] <= 0.0, "{start_m:?}");
    }
}

/// The place of a scan that fits elsewhere as well, or nowhere, is not told.
#[test]
fn hostile_looks_give_no_lane() {
    let mut d = Draws::new(9, 1);
    let good = scan(DVec2::new(20.0, 0.0), 5.0, &mut d);
    let spoilt = |change: &dyn Fn(&mut LanePoint)| -> Vec<LanePoint> {
        good.iter()
            .map(|p| {
                let mut p = *p;
                change(&mut p);
                p
            })
            .collect()
    };
    let none = |points: &[LanePoint]| {
        let answer = estimator().estimate(&look(points, 0.0));
        assert!(answer.lines.is_empty() && answer.confidence == 0.0, "{answer:?}");
        answer.no_lane.unwrap()
    };
    assert_eq!(none(&[]), LaneError::Empty);
    let n = good.len();
    assert_eq!(none(&spoilt(&|p| p.azimuth_rad = f64::NAN)), LaneError::NotFinite { points: n });
    assert_eq!(none(&spoilt(&|p| p.range_m = f64::INFINITY)), LaneError::NotFinite { points: n });
    assert_eq!(none(&spoilt(&|p| p.range_rate_mps = 4.0)), LaneError::NothingAtRest);
    assert!(matches!(none(&good[..1]), LaneError::Refused { .. }));
    // Behind the radar.
    let behind = spoilt(&|p| {
        p.azimuth_rad = std::f64::consts::PI - p.azimuth_rad;
        p.range_rate_mps = -p.range_rate_mps;
    });
    assert!(matches!(none(&behind), LaneError::Refused { .. }));
    // No markers: points anywhere.
    let anywhere = spoilt(&|p| {
        p.range_m = 5.0 + (p.range_m * 7.3) % 30.0;
        p.azimuth_rad = (p.azimuth_rad * 91.7).sin();
        p.range_rate_mps = -5.0 * p.azimuth_rad.cos();
    });
    assert!(matches!(none(&anywhere), LaneError::Refused { .. }));
    // A map that does not cover the radar, then none at all.
    let mut d = Draws::new(9, 2);
    let mut e = estimator();
    let far: Vec<LanePoint> = (0..30)
        .map(|i| seen(DVec2::new(8.0 + f64::from(i), [-4.0, 3.1, 5.5][i as usize % 3]), RADAR, 5.0, &mut d))
        .collect();
    assert!(matches!(e.estimate(&look(&far, 0.0)).no_lane, Some(LaneError::Refused { .. })));
    let empty = SignatureMap::new(MapSettings::default()).unwrap();
    let mut e = Signature::new(empty, MapLanes::default(), SignatureSetup::default()).unwrap();
    assert!(matches!(e.estimate(&look(&good, 0.0)).no_lane, Some(LaneError::NotGiven { .. })));
    // Times that are none, or go back.
    let mut e = estimator();
    for t in [0.0, f64::NAN, -5.0, f64::INFINITY, 1e300] {
        e.estimate(&look(&good, t));
    }
}

#[test]
fn the_speed_may_be_missing_or_zero() {
    let mut d = Draws::new(10, 1);
    let good = scan(DVec2::new(20.0, 0.2), 5.0, &mut d);
    let missing = SensorInput { speed_mps: None, ..look(&good, 0.0) };
    assert!((estimator().estimate(&missing).offset_m.unwrap().value - 0.2).abs() < 0.1);
    let still = scan(DVec2::new(20.0, 0.2), 0.0, &mut d);
    let speed_mps = Some(Measured { value: 0.0, std: 0.01 });
    let answer = estimator().estimate(&SensorInput { speed_mps, ..look(&still, 0.0) });
    assert!((answer.offset_m.unwrap().value - 0.2).abs() < 0.1, "{answer:?}");
    let nan =
        SensorInput { speed_mps: Some(Measured { value: f64::NAN, std: 0.1 }), ..look(&good[..1], 0.0) };
    assert_eq!(estimator().estimate(&nan).no_lane, Some(LaneError::NoSpeed));
}

/// A word in the gaps of a row on the right while the vehicle passes, swaying, with markers missing and points too many.
#[test]
fn a_row_is_read_on_the_way() {
    let alphabet = Alphabet::Gaps { zero_m: 1.5, one_m: 2.0, sync_m: Some(2.75) };
    let said = Zone::SpeedLimit { tens_kmh: 8 };
    let word = Code::Bch15x7.encode(said.message().unwrap()).unwrap();
    let all = alphabet.markers(&word, 0.0, 130.0).unwrap();
    let options = RowOptions::new("right", [-2.8, -0.6], Code::Bch15x7, alphabet);
    let mut reader = RowReader::new(options).unwrap();
    let mut d = Draws::new(12, 1);
    let missing: Vec<bool> = all.iter().map(|_| d.uniform() < 0.1).collect();
    let extra: Vec<DVec2> =
        (0..6).map(|_| DVec2::new(130.0 * d.uniform(), -1.6 + 0.3 * d.uniform())).collect();
    assert!(reader.read().is_err());
    for i in 0..70 {
        let at = DVec2::new(0.5 * f64::from(i), 0.2 * (0.1 * f64::from(i)).sin());
        let kept = all.iter().zip(&missing).filter(|m| !m.1).map(|(m, _)| DVec2::new(m.0, -1.6));
        let points: Vec<_> = kept
            .chain(extra.iter().copied())
            .map(|m| m - at)
            .filter(|p| p.x > 7.0 && p.length() < 28.0)
            .map(|p| scan_point(&seen(p, RADAR, 5.0, &mut d)))
            .collect();
        let speed = Measured { value: 5.0 + 0.05 * d.normal(), std: 0.05 };
        reader.add(0.1, speed, None, RADAR.to_array(), &points);
    }
    let zone = reader.zone().unwrap();
    assert_eq!((zone.zone, zone.reading.sure), (Some(said), true), "{zone:?}");
    // No row on the other side.
    let options = RowOptions::new("left", [0.6, 2.8], Code::Bch15x7, alphabet);
    let mut other = RowReader::new(options).unwrap();
    other.add(0.1, Measured { value: f64::NAN, std: 0.1 }, None, [0.0; 2], &[]);
    assert!(other.zone().is_err());
}
