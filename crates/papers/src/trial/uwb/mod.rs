//! `catseye lane uwb`: the lane detection with an impulse radar (document K) through the whole chain.
//!
//! A slow drive over the bare road gives the threshold and the mean scan; a slow drive past the plates gives the histogram; the
//! runs give passes, spacings, lane and warnings. All of it is told for the document's own rule (scans as they are, the greatest scan
//! of a pass is its centre) and for the settings' rule.

mod drives;
mod figures;
mod rival;
mod settings;

pub(super) use rival::rival;
pub use settings::{Asphalt, CentreOf, Settings, StandsFor};

use crate::trial::{Drive, Given, SpeedSensor, Step, Trial};
use catseye::error::{BadInput, Error, Result};
use catseye::scene::scenario::Scenario;
use catseye_lane::score::{TrueLanes, score};
use catseye_lane::uwb::{Background, OffsetSource, Threshold, Uwb, UwbConfig, UwbLanes, UwbOptions};
use catseye_lane::{LaneError, LaneEstimator, SensorInput, uwb};
use drives::{Eye, Passed, Progress, Scans, Scenery};
use std::time::Instant;

/// How scans become passes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Rule {
    /// In the report.
    name: &'static str,
    take_background: bool,
    centre: CentreOf,
}

/// One eye under one rule.
struct Tuned {
    options: UwbOptions,
    threshold: Threshold,
    /// Energies of the bare road.
    bare: Vec<f64>,
}

/// One run as one eye sees it under one rule.
struct Seen {
    energies: Vec<f64>,
    result: uwb::LaneEstimate,
    score: uwb::RunScore,
    /// Departure warnings where no marker of the own line was due, and where one was.
    warnings_right: usize,
    warnings_wrong: usize,
    /// By counted markers, and by the speed alone: error at the last scan, m.
    odometer_m: Option<[f64; 2]>,
}

/// One run.
struct Run {
    times_s: Vec<f64>,
    /// By eye.
    passes: Vec<Vec<Passed>>,
    beside: Vec<Vec<Option<f64>>>,
    covers: Vec<Vec<f64>>,
    /// `[rule][eye]`.
    seen: Vec<Vec<Seen>>,
    scans: Scans,
}

/// The slow drive past the plates.
struct Slow {
    beside: Vec<Vec<Option<f64>>>,
    scans: Scans,
}

/// All that figures are made from.
struct Made<'a> {
    settings: &'a Settings,
    eyes: Vec<Eye>,
    rules: Vec<Rule>,
    /// `[rule][eye]`.
    tuned: Vec<Vec<Tuned>>,
    quiet: Scans,
    slow: Vec<Slow>,
    runs: Vec<Run>,
    /// Lateral distance and scan of the first eye.
    sweep: Vec<(f64, Vec<f32>)>,
}

fn failed(what: &str, reason: LaneError) -> Error {
    Error::Failed(format!("{what}: {reason}"))
}

fn wide(scan: &[f32]) -> Vec<f64> {
    scan.iter().map(|v| f64::from(*v)).collect()
}

fn energy(options: &UwbOptions, scan: &[f32]) -> Result<uwb::GateEcho> {
    options.echo(&wide(scan)).map_err(|why: LaneError| Error::Failed(format!("a scan's energy: {why}")))
}

/// Drives the scenario and the slow drives that belong to it.
///
/// Errors: a scenario without an impulse radar, a road, or a vehicle on it; samples that do not cover the gate; speeds at which
/// two scans are farther apart than a plate is long.
pub fn run(given: &Given<'_>, settings: &Settings) -> Result<Trial> {
    settings.check()?;
    let eyes = drives::eyes(given.scenario, settings)?;
    drives::check_road(given.scenario)?;
    check_speed(given.scenario, settings)?;
    let rules = rules(settings);
    let sweep_m: Vec<f64> = match settings.offset_sweep {
        true => (0..=64).map(|i| 0.025 * f64::from(i)).collect(),
        false => Vec::new(),
    };
    let frames = u64::from(given.scenario.frames.count) * u64::from(given.runs);
    let progress = Progress::new(given, drives::slow_frames(settings) + frames + sweep_m.len() as u64);

    let quiet = drives::quiet(given, &progress, settings, &eyes, Scenery::All)?;
    let tuned: Vec<Vec<Tuned>> = rules
        .iter()
        .map(|rule| eyes.iter().enumerate().map(|(i, eye)| tune(settings, rule, eye, i, &quiet)).collect())
        .collect::<Result<_>>()?;
    let slow = drives::histogram(given, &progress, settings, &eyes)?
        .into_iter()
        .map(|(site, scans)| {
            let drive = Drive::new(&site, given.engine)?;
            let beside = eyes.iter().map(|e| drives::markers_of(&drive, e, settings).1).collect();
            Ok(Slow { beside, scans })
        })
        .collect::<Result<_>>()?;
    let mut steps = Vec::new();
    let mut runs = Vec::new();
    for k in 0..given.runs {
        runs.push(one_run(given, &progress, settings, &eyes, &tuned, k, &mut steps)?);
    }
    let sweep = match runs.iter().any(|r| !r.passes[0].is_empty()) {
        true => drives::sweep(given, &progress, settings, &eyes[0], &sweep_m)?,
        false => Vec::new(),
    };
    let made = Made { settings, eyes, rules, tuned, quiet, slow, runs, sweep };
    let mut trial = Trial::new(uwb::estimator::METHOD, format!("uwb: {}", given.scenario.name));
    figures::fill(&mut trial, &made, steps)?;
    Ok(trial)
}

/// The settings' rule comes last: it is that of the steps.
fn rules(settings: &Settings) -> Vec<Rule> {
    let document = Rule { name: "document's rule", take_background: false, centre: CentreOf::Maximum };
    let ours =
        Rule { name: "settings' rule", take_background: settings.take_background, centre: settings.centre };
    match (ours.take_background, ours.centre) == (document.take_background, document.centre) {
        true => vec![document],
        false => vec![document, ours],
    }
}

fn check_speed(scenario: &Scenario, settings: &Settings) -> Result<()> {
    let interval_s = scenario.frames.interval_s;
    let own = scenario.ego.on_road.iter().flat_map(|on| on.drive.speed.iter().map(|p| p[1]));
    let ranges = settings.speed_range_kmh.iter().map(|r| r[1] / 3.6);
    let fastest = match settings.speed_range_kmh {
        Some(_) => ranges.fold(0.0, f64::max),
        None => own.fold(scenario.ego.speed_mps.abs(), |m, v| m.max(v.abs())),
    };
    let step_m = fastest.max(settings.quiet_speed_kmh / 3.6) * interval_s;
    if step_m.is_nan() || step_m >= settings.plate_length_m {
        return Err(BadInput::new("two scans are farther apart than a plate is long")
            .key("frames.interval_s")
            .value(format!("{interval_s} s at {fastest} m/s"))
            .allowed(format!("less than {} m from scan to scan", settings.plate_length_m))
            .remedy("more scans a second, or a slower drive")
            .into());
    }
    Ok(())
}

fn tune(settings: &Settings, rule: &Rule, eye: &Eye, i: usize, quiet: &Scans) -> Result<Tuned> {
    let scans: Vec<Vec<f64>> = quiet.iter().map(|s| wide(&s[i])).collect();
    let background = match rule.take_background {
        true => Some(Background::of(scans.iter().map(Vec::as_slice)).map_err(|r| failed("background", r))?),
        false => None,
    };
    // For the energies alone, until the threshold is known.
    let floor = Threshold::maximum(&[0.0, 1.0]).map_err(|r| failed("threshold", r))?;
    let config = |t: &Threshold| {
        UwbConfig::new(settings.spacing_m, settings.plate_length_m, t).map(|c| UwbConfig {
            max_spacing_error_m: settings.largest_error_m(),
            least_distance_m: c.least_distance_m.min(settings.spacing_m - settings.largest_error_m()),
            centre: rule.centre.core(),
            confirm_spacings: settings.confirm_spacings as usize,
            misses_to_warn: settings.misses_to_warn as usize,
            // With the mirror reflection in the scan the strongest echo is always that.
            offset: match rule.take_background {
                true => OffsetSource::Range { height_m: eye.height_m },
                false => OffsetSource::None,
            },
            ..c
        })
    };
    let mut options = UwbOptions {
        axis: eye.axis,
        gate: eye.gate,
        background,
        config: config(&floor).map_err(|r| failed("lane.uwb", r))?,
        side: eye.side,
        at_m: eye.at_m,
        offset_std_m: settings.offset_std_m,
        lane_width_m: Some(settings.lane_width_m),
    };
    let bare: Vec<f64> =
        quiet.iter().map(|s| energy(&options, &s[i]).map(|e| e.energy)).collect::<Result<_>>()?;
    let threshold = match settings.false_alarm_probability {
        None => Threshold::maximum(&bare),
        Some(p) => Threshold::extreme_value(&bare, p),
    };
    let threshold = threshold.map_err(|r| failed("threshold", r))?;
    options.config = config(&threshold).map_err(|r| failed("lane.uwb", r))?;
    Ok(Tuned { options, threshold, bare })
}

/// The estimator of the steps.
enum Estimator {
    One(Box<UwbLanes>),
    Two(Box<UwbLanes>),
}

impl Estimator {
    fn new(tuned: &[Tuned]) -> Result<Estimator> {
        let wrong = |r| failed("lane.uwb", r);
        Ok(match tuned {
            [one] => Estimator::One(Box::new(UwbLanes::new(one.options.clone()).map_err(wrong)?)),
            [left, right, ..] => {
                let pair = UwbLanes::pair(left.options.clone(), right.options.clone()).map_err(wrong)?;
                Estimator::Two(Box::new(pair))
            }
            [] => return Err(Error::Failed("no impulse radar".into())),
        })
    }

    fn get(&mut self) -> &mut dyn LaneEstimator {
        match self {
            Estimator::One(e) => e.as_mut(),
            Estimator::Two(e) => e.as_mut(),
        }
    }
}

fn one_run(
    given: &Given<'_>,
    progress: &Progress<'_>,
    settings: &Settings,
    eyes: &[Eye],
    tuned: &[Vec<Tuned>],
    number: u32,
    steps: &mut Vec<Step>,
) -> Result<Run> {
    let scenario = drives::scenario_of_run(given, settings, number);
    let site = drives::site(&scenario, settings)?;
    let scans = drives::scans(given, progress, &format!("run{number}"), &site, eyes, Scenery::All)?;
    let drive = Drive::new(&site, given.engine)?;
    let times_s: Vec<f64> = (0..drive.frames()).map(|i| drive.time_s(i)).collect();
    let true_mps: Vec<f64> = times_s.iter().map(|t| drive.level(*t).speed_mps).collect();
    if let Some(v) = true_mps.iter().find(|v| **v < 0.0) {
        return Err(BadInput::new("the method counts plates of a vehicle that goes forward")
            .key("ego.drive.speed_mps")
            .value(v)
            .allowed("0 m/s and more")
            .into());
    }
    let mut sensor = SpeedSensor::new(scenario.seed, settings.speed_std_mps, settings.speed_step_kmh / 3.6);
    let speeds: Vec<catseye_lane::Measured> = true_mps
        .iter()
        .map(|v| sensor.read(*v))
        .map(|m| catseye_lane::Measured { value: m.value.max(0.0), ..m })
        .collect();

    let last = &tuned[tuned.len() - 1];
    let mut estimator = Estimator::new(last)?;
    let reach_m = eyes.iter().map(Eye::reach_m).fold(0.0, f64::max);
    for (i, scan) in scans.iter().enumerate() {
        let pulse: Vec<f64> = scan.iter().flat_map(|s| wide(s)).collect();
        let look = SensorInput {
            time_s: times_s[i],
            speed_mps: Some(speeds[i]),
            pulse: Some(&pulse),
            ..SensorInput::default()
        };
        let clock = Instant::now();
        let estimate = estimator.get().estimate(&look);
        let seconds = clock.elapsed().as_secs_f64();
        let truth = truth_at(&drive, times_s[i], eyes, reach_m, settings);
        let score = score(&estimate, &truth);
        steps.push(Step { run: number, frame: i as u32, estimate, truth, score, seconds });
    }

    let of: Vec<_> = eyes.iter().map(|e| drives::markers_of(&drive, e, settings)).collect();
    let (passes, beside): (Vec<_>, Vec<_>) = of.into_iter().unzip();
    let covers = eyes.iter().map(|e| drives::covers_of(&drive, e)).collect();
    let way_m = ways(&times_s, &true_mps);
    let seen = tuned
        .iter()
        .map(|eyes_tuned| {
            let each = eyes_tuned.iter().enumerate();
            each.map(|(k, t)| {
                let echoes: Vec<uwb::GateEcho> =
                    scans.iter().map(|s| energy(&t.options, &s[k])).collect::<Result<_>>()?;
                see(settings, t, &echoes, &times_s, &speeds, &passes[k], &way_m)
            })
            .collect()
        })
        .collect::<Result<_>>()?;
    Ok(Run { times_s, passes, beside, covers, seen, scans })
}

/// Of the rows of markers that pass within reach beside the vehicle.
fn truth_at(drive: &Drive<'_>, time_s: f64, eyes: &[Eye], reach_m: f64, settings: &Settings) -> TrueLanes {
    let mut truth = drive.truth_of_rows(time_s, [0.0, settings.spacing_m]);
    let beside = |line: &[[f64; 2]]| {
        let near = line.iter().filter(|p| p[0].abs() < 2.0 * settings.spacing_m);
        near.map(|p| p[1]).min_by(|a, b| a.abs().total_cmp(&b.abs()))
    };
    let seen = |line: &[[f64; 2]]| {
        beside(line).is_some_and(|y| eyes.iter().any(|e| (y - e.at_m[1]).abs() <= reach_m))
    };
    let own = truth.own.map(|i| i.filter(|i| truth.lines.get(*i).is_some_and(|l| seen(l))));
    let lines: Vec<_> = own.iter().flatten().map(|i| truth.lines[*i].clone()).collect();
    // The right one comes first.
    truth.own = match own {
        [Some(_), Some(_)] => [Some(0), Some(1)],
        [Some(_), None] => [Some(0), None],
        [None, Some(_)] => [None, Some(0)],
        [None, None] => [None, None],
    };
    truth.lines = lines;
    truth
}

/// Way at each time, by the trapezoid rule of the true speeds.
fn ways(times_s: &[f64], speeds_mps: &[f64]) -> Vec<f64> {
    let mut way = 0.0;
    let mut all = vec![0.0];
    for i in 1..times_s.len() {
        way += 0.5 * (speeds_mps[i - 1] + speeds_mps[i]) * (times_s[i] - times_s[i - 1]);
        all.push(way);
    }
    all
}

fn at_time(times_s: &[f64], values: &[f64], time_s: f64) -> f64 {
    let i = times_s.partition_point(|t| *t <= time_s);
    match (i.checked_sub(1), i < times_s.len()) {
        (Some(a), true) => {
            let share = (time_s - times_s[a]) / (times_s[i] - times_s[a]);
            values[a] + share * (values[i] - values[a])
        }
        (Some(a), false) => values[a],
        (None, _) => values.first().copied().unwrap_or(0.0),
    }
}

fn see(
    settings: &Settings,
    tuned: &Tuned,
    echoes: &[uwb::GateEcho],
    times_s: &[f64],
    speeds: &[catseye_lane::Measured],
    passes: &[Passed],
    way_m: &[f64],
) -> Result<Seen> {
    let energies: Vec<f64> = echoes.iter().map(|e| e.energy).collect();
    let ranges: Vec<f64> = echoes.iter().map(|e| e.strongest_range_m.unwrap_or(f64::NAN)).collect();
    let values: Vec<f64> = speeds.iter().map(|m| m.value).collect();
    let config = tuned.options.config.clone();
    let result =
        Uwb::estimate(config, &energies, &ranges, times_s, &values).map_err(|r| failed("passes", r))?;
    let whole_m = way_m.last().copied().unwrap_or(0.0);
    let duration_s = times_s.last().copied().unwrap_or(0.0) - times_s.first().copied().unwrap_or(0.0);
    let mean_mps = if duration_s > 0.0 { whole_m / duration_s } else { 0.0 };
    // Half the gap between two plates' middles.
    let match_s = if mean_mps > 0.0 { 0.5 * settings.spacing_m / mean_mps } else { 1.0 };
    // Passes that began before the first scan or end behind the last are not whole.
    let half_s = 0.5 * settings.plate_length_m / mean_mps.max(1e-3);
    let hold_s = tuned.options.config.hold_m / mean_mps.max(1e-3);
    let span = times_s.first().zip(times_s.last());
    let whole = |t: f64| span.is_some_and(|(a, b)| t - half_s > *a && t + half_s + 2.0 * hold_s < *b);
    let within_m = settings.lane_width_m - settings.car_width_m;
    let own: Vec<f64> = passes
        .iter()
        .filter(|p| whole(p.time_s) && p.lateral_m.abs() <= within_m)
        .map(|p| p.time_s)
        .collect();
    let score = uwb::score_run(&result, &own, match_s, settings.spacing_m, settings.largest_error_m())
        .map_err(|r| failed("score", r))?;
    let (mut right, mut wrong) = (0, 0);
    for (event, d) in result.departures() {
        let due_s = event.time_s - d.delay_m / mean_mps.max(1e-3);
        let there = |p: &Passed| (p.time_s - due_s).abs() < match_s && p.lateral_m.abs() <= within_m;
        match passes.iter().any(there) {
            true => wrong += 1,
            false => right += 1,
        }
    }
    let odometer_m = result.odometer.and_then(|o| {
        let start_m = result.distance_m.last()? - o.speed_distance_m;
        let first = result.markers.iter().find(|m| (m.pass.distance_m - start_m).abs() < 1e-6)?.pass;
        let gap = |p: &&Passed| (p.time_s - first.time_s).abs();
        let start = passes.iter().min_by(|a, b| gap(a).total_cmp(&gap(b)))?;
        let true_m = whole_m - at_time(times_s, way_m, start.time_s);
        Some([o.distance_m - true_m, o.speed_distance_m - true_m])
    });
    Ok(Seen { energies, result, score, warnings_right: right, warnings_wrong: wrong, odometer_m })
}
