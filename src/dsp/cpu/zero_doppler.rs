//! Removal of everything at rest (CONVENTIONS eq. 88).

use crate::base::tasks::Tasks;
use crate::dsp::Real;
use crate::dsp::zero_doppler::AtRest;
use num_complex::{Complex, Complex64};
use rayon::prelude::*;

/// Subtracts from every column of `[chirp, column]` what `rest` says of it, its mean over the chirps or the sum of
/// what the transmitters' turns leave of it: echoes whose phase does not change from chirp to chirp, and leakage, are
/// gone, whatever the window. Sums are f64.
pub fn remove<T: Real>(data: &mut [Complex<T>], columns: usize, rest: &AtRest) {
    if columns == 0 || data.is_empty() {
        return;
    }
    let period = rest.period;
    let mut sums = vec![Complex64::default(); period * columns];
    sums.par_chunks_mut(columns).enumerate().for_each_tasks(|(first, sums)| {
        sums.par_chunks_mut(512).enumerate().for_each_tasks(|(i, sums)| {
            for row in data.chunks_exact(columns).skip(first).step_by(period) {
                for (s, x) in sums.iter_mut().zip(&row[i * 512..]) {
                    *s += Complex::new(x.re.wide(), x.im.wide());
                }
            }
        });
    });
    let mut resting = vec![Complex::<T>::default(); period * columns];
    resting.par_chunks_mut(columns).zip(rest.projection.par_chunks(period)).for_each_tasks(
        |(out, weights)| {
            for (i, out) in out.iter_mut().enumerate() {
                let x: Complex64 =
                    weights.iter().zip(sums.iter().skip(i).step_by(columns)).map(|(w, s)| w * s).sum();
                *out = Complex::new(T::of(x.re), T::of(x.im));
            }
        },
    );
    data.par_chunks_mut(columns).enumerate().for_each_tasks(|(m, row)| {
        for (x, r) in row.iter_mut().zip(&resting[m % period * columns..]) {
            *x = *x - *r;
        }
    });
}
