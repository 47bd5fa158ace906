//! The keys of a TOML file about a mesh file that it names.

use super::{ask, missing};
use crate::base::error::{Error, Result};
use crate::scene::gltf::{self, ImportOptions};
use crate::scene::material;
use crate::scene::tidy::check_smooth_deg;
use crate::scene::toml_file::{At, Document};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

/// The keys about a mesh file, wherever they stand.
pub struct ImportTable<'a> {
    /// Unit of the file's lengths.
    pub unit: &'a Option<At<String>>,
    /// Which axis of the file points up.
    pub up: &'a Option<At<String>>,
    /// How animations in the file are used.
    pub animation: &'a Option<At<String>>,
    /// Material of what has none.
    pub default_material: &'a Option<At<String>>,
    /// Largest angle between facets of one smooth surface.
    pub smooth_deg: &'a Option<At<f64>>,
    /// Materials by the names in the file.
    pub materials: &'a BTreeMap<String, At<String>>,
}

impl ImportTable<'_> {
    /// Where the first of the keys stands, if there is any.
    pub fn first_span(&self) -> Option<&Range<usize>> {
        let given = [self.unit, self.up, self.animation, self.default_material];
        let smooth = self.smooth_deg.iter().map(|a| &a.span);
        given.into_iter().flatten().chain(self.materials.values()).map(|a| &a.span).chain(smooth).next()
    }

    /// The options that the keys state.
    ///
    /// # Errors
    /// Returns an error with its place in the file if a value is none of those allowed.
    pub fn options(&self, doc: &Document<'_>) -> Result<ImportOptions> {
        let mut o = ImportOptions::default();
        let here_at = |span: &Range<usize>| {
            let at = doc.bad(span, "");
            move |e: Error| match e {
                // The file is the scenario's: its key and value say more than the callee's.
                Error::Input(b) => b.placed(at).into(),
                e => e,
            }
        };
        let here = |at: &At<String>| here_at(&at.span);
        if let Some(u) = self.unit {
            o.unit_m = gltf::unit_m(&u.value).map_err(here(u))?;
            o.unit_given = true;
        }
        if let Some(u) = self.up {
            o.up = gltf::up(&u.value).map_err(here(u))?;
            o.up_given = true;
        }
        if let Some(s) = self.smooth_deg {
            o.smooth_deg = Some(check_smooth_deg(s.value).map_err(here_at(&s.span))?);
        }
        if let Some(a) = self.animation {
            o.animations = gltf::Animations::from_name(&a.value);
        }
        for m in self.materials.values().chain(self.default_material) {
            material::parse_spec(&m.value).map_err(here(m))?;
        }
        o.default_material = self.default_material.as_ref().map(|m| m.value.clone());
        o.material_map = self.materials.iter().map(|(from, to)| (from.clone(), to.value.clone())).collect();
        Ok(o)
    }

    /// The options that the keys beside a file's name give.
    ///
    /// # Errors
    /// Returns the errors of [`ImportTable::options`], and an error if a key that a file of this kind needs is missing.
    pub fn options_of(&self, doc: &Document<'_>, file: &At<String>) -> Result<ImportOptions> {
        let options = self.options(doc)?;
        check_stated(doc, &file.span, &file.value, &options)?;
        Ok(options)
    }
}

/// Checks that what the file does not say is stated.
///
/// # Errors
/// Returns an error if the file of this name, which stands at `span`, states no unit, up axis or material, and neither
/// do the options.
pub fn check_stated(
    doc: &Document<'_>,
    span: &Range<usize>,
    name: &str,
    options: &ImportOptions,
) -> Result<()> {
    match ask(&missing(Path::new(name), options), true) {
        Some((problem, remedy)) => Err(doc.bad(span, problem).remedy(remedy).into()),
        None => Ok(()),
    }
}
