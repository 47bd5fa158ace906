//! Lane detection with an impulse ultra-wideband radar that looks down at metal plates laid along the lane
//! line (Kim 2020).
//!
//! The range gate turns scans into energies ([`RangeGate`], Kim (2)-(6)), and a drive without markers gives
//! the threshold ([`Threshold`], Kim figure 7). Energies above it form marker passes, and passes one spacing
//! apart are a lane ([`Uwb`], Kim (12)). Passes without a partner, such as manhole covers, are rejected for
//! lack of a period. In addition there are the lateral offset and its trend ([`OffsetTrend`]), the distance
//! by counted markers ([`MarkerOdometer`]) and the values to compare with the document ([`score_run`]).
//! [`UwbLanes`] is the method behind the interface of all lane estimators, for one radar or for a left and a
//! right one.
//!
//! Energies are in watts or any other linear unit, the same everywhere. Distances along the road come from
//! the speed input alone and start at zero with the first scan.

mod centre;
pub mod estimator;
mod gate;
mod odometer;
mod offset;
pub mod options;
mod stats;
mod threshold;
mod track;
mod tuning;

#[cfg(test)]
mod tests;

pub use crate::side::Side;
pub use centre::Centre;
pub use estimator::{Background, UwbLanes, UwbSetup};
pub use gate::{GateEcho, MarkedLane, RangeAxis, RangeGate};
pub use odometer::{MarkerOdometer, OdometerReading};
pub use offset::{OffsetCurve, OffsetTrend, offset_from_range_m};
pub use options::{UwbOptions, from_json};
pub use stats::{RunScore, SpacingErrors, score_run, spacing_errors};
pub use threshold::{Histogram, Threshold, ThresholdMethod, exceedance_rate};
pub use track::{
    Departure, Event, EventKind, LaneEstimate, MarkerPass, MarkerReport, OffsetSource, Spacing, Uwb,
    UwbConfig, Verdict,
};
pub use tuning::{Tuned, Tuning};
