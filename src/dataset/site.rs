//! A drawn scene made ready: what stands there, what is known of its roads, who drives.

use super::recipe::Drawn;
use crate::error::Result;
use crate::road::labels::RoadTruth;
use crate::road::{Library, build};
use crate::scene::scenario::{Builder, Builtin, Scenario, SceneSource};
use crate::scene::{Scene, material};

/// Scene and scenario together.
#[derive(Debug, Clone, PartialEq)]
pub struct Site {
    /// Number of the scene in its dataset.
    pub number: u32,
    pub scenario: Scenario,
    pub scene: Scene,
    /// Of a road scene.
    pub road: Option<RoadTruth>,
    /// Draws that were repeated because vehicles stood in one another, and vehicles that were left out.
    pub redrawn: u32,
    pub dropped: u32,
}

/// A road that is built already, for a scenario that adds its points and objects.
struct OnRoad<'a>(&'a Scene);

impl Builder for OnRoad<'_> {
    fn builtin(&self, _: Builtin) -> Result<Scene> {
        Ok(self.0.clone())
    }
    fn reflector(&self, spec: &str) -> Result<Scene> {
        Library.reflector(spec)
    }
}

impl Site {
    /// The only place where a drawn road and a drawn scenario come together.
    ///
    /// Errors: those of the builders.
    pub fn new(drawn: Drawn) -> Result<Site> {
        let mut scenario = drawn.parsed;
        let (scene, road) = match &drawn.plan {
            Some(plan) => {
                let (scene, truth) = build::build(plan, &material::parse_spec)?;
                // Any built-in scene but the empty one is asked of the builder.
                scenario.scene = SceneSource::Builtin(Builtin::MarkedRoad);
                (scenario.build(&OnRoad(&scene))?, Some(truth))
            }
            None => (scenario.build(&Library)?, None),
        };
        let (redrawn, dropped) = (drawn.redrawn, drawn.dropped);
        Ok(Site { number: drawn.scene, scenario, scene, road, redrawn, dropped })
    }
}
