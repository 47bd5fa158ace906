//! What a trial of lane numbers leaves: accuracy beside the document's, wrong cases with their cause, errors of the tracks.

use crate::trial::context::TrialContext;
use crate::trial::drive::{Drive, Level};
use crate::trial::hd_map::passes::{Pass, Passes, Scan};
use crate::trial::hd_map::pictures;
use crate::trial::hd_map::scene::{Error, KIND, READINGS, Scene};
use crate::trial::hd_map::settings::Settings;
use crate::trial::hd_map::stage::Stage;
use crate::trial::report::{Row, Sheet, Step, Trial, common_rows};
use crate::trial::stats::{mean, rms};
use catseye::road::layout::LaneKind;
use catseye_lane::LaneEstimate;
use catseye_lane::hd_map::Assignment;
use catseye_lane::hd_map::accuracy::{AccuracyTable, Cause, Tally, scan_of_pass};
use catseye_lane::hd_map::estimator::MapLanes;
use catseye_lane::hd_map::of_road::Stripes;

/// Lines of the vehicle's own lane are compared between these distances, m.
const OWN_RANGE_M: [f64; 2] = [3.0, 80.0];
/// Groups of whom the picture of a scene is drawn.
const DRAWN_GROUPS: usize = 6;

pub struct All<'a> {
    given: &'a TrialContext<'a>,
    settings: &'a Settings,
    scenes: Vec<Scene>,
    steps: Vec<Step>,
    vehicles: Sheet,
    wrong: Sheet,
    wrong_scans: Sheet,
    notes: Vec<String>,
}

impl<'a> All<'a> {
    pub fn new(given: &'a TrialContext<'a>, settings: &'a Settings, stages: &[Stage]) -> All<'a> {
        let scene = |s: &Stage| Scene {
            name: s.name.clone(),
            document: s.kind.map(|k| k.scene().document()),
            ..Scene::default()
        };
        let columns = "scene run group vehicle class frames_on_a_lane scans true_lane lane right probability \
             lane_by_radar_axis lane_without_step cause mean_range_m mean_aspect_deg across_m \
             across_moved_m";
        let wrong = "scene run group vehicle class true_lane lane cause detail";
        let scans = "scene run group vehicle frame true_lane lane cause range_m aspect_deg across_m \
             across_moved_m along_moved_m";
        All {
            given,
            settings,
            scenes: stages.iter().map(scene).collect(),
            steps: Vec::new(),
            vehicles: Sheet::new("vehicles", columns),
            wrong: Sheet::new("wrong", wrong),
            wrong_scans: Sheet::new("wrong_scans", scans),
            notes: Vec::new(),
        }
    }

    /// The vehicle's own lane, where it stands on one.
    #[allow(clippy::too_many_arguments, reason = "one look from all sides")]
    pub fn step(
        &mut self,
        run: u32,
        frame: u32,
        drive: &Drive<'_>,
        lanes: &[Stripes],
        level: &Level,
        estimate: (LaneEstimate, f64),
    ) {
        let on = lanes.iter().find_map(|l| l.lane_at(level.at_m));
        let strip = |k: LaneKind| {
            matches!(k, LaneKind::Median | LaneKind::Verge | LaneKind::Sidewalk | LaneKind::Shoulder)
        };
        if on.is_none_or(|(_, kind)| strip(kind)) || level.speed_mps == 0.0 {
            return;
        }
        let truth = drive.truth(drive.time_s(frame), OWN_RANGE_M);
        self.steps.push(Step::new(run, frame, estimate, truth));
    }

    pub fn group(
        &mut self,
        run: u32,
        k: usize,
        g: usize,
        passes: Passes,
        lanes: &[Stripes],
        drive: &Drive<'_>,
    ) {
        let scene = &mut self.scenes[k];
        for (sum, more) in scene.strays.iter_mut().zip(passes.strays) {
            *sum += more;
        }
        if run == 0 && g < DRAWN_GROUPS {
            scene.drawing.add(&passes, lanes, drive);
        }
        for pass in passes.vehicles.iter().filter(|p| p.counts && p.there > 0) {
            let Some(spoken) = spoken(pass, 0) else {
                scene.missed += 1;
                continue;
            };
            let mut cause = None;
            let mut lanes = [None; 3];
            for (reading, lane) in lanes.iter_mut().enumerate() {
                let Some(s) = self::spoken(pass, reading) else { continue };
                let seen = &s.given[reading];
                let why = scene.tables[reading].record(KIND, s.true_lane, seen, Some(&s.from_truth));
                *lane = seen.number();
                if reading == 0 {
                    cause = why;
                }
            }
            for s in &pass.scans {
                for (reading, [right, all]) in scene.scans.iter_mut().enumerate() {
                    *right += u32::from(s.given[reading].number() == Some(s.true_lane));
                    *all += 1;
                }
                if let Some(why) = cause_of(s) {
                    scene.wrong_scans[why as usize] += 1;
                    let lane = s.given[0].number().map_or_else(String::new, |n| n.to_string());
                    let f = |x: f64| format!("{x:.2}");
                    self.wrong_scans.row(&[
                        &scene.name,
                        &run,
                        &g,
                        &pass.name,
                        &s.frame,
                        &s.true_lane,
                        &lane,
                        &why.name(),
                        &f(s.range_m),
                        &f(s.aspect_rad.to_degrees()),
                        &f(s.across_m[0]),
                        &f(s.across_m[1]),
                        &f(s.along_m[1]),
                    ]);
                }
                let e = Error { across_m: s.across_m, aspect_rad: s.aspect_rad };
                scene.errors.push(e);
            }
            let n = pass.scans.len() as f64;
            let mean = |of: &dyn Fn(&Scan) -> f64| pass.scans.iter().map(of).sum::<f64>() / n;
            let text = |n: Option<i32>| n.map_or_else(String::new, |n| n.to_string());
            let probability = spoken.given[0].lane.as_ref().map_or(0.0, |l| l.probability);
            self.vehicles.row(&[
                &scene.name,
                &run,
                &g,
                &pass.name,
                &pass.class,
                &pass.there,
                &pass.scans.len(),
                &spoken.true_lane,
                &text(lanes[0]),
                &u8::from(cause.is_none()),
                &format!("{probability:.4}"),
                &text(lanes[1]),
                &text(lanes[2]),
                &cause.map_or("", Cause::name),
                &format!("{:.1}", mean(&|s| s.range_m)),
                &format!("{:.1}", mean(&|s| s.aspect_rad).to_degrees()),
                &format!("{:.3}", mean(&|s| s.across_m[0])),
                &format!("{:.3}", mean(&|s| s.across_m[1])),
            ]);
            if let Some(cause) = cause {
                let detail = detail(pass, spoken);
                let given = text(spoken.given[0].number());
                self.wrong.row(&[
                    &scene.name,
                    &run,
                    &g,
                    &pass.name,
                    &pass.class,
                    &spoken.true_lane,
                    &given,
                    &cause.name(),
                    &detail,
                ]);
                let lane = if given.is_empty() { "none".into() } else { given };
                self.notes.push(format!(
                    "Wrong in {} (run {run}, group {g}): {} ({}) in lane {} was given {lane}, cause {}: {detail}.",
                    scene.name,
                    pass.name,
                    pass.class,
                    spoken.true_lane,
                    cause.name()
                ));
            }
        }
    }

    pub fn finish(self) -> Trial {
        let title = format!("Lane numbers by radar tracks and a map: {}", self.given.scenario.name);
        let mut trial = Trial::new(MapLanes::METHOD, title);
        let mut accuracy = Sheet::new(
            "accuracy",
            "scene reading vehicles right accuracy_percent low_percent high_percent document_percent",
        );
        for s in &self.scenes {
            trial.rows.extend(rows(s, self.settings));
            for (reading, name) in READINGS.iter().enumerate() {
                let t = s.tally(reading);
                let [low, high] = t.interval95().unwrap_or([f64::NAN; 2]);
                let percent = |x: Option<f64>| x.map_or_else(String::new, |x| format!("{:.2}", 100.0 * x));
                let interval = |x: f64| percent(x.is_finite().then_some(x));
                let document = s.document.map(|d| d.1 / 100.0);
                accuracy.row(&[
                    &s.name,
                    name,
                    &t.counted(),
                    &t.right,
                    &percent(t.accuracy()),
                    &interval(low),
                    &interval(high),
                    &percent(document),
                ]);
            }
        }
        trial.rows.extend(common_rows(&self.steps));
        if self.scenes.iter().all(|s| s.tally(0).counted() + s.missed == 0) {
            trial.notes.push("No vehicle was on a lane of the map in the radar's view.".into());
        }
        trial.notes.push(format!(
            "Map: points every {} m or less with {} m of error across; radar's place {} m, azimuth {} deg (standard deviations). \
             Tracks come from the whole chain. Intervals are Wilson's, 95 %. A vehicle's lane is the one with the greatest sum of \
             probabilities over its scans. Causes: measurement, right from the true place; method, wrong from there too; dropped, \
             beside all lanes.",
            self.settings.map_spacing_m,
            self.settings.map_std_m,
            self.settings.place_std_m,
            self.settings.azimuth_std_deg
        ));
        trial.notes.extend(self.notes);
        trial.steps = self.steps;
        trial.sheets =
            vec![accuracy, self.vehicles, self.wrong, self.wrong_scans, errors_by_aspect(&self.scenes)];
        trial.pictures = pictures::all(&self.scenes);
        trial
    }
}

/// Why a scan was given a wrong lane, or none; None where it is right.
fn cause_of(s: &Scan) -> Option<Cause> {
    AccuracyTable::default().record(KIND, s.true_lane, &s.given[0], Some(&s.from_truth))
}

/// The scan that speaks for a vehicle, in one reading.
fn spoken(pass: &Pass, reading: usize) -> Option<&Scan> {
    let all: Vec<Assignment> = pass.scans.iter().map(|s| s.given[reading].clone()).collect();
    pass.scans.get(scan_of_pass(&all)?.target)
}

fn detail(pass: &Pass, s: &Scan) -> String {
    let place = match &s.given[0].lane {
        Ok(l) => match l.next {
            Some((next, p)) => format!(
                "{:.2} m from the inner edge, next lane {next} with {:.0} %",
                l.rate * l.gap_m,
                100.0 * p
            ),
            None => String::new(),
        },
        Err(why) => why.to_string(),
    };
    let right = pass.scans.iter().filter(|x| x.given[0].number() == Some(x.true_lane)).count();
    format!(
        "track {:+.2} m across (towards the radar) and {:+.2} m ahead of the middle at {:.0} m; {place}; {right} of {} scans right",
        s.across_m[1],
        s.along_m[1],
        s.range_m,
        pass.scans.len()
    )
}

fn rows(s: &Scene, settings: &Settings) -> Vec<Row> {
    let name = &s.name;
    let row = |what: &str, unit: &str, value: Option<f64>| Row::new(format!("{name}: {what}"), unit, value);
    let t = s.tally(0);
    let mut out = Vec::new();
    let interval = t.interval95();
    let mut right = row("vehicles in the right lane", "%", t.accuracy().map(|a| 100.0 * a));
    right.half = interval.map(|[low, high]| 50.0 * (high - low));
    let [low, high] = interval.unwrap_or([0.0; 2]).map(|x| 100.0 * x);
    right = right.why(format!("{} of {}; 95 % interval {low:.1} to {high:.1} %", t.right, t.counted()));
    let mut vehicles = row("vehicles", "", Some(f64::from(t.counted() + s.missed)));
    if let Some((count, percent)) = s.document {
        right = right.document(percent);
        vehicles = vehicles.document(f64::from(count));
    }
    out.push(right);
    out.push(vehicles.why(format!("{} of them without a track", s.missed)));
    if t.counted() == 0 {
        return out;
    }
    let document = s.tally(1);
    let percent = |t: &Tally| t.accuracy().map(|a| 100.0 * a);
    out.push(row("the same, by the line square to the radar's axis", "%", percent(document)).why(format!(
        "{} of {}; the document's way across the road",
        document.right,
        document.counted()
    )));
    if settings.to_middle {
        let plain = s.tally(2);
        out.push(row("the same, tracks not moved to the middle of a car", "%", percent(plain)).why(format!(
            "{} of {}",
            plain.right,
            plain.counted()
        )));
    }
    let [right, all] = s.scans[0];
    out.push(
        row("scans in the right lane", "%", Some(100.0 * f64::from(right) / f64::from(all.max(1))))
            .why(format!("{right} of {all}, each track of a counted vehicle at each time")),
    );
    for cause in Cause::ALL {
        let n = s.wrong_scans[cause as usize];
        if n > 0 {
            out.push(
                row(&format!("scans wrong by {}", cause.name()), "", Some(f64::from(n)))
                    .why("listed in wrong_scans.csv"),
            );
        }
    }
    let e = &s.errors;
    out.push(row("error of tracks across the vehicle (rms)", "m", rms(e.iter().map(|e| e.across_m[1]))));
    out.push(
        row("its mean, towards the radar", "m", mean(e.iter().map(|e| e.across_m[1])))
            .why("after the step to the middle of a car"),
    );
    out.push(row("its mean without that step", "m", mean(e.iter().map(|e| e.across_m[0]))));
    for cause in Cause::ALL {
        let n = t.wrong_by(cause);
        if n > 0 {
            out.push(row(&format!("wrong by {}", cause.name()), "vehicles", Some(f64::from(n))));
        }
    }
    out.push(
        row("tracks of no vehicle that got a lane", "", Some(f64::from(s.strays[1])))
            .why(format!("of {} looks at tracks of no vehicle; they count for none", s.strays[0])),
    );
    out
}

/// Error across by the angle between the line of sight and the vehicle.
fn errors_by_aspect(scenes: &[Scene]) -> Sheet {
    let columns = "scene aspect_from_deg aspect_to_deg scans mean_m rms_m mean_moved_m rms_moved_m";
    let mut sheet = Sheet::new("errors_by_aspect", columns);
    sheet
        .comments
        .push("across the vehicle, positive towards the radar; moved: to the middle of a car".into());
    for s in scenes {
        for low in (0..90).step_by(5) {
            let within =
                |e: &&Error| (f64::from(low)..f64::from(low + 5)).contains(&e.aspect_rad.to_degrees());
            let part: Vec<&Error> = s.errors.iter().filter(within).collect();
            let figure = |k: usize| {
                let m = mean(part.iter().map(|e| e.across_m[k])).unwrap_or(0.0);
                (m, rms(part.iter().map(|e| e.across_m[k])).unwrap_or(0.0))
            };
            if part.is_empty() {
                continue;
            }
            let ((m0, r0), (m1, r1)) = (figure(0), figure(1));
            let n = part.len();
            let f = |x: f64| format!("{x:.3}");
            sheet.row(&[&s.name, &low, &(low + 5), &n, &f(m0), &f(r0), &f(m1), &f(r1)]);
        }
    }
    sheet
}
