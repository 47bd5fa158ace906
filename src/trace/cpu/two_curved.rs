//! Paths that two curved surfaces reflect, one after the other (CONVENTIONS eq. 58b).
//!
//! From each facet that the radar may light a narrow cone of rays goes on. The tree of faces is searched for facets in that cone that send
//! a ray back to the radar: their normals bisect the angle between the way that comes and the way that leaves, and each box of the tree
//! holds the cone of all normals in it. Newton's method then closes the path: on both surfaces the sum of the unit vectors along both ways
//! is normal to the surface. The level is that of geometric optics, by the curvature of the wave's front, and the motion is that of the
//! path, which is closed again at the start and at the end of the frame.

use super::bend::Bends;
use super::curved::Curved;
use super::field::{Bounce, CVec, sent};
use super::front::Front;
use crate::base::frames::{Pose, Sensor, World};
use crate::base::tasks::Tasks;
use crate::base::units::wavenumber;
use crate::geom::faces::{Face, Faces};
use crate::geom::{Body, Geometry, Shift};
use crate::trace::beams::Frame;
use crate::trace::{Echo, MAX_BOUNCES, TraceOptions};
use glam::{DMat3, DMat4, DVec2, DVec3, DVec4};
use rayon::prelude::*;

/// Cones are searched wider than their corners' rays by this share and angle, rad.
const WIDER: f64 = 1.3;
const MARGIN_RAD: f64 = 0.01;
/// Steps of Newton's method, and the length of the last one as a share of a facet.
const STEPS: usize = 12;
const CLOSED: f64 = 1e-9;
/// Steps from which on a path far off its facets, by the shares of their corners, is given up.
const SHORT_FROM: usize = 2;
const FAR_OFF: f64 = -0.5;
/// The same at the ends of a frame, to which specular points slide.
const SLID_OFF: f64 = -4.0;
/// Shares of corners above this count as on the facet.
const ON_FACET: f64 = -1e-7;
/// Ends of a way this far from a surface do not count as hidden by it, m: facets are chords.
const GAP_M: f64 = 0.02;
/// A path is left out for its level at the middles of its facets where that is this many times too weak, and not near grazing, by the cosine.
const SURE: f64 = 4.0;
const STEEP: f64 = 0.1;
/// Where a facet is looked at near its corners, as a share of the way from its middle.
const NEAR_CORNER: f64 = 0.7;
/// Places nearer than this are one, m.
const SAME_M: f64 = 1e-6;

/// Normals, on the side of the radar, of what it sees in a box of the tree.
#[derive(Debug, Clone, Copy)]
struct Cone {
    axis: DVec3,
    half_rad: f64,
}

impl Cone {
    fn merged(a: Option<Cone>, b: Option<Cone>) -> Option<Cone> {
        let (a, b) = match (a, b) {
            (Some(a), Some(b)) => (a, b),
            (a, b) => return a.or(b),
        };
        let axis = (a.axis + b.axis).normalize_or_zero();
        let reach = |c: &Cone| angle(axis, c.axis) + c.half_rad;
        let half_rad = if axis == DVec3::ZERO { std::f64::consts::PI } else { reach(&a).max(reach(&b)) };
        Some(Cone { axis, half_rad })
    }
}

/// A facet that the radar sees.
#[derive(Debug, Clone, Copy)]
struct Seen {
    /// 1 where it sees the front, else -1.
    sign: f64,
    centre: DVec3,
    radius: f64,
    cone: Cone,
}

fn angle(a: DVec3, b: DVec3) -> f64 {
    a.dot(b).clamp(-1.0, 1.0).acos()
}

/// Half the angle under which a sphere is seen.
fn half_angle(radius: f64, distance: f64) -> f64 {
    if distance <= radius { std::f64::consts::PI } else { (radius / distance).asin() }
}

/// A path over two facets at one time.
struct Closed {
    /// Coordinates on the two facets.
    at: DVec4,
    places: [DVec3; 2],
    normals: [DVec3; 2],
    length_m: f64,
}

struct Seeker<'a> {
    geometry: &'a Geometry,
    faces: &'a Faces,
    /// By face; None of what is flat or not seen.
    seen: Vec<Option<Seen>>,
    /// By node of the tree.
    cones: Vec<Option<Cone>>,
    windows: &'a [Frame],
    pose: &'a Pose<Sensor, World>,
    velocity_mps: DVec3,
    bends: &'a Bends,
    options: &'a TraceOptions,
}

/// Echoes of all paths over two curved surfaces that begin and end in the radar's `windows`.
pub(super) fn echoes(
    geometry: &Geometry,
    windows: &[Frame],
    pose: &Pose<Sensor, World>,
    velocity_mps: DVec3,
    bends: &Bends,
    options: &TraceOptions,
) -> Vec<Echo> {
    let faces = geometry.faces();
    if faces.curved.is_empty() || options.bounces < 2 {
        return Vec::new();
    }
    let (seen, cones) = (Vec::new(), Vec::new());
    let mut seeker = Seeker { geometry, faces, seen, cones, windows, pose, velocity_mps, bends, options };
    seeker.seen = faces.faces.par_iter().map(|f| seeker.seen(f)).collect();
    seeker.cones = cones_of(faces, &seeker.seen);
    let curved: Vec<u32> =
        (0..faces.faces.len() as u32).filter(|f| seeker.seen[*f as usize].is_some()).collect();
    let found: Vec<Vec<(Echo, [DVec3; 2])>> =
        curved.par_chunks(64).map_tasks(|some| some.iter().flat_map(|f| seeker.from(*f)).collect()).collect();
    // A path through a side that two facets share is found on both.
    let mut list: Vec<(Echo, [DVec3; 2])> = Vec::new();
    for (echo, places) in found.into_iter().flatten() {
        let same = |other: &(Echo, [DVec3; 2])| {
            other.0.chain == echo.chain && (0..2).all(|i| other.1[i].distance(places[i]) < SAME_M)
        };
        if !list.iter().any(same) {
            list.push((echo, places));
        }
    }
    list.into_iter().map(|(echo, _)| echo).collect()
}

/// The normals of what is seen in each box of the tree; None where nothing is.
fn cones_of(faces: &Faces, seen: &[Option<Seen>]) -> Vec<Option<Cone>> {
    let mut cones = vec![None; faces.nodes.len()];
    let mut order = Vec::with_capacity(faces.nodes.len());
    let mut stack = if faces.nodes.is_empty() { Vec::new() } else { vec![0usize] };
    while let Some(i) = stack.pop() {
        order.push(i);
        let node = &faces.nodes[i];
        if node.count == 0 {
            stack.extend([node.first as usize, node.first as usize + 1]);
        }
    }
    for i in order.into_iter().rev() {
        let node = &faces.nodes[i];
        cones[i] = match node.count {
            0 => Cone::merged(cones[node.first as usize], cones[node.first as usize + 1]),
            count => (node.first..node.first + count)
                .map(|f| seen[f as usize].map(|s| s.cone))
                .fold(None, Cone::merged),
        };
    }
    cones
}

/// Rays that leave a facet.
struct Bundle {
    corners: [DVec3; 3],
    /// On the lit side.
    normals: [DVec3; 3],
    centre: DVec3,
    radius: f64,
    /// Mean of the normals, and how far they turn from it, rad.
    normal: DVec3,
    turns: f64,
    /// Mean of the rays, and how far they turn from it, rad.
    axis: DVec3,
    half_rad: f64,
}

impl Seeker<'_> {
    fn radar(&self) -> DVec3 {
        self.pose.translation_m
    }

    fn in_window(&self, d: DVec3) -> bool {
        self.windows.iter().any(|w| w.k.dot(d) > 0.0 && w.project(w.origin + d).abs().max_element() <= 1.0)
    }

    fn is_clear(&self, a: DVec3, b: DVec3) -> bool {
        a.distance(b) <= 2.0 * GAP_M || !self.faces.is_between(a, b, GAP_M.max(self.geometry.t_min_m))
    }

    /// A facet of a curved surface, if the radar sees its middle or a place near one of its corners.
    fn seen(&self, face: &Face) -> Option<Seen> {
        let facet = self.faces.curved.get(face.curved as usize)?;
        let front = face.normal.dot(self.radar()) > face.offset_m;
        if face.one_sided && !front {
            return None;
        }
        let corners = self.faces.corners(face);
        let centre = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let radius = corners.iter().map(|p| p.distance(centre)).fold(0.0, f64::max);
        if self.radar().distance(centre) - radius > self.options.reach_m {
            return None;
        }
        let is_seen = |p: DVec3| self.in_window(p - self.radar()) && self.is_clear(self.radar(), p);
        let near = corners.iter().map(|p| centre + (*p - centre) * NEAR_CORNER);
        if !std::iter::once(centre).chain(near).any(is_seen) {
            return None;
        }
        let sign = if front { 1.0 } else { -1.0 };
        let axis = facet.normals.iter().sum::<DVec3>().normalize_or_zero() * sign;
        let half_rad = facet.normals.iter().map(|n| angle(*n * sign, axis)).fold(0.0, f64::max);
        Some(Seen { sign, centre, radius, cone: Cone { axis, half_rad } })
    }

    /// Paths that meet this facet first.
    fn from(&self, f: u32) -> Vec<(Echo, [DVec3; 2])> {
        let faces = self.faces;
        let face = &faces.faces[f as usize];
        let corners = faces.corners(face);
        let (Some(facet), Some(own)) = (faces.curved.get(face.curved as usize), self.seen[f as usize]) else {
            return Vec::new();
        };
        let Seen { sign, centre, .. } = own;
        let rays = [0, 1, 2].map(|i| {
            let (d, n) = ((corners[i] - self.radar()).normalize_or_zero(), facet.normals[i]);
            d - n * (2.0 * n.dot(d))
        });
        let axis = rays.iter().sum::<DVec3>().normalize_or_zero();
        let half = rays.iter().map(|r| angle(*r, axis)).fold(0.0, f64::max);
        let bundle = Bundle {
            corners: [corners[0], corners[1], corners[2]],
            normals: facet.normals.map(|n| n * sign),
            centre,
            radius: own.radius,
            normal: own.cone.axis,
            turns: own.cone.half_rad,
            axis,
            half_rad: WIDER * half + MARGIN_RAD,
        };
        let mut found = Vec::new();
        let mut stack = vec![0usize];
        while let Some(i) = stack.pop() {
            let (node, Some(cone)) = (&faces.nodes[i], &self.cones[i]) else { continue };
            let radius = node.half.length();
            if !self.may_return(&bundle, node.centre, radius, cone) {
                continue;
            }
            if node.count == 0 {
                stack.extend([node.first as usize, node.first as usize + 1]);
                continue;
            }
            for g in node.first..node.first + node.count {
                // The other way round it is the same path.
                if g > f
                    && self.facet_may_return(&bundle, g)
                    && let Some((echo, places)) = self.echo([f, g])
                {
                    let back = echo.reversed();
                    found.extend([(echo, places), (back, [places[1], places[0]])]);
                }
            }
        }
        found
    }

    fn facet_may_return(&self, from: &Bundle, g: u32) -> bool {
        let Some(seen) = self.seen[g as usize] else { return false };
        if !self.may_return(from, seen.centre, seen.radius, &seen.cone)
            || !self.face_each_other(from, &self.faces.faces[g as usize])
        {
            return false;
        }
        // At both middles the sum of the unit vectors is normal but for what changes over the facets.
        let (way, back) = (seen.centre - from.centre, seen.centre - self.radar());
        let (way_m, back_m) = (way.length(), back.length());
        let there = from.centre - self.radar();
        let there_m = there.length();
        let across = |sum: DVec3, n: DVec3| (sum - n * n.dot(sum)).length();
        let (e, out, home) = (way / way_m, there / there_m, back / back_m);
        let between = (from.radius + seen.radius) / way_m;
        across(out - e, from.normal) <= WIDER * (2.0 * from.turns + from.radius / there_m + between)
            && across(e + home, seen.cone.axis)
                <= WIDER * (2.0 * seen.cone.half_rad + seen.radius / back_m + between)
    }

    /// Whether a place of one facet is before the other, and the other way round: on a convex surface none is.
    fn face_each_other(&self, from: &Bundle, face: &Face) -> bool {
        let Some(facet) = self.faces.curved.get(face.curved as usize) else { return false };
        let sign = if face.normal.dot(self.radar()) > face.offset_m { 1.0 } else { -1.0 };
        let (mut there, mut back) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
        for (p, n) in from.corners.iter().zip(&from.normals) {
            for (q, m) in self.faces.corners(face).iter().zip(&facet.normals) {
                there = there.max(n.dot(*q - *p));
                back = back.max(sign * m.dot(*p - *q));
            }
        }
        there > SAME_M && back > SAME_M
    }

    /// Whether a ray of a bundle may meet what is in a sphere and go back to the radar.
    fn may_return(&self, from: &Bundle, centre: DVec3, radius: f64, cone: &Cone) -> bool {
        let height = |(p, n): (&DVec3, &DVec3)| n.dot(centre - *p);
        if from.corners.iter().zip(&from.normals).map(height).fold(f64::NEG_INFINITY, f64::max) + radius
            <= 0.0
        {
            return false;
        }
        let (way, back) = (centre - from.centre, self.radar() - centre);
        let (way_m, back_m) = (way.length(), back.length());
        let seen_rad = half_angle(radius + from.radius, way_m);
        if seen_rad >= std::f64::consts::FRAC_PI_2 {
            return true;
        }
        if angle(way / way_m, from.axis) > from.half_rad + seen_rad {
            return false;
        }
        let off = seen_rad + half_angle(radius, back_m);
        let bisector = back / back_m - way / way_m;
        let length = bisector.length();
        // Of a sum of two unit vectors.
        let reach = cone.half_rad * WIDER + MARGIN_RAD + off / length.max(0.05);
        if reach >= std::f64::consts::FRAC_PI_2 {
            return true;
        }
        angle(bisector / length, cone.axis) <= reach
    }

    fn facet(&self, f: u32, sign: f64) -> Option<Curved<'_>> {
        let face = &self.faces.faces[f as usize];
        let facet = self.faces.curved.get(face.curved as usize)?;
        let surface = (facet, self.faces.corners(face), face.axis);
        Some(Curved::new(surface, sign, [self.radar(); 2], (1.0, 1.0)))
    }

    fn body(&self, f: u32) -> &Body {
        &self.geometry.bodies[self.faces.faces[f as usize].body as usize]
    }

    /// Closes a path from a radar over two facets that have moved, from coordinates on them; None where it leaves a facet with a corner's share
    /// below `far_off`.
    fn close(
        &self,
        facets: &[Curved<'_>; 2],
        radar: DVec3,
        shifts: [&Shift; 2],
        (start, far_off): (DVec4, f64),
    ) -> Option<Closed> {
        let sizes = [facets[0].size(), facets[1].size()];
        let at = |i: usize, x: DVec2| {
            let (place, normal) = facets[i].position_and_normal(x);
            (shifts[i].place(place), shifts[i].direction(normal))
        };
        let axes = [0, 1].map(|i| facets[i].axes().map(|a| shifts[i].direction(a)));
        let off = |x: DVec4| {
            let ((p, n), (q, m)) = (at(0, x.truncate().truncate()), at(1, DVec2::new(x.z, x.w)));
            let across = |a: DVec3, b: DVec3, n: DVec3| {
                let sum = a.normalize() + b.normalize();
                sum - n * n.dot(sum)
            };
            let (on_p, on_q) = (across(p - radar, p - q, n), across(q - p, q - radar, m));
            DVec4::new(on_p.dot(axes[0][0]), on_p.dot(axes[0][1]), on_q.dot(axes[1][0]), on_q.dot(axes[1][1]))
        };
        let scale = DVec4::new(sizes[0], sizes[0], sizes[1], sizes[1]);
        let mut x = start;
        for step in 0..STEPS {
            let here = off(x);
            let h = scale * 1e-7;
            let column = |i: usize| {
                let mut moved = DVec4::ZERO;
                moved[i] = h[i];
                (off(x + moved) - here) / h[i]
            };
            let jacobian = DMat4::from_cols(column(0), column(1), column(2), column(3));
            if jacobian.determinant() == 0.0 {
                return None;
            }
            let change = jacobian.inverse() * -here;
            let longest = (change / scale).abs().max_element();
            if !longest.is_finite() {
                return None;
            }
            x += change / longest.max(1.0);
            // What has left its facet by more than half of it, where steps are short already, does not come back.
            if step >= SHORT_FROM
                && (0..2).any(|i| facets[i].least_share(DVec2::new(x[2 * i], x[2 * i + 1])) < far_off)
            {
                return None;
            }
            if longest < CLOSED {
                let ((p, n), (q, m)) = (at(0, x.truncate().truncate()), at(1, DVec2::new(x.z, x.w)));
                let length_m = p.distance(radar) + q.distance(p) + q.distance(radar);
                return Some(Closed { at: x, places: [p, q], normals: [n, m], length_m });
            }
        }
        None
    }

    /// Whether a path over the middles of two facets would be strong enough to be kept, or whether it would is not certain.
    fn counts(&self, of: [u32; 2]) -> bool {
        let [Some(p), Some(q)] = of.map(|f| self.seen[f as usize]) else { return false };
        let ways = [p.centre - self.radar(), q.centre - p.centre, self.radar() - q.centre];
        let lengths = ways.map(DVec3::length);
        let [out, between, back] = [0, 1, 2].map(|i: usize| ways[i] / lengths[i]);
        let mut front = Front::from_point(out, lengths[0]);
        for (seen, f, way, length) in [(p, of[0], between, lengths[1]), (q, of[1], back, lengths[2])] {
            let shape = self.faces.shapes.get(self.faces.faces[f as usize].shape as usize);
            let Some(shape) = shape.filter(|_| way.dot(seen.cone.axis) > STEEP) else { return true };
            front.reflect(seen.cone.axis, way, Some(*shape * seen.sign));
            front.advance(length, self.narrowest(length));
        }
        SURE / (lengths[0] * front.wider().sqrt()) >= self.options.least
    }

    /// Share of its width at which diffraction keeps a tube over so long a way: that of its first Fresnel zone at a line of focus.
    fn narrowest(&self, length_m: f64) -> f64 {
        (1.0 / (wavenumber(self.geometry.freq_hz) * length_m)).sqrt()
    }

    /// The echo of the path over two facets; None where there is none.
    fn echo(&self, [f, g]: [u32; 2]) -> Option<(Echo, [DVec3; 2])> {
        if !self.counts([f, g]) {
            return None;
        }
        let radar = self.radar();
        let facets =
            [self.facet(f, self.seen[f as usize]?.sign)?, self.facet(g, self.seen[g as usize]?.sign)?];
        let middle = [0, 1].map(|i: usize| facets[i].middle());
        let start = DVec4::new(middle[0].x, middle[0].y, middle[1].x, middle[1].y);
        let closed = self.close(&facets, radar, [&Shift::NONE; 2], (start, FAR_OFF))?;
        let [on_first, on_second] = [0, 1].map(|i: usize| DVec2::new(closed.at[2 * i], closed.at[2 * i + 1]));
        if facets[0].least_share(on_first) < ON_FACET || facets[1].least_share(on_second) < ON_FACET {
            return None;
        }
        let ([p, q], [n, m]) = (closed.places, closed.normals);
        let (out, between, back) = (p - radar, q - p, radar - q);
        let lights = out.dot(n) < 0.0 && between.dot(n) > 0.0 && between.dot(m) < 0.0 && back.dot(m) > 0.0;
        if !lights
            || 0.5 * closed.length_m > self.options.reach_m
            || !self.in_window(out)
            || !self.in_window(-back)
        {
            return None;
        }
        if !self.is_clear(radar, p) || !self.is_clear(p, q) || !self.is_clear(q, radar) {
            return None;
        }
        let shapes = [facets[0].shape(on_first), facets[1].shape(on_second)];
        Some((self.completed([f, g], &facets, &closed, shapes), closed.places))
    }

    fn completed(&self, of: [u32; 2], facets: &[Curved<'_>; 2], closed: &Closed, shapes: [DMat3; 2]) -> Echo {
        let (geometry, radar) = (self.geometry, self.radar());
        let k = wavenumber(geometry.freq_hz);
        let ([p, q], [n, m]) = (closed.places, closed.normals);
        let ways = [p - radar, q - p, radar - q];
        let lengths = ways.map(DVec3::length);
        let [out, between, back] = [0, 1, 2].map(|i: usize| ways[i] / lengths[i]);
        let mut front = Front::from_point(out, lengths[0]);
        for (way, normal, shape, length) in
            [(between, n, shapes[0], lengths[1]), (back, m, shapes[1], lengths[2])]
        {
            front.reflect(normal, way, Some(shape));
            front.advance(length, self.narrowest(length));
        }
        let level = front.turn() / (lengths[0] * front.wider().sqrt());
        let surface = |f: u32| &geometry.surfaces[self.faces.faces[f as usize].surface as usize];
        let first = Bounce::new(sent(self.pose, out), out, n, surface(of[0]), k).reflected;
        let field = Bounce::new(first, between, m, surface(of[1]), k).reflected;
        let by = sent(self.pose, -back);
        let gain = |rx: usize, tx: usize| {
            let (e, v): (&CVec, &CVec) = (&field[tx], &by[rx]);
            e.times(v) * level
        };
        let bodies = of.map(|f| self.body(f));
        let rate = -self.velocity_mps.dot(out - back)
            + bodies[0].velocity_at(p).dot(out - between)
            + bodies[1].velocity_at(q).dot(between - back);
        let to_sensor = self.pose.rotation.inverse();
        let mut chain = [0; MAX_BOUNCES];
        chain[..2].copy_from_slice(&bodies.map(|b| b.id));
        let mut echo = Echo {
            path_length_m: closed.length_m,
            path_rate_mps: rate,
            path_acceleration_and_jerk: [0.0; 2],
            departure: to_sensor * out,
            first_range_m: lengths[0],
            first_velocity_mps: DVec3::ZERO,
            arrival: to_sensor * -back,
            last_range_m: lengths[2],
            last_velocity_mps: DVec3::ZERO,
            path_gain: [[gain(0, 0), gain(0, 1)], [gain(1, 0), gain(1, 1)]],
            chain,
            bounces: 2,
            between_m: Box::default(),
        };
        let moved = [0, 1].map(|end: usize| {
            let shifts = [&bodies[0].shifts[end], &bodies[1].shifts[end]];
            let radar = self.bends.radar_at_end(end);
            let closed = self.close(facets, radar, shifts, (closed.at, SLID_OFF));
            let places = match closed {
                Some(closed) => closed.places,
                // A specular point that has slid off its facets: to first order its length is that over the same places of the bodies.
                None => [0, 1].map(|i: usize| shifts[i].place([p, q][i])),
            };
            let [p, q] = places;
            (p.distance(radar) + q.distance(p) + q.distance(radar), places.map(|p| p - radar))
        });
        if self.bends.reach_s() > 0.0 {
            let [(before, from), (after, to)] = moved;
            let t = self.bends.reach_s();
            echo.path_acceleration_and_jerk = [
                (before + after - 2.0 * closed.length_m) / (t * t),
                3.0 * (after - before - 2.0 * rate * t) / (t * t * t),
            ];
            let seen = [p - radar, q - radar];
            let velocity = |i: usize| {
                to_sensor * ((to[i] - from[i]) / (2.0 * t) - self.bends.spin_rad_per_s().cross(seen[i]))
            };
            (echo.first_velocity_mps, echo.last_velocity_mps) = (velocity(0), velocity(1));
        }
        echo
    }
}
