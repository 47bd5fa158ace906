//! Synthesis and noise on the processor.

pub mod noise;
pub mod synthesis;
