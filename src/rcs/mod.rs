//! Radar cross sections: the scattering matrix over frequency and direction, and its table.
//!
//! S is in metres, σ = 4π|S|² (CONVENTIONS eq. 3). The method is physical optics (eq. 5) over exact beams (eq. 50–54)
//! with several bounces, on request with the diffraction of metal edges ([`Diffraction::Ptd`]) and a plane below
//! ([`Ground`]). It assumes surfaces of some wavelengths that are not seen at grazing angles ([`validity`]). Beams are
//! found once for all frequencies; their number grows with the visible faces and the bounces, not with the size in
//! wavelengths.

pub mod beam_sum;
pub mod closed_form;
pub mod cpu;
pub mod diffuse;
pub mod ground;
pub mod po_sum;
pub mod polarisation;
pub mod sphere;
pub mod table;
pub mod validity;

use crate::base::error::{BadInput, Result};
use crate::base::frames::{direction_from_angles, polarisation_basis};
use crate::base::matrix::Matrix2;
use crate::base::units::{power_from_db, wavenumber};
use crate::geom::Geometry;
use crate::scene::Scene;
use crate::trace::beams::Port;
use glam::DVec3;
use num_complex::Complex64;

/// Where the radar stands while a cross section is taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Distance {
    /// Plane wave.
    Infinite,
    /// Radar at this distance from the origin of directions, which is the target's own unless
    /// [`RcsOptions::height_m`] raises it; S is normalised with the distance of the target's origin
    /// (CONVENTIONS eq. 3).
    At(f64),
}

impl Distance {
    /// The port of a radar that is seen from the target at `aspect`.
    pub fn port(self, aspect: Aspect) -> Port {
        let u = direction_from_angles(aspect.azimuth, aspect.elevation);
        match self {
            Distance::Infinite => Port::Far(u),
            Distance::At(r) => Port::At(u * r),
        }
    }
}

/// What is added to physical optics at edges.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Diffraction {
    /// Nothing.
    #[default]
    None,
    /// First-order physical theory of diffraction on metal edges (CONVENTIONS eq. 30-39).
    Ptd,
}

/// One direction of a sweep, radians: the radar stands towards (azimuth, elevation) of the target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aspect {
    /// Azimuth, rad.
    pub azimuth: f64,
    /// Elevation, rad.
    pub elevation: f64,
}

/// A direction to transmit from and one to receive in, seen from the target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BistaticAspect {
    /// Direction to the transmitter.
    pub transmit: Aspect,
    /// Direction to the receiver.
    pub receive: Aspect,
}

impl BistaticAspect {
    /// Transmitter and receiver in one direction.
    pub fn monostatic(aspect: Aspect) -> Self {
        BistaticAspect { transmit: aspect, receive: aspect }
    }

    /// Whether both directions are one.
    pub fn is_monostatic(&self) -> bool {
        self.transmit == self.receive
    }
}

/// The plane z = 0 under the target.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Ground {
    /// No plane.
    #[default]
    None,
    /// A plane of this material.
    Plane(crate::scene::Material),
}

/// How to take a cross section.
#[derive(Debug, Clone, PartialEq)]
pub struct RcsOptions {
    /// Number of reflections of one beam, 1..=MAX_BOUNCES. Faces that it passes do not count: three reflections are all
    /// that a trihedral needs, filled or empty. Each way to and fro in a slab takes two more.
    pub bounces: usize,
    /// [`Sweep::take`](crate::engine::sweep::Sweep::take) follows more reflections, until the result is within the accuracy of that with so many; as many as `bounces` or fewer leave it at those.
    pub most_bounces: usize,
    /// How far the radar stands.
    pub distance: Distance,
    /// Error that curved surfaces and finite ranges may bring, dB; flat facets seen from infinity have none. Facets
    /// with smooth normals are curved ([`crate::geom::curved`]).
    pub accuracy_db: f64,
    /// What is added at edges.
    pub diffraction: Diffraction,
    /// What lies under the target.
    pub ground: Ground,
    /// Height of the target's origin over the plane z = 0, m. Directions and the distance of the radar are those seen from the
    /// point of that plane below the target's origin, to which phases are referred too.
    pub height_m: f64,
    /// Whether to compute also the convention "last", which costs about half as much again. Without it
    /// `Scattering::last` is NaN.
    pub last: bool,
}

/// Why waves cannot be followed through what stands in their way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Impassable {
    /// A body that they pass through is not closed, touches or holds another one, or a sheet lies on or in it.
    NoBody,
    /// They are followed through bodies as plane waves only, and a port stands at a finite place.
    NearPort,
}

impl Default for RcsOptions {
    fn default() -> Self {
        RcsOptions {
            bounces: 3,
            most_bounces: 3,
            distance: Distance::Infinite,
            accuracy_db: 0.1,
            diffraction: Diffraction::None,
            ground: Ground::None,
            height_m: 0.0,
            last: true,
        }
    }
}

impl RcsOptions {
    /// The scene with its origin raised by `height_m`, and the options with which S of it is computed.
    pub fn raised(&self, scene: &Scene) -> (Scene, RcsOptions) {
        let mut scene = scene.clone();
        for o in &mut scene.objects {
            o.pose.translation_m.z += self.height_m;
        }
        (scene, RcsOptions { height_m: 0.0, ..self.clone() })
    }

    /// Distance of the raised origin from a radar in the direction `aspect`, over the distance of the point
    /// below it; 1 for a plane wave.
    pub fn distance_ratio(&self, aspect: Aspect) -> f64 {
        match self.distance {
            Distance::Infinite => 1.0,
            Distance::At(r) => {
                let radar = direction_from_angles(aspect.azimuth, aspect.elevation) * r;
                (radar - DVec3::Z * self.height_m).length() / r
            }
        }
    }
}

/// A uniform grid of rays: the check on the exact beams, and slower than they are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayGrid {
    /// Largest number of bounces of a ray.
    pub bounces: usize,
    /// Number of rays for each wavelength, along both axes.
    pub rays_per_wavelength: f64,
    /// How far the radar stands.
    pub distance: Distance,
}

/// `S[rx][tx]` in m, index 0 is V, for both conventions of which bounces radiate.
///
/// # Example
/// On the boresight of a trihedral the last of three bounces alone gives the textbook value 4πa⁴/(3λ²). With the
/// convention that every bounce radiates, the single and double bounces add their part.
///
/// ```
/// use catseye::base::units::{db_from_power, dbsm_from_amplitude};
/// use catseye::engine::{Engine, Precision};
/// use catseye::rcs::{Aspect, BistaticAspect, RcsOptions, closed_form::go_trihedral_m2};
/// use catseye::road::reflector::Reflector;
/// use catseye::{base::frames::direction_from_angles, scene::material};
///
/// let corner = Reflector::parse("trihedral:leg_m=0.1")?.to_scene(&material::by_name)?;
/// let boresight = Aspect { azimuth: 0.0, elevation: 0.5f64.sqrt().atan() };
/// let aspects = [BistaticAspect::monostatic(boresight)];
/// let engine = Engine::open("cpu", Precision::F32)?;
/// let s = engine.rcs(&corner, &[77e9], &aspects, &RcsOptions::default())?[0];
/// let (every_dbsm, last_dbsm) = (dbsm_from_amplitude(s.every[0][0].norm()), dbsm_from_amplitude(s.last[0][0].norm()));
/// let textbook_m2 = go_trihedral_m2(0.1, 77e9, direction_from_angles(0.0, boresight.elevation));
/// assert!((last_dbsm - db_from_power(textbook_m2)).abs() < 0.01);
/// assert!((every_dbsm - last_dbsm).abs() < 0.3);
/// # Ok::<(), catseye::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Scattering {
    /// Every bounce radiates.
    pub every: Matrix2,
    /// Only the last bounce radiates.
    pub last: Matrix2,
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

    /// Multiplies both matrices by a factor.
    pub fn scale(&mut self, factor: f64) {
        for z in self.every.iter_mut().chain(&mut self.last).flatten() {
            *z *= factor;
        }
    }

    /// Whether all entries are finite.
    pub fn is_finite(&self) -> bool {
        self.every.iter().chain(&self.last).flatten().all(|z| z.re.is_finite() && z.im.is_finite())
    }

    /// The matrix of one convention.
    pub fn of(&self, convention: crate::base::convention::Convention) -> &Matrix2 {
        match convention {
            crate::base::convention::Convention::Every => &self.every,
            crate::base::convention::Convention::Last => &self.last,
        }
    }
}

/// Computes S of the geometry's point targets, sqrt(sigma / 4 pi) in both polarisations, and of its scattering tables,
/// each with its phase. Neither is bounced, so the two conventions agree; what facets hide from the transmitter or the
/// receiver is left out.
///
/// # Errors
/// Returns an error if a scattering table is seen with transmitter and receiver apart, or has no value at the
/// frequency.
pub fn point_sum(
    geometry: &Geometry,
    aspect: BistaticAspect,
    freq_hz: f64,
    distance: Distance,
) -> Result<Scattering> {
    let k = wavenumber(freq_hz);
    let directions = [aspect.transmit, aspect.receive].map(|a| direction_from_angles(a.azimuth, a.elevation));
    if !aspect.is_monostatic() && !geometry.tables.is_empty() {
        return Err(BadInput::new("a scattering table contains only echoes in the direction of incidence")
            .key("rcs_table")
            .remedy("remove it from the scene for other directions and for a ground")
            .into());
    }
    let mut sum = [[Complex64::ZERO; 2]; 2];
    let mut add = |position: DVec3, s: &dyn Fn(DVec3) -> Matrix2| {
        // Towards each antenna, and its amplitude and way against the origin's.
        let legs = directions.map(|u| match distance {
            Distance::Infinite => (u, f64::INFINITY, 1.0, -u.dot(position)),
            Distance::At(r0) => {
                let d = u * r0 - position;
                (d / d.length(), d.length(), r0 / d.length(), d.length() - r0)
            }
        });
        let hidden = legs
            .iter()
            .any(|(to, r, ..)| geometry.bvh.any_hit(&geometry.triangles, position, *to, u32::MAX, *r));
        if hidden {
            return;
        }
        let factor = Complex64::from_polar(legs[0].2 * legs[1].2, -k * (legs[0].3 + legs[1].3));
        for (z, x) in sum.as_flattened_mut().iter_mut().zip(s(legs[0].0).as_flattened()) {
            *z += x * factor;
        }
    };
    for p in &geometry.points {
        let amplitude = (power_from_db(p.rcs_dbsm) / (4.0 * std::f64::consts::PI)).sqrt().into();
        add(p.position_m, &|_| [[amplitude, Complex64::ZERO], [Complex64::ZERO, amplitude]]);
    }
    for t in &geometry.tables {
        let band = t.table.band(freq_hz)?;
        add(t.position_m, &|to| t.scattering(&band, to, polarisation_basis(to)));
    }
    Ok(Scattering { every: sum, last: sum })
}
