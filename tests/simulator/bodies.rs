//! Bodies as people bring them: metal that is there twice, dielectrics that are open or curved, ducts, what stands behind a plate.

use catseye::base::frames::Pose;
use catseye::base::units::{dbsm_from_amplitude, wavelength_m, wavenumber};
use catseye::em::mie::SphereSeries;
use catseye::engine::sweep::{Accuracy, Sweep};
use catseye::engine::{Engine, Precision};
use catseye::geom::dielectrics::{Obstacle, doubts};
use catseye::geom::overlaps::without_doubles;
use catseye::geom::remarks::of_bodies;
use catseye::geom::surfaces_at;
use catseye::rcs::{Aspect, BistaticAspect, Diffraction, RcsOptions};
use catseye::road::target;
use catseye::scene::gltf::ImportOptions;
use catseye::scene::tidy::tidy;
use catseye::scene::{Material, Mesh, Scene, material};
use glam::DVec3;
use std::f64::consts::PI;

const F: f64 = 77e9;

fn engine() -> Engine {
    Engine::open("cpu", Precision::F64).unwrap()
}

fn aspect(azimuth_deg: f64, elevation_deg: f64) -> Aspect {
    Aspect { azimuth: azimuth_deg.to_radians(), elevation: elevation_deg.to_radians() }
}

fn level(scene: &Scene, looks: &[Aspect], options: &RcsOptions) -> Vec<f64> {
    let looks: Vec<BistaticAspect> = looks.iter().map(|a| BistaticAspect::monostatic(*a)).collect();
    let found = engine().rcs(scene, &[F], &looks, options).unwrap();
    found.iter().map(|s| dbsm_from_amplitude(s.every[0][0].norm())).collect()
}

fn named(spec: &str) -> Scene {
    target::load(spec, &ImportOptions::default()).unwrap().scene
}

/// A rectangle across x with its middle at (0, y, z).
fn plate(y: f64, z: f64, width_m: f64, height_m: f64) -> Mesh {
    let corner = |s: f64, t: f64| DVec3::new(0.0, y + 0.5 * s * width_m, z + 0.5 * t * height_m);
    Mesh {
        positions_m: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material: vec![0; 2],
        normals: Vec::new(),
    }
}

fn metal(meshes: &[Mesh]) -> Scene {
    let mut scene = Scene { materials: vec![Material::pec()], ..Scene::default() };
    for (i, mesh) in meshes.iter().enumerate() {
        scene.add_mesh(&format!("part{i}"), "", mesh.clone(), Pose::IDENTITY);
    }
    scene
}

fn joined(a: &Mesh, b: &Mesh) -> Mesh {
    let mut out = a.clone();
    let base = a.positions_m.len() as u32;
    out.positions_m.extend(&b.positions_m);
    out.triangles.extend(b.triangles.iter().map(|t| t.map(|i| i + base)));
    out.material.extend(&b.material);
    out
}

#[test]
fn metal_that_is_there_twice_returns_once() {
    let whole = plate(0.0, 0.0, 0.1, 0.1);
    let looks = [aspect(0.0, 0.0), aspect(3.0, 2.0), aspect(-20.0, 7.0), aspect(180.0, 0.0)];
    let options = RcsOptions::default();
    let want = level(&metal(std::slice::from_ref(&whole)), &looks, &options);
    assert!((want[0] - 19.185).abs() < 1e-3, "{want:?}");
    let mut turned = whole.clone();
    turned.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    // Cut along the other diagonal, so that no triangle is another's copy.
    let mut other = whole.clone();
    other.triangles = vec![[0, 1, 3], [1, 2, 3]];
    let mut near = whole.clone();
    near.positions_m.iter_mut().for_each(|p| p.y += 3e-7);
    let left = plate(-0.02, 0.0, 0.06, 0.1);
    let right = plate(0.015, 0.0, 0.07, 0.1);
    let twice = [
        metal(&[whole.clone(), whole.clone()]),
        metal(&[whole.clone(), turned.clone()]),
        metal(&[joined(&whole, &turned)]),
        metal(&[whole.clone(), other.clone()]),
        metal(&[joined(&other, &whole)]),
        metal(&[whole.clone(), near]),
        metal(&[left.clone(), right.clone()]),
        metal(&[joined(&left, &right)]),
        metal(&[whole.clone(), plate(0.01, 0.02, 0.03, 0.04)]),
        metal(&[plate(0.01, 0.02, 0.03, 0.04), whole.clone()]),
    ];
    for (i, scene) in twice.iter().enumerate() {
        for (got, want) in level(scene, &looks, &options).iter().zip(&want) {
            assert!((got - want).abs() < 0.01, "case {i}: {got} for {want}");
        }
        let (_, doubled) = without_doubles(scene);
        assert_eq!(doubled.len(), 1, "case {i}: {doubled:?}");
        let line = doubled[0].line(scene);
        assert!(line.contains("the same metal counts once"), "{line}");
    }
    // Side by side, one behind the other, and metal on metal of another plane: nothing is taken out.
    let mut behind = whole.clone();
    behind.positions_m.iter_mut().for_each(|p| p.x -= 1e-5);
    for scene in [metal(&[plate(-0.05, 0.0, 0.1, 0.1), plate(0.05, 0.0, 0.1, 0.1)]), metal(&[whole, behind])]
    {
        assert!(without_doubles(&scene).1.is_empty());
    }
}

#[test]
fn the_back_sheet_of_a_trihedral_adds_nothing() {
    let corner = named("trihedral:leg_m=0.1");
    let looks = [aspect(0.0, 0.0), aspect(8.0, -5.0)];
    let boresight = target::load("trihedral:leg_m=0.1", &ImportOptions::default()).unwrap().boresight_deg;
    let at = aspect(boresight.0, boresight.1);
    let options = RcsOptions::default();
    let want = level(&corner, &[at, looks[1]], &options);
    let mut doubled = corner.clone();
    // The first face again, as a sheet of its own.
    let mut sheet = corner.meshes[0].clone();
    let normal = |m: &Mesh, t: usize| {
        let [a, b, c] = m.triangles[t].map(|i| m.positions_m[i as usize]);
        (b - a).cross(c - a).normalize()
    };
    let first = normal(&sheet, 0);
    let keep: Vec<[u32; 3]> = (0..sheet.triangles.len())
        .filter(|t| normal(&sheet, *t).dot(first).abs() > 0.999)
        .map(|t| sheet.triangles[t])
        .collect();
    sheet.material.truncate(keep.len());
    sheet.triangles = keep;
    let pose = corner.objects[0].pose;
    doubled.add_mesh("sheet", "", sheet, pose);
    for (got, want) in level(&doubled, &[at, looks[1]], &options).iter().zip(want) {
        assert!((got - want).abs() < 1e-6, "{got} for {want}");
    }
}

/// A box of a dielectric from -half to half.
fn dielectric_box(half: DVec3, spec: &str) -> Scene {
    let corner = |i: u32| {
        let sign = |bit: u32| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
        half * DVec3::new(sign(0), sign(1), sign(2))
    };
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles: Vec<[u32; 3]> =
        quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
    let mut scene = Scene { materials: vec![material::parse_spec(spec).unwrap()], ..Scene::default() };
    let mesh = Mesh {
        positions_m: (0..8).map(corner).collect(),
        material: vec![0; triangles.len()],
        triangles,
        normals: Vec::new(),
    };
    scene.add_mesh("body", "", mesh, Pose::IDENTITY);
    scene
}

fn said(scene: &Scene) -> Vec<Obstacle> {
    doubts(scene, &surfaces_at(scene, F).unwrap(), wavenumber(F)).into_iter().map(|d| d.obstacle).collect()
}

#[test]
fn an_open_body_is_said_with_its_hole_and_a_vertex_beside_its_place_is_no_hole() {
    let closed = dielectric_box(DVec3::splat(0.02), "polypropylene");
    assert!(said(&closed).is_empty());
    let want = level(&closed, &[aspect(0.0, 0.0)], &RcsOptions::default());
    let mut open = closed.clone();
    open.meshes[0].triangles.pop();
    open.meshes[0].material.pop();
    match &said(&open)[..] {
        [Obstacle::Open { triangles: 11, edges: 3, hole_m: Some([a, b]), is_sheet: false }] => {
            assert!((a.distance(*b) - 0.04 * 2f64.sqrt()).abs() < 1e-12 && a.x == 0.02 && b.x == 0.02);
        }
        other => panic!("{other:?}"),
    }
    // A lossy body is opaque whether it is open or not, and a road is a sheet.
    let mut tank = dielectric_box(DVec3::new(2.0, 2.0, 0.5), "water");
    tank.meshes[0].triangles.truncate(10);
    tank.meshes[0].material.truncate(10);
    assert!(said(&tank).is_empty());
    let mut road = dielectric_box(DVec3::new(20.0, 20.0, 0.5), "asphalt");
    road.meshes[0].triangles.truncate(2);
    road.meshes[0].material.truncate(2);
    assert!(matches!(said(&road)[..], [Obstacle::Open { is_sheet: true, .. }]));
    assert!(of_bodies(&road, F, true).unwrap().is_empty());
    // A slab with any one face turned round is no sheet, although its two large faces may then face one way.
    for face in 0..6 {
        let mut mixed = dielectric_box(DVec3::new(0.01, 0.05, 0.05), "polypropylene");
        mixed.meshes[0].triangles[2 * face..2 * face + 2].iter_mut().for_each(|t| t.swap(1, 2));
        assert!(
            matches!(said(&mixed)[..], [Obstacle::Open { edges: 0, is_sheet: false, .. }]),
            "{face}: {:?}",
            said(&mixed)
        );
        assert_eq!(of_bodies(&mixed, F, true).unwrap().len(), 1);
    }
    // Each triangle with corners of its own, off by nanometres and tenths of micrometres.
    for off_m in [1e-9, 2e-7, 5e-7] {
        let mut loose = closed.clone();
        let m = &mut loose.meshes[0];
        let places: Vec<DVec3> = m.triangles.iter().flatten().map(|i| m.positions_m[*i as usize]).collect();
        m.triangles = (0..12).map(|t| [0, 1, 2].map(|k| 3 * t + k)).collect();
        m.positions_m = places;
        for (i, p) in m.positions_m.iter_mut().enumerate() {
            *p += DVec3::new((i % 3) as f64 - 1.0, (i % 5) as f64 - 2.0, (i % 2) as f64) * (off_m / 4.0);
        }
        assert_eq!(said(&loose).len(), 1);
        tidy(&mut loose, None, false);
        assert!(said(&loose).is_empty(), "{off_m}");
        let got = level(&loose, &[aspect(0.0, 0.0)], &RcsOptions::default());
        assert!((got[0] - want[0]).abs() < 0.02, "{off_m}: {got:?} for {want:?}");
    }
}

#[test]
fn spheres_that_waves_enter_are_taken_by_their_series_and_other_curved_bodies_are_refused() {
    // Mie's series of polypropylene, n = 1.48 - 0.0025j, by an independent program: -36.5 and -37.5 dBsm.
    for (radius_m, want) in [(0.005, -36.5), (0.01, -37.5)] {
        let scene = named(&format!("sphere:radius_m={radius_m},material=polypropylene"));
        let got = level(&scene, &[aspect(0.0, 0.0), aspect(40.0, 70.0)], &RcsOptions::default());
        assert!((got[0] - want).abs() < 0.1 && (got[1] - got[0]).abs() < 1e-9, "{got:?} for {want}");
        let sweep = Sweep {
            frequencies_hz: vec![F],
            transmit: vec![aspect(10.0, 0.0)],
            receive: None,
            options: RcsOptions::default(),
        };
        let mut lines = Vec::new();
        let found = sweep.take(&engine(), &scene, &mut |l| lines.push(l.to_string()), &|_| ()).unwrap();
        assert_eq!((found.accuracy, lines), (Accuracy::Series, Vec::new()));
    }
    let eps = material::by_name("polypropylene").unwrap().eps_r(F).unwrap().unwrap();
    let series = SphereSeries::dielectric(0.01, eps, F).unwrap();
    let scene = named("sphere:radius_m=0.01,material=polypropylene");
    let looks = [BistaticAspect { transmit: aspect(0.0, 0.0), receive: aspect(120.0, 0.0) }];
    let s = engine().rcs(&scene, &[F], &looks, &RcsOptions::default()).unwrap()[0].every;
    let (across, along) = series.bistatic_m(120f64.to_radians());
    assert!((s[0][0].norm() - across.norm()).abs() < 1e-9 && (s[1][1].norm() - along.norm()).abs() < 1e-9);

    let mut beside = scene.clone();
    beside.materials.push(Material::pec());
    let mut mesh = plate(0.0, 0.2, 0.05, 0.05);
    mesh.material = vec![1; 2];
    beside.add_mesh("plate", "", mesh, Pose::IDENTITY);
    for scene in [named("cylinder:radius_m=0.005,length_m=0.1,material=polypropylene"), beside] {
        let look = [BistaticAspect::monostatic(aspect(0.0, 0.0))];
        let e = engine().rcs(&scene, &[F], &look, &RcsOptions::default()).unwrap_err().to_string();
        assert!(e.contains("is curved") && e.contains("polypropylene") && !e.contains('\n'), "{e}");
    }
    // Water is opaque at 77 GHz and not at 1 GHz, whichever comes first.
    let drop = named("sphere:radius_m=0.05,material=water");
    for frequencies_hz in [[1e9, 77e9], [77e9, 1e9]] {
        let options = RcsOptions { accuracy_db: 1.0, ..Default::default() };
        let e = engine().rcs(&drop, &frequencies_hz, &looks, &options).unwrap_err().to_string();
        assert!(e.contains("1 of 2") && e.contains("frequency_hz"), "{e}");
    }
    // What is opaque by its loss stays what it was, and so do thin curved walls.
    let water = named("sphere:radius_m=0.05,material=water");
    assert!(
        engine().rcs(&water, &[F], &looks, &RcsOptions { accuracy_db: 1.0, ..Default::default() }).is_ok()
    );
}

#[test]
fn a_free_sheet_passes_however_its_air_is_written() {
    // A sheet of 3 mm polypropylene before a plate.
    let sheet = |base: Material| {
        let mut layered = base;
        layered.layers = material::parse_spec("air+polypropylene:0.003").unwrap().layers;
        let mut scene = metal(&[plate(0.0, 0.0, 0.1, 0.1)]);
        scene.materials.push(layered);
        let mut mesh = plate(0.0, 0.0, 0.3, 0.3);
        mesh.positions_m.iter_mut().for_each(|p| p.x = 0.05);
        mesh.material = vec![1; 2];
        scene.add_mesh("sheet", "", mesh, Pose::IDENTITY);
        level(&scene, &[aspect(0.0, 0.0)], &RcsOptions::default())[0]
    };
    let want = sheet(material::by_name("air").unwrap());
    assert!(want > 10.0, "{want}");
    assert_eq!(sheet(material::by_name("eps1").unwrap()), want);
    let own = Material { name: "own".into(), ..material::by_name("eps1-0j").unwrap() };
    assert_eq!(sheet(own), want);
    for bad in ["eps", "epsilon", "eps0", "eps2.3-j", "eps-2", "eps2.3+0.1j", "eps1e9", "eps2-0.1"] {
        assert!(material::by_name(bad).is_err(), "{bad}");
    }
    let m = material::by_name("eps2.3e0-2e-2j").unwrap();
    assert_eq!(m.eps_r(F).unwrap().unwrap(), num_complex::Complex64::new(2.3, -0.02));
}

/// Two plates of 0.1 m by `depth` that face each other, a closed end behind them.
fn duct(width_m: f64, depth_m: f64) -> Scene {
    let (w, d, h) = (0.5 * width_m, depth_m, 0.05);
    let quad = |c: [[f64; 3]; 4]| Mesh {
        positions_m: c.map(DVec3::from_array).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material: vec![0; 2],
        normals: Vec::new(),
    };
    let wall = |y: f64| quad([[0.0, y, -h], [-d, y, -h], [-d, y, h], [0.0, y, h]]);
    let end = quad([[-d, -w, -h], [-d, w, -h], [-d, w, h], [-d, -w, h]]);
    metal(&[joined(&joined(&wall(-w), &wall(w)), &end)])
}

#[test]
fn bounces_are_followed_until_more_change_nothing() {
    let take = |scene: &Scene, azimuth_deg: f64, most_bounces: usize| {
        let options = RcsOptions { most_bounces, ..RcsOptions::default() };
        let sweep = Sweep {
            frequencies_hz: vec![F],
            transmit: vec![aspect(azimuth_deg, 0.0)],
            receive: None,
            options,
        };
        let mut lines = Vec::new();
        let found = sweep.take(&engine(), scene, &mut |l| lines.push(l.to_string()), &|_| ()).unwrap();
        let db = dbsm_from_amplitude(found.scattering[0].every[0][0].norm());
        (found.bounces, db, lines.iter().filter(|l| l.starts_with("bounces")).count())
    };
    // Walls 30 mm apart and 120 mm long at 30 deg: 2 bounces on each wall, one at the end, and out again.
    let scene = duct(0.03, 0.12);
    let (bounces, db, warned) = take(&scene, 30.0, 8);
    let at =
        |n: usize| level(&scene, &[aspect(30.0, 0.0)], &RcsOptions { bounces: n, ..Default::default() })[0];
    assert!(bounces > 3 && (db - at(8)).abs() < 0.1, "{bounces} {db} {}", at(8));
    assert!(at(8) - at(3) > 10.0, "{} {}", at(8), at(3));
    assert_eq!(take(&scene, 30.0, 3), (3, at(3), 0));
    assert!(warned == 0 || bounces == 8);
    // One convex body has one, a corner three.
    assert_eq!(take(&metal(&[plate(0.0, 0.0, 0.1, 0.1)]), 5.0, 8).0, 1);
    let corner = named("trihedral:leg_m=0.1");
    assert_eq!(take(&corner, 0.0, 8).0, 3);
}

#[test]
fn the_forward_scatter_is_that_of_the_shadow() {
    let forward = |scene: &Scene, receive: &[Aspect]| -> Vec<f64> {
        let looks: Vec<BistaticAspect> =
            receive.iter().map(|r| BistaticAspect { transmit: aspect(0.0, 0.0), receive: *r }).collect();
        let options = RcsOptions { accuracy_db: 0.5, bounces: 1, ..Default::default() };
        let found = engine().rcs(scene, &[F], &looks, &options).unwrap();
        found.iter().map(|s| dbsm_from_amplitude(s.every[0][0].norm())).collect()
    };
    // 4 pi A^2 / lambda^2 of what the shadow is cast by (Ufimtsev 2007, section 1.3.5), and the pattern of its aperture beside it.
    let straight = |area_m2: f64| 10.0 * (4.0 * PI * area_m2 * area_m2 / wavelength_m(F).powi(2)).log10();
    let got = forward(&metal(&[plate(0.0, 0.0, 0.1, 0.1)]), &[aspect(180.0, 0.0), aspect(179.0, 0.0)]);
    assert!((got[0] - straight(0.01)).abs() < 0.01, "{got:?}");
    let x = 0.5 * wavenumber(F) * 0.1 * 1f64.to_radians().sin();
    assert!((got[1] - got[0] - 20.0 * (x.sin() / x).abs().log10()).abs() < 0.05, "{got:?}");
    let cube = named("sphere:radius_m=0.03");
    let got = forward(&cube, &[aspect(180.0, 0.0)]);
    assert!((got[0] - straight(PI * 9e-4)).abs() < 0.2, "{got:?} for {}", straight(PI * 9e-4));
}

#[test]
fn edges_under_thin_paint_diffract_as_those_of_the_metal() {
    let at = |spec: &str| {
        let mut scene = metal(&[plate(0.0, 0.0, 0.1, 0.1)]);
        scene.materials[0] = material::parse_spec(spec).unwrap();
        let options = RcsOptions { diffraction: Diffraction::Ptd, ..Default::default() };
        level(&scene, &[aspect(40.0, 0.0)], &options)[0]
    };
    let bare = at("aluminium");
    assert!((bare - -24.95).abs() < 0.1, "{bare}");
    assert!((at("aluminium+paint-white:0.00001") - bare).abs() < 0.5);
    // A twentieth of the wavelength is 0.195 mm.
    assert!((at("aluminium+paint-white:0.0003") - bare).abs() > 3.0);
}

#[test]
fn a_closed_tube_of_plastic_passes_with_smooth_normals_and_without() {
    // A square plate behind the wall of a tube, 3 mm thick: the sheet of 3 mm before it is what the wall is.
    let tube = |sides: u32, smooth: bool| {
        let mut mesh = Mesh::default();
        let ring = |r: f64, z: f64, inwards: bool, mesh: &mut Mesh| {
            let first = mesh.positions_m.len() as u32;
            for i in 0..sides {
                let (s, c) = (2.0 * PI * (f64::from(i) + 0.5) / f64::from(sides)).sin_cos();
                mesh.positions_m.push(DVec3::new(r * c, r * s, z));
                mesh.normals.push(if inwards { -DVec3::new(c, s, 0.0) } else { DVec3::new(c, s, 0.0) });
            }
            first
        };
        let (inner, outer, h) = (0.1485, 0.1515, 0.2);
        let walls = [ring(outer, -h, false, &mut mesh), ring(outer, h, false, &mut mesh)];
        let cavity = [ring(inner, -h, true, &mut mesh), ring(inner, h, true, &mut mesh)];
        for i in 0..sides {
            let j = (i + 1) % sides;
            let mut quad = |a: u32, b: u32, c: u32, d: u32| mesh.triangles.extend([[a, b, c], [a, c, d]]);
            quad(walls[0] + i, walls[0] + j, walls[1] + j, walls[1] + i);
            quad(cavity[0] + j, cavity[0] + i, cavity[1] + i, cavity[1] + j);
        }
        if !smooth {
            mesh.normals.clear();
        }
        let mut rims = Mesh { positions_m: mesh.positions_m.clone(), ..Mesh::default() };
        for i in 0..sides {
            let j = (i + 1) % sides;
            let mut quad = |a: u32, b: u32, c: u32, d: u32| rims.triangles.extend([[a, b, c], [a, c, d]]);
            quad(walls[1] + i, walls[1] + j, cavity[1] + j, cavity[1] + i);
            quad(walls[0] + j, walls[0] + i, cavity[0] + i, cavity[0] + j);
        }
        rims.material = vec![0; rims.triangles.len()];
        mesh.material = vec![0; mesh.triangles.len()];
        let mut mesh = joined(&mesh, &rims);
        if smooth {
            mesh.normals.resize(mesh.positions_m.len(), DVec3::ZERO);
        }
        let mut scene = Scene {
            materials: vec![material::by_name("polypropylene").unwrap(), Material::pec()],
            ..Scene::default()
        };
        scene.add_mesh("tube", "", mesh, Pose::IDENTITY);
        let mut target = plate(0.0, 0.0, 0.05, 0.05);
        target.material = vec![1; 2];
        scene.add_mesh("plate", "", target, Pose::IDENTITY);
        scene
    };
    let options = RcsOptions { last: true, ..RcsOptions::default() };
    let at = |scene: &Scene| {
        let look = [BistaticAspect::monostatic(aspect(0.0, 0.0))];
        let s = engine().rcs(scene, &[F], &look, &options).unwrap()[0];
        dbsm_from_amplitude(s.last[0][0].norm())
    };
    for sides in [24, 60] {
        let (bare, smooth) = (tube(sides, false), tube(sides, true));
        assert!(said(&bare).is_empty());
        assert!(matches!(said(&smooth)[..], [Obstacle::Walls { .. }]), "{:?}", said(&smooth));
        let (flat, curved) = (at(&bare), at(&smooth));
        assert!(flat > 0.0 && (flat - curved).abs() < 1e-6, "{sides}: {flat} and {curved}");
    }
}
