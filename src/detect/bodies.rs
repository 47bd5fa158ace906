//! Where the actors of a scene are, as a radar sees them: whether a point is on its object, and how much of an object is in view.

use super::points::Point;
use super::response::EchoPath;
use crate::base::frames::{Pose, Sensor, Target, World, angles_from_direction, direction_from_angles};
use crate::road::actors::{actor_boxes, is_ground};
use crate::scene::radar::Radar;
use crate::scene::{Object, Scene, Shape};
use glam::{DMat3, DVec3};
use std::collections::HashMap;
use std::f64::consts::{FRAC_PI_2, PI};

/// Actors whose box is wider than this in plan are compared by their surface: the box of a bent wall is mostly empty.
const WIDEST_BOX_M: f64 = 3.0;

/// The scene as labels need it: classes, which objects are parts of one actor, and where actors are.
#[derive(Debug, Clone, Default)]
pub struct Bodies {
    objects: HashMap<u32, Body>,
    extents: Vec<Extent>,
}

#[derive(Debug, Clone)]
struct Body {
    class: String,
    /// Index into the extents.
    actor: usize,
}

/// A box in the sensor's frame.
#[derive(Debug, Clone, Copy)]
struct BodyBox {
    pose: Pose<Target, Sensor>,
    lower_m: DVec3,
    upper_m: DVec3,
}

/// Where an actor is.
#[derive(Debug, Clone)]
struct Extent {
    whole: BodyBox,
    /// Triangles in the sensor's frame, m, of an actor whose box is wide.
    surface_m: Option<Vec<[DVec3; 3]>>,
    is_ground: bool,
}

impl Bodies {
    /// The scene at `time_s`, seen from a radar.
    pub fn new(scene: &Scene, time_s: f64, radar: &Pose<Sensor, World>) -> Bodies {
        let to_sensor = radar.inverse();
        let mut objects = HashMap::with_capacity(scene.objects.len());
        let extents = actor_boxes(scene, time_s).into_iter().enumerate().map(|(actor, b)| {
            let parts = || b.parts.iter().map(|i| &scene.objects[*i]);
            for part in parts() {
                objects.insert(part.id, Body { class: part.class.clone(), actor });
            }
            let size = b.size_m();
            let is_ground = parts().any(|p| is_ground(&p.class));
            let is_wide = size.x.min(size.y) > WIDEST_BOX_M && !is_ground;
            let surface_m = is_wide.then(|| {
                let of = |part: &'_ Object| -> Vec<[DVec3; 3]> {
                    let Shape::Mesh(mesh) = part.shape else { return Vec::new() };
                    let (mesh, pose) = (&scene.meshes[mesh], part.at(time_s).pose().then(&to_sensor));
                    let corners = |t: &[u32; 3]| t.map(|i| pose.point(mesh.positions_m[i as usize]));
                    mesh.triangles.iter().map(corners).collect()
                };
                parts().flat_map(of).collect()
            });
            let whole = BodyBox { pose: b.pose.then(&to_sensor), lower_m: b.lower_m, upper_m: b.upper_m };
            Extent { whole, surface_m, is_ground }
        });
        Bodies { extents: extents.collect(), objects }
    }

    /// Whether nothing is known of the scene.
    pub fn is_empty(&self) -> bool {
        self.objects.is_empty()
    }

    /// The object's class; "" when it has none.
    pub fn class(&self, object: u32) -> &str {
        self.objects.get(&object).map_or("", |b| b.class.as_str())
    }

    /// Whether a place is off the actor that an object is a part of. Ground is everywhere, and so is an object that is not known.
    pub(super) fn is_off(&self, object: u32, place: &Place) -> bool {
        let body = self.objects.get(&object).filter(|b| !is_ground(&b.class));
        body.is_some_and(|b| place.is_off(&self.extents[b.actor]))
    }
}

/// How much of an object a radar could see if nothing were in the way.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Sight {
    /// Share of the object, of the solid angle of the sides of its box that face the radar, that other objects are in front of,
    /// 0 to 1. Ground hides nothing, and reflections do not count.
    #[serde(default)]
    pub occluded: f64,
    /// Share that is outside of the searched azimuths and elevations, or beyond the radar's unambiguous range, 0 to 1.
    #[serde(default)]
    pub outside_view: f64,
}

/// Samples along each side of a box.
const SAMPLES: usize = 8;

impl Bodies {
    /// How much of the object (of the whole actor that it is a part of) the radar could see.
    pub fn sight(&self, object: u32, radar: &Radar) -> Sight {
        let Some(own) = self.objects.get(&object).map(|b| b.actor) else { return Sight::default() };
        let whole = &self.extents[own].whole;
        let (centre, radius) = whole.sphere();
        // Occluders that reach into the cone from the radar about the object.
        let (distance, ahead) = (centre.length(), centre.normalize_or_zero());
        let before = |e: &Extent| {
            let (c, r) = e.whole.sphere();
            let along = c.dot(ahead);
            let wide = radius * (along / distance.max(radius)).clamp(0.0, 1.0) + r;
            !e.is_ground && along > -r && along < distance + radius + r && (c - along * ahead).length() < wide
        };
        let others: Vec<&Extent> =
            self.extents.iter().enumerate().filter(|(i, e)| *i != own && before(e)).map(|(_, e)| e).collect();
        let fov = [radar.processing.azimuth_fov_rad, radar.processing.elevation_fov_rad];
        let searches_elevation = radar.processing.elevation_bins > 1;
        let is_outside = |p: DVec3| {
            let (azimuth, elevation) = angles_from_direction(p);
            azimuth.abs() > fov[0]
                || (searches_elevation && elevation.abs() > fov[1])
                || p.length() > radar.max_range_m()
        };
        let (mut all, mut hidden, mut outside) = (0.0, 0.0, 0.0);
        for (p, weight) in whole.samples() {
            all += weight;
            hidden += if others.iter().any(|e| e.hides(p)) { weight } else { 0.0 };
            outside += if is_outside(p) { weight } else { 0.0 };
        }
        match all > 0.0 {
            true => Sight { occluded: hidden / all, outside_view: outside / all },
            false => Sight::default(),
        }
    }
}

impl BodyBox {
    /// Middle and radius of the sphere around the box.
    fn sphere(&self) -> (DVec3, f64) {
        let half = 0.5 * (self.upper_m - self.lower_m);
        (self.pose.point(self.lower_m + half), half.length())
    }

    /// Places on the sides that face the radar, with their solid angles; the middle alone of a box without an extent.
    fn samples(&self) -> Vec<(DVec3, f64)> {
        let half = 0.5 * (self.upper_m - self.lower_m);
        let middle = self.lower_m + half;
        let eye = self.pose.inverse().point(DVec3::ZERO) - middle;
        let mut out = Vec::new();
        for axis in 0..3 {
            if eye[axis].abs() <= half[axis] {
                continue;
            }
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for i in 0..SAMPLES * SAMPLES {
                let step = |k: usize| 2.0 * (k as f64 + 0.5) / SAMPLES as f64 - 1.0;
                let mut p = DVec3::ZERO;
                p[axis] = half[axis].copysign(eye[axis]);
                p[u] = half[u] * step(i / SAMPLES);
                p[v] = half[v] * step(i % SAMPLES);
                let to = eye - p;
                let angle = half[u] * half[v] * to[axis].abs() / to.length().powi(3);
                out.push((self.pose.point(middle + p), angle));
            }
        }
        if out.iter().all(|s| s.1 <= 0.0) {
            return vec![(self.pose.point(middle), 1.0)];
        }
        out
    }
}

impl Extent {
    /// Whether the actor is between the radar and a place.
    fn hides(&self, p: DVec3) -> bool {
        // The box, cut by its slabs.
        let inverse = self.whole.pose.inverse();
        let (from, to) = (inverse.point(DVec3::ZERO), inverse.point(p));
        let (mut start, mut end): (f64, f64) = (0.0, 1.0 - 1e-6);
        for axis in 0..3 {
            let (a, d) = (from[axis], to[axis] - from[axis]);
            let (lower, upper) = (self.whole.lower_m[axis], self.whole.upper_m[axis]);
            if d.abs() < 1e-12 {
                if a < lower || a > upper {
                    return false;
                }
                continue;
            }
            let (t, s) = ((lower - a) / d, (upper - a) / d);
            (start, end) = (start.max(t.min(s)), end.min(t.max(s)));
        }
        if start >= end {
            return false;
        }
        // A radar inside of a box is not hidden by it.
        let Some(triangles) = &self.surface_m else { return start > 0.0 };
        triangles.iter().any(|t| crosses(p, t))
    }
}

/// Whether the line from the origin to `p` crosses a triangle before it ends (Möller and Trumbore 1997).
fn crosses(p: DVec3, [a, b, c]: &[DVec3; 3]) -> bool {
    let (e, f) = (*b - *a, *c - *a);
    let h = p.cross(f);
    let determinant = e.dot(h);
    if determinant.abs() < 1e-15 {
        return false;
    }
    let s = -*a / determinant;
    let u = s.dot(h);
    let q = s.cross(e);
    let v = p.dot(q);
    let t = f.dot(q);
    u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 && t < 1.0 - 1e-6
}

/// Where a radar sees something, with the half axes of its uncertainty.
pub(super) struct Place {
    range_m: f64,
    azimuth_rad: f64,
    /// None where the array does not measure it.
    elevation_rad: Option<f64>,
    /// Along range, azimuth and elevation, m.
    half_axes_m: [f64; 3],
}

impl Place {
    /// Of a point whose range is wrong by `excess_m`: half axes of three standard deviations and at least `min_m`. A direction at the
    /// edge of the search is a bound, and none.
    pub fn of(point: &Point, excess_m: f64, min_m: f64) -> Place {
        Place::with(point, excess_m, min_m, !point.at_search_edge)
    }

    /// Of a point as its columns state it, a direction at the edge of the search taken as measured.
    pub fn as_stated(point: &Point, min_m: f64) -> Place {
        Place::with(point, 0.0, min_m, true)
    }

    fn with(point: &Point, excess_m: f64, min_m: f64, has_direction: bool) -> Place {
        // Other directions that the array confuses with the point's are elsewhere: the point is where it is.
        let half = |std: Option<f64>, others: f64| {
            let own = std.filter(|_| has_direction).map(|s| (s * s - others * others).max(0.0).sqrt());
            own.map_or(FRAC_PI_2 * point.range_m, |s| 3.0 * s * point.range_m).max(min_m)
        };
        let [by_azimuth, by_elevation] = point.others_std_rad;
        Place {
            range_m: point.range_m - excess_m,
            azimuth_rad: point.azimuth_rad,
            elevation_rad: point.std.elevation_rad.map(|_| point.elevation_rad),
            half_axes_m: [
                (3.0 * point.std.range_m).max(min_m),
                half(point.std.azimuth_rad, by_azimuth),
                half(point.std.elevation_rad, by_elevation),
            ],
        }
    }

    /// Where an echo itself appears.
    pub fn of_echo(path: &EchoPath, point: &Point, min_m: f64) -> Place {
        let (azimuth_rad, elevation_rad) = angles_from_direction(path.direction());
        let seen = Point { range_m: path.range_m(), azimuth_rad, elevation_rad, ..point.clone() };
        Place::of(&seen, 0.0, min_m)
    }

    /// Whether the actor is outside of the ellipsoid about the place.
    fn is_off(&self, extent: &Extent) -> bool {
        let whole = &extent.whole;
        let mut azimuth = self.azimuth_rad;
        let elevation = self.elevation_rad.unwrap_or_else(|| {
            // What was measured is u_y, whatever the height.
            let sine = direction_from_angles(azimuth, 0.0).y;
            let elevation = angles_from_direction(whole.pose.point(0.5 * (whole.lower_m + whole.upper_m))).1;
            azimuth = (sine / elevation.cos()).clamp(-1.0, 1.0).asin();
            if self.azimuth_rad.abs() > FRAC_PI_2 {
                azimuth = PI.copysign(self.azimuth_rad) - azimuth;
            }
            elevation
        });
        let (sin, cos) = (azimuth.sin(), azimuth.cos());
        let along = direction_from_angles(azimuth, elevation);
        let left = DVec3::new(-sin, cos, 0.0);
        let [range, across, up] = self.half_axes_m;
        let axes = DMat3::from_cols(along / range, left / across, along.cross(left) / up).transpose();
        // To the box's frame: |A q − b|² over the box.
        let a = axes * DMat3::from_quat(whole.pose.rotation);
        let b = a * whole.pose.inverse().point(along * self.range_m);
        if least_over_box(&a, b, whole.lower_m, whole.upper_m) > 1.0 {
            return true;
        }
        let centre = axes * (along * self.range_m);
        extent.surface_m.as_ref().is_some_and(|triangles| {
            !triangles.iter().any(|t| distance_to_triangle(centre, t.map(|p| axes * p)) <= 1.0)
        })
    }
}

/// The distance from a point to a triangle.
fn distance_to_triangle(p: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let along = |from: DVec3, to: DVec3| {
        let side = to - from;
        let t = ((p - from).dot(side) / side.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        (from + t * side - p).length()
    };
    let normal = (b - a).cross(c - a);
    let within = |from: DVec3, to: DVec3| (to - from).cross(p - from).dot(normal) >= 0.0;
    let length = normal.length();
    if length > 0.0 && within(a, b) && within(b, c) && within(c, a) {
        return ((p - a).dot(normal) / length).abs();
    }
    along(a, b).min(along(b, c)).min(along(c, a))
}

/// min |A q − b| over lower ≤ q ≤ upper: one of the 27 ways for each coordinate to be free or at a bound is the
/// minimum's, and every other way gives a point of the box that is no nearer.
fn least_over_box(a: &DMat3, b: DVec3, lower: DVec3, upper: DVec3) -> f64 {
    let mut least = f64::INFINITY;
    for way in 0..27usize {
        let state = [way % 3, way / 3 % 3, way / 9];
        let mut q = DVec3::ZERO;
        let mut rest = b;
        // Bound coordinates stand in the system as q_i = bound.
        let mut columns = [DVec3::ZERO; 3];
        for i in 0..3 {
            match state[i] {
                0 => columns[i] = a.col(i),
                s => {
                    q[i] = if s == 1 { lower[i] } else { upper[i] };
                    rest -= q[i] * a.col(i);
                }
            }
        }
        let free: Vec<usize> = (0..3).filter(|i| state[*i] == 0).collect();
        let mut normal = DMat3::IDENTITY;
        let mut right = DVec3::ZERO;
        for &i in &free {
            right[i] = columns[i].dot(rest);
            for &j in &free {
                normal.col_mut(j)[i] = columns[i].dot(columns[j]);
            }
        }
        let solved = normal.inverse() * right;
        for &i in &free {
            q[i] = solved[i];
        }
        let q = q.clamp(lower, upper);
        let distance = (*a * q - b).length();
        if distance < least {
            least = distance;
        }
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::road::shape::cuboid;
    use crate::scene::Mesh;
    use crate::scene::radar_toml::preset;
    use glam::DQuat;

    /// Against a search over a fine grid of the box.
    #[test]
    fn the_nearest_place_of_a_box() {
        let (lower, upper) = (DVec3::new(-2.0, -1.0, 0.0), DVec3::new(2.0, 1.0, 1.5));
        let turn = DMat3::from_rotation_z(0.7) * DMat3::from_rotation_x(0.3);
        let a = DMat3::from_diagonal(DVec3::new(9.0, 1.5, 0.4)) * turn;
        for (i, p) in
            [[0.5, 0.5, 0.5], [4.0, 0.0, 1.0], [3.0, 3.0, -2.0], [-2.5, 0.2, 4.0], [-9.0, -8.0, 0.0]]
                .into_iter()
                .enumerate()
        {
            let b = a * DVec3::from_array(p);
            let got = least_over_box(&a, b, lower, upper);
            let n = 60;
            let mut want = f64::INFINITY;
            for k in 0..(n + 1) * (n + 1) * (n + 1) {
                let at = DVec3::new(
                    (k % (n + 1)) as f64,
                    (k / (n + 1) % (n + 1)) as f64,
                    (k / (n + 1) / (n + 1)) as f64,
                );
                want = want.min((a * (lower + at / n as f64 * (upper - lower)) - b).length());
            }
            assert!(got <= want + 1e-9, "{got} {want}");
            assert!(i > 0 || got < 1e-12, "a place inside");
            // One step of the grid is at most |A| times its diagonal.
            assert!(want - got < 9.0 * (upper - lower).length() / n as f64, "{got} {want}");
        }
    }

    /// A car 20 m ahead: alone, half behind a wall, behind a wall that bends round it, and half outside of the searched azimuths.
    #[test]
    fn shares_that_are_hidden_and_out_of_view() {
        let radar = preset("front77").unwrap();
        let fov = radar.processing.azimuth_fov_rad;
        let at = |x: f64, y: f64| Pose::new(DQuat::IDENTITY, DVec3::new(x, y, 0.0));
        let sight = |add: &dyn Fn(&mut Scene), car: Pose<Target, World>| {
            let mut s = Scene::default();
            s.add_mesh("car", "car", cuboid(DVec3::new(4.0, 2.0, 1.5), DVec3::ZERO, 0), car);
            s.add_mesh("road", "road", cuboid(DVec3::new(200.0, 20.0, 0.1), DVec3::ZERO, 0), at(50.0, 0.0));
            add(&mut s);
            Bodies::new(&s, 0.0, &Pose::IDENTITY).sight(1, &radar)
        };
        assert_eq!(sight(&|_| {}, at(20.0, 0.0)), Sight::default());
        // The left half of the rear, 18 m away, is all that faces the radar.
        let left = |s: &mut Scene| {
            s.add_mesh("wall", "wall", cuboid(DVec3::new(0.2, 10.0, 6.0), DVec3::ZERO, 0), at(10.0, 5.0));
        };
        let half = sight(&left, at(20.0, 0.0));
        assert!((half.occluded - 0.5).abs() < 1e-9 && half.outside_view == 0.0, "{half:?}");
        // An arc about the car from behind it to both sides: its box holds the car, its surface hides nothing.
        let arc = |s: &mut Scene| {
            let mut mesh = Mesh::default();
            for i in 0..=20 {
                let a = -1.2 + 0.12 * f64::from(i);
                mesh.positions_m
                    .extend([-2.0, 4.0].map(|z| DVec3::new(20.0 + 8.0 * a.cos(), 8.0 * a.sin(), z)));
            }
            for i in 0..20u32 {
                mesh.triangles.extend([[2 * i, 2 * i + 1, 2 * i + 2], [2 * i + 1, 2 * i + 3, 2 * i + 2]]);
            }
            mesh.material = vec![0; mesh.triangles.len()];
            s.add_mesh("arc", "wall", mesh, Pose::IDENTITY);
        };
        assert_eq!(sight(&arc, at(20.0, 0.0)).occluded, 0.0);
        // The radar sees the car through the other side of the arc when this is turned round.
        let turned = |s: &mut Scene| {
            arc(s);
            let id = s.objects.len() - 1;
            s.objects[id].pose = Pose::from_yaw_pitch_roll(DVec3::new(40.0, 0.0, 0.0), PI, 0.0, 0.0);
        };
        assert!(sight(&turned, at(20.0, 0.0)).occluded > 0.99);
        // A small one at the edge of what is searched: half of it is beyond.
        let edge = at(20.0 * fov.cos(), 20.0 * fov.sin());
        let out = sight(&|_| {}, edge);
        assert!((0.2..0.8).contains(&out.outside_view) && out.occluded == 0.0, "{out:?}");
        assert_eq!(sight(&|_| {}, at(400.0, 0.0)).outside_view, 1.0);
    }
}
