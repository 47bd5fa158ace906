//! Room: em.

pub mod mie;
