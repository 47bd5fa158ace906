//! Removal of everything at rest (CONVENTIONS eq. 88).

use crate::dsp::Real;
use num_complex::Complex;
use rayon::prelude::*;

/// Subtracts from every column of `[chirp, column]` its mean over the chirps: echoes whose phase does not
/// change from chirp to chirp, and leakage, are gone, whatever the window. Sums are f64.
pub fn remove<T: Real>(data: &mut [Complex<T>], columns: usize) {
    if columns == 0 || data.is_empty() {
        return;
    }
    let chirps = data.len() / columns;
    let mut mean = vec![Complex::<T>::default(); columns];
    let share = 1.0 / chirps as f64;
    mean.par_chunks_mut(512).enumerate().for_each(|(i, mean)| {
        let mut sums = [Complex::<f64>::default(); 512];
        for row in data.chunks_exact(columns) {
            for (s, x) in sums.iter_mut().zip(&row[i * 512..i * 512 + mean.len()]) {
                *s += Complex::new(x.re.wide(), x.im.wide());
            }
        }
        for (m, s) in mean.iter_mut().zip(&sums) {
            *m = Complex::new(T::of(s.re * share), T::of(s.im * share));
        }
    });
    data.par_chunks_mut(columns).for_each(|row| {
        for (x, m) in row.iter_mut().zip(&mean) {
            *x = *x - *m;
        }
    });
}
