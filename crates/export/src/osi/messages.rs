//! The messages of ASAM OSI 3.8 that are written, with their field numbers (`osi_*.proto` of
//! <https://github.com/OpenSimulationInterface/open-simulation-interface>). `python/tests/readers` compares them with the published
//! descriptors.

use glam::{DQuat, DVec3};
use prost::Message;

#[derive(Clone, Copy, PartialEq, Message)]
pub struct InterfaceVersion {
    #[prost(uint32, optional, tag = "1")]
    pub version_major: Option<u32>,
    #[prost(uint32, optional, tag = "2")]
    pub version_minor: Option<u32>,
    #[prost(uint32, optional, tag = "3")]
    pub version_patch: Option<u32>,
}

#[derive(Clone, Copy, PartialEq, Message)]
pub struct Timestamp {
    #[prost(int64, optional, tag = "1")]
    pub seconds: Option<i64>,
    #[prost(uint32, optional, tag = "2")]
    pub nanos: Option<u32>,
}

impl Timestamp {
    pub fn from_ns(ns: i64) -> Self {
        const SECOND: i64 = 1_000_000_000;
        Timestamp { seconds: Some(ns.div_euclid(SECOND)), nanos: Some(ns.rem_euclid(SECOND) as u32) }
    }
}

#[derive(Clone, Copy, PartialEq, Message)]
pub struct Identifier {
    #[prost(uint64, optional, tag = "1")]
    pub value: Option<u64>,
}

impl Identifier {
    pub fn new(value: u64) -> Self {
        Identifier { value: Some(value) }
    }
}

#[derive(Clone, Copy, PartialEq, Message)]
pub struct Vector3d {
    #[prost(double, optional, tag = "1")]
    pub x: Option<f64>,
    #[prost(double, optional, tag = "2")]
    pub y: Option<f64>,
    #[prost(double, optional, tag = "3")]
    pub z: Option<f64>,
}

impl From<DVec3> for Vector3d {
    fn from(v: DVec3) -> Self {
        Vector3d { x: Some(v.x), y: Some(v.y), z: Some(v.z) }
    }
}

/// Yaw, then pitch about the new y, then roll about the new x (ISO 8855).
#[derive(Clone, Copy, PartialEq, Message)]
pub struct Orientation3d {
    #[prost(double, optional, tag = "1")]
    pub roll: Option<f64>,
    #[prost(double, optional, tag = "2")]
    pub pitch: Option<f64>,
    #[prost(double, optional, tag = "3")]
    pub yaw: Option<f64>,
}

impl From<DQuat> for Orientation3d {
    fn from(q: DQuat) -> Self {
        let [yaw, pitch, roll] = super::super::yaw_pitch_roll(q);
        Orientation3d { roll: Some(roll), pitch: Some(pitch), yaw: Some(yaw) }
    }
}

#[derive(Clone, Copy, PartialEq, Message)]
pub struct Dimension3d {
    #[prost(double, optional, tag = "1")]
    pub length: Option<f64>,
    #[prost(double, optional, tag = "2")]
    pub width: Option<f64>,
    #[prost(double, optional, tag = "3")]
    pub height: Option<f64>,
}

/// Azimuth about z, then elevation about the new y, both right-handed: a positive elevation points **down**.
#[derive(Clone, Copy, PartialEq, Message)]
pub struct Spherical3d {
    #[prost(double, optional, tag = "1")]
    pub distance: Option<f64>,
    #[prost(double, optional, tag = "2")]
    pub azimuth: Option<f64>,
    #[prost(double, optional, tag = "3")]
    pub elevation: Option<f64>,
}

#[derive(Clone, Copy, PartialEq, Message)]
pub struct MountingPosition {
    #[prost(message, optional, tag = "1")]
    pub position: Option<Vector3d>,
    #[prost(message, optional, tag = "2")]
    pub orientation: Option<Orientation3d>,
}

#[derive(Clone, PartialEq, Message)]
pub struct SensorDetectionHeader {
    #[prost(message, optional, tag = "1")]
    pub measurement_time: Option<Timestamp>,
    #[prost(uint64, optional, tag = "2")]
    pub cycle_counter: Option<u64>,
    #[prost(message, optional, tag = "3")]
    pub mounting_position: Option<MountingPosition>,
    #[prost(int32, optional, tag = "5")]
    pub data_qualifier: Option<i32>,
    #[prost(uint32, optional, tag = "6")]
    pub number_of_valid_detections: Option<u32>,
    #[prost(message, optional, tag = "7")]
    pub sensor_id: Option<Identifier>,
}

#[derive(Clone, PartialEq, Message)]
pub struct RadarDetection {
    #[prost(double, optional, tag = "1")]
    pub existence_probability: Option<f64>,
    #[prost(message, optional, tag = "2")]
    pub object_id: Option<Identifier>,
    #[prost(message, optional, tag = "3")]
    pub position: Option<Spherical3d>,
    #[prost(message, optional, tag = "4")]
    pub position_rmse: Option<Spherical3d>,
    /// Positive towards the sensor.
    #[prost(double, optional, tag = "5")]
    pub radial_velocity: Option<f64>,
    #[prost(double, optional, tag = "6")]
    pub radial_velocity_rmse: Option<f64>,
    /// dBsm.
    #[prost(double, optional, tag = "7")]
    pub rcs: Option<f64>,
    /// dB.
    #[prost(double, optional, tag = "8")]
    pub snr: Option<f64>,
    #[prost(int32, optional, tag = "11")]
    pub classification: Option<i32>,
}

#[derive(Clone, PartialEq, Message)]
pub struct RadarDetectionData {
    #[prost(message, optional, tag = "1")]
    pub header: Option<SensorDetectionHeader>,
    #[prost(message, repeated, tag = "2")]
    pub detection: Vec<RadarDetection>,
}

#[derive(Clone, PartialEq, Message)]
pub struct FeatureData {
    #[prost(message, optional, tag = "1")]
    pub version: Option<InterfaceVersion>,
    #[prost(message, repeated, tag = "2")]
    pub radar_sensor: Vec<RadarDetectionData>,
}

#[derive(Clone, PartialEq, Message)]
pub struct DetectedItemHeader {
    #[prost(message, optional, tag = "1")]
    pub tracking_id: Option<Identifier>,
    #[prost(message, repeated, tag = "2")]
    pub ground_truth_id: Vec<Identifier>,
    #[prost(double, optional, tag = "3")]
    pub existence_probability: Option<f64>,
    #[prost(int32, optional, tag = "5")]
    pub measurement_state: Option<i32>,
    #[prost(message, repeated, tag = "6")]
    pub sensor_id: Vec<Identifier>,
}

/// `BaseStationary` too, which has the first three fields.
#[derive(Clone, PartialEq, Message)]
pub struct BaseMoving {
    #[prost(message, optional, tag = "1")]
    pub dimension: Option<Dimension3d>,
    #[prost(message, optional, tag = "2")]
    pub position: Option<Vector3d>,
    #[prost(message, optional, tag = "3")]
    pub orientation: Option<Orientation3d>,
    #[prost(message, optional, tag = "4")]
    pub velocity: Option<Vector3d>,
}

#[derive(Clone, Copy, PartialEq, Message)]
pub struct VehicleClassification {
    #[prost(int32, optional, tag = "1")]
    pub kind: Option<i32>,
}

#[derive(Clone, PartialEq, Message)]
pub struct CandidateMovingObject {
    #[prost(double, optional, tag = "1")]
    pub probability: Option<f64>,
    #[prost(int32, optional, tag = "2")]
    pub kind: Option<i32>,
    #[prost(message, optional, tag = "3")]
    pub vehicle_classification: Option<VehicleClassification>,
}

#[derive(Clone, PartialEq, Message)]
pub struct DetectedMovingObject {
    #[prost(message, optional, tag = "1")]
    pub header: Option<DetectedItemHeader>,
    #[prost(message, optional, tag = "2")]
    pub base: Option<BaseMoving>,
    #[prost(int32, optional, tag = "4")]
    pub reference_point: Option<i32>,
    #[prost(int32, optional, tag = "5")]
    pub movement_state: Option<i32>,
    #[prost(message, repeated, tag = "8")]
    pub candidate: Vec<CandidateMovingObject>,
}

#[derive(Clone, Copy, PartialEq, Message)]
pub struct StationaryClassification {
    #[prost(int32, optional, tag = "1")]
    pub kind: Option<i32>,
}

#[derive(Clone, PartialEq, Message)]
pub struct CandidateStationaryObject {
    #[prost(double, optional, tag = "1")]
    pub probability: Option<f64>,
    #[prost(message, optional, tag = "2")]
    pub classification: Option<StationaryClassification>,
}

#[derive(Clone, PartialEq, Message)]
pub struct DetectedStationaryObject {
    #[prost(message, optional, tag = "1")]
    pub header: Option<DetectedItemHeader>,
    #[prost(message, optional, tag = "2")]
    pub base: Option<BaseMoving>,
    #[prost(message, repeated, tag = "4")]
    pub candidate: Vec<CandidateStationaryObject>,
}

#[derive(Clone, Copy, PartialEq, Message)]
pub struct BoundaryPoint {
    #[prost(message, optional, tag = "1")]
    pub position: Option<Vector3d>,
}

#[derive(Clone, PartialEq, Message)]
pub struct DetectedLaneBoundary {
    #[prost(message, optional, tag = "1")]
    pub header: Option<DetectedItemHeader>,
    #[prost(message, repeated, tag = "3")]
    pub boundary_line: Vec<BoundaryPoint>,
}

#[derive(Clone, Copy, PartialEq, Message)]
pub struct DetectedEntityHeader {
    #[prost(message, optional, tag = "1")]
    pub measurement_time: Option<Timestamp>,
    #[prost(uint64, optional, tag = "2")]
    pub cycle_counter: Option<u64>,
    #[prost(int32, optional, tag = "3")]
    pub data_qualifier: Option<i32>,
}

#[derive(Clone, PartialEq, Message)]
pub struct SensorData {
    #[prost(message, optional, tag = "1")]
    pub version: Option<InterfaceVersion>,
    #[prost(message, optional, tag = "2")]
    pub timestamp: Option<Timestamp>,
    #[prost(message, optional, tag = "5")]
    pub sensor_id: Option<Identifier>,
    #[prost(message, optional, tag = "6")]
    pub mounting_position: Option<MountingPosition>,
    #[prost(message, optional, tag = "9")]
    pub last_measurement_time: Option<Timestamp>,
    #[prost(message, optional, tag = "10")]
    pub stationary_object_header: Option<DetectedEntityHeader>,
    #[prost(message, repeated, tag = "11")]
    pub stationary_object: Vec<DetectedStationaryObject>,
    #[prost(message, optional, tag = "12")]
    pub moving_object_header: Option<DetectedEntityHeader>,
    #[prost(message, repeated, tag = "13")]
    pub moving_object: Vec<DetectedMovingObject>,
    #[prost(message, optional, tag = "20")]
    pub lane_boundary_header: Option<DetectedEntityHeader>,
    #[prost(message, repeated, tag = "21")]
    pub lane_boundary: Vec<DetectedLaneBoundary>,
    #[prost(message, optional, tag = "26")]
    pub feature_data: Option<FeatureData>,
}
