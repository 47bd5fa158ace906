//! `catseye lane uwb`: the lane detection with an impulse radar (Kim 2020) through the whole chain.
//!
//! A slow drive over the bare road gives the threshold and the mean scan; a slow drive past the plates gives
//! the histogram; the runs give passes, spacings, lane and warnings. All of it is reported for the document's
//! own rule (scans as they are, a pass centred on its strongest scan) and for the settings' rule.

mod drives;
mod figures;
mod pictures;
mod runs;
mod settings;
mod tuning;

use crate::trial::kit::*;
use crate::trial::ready::SPEED_STD_MPS;
use crate::trial::uwb::drives::{Drives, ImpulseRadar, Passed, Scans, Scenery, covers_of, markers_of};
use crate::trial::uwb::runs::{Run, RunResult, Slow, UwbResults};
use crate::trial::uwb::tuning::{Tuned, energy, estimator, failed, rules, tune_all, wide};
use catseye::scene::scenario::Frames;
use catseye_lane::PulseScan;
use catseye_lane::uwb;
use catseye_lane::uwb::Uwb;
pub use settings::{Asphalt, Settings, StandsFor};
use std::collections::VecDeque;

/// Number of scans of the road without markers that set the threshold in a comparison: fewer than in a trial
/// of the method.
const QUIET_SCANS: u32 = 600;
/// Number of scatterers on all rough surfaces, for a radar that sees a few square metres of them.
const MOST_RAYS: u64 = 2000;
/// Stream of the draws of the bus between looks.
const SPEEDS: u64 = 0x75_77_62;
/// Largest difference of two times that are the same, s.
const SAME_S: f64 = 1e-9;

impl LaneMethod for Settings {
    fn trial(&self, given: &TrialContext<'_>) -> Result<Trial> {
        self.check()?;
        let settings = self;
        let sweep_m: Vec<f64> = match settings.offset_sweep {
            true => (0..=64).map(|i| 0.025 * f64::from(i)).collect(),
            false => Vec::new(),
        };
        let frames = u64::from(given.scenario.frames.count) * u64::from(given.runs);
        let more = u64::from(settings.histogram_scans) + frames + sweep_m.len() as u64;
        let drives = Drives::new(given, settings, Scenery::All, more)?;
        let rules = rules(settings);
        let quiet = drives.quiet()?;
        let tuned = rules.iter().map(|rule| tune_all(settings, rule, &drives.radars, &quiet));
        let tuned: Vec<Vec<Tuned>> = tuned.collect::<Result<_>>()?;
        let slow = |(site, scans): (Site, Scans)| {
            let drive = Drive::new(&site, given.engine)?;
            let beside = drives.radars.iter().map(|radar| markers_of(&drive, radar, settings).1).collect();
            Ok(Slow { beside, scans })
        };
        let slow = drives.histogram()?.into_iter().map(slow).collect::<Result<_>>()?;
        let mut steps = Vec::new();
        let runs =
            (0..given.runs).map(|k| one_run(&drives, &tuned, k, &mut steps)).collect::<Result<Vec<_>>>()?;
        let sweep = match runs.iter().any(|r| !r.passes[0].is_empty()) {
            true => drives.sweep(&sweep_m)?,
            false => Vec::new(),
        };
        let impulse_radars = drives.radars;
        let made = UwbResults { settings, impulse_radars, rules, tuned, quiet, slow, runs, sweep };
        let mut trial = Trial::new(uwb::estimator::METHOD, format!("uwb: {}", given.scenario.name));
        figures::fill(&mut trial, &made, steps)?;
        Ok(trial)
    }

    /// The radar takes scans at its own rate, between the frames of the others, and has been on for some
    /// distance before the first look, as a vehicle's is: one plate is no lane. Each drive has its own scene,
    /// as the band of impulse radars has its own asphalt.
    fn ready(&self, given: &TrialContext<'_>, _: &Drive<'_>, run: u32) -> Result<Vec<(String, ReadyMethod)>> {
        let mut scenario = given.scenario_of(run);
        scenario.radars.retain(|r| matches!(r.waveform, Waveform::Pulse { .. }));
        // A radar that looks down at the road sees no reflections between things, and few square metres of it.
        (scenario.trace.bounces, scenario.trace.most_bounces) = (1, 0);
        scenario.trace.rays = scenario.trace.rays.min(MOST_RAYS);
        let settings = Settings { quiet_scans: self.quiet_scans.min(QUIET_SCANS), ..self.clone() };
        let radars = drives::impulse_radars(&scenario, &settings)?;
        scenario.frames = frames(&scenario, &radars, &settings);
        let own = TrialContext { scenario: &scenario, runs: 1, keep: None, ..*given };
        let drives = Drives::new(&own, &settings, Scenery::WithinReach, 0)?;
        let site = drives::site(&scenario, &settings)?;
        let early = drives::run_up(&site, &scenario, &settings)?;
        let early = early.map(|early| drives::site(&early, &settings)).transpose()?;
        let quiet = drives.quiet()?;
        let rules = rules(&settings);
        let estimator = estimator(&tune_all(&settings, &rules[rules.len() - 1], &drives.radars, &quiet)?)?;

        let mut speeds = BusSensor::new(scenario.seed ^ SPEEDS, SPEED_STD_MPS, 0.0);
        let mut taken: VecDeque<PulseScan> = VecDeque::new();
        for (site, name) in early.iter().map(|s| (s, "before")).chain([(&site, "drive")]) {
            let scans = drives.scans(name, site, &drives.radars)?;
            let drive = Drive::new(site, given.engine)?;
            let before_s = match name {
                "before" => -f64::from(drive.frames()) * site.scenario.frames.interval_s,
                _ => 0.0,
            };
            for (index, scan) in (0..).zip(&scans) {
                let time_s = drive.time_s(index);
                taken.push_back(PulseScan {
                    time_s: before_s + time_s,
                    speed_mps: Some(speeds.read(drive.level(time_s).speed_mps)),
                    samples: scan.iter().flat_map(|s| wide(s)).collect(),
                });
            }
        }
        let sense = move |_: &Drive<'_>, _: Option<&Frame>, _: u32, look: &mut OwnedInput| {
            let due = taken.partition_point(|s| s.time_s <= look.time_s + SAME_S);
            look.scans = taken.drain(..due).collect();
            // What the bus said at the look itself.
            if let Some(last) = look.scans.last_mut()
                && (last.time_s - look.time_s).abs() < SAME_S
            {
                last.speed_mps = look.speed_mps;
            }
            Ok(())
        };
        Ok(ReadyMethod::sensing(estimator, Box::new(sense)).alone())
    }
}

/// Frames from time zero to the last look, one for each scan.
fn frames(scenario: &Scenario, radars: &[ImpulseRadar], settings: &Settings) -> Frames {
    let own_s = radars.iter().map(|e| scenario.radars[e.which].frame_time_s()).fold(0.0, f64::max);
    let interval_s = settings.scan_interval_s.unwrap_or(own_s);
    let last_s = scenario.frames.time_s(scenario.frames.count.saturating_sub(1));
    Frames { count: ((last_s + SAME_S) / interval_s).floor() as u32 + 1, interval_s }
}

fn one_run(drives: &Drives<'_>, tuned: &[Vec<Tuned>], number: u32, steps: &mut Vec<Step>) -> Result<Run> {
    let Drives { given, settings, radars, .. } = drives;
    let scenario = drives::scenario_of_run(given, settings, number);
    let site = drives::site(&scenario, settings)?;
    let scans = drives.scans(&format!("run{number}"), &site, radars)?;
    let drive = Drive::new(&site, given.engine)?;
    let times_s: Vec<f64> = (0..drive.frames()).map(|i| drive.time_s(i)).collect();
    let true_mps: Vec<f64> = times_s.iter().map(|t| drive.level(*t).speed_mps).collect();
    if let Some(v) = true_mps.iter().find(|v| **v < 0.0) {
        let bad = BadInput::new("the method needs a vehicle that moves forward");
        return Err(bad.key("ego.drive.speed_mps").value(v).allowed("0 m/s or more").into());
    }
    let mut sensor = BusSensor::new(scenario.seed, settings.speed_std_mps, settings.speed_step_kmh / 3.6);
    let read = true_mps.iter().map(|v| sensor.read(*v));
    let speeds: Vec<Measured> = read.map(|m| Measured { value: m.value.max(0.0), ..m }).collect();

    let last = &tuned[tuned.len() - 1];
    let mut estimator = estimator(last)?;
    for (i, scan) in scans.iter().enumerate() {
        let pulse: Vec<f64> = scan.iter().flat_map(|s| wide(s)).collect();
        let look = SensorInput {
            time_s: times_s[i],
            speed_mps: Some(speeds[i]),
            pulse: Some(&pulse),
            ..SensorInput::default()
        };
        let estimate = timed(|| estimator.estimate(&look));
        let truth = truth_at(&drive, times_s[i], radars, settings);
        steps.push(Step::new(number, i as u32, estimate, truth));
    }

    let of: Vec<_> = radars.iter().map(|radar| markers_of(&drive, radar, settings)).collect();
    let (passes, beside): (Vec<_>, Vec<_>) = of.into_iter().unzip();
    let covers = radars.iter().map(|radar| covers_of(&drive, radar)).collect();
    let way_m = ways(&times_s, &true_mps);
    let see_one = |(k, t): (usize, &Tuned)| {
        let echoes = scans.iter().map(|s| energy(&t.options, &s[k])).collect::<Result<Vec<_>>>()?;
        see(settings, t, &echoes, (&times_s, &way_m), &speeds, &passes[k])
    };
    let seen = tuned.iter().map(|rule| rule.iter().enumerate().map(see_one).collect());
    let seen = seen.collect::<Result<_>>()?;
    Ok(Run { times_s, passes, beside, covers, seen, scans })
}

/// Truth of the rows of markers that pass within reach beside the vehicle.
fn truth_at(drive: &Drive<'_>, time_s: f64, radars: &[ImpulseRadar], settings: &Settings) -> TrueLanes {
    let reach_m = radars.iter().map(ImpulseRadar::reach_m).fold(0.0, f64::max);
    let mut truth = drive.truth_of_rows(time_s, [0.0, settings.spacing_m]);
    let beside = |line: &[[f64; 2]]| {
        let near = line.iter().filter(|p| p[0].abs() < 2.0 * settings.spacing_m);
        near.map(|p| p[1]).min_by(|a, b| a.abs().total_cmp(&b.abs()))
    };
    let seen = |line: &[[f64; 2]]| {
        beside(line).is_some_and(|y| radars.iter().any(|e| (y - e.at_m[1]).abs() <= reach_m))
    };
    truth.own = truth.own.map(|i| i.filter(|i| truth.lines.get(*i).is_some_and(|l| seen(l))));
    own_alone(&truth)
}

/// Distance driven at each time, m, by the trapezoidal rule of the true speeds.
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
    (times_s, way_m): (&[f64], &[f64]),
    speeds: &[Measured],
    passes: &[Passed],
) -> Result<RunResult> {
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
    let own = passes.iter().filter(|p| whole(p.time_s) && p.lateral_m.abs() <= within_m);
    let own: Vec<f64> = own.map(|p| p.time_s).collect();
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
    Ok(RunResult { energies, result, score, warnings_right: right, warnings_wrong: wrong, odometer_m })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trial::LaneTable;
    use catseye::engine::{Engine, Precision};
    use std::path::Path;

    /// Scans come at the radar's rate from before the first look on, none twice, and plates beside a guard rail are a lane at once.
    #[test]
    fn the_first_look_has_the_plates_of_the_way_to_it() {
        let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
        let path = root.join("scenes/lane/compare_straight.toml");
        let mut scenario = Scenario::load(&path).unwrap();
        scenario.frames.count = 3;
        scenario.trace.rays = 500;
        let engine = Engine::open("cpu", Precision::F32).unwrap();
        let given = TrialContext {
            scenario: &scenario,
            path: &path,
            engine: &engine,
            runs: 1,
            keep: None,
            watch: &|_, _| {},
        };
        let site = Site::new(&scenario).unwrap();
        let drive = Drive::new(&site, &engine).unwrap();
        let settings = Settings { quiet_scans: 60, ..LaneTable::load(&path).unwrap().uwb };
        let mut uwb = settings.ready(&given, &drive, 0).unwrap().remove(0).1;
        let mut last_s = f64::NEG_INFINITY;
        for index in 0..3 {
            let time_s = drive.time_s(index);
            let speed_mps = Some(Measured { value: 15.0, std: 0.1 });
            let mut look = OwnedInput { time_s, speed_mps, ..OwnedInput::default() };
            uwb.sense.as_mut().unwrap()(&drive, None, index, &mut look).unwrap();
            // 20 m of road at 0.75 m from scan to scan, then two scans between looks.
            assert_eq!(look.scans.len(), if index == 0 { 27 } else { 2 });
            for s in &look.scans {
                assert!(s.time_s > last_s && s.time_s <= time_s + SAME_S);
                last_s = s.time_s;
            }
            assert_eq!(look.scans[look.scans.len() - 1].speed_mps, look.speed_mps);
            let e = uwb.estimator.estimate(&look.input());
            assert!(e.no_lane.is_none(), "{:?}", e.no_lane);
            assert!(e.time_s == time_s && (e.offset_m.unwrap().value - 0.2).abs() < 0.2, "{e:?}");
        }
    }
}
