//! Trials of lane numbers by radar tracks and a map (document L): a radar over a road, vehicles that pass it, and the lane that each
//! is given beside the one where it is. Tracks come from the whole chain; the map is that of the road with an error of its survey.

mod passes;
mod pictures;
mod report;
mod rival;
mod sight;
mod traffic;

pub use passes::{Pass, Scan};
pub(super) use rival::rival;
pub use sight::{Mover, Sight};

use super::{Given, SpeedSensor, Trial};
use catseye::error::{BadInput, Error, Result};
use catseye::rng::Draws;
use catseye::road::plan::ScenePlan;
use catseye::road::scene_toml;
use catseye::road::site::Site;
use catseye::road::traffic::VEHICLES;
use catseye::scene::scenario::{Scenario, SceneSource};
use catseye::scene::toml_file::{At, referred};
use catseye_lane::hd_map::accuracy::SceneKind;
use catseye_lane::hd_map::estimator::{Body, MapLanes, Options};
use catseye_lane::hd_map::of_road::{self, Stripes};
use catseye_lane::hd_map::{self, Across, HdMap, RadarPose, Wgs84, file};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The scenes of document L.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    Straight,
    Curve,
    Ramp,
    EmergencyBay,
}

impl Kind {
    pub fn scene(self) -> SceneKind {
        match self {
            Kind::Straight => SceneKind::Straight,
            Kind::Curve => SceneKind::Curve,
            Kind::Ramp => SceneKind::Ramp,
            Kind::EmergencyBay => SceneKind::EmergencyBay,
        }
    }
}

/// Which line across the road is divided into lanes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Divided {
    /// Square to the road at the target.
    #[default]
    RoadNormal,
    /// Square to the radar's axis, as in the document.
    RadarAxis,
}

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
    /// A map file (JSON or TOML, see `lane/hd_map/file.rs`), relative to the scenario's file. Default: the map of the scene's roads.
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
    pub across: Divided,
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
            across: Divided::RoadNormal,
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
    /// Errors: the first value out of its range.
    pub fn check(&self) -> Result<()> {
        let within = |key: &str, value: f64, low: f64, high: f64| -> Result<()> {
            if value.is_finite() && (low..=high).contains(&value) {
                return Ok(());
            }
            let bad = BadInput::new("is out of range").key(format!("lane.hd_map.{key}")).value(value);
            Err(bad.allowed(format!("{low}..={high}")).remedy("leave it out for its default").into())
        };
        within("origin[0]", self.origin[0], -89.9, 89.9)?;
        within("origin[1]", self.origin[1], -180.0, 180.0)?;
        within("origin[2]", self.origin[2], -1e4, 1e4)?;
        within("north_deg", self.north_deg, -360.0, 360.0)?;
        within("map_std_m", self.map_std_m, 0.0, 5.0)?;
        within("map_spacing_m", self.map_spacing_m, 0.5, 1000.0)?;
        within("place_std_m", self.place_std_m, 0.0, 100.0)?;
        within("azimuth_std_deg", self.azimuth_std_deg, 0.0, 90.0)?;
        within("echo_height_m", self.echo_height_m, 0.0, 10.0)?;
        within("fastest_mps", self.fastest_mps, 1.0, 200.0)?;
        within("slowest_mps", self.slowest_mps, 0.1, 20.0)?;
        within("speed_std_mps", self.speed_std_mps, 0.0, 10.0)?;
        within("wander_m", self.wander_m, 0.0, 2.0)?;
        within("together", f64::from(self.together), 1.0, 100.0)?;
        within("near_m", self.near_m, 0.0, 1e4)?;
        within("far_m", self.far_m, self.near_m + 10.0, 1e5)?;
        within("view_deg", self.view_deg, 1.0, 180.0)?;
        let unknown = self.kinds.iter().find(|k| !VEHICLES.contains(&k.as_str()));
        if self.kinds.is_empty() || unknown.is_some() {
            let value = unknown.map_or("[]", String::as_str);
            let bad = BadInput::new("is no kind of vehicle").key("lane.hd_map.kinds").value(value);
            return Err(bad.allowed(VEHICLES.join(", ")).remedy("name one or more of them").into());
        }
        for (i, s) in self.scene.iter().enumerate() {
            within(&format!("scene[{i}].vehicles"), f64::from(s.vehicles), 1.0, 1e6)?;
            within(&format!("scene[{i}].others"), f64::from(s.others), 0.0, 100.0)?;
            within(&format!("scene[{i}].radar_s_m"), s.radar_s_m.unwrap_or(0.0), 0.0, 1e6)?;
        }
        Ok(())
    }

    fn anchor(&self) -> RadarPose {
        let [latitude, longitude, height] = self.origin;
        RadarPose {
            position: Wgs84::new(latitude, longitude, height),
            azimuth_rad: self.north_deg.to_radians(),
        }
    }
}

/// One scene of a trial, ready to be driven.
pub struct Stage {
    pub kind: Option<Kind>,
    pub name: String,
    pub scenario: Scenario,
    /// Of a road file; None for others, which are driven as they are.
    pub plan: Option<ScenePlan>,
    /// Lanes as they are; empty where nothing is known of them.
    pub lanes: Vec<Stripes>,
    pub table: Option<SceneTable>,
}

/// True lanes are told by lines of points this near to each other, m.
const TRUTH_STEP_M: f64 = 2.0;

fn stages(given: &Given<'_>, settings: &Settings) -> Result<Vec<Stage>> {
    let own = || -> Result<Stage> {
        let scenario = given.scenario.clone();
        let name = scenario.name.clone();
        let stage = |plan, lanes| Stage { kind: None, name, scenario, plan, lanes, table: None };
        if let SceneSource::Road { path } = &given.scenario.scene {
            let plan = scene_toml::load(path)?;
            let lanes = plan.roads.iter().map(|r| Stripes::of_road(&r.road, TRUTH_STEP_M)).collect();
            return Ok(stage(Some(plan), lanes));
        }
        let site = Site::new(given.scenario)?;
        let labels = site.road.as_ref().map_or(&[][..], |r| &r.roads[..]);
        Ok(stage(None, labels.iter().map(|l| Stripes::of_label(l, TRUTH_STEP_M)).collect()))
    };
    if settings.scene.is_empty() {
        return Ok(vec![own()?]);
    }
    let drawn = |(i, table): (usize, &SceneTable)| -> Result<Stage> {
        let mut scenario = given.scenario.clone();
        if let Some(road) = &table.road {
            scenario.scene = SceneSource::Road { path: referred(given.path, road)? };
        }
        let SceneSource::Road { path } = &scenario.scene else {
            let bad =
                BadInput::new("vehicles can be drawn on the roads of a road file only").file(given.path);
            return Err(bad
                .key(format!("lane.hd_map.scene[{i}].road"))
                .remedy("name a road scene (TOML)")
                .into());
        };
        let mut plan = scene_toml::load(path)?;
        for road in &mut plan.roads {
            road.things.retain(|t| !matches!(t.source, catseye::road::plan::Source::Vehicle(_)));
        }
        if let (Some(on), Some(s_m)) = (&mut scenario.ego.on_road, table.radar_s_m) {
            on.s_m = s_m;
        }
        let lanes: Vec<Stripes> =
            plan.roads.iter().map(|r| Stripes::of_road(&r.road, TRUTH_STEP_M)).collect();
        let numbers: Vec<i32> = plan.roads.iter().flat_map(|r| r.road.lanes().map(|l| l.2.number)).collect();
        if let Some(wrong) = table.lanes.iter().find(|n| !numbers.contains(n)) {
            let all = numbers.iter().map(i32::to_string).collect::<Vec<_>>().join(", ");
            let bad = BadInput::new("is not a lane of the scene").file(given.path).value(wrong);
            return Err(bad.key(format!("lane.hd_map.scene[{i}].lanes")).allowed(all).into());
        }
        let name = table.kind.map_or_else(|| plan.name.clone(), |k| k.scene().name().to_string());
        Ok(Stage { kind: table.kind, name, scenario, plan: Some(plan), lanes, table: Some(table.clone()) })
    };
    settings.scene.iter().enumerate().map(drawn).collect()
}

/// The map that the estimator gets.
fn map_of(given: &Given<'_>, settings: &Settings, stage: &Stage, draws: &mut Draws) -> Result<HdMap> {
    if let Some(name) = &settings.map {
        return file::read(&referred(given.path, name)?);
    }
    let bad = |problem: String| -> Error {
        let remedy =
            "give lane.hd_map.map, a map file, or a scene with roads whose lanes have numbers of their own";
        BadInput::new(problem).file(given.path).key("lane.hd_map.map").remedy(remedy).into()
    };
    let anchor = settings.anchor();
    let spaced: Vec<Stripes> = match &stage.plan {
        Some(plan) => plan.roads.iter().map(|r| Stripes::of_road(&r.road, settings.map_spacing_m)).collect(),
        None => match Site::new(&stage.scenario)?.road {
            Some(road) => road.roads.iter().map(|l| Stripes::of_label(l, settings.map_spacing_m)).collect(),
            None => Vec::new(),
        },
    };
    let map = of_road::map(&spaced, &anchor, &mut || settings.map_std_m * draws.normal())
        .ok_or_else(|| bad("the origin is no place on the earth".into()))?;
    map.check().map_err(|fault| bad(format!("the scene's roads make no map: {fault}")))?;
    Ok(map)
}

fn estimator(
    settings: &Settings,
    map: &HdMap,
    radar: &catseye::scene::radar::Radar,
    o: &Change,
) -> Result<MapLanes> {
    let at = radar.mounting.translation_m;
    let ahead = radar.mounting.direction(glam::DVec3::X);
    let across = match o.across.unwrap_or(settings.across) {
        Divided::RoadNormal => Across::RoadNormal,
        Divided::RadarAxis => Across::RadarAxis,
    };
    let options = Options {
        settings: hd_map::Settings { across, map_std_m: settings.map_std_m, ..hd_map::Settings::default() },
        radar_at_m: [at.x, at.y],
        radar_yaw_rad: ahead.y.atan2(ahead.x),
        place_std_m: settings.place_std_m,
        azimuth_std_rad: settings.azimuth_std_deg.to_radians(),
        body: o.to_middle.unwrap_or(settings.to_middle).then_some(Body::CAR),
        ..Options::default()
    };
    MapLanes::new(map.clone(), options)
        .map_err(|fault| BadInput::new(fault.to_string()).key("lane.hd_map.map").into())
}

/// What another reading of the same tracks does otherwise.
#[derive(Debug, Clone, Copy, Default)]
struct Change {
    across: Option<Divided>,
    to_middle: Option<bool>,
}

/// Runs the trial. Errors: settings out of their ranges; a scene without lanes and no map; a radar that tells no azimuth.
pub fn run(given: &Given<'_>, settings: &Settings) -> Result<Trial> {
    settings.check()?;
    let which = sight::radar(given)?;
    let stages = stages(given, settings)?;
    let mut total = 0;
    for stage in &stages {
        // About as many in each run.
        let groups = traffic::groups(stage, settings, &stage.scenario)?.len() as u64;
        total += groups * u64::from(given.scenario.frames.count) * u64::from(given.runs);
    }
    let mut all = report::All::new(given, settings, &stages);
    let mut done = 0;
    for run in 0..given.runs {
        for (k, stage) in stages.iter().enumerate() {
            let scenario = Scenario { seed: given.scenario_of(run).seed, ..stage.scenario.clone() };
            // Survey errors are those of one site: one draw for each run and scene.
            let mut draws =
                Draws::new(scenario.seed as u32 ^ (scenario.seed >> 32) as u32, 0x3a90 + k as u32);
            let map = map_of(given, settings, stage, &mut draws)?;
            let survey = [draws.normal(), draws.normal(), draws.normal()];
            let radar = &scenario.radars[which];
            let mut own = estimator(settings, &map, radar, &Change::default())?;
            let other = |c: Change| estimator(settings, &map, radar, &c);
            let mut others = [
                other(Change { across: Some(Divided::RadarAxis), ..Change::default() })?,
                other(Change { to_middle: Some(false), ..Change::default() })?,
            ];
            let groups = traffic::groups(stage, settings, &scenario)?;
            for (g, group) in groups.iter().enumerate() {
                let mut seeded = scenario.clone();
                seeded.seed = scenario.seed.wrapping_add(1000 * g as u64);
                let site = match &group.plan {
                    Some(plan) => Site::on(&seeded, plan.clone())?,
                    None => Site::new(&seeded)?,
                };
                let drive = super::Drive::new(&site, given.engine)?;
                let mut bus = SpeedSensor::new(seeded.seed, settings.speed_std_mps, 0.0);
                let mut follower = sight::Follower::new()?;
                let mut passes = passes::Passes::new(group);
                for index in 0..drive.frames() {
                    let time_s = drive.time_s(index);
                    let seen: Sight = given
                        .kept(&format!("run{run}_scene{k}_group{g}_frame{index}"), || {
                            Ok(sight::see(&drive, &drive.frame(which, index)?, settings))
                        })?;
                    done += 1;
                    (given.watch)(done, total);
                    let level = drive.level(time_s);
                    let speed = bus.read(level.speed_mps);
                    let tracks =
                        follower.step(&seen, drive.radar(which), &level, speed.value, settings, time_s)?;
                    let pose = place(settings, &level, radar, survey)
                        .ok_or_else(|| BadInput::new("is no place on the earth").key("lane.hd_map.origin"))?;
                    let look = catseye_lane::SensorInput {
                        time_s,
                        speed_mps: Some(speed),
                        tracks: &tracks,
                        place: Some(pose),
                        ..catseye_lane::SensorInput::default()
                    };
                    let clock = std::time::Instant::now();
                    let lanes = own.targets(&look);
                    let estimate = catseye_lane::LaneEstimator::estimate(&mut own, &look);
                    let seconds = clock.elapsed().as_secs_f64();
                    let lanes = lanes.map_err(|why| Error::Failed(format!("hd-map: {why}")))?;
                    let varied = others.each_mut().map(|o| o.targets(&look).unwrap_or_default());
                    passes.look(&site.scene, &stage.lanes, &level, &look, &mut own, (&lanes, &varied), index);
                    all.step(run, index, &drive, &stage.lanes, &level, estimate, seconds);
                }
                all.group(run, k, g, passes, &stage.lanes, &drive);
            }
        }
    }
    Ok(all.finish())
}

/// The radar's place as it is known: with the errors of its survey.
fn place(
    settings: &Settings,
    level: &super::drive::Level,
    radar: &catseye::scene::radar::Radar,
    survey: [f64; 3],
) -> Option<RadarPose> {
    let mount = radar.mounting.translation_m;
    let ahead = radar.mounting.direction(glam::DVec3::X);
    let at = level.to_world(mount.truncate()) + glam::DVec2::new(survey[0], survey[1]) * settings.place_std_m;
    let heading =
        level.heading_rad + ahead.y.atan2(ahead.x) + survey[2] * settings.azimuth_std_deg.to_radians();
    RadarPose::within(&settings.anchor(), at.extend(mount.z), heading)
}
