//! Files: NumPy arrays, CSV tables, cubes of samples from elsewhere (NumPy, HDF5, TI's recordings with their
//! configuration), runs in the formats of other tools, and results that appear under their name only when complete.

pub mod csv;
pub mod cube;
pub mod cube_layout;
#[cfg(feature = "hdf5")]
pub mod hdf5;
pub mod interop;
mod lock;
pub mod npy;
#[cfg(feature = "parquet")]
pub mod parquet_table;
pub mod rcs_csv;
pub mod stage;
pub mod ti_bin;
pub mod ti_cfg;
mod ti_commands;
