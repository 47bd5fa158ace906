//! Distance by counted markers: number of markers times spacing, plus the distance by the speed input since
//! the last one.

use crate::error::{LaneError, checked};
use serde::Serialize;
use std::collections::VecDeque;

/// Number of markers over which the ratio of road to speed distance is measured.
const SCALE_MARKERS: usize = 16;
/// Number of spacings needed before that ratio is used.
const SCALE_SPACINGS: u64 = 4;

/// Counts markers along a drive.
#[derive(Debug, Clone)]
pub struct MarkerOdometer {
    spacing_m: f64,
    tolerance_m: f64,
    /// Pairs (spacings since the first marker, speed distance in m) of the last markers.
    recent: VecDeque<(u64, f64)>,
    start_m: f64,
    certain: bool,
}

/// State of the odometer at one speed distance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct OdometerReading {
    /// Number of whole spacings from the first to the last marker.
    pub spacings: u64,
    /// Road since the last marker, m, by the speed input times `scale`.
    pub phase_m: f64,
    /// Road since the first marker, m: spacings times their length, plus the phase.
    pub distance_m: f64,
    /// Distance since the first marker by the speed input alone, m.
    pub speed_distance_m: f64,
    /// Speed distance minus marker distance, m.
    pub drift_m: f64,
    /// Road divided by speed distance over the last markers; 1 until four spacings have passed.
    pub scale: f64,
    /// Whether all gaps between markers were whole numbers of spacings, and short enough that their number is
    /// no guess.
    pub certain: bool,
}

impl MarkerOdometer {
    /// Makes an odometer for markers `spacing_m` apart; a marker within `tolerance_m` of a whole number of
    /// spacings is counted.
    ///
    /// # Errors
    /// Returns an error if `spacing_m` is not positive, or `tolerance_m` is not positive or above half the
    /// spacing.
    pub fn new(spacing_m: f64, tolerance_m: f64) -> Result<Self, LaneError> {
        checked("marker spacing", spacing_m, spacing_m > 0.0, "above 0 m")?;
        let fits = tolerance_m > 0.0 && tolerance_m <= spacing_m / 2.0;
        checked("marker tolerance", tolerance_m, fits, "above 0 m, at most half the marker spacing")?;
        Ok(MarkerOdometer { spacing_m, tolerance_m, recent: VecDeque::new(), start_m: 0.0, certain: true })
    }

    /// Adds a marker's centre at this speed distance and returns whether it was counted. A marker that is no
    /// whole number of spacings after the last is not counted, unless it follows a gap of more spacings than
    /// the tolerance can bridge: then the nearest number is taken and readings become uncertain.
    ///
    /// # Errors
    /// Returns an error if the distance is non-finite or not beyond the last marker.
    pub fn mark(&mut self, speed_distance_m: f64) -> Result<bool, LaneError> {
        let at_m = checked("distance of the marker", speed_distance_m, true, "")?;
        let Some(&(count, last_m)) = self.recent.back() else {
            self.start_m = at_m;
            self.recent.push_back((0, at_m));
            return Ok(true);
        };
        checked("distance of the marker", at_m, at_m > last_m, "beyond the marker before")?;
        let spacings = (at_m - last_m) * self.scale() / self.spacing_m;
        let whole = spacings.round();
        let near = (spacings - whole).abs() * self.spacing_m <= self.tolerance_m;
        // Over this many spacings a scale error of tolerance / spacing shifts the count by one half.
        let reach = 0.5 * self.spacing_m / self.tolerance_m;
        let far = spacings > reach.max(1.5);
        if whole < 1.0 || !(near || far) {
            return Ok(false);
        }
        if far {
            self.certain = false;
            // The ratio over a guessed count would not be a measurement.
            self.recent.clear();
        }
        self.recent.push_back((count.saturating_add(whole as u64), at_m));
        if self.recent.len() > SCALE_MARKERS {
            self.recent.pop_front();
        }
        Ok(true)
    }

    /// Reading at this distance; `None` before the first marker or for a non-finite distance.
    pub fn reading(&self, speed_distance_m: f64) -> Option<OdometerReading> {
        let &(spacings, last_m) = self.recent.back()?;
        if !speed_distance_m.is_finite() {
            return None;
        }
        let scale = self.scale();
        let phase_m = (speed_distance_m - last_m) * scale;
        let distance_m = spacings as f64 * self.spacing_m + phase_m;
        let along_m = speed_distance_m - self.start_m;
        Some(OdometerReading {
            spacings,
            phase_m,
            distance_m,
            speed_distance_m: along_m,
            drift_m: along_m - distance_m,
            scale,
            certain: self.certain,
        })
    }

    fn scale(&self) -> f64 {
        match (self.recent.front(), self.recent.back()) {
            (Some(&(n0, s0)), Some(&(n1, s1))) if n1 - n0 >= SCALE_SPACINGS && s1 > s0 => {
                (n1 - n0) as f64 * self.spacing_m / (s1 - s0)
            }
            _ => 1.0,
        }
    }
}
