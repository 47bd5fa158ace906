//! Flat things on the road that return little (Feng 2019, figure 4.11): stripes, crossed stripes, wire
//! mesh, chaff and a wavy sheet.

use super::kind::{
    Builder, Built, HALF_WAVE_M, Kind, MAX_TRIANGLES, Param, SAGITTA, Values, built, kind_of, length, number,
    thickened, thickness, whole,
};
use crate::base::error::Result;
use crate::base::rng::philox4x32_10;
use crate::road::shape::{Terrace, curved_polygon, polygon, terraces, weld};
use crate::scene::Mesh;
use glam::{DQuat, DVec2, DVec3};
use serde::Deserialize;
use std::f64::consts::TAU;

/// Bars across the boresight, with or without others along it, in one plane on z = 0. Without thickness
/// a sheet that looks up, otherwise a closed body on z = 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lattice {
    /// Width, m.
    pub width_m: f64,
    /// Depth, m.
    pub depth_m: f64,
    /// Width of a bar, m.
    pub bar_m: f64,
    /// Gap between bars, m.
    pub gap_m: f64,
    /// Whether bars run both ways.
    pub crossed: bool,
    /// Thickness, m; 0 for a sheet.
    pub thickness_m: f64,
}

const POSE: &str = "on z = 0, centred at the origin, the bars along y";
const CROSSED_POSE: &str = "on z = 0, centred at the origin, the bars along x and y";
pub(super) const WIDTH: Param = length("width_m", 0.16, "maximum extent along y");
pub(super) const DEPTH: Param = length("depth_m", 0.08, "maximum extent along x");
const STRIPE: Param = length("stripe_m", HALF_WAVE_M, "width of a stripe; half a wavelength at 77 GHz");
const GAP: Param = length("gap_m", HALF_WAVE_M, "width of the gap between two stripes");

/// Stripes in the registry.
pub static STRIPES_KIND: Kind = Kind {
    name: "stripes",
    summary: "parallel metal stripes",
    pose: POSE,
    params: &[WIDTH, DEPTH, STRIPE, GAP, thickness(0.0002)],
    boresight_deg: (0.0, 0.0),
    material: "pec",
    build: |v| Lattice::build(v, v.number("stripe_m"), v.number("gap_m"), false),
};

/// Crossed stripes in the registry.
pub static CROSSED_KIND: Kind = Kind {
    name: "crossed-stripes",
    summary: "metal stripes in two directions",
    pose: CROSSED_POSE,
    params: &[WIDTH, DEPTH, STRIPE, GAP, thickness(0.0002)],
    boresight_deg: (0.0, 0.0),
    material: "pec",
    build: |v| Lattice::build(v, v.number("stripe_m"), v.number("gap_m"), true),
};

/// The wire mesh in the registry.
pub static MESH_KIND: Kind = Kind {
    name: "mesh",
    summary: "wire mesh with flat bars as wires",
    pose: CROSSED_POSE,
    params: &[
        WIDTH,
        DEPTH,
        length("pitch_m", 0.005, "pitch of the wires, from centre to centre"),
        length("wire_m", 0.0005, "width of a wire"),
        thickness(0.0005),
    ],
    boresight_deg: (0.0, 0.0),
    material: "pec",
    build: |v| {
        let (pitch, wire) = (v.number("pitch_m"), v.number("wire_m"));
        if wire >= pitch {
            return Err(v
                .kind
                .bad("wire_m", wire, "the wires leave no hole")
                .allowed(format!("less than pitch_m = {pitch}"))
                .remedy("give a larger pitch_m")
                .into());
        }
        Lattice::build(v, wire, pitch - wire, true)
    },
};

impl Lattice {
    fn build(v: &Values, bar_m: f64, gap_m: f64, crossed: bool) -> Result<Built> {
        let l = Lattice {
            width_m: v.number("width_m"),
            depth_m: v.number("depth_m"),
            bar_m,
            gap_m,
            crossed,
            thickness_m: v.number("thickness_m"),
        };
        built(v.kind, l)
    }

    /// Whole bars on an extent.
    fn bars(&self, extent_m: f64) -> f64 {
        ((extent_m + self.gap_m) / (self.bar_m + self.gap_m) * (1.0 + 1e-12)).floor()
    }

    /// Edges of the bars on an extent, centred.
    fn edges(&self, extent_m: f64) -> Vec<f64> {
        let n = self.bars(extent_m) as usize;
        let pitch = self.bar_m + self.gap_m;
        let start = -0.5 * (n as f64 * pitch - self.gap_m);
        (0..n).flat_map(|i| [start + i as f64 * pitch, start + i as f64 * pitch + self.bar_m]).collect()
    }
}

impl Builder for Lattice {
    fn check(&self, kind: &Kind) -> Result<()> {
        let (nx, ny) = (self.bars(self.depth_m), if self.crossed { self.bars(self.width_m) } else { 1.0 });
        if nx < 1.0 || ny < 1.0 {
            return Err(kind
                .bad("depth_m", self.depth_m, "the extent is too small for one bar")
                .allowed(format!("at least {}", self.bar_m))
                .remedy("give a larger width_m and depth_m, or narrower bars")
                .into());
        }
        let cells = if self.crossed { 3.0 * nx * ny } else { nx };
        if cells * 12.0 > MAX_TRIANGLES {
            return Err(kind
                .bad("depth_m", self.depth_m, format!("{cells:.0} cells are too many"))
                .allowed(format!("up to {:.0}", MAX_TRIANGLES / 12.0))
                .remedy("give wider bars and gaps, or a smaller extent")
                .into());
        }
        Ok(())
    }

    fn mesh(&self) -> Mesh {
        let x = self.edges(self.depth_m);
        let y = if self.crossed {
            self.edges(self.width_m)
        } else {
            vec![-0.5 * self.width_m, 0.5 * self.width_m]
        };
        let mut plan = Vec::new();
        for i in 0..x.len() - 1 {
            for j in 0..y.len() - 1 {
                // Between two edges of one bar there is metal, between two bars only where the others run.
                if i % 2 == 0 || (self.crossed && j % 2 == 0) {
                    let (lo, hi) = (DVec2::new(x[i], y[j]), DVec2::new(x[i + 1], y[j + 1]));
                    let corners = vec![lo, DVec2::new(hi.x, lo.y), hi, DVec2::new(lo.x, hi.y)];
                    plan.push(Terrace { corners, level_m: self.thickness_m });
                }
            }
        }
        if self.thickness_m > 0.0 {
            return terraces(&plan, 0.0, 0);
        }
        let mut mesh = Mesh::default();
        for cell in plan {
            polygon(&mut mesh, &cell.corners.iter().map(|p| p.extend(0.0)).collect::<Vec<_>>(), 0);
        }
        weld(mesh)
    }
}

/// Short thin strips, level, strewn over a box on z = 0, each turned about the vertical and about itself
/// at random. Physical optics is no theory for wires as thin as these: it knows neither their resonance
/// nor what a wire much thinner than a wavelength scatters.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Chaff {
    /// Width of the box, m.
    pub width_m: f64,
    /// Depth of the box, m.
    pub depth_m: f64,
    /// Height of the box, m.
    pub height_m: f64,
    /// Number of strips.
    pub wires: u32,
    /// Length of a strip, m.
    pub wire_m: f64,
    /// Width of a strip, m.
    pub strip_m: f64,
    /// Seed of places and turns.
    pub seed: u32,
}

/// Chaff in the registry.
pub static CHAFF_KIND: Kind = Kind {
    name: "chaff",
    summary: "short metal strips in random positions and orientations",
    pose: "box from z = 0 up, centred over the origin",
    params: &[
        WIDTH,
        DEPTH,
        number("height_m", 0.002, 0.0, 100.0, "height of the box that contains the centres of the strips"),
        whole("wires", 200, 1, 1_000_000, "how many strips"),
        length("wire_m", HALF_WAVE_M, "length of a strip; half a wavelength at 77 GHz"),
        number("strip_m", 0.0001, 1e-6, 0.1, "width of a strip"),
        whole("seed", 1, 0, u32::MAX, "another seed, another heap"),
    ],
    ..kind_of::<Chaff>()
};

impl Builder for Chaff {
    fn mesh(&self) -> Mesh {
        let mut mesh = Mesh::default();
        for i in 0..self.wires {
            let draw = |k: u32| {
                philox4x32_10([i, k, 0, 0], [self.seed, 0x6368_6166]).map(|x| f64::from(x) / 4_294_967_296.0)
            };
            let ([a, b, c, d], [e, ..]) = (draw(0), draw(1));
            let middle = DVec3::new((a - 0.5) * self.depth_m, (b - 0.5) * self.width_m, c * self.height_m);
            let turn = DQuat::from_rotation_z(d * TAU) * DQuat::from_rotation_x(e * TAU);
            let (along, across) = (turn * DVec3::X * 0.5 * self.wire_m, turn * DVec3::Y * 0.5 * self.strip_m);
            let corners = [-along - across, along - across, along + across, across - along];
            polygon(&mut mesh, &corners.map(|p| middle + p), 0);
        }
        mesh
    }
}

/// A sheet with ridges across the boresight, z = height/2 (1 - cos(2 pi x / period)), that looks up. Its
/// corners lie on the wave. With thickness the metal is below.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Wave {
    /// Width, m.
    pub width_m: f64,
    /// Depth, m.
    pub depth_m: f64,
    /// Height of the ridges, m.
    pub height_m: f64,
    /// Distance from ridge to ridge, m.
    pub period_m: f64,
    /// Thickness, m; 0 for a sheet.
    pub thickness_m: f64,
    /// How far facets may lie off the wave, m.
    pub sagitta_m: f64,
}

/// The wave in the registry.
pub static WAVE_KIND: Kind = Kind {
    name: "wave",
    summary: "wave-shaped sheet",
    pose: "ridges along y, a trough over the origin, troughs on z = 0",
    params: &[
        WIDTH,
        DEPTH,
        length("height_m", 0.004, "height from trough to crest"),
        length("period_m", 0.02, "distance from crest to crest"),
        thickness(0.0),
        SAGITTA,
    ],
    ..kind_of::<Wave>()
};

impl Wave {
    /// Facets along x: by the curvature at the crests, the greatest, and at least 16 to a period.
    fn segments(&self) -> f64 {
        let curvature = 0.5 * self.height_m * (TAU / self.period_m).powi(2);
        // A facet may turn by a fifth of a radian, however coarse the sagitta.
        let step = (8.0 * self.sagitta_m / curvature).sqrt().min(self.period_m / 16.0).min(0.2 / curvature);
        (self.depth_m / step).ceil().max(1.0)
    }

    fn sheet(&self) -> Mesh {
        let n = self.segments() as usize;
        let point = |i: usize| {
            let x = self.depth_m * (i as f64 / n as f64 - 0.5);
            let (s, c) = (TAU * x / self.period_m).sin_cos();
            let slope = 0.5 * self.height_m * TAU / self.period_m * s;
            (DVec3::new(x, 0.0, 0.5 * self.height_m * (1.0 - c)), DVec3::new(-slope, 0.0, 1.0).normalize())
        };
        let y = DVec3::Y * 0.5 * self.width_m;
        let mut mesh = Mesh::default();
        for i in 0..n {
            let ((p, np), (q, nq)) = (point(i), point(i + 1));
            curved_polygon(&mut mesh, &[p - y, q - y, q + y, p + y], &[np, nq, nq, np], 0);
        }
        weld(mesh)
    }
}

impl Builder for Wave {
    fn check(&self, kind: &Kind) -> Result<()> {
        kind.check_triangles(4.0 * self.segments())?;
        kind.check_thickness(&self.sheet(), self.thickness_m)
    }

    fn mesh(&self) -> Mesh {
        let sheet = self.sheet();
        thickened(sheet, self.thickness_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::road::reflector::Reflector;
    use crate::road::shape::{area_m2, area_vector_m2, is_watertight, volume_m3};
    use proptest::prelude::*;

    fn mesh(spec: &str) -> Mesh {
        Reflector::parse(spec).unwrap().mesh().unwrap()
    }

    #[test]
    fn areas_by_hand() {
        // 0.08 + gap over 2 gap: 21 stripes.
        let g = HALF_WAVE_M;
        let n = ((0.08 + g) / (2.0 * g)).floor();
        let m = mesh("stripes:thickness_m=0");
        assert!((area_m2(&m) / (n * g * 0.16) - 1.0).abs() < 1e-12);
        assert!((0..m.triangles.len()).all(|t| area_vector_m2(&m, t).z > 0.0));
        let body = mesh("stripes:thickness_m=0.0003");
        assert!(is_watertight(&body));
        assert!((volume_m3(&body) / (n * g * 0.16 * 0.0003) - 1.0).abs() < 1e-9);
        // A mesh of 17 x 33 wires less their holes.
        let body = mesh("mesh:width_m=0.1605,depth_m=0.0805,thickness_m=0.0004");
        assert!(is_watertight(&body));
        let metal = 0.1605 * 0.0805 - 16.0 * 32.0 * 0.0045 * 0.0045;
        assert!((volume_m3(&body) / (metal * 0.0004) - 1.0).abs() < 1e-9, "{}", volume_m3(&body));
        let sheet = mesh("crossed-stripes:thickness_m=0");
        let m = ((0.16 + g) / (2.0 * g)).floor();
        let crossed = (2.0 * n - 1.0) * (2.0 * m - 1.0) * g * g - (n - 1.0) * (m - 1.0) * g * g;
        assert!((area_m2(&sheet) / crossed - 1.0).abs() < 1e-12);
    }

    #[test]
    fn chaff_is_seeded_and_stays_in_its_box() {
        let m = mesh("chaff:wires=300");
        assert_eq!(m.triangles.len(), 600);
        assert!((area_m2(&m) / (300.0 * HALF_WAVE_M * 1e-4) - 1.0).abs() < 1e-12);
        assert_eq!(m, mesh("chaff:wires=300"));
        assert_ne!(m, mesh("chaff:wires=300,seed=2"));
        let r = HALF_WAVE_M;
        assert!(
            m.positions_m
                .iter()
                .all(|p| p.x.abs() < 0.04 + r && p.y.abs() < 0.08 + r && (-1e-4..0.0021).contains(&p.z))
        );
        // Spread over the box: the middles have the mean and spread of a uniform draw.
        let mean = m.positions_m.iter().map(|p| p.y).sum::<f64>() / 1200.0;
        let square = m.positions_m.iter().map(|p| p.y * p.y).sum::<f64>() / 1200.0;
        assert!(mean.abs() < 0.01 && (square.sqrt() / (0.16 / 12f64.sqrt()) - 1.0).abs() < 0.1);
    }

    #[test]
    fn wave_has_its_sagitta_and_normals() {
        let w = Wave {
            width_m: 0.16,
            depth_m: 0.08,
            height_m: 0.004,
            period_m: 0.02,
            thickness_m: 0.0,
            sagitta_m: super::super::DEFAULT_SAGITTA_M,
        };
        let m = w.mesh();
        let mut deepest = 0.0f64;
        for t in 0..m.triangles.len() {
            let a = area_vector_m2(&m, t).normalize();
            assert!(a.z > 0.0);
            let n = m.corner_normals(t).unwrap();
            assert!(n.iter().all(|n| n.dot(a) > 0.99 && (n.length() - 1.0).abs() < 1e-12));
            // Middle of the chord against the wave.
            let p = m.triangles[t].map(|i| m.positions_m[i as usize]);
            let lo = p.iter().map(|p| p.x).fold(f64::MAX, f64::min);
            let hi = p.iter().map(|p| p.x).fold(f64::MIN, f64::max);
            let x = 0.5 * (lo + hi);
            let wave = DVec3::new(x, 0.0, 0.002 * (1.0 - (TAU * x / 0.02).cos()));
            deepest = deepest.max(a.dot(wave - p[0].with_y(0.0)).abs());
        }
        assert!(deepest <= w.sagitta_m * 1.001 && deepest > 0.4 * w.sagitta_m, "{deepest}");
        let e = Reflector::parse("wave:period_m=0.004,thickness_m=0.002").unwrap_err().to_string();
        assert!(e.contains("wave:thickness_m"), "{e}");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn thick_ones_are_closed(
            w in 0.02f64..0.1, d in 0.02f64..0.1, bar in 0.001f64..0.01, gap in 0.001f64..0.01, t in 1e-4f64..0.002,
        ) {
            for spec in [
                format!("stripes:width_m={w},depth_m={d},stripe_m={bar},gap_m={gap},thickness_m={t}"),
                format!("crossed-stripes:width_m={w},depth_m={d},stripe_m={bar},gap_m={gap},thickness_m={t}"),
                format!("wave:width_m={w},depth_m={d},height_m={},period_m=0.02,thickness_m={}", 0.3 * bar, 0.2 * t),
            ] {
                let m = mesh(&spec);
                prop_assert!(is_watertight(&m), "{}", spec);
                prop_assert!(volume_m3(&m) > 0.0, "{}", spec);
                prop_assert!((0..m.triangles.len()).all(|i| area_vector_m2(&m, i).length() > 0.0));
            }
        }
    }
}
