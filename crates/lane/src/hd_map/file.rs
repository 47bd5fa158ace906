//! Maps as files: TOML or JSON of one structure, places as `[latitude_deg, longitude_deg, height_m]` in
//! WGS-84.
//!
//! ```toml
//! [[carriageways]]                     # one direction of a road, or a ramp
//! name = "up"
//! inner_edge = [[39.9, 116.3, 40.0], [39.901, 116.3, 40.0]]      # between median and first lane, in order along the road
//! outer_edge = [[39.9, 116.30017, 40.0], [39.901, 116.30017, 40.0]]
//! lanes = [                            # from the inside out; numbers differ within the map
//!     { number = 0, kind = "median", width_m = 1.0 },            # a strip inside the inner edge
//!     { number = 1, width_m = 3.75 },                            # kind = "driving" when left out
//!     { number = 2, kind = "emergency", width_m = 3.0 },
//!     { number = 3, kind = "bay", width_m = [[40, 0], [55, 3.5], [95, 3.5], [110, 0]] },  # [m along the inner edge, m]
//!     { number = 4, kind = "shoulder", width_m = 0.75 },         # a strip outside the outer edge
//! ]
//! ```

use super::HdMap;
use catseye::base::error::{BadInput, Error, Result, json_in_words};
use catseye::scene::toml_file::{Document, read_text};
use std::path::Path;

/// Reads and checks a map: JSON if the name ends in `.json`, otherwise TOML.
///
/// # Errors
/// Returns an error if the file cannot be read, if a key or value does not belong to a map (with its line),
/// or for the first fault of the map.
pub fn read(path: &Path) -> Result<HdMap> {
    let text = read_text(path)?;
    let json = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
    let map: HdMap = match json {
        true => serde_json::from_str(&text).map_err(|e| {
            BadInput::new(format!("is not a map of lanes: {}", json_in_words(&e)))
                .file(path)
                .line(e.line())
                .remedy("see the example in the documentation of lane::hd_map::file")
        })?,
        false => Document::parse(path, &text)?.read_unbounded()?,
    };
    map.check().map_err(|fault| BadInput::new(fault.to_string()).file(path))?;
    Ok(map)
}

/// Returns the map as JSON text.
///
/// # Errors
/// Returns an error if the map cannot be serialized. The map is not checked here.
pub fn to_json(map: &HdMap) -> Result<String> {
    serde_json::to_string_pretty(map).map_err(|e| Error::Failed(format!("map: {e}")))
}
