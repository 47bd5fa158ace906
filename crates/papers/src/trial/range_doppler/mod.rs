//! Place in a marked lane from the range-Doppler map alone (document F, section 3.6, Fig. 3.21 to 3.24), through the whole chain: the
//! scenario's own drive, or single looks at poses that are set ([`Case`]).

mod cases;
mod figures;
mod rival;

use super::drive::{suitable, true_lanes};
use super::report::{Sheet, common_rows};
use super::{Drive, Given, SpeedSensor, Step, Trial};
use catseye::detect::points::range_rate_mps;
use catseye::error::{BadInput, Result};
use catseye::road::site::Site;
use catseye::scene::radar::Radar;
use catseye::scene::scenario::Scenario;
use catseye::scene::waveform::Waveform;
use catseye::simulate::Frame;
use catseye_lane::range_doppler::{
    CurveStart, LaneFromMap, LaneLook, LaneSettings, Options, RangeDopplerLane,
};
use catseye_lane::score::{TrueLanes, score};
use catseye_lane::{LaneError, LanePoint, Measured, SensorInput};
use glam::DVec2;
pub(super) use rival::rival;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::time::Instant;

const METHOD: &str = "range-doppler";
/// What stands for a standard deviation that is not known: files of results hold no infinity.
const UNKNOWN_STD: f64 = 1e6;
/// Fewer rows of the map do not tell range rates apart.
const LEAST_ROWS: usize = 16;

/// The table `[lane.range_doppler]`: what the vehicle knows of the marked lane, what its sensors are worth, and the poses to look from.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// Between the two rows of markers, m. Default 2.8.
    pub row_distance_m: f64,
    /// Between markers of the left row, m. Default 1.5.
    pub left_spacing_m: f64,
    /// Of the right row, m; with the same as the left the side is not told. Default 2.
    pub right_spacing_m: f64,
    /// Nearest and farthest markers that are used, m. Default 1.5 and 40.
    pub near_m: f64,
    pub far_m: f64,
    /// Half the field of view, about the direction of motion, degrees. Default 70.
    pub half_view_deg: f64,
    /// Offsets, headings and radii that are searched: m, degrees, m. Default 1.5, 60, 5.
    pub max_offset_m: f64,
    pub max_heading_deg: f64,
    pub min_radius_m: f64,
    /// A bend begins within this distance, m. Default 30.
    pub bend_within_m: f64,
    /// Weaker points are taken for noise, dB. Default 6.
    pub min_snr_db: f64,
    /// What a marker's range and range rate are never more certain than, m and m/s. Default 0.05 and 0.02.
    pub least_range_std_m: f64,
    pub least_range_rate_std_mps: f64,
    /// Whether the vehicle's bus tells its speed; if not, the map does. Default true.
    pub bus_speed: bool,
    /// Noise of the bus's speed (m/s) and its step (m/s; 0: none). Default 0.05 and 0.
    pub bus_speed_std_mps: f64,
    pub bus_speed_step_mps: f64,
    /// Noise of its yaw rate, degrees per second. Default 0.1.
    pub bus_yaw_rate_std_deg_per_s: f64,
    /// Every so many looks of a drive the whole search range is gone through, in between what lies near the last look's. Default 20.
    pub search_every: u32,
    /// Most looks of which pictures are made. Default 12.
    pub pictures: u32,
    /// Lane width of the roads of `case`, m; their rows stand inside it, `row_distance_m` apart. Default 3.
    pub lane_width_m: f64,
    /// Markers of the roads of `case`, as `catseye rcs` takes a reflector.
    pub marker: String,
    /// Single looks in place of the scenario's drive, each on a road of its own.
    pub case: Vec<Case>,
}

/// A pose of the radar in the lane, and the lane.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Case {
    /// Of its pictures and rows: letters, digits, `_` and `-`; no two are the same.
    pub name: String,
    /// From the middle of the lane, m, positive left. Default 0.
    pub offset_m: f64,
    /// Of the motion against the lane, degrees, positive left. Default 0.
    pub heading_deg: f64,
    /// Of the bend ahead, m, positive left; 0 (default): straight on.
    pub radius_m: f64,
    /// From the radar to the bend, m. Default 10.
    pub bend_after_m: f64,
    /// Whether the right row has the spacing of the left one. Default false.
    pub equal: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            row_distance_m: 2.8,
            left_spacing_m: 1.5,
            right_spacing_m: 2.0,
            near_m: 1.5,
            far_m: 40.0,
            half_view_deg: 70.0,
            max_offset_m: 1.5,
            max_heading_deg: 60.0,
            min_radius_m: 5.0,
            bend_within_m: 30.0,
            min_snr_db: 6.0,
            least_range_std_m: 0.05,
            least_range_rate_std_mps: 0.02,
            bus_speed: true,
            bus_speed_std_mps: 0.05,
            bus_speed_step_mps: 0.0,
            bus_yaw_rate_std_deg_per_s: 0.1,
            search_every: 20,
            pictures: 12,
            lane_width_m: 3.0,
            marker: "type1:width_m=0.16,height_m=0.004,material=aluminium".into(),
            case: Vec::new(),
        }
    }
}

impl Default for Case {
    fn default() -> Self {
        Case {
            name: "case".into(),
            offset_m: 0.0,
            heading_deg: 0.0,
            radius_m: 0.0,
            bend_after_m: 10.0,
            equal: false,
        }
    }
}

impl Settings {
    /// Errors: a value outside its range, with the range.
    pub fn check(&self) -> Result<()> {
        let numbers = [
            ("row_distance_m", self.row_distance_m, 0.5, 10.0),
            ("left_spacing_m", self.left_spacing_m, 0.1, 50.0),
            ("right_spacing_m", self.right_spacing_m, 0.1, 50.0),
            ("near_m", self.near_m, 0.0, 100.0),
            ("far_m", self.far_m, self.near_m + 1.0, 300.0),
            ("half_view_deg", self.half_view_deg, 5.0, 180.0),
            ("max_offset_m", self.max_offset_m, 0.05, 10.0),
            ("max_heading_deg", self.max_heading_deg, 0.5, 90.0),
            ("min_radius_m", self.min_radius_m, 0.5 * self.row_distance_m + 0.1, 1e4),
            ("bend_within_m", self.bend_within_m, 0.0, 300.0),
            ("min_snr_db", self.min_snr_db, -50.0, 100.0),
            ("least_range_std_m", self.least_range_std_m, 1e-3, 5.0),
            ("least_range_rate_std_mps", self.least_range_rate_std_mps, 1e-3, 5.0),
            ("bus_speed_std_mps", self.bus_speed_std_mps, 1e-4, 10.0),
            ("bus_speed_step_mps", self.bus_speed_step_mps, 0.0, 10.0),
            ("bus_yaw_rate_std_deg_per_s", self.bus_yaw_rate_std_deg_per_s, 0.0, 90.0),
            ("search_every", f64::from(self.search_every), 1.0, 1e9),
            ("pictures", f64::from(self.pictures), 0.0, 1000.0),
        ];
        for (key, value, low, high) in numbers {
            in_range(&format!("lane.range_doppler.{key}"), value, low, high)?;
        }
        if !self.case.is_empty() {
            in_range("lane.range_doppler.lane_width_m", self.lane_width_m, self.row_distance_m, 20.0)?;
        }
        for (i, case) in self.case.iter().enumerate() {
            case.check(self, i)?;
            if self.case[..i].iter().any(|c| c.name == case.name) {
                return Err(BadInput::new("two cases have the same name")
                    .key(format!("lane.range_doppler.case[{i}].name"))
                    .value(&case.name)
                    .remedy("name each case, its files are called so")
                    .into());
            }
        }
        Ok(())
    }

    /// As the estimator takes them, for a radar.
    fn options(&self, radar: &Radar, equal: bool) -> Options {
        let at = radar.mounting.translation_m;
        Options {
            radar_at_m: [at.x, at.y],
            frame_time_s: radar.frame_time_s(),
            min_snr_db: self.min_snr_db,
            least_range_std_m: self.least_range_std_m,
            least_range_rate_std_mps: self.least_range_rate_std_mps,
            speed_from_map: true,
            search_every: self.search_every,
            lane: LaneSettings {
                lane_width_m: self.row_distance_m,
                left_spacing_m: self.left_spacing_m,
                right_spacing_m: if equal { self.left_spacing_m } else { self.right_spacing_m },
                curve_start: CurveStart::UpTo(self.bend_within_m),
                radar_height_m: at.z.max(0.0),
                max_offset_m: self.max_offset_m,
                max_heading_rad: self.max_heading_deg.to_radians(),
                min_radius_m: self.min_radius_m,
                near_m: self.near_m,
                far_m: self.far_m,
                half_view_rad: self.half_view_deg.to_radians(),
                ..LaneSettings::default()
            },
        }
    }

    /// Rows as curves, in front of the radar.
    fn lane_ahead(&self) -> LaneSettings {
        LaneSettings {
            lane_width_m: self.row_distance_m,
            near_m: 0.0,
            far_m: self.far_m,
            max_offset_m: self.max_offset_m,
            ..LaneSettings::default()
        }
    }

    fn estimator(&self, radar: &Radar, equal: bool) -> Result<RangeDopplerLane> {
        RangeDopplerLane::new(self.options(radar, equal)).map_err(|r: LaneError| {
            BadInput::new(r.to_string())
                .key("lane.range_doppler")
                .remedy("compare the table with its defaults")
                .into()
        })
    }
}

fn in_range(key: &str, value: f64, low: f64, high: f64) -> Result<()> {
    if value >= low && value <= high {
        return Ok(());
    }
    let bad = BadInput::new("is out of range").key(key).value(value).allowed(format!("{low}..={high}"));
    Err(bad.remedy("give a value in that range, or leave the key out for its default").into())
}

/// What a frame leaves for the estimator, and for pictures.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Seen {
    points: Vec<LanePoint>,
    map: Option<MapPicture>,
}

/// The strongest cell of each patch of the map, dBm.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct MapPicture {
    /// Edges.
    range_m: [f64; 2],
    range_rate_mps: [f64; 2],
    rows: usize,
    columns: usize,
    dbm: Vec<f32>,
}

/// What is true of the radar: offset and heading, speed, its markers.
type OfRadar = (Option<[f64; 2]>, f64, Vec<([f64; 2], bool)>);

/// One look with all that rows and pictures need.
struct Made {
    step: Step,
    look: LaneLook,
    /// Of the radar: its offset from the middle of the lane and the heading of its motion, as true.
    radar: Option<[f64; 2]>,
    /// Of the radar over ground, as true.
    speed_mps: f64,
    /// Range, range rate, and whether it stands behind the radar, of each true marker in reach.
    markers: Vec<([f64; 2], bool)>,
    seen: Seen,
    case: Option<usize>,
}

/// One radar's looks at one site.
struct Looker<'a> {
    drive: Drive<'a>,
    which: usize,
    settings: &'a Settings,
    estimator: RangeDopplerLane,
    speed: SpeedSensor,
    yaw: SpeedSensor,
}

impl<'a> Looker<'a> {
    fn new(
        site: &'a Site,
        given: &Given<'a>,
        which: usize,
        settings: &'a Settings,
        equal: bool,
    ) -> Result<Looker<'a>> {
        let seed = site.scenario.seed;
        let yaw_std = settings.bus_yaw_rate_std_deg_per_s.to_radians();
        Ok(Looker {
            drive: Drive::new(site, given.engine)?,
            which,
            settings,
            estimator: settings.estimator(&site.scenario.radars[which], equal)?,
            speed: SpeedSensor::new(seed, settings.bus_speed_std_mps, settings.bus_speed_step_mps),
            yaw: SpeedSensor::new(seed.wrapping_add(0x9e37_79b9), yaw_std, 0.0),
        })
    }

    /// Simulates frame `index` (or takes what is kept under `key`), lets the estimator look, and compares.
    fn look(&mut self, given: &Given<'_>, key: &str, index: u32, run: u32, picture: bool) -> Result<Made> {
        let radar = self.drive.radar(self.which);
        let time_s = self.drive.time_s(index);
        let level = self.drive.level(time_s);
        let seen: Seen = given.kept(key, || {
            let frame = self.drive.frame(self.which, index)?;
            let map =
                picture.then(|| map_picture(radar, &frame, self.settings.far_m, level.speed_mps)).flatten();
            Ok(Seen { points: points_of(radar, &frame), map })
        })?;
        let bus = Some(self.speed.read(level.speed_mps));
        let look = SensorInput {
            time_s,
            speed_mps: bus.filter(|_| self.settings.bus_speed),
            yaw_rate_rad_per_s: Some(self.yaw.read(level.yaw_rate_rad_per_s))
                .map(|m| Measured { std: m.std.max(1e-6), ..m }),
            points: &seen.points,
            ..SensorInput::default()
        };
        let clock = Instant::now();
        let answer = self.estimator.look(&look);
        let seconds = clock.elapsed().as_secs_f64();
        let mut truth = self.drive.truth_of_rows(time_s, [self.settings.near_m, self.settings.far_m]);
        // What lies behind is not to be found by a radar that looks ahead.
        for line in &mut truth.lines {
            line.retain(|p| p[0] > 0.0);
        }
        let score = score(&answer.estimate, &truth);
        let (radar, speed_mps, markers) = self.of_radar(time_s, &truth);
        let step = Step { run, frame: index, estimate: answer.estimate.clone(), truth, score, seconds };
        Ok(Made { step, look: answer, radar, speed_mps, markers, seen, case: None })
    }

    /// What is true of the radar rather than of the vehicle's reference point.
    fn of_radar(&self, time_s: f64, truth: &TrueLanes) -> OfRadar {
        let level = self.drive.level(time_s);
        let mounting = self.drive.radar(self.which).mounting.translation_m;
        let lever = mounting.truncate();
        // As a body turns, the radar's motion points another way than the vehicle.
        let motion = DVec2::new(
            level.speed_mps - level.yaw_rate_rad_per_s * lever.y,
            level.yaw_rate_rad_per_s * lever.x,
        );
        let speed = motion.length();
        let along = motion.normalize_or(DVec2::X);
        let there = super::drive::Level {
            at_m: level.to_world(lever),
            heading_rad: level.heading_rad + along.to_angle(),
            ..level
        };
        let lane = self.drive.site.road.as_ref().map(|r| true_lanes(r, &there, truth.range_m));
        let place = lane.and_then(|l| Some([l.offset_m?, l.heading_rad?]));
        let markers = self.drive.rows(time_s).into_iter().flat_map(|(_, row)| row).filter_map(|m| {
            let d = DVec2::from_array(m) - lever;
            let range = d.extend(mounting.z).length();
            let ahead = d.dot(along) / range.max(1e-9);
            (range <= self.settings.far_m).then_some(([range, -speed * ahead], ahead < 0.0))
        });
        (place, speed, markers.collect())
    }
}

/// Points with range and range rate, whether or not they have an angle.
fn points_of(radar: &Radar, frame: &Frame) -> Vec<LanePoint> {
    let finite = |v: f64, or: f64| if v.is_finite() { v } else { or };
    let point = |p: &catseye::detect::points::Point| {
        let at = radar.mounting.point(p.position_m);
        let from = at - radar.mounting.translation_m;
        let across = p.std.azimuth_rad.map_or(UNKNOWN_STD, |s| finite(s * p.range_m, UNKNOWN_STD));
        LanePoint {
            at_m: [finite(at.x, 0.0), finite(at.y, 0.0)],
            std_m: [finite(p.std.range_m, UNKNOWN_STD), across],
            range_rate_mps: p.range_rate_mps,
            range_rate_std_mps: finite(p.std.range_rate_mps, UNKNOWN_STD),
            range_m: p.range_m,
            azimuth_rad: from.y.atan2(from.x),
            rcs_dbsm: finite(p.rcs_dbsm, -300.0),
            snr_db: finite(p.snr_db, 200.0),
        }
    };
    let is_number =
        |p: &&catseye::detect::points::Point| p.range_m.is_finite() && p.range_rate_mps.is_finite();
    frame.points.iter().filter(is_number).map(point).collect()
}

/// The part of the map that closing markers within `far_m` fill; None where the map is empty.
fn map_picture(radar: &Radar, frame: &Frame, far_m: f64, speed_mps: f64) -> Option<MapPicture> {
    const MOST: usize = 360;
    let map = &frame.maps.first()?.map;
    let (rows, columns) = (map.doppler_bins, map.range_bins);
    let last =
        (((far_m - radar.first_range_m()) / radar.range_bin_m()).ceil().max(1.0) as usize).min(columns);
    let rate = |row: usize| range_rate_mps(radar, row as f64);
    let wanted = (-1.15 * speed_mps.abs() - 0.5)..=0.5;
    let first = (0..rows).find(|r| wanted.contains(&rate(*r)))?;
    let end = (first..rows).take_while(|r| wanted.contains(&rate(*r))).count() + first;
    if end - first < 2 || last < 2 {
        return None;
    }
    let (by_row, by_column) = ((end - first).div_ceil(MOST), last.div_ceil(MOST));
    let (tall, wide) = ((end - first).div_ceil(by_row), last.div_ceil(by_column));
    let mut dbm = Vec::with_capacity(tall * wide);
    for i in 0..tall {
        for j in 0..wide {
            let mut most = 0.0f64;
            for r in (first + i * by_row)..(first + (i + 1) * by_row).min(end) {
                for c in (j * by_column)..((j + 1) * by_column).min(last) {
                    most = most.max(map.data[r * columns + c]);
                }
            }
            dbm.push((10.0 * (most.max(1e-30) * 1e3).log10()) as f32);
        }
    }
    let (bin, step) = (radar.range_bin_m(), radar.velocity_bin_mps());
    let from = radar.first_range_m() - 0.5 * bin;
    let low = rate(first) - 0.5 * step;
    Some(MapPicture {
        range_m: [from, from + bin * (wide * by_column) as f64],
        range_rate_mps: [low, low + step * (tall * by_row) as f64],
        rows: tall,
        columns: wide,
        dbm,
    })
}

/// The first radar that tells ranges and range rates. Errors: there is none.
fn radar_of(scenario: &Scenario) -> Result<usize> {
    let found = suitable(&scenario.radars, |w| matches!(w, Waveform::Fmcw(_)))
        .filter(|i| scenario.radars[*i].doppler_rows() >= LEAST_ROWS);
    found.ok_or_else(|| {
        BadInput::new("the scenario has no radar whose map tells range rates")
            .key("radar")
            .allowed(format!("an FMCW radar with {LEAST_ROWS} or more rows of Doppler"))
            .remedy("take radar = \"feng77\"")
            .into()
    })
}

/// Drives the scenario, or looks from each [`Case`], and reports.
///
/// Errors: those of the scenario's files and of the chain; no suitable radar; settings outside their ranges.
pub fn run(given: &Given<'_>, settings: &Settings) -> Result<Trial> {
    settings.check()?;
    let which = radar_of(given.scenario)?;
    let mut trial = Trial::new(METHOD, format!("{}: lane from the range-Doppler map", given.scenario.name));
    let made = match settings.case.is_empty() {
        true => drives(given, settings, which)?,
        false => cases::looks(given, settings, which)?,
    };
    report(&mut trial, settings, made)?;
    Ok(trial)
}

/// The scenario's own drive, all runs.
fn drives(given: &Given<'_>, settings: &Settings, which: usize) -> Result<Vec<Made>> {
    let equal = settings.left_spacing_m == settings.right_spacing_m;
    let frames = given.scenario.frames.count;
    let all = u64::from(given.runs) * u64::from(frames);
    let mut out = Vec::new();
    // Pictures of looks spread over the first drive.
    let every = frames.div_ceil(settings.pictures.clamp(1, 4));
    for run in 0..given.runs {
        let site = Site::new(&given.scenario_of(run))?;
        let mut looker = Looker::new(&site, given, which, settings, equal)?;
        for index in 0..frames {
            let picture = run == 0 && settings.pictures > 0 && index % every == 0;
            let key = format!("run{run}_frame{index}");
            out.push(looker.look(given, &key, index, run, picture)?);
            (given.watch)(u64::from(run) * u64::from(frames) + u64::from(index) + 1, all);
        }
    }
    Ok(out)
}

/// Differences from the truth of the radar: offset (m), heading (rad). Of a lane whose sign is open, the nearer of the two readings.
fn errors(m: &Made) -> Option<[f64; 2]> {
    let (lane, [offset, heading]) = (m.look.lane.as_ref()?, m.radar?);
    let of = |sign: f64| [sign * lane.offset_m.value - offset, sign * lane.heading_rad.value - heading];
    let (same, other) = (of(1.0), of(-1.0));
    let size =
        |e: [f64; 2]| (e[0] / lane.offset_m.std.max(1e-6)).hypot(e[1] / lane.heading_rad.std.max(1e-6));
    Some(if m.look.mirror && size(other) < size(same) { other } else { same })
}

fn report(trial: &mut Trial, settings: &Settings, made: Vec<Made>) -> Result<()> {
    let rms = |of: &dyn Fn(&Made) -> Option<f64>| -> Vec<f64> {
        let mut runs: Vec<u32> = made.iter().map(|m| m.step.run).collect();
        runs.dedup();
        runs.iter()
            .filter_map(|r| {
                let v: Vec<f64> = made.iter().filter(|m| m.step.run == *r).filter_map(of).collect();
                (!v.is_empty()).then(|| (v.iter().map(|x| x * x).sum::<f64>() / v.len() as f64).sqrt())
            })
            .collect()
    };
    let share = |of: &dyn Fn(&Made) -> Option<bool>| -> Vec<f64> {
        rms(&|m| of(m).map(|b| if b { 1.0 } else { 0.0 })).iter().map(|x| 100.0 * x * x).collect()
    };
    let row = super::Row::mean;
    trial.rows = common_rows(&made.iter().map(|m| m.step.clone()).collect::<Vec<_>>());
    let truth = "of the radar; where the sign is open, of the nearer reading";
    trial.rows.push(row("offset of the radar, error (rms)", "m", &rms(&|m| Some(errors(m)?[0]))).why(truth));
    let heading = rms(&|m| Some(errors(m)?[1].to_degrees()));
    trial.rows.push(row("heading of its motion, error (rms)", "deg", &heading).why(truth));
    let chi = |m: &Made| {
        let (e, l) = (errors(m)?, m.look.lane.as_ref()?);
        Some((0.5 * ((e[0] / l.offset_m.std).powi(2) + (e[1] / l.heading_rad.std).powi(2))).sqrt())
    };
    let why = "over their own standard deviations; 1 where these are right";
    trial.rows.push(row("errors of offset and heading (rms)", "std", &rms(&chi)).why(why));
    let open = share(&|m| m.look.lane.as_ref().map(|_| m.look.mirror));
    let why = "the mirrored lane fits as well; with equal spacings always";
    trial.rows.push(row("looks whose sign is open", "%", &open).why(why));
    // An offset or heading that is nothing has no sign.
    let right = |m: &Made| {
        let (l, [offset, heading]) = (m.look.lane.as_ref().filter(|_| !m.look.mirror)?, m.radar?);
        let sure = |v: f64, std: f64| v.abs() > 3.0 * std;
        match (sure(offset, l.offset_m.std), sure(heading, l.heading_rad.std)) {
            (true, _) => Some(offset * l.offset_m.value > 0.0),
            (_, true) => Some(heading * l.heading_rad.value > 0.0),
            _ => None,
        }
    };
    let why = "of looks whose sign is told, with an offset or heading beyond three standard deviations";
    trial.rows.push(row("sign right", "%", &share(&right)).why(why));
    let speed = rms(&|m| Some(m.look.lane.as_ref()?.speed_mps.value - m.speed_mps));
    trial.rows.push(row("speed of the radar, error (rms)", "m/s", &speed));
    if !settings.case.is_empty() {
        cases::rows(trial, settings, &made);
    }
    trial.sheets.push(looks_sheet(settings, &made));
    figures::draw(trial, settings, &made)?;
    trial.notes.push(
        "Only range and range rate of the points are used. The radar's points are those of the detector; azimuths are not read."
            .into(),
    );
    trial.steps = made.into_iter().map(|m| m.step).collect();
    Ok(())
}

fn looks_sheet(settings: &Settings, made: &[Made]) -> Sheet {
    let mut sheet = Sheet::new(
        "looks",
        &[
            "run",
            "look",
            "case",
            "true_offset_m",
            "offset_m",
            "offset_std_m",
            "true_heading_deg",
            "heading_deg",
            "heading_std_deg",
            "curvature_per_m",
            "curvature_std_per_m",
            "bend_after_m",
            "speed_mps",
            "mirror",
            "sign_log_odds",
            "cells_explained",
            "searched",
        ],
    );
    sheet
        .comments
        .push("Offset and heading are those of the radar and of its motion against the lane.".into());
    let text = |v: Option<f64>| v.filter(|v| v.is_finite()).map_or_else(String::new, |v| format!("{v:.5}"));
    for m in made {
        let lane = m.look.lane.as_ref();
        let of = |f: &dyn Fn(&LaneFromMap) -> f64| text(lane.map(f));
        let case = m.case.map_or_else(String::new, |c| settings.case[c].name.clone());
        sheet.row(&[
            &m.step.run,
            &m.step.frame,
            &case,
            &text(m.radar.map(|r| r[0])),
            &of(&|l| l.offset_m.value),
            &of(&|l| l.offset_m.std),
            &text(m.radar.map(|r| r[1].to_degrees())),
            &of(&|l| l.heading_rad.value.to_degrees()),
            &of(&|l| l.heading_rad.std.to_degrees()),
            &of(&|l| l.curvature_per_m.value),
            &of(&|l| l.curvature_per_m.std),
            &text(lane.filter(|l| l.curve_start_m.observed).map(|l| l.curve_start_m.value)),
            &of(&|l| l.speed_mps.value),
            &u8::from(m.look.mirror),
            &of(&|l| l.sign_log_odds),
            &of(&|l| l.explained),
            &u8::from(m.look.searched),
        ]);
    }
    sheet
}
