//! Plates and a box against the Austin RCS Benchmark Suite (see tests/data/austin_rcs), with and without
//! edge diffraction. References are method-of-moments solutions. Comparisons are made at the peaks of the
//! reference's lobes, where a difference in dB means something; a peak of ours may lie one step of the
//! reference's half degree to the side.

use catseye::cpu::rcs::ptd;
use catseye::frames::{Pose, direction_from_angles};
use catseye::geom::Geometry;
use catseye::geom::edges::{SMOOTH_RAD, find};
use catseye::rcs::closed_form::po_plate;
use catseye::rcs::{Aspect, Distance, RcsOptions};
use catseye::scene::{Material, Mesh, Scene};
use catseye::units::{dbsm_from_amplitude, wavenumber};
use glam::DVec3;
use num_complex::Complex64;
use std::path::Path;

const INCH: f64 = 0.0254;
/// Names of the frequencies in the files.
const FREQUENCIES: [(&str, f64); 4] = [("f9", 2.56e9), ("f10", 5.12e9), ("fx1", 7e9), ("f11", 10.24e9)];

/// One cut: the observer's elevation and azimuth in degrees, and the reference in dBsm.
struct Cut {
    freq_hz: f64,
    elevation_deg: f64,
    azimuth_deg: Vec<f64>,
    reference_dbsm: Vec<f64>,
}

fn cut(file: &str) -> Cut {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/austin_rcs").join(file);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{file}: {e}"));
    let rows: Vec<Vec<f64>> = text
        .lines()
        .filter(|l| !l.trim().is_empty())
        .map(|l| l.split_whitespace().map(|w| w.parse().unwrap()).collect())
        .collect();
    assert!(rows.len() >= 181 && rows.iter().all(|r| r.len() == 4), "{file}");
    Cut {
        freq_hz: rows[0][0],
        elevation_deg: 90.0 - rows[0][1],
        azimuth_deg: rows.iter().map(|r| r[2]).collect(),
        reference_dbsm: rows.iter().map(|r| r[3]).collect(),
    }
}

impl Cut {
    fn aspects(&self) -> Vec<Aspect> {
        let elevation = self.elevation_deg.to_radians();
        self.azimuth_deg.iter().map(|a| Aspect { azimuth: a.to_radians(), elevation }).collect()
    }

    fn directions(&self) -> Vec<DVec3> {
        self.aspects().iter().map(|a| direction_from_angles(a.azimuth, a.elevation)).collect()
    }

    /// Indices of the reference's lobe peaks with azimuth in [from, to) degrees; the ends of the cut count
    /// where the value falls from them.
    fn peaks(&self, from: f64, to: f64) -> Vec<usize> {
        let r = &self.reference_dbsm;
        (0..r.len())
            .filter(|&i| {
                let a = self.azimuth_deg[i];
                from <= a && a < to && (i == 0 || r[i] >= r[i - 1]) && (i + 1 == r.len() || r[i] > r[i + 1])
            })
            .collect()
    }

    /// Worst and root-mean-square difference in dB at those peaks, ours being the highest value within one step.
    fn compare(&self, ours: &[Complex64], peaks: &[usize]) -> (f64, f64) {
        let db: Vec<f64> = ours.iter().map(|s| dbsm_from_amplitude(s.norm())).collect();
        let difference = |&i: &usize| {
            let near = &db[i.saturating_sub(1)..(i + 2).min(db.len())];
            near.iter().copied().fold(f64::NEG_INFINITY, f64::max) - self.reference_dbsm[i]
        };
        let all: Vec<f64> = peaks.iter().map(difference).collect();
        let worst = all.iter().fold(0.0f64, |m, d| m.max(d.abs()));
        (worst, (all.iter().map(|d| d * d).sum::<f64>() / all.len() as f64).sqrt())
    }
}

fn geometry(faces: &[Vec<DVec3>], freq_hz: f64) -> Geometry {
    let mut mesh = Mesh::default();
    for face in faces {
        let first = mesh.positions_m.len() as u32;
        mesh.positions_m.extend(face);
        for i in 1..face.len() as u32 - 1 {
            mesh.triangles.push([first, first + i, first + i + 1]);
            mesh.material.push(0);
        }
    }
    let mut scene = Scene::default();
    scene.materials.push(Material::pec());
    scene.add_mesh("target", "", mesh, Pose::IDENTITY);
    Geometry::build(&scene, 0.0, freq_hz).unwrap()
}

/// S[rx][tx] of the fringe currents.
fn fringe(faces: &[Vec<DVec3>], edges: usize, cut: &Cut) -> Vec<[[Complex64; 2]; 2]> {
    let g = geometry(faces, cut.freq_hz);
    let found = find(&g, SMOOTH_RAD);
    assert_eq!(found.len(), edges);
    let options = RcsOptions { bounces: 1, rays_per_wavelength: 1.0, distance: Distance::Infinite };
    ptd::sweep(&g, &found, &cut.aspects(), &options).iter().map(|s| s.every).collect()
}

/// Physical optics of a plane convex face by its outline (W. B. Gordon, IEEE Trans. Antennas Propag.
/// AP-23, 590–592, 1975): S = −(jk/2π)(n·u) ∫ e^{2jk u·r} dA.
fn po_face(face: &[DVec3], freq_hz: f64, u: DVec3) -> Complex64 {
    let n = (face[1] - face[0]).cross(face[2] - face[0]).normalize();
    if n.dot(u) <= 0.0 {
        return Complex64::ZERO;
    }
    let k = wavenumber(freq_hz);
    let w = 2.0 * k * (u - n * n.dot(u));
    let ends = || face.iter().zip(face.iter().cycle().skip(1));
    let phase = Complex64::cis(2.0 * k * u.dot(n) * n.dot(face[0]));
    let integral = if w.length() < 1e-6 * k {
        let twice: f64 = ends().map(|(a, b)| a.cross(*b).dot(n)).sum();
        Complex64::new(0.5 * twice, 0.0)
    } else {
        let sum: Complex64 = ends()
            .map(|(a, b)| {
                let half = 0.5 * w.dot(b - a);
                let sinc = if half.abs() < 1e-8 { 1.0 } else { half.sin() / half };
                Complex64::cis(0.5 * w.dot(a + b)) * (sinc * n.cross(w).dot(b - a))
            })
            .sum();
        // ∮ of e^{jw·r} n × w / (j|w|²) · dr with the outline counter-clockwise.
        sum * Complex64::new(0.0, -1.0) / w.length_squared()
    };
    Complex64::new(0.0, -k / (2.0 * std::f64::consts::PI)) * n.dot(u) * phase * integral
}

/// The plate of set II.A, 6 in by 10.5 in, standing across x with its long side level.
fn standing_plate() -> (f64, f64, Vec<DVec3>) {
    let (w, h) = (10.5 * INCH, 6.0 * INCH);
    let v = |y: f64, z: f64| DVec3::new(0.0, 0.5 * y * w, 0.5 * z * h);
    (w, h, vec![v(-1., -1.), v(1., -1.), v(1., 1.), v(-1., 1.)])
}

#[test]
fn outline_integral_is_the_plate_formula() {
    let (w, h, face) = standing_plate();
    for (a, e) in [(0.0, 0.0), (0.3, 0.0), (0.0, 0.2), (1.2, -0.4)] {
        let u = direction_from_angles(a, e);
        let (s, t) = (po_face(&face, 7e9, u), po_plate(w, h, 7e9, u));
        assert!((s - t).norm() < 1e-9, "{s} {t}");
    }
}

#[test]
fn plates_with_and_without_edges() {
    let (w, h, face) = standing_plate();
    for (name, freq_hz) in FREQUENCIES {
        for (p, pol) in ["V", "H"].iter().enumerate() {
            let cut = cut(&format!("ref_rcs.II.A.sx1.{name}.{pol}.txt"));
            assert_eq!(cut.freq_hz, freq_hz);
            let po: Vec<Complex64> = cut.directions().iter().map(|u| po_plate(w, h, freq_hz, *u)).collect();
            let f = fringe(std::slice::from_ref(&face), 4, &cut);
            let with: Vec<Complex64> = po.iter().zip(&f).map(|(s, f)| s + f[p][p]).collect();
            let less: Vec<Complex64> = po.iter().zip(&f).map(|(s, f)| s - f[p][p]).collect();
            for (from, to) in
                [(0.0, 5.0), (5.0, 20.0), (20.0, 40.0), (40.0, 60.0), (60.0, 80.0), (80.0, 91.0)]
            {
                let peaks = cut.peaks(from, to);
                let (a, b, c) =
                    (cut.compare(&po, &peaks), cut.compare(&with, &peaks), cut.compare(&less, &peaks));
                println!(
                    "{name} {pol} {from:2}-{to:2}: {} peaks, PO {:.2} rms {:.2}, with edges {:.2} rms {:.2}, wrong sign {:.2} rms {:.2}",
                    peaks.len(),
                    a.0,
                    a.1,
                    b.0,
                    b.1,
                    c.0,
                    c.1
                );
            }
        }
    }
    let (w, h) = (7.0 * INCH, 4.0 * INCH);
    let v = |x: f64, y: f64| DVec3::new(0.5 * x * w, 0.5 * y * h, 0.0);
    let face = vec![v(-1., -1.), v(1., -1.), v(1., 1.), v(-1., 1.)];
    for (p, pol) in ["V", "H"].iter().enumerate() {
        let cut = cut(&format!("ref_rcs.II.A.s1.f10.{pol}.txt"));
        let po: Vec<Complex64> = cut.directions().iter().map(|u| po_face(&face, cut.freq_hz, *u)).collect();
        let f = fringe(std::slice::from_ref(&face), 4, &cut);
        for i in (0..181).step_by(6) {
            println!(
                "{pol} {} ref {:.2} po {:.2} ptd {:.2}",
                cut.azimuth_deg[i],
                cut.reference_dbsm[i],
                dbsm_from_amplitude(po[i].norm()),
                dbsm_from_amplitude((po[i] + f[i][p][p]).norm())
            );
        }
    }
}

/// The camera box of set III.S.A.
fn camera_box() -> Vec<Vec<DVec3>> {
    let l = 0.4;
    let outline = [(-0.5, -0.4), (0.23, -0.4), (0.5, -0.13), (0.5, 0.13), (0.23, 0.4), (-0.5, 0.4)];
    let v = |i: usize, y: f64| DVec3::new(outline[i % 6].0 * l, y * 0.1625 * l, outline[i % 6].1 * l);
    let mut faces: Vec<Vec<DVec3>> =
        (0..6).map(|i| vec![v(i, -1.0), v(i, 1.0), v(i + 1, 1.0), v(i + 1, -1.0)]).collect();
    faces.push((0..6).map(|i| v(i, -1.0)).collect());
    faces.push((0..6).rev().map(|i| v(i, 1.0)).collect());
    let centre = DVec3::ZERO;
    for f in &mut faces {
        let n = (f[1] - f[0]).cross(f[2] - f[0]);
        if n.dot(f[0] - centre) < 0.0 {
            f.reverse();
        }
    }
    faces
}

#[test]
fn box_of_flat_faces() {
    let faces = camera_box();
    for (name, freq_hz) in FREQUENCIES {
        for (p, pol) in ["V", "H"].iter().enumerate() {
            let cut = cut(&format!("ref_rcs.IIIS.A.s1.{name}.{pol}.txt"));
            let po: Vec<Complex64> = cut
                .directions()
                .iter()
                .map(|u| faces.iter().map(|f| po_face(f, freq_hz, *u)).sum())
                .collect();
            let f = fringe(&faces, 18, &cut);
            let with: Vec<Complex64> = po.iter().zip(&f).map(|(s, f)| s + f[p][p]).collect();
            let highest = cut.reference_dbsm.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            for down in [20.0, 30.0, 40.0, 100.0] {
                let peaks: Vec<usize> = cut
                    .peaks(0.0, 181.0)
                    .into_iter()
                    .filter(|&i| cut.reference_dbsm[i] > highest - down)
                    .collect();
                let (a, b) = (cut.compare(&po, &peaks), cut.compare(&with, &peaks));
                println!(
                    "{name} {pol} -{down}: {} peaks, PO {:.2} rms {:.2}, with edges {:.2} rms {:.2}",
                    peaks.len(),
                    a.0,
                    a.1,
                    b.0,
                    b.1
                );
                if down < 30.0 {
                    for &i in &peaks {
                        println!(
                            "   {} ref {:.2} po {:.2} ptd {:.2}",
                            cut.azimuth_deg[i],
                            cut.reference_dbsm[i],
                            dbsm_from_amplitude(po[i].norm()),
                            dbsm_from_amplitude(with[i].norm())
                        );
                    }
                }
            }
        }
    }
}
