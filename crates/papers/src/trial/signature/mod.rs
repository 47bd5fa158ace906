//! A drive is mapped with an inertial system's poses, other drives are located in its map, and words of marker rows are read on the
//! way (Feng 2019, sections 4.3.2 and 4.3.4).

mod figures;
mod pictures;
mod rival;
mod settings;

pub(super) use rival::rival;
pub use settings::{CodeName, GapsTable, RowTable, Settings, SidesTable};

use super::drive::{Drive, Level, suitable};
use super::report::common_rows;
use super::{Given, SpeedSensor, Step, Trial};
use catseye::error::{BadInput, Error, Result};
use catseye::rng::Draws;
use catseye::road::labels::RoadTruth;
use catseye::road::plan::{ScenePlan, Source};
use catseye::road::scene_toml;
use catseye::road::site::Site;
use catseye::scene::scenario::{OnRoad, Scenario, SceneSource};
use catseye::scene::waveform::Waveform;
use catseye::simulate::Frame;
use catseye_lane::score::{TrueLanes, score};

use catseye_lane::signature::codewords::{Reading, RowPoint};
use catseye_lane::signature::estimator::{
    MapLane, MapLanes, MapPosition, Signature, SignatureOptions, StaticTest, scan_point,
};
use catseye_lane::signature::locate::LocateSettings;
use catseye_lane::signature::map::{MapSettings, Pose, ScanPoint, SignatureMap};
use catseye_lane::signature::row::Picked;
use catseye_lane::{LaneError, LaneEstimator, LanePoint, Measured, SensorInput};
use figures::{map_rows, notes, place_rows, sheets, word_rows};
use glam::{DMat3, DVec2, DVec3};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::time::Instant;

/// What is kept of a frame.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Kept {
    points: Vec<LanePoint>,
    /// Of each point: whether an object that moves made it (to judge the test for motion by).
    moves: Vec<bool>,
}

fn kept(drive: &Drive<'_>, frame: &Frame) -> Kept {
    let moving: Vec<u32> = drive
        .site
        .scene
        .objects
        .iter()
        .filter(|o| o.motion.is_some() || o.velocity_mps != DVec3::ZERO)
        .map(|o| o.id)
        .collect();
    let radar = drive.radar(frame.radar);
    let all = frame.points.iter().filter_map(|p| {
        let q = super::drive::lane_point(radar, p)?;
        // A file keeps finite numbers only.
        let rcs_dbsm = if q.rcs_dbsm.is_finite() { q.rcs_dbsm } else { 0.0 };
        Some((LanePoint { rcs_dbsm, ..q }, moving.contains(&p.object_id)))
    });
    let (points, moves) = all.unzip();
    Kept { points, moves }
}

/// The scenario of the drive that is mapped, and the plan of its roads with other traffic.
fn mapping(scenario: &Scenario, plan: &ScenePlan, s: &Settings) -> (Scenario, ScenePlan) {
    let mut scenario = scenario.clone();
    scenario.seed = scenario.seed.wrapping_add(0x5160_0000);
    scenario.frames.count = s.map_frames;
    scenario.frames.interval_s = s.map_interval_s;
    if let Some(on) = &mut scenario.ego.on_road {
        on.s_m = s.map_s_m.unwrap_or(on.s_m);
        on.offset_m = s.map_offset_m;
    }
    (scenario, moved_on(plan, s.map_traffic_m))
}

/// With the vehicles so much further along their roads.
fn moved_on(plan: &ScenePlan, by_m: f64) -> ScenePlan {
    let mut plan = plan.clone();
    for road in &mut plan.roads {
        let length = road.road.axis.length_m();
        for thing in road.things.iter_mut().filter(|t| matches!(t.source, Source::Vehicle(_))) {
            thing.s_m = (thing.s_m + by_m).rem_euclid(length.max(1.0));
        }
    }
    plan
}

/// Of the lines of the road that the ego drives on, as a survey with its own error has them.
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

/// A line moved to its left.
fn shifted(line: &[[f64; 3]], left_m: f64) -> Vec<[f64; 2]> {
    let plane: Vec<DVec2> = line.iter().map(|p| DVec2::new(p[0], p[1])).collect();
    let n = plane.len();
    let moved = (0..n).map(|i| {
        let ahead = plane[(i + 1).min(n - 1)] - plane[i.saturating_sub(1)];
        (plane[i] + ahead.normalize_or(DVec2::X).perp() * left_m).to_array()
    });
    moved.collect()
}

/// Lines are judged from so far behind the vehicle's reference point on, m.
const BEHIND_M: f64 = 2.0;

/// True lines ahead of the vehicle: the radar looks that way.
fn ahead(mut truth: TrueLanes) -> TrueLanes {
    for line in &mut truth.lines {
        line.retain(|p| p[0] >= -BEHIND_M);
    }
    truth
}

fn at_rest(drive: &Drive<'_>, which: usize) -> StaticTest {
    let radar = drive.radar(which);
    let at = radar.mounting.translation_m;
    StaticTest {
        radar_m: [at.x, at.y],
        fold_mps: Some(2.0 * radar.max_velocity_mps()).filter(|f| f.is_finite() && *f > 0.0),
        ..StaticTest::default()
    }
}

fn pose(level: &Level) -> Pose {
    Pose { x_m: level.at_m.x, y_m: level.at_m.y, heading_rad: level.heading_rad }
}

/// Errors of an inertial system that last a while (first-order Gauss–Markov).
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

/// A look that was located, beside the truth.
#[derive(Debug, Clone)]
struct Located {
    run: u32,
    time_s: f64,
    /// Along the truth's way from its beginning, m.
    way_m: f64,
    truth: Pose,
    place: Option<MapPosition>,
    /// Along, across (m), heading (rad).
    error: Option<[f64; 3]>,
    /// Squared error over its covariance, 3 on the mean.
    nees: Option<f64>,
}

fn compared(truth: &Pose, place: &MapPosition) -> ([f64; 3], Option<f64>) {
    let v = &place.vehicle;
    let turn = (v.heading_rad - truth.heading_rad + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU)
        - std::f64::consts::PI;
    let off = DVec2::new(v.x_m - truth.x_m, v.y_m - truth.y_m);
    let local = DVec2::from_angle(-truth.heading_rad).rotate(off);
    let e = DVec3::new(off.x, off.y, turn);
    let nees = e.dot(DMat3::from_cols_array_2d(&place.covariance).inverse() * e);
    ([local.x, local.y, turn], nees.is_finite().then_some(nees))
}

/// How points were taken away and added before a word was read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Worse {
    No,
    /// In the row as gathered over all looks: markers that are gone, things that stand there.
    Row,
    /// In each look by itself, before it is gathered: echoes under the noise, false alarms.
    Looks,
}

/// A word read, beside the one that is written.
#[derive(Debug, Clone)]
struct WordRead {
    run: u32,
    frame: u32,
    row: usize,
    worse: Worse,
    points: usize,
    reading: Option<Reading>,
    right: Option<bool>,
}

/// Takes a share of the points away and adds as many others at random places of the row.
fn worsened(points: &[RowPoint], share: f64, spread_m: f64, draws: &mut Draws) -> Vec<RowPoint> {
    let mut out: Vec<RowPoint> = points.iter().filter(|_| draws.uniform() >= share).copied().collect();
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return out };
    for _ in 0..(share * points.len() as f64).round() as usize {
        let s_m = first.s_m + (last.s_m - first.s_m) * draws.uniform();
        out.push(RowPoint { s_m, t_m: spread_m * (2.0 * draws.uniform() - 1.0), ..*first });
    }
    out.sort_by(|a, b| a.s_m.total_cmp(&b.s_m));
    out
}

/// Takes a share of a look's points away and adds as many others that stand, up to five metres along the vehicle from one that was
/// seen: in the rows, where they do harm.
fn worsened_look(
    points: &[LanePoint],
    share: f64,
    rest: &StaticTest,
    [speed, yaw]: [Measured; 2],
    draws: &mut Draws,
) -> Vec<LanePoint> {
    let mut out: Vec<LanePoint> = points.iter().filter(|_| draws.uniform() >= share).copied().collect();
    let radar = DVec2::from_array(rest.radar_m);
    let velocity = DVec2::new(speed.value - yaw.value * radar.y, yaw.value * radar.x);
    for p in points {
        let (other, by_m) = (draws.uniform() < share, 10.0 * draws.uniform() - 5.0);
        if !other {
            continue;
        }
        let at = DVec2::from_array(p.at_m) + DVec2::X * by_m;
        let seen = at - radar;
        let range_m = seen.length();
        let turn = if p.range_m > 0.0 { range_m / p.range_m } else { 1.0 };
        out.push(LanePoint {
            at_m: at.to_array(),
            std_m: [p.std_m[0], p.std_m[1] * turn],
            range_m,
            azimuth_rad: seen.to_angle(),
            range_rate_mps: -velocity.dot(seen.normalize_or_zero()),
            ..*p
        });
    }
    out
}

/// A row as read last, for its picture.
struct RowPicture {
    table: RowTable,
    picked: Picked,
    reading: Reading,
}

fn needs(problem: &str, key: &str, remedy: &str) -> Error {
    BadInput::new(problem).key(key).remedy(remedy).into()
}

/// Half the view of the radar that maps and looks, rad.
const HALF_VIEW_RAD: f64 = 1.4;

/// The road's file and the vehicle's place on it. Errors: what is not given.
fn on_road(scenario: &Scenario) -> Result<(&Path, &OnRoad)> {
    let SceneSource::Road { path } = &scenario.scene else {
        return Err(needs("needs a road to map", "scene.road", "give scene.road = \"FILE.toml\""));
    };
    match &scenario.ego.on_road {
        Some(on) => Ok((path, on)),
        None => Err(needs("needs a vehicle on the road", "ego.on_road", "give [ego] on_road = { s_m = 10 }")),
    }
}

/// A road as a drive of its own mapped it.
struct Mapped {
    map: SignatureMap,
    lanes: MapLanes,
    errors: Vec<f64>,
    /// Of the poses that it was made from: place (m, m) and heading (rad).
    std: [f64; 3],
    /// Of the vehicle.
    way: Vec<[f64; 2]>,
    road: Option<RoadTruth>,
    moving: Moving,
}

/// The drive that is mapped. `told` is called with the frames that are done.
fn map_drive(
    given: &Given<'_>,
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
    let mut speed = SpeedSensor::new(map_scenario.seed, s.speed_std_mps, 0.0);
    let mut yaw = SpeedSensor::new(map_scenario.seed ^ 0x9e37, s.yaw_rate_std_deg_per_s.to_radians(), 0.0);
    let mut inertial = Inertial::new(s, map_scenario.seed);
    let mut moving = Moving::default();
    let mut map_way: Vec<[f64; 2]> = Vec::new();
    for f in 0..s.map_frames {
        let k = given.kept(&format!("map_frame{f}"), || Ok(kept(&drive, &drive.frame(which, f)?)))?;
        let level = drive.level(drive.time_s(f));
        let stands =
            rest.standing(&k.points, speed.read(level.speed_mps), Some(yaw.read(level.yaw_rate_rad_per_s)));
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

/// The estimator for a drive on a mapped road.
fn estimator_on(
    s: &Settings,
    drive: &Drive<'_>,
    which: usize,
    mapped: &Mapped,
) -> std::result::Result<Signature, LaneError> {
    let base = SignatureOptions::default();
    let ranged = |l: LocateSettings| LocateSettings {
        near_m: s.range_m[0],
        far_m: s.range_m[1],
        half_view_rad: HALF_VIEW_RAD,
        ..l
    };
    let options = SignatureOptions {
        at_rest: at_rest(drive, which),
        search: ranged(base.search),
        track: ranged(base.track),
        reach_m: [BEHIND_M - 0.5, s.reach_m + 5.0],
        map_std: mapped.std,
        rows: s.row.iter().filter_map(|r| r.options(s.range_m)).collect(),
        ..base
    };
    Signature::new(mapped.map.clone(), mapped.lanes.clone(), options)
}

/// Maps a drive, locates the runs in it, reads the rows. Errors: a scenario without a road file, an ego that is not on a road, no
/// radar with angles; those of the simulation.
pub fn run(given: &Given<'_>, settings: &Settings) -> Result<Trial> {
    settings.check()?;
    let s = settings;
    let scenario = given.scenario;
    let (path, _) = on_road(scenario)?;
    let Some(which) = suitable(&scenario.radars, |w| !matches!(w, Waveform::Pulse { .. })) else {
        return Err(needs("needs a radar that gives angles", "radar", "take radar = \"front77\""));
    };
    let plan = scene_toml::load(path)?;
    let all = u64::from(s.map_frames) + u64::from(given.runs) * u64::from(scenario.frames.count);
    let mut done = 0;

    let mut told = |n: u64| (given.watch)(n, all);
    let mut mapped = map_drive(given, s, which, &plan, &mut told)?;
    done += u64::from(s.map_frames);

    // The drives that are located.
    let (mut steps, mut places, mut words) = (Vec::new(), Vec::new(), Vec::new());
    let mut row_pictures: Vec<Option<RowPicture>> = s.row.iter().map(|_| None).collect();
    let mut shown: Option<(Vec<LanePoint>, Step)> = None;
    for run in 0..given.runs {
        let mut scenario = given.scenario_of(run);
        let mut draws = Draws::new(scenario.seed as u32, 0x57a7);
        let further_m = s.vary_start_m * draws.uniform();
        if let Some(on) = &mut scenario.ego.on_road {
            on.s_m += further_m;
            on.offset_m += s.vary_offset_m * (2.0 * draws.uniform() - 1.0);
        }
        // Other vehicles keep their distance.
        let site = Site::on(&scenario, moved_on(&plan, further_m))?;
        let drive = Drive::new(&site, given.engine)?;
        let mut estimator = estimator_on(s, &drive, which, &mapped)
            .map_err(|e| needs(&e.to_string(), "lane.signature", "change the setting that it names"))?;
        // Beside it one whose looks are worse, for its rows.
        let mut in_worse = match s.row.is_empty() {
            true => None,
            false => estimator_on(s, &drive, which, &mapped).ok(),
        };
        let mut worse_draws = Draws::new(scenario.seed as u32, 0x57a8);
        let mut speed = SpeedSensor::new(scenario.seed, s.speed_std_mps, 0.0);
        let mut yaw = SpeedSensor::new(scenario.seed ^ 0x9e37, s.yaw_rate_std_deg_per_s.to_radians(), 0.0);
        let mut way_m = 0.0;
        let mut before: Option<DVec2> = None;
        for f in 0..drive.frames() {
            let k =
                given.kept(&format!("run{run}_frame{f}"), || Ok(kept(&drive, &drive.frame(which, f)?)))?;
            let time_s = drive.time_s(f);
            let level = drive.level(time_s);
            let measured: [Measured; 2] = [speed.read(level.speed_mps), yaw.read(level.yaw_rate_rad_per_s)];
            mapped.moving.count(&k, &estimator_rest(&drive, which, &k, measured));
            let look = SensorInput {
                time_s,
                speed_mps: Some(measured[0]),
                yaw_rate_rad_per_s: Some(measured[1]),
                points: &k.points,
                ..SensorInput::default()
            };
            let clock = Instant::now();
            let estimate = estimator.estimate(&look);
            let seconds = clock.elapsed().as_secs_f64();
            if let Some(in_worse) = &mut in_worse {
                let points =
                    worsened_look(&k.points, s.worse, &at_rest(&drive, which), measured, &mut worse_draws);
                let _ = in_worse.estimate(&SensorInput { points: &points, ..look });
            }
            way_m += before.map_or(0.0, |b| b.distance(level.at_m));
            before = Some(level.at_m);
            let truth = pose(&level);
            let place = estimator.place().cloned();
            let found = place.as_ref().map(|p| compared(&truth, p));
            places.push(Located {
                run,
                time_s,
                way_m,
                truth,
                error: found.map(|f| f.0),
                nees: found.and_then(|f| f.1),
                place,
            });
            for (i, reader) in estimator.rows().iter().enumerate() {
                let picked = reader.picked().unwrap_or_default();
                let side = s.row[i].sides.map_or(0.0, |x| x.side_m);
                let worse = worsened(&picked.points, s.worse, side, &mut draws);
                let written = s.row[i].written();
                let of_looks = in_worse.as_ref().and_then(|e| e.rows()[i].picked());
                let of_looks = of_looks.unwrap_or_default().points;
                let all = [(Worse::No, picked.points.clone()), (Worse::Row, worse), (Worse::Looks, of_looks)];
                for (worse, points) in all {
                    let reading = reader.reader().read(std::slice::from_ref(&points)).ok();
                    let right = reading.as_ref().zip(written.as_ref()).map(|(r, w)| r.word == *w);
                    if let (Worse::No, Some(reading)) = (worse, reading.clone()) {
                        let (table, picked) = (s.row[i].clone(), picked.clone());
                        row_pictures[i] = Some(RowPicture { table, picked, reading });
                    }
                    let points = points.len();
                    words.push(WordRead { run, frame: f, row: i, worse, points, reading, right });
                }
            }
            let truth = ahead(drive.truth(time_s, [5.0, s.reach_m]));
            let scored = score(&estimate, &truth);
            let step = Step { run, frame: f, estimate, truth, score: scored, seconds };
            if run == 0 && f == drive.frames() / 2 {
                shown = Some((k.points.clone(), step.clone()));
            }
            steps.push(step);
            done += 1;
            (given.watch)(done, all);
        }
    }

    let Mapped { map, way: map_way, errors: map_errors, road, moving, .. } = mapped;
    let mut trial = Trial::new("signature", format!("{}: place in a map of static points", scenario.name));
    trial.rows = common_rows(&steps);
    trial.rows.extend(place_rows(&places));
    trial.rows.extend(map_rows(&map, &map_errors, &moving));
    trial.rows.extend(word_rows(s, &words));
    trial.sheets = sheets(s, &map, &places, &words);
    trial.pictures = pictures::all(&map, road.as_ref(), &map_way, &places, &row_pictures, shown.as_ref())?;
    trial.notes = notes(&steps, &row_pictures);
    trial.steps = steps;
    Ok(trial)
}

fn estimator_rest(drive: &Drive<'_>, which: usize, k: &Kept, [speed, yaw]: [Measured; 2]) -> Vec<bool> {
    at_rest(drive, which).standing(&k.points, speed, Some(yaw))
}

/// How well the test for motion takes moving points out.
#[derive(Debug, Clone, Copy, Default)]
struct Moving {
    moving: usize,
    moving_out: usize,
    standing: usize,
    standing_out: usize,
}

impl Moving {
    fn count(&mut self, k: &Kept, stands: &[bool]) {
        for (moves, stands) in k.moves.iter().zip(stands) {
            let (all, out) = match moves {
                true => (&mut self.moving, &mut self.moving_out),
                false => (&mut self.standing, &mut self.standing_out),
            };
            *all += 1;
            *out += usize::from(!stands);
        }
    }
}

/// Distances of landmarks from the nearest marker, of those within half a metre, m.
fn map_errors(map: &SignatureMap, road: Option<&RoadTruth>) -> Vec<f64> {
    let markers: Vec<DVec2> = road
        .iter()
        .flat_map(|r| &r.marker_rows)
        .flat_map(|r| &r.markers)
        .map(|m| DVec2::new(m.position_m[0], m.position_m[1]))
        .collect();
    map.landmarks()
        .iter()
        .filter_map(|l| {
            let at = DVec2::from_array(l.position_m);
            markers.iter().map(|m| m.distance(at)).min_by(f64::total_cmp).filter(|d| *d < 0.5)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_worse_look_lacks_points_and_has_others_that_stand() {
        let rest = StaticTest { radar_m: [3.6, 0.0], ..StaticTest::default() };
        let own = [Measured { value: 12.0, std: 0.05 }, Measured { value: 0.1, std: 0.003 }];
        let mut draws = Draws::new(4, 1);
        let points: Vec<LanePoint> = (0..4000)
            .map(|_| {
                let seen = DVec2::new(5.0 + 30.0 * draws.uniform(), 3.5 * draws.uniform() - 1.75);
                let velocity = DVec2::new(12.0, 0.1 * 3.6);
                LanePoint {
                    at_m: (seen + DVec2::new(3.6, 0.0)).to_array(),
                    std_m: [0.1, 0.2],
                    range_rate_mps: -velocity.dot(seen.normalize()),
                    range_rate_std_mps: 0.03,
                    range_m: seen.length(),
                    azimuth_rad: seen.to_angle(),
                    rcs_dbsm: -20.0,
                    snr_db: 20.0,
                }
            })
            .collect();
        let worse = worsened_look(&points, 0.1, &rest, own, &mut draws);
        let kept = worse.iter().filter(|p| points.contains(p)).count();
        // Four standard deviations of a share of 4000.
        assert!((3524..3676).contains(&kept), "{kept}");
        assert!((324..476).contains(&(worse.len() - kept)), "{}", worse.len());
        assert!(rest.standing(&worse, own[0], Some(own[1])).iter().all(|s| *s));
        assert_eq!(worsened_look(&points, 0.0, &rest, own, &mut draws), points);
    }
}
