//! The road's shape from its walls and barriers (seed M): the radar image of an FM-CW radar, standing points, both edges, a clothoid filter
//! over a drive. And M's two corner reflectors, on which methods of angle are compared.

mod corners;

mod input;

mod pictures;

mod ready;

mod settings;

use crate::trial::context::TrialContext;
use crate::trial::drive::{Drive, lane_point};
use crate::trial::edges::{Edges, NearEdges};
use crate::trial::report::{Row, Sheet, Step, Trial, common_rows, mean_of_runs};
use crate::trial::road_shape::input::{chosen, kept_whole};
use crate::trial::road_shape::pictures::{KeptImage, Tracked};
use crate::trial::sensors::SpeedSensor;
use crate::trial::stats::{rms, timed};
use catseye::error::{BadInput, Result};
use catseye::road::site::Site;
use catseye_lane::road_shape::image::Imager;
use catseye_lane::road_shape::{
    EdgeStatus, Ego, HoughSettings, RadarMount, RoadShapeEstimator, Side, VoteMap,
};
use catseye_lane::score::TrueLanes;
use catseye_lane::{LaneEstimate, LaneEstimator, LanePoint, SensorInput};
pub use corners::subspace_seconds;
use glam::DVec2;
pub(super) use ready::ready_method;
use serde::{Deserialize, Serialize};
pub use settings::{Settings, Source, Task};

/// Of one look, as it is kept.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Kept {
    points: Vec<LanePoint>,
    image: Option<KeptImage>,
}

/// Runs what the settings ask for. Errors: settings and scenarios that do not go together; those of the chain.
pub fn run(given: &TrialContext<'_>, settings: &Settings) -> Result<Trial> {
    settings.check()?;
    match settings.task {
        Task::Edges => drives(given, settings),
        Task::Corners => corners::run(given, settings),
    }
}

/// One run: what the radar gave in all frames. The subspace tracker remembers, so a run is kept as a whole.
fn seen(
    given: &TrialContext<'_>,
    run: u32,
    settings: &Settings,
    site: &Site,
    shown: u32,
) -> Result<Vec<Kept>> {
    let (which, by_image) = chosen(&site.scenario.radars, settings)?;
    let drive = Drive::new(site, given.engine)?;
    let radar = drive.radar(which);
    let mut imager = if by_image { Some(Imager::new(radar, &settings.image())?) } else { None };
    let mut speed = sensors(site.scenario.seed, settings);
    let mut out = Vec::new();
    for index in 0..drive.frames() {
        let frame = drive.frame(which, index)?;
        let ego = speed.read(&drive, index);
        let (points, image) = match &mut imager {
            Some(imager) => {
                let with = run == 0 && index == shown;
                let images = imager.look(given.engine, &frame.cube, with)?;
                let at = radar.mounting.translation_m;
                let ahead = radar.mounting.rotation * glam::DVec3::X;
                let mount = RadarMount { x_m: at.x, y_m: at.y, yaw_rad: ahead.y.atan2(ahead.x) };
                let points = imager.points(&images, Some(&ego), &mount)?;
                let points = points.iter().filter_map(|p| lane_point(radar, p)).collect();
                (points, with.then(|| KeptImage::of(&images[0])))
            }
            None => (drive.points(&frame), None),
        };
        out.push(Kept { points: points.into_iter().filter(kept_whole).collect(), image });
        let all = u64::from(given.runs) * u64::from(drive.frames());
        (given.watch)(u64::from(run) * u64::from(drive.frames()) + u64::from(index) + 1, all);
    }
    Ok(out)
}

/// What the vehicle's bus says.
struct Bus {
    speed: SpeedSensor,
    yaw: SpeedSensor,
}

fn sensors(seed: u64, s: &Settings) -> Bus {
    Bus {
        speed: SpeedSensor::new(seed, s.speed_std_mps, 0.0),
        yaw: SpeedSensor::new(seed ^ 0x0079_6177, s.yaw_rate_std_deg_per_s.to_radians(), 0.0),
    }
}

impl Bus {
    fn read(&mut self, drive: &Drive<'_>, index: u32) -> Ego {
        let level = drive.level(drive.time_s(index));
        let (v, w) = (self.speed.read(level.speed_mps), self.yaw.read(level.yaw_rate_rad_per_s));
        Ego { speed_mps: v.value, speed_std_mps: v.std, yaw_rate_radps: w.value, yaw_rate_std_radps: w.std }
    }
}

/// Of one run beyond its steps.
#[derive(Default)]
struct Tally {
    /// Looks in which each edge is stated, right and left, over the looks in which it is there.
    stated: [[f64; 2]; 2],
    /// Vehicles that move and are found among the moving points by range and range rate, of all that are within reach.
    cars: [f64; 2],
    /// Error of their directions, deg.
    directions: Vec<f64>,
    /// Standing points on vehicles that move, of all standing points.
    taken: [f64; 2],
    /// Lateral error of right and left at the scored distances, of the filter and of the vote alone.
    lateral: [Vec<(usize, f64)>; 2],
    vote: Vec<(usize, f64)>,
    /// Largest tracked and true curvature.
    curvature: [f64; 2],
    /// Squares of curvature errors over their variances.
    surprise: Vec<f64>,
}

/// A vehicle that moves, as it truly is.
#[derive(Debug, Clone, Copy)]
struct Car {
    /// Of its middle, level frame.
    at_m: [f64; 2],
    /// From the radar.
    range_m: f64,
    azimuth_rad: f64,
    range_rate_mps: f64,
}

fn vehicles(drive: &Drive<'_>, which: usize, time_s: f64) -> Vec<Car> {
    let level = drive.level(time_s);
    let radar_m = drive.radar(which).mounting.translation_m.truncate();
    let own = DVec2::from_angle(level.heading_rad) * level.speed_mps;
    let mut out: Vec<Car> = Vec::new();
    for o in &drive.site.scene.objects {
        let now = o.at(time_s);
        let known = ["car", "truck", "motorcycle", "van", "bus"].contains(&o.class.as_str());
        if !known || now.velocity_mps.length() < 1.0 {
            continue;
        }
        let at = level.from_world(now.translation_m.truncate());
        // A vehicle may be several objects.
        if out.iter().any(|p| DVec2::from_array(p.at_m).distance(at) < 1.5) {
            continue;
        }
        let line = at - radar_m;
        let velocity = DVec2::from_angle(-level.heading_rad).rotate(now.velocity_mps.truncate() - own);
        out.push(Car {
            at_m: at.to_array(),
            range_m: line.length(),
            azimuth_rad: line.to_angle(),
            range_rate_mps: velocity.dot(line.normalize_or(DVec2::X)),
        });
    }
    out
}

/// y of a polyline at a distance ahead.
fn lateral_at(line: &[[f64; 2]], x: f64) -> Option<f64> {
    let w = line.windows(2).find(|w| w[0][0] <= x && w[1][0] > x)?;
    Some(w[0][1] + (w[1][1] - w[0][1]) * (x - w[0][0]) / (w[1][0] - w[0][0]))
}

const AHEAD_M: [f64; 3] = [20.0, 40.0, 60.0];

fn drives(given: &TrialContext<'_>, settings: &Settings) -> Result<Trial> {
    let mut trial = Trial::new("road-shape", format!("Road shape: {}", given.scenario.name));
    let mut tallies = Vec::new();
    let count = given.scenario.frames.count;
    let shown = settings.picture_frame.unwrap_or(count / 2).min(count.saturating_sub(1));
    let mut estimates = Sheet::new(
        "edges",
        "run frame time_s side state c0_per_m c0_std_per_m c1_per_m2 b_m b_std_m true_b_m \
             true_c0_per_m why",
    );
    let mut nothing = false;
    for run in 0..given.runs {
        let site = Site::new(&given.scenario_of(run))?;
        let (which, by_image) = chosen(&site.scenario.radars, settings)?;
        let kept = given.kept(&format!("run{run}"), || seen(given, run, settings, &site, shown))?;
        let drive = Drive::new(&site, given.engine)?;
        let radar = drive.radar(which);
        // One slope tells range rates up to its folds only.
        let fold = (!by_image && radar.waveform.parts() < 2).then(|| 2.0 * radar.max_velocity_mps());
        let options = settings.options(fold);
        let hough = options.tracker.hough.clone();
        let made = RoadShapeEstimator::new(options);
        let mut estimator = made.map_err(|r| BadInput::new(r.to_string()).key("lane.road_shape"))?;
        let edges = Edges::of(&site.scene, site.road.as_ref());
        nothing |= edges.is_empty();
        let mut bus = sensors(site.scenario.seed, settings);
        let mut tally = Tally::default();
        let mut tracked = Vec::new();
        for (index, k) in kept.iter().enumerate() {
            let index = index as u32;
            let time_s = drive.time_s(index);
            let level = drive.level(time_s);
            let ego = bus.read(&drive, index);
            let truth = edges.truth(&level, [settings.from_m, settings.to_m]);
            let look = SensorInput {
                time_s,
                speed_mps: Some(catseye_lane::Measured { value: ego.speed_mps, std: ego.speed_std_mps }),
                yaw_rate_rad_per_s: Some(catseye_lane::Measured {
                    value: ego.yaw_rate_radps,
                    std: ego.yaw_rate_std_radps,
                }),
                points: &k.points,
                ..SensorInput::default()
            };
            let (estimate, seconds) = timed(|| estimator.estimate(&look));
            let near = edges.near(&level, settings.to_m + 20.0);
            let cars = vehicles(&drive, which, time_s);
            let shape = estimator.latest();
            add(&mut tally, &estimate, &truth, &near, shape, &hough, &cars, k, settings.max_range_m);
            let c0 = |side: Side| {
                let t = shape?.edge(side).filter(|t| t.status != EdgeStatus::Tentative)?;
                let c = t.filter.curvature_per_m(0.0);
                Some([c.value, c.std])
            };
            tracked.push(Tracked {
                time_s,
                truth_per_m: truth.curvature_per_m,
                edges_per_m: [c0(Side::Right), c0(Side::Left)],
            });
            sheet(&mut estimates, run, index, time_s, shape, &near);
            if run == 0 && index == shown {
                if let Some(image) = &k.image {
                    let title = "Radar image of the rising slope (M, Fig. 3)";
                    trial
                        .pictures
                        .push(("image".into(), pictures::image(title, image, settings.max_range_m)?));
                }
                if let Some(shape) = shape
                    && let Some(picture) = pictures::votes(shape, &hough)?
                {
                    trial.pictures.push(("votes".into(), picture));
                }
                let at: Vec<[f64; 2]> = cars.iter().map(|c| c.at_m).collect();
                let title = "Estimated and true edges (M, Figs. 5 and 6)";
                trial
                    .pictures
                    .push(("road".into(), pictures::road(title, &k.points, &estimate, shape, &truth, &at)?));
            }
            trial.steps.push(Step::new(run, index, (estimate, seconds), truth));
        }
        if run == 0 {
            trial.pictures.push(("curvature".into(), pictures::curvature(&tracked)?));
        }
        tallies.push(tally);
    }
    trial.rows = common_rows(&trial.steps);
    rows(&mut trial, &tallies, settings);
    trial.sheets.push(estimates);
    trial.notes.push(
        "Lines are the edges of the road: the true ones are the faces of walls and rails, cut out of the scene's triangles; offset and \
         curvature are against them. The document gives no accuracy."
            .into(),
    );
    if nothing {
        trial
            .notes
            .push("The scene has no wall, rail or fence along a road: there is nothing to find.".into());
    }
    Ok(trial)
}

#[allow(clippy::too_many_arguments, reason = "all of one look")]
fn add(
    tally: &mut Tally,
    estimate: &LaneEstimate,
    truth: &TrueLanes,
    near: &NearEdges,
    shape: Option<&catseye_lane::road_shape::RoadShape>,
    hough: &HoughSettings,
    cars: &[Car],
    kept: &Kept,
    far_m: f64,
) {
    let vote = shape.and_then(|s| VoteMap::new(&s.points, hough).ok());
    for (k, side) in [Side::Right, Side::Left].into_iter().enumerate() {
        let there = near.sides[k].iter().any(|l| l.iter().any(|p| p[0] > truth.range_m[0]));
        if !there {
            continue;
        }
        tally.stated[k][1] += 1.0;
        let line = estimate.lines.iter().find(|l| (l.fitted.curve.start_m[1] > 0.0) == (side == Side::Left));
        tally.stated[k][0] += f64::from(u8::from(line.is_some()));
        let votes = vote.as_ref().and_then(|v| v.edge(side).ok());
        for (i, x) in AHEAD_M.into_iter().enumerate() {
            let Some(y) = near.sides[k].iter().find_map(|l| lateral_at(l, x)) else { continue };
            if let Some(line) = line {
                let foot = line.fitted.curve.foot(DVec2::new(x, y));
                if foot.s_m <= line.fitted.curve.length_m {
                    tally.lateral[k].push((i, foot.left_m));
                }
            }
            if let Some(v) = votes.filter(|v| v.x_max_m >= x) {
                tally.vote.push((i, v.a_per_m * x * x + v.b_m - y));
            }
        }
        let track = shape.and_then(|s| s.edge(side)).filter(|t| t.status != EdgeStatus::Tentative);
        if let (Some(t), Some(c)) = (track, near.curvature_per_m[k]) {
            let e = t.filter.curvature_per_m(0.0);
            tally.surprise.push(((e.value - c) / e.std.max(1e-9)).powi(2));
        }
    }
    if let Some(c) = estimate.curvature_per_m {
        tally.curvature[0] = tally.curvature[0].max(c.value.abs());
    }
    if let Some(c) = truth.curvature_per_m {
        tally.curvature[1] = tally.curvature[1].max(c.abs());
    }
    let Some(shape) = shape else { return };
    // A body of some 4.6 m by 1.8 m, and what the deviations allow.
    let on = |p: [f64; 2], c: &[f64; 2]| (p[0] - c[0]).abs() < 3.3 && (p[1] - c[1]).abs() < 1.4;
    let standing = shape.points.iter().filter(|p| cars.iter().any(|c| on([p.x_m, p.y_m], &c.at_m)));
    tally.taken[0] += standing.count() as f64;
    tally.taken[1] += shape.points.len() as f64;
    for c in cars.iter().filter(|c| c.at_m[0] > 5.0 && c.range_m < far_m) {
        tally.cars[1] += 1.0;
        // Its rear stands before its middle, and what a mirror adds behind.
        let is_it = |p: &&LanePoint| {
            (p.range_m - c.range_m).abs() < 3.5 && (p.range_rate_mps - c.range_rate_mps).abs() < 1.5
        };
        let strongest = kept.points.iter().filter(is_it).max_by(|a, b| a.snr_db.total_cmp(&b.snr_db));
        if let Some(p) = strongest {
            tally.cars[0] += 1.0;
            tally.directions.push((p.azimuth_rad - c.azimuth_rad).to_degrees());
        }
    }
}

fn rows(trial: &mut Trial, tallies: &[Tally], settings: &Settings) {
    let share = |of: &dyn Fn(&Tally) -> [f64; 2]| -> Vec<f64> {
        tallies.iter().map(of).filter(|v| v[1] > 0.0).map(|v| 100.0 * v[0] / v[1]).collect()
    };
    let rms =
        |of: &dyn Fn(&Tally) -> Vec<f64>| -> Vec<f64> { tallies.iter().filter_map(|t| rms(of(t))).collect() };
    let mut more = Vec::new();
    for (k, name) in ["right", "left"].into_iter().enumerate() {
        let why = match k {
            0 => "of the looks in which there is one; the first looks confirm it",
            _ => "",
        };
        more.push(Row::mean(format!("{name} edge stated"), "%", &share(&|t| t.stated[k])).why(why));
    }
    for (i, x) in AHEAD_M.iter().enumerate() {
        for (k, name) in ["right", "left"].into_iter().enumerate() {
            let at = |t: &Tally| t.lateral[k].iter().filter(|e| e.0 == i).map(|e| e.1).collect();
            more.push(Row::mean(format!("{name} edge, lateral error at {x} m (rms)"), "m", &rms(&at)));
        }
    }
    for (i, x) in AHEAD_M.iter().enumerate() {
        let at = |t: &Tally| t.vote.iter().filter(|e| e.0 == i).map(|e| e.1).collect();
        let row = Row::mean(format!("vote alone, lateral error at {x} m (rms)"), "m", &rms(&at));
        more.push(if i == 0 { row.why("both edges, scan by scan, as the document draws them") } else { row });
    }
    let largest = |i: usize| tallies.iter().map(|t| t.curvature[i]).collect::<Vec<_>>();
    let row = Row::mean("largest tracked curvature", "1/m", &largest(0));
    more.push(match settings.document_curvature_per_m {
        Some(c) => row.document(c).why("the document's road is not known otherwise; ours is the row below"),
        None => row,
    });
    more.push(Row::mean("largest true curvature", "1/m", &largest(1)));
    let surprise = |t: &Tally| t.surprise.iter().map(|s| s.sqrt()).collect();
    more.push(
        Row::mean("tracked curvature, error over its stated deviation (rms)", "", &rms(&surprise))
            .why("1 where the deviations are right"),
    );
    more.push(
        Row::mean("moving vehicles found by range and speed", "%", &share(&|t| t.cars))
            .why("of those within reach, hidden ones too"),
    );
    more.push(
        Row::mean("direction of a moving vehicle, error (rms)", "deg", &rms(&|t| t.directions.clone()))
            .why("in its beat frequency lies a stretch of wall, too: five elements part no more than two"),
    );
    more.push(
        Row::mean("standing points that are on moving vehicles", "%", &share(&|t| t.taken))
            .why("most of the vehicles' peaks are eliminated, the document says"),
    );
    let used = |s: &Step| Some(s.estimate.provenance.used as f64);
    let given = |s: &Step| Some(s.estimate.provenance.given as f64);
    more.push(Row::mean("points in a look", "", &mean_of_runs(&trial.steps, given)));
    more.push(Row::mean("points on the edges", "", &mean_of_runs(&trial.steps, used)));
    more.retain(|r| r.ours.is_some());
    trial.rows.extend(more);
}

fn sheet(
    sheet: &mut Sheet,
    run: u32,
    frame: u32,
    time_s: f64,
    shape: Option<&catseye_lane::road_shape::RoadShape>,
    near: &NearEdges,
) {
    let Some(shape) = shape else { return };
    for (k, side) in [Side::Right, Side::Left].into_iter().enumerate() {
        let why = match &shape.fits[side as usize] {
            Ok(_) => String::new(),
            Err(reason) => reason.to_string(),
        };
        let text = |v: Option<f64>| v.map_or_else(String::new, |v| format!("{v:.6}"));
        let true_b = near.sides[k].iter().find_map(|l| lateral_at(l, 0.0));
        let (state, c0, c0_std, c1, b, b_std) = match shape.edge(side) {
            Some(t) => {
                let ([c0, c1, b], p) = (t.filter.state(), t.filter.covariance());
                let state = format!("{:?}", t.status).to_lowercase();
                let small = |v: f64| format!("{v:.4e}");
                (
                    state,
                    small(c0),
                    small(p[0][0].sqrt()),
                    small(c1),
                    text(Some(b)),
                    text(Some(p[2][2].sqrt())),
                )
            }
            None => {
                ("none".into(), String::new(), String::new(), String::new(), String::new(), String::new())
            }
        };
        let true_c0 = near.curvature_per_m[k].map_or_else(String::new, |c| format!("{c:.4e}"));
        sheet.row(&[
            &run,
            &frame,
            &format!("{time_s:.4}"),
            &side,
            &state,
            &c0,
            &c0_std,
            &c1,
            &b,
            &b_std,
            &text(true_b),
            &true_c0,
            &why,
        ]);
    }
}
