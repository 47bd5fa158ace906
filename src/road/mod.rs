//! Builders of what stands on a road: reflectors with a known answer, rails, cars, manholes, whole
//! scenes. Everything is f64, metres, ISO 8855 axes; normals point outwards, or to the lit side of a
//! sheet. Materials come from the caller by name, so that a table or an override decides on them.

pub mod actors;
pub mod axis;
pub mod build;
pub mod demo;
pub mod drive;
pub mod free_space;
pub mod glb;
pub mod labels;
pub mod layout;
pub mod mask;
pub mod materials;
pub mod near;
pub mod objects;
pub mod opendrive;
pub mod opendrive_elements;
#[cfg(test)]
mod opendrive_tests;
mod place;
pub mod plan;
pub mod profile;
pub mod reflector;
mod scene_tables;
pub mod scene_toml;
pub mod shape;
pub mod site;
pub mod target;
pub mod terrain;
#[cfg(test)]
mod tests;
pub mod traffic;
pub mod truth;
pub mod vehicle;
pub mod w3;
pub mod w8;

use crate::base::error::Result;
use crate::scene::motion::{Channel, Joint};
use crate::scene::scenario::{self, Builtin};
use crate::scene::{Scene, material};
use labels::RoadTruth;
use plan::ScenePlan;
use std::path::Path;
use std::sync::Arc;

pub use materials::MaterialLookup;
pub use truth::{TruthBox, actor_truth, truth_boxes};

/// The built-in scenes and the reflector library, with the materials of the table, for scenario files.
pub struct Library;

impl scenario::Builder for Library {
    fn builtin(&self, name: Builtin) -> Result<Scene> {
        match name {
            Builtin::Empty => Ok(Scene::default()),
            Builtin::MarkedRoad => demo::marked_road(&material::by_name),
            Builtin::W3 => w3::w3(false, &material::by_name),
            Builtin::W3Moving => w3::w3(true, &material::by_name),
        }
    }

    fn road(&self, path: &Path, duration_s: f64) -> Result<Scene> {
        let plan = ScenePlan { duration_s, ..scene_toml::load(path)? };
        Ok(build::build(&plan)?.0)
    }

    fn reflector(&self, spec: &str) -> Result<Scene> {
        reflector::Reflector::parse(spec)?.to_scene(&material::parse_spec)
    }

    fn vehicle(&self, kind: &str) -> Result<Scene> {
        traffic::vehicle(kind, &material::parse_spec)
    }

    fn driven(&self, joints: Vec<Joint>, speed_mps: f64, way_m: Option<Arc<Channel<f64>>>) -> Vec<Joint> {
        traffic::driven(joints, speed_mps, &way_m, 0.0)
    }
}

/// The labels of a built-in scene, where it has any.
pub fn builtin_truth(builtin: Builtin, scene: &Scene) -> Option<RoadTruth> {
    match builtin {
        Builtin::MarkedRoad => Some(demo::truth(scene)),
        Builtin::Empty | Builtin::W3 | Builtin::W3Moving => None,
    }
}
