//! Tracing and cross sections: the shaders against the f64 engine, on the adapter that
//! CATSEYE_TEST_DEVICE names (default: the software Vulkan driver).

use catseye::base::frames::Pose;
use catseye::geom::Geometry;
use catseye::gpu::compare;
use catseye::rcs::{Aspect, Distance, RayGrid, Scattering, po_sum};
use catseye::scene::material::{self, Material, MaterialKind};
use catseye::scene::{Mesh, Scene};
use glam::DVec3;

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
    let truth = flat(&catseye::rcs::cpu::po_sum::by_rays(&geometry, aspects, options));
    let found = flat(&po_sum::by_rays(gpu, &geometry, aspects, options).unwrap());
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
