//! The vehicles of road scenes, by kind.

use crate::error::{BadInput, Result, nearest};
use crate::frames::Pose;
use crate::road::MaterialLookup;
use crate::road::objects::{CarMaterials, passenger_car};
use crate::scene::Scene;

/// Kinds of vehicle that [`vehicle`] builds.
pub const VEHICLES: [&str; 1] = ["passenger-car"];

/// The parts of a vehicle, heading +x, the origin on the road below its middle; one object for each part.
///
/// Errors: a kind that is not in [`VEHICLES`], an unknown material.
pub fn vehicle(kind: &str, materials: MaterialLookup) -> Result<Scene> {
    if kind != VEHICLES[0] {
        let e = BadInput::new("is not a kind of vehicle").value(kind).allowed(VEHICLES.join(", "));
        return Err(match nearest(kind, VEHICLES) {
            Some(n) => e.remedy(format!("did you mean '{n}'?")),
            None => e,
        }
        .into());
    }
    let mut scene = Scene::default();
    let mut index = |name: &str| materials(name).map(|m| scene.material_index(&m));
    let m = CarMaterials { body: index("steel")?, glass: index("glass")?, tyre: index("rubber")? };
    scene.add_mesh("car", "car", passenger_car(m), Pose::IDENTITY);
    Ok(scene)
}
