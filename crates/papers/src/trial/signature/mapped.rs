//! The mapping drive with the poses of an inertial system, and the estimator on its map.

use crate::trial::kit::*;
use crate::trial::signature::settings::Settings;
use catseye::road::plan::Source;
use catseye::scene::Object;
use catseye::scene::scenario::OnRoad;
use catseye_lane::signature::estimator::{
    MapLane, MapLanes, Signature, SignatureSetup, StaticTest, scan_point,
};
use catseye_lane::signature::locate::LocateSettings;
use catseye_lane::signature::map::{MapSettings, Pose, ScanPoint, SignatureMap};
use std::path::Path;

/// Data kept of a frame.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Kept {
    pub points: Vec<LanePoint>,
    /// Whether a moving object made each point, to judge the test for motion.
    pub moves: Vec<bool>,
}

pub fn kept(drive: &Drive<'_>, frame: &Frame) -> Kept {
    let moves = |o: &&Object| o.motion.is_some() || o.velocity_mps != DVec3::ZERO;
    let moving: Vec<u32> = drive.site.scene.objects.iter().filter(moves).map(|o| o.id).collect();
    let radar = drive.radar(frame.radar);
    let all = frame.points.iter().filter_map(|p| {
        let q = lane_point(radar, p)?;
        // A file keeps finite numbers only.
        let rcs_dbsm = if q.rcs_dbsm.is_finite() { q.rcs_dbsm } else { 0.0 };
        Some((LanePoint { rcs_dbsm, ..q }, moving.contains(&p.object_id)))
    });
    let (points, moves) = all.unzip();
    Kept { points, moves }
}

/// The scenario of the mapping drive, and the plan of its roads with other traffic.
fn mapping(scenario: &Scenario, plan: &ScenePlan, s: &Settings) -> (Scenario, ScenePlan) {
    let mut scenario = scenario.clone();
    scenario.seed = scenario.seed.wrapping_add(0x5160_0000);
    scenario.frames.count = s.map_frames;
    scenario.frames.interval_s = s.map_interval_s;
    if let Some(on) = scenario.ego.on_road_mut() {
        on.s_m = s.map_s_m.unwrap_or(on.s_m);
        on.offset_m = s.map_offset_m;
    }
    (scenario, moved_on(plan, s.map_traffic_m))
}

/// The plan with the vehicles moved forward along their roads by `by_m`.
pub fn moved_on(plan: &ScenePlan, by_m: f64) -> ScenePlan {
    let mut plan = plan.clone();
    for road in &mut plan.roads {
        let length = road.road.axis.length_m();
        for thing in road.things.iter_mut().filter(|t| matches!(t.source, Source::Vehicle { .. })) {
            thing.s_m = (thing.s_m + by_m).rem_euclid(length.max(1.0));
        }
    }
    plan
}

/// The lines of the road on which the ego drives, with the error of a survey.
fn surveyed(road: &RoadTruth, name: Option<&str>, std_m: f64, seed: u64) -> MapLanes {
    let mut draws = Draws::new(seed as u32, 0x11e5);
    let Some(label) = road.roads.iter().find(|r| name.is_none_or(|n| n == r.name)) else {
        return MapLanes::default();
    };
    let mut out = MapLanes { std_m: std_m.max(0.005), ..MapLanes::default() };
    let mut known: Vec<&Vec<[f64; 3]>> = Vec::new();
    for lane in &label.lanes {
        let mut index = [0; 2];
        for (k, line) in [&lane.right_m, &lane.left_m].into_iter().enumerate() {
            let same = |other: &&Vec<[f64; 3]>| {
                other.iter().zip(line).all(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]) < 1e-3)
            };
            index[k] = match known.iter().position(same) {
                Some(i) => i,
                None => {
                    out.lines_m.push(shifted(line, std_m * draws.normal()));
                    known.push(line);
                    known.len() - 1
                }
            };
        }
        out.lanes.push(MapLane { number: lane.number, right: index[0], left: index[1] });
    }
    out
}

/// A line moved to its left by `left_m`.
fn shifted(line: &[[f64; 3]], left_m: f64) -> Vec<[f64; 2]> {
    let plane: Vec<DVec2> = line.iter().map(|p| DVec2::new(p[0], p[1])).collect();
    let n = plane.len();
    let moved = (0..n).map(|i| {
        let ahead = plane[(i + 1).min(n - 1)] - plane[i.saturating_sub(1)];
        (plane[i] + ahead.normalize_or(DVec2::X).perp() * left_m).to_array()
    });
    moved.collect()
}

/// Distance behind the vehicle's reference point from which lines are compared, m.
pub const BEHIND_M: f64 = 2.0;

pub fn at_rest(drive: &Drive<'_>, which: usize) -> StaticTest {
    let radar = drive.radar(which);
    StaticTest {
        radar_m: mount(radar).0.to_array(),
        fold_mps: Some(2.0 * radar.max_velocity_mps()).filter(|f| f.is_finite() && *f > 0.0),
        ..StaticTest::default()
    }
}

/// Correlated errors of an inertial system (first-order Gauss–Markov).
struct Inertial {
    draws: Draws,
    now: [f64; 3],
    std: [f64; 3],
    lasting_s: f64,
}

impl Inertial {
    fn new(s: &Settings, seed: u64) -> Inertial {
        let std = [s.ins_std_m, s.ins_std_m, s.ins_heading_std_deg.to_radians()];
        let mut draws = Draws::new(seed as u32, 0x1135);
        let now = std.map(|x| x * draws.normal());
        Inertial { draws, now, std, lasting_s: s.ins_lasting_s }
    }

    fn next(&mut self, dt_s: f64) -> [f64; 3] {
        let keep = (-dt_s / self.lasting_s).exp();
        for (x, std) in self.now.iter_mut().zip(self.std) {
            *x = *x * keep + std * (1.0 - keep * keep).sqrt() * self.draws.normal();
        }
        self.now
    }
}

/// The bus of a drive.
pub fn bus_of(s: &Settings, seed: u64) -> Bus {
    Bus::new(seed, [s.speed_std_mps, 0.0], (draws(seed ^ 0x9e37, 0x5eed), s.yaw_rate_std_deg_per_s))
}

pub fn needs(problem: &str, key: &str, remedy: &str) -> Error {
    BadInput::new(problem).key(key).remedy(remedy).into()
}

/// Half the field of view of the radar that maps and looks, rad.
pub const HALF_VIEW_RAD: f64 = 1.4;

/// The road's file and the vehicle's position on it.
///
/// # Errors
/// Returns an error if the scenario has no road file or no vehicle on the road.
pub fn on_road(scenario: &Scenario) -> Result<(&Path, &OnRoad)> {
    let SceneSource::Road { path } = &scenario.scene else {
        return Err(needs("the method needs a road to map", "scene.road", "give scene.road = \"FILE.toml\""));
    };
    match scenario.ego.on_road() {
        Some(on) => Ok((path, on)),
        None => Err(needs(
            "the method needs a vehicle on the road",
            "ego.on_road",
            "give [ego] on_road = { s_m = 10 }",
        )),
    }
}

/// A road as mapped by a separate drive.
pub struct Mapped {
    pub map: SignatureMap,
    pub lanes: MapLanes,
    pub errors: Vec<f64>,
    /// Standard deviations of the poses from which it was made: position (m, m) and heading (rad).
    pub std: [f64; 3],
    /// Path of the vehicle, m.
    pub way: Vec<[f64; 2]>,
    pub road: Option<RoadTruth>,
    pub moving: Moving,
}

/// Drives and maps the road. `told` is called with the number of finished frames.
pub fn map_drive(
    given: &TrialContext<'_>,
    s: &Settings,
    which: usize,
    plan: &ScenePlan,
    told: &mut dyn FnMut(u64),
) -> Result<Mapped> {
    let named = on_road(given.scenario)?.1.road.clone();
    let (map_scenario, map_plan) = mapping(given.scenario, plan, s);
    let site = Site::on(&map_scenario, map_plan)?;
    let drive = Drive::new(&site, given.engine)?;
    let rest = at_rest(&drive, which);
    let map_settings = MapSettings {
        near_m: s.range_m[0],
        far_m: s.range_m[1],
        half_view_rad: HALF_VIEW_RAD,
        ..MapSettings::default()
    };
    let mut map = SignatureMap::new(map_settings).map_err(|e| Error::Failed(e.to_string()))?;
    let mut bus = bus_of(s, map_scenario.seed);
    let mut inertial = Inertial::new(s, map_scenario.seed);
    let mut moving = Moving::default();
    let mut map_way: Vec<[f64; 2]> = Vec::new();
    for f in 0..s.map_frames {
        let k = given.kept(&format!("map_frame{f}"), || Ok(kept(&drive, &drive.frame(which, f)?)))?;
        let level = drive.level(drive.time_s(f));
        let [speed, yaw_rate] = bus.read(&level);
        let stands = rest.standing(&k.points, speed, Some(yaw_rate));
        moving.count(&k, &stands);
        let scan: Vec<ScanPoint> =
            k.points.iter().zip(&stands).filter(|(_, st)| **st).map(|(p, _)| scan_point(p)).collect();
        let off = inertial.next(if f == 0 { 0.0 } else { s.map_interval_s });
        let known = Level {
            at_m: level.at_m + DVec2::new(off[0], off[1]),
            heading_rad: level.heading_rad + off[2],
            ..level
        };
        let radar = known.to_world(DVec2::from_array(rest.radar_m));
        let pose = Pose { x_m: radar.x, y_m: radar.y, heading_rad: known.heading_rad };
        map.add_scan(pose, inertial.std, None, &scan).map_err(|e| Error::Failed(e.to_string()))?;
        map_way.push(level.at_m.to_array());
        told(u64::from(f) + 1);
    }
    let road = site.road.clone();
    map.prune(s.least_hits, 0.3);
    let map_errors = map_errors(&map, road.as_ref());
    let lanes = road
        .as_ref()
        .map(|r| surveyed(r, named.as_deref(), s.lines_std_m, map_scenario.seed))
        .unwrap_or_default();
    Ok(Mapped { map, lanes, std: inertial.std, errors: map_errors, way: map_way, road, moving })
}

/// Makes the estimator for a drive on a mapped road.
pub fn estimator_on(s: &Settings, drive: &Drive<'_>, which: usize, mapped: &Mapped) -> Result<Signature> {
    let base = SignatureSetup::default();
    let ranged = |l: LocateSettings| LocateSettings {
        near_m: s.range_m[0],
        far_m: s.range_m[1],
        half_view_rad: HALF_VIEW_RAD,
        ..l
    };
    let options = SignatureSetup {
        at_rest: at_rest(drive, which),
        search: ranged(base.search),
        track: ranged(base.track),
        reach_m: [BEHIND_M - 0.5, s.reach_m + 5.0],
        map_std: mapped.std,
        rows: s.row.iter().filter_map(|r| r.options(s.range_m)).collect(),
        ..base
    };
    Signature::new(mapped.map.clone(), mapped.lanes.clone(), options)
        .map_err(|e| needs(&e.to_string(), "lane.signature", "change the named setting"))
}

/// Quality of the test for motion: counts of all points and of those that it removes.
#[derive(Debug, Clone, Copy, Default)]
pub struct Moving {
    pub moving: [usize; 2],
    pub standing: [usize; 2],
}

impl Moving {
    pub fn count(&mut self, k: &Kept, stands: &[bool]) {
        for (moves, stands) in k.moves.iter().zip(stands) {
            let [all, out] = if *moves { &mut self.moving } else { &mut self.standing };
            *all += 1;
            *out += usize::from(!stands);
        }
    }
}

/// Distances of landmarks from the nearest marker, of those within half a metre, m.
fn map_errors(map: &SignatureMap, road: Option<&RoadTruth>) -> Vec<f64> {
    let markers = road.iter().flat_map(|r| &r.marker_rows).flat_map(|r| &r.markers);
    let markers: Vec<DVec2> = markers.map(|m| DVec2::new(m.position_m[0], m.position_m[1])).collect();
    let error = |at: DVec2| markers.iter().map(|m| m.distance(at)).min_by(f64::total_cmp);
    let errors = map.landmarks().iter().filter_map(|l| error(DVec2::from_array(l.position_m)));
    errors.filter(|d| *d < 0.5).collect()
}
