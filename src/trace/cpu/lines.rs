//! Visibility by lines: what a radar lights directly and by way of mirrors, as fragments of straight lines.
//!
//! The lit part of a patch is never a polygon. Its outline is a list of fragments, each by itself: parts of the patch's own edges,
//! shadows of silhouettes on it, and walls of the window through which the radar looks. Areas, moments and waves are sums over fragments.
//!
//! A view is a source of rays, the radar or its image behind the last of a chain of mirrors, with all legs of the path to it.
//!
//! 1. **Edges.** Every edge ahead is split where the view's outline of the last mirror, or the walls of the windows, bound what can be lit; what
//!    comes through is split where nearer silhouettes cross it and where it pierces a face. Rays to the middle of each part, one for each leg,
//!    decide whether the part is lit.
//! 2. **Half-faces.** A lit part is outline of each lit face that meets in it, unless another of them hides it there.
//! 3. **Shadows.** A lit part of a silhouette throws its shadow on what lies behind its free side. The part is split where edges farther
//!    away cross it; one ray finds the face behind each piece; the fragment is the plane through source and edge on that face.
//! 4. **Walls** of windows are shadows of the same kind, and so is the outline of what is lit of a mirror, in the view behind it.
//!
//! Rays run beside the lines, not on them (a few nanometres), so that each is decided by what lies on either side. Which of two faces hides the
//! other where they lie in one plane follows the rules of the polygons ([`super::beams`], CONVENTIONS eq. 65b). Chains of views are followed
//! in [`super::chains`].

use super::beams::{GRAZING, Side};
use crate::base::tasks::Tasks;
use crate::geom::edge_table::{Edge, EdgeTable, HalfFace};
use crate::geom::faces::{Face, Faces, LIES_M, misses_segment};
use crate::geom::tree::BoxTree;
use crate::trace::MAX_BOUNCES;
use crate::trace::beams::Frame;
use glam::DVec3;
use rayon::prelude::*;
use std::cell::Cell;

/// How far beside a line a ray decides at most, m: above the rounding of positions in f64, below every distance that a mesh means.
/// Beside a short part it is the share [`BESIDE`] of its length, so that the ray stays beside the part.
const BESIDE_M: f64 = 6e-9;
const BESIDE: f64 = 0.02;
/// A silhouette counts as nearer than a segment up to so far behind it, m: a split too many changes nothing, and faces that lie on one
/// another hide each other from behind.
const SLACK_M: f64 = 0.05;
/// What comes so near to a line touches it, m: farther than a ray decides beside it. One split too many changes nothing.
const TOUCHING_M: f64 = 1e-8;
/// Shorter parts are left out, m.
const SHORTEST_M: f64 = 1e-10;
/// Sine of the angle to the plane of sight below which a half-face covers neither side of its edge.
const EDGE_ON: f64 = 1e-9;
/// Sine of the angle to a mirror from which on a face rises from it.
const STEEP: f64 = 1e-3;
/// Rounding of the share of a way at which it leaves a mirror.
const ON_MIRROR: f64 = 1e-12;
/// Rounding along a ray, m.
const ROUNDING_M: f64 = 1e-9;
/// Value of `Fragment::edge` where there is none.
pub(in crate::trace) const NO_EDGE: u32 = u32::MAX;

/// A part of the outline of what is lit of a patch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fragment {
    /// Both ends on the patch, m.
    pub ends_m: [DVec3; 2],
    /// Unit vector in the patch towards its lit side.
    pub inward: DVec3,
    /// Index of a face of the patch.
    pub face: u32,
    /// The edge along which the fragment runs, or `NO_EDGE`.
    pub(in crate::trace) edge: u32,
    /// Whether that edge is one of the patch: what radiates ends there in every view.
    is_side: bool,
}

impl Fragment {
    /// Its share of the area by Green's theorem, m²: the sum over all fragments of a patch is the lit area, whatever the origin.
    pub fn area_m2(&self, origin_m: DVec3, normal: DVec3) -> f64 {
        let [a, b] = self.ends_m.map(|p| p - origin_m);
        0.5 * self.turn(normal) * normal.dot(a.cross(b))
    }

    /// The fragment as a vector with the lit side on its left. The sum over all fragments of a patch is zero.
    pub fn vector_m(&self, normal: DVec3) -> DVec3 {
        (self.ends_m[1] - self.ends_m[0]) * self.turn(normal)
    }

    fn turn(&self, normal: DVec3) -> f64 {
        normal.cross(self.ends_m[1] - self.ends_m[0]).dot(self.inward).signum()
    }

    fn at(&self, share: f64) -> DVec3 {
        self.ends_m[0] + (self.ends_m[1] - self.ends_m[0]) * share
    }
}

/// Where a segment comes as near as `margin_m` to a plane over which its ends stand so high, m: nowhere, in one place, or from end to end.
fn meeting([a, b]: [DVec3; 2], [u, v]: [f64; 2], margin_m: f64) -> impl Iterator<Item = DVec3> {
    let is_met = u.min(v) <= margin_m && u.max(v) >= -margin_m;
    let (first, second) = match u.abs().max(v.abs()) <= margin_m {
        true => (a, Some(b)),
        false => (a + (b - a) * (u / (u - v)).clamp(0.0, 1.0), None),
    };
    [Some(first), second].into_iter().flatten().filter(move |_| is_met)
}

/// The plane through a source and a segment, between the rays to the segment's ends.
struct Wedge {
    source: DVec3,
    normal: DVec3,
    /// Positive inside: normals of the planes through the rays to the first and to the second end. What they are at a place is as the shares
    /// of the segment before and behind the ray through it.
    sides: [DVec3; 2],
}

impl Wedge {
    fn new(source: DVec3, ends_m: [DVec3; 2]) -> Option<Wedge> {
        let [a, b] = ends_m.map(|p| p - source);
        let normal = a.cross(b).try_normalize()?;
        Some(Wedge { source, normal, sides: [normal.cross(a), b.cross(normal)] })
    }

    /// The share of the segment at which the ray to a place crosses it.
    fn share(&self, x: DVec3) -> Option<f64> {
        let [a, b] = self.sides.map(|side| side.dot(x - self.source));
        (a > 0.0 && b > 0.0).then(|| a / (a + b))
    }
}

/// What does not depend on the chain of mirrors.
pub(in crate::trace) struct Scene<'a> {
    pub(in crate::trace) faces: &'a Faces,
    pub(in crate::trace) table: &'a EdgeTable,
    pub(in crate::trace) windows: &'a [Frame],
    pub(in crate::trace) radar: DVec3,
    /// Whether rays from the radar can meet each face.
    pub(in crate::trace) lit: Vec<bool>,
    /// A face of each patch, in whose plane the patch's outline is given: corners of a file may be a little off it, and outlines must close.
    pub(in crate::trace) leads: Vec<u32>,
    /// Of each edge the free side as the radar sees it ([`View::free_side`]).
    pub(in crate::trace) free: Vec<f64>,
}

/// A patch that mirrors, seen from its lit side.
#[derive(Clone, Copy)]
pub(in crate::trace) struct Mirror {
    /// The face in whose plane it mirrors.
    pub(in crate::trace) lead: u32,
    side: Side,
}

impl Mirror {
    /// Unit normal on the lit side, and what its product with positions in the plane is, m.
    pub(in crate::trace) fn plane(&self) -> (DVec3, f64) {
        (self.side.normal, self.side.offset)
    }

    fn height(&self, p: DVec3) -> f64 {
        self.side.normal.dot(p) - self.side.offset
    }

    /// Where the ray from a source to a place meets the plane.
    fn met_from(&self, source: DVec3, p: DVec3) -> DVec3 {
        let (from, to) = (self.height(source), self.height(p));
        source + (p - source) * (from / (from - to))
    }

    fn image(&self, p: DVec3) -> DVec3 {
        p - self.side.normal * (2.0 * self.height(p))
    }
}

/// A leg of a path: the source that it comes from, and the mirror that it leaves.
#[derive(Clone, Copy)]
pub(in crate::trace) struct Leg {
    pub(in crate::trace) source: DVec3,
    pub(in crate::trace) mirror: Option<Mirror>,
}

/// What is crossed by the wedge between a source and a segment.
#[derive(Clone, Copy, PartialEq)]
enum Reach {
    /// Silhouettes nearer than the segment.
    Nearer,
    /// All edges of lit faces beyond the segment.
    Beyond,
}

/// The rays of a radar, or of its image behind the last of a chain of mirrors.
pub(in crate::trace) struct View<'a> {
    pub(in crate::trace) scene: &'a Scene<'a>,
    pub(in crate::trace) legs: Vec<Leg>,
    /// Outline of what is lit of the last mirror.
    outline: Outline<'a>,
}

/// An outline that can be asked for what comes near to a place.
#[derive(Default)]
struct Outline<'a> {
    fragments: &'a [Fragment],
    /// Over the fragments where they are many, and the fragment that each of its items stands for.
    tree: Option<(BoxTree, Vec<u32>)>,
}

impl<'a> Outline<'a> {
    /// So few fragments are looked at one by one.
    const FEW: usize = 24;

    fn new(fragments: &'a [Fragment]) -> Outline<'a> {
        let bounds = |f: &Fragment| {
            let [a, b] = f.ends_m;
            (a.min(b), a.max(b))
        };
        let tree = || BoxTree::new(&fragments.iter().map(bounds).collect::<Vec<_>>(), 4);
        Outline { fragments, tree: (fragments.len() > Self::FEW).then(tree) }
    }

    /// Calls `visit` with the fragments whose boxes are not missed.
    fn visit(&self, misses: impl Fn(DVec3, DVec3) -> bool, mut visit: impl FnMut(&Fragment)) {
        match &self.tree {
            None => self.fragments.iter().for_each(visit),
            Some((tree, order)) => tree.visit(misses, |i| {
                visit(&self.fragments[order[i as usize] as usize]);
                false
            }),
        }
    }
}

impl<'a> Scene<'a> {
    /// None without windows.
    pub fn new(faces: &'a Faces, table: &'a EdgeTable, windows: &'a [Frame]) -> Option<Scene<'a>> {
        let first = windows.first()?;
        let radar = first.origin;
        let mut leads = vec![0; faces.patch_area_m2.len()];
        faces.faces.iter().enumerate().for_each(|(i, f)| leads[f.patch as usize] = i as u32);
        let scene = Scene { faces, table, windows, radar, lit: Vec::new(), leads, free: Vec::new() };
        let view = scene.view();
        let lit = faces.faces.iter().map(|f| view.can_meet(0, f)).collect();
        let scene = Scene { lit, ..scene };
        let view = scene.view();
        let free = table.edges.iter().map(|e| view.free_side(0, e)).collect();
        Some(Scene { free, ..scene })
    }

    /// The radar's own view.
    pub fn view(&self) -> View<'_> {
        View {
            scene: self,
            legs: vec![Leg { source: self.radar, mirror: None }],
            outline: Outline::default(),
        }
    }

    /// The face of a patch in whose plane outlines lie.
    pub fn lead(&self, patch: u32) -> u32 {
        self.leads[patch as usize]
    }

    fn face(&self, i: u32) -> &Face {
        &self.faces.faces[i as usize]
    }

    fn is_in_window(&self, p: DVec3) -> bool {
        let d = p - self.radar;
        self.windows.iter().any(|w| {
            let k = w.k.dot(d);
            k > 0.0 && w.u.dot(d).abs() <= k && w.v.dot(d).abs() <= k
        })
    }

    /// Whether a smaller face lies on the plane of a larger one of another body: then it is lit and the other is not.
    fn lies_on(&self, face: &Face, other: &Face) -> bool {
        let area = |f: &Face| (self.faces.patch_area_m2[f.patch as usize], f.body);
        face.body != other.body
            && area(face) < area(other)
            && self.faces.corners(face).iter().all(|p| height(other, *p).abs() <= LIES_M)
    }

    /// Whether an edge lies in the plane of a face.
    fn touches(&self, edge: &Edge, face: &Face, is_lit: impl Fn(u32) -> bool) -> bool {
        let halves = self.table.halves(edge);
        edge.ends_m.iter().all(|p| height(face, *p).abs() <= self.faces.flat_m)
            || halves.iter().any(|h| is_lit(h.face) && self.lies_on(self.face(h.face), face))
    }
}

impl<'a> View<'a> {
    /// The view behind a patch, its outline still to be given; None where the source lies in the patch's plane.
    pub fn behind(&self, patch: u32) -> Option<View<'a>> {
        let lead = self.scene.leads[patch as usize];
        let face = self.scene.face(lead);
        let source = self.source();
        let side = Side::of(face, -height(face, source));
        let mirror = Mirror { lead, side };
        let leg = Leg { source: mirror.image(source), mirror: Some(mirror) };
        let legs = [&self.legs[..], &[leg]].concat();
        (mirror.height(source) > 0.0).then(|| View { scene: self.scene, legs, outline: Outline::default() })
    }

    /// The same view with the outline of what is lit of its last mirror.
    pub fn through(self, lit: &'a [Fragment]) -> View<'a> {
        View { outline: Outline::new(lit), ..self }
    }

    fn last(&self) -> usize {
        self.legs.len() - 1
    }

    /// Where rays seem to come from, m.
    pub fn source(&self) -> DVec3 {
        self.legs[self.last()].source
    }

    /// Whether rays of a leg can meet a face.
    fn is_lit(&self, leg: usize, face: u32) -> bool {
        match leg {
            0 => self.scene.lit[face as usize],
            _ => self.can_meet(leg, self.scene.face(face)),
        }
    }

    fn can_meet(&self, leg: usize, face: &Face) -> bool {
        let Leg { source, mirror } = &self.legs[leg];
        let (faces, height) = (self.scene.faces, height(face, *source));
        let above_m = faces.flat_m.max(LIES_M);
        height.abs() > GRAZING * faces.radius_m
            && !(face.one_sided && height < 0.0)
            && mirror.is_none_or(|m| {
                face.patch != self.scene.face(m.lead).patch
                    && faces.corners(face).iter().any(|p| m.height(*p) > above_m)
            })
    }

    /// The side of the plane through a leg's source and an edge that nothing at the edge covers, as the sign of (a - source) x (b - source);
    /// 0 where the edge is no silhouette.
    fn free_side(&self, leg: usize, edge: &Edge) -> f64 {
        let (s, [a, b]) = (self.legs[leg].source, edge.ends_m);
        let Some(normal) = (a - s).cross(b - s).try_normalize() else { return 0.0 };
        let (mut above, mut below) = (false, false);
        let in_plane = self.legs[leg]
            .mirror
            .filter(|m| edge.ends_m.iter().all(|p| m.height(*p).abs() <= self.scene.faces.flat_m));
        // In the plane of the mirror only what rises from it counts.
        let rises = |h: &HalfFace| in_plane.is_none_or(|m| m.side.normal.dot(h.inward) > EDGE_ON);
        let halves = self.scene.table.halves(edge);
        for half in halves.iter().filter(|h| rises(h) && self.is_lit(leg, h.face)) {
            let sine = normal.dot(half.inward);
            above |= sine > EDGE_ON;
            below |= sine < -EDGE_ON;
        }
        match (above, below) {
            (true, false) => -1.0,
            (false, true) => 1.0,
            _ => 0.0,
        }
    }

    fn is_silhouette(&self, number: usize) -> bool {
        match self.last() {
            0 => self.scene.free[number] != 0.0,
            last => self.free_side(last, &self.scene.table.edges[number]) != 0.0,
        }
    }

    /// Appends the shares of the segment `a`, `b` at which edges cross it as the last leg sees them.
    fn crossings(&self, [a, b]: [DVec3; 2], own: usize, reach: Reach, out: &mut Vec<f64>) {
        let (table, faces, last) = (self.scene.table, self.scene.faces, self.last());
        let Leg { source: s, mirror } = self.legs[last];
        let Some(wedge) = Wedge::new(s, [a, b]) else { return };
        let Wedge { normal, sides: [from_a, to_b], .. } = wedge;
        let out_of = normal.cross(b - a).normalize();
        // The distance beyond the segment.
        let far = if out_of.dot(a - s) < 0.0 { -out_of } else { out_of };
        let [n, p, q] = [normal, from_a, to_b].map(|v: DVec3| v.abs());
        // The box around what is asked for.
        let end = |x: DVec3| match reach {
            Reach::Nearer => s + (x - s) * self.start(last, x - s).clamp(0.0, 1.0),
            Reach::Beyond => {
                let most = s.distance(faces.centre_m) + faces.radius_m;
                s + (x - s) * (most / (x - s).length()).max(1.0)
            }
        };
        let corners = [a, b, end(a), end(b)];
        let slack = DVec3::splat(SLACK_M);
        let lo = corners.into_iter().fold(a, DVec3::min) - slack;
        let hi = corners.into_iter().fold(a, DVec3::max) + slack;
        let misses = |centre: DVec3, half: DVec3| {
            let d = centre - s;
            (centre - half).cmpgt(hi).any()
                || (centre + half).cmplt(lo).any()
                || normal.dot(d).abs() > n.dot(half)
                || from_a.dot(d) < -p.dot(half)
                || to_b.dot(d) < -q.dot(half)
        };
        table.tree.visit(misses, |i| {
            let i = i as usize;
            if i == own || last == 0 && reach == Reach::Nearer && self.scene.free[i] == 0.0 {
                return false;
            }
            let edge = &table.edges[i];
            let [first, second] = edge.ends_m;
            let heights = [normal.dot(first - s), normal.dot(second - s)];
            for x in meeting(edge.ends_m, heights, TOUCHING_M) {
                let depth = far.dot(x - a);
                let is_asked_for = match reach {
                    Reach::Nearer => depth < SLACK_M,
                    Reach::Beyond => depth > -ROUNDING_M,
                };
                if let Some(share) = wedge.share(x)
                    && is_asked_for
                    && mirror.is_none_or(|m| m.height(x) > -LIES_M)
                    && match reach {
                        Reach::Nearer => self.is_silhouette(i),
                        Reach::Beyond => table.halves(edge).iter().any(|h| self.is_lit(last, h.face)),
                    }
                {
                    out.push(share);
                }
            }
            false
        });
    }

    /// Appends the shares of a segment at which it comes to the bounds of what the last mirror lights, or the windows, if nothing is before it.
    fn bounds(&self, ends_m: [DVec3; 2], shares: &mut Vec<f64>) {
        let cut = |[p, q]: [f64; 2], shares: &mut Vec<f64>| {
            if (p > 0.0) != (q > 0.0) {
                shares.push(p / (p - q));
            }
        };
        let Leg { source, mirror: Some(mirror) } = self.legs[self.last()] else {
            for wall in self.scene.windows.iter().flat_map(walls) {
                cut(ends_m.map(|e| wall.dot(e - self.scene.radar)), shares);
            }
            return;
        };
        cut(ends_m.map(|p| mirror.height(p)), shares);
        // Where it crosses the outline of what is lit of the mirror. One split too many changes nothing, so that ends count too.
        let Some(wedge) = Wedge::new(source, ends_m) else { return };
        let [n, p, q] = [wedge.normal, wedge.sides[0], wedge.sides[1]].map(|v: DVec3| v.abs());
        let misses = |centre: DVec3, half: DVec3| {
            let (d, half) = (centre - source, half + TOUCHING_M);
            wedge.normal.dot(d).abs() > n.dot(half)
                || wedge.sides[0].dot(d) < -p.dot(half)
                || wedge.sides[1].dot(d) < -q.dot(half)
        };
        self.outline.visit(misses, |f| {
            let heights = f.ends_m.map(|x| wedge.normal.dot(x - source));
            shares.extend(meeting(f.ends_m, heights, TOUCHING_M).filter_map(|x| wedge.share(x)));
        });
    }

    /// Whether the legs before the last lead to a place.
    fn comes_to(&self, p: DVec3) -> bool {
        if self.last() == 0 {
            return self.scene.is_in_window(p);
        }
        // Where the path meets each mirror, from the last on.
        let mut places = [DVec3::ZERO; MAX_BOUNCES + 1];
        let mut at = p;
        for leg in (1..self.legs.len()).rev() {
            let Leg { source, mirror: Some(mirror) } = &self.legs[leg] else { return false };
            let d = at - *source;
            let share = -mirror.height(*source) / mirror.side.normal.dot(d);
            if !(share > 0.0 && share <= 1.0 + ON_MIRROR) {
                return false;
            }
            at = *source + d * share;
            places[leg] = at;
        }
        if !self.scene.is_in_window(at) {
            return false;
        }
        (1..self.legs.len()).all(|leg| {
            let Some(mirror) = &self.legs[leg].mirror else { return false };
            let d = places[leg] - self.legs[leg - 1].source;
            let on = self.face_of_patch(leg - 1, self.scene.face(mirror.lead), d);
            on.is_some_and(|face| self.reaches_face(leg - 1, places[leg], face, &[]))
        })
    }

    /// Whether a place on a face is lit.
    fn lights(&self, p: DVec3, face: u32, skip: &[HalfFace]) -> bool {
        self.comes_to(p) && self.reaches_face(self.last(), p, face, skip)
    }

    /// All fragments of what the rays light, in a fixed order.
    pub fn fragments(&self) -> Vec<Fragment> {
        if self.last() == 0 { self.of_windows() } else { self.of_mirror() }
    }

    /// Outline of what is lit of the last mirror.
    pub(in crate::trace) fn outline(&self) -> &'a [Fragment] {
        self.outline.fragments
    }

    /// The fragment that has a name.
    pub(in crate::trace) fn fragment_named(&self, name: &Name) -> Fragment {
        let Scene { table, .. } = *self.scene;
        let s = self.source();
        let normal = |[a, b]: [DVec3; 2]| (a - s).cross(b - s).normalize_or_zero();
        let (whole, free) = match name.line {
            Line::Side { edge, half } => {
                let edge = &table.edges[edge as usize];
                (edge.ends_m, table.halves(edge)[half as usize].inward)
            }
            Line::Shadow { edge, side } => {
                let ends_m = table.edges[edge as usize].ends_m;
                (ends_m, normal(ends_m) * side)
            }
            Line::Wall { window, wall } => wall_of(&self.scene.windows[window as usize], wall as usize),
            Line::Outline(number) => {
                let of = &self.outline.fragments[number as usize];
                let normal = normal(of.ends_m);
                (of.ends_m, normal * normal.dot(of.inward).signum())
            }
        };
        let ends_m = name.shares.map(|t| whole[0] + (whole[1] - whole[0]) * t);
        if let Line::Side { edge, .. } = name.line {
            return self.fragment(ends_m, free, name.face, edge, true);
        }
        let along = match name.line {
            Line::Shadow { edge, .. } if name.is_along => edge,
            Line::Outline(number) if name.is_along => self.outline.fragments[number as usize].edge,
            _ => NO_EDGE,
        };
        let normal = self.scene.face(name.face).normal;
        let inward = (free - normal * free.dot(normal)).normalize_or_zero();
        self.fragment(ends_m, inward, name.face, along, false)
    }

    /// All fragments that the radar's own view has, in a fixed order.
    fn of_windows(&self) -> Vec<Fragment> {
        let edges = 0..self.scene.table.edges.len();
        let parts: Vec<Vec<Fragment>> =
            edges.into_par_iter().with_min_len(64).map_tasks(|i| self.of_edge(i, [0.0, 1.0])).collect();
        let of_window = |w| (0..4).flat_map(|k| self.of_wall(w, k)).collect();
        let walls: Vec<Vec<Fragment>> = self.scene.windows.par_iter().map_tasks(of_window).collect();
        parts.into_iter().chain(walls).flatten().collect()
    }

    /// All fragments of what lies behind the last mirror, in a fixed order.
    fn of_mirror(&self) -> Vec<Fragment> {
        let lit = self.outline.fragments;
        let edges = self.ahead();
        let parts: Vec<Vec<Fragment>> =
            edges.par_iter().with_min_len(64).map_tasks(|(i, shares)| self.of_edge(*i, *shares)).collect();
        let outlines: Vec<Vec<Fragment>> =
            lit.par_iter().with_min_len(16).map_tasks(|f| self.of_outline(f)).collect();
        parts.into_iter().chain(outlines).flatten().collect()
    }

    /// Half-spaces around the cone of rays through what is lit of the last mirror: where the product of a normal and the vector from the
    /// source is not less than a number, m. None without a mirror.
    pub(in crate::trace) fn spaces(&self) -> Vec<(DVec3, f64)> {
        let Leg { source: s, mirror: Some(mirror) } = self.legs[self.last()] else { return Vec::new() };
        let lit = self.outline.fragments;
        let mut spaces = vec![(mirror.side.normal, -mirror.height(s) - LIES_M)];
        let middle = |f: &Fragment| (f.at(0.5) - s).normalize_or_zero();
        let axis = lit.iter().map(middle).sum::<DVec3>().normalize_or_zero();
        let (u, v) = if axis == DVec3::ZERO { (axis, axis) } else { axis.any_orthonormal_pair() };
        let directions = || lit.iter().flat_map(|f| f.ends_m).map(|p| (p - s).normalize_or_zero());
        if axis != DVec3::ZERO && directions().all(|d| axis.dot(d) > 1e-3) {
            for across in [u, v] {
                let at = directions().map(|d| across.dot(d) / axis.dot(d));
                let (lo, hi) =
                    at.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), x| (lo.min(x), hi.max(x)));
                spaces.push((across - axis * lo, -LIES_M));
                spaces.push((axis * hi - across, -LIES_M));
            }
        }
        spaces
    }

    /// The edges of lit faces in the cone of rays through what is lit of the last mirror, and the share of each that may be in it.
    fn ahead(&self) -> Vec<(usize, [f64; 2])> {
        let s = self.source();
        let spaces = self.spaces();
        let misses = |centre: DVec3, half: DVec3| {
            spaces.iter().any(|(n, offset)| n.dot(centre - s) + n.abs().dot(half) < *offset)
        };
        let table = self.scene.table;
        let mut out = Vec::new();
        table.tree.visit(misses, |i| {
            let edge = &table.edges[i as usize];
            let (mut from, mut to) = (0.0, 1.0);
            for (normal, offset) in &spaces {
                let [p, q] = edge.ends_m.map(|e| normal.dot(e - s) - offset);
                match (p < 0.0, q < 0.0) {
                    (true, true) => return false,
                    (true, false) => from = f64::max(from, p / (p - q)),
                    (false, true) => to = f64::min(to, p / (p - q)),
                    _ => {}
                }
            }
            if from < to && table.halves(edge).iter().any(|h| self.is_lit(self.last(), h.face)) {
                out.push((i as usize, [from, to]));
            }
            false
        });
        out
    }

    /// The fragments that a part of an edge brings: of the faces that meet in it, and of its shadow.
    fn of_edge(&self, number: usize, [from, to]: [f64; 2]) -> Vec<Fragment> {
        let mut out = Vec::new();
        let Scene { table, faces, .. } = *self.scene;
        let (edge, last) = (&table.edges[number], self.last());
        let halves = table.halves(edge);
        if !halves.iter().any(|h| self.is_lit(last, h.face)) {
            return out;
        }
        let s = self.source();
        // A side of the mirror runs where the source before sees it on the mirror's plane, also where corners are a little off that.
        let leaves = self.legs[last].mirror.filter(|m| {
            let patch = self.scene.face(m.lead).patch;
            halves.iter().any(|h| self.scene.face(h.face).patch == patch)
        });
        let seen_at = |p: DVec3| match leaves {
            Some(mirror) => mirror.met_from(self.legs[last - 1].source, p),
            None => p,
        };
        let [a, b] = edge.ends_m;
        let length_m = a.distance(b);
        let normal = (a - s).cross(b - s).normalize_or_zero();
        let free_side = match last {
            0 => self.scene.free[number],
            _ => self.free_side(last, edge),
        };
        let mut bounds = vec![0.0, 1.0];
        self.bounds([edge.at(from), edge.at(to)].map(seen_at), &mut bounds);
        bounds.sort_by(f64::total_cmp);
        bounds.iter_mut().for_each(|t| *t = from + *t * (to - from));
        // Most of what is ahead of a mirror is beside what it lights. In the mirror's plane its two sides are distinguished below.
        let is_dark = |w: &[f64]| {
            let middle = edge.at(0.5 * (w[0] + w[1]));
            let beside = normal * beside_m([edge.at(w[0]), edge.at(w[1])]);
            let is_off = self.legs[last].mirror.is_some_and(|m| m.height(middle).abs() > faces.flat_m);
            leaves.is_none() && is_off && !self.comes_to(middle + beside) && !self.comes_to(middle - beside)
        };
        let is_long = |w: &&[f64]| (w[1] - w[0]) * length_m > SHORTEST_M;
        let mut shares: Vec<[f64; 2]> = Vec::new();
        let (mut found, mut farther) = (Vec::new(), Vec::new());
        for w in bounds.windows(2).filter(|w| is_long(w) && !is_dark(w)) {
            found.clear();
            self.crossings([edge.at(w[0]), edge.at(w[1])].map(seen_at), number, Reach::Nearer, &mut found);
            found.iter_mut().for_each(|t| *t = w[0] + *t * (w[1] - w[0]));
            found.extend(table.pierced(edge).iter().filter(|t| **t > w[0] && **t < w[1]));
            found.extend(w);
            found.sort_by(f64::total_cmp);
            shares.extend(found.windows(2).filter(is_long).map(|w| [w[0], w[1]]));
        }
        for part in shares {
            let ends_m = [edge.at(part[0]), edge.at(part[1])];
            let mut middle = seen_at(0.5 * (ends_m[0] + ends_m[1]));
            let beside_m = beside_m(ends_m);
            // What is as good as in the mirror's plane, and below it, begins where its face comes out of that.
            let (mut out_of, mut in_plane) = (None, leaves.is_some());
            match self.legs[last].mirror {
                None if !self.scene.is_in_window(middle) => continue,
                None => {}
                Some(mirror) => {
                    let height = mirror.height(middle);
                    if height < -faces.flat_m {
                        continue;
                    }
                    in_plane |= height <= faces.flat_m;
                    if height < 0.0 {
                        out_of = Some((middle, height, mirror.side.normal));
                        middle -= mirror.side.normal * height;
                    }
                }
            }
            for (i, half) in halves.iter().enumerate().filter(|(_, h)| self.is_lit(last, h.face)) {
                let base = match out_of {
                    Some((p, height, normal)) if leaves.is_none() && normal.dot(half.inward) > STEEP => {
                        p - half.inward * (height / normal.dot(half.inward))
                    }
                    _ => middle,
                };
                let p = base + half.inward * beside_m;
                let comes = || match in_plane {
                    true => self
                        .leaving_beside(base, edge, half.inward, beside_m)
                        .is_some_and(|on_mirror| self.comes_to(on_mirror)),
                    false => self.comes_to(p),
                };
                if self.is_lit_beside(edge, i, middle)
                    && comes()
                    && self.reaches_face(last, p, half.face, halves)
                {
                    out.push(self.fragment(ends_m, half.inward, half.face, number as u32, true));
                }
            }
            let free = normal * free_side;
            let is_reached = |d: DVec3| {
                let p = middle + d * beside_m;
                self.comes_to(p) && self.reaches_edge(p, edge, halves)
            };
            // Where only one side is lit a nearer silhouette coincides, and its shadow is the same.
            if free == DVec3::ZERO || !is_reached(free) || !is_reached(-free) {
                continue;
            }
            farther.clear();
            farther.extend([0.0, 1.0]);
            self.crossings(ends_m, number, Reach::Beyond, &mut farther);
            farther.sort_by(f64::total_cmp);
            for w in farther.windows(2) {
                let at = |t: f64| ends_m[0] + (ends_m[1] - ends_m[0]) * t;
                let ends_m = [at(w[0]), at(w[1])];
                if ends_m[0].distance(ends_m[1]) > SHORTEST_M {
                    out.extend(self.shadow(ends_m, free, Caster::Edge(number as u32)));
                }
            }
        }
        out
    }

    /// The place on the last mirror, beside an edge in its plane, on the side where rays leave that meet a half-face just off the edge; None where that does not rise. From there
    /// to the half-face the way is as good as none, so that the side is what decides.
    fn leaving_beside(&self, p: DVec3, edge: &Edge, half: DVec3, beside_m: f64) -> Option<DVec3> {
        let normal = self.legs[self.last()].mirror?.side.normal;
        if half.dot(normal) < EDGE_ON {
            return None;
        }
        let d = p - self.source();
        let across = normal.cross(edge.ends_m[1] - edge.ends_m[0]).try_normalize()?;
        let back = half - d * (half.dot(normal) / d.dot(normal));
        let on_mirror = self.source() + d * self.start(self.last(), d);
        Some(on_mirror + across * (beside_m * back.dot(across).signum()))
    }

    /// The fragments at a wall of a window.
    fn of_wall(&self, window: &Frame, number: usize) -> Vec<Fragment> {
        let s = self.scene.radar;
        let (ends_m, inward) = wall_of(window, number);
        let mut shares = vec![0.0, 1.0];
        // Near the radar the wedge has no segment to be beyond.
        self.crossings(ends_m.map(|p| s + (p - s) * 1e-6), usize::MAX, Reach::Beyond, &mut shares);
        shares.sort_by(f64::total_cmp);
        let mut out = Vec::new();
        for w in shares.windows(2) {
            let at = |t: f64| ends_m[0] + (ends_m[1] - ends_m[0]) * t;
            let ends_m = [at(w[0]), at(w[1])];
            let middle = 0.5 * (ends_m[0] + ends_m[1]);
            let is_inner = self.scene.is_in_window(middle - inward * BESIDE_M);
            if !is_inner && ends_m[0].distance(ends_m[1]) > SHORTEST_M {
                out.extend(self.shadow(ends_m, inward, Caster::Wall));
            }
        }
        out
    }

    /// The fragments that a fragment of the last mirror's outline throws.
    fn of_outline(&self, fragment: &Fragment) -> Vec<Fragment> {
        let s = self.source();
        let [a, b] = fragment.ends_m.map(|p| p - s);
        let Some(normal) = a.cross(b).try_normalize() else { return Vec::new() };
        let inward = normal * normal.dot(fragment.inward).signum();
        let mut shares = vec![0.0, 1.0];
        self.crossings(fragment.ends_m, usize::MAX, Reach::Beyond, &mut shares);
        shares.sort_by(f64::total_cmp);
        let mut out = Vec::new();
        for w in shares.windows(2) {
            let ends_m = [fragment.at(w[0]), fragment.at(w[1])];
            if ends_m[0].distance(ends_m[1]) > SHORTEST_M {
                out.extend(self.shadow(ends_m, inward, Caster::Outline(fragment.edge)));
            }
        }
        out
    }

    /// Whether nothing else that meets in an edge hides one of its half-faces next to it.
    fn is_lit_beside(&self, edge: &Edge, number: usize, at: DVec3) -> bool {
        let halves = self.scene.table.halves(edge);
        if halves.len() == 1 {
            return true;
        }
        let axis = (edge.ends_m[1] - edge.ends_m[0]).normalize();
        let to_source = self.source() - at;
        let to_source = (to_source - axis * to_source.dot(axis)).normalize_or_zero();
        let own = halves[number].inward;
        let angle = |from: DVec3, to: DVec3| from.cross(to).dot(axis);
        let whole = angle(own, to_source);
        !halves.iter().enumerate().any(|(i, h)| {
            let (first, second) = (angle(own, h.inward), angle(h.inward, to_source));
            i != number
                && self.is_lit(self.last(), h.face)
                && match whole > 0.0 {
                    true => first > EDGE_ON && second > EDGE_ON,
                    false => first < -EDGE_ON && second < -EDGE_ON,
                }
        })
    }

    /// Least and largest height of a face's corners over another's plane, m, on the side from which a leg's source sees that one.
    fn heights(&self, leg: usize, of: &Face, plane: &Face) -> (f64, f64) {
        let side = if height(plane, self.legs[leg].source) > 0.0 { 1.0 } else { -1.0 };
        let heights = self.scene.faces.corners(of).iter().map(|p| side * height(plane, *p));
        heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), h| (lo.min(h), hi.max(h)))
    }

    /// Whether a face that a ray of a leg meets at the share `t` of the distance to `target` hides it.
    fn hides(&self, leg: usize, other: &Face, target: &Face, t: f64, rounding: f64) -> bool {
        if self.scene.lies_on(target, other) {
            return false;
        }
        if self.scene.lies_on(other, target) {
            return true;
        }
        let flat_m = self.scene.faces.flat_m;
        let (lo, hi) = self.heights(leg, other, target);
        if hi <= flat_m {
            return false;
        }
        if lo >= -flat_m {
            // Where it stands on the target it may reach behind that by rounding.
            return t <= 1.0;
        }
        let (lo, hi) = self.heights(leg, target, other);
        lo < -flat_m && (hi <= flat_m || t < 1.0 - rounding)
    }

    /// Share of `d` at which a ray from a leg's source meets a face; None where it passes by.
    fn meets(&self, leg: usize, face: &Face, d: DVec3) -> Option<f64> {
        let t = -height(face, self.legs[leg].source) / face.normal.dot(d);
        (t > 0.0 && t.is_finite() && self.is_seen_at(leg, face, d)).then_some(t)
    }

    /// The share of `d` at which rays of a leg set out.
    fn start(&self, leg: usize, d: DVec3) -> f64 {
        let Leg { source, mirror } = &self.legs[leg];
        mirror.map_or(0.0, |m| -m.height(*source) / m.side.normal.dot(d))
    }

    /// Whether a ray of a leg reaches a place on a face, past faces that `skip` names.
    fn reaches_face(&self, leg: usize, p: DVec3, number: u32, skip: &[HalfFace]) -> bool {
        let (faces, s) = (self.scene.faces, self.legs[leg].source);
        let target = self.scene.face(number);
        let d = p - s;
        let (length, start) = (d.length(), self.start(leg, d));
        // What lies on the target may be a little behind it.
        let margin = LIES_M / target.normal.dot(d).abs();
        let mut is_hidden = false;
        faces.visit_segment(s + d * start, p + d * margin, ROUNDING_M, |i| {
            let other = self.scene.face(i);
            is_hidden = self.is_lit(leg, i)
                && other.patch != target.patch
                && !skip.iter().any(|h| h.face == i)
                && self.meets(leg, other, d).is_some_and(|t| {
                    t > start && t < 1.0 + margin && self.hides(leg, other, target, t, ROUNDING_M / length)
                });
            is_hidden
        });
        !is_hidden
    }

    /// Whether a ray of the last leg reaches a place beside an edge.
    fn reaches_edge(&self, p: DVec3, edge: &Edge, halves: &[HalfFace]) -> bool {
        let (leg, s) = (self.last(), self.source());
        let d = p - s;
        let (rounding, start) = (ROUNDING_M / d.length(), self.start(leg, d));
        let mut is_hidden = false;
        self.scene.faces.visit_segment(s + d * start, p, ROUNDING_M, |i| {
            let other = self.scene.face(i);
            is_hidden = self.is_lit(leg, i)
                && !halves.iter().any(|h| h.face == i)
                && self.meets(leg, other, d).is_some_and(|t| t > start && t < 1.0 - rounding)
                && !self.scene.touches(edge, other, |f| self.is_lit(leg, f));
            is_hidden
        });
        !is_hidden
    }

    /// The fragment that the plane through the source and a segment throws on what lies behind its side `free`.
    fn shadow(&self, ends_m: [DVec3; 2], free: DVec3, caster: Caster) -> Option<Fragment> {
        let Scene { faces, table, .. } = *self.scene;
        let (leg, s) = (self.last(), self.source());
        let middle = 0.5 * (ends_m[0] + ends_m[1]);
        let beside_m = beside_m(ends_m);
        let d = middle + free * beside_m - s;
        let rounding = ROUNDING_M / d.length();
        let edge = match caster {
            Caster::Edge(number) => Some(&table.edges[number as usize]),
            _ => None,
        };
        let halves = edge.map_or(&[][..], |e| table.halves(e));
        // Where the outline of a mirror runs along an edge, what rises there is met by all rays beside it or by none.
        let at_outline = match caster {
            Caster::Outline(number) => table.edges.get(number as usize).map_or(&[][..], |e| table.halves(e)),
            _ => &[],
        };
        if self.rises_into(at_outline, (ends_m[1] - ends_m[0]).normalize_or_zero(), free, d) {
            return None;
        }
        let is_beside = |face: &Face| at_outline.iter().any(|h| self.scene.face(h.face).patch == face.patch);
        let reach = (s.distance(faces.centre_m) + faces.radius_m) / d.length();
        let leaves = self.start(leg, d);
        // (share of the distance, face, share up to which one that lies on it is looked for)
        let best: Cell<Option<(f64, u32, f64)>> = Cell::new(None);
        let end = |face: &Face, t: f64| t + LIES_M / face.normal.dot(d).abs();
        let start = if edge.is_some() { leaves.max(1.0 - SLACK_M / d.length()) } else { leaves };
        let misses = |centre: DVec3, half: DVec3| {
            let end = best.get().map_or(reach, |b| b.2);
            misses_segment(s + d * start, s + d * end, ROUNDING_M)(centre, half)
        };
        faces.visit_boxes(misses, |i| {
            let face = self.scene.face(i);
            if !self.is_lit(leg, i) || halves.iter().any(|h| h.face == i) || is_beside(face) {
                return;
            }
            let Some(t) = self.meets(leg, face, d) else { return };
            let least = match edge {
                None => leaves,
                Some(e) if t <= 1.0 + rounding => {
                    match self.scene.touches(e, face, |f| self.is_lit(leg, f)) {
                        true => 1.0 - 2.0 * LIES_M / face.normal.dot(d).abs(),
                        false => 1.0 + rounding,
                    }
                }
                _ => 1.0,
            };
            if t < least || leg > 0 && t <= leaves {
                return;
            }
            let is_nearer = best.get().is_none_or(|(other_t, other, end)| {
                let other = self.scene.face(other);
                t < end
                    && (self.scene.lies_on(face, other) || t < other_t && !self.scene.lies_on(other, face))
            });
            if is_nearer {
                best.set(Some((t, i, end(face, t))));
            }
        });
        let (t, number, _) = best.get()?;
        let face = self.scene.face(number);
        // What does not hide the face shades it neither: a line on the road that a smaller one lies on.
        let hidden_by = |h: &HalfFace| {
            self.is_lit(leg, h.face)
                && self.hides(leg, self.scene.face(h.face), face, 1.0 / t.max(1.0), rounding)
        };
        if edge.is_some() && !halves.iter().any(hidden_by) {
            return None;
        }
        let touches = |e: &Edge| self.scene.touches(e, face, |f| self.is_lit(leg, f));
        let along = match caster {
            Caster::Edge(number) if t <= 1.0 + rounding || edge.is_some_and(touches) => number,
            Caster::Outline(number) if t <= 1.0 + rounding => number,
            _ => NO_EDGE,
        };
        // Where the patch ends at the line it is the patch's own edge that bounds it.
        let covered = middle - free * beside_m - s;
        let goes_on = self.is_seen_at(leg, face, covered) || self.face_of_patch(leg, face, covered).is_some();
        let inward = (free - face.normal * free.dot(face.normal)).normalize_or_zero();
        goes_on.then(|| self.fragment(ends_m, inward, number, along, false))
    }

    /// Whether one of the half-faces at an edge on the outline of the last mirror is met by the rays that leave the mirror beside the edge along
    /// `d`, where `free` leads to its lit side.
    fn rises_into(&self, halves: &[HalfFace], axis: DVec3, free: DVec3, d: DVec3) -> bool {
        let Some(mirror) = self.legs[self.last()].mirror else { return false };
        let inner = free - mirror.side.normal * mirror.side.normal.dot(free);
        let [inner, ray] = [inner, d - axis * d.dot(axis)].map(DVec3::normalize_or_zero);
        let angle = |from: DVec3, to: DVec3| from.cross(to).dot(axis);
        let sign = angle(inner, ray).signum();
        halves.iter().any(|h| {
            self.is_lit(self.last(), h.face)
                && sign * angle(inner, h.inward) > EDGE_ON
                && sign * angle(h.inward, ray) > EDGE_ON
        })
    }

    /// A fragment of a face's patch with both ends on the rays through two positions.
    fn fragment(&self, ends_m: [DVec3; 2], inward: DVec3, face: u32, edge: u32, is_side: bool) -> Fragment {
        let s = self.source();
        let lead = self.scene.face(self.scene.leads[self.scene.face(face).patch as usize]);
        let height = height(lead, s);
        let on = |p: DVec3| s - (p - s) * (height / lead.normal.dot(p - s));
        Fragment { ends_m: ends_m.map(on), inward, face, edge, is_side }
    }

    /// Whether a face has a place in a direction from a leg's source: by the sides as they are seen from there, which are its edges, also
    /// where a corner is off its plane.
    fn is_seen_at(&self, leg: usize, face: &Face, d: DVec3) -> bool {
        let s = self.legs[leg].source;
        let corners = self.scene.table.corners(face);
        let sign = -height(face, s).signum();
        let mut a = corners[corners.len() - 1] - s;
        corners.iter().all(|b| {
            let b = *b - s;
            let is_inside = sign * a.cross(b).dot(d) >= 0.0;
            a = b;
            is_inside
        })
    }

    /// The face of the patch to which `on` belongs that has a place in a direction from a leg's source.
    fn face_of_patch(&self, leg: usize, on: &Face, d: DVec3) -> Option<u32> {
        let s = self.legs[leg].source;
        let p = s - d * (height(on, s) / on.normal.dot(d));
        let mut found = None;
        let apart = |c: DVec3, half: DVec3| (p - c).abs().cmpgt(half + LIES_M).any();
        self.scene.faces.visit_boxes(apart, |i| {
            let face = self.scene.face(i);
            if found.is_none() && face.patch == on.patch && self.is_seen_at(leg, face, d) {
                found = Some(i);
            }
        });
        found
    }

    /// The outline of what both this view and the radar's own light of a patch, where `own` are this view's fragments of it and `direct` the
    /// radar's.
    pub fn also_lit(&self, own: &[Fragment], direct: &[Fragment]) -> Vec<Fragment> {
        let Some(first) = own.first() else { return Vec::new() };
        let radar = self.scene.view();
        let plane = self.scene.face(self.scene.leads[self.scene.face(first.face).patch as usize]);
        if height(plane, self.source()) * height(plane, self.scene.radar) <= 0.0 || !radar.can_meet(0, plane)
        {
            return Vec::new();
        }
        let box_around = |fragments: &[Fragment]| {
            let ends = || fragments.iter().flat_map(|f| f.ends_m);
            let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
            ends().fold(start, |(lo, hi), p| (lo.min(p), hi.max(p)))
        };
        let reaches_into = |(lo, hi): (DVec3, DVec3)| {
            move |f: &&Fragment| {
                let [a, b] = f.ends_m;
                !(a.min(b).cmpgt(hi + TOUCHING_M).any() || a.max(b).cmplt(lo - TOUCHING_M).any())
            }
        };
        let (sides, shadows): (Vec<&Fragment>, Vec<&Fragment>) = direct.iter().partition(|f| f.is_side);
        let around = reaches_into(box_around(own));
        let shadows: Vec<Fragment> = shadows.into_iter().filter(around).copied().collect();
        // The parts of a fragment between the places where it comes to an outline in its plane.
        let mut shares = Vec::new();
        let mut parts = |f: &Fragment, others: &Outline<'_>| -> Vec<Fragment> {
            let [a, b] = f.ends_m;
            let along = b - a;
            let across = plane.normal.cross(along).normalize_or_zero();
            shares.clear();
            shares.extend([0.0, 1.0]);
            let (lo, hi) = (a.min(b) - TOUCHING_M, a.max(b) + TOUCHING_M);
            let misses = |centre: DVec3, half: DVec3| {
                (centre - half).cmpgt(hi).any() || (centre + half).cmplt(lo).any()
            };
            others.visit(misses, |g| {
                let heights = g.ends_m.map(|p| across.dot(p - a));
                let share = |x: DVec3| along.dot(x - a) / along.length_squared();
                shares.extend(
                    meeting(g.ends_m, heights, TOUCHING_M).map(share).filter(|t| *t > 0.0 && *t < 1.0),
                );
            });
            shares.sort_by(f64::total_cmp);
            let part = |w: &[f64]| Fragment { ends_m: [f.at(w[0]), f.at(w[1])], ..*f };
            let is_long = |f: &Fragment| f.ends_m[0].distance(f.ends_m[1]) > SHORTEST_M;
            shares.windows(2).map(part).filter(is_long).collect()
        };
        let mut out = Vec::new();
        let (of_radar, of_view) = (Outline::new(&shadows), Outline::new(own));
        for f in own.iter().filter(|f| f.is_side) {
            let along = f.ends_m[1] - f.ends_m[0];
            let share = |p: DVec3| along.dot(p - f.ends_m[0]) / along.length_squared();
            let is_same =
                |g: &&&Fragment| g.edge == f.edge && g.face == f.face && g.inward.dot(f.inward) > 0.0;
            for g in sides.iter().filter(is_same) {
                let [a, b] = g.ends_m.map(share);
                let (from, to) = (a.min(b).max(0.0), a.max(b).min(1.0));
                if (to - from) * along.length() > SHORTEST_M {
                    out.push(Fragment { ends_m: [f.at(from), f.at(to)], ..*f });
                }
            }
        }
        for f in own.iter().filter(|f| !f.is_side) {
            for part in parts(f, &of_radar) {
                let beside = f.inward * beside_m(part.ends_m);
                // Where only the inner side is lit the radar's own outline coincides.
                if [beside, -beside].iter().all(|d| radar.lights(part.at(0.5) + *d, f.face, &[])) {
                    out.push(part);
                }
            }
        }
        for f in &shadows {
            for part in parts(f, &of_view) {
                if self.lights(part.at(0.5) + f.inward * beside_m(part.ends_m), f.face, &[]) {
                    out.push(part);
                }
            }
        }
        out
    }
}

/// The line along which a fragment runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::trace) enum Line {
    /// An edge of the patch, by its number and that of the half-face.
    Side { edge: u32, half: u32 },
    /// The shadow of an edge, and on which side of it light passes: 1 and -1 of (a - source) x (b - source).
    Shadow { edge: u32, side: f64 },
    /// A wall of a window: 0 and 1 at +u and -u, 2 and 3 at +v and -v.
    Wall { window: u32, wall: u32 },
    /// The shadow of the outline of what is lit of the last mirror, by the number of its fragment.
    Outline(u32),
}

/// A fragment by what it is a part of, from which its position follows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::trace) struct Name {
    pub line: Line,
    /// The shares of that at which it begins and ends.
    pub shares: [f64; 2],
    /// A face of the patch on which it is.
    pub face: u32,
    /// Whether a shadow is as good as on the edge that throws it.
    pub is_along: bool,
}

/// What throws a shadow.
#[derive(Clone, Copy)]
enum Caster {
    /// An edge by number.
    Edge(u32),
    /// A wall of a window, which begins at the radar.
    Wall,
    /// The outline of what is lit of the last mirror, and the edge along which it runs.
    Outline(u32),
}

/// Height over a face's plane on the side of its normal, m.
fn height(face: &Face, p: DVec3) -> f64 {
    face.normal.dot(p) - face.offset_m
}

/// How far beside a part a ray decides, m.
fn beside_m(ends_m: [DVec3; 2]) -> f64 {
    BESIDE_M.min(BESIDE * ends_m[0].distance(ends_m[1]))
}

/// The ends of a wall of a window at the distance of the window's axes, and the unit vector to its inner side.
pub(in crate::trace) fn wall_of(window: &Frame, number: usize) -> ([DVec3; 2], DVec3) {
    let [u, v] = if number < 2 { [window.u, window.v] } else { [window.v, window.u] };
    let sign = if number.is_multiple_of(2) { 1.0 } else { -1.0 };
    let side = window.origin + window.k + u * sign;
    ([side + v, side - v], (window.k - u * sign).normalize())
}

/// The walls of a window, positive inside.
fn walls(w: &Frame) -> [DVec3; 4] {
    [w.k - w.u, w.k + w.u, w.k - w.v, w.k + w.v]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::shader_constant;

    #[test]
    fn the_shaders_have_the_same_tolerances() {
        let params = include_str!("../../../shaders/shared/line_params.wgsl");
        let tolerances = [
            ("BESIDE_M", BESIDE_M),
            ("BESIDE", BESIDE),
            ("SLACK_M", SLACK_M),
            ("TOUCHING_M", TOUCHING_M),
            ("SHORTEST_M", SHORTEST_M),
            ("EDGE_ON", EDGE_ON),
            ("STEEP", STEEP),
            ("ON_MIRROR", ON_MIRROR),
            ("ROUNDING_M", ROUNDING_M),
            ("LIES_M", LIES_M),
        ];
        for (name, value) in tolerances {
            assert_eq!(shader_constant(params, name), Some(value), "{name}");
        }
    }
}
