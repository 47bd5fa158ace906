//! Where the fit starts: lanes from a grid, phases and bends by trial.

use super::fit::{Fit, Marker};
use super::*;

impl Fit<'_> {
    /// Phases of both rows that fit best with the rest given, by trial.
    pub(super) fn phased(&self, p: &Vector) -> (f64, Vector) {
        const TRIALS: usize = 16;
        const WIDEN: f64 = 3.0;
        let mut density = [vec![0.0; TRIALS * self.cells.len()], vec![0.0; TRIALS * self.cells.len()]];
        for (row, is_left) in [(0, true), (1, false)] {
            for trial in 0..TRIALS {
                let mut q = *p;
                let phase = self.s.spacing_m(is_left) * trial as f64 / TRIALS as f64;
                q[if is_left { LEFT } else { RIGHT }] = phase;
                let markers: Vec<Marker> =
                    self.markers(&q).into_iter().filter(|m| m.is_left == is_left).collect();
                for (i, c) in self.cells.iter().enumerate() {
                    density[row][trial * self.cells.len() + i] =
                        self.near(&markers, c, WIDEN, |_, _, _, _| ());
                }
            }
        }
        let n = self.cells.len();
        let mut best = (f64::NEG_INFINITY, 0, 0);
        for a in 0..TRIALS {
            for b in 0..TRIALS {
                let (left, right) = (&density[0][a * n..][..n], &density[1][b * n..][..n]);
                let value: f64 = left.iter().zip(right).map(|(x, y)| (self.extra + x + y).ln()).sum();
                if value > best.0 {
                    best = (value, a, b);
                }
            }
        }
        let mut q = *p;
        q[LEFT] = self.s.left_spacing_m * best.1 as f64 / TRIALS as f64;
        q[RIGHT] = self.s.right_spacing_m * best.2 as f64 / TRIALS as f64;
        (best.0, q)
    }

    /// Lanes from a grid, best first: rows as curves, without phases, offsets to the left only.
    pub(super) fn grid(&self, speeds: &[f64]) -> Vec<Vector> {
        const OFFSET_STEP: f64 = 0.375;
        let heading_step: f64 = 4f64.to_radians();
        let steps = |most: f64, step: f64| (most / step).ceil().max(1.0) as i32;
        let offsets = steps(self.s.max_offset_m, OFFSET_STEP);
        let headings = steps(self.s.max_heading_rad, heading_step);
        let mut bends = vec![(0.0, 0.0, 0.002)];
        let starts: Vec<f64> = match self.s.curve_start {
            CurveStart::Known(m) => vec![m],
            CurveStart::UpTo(m) => (0..=steps(m, 8.0)).map(|i| (8.0 * f64::from(i)).min(m)).collect(),
        };
        if let CurveStart::Known(m) = self.s.curve_start {
            bends[0].1 = m;
        }
        let mut k = 0.004;
        let most = 1.0 / self.s.min_radius_m;
        loop {
            let last = k >= most;
            let value = if last { most } else { k };
            for start in &starts {
                bends.push((value, *start, 0.25 * value));
                bends.push((-value, *start, 0.25 * value));
            }
            if last {
                break;
            }
            k *= 2.0;
        }
        let far = self.cells.iter().map(|c| c.range_m).fold(0.0, f64::max).min(self.s.far_m);
        let mut found: Vec<(f64, Vector)> = Vec::new();
        let mut places = Vec::new();
        let mut pairs: Vec<Pair> = Vec::new();
        for (curvature, start, half_step) in bends {
            places.clear();
            for is_left in [true, false] {
                let end = self.s.end_m(is_left, curvature, start);
                let mut u = -far;
                while u <= end {
                    places.push((is_left, self.s.row_m(is_left, u, curvature, start)));
                    // The curve is steep near the radar only.
                    u += if u.abs() < 6.0 { 0.4 } else { 1.2 };
                }
            }
            for o in 0..=offsets {
                let offset = (OFFSET_STEP * f64::from(o)).min(self.s.max_offset_m);
                self.pairs(&places, offset, &mut pairs);
                for h in -headings..=headings {
                    let heading =
                        (heading_step * f64::from(h)).clamp(-self.s.max_heading_rad, self.s.max_heading_rad);
                    let tolerance = [0.5 * heading_step, 0.5 * OFFSET_STEP, half_step];
                    for speed in speeds {
                        let score = self.curve_score(&pairs, heading, *speed, tolerance);
                        found.push((score, [offset, heading, curvature, start, 0.0, 0.0, *speed]));
                    }
                }
            }
        }
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut out: Vec<Vector> = Vec::new();
        for (_, p) in found.iter().take(4000) {
            let is_new = out.iter().all(|q| {
                (p[OFFSET] - q[OFFSET]).abs() > 1.1 * OFFSET_STEP
                    || (p[HEADING] - q[HEADING]).abs() > 1.1 * heading_step
                    || (p[CURVATURE] - q[CURVATURE]).abs() > 0.004 + 0.5 * p[CURVATURE].abs()
            });
            if is_new {
                out.push(*p);
                if out.len() == 24 {
                    break;
                }
            }
        }
        out
    }

    /// Other bends ahead with the rest as it is. Along an arc of few cells one marker passes for the next, so
    /// the likelihood has many peaks over curvature and start.
    pub(super) fn other_bends(&self, p: &Vector) -> Vec<Vector> {
        const WIDEN: f64 = 3.0;
        let starts: Vec<f64> = match self.s.curve_start {
            CurveStart::Known(m) => vec![m],
            CurveStart::UpTo(m) => {
                let steps = (m / 0.75).ceil().clamp(1.0, 60.0);
                (0..=steps as i32).map(|i| m * f64::from(i) / steps).collect()
            }
        };
        let mut found = Vec::new();
        let mut k = 1.05 / self.s.min_radius_m;
        while k > 0.003 {
            for curvature in [k, -k] {
                for start in &starts {
                    let mut q = *p;
                    (q[CURVATURE], q[START]) = (curvature, *start);
                    found.push((self.smooth_log_likelihood(&q, WIDEN), q));
                }
            }
            k *= 0.94;
        }
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut out: Vec<Vector> = Vec::new();
        for (_, q) in found.iter().take(200) {
            let is_new = out.iter().all(|o| {
                (o[CURVATURE] - q[CURVATURE]).abs() > 0.1 * q[CURVATURE].abs()
                    || (o[START] - q[START]).abs() > 1.6
            });
            if is_new {
                out.push(*q);
                if out.len() == 5 {
                    break;
                }
            }
        }
        out
    }

    /// The pieces of both curves that cover the range of each cell.
    pub(super) fn pairs(&self, places: &[(bool, DVec2)], offset: f64, out: &mut Vec<Pair>) {
        out.clear();
        let h2 = self.s.radar_height_m.powi(2);
        let seen = |place: DVec2| {
            let d = DVec2::new(place.x, place.y - offset);
            let range = (d.length_squared() + h2).sqrt().max(1e-9);
            (range, d / range)
        };
        for w in places.windows(2) {
            if w[0].0 != w[1].0 {
                continue;
            }
            let (a, b) = (seen(w[0].1), seen(w[1].1));
            let (low, high) = (a.0.min(b.0), a.0.max(b.0));
            // Twice the typical std beyond the ends, for cells nearer than the nearest of the row.
            let first = self.cells.partition_point(|c| c.range_m + 2.0 * c.range_std_m < low);
            for (i, c) in self.cells.iter().enumerate().skip(first) {
                if c.range_m - 2.0 * c.range_std_m > high {
                    break;
                }
                let length = b.0 - a.0;
                let part =
                    if length.abs() < 1e-9 { 0.5 } else { ((c.range_m - a.0) / length).clamp(0.0, 1.0) };
                let beyond = (c.range_m - (a.0 + part * length)) / c.range_std_m;
                out.push(Pair {
                    cell: i,
                    unit: a.1.lerp(b.1, part),
                    per_m: if length.abs() < 0.05 { DVec2::ZERO } else { (b.1 - a.1) / length },
                    beyond2: beyond * beyond,
                });
            }
        }
        out.sort_by_key(|p| p.cell);
    }

    /// Logarithm of the likelihood ratio of both curves to none, each cell on the nearer curve.
    pub(super) fn curve_score(&self, pairs: &[Pair], heading: f64, speed: f64, tolerance: [f64; 3]) -> f64 {
        let motion = DVec2::from_angle(heading);
        let edge = self.s.half_view_rad.cos() - 0.05;
        // Markers of a row over the length of the map, against cells that are none.
        let per_m = self.s.detection_probability / self.s.left_spacing_m.max(self.s.right_spacing_m);
        let ratio = per_m / (self.extra * TAU.sqrt());
        let mut score = 0.0;
        let mut rest = pairs;
        while let Some(first) = rest.first() {
            let n = rest.iter().take_while(|p| p.cell == first.cell).count();
            let c = &self.cells[first.cell];
            let turn = tolerance[0].powi(2)
                + (tolerance[1] / c.range_m.max(0.5)).powi(2)
                + (0.5 * tolerance[2] * c.range_m).powi(2);
            let mut best = (f64::INFINITY, 1.0);
            for p in &rest[..n] {
                let cos = p.unit.dot(motion);
                if cos < edge {
                    continue;
                }
                let sin2 = (1.0 - cos * cos).max(0.0);
                let slope = speed * p.per_m.dot(motion) * c.range_std_m;
                let var = c.range_rate_std_mps * c.range_rate_std_mps
                    + slope * slope
                    + speed * speed * (sin2 + turn) * turn;
                let e = c.range_rate_mps + speed * cos;
                let chi2 = e * e / var + p.beyond2;
                if chi2 < best.0 {
                    best = (chi2, var);
                }
            }
            if best.0 < 25.0 {
                score += (1.0 + ratio * (-0.5 * best.0).exp() / best.1.sqrt()).ln();
            }
            rest = &rest[n..];
        }
        score
    }
}

pub(super) struct Pair {
    cell: usize,
    unit: DVec2,
    per_m: DVec2,
    beyond2: f64,
}
