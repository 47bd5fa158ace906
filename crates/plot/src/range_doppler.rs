//! The range-Doppler map with its detections.

use super::canvas::{Picture, WHITE};
use super::chart::{CURVE_COLOURS, Chart, ColourMap, Mark, Scale, finite_range, heat_map};
use catseye::base::error::{Error, Result};
use catseye::base::units::dbm_from_w;

/// A map with its detections.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RangeDoppler<'a> {
    /// Title of the picture.
    pub title: &'a str,
    /// Mean power over channels in W, `[doppler, range]`.
    pub power_w: &'a [f32],
    /// Centres of the cells, evenly spaced.
    pub range_m: &'a [f64],
    /// Centres of the rows, positive receding.
    pub range_rate_mps: &'a [f64],
    /// (range in m, range rate in m/s) of each detection; rates beyond the map's are folded into it.
    pub detections: &'a [[f64; 2]],
    /// Peaks over the threshold that are none of them.
    pub unmarked: &'a [Unmarked<'a>],
}

/// A peak over the threshold that has no mark of a detection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unmarked<'a> {
    /// Where it stands in the chart.
    pub at: [f64; 2],
    /// In words.
    pub why: &'a str,
}

/// Crosses on peaks without a detection, a colour for each reason, which the legend gives.
pub(super) fn add_unmarked(chart: &mut Chart, unmarked: &[Unmarked]) {
    let mut reasons: Vec<&str> = Vec::new();
    for u in unmarked {
        if !reasons.contains(&u.why) {
            reasons.push(u.why);
        }
    }
    for (why, i) in reasons.into_iter().zip([3, 1, 4, 2].into_iter().cycle()) {
        let points: Vec<[f64; 2]> = unmarked.iter().filter(|u| u.why == why).map(|u| u.at).collect();
        let label = format!("over the threshold, {why} ({})", points.len());
        chart.marks(label, points, Mark::Cross { radius: 4.0 }, CURVE_COLOURS[i]);
    }
}

/// Power in dBm as colours over range and range rate; the scale runs from 2 dB under the noise (the median of the map) to
/// the maximum, at most 90 dB. Detections are open circles, peaks over the threshold that are none are crosses.
///
/// # Errors
/// When the axes do not fit the map.
pub fn range_doppler(input: &RangeDoppler) -> Result<Picture> {
    range_doppler_chart(input)?.draw()
}

pub(super) fn range_doppler_chart(input: &RangeDoppler) -> Result<Chart> {
    let (rows, columns) = (input.range_rate_mps.len(), input.range_m.len());
    if rows * columns != input.power_w.len() || rows * columns == 0 {
        return Err(Error::Failed(format!(
            "a range-Doppler map of {} cells has axes of {rows} x {columns}",
            input.power_w.len()
        )));
    }
    let dbm: Vec<f64> = input.power_w.iter().map(|p| dbm_from_w(f64::from(*p))).collect();
    let scale = noise_scale(&dbm);
    let mut chart = heat_map(
        input.title,
        ("range (m)", ends(input.range_m)),
        ("range rate (m/s), positive receding", ends(input.range_rate_mps)),
        (rows, columns),
        dbm,
        scale,
    );
    (chart.width, chart.height) = (640.0, 440.0);
    if !input.detections.is_empty() {
        let (points, folded) = folded(input.detections, input.range_rate_mps);
        let label = match folded {
            0 => format!("detections ({})", points.len()),
            n => format!("detections ({}; {n} of them beyond the unambiguous range rate)", points.len()),
        };
        chart.marks(label, points, Mark::Ring { radius: 5.0 }, WHITE);
    }
    add_unmarked(&mut chart, input.unmarked);
    Ok(chart)
}

/// Detections whose range rate was found to be beyond the map's stand where their peak is, whole spans of the map away.
/// Gives also how many.
fn folded(detections: &[[f64; 2]], range_rate_mps: &[f64]) -> (Vec<[f64; 2]>, usize) {
    let (first, last) = ends(range_rate_mps);
    let rows = range_rate_mps.len() as f64;
    let span = if rows > 1.0 { (last - first) * rows / (rows - 1.0) } else { f64::INFINITY };
    let lowest = first - 0.5 * span / rows;
    let turns = |rate: f64| ((rate - lowest) / span).floor();
    // In the last place a rate at the edge may be on either side.
    let beyond = |rate: f64| !(-1e-6..1.0 + 1e-6).contains(&((rate - lowest) / span));
    let mut count = 0;
    let place = |d: &[f64; 2]| match span.is_finite() && d[1].is_finite() && beyond(d[1]) {
        true => {
            count += 1;
            [d[0], d[1] - span * turns(d[1])]
        }
        false => *d,
    };
    (detections.iter().map(place).collect(), count)
}

pub(super) fn ends(v: &[f64]) -> (f64, f64) {
    (v[0], v[v.len() - 1])
}

/// The scale of a map of powers with noise: from 2 dB under the median, which the label says, to the maximum; at least 10
/// and at most 90 dB.
pub fn noise_scale(dbm: &[f64]) -> Scale {
    const OVER_DB: f64 = -2.0;
    let Some((median, max)) = median_and_max(dbm) else {
        return Scale::new(ColourMap::Viridis, "power (dBm)", -100.0, -80.0);
    };
    let hi = (max / 5.0).ceil() * 5.0;
    let lo = (median + OVER_DB).clamp(hi - 90.0, hi - 10.0);
    let from = lo - median;
    let side = if from < 0.0 { "under" } else { "over" };
    let label = format!("power (dBm), from {:.0} dB {side} the median", from.abs());
    Scale::new(ColourMap::Viridis, label, lo, hi)
}

/// Of the finite values; None without any.
fn median_and_max(db: &[f64]) -> Option<(f64, f64)> {
    let (_, max) = finite_range(db.iter().copied())?;
    let mut finite: Vec<f64> = db.iter().copied().filter(|v| v.is_finite()).collect();
    let middle = finite.len() / 2;
    Some((*finite.select_nth_unstable_by(middle, f64::total_cmp).1, max))
}

/// Limits for a map in decibels: from `under` below the median to the maximum, at least 20 and at most
/// `span` dB apart, on whole fives.
pub(super) fn decibel_limits(db: &[f64], under: f64, span: f64) -> (f64, f64) {
    let Some((median, max)) = median_and_max(db) else {
        return (-100.0, -80.0);
    };
    let hi = (max / 5.0).ceil() * 5.0;
    let lo = ((median - under) / 5.0).floor() * 5.0;
    (lo.clamp(hi - span, hi - 20.0), hi)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scale_begins_over_the_noise_and_says_so() {
        let mut db = vec![-120.0; 1000];
        db[7] = -61.0;
        let s = noise_scale(&db);
        assert_eq!((s.axis.lo, s.axis.hi), (-122.0, -60.0));
        assert_eq!(s.axis.label, "power (dBm), from 2 dB under the median");
        // Nothing but noise, and more than 90 dB of it.
        let s = noise_scale(&[-100.0; 4]);
        assert_eq!((s.axis.lo, s.axis.hi), (-110.0, -100.0));
        assert!(s.axis.label.ends_with("from 10 dB under the median"));
        db[8..900].fill(-300.0);
        let s = noise_scale(&db);
        assert_eq!((s.axis.lo, s.axis.hi), (-150.0, -60.0));
        assert!(s.axis.label.ends_with("from 150 dB over the median"));
        assert_eq!(noise_scale(&[f64::NAN]).axis.label, "power (dBm)");
    }

    #[test]
    fn a_peak_without_a_mark_says_why() {
        let peak = |r: f64, why: &'static str| Unmarked { at: [r, 0.0], why };
        let unmarked = [peak(0.0, "a"), peak(1.0, "b"), peak(2.0, "a")];
        let chart = range_doppler_chart(&RangeDoppler {
            power_w: &[1e-12; 9],
            range_m: &[0.0, 1.0, 2.0],
            range_rate_mps: &[-1.0, 0.0, 1.0],
            detections: &[[1.0, 1.0]],
            unmarked: &unmarked,
            ..Default::default()
        })
        .unwrap();
        let labels: Vec<&str> = chart.keys.iter().map(|k| k.label.as_str()).collect();
        assert_eq!(labels, ["detections (1)", "over the threshold, a (2)", "over the threshold, b (1)"]);
        assert_ne!(chart.keys[1].symbol, chart.keys[2].symbol);
        assert!(chart.unfounded_keys().is_empty());
    }

    #[test]
    fn detections_beyond_the_map_are_folded_into_it() {
        // Rows from -2.25 to 1.75 m/s: a span of 4.5 m/s, edges at -2.5 and 2.
        let rates: Vec<f64> = (0..9).map(|i| -2.25 + 0.5 * f64::from(i)).collect();
        let (places, count) = folded(&[[5.0, -10.0], [6.0, 1.9], [7.0, 2.5], [8.0, f64::NAN]], &rates);
        assert_eq!(count, 2);
        assert!((places[0][1] + 1.0).abs() < 1e-12 && (places[2][1] + 2.0).abs() < 1e-12, "{places:?}");
        assert_eq!(places[1], [6.0, 1.9]);
        assert_eq!(folded(&[[1.0, 9.0]], &[0.0]), (vec![[1.0, 9.0]], 0));
    }

    #[test]
    fn limits_follow_the_noise() {
        let mut db = vec![-120.0; 1000];
        db[7] = -61.0;
        assert_eq!(decibel_limits(&db, 5.0, 90.0), (-125.0, -60.0));
        // Without noise the span is bounded.
        db[8..900].fill(-300.0);
        assert_eq!(decibel_limits(&db, 5.0, 90.0), (-150.0, -60.0));
        // A flat map still has a scale.
        assert_eq!(decibel_limits(&[-100.0; 4], 5.0, 90.0), (-120.0, -100.0));
        assert_eq!(decibel_limits(&[f64::NEG_INFINITY, f64::NAN], 5.0, 90.0), (-100.0, -80.0));
    }
}
