//! Choice between engines.
