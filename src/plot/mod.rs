//! Room: plot.
