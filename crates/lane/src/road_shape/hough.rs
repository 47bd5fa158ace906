//! Hough transform of stationary points into (a, b) of y = a x² + b (Miyake, eq. 23, 24 and Fig. 4).

use super::{Side, StaticPoint};
use crate::error::{LaneError, Result, not_negative, positive};
use crate::matrix::{inverse, quadratic};
use serde::{Deserialize, Serialize};
use statrs::function::gamma::gamma_lr;

/// Settings of the vote.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HoughSettings {
    /// Largest magnitude of a that the cells cover, 1/m; a = 1/(2 R).
    pub a_max_per_m: f64,
    /// Width of a cell in a, 1/m.
    pub a_step_per_m: f64,
    /// Least distance of an edge from the vehicle's x axis, on either side, m.
    pub b_min_m: f64,
    /// Greatest distance of an edge from the vehicle's x axis, m.
    pub b_max_m: f64,
    /// Width of a cell in b, m.
    pub b_step_m: f64,
    /// Least distance ahead of points that are used, m.
    pub x_min_m: f64,
    /// Largest distance ahead of points that are used, m: beyond it a clothoid is no parabola.
    pub x_max_m: f64,
    /// Exponent of the power: a vote is (power / median power)^exponent divided by the point's standard
    /// deviation; 0 ignores power.
    pub power_exponent: f64,
    /// The power's factor is limited to 1/cap to cap, so that no single echo decides.
    pub power_cap: f64,
    /// Roughness of a wall, added to each point's standard deviation, m.
    pub floor_std_m: f64,
    /// Number of points in a cell of 2 m by 2 m above which they share their votes: a parked car is no wall.
    pub crowd: usize,
    /// Least number of points within 3 standard deviations of an edge.
    pub min_points: usize,
    /// Least stretch of road that these points cover, m.
    pub min_extent_m: f64,
    /// Least number of different stretches of 5 m in which these points lie.
    pub min_stretches: usize,
    /// Largest expected number of edges per scan that randomly scattered points would show.
    pub false_edges: f64,
    /// Share of the greatest vote: among curves at least `clearance_m` apart all along, the innermost one
    /// with this share is the edge, as what lies behind it is a mirror image or another road.
    pub inner_share: f64,
    /// Least distance all along between two curves that count as different, m.
    pub clearance_m: f64,
}

impl Default for HoughSettings {
    fn default() -> Self {
        Self {
            a_max_per_m: 0.0125,
            a_step_per_m: 1.25e-4,
            b_min_m: 1.0,
            b_max_m: 20.0,
            b_step_m: 0.25,
            x_min_m: 0.0,
            x_max_m: 90.0,
            power_exponent: 0.25,
            power_cap: 3.0,
            floor_std_m: 0.1,
            crowd: 1,
            min_points: 6,
            min_extent_m: 15.0,
            min_stretches: 4,
            false_edges: 0.01,
            inner_share: 0.6,
            clearance_m: 2.0,
        }
    }
}

impl HoughSettings {
    /// Checks every setting.
    ///
    /// # Errors
    /// Returns an error for the first setting outside its range.
    pub fn validate(&self) -> Result<()> {
        positive("a_max_per_m", self.a_max_per_m)?;
        positive("a_step_per_m", self.a_step_per_m)?;
        not_negative("b_min_m", self.b_min_m)?;
        positive("b_max_m - b_min_m", self.b_max_m - self.b_min_m)?;
        positive("b_step_m", self.b_step_m)?;
        positive("x_max_m - x_min_m", self.x_max_m - self.x_min_m)?;
        positive("floor_std_m", self.floor_std_m)?;
        not_negative("power_exponent", self.power_exponent)?;
        positive("false_edges", self.false_edges)?;
        positive("inner_share", self.inner_share)?;
        not_negative("clearance_m", self.clearance_m)?;
        not_negative("min_extent_m", self.min_extent_m)?;
        let bad = |what, value, allowed| Err(LaneError::out_of_range(what, value, allowed));
        if !(self.power_cap >= 1.0 && self.power_cap.is_finite()) {
            return bad("power_cap", self.power_cap, "1 or more");
        }
        if self.a_max_per_m > 1.0 || self.a_max_per_m / self.a_step_per_m > 2000.0 {
            return bad("a_max_per_m", self.a_max_per_m, "up to 1, and up to 2000 steps");
        }
        if self.b_max_m / self.b_step_m > 4000.0 {
            return bad("b_max_m", self.b_max_m, "up to 4000 steps");
        }
        Ok(())
    }
}

/// The distance between the edges, where it is known beforehand.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RoadWidth {
    /// Mean of the distance between the edges, m.
    pub mean_m: f64,
    /// Standard deviation of the distance between the edges, m.
    pub std_m: f64,
}

/// An edge found by the vote.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct EdgePeak {
    /// The side of the vehicle on which the edge lies.
    pub side: Side,
    /// Half the curvature, 1/m, positive to the left.
    pub a_per_m: f64,
    /// Place of the edge beside the vehicle, m, positive to the left.
    pub b_m: f64,
    /// Covariance of (a, b), in units 1/m², 1, 1, m².
    pub covariance: [[f64; 2]; 2],
    /// Votes at the peak's cell.
    pub votes: f64,
    /// Number of points within three standard deviations.
    pub points: usize,
    /// Distance ahead of the first of them, m.
    pub x_min_m: f64,
    /// Distance ahead of the last of them, m.
    pub x_max_m: f64,
}

/// A pair of parallel edges found by the vote, at cell centres, left first.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ParallelPeak {
    /// Half the curvature of each edge, 1/m, positive to the left.
    pub a_per_m: [f64; 2],
    /// Place of each edge beside the vehicle, m, positive to the left.
    pub b_m: [f64; 2],
    /// Number of points within three standard deviations of each.
    pub points: [usize; 2],
    /// Sum of the votes of both sides, multiplied by the agreement with the width.
    pub votes: f64,
}

struct Voter {
    x: f64,
    y: f64,
    covariance: [f64; 3],
    weight: f64,
    /// Weight of the point within a crowd.
    share: f64,
}

impl Voter {
    /// Variance of y − a x², including the floor.
    fn variance(&self, a: f64, floor: f64) -> f64 {
        let slope = 2.0 * a * self.x;
        let [xx, xy, yy] = self.covariance;
        yy - 2.0 * slope * xy + slope * slope * xx + floor * floor
    }
}

/// Votes over both sides: columns are a, rows are b.
pub struct VoteMap {
    settings: HoughSettings,
    voters: Vec<Voter>,
    columns: usize,
    rows: usize,
    /// `votes[side][column * rows + row]`, in 1/m.
    votes: [Vec<f64>; 2],
    /// `explained[side][point]`: belongs to the other side's edge.
    explained: [Vec<bool>; 2],
}

impl VoteMap {
    /// Lets each point vote along its line b = y − a x² (Miyake eq. 24), with a Gaussian across it as wide as
    /// the point's standard deviation and the cell; its height is proportional to weight over standard
    /// deviation.
    ///
    /// # Errors
    /// Returns an error for an invalid setting, or if no point lies within the limits.
    pub fn new(points: &[StaticPoint], settings: &HoughSettings) -> Result<Self> {
        settings.validate()?;
        let voters = voters(points, settings);
        if voters.is_empty() {
            return Err(LaneError::too_few("points", 0, settings.min_points));
        }
        let half = (settings.a_max_per_m / settings.a_step_per_m).floor() as usize;
        let columns = 2 * half + 1;
        let rows = ((settings.b_max_m - settings.b_min_m) / settings.b_step_m).floor() as usize + 1;
        let count = voters.len();
        let mut map = Self {
            settings: settings.clone(),
            voters,
            columns,
            rows,
            votes: [vec![0.0; columns * rows], vec![0.0; columns * rows]],
            explained: [vec![false; count], vec![false; count]],
        };
        for column in 0..columns {
            let a = map.a_per_m(column);
            for v in &map.voters {
                let b = v.y - a * v.x * v.x;
                let side = if b >= 0.0 { Side::Left } else { Side::Right };
                let reach = settings.a_step_per_m * v.x * v.x;
                let variance =
                    v.variance(a, settings.floor_std_m) + (settings.b_step_m.powi(2) + reach * reach) / 12.0;
                let std = variance.sqrt();
                let centre = (b.abs() - settings.b_min_m) / settings.b_step_m;
                let span = 3.0 * std / settings.b_step_m;
                if !(centre + span >= 0.0 && centre - span <= (rows - 1) as f64) {
                    continue;
                }
                let (first, last) = ((centre - span).max(0.0).ceil(), (centre + span).min((rows - 1) as f64));
                let height = v.weight / std;
                let cells = &mut map.votes[side.index()][column * rows..(column + 1) * rows];
                // A Gaussian on even steps: each value is the last one times a factor that shrinks evenly.
                let off = (first - centre) * settings.b_step_m;
                let h = settings.b_step_m;
                let mut value = height * (-0.5 * off * off / variance).exp();
                let mut factor = (-(off + 0.5 * h) * h / variance).exp();
                let shrink = (-h * h / variance).exp();
                for cell in cells.iter_mut().take(last as usize + 1).skip(first as usize) {
                    *cell += value;
                    value *= factor;
                    factor *= shrink;
                }
            }
        }
        let tops = Side::BOTH.map(|side| {
            let (column, row, _) = map.maxima(side).first().copied()?;
            let (a, b) = (map.a_per_m(column), map.b_m(side, row));
            map.support(side, a, b).is_ok().then_some((a, b))
        });
        for (i, top) in tops.iter().enumerate() {
            let Some((a, b)) = *top else { continue };
            map.explained[1 - i] = map
                .voters
                .iter()
                .map(|v| {
                    let (off, variance) = map.offset(v, a, b);
                    off * off <= 9.0 * variance
                })
                .collect();
        }
        Ok(map)
    }

    /// Number of columns: cells of a.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Number of rows: cells of b.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Value of a at the centre of a column, 1/m.
    pub fn a_per_m(&self, column: usize) -> f64 {
        (column as f64 - (self.columns / 2) as f64) * self.settings.a_step_per_m
    }

    /// Value of b at the centre of a row, m; negative on the right.
    pub fn b_m(&self, side: Side, row: usize) -> f64 {
        side.sign() * (self.settings.b_min_m + row as f64 * self.settings.b_step_m)
    }

    /// Votes of one side, indexed by `[column * rows() + row]`.
    pub fn votes(&self, side: Side) -> &[f64] {
        &self.votes[side.index()]
    }

    /// Finds the edge on one side.
    ///
    /// # Errors
    /// Returns an error if no curve has the points, the extent and the stretches that the settings require.
    pub fn edge(&self, side: Side) -> Result<EdgePeak> {
        let mut maxima = self.maxima(side);
        maxima.retain(|(column, row, _)| {
            self.support(side, self.a_per_m(*column), self.b_m(side, *row)).is_ok()
        });
        let Some(top) = maxima.first().copied() else {
            return Err(self.why_none(side));
        };
        let reach = self.voters.iter().fold(0.0_f64, |m, v| m.max(v.x));
        let at = |(column, row, _): Maximum, x: f64| {
            side.sign() * (self.b_m(side, row) + self.a_per_m(column) * x * x)
        };
        let mut chosen = top;
        for m in &maxima {
            let inside = [0.0, 0.4, 0.7]
                .iter()
                .all(|f| at(*m, f * reach) + self.settings.clearance_m <= at(chosen, f * reach));
            if inside && m.2 >= self.settings.inner_share * top.2 {
                chosen = *m;
            }
        }
        self.refine(side, chosen)
    }

    /// Finds both edges with one reference curve: at distance b from a curve of curvature c the curvature is
    /// c/(1 − b c). The votes of the two sides are added along it, weighted by how well b_left − b_right
    /// agrees with `width` where that is known, and the best pair is taken.
    ///
    /// One edge must have the support that [`Self::edge`] requires, the other at least two points.
    ///
    /// # Errors
    /// Returns an error if the edges lack this support, or if `width` is not positive.
    pub fn parallel_edges(&self, width: Option<&RoadWidth>) -> Result<ParallelPeak> {
        let agreement: Vec<f64> = match width {
            Some(w) => {
                positive("road width", w.mean_m)?;
                positive("deviation of the road width", w.std_m)?;
                (0..2 * self.rows)
                    .map(|sum| {
                        let found = 2.0 * self.settings.b_min_m + sum as f64 * self.settings.b_step_m;
                        (-0.5 * ((found - w.mean_m) / w.std_m).powi(2)).exp()
                    })
                    .collect()
            }
            None => vec![1.0; 2 * self.rows],
        };
        // Inner edges first: mirror images behind a wall are parallel as well.
        let edges = Side::BOTH.map(|side| self.edge(side));
        let outermost = Side::BOTH.map(|side| match &edges[side.index()] {
            Ok(e) => (e.b_m.abs() + self.settings.clearance_m, e.votes),
            Err(_) => (f64::INFINITY, f64::INFINITY),
        });
        let mut best: Option<([Maximum; 2], f64)> = None;
        for column in 0..self.columns {
            let a = self.a_per_m(column);
            let lines = Side::BOTH.map(|side| {
                (0..self.rows)
                    .map(|row| {
                        let b = self.b_m(side, row);
                        let at = (a / (1.0 - 2.0 * a * b)) / self.settings.a_step_per_m
                            + (self.columns / 2) as f64;
                        let behind = width.is_none() && b.abs() > outermost[side.index()].0;
                        if !(at >= 0.0 && at <= (self.columns - 1) as f64) || behind {
                            return (0, 0.0);
                        }
                        let near = at.round() as usize;
                        (near, self.votes[side.index()][near * self.rows + row])
                    })
                    .collect::<Vec<_>>()
            });
            for (i, l) in lines[0].iter().enumerate().filter(|(_, l)| l.1 > 0.0) {
                for (j, r) in lines[1].iter().enumerate().filter(|(_, r)| r.1 > 0.0) {
                    let sum = (l.1 + r.1) * agreement[i + j];
                    if best.as_ref().is_none_or(|b| sum > b.1) {
                        best = Some(([(l.0, i, l.1), (r.0, j, r.1)], sum));
                    }
                }
            }
        }
        let Some((cells, votes)) = best else {
            return Err(self.why_none(if edges[0].is_err() { Side::Left } else { Side::Right }));
        };
        let a_per_m = Side::BOTH.map(|side| self.a_per_m(cells[side.index()].0));
        let b_m = Side::BOTH.map(|side| self.b_m(side, cells[side.index()].1));
        let points = [0, 1].map(|i| self.near(a_per_m[i], b_m[i]).0);
        let support = Side::BOTH.map(|side| self.support(side, a_per_m[side.index()], b_m[side.index()]));
        if let [Err(reason), Err(_)] = &support {
            return Err(reason.clone());
        }
        if let Some(found) = points.into_iter().find(|n| *n < 2) {
            return Err(LaneError::too_few("points", found, 2));
        }
        Ok(ParallelPeak { a_per_m, b_m, points, votes })
    }

    /// Local maxima of a side, greatest first.
    fn maxima(&self, side: Side) -> Vec<Maximum> {
        let votes = self.votes(side);
        let mut found = Vec::new();
        for column in 0..self.columns {
            for row in 0..self.rows {
                let v = votes[column * self.rows + row];
                if v <= 0.0 {
                    continue;
                }
                let columns = column.saturating_sub(1)..(column + 2).min(self.columns);
                let top = columns
                    .flat_map(|c| (row.saturating_sub(1)..(row + 2).min(self.rows)).map(move |r| (c, r)));
                // Of equal neighbours the first counts.
                let is_top = top.into_iter().filter(|n| *n != (column, row)).all(|(c, r)| {
                    let n = votes[c * self.rows + r];
                    n < v || (n == v && (c, r) > (column, row))
                });
                if is_top {
                    found.push((column, row, v));
                }
            }
        }
        found.sort_by(|p, q| q.2.total_cmp(&p.2).then((p.0, p.1).cmp(&(q.0, q.1))));
        let least = found.first().map_or(0.0, |f| 0.3 * f.2);
        found.retain(|f| f.2 >= least);
        found.truncate(64);
        found
    }

    /// Points within three standard deviations of a curve: their number, their first and last distance ahead,
    /// and the number of stretches.
    fn near(&self, a: f64, b: f64) -> (usize, f64, f64, usize) {
        let (mut count, mut least, mut greatest) = (0, f64::INFINITY, f64::NEG_INFINITY);
        let mut stretches: Vec<i64> = Vec::new();
        for v in &self.voters {
            let (off, variance) = self.offset(v, a, b);
            if off * off <= 9.0 * variance {
                count += 1;
                least = least.min(v.x);
                greatest = greatest.max(v.x);
                stretches.push((v.x / 5.0).floor() as i64);
            }
        }
        stretches.sort_unstable();
        stretches.dedup();
        (count, least, greatest, stretches.len())
    }

    /// The result of [`Self::near`], or an error where that is not enough.
    fn support(&self, side: Side, a: f64, b: f64) -> Result<(usize, f64, f64)> {
        let s = &self.settings;
        let (count, least, greatest, stretches) = self.near(a, b);
        if count < s.min_points {
            return Err(LaneError::too_few("points", count, s.min_points));
        }
        if greatest - least < s.min_extent_m || stretches < s.min_stretches {
            return Err(too_short(
                (greatest - least).min(5.0 * stretches as f64),
                s.min_extent_m.max(5.0 * s.min_stretches as f64),
            ));
        }
        self.more_than_chance(side, a, b)?;
        Ok((count, least, greatest))
    }

    /// Compares the number of points within two standard deviations with the number expected if each had a
    /// random y within ±`b_max_m` (a contrario, Desolneux, Moisan and Morel 2000): a Poisson test for each
    /// independent place of the map (16 cells). Points of the other side's edge do not count as random.
    fn more_than_chance(&self, side: Side, a: f64, b: f64) -> Result<()> {
        let s = &self.settings;
        let (mut found, mut expected) = (0.0, 0.0);
        for (v, _) in self.voters.iter().zip(&self.explained[side.index()]).filter(|(_, e)| !**e) {
            let (off, variance) = self.offset(v, a, b);
            expected += v.share * (2.0 * variance.sqrt() / s.b_max_m).min(1.0);
            if off * off <= 4.0 * variance {
                found += v.share;
            }
        }
        let tests = (self.columns * self.rows) as f64 / 16.0;
        if found > expected && tests * poisson_tail(found, expected) <= s.false_edges {
            Ok(())
        } else {
            Err(LaneError::refused(format!(
                "the best curve has {found:.1} points, too few, because chance gives {expected:.1}"
            )))
        }
    }

    /// Value y − a x² − b of a point, and its variance including half a cell.
    fn offset(&self, v: &Voter, a: f64, b: f64) -> (f64, f64) {
        let reach = 0.5 * (self.settings.a_step_per_m * v.x * v.x + self.settings.b_step_m);
        (v.y - a * v.x * v.x - b, v.variance(a, self.settings.floor_std_m) + reach * reach)
    }

    fn why_none(&self, side: Side) -> LaneError {
        let top = self.maxima(side).first().copied();
        match top.map(|(column, row, _)| self.support(side, self.a_per_m(column), self.b_m(side, row))) {
            Some(Err(reason)) => reason,
            _ => unsupported(side),
        }
    }

    /// Refines the peak between the cells by climbing the sum of votes, and computes its covariance.
    ///
    /// The vote is an M-estimator with the loss 1 − exp(−r²/2σ²). The climb is reweighted least squares; the
    /// covariance is A⁻¹ B A⁻¹ with A the curvature of the vote and B the sum of squares of its slopes (Huber
    /// 1964), both as expected for Gaussian errors of the stated standard deviation. It is 1.54 times the
    /// least-squares one.
    fn refine(&self, side: Side, (column, row, votes): Maximum) -> Result<EdgePeak> {
        let s = &self.settings;
        let (a0, b0) = (self.a_per_m(column), self.b_m(side, row));
        let (mut a, mut b) = (a0, b0);
        let kernel = |v: &Voter, a: f64, b: f64| {
            let variance = v.variance(a, s.floor_std_m) + s.b_step_m.powi(2) / 12.0;
            let r = v.y - a * v.x * v.x - b;
            (v.weight / (variance * variance.sqrt()) * (-0.5 * r * r / variance).exp(), r, variance)
        };
        for _ in 0..50 {
            let (mut m, mut rhs) = ([[0.0; 2]; 2], [0.0; 2]);
            for v in &self.voters {
                let (k, r, _) = kernel(v, a, b);
                let j = [v.x * v.x, 1.0];
                for i in 0..2 {
                    rhs[i] += k * j[i] * r;
                    for l in 0..2 {
                        m[i][l] += k * j[i] * j[l];
                    }
                }
            }
            let Some(inv) = inverse(&m) else { return Err(LaneError::undetermined("the curve")) };
            let step = [inv[0][0] * rhs[0] + inv[0][1] * rhs[1], inv[1][0] * rhs[0] + inv[1][1] * rhs[1]];
            a += step[0];
            b += step[1];
            if step[0].abs() < 1e-3 * s.a_step_per_m && step[1].abs() < 1e-3 * s.b_step_m {
                break;
            }
        }
        // A climb that leaves the neighbourhood has no peak here.
        let reach = 10.0 * (s.a_step_per_m * s.x_max_m * s.x_max_m * 0.25 + s.b_step_m) + s.clearance_m;
        if !(a.abs() <= 1.1 * s.a_max_per_m && (b - b0).abs() <= reach && side.sign() * b >= 0.5 * s.b_min_m)
        {
            return Err(LaneError::refused("the fit left the range of allowed curves"));
        }
        let (points, x_min_m, x_max_m) = self.support(side, a, b)?;
        // Expected values of curvature and squared slope for Gaussian r of the deviation stated: those
        // of thirty points found are too uncertain.
        let (mut curvature, mut slopes) = ([[0.0; 2]; 2], [[0.0; 2]; 2]);
        let (bend, square) = (0.5 * 0.5_f64.sqrt(), (1.0_f64 / 3.0).powf(1.5));
        for v in &self.voters {
            let variance = v.variance(a, s.floor_std_m) + s.b_step_m.powi(2) / 12.0;
            let r = v.y - a * v.x * v.x - b;
            if r * r > 9.0 * variance {
                continue;
            }
            let k = v.weight / (variance * variance.sqrt());
            let j = [v.x * v.x, 1.0];
            for i in 0..2 {
                for l in 0..2 {
                    curvature[i][l] += bend * k * j[i] * j[l];
                    slopes[i][l] += square * k * k * variance * j[i] * j[l];
                }
            }
        }
        let Some(inv) = inverse(&curvature) else { return Err(LaneError::undetermined("the curve")) };
        let both = [inv[0][0] + inv[1][0], inv[0][1] + inv[1][1]];
        let (aa, bb) = (quadratic(&slopes, &inv[0]), quadratic(&slopes, &inv[1]));
        let ab = 0.5 * (quadratic(&slopes, &both) - aa - bb);
        Ok(EdgePeak {
            side,
            a_per_m: a,
            b_m: b,
            covariance: [[aa, ab], [ab, bb]],
            votes,
            points,
            x_min_m,
            x_max_m,
        })
    }
}

/// The error of a side without an edge.
pub(super) fn unsupported(side: Side) -> LaneError {
    LaneError::refused(format!("no curve on the {side} side has enough support"))
}

pub(super) fn too_short(extent_m: f64, needed_m: f64) -> LaneError {
    LaneError::refused(format!("the points cover {extent_m:.1} m of road where {needed_m:.1} m are needed"))
}

/// Column, row and votes of a cell.
type Maximum = (usize, usize, f64);

/// P(K ≥ k) of a Poisson variable, k rounded down.
fn poisson_tail(k: f64, mean: f64) -> f64 {
    match (k.floor() > 0.0, mean > 0.0) {
        (false, _) => 1.0,
        (true, false) => 0.0,
        (true, true) => gamma_lr(k.floor(), mean),
    }
}

fn voters(points: &[StaticPoint], s: &HoughSettings) -> Vec<Voter> {
    let used: Vec<&StaticPoint> = points
        .iter()
        .filter(|p| {
            let [xx, xy, yy] = p.covariance_m2;
            let finite = [p.x_m, p.y_m, p.power, xx, xy, yy].iter().all(|v| v.is_finite());
            finite
                && p.x_m >= s.x_min_m
                && p.x_m <= s.x_max_m
                && p.power > 0.0
                && xx >= 0.0
                && yy >= 0.0
                && xy * xy <= xx * yy * (1.0 + 1e-9)
        })
        .collect();
    let cell = |p: &StaticPoint| ((p.x_m / 2.0).floor() as i64, (p.y_m / 2.0).floor() as i64);
    let mut cells: Vec<(i64, i64)> = used.iter().map(|p| cell(p)).collect();
    cells.sort_unstable();
    let shares: Vec<f64> = used
        .iter()
        .map(|p| {
            let c = cell(p);
            let crowd = cells.partition_point(|d| *d <= c) - cells.partition_point(|d| *d < c);
            (s.crowd.max(1) as f64 / crowd as f64).min(1.0)
        })
        .collect();
    // The median power, a crowd counting by its share.
    let mut powers: Vec<(f64, f64)> = used.iter().map(|p| p.power).zip(shares.iter().copied()).collect();
    powers.sort_by(|p, q| p.0.total_cmp(&q.0).then(p.1.total_cmp(&q.1)));
    let mut left = 0.5 * shares.iter().sum::<f64>();
    let mut median = 1.0;
    for (power, share) in powers {
        median = power;
        left -= share;
        if left <= 0.0 {
            break;
        }
    }
    used.iter()
        .zip(shares)
        .map(|(p, share)| {
            let power = (p.power / median).powf(s.power_exponent).clamp(1.0 / s.power_cap, s.power_cap);
            Voter { x: p.x_m, y: p.y_m, covariance: p.covariance_m2, weight: share * power, share }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::poisson_tail;

    #[test]
    fn the_tail_is_poissons() {
        assert!((poisson_tail(0.0, 2.0) - 1.0).abs() < 1e-12);
        assert!((poisson_tail(1.0, 2.0) - (1.0 - (-2.0_f64).exp())).abs() < 1e-12);
        assert!((poisson_tail(3.9, 2.0) - (1.0 - 5.0 * (-2.0_f64).exp())).abs() < 1e-12);
        assert_eq!(poisson_tail(4.0, 0.0), 0.0);
    }
}
