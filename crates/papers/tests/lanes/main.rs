//! The lane methods on points and drives.

mod camera_fusion;
mod hd_map;
mod markers;
mod range_doppler;
mod road_shape;
#[cfg(feature = "learn")]
mod segmentation;
mod signature;
mod uwb;
