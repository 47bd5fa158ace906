//! Echoes of frames from exact beams: against the dense sum of cells, over the band, and W3.

use catseye::base::frames::{Pose, Sensor, World};
use catseye::base::matrix::Matrix2;
use catseye::base::units::wavenumber;
use catseye::engine::{Engine, Precision};
use catseye::geom::Geometry;
use catseye::rcs::cpu::beam_sum::{FrequencyPoint, between};
use catseye::road::objects::{ground, standing_box};
use catseye::road::reflector::Reflector;
use catseye::scene::{Material, Scene, Shape, material};
use catseye::trace::beams::{BeamOptions, Frame, Port};
use catseye::trace::cpu::echoes;
use catseye::trace::windows::around;
use catseye::trace::{Echoes, TraceOptions, strength};
use catseye_papers::bench::{self, Settings};
use glam::{DQuat, DVec2, DVec3};
use num_complex::Complex64;

fn total(echoes: &Echoes, k: f64) -> Matrix2 {
    let mut sum = Matrix2::default();
    for r in &echoes.list {
        let z = Complex64::cis(-k * r.path_length_m);
        for (row, s) in sum.iter_mut().zip(r.path_gain) {
            row.iter_mut().zip(s).for_each(|(a, b)| *a += b * z);
        }
    }
    sum
}

/// The sum of cells so small that they are exact, 1/m.
fn dense(geometry: &Geometry, at: DVec3, bounces: usize) -> Matrix2 {
    let k = wavenumber(geometry.freq_hz);
    let tones = [FrequencyPoint { wavenumber: k, surfaces: &geometry.surfaces }];
    let options = BeamOptions { tau: 0.001, ..BeamOptions::new(bounces, 0.2, false) };
    let s = between(geometry.faces(), &tones, Port::At(at), Port::At(at), &options).unwrap().remove(0);
    let z = Complex64::cis(-2.0 * k * at.length());
    // Seen from the object, H points the other way.
    let [[vv, vh], [hv, hh]] = s.every.map(|row| row.map(|x| x * z));
    [[vv, -vh], [-hv, hh]]
}

/// Six windows around a place, turned.
fn windows(at: DVec3, turn: DQuat) -> [Frame; 6] {
    around(&Pose::new(turn, at))
}

fn scene() -> Scene {
    let mut scene = Scene::default();
    let steel = scene.material_index(&material::by_name("steel").unwrap());
    let asphalt = scene.material_index(&material::by_name("asphalt").unwrap());
    let plane = ground(DVec2::new(3.0, -1.0), DVec2::new(7.0, 1.0), 0.0, asphalt);
    scene.add_mesh("ground", "road", plane, Pose::IDENTITY);
    for (at, yaw, size) in [
        (DVec3::new(4.0, 0.6, 0.0), 0.4, DVec3::new(0.16, 0.10, 0.04)),
        (DVec3::new(6.0, -0.5, 0.0), 0.0, DVec3::new(0.5, 0.3, 0.4)),
        (DVec3::new(5.0, 0.0, 0.0), -0.2, DVec3::new(0.1, 0.06, 0.6)),
    ] {
        let mesh = standing_box(size, steel);
        let pose = Pose::new(DQuat::from_rotation_z(yaw), at);
        scene.add_mesh("box", "box", mesh, pose);
    }
    let marker = Reflector::parse("trihedral:leg_m=0.1").unwrap().to_scene(&material::by_name).unwrap();
    let mesh = marker.meshes[0].clone();
    let pose = Pose::new(DQuat::from_rotation_z(3.0), DVec3::new(5.5, 0.5, 0.1));
    scene.meshes.push(mesh);
    let shape = Shape::Mesh(scene.meshes.len() - 1);
    scene.add_object("marker", "marker", shape, pose, DVec3::ZERO);
    scene
}

fn norm(m: &Matrix2) -> f64 {
    m.iter().flatten().map(|z| z.norm_sqr()).sum::<f64>().sqrt()
}

fn minus(a: &Matrix2, b: &Matrix2) -> Matrix2 {
    [0, 1].map(|i| [0, 1].map(|j| a[i][j] - b[i][j]))
}

/// Metal bodies alone, and on asphalt, whose reflection changes over a Fresnel zone of 0.1 m seen at a few
/// degrees: its change is followed to first order (0.6 % is left at 5 m).
#[test]
fn echoes_add_up_to_the_dense_sum_all_over_the_band() {
    let at = DVec3::new(0.1, 0.05, 0.5);
    let pose: Pose<Sensor, World> = Pose::new(DQuat::IDENTITY, at);
    for ground in [false, true] {
        let mut scene = scene();
        scene.objects.retain(|o| ground || o.class != "road");
        let all = Geometry::build(&scene, 0.0, 77e9).unwrap();
        for (bounces, accuracy_db) in [(1, 0.2), (1, 0.0125), (2, 0.2), (2, 0.0125), (3, 0.2), (3, 0.0125)] {
            let options = TraceOptions {
                bounces,
                accuracy_db,
                amplitude_floor: 0.0,
                // The sum of cells follows every beam.
                images: false,
                ..Default::default()
            };
            let found = echoes::echoes(&all, &windows(at, pose.rotation), &pose, DVec3::ZERO, &options);
            assert!(found.list.len() < 600, "{}", found.list.len());
            for freq in [76.5e9, 77e9, 77.5e9] {
                let geometry = Geometry::build(&scene, 0.0, freq).unwrap();
                let want = dense(&geometry, at, bounces);
                let got = total(&found, wavenumber(freq));
                let off = norm(&minus(&got, &want)) / norm(&want);
                let what = format!("ground {ground}, {bounces} bounces, {accuracy_db} dB, {freq:e}");
                println!("{what}: {} echoes, {off:.2e}", found.list.len());
                // An echo has the amplitude of the carrier all over the band: those of corners are off by 0.65 %
                // each at its ends, and they cancel in part.
                let bound = match (freq == 77e9, ground, accuracy_db) {
                    (true, false, 0.2) => 4e-3,
                    (true, false, _) => 1e-3,
                    (true, true, _) => 0.01,
                    _ => 0.02,
                };
                assert!(off < bound, "{what}: {off}\n{got:?}\n{want:?}");
            }
        }
    }
}

/// A radar in a street that goes on behind it: how its view is cut into windows does not show.
#[test]
fn windows_leave_no_seams() {
    let mut scene = scene();
    let steel = scene.material_index(&material::by_name("steel").unwrap());
    let plane = ground(DVec2::new(-8.0, -6.0), DVec2::new(3.0, 6.0), 0.0, steel);
    scene.add_mesh("yard", "road", plane, Pose::IDENTITY);
    let wall = standing_box(DVec3::new(0.2, 9.0, 2.0), steel);
    scene.add_mesh("wall", "wall", wall, Pose::new(DQuat::from_rotation_z(0.1), DVec3::new(-4.0, 0.5, 0.0)));
    let geometry = Geometry::build(&scene, 0.0, 77e9).unwrap();
    let at = DVec3::new(0.1, 0.05, 0.5);
    let pose: Pose<Sensor, World> = Pose::new(DQuat::IDENTITY, at);
    let options = TraceOptions { amplitude_floor: 0.0, ..Default::default() };
    let of = |turn| echoes::echoes(&geometry, &windows(at, turn), &pose, DVec3::ZERO, &options);
    let k = wavenumber(77e9);
    let straight = of(DQuat::IDENTITY);
    let turned = of(DQuat::from_euler(glam::EulerRot::ZYX, 0.4, 0.3, -0.2));
    let (a, b) = (total(&straight, k), total(&turned, k));
    let off = norm(&minus(&a, &b)) / norm(&a);
    println!("{} and {} echoes, off {off:.1e}", straight.list.len(), turned.list.len());
    assert!(off < 1e-6, "{off}");
    // The mirror image in the wall behind, on its nearest point.
    let wall = straight.list.iter().filter(|r| r.bounces == 1 && r.object_id() == 7);
    let best = wall.max_by(|a, b| strength(a).total_cmp(&strength(b))).unwrap();
    let to_wall = (at - DVec3::new(-4.0, 0.5, 0.5)).dot(DQuat::from_rotation_z(0.1) * DVec3::X) - 0.1;
    assert!((best.range_m() - to_wall).abs() < 1e-9, "{best:?} {to_wall}");
    let image = best.path_gain[0][0].norm() * 2.0 * to_wall;
    assert!((image - 1.0).abs() < 3e-3, "{image}");
}

/// Powers of n scatterers are exponential each: their sum is within 4 / sqrt(n) of its mean.
#[test]
fn diffuse_echoes_carry_the_lobes_power_and_are_seeded() {
    let (h, area, r) = (2e-4, 0.4 * 0.3, 7.0);
    let mut scene = Reflector::parse("plate:width_m=0.4,height_m=0.3")
        .unwrap()
        .to_scene(&|_| Ok(Material { roughness_rms_m: h, ..Material::pec() }))
        .unwrap();
    let tilt = 0.5f64;
    scene.objects[0].pose.rotation = DQuat::from_rotation_z(tilt) * scene.objects[0].pose.rotation;
    let geometry = Geometry::build(&scene, 0.0, 77e9).unwrap();
    let k = wavenumber(77e9);
    let at = DVec3::new(r, 0.0, 0.0);
    let pose: Pose<Sensor, World> = Pose::new(DQuat::from_rotation_z(std::f64::consts::PI), at);
    let of = |rays, seed, frame| {
        let options = TraceOptions { rays, seed, frame, amplitude_floor: 0.0, ..Default::default() };
        let all = echoes::echoes(&geometry, &around(&pose), &pose, DVec3::ZERO, &options);
        let coherent = all.list.len() - all.rays as usize;
        all.list[coherent..].to_vec()
    };
    let echoes = of(20_000, 1, 0);
    // Squares' sides are powers of two.
    assert!((7_000..60_000).contains(&echoes.len()), "{}", echoes.len());
    // 4 A D cos^2 over 4 pi r^4 (CONVENTIONS eq. 27), D = 1 - exp(-4 (k h cos)^2).
    let c = tilt.cos();
    let want = area * (1.0 - (-4.0 * (k * h * c).powi(2)).exp()) * c * c / std::f64::consts::PI / r.powi(4);
    for i in 0..2 {
        let power: f64 = echoes.iter().map(|e| e.path_gain[i][i].norm_sqr()).sum();
        assert!((power / want - 1.0).abs() < 4.0 / (echoes.len() as f64).sqrt(), "{power} {want}");
    }
    assert!(echoes.iter().all(|e| e.path_gain[0][1].norm() < 1e-12 * e.path_gain[0][0].norm()));
    assert_eq!(echoes, of(20_000, 1, 0));
    assert_ne!(echoes, of(20_000, 2, 0));
    // The pattern is the surface's, not the frame's.
    assert_eq!(echoes, of(20_000, 1, 1));
    assert!(of(0, 1, 0).is_empty());
    // The field's mean power over seeds is the same: scatterers are independent. 400 draws of an exponential
    // have a mean within 5 %, three of these are allowed.
    let mean = (0..400)
        .map(|seed| {
            let field: Complex64 = of(60, seed, 0)
                .iter()
                .map(|e| e.path_gain[0][0] * Complex64::cis(-k * e.path_length_m))
                .sum();
            field.norm_sqr()
        })
        .sum::<f64>()
        / 400.0;
    assert!((mean / want - 1.0).abs() < 0.15, "{mean} {want}");
}

/// In W3 no object's peak moves by more than 0.1 dB when phases are quartered.
#[test]
fn w3_has_converged() {
    let engine = Engine::open("cpu", Precision::F32).unwrap();
    let settings = Settings { quick: true, seed: 1 };
    let names = ["W3-static", "W3-moving"].map(String::from);
    for outcome in bench::run(&engine, &names, &settings, &|_| ()).unwrap() {
        let of = |name: &str| outcome.accuracy[name].as_f64().unwrap();
        println!("{}: {:?}", outcome.workload, outcome.accuracy);
        assert!(of("objects") > 40.0);
        assert!(of("worst_object_db") <= 0.1, "{}: {:?}", outcome.workload, outcome.accuracy);
        assert!(of("map_relative_l2") < 0.01);
    }
}

/// A plane of a material under whatever stands on it, 80 m long.
fn over(material: &str, spec: &str, pose: Pose<catseye::base::frames::Target, World>) -> Scene {
    let mut scene = Scene::default();
    let of_plane = scene.material_index(&material::by_name(material).unwrap());
    let plane = ground(DVec2::new(-20.0, -20.0), DVec2::new(60.0, 20.0), 0.0, of_plane);
    scene.add_mesh("ground", "road", plane, Pose::IDENTITY);
    let body = Reflector::parse(spec).unwrap();
    body.add_to(&mut scene, &material::by_name, ("target", ""), pose, DVec3::ZERO).unwrap();
    scene
}

fn seen_from(scene: &Scene, height_m: f64, options: &TraceOptions) -> Echoes {
    let geometry = Geometry::build(scene, 0.0, 77e9).unwrap();
    let at = DVec3::new(0.0, 0.0, height_m);
    let pose: Pose<Sensor, World> = Pose::new(DQuat::IDENTITY, at);
    let mut found = echoes::echoes(&geometry, &windows(at, DQuat::IDENTITY), &pose, DVec3::ZERO, options);
    // Of the plane alone nothing.
    found.list.retain(|r| r.chain.iter().any(|id| *id > 1));
    found
}

/// The field of a point over a plane is that of two points: (e^-jkr/r + R e^-jkr'/r')^2, for both polarisations, with the plane's
/// own reflection at the angle; the nulls fall where TRUTH says.
#[test]
fn a_point_over_a_road_fades_as_the_two_ray_formula_says() {
    let (radar_m, target_m) = (0.15, 0.35);
    let k = wavenumber(77e9);
    for name in ["pec", "asphalt"] {
        let surface = catseye::geom::Surface::of(&material::by_name(name).unwrap(), 77e9).unwrap();
        let mut lowest = [(f64::INFINITY, 0.0); 2];
        for i in 0..=400 {
            let d = 12.0 + 0.01 * i as f64;
            let scene =
                over(name, "point:rcs_dbsm=0", Pose::new(DQuat::IDENTITY, DVec3::new(d, 0.0, target_m)));
            let found = seen_from(&scene, radar_m, &TraceOptions::default());
            assert_eq!(found.list.len(), 4);
            let got = total(&found, k);
            let (r, image) = (d.hypot(target_m - radar_m), d.hypot(target_m + radar_m));
            let (perp, par) = surface.reflection(k, (target_m + radar_m) / image);
            for (p, reflection) in [par, perp].into_iter().enumerate() {
                let field = Complex64::cis(-k * r) / r + reflection * Complex64::cis(-k * image) / image;
                let want = field * field / (4.0 * std::f64::consts::PI).sqrt();
                // V of both ways is not quite the same vector.
                let off = (got[p][p] - want).norm() * d * d;
                assert!(off < 2e-3, "{name} {d} m, {p}: {} {want}", got[p][p]);
                if got[p][p].norm() < lowest[p].0 {
                    lowest[p] = (got[p][p].norm(), d);
                }
            }
        }
        println!("{name}: nulls at {lowest:?}");
        if name == "pec" {
            assert!((lowest[1].1 - 13.48).abs() < 0.07, "{lowest:?}");
        }
    }
}

/// Corner S over a conducting plane: what beams, reciprocals and images give together is what the mirrored corner gives.
#[test]
fn a_corner_over_a_plane_is_what_image_theory_says() {
    use catseye::rcs::{Aspect, BistaticAspect, Distance, Ground, RcsOptions};
    let tilt = 0.5f64.sqrt().atan();
    let (radar_m, target_m) = (0.15, 0.35);
    let spec = "trihedral:leg_m=0.1";
    let engine = Engine::open("cpu", Precision::F64).unwrap();
    let (mut worst, mut alone) = (0.0f64, 0.0f64);
    for d in [3.0, 4.4, 5.9, 7.7, 9.1, 11.0, 13.0, 14.2, 17.5, 22.0, 30.0] {
        let yaw = std::f64::consts::PI;
        let pose = Pose::from_yaw_pitch_roll(DVec3::new(d, 0.0, target_m), yaw, tilt, 0.0);
        let options = TraceOptions { bounces: 3, accuracy_db: 0.05, ..Default::default() };
        let found = seen_from(&over("pec", spec, pose), radar_m, &options);
        let got = total(&found, wavenumber(77e9));
        let free = TraceOptions { bounces: 3, images: false, ..options };
        let without = total(&seen_from(&over("pec", spec, pose), radar_m, &free), wavenumber(77e9));
        let mut scene = Reflector::parse(spec).unwrap().to_scene(&material::by_name).unwrap();
        scene.objects[0].pose = Pose::from_yaw_pitch_roll(DVec3::Z * target_m, 0.0, tilt, 0.0);
        let aspect = Aspect { azimuth: 0.0, elevation: radar_m.atan2(d) };
        let options = RcsOptions {
            distance: Distance::At(d.hypot(radar_m)),
            ground: Ground::Plane(Material::pec()),
            accuracy_db: 0.05,
            last: false,
            ..Default::default()
        };
        let s = engine.rcs(&scene, &[77e9], &[BistaticAspect::monostatic(aspect)], &options).unwrap()[0];
        let r2 = d.hypot(radar_m).powi(2);
        let db = |z: Complex64| 20.0 * z.norm().log10();
        let (got, want) = (db(got[1][1] * r2), db(s.every[1][1]));
        println!("{d} m: {got:.2} dB, images {want:.2} dB, beams alone {:.2}", db(without[1][1] * r2));
        worst = worst.max((got - want).abs());
        alone = alone.max((db(without[1][1] * r2) - want).abs());
    }
    println!("worst {worst:.2} dB, beams alone {alone:.2} dB");
    // A plane of 80 m is not endless, and beams end at the first order of the change across a facet: 0.28 dB seen.
    assert!(worst < 0.5, "{worst}");
    assert!(alone > 3.0, "{alone}");
}
