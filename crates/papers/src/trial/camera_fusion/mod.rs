//! Document S on simulated drives: pictures and radar of the same scene, near lane, ways of the cars ahead, the blind middle by road
//! model, recognition step by step, and what each sensor can do alone by day, by night, in fog and against the sun.

mod judge;
mod pictures;
mod rival;

use super::camera::{Light, View};
use super::drive::{Drive, suitable};
use super::report::{Row, Sheet, Step, Trial, common_rows, mean_of_runs, rms_of_runs};
use super::sensors::{Pursuit, seen_of};
use super::{Given, SpeedSensor};
use catseye::error::{BadInput, Error, Result};
use catseye::geom::Geometry;
use catseye::rng::Draws;
use catseye::road::site::Site;
use catseye::scene::radar::Radar;
use catseye::scene::scenario::Scenario;
use catseye::scene::waveform::Waveform;
use catseye_lane::body::Body;
use catseye_lane::camera_fusion::{
    BendSettings, Camera, CameraFusion, FusionOptions, Image, Insight, Pnn, RecogniseSettings, RoadModel,
    generate_bends,
};
use catseye_lane::score::score;
use catseye_lane::{LaneEstimator, Measured, SensorInput};
use glam::{DVec2, DVec3};
use judge::Judged;
pub(super) use rival::rivals;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::time::Instant;

const METHOD: &str = "camera-fusion";
/// Networks that are trained and judged, each on 100 bends that it has not seen.
const NETWORKS: u64 = 20;
const UNSEEN: usize = 100;

/// What the drive is lit by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Condition {
    /// Noon, clear.
    Clear,
    /// Moonless, outside towns, with low beams.
    Night,
    /// Day, with `fog_visibility_m`.
    Fog,
    /// The sun low ahead, at `glare_elevation_deg`.
    Glare,
}

impl Condition {
    pub fn name(self) -> &'static str {
        match self {
            Condition::Clear => "clear",
            Condition::Night => "night",
            Condition::Fog => "fog",
            Condition::Glare => "glare",
        }
    }
}

/// The camera, which stands in no other part of a scenario.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CameraTable {
    pub width_px: u32,
    pub height_px: u32,
    /// Focal length over the side of a pixel.
    pub focal_px: f64,
    /// In the vehicle frame, z above the road.
    pub position_m: [f64; 3],
    /// Positive to the left.
    pub yaw_deg: f64,
    /// Positive nose down.
    pub pitch_deg: f64,
    /// Positive left side up.
    pub roll_deg: f64,
}

impl Default for CameraTable {
    /// Behind the windscreen, 49 degrees wide.
    fn default() -> Self {
        CameraTable {
            width_px: 640,
            height_px: 400,
            focal_px: 700.0,
            position_m: [1.5, 0.0, 1.4],
            yaw_deg: 0.0,
            pitch_deg: 3.0,
            roll_deg: 0.0,
        }
    }
}

impl CameraTable {
    pub fn camera(&self) -> Camera {
        Camera {
            width_px: self.width_px as usize,
            height_px: self.height_px as usize,
            focal_px: DVec2::splat(self.focal_px),
            centre_px: DVec2::new(0.5 * f64::from(self.width_px), 0.5 * f64::from(self.height_px)),
            position_m: DVec3::from_array(self.position_m),
            yaw_rad: self.yaw_deg.to_radians(),
            pitch_rad: self.pitch_deg.to_radians(),
            roll_rad: self.roll_deg.to_radians(),
        }
    }
}

/// Settings of `catseye lane` with the method camera-fusion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    pub camera: CameraTable,
    /// The first of them is the one whose estimates make the table; all are compared, with each sensor alone and both together.
    pub conditions: Vec<Condition>,
    /// Ahead of the vehicle's origin: the near and the far side of the trapezoid in which lines are sought.
    pub seen_m: [f64; 2],
    /// Of that trapezoid, to each side.
    pub half_width_m: f64,
    /// Where the camera does not see both lines.
    pub lane_width_m: f64,
    /// The document's t: time of the tracks that one recognition takes. The next begins half of it later.
    pub period_s: f64,
    /// Whether tracks are moved from the side that the radar sees to the middle of a car.
    pub to_middle: bool,
    /// Time of the first recognition.
    pub first_s: f64,
    /// Units of the network's second layer: bends that train it.
    pub network_units: u32,
    /// Distances from the vehicle within which lines are to be found.
    pub range_m: [f64; 2],
    /// Standard deviation and step of the speed on the vehicle's bus.
    pub speed_std_mps: f64,
    pub speed_step_mps: f64,
    /// Standard deviation of the yaw rate on the bus.
    pub yaw_rate_std_deg_per_s: f64,
    /// Standard deviation of the camera's pitch from picture to picture, which the estimator does not know.
    pub pitch_std_deg: f64,
    /// Meteorological visibility in the condition fog.
    pub fog_visibility_m: f64,
    /// Of the sun in the condition glare.
    pub glare_elevation_deg: f64,
    /// Stray light of the windscreen in the condition glare, in units of a clean eye's.
    pub glare_stray: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            camera: CameraTable::default(),
            conditions: vec![Condition::Clear, Condition::Night, Condition::Fog, Condition::Glare],
            seen_m: [6.0, 35.0],
            half_width_m: 6.0,
            lane_width_m: 3.5,
            period_s: 2.0,
            to_middle: true,
            first_s: 2.0,
            network_units: 15,
            range_m: [6.0, 60.0],
            speed_std_mps: 0.05,
            speed_step_mps: 0.01,
            yaw_rate_std_deg_per_s: 0.2,
            pitch_std_deg: 0.1,
            fog_visibility_m: 25.0,
            glare_elevation_deg: 12.0,
            glare_stray: 10.0,
        }
    }
}

impl Settings {
    /// Errors: the first key with a value outside what is allowed.
    pub fn check(&self) -> Result<()> {
        let wrong = |key: &str, value: String, allowed: &str, remedy: &str| -> Result<()> {
            let e = BadInput::new("is not allowed").key(format!("lane.camera_fusion.{key}")).value(value);
            Err(e.allowed(allowed).remedy(remedy).into())
        };
        let c = &self.camera;
        for (key, side) in [("camera.width_px", c.width_px), ("camera.height_px", c.height_px)] {
            if !(64..=4096).contains(&side) {
                return wrong(key, side.to_string(), "64..=4096", "as in 640");
            }
        }
        let [x, y, z] = c.position_m;
        if !((-10.0..=10.0).contains(&x) && (-5.0..=5.0).contains(&y) && (0.2..=10.0).contains(&z)) {
            let value = format!("{:?}", c.position_m);
            return wrong(
                "camera.position_m",
                value,
                "[-10..=10, -5..=5, 0.2..=10] m",
                "as in [1.5, 0, 1.4]",
            );
        }
        for (key, value, low, high, remedy) in [
            ("camera.focal_px", c.focal_px, 20.0, 2e4, "give pixels, as in 700"),
            ("camera.yaw_deg", c.yaw_deg, -60.0, 60.0, "give degrees, positive to the left"),
            ("camera.pitch_deg", c.pitch_deg, -30.0, 60.0, "give degrees, positive nose down"),
            ("camera.roll_deg", c.roll_deg, -30.0, 30.0, "give degrees"),
            ("half_width_m", self.half_width_m, 1.0, 50.0, "give metres, as in 6"),
            ("lane_width_m", self.lane_width_m, 1.5, 10.0, "give metres, as in 3.5"),
            ("period_s", self.period_s, 0.1, 20.0, "give seconds, as in 2"),
            ("first_s", self.first_s, 0.0, 1e4, "give seconds, as in 2"),
            ("network_units", f64::from(self.network_units), 10.0, 1000.0, "as in 15"),
            ("speed_std_mps", self.speed_std_mps, 0.0, 10.0, "give metres per second, as in 0.05"),
            ("speed_step_mps", self.speed_step_mps, 0.0, 10.0, "give metres per second, as in 0.01"),
            ("yaw_rate_std_deg_per_s", self.yaw_rate_std_deg_per_s, 0.0, 30.0, "as in 0.2"),
            ("pitch_std_deg", self.pitch_std_deg, 0.0, 5.0, "give degrees, as in 0.1"),
            ("fog_visibility_m", self.fog_visibility_m, 1.0, 1e5, "give metres, as in 25"),
            ("glare_elevation_deg", self.glare_elevation_deg, 1.0, 60.0, "give degrees, as in 12"),
            ("glare_stray", self.glare_stray, 0.0, 1e4, "as in 10"),
        ] {
            if !(low..=high).contains(&value) {
                return wrong(key, value.to_string(), &format!("{low}..={high}"), remedy);
            }
        }
        for (key, [a, b]) in [("seen_m", self.seen_m), ("range_m", self.range_m)] {
            if !(0.0 < a && a < b && b <= 300.0) {
                return wrong(key, format!("[{a}, {b}]"), "0 < near < far <= 300 m", "as in [6, 35]");
            }
        }
        if self.conditions.is_empty() {
            let remedy = "as in [\"clear\", \"night\", \"fog\", \"glare\"]";
            return wrong("conditions", "[]".into(), "one or more of clear, night, fog, glare", remedy);
        }
        Ok(())
    }

    fn light(&self, condition: Condition) -> Light {
        match condition {
            Condition::Clear => Light::CLEAR,
            Condition::Night => Light::night(),
            Condition::Fog => Light::fog(self.fog_visibility_m),
            Condition::Glare => Light::glare(self.glare_elevation_deg.to_radians(), self.glare_stray),
        }
    }

    pub fn options(&self) -> FusionOptions {
        FusionOptions {
            seen_m: self.seen_m,
            half_width_m: self.half_width_m,
            recognise: RecogniseSettings { lane_width_m: self.lane_width_m, ..RecogniseSettings::default() },
            period_s: self.period_s,
            pitch_std_rad: self.pitch_std_deg.to_radians(),
            units: self.network_units as usize,
            body: self.to_middle.then_some(Body::CAR),
            ..FusionOptions::new(self.camera.camera())
        }
    }

    /// With a radar in the front bumper. Errors: as [`Self::estimator_with`].
    pub fn estimator(&self) -> Result<CameraFusion> {
        self.made(self.options())
    }

    /// Errors: a trapezoid that the picture does not hold.
    pub fn estimator_with(&self, radar: &Radar) -> Result<CameraFusion> {
        let radar_at_m = radar.mounting.translation_m.truncate();
        self.made(FusionOptions { radar_at_m, ..self.options() })
    }

    fn made(&self, options: FusionOptions) -> Result<CameraFusion> {
        let bad = |e: catseye_lane::LaneError| -> Error {
            let remedy = "let camera and seen_m agree, so that the trapezoid lies in the picture";
            BadInput::new(e.to_string()).key("lane.camera_fusion").remedy(remedy).into()
        };
        CameraFusion::new(options).map_err(bad)
    }
}

/// What an estimator is given of a look.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sensors {
    CameraAlone,
    Both,
    RadarAlone,
}

impl Sensors {
    pub(super) const ALL: [Sensors; 3] = [Sensors::CameraAlone, Sensors::Both, Sensors::RadarAlone];

    pub(super) fn name(self) -> &'static str {
        match self {
            Sensors::CameraAlone => "camera alone",
            Sensors::Both => "camera and radar",
            Sensors::RadarAlone => "radar alone",
        }
    }
}

/// One estimator's looks in one condition.
struct Course {
    condition: Condition,
    sensors: Sensors,
    steps: Vec<Step>,
}

/// What pictures are drawn from.
pub(super) struct Shown {
    pub(super) time_s: f64,
    pub(super) image: Image,
    pub(super) condition: Condition,
    pub(super) sensors: Sensors,
    pub(super) step: Step,
    pub(super) insight: Insight,
}

/// Drives the scenario through the whole chain, `given.runs` times.
///
/// Errors: settings outside what is allowed; a scenario without a radar for tracks, without frames enough or without a road that the
/// vehicle is on; those of the frames.
pub fn run(given: &Given<'_>, settings: &Settings) -> Result<Trial> {
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
    given: &Given<'_>,
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
    let mut pursuit = Pursuit::new()?;
    let mut bus = SpeedSensor::new(scenario.seed, settings.speed_std_mps, settings.speed_step_mps);
    let seed = scenario.seed as u32 ^ (scenario.seed >> 32) as u32;
    let mut gyro = Draws::new(seed, 0x9a40);
    let mut shake = Draws::new(seed, 0x5a4e);
    let yaw_std = settings.yaw_rate_std_deg_per_s.to_radians();
    let frames = drive.frames().min(looks.last().map_or(0, |l| l + 1));
    for f in 0..frames {
        let time_s = drive.time_s(f);
        let seen = seen_of(given, &drive, which, &format!("run{run}_frame{f}"), f)?;
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
        let view = View::new(&geometry, &site.scene, &scenario_pose(&site, time_s), &camera)?;
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
            let begin = Instant::now();
            let estimate = e.estimate(&look);
            let seconds = begin.elapsed().as_secs_f64();
            let step = Step {
                run,
                frame: f,
                score: score(&estimate, &truth),
                truth: truth.clone(),
                estimate,
                seconds,
            };
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

fn scenario_pose(
    site: &Site,
    time_s: f64,
) -> catseye::frames::Pose<catseye::frames::Vehicle, catseye::frames::World> {
    site.scenario.ego.pose(time_s)
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
            let mut s = Sheet::new(
                "table_1",
                &["sample", "near_slope_deg", "far_slope_deg", "actual", "judged", "correct"],
            );
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
        &[
            "condition",
            "sensors",
            "looks",
            "with_lane_percent",
            "precision_percent",
            "recall_percent",
            "f1_percent",
            "error_10_m",
            "error_20_m",
            "error_40_m",
            "offset_error_m",
            "most_frequent_refusal",
        ],
    );
    table.comments.push(format!(
        "Lines of the own lane between {} and {} m; errors are root mean squares over the looks that state them.",
        settings.range_m[0], settings.range_m[1]
    ));
    let mean = |v: &[f64]| (!v.is_empty()).then(|| v.iter().sum::<f64>() / v.len() as f64);
    let text = |v: Option<f64>| v.map_or_else(String::new, |v| format!("{v:.3}"));
    for c in courses {
        let share = |of: &dyn Fn(&Step) -> Option<f64>| -> Vec<f64> {
            mean_of_runs(&c.steps, of).iter().map(|v| 100.0 * v).collect()
        };
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
