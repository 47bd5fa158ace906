//! A scene at one instant as rays and beams meet it. What belongs to a rigid mesh is found once ([`RigidScene`]); each frame only
//! places what has moved.

pub mod bvh;
pub mod cells;
mod coarser;
pub mod convex;
pub mod curved;
pub mod curved_facet;
pub mod dielectrics;
pub mod edge_table;
pub mod edges;
pub mod faces;
pub mod hash;
pub mod outline;
pub mod overlaps;
pub(crate) mod patches;
mod planes;
pub mod remarks;
mod rigid;
mod shape;
mod smooth;
pub mod surface;
pub(crate) mod tree;
pub mod triangle;
pub mod upload;
pub mod validate;
mod welded;

use crate::base::error::{BadInput, Error, Result};
use crate::base::frames::{Pose, Target, World, angles_from_direction, polarisation_basis};
use crate::base::held::Held;
use crate::base::matrix::Matrix2;
use crate::base::tasks::Tasks;
use crate::base::units::wavelength_m;
use crate::em::layers::Backing;
use crate::scene::motion::Moving;
use crate::scene::scatterer::{ScatteringTable, Stencil, turned};
use crate::scene::{Material, Object, Scene, Shape};
use bvh::Bvh;
use faces::{FLAT, Faces};
use glam::{DQuat, DVec3};
use rayon::prelude::*;
use rigid::{PlacedMesh, RigidMesh, Terms};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock, Mutex, OnceLock, PoisonError};
use surface::of_materials;
pub use surface::{Surface, surfaces_at};
pub use triangle::Triangle;

/// The object that a triangle belongs to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Body {
    /// Number of the object.
    pub id: u32,
    /// Velocity of the body's origin, which stands at `origin_m`, m/s.
    pub velocity_mps: DVec3,
    /// Its origin in the world, m.
    pub origin_m: DVec3,
    /// World from its own frame.
    pub rotation: DQuat,
    /// Its rate of rotation about the origin, rad/s.
    pub spin_rad_per_s: DVec3,
    /// Motions from where the body is to where it is `Geometry::reach_s` before and after.
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

    /// The displacement of a body between two instants. A body that stands as it stood gives [`Shift::NONE`], without
    /// rounding.
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

    /// Whether the displacement leaves everything where it is.
    pub fn is_none(&self) -> bool {
        *self == Shift::NONE
    }

    /// Place to which a place of the body moves, m.
    #[inline]
    pub fn place(&self, p: DVec3) -> DVec3 {
        self.to_m + self.rotation * (p - self.from_m)
    }

    /// Place of the body from which one has moved, m: the inverse of [`Shift::place`].
    #[inline]
    pub fn place_before(&self, p: DVec3) -> DVec3 {
        self.from_m + self.rotation.inverse() * (p - self.to_m)
    }

    /// The direction to which a direction of the body turns.
    #[inline]
    pub fn direction(&self, d: DVec3) -> DVec3 {
        self.rotation * d
    }
}

impl Body {
    /// Velocity of the body's particle at a place, m/s.
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
    /// Motions from where the target is to where it is before and after, as [`Body::shifts`].
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
    /// Motions from where the target is to where it is before and after, as [`Body::shifts`].
    pub shifts: [Shift; 2],
    /// The table that it scatters by.
    pub table: Arc<ScatteringTable>,
    /// Place of the geometry's frequency in the table.
    pub band: Stencil,
}

impl TableTarget {
    /// S at a place among the table's frequencies, towards the unit vector `u` from the object (world), with the vectors V and H of `basis` (world) for
    /// transmit and receive (CONVENTIONS eq. 43).
    pub fn scattering(&self, band: &Stencil, u: DVec3, basis: (DVec3, DVec3)) -> Matrix2 {
        let own = self.rotation.inverse() * u;
        let (azimuth, elevation) = angles_from_direction(own);
        let s = self.table.scattering(band, azimuth, elevation);
        let (v, h) = polarisation_basis(own);
        let (v, h) = (self.rotation * v, self.rotation * h);
        turned(&s, [[basis.0.dot(v), basis.0.dot(h)], [basis.1.dot(v), basis.1.dot(h)]])
    }
}

/// How the facets of curved surfaces are treated, those with smooth normals ([`curved`]).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Facets {
    /// Flat, as where they have been cut so finely that they are.
    Flat,
    /// The surface that they stand for: its bend is part of what it returns.
    Curved,
}

/// What is made when it is first asked for.
pub type Late<T> = LazyLock<Arc<T>, Box<dyn FnOnce() -> Arc<T> + Send>>;

/// A scene at one instant as rays and beams meet it.
///
/// # Example
/// A wall 10 m ahead: what a ray meets, and what the wall hides.
///
/// ```
/// use catseye::base::frames::Pose;
/// use catseye::geom::Geometry;
/// use catseye::road::shape::cuboid;
/// use catseye::scene::{Material, Scene};
/// use glam::DVec3;
///
/// let mut scene = Scene::default();
/// let metal = scene.material_index(&Material::pec());
/// let wall = cuboid(DVec3::new(0.2, 6.0, 3.0), DVec3::new(10.1, 0.0, 0.5), metal);
/// scene.add_mesh("wall", "wall", wall, Pose::IDENTITY);
/// let geometry = Geometry::build(&scene, 0.0, 77e9)?;
/// assert_eq!(geometry.triangle_count, 12);
/// let hit = geometry.bvh.closest_hit(&geometry.triangles, DVec3::ZERO, DVec3::X, u32::MAX, 100.0);
/// assert!(hit.is_some_and(|h| (h.t - 10.0).abs() < 1e-9));
/// assert!(!geometry.sees(DVec3::ZERO, DVec3::new(20.0, 0.0, 0.0)));
/// assert!(geometry.sees(DVec3::ZERO, DVec3::new(20.0, 8.0, 0.0)));
/// # Ok::<(), catseye::Error>(())
/// ```
#[derive(Debug)]
pub struct Geometry {
    /// In the order of the BVH's leaves. Only rays meet triangles: they are made, with their tree, when they are first asked for.
    pub triangles: Late<Vec<Triangle>>,
    /// Tree over the triangles.
    pub bvh: Late<Bvh>,
    /// Number of triangles.
    pub triangle_count: usize,
    /// Objects that the triangles belong to.
    pub bodies: Vec<Body>,
    /// The scene's materials at `freq_hz`.
    pub surfaces: Vec<Surface>,
    /// Materials of `surfaces`, whatever the frequency.
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
    /// Time to the frame's start and end, for which bodies have their shifts, s; 0 where only the instant counts.
    pub reach_s: f64,
    /// Meshes of the bodies.
    placed: Vec<Arc<PlacedMesh>>,
    flat_m: f64,
    faces: OnceLock<Faces>,
}

/// A scene whose meshes are looked at once, at one frequency: triangles without area, patches, volumes, convex faces and their trees
/// belong to a mesh in its own frame. Objects that stand where they stood when they were asked for last are not placed again. What
/// [`at`](RigidScene::at) gives depends to the last bit only on what it is asked for.
#[derive(Debug)]
pub struct RigidScene<'a> {
    scene: Held<'a, Scene>,
    freq_hz: f64,
    surfaces: Vec<Surface>,
    terms: Arc<Terms>,
    /// The rigid parts of each mesh of the scene.
    meshes: Vec<OnceLock<Arc<RigidMesh>>>,
    /// Where each object stood last.
    last: Vec<Mutex<Option<Arc<PlacedMesh>>>>,
    placed: AtomicUsize,
}

impl<'a> RigidScene<'a> {
    /// Prepares a scene with its materials at a frequency.
    ///
    /// # Errors
    /// Returns an error for a material without a value at this frequency.
    pub fn new(scene: Held<'a, Scene>, freq_hz: f64, facets: Facets) -> Result<RigidScene<'a>> {
        let surfaces = surfaces_at(&scene, freq_hz)?;
        let enters = |(m, s): (&Material, &Surface)| {
            m.is_dielectric() && matches!(s.stack.backing, Backing::HalfSpace(_))
        };
        let enters = scene.materials.iter().zip(&surfaces).map(enters).collect();
        let bare =
            |(m, s): (&Material, &Surface)| !m.is_dielectric() && s.stack.layers.is_empty() && !s.is_rough();
        let bare = scene.materials.iter().zip(&surfaces).map(bare).collect();
        let flat_m = FLAT * wavelength_m(freq_hz);
        let terms = Arc::new(Terms { enters, bare, flat_m, surfaces: facets == Facets::Curved });
        let meshes = scene.meshes.iter().map(|_| OnceLock::new()).collect();
        let last = scene.objects.iter().map(|_| Mutex::new(None)).collect();
        Ok(RigidScene { scene, freq_hz, surfaces, terms, meshes, last, placed: AtomicUsize::new(0) })
    }

    /// The scene itself.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Number of meshes that were examined so far, and of times that one was placed.
    pub fn work_done(&self) -> (usize, usize) {
        let found = self.meshes.iter().filter(|m| m.get().is_some()).count();
        (found, self.placed.load(Ordering::Relaxed))
    }

    /// Meshes as objects show them, each with the number of the object and that of the mesh.
    fn placed(&self, wanted: &[(usize, usize, Pose<Target, World>)]) -> Result<Vec<Arc<PlacedMesh>>> {
        // One after the other if several objects show it, so each is looked at first.
        let mut new: Vec<usize> =
            wanted.iter().map(|w| w.1).filter(|m| self.meshes[*m].get().is_none()).collect();
        new.sort_unstable();
        new.dedup();
        new.into_par_iter().for_each_tasks(|mesh| {
            self.rigid(mesh);
        });
        let one =
            |(number, mesh, pose): &(usize, usize, Pose<Target, World>)| self.place(*number, *mesh, *pose);
        let placed: Vec<Result<Arc<PlacedMesh>>> = wanted.par_iter().map_tasks(one).collect();
        placed.into_iter().collect()
    }

    /// What belongs to a mesh wherever it stands. No tasks are handed out while others wait for it.
    fn rigid(&self, mesh: usize) -> &Arc<RigidMesh> {
        self.meshes[mesh]
            .get_or_init(|| Arc::new(RigidMesh::new(&self.scene.meshes[mesh], self.terms.clone())))
    }

    /// Mesh `mesh` as object number `number` shows it.
    fn place(&self, number: usize, mesh: usize, pose: Pose<Target, World>) -> Result<Arc<PlacedMesh>> {
        let last = || self.last[number].lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = last().as_ref().filter(|known| known.is_at(&pose)) {
            return Ok(known.clone());
        }
        let placed = PlacedMesh::new(self.rigid(mesh).clone(), pose)
            .ok_or_else(|| not_finite(&self.scene.objects[number], &self.scene.meshes[mesh], &pose))?;
        self.placed.fetch_add(1, Ordering::Relaxed);
        let placed = Arc::new(placed);
        *last() = Some(placed.clone());
        Ok(placed)
    }

    /// Builds the geometry of the scene at `time_s`, for a frame that lasts from `reach_s` before that time to
    /// `reach_s` after it.
    ///
    /// # Errors
    /// Returns an error for a scattering table without a value at the frequency, for positions that are not finite, or
    /// for a scene with neither triangles nor points.
    pub fn at(&self, time_s: f64, reach_s: f64) -> Result<Geometry> {
        let scene = &*self.scene;
        let freq_hz = self.freq_hz;
        let (mut wanted, mut bodies) = (Vec::new(), Vec::new());
        let (mut points, mut tables) = (Vec::new(), Vec::new());
        let mut meshes_there = std::collections::HashSet::new();
        for (number, object) in scene.objects.iter().enumerate().filter(|(_, o)| o.radar) {
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
                    bodies.push(Body {
                        id: object.id,
                        velocity_mps: now.velocity_mps,
                        origin_m: now.translation_m,
                        rotation: now.rotation,
                        spin_rad_per_s: now.spin_rad_per_s,
                        shifts,
                    });
                    wanted.push((number, m, now.pose()));
                }
            }
        }
        let placed = self.placed(&wanted)?;
        let meshes = || placed.iter().map(|p| &p.mesh);
        let triangle_count = meshes().map(|m| m.len()).sum();
        if triangle_count == 0 && points.is_empty() && tables.is_empty() {
            return Err(BadInput::new("the scene has no triangles and no point targets")
                .remedy("add a mesh or a [[point]]")
                .into());
        }
        let mut lo = DVec3::splat(f64::INFINITY);
        let mut hi = DVec3::splat(f64::NEG_INFINITY);
        let single = points.iter().map(|p| p.position_m).chain(tables.iter().map(|t| t.position_m));
        for p in placed.iter().flat_map(|p| &p.points).copied().chain(single) {
            lo = lo.min(p);
            hi = hi.max(p);
        }
        // A millionth of the size: above the rounding of f32 positions, below any feature that matters.
        let t_min_m = 1e-6 * (hi - lo).max_element().max(1e-3);
        let (patches, degenerate_dropped) =
            meshes().fold((0, 0), |(patches, dropped), m| (patches + m.patches, dropped + m.dropped));
        let (triangles, bvh) = for_rays(placed.clone(), t_min_m);
        Ok(Geometry {
            triangles,
            bvh,
            triangle_count,
            bodies,
            surfaces: self.surfaces.clone(),
            materials: scene.materials.clone(),
            points,
            tables,
            patches,
            degenerate_dropped,
            freq_hz,
            t_min_m,
            bounds_m: (lo, hi),
            reach_s,
            placed,
            flat_m: self.terms.flat_m,
            faces: OnceLock::new(),
        })
    }
}

/// The triangles of bodies in the order of their tree's leaves, and the tree: both are made when the first of them is asked for.
fn for_rays(bodies: Vec<Arc<PlacedMesh>>, t_min_m: f64) -> (Late<Vec<Triangle>>, Late<Bvh>) {
    let make = move || {
        let (mut triangles, mut patch) = (Vec::new(), 0);
        for (body, placed) in bodies.iter().enumerate() {
            triangles.extend(placed.triangles(patch, body as u32));
            patch += placed.mesh.patches;
        }
        let bvh = Bvh::build(&mut triangles, t_min_m);
        (Arc::new(triangles), Arc::new(bvh))
    };
    let made = Arc::new(LazyLock::new(make));
    let same = made.clone();
    (LazyLock::new(Box::new(move || made.0.clone())), LazyLock::new(Box::new(move || same.1.clone())))
}

fn not_finite(object: &Object, mesh: &crate::scene::Mesh, pose: &Pose<Target, World>) -> Error {
    let mut world = mesh.positions_m.iter().map(|p| pose.point(*p)).enumerate();
    let (vertex, place) = world.find(|(_, p)| !p.is_finite()).unwrap_or_default();
    BadInput::new("position is not a finite number")
        .key(format!("object '{}' vertex {vertex}", object.name))
        .value(place)
        .remedy("repair the mesh")
        .into()
}

impl Geometry {
    /// Whether nothing stands between two places, either of which may lie on a surface.
    pub fn sees(&self, a: DVec3, b: DVec3) -> bool {
        a.distance(b) <= 2.0 * self.t_min_m || !self.faces().is_between(a, b, self.t_min_m)
    }

    /// Builds the geometry of the scene at `time_s`, with materials at `freq_hz`.
    ///
    /// # Errors
    /// Returns an error for a material or a scattering table without a value at this frequency, for positions that are
    /// not finite, or for a scene with neither triangles nor points.
    pub fn build(scene: &Scene, time_s: f64, freq_hz: f64) -> Result<Geometry> {
        RigidScene::new(Held::Borrowed(scene), freq_hz, Facets::Flat)?.at(time_s, 0.0)
    }

    /// Builds the geometry for a frame that lasts from `reach_s` before that time to `reach_s` after it, with facets of
    /// curved surfaces as bent as these are.
    ///
    /// # Errors
    /// Returns the errors of [`Geometry::build`].
    pub fn of_frame(scene: &Scene, time_s: f64, freq_hz: f64, reach_s: f64) -> Result<Geometry> {
        RigidScene::new(Held::Borrowed(scene), freq_hz, Facets::Curved)?.at(time_s, reach_s)
    }

    /// Materials at another frequency, in the order of `surfaces`: a sweep over frequency needs no other geometry.
    ///
    /// # Errors
    /// Returns an error if a material has no value at that frequency.
    pub fn surfaces_at(&self, freq_hz: f64) -> Result<Vec<Surface>> {
        of_materials(&self.materials, freq_hz)
    }

    /// Finds the convex faces again, whether or not they or those of a mesh were found before.
    pub fn find_faces(&self) -> Faces {
        let meshes = self.meshes();
        let found: Vec<Faces> = meshes.par_iter().map_tasks(|m| m.find_faces()).collect();
        let of_mesh = |p: &PlacedMesh| meshes.partition_point(|m| Arc::as_ptr(m) < Arc::as_ptr(&p.mesh));
        let bodies: Vec<Faces> =
            self.placed.par_iter().map_tasks(|p| found[of_mesh(p)].placed(&p.pose)).collect();
        Faces::joined(&bodies.iter().collect::<Vec<_>>(), self.flat_m, self.bounding_sphere_m())
    }

    /// Each mesh of the bodies once, by its address.
    fn meshes(&self) -> Vec<&Arc<RigidMesh>> {
        let mut meshes: Vec<&Arc<RigidMesh>> = self.placed.iter().map(|p| &p.mesh).collect();
        meshes.sort_unstable_by_key(|m| Arc::as_ptr(m));
        meshes.dedup_by_key(|m| Arc::as_ptr(m));
        meshes
    }

    fn join_faces(&self) -> Faces {
        let bodies: Vec<&Faces> = self.placed.iter().map(|p| p.faces()).collect();
        Faces::joined(&bodies, self.flat_m, self.bounding_sphere_m())
    }

    /// The convex faces that beams meet, made when first asked for.
    pub fn faces(&self) -> &Faces {
        if let Some(known) = self.faces.get() {
            return known;
        }
        // Before the lock: a thread that holds it may not take up another task, which may ask for the same faces.
        self.meshes().par_iter().for_each_tasks(|m| {
            m.faces();
        });
        self.placed.par_iter().for_each_tasks(|p| {
            p.faces();
        });
        self.faces.get_or_init(|| self.join_faces())
    }

    /// Centre and radius of a sphere that holds every triangle.
    pub fn bounding_sphere_m(&self) -> (DVec3, f64) {
        let centre = 0.5 * (self.bounds_m.0 + self.bounds_m.1);
        let points = self.placed.iter().flat_map(|p| &p.points);
        let r2 = points.map(|p| (p - centre).length_squared()).fold(0.0, f64::max);
        (centre, r2.sqrt())
    }
}
