//! The channels of the detected cells.

use crate::dsp::{Cell, Real, Snapshots, Spectrum};

/// Gathers the snapshots `[cell, channel]` of the cells out of the spectrum `[doppler, channel, range]`.
pub fn snapshots<T: Real>(spectrum: &Spectrum<T>, cells: &[Cell]) -> Snapshots<T> {
    let channels = spectrum.channels;
    let data = cells
        .iter()
        .flat_map(|cell| {
            let start = cell.doppler as usize * channels * spectrum.range_bins + cell.range as usize;
            (0..channels).map(move |c| spectrum.data[start + c * spectrum.range_bins])
        })
        .collect();
    Snapshots { channels, data }
}
