//! Electromagnetic formulas in f64: reflection at surfaces and layers, rough surfaces, mixtures and
//! coverings, spheres.
//!
//! The time factor is e^{+jωt}, so that a medium with loss has ε = ε′ − jε″ with ε″ ≥ 0. Reflection coefficients are
//! (perpendicular, parallel) to the plane of incidence in the vectors of CONVENTIONS eq. 4, and surfaces are plane on
//! the scale of the wavelength.
//!
//! * [`fresnel`] (eq. 4, 24), [`layers`] (eq. 21–23): plane surfaces and stacks, in time proportional to the layers;
//! * [`roughness`] (eq. 27), [`clutter`] (eq. 145–147): what rough surfaces scatter;
//! * [`mixing`] (eq. 26), [`covering`]: water, gravel, leaves and paint on a surface;
//! * [`mie`] (eq. 25): spheres, ka + 8 ∛(ka) + 10 terms; [`weather`] (eq. 151–153): rain and fog;
//! * [`wedge`] (eq. 30–35), [`aperture`] (eq. 53): what edges and lit polygons radiate.

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
