//! From detected cells to points in SI units: range, range rate, angles, power, RCS, and the object
//! that each point came from.

pub mod accuracy;
pub mod ambiguity;
pub mod assignment;
pub mod cluster;
#[cfg(test)]
mod draws;
pub mod ego_motion;
pub mod files;
pub mod kalman;
pub mod label;
pub mod plot;
pub mod points;
pub mod slope_pairs;
pub mod track_table;
pub mod tracker;

pub use label::Labeller;
pub use points::{Detected, Point};
