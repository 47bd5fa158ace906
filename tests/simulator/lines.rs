//! Visibility by lines against rays, in random scenes of boxes and plates.

use catseye::base::frames::Pose;
use catseye::base::rng::philox4x32_10;
use catseye::geom::Geometry;
use catseye::geom::edge_table::EdgeTable;
use catseye::geom::faces::{Face, Faces};
use catseye::road::shape::cuboid;
use catseye::scene::{Material, Mesh, Scene};
use catseye::trace::beams::{BeamOptions, Frame};
use catseye::trace::cpu::chains;
use catseye::trace::cpu::lines::Fragment;
use glam::DVec3;
use proptest::prelude::*;

/// Rays along each side of a face.
const RAYS: usize = 60;

struct Random {
    seed: u32,
    count: u32,
}

impl Random {
    fn next(&mut self, lo: f64, hi: f64) -> f64 {
        self.count += 1;
        let bits = philox4x32_10([self.count, 0, 0, 0], [self.seed, 1])[0];
        lo + (hi - lo) * f64::from(bits) / f64::from(u32::MAX)
    }
}

fn plate(width_m: f64, length_m: f64) -> Mesh {
    let corner = |s: f64, t: f64| DVec3::new(0.5 * s * width_m, 0.5 * t * length_m, 0.0);
    Mesh {
        positions_m: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material: vec![0; 2],
        normals: Vec::new(),
    }
}

/// A ground with boxes that stand on it, boxes and plates that are turned at will and may cross, and a radar outside all boxes.
fn scene(seed: u32, bodies: usize) -> (Faces, DVec3) {
    let mut random = Random { seed, count: 0 };
    let mut scene = Scene { materials: vec![Material::pec()], ..Scene::default() };
    scene.add_mesh("ground", "", plate(16.0, 12.0), Pose::IDENTITY);
    for i in 0..bodies {
        let mut size = DVec3::from_array([0; 3].map(|_| random.next(0.4, 2.0)));
        let at = DVec3::new(random.next(-2.5, 2.5), random.next(-2.5, 2.5), random.next(0.8, 2.5));
        let [yaw, pitch, roll] = [0; 3].map(|_| random.next(-1.5, 1.5));
        let (mesh, pose) = match i % 3 {
            0 => {
                let at = DVec3::new(at.x, at.y, 0.5 * size.z);
                (cuboid(size, DVec3::ZERO, 0), Pose::from_yaw_pitch_roll(at, yaw, 0.0, 0.0))
            }
            1 => (cuboid(size, DVec3::ZERO, 0), Pose::from_yaw_pitch_roll(at, yaw, pitch, roll)),
            _ => {
                size *= 1.5;
                (plate(size.x, size.y), Pose::from_yaw_pitch_roll(at, yaw, pitch, roll))
            }
        };
        scene.add_mesh(&format!("body {i}"), "", mesh, pose);
    }
    let away = random.next(7.0, 14.0);
    let turn = random.next(0.0, std::f64::consts::TAU);
    let radar = DVec3::new(away * turn.cos(), away * turn.sin(), random.next(0.3, 6.0));
    (Geometry::build(&scene, 0.0, 77e9).unwrap().find_faces(), radar)
}

/// The six sides of a cube around a radar.
fn all_around(origin: DVec3) -> Vec<Frame> {
    let side = |(k, u): (DVec3, DVec3)| Frame { origin, u, v: k.cross(u), k, from_point: true, lead_m: 0.0 };
    let axes = [(DVec3::X, DVec3::Y), (DVec3::Y, DVec3::Z), (DVec3::Z, DVec3::X)];
    axes.into_iter().flat_map(|(k, u)| [side((k, u)), side((-k, u))]).collect()
}

fn height(face: &Face, p: DVec3) -> f64 {
    face.normal.dot(p) - face.offset_m
}

fn is_inside(faces: &Faces, face: &Face, p: DVec3) -> bool {
    let corners = faces.corners(face);
    (0..corners.len()).all(|k| {
        let (a, b) = (corners[k], corners[(k + 1) % corners.len()]);
        face.normal.dot((b - a).cross(p - a)) >= 0.0
    })
}

/// Whether no face is between the radar and a place on a patch.
fn is_seen(faces: &Faces, radar: DVec3, face: &Face, p: DVec3) -> bool {
    let is_met = |f: &Face| height(f, radar) > 0.0 || !f.one_sided;
    let d = p - radar;
    is_met(face)
        && !faces.faces.iter().any(|f| {
            let t = -height(f, radar) / f.normal.dot(d);
            let is_before = t > 0.0 && t < 1.0 - 1e-9;
            is_before && f.patch != face.patch && is_met(f) && is_inside(faces, f, radar + d * t)
        })
}

/// The visible area of a face by a grid of rays, and how much that may be off: half a cell at its border, and a strip too thin for the grid.
fn by_rays(faces: &Faces, radar: DVec3, face: &Face) -> (f64, f64) {
    let [u, v] = face.axis;
    let corners = faces.corners(face);
    let span = |axis: DVec3| {
        let at = corners.iter().map(|c| axis.dot(*c - corners[0]));
        at.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), x| (lo.min(x), hi.max(x)))
    };
    let (x, y) = (span(u), span(v));
    let step = [(x.1 - x.0) / RAYS as f64, (y.1 - y.0) / RAYS as f64];
    let seen: Vec<bool> = (0..RAYS * RAYS)
        .map(|i| {
            let (a, b) = ((i % RAYS) as f64 + 0.5, (i / RAYS) as f64 + 0.5);
            let p = corners[0] + u * (x.0 + step[0] * a) + v * (y.0 + step[1] * b);
            is_inside(faces, face, p) && is_seen(faces, radar, face, p)
        })
        .collect();
    let is_border = |i: &usize| {
        let (a, b) = (i % RAYS, i / RAYS);
        let differs = |is_in: bool, j: usize| (is_in && seen[j]) != seen[*i];
        differs(a > 0, i.wrapping_sub(1))
            || differs(a + 1 < RAYS, i + 1)
            || differs(b > 0, i.wrapping_sub(RAYS))
            || differs(b + 1 < RAYS, i + RAYS)
    };
    let border = (0..seen.len()).filter(is_border).count();
    let cell = step[0] * step[1];
    let count = seen.iter().filter(|s| **s).count();
    (count as f64 * cell, (0.5 * border as f64 + 0.5 * RAYS as f64) * cell)
}

/// The fragments of all that the radar sees at first hand.
fn first_bounce(faces: &Faces, radar: DVec3) -> Vec<Fragment> {
    let options = BeamOptions::new(1, 0.2, false);
    let chains = chains::follow(faces, &EdgeTable::new(faces), &all_around(radar), &options);
    chains.iter().flat_map(|c| c.lit.clone()).collect()
}

/// Area of each patch and the gap of its outline.
fn sums(faces: &Faces, fragments: &[Fragment]) -> Vec<(f64, DVec3)> {
    let mut sums = vec![(0.0, DVec3::ZERO); faces.patch_area_m2.len()];
    let mut first = vec![None; sums.len()];
    for f in fragments {
        let face = &faces.faces[f.face as usize];
        let patch = face.patch as usize;
        let (origin, normal) = *first[patch].get_or_insert((faces.corners(face)[0], face.normal));
        sums[patch].0 += f.area_m2(origin, normal);
        sums[patch].1 += f.vector_m(normal);
    }
    sums
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn areas_are_those_that_rays_count(seed in any::<u32>(), bodies in 3usize..9) {
        let (faces, radar) = scene(seed, bodies);
        let fragments = first_bounce(&faces, radar);
        let sums = sums(&faces, &fragments);
        for (patch, (area, gap)) in sums.iter().enumerate() {
            prop_assert!(gap.length() < 1e-9, "patch {patch} is open by {:.1e} m", gap.length());
            let of = faces.faces.iter().filter(|f| f.patch as usize == patch);
            let counted = of.map(|f| by_rays(&faces, radar, f)).fold((0.0, 0.0), |s, a| (s.0 + a.0, s.1 + a.1));
            let (rays, error) = counted;
            prop_assert!((area - rays).abs() <= error, "patch {patch}: lines {area}, rays {rays} ± {error}");
        }
        let again = first_bounce(&faces, radar);
        prop_assert_eq!(fragments, again);
    }
}
