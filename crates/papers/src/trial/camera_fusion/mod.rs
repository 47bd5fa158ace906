//! Document S on simulated drives: pictures and radar of the same scene, near lane, ways of the cars ahead, the blind middle by road
//! model, recognition step by step, and what each sensor can do alone by day, by night, in fog and against the sun.

mod judge;

mod pictures;

mod ready;

mod settings;

use crate::trial::camera::View;
use crate::trial::camera_fusion::judge::Judged;
use crate::trial::camera_fusion::pictures::{Sensors, Shown};
use crate::trial::context::TrialContext;
use crate::trial::drive::{Drive, suitable};
use crate::trial::report::{Row, Sheet, Step, Trial, common_rows, percent_of_runs, rms_of_runs};
use crate::trial::sensors::{SpeedSensor, TrackFollower, kept_points};
use crate::trial::stats::{mean, timed};
use catseye::error::{BadInput, Error, Result};
use catseye::geom::Geometry;
use catseye::rng::Draws;
use catseye::road::site::Site;
use catseye::scene::scenario::Scenario;
use catseye::scene::waveform::Waveform;
use catseye_lane::camera_fusion::{BendSettings, CameraFusion, Image, Pnn, RoadModel, generate_bends};
use catseye_lane::{LaneEstimator, Measured, SensorInput};
pub(super) use ready::ready_methods;
pub use settings::{CameraTable, Condition, Settings};

const METHOD: &str = "camera-fusion";
/// Networks that are trained and judged, each on 100 bends that it has not seen.
const NETWORKS: u64 = 20;
const UNSEEN: usize = 100;

/// One estimator's looks in one condition.
struct Course {
    condition: Condition,
    sensors: Sensors,
    steps: Vec<Step>,
}

/// Drives the scenario through the whole chain, `given.runs` times.
///
/// Errors: settings outside what is allowed; a scenario without a radar for tracks, without frames enough or without a road that the
/// vehicle is on; those of the frames.
pub fn run(given: &TrialContext<'_>, settings: &Settings) -> Result<Trial> {
    settings.check()?;
    settings.estimator()?;
    let scenario = given.scenario;
    let Some(which) = suitable(&scenario.radars, |w| !matches!(w, Waveform::Pulse { .. })) else {
        let e = BadInput::new("tracks of cars need range rates, and impulse radars give none");
        return Err(e.file(given.path).key("radar").remedy("take front77, or another FMCW radar").into());
    };
    let looks = looks(scenario, settings);
    if looks.is_empty() {
        let last = scenario.frames.time_s(scenario.frames.count.saturating_sub(1));
        return Err(BadInput::new(format!("the drive ends after {last} s, before the first recognition"))
            .file(given.path)
            .key("lane.camera_fusion.first_s")
            .value(settings.first_s)
            .allowed(format!("0..={last}"))
            .remedy("raise frames.count, or set first_s and period_s lower")
            .into());
    }
    let mut trial = Trial::new(METHOD, format!("Camera and radar: {}", scenario.name));
    let mut courses: Vec<Course> = settings
        .conditions
        .iter()
        .flat_map(|c| Sensors::ALL.map(|s| Course { condition: *c, sensors: s, steps: Vec::new() }))
        .collect();
    let mut judged = Judged::default();
    let mut shown: Vec<Shown> = Vec::new();
    for run in 0..given.runs {
        one_run(given, settings, which, run, &looks, &mut courses, &mut judged, &mut shown)?;
    }
    report(settings, &courses, &judged, &mut trial);
    pictures::draw(settings, &shown, &mut trial)?;
    notes(scenario, settings, &mut trial);
    trial.steps = courses.swap_remove(1).steps;
    Ok(trial)
}

/// Frames at which lanes are recognised.
fn looks(scenario: &Scenario, settings: &Settings) -> Vec<u32> {
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

#[allow(clippy::too_many_arguments, reason = "one drive fills all tables")]
fn one_run(
    given: &TrialContext<'_>,
    settings: &Settings,
    which: usize,
    run: u32,
    looks: &[u32],
    courses: &mut [Course],
    judged: &mut Judged,
    shown: &mut Vec<Shown>,
) -> Result<()> {
    let scenario = given.scenario_of(run);
    let site = Site::new(&scenario)?;
    let drive = Drive::new(&site, given.engine)?;
    let no_road = || -> Error {
        let e = BadInput::new("the vehicle stands in no lane of a road, and nothing can be compared");
        let remedy = "give scene.road, and ego.on_road with the number of a lane";
        e.file(given.path).key("ego.on_road").remedy(remedy).into()
    };
    let mut estimators: Vec<CameraFusion> =
        courses.iter().map(|_| settings.estimator_with(drive.radar(which))).collect::<Result<_>>()?;
    let mut pursuit = TrackFollower::new()?;
    let mut bus = SpeedSensor::new(scenario.seed, settings.speed_std_mps, settings.speed_step_mps);
    let seed = scenario.seed as u32 ^ (scenario.seed >> 32) as u32;
    let mut gyro = Draws::new(seed, 0x9a40);
    let mut shake = Draws::new(seed, 0x5a4e);
    let yaw_std = settings.yaw_rate_std_deg_per_s.to_radians();
    let frames = drive.frames().min(looks.last().map_or(0, |l| l + 1));
    for f in 0..frames {
        let time_s = drive.time_s(f);
        let seen = kept_points(given, &drive, which, &format!("run{run}_frame{f}"), f)?;
        let level = drive.level(time_s);
        let speed = bus.read(level.speed_mps);
        let yaw_rate = Measured { value: level.yaw_rate_rad_per_s + yaw_std * gyro.normal(), std: yaw_std };
        let tracks = pursuit.step(&scenario, drive.radar(which), f, &seen, (speed, yaw_rate))?;
        let look = SensorInput {
            time_s,
            speed_mps: Some(speed),
            yaw_rate_rad_per_s: Some(yaw_rate),
            tracks: &tracks,
            ..SensorInput::default()
        };
        let alone = SensorInput { tracks: &[], ..look };
        if !looks.contains(&f) {
            for (e, c) in estimators.iter_mut().zip(&*courses) {
                // Nothing of it can be wrong here: times rise and the speed is known.
                let _ = e.observe(if c.sensors == Sensors::CameraAlone { &alone } else { &look });
            }
            (given.watch)(
                u64::from(run) * u64::from(frames) + u64::from(f) + 1,
                u64::from(given.runs * frames),
            );
            continue;
        }
        let truth = judge::own_lines(drive.truth(time_s, settings.range_m)).ok_or_else(no_road)?;
        let geometry = Geometry::build(&site.scene, time_s, drive.radar(which).carrier_hz)?;
        let mut camera = settings.camera.camera();
        camera.pitch_rad += settings.pitch_std_deg.to_radians() * shake.normal();
        let view = View::new(&geometry, &site.scene, &site.scenario.ego.pose(time_s), &camera)?;
        let mut images: Vec<(Condition, Image)> = Vec::new();
        for condition in &settings.conditions {
            let noise = scenario.seed.wrapping_mul(1000).wrapping_add(u64::from(f));
            images.push((*condition, view.lit(&geometry, &settings.light(*condition), noise)?));
        }
        for (e, c) in estimators.iter_mut().zip(courses.iter_mut()) {
            let Some((_, image)) = images.iter().find(|i| i.0 == c.condition) else { continue };
            let look = match c.sensors {
                Sensors::CameraAlone => SensorInput { image: Some(image), ..alone },
                Sensors::Both => SensorInput { image: Some(image), ..look },
                Sensors::RadarAlone => look,
            };
            let step = Step::new(run, f, timed(|| e.estimate(&look)), truth.clone());
            if c.sensors == Sensors::Both && c.condition == settings.conditions[0] {
                judged.take(e.insight(), &truth, settings);
            }
            if run == 0 {
                shown.push(Shown {
                    time_s,
                    image: image.clone(),
                    condition: c.condition,
                    sensors: c.sensors,
                    step: step.clone(),
                    insight: e.insight().clone(),
                });
            }
            c.steps.push(step);
        }
        (given.watch)(u64::from(run) * u64::from(frames) + u64::from(f) + 1, u64::from(given.runs * frames));
    }
    Ok(())
}

/// Bends that a network has not seen, and how many of 100 each of some networks puts right.
fn networks(settings: &Settings) -> (Vec<f64>, Option<Sheet>) {
    let mut right = Vec::new();
    let mut sheet = None;
    let bends = settings.options().bends;
    for seed in 0..NETWORKS {
        let training = generate_bends(&bends, settings.network_units as usize, 2 * seed);
        let Ok(pnn) = Pnn::train(&training) else { continue };
        let unseen = generate_bends(&BendSettings { even: false, ..bends }, UNSEEN, 2 * seed + 1);
        let chosen: Vec<Option<RoadModel>> =
            unseen.iter().map(|(b, _)| pnn.choose(b).ok().map(|c| c.model)).collect();
        let hits = unseen.iter().zip(&chosen).filter(|((_, m), c)| Some(*m) == **c).count();
        right.push(hits as f64);
        if seed == 0 {
            let mut s = Sheet::new("table_1", "sample near_slope_deg far_slope_deg actual judged correct");
            s.comments
                .push("Table 1 of the document: one network and 100 bends that it has not seen.".into());
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

fn report(settings: &Settings, courses: &[Course], judged: &Judged, trial: &mut Trial) {
    trial.rows = common_rows(&courses[1].steps);
    let (right, table) = networks(settings);
    trial.rows.push(
        Row::mean(format!("road models right of {UNSEEN} unseen bends"), "", &right).document(98.0).why(
            format!("mean of {NETWORKS} networks; the document's is one draw, its bends are not stated"),
        ),
    );
    trial.sheets.extend(table);
    judged.rows(&mut trial.rows);
    let mut table = Sheet::new(
        "conditions",
        "condition sensors looks with_lane_percent precision_percent recall_percent f1_percent \
             error_10_m error_20_m error_40_m offset_error_m most_frequent_refusal",
    );
    table.comments.push(format!(
        "Lines of the own lane between {} and {} m; errors are root mean squares over the looks that state them.",
        settings.range_m[0], settings.range_m[1]
    ));
    let mean = |v: &[f64]| mean(v.iter().copied());
    let text = |v: Option<f64>| v.map_or_else(String::new, |v| format!("{v:.3}"));
    for c in courses {
        let share = |of: &dyn Fn(&Step) -> Option<f64>| percent_of_runs(&c.steps, of);
        let lane = share(&|s| Some(f64::from(u8::from(s.estimate.no_lane.is_none()))));
        // A look without a lane finds nothing.
        let f1 = share(&|s| s.score.f1.or(Some(0.0)));
        let name = format!("{}, {}", c.condition.name(), c.sensors.name());
        let far = mean(&rms_of_runs(&c.steps, |s| s.score.lateral_m[2]));
        let why = match far {
            Some(m) => {
                format!("lane in {:.0} % of the looks; {m:.2} m off at 40 m", mean(&lane).unwrap_or(0.0))
            }
            None => format!("lane in {:.0} % of the looks; none reaches 40 m", mean(&lane).unwrap_or(0.0)),
        };
        trial.rows.push(Row::mean(format!("{name}: F1 within 0.3 m"), "%", &f1).why(why));
        let lateral = |k: usize| text(mean(&rms_of_runs(&c.steps, |s| s.score.lateral_m[k])));
        table.row(&[
            &c.condition.name(),
            &c.sensors.name(),
            &c.steps.len(),
            &text(mean(&lane)),
            &text(mean(&share(&|s| s.score.precision))),
            &text(mean(&share(&|s| s.score.recall))),
            &text(mean(&f1)),
            &lateral(0),
            &lateral(1),
            &lateral(2),
            &text(mean(&rms_of_runs(&c.steps, |s| s.score.offset_error_m))),
            &judge::usual_refusal(&c.steps).replace(',', ";"),
        ]);
    }
    trial.sheets.push(table);
    trial.sheets.push(judged.sheet());
}

fn notes(scenario: &Scenario, settings: &Settings, trial: &mut Trial) {
    trial.notes.push(format!(
        "The method tells the vehicle's own lane, so that recall is over its two lines, between {} and {} m. Pictures and radar are of \
         the same scene; speed and yaw rate come from a bus with noise, and the camera's pitch shakes by {} degrees, which the \
         estimator does not know.",
        settings.range_m[0], settings.range_m[1], settings.pitch_std_deg
    ));
    if settings.conditions.contains(&Condition::Fog) && scenario.weather == Default::default() {
        trial.notes.push(
            "Light and fog are those of the picture alone. The radar's frames are the same in all conditions: fog of 25 m visibility \
             takes less than 0.1 dB from an echo at 77 GHz over 60 m."
                .into(),
        );
    }
    trial.notes.push(
        "Road models are right when the true lane turns between the two parts by up to 4 degrees (straight), 10 to 60 (curve) or 80 to \
         100 (right angle); other turns are not counted. The document gives no limits."
            .into(),
    );
}
