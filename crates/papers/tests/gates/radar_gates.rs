//! The whole chain on every engine: from a scene to points, with the right place, sign and level.

use catseye::adc::synthesis::EchoSummary;
use catseye::base::control::Control;
use catseye::base::frames::{Pose, Sensor, World, direction_from_angles};
use catseye::detect::Point;
use catseye::detect::{Bodies, label, locate};
use catseye::engine::{AnyCube, Engine, Precision};
use catseye::geom::Geometry;
use catseye::gpu::compare::opened_for_tests;
use catseye::road::reflector::Reflector;
use catseye::scene::radar::{Pattern, Radar, Window};
use catseye::scene::{Scene, Shape, material, radar_toml};
use catseye::trace::{Echoes, TraceOptions};
use catseye_papers::validate::GROUPS;
use glam::DVec3;
use num_complex::Complex64;

/// f64 first: it is the truth for the others.
fn engines() -> Vec<Engine> {
    vec![Engine::Cpu(Precision::F64), Engine::Cpu(Precision::F32), Engine::Gpu(Box::new(opened_for_tests()))]
}

/// The small front radar with one row of transmitters raised, so that it sees elevation.
fn radar() -> Radar {
    let mut radar = radar_toml::preset("demo77").unwrap();
    (radar.chirps, radar.processing.doppler_fft) = (64, 64);
    radar.tx[1].position_m.z += 0.5 * radar.wavelength_m();
    for a in radar.tx.iter_mut().chain(&mut radar.rx) {
        a.pattern = Pattern::Isotropic;
    }
    radar.processing.angle_window = Window::Rectangle;
    (radar.processing.elevation_bins, radar.processing.elevation_fov_rad) = (33, 1.0);
    radar
}

struct Run {
    echoes: Echoes,
    echo_summary: EchoSummary,
    cube: Vec<Complex64>,
    points: Vec<Point>,
}

fn run(engine: &Engine, radar: &Radar, scene: &Scene, pose: &Pose<Sensor, World>, velocity: DVec3) -> Run {
    let geometry = Geometry::build(scene, 0.0, radar.carrier_hz).unwrap();
    let echoes = engine.trace(&geometry, radar, pose, velocity, &TraceOptions::default()).unwrap();
    let (cube, echo_summary) = engine.cube(radar, &echoes, &[], 9, 2, Control::default()).unwrap();
    let found = engine.range_doppler(radar, &cube).unwrap();
    let mut points = locate::points(engine, radar, &mut [found], None).unwrap();
    label::label(radar, &mut points, &echoes, &Bodies::new(scene, 0.0, pose)).unwrap();
    let cube = match cube {
        AnyCube::F32(c) => c.to_f64().data,
        AnyCube::F64(c) => c.data,
    };
    Run { echoes, echo_summary, cube, points }
}

fn relative_l2(got: &[Complex64], want: &[Complex64]) -> f64 {
    assert_eq!(got.len(), want.len());
    let wrong: f64 = got.iter().zip(want).map(|(a, b)| (a - b).norm_sqr()).sum();
    (wrong / want.iter().map(|z| z.norm_sqr()).sum::<f64>()).sqrt()
}

/// A radar that looks along neither axis.
fn pose() -> Pose<Sensor, World> {
    Pose::from_yaw_pitch_roll(DVec3::new(12.0, -3.0, 0.6), 0.4, -0.05, 0.02)
}

fn add_point(scene: &mut Scene, at: DVec3, velocity: DVec3, rcs_dbsm: f64) -> u32 {
    let pose = Pose::from_yaw_pitch_roll(at, 0.0, 0.0, 0.0);
    scene.add_object("post", "post", Shape::Point { rcs_dbsm }, pose, velocity)
}

#[test]
fn points_are_where_they_are_put() {
    let (radar, pose) = (radar(), pose());
    let mut scene = Scene::default();
    // Range, azimuth and elevation in degrees, range rate: left and right, high and low, going and coming.
    let places = [
        (11.3, 0.0, 0.0, 0.0),
        (15.1, 25.0, 10.0, 6.0),
        (18.7, -25.0, 10.0, -6.0),
        (22.9, 25.0, -10.0, -13.0),
        (27.2, -25.0, -10.0, 13.0),
        (33.8, 48.0, 0.0, 2.5),
    ];
    for (range, azimuth, elevation, rate) in places {
        let u = pose.direction(direction_from_angles(f64::to_radians(azimuth), f64::to_radians(elevation)));
        add_point(&mut scene, pose.translation_m + u * range, u * rate, 10.0);
    }
    let mut truth: Option<Run> = None;
    for engine in engines() {
        let name = engine.describe();
        let r = run(&engine, &radar, &scene, &pose, DVec3::ZERO);
        assert_eq!((r.echoes.list.len(), r.echo_summary.dropped, r.echo_summary.moving), (6, 0, 5), "{name}");
        for (i, (range, azimuth, elevation, rate)) in places.into_iter().enumerate() {
            let id = i as u32 + 1;
            let p = r
                .points
                .iter()
                .filter(|p| p.object_id == id)
                .max_by(|a, b| a.power_dbm.total_cmp(&b.power_dbm))
                .unwrap_or_else(|| panic!("{name}: object {id} has no point"));
            let (a, e) = (p.azimuth_rad.to_degrees(), p.elevation_rad.to_degrees());
            println!(
                "{name}, {id}: {:.3} m {:.2} m/s {a:.2} {e:.2} deg {:.2} dBsm",
                p.range_m, p.range_rate_mps, p.rcs_dbsm
            );
            assert!((p.range_m - range).abs() < 0.04, "{name} {id}: {} m, not {range}", p.range_m);
            assert!((p.range_rate_mps - rate).abs() < 0.1, "{name} {id}: {} m/s", p.range_rate_mps);
            assert!((a - azimuth).abs() < 1.0, "{name} {id}: azimuth {a}, not {azimuth}");
            assert!((e - elevation).abs() < 2.0, "{name} {id}: elevation {e}, not {elevation}");
            // Two Hann windows lose at most 1.42 dB each between cells.
            assert!(p.rcs_dbsm > 7.0 && p.rcs_dbsm < 10.2, "{name} {id}: {} dBsm", p.rcs_dbsm);
            let behind = pose.point(p.position_m) - scene.objects[i].pose.translation_m;
            assert!(behind.length() < 0.04 * range, "{name} {id}: {behind}");
        }
        match &truth {
            None => truth = Some(r),
            Some(t) => {
                let d = relative_l2(&r.cube, &t.cube);
                println!("{name}: cube {d:.1e}");
                assert!(d < 1e-4, "{name}: {d}");
                assert_eq!(r.points.len(), t.points.len(), "{name}");
            }
        }
    }
}

/// The radar's rows of the canonical table on every engine (`gates.rs` has them on one).
#[test]
fn levels_and_noise_on_every_engine() {
    for engine in engines() {
        for group in &GROUPS {
            if ["two rays", "delay", "level", "noise", "processing gain", "cfar"].contains(&group.name) {
                for row in group.measure(&engine).unwrap() {
                    assert!(row.passes() != Some(false), "{}: {row:?}", engine.describe());
                }
            }
        }
    }
}

#[test]
fn power_by_hand() {
    // In the middle of cell 60 and of the row of zero range rate: 12 dBm + 2 x 12 dBi + 20 lg lambda + 3 dBsm
    // - 30 lg(4 pi) - 40 lg R, lambda 3.89340 mm.
    let radar = radar();
    let range = 60.0 * radar.range_bin_m();
    let hand = 12.0 + 24.0 - 48.1935 + 3.0 - 32.9763 - 40.0 * range.log10();
    let mut scene = Scene::default();
    add_point(&mut scene, DVec3::X * range, DVec3::ZERO, 3.0);
    for engine in engines() {
        let r = run(&engine, &radar, &scene, &Pose::IDENTITY, DVec3::ZERO);
        let p = &r.points[0];
        println!("{}: {:.3} dBm, by hand {hand:.3}", engine.describe(), p.power_dbm);
        assert!((p.power_dbm - hand).abs() < 0.05 && (p.rcs_dbsm - 3.0).abs() < 0.05);
    }
}

#[test]
fn a_moving_radar_sees_still_things_come() {
    let (radar, pose) = (radar(), pose());
    let speed = 7.0;
    let mut scene = Scene::default();
    for azimuth in [0.0f64, 60.0, -60.0, 120.0] {
        let u = pose.direction(direction_from_angles(azimuth.to_radians(), 0.0));
        add_point(&mut scene, pose.translation_m + u * 20.0, DVec3::ZERO, 10.0);
    }
    let plate = Reflector::parse("plate:width_m=0.3,height_m=0.3").unwrap();
    let forward = pose.direction(DVec3::X);
    // Facing the radar, a little nearer than the posts.
    let facing = pose.rotation * glam::DQuat::from_rotation_z(std::f64::consts::PI);
    let at = Pose::new(facing, pose.point(DVec3::new(12.0, 0.0, 0.8)));
    let plate = plate.add_to(&mut scene, &material::by_name, ("plate", ""), at, DVec3::ZERO).unwrap();
    for engine in engines() {
        let r = run(&engine, &radar, &scene, &pose, forward * speed);
        for e in &r.echoes.list {
            let expected = match e.object_id() {
                1 => -speed,
                2 | 3 => -0.5 * speed,
                4 => 0.5 * speed,
                _ => -speed * e.departure.x,
            };
            assert!((e.range_rate_mps() - expected).abs() < 1e-4, "{}: {e:?}", engine.describe());
        }
        assert!(r.echoes.list.iter().any(|e| e.object_id() == plate));
        let p = r.points.iter().find(|p| p.object_id == plate).unwrap();
        assert!((p.range_rate_mps + speed).abs() < 0.15 && p.elevation_rad > 0.0, "{p:?}");
    }
}

#[test]
fn moving_and_standing_cancel() {
    // Ego and target at the same velocity: nothing moves.
    let (radar, pose) = (radar(), pose());
    let velocity = DVec3::new(9.0, 4.0, 0.0);
    let mut scene = Scene::default();
    add_point(&mut scene, pose.point(DVec3::new(17.0, 3.0, 0.0)), velocity, 10.0);
    for engine in engines() {
        let r = run(&engine, &radar, &scene, &pose, velocity);
        assert_eq!((r.echo_summary.echoes, r.echo_summary.moving), (1, 0), "{}", engine.describe());
        assert!(r.points[0].range_rate_mps.abs() < 0.05);
    }
}

#[test]
fn a_plate_hides_what_is_behind_it() {
    let radar = radar();
    let plate = Reflector::parse("plate:width_m=1,height_m=1").unwrap();
    for (y, hidden) in [(0.0, true), (3.0, false)] {
        let mut scene = Scene::default();
        let post = add_point(&mut scene, DVec3::new(20.0, 0.0, 0.1), DVec3::ZERO, 10.0);
        let at = Pose::from_yaw_pitch_roll(DVec3::new(10.0, y, 0.0), 0.0, 0.0, 0.0);
        let plate = plate.add_to(&mut scene, &material::by_name, ("plate", ""), at, DVec3::ZERO).unwrap();
        for engine in engines() {
            let r = run(&engine, &radar, &scene, &Pose::IDENTITY, DVec3::ZERO);
            let of = |id: u32| r.echoes.list.iter().filter(|e| e.object_id() == id).count();
            assert_eq!(of(post), usize::from(!hidden), "{}", engine.describe());
            // End terms only: a smooth plate returns its outline and its mirror point.
            assert!(of(plate) > 0);
            let seen = r.points.iter().any(|p| p.object_id == post && (p.range_m - 20.0).abs() < 0.2);
            assert_eq!(seen, !hidden, "{}", engine.describe());
        }
    }
}
