//! Scans: the bare road, the slow drive past the plates, the runs.

use crate::trial::kit::*;
use crate::trial::uwb::settings::Settings;
use catseye::base::units::C0;
use catseye::road::labels::RoadLabel;
use catseye::scene::backscatter::{Backscatter, Law};
use catseye::scene::material::MaterialKind;
use catseye::scene::radar::Sampling;
use catseye::scene::scenario::OnRoad;
use catseye::scene::toml_file::referred;
use catseye::scene::{Mesh, Object, Shape};
use catseye_lane::uwb::{MarkedLane, RangeAxis, RangeGate, Side};
use std::cell::Cell;
use std::ops::Range;

/// Frequency band in which the asphalt of the settings is valid, Hz.
const ASPHALT_HZ: (f64, f64) = (1e9, 40e9);
/// Length of road at both ends that slow drives leave out, m.
const END_M: f64 = 5.0;
/// Distance between the vehicle's side and the line on the drives without markers, m.
const SIDE_M: f64 = 0.1;
/// Number of frames that are kept in one file.
const BLOCK: u32 = 40;
/// Time between the draws of a run's speed, s, and their largest difference from its mean, m/s. Within a
/// drive the speeds in the document's tables lie about 0.5 m/s around their mean.
const SPEED_EVERY_S: f64 = 2.0;
const SPEED_SPREAD_MPS: f64 = 0.5;
/// Least number of drives on the road without markers, from side to side of the lane.
const LEAST_QUIET_DRIVES: u32 = 3;
/// Largest number of scans of a run-up.
const MOST_RUN_UP: u32 = 10_000;
/// Streams of draws.
const SPEEDS: u32 = 0x75_77_62;

/// One impulse radar and the meaning of its samples.
pub struct ImpulseRadar {
    /// Number of the radar in the scenario.
    pub which: usize,
    pub name: String,
    pub side: Side,
    pub height_m: f64,
    /// Position in the vehicle's level frame, m.
    pub at_m: [f64; 2],
    pub axis: RangeAxis,
    pub gate: RangeGate,
    /// Number of samples up to the end of the gate.
    pub samples: usize,
}

impl ImpulseRadar {
    /// Largest lateral distance at which a marker beside the radar lies within the gate, m.
    pub fn reach_m(&self) -> f64 {
        (self.gate.max_m * self.gate.max_m - self.height_m * self.height_m).max(0.0).sqrt()
    }
}

fn wrong(key: &str, reason: LaneError) -> catseye::base::error::Error {
    BadInput::new(reason.to_string()).key(key).into()
}

/// The impulse radars of a scenario: the first of each side, left before right.
///
/// # Errors
/// Returns an error if there is none, or if one is not real-valued, does not cover the gate, or stands on the
/// ground.
pub fn impulse_radars(scenario: &Scenario, settings: &Settings) -> Result<Vec<ImpulseRadar>> {
    let mut found: Vec<ImpulseRadar> = Vec::new();
    for (which, radar) in scenario.radars.iter().enumerate() {
        if !matches!(radar.waveform, Waveform::Pulse { .. }) {
            continue;
        }
        let one = impulse_radar(which, radar, settings)?;
        if found.iter().all(|e| e.side != one.side) {
            found.push(one);
        }
    }
    found.sort_by_key(|e| e.side == Side::Right);
    if found.is_empty() {
        let allowed = "an impulse radar: one with waveform.kind = \"pulse\"";
        let remedy = "use radar = \"uwb9\", or your own file";
        return Err(no_radar(&scenario.radars, "uwb", allowed, remedy).into());
    }
    Ok(found)
}

fn impulse_radar(which: usize, radar: &Radar, settings: &Settings) -> Result<ImpulseRadar> {
    let bad = |problem: &str, key: &str| BadInput::new(problem).key(format!("{}: {key}", radar.name));
    if radar.sampling != Sampling::Real {
        let e = bad("the method needs real samples of the received wave", "receiver.sampling");
        return Err(e.allowed("real").remedy("sampling = \"real\"").into());
    }
    let at = radar.mounting.translation_m;
    if at.z <= 0.0 {
        let e = bad("the radar is not above the road", "mounting.position_m").value(at.z);
        return Err(e.allowed("a height above 0 m").into());
    }
    let lane = MarkedLane {
        height_m: at.z,
        lane_width_m: settings.lane_width_m,
        car_width_m: settings.car_width_m,
        spacing_m: settings.spacing_m,
        plate_length_m: settings.plate_length_m,
    };
    let gate = match settings.gate_m {
        Some([near, far]) => RangeGate::new(near, far),
        None => RangeGate::from_marked_lane(&lane),
    };
    let gate =
        gate.and_then(|g| g.widened(settings.gate_margin_m)).map_err(|r| wrong("lane.uwb.gate_m", r))?;
    let axis = RangeAxis::from_time(radar.adc_start_s, radar.sample_rate_hz)
        .map_err(|r| wrong("receiver.adc_start_s", r))?;
    let last_m = axis.start_m + (radar.samples.max(1) - 1) as f64 * axis.step_m;
    if gate.min_m < axis.start_m || gate.max_m > last_m {
        return Err(bad("the samples do not cover the gate", "receiver.samples")
            .value(format!("{:.2}..{:.2} m", axis.start_m, last_m))
            .allowed(format!("{:.2}..{:.2} m and more", gate.min_m, gate.max_m))
            .remedy("change adc_start_s or samples, or give lane.uwb.gate_m")
            .into());
    }
    let samples = ((gate.max_m - axis.start_m) / axis.step_m).ceil() as usize + 1;
    Ok(ImpulseRadar {
        which,
        name: radar.name.clone(),
        // Looks to the right: left of the middle is the left line.
        side: if at.y > 0.0 { Side::Left } else { Side::Right },
        height_m: at.z,
        at_m: [at.x, at.y],
        axis,
        gate,
        samples: samples.min(radar.samples),
    })
}

/// The scenario's site with the settings' rough asphalt in place of the table's mirror.
pub fn site(scenario: &Scenario, settings: &Settings) -> Result<Site> {
    let mut site = Site::new(scenario)?;
    let a = settings.asphalt;
    let holds = |hz: f64, band: (f64, f64)| (band.0..=band.1).contains(&hz);
    let hz = scenario.radars.iter().map(|r| r.carrier_hz);
    for m in site.scene.materials.iter_mut().filter(|m| m.name == "asphalt") {
        if !hz.clone().all(|f| holds(f, ASPHALT_HZ)) {
            continue;
        }
        m.kind = MaterialKind::Dielectric {
            eps_real: a.relative_permittivity,
            eps_loss: 0.0,
            conductivity_s_per_m: 0.0,
        };
        m.roughness_rms_m = a.roughness_mm * 1e-3;
        m.backscatter = (a.roughness_mm > 0.0).then(|| Backscatter::of(Law::Oh));
        m.valid_hz = ASPHALT_HZ;
        m.source = "lane.uwb.asphalt".into();
    }
    Ok(site)
}

/// Checks that scans are dense enough for the vehicle's speed.
///
/// # Errors
/// Returns an error if two scans are farther apart than a plate is long.
fn check_speed(scenario: &Scenario, settings: &Settings) -> Result<()> {
    let interval_s = scenario.frames.interval_s;
    let own = scenario.ego.on_road().into_iter().flat_map(|on| on.drive.speed.iter().map(|p| p[1]));
    let ranges = settings.speed_range_kmh.iter().map(|r| r[1] / 3.6);
    let fastest = match settings.speed_range_kmh {
        Some(_) => ranges.fold(0.0, f64::max),
        None => own.fold(scenario.ego.free().map_or(0.0, |ego| ego.speed_mps.abs()), |m, v| m.max(v.abs())),
    };
    let step_m = fastest.max(settings.quiet_speed_kmh / 3.6) * interval_s;
    if step_m.is_nan() || step_m >= settings.plate_length_m {
        let bad = BadInput::new("the distance between two scans exceeds the length of a plate")
            .key("frames.interval_s");
        let bad = bad.value(format!("{interval_s} s at {fastest} m/s"));
        let bad = bad.allowed(format!("less than {} m from scan to scan", settings.plate_length_m));
        return Err(bad.remedy("use more scans per second, or a slower drive").into());
    }
    Ok(())
}

/// The scenario of a run, with its own speed and sway where the settings say so.
pub fn scenario_of_run(given: &TrialContext<'_>, settings: &Settings, run: u32) -> Scenario {
    let mut scenario = given.scenario_of(run);
    let duration_s = scenario.duration_s();
    let Some(on) = scenario.ego.on_road_mut() else { return scenario };
    let mut draws = draws(scenario.seed, SPEEDS);
    if let Some(range) = settings.speed_range_kmh {
        let [low, high] = range.map(|v| v / 3.6);
        let mean = low + (high - low) * draws.uniform();
        let count = (duration_s / SPEED_EVERY_S).ceil() as usize + 1;
        let speed = |i: usize| {
            let v = mean + SPEED_SPREAD_MPS * (2.0 * draws.uniform() - 1.0);
            [i as f64 * SPEED_EVERY_S, v.clamp(low, high)]
        };
        on.drive.speed = (0..count).map(speed).collect();
    }
    if let Some(sway) = &mut on.drive.sway {
        sway.phase = draws.uniform();
    }
    scenario
}

/// Scans of all impulse radars, `[frame][radar]`, up to the end of each gate.
pub type Scans = Vec<Vec<Vec<f32>>>;

/// The part of a site that is simulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scenery {
    All,
    /// What is close enough to show in the samples: the rest of a long road with many objects would take most
    /// of the time.
    WithinReach,
}

/// All drives of a trial: their radars, and the number of finished frames.
pub struct Drives<'a> {
    pub given: &'a TrialContext<'a>,
    pub settings: &'a Settings,
    pub radars: Vec<ImpulseRadar>,
    scenery: Scenery,
    done: Cell<u64>,
    all: u64,
}

impl<'a> Drives<'a> {
    /// Prepares the drives; `frames` is the number of frames besides those of the slow drives.
    ///
    /// # Errors
    /// Returns an error for a scenario without a suitable impulse radar, without a road, or with scans too
    /// far apart.
    pub fn new(
        given: &'a TrialContext<'a>,
        settings: &'a Settings,
        scenery: Scenery,
        frames: u64,
    ) -> Result<Drives<'a>> {
        let radars = impulse_radars(given.scenario, settings)?;
        if given.scenario.ego.on_road().is_none() {
            return Err(missing("a vehicle on a road").into());
        }
        check_speed(given.scenario, settings)?;
        let all = u64::from(settings.quiet_scans) + frames;
        Ok(Drives { given, settings, radars, scenery, done: Cell::new(0), all })
    }

    /// Drives a site and returns the scans of the first `radars`, which are kept under `key`.
    pub fn scans(&self, key: &str, site: &Site, radars: &[ImpulseRadar]) -> Result<Scans> {
        let whole = match self.scenery {
            Scenery::All => Some(Drive::new(site, self.given.engine)?),
            Scenery::WithinReach => None,
        };
        let count = site.scenario.frames.count;
        let mut all = Scans::new();
        for from in (0..count).step_by(BLOCK as usize) {
            let to = (from + BLOCK).min(count);
            all.extend(self.given.kept(&format!("{key}_frames{from}-{to}"), || match &whole {
                Some(drive) => block(drive, radars, from..to),
                None => {
                    let near = within_reach(site, radars, from..to);
                    block(&Drive::new(&near, self.given.engine)?, radars, from..to)
                }
            })?);
            let done = self.done.get() + u64::from(to - from);
            self.done.set(done);
            (self.given.watch)(done, self.all.max(done));
        }
        Ok(all)
    }

    /// Scans of the road without markers: several lengths of it, across the lane from side to side, each on
    /// other asphalt.
    ///
    /// # Errors
    /// Returns an error for a scenario without a road and a vehicle on it, or a road of which nothing is left
    /// without its objects.
    pub fn quiet(&self) -> Result<Scans> {
        let settings = self.settings;
        let mut scenario = self.given.scenario.clone();
        if let Some(file) = &settings.quiet_road {
            scenario.scene = SceneSource::Road { path: referred(self.given.path, file)? };
        }
        let stays = |o: &Object| match (&settings.quiet_road, &settings.plate_class) {
            (Some(_), _) => true,
            (None, Some(plates)) => o.class != *plates && is_still(o),
            (None, None) => is_road(o),
        };
        (scenario.points, scenario.objects) = (Vec::new(), Vec::new());
        let whole = site(&scenario, settings)?;
        if let Some(class) = &settings.plate_class
            && whole.scene.objects.iter().all(|o| o.class != *class)
        {
            let bad = BadInput::new("no object of the scene has this class").key("lane.uwb.plate_class");
            return Err(bad.value(class).remedy("give the class of the plates in the road file").into());
        }
        let (drives, against) =
            slow_drives(&whole, &scenario, settings, settings.quiet_scans, LEAST_QUIET_DRIVES)?;
        let mut all = Scans::new();
        for (k, slow) in drives.iter().enumerate() {
            let mut one = slowly(&scenario, settings, slow, against);
            // Seeds of runs count up from the scenario's; these count down.
            one.seed = one.seed.wrapping_sub(1 + k as u64);
            let mut site = site(&one, settings)?;
            site.scene.objects.retain(stays);
            if site.scene.objects.is_empty() {
                let bad = BadInput::new("the road without its objects is empty");
                return Err(bad.key("lane.uwb.quiet_road").remedy("give a road file without markers").into());
            }
            all.extend(self.scans(&format!("quiet{k}"), &site, &self.radars)?);
        }
        Ok(all)
    }

    /// The slow drive past the markers at the scenario's own lateral position: the site, for the truth, and
    /// its scans.
    pub fn histogram(&self) -> Result<Vec<(Site, Scans)>> {
        let (scenario, settings) = (self.given.scenario, self.settings);
        if settings.histogram_scans == 0 {
            return Ok(Vec::new());
        }
        let whole = site(scenario, settings)?;
        let (drives, against) = slow_drives(&whole, scenario, settings, settings.histogram_scans, 1)?;
        let offset_m = scenario.ego.on_road().map_or(0.0, |on| on.offset_m);
        let one = |(k, slow): (usize, &Slow)| {
            let mut one = slowly(scenario, settings, &Slow { offset_m, ..*slow }, against);
            one.seed = one.seed.wrapping_add(1_000_000 + k as u64);
            let site = site(&one, settings)?;
            let scans = self.scans(&format!("slow{k}"), &site, &self.radars)?;
            Ok((site, scans))
        };
        drives.iter().enumerate().map(one).collect()
    }

    /// One scan of the first radar at the middle of a marker for each lateral distance: (m, scan).
    pub fn sweep(&self, distances_m: &[f64]) -> Result<Vec<(f64, Vec<f32>)>> {
        let (scenario, settings, radar) = (self.given.scenario, self.settings, &self.radars[0]);
        let Some(on) = scenario.ego.on_road() else { return Ok(Vec::new()) };
        let against = goes_against(&site(scenario, settings)?, scenario)?;
        let at = |s_m: f64, offset_m: f64| {
            site(&slowly(scenario, settings, &Slow { s_m, offset_m, scans: 1 }, against), settings)
        };
        let markers = Drive::new(&at(on.s_m, on.offset_m)?, self.given.engine)?.markers(0.0);
        let near = markers.iter().filter(|p| (p[1] - radar.at_m[1]).abs() <= radar.reach_m());
        let ahead = near.filter(|p| p[0] > radar.at_m[0]);
        let Some(marker) = ahead.min_by(|a, b| a[0].total_cmp(&b[0])) else { return Ok(Vec::new()) };
        let (ahead_m, lateral_m) = (marker[0] - radar.at_m[0], marker[1] - radar.at_m[1]);
        let s_m = if against { on.s_m - ahead_m } else { on.s_m + ahead_m };
        let sign = if radar.side == Side::Left { 1.0 } else { -1.0 };
        let mut all = Vec::new();
        for (k, distance_m) in distances_m.iter().enumerate() {
            // The marker is lateral_m to the left now and is to be sign * distance.
            let site = at(s_m, on.offset_m + lateral_m - sign * distance_m)?;
            let scan = self.scans(&format!("sweep{k}"), &site, std::slice::from_ref(radar))?;
            all.extend(scan.into_iter().flatten().next().map(|v| (*distance_m, v)));
        }
        Ok(all)
    }
}

/// The scans of some frames.
fn block(drive: &Drive<'_>, radars: &[ImpulseRadar], frames: Range<u32>) -> Result<Scans> {
    let scan = |radar: &ImpulseRadar, index: u32| {
        let cube = drive.frame(radar.which, index)?.take_samples()?.into_f32();
        // One scan a frame: the first where a radar gives several.
        Ok(cube.row(0, 0).iter().take(radar.samples).map(|z| z.re).collect())
    };
    frames.map(|index| radars.iter().map(|radar| scan(radar, index)).collect()).collect()
}

/// Whether an object is stationary.
fn is_still(o: &Object) -> bool {
    o.motion.is_none() && o.velocity_mps == DVec3::ZERO
}

/// Whether an object is the road itself.
fn is_road(o: &Object) -> bool {
    matches!(o.class.as_str(), "road" | "verge" | "lane_line")
}

/// Largest extent of an echo in range, in pulse lengths c / 2B.
const ECHO_PULSES: f64 = 3.0;

/// The site without what lies beyond the samples of all radars in these frames. With one bounce nothing there
/// shows in them: its echoes come later, and it hides nothing nearer.
fn within_reach(site: &Site, radars: &[ImpulseRadar], frames: Range<u32>) -> Site {
    let scenario = &site.scenario;
    let mut near = Bounds::EMPTY;
    for own in radars {
        let radar = &scenario.radars[own.which];
        let pulse_m = C0 / (2.0 * radar.bandwidth_hz());
        let reach_m = own.axis.start_m + own.samples as f64 * own.axis.step_m + ECHO_PULSES * pulse_m;
        for index in frames.clone() {
            let at = radar.mounting.then(&scenario.ego.pose(scenario.frames.time_s(index))).translation_m;
            near = near.with(at - reach_m).with(at + reach_m);
        }
    }
    let mut scene = site.scene.clone();
    scene.objects.retain_mut(|o| {
        let Shape::Mesh(number) = o.shape else { return true };
        if !is_still(o) {
            return true;
        }
        let mesh = &scene.meshes[number];
        let place = |i: u32| o.pose.point(mesh.positions_m[i as usize]);
        let kept: Vec<usize> = (0..mesh.triangles.len())
            .filter(|t| {
                let corners = mesh.triangles[*t].map(place);
                near.meets(&corners.into_iter().fold(Bounds::EMPTY, Bounds::with))
            })
            .collect();
        if !kept.is_empty() && kept.len() < mesh.triangles.len() {
            let part = Mesh {
                triangles: kept.iter().map(|t| mesh.triangles[*t]).collect(),
                material: kept.iter().map(|t| mesh.material[*t]).collect(),
                ..mesh.clone()
            };
            o.shape = Shape::Mesh(scene.meshes.len());
            scene.meshes.push(part);
        }
        !kept.is_empty()
    });
    Site { scenario: scenario.clone(), scene, road: site.road.clone() }
}

/// A box along the world's axes.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    low: DVec3,
    high: DVec3,
}

impl Bounds {
    const EMPTY: Bounds = Bounds { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };

    fn with(self, p: DVec3) -> Bounds {
        Bounds { low: self.low.min(p), high: self.high.max(p) }
    }

    fn meets(&self, other: &Bounds) -> bool {
        self.low.cmple(other.high).all() && other.low.cmple(self.high).all()
    }
}

/// A slow drive without sway along the scenario's road.
struct Slow {
    s_m: f64,
    offset_m: f64,
    scans: u32,
}

fn missing(what: &str) -> BadInput {
    BadInput::new(format!("the drive without markers needs {what}"))
        .key("ego.on_road")
        .remedy("scene.road = \"ROAD.toml\" and on_road = { lane = 1 }")
}

/// The vehicle's position on its road, and the road.
fn road_of<'a>(site: &'a Site, scenario: &'a Scenario) -> Result<(&'a OnRoad, &'a RoadLabel)> {
    let on = scenario.ego.on_road().ok_or_else(|| missing("a vehicle on a road"))?;
    let truth = site.road.as_ref().ok_or_else(|| missing("a road"))?;
    let named = |name: &str| truth.roads.iter().find(|r| r.name == name);
    let road = on.road.as_deref().map_or_else(|| truth.roads.first(), named);
    Ok((on, road.ok_or_else(|| missing("a road"))?))
}

/// Whether the vehicle drives against the road's direction, from where the scenario puts it.
fn goes_against(site: &Site, scenario: &Scenario) -> Result<bool> {
    let (on, road) = road_of(site, scenario)?;
    let now = site.scenario.ego.at(0.0);
    let i = road.s_m.partition_point(|s| *s <= on.s_m).clamp(1, road.s_m.len().max(2) - 1);
    let place = |k: usize| road.axis_m.get(k).map(|p| DVec2::new(p[0], p[1])).unwrap_or_default();
    Ok((now.rotation * DVec3::X).truncate().dot(place(i) - place(i - 1)) < 0.0)
}

/// The scenario with the vehicle's approach to its position at time zero, with a frame for each scan; None
/// where the road begins there or the vehicle has stood there. The drive is the scenario's own at negative
/// times.
pub fn run_up(site: &Site, scenario: &Scenario, settings: &Settings) -> Result<Option<Scenario>> {
    let (on, road) = road_of(site, scenario)?;
    let against = goes_against(site, scenario)?;
    let interval_s = scenario.frames.interval_s;
    let before_s = |count: u32| -f64::from(count) * interval_s;
    let way_m = |count: u32| -on.drive.distance_m(before_s(count));
    let room_m = if against { road.length_m - on.s_m } else { on.s_m };
    let most_m = settings.run_up_m().min(room_m);
    let mut count = 0;
    while count < MOST_RUN_UP && on.drive.speed_mps(before_s(count + 1)) > 0.0 && way_m(count + 1) <= most_m {
        count += 1;
    }
    if count == 0 {
        return Ok(None);
    }
    let later_s = -before_s(count);
    let mut early = scenario.clone();
    early.frames.count = count;
    // Noise and asphalt of its own: frames count from its beginning.
    early.seed = early.seed.wrapping_add(2_000_000);
    if let Some(to) = early.ego.on_road_mut() {
        to.s_m = if against { on.s_m + way_m(count) } else { on.s_m - way_m(count) };
        to.against = Some(against);
        to.drive.speed.iter_mut().for_each(|p| p[0] += later_s);
        to.drive.lane_changes.iter_mut().for_each(|c| c.at_s += later_s);
        if let Some(sway) = &mut to.drive.sway {
            sway.phase -= later_s / sway.period_s;
        }
    }
    Ok(Some(early))
}

/// Divides the `count` scans of the slow drives over a road: as many lengths of it as needed, and at least
/// `least` drives.
fn slow_drives(
    site: &Site,
    scenario: &Scenario,
    settings: &Settings,
    count: u32,
    least: u32,
) -> Result<(Vec<Slow>, bool)> {
    let (_, road) = road_of(site, scenario)?;
    let step_m = settings.quiet_speed_kmh / 3.6 * scenario.frames.interval_s;
    let each = ((road.length_m - 2.0 * END_M) / step_m).floor();
    if each < 1.0 {
        let bad = BadInput::new("the road is too short for a drive without markers").key("scene.road");
        let bad = bad.value(format!("{} m", road.length_m));
        return Err(bad.allowed(format!("{} m or more", 2.0 * END_M + step_m)).into());
    }
    let against = goes_against(site, scenario)?;
    let drives = (f64::from(count) / each).ceil().max(f64::from(least)) as u32;
    let each = each.min((f64::from(count) / f64::from(drives)).ceil());
    // Where one length of the road holds them all, one begins where the last ended.
    let next_m = match f64::from(count) * step_m <= road.length_m - 2.0 * END_M {
        true => each * step_m,
        false => 0.0,
    };
    let fits_m = (0.5 * (settings.lane_width_m - settings.car_width_m) - SIDE_M).max(0.0);
    let spare_m = settings.quiet_aside_m.unwrap_or(fits_m);
    let slow = |k: u32| {
        let share = if drives > 1 { 2.0 * f64::from(k) / f64::from(drives - 1) - 1.0 } else { 0.0 };
        let left = count.saturating_sub(k * each as u32);
        let from_m = END_M + f64::from(k) * next_m;
        Slow {
            s_m: if against { road.length_m - from_m } else { from_m },
            offset_m: share * spare_m,
            scans: left.min(each as u32),
        }
    };
    Ok(((0..drives).map(slow).filter(|s| s.scans > 0).collect(), against))
}

fn slowly(scenario: &Scenario, settings: &Settings, slow: &Slow, against: bool) -> Scenario {
    let mut s = scenario.clone();
    s.frames.count = slow.scans;
    if let Some(on) = s.ego.on_road_mut() {
        (on.s_m, on.offset_m, on.against) = (slow.s_m, slow.offset_m, Some(against));
        on.drive = catseye::scene::drive::Drive::steady(settings.quiet_speed_kmh / 3.6);
    }
    s
}

/// The passage of a radar at a marker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Passed {
    pub time_s: f64,
    /// Lateral distance from the radar, m, positive to the left.
    pub lateral_m: f64,
}

/// When a radar passes a place, given its distances ahead and aside at two times.
fn passed([t, u]: [f64; 2], [a, b]: [f64; 2], lateral_m: f64, reach_m: f64) -> Option<Passed> {
    let passes = a > 0.0 && b <= 0.0 && lateral_m.abs() <= reach_m;
    passes.then(|| Passed { time_s: t + a / (a - b) * (u - t), lateral_m })
}

/// Truth of the markers of a drive for one radar: the passages within the gate, in order, and for each frame
/// the lateral distance, m, if the radar is beside a plate.
pub fn markers_of(
    drive: &Drive<'_>,
    radar: &ImpulseRadar,
    settings: &Settings,
) -> (Vec<Passed>, Vec<Option<f64>>) {
    let ([rx, ry], reach_m) = (radar.at_m, radar.reach_m());
    let beside = (0..drive.frames()).map(|index| {
        let now = drive.markers(drive.time_s(index));
        let near = now.iter().filter(|p| (p[0] - rx).abs() <= 0.5 * settings.plate_length_m);
        let lateral = near.map(|p| p[1] - ry).filter(|y| y.abs() <= reach_m);
        lateral.min_by(|a, b| a.abs().total_cmp(&b.abs()))
    });
    let beside = beside.collect();
    let mut passes = passes(drive, radar, &|time_s| drive.markers(time_s));
    passes.dedup_by(|b, a| b.time_s <= a.time_s);
    (passes, beside)
}

/// When a radar passes places given in the level frame at a time, in order.
fn passes(drive: &Drive<'_>, radar: &ImpulseRadar, at: &dyn Fn(f64) -> Vec<[f64; 2]>) -> Vec<Passed> {
    let ([rx, ry], reach_m) = (radar.at_m, radar.reach_m());
    let looks: Vec<(f64, Vec<[f64; 2]>)> =
        (0..drive.frames()).map(|index| drive.time_s(index)).map(|time_s| (time_s, at(time_s))).collect();
    let mut out: Vec<Passed> = Vec::new();
    for w in looks.windows(2) {
        let pass = |(p, q): (&[f64; 2], &[f64; 2])| {
            passed([w[0].0, w[1].0], [p[0] - rx, q[0] - rx], q[1] - ry, reach_m)
        };
        out.extend(w[0].1.iter().zip(&w[1].1).filter_map(pass));
    }
    out.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    out
}

/// Times at which the radar passes single metal things (manhole covers) beside a drive, s.
pub fn covers_of(drive: &Drive<'_>, radar: &ImpulseRadar) -> Vec<f64> {
    let rows = drive.site.road.iter().flat_map(|r| &r.marker_rows);
    let markers: Vec<u32> = rows.flat_map(|r| &r.markers).map(|m| m.id).collect();
    let objects = drive.site.scene.objects.iter();
    let covers = || objects.clone().filter(|o| !is_road(o) && !markers.contains(&o.id));
    let at = |time_s: f64| {
        let level = drive.level(time_s);
        covers().map(|o| level.from_world(o.pose.translation_m.truncate()).to_array()).collect()
    };
    passes(drive, radar, &at).iter().map(|p| p.time_s).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use catseye::engine::{Engine, Precision};
    use std::path::{Path, PathBuf};

    fn path(file: &str) -> PathBuf {
        Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("scenes/lane").join(file)
    }

    fn compared(file: &str) -> Scenario {
        let mut scenario = Scenario::load(&path(file)).unwrap();
        scenario.radars.retain(|r| matches!(r.waveform, Waveform::Pulse { .. }));
        scenario.frames.interval_s = 0.05;
        scenario
    }

    fn compared_settings() -> Settings {
        Settings { plate_class: Some("plate".into()), gate_m: Some([1.32, 2.07]), ..Settings::default() }
    }

    /// The vehicle comes to where the scenario has it, along the same way.
    #[test]
    fn a_run_up_leads_to_the_drive() {
        let mut scenario = compared("compare_bend.toml");
        let settings = Settings { run_up_m: Some(30.0), ..Settings::default() };
        for (s_m, against, way_m) in [(60.0, false, 30.0), (20.0, false, 20.0), (240.0, true, 20.0)] {
            let on = scenario.ego.on_road_mut().unwrap();
            (on.s_m, on.against) = (s_m, Some(against));
            on.drive.speed = vec![[0.0, 15.0], [0.5, 12.0]];
            on.drive.lane_changes =
                vec![catseye::scene::drive::LaneChange { at_s: -1.0, by_m: 0.4, over_s: 2.0 }];
            let drive = Site::new(&scenario).unwrap();
            let early = run_up(&drive, &scenario, &settings).unwrap().unwrap();
            let count = early.frames.count;
            assert_eq!(count, (way_m / (15.0 * 0.05)) as u32);
            let before = Site::new(&early).unwrap();
            let later_s = f64::from(count) * 0.05;
            for t in [-0.9, -0.5, -0.05, 0.0, 0.3, 0.9] {
                let (a, b) = (before.scenario.ego.at(later_s + t), drive.scenario.ego.at(t));
                let apart = (a.translation_m - b.translation_m).length();
                assert!(apart < 1e-4 && a.rotation.dot(b.rotation).abs() > 1.0 - 1e-8, "{s_m} {t}: {apart}");
            }
            assert!(early.seed != scenario.seed);
        }
        let standing = Settings { run_up_m: Some(0.0), ..settings.clone() };
        assert!(run_up(&Site::new(&scenario).unwrap(), &scenario, &standing).unwrap().is_none());
        scenario.ego.on_road_mut().unwrap().drive = catseye::scene::drive::Drive::steady(0.0);
        assert!(run_up(&Site::new(&scenario).unwrap(), &scenario, &settings).unwrap().is_none());
    }

    /// What is left out does not show in the samples. Without rough surfaces, whose squares depend on how much of them there is.
    #[test]
    fn what_lies_beyond_the_samples_does_not_show() {
        let mut scenario = compared("compare_straight.toml");
        scenario.frames.count = BLOCK;
        scenario.trace.rays = 0;
        (scenario.trace.bounces, scenario.trace.most_bounces) = (1, 0);
        let settings = compared_settings();
        let impulse_radars = impulse_radars(&scenario, &settings).unwrap();
        let site = site(&scenario, &settings).unwrap();
        let near = within_reach(&site, &impulse_radars, 0..BLOCK);
        let triangles = |s: &Site| -> usize {
            let mesh = |o: &Object| match o.shape {
                Shape::Mesh(m) => s.scene.meshes[m].triangles.len(),
                _ => 0,
            };
            s.scene.objects.iter().map(mesh).sum()
        };
        assert!(2 * triangles(&near) < triangles(&site), "{} of {}", triangles(&near), triangles(&site));
        let engine = Engine::open("cpu", Precision::F32).unwrap();
        // Beside a plate, between two, and by the end of what is left.
        for index in [4, 33, BLOCK - 1] {
            let scan = |site: &Site| -> Vec<f32> {
                let cube = Drive::new(site, &engine)
                    .unwrap()
                    .frame(0, index)
                    .unwrap()
                    .take_samples()
                    .unwrap()
                    .into_f32();
                cube.row(0, 0).iter().take(impulse_radars[0].samples).map(|z| z.re).collect()
            };
            let (all, part) = (scan(&site), scan(&near));
            let peak = all.iter().fold(0.0f32, |m, v| m.max(v.abs()));
            let apart = all.iter().zip(&part).fold(0.0f32, |m, (a, b)| m.max((a - b).abs()));
            // The road's sides between two plates that lie on it end at the next one, which may be left out. Where a side ends decides
            // where its waves begin, and waves hold at the carrier: over this band it shows by 2.6e-4, at any accuracy.
            assert!(all.len() == part.len() && apart < 3e-4 * peak, "{index}: {apart} of {peak}");
        }
    }

    #[test]
    fn slow_drives_take_all_scans_from_side_to_side() {
        let scenario = compared("compare_straight.toml");
        let site = Site::new(&scenario).unwrap();
        for (count, least) in [(600, 3), (20, 3), (2, 3), (5000, 3), (700, 1)] {
            let (drives, against) =
                slow_drives(&site, &scenario, &compared_settings(), count, least).unwrap();
            assert!(!against && drives.iter().map(|d| d.scans).sum::<u32>() == count);
            let step_m = 10.0 / 3.6 * 0.05;
            let ends = |d: &Slow| (d.s_m, d.s_m + f64::from(d.scans) * step_m);
            assert!(drives.iter().all(|d| ends(d).0 >= END_M && ends(d).1 <= 260.0 - END_M + 1e-9));
            // One drive begins where the last ended, unless the road is too short for all.
            let apart = drives.windows(2).all(|w| ends(&w[1]).0 >= ends(&w[0]).1 - 1e-9);
            assert_eq!(apart, f64::from(count) * step_m <= 250.0, "{count}");
            if count >= 20 && least == 3 {
                let (first, last) = (drives[0].offset_m, drives[drives.len() - 1].offset_m);
                assert!(drives.len() >= 3 && (first + 0.7).abs() < 1e-9 && (last - 0.7).abs() < 1e-9);
            }
        }
    }
}
