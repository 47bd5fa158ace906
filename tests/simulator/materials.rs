//! Layered materials from their names to cross sections, against the Austin RCS Benchmark Suite, set II.C
//! (a thin dielectric plate, method of moments), and closed forms.

use catseye::base::frames::Pose;
use catseye::base::units::{dbsm_from_amplitude, wavelength_m, wavenumber};
use catseye::em::covering::coverings;
use catseye::em::layers::{Backing, Stack};
use catseye::geom::{Geometry, Surface};
use catseye::rcs::cpu::po_sum::by_rays;
use catseye::rcs::{Aspect, Distance, RayGrid, Scattering};
use catseye::scene::material::{self, Layer, Material, MaterialKind};
use catseye::scene::{Mesh, Scene};
use glam::DVec3;
use std::path::Path;

/// A plate in the y-z plane, its normal +x, width along y.
fn plate(width_m: f64, height_m: f64, material: Material, freq_hz: f64) -> Geometry {
    let p = |y: f64, z: f64| DVec3::new(0.0, y * width_m, z * height_m);
    let mesh = Mesh {
        normals: Vec::new(),
        positions_m: vec![p(-0.5, -0.5), p(0.5, -0.5), p(0.5, 0.5), p(-0.5, 0.5)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material: vec![0, 0],
    };
    let mut scene = Scene { materials: vec![material], ..Default::default() };
    scene.add_mesh("plate", "", mesh, Pose::IDENTITY);
    Geometry::build(&scene, 0.0, freq_hz).unwrap()
}

fn seen(geometry: &Geometry, azimuth_deg: f64) -> Scattering {
    let aspect = Aspect { azimuth: azimuth_deg.to_radians(), elevation: 0.0 };
    let options = RayGrid { bounces: 1, rays_per_wavelength: 8.0, distance: Distance::Infinite };
    by_rays(geometry, &[aspect], &options)[0]
}

fn dielectric(name: &str, eps_real: f64, eps_loss: f64) -> Material {
    Material {
        name: name.into(),
        kind: MaterialKind::Dielectric { eps_real, eps_loss, conductivity_s_per_m: 0.0 },
        ..Material::pec()
    }
}

/// 1.5 mm of plastic, 6 in x 10.5 in, its long side across: broadside and the main lobe down to 6 dB, by
/// physical optics without edges.
#[test]
fn thin_dielectric_plate_of_the_austin_suite() {
    let width = 6.0 * 0.0254;
    for (code, eps_loss) in [("f10", 3.54e-2), ("fx1", 3.46e-2), ("f11", 3.21e-2)] {
        for (pol, polarisation) in ["V", "H"].into_iter().enumerate() {
            let file = format!("tests/data/austin_rcs/ref_rcs.II.C.sx1.{code}.{polarisation}.txt");
            let text = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(&file)).unwrap();
            let rows: Vec<Vec<f64>> = text
                .lines()
                .filter(|l| !l.trim().is_empty())
                .map(|l| l.split_whitespace().map(|w| w.parse().unwrap()).collect())
                .collect();
            assert_eq!(rows.len(), 181, "{file}");
            let air = material::by_name("air").unwrap();
            let sheet = Layer::new(dielectric("plastic", 2.61, eps_loss), 1.5e-3).unwrap();
            let geometry = plate(1.75 * width, width, air.with_layers(vec![sheet]).unwrap(), rows[0][0]);
            let level =
                |azimuth_deg: f64| dbsm_from_amplitude(seen(&geometry, azimuth_deg).every[pol][pol].norm());
            let difference = level(0.0) - rows[0][3];
            println!("{code} {polarisation}: broadside {difference:+.2} dB");
            assert!(difference.abs() < 0.1, "{file}: {difference} dB");
            let mut worst = 0.0f64;
            for row in rows.iter().take_while(|r| r[3] > rows[0][3] - 6.0) {
                worst = worst.max((level(row[2]) - row[3]).abs());
            }
            println!("  main lobe {worst:.2} dB");
            assert!(worst < 0.15, "{file}: {worst} dB");
        }
    }
}

/// Normal incidence: the plate of metal times the reflection of the stack, whatever lies on it.
#[test]
fn coverings_at_normal_incidence() {
    let (w, h, f) = (0.05, 0.03, 77e9);
    let metal = 4.0 * std::f64::consts::PI * (w * h / wavelength_m(f)).powi(2);
    for c in coverings().unwrap() {
        let surface = Surface::of(&c.material, f).unwrap();
        let r = surface.reflection(wavenumber(f), 1.0).0.norm();
        let s = seen(&plate(w, h, c.material.clone(), f), 0.0);
        for p in 0..2 {
            let sigma = 4.0 * std::f64::consts::PI * s.every[p][p].norm_sqr();
            assert!((sigma / (metal * r * r) - 1.0).abs() < 1e-9, "{}: {sigma}", c.name);
        }
        println!("{:45} {:6.2} dB at normal incidence", c.name, 20.0 * r.log10());
    }
}

#[test]
fn specs() {
    let m = material::parse_spec("aluminium+paint-white:0.0002 + water:1e-4").unwrap();
    assert_eq!(m.name, "aluminium+paint-white:0.0002+water:1e-4");
    let names: Vec<(&str, f64)> =
        m.layers.iter().map(|l| (l.material.name.as_str(), l.thickness_m)).collect();
    // Named from the base outwards, kept from outside inwards.
    assert_eq!(names, [("water", 1e-4), ("paint-white", 2e-4)]);
    assert_eq!(material::parse_spec("steel").unwrap(), material::by_name("steel").unwrap());
    for (spec, expect) in [
        ("aluminium+water", "layer = water: has no thickness"),
        ("aluminium+water:wet", "the thickness is not a number"),
        ("aluminium+water:0", "is out of range; allowed: 1e-9..10 m"),
        ("aluminium+water:nan", "is out of range"),
        ("aluminium+watre:0.1", "did you mean 'water'?"),
        ("aluminum+water:0.1", "did you mean 'aluminium'?"),
        ("aluminium+pec:0.1", "a perfect conductor hides the layers under it"),
        ("+water:0.1", "no material is named ''"),
        ("", "no material is named ''"),
    ] {
        let e = material::parse_spec(spec).unwrap_err();
        assert_eq!(e.exit_code(), 2);
        assert!(e.to_string().contains(expect), "{spec}: {e}");
    }
    let many = format!("steel{}", "+ice:0.001".repeat(17));
    assert!(material::parse_spec(&many).unwrap_err().to_string().contains("at most 16"));
}

#[test]
fn surfaces_of_all_kinds() {
    let f = 77e9;
    let k = wavenumber(f);
    let of = |spec: &str| Surface::of(&material::parse_spec(spec).unwrap(), f).unwrap();
    assert_eq!(of("pec").stack, Stack::PEC);
    assert!(matches!(of("water").stack.backing, Backing::HalfSpace(_)));
    assert!(
        of("water").transmission(k, 0.5).is_none() && of("steel+water:0.001").transmission(k, 0.5).is_none()
    );
    let (perp, par) = of("air").transmission(k, 0.3).unwrap();
    assert!((perp - 1.0).norm() < 1e-14 && (par - 1.0).norm() < 1e-14);
    let glass = of("air+glass:0.004");
    let (t, r) = (glass.transmission(k, 0.7).unwrap(), glass.reflection(k, 0.7));
    assert!(t.0.norm_sqr() + r.0.norm_sqr() < 1.0 && t.0.norm() > 0.05);
    // A rough front takes from both.
    let rough = Surface { roughness_rms_m: 2e-4, ..glass };
    let (t2, r2) = (rough.transmission(k, 0.7).unwrap(), rough.reflection(k, 0.7));
    assert!((r2.0 / r.0 - (-2.0 * (k * 2e-4 * 0.7f64).powi(2)).exp()).norm() < 1e-14);
    assert!(t2.0.norm() < t.0.norm() && t2.0.norm() > 0.5 * t.0.norm());
}

#[test]
fn one_geometry_serves_all_frequencies() {
    let spec = "steel+ice:0.002";
    let g = plate(0.1, 0.1, material::parse_spec(spec).unwrap(), 77e9);
    for f in [40e9, 77e9, 81e9] {
        let there = plate(0.1, 0.1, material::parse_spec(spec).unwrap(), f);
        assert_eq!(g.surfaces_at(f).unwrap(), there.surfaces);
    }
    assert_ne!(g.surfaces_at(40e9).unwrap(), g.surfaces);
    let e = g.surfaces_at(10e9).unwrap_err().to_string();
    assert!(e.contains("'ice' has no value at 10.0000 GHz") && e.contains("30.000..200.000 GHz"), "{e}");
}
