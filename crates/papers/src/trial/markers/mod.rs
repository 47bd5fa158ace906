//! Rows of markers in a driven scenario (Feng 2019, section 5.1; fig. 5.1 to 5.4 and 4.13).

mod level;

mod looks;

mod pictures;

mod ready;

mod settings;

mod tally;

use crate::trial::context::TrialContext;
use crate::trial::drive::{Drive, lane_point, suitable};
use crate::trial::markers::looks::{Kept, MarkerLook, excess_db, is_marker, of_runs};
use crate::trial::markers::tally::{Tally, View, markers_in_view, tally, truth_in_view};
use crate::trial::report::{Row, Sheet, Step, Trial, common_rows, rms_of_runs};
use crate::trial::sensors::SpeedSensor;
use crate::trial::stats::{mean, rms, timed};
use catseye::error::{BadInput, Result};
use catseye::rng::Draws;
use catseye::road::site::Site;
use catseye::scene::waveform::Waveform;
use catseye_lane::markers::{Markers, MarkersOptions};
use catseye_lane::track::TrackOptions;
use catseye_lane::{LaneEstimator, LanePoint, SensorInput};
pub(super) use ready::ready_method;
pub use settings::Settings;

/// Points so near the edge of the angular grid are left out, rad.
const EDGE_RAD: f64 = 0.01;
/// Levels of points without an echo that a file can hold, dBsm.
const NO_LEVEL_DBSM: f64 = -300.0;

/// Drives the scenario, looks for the rows of markers in each frame, and compares them with the rows that are there.
///
/// Errors: a radar without directions; no spacing; those of the chain.
pub fn run(given: &TrialContext<'_>, settings: &Settings) -> Result<Trial> {
    settings.check()?;
    let scenario = given.scenario;
    let Some(which) = suitable(&scenario.radars, |w| !matches!(w, Waveform::Pulse { .. })) else {
        return Err(BadInput::new("has impulse radars only, which give no points")
            .file(given.path)
            .key("radar")
            .remedy("take a radar with chirps and several channels, as in radar = \"feng77\"")
            .into());
    };
    let radar = &scenario.radars[which];
    let directions = radar.virtual_channels();
    if directions < 2 {
        return Err(BadInput::new("has one channel, which tells no directions")
            .file(given.path)
            .key("radar")
            .value(&radar.name)
            .allowed("two channels or more side by side")
            .remedy("add [[rx]] to the radar")
            .into());
    }
    let site = Site::new(&given.scenario_of(0))?;
    let patterns = settings.patterns(radar, site.road.as_ref())?;
    let levels = level::of_first_row(given, &site, radar)?;
    let options = MarkersOptions {
        patterns,
        track: settings.track.then(TrackOptions::default),
        radar_ahead_m: radar.mounting.translation_m.x,
        rcs: levels.clone().filter(|_| settings.levels),
    };
    // The levels are shown whether they are checked or not.
    let shown = MarkersOptions { rcs: levels, ..options.clone() };
    let view = View::of(radar, settings.reach_m, settings.nearest_m);
    let mut steps: Vec<Step> = Vec::new();
    let mut seen: Vec<MarkerLook> = Vec::new();
    let all = u64::from(given.runs) * u64::from(scenario.frames.count);
    for run in 0..given.runs {
        let site = Site::new(&given.scenario_of(run))?;
        let drive = Drive::new(&site, given.engine)?;
        let mut estimator = Markers::new(options.clone());
        let seed = site.scenario.seed;
        let mut bus = settings.bus_speed_std_mps.map(|std| SpeedSensor::new(seed, std, 0.0));
        let mut gyro = settings
            .bus_yaw_rate_std_deg_per_s
            .map(|std| SpeedSensor::new(seed.wrapping_add(0x9e37), std.to_radians(), 0.0));
        for index in 0..drive.frames() {
            let kept = given.kept(&format!("run{run}_frame{index}"), || points_of(&drive, which, index))?;
            let time_s = drive.time_s(index);
            let level = drive.level(time_s);
            let speed_mps = bus.as_mut().map(|b| b.read(level.speed_mps));
            let yaw_rate = gyro.as_mut().map(|g| g.read(level.yaw_rate_rad_per_s));
            let look = SensorInput {
                time_s,
                speed_mps,
                yaw_rate_rad_per_s: yaw_rate,
                points: &kept.points,
                ..SensorInput::default()
            };
            let (estimate, seconds) = timed(|| estimator.estimate(&look));
            let truth = truth_in_view(&drive, time_s, &view);
            let single = estimator.by_itself.clone().unwrap_or_else(|| estimate.clone());
            let markers = markers_in_view(&drive, time_s, &view);
            let every_marker: Vec<[f64; 2]> = drive.rows(time_s).into_iter().flat_map(|r| r.1).collect();
            let counted = tally(&single, &kept.points, &markers, &every_marker, &view, settings.within_m);
            seen.push(MarkerLook {
                run,
                frame: index,
                time_s,
                kept,
                single,
                followed: estimate.clone(),
                steps: estimator.steps.clone(),
                tally: counted,
                markers,
                every_marker,
                true_speed_mps: level.speed_mps,
                true_yaw_rate: level.yaw_rate_rad_per_s,
            });
            steps.push(Step::new(run, index, (estimate, seconds), truth));
            (given.watch)(steps.len() as u64, all);
        }
    }
    let mut trial = Trial::new(catseye_lane::markers::METHOD, format!("{}: rows of markers", scenario.name));
    trial.rows = common_rows(&steps);
    trial.rows.extend(rows(&steps, &seen, &shown));
    trial.sheets = sheets(&seen, &options, settings, &view);
    trial.notes = notes(&options, settings, radar);
    if let Some(best) = pictured(&seen, settings) {
        let site = Site::new(&given.scenario_of(best.run))?;
        let drive = Drive::new(&site, given.engine)?;
        trial.pictures = pictures::pictures(given, &drive, which, best, &seen, &shown, &view, &steps)?;
    }
    trial.steps = steps;
    Ok(trial)
}

fn points_of(drive: &Drive<'_>, which: usize, index: u32) -> Result<Kept> {
    let frame = drive.frame(which, index)?;
    let mut kept = Kept { points: Vec::new(), classes: Vec::new() };
    // At the edge of the view a direction is only a bound.
    let edge_rad = drive.radar(which).processing.azimuth_fov_rad - EDGE_RAD;
    for p in frame.points.iter().filter(|p| p.azimuth_rad.abs() < edge_rad) {
        if let Some(mut point) = lane_point(drive.radar(which), p) {
            // Beyond the antennas' view levels are infinite, which files do not hold.
            if !point.rcs_dbsm.is_finite() {
                point.rcs_dbsm = NO_LEVEL_DBSM;
            }
            kept.points.push(point);
            kept.classes.push(p.class.clone());
        }
    }
    Ok(kept)
}

/// The look that pictures show.
fn pictured<'a>(seen: &'a [MarkerLook], settings: &Settings) -> Option<&'a MarkerLook> {
    let first = || seen.iter().filter(|s| s.run == 0);
    match settings.picture_frame {
        Some(f) => first().find(|s| s.frame == f).or_else(|| first().next()),
        None => first().max_by_key(|s| (s.single.provenance.used, std::cmp::Reverse(s.frame))),
    }
}

/// A share of the markers over each run, in percent.
fn share(seen: &[MarkerLook], of: impl Fn(&Tally) -> Option<f64>) -> Vec<f64> {
    of_runs(seen, |run| {
        let mut sum = Tally::default();
        run.iter().for_each(|s| sum.add(&s.tally));
        of(&sum).map(|x| 100.0 * x)
    })
}

/// The document's figures, and ours.
fn rows(steps: &[Step], seen: &[MarkerLook], options: &MarkersOptions) -> Vec<Row> {
    let speed = of_runs(seen, |run| {
        rms(run.iter().filter_map(|s| Some(s.steps.motion?.velocity_mps[0] - s.true_speed_mps)))
    });
    let mut out = vec![
        Row::mean("ego speed from the points, error (rms)", "m/s", &speed).document(0.19).why(
            "fig. 5.2 reads the edge of the clutter, 4.65 for 4.46 m/s; here all points at rest with their angles",
        ),
    ];
    let ahead = options.radar_ahead_m;
    if ahead.abs() > 0.5 {
        let yaw = of_runs(seen, |run| {
            rms(run.iter().filter_map(|s| Some(s.steps.motion?.velocity_mps[1] / ahead - s.true_yaw_rate)))
        });
        let yaw: Vec<f64> = yaw.iter().map(|y| y.to_degrees()).collect();
        out.push(Row::mean("yaw rate from the points, error (rms)", "deg/s", &yaw));
    }
    out.extend([
        Row::mean(
            "markers in view with a point within reach of them",
            "%",
            &share(seen, Tally::detected_share),
        )
        .why("what the radar gives: rows that fall into one cell and are not parted stand elsewhere"),
        Row::mean("markers in view that a line has (recall)", "%", &share(seen, Tally::recall)),
        Row::mean("of the markers with a point those that a line has", "%", &share(seen, Tally::of_detected)),
        Row::mean("members of lines that are markers (precision)", "%", &share(seen, Tally::precision)),
    ]);
    let marker = |s: &MarkerLook, list: &[usize]| list.iter().filter(|i| is_marker(s, **i)).count() as f64;
    type Count<'a> = &'a dyn Fn(&MarkerLook) -> f64;
    let counts: [(&str, Count<'_>); 4] = [
        ("points in groups at the spacing, {p1}", &|s| s.steps.grouped.len() as f64),
        ("of those in denser groups, {p1} and {p2}", &|s| {
            s.steps.grouped.iter().filter(|i| s.steps.dense.contains(i)).count() as f64
        }),
        ("points left, {p}", &|s| s.steps.left.len() as f64),
        ("of those echoes of markers", &|s| marker(s, &s.steps.left)),
    ];
    for (name, of) in counts {
        out.push(Row::mean(name, "", &of_runs(seen, |run| mean(run.iter().map(|s| of(s))))));
    }
    let at = out.len() - 2;
    out[at] = out[at]
        .clone()
        .document(19.0)
        .why("fig. 5.3c, another field: both rows together, of the first spacing");
    let of_line =
        of_runs(seen, |run| mean(run.iter().flat_map(|s| &s.single.lines).map(|l| l.members.len() as f64)));
    out.push(
        Row::mean("points of a line", "", &of_line).document(7.0).why(
            "fig. 5.3e: the peaks of its Hough transform; lines here also take what lies beside its cells",
        ),
    );
    if options.rcs.is_some() {
        let estimator = Markers::new(options.clone());
        let over = |s: &MarkerLook| excess_db(s, &estimator);
        let middle = of_runs(seen, |run| {
            mean(run.iter().flat_map(|s| over(s)).flatten().map(|(_, seen, expected)| expected - seen))
        });
        out.push(
            Row::mean("expected level of a row's markers over the seen", "dB", &middle)
                .document(-7.5)
                .why("fig. 5.4d: its estimates lie 5 to 10 dB under the measured; ours are in free space, without the road's mirror image"),
        );
        let spread = of_runs(seen, |run| {
            rms(run.iter().flat_map(|s| over(s)).filter(|l| l.len() > 2).flat_map(|l| {
                let m = mean(l.iter().map(|(_, a, b)| a - b)).unwrap_or(0.0);
                l.into_iter().map(move |(_, a, b)| a - b - m)
            }))
        });
        out.push(
            Row::mean("spread of the levels round the expected ones (rms)", "dB", &spread).why(
                "rows in one cell share its power; with lane.markers.levels = true members off by 8 dB go",
            ),
        );
    }
    let width: Vec<f64> =
        of_runs(seen, |run| mean(run.iter().filter_map(|s| s.followed.width_m.map(|w| w.value))));
    out.push(Row::mean("width between the rows", "m", &width));
    // What following the lines over frames changes.
    let of_step = |s: &Step| s.score.offset_error_m;
    let followed = rms_of_runs(steps, of_step);
    let alone = of_runs(seen, |run| {
        rms(run.iter().filter_map(|s| {
            let step = steps.iter().find(|t| t.run == s.run && t.frame == s.frame)?;
            Some(s.single.offset_m?.value - step.truth.offset_m?)
        }))
    });
    out.push(Row::mean("offset error of a look by itself (rms)", "m", &alone));
    if options.track.is_some() {
        out.push(Row::mean("offset error of lines followed over looks (rms)", "m", &followed));
    }
    out.retain(|r| r.ours.is_some());
    out
}

fn sheets(seen: &[MarkerLook], options: &MarkersOptions, settings: &Settings, view: &View) -> Vec<Sheet> {
    let mut looks = Sheet::new(
        "looks",
        "run frame time_s points at_rest grouped dense left paths rows_by_hough lines markers \
             detected found members right speed_mps true_speed_mps yaw_rate_deg_per_s \
             true_yaw_rate_deg_per_s",
    );
    for s in seen {
        let (t, e) = (&s.tally, &s.steps);
        let speed = e.motion.map_or(String::new(), |m| format!("{:.5}", m.velocity_mps[0]));
        let yaw = e.motion.map_or(String::new(), |m| {
            format!("{:.4}", (m.velocity_mps[1] / options.radar_ahead_m.max(1e-3)).to_degrees())
        });
        looks.row(&[
            &s.run,
            &s.frame,
            &format!("{:.4}", s.time_s),
            &s.kept.points.len(),
            &e.at_rest.len(),
            &e.grouped.len(),
            &e.dense.len(),
            &e.left.len(),
            &e.paths.len(),
            &e.by_hough.len(),
            &s.single.lines.len(),
            &t.markers,
            &t.detected,
            &t.found,
            &t.members,
            &t.right,
            &speed,
            &format!("{:.5}", s.true_speed_mps),
            &yaw,
            &format!("{:.4}", s.true_yaw_rate.to_degrees()),
        ]);
    }
    let mut by_range = Sheet::new("by_range", "from_m to_m markers detected found recall precision");
    let edges = [0.0f64, 10.0, 15.0, 20.0, 25.0, 30.0, 40.0, 60.0];
    for w in edges.windows(2) {
        let ring = View { reach_m: [w[0].max(view.reach_m[0]), w[1].min(view.reach_m[1])], ..*view };
        if ring.reach_m[0] >= ring.reach_m[1] {
            continue;
        }
        let mut sum = Tally::default();
        for s in seen {
            let markers: Vec<[f64; 2]> =
                s.markers.iter().copied().filter(|m| ring.holds(glam::DVec2::from_array(*m))).collect();
            sum.add(&tally(&s.single, &s.kept.points, &markers, &s.every_marker, &ring, settings.within_m));
        }
        let text = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v:.4}"));
        by_range.row(&[
            &ring.reach_m[0],
            &ring.reach_m[1],
            &sum.markers,
            &sum.detected,
            &sum.found,
            &text(sum.recall()),
            &text(sum.precision()),
        ]);
    }
    vec![looks, by_range, robustness(seen, options, settings, view)]
}

/// What is left of recall and precision when points are taken away and strewn in, after the chain.
fn robustness(seen: &[MarkerLook], options: &MarkersOptions, settings: &Settings, view: &View) -> Sheet {
    let mut sheet =
        Sheet::new("robustness", "missing_share extra_points hough recall precision looks_with_two_lines");
    sheet.comments.push(
        "# Points were taken away at random and points at rest strewn over 5 to 40 m ahead, 10 m to each side, after the chain.".into(),
    );
    let mut cases: Vec<(f64, u32)> = settings.missing_share.iter().map(|m| (*m, 0)).collect();
    cases.extend(settings.extra_points.iter().filter(|n| **n > 0).map(|n| (0.0, *n)));
    if let (Some(m), Some(n)) = (settings.missing_share.get(1), settings.extra_points.get(1)) {
        cases.push((*m, *n));
    }
    for (missing, extra) in cases {
        for hough in [false, true] {
            let patterns =
                options.patterns.iter().map(|o| catseye_lane::markers::MarkerOptions { hough, ..*o });
            let alone = MarkersOptions { patterns: patterns.collect(), track: None, ..options.clone() };
            let (mut sum, mut two) = (Tally::default(), 0);
            for s in seen {
                let points = injected(s, missing, extra);
                let mut estimator = Markers::new(alone.clone());
                let look = SensorInput { time_s: s.time_s, points: &points, ..SensorInput::default() };
                let e = estimator.estimate(&look);
                two += usize::from(e.lines.len() >= 2);
                sum.add(&tally(&e, &points, &s.markers, &s.every_marker, view, settings.within_m));
            }
            let text = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v:.4}"));
            let share = two as f64 / seen.len().max(1) as f64;
            sheet.row(&[
                &missing,
                &extra,
                &u8::from(hough),
                &text(sum.recall()),
                &text(sum.precision()),
                &format!("{share:.4}"),
            ]);
        }
    }
    sheet
}

/// The points of a look with some missing and some that are no markers.
fn injected(s: &MarkerLook, missing: f64, extra: u32) -> Vec<LanePoint> {
    let mut draws = Draws::new(s.run * 1009 + s.frame, 0x006d_6b72);
    let mut points: Vec<LanePoint> =
        s.kept.points.iter().copied().filter(|_| draws.uniform() >= missing).collect();
    let Some(motion) = s.steps.motion else { return points };
    let levels: Vec<f64> = s.kept.points.iter().map(|p| p.rcs_dbsm).collect();
    for _ in 0..extra {
        let at = [5.0 + 35.0 * draws.uniform(), 20.0 * draws.uniform() - 10.0];
        let Some(like) = s.kept.points.first() else { break };
        let radar =
            glam::DVec2::from_array(like.at_m) - glam::DVec2::from_angle(like.azimuth_rad) * like.range_m;
        let d = glam::DVec2::from_array(at) - radar;
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
        });
    }
    points
}

fn notes(options: &MarkersOptions, settings: &Settings, radar: &catseye::scene::radar::Radar) -> Vec<String> {
    let spacings: Vec<String> = options.patterns.iter().map(|p| format!("{} m", p.spacing_m)).collect();
    let mut out = vec![format!(
        "Rows are looked for at spacings of {} with a tolerance of {} m; lines and markers count from {} to {} m in the radar's view.",
        spacings.join(" and "),
        settings.tolerance_m,
        settings.reach_m[0],
        settings.reach_m[1]
    )];
    out.push(match settings.bus_speed_std_mps {
        None => "The vehicle's speed comes from the points.".into(),
        Some(std) => format!("The bus tells the vehicle's speed with a standard deviation of {std} m/s."),
    });
    if matches!(radar.processing.angle.method, catseye::scene::radar::AngleMethod::Bartlett) {
        out.push(
            "The radar's beamformer gives one direction for each cell: markers at equal distance on the left and on the right give one point between them. An angle method with sources = \"residual\" parts them."
                .into(),
        );
    }
    out
}
