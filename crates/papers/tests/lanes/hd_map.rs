//! Lane numbers by radar tracks and a map, from the scene to the figures, and what nobody should give an estimator.

use catseye::base::rng::Draws;
use catseye::engine::{Engine, Precision};
use catseye::road::labels::RoadTruth;
use catseye::road::scene_toml;
use catseye::road::site::Site;
use catseye::scene::scenario::Scenario;
use catseye_lane::hd_map::estimator::{Body, MapLanes, Options};
use catseye_lane::hd_map::of_road::{self, Stripes};
use catseye_lane::hd_map::{self, HdMap, RadarPose, Wgs84, file};
use catseye_lane::score::score;
use catseye_lane::{LaneError, LaneEstimator, LaneTrack, SensorInput};
use catseye_papers::trial::drive::true_lanes;
use catseye_papers::trial::hd_map::{Kind, SceneTable, Settings};
use catseye_papers::trial::{LaneMethod, Trial, TrialContext, drive::Level};
use glam::{DVec2, DVec3};
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}

fn scenario() -> (PathBuf, Scenario) {
    let path = root().join("scenes/lane/hd_map.toml");
    let scenario = Scenario::load(&path).unwrap();
    (path, scenario)
}

fn trial(path: &Path, scenario: &Scenario, settings: &Settings) -> catseye::Result<Trial> {
    let engine = Engine::open("cpu", Precision::F32)?;
    settings.trial(&TrialContext { scenario, path, engine: &engine, runs: 1, keep: None, watch: &|_, _| {} })
}

fn anchor() -> RadarPose {
    RadarPose { position: Wgs84::new(52.5, 13.4, 35.0), azimuth_rad: 0.7 }
}

/// The map of a road file, every point `shift_m` outwards.
fn map(road: &str, spacing_m: f64, shift_m: f64) -> (HdMap, Vec<Stripes>) {
    let plan = scene_toml::load(&root().join("scenes/road").join(road)).unwrap();
    let stripes = |step: f64| plan.roads.iter().map(|r| Stripes::of_road(&r.road, step)).collect::<Vec<_>>();
    (of_road::map(&stripes(spacing_m), &anchor(), &mut || shift_m).unwrap(), stripes(1.0))
}

fn figure(trial: &Trial, quantity: &str) -> f64 {
    trial
        .rows
        .iter()
        .find(|r| r.quantity == quantity)
        .and_then(|r| r.ours)
        .unwrap_or_else(|| panic!("{quantity}"))
}

/// Five vehicles that pass under the radar, through the whole chain: they are tracked and nearly all given their lanes; a map that
/// lies half a lane off does not. The same bytes when it is run again.
#[test]
fn passing_vehicles_are_given_their_lanes() {
    let (path, mut scenario) = scenario();
    scenario.frames.count = 7;
    let scene = SceneTable { kind: Some(Kind::Straight), vehicles: 5, ..SceneTable::default() };
    let settings = Settings { scene: vec![scene], together: 5, far_m: 90.0, ..Settings::default() };
    let t = trial(&path, &scenario, &settings).unwrap();
    let sheet = t.sheets.iter().find(|s| s.name == "vehicles").unwrap();
    let column = |name: &str| sheet.columns.iter().position(|c| c == name).unwrap();
    assert!(sheet.rows.len() >= 4, "{sheet:?}");
    let right = sheet.rows.iter().filter(|r| r[column("right")] == "1").count();
    assert!(right + 1 >= sheet.rows.len(), "{sheet:?}");
    // The radar sees of a vehicle what faces it.
    assert!(figure(&t, "straight: its mean without that step") > 0.0);
    assert!(figure(&t, "straight: error of tracks across the vehicle (rms)") < 1.2);
    let row = t.rows.iter().find(|r| r.quantity == "straight: vehicles in the right lane").unwrap();
    assert_eq!(row.document, Some(98.93));
    assert!(
        t.pictures.iter().any(|(n, _)| n == "scene_straight")
            && t.pictures.iter().any(|(n, _)| n == "accuracy")
    );

    let again = trial(&path, &scenario, &settings).unwrap();
    assert_eq!(again.markdown(), t.markdown());
    assert_eq!(again.sheets, t.sheets);

    // The same roads, 2.5 m farther out: lanes are missed in most cases.
    let wrong = std::env::temp_dir().join(format!("hd_map_{}.json", std::process::id()));
    let (shifted, _) = {
        let plan = scene_toml::load(&root().join("scenes/road/road_eight_lanes.toml")).unwrap();
        let s: Vec<Stripes> = plan.roads.iter().map(|r| Stripes::of_road(&r.road, 25.0)).collect();
        let [lat, lon, h] = settings.origin;
        let at =
            RadarPose { position: Wgs84::new(lat, lon, h), azimuth_rad: settings.north_deg.to_radians() };
        (of_road::map(&s, &at, &mut || 2.5).unwrap(), ())
    };
    std::fs::write(&wrong, file::to_json(&shifted).unwrap()).unwrap();
    let settings = Settings { map: Some(wrong.display().to_string().into()), ..settings };
    let t = trial(&path, &scenario, &settings).unwrap();
    std::fs::remove_file(&wrong).unwrap();
    assert!(figure(&t, "straight: vehicles in the right lane") < 50.0);
    assert!(figure(&t, "straight: wrong by method") >= 2.0);
}

/// Anywhere on the four roads but 0.1 m from a line: the lane by the map is the lane between whose lines the place lies.
#[test]
fn maps_of_roads_are_those_roads() {
    for (road, at) in [
        ("road_eight_lanes.toml", DVec3::new(10.0, 0.0, 8.0)),
        ("road_eight_lanes_curve.toml", DVec3::new(160.0, 4.0, 8.0)),
        ("road_eight_lanes_ramp.toml", DVec3::new(140.0, 0.0, 8.0)),
        ("road_eight_lanes_bay.toml", DVec3::new(110.0, 0.0, 8.0)),
    ] {
        let (map, truth) = map(road, 25.0, 0.0);
        let mut lanes = MapLanes::new(map, Options::default()).unwrap();
        let place = RadarPose::within(&anchor(), at, 0.1);
        let look = SensorInput { place, ..SensorInput::default() };
        let mut draws = Draws::new(5, 1);
        let (mut right, mut all, mut kinds) = (0, 0, Vec::new());
        while all < 1500 {
            let p = DVec2::new(at.x + 190.0 * draws.uniform(), 110.0 * draws.uniform() - 80.0);
            let lane = |p: DVec2| truth.iter().find_map(|r| r.lane_at(p)).map(|l| l.0);
            let Some(here) = lane(p) else { continue };
            let near =
                [(0.1, 0.0), (-0.1, 0.0), (0.0, 0.1), (0.0, -0.1)].map(|(x, y)| lane(p + DVec2::new(x, y)));
            if near.iter().any(|n| *n != Some(here)) || here % 10 == 0 {
                continue;
            }
            let own = DVec2::from_angle(-0.1).rotate(p - at.truncate());
            let given = lanes.lane_at(&look, own.to_array()).unwrap();
            all += 1;
            right += u32::from(given.number() == Some(here));
            kinds.push(here);
        }
        // Chords of 25 m along a taper and at a nose leave some places open.
        assert!(f64::from(right) > 0.985 * f64::from(all), "{road}: {right} of {all}");
        kinds.sort_unstable();
        kinds.dedup();
        assert!(kinds.len() >= 8, "{road}: {kinds:?}");
    }
}

fn truth(road: &str) -> RoadTruth {
    let text = format!("name = \"t\"\nradar = \"front77\"\n[scene]\nroad = \"{road}\"\n");
    let path = root().join("scenes/road/none.toml");
    let scenario = catseye::scene::scenario::parse(&path, &text).unwrap();
    Site::new(&scenario).unwrap().road.unwrap()
}

/// Where the vehicle drives: lines, offset and number of its own lane, along and against the road.
#[test]
fn the_own_lane_comes_from_the_map() {
    let road = "road_eight_lanes_curve.toml";
    let (map, _) = map(road, 25.0, 0.0);
    let truth = truth(road);
    let options = Options { radar_at_m: [3.6, 0.3], radar_yaw_rad: 0.2, ..Options::default() };
    let mut lanes = MapLanes::new(map, options).unwrap();
    let lane = |n: i32| truth.roads[0].lanes.iter().find(|l| l.number == n).unwrap();
    for (number, back, offset_m) in [(1, false, 0.4), (3, false, -0.7), (12, true, 0.2)] {
        for i in [40, 150, 260] {
            let centre = &lane(number).centre_m;
            let i = i.min(centre.len() - 2);
            let step = DVec3::from_array(centre[i + 1]) - DVec3::from_array(centre[i]);
            let ahead = step.truncate().normalize() * if back { -1.0 } else { 1.0 };
            let at_m = DVec3::from_array(centre[i]).truncate() + ahead.perp() * offset_m;
            let heading_rad = ahead.y.atan2(ahead.x) + 0.02;
            let level = Level { at_m, heading_rad, speed_mps: 20.0, yaw_rate_rad_per_s: 0.0 };
            let radar = level.to_world(DVec2::new(3.6, 0.3)).extend(0.5);
            let place = RadarPose::within(&anchor(), radar, heading_rad + 0.2);
            let e = lanes.estimate(&SensorInput { place, ..SensorInput::default() });
            assert_eq!((e.lane_number, &e.no_lane), (Some(number), &None), "{number} {i}");
            let t = true_lanes(&truth, &level, [3.0, 60.0]);
            let s = score(&e, &t);
            assert!((e.offset_m.unwrap().value - offset_m).abs() < 0.05, "{number} {i}: {:?}", e.offset_m);
            assert!((e.heading_rad.unwrap().value - 0.02).abs() < 0.01, "{number} {i}: {:?}", e.heading_rad);
            assert!(s.precision.unwrap() > 0.95 && s.recall.unwrap() > 0.9, "{number} {i}: {s:?}");
        }
    }
}

fn track(at_m: [f64; 2], velocity_mps: [f64; 2]) -> LaneTrack {
    LaneTrack { id: 1, at_m, std_m: [0.1, 0.3], velocity_mps }
}

#[test]
fn looks_that_hold_nothing_or_nonsense_give_no_lane() {
    let (map, _) = map("road_eight_lanes.toml", 25.0, 0.0);
    let mut lanes = MapLanes::new(map.clone(), Options::default()).unwrap();
    let refused = |e: &catseye_lane::LaneEstimate| {
        assert!(e.lines.is_empty() && e.lane_number.is_none() && e.confidence == 0.0, "{e:?}");
        e.no_lane.clone().unwrap()
    };
    // Nothing at all.
    let e = lanes.estimate(&SensorInput::default());
    assert!(matches!(refused(&e), LaneError::NotGiven { .. }));
    assert!(lanes.targets(&SensorInput::default()).is_err());
    // A place that is none, one far from the map, one beside the road, one on the median.
    let good = RadarPose::within(&anchor(), DVec3::new(100.0, -6.6, 0.5), 0.0).unwrap();
    let nowhere = [
        RadarPose { azimuth_rad: f64::NAN, ..good },
        RadarPose { position: Wgs84::new(f64::NAN, 0.0, 0.0), ..good },
        RadarPose { position: Wgs84::new(-33.0, 151.0, 0.0), ..good },
        RadarPose::within(&anchor(), DVec3::new(100.0, 60.0, 0.5), 0.0).unwrap(),
        RadarPose::within(&anchor(), DVec3::new(-300.0, -6.6, 0.5), 0.0).unwrap(),
        RadarPose::within(&anchor(), DVec3::new(100.0, 0.4, 0.5), 0.0).unwrap(),
    ];
    for place in nowhere {
        let e = lanes.estimate(&SensorInput { place: Some(place), time_s: 2.0, ..SensorInput::default() });
        assert!(matches!(refused(&e), LaneError::Refused { .. }), "{place:?}");
    }
    // Tracks that are no numbers, behind, far beside, with no or a senseless velocity: one answer each, no panic.
    let nan = f64::NAN;
    let tracks = [
        track([nan, 0.0], [20.0, 0.0]),
        track([50.0, 0.0], [nan, 0.0]),
        track([50.0, 0.0], [0.0, 0.0]),
        track([0.0, 0.0], [20.0, 0.0]),
        track([-60.0, 0.0], [20.0, 0.0]),
        track([50.0, 200.0], [20.0, 0.0]),
        track([1e9, 0.0], [20.0, 0.0]),
        track([f64::INFINITY, 1.0], [f64::INFINITY, 0.0]),
        LaneTrack { std_m: [nan, 0.3], ..track([50.0, 0.0], [20.0, 0.0]) },
        LaneTrack { std_m: [-1.0, 0.0], ..track([50.0, 0.0], [20.0, 0.0]) },
    ];
    let look = SensorInput { place: Some(good), tracks: &tracks, ..SensorInput::default() };
    let given = lanes.targets(&look).unwrap();
    let numbers: Vec<Option<i32>> = given.iter().map(|a| a.number()).collect();
    assert_eq!(given.len(), tracks.len());
    for none in [0, 5, 6, 7, 8] {
        assert_eq!(numbers[none], None, "{none}: {given:?}");
    }
    for lane in [1, 2, 4] {
        assert_eq!(numbers[lane], Some(2), "{lane}: {given:?}");
    }
    // The vehicle itself still stands in its lane.
    assert_eq!(lanes.estimate(&look).lane_number, Some(2));
    // Maps and options that are none.
    assert!(MapLanes::new(HdMap::default(), Options::default()).is_err());
    for bad in [
        Options { reach_m: nan, ..Options::default() },
        Options { place_std_m: -1.0, ..Options::default() },
        Options { radar_at_m: [nan, 0.0], ..Options::default() },
        Options { settings: hd_map::Settings { map_std_m: nan, ..Default::default() }, ..Options::default() },
    ] {
        assert!(MapLanes::new(map.clone(), bad).is_err(), "{bad:?}");
    }
    // No reach, no lines; but no lane either.
    let mut short = MapLanes::new(map, Options { reach_m: 0.0, ..Options::default() }).unwrap();
    assert!(matches!(refused(&short.estimate(&look)), LaneError::Refused { .. }));
}

#[test]
fn tracks_are_moved_to_the_middle_of_what_is_seen() {
    let (map, _) = map("road_eight_lanes.toml", 25.0, 0.0);
    let lanes = |body| MapLanes::new(map.clone(), Options { body, ..Options::default() }).unwrap();
    let car = Body { length_m: 4.0, width_m: 2.0, width_std_m: 0.2 };
    let track = |at_m: [f64; 2], velocity_mps| LaneTrack { id: 1, at_m, std_m: [0.1; 2], velocity_mps };
    // Left of the radar it shows its right side: the middle lies farther left, and ahead of the corner.
    for (y, left) in [(20.0, 1.0), (-20.0, -1.0)] {
        let left_of_it = track([30.0, y], [30.0, 0.0]);
        let middle = lanes(Some(car)).middle_m(&left_of_it);
        assert!((middle[1] - y - left).abs() < 1e-3 && (30.0..31.0).contains(&middle[0]), "{middle:?}");
        let target = lanes(Some(car)).target(&left_of_it);
        assert!(target.covariance_m2.x_axis.x > 1.0 && target.covariance_m2.y_axis.y < 0.05, "{target:?}");
    }
    // Straight ahead it may be anywhere on its width; what hardly moves has no side.
    let ahead = track([50.0, 0.0], [30.0, 0.0]);
    assert!(lanes(Some(car)).middle_m(&ahead)[1].abs() < 1e-9);
    assert!(lanes(Some(car)).target(&ahead).covariance_m2.y_axis.y > 0.25);
    assert_eq!(lanes(Some(car)).middle_m(&track([30.0, 20.0], [0.1, 0.0])), [30.0, 20.0]);
    assert_eq!(lanes(None).middle_m(&track([30.0, 20.0], [30.0, 0.0])), [30.0, 20.0]);
}

#[test]
fn maps_are_written_and_read() {
    let (map, _) = map("road_eight_lanes_bay.toml", 25.0, 0.0);
    let path = std::env::temp_dir().join(format!("hd_map_file_{}.json", std::process::id()));
    let text = file::to_json(&map).unwrap();
    std::fs::write(&path, &text).unwrap();
    assert_eq!(file::read(&path).unwrap(), map);
    for (wrong, what) in [
        (text.replace("\"kind\"", "\"kynd\""), "kynd"),
        (text.replacen("\"number\": 1,", "\"number\": 2,", 1), "two lanes have the number 2"),
        ("{}".into(), "no carriageway"),
        ("nothing".into(), "is not a map"),
    ] {
        std::fs::write(&path, wrong).unwrap();
        let e = file::read(&path).unwrap_err().to_string();
        assert!(e.contains(what), "{what}: {e}");
    }
    std::fs::remove_file(&path).unwrap();
    assert!(file::read(&path).is_err());
}

#[test]
fn scenarios_without_what_is_needed_are_told_so() {
    let (path, scenario) = scenario();
    let told = |scenario: &Scenario, settings: &Settings, what: &str| {
        let e = trial(&path, scenario, settings).err().map(|e| e.to_string()).unwrap_or_default();
        assert!(e.contains(what), "{what}: {e}");
    };
    let parsed = |text: &str| catseye::scene::scenario::parse(&path, text).unwrap();
    // No road and no map.
    let bare = "name = \"none\"\nradar = \"front77\"\n[[point]]\nposition_m = [30, 0, 1]\nrcs_dbsm = 10\n";
    told(&parsed(bare), &Settings::default(), "lane.hd_map.map");
    // An impulse radar tells no azimuth.
    told(&parsed(&bare.replace("front77", "uwb9")), &Settings::default(), "azimuths");
    let scene = |s: SceneTable| Settings { scene: vec![s], ..Settings::default() };
    told(&scenario, &scene(SceneTable { lanes: vec![77], ..SceneTable::default() }), "77");
    told(&scenario, &scene(SceneTable { radar_s_m: Some(390.0), ..SceneTable::default() }), "radar_s_m");
    told(
        &scenario,
        &scene(SceneTable { radar_s_m: Some(4000.0), ..SceneTable::default() }),
        "is not on the road",
    );
    told(&scenario, &scene(SceneTable { vehicles: 0, ..SceneTable::default() }), "vehicles");
    told(&parsed(bare), &scene(SceneTable::default()), "road");
    told(&scenario, &Settings { map_std_m: f64::NAN, ..Settings::default() }, "map_std_m");
    told(&scenario, &Settings { kinds: vec!["tank".into()], ..Settings::default() }, "tank");
    told(&scenario, &Settings { far_m: 10.0, ..Settings::default() }, "far_m");
    told(
        &scenario,
        &Settings { map: Some("nowhere.json".to_string().into()), ..Settings::default() },
        "nowhere.json",
    );
}
