//! Local maxima among the detected cells.

use crate::dsp::{Cell, PowerMap, Real, peaks};

/// Cells of the mask that no neighbour (3 x 3, Doppler wraps, detected or not) exceeds, strongest
/// first. Of equal neighbours the one with the lower row, then the lower column, stands.
pub fn peaks<T: Real>(map: &PowerMap<T>, mask: &[bool]) -> Vec<Cell> {
    let (rows, cols) = (map.doppler_bins, map.range_bins);
    let stands = |at: usize| {
        let (d, r, here) = (at / cols, at % cols, map.data[at]);
        [rows - 1, 0, 1].iter().all(|step| {
            (r.saturating_sub(1)..=(r + 1).min(cols - 1)).all(|j| {
                let other = (d + step) % rows * cols + j;
                other == at || map.data[other] < here || (map.data[other] == here && other > at)
            })
        })
    };
    let mut cells: Vec<Cell> = mask
        .iter()
        .enumerate()
        .filter(|(at, detected)| **detected && stands(*at))
        .map(|(at, _)| Cell { doppler: (at / cols) as u32, range: (at % cols) as u32 })
        .collect();
    peaks::sort(map, &mut cells);
    cells
}
