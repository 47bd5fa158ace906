//! Which facets of curved surfaces can return anything to the radar, before anything is clipped (CONVENTIONS eq. 58).
//!
//! Beams are first followed over planes alone, with curved surfaces as what hides them, and each beam keeps the facets ahead of it. A facet
//! then has a few places from which waves come and to which they return: the radar and its images. Of every pair of them it returns
//! something only where the unit vectors from both add up to almost its normal, which is a matter of a few operations for a facet and a
//! pair. What is left, a few facets of a car, is clipped against all that hides it.

use super::beams::{Clipped, Clipper, Ends, Node, Piece, Polygon, Scratch, Side, VisibleFaces};
use super::curved::Curved;
use crate::base::tasks::Tasks;
use crate::base::units::wavenumber;
use crate::geom::Geometry;
use crate::geom::curved_facet::CurvedFacet;
use crate::geom::faces::{Face, Faces, LIES_M, NOT_CURVED};
use crate::geom::hash::FastMap;
use crate::trace::MAX_BOUNCES;
use crate::trace::beams::{BeamOptions, Frame, Port};
use glam::DVec3;
use rayon::prelude::*;

/// Steps over a facet are taken longer by this factor, since normals do not turn evenly.
const WIDER: f64 = 1.5;

/// What decides which facets are worth clipping.
#[derive(Debug, Clone, Copy)]
pub struct Shine<'a> {
    /// Facets of curved surfaces, in the order of `Face::curved`.
    pub curved: &'a [CurvedFacet],
    /// Wavenumber of the carrier, rad/m.
    pub wavenumber: f64,
}

impl Shine<'_> {
    /// The curved surfaces of a scene.
    pub fn of(geometry: &Geometry) -> Shine<'_> {
        Shine { curved: &geometry.faces().curved, wavenumber: wavenumber(geometry.freq_hz) }
    }
}

/// What the beams of a radar that may stand amid the faces meet, as [`super::beams::clip_windows`] has it, but that facets of curved surfaces
/// are lit only where they can return something.
pub fn clip_shining(
    faces: &Faces,
    windows: &[Frame],
    options: &BeamOptions,
    ends: Option<Ends<'_>>,
    shine: Shine<'_>,
) -> Clipped {
    let Some(at) = windows.first().map(|w| w.origin) else { return Clipped::default() };
    let clipper = Clipper { faces, eps: 1e-12, lies_m: LIES_M, options, ends, later: true };
    let lit: Vec<VisibleFaces> = windows.iter().map(|w| clipper.seen_from(*w, true)).collect();
    let mut clipped = clipper.follow_all(&lit, None, Port::At(at));
    clipper.add_shining(&shine, windows, &mut clipped);
    clipped.windows = windows.to_vec();
    clipped
}

/// The radar or one of its images, as a facet sees it.
struct Place {
    /// m.
    origin: DVec3,
    /// Planes that the wave has met.
    planes: usize,
    /// A plane as good as endless was the first of them.
    imaged: bool,
    /// Beams from there, as indices into `Clipped::onward`; none is the radar itself.
    beams: Vec<u32>,
    wanted: bool,
}

/// What is lit of facets.
type Lit = Vec<(Node, Vec<Polygon>)>;

impl Clipper<'_> {
    /// Adds what the radar lights of facets that can return something, straight and by the beams that `clipped` keeps.
    fn add_shining(&self, shine: &Shine<'_>, windows: &[Frame], clipped: &mut Clipped) {
        let Some(radar) = windows.first().map(|w| w.origin) else { return };
        let images = self.image_numbers(clipped);
        // Of each facet the beams ahead of which it is.
        let mut ahead: Vec<(u32, u32)> = (0..)
            .zip(&clipped.onward)
            .flat_map(|(i, beam)| beam.facets.iter().map(move |f| (*f, i)))
            .collect();
        ahead.par_sort_unstable();
        let is_curved = |f: &u32| self.faces.faces[*f as usize].curved != NOT_CURVED;
        let all: Vec<u32> = (0..self.faces.faces.len() as u32).filter(is_curved).collect();
        let of = |some: &[u32]| -> Lit {
            let (mut out, mut scratch) = (Vec::new(), Scratch::new());
            for &f in some {
                let first = ahead.partition_point(|(face, _)| *face < f);
                let beams = ahead[first..].iter().take_while(|(face, _)| *face == f).map(|(_, beam)| *beam);
                let mut places =
                    vec![Place { origin: radar, planes: 0, imaged: false, beams: Vec::new(), wanted: false }];
                let mut known: FastMap<u32, usize> = FastMap::default();
                for beam in beams {
                    let node = &clipped.nodes[clipped.onward[beam as usize].node as usize];
                    let number = images[clipped.onward[beam as usize].node as usize];
                    let at = *known.entry(number).or_insert_with(|| {
                        let (frame, _) = self.leaving(node);
                        let imaged = self.begins_with_mirror(clipped, node, f);
                        let planes = node.bounce as usize;
                        places.push(Place {
                            origin: frame.origin,
                            planes,
                            imaged,
                            beams: Vec::new(),
                            wanted: false,
                        });
                        places.len() - 1
                    });
                    places[at].beams.push(beam);
                }
                self.want(shine, f, &mut places);
                let [own, images @ ..] = &places[..] else { continue };
                if own.wanted {
                    self.light_directly(windows, f, &mut out, &mut scratch);
                }
                for place in images.iter().filter(|p| p.wanted) {
                    self.light_by(clipped, &place.beams, f, &mut out, &mut scratch);
                }
            }
            out
        };
        let lit: Vec<Lit> = all.par_chunks(64).map_tasks(of).collect();
        for (node, polygons) in lit.into_iter().flatten() {
            let number = clipped.nodes.len() as u32;
            let to = if node.bounce == 1 { &mut clipped.every } else { &mut clipped.imaged };
            let before = to.len();
            for polygon in &polygons {
                to.push(Piece { node: number, polygon: self.on_face(&node, polygon) });
            }
            if node.bounce == 1 && self.options.last {
                clipped.last.extend_from_slice(&clipped.every[before..]);
            }
            clipped.nodes.push(node);
        }
        clipped.onward = Vec::new();
    }

    /// A number for each node, the same for those from which waves go on as from one image of the radar.
    fn image_numbers(&self, clipped: &Clipped) -> Vec<u32> {
        let mut found: FastMap<(u32, u32), u32> = FastMap::default();
        let mut numbers: Vec<u32> = Vec::with_capacity(clipped.nodes.len());
        for node in &clipped.nodes {
            let parent = if node.parent == u32::MAX { u32::MAX } else { numbers[node.parent as usize] };
            let next = found.len() as u32;
            numbers.push(*found.entry((parent, self.faces.faces[node.face as usize].patch)).or_insert(next));
        }
        numbers
    }

    /// Frame of the wave that leaves a node, and the plane that it leaves.
    fn leaving(&self, node: &Node) -> (Frame, Side) {
        let face = &self.faces.faces[node.face as usize];
        let source = Side::facing(face, node.normal);
        (node.frame.mirrored(node.normal, source.offset), source)
    }

    /// Patch of the first face of a node's chain.
    fn first_patch(&self, clipped: &Clipped, node: &Node) -> u32 {
        let mut first = node;
        while first.parent != u32::MAX {
            first = &clipped.nodes[first.parent as usize];
        }
        self.faces.faces[first.face as usize].patch
    }

    /// Whether the chain of a node begins with a mirror of what follows it, if that is this face.
    fn begins_with_mirror(&self, clipped: &Clipped, node: &Node, face: u32) -> bool {
        let patch = self.faces.faces[face as usize].patch;
        node.imaged
            || self.begins(node, self.first_patch(clipped, node)) && {
                self.faces.mirrors(self.first_patch(clipped, node), patch)
            }
    }

    /// Marks the places between any two of which a facet returns something.
    fn want(&self, shine: &Shine<'_>, f: u32, places: &mut [Place]) {
        let face = &self.faces.faces[f as usize];
        let Some(facet) = shine.curved.get(face.curved as usize) else { return };
        let corners = self.faces.corners(face);
        let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let reach = corners.iter().map(|p| p.distance(middle)).fold(0.0, f64::max);
        let normal = (facet.normals[0] + facet.normals[1] + facet.normals[2]).normalize_or_zero();
        let turns = facet.normals.iter().map(|n| n.distance(normal)).fold(0.0, f64::max);
        let curvature = facet.max_curvature();
        let has_crease = facet.creases.iter().any(Option::is_some);
        // The part of the unit vector from each place that lies in the facet, how far it may move over the facet, and whether the front
        // of the facet is lit.
        let seen: Vec<(DVec3, f64, f64, bool)> = places
            .iter()
            .map(|place| {
                let d = middle - place.origin;
                let r = d.length();
                let e = d / r;
                (
                    e - normal * normal.dot(e),
                    1.0 / r,
                    normal.dot(e).abs(),
                    face.normal.dot(place.origin) > face.offset_m,
                )
            })
            .collect();
        for i in 0..places.len() {
            for j in 0..=i {
                let (a, b) = (&seen[i], &seen[j]);
                let bounces = places[i].planes + places[j].planes + 1;
                let free = usize::from(places[i].imaged) + usize::from(places[j].imaged);
                if a.3 != b.3
                    || face.one_sided && !a.3
                    || bounces > (self.options.bounces + free).min(MAX_BOUNCES)
                {
                    continue;
                }
                // Between images a crease is left out: an edge lit over a plane and seen over another.
                let edges = has_crease && (i == j || j == 0);
                let spherical = a.1 + b.1;
                let depth = (a.2 + b.2 + 2.0 * WIDER * turns).min(2.0);
                let turn = curvature * depth + spherical;
                let moves = WIDER * (depth * turns + spherical * reach);
                let near = moves + (2.0 * turn * Curved::WINDOW_ENDS / shine.wavenumber).sqrt();
                if !edges && (a.0 + b.0).length_squared() > near * near {
                    continue;
                }
                let sign = if a.3 { 1.0 } else { -1.0 };
                let stations = [places[i].origin, places[j].origin];
                let surface = (facet, corners, face.axis);
                let curved = Curved::new(surface, sign, stations, (shine.wavenumber, 0.0));
                if curved.may_shine(edges) {
                    (places[i].wanted, places[j].wanted) = (true, true);
                }
            }
        }
    }

    /// Lights a facet straight from the radar.
    fn light_directly(&self, windows: &[Frame], f: u32, out: &mut Lit, scratch: &mut Scratch) {
        let face = &self.faces.faces[f as usize];
        for frame in windows {
            let Some(facing) = self.lit(frame, face) else { continue };
            let (start, _) = self.start(frame, true, face);
            if start.corners().len() < 3 {
                continue;
            }
            let mut polygons = Vec::new();
            self.visible_part(frame, None, f, facing, &start, &mut polygons, scratch);
            if !polygons.is_empty() {
                out.push((self.node(u32::MAX, f, 1, (false, false), *frame, facing), polygons));
            }
        }
    }

    /// Lights a facet by beams that leave planes.
    fn light_by(&self, clipped: &Clipped, beams: &[u32], f: u32, out: &mut Lit, scratch: &mut Scratch) {
        let face = &self.faces.faces[f as usize];
        // Polygons of one node are one behind the other.
        let of_node = |a: &u32, b: &u32| clipped.onward[*a as usize].node == clipped.onward[*b as usize].node;
        for beams in beams.chunk_by(of_node) {
            let number = clipped.onward[beams[0] as usize].node;
            let parent = &clipped.nodes[number as usize];
            let first_patch = self.first_patch(clipped, parent);
            let begins = self.begins(parent, first_patch);
            let imaged = parent.imaged || begins && self.faces.mirrors(first_patch, face.patch);
            let endless = parent.endless || begins && self.faces.is_endless(first_patch, face.patch);
            if parent.bounce as usize >= self.most(endless) {
                continue;
            }
            let (frame, source) = self.leaving(parent);
            let mut polygons = Vec::new();
            let mut facing = 0.0;
            for beam in beams {
                let polygon = &clipped.onward[*beam as usize].polygon;
                if let Some((own, start)) = self.met(&frame, &source, f, polygon, scratch) {
                    facing = own;
                    self.visible_part(&frame, Some(&source), f, own, &start, &mut polygons, scratch);
                }
            }
            if !polygons.is_empty() {
                out.push((
                    self.node(number, f, parent.bounce + 1, (imaged, endless), frame, facing),
                    polygons,
                ));
            }
        }
    }

    fn node(
        &self,
        parent: u32,
        face: u32,
        bounce: u8,
        (imaged, endless): (bool, bool),
        frame: Frame,
        facing: f64,
    ) -> Node {
        let of: &Face = &self.faces.faces[face as usize];
        Node { parent, face, bounce, imaged, endless, frame, normal: Side::of(of, facing).normal }
    }

    /// A polygon in the view of a node along the axes of its face.
    fn on_face(&self, node: &Node, polygon: &Polygon) -> Polygon {
        let face = &self.faces.faces[node.face as usize];
        let nearness = node.frame.nearness(face.normal, face.offset_m);
        let corner = self.faces.corners[face.first as usize];
        polygon.mapped(|uv| {
            let d = node.frame.lift(uv, nearness) - corner;
            glam::DVec2::new(face.axis[0].dot(d), face.axis[1].dot(d))
        })
    }
}
