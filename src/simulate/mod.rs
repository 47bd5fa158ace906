//! The whole chain for one frame.

pub mod thermal_floor;
pub mod truth;

use crate::adc::budget::{Budget, trim};
use crate::adc::interference::{self, Arrival, RadarState};
use crate::adc::synthesis::{Levels, SynthesisStats};
use crate::base::control::Control;
use crate::base::error::{Error, Result};
use crate::base::frames::{Pose, Sensor, World};
use crate::base::units::{power_from_db, wavenumber};
use crate::detect::points::Point;
use crate::detect::{Bodies, label, locate};
use crate::dsp::RangeDoppler;
use crate::engine::{AnyCube, Engine, FrameInput, MadeFrame};
use crate::geom::{Facets, Geometry, RigidScene, curved, remarks as of_scene};
use crate::scene::interferer::Interferer;
use crate::scene::radar::Radar;
use crate::scene::scenario::{Ego, SitedScenario};
use crate::scene::{Object, Scene, Shape};
use crate::trace::air::Air;
use crate::trace::{Echoes, TraceOptions};
use glam::DVec3;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Instant;
use thermal_floor::thermal_floor_w;

/// Seconds of each stage of a frame, on the host's clock.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Stages {
    /// Placing the scene, s.
    pub geometry_s: f64,
    /// Time for tracing, s.
    pub trace_s: f64,
    /// Synthesis of the cube, s.
    pub synthesis_s: f64,
    /// Transforms and detection, s.
    pub processing_s: f64,
    /// Angles and points, s.
    pub angles_s: f64,
}

impl Stages {
    /// Their sum, s.
    pub fn total_s(&self) -> f64 {
        self.geometry_s + self.trace_s + self.synthesis_s + self.processing_s + self.angles_s
    }
}

/// All that one frame gives.
#[derive(Debug, Clone)]
pub struct Frame {
    /// Number of the frame.
    pub index: u32,
    /// Number of the radar in the scenario.
    pub radar: usize,
    /// Middle of the frame, from the middle of frame 0.
    pub time_s: f64,
    /// Pose of the radar at that time.
    pub pose: Pose<Sensor, World>,
    /// Velocity of the radar in the world, m/s.
    pub velocity_mps: DVec3,
    /// Number of triangles that were traced.
    pub triangles: usize,
    /// Echoes of the scene.
    pub echoes: Echoes,
    /// What the front end did with them.
    pub front_end: SynthesisStats,
    /// Samples; None where they were not asked for ([`Prepared::without_cubes`]).
    pub cube: Option<AnyCube>,
    /// Range-Doppler maps, one for each ramp.
    pub maps: Vec<RangeDoppler<f64>>,
    /// Points.
    pub points: Vec<Point>,
    /// Time of each stage.
    pub stages: Stages,
}

impl Frame {
    /// The samples.
    ///
    /// # Errors
    /// Returns an error if the frame was made without them.
    pub fn samples(&self) -> Result<&AnyCube> {
        self.cube.as_ref().ok_or_else(no_samples)
    }

    /// The samples, which the frame then has no more.
    ///
    /// # Errors
    /// Returns an error if the frame was made without them.
    pub fn take_samples(&mut self) -> Result<AnyCube> {
        self.cube.take().ok_or_else(no_samples)
    }
}

fn no_samples() -> Error {
    Error::Failed("this frame was made without its samples: leave out Prepared::without_cubes".into())
}

/// Pose of the radar at a time from the middle of frame 0, and its velocity in the world, m/s.
pub fn radar_pose(radar: &Radar, ego: &Ego, time_s: f64) -> (Pose<Sensor, World>, DVec3) {
    let now = ego.at(time_s);
    if radar.motion.is_some() {
        let all = radar.on_vehicle(time_s).then(&now);
        return (Pose::new(all.rotation, all.translation_m), all.velocity_mps);
    }
    let pose = radar.mounting.then(&ego.pose(time_s));
    (pose, now.velocity_at(pose.translation_m))
}

/// Each radar has noise of its own.
fn radar_seed(scenario: &SitedScenario, which: usize) -> u64 {
    scenario.seed ^ ((which as u64) << 48)
}

/// What is left out of a frame stays in sum this far under the noise of a cell after all channels, dB.
const BUDGET_DB: f64 = 10.0;
/// Share of the power of all echoes that may be left out where there is no noise.
const BUDGET_SHARE: f64 = 1e-10;
/// Single echoes of facets are not worked out this far under `trace.floor_db`, dB.
const FLOOR_MARGIN_DB: f64 = 30.0;
/// Beams that the limit of bounces ends are asked for where they could return so much more than what may be left out, dB.
const CUT_MARGIN_DB: f64 = 30.0;

/// Which echoes of a radar's frames may be left out, as the scenario says.
pub fn budget(scenario: &SitedScenario, which: usize) -> Budget {
    let settings = &scenario.trace;
    let radar = &scenario.radars[which];
    // In one cell of the map, and of the angles from all channels.
    let noise_w = thermal_floor_w(radar).map(|w| w / radar.virtual_channels() as f64);
    match (settings.exact, settings.floor_db, noise_w) {
        (true, ..) | (false, Some(_), None) => Budget::Nothing,
        (false, Some(db), Some(w)) => Budget::Each(w * power_from_db(db)),
        (false, None, _) => noise_budget(radar),
    }
}

/// The budget of frames that ask for nothing else.
pub fn noise_budget(radar: &Radar) -> Budget {
    thermal_floor_w(radar).map_or(Budget::Share(BUDGET_SHARE), |w| {
        Budget::Sum(w / radar.virtual_channels() as f64 * power_from_db(-BUDGET_DB))
    })
}

/// Settings of a scenario's frame as the tracer takes them.
///
/// # Errors
/// Returns an error for weather at a frequency for which it is not known.
pub fn trace_options(scenario: &SitedScenario, which: usize, frame: u32) -> Result<TraceOptions> {
    let settings = &scenario.trace;
    let radar = &scenario.radars[which];
    // Facets share a corner whose sum may be far below what each of them returns, but seldom as far above: what is much weaker than
    // the floor is not even worked out.
    let least = match budget(scenario, which) {
        Budget::Each(w) => (w * power_from_db(-FLOOR_MARGIN_DB)).sqrt() / Levels::new(radar).full_gain(),
        _ => 0.0,
    };
    Ok(TraceOptions {
        least,
        // What all together may bring is judged to some decibels, by the beams that could bring most.
        least_cut: Some(match budget(scenario, which) {
            Budget::Each(w) | Budget::Sum(w) => {
                (w * power_from_db(CUT_MARGIN_DB)).sqrt() / Levels::new(radar).full_gain()
            }
            _ => 0.0,
        }),
        merge: !settings.exact,
        places: scenario.output.return_places,
        bounces: settings.bounces as usize,
        most_bounces: settings.most_bounces as usize,
        convention: settings.convention,
        accuracy_db: settings.accuracy_db,
        bandwidth_hz: scenario.radars[which].bandwidth_hz(),
        rays: settings.rays,
        // All radars see the same ground.
        seed: scenario.seed,
        frame,
        radar_spin_rad_per_s: {
            let time_s = scenario.frames.time_s(frame);
            radar.on_vehicle(time_s).then(&scenario.ego.at(time_s)).spin_rad_per_s
        },
        air: Air::of(&scenario.weather, scenario.radars[which].carrier_hz)?,
        ..Default::default()
    })
}

/// Frame `index` of a scenario's first radar, from `scene` (what `Scenario::build` gave) to points. The same scenario,
/// seed, engine and index give the same frame, whatever was run before.
///
/// # Errors
/// Returns an error if the frame needs more memory than the machine has, or if the engine fails.
pub fn simulate(engine: &Engine, scenario: &SitedScenario, scene: &Scene, index: u32) -> Result<Frame> {
    simulate_with(engine, scenario, scene, (0, index), &Depths::default(), Control::default())
}

/// [`simulate`] of radar number `which`, with progress and cancellation of the synthesis. `depths` keeps between the frames of one scenario
/// how many bounces they follow; without it frame 0 is traced again for each.
///
/// # Errors
/// Returns an error if the frame needs more memory than the machine has, the engine fails, or `control` is cancelled.
pub fn simulate_with(
    engine: &Engine,
    scenario: &SitedScenario,
    scene: &Scene,
    (which, index): (usize, u32),
    depths: &Depths,
    control: Control<'_>,
) -> Result<Frame> {
    Prepared::of(scenario, scene, which..which + 1)?.sharing(depths).frame(engine, which, index, control)
}

/// [`Prepared::remarks`] as radar number `which` sees the scene.
///
/// # Errors
/// Returns an error if a material or a mesh of the scene cannot be used at the frequency of that radar.
pub fn remarks(scenario: &SitedScenario, scene: &Scene, which: usize) -> Result<Vec<String>> {
    Prepared::of(scenario, scene, which..which + 1)?.remarks()
}

/// A scene and its scenario with what all their frames share: curved surfaces cut as finely as the accuracy asks, what belongs to
/// each mesh, bodies that stand still, and the geometry where nothing moves.
pub struct Prepared<'a> {
    scenario: &'a SitedScenario,
    scene: &'a Scene,
    first: usize,
    radars: Vec<RadarView<'a>>,
    depths: Depths,
    /// Whether frames have their samples.
    cubes: bool,
}

/// What a radar hears in a frame.
#[derive(Debug, Clone)]
pub struct Heard {
    /// Middle of the frame, from the middle of frame 0.
    pub time_s: f64,
    /// Pose of the radar at that time.
    pub pose: Pose<Sensor, World>,
    /// Velocity of the radar in the world, m/s.
    pub velocity_mps: DVec3,
    /// Number of triangles that were traced.
    pub triangles: usize,
    /// Echoes of the scene.
    pub echoes: Echoes,
    /// Time taken to place the scene and to trace it, s.
    pub seconds: [f64; 2],
}

/// What one radar needs of the scene.
struct RadarView<'a> {
    refined: RigidScene<'a>,
    still: OnceLock<Geometry>,
}

/// How many bounces the frames of each radar follow: as many as its frame 0 had to. Clones share what is known.
#[derive(Debug, Clone, Default)]
pub struct Depths(Arc<Mutex<BTreeMap<usize, usize>>>);

impl Depths {
    fn known(&self) -> MutexGuard<'_, BTreeMap<usize, usize>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<'a> Prepared<'a> {
    /// Prepares the scene for all radars of the scenario.
    ///
    /// # Errors
    /// Returns an error if a curved surface cannot be cut.
    pub fn new(scenario: &'a SitedScenario, scene: &'a Scene) -> Result<Prepared<'a>> {
        Prepared::of(scenario, scene, 0..scenario.radars.len())
    }

    /// Shares with other radars of the scenario how many bounces their frames follow.
    pub fn sharing(self, depths: &Depths) -> Prepared<'a> {
        Prepared { depths: depths.clone(), ..self }
    }

    /// Frames come without their samples: a gpu engine then leaves them on the device.
    pub fn without_cubes(self) -> Prepared<'a> {
        Prepared { cubes: false, ..self }
    }

    fn of(scenario: &'a SitedScenario, scene: &'a Scene, radars: Range<usize>) -> Result<Prepared<'a>> {
        let seen = |radar: &Radar| {
            let cut = {
                let (accuracy_db, most) = (scenario.trace.accuracy_db, scenario.trace.facets as usize);
                curved::sized_within(scene, accuracy_db, wavenumber(radar.carrier_hz), most)?
            };
            let refined = RigidScene::new(cut, radar.carrier_hz, Facets::Curved)?;
            Ok(RadarView { refined, still: OnceLock::new() })
        };
        let first = radars.start;
        Ok(Prepared {
            scenario,
            scene,
            first,
            depths: Depths::default(),
            cubes: true,
            radars: scenario.radars[radars].iter().map(seen).collect::<Result<_>>()?,
        })
    }

    /// Frame `index` of radar number `which`.
    ///
    /// # Errors
    /// Returns an error if the frame needs more memory than the machine has, the engine fails, or `control` is
    /// cancelled.
    pub fn frame(&self, engine: &Engine, which: usize, index: u32, control: Control<'_>) -> Result<Frame> {
        self.frame_within(engine, which, index, budget(self.scenario, which), control)
    }

    /// What the scene's meshes have that may show in frames, as they stand in the first one: one line each, with the object's name,
    /// the number of places and a remedy. None for a scene that is clean.
    ///
    /// # Errors
    /// Returns an error if a material or a mesh of the scene cannot be used at the frequency of the first radar.
    pub fn remarks(&self) -> Result<Vec<String>> {
        let Some(seen) = self.radars.first() else { return Ok(Vec::new()) };
        let radar = &self.scenario.radars[self.first];
        let time_s = self.scenario.frames.time_s(0);
        let mut lines = of_scene::of_meshes(self.scene, radar.carrier_hz)?;
        let (pose, _) = radar_pose(radar, &self.scenario.ego, time_s);
        lines.extend(seen.refined.at(time_s, 0.0)?.remarks(self.scene, pose.translation_m));
        Ok(lines)
    }

    /// What the radar hears in frame `index`, before anything is synthesised.
    ///
    /// # Errors
    /// Returns an error if a material, a mesh or the weather cannot be used at the radar's frequency.
    pub fn echoes(&self, engine: &Engine, which: usize, index: u32) -> Result<Heard> {
        self.heard(engine, which, index, budget(self.scenario, which))
    }

    fn heard(&self, engine: &Engine, which: usize, index: u32, budget: Budget) -> Result<Heard> {
        let (scenario, scene) = (self.scenario, self.scene);
        let radar = &scenario.radars[which];
        let time_s = scenario.frames.time_s(index);
        let (pose, velocity_mps) = radar_pose(radar, &scenario.ego, time_s);
        let mut clock = Clock::start();

        let reach_s = 0.5 * radar.frame_time_s();
        let seen = &self.radars[which - self.first];
        let moving;
        let still = |o: &Object| o.motion.is_none() && o.velocity_mps == DVec3::ZERO;
        let geometry = match scene.objects.iter().all(still) {
            false => {
                moving = seen.refined.at(time_s, reach_s)?;
                &moving
            }
            true => match seen.still.get() {
                Some(known) => known,
                None => {
                    let new = seen.refined.at(0.0, reach_s)?;
                    seen.still.get_or_init(|| new)
                }
            },
        };
        let geometry_s = clock.lap();
        let sway = |dt: f64| {
            let (then, _) = radar_pose(radar, &scenario.ego, time_s + dt);
            then.translation_m - (pose.translation_m + velocity_mps * dt)
        };
        let radar_sway_m = [sway(-reach_s), sway(reach_s)];
        let mut options = TraceOptions { radar_sway_m, ..trace_options(scenario, which, index)? };
        // All frames go as deep as the first has to: echoes that come and go with the depth would flicker.
        if index > 0 && options.most_bounces > options.bounces {
            let known = self.depths.known().get(&which).copied();
            let first = match known {
                Some(n) => n,
                None => self.heard(engine, which, 0, budget)?.echoes.bounces,
            };
            (options.bounces, options.most_bounces) = (first, 0);
        }
        let mut echoes = engine.echoes(geometry, radar, &pose, velocity_mps, &options);
        if index == 0 {
            self.depths.known().insert(which, echoes.bounces);
        }
        trim(radar, &mut echoes, budget);
        let seconds = [geometry_s, clock.lap()];
        Ok(Heard { time_s, pose, velocity_mps, triangles: geometry.triangle_count, echoes, seconds })
    }

    fn frame_within(
        &self,
        engine: &Engine,
        which: usize,
        index: u32,
        budget: Budget,
        control: Control<'_>,
    ) -> Result<Frame> {
        let (scenario, scene) = (self.scenario, self.scene);
        let radar = &scenario.radars[which];
        engine.check_memory(radar, 0)?;
        let seed = radar_seed(scenario, which);
        let Heard { time_s, pose, velocity_mps, triangles, echoes, seconds } =
            self.heard(engine, which, index, budget)?;
        let mut stages = Stages { geometry_s: seconds[0], trace_s: seconds[1], ..Default::default() };
        engine.check_memory(radar, echoes.list.len())?;
        let interference = arrivals(scenario, scene, which, time_s)?;
        let input = FrameInput {
            radar,
            echoes: &echoes,
            interference: &interference,
            seed,
            frame: index,
            wanted: self.cubes,
        };
        let made = engine.frame(&input, control)?;
        let MadeFrame { cube, front_end, mut maps, seconds } = made;
        [stages.synthesis_s, stages.processing_s] = seconds;
        let mut clock = Clock::start();
        let bodies = Bodies::new(scene, time_s, &pose);
        let own = pose.inverse().direction(velocity_mps);
        let points = located(engine, radar, &mut maps, Some(own), (&echoes, &bodies))?;
        stages.angles_s = clock.lap();
        Ok(Frame {
            index,
            radar: which,
            time_s,
            pose,
            velocity_mps,
            triangles,
            echoes,
            front_end,
            cube,
            maps,
            points,
            stages,
        })
    }
}

/// What other radars send to radar number `which`: straight, and by way of the scene's point targets.
fn arrivals(scenario: &SitedScenario, scene: &Scene, which: usize, time_s: f64) -> Result<Vec<Arrival>> {
    let radar = &scenario.radars[which];
    let place = |r: &Radar| {
        let (pose, velocity_mps) = radar_pose(r, &scenario.ego, time_s);
        RadarState { pose, velocity_mps }
    };
    let mut senders: Vec<(Interferer, RadarState)> = scenario
        .interferers
        .iter()
        .map(|i| {
            let (pose, velocity_mps) = i.at(time_s);
            (i.clone(), RadarState { pose, velocity_mps })
        })
        .collect();
    if scenario.mutual_interference {
        for other in scenario.radars.iter().enumerate().filter(|(k, _)| *k != which).map(|(_, r)| r) {
            let at = place(other);
            if let Some(sender) = Interferer::of_radar(other, at.pose, at.velocity_mps) {
                let at = RadarState { pose: sender.pose, ..at };
                senders.push((sender, at));
            }
        }
    }
    let at = place(radar);
    let mut list = Vec::new();
    for (number, (sender, from)) in senders.iter().enumerate() {
        list.push(interference::direct(sender, number as u32, *from, radar, at)?);
        for o in &scene.objects {
            if let Shape::Point { rcs_dbsm } = o.shape {
                let now = o.at(time_s);
                let body = (now.translation_m, now.velocity_mps, power_from_db(rcs_dbsm));
                list.push(interference::scattered(sender, number as u32, *from, radar, at, body));
            }
        }
    }
    Ok(list)
}

/// From a cube to maps, one for each ramp, and points. `velocity_mps` is the radar's own in its frame, where it is known;
/// `echoes` and `bodies` label the points, and both may be empty.
///
/// # Errors
/// Returns an error for a cube of another shape than the radar's, samples that are not finite, or an angle method that
/// the array does not allow.
pub fn detect(
    engine: &Engine,
    radar: &Radar,
    cube: &AnyCube,
    velocity_mps: Option<DVec3>,
    (echoes, bodies): (&Echoes, &Bodies),
    stages: &mut Stages,
) -> Result<(Vec<RangeDoppler<f64>>, Vec<Point>)> {
    let mut clock = Clock::start();
    let mut maps = engine.maps(radar, cube)?;
    stages.processing_s = clock.lap();
    let cloud = located(engine, radar, &mut maps, velocity_mps, (echoes, bodies))?;
    stages.angles_s = clock.lap();
    Ok((maps, cloud))
}

/// Points of maps, with labels.
///
/// # Errors
/// Returns the errors of [`crate::detect::locate::points`].
pub fn located(
    engine: &Engine,
    radar: &Radar,
    maps: &mut [RangeDoppler<f64>],
    velocity_mps: Option<DVec3>,
    (echoes, bodies): (&Echoes, &Bodies),
) -> Result<Vec<Point>> {
    let mut cloud = locate::points(engine, radar, maps, velocity_mps)?;
    label::label(radar, &mut cloud, echoes, bodies)?;
    Ok(cloud)
}

/// How far an object's peak in the range-Doppler map moves when the coherent sums are made 16 times more
/// accurate (phases across a stretch of a quarter) and no echo is left out.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Convergence {
    /// Number of the object.
    pub object_id: u32,
    /// Its class.
    pub class: String,
    /// Range of its peak, m.
    pub range_m: f64,
    /// Range rate of its peak, m/s.
    pub range_rate_mps: f64,
    /// Level at the peak with the scenario's accuracy.
    pub power_dbm: f64,
    /// Change of the level.
    pub change_db: f64,
}

/// Runs frame `index` without noise at the scenario's accuracy, and 16 times finer with every echo, and compares the map at the cell of each
/// object's strongest echoes. Objects under the thermal noise of a cell are left out.
///
/// # Errors
/// Returns an error if a frame needs more memory than the machine has, or if the engine fails.
pub fn convergence(
    engine: &Engine,
    scenario: &SitedScenario,
    scene: &Scene,
    which: usize,
    index: u32,
) -> Result<Vec<Convergence>> {
    let mut quiet = scenario.clone();
    quiet.radars[which].thermal_noise = false;
    let run = |s: &SitedScenario, budget: Budget| {
        let prepared = Prepared::of(s, scene, which..which + 1)?;
        prepared.frame_within(engine, which, index, budget, Control::default())
    };
    // What may be left out is measured by the noise, which the maps that are compared do not have.
    let coarse = run(&quiet, budget(scenario, which))?;
    // Of one depth: what more bounces bring is another matter.
    (quiet.trace.bounces, quiet.trace.most_bounces) = (coarse.echoes.bounces as u32, 0);
    quiet.trace.accuracy_db /= 16.0;
    quiet.trace.floor_db = None;
    let fine = run(&quiet, Budget::Nothing)?;
    let radar = &scenario.radars[which];
    let noise_w = crate::adc::noise::Noise::thermal(radar, 0, 0)
        .map_or(0.0, |n| 2.0 * n.sigma * n.sigma / (radar.samples * radar.chirps) as f64);
    Ok(scene
        .objects
        .iter()
        .filter_map(|o| {
            let (range_m, range_rate_mps, cell) = strongest_cell(radar, &coarse, o.id)?;
            let (a, b) = (coarse.maps[0].map.data[cell], fine.maps[0].map.data[cell]);
            (a > noise_w).then(|| Convergence {
                object_id: o.id,
                class: o.class.clone(),
                range_m,
                range_rate_mps,
                power_dbm: crate::base::units::dbm_from_w(a),
                change_db: crate::base::units::db_from_power(b / a),
            })
        })
        .collect())
}

/// Range, range rate and index in the map of the largest cell near the object's strongest echo.
fn strongest_cell(radar: &Radar, frame: &Frame, id: u32) -> Option<(f64, f64, usize)> {
    let best = frame
        .echoes
        .list
        .iter()
        .filter(|r| r.object_id() == id)
        .max_by(|a, b| crate::trace::strength(a).total_cmp(&crate::trace::strength(b)))?;
    let map = &frame.maps[0].map;
    let rate = best.range_rate_mps();
    let beat_m = best.range_m() + rate * radar.range_per_rate_s();
    let column = ((beat_m - radar.first_range_m()) / radar.range_bin_m()).round();
    if !(0.0..map.range_bins as f64).contains(&column) {
        return None;
    }
    let rows = map.doppler_bins as i64;
    let row = (rate / radar.velocity_bin_mps()).round() as i64 + rows / 2;
    let mut top: Option<(f64, usize)> = None;
    for d in -1..=1 {
        for r in -1..=1 {
            let c = column as i64 + r;
            if (0..map.range_bins as i64).contains(&c) {
                let at = ((row + d).rem_euclid(rows) * map.range_bins as i64 + c) as usize;
                if top.is_none_or(|(p, _)| map.data[at] > p) {
                    top = Some((map.data[at], at));
                }
            }
        }
    }
    top.map(|(_, at)| (best.range_m(), rate, at))
}

struct Clock(Instant);

impl Clock {
    fn start() -> Self {
        Clock(Instant::now())
    }
    fn lap(&mut self) -> f64 {
        let s = self.0.elapsed().as_secs_f64();
        self.0 = Instant::now();
        s
    }
}
