//! Visibility by lines: what a radar sees directly, as fragments of straight lines.
//!
//! The visible part of a patch is never a polygon. Its outline is a list of fragments, each by itself: parts of the patch's own edges,
//! shadows of silhouettes on it, and walls of the window through which the radar looks. Areas, moments and waves are sums over fragments.
//!
//! 1. **Edges.** Every edge is split where nearer silhouettes cross it as the radar sees it, where it pierces a face, and at walls of windows.
//!    A ray to the middle of each part decides whether the part is visible.
//! 2. **Half-faces.** A visible part is outline of each lit face that meets in it, unless another of them hides it there.
//! 3. **Shadows.** A visible part of a silhouette throws its shadow on what lies behind its free side. The part is split where edges farther
//!    away cross it; one ray finds the face behind each piece; the fragment is the plane through radar and edge on that face.
//! 4. **Walls** of windows are shadows of the same kind.
//!
//! Rays run beside the lines, not on them (a few nanometres), so that each is decided by what lies on either side. Which of two faces hides the
//! other where they lie in one plane follows the rules of the polygons ([`super::beams`], CONVENTIONS eq. 65b).

use super::beams::GRAZING;
use crate::base::tasks::Tasks;
use crate::geom::edge_table::{Edge, EdgeTable, HalfFace};
use crate::geom::faces::{Face, Faces, LIES_M, misses_segment};
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
/// Shorter parts are left out, m.
const SHORTEST_M: f64 = 1e-10;
/// Sine of the angle to the plane of sight below which a half-face covers neither side of its edge.
const EDGE_ON: f64 = 1e-9;
/// Rounding along a ray, m.
const ROUNDING_M: f64 = 1e-9;

/// A part of the outline of what is visible of a patch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fragment {
    /// Both ends on the patch, m.
    pub ends_m: [DVec3; 2],
    /// Unit vector in the patch towards its visible side.
    pub inward: DVec3,
    /// Index of a face of the patch.
    pub face: u32,
}

impl Fragment {
    /// Its share of the area by Green's theorem, m²: the sum over all fragments of a patch is the visible area, whatever the origin.
    pub fn area_m2(&self, origin_m: DVec3, normal: DVec3) -> f64 {
        let [a, b] = self.ends_m.map(|p| p - origin_m);
        0.5 * self.turn(normal) * normal.dot(a.cross(b))
    }

    /// The fragment as a vector with the visible side on its left. The sum over all fragments of a patch is zero.
    pub fn vector_m(&self, normal: DVec3) -> DVec3 {
        (self.ends_m[1] - self.ends_m[0]) * self.turn(normal)
    }

    fn turn(&self, normal: DVec3) -> f64 {
        normal.cross(self.ends_m[1] - self.ends_m[0]).dot(self.inward).signum()
    }
}

/// A radar at a point, with all that does not depend on the line that is asked for.
struct Radar<'a> {
    faces: &'a Faces,
    table: &'a EdgeTable,
    origin: DVec3,
    windows: &'a [Frame],
    /// Whether rays from the radar can meet each face.
    lit: Vec<bool>,
    /// A face of each patch, in whose plane the patch's outline is given: corners of a file may be a little off it, and outlines must close.
    leads: Vec<u32>,
    /// Of each edge the side of the plane through the radar and its ends that nothing at the edge covers, as the sign of
    /// (a - origin) x (b - origin); 0 where it is no silhouette.
    free: Vec<f64>,
}

/// The fragments of all patches as seen through windows from one point, in a fixed order.
pub fn seen(faces: &Faces, table: &EdgeTable, windows: &[Frame]) -> Vec<Fragment> {
    let Some(first) = windows.first() else { return Vec::new() };
    let origin = first.origin;
    let is_lit = |f: &Face| {
        let facing = first.facing(f.normal, f.offset_m);
        facing.abs() > GRAZING * faces.radius_m && !(f.one_sided && facing > 0.0)
    };
    let lit: Vec<bool> = faces.faces.iter().map(is_lit).collect();
    let mut leads = vec![0; faces.patch_area_m2.len()];
    faces.faces.iter().enumerate().for_each(|(i, f)| leads[f.patch as usize] = i as u32);
    let mut radar = Radar { faces, table, origin, windows, lit, leads, free: Vec::new() };
    radar.free = table.edges.iter().map(|e| radar.free_side(e)).collect();
    let parts: Vec<Vec<Fragment>> =
        (0..table.edges.len()).into_par_iter().with_min_len(64).map_tasks(|i| radar.of_edge(i)).collect();
    let walls: Vec<Vec<Fragment>> =
        windows.par_iter().map_tasks(|w| (0..4).flat_map(|k| radar.of_wall(w, k)).collect()).collect();
    parts.into_iter().chain(walls).flatten().collect()
}

impl Radar<'_> {
    fn face(&self, i: u32) -> &Face {
        &self.faces.faces[i as usize]
    }

    fn free_side(&self, edge: &Edge) -> f64 {
        let [a, b] = edge.ends_m.map(|p| p - self.origin);
        let Some(normal) = a.cross(b).try_normalize() else { return 0.0 };
        let (mut above, mut below) = (false, false);
        for half in self.table.halves(edge).iter().filter(|h| self.lit[h.face as usize]) {
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

    fn in_window(&self, p: DVec3) -> bool {
        let d = p - self.origin;
        self.windows.iter().any(|w| {
            let k = w.k.dot(d);
            k > 0.0 && w.u.dot(d).abs() <= k && w.v.dot(d).abs() <= k
        })
    }

    /// Appends the shares of the segment `a`, `b` at which edges cross it as the radar sees it: silhouettes that are nearer, or with
    /// `beyond` all edges of lit faces that are farther.
    fn crossings(&self, [a, b]: [DVec3; 2], own: usize, beyond: bool, out: &mut Vec<f64>) {
        let s = self.origin;
        let (da, db) = (a - s, b - s);
        let Some(normal) = da.cross(db).try_normalize() else { return };
        // The sides of the wedge, positive inside, and the distance beyond the segment.
        let (from_a, to_b) = (normal.cross(da), db.cross(normal));
        let out_of = normal.cross(b - a).normalize();
        let far = if out_of.dot(da) < 0.0 { -out_of } else { out_of };
        let [n, p, q, f] = [normal, from_a, to_b, far].map(|v: DVec3| v.abs());
        let misses = |centre: DVec3, half: DVec3| {
            let (d, e) = (centre - s, centre - a);
            let depth = far.dot(e);
            normal.dot(d).abs() > n.dot(half)
                || from_a.dot(d) < -p.dot(half)
                || to_b.dot(d) < -q.dot(half)
                || if beyond { depth < -f.dot(half) } else { depth > f.dot(half) + SLACK_M }
        };
        self.table.tree.visit(misses, |i| {
            let i = i as usize;
            if i == own || (!beyond && self.free[i] == 0.0) {
                return false;
            }
            let edge = &self.table.edges[i];
            let [u, v] = edge.ends_m.map(|e| normal.dot(e - s));
            if (u > 0.0) == (v > 0.0) {
                return false;
            }
            let x = edge.at(u / (u - v));
            let depth = far.dot(x - a);
            let counts = from_a.dot(x - s) >= 0.0
                && to_b.dot(x - s) >= 0.0
                && if beyond { depth > -ROUNDING_M } else { depth < SLACK_M };
            if !counts || beyond && !self.table.halves(edge).iter().any(|h| self.lit[h.face as usize]) {
                return false;
            }
            let across = (edge.ends_m[0] - s).cross(edge.ends_m[1] - s);
            let (u, v) = (across.dot(da), across.dot(db));
            let t = u / (u - v);
            if t > 0.0 && t < 1.0 {
                out.push(t);
            }
            false
        });
    }

    /// The fragments that an edge brings: of the faces that meet in it, and of its shadow.
    fn of_edge(&self, number: usize) -> Vec<Fragment> {
        let mut out = Vec::new();
        let edge = &self.table.edges[number];
        let halves = self.table.halves(edge);
        if !halves.iter().any(|h| self.lit[h.face as usize]) {
            return out;
        }
        let s = self.origin;
        let mut shares = vec![0.0, 1.0];
        for w in self.windows {
            for wall in walls(w) {
                let [p, q] = edge.ends_m.map(|e| wall.dot(e - s));
                if (p > 0.0) != (q > 0.0) {
                    shares.push(p / (p - q));
                }
            }
        }
        shares.extend(self.table.pierced(edge));
        self.crossings(edge.ends_m, number, false, &mut shares);
        shares.sort_by(f64::total_cmp);
        let [a, b] = edge.ends_m;
        let length_m = a.distance(b);
        let normal = (a - s).cross(b - s).normalize_or_zero();
        let mut farther = Vec::new();
        for part in shares.windows(2).filter(|w| (w[1] - w[0]) * length_m > SHORTEST_M) {
            let ends_m = [edge.at(part[0]), edge.at(part[1])];
            let middle = 0.5 * (ends_m[0] + ends_m[1]);
            let beside_m = beside_m(ends_m);
            if !self.in_window(middle) {
                continue;
            }
            for (i, half) in halves.iter().enumerate().filter(|(_, h)| self.lit[h.face as usize]) {
                if self.is_lit_beside(edge, i, middle)
                    && self.reaches_face(middle + half.inward * beside_m, half.face, halves)
                {
                    out.push(self.fragment(ends_m, half.inward, half.face));
                }
            }
            let free = normal * self.free[number];
            // Where only one side is seen a nearer silhouette coincides, and its shadow is the same.
            if free == DVec3::ZERO
                || ![free, -free].iter().all(|d| self.reaches_edge(middle + *d * beside_m, edge, halves))
            {
                continue;
            }
            farther.clear();
            farther.extend([0.0, 1.0]);
            self.crossings(ends_m, number, true, &mut farther);
            farther.sort_by(f64::total_cmp);
            for w in farther.windows(2) {
                let at = |t: f64| ends_m[0] + (ends_m[1] - ends_m[0]) * t;
                let ends_m = [at(w[0]), at(w[1])];
                if ends_m[0].distance(ends_m[1]) > SHORTEST_M {
                    out.extend(self.shadow(ends_m, free, Some(edge)));
                }
            }
        }
        out
    }

    /// The fragments at a wall of a window.
    fn of_wall(&self, window: &Frame, number: usize) -> Vec<Fragment> {
        let s = self.origin;
        let [u, v] = if number < 2 { [window.u, window.v] } else { [window.v, window.u] };
        let sign = if number.is_multiple_of(2) { 1.0 } else { -1.0 };
        let side = window.k + u * sign;
        let ends_m = [s + side + v, s + side - v];
        let inward = (window.k - u * sign).normalize();
        let mut shares = vec![0.0, 1.0];
        // Near the radar the wedge has no segment to be beyond.
        self.crossings(ends_m.map(|p| s + (p - s) * 1e-6), usize::MAX, true, &mut shares);
        shares.sort_by(f64::total_cmp);
        let mut out = Vec::new();
        for w in shares.windows(2) {
            let at = |t: f64| ends_m[0] + (ends_m[1] - ends_m[0]) * t;
            let ends_m = [at(w[0]), at(w[1])];
            let middle = 0.5 * (ends_m[0] + ends_m[1]);
            let is_between_windows = self.in_window(middle - inward * BESIDE_M);
            if !is_between_windows && ends_m[0].distance(ends_m[1]) > SHORTEST_M {
                out.extend(self.shadow(ends_m, inward, None));
            }
        }
        out
    }

    /// Whether nothing else that meets in an edge hides one of its half-faces next to it.
    fn is_lit_beside(&self, edge: &Edge, number: usize, at: DVec3) -> bool {
        let halves = self.table.halves(edge);
        if halves.len() == 1 {
            return true;
        }
        let axis = (edge.ends_m[1] - edge.ends_m[0]).normalize();
        let to_radar = self.origin - at;
        let to_radar = (to_radar - axis * to_radar.dot(axis)).normalize_or_zero();
        let own = halves[number].inward;
        let angle = |from: DVec3, to: DVec3| from.cross(to).dot(axis);
        let whole = angle(own, to_radar);
        !halves.iter().enumerate().any(|(i, h)| {
            let (first, second) = (angle(own, h.inward), angle(h.inward, to_radar));
            i != number
                && self.lit[h.face as usize]
                && match whole > 0.0 {
                    true => first > EDGE_ON && second > EDGE_ON,
                    false => first < -EDGE_ON && second < -EDGE_ON,
                }
        })
    }

    /// Whether a smaller face lies on the plane of a larger one of another body: then it is seen and the other is not.
    fn lies_on(&self, face: &Face, other: &Face) -> bool {
        let area = |f: &Face| (self.faces.patch_area_m2[f.patch as usize], f.body);
        face.body != other.body
            && area(face) < area(other)
            && self.faces.corners(face).iter().all(|p| self.height(other, *p).abs() <= LIES_M)
    }

    /// Height over a face's plane on the side of its normal, m.
    fn height(&self, face: &Face, p: DVec3) -> f64 {
        face.normal.dot(p) - face.offset_m
    }

    /// Least and largest height of a face's corners over another's plane, m, on the side from which the radar sees that one.
    fn heights(&self, of: &Face, plane: &Face) -> (f64, f64) {
        let side = if self.height(plane, self.origin) > 0.0 { 1.0 } else { -1.0 };
        let heights = self.faces.corners(of).iter().map(|p| side * self.height(plane, *p));
        heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), h| (lo.min(h), hi.max(h)))
    }

    /// Whether a face that a ray meets at the share `t` of the distance to `target` hides it.
    fn hides(&self, other: &Face, target: &Face, t: f64, rounding: f64) -> bool {
        if self.lies_on(target, other) {
            return false;
        }
        if self.lies_on(other, target) {
            return true;
        }
        let flat_m = self.faces.flat_m;
        let (lo, hi) = self.heights(other, target);
        if hi <= flat_m {
            return false;
        }
        if lo >= -flat_m {
            return true;
        }
        let (lo, hi) = self.heights(target, other);
        lo < -flat_m && (hi <= flat_m || t < 1.0 - rounding)
    }

    /// Share of the distance to `s + d` at which a ray from the radar meets a face; None where it passes by.
    fn meets(&self, face: &Face, d: DVec3) -> Option<f64> {
        let t = -self.height(face, self.origin) / face.normal.dot(d);
        (t > 0.0 && t.is_finite() && self.is_seen_at(face, d)).then_some(t)
    }

    /// Whether a ray reaches a point on a face, past faces that `skip` names.
    fn reaches_face(&self, p: DVec3, number: u32, skip: &[HalfFace]) -> bool {
        let target = self.face(number);
        let d = p - self.origin;
        let length = d.length();
        // What lies on the target may be a little behind it.
        let margin = LIES_M / target.normal.dot(d).abs();
        let mut is_hidden = false;
        self.faces.visit_segment(self.origin, p + d * margin, ROUNDING_M, |i| {
            let other = self.face(i);
            is_hidden = self.lit[i as usize]
                && other.patch != target.patch
                && !skip.iter().any(|h| h.face == i)
                && self
                    .meets(other, d)
                    .is_some_and(|t| t < 1.0 + margin && self.hides(other, target, t, ROUNDING_M / length));
            is_hidden
        });
        !is_hidden
    }

    /// Whether an edge lies in the plane of a face.
    fn touches(&self, edge: &Edge, halves: &[HalfFace], face: &Face) -> bool {
        edge.ends_m.iter().all(|p| self.height(face, *p).abs() <= self.faces.flat_m)
            || halves.iter().any(|h| self.lit[h.face as usize] && self.lies_on(self.face(h.face), face))
    }

    /// Whether a ray reaches a point beside an edge.
    fn reaches_edge(&self, p: DVec3, edge: &Edge, halves: &[HalfFace]) -> bool {
        let d = p - self.origin;
        let rounding = ROUNDING_M / d.length();
        let mut is_hidden = false;
        self.faces.visit_segment(self.origin, p, ROUNDING_M, |i| {
            let other = self.face(i);
            is_hidden = self.lit[i as usize]
                && !halves.iter().any(|h| h.face == i)
                && self.meets(other, d).is_some_and(|t| t < 1.0 - rounding)
                && !self.touches(edge, halves, other);
            is_hidden
        });
        !is_hidden
    }

    /// The fragment that the plane through the radar and a segment throws on what lies behind its side `free`. `edge` is the edge that the
    /// segment is part of; None for a wall of a window, which begins at the radar.
    fn shadow(&self, ends_m: [DVec3; 2], free: DVec3, edge: Option<&Edge>) -> Option<Fragment> {
        let s = self.origin;
        let middle = 0.5 * (ends_m[0] + ends_m[1]);
        let beside_m = beside_m(ends_m);
        let d = middle + free * beside_m - s;
        let rounding = ROUNDING_M / d.length();
        let halves = edge.map_or(&[][..], |e| self.table.halves(e));
        let reach = (s.distance(self.faces.centre_m) + self.faces.radius_m) / d.length();
        // (share of the distance, face, share up to which one that lies on it is looked for)
        let best: Cell<Option<(f64, u32, f64)>> = Cell::new(None);
        let end = |face: &Face, t: f64| t + LIES_M / face.normal.dot(d).abs();
        let start = if edge.is_some() { (1.0 - SLACK_M / d.length()).max(0.0) } else { 0.0 };
        let misses = |centre: DVec3, half: DVec3| {
            let end = best.get().map_or(reach, |b| b.2);
            misses_segment(s + d * start, s + d * end, ROUNDING_M)(centre, half)
        };
        self.faces.visit_boxes(misses, |i| {
            let face = self.face(i);
            if !self.lit[i as usize] || halves.iter().any(|h| h.face == i) {
                return;
            }
            let Some(t) = self.meets(face, d) else { return };
            let least = match edge {
                None => 0.0,
                Some(e) if t <= 1.0 + rounding => match self.touches(e, halves, face) {
                    true => 1.0 - 2.0 * LIES_M / face.normal.dot(d).abs(),
                    false => 1.0 + rounding,
                },
                _ => 1.0,
            };
            if t < least {
                return;
            }
            let is_nearer = best.get().is_none_or(|(other_t, other, end)| {
                let other = self.face(other);
                t < end && (self.lies_on(face, other) || t < other_t && !self.lies_on(other, face))
            });
            if is_nearer {
                best.set(Some((t, i, end(face, t))));
            }
        });
        let (t, number, _) = best.get()?;
        let face = self.face(number);
        // What does not hide the face shades it neither: a line on the road that a smaller one lies on.
        let hidden_by = |h: &HalfFace| {
            self.lit[h.face as usize] && self.hides(self.face(h.face), face, 1.0 / t.max(1.0), rounding)
        };
        if edge.is_some() && !halves.iter().any(hidden_by) {
            return None;
        }
        // Where the patch ends at the line it is the patch's own edge that bounds it.
        let covered = middle - free * beside_m - s;
        let goes_on = self.is_seen_at(face, covered) || self.is_on_patch(face, covered);
        let inward = (free - face.normal * free.dot(face.normal)).normalize_or_zero();
        goes_on.then(|| self.fragment(ends_m, inward, number))
    }

    /// A fragment of a face's patch with both ends on the rays through two positions.
    fn fragment(&self, ends_m: [DVec3; 2], inward: DVec3, face: u32) -> Fragment {
        let s = self.origin;
        let lead = self.face(self.leads[self.face(face).patch as usize]);
        let height = self.height(lead, s);
        let on = |p: DVec3| s - (p - s) * (height / lead.normal.dot(p - s));
        Fragment { ends_m: ends_m.map(on), inward, face }
    }

    /// Whether a face has a place in a direction from the radar: by the sides as the radar sees them, which are its edges, also where a
    /// corner is off its plane.
    fn is_seen_at(&self, face: &Face, d: DVec3) -> bool {
        let corners = self.table.corners(face);
        let sign = -self.height(face, self.origin).signum();
        let mut a = corners[corners.len() - 1] - self.origin;
        corners.iter().all(|b| {
            let b = *b - self.origin;
            let is_inside = sign * a.cross(b).dot(d) >= 0.0;
            a = b;
            is_inside
        })
    }

    /// Whether a patch of which `face` is one has a place in a direction.
    fn is_on_patch(&self, on: &Face, d: DVec3) -> bool {
        let p = self.origin - d * (self.height(on, self.origin) / on.normal.dot(d));
        let mut found = false;
        let apart = |c: DVec3, half: DVec3| (p - c).abs().cmpgt(half + LIES_M).any();
        self.faces.visit_boxes(apart, |i| {
            let face = self.face(i);
            found = found || face.patch == on.patch && self.is_seen_at(face, d);
        });
        found
    }
}

/// How far beside a part a ray decides, m.
fn beside_m(ends_m: [DVec3; 2]) -> f64 {
    BESIDE_M.min(BESIDE * ends_m[0].distance(ends_m[1]))
}

/// The walls of a window, positive inside.
fn walls(w: &Frame) -> [DVec3; 4] {
    [w.k - w.u, w.k + w.u, w.k - w.v, w.k + w.v]
}
