//! Files: NumPy arrays, CSV tables, and results that appear under their name only when complete.

pub mod csv;
pub mod npy;
pub mod rcs_csv;
pub mod stage;
