//! Files: NumPy arrays, CSV tables, and results that appear under their name only when complete.

pub mod csv;
pub mod npy;
#[cfg(feature = "parquet")]
pub mod parquet_table;
pub mod rcs_csv;
pub mod stage;
