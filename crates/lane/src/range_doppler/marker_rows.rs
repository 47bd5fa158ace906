//! Rows of markers as a radar sees them: the position, range and range rate of each.

use super::lane::*;
use glam::DVec2;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Curvature below which a lane counts as straight, 1/m.
const STRAIGHT_PER_M: f64 = 1e-6;

/// A marker in view.
#[derive(Clone, Copy)]
pub(super) struct Marker {
    pub(super) is_left: bool,
    /// Distance along the lane from the radar, m.
    pub(super) u: f64,
    /// Unit vector from the radar in the axes of the lane.
    pub(super) unit: DVec2,
    pub(super) range: f64,
    pub(super) rate: f64,
}

/// A marker, or a place between two, as a lane predicts it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Foreseen {
    /// Whether the marker stands in the left row.
    pub is_left: bool,
    /// Distance along the lane from the radar, m.
    pub along_m: f64,
    /// Range from the radar, m.
    pub range_m: f64,
    /// Range rate, m/s, positive when the range grows.
    pub range_rate_mps: f64,
}

impl LaneFromMap {
    /// Predicts the markers in view, row by row, near ones first.
    pub fn markers(&self, settings: &LaneSettings) -> Vec<Foreseen> {
        self.row_of(true, settings).chain(self.row_of(false, settings)).collect()
    }

    /// Predicts the curve that a row draws in the map, at places `step_m` apart.
    pub fn curve(&self, is_left: bool, step_m: f64, settings: &LaneSettings) -> Vec<Foreseen> {
        let step_m = step_m.max(0.01);
        let fine = LaneSettings { left_spacing_m: step_m, right_spacing_m: step_m, ..*settings };
        self.row_of(is_left, &fine).collect()
    }

    fn row_of(&self, is_left: bool, settings: &LaneSettings) -> impl Iterator<Item = Foreseen> {
        let phase = if is_left { self.left_phase_m.value } else { self.right_phase_m.value };
        let mut out = Vec::new();
        settings.row(&self.values(), is_left, phase, |m| {
            out.push(Foreseen { is_left, along_m: m.u, range_m: m.range, range_rate_mps: m.rate });
        });
        out.into_iter()
    }

    pub(super) fn values(&self) -> Vector {
        [
            self.offset_m.value,
            self.heading_rad.value,
            self.curvature_per_m.value,
            self.curve_start_m.value,
            self.left_phase_m.value,
            self.right_phase_m.value,
            self.speed_mps.value,
        ]
    }
}

impl LaneSettings {
    pub(super) fn lateral_m(&self, is_left: bool) -> f64 {
        if is_left { 0.5 * self.lane_width_m } else { -0.5 * self.lane_width_m }
    }

    pub(super) fn spacing_m(&self, is_left: bool) -> f64 {
        if is_left { self.left_spacing_m } else { self.right_spacing_m }
    }

    pub(super) fn has_equal_spacings(&self) -> bool {
        (self.left_spacing_m - self.right_spacing_m).abs() < 1e-9
    }

    /// Position of a row at the distance `u` along the lane from the radar, m.
    pub(super) fn row_m(&self, is_left: bool, u: f64, curvature: f64, start: f64) -> DVec2 {
        let t = self.lateral_m(is_left);
        let v = u - start;
        if v <= 0.0 {
            return DVec2::new(u, t);
        }
        let turn = match self.along {
            Along::Middle => curvature * v,
            Along::Row => curvature * v / (1.0 - curvature * t),
        };
        // sin/turn and (1 - cos)/turn, good at zero.
        let half = 0.5 * turn;
        let sinc = if half.abs() < 1e-4 { 1.0 - half * half / 6.0 } else { half.sin() / half };
        let length = if curvature.abs() < 1e-9 { v } else { turn / curvature };
        let chord = length * sinc;
        let (sin, cos) = turn.sin_cos();
        DVec2::new(start + chord * half.cos() - t * sin, chord * half.sin() + t * cos)
    }

    /// Derivative of [`LaneSettings::row_m`] with respect to u, in the bend.
    pub(super) fn way(&self, is_left: bool, u: f64, curvature: f64, start: f64) -> DVec2 {
        let t = self.lateral_m(is_left);
        let (per_m, length) = match self.along {
            Along::Middle => (curvature, 1.0 - curvature * t),
            Along::Row => (curvature / (1.0 - curvature * t), 1.0),
        };
        length * DVec2::from_angle(per_m * (u - start))
    }

    /// Largest u of the row, m.
    pub(super) fn end_m(&self, is_left: bool, curvature: f64, start: f64) -> f64 {
        let straight = start.max(0.0) + self.far_m;
        if curvature.abs() < 1e-6 {
            return straight;
        }
        let per_turn = match self.along {
            Along::Middle => 1.0 / curvature.abs(),
            Along::Row => (1.0 / curvature - self.lateral_m(is_left)).abs(),
        };
        // A slight arc leaves the far range about as soon as a straight line, any other before the last of these.
        let slight = 1.1 * (straight + self.lane_width_m + 2.0 * self.max_offset_m);
        if slight < per_turn {
            return start + slight;
        }
        (start + self.max_turn_rad * per_turn).min(start + 4.0 * self.far_m)
    }

    /// Least u at which a row can be in view, m: behind the radar a wide view reaches back only a little.
    pub(super) fn begin_m(&self, lateral_m: f64, heading: f64) -> f64 {
        let behind = PI - (heading.abs() + self.half_view_rad);
        let back = if behind > 0.0 { (lateral_m / behind.tan().max(0.0)).max(0.0) } else { f64::INFINITY };
        // Beyond a right angle nothing behind is in view.
        let back = if behind > PI / 2.0 { 0.0 } else { back };
        -(back + 0.1).min(self.far_m)
    }

    /// Calls `each` with the markers of a row in view.
    pub(super) fn row(&self, p: &Vector, is_left: bool, phase: f64, each: impl FnMut(Marker)) {
        self.row_between(p, is_left, phase, [f64::NEG_INFINITY, f64::INFINITY], each);
    }

    /// Calls `each` with the markers of a row in view between two places along the lane. Along the arc each
    /// follows from the last by a rotation.
    pub(super) fn row_between(
        &self,
        p: &Vector,
        is_left: bool,
        phase: f64,
        [from, to]: [f64; 2],
        mut each: impl FnMut(Marker),
    ) {
        let (k, start, t) = (p[CURVATURE], p[START], self.lateral_m(is_left));
        let spacing = self.spacing_m(is_left);
        let motion = DVec2::from_angle(p[HEADING]);
        let edge = self.half_view_rad.cos() - 1e-9;
        let h2 = self.radar_height_m.powi(2);
        let mut show = |u: f64, place: DVec2| {
            let d = DVec2::new(place.x, place.y - p[OFFSET]);
            let range = (d.length_squared() + h2).sqrt();
            if range >= self.near_m && range <= self.far_m {
                let unit = d / range.max(1e-9);
                let cos = unit.dot(motion);
                if cos >= edge {
                    each(Marker { is_left, u, unit, range, rate: -p[SPEED] * cos });
                }
            }
        };
        // Rows begin at the radar or behind.
        let from = if from >= 0.0 { from } else { from.max(self.begin_m((t - p[OFFSET]).abs(), p[HEADING])) };
        let end = self.end_m(is_left, k, start).min(to);
        let mut u = phase + ((from - phase) / spacing).ceil() * spacing;
        let is_straight = k.abs() < STRAIGHT_PER_M;
        let last = if is_straight { end } else { start.min(end) };
        while u <= last {
            show(u, DVec2::new(u, t));
            u += spacing;
        }
        if is_straight || u > end {
            return;
        }
        let per_m = match self.along {
            Along::Middle => k,
            Along::Row => k / (1.0 - k * t),
        };
        let (radius, from_middle) = (1.0 / k, 1.0 / k - t);
        let place = |at: DVec2| DVec2::new(start + from_middle * at.y, radius - from_middle * at.x);
        let mut at = DVec2::from_angle(per_m * (u - start));
        let turn = DVec2::from_angle(per_m * spacing);
        let far2 = self.far_m.powi(2);
        let is_far = |place: DVec2| place.distance_squared(DVec2::new(0.0, p[OFFSET])) + h2 > far2;
        let mut stays_far = None;
        while u <= end {
            let here = place(at);
            // The distance to a point of a circle grows up to the farthest and falls from there: where the
            // end is out of view as well, nothing comes back in between.
            if is_far(here) && at.x * here.x + at.y * (here.y - p[OFFSET]) > 0.0 {
                let ends_far = || {
                    let left = (per_m * (end - u)).abs();
                    left < PI && is_far(place(DVec2::from_angle(per_m * (end - start))))
                };
                if *stays_far.get_or_insert_with(ends_far) {
                    break;
                }
            }
            show(u, here);
            at = turn.rotate(at);
            u += spacing;
        }
    }
}
