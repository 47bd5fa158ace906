//! Start values of the fit: lanes from a grid, phases and bends by trial.

use super::cells::Cell;
use super::fit::Fit;
use super::lane::*;
use super::marker_rows::Marker;
use glam::DVec2;
use std::f64::consts::{PI, TAU};

impl Fit<'_> {
    /// Finds by trial the phases of both rows that fit best with the other values given.
    pub(super) fn phased(&self, blots: &Blots, p: &Vector) -> (f64, Vector) {
        const TRIALS: usize = 16;
        let n = self.cells.len();
        let mut density = [vec![0.0; TRIALS * n], vec![0.0; TRIALS * n]];
        for (of_row, is_left) in density.iter_mut().zip([true, false]) {
            for trial in 0..TRIALS {
                let phase = self.s.spacing_m(is_left) * trial as f64 / TRIALS as f64;
                let of_trial = &mut of_row[trial * n..][..n];
                self.s.row(p, is_left, phase, |m| blots.add(&m, of_trial));
            }
        }
        let mut best = (f32::NEG_INFINITY, 0, 0);
        for a in 0..TRIALS {
            for b in 0..TRIALS {
                let (left, right) = (&density[0][a * n..][..n], &density[1][b * n..][..n]);
                let value = log_of_products(left.iter().zip(right).map(|(x, y)| 1.0 + x + y));
                if value > best.0 {
                    best = (value, a, b);
                }
            }
        }
        let mut q = *p;
        q[LEFT] = self.s.left_spacing_m * best.1 as f64 / TRIALS as f64;
        q[RIGHT] = self.s.right_spacing_m * best.2 as f64 / TRIALS as f64;
        (f64::from(best.0), q)
    }

    /// Lanes from a grid, best first: rows as curves, without phases, offsets to the left only.
    pub(super) fn grid(&self, speeds: &[f64]) -> Vec<Vector> {
        const OFFSET_STEP: f64 = 0.375;
        const MOST: usize = 4000;
        let heading_step: f64 = 4f64.to_radians();
        let steps = |most: f64, step: f64| (most / step).ceil().max(1.0) as i32;
        let offsets = steps(self.s.max_offset_m, OFFSET_STEP);
        let half = steps(self.s.max_heading_rad, heading_step);
        let heading_step = self.s.max_heading_rad / f64::from(half);
        let rad: Vec<f64> = (-half..=half).map(|h| heading_step * f64::from(h)).collect();
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
        let mut kernels = Kernels::new(self, speeds, heading_step, rad.len());
        // Score, speed, bend, offset, heading.
        let mut found: Vec<(f32, usize, [usize; 3])> = Vec::new();
        let mut places = Vec::new();
        let mut of_cell: Vec<Vec<Pair>> = self.cells.iter().map(|_| Vec::new()).collect();
        let mut scores = vec![0f32; rad.len()];
        let mut best = vec![(0f32, 0); rad.len()];
        let offset_m = |o: usize| (OFFSET_STEP * o as f64).min(self.s.max_offset_m);
        for (bend, (curvature, start, half_step)) in bends.iter().enumerate() {
            places.clear();
            for is_left in [true, false] {
                let end = self.s.end_m(is_left, *curvature, *start);
                let mut u = begin;
                while u <= end {
                    places.push((is_left, self.s.row_m(is_left, u, *curvature, *start)));
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
            let turns: Vec<f64> = self.cells.iter().map(turn).collect();
            for o in 0..=offsets as usize {
                self.pairs(&places, offset_m(o), &turns, &kernels, &mut of_cell);
                best.fill((f32::NEG_INFINITY, 0));
                for speed in 0..speeds.len() {
                    kernels.scores(self, speed, &of_cell, &mut scores);
                    for (best, score) in best.iter_mut().zip(&scores) {
                        if *score > best.0 {
                            *best = (*score, speed);
                        }
                    }
                }
                found.extend(
                    best.iter().enumerate().map(|(h, (score, speed))| (*score, *speed, [bend, o, h])),
                );
            }
        }
        // The first of equals comes first.
        let order = |a: &(f32, usize, [usize; 3]), b: &(f32, usize, [usize; 3])| {
            b.0.total_cmp(&a.0).then(a.2.cmp(&b.2))
        };
        if found.len() > MOST {
            found.select_nth_unstable_by(MOST, order);
            found.truncate(MOST);
        }
        found.sort_unstable_by(order);
        let mut out: Vec<Vector> = Vec::new();
        for (_, speed, [bend, o, h]) in &found {
            let (curvature, start, _) = bends[*bend];
            let p = [offset_m(*o), rad[*h], curvature, start, 0.0, 0.0, speeds[*speed]];
            let is_new = out.iter().all(|q| {
                (p[OFFSET] - q[OFFSET]).abs() > 1.1 * OFFSET_STEP
                    || (p[HEADING] - q[HEADING]).abs() > 1.1 * heading_step
                    || (p[CURVATURE] - q[CURVATURE]).abs() > 0.004 + 0.5 * p[CURVATURE].abs()
            });
            if is_new {
                out.push(p);
                if out.len() == 24 {
                    break;
                }
            }
        }
        out
    }

    /// Other bends ahead, with all else unchanged. Along an arc of few cells one marker passes for the next,
    /// so the likelihood has many peaks over curvature and start.
    pub(super) fn other_bends(&self, blots: &Blots, p: &Vector) -> Vec<Vector> {
        /// Lanes that differ by less at the farthest cell are not distinguished by their wide cells.
        const STEP_M: f64 = 0.5;
        let starts: Vec<f64> = match self.s.curve_start {
            CurveStart::Known(m) => vec![m],
            CurveStart::UpTo(m) => {
                let steps = (m / 0.75).ceil().clamp(1.0, 60.0);
                (0..=steps as i32).map(|i| m * f64::from(i) / steps).collect()
            }
        };
        let far = self.cells.last().map_or(0.0, |c| c.range_m);
        let rows = [(true, p[LEFT]), (false, p[RIGHT])];
        let mut found = Vec::new();
        let n = self.cells.len();
        let (mut before, mut density) = (vec![0f32; n], vec![0f32; n]);
        for start in starts {
            let mut q = *p;
            q[START] = start;
            // The straight part is the same for all bends that start here.
            before.fill(1.0);
            for (is_left, phase) in rows {
                let part = [f64::NEG_INFINITY, start];
                self.s.row_between(&q, is_left, phase, part, |m| blots.add(&m, &mut before));
            }
            // Displacement of the farthest cell by the curvature, m per 1/m.
            let reach = 0.5 * (far - start).max(0.0).powi(2);
            let mut curvatures = Vec::new();
            let mut k = 1.05 / self.s.min_radius_m;
            // So slight a bend is none where there are cells.
            while k > 0.003 && k * reach > 0.1 {
                curvatures.extend([k, -k]);
                k -= (0.06 * k).max(STEP_M / reach);
            }
            for curvature in curvatures {
                q[CURVATURE] = curvature;
                density.copy_from_slice(&before);
                for (is_left, phase) in rows {
                    self.s.row_between(&q, is_left, phase, [start, f64::INFINITY], |m| {
                        blots.add(&m, &mut density);
                    });
                }
                let value = f64::from(log_of_products(density.iter().copied()));
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

    /// The pieces of both curves that cover the range of each cell.
    fn pairs(
        &self,
        places: &[(bool, DVec2)],
        offset: f64,
        turns: &[f64],
        kernels: &Kernels,
        of_cell: &mut [Vec<Pair>],
    ) {
        let h2 = self.s.radar_height_m.powi(2);
        let seen = |place: DVec2| {
            let d = DVec2::new(place.x, place.y - offset);
            ((d.length_squared() + h2).sqrt(), d.y.atan2(d.x))
        };
        // Twice the typical std beyond the ends, for cells nearer than the nearest of the row.
        let reach = 2.0 * self.widest_m;
        let far = self.cells.last().map_or(0.0, |c| c.range_m);
        of_cell.iter_mut().for_each(Vec::clear);
        let mut last = None;
        for (piece, (is_left, place)) in places.iter().enumerate() {
            let b = seen(*place);
            let Some((_, a)) = last.replace((*is_left, b)).filter(|l| l.0 == *is_left) else { continue };
            let (low, high) = (a.0.min(b.0) - reach, a.0.max(b.0) + reach);
            if low > far {
                continue;
            }
            let first = self.first(low);
            let length = b.0 - a.0;
            let per_length = if length.abs() < 1e-9 { 0.0 } else { 1.0 / length };
            let mut angle = b.1 - a.1;
            if angle.abs() > PI {
                angle -= TAU.copysign(angle);
            }
            let per_m = if length.abs() < 0.05 { 0.0 } else { angle * per_length };
            for (i, c) in self.cells.iter().enumerate().skip(first) {
                if c.range_m > high {
                    break;
                }
                if c.range_m < low {
                    continue;
                }
                let part = match length.abs() < 1e-9 {
                    true => 0.5,
                    false => ((c.range_m - a.0) * per_length).clamp(0.0, 1.0),
                };
                let beyond = (c.range_m - (a.0 + part * length)).abs();
                if beyond > 2.0 * c.range_std_m {
                    continue;
                }
                let beyond = beyond / c.range_std_m;
                let found = &mut of_cell[i];
                // Next to a piece that covers the cell, one that does not tells nothing new.
                if let Some(l) = found.last()
                    && l.piece + 1 == piece
                    && (l.beyond2 > 0.0 || beyond > 0.0)
                {
                    if f64::from(l.beyond2) <= beyond * beyond {
                        continue;
                    }
                    found.pop();
                }
                let at = kernels.at(a.1 + part * angle);
                let width = kernels.width(turns[i] + (per_m * c.range_std_m).powi(2));
                found.push(Pair { piece, at, width, beyond2: (beyond * beyond) as f32 });
            }
        }
    }
}

/// Σ ln of numbers that are at least 1. Products of a few stay in range and save logarithms.
fn log_of_products(values: impl Iterator<Item = f32>) -> f32 {
    let (mut sum, mut product) = (0.0, 1.0f32);
    for v in values {
        product *= v;
        if product > 1e25 {
            sum += product.ln();
            product = 1.0;
        }
    }
    sum + product.ln()
}

/// The cells as wide blots in a single-precision picture over range and range rate: they rank lanes that are
/// not yet quite in place.
pub(super) struct Blots {
    least: [f32; 2],
    per_step: [f32; 2],
    /// Number of pixels in range and in range rate.
    size: [usize; 2],
    /// Index of the first blot of each pixel.
    from: Vec<u32>,
    /// Cells, and the density there of their marker's cells divided by that of other cells.
    blots: Vec<(u32, f32)>,
}

impl Blots {
    const WIDEN: f64 = 3.0;
    /// Pixel size as a share of the narrowest cell's standard deviation.
    const STEP: f64 = 0.5;
    const MOST_STEPS: f64 = 300.0;
    /// Least ratio that counts.
    const LEAST: f64 = 0.01;

    pub(super) fn new(fit: &Fit<'_>) -> Blots {
        let std = |c: &Cell| [c.range_std_m, c.range_rate_std_mps].map(|s| s * Blots::WIDEN);
        let at = |c: &Cell| [c.range_m, c.range_rate_mps];
        let peak = |[sr, sv]: [f64; 2]| fit.s.detection_probability / (TAU * sr * sv * fit.extra);
        // In standard deviations.
        let reach = |c: &Cell| (2.0 * (peak(std(c)) / Blots::LEAST).max(1.0).ln()).sqrt();
        let of = |axis: usize, start: f64, f: fn(f64, f64) -> f64, way: f64| {
            fit.cells.iter().map(|c| at(c)[axis] + way * reach(c) * std(c)[axis]).fold(start, f)
        };
        let least = [0, 1].map(|axis| of(axis, f64::INFINITY, f64::min, -1.0));
        let most = [0, 1].map(|axis| of(axis, f64::NEG_INFINITY, f64::max, 1.0));
        let step = [0, 1].map(|axis| {
            let narrow = fit.cells.iter().map(|c| std(c)[axis]).fold(f64::INFINITY, f64::min);
            (Blots::STEP * narrow).max((most[axis] - least[axis]) / Blots::MOST_STEPS)
        });
        let size = [0, 1].map(|axis| ((most[axis] - least[axis]) / step[axis]) as usize + 1);
        // Pixels of a cell: a run of them for each range.
        let runs = |c: &Cell, each: &mut dyn FnMut(usize, f64)| {
            let (s, r) = (std(c), reach(c));
            let span = |axis: usize, half: f64| {
                let to = |x: f64| ((x - least[axis]) / step[axis]).clamp(0.0, size[axis] as f64);
                to(at(c)[axis] - half).round() as usize..to(at(c)[axis] + half).round() as usize
            };
            let off =
                |axis: usize, i: usize| (least[axis] + (i as f64 + 0.5) * step[axis] - at(c)[axis]) / s[axis];
            let rates = span(1, r * s[1]);
            let of_rate: Vec<f64> = rates.clone().map(|j| (-0.5 * off(1, j).powi(2)).exp()).collect();
            for i in span(0, r * s[0]) {
                let of_range = peak(s) * (-0.5 * off(0, i).powi(2)).exp();
                for (j, of_rate) in rates.clone().zip(&of_rate) {
                    if of_range * of_rate >= Blots::LEAST {
                        each(i * size[1] + j, of_range * of_rate);
                    }
                }
            }
        };
        let mut from = vec![0u32; size[0] * size[1] + 1];
        for c in &fit.cells {
            runs(c, &mut |pixel, _| from[pixel + 1] += 1);
        }
        let mut sum = 0;
        for n in &mut from {
            sum += *n;
            *n = sum;
        }
        let mut blots = vec![(0, 0.0); sum as usize];
        let mut next = from.clone();
        for (i, c) in fit.cells.iter().enumerate() {
            runs(c, &mut |pixel, value| {
                blots[next[pixel] as usize] = (i as u32, value as f32);
                next[pixel] += 1;
            });
        }
        Blots { least: least.map(|x| x as f32), per_step: step.map(|x| 1.0 / x as f32), size, from, blots }
    }

    /// Adds to each cell what a marker explains of it.
    #[inline]
    fn add(&self, m: &Marker, to: &mut [f32]) {
        let i = (m.range as f32 - self.least[0]) * self.per_step[0];
        let j = (m.rate as f32 - self.least[1]) * self.per_step[1];
        if i < 0.0 || j < 0.0 {
            return;
        }
        let [i, j] = [i as i32 as usize, j as i32 as usize];
        if i >= self.size[0] || j >= self.size[1] {
            return;
        }
        let pixel = i * self.size[1] + j;
        let [from, end] = [self.from[pixel], self.from[pixel + 1]].map(|x| x as usize);
        for (cell, value) in &self.blots[from..end] {
            to[*cell as usize] += value;
        }
    }
}

/// A piece of a curve and a cell at its range.
struct Pair {
    piece: usize,
    /// Position in a kernel of the first heading, as seen from the piece.
    at: usize,
    width: usize,
    /// Squared standard deviations between the cell's range and the nearest range of the piece.
    beyond2: f32,
}

/// Logarithms of the likelihood ratio of a curve to none, for a cell at an angle to the motion. Steps of the
/// angle divide the step of the headings, so that all headings of the grid are one run of numbers, whatever
/// the angle. Single precision suffices, as they only rank.
struct Kernels {
    speeds: Vec<f64>,
    step: f64,
    headings: usize,
    /// Length of one kernel, for each part of a step.
    length: usize,
    /// Whole steps before the first angle.
    turn: usize,
    /// Cosine of each angle to the motion, in parts of a step.
    cos: Vec<f32>,
    /// Values of one kernel over these angles.
    values: Vec<f32>,
    /// Start of the kernel of a speed, cell and width, once it was needed.
    from: Vec<usize>,
    value: Vec<f32>,
}

impl Kernels {
    /// Steps of the angle in one of the headings.
    const PARTS: usize = 4;
    /// Squared angles by powers of two.
    const WIDTHS: usize = 16;
    const LEAST: f64 = 1.0 / 16384.0;

    fn new(fit: &Fit<'_>, speeds: &[f64], step: f64, headings: usize) -> Kernels {
        let turn = (PI / step).ceil() as usize + 1;
        let length = 2 * turn + headings;
        let farthest = Kernels::PARTS * (turn + headings);
        let part = step / Kernels::PARTS as f64;
        Kernels {
            speeds: speeds.to_vec(),
            step,
            headings,
            length,
            turn,
            cos: (0..=farthest).map(|i| (part * i as f64).cos() as f32).collect(),
            values: vec![0.0; farthest + 1],
            from: vec![usize::MAX; speeds.len() * fit.cells.len() * Kernels::WIDTHS],
            value: Vec::new(),
        }
    }

    /// Index of an angle within ±π.
    fn at(&self, angle: f64) -> usize {
        let parts = self.turn as f64 + angle / self.step;
        let parts = (parts * Kernels::PARTS as f64 + 0.5).max(0.0) as usize;
        let (whole, part) = (parts / Kernels::PARTS, parts % Kernels::PARTS);
        part * self.length + (2 * self.turn).saturating_sub(whole)
    }

    fn width(&self, angle2: f64) -> usize {
        let power = (angle2 / Kernels::LEAST).max(1.0).log2().round() as usize;
        power.min(Kernels::WIDTHS - 1)
    }

    /// Scores of both curves for each heading, with each cell assigned to the nearer curve.
    fn scores(&mut self, fit: &Fit<'_>, speed: usize, of_cell: &[Vec<Pair>], scores: &mut [f32]) {
        scores.fill(0.0);
        let mut best = vec![0f32; scores.len()];
        for (cell, pairs) in of_cell.iter().enumerate() {
            if pairs.is_empty() {
                continue;
            }
            best.fill(0.0);
            for p in pairs {
                let slot = (speed * of_cell.len() + cell) * Kernels::WIDTHS + p.width;
                if self.from[slot] == usize::MAX {
                    self.from[slot] = self.value.len();
                    self.build(fit, self.speeds[speed], &fit.cells[cell], p.width);
                }
                let run = &self.value[self.from[slot] + p.at..][..best.len()];
                // ln(1 + r·exp(-b)) hardly differs from ln(1 + r) - b where it counts.
                let less = 0.5 * p.beyond2;
                for (best, value) in best.iter_mut().zip(run) {
                    let value = *value - less;
                    *best = if value > *best { value } else { *best };
                }
            }
            scores.iter_mut().zip(&best).for_each(|(s, b)| *s += *b);
        }
    }

    fn build(&mut self, fit: &Fit<'_>, speed: f64, c: &Cell, width: usize) {
        /// Beyond this chi-square a curve has nothing to do with a cell.
        const MOST: f32 = 16.0;
        let edge = (fit.s.half_view_rad.cos() - 0.05) as f32;
        // Markers of a row over the length of the map, against cells that are none.
        let per_m = fit.s.detection_probability / fit.s.left_spacing_m.max(fit.s.right_spacing_m);
        let ratio = (per_m / (fit.extra * TAU.sqrt())) as f32;
        let angle2 = (Kernels::LEAST * (width as f64).exp2()) as f32;
        let (rate, speed) = (c.range_rate_mps as f32, speed as f32);
        let var = (c.range_rate_std_mps * c.range_rate_std_mps) as f32;
        // Nothing farther off than this, whatever the angle.
        let wide = (MOST * (var + speed * speed * angle2 * (1.0 + angle2))).sqrt();
        for (value, cos) in self.values.iter_mut().zip(&self.cos) {
            *value = 0.0;
            let e = rate + speed * cos;
            if e.abs() > wide || *cos < edge {
                continue;
            }
            let var = var + speed * speed * angle2 * ((1.0 - cos * cos).max(0.0) + angle2);
            let chi2 = e * e / var;
            if chi2 < MOST {
                *value = (1.0 + ratio * (-0.5 * chi2).exp() / var.sqrt()).ln();
            }
        }
        // Headings begin at minus half their span.
        let first = (Kernels::PARTS * (self.turn + (self.headings - 1) / 2)) as i32;
        for part in 0..Kernels::PARTS as i32 {
            let values = &self.values;
            let at =
                |i: usize| values[(first + part - Kernels::PARTS as i32 * i as i32).unsigned_abs() as usize];
            self.value.extend((0..self.length).map(at));
        }
    }
}
