//! The method among others on one drive.

use crate::trial::context::Given;
use crate::trial::drive::Drive;
use crate::trial::range_doppler::settings::Settings;
use crate::trial::ready::{Rival, chirp_radar};
use catseye::error::Result;

pub(in crate::trial) fn rival(
    given: &Given<'_>,
    settings: &Settings,
    drive: &Drive<'_>,
    _run: u32,
) -> Result<Rival> {
    let which = chirp_radar(given)?;
    let equal = settings.left_spacing_m == settings.right_spacing_m;
    Ok(Rival::of_points(settings.estimator(drive.radar(which), equal)?, which))
}
