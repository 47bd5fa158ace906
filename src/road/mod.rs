//! Builders of what stands on a road: reflectors with a known answer, rails, cars, manholes, whole
//! scenes. Everything is f64, metres, ISO 8855 axes; normals point outwards, or to the lit side of a
//! sheet. Materials come from the caller by name, so that a table or an override decides on them.

pub mod demo;
pub mod objects;
pub mod reflector;
pub mod shape;
pub mod terrain;
pub mod truth;
pub mod w3;

use crate::error::Result;
use crate::scene::Material;

pub use truth::{TruthBox, truth_boxes};

/// Finds a radar material by its name.
pub type MaterialLookup<'a> = &'a dyn Fn(&str) -> Result<Material>;
