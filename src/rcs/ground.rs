//! The plane z = 0 under a target, by images (CONVENTIONS eq. 44–48).
//!
//! A wave from direction (azimuth, e) comes to the target twice: straight, and reflected by the plane, as if from
//! (azimuth, −e); and the target's field leaves twice. The origin lies in the plane, so the four ways need
//! no phases of their own, at any distance of the radar.
//!
//! * **A perfectly conducting plane** is replaced by the target's mirror image, bounces between target and ground
//!   included as far as `bounces` reaches, shadows included: exact for the plane, as good as physical optics for the rest.
//!   Faces in the plane itself are part of the ground and left out.
//! * **A plane of a material**: the four ways with its Fresnel coefficients. A bounce from the target to the
//!   ground and back to the target is left out; a target that lies on the plane shadows the reflected wave with its own
//!   underside. Over targets of many heights or at finite range, the coefficients are those of the way to the middle of
//!   the target.
//!
//! Both hold for a plane without end. Where the first Fresnel zone reaches under the target, or is much longer
//! than what is known to be plane, take the target alone, on the conducting plane and on the material, and give all three:
//! [`remark`] says when.
//!
//! A point of 0 dBsm over a perfectly conducting plane. In HH the reflected wave has the factor −1, so that the direct
//! and the reflected path add up where the latter is half a wavelength longer, 2h sin e = λ/2: twice the field out and
//! twice back, 12 dB more. Where it is a whole wavelength longer, the point is invisible (two-ray model):
//!
//! ```
//! use catseye::base::units::{dbsm_from_amplitude, wavelength_m};
//! use catseye::engine::{Engine, Precision};
//! use catseye::rcs::{Aspect, BistaticAspect, Ground, RcsOptions};
//! use catseye::road::reflector::Reflector;
//! use catseye::scene::{Material, material};
//!
//! let (height_m, freq_hz) = (0.35, 77e9);
//! let point = Reflector::parse("point:rcs_dbsm=0")?.to_scene(&material::by_name)?;
//! let options = RcsOptions { ground: Ground::Plane(Material::pec()), height_m, last: false, ..Default::default() };
//! let aspects = [0.5, 1.0].map(|wavelengths| {
//!     let elevation = (wavelengths * wavelength_m(freq_hz) / (2.0 * height_m)).asin();
//!     BistaticAspect::monostatic(Aspect { azimuth: 0.0, elevation })
//! });
//! let found = Engine::open("cpu", Precision::F32)?.rcs(&point, &[freq_hz], &aspects, &options)?;
//! let hh_dbsm = |i: usize| dbsm_from_amplitude(found[i].every[1][1].norm());
//! assert!((hh_dbsm(0) - 40.0 * 2f64.log10()).abs() < 1e-3);
//! assert!(hh_dbsm(1) < -60.0);
//! # Ok::<(), catseye::Error>(())
//! ```

use super::{Aspect, BistaticAspect, Distance, Ground, RcsOptions, Scattering};
use crate::base::error::{BadInput, Result};
use crate::base::frames::{Pose, direction_from_angles};
use crate::base::matrix::Matrix2;
use crate::base::units::{wavelength_m, wavenumber};
use crate::geom::Surface;
use crate::scene::{Material, MaterialKind, Mesh, Scene, Shape};
use glam::{DQuat, DVec3};
use num_complex::Complex64;

/// Corners this near to the plane lie in it.
const IN_PLANE_M: f64 = 1e-6;

fn image(v: DVec3) -> DVec3 {
    DVec3::new(v.x, v.y, -v.z)
}

fn below(a: Aspect) -> Aspect {
    Aspect { azimuth: a.azimuth, elevation: -a.elevation }
}

/// Reflection coefficients (V, H) of the plane at the sine of the grazing angle (CONVENTIONS eq. 44): 1 and −1 for a
/// perfect conductor, less the loss of the coherent field on a rough plane.
///
/// # Errors
/// Returns an error if the material has no value at the frequency.
pub fn coefficients(material: &Material, freq_hz: f64, sin_grazing: f64) -> Result<[Complex64; 2]> {
    let plane = Surface::of(material, freq_hz)?;
    let (perp, par) = plane.reflection(wavenumber(freq_hz), sin_grazing.max(1e-12));
    Ok([par, perp])
}

/// Combines S of the four ways [straight in and out, reflected in, reflected out, reflected both] to S over the ground;
/// `transmit` and `receive` are the plane's reflection coefficients (V, H) on either way (CONVENTIONS eq. 45).
pub fn combine(ways: [&Scattering; 4], transmit: [Complex64; 2], receive: [Complex64; 2]) -> Scattering {
    let sum = |of: &dyn Fn(&Scattering) -> Matrix2| {
        let [dd, rd, dr, rr] = ways.map(of);
        [0, 1].map(|r| {
            [0, 1]
                .map(|t| dd[r][t] + rd[r][t] * transmit[t] + receive[r] * (dr[r][t] + rr[r][t] * transmit[t]))
        })
    };
    Scattering { every: sum(&|s| s.every), last: sum(&|s| s.last) }
}

/// Computes S over the ground of `options` for each frequency and aspect; `free` gives S without a ground.
///
/// # Errors
/// Returns an error if an aspect looks from below the plane or the target reaches below it, and what `free` fails with.
pub fn scattering(
    scene: &Scene,
    frequencies_hz: &[f64],
    aspects: &[BistaticAspect],
    options: &RcsOptions,
    free: impl Fn(&Scene, &[f64], &[BistaticAspect], &RcsOptions) -> Result<Vec<Scattering>>,
) -> Result<Vec<Scattering>> {
    let Ground::Plane(material) = &options.ground else {
        return free(scene, frequencies_hz, aspects, options);
    };
    check(scene, aspects)?;
    let alone = RcsOptions { ground: Ground::None, ..options.clone() };
    if is_mirror(material) {
        let doubled = with_image(scene)?;
        if doubled.objects.is_empty() {
            // All of the target lies in the plane: it is a part of the ground.
            return Ok(vec![Scattering::default(); frequencies_hz.len() * aspects.len()]);
        }
        let ways: Vec<BistaticAspect> = aspects
            .iter()
            .flat_map(|l| [*l, BistaticAspect { transmit: below(l.transmit), receive: l.receive }])
            .collect();
        let parts = free(&doubled, frequencies_hz, &ways, &alone)?;
        let none = Scattering::default();
        let rho = [Complex64::ONE, -Complex64::ONE];
        return Ok(parts.chunks(2).map(|p| combine([&p[0], &p[1], &none, &none], rho, rho)).collect());
    }
    let ways: Vec<BistaticAspect> = aspects
        .iter()
        .flat_map(|l| {
            let (t, r) = (l.transmit, l.receive);
            [(t, r), (below(t), r), (t, below(r)), (below(t), below(r))]
                .map(|(transmit, receive)| BistaticAspect { transmit, receive })
        })
        .collect();
    let parts = free(scene, frequencies_hz, &ways, &alone)?;
    let centre = middle(scene);
    let mut out = Vec::with_capacity(frequencies_hz.len() * aspects.len());
    for (p, i) in parts.chunks(4).zip(0..) {
        let (f, aspect) = (frequencies_hz[i / aspects.len()], &aspects[i % aspects.len()]);
        let at = |a: Aspect| coefficients(material, f, sin_grazing(options.distance, a, centre));
        out.push(combine([&p[0], &p[1], &p[2], &p[3]], at(aspect.transmit)?, at(aspect.receive)?));
    }
    Ok(out)
}

/// A smooth perfect conductor: its image is exact.
fn is_mirror(m: &Material) -> bool {
    m.kind == MaterialKind::Pec && m.roughness_rms_m == 0.0 && m.layers.is_empty()
}

/// Middle of the scene's bounds.
fn middle(scene: &Scene) -> DVec3 {
    scene.bounds_m(0.0).map_or(DVec3::ZERO, |(lo, hi)| 0.5 * (lo + hi))
}

/// Sine of the grazing angle of the way from the radar over the plane to `centre`.
fn sin_grazing(distance: Distance, aspect: Aspect, centre: DVec3) -> f64 {
    let u = direction_from_angles(aspect.azimuth, aspect.elevation);
    match distance {
        Distance::Infinite => u.z,
        Distance::At(r0) => {
            let way = centre - image(u * r0);
            way.z / way.length()
        }
    }
}

fn check(scene: &Scene, aspects: &[BistaticAspect]) -> Result<()> {
    for a in aspects.iter().flat_map(|l| [l.transmit, l.receive]) {
        if a.elevation < 0.0 {
            return Err(BadInput::new("the radar is below the ground")
                .key("elevation")
                .value(format!("{:.4} deg", a.elevation.to_degrees()))
                .allowed("0..90 deg with a ground")
                .into());
        }
    }
    for o in &scene.objects {
        let points: &mut dyn Iterator<Item = f64> = match o.shape {
            Shape::Mesh(m) => &mut scene.meshes[m].positions_m.iter().map(|p| o.pose.point(*p).z),
            _ => &mut std::iter::once(o.pose.translation_m.z),
        };
        let lowest = points.fold(f64::INFINITY, f64::min);
        if lowest < -IN_PLANE_M {
            return Err(BadInput::new("is partly below the ground, which is the plane z = 0")
                .key(format!("object '{}'", o.name))
                .value(format!("lowest point at z = {lowest:.6} m"))
                .remedy("raise the target, as with --height-m")
                .into());
        }
    }
    Ok(())
}

/// The scene with its mirror image under the plane; faces in the plane are left out.
///
/// Returns an error for a scattering table, whose image is seen from directions that it does not hold.
fn with_image(scene: &Scene) -> Result<Scene> {
    let mut out = Scene { materials: scene.materials.clone(), ..Default::default() };
    for o in scene.objects.iter().filter(|o| o.radar) {
        match o.shape {
            Shape::Point { .. } => {
                for at in [o.pose.translation_m, image(o.pose.translation_m)] {
                    out.add_object(&o.name, &o.class, o.shape, Pose::new(DQuat::IDENTITY, at), DVec3::ZERO);
                }
            }
            Shape::Table(_) => {
                return Err(BadInput::new("the image of a scattering table in a ground cannot be computed")
                    .key(format!("object '{}'", o.name))
                    .remedy("remove the ground, or give the object facets")
                    .into());
            }
            Shape::Mesh(m) => {
                let mesh = &scene.meshes[m];
                let world: Vec<DVec3> = mesh.positions_m.iter().map(|p| o.pose.point(*p)).collect();
                let kept: Vec<usize> = (0..mesh.triangles.len())
                    .filter(|t| mesh.triangles[*t].iter().any(|v| world[*v as usize].z > IN_PLANE_M))
                    .collect();
                if kept.is_empty() {
                    continue;
                }
                for mirrored in [false, true] {
                    let half = Mesh {
                        positions_m: if mirrored {
                            world.iter().map(|p| image(*p)).collect()
                        } else {
                            world.clone()
                        },
                        triangles: kept
                            .iter()
                            .map(|t| {
                                let [a, b, c] = mesh.triangles[*t];
                                if mirrored { [a, c, b] } else { [a, b, c] }
                            })
                            .collect(),
                        material: kept.iter().map(|t| mesh.material[*t]).collect(),
                        normals: mesh
                            .normals
                            .iter()
                            .map(|n| o.pose.direction(*n))
                            .map(|n| if mirrored { image(n) } else { n })
                            .collect(),
                    };
                    out.add_mesh(&o.name, &o.class, half, Pose::IDENTITY);
                }
            }
        }
    }
    Ok(out)
}

/// Where the first Fresnel zone of the reflected way meets the plane, as distances from the point under
/// the target towards the radar (CONVENTIONS eq. 47); a negative one lies behind the target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FresnelZone {
    /// Nearer end, m.
    pub near_m: f64,
    /// Farther end, m.
    pub far_m: f64,
}

impl FresnelZone {
    /// The zone for a scatterer at `height_m` over the plane that is seen from infinity at the grazing angle `grazing`,
    /// rad.
    pub fn far_field(grazing: f64, height_m: f64, wavelength_m: f64) -> FresnelZone {
        let (sin, cos) = grazing.sin_cos();
        let q = height_m * sin + 0.5 * wavelength_m;
        let top = q * cos + (q * q - (height_m * sin).powi(2)).sqrt();
        FresnelZone { near_m: (height_m * height_m - q * q) / top, far_m: top / (sin * sin) }
    }

    /// The zone for a radar at `radar_height_m` over the plane, `ground_range_m` away along it.
    pub fn at_range(
        ground_range_m: f64,
        radar_height_m: f64,
        height_m: f64,
        wavelength_m: f64,
    ) -> FresnelZone {
        let (d, h1, h2) = (ground_range_m, radar_height_m, height_m);
        let way = d.hypot(h1 + h2);
        // The two ends of the quadratic, with (way + λ/2)² − d² and its root free of differences of large numbers.
        let m = wavelength_m * (way + 0.25 * wavelength_m);
        let spread = (h1 + h2).powi(2) + m;
        let middle = d * (2.0 * h2 * (h1 + h2) + m);
        let root = (way + 0.5 * wavelength_m) * (m * (m + 4.0 * h1 * h2)).sqrt();
        FresnelZone { near_m: 0.5 * (middle - root) / spread, far_m: 0.5 * (middle + root) / spread }
    }

    /// Length of the zone, m.
    pub fn length_m(&self) -> f64 {
        self.far_m - self.near_m
    }
}

/// A remark where reflection by a plane is not to be trusted: the first Fresnel zone reaches the ground on which the
/// target stands, which the target covers or which is not the plane's (CONVENTIONS eq. 48).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroundRemark {
    /// The zone of the plane that reflects.
    pub zone: FresnelZone,
    /// How far the target reaches out from its middle, m.
    pub radius_m: f64,
    /// Elevation of the radar, rad.
    pub elevation: f64,
    /// Frequency, Hz.
    pub frequency_hz: f64,
}

/// Judges the ground for a target with these bounds, seen from `aspect`; None where a plane's reflection holds.
pub fn remark(
    bounds_m: (DVec3, DVec3),
    freq_hz: f64,
    aspect: Aspect,
    options: &RcsOptions,
) -> Option<GroundRemark> {
    if options.ground == Ground::None {
        return None;
    }
    let (lo, hi) = bounds_m;
    let height = 0.5 * (lo.z + hi.z) + options.height_m;
    let radius_m = 0.5 * (hi - lo).truncate().length();
    let lambda = wavelength_m(freq_hz);
    let u = direction_from_angles(aspect.azimuth, aspect.elevation);
    let zone = match options.distance {
        Distance::Infinite => FresnelZone::far_field(aspect.elevation, height, lambda),
        Distance::At(r0) => FresnelZone::at_range(r0 * u.truncate().length(), r0 * u.z, height, lambda),
    };
    let remark = GroundRemark { zone, radius_m, elevation: aspect.elevation, frequency_hz: freq_hz };
    (zone.near_m < radius_m).then_some(remark)
}

impl std::fmt::Display for GroundRemark {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "ground: at elevation {:.3} deg and {:.4} GHz the reflecting part of the ground is {:.3} m long and begins {:.3} m before the \
             middle of the target, which has a radius of {:.3} m: a plane's reflection is not valid there; compare with the target \
             alone and with a conducting ground (--ground none, --ground pec)",
            self.elevation.to_degrees(),
            self.frequency_hz / 1e9,
            self.zone.length_m(),
            self.zone.near_m,
            self.radius_m
        )
    }
}
