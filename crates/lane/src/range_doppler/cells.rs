//! From a range-rate map to its detected cells, and the speed at its edge.

use super::{Cell, Parameter, RangeRateMap, Refusal};
use std::f64::consts::LN_2;

impl RangeRateMap<'_> {
    /// Peaks of the map that stand `threshold_db` over its noise, whose mean is the median over ln 2 (power
    /// of complex Gaussian noise), between neighbours by a parabola through the logarithm. The standard
    /// deviations are the caller's, since they depend on window and SNR.
    pub fn cells(
        &self,
        threshold_db: f64,
        range_std_m: f64,
        range_rate_std_mps: f64,
    ) -> Result<Vec<Cell>, Refusal> {
        let n = self.rates;
        let steps = [self.range_step_m, self.range_rate_step_mps];
        let firsts = [self.first_range_m, self.first_range_rate_mps];
        if n < 3
            || self.power.len() < 3 * n
            || !self.power.len().is_multiple_of(n)
            || self.power.iter().any(|p| !p.is_finite() || *p < 0.0)
            || steps.iter().any(|s| !s.is_finite() || *s == 0.0)
            || firsts.iter().any(|s| !s.is_finite())
        {
            return Err(Refusal::BadMap);
        }
        let mut sorted = self.power.to_vec();
        let middle = sorted.len() / 2;
        let noise = *sorted.select_nth_unstable_by(middle, f64::total_cmp).1 / LN_2;
        let least = noise * 10f64.powf(threshold_db / 10.0);
        let at = |i: usize, j: usize| self.power[i * n + j];
        let between = |low: f64, top: f64, high: f64| {
            if low <= 0.0 || high <= 0.0 {
                return 0.0;
            }
            let (a, b, c) = (low.ln(), top.ln(), high.ln());
            let bend = a - 2.0 * b + c;
            if bend < 0.0 { (0.5 * (a - c) / bend).clamp(-0.5, 0.5) } else { 0.0 }
        };
        let mut out = Vec::new();
        for i in 1..self.power.len() / n - 1 {
            for j in 1..n - 1 {
                let p = at(i, j);
                if p <= 0.0 || p < least {
                    continue;
                }
                // Of two equal neighbours the later one is the peak.
                let is_peak = (0..9).filter(|k| *k != 4).all(|k| {
                    let q = at(i + k / 3 - 1, j + k % 3 - 1);
                    if k < 4 { p >= q } else { p > q }
                });
                if is_peak {
                    let di = between(at(i - 1, j), p, at(i + 1, j));
                    let dj = between(at(i, j - 1), p, at(i, j + 1));
                    out.push(Cell {
                        range_m: self.first_range_m + self.range_step_m * (i as f64 + di),
                        range_rate_mps: self.first_range_rate_mps
                            + self.range_rate_step_mps * (j as f64 + dj),
                        range_std_m,
                        range_rate_std_mps,
                    });
                }
            }
        }
        Ok(out)
    }
}

/// Speed from the edge of the map: the fastest closing rate that three cells share within four standard
/// deviations, so that a single false cell or one oncoming vehicle does not count. It is the speed only if
/// something stands in the direction of motion; it is too low by the factor cos of the angle to the nearest
/// that does.
pub fn speed_from_edge(cells: &[Cell]) -> Result<Parameter, Refusal> {
    let mut closing: Vec<(f64, f64)> =
        cells.iter().filter(|c| usable(c)).map(|c| (-c.range_rate_mps, c.range_rate_std_mps)).collect();
    closing.sort_by(|a, b| b.0.total_cmp(&a.0));
    let edge = closing.windows(3).find(|w| w[0].0 - w[2].0 <= 4.0 * w[0].1.max(w[2].1));
    let [_, (mps, std), _] = edge.ok_or(Refusal::NoEdge)? else { return Err(Refusal::NoEdge) };
    if *mps <= 5.0 * std {
        return Err(Refusal::TooSlow { speed_mps: *mps });
    }
    Ok(Parameter { value: *mps, std: *std, observed: true })
}

pub(super) fn usable(c: &Cell) -> bool {
    let std_is_good = |s: f64| s.is_finite() && s > 0.0;
    c.range_m.is_finite()
        && c.range_m > 0.0
        && c.range_rate_mps.is_finite()
        && std_is_good(c.range_std_m)
        && std_is_good(c.range_rate_std_mps)
}
