//! Lines of pulses and codes to samples, on the host for both engines (CONVENTIONS eq. 12b).

use crate::adc::Cube;
use crate::adc::shaping::Shaping;
use crate::base::tasks::Tasks;
use crate::scene::radar::Sampling;
use catseye_math::Real;
use num_complex::{Complex, Complex64};
use rayon::prelude::*;
use std::f64::consts::SQRT_2;

/// Adds set `order` of lines, `[chirp, channel, line]`, to the samples.
pub fn add<T: Real>(shaping: &Shaping, lines: &Cube<T>, order: u32, samples: &mut Cube<T>) {
    let fft = catseye_math::fft::forward::<T>(shaping.period);
    let narrow = |z: Complex64| Complex::new(T::of(z.re), T::of(z.im));
    let weights: Vec<Complex<T>> = shaping.weights(order).into_iter().map(narrow).collect();
    let times: Vec<T> = shaping.times(order).into_iter().map(T::of).collect();
    let buffers = || {
        (vec![Complex::default(); shaping.period], vec![Complex::default(); fft.get_inplace_scratch_len()])
    };
    samples
        .data
        .par_chunks_mut(shaping.samples)
        .zip(lines.data.par_chunks(shaping.lines.count))
        .for_each_init_tasks(buffers, |(row, scratch), (out, line)| {
            row.fill(Complex::default());
            for (k, (l, w)) in line.iter().zip(&weights).enumerate() {
                row[(shaping.first + k) % shaping.period] = *l * *w;
            }
            fft.process_with_scratch(row, scratch);
            for ((o, x), t) in out.iter_mut().zip(row.iter()).zip(&times) {
                match shaping.sampling {
                    Sampling::Iq => *o = *o + x.scale(*t),
                    Sampling::Real => o.re = o.re + T::of(SQRT_2) * x.re * *t,
                }
            }
        });
}
