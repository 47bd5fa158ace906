//! MCAP recordings (<https://mcap.dev/spec>) with Foxglove's message types in protobuf, which Foxglove, Lichtblick and Rerun show
//! as they are.
//!
//! | topic | message |
//! |---|---|
//! | `/RADAR/points` | `foxglove.PointCloud` in the radar's frame: f32 `x y z` (m), `velocity` (range rate, m/s, positive receding), `rcs` (dBsm), `snr` (dB), u32 `object_id`, u8 `ghost` |
//! | `/RADAR/range_doppler` | `foxglove.CompressedImage`, a grey PNG of the map in dB |
//! | `/tf` | `foxglove.FrameTransforms`: `world` to `vehicle` to `RADAR` |
//! | `/truth` | `foxglove.SceneUpdate`: boxes in the world, lane lines in the vehicle's frame |
//!
//! The picture has range along x and range rate upwards, its highest in the top row. White (255) is the level given to
//! [`Recording::create`], each grey level below is [`DB_PER_LEVEL`] less, and 0 is that or less; the metadata record `range_doppler`
//! of the file says so, with the axes of each radar.
//!
//! Times are those of the run. The bytes depend on the sweeps alone.

mod messages;

use super::class::{RoadUser, road_user};
use super::{Exporter, Finished, Order, PowerImage, Sweep, SweepBox};
use ::mcap::records::{MessageHeader, Metadata};
use ::mcap::write::{WriteOptions, Writer};
use catseye::base::error::{BadInput, Error, Result};
use catseye::base::units::dbm_from_w;
use catseye::formats::stage::StagedFile;
use glam::{DQuat, DVec3};
use image::ImageEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use messages::{
    Color, CompressedImage, CubePrimitive, FrameTransform, FrameTransforms, KeyValuePair, LinePrimitive,
    PackedElementField, PointCloud, Pose, SceneEntity, SceneEntityDeletion, SceneUpdate, Timestamp,
};
use prost::Message;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// dB between two levels of grey.
pub const DB_PER_LEVEL: f64 = 0.5;

const WORLD: &str = "world";
const VEHICLE: &str = "vehicle";
/// Values of `PackedElementField.NumericType`.
const UINT8: i32 = 1;
const UINT32: i32 = 5;
const FLOAT32: i32 = 7;
/// `SceneEntityDeletion.Type.ALL`.
const ALL: i32 = 1;
/// Bytes of a point, a multiple of four.
const STRIDE: u32 = 32;
/// How wide lane lines are drawn (0.15 m is the narrow line of the German rules RMS for motorways).
const LINE_WIDTH_M: f64 = 0.15;

/// One of Foxglove's message schemas (<https://docs.foxglove.dev/docs/sdk/schemas>): its name, and the serialised `FileDescriptorSet` of
/// the message and all that it holds, with which any reader can take its messages apart. The tests in `python/tests/readers` compare
/// them with the published package `foxglove-schemas-protobuf`.
type Schema = (&'static str, &'static [u8]);

const POINT_CLOUD: Schema = ("foxglove.PointCloud", include_bytes!("foxglove/PointCloud.binpb"));
const COMPRESSED_IMAGE: Schema =
    ("foxglove.CompressedImage", include_bytes!("foxglove/CompressedImage.binpb"));
const FRAME_TRANSFORMS: Schema =
    ("foxglove.FrameTransforms", include_bytes!("foxglove/FrameTransforms.binpb"));
const SCENE_UPDATE: Schema = ("foxglove.SceneUpdate", include_bytes!("foxglove/SceneUpdate.binpb"));

/// One recording.
pub struct Recording {
    staged: StagedFile,
    writer: Writer<BufWriter<File>>,
    channels: BTreeMap<String, u16>,
    sequence: BTreeMap<u16, u32>,
    white_dbm: f64,
    /// Axes of the pictures, by radar.
    axes: BTreeMap<String, String>,
    order: Order,
    /// Time of the truth that was written last.
    truth_at: Option<i64>,
    sweeps: usize,
    points: usize,
}

impl Recording {
    /// `white_dbm`: the level that is white in the pictures of the maps, at best the highest of the run.
    ///
    /// # Errors
    /// Returns `BadInput` if the file already exists and `force` is not given, and an error if it cannot be
    /// written.
    pub fn create(path: &Path, white_dbm: f64, force: bool) -> Result<Recording> {
        let staged = StagedFile::new(path, force)?;
        let out = File::create(staged.path()).map_err(|e| Error::io(path, e))?;
        let options =
            WriteOptions::new().compression(None).library(format!("catseye {}", env!("CARGO_PKG_VERSION")));
        let writer = options.create(BufWriter::new(out)).map_err(|e| failed(path, e))?;
        Ok(Recording {
            staged,
            writer,
            channels: BTreeMap::new(),
            sequence: BTreeMap::new(),
            white_dbm,
            axes: BTreeMap::new(),
            order: Order::default(),
            truth_at: None,
            sweeps: 0,
            points: 0,
        })
    }

    fn send(
        &mut self,
        topic: &str,
        (name, descriptors): Schema,
        time_ns: u64,
        message: &impl Message,
    ) -> Result<()> {
        let wrong = |e| failed(self.staged.final_path(), e);
        let channel = match self.channels.get(topic) {
            Some(id) => *id,
            None => {
                let schema = self.writer.add_schema(name, "protobuf", descriptors).map_err(wrong)?;
                let id =
                    self.writer.add_channel(schema, topic, "protobuf", &BTreeMap::new()).map_err(wrong)?;
                self.channels.insert(topic.into(), id);
                id
            }
        };
        let sequence = self.sequence.entry(channel).or_default();
        let header = MessageHeader {
            channel_id: channel,
            sequence: *sequence,
            log_time: time_ns,
            publish_time: time_ns,
        };
        *sequence += 1;
        self.writer.write_to_known_channel(&header, &message.encode_to_vec()).map_err(wrong)
    }
}

fn failed(path: &Path, e: ::mcap::McapError) -> Error {
    Error::Failed(format!("{}: {e}", path.display()))
}

fn cloud(sweep: &Sweep) -> PointCloud {
    let names = ["x", "y", "z", "velocity", "rcs", "snr", "object_id", "ghost"];
    let fields = names.into_iter().zip(0u32..).map(|(name, i)| PackedElementField {
        name: name.into(),
        offset: 4 * i,
        kind: match name {
            "object_id" => UINT32,
            "ghost" => UINT8,
            _ => FLOAT32,
        },
    });
    let mut data = Vec::with_capacity(STRIDE as usize * sweep.points.len());
    for p in &sweep.points {
        let [x, y, z] = p.position_m.to_array();
        for value in [x, y, z, p.range_rate_mps, p.rcs_dbsm, p.snr_db] {
            data.extend_from_slice(&(value as f32).to_le_bytes());
        }
        data.extend_from_slice(&p.object_id.to_le_bytes());
        data.extend_from_slice(&[u8::from(p.ghost), 0, 0, 0]);
    }
    PointCloud {
        timestamp: Some(Timestamp::from_ns(sweep.time_ns)),
        frame_id: sweep.radar.clone(),
        pose: Some(Pose::new(DVec3::ZERO, DQuat::IDENTITY)),
        point_stride: STRIDE,
        fields: fields.collect(),
        data,
    }
}

fn transforms(sweep: &Sweep) -> FrameTransforms {
    let one = |parent: &str, child: &str, translation: DVec3, rotation: DQuat| FrameTransform {
        timestamp: Some(Timestamp::from_ns(sweep.time_ns)),
        parent_frame_id: parent.into(),
        child_frame_id: child.into(),
        translation: Some(translation.into()),
        rotation: Some(rotation.into()),
    };
    let (vehicle, sensor) = (sweep.vehicle_in_world, sweep.sensor_in_vehicle);
    FrameTransforms {
        transforms: vec![
            one(WORLD, VEHICLE, vehicle.translation_m, vehicle.rotation),
            one(VEHICLE, &sweep.radar, sensor.translation_m, sensor.rotation),
        ],
    }
}

/// Colours tell kinds of road users apart; what stands is grey.
fn colour(b: &SweepBox) -> Color {
    let [r, g, b] = match road_user(&b.class) {
        Some(RoadUser::Car | RoadUser::Van) => [0.2, 0.5, 1.0],
        Some(RoadUser::Truck | RoadUser::Bus | RoadUser::Train) => [0.6, 0.3, 0.9],
        Some(RoadUser::Motorcycle | RoadUser::Cyclist) => [1.0, 0.6, 0.1],
        Some(RoadUser::Pedestrian | RoadUser::Animal) => [0.9, 0.2, 0.3],
        None => [0.6, 0.6, 0.6],
    };
    Color { r, g, b, a: 0.4 }
}

fn truth(sweep: &Sweep) -> SceneUpdate {
    let timestamp = Some(Timestamp::from_ns(sweep.time_ns));
    let pair = |key: &str, value: String| KeyValuePair { key: key.into(), value };
    let boxes = sweep.boxes.iter().map(|b| {
        let v = b.velocity_mps;
        SceneEntity {
            timestamp,
            frame_id: WORLD.into(),
            id: format!("object {}", b.id),
            metadata: vec![
                pair("class", b.class.clone()),
                pair("object_id", b.id.to_string()),
                pair("velocity_mps", format!("{} {} {}", v.x, v.y, v.z)),
                pair("moving", b.moving.to_string()),
            ],
            cubes: vec![CubePrimitive {
                pose: Some(Pose::new(b.centre_m, b.rotation)),
                size: Some(b.size_m.into()),
                color: Some(colour(b)),
            }],
            ..Default::default()
        }
    });
    let lanes = sweep.lanes.iter().map(|l| SceneEntity {
        timestamp,
        frame_id: VEHICLE.into(),
        id: format!("lane {}", l.id),
        metadata: vec![pair("name", l.name.clone())],
        lines: vec![LinePrimitive {
            pose: Some(Pose::new(DVec3::ZERO, DQuat::IDENTITY)),
            thickness: LINE_WIDTH_M,
            points: l.points_m.iter().map(|p| (*p).into()).collect(),
            color: Some(Color { r: 1.0, g: 1.0, b: 1.0, a: 1.0 }),
            ..Default::default()
        }],
        ..Default::default()
    });
    SceneUpdate {
        // What was there before is no longer true.
        deletions: vec![SceneEntityDeletion { timestamp, kind: ALL }],
        entities: boxes.chain(lanes).collect(),
    }
}

/// The map as grey PNG: the highest range rate in the top row, the nearest range left.
fn picture(map: &PowerImage, white_dbm: f64) -> Result<Vec<u8>> {
    let grey = |power: f32| {
        let below = (white_dbm - dbm_from_w(f64::from(power))) / DB_PER_LEVEL;
        (255.0 - below).round().clamp(0.0, 255.0) as u8
    };
    let columns = map.range_columns;
    let pixels: Vec<u8> = match columns {
        0 => Vec::new(),
        _ => map.power_w.chunks_exact(columns).rev().flatten().map(|p| grey(*p)).collect(),
    };
    let mut out = Vec::new();
    PngEncoder::new_with_quality(&mut out, CompressionType::Default, FilterType::Adaptive)
        .write_image(&pixels, columns as u32, map.doppler_rows as u32, image::ExtendedColorType::L8)
        .map_err(|e| Error::Failed(format!("image of the range-Doppler map: {e}")))?;
    Ok(out)
}

impl Exporter for Recording {
    fn push(&mut self, sweep: &Sweep) -> Result<()> {
        sweep.check()?;
        self.order.next(sweep)?;
        let time = u64::try_from(sweep.time_ns).map_err(|_| {
            BadInput::new("MCAP has no times before zero")
                .key("time_ns")
                .value(sweep.time_ns)
                .allowed("0 or more")
        })?;
        if [WORLD, VEHICLE].contains(&sweep.radar.as_str()) {
            return Err(BadInput::new("the name is reserved for another frame")
                .key("radar")
                .value(&sweep.radar)
                .allowed("a name other than world and vehicle")
                .into());
        }
        self.send("/tf", FRAME_TRANSFORMS, time, &transforms(sweep))?;
        if self.truth_at != Some(sweep.time_ns) {
            self.send("/truth", SCENE_UPDATE, time, &truth(sweep))?;
            self.truth_at = Some(sweep.time_ns);
        }
        self.send(&format!("/{}/points", sweep.radar), POINT_CLOUD, time, &cloud(sweep))?;
        if let Some(map) = &sweep.range_doppler {
            let message = CompressedImage {
                timestamp: Some(Timestamp::from_ns(sweep.time_ns)),
                data: picture(map, self.white_dbm)?,
                format: "png".into(),
                frame_id: sweep.radar.clone(),
            };
            let topic = format!("/{}/range_doppler", sweep.radar);
            self.send(&topic, COMPRESSED_IMAGE, time, &message)?;
            self.axes.entry(sweep.radar.clone()).or_insert_with(|| {
                format!(
                    "x: range, first {} m, step {} m; y upwards: range rate, bottom row {} m/s, step {} m/s",
                    map.first_range_m, map.range_step_m, map.first_range_rate_mps, map.range_rate_step_mps
                )
            });
        }
        self.sweeps += 1;
        self.points += sweep.points.len();
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<Finished> {
        if !self.axes.is_empty() {
            let mut metadata = self.axes.clone();
            metadata.insert("white_dbm".into(), self.white_dbm.to_string());
            metadata.insert("db_per_grey_level".into(), DB_PER_LEVEL.to_string());
            let record = Metadata { name: "range_doppler".into(), metadata };
            self.writer.write_metadata(&record).map_err(|e| failed(self.staged.final_path(), e))?;
        }
        self.writer.finish().map_err(|e| failed(self.staged.final_path(), e))?;
        let (sweeps, points) = (self.sweeps, self.points);
        Ok(Finished { output: self.staged.commit()?, sweeps, points, notes: Vec::new() })
    }
}

#[cfg(test)]
mod tests {
    use super::super::samples;
    use super::*;

    #[test]
    fn channels_and_values() {
        let t = tempfile::tempdir().unwrap();
        let path = t.path().join("run.mcap");
        let mut r = Box::new(Recording::create(&path, samples::WHITE_DBM, false).unwrap());
        let sweeps = samples::sweeps();
        for s in &sweeps {
            r.push(s).unwrap();
        }
        let done = r.finish().unwrap();
        assert_eq!((done.sweeps, done.points), (4, 15));
        let bytes = std::fs::read(&path).unwrap();
        let messages: Vec<_> =
            ::mcap::MessageStream::new(&bytes).unwrap().collect::<::mcap::McapResult<_>>().unwrap();
        let on = |topic: &str| messages.iter().filter(|m| m.channel.topic == topic).collect::<Vec<_>>();
        assert_eq!((on("/tf").len(), on("/truth").len(), on("/front/points").len()), (4, 2, 2));
        let cloud = PointCloud::decode(on("/left/points")[0].data.as_ref()).unwrap();
        assert_eq!(cloud.data.len(), 5 * STRIDE as usize);
        let velocity = f32::from_le_bytes(cloud.data[12..16].try_into().unwrap());
        assert_eq!(velocity, sweeps[1].points[0].range_rate_mps as f32);
        let png = CompressedImage::decode(on("/front/range_doppler")[1].data.as_ref()).unwrap();
        let picture = image::load_from_memory(&png.data).unwrap().to_luma8();
        assert_eq!(picture.dimensions(), (16, 8));
        // Row 3 of the map is the fifth from the top: -30 dBm less a dB a column, white at -20 dBm.
        assert_eq!((picture.get_pixel(0, 4).0, picture.get_pixel(10, 4).0), ([235], [215]));
        assert_eq!(picture.get_pixel(0, 3).0, [215]);
    }

    #[test]
    fn refused() {
        let t = tempfile::tempdir().unwrap();
        let path = t.path().join("run.mcap");
        let mut r = Box::new(Recording::create(&path, 0.0, false).unwrap());
        assert_eq!(r.push(&samples::empty("front", 0, -1)).unwrap_err().exit_code(), 2);
        drop(r);
        let mut r = Box::new(Recording::create(&path, 0.0, false).unwrap());
        assert_eq!(r.push(&samples::empty("world", 0, 0)).unwrap_err().exit_code(), 2);
        drop(r);
        // Nothing is left of either.
        assert_eq!(std::fs::read_dir(t.path()).unwrap().count(), 0);
    }
}
