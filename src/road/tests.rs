//! The road scenes of the documents, built, measured and read back.

use crate::road::axis::RoadPoint;
use crate::road::build::build;
use crate::road::glb;
use crate::road::labels::RoadTruth;
use crate::road::plan::ScenePlan;
use crate::road::scene_toml::{parse, schema};
use crate::road::shape::area_vector_m2;
use crate::scene::gltf::{self, ImportOptions};
use crate::scene::{Scene, Shape};
use glam::DVec3;
use proptest::prelude::*;
use std::collections::HashSet;
use std::path::Path;

const FILES: [(&str, &str); 30] = [
    ("coded", include_str!("../../scenes/road/road_coded.toml")),
    ("compare", include_str!("../../scenes/road/road_compare.toml")),
    ("compare_bend", include_str!("../../scenes/road/road_compare_bend.toml")),
    ("compare_truck", include_str!("../../scenes/road/road_compare_truck.toml")),
    ("covers", include_str!("../../scenes/road/road_covers.toml")),
    ("crest", include_str!("../../scenes/road/road_crest.toml")),
    ("eight_lanes", include_str!("../../scenes/road/road_eight_lanes.toml")),
    ("eight_lanes_bay", include_str!("../../scenes/road/road_eight_lanes_bay.toml")),
    ("eight_lanes_curve", include_str!("../../scenes/road/road_eight_lanes_curve.toml")),
    ("eight_lanes_ramp", include_str!("../../scenes/road/road_eight_lanes_ramp.toml")),
    ("everything", include_str!("../../scenes/road/road_everything.toml")),
    ("fusion_lanes", include_str!("../../scenes/road/road_fusion_lanes.toml")),
    ("lane_3m", include_str!("../../scenes/road/road_lane_3m.toml")),
    ("lane_3m_bend", include_str!("../../scenes/road/road_lane_3m_bend.toml")),
    ("markers_lane", include_str!("../../scenes/road/road_markers_lane.toml")),
    ("markers_turn", include_str!("../../scenes/road/road_markers_turn.toml")),
    ("metal_plates", include_str!("../../scenes/road/road_metal_plates.toml")),
    ("model_left_curve", include_str!("../../scenes/road/road_model_left_curve.toml")),
    ("model_right_angle_left", include_str!("../../scenes/road/road_model_right_angle_left.toml")),
    ("model_right_angle_right", include_str!("../../scenes/road/road_model_right_angle_right.toml")),
    ("model_right_curve", include_str!("../../scenes/road/road_model_right_curve.toml")),
    ("model_straight", include_str!("../../scenes/road/road_model_straight.toml")),
    ("plates", include_str!("../../scenes/road/road_plates.toml")),
    ("plates_both", include_str!("../../scenes/road/road_plates_both.toml")),
    ("plates_none", include_str!("../../scenes/road/road_plates_none.toml")),
    ("signature", include_str!("../../scenes/road/road_signature.toml")),
    ("sound_wall", include_str!("../../scenes/road/road_sound_wall.toml")),
    ("sound_wall_curve", include_str!("../../scenes/road/road_sound_wall_curve.toml")),
    ("test_field", include_str!("../../scenes/road/road_test_field.toml")),
    ("walled_bend", include_str!("../../scenes/road/road_walled_bend.toml")),
];

fn made(text: &str) -> (ScenePlan, Scene, RoadTruth) {
    let plan = parse(Path::new("a.toml"), text).unwrap();
    let (scene, truth) = build(&plan).unwrap();
    (plan, scene, truth)
}

fn file(name: &str) -> (ScenePlan, Scene, RoadTruth) {
    made(FILES.iter().find(|f| f.0 == name).unwrap().1)
}

fn count(scene: &Scene, class: &str) -> usize {
    scene.objects.iter().filter(|o| o.class == class).count()
}

#[test]
fn all_files_build_and_come_back_from_gltf() {
    for (name, text) in FILES {
        let (_, scene, truth) = made(text);
        let names: HashSet<&str> = scene.objects.iter().map(|o| o.name.as_str()).collect();
        assert_eq!(names.len(), scene.objects.len(), "{name}");
        assert!(scene.objects.iter().all(|o| !o.class.is_empty()), "{name}");
        for (m, mesh) in scene.meshes.iter().enumerate() {
            for t in 0..mesh.triangles.len() {
                assert!(area_vector_m2(mesh, t).length() > 1e-10, "{name} mesh {m} triangle {t}");
            }
        }
        assert!(scene.triangle_count() < 60_000, "{name}: {}", scene.triangle_count());
        let bytes = glb::to_glb(&scene, &truth).unwrap();
        let back = gltf::import_bytes(&bytes, Path::new("x.glb"), None, &ImportOptions::default()).unwrap();
        assert_eq!(back.meshes.len(), scene.meshes.len(), "{name}");
        for (m, (a, b)) in scene.meshes.iter().zip(&back.meshes).enumerate() {
            assert_eq!(a.material, b.material, "{name} mesh {m}");
            for (t, (p, q)) in corners(a).into_iter().zip(corners(b)).enumerate() {
                assert_eq!(p.0, q.0, "{name} mesh {m} triangle {t}");
                assert_eq!(p.1.is_some(), q.1.is_some(), "{name} mesh {m} triangle {t}");
                let normals = p.1.into_iter().flatten().zip(q.1.into_iter().flatten());
                assert!(
                    normals.into_iter().all(|(n, k)| (n - k).length() < 1e-6),
                    "{name} mesh {m} triangle {t}"
                );
            }
        }
        assert_eq!(back.materials, scene.materials, "{name}");
        assert_eq!(back.objects.len(), scene.objects.len());
        for (a, b) in scene.objects.iter().zip(&back.objects) {
            assert_eq!((a.id, &a.name, &a.class, a.shape), (b.id, &b.name, &b.class, b.shape), "{name}");
            assert!((a.velocity_mps - b.velocity_mps).length() < 1e-12, "{name} {}", a.name);
            assert!((a.pose.translation_m - b.pose.translation_m).length() < 1e-9);
            assert!((a.pose.rotation.dot(b.pose.rotation).abs() - 1.0).abs() < 1e-12);
        }
        assert_eq!(back.import.degenerate_triangles_dropped, 0, "{name}");
        assert_eq!(glb::truth_of(&bytes).unwrap(), Some(truth), "{name}");
        println!(
            "{name}: {} objects, {} triangles, {} bytes",
            scene.objects.len(),
            scene.triangle_count(),
            bytes.len()
        );
    }
}

/// Corners and normals of each triangle: vertices may be numbered in another way.
fn corners(m: &crate::scene::Mesh) -> Vec<([DVec3; 3], Option<[DVec3; 3]>)> {
    let at = |t: usize| m.triangles[t].map(|i| m.positions_m[i as usize]);
    (0..m.triangles.len()).map(|t| (at(t), m.corner_normals(t))).collect()
}

/// Straight down from `p`, the heights of the faces that look up, and their objects' classes.
fn below(scene: &Scene, x: f64, y: f64) -> Vec<(f64, String)> {
    let mut hits = Vec::new();
    for o in &scene.objects {
        let Shape::Mesh(m) = o.shape else { continue };
        let mesh = &scene.meshes[m];
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|i| o.pose.point(mesh.positions_m[i as usize]));
            let flat = |p: DVec3| p.truncate();
            let (u, v, p) = (flat(b - a), flat(c - a), glam::DVec2::new(x, y) - flat(a));
            let det = u.perp_dot(v);
            if det <= 1e-12 {
                continue;
            }
            let (i, j) = (p.perp_dot(v) / det, u.perp_dot(p) / det);
            if i >= -1e-9 && j >= -1e-9 && i + j <= 1.0 + 1e-9 {
                hits.push((a.z + i * (b.z - a.z) + j * (c.z - a.z), o.class.clone()));
            }
        }
    }
    hits
}

#[test]
fn paint_lies_on_the_road_and_the_road_has_no_holes() {
    let (plan, scene, truth) = file("everything");
    let axis = &plan.roads[0].road.axis;
    // The wear of the test: every 7 m, every 0.37 m across.
    let mut s_m = 3.3;
    while s_m < axis.length_m() {
        let mut t_m = -6.2;
        while t_m < 6.4 {
            let p = axis.world(RoadPoint { s_m, t_m, h_m: 0.0 });
            let hits = below(&scene, p.x, p.y);
            let road: Vec<f64> = hits.iter().filter(|h| h.1 == "road").map(|h| h.0).collect();
            assert!(
                !road.is_empty() && road.iter().all(|z| (z - road[0]).abs() < 1e-4),
                "{s_m} {t_m} {hits:?}"
            );
            assert!((road[0] - p.z).abs() < 0.011, "{} {}", road[0], p.z);
            for (z, _) in hits.iter().filter(|h| h.1 == "lane_line") {
                assert!((z - road[0] - 0.0015).abs() < 2e-4, "{s_m} {t_m} {}", z - road[0]);
            }
            t_m += 0.37;
        }
        s_m += 7.0;
    }
    for l in &truth.roads[0].lines {
        for p in &l.points_m[1..l.points_m.len() - 1] {
            let hits = below(&scene, p[0], p[1]);
            assert!(
                hits.iter().any(|h| h.1 != "lane_line" && (p[2] - h.0 - 0.0015).abs() < 2e-4),
                "{} {p:?} {hits:?}",
                l.name
            );
        }
    }
}

#[test]
fn markers_stand_on_the_facets_and_spell_their_word() {
    let (plan, scene, truth) = file("everything");
    assert_eq!(truth.marker_rows.len(), 2, "poles are no markers");
    let row = &truth.marker_rows[0];
    assert_eq!(row.word.as_deref(), Some("1011"));
    let gaps: Vec<f64> = row.markers.windows(2).map(|w| w[1].s_m - w[0].s_m).collect();
    for (gap, m) in gaps.iter().zip(&row.markers) {
        let expected = m.bit.map_or(3.0, |b| if b == 1 { 1.5 } else { 2.0 });
        assert!((gap - expected).abs() < 1e-6);
    }
    assert_eq!(
        row.markers[..6].iter().map(|m| m.bit).collect::<Vec<_>>(),
        [Some(0), Some(1), Some(2), Some(3), None, Some(0)]
    );
    let axis = &plan.roads[0].road.axis;
    for m in &row.markers {
        let o = scene.object_by_id(m.id).unwrap();
        assert_eq!(o.class, "marker");
        assert!((o.pose.translation_m - DVec3::from_array(m.position_m)).length() < 1e-6);
        let p = o.pose.translation_m;
        let road =
            below(&scene, p.x, p.y).iter().filter(|h| h.1 == "road").map(|h| h.0).fold(f64::MIN, f64::max);
        assert!((p.z - road - 0.002).abs() < 1e-4, "{} over {road}", p.z);
        let q = axis.project(p);
        assert!((q.s_m - m.s_m).abs() < 1e-3 && (q.t_m + 3.25).abs() < 1e-3, "{q:?}");
        // Boresight back along the road.
        let ahead = axis.at(m.s_m).heading_rad;
        let x = o.pose.direction(DVec3::X);
        assert!((x.truncate().normalize() + glam::DVec2::from_angle(ahead)).length() < 2e-3);
    }
    let meshes: HashSet<String> =
        row.markers.iter().map(|m| format!("{:?}", scene.object_by_id(m.id).unwrap().shape)).collect();
    assert_eq!(meshes.len(), 1, "a row shares its mesh");
    let turn = &truth.marker_rows[1].markers;
    assert_eq!(turn.len(), 12);
    let heading = |i: usize| {
        let x = scene.object_by_id(turn[i].id).unwrap().pose.direction(DVec3::X);
        x.y.atan2(x.x)
    };
    assert!((heading(1) - heading(0) - 15f64.to_radians()).abs() < 2e-3, "both stand on the straight");
}

#[test]
fn lanes_lines_and_traffic_of_the_eight_lane_roads() {
    let (_, scene, truth) = file("eight_lanes");
    let road = &truth.roads[0];
    let numbers: Vec<i32> = road.lanes.iter().map(|l| l.number).collect();
    assert_eq!(numbers, [14, 13, 12, 11, 10, 0, 1, 2, 3, 4]);
    assert_eq!(road.lines.len(), 8);
    assert_eq!(road.free_space_m.len(), 2, "the median parts the carriageways");
    // Counter-clockwise: the shoelace formula is positive.
    for outline in &road.free_space_m {
        let next = outline.iter().cycle().skip(1);
        let area: f64 = outline.iter().zip(next).map(|(a, b)| 0.5 * (a[0] * b[1] - b[0] * a[1])).sum();
        assert!((area - 400.0 * (3.0 * 3.75 + 3.0)).abs() < 1e-6, "{area}");
    }
    let y = |n: i32| road.lanes.iter().find(|l| l.number == n).unwrap().centre_m[0][1];
    assert_eq!((y(1), y(12), y(4)), (-1.0 - 1.875, 1.0 + 1.5 * 3.75, -1.0 - 3.0 * 3.75 - 1.5));
    let oncoming = scene.objects.iter().find(|o| o.name.ends_with("passenger-car 4")).unwrap();
    assert!((oncoming.velocity_mps - DVec3::new(-31.0, 0.0, 0.0)).length() < 1e-12);
    assert_eq!((count(&scene, "guard_rail"), count(&scene, "post"), count(&scene, "car")), (4, 4 * 101, 4));
    // The dashes of a line: 6 m of paint in 18.
    let line = scene.objects.iter().find(|o| o.name == "motorway/line of lane 1").unwrap();
    let Shape::Mesh(m) = line.shape else { panic!() };
    let area: f64 = (0..scene.meshes[m].triangles.len()).map(|t| area_vector_m2(&scene.meshes[m], t).z).sum();
    // 22 whole dashes and 4 m of another.
    assert!((area - 0.12 * (22.0 * 6.0 + 4.0)).abs() < 1e-4, "{area}");
    // All of the pavement is two flat sheets, in as few facets as can be.
    let paved: usize = scene
        .objects
        .iter()
        .filter(|o| o.class == "road")
        .map(|o| match o.shape {
            Shape::Mesh(m) => scene.meshes[m].triangles.len(),
            _ => 0,
        })
        .sum();
    assert_eq!(paved, 4);

    let (_, _, bay) = file("eight_lanes_bay");
    let lane = bay.roads[0].lanes.iter().find(|l| l.number == 5).unwrap();
    let widest = lane.width_m.iter().copied().fold(0.0, f64::max);
    assert_eq!((lane.width_m[0], widest), (0.0, 3.5));
    let line = bay.roads[0].lines.iter().find(|l| l.name.ends_with("lane 5")).unwrap();
    // Begins where the lane is twice as wide as the paint: 0.24 m of 3.5 m over 15 m.
    assert!((line.points_m[0][0] - (150.0 + 15.0 * 0.24 / 3.5)).abs() < 1e-6, "{:?}", line.points_m[0]);
}

#[test]
fn rails_and_walls_look_at_the_road() {
    for (name, class, side) in [
        ("sound_wall", "guard_rail", 1.0),
        ("eight_lanes_curve", "guard_rail", 0.0),
        ("walled_bend", "wall", 0.0),
    ] {
        let (plan, scene, _) = file(name);
        let axis = &plan.roads[0].road.axis;
        for o in scene.objects.iter().filter(|o| o.class == class) {
            let Shape::Mesh(m) = o.shape else { panic!() };
            let mesh = &scene.meshes[m];
            let mut towards = [0.0, 0.0];
            for t in 0..mesh.triangles.len() {
                let c = mesh.triangles[t].map(|i| mesh.positions_m[i as usize]).iter().sum::<DVec3>() / 3.0;
                let p = axis.project(o.pose.point(c));
                let left = glam::DVec2::from_angle(axis.at(p.s_m).heading_rad).perp();
                let n = o.pose.direction(area_vector_m2(mesh, t)).truncate().dot(left);
                towards[usize::from(n > 0.0)] += n.abs();
            }
            if class == "wall" {
                assert!((towards[0] - towards[1]).abs() < 0.02 * towards[0], "a wall is closed: {towards:?}");
            } else {
                assert!(towards[0].min(towards[1]) < 1e-6, "a rail is a sheet: {towards:?}");
                assert!(side == 0.0 || towards[1] > 1.0, "the right one looks left");
            }
        }
    }
    let (plan, scene, _) = file("sound_wall");
    let wall = scene.objects.iter().find(|o| o.class == "wall").unwrap();
    let Shape::Mesh(m) = wall.shape else { panic!() };
    assert!(crate::road::shape::is_watertight(&scene.meshes[m]));
    let v = crate::road::shape::volume_m3(&scene.meshes[m]);
    assert!((v - 150.0 * 0.2 * 3.05).abs() < 1e-3, "{v}");
    // Beams as long as the road where it is straight.
    assert!(scene.objects.iter().filter(|o| o.class == "guard_rail").all(|o| match o.shape {
        Shape::Mesh(m) => scene.meshes[m].triangles.len() == 14,
        _ => false,
    }));
    let car = |name: &str| scene.objects.iter().find(|o| o.name.ends_with(name)).unwrap().pose.translation_m;
    assert!((car("passenger-car 1") - DVec3::new(67.0, -1.875, 0.0)).length() < 1e-9);
    assert_eq!(plan.roads[0].road.axis.length_m(), 150.0);
}

#[test]
fn a_lane_that_ends_at_once_leaves_no_taper() {
    let text = "name = \"x\"
[[road]]
name = \"r\"
plan = [{ kind = \"straight\", length_m = 100 }]
right = [{ width_m = 3 }, { kind = \"ramp\", width_m = [[0, 3], [60, 3], [60, 0]], line = \"solid\" }]
verge = [{ side = \"right\", width_m = 5, drop_m = 0 }]
wall = [{ lateral = { edge = \"right\", offset_m = -1 } }]
";
    let (_, scene, truth) = made(text);
    let area = |class: &str| -> f64 {
        let list = scene.objects.iter().filter(|o| o.class == class);
        list.map(|o| match o.shape {
            Shape::Mesh(m) => (0..scene.meshes[m].triangles.len())
                .map(|t| area_vector_m2(&scene.meshes[m], t).z)
                .sum::<f64>(),
            _ => 0.0,
        })
        .sum()
    };
    assert!((area("road") - (300.0 + 180.0)).abs() < 1e-3, "{}", area("road"));
    assert!((area("verge") - 500.0).abs() < 1e-3, "{}", area("verge"));
    assert!((area("lane_line") - 60.0 * 0.12).abs() < 1e-4, "{}", area("lane_line"));
    let wall = scene.objects.iter().find(|o| o.class == "wall").unwrap();
    let Shape::Mesh(m) = wall.shape else { panic!() };
    assert!(crate::road::shape::is_watertight(&scene.meshes[m]), "two walls, each closed");
    assert!((crate::road::shape::volume_m3(&scene.meshes[m]) - 100.0 * 0.2 * 3.05).abs() < 1e-3);
    assert_eq!(truth.roads[0].lines.len(), 1);
}

#[test]
fn plates_lie_every_eight_metres() {
    let (_, scene, truth) = file("metal_plates");
    let row = &truth.marker_rows[0];
    assert_eq!(row.markers.len(), 14);
    let boxes = crate::road::truth_boxes(&scene, 0.0);
    for (i, m) in row.markers.iter().enumerate() {
        let o = scene.object_by_id(m.id).unwrap();
        assert!((o.pose.direction(DVec3::X) - DVec3::Z).length() < 1e-12, "looks up");
        assert!((o.pose.direction(DVec3::Z).x.abs() - 1.0).abs() < 1e-12, "lies along the road");
        let b = boxes.iter().find(|b| b.id == m.id).unwrap();
        let at = DVec3::from_array(b.centre_m);
        assert!((at - DVec3::new(10.0 + 8.0 * i as f64, -3.5, 0.002)).length() < 1e-6, "{at}");
        assert!((b.size_m[2] - 3.0).abs() < 1e-6 && (b.size_m[1] - 0.15).abs() < 1e-6);
    }
    assert_eq!(count(&scene, "manhole"), 2);
}

#[test]
fn a_scene_has_materials_of_its_own() {
    use crate::scene::backscatter::{Backscatter, Law};
    use crate::scene::material::{self, MaterialKind};
    let text = "name = \"x\"\n\
                [[material]]\nname = \"rough asphalt\"\nlike = \"asphalt\"\nroughness_rms_m = 5e-4\n\
                correlation_length_m = 0.005\nbackscatter = \"gamma:-18\"\nsource = \"a guess\"\n\
                [[material]]\nname = \"clay\"\neps_r = [6.0, 0.5]\n\
                [[material]]\nname = \"wet clay\"\nlike = \"clay+water:0.0005\"\nvalid_hz = [76e9, 81e9]\n\
                [[road]]\nname = \"r\"\nplan = [{ kind = \"straight\", length_m = 30 }]\n\
                surface = \"rough asphalt\"\nright = [{ width_m = 3.5, line = \"solid\" }]\n\
                verge = [{ side = \"left\", width_m = 2, material = \"clay\" }, { side = \"right\", width_m = 2, material = \"wet clay\" }]\n";
    let (plan, scene, truth) = made(text);
    let of = |name: &str| scene.materials.iter().find(|m| m.name == name).unwrap_or_else(|| panic!("{name}"));
    let (rough, asphalt) = (of("rough asphalt"), material::by_name("asphalt").unwrap());
    assert_eq!((&rough.kind, rough.valid_hz), (&asphalt.kind, asphalt.valid_hz));
    assert_eq!((rough.roughness_rms_m, rough.correlation_length_m), (5e-4, 0.005));
    let law = Backscatter::of(Law::ConstantGamma { gamma_db: -18.0 });
    assert_eq!((rough.backscatter, rough.source.as_str()), (Some(law), "a guess"));
    let clay = MaterialKind::Dielectric { eps_real: 6.0, eps_loss: 0.5, conductivity_s_per_m: 0.0 };
    assert_eq!((&of("clay").kind, of("clay").layers.len()), (&clay, 0));
    assert_eq!((&of("wet clay").kind, of("wet clay").layers.len()), (&clay, 1));
    assert_eq!(of("wet clay").valid_hz, (76e9, 81e9));
    // Paint lies on the road's own material, and hides its roughness no more than on a row of the table.
    let painted = plan.material("rough asphalt+paint-white:0.002").unwrap();
    assert_eq!(scene.materials.iter().filter(|m| m.name.starts_with("rough asphalt+")).count(), 1);
    assert_eq!((&painted.kind, painted.layers.len()), (&asphalt.kind, 1));
    let bytes = glb::to_glb(&scene, &truth).unwrap();
    let back = gltf::import_bytes(&bytes, Path::new("x.glb"), None, &ImportOptions::default()).unwrap();
    let plain = |s: &Scene| {
        s.materials.iter().map(|m| (m.name.clone(), m.kind.clone(), m.backscatter)).collect::<Vec<_>>()
    };
    assert_eq!(plain(&back), plain(&scene));
    for (from, to, words) in [
        (
            "\"clay\"\neps_r",
            "\"steel\"\neps_r",
            "a.toml:10: material[1].name = \"steel\": is the name of an existing material",
        ),
        ("\"clay\"\neps_r", "\"rough asphalt\"\neps_r", "is the name of an existing material"),
        ("\"clay\"\neps_r", "\"a+b\"\neps_r", "is not a name for a material"),
        ("eps_r = [6.0, 0.5]", "", "has no electrical properties; allowed: at least one of like, eps_r"),
        ("[6.0, 0.5]", "[6.0, -0.5]", "allowed: eps' above 0, eps'' (loss) 0 or more"),
        ("[6.0, 0.5]", "[6.0]", "material[1].eps_r"),
        ("[76e9, 81e9]", "[81e9, 76e9]", "allowed: lowest and highest frequency"),
        ("5e-4", "5.0", "material[0].roughness_rms_m = 5"),
        ("gamma:-18", "gama:-18", "is not a law of backscatter"),
        ("\"asphalt\"", "\"asfalt\"", "did you mean 'asphalt'?"),
        ("material = \"clay\"", "material = \"loam\"", "no material is named 'loam'"),
        ("roughness_rms_m", "roughnes_rms_m", "did you mean 'roughness_rms_m'?"),
    ] {
        let e = parse(Path::new("a.toml"), &text.replace(from, to)).unwrap_err();
        let told = e.to_string();
        assert!(e.exit_code() == 2 && told.contains(words) && !told.contains('\n'), "{to}: {told}");
    }
}

#[test]
fn bad_files_are_refused_in_one_line() {
    let base = "name = \"x\"\n[[road]]\nname = \"r\"\nplan = [{ kind = \"straight\", length_m = 100 }]\nright = [{ width_m = 3.5 }]\n";
    let complaint = |text: &str| {
        let e = parse(Path::new("a.toml"), text).and_then(|p| build(&p)).unwrap_err();
        assert_eq!(e.exit_code(), 2);
        let e = e.to_string();
        assert!(!e.contains('\n'), "{e}");
        e
    };
    assert!(parse(Path::new("a.toml"), base).is_ok());
    let with = |extra: &str| complaint(&format!("{base}{extra}"));
    let changed = |from: &str, to: &str| complaint(&base.replace(from, to));
    for (got, expect) in [
        (
            changed("width_m = 3.5", "width_m = -3.5"),
            "a.toml:5: road[0].right[0].width_m = -3.5: -3.5 is not a lane width",
        ),
        (changed("width_m = 3.5", "width_m = [[0, 1], [-5, 2]]"), "runs backwards"),
        (changed("width_m = 3.5", "widht_m = 3.5"), "did you mean 'width_m'?"),
        (changed("width_m = 3.5", "width_m = 3.5, surface = \"asfalt\""), "did you mean 'asphalt'?"),
        (changed("length_m = 100", "length_m = -100"), "road[0].plan[0].length_m = -100: is out of range"),
        (changed("length_m = 100", "length_m = 100, radius_m = 50"), "radius_m is a key of an arc"),
        (changed("\"straight\"", "\"arc\""), "radius_m is missing"),
        (
            changed("\"straight\"", "\"spiral\""),
            "is not one of the choices; allowed: straight, arc, clothoid",
        ),
        (
            changed("kind = \"straight\", length_m = 100", "kind = \"arc\", radius_m = 0.01, length_m = 3"),
            "is not a radius",
        ),
        (
            with("grade_percent = 5\ngrade = [{ s_m = 10, grade_percent = -5, k_m_per_percent = 10 }]"),
            "the vertical curve overlaps the one before it or leaves the road",
        ),
        (with("[[road.rail]]\nlateral = { t_m = 3, lane = 1 }"), "needs exactly one of t_m, lane and edge"),
        (with("[[road.rail]]\nlateral = { lane = 7 }"), "the road has no lane of this number; allowed: 1"),
        (
            with("[[road.rail]]\nlateral = { t_m = 3 }\nfrom_m = 50\nto_m = 20"),
            "a.toml:9: road[0].rail[0].to_m = 20: does not end beyond its start",
        ),
        (with("[[road.rail]]\nlateral = { t_m = 3 }\nto_m = 200"), "is out of range; allowed: 0..=100"),
        (with("[[road.rail]]\nlateral = { t_m = 3 }\npost_spacing_m = 0.0001"), "makes 1000000 posts"),
        (
            with("[[road.markers]]\nlateral = { t_m = 0 }\nreflector = \"type11\"\nspacing_m = 2"),
            "did you mean 'type1'?",
        ),
        (
            with("[[road.markers]]\nlateral = { t_m = 0 }\nreflector = \"type1\""),
            "one of spacing_m, gaps_m, code",
        ),
        (
            with("[[road.markers]]\nlateral = { t_m = 0 }\nreflector = \"type1\"\nspacing_m = 0"),
            "is out of range; allowed: more than 0",
        ),
        (
            with(
                "[[road.markers]]\nlateral = { t_m = 0 }\nreflector = \"type1\"\ncode = { word = \"12\", zero_m = 1, one_m = 2 }",
            ),
            "is not a code word",
        ),
        (
            with(
                "[[road.markers]]\nlateral = { t_m = 0 }\nreflector = \"type1\"\ncode = { word = \"1\", zero_m = 1, one_m = 1 }",
            ),
            "gaps of two meanings are alike",
        ),
        (
            with("[[road.vehicle]]\nkind = \"passenger-cra\"\ns_m = 5\nlateral = { lane = 1 }"),
            "did you mean 'passenger-car'?",
        ),
        (
            with("[[road.object]]\nfile = \"../x.glb\"\ns_m = 5\nlateral = { lane = 1 }"),
            "leaves the folder of the scene file",
        ),
        (with("[[road]]\nname = \"r\"\nplan = []"), "is empty, or the name of another road"),
        (
            with(
                "[[road]]\nname = \"q\"\nplan = [{ kind = \"straight\", length_m = 10 }]\nright = [{ width_m = 3 }]",
            ),
            "the surface of road 'q' overlaps that of road 'r'",
        ),
        (with("opendrive = \"../a.xodr\""), "is also given by the OpenDRIVE file"),
        (
            changed("plan = [{ kind = \"straight\", length_m = 100 }]", "opendrive = \"../a.xodr\""),
            "leaves the folder of the scene file",
        ),
        (
            changed("plan = [{ kind = \"straight\", length_m = 100 }]", "opendrive = \"no.xodr\""),
            "no.xodr: no such file",
        ),
        (changed("plan = [{ kind = \"straight\", length_m = 100 }]", ""), "plan is missing"),
        (
            with("[[road]]\nname = \"q\"\nstart = { road = \"s\" }\nplan = []"),
            "no earlier road has this name; allowed: r",
        ),
        (
            changed("kind = \"straight\", length_m = 100", "kind = \"arc\", radius_m = -3, angle_deg = 90"),
            "lane 1 of road 'r' at s",
        ),
        (
            complaint(
                &(base.replace(
                    "kind = \"straight\", length_m = 100",
                    "kind = \"arc\", radius_m = -5, angle_deg = 90",
                ) + "wall = [{ lateral = { t_m = -6 } }]"),
            ),
            "wall of road 'r' at s",
        ),
        (complaint("name = \"x\"\nroad = []"), "road = []: has 0 elements; allowed: one element or more"),
    ] {
        assert!(got.contains(expect), "got {got}\nexpected {expect}");
    }
}

/// With CATSEYE_WRITE_SCHEMA set it writes the file.
#[test]
fn the_committed_schema_is_that_of_the_code() {
    let (name, text) = schema();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("schema").join(name);
    if std::env::var_os("CATSEYE_WRITE_SCHEMA").is_some() {
        std::fs::write(&path, &text).unwrap();
    }
    let committed = std::fs::read_to_string(&path).unwrap();
    assert!(committed == text, "{name} is out of date: run this test with CATSEYE_WRITE_SCHEMA=1");
    assert!(text.contains("cross_slope_percent") && text.contains("from_radius_m"));
}

/// A file with a bent, graded, banked road of lanes whose widths change.
fn any_file() -> impl Strategy<Value = String> {
    let element = prop_oneof![
        (5.0f64..80.0).prop_map(|l| format!("{{ kind = \"straight\", length_m = {l} }}")),
        (5.0f64..80.0, 25.0f64..500.0, any::<bool>()).prop_map(|(l, r, left)| {
            format!("{{ kind = \"arc\", length_m = {l}, radius_m = {} }}", if left { r } else { -r })
        }),
        (5.0f64..80.0, 25.0f64..500.0, any::<bool>()).prop_map(|(l, r, left)| {
            format!("{{ kind = \"clothoid\", length_m = {l}, to_radius_m = {} }}", if left { r } else { -r })
        }),
    ];
    let lane = (0.0f64..4.0, 0.5f64..4.0, 0.0f64..30.0, 1.0f64..30.0, 0usize..3).prop_map(
        |(a, b, from, over, line)| {
            let line = ["none", "solid", "dashed"][line];
            format!("{{ width_m = [[{from}, {a}], [{}, {b}]], line = \"{line}\" }}", from + over)
        },
    );
    let lanes = || prop::collection::vec(lane.clone(), 0..3);
    let plan = prop::collection::vec(element, 1..4);
    (plan, lanes(), lanes(), -5.0f64..5.0, -6.0f64..6.0, 0.002f64..0.02).prop_map(
        |(plan, left, right, grade, slope, sagitta)| {
            format!(
                "name = \"x\"\nsagitta_m = {sagitta}\n[[road]]\nname = \"r\"\nplan = [{}]\nleft = [{}]\nright = [{}]
grade_percent = {grade}\ncross_slope_percent = [[0, 0], [30, {slope}]]
rail = [{{ lateral = {{ edge = \"right\", offset_m = -0.5 }} }}]
markers = [{{ reflector = \"type1:width_m=0.16,height_m=0.004\", lateral = {{ edge = \"left\" }}, spacing_m = 4 }}]\n",
                plan.join(", "),
                left.join(", "),
                right.join(", ")
            )
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn any_road_has_the_area_of_its_lanes_and_paint_above_it(text in any_file()) {
        let (plan, scene, truth) = made(&text);
        let road = &plan.roads[0].road;
        let mut paved = 0.0;
        for o in scene.objects.iter().filter(|o| o.class == "road" || o.class == "lane_line") {
            let Shape::Mesh(m) = o.shape else { continue };
            let mesh = &scene.meshes[m];
            for t in 0..mesh.triangles.len() {
                let up = area_vector_m2(mesh, t);
                prop_assert!(up.z > 0.9 * up.length(), "{} triangle {t} looks {up}", o.name);
                if o.class == "road" {
                    paved += up.z;
                }
                if o.class == "lane_line" {
                    let p = mesh.triangles[t].map(|i| o.pose.point(mesh.positions_m[i as usize]));
                    let p = p.iter().sum::<DVec3>() / 3.0;
                    let road = below(&scene, p.x, p.y).iter().filter(|h| h.1 == "road").map(|h| h.0).fold(f64::MIN, f64::max);
                    prop_assert!(road < p.z - 1e-3 || road == f64::MIN, "{} is {} under the road", o.name, road - p.z);
                }
            }
        }
        // The area of a strip from t to u along ds is (u - t)(1 - k (t + u) / 2) ds.
        let n = 4000;
        let step = road.axis.length_m() / f64::from(n);
        let mut expected = 0.0;
        for i in 0..n {
            let s = step * (f64::from(i) + 0.5);
            let k = road.axis.at(s).curvature_per_m;
            for (side, j, _) in road.lanes() {
                let (l, r) = road.lane_edges_t_m(side, j, s);
                expected += (l - r) * (1.0 - 0.5 * k * (l + r)) * step;
            }
        }
        prop_assert!((paved - expected).abs() < 0.005 * expected + 1e-3, "{paved} {expected}");
        for row in &truth.marker_rows {
            prop_assert!(row.markers.len() == (road.axis.length_m() / 4.0 + 1e-6) as usize + 1);
        }
    }
}

/// Wheels roll, legs swing and walkers are not in step; the file brings it all back.
#[test]
fn vehicles_move_with_their_wheels_and_limbs() {
    let text = r#"
name = "moving"
[[road]]
name = "a"
plan = [{ kind = "straight", length_m = 200 }]
left = [{ number = 11, width_m = 3.75 }]
right = [{ number = 1, width_m = 3.75 }]
vehicle = [
    { kind = "sedan", s_m = 40, lateral = { lane = 1 }, speed_mps = 20 },
    { kind = "pedestrian", name = "one", s_m = 60, lateral = { lane = 1 }, speed_mps = 1.4 },
    { kind = "pedestrian", name = "two", s_m = 70, lateral = { lane = 1 }, speed_mps = 1.4 },
    { kind = "hatchback", s_m = 90, lateral = { lane = 11 } },
]
"#;
    let (_, scene, truth) = made(text);
    let wheels: Vec<_> =
        scene.objects.iter().filter(|o| o.class == "car.wheel" && o.motion.is_some()).collect();
    assert_eq!(wheels.len(), 4, "those of the car that drives");
    for t in [0.0, 0.31, 2.0] {
        for w in &wheels {
            let now = w.at(t);
            let touches = DVec3::new(now.translation_m.x, now.translation_m.y, 0.0);
            assert!(now.velocity_at(touches).length() < 1e-9, "{} {t}", w.name);
            assert!((now.velocity_mps.length() - 20.0).abs() < 1e-9);
        }
    }
    let legs: Vec<_> = scene.objects.iter().filter(|o| o.name.contains("thigh left")).collect();
    assert_eq!(legs.len(), 2);
    let turn = legs[0].at(0.0).rotation.angle_between(legs[1].at(0.0).rotation);
    assert!(turn > 0.05, "in step: {turn}");
    let parked: Vec<_> = scene.objects.iter().filter(|o| o.name.contains("hatchback")).collect();
    assert!(parked.len() > 4 && parked.iter().all(|o| o.motion.is_none()));
    let bytes = glb::to_glb(&scene, &truth).unwrap();
    println!("{} triangles, {} bytes", scene.triangle_count(), bytes.len());
    let back = gltf::import_bytes(&bytes, Path::new("x.glb"), None, &ImportOptions::default()).unwrap();
    for (a, b) in scene.objects.iter().zip(&back.objects) {
        assert_eq!(a.motion.is_some(), b.motion.is_some(), "{}", a.name);
        for t in [-0.4, 0.0, 0.77, 5.0] {
            let (p, q) = (a.at(t), b.at(t));
            assert!((p.translation_m - q.translation_m).length() < 1e-9, "{} {t}", a.name);
            assert!((p.velocity_mps - q.velocity_mps).length() < 1e-9, "{} {t}", a.name);
            assert!((p.spin_rad_per_s - q.spin_rad_per_s).length() < 1e-9, "{} {t}", a.name);
            assert!((p.rotation.dot(q.rotation).abs() - 1.0).abs() < 1e-12, "{} {t}", a.name);
        }
    }
}

/// In a bend rows of one spacing along themselves keep it, and those along the axis do not.
#[test]
fn rows_keep_their_spacing_along_themselves() {
    let road = |along: &str| {
        made(&format!(
            "name = \"bend\"\n[[road]]\nname = \"r\"\n\
             plan = [{{ kind = \"straight\", length_m = 10 }}, {{ kind = \"arc\", radius_m = -12, angle_deg = 90 }}]\n\
             right = [{{ width_m = 3.5, number = 1 }}]\n\
             [[road.markers]]\nname = \"m\"\nreflector = \"type1:width_m=0.16,height_m=0.004\"\n\
             lateral = {{ t_m = 2 }}\nfrom_m = 1\nspacing_m = 2\n{along}"
        ))
        .2
    };
    let gaps = |truth: &RoadTruth| -> Vec<f64> {
        let at: Vec<DVec3> = truth.marker_rows[0].markers.iter().map(|m| m.position_m.into()).collect();
        at.windows(2).map(|w| w[0].distance(w[1])).collect()
    };
    let along = gaps(&road("along_row = true\n"));
    // A chord of 2 m of arc with 14 m radius is 1.7 mm shorter.
    assert!(along.len() == 15 && along.iter().all(|g| (g - 2.0).abs() < 3e-3), "{along:?}");
    let axis = gaps(&road(""));
    assert!(
        axis.len() < along.len() && axis.last().is_some_and(|g| (g - 2.0 * 14.0 / 12.0).abs() < 5e-3),
        "{axis:?}"
    );
}
