//! Which triangles of a mesh lie in one plane, however it is cut up and however roughly its file holds it (CONVENTIONS eq. 60a).
//!
//! Files hold places in f32, scanners and exporters leave a tenth of a millimetre of noise. Such a wall is one mirror to waves of
//! 4 mm, and a hundred facets that each look another way are none. Corners of what is one plane are moved into it; what bends is
//! left alone, however gently it does.

use super::hash::FastMap;
use super::patches::places;
use super::welded::{self, NO_PLANE};
use crate::scene::Mesh;
use glam::{DVec2, DVec3};
use std::collections::HashSet;

/// Noise that corners of a flat surface may have across it, m: 0.1 mm along each axis.
const NOISE_M: f64 = 2e-4;
/// Half a step of f32, as a share of the number.
const F32: f64 = 6e-8;
/// Corners so near to a plane are taken into it without asking whether the surface bends, m: λ/200 at 77 GHz.
const SMALL_M: f64 = 2e-5;
/// Facets that lean by less from their plane are too large for a bend to tell, rad.
const LEAN_RAD: f64 = 1e-3;
/// Slivers lean by anything: what leans tells of a bend only if it is more than this share of the area.
const LEANS: f64 = 0.01;
/// Corners of one place that f32 has parted are no farther apart, m, whatever its step.
const ONE_PLACE_M: f64 = 1e-4;
/// So few corners do not tell noise from a bend.
const FEW: usize = 24;
/// Corners nearer than this share of their shortest side may be one corner.
const SHARE: f64 = 0.02;
/// A side that shares its ends with fewer triangles than this ends the surface.
const BOTH: usize = 2;

/// A mesh with its planes.
pub(super) struct Planes {
    /// Plane of each triangle, or [`NO_PLANE`].
    pub(super) of: Vec<u32>,
    /// Whether each triangle is wound against most of its plane.
    pub(super) turned: Vec<bool>,
    /// How far the corners of each plane were off it, at most, m.
    pub(super) off_m: Vec<f64>,
    /// How far corners of each plane were moved into it or onto each other, at most, m.
    pub(super) moved_m: Vec<f64>,
    /// What f32 rounds at the mesh's largest coordinate, m.
    pub(super) rounding_m: f64,
    /// The mesh's vertices, those of planes in them, m.
    pub(super) positions_m: Vec<DVec3>,
}

/// The planes of a mesh. Triangles that are `curved` belong to none.
pub(super) fn find(mesh: &Mesh, curved: impl Fn(usize) -> bool) -> Planes {
    let mut of = vec![NO_PLANE; mesh.triangles.len()];
    let mut positions_m = mesh.positions_m.clone();
    if positions_m.iter().any(|p| !p.is_finite()) {
        let turned = vec![false; of.len()];
        return Planes { of, turned, off_m: Vec::new(), moved_m: Vec::new(), rounding_m: 0.0, positions_m };
    }
    let largest = positions_m.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
    let rounding_m = 3f64.sqrt() * F32 * largest;
    let joints = Joints::new(mesh, rounding_m, curved);
    let mut found: Vec<Plane> = Vec::new();
    let mut done = vec![false; of.len()];
    let mut turned = vec![false; of.len()];
    let mut met = [Met::new(mesh.positions_m.len()), Met::new(of.len())];
    for seed in joints.by_area() {
        if std::mem::replace(&mut done[seed as usize], true) {
            continue;
        }
        let (mut plane, members, against) = joints.grow(seed, &of, &mut met);
        members.iter().for_each(|t| done[*t as usize] = true);
        if members.len() > 1 && joints.is_flat(&plane, &members) {
            members.iter().for_each(|t| of[*t as usize] = found.len() as u32);
            let area = |t: &u32| joints.area_m2[*t as usize];
            let area_m2 = members.iter().map(area).sum();
            // Most of the plane knows its front best.
            let odd = members.iter().filter(|t| against.contains(t)).map(area).sum::<f64>() > 0.5 * area_m2;
            if odd {
                plane = Plane { normal: -plane.normal, offset_m: -plane.offset_m, ..plane };
            }
            if !against.is_empty() {
                members.iter().for_each(|t| turned[*t as usize] = against.contains(t) != odd);
            }
            found.push(Plane { area_m2, ..plane });
        }
    }
    let mut off_m = vec![0f64; found.len()];
    for (t, plane) in joints.triangles.iter().zip(&of).filter(|(_, plane)| **plane != NO_PLANE) {
        let (plane, off) = (&found[*plane as usize], &mut off_m[*plane as usize]);
        *off = t.iter().map(|v| plane.height(joints.at[*v as usize]).abs()).fold(*off, f64::max);
    }
    let moved = joints.moved(&found, &of);
    for (p, place) in positions_m.iter_mut().zip(&joints.place) {
        if let Some(to) = moved.get(place) {
            *p = *to;
        }
    }
    let mut moved_m = vec![0f64; found.len()];
    for (t, plane) in mesh.triangles.iter().zip(&of).filter(|(_, plane)| **plane != NO_PLANE) {
        let far = t.map(|v| mesh.positions_m[v as usize].distance(positions_m[v as usize]));
        let most = &mut moved_m[*plane as usize];
        *most = far.into_iter().fold(*most, f64::max);
    }
    Planes { of, turned, off_m, moved_m, rounding_m, positions_m }
}

/// Where `normal . r` is `offset_m`.
#[derive(Clone, Copy)]
struct Plane {
    normal: DVec3,
    offset_m: f64,
    area_m2: f64,
}

impl Plane {
    fn height(&self, p: DVec3) -> f64 {
        self.normal.dot(p) - self.offset_m
    }
}

/// Triangles with the places of their corners and what they touch.
struct Joints {
    tolerance_m: f64,
    /// Place of each vertex.
    place: Vec<u32>,
    /// Mean of the vertices that are one corner, m, for each place.
    at: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    material: Vec<u32>,
    normal: Vec<DVec3>,
    area_m2: Vec<f64>,
    /// Triangles at each side (smaller place first).
    sides: FastMap<(u32, u32), Vec<u32>>,
    /// Triangles that touch along a part of a side only.
    touching: FastMap<u32, Vec<u32>>,
    /// It takes part: it has an area and is not curved.
    counts: Vec<bool>,
    shortest_m: Vec<f64>,
}

fn sides(t: [u32; 3]) -> [(u32, u32); 3] {
    welded::sides(&t).map(|(a, b)| (a.min(b), a.max(b)))
}

/// Numbers that were met since the last call of `anew`.
struct Met {
    at: Vec<u32>,
    now: u32,
}

impl Met {
    fn new(count: usize) -> Met {
        Met { at: vec![0; count], now: 0 }
    }

    fn anew(&mut self) {
        self.now += 1;
    }

    fn has(&self, i: u32) -> bool {
        self.at[i as usize] == self.now
    }

    /// Whether it was not met before.
    fn add(&mut self, i: u32) -> bool {
        std::mem::replace(&mut self.at[i as usize], self.now) != self.now
    }
}

impl Joints {
    fn new(mesh: &Mesh, rounding_m: f64, curved: impl Fn(usize) -> bool) -> Joints {
        let tolerance_m = NOISE_M + rounding_m;
        let mut place = places(&mesh.positions_m);
        let mut at = mesh.positions_m.clone();
        let mut shortest_m = vec![f64::INFINITY; at.len()];
        for (a, b) in mesh.triangles.iter().flat_map(|t| sides(t.map(|v| place[v as usize]))) {
            let length = at[a as usize].distance(at[b as usize]);
            for v in [a, b].into_iter().filter(|_| length > 0.0) {
                shortest_m[v as usize] = shortest_m[v as usize].min(length);
            }
        }
        let one_place_m = (2.0 * rounding_m).min(ONE_PLACE_M);
        weld(&mut place, &mut at, &shortest_m, [2.0 * tolerance_m, one_place_m]);
        let triangles: Vec<[u32; 3]> = mesh.triangles.iter().map(|t| t.map(|v| place[v as usize])).collect();
        let cross: Vec<DVec3> = triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|v| at[v as usize]);
                (b - a).cross(c - a)
            })
            .collect();
        let counts: Vec<bool> =
            cross.iter().enumerate().map(|(t, n)| n.length() > 0.0 && !curved(t)).collect();
        let mut of_side: FastMap<(u32, u32), Vec<u32>> = FastMap::default();
        for (i, t) in triangles.iter().enumerate().filter(|(i, _)| counts[*i]) {
            sides(*t).into_iter().for_each(|side| of_side.entry(side).or_default().push(i as u32));
        }
        let mut joints = Joints {
            tolerance_m,
            place,
            at,
            triangles,
            material: mesh.material.clone(),
            normal: cross.iter().map(|n| n.normalize_or_zero()).collect(),
            area_m2: cross.iter().map(|n| 0.5 * n.length()).collect(),
            sides: of_side,
            touching: FastMap::default(),
            counts,
            shortest_m,
        };
        joints.touch();
        joints
    }

    /// Lists what touches where corners of some lie on open sides of others.
    fn touch(&mut self) {
        let mut open: Vec<((u32, u32), u32)> =
            self.sides.iter().filter(|(_, t)| t.len() < BOTH).map(|(side, t)| (*side, t[0])).collect();
        open.sort_unstable();
        if open.is_empty() {
            return;
        }
        let (lo, hi) = self.at.iter().fold((self.at[0], self.at[0]), |(lo, hi), p| (lo.min(*p), hi.max(*p)));
        let axis = (hi - lo).max_position();
        let along = |v: u32| self.at[v as usize][axis];
        // Places at which open sides end, with the triangles there.
        let mut ends: Vec<(u32, u32)> = open.iter().flat_map(|((a, b), t)| [(*a, *t), (*b, *t)]).collect();
        ends.sort_unstable_by(|x, y| along(x.0).total_cmp(&along(y.0)).then(x.cmp(y)));
        ends.dedup();
        let near = self.tolerance_m;
        let mut links: Vec<(u32, u32)> = Vec::new();
        for &((a, b), t) in &open {
            let (p, way) = (self.at[a as usize], self.at[b as usize] - self.at[a as usize]);
            let length = way.length();
            let (from, to) = (along(a).min(along(b)) - near, along(a).max(along(b)) + near);
            let first = ends.partition_point(|e| along(e.0) < from);
            for &(v, other) in ends[first..].iter().take_while(|e| along(e.0) <= to) {
                let d = self.at[v as usize] - p;
                let x = d.dot(way) / length;
                let inside = x > near && x < length - near && (d - way * (x / length)).length() <= near;
                if inside && other != t && v != a && v != b {
                    links.extend([(t, other), (other, t)]);
                }
            }
        }
        links.sort_unstable();
        links.dedup();
        links.into_iter().for_each(|(t, other)| self.touching.entry(t).or_default().push(other));
    }

    /// Triangles that count, the largest first.
    fn by_area(&self) -> Vec<u32> {
        let mut order: Vec<u32> =
            (0..self.triangles.len() as u32).filter(|t| self.counts[*t as usize]).collect();
        order.sort_by(|a, b| self.area_m2[*b as usize].total_cmp(&self.area_m2[*a as usize]).then(a.cmp(b)));
        order
    }

    fn neighbours(&self, t: u32) -> impl Iterator<Item = u32> + '_ {
        let over_sides = sides(self.triangles[t as usize]).into_iter().flat_map(|s| self.sides[&s].iter());
        over_sides.chain(self.touching.get(&t).into_iter().flatten()).copied().filter(move |u| *u != t)
    }

    /// Whether two triangles that share a side lie on either side of it, as in one sheet, and not one on the other, as in a fold.
    fn goes_on(&self, t: u32, u: u32) -> bool {
        let [t, u] = [t, u].map(|i| self.triangles[i as usize]);
        let apex = |of: [u32; 3], other: [u32; 3]| of.into_iter().find(|v| !other.contains(v));
        let ends: Vec<u32> = t.into_iter().filter(|v| u.contains(v)).collect();
        let (&[a, b], Some(p), Some(q)) = (&ends[..], apex(t, u), apex(u, t)) else { return false };
        // Where more meet than these two and their copies, two bodies may touch.
        let others = self.sides[&(a.min(b), a.max(b))].iter().map(|i| self.triangles[*i as usize]);
        if others.filter(|o| !o.contains(&p) && !o.contains(&q)).count() > 0 {
            return false;
        }
        let [a, b, p, q] = [a, b, p, q].map(|v| self.at[v as usize]);
        let way = b - a;
        let aside = |p: DVec3| (p - a) - way * ((p - a).dot(way) / way.length_squared());
        aside(p).dot(aside(q)) < 0.0
    }

    /// What lies in one plane about a triangle: the plane that fits best, the triangles, and those of them that are wound against it.
    /// Those that are `taken` stay out.
    fn grow(
        &self,
        seed: u32,
        taken: &[u32],
        [known, seen]: &mut [Met; 2],
    ) -> (Plane, Vec<u32>, HashSet<u32>) {
        let normal = self.normal[seed as usize];
        let corners = self.triangles[seed as usize].map(|v| self.at[v as usize]);
        let mut fit = Fit::new(corners.iter().sum::<DVec3>() / 3.0, normal);
        known.anew();
        seen.anew();
        let mut add = |fit: &mut Fit, t: u32| {
            for v in self.triangles[t as usize] {
                if known.add(v) {
                    fit.add(self.at[v as usize]);
                }
            }
        };
        add(&mut fit, seed);
        seen.add(seed);
        let mut members = vec![seed];
        let mut against = HashSet::new();
        let mut round = 0..1;
        while !round.is_empty() {
            let (slopes, middle, radius) = fit.solve();
            for i in round.clone() {
                for t in self.neighbours(members[i]) {
                    if self.material[t as usize] != self.material[seed as usize]
                        || taken[t as usize] != NO_PLANE
                        || seen.has(t)
                    {
                        continue;
                    }
                    let alike = self.normal[t as usize].dot(normal);
                    let is_turned = alike < -0.5 && self.goes_on(members[i], t);
                    if alike <= 0.5 && !is_turned {
                        continue;
                    }
                    // A small plane says little of what lies far from it.
                    let fits = self.triangles[t as usize].iter().all(|v| {
                        let (p, h) = fit.local(self.at[*v as usize]);
                        let reach = 1.0 + 2.0 * (p - middle).length() / (radius * fit.n.sqrt());
                        (h - slopes.z - slopes.truncate().dot(p)).abs() <= self.tolerance_m * reach
                    });
                    if fits {
                        seen.add(t);
                        members.push(t);
                        add(&mut fit, t);
                        if is_turned {
                            against.insert(t);
                        }
                    }
                }
            }
            round = round.end..members.len();
        }
        let plane = fit.plane();
        members.retain(|t| {
            let off = |v: &u32| plane.height(self.at[*v as usize]).abs();
            self.triangles[*t as usize].iter().all(|v| off(v) <= 1.5 * self.tolerance_m)
        });
        (plane, members, against)
    }

    /// Whether what is about a plane is flat but for noise, and no piece of what bends.
    fn is_flat(&self, plane: &Plane, members: &[u32]) -> bool {
        let mut corners: Vec<u32> = members.iter().flat_map(|t| self.triangles[*t as usize]).collect();
        corners.sort_unstable();
        corners.dedup();
        let heights: Vec<f64> = corners.iter().map(|v| plane.height(self.at[*v as usize])).collect();
        if heights.iter().all(|h| h.abs() <= SMALL_M) {
            return true;
        }
        let leans = |t: &&u32| self.normal[**t as usize].cross(plane.normal).length() > LEAN_RAD;
        let area = |t: &u32| self.area_m2[*t as usize];
        let leaning: f64 = members.iter().filter(leans).map(area).sum();
        if leaning <= LEANS * members.iter().map(area).sum::<f64>() {
            return true;
        }
        if corners.len() < FEW {
            return false;
        }
        // Of the heights' squares, what a paraboloid explains: nearly all of a bend, three parts in as many as there are corners of noise.
        let (t, b) = plane.normal.any_orthonormal_pair();
        let origin = self.at[corners[0] as usize];
        let places: Vec<DVec2> = corners
            .iter()
            .map(|v| self.at[*v as usize] - origin)
            .map(|d| DVec2::new(t.dot(d), b.dot(d)))
            .collect();
        let explained = paraboloid_share(&places, &heights);
        explained < 0.5 + 2.0 / (corners.len() as f64).sqrt()
    }

    /// Where corners of planes come to lie, by their places.
    fn moved(&self, planes: &[Plane], of: &[u32]) -> FastMap<u32, DVec3> {
        let mut on: FastMap<u32, Vec<u32>> = FastMap::default();
        for (t, plane) in self.triangles.iter().zip(of).filter(|(_, plane)| **plane != NO_PLANE) {
            for v in t {
                let list = on.entry(*v).or_default();
                if !list.contains(plane) {
                    list.push(*plane);
                }
            }
        }
        on.into_iter()
            .map(|(v, mut list)| {
                let area = |p: &u32| planes[*p as usize].area_m2;
                list.sort_by(|p, q| area(q).total_cmp(&area(p)).then(p.cmp(q)));
                let from = self.at[v as usize];
                let most = (4.0 * self.tolerance_m).max(SHARE * self.shortest_m[v as usize]);
                // Into the largest plane, then along it into the next, then along both.
                let (mut to, mut held) = (from, [DVec3::ZERO; 3]);
                let mut count = 0;
                for p in list.iter().map(|p| &planes[*p as usize]) {
                    let free = held.iter().fold(p.normal, |n, e| n - *e * e.dot(p.normal));
                    let square = free.length_squared();
                    let next = to - free * (p.height(to) / square);
                    // Along planes that hardly differ a corner would go far to get into both.
                    if count < 3 && square > LEAN_RAD * LEAN_RAD && next.distance(from) <= most {
                        to = next;
                        held[count] = free / square.sqrt();
                        count += 1;
                    }
                }
                (v, to)
            })
            .collect()
    }
}

/// Makes one what is nearer than `near_m` and much nearer than its sides are long, or nearer than `one_place_m`, in the middle between
/// them.
fn weld(place: &mut [u32], at: &mut [DVec3], shortest_m: &[f64], [near_m, one_place_m]: [f64; 2]) {
    let mut used: Vec<u32> = place.to_vec();
    used.sort_unstable();
    used.dedup();
    let cell = |p: DVec3| (p / near_m).floor().as_i64vec3();
    let mut grid: FastMap<[i64; 3], Vec<u32>> = FastMap::default();
    let mut parent: FastMap<u32, u32> = FastMap::default();
    let mut members: FastMap<u32, Vec<u32>> = FastMap::default();
    for v in used {
        let p = at[v as usize];
        let c = cell(p);
        let mut first = None;
        'all: for i in 0..27 {
            let key = [c.x + i % 3 - 1, c.y + i / 3 % 3 - 1, c.z + i / 9 - 1];
            for &u in grid.get(&key).into_iter().flatten() {
                let least = shortest_m[v as usize].min(shortest_m[u as usize]);
                if at[u as usize].distance(p) <= near_m.min(SHARE * least).max(one_place_m) {
                    first = Some(u);
                    break 'all;
                }
            }
        }
        match first {
            Some(u) => {
                parent.insert(v, u);
                members.entry(u).or_insert_with(|| vec![u]).push(v);
            }
            None => grid.entry(c.to_array()).or_default().push(v),
        }
    }
    for (u, list) in members {
        at[u as usize] = list.iter().map(|v| at[*v as usize]).sum::<DVec3>() / list.len() as f64;
    }
    for v in place {
        if let Some(u) = parent.get(v) {
            *v = *u;
        }
    }
}

/// Sums for a plane by least squares, in axes about a place of it.
struct Fit {
    origin: DVec3,
    axis: [DVec3; 3],
    n: f64,
    sum: DVec3,
    /// Sums of xx, yy, xy, xz and yz.
    square: [f64; 5],
}

impl Fit {
    fn new(origin: DVec3, normal: DVec3) -> Fit {
        let (t, b) = normal.any_orthonormal_pair();
        Fit { origin, axis: [t, b, normal], n: 0.0, sum: DVec3::ZERO, square: [0.0; 5] }
    }

    fn local(&self, p: DVec3) -> (DVec2, f64) {
        let d = p - self.origin;
        (DVec2::new(self.axis[0].dot(d), self.axis[1].dot(d)), self.axis[2].dot(d))
    }

    fn add(&mut self, p: DVec3) {
        let (q, h) = self.local(p);
        self.n += 1.0;
        self.sum += q.extend(h);
        for (s, x) in self.square.iter_mut().zip([q.x * q.x, q.y * q.y, q.x * q.y, q.x * h, q.y * h]) {
            *s += x;
        }
    }

    /// Slopes along both axes and height at the origin; the middle of the places, and their mean distance from it.
    fn solve(&self) -> (DVec3, DVec2, f64) {
        let mean = self.sum / self.n;
        let [xx, yy, xy, xz, yz] = self.square.map(|s| s / self.n);
        let (xx, yy, xy) = (xx - mean.x * mean.x, yy - mean.y * mean.y, xy - mean.x * mean.y);
        let (xz, yz) = (xz - mean.x * mean.z, yz - mean.y * mean.z);
        let det = xx * yy - xy * xy;
        // Places on one line say nothing of what is beside it.
        let slopes = match det > 1e-12 * (xx + yy) * (xx + yy) {
            true => DVec2::new(xz * yy - yz * xy, yz * xx - xz * xy) / det,
            false => DVec2::ZERO,
        };
        let middle = mean.truncate();
        (slopes.extend(mean.z - slopes.dot(middle)), middle, (xx + yy).sqrt().max(f64::MIN_POSITIVE))
    }

    fn plane(&self) -> Plane {
        let (slopes, ..) = self.solve();
        let normal = (self.axis[2] - self.axis[0] * slopes.x - self.axis[1] * slopes.y).normalize();
        let on = self.origin + self.axis[2] * slopes.z;
        Plane { normal, offset_m: normal.dot(on), area_m2: 0.0 }
    }
}

/// Share of the squares of heights that a paraboloid through the places explains, by least squares.
fn paraboloid_share(places: &[DVec2], heights: &[f64]) -> f64 {
    const N: usize = 6;
    let size = places.iter().map(|p| p.length()).fold(0.0, f64::max);
    let mut rows = [[0.0; N + 1]; N];
    let mut all = 0.0;
    let mean = heights.iter().sum::<f64>() / heights.len() as f64;
    let terms = |p: &DVec2| {
        let (x, y) = (p.x / size, p.y / size);
        [1.0, x, y, x * x, x * y, y * y]
    };
    for (p, h) in places.iter().zip(heights) {
        let (f, h) = (terms(p), h - mean);
        for (row, a) in rows.iter_mut().zip(f) {
            row.iter_mut().zip(f.iter().chain([&h])).for_each(|(sum, b)| *sum += a * b);
        }
        all += h * h;
    }
    let right = rows.map(|row| row[N]);
    // By Gauss; a term that the places do not tell apart is left out.
    for i in 0..N {
        let scale = rows[i][i];
        if scale <= 1e-9 * places.len() as f64 {
            rows[i] = [0.0; N + 1];
            continue;
        }
        rows[i].iter_mut().for_each(|x| *x /= scale);
        let pivot = rows[i];
        for (_, row) in rows.iter_mut().enumerate().filter(|(j, _)| *j != i) {
            let factor = row[i];
            row.iter_mut().zip(pivot).for_each(|(x, p)| *x -= factor * p);
        }
    }
    let explained: f64 = rows.iter().zip(right).map(|(row, r)| row[N] * r).sum();
    if all > 0.0 { explained / all } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// n x n quadrilaterals of `size`, at a height that depends on the place, turned out of all axes, in f32.
    fn grid(n: u32, size: f64, noise_m: f64, offset_m: f64, height: impl Fn(f64, f64) -> f64) -> Mesh {
        let turn = glam::DQuat::from_euler(glam::EulerRot::ZYX, 0.7, 0.3, -0.4);
        let mut rng = 7u64;
        let mut next = || {
            rng = rng.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            ((rng >> 11) as f64 / (1u64 << 52) as f64 - 1.0) * noise_m
        };
        let mut m = Mesh::default();
        for j in 0..=n {
            for i in 0..=n {
                let (x, y) = (size * f64::from(i), size * f64::from(j));
                let p = turn * DVec3::new(x, y, height(x, y)) + DVec3::new(offset_m, 0.0, 0.0);
                m.positions_m.push((p + DVec3::new(next(), next(), next())).as_vec3().as_dvec3());
            }
        }
        for (i, j) in (0..n).flat_map(|j| (0..n).map(move |i| (i, j))) {
            let a = j * (n + 1) + i;
            m.triangles.extend([[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]]);
            m.material.extend([0, 0]);
        }
        m
    }

    /// Number of planes, of triangles in one, and how far corners are off their triangles' planes at most.
    fn found(mesh: &Mesh) -> (usize, usize, f64) {
        let planes = find(mesh, |_| false);
        let count = planes.of.iter().filter(|p| **p != NO_PLANE).max().map_or(0, |p| *p as usize + 1);
        let mut off = 0f64;
        for plane in 0..count as u32 {
            let of_it: Vec<_> = mesh.triangles.iter().zip(&planes.of).filter(|(_, p)| **p == plane).collect();
            let [a, b, c] = of_it[0].0.map(|v| planes.positions_m[v as usize]);
            let normal = (b - a).cross(c - a).normalize();
            for v in of_it.iter().flat_map(|t| *t.0) {
                // Over all of it, by the first triangle's normal.
                let d = planes.positions_m[v as usize] - a;
                off = off.max((normal.dot(d) / d.length().max(1e-3)).abs());
            }
        }
        (count, planes.of.iter().filter(|p| **p != NO_PLANE).count(), off)
    }

    #[test]
    fn a_wall_is_one_plane_through_noise_and_rounding() {
        for (n, size) in [(1, 3.0), (2, 1.0), (10, 0.3), (60, 0.05)] {
            for (noise_m, offset_m) in [(0.0, 0.0), (0.0, 5000.0), (1e-4, 20.0), (1e-4, 5000.0)] {
                let mesh = grid(n, size, noise_m, offset_m, |_, _| 0.0);
                let (count, triangles, off) = found(&mesh);
                assert_eq!((count, triangles), (1, mesh.triangles.len()), "{n} {noise_m} {offset_m}");
                assert!(off < 1e-8, "{n} {noise_m} {offset_m}: {off}");
            }
        }
    }

    /// A roof of two planes, 1.4 degrees apart, as a road with a crown has.
    #[test]
    fn a_crown_parts_two_planes() {
        for noise_m in [0.0, 1e-4] {
            let mesh = grid(20, 0.35, noise_m, 300.0, |x, _| -0.025 * (x - 3.5).abs());
            let (count, triangles, _) = found(&mesh);
            assert!(count == 2 && triangles >= mesh.triangles.len() - 8, "{noise_m}: {count} {triangles}");
        }
    }

    /// What bends stays as it is: drums, domes, saddles, of facets that are small and smaller.
    #[test]
    fn what_bends_is_left_alone() {
        for (radius, size) in [(2.0, 0.01), (2.0, 0.03), (20.0, 0.05), (0.3, 0.005)] {
            let shapes: [&dyn Fn(f64, f64) -> f64; 3] = [
                &|x: f64, _: f64| 0.5 * x * x / radius,
                &|x: f64, y: f64| 0.5 * (x * x + y * y) / radius,
                &|x: f64, y: f64| 0.5 * (x * x - y * y) / radius,
            ];
            for (i, shape) in shapes.into_iter().enumerate() {
                let mesh = grid(40, size, 0.0, 0.0, shape);
                let planes = find(&mesh, |_| false);
                let most = mesh
                    .positions_m
                    .iter()
                    .zip(&planes.positions_m)
                    .map(|(a, b)| a.distance(*b))
                    .fold(0.0, f64::max);
                assert!(most <= 2.0 * SMALL_M, "radius {radius}, facets {size}, shape {i}: moved {most}");
            }
        }
    }

    #[test]
    fn curved_facets_and_broken_meshes_have_no_plane() {
        let mut mesh = grid(2, 1.0, 0.0, 0.0, |_, _| 0.0);
        let planes = find(&mesh, |t| t < 4);
        assert!(planes.of[..4].iter().all(|p| *p == NO_PLANE) && planes.of[4] == 0);
        mesh.positions_m[3].x = f64::NAN;
        assert!(find(&mesh, |_| false).of.iter().all(|p| *p == NO_PLANE));
        assert!(find(&Mesh::default(), |_| false).of.is_empty());
    }
}
