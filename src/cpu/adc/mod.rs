//! Synthesis and noise on the processor.

pub mod gridding;
pub mod noise;
pub mod synthesis;
