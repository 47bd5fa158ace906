//! Sangeetha Lakshmi's method on simulated drives: images and radar of the same scene, near lane, paths of
//! the cars ahead, the blind middle by road model, recognition step by step, and the results of each sensor
//! alone by day, at night, in fog and against the sun.

mod judge;
mod pictures;
mod vehicle_camera;

use crate::trial::camera_fusion::judge::Judged;
use crate::trial::camera_fusion::pictures::{Sensors, Shown};
use crate::trial::camera_fusion::vehicle_camera::VehicleCamera;
use crate::trial::kit::*;
use crate::trial::ready::Sense;
use crate::trial::report::{has_lane, percent_of_runs, rms_of_runs, usual_refusal};
use crate::trial::sensors::{KeptPoint, TrackFollower, kept_points};
use catseye_lane::camera_fusion::{BendSettings, CameraFusion, Pnn, RoadModel, generate_bends};
pub use catseye_lane::camera_fusion::{CameraFusionOptions, CameraTable, Condition};
use std::cell::RefCell;
use std::rc::Rc;

const METHOD: &str = "camera-fusion";
/// Number of networks that are trained and tested, each on 100 bends that it has not seen.
const NETWORKS: u64 = 20;
const UNSEEN: usize = 100;

impl LaneMethod for CameraFusionOptions {
    fn trial(&self, given: &TrialContext<'_>) -> Result<Trial> {
        self.check()?;
        self.estimator()?;
        let scenario = given.scenario;
        let found = point_radar(&scenario.radars);
        let allowed = "a radar that measures range rates of cars: fmcw, stepped or coded";
        let which = needed(found, given, "camera-fusion", allowed, "use radar = \"front77\"")?;
        let looks = looks(scenario, self);
        let Some(last) = looks.last() else {
            let last = scenario.frames.time_s(scenario.frames.count.saturating_sub(1));
            let why = format!("the drive ends after {last} s, before the first recognition");
            let bad = BadInput::new(why).file(given.path).key("lane.camera_fusion.first_s");
            let bad = bad.value(self.first_s).allowed(format!("0..={last}"));
            return Err(bad.remedy("increase frames.count, or reduce first_s and period_s").into());
        };
        let course = |condition, sensors| Course { condition, sensors, steps: Vec::new() };
        let mut found = DriveResults {
            courses: self.conditions.iter().flat_map(|c| Sensors::ALL.map(|s| course(*c, s))).collect(),
            judged: Judged::default(),
            shown: Vec::new(),
        };
        for run in 0..given.runs {
            let site = Site::new(&given.scenario_of(run))?;
            let drive = Drive::new(&site, given.engine)?;
            let (seed, radar) = (site.scenario.seed, drive.radar(which));
            let speed = [self.speed_std_mps, self.speed_step_mps];
            let mut looks = FusedDrive {
                given,
                settings: self,
                which,
                looks: &looks,
                estimators: (0..found.courses.len())
                    .map(|_| self.estimator_with(radar))
                    .collect::<Result<_>>()?,
                follower: TrackFollower::new()?,
                bus: Bus::new(seed, speed, (draws(seed, 0x9a40), self.yaw_rate_std_deg_per_s)),
                camera: VehicleCamera::new(self, radar.carrier_hz, seed),
                found: &mut found,
            };
            let frames = drive.frames().min(last + 1);
            for frame in 0..frames {
                let key = format!("run{run}_frame{frame}");
                one_look(given, (&drive, which), (run, frame), &key, &mut looks)?;
                given.report_frame(run, frame, frames);
            }
        }
        let DriveResults { mut courses, judged, shown } = found;
        let mut trial = Trial::new(METHOD, format!("Camera and radar: {}", scenario.name));
        report(self, &courses, &judged, &mut trial);
        pictures::draw(self, &shown, &mut trial)?;
        notes(scenario, self, &mut trial);
        trial.steps = courses.swap_remove(1).steps;
        Ok(trial)
    }

    /// Returns the method for each light, with the camera alone and with the radar; all variants get the same
    /// images.
    fn ready(
        &self,
        given: &TrialContext<'_>,
        drive: &Drive<'_>,
        run: u32,
    ) -> Result<Vec<(String, ReadyMethod)>> {
        let which = chirp_radar(given, "camera-fusion")?;
        let radar = drive.radar(which);
        let camera = VehicleCamera::new(self, radar.carrier_hz, given.scenario_of(run).seed);
        let camera = Rc::new(RefCell::new(camera));
        let mut out = Vec::new();
        for condition in &self.conditions {
            for (name, tracks) in [("camera and radar", true), ("camera alone", false)] {
                let (camera, condition) = (camera.clone(), *condition);
                let sense: Sense = Box::new(move |drive, _, index, look: &mut OwnedInput| {
                    let image = camera.borrow_mut().picture(drive, index, look.time_s, condition)?;
                    look.image = Some(image);
                    Ok(())
                });
                let ready = ReadyMethod::sensing(self.estimator_with(radar)?, sense);
                let ready = ReadyMethod { radar: tracks.then_some(which), tracks, ..ready };
                out.push((format!("{}, {name}", condition.name()), ready));
            }
        }
        Ok(out)
    }
}

/// One estimator's looks in one condition.
struct Course {
    condition: Condition,
    sensors: Sensors,
    steps: Vec<Step>,
}

/// Results of all drives.
struct DriveResults {
    courses: Vec<Course>,
    judged: Judged,
    shown: Vec<Shown>,
}

/// Frames at which lanes are recognised.
fn looks(scenario: &Scenario, settings: &CameraFusionOptions) -> Vec<u32> {
    let mut next_s = settings.first_s;
    let mut out = Vec::new();
    for f in 0..scenario.frames.count {
        let time_s = scenario.frames.time_s(f);
        if time_s >= next_s - 1e-9 {
            out.push(f);
            next_s = time_s + 0.5 * settings.period_s;
        }
    }
    out
}

/// One drive in all conditions, with each sensor alone and both together.
struct FusedDrive<'a> {
    given: &'a TrialContext<'a>,
    settings: &'a CameraFusionOptions,
    which: usize,
    looks: &'a [u32],
    /// One for each course.
    estimators: Vec<CameraFusion>,
    follower: TrackFollower,
    bus: Bus,
    camera: VehicleCamera,
    found: &'a mut DriveResults,
}

impl Looks for FusedDrive<'_> {
    type Kept = Vec<KeptPoint>;

    fn keep(&self, _: &Now<'_>, frame: &Frame) -> Vec<KeptPoint> {
        kept_points(frame)
    }

    fn look(&mut self, now: &Now<'_>, seen: Vec<KeptPoint>) -> Result<()> {
        let Now { drive, run, frame, time_s, level } = *now;
        let (settings, DriveResults { courses, judged, shown }) = (self.settings, &mut *self.found);
        let read = self.bus.read(&level);
        let scenario = &drive.site.scenario;
        let tracks = self.follower.step(scenario, drive.radar(self.which), frame, &seen, read)?;
        let alone = look_of(time_s, read);
        let look = SensorInput { tracks: &tracks, ..alone };
        if !self.looks.contains(&frame) {
            for (e, c) in self.estimators.iter_mut().zip(&*courses) {
                // Nothing of it can be wrong here: times rise and the speed is known.
                let _ = e.observe(if c.sensors == Sensors::CameraAlone { &alone } else { &look });
            }
            return Ok(());
        }
        let truth = judge::own_lines(drive.truth(time_s, settings.range_m)).ok_or_else(|| -> Error {
            let e = BadInput::new("the vehicle is not in a lane of a road, so there is nothing to compare");
            let remedy = "give scene.road, and ego.on_road with the number of a lane";
            e.file(self.given.path).key("ego.on_road").remedy(remedy).into()
        })?;
        for (e, c) in self.estimators.iter_mut().zip(courses) {
            let image = self.camera.picture(drive, frame, time_s, c.condition)?;
            let look = match c.sensors {
                Sensors::CameraAlone => SensorInput { image: Some(&image), ..alone },
                Sensors::Both => SensorInput { image: Some(&image), ..look },
                Sensors::RadarAlone => look,
            };
            let step = Step::new(run, frame, timed(|| e.estimate(&look)), truth.clone());
            if c.sensors == Sensors::Both && c.condition == settings.conditions[0] {
                judged.take(e.insight(), &truth, settings);
            }
            c.steps.push(step.clone());
            if run == 0 {
                let (condition, sensors, insight) = (c.condition, c.sensors, e.insight().clone());
                shown.push(Shown { time_s, image, condition, sensors, step, insight });
            }
        }
        Ok(())
    }
}

/// Bends that a network has not seen, and how many of 100 each of some networks puts right.
fn networks(settings: &CameraFusionOptions) -> (Vec<f64>, Option<Sheet>) {
    let mut right = Vec::new();
    let mut sheet = None;
    let bends = settings.setup().bends;
    for seed in 0..NETWORKS {
        let training = generate_bends(&bends, settings.network_units as usize, 2 * seed);
        let Ok(pnn) = Pnn::train(&training) else { continue };
        let unseen = generate_bends(&BendSettings { even: false, ..bends }, UNSEEN, 2 * seed + 1);
        let chosen: Vec<Option<RoadModel>> =
            unseen.iter().map(|(b, _)| pnn.choose(b).ok().map(|c| c.model)).collect();
        let hits = unseen.iter().zip(&chosen).filter(|((_, m), c)| Some(*m) == **c).count();
        right.push(hits as f64);
        if seed == 0 {
            let mut s = Sheet::new("table_1", "sample near_slope_deg far_slope_deg actual judged correct")
                .noted("Table 1 of the document: one network and 100 unseen bends.");
            for (i, ((bend, model), choice)) in unseen.iter().zip(&chosen).enumerate() {
                let judged = choice.map_or_else(String::new, |c| c.to_string());
                let (near, far) = (bend.near_slope_rad.to_degrees(), bend.far_slope_rad.to_degrees());
                let correct = u8::from(Some(*model) == *choice);
                s.row(&[&(i + 1), &format!("{near:.2}"), &format!("{far:.2}"), model, &judged, &correct]);
            }
            sheet = Some(s);
        }
    }
    (right, sheet)
}

fn report(settings: &CameraFusionOptions, courses: &[Course], judged: &Judged, trial: &mut Trial) {
    trial.rows = common_rows(&courses[1].steps);
    let (right, table) = networks(settings);
    let what = format!("correct road models of {UNSEEN} unseen bends");
    let row = trial.rows.mean(what, "", &right);
    row.document(98.0)
        .why(format!("mean of {NETWORKS} networks; the document's is one draw, its bends are not stated"));
    trial.sheets.extend(table);
    judged.rows(&mut trial.rows);
    let columns = "condition sensors looks with_lane_percent precision_percent recall_percent f1_percent error_10_m \
                   error_20_m error_40_m offset_error_m most_frequent_refusal";
    let mut table = Sheet::new("conditions", columns).noted(format!(
        "Lines of the own lane between {} and {} m; errors are root mean squares over the frames that have them.",
        settings.range_m[0], settings.range_m[1]
    ));
    for c in courses {
        let middle = |v: &[f64]| mean(v.iter().copied());
        let share = |of: &dyn Fn(&Step) -> Option<f64>| percent_of_runs(&c.steps, of);
        let rms = |of: &dyn Fn(&Step) -> Option<f64>| middle(&rms_of_runs(&c.steps, of));
        let lane = middle(&share(&has_lane));
        // A look without a lane finds nothing.
        let f1 = share(&|s| s.score.f1.or(Some(0.0)));
        let lateral = [0, 1, 2].map(|k| rms(&|s| s.score.lateral_m[k]));
        let far = match lateral[2] {
            Some(m) => format!("{m:.2} m off at 40 m"),
            None => "none reaches 40 m".into(),
        };
        let (condition, sensors) = (c.condition.name(), c.sensors.name());
        let why = format!("lane in {:.0} % of the frames; {far}", lane.unwrap_or(0.0));
        trial.rows.mean(format!("{condition}, {sensors}: F1 within 0.3 m"), "%", &f1).why(why);
        let lines = [&|s: &Step| s.score.precision, &|s: &Step| s.score.recall] as [&dyn Fn(&Step) -> _; 2];
        let [precision, recall] = lines.map(|of| middle(&share(of)));
        let shares = [lane, precision, recall, middle(&f1)];
        let mut row = vec![condition.to_string(), sensors.to_string(), c.steps.len().to_string()];
        let offset = rms(&|s| s.score.offset_error_m);
        row.extend(shares.into_iter().chain(lateral).chain([offset]).map(|v| fixed(v, 3)));
        let refusal = usual_refusal(&c.steps).map_or_else(String::new, |(why, n)| format!("{n} x {why}"));
        row.push(refusal.replace(',', ";"));
        table.rows.push(row);
    }
    trial.sheets.push(table);
    trial.sheets.push(judged.sheet());
}

fn notes(scenario: &Scenario, settings: &CameraFusionOptions, trial: &mut Trial) {
    trial.notes.push(format!(
        "The method estimates the vehicle's own lane, so recall is over its two lines, between {} and {} m. \
         Images and radar frames are of the same scene; speed and yaw rate come from a bus with noise, and \
         the camera's pitch shakes by {} degrees, which the estimator does not know.",
        settings.range_m[0], settings.range_m[1], settings.pitch_std_deg
    ));
    if settings.conditions.contains(&Condition::Fog) && scenario.weather == Default::default() {
        trial.notes.push(
            "Light and fog affect only the image. The radar's frames are the same in all conditions: fog of \
             25 m visibility takes less than 0.1 dB from an echo at 77 GHz over 60 m."
                .into(),
        );
    }
    trial.notes.push(
        "Road models are correct when the true lane turns between the two parts by up to 4 degrees \
         (straight), 10 to 60 (curve) or 80 to 100 (right angle); other turns are not counted. The document \
         gives no limits."
            .into(),
    );
}
