//! The vehicles of road scenes, by kind.

use crate::error::Result;
use crate::frames::Pose;
use crate::road::MaterialLookup;
use crate::road::objects::{CarMaterials, passenger_car};
use crate::scene::Scene;
use crate::scene::motion::Joint;
use glam::{DQuat, DVec3};

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
/// accordingly.
pub fn driven(mut joints: Vec<Joint>, speed_mps: f64, clock_s: f64) -> Vec<Joint> {
    // A vehicle that was built at rest stands at its origin.
    joints.retain(|j| *j != Joint::Line(DVec3::ZERO) && *j != Joint::Fixed(DQuat::IDENTITY, DVec3::ZERO));
    for joint in &mut joints {
        if let Joint::Hinge { speed_mps: speed, clock_s: clock, .. } = joint {
            (*speed, *clock) = (speed_mps, clock_s);
        }
    }
    joints
}

/// The parts of a vehicle at rest, heading +x, the origin on the road below its middle; one object for each part.
///
/// Errors: a kind that is not in [`VEHICLES`], an unknown material.
pub fn vehicle(kind: &str, materials: MaterialLookup) -> Result<Scene> {
    if kind != VEHICLES[0] {
        let body = super::vehicle::vehicle(kind.parse()?, materials)?;
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
