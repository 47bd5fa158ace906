//! The edges of the region of lanes by a trained network. The network belongs to the cargo feature `learn`; without it the
//! settings are read and checked all the same, and the method says how to get it.

#[cfg(feature = "learn")]
mod learned;

#[cfg(not(feature = "learn"))]
use crate::trial::{kit::*, method::Method};
#[cfg(not(feature = "learn"))]
use catseye_lane::segmentation::METHOD;
pub use catseye_lane::segmentation::SegmentationOptions;

#[cfg(not(feature = "learn"))]
impl LaneMethod for SegmentationOptions {
    fn trial(&self, _: &TrialContext<'_>) -> Result<Trial> {
        Method::Segmentation.check_built().and(Ok(Trial::new(METHOD, "")))
    }

    fn ready(&self, _: &TrialContext<'_>, _: &Drive<'_>, _: u32) -> Result<Vec<(String, ReadyMethod)>> {
        Method::Segmentation.check_built().and(Ok(Vec::new()))
    }
}
