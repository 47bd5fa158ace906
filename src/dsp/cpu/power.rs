//! Mean power over channels (CONVENTIONS eq. 14).

use crate::base::tasks::Tasks;
use crate::dsp::{PowerMap, Real, Spectrum};
use rayon::prelude::*;

/// |X|^2 in W, mean over channels.
pub fn power<T: Real>(spectrum: &Spectrum<T>) -> PowerMap<T> {
    let (doppler_bins, channels, range_bins) =
        (spectrum.doppler_bins, spectrum.channels, spectrum.range_bins);
    let mut data = vec![T::zero(); doppler_bins * range_bins];
    let share = T::of(1.0 / channels as f64);
    data.par_chunks_mut(range_bins).zip(spectrum.data.par_chunks(channels * range_bins)).for_each_tasks(
        |(out, row)| {
            for channel in row.chunks_exact(range_bins) {
                for (p, x) in out.iter_mut().zip(channel) {
                    *p = *p + x.norm_sqr();
                }
            }
            for p in out {
                *p = *p * share;
            }
        },
    );
    PowerMap { doppler_bins, range_bins, data }
}
