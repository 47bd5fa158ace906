//! Scattering matrix from exact beams, in f64 (CONVENTIONS eq. 50-54).

use super::refract_sum;
use crate::base::frames::polarisation_basis;
use crate::base::matrix::{Matrix2, add_scaled};
use crate::base::tasks::Tasks;
use crate::em::aperture::{Moments, phase_integral};
use crate::geom::Geometry;
use crate::geom::faces::Faces;
pub use crate::rcs::beam_sum::FrequencyPoint;
use crate::rcs::{BistaticAspect, Distance, Impassable, Scattering};
use crate::trace::MAX_BOUNCES;
use crate::trace::beams::{BeamOptions, Frame, Port};
use crate::trace::cpu::beams::{Clipped, Piece, clip};
use crate::trace::cpu::field::{Bounce, CVec};
use crate::trace::cpu::refract::Media;
use glam::{DVec2, DVec3};
use num_complex::Complex64;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// Cells are at most this share of the distance to the nearer port.
const CELL_TO_DISTANCE: f64 = 0.01;

/// Computes S of the geometry's facets for each aspect and each frequency (`[aspect][frequency]`). The clipping is done
/// once for each aspect.
///
/// # Errors
/// Returns the errors of [`between`].
pub fn by_beams(
    geometry: &Geometry,
    frequencies: &[FrequencyPoint],
    aspects: &[BistaticAspect],
    distance: Distance,
    options: &BeamOptions,
) -> Result<Vec<Vec<Scattering>>, Impassable> {
    aspects
        .par_iter()
        .map_tasks(|aspect| one_aspect(geometry.faces(), frequencies, aspect, distance, options))
        .collect()
}

fn one_aspect(
    faces: &Faces,
    frequencies: &[FrequencyPoint],
    aspect: &BistaticAspect,
    distance: Distance,
    options: &BeamOptions,
) -> Result<Vec<Scattering>, Impassable> {
    if faces.faces.is_empty() {
        return Ok(vec![Scattering::default(); frequencies.len()]);
    }
    let (transmit, receive) = (distance.port(aspect.transmit), distance.port(aspect.receive));
    let mut sums = between(faces, frequencies, transmit, receive, options)?;
    if let Distance::At(r) = distance {
        // E_s = S e^{-jk 2r} / r^2, with the phase of the way to the origin and back taken out.
        sums.iter_mut().for_each(|s| s.scale(r * r));
    }
    Ok(sums)
}

/// Computes S between two ports for each frequency. For a port at a finite place S is divided by the distance to it,
/// and the phase of the way to the world's origin is taken out.
///
/// # Errors
/// Returns `Impassable` where waves pass through something that is no closed body, or through anything when a port
/// stands at a finite place.
pub fn between(
    faces: &Faces,
    frequencies: &[FrequencyPoint],
    transmit: Port,
    receive: Port,
    options: &BeamOptions,
) -> Result<Vec<Scattering>, Impassable> {
    let media: Vec<Option<Media>> =
        frequencies.iter().map(|t| Media::of(faces, t.surfaces, t.wavenumber)).collect();
    if media.iter().any(Option::is_some) {
        return between_passing(faces, frequencies, &media, transmit, receive, options);
    }
    let clipped = clip(faces, transmit, receive, options);
    let sums = frequencies
        .iter()
        .map(|point| {
            let sum = |pieces| match (transmit, receive) {
                (Port::Far(t), Port::Far(s)) => far_sum(faces, &clipped, pieces, point, t, s),
                _ => near_sum(faces, &clipped, pieces, point, transmit, receive, options.tau),
            };
            Scattering { every: sum(&clipped.every), last: sum(&clipped.last) }
        })
        .collect();
    Ok(sums)
}

/// The same where waves pass through something at some of the frequencies.
fn between_passing(
    faces: &Faces,
    frequencies: &[FrequencyPoint],
    media: &[Option<Media>],
    transmit: Port,
    receive: Port,
    options: &BeamOptions,
) -> Result<Vec<Scattering>, Impassable> {
    let mut out = vec![Scattering::default(); frequencies.len()];
    let (Port::Far(t), Port::Far(s)) = (transmit, receive) else { return Err(Impassable::NearPort) };
    for i in 0..frequencies.len() {
        if media[..i].contains(&media[i]) {
            continue;
        }
        let alike: Vec<usize> = (i..frequencies.len()).filter(|j| media[*j] == media[i]).collect();
        let found: Vec<Scattering> = match &media[i] {
            Some(m) => {
                let frequencies: Vec<&FrequencyPoint> = alike.iter().map(|j| &frequencies[*j]).collect();
                refract_sum::between(faces, m, &frequencies, t, s, options)?
            }
            None => {
                let clipped = clip(faces, transmit, receive, options);
                let both = |point: &FrequencyPoint| Scattering {
                    every: far_sum(faces, &clipped, &clipped.every, point, t, s),
                    last: far_sum(faces, &clipped, &clipped.last, point, t, s),
                };
                alike.iter().map(|j| both(&frequencies[*j])).collect()
            }
        };
        alike.into_iter().zip(found).for_each(|(j, s)| out[j] = s);
    }
    Ok(out)
}

/// What each chain of surfaces returns to where the wave came from, in plane waves: the numbers of the surfaces that it meets, and the largest
/// entry of its S, m.
pub fn by_chains(
    faces: &Faces,
    point: &FrequencyPoint,
    port: Port,
    options: &BeamOptions,
) -> Vec<(Vec<u32>, f64)> {
    let Port::Far(s) = port else { return Vec::new() };
    if faces.faces.is_empty() {
        return Vec::new();
    }
    let clipped = clip(faces, port, port, options);
    let chain = |piece: &Piece| {
        let parent = |i: &u32| Some(clipped.nodes[*i as usize].parent).filter(|p| *p != u32::MAX);
        let nodes = std::iter::successors(Some(piece.node), parent);
        nodes.map(|i| faces.faces[clipped.nodes[i as usize].face as usize].surface).collect::<Vec<u32>>()
    };
    let mut of_chain: BTreeMap<Vec<u32>, Vec<Piece>> = BTreeMap::new();
    for piece in &clipped.every {
        of_chain.entry(chain(piece)).or_default().push(*piece);
    }
    let largest = |m: Matrix2| m.iter().flatten().map(|z| z.norm()).fold(0.0, f64::max);
    of_chain
        .into_iter()
        .map(|(chain, pieces)| (chain, largest(far_sum(faces, &clipped, &pieces, point, s, s))))
        .collect()
}

/// What the currents of the first bounce radiate to a receiver behind the faces that carry them, for each frequency: the forward scatter,
/// which casts the shadow. Of one face seen from the front the sum over beams has it; nothing is asked of what stands between, as the
/// equivalent currents of physical optics radiate in empty space.
pub fn behind(
    geometry: &Geometry,
    frequencies: &[FrequencyPoint],
    aspect: &BistaticAspect,
    distance: Distance,
    options: &BeamOptions,
) -> Vec<Scattering> {
    let faces = geometry.faces();
    if faces.faces.is_empty() {
        return vec![Scattering::default(); frequencies.len()];
    }
    let (transmit, receive) = (distance.port(aspect.transmit), distance.port(aspect.receive));
    let lit = clip(faces, transmit, transmit, &BeamOptions { bounces: 1, last: false, ..*options });
    let is_behind = |piece: &&Piece| {
        let node = &lit.nodes[piece.node as usize];
        let face = &faces.faces[node.face as usize];
        let towards = match receive {
            Port::Far(s) => s,
            Port::At(p) => p - faces.corners[face.first as usize],
        };
        node.normal.dot(towards) < 0.0
    };
    let pieces: Vec<Piece> = lit.every.iter().filter(is_behind).copied().collect();
    let one = |point: &FrequencyPoint| {
        let mut s = match (transmit, receive) {
            (Port::Far(t), Port::Far(s)) => far_sum(faces, &lit, &pieces, point, t, s),
            _ => near_sum(faces, &lit, &pieces, point, transmit, receive, options.tau),
        };
        if let Distance::At(r) = distance {
            s.iter_mut().flatten().for_each(|z| *z *= r * r);
        }
        Scattering { every: s, last: s }
    };
    frequencies.iter().map(one).collect()
}

fn far_sum(
    faces: &Faces,
    clipped: &Clipped,
    pieces: &[Piece],
    point: &FrequencyPoint,
    towards: DVec3,
    s: DVec3,
) -> Matrix2 {
    let k = point.wavenumber;
    let (v0, h0) = polarisation_basis(towards);
    let (v, h) = polarisation_basis(s);
    // Fields are the same all over a node; nodes stand behind their parents.
    let mut radiated: Vec<(Matrix2, [CVec; 2])> = Vec::with_capacity(clipped.nodes.len());
    for node in &clipped.nodes {
        let field = match node.parent {
            u32::MAX => [CVec::real(v0), CVec::real(h0)],
            parent => radiated[parent as usize].1,
        };
        let surface = &point.surfaces[faces.faces[node.face as usize].surface as usize];
        let bounce = Bounce::new(field, node.frame.k, node.normal, surface, k);
        radiated.push((bounce.radiated(s, v, h), bounce.reflected));
    }
    let mut sum = Matrix2::default();
    for piece in pieces {
        let node = &clipped.nodes[piece.node as usize];
        let face = &faces.faces[node.face as usize];
        let corner = faces.corners[face.first as usize];
        // Phase falls with the length of both ways.
        let w = (node.frame.k - s) * -k;
        let gradient = DVec2::new(w.dot(face.axis[0]), w.dot(face.axis[1]));
        let start = -k * (node.frame.length_m(corner) - s.dot(corner));
        let amplitude = Complex64::new(0.0, -k / (4.0 * PI))
            * Complex64::cis(start)
            * phase_integral(piece.polygon.corners(), gradient);
        add_scaled(&mut sum, &radiated[piece.node as usize].0, amplitude);
    }
    sum
}

/// The way between a place and a port, its direction, and how its length bends.
struct PortPath {
    /// Less the port's distance from the world's origin.
    length_m: f64,
    /// Unit vector along which the length grows.
    dir: DVec3,
    /// 1 over the distance; 0 for a port at infinity.
    curvature: f64,
}

impl PortPath {
    fn new(port: Port, place: DVec3) -> PortPath {
        match port {
            Port::Far(s) => PortPath { length_m: -s.dot(place), dir: -s, curvature: 0.0 },
            Port::At(p) => {
                let d = place - p;
                let r = d.length();
                PortPath { length_m: r - p.length(), dir: d / r, curvature: 1.0 / r }
            }
        }
    }

    fn spreading(&self) -> f64 {
        if self.curvature > 0.0 { self.curvature } else { 1.0 }
    }
}

fn near_sum(
    faces: &Faces,
    clipped: &Clipped,
    pieces: &[Piece],
    point: &FrequencyPoint,
    transmit: Port,
    receive: Port,
    tau: f64,
) -> Matrix2 {
    let blocks: Vec<Matrix2> = pieces
        .par_chunks(64)
        .map_tasks(|block| {
            let mut sum = Matrix2::default();
            for piece in block {
                cells(faces, clipped, piece, transmit, receive, point.wavenumber, tau, |cell| {
                    let m = cell.radiated(faces, clipped, point);
                    add_scaled(
                        &mut sum,
                        &m,
                        cell.integral * Complex64::new(0.0, -point.wavenumber / (4.0 * PI)),
                    );
                });
            }
            sum
        })
        .collect();
    let mut sum = Matrix2::default();
    for b in &blocks {
        add_scaled(&mut sum, b, Complex64::new(1.0, 0.0));
    }
    sum
}

/// A part of a piece over which the phase is all but linear.
struct Cell {
    node: u32,
    /// Its centroid.
    place: DVec3,
    to_receiver: DVec3,
    /// Integral of the phase factor over the area, spreading included.
    integral: Complex64,
}

/// Bisects a piece until the quadratic phase across each cell is below `tau` (CONVENTIONS eq. 53).
#[allow(clippy::too_many_arguments)] // the physics has these inputs; a struct would only rename them
fn cells(
    faces: &Faces,
    clipped: &Clipped,
    piece: &Piece,
    transmit: Port,
    receive: Port,
    k: f64,
    tau: f64,
    mut emit: impl FnMut(Cell),
) {
    let node = &clipped.nodes[piece.node as usize];
    let face = &faces.faces[node.face as usize];
    let corner = faces.corners[face.first as usize];
    // The image of the transmitter in the mirrors met so far; at infinity only its direction has moved.
    let image = if node.frame.from_point { Port::At(node.frame.origin) } else { Port::Far(-node.frame.k) };
    let reference = match transmit {
        Port::At(p) => p.length(),
        Port::Far(_) => 0.0,
    };
    let mut stack = vec![piece.polygon];
    while let Some(polygon) = stack.pop() {
        let moments = Moments::of(polygon.corners());
        if moments.area == 0.0 {
            continue;
        }
        let place = corner + face.axis[0] * moments.centroid.x + face.axis[1] * moments.centroid.y;
        let ways = [PortPath::new(image, place), PortPath::new(receive, place)];
        let (mut slope, mut bend, mut mixed) = (DVec2::ZERO, DVec2::ZERO, 0.0);
        let mut nearest = 0.0f64;
        for w in &ways {
            let a = DVec2::new(w.dir.dot(face.axis[0]), w.dir.dot(face.axis[1]));
            slope += a;
            bend += w.curvature * (DVec2::ONE - a * a);
            mixed -= w.curvature * a.x * a.y;
            nearest = nearest.max(w.curvature);
        }
        let curved = |d: DVec2| DVec2::new(bend.x * d.x + mixed * d.y, mixed * d.x + bend.y * d.y);
        let mut worst = (0.0, DVec2::ZERO);
        let mut farthest = (0.0, DVec2::ZERO);
        for p in polygon.corners() {
            let d = *p - moments.centroid;
            // A corner is off along both axes at once, so it may have twice the phase of one axis.
            let phase = 0.25 * k * d.dot(curved(d)).abs();
            if phase > worst.0 {
                worst = (phase, curved(d));
            }
            if d.length_squared() > farthest.0 {
                farthest = (d.length_squared(), d);
            }
        }
        let across = if worst.0 > tau {
            worst.1
        } else if farthest.0.sqrt() * nearest > CELL_TO_DISTANCE {
            farthest.1
        } else {
            let g = slope * -k;
            let total = ways[0].length_m + ways[1].length_m + length_shift(&node.frame, image, reference);
            let phase = -k * (total + 0.5 * moments.quadratic(bend, mixed)) - g.dot(moments.centroid);
            emit(Cell {
                node: piece.node,
                place,
                to_receiver: -ways[1].dir,
                integral: Complex64::cis(phase)
                    * phase_integral(polygon.corners(), g)
                    * (ways[0].spreading() * ways[1].spreading()),
            });
            continue;
        };
        let [a, b] = polygon.split(moments.centroid, across);
        stack.push(b);
        stack.push(a);
    }
}

/// What to add to the length of the way from the image so that it counts as the frame and the transmitter
/// count.
fn length_shift(frame: &Frame, image: Port, reference: f64) -> f64 {
    match image {
        Port::At(p) => p.length() - reference,
        Port::Far(_) => frame.lead_m - frame.k.dot(frame.origin),
    }
}

impl Cell {
    fn radiated(&self, faces: &Faces, clipped: &Clipped, point: &FrequencyPoint) -> Matrix2 {
        let mut chain = [0u32; MAX_BOUNCES];
        let mut n = 0;
        let mut i = self.node;
        while i != u32::MAX {
            chain[n] = i;
            n += 1;
            i = clipped.nodes[i as usize].parent;
        }
        let node = |i: u32| &clipped.nodes[i as usize];
        let uv = node(self.node).frame.project(self.place);
        let (v, h) = polarisation_basis(-node(chain[n - 1]).frame.direction(uv));
        let mut field = [CVec::real(v), CVec::real(h)];
        for &i in chain[1..n].iter().rev() {
            field = self.bounce(faces, clipped, point, i, uv, field).reflected;
        }
        let last = self.bounce(faces, clipped, point, self.node, uv, field);
        let (v, h) = polarisation_basis(self.to_receiver);
        last.radiated(self.to_receiver, v, h)
    }

    fn bounce(
        &self,
        faces: &Faces,
        clipped: &Clipped,
        point: &FrequencyPoint,
        i: u32,
        uv: DVec2,
        field: [CVec; 2],
    ) -> Bounce {
        let node = &clipped.nodes[i as usize];
        let surface = &point.surfaces[faces.faces[node.face as usize].surface as usize];
        Bounce::new(field, node.frame.direction(uv), node.normal, surface, point.wavenumber)
    }
}
