//! Ghosts in walls, and roads that are not quite flat.

use catseye::base::frames::{Pose, Sensor, Target, World, angles_from_direction};
use catseye::base::units::wavenumber;
use catseye::geom::{Geometry, Surface};
use catseye::road::objects::ground;
use catseye::road::reflector::Reflector;
use catseye::scene::{Mesh, Scene, material};
use catseye::trace::cpu::echoes;
use catseye::trace::windows::around;
use catseye::trace::{Echo, TraceOptions};
use glam::{DQuat, DVec2, DVec3};
use num_complex::Complex64;
use std::f64::consts::{FRAC_PI_2, PI};

const WALL_M: f64 = 3.0;

/// A wall along the road on the left, in the plane y = 3 m.
fn wall(scene: &mut Scene, name: &str) {
    let m = scene.material_index(&material::by_name(name).unwrap());
    let plane = ground(DVec2::new(-20.0, -20.0), DVec2::new(80.0, 20.0), 0.0, m);
    let upright = Pose::new(DQuat::from_rotation_x(FRAC_PI_2), DVec3::Y * WALL_M);
    scene.add_mesh("wall", "wall", plane, upright);
}

fn seen(scene: &Scene, height_m: f64, options: &TraceOptions) -> Vec<Echo> {
    let geometry = Geometry::build(scene, 0.0, 77e9).unwrap();
    let at: Pose<Sensor, World> = Pose::new(DQuat::IDENTITY, DVec3::Z * height_m);
    echoes::echoes(&geometry, &around(&at), &at, DVec3::ZERO, options).list
}

/// A target beside a wall is seen again where its mirror image is, with the wall's Fresnel coefficient for each time it is met, and
/// twice halfway.
#[test]
fn a_wall_shows_a_target_again_at_the_mirror_place() {
    let (k, target, image) = (wavenumber(77e9), DVec3::new(20.0, 1.0, 0.0), DVec3::new(20.0, 5.0, 0.0));
    for name in ["aluminium", "concrete"] {
        let mut scene = Scene::default();
        wall(&mut scene, name);
        let body = Reflector::parse("point:rcs_dbsm=0").unwrap();
        let pose = Pose::new(DQuat::IDENTITY, target + DVec3::Z * 0.5);
        body.add_to(&mut scene, &material::by_name, ("post", ""), pose, DVec3::ZERO).unwrap();
        let found: Vec<Echo> = seen(&scene, 0.5, &TraceOptions::default())
            .into_iter()
            .filter(|r| r.chain.contains(&2))
            .collect();
        assert_eq!(found.len(), 4, "{name}");
        let surface = Surface::of(&material::by_name(name).unwrap(), 77e9).unwrap();
        let (perp, par) = surface.reflection(k, 5.0 / image.length());
        let s = 1.0 / (4.0 * PI).sqrt();
        for r in &found {
            let over = [r.departure, r.arrival].map(|d| angles_from_direction(d).0 > 0.2);
            let length = |over: bool| if over { image.length() } else { target.length() };
            let (out, back) = (length(over[0]), length(over[1]));
            assert!((r.path_length_m - out - back).abs() < 1e-9);
            let times = over.iter().filter(|o| **o).count() as i32;
            // V stands across the plane of incidence; H lies in it, and the two ways' H at the target are not parallel.
            for (p, coefficient) in [perp, par].into_iter().enumerate().filter(|(p, _)| times != 1 || *p == 0)
            {
                let want = coefficient.norm().powi(times) * s / (out * back);
                let off = (r.path_gain[p][p].norm() / want - 1.0).abs();
                assert!(off < 1e-9, "{name} {times} {p}: {off}");
            }
            if times == 2 {
                let (azimuth, _) = angles_from_direction(r.arrival);
                assert!(
                    (azimuth - 5f64.atan2(20.0)).abs() < 1e-12 && (r.range_m() - image.length()).abs() < 1e-9
                );
            }
        }
    }
}

/// Mean of |sum|^2 over a band in which a body's corners beat.
fn mean_power(list: &[Echo]) -> f64 {
    let n = 64;
    (0..n)
        .map(|i| {
            let k = wavenumber(76.5e9 + 1e9 * i as f64 / n as f64);
            let z: Complex64 =
                list.iter().map(|r| r.path_gain[0][0] * Complex64::cis(-k * r.path_length_m)).sum();
            z.norm_sqr() / n as f64
        })
        .sum()
}

fn body(scene: &mut Scene, spec: &str, pose: Pose<Target, World>) {
    Reflector::parse(spec)
        .unwrap()
        .add_to(scene, &material::by_name, ("body", ""), pose, DVec3::ZERO)
        .unwrap();
}

/// A mesh beside a smooth metal wall: what comes back over the wall both ways is what the mirrored mesh gives at the mirror place.
#[test]
fn a_mesh_has_its_ghost_in_a_metal_wall() {
    let options = TraceOptions { bounces: 3, accuracy_db: 0.1, ..Default::default() };
    // Planes through the body's own plane of symmetry mirror into themselves: turned the other way it is its image.
    for (spec, yaw) in [
        ("plate:width_m=0.3,height_m=0.2", PI - 0.33),
        ("trihedral:leg_m=0.15", PI - 0.25),
        ("dihedral:width_m=0.2,height_m=0.2", PI - 0.3),
    ] {
        let at = |y: f64, yaw: f64| Pose::from_yaw_pitch_roll(DVec3::new(15.0, y, 0.5), yaw, 0.0, 0.0);
        let mut both = Scene::default();
        wall(&mut both, "pec");
        body(&mut both, spec, at(1.2, yaw));
        let all = seen(&both, 0.5, &options);
        let ghost: Vec<Echo> = all
            .into_iter()
            .filter(|r| {
                let left = |d: DVec3| angles_from_direction(d).0 > 0.2;
                r.chain.contains(&2) && left(r.departure) && left(r.arrival)
            })
            .collect();
        let mut mirrored = Scene::default();
        body(&mut mirrored, spec, at(2.0 * WALL_M - 1.2, -yaw));
        let want = mean_power(&seen(&mirrored, 0.5, &options));
        let got = mean_power(&ghost);
        let off = 10.0 * (got / want).log10();
        println!("{spec}: {} echoes, {:.2} dB, ghost {off:+.2} dB of it", ghost.len(), 10.0 * want.log10());
        assert!(off.abs() < 0.5, "{spec}: {off}");
    }
}

/// A road of facets along x on a parabola of this radius of curvature (above 0: a sag), 20 m wide.
fn curved_road(radius_m: f64, facet_m: f64) -> Mesh {
    let (first, last) = (-20.0, 100.0);
    let n = ((last - first) / facet_m).round() as u32;
    let mut mesh = Mesh::default();
    for i in 0..=n {
        let x = first + (last - first) * f64::from(i) / f64::from(n);
        let z = x * x / (2.0 * radius_m);
        mesh.positions_m.extend([DVec3::new(x, -10.0, z), DVec3::new(x, 10.0, z)]);
        if i > 0 {
            let b = 2 * i;
            mesh.triangles.extend([[b - 2, b, b + 1], [b - 2, b + 1, b - 1]]);
            mesh.material.extend([0, 0]);
        }
    }
    mesh
}

/// A point over a road with a vertical curve, the pattern of its two-ray sum: with little curvature the flat road's, however many facets
/// share in its mirror; each facet brings its own share, so that there are no gaps over crests.
#[test]
fn vertical_curves() {
    let k = wavenumber(77e9);
    let (radar_m, target_m) = (0.5, 0.6);
    for (radius_m, facet_m) in [
        (1e7, 5.0),
        (-1e7, 5.0),
        (20e3, 5.0),
        (-20e3, 5.0),
        (-20e3, 1.0),
        (-2e3, 5.0),
        (-2e3, 1.0),
        (2e3, 1.0),
    ] {
        let (mut none, mut one, mut more, mut worst) = (0, 0, 0, 0.0f64);
        let steps = 200;
        for i in 0..steps {
            let d = 20.0 + 20.0 * f64::from(i) / f64::from(steps);
            let mut scene = Scene::default();
            scene.materials.push(material::by_name("pec").unwrap());
            scene.add_mesh("road", "road", curved_road(radius_m, facet_m), Pose::IDENTITY);
            let place = DVec3::new(d, 0.0, target_m + d * d / (2.0 * radius_m));
            body(&mut scene, "point:rcs_dbsm=0", Pose::new(DQuat::IDENTITY, place));
            let found: Vec<Echo> = seen(&scene, radar_m, &TraceOptions::default())
                .into_iter()
                .filter(|r| r.chain.contains(&2))
                .collect();
            // Ways out, from those that come back straight.
            let ways = (found.len() as f64).sqrt().round() as usize;
            match ways {
                1 => none += 1,
                2 => one += 1,
                _ => more += 1,
            }
            let (r, image) = (d.hypot(target_m - radar_m), d.hypot(target_m + radar_m));
            let field = Complex64::cis(-k * r) / r - Complex64::cis(-k * image) / image;
            let got: Complex64 =
                found.iter().map(|r| r.path_gain[1][1] * Complex64::cis(-k * r.path_length_m)).sum();
            let peak = 4.0 / (d * d * (4.0 * PI).sqrt());
            let want = field * field / (4.0 * PI).sqrt();
            worst = worst.max((got.norm() - want.norm()).abs() / peak);
        }
        println!(
            "radius {radius_m:.0} m, facets {facet_m} m: no mirror {none}, one {one}, more {more} of {steps}; \
             off the flat road by {worst:.3} of the peak"
        );
        assert!(none == 0, "{radius_m} {none} {one} {more}");
        if radius_m.abs() > 1e6 {
            assert!(worst < 0.02, "{radius_m} {worst} {one} {more}");
        }
    }
}

/// The places of an echo's bounces make up its path, and each lies on the object that the chain names there: asked for of all, otherwise
/// of the first and the last.
#[test]
fn places_of_bounces_make_up_the_path() {
    let mut scene = Scene::default();
    wall(&mut scene, "aluminium");
    let m = scene.material_index(&material::by_name("asphalt").unwrap());
    let plane = ground(DVec2::new(-20.0, -20.0), DVec2::new(80.0, 20.0), 0.0, m);
    scene.add_mesh("road", "road", plane, Pose::IDENTITY);
    let turned = Pose::new(DQuat::from_rotation_z(0.3), DVec3::new(15.0, 0.5, 0.2));
    body(&mut scene, "trihedral:leg_m=0.3", turned);
    let at = Pose::new(DQuat::IDENTITY, DVec3::new(22.0, -1.0, 0.8));
    let point = Reflector::parse("point:rcs_dbsm=0").unwrap();
    point.add_to(&mut scene, &material::by_name, ("post", ""), at, DVec3::ZERO).unwrap();
    let height_m = 0.6;
    let options = TraceOptions { bounces: 5, places: true, ..TraceOptions::default() };
    let list = seen(&scene, height_m, &options);
    let mut by_bounces = [0; 8];
    for r in &list {
        let places = r.places_m().unwrap();
        assert_eq!(places.len(), usize::from(r.bounces));
        by_bounces[places.len()] += 1;
        let stops: Vec<DVec3> = [&[DVec3::ZERO], &places[..], &[DVec3::ZERO]].concat();
        let length: f64 = stops.windows(2).map(|w| w[0].distance(w[1])).sum();
        assert!((length - r.path_length_m).abs() < 1e-6, "{length} {r:?}");
        for (place, id) in places.iter().zip(r.chain) {
            let off = match id {
                1 => place.y - WALL_M,
                2 => place.z + height_m,
                3 => (*place + DVec3::Z * (height_m - 0.2) - DVec3::new(15.0, 0.5, 0.0)).length() - 0.2,
                4 => place.distance(DVec3::new(22.0, -1.0, 0.8 - height_m)),
                _ => panic!("{id}"),
            };
            assert!(off.abs() < if id == 3 { 0.35 } else { 1e-9 }, "{off} {id} {r:?}");
        }
    }
    assert!(by_bounces[1..5].iter().all(|n| *n > 0), "{by_bounces:?}");
    let plain = seen(&scene, height_m, &TraceOptions { places: false, ..options });
    assert_eq!(plain.len(), list.len());
    for (r, with) in plain.iter().zip(&list) {
        assert_eq!(r.places_m().is_some(), r.bounces < 3);
        assert_eq!(*r, Echo { between_m: Box::default(), ..with.clone() });
    }
}
