//! The usable cells of a range-Doppler map, and the speed at the map's edge.

use crate::error::LaneError;
use serde::{Deserialize, Serialize};

/// A detected cell of the range-Doppler map.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Cell {
    /// Range of the cell, m.
    pub range_m: f64,
    /// Range rate of the cell, m/s, positive when the range grows.
    pub range_rate_mps: f64,
    /// Standard deviation of the range, m.
    pub range_std_m: f64,
    /// Standard deviation of the range rate, m/s.
    pub range_rate_std_mps: f64,
}

/// An estimated value and whether the cells determine it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// The most likely value.
    pub value: f64,
    /// Standard deviation, from the curvature of the likelihood and the width of the search.
    pub std: f64,
    /// Whether the cells, and not the limits of the search, fix the value: its standard deviation is below a
    /// quarter of half the search range.
    pub observed: bool,
}

/// Estimates the speed from the edge of the map: the fastest closing rate that three cells share within four
/// standard deviations, so that a single false cell or one oncoming vehicle does not count. It is the speed
/// only if something stands in the direction of motion; otherwise it is too low by the cosine of the angle to
/// the nearest thing that does.
///
/// # Errors
/// Returns an error if no three cells share an edge, or if the closing rate there is not above five standard
/// deviations.
pub fn speed_from_edge(cells: &[Cell]) -> Result<Parameter, LaneError> {
    let mut closing: Vec<(f64, f64)> =
        cells.iter().filter(|c| usable(c)).map(|c| (-c.range_rate_mps, c.range_rate_std_mps)).collect();
    closing.sort_by(|a, b| b.0.total_cmp(&a.0));
    let edge = closing.windows(3).find(|w| w[0].0 - w[2].0 <= 4.0 * w[0].1.max(w[2].1));
    let [_, (mps, std), _] =
        edge.ok_or(LaneError::refused("no three cells share the fastest closing rate"))?
    else {
        return Err(LaneError::refused("no three cells share the fastest closing rate"));
    };
    if *mps <= 5.0 * std {
        return Err(too_slow(*mps));
    }
    Ok(Parameter { value: *mps, std: *std, observed: true })
}

pub(super) fn too_slow(speed_mps: f64) -> LaneError {
    LaneError::refused(format!("at {speed_mps:.3} m/s the range rates do not determine the lane"))
}

pub(super) fn usable(c: &Cell) -> bool {
    let std_is_good = |s: f64| s.is_finite() && s > 0.0;
    c.range_m.is_finite()
        && c.range_m > 0.0
        && c.range_rate_mps.is_finite()
        && std_is_good(c.range_std_m)
        && std_is_good(c.range_rate_std_mps)
}
