//! The method among others on one drive.

use crate::trial::context::TrialContext;
use crate::trial::drive::{Drive, lane_point};
use crate::trial::ready::{Finds, ReadyMethod};
use crate::trial::road_shape::input::{chosen, kept_whole};
use crate::trial::road_shape::settings::Settings;
use crate::trial::sensors::OwnedInput;
use catseye::error::{BadInput, Result};
use catseye::simulate::Frame;
use catseye_lane::road_shape::image::Imager;
use catseye_lane::road_shape::{Ego, RadarMount, RoadShapeEstimator};

pub(in crate::trial) fn ready_method(
    given: &TrialContext<'_>,
    settings: &Settings,
    drive: &Drive<'_>,
    _run: u32,
) -> Result<ReadyMethod> {
    let (which, by_image) = chosen(&given.scenario.radars, settings)?;
    let radar = drive.radar(which);
    let fold = (!by_image && radar.waveform.parts() < 2).then(|| 2.0 * radar.max_velocity_mps());
    let estimator = RoadShapeEstimator::new(settings.options(fold))
        .map_err(|r| BadInput::new(r.to_string()).key("lane.road_shape"))?;
    let mut rival = ReadyMethod { finds: Finds::RoadEdges, ..ReadyMethod::of_points(estimator, which) };
    if by_image {
        let mut imager = Imager::new(radar, &settings.image())?;
        rival.points = false;
        rival.sense =
            Some(Box::new(move |drive: &Drive<'_>, frame: Option<&Frame>, _, look: &mut OwnedInput| {
                let (Some(frame), Some(speed), Some(yaw)) = (frame, look.speed_mps, look.yaw_rate_rad_per_s)
                else {
                    return Ok(());
                };
                let radar = drive.radar(frame.radar);
                let images = imager.look(drive.engine(), &frame.cube, false)?;
                let (at, ahead) = (radar.mounting.translation_m, radar.mounting.rotation * glam::DVec3::X);
                let mount = RadarMount { x_m: at.x, y_m: at.y, yaw_rad: ahead.y.atan2(ahead.x) };
                let ego = Ego {
                    speed_mps: speed.value,
                    speed_std_mps: speed.std,
                    yaw_rate_radps: yaw.value,
                    yaw_rate_std_radps: yaw.std,
                };
                let points = imager.points(&images, Some(&ego), &mount)?;
                look.points = points.iter().filter_map(|p| lane_point(radar, p)).filter(kept_whole).collect();
                Ok(())
            }));
    }
    Ok(rival)
}
