//! Builders of what stands on a road: reflectors with a known answer, rails, cars, manholes, whole
//! scenes. Everything is f64, metres, ISO 8855 axes; normals point outwards, or to the lit side of a
//! sheet. Materials come from the caller by name, so that a table or an override decides on them.

pub mod axis;
pub mod build;
pub mod demo;
pub mod glb;
pub mod labels;
pub mod layout;
pub mod objects;
pub mod opendrive;
pub mod plan;
pub mod profile;
pub mod reflector;
mod scene_read;
#[cfg(test)]
mod scene_tests;
pub mod scene_toml;
pub mod shape;
pub mod target;
pub mod terrain;
pub mod traffic;
pub mod truth;
pub mod vehicle;
pub mod w3;

use crate::error::Result;
use crate::scene::scenario::{self, Builtin};
use crate::scene::{Material, Scene, material};
use glam::DVec3;

pub use truth::{TruthBox, truth_boxes};

/// Finds a radar material by its name.
pub type MaterialLookup<'a> = &'a dyn Fn(&str) -> Result<Material>;

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

    fn reflector(&self, spec: &str) -> Result<Scene> {
        reflector::Reflector::parse(spec)?.to_scene(&material::parse_spec)
    }
}

/// A lane line of a built-in road.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct LaneLine {
    pub name: String,
    /// Along the line in the world, metres.
    pub points_m: Vec<[f64; 3]>,
}

/// The lane lines that a built-in scene is known to have.
pub fn lane_lines(builtin: Builtin) -> Vec<LaneLine> {
    match builtin {
        Builtin::MarkedRoad => ["left", "middle", "right"]
            .iter()
            .zip(demo::LANE_LINES_Y_M)
            .map(|(name, y)| LaneLine {
                name: name.to_string(),
                points_m: [0.0, demo::ROAD_LENGTH_M].map(|x| DVec3::new(x, y, 0.0).to_array()).to_vec(),
            })
            .collect(),
        Builtin::Empty | Builtin::W3 | Builtin::W3Moving => Vec::new(),
    }
}
