//! Axes and their ticks.

use serde::Serialize;

/// A linear axis. `lo` is at the left or bottom, and may be larger than `hi`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Axis {
    /// Quantity and unit, e.g. `range (m)`.
    pub label: String,
    /// Value at the left or bottom end.
    pub lo: f64,
    /// Value at the right or top end.
    pub hi: f64,
    /// Ticks at 15, 30, 45, 90 degrees.
    pub degrees: bool,
    /// Named places, which are the ticks then; empty for an axis of numbers.
    pub names: Vec<(f64, String)>,
}

impl Axis {
    /// Limits that no axis can have (not finite, or equal) are replaced by usable ones.
    pub fn new(label: impl Into<String>, lo: f64, hi: f64) -> Self {
        let (lo, hi) = usable(lo, hi);
        Axis { label: label.into(), lo, hi, degrees: false, names: Vec::new() }
    }

    /// The same axis with ticks at steps that suit degrees.
    pub fn degrees(mut self) -> Self {
        self.degrees = true;
        self
    }

    /// With ticks at these places only, in growing order.
    pub fn named(mut self, names: impl IntoIterator<Item = (f64, String)>) -> Self {
        self.names = names.into_iter().collect();
        self
    }

    /// The same axis from hi to lo.
    pub fn reversed(mut self) -> Self {
        std::mem::swap(&mut self.lo, &mut self.hi);
        self
    }

    /// Grows the limits to the next ticks of about `count`.
    pub fn to_ticks(mut self, count: usize) -> Self {
        let (lo, hi) = (self.lo.min(self.hi), self.lo.max(self.hi));
        let step = nice_step((hi - lo) / count.max(1) as f64, self.degrees);
        let (a, b) = ((lo / step + 1e-9).floor() * step, (hi / step - 1e-9).ceil() * step);
        (self.lo, self.hi) = if self.lo < self.hi { (a, b) } else { (b, a) };
        self
    }

    /// 0 at `lo`, 1 at `hi`.
    pub fn fraction(&self, value: f64) -> f64 {
        (value - self.lo) / (self.hi - self.lo)
    }

    /// At most `count` nice values, in growing order; or those with names.
    pub fn ticks(&self, count: usize) -> Vec<f64> {
        if !self.names.is_empty() {
            return self.names.iter().map(|n| n.0).collect();
        }
        ticks(self.lo.min(self.hi), self.lo.max(self.hi), count, self.degrees)
    }

    /// What stands beside its ticks.
    pub fn labels(&self, ticks: &[f64]) -> Vec<String> {
        match self.names.is_empty() {
            true => tick_labels(ticks),
            false => self.names.iter().map(|n| n.1.clone()).collect(),
        }
    }
}

fn usable(lo: f64, hi: f64) -> (f64, f64) {
    // Beyond this, neighbouring ticks are lost in rounding.
    let limit = |x: f64| x.is_finite() && x.abs() < 1e15;
    if !limit(lo) || !limit(hi) {
        return (0.0, 1.0);
    }
    let least = 1e-9 * lo.abs().max(hi.abs()).max(1e-6);
    if (hi - lo).abs() >= least {
        return (lo, hi);
    }
    let by = if lo == 0.0 { 1.0 } else { 0.05 * lo.abs() };
    (lo - by, hi + by)
}

/// The smallest of 1, 2, 5 times a power of ten (or a customary angle) that is at least `raw`.
pub fn nice_step(raw: f64, degrees: bool) -> f64 {
    const ANGLES: [f64; 9] = [1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 45.0, 90.0, 180.0];
    if degrees && raw > 0.5 && raw <= 180.0 {
        return ANGLES.into_iter().find(|s| *s >= raw * (1.0 - 1e-9)).unwrap_or(180.0);
    }
    let power = 10f64.powf(raw.log10().floor());
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * power).find(|s| *s >= raw * (1.0 - 1e-9)).unwrap_or(raw)
}

fn ticks(lo: f64, hi: f64, count: usize, degrees: bool) -> Vec<f64> {
    let count = count.max(2);
    let mut step = nice_step((hi - lo) / count as f64, degrees);
    loop {
        let first = (lo / step - 1e-6).ceil();
        let last = (hi / step + 1e-6).floor();
        let n = (last - first + 1.0).max(0.0) as usize;
        if n <= count {
            // Adding zero turns a negative zero into a plain one.
            return (0..n).map(|i| (first + i as f64) * step + 0.0).collect();
        }
        step = nice_step(step * 1.5, degrees);
    }
}

/// Labels with as many decimals as the spacing needs, and a true minus sign.
pub fn tick_labels(ticks: &[f64]) -> Vec<String> {
    let step = ticks.windows(2).map(|w| (w[1] - w[0]).abs()).fold(f64::INFINITY, f64::min);
    let step = if step.is_finite() { step } else { 1.0 };
    let largest = ticks.iter().fold(0f64, |m, t| m.max(t.abs()));
    let scientific = largest >= 1e6 || (largest > 0.0 && largest < 1e-3);
    ticks
        .iter()
        .map(|t| {
            let text = if scientific {
                format!("{t:.2e}")
            } else {
                let decimals = (0..9).find(|d| {
                    let scaled = step * 10f64.powi(*d);
                    (scaled - scaled.round()).abs() < 1e-6 * scaled.max(1.0)
                });
                format!("{t:.*}", decimals.unwrap_or(6) as usize)
            };
            text.replace('-', "−")
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn customary_ticks() {
        assert_eq!(Axis::new("", 0.0, 62.4).ticks(8), [0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0]);
        assert_eq!(Axis::new("", -20.3, 20.3).ticks(6), [-20.0, -10.0, 0.0, 10.0, 20.0]);
        assert_eq!(
            Axis::new("", -90.0, 90.0).degrees().ticks(8),
            [-90.0, -60.0, -30.0, 0.0, 30.0, 60.0, 90.0]
        );
        assert_eq!(Axis::new("", 0.0, 5.0).degrees().ticks(6), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!(tick_labels(&[-0.5, 0.0, 0.5]), ["−0.5", "0.0", "0.5"]);
        assert_eq!(tick_labels(&[0.0, 0.02, 0.04]), ["0.00", "0.02", "0.04"]);
        let a = Axis::new("", -93.0, -21.0).to_ticks(8);
        assert_eq!((a.lo, a.hi), (-100.0, -20.0));
    }

    #[test]
    fn impossible_limits_become_usable() {
        for (lo, hi) in [(f64::NAN, 1.0), (f64::NEG_INFINITY, 0.0), (3.0, 3.0), (0.0, 0.0), (1e300, -1e300)] {
            let a = Axis::new("", lo, hi);
            assert!(a.lo < a.hi && a.ticks(6).len() >= 2, "{lo} {hi} {a:?}");
        }
    }

    proptest! {
        #[test]
        fn ticks_are_nice_few_and_inside(lo in -1e5f64..1e5, log_span in -3f64..5.0, count in 2usize..12) {
            let hi = lo + 10f64.powf(log_span);
            let t = Axis::new("", lo, hi).ticks(count);
            prop_assert!(t.len() <= count);
            let slack = 1e-4 * (hi - lo);
            prop_assert!(t.iter().all(|v| *v >= lo - slack && *v <= hi + slack));
            for w in t.windows(2) {
                let step = w[1] - w[0];
                let mantissa = step / 10f64.powf((step * 1.000001).log10().floor());
                prop_assert!([1.0, 2.0, 5.0].iter().any(|m| (mantissa - m).abs() < 1e-3), "{}", mantissa);
            }
        }
    }
}
