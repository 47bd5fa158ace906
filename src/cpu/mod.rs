//! Room: cpu.
