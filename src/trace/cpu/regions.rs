//! Regions: what of one plane is lit by one chain of planes, from the polygons of beams or from the outlines of lines.

use super::beams::{Clipped, Clipper, Ended, Ends, Node, Piece, Polygon, Side, middle, solid_angle_sr};
use super::chains::{Chain, patches_of};
use super::lines::Fragment;
use super::points::SAME;
use crate::base::tasks::Tasks;
use crate::em::aperture::Moments;
use crate::geom::Geometry;
use crate::geom::faces::{Face, Faces, LIES_M, NOT_CURVED};
use crate::geom::hash::FastMap;
use crate::geom::outline::{convex_parts, enclosing, outline};
use crate::trace::beams::{BeamOptions, Frame};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// An outline encloses what its pieces cover but for this share of it.
const SAME_AREA: f64 = 5e-10;

/// The regions of a frame.
pub(super) struct Regions {
    /// What the radar sees of flat patches.
    pub(super) direct: Vec<Region>,
    /// What is lit of flat patches by chains that begin with a mirror of them.
    pub(super) imaged: Vec<Region>,
    /// What is lit of facets of curved surfaces, facet by facet.
    pub(super) of_facets: Vec<Region>,
    pub(super) numbers: RegionNumbers,
}

impl Regions {
    /// `last`: of the pieces from which beams leave alone.
    pub(super) fn of_beams(geometry: &Geometry, clipped: &Clipped, last: bool) -> Regions {
        let numbers = RegionNumbers::new(geometry, clipped);
        let mut direct =
            regions(geometry, clipped, &numbers, if last { &clipped.last } else { &clipped.every });
        let mut imaged = regions(geometry, clipped, &numbers, &clipped.imaged);
        let faces = geometry.faces();
        let node = |r: &Region| &clipped.nodes[r.node as usize];
        let is_curved = |r: &mut Region| faces.faces[node(r).face as usize].curved != NOT_CURVED;
        let mut of_facets: Vec<Region> = direct.extract_if(.., is_curved).collect();
        of_facets.extend(imaged.extract_if(.., is_curved));
        of_facets.sort_by_key(|r| (node(r).face, node(r).bounce, r.node));
        Regions { direct, imaged, of_facets, numbers }
    }

    /// Of what chains by lines light.
    pub(super) fn of_lines(geometry: &Geometry, chains: &[Chain]) -> Regions {
        let faces = geometry.faces();
        let face = |number: usize| &faces.faces[chains[number].node.face as usize];
        let sides = |number: usize, fragments: &[Fragment]| sides_by_lines(faces, face(number), fragments);
        let region = |number: usize, covered: Covered| {
            let region = Region { node: number as u32, covered };
            (region.area_m2() > 0.0).then_some(region)
        };
        let flat = |number: usize, fragments: &[Fragment]| {
            region(number, Covered::Outline(sides(number, fragments)))
        };
        let facet = |number: usize| {
            region(number, Covered::Pieces(polygons_by_lines(faces, face(number), &chains[number].lit)))
        };
        let mirrors_last = |number: &&usize| {
            let chain = &chains[**number];
            chain.node.imaged && faces.mirrors(patches_of(chains, **number)[0], chain.patch)
        };
        let (curved, planes): (Vec<usize>, Vec<usize>) =
            (0..chains.len()).partition(|i| face(*i).curved != NOT_CURVED);
        let direct = planes.par_iter().filter_map_tasks(|i| flat(*i, chains[*i].returning()));
        let imaged = planes.par_iter().filter(mirrors_last).filter_map_tasks(|i| flat(*i, &chains[*i].lit));
        let mut of_facets: Vec<Region> = curved.par_iter().filter_map_tasks(|i| facet(*i)).collect();
        of_facets.sort_by_key(|r| {
            let node = &chains[r.node as usize].node;
            (node.face, node.bounce, r.node)
        });
        let all = 0..chains.len() as u32;
        let numbers = RegionNumbers { of_node: all.clone().collect(), nodes: all.collect() };
        Regions { direct: direct.collect(), imaged: imaged.collect(), of_facets, numbers }
    }
}

/// The outline that fragments enclose on a face.
fn sides_by_lines(faces: &Faces, face: &Face, fragments: &[Fragment]) -> Vec<[DVec2; 2]> {
    let corner = faces.corners[face.first as usize];
    let side = |f: &Fragment| {
        let [a, b] = f.ends_m.map(|p| on_axes(face, p - corner));
        if (b - a).perp_dot(on_axes(face, f.inward)) > 0.0 { [a, b] } else { [b, a] }
    };
    enclosing(&fragments.iter().map(side).collect::<Vec<_>>(), SAME * faces.radius_m)
}

/// What fragments enclose on a face, in convex polygons.
fn polygons_by_lines(faces: &Faces, face: &Face, fragments: &[Fragment]) -> Vec<Polygon> {
    convex_parts(&sides_by_lines(faces, face, fragments)).iter().flat_map(|p| Polygon::of(p)).collect()
}

/// What beams would have met where chains by lines lead: their nodes, what the limit of bounces ends, and what is seen of rough surfaces
/// (`is_sampled`). Flat regions need no polygons.
pub(super) fn clipped_by_lines(
    faces: &Faces,
    (chains, windows): (&[Chain], &[Frame]),
    options: &BeamOptions,
    ends: Option<Ends<'_>>,
    is_sampled: bool,
) -> Clipped {
    let nodes: Vec<Node> = chains.iter().map(|c| c.node).collect();
    let clipper = Clipper { faces, eps: 1e-12, lies_m: LIES_M, options, ends, later: false };
    let face = |number: usize| &faces.faces[nodes[number].face as usize];
    let ended = |number: usize| -> Vec<Ended> {
        let (node, face) = (&nodes[number], face(number));
        let is_last = face.curved == NOT_CURVED && node.bounce as usize >= clipper.most(node.endless);
        let Some(ends) = ends.filter(|_| is_last) else { return Vec::new() };
        let source = Side::facing(face, node.normal);
        let frame = node.frame.mirrored(node.normal, source.offset);
        let corner = faces.corners[face.first as usize];
        let seen = |p: DVec2| node.frame.project(corner + face.axis[0] * p.x + face.axis[1] * p.y);
        let polygons = polygons_by_lines(faces, face, &chains[number].lit);
        let beams: Vec<Polygon> = polygons.iter().map(|p| p.mapped(seen)).collect();
        // What is too weak to ask is so as a whole, however it is cut.
        if ends.most(beams.iter().map(solid_angle_sr).sum()) <= ends.least {
            return Vec::new();
        }
        let ends = Ends { keeps_weak: true, ..ends };
        let mut met = Vec::new();
        for beam in &beams {
            let left = clipper.left(&ends, &nodes, number as u32, middle(beam));
            clipper.end(&ends, (number as u32, left), beam, (&frame, &source), &mut met);
        }
        let begins = clipper.begins(node, face.patch);
        met.retain(|e| !(begins && faces.is_endless(face.patch, faces.faces[e.face as usize].patch)));
        met
    };
    let pieces = |number: usize| -> Vec<Piece> {
        let polygons = polygons_by_lines(faces, face(number), chains[number].returning());
        polygons.into_iter().map(|polygon| Piece { node: number as u32, polygon }).collect()
    };
    let of_all = (0..nodes.len())
        .into_par_iter()
        .map_tasks(|number| (ended(number), if is_sampled { pieces(number) } else { Vec::new() }));
    let (ended, every): (Vec<Vec<Ended>>, Vec<Vec<Piece>>) = of_all.unzip();
    Clipped {
        every: every.concat(),
        ended: ended.concat(),
        windows: windows.to_vec(),
        nodes,
        ..Default::default()
    }
}

/// What of one plane is lit by one chain of planes.
pub(super) struct Region {
    /// One of the nodes; the others have the same images of the radar.
    pub(super) node: u32,
    /// On the face of that node.
    covered: Covered,
}

/// What of a plane is covered.
enum Covered {
    /// Polygons that do not overlap.
    Pieces(Vec<Polygon>),
    /// What directed sides enclose, inside on the left.
    Outline(Vec<[DVec2; 2]>),
}

impl Region {
    /// The polygons of which it is made up; none where its outline alone is known.
    pub(super) fn pieces(&self) -> &[Polygon] {
        match &self.covered {
            Covered::Pieces(pieces) => pieces,
            Covered::Outline(_) => &[],
        }
    }

    /// What it covers, m².
    pub(super) fn area_m2(&self) -> f64 {
        match &self.covered {
            Covered::Pieces(pieces) => pieces.iter().map(|p| p.area().abs()).sum(),
            Covered::Outline(sides) => enclosed_m2(sides),
        }
    }

    /// The centre of its area; None without one.
    pub(super) fn centre(&self) -> Option<DVec2> {
        let (mut area, mut first) = (0.0, DVec2::ZERO);
        match &self.covered {
            Covered::Pieces(pieces) => {
                for m in pieces.iter().map(|p| Moments::of(p.corners())) {
                    area += m.area;
                    first += m.centroid * m.area;
                }
            }
            Covered::Outline(sides) => {
                let origin = sides.first()?[0];
                for [a, b] in sides.iter().map(|s| s.map(|p| p - origin)) {
                    area += 0.5 * a.perp_dot(b);
                    first += (a + b) * (a.perp_dot(b) / 6.0);
                }
                first += origin * area;
            }
        }
        (area != 0.0).then(|| first / area)
    }

    /// Its corners, in no order.
    pub(super) fn corners(&self) -> Box<dyn Iterator<Item = DVec2> + '_> {
        match &self.covered {
            Covered::Pieces(pieces) => Box::new(pieces.iter().flat_map(|p| p.corners()).copied()),
            Covered::Outline(sides) => Box::new(sides.iter().map(|s| s[0])),
        }
    }

    /// Sides of its outline, corners within `near_m` taken for one. Where these do not enclose what the pieces cover (slivers narrower
    /// than that, corners of which three lie in a row of it) they are the sides of all pieces: those inside cancel in the sum of the waves.
    pub(super) fn sides(&self, near_m: f64) -> Vec<[DVec2; 2]> {
        match &self.covered {
            Covered::Pieces(pieces) => outline_of(pieces, near_m),
            Covered::Outline(sides) => sides.clone(),
        }
    }
}

/// As [`Region::sides`].
pub(super) fn outline_of(pieces: &[Polygon], near_m: f64) -> Vec<[DVec2; 2]> {
    if let [whole] = pieces {
        return sides_of(whole).collect();
    }
    let sides = outline(pieces.iter().map(|p| p.corners()), near_m);
    let area_m2: f64 = pieces.iter().map(|p| p.area().abs()).sum();
    match (enclosed_m2(&sides) - area_m2).abs() <= SAME_AREA * area_m2 {
        true => sides,
        false => pieces.iter().flat_map(sides_of).collect(),
    }
}

/// What directed sides enclose, m².
fn enclosed_m2(sides: &[[DVec2; 2]]) -> f64 {
    let Some([origin, _]) = sides.first() else { return 0.0 };
    sides.iter().map(|[a, b]| 0.5 * (*a - *origin).perp_dot(*b - *origin)).sum()
}

/// Areas of each region of one plane that one chain of planes lights: what its pieces cover, and what its outline
/// encloses, m².
pub fn region_areas_m2(geometry: &Geometry, clipped: &Clipped) -> Vec<[f64; 2]> {
    // Products as two numbers: pieces 10 m long and 1 um wide leave f64 no nine digits of their area.
    let exactly = |sides: &[[DVec2; 2]]| {
        let product = |a: f64, b: f64| (a * b, a.mul_add(b, -(a * b)));
        let (mut sum, mut rest) = (0.0, 0.0);
        for [a, b] in sides {
            let ((p, p_rest), (q, q_rest)) = (product(a.x, b.y), product(-a.y, b.x));
            for term in [p, q] {
                let next: f64 = sum + term;
                let virtual_term = next - sum;
                rest += (sum - (next - virtual_term)) + (term - virtual_term);
                sum = next;
            }
            rest += p_rest + q_rest;
        }
        0.5 * (sum + rest)
    };
    let near_m = SAME * geometry.faces().radius_m;
    let areas = |r: &Region| {
        let pieces: f64 = r.pieces().iter().map(|p| exactly(&sides_of(p).collect::<Vec<_>>())).sum();
        [pieces, exactly(&r.sides(near_m))]
    };
    let numbers = RegionNumbers::new(geometry, clipped);
    regions(geometry, clipped, &numbers, &clipped.every).iter().map(areas).collect()
}

/// Which region each node belongs to, and a node of each region.
pub(super) struct RegionNumbers {
    pub(super) of_node: Vec<u32>,
    nodes: Vec<u32>,
}

impl RegionNumbers {
    fn new(geometry: &Geometry, clipped: &Clipped) -> RegionNumbers {
        let faces = geometry.faces();
        let mut of_node: Vec<u32> = Vec::with_capacity(clipped.nodes.len());
        let mut found: FastMap<(u32, u32), u32> = FastMap::default();
        let mut nodes: Vec<u32> = Vec::new();
        for (i, node) in clipped.nodes.iter().enumerate() {
            let parent = if node.parent == u32::MAX { u32::MAX } else { of_node[node.parent as usize] };
            let patch = faces.faces[node.face as usize].patch;
            let region = *found.entry((parent, patch)).or_insert_with(|| {
                nodes.push(i as u32);
                nodes.len() as u32 - 1
            });
            of_node.push(region);
        }
        RegionNumbers { of_node, nodes }
    }
}

/// The regions that these pieces make up, in the order of their nodes.
fn regions(geometry: &Geometry, clipped: &Clipped, numbers: &RegionNumbers, pieces: &[Piece]) -> Vec<Region> {
    let faces = geometry.faces();
    // Pieces by their regions, in their order.
    let region = |piece: &Piece| numbers.of_node[piece.node as usize] as usize;
    let mut ends = vec![0u32; numbers.nodes.len() + 1];
    pieces.iter().for_each(|p| ends[region(p) + 1] += 1);
    (1..ends.len()).for_each(|i| ends[i] += ends[i - 1]);
    let mut sorted = vec![0u32; pieces.len()];
    let mut next = ends.clone();
    for (i, piece) in pieces.iter().enumerate() {
        let at = &mut next[region(piece)];
        sorted[*at as usize] = i as u32;
        *at += 1;
    }
    let made = |(r, node): (usize, &u32)| {
        let own = &sorted[ends[r] as usize..ends[r + 1] as usize];
        let face = |node: u32| &faces.faces[clipped.nodes[node as usize].face as usize];
        let all = face(*node);
        let polygon = |i: &u32| {
            let piece = &pieces[*i as usize];
            let own = face(piece.node);
            if own.first == all.first {
                return piece.polygon;
            }
            let shift = faces.corners[own.first as usize] - faces.corners[all.first as usize];
            piece.polygon.mapped(|p| on_axes(all, shift + own.axis[0] * p.x + own.axis[1] * p.y))
        };
        (!own.is_empty())
            .then(|| Region { node: *node, covered: Covered::Pieces(own.iter().map(polygon).collect()) })
    };
    numbers.nodes.par_iter().enumerate().filter_map_tasks(made).collect()
}

pub(super) fn on_axes(face: &Face, d: DVec3) -> DVec2 {
    DVec2::new(face.axis[0].dot(d), face.axis[1].dot(d))
}

/// Sides of a polygon, its inside on the left.
fn sides_of(polygon: &Polygon) -> impl Iterator<Item = [DVec2; 2]> {
    let (corners, turns_left) = (polygon.corners(), polygon.area() > 0.0);
    (0..corners.len()).map(move |i| {
        let (a, b) = (corners[i], corners[(i + 1) % corners.len()]);
        if turns_left { [a, b] } else { [b, a] }
    })
}
