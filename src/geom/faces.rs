//! Convex faces for exact beams: coplanar neighbours merged, cut into convex polygons of at most
//! [`MOST_CORNERS`] corners, in a binary tree of boxes that can be asked for what lies in a prism.

use super::cells::{self, Cell, NO_CELL};
use super::curved_facet::CurvedFacet;
pub use super::tree::Node;
use super::tree::{self, parents_first, tree_over};
use super::welded::{NO_PLANE, Welded, sides};
use crate::base::frames::{Pose, Target, World};
use crate::geom::hash::FastMap;
use glam::{DMat3, DVec2, DVec3, Vec3Swizzles};

/// Largest number of corners of a face.
pub const MOST_CORNERS: usize = 8;

/// Corners nearer to a plane than this share of the wavelength lie in it: 1e-3 rad of phase, and above the
/// rounding of positions that a file holds in f32.
pub const FLAT: f64 = 1e-4;

/// Faces of different bodies within so much of one plane lie on one another in a frame, m: 0.1 mm of noise in the places of each
/// (CONVENTIONS eq. 65b).
pub const LIES_M: f64 = 2e-4;
/// Least area of a plane that mirrors another body's faces, m², and times such a face.
const MIRROR_M2: f64 = 0.05;
const MIRROR_RATIO: f64 = 10.0;
/// The same of a plane that mirrors as an endless one does. The first Fresnel zone of a road 30 m long is 0.3 m wide.
const ENDLESS_M2: f64 = 1.0;
const ENDLESS_RATIO: f64 = 100.0;

/// Most faces of a leaf.
const LEAF_FACES: u32 = 8;

/// A convex polygon in one plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Face {
    /// Into `Faces::corners`, counter-clockwise about the normal.
    pub first: u32,
    /// Number of corners.
    pub count: u32,
    /// Points r of the plane have normal . r = offset_m.
    pub normal: DVec3,
    /// The plane is where `normal . r` equals this, m.
    pub offset_m: f64,
    /// Unit vectors in the plane with `axis[0] x axis[1] = normal`; places on the face are measured along
    /// them from its first corner.
    pub axis: [DVec3; 2],
    /// Index into `Geometry::surfaces`.
    pub surface: u32,
    /// Index into `Geometry::bodies`.
    pub body: u32,
    /// Faces of one patch lie in one plane, side by side.
    pub patch: u32,
    /// Part of a closed body with outward normals: it is never seen from behind.
    pub one_sided: bool,
    /// Index into `Faces::cells` of the dielectric volume behind the face, or [`NO_CELL`].
    pub cell: u32,
    /// Index into `Faces::curved` of a triangle that stands for a curved surface, or [`NOT_CURVED`].
    pub curved: u32,
    /// Index into `Faces::shapes` of a face that is part of a curved surface, also where facets are taken for flat; or [`NOT_CURVED`].
    pub shape: u32,
}

impl Face {
    /// Whether the face is part of a curved surface.
    #[inline]
    pub fn is_curved(&self) -> bool {
        self.shape != NOT_CURVED
    }
}

/// Value of `Face::curved` and `Face::shape` for a face that is flat.
pub const NOT_CURVED: u32 = u32::MAX;

/// The half space where `normal . r >= offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HalfSpace {
    /// Normal that points into the half-space.
    pub normal: DVec3,
    /// Least `normal . r`, m.
    pub offset: f64,
}

/// Convex faces of a body or of a scene, with the tree over them.
#[derive(Debug, Default)]
pub struct Faces {
    /// Faces in the order of the tree's leaves.
    pub faces: Vec<Face>,
    /// Corners of all faces, m; a face names a range of them.
    pub corners: Vec<DVec3>,
    /// Nodes of the tree, the root first.
    pub nodes: Vec<Node>,
    /// The leaves in tree order when they are few: then their boxes are asked at once.
    few: Vec<u32>,
    /// Volumes filled with dielectric.
    pub cells: Vec<Cell>,
    /// The surfaces over faces that are curved, their corners in the face's order; none where facets are taken for flat.
    pub curved: Vec<CurvedFacet>,
    /// Of each of `curved` the face beyond each of its sides where the surface goes on smoothly, or [`NOT_CURVED`]; the first side goes
    /// from corner 0 to corner 1.
    pub neighbours: Vec<[u32; 3]>,
    /// How the surfaces over faces are curved: second fundamental forms as tensors of the world, 1/m, positive where they are convex to the
    /// face's front.
    pub shapes: Vec<DMat3>,
    /// Area of each patch, m².
    pub patch_area_m2: Vec<f64>,
    /// Body of each patch, as `Face::body`.
    patch_body: Vec<u32>,
    /// Each patch that mirrors points with each of its faces, both rising.
    mirrors: Vec<(u32, u32)>,
    /// Distance from a plane below which a corner lies in it.
    pub flat_m: f64,
    /// Middle of a sphere around all faces, m.
    pub centre_m: DVec3,
    /// Its radius, m.
    pub radius_m: f64,
}

/// The faces of a scene that come near to a place.
#[derive(Debug)]
pub struct NearFaces {
    /// These faces alone, in a tree of their own, for clipping; curved facets are those of the scene. Their patches, with the areas of
    /// all they hold, and the sides on which they are seen are those of the scene.
    pub faces: Faces,
    /// The number of each among the scene's faces, rising.
    pub numbers: Vec<u32>,
}

/// What is known of the triangles of a mesh; the lists may be empty.
pub(super) struct Known<'a> {
    /// Of each its curved surface.
    pub(super) curved: &'a [Option<CurvedFacet>],
    /// Of each how the surface over it is curved.
    pub(super) shapes: &'a [Option<DMat3>],
    /// Of each the number of the plane that it was found to lie in.
    pub(super) planes: &'a [u32],
    /// How far the file's corners were off each plane, m.
    pub(super) off_m: &'a [f64],
}

impl Faces {
    /// The faces of a body in its own frame. `enters` says of each surface whether it is the front of a dielectric volume. Corners nearer to
    /// a plane than `flat_m` lie in it.
    pub(super) fn build(mesh: &Welded, known: &Known<'_>, enters: &[bool], flat_m: f64) -> Faces {
        let Known { curved, shapes, planes, off_m } = known;
        let mut faces = Faces { flat_m, ..Default::default() };
        let triangles = mesh.of;
        if triangles.is_empty() {
            return faces;
        }
        let closed = mesh.closed_components();
        let (cell_of, found) = cells::find(enters, mesh);
        faces.cells = found;
        let cell = |i: u32| cell_of.get(i as usize).copied().unwrap_or(NO_CELL);
        let curved_of = |i: u32| curved.get(i as usize).and_then(|b| b.as_ref());
        let plane = |i: u32| planes.get(i as usize).copied().unwrap_or(NO_PLANE);
        let mut patches = mesh.patches(flat_m, cell, plane, |i| curved_of(i).is_some());
        patches.sort_by_key(|p| p[0]);
        for (number, patch) in patches.iter().enumerate() {
            let lead = &triangles[patch[0] as usize];
            let plane = Plane::new(lead.v0, lead.normal);
            let one_sided = closed[patch[0] as usize];
            let area = |t: &u32| triangles[*t as usize].area_m2();
            faces.patch_area_m2.push(patch.iter().map(area).sum());
            faces.patch_body.push(lead.body);
            // Outlines matter to first order, depths only to the phase. A file's noise is as large along the plane as across it.
            let noise_m = off_m.get(planes.get(patch[0] as usize).map_or(usize::MAX, |p| *p as usize));
            let straight_m = (0.1 * flat_m).max(noise_m.map_or(0.0, |off| 2.0 * off));
            for polygon in convex_polygons(mesh, patch, &plane, [straight_m, 0.1 * flat_m]) {
                let first = faces.corners.len() as u32;
                faces.corners.extend(polygon.iter().map(|&v| mesh.points[v as usize]));
                let own = Plane::new(mesh.points[polygon[0] as usize], lead.normal);
                faces.faces.push(Face {
                    first,
                    count: polygon.len() as u32,
                    normal: own.normal,
                    offset_m: own.normal.dot(own.origin),
                    axis: own.axis,
                    surface: lead.surface,
                    body: lead.body,
                    patch: number as u32,
                    one_sided,
                    cell: cell(patch[0]),
                    curved: match curved_of(patch[0]) {
                        None => NOT_CURVED,
                        Some(curved) => {
                            faces.curved.push(*curved);
                            faces.curved.len() as u32 - 1
                        }
                    },
                    shape: match shapes.get(patch[0] as usize).copied().flatten() {
                        None => NOT_CURVED,
                        Some(shape) => {
                            faces.shapes.push(shape);
                            faces.shapes.len() as u32 - 1
                        }
                    },
                });
            }
        }
        let boxes: Vec<_> = faces.faces.iter().map(|f| bounds(faces.corners(f))).collect();
        let (nodes, order) = tree_over(&boxes, LEAF_FACES);
        faces.faces = order.iter().map(|&i| faces.faces[i as usize]).collect();
        faces.nodes = nodes;
        faces.find_neighbours(mesh, &patches);
        faces.box_tree();
        faces.list_mirrors();
        faces
    }

    /// The faces of a body, which are in its own frame, where the body stands in `pose`.
    pub(super) fn placed(&self, pose: &Pose<Target, World>) -> Faces {
        let mut placed = Faces {
            faces: Vec::with_capacity(self.faces.len()),
            corners: self.corners.iter().map(|p| pose.point(*p)).collect(),
            nodes: self.nodes.clone(),
            cells: self.cells.clone(),
            patch_area_m2: self.patch_area_m2.clone(),
            patch_body: self.patch_body.clone(),
            curved: self.curved.iter().map(|b| b.turned(|d| pose.direction(d))).collect(),
            neighbours: self.neighbours.clone(),
            shapes: self.shapes.iter().map(|s| turned(s, pose)).collect(),
            mirrors: self.mirrors.clone(),
            flat_m: self.flat_m,
            ..Default::default()
        };
        placed.faces.extend(self.faces.iter().map(|face| {
            let own = Plane::new(placed.corners[face.first as usize], pose.direction(face.normal));
            Face { normal: own.normal, offset_m: own.normal.dot(own.origin), axis: own.axis, ..*face }
        }));
        placed.box_tree();
        placed
    }

    /// The faces of all bodies of a scene, which are in the world, and a sphere that holds them (centre and radius, m). Faces,
    /// patches and cells are numbered body by body; over the bodies' trees stands one whose leaves are their roots.
    pub(super) fn joined(bodies: &[&Faces], flat_m: f64, (centre_m, radius_m): (DVec3, f64)) -> Faces {
        let mut all = Faces { flat_m, centre_m, radius_m, ..Default::default() };
        let count = |of: fn(&Faces) -> usize| bodies.iter().map(|b| of(b)).sum();
        all.faces.reserve(count(|b| b.faces.len()));
        all.corners.reserve(count(|b| b.corners.len()));
        // Of those that have any: the box and where the faces begin.
        let (mut boxes, mut planted) = (Vec::new(), Vec::new());
        for (number, body) in bodies.iter().enumerate() {
            let faces = all.faces.len() as u32;
            let (corners, patches) = (all.corners.len() as u32, all.patch_area_m2.len() as u32);
            let (cells, curved) = (all.cells.len() as u32, all.curved.len() as u32);
            let shapes = all.shapes.len() as u32;
            if let Some(root) = body.nodes.first() {
                boxes.push((root.centre - root.half, root.centre + root.half));
                planted.push((*body, faces));
            }
            all.faces.extend(body.faces.iter().map(|face| Face {
                first: face.first + corners,
                body: number as u32,
                patch: face.patch + patches,
                cell: if face.cell == NO_CELL { NO_CELL } else { face.cell + cells },
                curved: if face.curved == NOT_CURVED { NOT_CURVED } else { face.curved + curved },
                shape: if face.shape == NOT_CURVED { NOT_CURVED } else { face.shape + shapes },
                ..*face
            }));
            all.curved.extend(&body.curved);
            let moved = |f: u32| if f == NOT_CURVED { f } else { f + faces };
            all.neighbours.extend(body.neighbours.iter().map(|n| n.map(moved)));
            all.shapes.extend(&body.shapes);
            all.corners.extend(&body.corners);
            all.patch_area_m2.extend(&body.patch_area_m2);
            all.patch_body.extend(body.patch_body.iter().map(|_| number as u32));
            all.cells.extend(&body.cells);
            all.mirrors.extend(body.mirrors.iter().map(|(patch, face)| (patch + patches, face + faces)));
        }
        let (top, order) = tree_over(&boxes, 1);
        all.nodes.reserve(top.len() + count(|b| b.nodes.len()));
        all.nodes.extend(&top);
        for (slot, leaf) in top.iter().enumerate().filter(|(_, n)| n.count > 0) {
            let (body, faces) = planted[order[leaf.first as usize] as usize];
            // The root takes the leaf's place, all others come behind.
            let nodes = all.nodes.len() as u32 - 1;
            for (i, n) in body.nodes.iter().enumerate() {
                let moved = Node { first: n.first + if n.count > 0 { faces } else { nodes }, ..*n };
                match i {
                    0 => all.nodes[slot] = moved,
                    _ => all.nodes.push(moved),
                }
            }
        }
        let inner = parents_first(&top).into_iter().filter(|i| top[*i].count == 0);
        all.fit(inner.collect());
        all.few = all.leaves();
        all
    }

    /// Finds what is beyond the sides of curved facets, each of which is a patch of one triangle.
    fn find_neighbours(&mut self, mesh: &Welded, patches: &[Vec<u32>]) {
        if self.curved.is_empty() {
            return;
        }
        let mut face_of = vec![NOT_CURVED; mesh.triangles.len()];
        for (i, face) in (0..).zip(&self.faces) {
            if face.curved != NOT_CURVED {
                face_of[patches[face.patch as usize][0] as usize] = i;
            }
        }
        let mut neighbours = vec![[NOT_CURVED; 3]; self.curved.len()];
        for face in self.faces.iter().filter(|f| f.curved != NOT_CURVED) {
            let own = patches[face.patch as usize][0];
            let facet = &self.curved[face.curved as usize];
            let of = &mut neighbours[face.curved as usize];
            for (k, (a, b)) in sides(&mesh.triangles[own as usize]).into_iter().enumerate() {
                let beyond = &mesh.edges[&(a.min(b), a.max(b))];
                if let ([(t, _), (u, _)], None) = (&beyond[..], &facet.creases[k]) {
                    of[k] = face_of[if *t == own { *u } else { *t } as usize];
                }
            }
        }
        self.neighbours = neighbours;
    }

    fn list_mirrors(&mut self) {
        let of =
            |(i, face): (usize, &Face)| self.mirrors_points(face.patch).then_some((face.patch, i as u32));
        let mut mirrors: Vec<(u32, u32)> = self.faces.iter().enumerate().filter_map(of).collect();
        mirrors.sort_unstable();
        self.mirrors = mirrors;
    }

    /// Finds the faces that have a place not farther than `reach_m` from `place_m`; None when all have.
    pub fn near(&self, place_m: DVec3, reach_m: f64) -> Option<NearFaces> {
        if place_m.distance(self.centre_m) + self.radius_m <= reach_m {
            return None;
        }
        let is_near: Vec<bool> =
            self.faces.iter().map(|f| is_within(self.corners(f), f.normal, place_m, reach_m)).collect();
        if is_near.iter().all(|near| *near) {
            return None;
        }
        let mut counts = vec![0u32; self.nodes.len()];
        for &i in parents_first(&self.nodes).iter().rev() {
            let n = &self.nodes[i];
            let first = n.first as usize;
            counts[i] = match n.count {
                0 => counts[first] + counts[first + 1],
                count => is_near[first..first + count as usize].iter().map(|near| u32::from(*near)).sum(),
            };
        }
        let mut faces = Faces {
            cells: self.cells.clone(),
            patch_area_m2: self.patch_area_m2.clone(),
            patch_body: self.patch_body.clone(),
            flat_m: self.flat_m,
            centre_m: self.centre_m,
            radius_m: self.radius_m,
            ..Default::default()
        };
        let numbers: Vec<u32> = (0..self.faces.len() as u32).filter(|i| is_near[*i as usize]).collect();
        for i in &numbers {
            let face = self.faces[*i as usize];
            faces.faces.push(Face { first: faces.corners.len() as u32, ..face });
            faces.corners.extend(self.corners(&face));
        }
        // The scene's tree without what is empty: a node here and the one there that it is made of.
        let mut stack = Vec::new();
        if !numbers.is_empty() {
            faces.nodes.push(self.nodes[0]);
            stack.push((0, 0));
        }
        while let Some((node, mut from)) = stack.pop() {
            let of = loop {
                let of = self.nodes[from];
                let children = [of.first as usize, of.first as usize + 1];
                match (of.count, children.map(|c| counts.get(c))) {
                    (0, [Some(0), _]) => from = children[1],
                    (0, [_, Some(0)]) => from = children[0],
                    _ => break of,
                }
            };
            faces.nodes[node] = if of.count > 0 {
                let first = numbers.partition_point(|i| *i < of.first) as u32;
                Node { first, count: counts[from], ..of }
            } else {
                let first = faces.nodes.len();
                faces.nodes.extend([of; 2]);
                stack.extend([(first, of.first as usize), (first + 1, of.first as usize + 1)]);
                Node { first: first as u32, ..of }
            };
        }
        faces.box_tree();
        faces.list_mirrors();
        Some(NearFaces { faces, numbers })
    }

    /// Whether a patch mirrors another: as an endless plane, or one of another body, where it is so much larger that the other radiates
    /// to it from all over.
    pub fn mirrors(&self, patch: u32, other: u32) -> bool {
        let body = |p: u32| self.patch_body[p as usize];
        body(patch) != body(other) && self.is_larger(patch, other, MIRROR_M2, MIRROR_RATIO)
            || self.is_endless(patch, other)
    }

    /// Whether a patch mirrors another as an endless plane.
    pub fn is_endless(&self, patch: u32, other: u32) -> bool {
        self.is_larger(patch, other, ENDLESS_M2, ENDLESS_RATIO)
    }

    /// Whether a patch is so large that its outline seldom matters.
    pub fn is_large(&self, patch: u32) -> bool {
        self.patch_area_m2[patch as usize] >= ENDLESS_M2
    }

    fn is_larger(&self, patch: u32, other: u32, least_m2: f64, ratio: f64) -> bool {
        let area = |p: u32| self.patch_area_m2[p as usize];
        area(patch) >= least_m2.max(ratio * area(other))
    }

    /// Whether a patch mirrors what has no extent.
    pub fn mirrors_points(&self, patch: u32) -> bool {
        self.patch_area_m2[patch as usize] >= MIRROR_M2
    }

    /// Whether a place in the plane of a patch that mirrors points is on one of its faces.
    pub fn is_on_mirror(&self, patch: u32, p: DVec3) -> bool {
        let first = self.mirrors.partition_point(|m| m.0 < patch);
        self.mirrors[first..].iter().take_while(|m| m.0 == patch).any(|(_, i)| {
            let face = &self.faces[*i as usize];
            is_over(self.corners(face), face.normal, p)
        })
    }

    /// Whether a place is on a face, or over or under it.
    pub(super) fn is_over(&self, face: &Face, p: DVec3) -> bool {
        is_over(self.corners(face), face.normal, p)
    }

    /// Whether a face stands between two places, farther than `gap_m` from both.
    pub fn is_between(&self, a: DVec3, b: DVec3, gap_m: f64) -> bool {
        let way = b - a;
        let share = gap_m / way.length();
        let mut found = false;
        self.visit_segment(a, b, gap_m, |i| {
            let face = &self.faces[i as usize];
            let corners = self.corners(face);
            let t = (corners[0] - a).dot(face.normal) / way.dot(face.normal);
            // Of a way in the plane t is no number or endless.
            found = t > share && t < 1.0 - share && is_over(corners, face.normal, a + way * t);
            found
        });
        found
    }

    /// Calls `visit` with the faces of all leaves that are not missed; `misses` gets centre and half size of a box.
    #[inline]
    pub(crate) fn visit_boxes(&self, misses: impl Fn(DVec3, DVec3) -> bool, mut visit: impl FnMut(u32)) {
        self.visit(
            |node| misses(node.centre, node.half),
            None,
            |i| {
                visit(i);
                false
            },
        );
    }

    /// Calls `visit` with the faces of all leaves that come as near as `pad_m` to the segment between two positions, until it returns true.
    #[inline]
    pub(crate) fn visit_segment(&self, a: DVec3, b: DVec3, pad_m: f64, visit: impl FnMut(u32) -> bool) {
        let misses = misses_segment(a, b, pad_m);
        self.visit(|node| misses(node.centre, node.half), None, visit);
    }

    /// Whether a position in the plane of a face is on it, or not farther than `margin_m` outside one of its sides.
    pub(crate) fn is_inside(&self, face: &Face, p: DVec3, margin_m: f64) -> bool {
        sides_of(self.corners(face)).all(|(a, b)| {
            let side = b - a;
            face.normal.dot(side.cross(p - a)) >= -margin_m * side.length()
        })
    }

    /// Corners of a face in order, m.
    pub fn corners(&self, face: &Face) -> &[DVec3] {
        &self.corners[face.first as usize..(face.first + face.count) as usize]
    }

    fn box_tree(&mut self) {
        self.fit(parents_first(&self.nodes));
        self.few = self.leaves();
    }

    /// The leaves in tree order, or none where they are many.
    fn leaves(&self) -> Vec<u32> {
        const FEW: usize = 16;
        let (mut leaves, mut stack) = (Vec::new(), vec![]);
        stack.extend((!self.nodes.is_empty()).then_some(0));
        while let Some(i) = stack.pop() {
            let n = self.nodes[i as usize];
            match n.count {
                0 => stack.extend([n.first + 1, n.first]),
                _ if leaves.len() == FEW => return Vec::new(),
                _ => leaves.push(i),
            }
        }
        leaves
    }

    /// Boxes of these nodes, of which each comes before those below it.
    fn fit(&mut self, parents_first: Vec<usize>) {
        let (faces, corners) = (&self.faces, &self.corners);
        let of = |f: &Face| bounds(&corners[f.first as usize..(f.first + f.count) as usize]);
        tree::fit(&mut self.nodes, parents_first, |n| {
            let some = &faces[n.first as usize..(n.first + n.count) as usize];
            some.iter().map(of).reduce(tree::around)
        });
    }

    /// Calls `visit` with the index of each face whose leaf reaches into all `spaces`, in tree order.
    #[inline]
    pub fn within<const N: usize>(&self, spaces: &[HalfSpace; N], mut visit: impl FnMut(u32)) {
        self.within_until(spaces, None, |i| {
            visit(i);
            false
        });
    }

    /// Visits faces as [`Self::within`] does, until `visit` says that it has enough. With a place to look `from` the
    /// nearer of two branches comes first.
    #[inline]
    pub fn within_until<const N: usize>(
        &self,
        spaces: &[HalfSpace; N],
        from: Option<DVec3>,
        visit: impl FnMut(u32) -> bool,
    ) {
        let mut reach = [DVec3::ZERO; N];
        for (r, s) in reach.iter_mut().zip(spaces) {
            *r = s.normal.abs();
        }
        let misses = |node: &Node| {
            let deepest = |i: usize| spaces[i].normal.dot(node.centre) + reach[i].dot(node.half);
            (0..N).any(|i| deepest(i) < spaces[i].offset)
        };
        self.visit(misses, from, visit);
    }

    /// Calls `visit` with the faces of the leaves that are not missed, until it says that it has enough.
    #[inline]
    fn visit(&self, misses: impl Fn(&Node) -> bool, from: Option<DVec3>, mut visit: impl FnMut(u32) -> bool) {
        if !self.few.is_empty() {
            for node in self.few.iter().map(|&i| &self.nodes[i as usize]) {
                if !misses(node) && (node.first..node.first + node.count).any(&mut visit) {
                    return;
                }
            }
            return;
        }
        tree::walk(&self.nodes, misses, from, visit);
    }
}

/// A symmetric tensor of a body where the body stands in `pose`.
fn turned(tensor: &DMat3, pose: &Pose<Target, World>) -> DMat3 {
    let turn =
        DMat3::from_cols_array_2d(&[DVec3::X, DVec3::Y, DVec3::Z].map(|d| pose.direction(d).to_array()));
    turn * *tensor * turn.transpose()
}

pub(super) fn bounds(points: &[DVec3]) -> (DVec3, DVec3) {
    let start = (DVec3::splat(f64::INFINITY), DVec3::splat(f64::NEG_INFINITY));
    points.iter().fold(start, |(lo, hi), p| (lo.min(*p), hi.max(*p)))
}

/// Sides of a polygon, from corner to corner.
fn sides_of(corners: &[DVec3]) -> impl Iterator<Item = (DVec3, DVec3)> {
    (0..corners.len()).map(|i| (corners[i], corners[(i + 1) % corners.len()]))
}

/// Tells of boxes, given by centre and half size, whether the segment between two positions stays farther away than `pad_m`: by the
/// separating axes of a box and a line (Ericson 2005, 5.3.3).
#[inline]
pub(crate) fn misses_segment(a: DVec3, b: DVec3, pad_m: f64) -> impl Fn(DVec3, DVec3) -> bool {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    let reach = half.abs();
    move |centre, size| {
        let (d, size) = (middle - centre, size + pad_m);
        let turned = size.yzx() * reach.zxy() + size.zxy() * reach.yzx();
        d.abs().cmpgt(size + reach).any() || half.cross(d).abs().cmpgt(turned).any()
    }
}

/// Whether a place lies on a convex polygon, counter-clockwise about `normal`, or over or under it.
fn is_over(corners: &[DVec3], normal: DVec3, p: DVec3) -> bool {
    sides_of(corners).all(|(a, b)| (b - a).cross(p - a).dot(normal) >= 0.0)
}

/// Whether a convex polygon, counter-clockwise about `normal`, has a place not farther than `reach_m` from `p`.
fn is_within(corners: &[DVec3], normal: DVec3, p: DVec3, reach_m: f64) -> bool {
    let reach2 = reach_m * reach_m;
    if corners.iter().any(|c| c.distance_squared(p) <= reach2) {
        return true;
    }
    if is_over(corners, normal, p) {
        return normal.dot(p - corners[0]).abs() <= reach_m;
    }
    sides_of(corners).any(|(a, b)| {
        let t = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
        (a + (b - a) * t).distance_squared(p) <= reach2
    })
}

struct Plane {
    origin: DVec3,
    normal: DVec3,
    axis: [DVec3; 2],
}

impl Plane {
    fn new(origin: DVec3, normal: DVec3) -> Self {
        let t = normal.any_orthonormal_vector();
        Plane { origin, normal, axis: [t, normal.cross(t)] }
    }
    fn at(&self, p: DVec3) -> DVec2 {
        let d = p - self.origin;
        DVec2::new(self.axis[0].dot(d), self.axis[1].dot(d))
    }
}

/// Cuts a patch into convex polygons of at most [`MOST_CORNERS`] corners (indices of welded points,
/// counter-clockwise about the patch's normal). Corners so near to a straight line are left out: of the outline where that is one
/// polygon, and of polygons that lie side by side.
fn convex_polygons(
    mesh: &Welded,
    patch: &[u32],
    plane: &Plane,
    [outer_m, inner_m]: [f64; 2],
) -> Vec<Vec<u32>> {
    let at = |v: u32| plane.at(mesh.points[v as usize]);
    if patch.len() == 1 {
        return vec![mesh.triangles[patch[0] as usize].to_vec()];
    }
    if let Some(mut outline) = single_outline(mesh, patch) {
        drop_straight(&mut outline, &at, outer_m);
        if is_convex(&outline, &at) {
            return halved(outline);
        }
    }
    // Hertel and Mehlhorn (1983): leave out each shared edge whose removal keeps the union convex.
    let mut polygons: Vec<Option<Vec<u32>>> =
        patch.iter().map(|&i| Some(mesh.triangles[i as usize].to_vec())).collect();
    let mut owner: FastMap<(u32, u32), usize> = FastMap::default();
    for (i, p) in polygons.iter().enumerate() {
        for (a, b) in around(p.as_deref().unwrap_or_default()) {
            owner.insert((a, b), i);
        }
    }
    let mut shared: Vec<(u32, u32)> =
        owner.keys().copied().filter(|&(a, b)| a < b && owner.contains_key(&(b, a))).collect();
    // Long cuts first: they make the thin pieces.
    shared.sort_by(|x, y| {
        let long = |e: &(u32, u32)| at(e.0).distance_squared(at(e.1));
        long(y).total_cmp(&long(x)).then(x.cmp(y))
    });
    loop {
        let mut merged_any = false;
        for &(a, b) in &shared {
            let (Some(&i), Some(&j)) = (owner.get(&(a, b)), owner.get(&(b, a))) else { continue };
            if i == j {
                continue;
            }
            let (Some(p), Some(q)) = (&polygons[i], &polygons[j]) else { continue };
            let Some(union) = joined(p, q, (a, b)) else { continue };
            if union.len() > 64 || !is_convex(&union, &at) {
                continue;
            }
            for e in around(p).chain(around(q)).collect::<Vec<_>>() {
                owner.remove(&e);
            }
            for e in around(&union) {
                owner.insert(e, i);
            }
            polygons[i] = Some(union);
            polygons[j] = None;
            merged_any = true;
        }
        if !merged_any {
            break;
        }
    }
    polygons
        .into_iter()
        .flatten()
        .flat_map(|mut p| {
            drop_straight(&mut p, &at, inner_m);
            halved(p)
        })
        .collect()
}

fn around(p: &[u32]) -> impl Iterator<Item = (u32, u32)> + '_ {
    (0..p.len()).map(|i| (p[i], p[(i + 1) % p.len()]))
}

/// The union of `p`, which runs (a, b), and `q`, which runs (b, a), without the chain of edges that they
/// share there; None when they share more than one chain.
fn joined(p: &[u32], q: &[u32], (a, b): (u32, u32)) -> Option<Vec<u32>> {
    let (np, nq) = (p.len(), q.len());
    let mut ip = p.iter().position(|&v| v == b)?; // end of the chain in p
    let mut start_p = p.iter().position(|&v| v == a)?;
    let mut iq = q.iter().position(|&v| v == b)?; // start of the chain in q
    let mut end_q = q.iter().position(|&v| v == a)?;
    // Grow the chain both ways while the two run along the same edges.
    while p[(ip + 1) % np] == q[(iq + nq - 1) % nq] && (ip + 1) % np != start_p {
        ip = (ip + 1) % np;
        iq = (iq + nq - 1) % nq;
    }
    while p[(start_p + np - 1) % np] == q[(end_q + 1) % nq] && (start_p + np - 1) % np != ip {
        start_p = (start_p + np - 1) % np;
        end_q = (end_q + 1) % nq;
    }
    let mut union = Vec::with_capacity(np + nq);
    let mut i = ip;
    while i != start_p {
        union.push(p[i]);
        i = (i + 1) % np;
    }
    let mut j = end_q;
    while j != iq {
        union.push(q[j]);
        j = (j + 1) % nq;
    }
    let mut sorted = union.clone();
    sorted.sort_unstable();
    sorted.dedup();
    (union.len() >= 3 && sorted.len() == union.len()).then_some(union)
}

/// The outline of a patch when it is one simple loop.
fn single_outline(mesh: &Welded, patch: &[u32]) -> Option<Vec<u32>> {
    let mut next: FastMap<u32, u32> = FastMap::default();
    let mut inside: FastMap<(u32, u32), ()> =
        FastMap::with_capacity_and_hasher(3 * patch.len(), Default::default());
    for &i in patch {
        for e in sides(&mesh.triangles[i as usize]) {
            inside.insert(e, ());
        }
    }
    for &(a, b) in inside.keys() {
        if !inside.contains_key(&(b, a)) && next.insert(a, b).is_some() {
            return None;
        }
    }
    let start = *next.keys().min()?;
    let mut outline = vec![start];
    let mut v = *next.get(&start)?;
    while v != start {
        outline.push(v);
        v = *next.get(&v)?;
        if outline.len() > next.len() {
            return None;
        }
    }
    (outline.len() == next.len()).then_some(outline)
}

/// Drops corners that lie within `straight_m` of the line of their neighbours.
fn drop_straight(polygon: &mut Vec<u32>, at: &impl Fn(u32) -> DVec2, straight_m: f64) {
    let mut i = 0;
    let mut kept = 0;
    while polygon.len() > 3 && kept < polygon.len() {
        let n = polygon.len();
        let [a, b, c] = [polygon[(i + n - 1) % n], polygon[i % n], polygon[(i + 1) % n]].map(at);
        let chord = c - a;
        if chord.perp_dot(b - a).abs() <= straight_m * chord.length() && (b - a).dot(c - b) > 0.0 {
            polygon.remove(i % n);
            kept = 0;
            i %= polygon.len();
        } else {
            kept += 1;
            i = (i + 1) % n;
        }
    }
}

fn is_convex(polygon: &[u32], at: &impl Fn(u32) -> DVec2) -> bool {
    let n = polygon.len();
    let p: Vec<DVec2> = polygon.iter().map(|&v| at(v)).collect();
    let mut turned = 0.0;
    for i in 0..n {
        let (e, f) = (p[(i + 1) % n] - p[i], p[(i + 2) % n] - p[(i + 1) % n]);
        let cross = e.perp_dot(f);
        if cross < -1e-9 * e.length() * f.length() {
            return false;
        }
        turned += cross.atan2(e.dot(f));
    }
    // A star turns around more than once.
    (turned - std::f64::consts::TAU).abs() < 0.1
}

/// A convex polygon in pieces of at most [`MOST_CORNERS`] corners.
fn halved(polygon: Vec<u32>) -> Vec<Vec<u32>> {
    if polygon.len() <= MOST_CORNERS {
        return vec![polygon];
    }
    let half = polygon.len() / 2;
    let mut second = polygon[half..].to_vec();
    second.push(polygon[0]);
    let mut out = halved(polygon[..=half].to_vec());
    out.extend(halved(second));
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::frames::Pose;
    use crate::geom::Geometry;
    use crate::scene::{Material, Mesh, Scene};

    fn faces_of(mesh: Mesh) -> Faces {
        let mut scene = Scene::default();
        scene.materials.push(Material::pec());
        scene.add_mesh("m", "", mesh, Pose::IDENTITY);
        Geometry::build(&scene, 0.0, 77e9).unwrap().find_faces()
    }

    fn area(f: &Faces) -> f64 {
        f.faces
            .iter()
            .map(|face| {
                let c = f.corners(face);
                (1..c.len() - 1)
                    .map(|i| 0.5 * (c[i] - c[0]).cross(c[i + 1] - c[0]).dot(face.normal))
                    .sum::<f64>()
            })
            .sum()
    }

    /// A square of n x n cells, less those for which `hole` is true.
    fn grid(n: u32, hole: impl Fn(u32, u32) -> bool) -> Mesh {
        let mut m = Mesh::default();
        for j in 0..=n {
            for i in 0..=n {
                // Rounded through f32, as a file would hold them.
                let q = |x: f64| (x as f32) as f64;
                let (x, y) = (i as f64 / n as f64, j as f64 / n as f64);
                m.positions_m.push(DVec3::new(q(0.8 * x), q(y), q(0.6 * x + 0.1)));
            }
        }
        for j in 0..n {
            for i in 0..n {
                if !hole(i, j) {
                    let a = j * (n + 1) + i;
                    m.triangles.extend([[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]]);
                    m.material.extend([0, 0]);
                }
            }
        }
        m
    }

    #[test]
    fn a_plate_of_many_triangles_is_one_face() {
        let f = faces_of(grid(16, |_, _| false));
        assert_eq!(f.faces.len(), 1);
        assert_eq!(f.faces[0].count, 4);
        assert!((area(&f) - 1.0).abs() < 1e-6);
        assert!(!f.faces[0].one_sided);
    }

    #[test]
    fn an_l_and_a_frame_are_cut_into_few_convex_faces_of_the_same_area() {
        let l = faces_of(grid(8, |i, j| i >= 4 && j >= 4));
        assert!(l.faces.len() <= 4, "{}", l.faces.len());
        assert!((area(&l) - 0.75).abs() < 1e-6);
        let frame = faces_of(grid(9, |i, j| (3..6).contains(&i) && (3..6).contains(&j)));
        assert!(frame.faces.len() <= 8, "{}", frame.faces.len());
        assert!((area(&frame) - 8.0 / 9.0).abs() < 1e-6);
        for f in &frame.faces {
            assert!(f.count as usize <= MOST_CORNERS);
        }
    }

    #[test]
    fn closed_bodies_are_one_sided_and_open_ones_are_not() {
        let corner = |i: u32| DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64);
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let cube = |faces: &[[u32; 4]], flip: bool| {
            let mut m = Mesh { positions_m: (0..8).map(corner).collect(), ..Default::default() };
            for q in faces {
                let t = [[q[0], q[1], q[2]], [q[0], q[2], q[3]]];
                m.triangles.extend(t.map(|t| if flip { [t[0], t[2], t[1]] } else { t }));
                m.material.extend([0, 0]);
            }
            m
        };
        let whole = faces_of(cube(&quads, false));
        assert_eq!(whole.faces.len(), 6);
        assert!(whole.faces.iter().all(|f| f.one_sided));
        assert!(faces_of(cube(&quads[..5], false)).faces.iter().all(|f| !f.one_sided));
        assert!(faces_of(cube(&quads, true)).faces.iter().all(|f| !f.one_sided), "inside out");
    }

    #[test]
    fn the_tree_finds_what_a_loop_finds() {
        let mut scene = Scene::default();
        scene.materials.push(Material::pec());
        let mut rng = 1u64;
        let mut next = || {
            rng = rng.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (rng >> 11) as f64 / (1u64 << 53) as f64
        };
        let mut m = Mesh::default();
        for i in 0..500u32 {
            let c = DVec3::new(next(), next(), next());
            for _ in 0..3 {
                m.positions_m.push(c + 0.05 * DVec3::new(next(), next(), next()));
            }
            m.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
            m.material.push(0);
        }
        let f = faces_of(m);
        let spaces = [
            HalfSpace { normal: DVec3::new(1.0, 0.3, -0.2), offset: 0.4 },
            HalfSpace { normal: DVec3::new(-1.0, 0.1, 0.5), offset: -0.5 },
        ];
        let mut found = Vec::new();
        f.within(&spaces, |i| found.push(i));
        let mut sorted = Vec::new();
        f.within_until(&spaces, Some(DVec3::X), |i| {
            sorted.push(i);
            false
        });
        let mut first = Vec::new();
        f.within_until(&spaces, Some(DVec3::X), |i| {
            first.push(i);
            first.len() == 3
        });
        assert!(sorted != found && first == sorted[..3]);
        sorted.sort_unstable();
        found.sort_unstable();
        assert_eq!(sorted, found, "another order of the same faces");
        for i in 0..f.faces.len() as u32 {
            let inside = f
                .corners(&f.faces[i as usize])
                .iter()
                .any(|p| spaces.iter().all(|s| s.normal.dot(*p) >= s.offset));
            assert!(!inside || found.contains(&i));
        }
        assert!(found.len() < f.faces.len() * 3 / 4);
    }

    /// What is near is what places on the faces say, and its tree finds the same as that of all.
    #[test]
    fn near_faces_are_those_with_a_near_place() {
        let f = faces_of(grid(16, |i, j| (i + j) % 3 == 0));
        assert!(f.near(f.centre_m, 2.0).is_none(), "all of them");
        assert!(f.near(DVec3::new(0.0, 0.0, 50.0), 1.0).unwrap().faces.nodes.is_empty());
        let place = DVec3::new(0.1, 0.2, 0.9);
        for reach in [0.6, 0.75, 0.9] {
            let near = f.near(place, reach).unwrap();
            assert!(!near.numbers.is_empty() && near.numbers.is_sorted());
            for (i, face) in f.faces.iter().enumerate() {
                let c = f.corners(face);
                let mut nearest = f64::INFINITY;
                for k in 1..c.len() - 1 {
                    for (u, v) in (0..=64).flat_map(|u| (0..=64 - u).map(move |v| (u, v))) {
                        let (u, v) = (f64::from(u) / 64.0, f64::from(v) / 64.0);
                        let p = c[0] + (c[k] - c[0]) * u + (c[k + 1] - c[0]) * v;
                        nearest = nearest.min(p.distance(place));
                    }
                }
                let found = near.numbers.binary_search(&(i as u32));
                assert!(found.is_ok() || nearest > reach, "{i} at {nearest}");
                assert!(found.is_err() || nearest < reach + 0.02, "{i} at {nearest}");
                if let Ok(at) = found {
                    let same = &near.faces.faces[at];
                    assert_eq!((near.faces.corners(same), same.patch), (c, face.patch));
                }
            }
            let space = [HalfSpace { normal: DVec3::Y, offset: 0.3 }];
            let (mut all, mut few) = (Vec::new(), Vec::new());
            f.within(&space, |i| all.push(i));
            near.faces.within(&space, |i| few.push(near.numbers[i as usize]));
            let inside = |i: &u32| f.corners(&f.faces[*i as usize]).iter().any(|p| p.y > 0.3);
            let left: Vec<u32> = near.numbers.iter().copied().filter(inside).collect();
            assert!(left.iter().all(|i| few.contains(i)) && few.iter().all(|i| all.contains(i)));
        }
    }
}
