//! The method among others on one drive, in the first of its conditions.

use super::super::camera::View;
use super::{Condition, Settings};
use crate::error::Result;
use crate::geom::Geometry;
use crate::rng::Draws;
use crate::trial::compare::{Rival, chirp_radar};
use crate::trial::sensors::OwnedLook;
use crate::trial::{Drive, Given};

pub(in crate::trial) fn rival(
    given: &Given<'_>,
    settings: &Settings,
    drive: &Drive<'_>,
    run: u32,
) -> Result<Rival> {
    let which = chirp_radar(given)?;
    let settings = settings.clone();
    let estimator = settings.estimator()?;
    let condition = settings.conditions.first().copied().unwrap_or(Condition::Clear);
    let carrier_hz = drive.radar(which).carrier_hz;
    let seed = given.scenario_of(run).seed;
    let mut shake = Draws::new(seed as u32 ^ (seed >> 32) as u32, 0x5a4e);
    let sense = move |drive: &Drive<'_>, _: Option<&_>, index: u32, look: &mut OwnedLook| {
        let site = drive.site;
        let geometry = Geometry::build(&site.scene, look.time_s, carrier_hz)?;
        let mut camera = settings.camera.camera();
        camera.pitch_rad += settings.pitch_std_deg.to_radians() * shake.normal();
        let view = View::new(&geometry, &site.scene, &site.scenario.ego.pose(look.time_s), &camera)?;
        let noise = seed.wrapping_mul(1000).wrapping_add(u64::from(index));
        look.image = Some(view.lit(&geometry, &settings.light(condition), noise)?);
        Ok(())
    };
    Ok(Rival {
        estimator: Box::new(estimator),
        radar: Some(which),
        points: false,
        tracks: true,
        sense: Some(Box::new(sense)),
    })
}
