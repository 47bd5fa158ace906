//! A drawn scene made ready: what stands there, what is known of its roads, who drives.

use super::recipe::Drawn;
use catseye::base::error::Result;
use catseye::road::labels::RoadTruth;
use catseye::road::site;
use catseye::scene::Scene;
use catseye::scene::scenario::SitedScenario;

/// Scene and scenario together.
#[derive(Debug, Clone, PartialEq)]
pub struct Site {
    /// Number of the scene in its dataset.
    pub number: u32,
    /// The scenario.
    pub scenario: SitedScenario,
    /// The scene with its objects.
    pub scene: Scene,
    /// Truth of the road; None for a scene without a road.
    pub road: Option<RoadTruth>,
    /// Draws that were repeated because vehicles stood in one another, and vehicles that were left out.
    pub redrawn: u32,
    /// Objects that were left out because others stand in their place.
    pub dropped: u32,
}

impl Site {
    /// The only place where a drawn road and a drawn scenario come together.
    ///
    /// # Errors
    /// Returns the errors of the builders.
    pub fn new(drawn: Drawn) -> Result<Site> {
        let made = match drawn.plan {
            Some(plan) => site::Site::on(&drawn.parsed, plan)?,
            None => site::Site::new(&drawn.parsed)?,
        };
        let site::Site { scenario, scene, road } = made;
        let (redrawn, dropped) = (drawn.redrawn, drawn.dropped);
        Ok(Site { number: drawn.scene, scenario, scene, road, redrawn, dropped })
    }
}
