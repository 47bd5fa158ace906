//! Polygons that a device has clipped, level by level, made into the tree of what beams meet.
//!
//! The device decides in f32 what is lit of what ([`super::topology`] tells how). Here corners are worked out from their lines in f64, the
//! radar looks at what is lit, and the views behind the next mirrors are made.

use super::beams::{Clipped, Ended, Ends, Node, Piece, Polygon, Side, middle, solid_angle_sr};
use super::topology::{Beams, Corner, LineId, Of, Outline, Seen, Shared, front};
use crate::trace::beams::Frame;
use glam::{DVec2, Vec2};
use rayon::prelude::*;

/// Kinds of lines in the first word of one.
const EDGE: u32 = 1;
const CROSSING: u32 = 2;
const WALL: u32 = 3;

/// A polygon that is lit, as the device tells it.
pub(crate) struct LitPolygon {
    /// Index of its face.
    pub face: u32,
    /// View along which it is lit.
    pub view: u32,
    /// Whether it is all of its face.
    pub whole: bool,
    /// Index of the beam that lights it, or of the pair of a window and a face.
    pub from: u32,
    /// Two words for each corner.
    pub corners: Vec<[u32; 4]>,
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
    beams: Beams<'a>,
    ends: Option<Ends<'a>>,
    windows: usize,
    seen: Vec<Seen>,
    out: Clipped,
}

impl<'a> Levels<'a> {
    pub fn new(shared: &'a Shared<'a>, windows: &[Frame], ends: Option<Ends<'a>>) -> Levels<'a> {
        Levels {
            beams: Beams::new(shared, windows),
            ends,
            windows: windows.len(),
            seen: Vec::new(),
            out: Clipped::default(),
        }
    }

    /// Number of bounces after which no beam goes on.
    pub fn most(&self) -> usize {
        self.beams.shared.exact.most(self.beams.shared.options.images)
    }

    /// All views that are known, five words each.
    pub fn views(&self) -> Vec<[u32; 4]> {
        let views = &self.beams.views;
        let mut words = Vec::with_capacity(5 * views.len());
        let mut levels = Vec::with_capacity(views.len());
        for view in views {
            let level = if view.parent == u32::MAX { 0 } else { levels[view.parent as usize] + 1 };
            levels.push(level);
            words.extend(view.rows.map(|r| r.to_array().map(f32::to_bits)));
            let [x, y, z] = view.origin.to_array().map(f32::to_bits);
            words.push([x, y, z, view.parent]);
            words.push([level, 0, 0, 0]);
        }
        words
    }

    /// Takes what the windows see, where `from` counts the faces of each window.
    pub fn first(&mut self, mut found: Vec<LitPolygon>) -> Vec<Onward> {
        found.sort_by_key(|p| p.from);
        let n = self.beams.shared.faces.faces.len();
        self.seen = (0..self.windows)
            .map(|_| Seen { polygons: vec![Vec::new(); n], whole: vec![false; n] })
            .collect();
        for p in &found {
            let outline = self.outline(p);
            let seen = &mut self.seen[p.view as usize];
            seen.whole[p.face as usize] = p.whole;
            seen.polygons[p.face as usize].push(outline);
        }
        let items = grouped(found, |p| (p.from, p.face)).into_iter().map(|polygons| {
            let (face, view) = (polygons[0].face, polygons[0].view);
            let node = self.node(u32::MAX, (face, view), 1, (false, false));
            Item { node, first_patch: self.beams.face(face).patch, view, polygons }
        });
        let items = items.collect();
        self.add(items)
    }

    /// Takes what `beams` light of what is ahead of them.
    pub fn next(&mut self, beams: &[Onward], mut found: Vec<LitPolygon>) -> Vec<Onward> {
        found.sort_by_key(|p| (p.from, p.face));
        let shared = self.beams.shared;
        let faces = shared.faces;
        let mut items = Vec::new();
        for polygons in grouped(found, |p| (p.from, p.face)) {
            let (beam, face) = (&beams[polygons[0].from as usize], polygons[0].face);
            let parent = &self.out.nodes[beam.node as usize];
            let begins =
                shared.options.images && parent.bounce == 1 && faces.mirrors_points(beam.first_patch);
            let patch = self.beams.face(face).patch;
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
        self.out
    }

    fn node(
        &self,
        parent: u32,
        (face, view): (u32, u32),
        bounce: u8,
        (imaged, endless): (bool, bool),
    ) -> Node {
        let sign = front(self.beams.facing(view, face));
        Node {
            parent,
            face,
            bounce,
            imaged,
            endless,
            frame: self.beams.views[view as usize].frame,
            normal: self.beams.face(face).normal * f64::from(sign),
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
            .map(|(index, item)| this.added(index, item))
            .collect();
        for new in added {
            self.out.every.extend(new.every);
            self.out.imaged.extend(new.imaged);
            self.out.ended.extend(new.ended);
        }
        let shared = self.beams.shared;
        let mut onward = Vec::new();
        for (index, item) in (first..).zip(items) {
            let Item { node, first_patch, view, polygons } = item;
            if !self.goes_on(&node, first_patch) {
                continue;
            }
            let ahead = self.beams.mirrored(view, node.face, node.normal);
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
        let shared = self.beams.shared;
        shared.options.images && node.bounce == 1 && shared.faces.mirrors_points(first_patch)
    }

    fn goes_on(&self, node: &Node, first_patch: u32) -> bool {
        let begins = self.begins(node, first_patch);
        (node.bounce as usize) < self.beams.shared.exact.most(node.endless || begins)
    }

    fn added(&self, index: u32, item: &Item) -> Added {
        let (node, shared) = (&item.node, self.beams.shared);
        let sign = front(self.beams.facing(item.view, node.face));
        let patch = shared.faces.faces[node.face as usize].patch;
        let is_imaged = node.imaged && shared.faces.mirrors(item.first_patch, patch);
        let mut added = Added::default();
        for p in &item.polygons {
            let outline = self.outline(p);
            let along = (item.view, sign);
            let is_first = node.bounce == 1;
            self.beams.radiate((index, node), along, &outline, is_first, &self.seen, &mut added.every);
            if is_imaged {
                self.beams.radiate((index, node), along, &outline, true, &self.seen, &mut added.imaged);
            }
            if let Some(ends) = &self.ends
                && node.bounce as usize >= shared.exact.most(node.endless)
            {
                self.end(ends, (index, item), &outline, &mut added.ended);
            }
        }
        added
    }

    /// Lists what a beam that the limit of bounces ends would meet next.
    fn end(&self, ends: &Ends<'_>, (index, item): (u32, &Item), outline: &Outline, out: &mut Vec<Ended>) {
        let (node, shared) = (&item.node, self.beams.shared);
        let face = self.beams.face(node.face);
        let offset = node.normal.dot(face.normal) * face.offset_m;
        let (frame, source) =
            (node.frame.mirrored(node.normal, offset), Side { normal: node.normal, offset });
        let begins = self.begins(node, item.first_patch);
        let corners: Vec<DVec2> = outline.iter().map(|c| c.at.as_dvec2()).collect();
        for polygon in Polygon::of(&corners) {
            if ends.most(solid_angle_sr(&polygon)) <= ends.least {
                continue;
            }
            let left = shared.exact.left(ends, &self.out.nodes, index, middle(&polygon));
            let mut met = Vec::new();
            shared.exact.end(ends, (index, left), &polygon, (&frame, &source), &mut met);
            let patch = |face: u32| shared.faces.faces[face as usize].patch;
            out.extend(
                met.into_iter()
                    .filter(|e| !(begins && shared.faces.is_endless(item.first_patch, patch(e.face)))),
            );
        }
    }

    fn outline(&self, p: &LitPolygon) -> Outline {
        let of = |first: u32, second: u32| self.line((first, second), p.view);
        p.corners
            .chunks_exact(2)
            .map(|c| Corner {
                at: Vec2::new(f32::from_bits(c[0][0]), f32::from_bits(c[0][1])),
                on: [of(c[0][2], c[0][3]), of(c[1][0], c[1][1])],
                side: of(c[1][2], c[1][3]),
            })
            .collect()
    }

    /// The line of these two words, of something that is lit along `view`.
    fn line(&self, (first, second): (u32, u32), view: u32) -> LineId {
        let (kind, level, number) = (first >> 28, first >> 24 & 0xf, first & 0xff_ffff);
        let parents = std::iter::successors(Some(view), |v| {
            Some(self.beams.views[*v as usize].parent).filter(|p| *p != u32::MAX)
        });
        let views: Vec<u32> = parents.collect();
        let seen_in = views[views.len() - 1 - level as usize];
        let chain = self.beams.views[seen_in as usize].chain;
        let of = match kind {
            EDGE => Of::Edge { chain, edge: number },
            CROSSING => Of::Crossing { chain, patches: [number, second] },
            WALL => Of::Wall { view: seen_in, wall: number },
            _ => Of::Halving { view: seen_in, axis: number, bits: second },
        };
        LineId { of, received: false }
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
