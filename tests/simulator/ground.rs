//! The plane under a target: image theory against closed forms (CONVENTIONS eq. 44-48).

use catseye::base::error::Result;
use catseye::base::frames::Pose;
use catseye::base::matrix::Matrix2;
use catseye::base::units::{dbsm_from_amplitude, wavelength_m, wavenumber};
use catseye::engine::{Engine, Precision};
use catseye::rcs::closed_form::sinc;
use catseye::rcs::ground::{FresnelZone, coefficients, remark};
use catseye::rcs::{Aspect, BistaticAspect, Distance, Ground, RcsOptions, Scattering};
use catseye::road::reflector::Reflector;
use catseye::scene::{Material, MaterialKind, Scene, material};
use glam::DVec3;
use num_complex::Complex64;
use std::f64::consts::PI;

const F: f64 = 77e9;

fn rcs(scene: &Scene, looks: &[BistaticAspect], options: &RcsOptions) -> Result<Vec<Scattering>> {
    Engine::open("cpu", Precision::F64)?.rcs(scene, &[F], looks, options)
}

fn target(spec: &str, height_m: f64) -> Scene {
    let mut scene = Reflector::parse(spec).unwrap().to_scene(&material::by_name).unwrap();
    scene.objects[0].pose = Pose::new(glam::DQuat::IDENTITY, DVec3::Z * height_m);
    scene
}

fn over(ground: Ground, distance: Distance) -> RcsOptions {
    RcsOptions { ground, distance, ..Default::default() }
}

fn pec() -> Ground {
    Ground::Plane(Material::pec())
}

/// Conducts so well that its coefficients are a perfect conductor's, but is none by name.
fn nearly_pec() -> Ground {
    let kind = MaterialKind::Conductor { conductivity_s_per_m: 1e18 };
    Ground::Plane(Material { kind, ..Material::pec() })
}

fn look(azimuth_deg: f64, elevation_deg: f64) -> BistaticAspect {
    BistaticAspect::monostatic(Aspect {
        azimuth: azimuth_deg.to_radians(),
        elevation: elevation_deg.to_radians(),
    })
}

fn one(scene: &Scene, look: BistaticAspect, options: &RcsOptions) -> Matrix2 {
    rcs(scene, &[look], options).unwrap()[0].every
}

/// The look and the distance of a radar `h` above the plane, `d` away along it.
fn place(d: f64, h: f64) -> (BistaticAspect, Distance) {
    (look(0.0, h.atan2(d).to_degrees()), Distance::At(d.hypot(h)))
}

/// Two rays to a point, written out as in a textbook: (e^{-jkR}/R + rho e^{-jkR'}/R')^2.
#[test]
fn point_target_is_the_two_ray_formula() {
    let (h1, h2) = (0.15, 0.35);
    let scene = target("point:rcs_dbsm=3", h2);
    let s0 = (10f64.powf(0.3) / (4.0 * PI)).sqrt();
    let k = wavenumber(F);
    let asphalt = material::by_name("asphalt").unwrap();
    for d in [3.0, 7.3, 20.0, 57.0] {
        let (look, distance) = place(d, h1);
        let (r0, r1, r2) = (d.hypot(h1), d.hypot(h1 - h2), d.hypot(h1 + h2));
        let sin = (h1 + h2) / r2;
        for (ground, rho) in [
            (pec(), [Complex64::ONE, -Complex64::ONE]),
            (Ground::Plane(asphalt.clone()), coefficients(&asphalt, F, sin).unwrap()),
        ] {
            let s = one(&scene, look, &over(ground, distance));
            for p in 0..2 {
                let ray = |r: f64| Complex64::cis(-k * (r - r0)) / r;
                let expected = s0 * r0 * r0 * (ray(r1) + rho[p] * ray(r2)).powu(2);
                assert!((s[p][p] - expected).norm() < 1e-9 * s0, "{d} {p}: {} {expected}", s[p][p]);
            }
            assert!(s[0][1].norm() + s[1][0].norm() < 1e-12);
        }
    }
}

/// Places where |S| is least or largest along the distance, by the sign of `sense`.
fn turning_points(sense: f64, from: f64, to: f64, s: impl Fn(f64) -> f64) -> Vec<f64> {
    turning_points_of(sense, from, to, 6000, s)
}

fn turning_points_of(sense: f64, from: f64, to: f64, n: usize, s: impl Fn(f64) -> f64) -> Vec<f64> {
    let d: Vec<f64> = (0..=n).map(|i| from * (to / from).powf(i as f64 / n as f64)).collect();
    let v: Vec<f64> = d.iter().map(|d| sense * s(*d)).collect();
    (1..n).filter(|&i| v[i] > v[i - 1] && v[i] >= v[i + 1]).map(|i| d[i]).collect()
}

#[test]
fn nulls_and_peaks_of_the_two_ray_gate() {
    let scene = target("point:rcs_dbsm=0", 0.35);
    let hh = |d: f64| {
        let (look, distance) = place(d, 0.15);
        one(&scene, look, &over(pec(), distance))[1][1].norm()
    };
    for (sense, gate) in [(-1.0, [26.97, 13.48, 8.98, 6.73]), (1.0, [53.9, 17.98, 10.78, 7.70])] {
        let mut found = turning_points(sense, 6.2, 60.0, hh);
        found.reverse();
        println!("{found:?}");
        assert_eq!(found.len(), 4, "{found:?}");
        for (a, b) in found.iter().zip(gate) {
            assert!((a / b - 1.0).abs() < 0.01, "{a} {b}");
        }
    }
}

/// A corner reflector answers less to where the wave did not come from, so that the two equal terms of the middle
/// are smaller than the others together and each null becomes two, on both sides of the point's.
#[test]
fn each_null_of_a_corner_reflector_splits_in_two() {
    let mut corner = target("trihedral:leg_m=0.1", 0.35);
    corner.objects[0].pose = Pose::from_yaw_pitch_roll(DVec3::Z * 0.35, 0.0, 0.5f64.sqrt().atan(), 0.0);
    let hh = |d: f64, ground: Ground| {
        let (look, distance) = place(d, 0.15);
        let options = RcsOptions { last: false, accuracy_db: 0.05, ..over(ground, distance) };
        one(&corner, look, &options)[1][1]
    };
    for null in [26.97, 13.48, 8.98, 6.73] {
        let dips = turning_points_of(-1.0, 0.92 * null, 1.08 * null, 160, |d| hh(d, pec()).norm());
        println!("{null}: {dips:.3?}");
        assert!(dips.len() == 2 && dips[0] < 0.99 * null && dips[1] > 1.01 * null, "{null}: {dips:?}");
        // The four ways leave out what goes from the corner to the ground and back.
        let at = hh(null, pec());
        let four = hh(null, nearly_pec());
        assert!((at - four).norm() < 0.03 * hh(null, Ground::None).norm(), "{null}: {at} {four}");
    }
}

/// A plate that stands on a conducting plane, lit and seen over it: in physical optics
/// S = -(jk/2pi) w cos e [2h sinc(2kh sin e) +- 2h], + for V. The image makes a dihedral of it.
#[test]
fn plate_standing_on_the_plane() {
    let (w, h) = (0.05, 0.02);
    let scene = target(&format!("plate:width_m={w},height_m={h}"), 0.5 * h);
    let k = wavenumber(F);
    for e in [0.3f64, 0.86, 5.0, 30.0] {
        let (sin, cos) = e.to_radians().sin_cos();
        let ends = 2.0 * h * sinc(2.0 * k * h * sin);
        let scale = Complex64::new(0.0, -k / (2.0 * PI) * w * cos);
        for ground in [pec(), nearly_pec()] {
            let s = one(&scene, look(0.0, e), &over(ground, Distance::Infinite));
            for (p, sign) in [(0, 2.0), (1, -2.0)] {
                let expected = scale * (ends + sign * h);
                let error = (s[p][p] - expected).norm() / (scale * 4.0 * h).norm();
                assert!(error < 1e-6, "{e} {p}: {} {expected}", s[p][p]);
            }
        }
    }
}

/// Raised above the plane nothing goes from the plate to the ground and back: image of the target and the four
/// ways are the same, from any side and with the receiver apart.
#[test]
fn image_of_the_target_and_four_ways_agree() {
    let scene = target("plate:width_m=0.05,height_m=0.03", 0.2);
    for distance in [Distance::Infinite, Distance::At(7.0)] {
        for l in [
            look(0.0, 2.0),
            look(11.0, 20.0),
            BistaticAspect { transmit: look(3.0, 4.0).transmit, receive: look(-8.0, 9.0).receive },
        ] {
            let a = one(&scene, l, &over(pec(), distance));
            let b = one(&scene, l, &over(nearly_pec(), distance));
            let scale = a.as_flattened().iter().map(|z| z.norm()).fold(0.0, f64::max);
            for (x, y) in a.as_flattened().iter().zip(b.as_flattened()) {
                assert!((x - y).norm() < 2e-4 * scale, "{distance:?} {l:?}\n{a:?}\n{b:?}");
            }
        }
    }
}

#[test]
fn what_lies_in_the_conducting_plane_is_ground() {
    let mut scene = target("plate:width_m=0.1,height_m=0.1", 0.0);
    scene.objects[0].pose = Pose::from_yaw_pitch_roll(DVec3::ZERO, 0.0, 0.5 * PI, 0.0);
    assert_eq!(one(&scene, look(0.0, 90.0), &over(pec(), Distance::Infinite)), [[Complex64::ZERO; 2]; 2]);
    let s = one(&scene, look(0.0, 90.0), &over(Ground::None, Distance::Infinite));
    assert!((dbsm_from_amplitude(s[0][0].norm()) - 19.186).abs() < 0.01);
}

/// The marker's level on an endless conducting ground, beside that of the marker alone.
#[test]
fn low_marker_on_conducting_ground() {
    let scene = target("type1:width_m=0.16,height_m=0.004", 0.0);
    let looks: Vec<BistaticAspect> = (1..=100).map(|i| look(0.0, 0.1 * f64::from(i))).collect();
    let peak = |ground| {
        rcs(&scene, &looks, &over(ground, Distance::Infinite))
            .unwrap()
            .iter()
            .map(|s| dbsm_from_amplitude(s.every[0][0].norm()))
            .fold(f64::NEG_INFINITY, f64::max)
    };
    let (alone, on_metal) = (peak(Ground::None), peak(pec()));
    let asphalt = peak(Ground::Plane(material::by_name("asphalt").unwrap()));
    println!(
        "type 1, H = 4 mm, VV: alone {alone:.2}, on metal {on_metal:.2}, asphalt around {asphalt:.2} dBsm"
    );
    assert!((on_metal - 7.2).abs() < 0.1, "{on_metal}");
}

#[test]
fn coefficients_are_fresnels() {
    let asphalt = material::by_name("asphalt").unwrap();
    // Grazing: both to -1. Brewster's angle tan = sqrt(eps) from the normal: nothing of V.
    let eps = asphalt.eps_r(F).unwrap().unwrap().re;
    let [v, h] = coefficients(&asphalt, F, 1e-6).unwrap();
    assert!((v + 1.0).norm() < 1e-4 && (h + 1.0).norm() < 1e-4, "{v} {h}");
    let [v, h] = coefficients(&asphalt, F, 1.0 / (1.0 + eps).sqrt()).unwrap();
    assert!(v.norm() < 1e-12 && (h.re + (eps - 1.0) / (eps + 1.0)).abs() < 1e-12, "{v} {h}");
    let rough = Material { roughness_rms_m: 1e-3, ..asphalt.clone() };
    let [w, _] = coefficients(&rough, F, 0.5).unwrap();
    let [v, _] = coefficients(&asphalt, F, 0.5).unwrap();
    assert!((w.norm() / v.norm() - (-2.0 * (wavenumber(F) * 1e-3 * 0.5).powi(2)).exp()).abs() < 1e-12);
}

#[test]
fn fresnel_zones_end_half_a_wavelength_later() {
    let lambda = wavelength_m(F);
    for (d, h1, h2) in [(3.0, 0.15, 0.35), (30.0, 0.5, 0.0), (60.0, 0.15, 1.2), (12.0, 0.6, 0.002)] {
        let z = FresnelZone::at_range(d, h1, h2, lambda);
        for x in [z.near_m, z.far_m] {
            let way = x.hypot(h2) + (d - x).hypot(h1);
            assert!((way - d.hypot(h1 + h2) - 0.5 * lambda).abs() < 1e-9, "{d} {h1} {h2}: {z:?}");
        }
        assert!(z.near_m < z.far_m);
    }
    for (e, h) in [(0.9f64, 0.0), (0.9, 0.3), (20.0, 0.05), (80.0, 2.0)] {
        let e = e.to_radians();
        let z = FresnelZone::far_field(e, h, lambda);
        for x in [z.near_m, z.far_m] {
            let way = x.hypot(h) - x * e.cos();
            assert!((way - h * e.sin() - 0.5 * lambda).abs() < 1e-9, "{e} {h}: {z:?}");
        }
        let far = FresnelZone::at_range(1e6 * e.cos(), 1e6 * e.sin(), h, lambda);
        assert!((far.length_m() / z.length_m() - 1.0).abs() < 1e-3, "{far:?} {z:?}");
    }
    // The zone of a marker on the road is metres long.
    let z = FresnelZone::far_field(0.9f64.to_radians(), 0.0, lambda);
    assert!((z.length_m() - 15.78).abs() < 0.01, "{z:?}");
}

#[test]
fn warnings_where_the_zone_reaches_the_target() {
    let marker = target("type1", 0.0);
    let corner = target("trihedral:leg_m=0.1", 0.35);
    let low = look(0.0, 0.86).transmit;
    let warning = |scene: &Scene, aspect, options: &RcsOptions| {
        remark(scene.bounds_m(0.0).unwrap(), F, aspect, options).map(|r| r.to_string())
    };
    let w = warning(&marker, low, &over(pec(), Distance::Infinite)).unwrap();
    assert!(w.contains("is not valid there") && w.contains("--ground none"), "{w}");
    assert_eq!(warning(&marker, low, &over(Ground::None, Distance::Infinite)), None);
    let (l, distance) = place(10.0, 0.15);
    assert_eq!(warning(&corner, l.transmit, &over(pec(), distance)), None);
}

#[test]
fn bad_input() {
    let complaint = |scene: &Scene, l: BistaticAspect, ground: Ground| {
        let e = rcs(scene, &[l], &over(ground, Distance::Infinite)).unwrap_err();
        assert_eq!(e.exit_code(), 2, "{e}");
        e.to_string()
    };
    let plate = target("plate:width_m=0.1,height_m=0.1", 0.2);
    assert!(complaint(&plate, look(0.0, -1.0), pec()).contains("below the ground"));
    let e = complaint(&target("plate:width_m=0.1,height_m=0.1", 0.01), look(0.0, 1.0), pec());
    assert!(e.contains("'plate'") && e.contains("z = -0.040000 m") && e.contains("--height-m"), "{e}");
    let thin = Material { valid_hz: (1e9, 2e9), ..material::by_name("asphalt").unwrap() };
    assert!(complaint(&plate, look(0.0, 1.0), Ground::Plane(thin)).contains("no value at 77"));
}
