//! Electromagnetic formulas in f64: reflection, and later layers, roughness, wedges, spheres.

pub mod fresnel;
pub mod mie;
pub mod wedge;
