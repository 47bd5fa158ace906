//! Sums of training cells (CONVENTIONS eq. 17, 85).

use crate::dsp::{PowerMap, Real};
use crate::scene::radar::Cfar;
use std::ops::RangeInclusive;

/// Sums down the columns of a window's rows, in f64. By additions alone: a summed-area table would
/// subtract the strong target in the guard cells from itself and lose the noise around it.
#[derive(Default)]
pub(super) struct ColumnSums {
    /// Rows before and after the guard cells.
    before: Vec<f64>,
    after: Vec<f64>,
    /// Both, and these with the rows of the guard cells.
    beyond: Vec<f64>,
    all: Vec<f64>,
}

impl ColumnSums {
    /// Adds up for row `d` the training rows of each column, and the rows of its guard cells.
    pub fn gather<T: Real>(&mut self, map: &PowerMap<T>, cfar: &Cfar, d: usize) {
        let (rows, cols) = (map.doppler_bins, map.range_bins);
        let (guard, half) = (cfar.guard[0], cfar.guard[0] + cfar.train[0]);
        let ColumnSums { before, after, beyond, all } = self;
        for sums in [&mut *before, after, all] {
            sums.clear();
            sums.resize(cols, 0.0);
        }
        for i in 0..=2 * half {
            let row = &map.data[(d + rows + i - half) % rows * cols..][..cols];
            let sums = match i {
                _ if i < half - guard => &mut *before,
                _ if i > half + guard => &mut *after,
                _ => &mut *all,
            };
            for (s, p) in sums.iter_mut().zip(row) {
                *s += p.wide();
            }
        }
        beyond.clear();
        beyond.extend(before.iter().zip(&*after).map(|(a, b)| a + b));
        for (all, beyond) in all.iter_mut().zip(beyond) {
            *all += *beyond;
        }
    }

    /// Adds to each cell's sum its training cells in the columns at `offsets` from it.
    pub fn add_along(&self, cfar: &Cfar, offsets: RangeInclusive<isize>, sums: &mut [f64]) {
        for offset in offsets {
            add(if offset.unsigned_abs() <= cfar.guard[1] { &self.beyond } else { &self.all }, offset, sums);
        }
    }

    /// Adds as [`ColumnSums::add_along`] the rows before the guard cells only.
    pub fn add_before(&self, offsets: RangeInclusive<isize>, sums: &mut [f64]) {
        offsets.for_each(|offset| add(&self.before, offset, sums));
    }

    /// Adds as [`ColumnSums::add_along`] the rows after the guard cells only.
    pub fn add_after(&self, offsets: RangeInclusive<isize>, sums: &mut [f64]) {
        offsets.for_each(|offset| add(&self.after, offset, sums));
    }
}

/// sums[r] += values[r + offset] where there is one.
fn add(values: &[f64], offset: isize, sums: &mut [f64]) {
    let skipped = offset.unsigned_abs().min(values.len());
    let (to, from) = if offset < 0 { (skipped, 0) } else { (0, skipped) };
    for (s, v) in sums[to..].iter_mut().zip(&values[from..]) {
        *s += *v;
    }
}
