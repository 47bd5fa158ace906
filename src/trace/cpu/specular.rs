//! Specular points of curved surfaces, found from facet to facet by Newton's method (CONVENTIONS eq. 58).
//!
//! The slope of a path's length over a surface, from its interpolated normals, goes on smoothly from facet to facet, and the specular
//! point is where it is zero. A step that leaves a facet ends at its side, and the next begins there on the neighbour.

use super::curved::Curved;
use crate::geom::faces::{Faces, NOT_CURVED};
use glam::{DVec2, DVec3};

/// Steps until a specular point is given up.
const STEPS: usize = 40;
/// A step shorter than this has arrived, m.
const ARRIVED_M: f64 = 1e-8;
/// A step that leaves a facet by no more than this has arrived at its side, m.
const AT_SIDE_M: f64 = 1e-6;
/// A point so near to a side belongs to the facets on both sides of it, m. Walks from different facets end so near to one another.
pub(super) const NEAR_SIDE_M: f64 = 3e-6;
/// Facets that may meet in a corner.
const AROUND: usize = 64;
/// Where the second derivatives of the path make up less of a determinant than this share, the surface focuses.
const FOCUSES: f64 = 1e-6;

/// A specular point of a curved surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Specular {
    /// Index of the face on which it lies.
    pub(super) face: u32,
    /// Position on the face along its axes, m.
    pub(super) at: DVec2,
}

/// A facet as a path by way of it sees it; None where the two stations are on different sides of it.
pub(super) fn facet(
    faces: &Faces,
    number: u32,
    stations: [DVec3; 2],
    (k, tau): (f64, f64),
) -> Option<Curved<'_>> {
    let face = &faces.faces[number as usize];
    let facet = faces.curved.get(face.curved as usize)?;
    let [a, b] = stations.map(|s| face.normal.dot(s) - face.offset_m > 0.0);
    let sign = if a { 1.0 } else { -1.0 };
    (a == b).then(|| Curved::new((facet, faces.corners(face), face.axis), sign, stations, (k, tau)))
}

/// The specular point of the smooth surface of a facet between two stations that Newton's method leads to from a position on the facet.
/// None where it leads over a crease or a border, or as near to one as `border_m`, or where the surface focuses.
pub(super) fn find(faces: &Faces, start: Specular, stations: [DVec3; 2], border_m: f64) -> Option<Specular> {
    let Specular { mut face, mut at } = start;
    for _ in 0..STEPS {
        let own = facet(faces, face, stations, (1.0, 1.0))?;
        let h = 1e-4 * own.size();
        let slope = own.slope(at);
        let [x, y] = [DVec2::X, DVec2::Y].map(|d| (own.slope(at + d * h) - slope) / h);
        let (det, norm) = (x.perp_dot(y), x.length_squared() + y.length_squared());
        if det.abs() <= FOCUSES * norm {
            return None;
        }
        // The inverse of the matrix with the columns x and y.
        let step = DVec2::new(y.perp_dot(slope), slope.perp_dot(x)) / det;
        let step = step * (2.0 * own.size() / step.length()).min(1.0);
        let to = at + step;
        let Some((share, side)) = own.leaves(at, to) else {
            at = to;
            if step.length() <= ARRIVED_M {
                return first_of(faces, Specular { face, at }, border_m);
            }
            continue;
        };
        at += step * share;
        if at.distance(to) <= AT_SIDE_M {
            return first_of(faces, Specular { face, at }, border_m);
        }
        let next = faces.neighbours[faces.faces[face as usize].curved as usize][side];
        if next == NOT_CURVED {
            return None;
        }
        Specular { face, at } = moved(faces, Specular { face, at }, next);
    }
    None
}

/// A point of a face's plane in the coordinates of a neighbour.
fn moved(faces: &Faces, point: Specular, next: u32) -> Specular {
    let [from, onto] = [point.face, next].map(|f| &faces.faces[f as usize]);
    let d = faces.corners(from)[0] + from.axis[0] * point.at.x + from.axis[1] * point.at.y
        - faces.corners(onto)[0];
    Specular { face: next, at: DVec2::new(onto.axis[0].dot(d), onto.axis[1].dot(d)) }
}

/// The same point on the first of the facets that meet in it, so that every walk to it gives the same facet; None as near to a crease or
/// a border as this.
fn first_of(faces: &Faces, point: Specular, border_m: f64) -> Option<Specular> {
    let mut around = vec![point];
    let mut next = 0;
    while next < around.len() && around.len() < AROUND {
        let at = around[next];
        next += 1;
        let face = &faces.faces[at.face as usize];
        let corners = faces.corners(face);
        for (side, beyond) in faces.neighbours[face.curved as usize].into_iter().enumerate() {
            let [a, b] = [side, (side + 1) % 3].map(|c| {
                let d = corners[c] - corners[0];
                DVec2::new(face.axis[0].dot(d), face.axis[1].dot(d))
            });
            let away_m = (b - a).normalize_or_zero().perp_dot(at.at - a).abs();
            if beyond == NOT_CURVED {
                if away_m <= border_m {
                    return None;
                }
            } else if away_m <= NEAR_SIDE_M && around.iter().all(|p| p.face != beyond) {
                around.push(moved(faces, at, beyond));
            }
        }
    }
    around.into_iter().min_by_key(|p| p.face)
}
