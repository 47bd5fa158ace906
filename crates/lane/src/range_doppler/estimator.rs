//! Estimates the lane from range and range rate of points, look after look.

use super::{
    Along, Cell, LaneFromMap, LaneSettings, Parameter, Sign, Speed, VALUES, lane_from_map, lane_near,
};
use crate::curve::{Clothoid, Fitted, Shape};
use crate::error::{self, LaneError};
use crate::limits;
use crate::numeric::bilinear;
use crate::standing::radar_velocity_mps;
use crate::{LaneEstimate, LaneEstimator, LanePoint, Line, Measured, SensorInput};
use glam::DVec2;
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_PI_2;

/// The method's name, as on the command line.
pub const METHOD: &str = "range-doppler";
/// Oldest age of a last look that tells where to search, s.
const OLDEST_S: f64 = 1.0;
/// Largest decrease of the share of explained cells before the whole range is searched again.
const WORSE: f64 = 0.1;
/// Error of a near marker's peak as a share of its change of range rate during a frame: the peak stands in
/// the middle of an even spread.
const SMEAR: f64 = 0.1;
/// Number of standard deviations from zero below which a curvature counts as none.
const SURE: f64 = 2.0;

/// Options of [`RangeDopplerLane`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Options {
    /// Position of the radar forward and left of the vehicle's reference point, m.
    pub radar_at_m: [f64; 2],
    /// Length of a frame, s; the aspect of near markers changes while it lasts.
    pub frame_time_s: f64,
    /// Least signal-to-noise ratio of a point, dB.
    pub min_snr_db: f64,
    /// Least standard deviation of a marker's range, m, for its extent and its placement in the row.
    pub least_range_std_m: f64,
    /// Lower bound of the standard deviation of a marker's range rate, m/s.
    pub least_range_rate_std_mps: f64,
    /// Whether the edge of the map gives the speed where the bus is silent.
    pub speed_from_map: bool,
    /// Number of looks between searches of the whole range; the looks between search only near the last lane.
    /// 1: always search it.
    pub search_every: u32,
    /// The lane that is sought and the settings of the search.
    pub lane: LaneSettings,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            radar_at_m: [0.0, 0.0],
            frame_time_s: 0.05,
            min_snr_db: 6.0,
            least_range_std_m: 0.05,
            least_range_rate_std_mps: 0.02,
            speed_from_map: true,
            search_every: 20,
            lane: LaneSettings::default(),
        }
    }
}

impl Options {
    /// Checks the options.
    ///
    /// # Errors
    /// Returns an error for the first option that lies outside its range.
    pub fn check(&self) -> Result<(), LaneError> {
        self.lane.check()?;
        let good = |v: f64| v.is_finite() && v >= 0.0;
        error::settings(&[
            ("radar_at_m", self.radar_at_m.iter().all(|v| v.abs() <= 20.0)),
            ("frame_time_s", good(self.frame_time_s) && self.frame_time_s <= 10.0),
            ("min_snr_db", self.min_snr_db.is_finite()),
            ("least_range_std_m", good(self.least_range_std_m)),
            ("least_range_rate_std_mps", good(self.least_range_rate_std_mps)),
            ("search_every", self.search_every > 0),
        ])
    }
}

/// Makes the estimator from options as JSON.
///
/// # Errors
/// Returns an error for options that are unknown or outside their ranges.
pub fn from_json(options: &str) -> catseye::base::error::Result<Box<dyn LaneEstimator + Send>> {
    let options: Options = limits::read_json(METHOD, options)?;
    Ok(Box::new(RangeDopplerLane::new(options).map_err(|e| limits::refused(METHOD, e))?))
}

/// The result of one look, with more detail than a [`LaneEstimate`].
#[derive(Debug, Clone, PartialEq)]
pub struct LaneLook {
    /// The estimate in the common form of all methods.
    pub estimate: LaneEstimate,
    /// The lane relative to the radar as fitted; None where there is no lane.
    pub lane: Option<LaneFromMap>,
    /// Whether the whole range was searched.
    pub searched: bool,
}

struct Last {
    time_s: f64,
    lane: LaneFromMap,
    share: f64,
    /// Looks since the last whole search.
    looks: u32,
}

/// Lane estimator that uses only range and range rate; azimuths are not read (Feng, section 3.6).
pub struct RangeDopplerLane {
    options: Options,
    last: Option<Last>,
}

impl RangeDopplerLane {
    /// Makes the estimator with its options.
    ///
    /// # Errors
    /// Returns an error for the first option that lies outside its range.
    pub fn new(options: Options) -> Result<RangeDopplerLane, LaneError> {
        options.check()?;
        Ok(RangeDopplerLane { options, last: None })
    }

    /// The options that the estimator was made with.
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// Estimates as [`LaneEstimator::estimate`] does, and also returns the fitted lane.
    pub fn look(&mut self, input: &SensorInput<'_>) -> LaneLook {
        let found = self.find(input);
        let time_s = input.time_s;
        let none = |why| LaneLook {
            estimate: LaneEstimate::none(METHOD, time_s, input.points.len(), why),
            lane: None,
            searched: false,
        };
        match found {
            Err(why) => {
                self.last = None;
                none(why)
            }
            Ok((lane, cells, slip_rad, searched)) => {
                let share = lane.explained / cells.cells.len().max(1) as f64;
                let looks = match (&self.last, searched) {
                    (Some(last), false) => last.looks + 1,
                    _ => 0,
                };
                let estimate = self.answer(input, &lane, &cells, slip_rad, share);
                self.last = Some(Last { time_s, lane: lane.clone(), share, looks });
                LaneLook { estimate, lane: Some(lane), searched }
            }
        }
    }

    /// Returns the lane, the cells it rests on, the angle of the radar's motion to the left of the vehicle's
    /// axis, and whether the whole range was searched.
    fn find(&self, input: &SensorInput<'_>) -> Result<(LaneFromMap, Cells, f64, bool), LaneError> {
        if input.points.is_empty() {
            return Err(LaneError::Empty);
        }
        if !input.time_s.is_finite() {
            return Err(LaneError::NotGiven { what: "the time of the frame".into() });
        }
        let o = &self.options;
        let is_number =
            |m: &Measured| m.value.is_finite() && m.std.is_finite() && m.std >= 0.0 && m.value.abs() < 1e3;
        let speed = input.speed_mps.filter(is_number);
        if speed.is_none() && !o.speed_from_map {
            return Err(LaneError::NoSpeed);
        }
        // The radar moves with the vehicle's speed and its rotation.
        let turn = input.yaw_rate_rad_per_s.filter(is_number);
        let (yaw, yaw_std) = turn.map_or((0.0, 0.0), |m| (m.value, m.std));
        let [ahead_m, left_m] = o.radar_at_m;
        let (mut slip_rad, mut own) = (0.0, None);
        if let Some(v) = speed {
            let moved = radar_velocity_mps(v.value, yaw, DVec2::new(ahead_m, left_m));
            if v.value > 0.0 {
                slip_rad = moved.y.atan2(moved.x);
            }
            // Reverse motion stays negative, so that the core reports it as too slow.
            let mps = if v.value > 0.0 { moved.length() } else { v.value };
            own = Some(Measured { value: mps, std: v.std.hypot(left_m * yaw_std) });
        }
        let cells = self.cells(input.points, own)?;
        let speed = match own {
            Some(v) => Speed::Known { mps: v.value, std_mps: v.std },
            None => Speed::FromMap,
        };
        if let Some(last) = &self.last {
            let dt = input.time_s - last.time_s;
            if dt > 0.0 && dt <= OLDEST_S && last.looks + 1 < o.search_every {
                let v = last.lane.speed_mps.value;
                let (sin, cos) = last.lane.heading_rad.value.sin_cos();
                let near = last.lane.moved(v * cos * dt, v * sin * dt, yaw * dt);
                // Where the bus is silent, the last look's speed is the start of this one's.
                let speed = match speed {
                    Speed::FromMap => Speed::Known { mps: v, std_mps: (2.0 * dt).max(0.05) },
                    known => known,
                };
                if let Ok(lane) = lane_near(&cells.cells, speed, &o.lane, &near)
                    && lane.explained >= (last.share - WORSE) * cells.cells.len() as f64
                {
                    return Ok((lane, cells, slip_rad, false));
                }
            }
        }
        let lane = lane_from_map(&cells.cells, speed, &o.lane).map_err(|r| match r {
            LaneError::TooFew { found: at_rest, .. } | LaneError::Unexplained { of: at_rest, .. } => {
                LaneError::NoPattern { at_rest }
            }
            other => other,
        })?;
        Ok((lane, cells, slip_rad, true))
    }

    /// Points that may be markers: finite, strong enough, and stationary as far as their range rate tells.
    fn cells(&self, points: &[LanePoint], own: Option<Measured>) -> Result<Cells, LaneError> {
        let o = &self.options;
        let is_sound = |p: &LanePoint| {
            let std = [p.std_m[0], p.range_rate_std_mps];
            p.range_m.is_finite()
                && p.range_rate_mps.is_finite()
                && std.iter().all(|s| s.is_finite() && *s >= 0.0)
        };
        if !points.iter().any(is_sound) {
            return Err(LaneError::NotFinite { points: points.len() });
        }
        let mut out = Cells { cells: Vec::new(), members: Vec::new() };
        for (i, p) in points.iter().enumerate().filter(|(_, p)| is_sound(p)) {
            let closing = -p.range_rate_mps;
            let speed = own.map_or(closing.max(0.0), |v| v.value);
            let mut rate_std = p.range_rate_std_mps.hypot(o.least_range_rate_std_mps);
            if let Some(v) = own {
                let margin = 4.0 * rate_std.hypot(v.std);
                let least = v.value * o.lane.half_view_rad.cos();
                if closing > v.value + margin || closing < least - margin {
                    continue;
                }
            }
            if !self.reachable(p.range_m, closing, speed) {
                continue;
            }
            let strong = p.snr_db.is_nan() || p.snr_db >= o.min_snr_db;
            let range = o.lane.near_m..=o.lane.far_m;
            if !strong || !range.contains(&p.range_m) {
                continue;
            }
            // Change of the range rate of what is stationary, by the angle to the motion.
            let change = (speed * speed - closing * closing).max(0.0) / p.range_m.max(0.1);
            rate_std = rate_std.hypot(SMEAR * change * o.frame_time_s);
            out.members.push(i);
            out.cells.push(Cell {
                range_m: p.range_m,
                range_rate_mps: p.range_rate_mps,
                range_std_m: p.std_m[0].hypot(o.least_range_std_m),
                range_rate_std_mps: rate_std,
            });
        }
        if out.cells.is_empty() { Err(LaneError::NothingAtRest) } else { Ok(out) }
    }

    /// Whether a lane within the search range has a marker so far from the radar's path: rails and walls
    /// stand farther.
    fn reachable(&self, range_m: f64, closing_mps: f64, speed_mps: f64) -> bool {
        if speed_mps <= 0.0 {
            return true;
        }
        let l = &self.options.lane;
        let cos = (closing_mps / speed_mps).clamp(-1.0, 1.0);
        let (ahead, aside) = (range_m * cos, range_m * (1.0 - cos * cos).sqrt());
        let bend = (range_m / l.min_radius_m).min(FRAC_PI_2);
        let turn = (l.max_heading_rad + bend).min(FRAC_PI_2);
        let row = 0.5 * l.lane_width_m + l.max_offset_m;
        // The range rate resolves small angles badly.
        aside <= row + ahead.abs() * turn.sin() + 0.05 * range_m + 0.5
    }

    /// Converts the fitted lane to the vehicle's frame.
    fn answer(
        &self,
        input: &SensorInput<'_>,
        lane: &LaneFromMap,
        cells: &Cells,
        slip_rad: f64,
        share: f64,
    ) -> LaneEstimate {
        let s = &self.options.lane;
        let far_m = cells.cells.iter().map(|c| c.range_m).fold(0.0, f64::max);
        let at = Standing::new(lane, self.options.radar_at_m, slip_rad);
        let mut lines = Vec::new();
        for is_left in [false, true] {
            let members = cells.of_row(lane, is_left, s);
            lines.extend(at.pieces(lane, is_left, s, far_m).into_iter().map(|fitted| Line {
                fitted,
                confidence: share.clamp(0.0, 1.0),
                members: members.clone(),
            }));
        }
        let used = lines.iter().flat_map(|l| &l.members).collect::<std::collections::BTreeSet<_>>().len();
        let measured = |value: f64, j: [f64; VALUES]| {
            Some(Measured { value, std: bilinear(&j, &lane.covariance, &j).max(0.0).sqrt() })
        };
        let mut estimate = LaneEstimate::of_lines(METHOD, input.time_s, input.points.len(), lines);
        estimate.lines.sort_by(|a, b| {
            let y = |l: &Line| l.fitted.curve.foot(DVec2::ZERO).left_m;
            y(b).total_cmp(&y(a)).then(a.fitted.curve.start_m[0].total_cmp(&b.fitted.curve.start_m[0]))
        });
        // The distance of the rows is a setting, not a measurement.
        estimate.width_m = None;
        estimate.offset_m = measured(at.offset_m, [1.0, -at.behind_m, 0.0, 0.0, 0.0, 0.0, 0.0]);
        estimate.heading_rad = measured(at.heading_rad, [0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        // The bend ahead is not the lane's curvature where the vehicle stands.
        estimate.curvature_per_m = match at.bend {
            Bend::Ahead => None,
            _ => measured(lane.curvature_per_m.value, [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0]),
        };
        estimate.confidence = share.clamp(0.0, 1.0);
        estimate.provenance.used = used;
        estimate.mirror = lane.sign == Sign::Unknown;
        estimate
    }
}

impl LaneEstimator for RangeDopplerLane {
    fn method(&self) -> &'static str {
        METHOD
    }

    fn estimate(&mut self, input: &SensorInput<'_>) -> LaneEstimate {
        self.look(input).estimate
    }
}

struct Cells {
    cells: Vec<Cell>,
    /// Index of each cell's point.
    members: Vec<usize>,
}

impl Cells {
    /// Indices of points within three standard deviations of a marker of the row.
    fn of_row(&self, lane: &LaneFromMap, is_left: bool, s: &LaneSettings) -> Vec<usize> {
        let markers = lane.markers(s);
        let near = |c: &Cell| {
            markers.iter().any(|m| {
                let e = [
                    (c.range_m - m.range_m) / c.range_std_m,
                    (c.range_rate_mps - m.range_rate_mps) / c.range_rate_std_mps,
                ];
                m.is_left == is_left && e[0].hypot(e[1]) < 3.0
            })
        };
        self.cells.iter().zip(&self.members).filter(|(c, _)| near(c)).map(|(_, i)| *i).collect()
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Bend {
    /// Zero within its standard deviation.
    None,
    Ahead,
    /// The radar is in the bend.
    Here,
}

/// The vehicle in the lane's axes: x along the lane from the radar, y left of its centre line.
struct Standing {
    reference_m: DVec2,
    /// Angle of the vehicle's axis to the lane's axes, rad.
    axis_rad: f64,
    /// Distance of the reference point behind the radar along the lane, m.
    behind_m: f64,
    offset_m: f64,
    /// Heading relative to the lane at the reference point, rad.
    heading_rad: f64,
    bend: Bend,
}

impl Standing {
    fn new(lane: &LaneFromMap, radar_at_m: [f64; 2], slip_rad: f64) -> Standing {
        let k = lane.curvature_per_m;
        let start: Parameter = lane.curve_start_m;
        let bend = match k.value.abs() > SURE * k.std {
            false => Bend::None,
            true if start.value <= start.std.min(1.0) => Bend::Here,
            true => Bend::Ahead,
        };
        let axis_rad = lane.heading_rad.value - slip_rad;
        let lever = DVec2::from_angle(axis_rad).rotate(DVec2::from_array(radar_at_m));
        let reference_m = DVec2::new(0.0, lane.offset_m.value) - lever;
        // The arc reaches back to the reference point.
        let bent = if bend == Bend::Here { k.value } else { 0.0 };
        Standing {
            reference_m,
            axis_rad,
            behind_m: lever.x,
            offset_m: reference_m.y - 0.5 * bent * lever.x * lever.x,
            heading_rad: axis_rad + bent * lever.x,
            bend,
        }
    }

    /// One row as a straight piece and an arc.
    fn pieces(&self, lane: &LaneFromMap, is_left: bool, s: &LaneSettings, far_m: f64) -> Vec<Fitted> {
        let (k, side) = (lane.curvature_per_m.value, if is_left { 0.5 } else { -0.5 } * s.lane_width_m);
        let seen = lane.curve(is_left, 0.25, s);
        let last = seen.iter().filter(|m| m.range_m <= far_m).map(|m| m.along_m).fold(0.0, f64::max);
        let back = DVec2::from_angle(-self.axis_rad);
        let piece = |from: DVec2, curvature: f64, length_m: f64, covariance: [[f64; 4]; 4]| Fitted {
            curve: Clothoid {
                start_m: back.rotate(from - self.reference_m).to_array(),
                heading_rad: -self.axis_rad,
                curvature_per_m: curvature,
                curvature_rate_per_m2: 0.0,
                length_m,
            },
            shape: Shape::Arc,
            covariance,
            residual: 1.0,
        };
        // By offset, heading, curvature and start of the bend.
        let spread = |j: [[f64; 4]; 3]| {
            let mut out = [[0.0; 4]; 4];
            for (a, ja) in j.iter().enumerate() {
                for (b, jb) in j.iter().enumerate() {
                    for (i, x) in ja.iter().enumerate() {
                        for (l, y) in jb.iter().enumerate() {
                            out[a][b] += x * lane.covariance[i][l] * y;
                        }
                    }
                }
            }
            out
        };
        let begin = self.reference_m.x.min(0.0) - 1.0;
        let start = if self.bend == Bend::None { f64::INFINITY } else { lane.curve_start_m.value.max(0.0) };
        let mut out = Vec::new();
        let straight = start.min(last.max(begin + 1.0));
        // A straight line may be as bent as the cells allow; a piece before a bend is straight.
        let open = if self.bend == Bend::None { 1.0 } else { 0.0 };
        let at_begin = [[-1.0, -begin, 0.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, open, 0.0]];
        out.push(piece(DVec2::new(begin, side), 0.0, straight - begin, spread(at_begin)));
        if last > start {
            let per_m = 1.0 - k * side;
            let bent =
                [[-1.0, -start, 0.0, 0.0], [0.0, -1.0, 0.0, -k / per_m], [0.0, 0.0, per_m.powi(-2), 0.0]];
            let length_m = (last - start) * if s.along == Along::Row { 1.0 } else { per_m };
            out.push(piece(DVec2::new(start, side), k / per_m, length_m, spread(bent)));
        }
        out
    }
}
