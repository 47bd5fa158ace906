//! Beams clipped with decisions in f32: what a device without f64 can decide, as a mode of the host that shows what it costs.
//!
//! Places of computed corners in f32 would err by micrometres at 100 m, which is hundredths of a radian at 77 GHz and more near grazing.
//! So no computed corner is kept as a place. Coordinates of view in f32 say which side of a line a corner is on, and nothing else; a corner
//! is the pair of lines that it lies on (an edge of a face, the crossing of two planes or a wall of a window, as seen through a chain of
//! mirrors), and its place is worked out from these, in f64 here.
//!
//! Rules without which corners are wrong: a line knows the chain of mirrors through which it was seen, and whether by the receiver; the
//! direction of an edge comes from the stored edge, never from two corners (walls and crossings of planes have it from the corners of
//! their side, and sides too short for that are passed over); a target is cut by the sides of its beam, not the beam by those of the
//! target; a corner that rounding puts on a line is on it within `EPS`.

use super::beams::{Clipped, Clipper, Node, Piece, Polygon, in_chunks, joined};
use crate::geom::faces::{Face, Faces, HalfSpace, LIES_M};
use crate::geom::hash::FastMap;
use crate::trace::beams::{BeamOptions, Frame};
use glam::{DVec2, DVec3, Vec2, Vec3, Vec4};

/// Tangents nearer to a line than this are on it.
const EPS: f32 = 5e-7;
/// Pieces of less area than this share of what they are cut from are dropped.
const SLIVER: f32 = 1e-11;
/// Share of the distances that enter it by which a distance from a plane may be wrong.
const FLAT: f32 = 3e-7;
/// What hides others is no narrower than this share of its length, on the mean.
const THIN: f32 = 1e-7;
/// A corner's place from its lines, seen from the radar, lies no farther from its coordinates than this; else the lines all but coincide,
/// and the coordinates decide.
const ASTRAY: f64 = 3e-5;
/// Planes that differ by less in nearness, as a share of it, do not cross in view.
const PARALLEL: f32 = 1e-6;
/// Share of the scene's radius by which boxes may be off in f32.
pub(crate) const PAD: f64 = 1e-6;
/// Farthest from a face's corner that a corner of a piece may be, m: beyond lies the horizon.
const FARTHEST_M: f64 = 1e5;

/// Walls of a window: inside where positive, in coordinates along (u, v, k).
const WALLS: [Vec3; 4] = [
    Vec3::new(1.0, 0.0, 1.0),
    Vec3::new(-1.0, 0.0, 1.0),
    Vec3::new(0.0, 1.0, 1.0),
    Vec3::new(0.0, -1.0, 1.0),
];

/// Number of a line of view, from which it can be had again exactly.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct LineId {
    pub of: Of,
    /// Whether it bounds what the receiver sees, and not what lights it.
    pub received: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Of {
    /// An edge, seen through a chain of mirrors.
    Edge { chain: u32, edge: u32 },
    /// Where the planes of two patches cross, seen through a chain of mirrors.
    Crossing { chain: u32, patches: [u32; 2] },
    /// A wall of the window of a view.
    Wall { view: u32, wall: u32 },
    /// Where u (axis 0) or v (1) of a view has this value, as the bits of an f32: polygons of many corners are halved there.
    Halving { view: u32, axis: u32, bits: u32 },
}

/// A corner of a polygon in the coordinates of a view.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    pub at: Vec2,
    /// The two lines that it lies on.
    pub on: [LineId; 2],
    /// The line of the side to the next corner.
    pub side: LineId,
}

pub(super) type Outline = Vec<Corner>;

/// The same before it is projected: along (u, v, k) of a view, m.
type Spatial = (Vec3, [LineId; 2], LineId);

/// A line that cuts, positive inside.
#[derive(Clone, Copy)]
struct Cutter {
    at: Vec2,
    normal: Vec2,
    id: LineId,
    /// A line at infinity keeps everything (1) or nothing (-1).
    all: f32,
}

impl Cutter {
    fn distance(&self, p: Vec2) -> f32 {
        if self.all != 0.0 {
            return self.all;
        }
        let d = self.normal.dot(p - self.at);
        if d.abs() <= EPS { 0.0 } else { d }
    }
}

#[derive(PartialEq, Clone, Copy)]
enum Cut {
    All,
    Nothing,
    Part,
}

#[derive(PartialEq, Clone, Copy)]
enum PlaneSide {
    Before,
    Across,
    Behind,
}

fn area(p: &[Corner]) -> f32 {
    if p.len() < 3 {
        return 0.0;
    }
    let turn = |i: usize| (p[i].at - p[0].at).perp_dot(p[i + 1].at - p[0].at);
    0.5 * (1..p.len() - 1).map(turn).sum::<f32>()
}

fn bounds(p: &[Corner]) -> (Vec2, Vec2) {
    let ends = (Vec2::splat(f32::INFINITY), Vec2::splat(f32::NEG_INFINITY));
    p.iter().fold(ends, |(lo, hi), v| (lo.min(v.at), hi.max(v.at)))
}

fn are_apart((lo, hi): (Vec2, Vec2), (low, high): (Vec2, Vec2)) -> bool {
    lo.cmpgt(high).any() || hi.cmplt(low).any()
}

/// 1 where a plane's front is lit, which faces the radar with less than zero.
pub(super) fn front(facing: f32) -> f32 {
    if facing < 0.0 { 1.0 } else { -1.0 }
}

/// Cuts a polygon of places by the walls of a window. `wall` names the line of each.
fn within_window(mut points: Vec<Spatial>, wall: impl Fn(u32) -> LineId) -> (Outline, bool) {
    let mut whole = true;
    for (number, normal) in (0..).zip(WALLS) {
        let d: Vec<f32> = points.iter().map(|p| normal.dot(p.0)).collect();
        if d.iter().all(|d| *d >= 0.0) {
            continue;
        }
        whole = false;
        let id = wall(number);
        let mut kept = Vec::with_capacity(points.len() + 1);
        for i in 0..points.len() {
            let j = (i + 1) % points.len();
            if d[i] >= 0.0 {
                let (at, on, side) = points[i];
                kept.push((at, on, if d[i] == 0.0 && d[j] < 0.0 { id } else { side }));
            }
            if d[i] * d[j] < 0.0 {
                let at = points[i].0 + (points[j].0 - points[i].0) * (d[i] / (d[i] - d[j]));
                let side = points[i].2;
                kept.push((at, [side, id], if d[i] > 0.0 { id } else { side }));
            }
        }
        points = kept;
        if points.len() < 3 {
            return (Vec::new(), false);
        }
    }
    let out = points
        .into_iter()
        .filter(|(at, ..)| at.z > 0.0)
        .map(|(at, on, side)| Corner { at: at.truncate() / at.z, on, side })
        .collect();
    (out, whole)
}

fn cut(p: &[Corner], line: &Cutter, inside: &mut Outline, outside: &mut Outline) -> Cut {
    let d: Vec<f32> = p.iter().map(|v| line.distance(v.at)).collect();
    if d.iter().all(|d| *d >= 0.0) {
        return Cut::All;
    }
    if d.iter().all(|d| *d <= 0.0) {
        return Cut::Nothing;
    }
    inside.clear();
    outside.clear();
    for i in 0..p.len() {
        let j = (i + 1) % p.len();
        if d[i] >= 0.0 {
            let side = if d[i] == 0.0 && d[j] < 0.0 { line.id } else { p[i].side };
            inside.push(Corner { side, ..p[i] });
        }
        if d[i] <= 0.0 {
            let side = if d[i] == 0.0 && d[j] > 0.0 { line.id } else { p[i].side };
            outside.push(Corner { side, ..p[i] });
        }
        if d[i] * d[j] < 0.0 {
            let at = p[i].at + (p[j].at - p[i].at) * (d[i] / (d[i] - d[j]));
            let (on, old) = ([p[i].side, line.id], p[i].side);
            let (leaves, enters) = if d[i] > 0.0 { (line.id, old) } else { (old, line.id) };
            inside.push(Corner { at, on, side: leaves });
            outside.push(Corner { at, on, side: enters });
        }
    }
    Cut::Part
}

fn cut_by(p: &[Corner], lines: &[Cutter]) -> Option<Outline> {
    let (mut now, mut inside, mut outside) = (p.to_vec(), Vec::new(), Vec::new());
    for line in lines {
        match cut(&now, line, &mut inside, &mut outside) {
            Cut::All => {}
            Cut::Nothing => return None,
            Cut::Part if inside.len() < 3 => return None,
            Cut::Part => std::mem::swap(&mut now, &mut inside),
        }
    }
    Some(now)
}

/// Adds a line that cuts `polygon`. False when it leaves nothing of it but what it touches.
fn narrow(line: Cutter, polygon: &[Corner], lines: &mut Vec<Cutter>) -> bool {
    let (mut low, mut high) = (false, false);
    for v in polygon {
        let d = line.distance(v.at);
        low |= d < 0.0;
        high |= d > 0.0;
    }
    if low {
        lines.push(line);
    }
    high
}

/// Takes the inside of `lines` out of `pieces`. Tells whether anything was cut away.
fn subtract(lines: &[Cutter], least: f32, pieces: &mut Vec<Outline>) -> bool {
    let (mut new, mut kept, mut is_cut) = (Vec::new(), Vec::new(), false);
    let keep = |p: &[Corner], new: &mut Vec<Outline>| {
        if p.len() >= 3 && area(p).abs() > least {
            new.push(p.to_vec());
        }
    };
    for piece in std::mem::take(pieces) {
        if cut_by(&piece, lines).is_none_or(|p| area(&p).abs() <= least) {
            kept.push(piece);
            continue;
        }
        is_cut = true;
        let (mut rest, mut next, mut part) = (piece, Vec::new(), Vec::new());
        for line in lines {
            match cut(&rest, line, &mut next, &mut part) {
                Cut::All => {}
                Cut::Nothing => {
                    keep(&rest, &mut new);
                    break;
                }
                Cut::Part => {
                    keep(&part, &mut new);
                    if next.len() < 3 {
                        break;
                    }
                    std::mem::swap(&mut rest, &mut next);
                }
            }
        }
    }
    kept.append(&mut new);
    *pieces = kept;
    is_cut
}

/// A view along rays from the radar or one of its images.
#[derive(Clone)]
pub(super) struct View {
    pub frame: Frame,
    /// Number of the chain of mirrors.
    pub chain: u32,
    /// Rows that take places from the radar along the sensor's axes to (u, v, k).
    pub rows: [Vec4; 3],
    /// Its origin from the radar along the sensor's axes, m.
    pub origin: Vec3,
    /// The view that the last mirror turned into this one; u32::MAX for a window.
    pub parent: u32,
}

/// The scene as f32 sees it, along the axes of the first window and from the radar, with names for what lines are made of.
pub(crate) struct Shared<'a> {
    pub faces: &'a Faces,
    pub(super) options: &'a BeamOptions,
    /// What decides in f64 because places do not enter it.
    pub(super) exact: Clipper<'a>,
    axes: [DVec3; 3],
    radar: DVec3,
    pub corners: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    pub offsets: Vec<f32>,
    /// The edge that begins at each corner.
    pub edge_of: Vec<u32>,
    /// Numbers of its two ends.
    edges: Vec<[u32; 2]>,
    /// From the first of them to the second.
    pub along: Vec<Vec3>,
    vertices: Vec<DVec3>,
    /// A face of each patch, whose plane stands for it.
    face_of_patch: Vec<u32>,
}

impl<'a> Shared<'a> {
    pub fn new(faces: &'a Faces, root: &Frame, options: &'a BeamOptions) -> Shared<'a> {
        let (axes, radar) = ([root.k, root.u, root.v], root.origin);
        let turn = |d: DVec3| DVec3::from(axes.map(|a| a.dot(d))).as_vec3();
        let mut numbers: FastMap<[u64; 3], u32> = FastMap::default();
        let mut vertices = Vec::new();
        let ids: Vec<u32> = faces
            .corners
            .iter()
            .map(|c| {
                *numbers.entry(c.to_array().map(f64::to_bits)).or_insert_with(|| {
                    vertices.push(*c);
                    vertices.len() as u32 - 1
                })
            })
            .collect();
        let mut edge_numbers: FastMap<(u32, u32), u32> = FastMap::default();
        let (mut edges, mut along, mut edge_of) = (Vec::new(), Vec::new(), vec![0; faces.corners.len()]);
        let mut face_of_patch = vec![u32::MAX; faces.patch_area_m2.len()];
        for (i, f) in faces.faces.iter().enumerate() {
            let of_patch = &mut face_of_patch[f.patch as usize];
            *of_patch = (*of_patch).min(i as u32);
            for j in 0..f.count {
                let at = |j: u32| ids[(f.first + j % f.count) as usize];
                let (a, b) = (at(j).min(at(j + 1)), at(j).max(at(j + 1)));
                edge_of[(f.first + j) as usize] = *edge_numbers.entry((a, b)).or_insert_with(|| {
                    edges.push([a, b]);
                    along.push(turn(vertices[b as usize] - vertices[a as usize]));
                    edges.len() as u32 - 1
                });
            }
        }
        Shared {
            exact: Clipper { faces, eps: 1e-12, lies_m: LIES_M, options, ends: None },
            corners: faces.corners.iter().map(|c| turn(*c - radar)).collect(),
            normals: faces.faces.iter().map(|f| turn(f.normal)).collect(),
            offsets: faces.faces.iter().map(|f| (f.offset_m - f.normal.dot(radar)) as f32).collect(),
            faces,
            options,
            axes,
            radar,
            edge_of,
            edges,
            along,
            vertices,
            face_of_patch,
        }
    }

    fn turned(&self, d: DVec3) -> Vec3 {
        DVec3::from(self.axes.map(|a| a.dot(d))).as_vec3()
    }

    fn view(&self, frame: Frame, chain: u32, parent: u32) -> View {
        let row = |a: DVec3| self.turned(a).extend(a.dot(self.radar - frame.origin) as f32);
        View {
            rows: [row(frame.u), row(frame.v), row(frame.k)],
            origin: self.turned(frame.origin - self.radar),
            frame,
            chain,
            parent,
        }
    }

    /// Where the corners of `face` lie against the plane of `plane`, of which `sign` 1 says that its front is lit.
    fn place(&self, face: u32, plane: u32, sign: f32, flat_m: f64) -> PlaneSide {
        let f = &self.faces.faces[face as usize];
        let (normal, offset) = (self.normals[plane as usize] * sign, self.offsets[plane as usize] * sign);
        let (mut below, mut above) = (true, true);
        for c in &self.corners[f.first as usize..(f.first + f.count) as usize] {
            let d = normal.dot(*c) - offset;
            let flat = flat_m as f32 + FLAT * (c.length() + offset.abs());
            below &= d <= flat;
            above &= d >= -flat;
        }
        match (below, above) {
            (true, _) => PlaneSide::Behind,
            (_, true) => PlaneSide::Before,
            _ => PlaneSide::Across,
        }
    }

    fn half_space(&self, face: u32, sign: f32, above_m: f64) -> HalfSpace {
        let (f, sign) = (&self.faces.faces[face as usize], f64::from(sign));
        HalfSpace { normal: f.normal * sign, offset: f.offset_m * sign + above_m - PAD * self.faces.radius_m }
    }
}

/// What of every face a window sees.
pub(super) struct Seen {
    pub polygons: Vec<Vec<Outline>>,
    pub whole: Vec<bool>,
}

/// Follows the beams of a radar that may stand amid the faces, as [`super::beams::clip_windows`] does, with decisions in f32. Where beams
/// end, and how they leave the target, it does not tell.
pub fn clip_windows(faces: &Faces, windows: &[Frame], options: &BeamOptions) -> Clipped {
    let Some(root) = windows.first() else { return Clipped::default() };
    let shared = Shared::new(faces, root, options);
    let n = faces.faces.len();
    let seen: Vec<Seen> = (0..windows.len() as u32)
        .map(|w| {
            let parts = in_chunks(n, |range| {
                let mut beams = Beams::new(&shared, windows);
                range.map(|f| beams.seen_from(w, f as u32)).collect::<Vec<_>>()
            });
            let (polygons, whole) = parts.into_iter().flatten().unzip();
            Seen { polygons, whole }
        })
        .collect();
    joined(in_chunks(n * windows.len(), |range| {
        let (mut beams, mut out) = (Beams::new(&shared, windows), Clipped::default());
        range.for_each(|i| beams.follow((i % n) as u32, (i / n) as u32, &seen, &mut out));
        out
    }))
}

/// Beams on their way, with the views that they look along.
pub(super) struct Beams<'a> {
    pub shared: &'a Shared<'a>,
    faces: &'a Faces,
    /// Those of the windows first.
    pub views: Vec<View>,
    windows: u32,
    /// By view and patch of the mirror.
    view_of: FastMap<(u32, u32), u32>,
    /// By chain and patch of one more mirror.
    chain_of: FastMap<(u32, u32), u32>,
    /// Where the radar's image by a chain stands; chain 0 is the radar.
    origins: Vec<DVec3>,
}

impl<'a> Beams<'a> {
    pub fn new(shared: &'a Shared<'a>, windows: &[Frame]) -> Beams<'a> {
        Beams {
            shared,
            faces: shared.faces,
            views: windows.iter().map(|w| shared.view(*w, 0, u32::MAX)).collect(),
            windows: windows.len() as u32,
            view_of: FastMap::default(),
            chain_of: FastMap::default(),
            origins: vec![shared.radar],
        }
    }

    pub fn face(&self, f: u32) -> &'a Face {
        &self.faces.faces[f as usize]
    }

    /// The view behind the mirror that a face is. Mirrors of one patch have one.
    pub fn mirrored(&mut self, view: u32, face: u32, normal: DVec3) -> u32 {
        let f = self.face(face);
        if let Some(known) = self.view_of.get(&(view, f.patch)) {
            return *known;
        }
        let frame = self.views[view as usize].frame.mirrored(normal, normal.dot(f.normal) * f.offset_m);
        let next = self.origins.len() as u32;
        let chain = *self.chain_of.entry((self.views[view as usize].chain, f.patch)).or_insert(next);
        if chain == next {
            self.origins.push(frame.origin);
        }
        self.views.push(self.shared.view(frame, chain, view));
        let new = self.views.len() as u32 - 1;
        self.view_of.insert((view, f.patch), new);
        new
    }

    fn along(&self, view: u32, d: Vec3) -> Vec3 {
        Vec3::from(self.views[view as usize].rows.map(|r| r.truncate().dot(d)))
    }

    fn there(&self, view: u32, place: Vec3) -> Vec3 {
        Vec3::from(self.views[view as usize].rows.map(|r| r.truncate().dot(place) + r.w))
    }

    pub fn facing(&self, view: u32, f: u32) -> f32 {
        self.shared.offsets[f as usize]
            - self.shared.normals[f as usize].dot(self.views[view as usize].origin)
    }

    /// Facing of the face, or None when it cannot be lit from there.
    fn lit(&self, view: u32, f: u32) -> Option<f32> {
        let facing = self.facing(view, f);
        let far = self.shared.offsets[f as usize].abs() + self.views[view as usize].origin.length();
        let grazing = 2.4e-7 * far + 1e-7;
        (facing.abs() > grazing && !(self.face(f).one_sided && facing > 0.0)).then_some(facing)
    }

    /// Sign of the area of a lit face in the coordinates of a view, which each mirror turns over.
    fn turn(&self, view: u32, facing: f32) -> f32 {
        let mirrors = std::iter::successors(Some(view), |v| {
            Some(self.views[*v as usize].parent).filter(|p| *p != u32::MAX)
        });
        let sign = -front(facing);
        if mirrors.count() % 2 == 0 { -sign } else { sign }
    }

    /// A face in the coordinates of a view, cut to its window, and whether that is all of it.
    fn start(&self, view: u32, f: u32) -> (Outline, bool) {
        let (face, chain) = (self.face(f), self.views[view as usize].chain);
        let n = face.count as usize;
        let corners = &self.shared.corners[face.first as usize..][..n];
        let places: Vec<Vec3> = corners.iter().map(|c| self.there(view, *c)).collect();
        if WALLS.iter().any(|w| places.iter().all(|p| w.dot(*p) < 0.0)) {
            return (Vec::new(), false);
        }
        let edge = |j: usize| LineId {
            of: Of::Edge { chain, edge: self.shared.edge_of[face.first as usize + j % n] },
            received: false,
        };
        let points = (0..n).map(|i| (places[i], [edge(i + n - 1), edge(i)], edge(i))).collect();
        within_window(points, |wall| LineId { of: Of::Wall { view, wall }, received: false })
    }

    /// The line of an edge from its side from `p` to `q`, with the inside where a polygon of such an area has it.
    fn edge_cutter(&self, view: u32, id: LineId, (edge, p, q): (u32, Vec2, Vec2), area: f32) -> Cutter {
        // The plane of view holds the ray at p and the edge's own direction.
        let m = p.extend(1.0).cross(self.along(view, self.shared.along[edge as usize]));
        let left = (q - p).perp() * area.signum();
        let normal = m.truncate() * if m.truncate().dot(left) < 0.0 { -1.0 } else { 1.0 };
        match normal.length() {
            l if l < 1e-12 => Cutter { at: p, normal: Vec2::ZERO, id, all: 1.0 },
            l => Cutter { at: p, normal: normal / l, id, all: 0.0 },
        }
    }

    /// The lines of the sides of a polygon, as seen along the views before `view`. Sides of a wall or a crossing shorter than `shortest`
    /// have no direction.
    fn cutters(&self, view: u32, polygon: &[Corner], received: bool, shortest: f32) -> Vec<Cutter> {
        let area = area(polygon);
        let mut lines = Vec::with_capacity(polygon.len() + 1);
        for (i, corner) in polygon.iter().enumerate() {
            let (p, q) = (corner.at, polygon[(i + 1) % polygon.len()].at);
            let id = LineId { received: received || corner.side.received, ..corner.side };
            match id.of {
                Of::Edge { edge, .. } if !received || p.distance(q) > shortest => {
                    let seen_in = if received { view } else { self.seen_in(id, view) };
                    lines.push(self.edge_cutter(seen_in, id, (edge, p, q), area));
                }
                Of::Edge { .. } => {}
                _ if p.distance(q) <= shortest => {}
                _ => {
                    let normal = ((q - p).perp() * area.signum()).normalize();
                    lines.push(Cutter { at: p, normal, id, all: 0.0 });
                }
            }
        }
        lines
    }

    /// The lines that bound a face in `polygon`; None when the two are apart.
    fn outline(&self, view: u32, f: u32, facing: f32, polygon: &[Corner]) -> Option<Vec<Cutter>> {
        let (p, _) = self.start(view, f);
        if p.len() < 3 {
            return None;
        }
        let (lo, hi) = bounds(&p);
        if are_apart((lo, hi), bounds(polygon)) || area(&p).abs() <= THIN * (hi - lo).length() {
            return None;
        }
        let turn = self.turn(view, facing);
        let mut lines = Vec::with_capacity(p.len() + 2);
        for (i, corner) in p.iter().enumerate() {
            let Of::Edge { edge, .. } = corner.side.of else { continue };
            let ends = (edge, corner.at, p[(i + 1) % p.len()].at);
            if !narrow(self.edge_cutter(view, corner.side, ends, turn), polygon, &mut lines) {
                return None;
            }
        }
        Some(lines)
    }

    /// Positive where plane `f` is nearer than plane `g`.
    fn crossing(&self, view: u32, f: u32, g: u32) -> Cutter {
        let nearness = |f: u32| self.along(view, self.shared.normals[f as usize]) / self.facing(view, f);
        let q = nearness(f) - nearness(g);
        let (a, b) = (self.face(f).patch, self.face(g).patch);
        let chain = self.views[view as usize].chain;
        let id = LineId { of: Of::Crossing { chain, patches: [a.min(b), a.max(b)] }, received: false };
        let across = q.truncate().length();
        if across <= PARALLEL * q.z.abs() {
            return Cutter {
                at: Vec2::ZERO,
                normal: Vec2::ZERO,
                id,
                all: if q.z >= 0.0 { 1.0 } else { -1.0 },
            };
        }
        let normal = q.truncate() / across;
        Cutter { at: normal * (-q.z / across), normal, id, all: 0.0 }
    }

    /// Half-spaces around the rays through `polygon`.
    fn prism(&self, view: u32, polygon: &[Corner]) -> [HalfSpace; 4] {
        let (lo, hi) = bounds(polygon);
        let pad = DVec2::splat(1e-6);
        Clipper::prism(&self.views[view as usize].frame, (lo.as_dvec2() - pad, hi.as_dvec2() + pad))
    }

    /// The part of `start`, a polygon on `target`, that is seen along the rays of a view that set out from `source`, a face and the sign
    /// of its lit side. True when something was cut away.
    fn unhidden(
        &self,
        view: u32,
        source: Option<(u32, f32)>,
        (target, facing): (u32, f32),
        start: &Outline,
    ) -> (Vec<Outline>, bool) {
        let (shared, sign) = (self.shared, front(facing));
        let flat_m = self.faces.flat_m;
        let mut pieces = vec![start.clone()];
        let least = SLIVER * area(start).abs();
        let [a, b, c, d] = self.prism(view, start);
        // What lies on the target may stand a little behind its plane.
        let near = shared.half_space(target, sign, -LIES_M);
        let source_space = source.map_or(near, |(f, s)| shared.half_space(f, s, 0.0));
        let from = self.views[view as usize].frame.origin;
        let (face, mut is_cut) = (self.face(target), false);
        self.faces.within_until(&[a, b, c, d, near, source_space], Some(from), |g| {
            if g == target {
                return false;
            }
            let other = self.face(g);
            let Some(other_facing) = self.lit(view, g) else { return false };
            if shared.exact.lies_on(face, other) {
                return false;
            }
            let crossing = match shared.place(g, target, sign, flat_m) {
                _ if shared.exact.lies_on(other, face) => None,
                PlaneSide::Behind => return false,
                PlaneSide::Before => None,
                PlaneSide::Across => match shared.place(target, g, front(other_facing), flat_m) {
                    PlaneSide::Before => return false,
                    PlaneSide::Behind => None,
                    PlaneSide::Across => Some(self.crossing(view, g, target)),
                },
            };
            let beyond = match source.map(|(f, s)| (f, shared.place(g, f, s, flat_m.max(LIES_M)))) {
                None | Some((_, PlaneSide::Before)) => None,
                Some((_, PlaneSide::Behind)) => return false,
                Some((f, PlaneSide::Across)) => Some(self.crossing(view, f, g)),
            };
            let Some(mut lines) = self.outline(view, g, other_facing, start) else { return false };
            if crossing.into_iter().chain(beyond).all(|l| narrow(l, start, &mut lines)) {
                is_cut |= subtract(&lines, least, &mut pieces);
            }
            pieces.is_empty()
        });
        (pieces, is_cut)
    }

    /// What of a face a window sees, and whether that is all of it.
    fn seen_from(&mut self, window: u32, f: u32) -> (Vec<Outline>, bool) {
        let Some(facing) = self.lit(window, f) else { return Default::default() };
        let (p, whole) = self.start(window, f);
        if p.len() < 3 || area(&p) == 0.0 {
            return Default::default();
        }
        let (pieces, is_cut) = self.unhidden(window, None, (f, facing), &p);
        let whole = whole && !is_cut && !pieces.is_empty();
        (pieces, whole)
    }

    /// The face `f` cut by the sides of a beam's polygon, and by the plane that the beam comes from.
    fn target(&self, view: u32, f: u32, polygon: &[Corner], beyond: Option<Cutter>) -> Option<Outline> {
        let (p, _) = self.start(view, f);
        if p.len() < 3 || are_apart(bounds(&p), bounds(polygon)) {
            return None;
        }
        let mut lines: Vec<Cutter> = beyond.into_iter().collect();
        lines.extend(self.cutters(view, polygon, false, EPS));
        cut_by(&p, &lines)
    }

    /// Follows what lights `first`, seen from a window, through its bounces.
    fn follow(&mut self, first: u32, window: u32, seen: &[Seen], out: &mut Clipped) {
        let pieces = &seen[window as usize].polygons[first as usize];
        if pieces.is_empty() {
            return;
        }
        let (faces, shared) = (self.faces, self.shared);
        let face = self.face(first);
        let sign = front(self.facing(window, first));
        let root = out.nodes.len() as u32;
        out.nodes.push(Node {
            parent: u32::MAX,
            face: first,
            bounce: 1,
            imaged: false,
            endless: false,
            frame: self.views[window as usize].frame,
            normal: face.normal * f64::from(sign),
        });
        let mut stack: Vec<(u32, u32, f32, Outline)> =
            pieces.iter().rev().map(|p| (root, window, sign, p.clone())).collect();
        while let Some((index, view, sign, polygon)) = stack.pop() {
            let node = out.nodes[index as usize];
            self.radiate((index, &node), (view, sign), &polygon, node.bounce == 1, seen, &mut out.every);
            if node.imaged && faces.mirrors(face.patch, self.face(node.face).patch) {
                self.radiate((index, &node), (view, sign), &polygon, true, seen, &mut out.imaged);
            }
            let begins = shared.options.images && node.bounce == 1 && faces.mirrors_points(face.patch);
            if node.bounce as usize >= shared.exact.most(node.endless || begins) {
                continue;
            }
            let ahead = self.mirrored(view, node.face, node.normal);
            let source = (node.face, sign);
            let [a, b, c, d] = self.prism(ahead, &polygon);
            let mut targets = Vec::new();
            faces.within(&[a, b, c, d, shared.half_space(source.0, source.1, 0.0)], |f| {
                let Some(facing) = self.lit(ahead, f) else { return };
                let beyond = match shared.place(f, source.0, source.1, faces.flat_m.max(LIES_M)) {
                    PlaneSide::Behind => return,
                    PlaneSide::Before => None,
                    PlaneSide::Across => Some(self.crossing(ahead, source.0, f)),
                };
                let target = self.target(ahead, f, &polygon, beyond);
                targets.extend(target.filter(|p| area(p).abs() > SLIVER * SLIVER).map(|p| (f, facing, p)));
            });
            let mark = stack.len();
            for (f, facing, p) in targets {
                let patch = self.face(f).patch;
                let imaged = node.imaged || begins && faces.mirrors(face.patch, patch);
                let endless = node.endless || begins && faces.is_endless(face.patch, patch);
                if node.bounce as usize >= shared.exact.most(endless) {
                    continue;
                }
                let (parts, _) = self.unhidden(ahead, Some(source), (f, facing), &p);
                if parts.is_empty() {
                    continue;
                }
                let child = out.nodes.len() as u32;
                out.nodes.push(Node {
                    parent: index,
                    face: f,
                    bounce: node.bounce + 1,
                    imaged,
                    endless,
                    frame: self.views[ahead as usize].frame,
                    normal: self.face(f).normal * f64::from(front(facing)),
                });
                stack.extend(parts.into_iter().map(|p| (child, ahead, front(facing), p)));
            }
            stack[mark..].reverse();
        }
    }

    /// Keeps the part of a lit polygon that the radar sees, its corners worked out from their lines.
    pub fn radiate(
        &self,
        (index, node): (u32, &Node),
        (view, sign): (u32, f32),
        polygon: &Outline,
        is_seen: bool,
        seen: &[Seen],
        out: &mut Vec<Piece>,
    ) {
        let f = node.face;
        if is_seen {
            return self.emit(index, (view, view), f, polygon, out);
        }
        // The radar has to stand on the lit side.
        if -self.shared.offsets[f as usize] * sign <= 0.0 {
            return;
        }
        if seen.iter().any(|s| s.whole[f as usize]) {
            return self.emit(index, (view, view), f, polygon, out);
        }
        let face = self.face(f);
        let corner = self.faces.corners[face.first as usize];
        // Exact corners, then as the radar itself sees them.
        let there: Vec<Vec3> = polygon
            .iter()
            .map(|v| {
                let p = self.place(v, (view, view), face);
                self.shared.turned(corner + face.axis[0] * p.x + face.axis[1] * p.y - self.shared.radar)
            })
            .collect();
        for window in 0..self.windows {
            let parts = &seen[window as usize].polygons[f as usize];
            if parts.is_empty() {
                continue;
            }
            let points =
                there.iter().zip(polygon).map(|(x, v)| (self.there(window, *x), v.on, v.side)).collect();
            let wall = |wall| LineId { of: Of::Wall { view: window, wall }, received: true };
            let (mine, _) = within_window(points, wall);
            if mine.len() < 3 {
                continue;
            }
            let (least, around) = (SLIVER * area(&mine).abs(), bounds(&mine));
            for part in parts.iter().filter(|p| !are_apart(bounds(p), around)) {
                let lines = self.cutters(window, part, true, 2.0 * EPS);
                if let Some(both) = cut_by(&mine, &lines).filter(|p| area(p).abs() > least) {
                    self.emit(index, (view, window), f, &both, out);
                }
            }
        }
    }

    /// Lists a piece of `f`, lit along one view and given in the coordinates of another. A corner that lies on the horizon leaves it out.
    fn emit(&self, node: u32, views: (u32, u32), f: u32, outline: &Outline, out: &mut Vec<Piece>) {
        let face = self.face(f);
        let corners: Vec<DVec2> = outline.iter().map(|v| self.place(v, views, face)).collect();
        if corners.iter().all(|p| p.length() < FARTHEST_M) {
            out.extend(Polygon::of(&corners).into_iter().map(|polygon| Piece { node, polygon }));
        }
    }

    /// The view among `view` and those before it in which a line was seen.
    fn seen_in(&self, id: LineId, view: u32) -> u32 {
        let is_here = |v: &u32| match id.of {
            Of::Wall { view, .. } | Of::Halving { view, .. } => *v == view,
            Of::Edge { chain, .. } | Of::Crossing { chain, .. } => self.views[*v as usize].chain == chain,
        };
        let before = |v: &u32| Some(self.views[*v as usize].parent).filter(|p| *p != u32::MAX);
        std::iter::successors(Some(view), before).find(is_here).unwrap_or(view)
    }

    /// A direction seen along one view, after the mirrors that lead on to another.
    fn carried(&self, d: DVec3, from: u32, to: u32) -> DVec3 {
        let (then, now) = (&self.views[from as usize].frame, &self.views[to as usize].frame);
        now.u * d.dot(then.u) + now.v * d.dot(then.v) + now.k * d.dot(then.k)
    }

    /// The plane of view of a line, as a normal and a place on it, for what is lit along `view`.
    fn plane(&self, id: LineId, view: u32) -> (DVec3, DVec3) {
        let (normal, origin) = match id.of {
            Of::Edge { chain, edge } => {
                let o = self.origins[chain as usize];
                let [a, b] = self.shared.edges[edge as usize].map(|v| self.shared.vertices[v as usize]);
                ((a - o).cross(b - a), o)
            }
            Of::Crossing { chain, patches } => {
                let o = self.origins[chain as usize];
                let [p, q] = patches.map(|p| {
                    let f = self.face(self.shared.face_of_patch[p as usize]);
                    f.normal / (f.offset_m - f.normal.dot(o))
                });
                (p - q, o)
            }
            Of::Wall { view, wall } => {
                let (f, w) = (&self.views[view as usize].frame, WALLS[wall as usize].as_dvec3());
                (f.u * w.x + f.v * w.y + f.k * w.z, f.origin)
            }
            Of::Halving { view, axis, bits } => {
                let f = &self.views[view as usize].frame;
                let along = if axis == 0 { f.u } else { f.v };
                (along - f.k * f64::from(f32::from_bits(bits)), f.origin)
            }
        };
        if id.received {
            return (normal, origin);
        }
        match self.seen_in(id, view) {
            seen if seen == view => (normal, origin),
            seen => (self.carried(normal, seen, view), self.views[view as usize].frame.origin),
        }
    }

    /// The vertex that two edges of one view share, as a ray for what is lit along `view`: where it sets out, and its direction.
    fn vertex(&self, [k, l]: [LineId; 2], view: u32) -> Option<(DVec3, DVec3)> {
        let (Of::Edge { chain, edge: e }, Of::Edge { chain: of_other, edge: f }) = (k.of, l.of) else {
            return None;
        };
        if chain != of_other || k.received != l.received || e == f {
            return None;
        }
        let [first, second] = [e, f].map(|e| self.shared.edges[e as usize]);
        let shared = first.into_iter().find(|v| second.contains(v))?;
        let origin = self.origins[chain as usize];
        let d = self.shared.vertices[shared as usize] - origin;
        let seen = if k.received { view } else { self.seen_in(k, view) };
        match seen == view || k.received {
            true => Some((origin, d)),
            false => Some((self.views[view as usize].frame.origin, self.carried(d, seen, view))),
        }
    }

    /// The place of a corner on a face, along the face's axes, m: lit along the first view, with coordinates in the second.
    fn place(&self, v: &Corner, (lit, told): (u32, u32), face: &Face) -> DVec2 {
        let corner = self.faces.corners[face.first as usize];
        let frame = &self.views[told as usize].frame;
        let on_face = |p: DVec3| DVec2::new(face.axis[0].dot(p - corner), face.axis[1].dot(p - corner));
        let by_vertex = || {
            let (o, d) = self.vertex(v.on, lit)?;
            Some(o + d * ((face.offset_m - face.normal.dot(o)) / face.normal.dot(d)))
        };
        let by_lines = || {
            // Each plane of view cuts the face in a line: a x + b y + c = 0.
            let row = |id: LineId| {
                let (m, o) = self.plane(id, lit);
                let r = DVec3::new(m.dot(face.axis[0]), m.dot(face.axis[1]), m.dot(corner - o));
                let l = r.truncate().length();
                (l > 0.0).then(|| r / l)
            };
            let (r, s) = (row(v.on[0])?, row(v.on[1])?);
            let det = r.x * s.y - r.y * s.x;
            let (x, y) = ((r.y * s.z - s.y * r.z) / det, (s.x * r.z - r.x * s.z) / det);
            (det.abs() > 1e-14).then(|| corner + face.axis[0] * x + face.axis[1] * y)
        };
        let is_near = |p: &DVec3| {
            frame.k.dot(*p - frame.origin) > 0.0 && frame.project(*p).distance(v.at.as_dvec2()) <= ASTRAY
        };
        match by_vertex().or_else(by_lines).filter(is_near) {
            Some(p) => on_face(p),
            None => on_face(frame.lift(v.at.as_dvec2(), frame.nearness(face.normal, face.offset_m))),
        }
    }
}
