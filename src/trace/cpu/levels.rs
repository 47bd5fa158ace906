//! Polygons that a device has clipped, level by level, made into the tree of what beams meet.
//!
//! The device decides in f32 what is lit of what ([`super::topology`] tells how). Here corners are worked out from their lines in f64, the
//! radar looks at what is lit, and the views behind the next mirrors are made.

use super::beams::{
    Clipped, Ended, Ends, Node, Piece, Polygon, Side, VisibleFaces, keep, middle, solid_angle_sr,
};
use super::topology::{Corner, Line, Of, PAD, Shared, Views, front};
use crate::base::tasks::Tasks;
use crate::trace::beams::{Frame, Port};
use glam::Vec2;
use rayon::prelude::*;
use std::cmp::Ordering;

/// Kinds of lines in the first word of one.
const EDGE: u32 = 1;
const CROSSING: u32 = 2;
const WALL: u32 = 3;
/// Words of a view in `shaders/shared/views.wgsl`.
pub(crate) const VIEW: usize = 6;

/// From where on a scene's faces, corners, edges and patches are numbered among those of scenes that a device traces together, and its
/// first node with the one behind its last.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Numbers {
    pub faces: u32,
    pub corners: u32,
    pub nodes: [u32; 2],
    pub edges: u32,
    pub patches: u32,
}

/// A polygon that is lit, as the device tells it.
pub(crate) struct LitPolygon {
    /// Index of its face in the scene.
    pub face: u32,
    /// View along which it is lit, of the scene's.
    pub view: u32,
    /// Whether it is all of its face.
    pub whole: bool,
    /// Index of the scene's beam that lights it, or of the window.
    pub from: u32,
    /// Two words for each corner, lines numbered among those of all scenes.
    pub corners: Vec<[u32; 4]>,
}

impl LitPolygon {
    /// By what lights it, then by face. What lies on one face follows in an order that neither the number of scenes nor that of
    /// threads changes: lines are numbered in the order of the scene's own.
    fn order(&self, other: &LitPolygon) -> Ordering {
        let key = |p: &LitPolygon| (p.from, p.face);
        key(self).cmp(&key(other)).then_with(|| self.corners.cmp(&other.corners))
    }
}

/// A lit polygon from which a beam goes on.
pub(crate) struct Onward {
    node: u32,
    first_patch: u32,
    /// View behind the mirror.
    pub view: u32,
    /// The mirror.
    pub face: u32,
    /// Whether its back is lit.
    pub turned: bool,
    /// Two words for each corner.
    pub corners: Vec<[u32; 4]>,
}

/// What is lit of one face by one beam.
struct Item {
    node: Node,
    first_patch: u32,
    view: u32,
    polygons: Vec<LitPolygon>,
}

/// What one polygon adds to the tree.
#[derive(Default)]
struct Added {
    every: Vec<Piece>,
    imaged: Vec<Piece>,
    ended: Vec<Ended>,
}

/// The tree as far as levels are known.
pub(crate) struct Levels<'a> {
    views: Views<'a>,
    numbers: Numbers,
    ends: Option<Ends<'a>>,
    windows: usize,
    /// Of each window.
    seen: Vec<VisibleFaces>,
    out: Clipped,
}

impl<'a> Levels<'a> {
    pub fn new(
        shared: &'a Shared<'a>,
        numbers: Numbers,
        windows: &[Frame],
        ends: Option<Ends<'a>>,
    ) -> Levels<'a> {
        let views = Views::new(shared, windows);
        Levels { views, numbers, ends, windows: windows.len(), seen: Vec::new(), out: Clipped::default() }
    }

    /// Number of bounces after which no beam goes on.
    pub fn most(&self) -> usize {
        let shared = self.views.shared;
        shared.exact.most(shared.options.images)
    }

    /// Number of views that are known.
    pub fn view_count(&self) -> u32 {
        self.views.list.len() as u32
    }

    /// All views that are known, `VIEW` words each, of which the first is numbered `first` among those of all scenes.
    pub fn views(&self, first: u32) -> Vec<[u32; 4]> {
        let (views, shared) = (&self.views.list, self.views.shared);
        let [node, behind] = self.numbers.nodes;
        let sizes = [shared.faces.flat_m, PAD * shared.faces.radius_m].map(|m| (m as f32).to_bits());
        let mut words = Vec::with_capacity(VIEW * views.len());
        let mut levels = Vec::with_capacity(views.len());
        for view in views {
            let level = if view.parent == u32::MAX { 0 } else { levels[view.parent as usize] + 1 };
            levels.push(level);
            words.extend(view.rows.map(|r| r.to_array().map(f32::to_bits)));
            let [x, y, z] = view.origin.to_array().map(f32::to_bits);
            let parent = if view.parent == u32::MAX { u32::MAX } else { first + view.parent };
            words.push([x, y, z, parent]);
            words.push([level, node, behind, shared.options.bounces as u32]);
            words.push([sizes[0], sizes[1], 0, 0]);
        }
        words
    }

    /// Takes what the windows see.
    pub fn first(&mut self, mut found: Vec<LitPolygon>) -> Vec<Onward> {
        found.sort_by(LitPolygon::order);
        let faces = self.views.shared.faces;
        let groups = grouped(found, |p| (p.from, p.face));
        let exact: Vec<Vec<Polygon>> = groups.par_iter().flatten().map_tasks(|p| self.polygons(p)).collect();
        let mut exact = exact.into_iter();
        let mut windows: Vec<Vec<(Vec<Polygon>, bool)>> =
            (0..self.windows).map(|_| vec![Default::default(); faces.faces.len()]).collect();
        for p in groups.iter().flatten() {
            let (polygons, whole) = &mut windows[p.view as usize][p.face as usize];
            *whole = p.whole;
            polygons.extend(exact.next().into_iter().flatten());
        }
        let frame = |view: usize| self.views.list[view].frame;
        self.seen =
            windows.into_iter().enumerate().map(|(i, of)| VisibleFaces::of_window(frame(i), of)).collect();
        let items = groups.into_iter().map(|polygons| {
            let (face, view) = (polygons[0].face, polygons[0].view);
            let node = self.node(u32::MAX, (face, view), 1, (false, false));
            Item { node, first_patch: faces.faces[face as usize].patch, view, polygons }
        });
        let items = items.collect();
        self.add(items)
    }

    /// Takes what `beams` light of what is ahead of them.
    pub fn next(&mut self, beams: &[Onward], mut found: Vec<LitPolygon>) -> Vec<Onward> {
        found.sort_by(LitPolygon::order);
        let shared = self.views.shared;
        let faces = shared.faces;
        let mut items = Vec::new();
        for polygons in grouped(found, |p| (p.from, p.face)) {
            let (beam, face) = (&beams[polygons[0].from as usize], polygons[0].face);
            let parent = &self.out.nodes[beam.node as usize];
            let begins =
                shared.options.images && parent.bounce == 1 && faces.mirrors_points(beam.first_patch);
            let patch = shared.faces.faces[face as usize].patch;
            let imaged = parent.imaged || begins && faces.mirrors(beam.first_patch, patch);
            let endless = parent.endless || begins && faces.is_endless(beam.first_patch, patch);
            if parent.bounce as usize >= shared.exact.most(endless) {
                continue;
            }
            let node = self.node(beam.node, (face, beam.view), parent.bounce + 1, (imaged, endless));
            items.push(Item { node, first_patch: beam.first_patch, view: beam.view, polygons });
        }
        self.add(items)
    }

    pub fn finish(self) -> Clipped {
        let windows = self.views.list[..self.windows].iter().map(|view| view.frame).collect();
        Clipped { windows, ..self.out }
    }

    fn node(
        &self,
        parent: u32,
        (face, view): (u32, u32),
        bounce: u8,
        (imaged, endless): (bool, bool),
    ) -> Node {
        let sign = front(self.views.facing(view, face));
        Node {
            parent,
            face,
            bounce,
            imaged,
            endless,
            frame: self.views.list[view as usize].frame,
            normal: self.views.shared.faces.faces[face as usize].normal * f64::from(sign),
        }
    }

    /// Adds items to the tree, and tells which of their polygons send beams on.
    fn add(&mut self, items: Vec<Item>) -> Vec<Onward> {
        let first = self.out.nodes.len() as u32;
        self.out.nodes.extend(items.iter().map(|item| item.node));
        let this = &*self;
        let added: Vec<Added> = (first..)
            .zip(&items)
            .collect::<Vec<_>>()
            .into_par_iter()
            .map_tasks(|(index, item)| this.added(index, item))
            .collect();
        for new in added {
            self.out.every.extend(new.every);
            self.out.imaged.extend(new.imaged);
            self.out.ended.extend(new.ended);
        }
        let shared = self.views.shared;
        let mut onward = Vec::new();
        for (index, item) in (first..).zip(items) {
            let Item { node, first_patch, view, polygons } = item;
            if !self.goes_on(&node, first_patch) {
                continue;
            }
            let ahead = self.views.mirrored(view, node.face, node.normal);
            let turned = node.normal.dot(shared.faces.faces[node.face as usize].normal) < 0.0;
            onward.extend(polygons.into_iter().map(|p| Onward {
                node: index,
                first_patch,
                view: ahead,
                face: node.face,
                turned,
                corners: p.corners,
            }));
        }
        onward
    }

    fn begins(&self, node: &Node, first_patch: u32) -> bool {
        let shared = self.views.shared;
        shared.options.images && node.bounce == 1 && shared.faces.mirrors_points(first_patch)
    }

    fn goes_on(&self, node: &Node, first_patch: u32) -> bool {
        let shared = self.views.shared;
        let begins = self.begins(node, first_patch);
        !shared.exact.ends_on(&shared.faces.faces[node.face as usize])
            && (node.bounce as usize) < shared.exact.most(node.endless || begins)
    }

    fn added(&self, index: u32, item: &Item) -> Added {
        let (node, shared) = (&item.node, self.views.shared);
        let radar = Port::At(self.views.list[0].frame.origin);
        let patch = shared.faces.faces[node.face as usize].patch;
        let is_end = shared.exact.ends_on(&shared.faces.faces[node.face as usize]);
        let is_imaged = is_end || node.imaged && shared.faces.mirrors(item.first_patch, patch);
        let is_cut = !is_end && node.bounce as usize >= shared.exact.most(node.endless);
        let ends = self.ends.as_ref().filter(|_| is_cut);
        let mut added = Added::default();
        for polygon in item.polygons.iter().flat_map(|p| self.polygons(p)) {
            let radiate = |is_seen: bool, out: &mut Vec<Piece>| {
                shared.exact.radiate(index, node, &polygon, is_seen, &self.seen, radar, out);
            };
            if node.bounce == 1 || !is_end {
                radiate(node.bounce == 1, &mut added.every);
            }
            if is_imaged && !(is_end && node.bounce == 1) {
                radiate(true, &mut added.imaged);
            }
            if let Some(ends) = ends {
                self.end(ends, (index, item), &polygon, &mut added.ended);
            }
        }
        added
    }

    /// Lists what a beam that the limit of bounces ends would meet next.
    fn end(&self, ends: &Ends<'_>, (index, item): (u32, &Item), polygon: &Polygon, out: &mut Vec<Ended>) {
        if ends.most(solid_angle_sr(polygon)) <= ends.least {
            return;
        }
        let (node, shared) = (&item.node, self.views.shared);
        let face = &shared.faces.faces[node.face as usize];
        let source = Side::facing(face, node.normal);
        let frame = node.frame.mirrored(node.normal, source.offset);
        let begins = self.begins(node, item.first_patch);
        let left = shared.exact.left(ends, &self.out.nodes, index, middle(polygon));
        let mut met = Vec::new();
        shared.exact.end(ends, (index, left), polygon, (&frame, &source), &mut met);
        let patch = |face: u32| shared.faces.faces[face as usize].patch;
        let is_followed = |e: &Ended| begins && shared.faces.is_endless(item.first_patch, patch(e.face));
        out.extend(met.into_iter().filter(|e| !is_followed(e)));
    }

    /// A polygon in the coordinates of its view, in pieces of few corners.
    fn polygons(&self, p: &LitPolygon) -> Vec<Polygon> {
        let behind: Vec<u32> = self.views.behind(p.view).collect();
        let line = |first: u32, second: u32| {
            let (kind, level, number) = (first >> 28 & 7, first >> 24 & 0xf, first & 0xff_ffff);
            let of = match kind {
                EDGE => Of::Edge(number - self.numbers.edges),
                CROSSING => Of::Crossing([number, second].map(|p| p - self.numbers.patches)),
                WALL => Of::Wall(number),
                _ => Of::Halving { axis: number, bits: second },
            };
            Line { of, view: behind[behind.len() - 1 - level as usize] }
        };
        let corner = |c: &[[u32; 4]]| Corner {
            at: Vec2::new(f32::from_bits(c[0][0]), f32::from_bits(c[0][1])),
            on: [line(c[0][2], c[0][3]), line(c[1][0], c[1][1])],
        };
        let corners: Vec<Corner> = p.corners.chunks_exact(2).map(corner).collect();
        let face = &self.views.shared.faces.faces[p.face as usize];
        let mut out = Vec::with_capacity(1);
        for polygon in self.views.exactly(&corners, p.view, face).iter().flat_map(|c| Polygon::of(c)) {
            keep(&polygon, 0.0, &mut out);
        }
        out
    }
}

/// Neighbours of one key.
fn grouped(found: Vec<LitPolygon>, key: impl Fn(&LitPolygon) -> (u32, u32)) -> Vec<Vec<LitPolygon>> {
    let mut groups: Vec<Vec<LitPolygon>> = Vec::new();
    for p in found {
        match groups.last_mut() {
            Some(last) if key(&last[0]) == key(&p) => last.push(p),
            _ => groups.push(vec![p]),
        }
    }
    groups
}
