//! Lane detection with an impulse ultra-wideband radar that looks down at metal plates laid along the lane
//! line (document K: Kim 2020).
//!
//! Scans go through the range gate to an energy ([`RangeGate`], K (2)-(6)); a drive without markers gives the
//! threshold ([`Threshold`], K figure 7); energies over it form marker passes, and passes one spacing apart
//! are a lane ([`Uwb`], K (12)). Passes without a partner, such as manhole covers, are rejected for want of a
//! period. Beyond that: the lateral offset and its trend ([`OffsetTrend`]), the place between two lines
//! ([`UwbPair`], [`lane_place`]), the distance by counted markers ([`MarkerOdometer`]) and the figures to
//! compare with the document ([`score_run`]). [`UwbLanes`] and [`UwbPairLanes`] are the method behind the interface of all lane
//! estimators.
//!
//! Energies are in watts or any other linear unit, the same everywhere. Distances along the road come from
//! the speed input alone and start at zero with the first scan.

mod centre;
pub mod estimator;
mod gate;
mod odometer;
mod offset;
mod pair;
mod stats;
mod threshold;
mod track;

#[cfg(test)]
mod tests;

pub use centre::Centre;
pub use estimator::{Background, UwbLanes, UwbOptions, UwbPairLanes};
pub use gate::{GateEcho, MarkedLane, RangeAxis, RangeGate, least_plate_length_m};
pub use odometer::{MarkerOdometer, OdometerReading};
pub use offset::{
    LanePlace, LinesSeen, OffsetCurve, OffsetTrend, lane_place, offset_from_range_m, stagger_m,
};
pub use pair::{PairEvent, Side, UwbPair};
pub use stats::{RunScore, SpacingErrors, largest_error_m, score_run, spacing_errors};
pub use threshold::{Histogram, Threshold, ThresholdMethod, exceedance_rate};
pub use track::{
    Departure, Event, EventKind, LaneEstimate, MarkerPass, MarkerReport, OffsetSource, Spacing, Uwb,
    UwbConfig, Verdict, spacing_m,
};

use std::fmt;

/// Why there is no result.
#[derive(Debug, Clone, PartialEq)]
pub enum Reason {
    /// No values were given.
    Empty { what: &'static str },
    /// A value is NaN or infinite.
    NotFinite { what: &'static str, index: Option<usize> },
    /// A value lies outside its allowed range.
    OutOfRange { what: &'static str, value: f64, allowed: &'static str },
    /// Two lists that belong together differ in length.
    LengthMismatch { what: &'static str, found: usize, expected: usize },
    /// Too few values for this estimate.
    TooFew { what: &'static str, found: usize, needed: usize },
    /// The range samples do not cover the gate.
    GateNotCovered { gate_m: [f64; 2], samples_m: [f64; 2] },
    /// The scan at this index of a batch was refused.
    Scan { index: usize, reason: Box<Reason> },
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Reason::Empty { what } => write!(f, "no {what} given"),
            Reason::NotFinite { what, index: Some(i) } => write!(f, "{what} {i} is not a finite number"),
            Reason::NotFinite { what, index: None } => write!(f, "{what} is not a finite number"),
            Reason::OutOfRange { what, value, allowed } => write!(f, "{what} is {value}; allowed: {allowed}"),
            Reason::LengthMismatch { what, found, expected } => {
                write!(f, "{what}: {found} values where {expected} are expected")
            }
            Reason::TooFew { what, found, needed } => {
                write!(f, "{found} {what} are too few; at least {needed} are needed")
            }
            Reason::GateNotCovered { gate_m: [a, b], samples_m: [c, d] } => {
                write!(f, "the range samples from {c} m to {d} m do not cover the gate from {a} m to {b} m")
            }
            Reason::Scan { index, reason } => write!(f, "scan {index}: {reason}"),
        }
    }
}

impl std::error::Error for Reason {}

/// The value itself when it is finite and `ok` holds.
fn checked(what: &'static str, value: f64, ok: bool, allowed: &'static str) -> Result<f64, Reason> {
    if !value.is_finite() {
        Err(Reason::NotFinite { what, index: None })
    } else if !ok {
        Err(Reason::OutOfRange { what, value, allowed })
    } else {
        Ok(value)
    }
}

/// Refuses an empty list and a list with a value that is not finite.
fn all_finite(what: &'static str, values: &[f64]) -> Result<(), Reason> {
    if values.is_empty() {
        return Err(Reason::Empty { what });
    }
    match values.iter().position(|v| !v.is_finite()) {
        Some(i) => Err(Reason::NotFinite { what, index: Some(i) }),
        None => Ok(()),
    }
}
