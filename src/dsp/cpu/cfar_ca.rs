//! Cell-averaging CFAR (CONVENTIONS eq. 17).

use super::cfar::ColumnSums;
use crate::base::tasks::Tasks;
use crate::dsp::cfar_window::Column;
use crate::dsp::{PowerMap, Real};
use crate::scene::radar::Cfar;
use rayon::prelude::*;

/// Which cells are detected.
pub fn cfar_ca<T: Real>(map: &PowerMap<T>, cfar: &Cfar, columns: &[Column]) -> Vec<bool> {
    let cols = map.range_bins;
    let reach = (cfar.guard[1] + cfar.train[1]) as isize;
    let mut mask = vec![false; map.data.len()];
    mask.par_chunks_mut(cols).enumerate().with_min_len(8).for_each_init_tasks(
        || (ColumnSums::default(), vec![0.0; cols]),
        |(down, sums), (d, mask)| {
            down.gather(map, cfar, d);
            sums.fill(0.0);
            down.add_along(cfar, -reach..=reach, sums);
            let powers = &map.data[d * cols..][..cols];
            for (((mask, p), sum), column) in mask.iter_mut().zip(powers).zip(&*sums).zip(columns) {
                *mask = p.wide() > column.factor * (sum / f64::from(column.count));
            }
        },
    );
    mask
}
