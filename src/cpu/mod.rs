//! The engine without a GPU, in f64 (cubes and maps also in f32), and the truth that the shaders are
//! tested against. Mirrors `shaders/` stem for stem.

pub mod adc;
pub mod dsp;
pub mod rcs;
pub mod simd;
pub mod trace;
