//! The noise in single cells, from their training cells listed one by one (CONVENTIONS eq. 17, 85).

use super::{cfar_go_so, cfar_os};
use crate::base::tasks::Tasks;
use crate::dsp::cfar_window::{Column, Halves, Reach, halves, reach};
use crate::dsp::{Cell, PowerMap, Real};
use crate::scene::radar::{Cfar, CfarKind};
use rayon::prelude::*;

/// The noise power in W in single cells: the detector's statistic over its expectation on noise of unit
/// mean (eq. 17).
pub fn noise<T: Real>(map: &PowerMap<T>, cfar: &Cfar, columns: &[Column], cells: &[Cell]) -> Vec<T> {
    cells
        .par_iter()
        .with_min_len(64)
        .map_init_tasks(Vec::new, |training, cell| {
            let column = &columns[cell.range as usize];
            training.clear();
            let before = gather(map, cfar, *cell, training);
            if let CfarKind::Os { .. } = cfar.kind {
                return T::of(column.scale) * cfar_os::statistic(training, column.rank);
            }
            let sum = |cells: &[T]| cells.iter().map(|p| p.wide()).sum::<f64>();
            let statistic = match cfar.kind {
                CfarKind::Go | CfarKind::So => {
                    let (a, b) = training.split_at(before);
                    cfar_go_so::choose(cfar.kind, [a, b].map(|c| (sum(c), c.len() as u32)))
                }
                _ => sum(training) / f64::from(column.count),
            };
            T::of(column.scale * statistic)
        })
        .collect()
}

/// Lists the training cells, of GO and SO those of the half before first, and says how many these are.
fn gather<T: Real>(map: &PowerMap<T>, cfar: &Cfar, cell: Cell, out: &mut Vec<T>) -> usize {
    let (rows, cols) = (map.doppler_bins, map.range_bins);
    let (d, r) = (cell.doppler as usize, cell.range as usize);
    let (guard, half) = (cfar.guard[0], cfar.guard[0] + cfar.train[0]);
    let Reach { outer, inner } = reach(cfar, r, cols);
    // Columns from..to of rows first..=last of the window.
    let mut take = |[first, last]: [usize; 2], from: usize, to: usize| {
        for i in first..=last {
            let row = &map.data[(d + rows + i - half) % rows * cols..][..cols];
            if i.abs_diff(half) <= guard {
                out.extend_from_slice(&row[from..to.min(inner.0).max(from)]);
                out.extend_from_slice(&row[from.max(inner.1 + 1).min(to)..to]);
            } else {
                out.extend_from_slice(&row[from..to]);
            }
        }
        out.len()
    };
    let (all, end) = ([0, 2 * half], outer.1 + 1);
    match (cfar.kind, halves(cfar)) {
        (CfarKind::Go | CfarKind::So, Halves::AlongRange) => {
            let before = take(all, outer.0, r);
            take(all, r + 1, end);
            before
        }
        (CfarKind::Go | CfarKind::So, Halves::AlongDoppler) => {
            // Without training columns there are training rows.
            let before = take([0, half - guard - 1], outer.0, end);
            take([half + guard + 1, 2 * half], outer.0, end);
            before
        }
        _ => take(all, outer.0, end),
    }
}
