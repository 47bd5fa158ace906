//! What the meshes of a scene have that may show in its frames, in words: names, numbers of places, remedies.
//!
//! What is taken otherwise than the file has it is said, and so is what can change by a leap when it is moved by a hair's breadth.

use super::Geometry;
use super::dielectrics::{self, Doubt, Obstacle};
use super::faces::{Face, Faces, HalfSpace, LIES_M, bounds};
use super::overlaps::without_doubles;
use super::surface::surfaces_at;
use super::validate::{check_mesh, check_scene};
use crate::base::error::{Error, Result};
use crate::base::units::wavenumber;
use crate::geom::hash::FastMap;
use crate::scene::{Object, Scene, Shape};
use glam::DVec3;

/// So many objects with corners that were moved are told one by one.
const TOLD: usize = 3;

/// What the meshes have that may show in a frame: see [`MeshReport::in_frames`](super::validate::MeshReport::in_frames). One line
/// for each mesh and matter, which begins with the name of the first object that shows the mesh.
///
/// # Errors
/// Returns the errors of [`check_mesh`], with the object's name.
pub fn of_meshes(scene: &Scene, freq_hz: f64) -> Result<Vec<String>> {
    let dielectric = |m: u32| scene.materials.get(m as usize).is_some_and(|m| m.is_dielectric());
    let mut seen = vec![false; scene.meshes.len()];
    let mut lines = Vec::new();
    for object in scene.objects.iter().filter(|o| o.radar) {
        let Shape::Mesh(m) = object.shape else { continue };
        if std::mem::replace(&mut seen[m], true) {
            continue;
        }
        let report = check_mesh(&scene.meshes[m], freq_hz, &dielectric).map_err(|e| match e {
            Error::Input(b) => {
                let key = b.key.clone().map_or_else(String::new, |k| format!(" {k}"));
                b.key(format!("object '{}'{key}", object.name)).into()
            }
            e => e,
        })?;
        lines.extend(report.in_frames().iter().map(|l| format!("object '{}': {l}", object.name)));
    }
    lines.extend(curved_dielectrics(scene, freq_hz)?);
    Ok(lines)
}

/// What may make a cross section wrong, or what was taken otherwise than the meshes have it: defects of meshes, bodies of
/// dielectrics that are open or curved, metal that is there twice. One line each.
///
/// # Errors
/// Returns the errors of [`check_scene`] and of a material without a value at the frequency.
pub fn of_targets(scene: &Scene, freq_hz: f64) -> Result<Vec<String>> {
    let mut lines = Vec::new();
    for (name, report) in check_scene(scene, freq_hz)? {
        lines.extend(report.warnings().iter().map(|w| format!("{name}: {w}")));
    }
    lines.extend(of_bodies(scene, freq_hz, false)?);
    Ok(lines)
}

/// The part of [`of_targets`] that bodies and their materials give, `with_sheets` also of dielectric sheets without a thickness.
///
/// # Errors
/// Returns an error for a material without a value at the frequency.
pub fn of_bodies(scene: &Scene, freq_hz: f64, with_sheets: bool) -> Result<Vec<String>> {
    let (single, doubled) = without_doubles(scene);
    let mut lines: Vec<String> = doubled.iter().map(|d| d.line(scene)).collect();
    let doubts = dielectrics::doubts(&single, &surfaces_at(&single, freq_hz)?, wavenumber(freq_hz));
    if dielectrics::lone_sphere(&single, &doubts).is_none() {
        let name = |d: &Doubt| single.objects[d.object].name.as_str();
        // Behind a sheet that stands alone there is nothing to miss, and a road is one.
        let parts = single.objects.iter().filter(|o| o.radar).count();
        let is_road = |d: &Doubt| {
            matches!(d.obstacle, Obstacle::Open { is_sheet: true, .. }) && (parts == 1 || !with_sheets)
        };
        let shown = doubts.iter().filter(|d| !is_road(d));
        lines.extend(shown.map(|d| format!("object '{}': {}", name(d), d.line(&single))));
    }
    Ok(lines)
}

/// Curved bodies that waves enter, each mesh once: frames follow reflections alone.
fn curved_dielectrics(scene: &Scene, freq_hz: f64) -> Result<Vec<String>> {
    // What is flat is not looked at: nobody waits for a road.
    let curved = |o: &&Object| matches!(o.shape, Shape::Mesh(m) if scene.meshes[m].is_smooth());
    let mut seen = vec![false; scene.meshes.len()];
    let objects = scene.objects.iter().filter(curved).filter(|o| match o.shape {
        Shape::Mesh(m) => !std::mem::replace(&mut seen[m], true),
        _ => false,
    });
    let objects: Vec<Object> = objects.cloned().collect();
    if objects.is_empty() {
        return Ok(Vec::new());
    }
    let some = Scene {
        objects,
        meshes: scene.meshes.clone(),
        materials: scene.materials.clone(),
        ..Scene::default()
    };
    let doubts = dielectrics::doubts(&some, &surfaces_at(scene, freq_hz)?, wavenumber(freq_hz));
    let is_curved = |d: &&Doubt| matches!(d.obstacle, Obstacle::Curved { .. });
    let line = |d: &Doubt| {
        format!(
            "object '{}': {}; frames contain the reflection of its front surface, but nothing that it focuses",
            some.objects[d.object].name,
            d.line(&some)
        )
    };
    Ok(doubts.iter().filter(is_curved).map(line).collect())
}

/// Faces of one body that lie on another body.
struct Lying {
    body: usize,
    on: usize,
    faces: usize,
    /// How far the deepest corner is behind the other's plane, m.
    deepest_m: f64,
}

/// The least and largest corner of a box, m.
type Bounds = (DVec3, DVec3);

fn overlap(a: &Bounds, b: &Bounds) -> bool {
    a.0.cmple(b.1).all() && b.0.cmple(a.1).all()
}

impl Geometry {
    /// What was taken otherwise than the meshes have it, or stands on an edge, for a radar at `radar_m`: corners that were moved into
    /// their plane, and faces that lie in the plane of another object's. One line each, with the names that `scene` gives the bodies.
    pub fn remarks(&self, scene: &Scene, radar_m: DVec3) -> Vec<String> {
        let mut lines = self.taken_otherwise(scene);
        // Objects that show one mesh and lie on one thing are said together.
        let mut together: Vec<(Lying, usize)> = Vec::new();
        let mut known: FastMap<(usize, u32), usize> = FastMap::default();
        for lying in self.lying(radar_m) {
            let mesh = std::sync::Arc::as_ptr(&self.placed[lying.body].mesh) as usize;
            match known.get(&(mesh, lying.on as u32)) {
                None => {
                    known.insert((mesh, lying.on as u32), together.len());
                    together.push((lying, 0));
                }
                Some(at) => {
                    let (all, others) = &mut together[*at];
                    *others += 1;
                    all.faces += lying.faces;
                    all.deepest_m = all.deepest_m.max(lying.deepest_m);
                }
            }
        }
        lines.extend(together.iter().map(|(lying, others)| {
            let more = match others {
                0 => String::new(),
                n => format!(" and {n} more of its kind"),
            };
            let faces = match lying.faces {
                1 => "1 face lies".to_string(),
                n => format!("{n} faces lie"),
            };
            format!(
                "object '{}'{more}: {faces} in the plane of object '{}' or up to {:.3} mm behind it, and \
                 each is treated as lying on it (CONVENTIONS eq. 65b); raise the object by the thickness of \
                 the surface on which it is",
                self.name(scene, lying.body),
                self.name(scene, lying.on),
                1e3 * lying.deepest_m
            )
        }));
        lines
    }

    fn name<'a>(&self, scene: &'a Scene, body: usize) -> &'a str {
        scene.object_by_id(self.bodies[body].id).map_or("", |o| o.name.as_str())
    }

    /// Copies of triangles and corners that were moved, mesh by mesh.
    fn taken_otherwise(&self, scene: &Scene) -> Vec<String> {
        let mut seen: FastMap<usize, ()> = FastMap::default();
        let mut lines = Vec::new();
        // Objects beyond those that are told one by one: how many, their facets, and how far corners were moved.
        let (mut told, mut more, mut facets, mut most_m) = (0, 0, 0, 0f64);
        for (body, placed) in self.placed.iter().enumerate() {
            if seen.insert(std::sync::Arc::as_ptr(&placed.mesh) as usize, ()).is_some() {
                continue;
            }
            let (copies, faced, moved) = (placed.mesh.copies, placed.mesh.faced, placed.mesh.moved);
            if copies + faced + moved.planes == 0 {
                continue;
            }
            let name = self.name(scene, body);
            let all = thousands(placed.mesh.len() + placed.mesh.dropped + copies);
            if copies > 0 {
                lines.push(format!(
                    "object '{name}': {} of {all} triangles have the corners of another one and are left out; remove the copies",
                    thousands(copies)
                ));
            }
            if faced > 0 {
                lines.push(format!(
                    "object '{name}': {} of {all} triangles face another one with the same corners and dielectric; remove them if they are \
                     copies, which reflect twice, and keep them if two bodies touch there",
                    thousands(faced)
                ));
            }
            if moved.planes > 0 && told == TOLD {
                more += 1;
                facets += moved.facets;
                most_m = most_m.max(moved.most_m);
            } else if moved.planes > 0 {
                told += 1;
                let (planes, it) = if moved.planes == 1 { ("plane", "it") } else { ("planes", "them") };
                lines.push(format!(
                    "object '{name}': {} of {all} facets lie in {} {planes}, their corners up to {:.2} mm off, and were moved into {it}; \
                     write the file with more digits, or nearer to its origin, if the object is flatter",
                    thousands(moved.facets),
                    thousands(moved.planes),
                    1e3 * moved.most_m
                ));
            }
        }
        if more > 0 {
            lines.push(format!(
                "{more} more objects: {} facets lie in planes, their corners up to {:.2} mm off, and were moved into them",
                thousands(facets),
                1e3 * most_m
            ));
        }
        lines
    }

    /// Which bodies' faces lie in the plane of a larger face of another body under them, or a little behind it as the radar sees it.
    fn lying(&self, radar_m: DVec3) -> Vec<Lying> {
        let bodies: Vec<&Faces> = self.placed.iter().map(|p| p.faces()).collect();
        let boxes: Vec<(usize, Bounds)> = bodies
            .iter()
            .enumerate()
            .filter_map(|(i, faces)| {
                let root = faces.nodes.first()?;
                let half = root.half + LIES_M;
                Some((i, (root.centre - half, root.centre + half)))
            })
            .collect();
        let mut by_x = boxes.clone();
        by_x.sort_by(|a, b| a.1.0.x.total_cmp(&b.1.0.x).then(a.0.cmp(&b.0)));
        let mut pairs = Vec::new();
        for (k, (i, own)) in by_x.iter().enumerate() {
            for (j, other) in by_x[k + 1..].iter().take_while(|(_, b)| b.0.x <= own.1.x) {
                if overlap(own, other) {
                    pairs.extend([(*i, *j), (*j, *i)]);
                }
            }
        }
        pairs.sort_unstable();
        let box_of: FastMap<usize, Bounds> = boxes.into_iter().collect();
        let mut list = Vec::new();
        for (body, on) in pairs {
            let (own, other) = (bodies[body], bodies[on]);
            let (mut faces, mut deepest_m) = (0, 0f64);
            let wall = |normal: DVec3, at: DVec3| HalfSpace { normal, offset: normal.dot(at) };
            let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z];
            let within = |(lo, hi): Bounds| {
                [wall(x, lo), wall(y, lo), wall(z, lo), wall(-x, hi), wall(-y, hi), wall(-z, hi)]
            };
            let mut near = Vec::new();
            own.within(&within(box_of[&on]), |i| near.push(i));
            near.sort_unstable();
            for face in near.iter().map(|i| &own.faces[*i as usize]) {
                let corners = own.corners(face);
                // What is never seen from the front hides nothing.
                if face.one_sided && face.normal.dot(radar_m - corners[0]) <= 0.0 {
                    continue;
                }
                let (lo, hi) = bounds(corners);
                let (lo, hi) = (lo - LIES_M, hi + LIES_M);
                if !overlap(&(lo, hi), &box_of[&on]) {
                    continue;
                }
                let smaller = |than: &Face| {
                    let area = |f: &Faces, face: &Face| f.patch_area_m2[face.patch as usize];
                    let (a, b) = (area(own, face), area(other, than));
                    a < b || (a == b && body < on)
                };
                let mut deepest = None;
                other.within_until(&within((lo, hi)), None, |i| {
                    let under = &other.faces[i as usize];
                    if smaller(under) {
                        deepest = depth_m(corners, (other, under), radar_m);
                    }
                    deepest.is_some()
                });
                if let Some(deep) = deepest {
                    faces += 1;
                    deepest_m = deepest_m.max(deep);
                }
            }
            if faces > 0 {
                list.push(Lying { body, on, faces, deepest_m });
            }
        }
        list
    }
}

/// How far the deepest of these corners is behind a face's plane, m, where all lie in it or a little behind it and some of what they
/// hold is over the face.
fn depth_m(corners: &[DVec3], (faces, face): (&Faces, &Face), radar_m: DVec3) -> Option<f64> {
    let height = |p: &DVec3| face.normal.dot(*p) - face.offset_m;
    let side = if height(&radar_m) < 0.0 { -1.0 } else { 1.0 };
    let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
    for h in corners.iter().map(|p| side * height(p)) {
        (lo, hi) = (lo.min(h), hi.max(h));
    }
    if lo < -LIES_M || hi > faces.flat_m {
        return None;
    }
    let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
    let mut inner = std::iter::once(middle).chain(corners.iter().map(|p| middle + (*p - middle) * 0.99));
    inner.any(|p| faces.is_over(face, p)).then_some(-lo.min(0.0))
}

/// A number with commas between thousands.
fn thousands(n: usize) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::frames::Pose;
    use crate::scene::{Mesh, material};

    /// A sheet of n x n quadrilaterals, `size_m` long, at a height and with noise across it.
    fn sheet(n: u32, size_m: f64, z_m: f64, noise_m: f64) -> Mesh {
        let mut rng = 11u64;
        let mut next = || {
            rng = rng.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            ((rng >> 11) as f64 / (1u64 << 52) as f64 - 1.0) * noise_m
        };
        let mut m = Mesh::default();
        for (i, j) in (0..=n).flat_map(|j| (0..=n).map(move |i| (i, j))) {
            let at = |i: u32| size_m * (f64::from(i) / f64::from(n) - 0.5);
            m.positions_m.push(DVec3::new(at(i), at(j), z_m + next()));
        }
        for (i, j) in (0..n).flat_map(|j| (0..n).map(move |i| (i, j))) {
            let a = j * (n + 1) + i;
            m.triangles.extend([[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]]);
            m.material.extend([0, 0]);
        }
        m
    }

    fn remarks(plate_z_m: f64, road_noise_m: f64, radar_z_m: f64) -> Vec<String> {
        let mut scene = Scene::default();
        scene.material_index(&material::by_name("steel").unwrap());
        scene.add_mesh("road", "road", sheet(20, 40.0, 0.0, road_noise_m), Pose::IDENTITY);
        scene.add_mesh("plate", "", sheet(1, 0.5, plate_z_m, 0.0), Pose::IDENTITY);
        let geometry = Geometry::of_frame(&scene, 0.0, 77e9, 0.0).unwrap();
        geometry.remarks(&scene, DVec3::new(-10.0, 0.0, radar_z_m))
    }

    #[test]
    fn what_lies_on_a_road_is_said_with_both_names() {
        for (z_m, radar_z_m) in [(0.0, 0.5), (-5e-5, 0.5), (-1.9e-4, 0.5), (5e-5, -0.5)] {
            let lines = remarks(z_m, 0.0, radar_z_m);
            assert!(lines.len() == 1, "{z_m} {lines:?}");
            let line = &lines[0];
            assert!(line.contains("'plate': 1 face lies") && line.contains("'road'"), "{line}");
        }
        for (z_m, radar_z_m) in [(1e-5, 0.5), (2e-3, 0.5), (-2.5e-4, 0.5), (-1e-5, -0.5)] {
            assert!(remarks(z_m, 0.0, radar_z_m).is_empty(), "{z_m}");
        }
    }

    #[test]
    fn corners_that_were_moved_are_said_with_their_number() {
        let lines = remarks(0.5, 1e-4, 0.5);
        assert!(lines.len() == 1, "{lines:?}");
        assert!(
            lines[0].starts_with("object 'road': 800 of 800 facets lie in 1 plane, their corners up to 0.1"),
            "{}",
            lines[0]
        );
        assert_eq!(
            (thousands(7), thousands(1234), thousands(1_234_567)),
            ("7".into(), "1,234".into(), "1,234,567".into())
        );
    }

    #[test]
    fn meshes_that_are_not_clean_are_said_with_the_objects_name() {
        let mut scene = Scene::default();
        scene.material_index(&material::by_name("steel").unwrap());
        let mut twice = sheet(2, 1.0, 0.0, 0.0);
        twice.triangles.extend_from_within(..);
        twice.material.extend_from_within(..);
        scene.add_mesh("sign", "", twice, Pose::IDENTITY);
        scene.add_mesh("clean", "", sheet(2, 1.0, 3.0, 0.0), Pose::IDENTITY);
        let geometry = Geometry::of_frame(&scene, 0.0, 77e9, 0.0).unwrap();
        let lines = geometry.remarks(&scene, DVec3::new(0.0, 0.0, 10.0));
        assert!(lines.len() == 1 && lines[0].starts_with("object 'sign': 8 of 16 triangles"), "{lines:?}");
        let Shape::Mesh(clean) = scene.objects[1].shape else { panic!("a mesh") };
        scene.meshes[clean].triangles.push([0, 0, 1]);
        scene.meshes[clean].material.push(0);
        let lines = of_meshes(&scene, 77e9).unwrap();
        assert!(
            lines.len() == 1 && lines[0].starts_with("object 'clean': 1 triangle has no area"),
            "{lines:?}"
        );
    }
}
