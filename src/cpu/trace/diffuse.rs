//! Diffuse echoes of rough surfaces in a frame: samples of the lit surface that carry power with random
//! phase (CONVENTIONS eq. 27, 64). A surface that scatters diffusely has no phase to integrate.

use super::beams::{Clipped, Polygon};
use super::bend::{Bends, End, Keeps};
use crate::cpu::rcs::beam_sum::Moments;
use crate::em::roughness::Lobe;
use crate::frames::{Pose, Sensor, World, polarisation_basis};
use crate::geom::Geometry;
use crate::rng::philox4x32_10;
use crate::trace::{MAX_BOUNCES, Return, TraceOptions};
use crate::units::wavenumber;
use glam::{DVec2, DVec3};
use num_complex::Complex64;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// Shape of the lobe: no material says more than its roughness.
const LOBE: Lobe = Lobe::Lambert;
/// Parts larger than this share of their distance are halved before they are weighed.
const LARGEST: f64 = 0.3;
/// Word of the random counter that tells these draws from those of the noise.
const STREAM: u32 = 0x5eed_d1ff;

/// One echo from each of about `options.rays` parts of the rough surfaces that the radar sees at first
/// hand, from a random place in it and with a random phase in each polarisation. Near parts are smaller:
/// each takes its share of area over squared distance, so that every octave of range has as many. The
/// power of co-polar scattering is that of the lobe; none is scattered into the other polarisation.
pub fn returns(
    geometry: &Geometry,
    clipped: &Clipped,
    pose: &Pose<Sensor, World>,
    velocity_mps: DVec3,
    options: &TraceOptions,
) -> Vec<Return> {
    let faces = geometry.faces();
    let rough = |surface: u32| geometry.surfaces[surface as usize].roughness_rms_m > 0.0;
    let radar = pose.translation_m;
    let mut parts: Vec<Part> = Vec::new();
    for piece in &clipped.every {
        let node = &clipped.nodes[piece.node as usize];
        let face = &faces.faces[node.face as usize];
        if node.bounce > 1 || !rough(face.surface) {
            continue;
        }
        let surface = Surface {
            corner: faces.corners[face.first as usize],
            axis: face.axis,
            normal: node.normal,
            face: node.face,
        };
        halve(piece.polygon, &mut parts, &surface, radar, |size, distance, _| size > LARGEST * distance);
    }
    let total: f64 = parts.iter().map(|p| p.weight).sum();
    if total == 0.0 || options.rays == 0 {
        return Vec::new();
    }
    let share = total / options.rays as f64;
    let bends = Bends::new(geometry, radar, velocity_mps, options);
    let scatterer = Scatterer { geometry, pose, velocity_mps, bends, options };
    let lists: Vec<Vec<Return>> = parts
        .par_iter()
        .enumerate()
        .map(|(i, part)| {
            let mut own = Vec::new();
            halve(part.polygon, &mut own, &part.surface, radar, |_, _, weight| weight > share);
            own.iter().enumerate().filter_map(|(j, p)| scatterer.echo(p, [j as u32, i as u32])).collect()
        })
        .collect();
    lists.into_iter().flatten().collect()
}

#[derive(Clone, Copy)]
struct Surface {
    corner: DVec3,
    axis: [DVec3; 2],
    normal: DVec3,
    face: u32,
}

impl Surface {
    fn place(&self, p: DVec2) -> DVec3 {
        self.corner + self.axis[0] * p.x + self.axis[1] * p.y
    }
}

#[derive(Clone, Copy)]
struct Part {
    polygon: Polygon,
    surface: Surface,
    area: f64,
    /// Area over squared distance.
    weight: f64,
}

/// Appends the parts of a polygon, halved across their longest extent while `too_large` (size, distance,
/// weight).
fn halve(
    polygon: Polygon,
    out: &mut Vec<Part>,
    surface: &Surface,
    radar: DVec3,
    too_large: impl Fn(f64, f64, f64) -> bool,
) {
    let mut stack = vec![polygon];
    while let Some(polygon) = stack.pop() {
        let m = Moments::of(polygon.corners());
        if m.area == 0.0 {
            continue;
        }
        let distance = surface.place(m.centroid).distance(radar);
        let from_centre = polygon.corners().iter().map(|p| *p - m.centroid);
        let Some(far) = from_centre.max_by(|a, b| a.length_squared().total_cmp(&b.length_squared())) else {
            continue;
        };
        let weight = m.area / (distance * distance);
        if too_large(far.length(), distance, weight) {
            let [a, b] = polygon.split(m.centroid, far);
            stack.extend([b, a]);
        } else {
            out.push(Part { polygon, surface: *surface, area: m.area, weight });
        }
    }
}

struct Scatterer<'a> {
    geometry: &'a Geometry,
    pose: &'a Pose<Sensor, World>,
    velocity_mps: DVec3,
    bends: Bends,
    options: &'a TraceOptions,
}

impl Scatterer<'_> {
    fn echo(&self, part: &Part, number: [u32; 2]) -> Option<Return> {
        let draws = |k: u32| {
            let counter = [number[0], number[1], self.options.frame, STREAM ^ k];
            let key = [self.options.seed as u32, (self.options.seed >> 32) as u32];
            philox4x32_10(counter, key).map(|w| (w as f64 + 0.5) / 2f64.powi(32))
        };
        let [a, b, c, _] = draws(0);
        let place = part.surface.place(inside(part.polygon.corners(), [a, b, c]));
        let face = &self.geometry.faces().faces[part.surface.face as usize];
        let body = &self.geometry.bodies[face.body as usize];
        let d = place - self.pose.translation_m;
        let r = d.length();
        let dir = d / r;
        let cos_i = -dir.dot(part.surface.normal);
        if cos_i <= 0.0 {
            return None;
        }
        let k = wavenumber(self.geometry.freq_hz);
        let [perp, par] = self.geometry.surfaces[face.surface as usize].diffuse_share(k, cos_i);
        let to_sensor = self.pose.rotation.inverse();
        let seen = to_sensor * dir;
        let (v, h) = polarisation_basis(seen);
        let across = dir.cross(part.surface.normal).normalize_or(self.pose.rotation * h);
        let [x, y, ..] = draws(1);
        let amplitude = |sent: DVec3, phase: f64| {
            let on_perp = (self.pose.rotation * sent).dot(across).powi(2);
            let sigma0 = LOBE.backscatter_sigma0(on_perp * perp + (1.0 - on_perp) * par, cos_i);
            Complex64::from_polar((sigma0 * part.area / (4.0 * PI)).sqrt() / (r * r), TAU * phase)
        };
        let mut chain = [0; MAX_BOUNCES];
        chain[0] = body.id;
        let rate = 2.0 * dir.dot(body.velocity_at(place) - self.velocity_mps);
        let end = End { shifts: &body.shifts, place_m: place, keeps: Keeps::Place };
        let (path_rate_mps, path_bend) = self.bends.of(&[], &[], end, 2.0 * r, rate);
        Some(Return {
            path_length_m: 2.0 * r,
            path_rate_mps,
            path_bend,
            departure: seen,
            first_range_m: r,
            arrival: seen,
            last_range_m: r,
            spread: [[amplitude(v, x), Complex64::ZERO], [Complex64::ZERO, amplitude(h, y)]],
            chain,
            bounces: 1,
        })
    }
}

/// A uniform place in a convex polygon from three uniform numbers.
fn inside(p: &[DVec2], [pick, a, b]: [f64; 3]) -> DVec2 {
    let triangle = |i: usize| (p[i] - p[0]).perp_dot(p[i + 1] - p[0]).abs();
    let all: f64 = (1..p.len() - 1).map(triangle).sum();
    let mut left = pick * all;
    let mut i = 1;
    while i + 2 < p.len() && left > triangle(i) {
        left -= triangle(i);
        i += 1;
    }
    let s = a.sqrt();
    p[0] * (1.0 - s) + p[i] * (s * (1.0 - b)) + p[i + 1] * (s * b)
}
