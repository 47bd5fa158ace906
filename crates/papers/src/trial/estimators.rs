//! Estimators by name with options as JSON, for callers with their own points, such as
//! `catseye.LaneEstimator` in Python.

use crate::trial::method::Method;
use crate::trial::uwb;
use crate::trial::uwb::{ImpulseRadar, Rule, tune};
use catseye::base::error::{BadInput, Error, Result, json_in_words};
use catseye_lane::LaneEstimator;
use catseye_lane::hd_map::estimator::{MapLanes as MapMethod, Options as MapOptions};
use catseye_lane::hd_map::file;
use catseye_lane::markers;
use catseye_lane::range_doppler::{Options as RangeDopplerOptions, RangeDopplerLane};
use catseye_lane::signature::estimator::{MapLanes, Signature, SignatureOptions};
use catseye_lane::signature::map::{MapSettings, Pose, ScanPoint, SignatureMap};
use catseye_lane::uwb::{Centre, MarkedLane, RangeAxis, RangeGate, Side, UwbLanes};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::path::PathBuf;

/// Options of the method uwb (Kim).
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UwbJson {
    /// Range of the first sample of a scan, m.
    pub range_start_m: f64,
    /// Spacing of the samples in range, m.
    pub range_step_m: f64,
    /// Height of the radar above the road, m.
    pub height_m: f64,
    /// Position of the radar on the vehicle: forward, left, m.
    pub at_m: [f64; 2],
    /// Side of the line that it observes: left or right.
    pub side: String,
    /// Scans of the road without markers, at least 20, from which background and threshold are computed.
    pub quiet: Vec<Vec<f64>>,
    /// Distance from plate to plate, m. Default 8.
    #[serde(default = "eight")]
    pub spacing_m: f64,
    /// Length of a plate, m. Default 3.
    #[serde(default = "three")]
    pub plate_length_m: f64,
    /// Width of the lane, m. Default 3.5.
    #[serde(default = "lane_width")]
    pub lane_width_m: f64,
    /// Width of the vehicle, m. Default 1.9.
    #[serde(default = "car_width")]
    pub car_width_m: f64,
}

fn eight() -> f64 {
    8.0
}

fn three() -> f64 {
    3.0
}

fn lane_width() -> f64 {
    3.5
}

fn car_width() -> f64 {
    1.9
}

/// Options of the method hd-map (Li 2022).
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HdMapJson {
    /// Path of a map file (`crates/lane/src/hd_map/file.rs`).
    pub map: PathBuf,
    /// Position of the radar on the vehicle: forward, left, m.
    #[serde(default)]
    pub radar_at_m: [f64; 2],
    /// Yaw of the radar on the vehicle, degrees.
    #[serde(default)]
    pub radar_yaw_deg: f64,
    /// Standard deviation of the radar's position on the earth on each axis, m.
    #[serde(default)]
    pub place_std_m: f64,
    /// Standard deviation of the radar's azimuth on the earth, degrees.
    #[serde(default)]
    pub azimuth_std_deg: f64,
}

/// A scan from which a signature map is made.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScanJson {
    /// Pose of the radar in the map.
    pub pose: Pose,
    /// Standard deviations of the pose: position (m, m) and heading (rad).
    pub std: [f64; 3],
    /// Stationary points of the scan.
    pub points: Vec<ScanPoint>,
}

/// Options of the method signature (Feng 2019).
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SignatureJson {
    /// Scans of the drive that was mapped.
    pub scans: Vec<ScanJson>,
    /// Settings of the map.
    #[serde(default)]
    pub map: MapSettings,
    /// Least number of scans in which a landmark was seen.
    #[serde(default = "hits")]
    pub least_hits: u32,
    /// Known lines of the road in the map.
    #[serde(default)]
    pub lanes: MapLanes,
}

fn hits() -> u32 {
    3
}

fn read<T: DeserializeOwned>(method: Method, options: &str) -> Result<T> {
    serde_json::from_str(options).map_err(|e| wrong(method, json_in_words(&e)))
}

fn wrong(method: Method, why: impl ToString) -> Error {
    let key = format!("options of '{}'", method.name());
    BadInput::new(why.to_string()).key(key).remedy("see docs/lanes.md").into()
}

/// Makes the estimator of a method; without options it has those of its document.
///
/// # Errors
/// Returns an error for options that are unknown, missing (uwb, hd-map and signature need some) or outside
/// their ranges.
pub fn estimator(method: Method, options: Option<&str>) -> Result<Box<dyn LaneEstimator + Send>> {
    let text = options.unwrap_or("{}");
    let bad = |why: &dyn ToString| wrong(method, why.to_string());
    Ok(match method {
        Method::Markers => markers::from_json(text)?,
        Method::RangeDoppler => {
            let o: RangeDopplerOptions = read(method, text)?;
            Box::new(RangeDopplerLane::new(o).map_err(|e| bad(&e))?)
        }
        Method::RoadShape => catseye_lane::road_shape::from_json(text)?,
        Method::CameraFusion => catseye_lane::camera_fusion::from_json(text)?,
        Method::HdMap => {
            let o: HdMapJson = read(method, text)?;
            let options = MapOptions {
                radar_at_m: o.radar_at_m,
                radar_yaw_rad: o.radar_yaw_deg.to_radians(),
                place_std_m: o.place_std_m,
                azimuth_std_rad: o.azimuth_std_deg.to_radians(),
                ..MapOptions::default()
            };
            Box::new(MapMethod::new(file::read(&o.map)?, options).map_err(|e| bad(&e))?)
        }
        Method::Signature => {
            let o: SignatureJson = read(method, text)?;
            let mut map = SignatureMap::new(o.map).map_err(|e| bad(&e))?;
            for s in &o.scans {
                map.add_scan(s.pose, s.std, None, &s.points).map_err(|e| bad(&e))?;
            }
            map.prune(o.least_hits, 0.3);
            Box::new(Signature::new(map, o.lanes, SignatureOptions::default()).map_err(|e| bad(&e))?)
        }
        Method::Uwb => {
            let o: UwbJson = read(method, text)?;
            let side = match o.side.as_str() {
                "left" => Side::Left,
                "right" => Side::Right,
                _ => return Err(wrong(method, "side is left or right")),
            };
            let UwbJson { height_m, at_m, spacing_m, plate_length_m, lane_width_m, car_width_m, .. } = o;
            let lane = MarkedLane { height_m, lane_width_m, car_width_m, spacing_m, plate_length_m };
            let gate = RangeGate::from_marked_lane(&lane).map_err(|e| bad(&e))?;
            let axis = RangeAxis { start_m: o.range_start_m, step_m: o.range_step_m };
            let (which, name, samples) = (0, String::new(), 0);
            let radar = ImpulseRadar { which, name, side, height_m, at_m, axis, gate, samples };
            let known = uwb::Settings::default();
            let settings = uwb::Settings { spacing_m, plate_length_m, lane_width_m, car_width_m, ..known };
            let rule = Rule { name: "", take_background: true, centre: Centre::Matched };
            let tuned = tune(&settings, &rule, &radar, &o.quiet).map_err(|(_, e)| bad(&e))?;
            Box::new(UwbLanes::new(tuned.options).map_err(|e| bad(&e))?)
        }
    })
}
