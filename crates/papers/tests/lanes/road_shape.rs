//! Road shape end to end: files of `scenes/lane` through the whole chain, and the estimator on what no radar should give.

use catseye::base::rng::Draws;
use catseye::engine::{Engine, Precision};
use catseye::scene::scenario::Scenario;
use catseye_lane::road_shape::image::{Angles, ImageSettings, Imager};
use catseye_lane::road_shape::{RoadShapeEstimator, RoadShapeSetup};
use catseye_lane::{LaneError, LaneEstimator, LanePoint, Measured, SensorInput};
use catseye_papers::trial::road_shape::{RoadShapeOptions, Task};
use catseye_papers::trial::{LaneMethod, Trial, TrialContext};
use std::path::{Path, PathBuf};

fn scene(name: &str) -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("scenes/lane").join(name)
}

fn cpu() -> Engine {
    Engine::open("cpu", Precision::F32).unwrap()
}

/// A file's trial, cut down; `quick` changes its scenario.
fn trial(
    name: &str,
    settings: &RoadShapeOptions,
    runs: u32,
    keep: Option<PathBuf>,
    quick: impl FnOnce(&mut Scenario),
) -> catseye::Result<Trial> {
    let path = scene(name);
    let mut scenario = Scenario::load(&path)?;
    quick(&mut scenario);
    let engine = cpu();
    let given =
        TrialContext { scenario: &scenario, path: &path, engine: &engine, runs, keep, watch: &|_, _| {} };
    settings.trial(&given)
}

fn quick(frames: u32) -> impl FnOnce(&mut Scenario) {
    move |s| {
        s.frames.count = frames;
        // The corner between a panel and its post takes two.
        (s.trace.bounces, s.trace.most_bounces) = (2, 0);
        s.trace.floor_db = Some(-10.0);
    }
}

fn row(trial: &Trial, name: &str) -> f64 {
    let found = trial.rows.iter().find(|r| r.quantity.starts_with(name));
    found.and_then(|r| r.ours).unwrap_or_else(|| panic!("no {name} in\n{}", trial.markdown()))
}

#[test]
fn wall_and_barrier_are_found_and_the_report_repeats() {
    let settings = RoadShapeOptions { picture_frame: Some(3), ..RoadShapeOptions::default() };
    let keep = std::env::temp_dir().join(format!("catseye-road-shape-{}", std::process::id()));
    std::fs::create_dir_all(&keep).unwrap();
    let first = trial("road_shape_wall.toml", &settings, 1, Some(keep.clone()), quick(4)).unwrap();
    // An edge needs three scans.
    assert_eq!(first.steps.iter().map(|s| s.estimate.lines.len()).collect::<Vec<_>>(), [0, 0, 2, 2]);
    for side in ["right", "left"] {
        for (x, most_m) in [(20, 0.3), (40, 0.4)] {
            let error = row(&first, &format!("{side} edge, lateral error at {x} m"));
            assert!(error < most_m, "{side} {x}: {error}");
        }
    }
    // The left wall is 3.3 m, the barrier 7.6 m beside the vehicle, and the road is straight.
    let last = &first.steps[3].estimate;
    let width = last.width_m.unwrap();
    assert!((width.value - 10.9).abs() < 0.4 && width.std < 0.3, "{width:?}");
    assert!(last.curvature_per_m.unwrap().value.abs() < 3e-4, "{:?}", last.curvature_per_m);
    assert!(last.heading_rad.is_none(), "the model has none");
    assert_eq!(row(&first, "static points that are on moving vehicles"), 0.0);
    let names: Vec<&str> = first.pictures.iter().map(|p| p.0.as_str()).collect();
    assert_eq!(names, ["image", "votes", "road", "curvature"]);
    // From what was kept, and from nothing: the same.
    let again = trial("road_shape_wall.toml", &settings, 1, Some(keep.clone()), quick(4)).unwrap();
    assert_eq!(first.markdown(), again.markdown());
    assert_eq!(first.sheets, again.sheets);
    for (a, b) in first.pictures.iter().zip(&again.pictures) {
        assert_eq!(a.1.png().unwrap(), b.1.png().unwrap(), "{}", a.0);
    }
    std::fs::remove_dir_all(&keep).unwrap();
    let fresh = trial("road_shape_wall.toml", &settings, 1, None, quick(4)).unwrap();
    assert_eq!(first.markdown(), fresh.markdown());
}

#[test]
fn of_the_bend_only_the_right_edge_is_there() {
    // On the arc: the bend begins 90 m along the road.
    let settings = RoadShapeOptions {
        c1_walk: 2e-5,
        max_range_m: 80.0,
        confirm_scans: 1,
        ..RoadShapeOptions::default()
    };
    let t = trial("road_shape_bend.toml", &settings, 1, None, |s| {
        quick(3)(s);
        if let Some(on) = s.ego.on_road_mut() {
            on.s_m = 95.0;
        }
    })
    .unwrap();
    for s in &t.steps {
        assert_eq!(s.estimate.lines.len(), 1, "{:?}", s.estimate.no_lane);
        let line = &s.estimate.lines[0].fitted.curve;
        assert!(line.start_m[1] < -2.0, "{line:?}");
    }
    let end = &t.steps[2];
    let (c, truth) = (end.estimate.curvature_per_m.unwrap(), end.truth.curvature_per_m.unwrap());
    // The axis has 1/160, the wall 5 m outside it less.
    assert!((truth - 1.0 / 164.7).abs() < 1e-4, "{truth}");
    assert!((c.value - truth).abs() < 0.15 * truth && c.std < 0.3 * truth, "{c:?} {truth}");
}

#[test]
fn music_and_esprit_part_what_a_beam_does_not() {
    let settings = RoadShapeOptions { task: Task::Corners, subarray: 4, ..RoadShapeOptions::default() };
    let t = trial("road_shape_corners.toml", &settings, 12, None, |_| {}).unwrap();
    for way in ["MUSIC", "Bi-SVD MUSIC", "ESPRIT"] {
        assert_eq!(row(&t, &format!("{way}: both reflectors separated")), 100.0);
        let error_deg = row(&t, &format!("{way}: error of a direction"));
        assert!(error_deg < 0.3, "{way} {error_deg}");
    }
    assert_eq!(row(&t, "beamforming: both reflectors separated"), 0.0);
    assert!(row(&t, "Bi-SVD: multiplications") < 0.5 * row(&t, "decomposition: multiplications"));
    // Three reflectors are another question.
    let e = trial("road_shape_corners.toml", &settings, 1, None, |s| s.objects.push(s.objects[0].clone()));
    assert_eq!(e.unwrap_err().exit_code(), 2);
}

#[test]
fn scenes_without_edges_and_radars_without_slopes() {
    let empty = |s: &mut Scenario| {
        s.frames.count = 2;
        s.objects.truncate(1);
    };
    // A single reflector is no edge.
    let t = trial("road_shape_corners.toml", &RoadShapeOptions::default(), 1, None, empty).unwrap();
    assert!(
        t.steps.iter().all(|s| s.estimate.no_lane.is_some() && s.score.recall.is_none()),
        "{:?}",
        t.steps
    );
    assert!(t.notes.iter().any(|n| n.contains("nothing to detect")), "{:?}", t.notes);
    // Its one slope gives no image; its points serve.
    let one_slope = |s: &mut Scenario| {
        empty(s);
        s.radars = vec![s.radars[0].part(0)];
        s.radars[0].waveform = catseye::scene::waveform::Waveform::chirp(200e6, 1e-3, 1.1e-3);
    };
    let image = RoadShapeOptions {
        source: catseye_papers::trial::road_shape::Source::Image,
        ..RoadShapeOptions::default()
    };
    let e = trial("road_shape_corners.toml", &image, 1, None, one_slope).unwrap_err();
    assert_eq!(e.exit_code(), 2, "{e}");
    let t = trial("road_shape_corners.toml", &RoadShapeOptions::default(), 1, None, one_slope).unwrap();
    assert!(t.steps.iter().all(|s| s.estimate.no_lane.is_some()));
}

#[test]
fn settings_name_what_is_wrong() {
    let bad = |change: fn(&mut RoadShapeOptions)| {
        let mut s = RoadShapeOptions::default();
        change(&mut s);
        let e = s.check().unwrap_err();
        assert_eq!(e.exit_code(), 2);
        e.to_string()
    };
    assert!(bad(|s| s.forgetting = 1.0).contains("lane.road_shape.forgetting"));
    assert!(bad(|s| s.sources = 0).contains("sources"));
    assert!(bad(|s| s.gate_floor_mps = f64::NAN).contains("gate_floor_mps"));
    assert!(bad(|s| s.to_m = s.from_m).contains("to_m"));
    assert!(bad(|s| s.max_range_m = -1.0).contains("max_range_m"));
    RoadShapeOptions::default().check().unwrap();
    let path = scene("road_shape_wall.toml");
    let radar = Scenario::load(&path).unwrap().radars.remove(0);
    let many = ImageSettings { sources: 5, ..ImageSettings::default() };
    assert!(Imager::new(&radar, &many).is_err(), "five sources and five channels");
    let off = ImageSettings { subarray: 6, angles: Angles::Music, ..ImageSettings::default() };
    assert!(Imager::new(&radar, &off).is_err());
}

fn estimator() -> RoadShapeEstimator {
    RoadShapeEstimator::new(RoadShapeSetup::default()).unwrap()
}

/// A point at rest as a vehicle of 20 m/s sees it.
fn at_rest(x: f64, y: f64) -> LanePoint {
    let (range_m, azimuth_rad) = (x.hypot(y), y.atan2(x));
    LanePoint {
        at_m: [x, y],
        std_m: [0.1, 0.005 * range_m],
        range_rate_mps: -20.0 * azimuth_rad.cos(),
        range_rate_std_mps: 0.05,
        range_m,
        azimuth_rad,
        rcs_dbsm: 0.0,
        snr_db: 30.0,
        power_dbm: None,
    }
}

fn look(points: &[LanePoint], time_s: f64, speed_mps: f64) -> SensorInput<'_> {
    let speed_mps = Some(Measured { value: speed_mps, std: 0.1 });
    SensorInput { time_s, speed_mps, points, ..SensorInput::default() }
}

#[test]
fn points_of_any_source_give_the_curve() {
    // An arc of 400 m to the left, 5 m to the right of the vehicle, from 8 m on.
    let points: Vec<LanePoint> = (0..18)
        .map(|i| {
            let t = (8.0 + 4.0 * f64::from(i)) / 405.0;
            at_rest(405.0 * t.sin(), -5.0 + 405.0 * (1.0 - t.cos()))
        })
        .collect();
    let mut e = estimator();
    let mut last = e.estimate(&look(&points, 0.0, 20.0));
    assert!(matches!(last.no_lane, Some(LaneError::Refused { .. })), "{last:?}");
    for k in 1..6 {
        last = e.estimate(&look(&points, 0.1 * f64::from(k), 20.0));
    }
    let c = last.curvature_per_m.unwrap();
    assert!((c.value - 1.0 / 405.0).abs() < 2e-4, "{c:?}");
    assert_eq!(last.lines.len(), 1);
    assert!(last.lines[0].members.len() >= 14, "{:?}", last.lines[0].members);
    assert!((0.0..=1.0).contains(&last.confidence) && last.confidence > 0.3);
    // What is no longer seen coasts, and then goes.
    let car = [LanePoint { range_rate_mps: 0.0, ..at_rest(30.0, 0.0) }];
    let next = e.estimate(&look(&car, 0.7, 20.0));
    assert!(next.lines.len() == 1 && next.confidence < last.confidence, "{next:?}");
    let gone = e.estimate(&look(&car, 6.0, 20.0));
    assert_eq!(gone.no_lane, Some(LaneError::NothingAtRest));
}

#[test]
fn nothing_is_invented() {
    let rail: Vec<LanePoint> = (0..15).map(|i| at_rest(8.0 + 4.0 * f64::from(i), -5.0)).collect();
    let no_lane = |points: &[LanePoint], look: SensorInput<'_>| {
        let mut e = estimator();
        let mut last = None;
        for k in 0..5 {
            let found = e.estimate(&SensorInput { points, time_s: look.time_s + 0.1 * f64::from(k), ..look });
            assert!(found.lines.is_empty() && found.confidence == 0.0, "{found:?}");
            last = found.no_lane;
        }
        last.expect("a reason")
    };
    let at = |v: f64| look(&[], 0.0, v);
    assert_eq!(no_lane(&[], at(20.0)), LaneError::Empty);
    let nan = LanePoint { at_m: [f64::NAN, 1.0], ..rail[0] };
    assert_eq!(no_lane(&[nan; 20], at(20.0)), LaneError::NotFinite { points: 20 });
    assert_eq!(no_lane(&rail, SensorInput::default()), LaneError::NoSpeed);
    assert_eq!(no_lane(&rail, at(f64::NAN)), LaneError::NoSpeed);
    assert!(matches!(no_lane(&rail[..1], at(20.0)), LaneError::Refused { .. }));
    // At rest all of it moves.
    assert_eq!(no_lane(&rail, at(0.0)), LaneError::NothingAtRest);
    let behind: Vec<LanePoint> = (0..15).map(|i| at_rest(-8.0 - 4.0 * f64::from(i), -5.0)).collect();
    assert!(matches!(no_lane(&behind, at(20.0)), LaneError::Refused { .. }));
    let one_place = vec![at_rest(30.0, -5.0); 30];
    assert!(matches!(no_lane(&one_place, at(20.0)), LaneError::Refused { .. }));
    let wrong: Vec<LanePoint> = rail.iter().map(|p| LanePoint { std_m: [-1.0, 0.1], ..*p }).collect();
    assert_eq!(no_lane(&wrong, at(20.0)), LaneError::NothingAtRest);
    // A look from the past, and a time that is none.
    let mut e = estimator();
    e.estimate(&look(&rail, 5.0, 20.0));
    assert!(matches!(e.estimate(&look(&rail, 4.0, 20.0)).no_lane, Some(LaneError::Refused { .. })));
    assert!(matches!(e.estimate(&look(&rail, f64::NAN, 20.0)).no_lane, Some(LaneError::Refused { .. })));
    // The vehicle stands, and a wall stands beside it: that is an edge.
    let still: Vec<LanePoint> = rail.iter().map(|p| LanePoint { range_rate_mps: 0.0, ..*p }).collect();
    let mut e = estimator();
    let found = (0..4).map(|k| e.estimate(&look(&still, 0.1 * f64::from(k), 0.0))).last().unwrap();
    assert_eq!(found.lines.len(), 1);
}

/// Scattered points show an edge in one scan of a hundred at most, and in three scans in a row hardly ever.
#[test]
fn scattered_points_are_no_edge() {
    let mut draws = Draws::new(7, 1);
    let mut found = 0;
    for _ in 0..60 {
        let mut e = estimator();
        for k in 0..4 {
            let points: Vec<LanePoint> = (0..40)
                .map(|_| at_rest(5.0 + 75.0 * draws.uniform(), 40.0 * (draws.uniform() - 0.5)))
                .collect();
            found += e.estimate(&look(&points, 0.1 * f64::from(k), 20.0)).lines.len();
        }
    }
    assert_eq!(found, 0);
}
