//! W6: closest hits on a terrain of a million triangles, compared with f64.

use super::sheet::{Outcome, RUNS, Settings, Sheet, Stage, median};
use catseye::base::error::Result;
use catseye::base::frames::Pose;
use catseye::base::rng::philox4x32_10;
use catseye::base::units::DEFAULT_FREQUENCY_HZ;
use catseye::engine::Engine;
use catseye::geom::Geometry;
use catseye::geom::upload::GeometryArrays;
use catseye::road::terrain::{W6_CELL_M, W6_QUADS, W6_RELIEF_M, w6 as terrain};
use catseye::scene::{Scene, material};
use catseye::trace::closest::{self, Find, Hit, NO_PATCH, NO_TRIANGLE, Ray, Tree};
use catseye_io::usage::cpu_seconds;
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::time::Instant;

/// Number of pixels of the coherent rays.
pub const SCREEN: [usize; 2] = [1920, 1080];
const SCREEN_QUICK: [usize; 2] = [480, 270];
/// Step in rays at which one is checked in f64: a prime.
const SAMPLE: usize = 97;
/// Largest relative difference of a distance that counts as right.
const TOLERANCE: f64 = 1e-4;

/// Builds the terrain with its acceleration tree.
///
/// # Errors
/// Returns an error if the material or the geometry cannot be made.
pub fn geometry() -> Result<Geometry> {
    let mut scene = Scene::default();
    let asphalt = scene.material_index(&material::by_name("asphalt")?);
    scene.add_mesh("terrain", "", terrain(asphalt), Pose::IDENTITY);
    Geometry::build(&scene, 0.0, DEFAULT_FREQUENCY_HZ)
}

fn ray(geometry: &Geometry, origin: DVec3, dir: DVec3) -> Ray {
    Ray {
        origin: origin.as_vec3().to_array(),
        t_min: geometry.t_min_m as f32,
        dir: dir.as_vec3().to_array(),
        t_max: 1e4,
    }
}

/// One ray for each pixel, row by row, of a camera that looks over the terrain and slightly down.
pub fn coherent(geometry: &Geometry, screen: [usize; 2]) -> Vec<Ray> {
    let half = 0.5 * f64::from(W6_QUADS) * W6_CELL_M;
    let eye = DVec3::new(-half, 0.0, 5.0 * W6_RELIEF_M);
    (0..screen[0] * screen[1])
        .into_par_iter()
        .map(|i| {
            let x = ((i % screen[0]) as f64 + 0.5) / screen[0] as f64 - 0.5;
            let y =
                ((i / screen[0]) as f64 + 0.5) / screen[0] as f64 - 0.5 * screen[1] as f64 / screen[0] as f64;
            ray(geometry, eye, DVec3::new(1.0, -1.2 * x, -0.25 - 1.2 * y).normalize())
        })
        .collect()
}

/// Rays from random places above the terrain in random directions.
pub fn random(geometry: &Geometry, count: usize, seed: u64) -> Vec<Ray> {
    let half = 0.5 * f64::from(W6_QUADS) * W6_CELL_M;
    (0..count)
        .into_par_iter()
        .map(|i| {
            let draw = |stream: u32| {
                let words = philox4x32_10([i as u32, 0, stream, 6], [seed as u32, (seed >> 32) as u32]);
                words.map(|w| (f64::from(w) + 0.5) / 4_294_967_296.0)
            };
            let ([x, y, z, _], [a, s, ..]) = (draw(0), draw(1));
            let origin =
                DVec3::new((2.0 * x - 1.0) * half, (2.0 * y - 1.0) * half, (1.0 + 3.0 * z) * W6_RELIEF_M);
            let (sin_a, cos_a) = (TAU * a).sin_cos();
            let up = 2.0 * s - 1.0;
            let flat = (1.0 - up * up).sqrt();
            ray(geometry, origin, DVec3::new(flat * cos_a, flat * sin_a, up))
        })
        .collect()
}

/// The terrain uploaded to where an engine can cast rays at it.
pub struct Caster<'a> {
    engine: &'a Engine,
    geometry: &'a Geometry,
    arrays: GeometryArrays,
    tree: Option<Tree>,
}

impl<'a> Caster<'a> {
    /// Uploads the terrain to an engine.
    ///
    /// # Errors
    /// Returns an error if the GPU cannot hold the terrain.
    pub fn new(engine: &'a Engine, geometry: &'a Geometry) -> Result<Caster<'a>> {
        let arrays = GeometryArrays::new(geometry)?;
        let tree = match engine {
            Engine::Cpu(_) => None,
            Engine::Gpu(gpu) => {
                let mut recorder = gpu.recorder("terrain");
                let tree = Tree {
                    nodes: recorder.upload("nodes", &arrays.nodes),
                    triangles: recorder.upload("triangles", &arrays.triangles),
                };
                recorder.submit()?;
                Some(tree)
            }
        };
        Ok(Caster { engine, geometry, arrays, tree })
    }

    /// Casts rays; returns the hits and the time they took, s, without the upload of the rays.
    ///
    /// # Errors
    /// Returns the errors of the engine.
    pub fn cast(&self, rays: &[Ray]) -> Result<(Vec<Hit>, f64)> {
        let skip = vec![NO_PATCH; rays.len()];
        if let (Engine::Gpu(gpu), Some(tree)) = (self.engine, &self.tree) {
            return closest::hits(gpu, tree, Find::Closest, rays, &skip);
        }
        let (tree, triangles) = (&self.geometry.bvh.cwbvh, &self.arrays.triangles);
        let start = Instant::now();
        let hits = catseye::trace::cpu::closest::hits(tree, triangles, Find::Closest, rays, &skip);
        Ok((hits, start.elapsed().as_secs_f64()))
    }
}

pub(super) fn w6(engine: &Engine, settings: &Settings, mut sheet: Sheet<'_>) -> Result<Outcome> {
    let geometry = sheet.part("geometry", geometry)?;
    let caster = sheet.part("upload", || Caster::new(engine, &geometry))?;
    let screen = if settings.quick { SCREEN_QUICK } else { SCREEN };
    let count = screen[0] * screen[1];
    sheet.count("triangles", geometry.triangles.len());
    sheet.count("rays_each", count);
    for (name, rays) in
        [("coherent", coherent(&geometry, screen)), ("random", random(&geometry, count, settings.seed))]
    {
        let (hits, _) = caster.cast(&rays)?;
        let (mut seconds, mut cores) = (Vec::new(), Vec::new());
        let mut profile = None;
        for _ in 0..RUNS {
            profile = sheet.profile();
            let before = cpu_seconds();
            seconds.push(caster.cast(&rays)?.1);
            cores.extend(cpu_seconds().zip(before).map(|(after, before)| after - before));
        }
        sheet.add_kernels(profile);
        let core_seconds = (cores.len() == RUNS).then(|| median(&mut cores));
        let stage = Stage {
            name,
            seconds: median(&mut seconds),
            core_seconds,
            runs: RUNS,
            tasks: None,
            device: None,
        };
        sheet.count(&format!("{name}_mrays_per_s"), 1e-6 * count as f64 / stage.seconds);
        sheet.count(&format!("{name}_hits"), hits.iter().filter(|h| h.triangle != NO_TRIANGLE).count());
        sheet.add(stage);
        let check = check(&geometry, &rays, &hits);
        sheet.accuracy(&format!("{name}_sample"), check.sample);
        sheet.accuracy(&format!("{name}_other_triangle"), check.other_triangle);
        sheet.accuracy(&format!("{name}_wrong"), check.wrong);
        sheet.accuracy(&format!("{name}_worst_relative_distance"), check.worst);
    }
    sheet.note(format!(
        "every {SAMPLE}th ray again in f64; another triangle at the same distance is one across a shared edge; wrong \
         are hits for misses, misses for hits and distances that differ by more than {TOLERANCE:e} of themselves. \
         geometry builds mesh, patches and tree; neither it nor the upload is in the total"
    ));
    Ok(sheet.finish())
}

#[derive(Debug, Default, PartialEq)]
struct Check {
    sample: usize,
    other_triangle: usize,
    wrong: usize,
    /// Worst relative error of the hits that are not wrong.
    worst: f64,
}

fn check(geometry: &Geometry, rays: &[Ray], hits: &[Hit]) -> Check {
    let mut found = Check::default();
    for (ray, hit) in rays.iter().zip(hits).step_by(SAMPLE) {
        found.sample += 1;
        let wide = |a: [f32; 3]| DVec3::from_array(a.map(f64::from));
        let (origin, dir) = (wide(ray.origin), wide(ray.dir));
        let length = dir.length();
        let truth =
            geometry.bvh.closest_hit(&geometry.triangles, origin, dir / length, NO_PATCH, f64::INFINITY);
        match (truth, hit.triangle) {
            (None, NO_TRIANGLE) => {}
            (Some(t), triangle) if triangle != NO_TRIANGLE => {
                let error = (f64::from(hit.t) * length / t.t - 1.0).abs();
                if error > TOLERANCE {
                    found.wrong += 1;
                } else {
                    found.worst = found.worst.max(error);
                    found.other_triangle += usize::from(triangle != t.triangle);
                }
            }
            _ => found.wrong += 1,
        }
    }
    found
}
