//! The trial of the method in a build with networks.

use super::SegmentationOptions;
use crate::trial::kit::*;
use crate::trial::ready::Finds;
use crate::trial::sensors::{KeptPoint, kept_points, lane_points};
use catseye_lane::segmentation::{METHOD, RadarMount};
use catseye_learn::lane::Segmentation;
use std::path::Path;

/// Makes the method for a radar of a scenario's file.
fn estimator(options: &SegmentationOptions, path: &Path, radar: &Radar) -> Result<Segmentation> {
    let (at_m, yaw_rad) = mount(radar);
    let base = path.parent().unwrap_or(Path::new(""));
    Segmentation::open(base, options, RadarMount { at_m, yaw_rad })
}

impl LaneMethod for SegmentationOptions {
    fn trial(&self, given: &TrialContext<'_>) -> Result<Trial> {
        self.check_in_scenario()?;
        let which = chirp_radar(given, METHOD)?;
        let count = given.scenario.frames.count;
        let shown = self.picture_frame.unwrap_or(count / 2).min(count.saturating_sub(1));
        let mut trial = Trial::new(METHOD, format!("Lanes by a network: {}", given.scenario.name));
        for run in 0..given.runs {
            let site = Site::new(&given.scenario_of(run))?;
            let drive = Drive::new(&site, given.engine)?;
            let yaw_rate = (draws(site.scenario.seed ^ 0x0079_6177, 0x5eed), self.bus_yaw_rate_std_deg_per_s);
            let mut looks = NetworkDrive {
                options: self,
                estimator: estimator(self, given.path, drive.radar(which))?,
                bus: Bus::new(site.scenario.seed, [self.bus_speed_std_mps, 0.0], yaw_rate),
                which,
                shown: (run == 0).then_some(shown),
                trial: &mut trial,
            };
            drive_through(given, (&drive, which), (run, drive.frames()), &mut looks)?;
        }
        trial.rows = common_rows(&trial.steps);
        let width = over_runs(
            &trial.steps,
            |s| s.run,
            |run| mean(run.iter().filter_map(|s| Some(s.estimate.width_m?.value))),
        );
        trial.rows.mean("width of the region", "m", &width);
        trial.rows.retain(|r| r.ours.is_some());
        trial.notes.push(
            "Lines are the edges of the region of drivable lanes, not those of the vehicle's own lane; offset, heading and curvature \
             are against that region. The network knows one class for all lanes."
                .into(),
        );
        Ok(trial)
    }

    fn ready(
        &self,
        given: &TrialContext<'_>,
        drive: &Drive<'_>,
        _: u32,
    ) -> Result<Vec<(String, ReadyMethod)>> {
        let which = chirp_radar(given, METHOD)?;
        let estimator = estimator(self, given.path, drive.radar(which))?;
        let ready = ReadyMethod { finds: Finds::LaneRegion, ..ReadyMethod::of_points(estimator, which) };
        Ok(vec![("edges of the lanes".into(), ready)])
    }
}

/// The looks of one drive.
struct NetworkDrive<'a> {
    options: &'a SegmentationOptions,
    estimator: Segmentation,
    bus: Bus,
    which: usize,
    /// Frame of which there is a picture.
    shown: Option<u32>,
    trial: &'a mut Trial,
}

impl Looks for NetworkDrive<'_> {
    type Kept = Vec<KeptPoint>;

    fn keep(&self, _: &Now<'_>, frame: &Frame) -> Vec<KeptPoint> {
        kept_points(frame)
    }

    fn look(&mut self, now: &Now<'_>, kept: Vec<KeptPoint>) -> Result<()> {
        let points = lane_points(now.drive.radar(self.which), &kept);
        let read = self.bus.read(&now.level);
        let look = SensorInput { points: &points, ..look_of(now.time_s, read) };
        let estimate = timed(|| self.estimator.estimate(&look));
        let truth = now.drive.truth_of_region(now.time_s, self.options.reach_m);
        let step = Step::new(now.run, now.frame, estimate, truth);
        if self.shown == Some(now.frame) {
            let title = format!("Edges of the lanes by a network, {:.1} s", now.time_s);
            let chart = lanes_chart(&title, &points, &step.truth, &step.estimate);
            self.trial.pictures.push(("lanes".into(), chart.draw()?));
        }
        self.trial.steps.push(step);
        Ok(())
    }
}
