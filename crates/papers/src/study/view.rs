//! Geometry of radar and marker: where each stands, and the direction in which it sees the other.
//!
//! There are four kinds of place. *Direct*: direction and range in the marker's frame are given, as in
//! `catseye rcs`: from the marker's foot, which is the point of the road below its origin. *Flat*: the marker
//! lies `longitudinal_m` ahead of the radar and `lateral_m` to its left. *Vertical curve*: radar and marker
//! stand on the parabola of [`VerticalCurve`]. *Horizontal curve*: both stand on a circle. On a road the
//! marker's boresight looks back along the road, and the radar looks forward along it.

use super::parameter::{Values, number_of};
use catseye::base::error::BadInput;
use catseye::base::frames::{Pose, Sensor, Target, World, angles_from_direction, direction_from_angles};
use glam::DVec3;
use std::f64::consts::PI;

/// Parameters that determine each kind of place.
const DIRECT: [&str; 3] = ["azimuth_deg", "elevation_deg", "range_m"];
const FLAT: [&str; 2] = ["longitudinal_m", "lateral_m"];
const VERTICAL: [&str; 4] = ["road_position_m", "grade_start_percent", "grade_end_percent", "curve_k_m"];
const HORIZONTAL: [&str; 1] = ["curve_radius_m"];
/// Parameters of any road.
const ROAD: [&str; 3] = ["radar_height_m", "radar_azimuth_deg", "radar_elevation_deg"];

/// Kind of place of radar and marker, along which distances are measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ViewKind {
    /// The straight line between radar and marker.
    Direct,
    /// A level road.
    Flat,
    /// A road that changes its grade.
    Vertical,
    /// A road that bends.
    Horizontal,
}

impl ViewKind {
    /// The kind of place to which the given parameters belong.
    ///
    /// # Errors
    /// Returns an error for parameters of two kinds, or for one that is not used in the kind.
    pub fn of<'a>(names: impl Iterator<Item = &'a str>) -> Result<ViewKind, BadInput> {
        let mut found: Option<(ViewKind, &str)> = None;
        let mut road: Option<&str> = None;
        let mut view: Option<&str> = None;
        for n in names {
            let place = match n {
                n if DIRECT.contains(&n) => ViewKind::Direct,
                n if FLAT.contains(&n) => ViewKind::Flat,
                n if VERTICAL.contains(&n) => ViewKind::Vertical,
                n if HORIZONTAL.contains(&n) => ViewKind::Horizontal,
                n if ROAD.contains(&n) => {
                    road = Some(n);
                    continue;
                }
                "view_m" => {
                    view = Some(n);
                    continue;
                }
                _ => continue,
            };
            match found {
                Some((p, first)) if p != place => {
                    return Err(BadInput::new(format!("{first} and {n} describe two kinds of position"))
                        .allowed(
                            "azimuth_deg, elevation_deg, range_m (seen from the marker); longitudinal_m, \
                             lateral_m (flat road); road_position_m, grade_… (vertical curve); curve_radius_m",
                        )
                        .remedy("keep the parameters of one kind"));
                }
                _ => found = Some((place, n)),
            }
        }
        let place = found.map_or(ViewKind::Direct, |f| f.0);
        if place == ViewKind::Direct
            && let Some(n) = road
        {
            return Err(BadInput::new(format!("{n} needs a road, and the marker has no position"))
                .remedy("give longitudinal_m (flat road), road_position_m or curve_radius_m"));
        }
        if let (Some(n), ViewKind::Direct | ViewKind::Flat) = (view, place) {
            return Err(BadInput::new(format!("{n} applies only to a curved road"))
                .remedy("give longitudinal_m on a flat road, range_m without a road"));
        }
        Ok(place)
    }
}

/// One of several radars on the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Mount {
    /// Distance forward of the place that `radar_height_m` names, m.
    pub forward_m: f64,
    /// Distance to the left of that position, m.
    pub left_m: f64,
    /// Angle that is added to `radar_azimuth_deg`, rad.
    pub azimuth_rad: f64,
    /// Angle that is added to `radar_elevation_deg`, rad.
    pub elevation_rad: f64,
}

/// The directions and distance in which radar and marker see each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Azimuth of the radar seen from the marker, in its upright (not tilted) frame, rad.
    pub azimuth: f64,
    /// Elevation of the radar seen from the marker, rad.
    pub elevation: f64,
    /// Distance between radar and marker, m; infinite for a plane wave.
    pub range_m: f64,
    /// Azimuth of the radar seen from the foot of the marker, which is the point of the road below its
    /// origin, rad. Cross sections are taken in this direction, as in `catseye rcs`.
    pub foot_azimuth: f64,
    /// Elevation of the radar seen from the marker's foot, rad.
    pub foot_elevation: f64,
    /// Distance of the radar from the marker's foot, m; infinite for a plane wave.
    pub foot_range_m: f64,
    /// Height of the marker's origin above its foot, m.
    pub height_m: f64,
    /// Azimuth of the marker seen from the radar's boresight, rad.
    pub sensor_azimuth: f64,
    /// Elevation of the marker seen from the radar's boresight, rad.
    pub sensor_elevation: f64,
}

/// A parabola between two straight slopes (Feng 2019, eq. 3.6): height g1 y + (g2 - g1) y²/(2 Lc) with Lc = K
/// |g1 - g2|, grades as ratios, K in metres per percent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VerticalCurve {
    /// Grade at its beginning, as a ratio.
    pub grade_start: f64,
    /// Grade at its end, as a ratio.
    pub grade_end: f64,
    /// Length of the curve, m.
    pub length_m: f64,
}

impl VerticalCurve {
    /// Makes the curve between two grades in percent; `k_m` is K in metres per percent.
    pub fn new(start_percent: f64, end_percent: f64, k_m: f64) -> Self {
        VerticalCurve {
            grade_start: start_percent / 100.0,
            grade_end: end_percent / 100.0,
            length_m: k_m * (start_percent - end_percent).abs(),
        }
    }

    /// Height (m) and grade at `y` metres from the start of the curve; straight before and after it.
    pub fn at(&self, y: f64) -> (f64, f64) {
        let inside = y.clamp(0.0, self.length_m);
        let change =
            if self.length_m > 0.0 { (self.grade_end - self.grade_start) / self.length_m } else { 0.0 };
        let height = self.grade_start * inside + 0.5 * change * inside * inside;
        let grade = if y > self.length_m { self.grade_end } else { self.grade_start + change * inside };
        (height + grade * (y - inside), grade)
    }

    /// Pose of a frame on the road: x along it, z its normal.
    fn frame(&self, y: f64, yaw: f64) -> Pose<Target, World> {
        let (z, grade) = self.at(y);
        // Nose up is negative pitch.
        let pitch = -grade.atan();
        let along = Pose::<Target, World>::from_yaw_pitch_roll(DVec3::new(y, 0.0, z), 0.0, pitch, 0.0);
        Pose::<Target, Target>::from_yaw_pitch_roll(DVec3::ZERO, yaw, 0.0, 0.0).then(&along)
    }
}

/// Computes the view for the parameters' values.
///
/// # Errors
/// Returns an error for a missing parameter, a radar at the marker, or a distance that the road does not
/// allow.
pub fn view(place: ViewKind, values: &Values, mount: &Mount) -> Result<View, BadInput> {
    let get = |name: &str, default: f64| number_of(values, name).unwrap_or(default);
    let need = |name: &str| {
        number_of(values, name)
            .ok_or_else(|| BadInput::new(format!("{name} is missing")).remedy("set or sweep it"))
    };
    let marker_yaw = get("marker_yaw_deg", 0.0).to_radians();
    let marker_height = get("marker_height_m", 0.0);
    if place == ViewKind::Direct {
        let foot_azimuth = get("azimuth_deg", 0.0).to_radians() - marker_yaw;
        let foot_elevation = get("elevation_deg", 0.0).to_radians();
        let foot_range_m = get("range_m", f64::INFINITY);
        let (azimuth, elevation, range_m) = match marker_height == 0.0 || foot_range_m.is_infinite() {
            true => (foot_azimuth, foot_elevation, foot_range_m),
            false => {
                let to_radar = direction_from_angles(foot_azimuth, foot_elevation) * foot_range_m
                    - DVec3::Z * marker_height;
                let (azimuth, elevation) = angles_from_direction(to_radar);
                (azimuth, elevation, to_radar.length())
            }
        };
        return Ok(View {
            azimuth,
            elevation,
            range_m,
            foot_azimuth,
            foot_elevation,
            foot_range_m,
            height_m: marker_height,
            sensor_azimuth: -mount.azimuth_rad,
            sensor_elevation: -mount.elevation_rad,
        });
    }
    let height = need("radar_height_m")?;
    let turn = get("radar_azimuth_deg", 0.0).to_radians() + mount.azimuth_rad;
    let tilt = get("radar_elevation_deg", 0.0).to_radians() + mount.elevation_rad;
    let in_vehicle = Pose::<Sensor, Target>::from_yaw_pitch_roll(
        DVec3::new(mount.forward_m, mount.left_m, height),
        turn,
        -tilt,
        0.0,
    );
    let raise = |p: Pose<Target, World>| {
        Pose::<Target, World>::new(p.rotation, p.point(DVec3::new(0.0, 0.0, marker_height)))
    };
    let back = PI + marker_yaw;
    let (vehicle, marker) = match place {
        ViewKind::Flat | ViewKind::Direct => {
            let at = DVec3::new(need("longitudinal_m")?, get("lateral_m", 0.0), 0.0);
            (Pose::<Target, World>::IDENTITY, Pose::from_yaw_pitch_roll(at, back, 0.0, 0.0))
        }
        ViewKind::Horizontal => {
            let (radius, distance) = (need("curve_radius_m")?, need("view_m")?);
            let up = height - marker_height;
            let chord_squared = distance * distance - up * up;
            // Half the angle between the tangents at the two ends of the chord.
            let sine = chord_squared.max(0.0).sqrt() / (2.0 * radius);
            if chord_squared <= 0.0 || sine > 1.0 {
                return Err(BadInput::new(format!(
                    "no marker on a circle of {radius} m is {distance} m from the radar"
                ))
                .remedy("give a larger curve_radius_m or a smaller view_m"));
            }
            let half = sine.asin();
            let chord = chord_squared.sqrt();
            let at = DVec3::new(chord * half.cos(), chord * half.sin(), 0.0);
            (Pose::IDENTITY, Pose::from_yaw_pitch_roll(at, back + 2.0 * half, 0.0, 0.0))
        }
        ViewKind::Vertical => {
            let curve = VerticalCurve::new(
                need("grade_start_percent")?,
                need("grade_end_percent")?,
                get("curve_k_m", 10.0),
            );
            let (y, distance) = (need("road_position_m")?, need("view_m")?);
            let vehicle = curve.frame(y, 0.0);
            let eye = in_vehicle.then(&vehicle).translation_m;
            let gap = |y1: f64| (raise(curve.frame(y1, back)).translation_m - eye).length() - distance;
            let (mut near, mut far) = (y, y + 2.0 * distance + 1.0);
            if gap(near) > 0.0 {
                return Err(BadInput::new(format!("the radar is higher than view_m = {distance}"))
                    .remedy("give a larger view_m"));
            }
            for _ in 0..100 {
                let middle = 0.5 * (near + far);
                if gap(middle) < 0.0 { near = middle } else { far = middle }
            }
            (vehicle, curve.frame(0.5 * (near + far), back))
        }
    };
    let (sensor, foot, marker) = (in_vehicle.then(&vehicle), marker, raise(marker));
    let from_foot = foot.inverse().point(sensor.translation_m);
    let to_radar = marker.inverse().point(sensor.translation_m);
    let to_marker = sensor.inverse().point(marker.translation_m);
    let range_m = to_radar.length();
    if range_m < 1e-3 {
        return Err(BadInput::new("the radar is on the marker").remedy("move one of them"));
    }
    let (azimuth, elevation) = angles_from_direction(to_radar);
    let (foot_azimuth, foot_elevation) = angles_from_direction(from_foot);
    let (sensor_azimuth, sensor_elevation) = angles_from_direction(to_marker);
    Ok(View {
        azimuth,
        elevation,
        range_m,
        foot_azimuth,
        foot_elevation,
        foot_range_m: from_foot.length(),
        height_m: marker_height,
        sensor_azimuth,
        sensor_elevation,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::parameter::Value;

    fn values(pairs: &[(&str, f64)]) -> Values {
        pairs.iter().map(|(n, x)| (n.to_string(), Value::Number(*x))).collect()
    }

    fn deg(x: f64) -> f64 {
        x.to_degrees()
    }

    #[test]
    fn flat_road() {
        let v = values(&[("longitudinal_m", 30.0), ("lateral_m", 4.0), ("radar_height_m", 0.15)]);
        let w = view(ViewKind::Flat, &v, &Mount::default()).unwrap();
        assert!((w.range_m - (900.0f64 + 16.0 + 0.0225).sqrt()).abs() < 1e-12);
        let ground = (916.0f64).sqrt();
        assert!((w.elevation - (0.15 / ground).atan()).abs() < 1e-12);
        assert!((w.sensor_elevation + (0.15 / ground).atan()).abs() < 1e-12);
        // The marker lies left of the radar; seen back from the marker the radar is on its left too.
        assert!((w.sensor_azimuth - (4.0f64 / 30.0).atan()).abs() < 1e-12);
        assert!((w.azimuth - (4.0f64 / 30.0).atan()).abs() < 1e-12);

        // A marker turned left by ten degrees sees the radar ten degrees further right.
        let mut turned = v.clone();
        turned.insert("marker_yaw_deg".into(), Value::Number(10.0));
        let t = view(ViewKind::Flat, &turned, &Mount::default()).unwrap();
        assert!((deg(w.azimuth) - deg(t.azimuth) - 10.0).abs() < 1e-9);
        // A radar turned left sees it further right, one tilted up sees it further down.
        let mut tilted = v.clone();
        tilted.insert("radar_azimuth_deg".into(), Value::Number(5.0));
        let t = view(ViewKind::Flat, &tilted, &Mount::default()).unwrap();
        assert!((deg(w.sensor_azimuth) - deg(t.sensor_azimuth) - 5.0).abs() < 1e-9);
        let mut tilted = values(&[("longitudinal_m", 30.0), ("radar_height_m", 0.15)]);
        let level = view(ViewKind::Flat, &tilted, &Mount::default()).unwrap();
        tilted.insert("radar_elevation_deg".into(), Value::Number(7.0));
        let t = view(ViewKind::Flat, &tilted, &Mount::default()).unwrap();
        assert!((deg(level.sensor_elevation) - deg(t.sensor_elevation) - 7.0).abs() < 1e-9);
    }

    #[test]
    fn horizontal_curve() {
        // A chord equal to the radius spans 60 degrees: 30 degrees at each end.
        let h: f64 = 0.15;
        let distance = (900.0 + h * h).sqrt();
        let v = values(&[("curve_radius_m", 30.0), ("view_m", distance), ("radar_height_m", h)]);
        let w = view(ViewKind::Horizontal, &v, &Mount::default()).unwrap();
        assert!((w.range_m - distance).abs() < 1e-9);
        assert!((deg(w.sensor_azimuth) - 30.0).abs() < 1e-9);
        assert!((deg(w.azimuth) + 30.0).abs() < 1e-9);
        let v = values(&[("curve_radius_m", 14.0), ("view_m", 30.0), ("radar_height_m", h)]);
        assert!(view(ViewKind::Horizontal, &v, &Mount::default()).is_err());
    }

    #[test]
    fn vertical_curve() {
        // Grades in percent: 10 m for each of 30 percent is 300 m.
        let c = VerticalCurve::new(-15.0, 15.0, 10.0);
        assert!((c.length_m - 300.0).abs() < 1e-12);
        assert_eq!(c.at(0.0), (0.0, -0.15));
        // Lowest in the middle: -0.15*150 + 0.3*150^2/600.
        let (z, g) = c.at(150.0);
        assert!((z + 11.25).abs() < 1e-12 && g.abs() < 1e-12);
        let (z, g) = c.at(300.0);
        assert!(z.abs() < 1e-12 && (g - 0.15).abs() < 1e-12);
        let (z, g) = c.at(400.0);
        assert!((z - 15.0).abs() < 1e-12 && (g - 0.15).abs() < 1e-12);
        assert_eq!(c.at(-10.0), (1.5, -0.15));

        // By hand about the trough: radar at y = 135, marker near 165, both slopes 0.015, chord level.
        let h = 0.15;
        let v = values(&[
            ("grade_start_percent", -15.0),
            ("grade_end_percent", 15.0),
            ("curve_k_m", 10.0),
            ("road_position_m", 135.0),
            ("view_m", 30.0),
            ("radar_height_m", h),
        ]);
        let w = view(ViewKind::Vertical, &v, &Mount::default()).unwrap();
        assert!((w.range_m - 30.0).abs() < 1e-9);
        // Radar at (135 + h sin a, z + h cos a) with tan a = 0.015; the slope at the marker is atan(0.001 (y - 150)).
        let a = 0.015f64.atan();
        let eye = (135.0 + h * a.sin(), c.at(135.0).0 + h * a.cos());
        let y1 = (0..200).fold((140.0, 200.0), |(lo, hi), _| {
            let m: f64 = 0.5 * (lo + hi);
            if (m - eye.0).hypot(c.at(m).0 - eye.1) < 30.0 { (m, hi) } else { (lo, m) }
        });
        let y1 = y1.0;
        let down = ((eye.1 - c.at(y1).0) / (y1 - eye.0)).atan();
        // Seen from the marker: the fall of the line of sight plus the slope there.
        assert!(
            (w.elevation - (down + c.at(y1).1.atan())).abs() < 1e-9,
            "{} {}",
            deg(w.elevation),
            deg(down)
        );
        assert!((w.sensor_elevation - (a - down)).abs() < 1e-9);
        assert!(deg(w.elevation) > 1.1 && deg(w.elevation) < 1.2);
        // Before the curve the road is straight: the same as a flat road.
        let mut flat = v.clone();
        flat.insert("road_position_m".into(), Value::Number(-100.0));
        let f = view(ViewKind::Vertical, &flat, &Mount::default()).unwrap();
        assert!((f.elevation - (h / 30.0).asin()).abs() < 1e-9);
    }

    #[test]
    fn kinds_of_place() {
        assert_eq!(ViewKind::of(["azimuth_deg", "target.height_m"].into_iter()), Ok(ViewKind::Direct));
        assert_eq!(ViewKind::of(["radar_height_m", "lateral_m"].into_iter()), Ok(ViewKind::Flat));
        assert_eq!(ViewKind::of(["view_m", "road_position_m"].into_iter()), Ok(ViewKind::Vertical));
        assert_eq!(ViewKind::of(["view_m", "curve_radius_m"].into_iter()), Ok(ViewKind::Horizontal));
        for wrong in [
            ["azimuth_deg", "lateral_m"],
            ["curve_radius_m", "road_position_m"],
            ["radar_height_m", "snr_db"],
            ["view_m", "lateral_m"],
        ] {
            assert!(ViewKind::of(wrong.into_iter()).is_err(), "{wrong:?}");
        }
    }
}
