//! Options of the method segmentation: the table `[lane.segmentation]` of a scenario, and the same keys in JSON.

use super::METHOD;
use crate::limits::{self, LEAVE_OUT, Limit};
use catseye::base::error::{BadInput, Result};
use glam::DVec2;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The network that is taken when no other is named.
const WEIGHTS: &str = "road";

/// Settings of the method segmentation.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SegmentationOptions {
    /// The trained network: a folder written by `catseye learn train`, relative to the scenario file, or the
    /// name of a built-in network.
    pub weights: String,
    /// Number of radar scans that are accumulated, motion-compensated by the speed and the yaw rate on the vehicle bus.
    #[schemars(range(min = 1, max = 100))]
    pub scans: u32,
    /// Minimum lane probability at which a cell counts as lane.
    #[schemars(range(min = 0.05, max = 0.95))]
    pub probability: f64,
    /// Minimum visible length of an edge, m.
    #[schemars(range(min = 2.0, max = 100.0))]
    pub least_length_m: f64,
    /// Minimum and maximum distance from the vehicle at which edges are scored, m.
    #[schemars(inner(range(min = 0.0, max = 1000.0)))]
    pub reach_m: [f64; 2],
    /// Standard deviation of the speed on the vehicle bus, m/s.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub bus_speed_std_mps: f64,
    /// Standard deviation of the yaw rate on the vehicle bus, degrees/s.
    #[schemars(range(min = 0.0, max = 90.0))]
    pub bus_yaw_rate_std_deg_per_s: f64,
    /// Frame of the first run that the plot shows. Default: the middle one.
    pub picture_frame: Option<u32>,
    // Only for points without a scenario: there the radar's own mounting gives these.
    /// Position of the radar ahead and to the left of the vehicle's reference point, m. A scenario gives it by the
    /// radar's mounting and refuses this key.
    #[schemars(skip)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radar_at_m: Option<[f64; 2]>,
    /// Direction of the radar's boresight to the left of the vehicle's, degrees. A scenario has it in the radar's
    /// mounting and refuses it here.
    #[schemars(skip)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radar_yaw_deg: Option<f64>,
}

impl Default for SegmentationOptions {
    fn default() -> Self {
        SegmentationOptions {
            weights: WEIGHTS.into(),
            scans: 1,
            probability: 0.5,
            least_length_m: 8.0,
            reach_m: [5.0, 40.0],
            bus_speed_std_mps: 0.1,
            bus_yaw_rate_std_deg_per_s: 0.2,
            picture_frame: None,
            radar_at_m: None,
            radar_yaw_deg: None,
        }
    }
}

/// Where a radar sits on its vehicle, seen from above.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RadarMount {
    /// Place in the vehicle's level frame, m.
    pub at_m: DVec2,
    /// Direction of the boresight, rad, positive to the left.
    pub yaw_rad: f64,
}

impl RadarMount {
    /// A place of the radar's level axes in those of the vehicle, m.
    pub fn to_vehicle(&self, p: DVec2) -> DVec2 {
        self.at_m + DVec2::from_angle(self.yaw_rad).rotate(p)
    }

    /// A place of the vehicle's level axes in those of the radar, m.
    pub fn from_vehicle(&self, p: DVec2) -> DVec2 {
        DVec2::from_angle(-self.yaw_rad).rotate(p - self.at_m)
    }
}

impl SegmentationOptions {
    /// Checks the options.
    ///
    /// # Errors
    /// Returns an error for the first value outside its range.
    pub fn check(&self) -> Result<()> {
        let ([near, far], reach) = (self.reach_m, "give [nearest, farthest] in metres, as in [5, 40]");
        let [ahead, left] = self.radar_at_m.unwrap_or_default();
        let place = "give [ahead, left] in metres, as in [3.6, 0]";
        limits::check_bounds(METHOD, self)?;
        let all: [Limit<'_>; 4] = [
            ("reach_m", far, near + 1.0, 1000.0, reach),
            ("radar_at_m", ahead, -100.0, 100.0, place),
            ("radar_at_m", left, -100.0, 100.0, place),
            ("radar_yaw_deg", self.radar_yaw_deg.unwrap_or(0.0), -180.0, 180.0, "give degrees, as in 0"),
        ];
        limits::check(METHOD, &all)?;
        if self.weights.is_empty() {
            let bad = BadInput::new("the name of the network is empty")
                .key("lane.segmentation.weights")
                .value("\"\"");
            return Err(bad.allowed("a folder or the name of a network").remedy(LEAVE_OUT).into());
        }
        Ok(())
    }

    /// Checks the options of a scenario's table.
    ///
    /// # Errors
    /// Returns the errors of [`SegmentationOptions::check`], and one for a place of the radar, which a scenario has in its
    /// mounting.
    pub fn check_in_scenario(&self) -> Result<()> {
        let given =
            [("radar_at_m", self.radar_at_m.is_some()), ("radar_yaw_deg", self.radar_yaw_deg.is_some())];
        if let Some((key, _)) = given.into_iter().find(|g| g.1) {
            let bad = BadInput::new("applies only to points without a scenario");
            let bad = bad.key(format!("lane.segmentation.{key}"));
            return Err(bad.remedy("remove it and set the radar's mounting").into());
        }
        self.check()
    }

    /// Where the radar sits by these options; at the vehicle's reference point and looking ahead unless they say otherwise.
    pub fn mount(&self) -> RadarMount {
        RadarMount {
            at_m: DVec2::from_array(self.radar_at_m.unwrap_or_default()),
            yaw_rad: self.radar_yaw_deg.unwrap_or(0.0).to_radians(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_out_of_range_are_named() {
        let of = |text: &str| -> String {
            let read = limits::read_json::<SegmentationOptions>(METHOD, text);
            read.and_then(|o| o.check()).map_or_else(|e| e.to_string(), |()| String::new())
        };
        for (text, words) in [
            ("{}", ""),
            (r#"{"scans": 0}"#, "lane.segmentation.scans = 0"),
            (r#"{"probability": 1.0}"#, "lane.segmentation.probability = 1"),
            (r#"{"reach_m": [5, 4]}"#, "lane.segmentation.reach_m = 4"),
            (r#"{"weights": ""}"#, "lane.segmentation.weights"),
            (r#"{"weight": "road"}"#, "weight"),
        ] {
            let e = of(text);
            assert!(e.is_empty() == words.is_empty() && e.contains(words), "{text}: {e}");
        }
        let placed = SegmentationOptions { radar_at_m: Some([1.0, 0.0]), ..SegmentationOptions::default() };
        assert!(placed.check().is_ok());
        assert!(placed.check_in_scenario().unwrap_err().to_string().contains("radar_at_m"));
    }

    #[test]
    fn places_go_there_and_back() {
        let mount = RadarMount { at_m: DVec2::new(3.6, -0.5), yaw_rad: 0.3 };
        let ahead = mount.to_vehicle(DVec2::new(10.0, 0.0));
        assert!(ahead.distance(DVec2::new(3.6 + 10.0 * 0.3f64.cos(), -0.5 + 10.0 * 0.3f64.sin())) < 1e-12);
        assert!(mount.from_vehicle(ahead).distance(DVec2::new(10.0, 0.0)) < 1e-12);
    }
}
