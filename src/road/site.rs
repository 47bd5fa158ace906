//! A scenario on its road: the scene, what is known of the road, and the ego vehicle's motion along it.

use super::labels::RoadTruth;
use super::layout::{Base, Driven, InLane, Lateral, Road};
use super::plan::ScenePlan;
use super::profile::Profile;
use super::{Library, build, builtin_truth, drive, glb, place, scene_toml};
use crate::base::error::{BadInput, Error, Result};
use crate::scene::scenario::{Ego, EgoPlan, OnRoad, Scenario, SceneSource, SitedScenario};
use crate::scene::{Scene, gltf};
use std::path::Path;
use std::sync::Arc;

/// A scenario with its scene and its roads, from which frames are made.
#[derive(Debug, Clone, PartialEq)]
pub struct Site {
    /// The scenario, with the ego vehicle's motion.
    pub scenario: SitedScenario,
    /// What stands there.
    pub scene: Scene,
    /// Lanes, lines, free space and markers, where they are known.
    pub road: Option<RoadTruth>,
}

impl Site {
    /// Builds the scene that a scenario names.
    ///
    /// # Errors
    /// Returns an error if a file of the scene cannot be read, a road or lane is not there, or a radar is under the
    /// road or inside a body.
    pub fn new(scenario: &Scenario) -> Result<Site> {
        match &scenario.scene {
            SceneSource::Road { path } => Site::on(scenario, scene_toml::load(path)?),
            source => {
                let scene = scenario.build(&Library)?;
                let road = match source {
                    SceneSource::Builtin(b) => builtin_truth(*b, &scene),
                    // What `catseye scene` left in a binary glTF file.
                    SceneSource::File { path, .. } if is_glb(path) => {
                        glb::truth_of(&gltf::read_bytes(path)?)?
                    }
                    _ => None,
                };
                let scenario = scenario.clone().without_roads()?;
                place::check(&scenario, &scene)?;
                Ok(Site { scenario, scene, road })
            }
        }
    }

    /// The scenario on these roads, whatever scene it names.
    ///
    /// # Errors
    /// Returns an error for vehicles or an ego place that the roads do not have.
    pub fn on(scenario: &Scenario, plan: ScenePlan) -> Result<Site> {
        let plan = ScenePlan { duration_s: scenario.duration_s(), ..plan };
        let (scene, truth) = build::build(&plan)?;
        let scene = scenario.furnish(scene, &Library)?;
        let scenario = scenario.clone().with_ego(ego_on(scenario, &plan)?);
        place::check(&scenario, &scene)?;
        Ok(Site { scenario, scene, road: Some(truth) })
    }
}

/// The ego vehicle with its motion along these roads.
///
/// # Errors
/// Returns an error if the road or lane is not there.
pub fn ego_on(scenario: &Scenario, plan: &ScenePlan) -> Result<Ego> {
    match &scenario.ego {
        EgoPlan::Free(ego) => Ok(ego.clone()),
        EgoPlan::OnRoad(on) => {
            let motion = follower(on, plan)?.motion(-1.0..scenario.duration_s())?;
            let start = motion.at(0.0);
            let ahead = start.rotation * glam::DVec3::X;
            Ok(Ego {
                position_m: start.translation_m,
                yaw_rad: ahead.y.atan2(ahead.x),
                speed_mps: start.velocity_mps.dot(ahead),
                motion: Some(Arc::new(motion)),
            })
        }
    }
}

fn is_glb(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("glb"))
}

/// A place and a way on a road, with the names found.
struct Follower<'a> {
    road: &'a Road,
    lateral: Lateral,
    against: bool,
    on: &'a OnRoad,
}

impl Follower<'_> {
    fn motion(&self, window_s: std::ops::Range<f64>) -> Result<crate::scene::motion::Motion> {
        drive::OnRoad {
            road: self.road,
            s_m: self.on.s_m,
            lateral: &self.lateral,
            against: self.against,
            drive: &self.on.drive,
        }
        .motion(window_s)
    }
}

fn follower<'a>(on: &'a OnRoad, plan: &'a ScenePlan) -> Result<Follower<'a>> {
    let bad = |key: &str, value: String, problem: &str, allowed: String| -> Error {
        let mut b = BadInput::new(problem).key(key).value(value).allowed(allowed);
        (b.file, b.line) = (on.at.file.clone(), on.at.line);
        b.into()
    };
    let names = || plan.roads.iter().map(|r| r.road.name.as_str()).collect::<Vec<_>>().join(", ");
    let road = match &on.road {
        None => plan.roads.first(),
        Some(name) => plan.roads.iter().find(|r| r.road.name == *name),
    };
    let Some(road) = road.map(|r| &r.road) else {
        let name = on.road.clone().unwrap_or_default();
        return Err(bad("ego.on_road.road", name, "is not a road of the scene", names()));
    };
    if !(0.0..=road.axis.length_m()).contains(&on.s_m) {
        let allowed = format!("0..={} m", road.axis.length_m());
        return Err(bad("ego.on_road.s_m", on.s_m.to_string(), "is not on the road", allowed));
    }
    let (base, driven) = match on.lane {
        None => (Base::Axis, Driven::Both),
        Some(number) => {
            let Some((side, i, lane)) = road.lanes().find(|(_, _, l)| l.number == number) else {
                let all = road.lanes().map(|(_, _, l)| l.number.to_string()).collect::<Vec<_>>().join(", ");
                return Err(bad("ego.on_road.lane", number.to_string(), "is not a lane of the road", all));
            };
            (Base::Lane(side, i, InLane::Centre), lane.driven)
        }
    };
    let against = on.against.unwrap_or(driven == Driven::Backward);
    let offset = if against { -on.offset_m } else { on.offset_m };
    Ok(Follower { road, lateral: Lateral { base, offset: Profile::constant(offset) }, against, on })
}
