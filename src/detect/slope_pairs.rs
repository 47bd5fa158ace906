//! Range and range rate of FM-CW with slopes up and down: which peak of one spectrum belongs to which
//! of the other (CONVENTIONS eq. 119).

use super::ambiguity::{Ambiguity, Folded};
use super::assignment::assign;
use crate::base::error::{BadInput, Result};
use crate::base::units::C0;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f64::consts::{PI, TAU};

/// A peak in the spectrum of one slope. The beat frequency has its sign: with f_b = S·2R/c + 2v f_c/c
/// it is negative on a falling slope for all but fast and near bodies; a real mixer shows |f_b|, whose
/// sign the caller takes from the slope.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlopePeak {
    /// Beat frequency, Hz.
    pub beat_hz: f64,
    /// Standard deviation of the beat frequency, Hz.
    pub beat_std_hz: f64,
    /// Power, dB.
    pub power_db: f64,
    /// Azimuth, rad; None without an array.
    pub azimuth_rad: Option<f64>,
    /// Range rate of its row, known up to whole folds; None where one chirp is all.
    pub row: Option<Folded>,
}

/// One slope of the waveform and its peaks.
#[derive(Debug, Clone, PartialEq)]
pub struct Slope {
    /// Slope of the ramp, Hz/s, negative when falling.
    pub slope_hz_per_s: f64,
    /// Carrier of the slope, Hz.
    pub carrier_hz: f64,
    /// Its peaks.
    pub peaks: Vec<SlopePeak>,
}

/// What pairs are possible and how alike their peaks have to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairLimits {
    /// Largest range, m.
    pub max_range_m: f64,
    /// Largest range rate, m/s, in either direction.
    pub max_range_rate_mps: f64,
    /// Standard deviation of a body's level from slope to slope, dB.
    pub power_std_db: f64,
    /// Standard deviation of the azimuth of a body on two slopes, rad.
    pub azimuth_std_rad: f64,
}

/// A body from two or more ramps of different slopes.
#[derive(Debug, Clone, PartialEq)]
pub struct SlopePair {
    /// Index of its peak for each slope; None where that slope does not show the body.
    pub peaks: Vec<Option<usize>>,
    /// Range, m.
    pub range_m: f64,
    /// Range rate, m/s.
    pub range_rate_mps: f64,
    /// Standard deviation of the range, m.
    pub range_std_m: f64,
    /// Standard deviation of the range rate, m/s.
    pub range_rate_std_mps: f64,
    /// Resolved when only this pair would do and peaks of different bodies would agree as well once in a thousand (eq. 119a),
    /// Ambiguous when one of its peaks could as well have gone with another or their agreement says less.
    pub state: Ambiguity,
    /// Sum of squares of the differences over their standard deviations.
    pub cost: f64,
}

/// Differences with a probability below this are another body.
const SAME: f64 = 0.999;

/// A pair is resolved when so many pairs of different bodies, or fewer, are expected to agree as well.
const ACCIDENTS: f64 = 1e-3;
/// Bodies that a radar sees differ in level, and in azimuth, by about this.
const LEVELS_DB: f64 = 40.0;
const AZIMUTHS_RAD: f64 = 2.0;
/// The frequency at which a row's phase turns is that of its ramp's middle to this share.
const CARRIERS: f64 = 5e-4;
/// A gate of [`SAME`] is so many standard deviations wide to either side.
const GATE: f64 = 3.29;

/// How well the rows of the peaks agree with a range rate that the beats know to `std_mps`: the least sum of squares over its
/// folds, and the share of rows of other bodies that would agree as well. None without rows.
fn rows_agree(peaks: &[&SlopePeak], rate_mps: f64, std_mps: f64) -> Option<(f64, f64)> {
    let rows: Vec<Folded> = peaks.iter().filter_map(|p| p.row).collect();
    let (first, others) = rows.split_first()?;
    let wrapped = |f: &Folded, at: f64| {
        let off = at - f.range_rate_mps;
        off - f.ambiguity_mps * (off / f.ambiguity_mps).round()
    };
    let between = |f: &Folded| f.std_mps.hypot(first.std_mps).hypot(CARRIERS * rate_mps);
    let share = |std: f64, of: f64| (2.0 * GATE * std / of).min(1.0);
    let sigma = std_mps.hypot(first.std_mps);
    let about = rate_mps - wrapped(first, rate_mps);
    let reach = ((4.0 * sigma / first.ambiguity_mps).ceil() as i64).clamp(0, 1000);
    let cost_at = |q: i64| {
        let rate = about + q as f64 * first.ambiguity_mps;
        let fit = |f: &Folded| (wrapped(f, rate) / between(f)).powi(2);
        ((rate - rate_mps) / sigma).powi(2) + others.iter().map(fit).sum::<f64>()
    };
    let cost = (-reach..=reach).map(cost_at).fold(f64::INFINITY, f64::min);
    // Rows of one width agree whatever the fold.
    let alike = |f: &Folded| (f.ambiguity_mps / first.ambiguity_mps - 1.0).abs() < 1e-3;
    let by_rate = share(sigma, first.ambiguity_mps);
    let by_rows: f64 = others
        .iter()
        .map(|f| {
            let tries = if alike(f) { 1.0 } else { (8.0 * sigma / first.ambiguity_mps).max(1.0) };
            (tries * share(between(f), f.ambiguity_mps)).min(1.0)
        })
        .product();
    Some((cost, by_rate * by_rows))
}

/// Share of the peaks of other bodies that would agree with a pair as well as its own do.
fn by_chance(slopes: &[&Slope], peaks: &[&SlopePeak], rows: f64, limits: &PairLimits) -> f64 {
    let gate = |std: f64, of: f64| (2.0 * GATE * 2f64.sqrt() * std / of).min(1.0);
    let mut share = rows;
    for p in &peaks[1..] {
        share *= gate(limits.power_std_db, LEVELS_DB);
        if peaks[0].azimuth_rad.is_some() && p.azimuth_rad.is_some() {
            share *= gate(limits.azimuth_std_rad, AZIMUTHS_RAD);
        }
    }
    // Further beats are anywhere between those of the limits.
    for (s, p) in slopes.iter().zip(peaks).skip(2) {
        let beats = 2.0 * (s.slope_hz_per_s.abs() * limits.max_range_m) / C0;
        // A third slope that is nearly one of the two says little more than that one.
        let apart = |a: usize| (s.slope_hz_per_s - slopes[a].slope_hz_per_s).abs();
        let both = (slopes[1].slope_hz_per_s - slopes[0].slope_hz_per_s).abs();
        let lever = (both / apart(0).min(apart(1))).max(1.0);
        share *= (2.0 * GATE * 2.0 * p.beat_std_hz * lever / beats).min(1.0);
    }
    let others: f64 = slopes[1..].iter().map(|s| s.peaks.len().max(1) as f64).product();
    share * others
}

/// Least squares of (R, v) over beats f = (2S/c)R + (2f_c/c)v, each with weight 1/std²: values,
/// standard deviations, and the sum of squares left.
fn solve(beats: &[(&Slope, &SlopePeak)]) -> ([f64; 2], [f64; 2], f64) {
    let (mut a, mut b, mut d, mut x, mut y) = (0.0, 0.0, 0.0, 0.0, 0.0);
    let row = |s: &Slope| (2.0 * s.slope_hz_per_s / C0, 2.0 * s.carrier_hz / C0);
    for (s, p) in beats {
        let ((h, k), w) = (row(s), p.beat_std_hz.powi(-2));
        a += w * h * h;
        b += w * h * k;
        d += w * k * k;
        x += w * h * p.beat_hz;
        y += w * k * p.beat_hz;
    }
    let determinant = a * d - b * b;
    let [range, rate] = [(d * x - b * y) / determinant, (a * y - b * x) / determinant];
    let left = beats
        .iter()
        .map(|(s, p)| {
            let (h, k) = row(s);
            ((p.beat_hz - h * range - k * rate) / p.beat_std_hz).powi(2)
        })
        .sum();
    ([range, rate], [(d / determinant).sqrt(), (a / determinant).sqrt()], left)
}

/// Difference of level and azimuth of two peaks, squared over the variances of both; and how many
/// such comparisons there were.
fn unlike(p: &SlopePeak, q: &SlopePeak, limits: &PairLimits) -> (f64, f64) {
    let power = (p.power_db - q.power_db).powi(2) / (2.0 * limits.power_std_db.powi(2));
    match (p.azimuth_rad, q.azimuth_rad) {
        (Some(a), Some(b)) => {
            let turn = (a - b + PI).rem_euclid(TAU) - PI;
            (power + turn * turn / (2.0 * limits.azimuth_std_rad.powi(2)), 2.0)
        }
        _ => (power, 1.0),
    }
}

/// Peaks that may be of one body, in the order in which slopes were tried.
#[derive(Clone)]
struct Candidate<'a> {
    beats: Vec<(&'a Slope, &'a SlopePeak)>,
    /// Index of the peak of each slope.
    peaks: Vec<Option<usize>>,
    /// Sum of squares over level and azimuth, and the number of these comparisons.
    alike: (f64, f64),
}

/// Quantiles of χ² at [`SAME`] for 1, 2, ... degrees of freedom.
fn gates(slopes: usize) -> Result<Vec<f64>> {
    let quantile = |freedom: usize| {
        let chi = ChiSquared::new(freedom as f64);
        chi.map(|c| c.inverse_cdf(SAME)).map_err(|e| crate::base::error::Error::Failed(e.to_string()))
    };
    // Level and azimuth of each peak against the first, beats less two unknowns, and rows.
    (1..=4 * slopes).map(quantile).collect()
}

impl<'a> Candidate<'a> {
    fn with(&self, slopes: &'a [Slope], at: usize, index: usize, limits: &PairLimits) -> Candidate<'a> {
        let peak = &slopes[at].peaks[index];
        let more = unlike(self.beats[0].1, peak, limits);
        let mut out = self.clone();
        out.beats.push((&slopes[at], peak));
        out.peaks[at] = Some(index);
        out.alike = (out.alike.0 + more.0, out.alike.1 + more.1);
        out
    }

    /// The body that the peaks are of; None where they differ too much or the body is beyond the limits.
    fn pair(&self, gates: &[f64], limits: &PairLimits) -> Option<SlopePair> {
        let ([range_m, rate], [range_std_m, rate_std], left) = solve(&self.beats);
        let (slopes, peaks): (Vec<&Slope>, Vec<&SlopePeak>) = self.beats.iter().copied().unzip();
        let in_rows = rows_agree(&peaks, rate, rate_std);
        let cost = self.alike.0 + left + in_rows.map_or(0.0, |r| r.0);
        let by_rows = in_rows.map_or(0, |_| peaks.iter().filter(|p| p.row.is_some()).count());
        let freedom = self.alike.1 as usize + self.beats.len() - 2 + by_rows;
        let accidents = by_chance(&slopes, &peaks, in_rows.map_or(1.0, |r| r.1), limits);
        // Their share counts rows within their own gate.
        let in_gate = in_rows.is_none_or(|r| r.0 <= gates[by_rows.max(1) - 1]);
        let is_sure = accidents <= ACCIDENTS && in_gate;
        let within = (0.0..=limits.max_range_m).contains(&range_m) && rate.abs() <= limits.max_range_rate_mps;
        (within && cost <= gates[freedom - 1]).then(|| SlopePair {
            peaks: self.peaks.clone(),
            range_m,
            range_rate_mps: rate,
            range_std_m,
            range_rate_std_mps: rate_std,
            state: if is_sure { Ambiguity::Resolved } else { Ambiguity::Ambiguous },
            cost,
        })
    }
}

/// Pairs the peaks of ramps of different slopes, each peak of the first two used once, so that together they are most alike
/// in level and azimuth, within the limits of range and range rate (least sum by assignment). Each further slope adds, in its
/// turn, the peak that fits best; range and range rate are those of least squares over all (eq. 119). With three or more slopes a
/// pair of the first two counts only when one of the others shows it too: that rejects pairs of different bodies. With four or more,
/// the peaks that are left over are paired anew from the first and the third slope and from the second and the third: a body that one
/// of the first two does not show is found by the others. Peaks without a partner are left out. In the order of the peaks of the first slope; none of fewer than two slopes.
///
/// # Errors
/// Returns an error for slopes that are equal or zero, values that are not finite, deviations or limits that are not
/// positive.
///
/// # Example
/// A triangle of 1 MHz/µs up and down: a body at 150 m that recedes at 15 m/s shows beats of ±2SR/c + 2v/λ, whose
/// difference gives the range and whose sum the range rate.
///
/// ```
/// use catseye::base::units::{C0, wavelength_m};
/// use catseye::detect::slope_pairs::{PairLimits, Slope, SlopePeak, pair_slopes};
///
/// let (slope_hz_per_s, carrier_hz, range_m, rate_mps) = (1e12, 77e9, 150.0, 15.0);
/// let ramp = |sign: f64| {
///     let beat_hz = sign * slope_hz_per_s * 2.0 * range_m / C0 + 2.0 * rate_mps / wavelength_m(carrier_hz);
///     let peak = SlopePeak { beat_hz, beat_std_hz: 50.0, power_db: 0.0, azimuth_rad: None, row: None };
///     Slope { slope_hz_per_s: sign * slope_hz_per_s, carrier_hz, peaks: vec![peak] }
/// };
/// let limits =
///     PairLimits { max_range_m: 200.0, max_range_rate_mps: 60.0, power_std_db: 1.0, azimuth_std_rad: 0.01 };
/// let pairs = pair_slopes(&[ramp(1.0), ramp(-1.0)], &limits)?;
/// assert!((pairs[0].range_m - range_m).abs() < 1e-6 && (pairs[0].range_rate_mps - rate_mps).abs() < 1e-6);
/// # Ok::<(), catseye::Error>(())
/// ```
pub fn pair_slopes(slopes: &[Slope], limits: &PairLimits) -> Result<Vec<SlopePair>> {
    check(slopes, limits)?;
    if slopes.len() < 2 {
        return Ok(Vec::new());
    }
    let gates = gates(slopes.len())?;
    let mut left: Vec<Vec<usize>> = slopes.iter().map(|s| (0..s.peaks.len()).collect()).collect();
    let mut out = Vec::new();
    // The two slopes that are paired first: one of the first two may not show a body that three others do.
    let passes: &[[usize; 2]] = if slopes.len() < 4 { &[[0, 1]] } else { &[[0, 1], [0, 2], [1, 2]] };
    for two in passes {
        let found = seeded(slopes, *two, &left, &gates, limits);
        for pair in &found {
            for (list, taken) in left.iter_mut().zip(&pair.peaks) {
                list.retain(|k| Some(*k) != *taken);
            }
        }
        out.extend(found);
    }
    out.sort_by_key(|p| p.peaks.iter().map(|k| k.unwrap_or(usize::MAX)).collect::<Vec<_>>());
    Ok(out)
}

/// The bodies of one pass: pairs of the peaks `left` of two slopes, with the other slopes' peaks.
fn seeded(
    slopes: &[Slope],
    two: [usize; 2],
    left: &[Vec<usize>],
    gates: &[f64],
    limits: &PairLimits,
) -> Vec<SlopePair> {
    // Dearer than any pair that passes.
    let most = gates[gates.len() - 1];
    let [rows, columns] = two.map(|s| &left[s]);
    let further: Vec<usize> = (0..slopes.len()).filter(|s| !two.contains(s)).collect();
    let mut candidates: Vec<Option<SlopePair>> = Vec::with_capacity(rows.len() * columns.len());
    for &i in rows {
        for &j in columns {
            let (p, q) = (&slopes[two[0]].peaks[i], &slopes[two[1]].peaks[j]);
            let alike = unlike(p, q, limits);
            if alike.0 > most {
                candidates.push(None);
                continue;
            }
            let mut peaks = vec![None; slopes.len()];
            (peaks[two[0]], peaks[two[1]]) = (Some(i), Some(j));
            let mut body =
                Candidate { beats: vec![(&slopes[two[0]], p), (&slopes[two[1]], q)], peaks, alike };
            let mut found = body.pair(gates, limits).filter(|_| further.is_empty());
            for &s in &further {
                let with = |k: usize| {
                    let longer = body.with(slopes, s, k, limits);
                    longer.pair(gates, limits).map(|pair| (longer, pair))
                };
                let best =
                    left[s].iter().filter_map(|k| with(*k)).min_by(|a, b| a.1.cost.total_cmp(&b.1.cost));
                if let Some((longer, pair)) = best {
                    (body, found) = (longer, Some(pair));
                }
            }
            candidates.push(found);
        }
    }
    let cost: Vec<f64> = candidates.iter().map(|c| c.as_ref().map_or(f64::INFINITY, |c| c.cost)).collect();
    let width = columns.len();
    // As many bodies as fit.
    let miss = vec![(1.0 + most) * (1 + width.max(rows.len())) as f64; rows.len()];
    let choice = assign(&cost, width, &miss);
    let has_rivals = |i: usize, j: usize| {
        let row = (0..width).filter(|k| candidates[i * width + k].is_some()).count();
        let column = (0..rows.len()).filter(|k| candidates[k * width + j].is_some()).count();
        row + column > 2
    };
    let chosen = choice.into_iter().enumerate().filter_map(|(i, j)| {
        let j = j?;
        let mut pair = candidates[i * width + j].clone()?;
        if has_rivals(i, j) {
            pair.state = Ambiguity::Ambiguous;
        }
        Some(pair)
    });
    chosen.collect()
}

fn check(slopes: &[Slope], limits: &PairLimits) -> Result<()> {
    let bad = |key: String, value: f64, allowed: &str| {
        Err(BadInput::new("cannot pair slopes").key(key).value(value).allowed(allowed).into())
    };
    for (key, value) in [
        ("max_range_m", limits.max_range_m),
        ("max_range_rate_mps", limits.max_range_rate_mps),
        ("power_std_db", limits.power_std_db),
        ("azimuth_std_rad", limits.azimuth_std_rad),
    ] {
        if !(value.is_finite() && value > 0.0) {
            return bad(key.into(), value, "a positive number");
        }
    }
    for (n, s) in slopes.iter().enumerate() {
        if !(s.slope_hz_per_s.is_finite() && s.slope_hz_per_s != 0.0) {
            return bad(format!("slope {n}: slope_hz_per_s"), s.slope_hz_per_s, "a number other than 0");
        }
        if !(s.carrier_hz.is_finite() && s.carrier_hz > 0.0) {
            return bad(format!("slope {n}: carrier_hz"), s.carrier_hz, "a positive number");
        }
        for (k, p) in s.peaks.iter().enumerate() {
            if !(p.beat_std_hz.is_finite() && p.beat_std_hz > 0.0) {
                return bad(format!("slope {n}, peak {k}: beat_std_hz"), p.beat_std_hz, "a positive number");
            }
            for value in [p.beat_hz, p.power_db, p.azimuth_rad.unwrap_or(0.0)] {
                if !value.is_finite() {
                    return bad(format!("slope {n}, peak {k}"), value, "finite numbers");
                }
            }
        }
    }
    for (n, s) in slopes.iter().enumerate() {
        let alike = |t: &&Slope| (s.slope_hz_per_s - t.slope_hz_per_s).abs() <= 1e-6 * s.slope_hz_per_s.abs();
        if let Some(t) = slopes[..n].iter().find(alike) {
            return bad("slope_hz_per_s".into(), t.slope_hz_per_s, "slopes that differ");
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::rng::Draws;

    const CARRIER: f64 = 77e9;
    const S: f64 = 1e12;
    const LIMITS: PairLimits =
        PairLimits { max_range_m: 200.0, max_range_rate_mps: 60.0, power_std_db: 1.0, azimuth_std_rad: 0.01 };

    /// What 256 chirps of 40 us see of a range rate, `off` a little.
    fn row(rate: f64, off: f64) -> Folded {
        let ambiguity_mps = C0 / CARRIER / 160e-6;
        let seen = rate + off;
        let range_rate_mps = seen - ambiguity_mps * (seen / ambiguity_mps).round();
        Folded { range_rate_mps, ambiguity_mps, std_mps: 0.03 }
    }

    /// Range, range rate, power, azimuth.
    type Body = (f64, f64, f64, Option<f64>);

    fn slope(d: &mut Draws, s: f64, bodies: &[Body]) -> Slope {
        let peaks = bodies
            .iter()
            .map(|(r, v, power_db, azimuth)| SlopePeak {
                beat_hz: 2.0 * s * r / C0 + 2.0 * v * CARRIER / C0 + 50.0 * d.normal(),
                beat_std_hz: 50.0,
                power_db: power_db + 0.7 * d.normal(),
                azimuth_rad: azimuth.map(|a| a + 0.007 * d.normal()),
                row: Some(row(*v, 0.03 * d.normal())),
            })
            .collect();
        Slope { slope_hz_per_s: s, carrier_hz: CARRIER, peaks }
    }

    /// Of single chirps.
    fn rowless(d: &mut Draws, s: f64, bodies: &[Body]) -> Slope {
        let mut slope = slope(d, s, bodies);
        slope.peaks.iter_mut().for_each(|p| p.row = None);
        slope
    }

    #[test]
    fn one_body_by_hand() {
        let peak = |beat_hz| SlopePeak {
            beat_hz,
            beat_std_hz: 50.0,
            power_db: 0.0,
            azimuth_rad: None,
            row: Some(row(15.0, 0.0)),
        };
        // 150 m, 15 m/s receding: 2SR/c = 1 000 692.3 Hz, 2v/λ = 7 705.3 Hz.
        let up = Slope { slope_hz_per_s: S, carrier_hz: CARRIER, peaks: vec![peak(1_000_692.3 + 7_705.3)] };
        let down =
            Slope { slope_hz_per_s: -S, carrier_hz: CARRIER, peaks: vec![peak(7_705.3 - 1_000_692.3)] };
        let pairs = pair_slopes(&[up.clone(), down.clone()], &LIMITS).unwrap();
        assert_eq!(pairs.len(), 1);
        let p = &pairs[0];
        assert!((p.range_m - 150.0).abs() < 1e-4 && (p.range_rate_mps - 15.0).abs() < 1e-3, "{p:?}");
        assert_eq!(p.state, Ambiguity::Resolved);
        // σ_R = c σ/(2√2 S), σ_v = λσ/(2√2).
        assert!((p.range_std_m / (C0 * 50.0 / (8f64.sqrt() * S)) - 1.0).abs() < 1e-9);
        assert!((p.range_rate_std_mps / (C0 / CARRIER * 50.0 / 8f64.sqrt()) - 1.0).abs() < 1e-9);
        // Without peaks there are no pairs.
        let none = Slope { peaks: vec![], ..down.clone() };
        assert!(pair_slopes(&[up.clone(), none.clone()], &LIMITS).unwrap().is_empty());
        assert!(
            pair_slopes(&[none, up.clone(), Slope { slope_hz_per_s: 0.5 * S, ..up.clone() }], &LIMITS)
                .unwrap()
                .is_empty()
        );
        // Faster than the limit.
        let fast = PairLimits { max_range_rate_mps: 14.0, ..LIMITS };
        assert!(pair_slopes(&[up, down], &fast).unwrap().is_empty());
    }

    #[test]
    fn level_and_angle_tell_bodies_apart() {
        let bodies: [Body; 3] =
            [(40.0, -10.0, 0.0, Some(0.1)), (42.0, 20.0, 3.0, Some(-0.2)), (90.0, 0.0, -20.0, Some(0.3))];
        for run in 0..50 {
            let mut d = Draws::new(run, 61);
            let up = slope(&mut d, S, &bodies);
            let mut down = slope(&mut d, -S, &bodies);
            down.peaks.rotate_left(1);
            let pairs = pair_slopes(&[up.clone(), down.clone()], &LIMITS).unwrap();
            assert_eq!(pairs.len(), 3, "run {run}");
            for p in pairs {
                let [Some(first), Some(second)] = p.peaks[..] else { panic!("{p:?}") };
                let (r, v, ..) = bodies[first];
                assert_eq!((second + 1) % 3, first);
                assert!((p.range_m - r).abs() < 6.0 * p.range_std_m);
                assert!((p.range_rate_mps - v).abs() < 6.0 * p.range_rate_std_mps);
                assert_eq!(p.state, Ambiguity::Resolved);
            }
        }
    }

    #[test]
    fn alike_bodies_are_ambiguous_until_a_third_slope() {
        // Four bodies of one level and no array: every pair within the limits would do.
        let bodies: [Body; 4] = [
            (40.0, -10.0, 0.0, None),
            (42.0, 20.0, 0.0, None),
            (47.0, 3.0, 0.0, None),
            (39.0, 12.0, 0.0, None),
        ];
        let (mut marked, mut right) = (0, 0);
        for run in 0..50 {
            let mut d = Draws::new(run, 62);
            let up = rowless(&mut d, S, &bodies);
            let down = rowless(&mut d, -S, &bodies);
            let third = rowless(&mut d, 0.37 * S, &bodies);
            let pairs = pair_slopes(&[up.clone(), down.clone()], &LIMITS).unwrap();
            marked += pairs.iter().filter(|p| p.state == Ambiguity::Ambiguous).count();
            let sure = pair_slopes(&[up, down, third], &LIMITS).unwrap();
            right += sure.iter().filter(|p| p.peaks == [p.peaks[0]; 3]).count();
        }
        println!("{marked} of 200 marked, {right} right with a third slope");
        assert!(marked > 190 && right >= 198);
    }

    #[test]
    fn ghosts_fail_the_third_slope() {
        let mut d = Draws::new(0, 63);
        // The peaks of two bodies of which each slope missed one: the only pair is a ghost.
        let (a, b): (Body, Body) = ((40.0, -10.0, 0.0, None), (44.0, 20.0, 0.0, None));
        let up = rowless(&mut d, S, &[a]);
        let down = rowless(&mut d, -S, &[b]);
        let third = rowless(&mut d, 0.4 * S, &[a, b]);
        assert_eq!(pair_slopes(&[up.clone(), down.clone()], &LIMITS).unwrap().len(), 1);
        assert!(pair_slopes(&[up, down, third], &LIMITS).unwrap().is_empty());
    }

    /// The deviation of least squares falls as each slope is added, errors stay within it, and one slope of five that misses a
    /// body does not lose it.
    #[test]
    fn every_slope_counts() {
        let bodies: [Body; 3] = [(40.0, -10.0, 0.0, None), (43.0, 20.0, 0.0, None), (75.0, 3.0, 0.0, None)];
        let slopes = [S, -S, 0.37 * S, -0.6 * S, 0.8 * S];
        // Σ of (error/σ)² of ranges and rates over all runs and bodies, and σ of the first run's first body.
        let mut squares = [0.0; 6];
        let mut std = [0.0; 6];
        let runs = 60;
        for run in 0..runs {
            let mut d = Draws::new(run, 65);
            let seen: Vec<Slope> = slopes.iter().map(|s| rowless(&mut d, *s, &bodies)).collect();
            for n in 3..=5 {
                let pairs = pair_slopes(&seen[..n], &LIMITS).unwrap();
                assert_eq!(pairs.len(), 3, "{n} slopes, run {run}");
                for p in &pairs {
                    let first = p.peaks[0].unwrap();
                    assert!(p.peaks.iter().all(|k| *k == Some(first)), "{p:?}");
                    let (r, v, ..) = bodies[first];
                    squares[n] += ((p.range_m - r) / p.range_std_m).powi(2);
                    squares[n] += ((p.range_rate_mps - v) / p.range_rate_std_mps).powi(2);
                }
                std[n] = pairs[0].range_std_m;
            }
            // One of five misses the second body, the first two among them.
            for absent in 0..5 {
                let mut seen = seen.clone();
                seen[absent].peaks.remove(1);
                let pairs = pair_slopes(&seen, &LIMITS).unwrap();
                assert_eq!(pairs.len(), 3, "run {run}, slope {absent} misses one");
                let (r, v, ..) = bodies[1];
                let p =
                    pairs.iter().find(|p| p.peaks[absent].is_none()).expect("the body that one slope misses");
                // A gate of 99.9 % loses a peak now and then.
                let own = p.peaks.iter().filter(|k| **k == Some(1)).count();
                let of_others = p.peaks.iter().filter(|k| k.is_some_and(|k| k != 1)).count();
                assert!(own >= 3 && of_others == 0, "{p:?}");
                assert!((p.range_m - r).abs() < 5.0 * p.range_std_m, "{p:?}");
                assert!((p.range_rate_mps - v).abs() < 5.0 * p.range_rate_std_mps, "{p:?}");
            }
        }
        assert!(std[4] < std[3] && std[5] < std[4], "{std:?}");
        // Mean of 2 per body and run; range and rate are correlated at worst wholly: 5σ of that.
        let n = 3.0 * runs as f64;
        for s in &squares[3..] {
            assert!((s / n - 2.0).abs() < 5.0 * (8.0 / n).sqrt(), "{squares:?}");
        }
    }

    #[test]
    fn bad_input_is_named() {
        let mut d = Draws::new(0, 64);
        let up = slope(&mut d, S, &[(40.0, 0.0, 0.0, None)]);
        let down = slope(&mut d, -S, &[(40.0, 0.0, 0.0, None)]);
        let fails = |a: &Slope, b: &Slope, l: &PairLimits| {
            assert_eq!(pair_slopes(&[a.clone(), b.clone()], l).unwrap_err().exit_code(), 2);
        };
        fails(&up, &up, &LIMITS);
        fails(&Slope { slope_hz_per_s: 0.0, ..up.clone() }, &down, &LIMITS);
        fails(&up, &down, &PairLimits { power_std_db: 0.0, ..LIMITS });
        let mut nan = down.clone();
        nan.peaks[0].beat_hz = f64::NAN;
        fails(&up, &nan, &LIMITS);
    }
}
