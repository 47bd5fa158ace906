use super::*;
use crate::road::shape::{area_vector_m2, is_watertight, volume_m3};
use crate::scene::Mesh;
use crate::scene::material;

fn body(kind: Kind) -> Body {
    vehicle(kind, &material::by_name).unwrap()
}

fn is_mirror_image(mesh: &Mesh, y: f64) -> bool {
    let key = |p: DVec3| [p.x, p.y, p.z].map(|c| (c * 1e6).round() as i64);
    let there: std::collections::HashSet<[i64; 3]> =
        mesh.positions_m.iter().flat_map(|p| near(key(*p))).collect();
    mesh.positions_m.iter().all(|p| there.contains(&key(DVec3::new(p.x, 2.0 * y - p.y, p.z))))
}

/// A key and its neighbours, so that rounding cannot part two equal places.
fn near([x, y, z]: [i64; 3]) -> Vec<[i64; 3]> {
    let d = |i: i64| [i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1];
    (0..27).map(d).map(|[i, j, k]| [x + i, y + j, z + k]).collect()
}

#[test]
fn kinds_have_names_and_a_wrong_one_is_told() {
    for kind in Kind::ALL {
        assert_eq!(kind.name().parse::<Kind>().unwrap(), kind);
    }
    let e = "hatchbak".parse::<Kind>().unwrap_err();
    assert_eq!(e.exit_code(), 2);
    let e = e.to_string();
    assert!(e.contains("did you mean 'hatchback'?") && e.contains("semi-trailer"), "{e}");
}

/// Length, width, height (mirrors included) and the number of triangles.
#[test]
fn sizes_and_triangles() {
    let expected = [
        (Kind::Sedan, [4.70, 2.12, 1.45], 0.04, 2000),
        (Kind::Hatchback, [4.29, 2.10, 1.48], 0.04, 2000),
        (Kind::Suv, [4.52, 2.16, 1.66], 0.04, 2000),
        (Kind::Van, [5.95, 2.50, 2.55], 0.04, 2000),
        (Kind::Truck, [8.51, 2.96, 3.60], 0.04, 2000),
        (Kind::SemiTrailer, [16.46, 2.96, 4.00], 0.04, 2000),
        (Kind::Motorcycle, [2.05, 0.88, 1.70], 0.15, 2000),
        (Kind::Cyclist, [1.74, 0.65, 1.75], 0.15, 2000),
    ];
    for (kind, size, slack, least) in expected {
        let b = body(kind);
        let (lo, hi) = b.bounds_m(0.0, 0.0);
        assert!((hi - lo - DVec3::from(size)).abs().max_element() < slack, "{kind:?}: {}", hi - lo);
        assert!((-1e-3..0.02).contains(&lo.z), "{kind:?} stands on the road: {}", lo.z);
        assert!((lo.x + hi.x).abs() < 0.16, "{kind:?} is about its middle: {} {}", lo.x, hi.x);
        assert!((least..60_000).contains(&b.triangle_count()), "{kind:?}: {}", b.triangle_count());
    }
    for (kind, stature) in [(Kind::Pedestrian, 1.75), (Kind::Child, 1.22)] {
        let (lo, hi) = body(kind).bounds_m(0.0, 0.0);
        assert!((hi.z - stature).abs() < 1e-3 && lo.z.abs() < 0.03, "{lo} {hi}");
        assert!((0.25..0.36).contains(&((hi.y - lo.y) / stature)), "{lo} {hi}");
    }
}

#[test]
fn every_part_is_closed_and_looks_outwards() {
    for kind in Kind::ALL {
        for part in &body(kind).parts {
            let name = format!("{kind:?} {}", part.name);
            assert!(is_watertight(&part.mesh), "{name}");
            let least = if part.name == "body" { 5.0 } else { 0.0 };
            assert!(volume_m3(&part.mesh) > least, "{name}");
            for t in 0..part.mesh.triangles.len() {
                let area = area_vector_m2(&part.mesh, t);
                assert!(area.length() > 1e-10, "{name}: triangle {t} has no area");
                // The normals of the smooth surface are those of its facets, by and large.
                if let Some(normals) = part.mesh.corner_normals(t) {
                    for n in normals {
                        assert!((n.length() - 1.0).abs() < 1e-9, "{name}");
                        assert!(n.dot(area.normalize()) > 0.5, "{name}: {n} {area}");
                    }
                }
            }
        }
    }
}

#[test]
fn left_is_the_mirror_image_of_right() {
    for kind in [Kind::Sedan, Kind::Hatchback, Kind::Suv, Kind::Van] {
        let b = body(kind);
        // The exhaust is on one side; the skin and the mirrors are on both.
        let mut skin = b.parts[0].mesh.clone();
        let floor = skin.positions_m.iter().map(|p| p.z).fold(f64::MAX, f64::min) + 0.2;
        skin.positions_m.retain(|p| p.z > floor);
        assert!(is_mirror_image(&skin, 0.0), "{kind:?}");
        for pair in b.parts[1..].chunks(2) {
            let (l, r) = (pair[0].pose.translation_m, pair[1].pose.translation_m);
            assert_eq!((l.x, l.y, l.z), (r.x, -r.y, r.z));
        }
    }
    let walker = body(Kind::Pedestrian);
    assert!(is_mirror_image(&walker.parts[0].mesh, 0.0));
}

/// Wheels roll on the road: in the world the lowest point of each tyre stands still, and the objects of a
/// scene have their origins' velocities.
#[test]
fn wheels_roll_and_objects_move() {
    let speed = 13.9;
    for kind in [Kind::Sedan, Kind::Truck, Kind::SemiTrailer, Kind::Motorcycle, Kind::Cyclist] {
        let b = body(kind);
        let wheels: Vec<&Part> = b.parts.iter().filter(|p| p.suffix == "wheel").collect();
        assert!(!wheels.is_empty());
        for w in &wheels {
            let m = w.pose_at(speed, 0.37);
            let down = m.pose.rotation.inverse() * DVec3::new(0.0, 0.0, -m.pose.translation_m.z);
            assert!((m.velocity_at(down) + DVec3::X * speed).length() < 1e-9, "{kind:?} {}", w.name);
        }
        let mut scene = Scene::default();
        let yaw = Pose::from_yaw_pitch_roll(DVec3::new(20.0, 3.0, 0.0), 1.2, 0.0, 0.0);
        b.add_to(&mut scene, "x", yaw, speed, 0.37);
        for (o, p) in scene.objects.iter().zip(&b.parts) {
            assert!(o.class.starts_with(kind.class()));
            if p.suffix == "wheel" || !p.moves() {
                assert!((o.velocity_mps - yaw.direction(DVec3::X * speed)).length() < 1e-9);
            }
        }
    }
}

/// At no time does a part of a walker or a cyclist leave the others: joints hold.
#[test]
fn limbs_hang_together() {
    for (kind, speed) in [(Kind::Pedestrian, 1.4), (Kind::Child, 1.1), (Kind::Cyclist, 5.0)] {
        let b = body(kind);
        let part = |name: &str| b.parts.iter().find(|p| p.name == name).unwrap();
        for i in 0..30 {
            let t = 0.05 * f64::from(i);
            for side in ["left", "right"] {
                let (thigh, shank) = (part(&format!("thigh {side}")), part(&format!("shank {side}")));
                let (m, n) = (thigh.pose_at(speed, t), shank.pose_at(speed, t));
                let knee = m.pose.inverse().point(n.pose.translation_m);
                assert!(knee.x.abs() < 1e-12 && knee.y.abs() < 1e-12 && knee.z < 0.0);
                assert!((m.velocity_at(knee) - n.velocity_mps).length() < 1e-9);
            }
            let (lo, _) = b.bounds_m(speed, t);
            assert!(lo.z > -0.06, "{kind:?} at {t}: {}", lo.z);
        }
    }
}
