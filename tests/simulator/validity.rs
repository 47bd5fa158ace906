//! Where physical optics ends: what is said of bodies whose answer is known to be right or wrong.

use catseye::engine::solver::Solver;
use catseye::engine::sweep::Sweep;
use catseye::engine::{Engine, Precision};
use catseye::rcs::{Aspect, RcsOptions};
use catseye::road::target;
use catseye::scene::creases::smooth;
use catseye::scene::gltf::ImportOptions;
use catseye::scene::{Material, Mesh, Scene};
use glam::DVec3;
use std::f64::consts::TAU;

/// First words of the warnings of a target in one direction (azimuth, elevation in degrees).
fn said(scene: &Scene, azimuth_deg: f64, elevation_deg: f64) -> Vec<String> {
    let aspect = Aspect { azimuth: azimuth_deg.to_radians(), elevation: elevation_deg.to_radians() };
    let options = RcsOptions::default();
    let sweep = Sweep { frequencies_hz: vec![77e9], transmit: vec![aspect], receive: None, options };
    let engine = Engine::open("cpu", Precision::F64).unwrap();
    let lines = engine.remarks(scene, &sweep);
    lines.iter().map(|l| l.split(':').next().unwrap_or_default().to_string()).collect()
}

fn named(spec: &str) -> Scene {
    target::load(spec, &ImportOptions::default()).unwrap().scene
}

fn metal(mesh: Mesh) -> Scene {
    let mut scene = Scene { materials: vec![Material::pec()], ..Scene::default() };
    scene.add_mesh("body", "", mesh, catseye::base::frames::Pose::IDENTITY);
    scene
}

/// A body of revolution about z through (radius, height) of each ring, flat facets or smooth.
fn turned(rings: &[(f64, f64)], sides: u32, is_smooth: bool) -> Scene {
    let mut mesh = Mesh::default();
    for (r, z) in rings {
        for i in 0..sides {
            let (s, c) = (TAU * f64::from(i) / f64::from(sides)).sin_cos();
            mesh.positions_m.push(DVec3::new(r * c, r * s, *z));
        }
    }
    for ring in 0..rings.len() as u32 - 1 {
        for i in 0..sides {
            let (a, b) = (ring * sides + i, ring * sides + (i + 1) % sides);
            mesh.triangles.extend([[a, b, b + sides], [a, b + sides, a + sides]]);
        }
    }
    mesh.material = vec![0; mesh.triangles.len()];
    if is_smooth {
        assert!(smooth(&mut mesh, 30.0).curved > 0);
    }
    metal(mesh)
}

/// Plates side by side along y, `degrees` their directions from it, 0.1 m high.
fn plates(degrees: &[f64], widths: &[f64]) -> Scene {
    let (mut at, mut corners) = (DVec3::ZERO, vec![DVec3::ZERO, DVec3::Z * 0.1]);
    for (angle, width) in degrees.iter().zip(widths) {
        let angle = angle.to_radians();
        at += DVec3::new(-angle.sin(), angle.cos(), 0.0) * *width;
        corners.extend([at, at + DVec3::Z * 0.1]);
    }
    let mut mesh = Mesh { positions_m: corners, ..Mesh::default() };
    for i in 0..degrees.len() as u32 {
        mesh.triangles.extend([[2 * i, 2 * i + 2, 2 * i + 3], [2 * i, 2 * i + 3, 2 * i + 1]]);
    }
    mesh.material = vec![0; mesh.triangles.len()];
    metal(mesh)
}

#[test]
fn each_body_gets_the_verdict_that_its_answer_deserves() {
    let sphere = |rows: u32, radius_m: f64| -> Vec<(f64, f64)> {
        let at = |i: u32| (TAU * 0.5 * (0.02 + 0.96 * f64::from(i) / f64::from(rows))).sin_cos();
        (0..=rows).map(at).map(|(s, c)| (radius_m * s, -radius_m * c)).collect()
    };
    let frustum = [(0.1, -0.1), (0.06, 0.1)];
    let none: &[&str] = &[];
    let (size, grazing, facets) = (&["size"][..], &["grazing"][..], &["facets"][..]);
    let both: &[&str] = &["size", "grazing"];
    let cases: Vec<(&str, Scene, [f64; 2], &[&str])> = vec![
        // Large flat metal, seen where it answers.
        ("plate", named("plate"), [0.0, 0.0], none),
        ("plate in a side lobe", named("plate"), [20.0, 5.0], none),
        ("plate at grazing", named("plate"), [80.0, 0.0], grazing),
        ("strip", named("plate:width_m=0.005,height_m=0.1"), [0.0, 0.0], size),
        ("strip of 8 mm", named("plate:width_m=0.008,height_m=0.1"), [0.0, 0.0], none),
        ("thick plate face on", named("plate:thickness_m=0.001"), [0.0, 0.0], none),
        ("dihedral", named("dihedral"), [0.0, 0.0], none),
        ("narrow dihedral", named("dihedral:width_m=0.005"), [0.0, 0.0], size),
        ("trihedral", named("trihedral:leg_m=0.1"), [0.0, 35.26], none),
        ("small trihedral", named("trihedral:leg_m=0.006"), [0.0, 35.26], size),
        ("square trihedral", named("square-trihedral"), [0.0, 35.26], none),
        // The echo is made where the walls are, however long the bottom is.
        ("marker of 16 mm", named("type1:height_m=0.016"), [0.0, 3.0], none),
        ("marker of 4 mm", named("type1:width_m=0.16,height_m=0.004,length_m=0.3"), [0.0, 5.0], size),
        ("marker of 2 mm", named("type1:width_m=0.16,height_m=0.002,length_m=0.3"), [0.0, 5.0], both),
        ("marker of 1 mm", named("type1:width_m=0.16,height_m=0.001,length_m=0.3"), [0.0, 5.0], both),
        ("wire mesh", named("mesh"), [0.0, 45.0], size),
        ("stripes", named("stripes"), [0.0, 45.0], size),
        // Curved surfaces, by their own size and not by their facets'.
        ("sphere", turned(&sphere(24, 0.1), 48, true), [0.0, 0.0], none),
        ("small sphere", turned(&sphere(24, 0.003), 48, true), [0.0, 0.0], size),
        ("cylinder", named("cylinder:radius_m=0.05,length_m=0.2"), [0.0, 0.0], none),
        ("wire", named("cylinder:radius_m=0.001,length_m=0.2"), [0.0, 0.0], size),
        ("frustum", turned(&frustum, 120, true), [0.0, 15.0], none),
        ("frustum of flat facets", turned(&frustum, 720, false), [0.0, 15.0], none),
        ("post of eight sides", turned(&[(0.05, -0.1), (0.05, 0.1)], 8, false), [0.0, 0.0], none),
        // Flat facets that stand for what they are not.
        ("coarse sphere of flat facets", turned(&sphere(24, 0.1), 48, false), [0.0, 0.0], facets),
        ("coarse post of flat facets", turned(&[(0.05, -0.1), (0.05, 0.1)], 24, false), [0.0, 0.0], facets),
        ("fine sphere of flat facets", turned(&sphere(300, 0.05), 400, false), [0.0, 0.0], none),
        // Folds are no curved surfaces.
        ("fold of 170 deg", plates(&[5.0, -5.0], &[0.1, 0.1]), [0.0, 0.0], none),
        ("bracket", plates(&[0.0, 90.0], &[0.1, 0.1]), [0.0, 0.0], none),
        ("Z of 20 deg", plates(&[0.0, 20.0, 0.0], &[0.05, 0.05, 0.05]), [0.0, 0.0], none),
    ];
    assert_eq!(cases.len(), 30);
    let wrong: Vec<String> = cases
        .iter()
        .filter_map(|(name, scene, [azimuth, elevation], want)| {
            let found = said(scene, *azimuth, *elevation);
            (found != *want).then(|| format!("{name}: {found:?} for {want:?}"))
        })
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
