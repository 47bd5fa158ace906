//! Facets as the curved surfaces that they stand for, and the creases at which these end (CONVENTIONS eq. 58).

use super::shape::bend;
use super::smooth::{Facet, Surface, is_curved};
use crate::scene::Mesh;
use glam::{DMat3, DVec3};

/// Cosine between the tangents of two creases that are one curve.
const STRAIGHT: f64 = 0.99;

/// The surface over a facet (CONVENTIONS eq. 58): its corners lie on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurvedFacet {
    /// Unit normals at the corners, on the facet's front.
    pub normals: [DVec3; 3],
    /// Vector from the middle of each side to the surface, m; the first side goes from corner 0 to corner 1.
    pub rise_m: [DVec3; 3],
    /// At each corner the tensor of the surface's curvatures without their signs, 1/m: the mean of the facets there.
    pub bends: [DMat3; 3],
    /// Sides beyond which the surface does not go on smoothly.
    pub creases: [Option<Crease>; 3],
}

/// A side at which a curved surface ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crease {
    /// Ends at which the crease does not go on smoothly, in the order of the facet's corners.
    pub corners: [bool; 2],
    /// Its own curvature at both ends, 1/m.
    pub curvature_per_m: [f64; 2],
}

impl CurvedFacet {
    /// A bound of the curvature in any direction, 1/m.
    pub fn max_curvature(&self) -> f64 {
        let norm = |m: &DMat3| m.to_cols_array().iter().map(|x| x * x).sum::<f64>().sqrt();
        self.bends.iter().map(norm).fold(0.0, f64::max)
    }

    /// The same with directions turned.
    pub(super) fn turned(&self, turn: impl Fn(DVec3) -> DVec3) -> CurvedFacet {
        let columns = |m: DMat3| DMat3::from_cols(turn(m.x_axis), turn(m.y_axis), turn(m.z_axis));
        CurvedFacet {
            normals: self.normals.map(&turn),
            rise_m: self.rise_m.map(&turn),
            bends: self.bends.map(|m| columns(columns(m).transpose())),
            creases: self.creases,
        }
    }
}

/// The triangles of a mesh as facets of curved surfaces; None for those that are flat.
pub(super) fn facets(mesh: &Mesh) -> Vec<Option<CurvedFacet>> {
    let count = mesh.triangles.len();
    let curved: Vec<bool> = match mesh.normals.len() == mesh.positions_m.len() {
        true => (0..count).map(|t| is_curved(mesh, t)).collect(),
        false => Vec::new(),
    };
    if !curved.contains(&true) {
        return vec![None; count];
    }
    let surface = Surface::new(mesh, &curved);
    let of_facet = |f: &Facet| {
        let front = surface.facet_normal(f);
        let normals = f.normals.map(|n| surface.normals.get(n as usize).copied().unwrap_or(front));
        let sign = normals[0].dot(front).signum();
        let normals = normals.map(|n| n * sign);
        CurvedFacet { normals, rise_m: [DVec3::ZERO; 3], bends: [DMat3::ZERO; 3], creases: [None; 3] }
    };
    let mut facets: Vec<Option<CurvedFacet>> =
        surface.facets.iter().map(|f| (!f.is_flat()).then(|| of_facet(f))).collect();
    let mut creases = Creases::default();
    for edge in surface.sides().chunk_by(|a, b| a.0 == b.0) {
        let Some((rise, arcs)) = surface.bulge(edge) else {
            if !is_plane(&surface, edge) {
                creases.add(&surface, edge, DVec3::ZERO);
            }
            continue;
        };
        for &(_, side) in edge {
            let (facet, k) = (side as usize / 3, side as usize % 3);
            if let Some(curved) = &mut facets[facet] {
                curved.rise_m[k] = rise;
            }
        }
        let is_curved = |&(_, side): &(u64, u32)| facets[side as usize / 3].is_some();
        if !(edge.len() == 2 && arcs.len() == 1 && edge.iter().all(is_curved)) {
            creases.add(&surface, edge, rise);
        }
    }
    creases.join();
    for crease in &creases.all {
        for side in &crease.sides {
            if let Some(facet) = &mut facets[*side as usize / 3] {
                facet.creases[*side as usize % 3] = Some(crease.along(&surface, *side));
            }
        }
    }
    let bends = mean_bends(&surface);
    for (f, facet) in surface.facets.iter().zip(&mut facets) {
        if let Some(facet) = facet {
            facet.bends = f.normals.map(|n| bends[n as usize]);
        }
    }
    facets
}

/// At each normal of a surface the mean of the bends of the curved facets there, by their areas.
fn mean_bends(surface: &Surface) -> Vec<DMat3> {
    let mut sums = vec![(DMat3::ZERO, 0.0); surface.normals.len()];
    for f in surface.facets.iter().filter(|f| !f.is_flat()) {
        let corners = f.points.map(|p| surface.points[p as usize]);
        let bend = bend(corners, f.normals.map(|n| surface.normals[n as usize]));
        let [a, b, c] = corners;
        let area = (b - a).cross(c - a).length();
        for n in f.normals {
            let (sum, areas) = &mut sums[n as usize];
            *sum += bend * area;
            *areas += area;
        }
    }
    sums.into_iter().map(|(sum, areas)| if areas > 0.0 { sum * areas.recip() } else { sum }).collect()
}

/// Whether two flat facets meet in an edge and are one plane.
fn is_plane(surface: &Surface, edge: &[(u64, u32)]) -> bool {
    let facet = |(_, side): &(u64, u32)| &surface.facets[*side as usize / 3];
    edge.len() == 2 && surface.are_one_plane(facet(&edge[0]), facet(&edge[1]))
}

/// An edge at which surfaces end.
struct Edge {
    points: [u32; 2],
    sides: Vec<u32>,
    /// Unit tangents at both ends, into the edge.
    tangents: [DVec3; 2],
    crease: Crease,
}

impl Edge {
    /// The crease as it runs along one of its sides.
    fn along(&self, surface: &Surface, side: u32) -> Crease {
        let first = surface.facets[side as usize / 3].points[side as usize % 3];
        let Crease { corners: [a, b], curvature_per_m: [p, q] } = self.crease;
        match first == self.points[0] {
            true => self.crease,
            false => Crease { corners: [b, a], curvature_per_m: [q, p] },
        }
    }
}

#[derive(Default)]
struct Creases {
    all: Vec<Edge>,
}

impl Creases {
    fn add(&mut self, surface: &Surface, edge: &[(u64, u32)], rise: DVec3) {
        let points = [(edge[0].0 >> 32) as u32, (edge[0].0 & 0xffff_ffff) as u32];
        let [p, q] = points.map(|i| surface.points[i as usize]);
        let chord = q - p;
        let tangents = [chord + 4.0 * rise, 4.0 * rise - chord].map(DVec3::normalize_or_zero);
        // A parabola with this rise over its chord.
        let curvature = 8.0 * rise.length() / chord.length_squared();
        let crease = Crease { corners: [true; 2], curvature_per_m: [curvature; 2] };
        self.all.push(Edge { points, sides: edge.iter().map(|e| e.1).collect(), tangents, crease });
    }

    /// Finds where one crease goes on as another.
    fn join(&mut self) {
        let mut ends: Vec<(u32, usize, usize)> = Vec::with_capacity(2 * self.all.len());
        for (i, edge) in self.all.iter().enumerate() {
            ends.extend([0, 1].map(|end| (edge.points[end], i, end)));
        }
        ends.sort_unstable();
        for at in ends.chunk_by(|a, b| a.0 == b.0) {
            let &[(_, i, a), (_, j, b)] = at else { continue };
            if -self.all[i].tangents[a].dot(self.all[j].tangents[b]) < STRAIGHT {
                continue;
            }
            let most = self.all[i].crease.curvature_per_m[a].max(self.all[j].crease.curvature_per_m[b]);
            for (edge, end) in [(i, a), (j, b)] {
                self.all[edge].crease.corners[end] = false;
                self.all[edge].crease.curvature_per_m[end] = most;
            }
        }
    }
}
