//! Frames as files: cubes of samples from elsewhere (NumPy, HDF5, TI's recordings with their configuration), the files of a frame,
//! runs of many frames that can be interrupted and resumed, and datasets of drawn scenes in shards.
#![deny(unsafe_code)]

mod board;
pub mod cards;
pub mod cube;
pub mod cube_layout;
pub mod dataset;
pub mod datasheet;
pub mod diff;
pub mod draw;
pub mod drawn_scene;
pub mod echo_file;
pub mod estimate;
pub mod files;
pub mod follow;
#[cfg(feature = "hdf5")]
pub mod hdf5;
mod hold;
pub mod kept_dataset;
pub mod kept_radar;
pub mod kept_run;
pub mod manifest;
pub mod produce;
pub mod recipe;
pub mod recording;
pub mod rows;
pub mod run;
pub mod sensor_fit;
mod source;
pub mod store;
pub mod tally;
pub mod ti_bin;
pub mod ti_cfg;
mod ti_commands;
mod ti_studio;
pub mod traffic;
pub mod turntable;
pub mod usage;
pub mod verify;
