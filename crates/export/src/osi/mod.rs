//! ASAM OSI 3.8 `SensorData` (<https://opensimulationinterface.github.io/osi-antora-generator/>) as a binary trace: before each message
//! its length, four bytes, the lowest first. A name that ends in `_sd.osi` tells readers what is in it.
//!
//! A sweep is a message. Its detections stand under `feature_data.radar_sensor` in the radar's frame: distance, azimuth, elevation
//! (OSI turns elevation right-handed about y, so that positive is **down**: ours is negated), radial velocity (OSI's is positive
//! **towards** the sensor: the negative range rate), RCS, SNR. A detection of an object has existence probability 1, a ghost 0 and the
//! classification invalid, one of no known object none.
//!
//! True boxes stand under `moving_object` (road users, parked ones too) and `stationary_object` (all else), lane lines under
//! `lane_boundary`, all in the frame of the virtual sensor, which is the radar; velocities are relative to that frame. Objects with a
//! detection in the sweep have the measurement state measured, others other.
//!
//! Ids: sensors count from 1 in the order in which they come; objects keep theirs; lane lines have [`LANE_IDS`] added, because OSI
//! wants ids unique among all items. OSI says nothing of the vehicle's own pose here.

mod messages;

use super::class::{RoadUser, road_user};
use super::{Exporter, Finished, Order, Sweep, SweepBox, SweepPoint};
use catseye::base::error::{Error, Result};
use catseye::formats::stage::StagedFile;
use glam::DVec3;
use messages::*;
use prost::Message;
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

/// Added to the id of a lane line: beyond all ids of objects, which are u32.
pub const LANE_IDS: u64 = 1 << 32;
/// The interface's version.
const VERSION: InterfaceVersion =
    InterfaceVersion { version_major: Some(3), version_minor: Some(8), version_patch: Some(0) };
/// OSI's id of nothing.
const NOTHING: u64 = u64::MAX;

/// `DataQualifier.AVAILABLE` of both headers.
const AVAILABLE: i32 = 2;
/// `DetectedItemHeader.MeasurementState`.
const MEASURED: i32 = 2;
const NOT_MEASURED: i32 = 1;
/// `DetectionClassification.INVALID`.
const INVALID: i32 = 2;
/// `DetectedMovingObject.ReferencePoint.CENTER`.
const CENTRE: i32 = 2;
/// `DetectedMovingObject.MovementState`.
const STATIONARY: i32 = 2;
const MOVING: i32 = 3;
/// `MovingObject.Type`.
const VEHICLE: i32 = 2;
const PEDESTRIAN: i32 = 3;
const ANIMAL: i32 = 4;

/// `MovingObject.Type` and `VehicleClassification.Type`.
fn moving_kind(user: RoadUser) -> (i32, Option<i32>) {
    match user {
        RoadUser::Car => (VEHICLE, Some(4)),
        RoadUser::Van => (VEHICLE, Some(6)),
        RoadUser::Truck => (VEHICLE, Some(7)),
        RoadUser::Motorcycle => (VEHICLE, Some(10)),
        RoadUser::Cyclist => (VEHICLE, Some(11)),
        RoadUser::Bus => (VEHICLE, Some(12)),
        RoadUser::Train => (VEHICLE, Some(14)),
        RoadUser::Pedestrian => (PEDESTRIAN, None),
        RoadUser::Animal => (ANIMAL, None),
    }
}

/// `StationaryObject.Classification.Type`.
fn stationary_kind(class: &str) -> i32 {
    match class {
        "" => 0,
        "bridge" => 2,
        "building" => 3,
        "pole" | "post" => 4,
        "marker" | "reflector" => 15,
        "tree" => 7,
        "guard_rail" | "barrier" | "fence" => 8,
        "verge" | "grass" => 9,
        "kerb" => 10,
        "wall" => 11,
        "gantry" => 14,
        _ => 1,
    }
}

fn detection(p: &SweepPoint) -> RadarDetection {
    let (existence, class) = match (p.ghost, p.object_id) {
        (true, _) => (Some(0.0), Some(INVALID)),
        (false, 0) => (None, None),
        (false, _) => (Some(1.0), None),
    };
    let id = if p.object_id == 0 { NOTHING } else { u64::from(p.object_id) };
    RadarDetection {
        existence_probability: existence,
        object_id: Some(Identifier::new(id)),
        position: Some(Spherical3d {
            distance: Some(p.range_m),
            azimuth: Some(p.azimuth_rad),
            elevation: Some(-p.elevation_rad),
        }),
        position_rmse: Some(Spherical3d {
            distance: Some(p.range_std_m),
            azimuth: p.azimuth_std_rad,
            elevation: p.elevation_std_rad,
        }),
        radial_velocity: Some(-p.range_rate_mps),
        radial_velocity_rmse: Some(p.range_rate_std_mps),
        rcs: Some(p.rcs_dbsm),
        snr: Some(p.snr_db),
        classification: class,
    }
}

/// A box in the radar's frame, with the velocity that it has there: the radar moves and turns.
fn base(sweep: &Sweep, b: &SweepBox, moving: bool) -> BaseMoving {
    let into = sweep.sensor_in_world().inverse();
    let position = into.point(b.centre_m);
    let turning = into.direction(DVec3::new(0.0, 0.0, sweep.yaw_rate_rad_per_s));
    let velocity = into.direction(b.velocity_mps - sweep.sensor_velocity_mps) - turning.cross(position);
    BaseMoving {
        dimension: Some(Dimension3d {
            length: Some(b.size_m.x),
            width: Some(b.size_m.y),
            height: Some(b.size_m.z),
        }),
        position: Some(position.into()),
        orientation: Some((into.rotation * b.rotation).into()),
        velocity: moving.then(|| velocity.into()),
    }
}

fn message(sweep: &Sweep, sensor: u64) -> SensorData {
    let time = Timestamp::from_ns(sweep.time_ns);
    let mounting = MountingPosition {
        position: Some(sweep.sensor_in_vehicle.translation_m.into()),
        orientation: Some(sweep.sensor_in_vehicle.rotation.into()),
    };
    let measured: BTreeSet<u32> = sweep.points.iter().filter(|p| !p.ghost).map(|p| p.object_id).collect();
    let item = |id: u64, state: i32| {
        Some(DetectedItemHeader {
            tracking_id: Some(Identifier::new(id)),
            ground_truth_id: vec![Identifier::new(id)],
            existence_probability: Some(1.0),
            measurement_state: Some(state),
            sensor_id: vec![Identifier::new(sensor)],
        })
    };
    let header =
        |b: &SweepBox| item(u64::from(b.id), if measured.contains(&b.id) { MEASURED } else { NOT_MEASURED });
    let entities = Some(DetectedEntityHeader {
        measurement_time: Some(time),
        cycle_counter: Some(sweep.frame),
        data_qualifier: Some(AVAILABLE),
    });
    let mut moving_object = Vec::new();
    let mut stationary_object = Vec::new();
    for b in &sweep.boxes {
        match road_user(&b.class) {
            Some(user) => {
                let (kind, vehicle) = moving_kind(user);
                moving_object.push(DetectedMovingObject {
                    header: header(b),
                    base: Some(base(sweep, b, true)),
                    reference_point: Some(CENTRE),
                    movement_state: Some(if b.moving { MOVING } else { STATIONARY }),
                    candidate: vec![CandidateMovingObject {
                        probability: Some(1.0),
                        kind: Some(kind),
                        vehicle_classification: vehicle
                            .map(|kind| VehicleClassification { kind: Some(kind) }),
                    }],
                });
            }
            None => stationary_object.push(DetectedStationaryObject {
                header: header(b),
                base: Some(base(sweep, b, false)),
                candidate: vec![CandidateStationaryObject {
                    probability: Some(1.0),
                    classification: Some(StationaryClassification { kind: Some(stationary_kind(&b.class)) }),
                }],
            }),
        }
    }
    let from_vehicle = sweep.sensor_in_vehicle.inverse();
    let lane_boundary = sweep.lanes.iter().map(|l| DetectedLaneBoundary {
        header: item(LANE_IDS + u64::from(l.id), NOT_MEASURED),
        boundary_line: l
            .points_m
            .iter()
            .map(|p| BoundaryPoint { position: Some(from_vehicle.point(*p).into()) })
            .collect(),
    });
    SensorData {
        version: Some(VERSION),
        timestamp: Some(time),
        sensor_id: Some(Identifier::new(sensor)),
        mounting_position: Some(mounting),
        last_measurement_time: Some(time),
        stationary_object_header: entities,
        stationary_object,
        moving_object_header: entities,
        moving_object,
        lane_boundary_header: entities,
        lane_boundary: lane_boundary.collect(),
        feature_data: Some(FeatureData {
            version: Some(VERSION),
            radar_sensor: vec![RadarDetectionData {
                header: Some(SensorDetectionHeader {
                    measurement_time: Some(time),
                    cycle_counter: Some(sweep.frame),
                    mounting_position: Some(mounting),
                    data_qualifier: Some(AVAILABLE),
                    number_of_valid_detections: Some(sweep.points.len() as u32),
                    sensor_id: Some(Identifier::new(sensor)),
                }),
                detection: sweep.points.iter().map(detection).collect(),
            }],
        }),
    }
}

/// A trace file.
pub struct Trace {
    staged: StagedFile,
    out: BufWriter<File>,
    sensors: Vec<String>,
    order: Order,
    sweeps: usize,
    points: usize,
}

impl Trace {
    /// Begins a trace at `path`.
    ///
    /// # Errors
    /// Returns `BadInput` if the file already exists and `force` is not given, and an error if it cannot be
    /// written.
    pub fn create(path: &Path, force: bool) -> Result<Trace> {
        let staged = StagedFile::new(path, force)?;
        let out = BufWriter::new(File::create(staged.path()).map_err(|e| Error::io(path, e))?);
        Ok(Trace { staged, out, sensors: Vec::new(), order: Order::default(), sweeps: 0, points: 0 })
    }
}

impl Exporter for Trace {
    fn push(&mut self, sweep: &Sweep) -> Result<()> {
        sweep.check()?;
        self.order.next(sweep)?;
        let at = self.sensors.iter().position(|name| *name == sweep.radar).unwrap_or_else(|| {
            self.sensors.push(sweep.radar.clone());
            self.sensors.len() - 1
        });
        let bytes = message(sweep, at as u64 + 1).encode_to_vec();
        let length = u32::try_from(bytes.len()).map_err(|_| {
            Error::Failed(format!(
                "frame {}: a message exceeds the 4 GiB that an OSI trace allows",
                sweep.frame
            ))
        })?;
        let wrong = |e| Error::io(self.staged.final_path(), e);
        self.out.write_all(&length.to_le_bytes()).map_err(wrong)?;
        self.out.write_all(&bytes).map_err(wrong)?;
        self.sweeps += 1;
        self.points += sweep.points.len();
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<Finished> {
        self.out.flush().map_err(|e| Error::io(self.staged.final_path(), e))?;
        let notes = match self.sensors.len() {
            0 | 1 => Vec::new(),
            _ => {
                let ids =
                    self.sensors.iter().zip(1..).map(|(name, id): (&String, u32)| format!("{id} {name}"));
                vec![format!("sensor ids: {}", ids.collect::<Vec<_>>().join(", "))]
            }
        };
        Ok(Finished { output: self.staged.commit()?, sweeps: self.sweeps, points: self.points, notes })
    }
}

#[cfg(test)]
mod tests {
    use super::super::samples;
    use super::*;
    use catseye::base::frames::{Pose, Sensor, World};

    fn read(path: &Path) -> Vec<SensorData> {
        let bytes = std::fs::read(path).unwrap();
        let mut rest = bytes.as_slice();
        let mut out = Vec::new();
        while !rest.is_empty() {
            let (length, after) = rest.split_at(4);
            let n = u32::from_le_bytes(length.try_into().unwrap()) as usize;
            out.push(SensorData::decode(&after[..n]).unwrap());
            rest = &after[n..];
        }
        out
    }

    fn vector(v: Option<Vector3d>) -> DVec3 {
        let v = v.unwrap();
        DVec3::new(v.x.unwrap(), v.y.unwrap(), v.z.unwrap())
    }

    #[test]
    fn signs_and_frames() {
        let t = tempfile::tempdir().unwrap();
        let path = t.path().join("run_sd.osi");
        let sweeps = samples::sweeps();
        let mut trace = Box::new(Trace::create(&path, false).unwrap());
        for s in &sweeps {
            trace.push(s).unwrap();
        }
        assert_eq!(trace.finish().unwrap().notes, ["sensor ids: 1 front, 2 left"]);
        let messages = read(&path);
        assert_eq!(messages.len(), 4);
        for (m, s) in messages.iter().zip(&sweeps) {
            let radar = &m.feature_data.as_ref().unwrap().radar_sensor[0];
            assert_eq!(radar.detection.len(), s.points.len());
            for (d, p) in radar.detection.iter().zip(&s.points) {
                // What stands ahead of a car that drives comes towards it: OSI's sign is plus.
                assert_eq!(d.radial_velocity, Some(-p.range_rate_mps));
                // The rotations of OSI's Spherical3d take x to the point.
                let at = d.position.unwrap();
                let turn = Pose::<Sensor, World>::from_yaw_pitch_roll(
                    DVec3::ZERO,
                    at.azimuth.unwrap(),
                    at.elevation.unwrap(),
                    0.0,
                );
                let place = turn.direction(DVec3::X) * at.distance.unwrap();
                assert!((place - p.position_m).length() < 1e-9);
            }
            // The two road users, back in the world.
            let pose = s.sensor_in_world();
            for (o, b) in m.moving_object.iter().zip(&s.boxes) {
                let base = o.base.as_ref().unwrap();
                assert!((pose.point(vector(base.position)) - b.centre_m).length() < 1e-9);
            }
            assert_eq!((m.moving_object.len(), m.stationary_object.len()), (2, 1));
            let line = &m.lane_boundary[0].boundary_line[3];
            let place = s.sensor_in_vehicle.point(vector(line.position));
            assert!((place - s.lanes[0].points_m[3]).length() < 1e-9);
        }
        let ghost = &messages[0].feature_data.as_ref().unwrap().radar_sensor[0].detection[4];
        assert_eq!((ghost.existence_probability, ghost.classification), (Some(0.0), Some(INVALID)));
    }

    /// Velocities are rates of the positions beside them, as OSI defines them: compared with a small step in time.
    #[test]
    fn velocities_are_rates_of_positions() {
        let s = &samples::sweeps()[1];
        let dt = 1e-5;
        // The car on its arc, a moment later; a left-turning radar goes with it.
        let mut later = s.clone();
        let turn = glam::DQuat::from_rotation_z(s.yaw_rate_rad_per_s * dt);
        later.vehicle_in_world.rotation = turn * s.vehicle_in_world.rotation;
        let arm = s.vehicle_in_world.rotation * s.sensor_in_vehicle.translation_m;
        let middle = glam::DQuat::from_rotation_z(0.5 * s.yaw_rate_rad_per_s * dt);
        let drive = s.sensor_velocity_mps - DVec3::Z.cross(arm) * s.yaw_rate_rad_per_s;
        later.vehicle_in_world.translation_m += middle * drive * dt;
        for (b, kind) in s.boxes.iter().zip([true, true, true]) {
            let mut moved = b.clone();
            moved.centre_m += b.velocity_mps * dt;
            let (now, then) = (base(s, b, kind), base(&later, &moved, kind));
            let rate = (vector(then.position) - vector(now.position)) / dt;
            // The second order of the step: half an acceleration of some 10 m/s² times dt.
            assert!((rate - vector(now.velocity)).length() < 1e-3, "{rate} {now:?}");
        }
    }
}
