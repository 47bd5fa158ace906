//! What belongs to a mesh wherever it stands, found once in its own frame, and meshes as they stand in the world.

use super::curved_facet::{self, CurvedFacet};
use super::faces::{Faces, Known};
use super::hash::FastMap;
use super::patches::{COPLANAR, coplanar_patches};
use super::planes;
use super::shape::shape;
use super::triangle::Triangle;
use super::welded::{NO_PLANE, Welded, sides, weld};
use crate::base::frames::{Pose, Target, World};
use crate::scene::Mesh;
use glam::{DMat3, DVec3};
use std::sync::{Arc, OnceLock};

/// Corners that were moved by less into their plane are not worth a word, m: λ/200 at 77 GHz.
const WORTH_M: f64 = 2e-5;

/// What the faces of all meshes of a scene depend on besides the meshes.
#[derive(Debug)]
pub(super) struct Terms {
    /// Whether each surface is the front of a dielectric volume.
    pub(super) enters: Vec<bool>,
    /// Whether each surface is metal with nothing on it; one such surface is as good a mirror as another.
    pub(super) bare: Vec<bool>,
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
    /// How the surface over each is curved; empty where none is.
    shapes: Vec<Option<DMat3>>,
    /// Plane of each of them, or [`NO_PLANE`]; empty where facets alone count.
    planes: Vec<u32>,
    /// How far corners of each plane were off it, at most, m.
    off_m: Vec<f64>,
    /// The planes whose corners were moved by more than rounding.
    pub(super) moved: MovedCorners,
    /// Number of triangles that lie on another of the same corners, which were left out.
    pub(super) copies: usize,
    /// Number of dielectric triangles that look against another of the same corners and material, which were not.
    pub(super) faced: usize,
    /// Number of coplanar patches.
    pub(super) patches: u32,
    /// Number of triangles without area, which were left out.
    pub(super) dropped: usize,
    /// Whether a vertex is not a finite place.
    is_broken: bool,
    faces: OnceLock<Faces>,
}

/// Of each triangle, whether it is the first with its corners. What lies on itself scatters once, one bare metal on another too; sheets of
/// other surfaces than theirs stay. Dielectrics that look against each other are one sheet where all that hangs together with them is there
/// twice, and else may be two bodies that touch: those stay, and are counted.
fn first_of_copies(triangles: &[[u32; 3]], kinds: &[(u32, u32)], terms: &Terms) -> (Vec<bool>, usize) {
    let mut known: FastMap<[u32; 3], Vec<u32>> = FastMap::default();
    let sorted = |mut t: [u32; 3]| {
        t.sort_unstable();
        t
    };
    let mut corners: FastMap<[u32; 3], ()> =
        FastMap::with_capacity_and_hasher(triangles.len(), Default::default());
    if triangles.iter().all(|t| corners.insert(sorted(*t), ()).is_none()) {
        return (vec![true; triangles.len()], 0);
    }
    let is_even = |[a, b, c]: [u32; 3]| (a < b) as u8 + (b < c) as u8 + (c < a) as u8 == 2;
    let sheets = double_sheets(triangles);
    let is = |list: &[bool], t: u32| list.get(kinds[t as usize].1 as usize).copied().unwrap_or(false);
    let dielectric = |t: u32| is(&terms.enters, t);
    let bare = |t: u32| is(&terms.bare, t);
    let mut faced = 0;
    let mut is_first = |t: u32| {
        let own = triangles[t as usize];
        let list = known.entry(sorted(own)).or_default();
        let alike = |u: &&u32| kinds[t as usize].1 == kinds[**u as usize].1;
        let same = |u: &u32| {
            let as_wound = sheets[t as usize] || is_even(own) == is_even(triangles[*u as usize]);
            bare(t) && bare(*u) || alike(&u) && (!dielectric(t) || as_wound)
        };
        if list.iter().any(same) {
            return false;
        }
        faced += usize::from(list.iter().any(|u| alike(&u)));
        list.push(t);
        true
    };
    ((0..triangles.len() as u32).map(&mut is_first).collect(), faced)
}

/// Tells for each triangle whether it and all that hangs together with it are there more than once.
fn double_sheets(triangles: &[[u32; 3]]) -> Vec<bool> {
    let sorted = |mut t: [u32; 3]| {
        t.sort_unstable();
        t
    };
    let mut count: FastMap<[u32; 3], u32> =
        FastMap::with_capacity_and_hasher(triangles.len(), Default::default());
    triangles.iter().for_each(|t| *count.entry(sorted(*t)).or_default() += 1);
    let mut double: Vec<bool> = triangles.iter().map(|t| count[&sorted(*t)] > 1).collect();
    if !double.contains(&true) || !double.contains(&false) {
        return double;
    }
    let mut at_side: FastMap<(u32, u32), Vec<u32>> = FastMap::default();
    for (i, t) in triangles.iter().enumerate() {
        for (a, b) in sides(t) {
            at_side.entry((a.min(b), a.max(b))).or_default().push(i as u32);
        }
    }
    let mut single: Vec<u32> = (0..triangles.len() as u32).filter(|t| !double[*t as usize]).collect();
    while let Some(t) = single.pop() {
        for (a, b) in sides(&triangles[t as usize]) {
            for u in &at_side[&(a.min(b), a.max(b))] {
                if std::mem::replace(&mut double[*u as usize], false) {
                    single.push(*u);
                }
            }
        }
    }
    double
}

fn keep_only<T>(list: &mut Vec<T>, wanted: &[bool]) {
    let mut wanted = wanted.iter();
    list.retain(|_| wanted.next().copied().unwrap_or(true));
}

impl RigidMesh {
    pub(super) fn new(mesh: &Mesh, terms: Arc<Terms>) -> RigidMesh {
        let is_broken = mesh.positions_m.iter().any(|p| !p.is_finite());
        let all_curved = if terms.surfaces { curved_facet::facets(mesh) } else { Vec::new() };
        let (mut planes_of, mut off_m, mut turned, mut positions_m) =
            (Vec::new(), Vec::new(), Vec::new(), None);
        let mut moved = MovedCorners::default();
        if terms.surfaces {
            let found = planes::find(mesh, |t| all_curved[t].is_some());
            moved = MovedCorners::of(&found);
            (planes_of, off_m, positions_m) = (found.of, found.off_m, Some(found.positions_m));
            turned = found.turned;
        }
        let turned = |i: usize| turned.get(i).copied().unwrap_or(false);
        let positions_m = positions_m.as_ref().unwrap_or(&mesh.positions_m);
        let (patch, patches) = coplanar_patches(positions_m, &mesh.triangles, COPLANAR);
        let (mut triangles, mut kinds, mut curved_of) = (Vec::new(), Vec::new(), Vec::new());
        let mut shapes = Vec::new();
        let mut planes = Vec::new();
        for (i, ((t, patch), surface)) in mesh.triangles.iter().zip(patch).zip(&mesh.material).enumerate() {
            let mut corners = t.map(|i| positions_m[i as usize]);
            if turned(i) {
                corners.swap(1, 2);
            }
            if Triangle::new(corners, patch, 0, *surface).is_some() {
                triangles.push(corners);
                kinds.push((patch, *surface));
                curved_of.push(all_curved.get(i).copied().flatten());
                shapes.push(shape(mesh, i).map(|s| if turned(i) { -s } else { s }));
                planes.push(planes_of.get(i).copied().unwrap_or(NO_PLANE));
            }
        }
        let dropped = mesh.triangles.len() - triangles.len();
        let (points, mut triangles) = weld(&triangles);
        let (mut copies, mut faced) = (0, 0);
        if terms.surfaces {
            let first;
            (first, faced) = first_of_copies(&triangles, &kinds, &terms);
            copies = first.iter().filter(|first| !**first).count();
            keep_only(&mut triangles, &first);
            keep_only(&mut kinds, &first);
            keep_only(&mut curved_of, &first);
            keep_only(&mut shapes, &first);
            keep_only(&mut planes, &first);
        }
        if curved_of.iter().all(Option::is_none) {
            curved_of.clear();
        }
        if shapes.iter().all(Option::is_none) {
            shapes.clear();
        }
        RigidMesh {
            terms,
            points,
            triangles,
            kinds,
            curved: curved_of,
            shapes,
            planes,
            off_m,
            moved,
            copies,
            faced,
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

    /// The convex faces in the mesh's own frame, found when first asked for.
    pub(super) fn faces(&self) -> &Faces {
        self.faces.get_or_init(|| self.find_faces())
    }

    /// The convex faces in the mesh's own frame, without looking whether they are known.
    pub(super) fn find_faces(&self) -> Faces {
        let triangles: Vec<Triangle> = self.triangles(&self.points, 0, 0).collect();
        let welded = Welded::new(&triangles, &self.points, &self.triangles);
        Faces::build(
            &welded,
            &Known { curved: &self.curved, shapes: &self.shapes, planes: &self.planes, off_m: &self.off_m },
            &self.terms.enters,
            self.terms.flat_m,
        )
    }
}

/// Planes of a mesh whose corners were moved into them.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct MovedCorners {
    /// Number of such planes.
    pub(super) planes: usize,
    /// Triangles that lie in them.
    pub(super) facets: usize,
    /// How far corners were moved, at most, m.
    pub(super) most_m: f64,
}

impl MovedCorners {
    /// Of planes as they were found. By how much f32 rounds, and by [`WORTH_M`], corners may be moved without a word.
    fn of(found: &planes::Planes) -> MovedCorners {
        let least = WORTH_M.max(found.rounding_m);
        let far = |plane: u32| found.moved_m.get(plane as usize).is_some_and(|moved| *moved > least);
        MovedCorners {
            planes: (0..found.moved_m.len() as u32).filter(|p| far(*p)).count(),
            facets: found.of.iter().filter(|p| far(**p)).count(),
            most_m: found.moved_m.iter().fold(0.0, |a, b| a.max(*b)),
        }
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
    pub(super) fn is_at(&self, pose: &Pose<Target, World>) -> bool {
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
        self.faces.get_or_init(|| self.mesh.faces().placed(&self.pose))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles with the same corners, wound against each other, of two surfaces.
    fn first(surfaces: [u32; 2]) -> Vec<bool> {
        let terms = Terms {
            enters: vec![false, false, false, true],
            bare: vec![true, true, false, false],
            flat_m: 0.0,
            surfaces: true,
        };
        first_of_copies(&[[0, 1, 2], [0, 2, 1]], &surfaces.map(|s| (0, s)), &terms).0
    }

    #[test]
    fn one_bare_metal_on_another_is_one_sheet_and_a_covered_one_is_not() {
        assert_eq!(first([0, 0]), [true, false]);
        assert_eq!(first([0, 1]), [true, false]);
        assert_eq!(first([2, 2]), [true, false]);
        // Steel with a covering, or a sheet that air lies behind, before bare steel: neither hides the other from its side.
        assert_eq!(first([2, 0]), [true, true]);
        assert_eq!(first([0, 3]), [true, true]);
    }
}
