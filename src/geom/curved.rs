//! Curved surfaces for exact beams: facets with smooth normals are cut finer until their edges bend by no
//! more than is asked for (CONVENTIONS eq. 55-57).
//!
//! Whether and where an edge is cut depends on nothing but what meets in the edge, so that neighbours agree
//! and no crack opens. Neighbours that share places and normals at both ends of their edge are one smooth
//! surface; where the normals differ the edge is a crease, and stays one: its new points lie on both
//! surfaces. Facets that are flat and touch a curved one are cut in their plane.

use crate::error::{BadInput, Error, Result};
use crate::geom::hash::FastMap;
use crate::scene::{Mesh, Scene, Shape};
use glam::DVec3;
use rayon::prelude::*;
use std::borrow::Cow;

/// Greatest phase 2 k s, rad, of an edge with sagitta s for an error of 0.1 dB: what the worst of 50 directions
/// has on spheres of ka 40 to 160. Facets are a grating, whose orders interfere with the echo to first order in
/// this phase.
const TAU_AT_TENTH_DB: f64 = 0.025;
/// A mesh that needs more facets is refused.
pub const MOST_FACETS: usize = 8_000_000;
/// Cosine between a facet and the normal at its corner above which both are one: f32 of files.
const FLAT: f64 = 1.0 - 1e-8;
/// Cosine below which a normal says nothing about a facet (45 degrees): a box whose corners carry mean
/// normals is a box, and a cylinder of eight facets a cylinder.
const ASTRAY: f64 = std::f64::consts::FRAC_1_SQRT_2 - 1e-6;
/// Sine of the angle between normals below which they are one surface's.
const SMOOTH: f64 = 0.08;
/// The index of a flat facet's normals.
const NONE: u32 = u32::MAX;

/// Greatest sagitta of an edge, m, for an error of `accuracy_db`, which goes with it (CONVENTIONS eq. 56).
pub fn sagitta_m(accuracy_db: f64, wavenumber: f64) -> f64 {
    TAU_AT_TENTH_DB * accuracy_db / 0.1 / (2.0 * wavenumber)
}

/// Coarsest cut that is tried, m: facets of some centimetres on the curves of a car.
const COARSEST_M: f64 = 4e-3;

/// [`refined_scene`], or cut more coarsely where that gives more than `most` triangles in all: by the finest of the
/// sagittas that are `sagitta_m` times a power of two, or not at all.
///
/// # Errors
/// Those of [`refined`].
pub fn refined_within(scene: &Scene, sagitta_m: f64, most: usize) -> Result<Cow<'_, Scene>> {
    if !scene.meshes.iter().any(|m| m.is_smooth()) {
        return Ok(Cow::Borrowed(scene));
    }
    let steps = (COARSEST_M / sagitta_m).log2().ceil().max(0.0) as i32;
    let mut best = Cow::Borrowed(scene);
    for step in (0..=steps).rev() {
        let finer = refined_scene(scene, sagitta_m * 2f64.powi(step))?;
        if finer.triangle_count() > most {
            break;
        }
        best = finer;
    }
    Ok(best)
}

/// The scene with its curved meshes cut until no edge bends by more than `sagitta_m`, and moved to the mean
/// height of the surface. A scene without curved facets comes back as it is.
///
/// # Errors
/// Those of [`refined`].
pub fn refined_scene(scene: &Scene, sagitta_m: f64) -> Result<Cow<'_, Scene>> {
    let mut new = Vec::new();
    for (i, mesh) in scene.meshes.iter().enumerate() {
        let name = || {
            let owner = scene.objects.iter().find(|o| o.shape == Shape::Mesh(i));
            owner.map_or(format!("mesh {i}"), |o| format!("object '{}'", o.name))
        };
        let named = |e| match e {
            Error::Input(bad) => bad.key(name()).into(),
            e => e,
        };
        if let Some(mesh) = refined(mesh, sagitta_m).map_err(named)? {
            new.push((i, mesh));
        }
    }
    if new.is_empty() {
        return Ok(Cow::Borrowed(scene));
    }
    let mut scene = scene.clone();
    for (i, mesh) in new {
        scene.meshes[i] = mesh;
    }
    Ok(Cow::Owned(scene))
}

/// The mesh cut until no edge bends by more than `sagitta_m`; None when no facet is curved.
///
/// A facet is curved when its three corners have normals, not all of them its own, and each within 45
/// degrees of it (or each within 45 degrees of its back); else it is flat.
///
/// # Errors
/// Another number of normals than of positions; a normal that is neither a unit vector nor zero; more than
/// [`MOST_FACETS`] facets.
pub fn refined(mesh: &Mesh, sagitta_m: f64) -> Result<Option<Mesh>> {
    if mesh.normals.is_empty() {
        return Ok(None);
    }
    if mesh.normals.len() != mesh.positions_m.len() {
        return Err(BadInput::new("not every vertex has a normal")
            .value(format!("{} normals", mesh.normals.len()))
            .allowed(format!("none, or {}, one for each vertex", mesh.positions_m.len()))
            .remedy("repair the mesh")
            .into());
    }
    let unit = |n: &DVec3| *n == DVec3::ZERO || (n.length_squared() - 1.0).abs() < 2e-3;
    if let Some(bad) = mesh.normals.iter().position(|n| !unit(n)) {
        return Err(BadInput::new(format!("the normal of vertex {bad} has no direction"))
            .value(mesh.normals[bad])
            .allowed("a unit vector, or zero where the facets are flat")
            .remedy("repair the mesh")
            .into());
    }
    let curved: Vec<bool> = (0..mesh.triangles.len()).map(|t| is_curved(mesh, t)).collect();
    if !curved.contains(&true) {
        return Ok(None);
    }
    let mut surface = Surface::new(mesh, &curved);
    while surface.cut(sagitta_m) {
        if surface.facets.len() > MOST_FACETS {
            return Err(BadInput::new("its curved surfaces need too many facets")
                .value(format!("a sagitta of {sagitta_m:.2e} m"))
                .allowed(format!("what {MOST_FACETS} facets can give"))
                .remedy("allow a larger error, or leave out the normals")
                .into());
        }
    }
    surface.raise_to_mean_height();
    Ok(Some(surface.into_mesh()))
}

/// Whether any facet of the mesh is curved, as [`refined`] has it.
pub fn has_curved(mesh: &Mesh) -> bool {
    !mesh.normals.is_empty() && (0..mesh.triangles.len()).any(|t| is_curved(mesh, t))
}

fn is_curved(mesh: &Mesh, t: usize) -> bool {
    let Some(normals) = mesh.corner_normals(t) else { return false };
    let [a, b, c] = mesh.triangles[t].map(|i| mesh.positions_m[i as usize]);
    let facet = (b - a).cross(c - a).normalize_or_zero();
    let cosines = normals.map(|n| n.dot(facet));
    let alike = |sign: f64| cosines.iter().all(|c| sign * c > ASTRAY);
    (alike(1.0) || alike(-1.0)) && !cosines.iter().all(|c| c.abs() > FLAT)
}

#[derive(Debug, Clone, Copy)]
struct Facet {
    points: [u32; 3],
    /// [`NONE`] three times when flat.
    normals: [u32; 3],
    material: u32,
}

/// Corner or middle of an edge: its place and the smooth surface's normal there.
type Vertex = (u32, u32);

impl Facet {
    fn is_flat(&self) -> bool {
        self.normals[0] == NONE
    }

    fn corner(&self, i: usize) -> Vertex {
        (self.points[i], self.normals[i])
    }
}

struct Surface {
    /// Each place once.
    points: Vec<DVec3>,
    /// Each normal at a place once.
    normals: Vec<DVec3>,
    facets: Vec<Facet>,
}

/// How an edge of a smooth surface runs from its lower to its higher point.
#[derive(Debug, Clone, Copy)]
struct Arc {
    /// Height of its middle over the chord, along `up`.
    height: f64,
    up: DVec3,
    /// At least what any point of it lies off the chord.
    sagitta: f64,
    /// Normal in its middle.
    normal: DVec3,
}

impl Arc {
    /// The cubic through both ends at right angles to their normals (CONVENTIONS eq. 55). Its middle is
    /// exact on spheres and circular cylinders.
    fn new(chord: DVec3, n: [DVec3; 2]) -> Arc {
        let sum = n[0] + n[1];
        let [a, b] = n.map(|n| chord.dot(n));
        let along = chord + 0.25 * (a * n[0] + b * n[1]);
        let across = sum - along * (sum.dot(along) / along.length_squared());
        let up = sum.normalize_or_zero();
        Arc {
            height: (b - a) / (4.0 + 2.0 * sum.length()),
            up,
            sagitta: 0.25 * a.abs().max(b.abs()),
            normal: across.try_normalize().unwrap_or(up),
        }
    }
}

impl Surface {
    fn new(mesh: &Mesh, curved: &[bool]) -> Surface {
        let mut s = Surface { points: Vec::new(), normals: Vec::new(), facets: Vec::new() };
        let bits = |v: DVec3| (v + DVec3::ZERO).to_array().map(f64::to_bits);
        let mut places: FastMap<[u64; 3], u32> =
            FastMap::with_capacity_and_hasher(mesh.positions_m.len(), Default::default());
        let mut known: FastMap<(u32, [u64; 3]), u32> =
            FastMap::with_capacity_and_hasher(mesh.positions_m.len(), Default::default());
        let place: Vec<u32> = (mesh.positions_m.iter())
            .map(|p| {
                *places.entry(bits(*p)).or_insert_with(|| {
                    s.points.push(*p);
                    s.points.len() as u32 - 1
                })
            })
            .collect();
        let normal: Vec<u32> = (mesh.normals.iter().zip(&place))
            .map(|(n, p)| {
                *known.entry((*p, bits(*n))).or_insert_with(|| {
                    s.normals.push(n.normalize_or_zero());
                    s.normals.len() as u32 - 1
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

    fn facet_normal(&self, f: &Facet) -> DVec3 {
        let [a, b, c] = f.points.map(|p| self.points[p as usize]);
        (b - a).cross(c - a).normalize_or_zero()
    }

    fn arc(&self, (p, n): Vertex, (q, m): Vertex) -> Arc {
        let (chord, normals) = (self.points[q as usize] - self.points[p as usize], [n, m]);
        Arc::new(chord, normals.map(|n| self.normals[n as usize]))
    }

    /// Cuts every edge that bends too much once. False when there was none.
    fn cut(&mut self, sagitta_m: f64) -> bool {
        // Edges by their points; each side of a facet is three times its number and the corner's.
        let mut sides: Vec<(u64, u32)> = Vec::with_capacity(3 * self.facets.len());
        for (i, f) in self.facets.iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (f.points[k], f.points[(k + 1) % 3]);
                sides.push((u64::from(a.min(b)) << 32 | u64::from(a.max(b)), (3 * i + k) as u32));
            }
        }
        sides.par_sort_unstable();
        let mut middles = vec![(NONE, NONE); 3 * self.facets.len()];
        let mut any = false;
        for edge in sides.chunk_by(|a, b| a.0 == b.0) {
            any |= self.halve(edge, sagitta_m, &mut middles);
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

    /// Gives the edge with these sides a middle if it bends by more than `sagitta_m`.
    fn halve(&mut self, edge: &[(u64, u32)], sagitta_m: f64, middles: &mut [Vertex]) -> bool {
        let (mut flat, mut arcs) = (Vec::new(), Vec::<([u32; 2], Arc)>::new());
        let ends = |f: &Facet, k: usize| {
            let (a, b) = (f.corner(k), f.corner((k + 1) % 3));
            if a.0 < b.0 { (a, b) } else { (b, a) }
        };
        for &(_, side) in edge {
            let f = &self.facets[side as usize / 3];
            let (a, b) = ends(f, side as usize % 3);
            if f.is_flat() {
                flat.push(side / 3);
            } else if !arcs.iter().any(|(n, _)| *n == [a.1, b.1]) {
                arcs.push(([a.1, b.1], self.arc(a, b)));
            }
        }
        if arcs.is_empty() {
            return false;
        }
        let mut wish = Wish::default();
        for f in flat {
            wish.keep(self.facet_normal(&self.facets[f as usize]));
        }
        let shift = wish.solve(arcs.iter().map(|(_, arc)| (arc.up, arc.height)));
        let sagitta = arcs.iter().map(|(_, arc)| arc.sagitta).fold(shift.length(), f64::max);
        if sagitta <= sagitta_m {
            return false;
        }
        let key = edge[0].0;
        let [p, q] = [(key >> 32) as usize, (key & 0xffff_ffff) as usize].map(|i| self.points[i]);
        let point = self.points.len() as u32;
        self.points.push(0.5 * (p + q) + shift);
        let first = self.normals.len() as u32;
        self.normals.extend(arcs.iter().map(|(_, arc)| arc.normal));
        for &(_, side) in edge {
            let f = &self.facets[side as usize / 3];
            let (a, b) = ends(f, side as usize % 3);
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
    fn raise_to_mean_height(&mut self) {
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

    fn into_mesh(self) -> Mesh {
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
struct Wish {
    basis: [DVec3; 3],
    n: usize,
}

impl Wish {
    /// The part of a direction that is still free.
    fn free(&self, d: DVec3) -> DVec3 {
        self.basis[..self.n].iter().fold(d, |d, b| d - *b * b.dot(d))
    }

    fn keep(&mut self, normal: DVec3) {
        let free = self.free(normal);
        if self.n < 3 && free.length() > SMOOTH {
            self.basis[self.n] = free.normalize();
            self.n += 1;
        }
    }

    fn solve(mut self, heights: impl Iterator<Item = (DVec3, f64)>) -> DVec3 {
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
