//! Wavefront OBJ: vertices, normals, polygons, objects and names of materials.

use super::contents::{Contents, NO_MATERIAL, check_counts, finite, hint, keyword, stem};
use crate::base::error::{BadInput, Result};
use crate::formats::text::{of_other_kind, split_comment, with_names};
use crate::scene::Mesh;
use crate::scene::toml_file::clip;
use glam::{DVec2, DVec3};
use std::collections::HashMap;
use std::path::Path;

/// Corners of a polygon that is not convex: its triangles are sought among all of them.
const MAX_CONCAVE: usize = 4096;

/// What stands beside polygons and says nothing about them that is needed.
const PASSED_OVER: [&str; 15] = [
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
    "end",
];
/// Commands that bring in what is in other files.
const COMMANDS: [&str; 2] = ["call", "csh"];
/// Share of a polygon's size by which its corners may be off its plane: a hundredth changes the echo of a plate of 25 wavelengths by 0.2 dB.
const WARPED: f64 = 0.005;
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
    /// Number of polygons that are not flat, and the largest distance of a corner from the plane of one.
    warped: (usize, f64),
    out: Contents,
}

/// One part for each `o`.
///
/// # Errors
/// Returns an error for lines that are not OBJ, freeform surfaces, numbers that are not finite, indices out of range,
/// or polygons that cross themselves.
pub(super) fn read(bytes: &[u8], file: &Path) -> Result<Contents> {
    if let Some(other) = of_other_kind(bytes, file, "OBJ") {
        return Err(other.into());
    }
    if bytes.contains(&0) {
        let bad = BadInput::new("is not OBJ: it is binary").file(file);
        return Err(bad
            .remedy("export it as OBJ, or give it the extension of its format, such as .stl or .glb")
            .into());
    }
    let text = with_names(bytes);
    let mut reader = Reader {
        file,
        points: Vec::new(),
        normals: Vec::new(),
        name: stem(file),
        part: Part::default(),
        material: NO_MATERIAL,
        triangles: 0,
        vertices: 0,
        warped: (0, 0.0),
        out: Contents::default(),
    };
    let mut lines = text.lines().enumerate();
    while let Some((i, line)) = lines.next() {
        let (said, comment) = split_comment(line);
        // A line that ends in a backslash goes on in the next; a comment, as of a folder, does not.
        let Some(begin) = said.trim_end().strip_suffix('\\').filter(|_| comment.is_none()) else {
            reader.line(i + 1, said, comment)?;
            continue;
        };
        let mut whole = begin.to_string();
        let mut last = None;
        for (_, more) in lines.by_ref() {
            let (said, comment) = split_comment(more);
            whole.push(' ');
            last = comment;
            match said.trim_end().strip_suffix('\\').filter(|_| comment.is_none()) {
                Some(part) => whole.push_str(part),
                None => {
                    whole.push_str(said);
                    break;
                }
            }
        }
        reader.line(i + 1, &whole, last)?;
    }
    reader.finish_part();
    if let (count @ 1.., most) = reader.warped {
        reader.note(&format!(
            "not flat: {count} faces of more than three corners, by up to {most:.3} of the file's units; the reader decides how to divide them into triangles: export triangles"
        ));
    }
    Ok(reader.out)
}

impl Reader<'_> {
    fn note(&mut self, note: &str) {
        if !self.out.notes.iter().any(|n| n == note) {
            self.out.notes.push(note.into());
        }
    }

    /// Three numbers of a vertex or a normal. Behind those of a vertex there may be a weight or a colour.
    fn vector(&mut self, number: usize, key: &str, words: &[&str]) -> Result<DVec3> {
        let bad = |problem: &str| BadInput::new(problem).file(self.file).line(number).key(key);
        let read: Vec<Option<f64>> = words.iter().map(|w| finite(w)).collect();
        let (&[Some(x), Some(y), Some(z), ..], None) = (&read[..], read.iter().position(Option::is_none))
        else {
            let wrong = words.iter().zip(&read).find(|(_, x)| x.is_none()).map(|(w, _)| *w);
            let b = bad("is not three finite numbers").value(clip(wrong.unwrap_or(&words.join(" "))));
            return Err(b.remedy(hint(words)).into());
        };
        let allowed = if key == "v" { "x y z, x y z w, x y z r g b, or x y z w r g b" } else { "x y z" };
        if !matches!((key, words.len()), (_, 3) | ("v", 4 | 6 | 7)) {
            let b = bad("has the wrong number of values").value(words.len()).allowed(allowed);
            return Err(b.remedy("export the file again").into());
        }
        if matches!(read[3..], [Some(w)] | [Some(w), _, _, _] if w != 1.0) {
            self.note("weights of vertices apply only to freeform surfaces and are left out");
        }
        Ok(DVec3::new(x, y, z))
    }

    fn line(&mut self, number: usize, line: &str, comment: Option<&str>) -> Result<()> {
        let file = self.file;
        let bad = |problem: &str| BadInput::new(problem).file(file).line(number);
        let mut words = line.split_whitespace();
        let Some(word) = words.next() else {
            // What a writer says about its file is at its beginning.
            if let Some(comment) = comment.filter(|_| self.points.is_empty() && self.out.header.len() < 4096)
            {
                self.out.header.push_str(comment);
                self.out.header.push('\n');
            }
            return Ok(());
        };
        match word {
            "v" | "vn" => {
                let p = self.vector(number, word, &words.collect::<Vec<_>>())?;
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
                if let Some(comment) = comment {
                    let note = format!("usemtl {} #{}: the # begins a comment", clip(&name), clip(comment));
                    self.note(&note);
                }
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
            w if PASSED_OVER.contains(&w) => Ok(()),
            w if LINES.contains(&w) => {
                self.note("points and lines have no area and are left out");
                Ok(())
            }
            w if COMMANDS.contains(&w) => {
                let b = bad("includes another file, which is not supported").key(w);
                Err(b.remedy("export everything in one file").into())
            }
            w if FREEFORM.contains(&w) => Err(bad("freeform curves and surfaces are not supported")
                .key(w)
                .remedy("export polygons")
                .into()),
            "solid" if number == 1 => Err(bad("is ASCII STL").remedy("name it .stl").into()),
            w => {
                let b = bad("is not a line of an OBJ file").allowed("v, vn, vt, f, o, g, s, usemtl, …");
                let b = BadInput { key: keyword(w).map(Into::into), ..b };
                Err(b.remedy("export the file again").into())
            }
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
                bad(format!("is not the index of a {what}")).value(clip(text)).allowed(allowed)
            };
            from_start.filter(|i| *i < count).ok_or_else(|| bad().remedy("export the file again").into())
        };
        let mut corners: Vec<u32> = Vec::new();
        let (points, normals) = (&self.points, &self.normals);
        for word in words {
            let mut parts = word.split('/');
            let vertex = index(parts.next().unwrap_or(""), points.len(), "vertex")?;
            // Textures are not read, but what is no index is a fault.
            if let Some(t) = parts.next().filter(|t| !t.is_empty() && t.parse::<i64>().is_err()) {
                let b = bad("is not the index of a texture coordinate".into()).value(clip(t));
                return Err(b.remedy("export the file again").into());
            }
            let normal = parts.next().filter(|n| !n.is_empty());
            if parts.next().is_some() {
                let b = bad("is not a corner of a face".into()).value(clip(word));
                return Err(b.allowed("v, v/vt, v//vn or v/vt/vn").remedy("export the file again").into());
            }
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
        let (off, size) = off_plane(&at);
        if off > WARPED * size {
            self.warped = (self.warped.0 + 1, self.warped.1.max(off));
        }
        let mesh = &mut self.part.mesh;
        mesh.triangles.extend(triangles.iter().map(|t| t.map(|i| corners[i])));
        mesh.material.resize(mesh.triangles.len(), self.material);
        check_counts(self.file, self.triangles + mesh.triangles.len(), self.vertices + mesh.positions_m.len())
    }
}

/// The largest distance of a corner from the mean plane of a polygon, and the polygon's size.
fn off_plane(at: &[DVec3]) -> (f64, f64) {
    let middle = at.iter().sum::<DVec3>() / at.len() as f64;
    let normal: DVec3 = (1..at.len() - 1).map(|i| (at[i] - at[0]).cross(at[i + 1] - at[0])).sum();
    let normal = normal.normalize_or_zero();
    let off = at.iter().map(|p| (*p - middle).dot(normal).abs()).fold(0.0, f64::max);
    (off, at.iter().map(|p| p.distance(at[0])).fold(0.0, f64::max))
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
    fn faces_that_are_not_flat_are_said() {
        let notes = |z: f64| {
            let text = format!("v 0 0 0\nv 1 0 {z}\nv 1 1 0\nv 0 1 {z}\nf 1 2 3 4\nf 1 2 3\n");
            read(text.as_bytes(), Path::new("a.obj")).unwrap().notes
        };
        assert_eq!(notes(0.0), Vec::<String>::new());
        assert_eq!(notes(0.001), Vec::<String>::new());
        let said = notes(0.3).join("; ");
        assert!(said.contains("not flat: 1 faces of more than three corners, by up to 0.15"), "{said}");
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

    fn contents(bytes: &[u8]) -> Result<Contents, String> {
        read(bytes, Path::new("a.obj")).map_err(|e| {
            assert_eq!((e.exit_code(), e.to_string().lines().count()), (2, 1));
            assert!(e.to_string().chars().count() <= crate::base::error::MAX_CHARS);
            e.to_string()
        })
    }

    /// Corners of all triangles with the names of their materials.
    fn shape(c: &Contents) -> Vec<([DVec3; 3], &str)> {
        let of = |m: &Mesh| -> Vec<([DVec3; 3], &str)> {
            let corners = m.triangles.iter().map(|t| t.map(|v| m.positions_m[v as usize]));
            let name = |m: &u32| c.materials.get(*m as usize).map_or("", String::as_str);
            corners.zip(m.material.iter().map(name)).collect()
        };
        c.parts.iter().flat_map(|(_, m)| of(m)).collect()
    }

    /// What a change of the text makes of it.
    enum Becomes {
        Same,
        Noted(&'static str),
        Other,
        Refused(&'static str),
    }
    use Becomes::*;

    #[test]
    fn each_change_changes_the_result_or_is_reported() {
        const PLAIN: &str =
            "# by hand\no wall\nv 0 0 0\nv 0 5 0\nv 0 5 5.5\nv 0 0 5\nvn 1 0 0\nusemtl steel\nf 1 2 3 4\n";
        let with = |from: &str, to: &str| PLAIN.replacen(from, to, 1).into_bytes();
        let cases: Vec<(&str, Vec<u8>, Becomes)> = vec![
            ("CRLF", PLAIN.replace('\n', "\r\n").into(), Same),
            ("CR alone", PLAIN.replace('\n', "\r").into(), Same),
            ("tabs", PLAIN.replace(' ', "\t").into(), Same),
            ("mark", format!("\u{feff}{PLAIN}").into(), Same),
            ("comments behind", PLAIN.replace(" 5\n", " 5 # top\n").replace("3 4", "3 4\t#").into(), Same),
            (
                "a comment behind a material",
                with("steel", "steel # paint"),
                Noted("usemtl steel #paint: the # begins a comment"),
            ),
            ("a comment that ends in a backslash", with("# by hand", "# C:\\parts\\"), Same),
            ("lines that go on", with("2 3", "2\\\n \\\n3"), Same),
            ("a comment in a line that goes on", with("2 3 4", "2 \\\n3 4 # all"), Same),
            ("weight of one", with("5.5", "5.5 1.0"), Same),
            ("weight", with("5.5", "5.5 0.5"), Noted("weights of vertices")),
            ("colour", with("5.5", "5.5 0.1 0.2 0.3"), Same),
            ("weight and colour", with("5.5", "5.5 2 0.1 0.2 0.3"), Noted("weights of vertices")),
            ("indices from the end", with("1 2 3 4", "-4 -3 -2 -1"), Same),
            ("texture and normal", with("1 2 3 4", "1/1/1 2/7/1 3//1 4/"), Same),
            ("a # in a name", with("steel", "steel#2"), Other),
            ("scale", PLAIN.replace('5', "50").into(), Other),
            ("columns in another order", PLAIN.replace("v 0 5 ", "v 5 0 ").into(), Other),
            ("turned over", with("1 2 3 4", "4 3 2 1"), Other),
            ("lines", with("f 1", "l 1 2\nf 1"), Noted("points and lines")),
            (
                "two coordinates",
                with("5 5.5", "5.5"),
                Refused("a.obj:5: v = 0 5.5: is not three finite numbers"),
            ),
            (
                "five numbers",
                with("5.5", "5.5 1 1"),
                Refused("a.obj:5: v = 5: has the wrong number of values; allowed: x y z, x y z w"),
            ),
            (
                "decimal comma",
                with("5.5", "5,5"),
                Refused("a.obj:5: v = 5,5: is not three finite numbers; write the decimal mark as a point"),
            ),
            (
                "a unit",
                with("5.5", "5.5mm"),
                Refused("v = 5.5mm: is not three finite numbers; leave out the unit"),
            ),
            ("a word behind", with("5.5", "5.5 top"), Refused("v = top: is not three finite")),
            (
                "a normal of four",
                with("vn 1", "vn 0 1"),
                Refused("a.obj:7: vn = 4: has the wrong number of values; allowed: x y z"),
            ),
            (
                "corner of four parts",
                with("f 1 ", "f 1/1/1/1 "),
                Refused("a.obj:9: f = 1/1/1/1: is not a corner of a face; allowed: v, v/vt"),
            ),
            (
                "texture of no number",
                with("f 1 ", "f 1/x "),
                Refused("f = x: is not the index of a texture coordinate"),
            ),
            (
                "huge index",
                with("f 1 ", "f 4294967297 "),
                Refused("f = 4294967297: is not the index of a vertex; allowed: 1..=4"),
            ),
            ("upper case", PLAIN.to_uppercase().into(), Refused("a.obj:2: O: is not a line of an OBJ file")),
            ("another file", with("o wall", "call b.obj"), Refused("a.obj:2: call: includes another file")),
            ("page", b"<html>".to_vec(), Refused("is a web page (HTML), not OBJ")),
            ("binary STL", [&[b' '; 80][..], &[1, 0, 0, 0]].concat(), Refused("is not OBJ: it is binary")),
            ("ASCII STL", b"solid x\nendsolid\n".to_vec(), Refused("is ASCII STL; name it .stl")),
            ("STEP", b"ISO-10303-21;\n".to_vec(), Refused("is a STEP file, not OBJ; export it as .stl")),
            ("UTF-16", PLAIN.encode_utf16().flat_map(u16::to_le_bytes).collect(), Refused("is UTF-16 text")),
        ];
        let plain = contents(PLAIN.as_bytes()).unwrap();
        for (name, bytes, becomes) in cases {
            match (becomes, contents(&bytes)) {
                (Same, Ok(c)) => {
                    assert!(shape(&c) == shape(&plain) && c.notes.is_empty(), "{name}: {:?}", c.notes)
                }
                (Noted(part), Ok(c)) => {
                    assert!(shape(&c) == shape(&plain) && c.notes[0].contains(part), "{name}: {:?}", c.notes);
                }
                (Other, Ok(c)) => assert!(shape(&c) != shape(&plain) && c.notes.is_empty(), "{name}"),
                (Refused(part), Err(e)) => assert!(e.contains(part), "{name}: {e}"),
                (_, got) => panic!("{name}: {:?}", got.map(|c| c.notes)),
            }
        }
        // Materials whose names are not UTF-8 stay two.
        let names =
            [&PLAIN.as_bytes()[..PLAIN.len() - 10], b"usemtl gr\xfcn\nf 1 2 3\nusemtl gr\xf6n\nf 1 3 4\n"]
                .concat();
        assert_eq!(contents(&names).unwrap().materials, ["steel", "grün", "grön"]);
    }
}
