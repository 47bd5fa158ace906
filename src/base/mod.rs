//! What all rooms share: units, frames of coordinates, errors, the 2 × 2 complex matrix, which bounces radiate, watching and stopping
//! long work, random numbers, and what this machine has.

pub mod control;
pub mod convention;
pub mod error;
pub mod frames;
pub mod held;
pub mod machine;
pub mod matrix;
pub mod memo;
pub mod rng;
pub mod simd;
pub mod tasks;
pub mod units;
