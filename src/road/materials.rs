//! How builders find radar materials.

use crate::base::error::Result;
use crate::scene::Material;

/// Finds a radar material by its name.
pub type MaterialLookup<'a> = &'a dyn Fn(&str) -> Result<Material>;
