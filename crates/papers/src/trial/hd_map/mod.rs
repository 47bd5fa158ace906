//! Trials of lane numbers by radar tracks and a map (Li 2022): a radar at a road, vehicles that pass it, and
//! the assigned lane of each compared with the true one. Tracks come from the whole chain; the map is that of
//! the road with a survey error.

mod drawing;
mod passes;
mod pictures;
mod report;
mod scene;
mod settings;
mod sight;
mod stage;
mod traffic;

use crate::trial::hd_map::sight::{Follower, Sight};
use crate::trial::hd_map::stage::{Change, Stage, estimator, map_of, place, stages};
use crate::trial::kit::*;
use catseye_lane::hd_map::estimator::MapLanes;
pub use settings::{Kind, SceneTable, Settings};

/// Stream of the draws of a survey.
const SURVEY: u32 = 0x3a90;

impl LaneMethod for Settings {
    fn trial(&self, given: &TrialContext<'_>) -> Result<Trial> {
        self.check()?;
        let which = sight::radar(given)?;
        let stages = stages(given, self)?;
        let mut total = 0;
        for stage in &stages {
            // About as many in each run.
            let groups = traffic::groups(stage, self, &stage.scenario)?.len() as u64;
            total += groups * u64::from(given.scenario.frames.count) * u64::from(given.runs);
        }
        let mut all = report::All::new(given, self, &stages);
        let mut done = 0;
        for run in 0..given.runs {
            for (k, stage) in stages.iter().enumerate() {
                let scenario = Scenario { seed: given.scenario_of(run).seed, ..stage.scenario.clone() };
                // Survey errors are those of one site: one draw for each run and scene.
                let mut draws = draws(scenario.seed, SURVEY + k as u32);
                let map = map_of(given, self, stage, &mut draws)?;
                let survey = [draws.normal(), draws.normal(), draws.normal()];
                let other = |change: Change| estimator(self, &map, &scenario.radars[which], change);
                let mut own = other(Change::None)?;
                let mut others = [other(Change::RadarAxis)?, other(Change::AsTracked)?];
                for (g, group) in traffic::groups(stage, self, &scenario)?.iter().enumerate() {
                    let mut seeded = scenario.clone();
                    seeded.seed = scenario.seed.wrapping_add(1000 * g as u64);
                    let site = match &group.plan {
                        Some(plan) => Site::on(&seeded, plan.clone())?,
                        None => Site::new(&seeded)?,
                    };
                    let drive = Drive::new(&site, given.engine)?;
                    let mut looks = GroupDrive {
                        settings: self,
                        which,
                        stage,
                        survey,
                        own: &mut own,
                        others: &mut others,
                        bus: BusSensor::new(seeded.seed, self.speed_std_mps, 0.0),
                        follower: Follower::new()?,
                        passes: passes::Passes::new(group),
                        all: &mut all,
                    };
                    for frame in 0..drive.frames() {
                        let key = format!("run{run}_scene{k}_group{g}_frame{frame}");
                        one_look(given, (&drive, which), (run, frame), &key, &mut looks)?;
                        done += 1;
                        (given.watch)(done, total);
                    }
                    let passes = looks.passes;
                    all.group(run, k, g, passes, &stage.lanes, &drive);
                }
            }
        }
        Ok(all.finish())
    }

    /// The lane of the vehicle itself, by its own position on the map.
    fn ready(
        &self,
        given: &TrialContext<'_>,
        drive: &Drive<'_>,
        run: u32,
    ) -> Result<Vec<(String, ReadyMethod)>> {
        let which = chirp_radar(given, "hd-map")?;
        let settings = Settings { scene: Vec::new(), ..self.clone() };
        let mut draws = draws(given.scenario_of(run).seed, SURVEY);
        let map = match stages(given, &settings)?.first() {
            Some(stage) => map_of(given, &settings, stage, &mut draws)?,
            None => return Err(BadInput::new("the scenario has no road").key("scene.road").into()),
        };
        let survey = [draws.normal(), draws.normal(), draws.normal()];
        let radar = drive.radar(which).clone();
        let method = estimator(&settings, &map, &radar, Change::None)?;
        let sense = move |drive: &Drive<'_>, _: Option<&Frame>, _: u32, look: &mut OwnedInput| {
            look.place = place(&settings, &drive.level(look.time_s), &radar, survey);
            Ok(())
        };
        Ok(ReadyMethod::sensing(method, Box::new(sense)).alone())
    }
}

/// The looks at one group of vehicles.
struct GroupDrive<'a, 'b> {
    settings: &'a Settings,
    which: usize,
    stage: &'a Stage,
    survey: [f64; 3],
    own: &'a mut MapLanes,
    others: &'a mut [MapLanes; 2],
    bus: BusSensor,
    follower: Follower,
    passes: passes::Passes,
    all: &'a mut report::All<'b>,
}

impl Looks for GroupDrive<'_, '_> {
    type Kept = Sight;

    fn keep(&self, now: &Now<'_>, frame: &Frame) -> Sight {
        sight::see(now.drive, frame, self.settings)
    }

    fn look(&mut self, now: &Now<'_>, seen: Sight) -> Result<()> {
        let (radar, level, time_s) = (now.drive.radar(self.which), &now.level, now.time_s);
        let speed = self.bus.read(level.speed_mps);
        let tracks = self.follower.step(&seen, radar, level, speed.value, self.settings, time_s)?;
        let pose = place(self.settings, level, radar, self.survey)
            .ok_or_else(|| BadInput::new("is not a position on the earth").key("lane.hd_map.origin"))?;
        let (speed_mps, place) = (Some(speed), Some(pose));
        let look = SensorInput { time_s, speed_mps, tracks: &tracks, place, ..SensorInput::default() };
        let ((lanes, estimate), seconds) =
            timed(|| (self.own.targets(&look), LaneEstimator::estimate(self.own, &look)));
        let lanes = lanes.map_err(|why| Error::Failed(format!("hd-map: {why}")))?;
        let varied = self.others.each_mut().map(|o| o.targets(&look).unwrap_or_default());
        self.passes.look(now, &self.stage.lanes, &look, self.own, (&lanes, &varied));
        self.all.step(now, &self.stage.lanes, (estimate, seconds));
        Ok(())
    }
}
