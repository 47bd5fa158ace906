//! Vehicles and people as the rest of the chain sees them: sound meshes, glTF there and back, and cross
//! sections beside published ones.

use catseye::engine::{Engine, Precision};
use catseye::frames::Pose;
use catseye::geom::validate::check_scene;
use catseye::rcs::{Aspect, BistaticAspect, Distance, RcsOptions};
use catseye::road::vehicle::{Kind, vehicle};
use catseye::scene::gltf::{ImportOptions, import_bytes, to_glb};
use catseye::scene::{Scene, material};
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

/// Cross sections in VV, dBsm, sorted, from a radar 0.5 m over the road.
fn levels_dbsm(scene: &Scene, range_m: f64, step_deg: f64) -> Vec<f64> {
    let elevation = (0.5 / range_m).asin();
    let looks: Vec<BistaticAspect> = (0..(360.0 / step_deg) as usize)
        .map(|i| {
            BistaticAspect::monostatic(Aspect { azimuth: (i as f64 * step_deg).to_radians(), elevation })
        })
        .collect();
    let options = RcsOptions {
        distance: Distance::At(range_m),
        accuracy_db: 6.0,
        last: false,
        ..RcsOptions::default()
    };
    let engine = Engine::open("cpu", Precision::F64).unwrap();
    let found = engine.rcs(scene, &[77e9], &looks, &options).unwrap();
    let mut levels: Vec<f64> =
        found.iter().map(|s| 10.0 * (4.0 * PI * s.every[0][0].norm_sqr()).log10()).collect();
    levels.sort_by(f64::total_cmp);
    levels
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
        let levels = levels_dbsm(&scene(kind, speed, time), range_m, 7.3);
        let at = |share: f64| levels[(share * (levels.len() - 1) as f64) as usize];
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
