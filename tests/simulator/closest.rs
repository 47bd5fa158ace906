//! Closest hits of both engines against every triangle in f64, and against each other.

use catseye::base::rng::philox4x32_10;
use catseye::gpu::Gpu;
use catseye::gpu::compare::{opened_for_tests, test_gpu};
use catseye::trace::closest::{self as gpu, Find, Hit, NO_PATCH, NO_TRIANGLE, Ray, Tree};
use catseye::trace::cpu::closest as cpu;
use glam::{DVec3, Vec3, Vec3A};
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh};
use obvhs::{Boundable, BvhBuildParams, aabb::Aabb};
use proptest::prelude::*;
use std::time::{Duration, Instant};

struct Mesh {
    tree: CwBvh,
    /// In the order of the leaves.
    rows: Vec<[f32; 4]>,
}

struct Boxed(Aabb);

impl Boundable for Boxed {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

/// Of the boxes: above the rounding of f32 as seen from 500 m, which obvhs' node test needs and the shader
/// does not.
const PADDED: f32 = 4e-7;
const TIGHT: f32 = 0.0;

impl Mesh {
    fn new(triangles: &[([Vec3; 3], u32)], padding: f32) -> Mesh {
        let boxes: Vec<Boxed> = triangles
            .iter()
            .map(|(v, _)| {
                let (lo, hi) = (v[0].min(v[1]).min(v[2]), v[0].max(v[1]).max(v[2]));
                let pad = Vec3A::splat(padding * (hi.abs().max(lo.abs()).max_element() + 500.0));
                Boxed(Aabb::new(Vec3A::from(lo) - pad, Vec3A::from(hi) + pad))
            })
            .collect();
        let tree = build_cwbvh(&boxes, BvhBuildParams::medium_build(), &mut Duration::default());
        let row = |v: Vec3, bits: u32| [v.x, v.y, v.z, f32::from_bits(bits)];
        let rows = tree
            .primitive_indices
            .iter()
            .flat_map(|&i| {
                let (v, patch) = &triangles[i as usize];
                [row(v[0], *patch), row(v[1] - v[0], 7), row(v[2] - v[0], 9)]
            })
            .collect();
        Mesh { tree, rows }
    }

    fn len(&self) -> usize {
        self.rows.len() / 3
    }

    fn upload(&self, gpu: &Gpu) -> Tree {
        let mut r = gpu.recorder("mesh");
        let tree = Tree {
            nodes: r.upload("bvh nodes", bytemuck::cast_slice(&self.tree.nodes)),
            triangles: r.upload("triangles", &self.rows),
        };
        r.submit().unwrap();
        tree
    }

    fn patch(&self, triangle: usize) -> u32 {
        self.rows[3 * triangle][3].to_bits()
    }

    fn cpu(&self, find: Find, rays: &[Ray], skips: &[u32]) -> Vec<Hit> {
        cpu::hits(&self.tree, &self.rows, find, rays, skips)
    }

    fn exact(&self, triangle: usize, ray: &Ray) -> Option<Exact> {
        let [v0, e1, e2] = [0, 1, 2].map(|i| {
            let [x, y, z, _] = self.rows[3 * triangle + i];
            DVec3::new(x.into(), y.into(), z.into())
        });
        let (o, d) = (Vec3::from(ray.origin).as_dvec3(), Vec3::from(ray.dir).as_dvec3());
        // Moeller, Trumbore 1997
        let p = d.cross(e2);
        let det = e1.dot(p);
        if det == 0.0 {
            return None;
        }
        let s = o - v0;
        let q = s.cross(e1);
        let reach = s.length() * d.length() * e1.length().max(e2.length()) / det.abs();
        Some(Exact {
            t: e2.dot(q) / det,
            u: s.dot(p) / det,
            v: d.dot(q) / det,
            margin: 4e-6 * reach,
            t_margin: 2e-6 * s.length() * e1.length() * e2.length() / det.abs(),
        })
    }
}

/// A ray and a triangle's plane in f64, and what f32 can make of them.
struct Exact {
    t: f64,
    u: f64,
    v: f64,
    /// Of u and v.
    margin: f64,
    t_margin: f64,
}

impl Exact {
    /// How far inside all edges, in the units of u and v.
    fn depth(&self) -> f64 {
        self.u.min(self.v).min(1.0 - self.u - self.v)
    }
    fn surely_met(&self) -> bool {
        self.depth() > self.margin
    }
    fn may_be_met(&self) -> bool {
        self.depth() >= -self.margin
    }
}

/// What is wrong with `hit`, judged by every triangle.
fn fault(mesh: &Mesh, ray: &Ray, skip: u32, find: Find, hit: &Hit) -> Option<String> {
    let (t_min, t_max) = (f64::from(ray.t_min), f64::from(ray.t_max));
    let (mut reached, mut reached_margin) = (t_max, 0.0);
    if hit.triangle == NO_TRIANGLE {
        if hit.t != ray.t_max {
            return Some(format!("a miss with t = {}", hit.t));
        }
    } else {
        let triangle = hit.triangle as usize;
        if triangle >= mesh.len() || mesh.patch(triangle) == skip {
            return Some(format!("triangle {triangle} does not count"));
        }
        let Some(exact) = mesh.exact(triangle, ray) else {
            return Some(format!("triangle {triangle} is parallel to the ray"));
        };
        let t = f64::from(hit.t);
        if !exact.may_be_met() {
            return Some(format!("triangle {triangle} is not met: {} outside", -exact.depth()));
        }
        let margin = exact.t_margin + 1e-6 * exact.t.abs();
        if (t - exact.t).abs() > margin || t <= t_min || t >= t_max {
            return Some(format!("t is {t}, must be {} in ({t_min}, {t_max})", exact.t));
        }
        for (got, want) in [(hit.u, exact.u), (hit.v, exact.v)] {
            if (f64::from(got) - want).abs() > exact.margin + 1e-6 {
                return Some(format!("u or v is {got}, must be {want}"));
            }
        }
        (reached, reached_margin) = (exact.t, margin);
    }
    if find == Find::Any && hit.triangle != NO_TRIANGLE {
        return None;
    }
    for i in (0..mesh.len()).filter(|&i| mesh.patch(i) != skip) {
        let Some(e) = mesh.exact(i, ray) else { continue };
        let margin = e.t_margin + 1e-6 * e.t.abs();
        if e.surely_met() && e.t > t_min + margin && e.t < reached - margin - reached_margin {
            return Some(format!(
                "triangle {i} at {} lies before {} of triangle {}",
                e.t, reached, hit.triangle
            ));
        }
    }
    None
}

fn uniform(words: &mut impl Iterator<Item = u32>) -> f64 {
    (f64::from(words.next().unwrap()) + 0.5) / 4_294_967_296.0
}

fn stream(seed: u32) -> impl Iterator<Item = u32> {
    (0u32..).flat_map(move |i| philox4x32_10([i, 0, 0, 0], [seed, 0xc105]))
}

/// Triangles of all sizes, some in planes along the axes, and rays at their inside, edges and corners.
fn soup(seed: u32, triangles: usize, rays: usize, padding: f32) -> (Mesh, Vec<Ray>, Vec<u32>) {
    let mut w = stream(seed);
    let w = &mut w;
    let point = |w: &mut _, size: f64| Vec3::from_array([0; 3].map(|_| ((uniform(w) - 0.5) * size) as f32));
    let extent = 10f64.powf(uniform(w) * 3.0 - 1.0);
    let soup: Vec<([Vec3; 3], u32)> = (0..triangles)
        .map(|i| {
            let size = extent * 10f64.powf(-4.0 * uniform(w));
            let centre = point(w, extent);
            let mut v = [0; 3].map(|_| centre + point(w, size));
            if i % 3 == 0 {
                // a plane across an axis
                for k in 1..3 {
                    v[k][i % 9 / 3] = v[0][i % 9 / 3];
                }
            }
            (v, i as u32 / 2)
        })
        .collect();
    let mut skips = Vec::new();
    let rays = (0..rays)
        .map(|i| {
            let (target, patch) = soup[i % triangles];
            let (mut a, mut b) = (uniform(w) as f32, uniform(w) as f32);
            match i % 5 {
                0 => a = 0.0,
                1 => (a, b) = (0.0, 0.0),
                _ => {}
            }
            if a + b > 1.0 {
                (a, b) = (1.0 - a, 1.0 - b);
            }
            let aim = target[0] + a * (target[1] - target[0]) + b * (target[2] - target[0]);
            let far = if i % 7 == 0 { 400.0 } else { 2.0 * extent };
            let mut origin = point(w, far);
            if i % 4 == 0 {
                // along an axis
                let axis = i / 4 % 3;
                origin = aim + Vec3::AXES[axis] * (origin[axis] - aim[axis]);
            }
            let stretch = 10f64.powf(7.0 * uniform(w) - 2.0) as f32;
            let mut dir = (aim - origin) * stretch;
            if i % 8 == 0 {
                // zeros of either sign
                dir = Vec3::from_array(dir.to_array().map(|x| if x == 0.0 { -0.0 } else { x }));
            }
            if dir == Vec3::ZERO {
                dir = Vec3::Z;
            }
            let t = (aim - origin).length() / dir.length();
            let (t_min, t_max) = match i % 6 {
                0 => (1.5 * t, 1e30),
                1 => (0.0, 0.5 * t),
                2 => (0.5 * t, 1.5 * t),
                _ => (1e-6 * t, 1e30),
            };
            skips.push(if i % 3 == 1 { patch } else { NO_PATCH });
            Ray { origin: origin.into(), t_min, dir: dir.into(), t_max }
        })
        .collect();
    (Mesh::new(&soup, padding), rays, skips)
}

fn check(
    name: &str,
    mesh: &Mesh,
    find: Find,
    rays: &[Ray],
    skips: &[u32],
    hits: &[Hit],
) -> Result<(), String> {
    assert_eq!(hits.len(), rays.len());
    for (i, hit) in hits.iter().enumerate() {
        if let Some(fault) = fault(mesh, &rays[i], skips[i], find, hit) {
            return Err(format!("{name}, ray {i} {:?} skipping {}: {fault}", rays[i], skips[i]));
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn cpu_agrees_with_every_triangle(seed in any::<u32>(), triangles in 1usize..300) {
        let (mesh, rays, skips) = soup(seed, triangles, 400, PADDED);
        for find in [Find::Closest, Find::Any] {
            let hits = mesh.cpu(find, &rays, &skips);
            prop_assert_eq!(check("cpu", &mesh, find, &rays, &skips, &hits), Ok(()));
        }
    }

    #[test]
    fn gpu_agrees_with_every_triangle(seed in any::<u32>(), triangles in 1usize..300) {
        let (mesh, rays, skips) = soup(seed, triangles, 400, TIGHT);
        let tree = mesh.upload(test_gpu());
        for find in [Find::Closest, Find::Any] {
            let (hits, _) = gpu::hits(test_gpu(), &tree, find, &rays, &skips).unwrap();
            prop_assert_eq!(check("gpu", &mesh, find, &rays, &skips, &hits), Ok(()));
        }
    }
}

#[test]
fn the_judge_finds_faults() {
    let (mesh, rays, skips) = soup(5, 200, 400, PADDED);
    let hits = mesh.cpu(Find::Closest, &rays, &skips);
    let bad = |i: usize, hit: Hit| fault(&mesh, &rays[i], skips[i], Find::Closest, &hit);
    let mut tried = 0;
    for (i, &hit) in hits.iter().enumerate() {
        let missed = Hit { t: rays[i].t_max, u: 0.0, v: 0.0, triangle: NO_TRIANGLE };
        if hit.triangle == NO_TRIANGLE {
            assert!(bad(i, Hit { triangle: mesh.len() as u32, ..hit }).is_some());
            continue;
        }
        let exact = mesh.exact(hit.triangle as usize, &rays[i]).unwrap();
        // well inside, seen from near enough
        if exact.depth() < 0.05 || exact.margin > 1e-3 || exact.t_margin > 1e-3 * exact.t {
            continue;
        }
        tried += 1;
        assert!(bad(i, missed).is_some(), "a missed triangle");
        assert!(bad(i, Hit { t: hit.t * 1.01, ..hit }).is_some(), "a wrong distance");
        assert!(bad(i, Hit { u: hit.u + 0.02, ..hit }).is_some(), "a wrong place");
        assert!(bad(i, Hit { triangle: (hit.triangle + 1) % 200, ..hit }).is_some(), "a wrong triangle");
    }
    assert!(tried > 50, "{tried}");
}

#[test]
fn no_trees_and_no_rays() {
    let gpu = test_gpu();
    let mut r = gpu.recorder("empty");
    let tree = Tree { nodes: r.upload("bvh nodes", &[]), triangles: r.upload("triangles", &[]) };
    r.submit().unwrap();
    let ray = Ray { origin: [0.0; 3], t_min: 0.0, dir: [0.0, 0.6, -0.8], t_max: 50.0 };
    let miss = Hit { t: 50.0, u: 0.0, v: 0.0, triangle: NO_TRIANGLE };
    assert_eq!(gpu::hits(gpu, &tree, Find::Closest, &[ray; 3], &[NO_PATCH; 3]).unwrap().0, [miss; 3]);
    assert_eq!(cpu::hits(&CwBvh::default(), &[], Find::Closest, &[ray; 3], &[NO_PATCH; 3]), [miss; 3]);
    assert!(gpu::hits(gpu, &tree, Find::Any, &[], &[]).unwrap().0.is_empty());
}

/// A height field of 2 (side - 1)^2 triangles with edges of about 1 m, and its patches.
fn terrain(side: usize) -> Mesh {
    let half = 0.5 * (side - 1) as f32;
    let vertex = |i: usize, j: usize| {
        let (x, y) = (i as f32 - half, j as f32 - half);
        let [noise, ..] = philox4x32_10([i as u32, j as u32, 0, 0], [77, 0]);
        let z = 6.0 * (0.021 * x).sin() * (0.017 * y).cos()
            + 1.5 * (0.13 * x + 0.11 * y).sin()
            + 0.3 * (noise as f32 / 4_294_967_296.0);
        Vec3::new(x, y, z)
    };
    let triangles: Vec<_> = (0..side - 1)
        .flat_map(|i| (0..side - 1).map(move |j| (i, j)))
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [vertex(i, j), vertex(i + 1, j), vertex(i, j + 1), vertex(i + 1, j + 1)];
            [([a, b, d], 2 * (i * side + j) as u32), ([a, d, c], 2 * (i * side + j) as u32 + 1)]
        })
        .collect();
    Mesh::new(&triangles, PADDED)
}

/// Through the pixels of an image of the terrain seen from above its middle.
fn camera(width: usize, height: usize) -> Vec<Ray> {
    (0..width * height)
        .map(|i| {
            let (x, y) = ((i % width) as f32 / width as f32 - 0.5, (i / width) as f32 / height as f32 - 0.5);
            let dir = Vec3::new(1.0, -1.2 * x, -0.25 - 0.7 * y).normalize();
            Ray { origin: [-30.3, 4.7, 25.1], t_min: 1e-4, dir: dir.into(), t_max: 1e30 }
        })
        .collect()
}

/// From anywhere above the terrain to anywhere.
fn random_rays(count: usize, side: f64) -> Vec<Ray> {
    let mut w = stream(99);
    let mut next = || uniform(&mut w);
    (0..count)
        .map(|_| {
            let origin = [(next() - 0.5) * side, (next() - 0.5) * side, 10.0 + 20.0 * next()];
            let (z, angle) = (2.0 * next() - 1.0, std::f64::consts::TAU * next());
            let s = (1.0 - z * z).sqrt();
            let dir = [s * angle.cos(), s * angle.sin(), z];
            Ray { origin: origin.map(|x| x as f32), t_min: 1e-4, dir: dir.map(|x| x as f32), t_max: 1e30 }
        })
        .collect()
}

/// Both engines on the same rays: all but 1e-4 of them meet the same triangle, t agrees there, and the others
/// pass an edge within the rounding of f32.
fn compare(name: &str, mesh: &Mesh, rays: &[Ray]) {
    let skips = vec![NO_PATCH; rays.len()];
    let gpu = test_gpu();
    let tree = mesh.upload(gpu);
    // first the pipeline
    gpu::hits(gpu, &tree, Find::Closest, &rays[..1], &skips[..1]).unwrap();
    let (on_gpu, seconds) = gpu::hits(gpu, &tree, Find::Closest, rays, &skips).unwrap();
    let start = Instant::now();
    let on_cpu = mesh.cpu(Find::Closest, rays, &skips);
    let cpu_seconds = start.elapsed().as_secs_f64();

    let (mut met, mut different, mut largest, mut squares, mut norm) = (0, 0, 0.0_f64, 0.0, 0.0);
    for (i, (g, c)) in on_gpu.iter().zip(&on_cpu).enumerate() {
        if g.triangle == c.triangle {
            if g.triangle != NO_TRIANGLE {
                met += 1;
                let (tg, tc) = (f64::from(g.t), f64::from(c.t));
                largest = largest.max((tg - tc).abs() / tc);
                squares += (tg - tc).powi(2);
                norm += tc * tc;
            }
            continue;
        }
        different += 1;
        // The nearer of the two passes an edge, and one engine takes it for a miss.
        let nearer = if g.t < c.t { g } else { c };
        let exact = mesh.exact(nearer.triangle as usize, &rays[i]).expect("parallel to the ray");
        assert!(
            exact.depth().abs() <= exact.margin,
            "{name}, ray {i}: {g:?} on gpu, {c:?} on cpu, not at an edge"
        );
    }
    let share = different as f64 / rays.len() as f64;
    println!(
        "{name}: {} triangles, {} rays, {met} hits, {different} at edges ({share:.1e}), t within {largest:.1e} \
         (relative L2 {:.1e}); {} {:.1} Mray/s, cpu {:.1} Mray/s",
        mesh.len(),
        rays.len(),
        f64::sqrt(squares / norm),
        gpu.report().name,
        1e-6 * rays.len() as f64 / seconds,
        1e-6 * rays.len() as f64 / cpu_seconds,
    );
    assert!(met > rays.len() / 4, "{name}: only {met} hits");
    assert!(share <= 1e-4, "{name}: {different} of {} rays differ", rays.len());
    assert!(largest <= 1e-5, "{name}: t differs by {largest:e}");
}

#[test]
fn engines_agree_on_a_terrain() {
    let mesh = terrain(150);
    compare("camera", &mesh, &camera(240, 135));
    compare("random", &mesh, &random_rays(40_000, 149.0));
}

/// Workload W6, also its timing: `cargo test --release -p catseye --test simulator closest -- --ignored --nocapture`.
#[test]
#[ignore = "a million triangles and four million rays: some seconds on a software driver"]
fn engines_agree_on_a_million_triangles() {
    let mesh = terrain(708);
    compare("W6 coherent", &mesh, &camera(1920, 1080));
    compare("W6 random", &mesh, &random_rays(2_073_600, 707.0));
}

/// A sphere about the origin.
fn sphere(radius: f32, rows: usize, columns: usize) -> Vec<([Vec3; 3], u32)> {
    let vertex = |i: usize, j: usize| {
        let a = std::f32::consts::PI * i as f32 / rows as f32;
        let b = std::f32::consts::TAU * (j % columns) as f32 / columns as f32;
        let s = if i == 0 || i == rows { 0.0 } else { a.sin() };
        radius * Vec3::new(s * b.cos(), s * b.sin(), a.cos())
    };
    let mut triangles = Vec::new();
    for (i, j) in (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j))) {
        let [a, b, c, d] = [vertex(i, j), vertex(i + 1, j), vertex(i, j + 1), vertex(i + 1, j + 1)];
        if i > 0 {
            triangles.push(([a, b, c], 0));
        }
        if i + 1 < rows {
            triangles.push(([b, d, c], 0));
        }
    }
    triangles
}

/// A cube about the origin, each face a grid: the edges run along the planes of the tree's boxes.
fn cube(side: f32, cells: usize) -> Vec<([Vec3; 3], u32)> {
    let mut triangles = Vec::new();
    for (axis, sign) in [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0), (2, 1.0), (2, -1.0)] {
        let vertex = |i: usize, j: usize| {
            let place = |n: usize| side * (n as f32 / cells as f32 - 0.5);
            let mut v = [0.0; 3];
            v[axis] = sign * 0.5 * side;
            v[(axis + 1) % 3] = place(i);
            v[(axis + 2) % 3] = place(j);
            Vec3::from_array(v)
        };
        for (i, j) in (0..cells).flat_map(|i| (0..cells).map(move |j| (i, j))) {
            let [a, b, c, d] = [vertex(i, j), vertex(i + 1, j), vertex(i, j + 1), vertex(i + 1, j + 1)];
            triangles.extend([([a, b, c], 0), ([b, d, c], 0)]);
        }
    }
    triangles
}

/// From inside a closed surface every ray ends on it, also through corners and along edges.
#[test]
fn closed_surfaces_hold_tight() {
    for (name, triangles) in [("sphere", sphere(30.0, 24, 48)), ("cube", cube(33.3, 17))] {
        let mut w = stream(3);
        let mut rays = Vec::new();
        for (v, _) in &triangles {
            let origin = Vec3::from_array([0; 3].map(|_| (uniform(&mut w) - 0.5) as f32 * 20.0));
            for k in 0..3 {
                for s in [0.0, 0.5, uniform(&mut w) as f32, uniform(&mut w) as f32] {
                    let aim = v[k] + s * (v[(k + 1) % 3] - v[k]);
                    let dir = (aim - origin).normalize();
                    rays.push(Ray { origin: origin.into(), t_min: 0.0, dir: dir.into(), t_max: 1e30 });
                }
            }
        }
        let (padded, tight) = (Mesh::new(&triangles, PADDED), Mesh::new(&triangles, TIGHT));
        let skips = vec![NO_PATCH; rays.len()];
        let (on_gpu, _) =
            gpu::hits(test_gpu(), &tight.upload(test_gpu()), Find::Closest, &rays, &skips).unwrap();
        for (engine, hits) in [("gpu", on_gpu), ("cpu", padded.cpu(Find::Closest, &rays, &skips))] {
            let leaks = hits.iter().filter(|h| h.triangle == NO_TRIANGLE).count();
            assert_eq!(leaks, 0, "{engine}: {leaks} of {} rays leave the {name}", rays.len());
        }
    }
}

/// Short directions along an axis, the other components zeros of either sign, near the rim of a plate.
#[test]
fn rays_along_an_axis() {
    let corner = |y: f32, z: f32| Vec3::new(2.0, y, z);
    let plate = [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
    let plate = [([plate[0], plate[1], plate[2]], 0), ([plate[0], plate[2], plate[3]], 1)];
    let (mesh, tight) = (Mesh::new(&plate, PADDED), Mesh::new(&plate, TIGHT));
    let mut rays = Vec::new();
    for (y, met) in [(-1e-4, false), (1e-4, true), (0.3, true), (0.999, true), (1.0001, false)] {
        for zero in [0.0, -0.0] {
            let dir = [1e-5, zero, zero];
            rays.push((Ray { origin: [1.0, y, 0.5], t_min: 1e-4, dir, t_max: 1e30 }, met));
            rays.push((Ray { origin: [3.0, 0.5, y], t_min: 1e-4, dir: dir.map(|d| -d), t_max: 1e30 }, met));
        }
    }
    let (rays, met): (Vec<Ray>, Vec<bool>) = rays.into_iter().unzip();
    let skips = vec![NO_PATCH; rays.len()];
    let (on_gpu, _) = gpu::hits(test_gpu(), &tight.upload(test_gpu()), Find::Closest, &rays, &skips).unwrap();
    for (engine, hits) in [("gpu", on_gpu), ("cpu", mesh.cpu(Find::Closest, &rays, &skips))] {
        let found: Vec<bool> = hits.iter().map(|h| h.triangle != NO_TRIANGLE).collect();
        assert_eq!(found, met, "{engine}");
    }
}

#[test]
fn chunks_give_the_same_hits() {
    let (mesh, rays, skips) = soup(8, 60, 1000, TIGHT);
    let whole = gpu::hits(test_gpu(), &mesh.upload(test_gpu()), Find::Closest, &rays, &skips).unwrap().0;
    let small = opened_for_tests().with_binding_limit(9000);
    let pieces = gpu::hits(&small, &mesh.upload(&small), Find::Closest, &rays, &skips).unwrap().0;
    assert_eq!(whole, pieces);
}
