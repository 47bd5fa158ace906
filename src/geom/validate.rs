//! What is wrong with a mesh, or odd about it, before a cross section is computed from it.
//!
//! How the odd ones are treated: open sheets are metal on both sides. A closed metal body that is inside
//! out is taken as a sheet, metal on both sides, which changes nothing. Only a dielectric needs to know
//! its outside: one that is inside out is an error. Triangles without area are left out.

use crate::base::error::{BadInput, Result};
use crate::base::units::C0;
use crate::scene::{Mesh, Scene, Shape};
use glam::{DVec2, DVec3};
use std::collections::{HashMap, HashSet};
use std::f64::consts::PI;

/// Facets whose longest edge is below this part of a wavelength count as small.
const SMALL: f64 = 0.01;
/// Triangles this many times longer than all smaller ones together count as oversized.
const OVERSIZED: f64 = 10.0;
/// Twice the area below this part of the longest edge squared is no area; as in `geom`.
const DEGENERATE: f64 = 1e-12;
/// Planes whose normals differ by less, and whose distances by less of the mesh's size, are one.
const COPLANAR: f64 = 1e-6;

/// Counts of the defects of a mesh.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
pub struct MeshReport {
    /// Number of triangles.
    pub triangles: usize,
    /// Facets of a curved surface: those with smooth normals.
    pub curved_facets: usize,
    /// Triangles without area.
    pub degenerate: usize,
    /// Parts that hang together by shared edges.
    pub parts: usize,
    /// Parts of which each edge joins two facets that are wound alike.
    pub closed_parts: usize,
    /// Closed parts of metal alone whose normals point inwards and that are no cavity in another.
    pub inside_out_metal: usize,
    /// Closed parts with a dielectric on any facet whose normals point inwards and that are no cavity in another.
    pub inside_out_dielectric: usize,
    /// Edges of one facet only: the rims of sheets.
    pub open_edges: usize,
    /// Edges of three facets or more.
    pub non_manifold_edges: usize,
    /// Edges whose two facets are wound against each other; joints of metal and dielectric are none.
    pub inconsistent_edges: usize,
    /// Triangles that are there more than once, counting all but the first.
    pub duplicates: usize,
    /// Pairs of triangles in one plane that overlap without being the same.
    pub overlaps: usize,
    /// Facets whose longest edge is below a hundredth of the wavelength.
    pub small_facets: usize,
    /// Triangles more than ten times longer than everything smaller together.
    pub oversized: usize,
    /// Wavelength that sizes are judged by, m.
    pub wavelength_m: f64,
}

impl MeshReport {
    /// Remarks on what is treated in a documented way and leaves the result right; one line each.
    pub fn notes(&self) -> Vec<String> {
        let mut lines = Vec::new();
        let mut say = |n: usize, one: &str, many: &str| {
            if n > 0 {
                lines.push(if n == 1 { format!("1 {one}") } else { format!("{n} {many}") });
            }
        };
        say(
            self.degenerate,
            "triangle has no area and is left out",
            "triangles have no area and are left out",
        );
        say(
            self.parts - self.closed_parts,
            "part is an open sheet, which is metal on both sides",
            "parts are open sheets, which are metal on both sides",
        );
        say(
            self.inside_out_metal,
            "closed metal body is inside out; it is treated as metal on both sides",
            "closed metal bodies are inside out; they are treated as metal on both sides",
        );
        say(
            self.non_manifold_edges,
            "edge joins three facets or more; each facet is treated as metal on both sides",
            "edges join three facets or more; each facet is treated as metal on both sides",
        );
        say(
            self.inconsistent_edges,
            "edge joins facets of opposite orientation; metal is the same on both sides",
            "edges join facets of opposite orientation; metal is the same on both sides",
        );
        lines
    }

    /// Warnings of what may make the result wrong, or takes time for nothing; one line each.
    pub fn warnings(&self) -> Vec<String> {
        let mut lines = Vec::new();
        if self.duplicates > 0 {
            lines.push(format!(
                "{} triangles occur more than once; bare metal counts once, other materials may radiate twice: remove the copies",
                self.duplicates
            ));
        }
        if self.overlaps > 0 {
            lines.push(format!(
                "{} pairs of triangles overlap in one plane; bare metal counts once, other materials may radiate twice: remove the overlap",
                self.overlaps
            ));
        }
        if self.small_facets > 0 {
            lines.push(format!(
                "{} facets are smaller than lambda/100 = {:.3} mm; they cost time, and physical optics is not valid for details of that size",
                self.small_facets,
                1e3 * SMALL * self.wavelength_m
            ));
        }
        if self.oversized > 0 {
            lines.push(format!(
                "{} triangles are over ten times longer than everything else together; check the unit (--unit mm) \
                 and whether the ground belongs to the target",
                self.oversized
            ));
        }
        lines
    }

    /// What may show in a frame, or is left out of it; one line each. Metal is the same on both sides, so that neither how it is wound nor
    /// whether it is closed is worth a line.
    pub fn in_frames(&self) -> Vec<String> {
        let mut lines = Vec::new();
        if self.degenerate > 0 {
            lines.push(match self.degenerate {
                1 => "1 triangle has no area and is left out".to_string(),
                n => format!("{n} triangles have no area and are left out"),
            });
        }
        if let Some(e) = self.error() {
            lines.push(format!("{}; {}", e.problem, e.remedy.as_deref().unwrap_or_default()));
        }
        // A frame knows its copies itself: those too that f32 has parted.
        let doubled = MeshReport { duplicates: 0, ..self.clone() };
        lines.extend(doubled.warnings());
        lines
    }

    /// The reason why no result can be right.
    pub fn error(&self) -> Option<BadInput> {
        (self.inside_out_dielectric > 0).then(|| {
            BadInput::new(format!(
                "{} closed dielectric bodies are inside out, so inside and outside are exchanged",
                self.inside_out_dielectric
            ))
            .allowed("normals that point outwards, or a cavity inside another body")
            .remedy("reverse their faces in the program that made the mesh")
        })
    }
}

/// Examines a mesh at a frequency. `dielectric` tells of a material index whether waves enter it.
///
/// # Errors
/// Returns an error for corners that point past the vertices, positions that are not finite, a frequency that is not
/// positive. What a report finds is no error here: see [`MeshReport::error`].
///
/// # Example
/// ```
/// use catseye::geom::validate::check_mesh;
/// use catseye::road::shape::cuboid;
/// use glam::DVec3;
///
/// let mut cube = cuboid(DVec3::ONE, DVec3::ZERO, 0);
/// let metal = |_: u32| false;
/// let report = check_mesh(&cube, 77e9, &metal)?;
/// assert_eq!((report.triangles, report.closed_parts, report.open_edges), (12, 1, 0));
/// // A triangle is missing: the three edges about the hole are open.
/// (cube.triangles.pop(), cube.material.pop());
/// let report = check_mesh(&cube, 77e9, &metal)?;
/// assert_eq!((report.triangles, report.closed_parts, report.open_edges), (11, 0, 3));
/// # Ok::<(), catseye::Error>(())
/// ```
pub fn check_mesh(mesh: &Mesh, freq_hz: f64, dielectric: &dyn Fn(u32) -> bool) -> Result<MeshReport> {
    if !(freq_hz > 0.0 && freq_hz.is_finite()) {
        return Err(BadInput::new("is not a frequency").key("frequency_hz").value(freq_hz).into());
    }
    let n = mesh.triangles.len();
    if mesh.material.len() != n {
        return Err(BadInput::new(format!("{n} triangles have {} materials", mesh.material.len()))
            .remedy("repair the mesh")
            .into());
    }
    if let Some(t) =
        mesh.triangles.iter().position(|t| t.iter().any(|&i| i as usize >= mesh.positions_m.len()))
    {
        return Err(BadInput::new(format!("the index exceeds the {} vertices", mesh.positions_m.len()))
            .key(format!("triangle {t}"))
            .value(format!("{:?}", mesh.triangles[t]))
            .remedy("repair the mesh")
            .into());
    }
    if let Some(v) = mesh.positions_m.iter().position(|p| !p.is_finite()) {
        return Err(BadInput::new("position is not a finite number")
            .key(format!("vertex {v}"))
            .value(mesh.positions_m[v])
            .remedy("repair the mesh")
            .into());
    }
    let wavelength_m = C0 / freq_hz;
    let mut report = MeshReport {
        triangles: n,
        curved_facets: (0..n).filter(|&t| mesh.corner_normals(t).is_some()).count(),
        wavelength_m,
        ..MeshReport::default()
    };
    let facets = Facets::new(mesh, dielectric);
    report.degenerate = n - facets.corners.len();
    facets.sizes(&mut report);
    facets.topology(&mut report);
    report.overlaps = facets.overlaps();
    Ok(report)
}

/// Examines each mesh of a scene that an object uses: (name of the first such object, report).
///
/// # Errors
/// Returns the errors of [`check_mesh`] and what [`MeshReport::error`] says; both name the object.
pub fn check_scene(scene: &Scene, freq_hz: f64) -> Result<Vec<(String, MeshReport)>> {
    let dielectric = |m: u32| scene.materials.get(m as usize).is_some_and(|m| m.is_dielectric());
    let mut seen = vec![false; scene.meshes.len()];
    let mut reports = Vec::new();
    for object in scene.objects.iter().filter(|o| o.radar) {
        let Shape::Mesh(m) = object.shape else { continue };
        if std::mem::replace(&mut seen[m], true) {
            continue;
        }
        let named = |e: crate::base::error::Error| match e {
            crate::base::error::Error::Input(b) => {
                let key = b.key.clone().map_or_else(String::new, |k| format!(" {k}"));
                b.key(format!("object '{}'{key}", object.name)).into()
            }
            e => e,
        };
        let report = check_mesh(&scene.meshes[m], freq_hz, &dielectric).map_err(named)?;
        if let Some(e) = report.error() {
            return Err(e.key(format!("object '{}'", object.name)).into());
        }
        reports.push((object.name.clone(), report));
    }
    Ok(reports)
}

/// Triangles with an area, on vertices that are welded by position.
struct Facets {
    positions_m: Vec<DVec3>,
    corners: Vec<[u32; 3]>,
    dielectric: Vec<bool>,
    size_m: f64,
}

impl Facets {
    fn new(mesh: &Mesh, dielectric: &dyn Fn(u32) -> bool) -> Facets {
        let mut place: HashMap<[u64; 3], u32> = HashMap::with_capacity(mesh.positions_m.len());
        let mut positions_m = Vec::new();
        let at: Vec<u32> = (mesh.positions_m.iter())
            .map(|p| {
                let p = *p + DVec3::ZERO;
                *place.entry(p.to_array().map(f64::to_bits)).or_insert_with(|| {
                    positions_m.push(p);
                    positions_m.len() as u32 - 1
                })
            })
            .collect();
        let mut facets = Facets { positions_m, corners: Vec::new(), dielectric: Vec::new(), size_m: 0.0 };
        let (mut lo, mut hi) = (DVec3::MAX, DVec3::MIN);
        for (t, corners) in mesh.triangles.iter().enumerate() {
            let corners = corners.map(|i| at[i as usize]);
            let p = corners.map(|i| facets.positions_m[i as usize]);
            if (p[1] - p[0]).cross(p[2] - p[0]).length() <= DEGENERATE * longest_m(p).powi(2) {
                continue;
            }
            for p in p {
                (lo, hi) = (lo.min(p), hi.max(p));
            }
            facets.corners.push(corners);
            facets.dielectric.push(dielectric(mesh.material[t]));
        }
        if !facets.corners.is_empty() {
            facets.size_m = (hi - lo).length();
        }
        facets
    }

    fn points(&self, t: usize) -> [DVec3; 3] {
        self.corners[t].map(|i| self.positions_m[i as usize])
    }

    fn sizes(&self, report: &mut MeshReport) {
        let mut by_length: Vec<(f64, usize)> =
            (0..self.corners.len()).map(|t| (longest_m(self.points(t)), t)).collect();
        by_length.sort_by(|a, b| a.0.total_cmp(&b.0));
        report.small_facets = by_length.partition_point(|(l, _)| *l < SMALL * report.wavelength_m);
        // From the smallest up: the first that dwarfs the box of all before it, and all after that.
        let (mut lo, mut hi) = (DVec3::MAX, DVec3::MIN);
        for (k, &(length, t)) in by_length.iter().enumerate() {
            if k > 0 && length > OVERSIZED * (hi - lo).length() {
                report.oversized = by_length.len() - k;
                break;
            }
            for p in self.points(t) {
                (lo, hi) = (lo.min(p), hi.max(p));
            }
        }
    }

    fn topology(&self, report: &mut MeshReport) {
        let n = self.corners.len();
        let mut parts = Parts::new(n);
        // Lower vertex, higher vertex, facet, and whether it runs the edge upwards; sorted, so that the
        // facets of an edge stand together.
        let mut edges: Vec<(u32, u32, u32, bool)> = Vec::with_capacity(3 * n);
        let mut seen: HashSet<[u32; 3]> = HashSet::with_capacity(n);
        for (t, c) in self.corners.iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (c[k], c[(k + 1) % 3]);
                edges.push((a.min(b), a.max(b), t as u32, a < b));
            }
            let mut sorted = *c;
            sorted.sort_unstable();
            report.duplicates += usize::from(!seen.insert(sorted));
        }
        edges.sort_unstable();
        let mut ragged = vec![false; n];
        for on_edge in edges.chunk_by(|e, f| (e.0, e.1) == (f.0, f.1)) {
            let (first, up) = (on_edge[0].2 as usize, on_edge[0].3);
            for e in &on_edge[1..] {
                parts.join(first, e.2 as usize);
            }
            let sound = match on_edge[..] {
                [_] => {
                    report.open_edges += 1;
                    false
                }
                [_, (_, _, other, other_up)] => {
                    let other = other as usize;
                    let joint = self.dielectric[first] != self.dielectric[other];
                    report.inconsistent_edges += usize::from(up == other_up && !joint);
                    up != other_up
                }
                _ => {
                    report.non_manifold_edges += 1;
                    false
                }
            };
            ragged[first] |= !sound;
        }
        let mut bodies: HashMap<usize, Body> = HashMap::new();
        for (t, ragged) in ragged.iter().enumerate() {
            let body = bodies.entry(parts.root(t)).or_insert_with(Body::new);
            body.facets.push(t);
            body.ragged |= ragged;
            body.dielectric |= self.dielectric[t];
            let [a, b, c] = self.points(t);
            body.volume_m3 += a.dot(b.cross(c)) / 6.0;
            (body.lo, body.hi) = (body.lo.min(a.min(b).min(c)), body.hi.max(a.max(b).max(c)));
        }
        report.parts = bodies.len();
        let closed: Vec<&Body> = bodies.values().filter(|b| !b.ragged).collect();
        report.closed_parts = closed.len();
        let outer: Vec<&&Body> = closed.iter().filter(|b| b.volume_m3 > 0.0).collect();
        for body in closed.iter().filter(|b| b.volume_m3 < 0.0) {
            let inner_point = self.points(body.facets[0])[0];
            let cavity = outer.iter().any(|o| {
                body.lo.cmpge(o.lo).all() && body.hi.cmple(o.hi).all() && self.winding(o, inner_point) > 0.5
            });
            if !cavity {
                match body.dielectric {
                    true => report.inside_out_dielectric += 1,
                    false => report.inside_out_metal += 1,
                }
            }
        }
    }

    /// How many times a body's surface encloses a point: its solid angle over 4 pi.
    fn winding(&self, body: &Body, p: DVec3) -> f64 {
        let angle: f64 = (body.facets.iter())
            .map(|&t| {
                // Van Oosterom and Strackee 1983, equation 8.
                let [a, b, c] = self.points(t).map(|q| q - p);
                let (la, lb, lc) = (a.length(), b.length(), c.length());
                let numerator = a.dot(b.cross(c));
                let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
                2.0 * numerator.atan2(denominator)
            })
            .sum();
        angle / (4.0 * PI)
    }

    fn overlaps(&self) -> usize {
        let mut planes: Vec<([i64; 4], usize)> = (0..self.corners.len())
            .map(|t| {
                let [a, b, c] = self.points(t);
                let mut normal = (b - a).cross(c - a).normalize();
                // One sign for both sides of a plane.
                let first = normal.to_array().into_iter().find(|x| x.abs() > 0.1).unwrap_or(1.0);
                normal *= first.signum();
                let near = |x: f64| (x / COPLANAR).round() as i64;
                ([near(normal.x), near(normal.y), near(normal.z), near(normal.dot(a) / self.size_m)], t)
            })
            .collect();
        planes.sort_unstable();
        planes.chunk_by(|a, b| a.0 == b.0).filter(|p| p.len() > 1).map(|p| self.overlaps_in_plane(p)).sum()
    }

    fn overlaps_in_plane(&self, plane: &[([i64; 4], usize)]) -> usize {
        let [a, b, c] = self.points(plane[0].1);
        let normal = (b - a).cross(c - a).abs();
        let flat = |p: DVec3| match normal.max_element() {
            m if m == normal.x => DVec2::new(p.y, p.z),
            m if m == normal.y => DVec2::new(p.x, p.z),
            _ => DVec2::new(p.x, p.y),
        };
        let mut flats: Vec<(usize, [DVec2; 3], DVec2, DVec2)> = (plane.iter())
            .map(|&(_, t)| {
                let p = self.points(t).map(flat);
                (t, p, p[0].min(p[1]).min(p[2]), p[0].max(p[1]).max(p[2]))
            })
            .collect();
        flats.sort_by(|a, b| a.2.x.total_cmp(&b.2.x));
        let slack = 1e-9 * self.size_m;
        let mut pairs = 0;
        for i in 0..flats.len() {
            let (t, p, lo, hi) = &flats[i];
            for (s, q, lo2, hi2) in flats[i + 1..].iter().take_while(|o| o.2.x < hi.x - slack) {
                if lo2.y >= hi.y - slack
                    || hi2.y <= lo.y + slack
                    || same_corners(self.corners[*t], self.corners[*s])
                {
                    continue;
                }
                pairs += usize::from(!separated(p, q, slack) && !separated(q, p, slack));
            }
        }
        pairs
    }
}

struct Body {
    facets: Vec<usize>,
    ragged: bool,
    dielectric: bool,
    volume_m3: f64,
    lo: DVec3,
    hi: DVec3,
}

impl Body {
    fn new() -> Body {
        Body {
            facets: Vec::new(),
            ragged: false,
            dielectric: false,
            volume_m3: 0.0,
            lo: DVec3::MAX,
            hi: DVec3::MIN,
        }
    }
}

fn longest_m([a, b, c]: [DVec3; 3]) -> f64 {
    (b - a).length().max((c - b).length()).max((a - c).length())
}

fn same_corners(mut a: [u32; 3], mut b: [u32; 3]) -> bool {
    a.sort_unstable();
    b.sort_unstable();
    a == b
}

/// Whether an edge of `p` has all of `q` on its outer side, or within `slack` of it.
fn separated(p: &[DVec2; 3], q: &[DVec2; 3], slack: f64) -> bool {
    let turn = (p[1] - p[0]).perp_dot(p[2] - p[0]).signum();
    (0..3).any(|i| {
        let (a, along) = (p[i], (p[(i + 1) % 3] - p[i]).normalize_or_zero());
        q.iter().all(|c| turn * along.perp_dot(*c - a) <= slack)
    })
}

/// Disjoint sets of facets.
struct Parts(Vec<usize>);

impl Parts {
    fn new(n: usize) -> Parts {
        Parts((0..n).collect())
    }

    fn root(&mut self, mut i: usize) -> usize {
        while self.0[i] != i {
            self.0[i] = self.0[self.0[i]];
            i = self.0[i];
        }
        i
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b)] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::frames::Pose;
    use crate::scene::{Material, material};
    use proptest::prelude::*;

    const F: f64 = 77e9;

    fn metal(_: u32) -> bool {
        false
    }

    /// A box from `lo` to `hi`, its faces outwards.
    fn cube(lo: DVec3, hi: DVec3) -> Mesh {
        let positions_m = (0..8)
            .map(|i| DVec3::new([lo.x, hi.x][i & 1], [lo.y, hi.y][i >> 1 & 1], [lo.z, hi.z][i >> 2]))
            .collect();
        let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles: Vec<[u32; 3]> =
            faces.iter().flat_map(|f| [[f[0], f[1], f[2]], [f[0], f[2], f[3]]]).collect();
        Mesh { positions_m, material: vec![0; triangles.len()], triangles, ..Mesh::default() }
    }

    fn join(mut a: Mesh, b: &Mesh) -> Mesh {
        let base = a.positions_m.len() as u32;
        a.positions_m.extend_from_slice(&b.positions_m);
        a.triangles.extend(b.triangles.iter().map(|t| t.map(|i| i + base)));
        a.material.extend_from_slice(&b.material);
        a
    }

    fn turned(mut m: Mesh) -> Mesh {
        m.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        m
    }

    fn check(m: &Mesh) -> MeshReport {
        check_mesh(m, F, &metal).unwrap()
    }

    #[test]
    fn a_sound_box_has_nothing_to_say() {
        let r = check(&cube(DVec3::ZERO, DVec3::ONE));
        assert_eq!((r.triangles, r.parts, r.closed_parts), (12, 1, 1));
        assert!(r.notes().is_empty() && r.warnings().is_empty() && r.error().is_none(), "{r:?}");
        // Vertices of its own for each face, as exporters write: still one closed body.
        let b = cube(DVec3::ZERO, DVec3::ONE);
        let loose = Mesh {
            positions_m: b.triangles.iter().flatten().map(|&i| b.positions_m[i as usize]).collect(),
            triangles: (0..12).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
            ..b
        };
        assert_eq!(check(&loose), r);
    }

    #[test]
    fn inside_out_is_a_note_for_metal_and_an_error_for_dielectrics() {
        let m = turned(cube(DVec3::ZERO, DVec3::ONE));
        let r = check(&m);
        assert_eq!((r.closed_parts, r.inside_out_metal, r.inside_out_dielectric), (1, 1, 0));
        assert!(r.error().is_none() && r.notes()[0].contains("inside out"));
        let r = check_mesh(&m, F, &|_| true).unwrap();
        assert_eq!((r.inside_out_metal, r.inside_out_dielectric), (0, 1));
        let mut scene = Scene::default();
        scene.materials.push(material::by_name("ice").unwrap());
        scene.add_mesh("block", "", m, Pose::IDENTITY);
        let e = check_scene(&scene, F).unwrap_err().to_string();
        assert!(e.contains("object 'block'") && e.contains("inside out") && !e.contains('\n'), "{e}");
        scene.materials[0] = Material::pec();
        assert_eq!(check_scene(&scene, F).unwrap()[0].1.inside_out_metal, 1);
    }

    #[test]
    fn a_cavity_is_not_inside_out() {
        let hole = turned(cube(DVec3::splat(0.2), DVec3::splat(0.8)));
        let hollow = join(cube(DVec3::ZERO, DVec3::ONE), &hole);
        let r = check_mesh(&hollow, F, &|_| true).unwrap();
        assert_eq!((r.parts, r.closed_parts, r.inside_out_dielectric), (2, 2, 0));
        // Beside another body, not in it.
        let beside = join(
            cube(DVec3::ZERO, DVec3::new(1.0, 1.0, 0.1)),
            &turned(cube(DVec3::splat(0.2), DVec3::splat(0.8))),
        );
        assert_eq!(check(&beside).inside_out_metal, 1);
    }

    #[test]
    fn holes_flips_fins_and_copies_are_counted() {
        let mut holed = cube(DVec3::ZERO, DVec3::ONE);
        holed.triangles.pop();
        holed.material.pop();
        let r = check(&holed);
        assert_eq!((r.open_edges, r.closed_parts, r.parts), (3, 0, 1));
        assert!(r.notes()[0].contains("sheet"));
        let mut flipped = cube(DVec3::ZERO, DVec3::ONE);
        flipped.triangles[4].swap(0, 1);
        let r = check(&flipped);
        assert_eq!((r.inconsistent_edges, r.closed_parts), (3, 0));
        let mut fin = cube(DVec3::ZERO, DVec3::ONE);
        fin.positions_m.push(DVec3::new(0.5, -1.0, -1.0));
        fin.triangles.push([0, 1, 8]);
        fin.material.push(0);
        assert_eq!(check(&fin).non_manifold_edges, 1);
        let mut copied = cube(DVec3::ZERO, DVec3::ONE);
        let t = copied.triangles[7];
        copied.triangles.extend([[t[1], t[2], t[0]], [t[1], t[0], t[2]]]);
        copied.material.extend([0, 0]);
        let r = check(&copied);
        assert_eq!((r.duplicates, r.overlaps), (2, 0));
        assert!(r.warnings()[0].contains("radiate twice"));
        let mut slim = cube(DVec3::ZERO, DVec3::ONE);
        slim.triangles.extend([[0, 0, 1], [0, 1, 1]]);
        slim.material.extend([0, 0]);
        let r = check(&slim);
        assert_eq!((r.degenerate, r.closed_parts), (2, 1));
    }

    /// Tilted plates in one plane, one over a part of the other.
    #[test]
    fn overlaps_are_found_in_any_plane() {
        let turn = glam::DQuat::from_rotation_x(0.7) * glam::DQuat::from_rotation_y(1.1);
        let plate = |shift: f64, flip: bool| {
            let at = |x: f64, y: f64| turn * DVec3::new(x + shift, y, 0.3);
            let m = Mesh {
                positions_m: vec![at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)],
                triangles: vec![[0, 1, 2], [0, 2, 3]],
                material: vec![0, 0],
                ..Mesh::default()
            };
            if flip { turned(m) } else { m }
        };
        assert_eq!(check(&join(plate(0.0, false), &plate(1.0, false))).overlaps, 0, "edge to edge");
        assert_eq!(check(&join(plate(0.0, false), &plate(2.5, true))).overlaps, 0);
        for flip in [false, true] {
            // x from 0.5 to 1: the new plate's two triangles against both old ones, where they meet.
            assert_eq!(check(&join(plate(0.0, false), &plate(0.5, flip))).overlaps, 3, "{flip}");
        }
        let mut above = plate(0.5, false);
        above.positions_m.iter_mut().for_each(|p| *p += turn * DVec3::Z * 0.01);
        assert_eq!(check(&join(plate(0.0, false), &above)).overlaps, 0, "one over the other");
    }

    #[test]
    fn small_and_oversized() {
        let lambda = C0 / F;
        let tiny = cube(DVec3::ZERO, DVec3::splat(lambda / 200.0));
        assert_eq!(check(&tiny).small_facets, 12);
        assert_eq!(check(&cube(DVec3::ZERO, DVec3::splat(lambda / 90.0))).small_facets, 0);
        let ground = cube(DVec3::new(-500.0, -500.0, -0.3), DVec3::new(500.0, 500.0, -0.2));
        let r = check(&join(cube(DVec3::ZERO, DVec3::ONE), &ground));
        assert_eq!(r.oversized, 12);
        assert!(r.warnings()[0].contains("unit"));
        assert_eq!(check(&ground).oversized, 0, "nothing to compare it with");
    }

    #[test]
    fn what_cannot_be_read_is_an_error() {
        let mut m = cube(DVec3::ZERO, DVec3::ONE);
        m.triangles[3][1] = 99;
        let e = check_mesh(&m, F, &metal).unwrap_err();
        assert!(e.exit_code() == 2 && e.to_string().contains("triangle 3"), "{e}");
        let mut m = cube(DVec3::ZERO, DVec3::ONE);
        m.positions_m[2].y = f64::NAN;
        assert!(check_mesh(&m, F, &metal).unwrap_err().to_string().contains("vertex 2"));
        let mut m = cube(DVec3::ZERO, DVec3::ONE);
        m.material.pop();
        assert!(check_mesh(&m, F, &metal).is_err());
        assert!(check_mesh(&cube(DVec3::ZERO, DVec3::ONE), f64::NAN, &metal).is_err());
        assert_eq!(check(&Mesh::default()).parts, 0);
    }

    proptest! {
        #[test]
        fn hostile_meshes_never_panic(
            corners in prop::collection::vec(prop::array::uniform3(-2i8..3), 1..12),
            picks in prop::collection::vec(prop::array::uniform3(any::<prop::sample::Index>()), 0..30),
            scale in prop::sample::select(vec![1e-300, 1e-9, 1.0, 1e9, 1e150]),
        ) {
            let m = Mesh {
                positions_m: corners.iter().map(|c| DVec3::from(c.map(f64::from)) * scale).collect(),
                triangles: picks.iter().map(|p| p.map(|i| i.index(corners.len()) as u32)).collect(),
                material: (0..picks.len() as u32).collect(),
                ..Mesh::default()
            };
            let r = check_mesh(&m, F, &|m| m % 3 == 0).unwrap();
            prop_assert!(r.parts >= r.closed_parts && r.degenerate <= r.triangles);
            prop_assert!(r.closed_parts >= r.inside_out_metal + r.inside_out_dielectric);
            let _ = (r.notes(), r.warnings(), r.error());
        }
    }
}
