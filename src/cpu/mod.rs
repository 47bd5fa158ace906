//! Room: cpu.

pub mod trace;
