//! What facets of curved surfaces radiate at finite range (CONVENTIONS eq. 58, 59).
//!
//! A smooth surface radiates from where it mirrors and from its borders; what else its facets radiate cancels between neighbours.
//! So each facet is summed up within a window about the place of mirror reflection, wherever that lies, and beyond it only
//! creases have waves.

use super::beams::Polygon;
use super::boundary::{GAUSS, Holds, RUN};
use crate::geom::curved_facet::{Crease, CurvedFacet};
use glam::{DMat3, DVec2, DVec3};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Radians from the place of mirror reflection up to which all is summed up, and from which on nothing is. The window is as smooth as
/// the area under Hann's, so that what it leaves over of a surface that goes on is 0.5 % of its echo.
const WINDOW: [f64; 2] = [4.0, 24.0];
/// Change of the path's phase, rad, along a side of a triangle that Radon's rule sums up, at the usual accuracy, and of the phase that
/// the window goes by.
const SPAN: [f64; 2] = [3.0, 7.5];
/// Quadratic phase of the usual accuracy, rad, by which the spans are scaled. The rule's error goes with their sixth power.
const USUAL: f64 = 0.25;
/// Weights below this are none.
const LEAST: f64 = 1e-4;
/// Times a lit part or a side may be halved.
const DEPTH: u32 = 24;
/// How far beyond its values at three places the slope along a crease may go, as a share of their span.
const EDGE_WIDER: f64 = 0.25;
/// A side of a lit polygon that lies this near to a crease is on it, as a phase, rad; so is its end, to the crease's.
pub(super) const ON_CREASE: f64 = 5e-2;

/// A facet of a curved surface between a source and a receiver, or their images.
pub(super) struct Curved<'a> {
    facet: &'a CurvedFacet,
    /// Wavenumber, rad/m.
    k: f64,
    tau: f64,
    /// The face's first corner and axes.
    corner: DVec3,
    axis: [DVec3; 2],
    /// The face's corners along them.
    corners: [DVec2; 3],
    /// Share of each corner at the first corner, and its change along the axes.
    shares: [(f64, DVec2); 3],
    stations: [DVec3; 2],
    /// 1 where the front is lit, else -1.
    sign: f64,
}

/// The surface over a place of the facet.
#[derive(Clone, Copy)]
pub(super) struct Spot {
    /// Place on the face along its axes, m.
    on_face: DVec2,
    /// Place in the world, m.
    pub(super) place: DVec3,
    /// Unit normal on the lit side.
    pub(super) normal: DVec3,
    /// Length of the path by way of the spot, m.
    pub(super) length: f64,
    /// Its derivatives along the face's axes, from the normals, and how fast these change at most: xx, yy and xy, 1/m.
    slope: DVec2,
    turn: [f64; 3],
    /// Way along the axes from where the path would stand still if the slope turned everywhere as it does here, m, and its change over
    /// that way, twice, m.
    from_mirror: DVec2,
    twice: f64,
    /// Area of the surface over that of the facet.
    stretch: f64,
    /// Sum of one over the distances from the stations, 1/m, and length of the sum of the unit vectors from them.
    spherical: f64,
    sum: f64,
}

/// The way from where a path with these second derivatives stands still to where it has this slope, m, and its change over it, twice, m.
#[inline]
fn from_mirror(slope: DVec2, [xx, yy, xy]: [f64; 3]) -> (DVec2, f64) {
    let way = DVec2::new(yy * slope.x - xy * slope.y, xx * slope.y - xy * slope.x) / (xx * yy - xy * xy);
    (way, slope.dot(way))
}

/// Share of a place that many radians from the place of mirror reflection, or from where it may be.
pub(crate) fn window(phase: f64) -> f64 {
    let t = (phase - WINDOW[0]) / (WINDOW[1] - WINDOW[0]);
    match t {
        ..=0.0 => 1.0,
        1.0.. => 0.0,
        t => 1.0 - (t - (TAU * t).sin() / TAU),
    }
}

/// What one echo stands for.
pub(super) struct Inner {
    /// Place on the face, m.
    pub(super) place: DVec2,
    /// Its integral in m², with phases referred to the path by way of its place.
    pub(super) value: Complex64,
    /// What its place stays with.
    pub(super) holds: Holds,
}

/// What triangles radiate.
struct Sum {
    /// In m², with phases referred to a path of the length `from`.
    value: Complex64,
    from: Option<f64>,
    /// Weighted area, m², and its first moment.
    area: f64,
    first: DVec2,
}

impl<'a> Curved<'a> {
    /// A facet with its face's corners and axes, which begin at the first of them; `sign` is 1 where its front is lit, else -1. `k` and
    /// `tau` as in `Plane::new`.
    pub(super) fn new(
        (facet, corners, axis): (&'a CurvedFacet, &[DVec3], [DVec3; 2]),
        sign: f64,
        stations: [DVec3; 2],
        (k, tau): (f64, f64),
    ) -> Curved<'a> {
        let corner = corners[0];
        let at = |i: usize| {
            let d = corners[i] - corner;
            DVec2::new(axis[0].dot(d), axis[1].dot(d))
        };
        let p = [at(0), at(1), at(2)];
        let twice = (p[1] - p[0]).perp_dot(p[2] - p[0]);
        // The share of a corner grows across the side that lies before it.
        let shares = [0, 1, 2].map(|i| {
            let (a, b) = (p[(i + 1) % 3], p[(i + 2) % 3]);
            let grow = (b - a).perp() / twice;
            (if i == 0 { 1.0 } else { 0.0 }, grow)
        });
        Curved { facet, k, tau, corner, axis, corners: p, shares, stations, sign }
    }

    /// Radians from the place of mirror reflection from which on nothing is summed up.
    pub(super) const WINDOW_ENDS: f64 = WINDOW[1];

    /// Whether any of the facet, or with `edges` of its creases, may lie within the window.
    pub(super) fn may_shine(&self, edges: bool) -> bool {
        if !self.is_shut(&self.corners.map(|p| self.at(p)), &self.at(self.middle())) {
            return true;
        }
        edges && (0..3).any(|s| self.facet.creases[s].as_ref().is_some_and(|c| self.edge_may_shine(s, c)))
    }

    /// Whether a crease, on the side from corner `s` on, returns anything.
    fn edge_may_shine(&self, s: usize, crease: &Crease) -> bool {
        if crease.corners != [false; 2] {
            return true;
        }
        let (a, b) = (self.corners[s], self.corners[(s + 1) % 3]);
        let way = (b - a).normalize_or_zero();
        let [mut least, mut most, mut turn] = [f64::INFINITY, f64::NEG_INFINITY, 0f64];
        for p in [a, 0.5 * (a + b), b] {
            let spot = self.at(p);
            let slope = way.dot(spot.slope);
            let [p, q] = crease.curvature_per_m;
            (least, most) = (least.min(slope), most.max(slope));
            turn = turn.max(p.max(q) * spot.sum + spot.spherical);
        }
        let off = (least - EDGE_WIDER * (most - least)).max(-most - EDGE_WIDER * (most - least)).max(0.0);
        self.k * off * off < 2.0 * turn * WINDOW[1]
    }

    /// Shares of the corners at a place.
    #[inline]
    fn shares(&self, p: DVec2) -> [f64; 3] {
        let mut share = [0.0; 3];
        for (s, (first, grow)) in share.iter_mut().zip(&self.shares) {
            *s = first + grow.dot(p);
        }
        share
    }

    /// Where the surface is, and its normal, not of length one.
    #[inline]
    fn surface(&self, p: DVec2, share: &[f64; 3]) -> (DVec3, DVec3) {
        let CurvedFacet { normals: n, rise_m: rise, .. } = self.facet;
        let [a, b, c] = *share;
        let flat = self.corner + self.axis[0] * p.x + self.axis[1] * p.y;
        let place = flat + (rise[0] * (a * b) + rise[1] * (b * c) + rise[2] * (c * a)) * 4.0;
        (place, (n[0] * a + n[1] * b + n[2] * c) * self.sign)
    }

    /// Tensor of the curvatures without their signs.
    #[inline]
    fn bend(&self, share: &[f64; 3]) -> DMat3 {
        let [p, q, r] = &self.facet.bends;
        *p * share[0] + *q * share[1] + *r * share[2]
    }

    /// Middle of the facet.
    pub(super) fn middle(&self) -> DVec2 {
        (self.corners[0] + self.corners[1] + self.corners[2]) / 3.0
    }

    /// Longest side, m.
    pub(super) fn size(&self) -> f64 {
        let [a, b, c] = self.corners;
        a.distance(b).max(b.distance(c)).max(c.distance(a))
    }

    /// The face's axes.
    pub(super) fn axes(&self) -> [DVec3; 2] {
        self.axis
    }

    /// Least share of a corner, negative outside the facet.
    pub(super) fn least_share(&self, p: DVec2) -> f64 {
        self.shares(p).into_iter().fold(f64::INFINITY, f64::min)
    }

    /// Slope of the path's length along the face's axes.
    pub(super) fn slope(&self, p: DVec2) -> DVec2 {
        self.at(p).slope
    }

    /// The share of the line between two positions at which it leaves the facet, and the side by which it does; None where it stays.
    pub(super) fn leaves(&self, from: DVec2, to: DVec2) -> Option<(f64, usize)> {
        let (a, b) = (self.shares(from), self.shares(to));
        // The side from corner s on lies across from the corner before it.
        let across = |s: usize| (s + 2) % 3;
        let share = |s: usize| (a[across(s)] / (a[across(s)] - b[across(s)])).clamp(0.0, 1.0);
        let left = (0..3).filter(|s| b[across(*s)] < 0.0).map(|s| (share(s), s));
        left.min_by(|p, q| p.0.total_cmp(&q.0))
    }

    /// Place of the surface and its unit normal on the lit side.
    pub(super) fn position_and_normal(&self, p: DVec2) -> (DVec3, DVec3) {
        let (place, normal) = self.surface(p, &self.shares(p));
        (place, normal.normalize_or_zero())
    }

    /// Second fundamental form of the surface, 1/m, positive where the lit side is convex.
    pub(super) fn shape(&self, p: DVec2) -> DMat3 {
        let step = 1e-4 * self.size();
        let (_, normal) = self.position_and_normal(p);
        let [x, y] = [DVec2::X, DVec2::Y].map(|d| {
            let [(to, n), (from, m)] = [d, -d].map(|d| self.position_and_normal(p + d * step));
            ((to - from) / (2.0 * step), (n - m) / (2.0 * step))
        });
        let steps = DMat3::from_cols(x.0, y.0, normal);
        let form = DMat3::from_cols(x.1, y.1, DVec3::ZERO) * steps.inverse();
        (form + form.transpose()) * 0.5
    }

    #[inline]
    pub(super) fn at(&self, p: DVec2) -> Spot {
        let share = self.shares(p);
        let (place, normal) = self.surface(p, &share);
        let [mut x, mut y] = self.axis;
        for (s, rise) in self.facet.rise_m.iter().enumerate() {
            let (a, b) = (s, (s + 1) % 3);
            let (da, db) = (self.shares[a].1, self.shares[b].1);
            let rise = *rise * 4.0;
            x += rise * (da.x * share[b] + db.x * share[a]);
            y += rise * (da.y * share[b] + db.y * share[a]);
        }
        let (mut length, mut sum, mut spherical) = (0.0, DVec3::ZERO, 0.0);
        for station in self.stations {
            let d = place - station;
            let r = d.length();
            length += r;
            sum += d / r;
            spherical += 1.0 / r;
        }
        let normal = normal.normalize_or_zero();
        let depth = normal.dot(sum);
        let along = sum - normal * depth;
        let slope = DVec2::new(along.dot(x), along.dot(y));
        let bend = self.bend(&share) * depth.abs();
        let (bent_x, bent_y) = (bend * x + x * spherical, bend * y + y * spherical);
        let turn = [x.dot(bent_x), y.dot(bent_y), x.dot(bent_y)];
        let (from_mirror, twice) = from_mirror(slope, turn);
        Spot {
            on_face: p,
            place,
            normal,
            length,
            slope,
            turn,
            from_mirror,
            twice,
            stretch: x.cross(y).length(),
            spherical,
            sum: sum.length(),
        }
    }

    /// Radians from the place of mirror reflection, if the surface went on as it is curved here.
    #[inline]
    fn phase(&self, at: &Spot) -> f64 {
        0.5 * self.k * at.twice
    }

    /// Weight of a place.
    #[inline]
    fn weight(&self, at: &Spot) -> f64 {
        window(self.phase(at))
    }

    /// Whether the window is shut all over a triangle: in the measure of the widest window at its corners no place of it comes near.
    fn is_shut(&self, corners: &[Spot; 3], middle: &Spot) -> bool {
        let differs = |there: &Spot| {
            let [xx, yy, xy] = [0, 1, 2].map(|i| there.turn[i] - middle.turn[i]);
            (xx * xx + yy * yy + 2.0 * xy * xy).sqrt()
        };
        let wider = corners.iter().map(differs).fold(0.0, f64::max);
        let [xx, yy, xy] = middle.turn;
        let turn = [xx + wider, yy + wider, xy];
        let length = |slope: DVec2| from_mirror(slope, turn).1.max(0.0);
        let reach = corners.iter().map(|there| length(there.slope - middle.slope)).fold(0.0, f64::max);
        let nearest = (length(middle.slope).sqrt() - 1.2 * reach.sqrt()).max(0.0);
        self.k * nearest * nearest >= 2.0 * WINDOW[1]
    }

    /// What lies about the place of mirror reflection; None when the window leaves nothing of the polygons. They are halved until the
    /// phase changes little along the sides of their triangles, and summed up by Radon's rule of seven places and fifth degree.
    pub(super) fn inner(&self, lit: &[Polygon]) -> Option<Inner> {
        let scale = (self.tau / USUAL).powf(1.0 / 6.0);
        let mut sum = Sum { value: Complex64::ZERO, area: 0.0, first: DVec2::ZERO, from: None };
        let mut stack: Vec<([Spot; 3], u32)> = Vec::with_capacity(32);
        for polygon in lit {
            let corners = polygon.corners();
            if corners.len() < 3 {
                continue;
            }
            let first = self.at(corners[0]);
            let mut before = self.at(corners[1]);
            for corner in &corners[2..] {
                let next = self.at(*corner);
                stack.push(([first, before, next], 0));
                before = next;
            }
            while let Some((triangle, depth)) = stack.pop() {
                let [a, b, c] = triangle.map(|s| s.on_face);
                let area = 0.5 * (b - a).perp_dot(c - a).abs();
                if area == 0.0 {
                    continue;
                }
                let middle = self.at((a + b + c) / 3.0);
                if self.is_shut(&triangle, &middle) {
                    continue;
                }
                let (mut widest, mut span) = (0, 0.0);
                for i in 0..3 {
                    let at = self.span(&triangle[i], &triangle[(i + 1) % 3]);
                    if at > span {
                        (widest, span) = (i, at);
                    }
                }
                if span <= scale || depth == DEPTH {
                    self.add_radon([a, b, c], area, &middle, &mut sum);
                    continue;
                }
                let [p, q, r] = [0, 1, 2].map(|i| triangle[(widest + i) % 3]);
                let half = self.at(0.5 * (p.on_face + q.on_face));
                stack.push(([p, half, r], depth + 1));
                stack.push(([half, q, r], depth + 1));
            }
        }
        let from = sum.from.filter(|_| sum.area > 0.0)?;
        let place = sum.first / sum.area;
        let spot = self.at(place);
        let value = sum.value * Complex64::cis(self.k * (spot.length - from));
        let [out, back] = self.ranges(&spot);
        let waves = 1.0 / out + 1.0 / back;
        let [xx, yy, _] = spot.turn;
        let holds = if xx + yy < 3.0 * waves { Holds::Mirror } else { Holds::Corner };
        Some(Inner { place, value, holds })
    }

    /// How far the phase and the window's change along the side between two places, of what Radon's rule bears at the usual accuracy.
    #[inline]
    fn span(&self, a: &Spot, b: &Spot) -> f64 {
        let way = b.on_face - a.on_face;
        let path = self.k * a.slope.dot(way).abs().max(b.slope.dot(way).abs());
        // Where the window is open all along the side it changes nothing.
        let [p, q] = [a, b].map(|s| self.phase(s).clamp(WINDOW[0], WINDOW[1]));
        (path / SPAN[0]).max((p - q).abs() / SPAN[1])
    }

    /// Adds a triangle of this area by Radon's rule (Abramowitz and Stegun, section 25.4.63).
    #[inline]
    fn add_radon(&self, corners: [DVec2; 3], area: f64, middle: &Spot, sum: &mut Sum) {
        let from = *sum.from.get_or_insert(middle.length);
        let mut add = |spot: &Spot, share: f64| {
            let weight = self.weight(spot) * share * area;
            if weight > 0.0 {
                sum.value += Complex64::cis(-self.k * (spot.length - from)) * (weight * spot.stretch);
            }
            let weight = weight.max(LEAST * share * area);
            sum.area += weight;
            sum.first += spot.on_face * weight;
        };
        add(middle, 0.225);
        let root = 15f64.sqrt();
        for (near, share) in [((6.0 - root) / 21.0, 155.0 - root), ((6.0 + root) / 21.0, 155.0 + root)] {
            for i in 0..3 {
                let [a, b, c] = [0, 1, 2].map(|j| corners[(i + j) % 3]);
                add(&self.at(a + (b - a) * near + (c - a) * near), share / 1200.0);
            }
        }
    }

    /// Normal of the surface where both stations are before it; beyond its horizon there is none of use.
    pub(super) fn lit_normal(&self, spot: &Spot) -> Option<DVec3> {
        self.stations.iter().all(|s| (*s - spot.place).dot(spot.normal) > 0.0).then_some(spot.normal)
    }

    /// Distances from source and receiver, m.
    pub(super) fn ranges(&self, spot: &Spot) -> [f64; 2] {
        self.stations.map(|s| s.distance(spot.place))
    }

    /// The crease on which a side of a lit polygon lies, and the shares of its way along it where the side begins and ends.
    pub(super) fn crease(&self, [a, b]: [DVec2; 2], near_m: f64) -> Option<(&Crease, [f64; 2])> {
        // Shaders leave out strips as narrow as their rounding where a plane meets a facet.
        let near_m = near_m.max(ON_CREASE / self.k);
        let off = |corner: usize, p: DVec2| {
            let (first, grow) = self.shares[corner];
            (first + grow.dot(p)).abs() / grow.length()
        };
        // The side from corner s on lies across from the corner before it.
        let mut sides = self.facet.creases.iter().enumerate();
        sides.find_map(|(s, crease)| {
            let (crease, across) = (crease.as_ref()?, (s + 2) % 3);
            let is_on = off(across, a) <= near_m && off(across, b) <= near_m;
            let end = near_m / self.corners[s].distance(self.corners[(s + 1) % 3]);
            let share = |p| match self.shares(p)[(s + 1) % 3] {
                share if share < end => 0.0,
                share if share > 1.0 - end => 1.0,
                share => share,
            };
            is_on.then(|| (crease, [a, b].map(share)))
        })
    }

    /// Whether any side is a crease.
    pub(super) fn has_crease(&self) -> bool {
        self.facet.creases.iter().any(Option::is_some)
    }

    /// The waves of a side along a crease (inside on the left) which runs `along` it: those about the place where the crease's own
    /// path stands still, and those of its corners; of both what the window about the place of mirror reflection does not hold. Near
    /// that place they are exact for a path that is quadratic all over the surface (CONVENTIONS eq. 58). Where no more than a strip of
    /// the facet is lit, the waves of its two long sides cancel, and those of the shadow's border are in no list: what is left of the
    /// crease's goes with the strip's width in radians.
    pub(super) fn edge(
        &self,
        [a, b]: [DVec2; 2],
        (crease, along): (&Crease, [f64; 2]),
        lit: &[Polygon],
        mut emit: impl FnMut(Inner),
    ) {
        let length = a.distance(b);
        if length == 0.0 {
            return;
        }
        let way = (b - a) / length;
        let outward = -way.perp();
        let deepest =
            |places: &[DVec2]| places.iter().map(|p| (*p - a).dot(outward).abs()).fold(0.0, f64::max);
        let width = lit.iter().map(|p| deepest(p.corners())).fold(0.0, f64::max);
        let share_lit = width / deepest(&self.corners);
        let edge = |t: f64| {
            let spot = self.at(a + way * (t * length));
            let share = along[0] + (along[1] - along[0]) * t;
            let [p, q] = crease.curvature_per_m;
            let turn = (p + (q - p) * share).max(0.0) * spot.sum + spot.spherical;
            let weight = 1.0 - self.weight(&spot);
            // Within the window the slope may be nothing.
            let flux = || {
                let near = window(0.5 * self.k * spot.slope.length_squared() / (spot.turn[0] + spot.turn[1]));
                near * outward.dot(spot.from_mirror) / spot.twice
                    + (1.0 - near) * outward.dot(spot.slope) / spot.slope.length_squared()
            };
            let strip = (self.k * outward.dot(spot.slope).abs() * width).max(share_lit).min(1.0);
            let kernel = if weight > 0.0 { weight * strip * spot.stretch * flux() } else { 0.0 };
            EdgeSpot { t, slope: way.dot(spot.slope), turn, kernel, length: spot.length }
        };
        let weight = |at: &EdgeSpot| window(self.k * at.slope * at.slope / (2.0 * at.turn));
        let flux = Complex64::new(0.0, 1.0 / self.k);
        let ends = [edge(0.0), edge(1.0)];
        for (end, (place, sign)) in ends.iter().zip([(a, -1.0), (b, 1.0)]) {
            let share = if sign < 0.0 { along[0] } else { along[1] };
            let corner = (share == 0.0 && crease.corners[0]) || (share == 1.0 && crease.corners[1]);
            let outer = 1.0 - weight(end);
            if corner && outer * end.kernel.abs() > 0.0 {
                let value = Complex64::new(0.0, sign * outer * end.kernel / (self.k * end.slope)) * flux;
                emit(Inner { place, value, holds: Holds::Corner });
            }
        }
        let (mut value, mut all, mut first, mut from) = (Complex64::ZERO, 0.0, 0.0, None);
        let [start, stop] = ends;
        let mut stack = vec![(start, stop, 0)];
        while let Some((p, q, depth)) = stack.pop() {
            let m = edge(0.5 * (p.t + q.t));
            let turn = p.turn.max(q.turn).max(m.turn);
            let slowest = match p.slope * q.slope > 0.0 && p.slope * m.slope > 0.0 {
                true => p.slope.abs().min(q.slope.abs()).min(m.slope.abs()),
                false => 0.0,
            };
            let shut = self.k * slowest * slowest >= 2.0 * turn * WINDOW[1];
            if shut || (p.kernel == 0.0 && q.kernel == 0.0 && m.kernel == 0.0) {
                continue;
            }
            let run = (p.length - m.length).abs().max((q.length - m.length).abs());
            if run * self.k > RUN && depth < DEPTH {
                stack.push((m, q, depth + 1));
                stack.push((p, m, depth + 1));
                continue;
            }
            let from = *from.get_or_insert(m.length);
            let half = 0.5 * (q.t - p.t);
            for (x, share) in GAUSS {
                for x in [-x, x] {
                    let spot = edge(m.t + half * x);
                    let part = weight(&spot) * share * half * length;
                    value += Complex64::cis(-self.k * (spot.length - from)) * (part * spot.kernel);
                    let part = part * spot.kernel.abs();
                    all += part;
                    first += part * spot.t;
                }
            }
        }
        if let Some(from) = from.filter(|_| all > 0.0) {
            let place = a + way * (first / all * length);
            let turn = Complex64::cis(self.k * (self.at(place).length - from));
            emit(Inner { place, value: value * turn * flux, holds: Holds::Side(way) });
        }
    }
}

/// A place on a crease.
#[derive(Clone, Copy)]
struct EdgeSpot {
    /// Share of the way along the side.
    t: f64,
    /// Change of the path along it, and how fast that changes at most, 1/m.
    slope: f64,
    turn: f64,
    kernel: f64,
    length: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::rng::Draws;
    use std::f64::consts::PI;

    /// A facet of a sphere of 0.5 m, in front of a radar at 77 GHz.
    fn on_facet<T>(work: impl FnOnce(&Curved<'_>, Polygon) -> T) -> T {
        let radius = 0.5;
        let up = |x: f64, y: f64| DVec3::new(x, y, 1.0).normalize();
        let normals = [up(0.0, 0.0), up(0.12, 0.01), up(0.03, 0.1)];
        let corners = normals.map(|n| n * radius);
        let rise_m = [0, 1, 2].map(|i| {
            let flat = 0.5 * (corners[i] + corners[(i + 1) % 3]);
            flat.normalize() * radius - flat
        });
        let facet =
            CurvedFacet { normals, rise_m, bends: [DMat3::IDENTITY * radius.recip(); 3], creases: [None; 3] };
        let x = (corners[1] - corners[0]).normalize();
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        let axis = [x, normal.cross(x)];
        let stations = [DVec3::new(0.6, 0.5, 8.0); 2];
        let k = TAU * 77e9 / 299_792_458.0;
        let curved = Curved::new((&facet, &corners, axis), 1.0, stations, (k, 0.3));
        let whole = Polygon::of(&curved.corners)[0];
        work(&curved, whole)
    }

    /// What a lit part radiates does not hang on how it was cut, but for the rule's error.
    #[test]
    fn cuts_change_nothing() {
        on_facet(|curved, whole| {
            let mut rng = Draws::new(7, 0);
            let mut uniform = || rng.uniform();
            let size = curved.corners[1].x;
            for _ in 0..40 {
                let mut cut = |p: &Polygon| {
                    let at = DVec2::new(uniform(), uniform()) * size;
                    p.split(at, DVec2::from_angle(2.0 * PI * uniform()))
                };
                // A part of the facet, cut again and again.
                let [part, rest] = cut(&whole);
                let part = if part.corners().len() >= 3 { part } else { rest };
                let mut pieces = vec![part];
                for _ in 0..3 {
                    let all = pieces.iter().flat_map(&mut cut).collect::<Vec<_>>();
                    pieces = all.into_iter().filter(|p| p.area().abs() > 0.0).collect();
                }
                let (Some(a), Some(b)) = (curved.inner(&[part]), curved.inner(&pieces)) else {
                    assert!(curved.inner(&[part]).is_none() && curved.inner(&pieces).is_none());
                    continue;
                };
                let turned = b.value
                    * Complex64::cis(curved.k * (curved.at(a.place).length - curved.at(b.place).length));
                let off = (turned - a.value).norm() / a.value.norm();
                let moved = a.place.distance(b.place) / size;
                assert!(off < 1e-3 && moved < 1e-3, "{} pieces: {off:e}, {moved:e}", pieces.len());
            }
        });
    }
}
