//! Power against range with the detector's threshold.

use super::axis::Axis;
use super::canvas::{GREY, Pen, Picture};
use super::chart::{CURVE_COLOURS, Chart, Layer, Mark, Symbol, finite_range};
use super::range_doppler::{Unmarked, add_unmarked, decibel_limits};
use catseye::base::error::Result;

/// Power over range with what was detected.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RangeProfile<'a> {
    /// Title of the picture.
    pub title: &'a str,
    /// Range of each bin, m.
    pub range_m: &'a [f64],
    /// Power in each bin, dBm.
    pub power_dbm: &'a [f64],
    /// CFAR threshold of each cell; may be empty.
    pub threshold_dbm: &'a [f64],
    /// Expected thermal noise in a cell.
    pub noise_dbm: Option<f64>,
    /// (range in m, power in dBm) of each detection.
    pub detections: &'a [[f64; 2]],
    /// Peaks over the threshold that are none of them, at (range in m, power in dBm).
    pub unmarked: &'a [Unmarked<'a>],
}

/// The lower limit is 12 dB under the noise (given, or the median), so that deep nulls are cut off.
///
/// # Errors
/// A picture that is too large, or nothing that can be drawn.
pub fn range_profile(input: &RangeProfile) -> Result<Picture> {
    range_profile_chart(input).draw()
}

pub(super) fn range_profile_chart(input: &RangeProfile) -> Chart {
    let (x0, x1) = finite_range(input.range_m.iter().copied()).unwrap_or((0.0, 1.0));
    let everything = || input.power_dbm.iter().chain(input.threshold_dbm).copied();
    let (mut lo, hi) = decibel_limits(&everything().collect::<Vec<_>>(), 12.0, 110.0);
    if let Some(noise) = input.noise_dbm.filter(|n| n.is_finite()) {
        lo = (((noise - 12.0) / 5.0).floor() * 5.0).clamp(hi - 110.0, hi - 20.0);
    }
    // Not to the next ticks: they would give the nulls under the noise more room.
    let mut chart =
        Chart::new(input.title, Axis::new("range (m)", x0, x1), Axis::new("power (dBm)", lo, hi + 5.0));
    (chart.width, chart.height) = (640.0, 360.0);
    let curve = |y: &[f64]| -> Vec<[f64; 2]> {
        input
            .range_m
            .iter()
            .zip(y)
            .map(|(r, p)| [*r, if p.is_nan() { *p } else { p.max(lo - 500.0) }])
            .collect()
    };
    let power = Pen::solid(CURVE_COLOURS[0], 1.3);
    chart.layers.push(Layer::Line { points: curve(input.power_dbm), pen: power });
    chart.key("power", Symbol::Line(power));
    if !input.threshold_dbm.is_empty() {
        let pen = Pen::dashed(CURVE_COLOURS[1], 1.5, [7.0, 4.0]);
        chart.layers.push(Layer::Line { points: curve(input.threshold_dbm), pen });
        chart.key("CFAR threshold", Symbol::Line(pen));
    }
    if let Some(noise) = input.noise_dbm.filter(|n| n.is_finite()) {
        let pen = Pen::dashed(GREY, 1.3, [2.0, 3.0]);
        chart.layers.push(Layer::Line { points: vec![[chart.x.lo, noise], [chart.x.hi, noise]], pen });
        chart.key("thermal noise", Symbol::Line(pen));
    }
    if !input.detections.is_empty() {
        let label = format!("detections ({})", input.detections.len());
        chart.marks(label, input.detections.to_vec(), Mark::Diamond { radius: 5.0 }, CURVE_COLOURS[5]);
    }
    add_unmarked(&mut chart, input.unmarked);
    chart
}
