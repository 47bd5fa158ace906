//! What facets of curved surfaces radiate at finite range (CONVENTIONS eq. 58, 59).
//!
//! A smooth surface radiates from where it mirrors and from its borders; what else its facets radiate cancels between neighbours.
//! So each facet is summed up within a window about the place of mirror reflection, wherever that lies, and beyond it only
//! creases have waves.

use super::beams::{CAP, Polygon, keep};
use super::boundary::{GAUSS, Holds, RUN};
use crate::em::aperture::{Moments, phase_integral};
use crate::geom::curved_facet::{Crease, CurvedFacet};
use glam::{DMat3, DVec2, DVec3};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Radians from the place of mirror reflection up to which all is summed up, and from which on nothing is. The window is as smooth as
/// the area under Hann's, so that what it leaves over of a surface that goes on is 0.5 % of its echo.
const WINDOW: [f64; 2] = [4.0, 24.0];
/// A cell's weight may be off by so much from one that is linear over it.
const LINEAR: f64 = 0.05;
/// Quadratic phase that a cell of a curved facet may have, as a share of that of a flat face: the window ends amid
/// cells, where no neighbour makes up for what one leaves out.
const FINER: f64 = 0.25;
/// Weights below this are none.
const LEAST: f64 = 1e-4;
/// Times a facet or a side may be halved.
const DEPTH: u32 = 16;
/// How far beyond its values at three places the slope along a crease may go, as a share of their span.
const EDGE_WIDER: f64 = 0.25;
/// Shares of a crease this near to its ends are its ends.
const AT_END: f64 = 1e-6;

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
    /// Place in the world, m.
    pub(super) place: DVec3,
    /// Unit normal on the lit side.
    pub(super) normal: DVec3,
    /// Length of the path by way of the spot, m.
    pub(super) length: f64,
    /// Its derivatives along the face's axes.
    slope: DVec2,
    bend: [f64; 3],
    /// Area of the surface over that of the facet.
    stretch: f64,
    glance: Glance,
    /// Sum of one over the distances from the stations, 1/m, and length of the sum of the unit vectors from them.
    spherical: f64,
    sum: f64,
}

impl Spot {
    /// Derivative of the slope along a direction.
    fn bent(&self, d: DVec2) -> DVec2 {
        let [xx, yy, xy] = self.bend;
        DVec2::new(xx * d.x + xy * d.y, xy * d.x + yy * d.y)
    }
}

/// Share of a place that many radians from the place of mirror reflection.
fn window(phase: f64) -> f64 {
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

/// What a polygon is to the window.
enum Cell {
    /// Nothing of it is seen.
    Shut,
    /// It is to be split across this direction: the phase is not quadratic over it, or the weight not linear.
    Split(DVec2),
    /// The weight in its middle, and its change.
    Seen(f64, DVec2),
}

/// What decides over the window: change of the path along the surface, and how fast that changes at most, 1/m.
#[derive(Clone, Copy, Default)]
struct Glance {
    across: DVec3,
    turn: f64,
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
        let middle = self.middle();
        if !self.is_shut(&self.glances(&self.corners)[..3], &self.glance(middle)) {
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

    #[inline]
    fn curvature(&self, share: &[f64; 3]) -> f64 {
        let [p, q, r] = self.facet.curvature_per_m;
        p * share[0] + q * share[1] + r * share[2]
    }

    #[inline]
    fn glance(&self, p: DVec2) -> Glance {
        let share = self.shares(p);
        let (place, normal) = self.surface(p, &share);
        let (mut sum, mut spherical) = (DVec3::ZERO, 0.0);
        for station in self.stations {
            let d = place - station;
            let over = 1.0 / d.length();
            sum += d * over;
            spherical += over;
        }
        let normal = normal.normalize_or_zero();
        let depth = normal.dot(sum);
        let turn = self.curvature(&share) * depth.abs() + spherical;
        Glance { across: sum - normal * depth, turn }
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

    /// Place of the surface and its unit normal on the lit side.
    pub(super) fn place_and_normal(&self, p: DVec2) -> (DVec3, DVec3) {
        let (place, normal) = self.surface(p, &self.shares(p));
        (place, normal.normalize_or_zero())
    }

    /// Second fundamental form of the surface, 1/m, positive where the lit side is convex.
    pub(super) fn shape(&self, p: DVec2) -> DMat3 {
        let step = 1e-4 * self.size();
        let (_, normal) = self.place_and_normal(p);
        let [x, y] = [DVec2::X, DVec2::Y].map(|d| {
            let [(to, n), (from, m)] = [d, -d].map(|d| self.place_and_normal(p + d * step));
            ((to - from) / (2.0 * step), (n - m) / (2.0 * step))
        });
        let steps = DMat3::from_cols(x.0, y.0, normal);
        let form = DMat3::from_cols(x.1, y.1, DVec3::ZERO) * steps.inverse();
        (form + form.transpose()) * 0.5
    }

    pub(super) fn at(&self, p: DVec2) -> Spot {
        let share = self.shares(p);
        let (place, normal) = self.surface(p, &share);
        let [mut x, mut y] = self.axis;
        let mut second = [DVec3::ZERO; 3];
        for (s, rise) in self.facet.rise_m.iter().enumerate() {
            let (a, b) = (s, (s + 1) % 3);
            let (da, db) = (self.shares[a].1, self.shares[b].1);
            let rise = *rise * 4.0;
            x += rise * (da.x * share[b] + db.x * share[a]);
            y += rise * (da.y * share[b] + db.y * share[a]);
            second[0] += rise * (2.0 * da.x * db.x);
            second[1] += rise * (2.0 * da.y * db.y);
            second[2] += rise * (da.x * db.y + da.y * db.x);
        }
        let (mut length, mut slope, mut bend) = (0.0, DVec2::ZERO, [0.0; 3]);
        let (mut sum, mut spherical) = (DVec3::ZERO, 0.0);
        for station in self.stations {
            let d = place - station;
            let r = d.length();
            let e = d / r;
            let along = DVec2::new(e.dot(x), e.dot(y));
            length += r;
            slope += along;
            bend[0] += (x.length_squared() - along.x * along.x) / r + e.dot(second[0]);
            bend[1] += (y.length_squared() - along.y * along.y) / r + e.dot(second[1]);
            bend[2] += (x.dot(y) - along.x * along.y) / r + e.dot(second[2]);
            sum += e;
            spherical += 1.0 / r;
        }
        let normal = normal.normalize_or_zero();
        let depth = normal.dot(sum);
        let turn = self.curvature(&share) * depth.abs() + spherical;
        let glance = Glance { across: sum - normal * depth, turn };
        Spot {
            place,
            normal,
            length,
            slope,
            bend,
            stretch: x.cross(y).length(),
            glance,
            spherical,
            sum: sum.length(),
        }
    }

    /// Radians from the place of mirror reflection, if the surface went on as it is curved most.
    #[inline]
    fn phase(&self, at: &Glance) -> f64 {
        self.k * at.across.length_squared() / (2.0 * at.turn)
    }

    /// Weight of a place.
    #[inline]
    fn weight(&self, at: &Glance) -> f64 {
        window(self.phase(at))
    }

    /// Whether the window is shut all over a polygon of which these are the corners.
    fn is_shut(&self, corners: &[Glance], middle: &Glance) -> bool {
        let (mut reach, mut turn) = (0f64, middle.turn);
        for there in corners {
            reach = reach.max(there.across.distance_squared(middle.across));
            turn = turn.max(there.turn);
        }
        let nearest = (middle.across.length() - 1.2 * reach.sqrt()).max(0.0);
        self.k * nearest * nearest >= 2.0 * turn * WINDOW[1]
    }

    fn glances(&self, corners: &[DVec2]) -> [Glance; CAP] {
        let mut glances = [Glance::default(); CAP];
        for (glance, p) in glances.iter_mut().zip(corners) {
            *glance = self.glance(*p);
        }
        glances
    }

    /// What lies about the place of mirror reflection; None when the window leaves nothing of the polygons. The facet is split into
    /// cells whatever is lit of it, and the lit polygons with them, so that what they radiate does not hang on how they were cut.
    pub(super) fn inner(&self, pieces: &[Polygon]) -> Option<Inner> {
        let (mut value, mut area, mut first) = (Complex64::ZERO, 0.0, DVec2::ZERO);
        let mut from = None;
        // The lit polygons of the cells that are left stand one behind the other, those of the last cell last.
        let mut lit: Vec<Polygon> = Vec::with_capacity(2 * pieces.len());
        for piece in pieces {
            let corners = piece.corners();
            let middle = corners.iter().sum::<DVec2>() / corners.len() as f64;
            if !self.is_shut(&self.glances(corners)[..corners.len()], &self.glance(middle)) {
                keep(piece, 0.0, &mut lit);
            }
        }
        let mut cells: Vec<(Polygon, usize, u32)> =
            Polygon::of(&self.corners).into_iter().map(|facet| (facet, lit.len(), 0)).collect();
        let (mut own, mut moments, mut sides) = (Vec::new(), Vec::new(), [Vec::new(), Vec::new()]);
        while let Some((cell, count, depth)) = cells.pop() {
            own.clear();
            own.extend(lit.drain(lit.len() - count..));
            moments.clear();
            moments.extend(own.iter().map(|p: &Polygon| Moments::of(p.corners())));
            let Some(m) = Moments::of_all(&moments) else { continue };
            let corners = cell.corners();
            let whole = Moments::of(corners);
            let middle = self.at(whole.centroid);
            let at = if m.area == whole.area { middle } else { self.at(m.centroid) };
            let (weight, change) = match self.cell(corners, whole.centroid, &middle) {
                Cell::Shut => continue,
                Cell::Split(across) if depth < DEPTH => {
                    for p in &own {
                        // A sliver as narrow as rounding has nothing on one of the two sides.
                        p.split(whole.centroid, across)
                            .iter()
                            .zip(&mut sides)
                            .for_each(|(p, to)| keep(p, 0.0, to));
                    }
                    for (half, of) in cell.split(whole.centroid, across).into_iter().zip(&mut sides) {
                        cells.push((half, of.len(), depth + 1));
                        lit.append(of);
                    }
                    continue;
                }
                Cell::Split(_) => (self.weight(&at.glance), DVec2::ZERO),
                Cell::Seen(weight, change) => (weight + change.dot(m.centroid - whole.centroid), change),
            };
            let from = *from.get_or_insert(at.length);
            let g = at.slope * -self.k;
            let integral = |g: DVec2| -> Complex64 {
                let of = |p: &Polygon| phase_integral(p.mapped(|p| p - m.centroid).corners(), g);
                own.iter().map(of).sum()
            };
            let mut sum = integral(g) * weight;
            if change != DVec2::ZERO {
                // The first moments of the phase are its derivatives by the gradient.
                let step = 1e-3 / m.area.sqrt();
                for (axis, change) in [(DVec2::X, change.x), (DVec2::Y, change.y)] {
                    let [more, less] = [step, -step].map(|s| integral(g + axis * s));
                    sum += Complex64::new(0.0, -change / (2.0 * step)) * (more - less);
                }
            }
            let [xx, yy, xy] = at.bend;
            let length = at.length - from + 0.5 * m.quadratic(DVec2::new(xx, yy), xy);
            value += sum * Complex64::cis(-self.k * length) * at.stretch;
            let weight = weight.max(LEAST) * m.area;
            area += weight;
            first += m.centroid * weight;
        }
        let from = from?;
        let place = first / area;
        let spot = self.at(place);
        let value = value * Complex64::cis(self.k * (spot.length - from));
        let [out, back] = self.ranges(&spot);
        let waves = 1.0 / out + 1.0 / back;
        let holds = if spot.glance.turn < 2.0 * waves { Holds::Mirror } else { Holds::Corner };
        Some(Inner { place, value, holds })
    }

    /// Normal of the surface where both stations are before it; beyond its horizon there is none of use.
    pub(super) fn lit_normal(&self, spot: &Spot) -> Option<DVec3> {
        self.stations.iter().all(|s| (*s - spot.place).dot(spot.normal) > 0.0).then_some(spot.normal)
    }

    /// Distances from source and receiver, m.
    pub(super) fn ranges(&self, spot: &Spot) -> [f64; 2] {
        self.stations.map(|s| s.distance(spot.place))
    }

    /// What a polygon around `middle` is to the window.
    fn cell(&self, corners: &[DVec2], middle: DVec2, at: &Spot) -> Cell {
        let glances = self.glances(corners);
        let glances = &glances[..corners.len()];
        if self.is_shut(glances, &at.glance) {
            return Cell::Shut;
        }
        let (mut worst, mut across) = (FINER * self.tau, None);
        for p in corners {
            let d = *p - middle;
            let bent = at.bent(d);
            let phase = 0.5 * self.k * bent.dot(d).abs();
            if phase > worst {
                (worst, across) = (phase, Some(bent));
            }
        }
        if let Some(across) = across {
            return Cell::Split(across);
        }
        let weight = self.weight(&at.glance);
        let (mut least, mut most) = (weight, weight);
        let mut weights = [0.0; CAP];
        for (w, glance) in weights.iter_mut().zip(glances) {
            *w = self.weight(glance);
            (least, most) = (least.min(*w), most.max(*w));
        }
        if least >= 1.0 - LEAST {
            return Cell::Seen(1.0, DVec2::ZERO);
        }
        // Steps as the cell is shaped, so that they stay within it: a piece of a spoke is a thousand times as long as it is wide.
        let farthest = |off: &dyn Fn(DVec2) -> f64| {
            let ways = corners.iter().map(|p| *p - middle);
            ways.fold(DVec2::ZERO, |best, d| if off(d) > off(best) { d } else { best }) * 0.05
        };
        let long = farthest(&DVec2::length_squared);
        let wide = farthest(&|d| long.perp_dot(d).abs());
        let area = long.perp_dot(wide);
        if area == 0.0 {
            return Cell::Seen(weight, DVec2::ZERO);
        }
        // The vector whose products with the two steps are these.
        let solved = |along: f64, across: f64| (wide.perp() * -along + long.perp() * across) / area;
        let [(by_long, turn_long), (by_wide, turn_wide)] = [long, wide].map(|way| {
            let [a, b] = [way, -way].map(|w| self.glance(middle + w));
            (0.5 * (self.weight(&a) - self.weight(&b)), 0.5 * (a.across - b.across))
        });
        let change = solved(by_long, by_wide);
        let (mut farthest, mut across) = (LINEAR, None);
        for (p, w) in corners.iter().zip(weights) {
            let d = *p - middle;
            let off = (w - weight - change.dot(d)).abs();
            if off > farthest {
                // Along what the weight goes by, which is how the path changes along the surface.
                let turned = turn_long * (d.perp_dot(wide) / area) + turn_wide * (long.perp_dot(d) / area);
                let way = solved(turn_long.dot(turned), turn_wide.dot(turned));
                (farthest, across) = (off, Some(if way == DVec2::ZERO { d } else { way }));
            }
        }
        match across {
            Some(across) => Cell::Split(across),
            None if most <= LEAST => Cell::Shut,
            None => Cell::Seen(weight, change),
        }
    }

    /// The crease on which a side of a lit polygon lies, and the shares of its way along it where the side begins and ends.
    pub(super) fn crease(&self, [a, b]: [DVec2; 2], near_m: f64) -> Option<(&Crease, [f64; 2])> {
        let off = |corner: usize, p: DVec2| {
            let (first, grow) = self.shares[corner];
            (first + grow.dot(p)).abs() / grow.length()
        };
        // The side from corner s on lies across from the corner before it.
        let mut sides = self.facet.creases.iter().enumerate();
        sides.find_map(|(s, crease)| {
            let (crease, across) = (crease.as_ref()?, (s + 2) % 3);
            let is_on = off(across, a) <= near_m && off(across, b) <= near_m;
            is_on.then(|| (crease, [a, b].map(|p| self.shares(p)[(s + 1) % 3])))
        })
    }

    /// Whether any side is a crease.
    pub(super) fn has_crease(&self) -> bool {
        self.facet.creases.iter().any(Option::is_some)
    }

    /// The waves of a side along a crease (inside on the left) which runs `along` it: those about the place where the crease's own
    /// path stands still, and those of its corners; of both what the window about the place of mirror reflection does not hold.
    pub(super) fn edge(
        &self,
        [a, b]: [DVec2; 2],
        crease: &Crease,
        along: [f64; 2],
        mut emit: impl FnMut(Inner),
    ) {
        let length = a.distance(b);
        if length == 0.0 {
            return;
        }
        let way = (b - a) / length;
        let outward = -way.perp();
        let edge = |t: f64| {
            let spot = self.at(a + way * (t * length));
            let share = along[0] + (along[1] - along[0]) * t;
            let [p, q] = crease.curvature_per_m;
            let turn = (p + (q - p) * share).max(0.0) * spot.sum + spot.spherical;
            let slope = way.dot(spot.slope);
            let kernel = (1.0 - self.weight(&spot.glance)) * spot.stretch * outward.dot(spot.slope)
                / spot.slope.length_squared();
            EdgeSpot { t, slope, turn, kernel, length: spot.length }
        };
        let weight = |at: &EdgeSpot| window(self.k * at.slope * at.slope / (2.0 * at.turn));
        let flux = Complex64::new(0.0, 1.0 / self.k);
        let ends = [edge(0.0), edge(1.0)];
        for (end, (place, sign)) in ends.iter().zip([(a, -1.0), (b, 1.0)]) {
            let share = if sign < 0.0 { along[0] } else { along[1] };
            let corner = (share < AT_END && crease.corners[0]) || (share > 1.0 - AT_END && crease.corners[1]);
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
        let facet = CurvedFacet { normals, rise_m, curvature_per_m: [1.0 / radius; 3], creases: [None; 3] };
        let x = (corners[1] - corners[0]).normalize();
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        let axis = [x, normal.cross(x)];
        let stations = [DVec3::new(0.6, 0.5, 8.0); 2];
        let k = TAU * 77e9 / 299_792_458.0;
        let curved = Curved::new((&facet, &corners, axis), 1.0, stations, (k, 0.3));
        let whole = Polygon::of(&curved.corners)[0];
        work(&curved, whole)
    }

    /// What a lit part radiates does not hang on how it was cut.
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
                assert!(off < 1e-7 && a.place.distance(b.place) < 1e-9, "{} pieces: {off:e}", pieces.len());
            }
        });
    }
}
