//! What stands on the road: meshes with radar materials, moving objects, point targets; and the
//! radar that looks at it. glTF comes in here and is turned to ISO 8855 axes once.
//!
//! A [`Scene`] comes from a scenario file ([`scenario`]), a mesh file or arrays ([`mesh_file`]), or is put together
//! object by object ([`Scene::add_mesh`], [`Scene::add_object`]). Bodies are rigid and move by joints ([`motion`]);
//! materials have a source and a range of frequencies ([`material`]). A [`radar::Radar`] is a preset or a file
//! ([`radar_toml`]), and [`radar_figures`] are its data sheet.

pub mod backscatter;
mod bounds;
pub mod creases;
pub mod drive;
pub mod front_end;
pub mod gltf;
pub mod grating_lobes;
pub mod interferer;
pub mod lidar;
pub mod material;
pub mod mesh_file;
pub mod motion;
mod place_reader;
pub mod processing_changes;
pub mod radar;
pub mod radar_figures;
pub mod radar_toml;
pub mod scatterer;
pub mod scenario;
pub mod tidy;
pub mod toml_file;
mod toml_value;
pub mod trajectory;
pub mod turn;
pub mod unusual;
pub mod waveform;
pub mod waveform_toml;
pub mod weather;
pub mod weld;

use crate::base::frames::{Pose, Target, World};
use glam::DVec3;
pub use material::{Material, MaterialKind};
use motion::{Joint, Motion, Moving};
use scatterer::ScatteringTable;
use std::sync::Arc;

/// Triangles in an object's own frame, metres, ISO 8855 axes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Corners, `[vertex]`, m.
    pub positions_m: Vec<DVec3>,
    /// Counter-clockwise seen from outside; the front is where the right-hand normal points.
    pub triangles: Vec<[u32; 3]>,
    /// Index into `Scene::materials` for each triangle.
    pub material: Vec<u32>,
    /// Unit normals of the smooth surface that the facets stand for, one for each vertex, or empty when
    /// all is flat. Zero where the facets round a vertex are flat; a facet is curved when all its three
    /// corners have a normal. A crease between smooth surfaces has its vertices twice.
    pub normals: Vec<DVec3>,
}

impl Mesh {
    /// The smooth surface's normals at the corners of a triangle; None for a flat facet.
    pub fn corner_normals(&self, triangle: usize) -> Option<[DVec3; 3]> {
        let n =
            self.triangles[triangle].map(|i| self.normals.get(i as usize).copied().unwrap_or(DVec3::ZERO));
        n.iter().all(|n| *n != DVec3::ZERO).then_some(n)
    }

    /// Whether any facet is curved.
    pub fn is_smooth(&self) -> bool {
        !self.normals.is_empty() && (0..self.triangles.len()).any(|t| self.corner_normals(t).is_some())
    }
}

/// A rigid body: one glTF node with a mesh, or one point target.
#[derive(Debug, Clone, PartialEq)]
pub struct Object {
    /// Unique in the scene and what returns and points are labelled with; 0 means "none".
    pub id: u32,
    /// Name, as the file gives it.
    pub name: String,
    /// `extras.catseye.class`, or "" when not given.
    pub class: String,
    /// Index into `Scene::meshes`; several objects may share a mesh.
    pub shape: Shape,
    /// Pose at time zero.
    pub pose: Pose<Target, World>,
    /// Non-uniform scale and mirrored nodes are baked into the mesh at import, so this is rigid. At time zero.
    pub velocity_mps: DVec3,
    /// How it moves when not straight on at that velocity.
    pub motion: Option<Arc<Motion>>,
    /// Whether the radar sees it. What it does not see neither scatters nor stands in the way, but has its place in truth,
    /// masks, pictures and lidar scans: the body of a thing whose echo another object gives, a point or a table.
    pub radar: bool,
}

impl Object {
    /// Pose and velocity of the object at a time.
    pub fn at(&self, time_s: f64) -> Moving {
        match &self.motion {
            Some(motion) => motion.at(time_s),
            None => Moving {
                rotation: self.pose.rotation,
                translation_m: self.pose.translation_m + self.velocity_mps * time_s,
                velocity_mps: self.velocity_mps,
                spin_rad_per_s: DVec3::ZERO,
            },
        }
    }

    /// Gives the object a motion; its pose and velocity become those at time zero.
    pub fn set_motion(&mut self, motion: Motion) {
        let now = motion.at(0.0);
        (self.pose, self.velocity_mps) = (now.pose(), now.velocity_mps);
        self.motion = Some(Arc::new(motion));
    }

    /// Motion of the object as joints from its own frame.
    pub fn joints(&self) -> Vec<Joint> {
        match &self.motion {
            Some(motion) => motion.joints.clone(),
            None => {
                let mut joints = vec![Joint::Fixed(self.pose.rotation, self.pose.translation_m)];
                if self.velocity_mps != DVec3::ZERO {
                    joints.push(Joint::Line(self.velocity_mps));
                }
                joints
            }
        }
    }
}

/// The shape of a scatterer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// A mesh, by its number in the scene.
    Mesh(usize),
    /// An isotropic scatterer at the object's origin.
    Point {
        /// Its radar cross section, dBsm.
        rcs_dbsm: f64,
    },
    /// Index into `Scene::tables`: the object scatters as that table says, about its origin.
    Table(usize),
}

/// Everything that can return an echo. Time zero is the middle of frame 0; [`Object::at`] says where an object is.
///
/// # Example
/// A scene that a program puts together: a parked car as a point of 10 dBsm and one that comes towards the origin at
/// 36 km/h.
///
/// ```
/// use catseye::base::frames::Pose;
/// use catseye::scene::{Scene, Shape};
/// use glam::{DQuat, DVec3};
///
/// let mut scene = Scene::default();
/// let shape = Shape::Point { rcs_dbsm: 10.0 };
/// let at = |x_m: f64, y_m: f64| Pose::new(DQuat::IDENTITY, DVec3::new(x_m, y_m, 0.5));
/// let parked = scene.add_object("parked", "car", shape, at(25.0, -3.0), DVec3::ZERO);
/// let oncoming = scene.add_object("oncoming", "car", shape, at(60.0, 3.5), DVec3::new(-10.0, 0.0, 0.0));
/// assert_eq!((parked, oncoming), (1, 2));
/// let x_m = |id: u32, time_s: f64| scene.object_by_id(id).map(|o| o.at(time_s).translation_m.x);
/// assert_eq!((x_m(parked, 2.0), x_m(oncoming, 2.0)), (Some(25.0), Some(40.0)));
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Scene {
    /// Meshes, each once however many objects show it.
    pub meshes: Vec<Mesh>,
    /// Materials that meshes name by number.
    pub materials: Vec<Material>,
    /// Scattering tables that objects name by number.
    pub tables: Vec<Arc<ScatteringTable>>,
    /// What stands and moves in the scene.
    pub objects: Vec<Object>,
    /// What the importer dropped or assumed.
    pub import: ImportReport,
    /// What was assumed or left out of its files, one line each.
    pub warnings: Vec<String>,
}

/// What the importer had to drop or assume; printed by the command line and kept in the manifest.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
pub struct ImportReport {
    /// Triangles that were read.
    pub triangles: usize,
    /// Triangles without area that were left out.
    pub degenerate_triangles_dropped: usize,
    /// Remarks, one a line.
    pub notes: Vec<String>,
    /// Whether lengths were taken in metres because the format says so, and nobody has stated the unit.
    pub unit_assumed: bool,
}

impl Scene {
    /// Triangles of all objects.
    pub fn triangle_count(&self) -> usize {
        self.objects
            .iter()
            .map(|o| match o.shape {
                Shape::Mesh(m) => self.meshes[m].triangles.len(),
                Shape::Point { .. } | Shape::Table(_) => 0,
            })
            .sum()
    }

    /// Adds a mesh as a new object with the next free id and returns that id.
    pub fn add_mesh(&mut self, name: &str, class: &str, mesh: Mesh, pose: Pose<Target, World>) -> u32 {
        self.meshes.push(mesh);
        let shape = Shape::Mesh(self.meshes.len() - 1);
        self.add_object(name, class, shape, pose, DVec3::ZERO)
    }

    /// Adds an object with the next free number and gives that number.
    pub fn add_object(
        &mut self,
        name: &str,
        class: &str,
        shape: Shape,
        pose: Pose<Target, World>,
        velocity_mps: DVec3,
    ) -> u32 {
        let id = self.objects.iter().map(|o| o.id).max().unwrap_or(0) + 1;
        let (name, class) = (name.into(), class.into());
        self.objects.push(Object { id, name, class, shape, pose, velocity_mps, motion: None, radar: true });
        id
    }

    /// Says whether the radar sees the object with this id.
    pub fn set_radar(&mut self, id: u32, radar: bool) {
        if let Some(object) = self.objects.iter_mut().find(|o| o.id == id) {
            object.radar = radar;
        }
    }

    /// Gives the object with this id a motion.
    pub fn move_by(&mut self, id: u32, motion: Motion) {
        if let Some(object) = self.objects.iter_mut().find(|o| o.id == id) {
            object.set_motion(motion);
        }
    }

    /// Index of a material in this scene, added when absent.
    pub fn material_index(&mut self, material: &Material) -> u32 {
        if let Some(i) = self.materials.iter().position(|m| m == material) {
            return i as u32;
        }
        self.materials.push(material.clone());
        (self.materials.len() - 1) as u32
    }

    /// Index of a scattering table in this scene, added when absent.
    pub fn table_index(&mut self, table: &Arc<ScatteringTable>) -> usize {
        if let Some(i) = self.tables.iter().position(|t| Arc::ptr_eq(t, table) || t == table) {
            return i;
        }
        self.tables.push(table.clone());
        self.tables.len() - 1
    }

    /// The object of this number.
    pub fn object_by_id(&self, id: u32) -> Option<&Object> {
        self.objects.iter().find(|o| o.id == id)
    }

    /// Axis-aligned bounds in the world at `time_s`, or None for an empty scene.
    pub fn bounds_m(&self, time_s: f64) -> Option<(DVec3, DVec3)> {
        let mut b: Option<(DVec3, DVec3)> = None;
        let mut grow = |p: DVec3| {
            b = Some(b.map_or((p, p), |(lo, hi)| (lo.min(p), hi.max(p))));
        };
        for o in &self.objects {
            let pose = o.at(time_s).pose();
            match o.shape {
                Shape::Mesh(m) => self.meshes[m].positions_m.iter().for_each(|p| grow(pose.point(*p))),
                Shape::Point { .. } | Shape::Table(_) => grow(pose.translation_m),
            }
        }
        b
    }
}
