//! Synthesis and noise on the processor.

pub mod noise;
pub mod shaping;
pub mod synthesis;
