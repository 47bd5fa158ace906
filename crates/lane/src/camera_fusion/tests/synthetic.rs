//! Synthetic roads, images and tracks for the tests.

use super::camera::{Camera, Image};
use super::curve::Arc;
use glam::{DVec2, DVec3};

pub use catseye::base::rng::Draws;

/// A camera behind the windscreen, 1.4 m up, looking down by 3 degrees.
pub fn camera() -> Camera {
    Camera {
        width_px: 640,
        height_px: 400,
        focal_px: DVec2::splat(700.0),
        centre_px: DVec2::new(320.0, 200.0),
        position_m: DVec3::new(1.5, 0.1, 1.4),
        yaw_rad: 0.01,
        pitch_rad: 0.05,
        roll_rad: 0.005,
    }
}

/// Straight, then an arc, then straight: the middle of the own lane. Arc length zero is beside the car. With
/// a negative lead all is one arc.
#[derive(Debug, Clone, Copy)]
pub struct Road {
    pub offset_m: f64,
    pub heading_rad: f64,
    pub lead_m: f64,
    pub curvature_1pm: f64,
    pub turn_rad: f64,
}

impl Road {
    pub fn straight() -> Road {
        Road { offset_m: 0.0, heading_rad: 0.0, lead_m: 1e4, curvature_1pm: 0.0, turn_rad: 0.0 }
    }

    /// An arc that begins beside the car and never ends.
    pub fn curve(radius_m: f64, left: bool) -> Road {
        let curvature_1pm = if left { 1.0 } else { -1.0 } / radius_m;
        Road { lead_m: -1.0, curvature_1pm, ..Road::straight() }
    }

    pub fn bend(lead_m: f64, radius_m: f64, turn_rad: f64) -> Road {
        Road {
            lead_m,
            curvature_1pm: turn_rad.signum() / radius_m,
            turn_rad: turn_rad.abs(),
            ..Road::straight()
        }
    }

    fn parts(&self) -> [(f64, f64, Arc); 3] {
        let first = Arc {
            point_m: DVec2::new(0.0, self.offset_m),
            heading_rad: self.heading_rad,
            curvature_1pm: 0.0,
        };
        let length = if self.curvature_1pm == 0.0 { 0.0 } else { self.turn_rad / self.curvature_1pm.abs() };
        if self.lead_m < 0.0 {
            let arc = Arc { curvature_1pm: self.curvature_1pm, ..first };
            return [(-1e3, 1e3, arc), (1e3, 1e3, arc), (1e3, 1e3, arc)];
        }
        let arc = Arc { point_m: first.point(self.lead_m), curvature_1pm: self.curvature_1pm, ..first };
        let last =
            Arc { point_m: arc.point(length), heading_rad: arc.heading_at(length), curvature_1pm: 0.0 };
        [
            (-1e3, self.lead_m, first),
            (self.lead_m, self.lead_m + length, arc),
            (self.lead_m + length, 1e6, last),
        ]
    }

    /// Point and heading at arc length s of the lane's middle, moved left.
    pub fn at(&self, s_m: f64, left_m: f64) -> (DVec2, f64) {
        let parts = self.parts();
        let (from, _, arc) = parts.iter().find(|p| s_m < p.1).unwrap_or(&parts[2]);
        let start = if self.lead_m < 0.0 || *from < 0.0 { 0.0 } else { *from };
        let heading = arc.heading_at(s_m - start);
        (arc.point(s_m - start) + DVec2::from_angle(heading).perp() * left_m, heading)
    }

    /// (arc length, distance to the left) of a point.
    pub fn frenet(&self, p: DVec2) -> (f64, f64) {
        let mut best = (0.0, f64::INFINITY);
        for (i, (from, to, arc)) in self.parts().iter().enumerate() {
            let start = if i == 0 { 0.0 } else { *from };
            let e = DVec2::from_angle(arc.heading_rad);
            let d = p - arc.point_m;
            let (s, left) = if arc.curvature_1pm == 0.0 {
                (d.dot(e), d.dot(e.perp()))
            } else {
                let r = 1.0 / arc.curvature_1pm;
                let c = d - e.perp() * r;
                (turn(e, c, r), r - r.signum() * c.length())
            };
            let s = s + start;
            if s >= from - 1e-9 && s <= to + 1e-9 && left.abs() < f64::abs(best.1) {
                best = (s, left);
            }
        }
        best
    }
}

/// Arc length from the start of an arc of signed radius r to the direction c from its centre.
fn turn(e: DVec2, c: DVec2, r: f64) -> f64 {
    let start = e.perp() * -r;
    start.angle_to(c) * r
}

pub struct Weather {
    /// Standard deviation of a pixel's grey.
    pub noise: f64,
    /// Extinction in 1/m; 0.05 is thick fog (visibility 60 m).
    pub fog_1pm: f64,
    /// Peak of a blob of light low over the road.
    pub glare: f64,
    /// 0 night without lamps, 1 day.
    pub light: f64,
}

pub const CLEAR: Weather = Weather { noise: 0.02, fog_1pm: 0.0, glare: 0.0, light: 1.0 };

/// Painted lines 0.15 m wide at the given offsets from the lane's middle; a dash is 6 m of each 12 m.
pub fn render(camera: &Camera, road: &Road, lines: &[(f64, bool)], weather: &Weather, seed: u64) -> Image {
    let mut draws = Draws::new(seed as u32, 0);
    let mut grey = Vec::with_capacity(camera.width_px * camera.height_px);
    // A pixel's ray is linear in the pixel.
    let corner = camera.ray(DVec2::ZERO);
    let (du, dv) = (camera.ray(DVec2::X) - corner, camera.ray(DVec2::Y) - corner);
    let ground = |p: DVec2| {
        let d = corner + du * p.x + dv * p.y;
        (d.z < 0.0).then(|| (camera.position_m - d * (camera.position_m.z / d.z)).truncate())
    };
    for v in 0..camera.height_px {
        for u in 0..camera.width_px {
            let mut sum = 0.0;
            for k in 0..9 {
                let p = DVec2::new(
                    u as f64 + (k % 3) as f64 / 3.0 + 1.0 / 6.0,
                    v as f64 + (k / 3) as f64 / 3.0 + 1.0 / 6.0,
                );
                sum += match ground(p) {
                    Some(g) if g.x < 150.0 => {
                        let (s, left) = road.frenet(g);
                        let paint = lines.iter().any(|(y, dashed)| {
                            (left - y).abs() < 0.075 && (!dashed || s.rem_euclid(12.0) < 6.0)
                        });
                        let road = if paint {
                            0.75
                        } else if left.abs() < 9.0 {
                            0.3
                        } else {
                            0.2
                        };
                        let clear = (-weather.fog_1pm * g.x.max(0.0)).exp();
                        road * clear + 0.7 * (1.0 - clear)
                    }
                    _ => 0.7,
                };
            }
            let d = DVec2::new(u as f64, v as f64)
                - DVec2::new(0.5, 0.65) * DVec2::new(camera.width_px as f64, camera.height_px as f64);
            let glare = weather.glare * (-d.length_squared() / (2.0 * 120.0f64.powi(2))).exp();
            let g = weather.light * sum / 9.0 + glare + weather.noise * draws.normal();
            grey.push(g.clamp(0.0, 1.0) as f32);
        }
    }
    Image::new(camera.width_px, camera.height_px, grey).unwrap()
}

/// Points of a car's way from arc length `from_m` to `to_m`, `left_m` from the lane's middle, with noise.
pub fn way(
    road: &Road,
    from_m: f64,
    to_m: f64,
    left_m: f64,
    count: usize,
    noise_m: f64,
    seed: u64,
) -> Vec<DVec2> {
    let mut draws = Draws::new(seed as u32, 0);
    (0..count)
        .map(|i| road.at(from_m + (to_m - from_m) * i as f64 / (count - 1).max(1) as f64, left_m).0)
        .map(|p| p + DVec2::new(draws.normal(), draws.normal()) * noise_m)
        .collect()
}

#[test]
fn frenet_is_the_inverse_of_at() {
    let roads = [
        Road::straight(),
        Road::curve(150.0, true),
        Road::curve(90.0, false),
        Road::bend(30.0, 25.0, 1.57),
        Road::bend(20.0, 60.0, -0.8),
    ];
    for road in roads {
        for s in [2.0, 25.0, 38.0, 60.0, 90.0] {
            for left in [-3.0, 0.0, 1.75] {
                let (gs, gl) = road.frenet(road.at(s, left).0);
                assert!((gs - s).abs() < 1e-6 && (gl - left).abs() < 1e-6, "{road:?} {s} {left}: {gs} {gl}");
            }
        }
    }
    let k = Road::curve(150.0, true).at(30.0, 0.0);
    assert!(k.0.y > 0.0 && k.1 > 0.0, "left is positive");
}
