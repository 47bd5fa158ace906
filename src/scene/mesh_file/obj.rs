//! Wavefront OBJ: vertices, normals, polygons, objects and names of materials.

use super::contents::{Contents, NO_MATERIAL, check_counts, stem, vector};
use crate::base::error::{BadInput, Result};
use crate::scene::Mesh;
use crate::scene::toml_file::clip;
use glam::{DVec2, DVec3};
use std::collections::HashMap;
use std::path::Path;

/// Corners of a polygon that is not convex: its triangles are sought among all of them.
const MAX_CONCAVE: usize = 4096;

/// What stands beside polygons and says nothing about them that is needed.
const PASSED_OVER: [&str; 17] = [
    "vt",
    "vp",
    "g",
    "s",
    "mg",
    "mtllib",
    "maplib",
    "usemap",
    "bevel",
    "c_interp",
    "d_interp",
    "lod",
    "shadow_obj",
    "trace_obj",
    "#",
    "end",
    "call",
];
const LINES: [&str; 2] = ["l", "p"];
const FREEFORM: [&str; 16] = [
    "cstype", "deg", "bmat", "step", "curv", "curv2", "surf", "parm", "trim", "hole", "scrv", "sp", "con",
    "ctech", "stech", "bsp",
];

/// The object that is being read.
#[derive(Default)]
struct Part {
    mesh: Mesh,
    /// (vertex, normal) of the file to vertex of the mesh.
    index: HashMap<(usize, Option<usize>), u32>,
}

struct Reader<'a> {
    file: &'a Path,
    points: Vec<DVec3>,
    normals: Vec<DVec3>,
    name: String,
    part: Part,
    material: u32,
    /// Number of triangles in all parts that are complete.
    triangles: usize,
    vertices: usize,
    out: Contents,
}

/// One part for each `o`.
///
/// # Errors
/// Returns an error for lines that are not OBJ, freeform surfaces, numbers that are not finite, indices out of range,
/// or polygons that cross themselves.
pub(super) fn read(bytes: &[u8], file: &Path) -> Result<Contents> {
    let text = String::from_utf8_lossy(bytes);
    let mut reader = Reader {
        file,
        points: Vec::new(),
        normals: Vec::new(),
        name: stem(file),
        part: Part::default(),
        material: NO_MATERIAL,
        triangles: 0,
        vertices: 0,
        out: Contents::default(),
    };
    let mut lines = text.lines().enumerate();
    while let Some((i, line)) = lines.next() {
        // A line that ends in a backslash goes on in the next.
        match line.trim_end().strip_suffix('\\') {
            None => reader.line(i + 1, line)?,
            Some(begin) => {
                let mut whole = begin.to_string();
                for (_, more) in lines.by_ref() {
                    whole.push(' ');
                    match more.trim_end().strip_suffix('\\') {
                        Some(part) => whole.push_str(part),
                        None => {
                            whole.push_str(more);
                            break;
                        }
                    }
                }
                reader.line(i + 1, &whole)?;
            }
        }
    }
    reader.finish_part();
    Ok(reader.out)
}

impl Reader<'_> {
    fn line(&mut self, number: usize, line: &str) -> Result<()> {
        let bad = |problem: &str| BadInput::new(problem).file(self.file).line(number);
        let mut words = line.split_whitespace();
        let Some(word) = words.next() else { return Ok(()) };
        match word {
            "v" | "vn" => {
                let p = vector(words).ok_or_else(|| {
                    bad("is not three finite numbers").key(word).remedy("clean the mesh and export it again")
                })?;
                if word == "v" { &mut self.points } else { &mut self.normals }.push(p);
                check_counts(self.file, 0, self.points.len().max(self.normals.len()))
            }
            "f" | "fo" => self.face(number, words),
            "o" => {
                self.finish_part();
                let name = clip(&words.collect::<Vec<_>>().join(" "));
                self.name = if name.is_empty() { stem(self.file) } else { name };
                Ok(())
            }
            "usemtl" => {
                let name = words.collect::<Vec<_>>().join(" ");
                self.material = match self.out.materials.iter().position(|m| *m == name) {
                    _ if name.is_empty() => NO_MATERIAL,
                    Some(i) => i as u32,
                    None => {
                        self.out.materials.push(name);
                        (self.out.materials.len() - 1) as u32
                    }
                };
                Ok(())
            }
            w if PASSED_OVER.contains(&w) || w.starts_with('#') => Ok(()),
            w if LINES.contains(&w) => {
                let note = "points and lines have no area and are left out";
                if !self.out.notes.iter().any(|n| n == note) {
                    self.out.notes.push(note.into());
                }
                Ok(())
            }
            w if FREEFORM.contains(&w) => {
                Err(bad("freeform curves and surfaces are not read").key(w).remedy("export polygons").into())
            }
            _ => Err(bad("is no line of an OBJ file").remedy("export the file again").into()),
        }
    }

    fn finish_part(&mut self) {
        let part = std::mem::take(&mut self.part);
        if !part.mesh.triangles.is_empty() {
            self.triangles += part.mesh.triangles.len();
            self.vertices += part.mesh.positions_m.len();
            self.out.parts.push((self.name.clone(), part.mesh));
        }
    }

    fn face<'a>(&mut self, number: usize, words: impl Iterator<Item = &'a str>) -> Result<()> {
        let bad = |problem: String| BadInput::new(problem).file(self.file).line(number).key("f");
        let index = |text: &str, count: usize, what: &str| -> Result<usize> {
            let given: Option<i64> = text.parse().ok();
            let from_start = match given {
                Some(i) if i > 0 => usize::try_from(i - 1).ok(),
                // Counted back from the last one so far.
                Some(i) if i < 0 => usize::try_from(i.unsigned_abs()).ok().and_then(|i| count.checked_sub(i)),
                _ => None,
            };
            let bad = || {
                let allowed = match count {
                    0 => "none, there are none before this line".into(),
                    n => format!("1..={n}, or -{n}..=-1 from the last one"),
                };
                bad(format!("is no index of a {what}")).value(clip(text)).allowed(allowed)
            };
            from_start.filter(|i| *i < count).ok_or_else(|| bad().remedy("export the file again").into())
        };
        let mut corners: Vec<u32> = Vec::new();
        let (points, normals) = (&self.points, &self.normals);
        for word in words {
            let mut parts = word.split('/');
            let vertex = index(parts.next().unwrap_or(""), points.len(), "vertex")?;
            let normal = parts.nth(1).filter(|n| !n.is_empty());
            let normal = normal.map(|n| index(n, normals.len(), "normal")).transpose()?;
            let mesh = &mut self.part.mesh;
            corners.push(*self.part.index.entry((vertex, normal)).or_insert_with(|| {
                mesh.positions_m.push(points[vertex]);
                // Zero says that there is none.
                mesh.normals.push(normal.map_or(DVec3::ZERO, |n| normals[n].normalize_or_zero()));
                (mesh.positions_m.len() - 1) as u32
            }));
        }
        if corners.len() < 3 {
            return Err(bad("a face has fewer than three corners".into()).value(corners.len()).into());
        }
        let at: Vec<DVec3> = corners.iter().map(|c| self.part.mesh.positions_m[*c as usize]).collect();
        let triangles = triangles_of(&at).map_err(|problem| bad(problem).remedy("export triangles"))?;
        let mesh = &mut self.part.mesh;
        mesh.triangles.extend(triangles.iter().map(|t| t.map(|i| corners[i])));
        mesh.material.resize(mesh.triangles.len(), self.material);
        check_counts(self.file, self.triangles + mesh.triangles.len(), self.vertices + mesh.positions_m.len())
    }
}

/// Cuts a polygon given by its corners into triangles, in its own winding; by cutting off ears in its mean plane unless
/// it is convex. Returns an error if it crosses itself.
fn triangles_of(at: &[DVec3]) -> Result<Vec<[usize; 3]>, String> {
    let fan = || (1..at.len() - 1).map(|i| [0, i, i + 1]).collect();
    let n = at.len();
    // Newell: twice the area vector.
    let normal: DVec3 = (1..n - 1).map(|i| (at[i] - at[0]).cross(at[i + 1] - at[0])).sum();
    if n == 3 || normal == DVec3::ZERO || !normal.is_finite() {
        // Without an area it is dropped, as triangles are.
        return Ok(fan());
    }
    let normal = normal.normalize_or_zero();
    let (u, v) = normal.any_orthonormal_pair();
    let flat: Vec<DVec2> = at.iter().map(|p| *p - at[0]).map(|p| DVec2::new(p.dot(u), p.dot(v))).collect();
    let size = flat.iter().fold(0.0_f64, |a, p| a.max(p.length_squared()));
    let turn = |a: usize, b: usize, c: usize| (flat[b] - flat[a]).perp_dot(flat[c] - flat[a]);
    let (small, turns) = (1e-12 * size, |i: usize| turn((i + n - 1) % n, i, (i + 1) % n));
    // Convex when it turns one way, and once: each triangle of the fan lies on the same side too.
    if (0..n).all(|i| turns(i) >= -small) && (1..n - 1).all(|i| turn(0, i, i + 1) >= -small) {
        return Ok(fan());
    }
    if n > MAX_CONCAVE {
        return Err(format!("a polygon of {n} corners is not convex (up to {MAX_CONCAVE} can be divided)"));
    }
    let mut left: Vec<usize> = (0..n).collect();
    let mut out = Vec::with_capacity(n - 2);
    while left.len() > 3 {
        let m = left.len();
        let ear = (0..m).find(|&k| {
            let (a, b, c) = (left[(k + m - 1) % m], left[k], left[(k + 1) % m]);
            let inside = |p: usize| {
                let on = flat[p] == flat[a] || flat[p] == flat[b] || flat[p] == flat[c];
                !on && turn(a, b, p) >= -small && turn(b, c, p) >= -small && turn(c, a, p) >= -small
            };
            turn(a, b, c) > small && !left.iter().any(|&p| p != a && p != b && p != c && inside(p))
        });
        // Corners on a straight line are no ears, and nothing is lost with them once no ear is left.
        let straight =
            || (0..m).find(|&k| turn(left[(k + m - 1) % m], left[k], left[(k + 1) % m]).abs() <= small);
        let k = ear.or_else(straight).ok_or("a polygon crosses itself")?;
        out.push([left[(k + m - 1) % m], left[k], left[(k + 1) % m]]);
        left.remove(k);
    }
    // What is left of a polygon that does not cross itself turns as all of it does.
    if turn(left[0], left[1], left[2]) < -small {
        return Err("a polygon crosses itself".into());
    }
    out.push([left[0], left[1], left[2]]);
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(at: &[DVec3]) -> f64 {
        let t = triangles_of(at).unwrap();
        assert_eq!(t.len(), at.len() - 2);
        t.iter().map(|t| 0.5 * (at[t[1]] - at[t[0]]).cross(at[t[2]] - at[t[0]]).z).sum()
    }

    #[test]
    fn polygons_are_divided_without_overlap() {
        let polygon =
            |list: &[[f64; 2]]| -> Vec<DVec3> { list.iter().map(|p| DVec3::new(p[0], p[1], 0.0)).collect() };
        let ell = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
        for start in 0..ell.len() {
            let mut turned = ell;
            turned.rotate_left(start);
            let at = polygon(&turned);
            assert!((area(&at) - 3.0).abs() < 1e-12);
            for t in triangles_of(&at).unwrap() {
                assert!((at[t[1]] - at[t[0]]).cross(at[t[2]] - at[t[0]]).z >= 0.0, "{t:?} is turned over");
            }
        }
        // Points between the corners of a square.
        let square = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 2.0], [1.0, 2.0], [0.0, 2.0]];
        assert!((area(&polygon(&square)) - 4.0).abs() < 1e-12);
        let bow = polygon(&[[0.0, 0.0], [2.0, 3.0], [2.0, 0.0], [0.0, 2.0]]);
        assert!(triangles_of(&bow).is_err());
    }
}
