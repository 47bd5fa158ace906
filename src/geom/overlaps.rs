//! Bare metal that is there twice: triangles that lie in one place, or in one plane over one another, in one object or in several. Physical
//! optics counts every face that a wave meets, so each such place would return twice.

use crate::scene::{Material, Mesh, Scene, Shape};
use glam::{DVec2, DVec3};
use std::borrow::Cow;
use std::collections::HashMap;

/// Corners within so much of a plane lie in it, and corners nearer to one another are one, m.
const NEAR_M: f64 = 2e-6;
/// Planes are sorted into cells of so much in each component of their normals, and of so many metres.
const CELL: f64 = 1e-2;
const CELL_M: f64 = 1e-3;
/// Normals of one plane differ by less: small triangles of files in f32.
const ONE_PLANE: f64 = 1e-4;
/// What is left of a triangle below this share of it is nothing.
const SLIVER: f64 = 1e-9;

/// What was taken out of one object.
#[derive(Debug, Clone, PartialEq)]
pub struct Doubled {
    /// Index of the object.
    pub object: usize,
    /// Index of the first other object on whose metal it lies; its own where it lies on itself.
    pub on: usize,
    /// Triangles of which all or a part was taken out.
    pub triangles: usize,
    /// Area that was taken out, m².
    pub area_m2: f64,
}

impl Doubled {
    /// One line.
    pub fn line(&self, scene: &Scene) -> String {
        let name = |i: usize| scene.objects.get(i).map_or("", |o| o.name.as_str());
        let on = match self.on == self.object {
            true => "itself".to_string(),
            false => format!("object '{}'", name(self.on)),
        };
        format!(
            "object '{}': {} triangles lie on the metal of {on}, {:.3e} m2 of them; the same metal counts once",
            name(self.object),
            self.triangles,
            self.area_m2
        )
    }
}

struct Flat {
    object: u32,
    /// In its object's mesh.
    triangle: u32,
    corners: [DVec3; 3],
    normal: DVec3,
    is_curved: bool,
}

/// The scene at time zero with bare metal that lies on other bare metal taken out of the later of the two, and what that was. A scene
/// without such comes back as it is.
pub fn without_doubles(scene: &Scene) -> (Cow<'_, Scene>, Vec<Doubled>) {
    let bare = |m: &Material| {
        !m.is_dielectric() && m.layers.is_empty() && m.roughness_rms_m == 0.0 && m.backscatter.is_none()
    };
    let bare: Vec<bool> = scene.materials.iter().map(bare).collect();
    let mut all: Vec<Flat> = Vec::new();
    for (number, o) in scene.objects.iter().enumerate().filter(|(_, o)| o.radar) {
        let Shape::Mesh(m) = o.shape else { continue };
        let mesh = &scene.meshes[m];
        for (t, abc) in mesh.triangles.iter().enumerate() {
            if !bare.get(mesh.material[t] as usize).copied().unwrap_or(false) {
                continue;
            }
            let corners = abc.map(|i| o.pose.point(mesh.positions_m[i as usize]));
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
            if normal != DVec3::ZERO && corners.iter().all(|p| p.is_finite()) {
                let is_curved = mesh.corner_normals(t).is_some();
                all.push(Flat { object: number as u32, triangle: t as u32, corners, normal, is_curved });
            }
        }
    }
    // What is left of a triangle, as polygons in the world; None is all of it.
    let mut left: HashMap<usize, (Vec<Vec<DVec3>>, usize)> = HashMap::new();
    copies(&all, &mut left);
    overlaps(&all, &mut left);
    if left.is_empty() {
        return (Cow::Borrowed(scene), Vec::new());
    }
    taken_out(scene, &all, left)
}

/// Triangles with the corners of an earlier one.
fn copies(all: &[Flat], left: &mut HashMap<usize, (Vec<Vec<DVec3>>, usize)>) {
    let mut places: HashMap<[i64; 3], Vec<(DVec3, u32)>> = HashMap::new();
    let mut count = 0;
    let mut place = |p: DVec3| {
        let cell = |q: DVec3| (q / (8.0 * NEAR_M)).floor().to_array().map(|x| x as i64);
        let (first, last) = (cell(p - NEAR_M), cell(p + NEAR_M));
        for x in first[0]..=last[0] {
            for y in first[1]..=last[1] {
                for z in first[2]..=last[2] {
                    let known = places.get(&[x, y, z]).into_iter().flatten();
                    if let Some((_, number)) = known.copied().find(|(q, _)| q.distance(p) <= NEAR_M) {
                        return number;
                    }
                }
            }
        }
        count += 1;
        places.entry(cell(p)).or_default().push((p, count));
        count
    };
    let mut known: HashMap<[u32; 3], usize> = HashMap::with_capacity(all.len());
    for (i, t) in all.iter().enumerate() {
        let mut key = t.corners.map(&mut place);
        key.sort_unstable();
        // A triangle smaller than the tolerance has no three places.
        if key[0] == key[1] || key[1] == key[2] {
            continue;
        }
        let first = *known.entry(key).or_insert(i);
        if first != i {
            left.insert(i, (Vec::new(), first));
        }
    }
}

/// Flat triangles that lie over an earlier one in its plane.
fn overlaps(all: &[Flat], left: &mut HashMap<usize, (Vec<Vec<DVec3>>, usize)>) {
    let middle = all.iter().map(|t| t.corners[0]).sum::<DVec3>() / all.len().max(1) as f64;
    // One sign for both sides of a plane.
    let upright = |n: DVec3| {
        let lead = n.to_array().into_iter().find(|x| x.abs() > 0.5).unwrap_or(1.0);
        n * lead.signum()
    };
    let cell = |n: DVec3, offset: f64| {
        [n.x / CELL, n.y / CELL, n.z / CELL, offset / CELL_M].map(|x| x.floor() as i64)
    };
    let mut planes: HashMap<[i64; 4], Vec<usize>> = HashMap::new();
    let candidates = |i: &usize| !all[*i].is_curved && !left.contains_key(i);
    for i in (0..all.len()).filter(candidates) {
        let t = &all[i];
        let n = upright(t.normal);
        let offset = n.dot(t.corners[0] - middle);
        let reach = (t.corners[0] - middle).length() * ONE_PLANE + NEAR_M;
        let (lo, hi) = (cell(n - ONE_PLANE, offset - reach), cell(n + ONE_PLANE, offset + reach));
        // Into every cell that it may share with others of its plane: few, as cells are wide.
        for a in lo[0]..=hi[0] {
            for b in lo[1]..=hi[1] {
                for c in lo[2]..=hi[2] {
                    for d in lo[3]..=hi[3] {
                        planes.entry([a, b, c, d]).or_default().push(i);
                    }
                }
            }
        }
    }
    let mut pairs: Vec<(usize, usize)> = planes.values().flat_map(|list| pairs_over(all, list)).collect();
    // By the later of the two.
    pairs.sort_unstable_by_key(|(first, later)| (*later, *first));
    pairs.dedup();
    for of_one in pairs.chunk_by(|a, b| a.1 == b.1) {
        let later = of_one[0].1;
        let whole = area(&[all[later].corners.to_vec()]);
        let (mut rest, mut on) = (vec![all[later].corners.to_vec()], None);
        for (first, _) in of_one {
            let cut: Vec<Vec<DVec3>> = rest.iter().flat_map(|p| outside(p, &all[*first])).collect();
            if area(&cut) < area(&rest) - SLIVER * whole {
                on.get_or_insert(*first);
                rest = cut;
            }
        }
        if let Some(on) = on {
            rest.retain(|p| area(std::slice::from_ref(p)) > SLIVER * whole);
            left.insert(later, (rest, on));
        }
    }
}

/// Pairs (earlier, later) of a list that lie in one plane and whose bounds overlap.
fn pairs_over(all: &[Flat], list: &[usize]) -> Vec<(usize, usize)> {
    if list.len() < 2 {
        return Vec::new();
    }
    let axis = all[list[0]].normal.abs();
    let flat = |p: DVec3| match axis.max_element() {
        m if m == axis.x => DVec2::new(p.y, p.z),
        m if m == axis.y => DVec2::new(p.x, p.z),
        _ => DVec2::new(p.x, p.y),
    };
    let mut boxes: Vec<(DVec2, DVec2, usize)> = list
        .iter()
        .map(|i| {
            let [a, b, c] = all[*i].corners.map(flat);
            (a.min(b).min(c), a.max(b).max(c), *i)
        })
        .collect();
    boxes.sort_by(|a, b| a.0.x.total_cmp(&b.0.x).then(a.2.cmp(&b.2)));
    let mut pairs = Vec::new();
    for (k, (lo, hi, i)) in boxes.iter().enumerate() {
        for (lo2, hi2, j) in boxes[k + 1..].iter().take_while(|b| b.0.x < hi.x - NEAR_M) {
            if lo2.y >= hi.y - NEAR_M || hi2.y <= lo.y + NEAR_M {
                continue;
            }
            let (s, t) = (&all[*i], &all[*j]);
            let in_plane = |of: &Flat, p: &DVec3| of.normal.dot(*p - of.corners[0]).abs() <= NEAR_M;
            if s.normal.cross(t.normal).length() <= ONE_PLANE
                && t.corners.iter().all(|p| in_plane(s, p))
                && s.corners.iter().all(|p| in_plane(t, p))
                && shares_area(s, t)
            {
                pairs.push((*i.min(j), *i.max(j)));
            }
        }
    }
    pairs
}

/// Whether no edge of either has all of the other outside.
fn shares_area(s: &Flat, t: &Flat) -> bool {
    let apart = |a: &Flat, b: &Flat| {
        sides(a).iter().any(|(at, out)| b.corners.iter().all(|p| out.dot(*p - *at) >= -NEAR_M))
    };
    !apart(s, t) && !apart(t, s)
}

/// Each side of a triangle: a corner, and the unit vector in its plane that points out.
fn sides(t: &Flat) -> [(DVec3, DVec3); 3] {
    [0, 1, 2].map(|k| {
        let (a, b) = (t.corners[k], t.corners[(k + 1) % 3]);
        (a, (b - a).cross(t.normal).normalize_or_zero())
    })
}

/// The parts of a convex polygon outside a triangle, each convex.
fn outside(polygon: &[DVec3], t: &Flat) -> Vec<Vec<DVec3>> {
    let mut rest = polygon.to_vec();
    let mut parts = Vec::new();
    for (at, out) in sides(t) {
        let height = |p: DVec3| out.dot(p - at);
        let part = half(&rest, &height);
        if part.len() >= 3 {
            parts.push(part);
        }
        rest = half(&rest, &|p| -height(p));
        if rest.len() < 3 {
            break;
        }
    }
    parts
}

/// The part of a convex polygon where `height` is not negative.
fn half(polygon: &[DVec3], height: &dyn Fn(DVec3) -> f64) -> Vec<DVec3> {
    let mut out = Vec::with_capacity(polygon.len() + 1);
    for (k, p) in polygon.iter().enumerate() {
        let q = polygon[(k + 1) % polygon.len()];
        let (a, b) = (height(*p), height(q));
        if a >= 0.0 {
            out.push(*p);
        }
        if (a > 0.0 && b < 0.0) || (a < 0.0 && b > 0.0) {
            out.push(*p + (q - *p) * (a / (a - b)));
        }
    }
    out
}

fn area(polygons: &[Vec<DVec3>]) -> f64 {
    let one = |p: &Vec<DVec3>| match p.len() {
        0..3 => 0.0,
        n => 0.5 * (1..n - 1).map(|i| (p[i] - p[0]).cross(p[i + 1] - p[0])).sum::<DVec3>().length(),
    };
    polygons.iter().map(one).sum()
}

fn taken_out<'a>(
    scene: &'a Scene,
    all: &[Flat],
    left: HashMap<usize, (Vec<Vec<DVec3>>, usize)>,
) -> (Cow<'a, Scene>, Vec<Doubled>) {
    let mut numbers: Vec<usize> = left.keys().copied().collect();
    numbers.sort_unstable();
    let mut new = scene.clone();
    let mut doubled = Vec::new();
    for of_object in numbers.chunk_by(|a, b| all[*a].object == all[*b].object) {
        let object = all[of_object[0]].object as usize;
        let Shape::Mesh(m) = scene.objects[object].shape else { continue };
        let (old, pose) = (&scene.meshes[m], &scene.objects[object].pose);
        let gone: Vec<bool> = {
            let mut gone = vec![false; old.triangles.len()];
            of_object.iter().for_each(|i| gone[all[*i].triangle as usize] = true);
            gone
        };
        let stays = |t: &usize| !gone[*t];
        let mut mesh = Mesh {
            positions_m: old.positions_m.clone(),
            normals: old.normals.clone(),
            triangles: (0..gone.len()).filter(stays).map(|t| old.triangles[t]).collect(),
            material: (0..gone.len()).filter(stays).map(|t| old.material[t]).collect(),
        };
        let back = pose.inverse();
        let mut area_m2 = 0.0;
        for i in of_object {
            let (parts, _) = &left[i];
            area_m2 += area(&[all[*i].corners.to_vec()]) - area(parts);
            for part in parts {
                let first = mesh.positions_m.len() as u32;
                mesh.positions_m.extend(part.iter().map(|p| back.point(*p)));
                for k in 1..part.len() as u32 - 1 {
                    mesh.triangles.push([first, first + k, first + k + 1]);
                    mesh.material.push(old.material[all[*i].triangle as usize]);
                }
            }
        }
        if !mesh.normals.is_empty() {
            mesh.normals.resize(mesh.positions_m.len(), DVec3::ZERO);
        }
        let on = of_object.iter().map(|i| all[left[i].1].object as usize);
        let on = on.clone().find(|on| *on != object).unwrap_or(object);
        doubled.push(Doubled { object, on, triangles: of_object.len(), area_m2 });
        if mesh.triangles.is_empty() {
            new.objects[object].radar = false;
            continue;
        }
        new.meshes.push(mesh);
        new.objects[object].shape = Shape::Mesh(new.meshes.len() - 1);
    }
    (Cow::Owned(new), doubled)
}
