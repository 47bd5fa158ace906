//! Edges of the lanes by the shipped network, end to end: a road through the whole chain, points into the estimator.

use catseye::detect::grid::PointGrid;
use catseye::engine::{Engine, Precision};
use catseye::road::mask::Grid;
use catseye::road::site::Site;
use catseye::scene::scenario::Scenario;
use catseye_lane::LaneEstimator;
use catseye_lane::SensorInput;
use catseye_lane::segmentation::{RadarMount, SegmentationOptions};
use catseye_learn::lane::Segmentation;
use catseye_learn::scan::Scan;
use catseye_papers::trial::{Drive, LaneMethod, LaneTable, Trial, TrialContext};
use glam::{DVec2, DVec3};
use std::path::{Path, PathBuf};

/// A road of two lanes with a rail between them and one at its right edge, on an arc of this radius; the radar is the one
/// from whose points the network learned.
fn write(dir: &Path, radius_m: f64, lane: &str) -> PathBuf {
    let road = format!(
        "name = \"bend\"\n[[road]]\nname = \"road\"\nplan = [{{ kind = \"arc\", length_m = 160, radius_m = {radius_m} }}]\n\
         left = [{{ number = 10, kind = \"median\", width_m = 0.8 }}, {{ number = 11, width_m = 3.5, line = \"solid\" }}]\n\
         right = [{{ number = 0, kind = \"median\", width_m = 0.8 }}, {{ number = 1, width_m = 3.5, line = \"solid\" }}]\n\
         verge = [{{ side = \"left\", width_m = 10 }}, {{ side = \"right\", width_m = 10 }}]\n\
         [[road.rail]]\nlateral = {{ t_m = 0 }}\nfaces = \"right\"\n\
         [[road.rail]]\nlateral = {{ edge = \"right\", offset_m = -1.0 }}\nfaces = \"left\"\n"
    );
    std::fs::write(dir.join("road.toml"), road).unwrap();
    let radar = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/recipes/learning_radar.toml");
    std::fs::copy(radar, dir.join("radar.toml")).unwrap();
    let path = dir.join("scenario.toml");
    let text = format!(
        "name = \"bend\"\nseed = 3\nradar = \"radar.toml\"\n[scene]\nroad = \"road.toml\"\n\
         [ego]\nspeed_mps = 12\non_road = {{ lane = 1, s_m = 10 }}\n\
         [frames]\ncount = 2\ninterval_s = 0.5\n[trace]\nbounces = 2\nrays = 4000\n{lane}"
    );
    std::fs::write(&path, text).unwrap();
    path
}

fn trial(path: &Path) -> catseye::Result<Trial> {
    let scenario = Scenario::load(path)?;
    let engine = Engine::open("cpu", Precision::F32)?;
    let given =
        TrialContext { scenario: &scenario, path, engine: &engine, runs: 1, keep: None, watch: &|_, _| {} };
    LaneTable::load(path)?.segmentation.trial(&given)
}

/// The left edge, along which a rail stands, is found in a left and in a right bend: at 35 m ahead the two lie 6.2 m apart, so
/// no constant lane of up to 4 m width has both within a metre.
#[test]
fn edges_follow_the_bend_to_its_own_side() {
    let dir = tempfile::tempdir().unwrap();
    for radius_m in [200.0, -200.0] {
        let trial = trial(&write(dir.path(), radius_m, "")).unwrap();
        assert_eq!(trial.steps.len(), 2);
        for step in &trial.steps {
            let (e, t) = (&step.estimate, &step.truth);
            assert_eq!(t.lines.len(), 2, "a region has two edges");
            let left = &t.lines[t.own[1].unwrap()];
            let off = |p: &[f64; 2]| (p[0] - 35.0).abs();
            let there = left.iter().min_by(|a, b| off(a).total_cmp(&off(b))).unwrap();
            assert!(off(there) < 1.0 && (there[1] > 0.0) == (radius_m > 0.0), "{there:?}");
            let places = e.lines.iter().flat_map(|l| l.fitted.curve.sample(0.25));
            let near = places.map(|p| p.distance(DVec2::from_array(*there))).fold(f64::INFINITY, f64::min);
            assert!(near < 1.0, "{radius_m} {}: {near} m, {:?}", step.frame, e.no_lane);
        }
    }
}

/// The cells that the estimator makes of its points are those of the frame's own grid, from which the network learned, and
/// nothing that a simulation knows of a point changes the estimate.
#[test]
fn the_network_sees_the_grid_of_the_frame_and_no_truth() {
    let dir = tempfile::tempdir().unwrap();
    let path = write(dir.path(), 400.0, "");
    let site = Site::new(&Scenario::load(&path).unwrap()).unwrap();
    let engine = Engine::open("cpu", Precision::F32).unwrap();
    let drive = Drive::new(&site, &engine).unwrap();
    let mut frame = drive.frame(0, 0).unwrap();
    let pose = drive.radar(0).mounting;
    let ahead = pose.rotation * DVec3::X;
    let mount = RadarMount { at_m: pose.translation_m.truncate(), yaw_rad: ahead.y.atan2(ahead.x) };
    let mut method = Segmentation::open(dir.path(), &SegmentationOptions::default(), mount).unwrap();
    let points = drive.points(&frame);
    let seen = method.scan(&points);
    let grid = Scan::new(&PointGrid::new(Grid::ROAD, &frame.points, &frame.pose));
    assert!(seen.cells.len() > 10, "{}", seen.cells.len());
    assert_eq!(seen.cells.len(), grid.cells.len());
    for (a, b) in seen.cells.iter().zip(&grid.cells) {
        assert_eq!((a.cell, a.count), (b.cell, b.count));
        assert!((a.amplitude - b.amplitude).abs() < 0.02, "{a:?} {b:?}");
        assert!((a.range_m - b.range_m).abs() < 1e-4 && (a.azimuth_rad - b.azimuth_rad).abs() < 0.02);
    }
    let before = method.estimate(&SensorInput { points: &points, ..SensorInput::default() });
    for p in &mut frame.points {
        (p.object_id, p.class, p.ghost) = (77, "wall".into(), !p.ghost);
        (p.bounces, p.share, p.side_lobe) = (9, 0.5, !p.side_lobe);
    }
    let points = drive.points(&frame);
    let after = method.estimate(&SensorInput { points: &points, ..SensorInput::default() });
    assert_eq!(before, after);
}

/// A network that is not there is one error of the scenario, with the names that there are.
#[test]
fn a_network_that_is_not_there_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let path = write(dir.path(), 400.0, "[lane.segmentation]\nweights = \"nets/none\"\n");
    let e = trial(&path).unwrap_err();
    let text = e.to_string();
    assert_eq!(e.exit_code(), 2);
    assert!(text.contains("none") && text.contains("a trained network") && text.contains("road"), "{text}");
    assert_eq!(text.lines().count(), 1);
}
