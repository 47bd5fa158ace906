//! Rows of markers in a driven scenario (Feng 2019, section 5.1; fig. 5.1 to 5.4 and 4.13).

mod level;
mod looks;
mod pictures;
mod tally;

use crate::trial::kit::*;
use crate::trial::markers::looks::{Kept, MarkerLook, excess_db, of_runs, tally_within};
use crate::trial::markers::tally::{Tally, View, markers_in_view, tally, truth_in_view};
use catseye::scene::radar::AngleMethod;
pub use catseye_lane::markers::MarkersOptions;
use catseye_lane::markers::{MarkerPattern, MarkerSearch, Markers};

/// Angular distance from the edge of the grid within which points are left out, rad.
const EDGE_RAD: f64 = 0.01;
/// Level that files hold for points without an echo, dBsm.
const NO_LEVEL_DBSM: f64 = -300.0;

impl LaneMethod for MarkersOptions {
    fn trial(&self, given: &TrialContext<'_>) -> Result<Trial> {
        self.check_in_scenario()?;
        let scenario = given.scenario;
        let found = point_radar(&scenario.radars);
        let allowed = "a radar that measures points: fmcw, stepped or coded, with two channels or more";
        let which = needed(found, given, "markers", allowed, "use radar = \"feng77\"")?;
        let radar = &scenario.radars[which];
        if radar.virtual_channels() < 2 {
            let bad = BadInput::new("has one channel, which cannot measure directions")
                .file(given.path)
                .key("radar");
            let bad = bad.value(&radar.name).allowed("two channels or more side by side");
            return Err(bad.remedy("add [[rx]] to the radar").into());
        }
        let site = Site::new(&given.scenario_of(0))?;
        let search = self.search_with(radar, site.road.as_ref())?;
        let levels = level::of_first_row(given, &site, radar)?;
        // The levels are shown whether they are checked or not.
        let shown = MarkerSearch { rcs: levels, ..search };
        let options = MarkerSearch { rcs: shown.rcs.clone().filter(|_| self.levels), ..shown.clone() };
        let view = View::of(radar, self.reach_m, self.nearest_m);
        let mut seen: Vec<MarkerLook> = Vec::new();
        for run in 0..given.runs {
            let site = Site::new(&given.scenario_of(run))?;
            let drive = Drive::new(&site, given.engine)?;
            let seed = site.scenario.seed;
            let sensor = |std: Option<f64>, seed: u64| std.map(|std| BusSensor::new(seed, std, 0.0));
            let yaw_rate_std = self.bus_yaw_rate_std_deg_per_s.map(f64::to_radians);
            let mut looks = MarkerDrive {
                settings: self,
                view: &view,
                estimator: Markers::new(options.clone()),
                speed: sensor(self.bus_speed_std_mps, seed),
                yaw_rate: sensor(yaw_rate_std, seed.wrapping_add(0x9e37)),
                seen: &mut seen,
            };
            drive_through(given, (&drive, which), (run, drive.frames()), &mut looks)?;
        }
        let title = format!("{}: rows of markers", scenario.name);
        let mut trial = Trial::new(catseye_lane::markers::METHOD, title);
        trial.steps = seen.iter().map(|s| s.step.clone()).collect();
        trial.rows = common_rows(&trial.steps);
        rows(&mut trial.rows, &seen, &shown);
        trial.sheets = vec![
            looks_sheet(&seen, &options),
            by_range(&seen, self, &view),
            robustness(&seen, &options, self, &view),
        ];
        trial.notes = notes(&options, self, radar);
        if let Some(best) = pictured(&seen, self) {
            let site = Site::new(&given.scenario_of(best.step.run))?;
            let drive = Drive::new(&site, given.engine)?;
            trial.pictures = pictures::pictures(given, (&drive, which), best, &seen, &shown, &view)?;
        }
        Ok(trial)
    }

    fn ready(
        &self,
        given: &TrialContext<'_>,
        drive: &Drive<'_>,
        _: u32,
    ) -> Result<Vec<(String, ReadyMethod)>> {
        let which = chirp_radar(given, "markers")?;
        let radar = drive.radar(which);
        let search = self.search_with(radar, drive.site.road.as_ref())?;
        let rcs = if self.levels { level::of_first_row(given, drive.site, radar)? } else { None };
        let options = MarkerSearch { rcs, ..search };
        Ok(ReadyMethod::of_points(Markers::new(options), which).alone())
    }
}

/// The looks of one drive.
struct MarkerDrive<'a> {
    settings: &'a MarkersOptions,
    view: &'a View,
    estimator: Markers,
    speed: Option<BusSensor>,
    yaw_rate: Option<BusSensor>,
    seen: &'a mut Vec<MarkerLook>,
}

impl Looks for MarkerDrive<'_> {
    type Kept = Kept;

    fn keep(&self, now: &Now<'_>, frame: &Frame) -> Kept {
        let radar = now.drive.radar(frame.radar);
        // At the edge of the view a direction is only a bound.
        let edge_rad = radar.processing.azimuth_fov_rad - EDGE_RAD;
        let inside = frame.points.iter().filter(|p| p.azimuth_rad.abs() < edge_rad);
        let of = inside.filter_map(|p| {
            let point = lane_point(radar, p)?;
            // Beyond the antennas' view levels are infinite, which files do not hold.
            let rcs_dbsm = if point.rcs_dbsm.is_finite() { point.rcs_dbsm } else { NO_LEVEL_DBSM };
            Some((LanePoint { rcs_dbsm, ..point }, p.class.clone()))
        });
        let (points, classes) = of.unzip();
        Kept { points, classes }
    }

    fn look(&mut self, now: &Now<'_>, kept: Kept) -> Result<()> {
        let Now { drive, run, frame, time_s, level } = *now;
        let look = SensorInput {
            time_s,
            speed_mps: self.speed.as_mut().map(|s| s.read(level.speed_mps)),
            yaw_rate_rad_per_s: self.yaw_rate.as_mut().map(|s| s.read(level.yaw_rate_rad_per_s)),
            points: &kept.points,
            ..SensorInput::default()
        };
        let (estimate, seconds) = timed(|| self.estimator.estimate(&look));
        let single = self.estimator.by_itself.clone().unwrap_or_else(|| estimate.clone());
        let markers = markers_in_view(drive, time_s, self.view);
        let every_marker = drive.markers(time_s);
        let within_m = self.settings.within_m;
        self.seen.push(MarkerLook {
            tally: tally(&single, &kept.points, &markers, &every_marker, self.view, within_m),
            kept,
            single,
            steps: self.estimator.steps.clone(),
            markers,
            every_marker,
            true_speed_mps: level.speed_mps,
            true_yaw_rate: level.yaw_rate_rad_per_s,
            step: Step::new(run, frame, (estimate, seconds), truth_in_view(drive, time_s, self.view)),
        });
        Ok(())
    }
}

/// The look that pictures show.
fn pictured<'a>(seen: &'a [MarkerLook], settings: &MarkersOptions) -> Option<&'a MarkerLook> {
    let first = || seen.iter().filter(|s| s.step.run == 0);
    match settings.picture_frame {
        Some(f) => first().find(|s| s.step.frame == f).or_else(|| first().next()),
        None => first().max_by_key(|s| (s.single.provenance.used, std::cmp::Reverse(s.step.frame))),
    }
}

/// The document's values beside those of the trial.
fn rows(out: &mut Vec<Row>, seen: &[MarkerLook], options: &MarkerSearch) {
    let before = out.len();
    let rms_of =
        |of: &dyn Fn(&MarkerLook) -> Option<f64>| of_runs(seen, |run| rms(run.iter().filter_map(|s| of(s))));
    let mean_of =
        |of: &dyn Fn(&MarkerLook) -> Option<f64>| of_runs(seen, |run| mean(run.iter().filter_map(|s| of(s))));
    let speed = rms_of(&|s| Some(s.steps.motion?.velocity_mps[0] - s.true_speed_mps));
    out.mean("ego speed from the points, error (rms)", "m/s", &speed).document(0.19).why(
        "fig. 5.2 reads the edge of the clutter, 4.65 for 4.46 m/s; here all static points with their angles",
    );
    let ahead = options.radar_ahead_m;
    if ahead.abs() > 0.5 {
        let yaw = rms_of(&|s| Some(s.steps.motion?.velocity_mps[1] / ahead - s.true_yaw_rate));
        let yaw: Vec<f64> = yaw.iter().map(|y| y.to_degrees()).collect();
        out.mean("yaw rate from the points, error (rms)", "deg/s", &yaw);
    }
    // Of the markers over each run, in percent.
    let share = |of: fn(&Tally) -> Option<f64>| {
        of_runs(seen, |run| {
            let mut sum = Tally::default();
            run.iter().for_each(|s| sum.add(&s.tally));
            of(&sum).map(|x| 100.0 * x)
        })
    };
    out.mean("markers in view with a point within reach of them", "%", &share(Tally::detected_share))
        .why("limited by the radar: rows that fall into one cell and are not separated appear elsewhere");
    out.mean("markers in view that a line has (recall)", "%", &share(Tally::recall));
    out.mean("of the markers with a point those that a line has", "%", &share(Tally::of_detected));
    out.mean("members of lines that are markers (precision)", "%", &share(Tally::precision));
    let grouped = mean_of(&|s| Some(s.steps.grouped.len() as f64));
    out.mean("points in groups at the spacing, {p1}", "", &grouped);
    let is_dense = |s: &MarkerLook, i: &usize| s.steps.dense.contains(i);
    let dense = mean_of(&|s| Some(s.steps.grouped.iter().filter(|i| is_dense(s, i)).count() as f64));
    out.mean("of those in denser groups, {p1} and {p2}", "", &dense);
    out.mean("points left, {p}", "", &mean_of(&|s| Some(s.steps.left.len() as f64)))
        .document(19.0)
        .why("fig. 5.3c, another field: both rows together, of the first spacing");
    let is_marker = |s: &MarkerLook, i: usize| s.kept.classes.get(i).is_some_and(|c| c == "marker");
    let echoes = mean_of(&|s| Some(s.steps.left.iter().filter(|i| is_marker(s, **i)).count() as f64));
    out.mean("of those echoes of markers", "", &echoes);
    let of_line =
        of_runs(seen, |run| mean(run.iter().flat_map(|s| &s.single.lines).map(|l| l.members.len() as f64)));
    out.mean("points of a line", "", &of_line)
        .document(7.0)
        .why("fig. 5.3e: the peaks of its Hough transform; lines here also take what lies beside its cells");
    if options.rcs.is_some() {
        let estimator = Markers::new(options.clone());
        let over = |s: &MarkerLook| excess_db(s, &estimator);
        let middle = of_runs(seen, |run| {
            mean(run.iter().flat_map(|s| over(s)).flatten().map(|(_, seen, expected)| expected - seen))
        });
        out.mean("expected cross section of a row's markers over the measured", "dB", &middle)
            .document(-7.5)
            .why("fig. 5.4d: its estimates lie 5 to 10 dB under the measured; ours are in free space, without the road's mirror image");
        let spread = of_runs(seen, |run| {
            rms(run.iter().flat_map(|s| over(s)).filter(|l| l.len() > 2).flat_map(|l| {
                let m = mean(l.iter().map(|(_, a, b)| a - b)).unwrap_or(0.0);
                l.into_iter().map(move |(_, a, b)| a - b - m)
            }))
        });
        out.mean("deviation of the cross sections from the expected ones (rms)", "dB", &spread)
            .why("rows in one cell share its power; with lane.markers.levels = true members that deviate by 8 dB are removed");
    }
    out.mean("width between the rows", "m", &mean_of(&|s| Some(s.step.estimate.width_m?.value)));
    // What following the lines over frames changes.
    let alone = rms_of(&|s| Some(s.single.offset_m?.value - s.step.truth.offset_m?));
    out.mean("offset error of a single frame (rms)", "m", &alone);
    if options.track.is_some() {
        let followed = rms_of(&|s| s.step.score.offset_error_m);
        out.mean("offset error of lines tracked over frames (rms)", "m", &followed);
    }
    let mut index = 0..;
    out.retain(|r| index.next() < Some(before) || r.ours.is_some());
}

fn looks_sheet(seen: &[MarkerLook], options: &MarkerSearch) -> Sheet {
    let columns = "run frame time_s points at_rest grouped dense left paths rows_by_hough lines markers detected found \
                   members right speed_mps true_speed_mps yaw_rate_deg_per_s true_yaw_rate_deg_per_s";
    let mut sheet = Sheet::new("looks", columns);
    for s in seen {
        let (t, e) = (&s.tally, &s.steps);
        let points = [s.kept.points.len(), e.at_rest.len(), e.grouped.len(), e.dense.len(), e.left.len()];
        let lines = [e.paths.len(), e.by_hough.len(), s.single.lines.len()];
        let counts = [t.markers, t.detected, t.found, t.members, t.right];
        let [ahead, aside] = [0, 1].map(|k| e.motion.map(|m| m.velocity_mps[k]));
        let yaw_rate = aside.map(|v| (v / options.radar_ahead_m.max(1e-3)).to_degrees());
        let mut row = vec![s.step.run.to_string(), s.step.frame.to_string(), format!("{:.4}", s.time_s())];
        row.extend(points.iter().chain(&lines).chain(&counts).map(usize::to_string));
        row.extend([ahead, Some(s.true_speed_mps)].map(|v| fixed(v, 5)));
        row.extend([yaw_rate, Some(s.true_yaw_rate.to_degrees())].map(|v| fixed(v, 4)));
        sheet.rows.push(row);
    }
    sheet
}

fn by_range(seen: &[MarkerLook], settings: &MarkersOptions, view: &View) -> Sheet {
    let mut sheet = Sheet::new("by_range", "from_m to_m markers detected found recall precision");
    let edges = [0.0f64, 10.0, 15.0, 20.0, 25.0, 30.0, 40.0, 60.0];
    for w in edges.windows(2) {
        let ring = view.ring([w[0], w[1]]);
        let [from, to] = ring.reach_m;
        if from >= to {
            continue;
        }
        let t = tally_within(seen, &ring, settings.within_m);
        let (recall, precision) = (fixed(t.recall(), 4), fixed(t.precision(), 4));
        sheet.row(&[&from, &to, &t.markers, &t.detected, &t.found, &recall, &precision]);
    }
    sheet
}

/// Recall and precision when points are removed and added after the chain.
fn robustness(seen: &[MarkerLook], options: &MarkerSearch, settings: &MarkersOptions, view: &View) -> Sheet {
    let columns = "missing_share extra_points hough recall precision looks_with_two_lines";
    let mut sheet = Sheet::new("robustness", columns).noted(
        "# Points were removed at random, and static points were added at random over 5 to 40 m ahead, 10 m to each side, after the chain.",
    );
    let mut cases: Vec<(f64, u32)> = settings.missing_share.iter().map(|m| (*m, 0)).collect();
    cases.extend(settings.extra_points.iter().filter(|n| **n > 0).map(|n| (0.0, *n)));
    if let (Some(m), Some(n)) = (settings.missing_share.get(1), settings.extra_points.get(1)) {
        cases.push((*m, *n));
    }
    for (missing, extra) in cases {
        for hough in [false, true] {
            let patterns = options.patterns.iter().map(|o| MarkerPattern { hough, ..*o });
            let alone = MarkerSearch { patterns: patterns.collect(), track: None, ..options.clone() };
            let (mut sum, mut two) = (Tally::default(), 0);
            for s in seen {
                let points = injected(s, missing, extra);
                let mut estimator = Markers::new(alone.clone());
                let look = SensorInput { time_s: s.time_s(), points: &points, ..SensorInput::default() };
                let e = estimator.estimate(&look);
                two += usize::from(e.lines.len() >= 2);
                sum.add(&tally(&e, &points, &s.markers, &s.every_marker, view, settings.within_m));
            }
            let share = Some(two as f64 / seen.len().max(1) as f64);
            let [recall, right, both] = [sum.recall(), sum.precision(), share].map(|v| fixed(v, 4));
            sheet.row(&[&missing, &extra, &u8::from(hough), &recall, &right, &both]);
        }
    }
    sheet
}

/// The points of a look with some removed and some false ones added.
fn injected(s: &MarkerLook, missing: f64, extra: u32) -> Vec<LanePoint> {
    let mut draws = Draws::new(s.step.run * 1009 + s.step.frame, 0x006d_6b72);
    let mut points: Vec<LanePoint> =
        s.kept.points.iter().copied().filter(|_| draws.uniform() >= missing).collect();
    let Some(motion) = s.steps.motion else { return points };
    let levels: Vec<f64> = s.kept.points.iter().map(|p| p.rcs_dbsm).collect();
    for _ in 0..extra {
        let at = [5.0 + 35.0 * draws.uniform(), 20.0 * draws.uniform() - 10.0];
        let Some(like) = s.kept.points.first() else { break };
        let radar = DVec2::from_array(like.at_m) - DVec2::from_angle(like.azimuth_rad) * like.range_m;
        let d = DVec2::from_array(at) - radar;
        let due = motion.towards(d.to_angle());
        points.push(LanePoint {
            at_m: at,
            std_m: [0.01, 0.005 * d.length()],
            range_rate_mps: -due.value,
            range_rate_std_mps: 1e-3,
            range_m: d.length(),
            azimuth_rad: d.to_angle(),
            rcs_dbsm: levels[(draws.uniform() * levels.len() as f64) as usize],
            snr_db: 20.0,
            power_dbm: None,
        });
    }
    points
}

fn notes(options: &MarkerSearch, settings: &MarkersOptions, radar: &Radar) -> Vec<String> {
    let spacings: Vec<String> = options.patterns.iter().map(|p| format!("{} m", p.spacing_m)).collect();
    let mut out = vec![format!(
        "Rows are searched at spacings of {} with a tolerance of {} m; lines and markers count from {} to {} m in the radar's view.",
        spacings.join(" and "),
        settings.tolerance_m,
        settings.reach_m[0],
        settings.reach_m[1]
    )];
    out.push(match settings.bus_speed_std_mps {
        None => "The vehicle's speed comes from the points.".into(),
        Some(std) => format!("The bus reports the vehicle's speed with a standard deviation of {std} m/s."),
    });
    if matches!(radar.processing.angle.method, AngleMethod::Bartlett) {
        out.push(
            "The radar's beamformer gives one direction for each cell: markers at equal distance on the left and on the right give one point between them. An angle method with sources = \"residual\" separates them."
                .into(),
        );
    }
    out
}
