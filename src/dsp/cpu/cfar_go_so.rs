//! Greatest-of and smallest-of CFAR (CONVENTIONS eq. 85).

use super::cfar::ColumnSums;
use crate::base::tasks::Tasks;
use crate::dsp::cfar_window::{Column, Halves, halves};
use crate::dsp::{PowerMap, Real};
use crate::scene::radar::{Cfar, CfarKind};
use rayon::prelude::*;

/// The greater or smaller of the means of two halves with these sums and counts; of the only one where the
/// other is empty.
pub(super) fn choose(kind: CfarKind, [a, b]: [(f64, u32); 2]) -> f64 {
    let mean = |(sum, count): (f64, u32)| sum / f64::from(count);
    match (a.1, b.1) {
        (0, _) => mean(b),
        (_, 0) => mean(a),
        _ if kind == CfarKind::Go => mean(a).max(mean(b)),
        _ => mean(a).min(mean(b)),
    }
}

/// Which cells are detected.
pub fn cfar_go_so<T: Real>(map: &PowerMap<T>, cfar: &Cfar, columns: &[Column]) -> Vec<bool> {
    let cols = map.range_bins;
    let reach = (cfar.guard[1] + cfar.train[1]) as isize;
    let mut mask = vec![false; map.data.len()];
    mask.par_chunks_mut(cols).enumerate().with_min_len(8).for_each_init_tasks(
        || (ColumnSums::default(), vec![0.0; cols], vec![0.0; cols]),
        |(down, before, after), (d, mask)| {
            down.gather(map, cfar, d);
            before.fill(0.0);
            after.fill(0.0);
            match halves(cfar) {
                Halves::AlongRange => {
                    down.add_along(cfar, -reach..=-1, before);
                    down.add_along(cfar, 1..=reach, after);
                }
                Halves::AlongDoppler => {
                    down.add_before(-reach..=reach, before);
                    down.add_after(-reach..=reach, after);
                }
            }
            let powers = &map.data[d * cols..][..cols];
            for (r, column) in columns.iter().enumerate() {
                let counts = [column.before, column.count - column.before];
                let statistic = choose(cfar.kind, [(before[r], counts[0]), (after[r], counts[1])]);
                mask[r] = powers[r].wide() > column.factor * statistic;
            }
        },
    );
    mask
}
