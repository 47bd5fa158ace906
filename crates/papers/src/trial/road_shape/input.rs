//! The radar that is taken, and which of its points.

use crate::trial::road_shape::settings::{Settings, Source};
use catseye::error::{BadInput, Result};
use catseye::scene::radar::Radar;
use catseye::scene::waveform::Waveform;
use catseye_lane::LanePoint;
use catseye_lane::road_shape::image::suits;

/// The radar that is taken, and whether its image is.
pub fn chosen(radars: &[Radar], settings: &Settings) -> Result<(usize, bool)> {
    let image = radars.iter().position(suits);
    let points =
        radars.iter().position(|r| !matches!(r.waveform, Waveform::Pulse { .. }) && r.virtual_channels() > 1);
    let none = |what: &str, remedy: &str| {
        BadInput::new(format!("no radar of the scenario has {what}"))
            .key("radar")
            .value(radars.iter().map(|r| r.name.as_str()).collect::<Vec<_>>().join(", "))
            .remedy(remedy.to_string())
    };
    match settings.source {
        Source::Image | Source::Auto if image.is_some() => Ok((image.unwrap_or(0), true)),
        Source::Image => {
            Err(none("two slopes and three channels in one line", "take fmcw76, or source = \"points\"")
                .into())
        }
        _ => match points {
            Some(k) => Ok((k, false)),
            None => Err(none("two channels", "take fmcw76 or front77").into()),
        },
    }
}

/// JSON holds no infinities, which points without antenna gain have.
pub fn kept_whole(p: &LanePoint) -> bool {
    p.rcs_dbsm.is_finite() && p.snr_db.is_finite() && p.at_m.iter().chain(&p.std_m).all(|v| v.is_finite())
}
