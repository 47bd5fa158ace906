//! The whole chain for one frame: from a scenario to echoes, samples, maps, points and labels.
//!
//! [`simulate`](simulate()) makes one frame, [`Prepared`] many frames of a scenario with what they have in common
//! found once. A frame depends on the scenario, its seed and the frame's number alone: on one engine it repeats to the
//! bit, on any number of threads.

pub mod kept;
pub mod lidar;
pub mod products;
pub mod thermal_floor;
pub mod truth;

use crate::adc::budget::{Budget, trim};
use crate::adc::interference::{self, Arrival, RadarState};
use crate::adc::synthesis::{EchoSummary, Levels};
use crate::base::control::Control;
use crate::base::error::{Error, Result};
use crate::base::frames::{Pose, Sensor, World};
use crate::base::held::Held;
use crate::base::units::{power_from_db, wavenumber};
use crate::detect::locate::FrameMaps;
use crate::detect::points::Point;
use crate::detect::{Bodies, label, locate};
use crate::dsp::RangeDoppler;
use crate::engine::{AnyCube, Engine, FrameInput, Look, MadeFrame, Stage, StageCounts, reach};
use crate::geom::{Facets, Geometry, RigidScene, curved, remarks as of_scene};
use crate::scene::interferer::Interferer;
use crate::scene::radar::Radar;
use crate::scene::scenario::{Ego, SitedScenario};
use crate::scene::{Object, Scene, Shape, unusual};
use crate::trace::air::Air;
use crate::trace::{Echoes, TraceOptions};
use glam::DVec3;
use kept::{Digests, KeptTrace, Of, Recall, TraceOrigin};
use products::{Product, Products};
use rayon::prelude::*;
use std::borrow::Cow;
use std::ops::Range;
use std::sync::atomic::Ordering;
use std::sync::{Arc, OnceLock};
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
    /// The same before any was left out, where the scenario asks to keep them (`output.echoes`).
    pub kept: Option<KeptTrace>,
    /// What the front end did with them.
    pub echo_summary: EchoSummary,
    /// Samples; None where they were not asked for ([`Prepared::making`]).
    pub cube: Option<AnyCube>,
    /// Range-Doppler maps, one for each ramp; none where no product needs them.
    pub maps: Vec<RangeDoppler<f64>>,
    /// Points; none where no product needs them.
    pub points: Vec<Point>,
    /// Time of each stage.
    pub stages: Stages,
    /// The stages that ran.
    pub ran: StageCounts,
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
    Error::Failed("this frame was made without its samples: request them with Prepared::making".into())
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
///
/// # Example
/// From a scenario to points. The radar of `demo77` is 3.6 m in front of the vehicle's origin, so that the point at
/// 33.6 m has a range of √(30² + 5²) m and an azimuth of 9.5° to the left.
///
/// ```
/// use catseye::engine::{Engine, Precision};
/// use catseye::road::site::Site;
/// use catseye::scene::scenario;
/// use catseye::simulate::simulate;
///
/// let text = "name = 'corner'\nradar = 'demo77'\n[[point]]\nposition_m = [33.6, 5, 0.5]\nrcs_dbsm = 10\n";
/// let scenario = scenario::parse("corner.toml".as_ref(), text)?;
/// let site = Site::new(&scenario)?;
/// let engine = Engine::open("cpu", Precision::F32)?;
/// let frame = simulate(&engine, &site.scenario, &site.scene, 0)?;
/// let point = &frame.points[0];
/// assert!((point.range_m - 30f64.hypot(5.0)).abs() < 0.05 && point.range_rate_mps.abs() < 0.05);
/// assert!((point.azimuth_rad - 5f64.atan2(30.0)).abs().to_degrees() < 0.2);
/// assert!((point.rcs_dbsm - 10.0).abs() < 0.3, "{}", point.rcs_dbsm);
/// # Ok::<(), catseye::Error>(())
/// ```
pub fn simulate(engine: &Engine, scenario: &SitedScenario, scene: &Scene, index: u32) -> Result<Frame> {
    simulate_with(engine, scenario, scene, (0, index), Control::default())
}

/// [`simulate`] of radar number `which`, with progress and cancellation of the synthesis.
///
/// # Errors
/// Returns an error if the frame needs more memory than the machine has, the engine fails, or `control` is cancelled.
pub fn simulate_with(
    engine: &Engine,
    scenario: &SitedScenario,
    scene: &Scene,
    (which, index): (usize, u32),
    control: Control<'_>,
) -> Result<Frame> {
    Prepared::of(scenario, scene, which..which + 1)?.frame(engine, which, index, control)
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
    scenario: Held<'a, SitedScenario>,
    scene: Held<'a, Scene>,
    first: usize,
    radars: Vec<RadarView<'a>>,
    /// What frames are made for.
    products: Products,
    /// Whether frames tell what one bounce more would bring also where they follow no more anyway.
    tells_cut: bool,
    /// Where echoes come from that are not traced.
    recall: Option<Recall<'a>>,
    digests: OnceLock<Digests>,
}

/// What a radar hears in a frame.
#[derive(Debug, Clone)]
pub struct TracedFrame {
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
    /// The same before any was left out, where the scenario asks to keep them (`output.echoes`).
    pub kept: Option<KeptTrace>,
    /// Time taken to place the scene and to trace it, s.
    pub seconds: [f64; 2],
    /// The stages that ran.
    ran: StageCounts,
}

/// What one radar needs of the scene.
struct RadarView<'a> {
    refined: RigidScene<'a>,
    /// Triangles of the scene as it was cut.
    triangles: usize,
    still: OnceLock<Geometry>,
}

impl<'a> Prepared<'a> {
    /// Prepares the scene for all radars of the scenario.
    ///
    /// # Errors
    /// Returns an error if a curved surface cannot be cut.
    pub fn new(scenario: &'a SitedScenario, scene: &'a Scene) -> Result<Prepared<'a>> {
        Prepared::of(scenario, scene, 0..scenario.radars.len())
    }

    /// [`Prepared::new`] of a scene that lives as long as anybody works with it.
    ///
    /// # Errors
    /// Returns the errors of [`Prepared::new`].
    pub fn shared(scenario: &Arc<SitedScenario>, scene: &Arc<Scene>) -> Result<Prepared<'a>> {
        let radars = 0..scenario.radars.len();
        Prepared::held(Held::Shared(Arc::clone(scenario)), Held::Shared(Arc::clone(scene)), radars)
    }

    /// Frames are made for these products alone: stages that none of them needs do not run. Without it they are made for all, and for
    /// echoes in full where the scenario's output asks for them.
    pub fn making(self, products: Products) -> Prepared<'a> {
        Prepared { products, ..self }
    }

    /// Where the scenario gives the number of bounces, frames do not tell what one more would bring (`Echoes::cut_power_w`), whose estimate
    /// asks every beam that the limit ends.
    pub fn without_cut_power(self) -> Prepared<'a> {
        Prepared { tells_cut: false, ..self }
    }

    /// Frames come without their samples: a gpu engine then leaves them on the device.
    pub fn without_cubes(self) -> Prepared<'a> {
        let products = self.products.without(Product::Samples);
        self.making(products)
    }

    /// Frames are made of echoes that were traced before, which `recall` gives, and nothing is traced.
    pub fn recalling(self, recall: Recall<'a>) -> Prepared<'a> {
        Prepared { recall: Some(recall), ..self }
    }

    fn of(scenario: &'a SitedScenario, scene: &'a Scene, radars: Range<usize>) -> Result<Prepared<'a>> {
        Prepared::held(Held::Borrowed(scenario), Held::Borrowed(scene), radars)
    }

    fn held(
        scenario: Held<'a, SitedScenario>,
        scene: Held<'a, Scene>,
        radars: Range<usize>,
    ) -> Result<Prepared<'a>> {
        let seen = |radar: &Radar| {
            let (accuracy_db, most) = (scenario.trace.accuracy_db, scenario.trace.facets as usize);
            let cut = match curved::sized_within(&scene, accuracy_db, wavenumber(radar.carrier_hz), most)? {
                Cow::Borrowed(_) => scene.clone(),
                Cow::Owned(cut) => Held::Shared(Arc::new(cut)),
            };
            let triangles = cut.triangle_count();
            let refined = RigidScene::new(cut, radar.carrier_hz, Facets::Curved)?;
            Ok(RadarView { refined, triangles, still: OnceLock::new() })
        };
        let first = radars.start;
        let products = match scenario.output.echoes {
            true => Products::ALL,
            false => Products::ALL.without(Product::Echoes),
        };
        let radars = scenario.radars[radars].iter().map(seen).collect::<Result<_>>()?;
        let (recall, digests) = (None, OnceLock::new());
        Ok(Prepared { scenario, scene, first, products, tells_cut: true, recall, digests, radars })
    }

    /// Frame `index` of radar number `which`.
    ///
    /// # Errors
    /// Returns an error if the frame needs more memory than the machine has, the engine fails, or `control` is
    /// cancelled.
    pub fn frame(&self, engine: &Engine, which: usize, index: u32, control: Control<'_>) -> Result<Frame> {
        self.frame_within(engine, which, index, budget(&self.scenario, which), control)
    }

    /// [`frames`] of this scene: of each pair the radar's number and the frame's.
    ///
    /// # Errors
    /// The last frame may have an error of [`Prepared::frame`].
    pub fn frames(
        &self,
        engine: &Engine,
        wanted: &[(usize, u32)],
        control: Control<'_>,
    ) -> Vec<Result<Frame>> {
        let wanted =
            wanted.iter().map(|(which, index)| Wanted { prepared: self, which: *which, index: *index });
        frames(engine, &wanted.collect::<Vec<_>>(), control)
    }

    /// What was assumed or left out of the scene's files, what of the scenario's radars and times is seldom meant, and what the scene's meshes
    /// have that may show in frames, as they stand in the first one: one line each, with the object's name, the number of places and a
    /// remedy. None for a scene that is clean.
    ///
    /// # Errors
    /// Returns an error if a material or a mesh of the scene cannot be used at the frequency of the first radar.
    pub fn remarks(&self) -> Result<Vec<String>> {
        let Some(seen) = self.radars.first() else { return Ok(Vec::new()) };
        let radar = &self.scenario.radars[self.first];
        let time_s = self.scenario.frames.time_s(0);
        let mut lines = self.scene.warnings.clone();
        lines.extend(self.scene.import.notes.iter().cloned());
        lines.extend(unusual::of_scenario(&self.scenario));
        lines.extend(of_scene::of_meshes(&self.scene, radar.carrier_hz)?);
        let (pose, _) = radar_pose(radar, &self.scenario.ego, time_s);
        lines.extend(seen.refined.at(time_s, 0.0)?.remarks(&self.scene, pose.translation_m));
        Ok(lines)
    }

    /// What the radar hears in frame `index`, before anything is synthesised.
    ///
    /// # Errors
    /// Returns an error if a material, a mesh or the weather cannot be used at the radar's frequency.
    pub fn echoes(&self, engine: &Engine, which: usize, index: u32) -> Result<TracedFrame> {
        self.traced(engine, which, index, budget(&self.scenario, which))
    }

    /// The geometry where nothing moves, which all frames of a radar share; None where something does.
    fn still(&self, which: usize) -> Result<Option<&Geometry>> {
        let seen = &self.radars[which - self.first];
        let still = |o: &Object| o.motion.is_none() && o.velocity_mps == DVec3::ZERO;
        if !self.scene.objects.iter().all(still) {
            return Ok(None);
        }
        if let Some(known) = seen.still.get() {
            return Ok(Some(known));
        }
        let new = seen.refined.at(0.0, 0.5 * self.scenario.radars[which].frame_time_s())?;
        Ok(Some(seen.still.get_or_init(|| new)))
    }

    fn digests(&self) -> &Digests {
        self.digests.get_or_init(|| Digests::of(&self.scenario, &self.scene))
    }

    fn traced(&self, engine: &Engine, which: usize, index: u32, budget: Budget) -> Result<TracedFrame> {
        if !self.products.reaches(Stage::Trace) {
            return Ok(self.untraced(which, index));
        }
        if let Some(recall) = &self.recall {
            let clock = Clock::start();
            return self.recalled(recall(which, index)?, which, index, budget, clock);
        }
        let posed = self.posed(which, index)?;
        let mut clock = Clock::start();
        let Look { geometry, radar, pose, velocity_mps, options } = posed.look();
        let echoes = engine.trace(geometry, radar, &pose, velocity_mps, &options)?;
        Ok(self.trimmed(&posed, echoes, budget, clock.lap()))
    }

    /// What is received of echoes that were traced before; the clock ran while they were read.
    fn recalled(
        &self,
        kept: KeptTrace,
        which: usize,
        index: u32,
        budget: Budget,
        mut clock: Clock,
    ) -> Result<TracedFrame> {
        let options = trace_options(&self.scenario, which, index)?;
        let radar = &self.scenario.radars[which];
        let time_s = self.scenario.frames.time_s(index);
        let (pose, velocity_mps) = radar_pose(radar, &self.scenario.ego, time_s);
        let of = Of { which, index, pose: &pose };
        let kept = kept::recalled(kept, &self.scenario, self.digests(), of, &options)?;
        let triangles = kept.triangles;
        let (mut echoes, kept) = match self.products.has(Product::Echoes) {
            true => (kept.echoes.clone(), Some(kept)),
            false => (kept.echoes, None),
        };
        trim(radar, &mut echoes, budget);
        let seconds = [0.0, clock.lap()];
        Ok(TracedFrame {
            time_s,
            pose,
            velocity_mps,
            triangles,
            echoes,
            kept,
            seconds,
            ran: StageCounts::default(),
        })
    }

    /// A frame that is ready to be traced.
    fn posed(&self, which: usize, index: u32) -> Result<Posed<'_>> {
        let scenario = &*self.scenario;
        let radar = &scenario.radars[which];
        let time_s = scenario.frames.time_s(index);
        let (pose, velocity_mps) = radar_pose(radar, &scenario.ego, time_s);
        let mut clock = Clock::start();

        let reach_s = 0.5 * radar.frame_time_s();
        let geometry = match self.still(which)? {
            Some(known) => PlacedScene::Still(known),
            None => {
                let placed = self.radars[which - self.first].refined.at(time_s, reach_s)?;
                PlacedScene::Moving(Box::new(placed))
            }
        };
        let geometry_s = clock.lap();
        let sway = |dt: f64| {
            let (then, _) = radar_pose(radar, &scenario.ego, time_s + dt);
            then.translation_m - (pose.translation_m + velocity_mps * dt)
        };
        let radar_sway_m = [sway(-reach_s), sway(reach_s)];
        let mut options = TraceOptions { radar_sway_m, ..trace_options(scenario, which, index)? };
        let is_fixed = options.most_bounces <= options.bounces;
        if is_fixed && !self.tells_cut && !self.products.has(Product::Echoes) {
            options.least_cut = None;
        }
        Ok(Posed { which, index, radar, time_s, pose, velocity_mps, geometry, options, geometry_s })
    }

    /// What is received of a frame, of all its echoes, which took `trace_s` to trace.
    fn trimmed(&self, posed: &Posed<'_>, mut echoes: Echoes, budget: Budget, trace_s: f64) -> TracedFrame {
        let start = Instant::now();
        let triangles = posed.geometry.get().triangle_count;
        let kept = self.products.has(Product::Echoes).then(|| {
            let rate = reach::fastest_path_mps(posed.geometry.get(), posed.velocity_mps, echoes.bounces);
            let of = Of { which: posed.which, index: posed.index, pose: &posed.pose };
            let origin = TraceOrigin::new(&self.scenario, self.digests(), of, &posed.options, rate);
            KeptTrace { origin, triangles, echoes: echoes.clone(), file: None }
        });
        trim(posed.radar, &mut echoes, budget);
        TracedFrame {
            time_s: posed.time_s,
            pose: posed.pose,
            velocity_mps: posed.velocity_mps,
            triangles,
            echoes,
            kept,
            seconds: [posed.geometry_s, trace_s + start.elapsed().as_secs_f64()],
            ran: {
                let mut ran = StageCounts::default();
                ran.count(Stage::Trace);
                ran
            },
        }
    }

    /// A frame for products that follow from the scene alone: the radar's pose, and no echoes.
    fn untraced(&self, which: usize, index: u32) -> TracedFrame {
        let time_s = self.scenario.frames.time_s(index);
        let (pose, velocity_mps) = radar_pose(&self.scenario.radars[which], &self.scenario.ego, time_s);
        TracedFrame {
            time_s,
            pose,
            velocity_mps,
            triangles: self.radars[which - self.first].triangles,
            echoes: Echoes::default(),
            kept: None,
            seconds: [0.0; 2],
            ran: StageCounts::default(),
        }
    }

    fn frame_within(
        &self,
        engine: &Engine,
        which: usize,
        index: u32,
        budget: Budget,
        control: Control<'_>,
    ) -> Result<Frame> {
        let wanted = Wanted { prepared: self, which, index };
        engine.check_memory(&self.scenario.radars[which], 0)?;
        let received = self.traced(engine, which, index, budget)?;
        let mut made = made(engine, &[wanted], vec![received], control);
        made.pop().unwrap_or_else(|| Err(Error::Failed("no frame was made".into())))
    }
}

/// A scene at one time.
enum PlacedScene<'a> {
    /// Of which nothing moves.
    Still(&'a Geometry),
    Moving(Box<Geometry>),
}

impl PlacedScene<'_> {
    fn get(&self) -> &Geometry {
        match self {
            PlacedScene::Still(known) => known,
            PlacedScene::Moving(placed) => placed,
        }
    }
}

/// A frame that is ready to be traced.
struct Posed<'a> {
    which: usize,
    index: u32,
    radar: &'a Radar,
    time_s: f64,
    pose: Pose<Sensor, World>,
    velocity_mps: DVec3,
    geometry: PlacedScene<'a>,
    options: TraceOptions,
    geometry_s: f64,
}

impl Posed<'_> {
    fn look(&self) -> Look<'_> {
        Look {
            geometry: self.geometry.get(),
            radar: self.radar,
            pose: self.pose,
            velocity_mps: self.velocity_mps,
            options: self.options,
        }
    }
}

/// A frame of one radar that is asked for.
#[derive(Clone, Copy)]
pub struct Wanted<'p, 's> {
    /// The scene.
    pub prepared: &'p Prepared<'s>,
    /// Number of the radar in the scenario.
    pub which: usize,
    /// Number of the frame.
    pub index: u32,
}

impl<'p, 's> Wanted<'p, 's> {
    fn radar(&self) -> &'p Radar {
        &self.prepared.scenario.radars[self.which]
    }

    fn budget(&self) -> Budget {
        budget(&self.prepared.scenario, self.which)
    }

    fn posed(&self, engine: &Engine) -> Result<Posed<'p>> {
        engine.check_memory(self.radar(), 0)?;
        self.prepared.posed(self.which, self.index)
    }

    /// Bytes that the frame holds while it is traced with others.
    fn bytes_of_trace(&self) -> f64 {
        let seen = &self.prepared.radars[self.which - self.prepared.first];
        TRACE_BYTES_OF_TRIANGLE * seen.triangles as f64
    }

    /// Whether both are of one radar in one scene.
    fn is_of_one_radar(&self, other: &Wanted<'_, '_>) -> bool {
        std::ptr::addr_eq(self.prepared, other.prepared) && self.which == other.which
    }

    /// Bytes that the frame holds until all are made that are made with it.
    fn bytes(&self, engine: &Engine, echoes: usize) -> f64 {
        let memory = engine.memory(self.radar(), echoes);
        let cube_bytes = if self.prepared.products.has(Product::Samples) { memory.cube_bytes } else { 0.0 };
        cube_bytes + memory.map_bytes + memory.echo_bytes
    }
}

/// Makes frames, of any scenes and radars, to the bit as [`Prepared::frame`] makes each. They share submissions on the gpu engine: one from
/// echoes to detected cells and one for the spectra over angle of all of a kind. Frames are made from the front of `wanted`, as many as
/// fit into [`Engine::batch_bytes`] together and at least one; the caller asks again for the rest. The cpu engine makes one at a time.
/// Nothing comes after a frame that failed.
///
/// # Errors
/// The last frame may have an error of [`Prepared::frame`]; it is that of the frame, or of the adapter.
pub fn frames(engine: &Engine, wanted: &[Wanted<'_, '_>], control: Control<'_>) -> Vec<Result<Frame>> {
    let most = match engine {
        Engine::Cpu(_) => 1,
        Engine::Gpu(_) => wanted.len(),
    };
    let limit = engine.batch_bytes() as f64;
    let at_least = rayon::current_num_threads();
    let (mut received, mut failure, mut bytes) = (Vec::new(), None, 0.0);
    while received.len() < most && failure.is_none() {
        if control.cancel.is_some_and(|cancel| cancel.load(Ordering::Relaxed)) {
            return vec![Err(Error::Interrupted("the frames were cancelled".into()))];
        }
        let left = &wanted[received.len()..most];
        // What is certain before anything is traced; then as the number of echoes is known.
        let (mut expected, mut traced) = (bytes, 0.0);
        let fit = left.iter().enumerate().take_while(|(i, w)| {
            expected += w.bytes(engine, 0);
            traced += w.bytes_of_trace();
            expected <= limit && (*i < at_least || traced <= limit)
        });
        let some = match fit.count() {
            0 if received.is_empty() => &left[..1],
            n => &left[..n],
        };
        if some.is_empty() {
            break;
        }
        for (wanted, one) in some.iter().zip(all_heard(engine, some)) {
            match one {
                Ok(one) if failure.is_none() => {
                    bytes += wanted.bytes(engine, one.echoes.list.len());
                    received.push(one);
                }
                Err(e) if failure.is_none() => failure = Some(e),
                _ => {}
            }
        }
    }
    let mut frames = made(engine, &wanted[..received.len()], received, control);
    if !matches!(frames.last(), Some(Err(_))) {
        frames.extend(failure.map(Err));
    }
    frames
}

/// Bytes that a triangle takes, with all that beams light of it, while its frame is traced: some thirty corners as the device hands them
/// on and as the host has them.
const TRACE_BYTES_OF_TRIANGLE: f64 = 4e3;

/// What is received in frames, which are traced together.
fn all_heard(engine: &Engine, wanted: &[Wanted<'_, '_>]) -> Vec<Result<TracedFrame>> {
    let is_traced =
        |w: &Wanted<'_, '_>| w.prepared.recall.is_none() && w.prepared.products.reaches(Stage::Trace);
    if !wanted.iter().all(is_traced) {
        return wanted
            .par_iter()
            .map(|w| {
                engine.check_memory(w.radar(), 0)?;
                w.prepared.traced(engine, w.which, w.index, w.budget())
            })
            .collect();
    }
    // What frames of one radar share is found once, and not by each of them.
    let mut radars: Vec<&Wanted<'_, '_>> = Vec::new();
    for w in wanted {
        if !radars.iter().any(|r| r.is_of_one_radar(w)) {
            radars.push(w);
        }
    }
    radars.par_iter().for_each(|w| {
        // Errors come again with the frame.
        let _ = w.prepared.still(w.which);
    });
    let posed: Vec<Result<Posed<'_>>> = wanted.par_iter().map(|w| w.posed(engine)).collect();
    let start = Instant::now();
    let looks: Vec<Look<'_>> = posed.iter().flatten().map(Posed::look).collect();
    let traced = engine.trace_all(&looks);
    let trace_s = start.elapsed().as_secs_f64() / traced.len().max(1) as f64;
    // One for each frame that could be posed.
    let mut traced = traced.into_iter();
    let both: Vec<Result<(Posed<'_>, Echoes)>> = posed
        .into_iter()
        .map(|posed| {
            let posed = posed?;
            let echoes = traced.next().unwrap_or_else(|| Err(Error::Failed("no frame was traced".into())))?;
            Ok((posed, echoes))
        })
        .collect();
    let received = wanted
        .par_iter()
        .zip(both)
        .map(|(w, one)| one.map(|(posed, echoes)| w.prepared.trimmed(&posed, echoes, w.budget(), trace_s)));
    received.collect()
}

/// Frames of what was received in them, one for each; nothing after one that failed.
fn made(
    engine: &Engine,
    wanted: &[Wanted<'_, '_>],
    received: Vec<TracedFrame>,
    control: Control<'_>,
) -> Vec<Result<Frame>> {
    let mut failure = None;
    let mut interference = Vec::with_capacity(received.len());
    for (w, received) in wanted.iter().zip(&received) {
        let prepared = w.prepared;
        let ways = engine
            .check_memory(w.radar(), received.echoes.list.len())
            .and_then(|()| arrivals(&prepared.scenario, &prepared.scene, w.which, received.time_s));
        match ways {
            Ok(ways) => interference.push(ways),
            Err(e) => {
                failure = Some(e);
                break;
            }
        }
    }
    let inputs: Vec<FrameInput<'_>> = wanted
        .iter()
        .zip(&received)
        .zip(&interference)
        .map(|((w, received), interference)| FrameInput {
            radar: w.radar(),
            echoes: &received.echoes,
            interference,
            seed: radar_seed(&w.prepared.scenario, w.which),
            frame: w.index,
            extent: w.prepared.products.extent(),
        })
        .collect();
    let mut sampled = Vec::with_capacity(inputs.len());
    for one in engine.frames(&inputs, control) {
        match one {
            Ok(one) => sampled.push(one),
            Err(e) => failure = Some(e),
        }
    }
    let mut clock = Clock::start();
    let own = |h: &TracedFrame| h.pose.inverse().direction(h.velocity_mps);
    // Frames whose points nobody asks for stay without them.
    let has_points = |w: &Wanted<'_, '_>| w.prepared.products.reaches(Stage::Angles);
    let maps = wanted.iter().zip(&received).zip(&mut sampled).filter(|((w, _), _)| has_points(w));
    let maps = maps.map(|((w, received), made)| FrameMaps {
        radar: w.radar(),
        maps: &mut made.maps,
        velocity_mps: Some(own(received)),
    });
    let mut clouds = locate::points_of_frames(engine, maps.collect()).into_iter();
    let clouds: Vec<Result<(Vec<Point>, StageCounts)>> = wanted[..sampled.len()]
        .iter()
        .map(|w| {
            let mut ran = StageCounts::default();
            if !has_points(w) {
                return Ok((Vec::new(), ran));
            }
            ran.count(Stage::Angles);
            let cloud = clouds.next().unwrap_or_else(|| Err(Error::Failed("a map was not searched".into())));
            cloud.map(|cloud| (cloud, ran))
        })
        .collect();
    let labelled: Vec<Result<(Vec<Point>, StageCounts)>> = clouds
        .into_par_iter()
        .zip(wanted.par_iter().zip(&received))
        .map(|(cloud, (w, received))| {
            let (mut cloud, mut ran) = cloud?;
            if w.prepared.products.reaches(Stage::Labels) {
                let bodies = Bodies::new(&w.prepared.scene, received.time_s, &received.pose);
                label::label(w.radar(), &mut cloud, &received.echoes, &bodies)?;
                ran.count(Stage::Labels);
            }
            Ok((cloud, ran))
        })
        .collect();
    let angles_s = clock.lap() / sampled.len().max(1) as f64;
    let mut frames = Vec::with_capacity(wanted.len());
    for (((w, received), made), points) in wanted.iter().zip(received).zip(sampled).zip(labelled) {
        let (points, located) = match points {
            Ok(points) => points,
            Err(e) => {
                failure = Some(e);
                break;
            }
        };
        let TracedFrame { time_s, pose, velocity_mps, triangles, echoes, kept, seconds, mut ran } = received;
        let MadeFrame { cube, echo_summary, maps, ran: on_engine, seconds: [synthesis_s, processing_s] } =
            made;
        ran.add(&on_engine);
        ran.add(&located);
        let [geometry_s, trace_s] = seconds;
        frames.push(Ok(Frame {
            index: w.index,
            radar: w.which,
            time_s,
            pose,
            velocity_mps,
            triangles,
            echoes,
            kept,
            echo_summary,
            cube,
            maps,
            points,
            stages: Stages { geometry_s, trace_s, synthesis_s, processing_s, angles_s },
            ran,
        }));
    }
    frames.extend(failure.map(Err));
    frames
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
        for o in scene.objects.iter().filter(|o| o.radar) {
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
