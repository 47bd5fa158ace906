//! Edges that diffract: free edges of sheets and convex wedges of metal, found in the triangles.
//!
//! An edge is judged by the largest sector between the faces that meet in it, whatever way their
//! triangles are turned: one face leaves a sector of 2π (the edge of a sheet), two leave their exterior
//! angle, three or more (sheets that stand on each other) the largest that is left. Sectors larger than
//! π by [`SMOOTH_RAD`] diffract in first order. A sector inside a solid is among them where the solid has
//! a concave edge; nothing outside sees it, so the visibility test of the sum drops it.

use super::hash::FastMap;
use super::{Geometry, Surface};
use crate::base::units::wavelength_m;
use crate::em::layers::Backing;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// Faces that bend by no more than this are facets of one smooth surface: 15°.
pub const SMOOTH_RAD: f64 = PI / 12.0;
/// Relative permittivity from which a surface counts as metal: its surface impedance is then below a
/// hundredth of free space's (Senior and Volakis, *Approximate Boundary Conditions in
/// Electromagnetics*, section 2.2: η = η₀/√ε).
const METAL: f64 = 1e4;
/// Directions that count as the same.
const PARALLEL: f64 = 1e-6;
/// Touching surfaces are sought at this many times `t_min_m` around an edge.
const TOUCH: f64 = 20.0;

/// A straight edge of metal with the space outside it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// Both ends, m.
    pub ends_m: [DVec3; 2],
    /// Unit vectors in the two faces, at right angles to the edge and away from it; the same twice for the
    /// edge of a sheet.
    pub into: [DVec3; 2],
    /// Unit normals of the faces towards the space outside.
    pub normal: [DVec3; 2],
    /// Exterior angle over π, in (1, 2].
    pub n: f64,
    /// Coplanar patches of the two faces.
    pub patch: [u32; 2],
    /// Index of the body.
    pub body: u32,
    /// Surfaces of the two faces.
    pub surface: [u32; 2],
}

impl Edge {
    /// Unit vector from the first end to the second; equals `into[0]` × `normal[0]`.
    pub fn tangent(&self) -> DVec3 {
        self.into[0].cross(self.normal[0])
    }

    /// Length, m.
    pub fn length_m(&self) -> f64 {
        (self.ends_m[1] - self.ends_m[0]).length()
    }

    fn reversed(&self) -> Edge {
        let swap = |[a, b]: [DVec3; 2]| [b, a];
        Edge {
            ends_m: swap(self.ends_m),
            into: swap(self.into),
            normal: swap(self.normal),
            patch: [self.patch[1], self.patch[0]],
            surface: [self.surface[1], self.surface[0]],
            ..*self
        }
    }

    /// Whether `next` goes on where this ends, as the same wedge.
    fn continues_in(&self, next: &Edge) -> bool {
        let near = |a: DVec3, b: DVec3| (a - b).length_squared() < PARALLEL * PARALLEL;
        (0..2).all(|f| near(self.into[f], next.into[f]) && near(self.normal[f], next.normal[f]))
            && self.surface == next.surface
            && self.body == next.body
    }
}

/// Layers that are thinner together than this share of the wavelength leave an edge that of the metal under them.
const THIN: f64 = 0.05;

/// Whether edges of such a surface diffract as those of a perfect conductor at a wavelength, m. Dielectrics, and metal under layers of
/// a twentieth of it and more, do not: their edges get no diffraction.
pub fn is_metal(surface: &Surface, wavelength_m: f64) -> bool {
    let bare = surface.stack.thickness_m() < THIN * wavelength_m;
    match surface.stack.backing {
        Backing::Pec => bare,
        Backing::HalfSpace(eps) => bare && eps.norm() >= METAL,
        Backing::Air => false,
    }
}

/// Finds the diffracting edges of a geometry, in a fixed order. `smooth_rad` is the bend up to which two faces belong
/// to one smooth surface ([`SMOOTH_RAD`] unless there is a reason). Corners closer than `t_min_m` are one; an edge that
/// touches another face along its length (a plate that stands on another) does not count; collinear pieces are joined.
///
/// # Example
/// A metal cube diffracts at its 12 edges, each with an exterior angle of 3π/2. The diagonals that cut its faces into
/// triangles are no edges.
///
/// ```
/// use catseye::base::frames::Pose;
/// use catseye::geom::{Geometry, edges};
/// use catseye::road::shape::cuboid;
/// use catseye::scene::{Material, Scene};
/// use glam::DVec3;
///
/// let mut scene = Scene::default();
/// let metal = scene.material_index(&Material::pec());
/// scene.add_mesh("cube", "target", cuboid(DVec3::splat(0.1), DVec3::ZERO, metal), Pose::IDENTITY);
/// let found = edges::find(&Geometry::build(&scene, 0.0, 77e9)?, edges::SMOOTH_RAD);
/// assert_eq!(found.len(), 12);
/// assert!(found.iter().all(|e| (e.n - 1.5).abs() < 1e-9 && (e.length_m() - 0.1).abs() < 1e-9));
/// # Ok::<(), catseye::Error>(())
/// ```
pub fn find(geometry: &Geometry, smooth_rad: f64) -> Vec<Edge> {
    let mesh = Welded::new(geometry);
    let mut pieces: Vec<Piece> = Vec::new();
    let mut open: Vec<Piece> = Vec::new();
    for group in mesh.sides().chunk_by(|a, b| a.ends == b.ends) {
        if group.len() == 1 { open.push(group[0]) } else { pieces.extend(group) }
    }
    pieces.extend(mesh.split(&open));
    pieces.sort_unstable_by_key(|p| (p.ends, p.triangle));
    let mut edges: Vec<([u32; 2], Edge)> = Vec::new();
    for group in pieces.chunk_by(|a, b| a.ends == b.ends) {
        if let Some(edge) = mesh.edge(geometry, group, smooth_rad)
            && edge
                .surface
                .iter()
                .all(|&s| is_metal(&geometry.surfaces[s as usize], wavelength_m(geometry.freq_hz)))
            && !touches(geometry, &edge)
        {
            edges.push((group[0].ends, edge));
        }
    }
    join(&edges)
}

/// One side of a triangle, or a part of it, between two welded corners (smaller number first).
#[derive(Debug, Clone, Copy)]
struct Piece {
    ends: [u32; 2],
    triangle: u32,
}

/// Corners of all triangles, those within `t_min_m` on one body taken for one.
struct Welded {
    corners: Vec<[u32; 3]>,
    points: Vec<DVec3>,
    body: Vec<u32>,
    tolerance_m: f64,
    /// Axis along which the scene is longest.
    axis: usize,
}

impl Welded {
    fn new(geometry: &Geometry) -> Welded {
        let tolerance_m = geometry.t_min_m;
        let extent = geometry.bounds_m.1 - geometry.bounds_m.0;
        let axis = (0..3).max_by(|&a, &b| extent[a].total_cmp(&extent[b])).unwrap_or(0);
        let mut cells: FastMap<(u32, [i64; 3]), Vec<u32>> = FastMap::default();
        let (mut points, mut body) = (Vec::<DVec3>::new(), Vec::new());
        let mut number = |b: u32, p: DVec3| -> u32 {
            let q = (p - geometry.bounds_m.0) / (2.0 * tolerance_m);
            // Everything within the tolerance of p lies in one of the eight cells around its nearest corner.
            let low = (q - DVec3::splat(0.5)).floor().as_i64vec3().to_array();
            for i in 0..8 {
                let cell = [low[0] + (i & 1), low[1] + (i >> 1 & 1), low[2] + (i >> 2)];
                for &j in cells.get(&(b, cell)).into_iter().flatten() {
                    if (points[j as usize] - p).length() <= tolerance_m {
                        return j;
                    }
                }
            }
            let new = points.len() as u32;
            points.push(p);
            body.push(b);
            cells.entry((b, q.floor().as_i64vec3().to_array())).or_default().push(new);
            new
        };
        let corners = geometry.triangles.iter().map(|t| t.corners().map(|p| number(t.body, p))).collect();
        Welded { corners, points, body, tolerance_m, axis }
    }

    /// All sides, those of one edge next to each other.
    fn sides(&self) -> Vec<Piece> {
        let mut sides: Vec<Piece> = Vec::with_capacity(3 * self.corners.len());
        for (i, &[a, b, c]) in self.corners.iter().enumerate() {
            for (p, q) in [(a, b), (b, c), (c, a)] {
                if p != q {
                    sides.push(Piece { ends: [p.min(q), p.max(q)], triangle: i as u32 });
                }
            }
        }
        sides.sort_unstable_by_key(|p| (p.ends, p.triangle));
        sides
    }

    /// Cuts open sides at the ends of others that lie on them: where a long side borders several short
    /// ones, each part then finds its neighbour.
    fn split(&self, open: &[Piece]) -> Vec<Piece> {
        let along = |v: u32| self.points[v as usize][self.axis];
        let mut ends: Vec<u32> = open.iter().flat_map(|p| p.ends).collect();
        ends.sort_unstable();
        ends.dedup();
        ends.sort_by(|&a, &b| along(a).total_cmp(&along(b)));
        let mut parts = Vec::with_capacity(open.len());
        for piece in open {
            let [a, b] = piece.ends.map(|v| self.points[v as usize]);
            let (t, length) = ((b - a).normalize(), (b - a).length());
            let (lo, hi) = (a[self.axis].min(b[self.axis]), a[self.axis].max(b[self.axis]));
            let first = ends.partition_point(|&v| along(v) < lo - self.tolerance_m);
            let mut cuts: Vec<(f64, u32)> = ends[first..]
                .iter()
                .take_while(|&&v| along(v) <= hi + self.tolerance_m)
                .filter(|&&v| self.body[v as usize] == self.body[piece.ends[0] as usize])
                .filter_map(|&v| {
                    let d = self.points[v as usize] - a;
                    let s = d.dot(t);
                    let inside = s > self.tolerance_m && s < length - self.tolerance_m;
                    (inside && (d - t * s).length() <= self.tolerance_m).then_some((s, v))
                })
                .collect();
            cuts.sort_by(|x, y| x.0.total_cmp(&y.0));
            let mut from = piece.ends[0];
            for v in cuts.into_iter().map(|c| c.1).chain([piece.ends[1]]) {
                parts.push(Piece { ends: [from.min(v), from.max(v)], triangle: piece.triangle });
                from = v;
            }
        }
        parts
    }

    /// The wedge in the largest sector between the faces that meet in an edge.
    fn edge(&self, geometry: &Geometry, group: &[Piece], smooth_rad: f64) -> Option<Edge> {
        let [a, b] = group[0].ends.map(|v| self.points[v as usize]);
        let t = (b - a).try_normalize()?;
        // Each face's direction away from the edge, from its plane's normal so that slivers keep theirs.
        let faces: Vec<(DVec3, u32)> = group
            .iter()
            .filter_map(|p| {
                let tri = &geometry.triangles[p.triangle as usize];
                let inwards = tri.corners().iter().sum::<DVec3>() / 3.0 - a;
                let across = tri.normal.cross(t).try_normalize()?;
                Some((if across.dot(inwards) < 0.0 { -across } else { across }, p.triangle))
            })
            .collect();
        let e1 = faces.first()?.0;
        let e2 = t.cross(e1);
        let mut turns: Vec<(f64, usize)> = faces
            .iter()
            .enumerate()
            .map(|(i, f)| {
                let angle = f.0.dot(e2).atan2(f.0.dot(e1));
                (if angle < 0.0 { angle + TAU } else { angle }, i)
            })
            .collect();
        turns.sort_by(|x, y| x.0.total_cmp(&y.0));
        let mut widest = (0.0, 0, 0);
        for (i, &(angle, face)) in turns.iter().enumerate() {
            let (next, after) = match turns.get(i + 1) {
                Some(&n) => n,
                None => (turns[0].0 + TAU, turns[0].1),
            };
            if next - angle > widest.0 {
                widest = (next - angle, face, after);
            }
        }
        let (sector, i, j) = widest;
        if sector <= PI + smooth_rad {
            return None;
        }
        let (f, g) = (faces[i], faces[j]);
        let (p, q) = (&geometry.triangles[f.1 as usize], &geometry.triangles[g.1 as usize]);
        Some(Edge {
            ends_m: [a, b],
            into: [f.0, g.0],
            normal: [t.cross(f.0), g.0.cross(t)],
            n: (sector / PI).min(2.0),
            patch: [p.patch, q.patch],
            body: p.body,
            surface: [p.surface, q.surface],
        })
    }
}

/// Whether a face that is none of the wedge's own runs through the middle of the edge: then the space
/// outside it is divided, and what remains is a concave corner. Looked for along a circle around the edge.
fn touches(geometry: &Geometry, edge: &Edge) -> bool {
    let middle = 0.5 * (edge.ends_m[0] + edge.ends_m[1]);
    let radius = TOUCH * geometry.t_min_m;
    let on_circle =
        |angle: f64| middle + radius * (edge.into[0] * angle.cos() + edge.normal[0] * angle.sin());
    // Three degrees off the wedge's own faces; the chords overlap because a ray is blind at its start.
    let (margin, overlap) = (PI / 60.0, PI / 36.0);
    let (first, last) = (margin, edge.n * PI - margin);
    let chords = 12;
    let step = (last - first) / f64::from(chords);
    (0..chords).any(|i| {
        let from = on_circle((first + f64::from(i) * step - overlap).max(first));
        let to = on_circle(first + f64::from(i + 1) * step);
        let d = to - from;
        geometry.bvh.any_hit(&geometry.triangles, from, d.normalize(), u32::MAX, d.length())
    })
}

/// Joins collinear pieces of the same wedge.
fn join(pieces: &[([u32; 2], Edge)]) -> Vec<Edge> {
    let mut at: FastMap<u32, Vec<usize>> = FastMap::default();
    for (i, (ends, _)) in pieces.iter().enumerate() {
        for &v in ends {
            at.entry(v).or_default().push(i);
        }
    }
    let mut used = vec![false; pieces.len()];
    let mut edges = Vec::new();
    for start in 0..pieces.len() {
        if used[start] {
            continue;
        }
        used[start] = true;
        let (mut ends, mut edge) = pieces[start];
        for _ in 0..2 {
            // Grow at the second end, then turn round and grow at the other.
            while let Some((i, next)) = at[&ends[1]].iter().find_map(|&i| {
                let (e, piece) = pieces[i];
                let next = if e[0] == ends[1] { piece } else { piece.reversed() };
                (!used[i] && edge.continues_in(&next)).then_some((i, next))
            }) {
                used[i] = true;
                let [p, q] = pieces[i].0;
                ends[1] = if p == ends[1] { q } else { p };
                edge.ends_m[1] = next.ends_m[1];
            }
            ends.swap(0, 1);
            edge = edge.reversed();
        }
        edges.push(edge);
    }
    edges
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::frames::Pose;
    use crate::scene::{Material, MaterialKind, Mesh, Scene};

    fn geometry_of(bodies: &[Vec<[DVec3; 3]>], material: Material) -> Geometry {
        let mut scene = Scene::default();
        scene.materials.push(material);
        for faces in bodies {
            let mesh = Mesh {
                positions_m: faces.iter().flatten().copied().collect(),
                triangles: (0..faces.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
                material: vec![0; faces.len()],
                normals: Vec::new(),
            };
            scene.add_mesh("target", "", mesh, Pose::from_yaw_pitch_roll(DVec3::X, 0.3, 0.2, 0.1));
        }
        Geometry::build(&scene, 0.0, 77e9).unwrap()
    }

    fn edges_of(faces: Vec<[DVec3; 3]>) -> Vec<Edge> {
        find(&geometry_of(&[faces], Material::pec()), SMOOTH_RAD)
    }

    fn p(x: f64, y: f64, z: f64) -> DVec3 {
        DVec3::new(x, y, z)
    }

    fn quad(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> Vec<[DVec3; 3]> {
        vec![[a, b, c], [a, c, d]]
    }

    fn cube() -> Vec<[DVec3; 3]> {
        let v = |i: usize| p((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64);
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
            .iter()
            .flat_map(|q| quad(v(q[0]), v(q[1]), v(q[2]), v(q[3])))
            .collect()
    }

    fn check(edges: &[Edge]) {
        for e in edges {
            let t = (e.ends_m[1] - e.ends_m[0]).normalize();
            assert!((e.tangent() - t).length() < 1e-9, "{e:?}");
            let angle = e.into[1].dot(e.normal[0]).atan2(e.into[1].dot(e.into[0]));
            let angle = if angle <= 1e-9 { angle + TAU } else { angle };
            assert!((angle - e.n * PI).abs() < 1e-9, "{e:?} {angle}");
            assert!((e.normal[1] - e.into[1].cross(t)).length() < 1e-9);
        }
    }

    #[test]
    fn a_plate_has_four_free_edges_however_it_is_cut() {
        let mut faces = quad(p(0., 0., 0.), p(0.5, 0., 0.), p(0.5, 1., 0.), p(0., 1., 0.));
        // The other half is cut twice, so that its middle corners meet no corner of the first.
        faces.extend(quad(p(0.5, 0., 0.), p(1., 0., 0.), p(1., 0.3, 0.), p(0.5, 0.3, 0.)));
        faces.extend(quad(p(0.5, 0.3, 0.), p(1., 0.3, 0.), p(1., 1., 0.), p(0.5, 1., 0.)));
        let edges = edges_of(faces);
        check(&edges);
        assert_eq!(edges.len(), 4, "{edges:#?}");
        assert!(edges.iter().all(|e| e.n == 2.0 && (e.length_m() - 1.0).abs() < 1e-9));
    }

    #[test]
    fn a_cube_has_twelve_whichever_way_its_faces_are_turned() {
        let mut faces = cube();
        for turned in [false, true] {
            if turned {
                faces[3].swap(0, 1);
                faces[7].swap(1, 2);
            }
            let edges = edges_of(faces.clone());
            check(&edges);
            assert_eq!(edges.len(), 12);
            assert!(edges.iter().all(|e| (e.n - 1.5).abs() < 1e-9));
            // The normals leave the solid: its centre lies behind both faces.
            let centre = Pose::<(), ()>::from_yaw_pitch_roll(DVec3::X, 0.3, 0.2, 0.1).point(p(0.5, 0.5, 0.5));
            assert!(edges.iter().all(|e| e.normal.iter().all(|n| n.dot(centre - e.ends_m[0]) < -0.4)));
        }
    }

    #[test]
    fn sheets_that_stand_on_each_other() {
        let floor = quad(p(0., 0., 0.), p(1., 0., 0.), p(1., 1., 0.), p(0., 1., 0.));
        // On the floor's edge: that edge is a wedge of 3/2, with five free ones.
        let mut dihedral = floor.clone();
        dihedral.extend(quad(p(0., 0., 0.), p(0., 1., 0.), p(0., 1., 0.5), p(0., 0., 0.5)));
        let edges = edges_of(dihedral);
        check(&edges);
        let wedges: Vec<f64> = edges.iter().map(|e| e.n).filter(|n| *n < 2.0).collect();
        assert_eq!(edges.len(), 7, "{edges:#?}");
        assert!(wedges.len() == 1 && (wedges[0] - 1.5).abs() < 1e-9, "{wedges:?}");
        // In the floor's middle: its foot is a concave corner on both sides. The same as another body.
        let wall = quad(p(0.5, 0.2, 0.), p(0.5, 0.8, 0.), p(0.5, 0.8, 0.5), p(0.5, 0.2, 0.5));
        let mut one = floor.clone();
        one.extend(wall.clone());
        assert_eq!(edges_of(one).len(), 7);
        let two = geometry_of(&[floor, wall], Material::pec());
        assert_eq!(find(&two, SMOOTH_RAD).len(), 7);
    }

    #[test]
    fn curved_bodies_have_only_their_rims() {
        let (n, r, h) = (36, 0.1, 0.2);
        let rim = |i: usize, z: f64| {
            let a = TAU * (i % n) as f64 / n as f64;
            p(r * a.cos(), r * a.sin(), z)
        };
        let mut faces = Vec::new();
        for i in 0..n {
            faces.extend(quad(rim(i, 0.), rim(i + 1, 0.), rim(i + 1, h), rim(i, h)));
            faces.push([p(0., 0., 0.), rim(i + 1, 0.), rim(i, 0.)]);
            faces.push([p(0., 0., h), rim(i, h), rim(i + 1, h)]);
        }
        let edges = edges_of(faces.clone());
        check(&edges);
        assert_eq!(edges.len(), 2 * n);
        assert!(edges.iter().all(|e| (e.n - 1.5).abs() < 1e-9));
        // A limit below the bend of ten degrees counts the mantle's lines too.
        let all = find(&geometry_of(&[faces], Material::pec()), 0.1);
        assert_eq!(all.len(), 3 * n);
    }

    #[test]
    fn dielectrics_have_none() {
        let mut glass = Material::pec();
        glass.kind = MaterialKind::Dielectric { eps_real: 5.0, eps_loss: 0.1, conductivity_s_per_m: 0.0 };
        assert!(find(&geometry_of(&[cube()], glass.clone()), SMOOTH_RAD).is_empty());
        glass.kind = MaterialKind::Conductor { conductivity_s_per_m: 3.5e7 };
        assert_eq!(find(&geometry_of(&[cube()], glass), SMOOTH_RAD).len(), 12);
    }
}
