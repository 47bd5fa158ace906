//! Low-profile asymmetrical trihedral for road markings (Feng 2019, sections 3.3.2-3.3.4): Type 1, and
//! Type 2 with slanted plates.

use super::kind::{
    Builder, Kind, Param, Range, choice, kind_of, length, number, raised, thickened, thickness,
};
use crate::base::error::Result;
use crate::base::frames::{Pose, Target};
use crate::road::shape::{append, moved, polygon, weld};
use crate::scene::Mesh;
use glam::{DQuat, DVec3};
use serde::Deserialize;
use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

/// Outline of the standing plates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
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
/// lengthened at the back so that they meet in a seam. `raise_deg` > 0 then lifts the corner: the whole
/// turns about its front edge, which stays on the ground.
///
/// Without thickness a sheet that looks up and to the radar: 3 triangles with strips 4 more, with
/// triangles 2 more; without length 1 on the ground. With it a closed body whose reflecting faces are
/// where the sheet was, the metal behind and below them.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Type1 {
    /// Width, m.
    pub width_m: f64,
    /// Height, m.
    pub height_m: f64,
    /// Length of the bottom plate beyond the triangle, m.
    pub length_m: f64,
    /// Lean of the standing plates away from the radar, degrees.
    pub slant_deg: f64,
    /// Outline of the standing plates.
    pub plates: PlateShape,
    /// Thickness of the plates, m; 0 for sheets.
    pub thickness_m: f64,
    /// Tilt of the whole about its front edge, degrees.
    pub raise_deg: f64,
}

impl Default for Type1 {
    /// The base case of the document's chapter 3.
    fn default() -> Self {
        Type1 {
            width_m: 0.16,
            height_m: 0.004,
            length_m: 0.0,
            slant_deg: 0.0,
            plates: PlateShape::Strip,
            thickness_m: 0.0,
            raise_deg: 0.0,
        }
    }
}

const POSE: &str = "apex at the origin, bottom plate on z = 0, open to +x; raised about its front edge, or lowered by depth_m";
pub(super) const WIDTH: Param = length("width_m", 0.16, "width across the opening");
pub(super) const HEIGHT: Param = length("height_m", 0.004, "height of the vertical plates");
pub(super) const LENGTH: Param =
    number("length_m", 0.0, 0.0, 100.0, "length of the bottom plate beyond the triangle");
const PLATES: Param = choice("plates", &["strip", "triangle"], "outline of the vertical plates");
pub(super) const RAISE: Param =
    number("raise_deg", 0.0, 0.0, 45.0, "lift of the corner: tilt of the whole about its front edge");
const FILL: Param =
    Param { name: "fill", doc: "material that fills the corner, or none", range: Range::Material("none") };
const FILL_HEIGHT: Param = number(
    "fill_height_m",
    0.0,
    0.0,
    100.0,
    "height of the filling above the bottom plate; 0 fills to the upper edge of the vertical plates",
);
const DEPTH: Param =
    number("depth_m", 0.0, 0.0, 100.0, "depth of the bottom plate below z = 0: flush or buried in the road");

const fn slant(default: f64) -> Param {
    number("slant_deg", default, -45.0, 45.0, "tilt of the vertical plates away from the radar")
}

/// Type 1 in the registry.
pub static KIND: Kind = Kind {
    name: "type1",
    summary: "low-profile asymmetrical trihedral for road markings",
    pose: POSE,
    params: &[WIDTH, HEIGHT, LENGTH, slant(0.0), PLATES, thickness(0.0), RAISE, FILL, FILL_HEIGHT, DEPTH],
    ..kind_of::<Filled>()
};

/// Type 2 in the registry.
pub static TYPE2_KIND: Kind = Kind {
    name: "type2",
    summary: "type1 with slanted vertical plates",
    pose: POSE,
    params: &[WIDTH, HEIGHT, LENGTH, slant(5.0), PLATES, thickness(0.0), RAISE, FILL, FILL_HEIGHT, DEPTH],
    ..kind_of::<Filled>()
};

impl Type1 {
    /// Coordinate x of the front edge, m.
    pub fn front_m(&self) -> f64 {
        0.5 * self.width_m + self.length_m
    }

    /// The plate's corner at `height_m` in the plate above the end of the leg on `side` (1 left, -1
    /// right), or above the apex with 0.
    fn over(&self, side: f64, height_m: f64) -> DVec3 {
        let (s, c) = self.slant_deg.to_radians().sin_cos();
        let (up, back) = (DVec3::Z * height_m * c, height_m * s);
        if side == 0.0 {
            // Where the two leaning planes meet.
            return up - DVec3::X * SQRT_2 * back;
        }
        let leg_end = DVec3::new(0.5 * self.width_m, 0.5 * self.width_m * side, 0.0);
        leg_end + back * FRAC_1_SQRT_2 * DVec3::new(-1.0, side, 0.0) + up
    }

    /// The sheet before it is thickened and raised. Strips may have a seam at the height `cut_m`.
    fn sheet(&self, cut_m: Option<f64>) -> Mesh {
        let w = 0.5 * self.width_m;
        let front = self.front_m();
        let (left, right) = (self.over(1.0, 0.0), self.over(-1.0, 0.0));
        let mut mesh = Mesh::default();
        if self.length_m > 0.0 {
            let (near_right, near_left) = (DVec3::new(front, -w, 0.0), DVec3::new(front, w, 0.0));
            polygon(&mut mesh, &[DVec3::ZERO, right, near_right, near_left, left], 0);
        } else {
            polygon(&mut mesh, &[DVec3::ZERO, right, left], 0);
        }
        match self.plates {
            PlateShape::Strip => {
                let heights: Vec<f64> =
                    [Some(0.0), cut_m, Some(self.height_m)].into_iter().flatten().collect();
                for pair in heights.windows(2) {
                    let [low, high] = [pair[0], pair[1]].map(|h| [0.0, 1.0, -1.0].map(|s| self.over(s, h)));
                    polygon(&mut mesh, &[low[0], low[1], high[1], high[0]], 0);
                    polygon(&mut mesh, &[low[2], low[0], high[0], high[2]], 0);
                }
            }
            PlateShape::Triangle => {
                let seam = self.over(0.0, self.height_m);
                polygon(&mut mesh, &[DVec3::ZERO, left, seam], 0);
                polygon(&mut mesh, &[right, DVec3::ZERO, seam], 0);
            }
        }
        mesh
    }

    /// The faces that a filling shows to the air (material 1, looking outwards): together with the
    /// reflector's own sheet they close a body. `height_m` is in the plates; above them the filling
    /// has upright sides.
    fn filling(&self, height_m: f64) -> Mesh {
        let mut mesh = Mesh::default();
        let mut face = |corners: &[DVec3]| polygon(&mut mesh, corners, 1);
        let (left, right) = (self.over(1.0, 0.0), self.over(-1.0, 0.0));
        if self.plates == PlateShape::Triangle {
            face(&[self.over(0.0, self.height_m), right, left]);
            return mesh;
        }
        let brim = height_m.min(self.height_m);
        let [back, brim_left, brim_right] = [0.0, 1.0, -1.0].map(|side| self.over(side, brim));
        let rise = DVec3::Z * (height_m - brim);
        let above = rise.z > 0.0;
        let [apex, top_left, top_right] = [back, brim_left, brim_right].map(|p| p + rise);
        if above {
            face(&[apex, top_left, brim_left, back]);
            face(&[top_right, apex, back, brim_right]);
        }
        if self.length_m == 0.0 {
            face(&[apex, top_right, top_left]);
            face(&[right, left, brim_left, brim_right]);
            if above {
                face(&[brim_right, brim_left, top_left, top_right]);
            }
            return mesh;
        }
        let (x, y) = (self.front_m(), 0.5 * self.width_m);
        let feet = [DVec3::new(x, y, 0.0), DVec3::new(x, -y, 0.0)];
        let tops = feet.map(|p| p.with_z(apex.z));
        face(&[apex, top_right, tops[1], tops[0], top_left]);
        face(&[feet[1], feet[0], tops[0], tops[1]]);
        // Beside the rectangle, as fans from the front foot: the brim may lie on the upright edge.
        match above {
            true => {
                face(&[feet[0], left, brim_left, top_left, tops[0]]);
                face(&[feet[1], tops[1], top_right, brim_right, right]);
            }
            false => {
                face(&[feet[0], left, top_left, tops[0]]);
                face(&[feet[1], tops[1], top_right, right]);
            }
        }
        mesh
    }

    /// The metal alone, before `depth_m` of a filled one.
    fn metal(&self, cut_m: Option<f64>) -> Mesh {
        let sheet = self.sheet(cut_m);
        let body = thickened(sheet, self.thickness_m);
        raised(body, self.raise_deg, self.front_m())
    }
}

impl Builder for Type1 {
    fn mesh(&self) -> Mesh {
        self.metal(None)
    }
}

/// Type 1 with its corner filled (Feng 2019, figure 4.15a) and let into the road.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Filled {
    /// The reflector that is filled.
    #[serde(flatten)]
    pub reflector: Type1,
    /// Material, or "none".
    pub fill: String,
    /// Height of the filling over the bottom plate, m; 0 fills it to the brim.
    pub fill_height_m: f64,
    /// Depth of the bottom plate under z = 0.
    pub depth_m: f64,
}

impl Filled {
    fn is_filled(&self) -> bool {
        self.fill != "none"
    }
}

impl Builder for Filled {
    fn check(&self, kind: &Kind) -> Result<()> {
        let (r, high) = (&self.reflector, self.fill_height_m > 0.0);
        if !self.is_filled() && high {
            return Err(kind
                .bad("fill_height_m", self.fill_height_m, "no material of the filling is given")
                .remedy("give fill=MATERIAL as well")
                .into());
        }
        if high && r.plates == PlateShape::Triangle {
            return Err(kind
                .bad("fill_height_m", self.fill_height_m, "triangular plates can only be filled to the brim")
                .allowed("0")
                .remedy("leave it out, or use plates=strip")
                .into());
        }
        let (over, leg_m) = (-r.height_m * r.slant_deg.to_radians().sin(), r.width_m * FRAC_1_SQRT_2);
        if r.plates == PlateShape::Strip && over >= 0.999 * leg_m {
            return Err(kind
                .bad("slant_deg", r.slant_deg, "the vertical plates lean so far that they cross")
                .allowed(format!("a lean of less than {leg_m} m over the height"))
                .remedy("give a smaller slant_deg or height_m, or a larger width_m")
                .into());
        }
        kind.check_thickness(&r.sheet(None), r.thickness_m)
    }

    fn mesh(&self) -> Mesh {
        let r = &self.reflector;
        let mut mesh = match self.is_filled() {
            false => r.mesh(),
            true => {
                let height_m = if self.fill_height_m > 0.0 { self.fill_height_m } else { r.height_m };
                // Metal and filling meet corner to corner.
                let mut both = r.metal((height_m < r.height_m).then_some(height_m));
                let filling = raised(r.filling(height_m), r.raise_deg, r.front_m());
                append(&mut both, &filling, &Pose::<Target, Target>::IDENTITY);
                weld(both)
            }
        };
        if self.depth_m > 0.0 {
            let down = Pose::<Target, Target>::new(DQuat::IDENTITY, -DVec3::Z * self.depth_m);
            mesh = moved(mesh, &down);
        }
        mesh
    }

    fn further_materials(&self) -> Vec<String> {
        self.is_filled().then(|| self.fill.clone()).into_iter().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::PlateShape::{Strip, Triangle};
    use super::*;
    use crate::road::reflector::Reflector;
    use crate::road::shape::{area_m2, area_vector_m2, is_watertight, volume_m3};
    use proptest::prelude::*;

    fn normals(m: &Mesh) -> Vec<DVec3> {
        (0..m.triangles.len()).map(|t| area_vector_m2(m, t).normalize()).collect()
    }

    #[test]
    fn areas_and_right_angles() {
        let base = Type1::default();
        let leg = 0.16 * 0.5f64.sqrt();
        let m = base.mesh();
        assert_eq!(m.triangles.len(), 5);
        assert!((area_m2(&m) - (0.08 * 0.08 + 2.0 * leg * 0.004)).abs() < 1e-15);
        let n = normals(&m);
        assert!((n[0] - DVec3::Z).length() < 1e-12);
        assert!(n[0].dot(n[1]).abs() < 1e-12 && n[0].dot(n[3]).abs() < 1e-12 && n[1].dot(n[3]).abs() < 1e-12);
        assert!(n[1].x > 0.0 && n[3].x > 0.0, "both plates look to the radar");
        assert!(n[1].y < 0.0 && n[3].y > 0.0, "the left plate looks right");
        assert_eq!(m.positions_m[0], DVec3::ZERO);

        // L + W/2 = 197 mm for the sample of Feng's table 4.1.
        let long = Type1 { length_m: 0.117, ..base }.mesh();
        assert_eq!(long.triangles.len(), 7);
        assert!((area_m2(&long) - area_m2(&m) - 0.117 * 0.16).abs() < 1e-15);
        let deepest = long.positions_m.iter().map(|p| p.x).fold(0.0, f64::max);
        assert!((deepest - 0.197).abs() < 1e-15);

        let tri = Type1 { plates: Triangle, ..base }.mesh();
        assert_eq!(tri.triangles.len(), 3);
        assert!((area_m2(&tri) - (0.08 * 0.08 + leg * 0.004)).abs() < 1e-15);
    }

    #[test]
    fn slant_leans_both_plates_and_keeps_them_joined() {
        for (slant, plates) in [(5.0, Strip), (-5.0, Strip), (5.0, Triangle), (-30.0, Strip)] {
            let m = Type1 { slant_deg: slant, plates, ..Type1::default() }.mesh();
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

    /// The metal's volume by hand: the slab under the sheet with its mitred rim, and two mitred walls.
    #[test]
    fn metal_lies_behind_the_reflecting_faces() {
        let t = 0.0005;
        let r = Type1 { thickness_m: t, length_m: 0.05, ..Type1::default() };
        let (solid, sheet) = (r.mesh(), Type1 { thickness_m: 0.0, ..r }.mesh());
        assert!(is_watertight(&solid));
        let thin = volume_m3(&solid) / (area_m2(&sheet) * t);
        assert!((1.0..1.06).contains(&thin), "{thin}");
        // The sheet's facets are the body's first, unmoved.
        assert_eq!(solid.triangles[..sheet.triangles.len()], sheet.triangles[..]);
        assert_eq!(solid.positions_m[..sheet.positions_m.len()], sheet.positions_m[..]);
        let low = solid.positions_m.iter().map(|p| p.z).fold(f64::MAX, f64::min);
        assert!((low + t).abs() < 1e-15);
    }

    #[test]
    fn raised_corner_keeps_the_front_edge() {
        for length_m in [0.0, 0.117] {
            let flat = Type1 { length_m, ..Type1::default() };
            let a = f64::to_radians(2.0);
            let m = Type1 { raise_deg: 2.0, ..flat }.mesh();
            let front = flat.front_m();
            assert!((m.positions_m[0].z - front * a.sin()).abs() < 1e-15, "the apex rises");
            let edge: Vec<_> =
                m.positions_m.iter().filter(|p| p.z.abs() < 1e-15 && (p.x - front).abs() < 1e-15).collect();
            assert!(edge.len() >= 2, "the front edge stays");
            assert!((area_m2(&m) - area_m2(&flat.mesh())).abs() < 1e-15);
        }
    }

    /// Metal below the filling's brim turned over, and the filling: a closed body of the right volume.
    #[test]
    fn filling_and_metal_close_a_body() {
        for (height, fill, length, slant, plates, depth) in [
            (0.004_f64, 0.0_f64, 0.0, 0.0, "strip", 0.004),
            (0.004, 0.0, 0.117, 0.0, "strip", 0.0),
            (0.004, 0.007, 0.0, 0.0, "strip", 0.007),
            (0.004, 0.007, 0.05, 5.0, "strip", 0.007),
            (0.010, 0.004, 0.05, -3.0, "strip", 0.0),
            (0.010, 0.004, 0.0, 0.0, "strip", 0.0),
            (0.010, 0.0, 0.0, 0.0, "triangle", 0.0),
        ] {
            let spec = format!(
                "type1:height_m={height},fill=foam,fill_height_m={fill},length_m={length},slant_deg={slant},\
                 plates={plates},depth_m={depth}"
            );
            let mut m = Reflector::parse(&spec).unwrap().mesh().unwrap();
            let brim = if fill > 0.0 { fill } else { height };
            let top = brim.min(height) * f64::to_radians(slant).cos() + (brim - height).max(0.0) - depth;
            let kept: Vec<usize> = (0..m.triangles.len())
                .filter(|&t| m.triangles[t].iter().all(|&i| m.positions_m[i as usize].z < top + 1e-12))
                .collect();
            assert!(brim < height || kept.len() == m.triangles.len(), "{spec}");
            m.triangles = kept
                .iter()
                .map(|&t| {
                    let [a, b, c] = m.triangles[t];
                    if m.material[t] == 0 { [a, c, b] } else { [a, b, c] }
                })
                .collect();
            m.material.truncate(m.triangles.len());
            assert!(is_watertight(&m), "{spec}");
            if slant == 0.0 && plates == "strip" {
                let by_hand = (0.08 * 0.08 + 0.16 * length) * brim;
                assert!((volume_m3(&m) - by_hand).abs() < 1e-15, "{spec}: {}", volume_m3(&m));
            }
            assert!(volume_m3(&m) > 0.0, "{spec}");
        }
        let pyramid = Filled {
            reflector: Type1 { plates: Triangle, ..Type1::default() },
            fill: "foam".into(),
            fill_height_m: 0.0,
            depth_m: 0.0,
        };
        assert_eq!(pyramid.mesh().material, [0, 0, 0, 1]);
        assert_eq!(pyramid.further_materials(), ["foam"]);
    }

    #[test]
    fn a_filling_needs_a_material_and_a_brim() {
        for (spec, says) in [
            ("type1:fill_height_m=0.01", "fill=MATERIAL"),
            ("type1:fill=ice,plates=triangle,fill_height_m=1", "strip"),
        ] {
            let e = Reflector::parse(spec).unwrap_err().to_string();
            assert!(e.contains(says) && e.contains("type1:fill_height_m"), "{e}");
        }
    }

    proptest! {
        #[test]
        fn thick_ones_are_closed(
            w in 0.01f64..0.5, h in 0.0005f64..0.2, l in 0.0f64..0.3, slant in -40.0f64..40.0,
            t in 1e-4f64..0.01, raise in 0.0f64..5.0, triangle in any::<bool>(),
        ) {
            let plates = if triangle { "triangle" } else { "strip" };
            let spec = format!(
                "type2:width_m={w},height_m={h},length_m={l},slant_deg={slant},thickness_m={t},raise_deg={raise},plates={plates}"
            );
            match Reflector::parse(&spec) {
                Ok(r) => {
                    let m = r.mesh().unwrap();
                    prop_assert!(is_watertight(&m), "{}", spec);
                    prop_assert!(volume_m3(&m) > 0.0, "{}", spec);
                    prop_assert!((0..m.triangles.len()).all(|i| area_vector_m2(&m, i).length() > 0.0));
                }
                Err(e) => {
                    let e = e.to_string();
                    prop_assert!(e.contains("thickness_m") || e.contains("slant_deg"), "{}", e);
                }
            }
        }
    }
}
