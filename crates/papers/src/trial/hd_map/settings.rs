//! The table `[lane.hd_map]`.

use crate::trial::kit::*;
use catseye::road::traffic::VEHICLES;
use catseye::scene::toml_file::At;
pub use catseye_lane::hd_map::accuracy::SceneKind as Kind;
use catseye_lane::hd_map::{Across, RadarPose, Wgs84};

const METHOD: &str = "hd_map";

/// One scene, and the vehicles that pass in it.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SceneTable {
    /// The document's scene that it stands for; none: its figure is not printed beside.
    pub kind: Option<Kind>,
    /// A road scene (TOML), relative to the scenario's file; default the scenario's own. Its vehicles are replaced.
    pub road: Option<At<String>>,
    /// Where on the ego's road the radar stands, m; default as the scenario says.
    pub radar_s_m: Option<f64>,
    /// How many vehicles are to pass and count.
    pub vehicles: u32,
    /// Lanes, by number, in which those vehicles go; default all driving lanes.
    pub lanes: Vec<i32>,
    /// Others that pass with each group of them in the driving lanes, and do not count.
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
    /// A map file (JSON or TOML, see `crates/lane/src/hd_map/file.rs`), relative to the scenario's file. Default: the map of the scene's roads.
    pub map: Option<At<String>>,
    /// Where the world's origin lies: latitude and longitude in degrees (WGS-84), height in m over the ellipsoid.
    pub origin: [f64; 3],
    /// Where the world's x axis looks, degrees clockwise from true north.
    pub north_deg: f64,
    /// Standard deviation of each point of the map across the road, m. The document has maps of 0.1 m.
    pub map_std_m: f64,
    /// From point to point of an edge, m, at most.
    pub map_spacing_m: f64,
    /// Standard deviation of the radar's place on each axis, m, as it was surveyed or as the vehicle knows it.
    pub place_std_m: f64,
    /// Standard deviation of the radar's azimuth, degrees.
    pub azimuth_std_deg: f64,
    /// Which line across the road is divided into lanes.
    pub across: Across,
    /// Whether tracks are moved from the end and side that the radar sees to the middle of a car.
    pub to_middle: bool,
    /// Height of the echoes over the road, m, for ranges along the ground where the array tells no elevation.
    pub echo_height_m: f64,
    /// No vehicle is faster, m/s. A radar that measures rates up to this unfolded is trusted with them.
    pub fastest_mps: f64,
    /// What is slower than this, m/s, stands, and is no vehicle for the radar.
    pub slowest_mps: f64,
    /// Standard deviation of the ego vehicle's own speed, m/s, as its bus tells. A radar that stands knows that.
    pub speed_std_mps: f64,
    /// Standard deviation of vehicles from the middle of their lanes, m.
    pub wander_m: f64,
    /// Kinds of the vehicles that are drawn, one as likely as another; a kind may stand there twice.
    pub kinds: Vec<String>,
    /// Vehicles that count and are in view together.
    pub together: u32,
    /// Distances from the radar between which vehicles are at the middle of their time, m.
    pub near_m: f64,
    /// Farthest distance from the radar at which vehicles are at the middle of their time, m.
    pub far_m: f64,
    /// And directions to each side of boresight, degrees.
    pub view_deg: f64,
    /// Scenes with vehicles that are drawn at random. Without one the scenario is driven as it is, with its own vehicles.
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
    /// The first value out of its range.
    pub fn check(&self) -> Result<()> {
        let ([latitude, longitude, height], nearest) = (self.origin, self.near_m + 10.0);
        limits::check(
            METHOD,
            &[
                ("origin[0]", latitude, -89.9, 89.9, LEAVE_OUT),
                ("origin[1]", longitude, -180.0, 180.0, LEAVE_OUT),
                ("origin[2]", height, -1e4, 1e4, LEAVE_OUT),
                ("north_deg", self.north_deg, -360.0, 360.0, LEAVE_OUT),
                ("map_std_m", self.map_std_m, 0.0, 5.0, LEAVE_OUT),
                ("map_spacing_m", self.map_spacing_m, 0.5, 1000.0, LEAVE_OUT),
                ("place_std_m", self.place_std_m, 0.0, 100.0, LEAVE_OUT),
                ("azimuth_std_deg", self.azimuth_std_deg, 0.0, 90.0, LEAVE_OUT),
                ("echo_height_m", self.echo_height_m, 0.0, 10.0, LEAVE_OUT),
                ("fastest_mps", self.fastest_mps, 1.0, 200.0, LEAVE_OUT),
                ("slowest_mps", self.slowest_mps, 0.1, 20.0, LEAVE_OUT),
                ("speed_std_mps", self.speed_std_mps, 0.0, 10.0, LEAVE_OUT),
                ("wander_m", self.wander_m, 0.0, 2.0, LEAVE_OUT),
                ("together", f64::from(self.together), 1.0, 100.0, LEAVE_OUT),
                ("near_m", self.near_m, 0.0, 1e4, LEAVE_OUT),
                ("far_m", self.far_m, nearest, 1e5, LEAVE_OUT),
                ("view_deg", self.view_deg, 1.0, 180.0, LEAVE_OUT),
            ],
        )?;
        let unknown = self.kinds.iter().find(|k| !VEHICLES.contains(&k.as_str()));
        if self.kinds.is_empty() || unknown.is_some() {
            let value = unknown.map_or("[]", String::as_str);
            let bad = BadInput::new("is no kind of vehicle").key("lane.hd_map.kinds").value(value);
            return Err(bad.allowed(VEHICLES.join(", ")).remedy("name one or more of them").into());
        }
        for (i, s) in self.scene.iter().enumerate() {
            let values = [
                ("vehicles", f64::from(s.vehicles), 1.0, 1e6),
                ("others", f64::from(s.others), 0.0, 100.0),
                ("radar_s_m", s.radar_s_m.unwrap_or(0.0), 0.0, 1e6),
            ];
            for (key, value, low, high) in values {
                limits::check(METHOD, &[(&format!("scene[{i}].{key}"), value, low, high, LEAVE_OUT)])?;
            }
        }
        Ok(())
    }

    /// Where the map's axes stand on the earth.
    pub fn anchor(&self) -> RadarPose {
        let [latitude, longitude, height] = self.origin;
        RadarPose {
            position: Wgs84::new(latitude, longitude, height),
            azimuth_rad: self.north_deg.to_radians(),
        }
    }
}
