//! Where the fit starts: lanes from a grid, phases and bends by trial.

use super::fit::Fit;
use super::*;
use glam::Vec2;

impl Fit<'_> {
    /// Phases of both rows that fit best with the rest given, by trial.
    pub(super) fn phased(&self, p: &Vector) -> (f64, Vector) {
        const TRIALS: usize = 16;
        const WIDEN: f64 = 3.0;
        let n = self.cells.len();
        let mut density = [vec![0.0; TRIALS * n], vec![0.0; TRIALS * n]];
        for (of_row, is_left) in density.iter_mut().zip([true, false]) {
            for trial in 0..TRIALS {
                let phase = self.s.spacing_m(is_left) * trial as f64 / TRIALS as f64;
                let of_trial = &mut of_row[trial * n..][..n];
                self.s.row(p, is_left, phase, |m| self.near(&m, WIDEN, |i, d, _, _| of_trial[i] += d));
            }
        }
        for d in density.iter_mut().flatten() {
            *d /= self.extra;
        }
        let mut best = (f64::NEG_INFINITY, 0, 0);
        for a in 0..TRIALS {
            for b in 0..TRIALS {
                let (left, right) = (&density[0][a * n..][..n], &density[1][b * n..][..n]);
                // Products of a few cells stay in range and spare logarithms.
                let of_few = |(x, y): (&[f64], &[f64])| {
                    x.iter().zip(y).map(|(x, y)| 1.0 + x + y).product::<f64>().ln()
                };
                let value: f64 = left.chunks(8).zip(right.chunks(8)).map(of_few).sum();
                if value > best.0 {
                    best = (value, a, b);
                }
            }
        }
        let mut q = *p;
        q[LEFT] = self.s.left_spacing_m * best.1 as f64 / TRIALS as f64;
        q[RIGHT] = self.s.right_spacing_m * best.2 as f64 / TRIALS as f64;
        (best.0 + n as f64 * self.extra.ln(), q)
    }

    /// Lanes from a grid, best first: rows as curves, without phases, offsets to the left only.
    pub(super) fn grid(&self, speeds: &[f64]) -> Vec<Vector> {
        const OFFSET_STEP: f64 = 0.375;
        let heading_step: f64 = 4f64.to_radians();
        let steps = |most: f64, step: f64| (most / step).ceil().max(1.0) as i32;
        let offsets = steps(self.s.max_offset_m, OFFSET_STEP);
        let half = steps(self.s.max_heading_rad, heading_step);
        let heading_step = self.s.max_heading_rad / f64::from(half);
        let rad: Vec<f64> = (-half..=half).map(|h| heading_step * f64::from(h)).collect();
        let headings = Headings {
            first: -self.s.max_heading_rad as f32,
            step: heading_step as f32,
            unit: rad.iter().map(|h| DVec2::from_angle(*h).as_vec2()).collect(),
            rad,
        };
        let mut scores = vec![0f32; headings.rad.len()];
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
        let widest = 0.5 * self.s.lane_width_m + self.s.max_offset_m;
        let begin = self.s.begin_m(widest, self.s.max_heading_rad).max(-far);
        let mut found: Vec<(f32, Vector)> = Vec::new();
        let mut places = Vec::new();
        let (mut pairs, mut ends) = (Vec::new(), Vec::new());
        let mut of_cell: Vec<Vec<Pair>> = self.cells.iter().map(|_| Vec::new()).collect();
        for (curvature, start, half_step) in bends {
            places.clear();
            for is_left in [true, false] {
                let end = self.s.end_m(is_left, curvature, start);
                let mut u = begin;
                while u <= end {
                    places.push((is_left, self.s.row_m(is_left, u, curvature, start)));
                    // The curve is steep near the radar only.
                    u += if u.abs() < 6.0 { 0.4 } else { 1.2 };
                }
            }
            // Squared angles that the steps of the grid leave open.
            let turn = |c: &Cell| {
                (0.5 * heading_step).powi(2)
                    + (0.5 * OFFSET_STEP / c.range_m.max(0.5)).powi(2)
                    + (0.5 * half_step * c.range_m).powi(2)
            };
            let turns: Vec<f32> = self.cells.iter().map(|c| turn(c) as f32).collect();
            for o in 0..=offsets {
                let offset = (OFFSET_STEP * f64::from(o)).min(self.s.max_offset_m);
                self.pairs(&places, offset, &mut of_cell, &mut pairs, &mut ends);
                for speed in speeds {
                    self.curve_scores((&pairs, &ends), &headings, *speed, &turns, &mut scores);
                    found.extend(scores.iter().zip(&headings.rad).map(|(score, heading)| {
                        (*score, [offset, *heading, curvature, start, 0.0, 0.0, *speed])
                    }));
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
        let far = self.cells.last().map_or(0.0, |c| c.range_m);
        let mut curvatures = Vec::new();
        let mut k = 1.05 / self.s.min_radius_m;
        while k > 0.003 {
            curvatures.extend([k, -k]);
            k *= 0.94;
        }
        let rows = [(true, p[LEFT]), (false, p[RIGHT])];
        let mut found = Vec::new();
        let n = self.cells.len();
        let (mut before, mut density) = (vec![0.0; n], vec![0.0; n]);
        for start in starts {
            let mut q = *p;
            q[START] = start;
            // The straight part is the same for all bends that start here.
            before.fill(1.0);
            for (is_left, phase) in rows {
                let part = [f64::NEG_INFINITY, start];
                self.s.row_between(&q, is_left, phase, part, |m| {
                    self.near(&m, WIDEN, |i, d, _, _| before[i] += d / self.extra);
                });
            }
            for curvature in &curvatures {
                // So slight a bend is none where there are cells.
                if 0.5 * curvature.abs() * (far - start).max(0.0).powi(2) < 0.1 {
                    break;
                }
                q[CURVATURE] = *curvature;
                density.copy_from_slice(&before);
                for (is_left, phase) in rows {
                    self.s.row_between(&q, is_left, phase, [start, f64::INFINITY], |m| {
                        self.near(&m, WIDEN, |i, d, _, _| density[i] += d / self.extra);
                    });
                }
                // Products of a few cells stay in range and spare logarithms.
                let value: f64 = density.chunks(8).map(|d| d.iter().product::<f64>().ln()).sum();
                found.push((value + self.log_prior(&q), q));
            }
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

    /// The pieces of both curves that cover the range of each cell, cell after cell; `ends` holds where each cell's end.
    fn pairs(
        &self,
        places: &[(bool, DVec2)],
        offset: f64,
        of_cell: &mut [Vec<Pair>],
        out: &mut Vec<Pair>,
        ends: &mut Vec<usize>,
    ) {
        let h2 = self.s.radar_height_m.powi(2);
        let seen = |place: DVec2| {
            let d = DVec2::new(place.x, place.y - offset);
            let range = (d.length_squared() + h2).sqrt().max(1e-9);
            (range, d / range)
        };
        // Twice the typical std beyond the ends, for cells nearer than the nearest of the row.
        let reach = 2.0 * self.widest_m;
        let far = self.cells.last().map_or(0.0, |c| c.range_m);
        let mut last = None;
        for (is_left, place) in places {
            let b = seen(*place);
            let Some((_, a)) = last.replace((*is_left, b)).filter(|l| l.0 == *is_left) else { continue };
            let (low, high) = (a.0.min(b.0) - reach, a.0.max(b.0) + reach);
            if low > far {
                continue;
            }
            let first = self.first(low);
            let length = b.0 - a.0;
            let per_m = if length.abs() < 0.05 { DVec2::ZERO } else { (b.1 - a.1) / length };
            for (c, found) in self.cells.iter().zip(of_cell.iter_mut()).skip(first) {
                if c.range_m > high {
                    break;
                }
                if c.range_m < low {
                    continue;
                }
                let part =
                    if length.abs() < 1e-9 { 0.5 } else { ((c.range_m - a.0) / length).clamp(0.0, 1.0) };
                let beyond = (c.range_m - (a.0 + part * length)) / c.range_std_m;
                if beyond.abs() <= 2.0 {
                    found.push(Pair {
                        unit: a.1.lerp(b.1, part).as_vec2(),
                        spread: (per_m * c.range_std_m).as_vec2(),
                        beyond2: (beyond * beyond) as f32,
                    });
                }
            }
        }
        out.clear();
        ends.clear();
        for found in of_cell {
            out.append(found);
            ends.push(out.len());
        }
    }

    /// Logarithms of the likelihood ratio of both curves to none for each heading, each cell on the nearer curve. In single precision:
    /// it ranks. A piece of a curve has to do with the few headings only at which its range rate is about the cell's.
    fn curve_scores(
        &self,
        (pairs, ends): (&[Pair], &[usize]),
        headings: &Headings,
        speed: f64,
        turns: &[f32],
        scores: &mut [f32],
    ) {
        /// Beyond this chi-square a curve has nothing to do with a cell.
        const MOST: f32 = 16.0;
        scores.fill(0.0);
        let mut best = vec![0f32; scores.len()];
        let edge = (self.s.half_view_rad.cos() - 0.05) as f32;
        // Markers of a row over the length of the map, against cells that are none.
        let per_m = self.s.detection_probability / self.s.left_spacing_m.max(self.s.right_spacing_m);
        let ratio = (per_m / (self.extra * TAU.sqrt())) as f32;
        let speed = speed as f32;
        let count = scores.len() as f32;
        let mut from = 0;
        for ((c, turn), end) in self.cells.iter().zip(turns).zip(ends) {
            let (rate, var) = (c.range_rate_mps as f32, (c.range_rate_std_mps * c.range_rate_std_mps) as f32);
            let towards = (-rate / speed).clamp(-1.0, 1.0);
            let (mut low, mut high) = (usize::MAX, 0);
            for p in &pairs[from..*end] {
                let slope2 = p.spread.length_squared();
                let still = var / (speed * speed) + slope2 + turn * turn;
                // The deviation at the far side of the window, which is where it is widest.
                let wide = |cos: f32| (MOST * (still + (1.0 - cos * cos).max(0.0) * turn)).sqrt();
                let wide = wide((towards - wide(towards)).max(0.0));
                let near = (towards + wide).min(1.0).acos();
                let far = (towards - wide).max(-1.0).acos();
                let angle = p.unit.y.atan2(p.unit.x);
                let index = |heading: f32| ((heading - headings.first) / headings.step).clamp(-1.0, count);
                let windows = match near < headings.step {
                    true => [Some([angle - far, angle + far]), None],
                    false => [Some([angle - far, angle - near]), Some([angle + near, angle + far])],
                };
                for [a, b] in windows.into_iter().flatten() {
                    let (a, b) = (index(a).ceil().max(0.0) as usize, (index(b) + 1.0) as usize);
                    for (heading, best) in best.iter_mut().enumerate().take(b).skip(a) {
                        let motion = headings.unit[heading];
                        let cos = p.unit.dot(motion);
                        let slope = p.spread.dot(motion);
                        let var = var
                            + speed * speed * (slope * slope + ((1.0 - cos * cos).max(0.0) + turn) * turn);
                        let e = rate + speed * cos;
                        let chi2 = e * e / var + p.beyond2;
                        if cos >= edge && chi2 < MOST {
                            *best = best.max(ratio * (-0.5 * chi2).exp() / var.sqrt());
                        }
                    }
                    (low, high) = (low.min(a), high.max(b.min(scores.len())));
                }
            }
            from = *end;
            for i in low.min(high)..high {
                if best[i] > 0.0 {
                    scores[i] += (1.0 + best[i]).ln();
                    best[i] = 0.0;
                }
            }
        }
    }
}

/// The grid's headings, evenly spaced.
struct Headings {
    first: f32,
    step: f32,
    rad: Vec<f64>,
    unit: Vec<Vec2>,
}

/// A piece of a curve and a cell at its range.
struct Pair {
    /// From the radar.
    unit: Vec2,
    /// Its change over a standard deviation of the range.
    spread: Vec2,
    beyond2: f32,
}
