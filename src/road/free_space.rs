//! How far one may drive from a place in every direction: to the edge of what is drivable, or to what stands
//! on it (CONVENTIONS eq. 162).

use crate::road::actors::{ActorBox, actor_boxes, is_ground};
use crate::road::labels::RoadTruth;
use crate::road::near;
use crate::scene::{Scene, Shape};
use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// Rays, one a degree.
pub const RAYS: usize = 360;
/// What hangs higher over the road is driven under.
const CLEARANCE_M: f64 = 2.0;
/// Drivable surfaces that are no farther apart adjoin.
const SEAM_M: f64 = 0.1;
/// Objects longer than this may follow a road up and down.
const LONG_M: f64 = 20.0;
/// Classes beside the ground that a wheel goes over.
const FLAT: [&str; 2] = ["marker", "manhole"];

/// Distances along rays in plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FreeSpace {
    /// Where the rays begin, (x, y) in the world.
    pub origin_m: [f64; 2],
    /// Direction of the first ray in the world's plane, positive to the left; the others follow to the left, 1° apart.
    pub first_ray_rad: f64,
    /// Free length of each ray; 0 from a place that is not drivable.
    pub distance_m: Vec<f64>,
    /// The ends of the rays in the world: a polygon, counter-clockwise.
    pub polygon_m: Vec<[f64; 2]>,
}

/// The rays that meet things.
struct Fan {
    origin: DVec2,
    first_rad: f64,
}

impl Fan {
    fn direction(&self, ray: usize) -> DVec2 {
        DVec2::from_angle(self.first_rad + TAU * ray as f64 / RAYS as f64)
    }

    /// Calls `hit(ray, distance)` for every ray that meets the segment. A ray through a common end of two segments
    /// meets one of them.
    fn cross(&self, a: DVec2, b: DVec2, hit: &mut impl FnMut(usize, f64)) {
        let (a, b) = (a - self.origin, b - self.origin);
        let area = a.perp_dot(b);
        if area == 0.0 {
            return;
        }
        let place = |p: DVec2| (p.y.atan2(p.x) - self.first_rad) / TAU * RAYS as f64;
        let (mut from, mut to) = (place(a), place(b));
        if area < 0.0 {
            (from, to) = (to, from);
        }
        to -= RAYS as f64 * ((to - from) / RAYS as f64).floor();
        let along = b - a;
        let mut ray = from.ceil();
        while ray < to {
            let k = ray.rem_euclid(RAYS as f64) as usize % RAYS;
            let distance = area / self.direction(k).perp_dot(along);
            if distance >= 0.0 {
                hit(k, distance);
            }
            ray += 1.0;
        }
    }
}

/// Free lengths from `at` within `reach_m` at `time_s`, the first ray half a turn right of `heading_rad`: inside the drivable
/// outlines of `truth` up to the outline of anything but ground, paint, markers and manholes that reaches lower than 2 m
/// over the road. Point targets and scattering tables take no room.
pub fn free_space(
    truth: &RoadTruth,
    scene: &Scene,
    time_s: f64,
    at: DVec2,
    heading_rad: f64,
    reach_m: f64,
) -> FreeSpace {
    let fan = Fan { origin: at, first_rad: heading_rad - PI };
    let mut free = drivable(truth, &fan, reach_m);
    for b in actor_boxes(scene, time_s) {
        let first = &scene.objects[b.parts[0]];
        if !is_ground(&first.class) && !FLAT.contains(&first.class.as_str()) && near_box(&b, at, reach_m) {
            blocked(truth, scene, time_s, &b, &fan, &mut free);
        }
    }
    let ends = free.iter().enumerate().map(|(k, d)| (at + *d * fan.direction(k)).to_array());
    FreeSpace {
        origin_m: at.to_array(),
        first_ray_rad: fan.first_rad,
        polygon_m: ends.collect(),
        distance_m: free,
    }
}

/// Length of each ray inside the outlines, over seams.
fn drivable(truth: &RoadTruth, fan: &Fan, reach_m: f64) -> Vec<f64> {
    let mut inside: Vec<Vec<(f64, f64)>> = vec![Vec::new(); RAYS];
    for outline in truth.roads.iter().flat_map(|r| &r.free_space_m) {
        let mut crossings: Vec<Vec<f64>> = vec![Vec::new(); RAYS];
        for i in 0..outline.len() {
            let (a, b) = (outline[i], outline[(i + 1) % outline.len()]);
            fan.cross(DVec2::new(a[0], a[1]), DVec2::new(b[0], b[1]), &mut |k, d| crossings[k].push(d));
        }
        for (runs, mut list) in inside.iter_mut().zip(crossings) {
            list.sort_by(f64::total_cmp);
            // An odd number of crossings: it begins inside.
            if list.len() % 2 == 1 {
                list.insert(0, 0.0);
            }
            runs.extend(list.chunks_exact(2).map(|c| (c[0], c[1])));
        }
    }
    let length = |mut runs: Vec<(f64, f64)>| {
        runs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut end = 0.0;
        for (from, to) in runs {
            let seam = if end > 0.0 { SEAM_M } else { 0.0 };
            if from <= end + seam {
                end = to.max(end);
            }
        }
        end.min(reach_m)
    };
    inside.into_iter().map(length).collect()
}

/// Whether any of the box may lie within reach.
fn near_box(b: &ActorBox, at: DVec2, reach_m: f64) -> bool {
    b.centre_m().truncate().distance(at) <= reach_m + 0.5 * b.size_m().length()
}

/// Shortens the rays that an actor's triangles meet.
fn blocked(truth: &RoadTruth, scene: &Scene, time_s: f64, b: &ActorBox, fan: &Fan, free: &mut [f64]) {
    let long = b.size_m().length() > LONG_M;
    let here = near::height_m(truth, b.centre_m().truncate()).unwrap_or(0.0);
    let over = |p: [DVec3; 3]| {
        let ground = if long { near::height_m(truth, p[0].truncate()).unwrap_or(here) } else { here };
        p.iter().map(|p| p.z).fold(f64::INFINITY, f64::min) > ground + CLEARANCE_M
    };
    for part in b.parts.iter().map(|i| &scene.objects[*i]) {
        let Shape::Mesh(m) = part.shape else { continue };
        let pose = part.at(time_s).pose();
        let mesh = &scene.meshes[m];
        let world: Vec<DVec3> = mesh.positions_m.iter().map(|p| pose.point(*p)).collect();
        for t in &mesh.triangles {
            let p = t.map(|i| world[i as usize]);
            if over(p) {
                continue;
            }
            for i in 0..3 {
                let (a, b) = (p[i].truncate(), p[(i + 1) % 3].truncate());
                fan.cross(a, b, &mut |k, d| free[k] = free[k].min(d));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::frames::Pose;
    use crate::road::labels::RoadLabel;
    use crate::road::shape::cuboid;

    fn strip(name: &str, x: (f64, f64), y: (f64, f64)) -> RoadLabel {
        RoadLabel {
            name: name.into(),
            length_m: x.1 - x.0,
            s_m: vec![0.0, x.1 - x.0],
            axis_m: vec![[x.0, 0.0, 0.0], [x.1, 0.0, 0.0]],
            curvature_per_m: vec![0.0; 2],
            left_edge_m: Vec::new(),
            right_edge_m: Vec::new(),
            lanes: Vec::new(),
            lines: Vec::new(),
            free_space_m: vec![vec![[x.0, y.0, 0.0], [x.1, y.0, 0.0], [x.1, y.1, 0.0], [x.0, y.1, 0.0]]],
        }
    }

    /// Length inside a box from the origin, by the slab method.
    fn slab(u: DVec2, lo: DVec2, hi: DVec2) -> Option<(f64, f64)> {
        let (mut from, mut to) = (f64::NEG_INFINITY, f64::INFINITY);
        for i in 0..2 {
            if u[i].abs() < 1e-12 {
                if !(lo[i]..=hi[i]).contains(&0.0) {
                    return None;
                }
                continue;
            }
            let (a, b) = (lo[i] / u[i], hi[i] / u[i]);
            (from, to) = (from.max(a.min(b)), to.min(a.max(b)));
        }
        (from <= to && to >= 0.0).then_some((from, to))
    }

    #[test]
    fn rays_end_at_edges_and_things() {
        // Two strips that adjoin, a car to the left ahead, a gantry's beam overhead, a marker.
        let truth = RoadTruth {
            name: "t".into(),
            roads: vec![strip("a", (-20.0, 80.0), (-4.0, 4.0)), strip("b", (0.0, 80.0), (4.03, 9.0))],
            marker_rows: Vec::new(),
        };
        let mut s = Scene::default();
        let car = cuboid(DVec3::new(4.0, 2.0, 1.5), DVec3::new(0.0, 0.0, 0.75), 0);
        s.add_mesh("car", "car", car.clone(), Pose::new(glam::DQuat::IDENTITY, DVec3::new(20.0, 3.0, 0.0)));
        let beam = cuboid(DVec3::new(0.5, 20.0, 0.5), DVec3::new(10.0, 0.0, 5.0), 0);
        s.add_mesh("gantry", "gantry", beam, Pose::IDENTITY);
        s.add_mesh("marker", "marker", car, Pose::new(glam::DQuat::IDENTITY, DVec3::new(15.0, -2.0, 0.0)));
        let yaw = 0.4;
        let f = free_space(&truth, &s, 0.0, DVec2::ZERO, yaw, 60.0);
        let mut by_car = 0;
        for (k, got) in f.distance_m.iter().enumerate() {
            let u = DVec2::from_angle(yaw - PI + (k as f64).to_radians());
            let a = slab(u, DVec2::new(-20.0, -4.0), DVec2::new(80.0, 4.0)).unwrap().1;
            let mut want = a;
            if let Some((from, to)) = slab(u, DVec2::new(0.0, 4.03), DVec2::new(80.0, 9.0))
                && from <= a + SEAM_M
            {
                want = to.max(a);
            }
            want = want.min(60.0);
            if let Some((from, _)) = slab(u, DVec2::new(18.0, 2.0), DVec2::new(22.0, 4.0)) {
                by_car += usize::from(from < want);
                want = want.min(from);
            }
            assert!((got - want).abs() < 1e-9, "ray {k}: {got} for {want}");
            let end = DVec2::from_array(f.polygon_m[k]);
            assert!(end.distance(u * want) < 1e-9);
        }
        assert!(by_car > 5, "{by_car}");
        // Off the road nothing is free.
        let off = free_space(&truth, &s, 0.0, DVec2::new(0.0, -6.0), 0.0, 60.0);
        assert!(off.distance_m.iter().all(|d| *d == 0.0));
    }

    #[test]
    fn a_thing_that_has_moved_blocks_elsewhere() {
        let truth = RoadTruth {
            name: "t".into(),
            roads: vec![strip("a", (-20.0, 80.0), (-4.0, 4.0))],
            ..Default::default()
        };
        let mut s = Scene::default();
        let car = cuboid(DVec3::new(4.0, 2.0, 1.5), DVec3::new(0.0, 0.0, 0.75), 0);
        s.add_mesh("car", "car", car, Pose::IDENTITY);
        s.objects[0].velocity_mps = DVec3::X * 10.0;
        let ahead = |t| free_space(&truth, &s, t, DVec2::ZERO, 0.0, 150.0).distance_m[180];
        assert!((ahead(1.0) - 8.0).abs() < 1e-9 && (ahead(3.0) - 28.0).abs() < 1e-9);
    }
}
