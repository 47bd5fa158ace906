//! Ground truth: the box around each object.

use crate::road::actors::{ActorBox, actor_boxes, mesh_bounds_m};
use crate::scene::{Object, Scene, Shape};
use glam::DVec3;

/// The smallest box along an object's own axes.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct TruthBox {
    /// Number of the object.
    pub id: u32,
    /// Name of the object.
    pub name: String,
    /// Class of the object.
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

fn boxed(o: &Object, time_s: f64, lower_m: DVec3, upper_m: DVec3) -> TruthBox {
    let now = o.at(time_s);
    let pose = now.pose();
    let ahead = pose.direction(DVec3::X);
    let centre = pose.point(0.5 * (lower_m + upper_m));
    TruthBox {
        id: o.id,
        name: o.name.clone(),
        class: o.class.clone(),
        centre_m: centre.to_array(),
        size_m: (upper_m - lower_m).to_array(),
        rotation_xyzw: now.rotation.to_array(),
        yaw_rad: ahead.y.atan2(ahead.x),
        velocity_mps: now.velocity_at(centre).to_array(),
        spin_rad_per_s: now.spin_rad_per_s.to_array(),
    }
}

/// One box per object of the scene at `time_s`, in the order of the objects.
pub fn truth_boxes(scene: &Scene, time_s: f64) -> Vec<TruthBox> {
    let bounds = mesh_bounds_m(scene);
    let of = |o: &Object| {
        let (lo, hi) = match o.shape {
            Shape::Mesh(m) => bounds[m],
            Shape::Point { .. } | Shape::Table(_) => (DVec3::ZERO, DVec3::ZERO),
        };
        boxed(o, time_s, lo, hi)
    };
    scene.objects.iter().map(of).collect()
}

/// The box around each actor at `time_s`, with the id, name, class, axes and motion of its first part; and what it
/// was made from.
pub fn actor_truth(scene: &Scene, time_s: f64) -> Vec<(ActorBox, TruthBox)> {
    let of = |b: ActorBox| {
        let truth = boxed(&scene.objects[b.parts[0]], time_s, b.lower_m, b.upper_m);
        (b, truth)
    };
    actor_boxes(scene, time_s).into_iter().map(of).collect()
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
