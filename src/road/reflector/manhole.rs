//! Manhole covers, round and square.

use super::cylinder::{equal_area_radius, segments};
use super::{Builder, Built, Kind, Param, SAGITTA, Values, check_triangles, length, number};
use crate::error::{BadInput, Result};
use crate::road::shape::revolve_z;
use crate::scene::Mesh;
use glam::DVec2;
use std::f64::consts::{FRAC_PI_4, SQRT_2};

/// A cover in its frame, standing `relief_m` proud of the road at z = 0, with a groove between the
/// two; a closed body. The underside lies on the road, so nothing has to be cut out of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Manhole {
    pub square: bool,
    /// Diameter of the cover, or its edge when square.
    pub cover_m: f64,
    /// Diameter or edge of the frame, from outside to outside.
    pub frame_m: f64,
    pub groove_width_m: f64,
    /// Height of cover and frame over the road; the groove goes down by two thirds of it.
    pub relief_m: f64,
    pub sagitta_m: f64,
}

const POSE: &str = "lying on z = 0, centred above the origin, edges of a square one along x and y";
const COVER: Param = length("cover_m", 0.6, "diameter or edge of the cover");
const FRAME: Param = length("frame_m", 0.76, "outer diameter or edge of the frame");
const GROOVE: Param =
    number("groove_width_m", 0.006, 1e-4, 1.0, "width of the groove between cover and frame");
const RELIEF: Param = number("relief_m", 0.006, 1e-4, 0.2, "height over the road");

pub static ROUND_KIND: Kind = Kind {
    name: "manhole-round",
    summary: "round manhole cover with frame",
    pose: POSE,
    params: &[COVER, FRAME, GROOVE, RELIEF, SAGITTA],
    boresight_deg: (0.0, 0.0),
    material: "pec",
    build: |v| {
        let m = Manhole::from_values(v, false, v.number("sagitta_m"))?;
        check_triangles("manhole-round", 14.0 * m.steps() as f64)?;
        Ok(Built::Mesh(Box::new(m)))
    },
};

pub static SQUARE_KIND: Kind = Kind {
    name: "manhole-square",
    summary: "square manhole cover with frame",
    pose: POSE,
    params: &[COVER, FRAME, GROOVE, RELIEF],
    boresight_deg: (0.0, 0.0),
    material: "pec",
    build: |v| Ok(Built::Mesh(Box::new(Manhole::from_values(v, true, 1.0)?))),
};

impl Manhole {
    fn from_values(v: &Values, square: bool, sagitta_m: f64) -> Result<Manhole> {
        let m = Manhole {
            square,
            cover_m: v.number("cover_m"),
            frame_m: v.number("frame_m"),
            groove_width_m: v.number("groove_width_m"),
            relief_m: v.number("relief_m"),
            sagitta_m,
        };
        let least = m.cover_m + 2.0 * m.groove_width_m;
        if m.frame_m <= least {
            return Err(BadInput::new("the frame does not reach round cover and groove")
                .key(format!("{}:frame_m", v.kind.name))
                .value(m.frame_m)
                .allowed(format!("more than {least}"))
                .remedy("give a larger frame_m or a smaller cover_m")
                .into());
        }
        Ok(m)
    }

    fn steps(&self) -> usize {
        if self.square { 4 } else { segments(0.5 * self.frame_m, self.sagitta_m) }
    }
}

impl Builder for Manhole {
    fn mesh(&self) -> Mesh {
        let n = self.steps();
        let (scale, start) = if self.square { (SQRT_2, FRAC_PI_4) } else { (equal_area_radius(1.0, n), 0.0) };
        let (cover, frame) = (0.5 * self.cover_m, 0.5 * self.frame_m);
        let (top, low) = (self.relief_m, self.relief_m / 3.0);
        let outline = [
            (0.0, 0.0),
            (frame, 0.0),
            (frame, top),
            (cover + self.groove_width_m, top),
            (cover + self.groove_width_m, low),
            (cover, low),
            (cover, top),
            (0.0, top),
        ]
        .map(|(r, z)| DVec2::new(r * scale, z));
        revolve_z(&outline, n, start, !self.square, 0)
    }
}

#[cfg(test)]
mod tests {
    use crate::road::reflector::Reflector;
    use crate::road::shape::volume_m3;
    use std::f64::consts::PI;

    #[test]
    fn volumes_by_hand() {
        let ring = |outer: f64, inner: f64| outer * outer - inner * inner;
        let body = 0.76 * 0.76 * 0.006 - ring(0.612, 0.6) * 0.004;
        let square = Reflector::parse("manhole-square").unwrap().mesh().unwrap();
        assert!((volume_m3(&square) - body).abs() < 1e-12);
        let round = Reflector::parse("manhole-round").unwrap().mesh().unwrap();
        assert!((volume_m3(&round) - 0.25 * PI * body).abs() < 1e-12);
        let widest = square.positions_m.iter().map(|p| p.x.max(p.y)).fold(0.0, f64::max);
        assert!((widest - 0.38).abs() < 1e-12);
        assert!(round.positions_m.iter().chain(&square.positions_m).all(|p| p.z >= 0.0));
    }

    #[test]
    fn frame_must_hold_the_cover() {
        let e = Reflector::parse("manhole-round:cover_m=0.9").unwrap_err().to_string();
        assert!(e.contains("manhole-round:frame_m = 0.76") && e.contains("0.912"), "{e}");
    }
}
