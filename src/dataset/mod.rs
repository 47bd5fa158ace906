//! Frames: the whole chain for one instant, the files of a frame, and runs of many frames that can be
//! interrupted and resumed.

pub mod files;
pub mod frame;
pub mod manifest;
pub mod run;

pub use frame::{Frame, Stages, simulate};
