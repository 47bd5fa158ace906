//! Facets of the reflectors against closed forms: the physical-optics integral over every lit
//! triangle, done exactly, without any ray. It holds for convex bodies, where nothing is shadowed
//! and nothing bounces twice.

use catseye::base::frames::direction_from_angles;
use catseye::base::units::{dbsm_from_amplitude, wavenumber};
use catseye::geom::curved::{refined, sagitta_m};
use catseye::rcs::closed_form::{mie_sphere, po_cylinder, po_cylinder_mantle, po_plate, po_sphere};
use catseye::road::reflector::Reflector;
use catseye::scene::Mesh;
use glam::DVec3;
use num_complex::Complex64;
use std::f64::consts::PI;

const F: f64 = 77e9;

/// Mean of e^{jx} over a triangle with these x at its corners and linear between: by Hermite and
/// Genocchi, minus twice the second divided difference of e^{jx}.
fn mean_phasor(phases: [f64; 3]) -> Complex64 {
    let middle = phases.iter().sum::<f64>() / 3.0;
    let mut x = phases.map(|p| p - middle);
    x.sort_by(f64::total_cmp);
    let [a, b, c] = x;
    let mean = if c - a < 0.3 {
        // Series in the complete symmetric polynomials h_n: 2 sum j^n h_n / (n + 2)!.
        let mut h = [1.0, 1.0, 1.0]; // h_n of (a), (a, b), (a, b, c)
        let (mut sum, mut factor) = (Complex64::ONE, Complex64::ONE);
        for n in 1..14 {
            h[0] *= a;
            h[1] = h[0] + b * h[1];
            h[2] = h[1] + c * h[2];
            factor *= Complex64::I / f64::from(n + 2);
            sum += factor * h[2];
        }
        sum
    } else {
        let first = |p: f64, q: f64| {
            let half = 0.5 * (p - q);
            let s = if half.abs() < 1e-8 { 1.0 } else { half.sin() / half };
            Complex64::I * Complex64::cis(0.5 * (p + q)) * s
        };
        (first(a, b) - first(b, c)) * -2.0 / (a - c)
    };
    mean * Complex64::cis(middle)
}

/// S of the lit facets of a convex body towards the radar in the direction `u`.
fn po_facets(mesh: &Mesh, u: DVec3) -> Complex64 {
    let k = wavenumber(F);
    let sum: Complex64 = mesh
        .triangles
        .iter()
        .map(|t| {
            let p = t.map(|i| mesh.positions_m[i as usize]);
            let facing = 0.5 * (p[1] - p[0]).cross(p[2] - p[0]).dot(u);
            if facing <= 0.0 { Complex64::ZERO } else { mean_phasor(p.map(|p| 2.0 * k * p.dot(u))) * facing }
        })
        .sum();
    sum * Complex64::new(0.0, -k / (2.0 * PI))
}

fn mesh(spec: &str) -> Mesh {
    Reflector::parse(spec).unwrap().mesh().unwrap()
}

fn db(a: Complex64, b: Complex64) -> f64 {
    dbsm_from_amplitude(a.norm()) - dbsm_from_amplitude(b.norm())
}

#[test]
fn the_integral_itself() {
    for phases in [[0.1, 0.15, 0.02], [0.0, 0.0, 0.0], [5.0, -3.0, 11.0], [2.0, 2.0, 9.0], [1.0, 1.2, 1.31]] {
        let n = 400;
        let mut sum = Complex64::ZERO;
        for i in 0..n {
            for j in 0..n - i {
                // Centroids of the upright and the inverted small triangles.
                for (shift, there) in [(1.0 / 3.0, true), (2.0 / 3.0, i + j + 1 < n)] {
                    let (s, t) = ((i as f64 + shift) / n as f64, (j as f64 + shift) / n as f64);
                    if there {
                        let p = phases[0] * (1.0 - s - t) + phases[1] * s + phases[2] * t;
                        sum += Complex64::cis(p);
                    }
                }
            }
        }
        let brute = sum / f64::from(n * n);
        assert!((mean_phasor(phases) - brute).norm() < 1e-4, "{phases:?}: {} {brute}", mean_phasor(phases));
    }
}

#[test]
fn plate_is_its_closed_form() {
    let m = mesh("plate:width_m=0.15,height_m=0.08");
    for i in 0..60 {
        let u = direction_from_angles(-0.6 + 0.021 * f64::from(i), -0.3 + 0.011 * f64::from(i));
        let (a, b) = (po_facets(&m, u), po_plate(0.15, 0.08, F, u));
        assert!((a - b).norm() < 1e-12, "{i}: {a} {b}");
    }
}

/// Gate 0.2 dB, here at the lobes down to 30 dB under broadside.
#[test]
fn cylinder_broadside_and_off() {
    let (a, l) = (0.003, 0.15);
    let peak = po_cylinder(a, l, F, DVec3::X).norm();
    let (open, closed) = (mesh("cylinder:ends=open"), mesh("cylinder"));
    let k = wavenumber(F);
    let mut worst = 0.0f64;
    let mut seen = 0;
    for lobe in 0..24 {
        // Maxima of the sinc along the axis: broadside, then near odd multiples of pi/2.
        let sin_el = if lobe == 0 { 0.0 } else { PI * (f64::from(lobe) + 0.5) / (k * l) };
        for az in [0.0, 0.7, 2.0, -3.1] {
            let u = direction_from_angles(az, sin_el.asin());
            for (m, exact) in [(&open, po_cylinder_mantle(a, l, F, u)), (&closed, po_cylinder(a, l, F, u))] {
                if exact.norm() > peak * 0.0316 {
                    worst = worst.max(db(po_facets(m, u), exact).abs());
                    seen += 1;
                }
            }
        }
    }
    println!("cylinder 6 x 150 mm: worst {worst:.4} dB over {seen} lobes");
    assert!(seen > 40 && worst < 0.2, "{worst}");
}

/// Gate 0.15 dB against Mie for ka >= 40 with the default sagitta, from any side.
#[test]
fn sphere_of_default_sagitta() {
    for ka in [40.0, 80.7, 161.4] {
        let radius = ka / wavenumber(F);
        // As cross sections take it.
        let m = refined(&mesh(&format!("sphere:radius_m={radius}")), sagitta_m(0.1, wavenumber(F)))
            .unwrap()
            .unwrap();
        let (po, mie) = (po_sphere(radius, F), mie_sphere(radius, F).unwrap());
        let (mut worst, mut worst_phase, mut worst_po) = (0.0f64, 0.0f64, 0.0f64);
        for i in 0..25 {
            let u = direction_from_angles(-3.0 + 0.25 * f64::from(i), -1.4 + 0.115 * f64::from(i));
            let s = po_facets(&m, u);
            worst = worst.max(db(s, mie).abs());
            worst_po = worst_po.max(db(s, po).abs());
            worst_phase = worst_phase.max((s / mie).arg().abs());
        }
        println!(
            "sphere ka {ka}: {} triangles, worst {worst:.4} dB and {worst_phase:.4} rad from Mie, {worst_po:.4} dB \
             from smooth PO",
            m.triangles.len()
        );
        assert!(worst < 0.15, "ka {ka}: {worst} dB");
        assert!(worst_phase < 0.05, "ka {ka}: {worst_phase} rad");
    }
}

/// Facets between points of the sphere lie three quarters of the sagitta too deep on average, so their return
/// comes late by 2k * 3/4 sagitta; cross sections raise them to the mean height.
#[test]
fn an_inscribed_sphere_is_late_and_a_raised_one_is_not() {
    let radius = 0.05;
    let m = mesh("sphere:radius_m=0.05,sagitta_m=6e-5");
    // So coarse a limit that no facet is cut.
    let raised = refined(&m, 1e-3).unwrap().unwrap();
    assert_eq!(raised.triangles.len(), m.triangles.len());
    let mie = mie_sphere(radius, F).unwrap();
    let phase = |m: &Mesh| (po_facets(m, direction_from_angles(0.3, 0.2)) / mie).arg();
    let (right, late) = (phase(&raised), phase(&m));
    let height =
        raised.positions_m.iter().map(|p| p.length() - radius).sum::<f64>() / raised.positions_m.len() as f64;
    let expected = -2.0 * wavenumber(F) * height;
    assert!(right.abs() < 0.04, "{right}");
    assert!((late - right - expected).abs() < 0.02 && expected < -0.08, "{late} {right} {expected}");
}
