//! Electromagnetic formulas in f64: reflection at surfaces and layers, spheres.

pub mod fresnel;
pub mod layers;
pub mod mie;
