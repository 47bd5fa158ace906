//! Times of exact beams on the cpu engine, one thread:
//! `cargo test --release -p catseye-papers --test gates beam_times -- --ignored --nocapture --test-threads 1`.

use catseye::base::frames::Pose;
use catseye::base::units::wavenumber;
use catseye::engine::{Engine, Precision};
use catseye::geom::Geometry;
use catseye::geom::curved::{refined_scene, sagitta_m};
use catseye::rcs::cpu::beam_sum::{FrequencyPoint, by_beams};
use catseye::rcs::{Aspect, BistaticAspect, Distance, Scattering};
use catseye::scene::{Material, Mesh, Scene};
use catseye::trace::beams::BeamOptions;
use catseye_papers::bench::cross_section;
use glam::DVec3;
use std::f64::consts::{PI, TAU};
use std::time::Instant;

const F: f64 = 77e9;

fn one_thread<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(work)
}

/// What `work` gives on one thread, and its seconds on the core, which others may share (elsewhere than on
/// Linux those of the clock).
fn timed<T: Send>(work: impl FnOnce() -> T + Send) -> (T, f64) {
    let on_core = || {
        let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
        Some(text.split(' ').next()?.parse::<f64>().ok()? * 1e-9)
    };
    one_thread(|| {
        let (clock, core) = (Instant::now(), on_core());
        let out = work();
        let spent = on_core().zip(core).map_or(clock.elapsed().as_secs_f64(), |(a, b)| a - b);
        (out, spent)
    })
}

/// What changes when an answer does, to compare versions by.
fn digest(all: &[Vec<Scattering>]) -> [f64; 3] {
    let s: Vec<_> = all.iter().flatten().flat_map(|s| s.every.into_iter().flatten()).collect();
    let weighted = s.iter().enumerate().map(|(i, z)| z * ((i % 97) as f64 + 1.0));
    let sum: num_complex::Complex64 = weighted.sum();
    [s.iter().map(|z| z.norm()).sum(), sum.re, sum.im]
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// A body of facets round `centre`: half axes `half`, squarer the larger `power`, in `rows` by `columns`.
fn superellipsoid(mesh: &mut Mesh, centre: DVec3, half: DVec3, power: f64, rows: u32, columns: u32) {
    let first = mesh.positions_m.len() as u32;
    let bent = |x: f64| x.signum() * x.abs().powf(2.0 / power);
    for i in 0..=rows {
        let (sin, cos) = (PI * (f64::from(i) / f64::from(rows) - 0.5)).sin_cos();
        // The tips are one place to the bit.
        let ring = if i == 0 || i == rows { 0.0 } else { bent(cos) };
        for j in 0..columns {
            let (s, c) = (TAU * f64::from(j) / f64::from(columns)).sin_cos();
            mesh.positions_m.push(centre + half * DVec3::new(ring * bent(c), ring * bent(s), bent(sin)));
        }
    }
    let at = |i: u32, j: u32| first + i * columns + j % columns;
    for i in 0..rows {
        for j in 0..columns {
            let (a, b, c, d) = (at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j));
            // Rings of no size are tips.
            if i > 0 {
                mesh.triangles.push([a, b, c]);
            }
            if i + 1 < rows {
                mesh.triangles.push([a, c, d]);
            }
        }
    }
    mesh.material.resize(mesh.triangles.len(), 0);
}

/// A body of the size and shape of a car: hull, cabin that pierces it, four wheels.
fn car() -> Scene {
    let mut m = Mesh::default();
    let p = DVec3::new;
    superellipsoid(&mut m, p(0.0, 0.0, 0.55), p(2.25, 0.9, 0.35), 5.0, 110, 350);
    superellipsoid(&mut m, p(-0.2, 0.0, 0.95), p(1.3, 0.75, 0.5), 4.0, 60, 140);
    for (x, y) in [(1.4, 0.8), (1.4, -0.8), (-1.4, 0.8), (-1.4, -0.8)] {
        superellipsoid(&mut m, p(x, y, 0.32), p(0.32, 0.12, 0.32), 3.0, 40, 50);
    }
    let mut scene = Scene { materials: vec![Material::pec()], ..Scene::default() };
    scene.add_mesh("car", "car", m, Pose::IDENTITY);
    scene
}

#[test]
#[ignore = "prints times, judges nothing"]
fn w1_and_w2() {
    for sweep_of in [cross_section::trihedral(false), cross_section::type1(false)] {
        let geometry = Geometry::build(&sweep_of.scene().unwrap(), 0.0, F).unwrap();
        let looks = sweep_of.looks();
        let tones = [FrequencyPoint { wavenumber: wavenumber(F), surfaces: &geometry.surfaces }];
        for last in [false, true] {
            let options = BeamOptions::new(3, 0.1, last);
            let mut found = Vec::new();
            let times = (0..7)
                .map(|_| {
                    let (s, t) =
                        timed(|| by_beams(&geometry, &tones, &looks, Distance::Infinite, &options).unwrap());
                    found = s;
                    t
                })
                .collect();
            println!(
                "{}, {} directions, last {last}: {:.4} core-s; {:.15?}",
                sweep_of.spec,
                looks.len(),
                median(times),
                digest(&found)
            );
        }
    }
}

#[test]
#[ignore = "prints times, judges nothing"]
fn a_car_of_a_hundred_thousand_triangles() {
    let scene = car();
    let (geometry, built) = timed(|| Geometry::build(&scene, 0.0, F).unwrap());
    let (faces, prepared) = timed(|| geometry.faces().faces.len());
    println!(
        "car of {} triangles, {faces} faces: geometry {built:.3}, faces {prepared:.3} core-s",
        scene.triangle_count()
    );
    let tones = [FrequencyPoint { wavenumber: wavenumber(F), surfaces: &geometry.surfaces }];
    for (distance, last) in
        [(Distance::Infinite, false), (Distance::Infinite, true), (Distance::At(20.0), false)]
    {
        let options = BeamOptions::new(3, 0.1, last);
        let (mut found, mut times) = (Vec::new(), Vec::new());
        for (azimuth, elevation) in [(0.0, 2.0), (30.0, 0.0), (90.0, 5.0), (135.0, 30.0), (180.0, 1.0)] {
            let aspect = Aspect { azimuth: f64::to_radians(azimuth), elevation: f64::to_radians(elevation) };
            let look = [BistaticAspect::monostatic(aspect)];
            let (s, t) = timed(|| by_beams(&geometry, &tones, &look, distance, &options).unwrap());
            found.extend(s);
            times.push(t);
        }
        println!(
            "  {distance:?} last {last}: {times:.3?} core-s a direction, median {:.3}; {:.15?}",
            median(times.clone()),
            digest(&found)
        );
    }
}

#[test]
#[ignore = "prints times, judges nothing"]
fn refinement_and_repeated_calls() {
    let spec = "sphere:radius_m=0.05,sagitta_m=0.0005";
    let scene = catseye::road::reflector::Reflector::parse(spec)
        .unwrap()
        .to_scene(&catseye::scene::material::by_name)
        .unwrap();
    let (fine, cut) = timed(|| refined_scene(&scene, sagitta_m(0.1, wavenumber(F))).unwrap().into_owned());
    println!("{spec}: {} triangles to {} in {cut:.3} core-s", scene.triangle_count(), fine.triangle_count());
    let (_, prepared) = timed(|| Geometry::build(&fine, 0.0, F).unwrap().faces().faces.len());
    println!("geometry and faces: {prepared:.3} core-s");
    let engine = Engine::open("cpu", Precision::F64).unwrap();
    let options = cross_section::ReflectorSweep::options();
    let look = [BistaticAspect::monostatic(Aspect { azimuth: 0.3, elevation: 0.2 })];
    let times: Vec<f64> =
        (0..5).map(|_| timed(|| engine.rcs(&scene, &[F], &look, &options).unwrap()).1).collect();
    println!("one look by Engine::rcs: {times:.3?} core-s");
}
