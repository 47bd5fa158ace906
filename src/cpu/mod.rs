//! The engine without a GPU, in f64, and the truth that the shaders are tested against. Mirrors
//! `shaders/` stem for stem.

pub mod rcs;
pub mod trace;
