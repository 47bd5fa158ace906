//! Low-profile asymmetrical trihedral for road markings (Feng 2019, sections 3.3.2-3.3.4).

use super::{Builder, Built, Kind, Param, PlateShape::*, Range, Values, length, number};
use crate::error::Result;
use crate::road::shape::polygon;
use crate::scene::Mesh;
use glam::DVec3;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlateShape {
    /// Rectangles of the full height.
    Strip,
    /// Falling to no height at the front.
    Triangle,
}

/// Apex at the origin, open to +x. On the ground an isosceles right triangle with its right angle at
/// the apex and its hypotenuse `width_m` at x = width/2, then a rectangle `length_m` x `width_m` in
/// front of it. Along the two legs stand plates of height `height_m`, measured in the plate.
///
/// `slant_deg` > 0 leans the plates away from the radar, each about its leg; they are cut or
/// lengthened at the back so that they meet in a seam. The metal has no thickness.
/// 3 triangles with strips 4 more, with triangles 2 more; without length 1 on the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Type1 {
    pub width_m: f64,
    pub height_m: f64,
    pub length_m: f64,
    pub slant_deg: f64,
    pub plates: PlateShape,
}

const POSE: &str = "apex at the origin, bottom plate on z = 0, open to +x";
const WIDTH: Param = length("width_m", 0.16, "width across the opening");
const HEIGHT: Param = length("height_m", 0.004, "height of the standing plates");
const LENGTH: Param = number("length_m", 0.0, 0.0, 100.0, "length of the bottom plate beyond the triangle");
const PLATES: Param = Param {
    name: "plates",
    doc: "outline of the standing plates",
    range: Range::Choice(&["strip", "triangle"]),
};

pub static KIND: Kind = Kind {
    name: "type1",
    summary: "low-profile asymmetrical trihedral for road markings",
    pose: POSE,
    params: &[
        WIDTH,
        HEIGHT,
        LENGTH,
        number("slant_deg", 0.0, -45.0, 45.0, "lean of the standing plates away from the radar"),
        PLATES,
    ],
    boresight_deg: (0.0, 0.0),
    build,
};

pub static TYPE2_KIND: Kind = Kind {
    name: "type2",
    summary: "type1 with slanted standing plates",
    pose: POSE,
    params: &[
        WIDTH,
        HEIGHT,
        LENGTH,
        number("slant_deg", 5.0, -45.0, 45.0, "lean of the standing plates away from the radar"),
        PLATES,
    ],
    boresight_deg: (0.0, 0.0),
    build,
};

fn build(v: &Values) -> Result<Built> {
    Ok(Built::Mesh(Box::new(Type1 {
        width_m: v.number("width_m"),
        height_m: v.number("height_m"),
        length_m: v.number("length_m"),
        slant_deg: v.number("slant_deg"),
        plates: if v.word("plates") == "triangle" { Triangle } else { Strip },
    })))
}

impl Builder for Type1 {
    fn mesh(&self) -> Mesh {
        let w = 0.5 * self.width_m;
        let front = w + self.length_m;
        let (left, right) = (DVec3::new(w, w, 0.0), DVec3::new(w, -w, 0.0));
        let mut mesh = Mesh::default();
        if self.length_m > 0.0 {
            let (near_right, near_left) = (DVec3::new(front, -w, 0.0), DVec3::new(front, w, 0.0));
            polygon(&mut mesh, &[DVec3::ZERO, right, near_right, near_left, left], 0);
        } else {
            polygon(&mut mesh, &[DVec3::ZERO, right, left], 0);
        }
        let (s, c) = self.slant_deg.to_radians().sin_cos();
        let (up, back) = (self.height_m * c, self.height_m * s);
        // Where the two leaning planes meet above the apex.
        let seam = DVec3::new(-std::f64::consts::SQRT_2 * back, 0.0, up);
        let lean = |leg_end: DVec3, side: f64| {
            let away = DVec3::new(-1.0, side, 0.0) * std::f64::consts::FRAC_1_SQRT_2;
            leg_end + back * away + DVec3::Z * up
        };
        match self.plates {
            Strip => {
                polygon(&mut mesh, &[DVec3::ZERO, left, lean(left, 1.0), seam], 0);
                polygon(&mut mesh, &[right, DVec3::ZERO, seam, lean(right, -1.0)], 0);
            }
            Triangle => {
                polygon(&mut mesh, &[DVec3::ZERO, left, seam], 0);
                polygon(&mut mesh, &[right, DVec3::ZERO, seam], 0);
            }
        }
        mesh
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::road::shape::{area_m2, area_vector_m2};

    fn base() -> Type1 {
        Type1 { width_m: 0.16, height_m: 0.004, length_m: 0.0, slant_deg: 0.0, plates: Strip }
    }

    fn normals(m: &Mesh) -> Vec<DVec3> {
        (0..m.triangles.len()).map(|t| area_vector_m2(m, t).normalize()).collect()
    }

    #[test]
    fn areas_and_right_angles() {
        let leg = 0.16 * 0.5f64.sqrt();
        let m = base().mesh();
        assert_eq!(m.triangles.len(), 5);
        assert!((area_m2(&m) - (0.08 * 0.08 + 2.0 * leg * 0.004)).abs() < 1e-15);
        let n = normals(&m);
        assert!((n[0] - DVec3::Z).length() < 1e-12);
        assert!(n[0].dot(n[1]).abs() < 1e-12 && n[0].dot(n[3]).abs() < 1e-12 && n[1].dot(n[3]).abs() < 1e-12);
        assert!(n[1].x > 0.0 && n[3].x > 0.0, "both plates look to the radar");
        assert!(n[1].y < 0.0 && n[3].y > 0.0, "the left plate looks right");
        assert_eq!(m.positions_m[0], DVec3::ZERO);

        // L + W/2 = 197 mm for the sample of Feng's table 4.1.
        let long = Type1 { length_m: 0.117, ..base() }.mesh();
        assert_eq!(long.triangles.len(), 7);
        assert!((area_m2(&long) - area_m2(&m) - 0.117 * 0.16).abs() < 1e-15);
        let deepest = long.positions_m.iter().map(|p| p.x).fold(0.0, f64::max);
        assert!((deepest - 0.197).abs() < 1e-15);

        let tri = Type1 { plates: Triangle, ..base() }.mesh();
        assert_eq!(tri.triangles.len(), 3);
        assert!((area_m2(&tri) - (0.08 * 0.08 + leg * 0.004)).abs() < 1e-15);
    }

    #[test]
    fn slant_leans_both_plates_and_keeps_them_joined() {
        for (slant, plates) in [(5.0, Strip), (-5.0, Strip), (5.0, Triangle), (-30.0, Strip)] {
            let m = Type1 { slant_deg: slant, plates, ..base() }.mesh();
            let n = normals(&m);
            let k = m.triangles.len();
            let (l, r) = (n[1], n[k - 1]);
            let g = f64::to_radians(slant);
            // Leaning away turns the normals upwards by the slant.
            assert!((l.z - g.sin()).abs() < 1e-12 && (r.z - g.sin()).abs() < 1e-12);
            assert!((l.x - r.x).abs() < 1e-12 && (l.y + r.y).abs() < 1e-12);
            // Both triangles of a strip lie in one plane, and the seam lies in both planes.
            let seam = m.positions_m.iter().find(|p| p.z > 0.0 && p.y == 0.0).copied().unwrap();
            assert!(seam.dot(l).abs() < 1e-15 && seam.dot(r).abs() < 1e-15);
            if plates == Strip {
                assert!((n[1] - n[2]).length() < 1e-9 && (n[3] - n[4]).length() < 1e-9);
            }
            let top = m.positions_m.iter().map(|p| p.z).fold(0.0, f64::max);
            assert!((top - 0.004 * g.cos()).abs() < 1e-15);
        }
    }
}
