//! Bartlett beamformer (CONVENTIONS eq. 19).

use crate::base::tasks::Tasks;
use crate::dsp::doa_beamform::Beamformer;
use crate::dsp::{Real, Snapshots};
use num_complex::Complex;
use rayon::prelude::*;

/// |y|^2 in W, `[cell, elevation, azimuth]`. `range_rates_mps`: one for each cell, from its
/// interpolated row.
pub fn spectra<T: Real>(beam: &Beamformer, snapshots: &Snapshots<T>, range_rates_mps: &[f64]) -> Vec<T> {
    beams(beam, snapshots, range_rates_mps, |y| y.norm_sqr())
}

/// The amplitudes y themselves, sqrt(W), `[cell, elevation, azimuth]`: their |y|^2 is to the bit what [`spectra`] gives.
pub fn amplitudes<T: Real>(
    beam: &Beamformer,
    snapshots: &Snapshots<T>,
    range_rates_mps: &[f64],
) -> Vec<Complex<T>> {
    beams(beam, snapshots, range_rates_mps, |y| y)
}

fn beams<T: Real, Y: Clone + Default + Send>(
    beam: &Beamformer,
    snapshots: &Snapshots<T>,
    range_rates_mps: &[f64],
    of: impl Fn(Complex<T>) -> Y + Sync,
) -> Vec<Y> {
    let channels = beam.channels();
    let complex = |z: num_complex::Complex64| Complex::new(T::of(z.re), T::of(z.im));
    let steering: Vec<Complex<T>> = beam.steering().into_iter().map(complex).collect();
    let mut out = vec![Y::default(); beam.grid.len() * range_rates_mps.len()];
    out.par_chunks_mut(beam.grid.len()).enumerate().for_each_init_tasks(Vec::new, |x, (cell, out)| {
        x.clear();
        x.extend(
            snapshots
                .of(cell)
                .iter()
                .enumerate()
                .map(|(c, z)| *z * complex(beam.correction(c, range_rates_mps[cell]))),
        );
        for (p, steer) in out.iter_mut().zip(steering.chunks_exact(channels)) {
            *p = of(x.iter().zip(steer).map(|(x, s)| x * s).sum());
        }
    });
    out
}
