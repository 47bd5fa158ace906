//! Ground truth: the box around each object, and which whole it is a part of.

use crate::road::actors::{ActorBox, actor_boxes, mesh_bounds_m, part_name};
use crate::scene::{Object, Scene, Shape};
use glam::DVec3;

/// The smallest box along an object's own axes; of a whole that has parts, around all of them.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct TruthBox {
    /// Number of the object.
    pub id: u32,
    /// Name of the object.
    pub name: String,
    /// Class of the object.
    pub class: String,
    /// Number of the whole that the object is a part of; of a whole, its own number.
    pub parent_id: u32,
    /// What it is called as a part, `wheel` say ([`part_name`]); empty for a whole.
    pub part: String,
    /// Centre in the world, metres.
    pub centre_m: [f64; 3],
    /// Full lengths along the object's x, y, z, metres; zero for a point target and for a scattering table.
    pub size_m: [f64; 3],
    /// Rotation from the object's axes to the world, quaternion x, y, z, w.
    pub rotation_xyzw: [f64; 4],
    /// Heading of the object's x axis in the ground plane, radians, positive left.
    pub yaw_rad: f64,
    /// Velocity of the centre in the world, m/s.
    pub velocity_mps: [f64; 3],
    /// Angular velocity in the world, rad/s, right-handed about its direction.
    pub spin_rad_per_s: [f64; 3],
}

/// An object of the whole with number `parent_id`.
fn boxed(o: &Object, parent_id: u32, time_s: f64, [lower_m, upper_m]: [DVec3; 2]) -> TruthBox {
    let now = o.at(time_s);
    let pose = now.pose();
    let ahead = pose.direction(DVec3::X);
    let centre = pose.point(0.5 * (lower_m + upper_m));
    TruthBox {
        id: o.id,
        name: o.name.clone(),
        class: o.class.clone(),
        parent_id,
        part: if o.id == parent_id { String::new() } else { part_name(o).to_string() },
        centre_m: centre.to_array(),
        size_m: (upper_m - lower_m).to_array(),
        rotation_xyzw: now.rotation.to_array(),
        yaw_rad: ahead.y.atan2(ahead.x),
        velocity_mps: now.velocity_at(centre).to_array(),
        spin_rad_per_s: now.spin_rad_per_s.to_array(),
    }
}

/// One box per object of the scene at `time_s`, in the order of the objects. A whole (a car) has its first part's
/// number, and its box is around all of its parts; the other parts (wheels) have their own boxes and name it as their parent.
pub fn truth_boxes(scene: &Scene, time_s: f64) -> Vec<TruthBox> {
    let bounds = mesh_bounds_m(scene);
    let mut boxes: Vec<(usize, TruthBox)> = Vec::with_capacity(scene.objects.len());
    for (actor, whole) in actor_truth(scene, time_s) {
        let part = |i: usize| {
            let o = &scene.objects[i];
            let (lower_m, upper_m) = match o.shape {
                Shape::Mesh(m) => bounds[m],
                Shape::Point { .. } | Shape::Table(_) => (DVec3::ZERO, DVec3::ZERO),
            };
            (i, boxed(o, whole.id, time_s, [lower_m, upper_m]))
        };
        boxes.extend(actor.parts[1..].iter().map(|i| part(*i)));
        boxes.push((actor.parts[0], whole));
    }
    boxes.sort_by_key(|(i, _)| *i);
    boxes.into_iter().map(|(_, b)| b).collect()
}

/// The box around each actor at `time_s`, with the id, name, class, axes and motion of its first part; and what it
/// was made from.
pub fn actor_truth(scene: &Scene, time_s: f64) -> Vec<(ActorBox, TruthBox)> {
    let of = |b: ActorBox| {
        let first = &scene.objects[b.parts[0]];
        let truth = boxed(first, first.id, time_s, [b.lower_m, b.upper_m]);
        (b, truth)
    };
    actor_boxes(scene, time_s).into_iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::frames::Pose;
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
        // Neither has parts.
        assert!(b.iter().all(|b| b.parent_id == b.id && b.part.is_empty()));
    }

    #[test]
    fn parts_name_their_whole_and_it_reaches_around_them() {
        let mut s = Scene::default();
        let block = |x: f64, size: DVec3| cuboid(size, DVec3::new(x, 0.0, 0.0), 0);
        let pose = Pose::from_yaw_pitch_roll(DVec3::new(10.0, 0.0, 0.5), 0.3, 0.0, 0.0);
        let body = s.add_mesh("a/body", "car", block(0.0, DVec3::new(4.0, 2.0, 1.0)), pose);
        let pole = s.add_mesh("pole", "pole", block(0.0, DVec3::ONE), Pose::IDENTITY);
        let wheel = s.add_mesh("a/front wheel", "car.wheel", block(1.5, DVec3::new(0.6, 2.2, 0.6)), pose);
        let boxes = truth_boxes(&s, 0.0);
        let told: Vec<_> = boxes.iter().map(|b| (b.id, b.parent_id, b.part.as_str())).collect();
        assert_eq!(told, [(body, body, ""), (pole, pole, ""), (wheel, body, "wheel")]);
        let near = |b: &TruthBox, size: [f64; 3]| (0..3).all(|i| (b.size_m[i] - size[i]).abs() < 1e-9);
        assert!(near(&boxes[0], [4.0, 2.2, 1.0]) && near(&boxes[2], [0.6, 2.2, 0.6]), "{boxes:?}");
        assert_eq!(actor_truth(&s, 0.0)[0].1, boxes[0]);
    }
}
