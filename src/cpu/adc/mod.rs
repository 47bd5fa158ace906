//! Synthesis and noise on the processor.

pub mod grid_fft;
pub mod grid_lines;
pub mod grid_spread;
pub mod gridding;
pub mod noise;
pub mod synthesis;
