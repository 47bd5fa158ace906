//! Left and right radar together.

use super::{Event, EventKind, LanePlace, Reason, Uwb, UwbConfig, checked, lane_place};
use serde::Serialize;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Side {
    Left,
    Right,
}

/// Two estimators, one for each lane line.
#[derive(Debug, Clone)]
pub struct UwbPair {
    pub left: Uwb,
    pub right: Uwb,
    radar_span_m: f64,
    lane_width_m: f64,
}

/// What one scan of both radars brought.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PairEvent {
    pub left: Event,
    pub right: Event,
    /// From the offsets at the last markers of the lines that are present.
    pub place: Option<LanePlace>,
    /// On a departure warning of one line while the other is there: the side the car leaves to, that of the
    /// other line.
    pub leaves_to: Option<Side>,
}

impl UwbPair {
    /// `radar_span_m` is the distance between the radars, across. Left and right may differ in their
    /// settings.
    pub fn new(
        left: UwbConfig,
        right: UwbConfig,
        radar_span_m: f64,
        lane_width_m: f64,
    ) -> Result<Self, Reason> {
        checked("lane width", lane_width_m, lane_width_m > 0.0, "above 0 m")?;
        let fits = (0.0..=lane_width_m).contains(&radar_span_m);
        checked("distance between the radars", radar_span_m, fits, "0 m to the lane width")?;
        Ok(UwbPair { left: Uwb::new(left)?, right: Uwb::new(right)?, radar_span_m, lane_width_m })
    }

    /// The width that was given.
    pub fn lane_width_m(&self) -> f64 {
        self.lane_width_m
    }

    /// One scan of each radar, taken together: `[left, right]` energies and strongest ranges. When either is
    /// refused neither is taken.
    pub fn push(
        &mut self,
        scan_energies: [f64; 2],
        ranges_m: [Option<f64>; 2],
        time_s: f64,
        speed_mps: f64,
    ) -> Result<PairEvent, Reason> {
        self.left.check_scan(scan_energies[0], ranges_m[0], time_s, speed_mps)?;
        self.right.check_scan(scan_energies[1], ranges_m[1], time_s, speed_mps)?;
        let left = self.left.push_with_range(scan_energies[0], ranges_m[0], time_s, speed_mps)?;
        let right = self.right.push_with_range(scan_energies[1], ranges_m[1], time_s, speed_mps)?;
        let warns = |e: &Event| matches!(e.kind, EventKind::Departure(_));
        let leaves_to = match (warns(&left), warns(&right)) {
            (true, false) if right.lane_present => Some(Side::Right),
            (false, true) if left.lane_present => Some(Side::Left),
            _ => None,
        };
        Ok(PairEvent { left, right, place: self.place(), leaves_to })
    }

    /// The car between the lines that are present; `None` when neither is or none gives an offset.
    pub fn place(&self) -> Option<LanePlace> {
        let offset = |u: &Uwb| u.lateral_offset_m().filter(|_| u.lane_present());
        lane_place(offset(&self.left), offset(&self.right), self.radar_span_m, self.lane_width_m).ok()
    }
}
