//! The vehicles of road scenes, by kind.

use crate::base::error::{BadInput, Result, nearest};
use crate::base::frames::Pose;
use crate::road::actors::base_class;
use crate::road::materials::MaterialLookup;
use crate::road::objects::{CarMaterials, passenger_car};
use crate::scene::motion::{Channel, Joint};
use crate::scene::toml_file::clip;
use crate::scene::turn::Turn;
use crate::scene::{Scene, Shape};
use glam::{DQuat, DVec3};
use std::sync::Arc;

/// Kinds of vehicle that [`vehicle`] builds.
pub const VEHICLES: [&str; 11] = [
    "passenger-car",
    "sedan",
    "hatchback",
    "suv",
    "van",
    "truck",
    "semi-trailer",
    "motorcycle",
    "cyclist",
    "pedestrian",
    "child",
];

/// The joints of a part of a vehicle that goes at `speed_mps`, its limbs' clock ahead by `clock_s`: wheels and limbs turn
/// accordingly. Where the speed changes, `way_m` is what it has gone over time, and wheels and limbs keep to it: limbs at the stride
/// of `speed_mps`, so that they stand still when their owner does.
pub fn driven(
    joints: Vec<Joint>,
    speed_mps: f64,
    way_m: &Option<Arc<Channel<f64>>>,
    clock_s: f64,
) -> Vec<Joint> {
    let mut out = Vec::with_capacity(joints.len());
    for joint in joints {
        match (joint, way_m) {
            // A vehicle that was built at rest stands at its origin.
            (Joint::Line(v), _) if v == DVec3::ZERO => {}
            (Joint::Fixed(q, p), _) if q == DQuat::IDENTITY && p == DVec3::ZERO => {}
            (Joint::Hinge { at_m, axis, turn: Turn::Roll { radius_m }, .. }, Some(way)) => {
                out.push(Joint::Roll { axis, radius_m, distance_m: way.clone() });
                out.push(Joint::Fixed(DQuat::IDENTITY, at_m));
            }
            (Joint::Hinge { at_m, axis, turn, .. }, _) => {
                out.push(Joint::Hinge { at_m, axis, turn, speed_mps, clock_s, way_m: way_m.clone() });
            }
            (other, _) => out.push(other),
        }
    }
    out
}

/// A complaint about a kind that is not in [`VEHICLES`].
pub(super) fn unknown(at: BadInput, kind: &str) -> BadInput {
    let b = BadInput { problem: "is not a kind of vehicle".into(), ..at }.allowed(VEHICLES.join(", "));
    match nearest(kind, VEHICLES) {
        Some(near) => b.remedy(format!("did you mean '{near}'?")),
        None => b.remedy("choose one of them"),
    }
}

/// A vehicle that the radar sees as a point in the middle of the box around it, while its body keeps its place in labels.
pub fn as_a_point(mut vehicle: Scene, rcs_dbsm: f64) -> Scene {
    vehicle.objects.iter_mut().for_each(|part| part.radar = false);
    let (from, to) = vehicle.bounds_m(0.0).unwrap_or_default();
    let class = vehicle.objects.first().map_or("vehicle", |body| base_class(&body.class));
    let (class, pose) = (format!("{class}.echo"), Pose::new(DQuat::IDENTITY, 0.5 * (from + to)));
    vehicle.add_object("echo", &class, Shape::Point { rcs_dbsm }, pose, DVec3::ZERO);
    vehicle
}

/// The parts of a vehicle at rest, heading +x, the origin on the road below its middle; one object for each part.
///
/// # Errors
/// Returns an error for a kind that is not in [`VEHICLES`], or for an unknown material.
pub fn vehicle(kind: &str, materials: MaterialLookup) -> Result<Scene> {
    if kind != VEHICLES[0] {
        let known = kind.parse().map_err(|_| unknown(BadInput::new("").value(clip(kind)), kind))?;
        let body = super::vehicle::vehicle(known, materials)?;
        let mut scene = Scene::default();
        body.add_to(&mut scene, "body", Pose::IDENTITY, 0.0, 0.0);
        return Ok(scene);
    }
    let mut scene = Scene::default();
    let mut index = |name: &str| materials(name).map(|m| scene.material_index(&m));
    let m = CarMaterials { body: index("steel")?, glass: index("glass")?, tyre: index("rubber")? };
    scene.add_mesh("car", "car", passenger_car(m), Pose::IDENTITY);
    Ok(scene)
}
