//! Room: em.
