//! The engine where there is no GPU, and the truth that the shaders are tested against.

pub mod dsp;
