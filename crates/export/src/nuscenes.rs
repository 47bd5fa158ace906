//! A whole nuScenes data set of one scene: the thirteen tables of nuScenes' schema as JSON in the folder [`VERSION`], radar point
//! clouds as `pcd` writes them in `samples/CHANNEL` and `sweeps/CHANNEL`, and a picture of the drivable lanes in
//! `maps`. `NuScenes(version="v1.0-catseye", dataroot=FOLDER)` of nuscenes-devkit opens it.
//!
//! | what nuScenes asks for | what stands there |
//! |---|---|
//! | channel | `RADAR_` and the radar's name in capitals; `LIDAR_TOP` for the ideal lidar, where the run has its points (five float32 each: x, y, z in the lidar's axes, 255 times the cosine of the angle of incidence as intensity, and the channel as ring) |
//! | sample (key frame) | the first frame, then the first one [`Settings::key_interval_s`] after the key frame before, and the last frame |
//! | time | microseconds from the start of the run, as if it had started on 1 January 1970 |
//! | global coordinates | the world of the run, moved by whole metres along x and y so that nothing is negative, as the picture of the map needs it (`world_offset_m` of `manifest.json`) |
//! | category | nuScenes' name for each road user; things beside the road and trains have none and are left out |
//! | attribute | `vehicle.moving` or `vehicle.stopped`, `pedestrian.moving` or `pedestrian.standing`, `cycle.with_rider` or `cycle.without_rider` |
//! | visibility | the share of the box that no other road user's box hides from the frame's first radar |
//! | num_radar_pts | the points of all radars in the key frame that lie in the box |
//! | num_lidar_pts | the points of the lidar in the key frame that lie in the box |
//! | prev, next | the same instance in the key frame before and after |

use super::class::{RoadUser, road_user};
use super::map_mask::{Lattice, within};
use super::{Exporter, Finished, LidarCloud, Order, Sweep, SweepBox, check_name, occlusion, pcd};
use catseye::base::error::{BadInput, Error, Result};
use catseye::base::frames::{Pose, Sensor, Vehicle, World};
use catseye::formats::stage::{MANIFEST, StagedDir, sha256_of_bytes};
use glam::{DVec2, DVec3, IVec2};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// The folder of the tables, and the version that readers are to be told.
pub const VERSION: &str = "v1.0-catseye";
/// Mountings that differ by less are the same, m and in the quaternion.
const SAME_MOUNTING: f64 = 1e-6;
/// Room around all that a map shows, m.
const MARGIN_M: f64 = 10.0;
/// Channel of the lidar, as the tools of nuScenes know it.
const LIDAR: &str = "LIDAR_TOP";
/// Surfaces of an object lie on the faces of its box, where rounding decides; so far outside a lidar point still counts, m.
const ON_FACE_M: f64 = 1e-6;

/// What a data set is called, and which frames are its samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Name of the scene: letters, digits, `_` and `-`. Tokens are made from it, so that scenes of different names can be joined.
    pub scene: String,
    /// Time between key frames, s; 0 makes every frame one. nuScenes has 0.5.
    pub key_interval_s: f64,
}

/// A sweep's record, as far as it is known when the sweep comes.
struct Record {
    frame: u64,
    channel: String,
    time_us: i64,
    /// Name of the file without its folder.
    file: String,
    mounting: usize,
    vehicle_in_world: Pose<Vehicle, World>,
}

struct Frame {
    time_us: i64,
    key: bool,
    boxes: Vec<Annotation>,
}

struct Annotation {
    seen: SweepBox,
    category: &'static str,
    attribute: Option<&'static str>,
    visibility: &'static str,
    radar_points: usize,
    lidar_points: usize,
}

impl Annotation {
    /// Whether a place of the world, m, lies in the box, or outside it by no more than `slack_m`.
    fn holds(&self, place_m: DVec3, slack_m: f64) -> bool {
        let place = self.seen.rotation.inverse() * (place_m - self.seen.centre_m);
        place.abs().cmple(0.5 * self.seen.size_m + slack_m).all()
    }
}

/// A data set of one scene under construction.
pub struct Tables {
    staged: StagedDir,
    settings: Settings,
    order: Order,
    records: Vec<Record>,
    frames: BTreeMap<u64, Frame>,
    /// Frames in the order of time.
    arrived: Vec<u64>,
    /// Radars by their channels.
    channels: BTreeMap<String, String>,
    mountings: Vec<(String, Pose<Sensor, Vehicle>)>,
    lattice: Lattice,
    points: usize,
    empty: usize,
    left_out: usize,
}

impl Tables {
    /// Begins a data set.
    ///
    /// # Errors
    /// Returns `BadInput` for a scene's name that is no file name, for an interval that is negative or no number, and if the
    /// folder already exists and `force` is not given ([`StagedDir::new`]).
    pub fn create(folder: &Path, settings: Settings, force: bool) -> Result<Tables> {
        check_name("scene", &settings.scene)?;
        let interval = settings.key_interval_s;
        if !(interval.is_finite() && interval >= 0.0) {
            return Err(BadInput::new("is out of range")
                .key("key_interval_s")
                .value(interval)
                .allowed("0 s or more")
                .into());
        }
        Ok(Tables {
            staged: StagedDir::new(folder, force, "nuscenes")?,
            settings,
            order: Order::default(),
            records: Vec::new(),
            frames: BTreeMap::new(),
            arrived: Vec::new(),
            channels: BTreeMap::new(),
            mountings: Vec::new(),
            lattice: Lattice::default(),
            points: 0,
            empty: 0,
            left_out: 0,
        })
    }

    /// 32 hexadecimal digits that are always the same for the same thing of the same scene.
    fn token(&self, table: &str, what: impl std::fmt::Display) -> String {
        let text = format!("{}/{table}/{what}", self.settings.scene);
        sha256_of_bytes(text.as_bytes()).chars().take(32).collect()
    }

    /// The channel of a radar; two radars never share one.
    fn channel(&mut self, radar: &str) -> Result<String> {
        let name = radar.to_uppercase().replace('-', "_");
        let channel = if name.starts_with("RADAR") { name } else { format!("RADAR_{name}") };
        let owner = self.channels.entry(channel.clone()).or_insert_with(|| radar.into());
        if owner != radar {
            return Err(BadInput::new(format!("would have the same channel {channel} as radar '{owner}'"))
                .key("radar")
                .value(radar)
                .remedy("give the radars names that differ in more than capitals and hyphens")
                .into());
        }
        Ok(channel)
    }

    fn mounting(&mut self, channel: &str, pose: &Pose<Sensor, Vehicle>) -> usize {
        let same = |(of, other): &(String, Pose<Sensor, Vehicle>)| {
            let moved = (other.translation_m - pose.translation_m).abs().max_element();
            // A quaternion and its negative turn alike.
            let turned = 1.0 - other.rotation.dot(pose.rotation).abs();
            of == channel && moved < SAME_MOUNTING && turned < SAME_MOUNTING * SAME_MOUNTING
        };
        self.mountings.iter().position(same).unwrap_or_else(|| {
            self.mountings.push((channel.into(), *pose));
            self.mountings.len() - 1
        })
    }

    /// The frame of a sweep, which its first sweep begins. Boxes are kept of key frames, and of the latest frame, which may become one.
    fn begin_frame(&mut self, sweep: &Sweep, time_us: i64) -> Result<()> {
        if self.frames.contains_key(&sweep.frame) {
            return Ok(());
        }
        let last_key = self.arrived.iter().rev().filter_map(|f| self.frames.get(f)).find(|f| f.key);
        // Half a microsecond, to which times are rounded, is no reason to wait for the next frame.
        let due = |last: i64| (time_us - last) as f64 >= self.settings.key_interval_s * 1e6 - 1.0;
        let key = last_key.is_none_or(|f| due(f.time_us));
        if let Some(before) = self.arrived.last().and_then(|f| self.frames.get_mut(f))
            && !before.key
        {
            before.boxes.clear();
        }
        let eye = sweep.sensor_in_world().translation_m;
        let mut boxes = Vec::new();
        for (i, b) in sweep.boxes.iter().enumerate() {
            let Some(category) = category(&b.class) else {
                self.left_out += 1;
                continue;
            };
            within(b.centre_m)?;
            let visibility = match occlusion::share_seen(&sweep.boxes, i, eye) {
                share if share < 0.4 => "1",
                share if share < 0.6 => "2",
                share if share < 0.8 => "3",
                _ => "4",
            };
            let attribute = attribute(b);
            boxes.push(Annotation {
                seen: b.clone(),
                category,
                attribute,
                visibility,
                radar_points: 0,
                lidar_points: 0,
            });
        }
        self.frames.insert(sweep.frame, Frame { time_us, key, boxes });
        self.arrived.push(sweep.frame);
        Ok(())
    }

    /// Writes the lidar's points of a frame, once for all of its radars, and counts those in the boxes.
    fn push_lidar(&mut self, sweep: &Sweep, lidar: &LidarCloud, time_us: i64, key: bool) -> Result<()> {
        let mut this = self.records.iter().rev().take_while(|r| r.frame == sweep.frame);
        if this.any(|r| r.channel == LIDAR) {
            return Ok(());
        }
        let in_world = lidar.in_vehicle.then(&sweep.vehicle_in_world);
        if let Some(frame) = self.frames.get_mut(&sweep.frame) {
            let points: Vec<DVec3> = lidar.points.iter().map(|p| in_world.point(p.position_m)).collect();
            for a in &mut frame.boxes {
                a.lidar_points = points.iter().filter(|p| a.holds(**p, ON_FACE_M)).count();
            }
        }
        self.channels.insert(LIDAR.into(), "lidar".into());
        let record = Record {
            frame: sweep.frame,
            file: format!("{}__{LIDAR}__{time_us:016}.pcd.bin", self.settings.scene),
            time_us,
            mounting: self.mounting(LIDAR, &lidar.in_vehicle),
            vehicle_in_world: sweep.vehicle_in_world,
            channel: LIDAR.into(),
        };
        let values = lidar.points.iter().flat_map(|p| {
            let [x, y, z] = p.position_m.to_array();
            [x, y, z, 255.0 * p.cos_incidence, f64::from(p.channel)]
        });
        let bytes: Vec<u8> = values.flat_map(|x| (x as f32).to_le_bytes()).collect();
        let path = self.staged.path().join(self.file_name(&record, if key { "samples" } else { "sweeps" }));
        make_folder_of(&path)?;
        fs::write(&path, bytes).map_err(|e| Error::io(&path, e))?;
        self.records.push(record);
        Ok(())
    }

    fn file_name(&self, record: &Record, folder: &str) -> String {
        format!("{folder}/{}/{}", record.channel, record.file)
    }

    /// The last frame becomes a key frame, so that every sweep lies between two of them.
    fn end_with_key_frame(&mut self) -> Result<()> {
        let Some(frame) = self.arrived.last().copied() else { return Ok(()) };
        let Some(last) = self.frames.get_mut(&frame).filter(|f| !f.key) else { return Ok(()) };
        last.key = true;
        for record in self.records.iter().filter(|r| r.frame == frame) {
            let [from, to] =
                ["sweeps", "samples"].map(|folder| self.staged.path().join(self.file_name(record, folder)));
            make_folder_of(&to)?;
            fs::rename(&from, &to).map_err(|e| Error::io(&from, e))?;
        }
        Ok(())
    }

    /// Whole metres by which the world is moved, and the width and height of its map, m.
    fn offset(&self) -> (IVec2, [u32; 2]) {
        let mut low = DVec2::splat(f64::INFINITY);
        let mut high = DVec2::splat(f64::NEG_INFINITY);
        let places = self.records.iter().map(|r| r.vehicle_in_world.translation_m.truncate());
        let boxes = self.frames.values().filter(|f| f.key).flat_map(|f| &f.boxes);
        let lanes = self.lattice.extent_m();
        for p in places
            .chain(boxes.map(|a| a.seen.centre_m.truncate()))
            .chain(lanes.into_iter().flat_map(|(low, high)| [low, high]))
        {
            (low, high) = (low.min(p), high.max(p));
        }
        if !low.is_finite() {
            return (IVec2::ZERO, [1, 1]);
        }
        let offset = (MARGIN_M - low).floor().max(DVec2::ZERO);
        let size = (high + offset + MARGIN_M).ceil();
        (offset.as_ivec2(), [size.x as u32, size.y as u32])
    }
}

fn make_folder_of(path: &Path) -> Result<()> {
    match path.parent() {
        Some(folder) => fs::create_dir_all(folder).map_err(|e| Error::io(folder, e)),
        None => Ok(()),
    }
}

/// nuScenes' category of a class; None for what nuScenes does not annotate.
fn category(class: &str) -> Option<&'static str> {
    if class == "trailer" || class.starts_with("trailer.") {
        return Some("vehicle.trailer");
    }
    Some(match road_user(class)? {
        RoadUser::Car | RoadUser::Van => "vehicle.car",
        RoadUser::Truck => "vehicle.truck",
        RoadUser::Bus => "vehicle.bus.rigid",
        RoadUser::Motorcycle => "vehicle.motorcycle",
        RoadUser::Cyclist => "vehicle.bicycle",
        RoadUser::Pedestrian => "human.pedestrian.adult",
        RoadUser::Animal => "animal",
        RoadUser::Train => return None,
    })
}

/// Categories and what they are, for the table.
const CATEGORIES: [(&str, &str); 8] = [
    ("animal", "An animal."),
    ("human.pedestrian.adult", "A pedestrian."),
    ("vehicle.bicycle", "A bicycle, with its rider if it has one."),
    ("vehicle.bus.rigid", "A bus or coach."),
    ("vehicle.car", "A passenger car or van."),
    ("vehicle.motorcycle", "A motorcycle."),
    ("vehicle.trailer", "A trailer."),
    ("vehicle.truck", "A truck."),
];

/// Attributes and what they are, for the table.
const ATTRIBUTES: [(&str, &str); 6] = [
    ("vehicle.moving", "The vehicle moves over the ground."),
    ("vehicle.stopped", "The vehicle stands; the simulation does not distinguish parked ones."),
    ("cycle.with_rider", "A rider sits on it."),
    ("cycle.without_rider", "Nobody sits on it."),
    ("pedestrian.moving", "The pedestrian walks."),
    ("pedestrian.standing", "The pedestrian stands."),
];

/// Levels of visibility: token, level, and what it is.
const VISIBILITIES: [(&str, &str, &str); 4] = [
    ("1", "v0-40", "visibility of the whole object is between 0 and 40%"),
    ("2", "v40-60", "visibility of the whole object is between 40 and 60%"),
    ("3", "v60-80", "visibility of the whole object is between 60 and 80%"),
    ("4", "v80-100", "visibility of the whole object is between 80 and 100%"),
];

/// What the object does; None where nothing is known of it.
fn attribute(b: &SweepBox) -> Option<&'static str> {
    let by_motion = |moving, standing| Some(if b.moving { moving } else { standing });
    match road_user(&b.class)? {
        RoadUser::Car | RoadUser::Van | RoadUser::Truck | RoadUser::Bus => {
            by_motion("vehicle.moving", "vehicle.stopped")
        }
        RoadUser::Pedestrian => by_motion("pedestrian.moving", "pedestrian.standing"),
        RoadUser::Cyclist if b.class.starts_with("cyclist") => Some("cycle.with_rider"),
        RoadUser::Cyclist | RoadUser::Motorcycle if b.moving => Some("cycle.with_rider"),
        RoadUser::Cyclist => Some("cycle.without_rider"),
        RoadUser::Motorcycle | RoadUser::Animal | RoadUser::Train => None,
    }
}

/// Translation and rotation (w, x, y, z), after a move.
fn placed(translation_m: DVec3, rotation: glam::DQuat, offset: IVec2) -> [Value; 2] {
    let moved = translation_m + offset.as_dvec2().extend(0.0);
    let q = rotation;
    [json!(moved.to_array()), json!([q.w, q.x, q.y, q.z])]
}

impl Exporter for Tables {
    fn push(&mut self, sweep: &Sweep) -> Result<()> {
        self.order.next(sweep)?;
        let bytes = pcd::bytes(sweep)?;
        let time_us = sweep.time_ns.div_euclid(1000);
        let channel = self.channel(&sweep.radar)?;
        within(sweep.vehicle_in_world.translation_m)?;
        self.begin_frame(sweep, time_us)?;
        let record = Record {
            frame: sweep.frame,
            file: format!("{}__{channel}__{time_us:016}.pcd", self.settings.scene),
            time_us,
            mounting: self.mounting(&channel, &sweep.sensor_in_vehicle),
            vehicle_in_world: sweep.vehicle_in_world,
            channel,
        };
        let mut key = false;
        if let Some(frame) = self.frames.get_mut(&sweep.frame) {
            key = frame.key;
            let pose = sweep.sensor_in_world();
            let points: Vec<DVec3> = sweep.points.iter().map(|p| pose.point(p.position_m)).collect();
            for a in &mut frame.boxes {
                a.radar_points += points.iter().filter(|p| a.holds(**p, 0.0)).count();
            }
        }
        for area in &sweep.drivable {
            self.lattice.add(area)?;
        }
        let again = self.records.iter().rev().take_while(|r| r.time_us == time_us);
        if again.chain(self.records.last()).any(|r| r.channel == record.channel && r.time_us == time_us) {
            return Err(Error::Failed(format!(
                "frame {} of radar {} occurs twice",
                sweep.frame, sweep.radar
            )));
        }
        let path = self.staged.path().join(self.file_name(&record, if key { "samples" } else { "sweeps" }));
        make_folder_of(&path)?;
        fs::write(&path, bytes).map_err(|e| Error::io(&path, e))?;
        self.points += sweep.points.len();
        self.empty += usize::from(sweep.points.is_empty());
        self.records.push(record);
        match &sweep.lidar {
            Some(lidar) => self.push_lidar(sweep, lidar, time_us, key),
            None => Ok(()),
        }
    }

    fn finish(mut self: Box<Self>) -> Result<Finished> {
        self.end_with_key_frame()?;
        let keys: Vec<u64> =
            self.arrived.iter().copied().filter(|f| self.frames.get(f).is_some_and(|f| f.key)).collect();
        let (Some(first), Some(last)) = (keys.first(), keys.last()) else {
            return Err(BadInput::new("a scene of nuScenes needs at least one frame")
                .file(self.staged.final_path())
                .key("sweeps")
                .value(0)
                .into());
        };
        let (offset, [width_m, height_m]) = self.offset();
        let mask = self.lattice.mask(offset, width_m, height_m);
        let map = format!("maps/{}.png", self.token("map", "picture"));
        let path = self.staged.path().join(&map);
        make_folder_of(&path)?;
        mask.picture.save(&path).map_err(|e| Error::Failed(format!("{}: {e}", path.display())))?;

        let sample = |frame: &u64| self.token("sample", frame);
        // The key frame that a sweep leads to.
        let mut next_key = keys.iter().copied().peekable();
        let mut leads_to: BTreeMap<u64, u64> = BTreeMap::new();
        for frame in &self.arrived {
            if let Some(key) = next_key.peek() {
                leads_to.insert(*frame, *key);
                next_key.next_if_eq(frame);
            }
        }
        let neighbours = |tokens: &[String], i: usize| {
            let at = |j: Option<usize>| j.and_then(|j| tokens.get(j)).cloned().unwrap_or_default();
            (at(i.checked_sub(1)), at(i.checked_add(1)))
        };

        let mut tables: Vec<(&str, Vec<Value>)> = Vec::new();
        let log = self.token("log", "");
        let scene = self.token("scene", "");
        tables.push((
            "log",
            vec![json!({
                "token": log, "logfile": self.settings.scene, "vehicle": "catseye", "date_captured": "1970-01-01",
                "location": "simulation",
            })],
        ));
        tables.push((
            "scene",
            vec![json!({
                "token": scene, "log_token": log, "nbr_samples": keys.len(), "first_sample_token": sample(first),
                "last_sample_token": sample(last), "name": self.settings.scene, "description": "Simulated by catseye",
            })],
        ));
        tables.push((
            "map",
            vec![json!({
                "token": self.token("map", ""), "log_tokens": [log], "category": "semantic_prior", "filename": map,
            })],
        ));
        let named = |table: &str, rows: &[(&str, &str)]| -> Vec<Value> {
            rows.iter()
                .map(|(name, about)| {
                    json!({ "token": self.token(table, name), "name": name, "description": about })
                })
                .collect()
        };
        let mut categories = named("category", &CATEGORIES);
        for (row, index) in categories.iter_mut().zip(1u32..) {
            row["index"] = json!(index);
        }
        tables.push(("category", categories));
        tables.push(("attribute", named("attribute", &ATTRIBUTES)));
        let levels = VISIBILITIES.iter();
        tables.push((
            "visibility",
            levels
                .map(|(token, level, about)| json!({ "token": token, "level": level, "description": about }))
                .collect(),
        ));
        tables.push((
            "sensor",
            self.channels
                .keys()
                .map(|c| {
                    let modality = if c == LIDAR { "lidar" } else { "radar" };
                    json!({ "token": self.token("sensor", c), "channel": c, "modality": modality })
                })
                .collect(),
        ));
        let calibration = |i: usize| self.token("calibrated_sensor", i);
        let mountings = self.mountings.iter().enumerate();
        tables.push((
            "calibrated_sensor",
            mountings
                .map(|(i, (channel, pose))| {
                    let [translation, rotation] = placed(pose.translation_m, pose.rotation, IVec2::ZERO);
                    json!({
                        "token": calibration(i), "sensor_token": self.token("sensor", channel),
                        "translation": translation, "rotation": rotation, "camera_intrinsic": [],
                    })
                })
                .collect(),
        ));

        let key_tokens: Vec<String> = keys.iter().map(sample).collect();
        let mut samples = Vec::new();
        // Key frames of each object, in the order of time.
        let mut instances: BTreeMap<u32, Vec<(u64, &Annotation)>> = BTreeMap::new();
        for (i, frame) in keys.iter().enumerate() {
            let Some(f) = self.frames.get(frame) else { continue };
            let (prev, next) = neighbours(&key_tokens, i);
            samples.push(json!({
                "token": key_tokens[i], "timestamp": f.time_us, "prev": prev, "next": next, "scene_token": scene,
            }));
            for a in &f.boxes {
                instances.entry(a.seen.id).or_default().push((*frame, a));
            }
        }
        tables.push(("sample", samples));

        let mut by_channel: BTreeMap<&str, Vec<&Record>> = BTreeMap::new();
        for record in &self.records {
            by_channel.entry(&record.channel).or_default().push(record);
        }
        let (mut data, mut poses) = (Vec::new(), Vec::new());
        for (channel, records) in &by_channel {
            let tokens: Vec<String> = records
                .iter()
                .map(|r| self.token("sample_data", format!("{channel}/{}", r.time_us)))
                .collect();
            for (i, r) in records.iter().enumerate() {
                let key = self.frames.get(&r.frame).is_some_and(|f| f.key);
                let (prev, next) = neighbours(&tokens, i);
                let pose = self.token("ego_pose", &tokens[i]);
                let to = leads_to.get(&r.frame).unwrap_or(last);
                data.push(json!({
                    "token": tokens[i], "sample_token": sample(to), "ego_pose_token": pose,
                    "calibrated_sensor_token": calibration(r.mounting), "timestamp": r.time_us, "fileformat": "pcd",
                    "is_key_frame": key, "height": 0, "width": 0, "prev": prev, "next": next,
                    "filename": self.file_name(r, if key { "samples" } else { "sweeps" }),
                }));
                let [translation, rotation] =
                    placed(r.vehicle_in_world.translation_m, r.vehicle_in_world.rotation, offset);
                poses.push(json!({
                    "token": pose, "timestamp": r.time_us, "rotation": rotation, "translation": translation,
                }));
            }
        }
        tables.push(("sample_data", data));
        tables.push(("ego_pose", poses));

        let (mut things, mut annotations) = (Vec::new(), Vec::new());
        for (id, of) in &instances {
            let instance = self.token("instance", id);
            let tokens: Vec<String> = of
                .iter()
                .map(|(frame, _)| self.token("sample_annotation", format!("{id}/{frame}")))
                .collect();
            let Some((_, any)) = of.first() else { continue };
            things.push(json!({
                "token": instance, "category_token": self.token("category", any.category), "nbr_annotations": of.len(),
                "first_annotation_token": tokens.first(), "last_annotation_token": tokens.last(),
            }));
            for (i, (frame, a)) in of.iter().enumerate() {
                let (prev, next) = neighbours(&tokens, i);
                let [translation, rotation] = placed(a.seen.centre_m, a.seen.rotation, offset);
                let attributes: Vec<String> =
                    a.attribute.iter().map(|name| self.token("attribute", name)).collect();
                annotations.push(json!({
                    "token": tokens[i], "sample_token": sample(frame), "instance_token": instance,
                    "visibility_token": a.visibility, "attribute_tokens": attributes, "translation": translation,
                    "size": [a.seen.size_m.y, a.seen.size_m.x, a.seen.size_m.z], "rotation": rotation, "prev": prev,
                    "next": next, "num_lidar_pts": a.lidar_points, "num_radar_pts": a.radar_points,
                }));
            }
        }
        tables.push(("instance", things));
        tables.push(("sample_annotation", annotations));

        let write = |name: String, value: &Value| -> Result<()> {
            let path = self.staged.path().join(name);
            make_folder_of(&path)?;
            let text =
                serde_json::to_string_pretty(value).map_err(|e| Error::Failed(format!("tables: {e}")))?;
            fs::write(&path, text + "\n").map_err(|e| Error::io(&path, e))
        };
        for (name, rows) in tables {
            write(format!("{VERSION}/{name}.json"), &Value::Array(rows))?;
        }
        let offset_m = [offset.x, offset.y, 0];
        write(
            MANIFEST.into(),
            &json!({
                "catseye": env!("CARGO_PKG_VERSION"),
                "format": "nuScenes tables v1.0",
                "version": VERSION,
                "about": "translations in the tables are those of the run's world plus world_offset_m",
                "world_offset_m": offset_m,
                "map_resolution_m": mask.step_m,
            }),
        )?;
        let mut notes = vec![format!(
            "open it with version {VERSION}; {} of {} frames are samples",
            keys.len(),
            self.arrived.len()
        )];
        if offset != IVec2::ZERO {
            notes.push(format!("the world is moved by {offset_m:?} m, since nuScenes' maps begin at 0"));
        }
        if mask.step_m > super::map_mask::STEP_M {
            notes.push(format!("the map is large: open it with map_resolution={}", mask.step_m));
        }
        if self.left_out > 0 {
            notes.push("objects without a nuScenes category are left out".into());
        }
        if self.empty > 0 {
            notes.push(format!(
                "{} sweeps without points are clouds of one point of NaN, which the reader takes as empty",
                self.empty
            ));
        }
        // Sweeps are those of radars; a frame's lidar belongs to each of them.
        let sweeps = self.records.iter().filter(|r| r.channel != LIDAR).count();
        Ok(Finished { output: self.staged.commit()?, sweeps, points: self.points, notes })
    }
}

#[cfg(test)]
mod tests {
    use super::super::samples;
    use super::*;

    fn settings(key_interval_s: f64) -> Settings {
        Settings { scene: "scene-1".into(), key_interval_s }
    }

    fn table(folder: &Path, name: &str) -> Vec<Value> {
        let text = fs::read(folder.join(VERSION).join(format!("{name}.json"))).unwrap();
        serde_json::from_slice(&text).unwrap()
    }

    /// Ten frames of one radar, 0.2 s apart.
    fn written(folder: &Path, interval_s: f64) {
        let mut tables = Tables::create(folder, settings(interval_s), false).unwrap();
        for i in 0..10u64 {
            let mut s = samples::empty("front", i, i as i64 * 200_000_000);
            let about = &samples::sweeps()[0].boxes[0];
            s.boxes = vec![SweepBox { centre_m: DVec3::new(i as f64, -40.0, 0.0), ..about.clone() }];
            tables.push(&s).unwrap();
        }
        Box::new(tables).finish().unwrap();
    }

    #[test]
    fn key_frames_and_the_sweeps_between_them() {
        let t = tempfile::tempdir().unwrap();
        let folder = t.path().join("out");
        written(&folder, 0.5);
        let samples = table(&folder, "sample");
        // At 0, 0.6, 1.2 and 1.8 s, the last of which ends the run too.
        let times: Vec<i64> = samples.iter().map(|s| s["timestamp"].as_i64().unwrap()).collect();
        assert_eq!(times, [0, 600_000, 1_200_000, 1_800_000]);
        for s in table(&folder, "sample_data") {
            let of = samples.iter().find(|x| x["token"] == s["sample_token"]).unwrap();
            let (time, key) = (s["timestamp"].as_i64().unwrap(), of["timestamp"].as_i64().unwrap());
            assert!(key >= time && key - time < 600_000, "{time} {key}");
            assert_eq!(s["is_key_frame"].as_bool().unwrap(), key == time);
            let file = s["filename"].as_str().unwrap();
            assert!(folder.join(file).is_file() && file.starts_with("samples/") == (key == time), "{file}");
        }
        assert_eq!(table(&folder, "sample_annotation").len(), 4);
        assert_eq!(table(&folder, "instance")[0]["nbr_annotations"], 4);
        // The world is moved by whole metres, so that the box at y = -40 m comes to 10 m.
        assert_eq!(table(&folder, "sample_annotation")[0]["translation"], json!([10.0, 10.0, 0.0]));

        let every = t.path().join("every");
        written(&every, 0.0);
        assert_eq!(table(&every, "sample").len(), 10);
        assert!(!every.join("sweeps").exists());
        // An interval that nothing comes up to: the first frame and the last.
        let ends = t.path().join("ends");
        written(&ends, 99.0);
        assert_eq!((table(&ends, "sample").len(), table(&ends, "sample_annotation").len()), (2, 2));
    }

    #[test]
    fn refused_and_nothing_left() {
        let t = tempfile::tempdir().unwrap();
        let folder = t.path().join("out");
        for bad in
            [settings(f64::NAN), settings(-1.0), Settings { scene: "../x".into(), key_interval_s: 0.5 }]
        {
            assert_eq!(Tables::create(&folder, bad, false).err().unwrap().exit_code(), 2);
        }
        let mut tables = Tables::create(&folder, settings(0.5), false).unwrap();
        tables.push(&samples::empty("front-left", 0, 0)).unwrap();
        let e = tables.push(&samples::empty("FRONT_LEFT", 0, 0)).unwrap_err();
        assert!(e.exit_code() == 2 && e.to_string().contains("RADAR_FRONT_LEFT"), "{e}");
        assert!(tables.push(&samples::empty("front-left", 0, 0)).unwrap_err().to_string().contains("twice"));
        drop(tables);
        let none = Box::new(Tables::create(&folder, settings(0.5), false).unwrap());
        assert_eq!(none.finish().unwrap_err().exit_code(), 2);
        let mut far = samples::empty("front", 0, 0);
        far.vehicle_in_world.translation_m.x = 1e9;
        let mut tables = Tables::create(&folder, settings(0.5), false).unwrap();
        assert_eq!(tables.push(&far).unwrap_err().exit_code(), 2);
        drop(tables);
        assert_eq!(fs::read_dir(t.path()).unwrap().count(), 0);
    }

    #[test]
    fn every_road_user_has_its_rows() {
        for class in [
            "car",
            "van.wheel",
            "truck",
            "trailer",
            "bus",
            "motorcycle",
            "cyclist",
            "bicycle",
            "pedestrian",
            "animal",
        ] {
            let name = category(class).unwrap();
            assert!(CATEGORIES.iter().any(|(c, _)| *c == name), "{class}");
            for moving in [false, true] {
                let b = SweepBox { class: class.into(), moving, ..samples::sweeps()[0].boxes[0].clone() };
                let of = attribute(&b);
                assert!(of.is_none_or(|name| ATTRIBUTES.iter().any(|(a, _)| *a == name)), "{class}");
            }
        }
        assert_eq!((category("guard_rail"), category("tram")), (None, None));
    }
}
