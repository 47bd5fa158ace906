//! From the cube to range-Doppler cells, detections and angles.

use num_complex::Complex;

/// The complex range-Doppler spectrum, `[doppler, channel, range]`, zero Doppler in the middle row,
/// rows growing with range rate. Normalised so that |X|^2 of a target in the middle of its cell is
/// its received power in W, whatever the windows.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrum<T> {
    pub doppler_bins: usize,
    pub channels: usize,
    pub range_bins: usize,
    pub data: Vec<Complex<T>>,
}

/// Mean power over channels in W, `[doppler, range]`.
#[derive(Debug, Clone, PartialEq)]
pub struct PowerMap<T> {
    pub doppler_bins: usize,
    pub range_bins: usize,
    pub data: Vec<T>,
}

/// A cell of the map that passed the detector and is the largest of its neighbourhood.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    pub doppler: u32,
    pub range: u32,
}
