//! Rows of markers from the whole chain, and what the estimator does with input that makes no sense.

use catseye::engine::{Engine, Precision};
use catseye::scene::scenario::Scenario;
use catseye_lane::markers::{MarkerPattern, MarkerSearch, Markers};
use catseye_lane::{LaneError, LaneEstimator, LanePoint, Measured, SensorInput};
use catseye_papers::trial::markers::MarkersOptions;
use catseye_papers::trial::{LaneMethod, Trial, TrialContext};
use std::path::{Path, PathBuf};

fn scenes() -> PathBuf {
    // In the crate, or beside its sources.
    let here = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    here.join("scenes/lane")
}

fn tried(path: &Path, frames: u32, settings: &MarkersOptions) -> catseye::base::error::Result<Trial> {
    let mut scenario = Scenario::load(path)?;
    scenario.frames.count = frames;
    let engine = Engine::open("cpu", Precision::F32)?;
    let watch = &|_, _| ();
    settings.trial(&TrialContext { scenario: &scenario, path, engine: &engine, runs: 1, keep: None, watch })
}

fn written(name: &str, text: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("catseye_lane_markers_{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path
}

fn ours(trial: &Trial, quantity: &str) -> f64 {
    let row = trial.rows.iter().find(|r| r.quantity.starts_with(quantity));
    row.and_then(|r| r.ours).unwrap_or_else(|| panic!("no '{quantity}' in {:?}", trial.rows))
}

/// The lane of fig. 5.1 through the whole chain: two rows 3 m apart, the speed from the points, and no lane that is not there.
#[test]
fn the_marked_lane_is_found_from_echoes() {
    let settings = MarkersOptions {
        spacing_m: vec![2.0],
        missing_share: vec![],
        extra_points: vec![],
        ..MarkersOptions::default()
    };
    let trial = tried(&scenes().join("markers_fig_5_1.toml"), 4, &settings).unwrap();
    assert_eq!(ours(&trial, "looks with a lane"), 100.0);
    // The first look has seen no marker of one row within 14 m, and says how little it knows of the width beside the vehicle.
    let widths: Vec<_> = trial.steps.iter().filter_map(|s| s.estimate.width_m).collect();
    assert_eq!(widths.len(), 4);
    for w in &widths {
        assert!((w.value - 3.0).abs() < 2.0 * w.std && w.std < 0.6, "{widths:?}");
    }
    assert!((widths[3].value - 3.0).abs() < 0.1 && widths[3].std < 0.3, "{widths:?}");
    assert!(ours(&trial, "offset error (rms)") < 0.2);
    assert!(ours(&trial, "ego speed from the points") < 0.01);
    assert!(ours(&trial, "of the markers with a point those that a line has") > 80.0);
    assert!(ours(&trial, "members of lines that are markers") > 80.0);
    assert!(trial.pictures.len() >= 10);
    // Markers at another spacing than theirs are none.
    let other = MarkersOptions { spacing_m: vec![3.3], tolerance_m: 0.1, ..settings };
    let trial = tried(&scenes().join("markers_fig_5_1.toml"), 1, &other).unwrap();
    let found = trial.rows.iter().find(|r| r.quantity.starts_with("recall of lines")).and_then(|r| r.ours);
    assert!(found.is_none_or(|f| f < 30.0), "{found:?}");
}

/// A scene without markers: told so where the spacing is not given, and no lane where it is.
#[test]
fn scenes_without_markers() {
    let path = written(
        "empty.toml",
        "name = \"empty\"\nradar = \"demo77\"\n[[point]]\nposition_m = [20, 3, 0.5]\nrcs_dbsm = 10\n[ego]\nspeed_mps = 5\n[frames]\ncount = 1\n",
    );
    let e = tried(&path, 1, &MarkersOptions::default()).unwrap_err().to_string();
    assert!(e.contains("lane.markers.spacing_m") && e.contains("[[road.markers]]"), "{e}");
    let given = MarkersOptions { spacing_m: vec![2.0], ..MarkersOptions::default() };
    let trial = tried(&path, 1, &given).unwrap();
    assert!(trial.steps.iter().all(|s| s.estimate.no_lane.is_some() && s.estimate.lines.is_empty()));
    let again = tried(&path, 1, &given).unwrap();
    assert_eq!(trial.markdown(), again.markdown());
}

#[test]
fn settings_say_what_is_wrong() {
    let wrong = [
        (MarkersOptions { spacing_m: vec![-1.0], ..MarkersOptions::default() }, "spacing_m[0] = -1"),
        (
            MarkersOptions { spacing_m: vec![2.0], tolerance_m: 1.5, ..MarkersOptions::default() },
            "tolerance_m = 1.5",
        ),
        (MarkersOptions { reach_m: [20.0, 10.0], ..MarkersOptions::default() }, "reach_m = 10"),
        (MarkersOptions { missing_share: vec![2.0], ..MarkersOptions::default() }, "missing_share[0] = 2"),
        (
            MarkersOptions { bus_speed_std_mps: Some(f64::NAN), ..MarkersOptions::default() },
            "bus_speed_std_mps",
        ),
    ];
    for (settings, what) in wrong {
        let e = settings.check().unwrap_err().to_string();
        assert!(e.contains(what) && e.contains("allowed"), "{e}");
    }
    MarkersOptions::default().check().unwrap();
}

fn point(x: f64, y: f64) -> LanePoint {
    let range_m = x.hypot(y);
    LanePoint {
        at_m: [x, y],
        std_m: [0.02, 0.05],
        range_rate_mps: -10.0 * y.atan2(x).cos(),
        range_rate_std_mps: 0.01,
        range_m,
        azimuth_rad: y.atan2(x),
        rcs_dbsm: -10.0,
        snr_db: 20.0,
        power_dbm: None,
    }
}

fn rows(from_m: f64) -> Vec<LanePoint> {
    let at = |k: usize| from_m + 2.0 * k as f64;
    (0..10).flat_map(|k| [point(at(k), 1.5), point(at(k), -1.5)]).collect()
}

fn look(points: &[LanePoint], time_s: f64) -> SensorInput<'_> {
    let speed_mps = Some(Measured { value: 10.0, std: 0.05 });
    SensorInput { time_s, speed_mps, points, ..SensorInput::default() }
}

#[test]
fn hostile_looks_have_a_reason_and_no_lane() {
    let fresh = || Markers::new(MarkerSearch::default());
    let why = |l: &SensorInput<'_>| {
        let e = fresh().estimate(l);
        assert!(e.no_lane.is_none() != e.lines.is_empty());
        e.no_lane
    };
    assert_eq!(why(&SensorInput::default()), Some(LaneError::Empty));
    let one = point(10.0, 1.5);
    assert_eq!(why(&look(&[one], 0.0)), Some(LaneError::NoPattern { at_rest: 1 }));
    let nan = LanePoint { at_m: [f64::NAN, 0.0], range_rate_mps: f64::INFINITY, ..one };
    assert_eq!(why(&look(&[nan; 9], 0.0)), Some(LaneError::NotFinite { points: 9 }));
    assert!(why(&SensorInput { speed_mps: None, ..look(&[one, one], 0.0) }).is_some());
    // No numbers among the sound ones do no harm.
    let mut some = rows(6.0);
    some.extend([nan; 5]);
    assert_eq!(why(&look(&some, 0.0)), None);
    // A speed that is no number is as good as none.
    let speed_mps = Some(Measured { value: f64::NAN, std: 1.0 });
    assert_eq!(why(&SensorInput { speed_mps, ..look(&rows(6.0), 0.0) }), None);
    // Standing still, and behind.
    let still: Vec<LanePoint> =
        rows(6.0).into_iter().map(|p| LanePoint { range_rate_mps: 0.0, ..p }).collect();
    let speed_mps = Some(Measured { value: 0.0, std: 0.01 });
    assert_eq!(why(&SensorInput { speed_mps, ..look(&still, 0.0) }), None);
    fresh().estimate(&look(&rows(-40.0), 0.0));
    // A crowd, all of one place, and rubbish in every field.
    assert!(why(&look(&vec![one; 400], 0.0)).is_some());
    let rubbish = LanePoint { std_m: [-1.0, 1e9], range_m: -3.0, rcs_dbsm: f64::NAN, ..one };
    fresh().estimate(&look(&[rubbish; 30], f64::NAN));
    // Without a pattern to look for.
    let none = Markers::new(MarkerSearch { patterns: Vec::new(), ..MarkerSearch::default() })
        .estimate(&look(&rows(6.0), 0.0));
    assert!(matches!(none.no_lane, Some(LaneError::NotGiven { .. })));
}

/// Lines go on for a while when a look fails, and not for long; time that runs back starts anew.
#[test]
fn lines_are_followed_over_looks_that_fail() {
    let mut m = Markers::new(MarkerSearch::default());
    for k in 0..4 {
        let t = 0.1 * f64::from(k);
        let e = m.estimate(&look(&rows(9.0 - 10.0 * t), t));
        assert_eq!(e.lines.len(), 2, "{k} {:?}", e.no_lane);
        assert!((e.width_m.unwrap().value - 3.0).abs() < 0.05);
    }
    // Points that stand but are no row keep the motion known.
    let few = [point(7.0, 4.0), point(12.0, -5.0), point(18.0, 3.0), point(25.0, -6.0)];
    let e = m.estimate(&look(&few, 0.4));
    assert_eq!(e.lines.len(), 2);
    assert!(e.lines.iter().all(|l| l.members.is_empty() && l.confidence < 1.0));
    let e = m.estimate(&look(&few, 1.2));
    assert!(e.lines.is_empty() && e.no_lane.is_some());
    let e = m.estimate(&look(&rows(9.0), 0.0));
    assert_eq!(e.lines.len(), 2);
}

#[test]
fn two_spacings_at_once() {
    let at = |k: usize, d: f64| 6.0 + d * k as f64;
    let points: Vec<LanePoint> =
        (0..12).map(|k| point(at(k, 1.5), 1.75)).chain((0..9).map(|k| point(at(k, 2.0), -1.75))).collect();
    let of = |spacing_m: f64| MarkerPattern { spacing_m, ..MarkerPattern::default() };
    let both = MarkerSearch { patterns: vec![of(1.5), of(2.0)], ..MarkerSearch::default() };
    let e = Markers::new(both).estimate(&look(&points, 0.0));
    assert_eq!(e.lines.len(), 2, "{:?}", e.no_lane);
    assert!((e.width_m.unwrap().value - 3.5).abs() < 0.05);
}
