//! Clipping of beams in f64 (CONVENTIONS eq. 50-52). What comes out does not depend on frequency.
//!
//! Polygons live in the (u, v) of a [`Frame`]. All cuts are made along original edges of faces and along
//! lines in which two planes cross, never along edges that were computed before: short computed edges have
//! random directions.

use crate::base::tasks::Tasks;
use crate::geom::Surface;
use crate::geom::faces::{Face, Faces, HalfSpace, LIES_M, MOST_CORNERS, NOT_CURVED, misses_segment};
use crate::trace::MAX_BOUNCES;
use crate::trace::beams::{BeamOptions, Frame, Port};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::cell::Cell;
use std::f64::consts::PI;

/// Polygons with more corners than this are halved before they are cut again.
const MOST: usize = 8;
/// Corners that a polygon may have while it is cut: by each of [`Lines`] one more, or by another polygon's edges.
const CAP: usize = MOST + MOST_LINES;
/// The edges of a face and two crossings of planes.
const MOST_LINES: usize = MOST_CORNERS + 2;
/// Sine of the angle to the plane below which a face is edge-on.
pub(in crate::trace) const GRAZING: f64 = 1e-9;
/// Faces of one task where several follow a beam.
const SOME: usize = 8;
/// Lengths below this share of a polygon's size are none where two of one plane overlap.
const OVERLAP: f64 = 1e-12;
/// Pieces below this share of the polygon that they were cut from are dropped.
pub(super) const SLIVER: f64 = 1e-11;

/// A convex polygon of few corners, on the stack.
#[derive(Clone, Copy)]
pub struct Polygon {
    n: usize,
    p: [DVec2; CAP],
}

impl std::fmt::Debug for Polygon {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.corners().fmt(f)
    }
}

impl Polygon {
    pub(super) const EMPTY: Polygon = Polygon { n: 0, p: [DVec2::ZERO; CAP] };

    /// Corners in order.
    pub fn corners(&self) -> &[DVec2] {
        &self.p[..self.n]
    }

    /// The polygons of at most as many corners as one holds that make up a convex one with these corners: more than one where it has
    /// more.
    pub(super) fn of(corners: &[DVec2]) -> Vec<Polygon> {
        let mut out = Vec::with_capacity(1);
        // A fan from the first corner, in as few pieces as hold it.
        let mut from = 1;
        while from + 1 < corners.len() {
            let to = (from + CAP - 2).min(corners.len() - 1);
            let mut polygon = Polygon::EMPTY;
            polygon.push(corners[0]);
            corners[from..=to].iter().for_each(|c| polygon.push(*c));
            out.push(polygon);
            from = to;
        }
        out
    }

    #[inline]
    pub(super) fn push(&mut self, p: DVec2) {
        self.p[self.n] = p;
        self.n += 1;
    }

    /// The polygon of the mapped corners.
    pub fn mapped(&self, f: impl Fn(DVec2) -> DVec2) -> Polygon {
        let mut out = *self;
        for p in &mut out.p[..self.n] {
            *p = f(*p);
        }
        out
    }

    /// Signed, positive counter-clockwise.
    pub fn area(&self) -> f64 {
        let c = self.corners();
        if c.len() < 3 {
            return 0.0;
        }
        (1..c.len() - 1).map(|i| (c[i] - c[0]).perp_dot(c[i + 1] - c[0])).sum::<f64>() * 0.5
    }

    /// Whether a point is inside, or not farther outside than this.
    pub(super) fn holds(&self, p: DVec2, margin: f64) -> bool {
        let c = self.corners();
        let sign = self.area().signum();
        (0..c.len()).all(|i| {
            let side = c[(i + 1) % c.len()] - c[i];
            sign * side.perp_dot(p - c[i]) >= -margin * side.length()
        })
    }

    pub(super) fn bounds(&self) -> (DVec2, DVec2) {
        let start = (DVec2::splat(f64::INFINITY), DVec2::splat(f64::NEG_INFINITY));
        self.corners().iter().fold(start, |(lo, hi), p| (lo.min(*p), hi.max(*p)))
    }

    /// Finds on which sides of `line` corners lie (negative, positive), and their distances.
    #[inline]
    fn sides(&self, line: &Line, eps: f64, d: &mut [f64; CAP]) -> (bool, bool) {
        let (mut low, mut high) = (false, false);
        for (d, p) in d.iter_mut().zip(self.corners()) {
            *d = line.at(*p, eps);
            low |= *d < 0.0;
            high |= *d > 0.0;
        }
        (low, high)
    }

    /// Writes the part where `line` is positive to `out`, if it is neither all nor nothing.
    #[inline]
    fn cut(&self, line: &Line, eps: f64, out: &mut Polygon) -> Cut {
        let mut d = [0.0; CAP];
        match self.sides(line, eps, &mut d) {
            (false, _) => return Cut::All,
            (true, false) => return Cut::Nothing,
            _ => {}
        }
        out.n = 0;
        for i in 0..self.n {
            let j = if i + 1 == self.n { 0 } else { i + 1 };
            if d[i] >= 0.0 {
                out.push(self.p[i]);
            }
            if d[i] * d[j] < 0.0 {
                out.push(self.p[i] + (self.p[j] - self.p[i]) * (d[i] / (d[i] - d[j])));
            }
        }
        Cut::Part
    }

    /// Writes the parts on both sides of `line`, if it crosses.
    #[inline]
    fn cut_apart(&self, line: &Line, eps: f64, inside: &mut Polygon, outside: &mut Polygon) -> Cut {
        let mut d = [0.0; CAP];
        match self.sides(line, eps, &mut d) {
            (false, _) => return Cut::All,
            (true, false) => return Cut::Nothing,
            _ => {}
        }
        (inside.n, outside.n) = (0, 0);
        for i in 0..self.n {
            let j = if i + 1 == self.n { 0 } else { i + 1 };
            if d[i] >= 0.0 {
                inside.push(self.p[i]);
            }
            if d[i] <= 0.0 {
                outside.push(self.p[i]);
            }
            if d[i] * d[j] < 0.0 {
                let p = self.p[i] + (self.p[j] - self.p[i]) * (d[i] / (d[i] - d[j]));
                inside.push(p);
                outside.push(p);
            }
        }
        Cut::Part
    }

    /// The part where `line` is positive.
    fn kept(&self, line: &Line, eps: f64) -> Polygon {
        let mut out = Polygon::EMPTY;
        match self.cut(line, eps, &mut out) {
            Cut::All => *self,
            _ => out,
        }
    }

    /// The two parts on either side of the line through `at` across `normal`.
    pub fn split(&self, at: DVec2, normal: DVec2) -> [Polygon; 2] {
        // Cells only lose corners as they shrink, but a cut may add one to each part.
        if self.n > MOST {
            return self.halves();
        }
        let line = Line::new(normal.x, normal.y, -normal.dot(at));
        [self.kept(&line, 0.0), self.kept(&line.opposite(), 0.0)]
    }

    fn halves(&self) -> [Polygon; 2] {
        let h = self.n / 2;
        let (mut a, mut b) = (Polygon::EMPTY, Polygon::EMPTY);
        (0..=h).for_each(|i| a.push(self.p[i]));
        (h..self.n).for_each(|i| b.push(self.p[i]));
        b.push(self.p[0]);
        [a, b]
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Cut {
    All,
    Nothing,
    Part,
}

/// Where polygons are cut, kept between cuts.
pub(super) struct Scratch {
    pub(super) halves: [Polygon; 2],
    part: Polygon,
    new: Vec<Polygon>,
    seen: Remainder,
    lists: Lists,
}

/// What is left of a polygon from which parts are taken away, in an order that depends on these parts alone.
pub(super) struct Remainder {
    whole: Polygon,
    pub(super) polygons: Vec<Polygon>,
    /// Bounds of each polygon: a road behind a bicycle is seen in thousands of pieces, and most parts that are taken
    /// away meet few of them.
    bounds: Vec<(DVec2, DVec2)>,
}

impl Default for Remainder {
    fn default() -> Self {
        Remainder { whole: Polygon::EMPTY, polygons: Vec::new(), bounds: Vec::new() }
    }
}

impl Remainder {
    /// So many pieces are looked at one by one.
    const FEW: usize = 8;

    /// All of `whole`.
    pub(super) fn of(whole: &Polygon) -> Remainder {
        let mut pieces = Remainder::default();
        pieces.begin(whole);
        pieces
    }

    /// What is left of `whole` already.
    pub(super) fn left(whole: &Polygon, polygons: Vec<Polygon>) -> Remainder {
        let bounds = polygons.iter().map(Polygon::bounds).collect();
        Remainder { whole: *whole, polygons, bounds }
    }

    pub(super) fn clear(&mut self) {
        self.polygons.clear();
        self.bounds.clear();
    }

    fn begin(&mut self, whole: &Polygon) {
        self.clear();
        self.whole = *whole;
        keep(whole, 0.0, &mut self.polygons);
        self.bounds.extend(self.polygons.iter().map(Polygon::bounds));
    }

    /// Takes away the inside of `lines` where it is more than `least`; true where something was.
    pub(super) fn subtract(
        &mut self,
        lines: &Lines,
        least: f64,
        eps: f64,
        halves: &mut [Polygon; 2],
        (part, new): (&mut Polygon, &mut Vec<Polygon>),
    ) -> bool {
        let everywhere = (DVec2::NEG_INFINITY, DVec2::INFINITY);
        let (lo, hi) = if self.polygons.len() <= Self::FEW {
            everywhere
        } else {
            match cut_by(&self.whole, lines.all(), eps, halves).map(Polygon::bounds) {
                // What is on a line counts as either side of it.
                Some((lo, hi)) => (lo - 2.0 * eps, hi + 2.0 * eps),
                None => return false,
            }
        };
        let end = self.polygons.len();
        let mut kept = 0;
        for i in 0..end {
            let (low, high) = self.bounds[i];
            let apart = low.x > hi.x || high.x < lo.x || low.y > hi.y || high.y < lo.y;
            // A piece that is only touched stays whole.
            let stays = apart
                || cut_by(&self.polygons[i], lines.all(), eps, halves)
                    .is_none_or(|p| p.area().abs() <= least);
            if stays {
                if kept < i {
                    self.polygons[kept] = self.polygons[i];
                    self.bounds[kept] = self.bounds[i];
                }
                kept += 1;
                continue;
            }
            let [mut rest, mut next] = halves.each_mut();
            *rest = self.polygons[i];
            for l in lines.all() {
                match rest.cut_apart(l, eps, next, part) {
                    Cut::All => {}
                    Cut::Nothing => {
                        keep(rest, least, new);
                        break;
                    }
                    Cut::Part => {
                        keep(part, least, new);
                        if next.n < 3 {
                            break;
                        }
                        std::mem::swap(&mut rest, &mut next);
                    }
                }
            }
        }
        if kept == end {
            return false;
        }
        self.polygons.truncate(kept);
        self.bounds.truncate(kept);
        self.bounds.extend(new.iter().map(Polygon::bounds));
        self.polygons.append(new);
        true
    }
}

/// Faces ahead of a beam that its rays can meet, hidden by others or not.
#[derive(Default)]
struct Targets {
    /// Face, its facing, and the part of the beam that it covers.
    list: Vec<(u32, f64, Polygon)>,
    /// Bounds of those parts; empty where they are too many to look through.
    bounds: Vec<(DVec2, DVec2)>,
}

impl Targets {
    fn clear(&mut self) {
        self.list.clear();
        self.bounds.clear();
    }
}

/// One face as the rays of a beam see it, while what stands before it is taken away.
struct Sight<'a> {
    frame: &'a Frame,
    /// Where the rays set out from.
    source: Option<&'a Side>,
    target: u32,
    /// The lit side of the target's plane.
    side: Side,
    /// All of it that is looked at.
    start: &'a Polygon,
    /// Area of the largest piece that is dropped.
    least: f64,
    /// Something was cut away.
    cut: bool,
}

/// What a beam is followed with, kept between first faces.
#[derive(Default)]
struct Lists {
    stack: Vec<(u32, Polygon)>,
    candidates: Vec<u32>,
    targets: Targets,
    parts: Vec<Polygon>,
    exits: Remainder,
}

impl Scratch {
    pub(super) fn new() -> Scratch {
        Scratch {
            halves: [Polygon::EMPTY; 2],
            part: Polygon::EMPTY,
            new: Vec::new(),
            seen: Remainder::default(),
            lists: Lists::default(),
        }
    }
}

/// `polygon` cut by lines in turn: None when nothing is left.
#[inline]
pub(super) fn cut_by<'a>(
    polygon: &'a Polygon,
    lines: &[Line],
    eps: f64,
    halves: &'a mut [Polygon; 2],
) -> Option<&'a Polygon> {
    let [mut now, mut next] = halves.each_mut();
    let mut whole = true;
    for l in lines {
        match if whole { polygon.cut(l, eps, next) } else { now.cut(l, eps, next) } {
            Cut::All => continue,
            Cut::Nothing => return None,
            Cut::Part if next.n < 3 => return None,
            Cut::Part => {}
        }
        whole = false;
        std::mem::swap(&mut now, &mut next);
    }
    Some(if whole { polygon } else { now })
}

/// Positive on the side that is kept.
#[derive(Debug, Clone, Copy)]
pub(super) struct Line {
    a: f64,
    b: f64,
    c: f64,
}

impl Line {
    /// A line at infinity keeps or drops everything, by the sign of its constant.
    #[inline]
    fn new(a: f64, b: f64, c: f64) -> Line {
        let l = (a * a + b * b).sqrt();
        if l > 1e-14 * c.abs() {
            Line { a: a / l, b: b / l, c: c / l }
        } else {
            Line { a: 0.0, b: 0.0, c: if c >= 0.0 { f64::MAX } else { f64::MIN } }
        }
    }

    /// Distance, with what is nearer than `eps` on the line.
    #[inline]
    pub(super) fn at(&self, p: DVec2, eps: f64) -> f64 {
        let d = self.a * p.x + self.b * p.y + self.c;
        if d.abs() <= eps { 0.0 } else { d }
    }

    fn opposite(&self) -> Line {
        Line { a: -self.a, b: -self.b, c: -self.c }
    }
}

/// Those that bound a face in a polygon.
#[derive(Clone, Copy)]
pub(super) struct Lines {
    n: usize,
    l: [Line; MOST_LINES],
}

impl Lines {
    fn new() -> Self {
        Lines { n: 0, l: [Line { a: 0.0, b: 0.0, c: 0.0 }; MOST_LINES] }
    }
    #[inline]
    pub(super) fn push(&mut self, l: Line) {
        self.l[self.n] = l;
        self.n += 1;
    }
    pub(super) fn all(&self) -> &[Line] {
        &self.l[..self.n]
    }

    /// Adds a line that cuts `polygon`; one that keeps all of it says nothing. False when the line leaves
    /// nothing of it but what it touches.
    #[inline]
    pub(super) fn narrow(&mut self, line: Line, polygon: &Polygon, eps: f64) -> bool {
        let (mut low, mut high) = (false, false);
        for p in polygon.corners() {
            let d = line.at(*p, eps);
            low |= d < 0.0;
            high |= d > 0.0;
        }
        if low {
            self.push(line);
        }
        high
    }
}

/// The lit side of the plane of a face.
#[derive(Debug, Clone, Copy)]
pub(super) struct Side {
    pub(super) normal: DVec3,
    pub(super) offset: f64,
    patch: u32,
}

impl Side {
    pub(super) fn of(face: &Face, facing: f64) -> Side {
        Side::facing(face, if facing < 0.0 { face.normal } else { -face.normal })
    }

    /// The side whose unit normal, that of the face or its opposite, is given.
    pub(super) fn facing(face: &Face, normal: DVec3) -> Side {
        Side { normal, offset: normal.dot(face.normal) * face.offset_m, patch: face.patch }
    }

    pub(super) fn opposite(self) -> Side {
        Side { normal: -self.normal, offset: -self.offset, ..self }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum PlaneSide {
    /// Wholly on the lit side or in the plane.
    Before,
    Across,
    Behind,
}

/// One face met by a beam.
#[derive(Debug, Clone, Copy)]
pub struct Node {
    /// u32::MAX for the first bounce.
    pub parent: u32,
    /// Index of the face.
    pub face: u32,
    /// Number of faces met before it.
    pub bounce: u8,
    /// The chain begins with a mirror of its second face (`Faces::mirrors`).
    pub imaged: bool,
    /// Whether that mirror is as good as endless (`Faces::is_endless`).
    pub endless: bool,
    /// Frame of the wave that arrives.
    pub frame: Frame,
    /// Unit normal on the lit side.
    pub normal: DVec3,
}

/// What it takes to tell how much the beams would still return that the limit of bounces ends (CONVENTIONS eq. 68).
#[derive(Debug, Clone, Copy)]
pub struct Ends<'a> {
    /// Surfaces of the faces, in the order of `Face::surface`.
    pub surfaces: &'a [Surface],
    /// Wavenumber of the carrier, rad/m.
    pub wavenumber: f64,
    /// Cells of beams of which k Ω |R| / 2π, the most that they return however they are turned, is below this are cut no further, 1/m.
    pub least: f64,
    /// Whether those count, each as a whole. They do not where beams are many and narrow from the start; what lines light is one beam,
    /// which is cut here alone.
    pub keeps_weak: bool,
}

impl Ends<'_> {
    /// The most that a beam of so many steradians returns from as far as it went, however what it meets is turned, 1/m.
    pub(super) fn most(&self, solid_angle_sr: f64) -> f64 {
        self.wavenumber / (2.0 * PI) * solid_angle_sr
    }
}

/// A beam that ended at the most bounces that are followed, though there is another face ahead of it.
#[derive(Debug, Clone, Copy)]
pub struct Ended {
    /// Index of the last node.
    pub node: u32,
    /// Index of the face that the beam's middle would meet next.
    pub face: u32,
    /// Where it would meet it, m.
    pub place: DVec3,
    /// The radar's image in all faces that the beam has met, m.
    pub image: DVec3,
    /// Coordinates of the middle in the beam's frame.
    pub middle: DVec2,
    /// Solid angle of the beam, sr.
    pub solid_angle_sr: f64,
    /// Largest share of the amplitude that is left after the last bounce.
    pub left: f64,
}

/// A lit polygon that radiates to the receiver, along the face's axes.
#[derive(Debug, Clone, Copy)]
pub struct Piece {
    /// Index of the node that it belongs to.
    pub node: u32,
    /// The polygon in the face's coordinates, m.
    pub polygon: Polygon,
}

/// All that the beams of one look meet.
#[derive(Debug, Clone, Default)]
pub struct Clipped {
    /// Faces met, each after the one before it in its chain.
    pub nodes: Vec<Node>,
    /// Pieces of every bounce.
    pub every: Vec<Piece>,
    /// Pieces from which the beam leaves the target, alone.
    pub last: Vec<Piece>,
    /// What is lit, seen by the receiver or not, by chains that begin with a mirror of their last face (`Faces::mirrors`), and of curved
    /// surfaces.
    pub imaged: Vec<Piece>,
    /// Beams that the limit of bounces ended; only with [`Ends`].
    pub ended: Vec<Ended>,
    /// What the radar of a frame looks at.
    pub windows: Vec<Frame>,
    /// Facets of curved surfaces stand for ray tubes (`BeamOptions::facets_reflect`).
    pub tubes: bool,
    /// Beams towards curved surfaces, until these are looked at.
    pub(super) onward: Vec<Onward>,
}

/// Walls of a window: inside where positive, in coordinates along (u, v, k).
const WALLS: [DVec3; 4] = [
    DVec3::new(1.0, 0.0, 1.0),
    DVec3::new(-1.0, 0.0, 1.0),
    DVec3::new(0.0, 1.0, 1.0),
    DVec3::new(0.0, -1.0, 1.0),
];

pub(super) struct Clipper<'a> {
    pub(super) faces: &'a Faces,
    /// Lengths below which coordinates are equal, in (u, v) of plane waves and of points.
    pub(super) eps: f64,
    /// Within so much of one plane faces of different bodies lie on one another, m; 0 where they never do.
    pub(super) lies_m: f64,
    pub(super) options: &'a BeamOptions,
    /// None says nothing of the beams that the limit of bounces ends.
    pub(super) ends: Option<Ends<'a>>,
    /// Facets of curved surfaces are lit later, where they can return something: beams only list them.
    pub(super) later: bool,
}

/// A beam that leaves a plane towards facets of curved surfaces.
#[derive(Debug, Clone)]
pub(super) struct Onward {
    /// The node that it leaves.
    pub(super) node: u32,
    pub(super) polygon: Polygon,
    /// Facets ahead of it, seen or not.
    pub(super) facets: Box<[u32]>,
}

/// What of each face can be seen from a port, in the (u, v) of the port's frame.
pub(super) struct VisibleFaces {
    frame: Frame,
    /// Only within |u|, |v| <= 1.
    window: bool,
    ranges: Vec<(u32, u32)>,
    polygons: Vec<Polygon>,
    /// Bounds of each polygon: a road between many markers is seen in thousands of parts.
    bounds: Vec<(DVec2, DVec2)>,
    /// The face is seen whole.
    whole: Vec<bool>,
}

impl VisibleFaces {
    /// What a window sees of each face, and whether that is all of it.
    pub(super) fn of_window(frame: Frame, faces: Vec<(Vec<Polygon>, bool)>) -> VisibleFaces {
        let (mut ranges, mut polygons) = (Vec::with_capacity(faces.len()), Vec::new());
        let mut whole = Vec::with_capacity(faces.len());
        for (of, is_whole) in faces {
            ranges.push((polygons.len() as u32, (polygons.len() + of.len()) as u32));
            whole.push(is_whole);
            polygons.extend(of);
        }
        let bounds = polygons.iter().map(Polygon::bounds).collect();
        VisibleFaces { frame, window: true, ranges, polygons, bounds, whole }
    }

    fn of(&self, face: u32) -> &[Polygon] {
        &self.polygons[self.range(face)]
    }

    fn range(&self, face: u32) -> std::ops::Range<usize> {
        let (a, b) = self.ranges[face as usize];
        a as usize..b as usize
    }
}

/// Follows the beams from `transmit` and keeps what radiates to `receive`.
pub fn clip(faces: &Faces, transmit: Port, receive: Port, options: &BeamOptions) -> Clipped {
    let frame = Frame::new(transmit, faces.centre_m);
    let extent = if frame.from_point {
        // Coordinates are tangents of angles.
        faces.radius_m / (faces.centre_m - frame.origin).length()
    } else {
        faces.radius_m
    };
    let clipper = Clipper { faces, eps: 1e-12 * extent, lies_m: 0.0, options, ends: None, later: false };
    let lit = [clipper.seen_from(frame, false)];
    let far_seen = (transmit != receive).then(|| {
        let frame = Frame::new(receive, faces.centre_m);
        [clipper.seen_from(frame, false)]
    });
    let found = clipper.follow_all(&lit, far_seen.as_ref().map(|s| &s[..]), receive);
    Clipped { tubes: options.facets_reflect, ..found }
}

/// Follows the beams of a radar that may stand amid the faces, up to their `ends`. Each window is a frame from the radar's
/// place, of which the directions with |u|, |v| <= 1 count.
pub fn clip_windows(
    faces: &Faces,
    windows: &[Frame],
    options: &BeamOptions,
    ends: Option<Ends<'_>>,
) -> Clipped {
    let Some(at) = windows.first().map(|w| w.origin) else { return Clipped::default() };
    let clipper = Clipper { faces, eps: 1e-12, lies_m: LIES_M, options, ends, later: false };
    let lit: Vec<VisibleFaces> = windows.iter().map(|w| clipper.seen_from(*w, true)).collect();
    Clipped { windows: windows.to_vec(), ..clipper.follow_all(&lit, None, Port::At(at)) }
}

/// What was found apart, the first nodes of which stand for those that are known by other numbers.
struct Apart {
    found: Clipped,
    known: Vec<u32>,
}

impl Apart {
    /// The number of a node, where the first new one is number `base`.
    fn number(&self, node: u32, base: u32) -> u32 {
        let new = || node - self.known.len() as u32 + base;
        self.known.get(node as usize).copied().unwrap_or_else(new)
    }

    fn new_nodes(&self) -> &[Node] {
        &self.found.nodes[self.known.len()..]
    }
}

impl Clipped {
    /// Adds parts in their order.
    fn extend(&mut self, parts: &[Apart]) {
        let mut next = self.nodes.len() as u32;
        let based: Vec<(&Apart, u32)> = (parts.iter())
            .map(|part| {
                let base = next;
                next += part.new_nodes().len() as u32;
                (part, base)
            })
            .collect();
        let node = |part: &Apart, base: u32, n: &Node| Node {
            parent: if n.parent == u32::MAX { n.parent } else { part.number(n.parent, base) },
            ..*n
        };
        let piece = |part: &Apart, base: u32, p: &Piece| Piece { node: part.number(p.node, base), ..*p };
        let ended = |part: &Apart, base: u32, e: &Ended| Ended { node: part.number(e.node, base), ..*e };
        let onward =
            |part: &Apart, base: u32, o: &Onward| Onward { node: part.number(o.node, base), ..o.clone() };
        gather(&mut self.nodes, &based, Apart::new_nodes, node);
        gather(&mut self.every, &based, |part| &part.found.every, piece);
        gather(&mut self.last, &based, |part| &part.found.last, piece);
        gather(&mut self.imaged, &based, |part| &part.found.imaged, piece);
        gather(&mut self.ended, &based, |part| &part.found.ended, ended);
        gather(&mut self.onward, &based, |part| &part.found.onward, onward);
    }
}

/// Adds `of` all parts to a list, as `moved` makes it.
fn gather<T: Send + Sync>(
    to: &mut Vec<T>,
    parts: &[(&Apart, u32)],
    of: impl Fn(&Apart) -> &[T],
    moved: impl Fn(&Apart, u32, &T) -> T + Send + Sync,
) {
    let all: Vec<(&Apart, u32, &T)> =
        parts.iter().flat_map(|(part, base)| of(part).iter().map(|x| (*part, *base, x))).collect();
    to.par_extend(all.into_par_iter().map_tasks(|(part, base, x)| moved(part, base, x)));
}

/// Pieces of one first face that are lit from a port.
struct Lit<'a> {
    frame: Frame,
    face: u32,
    pieces: &'a [Polygon],
    /// Whether other pieces of the face come in the task before.
    goes_on: bool,
}

/// What is lit from a port, in tasks of about as many pieces: a road between many markers is seen in thousands.
fn firsts(lit: &[VisibleFaces]) -> Vec<Vec<Lit<'_>>> {
    const PIECES: usize = 16;
    let (mut tasks, mut task, mut count) = (Vec::new(), Vec::new(), 0);
    for view in lit {
        for face in 0..view.ranges.len() as u32 {
            let (mut left, mut goes_on) = (view.of(face), false);
            while !left.is_empty() {
                let pieces;
                (pieces, left) = left.split_at(left.len().min(PIECES - count));
                count += pieces.len();
                task.push(Lit { frame: view.frame, face, pieces, goes_on });
                goes_on = false;
                if count == PIECES {
                    tasks.push(std::mem::take(&mut task));
                    (count, goes_on) = (0, true);
                }
            }
        }
    }
    if !task.is_empty() {
        tasks.push(task);
    }
    tasks
}

/// Who receives what beams light.
struct Receiver<'a> {
    seen: &'a [VisibleFaces],
    /// Whether that is where the beams come from.
    monostatic: bool,
    port: Port,
}

/// `work` on 0..n in pieces, in their order. Few faces are not worth a hand-over between threads.
pub(super) fn in_chunks<T: Send>(n: usize, work: impl Fn(std::ops::Range<usize>) -> T + Sync) -> Vec<T> {
    // One face may take a thousand times as long as another.
    const CHUNK: usize = 16;
    if n <= 8 * CHUNK {
        return vec![work(0..n)];
    }
    (0..n.div_ceil(CHUNK)).into_par_iter().map_tasks(|c| work(c * CHUNK..((c + 1) * CHUNK).min(n))).collect()
}

impl Clipper<'_> {
    /// Facing of the face, or None when it cannot be lit from there.
    #[inline]
    pub(super) fn lit(&self, frame: &Frame, face: &Face) -> Option<f64> {
        let facing = frame.facing(face.normal, face.offset_m);
        let grazing = if frame.from_point { GRAZING * self.faces.radius_m } else { GRAZING };
        (facing.abs() > grazing && !(face.one_sided && facing > 0.0)).then_some(facing)
    }

    #[inline]
    pub(super) fn place(&self, face: &Face, side: &Side) -> PlaneSide {
        self.place_within(self.faces.corners(face), side, self.faces.flat_m)
    }

    /// The same for rays that leave the plane: what lies on it they do not meet, nor the rest of their own patch, whose corners may be
    /// farther off the plane than `flat_m` (a warped quadrilateral of a road).
    #[inline]
    pub(super) fn ahead(&self, face: &Face, source: &Side) -> PlaneSide {
        if face.patch == source.patch {
            return PlaneSide::Behind;
        }
        self.place_within(self.faces.corners(face), source, self.faces.flat_m.max(self.lies_m))
    }

    #[inline]
    fn place_within(&self, corners: &[DVec3], side: &Side, flat_m: f64) -> PlaneSide {
        let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
        for p in corners {
            let d = side.normal.dot(*p) - side.offset;
            lo = lo.min(d);
            hi = hi.max(d);
        }
        if hi <= flat_m {
            PlaneSide::Behind
        } else if lo >= -flat_m {
            PlaneSide::Before
        } else {
            PlaneSide::Across
        }
    }

    /// Whether a face lies on the plane of another, of a larger patch of another body: then it is seen and the other is not, whichever
    /// of them rounding puts in front.
    #[inline]
    pub(super) fn lies_on(&self, face: &Face, other: &Face) -> bool {
        if self.lies_m == 0.0 || face.body == other.body {
            return false;
        }
        let area = |f: &Face| (self.faces.patch_area_m2[f.patch as usize], f.body);
        area(face) < area(other) && self.lies_in(face, other)
    }

    #[inline]
    fn lies_in(&self, face: &Face, plane: &Face) -> bool {
        self.faces.corners(face).iter().all(|p| (plane.normal.dot(*p) - plane.offset_m).abs() <= self.lies_m)
    }

    /// The edges of a face that cut `polygon`, inside positive. None when the two are apart.
    #[inline]
    pub(super) fn outline(
        &self,
        frame: &Frame,
        face: &Face,
        facing: f64,
        polygon: &Polygon,
    ) -> Option<Lines> {
        let corners = self.faces.corners(face);
        let sign = facing.signum();
        let mut lines = Lines::new();
        let mut a = corners[corners.len() - 1];
        for &b in corners {
            let line = if frame.from_point {
                let m = (a - frame.origin).cross(b - frame.origin) * sign;
                Line::new(m.dot(frame.u), m.dot(frame.v), m.dot(frame.k))
            } else {
                let m = frame.k.cross(b - a) * sign;
                Line::new(m.dot(frame.u), m.dot(frame.v), m.dot(frame.origin - a))
            };
            if !lines.narrow(line, polygon, self.eps) {
                return None;
            }
            a = b;
        }
        Some(lines)
    }

    /// Half-spaces around the rays through `polygon`.
    #[inline]
    pub(super) fn prism(frame: &Frame, (lo, hi): (DVec2, DVec2)) -> [HalfSpace; 4] {
        let wall = |axis: DVec3, at: f64, sign: f64| {
            if frame.from_point {
                let normal = (axis - frame.k * at) * sign;
                HalfSpace { normal, offset: normal.dot(frame.origin) }
            } else {
                let normal = axis * sign;
                HalfSpace { normal, offset: normal.dot(frame.origin) + sign * at }
            }
        };
        [
            wall(frame.u, lo.x, 1.0),
            wall(frame.u, hi.x, -1.0),
            wall(frame.v, lo.y, 1.0),
            wall(frame.v, hi.y, -1.0),
        ]
    }

    /// Follows what every face is lit by; `far_seen` when the receiver stands elsewhere.
    pub(super) fn follow_all(
        &self,
        lit: &[VisibleFaces],
        far_seen: Option<&[VisibleFaces]>,
        receive: Port,
    ) -> Clipped {
        let beams = Receiver { seen: far_seen.unwrap_or(lit), monostatic: far_seen.is_none(), port: receive };
        let follow = |some: &Vec<Lit<'_>>| {
            let (mut out, mut scratch) = (Clipped::default(), Scratch::new());
            for Lit { frame, face, pieces, .. } in some {
                let root = out.nodes.len() as u32;
                let of = &self.faces.faces[*face as usize];
                out.nodes.push(Node {
                    parent: u32::MAX,
                    face: *face,
                    bounce: 1,
                    imaged: false,
                    endless: false,
                    frame: *frame,
                    normal: Side::of(of, frame.facing(of.normal, of.offset_m)).normal,
                });
                self.follow(of, &beams, pieces.iter().map(|p| (root, *p)), &mut out, &mut scratch);
            }
            out
        };
        let firsts = firsts(lit);
        let parts: Vec<Clipped> = match &firsts[..] {
            [only] => vec![follow(only)],
            all => all.par_iter().map_tasks(follow).collect(),
        };
        // The last face of a part may go on in the next.
        let (mut all, mut root, mut next) = (Clipped::default(), u32::MAX, 0);
        let apart = |(some, found): (&Vec<Lit<'_>>, Clipped)| {
            let known = if some[0].goes_on { vec![root] } else { Vec::new() };
            let part = Apart { found, known };
            // Roots alone have no parent.
            let last = part.new_nodes().iter().rposition(|n| n.parent == u32::MAX);
            root = last.map_or(root, |i| next + i as u32);
            next += part.new_nodes().len() as u32;
            part
        };
        let parts: Vec<Apart> = firsts.iter().zip(parts).map(apart).collect();
        all.extend(&parts);
        all
    }

    /// What of every face is seen along the rays of `frame`, or of those in its window.
    pub(super) fn seen_from(&self, frame: Frame, window: bool) -> VisibleFaces {
        let n = self.faces.faces.len();
        let parts = in_chunks(n, |range| {
            let (mut counts, mut whole) = (Vec::with_capacity(range.len()), Vec::with_capacity(range.len()));
            let mut polygons = Vec::with_capacity(range.len());
            let (mut pieces, mut scratch) = (Vec::new(), Scratch::new());
            for f in range {
                let face = &self.faces.faces[f];
                pieces.clear();
                let mut cut = false;
                let later = self.is_later(face);
                if let Some(facing) = self.lit(&frame, face).filter(|_| !later) {
                    let (p, whole) = self.start(&frame, window, face);
                    if p.n >= 3 {
                        cut =
                            self.visible_part(&frame, None, f as u32, facing, &p, &mut pieces, &mut scratch)
                                || !whole;
                    }
                }
                counts.push(pieces.len() as u32);
                whole.push(!cut && !pieces.is_empty());
                polygons.append(&mut pieces);
            }
            (counts, whole, polygons)
        });
        let mut seen = VisibleFaces {
            frame,
            window,
            ranges: Vec::with_capacity(n),
            polygons: Vec::new(),
            bounds: Vec::new(),
            whole: Vec::with_capacity(n),
        };
        for (counts, whole, polygons) in parts {
            let mut at = seen.polygons.len() as u32;
            for c in counts {
                seen.ranges.push((at, at + c));
                at += c;
            }
            seen.whole.extend(whole);
            seen.polygons.extend(polygons);
        }
        seen.bounds = seen.polygons.iter().map(Polygon::bounds).collect();
        seen
    }

    /// A face as it would be seen if nothing hid it, and whether that is all of it.
    pub(super) fn start(&self, frame: &Frame, window: bool, face: &Face) -> (Polygon, bool) {
        let corners = self.faces.corners(face);
        let mut out = Polygon::EMPTY;
        if !window {
            corners.iter().for_each(|c| out.push(frame.project(*c)));
            return (out, true);
        }
        // Corners may lie beside or behind the radar: cut before projecting. Each wall adds a corner at most.
        let (mut points, mut kept) = ([DVec3::ZERO; CAP], [DVec3::ZERO; CAP]);
        let mut n = corners.len();
        for (point, c) in points.iter_mut().zip(corners) {
            let d = *c - frame.origin;
            *point = DVec3::new(frame.u.dot(d), frame.v.dot(d), frame.k.dot(d));
        }
        let mut whole = true;
        for wall in WALLS {
            let d = points.map(|p| wall.dot(p));
            if d[..n].iter().all(|d| *d >= 0.0) {
                continue;
            }
            whole = false;
            let mut count = 0;
            let mut keep = |p: DVec3| {
                kept[count] = p;
                count += 1;
            };
            for i in 0..n {
                let j = if i + 1 == n { 0 } else { i + 1 };
                if d[i] >= 0.0 {
                    keep(points[i]);
                }
                if d[i] * d[j] < 0.0 {
                    keep(points[i] + (points[j] - points[i]) * (d[i] / (d[i] - d[j])));
                }
            }
            std::mem::swap(&mut points, &mut kept);
            n = count;
        }
        points[..n].iter().filter(|p| p.z > 0.0).for_each(|p| out.push(p.truncate() / p.z));
        (out, whole)
    }

    /// The part of a polygon on a face, in the (u, v) of `frame`, that lies in a window. Both frames are
    /// those of point sources.
    fn in_window(&self, frame: &Frame, nearness: DVec3, polygon: &Polygon, window: &Frame) -> Polygon {
        let mut p = *polygon;
        for wall in WALLS {
            let m = window.u * wall.x + window.v * wall.y + window.k * wall.z;
            let s = m.dot(frame.origin - window.origin);
            let q = nearness * s;
            let line = Line::new(m.dot(frame.u) + q.x, m.dot(frame.v) + q.y, m.dot(frame.k) + q.z);
            p = p.kept(&line, self.eps);
            if p.n < 3 {
                return Polygon::EMPTY;
            }
        }
        p
    }

    /// Appends what of `start`, a polygon on `target`, is seen along the rays of `frame` that set out from
    /// `source`. True when something was cut away.
    #[allow(clippy::too_many_arguments)] // what it takes to cut; a struct would only rename it
    pub(super) fn visible_part(
        &self,
        frame: &Frame,
        source: Option<&Side>,
        target: u32,
        facing: f64,
        start: &Polygon,
        pieces: &mut Vec<Polygon>,
        scratch: &mut Scratch,
    ) -> bool {
        let lit = |other: &Face| self.lit(frame, other);
        self.visible_past(lit, frame, source, target, facing, start, pieces, scratch)
    }

    /// The same with `lit` to say what the rays can meet, and its facing.
    #[allow(clippy::too_many_arguments)] // the state of one beam; a struct would only rename it
    #[inline]
    pub(super) fn visible_past(
        &self,
        lit: impl Fn(&Face) -> Option<f64>,
        frame: &Frame,
        source: Option<&Side>,
        target: u32,
        facing: f64,
        start: &Polygon,
        pieces: &mut Vec<Polygon>,
        scratch: &mut Scratch,
    ) -> bool {
        let faces = self.faces;
        let mut sight = self.sight(frame, source, target, facing, start, scratch);
        let side = sight.side;
        let [a, b, c, d] = Self::prism(frame, start.bounds());
        // What lies on the target may stand a little behind its plane.
        let above = if self.lies_m > 0.0 { -self.lies_m } else { faces.flat_m };
        let near = HalfSpace { normal: side.normal, offset: side.offset + above };
        let source_space =
            source.map_or(near, |s| HalfSpace { normal: s.normal, offset: s.offset + faces.flat_m });
        // What is near the place that rays come from hides most.
        let from = frame.from_point.then_some(frame.origin);
        faces.within_until(&[a, b, c, d, near, source_space], from, |g| {
            if g != target
                && let Some(facing) = lit(&faces.faces[g as usize])
            {
                self.hide(&mut sight, g, facing, scratch);
            }
            scratch.seen.polygons.is_empty()
        });
        pieces.append(&mut scratch.seen.polygons);
        sight.cut
    }

    /// The same among `others`, all that the rays can meet within a polygon that holds `start`.
    #[allow(clippy::too_many_arguments)] // the state of one beam; a struct would only rename it
    fn visible_among(
        &self,
        others: &Targets,
        frame: &Frame,
        source: &Side,
        target: u32,
        facing: f64,
        start: &Polygon,
        pieces: &mut Vec<Polygon>,
        scratch: &mut Scratch,
    ) -> bool {
        let mut sight = self.sight(frame, Some(source), target, facing, start, scratch);
        let (lo, hi) = start.bounds();
        for (&(g, facing, _), (low, high)) in others.list.iter().zip(&others.bounds) {
            let apart = low.x > hi.x || high.x < lo.x || low.y > hi.y || high.y < lo.y;
            if apart || g == target {
                continue;
            }
            self.hide(&mut sight, g, facing, scratch);
            if scratch.seen.polygons.is_empty() {
                break;
            }
        }
        pieces.append(&mut scratch.seen.polygons);
        sight.cut
    }

    /// The sight of a target that nothing hides yet: all of `start`.
    fn sight<'a>(
        &self,
        frame: &'a Frame,
        source: Option<&'a Side>,
        target: u32,
        facing: f64,
        start: &'a Polygon,
        scratch: &mut Scratch,
    ) -> Sight<'a> {
        scratch.seen.begin(start);
        let side = Side::of(&self.faces.faces[target as usize], facing);
        Sight { frame, source, target, side, start, least: SLIVER * start.area().abs(), cut: false }
    }

    /// Takes away what the face `other`, which the rays can meet, hides of a target. A patch is flat: none of its faces hides another, though
    /// corners may be farther off their plane than `flat_m`.
    #[inline]
    fn hide(&self, sight: &mut Sight<'_>, other: u32, other_facing: f64, scratch: &mut Scratch) {
        let Sight { frame, source, start, .. } = *sight;
        let face = &self.faces.faces[sight.target as usize];
        let other = &self.faces.faces[other as usize];
        if face.patch == other.patch || self.lies_on(face, other) {
            return;
        }
        let crossing = match self.place(other, &sight.side) {
            _ if self.lies_on(other, face) => None,
            PlaneSide::Behind => return,
            PlaneSide::Before => None,
            PlaneSide::Across => match self.place(face, &Side::of(other, other_facing)) {
                PlaneSide::Before => return,
                PlaneSide::Behind => None,
                PlaneSide::Across => {
                    let q = frame.nearness(other.normal, other.offset_m)
                        - frame.nearness(face.normal, face.offset_m);
                    Some(Line::new(q.x, q.y, q.z))
                }
            },
        };
        let beyond = match source.map(|s| (s, self.ahead(other, s))) {
            None | Some((_, PlaneSide::Before)) => None,
            Some((_, PlaneSide::Behind)) => return,
            Some((s, PlaneSide::Across)) => Some(self.beyond(frame, s, other)),
        };
        let Some(mut lines) = self.outline(frame, other, other_facing, start) else { return };
        if crossing.into_iter().chain(beyond).all(|l| lines.narrow(l, start, self.eps)) {
            let Scratch { halves, part, new, seen, .. } = scratch;
            sight.cut |= seen.subtract(&lines, sight.least, self.eps, halves, (part, new));
        }
    }

    /// Positive where `face` lies farther than the plane of the source.
    pub(super) fn beyond(&self, frame: &Frame, source: &Side, face: &Face) -> Line {
        let q = frame.nearness(source.normal, source.offset) - frame.nearness(face.normal, face.offset_m);
        Line::new(q.x, q.y, q.z)
    }

    /// Takes the inside of `lines` out of what is left of a polygon.
    pub(super) fn subtract(
        &self,
        lines: &Lines,
        least: f64,
        pieces: &mut Remainder,
        scratch: &mut Scratch,
    ) -> bool {
        let Scratch { halves, part, new, .. } = scratch;
        pieces.subtract(lines, least, self.eps, halves, (part, new))
    }

    /// The largest share of the amplitude that a beam has left after its last node, by the way of the ray at `uv`, whose coordinates
    /// mirrors do not change.
    pub(super) fn left(&self, ends: &Ends, nodes: &[Node], last: u32, uv: DVec2) -> f64 {
        let parent = |i: &u32| Some(nodes[*i as usize].parent).filter(|p| *p != u32::MAX);
        let share = |i: u32| {
            let node = &nodes[i as usize];
            let cos_i = -node.normal.dot(node.frame.direction(uv));
            let surface = &ends.surfaces[self.faces.faces[node.face as usize].surface as usize];
            let (across, along) = surface.reflection(ends.wavenumber, cos_i.clamp(GRAZING, 1.0));
            across.norm().max(along.norm())
        };
        std::iter::successors(Some(last), parent).map(share).product()
    }

    /// Lists what a beam that ends after it has left `source` would meet next, in cells no wider than the first Fresnel zone, or weaker
    /// than what counts.
    pub(super) fn end(
        &self,
        ends: &Ends,
        (node, left): (u32, f64),
        polygon: &Polygon,
        (frame, source): (&Frame, &Side),
        out: &mut Vec<Ended>,
    ) {
        let nearness = frame.nearness(source.normal, source.offset);
        let mut cells = vec![*polygon];
        while let Some(cell) = cells.pop() {
            let uv = middle(&cell);
            let solid_angle_sr = solid_angle_sr(&cell);
            let is_weak = ends.most(solid_angle_sr) * left <= ends.least;
            if cell.n < 3 || is_weak && !ends.keeps_weak {
                continue;
            }
            let (lo, hi) = cell.bounds();
            let widest = (hi - lo).max_element();
            let range_m = frame.origin.distance(frame.lift(uv, nearness));
            if !is_weak && widest * widest * range_m * ends.wavenumber > 2.0 * PI {
                let across = if hi.x - lo.x > hi.y - lo.y { DVec2::X } else { DVec2::Y };
                cells.extend(cell.split(0.5 * (lo + hi), across));
                continue;
            }
            if let Some((face, place)) = self.met_by(frame, source, uv) {
                let image = frame.origin;
                out.push(Ended { node, face, place, image, middle: uv, solid_angle_sr, left });
            }
        }
    }

    /// The first face that the ray at `uv` of a frame with a point source meets after it has left `source`, and where.
    fn met_by(&self, frame: &Frame, source: &Side, uv: DVec2) -> Option<(u32, DVec3)> {
        let mut ray = Polygon::EMPTY;
        ray.push(uv);
        let start = frame.lift(uv, frame.nearness(source.normal, source.offset));
        let beyond_all_m = start.distance(self.faces.centre_m) + self.faces.radius_m;
        let end = Cell::new(start + frame.direction(uv) * beyond_all_m);
        let mut first: Option<(f64, u32, DVec3)> = None;
        let misses = |centre: DVec3, half: DVec3| misses_segment(start, end.get(), LIES_M)(centre, half);
        self.faces.visit_boxes(misses, |f| {
            let target = &self.faces.faces[f as usize];
            let Some(facing) = self.lit(frame, target) else { return };
            if self.ahead(target, source) == PlaneSide::Behind
                || self.outline(frame, target, facing, &ray).is_none()
            {
                return;
            }
            let nearness = frame.nearness(target.normal, target.offset_m);
            let q = nearness.x * uv.x + nearness.y * uv.y + nearness.z;
            let place = frame.lift(uv, nearness);
            let is_ahead = source.normal.dot(place) - source.offset > self.faces.flat_m;
            if q > 0.0 && is_ahead && first.is_none_or(|(nearest, number, _)| (q, number) > (nearest, f)) {
                first = Some((q, f, place));
                end.set(place);
            }
        });
        first.map(|(_, face, place)| (face, place))
    }

    /// Bounces of a chain; the one on an endless mirror ahead of what it lights comes on top.
    pub(super) fn most(&self, endless: bool) -> usize {
        (self.options.bounces + usize::from(endless)).min(MAX_BOUNCES)
    }

    /// Whether a node is that of a plane which may mirror what follows it.
    pub(super) fn begins(&self, node: &Node, first_patch: u32) -> bool {
        self.options.images && node.bounce == 1 && self.faces.mirrors_points(first_patch)
    }

    /// The part of a beam that leaves `source` which a face covers if nothing hides it, and how the face is turned to it.
    pub(super) fn met(
        &self,
        frame: &Frame,
        source: &Side,
        face: u32,
        polygon: &Polygon,
        scratch: &mut Scratch,
    ) -> Option<(f64, Polygon)> {
        let target = &self.faces.faces[face as usize];
        let facing = self.lit(frame, target)?;
        let beyond = match self.ahead(target, source) {
            PlaneSide::Behind => return None,
            PlaneSide::Before => None,
            PlaneSide::Across => Some(self.beyond(frame, source, target)),
        };
        let mut lines = self.outline(frame, target, facing, polygon)?;
        if !beyond.into_iter().all(|l| lines.narrow(l, polygon, self.eps)) {
            return None;
        }
        let p = cut_by(polygon, lines.all(), self.eps, &mut scratch.halves)?;
        (p.area().abs() > SLIVER * polygon.area().abs()).then_some((facing, *p))
    }

    /// Whether a face is a facet of a curved surface that stands for a ray tube.
    #[inline]
    fn is_tube(&self, face: &Face) -> bool {
        face.is_curved() && self.options.facets_reflect
    }

    /// Whether a face is lit when it is known whether it can return anything.
    #[inline]
    fn is_later(&self, face: &Face) -> bool {
        self.later && face.curved != NOT_CURVED
    }

    /// Whether no beam goes on from a face: a curved surface is no mirror made of facets. What leads from it over planes to the receiver is
    /// found from the receiver's side.
    #[inline]
    pub(super) fn ends_on(&self, face: &Face) -> bool {
        face.curved != NOT_CURVED && !self.options.facets_reflect
    }

    /// Follows beams through their bounces that light polygons of nodes of `out`, all of them chains that begin with the face `first`.
    fn follow(
        &self,
        first: &Face,
        receiver: &Receiver<'_>,
        lit: impl DoubleEndedIterator<Item = (u32, Polygon)>,
        out: &mut Clipped,
        scratch: &mut Scratch,
    ) {
        let Receiver { seen, monostatic, port: receive } = *receiver;
        let first_patch = first.patch;
        let mut lists = std::mem::take(&mut scratch.lists);
        let Lists { stack, candidates, targets, parts, exits } = &mut lists;
        stack.extend(lit.rev());
        while let Some((index, polygon)) = stack.pop() {
            let node = out.nodes[index as usize];
            let first_is_seen = node.bounce == 1 && monostatic;
            if self.ends_on(&self.faces.faces[node.face as usize]) {
                if first_is_seen && self.options.last {
                    self.radiate(index, &node, &polygon, true, seen, receive, &mut out.last);
                }
                let to = if first_is_seen { &mut out.every } else { &mut out.imaged };
                self.radiate(index, &node, &polygon, true, seen, receive, to);
                continue;
            }
            self.radiate(index, &node, &polygon, first_is_seen, seen, receive, &mut out.every);
            let is_curved = self.is_tube(&self.faces.faces[node.face as usize]);
            let patch = self.faces.faces[node.face as usize].patch;
            if is_curved || node.imaged && self.faces.mirrors(first_patch, patch) {
                self.radiate(index, &node, &polygon, true, seen, receive, &mut out.imaged);
            }
            let begins = self.begins(&node, first_patch);
            let go_on = (node.bounce as usize) < self.most(node.endless || begins);
            // What the limit ends here is asked for where it could show at all.
            let ends = self.ends.filter(|e| {
                node.bounce as usize >= self.most(node.endless) && e.most(solid_angle_sr(&polygon)) > e.least
            });
            if !go_on && !self.options.last && ends.is_none() {
                continue;
            }
            let face = &self.faces.faces[node.face as usize];
            let source = Side::facing(face, node.normal);
            let frame = node.frame.mirrored(node.normal, source.offset);
            if let Some(ends) = ends {
                let left = self.left(&ends, &out.nodes, index, middle(&polygon));
                let is_followed = |target: u32| {
                    begins && self.faces.is_endless(first_patch, self.faces.faces[target as usize].patch)
                };
                let mut met = Vec::new();
                self.end(&ends, (index, left), &polygon, (&frame, &source), &mut met);
                out.ended.extend(met.into_iter().filter(|e| !is_followed(e.face)));
                if !go_on && !self.options.last {
                    continue;
                }
            }
            exits.clear();
            if self.options.last {
                exits.begin(&polygon);
            }
            targets.clear();
            let least = SLIVER * polygon.area().abs();
            let [a, b, c, d] = Self::prism(&frame, polygon.bounds());
            let ahead = HalfSpace { normal: source.normal, offset: source.offset + self.faces.flat_m };
            candidates.clear();
            self.faces.within(&[a, b, c, d, ahead], |f| candidates.push(f));
            // Lists what of a face the beam may meet; the lines around it, where it may.
            let list = |f: u32, halves: &mut [Polygon; 2], list: &mut Vec<(u32, f64, Polygon)>| {
                let target = &self.faces.faces[f as usize];
                let facing = self.lit(&frame, target)?;
                let beyond = match self.ahead(target, &source) {
                    PlaneSide::Behind => return None,
                    PlaneSide::Before => None,
                    PlaneSide::Across => Some(self.beyond(&frame, &source, target)),
                };
                let mut lines = self.outline(&frame, target, facing, &polygon)?;
                if !beyond.into_iter().all(|l| lines.narrow(l, &polygon, self.eps)) {
                    return None;
                }
                let p = cut_by(&polygon, lines.all(), self.eps, halves)?;
                if p.area().abs() <= least {
                    return None;
                }
                list.push((f, facing, *p));
                Some(lines)
            };
            if self.options.last {
                for f in candidates.iter() {
                    if let Some(lines) = list(*f, &mut scratch.halves, &mut targets.list) {
                        self.subtract(&lines, least, exits, scratch);
                    }
                }
            } else if candidates.len() > self.options.followed_alone {
                let of = |some: &[u32]| {
                    let (mut halves, mut found) = ([Polygon::EMPTY; 2], Vec::new());
                    some.iter().for_each(|f| {
                        list(*f, &mut halves, &mut found);
                    });
                    found
                };
                let found: Vec<Vec<_>> = candidates.par_chunks(4 * SOME).map_tasks(of).collect();
                found.into_iter().for_each(|some| targets.list.extend(some));
            } else {
                for f in candidates.iter() {
                    list(*f, &mut scratch.halves, &mut targets.list);
                }
            }
            if self.options.last {
                for p in &exits.polygons {
                    self.radiate(index, &node, p, first_is_seen, seen, receive, &mut out.last);
                }
            }
            if !go_on {
                continue;
            }
            if self.later {
                let curved = targets
                    .list
                    .iter()
                    .map(|t| t.0)
                    .filter(|f| self.is_later(&self.faces.faces[*f as usize]));
                let facets: Box<[u32]> = curved.collect();
                if !facets.is_empty() {
                    out.onward.push(Onward { node: index, polygon, facets });
                }
            }
            let mark = stack.len();
            // What hides a target is among the targets; of many, a tree of boxes finds it sooner.
            let few = targets.list.len() <= self.options.occluders_listed;
            if few {
                targets.bounds.extend(targets.list.iter().map(|(_, _, p)| p.bounds()));
            }
            let targets = &*targets;
            // How its chain goes on with a target; None where it does not.
            let kind = |f: u32| {
                let patch = self.faces.faces[f as usize].patch;
                // What a curved surface reflects to planes is found from the receiver's side.
                let target = &self.faces.faces[f as usize];
                if self.is_later(target) || is_curved && !self.is_tube(target) {
                    return None;
                }
                let imaged = node.imaged || begins && self.faces.mirrors(first_patch, patch);
                let endless = node.endless || begins && self.faces.is_endless(first_patch, patch);
                ((node.bounce as usize) < self.most(endless)).then_some((imaged, endless))
            };
            let visible = |(f, facing, p): &(u32, f64, Polygon),
                           parts: &mut Vec<Polygon>,
                           scratch: &mut Scratch| match few {
                true => self.visible_among(targets, &frame, &source, *f, *facing, p, parts, scratch),
                false => self.visible_part(&frame, Some(&source), *f, *facing, p, parts, scratch),
            };
            let child = |f: u32, facing: f64, (imaged, endless): (bool, bool)| Node {
                parent: index,
                face: f,
                bounce: node.bounce + 1,
                imaged,
                endless,
                frame,
                normal: Side::of(&self.faces.faces[f as usize], facing).normal,
            };
            if targets.list.len() > self.options.followed_alone {
                let of = |some: &[(u32, f64, Polygon)]| -> Vec<(Node, Vec<Polygon>)> {
                    let mut scratch = Scratch::new();
                    let mut of_target = |t: &(u32, f64, Polygon)| {
                        let (kind, mut parts) = (kind(t.0)?, Vec::new());
                        visible(t, &mut parts, &mut scratch);
                        (!parts.is_empty()).then(|| (child(t.0, t.1, kind), parts))
                    };
                    some.iter().filter_map(&mut of_target).collect()
                };
                let found: Vec<Vec<_>> = targets.list.par_chunks(SOME).map_tasks(of).collect();
                let new = found.into_iter().flatten().collect();
                self.follow_apart(first, receiver, index, new, out);
                continue;
            }
            for target in targets.list.iter() {
                let Some(kind) = kind(target.0) else { continue };
                parts.clear();
                visible(target, parts, scratch);
                if parts.is_empty() {
                    continue;
                }
                let number = out.nodes.len() as u32;
                out.nodes.push(child(target.0, target.1, kind));
                stack.extend(parts.iter().map(|p| (number, *p)));
            }
            stack[mark..].reverse();
        }
        scratch.lists = lists;
    }

    /// The same for the new nodes below `parent`, each with what is lit of it, by tasks of their own.
    fn follow_apart(
        &self,
        first: &Face,
        receiver: &Receiver<'_>,
        parent: u32,
        new: Vec<(Node, Vec<Polygon>)>,
        out: &mut Clipped,
    ) {
        let base = out.nodes.len() as u32;
        out.nodes.extend(new.iter().map(|(node, _)| *node));
        let above = |i: &u32| Some(out.nodes[*i as usize].parent).filter(|p| *p != u32::MAX);
        let mut chain: Vec<u32> = std::iter::successors(Some(parent), above).collect();
        chain.reverse();
        let nodes = &out.nodes;
        let of = |(task, some): (usize, &[(Node, Vec<Polygon>)])| {
            // The nodes above and the new ones by the numbers that they have in this task.
            let depth = chain.len() as u32;
            let above =
                (0u32..).zip(&chain).map(|(i, at)| Node { parent: i.wrapping_sub(1), ..nodes[*at as usize] });
            let below = some.iter().map(|(node, _)| Node { parent: depth - 1, ..*node });
            let mut own = Clipped { nodes: above.chain(below).collect(), ..Clipped::default() };
            let lit: Vec<(u32, Polygon)> =
                (depth..).zip(some).flat_map(|(i, (_, parts))| parts.iter().map(move |p| (i, *p))).collect();
            self.follow(first, receiver, lit.into_iter(), &mut own, &mut Scratch::new());
            let first = base + (task * SOME) as u32;
            let known: Vec<u32> = chain.iter().copied().chain(first..first + some.len() as u32).collect();
            Apart { found: own, known }
        };
        let parts: Vec<Apart> = new.par_chunks(SOME).enumerate().map_tasks(of).collect();
        out.extend(&parts);
    }

    /// Keeps the part of a lit polygon that the receiver sees, along the face's axes.
    #[allow(clippy::too_many_arguments)] // the state of one beam; a struct would only rename it
    pub(super) fn radiate(
        &self,
        index: u32,
        node: &Node,
        polygon: &Polygon,
        is_seen: bool,
        seen: &[VisibleFaces],
        receive: Port,
        out: &mut Vec<Piece>,
    ) {
        let face = &self.faces.faces[node.face as usize];
        let nearness = node.frame.nearness(face.normal, face.offset_m);
        let corner = self.faces.corners[face.first as usize];
        let on_face = |p: DVec3| DVec2::new(face.axis[0].dot(p - corner), face.axis[1].dot(p - corner));
        let place = |uv: DVec2| node.frame.lift(uv, nearness);
        if is_seen {
            let polygon = polygon.mapped(|uv| on_face(place(uv)));
            out.push(Piece { node: index, polygon });
            return;
        }
        // The receiver has to stand on the lit side.
        let before = match receive {
            Port::Far(s) => node.normal.dot(s),
            Port::At(p) => node.normal.dot(p - corner),
        };
        if before <= 0.0 {
            return;
        }
        if seen.iter().any(|s| s.whole[node.face as usize]) {
            out.push(Piece { node: index, polygon: polygon.mapped(|uv| on_face(place(uv))) });
            return;
        }
        let mut inside = Vec::new();
        for view in seen {
            let parts = view.of(node.face);
            if parts.is_empty() {
                continue;
            }
            inside.clear();
            if view.window {
                keep(&self.in_window(&node.frame, nearness, polygon, &view.frame), 0.0, &mut inside);
            } else {
                inside.push(*polygon);
            }
            let receiver_nearness = view.frame.nearness(face.normal, face.offset_m);
            for polygon in &inside {
                let there = polygon.mapped(|uv| view.frame.project(place(uv)));
                let least = SLIVER * there.area().abs();
                let (lo, hi) = there.bounds();
                let (lo, hi) = (lo - self.eps, hi + self.eps);
                for (part, bounds) in parts.iter().zip(&view.bounds[view.range(node.face)]) {
                    if bounds.0.cmpgt(hi).any() || bounds.1.cmplt(lo).any() {
                        continue;
                    }
                    let both = overlap(there, part, self.eps);
                    if both.area().abs() > least {
                        let polygon = both.mapped(|uv| on_face(view.frame.lift(uv, receiver_nearness)));
                        out.push(Piece { node: index, polygon });
                    }
                }
            }
        }
    }
}

/// The mean of a polygon's corners.
pub(super) fn middle(p: &Polygon) -> DVec2 {
    p.corners().iter().sum::<DVec2>() / p.n as f64
}

/// Solid angle, sr, of a narrow beam from a point, given in the tangents of angles of its frame.
pub(super) fn solid_angle_sr(p: &Polygon) -> f64 {
    p.area().abs() / (1.0 + middle(p).length_squared()).powf(1.5)
}

/// Appends a polygon that is more than a sliver, halved when it has many corners.
pub(super) fn keep(p: &Polygon, least: f64, pieces: &mut Vec<Polygon>) {
    if p.n < 3 || p.area().abs() <= least {
        return;
    }
    if p.n > MOST {
        p.halves().iter().for_each(|h| keep(h, least, pieces));
    } else {
        pieces.push(*p);
    }
}

/// What two lists of polygons in one plane share.
pub(crate) fn overlaps(a: &[Polygon], b: &[Polygon]) -> Vec<Polygon> {
    let mut shared = Vec::new();
    for p in a {
        let size = p.area().abs();
        for q in b {
            let both = overlap(*p, q, OVERLAP * size.sqrt());
            if both.area().abs() > SLIVER * size {
                keep(&both, 0.0, &mut shared);
            }
        }
    }
    shared
}

/// Where two convex polygons overlap. Edges of no length have no direction and are passed over. A polygon that rounding has left without
/// an inside, such as one that lies in a corner, overlaps with nothing: half-planes through its edges would hold more than it.
pub(super) fn overlap(a: Polygon, b: &Polygon, eps: f64) -> Polygon {
    let sign = b.area().signum();
    let (mut out, mut around) = (a, 0.0);
    for i in 0..b.n {
        let (p, q) = (b.p[i], b.p[(i + 1) % b.n]);
        let e = q - p;
        around += e.length();
        if e.length() <= 10.0 * eps {
            continue;
        }
        // Left of an edge is inside when the polygon runs counter-clockwise.
        let (x, y) = (-e.y * sign, e.x * sign);
        out = out.kept(&Line::new(x, y, -(x * p.x + y * p.y)), eps);
        if out.n < 3 {
            return Polygon::EMPTY;
        }
    }
    if out.area().abs() > b.area().abs() + 10.0 * eps * around { Polygon::EMPTY } else { out }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A polygon of no extent, as rounding leaves it in a corner, overlaps with nothing; one of some extent with what it holds.
    #[test]
    fn what_has_no_inside_overlaps_with_nothing() {
        let polygon = |corners: &[[f64; 2]]| {
            Polygon::of(&corners.iter().map(|c| DVec2::from(*c)).collect::<Vec<_>>())[0]
        };
        let square = polygon(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        for (size, area) in [(1e-14, 0.0), (1e-12, 0.0), (1e-6, 0.5e-12), (0.5, 0.125)] {
            let small = polygon(&[[0.5, 0.5], [0.5 + size, 0.5], [0.5, 0.5 + size]]);
            let both = overlap(square, &small, 1e-12).area();
            assert!((both - area).abs() <= 1e-4 * area, "{size}: {both}");
        }
    }
}
