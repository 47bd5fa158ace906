//! The method among others on one drive.

use crate::trial::context::TrialContext;
use crate::trial::drive::Drive;
use crate::trial::markers::level;
use crate::trial::markers::settings::Settings;
use crate::trial::ready::{ReadyMethod, chirp_radar};
use catseye::error::Result;
use catseye_lane::markers::{Markers, MarkersOptions};
use catseye_lane::track::TrackOptions;

pub(in crate::trial) fn ready_method(
    given: &TrialContext<'_>,
    settings: &Settings,
    drive: &Drive<'_>,
    _run: u32,
) -> Result<ReadyMethod> {
    let which = chirp_radar(given)?;
    let radar = drive.radar(which);
    let options = MarkersOptions {
        patterns: settings.patterns(radar, drive.site.road.as_ref())?,
        track: settings.track.then(TrackOptions::default),
        radar_ahead_m: radar.mounting.translation_m.x,
        rcs: if settings.levels { level::of_first_row(given, drive.site, radar)? } else { None },
    };
    Ok(ReadyMethod::of_points(Markers::new(options), which))
}
