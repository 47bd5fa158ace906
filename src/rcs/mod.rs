//! Radar cross sections: the scattering matrix over frequency and direction, and its table.

pub mod beam_sum;
pub mod closed_form;
pub mod po_sum;
pub mod table;

use crate::frames::direction_from_angles;
use crate::geom::Geometry;
use crate::units::{power_from_db, wavenumber};
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

/// A direction to transmit from and one to receive in, seen from the target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    pub transmit: Aspect,
    pub receive: Aspect,
}

impl Look {
    pub fn monostatic(aspect: Aspect) -> Self {
        Look { transmit: aspect, receive: aspect }
    }

    pub fn is_monostatic(&self) -> bool {
        self.transmit == self.receive
    }
}

/// What edges add to physical optics.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Diffraction {
    #[default]
    None,
    /// First-order physical theory of diffraction.
    Ptd,
}

/// The plane z = 0 under the target.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Ground {
    #[default]
    None,
    Plane(crate::scene::Material),
}

/// How to take a cross section.
#[derive(Debug, Clone, PartialEq)]
pub struct RcsOptions {
    /// Facets met by one beam, 1..=MAX_BOUNCES.
    pub bounces: usize,
    pub distance: Distance,
    /// Error that curved bodies and finite ranges may have, dB; flat facets seen from infinity have none.
    pub accuracy_db: f64,
    pub diffraction: Diffraction,
    pub ground: Ground,
}

impl Default for RcsOptions {
    fn default() -> Self {
        RcsOptions {
            bounces: 3,
            distance: Distance::Infinite,
            accuracy_db: 0.1,
            diffraction: Diffraction::None,
            ground: Ground::None,
        }
    }
}

/// A uniform grid of rays: the check on the exact beams, and slower than they are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayGrid {
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

    pub fn scale(&mut self, factor: f64) {
        for z in self.every.iter_mut().chain(&mut self.last).flatten() {
            *z *= factor;
        }
    }

    pub fn is_finite(&self) -> bool {
        self.every.iter().chain(&self.last).flatten().all(|z| z.re.is_finite() && z.im.is_finite())
    }

    pub fn of(&self, convention: crate::trace::Convention) -> &[[Complex64; 2]; 2] {
        match convention {
            crate::trace::Convention::Every => &self.every,
            crate::trace::Convention::Last => &self.last,
        }
    }
}

/// S of the geometry's point targets: sqrt(sigma / 4 pi) in both polarisations at its phase, not hidden
/// by facets and not bounced. Points have no bounces, so the two conventions agree.
pub fn point_sum(geometry: &Geometry, aspect: Aspect, options: &RayGrid) -> Scattering {
    let k = wavenumber(geometry.freq_hz);
    let u = direction_from_angles(aspect.azimuth, aspect.elevation);
    let mut sum = Complex64::ZERO;
    for p in &geometry.points {
        let amplitude = (power_from_db(p.rcs_dbsm) / (4.0 * std::f64::consts::PI)).sqrt();
        sum += match options.distance {
            Distance::Infinite => Complex64::from_polar(amplitude, 2.0 * k * u.dot(p.position_m)),
            Distance::At(r0) => {
                let r = (u * r0 - p.position_m).length();
                Complex64::from_polar(amplitude * (r0 / r).powi(2), -2.0 * k * (r - r0))
            }
        };
    }
    let s = [[sum, Complex64::ZERO], [Complex64::ZERO, sum]];
    Scattering { every: s, last: s }
}
