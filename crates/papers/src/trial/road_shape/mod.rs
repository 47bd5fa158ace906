//! The road's shape from its walls and barriers (Miyake): the radar image of an FM-CW radar, stationary
//! points, both edges, and a clothoid filter over a drive. In addition Miyake's two corner reflectors, with
//! which angle estimation methods are compared.

mod corners;
mod input;
mod pictures;

use crate::trial::edges::{Edges, NearEdges};
use crate::trial::kit::*;
use crate::trial::ready::Finds;
use crate::trial::report::mean_of_runs;
use crate::trial::road_shape::input::{ImagePoints, chosen, kept_whole};
use crate::trial::road_shape::pictures::{KeptImage, Tracked};
pub use catseye_lane::road_shape::options::{RoadShapeOptions, Source, Task};
use catseye_lane::road_shape::{EdgeStatus, HoughSettings, RoadShape, Side, VoteMap};

const METHOD: &str = "road-shape";

/// Data kept of one look.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Kept {
    points: Vec<LanePoint>,
    image: Option<KeptImage>,
}

impl LaneMethod for RoadShapeOptions {
    fn trial(&self, given: &TrialContext<'_>) -> Result<Trial> {
        self.check()?;
        match self.task {
            Task::Edges => drives(given, self),
            Task::Corners => corners::run(given, self),
        }
    }

    fn ready(&self, _: &TrialContext<'_>, drive: &Drive<'_>, _: u32) -> Result<Vec<(String, ReadyMethod)>> {
        let (which, by_image) = chosen(&drive.site.scenario.radars, self)?;
        let estimator = self.estimator(drive.radar(which), by_image)?;
        let mut ready = ReadyMethod { finds: Finds::RoadEdges, ..ReadyMethod::of_points(estimator, which) };
        if by_image {
            let mut imager = ImagePoints::new(drive.radar(which), self)?;
            ready.points = false;
            let sense = move |drive: &Drive<'_>, frame: Option<&Frame>, _, look: &mut OwnedInput| {
                if let (Some(frame), Some(speed), Some(yaw_rate)) =
                    (frame, look.speed_mps, look.yaw_rate_rad_per_s)
                {
                    let points = imager.look(drive, frame, [speed, yaw_rate], false)?.0;
                    look.points = points.into_iter().filter(kept_whole).collect();
                }
                Ok(())
            };
            ready.sense = Some(Box::new(sense));
        }
        Ok(vec![("road edges".into(), ready)])
    }
}

/// Data of one run: what the radar gave in all frames. The subspace tracker has memory, so a run is kept as a
/// whole.
fn seen(
    given: &TrialContext<'_>,
    run: u32,
    settings: &RoadShapeOptions,
    drive: &Drive<'_>,
    shown: u32,
) -> Result<Vec<Kept>> {
    let (which, by_image) = chosen(&drive.site.scenario.radars, settings)?;
    let mut imager = if by_image { Some(ImagePoints::new(drive.radar(which), settings)?) } else { None };
    let mut bus = bus_of(drive.site.scenario.seed, settings);
    let mut out = Vec::new();
    for index in 0..drive.frames() {
        let frame = drive.frame(which, index)?;
        let read = bus.read(&drive.level(drive.time_s(index)));
        let (points, image) = match &mut imager {
            Some(imager) => imager.look(drive, &frame, read, run == 0 && index == shown)?,
            None => (drive.points(&frame), None),
        };
        out.push(Kept { points: points.into_iter().filter(kept_whole).collect(), image });
        given.report_frame(run, index, drive.frames());
    }
    Ok(out)
}

fn bus_of(seed: u64, s: &RoadShapeOptions) -> Bus {
    Bus::new(seed, [s.speed_std_mps, 0.0], (draws(seed ^ 0x0079_6177, 0x5eed), s.yaw_rate_std_deg_per_s))
}

/// Counts of one run in addition to its steps.
#[derive(Default)]
struct Tally {
    /// Number of looks in which each edge, right and left, is stated, and of those in which it exists.
    stated: [[f64; 2]; 2],
    /// Number of moving vehicles that are found among the moving points by range and range rate, and of all
    /// within reach.
    cars: [f64; 2],
    /// Errors of their directions, degrees.
    directions: Vec<f64>,
    /// Number of stationary points on moving vehicles, and of all stationary points.
    taken: [f64; 2],
    /// Lateral errors of right and left at the scored distances, by the filter and by the vote alone, m.
    lateral: [Vec<(usize, f64)>; 2],
    vote: Vec<(usize, f64)>,
    /// Largest tracked and true curvature, 1/m.
    curvature: [f64; 2],
    /// Squared curvature errors divided by their variances.
    surprise: Vec<f64>,
}

/// True state of a moving vehicle.
#[derive(Debug, Clone, Copy)]
struct Car {
    /// Position of its middle in the level frame, m.
    at_m: [f64; 2],
    /// Range from the radar, m.
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

/// Lateral position of a polyline at a distance ahead, m.
fn lateral_at(line: &[[f64; 2]], x: f64) -> Option<f64> {
    let w = line.windows(2).find(|w| w[0][0] <= x && w[1][0] > x)?;
    Some(w[0][1] + (w[1][1] - w[0][1]) * (x - w[0][0]) / (w[1][0] - w[0][0]))
}

/// Distances at which lateral errors are stated, m.
const AHEAD_M: [f64; 3] = [20.0, 40.0, 60.0];

fn drives(given: &TrialContext<'_>, settings: &RoadShapeOptions) -> Result<Trial> {
    let mut trial = Trial::new(METHOD, format!("Road shape: {}", given.scenario.name));
    let mut tallies = Vec::new();
    let count = given.scenario.frames.count;
    let shown = settings.picture_frame.unwrap_or(count / 2).min(count.saturating_sub(1));
    let columns =
        "run frame time_s side state c0_per_m c0_std_per_m c1_per_m2 b_m b_std_m true_b_m true_c0_per_m why";
    let mut estimates = Sheet::new("edges", columns);
    let mut nothing = false;
    for run in 0..given.runs {
        let site = Site::new(&given.scenario_of(run))?;
        let drive = Drive::new(&site, given.engine)?;
        let (which, by_image) = chosen(&site.scenario.radars, settings)?;
        let kept = given.kept(&format!("run{run}"), || seen(given, run, settings, &drive, shown))?;
        let mut estimator = settings.estimator(drive.radar(which), by_image)?;
        let hough = settings.setup(None).tracker.hough;
        let edges = Edges::of(&site.scene, site.road.as_ref());
        nothing |= edges.is_empty();
        let mut bus = bus_of(site.scenario.seed, settings);
        let mut tally = Tally::default();
        let mut tracked = Vec::new();
        for (index, k) in (0..).zip(&kept) {
            let time_s = drive.time_s(index);
            let level = drive.level(time_s);
            let truth = edges.truth(&level, [settings.from_m, settings.to_m]);
            let look = SensorInput { points: &k.points, ..look_of(time_s, bus.read(&level)) };
            let estimate = timed(|| estimator.estimate(&look));
            let near = edges.near(&level, settings.to_m + 20.0);
            let cars = vehicles(&drive, which, time_s);
            let shape = estimator.latest();
            let step = Step::new(run, index, estimate, truth);
            tally.edges(&step, &near, shape, &hough);
            if let Some(shape) = shape {
                tally.vehicles(shape, &cars, &k.points, settings.max_range_m);
                sheet(&mut estimates, &step, shape, &near);
            }
            let c0 = |side: Side| {
                let t = shape?.edge(side).filter(|t| t.status != EdgeStatus::Tentative)?;
                let c = t.filter.curvature_per_m(0.0);
                Some([c.value, c.std])
            };
            let edges_per_m = [c0(Side::Right), c0(Side::Left)];
            tracked.push(Tracked { time_s, truth_per_m: step.truth.curvature_per_m, edges_per_m });
            if run == 0 && index == shown {
                if let Some(image) = &k.image {
                    let picture = pictures::image(image, settings.max_range_m)?;
                    trial.pictures.push(("image".into(), picture));
                }
                if let Some(picture) = shape.map(|s| pictures::votes(s, &hough)).transpose()?.flatten() {
                    trial.pictures.push(("votes".into(), picture));
                }
                let at: Vec<[f64; 2]> = cars.iter().map(|c| c.at_m).collect();
                trial.pictures.push(("road".into(), pictures::road(&k.points, &step, shape, &at)?));
            }
            trial.steps.push(step);
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
        let why = "The scene has no wall, rail or fence along a road: there is nothing to detect.";
        trial.notes.push(why.into());
    }
    Ok(trial)
}

impl Tally {
    fn edges(&mut self, step: &Step, near: &NearEdges, shape: Option<&RoadShape>, hough: &HoughSettings) {
        let (estimate, truth): (&LaneEstimate, &TrueLanes) = (&step.estimate, &step.truth);
        let vote = shape.and_then(|s| VoteMap::new(&s.points, hough).ok());
        for (k, side) in [Side::Right, Side::Left].into_iter().enumerate() {
            let there = near.sides[k].iter().any(|l| l.iter().any(|p| p[0] > truth.range_m[0]));
            if !there {
                continue;
            }
            self.stated[k][1] += 1.0;
            let is_left = side == Side::Left;
            let line = estimate.lines.iter().find(|l| (l.fitted.curve.start_m[1] > 0.0) == is_left);
            self.stated[k][0] += f64::from(u8::from(line.is_some()));
            let votes = vote.as_ref().and_then(|v| v.edge(side).ok());
            for (i, x) in AHEAD_M.into_iter().enumerate() {
                let Some(y) = near.sides[k].iter().find_map(|l| lateral_at(l, x)) else { continue };
                if let Some(line) = line {
                    let foot = line.fitted.curve.foot(DVec2::new(x, y));
                    if foot.s_m <= line.fitted.curve.length_m {
                        self.lateral[k].push((i, foot.left_m));
                    }
                }
                if let Some(v) = votes.filter(|v| v.x_max_m >= x) {
                    self.vote.push((i, v.a_per_m * x * x + v.b_m - y));
                }
            }
            let track = shape.and_then(|s| s.edge(side)).filter(|t| t.status != EdgeStatus::Tentative);
            if let (Some(t), Some(c)) = (track, near.curvature_per_m[k]) {
                let e = t.filter.curvature_per_m(0.0);
                self.surprise.push(((e.value - c) / e.std.max(1e-9)).powi(2));
            }
        }
        let curvatures = [estimate.curvature_per_m.map(|c| c.value), truth.curvature_per_m];
        for (most, c) in self.curvature.iter_mut().zip(curvatures) {
            *most = c.map_or(*most, |c| most.max(c.abs()));
        }
    }

    fn vehicles(&mut self, shape: &RoadShape, cars: &[Car], points: &[LanePoint], far_m: f64) {
        // A body of some 4.6 m by 1.8 m, and what the deviations allow.
        let on = |p: [f64; 2], c: &[f64; 2]| (p[0] - c[0]).abs() < 3.3 && (p[1] - c[1]).abs() < 1.4;
        let standing = shape.points.iter().filter(|p| cars.iter().any(|c| on([p.x_m, p.y_m], &c.at_m)));
        self.taken[0] += standing.count() as f64;
        self.taken[1] += shape.points.len() as f64;
        for c in cars.iter().filter(|c| c.at_m[0] > 5.0 && c.range_m < far_m) {
            self.cars[1] += 1.0;
            // Its rear stands before its middle, and what a mirror adds behind.
            let is_it = |p: &&LanePoint| {
                (p.range_m - c.range_m).abs() < 3.5 && (p.range_rate_mps - c.range_rate_mps).abs() < 1.5
            };
            let strongest = points.iter().filter(is_it).max_by(|a, b| a.snr_db.total_cmp(&b.snr_db));
            if let Some(p) = strongest {
                self.cars[0] += 1.0;
                self.directions.push((p.azimuth_rad - c.azimuth_rad).to_degrees());
            }
        }
    }
}

fn rows(trial: &mut Trial, tallies: &[Tally], settings: &RoadShapeOptions) {
    let share = |of: &dyn Fn(&Tally) -> [f64; 2]| -> Vec<f64> {
        tallies.iter().map(of).filter(|v| v[1] > 0.0).map(|v| 100.0 * v[0] / v[1]).collect()
    };
    let rms =
        |of: &dyn Fn(&Tally) -> Vec<f64>| -> Vec<f64> { tallies.iter().filter_map(|t| rms(of(t))).collect() };
    let at = |errors: &[(usize, f64)], i: usize| errors.iter().filter(|e| e.0 == i).map(|e| e.1).collect();
    let mut more = Vec::new();
    for (k, name) in ["right", "left"].into_iter().enumerate() {
        let row = more.mean(format!("{name} edge stated"), "%", &share(&|t| t.stated[k]));
        if k == 0 {
            row.why("of the frames in which there is one; the first frames confirm it");
        }
    }
    for (i, x) in AHEAD_M.iter().enumerate() {
        for (k, name) in ["right", "left"].into_iter().enumerate() {
            let error = rms(&|t| at(&t.lateral[k], i));
            more.mean(format!("{name} edge, lateral error at {x} m (rms)"), "m", &error);
        }
    }
    for (i, x) in AHEAD_M.iter().enumerate() {
        let error = rms(&|t| at(&t.vote, i));
        let row = more.mean(format!("vote alone, lateral error at {x} m (rms)"), "m", &error);
        if i == 0 {
            row.why("both edges, scan by scan, as the document draws them");
        }
    }
    let largest = |i: usize| tallies.iter().map(|t| t.curvature[i]).collect::<Vec<_>>();
    let row = more.mean("largest tracked curvature", "1/m", &largest(0));
    if let Some(c) = settings.document_curvature_per_m {
        row.document(c).why("the document's road is not known otherwise; ours is the row below");
    }
    more.mean("largest true curvature", "1/m", &largest(1));
    let surprise = rms(&|t| t.surprise.iter().map(|s| s.sqrt()).collect());
    more.mean("tracked curvature, error over its stated deviation (rms)", "", &surprise)
        .why("1 where the deviations are right");
    more.mean("moving vehicles found by range and speed", "%", &share(&|t| t.cars))
        .why("of those within reach, including hidden ones");
    more.mean("direction of a moving vehicle, error (rms)", "deg", &rms(&|t| t.directions.clone()))
        .why("its beat frequency also contains a stretch of wall: five elements separate no more than two");
    more.mean("static points that are on moving vehicles", "%", &share(&|t| t.taken))
        .why("most of the vehicles' peaks are eliminated, the document says");
    let used = mean_of_runs(&trial.steps, |s| Some(s.estimate.provenance.used as f64));
    let given = mean_of_runs(&trial.steps, |s| Some(s.estimate.provenance.given as f64));
    more.mean("points in a frame", "", &given);
    more.mean("points on the edges", "", &used);
    more.retain(|r| r.ours.is_some());
    trial.rows.extend(more);
}

fn sheet(sheet: &mut Sheet, step: &Step, shape: &RoadShape, near: &NearEdges) {
    let time = format!("{:.4}", step.estimate.time_s);
    let small = |v: f64| format!("{v:.4e}");
    for (k, side) in [Side::Right, Side::Left].into_iter().enumerate() {
        let why = shape.fits[side as usize].as_ref().err().map_or_else(String::new, ToString::to_string);
        let mut cells: [String; 6] = Default::default();
        cells[0] = "none".into();
        if let Some(t) = shape.edge(side) {
            let ([c0, c1, b], p) = (t.filter.state(), t.filter.covariance());
            let state = format!("{:?}", t.status).to_lowercase();
            let [b, b_std] = [b, p[2][2].sqrt()].map(|v| fixed(Some(v), 6));
            cells = [state, small(c0), small(p[0][0].sqrt()), small(c1), b, b_std];
        }
        let true_b = fixed(near.sides[k].iter().find_map(|l| lateral_at(l, 0.0)), 6);
        let true_c0 = near.curvature_per_m[k].map_or_else(String::new, small);
        let mut row = vec![step.run.to_string(), step.frame.to_string(), time.clone(), side.to_string()];
        row.extend(cells);
        row.extend([true_b, true_c0, why]);
        sheet.rows.push(row);
    }
}
