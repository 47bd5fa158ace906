//! Exact beams on the cpu engine: closed forms, the grid of rays as an independent check, invariances.

use catseye::base::frames::Pose;
use catseye::base::matrix::Matrix2;
use catseye::base::units::{dbsm_from_amplitude, wavenumber};
use catseye::geom::Geometry;
use catseye::rcs::closed_form::po_plate;
use catseye::rcs::cpu::beam_sum::{FrequencyPoint, by_beams};
use catseye::rcs::cpu::po_sum;
use catseye::rcs::{Aspect, BistaticAspect, Distance, RayGrid, Scattering};
use catseye::road::reflector::Reflector;
use catseye::scene::{Material, Mesh, Scene, material};
use catseye::trace::beams::BeamOptions;
use glam::DVec3;
use num_complex::Complex64;

const F: f64 = 77e9;

fn geometry(spec: &str) -> Geometry {
    let scene = Reflector::parse(spec).unwrap().to_scene(&material::by_name).unwrap();
    Geometry::build(&scene, 0.0, F).unwrap()
}

fn of_mesh(mesh: Mesh) -> Geometry {
    let mut scene = Scene::default();
    scene.materials.push(Material::pec());
    scene.add_mesh("m", "", mesh, Pose::IDENTITY);
    Geometry::build(&scene, 0.0, F).unwrap()
}

fn beams(g: &Geometry, looks: &[BistaticAspect], distance: Distance, accuracy_db: f64) -> Vec<Scattering> {
    let options = BeamOptions::new(3, accuracy_db, true);
    let tone = FrequencyPoint { wavenumber: wavenumber(g.freq_hz), surfaces: &g.surfaces };
    by_beams(g, &[tone], looks, distance, &options).unwrap().into_iter().map(|s| s[0]).collect()
}

fn aspect(azimuth_deg: f64, elevation_deg: f64) -> Aspect {
    Aspect { azimuth: azimuth_deg.to_radians(), elevation: elevation_deg.to_radians() }
}

fn looks(list: &[(f64, f64)]) -> Vec<BistaticAspect> {
    list.iter().map(|(a, e)| BistaticAspect::monostatic(aspect(*a, *e))).collect()
}

fn db(z: Complex64) -> f64 {
    dbsm_from_amplitude(z.norm())
}

/// Root of the summed squared differences over that of the reference.
fn relative(a: &[Scattering], b: &[Scattering]) -> f64 {
    let all = |s: &Scattering| s.every.into_iter().chain(s.last).flatten().collect::<Vec<_>>();
    let (mut difference, mut size) = (0.0, 0.0);
    for (x, y) in a.iter().zip(b) {
        for (p, q) in all(x).into_iter().zip(all(y)) {
            difference += (p - q).norm_sqr();
            size += q.norm_sqr();
        }
    }
    (difference / size).sqrt()
}

#[test]
fn canonical_corners() {
    let boresight = [(0.0, 35.264389682754654)];
    let face_on = [(0.0, 0.0)];
    let one = |spec: &str, at: &[(f64, f64)]| beams(&geometry(spec), &looks(at), Distance::Infinite, 0.1)[0];
    let t = one("trihedral:leg_m=0.1", &boresight);
    assert!((db(t.last[0][0]) - 14.414).abs() < 0.001 && (db(t.every[0][0]) - 14.532).abs() < 0.001);
    // Symmetry forbids cross-polarisation.
    assert!(db(t.every[0][1]) < db(t.every[0][0]) - 200.0);
    let s = one("square-trihedral:leg_m=0.1", &boresight);
    assert!((db(s.last[0][0]) - 23.957).abs() < 0.001);
    let small = one("trihedral:leg_m=0.008", &boresight);
    assert!((db(small.last[0][0]) + 29.46).abs() < 0.01 && (db(small.every[0][0]) + 30.46).abs() < 0.01);
    let d = one("dihedral:width_m=0.1,height_m=0.1", &face_on);
    assert!((db(d.last[0][0]) - 22.196).abs() < 0.001);
    assert!((db(d.every[0][0]) - 22.16).abs() < 0.005 && (db(d.every[1][1]) - 22.23).abs() < 0.005);
    // The double bounce turns the sign of one polarisation.
    assert!((d.last[0][0] + d.last[1][1]).norm() < 1e-6 * d.last[0][0].norm());
}

#[test]
fn a_dihedral_rolled_by_45_degrees_turns_the_polarisation() {
    let mut scene =
        Reflector::parse("dihedral:width_m=0.1,height_m=0.1").unwrap().to_scene(&material::by_name).unwrap();
    scene.objects[0].pose = Pose::from_yaw_pitch_roll(DVec3::ZERO, 0.0, 0.0, std::f64::consts::FRAC_PI_4);
    let g = Geometry::build(&scene, 0.0, F).unwrap();
    let s = beams(&g, &looks(&[(0.0, 0.0)]), Distance::Infinite, 0.1)[0];
    let down = |m: &Matrix2| db(m[0][0]).max(db(m[1][1])) - db(m[0][1]);
    println!("co-pol below cross-pol: last {:.1} dB, every {:.1} dB", down(&s.last), down(&s.every));
    assert!(down(&s.last) < -60.0 && down(&s.every) < -40.0);
}

#[test]
fn a_plate_follows_its_closed_form_to_rounding() {
    let g = geometry("plate:width_m=0.08,height_m=0.05");
    for i in 0..60 {
        let (a, e) = (1.45 * i as f64, 0.7 * i as f64 - 20.0);
        let s = beams(&g, &looks(&[(a, e)]), Distance::Infinite, 0.1)[0];
        let u = catseye::base::frames::direction_from_angles(a.to_radians(), e.to_radians());
        let want = po_plate(0.08, 0.05, F, u);
        for s in [s.every[0][0], s.every[1][1]] {
            assert!((s - want).norm() < 1e-9 * 0.05, "azimuth {a} elevation {e}: {s} against {want}");
        }
    }
}

/// Splitting faces changes nothing, however it is done.
#[test]
fn more_triangles_of_the_same_faces_give_the_same_answer() {
    let coarse = geometry("trihedral:leg_m=0.06");
    let mut fine = Mesh::default();
    for t in coarse.triangles.iter() {
        let [a, b, c] = t.corners();
        let n = 6u32;
        let first = fine.positions_m.len() as u32;
        let at = |i: u32, j: u32| first + (i * (2 * n + 3 - i)) / 2 + j;
        for i in 0..=n {
            for j in 0..=n - i {
                fine.positions_m.push(a + (b - a) * (i as f64 / n as f64) + (c - a) * (j as f64 / n as f64));
            }
        }
        for i in 0..n {
            for j in 0..n - i {
                fine.triangles.push([at(i, j), at(i + 1, j), at(i, j + 1)]);
                fine.material.push(0);
                if i + j + 2 <= n {
                    fine.triangles.push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
                    fine.material.push(0);
                }
            }
        }
    }
    let fine = of_mesh(fine);
    assert_eq!((fine.triangles.len(), fine.faces().faces.len()), (108, 3));
    let at = looks(&[(0.0, 35.0), (13.0, 20.0), (-30.0, 50.0), (44.0, 3.0), (170.0, -20.0)]);
    for distance in [Distance::Infinite, Distance::At(2.0)] {
        let r = relative(&beams(&fine, &at, distance, 0.1), &beams(&coarse, &at, distance, 0.1));
        println!("{distance:?}: {r:e}");
        assert!(r < 1e-6);
    }
}

/// Boxes before each other, sheets that pierce each other, a faceted car: a dense grid of rays, which
/// shares nothing with the clipping, agrees.
#[test]
fn occlusion_against_rays() {
    let cuboid = |m: &mut Mesh, lo: DVec3, hi: DVec3| {
        let first = m.positions_m.len() as u32;
        for i in 0..8u32 {
            let pick = |bit: u32, l: f64, h: f64| if i >> bit & 1 == 1 { h } else { l };
            m.positions_m.push(DVec3::new(pick(0, lo.x, hi.x), pick(1, lo.y, hi.y), pick(2, lo.z, hi.z)));
        }
        for q in [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]] {
            let q: [u32; 4] = q.map(|i: u32| i + first);
            m.triangles.extend([[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
            m.material.extend([0, 0]);
        }
    };
    let p = DVec3::new;
    let mut boxes = Mesh::default();
    cuboid(&mut boxes, p(0.0, -0.03, -0.02), p(0.02, 0.03, 0.02));
    cuboid(&mut boxes, p(0.035, -0.01, -0.03), p(0.05, 0.02, 0.0));
    // A plate behind, and on it the shadows of both.
    cuboid(&mut boxes, p(-0.03, -0.05, -0.04), p(-0.02, 0.05, 0.05));

    let mut pierced = Mesh::default();
    let sheet = |m: &mut Mesh, c: DVec3, a: DVec3, b: DVec3| {
        let first = m.positions_m.len() as u32;
        m.positions_m.extend([c - a - b, c + a - b, c + a + b, c - a + b]);
        m.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        m.material.extend([0, 0]);
    };
    sheet(&mut pierced, DVec3::ZERO, p(0.01, 0.03, 0.0), p(0.0, 0.005, 0.025));
    sheet(&mut pierced, p(0.004, 0.003, 0.002), p(-0.012, 0.025, 0.004), p(0.003, -0.004, 0.03));

    let mut car = Mesh::default();
    cuboid(&mut car, p(-0.06, -0.025, 0.005), p(0.06, 0.025, 0.022));
    cuboid(&mut car, p(-0.04, -0.022, 0.022), p(0.02, 0.022, 0.037));
    for (x, y) in [(-0.04, -0.026), (0.04, -0.026), (-0.04, 0.020), (0.04, 0.020)] {
        cuboid(&mut car, p(x - 0.008, y, 0.0), p(x + 0.008, y + 0.006, 0.016));
    }
    sheet(&mut car, p(0.0, 0.0, 0.0), p(0.08, 0.0, 0.0), p(0.0, 0.05, 0.0));

    let at = [(0.0, 0.0), (5.0, 3.0), (33.0, 12.0), (-50.0, 25.0), (120.0, 8.0)];
    for (name, mesh, bar) in [("boxes", boxes, 0.02), ("pierced sheets", pierced, 0.02), ("car", car, 0.03)] {
        let g = of_mesh(mesh);
        let (mut exact, mut rays) = (Vec::new(), Vec::new());
        for l in looks(&at) {
            exact.extend(beams(&g, &[l], Distance::Infinite, 0.1));
            let grid = RayGrid { bounces: 3, rays_per_wavelength: 48.0, distance: Distance::Infinite };
            rays.extend(po_sum::by_rays(&g, &[l.transmit], &grid));
        }
        let r = relative(&rays, &exact);
        println!("{name}: rays at 48 per wavelength differ by {r:.2e}");
        assert!(r < bar, "{name}: {r}");
    }
}

/// From a point, beams and rays have different approximations of the curved phase.
#[test]
fn finite_range_against_rays_and_against_stricter_runs() {
    for (spec, at) in [
        ("trihedral:leg_m=0.1", [(0.0, 35.0), (10.0, 25.0), (-20.0, 40.0)]),
        ("dihedral:width_m=0.08,height_m=0.08", [(0.0, 0.0), (7.0, 4.0), (-3.0, 12.0)]),
        ("type1:width_m=0.16,height_m=0.01", [(0.0, 3.0), (12.0, 2.0), (25.0, 5.0)]),
    ] {
        let g = geometry(spec);
        for r0 in [1.0, 3.0] {
            let found = beams(&g, &looks(&at), Distance::At(r0), 0.1);
            let strict = beams(&g, &looks(&at), Distance::At(r0), 0.1 / 256.0);
            let aspects: Vec<Aspect> = looks(&at).iter().map(|l| l.transmit).collect();
            let grid = RayGrid { bounces: 3, rays_per_wavelength: 30.0, distance: Distance::At(r0) };
            let rays = po_sum::by_rays(&g, &aspects, &grid);
            let (own, other) = (relative(&found, &strict), relative(&rays, &strict));
            println!("{spec} at {r0} m: 0.1 dB run {own:.2e}, rays {other:.2e}");
            // 0.1 dB is 1.2 % of the amplitude.
            assert!(own < 0.012 && other < 0.02, "{spec} at {r0} m: {own} {other}");
        }
    }
}

#[test]
fn far_is_the_limit_of_near() {
    let g = geometry("trihedral:leg_m=0.05");
    let at = looks(&[(0.0, 35.0), (15.0, 20.0)]);
    let far = beams(&g, &at, Distance::Infinite, 0.1);
    let errors: Vec<f64> =
        [100.0, 1000.0].map(|r| relative(&beams(&g, &at, Distance::At(r), 0.01), &far)).to_vec();
    // First order in 1/r.
    assert!(errors[1] < 0.002 && errors[1] < 0.2 * errors[0], "{errors:?}");
}

/// Bistatic looks: a monostatic one is their special case, and a plate's currents follow the mirror law.
#[test]
fn bistatic() {
    let g = geometry("plate:width_m=0.06,height_m=0.06");
    let t = aspect(20.0, 0.0);
    let to = |az: f64| BistaticAspect { transmit: t, receive: aspect(az, 0.0) };
    let levels: Vec<f64> =
        (-60..=60).map(|a| db(beams(&g, &[to(a as f64)], Distance::Infinite, 0.1)[0].every[0][0])).collect();
    let best = levels.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).unwrap();
    assert_eq!(best.0 as i32 - 60, -20);
    // Towards the mirror direction |S| = k A cos / 2 pi.
    let area = 0.06 * 0.06 * 20f64.to_radians().cos();
    assert!((best.1 - dbsm_from_amplitude(wavenumber(F) * area / std::f64::consts::TAU)).abs() < 1e-9);

    // Almost monostatic is almost monostatic, with shadows and bounces.
    let g = geometry("trihedral:leg_m=0.05");
    for (a, e) in [(0.0, 35.0), (20.0, 10.0)] {
        let near = BistaticAspect { transmit: aspect(a, e), receive: aspect(a + 1e-7, e) };
        let s = beams(&g, &[near], Distance::Infinite, 0.1);
        let m = beams(&g, &looks(&[(a, e)]), Distance::Infinite, 0.1);
        assert!(relative(&s, &m) < 1e-6);
    }
}

/// The clipping is shared by the tones of a sweep; each must be what it is alone.
#[test]
fn tones_of_one_sweep_are_those_of_single_runs() {
    let scene = Reflector::parse("type1").unwrap().to_scene(&material::by_name).unwrap();
    let g = Geometry::build(&scene, 0.0, 81e9).unwrap();
    let k = [76e9, 77e9, 81e9].map(wavenumber);
    let tones = k.map(|wavenumber| FrequencyPoint { wavenumber, surfaces: &g.surfaces });
    let options = BeamOptions::new(3, 0.1, true);
    let at = looks(&[(0.0, 1.0), (11.0, 2.0)]);
    let all = by_beams(&g, &tones, &at, Distance::Infinite, &options).unwrap();
    for (i, k) in k.into_iter().enumerate() {
        let alone = by_beams(
            &g,
            &[FrequencyPoint { wavenumber: k, surfaces: &g.surfaces }],
            &at,
            Distance::Infinite,
            &options,
        )
        .unwrap();
        for look in 0..2 {
            assert_eq!(all[look][i], alone[look][0]);
        }
    }
    assert_ne!(all[0][0], all[0][1]);
}

/// A slab-backed dielectric and a lossy conductor take their coefficients along every bounce.
#[test]
fn a_lossy_corner_loses_three_reflections() {
    let level = |spec: &str| {
        let g = geometry(spec);
        beams(&g, &looks(&[(0.0, 35.264389682754654)]), Distance::Infinite, 0.1)[0].last[0][0].norm()
    };
    let ratio = level("trihedral:leg_m=0.1,material=glass") / level("trihedral:leg_m=0.1");
    // Three reflections at 54.7 deg from glass of 6.31: between the cubes of |R_par| and |R_perp|.
    let m = material::by_name("glass").unwrap();
    let cos_i: f64 = (1.0f64 / 3.0).sqrt();
    let surface = catseye::geom::Surface::of(&m, F).unwrap();
    let (perp, par) = surface.reflection(wavenumber(F), cos_i);
    let (hi, lo) = (perp.norm().max(par.norm()).powi(3), perp.norm().min(par.norm()).powi(3));
    println!("{lo} < {ratio} < {hi}");
    assert!(lo < ratio && ratio < hi);
}
