//! Camera and radar together, through the whole chain: pictures by the tracer, tracks by the radar, and what the estimator makes of
//! them; and input that no estimator should be given.

use catseye::engine::{Engine, Precision};
use catseye::geom::Geometry;
use catseye::road::site::Site;
use catseye::scene::scenario::{Ego, EgoPlan, Scenario};
use catseye_lane::body::Body;
use catseye_lane::camera_fusion::{
    Camera, CameraFusion, FusionSetup, Image, NearSettings, Trapezoid, edges, find_near_lane, hough_lines,
};
use catseye_lane::{LaneError, LaneEstimator, LaneTrack, Measured, SensorInput};
use catseye_papers::trial::camera::{Light, View};
use catseye_papers::trial::camera_fusion::{CameraFusionOptions, CameraTable};
use catseye_papers::trial::{Drive, LaneMethod, TrialContext};
use glam::DVec3;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// A scenario on one of the road models, `ahead_m` along its lane 1.
fn scenario(road: &str, ahead_m: f64, frames: u32) -> (Scenario, PathBuf) {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("scenes/lane/test_camera.toml");
    let text = format!(
        "name = \"test\"\nseed = 3\nradar = \"front77\"\n[scene]\nroad = \"../road/{road}.toml\"\n[ego]\n\
         on_road = {{ road = \"road\", lane = 1, s_m = {ahead_m} }}\ndrive = {{ speed_mps = 5 }}\n\
         [frames]\ncount = {frames}\ninterval_s = 0.2\n[trace]\nrays = 2000\nbounces = 1\n"
    );
    let at = std::env::temp_dir().join(format!("catseye_camera_{road}_{frames}.toml"));
    let text = text.replace("../road", path.parent().unwrap().join("../road").to_str().unwrap());
    std::fs::write(&at, text).unwrap();
    (Scenario::load(&at).unwrap(), at)
}

/// The picture and the estimator's view of a road model; the true distance of both lines from where they were found, rms.
fn seen(road: &str, light: &Light) -> Result<(Image, [f64; 2]), LaneError> {
    let (scenario, _) = scenario(road, 8.0, 1);
    let site = Site::new(&scenario).unwrap();
    let engine = Engine::open("cpu", Precision::F32).unwrap();
    let drive = Drive::new(&site, &engine).unwrap();
    let geometry = Geometry::build(&site.scene, 0.0, 77e9).unwrap();
    let camera = CameraTable::default().camera();
    let view = View::new(&geometry, &site.scene, &site.scenario.ego.pose(0.0), &camera).unwrap();
    let image = view.lit(&geometry, light, 5).unwrap();
    let trapezoid = Trapezoid::of_ground(&camera, 6.0, 30.0, 6.0).unwrap();
    let begin = Instant::now();
    let found = edges(&image, &trapezoid, &NearSettings::default().edges)?;
    let after_edges = begin.elapsed().as_secs_f64();
    let lines = hough_lines(&found.edges, &NearSettings::default().hough)?;
    let after_hough = begin.elapsed().as_secs_f64();
    let begin = Instant::now();
    let lane = find_near_lane(&camera, &image, &trapezoid, &NearSettings::default());
    println!(
        "{road}: {} edges in {:.1} ms, {} straight lines in {:.1} ms, near lane in all {:.1} ms",
        found.edges.len(),
        1e3 * after_edges,
        lines.len(),
        1e3 * (after_hough - after_edges),
        1e3 * begin.elapsed().as_secs_f64()
    );
    let lane = lane?;
    let truth = drive.truth(0.0, [6.0, 30.0]);
    let mut out = [f64::NAN; 2];
    for (line, own, rms) in [(&lane.right, truth.own[0], 0), (&lane.left, truth.own[1], 1)] {
        let (Some(line), Some(own)) = (line, own) else { continue };
        let off = |p: glam::DVec2| {
            let all = truth.lines[own].windows(2).map(|w| {
                let (a, b) = (glam::DVec2::from_array(w[0]), glam::DVec2::from_array(w[1]));
                let t = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
                p.distance(a.lerp(b, t))
            });
            all.fold(f64::INFINITY, f64::min)
        };
        let e: Vec<f64> = line.curve.samples(30, 0.0).into_iter().map(off).collect();
        out[rms] = (e.iter().map(|e| e * e).sum::<f64>() / 30.0).sqrt();
    }
    Ok((image, out))
}

#[test]
fn the_tracers_picture_shows_the_lane() {
    for road in ["road_model_straight", "road_model_right_curve"] {
        let (image, [right, left]) = seen(road, &Light::CLEAR).unwrap();
        println!("{road}: right line {right:.3} m, left line {left:.3} m off (rms)");
        assert!(left < 0.05, "{road}: {left}");
        // Open: beside a kerb the paint's outer edge is set too far in or out (0.086 m on the straight road). That the line is the
        // lane's and no neighbour's is all that is asked here.
        assert!(right < 0.5, "{road}: {right}");
        // Sky above, road below, and paint brighter than the road beside it.
        let (top, bottom) = (image.row(10), image.row(380));
        let mean = |r: &[f32]| r.iter().sum::<f32>() / r.len() as f32;
        assert!(mean(top) > mean(bottom));
        let most = bottom.iter().fold(0.0f32, |a, g| a.max(*g));
        assert!(most > 2.0 * bottom[320], "{most} {}", bottom[320]);
    }
}

#[test]
fn light_blinds_the_camera() {
    // Lamps show the beads in the paint, and dense fog and a night without lamps show nothing.
    let (_, [right, _]) = seen("road_model_straight", &Light::night()).unwrap();
    assert!(right < 0.1, "{right}");
    let dark = Light { lamps: false, ..Light::night() };
    assert_eq!(seen("road_model_straight", &dark).map(|s| s.1), Err(LaneError::NoLaneLine));
    assert_eq!(seen("road_model_straight", &Light::fog(6.0)).map(|s| s.1), Err(LaneError::NoLaneLine));
}

#[test]
fn a_picture_repeats_to_the_bit_and_bad_light_is_refused() {
    let (scenario, _) = scenario("road_model_straight", 8.0, 1);
    let site = Site::new(&scenario).unwrap();
    let geometry = Geometry::build(&site.scene, 0.0, 77e9).unwrap();
    let camera = Camera {
        width_px: 96,
        height_px: 64,
        focal_px: glam::DVec2::splat(100.0),
        ..CameraTable::default().camera()
    };
    let camera = Camera { centre_px: glam::DVec2::new(48.0, 32.0), ..camera };
    let view = || View::new(&geometry, &site.scene, &site.scenario.ego.pose(0.0), &camera).unwrap();
    let (a, b) =
        (view().lit(&geometry, &Light::CLEAR, 1).unwrap(), view().lit(&geometry, &Light::CLEAR, 1).unwrap());
    assert_eq!(a, b);
    assert_ne!(a, view().lit(&geometry, &Light::CLEAR, 2).unwrap());
    let bad = Light { sun_lx: f64::NAN, ..Light::CLEAR };
    assert!(view().lit(&geometry, &bad, 1).is_err());
    assert!(view().lit(&geometry, &Light::fog(0.0), 1).is_err());
    let none = Camera { width_px: 0, ..camera.clone() };
    assert!(View::new(&geometry, &site.scene, &site.scenario.ego.pose(0.0), &none).is_err());
}

/// A short drive on the straight road: both sensors join, and camera alone ends where it sees no more.
#[test]
fn a_drive_joins_both_sensors() {
    let (scenario, path) = scenario("road_model_straight", 2.0, 14);
    let engine = Engine::open("cpu", Precision::F32).unwrap();
    let settings = CameraFusionOptions {
        conditions: vec![catseye_papers::trial::camera_fusion::Condition::Clear],
        seen_m: [6.0, 22.0],
        first_s: 2.2,
        range_m: [6.0, 45.0],
        ..CameraFusionOptions::default()
    };
    let given = TrialContext {
        scenario: &scenario,
        path: &path,
        engine: &engine,
        runs: 1,
        keep: None,
        watch: &|_, _| {},
    };
    let trial = settings.trial(&given).unwrap();
    let row = |name: &str| trial.rows.iter().find(|r| r.quantity == name).and_then(|r| r.ours);
    println!("{}", trial.markdown());
    assert_eq!(trial.steps.len(), 1);
    let step = &trial.steps[0];
    assert_eq!(step.estimate.provenance.method, "camera-fusion (camera and radar)");
    assert!(step.score.offset_error_m.unwrap().abs() < 0.1);
    assert!(step.score.heading_error_rad.unwrap().abs() < 0.01);
    let [near, ..] = step.score.lateral_m;
    assert!(near.unwrap() < 0.1, "{near:?}");
    let both = row("clear, camera and radar: F1 within 0.3 m").unwrap();
    let camera = row("clear, camera alone: F1 within 0.3 m").unwrap();
    assert!(camera < 70.0 && camera > 30.0 && both > 0.8 * camera, "{camera} {both}");
    // Standard deviations are numbers, and lines hold the doubt of the far part.
    for line in &step.estimate.lines {
        assert!(line.fitted.lateral_std_m(line.fitted.curve.length_m) < 3.0);
        assert!(line.fitted.covariance.iter().flatten().all(|c| c.is_finite()));
    }
}

#[test]
fn settings_and_scenarios_that_cannot_be() {
    for text in [
        "period_s = 0",
        "seen_m = [30, 6]",
        "conditions = []",
        "fog_visibility_m = nan",
        "camera = { height_px = 8 }",
    ] {
        let settings: CameraFusionOptions = match toml_of(text) {
            Ok(s) => s,
            Err(_) => continue,
        };
        let e = settings.check().unwrap_err().to_string();
        assert!(e.contains("lane.camera_fusion.") && e.contains("allowed"), "{e}");
    }
    let engine = Engine::open("cpu", Precision::F32).unwrap();
    let run_on = |scenario: &Scenario, path: &Path, settings: &CameraFusionOptions| {
        let given = TrialContext { scenario, path, engine: &engine, runs: 1, keep: None, watch: &|_, _| {} };
        settings.trial(&given).map(|_| ()).unwrap_err().to_string()
    };
    let (mut s, path) = scenario("road_model_straight", 2.0, 2);
    let e = run_on(&s, &path, &CameraFusionOptions::default());
    assert!(e.contains("first_s"), "{e}");
    // A camera that looks up has no trapezoid.
    let up = CameraFusionOptions {
        camera: CameraTable { pitch_deg: -30.0, ..Default::default() },
        ..CameraFusionOptions::default()
    };
    assert!(run_on(&s, &path, &up).contains("trapezoid"));
    // A vehicle beside the road.
    let at = DVec3::new(0.0, 60.0, 0.0);
    s.ego = EgoPlan::Free(Ego { position_m: at, yaw_rad: 0.0, speed_mps: 0.0, motion: None });
    s.frames.count = 1;
    let e = run_on(&s, &path, &CameraFusionOptions { first_s: 0.0, ..CameraFusionOptions::default() });
    assert!(e.contains("on_road"), "{e}");
}

fn toml_of(text: &str) -> Result<CameraFusionOptions, String> {
    #[derive(Default, serde::Deserialize, schemars::JsonSchema)]
    #[serde(default)]
    struct Lane {
        camera_fusion: CameraFusionOptions,
    }
    let name: String = text.chars().filter(|c| c.is_ascii_alphanumeric()).collect();
    let at = std::env::temp_dir().join(format!("catseye_settings_{name}.toml"));
    std::fs::write(&at, format!("[lane.camera_fusion]\n{text}\n")).unwrap();
    catseye_papers::trial::settings::<Lane>(&at).map(|l| l.camera_fusion).map_err(|e| e.to_string())
}

fn estimator() -> CameraFusion {
    CameraFusion::new(FusionSetup::new(CameraTable::default().camera())).unwrap()
}

fn grey(value: f32) -> Image {
    Image::new(640, 400, vec![value; 640 * 400]).unwrap()
}

#[test]
fn hostile_looks() {
    let speed = Some(Measured { value: 10.0, std: 0.1 });
    let mut e = estimator();
    let none = e.estimate(&SensorInput::default());
    assert!(matches!(none.no_lane, Some(LaneError::NotGiven { .. })), "{none:?}");
    let track =
        |id, x: f64, y: f64| LaneTrack { id, at_m: [x, y], std_m: [0.1, 0.1], velocity_mps: [10.0, 0.0] };
    let tracks = [track(1, 30.0, 0.0)];
    // Tracks without a speed cannot be brought together; with one there is but one point.
    let l = SensorInput { time_s: 1.0, tracks: &tracks, ..SensorInput::default() };
    assert_eq!(e.estimate(&l).no_lane, Some(LaneError::NoSpeed));
    let l = SensorInput { time_s: 2.0, speed_mps: speed, tracks: &tracks, ..SensorInput::default() };
    assert!(matches!(e.estimate(&l).no_lane, Some(LaneError::Refused { .. })));
    // Pictures that show nothing, and one of another camera.
    for (k, image) in [grey(0.0), grey(1.0), grey(0.4)].iter().enumerate() {
        let l = SensorInput {
            time_s: 3.0 + k as f64,
            speed_mps: speed,
            image: Some(image),
            ..SensorInput::default()
        };
        let got = e.estimate(&l);
        let Some(LaneError::Refused { why }) = &got.no_lane else { panic!("{got:?}") };
        assert!(why.contains(["darkness", "glare", "no visible line"][k]), "{why}");
        assert!(got.lines.is_empty() && got.confidence == 0.0);
    }
    let small = Image::new(20, 20, vec![0.5; 400]).unwrap();
    let l = SensorInput { time_s: 7.0, speed_mps: speed, image: Some(&small), ..SensorInput::default() };
    assert!(matches!(e.estimate(&l).no_lane, Some(LaneError::Refused { .. })));
    // Time that is none or runs back.
    for time_s in [f64::NAN, f64::INFINITY, 1.0] {
        let l = SensorInput { time_s, speed_mps: speed, tracks: &tracks, ..SensorInput::default() };
        assert!(matches!(e.estimate(&l).no_lane, Some(LaneError::Refused { .. })), "{time_s}");
    }
    // Tracks that are no numbers, stand in one place, drive behind, or come nearer: no lane is made of them.
    let mut e = estimator();
    for k in 0..40 {
        let t = f64::from(k) * 0.1;
        let bad = [
            LaneTrack { at_m: [f64::NAN, 0.0], ..track(1, 0.0, 0.0) },
            LaneTrack { at_m: [1e300, -1e300], ..track(2, 0.0, 0.0) },
            LaneTrack { velocity_mps: [f64::INFINITY, 0.0], ..track(3, 30.0, 0.0) },
            track(4, 30.0, 1.0),
            LaneTrack { std_m: [f64::NAN; 2], ..track(5, 30.0 + t, 0.0) },
            LaneTrack { velocity_mps: [-12.0, 0.0], ..track(6, 60.0 - 5.0 * t, 3.5) },
        ];
        for speed in [0.0, f64::NAN, 1e9] {
            let m = Some(Measured { value: speed, std: 0.0 });
            let l = SensorInput {
                time_s: t,
                speed_mps: m,
                yaw_rate_rad_per_s: m,
                tracks: &bad,
                ..SensorInput::default()
            };
            let got = e.estimate(&l);
            assert!(got.no_lane.is_some() && got.lines.is_empty(), "{got:?}");
        }
    }
}

/// Cars on a straight road whose middles are told exactly: the radar alone states the lane half a lane beside them.
#[test]
fn tracks_alone_give_a_lane() {
    let camera = CameraTable::default().camera();
    let mut e = CameraFusion::new(FusionSetup { body: None, ..FusionSetup::new(camera) }).unwrap();
    let mut last = None;
    for k in 0..40 {
        let t = 0.1 * f64::from(k);
        let at =
            |id, x: f64, y: f64| LaneTrack { id, at_m: [x, y], std_m: [0.1, 0.1], velocity_mps: [15.0, 0.0] };
        let tracks = [at(1, 30.0 + 5.0 * t, 0.3), at(2, 25.0 + 5.0 * t, 3.8)];
        let l = SensorInput {
            time_s: t,
            speed_mps: Some(Measured { value: 10.0, std: 0.1 }),
            yaw_rate_rad_per_s: Some(Measured { value: 0.0, std: 0.01 }),
            tracks: &tracks,
            ..SensorInput::default()
        };
        last = Some(e.estimate(&l));
    }
    let got = last.unwrap();
    assert_eq!(got.no_lane, None);
    assert_eq!(got.provenance.method, "camera-fusion (radar alone)");
    assert!((got.width_m.unwrap().value - 3.5).abs() < 0.05, "{got:?}");
    assert!((got.offset_m.unwrap().value + 0.3).abs() < 0.05, "{got:?}");
    assert!(got.offset_m.unwrap().std > 0.1);
    assert_eq!(e.method(), "camera-fusion");
}

#[test]
fn options_that_cannot_be() {
    let camera = CameraTable::default().camera();
    let o = FusionSetup::new(camera.clone());
    for bad in [
        FusionSetup { period_s: f64::NAN, ..o.clone() },
        FusionSetup { seen_m: [30.0, 5.0], ..o.clone() },
        FusionSetup { half_width_m: 0.0, ..o.clone() },
        FusionSetup { units: 3, ..o.clone() },
        FusionSetup { pitch_std_rad: -1.0, ..o.clone() },
        FusionSetup { axis_std_rad: f64::NAN, ..o.clone() },
        FusionSetup { radar_at_m: glam::DVec2::NAN, ..o.clone() },
        FusionSetup { body: Some(Body { width_m: 0.0, ..Body::CAR }), ..o.clone() },
        FusionSetup { least_way_m: f64::INFINITY, ..o.clone() },
        FusionSetup { camera: Camera { pitch_rad: -0.8, ..camera }, ..o },
    ] {
        assert!(CameraFusion::new(bad).is_err());
    }
}
