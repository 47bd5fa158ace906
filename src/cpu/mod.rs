//! The engine where there is no GPU, and the truth that the shaders are tested against. Mirrors
//! `shaders/` stem for stem.

pub mod adc;
pub mod simd;
