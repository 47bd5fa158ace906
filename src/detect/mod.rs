//! From detected cells to points in SI units: range, range rate, angles, power, RCS, and the object
//! that each point came from.

pub mod assignment;
pub mod cluster;
pub mod files;
pub mod label;
pub mod points;

pub use label::Labeller;
pub use points::{Detected, Point};
