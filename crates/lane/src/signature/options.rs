//! Options of the method signature without a scenario, in JSON and in Python.

use super::estimator::{METHOD, MapLanes, Signature, SignatureSetup};
use super::map::{MapSettings, Pose, ScanPoint, SignatureMap};
use crate::LaneEstimator;
use crate::limits;
use catseye::base::error::Result;
use serde::{Deserialize, Serialize};

/// Least occupancy of a landmark of the map, 0 to 1.
const LEAST_OCCUPANCY: f64 = 0.3;

/// A scan from which a signature map is made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MappedScan {
    /// Pose of the radar in the map.
    pub pose: Pose,
    /// Standard deviations of the pose: position (m, m) and heading (rad).
    pub std: [f64; 3],
    /// Stationary points of the scan.
    pub points: Vec<ScanPoint>,
}

/// Options of the method signature (Feng 2019). A scenario's table `[lane.signature]` describes the drive that
/// makes the scans; these hold the scans themselves.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SignatureOptions {
    /// Scans of the drive that was mapped.
    pub scans: Vec<MappedScan>,
    /// Settings of the map.
    #[serde(default)]
    pub map: MapSettings,
    /// Least number of scans in which a landmark was seen. Default 3.
    #[serde(default = "least_hits")]
    pub least_hits: u32,
    /// Known lines of the road in the map. Default none.
    #[serde(default)]
    pub lanes: MapLanes,
}

/// Default least number of scans in which a landmark of the map was seen.
pub fn least_hits() -> u32 {
    3
}

impl SignatureOptions {
    /// Checks the options by making the map of the scans.
    ///
    /// # Errors
    /// Returns an error for the first setting or scan outside its range.
    pub fn check(&self) -> Result<()> {
        self.signature_map().map(|_| ())
    }

    /// The map of the scans.
    ///
    /// # Errors
    /// Returns an error for the first setting or scan outside its range.
    pub fn signature_map(&self) -> Result<SignatureMap> {
        let mut map = SignatureMap::new(self.map).map_err(|e| limits::refused(METHOD, e))?;
        for (i, s) in self.scans.iter().enumerate() {
            map.add_scan(s.pose, s.std, None, &s.points)
                .map_err(|e| limits::refused(METHOD, format!("scans[{i}]: {e}")))?;
        }
        map.prune(self.least_hits, LEAST_OCCUPANCY);
        Ok(map)
    }
}

/// Makes the estimator from options as JSON.
///
/// # Errors
/// Returns an error for options that are unknown, missing or outside their ranges.
pub fn from_json(options: &str) -> Result<Box<dyn LaneEstimator + Send>> {
    let options: SignatureOptions = limits::read_json(METHOD, options)?;
    let estimator = Signature::new(options.signature_map()?, options.lanes, SignatureSetup::default());
    Ok(Box::new(estimator.map_err(|e| limits::refused(METHOD, e))?))
}
