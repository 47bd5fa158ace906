//! The likelihood of a lane, its top and its curvature there.

use super::*;

#[derive(Clone, Copy)]
pub(super) struct Marker {
    pub(super) is_left: bool,
    pub(super) index: f64,
    pub(super) range: f64,
    pub(super) rate: f64,
}

pub(super) struct Fit<'a> {
    pub(super) cells: &'a [Cell],
    pub(super) s: &'a LaneSettings,
    /// Density of cells that are no markers, per metre and m/s.
    pub(super) extra: f64,
    pub(super) prior_mean: Vector,
    pub(super) prior_std: Vector,
    pub(super) is_free: [bool; VALUES],
}

impl Fit<'_> {
    pub(super) fn marker(&self, p: &Vector, is_left: bool, index: f64) -> Marker {
        let phase = p[if is_left { LEFT } else { RIGHT }];
        let u = phase + index * self.s.spacing_m(is_left);
        let place = self.s.row_m(is_left, u, p[CURVATURE], p[START]);
        let (range, cos) = self.s.seen(place, p[OFFSET], p[HEADING]);
        Marker { is_left, index, range, rate: -p[SPEED] * cos }
    }

    pub(super) fn is_in_view(&self, m: &Marker, speed: f64) -> bool {
        m.range >= self.s.near_m
            && m.range <= self.s.far_m
            && -m.rate >= speed * self.s.half_view_rad.cos() - 1e-9
    }

    pub(super) fn markers(&self, p: &Vector) -> Vec<Marker> {
        let mut out = Vec::new();
        for is_left in [true, false] {
            let (phase, spacing) = (p[if is_left { LEFT } else { RIGHT }], self.s.spacing_m(is_left));
            let last = ((self.s.end_m(is_left, p[CURVATURE], p[START]) - phase) / spacing).floor();
            let mut index = ((-self.s.far_m - phase) / spacing).ceil();
            while index <= last {
                let m = self.marker(p, is_left, index);
                if self.is_in_view(&m, p[SPEED]) {
                    out.push(m);
                }
                index += 1.0;
            }
        }
        out.sort_by(|a, b| a.range.total_cmp(&b.range));
        out
    }

    /// Calls `each` with every marker near a cell and its density there.
    pub(super) fn near(
        &self,
        markers: &[Marker],
        c: &Cell,
        widen: f64,
        mut each: impl FnMut(usize, f64, f64, f64),
    ) -> f64 {
        let (sr, sv) = (c.range_std_m * widen, c.range_rate_std_mps * widen);
        let scale = self.s.detection_probability / (TAU * sr * sv);
        let first = markers.partition_point(|m| m.range < c.range_m - 6.0 * sr);
        let mut sum = 0.0;
        for (i, m) in markers.iter().enumerate().skip(first) {
            if m.range > c.range_m + 6.0 * sr {
                break;
            }
            let (er, ev) = ((c.range_m - m.range) / sr, (c.range_rate_mps - m.rate) / sv);
            let chi2 = er * er + ev * ev;
            if chi2 < 36.0 {
                let density = scale * (-0.5 * chi2).exp();
                sum += density;
                each(i, density, er / sr, ev / sv);
            }
        }
        sum
    }

    pub(super) fn log_prior(&self, p: &Vector) -> f64 {
        (0..VALUES)
            .filter(|i| self.is_free[*i])
            .map(|i| -0.5 * ((p[i] - self.prior_mean[i]) / self.prior_std[i]).powi(2))
            .sum()
    }

    /// Without the expected number of markers, which jumps where one enters the view.
    pub(super) fn smooth_log_likelihood(&self, p: &Vector, widen: f64) -> f64 {
        let markers = self.markers(p);
        let all = self.cells.iter();
        all.map(|c| (self.extra + self.near(&markers, c, widen, |_, _, _, _| ())).ln()).sum::<f64>()
            + self.log_prior(p)
    }

    pub(super) fn log_likelihood(&self, p: &Vector) -> f64 {
        self.smooth_log_likelihood(p, 1.0) - self.s.detection_probability * self.markers(p).len() as f64
    }

    pub(super) fn explained(&self, p: &Vector) -> f64 {
        let markers = self.markers(p);
        let all = self.cells.iter();
        all.map(|c| {
            let sum = self.near(&markers, c, 1.0, |_, _, _, _| ());
            sum / (sum + self.extra)
        })
        .sum()
    }

    /// Derivatives of a marker's range and range rate by the values.
    pub(super) fn slopes(&self, p: &Vector, m: &Marker) -> [Vector; 2] {
        const STEP: Vector = [1e-4, 1e-5, 1e-6, 1e-3, 1e-4, 1e-4, 1e-3];
        let mut out = [[0.0; VALUES]; 2];
        for i in 0..VALUES {
            let is_other_row = i == if m.is_left { RIGHT } else { LEFT };
            if !self.is_free[i] || is_other_row {
                continue;
            }
            let (mut low, mut high) = (*p, *p);
            low[i] -= STEP[i];
            high[i] += STEP[i];
            let a = self.marker(&low, m.is_left, m.index);
            let b = self.marker(&high, m.is_left, m.index);
            out[0][i] = 0.5 * (b.range - a.range) / STEP[i];
            out[1][i] = 0.5 * (b.rate - a.rate) / STEP[i];
        }
        out
    }

    /// Gradient of the log likelihood and its information in the manner of Gauss and Newton.
    pub(super) fn gradient(&self, p: &Vector, widen: f64) -> (Vector, Matrix) {
        let markers = self.markers(p);
        let mut slopes: Vec<Option<[Vector; 2]>> = vec![None; markers.len()];
        let mut g = [0.0; VALUES];
        let mut info = [[0.0; VALUES]; VALUES];
        let mut close = Vec::new();
        for c in self.cells {
            close.clear();
            let sum = self.extra + self.near(&markers, c, widen, |i, d, er, ev| close.push((i, d, er, ev)));
            let weights =
                [1.0 / (c.range_std_m * widen).powi(2), 1.0 / (c.range_rate_std_mps * widen).powi(2)];
            for (i, density, er, ev) in &close {
                let share = density / sum;
                if share < 1e-6 {
                    continue;
                }
                let j = slopes[*i].get_or_insert_with(|| self.slopes(p, &markers[*i]));
                for a in 0..VALUES {
                    g[a] += share * (j[0][a] * er + j[1][a] * ev);
                    for b in 0..VALUES {
                        info[a][b] +=
                            share * (weights[0] * j[0][a] * j[0][b] + weights[1] * j[1][a] * j[1][b]);
                    }
                }
            }
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
        // A little beyond the search, so that a value at its limit is found without a bias.
        p[OFFSET] = p[OFFSET].clamp(-1.2 * self.s.max_offset_m, 1.2 * self.s.max_offset_m);
        p[HEADING] = p[HEADING].clamp(-1.2 * self.s.max_heading_rad, 1.2 * self.s.max_heading_rad);
        let k = 1.1 / self.s.min_radius_m;
        // The inner row keeps a radius above zero.
        let k = k.min(1.9 / self.s.lane_width_m);
        p[CURVATURE] = p[CURVATURE].clamp(-k, k);
        if let CurveStart::UpTo(m) = self.s.curve_start {
            p[START] = p[START].clamp(0.0, m);
        }
        p
    }

    /// Levenberg and Marquardt on the log likelihood, first with wide cells.
    pub(super) fn refine(&self, start: Vector) -> Vector {
        let mut p = self.clamped(start);
        for (widen, rounds) in [(4.0, 6), (2.0, 6), (1.0, 20)] {
            let mut best = self.smooth_log_likelihood(&p, widen);
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
                    let value = self.smooth_log_likelihood(&q, widen);
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

    /// Inverse of the observed information: the change of the gradient. Where that is not positive (a kink at
    /// the start of the bend), of Gauss and Newton's.
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

/// Lower Cholesky factor of a positive matrix, of its rows and columns scaled to a unit diagonal.
fn cholesky(m: &Matrix) -> Option<(Matrix, Vector)> {
    let mut scale = [0.0; VALUES];
    for i in 0..VALUES {
        if !(m[i][i] > 0.0 && m[i][i].is_finite()) {
            return None;
        }
        scale[i] = m[i][i].sqrt().recip();
    }
    let mut l = [[0.0; VALUES]; VALUES];
    for i in 0..VALUES {
        for j in 0..=i {
            let dot: f64 = (0..j).map(|k| l[i][k] * l[j][k]).sum();
            let value = m[i][j] * scale[i] * scale[j] - dot;
            if i == j {
                if value.is_nan() || value <= 1e-13 {
                    return None;
                }
                l[i][i] = value.sqrt();
            } else {
                l[i][j] = value / l[j][j];
            }
        }
    }
    Some((l, scale))
}

fn solve(m: &Matrix, b: &Vector) -> Option<Vector> {
    let (l, scale) = cholesky(m)?;
    let mut x = [0.0; VALUES];
    for i in 0..VALUES {
        let dot: f64 = (0..i).map(|k| l[i][k] * x[k]).sum();
        x[i] = (b[i] * scale[i] - dot) / l[i][i];
    }
    for i in (0..VALUES).rev() {
        let dot: f64 = (i + 1..VALUES).map(|k| l[k][i] * x[k]).sum();
        x[i] = (x[i] - dot) / l[i][i];
    }
    for i in 0..VALUES {
        x[i] *= scale[i];
    }
    x.iter().all(|v| v.is_finite()).then_some(x)
}

fn inverse(m: &Matrix) -> Option<Matrix> {
    let mut out = [[0.0; VALUES]; VALUES];
    for i in 0..VALUES {
        let mut unit = [0.0; VALUES];
        unit[i] = 1.0;
        let column = solve(m, &unit)?;
        for j in 0..VALUES {
            out[j][i] = column[j];
        }
    }
    Some(out)
}
