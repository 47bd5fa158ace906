//! The method among others on one drive. Its radar takes scans at its own rate, between the frames of the others, and has been on for
//! some way before the first look, as a vehicle's is: one plate is no lane.

use crate::trial::context::TrialContext;
use crate::trial::drive::Drive;
use crate::trial::ready::{Finds, ReadyMethod, SPEED_STD_MPS};
use crate::trial::sensors::{OwnedInput, SpeedSensor};
use crate::trial::uwb::drives;
use crate::trial::uwb::drives::{ImpulseRadar, Progress, Scenery};
use crate::trial::uwb::settings::Settings;
use crate::trial::uwb::tuning::{check_speed, estimator, rules, tune, wide};
use catseye::error::Result;
use catseye::scene::scenario::{Frames, Scenario};
use catseye::scene::waveform::Waveform;
use catseye_lane::PulseScan;
use std::collections::VecDeque;

/// Scans of the road without markers that set the threshold of a comparison: fewer than a trial of the method takes.
const QUIET_SCANS: u32 = 600;
/// Scatterers on all rough surfaces, for a radar that sees some square metres of them.
const MOST_RAYS: u64 = 2000;
/// Of the bus between looks.
const SPEEDS: u64 = 0x75_77_62;

/// Each drive has a scene of its own: the band of impulse radars has an asphalt of its own.
pub(in crate::trial) fn ready_method(
    given: &TrialContext<'_>,
    settings: &Settings,
    _drive: &Drive<'_>,
    run: u32,
) -> Result<ReadyMethod> {
    let mut scenario = given.scenario_of(run);
    scenario.radars.retain(|r| matches!(r.waveform, Waveform::Pulse { .. }));
    // A radar that looks down at the road sees no reflections between things, and few square metres of it.
    scenario.trace.bounces = 1;
    scenario.trace.rays = scenario.trace.rays.min(MOST_RAYS);
    let impulse_radars: Vec<ImpulseRadar> = drives::impulse_radars(&scenario, settings)?;
    drives::check_road(&scenario)?;
    scenario.frames = frames(&scenario, &impulse_radars, settings);
    check_speed(&scenario, settings)?;
    let settings = Settings { quiet_scans: settings.quiet_scans.min(QUIET_SCANS), ..settings.clone() };
    let own = TrialContext {
        scenario: &scenario,
        path: given.path,
        engine: given.engine,
        runs: 1,
        keep: None,
        watch: given.watch,
    };
    let site = drives::site(&scenario, &settings)?;
    let early = match drives::run_up(&site, &scenario, &settings)? {
        Some(early) => Some(drives::site(&early, &settings)?),
        None => None,
    };
    let all = settings.quiet_scans
        + scenario.frames.count
        + early.as_ref().map_or(0, |site| site.scenario.frames.count);
    let progress = Progress::new(&own, u64::from(all));
    let quiet = drives::quiet(&own, &progress, &settings, &impulse_radars, Scenery::WithinReach)?;
    let rules = rules(&settings);
    let rule = &rules[rules.len() - 1];
    let tuned = impulse_radars
        .iter()
        .enumerate()
        .map(|(i, eye)| tune(&settings, rule, eye, i, &quiet))
        .collect::<Result<Vec<_>>>()?;
    let estimator = Box::new(estimator(&tuned)?);

    let mut speeds = SpeedSensor::new(scenario.seed ^ SPEEDS, SPEED_STD_MPS, 0.0);
    let mut taken: VecDeque<PulseScan> = VecDeque::new();
    for (site, name) in early.iter().map(|s| (s, "before")).chain([(&site, "drive")]) {
        let scans = drives::scans(&own, &progress, name, site, &impulse_radars, Scenery::WithinReach)?;
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
    let sense = move |_: &Drive<'_>, _: Option<&_>, _: u32, look: &mut OwnedInput| {
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
    Ok(ReadyMethod {
        estimator,
        finds: Finds::OwnLines,
        radar: None,
        points: false,
        tracks: false,
        sense: Some(Box::new(sense)),
    })
}

/// Times that differ by less are one, s.
const SAME_S: f64 = 1e-9;

/// From time zero to the last look, a frame for each scan.
fn frames(scenario: &Scenario, impulse_radars: &[ImpulseRadar], settings: &Settings) -> Frames {
    let own_s = impulse_radars.iter().map(|e| scenario.radars[e.which].frame_time_s()).fold(0.0, f64::max);
    let interval_s = settings.scan_interval_s.unwrap_or(own_s);
    let last_s = scenario.frames.time_s(scenario.frames.count.saturating_sub(1));
    Frames { count: ((last_s + SAME_S) / interval_s).floor() as u32 + 1, interval_s }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trial::LaneTable;
    use catseye::engine::{Engine, Precision};
    use catseye::road::site::Site;
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
        let mut uwb = ready_method(&given, &settings, &drive, 0).unwrap();
        let mut last_s = f64::NEG_INFINITY;
        for index in 0..3 {
            let time_s = drive.time_s(index);
            let speed_mps = Some(catseye_lane::Measured { value: 15.0, std: 0.1 });
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
