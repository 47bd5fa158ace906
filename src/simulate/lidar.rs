//! What an ideal lidar sees of a scene at one instant: the nearest surface in each direction, without noise, beam width or loss.
//!
//! The meshes are taken as the scene has them, with flat triangles, and every material stops the beam, glass too. Point targets
//! and objects that scatter by a table have no surface, so a lidar does not see them.

use crate::base::frames::{Pose, Sensor, World, direction_from_angles};
use crate::formats::column::{Column, Get};
use crate::geom::Triangle;
use crate::geom::bvh::Bvh;
use crate::scene::lidar::Lidar;
use crate::scene::motion::Moving;
use crate::scene::scenario::Ego;
use crate::scene::{Scene, Shape};
use glam::DVec3;
use rayon::prelude::*;
use std::borrow::Cow;

/// Boxes of the tree are padded by this share of the scene's size, as those of traced scenes are.
const PADDING: f64 = 1e-6;
/// Triangles reach this share of their size past their edges, so that no ray slips between two of them.
const SLACK: f64 = 1e-9;

/// A place on a surface that a lidar sees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LidarPoint<'a> {
    /// Place in the vehicle's axes, m.
    pub position_m: DVec3,
    /// Distance from the lidar, m.
    pub range_m: f64,
    /// Rate of the distance, m/s, positive receding; it includes the vehicle's own motion.
    pub range_rate_mps: f64,
    /// Angle between the ray and the surface's normal, rad, 0 to π/2.
    pub incidence_rad: f64,
    /// Number of the channel, from the lowest.
    pub channel: u32,
    /// Number of the object.
    pub object_id: u32,
    /// Class of the object.
    pub class: &'a str,
}

/// Columns of `lidar.csv` and of the table `lidar` of datasets.
pub const fn columns<'a>() -> [Column<LidarPoint<'a>>; 9] {
    [
        Column::number("range_m", "distance from the lidar, in the middle of the frame", |p| p.range_m),
        Column::number(
            "range_rate_mps",
            "range rate of the surface, positive when it recedes; it includes the vehicle's own motion",
            |p| p.range_rate_mps,
        ),
        Column::number("x_m", "forward coordinate from the vehicle's origin", |p| p.position_m.x),
        Column::number("y_m", "left coordinate from the vehicle's origin", |p| p.position_m.y),
        Column::number("z_m", "up coordinate from the vehicle's origin", |p| p.position_m.z),
        Column::number("incidence_deg", "angle between the ray and the surface normal, 0 to 90", |p| {
            p.incidence_rad.to_degrees()
        }),
        Column {
            name: "channel",
            about: "number of the lidar's channel, from the lowest",
            get: Get::Count(|p| p.channel),
        },
        Column {
            name: "object_id",
            about: "id of the object to which the surface belongs",
            get: Get::Count(|p| p.object_id),
        },
        Column {
            name: "class",
            about: "class of the object",
            get: Get::Text(32, |p| Cow::Borrowed(p.class)),
        },
    ]
}

/// Pose of the lidar at a time from the middle of frame 0, and its velocity in the world, m/s.
pub fn lidar_pose(lidar: &Lidar, ego: &Ego, time_s: f64) -> (Pose<Sensor, World>, DVec3) {
    let pose = lidar.mounting.then(&ego.pose(time_s));
    (pose, ego.at(time_s).velocity_at(pose.translation_m))
}

/// The points of a scan at a time from the middle of frame 0, azimuth after azimuth and in each from the lowest channel. All rays
/// look at this one instant. A ray that meets nothing gives no point.
pub fn scan<'a>(lidar: &Lidar, scene: &'a Scene, ego: &Ego, time_s: f64) -> Vec<LidarPoint<'a>> {
    let (in_world, own_mps) = lidar_pose(lidar, ego, time_s);
    let into = in_world.inverse();
    let moving: Vec<Moving> = scene.objects.iter().map(|o| o.at(time_s)).collect();
    let mut triangles = Vec::new();
    let (mut low, mut high) = (DVec3::ZERO, DVec3::ZERO);
    for (number, (object, now)) in (0u32..).zip(scene.objects.iter().zip(&moving)) {
        let Shape::Mesh(m) = object.shape else { continue };
        let pose = now.pose().then(&into);
        let mesh = &scene.meshes[m];
        let places: Vec<DVec3> = mesh.positions_m.iter().map(|p| pose.point(*p)).collect();
        for corners in mesh.triangles.iter().map(|t| t.map(|i| places[i as usize])) {
            let (from, to) =
                (corners[0].min(corners[1]).min(corners[2]), corners[0].max(corners[1]).max(corners[2]));
            // Whatever lies out of reach is left out of the tree.
            if DVec3::ZERO.clamp(from, to).length() > lidar.max_range_m {
                continue;
            }
            (low, high) = (low.min(from), high.max(to));
            triangles.extend(Triangle::new(corners, 0, number, 0));
        }
    }
    let bvh = Bvh::build(&mut triangles, PADDING * (high - low).max_element().max(1e-3));
    let ray = |azimuth: f64, channel: u32, elevation: f64| {
        let direction = direction_from_angles(azimuth, elevation);
        let hit = bvh.closest_without_gaps(&triangles, DVec3::ZERO, direction, SLACK, lidar.max_range_m)?;
        let triangle = &triangles[hit.triangle as usize];
        let (object, now) = (&scene.objects[triangle.body as usize], &moving[triangle.body as usize]);
        let place = direction * hit.t;
        let speed_mps = now.velocity_at(in_world.point(place)) - own_mps;
        Some(LidarPoint {
            position_m: lidar.mounting.point(place),
            range_m: hit.t,
            range_rate_mps: speed_mps.dot(in_world.direction(direction)),
            incidence_rad: direction.dot(triangle.normal).abs().min(1.0).acos(),
            channel,
            object_id: object.id,
            class: &object.class,
        })
    };
    let column = |azimuth: &f64| -> Vec<LidarPoint<'a>> {
        let channels = (0u32..).zip(&lidar.elevations_rad);
        channels.filter_map(|(channel, elevation)| ray(*azimuth, channel, *elevation)).collect()
    };
    lidar.azimuths_rad.par_iter().flat_map_iter(column).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::frames::{Target, Vehicle, angles_from_direction};
    use crate::scene::Mesh;
    use std::f64::consts::{PI, TAU};

    fn lidar(mounting: Pose<Sensor, Vehicle>) -> Lidar {
        Lidar {
            elevations_rad: (-30..=30).map(|i| f64::from(i).to_radians()).collect(),
            azimuths_rad: (-180..180).map(|i| f64::from(i).to_radians()).collect(),
            max_range_m: 100.0,
            mounting,
        }
    }

    fn ego(position_m: DVec3, yaw_rad: f64, speed_mps: f64) -> Ego {
        Ego { position_m, yaw_rad, speed_mps, motion: None }
    }

    fn mesh(positions_m: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Mesh {
        let material = vec![0; triangles.len()];
        Mesh { positions_m, triangles, material, ..Mesh::default() }
    }

    /// A rectangle about the origin across x, of this width along y and height along z.
    fn screen(width_m: f64, height_m: f64) -> Mesh {
        let at = |y: f64, z: f64| DVec3::new(0.0, 0.5 * y * width_m, 0.5 * z * height_m);
        mesh(vec![at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)], vec![[0, 1, 2], [0, 2, 3]])
    }

    fn at(x: f64, y: f64, z: f64) -> Pose<Target, World> {
        Pose::new(glam::DQuat::IDENTITY, DVec3::new(x, y, z))
    }

    /// The ground: a ray of elevation -e from height h meets it at h / sin e, and every point has height 0.
    #[test]
    fn ground_has_its_ranges() {
        let mut scene = Scene::default();
        let far = 400.0;
        let corners = [(-far, -far), (far, -far), (far, far), (-far, far)];
        let ground = mesh(corners.map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec(), vec![[0, 1, 2], [0, 2, 3]]);
        let id = scene.add_mesh("ground", "road", ground, at(0.0, 0.0, 0.0));
        // Heading and place of the vehicle change nothing on endless ground.
        for (position, yaw) in [(DVec3::ZERO, 0.0), (DVec3::new(30.0, -20.0, 0.0), 1.1)] {
            let l = lidar(Pose::new(glam::DQuat::IDENTITY, DVec3::new(0.9, 0.1, 1.85)));
            let points = scan(&l, &scene, &ego(position, yaw, 12.0), 0.25);
            // Elevations from -30 to -2 degrees reach it within 100 m: sin(1.06 deg) is 1.85 / 100.
            assert_eq!(points.len(), 29 * 360);
            for (i, p) in points.iter().enumerate() {
                let (azimuth, elevation) = (l.azimuths_rad[i / 29], l.elevations_rad[i % 29]);
                assert_eq!((p.channel, p.object_id, p.class), ((i % 29) as u32, id, "road"));
                assert!((p.range_m - 1.85 / (-elevation).sin()).abs() < 1e-9, "{p:?}");
                assert!(p.position_m.z.abs() < 1e-9, "{p:?}");
                let flat = 1.85 / (-elevation).tan();
                assert!((p.position_m.x - 0.9 - flat * azimuth.cos()).abs() < 1e-9, "{p:?}");
                assert!((p.position_m.y - 0.1 - flat * azimuth.sin()).abs() < 1e-9, "{p:?}");
                assert!((p.incidence_rad - (0.5 * PI + elevation)).abs() < 1e-9, "{p:?}");
                // The ground comes towards a vehicle that drives ahead.
                let rate = -12.0 * elevation.cos() * azimuth.cos();
                assert!((p.range_rate_mps - rate).abs() < 1e-9, "{p:?} {rate}");
            }
        }
    }

    /// A ball of fine triangles: the nearest point of each ray lies on the ball to within the depth of its facets.
    #[test]
    fn a_ball_has_its_ranges() {
        let (radius, centre, rows) = (2.0, DVec3::new(12.0, 5.0, 1.0), 180u32);
        let columns = 2 * rows;
        let mut positions = Vec::new();
        for row in 0..=rows {
            for column in 0..columns {
                let (polar, turn) =
                    (PI * f64::from(row) / f64::from(rows), TAU * f64::from(column) / f64::from(columns));
                positions.push(
                    radius * DVec3::new(polar.sin() * turn.cos(), polar.sin() * turn.sin(), polar.cos()),
                );
            }
        }
        let number = |row: u32, column: u32| row * columns + column % columns;
        let mut triangles = Vec::new();
        for row in 0..rows {
            for column in 0..columns {
                let (a, b) = (number(row, column), number(row, column + 1));
                let (c, d) = (number(row + 1, column), number(row + 1, column + 1));
                triangles.extend([[a, c, b], [b, c, d]]);
            }
        }
        let mut scene = Scene::default();
        scene.add_mesh("ball", "ball", mesh(positions, triangles), at(centre.x, centre.y, centre.z));
        let l = lidar(Pose::IDENTITY);
        let points = scan(&l, &scene, &ego(DVec3::ZERO, 0.0, 0.0), 0.0);
        // Cells of one degree lie at most this deep below the sphere.
        let depth = radius * (1.0 - (0.5 * 2f64.sqrt() * PI / f64::from(rows)).cos());
        let mut met = 0;
        for azimuth in &l.azimuths_rad {
            for elevation in &l.elevations_rad {
                let u = direction_from_angles(*azimuth, *elevation);
                let (along, miss) = (u.dot(centre), u.cross(centre).length());
                let found = points.iter().find(|p| p.position_m.normalize().distance(u) < 1e-9);
                match found {
                    Some(p) => {
                        assert!(miss <= radius, "{miss}");
                        let half_chord = (radius * radius - miss * miss).sqrt();
                        // The facets lie between the ball and a smaller one inside them.
                        let inner = (radius - depth).powi(2) - miss * miss;
                        let last = if inner > 0.0 { along - inner.sqrt() } else { along + half_chord };
                        let first = along - half_chord;
                        assert!((first - 1e-9..last + 1e-9).contains(&p.range_m), "{first} {last} {p:?}");
                        met += 1;
                    }
                    None => assert!(along < 0.0 || miss > radius - depth, "{miss}"),
                }
            }
        }
        assert!(met > 200 && met == points.len(), "{met} of {}", points.len());
    }

    /// Of a car that moves the range rate is its velocity along the ray, less the lidar's own.
    #[test]
    fn moving_things_have_their_rates() {
        let mut scene = Scene::default();
        let velocity = DVec3::new(-7.0, 3.0, 0.5);
        scene.add_mesh("car", "car", screen(2.0, 1.5), at(20.0, 4.0, 0.5));
        scene.objects[0].velocity_mps = velocity;
        for (yaw, speed) in [(0.0, 0.0), (0.4, 15.0)] {
            let e = ego(DVec3::ZERO, yaw, speed);
            let l = lidar(Pose::from_yaw_pitch_roll(DVec3::new(1.0, 0.0, 1.0), 0.2, 0.05, 0.0));
            let points = scan(&l, &scene, &e, 0.5);
            assert!(points.len() > 5, "{}", points.len());
            let eye = lidar_pose(&l, &e, 0.5).0.translation_m;
            for p in points {
                let place = e.pose(0.5).point(p.position_m);
                assert!((place.x - (20.0 - 3.5)).abs() < 1e-9, "the screen stands across x");
                let ray = (place - eye).normalize();
                let own = speed * DVec3::new(yaw.cos(), yaw.sin(), 0.0);
                assert!((p.range_rate_mps - (velocity - own).dot(ray)).abs() < 1e-9, "{p:?}");
                assert!((p.range_m - place.distance(eye)).abs() < 1e-9);
                assert!((p.incidence_rad - ray.x.acos()).abs() < 1e-9);
            }
        }
    }

    /// A wall hides the car behind it, the other way about it does not, and what is too far or has no surface gives nothing.
    #[test]
    fn the_nearest_surface_hides_the_others() {
        let seen = |wall_m: f64, max_range_m: f64| {
            let mut scene = Scene::default();
            let car = scene.add_mesh("car", "car", screen(2.0, 1.5), at(20.0, 0.0, 0.0));
            let wall = scene.add_mesh("wall", "wall", screen(6.0, 4.0), at(wall_m, 0.0, 0.0));
            scene.add_object(
                "point",
                "sign",
                Shape::Point { rcs_dbsm: 20.0 },
                at(5.0, 0.0, 0.0),
                DVec3::ZERO,
            );
            let l = Lidar { max_range_m, ..lidar(Pose::IDENTITY) };
            let points = scan(&l, &scene, &ego(DVec3::ZERO, 0.0, 0.0), 0.0);
            let count = |id: u32| points.iter().filter(|p| p.object_id == id).count();
            assert_eq!(count(car) + count(wall), points.len());
            [count(car), count(wall)]
        };
        let car = 5 * 5; // within 2.86 degrees across and 2.15 degrees up: -2 to 2, and -2 to 2
        assert_eq!(seen(10.0, 100.0)[0], 0);
        let [front, behind] = seen(30.0, 100.0);
        assert_eq!(front, car);
        // The wall at 30 m spans 5.71 degrees to each side and 3.81 degrees up and down, of which the car hides its part.
        assert_eq!(behind, 11 * 7 - car);
        assert_eq!(seen(30.0, 25.0), [car, 0]);
        assert_eq!(seen(30.0, 19.0), [0, 0]);
    }

    #[test]
    fn a_scan_repeats_and_takes_a_scene_of_nothing() {
        let l = lidar(Pose::IDENTITY);
        assert!(scan(&l, &Scene::default(), &ego(DVec3::ZERO, 0.0, 0.0), 0.0).is_empty());
        let mut scene = Scene::default();
        scene.add_mesh("wall", "wall", screen(6.0, 4.0), at(10.0, 0.0, 0.0));
        let points = || scan(&l, &scene, &ego(DVec3::ZERO, 0.0, 0.0), 0.0);
        assert_eq!(points(), points());
        let (azimuth, elevation) = angles_from_direction(points()[0].position_m);
        assert!((azimuth.to_degrees() + 16.0).abs() < 1e-9 && (elevation.to_degrees() + 10.0).abs() < 1e-9);
    }
}
