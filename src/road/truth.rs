//! Ground truth: the box around each object.

use crate::scene::{Scene, Shape};
use glam::DVec3;

/// The smallest box along an object's own axes.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct TruthBox {
    pub id: u32,
    pub name: String,
    pub class: String,
    /// Centre in the world, metres.
    pub centre_m: [f64; 3],
    /// Full lengths along the object's x, y, z, metres; zero for a point target and for a scattering table.
    pub size_m: [f64; 3],
    /// Rotation from the object's axes to the world, quaternion x, y, z, w.
    pub rotation_xyzw: [f64; 4],
    /// Heading of the object's x axis in the ground plane, radians, positive left.
    pub yaw_rad: f64,
    /// Of the centre, in the world.
    pub velocity_mps: [f64; 3],
    /// In the world, right-handed about its direction.
    pub spin_rad_per_s: [f64; 3],
}

/// One box per object of the scene at `time_s`, in the order of the objects.
pub fn truth_boxes(scene: &Scene, time_s: f64) -> Vec<TruthBox> {
    let mesh_bounds: Vec<(DVec3, DVec3)> = scene
        .meshes
        .iter()
        .map(|m| {
            let mut points = m.positions_m.iter();
            let first = points.next().copied().unwrap_or(DVec3::ZERO);
            points.fold((first, first), |(lo, hi), p| (lo.min(*p), hi.max(*p)))
        })
        .collect();
    scene
        .objects
        .iter()
        .map(|o| {
            let (lo, hi) = match o.shape {
                Shape::Mesh(m) => mesh_bounds[m],
                Shape::Point { .. } | Shape::Table(_) => (DVec3::ZERO, DVec3::ZERO),
            };
            let now = o.at(time_s);
            let pose = now.pose();
            let ahead = pose.direction(DVec3::X);
            let centre = pose.point(0.5 * (lo + hi));
            TruthBox {
                id: o.id,
                name: o.name.clone(),
                class: o.class.clone(),
                centre_m: centre.to_array(),
                size_m: (hi - lo).to_array(),
                rotation_xyzw: now.rotation.to_array(),
                yaw_rad: ahead.y.atan2(ahead.x),
                velocity_mps: now.velocity_at(centre).to_array(),
                spin_rad_per_s: now.spin_rad_per_s.to_array(),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Pose;
    use crate::road::shape::cuboid;

    #[test]
    fn turned_and_moving_box() {
        let mut s = Scene::default();
        let mesh = cuboid(DVec3::new(4.0, 2.0, 1.0), DVec3::new(1.0, 0.0, 0.5), 0);
        let yaw = 0.5 * std::f64::consts::PI;
        s.add_mesh("a", "car", mesh, Pose::from_yaw_pitch_roll(DVec3::new(10.0, 0.0, 0.0), yaw, 0.0, 0.0));
        s.objects[0].velocity_mps = DVec3::new(0.0, 3.0, 0.0);
        s.add_object("p", "", Shape::Point { rcs_dbsm: 0.0 }, Pose::IDENTITY, DVec3::ZERO);
        let b = truth_boxes(&s, 2.0);
        let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(x, y)| (x - y).abs() < 1e-12);
        assert!(near(b[0].centre_m, [10.0, 1.0 + 6.0, 0.5]));
        assert!(near(b[0].size_m, [4.0, 2.0, 1.0]));
        assert!((b[0].yaw_rad - yaw).abs() < 1e-12);
        assert_eq!((b[1].size_m, b[1].centre_m), ([0.0; 3], [0.0; 3]));
    }
}
