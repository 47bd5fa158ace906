//! Scattering matrix of targets that waves pass through, in f64 (CONVENTIONS eq. 70-75).

use crate::base::frames::polarisation_basis;
use crate::base::matrix::Matrix2;
use crate::em::aperture::{Moments, phase_integral};
use crate::em::fresnel::{rayleigh_factor, transmission_roughness_factor};
use crate::em::layers::{Backing, Layer, Stack, crossing};
use crate::geom::Surface;
use crate::geom::faces::{Face, Faces};
use crate::rcs::beam_sum::FrequencyPoint;
use crate::rcs::{Impassable, Scattering};
use crate::trace::beams::BeamOptions;
use crate::trace::cpu::beams::Polygon;
use crate::trace::cpu::field::CVec;
use crate::trace::cpu::refract::{Clipped, Kind, Media, Piece, Wave, clip, permittivity, refractive_index};
use glam::{DVec2, DVec3};
use num_complex::Complex64;
use std::f64::consts::PI;

type Pair = (Complex64, Complex64);

/// Loss across a piece above which it is halved, Np; its mean then stands for it within a 10^4th.
const EVEN_NP: f64 = 0.04;

/// Computes S between two directions for frequencies at which the media are the same.
///
/// # Errors
/// Returns `Impassable::NoBody` if a body turns out to be open or to touch another.
pub fn between(
    faces: &Faces,
    media: &Media,
    frequencies: &[&FrequencyPoint],
    transmit: DVec3,
    receive: DVec3,
    options: &BeamOptions,
) -> Result<Vec<Scattering>, Impassable> {
    let clipped = clip(faces, media, transmit, receive, options);
    if clipped.broken {
        return Err(Impassable::NoBody);
    }
    let sums = frequencies
        .iter()
        .map(|point| {
            let sum = Sum::new(faces, media, &clipped, point, transmit, receive);
            let forward = sum.of(&clipped.forward, |p| sum.forward(p));
            let with = |pieces: &[Piece]| {
                let mut s = sum.of(pieces, |p| sum.reflected(p));
                s.iter_mut().flatten().zip(forward.iter().flatten()).for_each(|(a, b)| *a += b);
                s
            };
            Scattering { every: with(&clipped.every), last: with(&clipped.last) }
        })
        .collect();
    Ok(sums)
}

/// A wave on a face, for two polarisations.
#[derive(Clone, Copy)]
struct Contact {
    arriving: [CVec; 2],
    reflected: [CVec; 2],
    through: [CVec; 2],
    /// Directions of the three.
    dirs: [DVec3; 3],
}

struct Sum<'a> {
    faces: &'a Faces,
    media: &'a Media,
    clipped: &'a Clipped,
    point: &'a FrequencyPoint<'a>,
    nodes: Vec<Contact>,
    /// Fields of the receiver's waves.
    views: Vec<[CVec; 2]>,
}

impl<'a> Sum<'a> {
    fn new(
        faces: &'a Faces,
        media: &'a Media,
        clipped: &'a Clipped,
        point: &'a FrequencyPoint<'a>,
        transmit: DVec3,
        receive: DVec3,
    ) -> Self {
        let mut sum = Sum { faces, media, clipped, point, nodes: Vec::new(), views: Vec::new() };
        let basis = |towards| {
            let (v, h) = polarisation_basis(towards);
            [CVec::real(v), CVec::real(h)]
        };
        for node in &clipped.nodes {
            let field = match node.parent {
                u32::MAX => basis(transmit),
                p if node.straight => {
                    let arriving = sum.nodes[p as usize].arriving;
                    let nothing = [CVec::real(DVec3::ZERO); 2];
                    let dirs = [node.wave.frame.k; 3];
                    sum.nodes.push(Contact { arriving, reflected: nothing, through: nothing, dirs });
                    continue;
                }
                p if node.through => sum.nodes[p as usize].through,
                p => sum.nodes[p as usize].reflected,
            };
            let contact = sum.contact(field, &node.wave, node.normal, node.face);
            sum.nodes.push(contact);
        }
        for view in &clipped.views {
            let field = match view.parent {
                u32::MAX => basis(receive),
                p => {
                    let wave = &clipped.views[p as usize].wave;
                    sum.contact(sum.views[p as usize], wave, view.normal, view.face).through
                }
            };
            sum.views.push(field);
        }
        sum
    }

    fn face(&self, face: u32) -> &Face {
        &self.faces.faces[face as usize]
    }

    fn eps(&self, cell: u32) -> Complex64 {
        permittivity(self.faces, self.point.surfaces, cell)
    }

    /// What a face makes of a wave.
    fn contact(&self, field: [CVec; 2], wave: &Wave, normal: DVec3, face: u32) -> Contact {
        let face = self.face(face);
        let k = wave.frame.k;
        let cos_i = -k.dot(normal);
        let across = k.cross(normal);
        let sin_i = across.length();
        let e_perp = if sin_i > 1e-9 { across / sin_i } else { normal.any_orthonormal_vector() };
        let mirrored = k + normal * (2.0 * cos_i);
        let (r, t, onwards) = self.coefficients(face, wave, normal, cos_i);
        let field_along = |out: DVec3, (perp, par): Pair| {
            field.map(|e| {
                let along = CVec::along(out.cross(e_perp), par * e.dot(k.cross(e_perp)));
                CVec::along(e_perp, perp * e.dot(e_perp)).plus(along)
            })
        };
        Contact {
            arriving: field,
            reflected: field_along(mirrored, r),
            through: field_along(onwards, t),
            dirs: [k, mirrored, onwards],
        }
    }

    /// Reflection and transmission (CONVENTIONS eq. 71, 72), and the direction of what is let through.
    fn coefficients(&self, face: &Face, wave: &Wave, normal: DVec3, cos_i: f64) -> (Pair, Pair, DVec3) {
        let k0 = self.point.wavenumber;
        let surface = &self.point.surfaces[face.surface as usize];
        let (k, stack, rough) = (wave.frame.k, &surface.stack, surface.roughness_rms_m);
        let none = (Complex64::ZERO, Complex64::ZERO);
        let times = |p: Pair, z: Complex64| (p.0 * z, p.1 * z);
        match self.media.kind(face) {
            Kind::Opaque if wave.index == 1.0 => (surface.reflection(k0, cos_i), none, k),
            Kind::Opaque => {
                let Backing::HalfSpace(back) = stack.backing else {
                    let inside = coated_conductor(surface, wave.index);
                    return (inside.reflection(k0 * wave.index, cos_i), none, k);
                };
                let tangential = wave.index * (1.0 - cos_i * cos_i).max(0.0).sqrt();
                let c = crossing(self.eps(wave.cell), &stack.layers, back, k0, tangential);
                let loss = rayleigh_factor(k0 * wave.index, rough, cos_i);
                (times(c.reflection, loss.into()), none, k)
            }
            Kind::Sheet => {
                let t = surface.transmission(k0, cos_i).unwrap_or(none);
                if normal.dot(face.normal) > 0.0 {
                    return (surface.reflection(k0, cos_i), t, k);
                }
                // From behind: the layers the other way round, and their end nearer by the thickness.
                let layers = stack.layers.iter().rev().cloned().collect();
                let back =
                    Surface { stack: Stack { layers, ..*stack }, roughness_rms_m: rough, backscatter: None };
                let nearer = Complex64::cis(2.0 * k0 * stack.thickness_m() * cos_i);
                (times(back.reflection(k0, cos_i), nearer), t, k)
            }
            Kind::Border => {
                let (inside, outwards) = (self.eps(face.cell), wave.cell == face.cell);
                let tangential = wave.index * (1.0 - cos_i * cos_i).max(0.0).sqrt();
                let n_in = refractive_index(inside).re;
                let cos_of = |index: f64| (1.0 - (tangential / index).powi(2)).max(0.0).sqrt();
                let (cos_in, cos_out) = (cos_of(n_in), cos_of(1.0));
                // The body begins behind its layers, whose front is the face.
                let q_in = (inside - tangential * tangential).sqrt();
                let shift = (Complex64::I * k0 * stack.thickness_m() * q_in).exp();
                let loss = match rough > 0.0 {
                    false => (1.0, 1.0),
                    true => (
                        rayleigh_factor(k0 * wave.index, rough, cos_i),
                        transmission_roughness_factor(k0, rough, inside, cos_out),
                    ),
                };
                let (r, t, index) = if outwards {
                    let layers: Vec<Layer> = stack.layers.iter().rev().cloned().collect();
                    let c = crossing(inside, &layers, Complex64::ONE, k0, tangential);
                    (times(c.reflection, shift * shift), times(c.transmission, shift), 1.0)
                } else {
                    let c = crossing(Complex64::ONE, &stack.layers, inside, k0, tangential);
                    (c.reflection, times(c.transmission, shift), n_in)
                };
                let cos_t = if outwards { cos_out } else { cos_in };
                let ratio = wave.index / index;
                let onwards = (k * ratio + normal * (ratio * cos_i - cos_t)).normalize();
                (times(r, loss.0.into()), times(t, loss.1.into()), onwards)
            }
        }
    }

    /// [rx][tx] of what the fields along their directions radiate against the receiver's wave: J . E - M . H
    /// with J = n x H, M = -n x E, both fields in the medium of refractive index `index`.
    fn radiated(
        normal: DVec3,
        index: Complex64,
        fields: [&[(CVec, DVec3)]; 2],
        receiver: &[CVec; 2],
        towards: DVec3,
    ) -> Matrix2 {
        let zero = CVec::real(DVec3::ZERO);
        let of = |tx: usize| {
            let (mut e, mut h) = (zero, zero);
            for (field, dir) in fields[tx] {
                e = e.plus(*field);
                h = h.plus(field.crossed_from(*dir));
            }
            let (j, m) = (h.crossed_from(normal), e.crossed_from(-normal));
            receiver.map(|p| index * (j.times(&p) - m.times(&p.crossed_from(towards))))
        };
        let (v, h) = (of(0), of(1));
        [[v[0], h[0]], [v[1], h[1]]]
    }

    /// What a face reflects towards a view.
    fn reflected(&self, piece: &Piece) -> Matrix2 {
        let node = &self.clipped.nodes[piece.node as usize];
        let contact = &self.nodes[piece.node as usize];
        let kind = self.media.kind(self.face(node.face));
        let view = &self.clipped.views[piece.view as usize].wave;
        let index = refractive_index(self.eps(node.wave.cell));
        self.currents_of(contact, kind, node.normal, index, &self.views[piece.view as usize], view.frame.k)
    }

    /// The currents on the side of arrival (CONVENTIONS eq. 73): all of the wave on an opaque face, the
    /// reflected one on a body's, and on a sheet what is reflected and what does not pass.
    fn currents_of(
        &self,
        contact: &Contact,
        kind: Kind,
        normal: DVec3,
        index: Complex64,
        receiver: &[CVec; 2],
        towards: DVec3,
    ) -> Matrix2 {
        let fields = [0, 1].map(|tx| {
            let arriving = contact.arriving[tx];
            let kept = match kind {
                Kind::Opaque => arriving,
                Kind::Border => CVec::real(DVec3::ZERO),
                Kind::Sheet => arriving.plus(contact.through[tx].scaled(-Complex64::ONE)),
            };
            [(contact.reflected[tx], contact.dirs[1]), (kept, contact.dirs[0])]
        });
        Self::radiated(normal, index, [&fields[0], &fields[1]], receiver, towards)
    }

    /// What a face that the wave meets on its way forward radiates behind it (CONVENTIONS eq. 74).
    fn forward(&self, piece: &Piece) -> Matrix2 {
        let node = &self.clipped.nodes[piece.node as usize];
        let contact = &self.nodes[piece.node as usize];
        let face = self.face(node.face);
        let kind = self.media.kind(face);
        let (receiver, towards) = (&self.views[0], self.clipped.views[0].wave.frame.k);
        let one = Complex64::ONE;
        if kind == Kind::Sheet {
            return self.currents_of(contact, kind, node.normal, one, receiver, towards);
        }
        let fields = match node.straight {
            true => contact.arriving.map(|f| [(f.scaled(-one), contact.dirs[0])]),
            false => contact.through.map(|f| [(f, contact.dirs[2])]),
        };
        Self::radiated(-node.normal, one, [&fields[0], &fields[1]], receiver, towards)
    }

    fn of(&self, pieces: &[Piece], radiated: impl Fn(&Piece) -> Matrix2) -> Matrix2 {
        let k = self.point.wavenumber;
        let mut sum = Matrix2::default();
        for piece in pieces {
            let node = &self.clipped.nodes[piece.node as usize];
            let view = &self.clipped.views[piece.view as usize].wave;
            let face = self.face(node.face);
            let corner = self.faces.corners[face.first as usize];
            let on_face = |g: DVec3| DVec2::new(g.dot(face.axis[0]), g.dot(face.axis[1]));
            let ways = [&node.wave, view];
            let gradient = on_face(ways.iter().map(|w| w.frame.k * (-k * w.index)).sum());
            let start: f64 = ways.iter().map(|w| -k * w.length_m(corner)).sum();
            let decay = on_face(ways.iter().map(|w| w.decay.gradient).sum());
            let lost: f64 = ways.iter().map(|w| w.decay.at(corner)).sum();
            let amplitude = Complex64::new(0.0, -k / (4.0 * PI))
                * Complex64::from_polar((-lost).exp(), start)
                * damped_integral(piece.polygon, gradient, decay);
            let m = radiated(piece);
            for (s, z) in sum.iter_mut().flatten().zip(m.iter().flatten()) {
                *s += z * amplitude;
            }
        }
        sum
    }
}

/// Integral of exp(j g . p - d . p) over a convex polygon, with the mean of the loss on each part that is
/// small enough.
fn damped_integral(polygon: Polygon, gradient: DVec2, decay: DVec2) -> Complex64 {
    if decay == DVec2::ZERO {
        return phase_integral(polygon.corners(), gradient);
    }
    let mut sum = Complex64::ZERO;
    let mut stack = vec![polygon];
    while let Some(p) = stack.pop() {
        let m = Moments::of(p.corners());
        if m.area == 0.0 {
            continue;
        }
        let losses = p.corners().iter().map(|c| decay.dot(*c - m.centroid));
        let (lo, hi) = losses.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), x| (lo.min(x), hi.max(x)));
        if hi - lo > EVEN_NP {
            stack.extend(p.split(m.centroid, decay));
        } else {
            sum += phase_integral(p.corners(), gradient) * (-decay.dot(m.centroid)).exp();
        }
    }
    sum
}

/// A perfect conductor with layers, in a dielectric of this index, whose loss is left out: permittivities
/// relative to it.
fn coated_conductor(surface: &Surface, index: f64) -> Surface {
    let over = |l: &Layer| Layer { eps_r: l.eps_r / (index * index), ..*l };
    let layers = surface.stack.layers.iter().map(over).collect();
    Surface { stack: Stack { layers, ..surface.stack }, ..*surface }
}
