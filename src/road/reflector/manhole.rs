//! Manhole covers, round and square.

use super::cylinder::segments;
use super::kind::{Builder, Kind, Param, SAGITTA, built, kind_of, length, number, whole};
use crate::base::error::Result;
use crate::road::shape::{Terrace, revolve_z, terraces};
use crate::scene::Mesh;
use glam::DVec2;
use serde::Deserialize;
use std::f64::consts::{FRAC_PI_4, SQRT_2};

/// A cover in its frame, standing `relief_m` proud of the road at z = 0, with a groove between the
/// two; a closed body. The underside lies on the road, so nothing has to be cut out of it.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Manhole {
    /// Whether it is square; otherwise it is round.
    #[serde(skip)]
    pub square: bool,
    /// Diameter of the cover, or its edge when square.
    pub cover_m: f64,
    /// Diameter or edge of the frame, from outside to outside.
    pub frame_m: f64,
    /// Width of the groove, m.
    pub groove_width_m: f64,
    /// Height of cover and frame over the road; the groove goes down by two thirds of it.
    pub relief_m: f64,
    /// Concentric ribs on a round cover, rows and columns of studs on a square one.
    #[serde(alias = "ribs", alias = "studs")]
    pub pattern: u32,
    /// Height of the pattern over the cover.
    pub pattern_m: f64,
    /// Greatest distance of a facet from the circle of a round cover, m.
    #[serde(default)]
    pub sagitta_m: f64,
}

const POSE: &str = "on z = 0, centred above the origin, edges of a square cover along x and y";
const COVER: Param = length("cover_m", 0.6, "diameter or edge of the cover");
const FRAME: Param = length("frame_m", 0.76, "outer diameter or edge of the frame");
const GROOVE: Param =
    number("groove_width_m", 0.006, 1e-4, 1.0, "width of the groove between cover and frame");
const RELIEF: Param = number("relief_m", 0.006, 1e-4, 0.2, "height above the road");
const PATTERN: Param = number("pattern_m", 0.003, 1e-4, 0.2, "height of the ribs or studs above the cover");

/// The round cover in the registry.
pub static ROUND_KIND: Kind = Kind {
    name: "manhole-round",
    summary: "round manhole cover with frame",
    pose: POSE,
    params: &[
        COVER,
        FRAME,
        GROOVE,
        RELIEF,
        whole("ribs", 0, 0, 200, "concentric ribs on the cover"),
        PATTERN,
        SAGITTA,
    ],
    ..kind_of::<Manhole>()
};

/// The square cover in the registry.
pub static SQUARE_KIND: Kind = Kind {
    name: "manhole-square",
    summary: "square manhole cover with frame",
    pose: POSE,
    params: &[
        COVER,
        FRAME,
        GROOVE,
        RELIEF,
        whole("studs", 0, 0, 200, "rows and columns of square studs on the cover"),
        PATTERN,
    ],
    build: |v| built(v.kind, Manhole { square: true, ..v.read() }),
    ..kind_of::<Manhole>()
};

impl Manhole {
    fn steps(&self) -> usize {
        if self.square { 4 } else { segments(0.5 * self.frame_m, self.sagitta_m) }
    }
}

impl Builder for Manhole {
    fn check(&self, kind: &Kind) -> Result<()> {
        let least = self.cover_m + 2.0 * self.groove_width_m;
        if self.frame_m <= least {
            return Err(kind
                .bad("frame_m", self.frame_m, "the frame does not reach round cover and groove")
                .allowed(format!("more than {least}"))
                .remedy("give a larger frame_m or a smaller cover_m")
                .into());
        }
        if self.square {
            return Ok(());
        }
        kind.check_triangles((14.0 + 8.0 * f64::from(self.pattern)) * self.steps() as f64)
    }

    fn mesh(&self) -> Mesh {
        if self.square && self.pattern > 0 {
            return self.studded();
        }
        let n = self.steps();
        let (scale, start) = if self.square { (SQRT_2, FRAC_PI_4) } else { (1.0, 0.0) };
        let (cover, frame) = (0.5 * self.cover_m, 0.5 * self.frame_m);
        let (top, low) = (self.relief_m, self.relief_m / 3.0);
        let mut outline = vec![
            (0.0, 0.0),
            (frame, 0.0),
            (frame, top),
            (cover + self.groove_width_m, top),
            (cover + self.groove_width_m, low),
            (cover, low),
            (cover, top),
        ];
        // Ribs and what lies between them are equally wide.
        let parts = f64::from(2 * self.pattern + 1);
        for k in 1..=self.pattern {
            let [outer, inner] = [2 * k - 1, 2 * k].map(|i| cover * (1.0 - f64::from(i) / parts));
            let high = top + self.pattern_m;
            outline.extend([(outer, top), (outer, high), (inner, high), (inner, top)]);
        }
        outline.push((0.0, top));
        let outline: Vec<DVec2> = outline.into_iter().map(|(r, z)| DVec2::new(r * scale, z)).collect();
        revolve_z(&outline, n, start, !self.square, 0)
    }
}

impl Manhole {
    /// The square one as a ground plan in cells.
    fn studded(&self) -> Mesh {
        let (cover, frame) = (0.5 * self.cover_m, 0.5 * self.frame_m);
        let groove = cover + self.groove_width_m;
        let parts = 2 * self.pattern + 1;
        // Lines from -frame to frame; between the lines of the cover, every other strip has studs.
        let mut lines = vec![-frame, -groove];
        lines.extend((0..=parts).map(|i| match i {
            0 => -cover,
            i if i == parts => cover,
            i => cover * (2.0 * f64::from(i) / f64::from(parts) - 1.0),
        }));
        lines.extend([groove, frame]);
        let strip = |i: usize| match i {
            0 => (self.relief_m, false),
            1 => (self.relief_m / 3.0, false),
            i if i == lines.len() - 2 => (self.relief_m, false),
            i if i == lines.len() - 3 => (self.relief_m / 3.0, false),
            i => (self.relief_m, i % 2 == 1),
        };
        let last = lines.len() - 2;
        // Distance from the rim in strips decides between frame and groove.
        let ring = |i: usize| i.min(last - i);
        let mut plan = Vec::new();
        for i in 0..=last {
            for j in 0..=last {
                let outer = if ring(i) <= ring(j) { i } else { j };
                let (level, _) = strip(outer);
                let stud = ring(i) >= 2 && ring(j) >= 2 && strip(i).1 && strip(j).1;
                let level_m = level + if stud { self.pattern_m } else { 0.0 };
                let (lo, hi) = (DVec2::new(lines[i], lines[j]), DVec2::new(lines[i + 1], lines[j + 1]));
                let corners = vec![lo, DVec2::new(hi.x, lo.y), hi, DVec2::new(lo.x, hi.y)];
                plan.push(Terrace { corners, level_m });
            }
        }
        terraces(&plan, 0.0, 0)
    }
}

#[cfg(test)]
mod tests {
    use crate::road::reflector::cylinder::disc_share;
    use crate::road::reflector::{DEFAULT_SAGITTA_M, Reflector};
    use crate::road::shape::{is_watertight, volume_m3};
    use std::f64::consts::PI;

    #[test]
    fn volumes_by_hand() {
        let ring = |outer: f64, inner: f64| outer * outer - inner * inner;
        let body = 0.76 * 0.76 * 0.006 - ring(0.612, 0.6) * 0.004;
        let square = Reflector::parse("manhole-square").unwrap().mesh().unwrap();
        assert!((volume_m3(&square) - body).abs() < 1e-12);
        let round = Reflector::parse("manhole-round").unwrap().mesh().unwrap();
        let share = disc_share(0.38, DEFAULT_SAGITTA_M);
        assert!((volume_m3(&round) - 0.25 * PI * body * share).abs() < 1e-12);
        let widest = square.positions_m.iter().map(|p| p.x.max(p.y)).fold(0.0, f64::max);
        assert!((widest - 0.38).abs() < 1e-12);
        assert!(round.positions_m.iter().chain(&square.positions_m).all(|p| p.z >= 0.0));
    }

    #[test]
    fn patterns_add_their_volume() {
        let plain = 0.76 * 0.76 * 0.006 - (0.612 * 0.612 - 0.6 * 0.6) * 0.004;
        let square = Reflector::parse("manhole-square:studs=7").unwrap().mesh().unwrap();
        let studs = 49.0 * (0.6f64 / 15.0).powi(2) * 0.003;
        assert!(is_watertight(&square));
        assert!((volume_m3(&square) - plain - studs).abs() < 1e-12, "{}", volume_m3(&square));
        let round = Reflector::parse("manhole-round:ribs=4").unwrap().mesh().unwrap();
        let rings: f64 = (1..=4)
            .map(|k| {
                let r = |i: f64| 0.3 * (1.0 - i / 9.0);
                (r(2.0 * f64::from(k) - 1.0).powi(2) - r(2.0 * f64::from(k)).powi(2)) * 0.003
            })
            .sum();
        assert!(is_watertight(&round));
        let share = disc_share(0.38, DEFAULT_SAGITTA_M);
        assert!((volume_m3(&round) - PI * (0.25 * plain + rings) * share).abs() < 1e-12);
    }

    #[test]
    fn frame_must_hold_the_cover() {
        let e = Reflector::parse("manhole-round:cover_m=0.9").unwrap_err().to_string();
        assert!(e.contains("manhole-round:frame_m = 0.76") && e.contains("0.912"), "{e}");
    }
}
