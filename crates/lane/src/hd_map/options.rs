//! Options of the method hd-map without a scenario, in JSON and in Python.

use super::estimator::{MapLanes, Options};
use super::file;
use crate::LaneEstimator;
use crate::limits;
use catseye::base::error::Result;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Options of the method hd-map (Li 2022). A scenario's table `[lane.hd_map]` has other defaults for the two
/// standard deviations: the radar of a trial is surveyed, and this one is exact unless it is said otherwise.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HdMapOptions {
    /// Path of a map file (`crates/lane/src/hd_map/file.rs`).
    pub map: PathBuf,
    /// Position of the radar on the vehicle: forward, left, m. Default 0, 0.
    #[serde(default)]
    #[schemars(inner(range(min = -1000.0, max = 1000.0)))]
    pub radar_at_m: [f64; 2],
    /// Yaw of the radar on the vehicle, degrees. Default 0.
    #[serde(default)]
    #[schemars(range(min = -3600.0, max = 3600.0))]
    pub radar_yaw_deg: f64,
    /// Standard deviation of the radar's position on the earth on each axis, m. Default 0.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 100.0))]
    pub place_std_m: f64,
    /// Standard deviation of the radar's azimuth on the earth, degrees. Default 0.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 90.0))]
    pub azimuth_std_deg: f64,
}

impl HdMapOptions {
    /// Checks the options; the map is checked when it is read.
    ///
    /// # Errors
    /// Returns an error for the first value outside its range.
    pub fn check(&self) -> Result<()> {
        limits::check_bounds("hd_map", self)
    }

    /// What the estimator works with besides the map.
    pub fn setup(&self) -> Options {
        Options {
            radar_at_m: self.radar_at_m,
            radar_yaw_rad: self.radar_yaw_deg.to_radians(),
            place_std_m: self.place_std_m,
            azimuth_std_rad: self.azimuth_std_deg.to_radians(),
            ..Options::default()
        }
    }
}

/// Makes the estimator from options as JSON.
///
/// # Errors
/// Returns an error for options that are unknown, missing or outside their ranges, and for a map that cannot
/// be read or has a fault.
pub fn from_json(options: &str) -> Result<Box<dyn LaneEstimator + Send>> {
    let options: HdMapOptions = limits::read_json(MapLanes::METHOD, options)?;
    options.check()?;
    let estimator = MapLanes::new(file::read(&options.map)?, options.setup());
    Ok(Box::new(estimator.map_err(|e| limits::refused(MapLanes::METHOD, e))?))
}
