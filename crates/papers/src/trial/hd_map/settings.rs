//! The table `[lane.hd_map]`.

use crate::trial::kit::*;
use catseye::road::traffic::VEHICLES;
use catseye::scene::toml_file::At;
pub use catseye_lane::hd_map::accuracy::SceneKind as Kind;
use catseye_lane::hd_map::{Across, RadarPose, Wgs84};

const METHOD: &str = "hd_map";

/// One scene with its vehicles.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SceneTable {
    /// Li's kind of scene that this scene represents; default none: Li's value is not printed.
    pub kind: Option<Kind>,
    /// Road scene (TOML), relative to the scenario file; default the scenario's own. Its vehicles are
    /// replaced.
    pub road: Option<At<String>>,
    /// Position of the radar along the ego vehicle's road, m; default that of the scenario.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub radar_s_m: Option<f64>,
    /// Number of vehicles that are scored.
    #[schemars(range(min = 1, max = 1_000_000))]
    pub vehicles: u32,
    /// Numbers of the lanes in which the scored vehicles drive; default all driving lanes.
    pub lanes: Vec<i32>,
    /// Number of other vehicles that accompany each group in the driving lanes and are not scored.
    #[schemars(range(max = 100))]
    pub others: u32,
}

impl Default for SceneTable {
    fn default() -> Self {
        SceneTable { kind: None, road: None, radar_s_m: None, vehicles: 100, lanes: Vec::new(), others: 0 }
    }
}

/// The table `[lane.hd_map]` of a scenario.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// A map file (JSON or TOML, see `crates/lane/src/hd_map/file.rs`), relative to the scenario's file.
    /// Default: the map of the scene's roads.
    pub map: Option<At<String>>,
    /// Position of the world's origin on the earth: latitude and longitude in degrees (WGS-84), height above
    /// the ellipsoid in m.
    pub origin: [f64; 3],
    /// Heading of the world's x axis, degrees clockwise from true north.
    #[schemars(range(min = -360.0, max = 360.0))]
    pub north_deg: f64,
    /// Standard deviation of each point of the map across the road, m. Li has maps of 0.1 m.
    #[schemars(range(min = 0.0, max = 5.0))]
    pub map_std_m: f64,
    /// Maximum spacing of the points of an edge, m.
    #[schemars(range(min = 0.5, max = 1000.0))]
    pub map_spacing_m: f64,
    /// Standard deviation of the radar's position along each axis, m, as surveyed or as known to the vehicle.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub place_std_m: f64,
    /// Standard deviation of the radar's azimuth, degrees.
    #[schemars(range(min = 0.0, max = 90.0))]
    pub azimuth_std_deg: f64,
    /// Line across the road that is divided into lanes.
    pub across: Across,
    /// true: tracks are moved from the side of the car that the radar detects to its centre.
    pub to_middle: bool,
    /// Height of the echoes above the road, m, for the ground range of radars that do not measure elevation.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub echo_height_m: f64,
    /// Maximum speed of a vehicle, m/s. Range rates of a radar that are unambiguous up to this speed are used
    /// as they are.
    #[schemars(range(min = 1.0, max = 200.0))]
    pub fastest_mps: f64,
    /// Speed below which an object counts as stationary and not as a vehicle, m/s.
    #[schemars(range(min = 0.1, max = 20.0))]
    pub slowest_mps: f64,
    /// Standard deviation of the speed on the ego vehicle's bus, m/s. The speed of a stationary radar is
    /// known.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub speed_std_mps: f64,
    /// Standard deviation of the lateral position of vehicles from their lane centres, m.
    #[schemars(range(min = 0.0, max = 2.0))]
    pub wander_m: f64,
    /// Kinds of the randomly drawn vehicles, with equal probability; a kind may be listed more than once.
    pub kinds: Vec<String>,
    /// Number of scored vehicles that are in view together.
    #[schemars(range(min = 1, max = 100))]
    pub together: u32,
    /// Minimum distance from the radar at which vehicles are at the middle of their time, m.
    #[schemars(range(min = 0.0, max = 1e4))]
    pub near_m: f64,
    /// Maximum distance from the radar at which vehicles are at the middle of their time, m.
    pub far_m: f64,
    /// Maximum azimuth to each side of boresight at the middle of their time, degrees.
    #[schemars(range(min = 1.0, max = 180.0))]
    pub view_deg: f64,
    /// Scenes with randomly drawn vehicles. Without any, the scenario's own drive and vehicles are used.
    pub scene: Vec<SceneTable>,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            map: None,
            origin: [39.9, 116.3, 50.0],
            north_deg: 35.0,
            map_std_m: 0.1,
            map_spacing_m: 25.0,
            place_std_m: 0.05,
            azimuth_std_deg: 0.05,
            across: Across::RoadNormal,
            to_middle: true,
            echo_height_m: 0.7,
            fastest_mps: 40.0,
            slowest_mps: 1.5,
            speed_std_mps: 0.1,
            wander_m: 0.3,
            kinds: vec!["passenger-car".into()],
            together: 8,
            near_m: 30.0,
            far_m: 130.0,
            view_deg: 45.0,
            scene: Vec::new(),
        }
    }
}

impl Settings {
    /// Checks the settings.
    ///
    /// # Errors
    /// Returns an error for the first value outside its range.
    pub fn check(&self) -> Result<()> {
        let ([latitude, longitude, height], nearest) = (self.origin, self.near_m + 10.0);
        limits::check_bounds(METHOD, self)?;
        limits::check(
            METHOD,
            &[
                ("origin[0]", latitude, -89.9, 89.9, LEAVE_OUT),
                ("origin[1]", longitude, -180.0, 180.0, LEAVE_OUT),
                ("origin[2]", height, -1e4, 1e4, LEAVE_OUT),
                ("far_m", self.far_m, nearest, 1e5, LEAVE_OUT),
            ],
        )?;
        let unknown = self.kinds.iter().find(|k| !VEHICLES.contains(&k.as_str()));
        if self.kinds.is_empty() || unknown.is_some() {
            let value = unknown.map_or("[]", String::as_str);
            let bad = BadInput::new("is not a kind of vehicle").key("lane.hd_map.kinds").value(value);
            return Err(bad.allowed(VEHICLES.join(", ")).remedy("name one or more of them").into());
        }
        Ok(())
    }

    /// Position and direction of the map's axes on the earth.
    pub fn anchor(&self) -> RadarPose {
        let [latitude, longitude, height] = self.origin;
        RadarPose {
            position: Wgs84::new(latitude, longitude, height),
            azimuth_rad: self.north_deg.to_radians(),
        }
    }
}
