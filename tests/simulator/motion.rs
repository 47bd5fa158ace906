//! Paths of a frame in which something moves: what an echo says of its path at the frame's start and end against the same scene
//! traced then.

use catseye::adc::cpu::synthesis::synthesise;
use catseye::adc::synthesis::Plan;
use catseye::base::control::Control;
use catseye::base::frames::Pose;
use catseye::base::held::Held;
use catseye::engine::{AnyCube, Engine, Precision};
use catseye::geom::{Facets, Geometry, RigidScene};
use catseye::road::objects::ground;
use catseye::road::shape::cuboid;
use catseye::scene::motion::{Joint, Motion};
use catseye::scene::scenario::{self, SitedScenario};
use catseye::scene::{Scene, Shape, material};
use catseye::simulate::{Prepared, radar_pose, simulate, trace_options};
use catseye::trace::cpu::echoes;
use catseye::trace::windows::windows;
use catseye::trace::{Echo, Echoes, TraceOptions, strength};
use glam::{DQuat, DVec2, DVec3};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// A quarter of a frame of 42 ms.
const REACH_S: f64 = 0.021;

fn scenario(ego: &str) -> SitedScenario {
    let text = format!("name = \"s\"\nradar = \"front77\"\n[ego]\n{ego}\n");
    scenario::parse(Path::new("s.toml"), &text).unwrap().without_roads().unwrap()
}

fn traced(scene: &Scene, s: &SitedScenario, time_s: f64) -> Vec<Echo> {
    traced_within(scene, s, time_s, REACH_S)
}

fn traced_within(scene: &Scene, s: &SitedScenario, time_s: f64, reach_s: f64) -> Vec<Echo> {
    let geometry = Geometry::of_frame(scene, time_s, s.radars[0].carrier_hz, reach_s).unwrap();
    traced_in(&geometry, s, time_s)
}

fn traced_in(geometry: &Geometry, s: &SitedScenario, time_s: f64) -> Vec<Echo> {
    let radar = &s.radars[0];
    let (pose, velocity) = radar_pose(radar, &s.ego, time_s);
    let sway = |dt: f64| {
        let (then, _) = radar_pose(radar, &s.ego, time_s + dt);
        then.translation_m - (pose.translation_m + velocity * dt)
    };
    let options = TraceOptions {
        rays: 0,
        radar_sway_m: [sway(-REACH_S), sway(REACH_S)],
        ..trace_options(s, 0, 0).unwrap()
    };
    echoes::echoes(geometry, &windows(radar, &pose), &pose, velocity, &options).list
}

/// The longest-range strong echo of each chain, by chain.
fn strongest(list: &[Echo]) -> Vec<Echo> {
    let mut best: Vec<Echo> = Vec::new();
    for r in list {
        match best.iter_mut().find(|b| b.chain == r.chain) {
            Some(b) if strength(b) < strength(r) => *b = r.clone(),
            Some(_) => {}
            None => best.push(r.clone()),
        }
    }
    best
}

fn path(r: &Echo, dt: f64) -> f64 {
    r.path_length_m
        + dt * (r.path_rate_mps
            + dt * (0.5 * r.path_acceleration_and_jerk[0] + dt * r.path_acceleration_and_jerk[1] / 6.0))
}

/// Angles by which an echo's first and last directions at another time miss those of the echo then, rad.
fn turned(r: &Echo, other: &Echo, dt: f64) -> f64 {
    let first = r.departure * r.first_range_m + r.first_velocity_mps * dt;
    let last = r.arrival * r.last_range_m + r.last_velocity_mps * dt;
    first.angle_between(other.departure).max(last.angle_between(other.arrival))
}

/// Largest error of the paths of the strongest echo of each chain at some times of the frame, m, and how far they would be off
/// were they straight. Directions follow too: what they turn by is less than a hundredth off.
fn worst(scene: &Scene, s: &SitedScenario) -> (f64, f64) {
    let now = strongest(&traced(scene, s, 0.5));
    assert!(!now.is_empty());
    let (mut worst, mut straight) = (0.0f64, 0.0f64);
    let (mut off, mut turn) = (0.0f64, 0.0f64);
    for dt in [-1.0, -0.6, 0.3, 0.5, 1.0].map(|x| x * REACH_S) {
        let then = strongest(&traced(scene, s, 0.5 + dt));
        for r in &now {
            let Some(other) = then.iter().find(|o| o.chain == r.chain) else { continue };
            worst = worst.max((path(r, dt) - other.path_length_m).abs());
            let line = r.path_length_m + r.path_rate_mps * dt;
            straight = straight.max((line - other.path_length_m).abs());
            off = off.max(turned(r, other, dt));
            let fixed = Echo { first_velocity_mps: DVec3::ZERO, last_velocity_mps: DVec3::ZERO, ..r.clone() };
            turn = turn.max(turned(&fixed, other, dt));
        }
    }
    println!("directions: {off:.1e} rad off, {turn:.1e} were they fixed");
    assert!(off < 1e-2 * turn + 1e-7, "{off} {turn}");
    (worst, straight)
}

fn point(scene: &mut Scene, at: DVec3) {
    let metal = scene.material_index(&material::by_name("pec").unwrap());
    // Points need something beside them.
    if scene.meshes.is_empty() {
        let far = cuboid(DVec3::splat(0.1), DVec3::new(-90.0, 0.0, 0.0), metal);
        scene.add_mesh("far", "", far, Pose::IDENTITY);
    }
    scene.add_object(
        "point",
        "",
        Shape::Point { rcs_dbsm: 0.0 },
        Pose::new(DQuat::IDENTITY, at),
        DVec3::ZERO,
    );
}

#[test]
fn a_point_beside_the_way() {
    let mut scene = Scene::default();
    point(&mut scene, DVec3::new(12.0, 2.5, 0.5));
    let (off, straight) = worst(&scene, &scenario("speed_mps = 15"));
    println!("point: {:.1e} m off, {straight:.1e} as a line", off);
    // What a cubic leaves of a path that is passed at 5 m.
    assert!(off < 2e-5 && straight > 1e-2);
}

#[test]
fn a_point_over_a_mirror_with_an_ego_that_brakes() {
    let mut scene = Scene::default();
    let metal = scene.material_index(&material::by_name("pec").unwrap());
    scene.add_mesh(
        "road",
        "road",
        ground(DVec2::new(-5.0, -20.0), DVec2::new(60.0, 20.0), 0.0, metal),
        Pose::IDENTITY,
    );
    point(&mut scene, DVec3::new(18.0, 3.0, 1.2));
    let mut s = scenario("speed_mps = 15");
    // 15 m/s, braking by 8 m/s² at half a second.
    let times: Vec<f64> = (0..=20).map(|i| 0.05 * f64::from(i)).collect();
    let at = |t: &f64| DVec3::X * (15.0 * t - 4.0 * (t - 0.5) * (t - 0.5));
    let rate = |t: &f64| DVec3::X * (15.0 - 8.0 * (t - 0.5));
    let channel = catseye::scene::motion::Channel::new(
        times.clone(),
        times.iter().map(at).collect(),
        times.iter().map(|t| (rate(t), rate(t))).collect(),
        catseye::scene::motion::Interpolation::Cubic,
    )
    .unwrap();
    s.ego.motion = Some(Arc::new(Motion {
        joints: vec![Joint::Track { position_m: Some(Arc::new(channel)), rotation: None }],
    }));
    let (off, straight) = worst(&scene, &s);
    println!("braking: {off:.1e} m off, {straight:.1e} as a line");
    assert!(off < 5e-6 && straight > 3e-3);
}

/// A wall beside the way (its mirror image slides along with the car), a box that turns, a box that drives by.
#[test]
fn walls_slide_and_boxes_turn() {
    let metal = |scene: &mut Scene| scene.material_index(&material::by_name("pec").unwrap());
    let mut scene = Scene::default();
    let m = metal(&mut scene);
    scene.add_mesh(
        "wall",
        "wall",
        cuboid(DVec3::new(80.0, 0.2, 3.0), DVec3::new(30.0, 6.0, 1.5), m),
        Pose::IDENTITY,
    );
    let (off, _) = worst(&scene, &scenario("speed_mps = 20"));
    println!("wall: {off:.1e} m off");
    assert!(off < 1e-6, "{off}");
    let now = traced(&scene, &scenario("speed_mps = 20"), 0.5);
    let specular = now.iter().max_by(|a, b| strength(a).total_cmp(&strength(b))).unwrap();
    assert!(
        specular.path_rate_mps.abs() < 1e-9 && specular.path_acceleration_and_jerk[0].abs() < 1e-3,
        "{specular:?}"
    );

    let mut scene = Scene::default();
    let m = metal(&mut scene);
    let id =
        scene.add_mesh("box", "car", cuboid(DVec3::new(1.0, 0.8, 0.9), DVec3::Z * 0.7, m), Pose::IDENTITY);
    scene.move_by(
        id,
        Motion {
            joints: vec![
                Joint::Spin { axis: DVec3::Z, rate_rad_per_s: 1.5, angle_rad: 0.2 },
                Joint::Fixed(DQuat::IDENTITY, DVec3::new(14.0, 2.0, 0.0)),
                Joint::Line(DVec3::new(-3.0, 1.0, 0.0)),
            ],
        },
    );
    let list = traced(&scene, &scenario("speed_mps = 10"), 0.5);
    assert!(list.iter().any(|r| r.path_acceleration_and_jerk[0].abs() > 0.5));
    let (off, straight) = worst(&scene, &scenario("speed_mps = 10"));
    println!("turning box: {off:.1e} m off, {straight:.1e} as a line");
    assert!(off < 2e-5 && straight > 1e-4, "{off} {straight}");
}

/// A road with a wall, four posts of one mesh, a box that drives, one that turns as it drives, and a flap that swings on a joint.
fn street() -> Scene {
    let mut scene = Scene::default();
    let metal = scene.material_index(&material::by_name("pec").unwrap());
    let plastic = scene.material_index(&material::by_name("polypropylene").unwrap());
    let road = ground(DVec2::new(-6.3, -20.0), DVec2::new(61.0, 21.0), 0.0, metal);
    scene.add_mesh("road", "road", road, Pose::IDENTITY);
    let wall = cuboid(DVec3::new(40.0, 0.2, 3.0), DVec3::new(25.0, 0.0, 1.51), metal);
    scene.add_mesh("wall", "wall", wall, Pose::from_yaw_pitch_roll(DVec3::Y * 6.0, 0.05, 0.0, 0.0));
    scene.meshes.push(cuboid(DVec3::new(0.12, 0.1, 1.2), DVec3::Z * 0.62, plastic));
    let post = Shape::Mesh(scene.meshes.len() - 1);
    for i in 0..4 {
        let at = DVec3::new(9.0 + 5.3 * f64::from(i), -3.7, 0.0);
        let pose = Pose::from_yaw_pitch_roll(at, 0.3 * f64::from(i), 0.0, 0.0);
        scene.add_object("post", "post", post, pose, DVec3::ZERO);
    }
    scene.meshes.push(cuboid(DVec3::new(4.1, 1.7, 1.3), DVec3::Z * 0.85, metal));
    let car = Shape::Mesh(scene.meshes.len() - 1);
    let lane = Pose::from_yaw_pitch_roll(DVec3::new(17.0, 2.1, 0.0), 0.03, 0.0, 0.0);
    scene.add_object("drives", "car", car, lane, DVec3::new(7.0, 0.2, 0.0));
    let turns = scene.add_object("turns", "car", car, Pose::IDENTITY, DVec3::ZERO);
    let joints = vec![
        Joint::Spin { axis: DVec3::Z, rate_rad_per_s: 1.5, angle_rad: 0.2 },
        Joint::Fixed(DQuat::IDENTITY, DVec3::new(30.0, -1.0, 0.0)),
        Joint::Line(DVec3::new(-3.0, 1.0, 0.0)),
    ];
    scene.move_by(turns, Motion { joints });
    let flap = cuboid(DVec3::new(0.9, 0.04, 1.1), DVec3::new(0.5, 0.0, 0.0), metal);
    let flap = scene.add_mesh("flap", "sign", flap, Pose::IDENTITY);
    let axis = DVec3::new(0.1, 0.2, 1.0).normalize();
    let joints = vec![
        Joint::Swing { axis, amplitude_rad: 0.8, rate_rad_per_s: 4.0, phase_rad: 0.4 },
        Joint::Fixed(DQuat::from_rotation_z(1.1), DVec3::new(12.0, -1.9, 1.2)),
    ];
    scene.move_by(flap, Motion { joints });
    scene
}

/// The scene as it stands at a time, with a mesh in the world for each object.
fn baked(scene: &Scene, time_s: f64) -> Scene {
    let mut world = Scene { meshes: Vec::new(), objects: Vec::new(), ..scene.clone() };
    for object in &scene.objects {
        let Shape::Mesh(m) = object.shape else { continue };
        let mut mesh = scene.meshes[m].clone();
        let pose = object.at(time_s).pose();
        mesh.positions_m.iter_mut().for_each(|p| *p = pose.point(*p));
        world.add_mesh(&object.name, &object.class, mesh, Pose::IDENTITY);
    }
    world
}

/// Number and summed power of the echoes, by the objects met.
fn by_chain(list: &[Echo]) -> BTreeMap<Vec<u32>, (usize, f64)> {
    let mut sums: BTreeMap<_, (usize, f64)> = BTreeMap::new();
    for r in list {
        let sum = sums.entry(r.chain[..r.bounces as usize].to_vec()).or_default();
        sum.0 += 1;
        sum.1 += r.path_gain.iter().flatten().map(|z| z.norm_sqr()).sum::<f64>();
    }
    sums
}

/// Each frame is what it is without the others, and what meshes that were moved to their places by hand give; what stands still is
/// placed once.
#[test]
fn bodies_are_made_once() {
    let (scene, s) = (street(), scenario("speed_mps = 12"));
    let kept = RigidScene::new(Held::Borrowed(&scene), s.radars[0].carrier_hz, Facets::Curved).unwrap();
    assert_eq!(kept.work_done(), (0, 0));
    let (meshes, still, moving) = (5, 6, 3);
    for (frames, time_s) in [0.1, 0.05, 0.4, 0.0].into_iter().enumerate() {
        let geometry = kept.at(time_s, REACH_S).unwrap();
        let list = traced_in(&geometry, &s, time_s);
        assert_eq!(kept.work_done(), (meshes, still + (frames + 1) * moving));
        let alone = Geometry::of_frame(&scene, time_s, s.radars[0].carrier_hz, REACH_S).unwrap();
        assert_eq!(geometry.faces().faces, alone.faces().faces);
        assert_eq!(geometry.faces().nodes, alone.faces().nodes);
        assert_eq!(geometry.faces().faces, alone.find_faces().faces);
        assert!(list.len() > 100 && list == traced_in(&alone, &s, time_s));

        // What was moved by hand stands still: within a frame of no length what moves is parted alike (CONVENTIONS eq. 62).
        let by_hand = by_chain(&traced_within(&baked(&scene, time_s), &s, time_s, 0.0));
        let total: f64 = by_hand.values().map(|s| s.1).sum();
        let list = by_chain(&traced_within(&scene, &s, time_s, 0.0));
        assert_eq!(list.keys().collect::<Vec<_>>(), by_hand.keys().collect::<Vec<_>>());
        for (chain, (count, power)) in &list {
            let (n, p) = by_hand[chain];
            let alike = *count == n && (power - p).abs() <= 1e-9 * total;
            assert!(alike, "{chain:?}: {count} {n} {power:e} {p:e} of {total:e}");
        }
    }
}

/// A radar hears in a frame the same whatever frames were received before.
#[test]
fn the_order_of_frames_does_not_matter() {
    let (scene, s) = (street(), scenario("speed_mps = 12"));
    let engine = Engine::Cpu(Precision::F64);
    let first = Prepared::new(&s, &scene).unwrap();
    let other = Prepared::new(&s, &scene).unwrap();
    let frames = [2, 0, 1].map(|i| (i, first.echoes(&engine, 0, i).unwrap().echoes));
    for (i, echoes) in frames.iter().rev() {
        assert_eq!(other.echoes(&engine, 0, *i).unwrap().echoes.list, echoes.list);
    }
}

/// Nothing moves: nothing bends, to the bit.
#[test]
fn what_rests_stays_still() {
    let mut scene = Scene::default();
    let m = scene.material_index(&material::by_name("pec").unwrap());
    let turned = Pose::from_yaw_pitch_roll(DVec3::new(20.0, 1.0, 0.0), 0.3, 0.1, 0.0);
    scene.add_mesh("box", "car", cuboid(DVec3::ONE, DVec3::Z, m), turned);
    assert!(traced(&scene, &scenario(""), 0.5).iter().all(Echo::is_still));
}

/// The samples of a point that is passed closely, against the sum with the exact path at each chirp.
#[test]
fn samples_follow_the_exact_path() {
    let mut s = scenario("speed_mps = 15");
    let radar = &mut s.radars[0];
    (radar.chirps, radar.samples, radar.thermal_noise) = (256, 64, false);
    radar.tx.truncate(1);
    radar.rx.truncate(1);
    (radar.processing.doppler_fft, radar.processing.range_fft) = (256, 64);
    let mut scene = Scene::default();
    point(&mut scene, DVec3::new(9.0, 3.0, 0.6));
    let frame = simulate(&Engine::Cpu(Precision::F64), &s, &scene, 0).unwrap();
    let Some(AnyCube::F64(cube)) = &frame.cube else { panic!("f64") };
    let radar = &s.radars[0];
    // One chirp at a time, from an echo with the path and the rate of that chirp.
    let (mut worst, mut peak) = (0.0f64, 0.0f64);
    let mut straight = 0.0f64;
    for m in (0..radar.chirps).step_by(17) {
        let t = radar.chirp_start_s(m, 0) + radar.adc_start_s;
        let (pose, velocity) = radar_pose(radar, &s.ego, t);
        let d = DVec3::new(9.0, 3.0, 0.6) - pose.translation_m;
        let rate = -2.0 * velocity.dot(d.normalize());
        let first = frame.echoes.list.iter().find(|r| r.object_id() == 2).unwrap();
        let mut echo = first.clone();
        // Such that its length at this chirp is the exact one.
        echo.path_acceleration_and_jerk = [0.0; 2];
        (echo.path_length_m, echo.path_rate_mps) = (2.0 * d.length() - rate * t, rate);
        for (echo, sum) in [
            (echo, &mut worst),
            (Echo { path_acceleration_and_jerk: [0.0; 2], ..first.clone() }, &mut straight),
        ] {
            let list = Echoes { list: vec![echo], ..Default::default() };
            let truth = synthesise::<f64>(&Plan::new(radar, &list).unwrap(), Control::default()).unwrap();
            for n in 0..radar.samples {
                let at = m * radar.samples + n;
                *sum = sum.max((cube.data[at] - truth.data[at]).norm());
                peak = peak.max(truth.data[at].norm());
            }
        }
    }
    println!("samples: {:.1e} of the peak, {:.1e} as a line", worst / peak, straight / peak);
    assert!(worst < 5e-3 * peak && straight > 0.5 * peak, "{worst} {straight} {peak}");
}
