//! The vehicles of road scenes, by kind.

use crate::error::Result;
use crate::frames::Pose;
use crate::road::MaterialLookup;
use crate::road::objects::{CarMaterials, passenger_car};
use crate::scene::Scene;

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

/// The parts of a vehicle, heading +x, the origin on the road below its middle; one object for each part.
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
