//! Rays and their fields in f64.

pub mod beams;
pub mod bend;
pub mod boundary;
pub mod chains;
pub mod closest;
pub mod contribute;
pub(crate) mod curved;
pub mod diffuse;
pub mod echoes;
mod ended;
pub mod field;
pub mod front;
pub(super) mod levels;
pub mod lines;
pub mod points;
pub mod rays;
pub mod refract;
pub mod regions;
pub mod scan;
pub mod shine;
mod specular;
pub(super) mod topology;
mod two_curved;
pub mod volume;
