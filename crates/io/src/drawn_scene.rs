//! A drawn scene that is ready to be simulated: its objects, the truth of its roads, and its traffic.

use super::recipe::Drawn;
use catseye::base::error::Result;
use catseye::road::labels::RoadTruth;
use catseye::road::site;
use catseye::scene::Scene;
use catseye::scene::scenario::SitedScenario;
use std::sync::Arc;

/// Scene and scenario together.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawnScene {
    /// Number of the scene in its dataset.
    pub number: u32,
    /// The scenario.
    pub scenario: Arc<SitedScenario>,
    /// The scene with its objects.
    pub scene: Arc<Scene>,
    /// Truth of the road; None for a scene without a road.
    pub road: Option<RoadTruth>,
    /// Number of draws that were repeated because vehicles overlapped.
    pub redrawn: u32,
    /// Number of objects that were left out because others stand in their place.
    pub dropped: u32,
}

impl DrawnScene {
    /// Builds the scene: the only place where a drawn road and a drawn scenario come together.
    ///
    /// # Errors
    /// Returns the errors of the builders.
    pub fn new(drawn: Drawn) -> Result<DrawnScene> {
        let made = match drawn.plan {
            Some(plan) => site::Site::on(&drawn.parsed, plan)?,
            None => site::Site::new(&drawn.parsed)?,
        };
        let site::Site { scenario, scene, road } = made;
        let (redrawn, dropped) = (drawn.redrawn, drawn.dropped);
        let (scenario, scene) = (Arc::new(scenario), Arc::new(scene));
        Ok(DrawnScene { number: drawn.scene, scenario, scene, road, redrawn, dropped })
    }
}
