//! STL, binary and ASCII.

use super::contents::{Contents, NO_MATERIAL, check_counts, stem, vector};
use crate::base::error::{BadInput, Result};
use crate::scene::Mesh;
use crate::scene::toml_file::clip;
use glam::{DVec3, Vec3};
use std::collections::HashMap;
use std::path::Path;

const HEADER: usize = 84;
const FACET: usize = 50;

/// One part for each solid. Facets share the vertices that are equal; their normals follow from their corners.
///
/// # Errors
/// Returns an error for a file that is not STL, is cut off or is longer than it says, or for vertices that are not
/// finite.
pub(super) fn read(bytes: &[u8], file: &Path) -> Result<Contents> {
    let bad = |problem: String| BadInput::new(problem).file(file);
    let declared =
        bytes.get(80..HEADER).and_then(|b| b.try_into().ok()).map(|b| u64::from(u32::from_le_bytes(b)));
    let needed = declared.map(|n| HEADER as u64 + n * FACET as u64);
    // Binary files may begin with "solid" as well: the length tells.
    if needed == Some(bytes.len() as u64) {
        return binary(&bytes[HEADER..], file);
    }
    let word = |b: &[u8]| b.eq_ignore_ascii_case(b"solid");
    let is_text = bytes.iter().take(1024).all(|b| *b >= 0x20 || b.is_ascii_whitespace());
    let start = bytes.trim_ascii_start();
    if is_text && start.get(..5).is_some_and(word) {
        return ascii(&String::from_utf8_lossy(bytes), file);
    }
    Err(match (declared, needed) {
        (Some(n), Some(needed)) if !is_text => bad(format!(
            "is no whole STL: {n} triangles are {needed} bytes, and the file has {}",
            bytes.len()
        )),
        _ => bad("is no STL: it is neither binary nor begins with 'solid'".into()),
    }
    .remedy("export the file again")
    .into())
}

/// Vertices that are equal, put together.
#[derive(Default)]
struct Weld {
    mesh: Mesh,
    index: HashMap<[u64; 3], u32>,
}

impl Weld {
    fn facet(&mut self, corners: [DVec3; 3]) {
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

fn binary(facets: &[u8], file: &Path) -> Result<Contents> {
    check_counts(file, facets.len() / FACET, 0)?;
    let mut weld = Weld::default();
    for (i, facet) in facets.chunks_exact(FACET).enumerate() {
        let number = |k: usize| {
            let at = 12 + 4 * k;
            f32::from_le_bytes([facet[at], facet[at + 1], facet[at + 2], facet[at + 3]])
        };
        let corners = [0, 3, 6].map(|k| Vec3::new(number(k), number(k + 1), number(k + 2)).as_dvec3());
        if !corners.iter().all(|c| c.is_finite()) {
            return Err(BadInput::new(format!("facet {i} has a vertex that is not finite"))
                .file(file)
                .remedy("clean the mesh and export it again")
                .into());
        }
        weld.facet(corners);
        check_counts(file, 0, weld.mesh.positions_m.len())?;
    }
    Ok(Contents { parts: vec![(stem(file), weld.mesh)], ..Default::default() })
}

fn ascii(text: &str, file: &Path) -> Result<Contents> {
    let mut parts: Vec<(String, Mesh)> = Vec::new();
    let mut solid: Option<(String, Weld)> = None;
    let mut corners: Vec<DVec3> = Vec::new();
    let (mut triangles, mut vertices) = (0, 0);
    for (i, line) in text.lines().enumerate() {
        let bad = |problem: &str| BadInput::new(problem).file(file).line(i + 1);
        let mut words = line.split_whitespace();
        let Some(word) = words.next() else { continue };
        let word = word.to_ascii_lowercase();
        match (word.as_str(), &mut solid) {
            ("solid", None) => {
                let name = words.collect::<Vec<_>>().join(" ");
                solid = Some((if name.is_empty() { stem(file) } else { clip(&name) }, Weld::default()));
            }
            ("facet", Some(_)) => corners.clear(),
            ("outer" | "endloop", Some(_)) => {}
            ("vertex", Some(_)) => match vector(words) {
                Some(p) if corners.len() < 3 => corners.push(p),
                Some(_) => return Err(bad("a facet has more than three vertices").into()),
                None => {
                    return Err(bad("a vertex is not three finite numbers")
                        .remedy("clean the mesh and export it again")
                        .into());
                }
            },
            ("endfacet", Some((_, weld))) => {
                let three = <[DVec3; 3]>::try_from(std::mem::take(&mut corners));
                weld.facet(three.map_err(|_| bad("a facet has fewer than three vertices"))?);
                check_counts(
                    file,
                    triangles + weld.mesh.triangles.len(),
                    vertices + weld.mesh.positions_m.len(),
                )?;
            }
            ("endsolid", Some(_)) => {
                let (name, weld) = solid.take().unwrap_or_default();
                triangles += weld.mesh.triangles.len();
                vertices += weld.mesh.positions_m.len();
                parts.push((name, weld.mesh));
            }
            _ => {
                let expected = if solid.is_some() {
                    "facet, outer loop, vertex, endloop, endfacet, endsolid"
                } else {
                    "solid"
                };
                return Err(bad("is no line of an ASCII STL here")
                    .allowed(expected)
                    .remedy("export the file again")
                    .into());
            }
        }
    }
    if solid.is_some() {
        return Err(BadInput::new("is cut off: there is no endsolid at its end")
            .file(file)
            .remedy("export the file again")
            .into());
    }
    Ok(Contents { parts, ..Default::default() })
}
