//! Type 1 with one curved standing plate instead of two straight ones (Feng 2019, figures 3.13f, 4.1c).

use super::kind::{Builder, Kind, SAGITTA, choice, kind_of, length, raised, thickened, thickness};
use super::type1::{HEIGHT, LENGTH, RAISE, WIDTH};
use crate::base::error::Result;
use crate::road::shape::{curved_polygon, polygon, weld};
use crate::scene::Mesh;
use glam::DVec3;
use serde::Deserialize;

/// The side to which the plate bends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Curve {
    /// Centre of curvature in front, over the bottom plate or beyond it.
    Concave,
    /// Centre of curvature behind.
    Convex,
}

/// The middle of the curved plate's foot at the origin, open to +x. The plate stands upright on an arc
/// of radius `radius_m` whose chord is the whole width; the bottom plate runs from the arc to a straight
/// front edge. Its total depth, from its rearmost point, is width/2 + `length_m` as for a Type 1 of the
/// same width and length. The arc's corners lie on the circle.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Type4 {
    /// Width, m.
    pub width_m: f64,
    /// Height, m.
    pub height_m: f64,
    /// Length of the bottom plate beyond the triangle, m.
    pub length_m: f64,
    /// Radius of the arc, m.
    pub radius_m: f64,
    /// The side to which the plate bends.
    pub curve: Curve,
    /// Thickness of the plates, m; 0 for sheets.
    pub thickness_m: f64,
    /// Tilt of the whole about its front edge, degrees.
    pub raise_deg: f64,
    /// How far facets may lie off the arc, m.
    pub sagitta_m: f64,
}

/// Type 4 in the registry.
pub static KIND: Kind = Kind {
    name: "type4",
    summary: "type1 with one curved vertical plate",
    pose: "middle of the plate's foot at the origin, bottom plate on z = 0, open to +x; raised about its front edge",
    params: &[
        WIDTH,
        HEIGHT,
        LENGTH,
        length("radius_m", 0.5, "radius of the vertical plate"),
        choice("curve", &["concave", "convex"], "direction of the plate's curvature"),
        thickness(0.0),
        RAISE,
        SAGITTA,
    ],
    ..kind_of::<Type4>()
};

impl Type4 {
    /// Depth of the arc over its chord.
    pub fn sag_m(&self) -> f64 {
        let half = 0.5 * self.width_m;
        // R - sqrt(R² - w²) without its cancellation.
        half * half / (self.radius_m + (self.radius_m * self.radius_m - half * half).max(0.0).sqrt())
    }

    /// Coordinate x of the straight front edge, m.
    pub fn front_m(&self) -> f64 {
        let depth = 0.5 * self.width_m + self.length_m;
        if self.curve == Curve::Concave { depth } else { depth - self.sag_m() }
    }

    /// Facets along the arc: the fewest, and an even number, that keep the sagitta.
    fn segments(&self) -> usize {
        let whole = 2.0 * (0.5 * self.width_m / self.radius_m).min(1.0).asin();
        // A facet over the angle 2a lies R (1 - cos a) inside the arc.
        let a = 2.0 * (0.5 * self.sagitta_m / self.radius_m).min(1.0).sqrt().asin();
        2 * ((0.25 * whole / a).ceil() as usize).max(1)
    }

    fn sheet(&self) -> Mesh {
        let n = self.segments();
        let whole = 2.0 * (0.5 * self.width_m / self.radius_m).min(1.0).asin();
        let bend = if self.curve == Curve::Concave { 1.0 } else { -1.0 };
        // From right to left: foot of the plate and its normal, towards the radar.
        let arc: Vec<(DVec3, DVec3)> = (0..=n)
            .map(|i| {
                let (s, c) = (whole * (i as f64 / n as f64 - 0.5)).sin_cos();
                let foot = DVec3::new(bend * self.radius_m * (1.0 - c), self.radius_m * s, 0.0);
                (foot, DVec3::new(c, -bend * s, 0.0))
            })
            .collect();
        let up = DVec3::Z * self.height_m;
        let front = self.front_m();
        let mut mesh = Mesh::default();
        for pair in arc.windows(2) {
            let ((p, np), (q, nq)) = (pair[0], pair[1]);
            let ahead = [p, q].map(|a| a.with_x(front));
            // Where the arc runs out at the front edge there is a corner less.
            let near = 1e-9 * self.width_m;
            let mut corners = vec![p];
            corners.extend([ahead[0]].iter().filter(|a| a.x - p.x > near));
            corners.extend([ahead[1]].iter().filter(|a| a.x - q.x > near));
            corners.push(q);
            polygon(&mut mesh, &corners, 0);
            curved_polygon(&mut mesh, &[p, q, q + up, p + up], &[np, nq, nq, np], 0);
        }
        weld(mesh)
    }
}

impl Builder for Type4 {
    fn check(&self, kind: &Kind) -> Result<()> {
        let bad = |problem: String, allowed: f64| {
            kind.bad("radius_m", self.radius_m, problem).allowed(format!("at least {allowed}"))
        };
        let half = 0.5 * self.width_m;
        if self.radius_m < half {
            return Err(bad("the arc does not reach across the width".into(), half)
                .remedy("give a larger radius_m or a smaller width_m")
                .into());
        }
        let depth = half + self.length_m;
        if self.sag_m() > depth {
            // s = R - sqrt(R² - w²) solved for R.
            let least = (half * half + depth * depth) / (2.0 * depth);
            return Err(bad(format!("the arc exceeds the bottom plate's depth of {depth} m"), least)
                .remedy("give a larger radius_m or length_m")
                .into());
        }
        kind.check_triangles(8.0 * self.segments() as f64)?;
        kind.check_thickness(&self.sheet(), self.thickness_m)
    }

    fn mesh(&self) -> Mesh {
        let sheet = self.sheet();
        let body = thickened(sheet, self.thickness_m);
        raised(body, self.raise_deg, self.front_m())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::road::reflector::Reflector;
    use crate::road::shape::{area_vector_m2, is_watertight, volume_m3};
    use proptest::prelude::*;

    fn base(radius_m: f64, curve: Curve) -> Type4 {
        Type4 {
            width_m: 0.16,
            height_m: 0.004,
            length_m: 0.0,
            radius_m,
            curve,
            thickness_m: 0.0,
            raise_deg: 0.0,
            sagitta_m: super::super::DEFAULT_SAGITTA_M,
        }
    }

    #[test]
    fn arc_area_and_facing() {
        for curve in [Curve::Concave, Curve::Convex] {
            for radius_m in [0.1, 0.5, 1.0, 20.0] {
                let t = base(radius_m, curve);
                let m = t.mesh();
                let angle = 2.0 * (0.08f64 / radius_m).asin();
                let segment = 0.5 * radius_m * radius_m * (angle - angle.sin());
                let (mut floor, mut wall) = (0.0, 0.0);
                for i in 0..m.triangles.len() {
                    let a = area_vector_m2(&m, i);
                    if m.corner_normals(i).is_some() {
                        wall += a.length();
                        assert!(a.x > 0.0 && a.z.abs() < 1e-18, "looks to the radar");
                        let n = m.corner_normals(i).unwrap();
                        assert!(
                            n.iter().all(|n| n.dot(a.normalize()) > 0.98 && (n.length() - 1.0).abs() < 1e-12)
                        );
                    } else {
                        assert!(a.z > 0.0, "the floor looks up");
                        floor += a.z;
                    }
                }
                assert!((wall / (radius_m * angle * 0.004) - 1.0).abs() < 1e-3);
                // The whole depth is W/2 behind the front edge; a concave arc adds its segment to the
                // rectangle before its chord, a convex one takes it away.
                let chord_to_front = match curve {
                    Curve::Concave => 0.08 - t.sag_m(),
                    Curve::Convex => 0.08,
                };
                let exact = 0.16 * chord_to_front + if curve == Curve::Concave { segment } else { -segment };
                assert!((floor / exact - 1.0).abs() < 2e-3, "{curve:?} {radius_m}: {floor} {exact}");
                // Facets stay within the sagitta of the circle.
                let centre = if curve == Curve::Concave { radius_m } else { -radius_m };
                for i in (0..m.triangles.len()).filter(|i| m.corner_normals(*i).is_some()) {
                    let p = m.triangles[i].map(|j| m.positions_m[j as usize]);
                    let far = area_vector_m2(&m, i).normalize().dot(p[0] - DVec3::X * centre).abs();
                    assert!(radius_m - far < t.sagitta_m * (1.0 + 1e-6) + 1e-15, "{}", radius_m - far);
                }
            }
        }
    }

    #[test]
    fn the_tightest_arc_is_a_half_circle() {
        // Its ends run out at the front edge.
        let m = base(0.08, Curve::Concave).mesh();
        assert!((0..m.triangles.len()).all(|t| area_vector_m2(&m, t).length() > 0.0));
        for (spec, says) in [
            ("type4:radius_m=0.07", "at least 0.08"),
            ("type4:radius_m=0.001", "0.08"),
            ("type4:width_m=1,length_m=0,radius_m=0.4", "0.5"),
        ] {
            let e = Reflector::parse(spec).unwrap_err().to_string();
            assert!(e.contains(says) && e.contains("radius_m"), "{e}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn thick_ones_are_closed(
            w in 0.02f64..0.3, h in 0.001f64..0.05, l in 0.0f64..0.2, r in 0.51f64..8.0,
            t in 1e-4f64..0.002, raise in 0.0f64..3.0, convex in any::<bool>(),
        ) {
            let curve = if convex { "convex" } else { "concave" };
            let spec = format!(
                "type4:width_m={w},height_m={h},length_m={l},radius_m={},thickness_m={t},raise_deg={raise},curve={curve},sagitta_m=1e-4",
                r * w
            );
            let m = Reflector::parse(&spec).unwrap().mesh().unwrap();
            prop_assert!(is_watertight(&m), "{}", spec);
            prop_assert!(volume_m3(&m) > 0.0, "{}", spec);
            prop_assert!((0..m.triangles.len()).all(|i| area_vector_m2(&m, i).length() > 0.0));
        }
    }
}
