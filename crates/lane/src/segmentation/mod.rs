//! The lanes before a radar from a picture of their probability, seen from above: the method segmentation. The picture
//! comes from a network, which lives elsewhere (catseye-learn); here are the method's options and the geometry, which
//! knows no network.

pub mod options;
pub mod region;

pub use options::{RadarMount, SegmentationOptions};
pub use region::{LaneCells, RegionLimits, estimate};

/// The method's name on the command line.
pub const METHOD: &str = "segmentation";
