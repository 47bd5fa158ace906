//! Trials of lane numbers by radar tracks and a map (document L): a radar over a road, vehicles that pass it, and the lane that each
//! is given beside the one where it is. Tracks come from the whole chain; the map is that of the road with an error of its survey.

mod passes;

mod drawing;

mod pictures;

mod report;

mod ready;

mod scene;

mod settings;

mod sight;

mod stage;

mod traffic;

use crate::trial::context::TrialContext;
use crate::trial::drive::Drive;
use crate::trial::hd_map::stage::{Change, estimator, map_of, place, stages};
use crate::trial::report::Trial;
use crate::trial::sensors::SpeedSensor;
use crate::trial::stats::timed;
use catseye::error::{BadInput, Error, Result};
use catseye::rng::Draws;
use catseye::road::site::Site;
use catseye::scene::scenario::Scenario;
pub use passes::{Pass, Scan};
pub(super) use ready::ready_method;
pub use settings::{Divided, Kind, SceneTable, Settings};
pub use sight::{Mover, Sight};

/// Runs the trial. Errors: settings out of their ranges; a scene without lanes and no map; a radar that tells no azimuth.
pub fn run(given: &TrialContext<'_>, settings: &Settings) -> Result<Trial> {
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
                let drive = Drive::new(&site, given.engine)?;
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
                    let ((lanes, estimate), seconds) = timed(|| {
                        (own.targets(&look), catseye_lane::LaneEstimator::estimate(&mut own, &look))
                    });
                    let lanes = lanes.map_err(|why| Error::Failed(format!("hd-map: {why}")))?;
                    let varied = others.each_mut().map(|o| o.targets(&look).unwrap_or_default());
                    passes.look(&site.scene, &stage.lanes, &level, &look, &mut own, (&lanes, &varied), index);
                    all.step(run, index, &drive, &stage.lanes, &level, (estimate, seconds));
                }
                all.group(run, k, g, passes, &stage.lanes, &drive);
            }
        }
    }
    Ok(all.finish())
}
