//! Beams that pass through bodies of dielectric and free-standing sheets, in f64 (CONVENTIONS eq. 70-75).
//! Plane waves only: at a flat interface they stay plane.
//!
//! From the transmitter beams go on by reflection and by transmission; from the receiver by transmission
//! alone. What a reflecting face radiates reaches the receiver along those.

use super::beams::{
    Clipper, GRAZING, PlaneSide, Polygon, Remainder, SLIVER, Scratch, Side, cut_by, in_chunks, overlap,
};
use crate::em::layers::Backing;
use crate::geom::Surface;
use crate::geom::cells::NO_CELL;
use crate::geom::dielectrics::OPAQUE_NP;
use crate::geom::faces::{Face, Faces, HalfSpace};
use crate::trace::beams::{BeamOptions, Frame, Port};
use glam::{DVec2, DVec3};
use num_complex::Complex64;
use std::collections::HashMap;

/// Faces that a wave may pass one after the other without a reflection.
const MOST_PASSED: u8 = 64;
/// Beams inside a body that meet none of its faces, as a share of its surface, from which it counts as open.
const LEAK: f64 = 1e-6;

/// What a wave is in: air, or the dielectric of a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Medium {
    /// Real part of the refractive index.
    pub index: f64,
    /// Decay of the amplitude, Np/m.
    pub decay_np_per_m: f64,
}

const AIR: Medium = Medium { index: 1.0, decay_np_per_m: 0.0 };

/// What waves of one frequency pass through. Beams of two frequencies with equal media run alike.
#[derive(Debug, Clone, PartialEq)]
pub struct Media {
    cells: Vec<Option<Medium>>,
    /// Whether each surface is a sheet.
    sheets: Vec<bool>,
}

/// What a face is to a wave.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Nothing passes.
    Opaque,
    /// The boundary of a body that is entered.
    Border,
    /// A thin sheet that waves pass in line.
    Sheet,
}

/// Refractive index n - j kappa of a dielectric, the root that decays.
pub fn refractive_index(eps_r: Complex64) -> Complex64 {
    let n = eps_r.sqrt();
    if n.re < 0.0 { -n } else { n }
}

/// Permittivity of what fills a cell; 1 for air.
pub fn permittivity(faces: &Faces, surfaces: &[Surface], cell: u32) -> Complex64 {
    let surface = faces.cells.get(cell as usize).and_then(|c| surfaces.get(c.surface as usize));
    match surface.map(|s| s.stack.backing) {
        Some(Backing::HalfSpace(eps)) => eps,
        _ => Complex64::ONE,
    }
}

impl Media {
    /// The media that waves pass through; None when everything is opaque.
    pub fn of(faces: &Faces, surfaces: &[Surface], wavenumber: f64) -> Option<Media> {
        let mut sheets: Vec<bool> = surfaces.iter().map(|s| s.stack.backing == Backing::Air).collect();
        if faces.cells.is_empty() && !sheets.contains(&true) {
            return None;
        }
        let cells: Vec<Option<Medium>> = (0..faces.cells.len())
            .map(|c| {
                let n = refractive_index(permittivity(faces, surfaces, c as u32));
                let decay_np_per_m = -wavenumber * n.im;
                (decay_np_per_m * faces.cells[c].mean_chord_m() < OPAQUE_NP)
                    .then_some(Medium { index: n.re, decay_np_per_m })
            })
            .collect();
        let mut used = vec![false; sheets.len()];
        faces.faces.iter().for_each(|f| used[f.surface as usize] = true);
        sheets.iter_mut().zip(&used).for_each(|(s, used)| *s &= used);
        (cells.iter().any(Option::is_some) || sheets.contains(&true)).then_some(Media { cells, sheets })
    }

    /// What a face is to a wave.
    pub fn kind(&self, face: &Face) -> Kind {
        if self.cells.get(face.cell as usize).is_some_and(Option::is_some) {
            Kind::Border
        } else if self.sheets[face.surface as usize] {
            Kind::Sheet
        } else {
            Kind::Opaque
        }
    }

    /// Whether waves pass through a face.
    pub fn passes(&self, face: &Face) -> bool {
        self.kind(face) != Kind::Opaque
    }

    fn medium(&self, cell: u32) -> Medium {
        self.cells.get(cell as usize).copied().flatten().unwrap_or(AIR)
    }
}

/// What a plane wave has lost on its way to a place r, Np: at_origin + gradient . r.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Decay {
    /// Its gradient, Np/m.
    pub gradient: DVec3,
    /// Its value at the origin, Np.
    pub at_origin: f64,
}

impl Decay {
    /// The decay at a place, Np.
    pub fn at(&self, r: DVec3) -> f64 {
        self.at_origin + self.gradient.dot(r)
    }
}

/// A plane wave in a medium.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wave {
    /// Frame of the wave; its `lead_m` is an optical length.
    pub frame: Frame,
    /// [`NO_CELL`] is air.
    pub cell: u32,
    /// Refractive index of the medium.
    pub index: f64,
    /// What the wave has lost.
    pub decay: Decay,
}

impl Wave {
    fn in_air(frame: Frame) -> Wave {
        Wave { frame, cell: NO_CELL, index: 1.0, decay: Decay::default() }
    }

    /// Optical length of the way to a place.
    pub fn length_m(&self, p: DVec3) -> f64 {
        self.frame.lead_m + self.index * self.frame.k.dot(p - self.frame.origin)
    }

    fn mirrored(&self, side: &Side) -> Wave {
        let Decay { gradient: g, at_origin } = self.decay;
        let along = 2.0 * g.dot(side.normal);
        Wave {
            frame: self.frame.mirrored(side.normal, side.offset),
            decay: Decay { gradient: g - side.normal * along, at_origin: at_origin + along * side.offset },
            ..*self
        }
    }

    /// Refracted by the plane of `side`, on which it arrives, into `medium`; None when it is reflected totally.
    fn refracted(&self, side: &Side, cell: u32, medium: Medium) -> Option<Wave> {
        let ratio = self.index / medium.index;
        let cos = -side.normal.dot(self.frame.k);
        let cos2 = 1.0 - ratio * ratio * (1.0 - cos * cos);
        if cos2 < 1e-12 {
            return None;
        }
        let k = (self.frame.k * ratio + side.normal * (ratio * cos - cos2.sqrt())).normalize();
        let origin = self.frame.lift(DVec2::ZERO, self.frame.nearness(side.normal, side.offset));
        let (u, v) = k.any_orthonormal_pair();
        // Along the new rays what was lost before stays as it was on the plane.
        let extra = (medium.decay_np_per_m - self.decay.gradient.dot(k)) / side.normal.dot(k);
        Some(Wave {
            frame: Frame { origin, u, v, k, from_point: false, lead_m: self.length_m(origin) },
            cell,
            index: medium.index,
            decay: Decay {
                gradient: self.decay.gradient + side.normal * extra,
                at_origin: self.decay.at_origin - extra * side.offset,
            },
        })
    }
}

/// A wave that arrives on a face.
#[derive(Debug, Clone, Copy)]
pub struct Node {
    /// u32::MAX for the wave from the transmitter.
    pub parent: u32,
    /// Whether it is what the parent's face let through, not what that reflected.
    pub through: bool,
    /// Index of the face.
    pub face: u32,
    /// Number of reflections before the wave arrives here.
    pub reflections: u8,
    /// Faces passed since the last reflection.
    passed: u8,
    /// The parent's wave as it would have gone on without the body, at the end of its way through it.
    pub straight: bool,
    /// The wave as it arrives.
    pub wave: Wave,
    /// Unit normal on the side on which it arrives.
    pub normal: DVec3,
}

/// A wave on its way from the receiver, against which its face radiates.
#[derive(Debug, Clone, Copy)]
pub struct View {
    /// u32::MAX for the first, the receiver's plane wave in air.
    pub parent: u32,
    /// The face that the parent passed, and its normal on the parent's side.
    pub face: u32,
    /// Normal of the face, towards the receiver.
    pub normal: DVec3,
    passed: u8,
    /// The wave from the receiver.
    pub wave: Wave,
}

/// A polygon that radiates, along the face's axes.
#[derive(Debug, Clone, Copy)]
pub struct Piece {
    /// Index of the node that it belongs to.
    pub node: u32,
    /// Index of the view that it radiates against.
    pub view: u32,
    /// The polygon in the face's coordinates, m.
    pub polygon: Polygon,
}

/// All that the beams of one look meet.
#[derive(Debug, Clone, Default)]
pub struct Clipped {
    /// Waves that arrive on faces.
    pub nodes: Vec<Node>,
    /// Waves from the receiver.
    pub views: Vec<View>,
    /// Pieces of every bounce.
    pub every: Vec<Piece>,
    /// Pieces from which the reflected wave leaves the target, through what it may pass, alone.
    pub last: Vec<Piece>,
    /// Faces met by a wave that was not reflected yet, which radiate forwards.
    pub forward: Vec<Piece>,
    /// A body is open, or bodies touch: the sum would be wrong.
    pub broken: bool,
}

struct Tracer<'a> {
    clipper: Clipper<'a>,
    faces: &'a Faces,
    media: &'a Media,
}

/// What the receiver sees: polygons of each face in the frames of the views.
struct VisibleFaces {
    views: Vec<View>,
    of: Vec<Vec<(u32, Polygon)>>,
}

/// What a wave that leaves a face meets.
#[derive(Default)]
struct Ahead {
    /// Face, facing, what of it is lit.
    met: Vec<(u32, f64, Vec<Polygon>)>,
    exits: Remainder,
}

/// Follows plane waves from `transmit` and keeps what radiates to `receive`, both unit vectors towards the
/// stations.
pub fn clip(faces: &Faces, media: &Media, transmit: DVec3, receive: DVec3, options: &BeamOptions) -> Clipped {
    let clipper =
        Clipper { faces, eps: 1e-12 * faces.radius_m, lies_m: 0.0, options, ends: None, later: false };
    let tracer = Tracer { clipper, faces, media };
    let frame = |towards| Frame::new(Port::Far(towards), faces.centre_m);
    let (lit, mut broken) = tracer.seen_from(frame(transmit));
    let from_receiver = match transmit == receive {
        true => lit.clone(),
        false => {
            let (seen, bad) = tracer.seen_from(frame(receive));
            broken |= bad;
            seen
        }
    };
    let (seen, bad) = tracer.views(frame(receive), from_receiver);
    broken |= bad;
    let wave = Wave::in_air(frame(transmit));
    let parts = in_chunks(faces.faces.len(), |range| {
        let mut out = Clipped::default();
        for f in range {
            tracer.follow(f as u32, &wave, &lit[f], &seen, receive, &mut out);
        }
        out
    });
    let mut all = Clipped { views: seen.views, broken, ..Default::default() };
    for part in parts {
        let base = all.nodes.len() as u32;
        all.nodes.extend(part.nodes.into_iter().map(|mut n| {
            if n.parent != u32::MAX {
                n.parent += base;
            }
            n
        }));
        let moved = |p: Piece| Piece { node: p.node + base, ..p };
        all.every.extend(part.every.into_iter().map(moved));
        all.last.extend(part.last.into_iter().map(moved));
        all.forward.extend(part.forward.into_iter().map(moved));
        all.broken |= part.broken;
    }
    all
}

fn area(polygons: &[Polygon]) -> f64 {
    polygons.iter().map(|p| p.area().abs()).sum()
}

impl Tracer<'_> {
    /// Facing of a face that a wave in `cell` may meet.
    #[inline]
    fn lit(&self, frame: &Frame, cell: u32, face: &Face) -> Option<f64> {
        let facing = frame.facing(face.normal, face.offset_m);
        let side = match self.media.kind(face) {
            // The metal that closes a body may look either way.
            Kind::Opaque => cell != NO_CELL || !(face.one_sided && facing > 0.0),
            Kind::Sheet => true,
            // From outside, or, in a body, from inside through its own.
            Kind::Border => (facing > 0.0) == (cell == face.cell),
        };
        (facing.abs() > GRAZING && side).then_some(facing)
    }

    /// What of `start`, a polygon on `target`, is met first by a wave that sets out from `source`; where
    /// an opaque face lies in a transparent one, the opaque one is met.
    fn visible_part(
        &self,
        wave: &Wave,
        source: Option<&Side>,
        target: u32,
        facing: f64,
        start: Polygon,
        broken: &mut bool,
    ) -> Vec<Polygon> {
        let (c, frame) = (&self.clipper, &wave.frame);
        let mut seen = Vec::new();
        let least = SLIVER * start.area().abs();
        let mut scratch = Scratch::new();
        let lit = |f: &Face| self.lit(frame, wave.cell, f);
        c.visible_past(lit, frame, source, target, facing, &start, &mut seen, &mut scratch);
        let face = &self.faces.faces[target as usize];
        if seen.is_empty() || self.media.kind(face) == Kind::Opaque {
            return seen;
        }
        let mut pieces = Remainder::left(&start, seen);
        // A sheet is one in air, and another body's border is met in air.
        let kind = self.media.kind(face);
        *broken |= wave.cell != NO_CELL && (kind == Kind::Sheet || face.cell != wave.cell);
        let flat = self.faces.flat_m;
        let [a, b, d, e] = Clipper::prism(frame, start.bounds());
        let above = HalfSpace { normal: face.normal, offset: face.offset_m - flat };
        let below = HalfSpace { normal: -face.normal, offset: -face.offset_m - flat };
        self.faces.within(&[a, b, d, e, above, below], |g| {
            let other = &self.faces.faces[g as usize];
            let in_plane = |p: &DVec3| (face.normal.dot(*p) - face.offset_m).abs() <= flat;
            if g == target || !self.faces.corners(other).iter().all(in_plane) {
                return;
            }
            let facing = frame.facing(other.normal, other.offset_m);
            let Some(lines) = c.outline(frame, other, facing, &start) else { return };
            if self.media.kind(other) == Kind::Opaque {
                c.subtract(&lines, least, &mut pieces, &mut scratch);
            } else {
                let shared: f64 = pieces
                    .polygons
                    .iter()
                    .filter_map(|p| {
                        cut_by(p, lines.all(), c.eps, &mut scratch.halves).map(|q| q.area().abs())
                    })
                    .sum();
                *broken |= shared > LEAK * start.area().abs();
            }
        });
        pieces.polygons
    }

    /// What of each face is seen along the rays of `frame` in air.
    fn seen_from(&self, frame: Frame) -> (Vec<Vec<Polygon>>, bool) {
        let wave = Wave::in_air(frame);
        let parts = in_chunks(self.faces.faces.len(), |range| {
            let mut broken = false;
            let seen: Vec<Vec<Polygon>> = range
                .map(|f| {
                    let face = &self.faces.faces[f];
                    let Some(facing) = self.lit(&frame, NO_CELL, face) else { return Vec::new() };
                    let mut p = Polygon::EMPTY;
                    self.faces.corners(face).iter().for_each(|c| p.push(frame.project(*c)));
                    self.visible_part(&wave, None, f as u32, facing, p, &mut broken)
                })
                .collect();
            (seen, broken)
        });
        let broken = parts.iter().any(|p| p.1);
        (parts.into_iter().flat_map(|p| p.0).collect(), broken)
    }

    /// All that the receiver sees, through what waves pass.
    fn views(&self, frame: Frame, first: Vec<Vec<Polygon>>) -> (VisibleFaces, bool) {
        let root = View {
            parent: u32::MAX,
            face: u32::MAX,
            normal: DVec3::ZERO,
            passed: 0,
            wave: Wave::in_air(frame),
        };
        let mut seen = VisibleFaces { views: vec![root], of: vec![Vec::new(); first.len()] };
        let mut broken = false;
        let mut stack: Vec<(u32, u32, Polygon)> = Vec::new();
        for (f, polygons) in first.into_iter().enumerate() {
            let passes = self.media.kind(&self.faces.faces[f]) != Kind::Opaque;
            for p in polygons {
                seen.of[f].push((0, p));
                if passes {
                    stack.push((0, f as u32, p));
                }
            }
        }
        let mut known: HashMap<(u32, u32), u32> = HashMap::new();
        while let Some((view, f, polygon)) = stack.pop() {
            let v = seen.views[view as usize];
            let face = &self.faces.faces[f as usize];
            let side = Side::of(face, v.wave.frame.facing(face.normal, face.offset_m));
            let Some((wave, mapped)) = self.through(&v.wave, &side, face, &polygon) else { continue };
            if v.passed == MOST_PASSED {
                broken = true;
                continue;
            }
            let index = *known.entry((view, f)).or_insert_with(|| {
                let passed = v.passed + 1;
                seen.views.push(View { parent: view, face: f, normal: side.normal, passed, wave });
                seen.views.len() as u32 - 1
            });
            let behind = side.opposite();
            let ahead = self.ahead(&wave, &behind, &mapped, &mut broken);
            for (g, _, parts) in ahead.met {
                let passes = self.media.kind(&self.faces.faces[g as usize]) != Kind::Opaque;
                for p in parts {
                    seen.of[g as usize].push((index, p));
                    if passes {
                        stack.push((index, g, p));
                    }
                }
            }
        }
        (seen, broken)
    }

    /// The wave behind a face on which `wave` arrives, and a polygon of it in the new frame. None when
    /// nothing passes.
    fn through(&self, wave: &Wave, side: &Side, face: &Face, polygon: &Polygon) -> Option<(Wave, Polygon)> {
        match self.media.kind(face) {
            Kind::Opaque => None,
            Kind::Sheet => Some((*wave, *polygon)),
            Kind::Border => {
                let cell = if wave.cell == NO_CELL { face.cell } else { NO_CELL };
                let new = wave.refracted(side, cell, self.media.medium(cell))?;
                let nearness = wave.frame.nearness(side.normal, side.offset);
                Some((new, polygon.mapped(|uv| new.frame.project(wave.frame.lift(uv, nearness)))))
            }
        }
    }

    /// What `polygon` of a wave meets beyond `source`, and what of it meets nothing.
    fn ahead(&self, wave: &Wave, source: &Side, polygon: &Polygon, broken: &mut bool) -> Ahead {
        let (c, frame) = (&self.clipper, &wave.frame);
        let mut out = Ahead { exits: Remainder::of(polygon), ..Default::default() };
        let least = SLIVER * polygon.area().abs();
        let [a, b, d, e] = Clipper::prism(frame, polygon.bounds());
        let space = HalfSpace { normal: source.normal, offset: source.offset + self.faces.flat_m };
        let (mut targets, mut scratch) = (Vec::new(), Scratch::new());
        self.faces.within(&[a, b, d, e, space], |f| {
            let target = &self.faces.faces[f as usize];
            let Some(facing) = self.lit(frame, wave.cell, target) else { return };
            let beyond = match c.ahead(target, source) {
                PlaneSide::Behind => return,
                PlaneSide::Before => None,
                PlaneSide::Across => Some(c.beyond(frame, source, target)),
            };
            let Some(mut lines) = c.outline(frame, target, facing, polygon) else { return };
            if !beyond.into_iter().all(|l| lines.narrow(l, polygon, c.eps)) {
                return;
            }
            let Some(p) = cut_by(polygon, lines.all(), c.eps, &mut scratch.halves).copied() else { return };
            if p.area().abs() <= least {
                return;
            }
            c.subtract(&lines, least, &mut out.exits, &mut scratch);
            targets.push((f, facing, p));
        });
        for (f, facing, p) in targets {
            let parts = self.visible_part(wave, Some(source), f, facing, p, broken);
            if !parts.is_empty() {
                out.met.push((f, facing, parts));
            }
        }
        if let Some(cell) = self.faces.cells.get(wave.cell as usize) {
            *broken |= area(&out.exits.polygons) > LEAK * cell.area_m2;
            out.exits.clear();
        }
        out
    }

    /// Follows what lights `first` through all that comes of it.
    fn follow(
        &self,
        first: u32,
        wave: &Wave,
        lit: &[Polygon],
        seen: &VisibleFaces,
        receive: DVec3,
        out: &mut Clipped,
    ) {
        if lit.is_empty() {
            return;
        }
        let options = self.clipper.options;
        let face = &self.faces.faces[first as usize];
        let normal = Side::of(face, wave.frame.facing(face.normal, face.offset_m)).normal;
        let root = out.nodes.len() as u32;
        out.nodes.push(Node {
            parent: u32::MAX,
            through: false,
            face: first,
            reflections: 0,
            passed: 0,
            straight: false,
            wave: *wave,
            normal,
        });
        let mut stack: Vec<(u32, Polygon)> = lit.iter().rev().map(|p| (root, *p)).collect();
        while let Some((index, polygon)) = stack.pop() {
            let node = out.nodes[index as usize];
            let face = &self.faces.faces[node.face as usize];
            let side = Side::facing(face, node.normal);
            let kind = self.media.kind(face);
            let inside = node.wave.cell != NO_CELL;
            let behind = side.opposite();
            let forwards = node.reflections == 0 && kind != Kind::Opaque && (inside || kind == Kind::Sheet);
            if forwards && node.normal.dot(receive) < 0.0 {
                let polygon = self.on_face(&node, &polygon);
                out.forward.push(Piece { node: index, view: 0, polygon });
            }
            if node.straight {
                continue;
            }
            let before_last = (node.reflections as usize) < options.bounces;
            if before_last {
                self.radiate(index, &node, &polygon, seen, &mut out.every);
            }
            if node.reflections == 0 && kind == Kind::Border && !inside {
                // What leaves a body radiates less what would be there without it.
                let wave = Wave { cell: face.cell, ..node.wave };
                for (f, _, parts) in self.ahead(&wave, &behind, &polygon, &mut out.broken).met {
                    let end = &self.faces.faces[f as usize];
                    if self.media.kind(end) != Kind::Border {
                        continue;
                    }
                    let child = out.nodes.len() as u32;
                    let normal = -end.normal;
                    out.nodes.push(Node { parent: index, face: f, straight: true, wave, normal, ..node });
                    stack.extend(parts.into_iter().map(|p| (child, p)));
                }
            }
            let mark = stack.len();
            let mut go_on = |through: bool, wave: Wave, source: Side, polygon: Polygon| {
                let ahead = self.ahead(&wave, &source, &polygon, &mut out.broken);
                if options.last {
                    for p in &ahead.exits.polygons {
                        if let Some((node, p)) = self.last_reflection(&out.nodes, index, through, &wave, *p) {
                            self.radiate(node, &out.nodes[node as usize], &p, seen, &mut out.last);
                        }
                    }
                }
                if through && node.passed == MOST_PASSED {
                    out.broken |= !ahead.met.is_empty();
                    return;
                }
                for (f, facing, parts) in ahead.met {
                    let child = out.nodes.len() as u32;
                    out.nodes.push(Node {
                        parent: index,
                        through,
                        face: f,
                        reflections: node.reflections + !through as u8,
                        passed: if through { node.passed + 1 } else { 0 },
                        straight: false,
                        wave,
                        normal: Side::of(&self.faces.faces[f as usize], facing).normal,
                    });
                    stack.extend(parts.into_iter().map(|p| (child, p)));
                }
            };
            // Beyond the last reflection that counts only the way out is left to be found.
            if before_last && (node.reflections as usize + 1 < options.bounces || options.last) {
                go_on(false, node.wave.mirrored(&side), side, polygon);
            }
            if (before_last || options.last)
                && let Some((wave, mapped)) = self.through(&node.wave, &side, face, &polygon)
            {
                go_on(true, wave, behind, mapped);
            }
            stack[mark..].reverse();
        }
    }

    /// Back from a polygon of the wave that left node `index` to the last reflection before it: its node, and
    /// the polygon there. None when there was none.
    fn last_reflection(
        &self,
        nodes: &[Node],
        mut index: u32,
        mut through: bool,
        wave: &Wave,
        mut polygon: Polygon,
    ) -> Option<(u32, Polygon)> {
        let mut after = wave;
        loop {
            let node = &nodes[index as usize];
            if !through {
                return Some((index, polygon));
            }
            let face = &self.faces.faces[node.face as usize];
            let nearness = after.frame.nearness(face.normal, face.offset_m);
            polygon = polygon.mapped(|uv| node.wave.frame.project(after.frame.lift(uv, nearness)));
            if node.parent == u32::MAX {
                return None;
            }
            (index, through, after) = (node.parent, node.through, &node.wave);
        }
    }

    /// Along the face's axes.
    fn on_face(&self, node: &Node, polygon: &Polygon) -> Polygon {
        let face = &self.faces.faces[node.face as usize];
        let nearness = node.wave.frame.nearness(face.normal, face.offset_m);
        polygon.mapped(|uv| self.along_axes(face, node.wave.frame.lift(uv, nearness)))
    }

    fn along_axes(&self, face: &Face, p: DVec3) -> DVec2 {
        let d = p - self.faces.corners[face.first as usize];
        DVec2::new(face.axis[0].dot(d), face.axis[1].dot(d))
    }

    /// Keeps what the receiver sees of a polygon, from the side and the medium in which the wave arrives.
    fn radiate(&self, index: u32, node: &Node, polygon: &Polygon, seen: &VisibleFaces, out: &mut Vec<Piece>) {
        let face = &self.faces.faces[node.face as usize];
        let nearness = node.wave.frame.nearness(face.normal, face.offset_m);
        for (v, part) in &seen.of[node.face as usize] {
            let view = &seen.views[*v as usize].wave;
            if view.cell != node.wave.cell || view.frame.k.dot(node.normal) >= 0.0 {
                continue;
            }
            let there = polygon.mapped(|uv| view.frame.project(node.wave.frame.lift(uv, nearness)));
            let both = overlap(there, part, self.clipper.eps);
            if both.area().abs() > SLIVER * there.area().abs() {
                let back = view.frame.nearness(face.normal, face.offset_m);
                let polygon = both.mapped(|uv| self.along_axes(face, view.frame.lift(uv, back)));
                out.push(Piece { node: index, view: *v, polygon });
            }
        }
    }
}
