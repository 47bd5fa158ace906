//! Frames: the whole chain for one instant, the files of a frame, and runs of many frames that can be
//! interrupted and resumed.

pub mod files;
pub mod follow;
pub mod frame;
pub mod manifest;
pub mod recording;
pub mod run;
pub mod sweeps;
pub mod turntable;

pub use frame::{Frame, Stages, simulate};
