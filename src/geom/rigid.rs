//! What belongs to a mesh wherever it stands, found once in its own frame, and meshes as they stand in the world.

use super::curved_facet::{self, CurvedFacet};
use super::faces::Faces;
use super::patches::coplanar_patches;
use super::planes;
use super::triangle::Triangle;
use super::welded::{NO_PLANE, Welded, weld};
use crate::frames::{Pose, Target, World};
use crate::scene::Mesh;
use glam::DVec3;
use std::sync::{Arc, OnceLock};

/// What the faces of all meshes of a scene depend on besides the meshes.
#[derive(Debug)]
pub(super) struct Terms {
    /// Of each surface, whether it is the front of a dielectric volume.
    pub(super) enters: Vec<bool>,
    /// Corners nearer to a plane than this lie in it, m.
    pub(super) flat_m: f64,
    /// Whether surfaces count and not facets: those of curved surfaces are curved, and those of one plane lie in it.
    pub(super) surfaces: bool,
}

/// A mesh in its own frame, with what is the same wherever it stands.
#[derive(Debug)]
pub(super) struct RigidMesh {
    terms: Arc<Terms>,
    /// Where corners of triangles lie, each place once.
    points: Vec<DVec3>,
    /// Triangles that have an area, as three of the points.
    triangles: Vec<[u32; 3]>,
    /// Coplanar patch and surface of each of them.
    kinds: Vec<(u32, u32)>,
    /// Those of them that are curved; empty where none is.
    curved: Vec<Option<CurvedFacet>>,
    /// Plane of each of them, or [`NO_PLANE`]; empty where facets alone count.
    planes: Vec<u32>,
    /// How far corners of each plane were off it, at most, m.
    off_m: Vec<f64>,
    /// Number of coplanar patches.
    pub(super) patches: u32,
    /// Number of triangles without area, which were left out.
    pub(super) dropped: usize,
    /// Whether a vertex is not a finite place.
    is_broken: bool,
    faces: OnceLock<Faces>,
}

impl RigidMesh {
    pub(super) fn new(mesh: &Mesh, terms: Arc<Terms>) -> RigidMesh {
        let is_broken = mesh.positions_m.iter().any(|p| !p.is_finite());
        let all_curved = if terms.surfaces { curved_facet::facets(mesh) } else { Vec::new() };
        let (mut planes_of, mut off_m, mut positions_m) = (Vec::new(), Vec::new(), None);
        if terms.surfaces {
            let found = planes::find(mesh, |t| all_curved[t].is_some());
            (planes_of, off_m, positions_m) = (found.of, found.off_m, Some(found.positions_m));
        }
        let positions_m = positions_m.as_ref().unwrap_or(&mesh.positions_m);
        let (patch, patches) = coplanar_patches(positions_m, &mesh.triangles);
        let (mut triangles, mut kinds, mut curved_of) = (Vec::new(), Vec::new(), Vec::new());
        let mut planes = Vec::new();
        for (i, ((t, patch), surface)) in mesh.triangles.iter().zip(patch).zip(&mesh.material).enumerate() {
            let corners = t.map(|i| positions_m[i as usize]);
            if Triangle::new(corners, patch, 0, *surface).is_some() {
                triangles.push(corners);
                kinds.push((patch, *surface));
                curved_of.push(all_curved.get(i).copied().flatten());
                planes.push(planes_of.get(i).copied().unwrap_or(NO_PLANE));
            }
        }
        if curved_of.iter().all(Option::is_none) {
            curved_of.clear();
        }
        let dropped = mesh.triangles.len() - triangles.len();
        let (points, triangles) = weld(&triangles);
        RigidMesh {
            terms,
            points,
            triangles,
            kinds,
            curved: curved_of,
            planes,
            off_m,
            patches,
            dropped,
            is_broken,
            faces: OnceLock::new(),
        }
    }

    /// Number of triangles that have an area.
    pub(super) fn len(&self) -> usize {
        self.triangles.len()
    }

    /// The triangles with their points at `points`, patches counted from `patch` on.
    fn triangles(&self, points: &[DVec3], patch: u32, body: u32) -> impl Iterator<Item = Triangle> {
        // Rounding may leave a tiny one without area where it stands.
        self.triangles.iter().zip(&self.kinds).filter_map(move |(t, (own, surface))| {
            Triangle::new(t.map(|i| points[i as usize]), patch + own, body, *surface)
        })
    }

    /// The convex faces in the mesh's own frame, without looking whether they are known.
    pub(super) fn find_faces(&self) -> Faces {
        let triangles: Vec<Triangle> = self.triangles(&self.points, 0, 0).collect();
        let welded = Welded::new(&triangles, &self.points, &self.triangles);
        Faces::build(
            &welded,
            (&self.curved, &self.planes, &self.off_m),
            &self.terms.enters,
            self.terms.flat_m,
        )
    }
}

/// A mesh as it stands in the world.
#[derive(Debug)]
pub(super) struct PlacedMesh {
    pub(super) mesh: Arc<RigidMesh>,
    pub(super) pose: Pose<Target, World>,
    /// The mesh's points in the world, m.
    pub(super) points: Vec<DVec3>,
    faces: OnceLock<Faces>,
}

impl PlacedMesh {
    /// None when not every place is finite.
    pub(super) fn new(mesh: Arc<RigidMesh>, pose: Pose<Target, World>) -> Option<PlacedMesh> {
        let points: Vec<DVec3> = mesh.points.iter().map(|p| pose.point(*p)).collect();
        let is_whole = !mesh.is_broken && points.iter().all(|p| p.is_finite());
        is_whole.then(|| PlacedMesh { mesh, pose, points, faces: OnceLock::new() })
    }

    /// Whether it stands so to the last bit.
    pub(super) fn stands_at(&self, pose: &Pose<Target, World>) -> bool {
        let bits = |p: &Pose<Target, World>| {
            (p.rotation.to_array().map(f64::to_bits), p.translation_m.to_array().map(f64::to_bits))
        };
        bits(&self.pose) == bits(pose)
    }

    /// Its triangles in the world, of this body, with patches counted from `patch` on.
    pub(super) fn triangles(&self, patch: u32, body: u32) -> impl Iterator<Item = Triangle> {
        self.mesh.triangles(&self.points, patch, body)
    }

    /// Its convex faces in the world, made when first asked for.
    pub(super) fn faces(&self) -> &Faces {
        let of_mesh = || self.mesh.faces.get_or_init(|| self.mesh.find_faces());
        self.faces.get_or_init(|| of_mesh().placed(&self.pose))
    }
}
