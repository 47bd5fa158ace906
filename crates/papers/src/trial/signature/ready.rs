//! The method among others on one drive.

use crate::trial::context::TrialContext;
use crate::trial::drive::Drive;
use crate::trial::ready::{ReadyMethod, chirp_radar};
use crate::trial::signature::mapped::{estimator_on, map_drive, needs, on_road};
use crate::trial::signature::settings::Settings;
use catseye::error::Result;
use catseye::road::scene_toml;

/// The road is mapped first, on a drive of its own with other traffic.
pub(in crate::trial) fn ready_method(
    given: &TrialContext<'_>,
    settings: &Settings,
    drive: &Drive<'_>,
    _run: u32,
) -> Result<ReadyMethod> {
    let which = chirp_radar(given)?;
    let (path, _) = on_road(given.scenario)?;
    let plan = scene_toml::load(path)?;
    let mapped = map_drive(given, settings, which, &plan, &mut |_| {})?;
    let estimator = estimator_on(settings, drive, which, &mapped)
        .map_err(|e| needs(&e.to_string(), "lane.signature", "change the setting that it names"))?;
    Ok(ReadyMethod::of_points(estimator, which))
}
