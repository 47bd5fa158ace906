//! Position of a vehicle in its lane and the bend ahead, from a range-rate map alone, without angles.
//!
//! Feng, section 3.6 (Fig. 3.21 to 3.24): a marker at lateral distance d and x ahead has the range r = √(x² +
//! d² + h²) and the range rate -v·cos of its angle to the motion, so each row of markers draws a curve. A
//! lane whose rows have known width and spacings is fitted to the cells of the map by maximum likelihood:
//! offset, heading, curvature, start of the bend, phase of both rows and speed. The likelihood is that of a
//! Poisson process: Σ log(e + p·Σ N(cell | marker)) - p·(markers in view), with the density e of cells that
//! are not markers and the probability of detection p.
//!
//! A map does not change when the scene is mirrored. With equal spacings left and right only the magnitudes
//! of offset, heading and curvature follow, and their signs relative to each other; [`Sign`] says so. With
//! unequal spacings the row of a cell tells the side.
//!
//! The lane is straight for `curve_start`, then an arc. Its axes are x along the lane and y to the left;
//! angles are in radians, positive to the left.

use crate::error::LaneError;

mod cells;
pub mod estimator;
mod fit;
mod lane;
mod marker_rows;
mod search;

pub use cells::{Cell, Parameter, speed_from_edge};
use cells::{too_slow, usable};
pub use estimator::{LaneLook, Options, RangeDopplerLane, from_json};
use fit::Fit;
use lane::*;
pub use lane::{Along, CurveStart, LaneFromMap, LaneSettings, OtherLane, Sign, Speed, VALUES};
pub use marker_rows::Foreseen;
use search::Blots;

/// Fits a lane to the cells of a map. The result is deterministic.
///
/// # Errors
/// Returns an error if a setting or the speed is out of range, if there are too few usable cells, if the
/// speed is too low or cannot be found, or if no lane explains enough cells. Cells that are non-finite,
/// without standard deviations, or outside `near_m` to `far_m` are left out.
pub fn lane_from_map(
    cells: &[Cell],
    speed: Speed,
    settings: &LaneSettings,
) -> Result<LaneFromMap, LaneError> {
    let fit = Fit::new(cells, speed, settings)?;
    let blots = Blots::new(&fit);
    let modes = fit.search(&blots)?;
    fit.conclude(&blots, modes)
}

/// Fits as [`lane_from_map`] does, but from a lane that is known to be near, such as the last look's lane
/// moved on ([`LaneFromMap::moved`]); this is some ten times faster. The mirrored lane is tried as well. Only
/// the cells count: `near` is where the search starts, not prior knowledge.
///
/// # Errors
/// Returns the errors of [`lane_from_map`], an error for a non-finite `near`, and an error also where `near`
/// leads to no lane although another one is right.
pub fn lane_near(
    cells: &[Cell],
    speed: Speed,
    settings: &LaneSettings,
    near: &LaneFromMap,
) -> Result<LaneFromMap, LaneError> {
    let fit = Fit::new(cells, speed, settings)?;
    let mut p = near.values();
    p[SPEED] = fit.prior_mean[SPEED];
    if !p.iter().all(|v| v.is_finite()) {
        return Err(LaneError::Setting { name: "near" });
    }
    let mut modes = Vec::new();
    let blots = Blots::new(&fit);
    fit.try_from(p, &mut modes);
    fit.try_from(fit.phased(&blots, &p).1, &mut modes);
    fit.conclude(&blots, modes)
}

impl<'a> Fit<'a> {
    fn new(cells: &[Cell], speed: Speed, s: &'a LaneSettings) -> Result<Fit<'a>, LaneError> {
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
        Ok(Fit {
            extra: s.extra_share * used.len() as f64 / area,
            first_from: fit::first_from(&used),
            per_std: used.iter().map(|c| [1.0 / c.range_std_m, 1.0 / c.range_rate_std_mps]).collect(),
            widest_m: used.iter().map(|c| c.range_std_m).fold(0.0, f64::max),
            cells: used,
            s,
            prior_mean: [0.0, 0.0, 0.0, start_mean, 0.5 * left, 0.5 * right, speed_mean],
            prior_std: [s.max_offset_m, s.max_heading_rad, k, start_std, left, right, speed_std],
            is_free: [true, true, true, start_free, true, true, speed_std > 0.0],
            speeds,
        })
    }

    /// Lanes from the whole search range.
    fn search(&self, blots: &Blots) -> Result<Modes, LaneError> {
        /// Trials of all bends, each of a lane with its straight part.
        const ROUNDS: usize = 4;
        let mut starts: Modes = Vec::new();
        for p in self.grid(&self.speeds) {
            starts.push(self.phased(blots, &p));
            if !self.s.has_equal_spacings() {
                starts.push(self.phased(blots, &mirrored(&p)));
            }
        }
        starts.sort_by(|a, b| b.0.total_cmp(&a.0));
        // Without an offset the grid holds the mirrored lane as well.
        starts.dedup_by(|a, b| a.1 == b.1);
        let mut modes = Vec::new();
        for (_, p) in starts.iter().take(10) {
            self.try_from(*p, &mut modes);
        }
        let none = unexplained(0.0, self.cells.len());
        let first = *modes.first().ok_or(none)?;
        let other_straights = modes.clone();
        let mut rounds = ROUNDS;
        self.bend(blots, first, &mut rounds, &mut modes);
        // Cells are left over: a bend may have drawn the straight part aside, so other straight parts get
        // their turn.
        let mut tried = vec![first.1];
        for (value, p) in other_straights {
            let share = self.shares(&modes[0].1).iter().sum::<f64>() / self.cells.len() as f64;
            if share > 1.0 - 2.0 * self.s.extra_share || rounds == 0 {
                break;
            }
            let is_new =
                |q: &Vector| (p[OFFSET] - q[OFFSET]).abs() > 0.3 || (p[HEADING] - q[HEADING]).abs() > 0.05;
            if tried.iter().all(is_new) {
                tried.push(p);
                self.bend(blots, (value, p), &mut rounds, &mut modes);
            }
        }
        Ok(modes)
    }

    /// Adds lanes with other bends as long as they improve on `from`.
    fn bend(&self, blots: &Blots, from: (f64, Vector), rounds: &mut usize, modes: &mut Modes) {
        /// A gain of log likelihood that is none.
        const SAME: f64 = 0.05;
        let mut best = from;
        while *rounds > 0 {
            *rounds -= 1;
            let mut found = vec![best];
            for q in self.other_bends(blots, &best.1) {
                self.try_from(q, &mut found);
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

    /// Returns the best of these lanes, its certainty, and the lane for which it may be mistaken.
    fn conclude(&self, blots: &Blots, mut modes: Modes) -> Result<LaneFromMap, LaneError> {
        let settings = self.s;
        let none = unexplained(0.0, self.cells.len());
        let best = modes.first().ok_or(none)?.1;
        // The mirrored lane of the best is always tried, so that a sign is never known only for lack of a
        // trial.
        self.try_from(self.phased(blots, &mirrored(&best)).1, &mut modes);
        let (mut log_likelihood, mut p) = modes[0];
        let mut rivals = modes;
        if rivals[0].1 != best {
            // The mirrored one won: try back.
            self.try_from(self.phased(blots, &mirrored(&p)).1, &mut rivals);
            (log_likelihood, p) = rivals[0];
        }
        let explained: f64 = self.shares(&p).iter().sum();
        if explained.is_nan() || explained < 0.5 * self.cells.len() as f64 {
            return Err(unexplained(explained, self.cells.len()));
        }
        let covariance = self.covariance(&p);
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
        // A straight lane has no start of its bend.
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

#[cfg(test)]
mod tests;
