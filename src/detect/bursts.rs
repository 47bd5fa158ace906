//! Bursts of one slope with different repetition periods (staggered repetition): each folds a range rate at another place, so
//! that together they tell which fold it is in (CONVENTIONS eq. 118b).

use super::accuracy::PointAccuracy;
use super::ambiguity::{Ambiguity, FASTEST_MPS, ROW_CELLS};
use crate::base::units::db_from_power;
use crate::dsp::Snapshots;
use crate::dsp::peaks::Peak;
use crate::scene::radar::Radar;
use crate::scene::radar_figures::common_fold_mps;
use crate::scene::waveform::Multiplex;
use num_complex::Complex64;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f64::consts::SQRT_2;

/// Probability with which the peaks of one body pass as one.
const SAME: f64 = 0.999;
/// A gate of [`SAME`] is so many standard deviations wide to either side.
const GATE: f64 = 3.29;
/// Another answer is ruled out when it is e^{−½·14} ≈ 1/1000 as likely.
const MARGIN: f64 = 14.0;
/// The level of a body in one burst is off by about this, dB: its scatterers turn against each other from burst to burst.
const LEVEL_DB: f64 = 2.0;
/// Peaks of one body come from one direction: their snapshots share at least this much of their power.
const ALIKE: f64 = 0.5;
/// A fold that peaks of other bodies would make as well more often than this is not taken as certain.
const ACCIDENTS: f64 = 0.01;

/// What one burst saw.
pub struct Burst<'a> {
    /// The radar with the scales of this burst (`Radar::part`).
    pub radar: &'a Radar,
    /// What the deviations of its points follow from.
    pub accuracy: &'a PointAccuracy,
    /// The cells as the receivers received them.
    pub snapshots: &'a Snapshots<f64>,
    /// Noise of one channel in each cell, W.
    pub noise_w: &'a [f64],
    /// Places of the cells.
    pub peaks: &'a [Peak],
    /// Range rate of each row, m/s.
    pub rates_mps: &'a [f64],
}

/// What bursts know together of the range rate of a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Known {
    /// The range rate in its fold, m/s, as this burst measured it.
    pub range_rate_mps: f64,
    /// Whether another fold explains the bursts too.
    pub state: Ambiguity,
    /// What the range rate is known but for multiples of, m/s.
    pub modulo_mps: f64,
}

/// A peak that is looked at.
struct Seen {
    bin: f64,
    bin_std: f64,
    rate_mps: f64,
    rate_std_mps: f64,
    level_db: f64,
}

/// Peaks that one range rate explains, one of each burst or none.
#[derive(Debug)]
struct Body {
    rate_mps: f64,
    picks: Vec<Option<usize>>,
    /// Sum of squares of the differences over their deviations, and [`MARGIN`] for each burst that does not show it.
    cost: f64,
    /// Number of accidental bodies that are expected in its place.
    accidents: f64,
}

impl Body {
    fn shares(&self, other: &Body) -> bool {
        self.picks.iter().zip(&other.picks).any(|(a, b)| a.is_some() && a == b)
    }
}

/// For each burst and each of its peaks what all bursts know of its range rate; None where too few show the body.
pub fn agreed(bursts: &[Burst<'_>]) -> Vec<Vec<Option<Known>>> {
    let mut out: Vec<Vec<Option<Known>>> = bursts.iter().map(|b| vec![None; b.peaks.len()]).collect();
    let Some(first) = bursts.first() else { return out };
    let all = All::new(bursts);
    let mut bodies: Vec<Body> = Vec::new();
    // With two bursts both have to show a body, with more all but one.
    let fewest = 2.max(bursts.len() - 1);
    for (b, burst) in bursts.iter().enumerate().take(bursts.len() + 1 - fewest) {
        for p in 0..burst.peaks.len() {
            bodies.extend(
                all.bodies_of(b, p).into_iter().filter(|x| x.picks.iter().flatten().count() >= fewest),
            );
        }
    }
    bodies.sort_by(|a, b| a.cost.total_cmp(&b.cost).then(a.rate_mps.abs().total_cmp(&b.rate_mps.abs())));
    // Each peak belongs to the body that explains it best.
    let mut owner: Vec<Vec<Option<usize>>> = bursts.iter().map(|b| vec![None; b.peaks.len()]).collect();
    let mut taken: Vec<usize> = Vec::new();
    for (i, body) in bodies.iter().enumerate() {
        let of_body = || body.picks.iter().enumerate().filter_map(|(b, p)| Some((b, (*p)?)));
        if of_body().all(|(b, p)| owner[b][p].is_none()) {
            of_body().for_each(|(b, p)| owner[b][p] = Some(i));
            taken.push(i);
        }
    }
    let half_cell_mps = 0.5 * first.radar.velocity_cell_mps();
    for i in taken {
        let body = &bodies[i];
        // Another rate of the same peaks counts unless the other peaks that it needs are better explained.
        let rival = bodies
            .iter()
            .enumerate()
            .filter(|(j, other)| {
                *j != i
                    && other.cost < body.cost + MARGIN
                    && (other.rate_mps - body.rate_mps).abs() > half_cell_mps
                    && other.shares(body)
                    && other.picks.iter().enumerate().all(|(b, p)| {
                        p.is_none_or(|p| owner[b][p].is_none_or(|o| o == i || bodies[o].cost > other.cost))
                    })
            })
            .map(|(_, other)| (other.rate_mps - body.rate_mps).abs())
            .reduce(f64::min);
        // What the bursts fold alike that show the body.
        let shown = body.picks.iter().zip(bursts).filter(|(p, _)| p.is_some());
        let span_mps = common_fold_mps(shown.map(|(_, b)| b.radar));
        let certain = rival.is_none() && body.accidents <= ACCIDENTS;
        let state = if certain { Ambiguity::Resolved } else { Ambiguity::Ambiguous };
        for (b, p) in body.picks.iter().enumerate() {
            let Some(p) = *p else { continue };
            let fold_mps = 2.0 * bursts[b].radar.max_velocity_mps();
            let rate = bursts[b].rates_mps[p];
            let range_rate_mps = rate + fold_mps * ((body.rate_mps - rate) / fold_mps).round();
            // In doubt the fold of one burst is what is not known.
            let modulo_mps = rival.unwrap_or(if certain { span_mps } else { fold_mps });
            out[b][p] = Some(Known { range_rate_mps, state, modulo_mps });
        }
    }
    out
}

/// All peaks of all bursts.
struct All<'a> {
    bursts: &'a [Burst<'a>],
    seen: Vec<Vec<Seen>>,
    /// Peaks of each burst by range.
    order: Vec<Vec<usize>>,
    /// Largest sum of squares of a body that so many bursts show.
    limits: Vec<f64>,
}

impl<'a> All<'a> {
    fn new(bursts: &'a [Burst<'a>]) -> All<'a> {
        let seen: Vec<Vec<Seen>> = bursts.iter().map(seen).collect();
        let order = seen
            .iter()
            .map(|list| {
                let mut order: Vec<usize> = (0..list.len()).collect();
                order.sort_by(|a, b| list[*a].bin.total_cmp(&list[*b].bin));
                order
            })
            .collect();
        // Range, rate and level of each further burst.
        let limit = |n: usize| {
            let degrees = (3 * n.saturating_sub(1)).max(1) as f64;
            ChiSquared::new(degrees).map_or(0.0, |chi| chi.inverse_cdf(SAME))
        };
        let limits = (0..=bursts.len()).map(limit).collect();
        All { bursts, seen, order, limits }
    }

    /// The bodies that a peak may be of, of those whose first burst is this one: one for each fold at most.
    fn bodies_of(&self, burst: usize, peak: usize) -> Vec<Body> {
        let own = &self.seen[burst][peak];
        let fold_mps = 2.0 * self.bursts[burst].radar.max_velocity_mps();
        let low = ((-FASTEST_MPS - own.rate_mps) / fold_mps).ceil() as i64;
        let high = ((FASTEST_MPS - own.rate_mps) / fold_mps).floor() as i64;
        // Number of peaks of each other burst that are expected to fit each fold by accident.
        let mut expected: Vec<Vec<f64>> = Vec::new();
        let mut out: Vec<Body> = Vec::new();
        for q in low..=high {
            let rate_mps = own.rate_mps + q as f64 * fold_mps;
            let (mut picks, mut chances) = (vec![None; self.bursts.len()], vec![1.0; self.bursts.len()]);
            picks[burst] = Some(peak);
            for other in burst + 1..self.bursts.len() {
                let (pick, chance) = self.best(burst, peak, other, rate_mps);
                (picks[other], chances[other]) = (pick, chance.min(1.0));
            }
            expected.push(chances);
            out.extend(self.body(picks, rate_mps));
        }
        // A burst that does not show a body says nothing for it.
        for body in &mut out {
            let shown = |chances: &Vec<f64>| -> f64 {
                chances.iter().zip(&body.picks).filter(|(_, p)| p.is_some()).map(|(c, _)| c).product()
            };
            body.accidents = expected.iter().map(shown).sum();
        }
        out
    }

    /// The peak of another burst that fits a range rate of this one best, and the number that is expected to fit by accident.
    fn best(&self, burst: usize, peak: usize, other: usize, rate_mps: f64) -> (Option<usize>, f64) {
        let (own, to) = (&self.seen[burst][peak], &self.bursts[other]);
        let from = &self.bursts[burst];
        let later_s = to.accuracy.coupling_s - from.accuracy.coupling_s;
        let want = own.bin + rate_mps * later_s / to.radar.range_bin_m();
        let fold_mps = 2.0 * to.radar.max_velocity_mps();
        let (list, order) = (&self.seen[other], &self.order[other]);
        // No deviation is larger than that of the weakest peak by much; a cell bounds it.
        let reach = GATE * own.bin_std.hypot(resolution_bins(to.radar));
        let begin = order.partition_point(|i| list[*i].bin < want - reach);
        let near = order[begin..].iter().take_while(|i| list[**i].bin <= want + reach);
        let (mut best, mut least, mut expected) = (None, f64::INFINITY, 0.0);
        for &i in near {
            let s = &list[i];
            let along = (s.bin - want) / own.bin_std.hypot(s.bin_std);
            let level = (s.level_db - own.level_db) / (LEVEL_DB * SQRT_2);
            if along.abs() > GATE || level.abs() > GATE || !alike(from, peak, to, i) {
                continue;
            }
            let std = own.rate_std_mps.hypot(s.rate_std_mps);
            expected += (2.0 * GATE * std / fold_mps).min(1.0);
            let off = rate_mps - s.rate_mps;
            let across = (off - fold_mps * (off / fold_mps).round()) / std;
            let cost = along * along + level * level + across * across;
            if across.abs() <= GATE && cost < least {
                (best, least) = (Some(i), cost);
            }
        }
        (best, expected)
    }

    /// The body of these peaks with its rates unfolded next to one; None where they are not one body.
    fn body(&self, picks: Vec<Option<usize>>, about_mps: f64) -> Option<Body> {
        let of: Vec<(&Burst<'_>, &Seen)> = picks
            .iter()
            .enumerate()
            .filter_map(|(b, p)| Some((&self.bursts[b], &self.seen[b][(*p)?])))
            .collect();
        let unfolded = |(b, s): &(&Burst<'_>, &Seen)| {
            let fold_mps = 2.0 * b.radar.max_velocity_mps();
            (s.rate_mps + fold_mps * ((about_mps - s.rate_mps) / fold_mps).round(), s.rate_std_mps)
        };
        let rates: Vec<(f64, f64)> = of.iter().map(unfolded).collect();
        let (rate_mps, of_rates) = mean(&rates);
        // Where the body stands in the middle of the frame.
        let bins: Vec<(f64, f64)> = of
            .iter()
            .map(|(b, s)| (s.bin - rate_mps * b.accuracy.coupling_s / b.radar.range_bin_m(), s.bin_std))
            .collect();
        let levels: Vec<(f64, f64)> = of.iter().map(|(_, s)| (s.level_db, LEVEL_DB)).collect();
        let cost = of_rates + mean(&bins).1 + mean(&levels).1;
        let missing = (picks.len() - of.len()) as f64;
        (of.len() > 1 && cost <= self.limits[of.len()] && rate_mps.abs() <= FASTEST_MPS).then_some(Body {
            rate_mps,
            picks,
            cost: cost + MARGIN * missing,
            accidents: 0.0,
        })
    }
}

/// Mean of values with deviations, each with weight 1/std², and the sum of squares about it.
fn mean(values: &[(f64, f64)]) -> (f64, f64) {
    let weight: f64 = values.iter().map(|(_, s)| s.powi(-2)).sum();
    let mean = values.iter().map(|(v, s)| v / (s * s)).sum::<f64>() / weight;
    (mean, values.iter().map(|(v, s)| ((v - mean) / s).powi(2)).sum())
}

/// Range cells of the transform within a resolution cell.
fn resolution_bins(radar: &Radar) -> f64 {
    radar.processing.range_fft as f64 / radar.lines().count.max(1) as f64
}

/// The peaks of a burst with their deviations.
fn seen(burst: &Burst<'_>) -> Vec<Seen> {
    let (radar, accuracy) = (burst.radar, burst.accuracy);
    let channels = burst.snapshots.channels as f64;
    burst
        .peaks
        .iter()
        .zip(burst.rates_mps)
        .zip(burst.noise_w)
        .map(|((peak, rate), noise)| {
            // The map is a mean over channels, whose noise is not the same.
            let snr = if *noise > 0.0 { channels * peak.power / noise } else { f64::INFINITY };
            Seen {
                bin: peak.range,
                bin_std: accuracy.range.std_cells(snr).hypot(ROW_CELLS * resolution_bins(radar)),
                rate_mps: *rate,
                rate_std_mps: (accuracy.doppler.std_cells(snr) * accuracy.velocity_bin_mps)
                    .hypot(ROW_CELLS * radar.velocity_cell_mps()),
                level_db: db_from_power(peak.power),
            }
        })
        .collect()
}

/// Whether two cells come from one direction. Folds turn transmitters against each other, so that only receivers are compared,
/// each transmitter for itself; with transmitters at once, what a channel holds depends on the fold and nothing is compared.
fn alike(a: &Burst<'_>, i: usize, b: &Burst<'_>, j: usize) -> bool {
    if a.radar.multiplex != Multiplex::Tdm {
        return true;
    }
    let (x, y) = (a.snapshots.of(i), b.snapshots.of(j));
    let n = a.radar.rx.len().max(1);
    let shared: f64 = x
        .chunks_exact(n)
        .zip(y.chunks_exact(n))
        .map(|(x, y)| x.iter().zip(y).map(|(x, y)| x.conj() * y).sum::<Complex64>().norm())
        .sum();
    // Of both powers noise is taken away, which shares nothing.
    let power = |x: &[Complex64], noise_w: f64| {
        (x.iter().map(|v| v.norm_sqr()).sum::<f64>() - x.len() as f64 * noise_w).max(0.0)
    };
    shared * shared >= ALIKE * power(x, a.noise_w[i]) * power(y, b.noise_w[j])
}
