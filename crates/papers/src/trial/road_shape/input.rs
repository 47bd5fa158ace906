//! The radar that is used, the points of its image, and the selection of points.

use crate::trial::kit::*;
use crate::trial::road_shape::pictures::KeptImage;
use catseye_lane::road_shape::image::{Imager, suits};
use catseye_lane::road_shape::options::{RoadShapeOptions, Source};
use catseye_lane::road_shape::{Ego, RadarMount};

/// Makes the points of successive radar images.
pub struct ImagePoints(Imager);

impl ImagePoints {
    pub fn new(radar: &Radar, settings: &RoadShapeOptions) -> Result<ImagePoints> {
        Ok(ImagePoints(Imager::new(radar, &settings.image())?))
    }

    /// The points of a frame, and its image if `with`.
    pub fn look(
        &mut self,
        drive: &Drive<'_>,
        frame: &Frame,
        [speed, yaw_rate]: [Measured; 2],
        with: bool,
    ) -> Result<(Vec<LanePoint>, Option<KeptImage>)> {
        let radar = drive.radar(frame.radar);
        let images = self.0.look(drive.engine(), frame.samples()?, with)?;
        let (at, yaw_rad) = mount(radar);
        let ego = Ego {
            speed_mps: speed.value,
            speed_std_mps: speed.std,
            yaw_rate_radps: yaw_rate.value,
            yaw_rate_std_radps: yaw_rate.std,
        };
        let points = self.0.points(&images, Some(&ego), &RadarMount { x_m: at.x, y_m: at.y, yaw_rad })?;
        let points = points.iter().filter_map(|p| lane_point(radar, p)).collect();
        Ok((points, with.then(|| KeptImage::of(&images[0]))))
    }
}

/// Index of the radar that is used, and whether its image is.
pub fn chosen(radars: &[Radar], settings: &RoadShapeOptions) -> Result<(usize, bool)> {
    let image = radars.iter().position(suits);
    let points =
        radars.iter().position(|r| !matches!(r.waveform, Waveform::Pulse { .. }) && r.virtual_channels() > 1);
    let none = |allowed: &str, remedy: &str| no_radar(radars, "road-shape", allowed, remedy).into();
    match settings.source {
        Source::Image | Source::Auto if image.is_some() => Ok((image.unwrap_or(0), true)),
        Source::Image => Err(none(
            "an FMCW radar with two chirp types and three channels in one line",
            "use radar = \"fmcw76\", or source = \"points\"",
        )),
        _ => match points {
            Some(k) => Ok((k, false)),
            None => Err(none(
                "an fmcw, stepped or coded radar with two channels or more",
                "use radar = \"fmcw76\" or \"front77\"",
            )),
        },
    }
}

/// Whether all numbers of a point are finite: JSON holds no infinities, which points without antenna gain
/// have.
pub fn kept_whole(p: &LanePoint) -> bool {
    p.rcs_dbsm.is_finite() && p.snr_db.is_finite() && p.at_m.iter().chain(&p.std_m).all(|v| v.is_finite())
}
