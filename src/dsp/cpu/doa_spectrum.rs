//! Quadratic forms of many cells over a grid of directions (CONVENTIONS eq. 94).

use crate::base::tasks::Tasks;
use crate::dsp::Real;
use crate::dsp::doa_spectrum::{Forms, Steering};
use num_complex::Complex;
use rayon::prelude::*;

/// Computes the forms a^H F F^H a, `[cell, direction]`.
pub fn spectra<T: Real>(steering: &Steering, forms: &Forms) -> Vec<T> {
    let directions = steering.directions();
    let mut out = vec![T::zero(); forms.cells * directions];
    if out.is_empty() || forms.rank == 0 {
        return out;
    }
    let narrow = |z: &num_complex::Complex64| Complex::new(T::of(z.re), T::of(z.im));
    let table: Vec<Complex<T>> = steering.data.iter().map(narrow).collect();
    out.par_chunks_mut(directions).enumerate().for_each_init_tasks(Vec::new, |factor, (cell, out)| {
        let values = forms.rank * forms.channels;
        factor.clear();
        factor.extend(forms.data[cell * values..(cell + 1) * values].iter().map(|z| narrow(z).conj()));
        for (q, a) in out.iter_mut().zip(table.chunks_exact(forms.channels)) {
            for f in factor.chunks_exact(forms.channels) {
                let (mut re, mut im) = (T::zero(), T::zero());
                for (f, a) in f.iter().zip(a) {
                    re = re + f.re * a.re - f.im * a.im;
                    im = im + f.re * a.im + f.im * a.re;
                }
                *q = *q + re * re + im * im;
            }
        }
    });
    out
}
