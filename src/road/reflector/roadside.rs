//! What stands beside a road: guard rail, its post, kerb, sign pole. Sizes are typical ones, all of them
//! parameters; the rail's section is that of `road::objects`.

use super::cylinder::{Cylinder, Ends};
use super::kind::{Builder, Kind, SAGITTA, choice, kind_of, length, number, thickened, thickness};
use crate::base::error::Result;
use crate::base::frames::{Pose, Target};
use crate::road::objects::{W_BEAM_HALF_HEIGHT_M, u_post, w_beam_section};
use crate::road::shape::{append, curved_polygon, polygon, weld};
use crate::scene::Mesh;
use glam::{DQuat, DVec2, DVec3};
use serde::Deserialize;
use std::f64::consts::{FRAC_PI_2, PI};

/// Whether a rail has posts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Posts {
    /// The barrier has posts.
    Yes,
    /// The barrier has no posts.
    No,
}

/// A W-beam along y whose trough lies in the plane x = 0, on U-shaped posts behind it. As sheets, or the
/// beam and each post a closed body.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct GuardRail {
    /// Length, m.
    pub length_m: f64,
    /// Upper edge of the beam over the ground.
    pub height_m: f64,
    /// Distance from post to post, m.
    pub spacing_m: f64,
    /// Whether there are posts.
    pub posts: Posts,
    /// Thickness of the metal, m; 0 for sheets.
    pub thickness_m: f64,
    /// How far facets may lie off curves, m.
    pub sagitta_m: f64,
}

/// The rail in the registry.
pub static RAIL_KIND: Kind = Kind {
    name: "guard-rail",
    summary: "W-beam guard rail on posts",
    pose: "beam along y over the origin, its waves towards +x, posts behind it on z = 0, the middle one at y = 0",
    params: &[
        length("length_m", 4.0, "length of the beam"),
        number(
            "height_m",
            0.75,
            2.0 * W_BEAM_HALF_HEIGHT_M,
            10.0,
            "height of the beam's upper edge above the ground",
        ),
        length("spacing_m", 2.0, "distance between posts"),
        choice("posts", &["yes", "no"], "with or without posts"),
        thickness(0.0),
        SAGITTA,
    ],
    material: "steel",
    ..kind_of::<GuardRail>()
};

impl GuardRail {
    fn beam(&self) -> Mesh {
        let y = DVec3::Y * 0.5 * self.length_m;
        let middle = self.height_m - W_BEAM_HALF_HEIGHT_M;
        let at = |p: DVec2| DVec3::new(p.x, 0.0, p.y + middle);
        let mut mesh = Mesh::default();
        for pair in w_beam_section(self.sagitta_m).windows(2) {
            let ((p, np), (q, nq)) = (pair[0], pair[1]);
            let corners = [at(p) - y, at(p) + y, at(q) + y, at(q) - y];
            let normals = [np, np, nq, nq].map(|n| DVec3::new(n.x, 0.0, n.y));
            match np == nq {
                true => polygon(&mut mesh, &corners, 0),
                false => curved_polygon(&mut mesh, &corners, &normals, 0),
            }
        }
        weld(mesh)
    }

    /// y of the posts: the middle one at zero, the others as far as the beam reaches.
    fn posts_m(&self) -> Vec<f64> {
        let n = (0.5 * self.length_m / self.spacing_m * (1.0 + 1e-12)) as i64;
        (-n..=n).map(|i| i as f64 * self.spacing_m).collect()
    }
}

impl Builder for GuardRail {
    fn check(&self, kind: &Kind) -> Result<()> {
        // Facets of a bend of 24 mm, of which there are pi rad in each half.
        kind.check_triangles(8.0 * PI / (0.5 * self.sagitta_m / 0.024).min(1.0).sqrt().asin() / 4.0)?;
        if self.posts == Posts::Yes && self.length_m / self.spacing_m > 1e4 {
            return Err(kind
                .bad("spacing_m", self.spacing_m, "more than ten thousand posts")
                .allowed(format!("at least {}", self.length_m / 1e4))
                .remedy("give a larger spacing_m or posts=no")
                .into());
        }
        if self.thickness_m > 0.02 {
            return Err(kind.too_thick(self.thickness_m));
        }
        kind.check_thickness(&self.beam(), self.thickness_m)
    }

    fn mesh(&self) -> Mesh {
        let solid = |sheet: Mesh| thickened(sheet, self.thickness_m);
        let mut mesh = solid(self.beam());
        if self.posts == Posts::Yes {
            // Turned so that it opens along the rail, a millimetre behind the metal of the beam.
            let post = solid(u_post(POST_M[0], POST_M[1], self.height_m, 0));
            let behind = 0.5 * POST_M[0] + 2.0 * self.thickness_m + 0.001;
            for y in self.posts_m() {
                let turn = DQuat::from_rotation_z(FRAC_PI_2);
                append(&mut mesh, &post, &Pose::<Target, Target>::new(turn, DVec3::new(-behind, y, 0.0)));
            }
        }
        mesh
    }
}

/// Web and flanges of the post that `road::demo` uses too.
const POST_M: [f64; 2] = [0.10, 0.06];

/// A post of U section alone.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct GuardPost {
    /// Width, m.
    pub width_m: f64,
    /// Depth, m.
    pub depth_m: f64,
    /// Height, m.
    pub height_m: f64,
    /// Thickness of the metal, m; 0 for sheets.
    pub thickness_m: f64,
}

/// The post in the registry.
pub static POST_KIND: Kind = Kind {
    name: "guard-post",
    summary: "guard rail post of U section",
    pose: "on z = 0, web in the plane x = 0, open to +x",
    params: &[
        length("width_m", POST_M[0], "width of the web, along y"),
        length("depth_m", POST_M[1], "depth of the flanges"),
        length("height_m", 0.75, "height"),
        thickness(0.0),
    ],
    material: "steel",
    ..kind_of::<GuardPost>()
};

impl Builder for GuardPost {
    fn mesh(&self) -> Mesh {
        let sheet = u_post(self.width_m, self.depth_m, self.height_m, 0);
        // Outside the U there is always room.
        thickened(sheet, self.thickness_m)
    }
}

/// A kerb stone: a closed prism along y whose upper front edge is rounded.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Kerb {
    /// Length, m.
    pub length_m: f64,
    /// Width, m.
    pub width_m: f64,
    /// Height, m.
    pub height_m: f64,
    /// Radius of the upper front edge, m.
    pub edge_radius_m: f64,
    /// How far facets may lie off the edge's arc, m.
    pub sagitta_m: f64,
}

/// The kerb in the registry.
pub static KERB_KIND: Kind = Kind {
    name: "kerb",
    summary: "kerb stone with a rounded edge",
    pose: "along y, centred over the origin, its face in the plane x = 0 towards +x, on z = 0",
    params: &[
        length("length_m", 1.0, "length along y"),
        length("width_m", 0.15, "width along x"),
        length("height_m", 0.12, "height above the road"),
        number("edge_radius_m", 0.02, 0.0, 10.0, "radius of the upper front edge; 0 is sharp"),
        SAGITTA,
    ],
    material: "concrete",
    ..kind_of::<Kerb>()
};

impl Kerb {
    fn segments(&self) -> usize {
        if self.edge_radius_m == 0.0 {
            return 0;
        }
        let step = 4.0 * (0.5 * self.sagitta_m / self.edge_radius_m).min(1.0).sqrt().asin();
        (FRAC_PI_2 / step).ceil().max(1.0) as usize
    }
}

impl Builder for Kerb {
    fn check(&self, kind: &Kind) -> Result<()> {
        let most = self.width_m.min(self.height_m);
        if self.edge_radius_m >= most {
            return Err(kind
                .bad("edge_radius_m", self.edge_radius_m, "the edge is rounder than the stone is thick")
                .allowed(format!("less than {most}"))
                .remedy("give a smaller edge_radius_m")
                .into());
        }
        kind.check_triangles(4.0 * self.segments() as f64 + 16.0)
    }

    fn mesh(&self) -> Mesh {
        let (w, h, r) = (self.width_m, self.height_m, self.edge_radius_m);
        let y = DVec3::Y * 0.5 * self.length_m;
        // (x, z) counter-clockwise, with the normals of the rounding.
        let mut outline: Vec<(DVec2, DVec2)> =
            vec![(DVec2::new(-w, 0.0), DVec2::ZERO), (DVec2::ZERO, DVec2::X)];
        let n = self.segments();
        if n == 0 {
            outline.push((DVec2::new(0.0, h), DVec2::ZERO));
        } else {
            outline.extend((0..=n).map(|i| {
                let normal = match i {
                    0 => DVec2::X,
                    i if i == n => DVec2::Y,
                    i => DVec2::from_angle(FRAC_PI_2 * i as f64 / n as f64),
                };
                (DVec2::new(-r, h - r) + r * normal, normal)
            }));
        }
        outline.push((DVec2::new(-w, h), DVec2::ZERO));
        let at = |p: DVec2| DVec3::new(p.x, 0.0, p.y);
        let mut mesh = Mesh::default();
        for i in 0..outline.len() {
            let ((p, np), (q, nq)) = (outline[i], outline[(i + 1) % outline.len()]);
            let corners = [at(p) - y, at(p) + y, at(q) + y, at(q) - y];
            if i >= 2 && i < 2 + n {
                curved_polygon(&mut mesh, &corners, &[at(np), at(np), at(nq), at(nq)], 0);
            } else {
                polygon(&mut mesh, &corners, 0);
            }
        }
        let end: Vec<DVec3> = outline.iter().map(|p| at(p.0)).collect();
        polygon(&mut mesh, &end.iter().map(|p| *p - y).collect::<Vec<_>>(), 0);
        polygon(&mut mesh, &end.iter().rev().map(|p| *p + y).collect::<Vec<_>>(), 0);
        weld(mesh)
    }
}

/// What sign a pole bears.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Sign {
    /// A round one.
    Round,
    /// None.
    None,
}

/// A round pole, with a round sign before its upper end or without: closed bodies.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct SignPole {
    /// Radius of the pole, m.
    pub radius_m: f64,
    /// Height of the pole, m.
    pub height_m: f64,
    /// What it bears.
    pub sign: Sign,
    /// Its diameter.
    pub sign_m: f64,
    /// Thickness of the sign, m.
    pub sign_thickness_m: f64,
    /// How far facets may lie off curves, m.
    pub sagitta_m: f64,
}

/// The pole in the registry.
pub static POLE_KIND: Kind = Kind {
    name: "sign-pole",
    summary: "round pole with a round sign",
    pose: "pole on z = 0, its axis along z; the sign in front of its upper end, facing +x",
    params: &[
        length("radius_m", 0.030_15, "radius of the pole (60.3 mm is a series 1 diameter of ISO 4200)"),
        length("height_m", 2.6, "height of the pole"),
        choice("sign", &["round", "none"], "with or without a round sign"),
        length("sign_m", 0.6, "diameter of the sign"),
        number("sign_thickness_m", 0.002, 1e-4, 1.0, "thickness of the sign"),
        SAGITTA,
    ],
    material: "aluminium",
    ..kind_of::<SignPole>()
};

impl SignPole {
    fn parts(&self) -> Vec<(Cylinder, Pose<Target, Target>)> {
        let cylinder = |radius_m: f64, length_m: f64| Cylinder {
            radius_m,
            length_m,
            sagitta_m: self.sagitta_m,
            ends: Ends::Closed,
        };
        let up = Pose::new(DQuat::IDENTITY, DVec3::Z * 0.5 * self.height_m);
        let mut parts = vec![(cylinder(self.radius_m, self.height_m), up)];
        if self.sign == Sign::Round {
            let (sign_m, thickness_m) = (self.sign_m, self.sign_thickness_m);
            // Brackets, which are left out, hold it 20 mm before the pole.
            let x = self.radius_m + 0.02 + 0.5 * thickness_m;
            let at = DVec3::new(x, 0.0, self.height_m - 0.5 * sign_m);
            let turn = DQuat::from_rotation_y(FRAC_PI_2);
            parts.push((cylinder(0.5 * sign_m, thickness_m), Pose::new(turn, at)));
        }
        parts
    }
}

impl Builder for SignPole {
    fn check(&self, kind: &Kind) -> Result<()> {
        if self.sign == Sign::Round && self.sign_m > self.height_m {
            return Err(kind
                .bad("sign_m", self.sign_m, "the sign reaches into the ground")
                .allowed(format!("up to height_m = {}", self.height_m))
                .remedy("give a smaller sign_m or sign=none")
                .into());
        }
        kind.check_triangles(self.parts().iter().map(|(c, _)| 4.0 * c.segments() as f64).sum())
    }

    fn mesh(&self) -> Mesh {
        let mut mesh = Mesh::default();
        for (cylinder, pose) in self.parts() {
            append(&mut mesh, &cylinder.mesh(), &pose);
        }
        mesh
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::road::objects::W_BEAM_DEPTH_M;
    use crate::road::reflector::DEFAULT_SAGITTA_M;
    use crate::road::reflector::Reflector;
    use crate::road::reflector::cylinder::disc_share;
    use crate::road::shape::{area_vector_m2, is_watertight, volume_m3};
    use proptest::prelude::*;

    fn mesh(spec: &str) -> Mesh {
        Reflector::parse(spec).unwrap().mesh().unwrap()
    }

    fn bounds(m: &Mesh) -> (DVec3, DVec3) {
        m.positions_m.iter().fold((DVec3::MAX, DVec3::MIN), |(lo, hi), p| (lo.min(*p), hi.max(*p)))
    }

    #[test]
    fn rail_stands_where_it_says() {
        let m = mesh("guard-rail");
        let (lo, hi) = bounds(&m);
        assert!((hi - DVec3::new(W_BEAM_DEPTH_M, 2.0 + POST_M[1], 0.75)).abs().max_element() < 2e-5, "{hi}");
        assert!((lo - DVec3::new(-0.101, -2.0, 0.0)).abs().max_element() < 1e-12, "{lo}");
        let beam = mesh("guard-rail:posts=no");
        assert!((0..beam.triangles.len()).all(|t| area_vector_m2(&beam, t).x > 0.0), "looks at the traffic");
        assert!(beam.is_smooth());
        assert_eq!(m.triangles.len() - beam.triangles.len(), 3 * 6);
        let thick = mesh("guard-rail:thickness_m=0.00267");
        assert!(is_watertight(&thick));
        // Developed width times length times thickness, and three posts.
        let metal = 0.4827 * 4.0 * 0.00267 + 3.0 * 0.22 * 0.75 * 0.00267;
        assert!((volume_m3(&thick) / metal - 1.0).abs() < 0.03, "{}", volume_m3(&thick) / metal);
        assert!(Reflector::parse("guard-rail:thickness_m=0.03").is_err());
    }

    #[test]
    fn kerb_and_pole_have_their_volume() {
        let k = mesh("kerb");
        assert!(is_watertight(&k) && k.is_smooth());
        let exact = 0.15 * 0.12 - 0.02 * 0.02 * (1.0 - PI / 4.0);
        assert!((volume_m3(&k) / exact - 1.0).abs() < 1e-4, "{}", volume_m3(&k) / exact);
        let sharp = mesh("kerb:edge_radius_m=0");
        assert!((volume_m3(&sharp) - 0.018).abs() < 1e-15 && !sharp.is_smooth());
        assert_eq!(Reflector::parse("kerb").unwrap().material, "concrete");
        let p = mesh("sign-pole");
        assert!(is_watertight(&p));
        let share = |radius_m| disc_share(radius_m, DEFAULT_SAGITTA_M);
        let pole = PI * 0.03015f64.powi(2) * 2.6 * share(0.03015);
        let exact = pole + PI * 0.09 * 0.002 * share(0.3);
        assert!((volume_m3(&p) / exact - 1.0).abs() < 1e-9);
        let (lo, hi) = bounds(&p);
        assert!(lo.z.abs() < 1e-12 && hi.z >= 2.6 && hi.z < 2.601 && (hi.x - 0.05215).abs() < 1e-9);
        assert!((volume_m3(&mesh("sign-pole:sign=none")) / pole - 1.0).abs() < 1e-9);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn closed_in_all_sizes(
            w in 0.02f64..0.5, h in 0.35f64..1.0, t in 1e-4f64..0.02, r in 0.0f64..0.019, l in 0.1f64..3.0,
        ) {
            for spec in [
                format!("kerb:width_m={w},height_m={h},edge_radius_m={r},length_m={l}"),
                format!("guard-post:width_m={w},height_m={h},depth_m={},thickness_m={t}", 0.3 * w),
                format!("guard-rail:height_m={h},thickness_m={t},length_m={l},spacing_m={},sagitta_m=1e-4", 0.4 * l),
                format!("sign-pole:height_m={l},sign_m={},radius_m={},sagitta_m=1e-4", 0.5 * l, 0.05 * w),
            ] {
                let m = mesh(&spec);
                prop_assert!(is_watertight(&m), "{}", spec);
                prop_assert!(volume_m3(&m) > 0.0, "{}", spec);
                prop_assert!((0..m.triangles.len()).all(|i| area_vector_m2(&m, i).length() > 0.0));
            }
        }
    }
}
