//! Which objects are the parts of one thing (a car's body and its wheels), and the box around all of it.

use crate::base::frames::{Pose, Target, World};
use crate::scene::{Object, Scene, Shape};
use glam::DVec3;
use std::collections::HashMap;

/// Classes of the ground and of what is painted on it.
pub const GROUND: [&str; 5] = ["road", "verge", "ground", "terrain", "lane_line"];

/// Classes of what moves on the road.
pub const VEHICLES: [&str; 8] = ["car", "van", "truck", "bus", "motorcycle", "cyclist", "bicycle", "vehicle"];

/// A class without the suffix of a part: `car` of `car.wheel`.
pub fn base_class(class: &str) -> &str {
    class.split_once('.').map_or(class, |(base, _)| base)
}

/// What an object is called as a part of a whole: `wheel` where its class is `car.wheel`, else what stands behind the last
/// `/` of its name; never empty.
pub fn part_name(object: &Object) -> &str {
    let suffix = object.class.split_once('.').map(|(_, part)| part);
    let name = object.name.rsplit('/').next();
    suffix.into_iter().chain(name).find(|n| !n.is_empty()).unwrap_or("part")
}

/// Whether a class is that of the ground or of paint on it.
pub fn is_ground(class: &str) -> bool {
    GROUND.contains(&class)
}

/// Whether objects of this class are vehicles.
pub fn is_vehicle(class: &str) -> bool {
    VEHICLES.contains(&base_class(class))
}

/// The parts of each actor as indices into `objects`, the first part first; actors in the order of their first
/// parts. An object that is a part of nothing else is an actor of its own.
///
/// Parts of one actor are either all objects named `NAME/…` with one name before the last `/`, when their classes
/// are the same but for a suffix (`car`, `car.wheel`); or an object named `NAME PART` with such a suffix, which
/// belongs to the object `NAME` of the class without it that last stood before it. So the builders of
/// `road::vehicle` and scenario files name them.
pub fn actors(objects: &[Object]) -> Vec<Vec<usize>> {
    let folder = |o: &'_ Object| o.name.rfind('/').map(|end| o.name[..end].to_string());
    let mut folders: HashMap<String, Vec<usize>> = HashMap::new();
    for (i, o) in objects.iter().enumerate() {
        if let Some(f) = folder(o) {
            folders.entry(f).or_default().push(i);
        }
    }
    let whole = |parts: &[usize]| {
        let class = base_class(&objects[parts[0]].class);
        parts.len() > 1 && !is_ground(class) && parts.iter().all(|i| base_class(&objects[*i].class) == class)
    };
    let mut head: Vec<usize> = (0..objects.len()).collect();
    for parts in folders.values().filter(|parts| whole(parts)) {
        parts.iter().for_each(|i| head[*i] = parts[0]);
    }
    let mut body: Option<usize> = None;
    for (i, o) in objects.iter().enumerate() {
        if base_class(&o.class) == o.class {
            body = Some(i);
        } else if let Some(b) = body.filter(|_| head[i] == i) {
            let named = o.name.strip_prefix(&objects[b].name).is_some_and(|rest| rest.starts_with(' '));
            if named && objects[b].class == base_class(&o.class) {
                head[i] = head[b];
            }
        }
    }
    let mut place: Vec<Option<usize>> = vec![None; objects.len()];
    let mut out: Vec<Vec<usize>> = Vec::new();
    for (i, h) in head.iter().enumerate() {
        match place[*h] {
            Some(k) => out[k].push(i),
            None => {
                place[*h] = Some(out.len());
                out.push(vec![i]);
            }
        }
    }
    out
}

/// A box along the axes of an actor's first part.
#[derive(Debug, Clone, PartialEq)]
pub struct ActorBox {
    /// Indices into the scene's objects.
    pub parts: Vec<usize>,
    /// Pose of the first part.
    pub pose: Pose<Target, World>,
    /// Corners in the first part's frame; equal for point targets and scattering tables.
    pub lower_m: DVec3,
    /// Largest corner in the part's axes, m.
    pub upper_m: DVec3,
}

impl ActorBox {
    /// Middle, in the world.
    pub fn centre_m(&self) -> DVec3 {
        self.pose.point(0.5 * (self.lower_m + self.upper_m))
    }
    /// Lengths of its edges, m.
    pub fn size_m(&self) -> DVec3 {
        self.upper_m - self.lower_m
    }
    /// The four corners of its floor seen from above, in the world, counter-clockwise for an upright box.
    pub fn outline_m(&self) -> [[f64; 2]; 4] {
        let (a, b) = (self.lower_m, self.upper_m);
        [(a.x, a.y), (b.x, a.y), (b.x, b.y), (a.x, b.y)].map(|(x, y)| {
            let p = self.pose.point(DVec3::new(x, y, 0.5 * (a.z + b.z)));
            [p.x, p.y]
        })
    }
}

/// Corners of the smallest box along a mesh's axes, for each mesh of the scene; zero for an empty one.
pub fn mesh_bounds_m(scene: &Scene) -> Vec<(DVec3, DVec3)> {
    let bounds = |points: &[DVec3]| {
        let first = points.first().copied().unwrap_or(DVec3::ZERO);
        points.iter().fold((first, first), |(lo, hi), p| (lo.min(*p), hi.max(*p)))
    };
    scene.meshes.iter().map(|m| bounds(&m.positions_m)).collect()
}

/// The box around every actor at `time_s`, from the vertices of all its parts.
pub fn actor_boxes(scene: &Scene, time_s: f64) -> Vec<ActorBox> {
    let bounds = mesh_bounds_m(scene);
    let actors = actors(&scene.objects);
    let boxed = |parts: Vec<usize>| {
        let first = &scene.objects[parts[0]];
        let pose = first.at(time_s).pose();
        let own = |shape| match shape {
            Shape::Mesh(m) => bounds[m],
            Shape::Point { .. } | Shape::Table(_) => (DVec3::ZERO, DVec3::ZERO),
        };
        let (mut lower_m, mut upper_m) = own(first.shape);
        for part in parts[1..].iter().map(|i| &scene.objects[*i]) {
            let to = part.at(time_s).pose().then(&pose.inverse());
            let mut grow = |p: DVec3| {
                let p = to.point(p);
                (lower_m, upper_m) = (lower_m.min(p), upper_m.max(p));
            };
            match part.shape {
                Shape::Mesh(m) => scene.meshes[m].positions_m.iter().for_each(|p| grow(*p)),
                Shape::Point { .. } | Shape::Table(_) => grow(DVec3::ZERO),
            }
        }
        ActorBox { parts, pose, lower_m, upper_m }
    };
    actors.into_iter().map(boxed).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::road::shape::cuboid;
    use crate::road::vehicle::{Kind, vehicle};
    use crate::scene::material;

    fn named(list: &[(&str, &str)]) -> Vec<Object> {
        let mut s = Scene::default();
        for (name, class) in list {
            s.add_object(name, class, Shape::Point { rcs_dbsm: 0.0 }, Pose::IDENTITY, DVec3::ZERO);
        }
        s.objects
    }

    #[test]
    fn parts_are_found_by_name_and_class() {
        let objects = named(&[
            ("main/surface 1", "road"),
            ("main/rail 1", "guard_rail"),
            ("main/car 1/body", "car"),
            ("main/car 1/body front left wheel", "car.wheel"),
            ("main/car 2/body", "car"),
            ("main/car 2/body front left wheel", "car.wheel"),
            ("walker", "pedestrian"),
            ("walker left arm", "pedestrian.limb"),
            ("walker 2", "pedestrian"),
            ("walker 2 left arm", "pedestrian.limb"),
            ("walkers dog", "pedestrian.limb"),
            ("main/pole 1", "pole"),
        ]);
        let want: [&[usize]; 8] = [&[0], &[1], &[2, 3], &[4, 5], &[6, 7], &[8, 9], &[10], &[11]];
        assert_eq!(actors(&objects), want);
        assert_eq!([3, 7].map(|i| part_name(&objects[i])), ["wheel", "limb"]);
        // A class given to all parts, as scenarios do, and surfaces of one road.
        let objects = named(&[
            ("t/cab", "truck"),
            ("t/box", "truck"),
            ("r/surface 1", "road"),
            ("r/surface 2", "road"),
        ]);
        assert_eq!(actors(&objects), [vec![0, 1], vec![2], vec![3]]);
        assert_eq!(part_name(&objects[1]), "box");
        assert_eq!(part_name(&named(&[("t/", "truck")])[0]), "part");
    }

    #[test]
    fn a_car_of_parts_has_the_box_of_its_body() {
        let body = vehicle(Kind::Sedan, &material::by_name).unwrap();
        let mut s = Scene::default();
        s.add_mesh("plate", "sign", cuboid(DVec3::ONE, DVec3::ZERO, 0), Pose::IDENTITY);
        let pose = Pose::from_yaw_pitch_roll(DVec3::new(20.0, 5.0, 0.0), 0.7, 0.0, 0.0);
        let ids = body.add_to(&mut s, "car", pose, 10.0, 0.0);
        for t in [0.0, 0.3] {
            let boxes = actor_boxes(&s, t);
            assert_eq!((boxes.len(), boxes[1].parts.len()), (2, ids.len()));
            let (lo, hi) = body.bounds_m(10.0, t);
            let b = &boxes[1];
            assert!((b.lower_m - lo).length() < 1e-9 && (b.upper_m - hi).length() < 1e-9, "{b:?}");
            let ahead = pose.direction(DVec3::X) * 10.0 * t;
            assert!((b.pose.translation_m - pose.translation_m - ahead).length() < 1e-9);
        }
    }
}
