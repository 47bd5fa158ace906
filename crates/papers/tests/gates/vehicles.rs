//! Vehicles and people with facets that echo as curved surfaces, against the same bodies cut so finely that flat facets do.

use catseye::base::convention::Convention;
use catseye::base::frames::Pose;
use catseye::base::held::Held;
use catseye::base::units::wavenumber;
use catseye::engine::{Engine, Precision};
use catseye::geom::curved::{refined_scene, sized_within};
use catseye::geom::{Facets, RigidScene};
use catseye::road::vehicle::{Kind, vehicle};
use catseye::scene::{Scene, material, radar_toml};
use catseye::trace::TraceOptions;
use glam::{DQuat, DVec3};
use num_complex::Complex64;
use std::collections::BTreeMap;

/// Range cell, m.
const CELL_M: f64 = 0.15;
/// Aspects that are averaged, and the angle between them, rad: some lobes of a body of a few metres.
const ASPECTS: usize = 8;
const STEP_RAD: f64 = 0.013;

/// Power in all range cells over some aspects, and the mean range of that power, m.
struct Level {
    power: f64,
    range_m: f64,
    triangles: usize,
}

impl Level {
    /// A body seen from `range_m` ahead of it once it is turned by `yaw_rad`, and from the aspects that follow.
    fn of(rigid: &RigidScene<'_>, triangles: usize, [range_m, yaw_rad]: [f64; 2]) -> Level {
        let radar = radar_toml::preset("front77").unwrap();
        let k = wavenumber(radar.carrier_hz);
        let options = TraceOptions {
            bounces: 1,
            images: false,
            convention: Convention::Every,
            bandwidth_hz: radar.bandwidth_hz(),
            ..TraceOptions::default()
        };
        let engine = Engine::Cpu(Precision::F64);
        let geometry = rigid.at(0.0, 0.0).unwrap();
        let (mut power, mut first) = (0.0, 0.0);
        for i in 0..ASPECTS {
            // The radar goes around the body, which is prepared once.
            let turn = DQuat::from_rotation_z(-(yaw_rad + STEP_RAD * i as f64));
            let pose = Pose::new(turn, turn * (DVec3::NEG_X * range_m));
            let echoes = engine.echoes(&geometry, &radar, &pose, DVec3::ZERO, &options);
            let mut cells: BTreeMap<i64, Complex64> = BTreeMap::new();
            for e in &echoes.list {
                let cell = (0.5 * e.path_length_m / CELL_M).round() as i64;
                *cells.entry(cell).or_default() += e.path_gain[0][0] * Complex64::cis(-k * e.path_length_m);
            }
            for (cell, sum) in cells {
                power += sum.norm_sqr();
                first += sum.norm_sqr() * cell as f64 * CELL_M;
            }
        }
        Level { power, range_m: first / power, triangles }
    }
}

/// Prints the levels of a body for each range, m, and yaw, rad, and gives by how much, dB, and by how far, m, the frame's facets are off fine
/// flat ones.
fn compare(kind: Kind, stands: &[[f64; 2]], fine_m: f64) -> Vec<[f64; 2]> {
    let body = vehicle(kind, &material::by_name).unwrap();
    let carrier_hz = radar_toml::preset("front77").unwrap().carrier_hz;
    let mut scene = Scene::default();
    body.add_to(&mut scene, "body", Pose::new(DQuat::IDENTITY, DVec3::NEG_Z * 0.6), 0.0, 0.25);
    let frame = sized_within(&scene, 0.2, wavenumber(carrier_hz), 50_000).unwrap();
    let fine = refined_scene(&scene, fine_m).unwrap();
    let rigid = [(&*frame, Facets::Curved), (&*fine, Facets::Flat), (&scene, Facets::Flat)]
        .map(|(s, f)| (s.triangle_count(), RigidScene::new(Held::Borrowed(s), carrier_hz, f).unwrap()));
    let of_one = |stand: &[f64; 2]| {
        let [frame, fine, file] = [0, 1, 2].map(|i| Level::of(&rigid[i].1, rigid[i].0, *stand));
        let over = |a: &Level| 10.0 * (a.power / fine.power).log10();
        println!(
            "{} at {} m, {} rad: {:+.2} dB and {:+.3} m off {} flat facets with {}; the file's {} flat ones {:+.2} dB",
            kind.name(),
            stand[0],
            stand[1],
            over(&frame),
            frame.range_m - fine.range_m,
            fine.triangles,
            frame.triangles,
            file.triangles,
            over(&file),
        );
        [over(&frame), frame.range_m - fine.range_m]
    };
    stands.iter().map(of_one).collect()
}

/// The file's own facets, taken for flat, are 1.5 to 3.5 dB off here. Flat facets of 0.1 mm sagitta still are 0.3 dB off those of 0.025 mm.
#[test]
fn a_pedestrian_of_few_facets_returns_what_one_of_many_does() {
    for [off_db, off_m] in compare(Kind::Pedestrian, &[[6.0, 1.45], [60.0, 1.45]], 2.5e-5) {
        assert!(off_db.abs() < 0.5, "{off_db:.2} dB");
        assert!(off_m.abs() < 0.25 * CELL_M, "{off_m:.3} m");
    }
}

/// The table of benches/RESULTS.md. CATSEYE_LOOKS chooses kinds whose name contains it, CATSEYE_SAGITTA_UM how fine the flat facets are.
#[test]
#[ignore = "ten minutes; prints a table"]
fn all_kinds() {
    let only = std::env::var("CATSEYE_LOOKS").unwrap_or_default();
    let sagitta_um = std::env::var("CATSEYE_SAGITTA_UM").ok().and_then(|s| s.parse().ok()).unwrap_or(100.0);
    for kind in Kind::ALL.into_iter().filter(|k| k.name().contains(&only)) {
        compare(kind, &[[6.0, 0.3], [6.0, 1.45], [60.0, 0.3], [60.0, 1.45]], 1e-6 * sagitta_um);
    }
}
