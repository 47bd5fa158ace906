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
pub mod surface;
pub mod triangle;
pub mod upload;
pub mod validate;
mod welded;

use crate::em::layers::Backing;
use crate::error::{BadInput, Error, Result};
use crate::frames::{angles_from_direction, polarisation_basis};
use crate::scene::motion::Moving;
use crate::scene::scatterer::{Matrix, ScatteringTable, Stencil, turned};
use crate::scene::{Material, Scene, Shape};
use bvh::Bvh;
use faces::{Faces, Mesh};
use glam::{DQuat, DVec3};
use std::sync::{Arc, OnceLock};
use surface::of_materials;
pub use surface::{Surface, surfaces_at};
pub use triangle::Triangle;

/// The object that a triangle belongs to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Body {
    /// Number of the object.
    pub id: u32,
    /// Of its origin, which stands at `origin_m`.
    pub velocity_mps: DVec3,
    /// Its origin in the world, m.
    pub origin_m: DVec3,
    /// World from its own frame.
    pub rotation: DQuat,
    /// Its rate of rotation about the origin, rad/s.
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
    /// The shift that leaves everything where it is.
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

    /// Whether it leaves everything where it is.
    pub fn is_none(&self) -> bool {
        *self == Shift::NONE
    }

    /// Where a place comes to lie, m.
    #[inline]
    pub fn place(&self, p: DVec3) -> DVec3 {
        self.to_m + self.rotation * (p - self.from_m)
    }

    /// What a direction becomes.
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

/// An isotropic scatterer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointTarget {
    /// Number of the object.
    pub id: u32,
    /// Position in the world, m.
    pub position_m: DVec3,
    /// Velocity in the world, m/s.
    pub velocity_mps: DVec3,
    /// Radar cross section, dBsm.
    pub rcs_dbsm: f64,
    /// As [`Body::shifts`].
    pub shifts: [Shift; 2],
}

/// An object that scatters as a table says.
#[derive(Debug, Clone)]
pub struct TableTarget {
    /// Number of the object.
    pub id: u32,
    /// World from the object's own frame.
    pub rotation: DQuat,
    /// Position in the world, m.
    pub position_m: DVec3,
    /// Velocity in the world, m/s.
    pub velocity_mps: DVec3,
    /// As [`Body::shifts`].
    pub shifts: [Shift; 2],
    /// The table that it scatters by.
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

/// A scene at one instant as rays and beams meet it.
#[derive(Debug)]
pub struct Geometry {
    /// In the order of the BVH's leaves.
    pub triangles: Vec<Triangle>,
    /// Tree over the triangles.
    pub bvh: Bvh,
    /// Objects that the triangles belong to.
    pub bodies: Vec<Body>,
    /// The scene's materials at `freq_hz`.
    pub surfaces: Vec<Surface>,
    /// The same without a frequency.
    pub materials: Vec<Material>,
    /// Isotropic scatterers.
    pub points: Vec<PointTarget>,
    /// Objects that scatter as tables say.
    pub tables: Vec<TableTarget>,
    /// Number of coplanar patches.
    pub patches: u32,
    /// Number of triangles without area that were left out.
    pub degenerate_dropped: usize,
    /// Frequency that the surfaces hold for, Hz.
    pub freq_hz: f64,
    /// Hits nearer than this along a ray are its own start; set from the size of the scene.
    pub t_min_m: f64,
    /// Least and largest corner of all triangles, m.
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
    /// # Errors
    /// A material or a scattering table without a value at this frequency; positions that are not finite; a scene
    /// with neither triangles nor points.
    pub fn build(scene: &Scene, time_s: f64, freq_hz: f64) -> Result<Geometry> {
        Geometry::of_frame(scene, time_s, freq_hz, 0.0)
    }

    /// The same for a frame that lasts from `reach_s` before that time to `reach_s` after it.
    ///
    /// # Errors
    /// As [`Geometry::new`].
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

    /// The materials at another frequency, in the order of `surfaces`: a sweep over frequency needs no other
    /// geometry.
    ///
    /// # Errors
    /// A material without a value there.
    pub fn surfaces_at(&self, freq_hz: f64) -> Result<Vec<Surface>> {
        of_materials(&self.materials, freq_hz)
    }

    /// The faces anew, without looking whether they were made before.
    pub fn find_faces(&self) -> Faces {
        let enters: Vec<bool> = self
            .materials
            .iter()
            .zip(&self.surfaces)
            .map(|(m, s)| m.is_dielectric() && matches!(s.stack.backing, Backing::HalfSpace(_)))
            .collect();
        Faces::build(&Mesh {
            triangles: &self.triangles,
            enters: &enters,
            freq_hz: self.freq_hz,
            sphere_m: self.bounding_sphere_m(),
        })
    }

    /// The convex faces that beams meet, made when first asked for.
    pub fn faces(&self) -> &Faces {
        self.faces.get_or_init(|| self.find_faces())
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
