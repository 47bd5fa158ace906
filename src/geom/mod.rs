//! Triangles of a scene at one instant, in the world, with their planes, coplanar patches and wide
//! BVH. Rebuilt for each frame in which something moves.

pub mod bvh;
pub mod cells;
pub mod curved;
pub mod edges;
pub mod faces;
pub mod hash;
pub mod outline;
mod patches;
pub mod upload;
pub mod validate;

use crate::em::clutter::{self, Front, Sigma0};
use crate::em::fresnel::{rayleigh_factor, transmission_roughness_factor};
use crate::em::layers::{Backing, Layer, Stack};
use crate::em::roughness::{Lobe, Shares};
use crate::error::{BadInput, Error, Result};
use crate::frames::{angles_from_direction, polarisation_basis};
use crate::scene::backscatter::{Backscatter, Law};
use crate::scene::motion::Moving;
use crate::scene::scatterer::{Matrix, ScatteringTable, Stencil, turned};
use crate::scene::{Material, MaterialKind, Scene, Shape};
use bvh::Bvh;
use faces::Faces;
use glam::{DQuat, DVec3};
use num_complex::Complex64;
use std::sync::{Arc, OnceLock};

/// Two corners closer than this many times the mesh's size make a triangle degenerate.
const DEGENERATE: f64 = 1e-12;

/// One facet in the world. A point of the plane has barycentric coordinates
/// (u, v) = ((p - v0) . du, (p - v0) . dv), inside when u, v >= 0 and u + v <= 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Triangle {
    pub v0: DVec3,
    pub e1: DVec3,
    pub e2: DVec3,
    /// Unit normal, right-handed about v0, v1, v2.
    pub normal: DVec3,
    du: DVec3,
    dv: DVec3,
    exact: [DVec3; 3],
    /// Coplanar neighbours share a patch: a ray that leaves a patch cannot meet it again.
    pub patch: u32,
    /// Index into `Geometry::bodies`.
    pub body: u32,
    /// Index into `Geometry::surfaces`.
    pub surface: u32,
}

impl Triangle {
    /// None when the corners are (nearly) on one line.
    pub fn new(v: [DVec3; 3], patch: u32, body: u32, surface: u32) -> Option<Self> {
        let (e1, e2) = (v[1] - v[0], v[2] - v[0]);
        let n = e1.cross(e2);
        let scale = e1.length_squared().max(e2.length_squared()).max((e2 - e1).length_squared());
        let area2 = n.length();
        if !(area2.is_finite() && area2 > DEGENERATE * scale && area2 > 0.0) {
            return None;
        }
        let normal = n / area2;
        Some(Triangle {
            v0: v[0],
            e1,
            e2,
            normal,
            du: e2.cross(normal) / area2,
            dv: normal.cross(e1) / area2,
            exact: v,
            patch,
            body,
            surface,
        })
    }

    pub fn corners(&self) -> [DVec3; 3] {
        [self.v0, self.v0 + self.e1, self.v0 + self.e2]
    }

    /// The corners as they came, without the rounding of v0 + e1.
    pub fn corners_exact(&self) -> [DVec3; 3] {
        self.exact
    }

    pub fn area_m2(&self) -> f64 {
        0.5 * self.e1.cross(self.e2).length()
    }

    /// Distance along `dir` (in its units) to the triangle's plane if the ray passes through it.
    #[inline]
    pub fn intersect(&self, origin: DVec3, dir: DVec3) -> Option<f64> {
        let r = self.v0 - origin;
        let t = r.dot(self.normal) / dir.dot(self.normal);
        // Negative and NaN (ray in the plane) both fail here.
        if t <= 0.0 || !t.is_finite() {
            return None;
        }
        let p = dir * t - r;
        let (u, v) = (p.dot(self.du), p.dot(self.dv));
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0).then_some(t)
    }
}

/// The object that a triangle belongs to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Body {
    pub id: u32,
    /// Of its origin, which stands at `origin_m`.
    pub velocity_mps: DVec3,
    pub origin_m: DVec3,
    /// World from its own frame.
    pub rotation: DQuat,
    pub spin_rad_per_s: DVec3,
    /// From where it is to where it is `Geometry::reach_s` before and after.
    pub shifts: [Shift; 2],
}

/// A rigid displacement in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shift {
    rotation: DQuat,
    from_m: DVec3,
    to_m: DVec3,
}

impl Shift {
    pub const NONE: Shift = Shift { rotation: DQuat::IDENTITY, from_m: DVec3::ZERO, to_m: DVec3::ZERO };

    /// Of a body between two instants. A body that stands as it stood gives [`Shift::NONE`], without rounding.
    pub fn between(from: &Moving, to: &Moving) -> Shift {
        if from.rotation == to.rotation && from.translation_m == to.translation_m {
            return Shift::NONE;
        }
        let rotation = match from.rotation == to.rotation {
            true => DQuat::IDENTITY,
            false => to.rotation * from.rotation.inverse(),
        };
        Shift { rotation, from_m: from.translation_m, to_m: to.translation_m }
    }

    pub fn is_none(&self) -> bool {
        *self == Shift::NONE
    }

    #[inline]
    pub fn place(&self, p: DVec3) -> DVec3 {
        self.to_m + self.rotation * (p - self.from_m)
    }

    #[inline]
    pub fn direction(&self, d: DVec3) -> DVec3 {
        self.rotation * d
    }
}

impl Body {
    /// Of the particle at a place.
    #[inline]
    pub fn velocity_at(&self, place_m: DVec3) -> DVec3 {
        self.velocity_mps + self.spin_rad_per_s.cross(place_m - self.origin_m)
    }
}

/// A material at one frequency: a conductor, a half-space, or layers on one of these or on air.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    pub stack: Stack,
    /// Standard deviation of the front's height, m; 0 is smooth.
    pub roughness_rms_m: f64,
    /// None: Lambert's lobe of what the roughness takes from the mirror reflection.
    pub backscatter: Option<Backscatter>,
}

impl Surface {
    /// Errors: a material without a value at this frequency, a perfect conductor as a layer.
    pub fn of(material: &Material, freq_hz: f64) -> Result<Surface> {
        let backing = match (&material.kind, material.eps_r(freq_hz)?) {
            (_, None) => Backing::Pec,
            (MaterialKind::Air, _) => Backing::Air,
            (_, Some(eps)) => Backing::HalfSpace(eps),
        };
        let layers = material.layers.iter().map(|l| match l.material.eps_r(freq_hz)? {
            Some(eps_r) => Ok(Layer { eps_r, thickness_m: l.thickness_m }),
            None => Err(BadInput::new("a perfect conductor hides what is under it")
                .key(format!("layer of '{}'", material.name))
                .value(&l.material.name)
                .remedy("make it the base, without what lies under it")
                .into()),
        });
        let stack = Stack { layers: layers.collect::<Result<_>>()?, backing };
        if material.backscatter.is_some_and(|b| b.law == Law::Oh) && material.roughness_rms_m == 0.0 {
            return Err(BadInput::new(format!(
                "material '{}' is smooth, and its backscatter comes from its roughness",
                material.name
            ))
            .key("backscatter")
            .value("oh")
            .remedy("give roughness_rms_m, or another law")
            .into());
        }
        let backscatter = material.backscatter;
        Ok(Surface { stack, roughness_rms_m: material.roughness_rms_m, backscatter })
    }

    /// (R_perp, R_par) of the coherent field at incidence cosine `cos_i` in (0, 1] and `wavenumber`
    /// rad/m (CONVENTIONS eq. 4 and 22), with the phase on the front.
    #[inline]
    pub fn reflection(&self, wavenumber: f64, cos_i: f64) -> (Complex64, Complex64) {
        let (perp, par) = self.stack.reflection(wavenumber, cos_i);
        if self.roughness_rms_m == 0.0 {
            return (perp, par);
        }
        let loss = rayleigh_factor(wavenumber, self.roughness_rms_m, cos_i);
        (perp * loss, par * loss)
    }

    /// Shares of the incident power that the roughness turns from coherent into diffuse scattering,
    /// [perpendicular, parallel] (CONVENTIONS eq. 27).
    pub fn diffuse_share(&self, wavenumber: f64, cos_i: f64) -> [f64; 2] {
        let (perp, par) = self.stack.reflection(wavenumber, cos_i);
        [perp, par].map(|r| Shares::of(r, wavenumber, self.roughness_rms_m, cos_i).diffuse)
    }

    /// Whether it scatters diffusely.
    pub fn is_rough(&self) -> bool {
        self.roughness_rms_m > 0.0 || self.backscatter.is_some()
    }

    /// Backscatter per area beside the mirror reflection (CONVENTIONS eq. 27, 145-147), and the correlation of VV
    /// with HH. Where the material says no more than its roughness it is that of Lambert's law with facets that
    /// turn no polarisation (correlation 1, nothing across).
    pub fn sigma0(&self, wavenumber: f64, cos_i: f64) -> (Sigma0, f64) {
        let Some(backscatter) = &self.backscatter else {
            let [hh, vv] =
                self.diffuse_share(wavenumber, cos_i).map(|s| Lobe::Lambert.backscatter_sigma0(s, cos_i));
            return (Sigma0 { vv, hh, hv: 0.0 }, 1.0);
        };
        let (perp, par) = self.stack.reflection(wavenumber, cos_i);
        let front = Front {
            reflectivity: [perp, par].map(|r| r.norm_sqr()),
            nadir_reflectivity: self.stack.reflection(wavenumber, 1.0).0.norm_sqr(),
            roughness_rms_m: self.roughness_rms_m,
        };
        (clutter::sigma0(backscatter, wavenumber, &front, cos_i), backscatter.copolar_correlation)
    }

    /// (T_perp, T_par) of a free-standing sheet: the coherent field behind it over that without it
    /// (CONVENTIONS eq. 23 and 24). None when nothing passes, or not into air.
    pub fn transmission(&self, wavenumber: f64, cos_i: f64) -> Option<(Complex64, Complex64)> {
        if self.stack.backing != Backing::Air {
            return None;
        }
        let (perp, par) = self.stack.response(wavenumber, cos_i).transmission;
        let loss =
            self.stack.layers.first().map_or(1.0, |l| {
                transmission_roughness_factor(wavenumber, self.roughness_rms_m, l.eps_r, cos_i)
            });
        Some((perp * loss, par * loss))
    }
}

/// The scene's materials at a frequency, in their order.
///
/// Errors: a material without a value there.
pub fn surfaces_at(scene: &Scene, freq_hz: f64) -> Result<Vec<Surface>> {
    of_materials(&scene.materials, freq_hz)
}

/// An isotropic scatterer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointTarget {
    pub id: u32,
    pub position_m: DVec3,
    pub velocity_mps: DVec3,
    pub rcs_dbsm: f64,
    /// As [`Body::shifts`].
    pub shifts: [Shift; 2],
}

fn of_materials(materials: &[Material], freq_hz: f64) -> Result<Vec<Surface>> {
    materials.iter().map(|m| Surface::of(m, freq_hz)).collect()
}

/// An object that scatters as a table says.
#[derive(Debug, Clone)]
pub struct TableTarget {
    pub id: u32,
    /// World from the object's own frame.
    pub rotation: DQuat,
    pub position_m: DVec3,
    pub velocity_mps: DVec3,
    /// As [`Body::shifts`].
    pub shifts: [Shift; 2],
    pub table: Arc<ScatteringTable>,
    /// Place of the geometry's frequency in the table.
    pub band: Stencil,
}

impl TableTarget {
    /// S at a place among the table's frequencies, towards the unit vector `u` from the object (world), with the vectors V and H of `basis` (world) for
    /// transmit and receive (CONVENTIONS eq. 43).
    pub fn scattering(&self, band: &Stencil, u: DVec3, basis: (DVec3, DVec3)) -> Matrix {
        let own = self.rotation.inverse() * u;
        let (azimuth, elevation) = angles_from_direction(own);
        let s = self.table.scattering(band, azimuth, elevation);
        let (v, h) = polarisation_basis(own);
        let (v, h) = (self.rotation * v, self.rotation * h);
        turned(&s, [[basis.0.dot(v), basis.0.dot(h)], [basis.1.dot(v), basis.1.dot(h)]])
    }
}

#[derive(Debug)]
pub struct Geometry {
    /// In the order of the BVH's leaves.
    pub triangles: Vec<Triangle>,
    pub bvh: Bvh,
    pub bodies: Vec<Body>,
    /// The scene's materials at `freq_hz`.
    pub surfaces: Vec<Surface>,
    /// The same without a frequency.
    pub materials: Vec<Material>,
    pub points: Vec<PointTarget>,
    pub tables: Vec<TableTarget>,
    pub patches: u32,
    pub degenerate_dropped: usize,
    pub freq_hz: f64,
    /// Hits nearer than this along a ray are its own start; set from the size of the scene.
    pub t_min_m: f64,
    pub bounds_m: (DVec3, DVec3),
    /// To the frame's start and end, for which bodies have their shifts; 0 where only the instant counts.
    pub reach_s: f64,
    faces: OnceLock<Faces>,
}

impl Geometry {
    /// Whether nothing stands between two places, either of which may lie on a surface.
    pub fn sees(&self, a: DVec3, b: DVec3) -> bool {
        let d = b - a;
        let r = d.length();
        let reach = r - self.t_min_m;
        reach <= self.t_min_m || !self.bvh.any_hit(&self.triangles, a, d / r, u32::MAX, reach)
    }

    /// The scene at `time_s`, with materials at `freq_hz`.
    ///
    /// Errors: a material or a scattering table without a value at this frequency; positions that are not finite; a scene
    /// with neither triangles nor points.
    pub fn build(scene: &Scene, time_s: f64, freq_hz: f64) -> Result<Geometry> {
        Geometry::of_frame(scene, time_s, freq_hz, 0.0)
    }

    /// The same for a frame that lasts from `reach_s` before that time to `reach_s` after it.
    pub fn of_frame(scene: &Scene, time_s: f64, freq_hz: f64, reach_s: f64) -> Result<Geometry> {
        let surfaces = surfaces_at(scene, freq_hz)?;
        let mesh_patches: Vec<(Vec<u32>, u32)> = scene.meshes.iter().map(patches::coplanar_patches).collect();

        let (mut triangles, mut bodies) = (Vec::new(), Vec::new());
        let (mut points, mut tables) = (Vec::new(), Vec::new());
        let (mut patch_base, mut dropped) = (0, 0);
        let mut meshes_there = std::collections::HashSet::new();
        for object in &scene.objects {
            let now = object.at(time_s);
            let shifts = match reach_s > 0.0 {
                true => [-reach_s, reach_s].map(|dt| Shift::between(&now, &object.at(time_s + dt))),
                false => [Shift::NONE; 2],
            };
            match object.shape {
                Shape::Point { rcs_dbsm } => points.push(PointTarget {
                    id: object.id,
                    position_m: now.translation_m,
                    velocity_mps: now.velocity_mps,
                    rcs_dbsm,
                    shifts,
                }),
                Shape::Table(t) => {
                    let table = scene.tables.get(t).ok_or_else(|| {
                        Error::Failed(format!("object '{}' has no scattering table", object.name))
                    })?;
                    tables.push(TableTarget {
                        id: object.id,
                        rotation: now.rotation,
                        position_m: now.translation_m,
                        velocity_mps: now.velocity_mps,
                        shifts,
                        band: table.band(freq_hz)?,
                        table: table.clone(),
                    });
                }
                Shape::Mesh(m) => {
                    // A surface that lies on itself scatters once, and beams that cross many such would never end.
                    let numbers =
                        [now.translation_m, now.velocity_mps, now.spin_rad_per_s].map(|v| v.to_array());
                    let place = numbers.map(|v| v.map(f64::to_bits));
                    let motion = object.motion.as_ref().map_or(0, |m| std::sync::Arc::as_ptr(m) as usize);
                    if !meshes_there.insert((m, motion, place, now.rotation.to_array().map(f64::to_bits))) {
                        continue;
                    }
                    let mesh = &scene.meshes[m];
                    let body = bodies.len() as u32;
                    bodies.push(Body {
                        id: object.id,
                        velocity_mps: now.velocity_mps,
                        origin_m: now.translation_m,
                        rotation: now.rotation,
                        spin_rad_per_s: now.spin_rad_per_s,
                        shifts,
                    });
                    let (patch, count) = &mesh_patches[m];
                    let pose = now.pose();
                    let world: Vec<DVec3> = mesh.positions_m.iter().map(|p| pose.point(*p)).collect();
                    if let Some(bad) = world.iter().position(|p| !p.is_finite()) {
                        return Err(BadInput::new("position is not a finite number")
                            .key(format!("object '{}' vertex {bad}", object.name))
                            .value(world[bad])
                            .remedy("repair the mesh")
                            .into());
                    }
                    for (i, t) in mesh.triangles.iter().enumerate() {
                        let v = t.map(|j| world[j as usize]);
                        match Triangle::new(v, patch_base + patch[i], body, mesh.material[i]) {
                            Some(t) => triangles.push(t),
                            None => dropped += 1,
                        }
                    }
                    patch_base += count;
                }
            }
        }
        if triangles.is_empty() && points.is_empty() && tables.is_empty() {
            return Err(BadInput::new("the scene has no triangles and no point targets")
                .remedy("add a mesh or a [[point]]")
                .into());
        }
        let mut lo = DVec3::splat(f64::INFINITY);
        let mut hi = DVec3::splat(f64::NEG_INFINITY);
        let single = points.iter().map(|p| p.position_m).chain(tables.iter().map(|t| t.position_m));
        for p in triangles.iter().flat_map(|t| t.corners()).chain(single) {
            lo = lo.min(p);
            hi = hi.max(p);
        }
        // A millionth of the size: above the rounding of f32 positions, below any feature that matters.
        let t_min_m = 1e-6 * (hi - lo).max_element().max(1e-3);
        let bvh = Bvh::build(&mut triangles, t_min_m);
        Ok(Geometry {
            triangles,
            bvh,
            bodies,
            surfaces,
            materials: scene.materials.clone(),
            points,
            tables,
            patches: patch_base,
            degenerate_dropped: dropped,
            freq_hz,
            t_min_m,
            bounds_m: (lo, hi),
            reach_s,
            faces: OnceLock::new(),
        })
    }

    /// The materials at another frequency, in the order of `surfaces`: a sweep over frequency needs no
    /// other geometry. Errors: a material without a value there.
    pub fn surfaces_at(&self, freq_hz: f64) -> Result<Vec<Surface>> {
        of_materials(&self.materials, freq_hz)
    }

    /// The convex faces that beams meet, made when first asked for.
    pub fn faces(&self) -> &Faces {
        self.faces.get_or_init(|| Faces::build(self))
    }

    /// Centre and radius of a sphere that holds every triangle.
    pub fn bounding_sphere_m(&self) -> (DVec3, f64) {
        let centre = 0.5 * (self.bounds_m.0 + self.bounds_m.1);
        let r = self
            .triangles
            .iter()
            .flat_map(|t| t.corners())
            .map(|p| (p - centre).length_squared())
            .fold(0.0, f64::max)
            .sqrt();
        (centre, r)
    }
}
