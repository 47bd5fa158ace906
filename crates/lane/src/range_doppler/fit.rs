//! The likelihood of a lane, its maximum and its curvature there.

use super::cells::Cell;
use super::lane::*;
use super::marker_rows::Marker;
use crate::matrix::solve;
use glam::DVec2;
use std::f64::consts::TAU;

/// A cell and a marker near it.
#[derive(Clone, Copy)]
struct Near {
    cell: usize,
    marker: usize,
    density: f64,
    /// Residuals divided by their variances.
    range: f64,
    rate: f64,
}

/// Number of standard deviations beyond which densities count as zero.
const REACH: f64 = 6.0;
/// Step of range of [`Fit::first_from`], m.
const FIRST_STEP_M: f64 = 0.25;

/// Prepared cells, and the assumptions about the lane.
pub(super) struct Fit<'a> {
    /// Cells sorted by range.
    pub(super) cells: Vec<Cell>,
    /// Reciprocals of each cell's standard deviations: range and range rate.
    pub(super) per_std: Vec<[f64; 2]>,
    /// Index of the first cell from each step of range on.
    pub(super) first_from: Vec<usize>,
    pub(super) widest_m: f64,
    pub(super) s: &'a LaneSettings,
    /// Density of cells that are not markers, per metre and per m/s.
    pub(super) extra: f64,
    pub(super) prior_mean: Vector,
    pub(super) prior_std: Vector,
    pub(super) is_free: [bool; VALUES],
    /// Speeds that the search tries, m/s.
    pub(super) speeds: Vec<f64>,
}

/// Computes [`Fit::first_from`] for cells sorted by range.
pub(super) fn first_from(cells: &[Cell]) -> Vec<usize> {
    let last = cells.last().map_or(0.0, |c| c.range_m);
    let steps = (last / FIRST_STEP_M).ceil() as usize + 1;
    (0..steps).map(|i| cells.partition_point(|c| c.range_m < FIRST_STEP_M * i as f64)).collect()
}

impl Fit<'_> {
    pub(super) fn markers(&self, p: &Vector, out: &mut Vec<Marker>) {
        out.clear();
        self.s.row(p, true, p[LEFT], |m| out.push(m));
        self.s.row(p, false, p[RIGHT], |m| out.push(m));
    }

    /// Index of a cell at or slightly before the first one at this range or beyond.
    pub(super) fn first(&self, range_m: f64) -> usize {
        let step = (range_m.max(0.0) / FIRST_STEP_M) as usize;
        self.first_from.get(step).copied().unwrap_or(self.cells.len())
    }

    /// Calls `each` for every cell near a marker with the density of the marker's cells there and the
    /// residuals of range and range rate divided by their standard deviations.
    pub(super) fn near(&self, m: &Marker, widen: f64, mut each: impl FnMut(usize, f64, f64, f64)) {
        let reach = REACH * widen * self.widest_m;
        let (low, high) = (m.range - reach, m.range + reach);
        let (narrow, peak) = (1.0 / widen, self.s.detection_probability / TAU);
        for (i, c) in self.cells.iter().enumerate().skip(self.first(low)) {
            if c.range_m < low {
                continue;
            }
            if c.range_m > high {
                break;
            }
            let [sr, sv] = self.per_std[i].map(|s| s * narrow);
            let (er, ev) = ((c.range_m - m.range) * sr, (c.range_rate_mps - m.rate) * sv);
            let chi2 = er * er + ev * ev;
            if chi2 < REACH * REACH {
                each(i, peak * sr * sv * (-0.5 * chi2).exp(), er * sr, ev * sv);
            }
        }
    }

    pub(super) fn log_prior(&self, p: &Vector) -> f64 {
        (0..VALUES)
            .filter(|i| self.is_free[*i])
            .map(|i| -0.5 * ((p[i] - self.prior_mean[i]) / self.prior_std[i]).powi(2))
            .sum()
    }

    /// Computes the density of markers in each cell; returns the number of markers in view.
    fn density(&self, p: &Vector, widen: f64, out: &mut Vec<f64>) -> usize {
        out.clear();
        out.resize(self.cells.len(), 0.0);
        let mut count = 0;
        for (is_left, phase) in [(true, p[LEFT]), (false, p[RIGHT])] {
            self.s.row(p, is_left, phase, |m| {
                count += 1;
                self.near(&m, widen, |i, density, _, _| out[i] += density);
            });
        }
        count
    }

    /// Log-likelihood without the expected number of markers, which jumps where one enters the view.
    /// `scratch` avoids an allocation.
    pub(super) fn smooth_log_likelihood(&self, p: &Vector, widen: f64, scratch: &mut Vec<f64>) -> f64 {
        self.density(p, widen, scratch);
        // Products of a few cells stay in range and save logarithms.
        let of_few = |d: &[f64]| d.iter().map(|d| self.extra + d).product::<f64>().ln();
        scratch.chunks(8).map(of_few).sum::<f64>() + self.log_prior(p)
    }

    pub(super) fn log_likelihood(&self, p: &Vector) -> f64 {
        let mut density = Vec::new();
        let count = self.density(p, 1.0, &mut density);
        density.iter().map(|d| (self.extra + d).ln()).sum::<f64>() + self.log_prior(p)
            - self.s.detection_probability * count as f64
    }

    /// Probability of each cell that it is a marker.
    pub(super) fn shares(&self, p: &Vector) -> Vec<f64> {
        let mut density = Vec::new();
        self.density(p, 1.0, &mut density);
        density.iter().map(|d| d / (d + self.extra)).collect()
    }

    /// Derivatives of a marker's range and range rate with respect to the values.
    fn slopes(&self, p: &Vector, m: &Marker) -> [Vector; 2] {
        let motion = DVec2::from_angle(p[HEADING]);
        let v = p[SPEED];
        let cos = m.unit.dot(motion);
        // A displacement of the marker changes the range along the line of sight and the rate by the turn of
        // that line.
        let moved = |d: DVec2| {
            let range = m.unit.dot(d);
            [range, -v * (motion.dot(d) - cos * range) / m.range.max(1e-9)]
        };
        let mut out = [[0.0; VALUES]; 2];
        let mut set = |i: usize, slope: [f64; 2]| {
            if self.is_free[i] {
                (out[0][i], out[1][i]) = (slope[0], slope[1]);
            }
        };
        set(OFFSET, moved(DVec2::NEG_Y));
        set(HEADING, [0.0, -v * m.unit.dot(motion.perp())]);
        set(SPEED, [0.0, -cos]);
        let is_straight = m.u <= p[START];
        const BEND_STEP: f64 = 1e-6;
        let (k, start) = (p[CURVATURE], p[START]);
        let way = if is_straight { DVec2::X } else { self.s.way(m.is_left, m.u, k, start) };
        set(if m.is_left { LEFT } else { RIGHT }, moved(way));
        if !is_straight {
            let bent = self.s.row_m(m.is_left, m.u, k + BEND_STEP, start);
            let less = self.s.row_m(m.is_left, m.u, k - BEND_STEP, start);
            set(CURVATURE, moved((bent - less) / (2.0 * BEND_STEP)));
            // The arc moves along with its start.
            set(START, moved(DVec2::X - way));
        }
        out
    }

    /// Gradient of the log-likelihood and its Gauss-Newton information matrix.
    fn gradient(&self, p: &Vector, widen: f64) -> (Vector, Matrix) {
        let mut markers = Vec::with_capacity(128);
        self.markers(p, &mut markers);
        let mut sums = vec![self.extra; self.cells.len()];
        let mut close: Vec<Near> = Vec::with_capacity(256);
        for (marker, m) in markers.iter().enumerate() {
            self.near(m, widen, |cell, density, range, rate| {
                sums[cell] += density;
                close.push(Near { cell, marker, density, range, rate });
            });
        }
        let mut g = [0.0; VALUES];
        let mut info = [[0.0; VALUES]; VALUES];
        let mut slopes = (usize::MAX, [[0.0; VALUES]; 2]);
        for n in &close {
            let share = n.density / sums[n.cell];
            if share < 1e-6 {
                continue;
            }
            if slopes.0 != n.marker {
                slopes = (n.marker, self.slopes(p, &markers[n.marker]));
            }
            let (j, c) = (&slopes.1, &self.cells[n.cell]);
            let weights =
                [share / (c.range_std_m * widen).powi(2), share / (c.range_rate_std_mps * widen).powi(2)];
            for a in 0..VALUES {
                g[a] += share * (j[0][a] * n.range + j[1][a] * n.rate);
                for b in 0..=a {
                    info[a][b] += weights[0] * j[0][a] * j[0][b] + weights[1] * j[1][a] * j[1][b];
                }
            }
        }
        // The upper half mirrors the lower one.
        let lower = info;
        for (b, row) in info.iter_mut().enumerate() {
            row.iter_mut().enumerate().skip(b + 1).for_each(|(a, v)| *v = lower[a][b]);
        }
        for i in 0..VALUES {
            if self.is_free[i] {
                g[i] -= (p[i] - self.prior_mean[i]) / self.prior_std[i].powi(2);
                info[i][i] += self.prior_std[i].powi(-2);
            } else {
                // Keeps the matrix regular; the step along it is zero.
                info[i][i] = 1.0;
            }
        }
        (g, info)
    }

    pub(super) fn clamped(&self, p: Vector) -> Vector {
        let mut p = p;
        // A little beyond the search limits, so that a value at its limit is found without bias.
        p[OFFSET] = p[OFFSET].clamp(-1.2 * self.s.max_offset_m, 1.2 * self.s.max_offset_m);
        p[HEADING] = p[HEADING].clamp(-1.2 * self.s.max_heading_rad, 1.2 * self.s.max_heading_rad);
        let k = 1.1 / self.s.min_radius_m;
        // The inner row keeps a positive radius.
        let k = k.min(1.9 / self.s.lane_width_m);
        p[CURVATURE] = p[CURVATURE].clamp(-k, k);
        if let CurveStart::UpTo(m) = self.s.curve_start {
            p[START] = p[START].clamp(0.0, m);
        }
        p
    }

    /// Adds the local maximum of the likelihood near `start`; the best comes first.
    pub(super) fn try_from(&self, start: Vector, modes: &mut Vec<(f64, Vector)>) {
        let q = self.refine(start);
        modes.push((self.log_likelihood(&q), q));
        modes.sort_by(|a, b| b.0.total_cmp(&a.0));
    }

    /// Levenberg-Marquardt on the log-likelihood, first with wide cells.
    pub(super) fn refine(&self, start: Vector) -> Vector {
        let mut p = self.clamped(start);
        let mut scratch = Vec::with_capacity(self.cells.len());
        for (widen, rounds) in [(4.0, 6), (2.0, 6), (1.0, 20)] {
            let mut best = self.smooth_log_likelihood(&p, widen, &mut scratch);
            let mut damping = 1e-3;
            for _ in 0..rounds {
                let (g, info) = self.gradient(&p, widen);
                let mut gain = 0.0;
                while damping < 1e6 {
                    let mut m = info;
                    for (i, row) in m.iter_mut().enumerate() {
                        row[i] *= 1.0 + damping;
                    }
                    let Some(step) = solve(&m, &g) else {
                        damping *= 10.0;
                        continue;
                    };
                    let mut q = p;
                    for i in 0..VALUES {
                        q[i] += step[i];
                    }
                    let q = self.clamped(q);
                    let value = self.smooth_log_likelihood(&q, widen, &mut scratch);
                    if value > best {
                        gain = value - best;
                        (p, best) = (q, value);
                        damping = (damping * 0.2).max(1e-9);
                        break;
                    }
                    damping *= 6.0;
                }
                if gain < 1e-7 {
                    break;
                }
            }
        }
        p
    }

    /// Inverse of the observed information, which is the change of the gradient. Where that is not positive
    /// (a kink at the start of the bend), the Gauss-Newton matrix is used.
    #[allow(clippy::needless_range_loop, reason = "rows and columns by index")]
    pub(super) fn covariance(&self, p: &Vector) -> Matrix {
        let (_, gauss) = self.gradient(p, 1.0);
        let mut observed = [[0.0; VALUES]; VALUES];
        for i in 0..VALUES {
            if !self.is_free[i] {
                observed[i][i] = 1.0;
                continue;
            }
            let step = 0.1 / gauss[i][i].sqrt();
            let (mut low, mut high) = (*p, *p);
            low[i] -= step;
            high[i] += step;
            let (a, b) = (self.gradient(&low, 1.0).0, self.gradient(&high, 1.0).0);
            for j in 0..VALUES {
                observed[i][j] += 0.25 * (a[j] - b[j]) / step;
                observed[j][i] += 0.25 * (a[j] - b[j]) / step;
            }
        }
        let mut out = inverse(&observed).or_else(|| inverse(&gauss)).unwrap_or([[0.0; VALUES]; VALUES]);
        for i in 0..VALUES {
            if !self.is_free[i] {
                for j in 0..VALUES {
                    out[i][j] = 0.0;
                    out[j][i] = 0.0;
                }
                out[i][i] = self.prior_std[i].powi(2);
            } else if out[i][i].is_nan() || out[i][i] <= 0.0 {
                out[i][i] = self.prior_std[i].powi(2);
            }
        }
        out
    }
}

fn inverse(m: &Matrix) -> Option<Matrix> {
    let unit = |i: usize| std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 });
    let columns = (0..VALUES).map(|i| solve(m, &unit(i))).collect::<Option<Vec<Vector>>>()?;
    Some(std::array::from_fn(|j| std::array::from_fn(|i| columns[i][j])))
}
