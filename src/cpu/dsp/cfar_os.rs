//! Order-statistic CFAR by selection (CONVENTIONS eq. 17).

use crate::dsp::cfar::{Column, Reach, ratios, reach};
use crate::dsp::{Detection, PowerMap, Real};
use crate::scene::radar::Cfar;
use rayon::prelude::*;
use std::cmp::Ordering;

/// The factor is rounded to `T` and the product factor x statistic is taken in `T`, so that the
/// f32 engine and the GPU, which count, judge every cell alike.
pub fn cfar_os<T: Real>(map: &PowerMap<T>, cfar: &Cfar, columns: &[Column]) -> Detection<T> {
    let (rows, cols) = (map.doppler_bins, map.range_bins);
    let mut mask = vec![false; map.data.len()];
    let mut noise = vec![T::zero(); map.data.len()];
    let (guard, half) = (cfar.guard[0], cfar.guard[0] + cfar.train[0]);
    mask.par_chunks_mut(cols).zip(noise.par_chunks_mut(cols)).enumerate().for_each_init(
        Vec::new,
        |cells: &mut Vec<T>, (d, (mask, noise))| {
            for r in 0..cols {
                let Reach { outer, inner } = reach(cfar, r, cols);
                cells.clear();
                for i in 0..=2 * half {
                    let row = &map.data[(d + rows + i - half) % rows * cols..][..cols];
                    if i.abs_diff(half) <= guard {
                        cells.extend_from_slice(&row[outer.0..inner.0]);
                        cells.extend_from_slice(&row[inner.1 + 1..outer.1 + 1]);
                    } else {
                        cells.extend_from_slice(&row[outer.0..=outer.1]);
                    }
                }
                // No NaN gets here: the map was checked.
                let order = |a: &T, b: &T| a.partial_cmp(b).unwrap_or(Ordering::Equal);
                let statistic = *cells.select_nth_unstable_by(columns[r].rank as usize - 1, order).1;
                mask[r] = map.at(d, r) > T::of(columns[r].factor) * statistic;
                noise[r] = T::of(columns[r].scale) * statistic;
            }
        },
    );
    Detection { mask, noise, ratio: ratios(columns) }
}
