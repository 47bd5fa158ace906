//! Options of the method hd-map without a scenario, in JSON and in Python.

use super::estimator::{MapLanes, Options};
use super::file;
use crate::LaneEstimator;
use crate::limits::{self, LEAVE_OUT, Limit};
use catseye::base::error::Result;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Options of the method hd-map (Li 2022). A scenario's table `[lane.hd_map]` has other defaults for the two
/// standard deviations: the radar of a trial is surveyed, and this one is exact unless it is said otherwise.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HdMapOptions {
    /// Path of a map file (`crates/lane/src/hd_map/file.rs`).
    pub map: PathBuf,
    /// Position of the radar on the vehicle: forward, left, m. Default 0, 0.
    #[serde(default)]
    pub radar_at_m: [f64; 2],
    /// Yaw of the radar on the vehicle, degrees. Default 0.
    #[serde(default)]
    pub radar_yaw_deg: f64,
    /// Standard deviation of the radar's position on the earth on each axis, m. Default 0.
    #[serde(default)]
    pub place_std_m: f64,
    /// Standard deviation of the radar's azimuth on the earth, degrees. Default 0.
    #[serde(default)]
    pub azimuth_std_deg: f64,
}

/// Ranges of the standard deviations of the radar's position (m) and azimuth (degrees) in a scenario's table
/// and in these options.
pub fn pose_limits(place_std_m: f64, azimuth_std_deg: f64) -> [Limit<'static>; 2] {
    [
        ("place_std_m", place_std_m, 0.0, 100.0, LEAVE_OUT),
        ("azimuth_std_deg", azimuth_std_deg, 0.0, 90.0, LEAVE_OUT),
    ]
}

impl HdMapOptions {
    /// Checks the options; the map is checked when it is read.
    ///
    /// # Errors
    /// Returns an error for the first value outside its range.
    pub fn check(&self) -> Result<()> {
        let [x, y] = self.radar_at_m;
        limits::check("hd_map", &pose_limits(self.place_std_m, self.azimuth_std_deg))?;
        limits::check(
            "hd_map",
            &[
                ("radar_at_m[0]", x, -1000.0, 1000.0, "give metres forward"),
                ("radar_at_m[1]", y, -1000.0, 1000.0, "give metres to the left"),
                ("radar_yaw_deg", self.radar_yaw_deg, -3600.0, 3600.0, "give degrees, positive to the left"),
            ],
        )
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
