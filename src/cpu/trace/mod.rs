//! Rays and their fields in f64.

pub mod beams;
pub mod closest;
pub mod contribute;
pub mod field;
pub mod rays;
pub mod refract;
pub mod scan;
