//! Room: road.
