//! Rays and their fields in f64.

pub mod closest;
pub mod contribute;
pub mod rays;
pub mod scan;
