//! The scenario TOML: what stands in the scene, who drives, which radar looks, for how many frames.
//! Builders of roads and reflectors stand below this room, so they come in through [`Builder`].

use super::drive::{Drive, DriveTable};
use super::gltf::ImportOptions;
use super::interferer::{self, Interferer, InterfererTable};
use super::lidar::{self, Lidar, LidarTable};
use super::mesh_file::{self, ImportTable};
use super::motion::{Channel, Joint, Motion, Moving};
pub use super::place_reader::Lasting;
use super::place_reader::PlaceReader;
use super::radar::Radar;
use super::radar_toml::{self, MountingTable, RadarFile};
use super::scatterer::ScatteringTable;
use super::toml_file::{At, Document, clip, read_text};
use super::trajectory::{Trajectory, TrajectoryTable};
use super::waveform::{Multiplex, Waveform};
use super::weather::{self, Weather, WeatherTable};
use super::{Mesh, Scene, Shape};
use crate::base::convention::Convention;
use crate::base::convention::MAX_BOUNCES;
use crate::base::error::{BadInput, Error, Result, nearest};
use crate::base::frames::{Pose, Target, Vehicle, World};
use glam::DVec3;
use schemars::JsonSchema;
use serde::de::value::MapAccessDeserializer;
use serde::{Deserialize, Deserializer, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A scenario: scene, radars and motion. Lengths are in metres, speeds in m/s, angles in degrees.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "catseye scenario")]
pub struct ScenarioFile {
    /// Name of the scenario, shown in results.
    pub name: String,
    /// Seed of the random numbers; the same seed gives the same bytes. Default 0.
    #[serde(default)]
    pub seed: u64,
    /// The radar: a preset (`catseye help radars` lists them), the path of a radar file, or a table with the keys of a radar file.
    pub radar: Option<At<RadarRef>>,
    /// Several radars on the vehicle, in place of `radar`.
    #[serde(default)]
    pub radars: Vec<MountedRadar>,
    /// Contents of the scene.
    #[serde(default)]
    pub scene: SceneTable,
    /// Point targets.
    #[serde(default)]
    pub point: Vec<PointTable>,
    /// Further objects in the scene.
    #[serde(default)]
    pub object: Vec<ObjectTable>,
    /// Interfering FMCW radars.
    #[serde(default)]
    pub interferer: Vec<InterfererTable>,
    /// true: the vehicle's radars interfere with each other. Default false.
    #[serde(default)]
    pub mutual_interference: bool,
    /// Rain, fog and wet roads. Default dry.
    #[serde(default)]
    pub weather: WeatherTable,
    /// The vehicle that carries the radar.
    #[serde(default)]
    pub ego: EgoTable,
    /// Number and times of the frames.
    #[serde(default)]
    pub frames: FramesTable,
    /// Settings of the ray tracer.
    #[serde(default)]
    pub trace: TraceTable,
    /// An ideal lidar in addition to the radars; `output.lidar` writes its points.
    #[serde(default)]
    pub lidar: LidarTable,
    /// Files that are written for each frame.
    #[serde(default)]
    pub output: Output,
    /// Settings of `catseye lane`; other commands ignore them.
    #[schemars(with = "Option<BTreeMap<String, serde_json::Value>>")]
    pub lane: Option<serde::de::IgnoredAny>,
}

/// One of several radars on the vehicle.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MountedRadar {
    /// Name of the radar and of the folder of its files, unique in the scenario.
    pub name: At<String>,
    /// A preset or the path of a radar file.
    pub radar: At<String>,
    /// Mounting of this radar, in place of that in the radar file.
    pub mounting: Option<MountingTable>,
    /// Trajectory of the radar relative to the vehicle's rear-axle centre, in place of a mounting; for a
    /// vehicle at the origin, the trajectory in the world.
    pub trajectory: Option<TrajectoryTable>,
}

/// A preset, a file or a complete radar.
#[derive(Debug, Clone)]
pub enum RadarRef {
    /// A preset or a file.
    Name(String),
    /// A radar written in place.
    Inline(Box<RadarFile>),
}

impl<'de> Deserialize<'de> for RadarRef {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl<'de> serde::de::Visitor<'de> for Visitor {
            type Value = RadarRef;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("the name of a preset, the path of a radar file, or one radar as a table")
            }
            fn visit_str<E>(self, s: &str) -> Result<RadarRef, E> {
                Ok(RadarRef::Name(s.into()))
            }
            // Straight from the map, so that the values keep their places in the file.
            fn visit_map<A: serde::de::MapAccess<'de>>(self, map: A) -> Result<RadarRef, A::Error> {
                RadarFile::deserialize(MapAccessDeserializer::new(map)).map(|r| RadarRef::Inline(Box::new(r)))
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}

impl JsonSchema for RadarRef {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "RadarRef".into()
    }
    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "anyOf": [{ "type": "string" }, generator.subschema_for::<RadarFile>()] })
    }
}

/// Built-in scenes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Builtin {
    /// An empty scene, with only the points and objects of this file.
    Empty,
    /// 100 m of two-lane road with markers, rails, a manhole and two cars.
    MarkedRoad,
    /// The benchmark scene without motion.
    W3,
    /// The benchmark scene with moving cars.
    W3Moving,
}

/// A built-in scene, a road scene or a glTF file; with none of them, the scene is empty.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SceneTable {
    /// A built-in scene.
    pub builtin: Option<At<Builtin>>,
    /// A road scene (TOML, as for `catseye scene`), relative to this file.
    pub road: Option<At<String>>,
    /// A .glb, .gltf, .stl or .obj file, relative to this file.
    pub file: Option<At<String>>,
    /// Unit of length of the file: m (default for glTF; required for STL and OBJ), cm, mm, in or ft.
    pub unit: Option<At<String>>,
    /// Up axis of the file: y (default for glTF; required for STL and OBJ) or z.
    pub up: Option<At<String>>,
    /// Animations of the glTF file that are played: all (default) that do not contradict each other, none, or the name of one.
    pub animation: Option<At<String>>,
    /// Crease angle: edges at which adjacent facets turn by more than this are creases, degrees (default 30; with 0 every facet is flat).
    pub smooth_deg: Option<At<f64>>,
    /// Radar material of surfaces whose material is missing or unknown.
    pub default_material: Option<At<String>>,
    /// Map from the file's material names to radar materials of the table.
    #[serde(default)]
    pub materials: BTreeMap<String, At<String>>,
}

/// An isotropic point target.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PointTable {
    /// Name of the target.
    #[serde(default)]
    pub name: String,
    /// Class of the target.
    #[serde(default)]
    pub class: String,
    /// Position at the middle of frame 0, [forward, left, up] in the world, m.
    pub position_m: Option<At<[f64; 3]>>,
    /// Velocity in the world, m/s; default static.
    #[serde(default)]
    pub velocity_mps: At<[f64; 3]>,
    /// Trajectory of the point, in place of position and velocity.
    pub trajectory: Option<TrajectoryTable>,
    /// Radar cross section, dBsm.
    #[schemars(range(min = -200.0, max = 200.0))]
    pub rcs_dbsm: At<f64>,
}

/// An object in the world: a mesh file, a reflector, a vehicle or an RCS table.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ObjectTable {
    /// Name of the object.
    #[serde(default)]
    pub name: String,
    /// Class in labels; default the class in the file, and "reflector" for a reflector.
    #[serde(default)]
    pub class: String,
    /// A .glb, .gltf, .stl or .obj file, relative to this file.
    pub file: Option<At<String>>,
    /// Reflector kind and parameters, as in `catseye rcs`: "type1:width_m=0.16,height_m=0.004".
    pub reflector: Option<At<String>>,
    /// Kind of vehicle or person from the library: passenger-car, sedan, hatchback, suv, van, truck,
    /// semi-trailer, motorcycle, cyclist, pedestrian or child. Its origin is on the road below its centre;
    /// wheels and limbs move with its motion.
    pub vehicle: Option<At<String>>,
    /// RCS table (CSV, as `catseye rcs` writes it), relative to this file, that gives the object's scattering matrix.
    pub rcs_table: Option<At<String>>,
    /// Position of the object's origin in the world, m.
    pub position_m: Option<At<[f64; 3]>>,
    /// Yaw of the object's x axis (a reflector's boresight), degrees, positive to the left; 180 faces a radar
    /// that looks along +x. With a trajectory it is relative to the heading.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub yaw_deg: f64,
    /// Pitch, degrees, positive nose down.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub pitch_deg: f64,
    /// Roll, degrees, positive left side up.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub roll_deg: f64,
    /// Velocity in the world, m/s, added to the velocities that the file gives its nodes.
    #[serde(default)]
    pub velocity_mps: At<[f64; 3]>,
    /// Trajectory of the object's origin with its heading, in place of position and velocity.
    pub trajectory: Option<TrajectoryTable>,
    /// Unit of length of the file, as in `scene`.
    pub unit: Option<At<String>>,
    /// Up axis of the file, as in `scene`.
    pub up: Option<At<String>>,
    /// Animations of the file that are played, as in `scene`.
    pub animation: Option<At<String>>,
    /// Crease angle: edges at which adjacent facets turn by more than this are creases, degrees (default 30; with 0 every facet is flat).
    pub smooth_deg: Option<At<f64>>,
    /// Radar material of surfaces whose material is missing or unknown.
    pub default_material: Option<At<String>>,
    /// Map from the file's material names to radar materials of the table.
    #[serde(default)]
    pub materials: BTreeMap<String, At<String>>,
}

/// The vehicle that carries the radar.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EgoTable {
    /// Position of the rear-axle centre at the middle of frame 0, m; at height 0 the radar's mounting height
    /// is its height above the road.
    #[serde(default)]
    pub position_m: At<[f64; 3]>,
    /// Heading, degrees, positive to the left.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub yaw_deg: At<f64>,
    /// Speed along the heading, m/s.
    #[serde(default)]
    #[schemars(range(min = -1000.0, max = 1000.0))]
    pub speed_mps: At<f64>,
    /// Position on a road of `scene.road` in place of position and yaw; the vehicle follows the road at `speed_mps` or as `drive` states.
    pub on_road: Option<OnRoadTable>,
    /// Speed and lateral motion along that road.
    pub drive: Option<DriveTable>,
    /// Trajectory of the rear-axle centre with the vehicle's heading, in place of all other keys.
    pub trajectory: Option<TrajectoryTable>,
}

/// A position on a road of the scene.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OnRoadTable {
    /// Name of the road; default the first.
    pub road: Option<At<String>>,
    /// Number of the lane in whose centre the vehicle drives; default the road's axis.
    pub lane: Option<At<i32>>,
    /// Station along the road at the middle of frame 0, m.
    #[serde(default)]
    #[schemars(range(min = -1e6, max = 1e6))]
    pub s_m: At<f64>,
    /// Lateral offset from the lane centre, m, positive to the left in the direction of travel.
    #[serde(default)]
    #[schemars(range(min = -100.0, max = 100.0))]
    pub offset_m: f64,
    /// true: the vehicle drives against the direction of the road; default the driving direction of the lane.
    pub against: Option<bool>,
}

/// Number and times of the frames.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FramesTable {
    /// Number of frames.
    #[schemars(range(min = 1, max = 10_000_000))]
    pub count: u32,
    /// Time from the middle of one frame to the middle of the next, s.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub interval_s: f64,
}

impl Default for FramesTable {
    fn default() -> Self {
        FramesTable { count: 1, interval_s: 0.05 }
    }
}

/// Settings of the ray tracer.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TraceTable {
    /// Approximate number of scatterers on all rough surfaces in a frame; rain has the same number.
    #[schemars(range(max = 100_000_000))]
    pub rays: u64,
    /// Number of bounces that are traced; one more is possible on a large plane ahead of the surface
    /// that it lights. Default 3, and more as `most_bounces` states.
    #[schemars(range(min = 1, max = MAX_BOUNCES))]
    pub bounces: Option<At<u32>>,
    /// Bounces are traced up to this number until one more would contribute less than the accuracy to the
    /// frame. Default 8 without `bounces`, otherwise `bounces`.
    #[schemars(range(min = 1, max = MAX_BOUNCES))]
    pub most_bounces: Option<At<u32>>,
    /// Error allowed in the coherent sum of the radiation of a smooth surface, dB.
    #[schemars(range(min = 1e-4, max = 3.0))]
    pub accuracy_db: f64,
    /// Maximum number of triangles of the scene after the facets of strongly curved surfaces are subdivided.
    /// A scene with more triangles than this keeps them.
    #[schemars(range(max = 100_000_000))]
    pub facets: u64,
    /// Echoes below this power are left out, dB relative to the thermal noise of a cell of the map after all
    /// channels (negative: below the noise). Each echo counts as if it were in the main direction of the
    /// antennas. This replaces the threshold that `exact` describes. Without noise all echoes are kept.
    #[schemars(range(min = -200.0, max = 0.0))]
    pub floor_db: Option<At<f64>>,
    /// true: every echo is kept. false: echoes of one position and one path are merged, and the weakest are
    /// left out as long as the sum of their powers stays 10 dB below the noise of a cell after all channels
    /// (without noise: 100 dB below the sum of all).
    pub exact: At<bool>,
    /// Bounces of a chain that radiate to the receiver.
    pub convention: Convention,
}

impl Default for TraceTable {
    fn default() -> Self {
        TraceTable {
            rays: 100_000,
            bounces: None,
            most_bounces: None,
            accuracy_db: 0.2,
            facets: 50_000,
            floor_db: None,
            exact: false.into(),
            convention: Convention::Every,
        }
    }
}

/// Files that are written for each frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Output {
    /// adc.npy: the ADC samples.
    pub adc: bool,
    /// range_doppler.npy: the range-Doppler map.
    pub range_doppler: bool,
    /// cfar_threshold.npy: the detection threshold of each cell of the map, in the map's shape.
    pub cfar_threshold: bool,
    /// angle_spectra.npy and angle_cells.csv: the angular spectrum of each cell that the angle method searched.
    pub angle_spectra: bool,
    /// points.csv: the detected points.
    pub points: bool,
    /// tracks.csv and ego_motion.csv: tracks and ego motion estimated from the points of a run of several frames.
    pub tracks: bool,
    /// returns.csv: all echoes.
    pub returns: bool,
    /// return_places.npy: the positions at which the path of each echo meets surfaces, one row for each row of returns.csv.
    pub return_places: bool,
    /// echoes.npy and echoes.json: all echoes with all values (cached echoes), from which `simulate --from` computes frames of
    /// another radar at the same position.
    pub echoes: bool,
    /// truth.json: the ground truth.
    pub truth: bool,
    /// mask_road.npy, mask_markers.npy, grid_road.npy, grid_markers.npy: classes and points on grids.
    pub masks: bool,
    /// lidar.csv: the points of the ideal lidar of `[lidar]`; default false.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub lidar: bool,
    /// scene.glb: the whole scene as binary glTF with its motions and, for a road, its labels; one file per run.
    pub scene: bool,
    /// PNG plots.
    pub plots: bool,
}

impl Default for Output {
    fn default() -> Self {
        Output {
            adc: true,
            range_doppler: true,
            cfar_threshold: false,
            angle_spectra: false,
            points: true,
            tracks: true,
            returns: true,
            return_places: false,
            echoes: false,
            truth: true,
            masks: false,
            lidar: false,
            scene: false,
            plots: true,
        }
    }
}

/// Most bounces that may be asked for.
const MOST_BOUNCES: u32 = MAX_BOUNCES as u32;
/// Reflections that are followed where a scenario does not say.
const BOUNCES: u32 = 3;

/// A scenario that has been read and checked. Paths are resolved against the scenario's folder.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario<E = EgoPlan> {
    /// Name of the scenario.
    pub name: String,
    /// Seed of all draws.
    pub seed: u64,
    /// Radars, one or more, with different names.
    pub radars: Vec<Radar>,
    /// What stands there.
    pub scene: SceneSource,
    /// Isotropic scatterers.
    pub points: Vec<PointTarget>,
    /// Objects that are placed.
    pub objects: Vec<Placed>,
    /// Other radars.
    pub interferers: Vec<Interferer>,
    /// Whether the radars of the vehicle hear each other.
    pub mutual_interference: bool,
    /// Rain, fog and water on the road.
    pub weather: Weather,
    /// The vehicle that carries the radar.
    pub ego: E,
    /// Number and times of the frames.
    pub frames: Frames,
    /// Settings of the ray tracer.
    pub trace: TraceSettings,
    /// The ideal lidar on the vehicle.
    pub lidar: Lidar,
    /// Files that are written for each frame.
    pub output: Output,
    /// How long its trajectories last; frames may last longer.
    pub trajectories: Vec<Lasting>,
}

/// Where the scene comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum SceneSource {
    /// A built-in scene.
    Builtin(Builtin),
    /// A road scene.
    Road {
        /// The road scene's file.
        path: PathBuf,
    },
    /// A file of a scene.
    File {
        /// The file.
        path: PathBuf,
        /// How it is read.
        options: ImportOptions,
    },
}

/// An isotropic scatterer that has been checked.
#[derive(Debug, Clone, PartialEq)]
pub struct PointTarget {
    /// Name of the target.
    pub name: String,
    /// Class of the target.
    pub class: String,
    /// Position in the world, m.
    pub position_m: DVec3,
    /// Velocity in the world, m/s.
    pub velocity_mps: DVec3,
    /// How it moves, in place of position and velocity.
    pub trajectory: Option<Trajectory>,
    /// Radar cross section, dBsm.
    pub rcs_dbsm: f64,
}

/// What an object is made from.
#[derive(Debug, Clone, PartialEq)]
pub enum ObjectSource {
    /// A file of a mesh.
    File {
        /// The file.
        path: PathBuf,
        /// How it is read.
        options: ImportOptions,
    },
    /// A scattering table.
    Table {
        /// The file.
        path: PathBuf,
    },
    /// A vehicle of the library, and the place to name when the builder refuses it.
    Vehicle {
        /// Its kind.
        kind: String,
        /// The place in the scenario.
        at: BadInput,
    },
    /// As given, and the place to name when the builder refuses it.
    Reflector {
        /// The reflector with its parameters.
        spec: String,
        /// The place in the scenario.
        at: BadInput,
    },
}

impl ObjectSource {
    /// Whether both build the same, wherever they stand in the file.
    fn same(&self, other: &Self) -> bool {
        match (self, other) {
            (ObjectSource::Reflector { spec: a, .. }, ObjectSource::Reflector { spec: b, .. }) => a == b,
            (ObjectSource::Vehicle { kind: a, .. }, ObjectSource::Vehicle { kind: b, .. }) => a == b,
            (a, b) => a == b,
        }
    }
}

/// An object with its place.
#[derive(Debug, Clone, PartialEq)]
pub struct Placed {
    /// Name of the object.
    pub name: String,
    /// Class of the object.
    pub class: String,
    /// What it is made from.
    pub source: ObjectSource,
    /// Pose in the world; with a trajectory the rotation against the heading.
    pub pose: Pose<Target, World>,
    /// Velocity in the world, m/s.
    pub velocity_mps: DVec3,
    /// How it moves, in place of position and velocity.
    pub trajectory: Option<Trajectory>,
}

/// A scenario whose ego vehicle has a known motion, from which frames can be made. `road::site::Site` makes it from a scenario that was
/// read; where no road is followed, [`Scenario::without_roads`] does so too.
pub type SitedScenario = Scenario<Ego>;

/// How the vehicle that carries the radar moves, as the file says.
#[derive(Debug, Clone, PartialEq)]
pub enum EgoPlan {
    /// Its motion is known.
    Free(Ego),
    /// It follows a road of the scene, which has to be built first.
    OnRoad(Box<OnRoad>),
}

impl EgoPlan {
    /// The place on a road, where there is one.
    pub fn on_road(&self) -> Option<&OnRoad> {
        match self {
            EgoPlan::OnRoad(on) => Some(on),
            EgoPlan::Free(_) => None,
        }
    }

    /// The place on a road to change, where there is one.
    pub fn on_road_mut(&mut self) -> Option<&mut OnRoad> {
        match self {
            EgoPlan::OnRoad(on) => Some(on),
            EgoPlan::Free(_) => None,
        }
    }

    /// The ego vehicle whose motion is known, where no road has to be built for it.
    pub fn free(&self) -> Option<&Ego> {
        match self {
            EgoPlan::Free(ego) => Some(ego),
            EgoPlan::OnRoad(_) => None,
        }
    }
}

/// The vehicle that carries the radar: it goes straight on at constant speed, or as its motion says.
#[derive(Debug, Clone, PartialEq)]
pub struct Ego {
    /// Position at time zero, m.
    pub position_m: DVec3,
    /// Heading, rad.
    pub yaw_rad: f64,
    /// Speed, m/s.
    pub speed_mps: f64,
    /// How it moves when not straight on at that speed.
    pub motion: Option<Arc<Motion>>,
}

/// A place on a road of the scene, by names, and how the vehicle goes on from there.
#[derive(Debug, Clone, PartialEq)]
pub struct OnRoad {
    /// Name of the road; None where there is but one.
    pub road: Option<String>,
    /// Number of the lane.
    pub lane: Option<i32>,
    /// Distance along the road at time zero, m.
    pub s_m: f64,
    /// Distance to the left of the lane's middle, m.
    pub offset_m: f64,
    /// Whether it drives against the road's direction.
    pub against: Option<bool>,
    /// Speed and lateral motion.
    pub drive: Drive,
    /// The place in the file, for error messages.
    pub at: BadInput,
}

impl Ego {
    /// Pose and velocity of the vehicle at a time counted from the middle of frame 0.
    pub fn at(&self, time_s: f64) -> Moving {
        if let Some(motion) = &self.motion {
            return motion.at(time_s);
        }
        let velocity_mps = DVec3::new(self.yaw_rad.cos(), self.yaw_rad.sin(), 0.0) * self.speed_mps;
        let at = self.position_m + velocity_mps * time_s;
        let rotation = Pose::<Vehicle, World>::from_yaw_pitch_roll(at, self.yaw_rad, 0.0, 0.0).rotation;
        Moving { rotation, translation_m: at, velocity_mps, spin_rad_per_s: DVec3::ZERO }
    }

    /// Pose in the world at a time.
    pub fn pose(&self, time_s: f64) -> Pose<Vehicle, World> {
        let now = self.at(time_s);
        Pose::new(now.rotation, now.translation_m)
    }
}

/// Number and times of the frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frames {
    /// Number of frames.
    pub count: u32,
    /// Time from frame to frame, s.
    pub interval_s: f64,
}

impl Frames {
    /// Time of the middle of frame `index`.
    pub fn time_s(&self, index: u32) -> f64 {
        index as f64 * self.interval_s
    }
}

/// How waves are followed, checked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TraceSettings {
    /// Rays of a frame.
    pub rays: u64,
    /// Number of bounces that are followed, 1 to [`MAX_BOUNCES`].
    pub bounces: u32,
    /// Followed on to, until what one bounce more would bring is below the accuracy; nothing up to `bounces`.
    pub most_bounces: u32,
    /// Error that coherent sums may have, dB.
    pub accuracy_db: f64,
    /// Largest number of facets of curved bodies.
    pub facets: u64,
    /// Power over the noise of a cell below which an echo is left out, dB; with None only what cannot show in sum is
    /// left out.
    pub floor_db: Option<f64>,
    /// Whether every single echo is kept.
    pub exact: bool,
    /// Bounces of a chain that radiate to the receiver.
    pub convention: Convention,
}

/// Builds the scenes, roads and reflectors that this module does not know; `road` implements it.
pub trait Builder {
    /// The built-in scene of that name.
    ///
    /// # Errors
    /// Returns an error if the scene cannot be built.
    fn builtin(&self, name: Builtin) -> Result<Scene>;
    /// The scene of a road file, its vehicles under way for `duration_s`.
    ///
    /// # Errors
    /// Returns an error if the road file cannot be read or its scene cannot be built.
    fn road(&self, path: &Path, duration_s: f64) -> Result<Scene>;
    /// The objects of a reflector's spec string, in its target frame.
    ///
    /// # Errors
    /// Returns an error if the spec is wrong or the reflector cannot be built.
    fn reflector(&self, spec: &str) -> Result<Scene>;
    /// A vehicle of the library at rest, its origin on the road below its middle.
    ///
    /// # Errors
    /// Returns an error for a kind that is not in the library.
    fn vehicle(&self, kind: &str) -> Result<Scene>;
    /// The joints of a part of a vehicle that goes at a speed, in m/s, or as far as a way says over time.
    fn driven(&self, joints: Vec<Joint>, speed_mps: f64, way_m: Option<Arc<Channel<f64>>>) -> Vec<Joint>;
}

impl Scenario {
    /// Reads and checks a scenario file.
    ///
    /// # Errors
    /// Returns an error of one line with file, line, key, value and remedy if the file cannot be read or a value is not
    /// allowed.
    pub fn load(path: &Path) -> Result<Scenario> {
        parse(path, &read_text(path)?)
    }

    /// The scenario with the motion of its ego vehicle, which follows no road.
    ///
    /// # Errors
    /// Returns an error if the ego vehicle is on a road, since `road::site::Site` has to build the road.
    pub fn without_roads(self) -> Result<SitedScenario> {
        match &self.ego {
            EgoPlan::Free(ego) => {
                let ego = ego.clone();
                Ok(self.with_ego(ego))
            }
            EgoPlan::OnRoad(on) => Err(BadInput {
                problem: "the ego vehicle follows a road, which is not built".into(),
                ..on.at.clone()
            }
            .key("ego.on_road")
            .remedy("build a road::site::Site from the scenario, and use its scenario")
            .into()),
        }
    }
}

impl<E> Scenario<E> {
    /// The same scenario with another ego vehicle.
    pub fn with_ego<F>(self, ego: F) -> Scenario<F> {
        let Scenario { name, seed, radars, scene, points, objects, interferers, mutual_interference, .. } =
            self;
        let Scenario { weather, ego: _, frames, trace, lidar, output, trajectories, .. } = self;
        Scenario {
            name,
            seed,
            radars,
            scene,
            points,
            objects,
            interferers,
            mutual_interference,
            weather,
            ego,
            frames,
            trace,
            lidar,
            output,
            trajectories,
        }
    }

    /// The scene with all points and objects in it.
    ///
    /// # Errors
    /// Returns an error if a file of the scene cannot be read, or if the builder fails.
    pub fn build(&self, builder: &dyn Builder) -> Result<Scene> {
        let scene = match &self.scene {
            SceneSource::Builtin(Builtin::Empty) => Scene::default(),
            SceneSource::Builtin(b) => builder.builtin(*b)?,
            SceneSource::Road { path } => builder.road(path, self.duration_s())?,
            SceneSource::File { path, options } => {
                mesh_file::import_sized(path, options, mesh_file::SCENE_M)?
            }
        };
        self.furnish(scene, builder)
    }

    /// Time to the middle of the last frame, and a second more, s.
    pub fn duration_s(&self) -> f64 {
        self.frames.time_s(self.frames.count.saturating_sub(1)) + 1.0
    }

    /// Adds the points and objects of the scenario to a scene.
    ///
    /// # Errors
    /// Returns an error if a file of the scene cannot be read, or if the builder fails.
    pub fn furnish(&self, mut scene: Scene, builder: &dyn Builder) -> Result<Scene> {
        for p in &self.points {
            let pose = Pose::new(glam::DQuat::IDENTITY, p.position_m);
            let shape = Shape::Point { rcs_dbsm: p.rcs_dbsm };
            let id = scene.add_object(&p.name, &p.class, shape, pose, p.velocity_mps);
            if let Some(t) = &p.trajectory {
                scene.move_by(id, Motion::clone(&t.motion));
            }
        }
        // Files and specs that occur again share their meshes.
        let mut known: Vec<(&ObjectSource, Scene, usize)> = Vec::new();
        for o in &self.objects {
            let k = match known.iter().position(|(s, ..)| s.same(&o.source)) {
                Some(k) => k,
                None => {
                    let built = match &o.source {
                        ObjectSource::File { path, options } => {
                            mesh_file::import_sized(path, options, mesh_file::OBJECT_M)?
                        }
                        ObjectSource::Table { path } => table_scene(path)?,
                        ObjectSource::Reflector { spec, at } => {
                            builder.reflector(spec).map_err(|e| in_file(e, at))?
                        }
                        ObjectSource::Vehicle { kind, at } => {
                            let mut vehicle = builder.vehicle(kind).map_err(|e| in_file(e, at))?;
                            // The body bears the object's own name, its parts that name and theirs.
                            for part in &mut vehicle.objects {
                                if let Some(rest) = part.name.strip_prefix("body") {
                                    part.name = rest.to_string();
                                }
                            }
                            vehicle
                        }
                    };
                    let first = scene.add_meshes(&built);
                    scene.import.degenerate_triangles_dropped += built.import.degenerate_triangles_dropped;
                    scene.import.notes.extend(of_object(&o.name, &built.import.notes));
                    let unit = mesh_file::unit_line(&built)
                        .filter(|_| matches!(o.source, ObjectSource::File { .. }));
                    scene.import.notes.extend(of_object(&o.name, unit.as_slice()));
                    known.push((&o.source, built, first));
                    known.len() - 1
                }
            };
            let (_, built, first) = &known[k];
            let label = Label { name: &o.name, class: &o.class };
            let ahead_mps = o.velocity_mps.dot(o.pose.direction(DVec3::X));
            let inner = |joints: Vec<Joint>| match (&o.source, &o.trajectory) {
                (ObjectSource::Vehicle { .. }, Some(t)) => {
                    builder.driven(joints, t.mean_speed_mps, Some(t.way_m.clone()))
                }
                (ObjectSource::Vehicle { .. }, None) => builder.driven(joints, ahead_mps, None),
                _ => joints,
            };
            scene.place(built, *first, label, &o.placement(), &inner);
        }
        if scene.objects.is_empty() {
            return Err(BadInput::new("the scenario is empty")
                .key("scene")
                .remedy(
                    "give a [[point]], an [[object]], scene.file, or a scene.builtin other than \"empty\"",
                )
                .into());
        }
        let last_s = self.frames.time_s(self.frames.count.saturating_sub(1));
        scene.import.notes.extend(self.trajectories.iter().flat_map(|t| t.notes(last_s)));
        self.weather.wet(&mut scene)?;
        scene.import.triangles = scene.triangle_count();
        Ok(scene)
    }
}

/// Notes of the importer with the name of the object whose file it is, where it has one.
pub(crate) fn of_object(name: &str, notes: &[String]) -> Vec<String> {
    let named = |n: &String| {
        if n.starts_with("object '") || name.is_empty() { n.clone() } else { format!("object '{name}': {n}") }
    };
    notes.iter().map(named).collect()
}

/// A scene of one object, named after the file of its scattering table.
fn table_scene(path: &Path) -> Result<Scene> {
    let table = ScatteringTable::read(path)?;
    let mut scene = Scene::default();
    scene.import.notes.extend(table.notes().iter().cloned());
    let name = path.file_stem().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let t = scene.table_index(&Arc::new(table));
    scene.add_object(&name, "", Shape::Table(t), Pose::IDENTITY, DVec3::ZERO);
    Ok(scene)
}

/// A complaint from another room with the place in the scenario added.
fn in_file(e: Error, at: &BadInput) -> Error {
    match e {
        Error::Input(mut b) => {
            b.file = b.file.or_else(|| at.file.clone());
            b.line = b.line.or(at.line);
            b.key = b.key.or_else(|| at.key.clone());
            b.value = b.value.or_else(|| at.value.clone());
            Error::Input(b)
        }
        e => e,
    }
}

/// Name and class of an object that is placed; empty ones leave what the parts have.
#[derive(Debug, Clone, Copy, Default)]
pub struct Label<'a> {
    /// Name, or empty.
    pub name: &'a str,
    /// Class, or empty.
    pub class: &'a str,
}

/// How an object that is placed moves through the world.
#[derive(Debug, Clone, PartialEq)]
pub struct Placement {
    /// Its pose at time zero.
    pub pose: Pose<Target, World>,
    /// Its velocity in the world, m/s.
    pub velocity_mps: DVec3,
    /// Motion from the thing's own frame to the world, if it does not go straight on.
    pub joints: Option<Vec<Joint>>,
}

impl Placed {
    fn placement(&self) -> Placement {
        let joints = self.trajectory.as_ref().map(|t| {
            let own = (self.pose.rotation != glam::DQuat::IDENTITY)
                .then_some(Joint::Fixed(self.pose.rotation, DVec3::ZERO));
            own.into_iter().chain(t.motion.joints.iter().cloned()).collect()
        });
        Placement { pose: self.pose, velocity_mps: self.velocity_mps, joints }
    }
}

impl Scene {
    /// Adds the objects of another scene, moved as one body; `first` is what [`Scene::add_meshes`] gave for it. What the parts
    /// move of themselves, as `inner` has it, comes on top. Returns their ids.
    pub fn place(
        &mut self,
        built: &Scene,
        first: usize,
        label: Label<'_>,
        placement: &Placement,
        inner: &dyn Fn(Vec<Joint>) -> Vec<Joint>,
    ) -> Vec<u32> {
        let Placement { pose, velocity_mps, .. } = *placement;
        let mut ids = Vec::with_capacity(built.objects.len());
        for part in &built.objects {
            let shape = match part.shape {
                Shape::Mesh(m) => Shape::Mesh(first + m),
                Shape::Table(t) => Shape::Table(self.table_index(&built.tables[t])),
                point @ Shape::Point { .. } => point,
            };
            let name = match (label.name.is_empty(), built.objects.len()) {
                (true, _) => part.name.clone(),
                (false, 1) => label.name.to_string(),
                // The parts of a vehicle, "" and " wheel 1 left".
                (false, _) if part.name.is_empty() || part.name.starts_with(' ') => {
                    format!("{}{}", label.name, part.name)
                }
                (false, _) => format!("{}/{}", label.name, part.name),
            };
            let class = if label.class.is_empty() { &part.class } else { label.class };
            let at = Pose::new(pose.rotation * part.pose.rotation, pose.point(part.pose.translation_m));
            let id =
                self.add_object(&name, class, shape, at, velocity_mps + pose.direction(part.velocity_mps));
            if part.motion.is_some() || placement.joints.is_some() {
                let mut joints = inner(part.joints());
                match &placement.joints {
                    Some(outer) => joints.extend(outer.iter().cloned()),
                    None => {
                        joints.push(Joint::Fixed(pose.rotation, pose.translation_m));
                        joints.push(Joint::Line(velocity_mps));
                    }
                }
                self.move_by(id, Motion { joints });
            }
            self.set_radar(id, part.radar);
            ids.push(id);
        }
        ids
    }

    /// Adds the meshes and materials of another scene and returns the index of the first mesh.
    pub fn add_meshes(&mut self, other: &Scene) -> usize {
        let materials: Vec<u32> = other.materials.iter().map(|m| self.material_index(m)).collect();
        let first = self.meshes.len();
        self.meshes.extend(other.meshes.iter().map(|m| Mesh {
            material: m.material.iter().map(|k| materials[*k as usize]).collect(),
            ..m.clone()
        }));
        first
    }
}

/// The radars of a scenario. Errors: none or both ways of naming them; a name that is no folder's or comes twice.
fn radars(places: &mut PlaceReader<'_, '_>, f: &ScenarioFile) -> Result<Vec<Radar>> {
    let doc = places.doc;
    match (&f.radar, f.radars.is_empty()) {
        (Some(At { value: RadarRef::Inline(r), .. }), true) => Ok(vec![radar_toml::build(doc, r)?]),
        (Some(At { value: RadarRef::Name(n), span }), true) => Ok(vec![radar_toml::named(doc, n, span)?]),
        (None, true) => Err(BadInput::new("the scenario has no radar")
            .file(doc.file())
            .key("radar")
            .remedy("add radar = \"front77\", or a [[radars]] table for each of several")
            .into()),
        (Some(_), false) => Err(doc
            .bad(&f.radars[0].name.span, "radar and [[radars]] exclude each other")
            .remedy("keep one of them")
            .into()),
        (None, false) => {
            let mut list: Vec<Radar> = Vec::with_capacity(f.radars.len());
            for r in &f.radars {
                let name = &r.name.value;
                let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
                if name.is_empty() || name.len() > 64 || !name.chars().all(plain) {
                    return Err(doc
                        .bad(&r.name.span, "cannot name a folder")
                        .allowed("1 to 64 letters, digits, - and _")
                        .into());
                }
                if list.iter().any(|o| o.name.eq_ignore_ascii_case(name)) {
                    return Err(doc
                        .bad(&r.name.span, "is the name of two radars")
                        .remedy("rename one")
                        .into());
                }
                let mut radar = radar_toml::named(doc, &r.radar.value, &r.radar.span)?;
                radar.name = name.clone();
                if let Some(m) = &r.mounting {
                    radar.mounting = radar_toml::mounting(doc, m)?;
                }
                if let Some(t) = &r.trajectory {
                    if r.mounting.is_some() {
                        let e =
                            doc.bad(&r.name.span, "mounting and trajectory of a radar exclude each other");
                        return Err(e.remedy("keep one of the two").into());
                    }
                    let key = format!("radars[{}].trajectory", list.len());
                    radar.move_by(places.along(&key, &format!("radar '{name}'"), t)?.motion);
                }
                list.push(radar);
            }
            Ok(list)
        }
    }
}

/// Reads and checks a scenario; `file` is named in errors, and paths in it are relative to its folder.
///
/// # Errors
/// Returns an error for the first key or value that is missing, unknown or outside its range, with file, line, key and
/// remedy.
pub fn parse(file: &Path, text: &str) -> Result<Scenario> {
    parse_with_road(file, text, None)
}

/// Parses a scenario whose road, if it has this name, is not on the disk yet.
///
/// # Errors
/// Returns an error for the first key or value that is missing, unknown or outside its range, with file, line, key and
/// remedy.
pub fn parse_with_road(file: &Path, text: &str, unwritten: Option<&str>) -> Result<Scenario> {
    let doc = Document::parse(file, text)?;
    let f: ScenarioFile = doc.read()?;
    let frames = frames(&f.frames);
    let last_s = frames.time_s(frames.count.saturating_sub(1));
    let mut places = PlaceReader::new(&doc, last_s);
    let radars = radars(&mut places, &f)?;
    let options = |o: ImportTable<'_>, file: &At<String>| o.options_of(&doc, file);
    let given = [f.scene.builtin.as_ref().map(|b| &b.span), f.scene.road.as_ref().map(|r| &r.span)];
    let given = given.into_iter().chain([f.scene.file.as_ref().map(|p| &p.span)]).flatten();
    if let (Some(span), true) = (given.clone().next(), given.clone().nth(1).is_some()) {
        return Err(doc
            .bad(span, "builtin, road and file exclude each other")
            .remedy("keep one of them")
            .into());
    }
    let scene = match (&f.scene.road, &f.scene.file) {
        (None, Some(path)) => SceneSource::File {
            options: options(ImportTable::from(&f.scene), path)?,
            path: doc.beside(path)?,
        },
        (road, _) => {
            let import = ImportTable::from(&f.scene);
            if let Some(span) = import.first_span() {
                return Err(doc
                    .bad(span, "applies only to a mesh file")
                    .remedy("give file, or remove it")
                    .into());
            }
            match road {
                Some(path) if unwritten == Some(path.value.as_str()) => {
                    SceneSource::Road { path: file.with_file_name(&path.value) }
                }
                Some(path) => SceneSource::Road { path: doc.beside(path)? },
                None => SceneSource::Builtin(f.scene.builtin.as_ref().map_or(Builtin::Empty, |b| b.value)),
            }
        }
    };
    let mut points = Vec::with_capacity(f.point.len());
    for (i, p) in f.point.iter().enumerate() {
        let name = if p.name.is_empty() { format!("point {}", i + 1) } else { p.name.clone() };
        let key = format!("point[{i}]");
        let (position_m, velocity_mps, trajectory) =
            places.of(&key, &name, (&p.position_m, &p.velocity_mps, &p.trajectory), &p.rcs_dbsm.span)?;
        points.push(PointTarget {
            name,
            class: p.class.clone(),
            position_m,
            velocity_mps,
            trajectory,
            rcs_dbsm: p.rcs_dbsm.value,
        });
    }
    let mut objects = Vec::with_capacity(f.object.len());
    for (i, o) in f.object.iter().enumerate() {
        let import = ImportTable::from(o);
        let no_import = || -> Result<()> {
            match import.first_span() {
                Some(span) => Err(doc.bad(span, "applies only to a mesh file").remedy("remove it").into()),
                None => Ok(()),
            }
        };
        let source = match (&o.file, &o.reflector, &o.vehicle, &o.rcs_table) {
            (Some(path), None, None, None) => {
                ObjectSource::File { options: options(import, path)?, path: doc.beside(path)? }
            }
            (None, None, None, Some(path)) => {
                no_import()?;
                ObjectSource::Table { path: doc.beside(path)? }
            }
            (None, Some(spec), None, None) => {
                no_import()?;
                ObjectSource::Reflector { spec: spec.value.clone(), at: doc.bad(&spec.span, "") }
            }
            (None, None, Some(kind), None) => {
                no_import()?;
                ObjectSource::Vehicle { kind: kind.value.clone(), at: doc.bad(&kind.span, "") }
            }
            (file, reflector, vehicle, table) => {
                let given = [file, reflector, vehicle, table].into_iter().flatten().next();
                let problem = match given {
                    Some(first) => {
                        doc.bad(&first.span, "file, reflector, vehicle and rcs_table exclude each other")
                    }
                    None => {
                        BadInput::new("the object is missing").file(doc.file()).key(format!("object[{i}]"))
                    }
                };
                return Err(problem
                    .remedy("give one of file = \"x.glb\", reflector = \"type1:width_m=0.16\", vehicle = \"sedan\" and rcs_table = \"x.csv\"")
                    .into());
            }
        };
        let class = match (&source, o.class.is_empty()) {
            (ObjectSource::Reflector { .. }, true) => "reflector".into(),
            _ => o.class.clone(),
        };
        let name = match &o.vehicle {
            Some(kind) if o.name.is_empty() => format!("{} {}", kind.value, i + 1),
            _ => o.name.clone(),
        };
        let given = [&o.file, &o.reflector, &o.vehicle, &o.rcs_table];
        let span = given.into_iter().flatten().next().map_or(0..0, |g| g.span.clone());
        let called = if name.is_empty() { format!("object {}", i + 1) } else { name.clone() };
        let (position_m, velocity_mps, trajectory) = places.of(
            &format!("object[{i}]"),
            &called,
            (&o.position_m, &o.velocity_mps, &o.trajectory),
            &span,
        )?;
        let [yaw, pitch, roll] = [o.yaw_deg, o.pitch_deg, o.roll_deg].map(f64::to_radians);
        objects.push(Placed {
            name,
            class,
            source,
            pose: Pose::from_yaw_pitch_roll(position_m, yaw, pitch, roll),
            velocity_mps,
            trajectory,
        });
    }
    let mut interferers = Vec::with_capacity(f.interferer.len());
    for (i, t) in f.interferer.iter().enumerate() {
        interferers.push(interferer::build(&mut places, &format!("interferer[{i}]"), t)?);
    }
    let ramps = radars.iter().all(|r| matches!(r.waveform, Waveform::Fmcw(_)));
    if let (Some(t), false) = (f.interferer.first(), ramps) {
        return Err(doc
            .bad(&t.carrier_hz.span, "interference is modelled only for radars with linear ramps")
            .remedy("remove the interferer, or change the radar's waveform.kind to \"fmcw\"")
            .into());
    }
    if f.mutual_interference && !ramps {
        return Err(BadInput::new("interference is modelled only for radars with linear ramps")
            .file(file)
            .key("mutual_interference")
            .value(true)
            .allowed("false, unless all radars have one ramp and multiplex \"tdm\"")
            .remedy("remove it, or change waveform.kind of the radars to \"fmcw\"")
            .into());
    }
    let plain = |r: &Radar| r.waveform.parts() == 1 && r.multiplex == Multiplex::Tdm;
    if f.mutual_interference && !radars.iter().all(plain) {
        return Err(BadInput::new(
            "interference is modelled only for radars with one ramp and TDM transmitters",
        )
        .file(file)
        .key("mutual_interference")
        .value(true)
        .allowed("false, unless all radars have one ramp and multiplex \"tdm\"")
        .remedy("remove it, or describe the transmission of the others as [[interferer]]")
        .into());
    }
    let ego = match (on_road(&doc, &f)?, &f.ego.trajectory) {
        (Some(on), None) => EgoPlan::OnRoad(Box::new(on)),
        (_, trajectory) => {
            let motion = match trajectory {
                None => None,
                Some(t) => {
                    check_ego_once(&doc, &f.ego)?;
                    Some(places.along("ego.trajectory", "ego", t)?.motion)
                }
            };
            let ego = Ego {
                position_m: doc.vector(&f.ego.position_m)?,
                yaw_rad: f.ego.yaw_deg.value.to_radians(),
                speed_mps: f.ego.speed_mps.value,
                motion,
            };
            if ego.motion.is_none() {
                places.check_place(
                    doc.bad(&f.ego.speed_mps.span, ""),
                    ego.at(last_s).translation_m,
                    last_s,
                )?;
            }
            EgoPlan::Free(ego)
        }
    };
    let trajectories = places.lasting;
    let gridless = |r: &&Radar| r.processing.angle.method.is_gridless();
    if f.output.angle_spectra
        && let Some(radar) = radars.iter().find(gridless)
    {
        return Err(BadInput::new(format!("radar '{}' has an angle method without a spectrum", radar.name))
            .file(doc.file())
            .key("output.angle_spectra")
            .value(true)
            .remedy("remove it, or give the radar another angle method, such as music")
            .into());
    }
    Ok(Scenario {
        name: f.name,
        seed: f.seed,
        radars,
        scene,
        points,
        objects,
        interferers,
        mutual_interference: f.mutual_interference,
        weather: weather::build(&doc, &f.weather)?,
        ego,
        frames,
        trace: TraceSettings {
            rays: f.trace.rays,
            bounces: match &f.trace.bounces {
                Some(n) => n.value,
                None => BOUNCES.min(f.trace.most_bounces.as_ref().map_or(BOUNCES, |n| n.value)).max(1),
            },
            most_bounces: match (&f.trace.most_bounces, &f.trace.bounces) {
                (Some(n), Some(least)) => {
                    doc.in_range(n, least.value..=MOST_BOUNCES, "bounces at most, no fewer than `bounces`")?
                }
                (Some(n), None) => n.value,
                (None, Some(_)) => 0,
                (None, None) => MOST_BOUNCES,
            },
            accuracy_db: f.trace.accuracy_db,
            facets: f.trace.facets,
            floor_db: f.trace.floor_db.as_ref().map(|db| db.value),
            exact: exact(&doc, &f.trace)?,
            convention: f.trace.convention,
        },
        lidar: lidar::build(&doc, &f.lidar)?,
        output: f.output,
        trajectories,
    })
}

fn frames(t: &FramesTable) -> Frames {
    Frames { count: t.count, interval_s: t.interval_s }
}

/// Returns an error if the vehicle has a trajectory and also a position, heading, speed or road.
fn check_ego_once(doc: &Document<'_>, ego: &EgoTable) -> Result<()> {
    let place = (ego.position_m.value != [0.0; 3]).then_some(("ego.position_m", &ego.position_m.span));
    let yaw = (ego.yaw_deg.value != 0.0).then_some(("ego.yaw_deg", &ego.yaw_deg.span));
    let speed = (ego.speed_mps.value != 0.0).then_some(("ego.speed_mps", &ego.speed_mps.span));
    let on_road = ego.on_road.as_ref().map(|t| ("ego.on_road", &t.s_m.span));
    let drive = ego.drive.as_ref().map(|t| ("ego.drive", &t.speed_mps.span));
    match place.or(yaw).or(speed).or(on_road).or(drive) {
        None => Ok(()),
        Some((key, span)) => Err(doc
            .bad(span, format!("{key} and ego.trajectory exclude each other"))
            .key(key)
            .remedy("keep one of them")
            .into()),
    }
}

/// Whether every echo is kept. Errors: a floor beside it.
fn exact(doc: &Document<'_>, trace: &TraceTable) -> Result<bool> {
    match &trace.floor_db {
        Some(floor) if trace.exact.value => Err(doc
            .bad(&floor.span, "floor_db and exact = true exclude each other")
            .remedy("remove one of the two")
            .into()),
        _ => Ok(trace.exact.value),
    }
}

/// The road that the ego vehicle follows. Errors: no road in the scene, a position beside it, a speed given twice.
fn on_road(doc: &Document<'_>, f: &ScenarioFile) -> Result<Option<OnRoad>> {
    let ego = &f.ego;
    let Some(t) = &ego.on_road else {
        return match &ego.drive {
            Some(d) => Err(doc
                .bad(&d.speed_mps.span, "applies only to a vehicle on a road")
                .key("ego.drive")
                .remedy("add [ego.on_road]")
                .into()),
            None => Ok(None),
        };
    };
    let s_span = &t.s_m.span;
    if f.scene.road.is_none() {
        let e = doc.bad(s_span, "there is no road to follow").key("ego.on_road");
        return Err(e.remedy("give scene.road = \"FILE.toml\"").into());
    }
    if ego.position_m.value != [0.0; 3] || ego.yaw_deg.value != 0.0 {
        let e = doc
            .bad(&ego.position_m.span, "ego.on_road excludes ego.position_m and ego.yaw_deg")
            .key("ego.position_m");
        return Err(e.remedy("keep position_m and yaw_deg, or on_road").into());
    }
    let drive = match &ego.drive {
        None => Drive::steady(doc.in_range(&ego.speed_mps, -150.0..=150.0, "give metres per second")?),
        Some(d) if ego.speed_mps.value != 0.0 => {
            let e = doc.bad(&ego.speed_mps.span, "ego.speed_mps and ego.drive exclude each other");
            return Err(e.remedy(format!("keep the speed of [ego.drive], {}", d.speed_mps.value)).into());
        }
        Some(d) => super::drive::build(doc, d)?,
    };
    Ok(Some(OnRoad {
        road: t.road.as_ref().map(|r| r.value.clone()),
        lane: t.lane.as_ref().map(|l| l.value),
        s_m: t.s_m.value,
        offset_m: t.offset_m,
        against: t.against,
        drive,
        at: doc.bad(t.lane.as_ref().map_or(s_span, |l| &l.span), ""),
    }))
}

impl<'a> From<&'a SceneTable> for ImportTable<'a> {
    fn from(t: &'a SceneTable) -> Self {
        ImportTable {
            unit: &t.unit,
            up: &t.up,
            animation: &t.animation,
            smooth_deg: &t.smooth_deg,
            default_material: &t.default_material,
            materials: &t.materials,
        }
    }
}

impl<'a> From<&'a ObjectTable> for ImportTable<'a> {
    fn from(t: &'a ObjectTable) -> Self {
        ImportTable {
            unit: &t.unit,
            up: &t.up,
            animation: &t.animation,
            smooth_deg: &t.smooth_deg,
            default_material: &t.default_material,
            materials: &t.materials,
        }
    }
}

/// A commented file to start from, for `catseye init`.
///
/// # Errors
/// Returns an error for an unknown kind, or one that is not there yet.
pub fn template(kind: &str) -> Result<&'static str> {
    const KINDS: [&str; 5] = ["scenario", "road", "radar", "recipe", "study"];
    let text = match kind {
        "road" => Ok(include_str!("../../scenes/presets/template_road.toml")),
        "scenario" => Ok(include_str!("../../scenes/presets/template_scenario.toml")),
        "radar" => Ok(include_str!("../../scenes/presets/template_radar.toml")),
        "study" => Ok(include_str!("../../scenes/presets/template_study.toml")),
        "recipe" => Ok(include_str!("../../scenes/recipes/template.toml")),
        _ => {
            let b = BadInput::new("is not a kind of file").value(clip(kind)).allowed(KINDS.join(", "));
            Err(match nearest(kind, KINDS) {
                Some(n) => b.remedy(format!("did you mean '{n}'?")),
                None => b.remedy("choose one of them"),
            }
            .into())
        }
    };
    text.map(without_schema)
}

/// A text of the project's own folder without the line that tells editors where its schema is: elsewhere there is none.
pub fn without_schema(text: &str) -> &str {
    match text.split_once('\n') {
        Some((first, rest)) if first.starts_with("#:schema") => rest,
        _ => text,
    }
}

/// JSON schemas of the TOML files: (file name in `schema/`, text). `lane` tells the table that this room passes over.
pub fn schemas(
    lane: impl FnOnce(&mut schemars::SchemaGenerator) -> schemars::Schema,
) -> [(&'static str, String); 2] {
    let text = |s: schemars::Schema| serde_json::to_string_pretty(&s).unwrap_or_default() + "\n";
    let mut generator = schemars::SchemaGenerator::default();
    let mut scenario = generator.root_schema_for::<ScenarioFile>();
    let lane = lane(&mut generator);
    let root = scenario.ensure_object();
    root.insert("$defs".into(), generator.take_definitions(true).into());
    if let Some(serde_json::Value::Object(keys)) = root.get_mut("properties") {
        keys.insert("lane".into(), lane.into());
    }
    [("radar.schema.json", text(schemars::schema_for!(RadarFile))), ("scenario.schema.json", text(scenario))]
}
