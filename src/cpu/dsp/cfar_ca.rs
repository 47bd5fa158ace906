//! Cell-averaging CFAR (CONVENTIONS eq. 17).

use crate::dsp::cfar::{Column, Reach, ratios, reach};
use crate::dsp::{Detection, PowerMap, Real};
use crate::scene::radar::Cfar;
use rayon::prelude::*;

/// The training sums are taken in f64, first down the columns, then along the row, by additions
/// alone: a summed-area table would subtract the strong target in the guard cells from itself and
/// lose the noise around it.
pub fn cfar_ca<T: Real>(map: &PowerMap<T>, cfar: &Cfar, columns: &[Column]) -> Detection<T> {
    let (rows, cols) = (map.doppler_bins, map.range_bins);
    let mut mask = vec![false; map.data.len()];
    let mut noise = vec![T::zero(); map.data.len()];
    let (guard, half) = (cfar.guard[0], cfar.guard[0] + cfar.train[0]);
    let buffers = || (vec![0.0f64; cols], vec![0.0f64; cols]);
    mask.par_chunks_mut(cols).zip(noise.par_chunks_mut(cols)).enumerate().for_each_init(
        buffers,
        |(beyond, within), (d, (mask, noise))| {
            beyond.fill(0.0);
            within.fill(0.0);
            for i in 0..=2 * half {
                let row = (d + rows + i - half) % rows;
                let sums = if i.abs_diff(half) <= guard { &mut *within } else { &mut *beyond };
                for (s, p) in sums.iter_mut().zip(&map.data[row * cols..][..cols]) {
                    *s += p.wide();
                }
            }
            for r in 0..cols {
                let Reach { outer, inner } = reach(cfar, r, cols);
                let sum = beyond[outer.0..=outer.1].iter().sum::<f64>()
                    + within[outer.0..inner.0].iter().sum::<f64>()
                    + within[inner.1 + 1..outer.1 + 1].iter().sum::<f64>();
                let mean = sum / f64::from(columns[r].count);
                mask[r] = map.at(d, r).wide() > columns[r].factor * mean;
                noise[r] = T::of(mean);
            }
        },
    );
    Detection { mask, noise, ratio: ratios(columns) }
}
