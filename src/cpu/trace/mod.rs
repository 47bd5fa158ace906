//! Rays on the cpu engine.

pub mod closest;
