//! The range-Doppler map with its detections.

use super::canvas::{Picture, WHITE};
use super::chart::{Chart, ColourMap, Layer, Mark, Paint, Scale, Symbol, finite_range, heat_map};
use crate::error::{Error, Result};
use crate::units::dbm_from_w;

#[derive(Debug, Clone, Default, PartialEq)]
pub struct RangeDoppler<'a> {
    pub title: &'a str,
    /// Mean power over channels in W, `[doppler, range]`.
    pub power_w: &'a [f32],
    /// Centres of the cells, evenly spaced.
    pub range_m: &'a [f64],
    /// Centres of the rows, positive receding.
    pub range_rate_mps: &'a [f64],
    /// (range in m, range rate in m/s) of each detection. Rates beyond the axis are folded back.
    pub detections: &'a [[f64; 2]],
}

/// Power in dBm as colours over range and range rate; the scale runs from 5 dB under the noise (the
/// median of the map) to the maximum, at most 90 dB. Detections are open circles.
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
    let (lo, hi) = decibel_limits(&dbm, 5.0, 90.0);
    let mut chart = heat_map(
        input.title,
        ("range (m)", ends(input.range_m)),
        ("range rate (m/s), positive receding", ends(input.range_rate_mps)),
        (rows, columns),
        dbm,
        Scale::new(ColourMap::Viridis, "power (dBm)", lo, hi),
    );
    (chart.width, chart.height) = (640.0, 440.0);
    if !input.detections.is_empty() {
        let mark = Mark::Ring { radius: 5.0 };
        chart.key(format!("detections ({})", input.detections.len()), Symbol::Mark(mark, WHITE));
        let points = input.detections.iter().map(|[r, v]| [*r, folded(input.range_rate_mps, *v)]).collect();
        chart.layers.push(Layer::Marks { points, mark, paint: Paint::Fixed(WHITE) });
    }
    Ok(chart)
}

/// A range rate where the map shows it: on its axis, which turns round.
fn folded(axis: &[f64], range_rate_mps: f64) -> f64 {
    let (first, last) = ends(axis);
    let cell = (last - first) / (axis.len().max(2) - 1) as f64;
    let low = first - 0.5 * cell;
    match axis.len() {
        0 | 1 => range_rate_mps,
        _ => low + (range_rate_mps - low).rem_euclid(last - first + cell),
    }
}

pub(super) fn ends(v: &[f64]) -> (f64, f64) {
    (v[0], v[v.len() - 1])
}

/// Limits for a map in decibels: from `under` below the median to the maximum, at least 20 and at most
/// `span` dB apart, on whole fives.
pub(super) fn decibel_limits(db: &[f64], under: f64, span: f64) -> (f64, f64) {
    let Some((_, max)) = finite_range(db.iter().copied()) else {
        return (-100.0, -80.0);
    };
    let mut finite: Vec<f64> = db.iter().copied().filter(|v| v.is_finite()).collect();
    let middle = finite.len() / 2;
    let median = *finite.select_nth_unstable_by(middle, f64::total_cmp).1;
    let hi = (max / 5.0).ceil() * 5.0;
    let lo = ((median - under) / 5.0).floor() * 5.0;
    (lo.clamp(hi - span, hi - 20.0), hi)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn detections_lie_where_the_map_has_their_power() {
        let axis: Vec<f64> = (0..10).map(|i| f64::from(i) - 5.0).collect();
        for (rate, shown) in [(0.0, 0.0), (4.4, 4.4), (4.6, -5.4), (-20.0, 0.0), (17.0, -3.0), (-5.4, -5.4)] {
            assert!((folded(&axis, rate) - shown).abs() < 1e-12, "{rate}");
        }
        let map = RangeDoppler {
            power_w: &[1.0; 20],
            range_m: &[0.0, 1.0],
            range_rate_mps: &axis,
            detections: &[[0.5, -20.0], [0.5, 33.0]],
            ..Default::default()
        };
        let chart = range_doppler_chart(&map).unwrap();
        let shown = chart.layers.iter().find_map(|l| match l {
            Layer::Marks { points, .. } => Some(points.clone()),
            _ => None,
        });
        assert!(shown.unwrap().iter().all(|[_, v]| (-5.5..4.5).contains(v)));
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
