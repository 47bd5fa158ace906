//! Place of a vehicle in a lane, and the bend ahead, from a range-rate map alone: no angles.
//!
//! Feng, section 3.6 (Fig. 3.21 to 3.24): a marker at lateral distance d and x ahead has the range
//! r = √(x² + d² + h²) and the range rate -v·cos of its angle to the motion, so each row of markers draws a
//! curve. A lane whose rows have known width and spacings is fitted to the cells of the map by maximum
//! likelihood: offset, heading, curvature, start of the bend, phase of both rows, speed. The likelihood is
//! that of a Poisson process: Σ log(e + p·Σ N(cell | marker)) - p·(markers in view), with the density e of
//! cells that are no markers and the probability of detection p.
//!
//! A map does not change when the scene is mirrored. With equal spacings left and right only the size of
//! offset, heading and curvature follows, and their signs against each other; [`Sign`] says so. With unequal
//! spacings the row that a cell lies on tells the side.
//!
//! The lane is straight for `curve_start`, then an arc. x along the lane, y left, radians, positive left.

use crate::error::{self, LaneError};
use glam::DVec2;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

mod cells;
pub mod estimator;
mod fit;
mod rows;
mod search;

pub use cells::{Cell, Parameter, speed_from_edge};
use cells::{too_slow, usable};
pub use estimator::{LaneLook, Options, RangeDopplerLane};
use fit::Fit;
pub use rows::Foreseen;
use search::Blots;

/// Number of fitted values.
pub const VALUES: usize = 7;
const OFFSET: usize = 0;
const HEADING: usize = 1;
const CURVATURE: usize = 2;
const START: usize = 3;
const LEFT: usize = 4;
const RIGHT: usize = 5;
const SPEED: usize = 6;

type Vector = [f64; VALUES];
type Matrix = [[f64; VALUES]; VALUES];

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Speed {
    /// Of the radar over ground, m/s, with its standard deviation.
    Known { mps: f64, std_mps: f64 },
    /// From the edge of the map, then fitted with the rest.
    FromMap,
}

/// Line that the spacings are measured along.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Along {
    /// The middle of the lane.
    Middle,
    /// Each row itself.
    Row,
}

/// Straight part of the lane in front of the radar.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum CurveStart {
    /// Its length is known, m; zero where the radar is in the bend.
    Known(f64),
    /// Its length is fitted, between zero and this, m.
    UpTo(f64),
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LaneSettings {
    pub lane_width_m: f64,
    pub left_spacing_m: f64,
    pub right_spacing_m: f64,
    pub along: Along,
    pub curve_start: CurveStart,
    /// Of the radar over the markers.
    pub radar_height_m: f64,
    pub max_offset_m: f64,
    pub max_heading_rad: f64,
    pub min_radius_m: f64,
    /// The bend ends where it has turned by this.
    pub max_turn_rad: f64,
    /// Ranges at which markers are seen.
    pub near_m: f64,
    pub far_m: f64,
    /// Half the field of view, about the direction of motion.
    pub half_view_rad: f64,
    /// Of a marker in view.
    pub detection_probability: f64,
    /// Share of the cells that are no markers.
    pub extra_share: f64,
    /// Log odds from which on one of two readings is taken as true.
    pub sure_log_odds: f64,
}

impl Default for LaneSettings {
    fn default() -> Self {
        Self {
            lane_width_m: 3.0,
            left_spacing_m: 1.5,
            right_spacing_m: 2.0,
            along: Along::Middle,
            curve_start: CurveStart::UpTo(30.0),
            radar_height_m: 0.15,
            max_offset_m: 1.5,
            max_heading_rad: PI / 3.0,
            min_radius_m: 5.0,
            max_turn_rad: PI,
            near_m: 0.5,
            far_m: 40.0,
            half_view_rad: PI / 2.0,
            detection_probability: 0.9,
            extra_share: 0.1,
            sure_log_odds: 4.6,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Sign {
    Known,
    /// The mirrored lane fits about as well. With equal spacings it fits exactly as well, and the lane
    /// reported is the one with its offset (or, where that is zero within its standard deviation, its
    /// heading, then its curvature) to the left.
    Unknown,
}

/// Another lane that fits about as well, not the mirrored one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct OtherLane {
    pub offset_m: f64,
    pub heading_rad: f64,
    pub curvature_per_m: f64,
    /// How much less likely it is.
    pub log_odds: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LaneFromMap {
    /// From the middle of the lane, metres, positive to the left.
    pub offset_m: Parameter,
    /// Of the motion against the lane, radians, positive to the left.
    pub heading_rad: Parameter,
    /// Of the bend, 1/m, positive to the left.
    pub curvature_per_m: Parameter,
    /// Along the lane from the radar to the bend. Not observed where the lane is straight.
    pub curve_start_m: Parameter,
    /// From the radar along the lane to the first marker ahead.
    pub left_phase_m: Parameter,
    pub right_phase_m: Parameter,
    pub speed_mps: Parameter,
    /// In the order of the values above.
    pub covariance: Matrix,
    pub sign: Sign,
    /// Log odds of this lane against the mirrored one; infinite where no mirrored one fits.
    pub sign_log_odds: f64,
    pub other: Option<OtherLane>,
    /// Expected number of cells that are markers.
    pub explained: f64,
    pub log_likelihood: f64,
}

impl LaneFromMap {
    /// Radius of the bend and the radii one standard deviation of the curvature to either side, metres,
    /// unsigned. None where the curvature is less than two standard deviations from zero.
    pub fn radius_m(&self) -> Option<[f64; 3]> {
        let (k, s) = (self.curvature_per_m.value.abs(), self.curvature_per_m.std);
        (k > 2.0 * s).then(|| [1.0 / k, 1.0 / (k + s), 1.0 / (k - s)])
    }
}

impl LaneFromMap {
    /// Where this lane is to be looked for after the radar has moved by `ahead_m` along the lane, by `left_m` to its side, and has
    /// turned by `turn_rad`: the start of a search for [`lane_near`].
    pub fn moved(&self, ahead_m: f64, left_m: f64, turn_rad: f64) -> LaneFromMap {
        let by = |p: Parameter, d: f64| Parameter { value: p.value + d, ..p };
        let mut out = self.clone();
        let start = self.curve_start_m.value;
        // In the bend the lane's direction turns along.
        let bent = if self.curve_start_m.observed {
            (ahead_m - start.max(0.0)).clamp(0.0, ahead_m.max(0.0))
        } else {
            0.0
        };
        out.offset_m = by(self.offset_m, left_m);
        out.heading_rad = by(self.heading_rad, turn_rad - bent * self.curvature_per_m.value);
        if self.curve_start_m.observed {
            out.curve_start_m.value = (start - ahead_m).max(0.0);
        }
        out.left_phase_m = by(self.left_phase_m, -ahead_m);
        out.right_phase_m = by(self.right_phase_m, -ahead_m);
        out
    }
}

impl LaneSettings {
    /// Errors: the name of a setting that lies outside its range.
    pub fn check(&self) -> Result<(), LaneError> {
        let positive = |x: f64| x.is_finite() && x > 0.0;
        let start = match self.curve_start {
            CurveStart::Known(m) | CurveStart::UpTo(m) => m,
        };
        let rules: [(&'static str, bool); 15] = [
            ("lane_width_m", positive(self.lane_width_m)),
            ("left_spacing_m", positive(self.left_spacing_m) && self.left_spacing_m >= 0.05),
            ("right_spacing_m", positive(self.right_spacing_m) && self.right_spacing_m >= 0.05),
            ("curve_start", start.is_finite() && (0.0..=500.0).contains(&start)),
            ("radar_height_m", self.radar_height_m.is_finite() && self.radar_height_m >= 0.0),
            ("max_offset_m", positive(self.max_offset_m) && self.max_offset_m <= 20.0),
            ("max_heading_rad", positive(self.max_heading_rad) && self.max_heading_rad <= PI / 2.0),
            ("min_radius_m", self.min_radius_m > 0.5 * self.lane_width_m),
            ("max_turn_rad", positive(self.max_turn_rad) && self.max_turn_rad <= TAU),
            ("near_m", self.near_m.is_finite() && self.near_m >= 0.0),
            ("far_m", positive(self.far_m) && self.far_m > self.near_m && self.far_m <= 500.0),
            ("half_view_rad", positive(self.half_view_rad) && self.half_view_rad <= PI),
            ("detection_probability", self.detection_probability > 0.0 && self.detection_probability < 1.0),
            ("extra_share", self.extra_share > 0.0 && self.extra_share < 1.0),
            ("sure_log_odds", positive(self.sure_log_odds)),
        ];
        error::settings(&rules)
    }
}

/// The lane that the cells of a map draw. Errors: see [`LaneError`]. Cells that are not finite, without
/// standard deviations, or outside `near_m` to `far_m` are left out. Deterministic.
pub fn lane_from_map(
    cells: &[Cell],
    speed: Speed,
    settings: &LaneSettings,
) -> Result<LaneFromMap, LaneError> {
    let problem = Problem::new(cells, speed, settings)?;
    let blots = Blots::new(&problem.fit());
    let modes = problem.search(&blots)?;
    problem.conclude(&blots, modes)
}

/// As [`lane_from_map`], from a lane that is known to be near, as the last look's moved on ([`LaneFromMap::moved`]) is: some ten times
/// faster. The mirrored lane is tried as well. What the cells say is all that counts: `near` is where the search starts, not knowledge.
///
/// Errors: those of [`lane_from_map`]; [`LaneError`] also where another lane is the right one and `near` leads to none.
pub fn lane_near(
    cells: &[Cell],
    speed: Speed,
    settings: &LaneSettings,
    near: &LaneFromMap,
) -> Result<LaneFromMap, LaneError> {
    let problem = Problem::new(cells, speed, settings)?;
    let mut p = near.values();
    p[SPEED] = problem.prior_mean[SPEED];
    if !p.iter().all(|v| v.is_finite()) {
        return Err(LaneError::Setting { name: "near" });
    }
    let mut modes = Vec::new();
    let fit = problem.fit();
    let blots = Blots::new(&fit);
    fit.try_from(p, &mut modes);
    fit.try_from(fit.phased(&blots, &p).1, &mut modes);
    problem.conclude(&blots, modes)
}

/// Cells made ready, and what is assumed of the lane.
struct Problem<'a> {
    cells: Vec<Cell>,
    first_from: Vec<usize>,
    per_std: Vec<[f64; 2]>,
    s: &'a LaneSettings,
    extra: f64,
    prior_mean: Vector,
    prior_std: Vector,
    is_free: [bool; VALUES],
    speeds: Vec<f64>,
}

/// Log likelihoods and lanes, best first.
type Modes = Vec<(f64, Vector)>;

impl<'a> Problem<'a> {
    fn new(cells: &[Cell], speed: Speed, s: &'a LaneSettings) -> Result<Problem<'a>, LaneError> {
        s.check()?;
        let is_in = |c: &&Cell| usable(c) && c.range_m >= s.near_m && c.range_m <= s.far_m;
        let mut used: Vec<Cell> = cells.iter().filter(is_in).copied().collect();
        used.sort_by(|a, b| {
            a.range_m.total_cmp(&b.range_m).then(a.range_rate_mps.total_cmp(&b.range_rate_mps))
        });
        let needed = VALUES;
        if used.len() < needed {
            return Err(LaneError::too_few("usable cells", used.len(), needed));
        }
        let mean_std = used.iter().map(|c| c.range_rate_std_mps).sum::<f64>() / used.len() as f64;
        let (speed_mean, speed_std, speeds) = match speed {
            Speed::Known { mps, std_mps } => {
                if !mps.is_finite() || !std_mps.is_finite() || std_mps < 0.0 {
                    return Err(LaneError::Setting { name: "speed" });
                }
                (mps, std_mps, vec![mps])
            }
            Speed::FromMap => {
                let v = speed_from_edge(&used)?.value;
                (v, 0.1 * v, [0.995, 1.003, 1.012, 1.03, 1.06].map(|f| f * v).to_vec())
            }
        };
        if speed_mean <= 5.0 * mean_std {
            return Err(too_slow(speed_mean));
        }
        let closing =
            |f: fn(f64, f64) -> f64, start: f64| used.iter().map(|c| c.range_rate_mps).fold(start, f);
        let rates = closing(f64::max, 0.0) - closing(f64::min, -speed_mean);
        let area = (s.far_m - s.near_m) * rates;
        let (start_mean, start_std, start_free) = match s.curve_start {
            CurveStart::Known(m) => (m, 0.0, false),
            CurveStart::UpTo(m) => (0.5 * m, 0.5 * m, m > 0.0),
        };
        let (left, right) = (s.left_spacing_m, s.right_spacing_m);
        let k = 1.0 / s.min_radius_m;
        Ok(Problem {
            extra: s.extra_share * used.len() as f64 / area,
            first_from: fit::first_from(&used),
            per_std: used.iter().map(|c| [1.0 / c.range_std_m, 1.0 / c.range_rate_std_mps]).collect(),
            cells: used,
            s,
            prior_mean: [0.0, 0.0, 0.0, start_mean, 0.5 * left, 0.5 * right, speed_mean],
            prior_std: [s.max_offset_m, s.max_heading_rad, k, start_std, left, right, speed_std],
            is_free: [true, true, true, start_free, true, true, speed_std > 0.0],
            speeds,
        })
    }

    fn fit(&self) -> Fit<'_> {
        Fit {
            cells: &self.cells,
            first_from: &self.first_from,
            per_std: &self.per_std,
            widest_m: self.cells.iter().map(|c| c.range_std_m).fold(0.0, f64::max),
            s: self.s,
            extra: self.extra,
            prior_mean: self.prior_mean,
            prior_std: self.prior_std,
            is_free: self.is_free,
        }
    }

    /// Lanes from all over the search range.
    fn search(&self, blots: &Blots) -> Result<Modes, LaneError> {
        /// Trials of all bends, each of a lane with its straight part.
        const ROUNDS: usize = 4;
        let fit = self.fit();
        let mut starts: Modes = Vec::new();
        for p in fit.grid(&self.speeds) {
            starts.push(fit.phased(blots, &p));
            if !self.s.has_equal_spacings() {
                starts.push(fit.phased(blots, &mirrored(&p)));
            }
        }
        starts.sort_by(|a, b| b.0.total_cmp(&a.0));
        // Without an offset the grid holds the mirrored lane as well.
        starts.dedup_by(|a, b| a.1 == b.1);
        let mut modes = Vec::new();
        for (_, p) in starts.iter().take(10) {
            fit.try_from(*p, &mut modes);
        }
        let none = unexplained(0.0, self.cells.len());
        let first = *modes.first().ok_or(none)?;
        let other_straights = modes.clone();
        let mut rounds = ROUNDS;
        self.bend(&fit, blots, first, &mut rounds, &mut modes);
        // Cells left over: a bend may have drawn the straight part aside, so other straight parts get their turn.
        let mut tried = vec![first.1];
        for (value, p) in other_straights {
            let share = fit.shares(&modes[0].1).iter().sum::<f64>() / self.cells.len() as f64;
            if share > 1.0 - 2.0 * self.s.extra_share || rounds == 0 {
                break;
            }
            let is_new =
                |q: &Vector| (p[OFFSET] - q[OFFSET]).abs() > 0.3 || (p[HEADING] - q[HEADING]).abs() > 0.05;
            if tried.iter().all(is_new) {
                tried.push(p);
                self.bend(&fit, blots, (value, p), &mut rounds, &mut modes);
            }
        }
        Ok(modes)
    }

    /// Adds what comes of other bends of a lane, as long as they better it.
    fn bend(&self, fit: &Fit<'_>, blots: &Blots, from: (f64, Vector), rounds: &mut usize, modes: &mut Modes) {
        /// A gain of log likelihood that is none.
        const SAME: f64 = 0.05;
        let mut best = from;
        while *rounds > 0 {
            *rounds -= 1;
            let mut found = vec![best];
            for q in fit.other_bends(blots, &best.1) {
                fit.try_from(q, &mut found);
            }
            modes.extend_from_slice(&found);
            let is_same = found[0].0 < best.0 + SAME;
            best = found[0];
            if is_same {
                break;
            }
        }
        modes.sort_by(|a, b| b.0.total_cmp(&a.0));
    }

    /// The best of these lanes, how sure it is, and what it is mistaken for.
    fn conclude(&self, blots: &Blots, mut modes: Modes) -> Result<LaneFromMap, LaneError> {
        let (fit, settings) = (self.fit(), self.s);
        let none = unexplained(0.0, self.cells.len());
        let best = modes.first().ok_or(none)?.1;
        // The mirrored lane of the best is always tried, so that a known sign is never for want of a trial.
        fit.try_from(fit.phased(blots, &mirrored(&best)).1, &mut modes);
        let (mut log_likelihood, mut p) = modes[0];
        let mut rivals = modes;
        if rivals[0].1 != best {
            // The mirrored one won: try back.
            fit.try_from(fit.phased(blots, &mirrored(&p)).1, &mut rivals);
            (log_likelihood, p) = rivals[0];
        }
        let explained: f64 = fit.shares(&p).iter().sum();
        if explained.is_nan() || explained < 0.5 * self.cells.len() as f64 {
            return Err(unexplained(explained, self.cells.len()));
        }
        let covariance = fit.covariance(&p);
        let is_close = |a: &Vector, b: &Vector| {
            [OFFSET, HEADING, CURVATURE]
                .iter()
                .all(|i| (a[*i] - b[*i]).abs() <= 3.0 * covariance[*i][*i].sqrt())
        };
        let other_side = mirrored(&p);
        let mut sign_log_odds = f64::INFINITY;
        let mut other = None;
        for (value, q) in &rivals {
            if is_close(q, &p) {
                continue;
            }
            let log_odds = log_likelihood - value;
            if is_close(q, &other_side) {
                sign_log_odds = sign_log_odds.min(log_odds);
            } else if other.is_none() && log_odds < settings.sure_log_odds {
                other = Some(OtherLane {
                    offset_m: q[OFFSET],
                    heading_rad: q[HEADING],
                    curvature_per_m: q[CURVATURE],
                    log_odds,
                });
            }
        }
        if settings.has_equal_spacings() {
            sign_log_odds = 0.0;
        }
        let sign = if sign_log_odds >= settings.sure_log_odds { Sign::Known } else { Sign::Unknown };
        let mut covariance = covariance;
        if sign == Sign::Unknown {
            let leading = [OFFSET, HEADING, CURVATURE];
            let first = leading.iter().find(|i| p[**i].abs() > covariance[**i][**i].sqrt());
            // Only where the mirrored lane is as good: with unequal spacings the better one stays.
            if settings.has_equal_spacings() && first.is_some_and(|i| p[*i] < 0.0) {
                let phases = (p[LEFT], p[RIGHT]);
                p = mirrored(&p);
                (p[RIGHT], p[LEFT]) = phases;
                covariance = mirrored_covariance(&covariance);
            }
        }
        p[LEFT] = p[LEFT].rem_euclid(settings.left_spacing_m);
        p[RIGHT] = p[RIGHT].rem_euclid(settings.right_spacing_m);
        let parameter = |i: usize| {
            let std = covariance[i][i].max(0.0).sqrt();
            let observed = !self.is_free[i] || std < 0.25 * self.prior_std[i];
            Parameter { value: p[i], std, observed }
        };
        let mut curve_start_m = parameter(START);
        // A straight lane has no place where its bend starts.
        if self.is_free[START] && p[CURVATURE].abs() < 3.0 * covariance[CURVATURE][CURVATURE].max(0.0).sqrt()
        {
            curve_start_m.observed = false;
        }
        Ok(LaneFromMap {
            offset_m: parameter(OFFSET),
            heading_rad: parameter(HEADING),
            curvature_per_m: parameter(CURVATURE),
            curve_start_m,
            left_phase_m: parameter(LEFT),
            right_phase_m: parameter(RIGHT),
            speed_mps: parameter(SPEED),
            covariance,
            sign,
            sign_log_odds,
            other,
            explained,
            log_likelihood,
        })
    }
}

fn unexplained(explained: f64, cells: usize) -> LaneError {
    LaneError::Unexplained { best: "lane", explained, of: cells, what: "cells" }
}

fn mirrored(p: &Vector) -> Vector {
    let mut q = *p;
    for i in [OFFSET, HEADING, CURVATURE] {
        q[i] = -q[i];
    }
    q
}

fn mirrored_covariance(c: &Matrix) -> Matrix {
    let to = [OFFSET, HEADING, CURVATURE, START, RIGHT, LEFT, SPEED];
    let sign = [-1.0, -1.0, -1.0, 1.0, 1.0, 1.0, 1.0];
    let mut out = [[0.0; VALUES]; VALUES];
    for i in 0..VALUES {
        for j in 0..VALUES {
            out[to[i]][to[j]] = sign[i] * sign[j] * c[i][j];
        }
    }
    out
}

#[cfg(test)]
mod tests;
