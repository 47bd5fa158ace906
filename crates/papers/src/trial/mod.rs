//! Trials of lane estimators. A scenario is driven through the whole chain, frame by frame; points, pulses
//! and images go to an estimator, and its estimates are compared with the true road. No truth goes to an
//! estimator.

pub mod camera;
pub mod camera_fusion;
pub mod compare;
pub mod compared_drive;
mod context;
pub mod drive;
mod edges;
pub mod hd_map;
mod kit;
mod lane_table;
pub mod markers;
mod method;
mod pictures;
pub mod range_doppler;
mod ready;
pub mod report;
mod result_folder;
pub mod road_shape;
mod run;
mod runner;
pub mod segmentation;
mod sensors;
pub mod signature;
mod stats;
pub mod uwb;

pub use context::{TrialContext, Watch, settings};
pub use drive::Drive;
pub use lane_table::{LaneTable, schemas};
pub use method::Method;
pub use ready::{LaneMethod, ReadyMethod};
pub use report::{Row, Rows, Sheet, Step, Trial};
pub use result_folder::{RunOptions, RunReport};
pub use run::run;
pub use runner::{Looks, Now, drive_through, one_look};
pub use sensors::OwnedInput;
