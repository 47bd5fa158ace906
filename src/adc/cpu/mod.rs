//! Synthesis, noise, front end and other radars on the processor.

pub mod convert;
pub mod front_end;
pub mod grid_fft;
pub mod grid_lines;
pub mod grid_spread;
pub mod gridding;
pub mod interference;
pub mod noise;
mod precision;
pub mod shaping;
pub mod synthesis;
