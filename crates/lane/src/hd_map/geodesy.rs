//! Converts between WGS-84 coordinates and the axes of a radar on the road: latitude, longitude, height ->
//! ECEF -> ENU at the radar -> radar axes, and back (Li, eq. 6 to 8).

use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

/// Semi-major axis a of WGS-84, m.
pub const SEMI_MAJOR_M: f64 = 6_378_137.0;
/// Semi-minor axis b of WGS-84, m.
pub const SEMI_MINOR_M: f64 = 6_356_752.314;
/// First eccentricity squared of WGS-84, e² = (a² - b²)/a².
pub const ECCENTRICITY_SQUARED: f64 =
    (SEMI_MAJOR_M * SEMI_MAJOR_M - SEMI_MINOR_M * SEMI_MINOR_M) / (SEMI_MAJOR_M * SEMI_MAJOR_M);
/// Largest absolute height of roads and radars, m.
const MAX_HEIGHT_M: f64 = 1e5;

/// A position on the earth. In text it is `[latitude_deg, longitude_deg, height_m]`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(from = "[f64; 3]", into = "[f64; 3]")]
pub struct Wgs84 {
    /// Geodetic latitude, degrees, positive north, -90 to 90.
    pub latitude_deg: f64,
    /// Longitude, degrees, positive east, -180 to 180.
    pub longitude_deg: f64,
    /// Height above the ellipsoid, m.
    pub height_m: f64,
}

impl From<[f64; 3]> for Wgs84 {
    fn from([latitude_deg, longitude_deg, height_m]: [f64; 3]) -> Self {
        Wgs84 { latitude_deg, longitude_deg, height_m }
    }
}

impl From<Wgs84> for [f64; 3] {
    fn from(p: Wgs84) -> Self {
        [p.latitude_deg, p.longitude_deg, p.height_m]
    }
}

impl Wgs84 {
    /// Makes a position from latitude and longitude in degrees and height above the ellipsoid in metres.
    pub const fn new(latitude_deg: f64, longitude_deg: f64, height_m: f64) -> Self {
        Wgs84 { latitude_deg, longitude_deg, height_m }
    }

    /// Whether all values are finite, the angles within their ranges and the height within 100 km of the
    /// ellipsoid.
    pub fn is_valid(&self) -> bool {
        self.latitude_deg.abs() <= 90.0
            && self.longitude_deg.abs() <= 180.0
            && self.height_m.abs() <= MAX_HEIGHT_M
    }

    /// Earth-centred, earth-fixed coordinates, m: X through latitude and longitude 0, Z through the north
    /// pole (Li, eq. 6). They are non-finite where the position is.
    pub fn ecef_m(&self) -> DVec3 {
        let (sin_lat, cos_lat) = self.latitude_deg.to_radians().sin_cos();
        let (sin_lon, cos_lon) = self.longitude_deg.to_radians().sin_cos();
        let n = SEMI_MAJOR_M / (1.0 - ECCENTRICITY_SQUARED * sin_lat * sin_lat).sqrt();
        let across = (n + self.height_m) * cos_lat;
        let z = (n * (1.0 - ECCENTRICITY_SQUARED) + self.height_m) * sin_lat;
        DVec3::new(across * cos_lon, across * sin_lon, z)
    }

    /// Converts earth-centred coordinates (m) to a position. It is exact to rounding within 100 km of the
    /// ellipsoid (Bowring 1976, iterated to convergence) and without meaning near the earth's centre.
    pub fn from_ecef_m(p: DVec3) -> Self {
        let b_over_a = SEMI_MINOR_M / SEMI_MAJOR_M;
        let second = ECCENTRICITY_SQUARED / (1.0 - ECCENTRICITY_SQUARED);
        let across = p.x.hypot(p.y);
        // Sine and cosine of the parametric latitude, never its tangent, which has no value at the poles.
        let unit = |s: f64, c: f64| {
            let r = s.hypot(c);
            (s / r, c / r)
        };
        let (mut sin_beta, mut cos_beta) = unit(p.z, across * b_over_a);
        let (mut sin_lat, mut cos_lat) = (0.0, 1.0);
        for _ in 0..4 {
            (sin_lat, cos_lat) = unit(
                p.z + second * SEMI_MINOR_M * sin_beta.powi(3),
                across - ECCENTRICITY_SQUARED * SEMI_MAJOR_M * cos_beta.powi(3),
            );
            (sin_beta, cos_beta) = unit(b_over_a * sin_lat, cos_lat);
        }
        let height_m = across * cos_lat + p.z * sin_lat
            - SEMI_MAJOR_M * (1.0 - ECCENTRICITY_SQUARED * sin_lat * sin_lat).sqrt();
        Wgs84 {
            latitude_deg: sin_lat.atan2(cos_lat).to_degrees(),
            longitude_deg: p.y.atan2(p.x).to_degrees(),
            height_m,
        }
    }

    /// Rotation from ECEF to east, north, up at this position, in rows (Li, eq. 7).
    fn enu_from_ecef(&self) -> DMat3 {
        let (sin_lat, cos_lat) = self.latitude_deg.to_radians().sin_cos();
        let (sin_lon, cos_lon) = self.longitude_deg.to_radians().sin_cos();
        let east = DVec3::new(-sin_lon, cos_lon, 0.0);
        let north = DVec3::new(-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat);
        let up = DVec3::new(cos_lat * cos_lon, cos_lat * sin_lon, sin_lat);
        DMat3::from_cols(east, north, up).transpose()
    }
}

/// Position and direction of a radar. Its axes are level: the tilt of its mounting has been removed from the
/// targets beforehand.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RadarPose {
    /// Position of the radar.
    pub position: Wgs84,
    /// Azimuth of boresight, rad, clockwise from true north (0 looks north, +π/2 east).
    pub azimuth_rad: f64,
}

impl RadarPose {
    /// The pose at the point `position_m` of another pose's axes, with boresight turned to the left of theirs
    /// by `heading_rad`, as for a radar in a road's plane whose anchor on the earth is `anchor`. True north
    /// is taken at the new position. None where the anchor or the point is non-finite or not near the earth.
    pub fn within(anchor: &RadarPose, position_m: DVec3, heading_rad: f64) -> Option<Self> {
        let plane = RadarFrame::new(anchor)?;
        let position = plane.place(position_m);
        let north = RadarFrame::new(&RadarPose { position, azimuth_rad: 0.0 })?;
        // Far enough for the precision, near enough for a tangent.
        let ahead = DVec3::new(heading_rad.cos(), heading_rad.sin(), 0.0) * 100.0;
        let seen = north.radar_m(&plane.place(position_m + ahead));
        let pose = RadarPose { position, azimuth_rad: (-seen.y).atan2(seen.x) };
        RadarFrame::new(&pose).map(|_| pose)
    }
}

/// The level axes of one radar (x forward, y left, z up), prepared for many points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RadarFrame {
    origin_ecef_m: DVec3,
    radar_from_ecef: DMat3,
}

impl RadarFrame {
    /// Makes the frame; None for a pose that is non-finite or not near the earth.
    pub fn new(pose: &RadarPose) -> Option<Self> {
        if !pose.position.is_valid() || !pose.azimuth_rad.is_finite() {
            return None;
        }
        // The document's axes are x right and y forward; here the rows are forward, left, up.
        let (sin, cos) = pose.azimuth_rad.sin_cos();
        let radar_from_enu = DMat3::from_cols(
            DVec3::new(sin, cos, 0.0),
            DVec3::new(-cos, sin, 0.0),
            DVec3::new(0.0, 0.0, 1.0),
        )
        .transpose();
        Some(RadarFrame {
            origin_ecef_m: pose.position.ecef_m(),
            radar_from_ecef: radar_from_enu * pose.position.enu_from_ecef(),
        })
    }

    /// Converts a position to the radar's axes, m (Li, eq. 6 to 8).
    pub fn radar_m(&self, place: &Wgs84) -> DVec3 {
        self.radar_from_ecef * (place.ecef_m() - self.origin_ecef_m)
    }

    /// Converts a point of the radar's axes (m) to a position.
    pub fn place(&self, radar_m: DVec3) -> Wgs84 {
        Wgs84::from_ecef_m(self.radar_from_ecef.transpose() * radar_m + self.origin_ecef_m)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::Draws;
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    #[test]
    fn earth_centred_points_that_are_known() {
        let (a, b) = (SEMI_MAJOR_M, SEMI_MINOR_M);
        for (place, ecef) in [
            ([0.0, 0.0, 0.0], [a, 0.0, 0.0]),
            ([0.0, 90.0, 0.0], [0.0, a, 0.0]),
            ([0.0, 180.0, 5.0], [-a - 5.0, 0.0, 0.0]),
            ([90.0, 15.0, -1.0], [0.0, 0.0, b - 1.0]),
            ([-90.0, 0.0, 0.0], [0.0, 0.0, -b]),
            // A published example (pymap3d), with b to more digits: 0.2 mm apart.
            ([42.0, -82.0, 200.0], [660_675.251_824_7, -4_700_948.683_16, 4_245_737.662_22]),
        ] {
            let found = Wgs84::from(place).ecef_m();
            assert!((found - DVec3::from(ecef)).length() < 3e-4, "{place:?}: {found:?}");
        }
    }

    #[test]
    fn the_poles_and_the_equator_come_back() {
        for p in [[90.0, 0.0, 3.0], [-90.0, 0.0, -3.0], [0.0, 180.0, 0.0], [89.999_999_9, 10.0, 0.0]] {
            let back = Wgs84::from_ecef_m(Wgs84::from(p).ecef_m());
            assert!((back.latitude_deg - p[0]).abs() < 1e-12, "{back:?}");
            assert!((back.height_m - p[2]).abs() < 1e-8, "{back:?}");
        }
    }

    #[test]
    fn east_north_and_up_of_a_published_example() {
        // pymap3d: from (42, -82, 200), azimuth 33 and elevation 70 degrees, range 1000 m.
        let position = Wgs84::new(42.0, -82.0, 200.0);
        let seen = Wgs84::new(42.002_582, -81.997_752, 1_139.701_8);
        let north = RadarFrame::new(&RadarPose { position, azimuth_rad: 0.0 }).unwrap();
        // Looking north, forward is north and left is west. The degrees have six decimals: 0.06 m.
        let p = north.radar_m(&seen);
        assert!((p - DVec3::new(286.842_228, -186.277_521, 939.692_621)).length() < 0.1, "{p:?}");
        // Turned to the target's azimuth, nothing is left across.
        let at = RadarFrame::new(&RadarPose { position, azimuth_rad: 33_f64.to_radians() }).unwrap();
        let q = at.radar_m(&seen);
        assert!((q - DVec3::new(342.020_143, 0.0, 939.692_621)).length() < 0.1, "{q:?}");
        // A millimetre on the ground is found back when the place keeps all its digits.
        let exact = at.place(DVec3::new(342.020_143, 0.0, 939.692_621));
        assert!((exact.latitude_deg - 42.002_582).abs() < 1e-6);
        assert!((exact.longitude_deg + 81.997_752).abs() < 1e-6);
    }

    #[test]
    fn looking_east_a_place_in_the_east_is_ahead_and_one_in_the_north_left() {
        let position = Wgs84::new(30.0, 114.0, 20.0);
        let frame = RadarFrame::new(&RadarPose { position, azimuth_rad: FRAC_PI_2 }).unwrap();
        let east = frame.radar_m(&Wgs84::new(30.0, 114.001, 20.0));
        let north = frame.radar_m(&Wgs84::new(30.001, 114.0, 20.0));
        assert!(east.x > 90.0 && east.y.abs() < 0.01, "{east:?}");
        assert!(north.y > 100.0 && north.x.abs() < 0.01, "{north:?}");
        assert!(frame.radar_m(&Wgs84::new(30.0, 114.0, 25.0)).abs_diff_eq(DVec3::Z * 5.0, 1e-8));
    }

    #[test]
    fn round_trips_over_the_whole_earth() {
        let mut draws = Draws(1);
        let (mut worst_ecef_m, mut worst_radar_m) = (0.0_f64, 0.0_f64);
        for _ in 0..2000 {
            let position = Wgs84::new(
                draws.between(-90.0, 90.0),
                draws.between(-180.0, 180.0),
                draws.between(-500.0, 9000.0),
            );
            let back = Wgs84::from_ecef_m(position.ecef_m());
            worst_ecef_m = worst_ecef_m.max((back.ecef_m() - position.ecef_m()).length());
            let pose = RadarPose { position, azimuth_rad: draws.between(-PI, PI) };
            let frame = RadarFrame::new(&pose).unwrap();
            let p =
                DVec3::new(draws.between(-1e3, 1e3), draws.between(-1e3, 1e3), draws.between(-50.0, 50.0));
            worst_radar_m = worst_radar_m.max((frame.radar_m(&frame.place(p)) - p).length());
        }
        // Rounding of numbers of 6.4e6 m: 1e-9 m each.
        assert!(worst_ecef_m < 2e-8, "{worst_ecef_m:e}");
        assert!(worst_radar_m < 2e-8, "{worst_radar_m:e}");
    }

    #[test]
    fn distances_stay() {
        // Both steps are rigid, so lengths between places are those of their ECEF points.
        let mut draws = Draws(2);
        let pose = RadarPose { position: Wgs84::new(39.9, 116.4, 50.0), azimuth_rad: 1.1 };
        let frame = RadarFrame::new(&pose).unwrap();
        for _ in 0..100 {
            let p = [(); 2].map(|()| {
                Wgs84::new(
                    draws.between(39.89, 39.91),
                    draws.between(116.39, 116.41),
                    draws.between(0.0, 90.0),
                )
            });
            let direct = (p[0].ecef_m() - p[1].ecef_m()).length();
            let turned = (frame.radar_m(&p[0]) - frame.radar_m(&p[1])).length();
            assert!((direct - turned).abs() < 1e-8);
        }
    }

    #[test]
    fn a_radar_within_a_plane_sees_its_points_where_they_are() {
        let anchor = RadarPose { position: Wgs84::new(52.5, 13.4, 35.0), azimuth_rad: 2.3 };
        let plane = RadarFrame::new(&anchor).unwrap();
        for (at, heading) in [(DVec3::new(0.0, 0.0, 6.0), 0.4), (DVec3::new(1500.0, -800.0, 6.0), -2.9)] {
            let pose = RadarPose::within(&anchor, at, heading).unwrap();
            let frame = RadarFrame::new(&pose).unwrap();
            for own in [DVec3::new(200.0, 0.0, -6.0), DVec3::new(150.0, 60.0, -6.0)] {
                let turned = glam::DQuat::from_rotation_z(heading) * own;
                let seen = frame.radar_m(&plane.place(at + turned));
                // Level at the radar is not level at the anchor: 0.27 mrad over 1.7 km, on 6 m of height.
                assert!((seen - own).truncate().length() < 3e-3, "{seen:?} {own:?}");
            }
        }
        // North turns by 1500 m tan(latitude) / earth's radius, which the azimuth follows.
        let far = RadarPose::within(&anchor, DVec3::new(1500.0, -800.0, 6.0), 0.0).unwrap();
        assert!((far.azimuth_rad - anchor.azimuth_rad).abs() > 1e-4);
        assert_eq!(RadarPose::within(&anchor, DVec3::NAN, 0.0), None);
        assert_eq!(RadarPose::within(&anchor, DVec3::ZERO, f64::NAN), None);
        assert_eq!(RadarPose::within(&RadarPose { azimuth_rad: f64::NAN, ..anchor }, DVec3::ZERO, 0.0), None);
    }

    #[test]
    fn a_pose_that_is_nowhere_has_no_frame() {
        let good = Wgs84::new(40.0, 116.0, 50.0);
        for (position, azimuth_rad) in [
            (Wgs84::new(f64::NAN, 0.0, 0.0), 0.0),
            (Wgs84::new(91.0, 0.0, 0.0), 0.0),
            (Wgs84::new(0.0, 181.0, 0.0), 0.0),
            (Wgs84::new(0.0, 0.0, f64::INFINITY), 0.0),
            (good, f64::NAN),
            (good, f64::INFINITY),
        ] {
            assert_eq!(RadarFrame::new(&RadarPose { position, azimuth_rad }), None);
        }
        assert!(RadarFrame::new(&RadarPose { position: good, azimuth_rad: 0.0 }).is_some());
    }
}
