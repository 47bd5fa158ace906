//! The method among others on one drive.

use crate::trial::context::TrialContext;
use crate::trial::drive::Drive;
use crate::trial::range_doppler::settings::Settings;
use crate::trial::ready::{ReadyMethod, chirp_radar};
use catseye::error::Result;

pub(in crate::trial) fn ready_method(
    given: &TrialContext<'_>,
    settings: &Settings,
    drive: &Drive<'_>,
    _run: u32,
) -> Result<ReadyMethod> {
    let which = chirp_radar(given)?;
    let equal = settings.left_spacing_m == settings.right_spacing_m;
    Ok(ReadyMethod::of_points(settings.estimator(drive.radar(which), equal)?, which))
}
