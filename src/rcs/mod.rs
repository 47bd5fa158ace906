//! Radar cross sections: the scattering matrix over frequency and direction, and its table.

pub mod closed_form;
pub mod po_sum;
pub mod table;

use num_complex::Complex64;

/// Where the radar stands while a cross section is taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Distance {
    /// Plane wave.
    Infinite,
    /// Radar at this distance from the target's origin; S is normalised with it (CONVENTIONS eq. 3).
    At(f64),
}

/// One direction of a sweep, radians: the radar stands towards (azimuth, elevation) of the target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aspect {
    pub azimuth: f64,
    pub elevation: f64,
}

/// How to take a sweep at one frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RcsOptions {
    pub bounces: usize,
    pub rays_per_wavelength: f64,
    pub distance: Distance,
}

/// S[rx][tx] in m, index 0 is V, for both conventions of which bounces radiate.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Scattering {
    pub every: [[Complex64; 2]; 2],
    pub last: [[Complex64; 2]; 2],
}

impl Scattering {
    /// Adds another part of the same target.
    pub fn add(&mut self, o: &Scattering) {
        for rx in 0..2 {
            for tx in 0..2 {
                self.every[rx][tx] += o.every[rx][tx];
                self.last[rx][tx] += o.last[rx][tx];
            }
        }
    }

    pub fn of(&self, convention: crate::trace::Convention) -> &[[Complex64; 2]; 2] {
        match convention {
            crate::trace::Convention::Every => &self.every,
            crate::trace::Convention::Last => &self.last,
        }
    }
}
