//! The method among others on one drive: the lane of the vehicle itself, by its own place on the map.

use crate::trial::context::TrialContext;
use crate::trial::drive::Drive;
use crate::trial::hd_map::settings::Settings;
use crate::trial::hd_map::stage::{Change, estimator, map_of, place, stages};
use crate::trial::ready::{Finds, ReadyMethod, chirp_radar};
use crate::trial::sensors::OwnedInput;
use catseye::error::{BadInput, Result};
use catseye::rng::Draws;

pub(in crate::trial) fn ready_method(
    given: &TrialContext<'_>,
    settings: &Settings,
    drive: &Drive<'_>,
    run: u32,
) -> Result<ReadyMethod> {
    let which = chirp_radar(given)?;
    let settings = Settings { scene: Vec::new(), ..settings.clone() };
    let seed = given.scenario_of(run).seed;
    let mut draws = Draws::new(seed as u32 ^ (seed >> 32) as u32, 0x3a90);
    let stages = stages(given, &settings)?;
    let map = match stages.first() {
        Some(stage) => map_of(given, &settings, stage, &mut draws)?,
        None => return Err(BadInput::new("the scenario has no road").key("scene.road").into()),
    };
    let survey = [draws.normal(), draws.normal(), draws.normal()];
    let radar = drive.radar(which).clone();
    let method = estimator(&settings, &map, &radar, &Change::default())?;
    let sense = move |drive: &Drive<'_>, _: Option<&_>, _: u32, look: &mut OwnedInput| {
        look.place = place(&settings, &drive.level(look.time_s), &radar, survey);
        Ok(())
    };
    Ok(ReadyMethod {
        estimator: Box::new(method),
        finds: Finds::OwnLines,
        radar: None,
        points: false,
        tracks: false,
        sense: Some(Box::new(sense)),
    })
}
