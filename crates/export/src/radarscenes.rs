//! RadarScenes sequences (Schumann et al., "RadarScenes: a real-world radar point cloud data set for automotive applications", 2021;
//! <https://radar-scenes.com/dataset/structure/>), as the package `radar_scenes` and h5py read them:
//!
//! ```text
//! sensors.json  sequences.json  SEQUENCE/radar_data.h5  SEQUENCE/scenes.json
//! ```
//!
//! `radar_data.h5` holds two tables of compounds. `radar_data`: `timestamp` (i64, us), `sensor_id` (u8, from 1), `range_sc`,
//! `azimuth_sc`, `rcs` (dBsm), `vr`, `vr_compensated` (m/s, positive receding; the second over the ground), `x_cc`, `y_cc` (vehicle),
//! `x_seq`, `y_seq` (world; all f32), `uuid`, `track_id` (32 hexadecimal digits) and `label_id` (u8). `odometry`: `timestamp`, `x_seq`,
//! `y_seq`, `yaw_seq`, `vx`, `yaw_rate`.
//!
//! As in the data set, only what moves is labelled: everything else, ghosts too, has label 11 (static) and an empty `track_id`.
//! Every measurement needs a time of its own there: those that fall into one microsecond are put one microsecond apart.

use super::class::{RoadUser, road_user};
use super::{Exporter, Finished, Order, Sweep, SweepPoint, check_name, heading};
use catseye::base::error::{BadInput, Error, Result};
use catseye::formats::stage::{MANIFEST, StagedDir};
use hdf5_pure::{
    CharacterSet, CompoundTypeBuilder, Datatype, FileBuilder, StringPadding, make_f32_type, make_i64_type,
    make_u8_type,
};
use serde_json::{Map, Value, json};
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// The tools of the data set know sensors 1 to 4.
const MOST_SENSORS: usize = 4;
const STATIC: u8 = 11;
const OTHER: u8 = 10;
/// Digits of `uuid` and `track_id`.
const ID_DIGITS: u32 = 32;

/// Label of a class that moves (`radar_scenes.labels.Label`).
fn label(class: &str) -> u8 {
    match road_user(class) {
        Some(RoadUser::Car) => 0,
        Some(RoadUser::Van) => 1,
        Some(RoadUser::Truck) => 2,
        Some(RoadUser::Bus) => 3,
        Some(RoadUser::Train) => 4,
        Some(RoadUser::Cyclist) => 5,
        Some(RoadUser::Motorcycle) => 6,
        Some(RoadUser::Pedestrian) => 7,
        Some(RoadUser::Animal) => 9,
        None => OTHER,
    }
}

/// One measurement of one radar.
struct Measurement {
    timestamp: i64,
    sensor: usize,
    odometry: usize,
    /// Its rows of `radar_data`.
    rows: [usize; 2],
}

/// A folder with one sequence.
pub struct Sequence {
    staged: StagedDir,
    name: String,
    order: Order,
    /// Name and mounting of the sensors: x, y, yaw.
    sensors: Vec<(String, [f64; 3])>,
    measurements: Vec<Measurement>,
    radar_data: Vec<u8>,
    points: usize,
    odometry: Vec<u8>,
    /// Time of the last row of the odometry.
    odometry_at: Vec<i64>,
}

impl Sequence {
    /// `name` is that of the sequence and its folder in `folder`.
    ///
    /// # Errors
    /// `BadInput` for a name that is none for a folder, and when there is a folder already and `force` is not given
    /// ([`StagedDir::new`]).
    pub fn create(folder: &Path, name: &str, force: bool) -> Result<Sequence> {
        check_name("sequence", name)?;
        Ok(Sequence {
            staged: StagedDir::new(folder, force, "radarscenes")?,
            name: name.into(),
            order: Order::default(),
            sensors: Vec::new(),
            measurements: Vec::new(),
            radar_data: Vec::new(),
            points: 0,
            odometry: Vec::new(),
            odometry_at: Vec::new(),
        })
    }

    /// Number of the sensor, from 1.
    fn sensor(&mut self, sweep: &Sweep) -> Result<usize> {
        let p = sweep.sensor_in_vehicle;
        let mounting = [p.translation_m.x, p.translation_m.y, heading(p.rotation)];
        if let Some(at) = self.sensors.iter().position(|(name, _)| *name == sweep.radar) {
            return Ok(at + 1);
        }
        if self.sensors.len() == MOST_SENSORS {
            return Err(BadInput::new("RadarScenes has four sensors")
                .key("radars")
                .value(format!("{} and more", self.sensors.len() + 1))
                .allowed("up to 4")
                .remedy("export another format, or a run with fewer radars")
                .into());
        }
        self.sensors.push((sweep.radar.clone(), mounting));
        Ok(self.sensors.len())
    }

    fn push_odometry(&mut self, sweep: &Sweep) -> usize {
        let time = sweep.time_ns.div_euclid(1000);
        if self.odometry_at.last() != Some(&time) {
            let pose = sweep.vehicle_in_world;
            let forward = (pose.rotation.inverse() * sweep.vehicle_velocity_mps).x;
            self.odometry.extend_from_slice(&time.to_le_bytes());
            let row = [
                pose.translation_m.x,
                pose.translation_m.y,
                heading(pose.rotation),
                forward,
                sweep.yaw_rate_rad_per_s,
            ];
            floats(&mut self.odometry, &row);
            self.odometry_at.push(time);
        }
        self.odometry_at.len() - 1
    }

    fn push_point(&mut self, sweep: &Sweep, timestamp: i64, sensor: usize, index: usize, p: &SweepPoint) {
        let car = sweep.sensor_in_vehicle.point(p.position_m);
        let world = sweep.vehicle_in_world.point(car);
        let moving = p.moving == Some(true) && !p.ghost;
        let out = &mut self.radar_data;
        out.extend_from_slice(&timestamp.to_le_bytes());
        out.push(sensor as u8);
        let row = [
            p.range_m,
            p.azimuth_rad,
            p.rcs_dbsm,
            p.range_rate_mps,
            sweep.range_rate_over_ground_mps(p),
            car.x,
            car.y,
            world.x,
            world.y,
        ];
        floats(out, &row);
        out.extend_from_slice(format!("{sensor:08x}{:016x}{index:08x}", sweep.frame).as_bytes());
        match moving {
            true => out.extend_from_slice(format!("{:032x}", p.object_id).as_bytes()),
            false => out.extend_from_slice(&[0; ID_DIGITS as usize]),
        }
        out.push(if moving { label(&p.class) } else { STATIC });
        self.points += 1;
    }

    fn write_tables(&self, path: &Path) -> Result<()> {
        let failed = |e: String| Error::Failed(format!("{}: {e}", path.display()));
        let id = || Datatype::String {
            size: ID_DIGITS,
            padding: StringPadding::NullPad,
            charset: CharacterSet::Ascii,
        };
        let mut radar =
            CompoundTypeBuilder::new().field("timestamp", make_i64_type()).field("sensor_id", make_u8_type());
        for name in
            ["range_sc", "azimuth_sc", "rcs", "vr", "vr_compensated", "x_cc", "y_cc", "x_seq", "y_seq"]
        {
            radar = radar.field(name, make_f32_type());
        }
        let radar =
            radar.field("uuid", id()).field("track_id", id()).field("label_id", make_u8_type()).build();
        let mut odometry = CompoundTypeBuilder::new().field("timestamp", make_i64_type());
        for name in ["x_seq", "y_seq", "yaw_seq", "vx", "yaw_rate"] {
            odometry = odometry.field(name, make_f32_type());
        }
        let odometry = odometry.build();
        let mut file = FileBuilder::new();
        for (name, kind, rows, count) in [
            ("radar_data", radar, &self.radar_data, self.points),
            ("odometry", odometry, &self.odometry, self.odometry_at.len()),
        ] {
            let kind = kind.map_err(|e| failed(e.to_string()))?;
            file.create_dataset(name).with_compound_data(kind, rows.clone(), count as u64);
        }
        let out = File::create(path).map_err(|e| Error::io(path, e))?;
        file.finish_to(BufWriter::new(out)).map_err(|e| failed(e.to_string()))?;
        Ok(())
    }

    /// Times are unique and grow, so neighbours in the list are neighbours in time.
    fn scenes(&self) -> Value {
        let list = &self.measurements;
        let time = |i: Option<usize>| i.map_or(Value::Null, |i| json!(list[i].timestamp));
        let mut scenes = Map::new();
        for (i, m) in list.iter().enumerate() {
            let same = |j: &usize| list[*j].sensor == m.sensor;
            let scene = json!({
                "sensor_id": m.sensor,
                "prev_timestamp": time(i.checked_sub(1)),
                "next_timestamp": time(Some(i + 1).filter(|j| *j < list.len())),
                "prev_timestamp_same_sensor": time((0..i).rev().find(same)),
                "next_timestamp_same_sensor": time((i + 1..list.len()).find(same)),
                "odometry_timestamp": self.odometry_at[m.odometry],
                "odometry_index": m.odometry,
                // There is no camera.
                "image_name": "",
                "radar_indices": m.rows,
            });
            scenes.insert(m.timestamp.to_string(), scene);
        }
        json!({
            "sequence_name": self.name,
            "category": "train",
            "first_timestamp": time(Some(0)),
            "last_timestamp": time(Some(list.len() - 1)),
            "scenes": scenes,
        })
    }
}

fn floats(out: &mut Vec<u8>, row: &[f64]) {
    for x in row {
        out.extend_from_slice(&(*x as f32).to_le_bytes());
    }
}

fn write_json(path: PathBuf, value: &Value) -> Result<()> {
    let text =
        serde_json::to_string_pretty(value).map_err(|e| Error::Failed(format!("{}: {e}", path.display())))?;
    std::fs::write(&path, text + "\n").map_err(|e| Error::io(&path, e))
}

impl Exporter for Sequence {
    fn push(&mut self, sweep: &Sweep) -> Result<()> {
        sweep.check()?;
        self.order.next(sweep)?;
        let sensor = self.sensor(sweep)?;
        let odometry = self.push_odometry(sweep);
        let mut timestamp = sweep.time_ns.div_euclid(1000);
        if let Some(last) = self.measurements.last() {
            timestamp = timestamp.max(last.timestamp + 1);
        }
        let first = self.points;
        for (i, p) in sweep.points.iter().enumerate() {
            self.push_point(sweep, timestamp, sensor, i, p);
        }
        self.measurements.push(Measurement { timestamp, sensor, odometry, rows: [first, self.points] });
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<Finished> {
        let root = self.staged.path().to_path_buf();
        let own = root.join(&self.name);
        if self.measurements.is_empty() {
            return Err(BadInput::new("a RadarScenes sequence has at least one measurement").into());
        }
        std::fs::create_dir_all(&own).map_err(|e| Error::io(&own, e))?;
        self.write_tables(&own.join("radar_data.h5"))?;
        write_json(own.join("scenes.json"), &self.scenes())?;
        let named = |i: usize| format!("radar_{}", i + 1);
        let sensors: Map<String, Value> = self
            .sensors
            .iter()
            .enumerate()
            .map(|(i, (name, [x, y, yaw]))| {
                (named(i), json!({ "id": i + 1, "x": x, "y": y, "yaw": yaw, "name": name }))
            })
            .collect();
        write_json(root.join("sensors.json"), &Value::Object(sensors))?;
        let [first, last] =
            [self.measurements.first(), self.measurements.last()].map(|m| m.map_or(0, |m| m.timestamp));
        let mut sequences = Map::new();
        sequences.insert(
            self.name.clone(),
            json!({
                "category": "train",
                "duration": (last - first) as f64 * 1e-6,
                "n_scenes": self.measurements.len(),
                "sensors": (0..self.sensors.len()).map(named).collect::<Vec<_>>(),
            }),
        );
        write_json(root.join("sequences.json"), &json!({ "sequences": sequences }))?;
        write_json(
            root.join(MANIFEST),
            &json!({ "catseye": env!("CARGO_PKG_VERSION"), "format": "RadarScenes", "sequence": self.name }),
        )?;
        let mut notes = vec!["no camera images: image_name is empty".to_string()];
        if self.points == 0 {
            notes.push("no sweep has points: radar_data is empty".into());
        }
        let (sweeps, points) = (self.measurements.len(), self.points);
        Ok(Finished { output: self.staged.commit()?, sweeps, points, notes })
    }
}

#[cfg(test)]
mod tests {
    use super::super::samples;
    use super::*;

    fn write(folder: &Path, sweeps: &[Sweep]) -> Result<Finished> {
        let mut s = Box::new(Sequence::create(folder, "sequence_1", true)?);
        for sweep in sweeps {
            s.push(sweep)?;
        }
        s.finish()
    }

    #[test]
    fn rows_and_scenes() {
        let t = tempfile::tempdir().unwrap();
        let sweeps = samples::sweeps();
        let done = write(&t.path().join("out"), &sweeps).unwrap();
        assert_eq!((done.sweeps, done.points), (4, 15));
        let file = hdf5_pure::File::open_streaming(done.output.join("sequence_1/radar_data.h5")).unwrap();
        assert_eq!(file.dataset("radar_data").unwrap().shape().unwrap(), [15]);
        assert_eq!(file.dataset("odometry").unwrap().shape().unwrap(), [2]);
        let rows = file.dataset("radar_data").unwrap().read_raw_rows(0, 15).unwrap();
        let size = 8 + 1 + 9 * 4 + 2 * 32 + 1;
        assert_eq!(rows.len(), 15 * size);
        // vr of the third point, a rail, and over the ground.
        let vr = |row: usize, field: usize| {
            let at = row * size + 9 + 4 * field;
            f32::from_le_bytes(rows[at..at + 4].try_into().unwrap())
        };
        assert_eq!(vr(2, 3), sweeps[0].points[2].range_rate_mps as f32);
        assert!(vr(2, 3) < -5.0 && vr(2, 4).abs() < 1e-5);
        // Labels: car, truck, and three that do not move, or not by themselves.
        let labels: Vec<u8> = (0..5).map(|i| rows[(i + 1) * size - 1]).collect();
        assert_eq!(labels, [0, 2, 11, 11, 11]);
        let text = std::fs::read_to_string(done.output.join("sequence_1/scenes.json")).unwrap();
        let scenes: Value = serde_json::from_str(&text).unwrap();
        let second = &scenes["scenes"]["1000001"];
        assert_eq!(second["sensor_id"], 2);
        assert_eq!(second["radar_indices"], json!([5, 10]));
        assert_eq!(second["next_timestamp_same_sensor"], 1_050_001);
        assert_eq!(second["prev_timestamp_same_sensor"], Value::Null);
        assert_eq!(scenes["scenes"]["1050001"]["radar_indices"], json!([15, 15]));
    }

    #[test]
    fn nothing_and_too_many() {
        let t = tempfile::tempdir().unwrap();
        assert_eq!(write(&t.path().join("none"), &[]).unwrap_err().exit_code(), 2);
        assert!(!t.path().join("none").exists());
        let five: Vec<Sweep> = (0..5).map(|i| samples::empty(&format!("r{i}"), 0, 0)).collect();
        let e = write(&t.path().join("five"), &five).unwrap_err();
        assert!(e.to_string().contains("up to 4"), "{e}");
        let done = write(&t.path().join("empty"), &five[..1]).unwrap();
        assert_eq!(done.notes.len(), 2);
    }
}
