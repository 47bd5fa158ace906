//! Diffuse echoes of rough surfaces in a frame: scatterers that belong to places of the surface
//! (CONVENTIONS eq. 27, 64, 148-150).
//!
//! A surface is covered by squares of 2^n m, smaller where the radar is near. Each holds one scatterer, whose place
//! and complex amplitude are drawn from the square's own coordinates on the body, so that they are the same in all frames and
//! for all radars, and echoes change as the paths do.

use super::beams::{Clipped, Polygon};
use super::bend::{Bends, End, PathEnd};
use crate::base::frames::{Pose, Sensor, World, polarisation_basis};
use crate::base::rng::philox4x32_10;
use crate::base::tasks::Tasks;
use crate::base::units::wavenumber;
use crate::em::aperture::Moments;
use crate::geom::{Body, Geometry};
use crate::trace::{Echo, MAX_BOUNCES, TraceOptions};
use glam::{DVec2, DVec3};
use num_complex::Complex64;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// Squares with a half diagonal larger than this share of their distance are quartered, whatever their weight.
const LARGEST: f64 = 0.3;
/// Binary logarithm of the side of the smallest square, m.
const FINEST: i32 = -10;
/// Binary logarithm of the side of the largest square, m.
const COARSEST: i32 = 20;
/// Word of the random counter that tells these draws from those of the noise.
const STREAM: u32 = 0x5eed_d1ff;

/// Echoes of the rough surfaces that the radar sees at first hand, from about `options.rays` squares.
/// Each square takes about as much area over squared distance, so that every octave of range has as many.
pub fn echoes(
    geometry: &Geometry,
    clipped: &Clipped,
    pose: &Pose<Sensor, World>,
    velocity_mps: DVec3,
    options: &TraceOptions,
) -> Vec<Echo> {
    let Some(share) = share(geometry, clipped, pose, options.rays) else { return Vec::new() };
    let bends = Bends::new(geometry, pose.translation_m, velocity_mps, options);
    let scatterer = Scatterer { geometry, pose, velocity_mps, bends };
    let lists: Vec<Vec<Echo>> = lit(geometry, clipped)
        .par_iter()
        .map_tasks(|(polygon, surface)| {
            let mut own = Vec::new();
            surface.cover(polygon, pose.translation_m, share, |square, area_m2| {
                let (p, draws) = surface.scatterer(square, options.seed);
                if is_inside(polygon, p) {
                    own.extend(scatterer.echo(surface, surface.world(p), area_m2, &draws));
                }
            });
            own
        })
        .collect();
    lists.into_iter().flatten().collect()
}

/// Area over squared distance of a square from which on it is quartered: a power of two, so that it stays the same over many
/// frames. None where nothing is rough.
fn share(geometry: &Geometry, clipped: &Clipped, pose: &Pose<Sensor, World>, rays: u64) -> Option<f64> {
    let faces = geometry.faces();
    let total: f64 = clipped
        .every
        .iter()
        .map(|piece| {
            let node = &clipped.nodes[piece.node as usize];
            let face = &faces.faces[node.face as usize];
            if node.bounce > 1 || !geometry.surfaces[face.surface as usize].is_rough() {
                return 0.0;
            }
            let corner = faces.corners[face.first as usize] - pose.translation_m;
            weight(piece.polygon, |p| (corner + face.axis[0] * p.x + face.axis[1] * p.y).length())
        })
        .sum();
    // Sides are powers of two: a square has between a quarter of the share and all of it, and there are 3 / ln 4 as many.
    const FILLED: f64 = 2.164;
    (total > 0.0 && rays > 0).then(|| (FILLED * total / rays as f64).log2().round().exp2())
}

/// Integral of 1 / distance^2 over a polygon.
fn weight(polygon: Polygon, distance: impl Fn(DVec2) -> f64) -> f64 {
    let mut sum = 0.0;
    let mut stack = vec![polygon];
    while let Some(polygon) = stack.pop() {
        let m = Moments::of(polygon.corners());
        if m.area == 0.0 {
            continue;
        }
        let r = distance(m.centroid);
        let from_centre = polygon.corners().iter().map(|p| *p - m.centroid);
        let Some(far) = from_centre.max_by(|a, b| a.length_squared().total_cmp(&b.length_squared())) else {
            continue;
        };
        if far.length() > LARGEST * r {
            stack.extend(polygon.split(m.centroid, far));
        } else {
            sum += m.area / (r * r);
        }
    }
    sum
}

/// A face as its body's own grid sees it: its plane over the two axes of the body that it is most nearly parallel to.
struct Patch<'a> {
    body: &'a Body,
    surface: u32,
    /// Towards the radar, world.
    normal: DVec3,
    /// Body's axis that the grid looks along, then the grid's two.
    axes: [usize; 3],
    /// n . p = offset in the body's frame.
    plane: (DVec3, f64),
}

/// Lit pieces of rough faces, as polygons on their grids.
fn lit<'a>(geometry: &'a Geometry, clipped: &Clipped) -> Vec<(Polygon, Patch<'a>)> {
    let faces = geometry.faces();
    let mut list = Vec::new();
    for piece in &clipped.every {
        let node = &clipped.nodes[piece.node as usize];
        let face = &faces.faces[node.face as usize];
        if node.bounce > 1 || !geometry.surfaces[face.surface as usize].is_rough() {
            continue;
        }
        let body = &geometry.bodies[face.body as usize];
        let back = body.rotation.inverse();
        let n = back * face.normal;
        let corner = faces.corners[face.first as usize];
        let size = n.abs();
        // A tie goes to z, then y, so that rounding does not turn the grid of a slope from frame to frame.
        let along = if size.z >= size.y - 1e-9 && size.z >= size.x - 1e-9 {
            2
        } else if size.y >= size.x - 1e-9 {
            1
        } else {
            0
        };
        let patch = Patch {
            body,
            surface: face.surface,
            normal: node.normal,
            axes: [along, (along + 1) % 3, (along + 2) % 3],
            plane: (n, n.dot(back * (corner - body.origin_m))),
        };
        let polygon = piece.polygon.mapped(|p| {
            let own = back * (corner + face.axis[0] * p.x + face.axis[1] * p.y - body.origin_m);
            DVec2::new(own[patch.axes[1]], own[patch.axes[2]])
        });
        list.push((polygon, patch));
    }
    list
}

/// [i, i + 1] x [j, j + 1] times 2^level m.
#[derive(Clone, Copy)]
struct Square {
    level: i32,
    i: i64,
    j: i64,
}

impl Square {
    fn side(self) -> f64 {
        f64::from(self.level).exp2()
    }
    fn low(self) -> DVec2 {
        DVec2::new(self.i as f64, self.j as f64) * self.side()
    }
    fn quarter(self, which: u32) -> Square {
        let (right, up) = (i64::from(which & 1), i64::from(which >> 1));
        Square { level: self.level - 1, i: 2 * self.i + right, j: 2 * self.j + up }
    }
}

impl Patch<'_> {
    /// Where a point of the grid lies on the plane.
    fn world(&self, p: DVec2) -> DVec3 {
        let (n, offset) = self.plane;
        let [a, u, v] = self.axes;
        let mut own = DVec3::ZERO;
        own[u] = p.x;
        own[v] = p.y;
        own[a] = (offset - n[u] * p.x - n[v] * p.y) / n[a];
        self.body.origin_m + self.body.rotation * own
    }

    /// Visits the squares of a polygon with the area that each has on the surface.
    fn cover(&self, polygon: &Polygon, radar: DVec3, share: f64, mut visit: impl FnMut(Square, f64)) {
        let (lo, hi) = polygon.bounds();
        let extent = (hi - lo).max_element();
        if !(extent > 0.0 && extent.is_finite()) {
            return;
        }
        let level = (extent.log2().ceil() as i32).clamp(FINEST, COARSEST);
        let side = f64::from(level).exp2();
        let stretch = self.plane.0[self.axes[0]].abs().recip();
        let index = |x: f64| (x / side).floor() as i64;
        let mut stack = Vec::new();
        for i in index(lo.x)..=index(hi.x) {
            for j in index(lo.y)..=index(hi.y) {
                stack.push(Square { level, i, j });
            }
        }
        while let Some(square) = stack.pop() {
            let side = square.side();
            let low = square.low();
            if misses(polygon, low, side) {
                continue;
            }
            let r = self.world(low + DVec2::splat(0.5 * side)).distance(radar);
            let area = side * side * stretch;
            let too_large = side * (0.5 * stretch).hypot(0.5) > LARGEST * r || area > share * r * r;
            if too_large && square.level > FINEST {
                stack.extend((0..4).rev().map(|q| square.quarter(q)));
            } else {
                visit(square, area);
            }
        }
    }

    /// Place of a square's scatterer and what its echoes are drawn with. It is that of one of the four quarters, chosen by
    /// chance, down to the smallest squares, so that a quarter of the power stays where a square is quartered.
    fn scatterer(&self, square: Square, seed: u64) -> (DVec2, Draws) {
        let body = self.body.id.wrapping_mul(0x9e37_79b9);
        let key = [seed as u32 ^ body, (seed >> 32) as u32];
        let words = |s: Square, which: u32| {
            let what = (s.level - FINEST) as u32 + 256 * self.axes[0] as u32 + 4096 * which;
            philox4x32_10([s.i as u32, s.j as u32, what, STREAM], key)
        };
        let mut s = square;
        while s.level > FINEST {
            s = s.quarter(words(s, 0)[0] >> 30);
        }
        let uniform = |w: [u32; 4]| w.map(|w| (f64::from(w) + 0.5) / 2f64.powi(32));
        let [a, b, c, d] = uniform(words(s, 1));
        let [e, f, x, y] = uniform(words(s, 2));
        let gaussian = |u: f64, v: f64| Complex64::from_polar((-u.ln()).sqrt(), TAU * v);
        let draws = Draws { vertical: gaussian(a, b), other: gaussian(c, d), across: gaussian(e, f) };
        (s.low() + DVec2::new(x, y) * s.side(), draws)
    }
}

/// Complex Gaussian numbers with a mean square of one: of VV, of the part of HH that has nothing to do with it, of VH.
struct Draws {
    vertical: Complex64,
    other: Complex64,
    across: Complex64,
}

/// Whether a square and a convex polygon have a line between them.
fn misses(polygon: &Polygon, low: DVec2, side: f64) -> bool {
    let (lo, hi) = polygon.bounds();
    let high = low + DVec2::splat(side);
    if lo.x >= high.x || lo.y >= high.y || hi.x <= low.x || hi.y <= low.y {
        return true;
    }
    let turn = polygon.area().signum();
    let corners = [low, DVec2::new(high.x, low.y), high, DVec2::new(low.x, high.y)];
    sides(polygon).any(|(a, b)| corners.iter().all(|p| (b - a).perp_dot(*p - a) * turn < 0.0))
}

fn sides(polygon: &Polygon) -> impl Iterator<Item = (DVec2, DVec2)> {
    let c = polygon.corners();
    (0..c.len()).map(|i| (c[i], c[(i + 1) % c.len()]))
}

fn is_inside(polygon: &Polygon, p: DVec2) -> bool {
    let turn = polygon.area().signum();
    sides(polygon).all(|(a, b)| (b - a).perp_dot(p - a) * turn >= 0.0)
}

struct Scatterer<'a> {
    geometry: &'a Geometry,
    pose: &'a Pose<Sensor, World>,
    velocity_mps: DVec3,
    bends: Bends,
}

impl Scatterer<'_> {
    fn echo(&self, patch: &Patch, place: DVec3, area_m2: f64, draws: &Draws) -> Option<Echo> {
        let d = place - self.pose.translation_m;
        let r = d.length();
        let dir = d / r;
        let cos_i = -dir.dot(patch.normal);
        if cos_i <= 0.0 {
            return None;
        }
        let k = wavenumber(self.geometry.freq_hz);
        let (sigma0, correlation) = self.geometry.surfaces[patch.surface as usize].sigma0(k, cos_i);
        let root = |s: f64| (s * area_m2 / (4.0 * PI)).sqrt() / (r * r);
        let to_sensor = self.pose.rotation.inverse();
        let seen = to_sensor * dir;
        let (v, h) = polarisation_basis(seen);
        let basis = [v, h].map(|e| self.pose.rotation * e);
        // The surface's own V and H, on the sensor's.
        let across = dir.cross(patch.normal).normalize_or(basis[1]);
        let along = across.cross(dir);
        let on = basis.map(|e| [along.dot(e), across.dot(e)]);
        let horizontal =
            draws.vertical * correlation + draws.other * (1.0 - correlation * correlation).sqrt();
        let (vv, hh) = (draws.vertical * root(sigma0.vv), horizontal * root(sigma0.hh));
        let hv = draws.across * root(sigma0.hv);
        let spread = [0, 1].map(|rx| {
            [0, 1].map(|tx| {
                let ([rv, rh], [tv, th]) = (on[rx], on[tx]);
                vv * (rv * tv) + hh * (rh * th) + hv * (rv * th + rh * tv)
            })
        });
        let body = patch.body;
        let mut chain = [0; MAX_BOUNCES];
        chain[0] = body.id;
        let rate = 2.0 * dir.dot(body.velocity_at(place) - self.velocity_mps);
        let end = End { shifts: &body.shifts, place_m: place, keeps: PathEnd::Place };
        let motion = self.bends.of([&[], &[]], end, 2.0 * r, [r; 2], rate);
        let velocity_mps = to_sensor * motion.velocities_mps[0];
        Some(Echo {
            path_length_m: 2.0 * r,
            path_rate_mps: motion.rate_mps,
            path_acceleration_and_jerk: motion.acceleration_and_jerk,
            departure: seen,
            first_range_m: r,
            first_velocity_mps: velocity_mps,
            arrival: seen,
            last_range_m: r,
            last_velocity_mps: velocity_mps,
            path_gain: spread,
            chain,
            bounces: 1,
            between_m: Box::default(),
        })
    }
}
