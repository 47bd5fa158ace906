//! Frames: the whole chain for one instant, the files of a frame, runs of many frames that can be interrupted and
//! resumed, and datasets of drawn scenes in shards.

mod board;
pub mod datasheet;
pub mod draw;
pub mod files;
pub mod follow;
pub mod frame;
mod hold;
pub mod manifest;
pub mod produce;
pub mod recipe;
pub mod recording;
pub mod rows;
pub mod run;
pub mod site;
pub mod store;
pub mod sweeps;
pub mod tally;
pub mod traffic;
pub mod truth;
pub mod turntable;
pub mod verify;

pub use frame::{Frame, Stages, simulate};
