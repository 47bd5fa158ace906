//! Whether a cube looks as if it were the conjugate of what the radar's conventions have (CONVENTIONS eq. 12): then an echo from R is seen
//! at the end of the ranges less R, with the other sign of range rate and angle.

use crate::dsp::PowerMap;
use crate::scene::radar::{Radar, Sampling};
use crate::scene::waveform::Waveform;

/// What the strongest far echo has to have over all that is nearer, dB.
const LEAST_DB: f64 = 20.0;
/// Cells beside range zero that hold leakage and constants.
const NEAR_CELLS: usize = 3;

/// A line for the user if the strongest echo of a map `[doppler, range]` is in the upper half of the ranges and nothing in the lower half comes
/// within 20 dB of it. Echoes fall off with the fourth power of range, and something near echoes in nearly every scene; conjugate samples
/// have it at the far end. Nothing can be said of real samples and of codes, which do not mirror.
pub fn looks_conjugate(radar: &Radar, map: &PowerMap<f64>) -> Option<String> {
    let is_ramp = matches!(radar.waveform, Waveform::Fmcw(_)) && radar.sampling == Sampling::Iq;
    let bins = map.range_bins;
    if !is_ramp || bins != radar.processing.range_fft || bins < 8 * NEAR_CELLS {
        return None;
    }
    let mut columns = vec![0.0f64; bins];
    for row in map.data.chunks_exact(bins) {
        columns.iter_mut().zip(row).for_each(|(c, p)| *c = c.max(*p));
    }
    // Cells of the window's main lobe are wider where the transform is padded.
    let near = NEAR_CELLS * bins.div_ceil(radar.samples.max(1));
    let middle = bins / 2;
    let far = (middle + 1..bins - near).max_by(|a, b| columns[*a].total_cmp(&columns[*b]))?;
    let nearer = (near..middle).map(|k| columns[k]).fold(0.0, f64::max);
    let ratio_db = 10.0 * (columns[far] / nearer).log10();
    let bin_m = radar.range_bin_m();
    (columns[far] > 0.0 && ratio_db > LEAST_DB).then(|| {
        format!(
            "the strongest echo is at {:.1} m of {:.1} m, and the nearer half of the ranges has no echo within {LEAST_DB} dB of it: if the samples have the opposite sign of phase, their conjugate places it at {:.1} m",
            far as f64 * bin_m,
            bins as f64 * bin_m,
            (bins - far) as f64 * bin_m
        )
    })
}
