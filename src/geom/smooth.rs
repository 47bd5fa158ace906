//! Smooth surfaces as facets with normals at their corners: how the edges between them bend, where they are cut (CONVENTIONS eq. 55), and
//! how far they may.

use super::hash::FastMap;
use crate::base::error::{BadInput, Result};
use crate::scene::Mesh;
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::PI;

/// A mesh that needs more facets is refused.
pub const MOST_FACETS: usize = 8_000_000;
/// Cosine between a facet and the normal at its corner above which both are one: f32 of files.
const FLAT: f64 = 1.0 - 1e-8;
/// Cosine below which a normal says nothing about a facet (45 degrees): a box whose corners carry mean
/// normals is a box, and a cylinder of eight facets a cylinder.
const ASTRAY: f64 = std::f64::consts::FRAC_1_SQRT_2 - 1e-6;
/// Sine of the angle between normals below which they are one surface's.
const SMOOTH: f64 = 0.08;
/// Normals of a place nearer to one another than this are one.
const SAME: f64 = 1e-6;
/// The index of a flat facet's normals.
pub(super) const NONE: u32 = u32::MAX;

/// Of facets whose bend is part of their echoes, at 0.2 dB: greatest sagitta, m, for what hides, mirrors and has an outline is still
/// the facets; greatest turn of an edge, rad; and what the surface may move by, times the wavenumber.
const SAGITTA_M: f64 = 1e-2;
const TURN_RAD: f64 = 0.65;
const OFF: f64 = 0.1;
/// How much farther an edge has to run along the turn of its normals than along their sum for the plane of both to say how the normal in its
/// middle turns.
const STEEP: f64 = 4.0;
/// Sine of the angle between facets that are one plane.
const PLANE: f64 = 1e-7;

/// Limits on the bend of the edges of curved facets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limit {
    /// Greatest sagitta, m.
    pub sagitta_m: f64,
    /// Greatest angle between the normals at the ends of an edge, rad.
    pub turn_rad: f64,
    /// Largest distance of a quadratic surface over the edge from a circle's, m.
    pub off_m: f64,
    /// Edges shorter than this may turn as they like, m: normals that do not belong to one surface differ however short an edge is.
    pub short_m: f64,
}

impl Limit {
    /// The limit for facets that stand for the surface as if they were flat.
    pub fn flat(sagitta_m: f64) -> Limit {
        Limit { sagitta_m, turn_rad: PI, off_m: f64::INFINITY, short_m: 0.0 }
    }

    /// The limit for facets whose bend is part of their echoes, for an error that goes with `accuracy_db` (CONVENTIONS
    /// eq. 59).
    pub fn curved(accuracy_db: f64, wavenumber: f64) -> Limit {
        let share = accuracy_db / 0.2;
        Limit {
            sagitta_m: SAGITTA_M * share.sqrt(),
            turn_rad: TURN_RAD * share.powf(0.25).min(1.0),
            off_m: OFF * share / wavenumber,
            short_m: 1.0 / wavenumber,
        }
    }

    /// Twice as coarse, that many times.
    pub(super) fn coarser(self, times: i32) -> Limit {
        let (two, four) = (2f64.powi(times), 4f64.powi(times));
        Limit { sagitta_m: self.sagitta_m * four, off_m: self.off_m * two * four, ..self }
    }

    /// Whether an edge of `length_m` may have this sagitta.
    pub(super) fn allows(&self, sagitta_m: f64, length_m: f64) -> bool {
        // An arc's sagitta is a quarter of its chord times the sine of half its turn, and it is off its parabola by this at a quarter.
        let turn = 2.0 * (4.0 * sagitta_m / length_m).min(1.0).asin();
        let off_m = sagitta_m * turn * turn / 64.0;
        let turns_little = turn <= self.turn_rad && off_m <= self.off_m;
        sagitta_m <= self.sagitta_m && (turns_little || length_m < self.short_m)
    }
}

/// Whether a triangle stands for a curved surface.
pub(super) fn is_curved(mesh: &Mesh, t: usize) -> bool {
    let Some(normals) = mesh.corner_normals(t) else { return false };
    let [a, b, c] = mesh.triangles[t].map(|i| mesh.positions_m[i as usize]);
    let facet = (b - a).cross(c - a).normalize_or_zero();
    let cosines = normals.map(|n| n.dot(facet));
    let alike = |sign: f64| cosines.iter().all(|c| sign * c > ASTRAY);
    (alike(1.0) || alike(-1.0)) && !cosines.iter().all(|c| c.abs() > FLAT)
}

/// A triangle of a [`Surface`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Facet {
    pub(super) points: [u32; 3],
    /// [`NONE`] three times when flat.
    pub(super) normals: [u32; 3],
    pub(super) material: u32,
}

/// Corner or middle of an edge: its place and the smooth surface's normal there.
pub(super) type Vertex = (u32, u32);

/// Indices of the normals at both ends of an arc, and the arc.
type BetweenNormals = ([u32; 2], Arc);

impl Facet {
    pub(super) fn is_flat(&self) -> bool {
        self.normals[0] == NONE
    }

    pub(super) fn corner(&self, i: usize) -> Vertex {
        (self.points[i], self.normals[i])
    }
}

/// Facets, flat and curved, that share their corners.
pub(super) struct Surface {
    /// Each place once.
    pub(super) points: Vec<DVec3>,
    /// Each normal at a place once.
    pub(super) normals: Vec<DVec3>,
    pub(super) facets: Vec<Facet>,
}

/// How an edge of a smooth surface runs from its lower to its higher point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Arc {
    /// Height of its middle over the chord, along `up`.
    pub(super) height: f64,
    pub(super) up: DVec3,
    /// Bound of the distance from any point of the arc to the chord, m.
    pub(super) sagitta: f64,
    /// Normal in its middle.
    normal: DVec3,
}

impl Arc {
    /// The cubic through both ends at right angles to their normals (CONVENTIONS eq. 55). Its middle is
    /// exact on spheres and circular cylinders.
    pub(super) fn new(chord: DVec3, n: [DVec3; 2]) -> Arc {
        let sum = n[0] + n[1];
        let [a, b] = n.map(|n| chord.dot(n));
        let along = chord + 0.25 * (a * n[0] + b * n[1]);
        // The sum turns towards the cubic's right angles within the plane of both normals, so that a cylinder's stay across its generators.
        let turn = n[1] - n[0];
        let [up, on] = [sum, turn].map(|d| d.normalize_or_zero());
        let in_plane = up * along.dot(up) + on * along.dot(on);
        let way = if STEEP * along.dot(up).abs() <= along.dot(on).abs() { in_plane } else { along };
        let across = sum - way * (sum.dot(along) / way.dot(along).max(f64::MIN_POSITIVE));
        Arc {
            height: (b - a) / (4.0 + 2.0 * sum.length()),
            up,
            sagitta: 0.25 * a.abs().max(b.abs()),
            normal: across.try_normalize().unwrap_or(up),
        }
    }
}

impl Surface {
    pub(super) fn new(mesh: &Mesh, curved: &[bool]) -> Surface {
        let mut s = Surface { points: Vec::new(), normals: Vec::new(), facets: Vec::new() };
        let bits = |v: DVec3| (v + DVec3::ZERO).to_array().map(f64::to_bits);
        let mut places: FastMap<[u64; 3], u32> =
            FastMap::with_capacity_and_hasher(mesh.positions_m.len(), Default::default());
        let place: Vec<u32> = (mesh.positions_m.iter())
            .map(|p| {
                *places.entry(bits(*p)).or_insert_with(|| {
                    s.points.push(*p);
                    s.points.len() as u32 - 1
                })
            })
            .collect();
        // Rounding gives one normal of a surface other digits in each facet.
        let mut known: Vec<Vec<u32>> = vec![Vec::new(); s.points.len()];
        let normal: Vec<u32> = (mesh.normals.iter().zip(&place))
            .map(|(n, p)| {
                let (n, at) = (n.normalize_or_zero(), &mut known[*p as usize]);
                let same = at.iter().find(|i| s.normals[**i as usize].distance_squared(n) < SAME * SAME);
                same.copied().unwrap_or_else(|| {
                    s.normals.push(n);
                    let new = s.normals.len() as u32 - 1;
                    at.push(new);
                    new
                })
            })
            .collect();
        s.facets = (mesh.triangles.iter().zip(&mesh.material).zip(curved))
            .map(|((t, material), curved)| Facet {
                points: t.map(|i| place[i as usize]),
                normals: if *curved { t.map(|i| normal[i as usize]) } else { [NONE; 3] },
                material: *material,
            })
            .collect();
        s
    }

    pub(super) fn facet_normal(&self, f: &Facet) -> DVec3 {
        let [a, b, c] = f.points.map(|p| self.points[p as usize]);
        (b - a).cross(c - a).normalize_or_zero()
    }

    /// Whether two facets lie in one plane and look the same way.
    pub(super) fn are_one_plane(&self, f: &Facet, g: &Facet) -> bool {
        let (m, n) = (self.facet_normal(f), self.facet_normal(g));
        m.cross(n).length() < PLANE && m.dot(n) > 0.0
    }

    pub(super) fn arc(&self, (p, n): Vertex, (q, m): Vertex) -> Arc {
        let (chord, normals) = (self.points[q as usize] - self.points[p as usize], [n, m]);
        Arc::new(chord, normals.map(|n| self.normals[n as usize]))
    }

    /// Cuts edges until none bends by more than `limit` allows; an error once there are more than `most` facets.
    pub(super) fn cut_to(&mut self, limit: Limit, most: usize) -> Result<()> {
        while self.cut(limit) {
            if self.facets.len() > most {
                return Err(BadInput::new("the curved surfaces need too many facets")
                    .value(format!("a sagitta of {:.2e} m", limit.sagitta_m))
                    .allowed(format!("the accuracy of {most} facets"))
                    .remedy("allow a larger error, or remove the normals")
                    .into());
            }
        }
        Ok(())
    }

    /// Cuts every edge that bends too much once. False when there was none.
    fn cut(&mut self, limit: Limit) -> bool {
        let sides = self.sides();
        let mut middles = vec![(NONE, NONE); 3 * self.facets.len()];
        let mut any = false;
        for edge in sides.chunk_by(|a, b| a.0 == b.0) {
            any |= self.halve(edge, limit, &mut middles);
        }
        if !any {
            return false;
        }
        let mut new = Vec::with_capacity(2 * self.facets.len());
        for (i, f) in self.facets.iter().enumerate() {
            self.pieces(f, &middles[3 * i..3 * i + 3], |points: [Vertex; 3]| {
                let (points, normals) = (points.map(|v| v.0), points.map(|v| v.1));
                new.push(Facet { points, normals, material: f.material });
            });
        }
        self.facets = new;
        true
    }

    /// How the surfaces that meet in an edge bend there: the way of its middle, and the arcs by the normals at its ends.
    /// None where all of them are flat.
    pub(super) fn bulge(&self, edge: &[(u64, u32)]) -> Option<(DVec3, Vec<BetweenNormals>)> {
        let (mut flat, mut arcs) = (Vec::new(), Vec::<BetweenNormals>::new());
        for &(_, side) in edge {
            let f = &self.facets[side as usize / 3];
            let (a, b) = self.ends(side);
            if f.is_flat() {
                flat.push(side / 3);
            } else if !arcs.iter().any(|(n, _)| *n == [a.1, b.1]) {
                arcs.push(([a.1, b.1], self.arc(a, b)));
            }
        }
        if arcs.is_empty() {
            return None;
        }
        let mut wish = Wish::default();
        for f in flat {
            wish.keep(self.facet_normal(&self.facets[f as usize]));
        }
        let shift = wish.solve(arcs.iter().map(|(_, arc)| (arc.up, arc.height)));
        Some((shift, arcs))
    }

    /// Ends of a side, the one with the lower point first.
    fn ends(&self, side: u32) -> (Vertex, Vertex) {
        let (f, k) = (&self.facets[side as usize / 3], side as usize % 3);
        let (a, b) = (f.corner(k), f.corner((k + 1) % 3));
        if a.0 < b.0 { (a, b) } else { (b, a) }
    }

    /// Sides of facets, three times the facet's number and the corner's, with those of one edge side by side.
    pub(super) fn sides(&self) -> Vec<(u64, u32)> {
        let mut sides: Vec<(u64, u32)> = Vec::with_capacity(3 * self.facets.len());
        for (i, f) in self.facets.iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (f.points[k], f.points[(k + 1) % 3]);
                sides.push((u64::from(a.min(b)) << 32 | u64::from(a.max(b)), (3 * i + k) as u32));
            }
        }
        sides.par_sort_unstable();
        sides
    }

    /// Gives the edge with these sides a middle if it bends by more than `limit` allows.
    fn halve(&mut self, edge: &[(u64, u32)], limit: Limit, middles: &mut [Vertex]) -> bool {
        let Some((shift, arcs)) = self.bulge(edge) else { return false };
        let sagitta = arcs.iter().map(|(_, arc)| arc.sagitta).fold(shift.length(), f64::max);
        let key = edge[0].0;
        let [p, q] = [(key >> 32) as usize, (key & 0xffff_ffff) as usize].map(|i| self.points[i]);
        if limit.allows(sagitta, p.distance(q)) {
            return false;
        }
        let point = self.points.len() as u32;
        self.points.push(0.5 * (p + q) + shift);
        let first = self.normals.len() as u32;
        self.normals.extend(arcs.iter().map(|(_, arc)| arc.normal));
        for &(_, side) in edge {
            let (a, b) = self.ends(side);
            let arc = arcs.iter().position(|(n, _)| *n == [a.1, b.1]);
            middles[side as usize] = (point, arc.map_or(NONE, |i| first + i as u32));
        }
        true
    }

    /// What a facet falls into when its edges are cut in these middles.
    fn pieces(&self, f: &Facet, middles: &[Vertex], mut emit: impl FnMut([Vertex; 3])) {
        let corner = |i: usize| f.corner(i % 3);
        let middle = |i: usize| middles[i % 3];
        let is_cut = |i: usize| middle(i).0 != NONE;
        match (0..3).filter(|i| is_cut(*i)).count() {
            0 => emit([corner(0), corner(1), corner(2)]),
            1 => {
                let i = (0..3).find(|i| is_cut(*i)).unwrap_or(0);
                emit([corner(i), middle(i), corner(i + 2)]);
                emit([middle(i), corner(i + 1), corner(i + 2)]);
            }
            2 => {
                // The edge from corner(i) is whole; its triangle's other corner comes off.
                let i = (0..3).find(|i| !is_cut(*i)).unwrap_or(0);
                let quad = [corner(i), corner(i + 1), middle(i + 1), middle(i + 2)];
                emit([middle(i + 1), corner(i + 2), middle(i + 2)]);
                let at = |v: Vertex| self.points[v.0 as usize];
                let long = |a: usize, b: usize| at(quad[a]).distance_squared(at(quad[b]));
                if long(0, 2) <= long(1, 3) {
                    emit([quad[0], quad[1], quad[2]]);
                    emit([quad[0], quad[2], quad[3]]);
                } else {
                    emit([quad[0], quad[1], quad[3]]);
                    emit([quad[1], quad[2], quad[3]]);
                }
            }
            _ => {
                for i in 0..3 {
                    emit([corner(i), middle(i), middle(i + 2)]);
                }
                emit([middle(0), middle(1), middle(2)]);
            }
        }
    }

    /// Moves every corner outwards by the mean height of the surface over the facets around it
    /// (CONVENTIONS eq. 57), as inscribed facets lie too deep; flat facets stay in their planes.
    pub(super) fn raise_to_mean_height(&mut self) {
        let mut sums = vec![(0.0, 0.0); self.normals.len()];
        for f in self.facets.iter().filter(|f| !f.is_flat()) {
            let [a, b, c] = f.points.map(|p| self.points[p as usize]);
            let area = 0.5 * (b - a).cross(c - a).length();
            // A quadratic surface lies over its facet by the mean of what its edges bend.
            let mean = (0..3).map(|k| self.arc(f.corner(k), f.corner((k + 1) % 3)).height).sum::<f64>() / 3.0;
            for n in f.normals {
                sums[n as usize].0 += area * mean;
                sums[n as usize].1 += area;
            }
        }
        let mut wishes: Vec<Option<Wish>> = vec![None; self.points.len()];
        let mut smooth: Vec<Vertex> = Vec::with_capacity(self.normals.len());
        let mut done = vec![false; self.normals.len()];
        for f in self.facets.iter().filter(|f| !f.is_flat()) {
            for k in 0..3 {
                let (p, n) = f.corner(k);
                if !std::mem::replace(&mut done[n as usize], true) {
                    smooth.push((p, n));
                    wishes[p as usize] = Some(Wish::default());
                }
            }
        }
        for f in self.facets.iter().filter(|f| f.is_flat()) {
            let normal = self.facet_normal(f);
            for p in f.points {
                if let Some(wish) = &mut wishes[p as usize] {
                    wish.keep(normal);
                }
            }
        }
        smooth.sort_unstable();
        for at in smooth.chunk_by(|a, b| a.0 == b.0) {
            let p = at[0].0 as usize;
            let of = |n: u32| {
                let (height, area) = sums[n as usize];
                (self.normals[n as usize], if area > 0.0 { height / area } else { 0.0 })
            };
            if let Some(wish) = wishes[p].take() {
                let shift = wish.solve(at.iter().map(|v| of(v.1)));
                self.points[p] += shift;
            }
        }
    }

    pub(super) fn into_mesh(self) -> Mesh {
        let mut mesh = Mesh { material: self.facets.iter().map(|f| f.material).collect(), ..Mesh::default() };
        let mut flat = vec![NONE; self.points.len()];
        let mut smooth = vec![NONE; self.normals.len()];
        for f in &self.facets {
            mesh.triangles.push([0, 1, 2].map(|k| {
                let (p, n) = f.corner(k);
                let vertex = if n == NONE { &mut flat[p as usize] } else { &mut smooth[n as usize] };
                if *vertex == NONE {
                    *vertex = mesh.positions_m.len() as u32;
                    mesh.positions_m.push(self.points[p as usize]);
                    mesh.normals.push(self.normals.get(n as usize).copied().unwrap_or(DVec3::ZERO));
                }
                *vertex
            }));
        }
        mesh
    }
}

/// Where a point is to move: not at all across flat facets, and by given heights along the normals of
/// smooth surfaces. The shortest such way; normals that are almost alike are taken for one.
#[derive(Debug, Clone, Default)]
pub(super) struct Wish {
    basis: [DVec3; 3],
    n: usize,
}

impl Wish {
    /// The part of a direction that is still free.
    fn free(&self, d: DVec3) -> DVec3 {
        self.basis[..self.n].iter().fold(d, |d, b| d - *b * b.dot(d))
    }

    pub(super) fn keep(&mut self, normal: DVec3) {
        let free = self.free(normal);
        if self.n < 3 && free.length() > SMOOTH {
            self.basis[self.n] = free.normalize();
            self.n += 1;
        }
    }

    pub(super) fn solve(mut self, heights: impl Iterator<Item = (DVec3, f64)>) -> DVec3 {
        // Sum of normals, of heights, and their number.
        let mut alike: Vec<(DVec3, f64, f64)> = Vec::new();
        for (n, h) in heights {
            let near = |c: &&mut (DVec3, f64, f64)| c.0.cross(n).length() <= SMOOTH * c.0.length();
            match alike.iter_mut().find(near) {
                // The back of a sheet sees the same shift from the other side.
                Some(c) if c.0.dot(n) < 0.0 => *c = (c.0 - n, c.1 - h, c.2 + 1.0),
                Some(c) => *c = (c.0 + n, c.1 + h, c.2 + 1.0),
                None => alike.push((n, h, 1.0)),
            }
        }
        let mut shift = DVec3::ZERO;
        for (n, h, count) in alike {
            let (n, h) = (n.normalize_or_zero(), h / count);
            let free = self.free(n);
            if self.n < 3 && free.length() > SMOOTH {
                shift += free * ((h - n.dot(shift)) / free.length_squared());
                self.basis[self.n] = free.normalize();
                self.n += 1;
            }
        }
        shift
    }
}
