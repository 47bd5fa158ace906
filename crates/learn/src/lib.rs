//! Networks that learn from what catseye simulates: each cell of a grid before the radar, or each point, gets a class
//! (lane, vehicle, guard rail, marker), learned from runs with `[output] masks = true` and datasets with
//! `[keep] masks = true`.
//!
//! Grids are learned by [`segnet`], and contours of objects in them by [`detector`]; [`pointnet`] learns the points themselves, each of
//! which gets a class.
//!
//! Types keep what a radar measures apart from what only a simulation knows: [`data::Features`] and [`cloud::PointFeatures`] are all
//! that networks see, [`data::Labels`] and [`objects::Objects`] are what they are judged by, and no function makes the first from the
//! second.

#![forbid(unsafe_code)]

pub mod augment;
mod card;
pub mod class_aim;
pub mod classes;
pub mod cloud;
pub mod config;
pub mod curve;
pub mod data;
pub mod detect_task;
pub mod detection;
pub mod detector;
pub mod frame_points;
pub mod grid_task;
pub mod groups;
pub mod joint;
pub mod lane;
mod layers;
pub mod model;
pub mod network;
pub mod objects;
pub mod picture;
pub mod point_task;
pub mod pointnet;
pub mod quad;
pub mod robustness;
pub mod scan;
pub mod score;
pub mod segnet;
pub mod shipped;
pub mod source;
pub mod standing;
pub mod study;
pub mod task;
pub mod train;

pub use burn::tensor::Device;

use catseye::base::error::Result;

/// The processor on which networks are trained and used: the CPU, or with `gpu` the default adapter of the cargo feature `wgpu`.
///
/// # Errors
/// Returns `BadInput` if a GPU is asked for and the feature `wgpu` was not built.
pub fn device(gpu: bool) -> Result<Device> {
    match gpu {
        false => Ok(Device::flex()),
        #[cfg(feature = "wgpu")]
        true => Ok(Device::wgpu(burn::tensor::DeviceKind::DefaultDevice)),
        #[cfg(not(feature = "wgpu"))]
        true => Err(catseye::base::error::BadInput::new("this build cannot run networks on a GPU")
            .key("--device")
            .value("gpu")
            .allowed("auto, cpu")
            .remedy("build with the cargo feature wgpu of catseye-learn")
            .into()),
    }
}
