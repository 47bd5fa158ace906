//! Scattering matrix from exact beams, in f64 (CONVENTIONS eq. 50-54).
//!
//! A path that touches curved surfaces is summed up on the last of these: the wave from the transmitter arrives there by its chain of
//! reflections, the receiver by a chain of planes, in which its image is exact, and the integral is that of the current of one and the field
//! of the other (reciprocity). So no beam from a curved facet ever lights a plane, where facets would have to be narrower than what they
//! light. Between curved surfaces a facet's beam stands for the ray tube of its surface, which spreads (CONVENTIONS eq. 57a).

use super::refract_sum;
use crate::base::frames::polarisation_basis;
use crate::base::matrix::{Matrix2, add_scaled};
use crate::base::tasks::Tasks;
use crate::em::aperture::{Moments, phase_integral};
use crate::geom::Geometry;
use crate::geom::faces::{Face, Faces};
pub use crate::rcs::beam_sum::FrequencyPoint;
use crate::rcs::{BistaticAspect, Distance, Impassable, Scattering};
use crate::trace::MAX_BOUNCES;
use crate::trace::beams::{BeamOptions, Frame, Port};
use crate::trace::cpu::beams::{Clipped, Piece, Polygon, clip, overlaps};
use crate::trace::cpu::curved::window;
use crate::trace::cpu::field::{Bounce, CVec};
use crate::trace::cpu::front::Front;
use crate::trace::cpu::refract::Media;
use glam::{DMat2, DMat3, DVec2, DVec3};
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
    let all: Vec<&FrequencyPoint> = frequencies.iter().collect();
    Ok(reflected(faces, &all, transmit, receive, options))
}

/// The same where waves pass through nothing.
fn reflected(
    faces: &Faces,
    frequencies: &[&FrequencyPoint],
    transmit: Port,
    receive: Port,
    options: &BeamOptions,
) -> Vec<Scattering> {
    let clipped = clip(faces, transmit, receive, options);
    let has_curved = clipped.tubes && options.bounces > 1 && faces.faces.iter().any(Face::is_curved);
    // What the receiver sees of curved surfaces over planes.
    let apart = (has_curved && transmit != receive)
        .then(|| clip(faces, receive, receive, &BeamOptions { last: false, ..*options }));
    let back = apart.as_ref().unwrap_or(&clipped);
    let least_k = frequencies.iter().map(|f| f.wavenumber).fold(f64::INFINITY, f64::min);
    let pairs = if has_curved { pairs(faces, &clipped, back, options.bounces, least_k) } else { Vec::new() };
    let sums = |point: &&FrequencyPoint| {
        let sum = |pieces| match (transmit, receive) {
            (Port::Far(t), Port::Far(s)) => far_sum(faces, &clipped, pieces, point, t, s),
            _ => near_sum(faces, &clipped, pieces, point, transmit, receive, options.tau),
        };
        let mut found = Scattering { every: sum(&clipped.every), last: sum(&clipped.last) };
        let over = paired_sum(faces, (&clipped, back), &pairs, point, [transmit, receive], options.tau);
        for to in [&mut found.every, &mut found.last] {
            add_scaled(to, &over, Complex64::ONE);
        }
        found
    };
    frequencies.iter().map(sums).collect()
}

/// What a transmitter and a receiver light together of a facet of a curved surface.
struct Pair {
    /// Nodes of the wave from the transmitter and of that which the receiver would send.
    nodes: [u32; 2],
    polygon: Polygon,
    /// Change of the path, m, from where the reflected rays graze the plane to a place whose rays go away from it; 0 where they go there.
    beyond_m: f64,
}

/// What of facets of curved surfaces is lit from the transmitter and seen by the receiver over at least one plane, by so many bounces, and
/// counts at wavenumbers from `k` on.
fn pairs(faces: &Faces, lit: &Clipped, seen: &Clipped, bounces: usize, k: f64) -> Vec<Pair> {
    let node = |of: &Clipped, piece: &Piece| of.nodes[piece.node as usize];
    let is_over_planes = |piece: &Piece| {
        let own = node(seen, piece);
        let mut next = own;
        own.bounce > 1 && {
            let mut planes = true;
            while next.parent != u32::MAX {
                next = seen.nodes[next.parent as usize];
                planes &= !faces.faces[next.face as usize].is_curved();
            }
            planes
        }
    };
    let mut back: Vec<&Piece> = seen.imaged.iter().filter(|p| is_over_planes(p)).collect();
    back.retain(|p| faces.faces[node(seen, p).face as usize].is_curved());
    back.sort_by_key(|p| node(seen, p).face);
    let mut found = Vec::new();
    for piece in &lit.imaged {
        let own = node(lit, piece);
        let first = back.partition_point(|p| node(seen, p).face < own.face);
        for other in back[first..].iter().take_while(|p| node(seen, p).face == own.face) {
            let there = node(seen, other);
            if usize::from(own.bounce + there.bounce) > bounces + 1 || own.normal.dot(there.normal) <= 0.0 {
                continue;
            }
            let nodes = [piece.node, other.node];
            let plane = seen.nodes[there.parent as usize].normal;
            let face = &faces.faces[own.face as usize];
            let corner = faces.corners[face.first as usize];
            let shape = faces.shapes.get(face.shape as usize).copied().unwrap_or(DMat3::ZERO);
            for polygon in overlaps(&[piece.polygon], &[other.polygon]) {
                let middle = Moments::of(polygon.corners()).centroid;
                let place = corner + face.axis[0] * middle.x + face.axis[1] * middle.y;
                let arrives = own.frame.direction(own.frame.project(place));
                let beyond_m = beyond_m(arrives, own.normal, plane, shape);
                if window(k * beyond_m) > 0.0 {
                    found.push(Pair { nodes, polygon, beyond_m });
                }
            }
        }
    }
    found
}

/// As [`Pair::beyond_m`]. As for flat faces, a wave goes on to a plane where its rays do, and currents that would radiate there besides are left
/// out; but where a curved surface turns its rays away bit by bit, none of its facets is the last.
fn beyond_m(arrives: DVec3, normal: DVec3, plane: DVec3, shape: DMat3) -> f64 {
    let leaves = arrives - normal * (2.0 * normal.dot(arrives));
    let rises = leaves.dot(plane);
    if rises < 0.0 {
        return 0.0;
    }
    // How the rays' rise over the plane changes along the surface, on which the normal changes by shape times the way.
    let turn = shape * (arrives * normal.dot(plane) + plane * normal.dot(arrives)) * 2.0;
    let way = turn / turn.length_squared() * rises;
    let bend = 2.0 * normal.dot(arrives).abs() * (shape * way).length();
    // Where nothing turns them they go away for good.
    if turn == DVec3::ZERO { f64::INFINITY } else { 0.5 * bend * way.length() }
}

/// The sum over pairs of waves.
fn paired_sum(
    faces: &Faces,
    (lit, seen): (&Clipped, &Clipped),
    pairs: &[Pair],
    point: &FrequencyPoint,
    [transmit, receive]: [Port; 2],
    tau: f64,
) -> Matrix2 {
    let k = point.wavenumber;
    let blocks: Vec<Matrix2> = pairs
        .par_chunks(64)
        .map_tasks(|block| {
            let mut sum = Matrix2::default();
            for pair in block {
                let weight = window(k * pair.beyond_m);
                if weight == 0.0 {
                    continue;
                }
                let [node, back] = pair.nodes;
                let piece = Piece { node, polygon: pair.polygon };
                let ports = [transmit, receive];
                cells(faces, lit, &piece, ports, Some((seen, back)), k, tau, |cell| {
                    let m = cell.radiated(faces, lit, Some((seen, back)), point);
                    add_scaled(&mut sum, &m, cell.integral * Complex64::new(0.0, -weight * k / (4.0 * PI)));
                });
            }
            sum
        })
        .collect();
    let mut sum = Matrix2::default();
    blocks.iter().for_each(|b| add_scaled(&mut sum, b, Complex64::ONE));
    sum
}

/// What the ray tube of a beam is at `place`, on the last face of a node's chain, against the tube of the flat facets that it was reflected by:
/// the square root of how many times wider it is, times j for each line of focus between, and how places along the face's axes move apart. By
/// the curvature of the wave's front, which reflections at curved surfaces change (Deschamps 1972; CONVENTIONS eq. 57a). None where no surface
/// before is curved.
fn spread(faces: &Faces, clipped: &Clipped, node: u32, place: DVec3) -> Option<(Complex64, DMat2)> {
    let mut chain = [0u32; MAX_BOUNCES];
    let (mut n, mut i, mut is_curved) = (0, node, false);
    while i != u32::MAX {
        is_curved |= n > 0 && faces.faces[clipped.nodes[i as usize].face as usize].is_curved();
        chain[n] = i;
        n += 1;
        i = clipped.nodes[i as usize].parent;
    }
    if !(is_curved && clipped.tubes) {
        return None;
    }
    let chain = &mut chain[..n];
    chain.reverse();
    let of = |i: u32| {
        let node = &clipped.nodes[i as usize];
        (node, &faces.faces[node.face as usize])
    };
    let last = of(node).0;
    let uv = last.frame.project(place);
    let at = |i: u32| {
        let (node, face) = of(i);
        node.frame.lift(uv, node.frame.nearness(face.normal, face.offset_m))
    };
    let first = of(chain[0]).0;
    let (mut from, mut flat, mut front) = (at(chain[0]), 1.0, Front::plane());
    if first.frame.from_point {
        let range_m = from.distance(first.frame.origin);
        front = Front::from_point(first.frame.direction(uv), range_m);
        flat = (place.distance(last.frame.origin) / range_m).powi(2);
    }
    for pair in chain.windows(2) {
        let (node, face) = of(pair[0]);
        let shape = faces.shapes.get(face.shape as usize);
        let shape = shape.map(|s| *s * node.normal.dot(face.normal).signum());
        front.reflect(node.normal, of(pair[1]).0.frame.direction(uv), shape);
        let next = if pair[1] == chain[n - 1] { place } else { at(pair[1]) };
        front.advance(from.distance(next), 0.0);
        from = next;
    }
    let (node, face) = of(chain[n - 1]);
    let along = node.frame.direction(uv);
    let onto = |axis: DVec3| {
        let moved = front.offset(axis - along * along.dot(axis)) / flat.sqrt();
        let on_face = moved - along * (face.normal.dot(moved) / face.normal.dot(along));
        DVec2::new(face.axis[0].dot(on_face), face.axis[1].dot(on_face))
    };
    let moves = DMat2::from_cols(onto(face.axis[0]), onto(face.axis[1]));
    Some((front.turn() * (front.wider() / flat).sqrt(), moves))
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
                let frequencies: Vec<&FrequencyPoint> = alike.iter().map(|j| &frequencies[*j]).collect();
                reflected(faces, &frequencies, transmit, receive, options)
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
    let mut found: Vec<(Vec<u32>, f64)> = of_chain
        .into_iter()
        .map(|(chain, pieces)| (chain, largest(far_sum(faces, &clipped, &pieces, point, s, s))))
        .collect();
    // And over planes back.
    let mut of_ways: BTreeMap<Vec<u32>, Vec<Pair>> = BTreeMap::new();
    for pair in pairs(faces, &clipped, &clipped, options.bounces, point.wavenumber) {
        let [out, back] = pair.nodes.map(|node| chain(&Piece { node, polygon: pair.polygon }));
        of_ways.entry(back.into_iter().skip(1).rev().chain(out).collect()).or_default().push(pair);
    }
    found.extend(of_ways.into_iter().map(|(way, pairs)| {
        (way, largest(paired_sum(faces, (&clipped, &clipped), &pairs, point, [port; 2], options.tau)))
    }));
    found
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
        let corners = piece.polygon.corners();
        let middle = corners.iter().sum::<DVec2>() / corners.len() as f64;
        let place = corner + face.axis[0] * middle.x + face.axis[1] * middle.y;
        let integral = match spread(faces, clipped, piece.node, place) {
            None => phase_integral(corners, gradient),
            Some((wider, moves)) => {
                let about = piece.polygon.mapped(|p| p - middle);
                let turned = phase_integral(about.corners(), moves.transpose() * gradient);
                turned * Complex64::cis(gradient.dot(middle)) * wider
            }
        };
        let amplitude = Complex64::new(0.0, -k / (4.0 * PI)) * Complex64::cis(start) * integral;
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
                cells(faces, clipped, piece, [transmit, receive], None, point.wavenumber, tau, |cell| {
                    let m = cell.radiated(faces, clipped, None, point);
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

/// Bisects a piece until the quadratic phase across each cell is below `tau` (CONVENTIONS eq. 53). The receiver sees it by way of a node
/// of beams that it would send, or straight.
#[allow(clippy::too_many_arguments)] // the physics has these inputs; a struct would only rename them
fn cells(
    faces: &Faces,
    clipped: &Clipped,
    piece: &Piece,
    [transmit, receive]: [Port; 2],
    back: Option<(&Clipped, u32)>,
    k: f64,
    tau: f64,
    mut emit: impl FnMut(Cell),
) {
    let node = &clipped.nodes[piece.node as usize];
    let face = &faces.faces[node.face as usize];
    let corner = faces.corners[face.first as usize];
    // The image of the transmitter in the mirrors met so far; at infinity only its direction has moved.
    let image_of =
        |frame: &Frame| if frame.from_point { Port::At(frame.origin) } else { Port::Far(-frame.k) };
    let reference = |port: Port| match port {
        Port::At(p) => p.length(),
        Port::Far(_) => 0.0,
    };
    let image = image_of(&node.frame);
    let mut shift = length_shift(&node.frame, image, reference(transmit));
    let receiver = match back {
        None => receive,
        Some((seen, node)) => {
            let frame = &seen.nodes[node as usize].frame;
            shift += length_shift(frame, image_of(frame), reference(receive));
            image_of(frame)
        }
    };
    let mut stack = vec![piece.polygon];
    while let Some(polygon) = stack.pop() {
        let moments = Moments::of(polygon.corners());
        if moments.area == 0.0 {
            continue;
        }
        let place = corner + face.axis[0] * moments.centroid.x + face.axis[1] * moments.centroid.y;
        let ways = [PortPath::new(image, place), PortPath::new(receiver, place)];
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
            let (wider, moves) =
                spread(faces, clipped, piece.node, place).unwrap_or((Complex64::ONE, DMat2::IDENTITY));
            let g = moves.transpose() * (slope * -k);
            let total = ways[0].length_m + ways[1].length_m + shift;
            let phase = -k * (total + 0.5 * moments.quadratic(bend, mixed)) - g.dot(moments.centroid);
            emit(Cell {
                node: piece.node,
                place,
                to_receiver: -ways[1].dir,
                integral: Complex64::cis(phase)
                    * phase_integral(polygon.corners(), g)
                    * wider
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
    /// What the cell's currents radiate, for an area of 1 m^2 but for -j k / 4 pi; the receiver sees it by way of a node of beams that it
    /// would send, or straight.
    fn radiated(
        &self,
        faces: &Faces,
        clipped: &Clipped,
        back: Option<(&Clipped, u32)>,
        point: &FrequencyPoint,
    ) -> Matrix2 {
        let uv = clipped.nodes[self.node as usize].frame.project(self.place);
        let field = self.arrives(faces, clipped, self.node, point);
        let last = bounce(faces, clipped, point, self.node, uv, field);
        let by = match back {
            None => {
                let (v, h) = polarisation_basis(self.to_receiver);
                [v, h].map(CVec::real)
            }
            Some((seen, node)) => self.arrives(faces, seen, node, point),
        };
        last.received(self.to_receiver, &by)
    }

    /// Field of unit waves V and H from a port where they arrive at the cell by a node's chain.
    fn arrives(&self, faces: &Faces, clipped: &Clipped, of: u32, point: &FrequencyPoint) -> [CVec; 2] {
        let mut chain = [0u32; MAX_BOUNCES];
        let mut n = 0;
        let mut i = of;
        while i != u32::MAX {
            chain[n] = i;
            n += 1;
            i = clipped.nodes[i as usize].parent;
        }
        let node = |i: u32| &clipped.nodes[i as usize];
        let uv = node(of).frame.project(self.place);
        let (v, h) = polarisation_basis(-node(chain[n - 1]).frame.direction(uv));
        let mut field = [CVec::real(v), CVec::real(h)];
        for &i in chain[1..n].iter().rev() {
            field = bounce(faces, clipped, point, i, uv, field).reflected;
        }
        field
    }
}

/// The bounce of waves at a node, by the ray at `uv`.
fn bounce(
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
