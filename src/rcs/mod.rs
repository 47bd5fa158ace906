//! Room: rcs.
