//! Vehicles and people as the rest of the chain sees them: sound meshes, glTF there and back, and cross
//! sections beside published ones.

use catseye::base::frames::Pose;
use catseye::engine::{Engine, Precision};
use catseye::geom::validate::check_scene;
use catseye::rcs::{Aspect, BistaticAspect, Distance, RcsOptions};
use catseye::road::vehicle::{Kind, vehicle};
use catseye::scene::gltf::{ImportOptions, import_bytes, to_glb};
use catseye::scene::scenario::{self, SitedScenario};
use catseye::scene::{Scene, material};
use catseye::simulate::{Prepared, simulate};
use glam::DVec3;
use std::collections::BTreeMap;
use std::f64::consts::{LN_10, PI};
use std::path::Path;

fn scene(kind: Kind, speed_mps: f64, time_s: f64) -> Scene {
    let mut scene = Scene::default();
    let body = vehicle(kind, &material::by_name).unwrap();
    body.add_to(&mut scene, "it", Pose::IDENTITY, speed_mps, time_s);
    scene
}

#[test]
fn the_engine_finds_nothing_wrong_with_them() {
    for kind in Kind::ALL {
        for (name, report) in check_scene(&scene(kind, 0.0, 0.0), 77e9).unwrap() {
            assert!(report.error().is_none() && report.degenerate == 0, "{kind:?} {name}: {report:?}");
            assert_eq!((report.open_edges, report.non_manifold_edges), (0, 0), "{kind:?} {name}");
            assert_eq!((report.inconsistent_edges, report.duplicates), (0, 0), "{kind:?} {name}");
            assert!(report.curved_facets > 0 || report.triangles < 500, "{kind:?} {name}: {report:?}");
        }
    }
}

#[test]
fn a_gltf_brings_them_back() {
    for kind in [Kind::Sedan, Kind::SemiTrailer] {
        let there = scene(kind, 10.0, 0.2);
        let bytes = to_glb(&there).unwrap();
        let back = import_bytes(&bytes, Path::new("vehicle.glb"), None, &ImportOptions::default()).unwrap();
        assert_eq!(back.objects.len(), there.objects.len());
        assert_eq!(back.triangle_count(), there.triangle_count());
        for (a, b) in there.objects.iter().zip(&back.objects) {
            assert_eq!((&a.name, &a.class, a.id), (&b.name, &b.class, b.id));
            assert!((a.velocity_mps - b.velocity_mps).length() < 1e-5);
            assert!((a.pose.translation_m - b.pose.translation_m).length() < 1e-5);
        }
        for m in &there.materials {
            assert!(back.materials.contains(m), "{}", m.name);
        }
    }
}

/// Cross sections in VV, dBsm, at azimuths, from a radar 0.5 m over the road.
fn levels_dbsm(scene: &Scene, range_m: f64, azimuths_deg: impl Iterator<Item = f64>) -> Vec<f64> {
    let elevation = (0.5 / range_m).asin();
    let looks: Vec<BistaticAspect> = azimuths_deg
        .map(|a| BistaticAspect::monostatic(Aspect { azimuth: a.to_radians(), elevation }))
        .collect();
    let options = RcsOptions {
        distance: Distance::At(range_m),
        accuracy_db: 6.0,
        last: false,
        ..RcsOptions::default()
    };
    let engine = Engine::open("cpu", Precision::F64).unwrap();
    let found = engine.rcs(scene, &[77e9], &looks, &options).unwrap();
    found.iter().map(|s| 10.0 * (4.0 * PI * s.every[0][0].norm_sqr()).log10()).collect()
}

/// Level that a share of the list does not exceed.
fn quantile(levels: &mut [f64], share: f64) -> f64 {
    levels.sort_by(f64::total_cmp);
    levels[(share * (levels.len() - 1) as f64) as usize]
}

/// 3GPP TR 38.901 V19.4.0, clause 7.9.2: the cross section is log-normal about its mean with the standard
/// deviation given there in dB, so the median lies ln(10)/20 times its square lower. Between the lobes a vehicle
/// (table 7.9.2.1-4) has a mean of 7.07 dBsm with 3.41 dB, at its sides 20.75 dBsm; a human (table
/// 7.9.2.1-1) -1.37 dBsm with 3.94 dB. The tables are for bands below ours.
fn median_dbsm(mean_dbsm: f64, sigma_db: f64) -> f64 {
    mean_dbsm - LN_10 / 20.0 * sigma_db * sigma_db
}

#[test]
#[ignore = "minutes of computing: cargo test --release -p catseye --test simulator vehicles -- --ignored --nocapture"]
fn levels_beside_published_ones() {
    for (kind, range_m, speed, time, mean, sigma) in [
        (Kind::Sedan, 30.0, 0.0, 0.0, 7.07, 3.41),
        (Kind::Hatchback, 30.0, 0.0, 0.0, 7.07, 3.41),
        (Kind::Suv, 30.0, 0.0, 0.0, 7.07, 3.41),
        (Kind::Pedestrian, 15.0, 1.4, 0.27, -1.37, 3.94),
    ] {
        let around = (0..49).map(|i| 7.3 * f64::from(i));
        let mut levels = levels_dbsm(&scene(kind, speed, time), range_m, around);
        let mut at = |share: f64| quantile(&mut levels, share);
        let expected = median_dbsm(mean, sigma);
        println!(
            "{:12} 10 % {:6.1}  median {:6.1} (published {expected:.1})  90 % {:6.1}  greatest {:6.1} dBsm",
            kind.name(),
            at(0.1),
            at(0.5),
            at(0.9),
            at(1.0)
        );
        assert!((at(0.5) - expected).abs() < 2.0 * sigma, "{kind:?}: {}", at(0.5));
    }
}

/// The table of docs/trust.md: what comes back from the rear and the side of a body, by distance.
#[test]
#[ignore = "minutes of computing: cargo test --release -p catseye --test simulator vehicles::levels_by -- --ignored --nocapture"]
fn levels_by_distance() {
    for kind in [Kind::Sedan, Kind::Hatchback, Kind::Cyclist, Kind::Pedestrian] {
        for middle_deg in [180.0, 90.0, 135.0] {
            for range_m in [5.0, 7.0, 10.0, 20.0, 40.0, 60.0, 80.0, 150.0] {
                let fan = (-12..=12).map(|i| middle_deg + 0.25 * f64::from(i));
                let mut levels = levels_dbsm(&scene(kind, 0.0, 0.27), range_m, fan);
                let mean = levels.iter().map(|l| 10f64.powf(0.1 * l)).sum::<f64>() / levels.len() as f64;
                let mut at = |share: f64| quantile(&mut levels, share);
                println!(
                    "{:12} {middle_deg:4} deg {range_m:4} m: mean {:5.1} dBsm, median {:5.1}, 10 % {:5.1}, greatest {:5.1}",
                    kind.name(),
                    10.0 * mean.log10(),
                    at(0.5),
                    at(0.1),
                    at(1.0)
                );
            }
        }
    }
}

/// The radar front77 half a metre over the origin.
fn watching() -> SitedScenario {
    let text = "name = \"it\"\nradar = \"front77\"\n[[point]]\nposition_m = [500, 0, 0]\nrcs_dbsm = 0\n";
    let mut s = scenario::parse(Path::new("s.toml"), text).unwrap().without_roads().unwrap();
    s.ego.position_m = DVec3::Z * 0.5 - s.radars[0].mounting.translation_m;
    s
}

/// Somebody at `range_m` ahead, seen from `aspect_deg` (0: from the front, 90: from the left), under way at `speed_mps`.
fn ahead(kind: Kind, range_m: f64, aspect_deg: f64, speed_mps: f64, time_s: f64) -> Scene {
    let mut scene = Scene::default();
    let yaw = PI - aspect_deg.to_radians();
    let pose = Pose::from_yaw_pitch_roll(DVec3::X * range_m, yaw, 0.0, 0.0);
    vehicle(kind, &material::by_name).unwrap().add_to(&mut scene, "it", pose, speed_mps, time_s);
    scene
}

/// Cross section by class of the part that scattered last, m²: what its echoes bring, summed as powers.
fn sections_m2(scene: &Scene) -> BTreeMap<String, f64> {
    let scenario = watching();
    let engine = Engine::Cpu(Precision::F64);
    let received = Prepared::new(&scenario, scene).unwrap().echoes(&engine, 0, 0).unwrap();
    let mut sections = BTreeMap::new();
    for e in &received.echoes.list {
        let part = scene.objects.iter().find(|o| o.id == e.object_id());
        let s = e.path_gain[0][0] * e.range_m().powi(2);
        *sections.entry(part.map_or("", |o| &*o.class).to_string()).or_insert(0.0) += 4.0 * PI * s.norm_sqr();
    }
    sections
}

/// Over 36 aspects a cyclist's body and the bicycle return more than its cranks and pedals, and a frame of the usual radar
/// has points of them.
#[test]
fn cyclists_are_more_than_their_cranks() {
    let dbsm = |x: f64| 10.0 * x.max(1e-9).log10();
    let (mut more, mut by_part): (u32, BTreeMap<String, Vec<f64>>) = (0, BTreeMap::new());
    for i in 0..36 {
        // Another place of the cranks each time.
        let scene = ahead(Kind::Cyclist, 15.0, 10.0 * f64::from(i), 5.0, 0.137 * f64::from(i));
        let sections = sections_m2(&scene);
        let of = |name: &str| sections.get(name).copied().unwrap_or(0.0);
        let all: f64 = sections.values().sum();
        let crank = of("cyclist.crank");
        more += u32::from(all - crank > crank);
        let list: Vec<String> = sections.iter().map(|(k, v)| format!("{k} {:.1}", dbsm(*v))).collect();
        println!("{:4} deg: {:.1} dBsm; {}", 10 * i, dbsm(all), list.join(", "));
        sections.iter().for_each(|(k, v)| by_part.entry(k.clone()).or_default().push(dbsm(*v)));
        by_part.entry("all".into()).or_default().push(dbsm(all));
    }
    for (part, mut levels) in by_part {
        let mut at = |share: f64| quantile(&mut levels, share);
        println!(
            "{part:16} 10 % {:6.1}  median {:6.1}  90 % {:6.1}  max {:6.1}",
            at(0.1),
            at(0.5),
            at(0.9),
            at(1.0)
        );
    }
    println!("more than the cranks in {more} of 36");
    assert!(more >= 34, "{more}");
    let mut riders = 0;
    for aspect in [0.0, 40.0, 90.0, 180.0] {
        let scene = ahead(Kind::Cyclist, 15.0, aspect, 5.0, 0.3);
        let frame = simulate(&Engine::Cpu(Precision::F32), &watching(), &scene, 0).unwrap();
        let list: Vec<String> =
            frame.points.iter().map(|p| format!("{} {:.1}", p.class, p.rcs_dbsm)).collect();
        println!("15 m, {aspect} deg: {}", list.join(", "));
        let of = |class: &[&str]| frame.points.iter().any(|p| class.contains(&&*p.class));
        assert!(of(&["cyclist", "cyclist.wheel", "cyclist.rider", "cyclist.leg"]), "{aspect}");
        riders += u32::from(of(&["cyclist.rider", "cyclist.leg"]));
    }
    assert!(riders >= 3, "{riders}");
}

/// A vehicle as a point: the radar meets one point of that level in the middle of its box and none of its faces, while boxes and
/// masks are those of the vehicle itself.
#[test]
fn a_vehicle_scatters_as_a_point_and_keeps_its_body() {
    use catseye::base::frames::Pose;
    use catseye::base::held::Held;
    use catseye::geom::{Facets, RigidScene};
    use catseye::road::build::build;
    use catseye::road::mask::{CellClass, Grid, mask};
    use catseye::road::scene_toml::parse;
    use catseye::road::truth::actor_truth;
    use catseye::scene::Scene;
    use catseye::scene::gltf::{self, ImportOptions};
    use std::path::Path;
    let made = |text: &str| build(&parse(Path::new("a.toml"), text).unwrap()).unwrap().0;
    let text = |kind: &str, rcs: &str| {
        format!(
            "name = \"one vehicle\"\n[[road]]\nname = \"r\"\nplan = [{{ kind = \"straight\", length_m = 100 }}]\nsurface = \"none\"\n\
             [[road.right]]\nnumber = 1\nwidth_m = 3.5\n\
             [[road.vehicle]]\nkind = \"{kind}\"\ns_m = 30\nlateral = {{ lane = 1 }}\nspeed_mps = 8\n{rcs}\n"
        )
    };
    for kind in ["passenger-car", "van", "pedestrian"] {
        let (whole, point) = (made(&text(kind, "")), made(&text(kind, "rcs_dbsm = 7.5")));
        let time_s = 0.5;
        let (a, b) = (actor_truth(&whole, time_s), actor_truth(&point, time_s));
        let of = |list: &[(_, catseye::road::truth::TruthBox)]| -> Vec<_> {
            list.iter().map(|(_, t)| (t.id, t.class.clone(), t.centre_m, t.size_m, t.velocity_mps)).collect()
        };
        assert_eq!(of(&a), of(&b), "{kind}");
        let seen = |s: &Scene| mask(&Grid::ROAD, s, time_s, &Pose::IDENTITY, &[], &[CellClass::Vehicle]);
        assert_eq!(seen(&whole), seen(&point), "{kind}");
        let geometry =
            RigidScene::new(Held::Borrowed(&point), 77e9, Facets::Flat).unwrap().at(time_s, 0.0).unwrap();
        assert_eq!(geometry.triangle_count, 0, "{kind}");
        // Nothing is said of a mesh that the radar does not see.
        let checked = |s: &Scene| catseye::geom::validate::check_scene(s, 77e9).unwrap().len();
        assert!(checked(&whole) > 0 && checked(&point) == 0, "{kind}");
        assert_eq!(geometry.points.len(), 1, "{kind}");
        let p = &geometry.points[0];
        let part = point.object_by_id(p.id).unwrap();
        assert_eq!(catseye::road::actors::base_class(&part.class), b[0].1.class, "{kind}");
        assert_eq!(p.rcs_dbsm, 7.5);
        assert!(
            (p.velocity_mps - glam::DVec3::new(8.0, 0.0, 0.0)).length() < 1e-9,
            "{kind}: {}",
            p.velocity_mps
        );
        // The middle of the body as it was built: limbs that swing move the box a little.
        assert!(
            (p.position_m - glam::DVec3::from_array(a[0].1.centre_m)).length() < 0.3,
            "{kind}: {}",
            p.position_m
        );
        // It comes back from a glTF file.
        let bytes = gltf::to_glb(&point).unwrap();
        let back = gltf::import_bytes(&bytes, Path::new("x.glb"), None, &ImportOptions::default()).unwrap();
        let seen = |s: &Scene| -> Vec<bool> { s.objects.iter().map(|o| o.radar).collect() };
        assert_eq!(seen(&back), seen(&point));
        assert_eq!(seen(&point).iter().filter(|r| **r).count(), 1, "{kind}");
    }
}
