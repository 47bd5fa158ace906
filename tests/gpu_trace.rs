//! Tracing and cross sections: the shaders against the f64 engine, on the adapter that
//! CATSEYE_TEST_DEVICE names (default: the software Vulkan driver).

use catseye::cpu;
use catseye::frames::{Pose, Sensor, World};
use catseye::geom::Geometry;
use catseye::gpu::{Gpu, Want, compare};
use catseye::rcs::{Aspect, Distance, RayGrid, Scattering, po_sum};
use catseye::scene::material::{self, Material, MaterialKind};
use catseye::scene::{Mesh, Scene};
use catseye::trace::launch::{Cell, Fan};
use catseye::trace::{Convention, Returns, TraceOptions, contribute};
use glam::{DQuat, DVec3};

fn p(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

fn mesh(faces: &[[DVec3; 3]], material: u32) -> Mesh {
    Mesh {
        positions_m: faces.iter().flatten().copied().collect(),
        triangles: (0..faces.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        material: vec![material; faces.len()],
        ..Mesh::default()
    }
}

fn trihedral(a: f64) -> Vec<[DVec3; 3]> {
    let r = a * 0.5f64.sqrt();
    let (o, l, rr, t) = (p(0., 0., 0.), p(r, r, 0.), p(r, -r, 0.), p(0., 0., a));
    vec![[o, rr, l], [o, l, t], [o, t, rr]]
}

fn cuboid(c: DVec3, s: DVec3) -> Vec<[DVec3; 3]> {
    let v = |i: usize| {
        let sign = |b: usize| if i >> b & 1 == 1 { 0.5 } else { -0.5 };
        c + s * p(sign(0), sign(1), sign(2))
    };
    [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
        .iter()
        .flat_map(|q| [[v(q[0]), v(q[1]), v(q[2])], [v(q[0]), v(q[2]), v(q[3])]])
        .collect()
}

fn dielectric(eps_real: f64, eps_loss: f64) -> Material {
    Material {
        name: "test".into(),
        kind: MaterialKind::Dielectric { eps_real, eps_loss, conductivity_s_per_m: 0.0 },
        ..Material::pec()
    }
}

fn flat(s: &[Scattering]) -> (Vec<f64>, Vec<f64>) {
    let take = |m: &[[num_complex::Complex64; 2]; 2]| {
        m.iter().flatten().flat_map(|z| [z.re, z.im]).collect::<Vec<_>>()
    };
    (s.iter().flat_map(|s| take(&s.every)).collect(), s.iter().flat_map(|s| take(&s.last)).collect())
}

fn compare_sweeps(scene: &Scene, aspects: &[Aspect], options: &RayGrid) {
    let gpu = compare::test_gpu();
    let geometry = Geometry::build(scene, 0.0, 77e9).unwrap();
    let truth = flat(&cpu::rcs::po_sum::sweep(&geometry, aspects, options));
    let found = flat(&po_sum::sweep(gpu, &geometry, aspects, options).unwrap());
    for (name, t, f) in [("every", &truth.0, &found.0), ("last", &truth.1, &found.1)] {
        let f32s: Vec<f32> = f.iter().map(|x| *x as f32).collect();
        let found = compare::check_close(&f32s, t, po_sum::KERNEL.tolerance.relative_l2);
        println!("{name}: {found:?}");
        found.unwrap();
    }
}

fn deg(az: f64, el: f64) -> Aspect {
    Aspect { azimuth: az.to_radians(), elevation: el.to_radians() }
}

#[test]
fn cross_section_of_a_trihedral_of_metal_plastic_and_wet_paint() {
    let wet = material::parse_spec("aluminium+paint-white:0.0003+water:0.0002").unwrap();
    let materials = vec![Material::pec(), dielectric(2.6, 0.02), wet];
    let mut scene = Scene { materials, ..Default::default() };
    let mut m = mesh(&trihedral(0.05), 0);
    m.material[1] = 1;
    m.material[2] = 2;
    scene.add_mesh("corner", "", m, Pose::IDENTITY);
    let aspects: Vec<Aspect> = (-4..=4).map(|i| deg(7.3 * i as f64, 30.0)).collect();
    for distance in [Distance::Infinite, Distance::At(3.0)] {
        compare_sweeps(&scene, &aspects, &RayGrid { bounces: 3, rays_per_wavelength: 6.0, distance });
    }
}

fn street() -> (Geometry, Fan, Pose<Sensor, World>) {
    let materials = vec![
        Material::pec(),
        dielectric(5.0, 0.5),
        Material { roughness_rms_m: 2e-4, ..dielectric(4.0, 0.1) },
        Material { roughness_rms_m: 1e-4, ..material::parse_spec("air+glass:0.003").unwrap() },
    ];
    let mut scene = Scene { materials, ..Default::default() };
    scene.add_mesh(
        "road",
        "road",
        mesh(
            &[
                [p(0., -20., 0.), p(120., -20., 0.), p(120., 20., 0.)],
                [p(0., -20., 0.), p(120., 20., 0.), p(0., 20., 0.)],
            ],
            1,
        ),
        Pose::IDENTITY,
    );
    for (i, x) in [8.0, 23.0, 61.0].into_iter().enumerate() {
        scene.add_mesh(
            "box",
            "marker",
            mesh(&cuboid(p(0., 0., 0.3), p(0.5, 0.8, 0.6)), [0, 2, 3][i]),
            Pose::new(DQuat::from_rotation_z(0.3 * i as f64), p(x, 2.0 - 2.0 * i as f64, 0.0)),
        );
    }
    let id = scene.add_mesh(
        "corner",
        "",
        mesh(&trihedral(0.3), 0),
        Pose::new(DQuat::from_rotation_z(std::f64::consts::PI), p(30.0, -3.0, 0.1)),
    );
    scene.objects.iter_mut().find(|o| o.id == id).unwrap().velocity_mps = p(-7.0, 1.0, 0.0);
    let geometry = Geometry::build(&scene, 0.0, 77e9).unwrap();
    let pose = Pose::from_yaw_pitch_roll(p(0.0, 0.1, 0.5), 0.05, 0.01, 0.02);
    let mut cells = Vec::new();
    let n = [300, 160];
    for j in 0..n[1] {
        for i in 0..n[0] {
            let (da, ds) = (0.8 / n[0] as f64, 0.16 / n[1] as f64);
            cells.push(Cell {
                azimuth: -0.4 + (i as f64 + 0.517) * da,
                sin_elevation: -0.1 + (j as f64 + 0.473) * ds,
                d_azimuth: da,
                d_sin: ds,
            });
        }
    }
    (geometry, Fan { origin_m: pose.translation_m, rotation: DQuat::IDENTITY, cells }, pose)
}

/// Pairs of returns of the same tube and bounce; both lists are in launch order.
fn field(r: &Returns, geometry: &Geometry) -> Vec<f64> {
    let k = catseye::units::wavenumber(geometry.freq_hz);
    r.returns
        .iter()
        .flat_map(|r| {
            let cis = num_complex::Complex64::cis(-k * r.path_length_m);
            r.spread.iter().flatten().flat_map(move |z| [(z * cis).re, (z * cis).im]).collect::<Vec<_>>()
        })
        .collect()
}

#[test]
fn returns_of_a_street() {
    let gpu = compare::test_gpu();
    let (geometry, fan, pose) = street();
    let velocity = p(10.0, 0.5, 0.0);
    for convention in [Convention::Every, Convention::Last] {
        let options = TraceOptions { bounces: 4, convention, amplitude_floor: 0.0 };
        let truth = cpu::trace::contribute::returns(&geometry, &fan, &pose, velocity, &options);
        let found = contribute::returns(gpu, &geometry, &fan, &pose, velocity, &options).unwrap();
        println!("{} {}", truth.returns.len(), found.returns.len());
        assert!(truth.returns.len() > 500);
        // Axes that graze an edge within f32 rounding may fall on its other side: pair by departure and
        // bounce, and count what has no partner.
        let key = |r: &catseye::trace::Return| {
            let d = pose.rotation * r.departure;
            let cell = |x: f64, first: f64, step: f64| ((x - first) / step).round() as i32;
            let (first, c) = (fan.cells[0], fan.cells[0]);
            (
                cell(d.y.atan2(d.x), first.azimuth, c.d_azimuth),
                cell(d.z, first.sin_elevation, c.d_sin),
                r.bounces,
                r.chain,
            )
        };
        // Both ends of a footprint have one key: the first with the first, the second with the second.
        let numbered = |returns: &Returns| {
            let mut count = std::collections::HashMap::new();
            let number = |r: &catseye::trace::Return| {
                let n = count.entry(key(r)).or_insert(0);
                *n += 1;
                ((key(r), *n), r.clone())
            };
            returns.returns.iter().map(number).collect::<Vec<_>>()
        };
        let by_key: std::collections::HashMap<_, _> = numbered(&truth).into_iter().collect();
        let (mut a, mut b) = (Returns::default(), Returns::default());
        for (key, r) in numbered(&found) {
            if let Some(t) = by_key.get(&key) {
                a.returns.push(t.clone());
                b.returns.push(r);
            }
        }
        let lost = found.returns.len().max(truth.returns.len()) - a.returns.len();
        println!("without partner: {lost}");
        assert!(lost * 500 <= truth.returns.len(), "{lost} of {}", truth.returns.len());
        let f32s: Vec<f32> = field(&b, &geometry).iter().map(|x| *x as f32).collect();
        let near =
            compare::check_close(&f32s, &field(&a, &geometry), contribute::KERNEL.tolerance.relative_l2);
        println!("{near:?}");
        near.unwrap();
        for (t, f) in a.returns.iter().zip(&b.returns) {
            // An end of a footprint lies x/k from its middle, and x is f32: at grazing incidence that is much.
            // What it does to the field is judged above.
            assert!((t.path_length_m - f.path_length_m).abs() < 1e-5, "{t:?} {f:?}");
            assert!((t.path_rate_mps - f.path_rate_mps).abs() < 1e-5, "{t:?} {f:?}");
            assert!((t.departure - f.departure).length() < 1e-6 && (t.arrival - f.arrival).length() < 1e-6);
        }
    }
}

#[test]
fn chunks_give_the_same_returns() {
    let (geometry, fan, pose) = street();
    let options = TraceOptions::default();
    let run = |gpu: &Gpu| contribute::returns(gpu, &geometry, &fan, &pose, DVec3::ZERO, &options).unwrap();
    let whole = run(compare::test_gpu());
    let name = compare::test_device_name();
    let small = run(&Gpu::open(Want::Named(&name)).unwrap().with_binding_limit(1 << 20));
    assert!(whole == small);
}
