//! Vehicles, objects, points and radars that follow waypoints: what frames say of their range, range rate and direction against the
//! curve itself.

use catseye::engine::{Engine, Precision};
use catseye::road::Library;
use catseye::road::site::Site;
use catseye::scene::scenario::{self, SitedScenario};
use catseye::simulate::{radar_pose, simulate};
use glam::DVec3;
use std::path::Path;

fn parsed(text: &str) -> SitedScenario {
    scenario::parse(Path::new("s.toml"), text).unwrap().without_roads().unwrap()
}

fn complaint(text: &str) -> String {
    let e = scenario::parse(Path::new("s.toml"), text).and_then(|s| Site::new(&s)).unwrap_err();
    assert_eq!(e.exit_code(), 2, "{e}");
    e.to_string()
}

/// The points of frame `index`: range, range rate, azimuth in degrees, of the strongest first.
fn points(s: &SitedScenario, index: u32) -> Vec<[f64; 3]> {
    let scene = s.build(&Library).unwrap();
    let engine = Engine::Cpu(Precision::F32);
    let frame = simulate(&engine, s, &scene, index).unwrap();
    let mut list = frame.points;
    list.sort_by(|a, b| b.snr_db.total_cmp(&a.snr_db));
    list.iter().map(|p| [p.range_m, p.range_rate_mps, p.azimuth_rad.to_degrees()]).collect()
}

/// A point that comes nearer along a bow, seen by a vehicle that brakes: range, range rate with its sign and azimuth of three
/// frames are those of the two curves.
#[test]
fn points_follow_both_curves() {
    let bow = |t: f64| DVec3::new(40.0 - 6.0 * t, 6.0 - 0.8 * t * t, 0.5);
    let brakes = |t: f64| DVec3::new(9.0 * t - 2.0 * t * t, 0.0, 0.0);
    let waypoints = |f: &dyn Fn(f64) -> DVec3| {
        let list = (0..=8).map(|i| {
            let t = 0.25 * f64::from(i);
            format!("{{ time_s = {t}, position_m = {:?} }}", f(t).to_array())
        });
        list.collect::<Vec<_>>().join(", ")
    };
    let s = parsed(&format!(
        "name = \"s\"\nradar = \"front77\"\n[ego.trajectory]\nwaypoint = [{}]\n[[point]]\nrcs_dbsm = 20\n\
         trajectory = {{ waypoint = [{}] }}\n[frames]\ncount = 3\ninterval_s = 0.8\n",
        waypoints(&brakes),
        waypoints(&bow)
    ));
    let notes = s.build(&Library).unwrap().import.notes;
    assert!(notes.is_empty(), "{notes:?}");
    let radar = &s.radars[0];
    let (cell_m, cell_mps) = (radar.range_bin_m(), 0.5 * radar.wavelength_m() / radar.frame_time_s());
    for index in 0..3 {
        let t = s.frames.time_s(index);
        let (pose, velocity) = radar_pose(radar, &s.ego, t);
        assert!((velocity - DVec3::X * (9.0 - 4.0 * t)).length() < 1e-9, "{velocity}");
        let speed = DVec3::new(-6.0, -1.6 * t, 0.0);
        let to = bow(t) - pose.translation_m;
        let want = [
            to.length(),
            (speed - velocity).dot(to) / to.length(),
            pose.inverse().direction(to).truncate().to_angle().to_degrees(),
        ];
        let got = points(&s, index)[0];
        println!("{index}: {got:.3?} for {want:.3?}, cells {cell_m:.2} m, {cell_mps:.2} m/s");
        assert!((got[0] - want[0]).abs() < 0.3 * cell_m, "{got:?} {want:?}");
        assert!((got[1] - want[1]).abs() < 0.3 * cell_mps, "{got:?} {want:?}");
        assert!((got[2] - want[2]).abs() < 0.5, "{got:?} {want:?}");
    }
}

/// A radar that turns on its vehicle: the azimuth of a point at rest runs against it, its range rate stays.
#[test]
fn a_radar_that_scans() {
    let s = parsed(
        "name = \"s\"\n[[radars]]\nname = \"scan\"\nradar = \"front77\"\n[radars.trajectory]\n\
         waypoint = [{ time_s = 0, position_m = [0, 0, 0.5], yaw_deg = -20 }, { time_s = 1, position_m = [0, 0, 0.5], yaw_deg = 20 }]\n\
         [[point]]\nposition_m = [30, 0, 0.5]\nrcs_dbsm = 20\n[ego]\nspeed_mps = 5\n[frames]\ncount = 3\ninterval_s = 0.5\n",
    );
    for (index, yaw) in [-20.0, 0.0, 20.0].into_iter().enumerate() {
        let got = points(&s, index as u32)[0];
        println!("{got:.3?} at {yaw}");
        assert!((got[2] + yaw).abs() < 0.7 && (got[1] + 5.0).abs() < 0.2, "{got:?} at {yaw}");
    }
}

/// A sedan along a curve is one actor whose wheels roll as far as it goes; a child that waits before it walks keeps its legs still.
#[test]
fn vehicles_of_the_library_follow() {
    let s = parsed(
        "name = \"s\"\nradar = \"front77\"\n[[object]]\nvehicle = \"sedan\"\n[object.trajectory]\n\
         waypoint = [{ time_s = 0, position_m = [20, 0, 0] }, { time_s = 1, position_m = [30, 0, 0] }, { time_s = 2, position_m = [38, 4, 0] }]\n\
         [[object]]\nname = \"child\"\nvehicle = \"child\"\n[object.trajectory]\noutside = \"stay\"\ninterpolation = \"pchip\"\n\
         waypoint = [{ time_s = 1, position_m = [15, 3, 0] }, { time_s = 2, position_m = [15, 2, 0] }, { time_s = 3, position_m = [15, 0.6, 0] }]\n\
         [frames]\ncount = 40\ninterval_s = 0.05\n",
    );
    let told = "the trajectory of child lasts from 1 to 3 s, the frames from 0 to 1.95";
    let scene = s.build(&Library).unwrap();
    let notes = &scene.import.notes;
    assert!(notes.len() == 1 && notes[0].contains(told), "{notes:?}");
    // More frames than the file says: the sedan goes on, and that is told too.
    let mut longer = s.clone();
    longer.frames.count = 100;
    let scene_of_more = longer.build(&Library).unwrap();
    assert_eq!(scene_of_more.import.notes.len(), 2, "{:?}", scene_of_more.import.notes);
    let (a, b) = (scene_of_more.objects[0].at(3.0), scene_of_more.objects[0].at(4.9));
    assert!(a.velocity_mps.length() > 5.0 && (a.velocity_mps - b.velocity_mps).length() < 1e-12);
    let actors = catseye::road::actors::actors(&scene.objects);
    assert_eq!(actors.len(), 2, "{:?}", scene.objects.iter().map(|o| &o.name).collect::<Vec<_>>());
    assert_eq!(scene.objects[0].class, "car");
    let names: Vec<&str> = scene.objects.iter().map(|o| &*o.name).collect();
    assert!(names.contains(&"child") && names.contains(&"child thigh left"), "{names:?}");
    assert!(names[0] == "sedan 1" && names.contains(&"sedan 1 wheel 1 left"), "{names:?}");
    let body = &scene.objects[0];
    for t in [0.2, 1.0, 1.7] {
        let now = body.at(t);
        let ahead = now.rotation * DVec3::X;
        assert!(ahead.angle_between(now.velocity_mps) < 1e-3, "{t}");
        for wheel in scene.objects.iter().filter(|o| o.class == "car.wheel") {
            let w = wheel.at(t);
            // The lowest particle of a wheel that rolls stands still, but for what the car's turning adds.
            let radius_m = w.translation_m.z;
            let foot = w.velocity_at(w.translation_m - DVec3::Z * radius_m);
            let turning = now.velocity_at(w.translation_m) - now.velocity_mps;
            assert!((foot - turning).length() < 0.02, "{t} {}: {foot} {turning}", wheel.name);
        }
    }
    let limbs: Vec<_> = scene.objects.iter().filter(|o| o.class.starts_with("pedestrian.")).collect();
    assert!(limbs.len() >= 4);
    for limb in &limbs {
        let now = limb.at(0.5);
        assert!(now.velocity_mps.length() < 1e-9 && now.spin_rad_per_s.length() < 1e-9, "{}", limb.name);
    }
    assert!(limbs.iter().any(|l| l.at(1.6).spin_rad_per_s.length() > 0.5));
}

/// A trajectory that is a straight line gives the same frame as a position and a speed.
#[test]
fn a_straight_one_is_a_velocity() {
    let scenario = |ego: &str, object: &str| {
        parsed(&format!(
            "name = \"s\"\nradar = \"front77\"\n[[object]]\nreflector = \"type1:width_m=0.16\"\nyaw_deg = 180\n{object}\n\
             [[point]]\nposition_m = [25, -2, 1]\nrcs_dbsm = 5\n[ego]\n{ego}\n"
        ))
    };
    let a = scenario("speed_mps = 12", "position_m = [20, 1, 0.3]\nvelocity_mps = [-3, 0, 0]");
    let line = |from: [f64; 3], to: [f64; 3]| {
        format!(
            "trajectory = {{ waypoint = [{{ time_s = 0, position_m = {from:?} }}, {{ time_s = 2, position_m = {to:?} }}] }}"
        )
    };
    // It heads back along the way, so half a turn more looks at where it came from.
    let b = scenario(&line([0.0; 3], [24.0, 0.0, 0.0]), &line([20.0, 1.0, 0.3], [14.0, 1.0, 0.3]));
    let b = SitedScenario {
        objects: b
            .objects
            .iter()
            .cloned()
            .map(|o| catseye::scene::scenario::Placed { pose: catseye::base::frames::Pose::IDENTITY, ..o })
            .collect(),
        ..b
    };
    let (p, q) = (points(&a, 0), points(&b, 0));
    assert_eq!(p.len(), q.len());
    assert!(p.len() >= 2);
    for (p, q) in p.iter().zip(&q) {
        assert!(p.iter().zip(q).all(|(a, b)| (a - b).abs() < 1e-5), "{p:?} {q:?}");
    }
}

#[test]
fn a_way_is_given_once() {
    let two =
        "{ waypoint = [{ time_s = 0, position_m = [0, 0, 0] }, { time_s = 1, position_m = [1, 0, 0] }] }";
    let with = |rest: &str| complaint(&format!("name = \"s\"\nradar = \"front77\"\n{rest}"));
    for (rest, says) in [
        (
            format!("[ego]\nspeed_mps = 3\ntrajectory = {two}"),
            "s.toml:4: ego.speed_mps = 3: ego.speed_mps and ego.trajectory exclude each other",
        ),
        (
            format!("[[point]]\nrcs_dbsm = 1\nposition_m = [1, 0, 0]\ntrajectory = {two}"),
            "position_m = [1, 0, 0]: position_m and the trajectory exclude each other",
        ),
        (
            format!("[[point]]\nrcs_dbsm = 1\nvelocity_mps = [1, 0, 0]\ntrajectory = {two}"),
            "velocity_mps and the trajectory exclude each other",
        ),
        ("[[point]]\nrcs_dbsm = 1".into(), "point[0].position_m"),
        ("[[object]]\nvehicle = \"sedan\"".into(), "object[0].position_m"),
        (
            "[[object]]\nvehicle = \"sedam\"\nposition_m = [9, 0, 0]".into(),
            "vehicle = sedam: is not a kind of vehicle; allowed: passenger-car, sedan",
        ),
        (
            "[[object]]\nvehicle = \"sedan\"\nfile = \"a.glb\"\nposition_m = [9, 0, 0]".into(),
            "file, reflector, vehicle and rcs_table exclude each other",
        ),
        ("[[object]]\nposition_m = [9, 0, 0]".into(), "object[0]: the object is missing"),
        (
            "[[object]]\nvehicle = \"van\"\nunit = \"mm\"\nposition_m = [9, 0, 0]".into(),
            "applies only to a mesh file",
        ),
    ] {
        let e = with(&rest);
        assert!(e.contains(says), "{rest}: {e}");
    }
}
