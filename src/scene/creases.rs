//! Which edges of a mesh are creases and which belong to a smooth surface, decided from the facets, and the normals that follow
//! (CONVENTIONS eq. 55a). Exporters average normals over edges that are sharp, and STL has none: a normal of a file is a hint.

use super::Mesh;
use glam::DVec3;
use rayon::prelude::*;
use std::collections::HashMap;

/// Edges that turn by more are creases, degrees, unless somebody says otherwise.
pub const SMOOTH_DEG: f64 = 30.0;
/// Angles may exceed the limit by this: files hold places in f32.
const ROUNDING_DEG: f64 = 0.01;
/// Facets that turn by less are one plane, rad.
const PLANE_RAD: f64 = 1.5e-4;
/// The curvature beside an edge fits that at the edge within this factor, either way.
const FITS: f64 = 5.0;
/// An edge that turns by less than this share of what turns beside it runs across a curved surface that turns elsewhere.
const ACROSS: f64 = 0.3;
/// Normals that differ by less, or by less than this share of the turn of their edge, agree: files round.
const AGREE: f64 = 1e-3;
const AGREE_SHARE: f64 = 0.25;
/// Normals beyond an edge leave their facets by this share of its turn or more where the surface goes on.
const BENT_SHARE: f64 = 0.2;
/// A normal at a border is the mean of its facets if it is nearer to it by this factor than to the surface's.
const FALLS_SHORT: f64 = 0.25;
/// Cosine between a facet and the normals at its corners above which a file says that it is flat.
const SAID_FLAT: f64 = 1.0 - 1e-6;
/// Cosine below which a normal says nothing about a facet, as where surfaces are refined.
const ASTRAY: f64 = std::f64::consts::FRAC_1_SQRT_2;
const NONE: u32 = u32::MAX;

/// What was made of a mesh.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Smoothed {
    /// Facets that stand for a curved surface.
    pub curved: usize,
    /// Corners whose normal was a mean over a crease and was found anew, or left out.
    pub mended: usize,
}

/// Decides which edges are smooth, and gives the facets of smooth surfaces normals that agree over smooth edges alone.
///
/// An edge that turns by more than `smooth_deg` is a crease. Another one is smooth where the normals of the mesh, if it has any, agree
/// on both sides at one end of it or more, and where these turn over both facets as over arcs of one surface, or its curvature (turn over width) fits that of the facets beside it, on both sides or
/// at the border of a surface that goes on on one side. Facets without a smooth edge are flat. Normals of the mesh that belong to one
/// smooth surface stay to the bit.
pub fn smooth(mesh: &mut Mesh, smooth_deg: f64) -> Smoothed {
    let mut new = mesh.clone();
    let out = Creases::new(mesh, smooth_deg).write(&mut new);
    *mesh = new;
    out
}

/// An edge of two facets.
struct Edge {
    sides: [u32; 2],
    /// Angle between the facets, positive where they are convex seen from the front, rad.
    turn: f64,
    /// Unit vectors in each facet's plane, away from the edge.
    inwards: [DVec3; 2],
    length_m: f64,
    kind: Kind,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Crease,
    /// Both facets are one plane.
    Plane,
    /// Neither is decided.
    Open,
    Smooth,
}

/// How the facets beside an edge turn, compared with the edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Beside {
    Fits,
    Little,
    More,
}

struct Creases<'a> {
    mesh: &'a Mesh,
    /// Place of each vertex.
    place: Vec<u32>,
    /// Unit normals of the facets, turned so that neighbours look the same way.
    normals: Vec<DVec3>,
    areas_m2: Vec<f64>,
    edges: Vec<Edge>,
    /// Edge of each side of a facet, or [`NONE`] where it has not two facets.
    edge_of: Vec<u32>,
    /// Edges at each place: where its list starts, and the lists.
    starts: Vec<u32>,
    at_place: Vec<u32>,
}

impl<'a> Creases<'a> {
    fn new(mesh: &'a Mesh, smooth_deg: f64) -> Creases<'a> {
        let bits = |p: &DVec3| (*p + DVec3::ZERO).to_array().map(f64::to_bits);
        let mut known: HashMap<[u64; 3], u32> = HashMap::with_capacity(mesh.positions_m.len());
        let place = mesh.positions_m.iter().map(|p| {
            let next = known.len() as u32;
            *known.entry(bits(p)).or_insert(next)
        });
        let place: Vec<u32> = place.collect();
        let places = known.len();
        drop(known);
        let doubled = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| mesh.positions_m[i as usize]);
            (b - a).cross(c - a)
        };
        let areas_m2 = mesh.triangles.iter().map(|t| 0.5 * doubled(t).length()).collect();
        let normals = mesh.triangles.iter().map(|t| doubled(t).normalize_or_zero()).collect();
        let mut it = Creases {
            mesh,
            place,
            normals,
            areas_m2,
            edges: Vec::new(),
            edge_of: vec![NONE; 3 * mesh.triangles.len()],
            starts: Vec::new(),
            at_place: Vec::new(),
        };
        it.find_edges(smooth_deg);
        it.list_at_places(places);
        it.decide();
        it
    }

    fn corner(&self, side: u32) -> u32 {
        self.mesh.triangles[side as usize / 3][side as usize % 3]
    }

    fn position(&self, vertex: u32) -> DVec3 {
        self.mesh.positions_m[vertex as usize]
    }

    /// Vertices of a facet at the ends of one of its sides, and the third.
    fn of_side(&self, side: u32) -> [u32; 3] {
        let (t, k) = (&self.mesh.triangles[side as usize / 3], side as usize % 3);
        [t[k], t[(k + 1) % 3], t[(k + 2) % 3]]
    }

    fn ends(&self, side: u32) -> (u32, u32) {
        let [a, b, _] = self.of_side(side).map(|v| self.place[v as usize]);
        (a.min(b), a.max(b))
    }

    fn find_edges(&mut self, smooth_deg: f64) {
        let mut sides: Vec<(u32, u32, u32)> = (0..3 * self.mesh.triangles.len() as u32)
            .map(|s| {
                let (a, b) = self.ends(s);
                (a, b, s)
            })
            .collect();
        sides.par_sort_unstable();
        let pairs: Vec<[u32; 2]> = sides
            .chunk_by(|a, b| (a.0, a.1) == (b.0, b.1))
            .filter_map(|edge| match edge {
                [a, b] if a.0 != a.1 => Some([a.2, b.2]),
                _ => None,
            })
            .collect();
        self.turn_alike(&pairs);
        let limit = (smooth_deg + ROUNDING_DEG).to_radians();
        self.edges = pairs.iter().map(|sides| self.edge(*sides, limit)).collect();
        for (i, e) in self.edges.iter().enumerate() {
            e.sides.iter().for_each(|s| self.edge_of[*s as usize] = i as u32);
        }
    }

    /// Turns normals so that facets that hang together look the same way, as the first of them does.
    fn turn_alike(&mut self, pairs: &[[u32; 2]]) {
        let along = |s: u32| {
            let [a, b, _] = self.of_side(s).map(|v| self.place[v as usize]);
            a < b
        };
        let against: Vec<([u32; 2], bool)> =
            pairs.iter().map(|p| (p.map(|s| s / 3), along(p[0]) == along(p[1]))).collect();
        if against.iter().all(|(_, flipped)| !flipped) {
            return;
        }
        let mut beside: Vec<Vec<(u32, bool)>> = vec![Vec::new(); self.normals.len()];
        for ([f, g], flipped) in against {
            beside[f as usize].push((g, flipped));
            beside[g as usize].push((f, flipped));
        }
        let mut seen = vec![false; self.normals.len()];
        let mut next = Vec::new();
        for start in 0..seen.len() {
            if std::mem::replace(&mut seen[start], true) {
                continue;
            }
            next.push((start, false));
            while let Some((f, turned)) = next.pop() {
                if turned {
                    self.normals[f] = -self.normals[f];
                }
                for (g, flipped) in &beside[f] {
                    if !std::mem::replace(&mut seen[*g as usize], true) {
                        next.push((*g as usize, turned != *flipped));
                    }
                }
            }
        }
    }

    fn edge(&self, sides: [u32; 2], limit: f64) -> Edge {
        let [a, b, c] = self.of_side(sides[0]).map(|v| self.position(v));
        let d = self.position(self.of_side(sides[1])[2]);
        let along = (b - a).normalize_or_zero();
        let inwards = [c, d].map(|p| ((p - a) - along * along.dot(p - a)).normalize_or_zero());
        let [m, n] = sides.map(|s| self.normals[s as usize / 3]);
        let angle = m.cross(n).length().atan2(m.dot(n));
        let turn = if m.dot(inwards[1]) <= 0.0 { angle } else { -angle };
        let kind = match angle {
            x if x <= PLANE_RAD => Kind::Plane,
            x if x <= limit && self.normals_agree(sides, angle) => Kind::Open,
            _ => Kind::Crease,
        };
        Edge { sides, turn, inwards, length_m: a.distance(b), kind }
    }

    /// Whether the mesh's normals are the same on both sides of an edge, at one end of it or more. Without normals they are.
    fn normals_agree(&self, [s, t]: [u32; 2], angle: f64) -> bool {
        if self.mesh.normals.is_empty() {
            return true;
        }
        let normal = |v: u32| self.mesh.normals.get(v as usize).copied().unwrap_or(DVec3::ZERO);
        let ([a, b, _], [c, d, _]) = (self.of_side(s), self.of_side(t));
        let (c, d) = if self.place[c as usize] == self.place[a as usize] { (c, d) } else { (d, c) };
        let near = AGREE.max(AGREE_SHARE * angle);
        [(a, c), (b, d)].iter().any(|(v, w)| {
            let (m, n) = (normal(*v), normal(*w));
            m != DVec3::ZERO && n != DVec3::ZERO && m.distance(n) <= near
        })
    }

    fn list_at_places(&mut self, places: usize) {
        let ends: Vec<[u32; 2]> = self.edges.iter().map(|e| self.ends(e.sides[0]).into()).collect();
        let mut starts = vec![0u32; places + 1];
        ends.iter().flatten().for_each(|p| starts[*p as usize + 1] += 1);
        for i in 0..places {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut list = vec![0u32; 2 * ends.len()];
        for (i, pair) in ends.iter().enumerate() {
            for p in pair {
                list[next[*p as usize] as usize] = i as u32;
                next[*p as usize] += 1;
            }
        }
        (self.starts, self.at_place) = (starts, list);
    }

    /// Edges at the corner of a facet that lies opposite to a side and that may be smooth.
    fn opposite(&self, side: u32) -> impl Iterator<Item = &Edge> {
        let place = self.place[self.of_side(side)[2] as usize] as usize;
        let list = &self.at_place[self.starts[place] as usize..self.starts[place + 1] as usize];
        list.iter().map(|e| &self.edges[*e as usize]).filter(|e| e.kind != Kind::Crease)
    }

    /// Whether the mesh's normals say that a facet is flat.
    fn is_said_flat(&self, facet: usize) -> bool {
        let own = self.normals[facet];
        self.mesh.corner_normals(facet).is_some_and(|n| n.iter().all(|n| n.dot(own).abs() > SAID_FLAT))
    }

    /// How the facets on the side `i` of an edge turn beside it, and the largest turn there.
    fn beside(&self, edge: &Edge, i: usize) -> (Beside, f64) {
        let side = edge.sides[i];
        let most = self.opposite(side).map(|e| e.turn.abs()).fold(0.0, f64::max);
        if self.is_said_flat(side as usize / 3) {
            return (Beside::Fits, most);
        }
        // Curvature across the edge, as a mean over the facets about the opposite corner (Cohen-Steiner and Morvan 2003,
        // doi 10.1145/777792.777839): each edge bends its share of both facets, a third.
        let (mut turned, mut area_m2) = (0.0, 0.0);
        for e in self.opposite(side) {
            let across = edge.inwards[i].dot(e.inwards[0]);
            turned += e.turn * e.length_m * across * across;
            area_m2 += e.sides.iter().map(|s| self.areas_m2[*s as usize / 3]).sum::<f64>() / 3.0;
        }
        let wide_m = edge.sides.iter().map(|s| self.areas_m2[*s as usize / 3]).sum::<f64>() / edge.length_m;
        let ratio = turned / area_m2 / (edge.turn / wide_m);
        let beside = match ratio {
            r if r > FITS => Beside::More,
            r if r >= 1.0 / FITS => Beside::Fits,
            _ => Beside::Little,
        };
        (beside, most)
    }

    /// How the mesh's own normals bend the facet on the side `i` of an edge across it, 1/m: 0 where they say that it is flat, None where
    /// they do not turn on both sides of it alike, as a surface through all its corners does and a mean over a fold does not.
    fn bend_by_normals(&self, edge: &Edge, i: usize) -> Option<f64> {
        let side = edge.sides[i];
        let facet = side as usize / 3;
        let normals = self.mesh.corner_normals(facet)?;
        if self.is_said_flat(facet) {
            return Some(0.0);
        }
        let own = self.normals[facet];
        let tilt = |k: u32| {
            let n = normals[(side % 3 + k) as usize % 3];
            (n * n.dot(own).signum()).dot(edge.inwards[i])
        };
        let (near, far) = (0.5 * (tilt(0) + tilt(1)), tilt(2));
        let high_m = 2.0 * self.areas_m2[facet] / edge.length_m;
        let is_arc = near * far < 0.0 && (1.0 / FITS..=FITS).contains(&(far / near).abs());
        is_arc.then(|| (far - near) / high_m)
    }

    /// Whether the mesh's normals say of both facets of an edge that they are arcs of one surface, or of one that it is flat and of the other
    /// that it begins there.
    fn is_said_smooth(&self, edge: &Edge) -> bool {
        match [0, 1].map(|i| self.bend_by_normals(edge, i)) {
            [Some(a), Some(b)] if a == 0.0 || b == 0.0 => a != b,
            [Some(a), Some(b)] => (1.0 / FITS..=FITS).contains(&(a / b)),
            _ => false,
        }
    }

    /// Whether the normals at the corners opposite to an edge leave their facets as those of a curved surface do: a mean over a fold leaves
    /// alone what lies beside it. Facets much wider than their neighbours have to be arcs beside.
    fn is_bent_beyond(&self, edge: &Edge) -> bool {
        let bent = |i: usize| {
            let side = edge.sides[i];
            let facet = side as usize / 3;
            self.mesh.corner_normals(facet).is_some_and(|normals| {
                let far = normals[(side as usize % 3 + 2) % 3];
                let tilt = far.cross(self.normals[facet]).length();
                tilt >= BENT_SHARE * edge.turn.abs() || self.is_said_flat(facet)
            })
        };
        let [a, b] = edge.sides.map(|s| self.areas_m2[s as usize / 3]);
        (1.0 / FITS..=FITS).contains(&(a / b)) && bent(0) && bent(1)
    }

    /// Decides every open edge.
    fn decide(&mut self) {
        // None for what is decided, or for an edge across a surface that turns elsewhere.
        let judge = |e: &Edge| {
            let [(a, most_a), (b, most_b)] = [0, 1].map(|i| self.beside(e, i));
            let said = self.is_said_smooth(e) || self.is_bent_beyond(e);
            match e.turn.abs() < ACROSS * most_a.max(most_b) || said {
                true => [Beside::Fits; 2],
                false => [a, b],
            }
        };
        let open = |e: &Edge| (e.kind == Kind::Open).then(|| judge(e));
        let judged: Vec<Option<[Beside; 2]>> = self.edges.par_iter().map(open).collect();
        let is_sure = |i: usize| judged[i] == Some([Beside::Fits; 2]);
        // The last strip before a border has nothing on its outer side; it belongs to the surface whose inner edges are sure.
        let goes_on = |i: usize, k: usize| {
            let place = self.place[self.of_side(self.edges[i].sides[k])[2] as usize] as usize;
            let list = &self.at_place[self.starts[place] as usize..self.starts[place + 1] as usize];
            list.iter().any(|j| is_sure(*j as usize))
        };
        let smooth = |i: usize| match judged[i] {
            None => false,
            Some([Beside::Fits, Beside::Fits]) => true,
            Some([Beside::Fits, Beside::Little]) => goes_on(i, 0),
            Some([Beside::Little, Beside::Fits]) => goes_on(i, 1),
            Some(_) => false,
        };
        let decided: Vec<bool> = (0..self.edges.len()).map(smooth).collect();
        for (e, smooth) in self.edges.iter_mut().zip(decided) {
            if e.kind == Kind::Open {
                e.kind = if smooth { Kind::Smooth } else { Kind::Crease };
            }
        }
    }

    fn is_joined(&self, side: u32) -> bool {
        let edge = self.edge_of[side as usize];
        edge != NONE && self.edges[edge as usize].kind != Kind::Crease
    }

    /// Corners of facets (three times the facet and the corner) with the first one of those that surround a place without a crease between.
    fn fans(&self) -> Vec<u32> {
        let mut fan: Vec<u32> = (0..3 * self.mesh.triangles.len() as u32).collect();
        fn root(fan: &mut [u32], mut i: u32) -> u32 {
            while fan[i as usize] != i {
                fan[i as usize] = fan[fan[i as usize] as usize];
                i = fan[i as usize];
            }
            i
        }
        for e in self.edges.iter().filter(|e| e.kind != Kind::Crease) {
            let corners = e.sides.map(|s| {
                let (t, k) = (s / 3, s % 3);
                [3 * t + k, 3 * t + (k + 1) % 3]
            });
            let at = |c: u32| self.place[self.corner(c) as usize];
            let [[a, b], [c, d]] = corners;
            let (c, d) = if at(c) == at(a) { (c, d) } else { (d, c) };
            for (x, y) in [(a, c), (b, d)] {
                let (x, y) = (root(&mut fan, x), root(&mut fan, y));
                fan[x.max(y) as usize] = x.min(y);
            }
        }
        for i in 0..fan.len() as u32 {
            let root = root(&mut fan, i);
            fan[i as usize] = root;
        }
        fan
    }

    /// Normal of a smooth surface at a corner by the facets of its fan: exact on spheres, and on cylinders with sides of equal width (Max 1999,
    /// doi 10.1080/10867651.1999.10487501).
    fn share_of_normal(&self, corner: u32) -> DVec3 {
        let [a, b, c] = self.of_side(corner).map(|v| self.position(v));
        let (u, v) = (b - a, c - a);
        let cross = u.cross(v).length() / (u.length_squared() * v.length_squared());
        self.normals[corner as usize / 3] * cross
    }

    fn write(&self, mesh: &mut Mesh) -> Smoothed {
        let count = 3 * self.mesh.triangles.len();
        let fan = self.fans();
        let mut turns = vec![false; count];
        for e in self.edges.iter().filter(|e| e.kind == Kind::Smooth) {
            for s in e.sides {
                let (t, k) = (s / 3, s % 3);
                turns[fan[(3 * t + k) as usize] as usize] = true;
                turns[fan[(3 * t + (k + 1) % 3) as usize] as usize] = true;
            }
        }
        let curved = |t: usize| (3 * t..3 * t + 3).any(|c| turns[fan[c] as usize]);
        let is_curved: Vec<bool> = (0..self.mesh.triangles.len()).map(curved).collect();
        let means = self.means(&fan);
        let out = Smoothed {
            curved: is_curved.iter().filter(|c| **c).count(),
            mended: means.iter().filter(|m| **m).count(),
        };
        if out.curved == 0 {
            mesh.normals.clear();
            return out;
        }
        let given = |c: u32| self.mesh.normals.get(self.corner(c) as usize).copied().unwrap_or(DVec3::ZERO);
        let belongs = |c: u32| !self.mesh.normals.is_empty() && !means[c as usize];
        let mean = self.fan_normals(&fan);
        let borders =
            self.borders(&is_curved, &fan, |c| if belongs(c) { given(c) } else { mean[c as usize] });
        let outwards = |c: usize| borders.get(&fan[c]).copied().unwrap_or(DVec3::ZERO);
        // At a border a mean over facets on one side alone falls short.
        let falls_short = |c: u32| {
            let (n, mean, out) = (given(c), mean[c as usize], outwards(c as usize));
            let n = n * n.dot(mean).signum();
            out.length() > AGREE
                && n.distance(mean) < FALLS_SHORT * n.distance((mean + out).normalize_or_zero())
        };
        let stays = |c: u32| belongs(c) && !falls_short(c);
        let mut normals = mean.clone();
        for (c, n) in normals.iter_mut().enumerate() {
            *n = (*n + outwards(c)).normalize_or_zero();
            // A file may have its normals on the other side.
            if given(c as u32).dot(self.normals[c / 3]) < 0.0 {
                *n = -*n;
            }
        }
        let mut new: HashMap<(u32, [u64; 3]), u32> = HashMap::new();
        mesh.normals.resize(mesh.positions_m.len(), DVec3::ZERO);
        let flat_before = self.mesh.normals.is_empty();
        for c in 0..count as u32 {
            let vertex = self.corner(c);
            let curved = is_curved[c as usize / 3];
            let normal = match (curved, stays(c)) {
                (true, true) => continue,
                (true, false) => normals[c as usize],
                // What has no smooth edge is flat, whatever its normals say.
                (false, _) => DVec3::ZERO,
            };
            if flat_before && normal == DVec3::ZERO {
                continue;
            }
            let key = (self.place[vertex as usize], normal.to_array().map(f64::to_bits));
            let vertex = *new.entry(key).or_insert_with(|| {
                mesh.positions_m.push(self.position(vertex));
                mesh.normals.push(normal);
                mesh.positions_m.len() as u32 - 1
            });
            mesh.triangles[c as usize / 3][c as usize % 3] = vertex;
        }
        out
    }

    /// The normal at each corner of each facet by the facets of its fan, or the facet's own where they are far apart, as at the tip of a cone.
    fn fan_normals(&self, fan: &[u32]) -> Vec<DVec3> {
        let mut sums = vec![DVec3::ZERO; fan.len()];
        for c in 0..fan.len() {
            sums[fan[c] as usize] += self.share_of_normal(c as u32);
        }
        (0..fan.len())
            .map(|c| {
                let (own, mean) = (self.normals[c / 3], sums[fan[c] as usize].normalize_or_zero());
                if mean.dot(own) > ASTRAY { mean } else { own }
            })
            .collect()
    }

    /// By how much normals at the border of a smooth surface are to turn outwards: facets lie on one side of a border alone, so that their mean
    /// falls short by half of what the surface turns over the last of them. By the first corner of a fan.
    fn borders(&self, is_curved: &[bool], fan: &[u32], normal: impl Fn(u32) -> DVec3) -> HashMap<u32, DVec3> {
        let mut lists: HashMap<u32, Vec<(DVec3, DVec3)>> = HashMap::new();
        for side in (0..fan.len() as u32).filter(|s| is_curved[*s as usize / 3] && !self.is_joined(*s)) {
            let [a, b, c] = self.of_side(side).map(|v| self.position(v));
            let along = (b - a).normalize_or_zero();
            let inwards = ((c - a) - along * along.dot(c - a)).normalize_or_zero();
            let (t, k) = (side / 3, side % 3);
            let [first, second, third] = [0, 1, 2].map(|i| 3 * t + (k + i) % 3);
            let (own, inner) = (self.normals[t as usize], normal(third));
            let inner = if inner.dot(own) < 0.0 { -inner } else { inner };
            if inner.dot(own) < ASTRAY {
                continue;
            }
            // Mirrored in the facet: an arc turns on both sides of its chord alike.
            let tilt = inwards * (-inner.dot(inwards) / inner.dot(own));
            for corner in [first, second] {
                lists.entry(fan[corner as usize]).or_default().push((inwards, tilt));
            }
        }
        // A mean over sides that run alike, a sum over those that do not, as where two borders meet.
        let whole = |list: Vec<(DVec3, DVec3)>| -> DVec3 {
            let alike =
                |inwards: DVec3| list.iter().map(|(other, _)| inwards.dot(*other).powi(2)).sum::<f64>();
            list.iter().map(|(inwards, tilt)| *tilt / alike(*inwards)).sum()
        };
        lists.into_iter().map(|(c, list)| (c, whole(list))).collect()
    }

    /// Which corners have a normal that facets beyond a crease share: exporters average normals over all facets that meet in a vertex.
    fn means(&self, fan: &[u32]) -> Vec<bool> {
        let mut means = vec![false; fan.len()];
        if self.mesh.normals.is_empty() {
            return means;
        }
        let mut by_place: Vec<(u32, u32)> =
            (0..fan.len() as u32).map(|c| (self.place[self.corner(c) as usize], c)).collect();
        by_place.par_sort_unstable();
        for corners in by_place.chunk_by(|a, b| a.0 == b.0) {
            if corners.iter().all(|c| fan[c.1 as usize] == fan[corners[0].1 as usize]) {
                continue;
            }
            let mut alike: Vec<(DVec3, Vec<u32>)> = Vec::new();
            for (_, c) in corners {
                let n = self.mesh.normals[self.corner(*c) as usize];
                let own = self.normals[*c as usize / 3];
                if n == DVec3::ZERO || n.dot(own).abs() > SAID_FLAT {
                    continue;
                }
                match alike.iter_mut().find(|(m, _)| m.distance(n) <= AGREE) {
                    Some((_, list)) => list.push(*c),
                    None => alike.push((n, vec![*c])),
                }
            }
            for (_, list) in alike {
                if list.iter().any(|c| fan[*c as usize] != fan[list[0] as usize]) {
                    list.iter().for_each(|c| means[*c as usize] = true);
                }
            }
        }
        means
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Where normals come from: the surface itself, means over all facets at a vertex, the facets, or nowhere.
    #[derive(Debug, Clone, Copy, PartialEq)]
    enum From {
        Surface,
        Means,
        Facets,
        Nowhere,
    }

    const ALL: [From; 4] = [From::Surface, From::Means, From::Facets, From::Nowhere];

    fn facet(mesh: &Mesh, t: usize) -> DVec3 {
        let [a, b, c] = mesh.triangles[t].map(|i| mesh.positions_m[i as usize]);
        (b - a).cross(c - a).normalize()
    }

    /// The mesh with normals; `exact` gives the surface's at a place of a facet.
    fn with_normals(mesh: &Mesh, from: From, exact: impl Fn(DVec3, DVec3) -> DVec3) -> Mesh {
        let mut out = Mesh { material: mesh.material.clone(), ..Mesh::default() };
        for (t, corners) in mesh.triangles.iter().enumerate() {
            let own = facet(mesh, t);
            out.triangles.push([0, 1, 2].map(|k| 3 * t as u32 + k));
            for v in corners {
                let place = mesh.positions_m[*v as usize];
                out.positions_m.push(place);
                let mean = || {
                    let mut directions: Vec<DVec3> = Vec::new();
                    for (u, corners) in mesh.triangles.iter().enumerate().filter(|(_, c)| c.contains(v)) {
                        let n = facet(mesh, u);
                        if corners.contains(v) && directions.iter().all(|d| d.distance(n) > 1e-6) {
                            directions.push(n);
                        }
                    }
                    directions.iter().sum::<DVec3>().normalize()
                };
                match from {
                    From::Surface => out.normals.push(exact(place, own)),
                    From::Means => out.normals.push(mean()),
                    From::Facets => out.normals.push(own),
                    From::Nowhere => {}
                }
            }
        }
        out
    }

    fn mesh(positions_m: Vec<DVec3>, quads: &[[u32; 4]]) -> Mesh {
        let triangles: Vec<[u32; 3]> = quads
            .iter()
            .flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]])
            .filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0])
            .collect();
        Mesh { positions_m, material: vec![0; triangles.len()], triangles, ..Mesh::default() }
    }

    /// Plates side by side, each `width` wide, whose directions have these angles, degrees.
    fn plates(degrees: &[f64], widths: &[f64]) -> Mesh {
        let (mut at, mut corners) = (DVec3::ZERO, vec![DVec3::ZERO, DVec3::Z * 0.1]);
        for (angle, width) in degrees.iter().zip(widths) {
            let angle = angle.to_radians();
            at += DVec3::new(angle.sin(), angle.cos(), 0.0) * *width;
            corners.extend([at, at + DVec3::Z * 0.1]);
        }
        let quads: Vec<[u32; 4]> =
            (0..degrees.len() as u32).map(|i| [0, 2, 3, 1].map(|c| c + 2 * i)).collect();
        mesh(corners, &quads)
    }

    /// A tube about z, with lids or without.
    fn tube(sides: u32, rows: u32, lids: bool) -> Mesh {
        let mut corners = Vec::new();
        for row in 0..=rows {
            for i in 0..sides {
                let (s, c) = (TAU * f64::from(i) / f64::from(sides)).sin_cos();
                corners.push(DVec3::new(0.05 * c, 0.05 * s, 0.2 * f64::from(row) / f64::from(rows)));
            }
        }
        let mut quads = Vec::new();
        for row in 0..rows {
            for i in 0..sides {
                let [a, b] = [i, (i + 1) % sides].map(|i| row * sides + i);
                quads.push([a, b, b + sides, a + sides]);
            }
        }
        if lids {
            let (low, high) = (corners.len() as u32, corners.len() as u32 + 1);
            corners.extend([DVec3::ZERO, DVec3::Z * 0.2]);
            for i in 0..sides {
                let j = (i + 1) % sides;
                quads.push([low, j, i, i]);
                quads.push([high, rows * sides + i, rows * sides + j, rows * sides + j]);
            }
        }
        mesh(corners, &quads)
    }

    fn sphere(sides: u32, rows: u32) -> Mesh {
        let mut corners = Vec::new();
        for row in 0..=rows {
            let (s, c) = (0.5 * TAU * f64::from(row) / f64::from(rows)).sin_cos();
            for i in 0..sides {
                let (y, x) = (TAU * f64::from(i) / f64::from(sides)).sin_cos();
                // The poles are one place.
                let s = if row == 0 || row == rows { 0.0 } else { s };
                corners.push(0.1 * DVec3::new(s * x, s * y, -c));
            }
        }
        let mut quads = Vec::new();
        for row in 0..rows {
            for i in 0..sides {
                let j = (i + 1) % sides;
                let q = [row * sides + i, row * sides + j, (row + 1) * sides + j, (row + 1) * sides + i];
                quads.push(if row == 0 { [q[0], q[2], q[3], q[3]] } else { q });
            }
        }
        let mut m = mesh(corners, &quads);
        let wide = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| m.positions_m[i as usize]);
            (b - a).cross(c - a).length() > 1e-12
        };
        m.triangles = m.triangles.iter().copied().filter(wide).collect();
        m.material.truncate(m.triangles.len());
        m
    }

    /// Largest distance of the normals of curved facets from the surface's, and the number of such facets.
    fn off(mesh: &Mesh, exact: impl Fn(DVec3, DVec3) -> DVec3) -> (f64, usize) {
        let (mut worst, mut curved) = (0f64, 0);
        for t in 0..mesh.triangles.len() {
            let Some(normals) = mesh.corner_normals(t) else { continue };
            curved += 1;
            for (n, v) in normals.iter().zip(mesh.triangles[t]) {
                worst = worst.max(n.distance(exact(mesh.positions_m[v as usize], facet(mesh, t))));
            }
        }
        (worst, curved)
    }

    fn of_tube(p: DVec3, own: DVec3) -> DVec3 {
        if own.z.abs() > 0.9 { own } else { DVec3::new(p.x, p.y, 0.0).normalize() }
    }

    #[test]
    fn folds_brackets_and_posts_with_few_sides_are_flat_whatever_their_normals() {
        let cube = {
            let at = |i: u32| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2));
            let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
            mesh((0..8).map(at).collect(), &quads)
        };
        let mut bodies = vec![cube, tube(8, 1, true), tube(6, 2, false)];
        bodies.extend((5..=90).step_by(5).map(|turn| plates(&[0.0, f64::from(turn)], &[0.1, 0.1])));
        // Bent twice, to one side and to both, and a plate with a narrow strip along its border.
        bodies.push(plates(&[0.0, 20.0, 0.0], &[0.1, 0.05, 0.1]));
        bodies.push(plates(&[0.0, 15.0, 30.0], &[0.1, 0.1, 0.1]));
        bodies.push(plates(&[0.0, 25.0], &[0.1, 0.002]));
        for body in bodies {
            for from in ALL {
                let mut m = with_normals(&body, from, |_, own| own);
                let found = smooth(&mut m, SMOOTH_DEG);
                assert_eq!(found.curved, 0, "{from:?} {} facets", body.triangles.len());
                assert_eq!(found.mended > 0, from == From::Means, "{from:?}");
                assert!(!m.is_smooth());
            }
        }
    }

    #[test]
    fn tubes_and_spheres_get_the_normals_of_their_surface() {
        for (sides, rows, lids) in [(12, 1, true), (13, 3, false), (48, 1, true), (257, 1, false)] {
            let body = tube(sides, rows, lids);
            for from in [From::Surface, From::Means, From::Nowhere] {
                let mut m = with_normals(&body, from, of_tube);
                let found = smooth(&mut m, SMOOTH_DEG);
                assert_eq!(found.curved as u32, 2 * sides * rows, "{sides} {from:?}");
                let (worst, curved) = off(&m, of_tube);
                assert!(worst < 1e-12 && curved == found.curved, "{sides} {from:?}: {worst}");
            }
            let mut m = with_normals(&body, From::Facets, of_tube);
            assert_eq!(smooth(&mut m, SMOOTH_DEG).curved, 0);
        }
        let radial = |p: DVec3, _: DVec3| p.normalize();
        for (sides, rows) in [(16, 8), (48, 24), (7, 13)] {
            let body = sphere(sides, rows);
            for (from, limit) in [(From::Surface, 1e-12), (From::Nowhere, 1e-7)] {
                let mut m = with_normals(&body, from, radial);
                let found = smooth(&mut m, 60.0);
                assert_eq!(found.curved, body.triangles.len(), "{sides} {from:?}");
                let (worst, _) = off(&m, radial);
                assert!(worst < limit, "{sides} x {rows} {from:?}: {worst}");
            }
        }
    }

    #[test]
    fn half_a_tube_ends_as_it_runs() {
        let whole = tube(36, 1, false);
        let mut half = whole.clone();
        half.triangles.truncate(36);
        half.material.truncate(36);
        for from in [From::Nowhere, From::Means, From::Surface] {
            let mut m = with_normals(&half, from, of_tube);
            assert_eq!(smooth(&mut m, SMOOTH_DEG).curved, 36);
            assert!(off(&m, of_tube).0 < 1e-12, "{from:?}: {}", off(&m, of_tube).0);
        }
    }

    #[test]
    fn a_fillet_between_plates_bends_and_the_plates_do_not() {
        // A quarter of a circle of four strips between plates in its tangents.
        let strips = [11.25, 33.75, 56.25, 78.75];
        let degrees: Vec<f64> = [0.0].into_iter().chain(strips).chain([90.0]).collect();
        let width = 2.0 * 0.01 * 11.25f64.to_radians().sin();
        let body = plates(&degrees, &[0.1, width, width, width, width, 0.1]);
        // Normals of plates are those of the plates, of strips at a place that of the circle.
        let centre = DVec3::new(0.01, 0.1, 0.0);
        let exact = |p: DVec3, own: DVec3| {
            let flat = |n: DVec3| own.dot(n).abs() > 1.0 - 1e-9;
            if flat(DVec3::X) || flat(DVec3::Y) {
                return own;
            }
            let n = DVec3::new(p.x - centre.x, p.y - centre.y, 0.0).normalize();
            n * n.dot(own).signum()
        };
        for from in ALL {
            if from == From::Facets {
                continue;
            }
            let mut m = with_normals(&body, from, exact);
            let found = smooth(&mut m, SMOOTH_DEG);
            let bent = (0..m.triangles.len()).filter(|t| {
                m.corner_normals(*t)
                    .is_some_and(|n| n.iter().any(|n| n.dot(facet(&m, *t)).abs() < 1.0 - 1e-9))
            });
            assert_eq!(bent.count(), 8, "{from:?} {found:?}");
            assert!(off(&m, exact).0 < 1e-9, "{from:?}: {}", off(&m, exact).0);
        }
    }

    #[test]
    fn two_strips_with_the_normals_of_their_arc_are_one_and_with_means_a_fold() {
        let arc = plates(&[-10.0, 10.0], &[0.02, 0.02]);
        // The circle through all three corners.
        let centre = arc.positions_m[2] + DVec3::X * (0.02 / (2.0 * 10f64.to_radians().sin()));
        let exact = |p: DVec3, own: DVec3| {
            let n = DVec3::new(p.x - centre.x, p.y - centre.y, 0.0).normalize();
            n * n.dot(own).signum()
        };
        for (from, curved) in [(From::Surface, 4), (From::Means, 0), (From::Nowhere, 0)] {
            let mut m = with_normals(&arc, from, exact);
            assert_eq!(smooth(&mut m, SMOOTH_DEG).curved, curved, "{from:?}");
        }
    }

    #[test]
    fn normals_of_one_surface_stay_to_the_bit_and_so_do_creases() {
        let body = with_normals(&tube(24, 2, true), From::Surface, of_tube);
        let mut once = body.clone();
        smooth(&mut once, SMOOTH_DEG);
        for t in 0..body.triangles.len() {
            if let Some(n) = once.corner_normals(t) {
                assert_eq!(Some(n), body.corner_normals(t));
            }
        }
        let mut twice = once.clone();
        smooth(&mut twice, SMOOTH_DEG);
        let corners = |m: &Mesh| (0..m.triangles.len()).map(|t| m.corner_normals(t)).collect::<Vec<_>>();
        assert_eq!(corners(&once), corners(&twice));
    }

    #[test]
    fn a_facet_that_is_wound_the_other_way_is_no_crease() {
        let mut body = tube(24, 1, false);
        body.triangles[5].swap(0, 1);
        let mut m = with_normals(&body, From::Nowhere, of_tube);
        assert_eq!(smooth(&mut m, SMOOTH_DEG).curved, 48);
    }
}
