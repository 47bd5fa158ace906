//! Electromagnetic formulas in f64: reflection at surfaces and layers, rough surfaces, mixtures and
//! coverings, spheres.

pub mod aperture;
pub mod clutter;
pub mod covering;
pub mod fresnel;
pub mod layers;
pub mod mie;
pub mod mixing;
pub mod roughness;
pub mod sphere_marking;
pub mod weather;
pub mod wedge;
