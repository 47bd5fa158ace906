//! STL, binary and ASCII. A file is binary if its length is that of the triangles that it counts, or if it is no text; ASCII is read by
//! words, whatever the lines.

use super::contents::{Contents, NO_MATERIAL, check_counts, finite, hint, keyword, stem};
use crate::base::error::{BadInput, Result};
use crate::formats::text::{of_other_kind, with_names};
use crate::scene::Mesh;
use crate::scene::toml_file::clip;
use glam::{DVec3, Vec3};
use std::collections::HashMap;
use std::path::Path;

const HEADER: usize = 84;
const FACET: usize = 50;

/// Zero bytes behind the triangles that are taken for padding to a block.
const MAX_PADDING: usize = 4096;

const AGAIN: &str = "export the file again";

/// One part for each solid. Facets share the vertices that are equal; their normals follow from their corners.
///
/// # Errors
/// Returns an error for a file that is not STL, is cut off or is longer than it says, or for vertices that are not
/// finite.
pub(super) fn read(bytes: &[u8], file: &Path) -> Result<Contents> {
    let bad = |problem: String| BadInput::new(problem).file(file);
    let count = bytes.get(80..HEADER).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
    // Binary files may begin with "solid" as well: the length decides.
    let length = |count: u32| HEADER as u64 + u64::from(count) * FACET as u64;
    let is_whole = count.is_some_and(|n| length(n) == bytes.len() as u64);
    let text = start_of_text(bytes);
    if !is_whole && text.is_some_and(|t| t.get(..5).is_some_and(|w| w.eq_ignore_ascii_case(b"solid"))) {
        return ascii(&with_names(bytes), file);
    }
    if !is_whole && let Some(other) = of_other_kind(bytes, file, "STL") {
        return Err(other.into());
    }
    let Some(count) = count.filter(|_| text.is_none() || is_whole) else {
        let why = match text {
            Some(_) => "is not STL: it is text that does not begin with 'solid'".to_string(),
            None => format!(
                "is not STL: a binary STL has at least {HEADER} bytes, and the file has {}",
                bytes.len()
            ),
        };
        return Err(bad(why).remedy(AGAIN).into());
    };
    let (facets, rest) = match usize::try_from(length(count)).ok().and_then(|n| bytes.split_at_checked(n)) {
        Some((whole, rest)) => (&whole[HEADER..], rest),
        None => return Err(bad(cut_off(count, length(count), bytes.len())).remedy(AGAIN).into()),
    };
    if rest.len() > MAX_PADDING || rest.iter().any(|b| *b != 0 && !b.is_ascii_whitespace()) {
        return Err(bad(left_over(count, rest)).remedy(AGAIN).into());
    }
    let mut contents = binary(facets, file)?;
    contents.header = String::from_utf8_lossy(&bytes[..80]).into_owned();
    if !rest.is_empty() {
        let note = format!("{} empty bytes behind the {count} triangles are left out", rest.len());
        contents.notes.push(note);
    }
    Ok(contents)
}

/// The file from its first word on, where it begins as text does. Some editors and systems end or pad texts with Ctrl-Z or NUL.
fn start_of_text(bytes: &[u8]) -> Option<&[u8]> {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let padding = text.iter().rev().take_while(|b| matches!(b, 0 | 0x1a)).count();
    let text = &text[..text.len() - padding];
    let is_text = text.iter().take(1024).all(|b| *b >= 0x20 || b.is_ascii_whitespace());
    (is_text && !text.is_empty()).then(|| text.trim_ascii_start())
}

/// The problem of a file with fewer bytes than its count asks for.
fn cut_off(count: u32, needed: u64, has: usize) -> String {
    let there = (has - HEADER) / FACET;
    let says = match count {
        u32::MAX => format!("its count, {count}, was never filled in"),
        n => format!("{n} triangles are {needed} bytes"),
    };
    format!("is not a complete STL: {says}, and the file has {has}, those of {there} triangles")
}

/// The problem of a file with more bytes than its count asks for.
fn left_over(count: u32, rest: &[u8]) -> String {
    let counted = |b: &[u8]| b.get(80..HEADER)?.try_into().ok().map(u32::from_le_bytes);
    let second =
        counted(rest).is_some_and(|n| n > 0 && (rest.len() - HEADER) as u64 == u64::from(n) * FACET as u64);
    let why = match (rest.len() / FACET, rest.len() % FACET) {
        _ if second => "as long as a second STL".to_string(),
        _ if rest.iter().all(|b| *b == 0) => "all zero, more than padding".to_string(),
        (more, 0) if count == 0 => format!("those of {more} triangles: the count was never filled in"),
        (more, 0) => format!("those of {more} more triangles"),
        _ => "no whole triangles".to_string(),
    };
    format!("its count is {count} triangles, and {} bytes follow them, {why}", rest.len())
}

/// Vertices that are equal, put together.
#[derive(Default)]
struct Weld {
    mesh: Mesh,
    index: HashMap<[u64; 3], u32>,
    /// Number of facets whose normal is against the order of their corners.
    against: usize,
}

impl Weld {
    fn facet(&mut self, normal: Option<DVec3>, corners: [DVec3; 3]) {
        let [a, b, c] = corners;
        let turn = (b - a).cross(c - a);
        // Slivers may have any normal, and writers give zero where they know none.
        self.against += usize::from(normal.is_some_and(|n| n.dot(turn) < -0.5 * n.length() * turn.length()));
        let triangle = corners.map(|p| {
            // -0 is 0.
            let key = (p + DVec3::ZERO).to_array().map(f64::to_bits);
            *self.index.entry(key).or_insert_with(|| {
                self.mesh.positions_m.push(p);
                (self.mesh.positions_m.len() - 1) as u32
            })
        });
        self.mesh.triangles.push(triangle);
        self.mesh.material.push(NO_MATERIAL);
    }
}

/// The note about normals against the order of the corners.
fn against(count: usize, of: usize) -> Option<String> {
    let note = || {
        format!(
            "{count} of {of} facets have a normal against the order of their corners: the order determines the outer side"
        )
    };
    (count > 0).then(note)
}

fn binary(facets: &[u8], file: &Path) -> Result<Contents> {
    check_counts(file, facets.len() / FACET, 0)?;
    let mut weld = Weld::default();
    for (i, facet) in facets.chunks_exact(FACET).enumerate() {
        let number = |k: usize| {
            let at = 4 * k;
            f32::from_le_bytes([facet[at], facet[at + 1], facet[at + 2], facet[at + 3]])
        };
        let [normal, a, b, c] =
            [0, 3, 6, 9].map(|k| Vec3::new(number(k), number(k + 1), number(k + 2)).as_dvec3());
        let corners = [a, b, c];
        if !corners.iter().all(|c| c.is_finite()) {
            return Err(BadInput::new(format!("facet {i} has a vertex that is not finite"))
                .file(file)
                .remedy("clean the mesh and export it again")
                .into());
        }
        weld.facet(Some(normal), corners);
        check_counts(file, 0, weld.mesh.positions_m.len())?;
    }
    let notes = against(weld.against, weld.mesh.triangles.len()).into_iter().collect();
    Ok(Contents { parts: vec![(stem(file), weld.mesh)], notes, ..Default::default() })
}

/// The words of a text with the lines in which they stand.
struct Words<'a> {
    text: &'a str,
    at: usize,
    /// Line of the last word, from 1.
    line: usize,
}

impl<'a> Words<'a> {
    /// A word in lower case; "" at the end.
    fn keyword(&mut self) -> String {
        self.next().unwrap_or("").to_ascii_lowercase()
    }

    /// The name behind `solid` or `endsolid`: the rest of the line, or what is before the first facet where a whole solid is on one line.
    /// With `after`, that solid is another one, which the name leaves to be read.
    fn name(&mut self, after: bool) -> &'a str {
        let rest = &self.text[self.at..];
        let line = &rest[..rest.find('\n').unwrap_or(rest.len())];
        let mut words = Words { text: line, at: 0, line: 0 };
        let (mut two, mut one) = ((0, ""), (0, ""));
        let (mut end, mut solid) = (line.len(), None);
        while let Some(word) = words.next() {
            let is = |a: &str, b: &str| a.eq_ignore_ascii_case(b);
            let normal = is(one.1, "normal") && word.parse::<f64>().is_ok();
            if is(two.1, "facet") && (normal || is(one.1, "outer") && is(word, "loop")) {
                end = two.0;
                break;
            }
            if is(word, "solid") {
                solid = Some(words.at - word.len());
            }
            (two, one) = (one, (words.at - word.len(), word));
        }
        if after && end < line.len() {
            end = solid.filter(|s| *s < end).unwrap_or(end);
        }
        self.at += end;
        line[..end].trim()
    }
}

impl<'a> Iterator for Words<'a> {
    type Item = &'a str;

    fn next(&mut self) -> Option<&'a str> {
        let rest = &self.text.as_bytes()[self.at..];
        let begin = rest.iter().position(|b| !is_space(*b))?;
        self.line += rest[..begin].iter().filter(|b| **b == b'\n').count();
        let length = rest[begin..].iter().position(|b| is_space(*b)).unwrap_or(rest.len() - begin);
        let from = self.at + begin;
        self.at = from + length;
        Some(&self.text[from..self.at])
    }
}

fn is_space(b: u8) -> bool {
    b.is_ascii_whitespace() || b == 0x0b
}

fn ascii(text: &str, file: &Path) -> Result<Contents> {
    let text = text.trim_end_matches(['\0', '\u{1a}']);
    let mut words = Words { text, at: 0, line: 1 };
    let mut contents = Contents::default();
    let mut solid: Option<(String, Weld)> = None;
    let (mut triangles, mut vertices, mut contrary) = (0, 0, 0);
    while let Some(word) = words.next() {
        match (word.to_ascii_lowercase().as_str(), &mut solid) {
            ("solid", None) => {
                let name = words.name(false);
                solid = Some((if name.is_empty() { stem(file) } else { clip(name) }, Weld::default()));
            }
            ("facet", Some((_, weld))) => {
                let (normal, corners) = facet(&mut words, file)?;
                weld.facet(normal, corners);
                check_counts(
                    file,
                    triangles + weld.mesh.triangles.len(),
                    vertices + weld.mesh.positions_m.len(),
                )?;
            }
            ("endsolid", Some(_)) => {
                words.name(true);
                let (name, weld) = solid.take().unwrap_or_default();
                triangles += weld.mesh.triangles.len();
                vertices += weld.mesh.positions_m.len();
                contrary += weld.against;
                contents.parts.push((name, weld.mesh));
            }
            (_, open) => {
                let allowed = if open.is_some() { "facet, endsolid" } else { "solid" };
                return Err(misplaced(word, words.line, allowed, file).into());
            }
        }
    }
    if let Some((name, weld)) = solid {
        let count = weld.mesh.triangles.len();
        return Err(BadInput::new(format!(
            "is cut off: there is no endsolid behind the {count} facets of '{name}'"
        ))
        .file(file)
        .line(words.line)
        .remedy(AGAIN)
        .into());
    }
    contents.notes.extend(against(contrary, triangles));
    Ok(contents)
}

/// The error about a word that does not belong where it is.
fn misplaced(word: &str, line: usize, allowed: &str, file: &Path) -> BadInput {
    let bad = match word {
        "" => BadInput::new("is cut off within a facet"),
        word => {
            let value = keyword(word).map(Into::into);
            BadInput { value, ..BadInput::new("is not a keyword of ASCII STL at this point") }
        }
    };
    bad.file(file).line(line).allowed(allowed).remedy(AGAIN)
}

/// Normal, where there is one, and corners of a facet whose first word has been read.
fn facet(words: &mut Words<'_>, file: &Path) -> Result<(Option<DVec3>, [DVec3; 3])> {
    let bad = |line: usize, problem: &str| BadInput::new(problem).file(file).line(line);
    let mut normal = None;
    let mut corners: Vec<DVec3> = Vec::with_capacity(3);
    let mut seen = false;
    loop {
        let word = words.keyword();
        let line = words.line;
        match word.as_str() {
            // Where there is no area, writers give what their division gives: nan, -nan(ind).
            "normal" if !seen => {
                let given: [&str; 3] = std::array::from_fn(|_| words.next().unwrap_or(""));
                if let Some(w) = given.iter().find(|w| !w.contains("nan") && w.parse::<f64>().is_err()) {
                    let bad = bad(line, "a normal is not three numbers").value(clip(w));
                    return Err(bad.remedy(hint(&given)).into());
                }
                let [x, y, z] = given.map(finite);
                normal = x.zip(y).zip(z).map(|((x, y), z)| DVec3::new(x, y, z));
            }
            "outer" => match words.keyword().as_str() {
                "loop" => {}
                other => return Err(misplaced(other, words.line, "outer loop", file).into()),
            },
            "vertex" => {
                let given: [&str; 3] = std::array::from_fn(|_| words.next().unwrap_or(""));
                let [Some(x), Some(y), Some(z)] = given.map(finite) else {
                    let wrong = given.iter().find(|w| finite(w).is_none()).copied().unwrap_or("");
                    let bad = bad(line, "a vertex is not three finite numbers").value(clip(wrong));
                    return Err(bad.remedy(hint(&given)).into());
                };
                if corners.len() == 3 {
                    return Err(bad(line, "a facet has more than three vertices").remedy(AGAIN).into());
                }
                corners.push(DVec3::new(x, y, z));
            }
            "endloop" => {}
            "endfacet" => {
                let three = <[DVec3; 3]>::try_from(corners);
                let few = || bad(line, "a facet has fewer than three vertices").remedy(AGAIN);
                return Ok((normal, three.map_err(|_| few())?));
            }
            other => {
                return Err(misplaced(other, line, "outer loop, vertex, endloop, endfacet", file).into());
            }
        }
        seen = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "part.stl";

    fn triangles(contents: &Contents) -> Vec<[DVec3; 3]> {
        let of = |m: &Mesh| -> Vec<[DVec3; 3]> {
            m.triangles.iter().map(|t| t.map(|v| m.positions_m[v as usize])).collect()
        };
        contents.parts.iter().flat_map(|(_, m)| of(m)).collect()
    }

    fn read_text(text: &[u8]) -> Result<Contents, String> {
        read(text, Path::new(FILE)).map_err(|e| {
            assert_eq!((e.exit_code(), e.to_string().lines().count()), (2, 1));
            assert!(e.to_string().chars().count() <= crate::base::error::MAX_CHARS);
            e.to_string()
        })
    }

    const SQUARE: &str = "solid lid\n facet normal 1 0 0\n  outer loop\n   vertex 0 0 0\n   vertex 0 5 0\n   vertex 0 5 5.5\n\
                          endloop\n endfacet\nendsolid lid\nsolid box\nfacet normal 1 0 0\nouter loop\nvertex 0 0 0\nvertex 0 5 5.5\n\
                          vertex 0 0 5\nendloop\nendfacet\nendsolid box\n";

    /// What a change of the text makes of it.
    enum Becomes {
        Same,
        /// As before, with these names of the solids.
        Named([&'static str; 2]),
        /// Another shape, with a note where the text is not "".
        Other(&'static str),
        /// As before, with a note.
        Noted(&'static str),
        Refused(&'static str),
    }
    use Becomes::*;

    #[test]
    fn ascii_is_read_by_words() {
        let with = |from: &str, to: &str| SQUARE.replace(from, to).into_bytes();
        let cases: Vec<(&str, Vec<u8>, Becomes)> = vec![
            ("CRLF", with("\n", "\r\n"), Same),
            ("CR alone", with("\n", "\r"), Same),
            ("tabs", with(" ", "\t"), Same),
            ("upper case", SQUARE.to_uppercase().into(), Named(["LID", "BOX"])),
            ("one line", with("\n", " "), Same),
            (
                "a word a line",
                with(" ", "\n").to_vec(),
                Refused("part.stl:2: lid: is not a keyword of ASCII STL at this point"),
            ),
            ("facets in words a line", with("vertex ", "vertex\n\n").to_vec(), Same),
            ("mark", format!("\u{feff}{SQUARE}").into(), Same),
            ("no last line end", SQUARE.trim_end().into(), Same),
            ("end of file mark", format!("{SQUARE}\u{1a}\0\0").into(), Same),
            (
                "names of words",
                with(" lid", " facet solid of vertex"),
                Named(["facet solid of vertex", "box"]),
            ),
            ("no names", with(" lid", "").to_vec(), Named(["part", "box"])),
            ("other names at the end", with("endsolid lid", "endsolid"), Same),
            (
                "Latin-1 name",
                [b"solid gr\xfcn".to_vec(), SQUARE.as_bytes()[9..].to_vec()].concat(),
                Named(["grün", "box"]),
            ),
            ("no normals", with("normal 1 0 0", ""), Same),
            ("normals of no number", with("normal 1 0 0", "normal -nan(ind) nan NaN"), Same),
            ("zero normals", with("normal 1 0 0", "normal 0 0 0"), Same),
            ("exponents", with("5.5", "+5.50e+00"), Same),
            ("turned normals", with("normal 1", "normal -1"), Noted("2 of 2 facets have a normal against")),
            (
                "turned corners",
                with("vertex 0 0 0\n   vertex 0 5 0", "vertex 0 5 0\nvertex 0 0 0"),
                Other("1 of 2"),
            ),
            ("scale", with("5", "50"), Other("")),
            ("axes in another order", with("0 5 5.5", "0 5.5 5"), Other("")),
            (
                "decimal comma",
                with("5 5.5", "5 5,5"),
                Refused(
                    "part.stl:6: 5,5: a vertex is not three finite numbers; write the decimal mark as a point",
                ),
            ),
            (
                "comma in a normal",
                with("normal 1", "normal 1,0"),
                Refused("part.stl:2: 1,0: a normal is not three numbers; write"),
            ),
            ("two coordinates", with("0 5 0", "0 5"), Refused("part.stl:5: vertex: a vertex is not three")),
            (
                "four coordinates",
                with("0 5 0", "0 5 0 1"),
                Refused(
                    "part.stl:5: 1: is not a keyword of ASCII STL at this point; allowed: outer loop, vertex",
                ),
            ),
            ("huge", with("5.5", "1e400"), Refused("1e400: a vertex is not three finite")),
            (
                "a polygon",
                with("endloop", "vertex 0 0 1 endloop"),
                Refused("part.stl:7: a facet has more than three"),
            ),
            (
                "no endsolid",
                SQUARE[..SQUARE.len() - 13].into(),
                Refused("part.stl:17: is cut off: there is no endsolid behind the 1 facets of 'box'"),
            ),
            ("cut off in a facet", SQUARE[..60].into(), Refused("is cut off within a facet")),
            (
                "a solid in a solid",
                with("endsolid lid\n", ""),
                Refused(
                    "part.stl:9: solid: is not a keyword of ASCII STL at this point; allowed: facet, endsolid",
                ),
            ),
            (
                "text behind it",
                format!("{SQUARE}bye\n").into(),
                Refused("part.stl:19: bye: is not a keyword"),
            ),
            (
                "web page",
                b"<!DOCTYPE html><html>".to_vec(),
                Refused("is a web page (HTML), not STL; download"),
            ),
            ("gzip", b"\x1f\x8b\x08\0\0".to_vec(), Refused("is compressed (gzip), not STL")),
            ("OBJ", b"v 0 0 0\nv 1 0 0\n".to_vec(), Refused("text that does not begin with 'solid'")),
            ("UTF-16", SQUARE.encode_utf16().flat_map(u16::to_le_bytes).collect(), Refused("is UTF-16 text")),
        ];
        let whole = read_text(SQUARE.as_bytes()).unwrap();
        assert_eq!((whole.parts[0].0.as_str(), whole.notes.len()), ("lid", 0));
        let shape = triangles(&whole);
        for (name, bytes, becomes) in cases {
            let got = read_text(&bytes);
            let names = |c: &Contents| c.parts.iter().map(|p| p.0.clone()).collect::<Vec<_>>();
            match (becomes, got) {
                (Same, Ok(c)) => {
                    assert!(
                        triangles(&c) == shape && names(&c) == ["lid", "box"] && c.notes.is_empty(),
                        "{name}"
                    )
                }
                (Named(want), Ok(c)) => {
                    assert!(triangles(&c) == shape && names(&c) == want, "{name}: {:?}", names(&c));
                }
                (Noted(part), Ok(c)) => {
                    assert!(
                        triangles(&c) == shape && c.notes.iter().any(|n| n.contains(part)),
                        "{name}: {:?}",
                        c.notes
                    );
                }
                (Other(part), Ok(c)) => {
                    assert!(
                        triangles(&c) != shape && c.notes.len() == usize::from(!part.is_empty()),
                        "{name}"
                    );
                    assert!(c.notes.iter().all(|n| n.contains(part)), "{name}: {:?}", c.notes);
                }
                (Refused(part), Err(e)) => assert!(e.contains(part), "{name}: {e}"),
                (_, got) => panic!("{name}: {:?}", got.map(|c| names(&c))),
            }
        }
        // All solids of a file on one line.
        let line = SQUARE.replace('\n', " ");
        assert_eq!(read_text(line.as_bytes()).unwrap().parts.len(), 2);
    }

    fn binary_of(head: &str, count: u32, facets: &[[f32; 12]]) -> Vec<u8> {
        let mut out = head.as_bytes().to_vec();
        out.resize(80, b' ');
        out.extend(count.to_le_bytes());
        for f in facets {
            out.extend(f.iter().flat_map(|x| x.to_le_bytes()));
            out.extend([0, 0]);
        }
        out
    }

    #[test]
    fn the_length_of_a_binary_file_is_checked() {
        let facet = |nx: f32| [nx, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 5.0, 0.0, 0.0, 5.0, 5.0];
        let two = [facet(1.0); 2];
        let whole = binary_of("", 2, &two);
        let and = |more: &[u8]| [&whole[..], more].concat();
        let cases: Vec<(&str, Vec<u8>, Becomes)> = vec![
            ("begins with solid", binary_of("solid of a CAD program", 2, &two), Same),
            ("two zero bytes", and(&[0; 2]), Noted("2 empty bytes behind the 2 triangles")),
            ("a line end", and(b"\r\n"), Noted("2 empty bytes")),
            ("a block of zeros", and(&[0; 512]), Noted("512 empty bytes")),
            (
                "solid and padding",
                [binary_of("solid x", 2, &two), vec![0; 2]].concat(),
                Noted("2 empty bytes"),
            ),
            ("many zeros", and(&[0; 5000]), Refused("5000 bytes follow them, all zero, more than padding")),
            (
                "other bytes",
                and(&[7; 2]),
                Refused("its count is 2 triangles, and 2 bytes follow them, no whole triangles"),
            ),
            (
                "count too small",
                binary_of("", 1, &two),
                Refused("count is 1 triangles, and 50 bytes follow them, those of 1 more"),
            ),
            (
                "count of zero",
                binary_of("", 0, &two),
                Refused(
                    "count is 0 triangles, and 100 bytes follow them, those of 2 triangles: the count was never filled in",
                ),
            ),
            (
                "a second file",
                [&whole[..], &whole].concat(),
                Refused("184 bytes follow them, as long as a second STL"),
            ),
            (
                "count too large",
                binary_of("", 3, &two),
                Refused("3 triangles are 234 bytes, and the file has 184, those of 2 triangles"),
            ),
            (
                "no count",
                binary_of("", u32::MAX, &two),
                Refused("its count, 4294967295, was never filled in, and the file has 184, those of 2"),
            ),
            ("solid, no count", binary_of("solid", u32::MAX, &two), Refused("was never filled in")),
            (
                "cut off",
                whole[..150].to_vec(),
                Refused("2 triangles are 184 bytes, and the file has 150, those of 1"),
            ),
            ("a header", whole[..83].to_vec(), Refused("is not STL")),
            ("not finite", binary_of("", 2, &[two[0], [f32::NAN; 12]]), Refused("facet 1 has a vertex")),
            ("turned normals", binary_of("", 2, &[facet(-1.0); 2]), Noted("2 of 2 facets")),
            ("normals of no number", binary_of("", 2, &[facet(f32::NAN); 2]), Same),
        ];
        let shape = triangles(&read_text(&whole).unwrap());
        for (name, bytes, becomes) in cases {
            match (becomes, read_text(&bytes)) {
                (Same, Ok(c)) => {
                    assert!(triangles(&c) == shape && c.notes.is_empty(), "{name}: {:?}", c.notes)
                }
                (Noted(part), Ok(c)) => {
                    assert!(triangles(&c) == shape && c.notes[0].contains(part), "{name}: {:?}", c.notes);
                }
                (Refused(part), Err(e)) => assert!(e.contains(part), "{name}: {e}"),
                (_, got) => panic!("{name}: {:?}", got.map(|c| triangles(&c).len())),
            }
        }
    }
}
