//! What a mesh file holds, whatever its format.

use crate::base::error::{BadInput, Result};
use crate::formats::text::number_hint;
use crate::scene::Mesh;
use crate::scene::gltf::{self, ImportOptions};
use std::path::Path;

/// What a file says: parts with their names, and the names of materials, which the parts' triangles count from 0. `Mesh::material` is
/// [`NO_MATERIAL`] for a triangle without one. Positions are in the file's unit and axes.
#[derive(Default)]
pub(super) struct Contents {
    pub(super) parts: Vec<(String, Mesh)>,
    pub(super) materials: Vec<String>,
    pub(super) notes: Vec<String>,
    /// What the file says about itself in its header or comments, which no format prescribes.
    pub(super) header: String,
}

impl Contents {
    /// A note where unit and up axis that the header names are not those with which the file is read.
    pub(super) fn contradiction(&self, options: &ImportOptions) -> Option<String> {
        let words: Vec<String> = self
            .header
            .split(|c: char| !c.is_ascii_alphanumeric())
            .filter(|w| !w.is_empty())
            .map(str::to_ascii_lowercase)
            .collect();
        let unit = words.windows(2).find(|w| matches!(&*w[0], "unit" | "units")).and_then(|w| {
            let short = match &*w[1] {
                "millimeter" | "millimeters" | "millimetre" | "millimetres" => "mm",
                "centimeter" | "centimeters" | "centimetre" | "centimetres" => "cm",
                "meter" | "meters" | "metre" | "metres" => "m",
                "inch" | "inches" => "in",
                "foot" | "feet" => "ft",
                other => other,
            };
            Some((short, gltf::unit_m(short).ok()?))
        });
        let up = words.windows(2).find(|w| w[1] == "up").and_then(|w| gltf::up(&w[0]).ok());
        let unit = unit.filter(|u| u.1 != options.unit_m).map(|u| format!("in {}", u.0));
        let up = up.filter(|u| *u != options.up).map(|u| match u {
            gltf::Up::Y => "with y up".to_string(),
            gltf::Up::Z => "with z up".to_string(),
        });
        let said: Vec<String> = unit.into_iter().chain(up).collect();
        (!said.is_empty()).then(|| {
            format!("the file states that it is {}, but is read as the options state", said.join(" "))
        })
    }
}

pub(super) const NO_MATERIAL: u32 = u32::MAX;

/// The extension in small letters, "" without one.
pub fn extension(path: &Path) -> String {
    path.extension().map_or_else(String::new, |e| e.to_string_lossy().to_ascii_lowercase())
}

/// The name of a part that has none.
pub(super) fn stem(file: &Path) -> String {
    file.file_stem().map_or_else(String::new, |n| n.to_string_lossy().into_owned())
}

/// A finite number.
pub(super) fn finite(word: &str) -> Option<f64> {
    word.parse().ok().filter(|x: &f64| x.is_finite())
}

/// A word that an error may repeat: a keyword, and not what a file of another kind holds, given by mistake or by somebody else.
pub(super) fn keyword(word: &str) -> Option<&str> {
    Some(word).filter(|w| w.len() <= 16 && w.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_'))
}

/// What to do about words that are not finite numbers.
pub(super) fn hint(words: &[&str]) -> &'static str {
    words.iter().find_map(|w| number_hint(w)).unwrap_or("clean the mesh and export it again")
}

/// Returns an error for more triangles or vertices than are read.
pub(super) fn check_counts(file: &Path, triangles: usize, vertices: usize) -> Result<()> {
    for (count, most, what) in
        [(triangles, gltf::MAX_TRIANGLES, "triangles"), (vertices, gltf::MAX_VERTICES, "vertices")]
    {
        if count > most {
            return Err(BadInput::new(format!("too many {what}"))
                .file(file)
                .allowed(format!("up to {most} in all"))
                .remedy("split the file")
                .into());
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_header_that_names_other_units_is_noted() {
        let millimetres = ImportOptions { unit_m: 1e-3, up: gltf::Up::Z, ..ImportOptions::default() };
        for (header, part) in [
            ("catseye: unit mm, x forward, y left, z up", None),
            ("catseye: unit in, x forward, y left, z up", Some("in in, ")),
            ("UNITS=meters", Some("in m, ")),
            ("Y-up, units: mm", Some("with y up, ")),
            ("unit of a CAD program, made up", None),
            ("", None),
        ] {
            let contents = Contents { header: header.into(), ..Contents::default() };
            let note = contents.contradiction(&millimetres);
            assert_eq!(note.is_some(), part.is_some(), "{header}: {note:?}");
            assert!(note.is_none_or(|n| part.is_some_and(|p| n.contains(p))), "{header}");
        }
    }
}
