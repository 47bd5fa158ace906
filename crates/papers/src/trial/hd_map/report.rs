//! Results of a trial of lane numbers: accuracy beside the document's, wrong cases with their cause, errors
//! of the tracks.

use crate::trial::hd_map::passes::{Pass, Passes, Scan};
use crate::trial::hd_map::pictures;
use crate::trial::hd_map::scene::{KIND, READINGS, Scene, TrackError};
use crate::trial::hd_map::settings::Settings;
use crate::trial::hd_map::stage::Stage;
use crate::trial::kit::*;
use catseye::road::layout::LaneKind;
use catseye_lane::hd_map::Assignment;
use catseye_lane::hd_map::accuracy::{AccuracyTable, Cause, Tally, scan_of_pass};
use catseye_lane::hd_map::estimator::MapLanes;
use catseye_lane::hd_map::of_road::Stripes;
use std::fmt::Display;

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
            document: s.kind.map(|k| k.document()),
            ..Scene::default()
        };
        let vehicles = "scene run group vehicle class frames_on_a_lane scans true_lane lane right probability lane_by_radar_axis \
                        lane_without_step cause mean_range_m mean_aspect_deg across_m across_moved_m";
        let wrong = "scene run group vehicle class true_lane lane cause detail";
        let wrong_scans = "scene run group vehicle frame true_lane lane cause range_m aspect_deg across_m across_moved_m \
                           along_moved_m";
        All {
            given,
            settings,
            scenes: stages.iter().map(scene).collect(),
            steps: Vec::new(),
            vehicles: Sheet::new("vehicles", vehicles),
            wrong: Sheet::new("wrong", wrong),
            wrong_scans: Sheet::new("wrong_scans", wrong_scans),
            notes: Vec::new(),
        }
    }

    /// The vehicle's own lane, where it stands on one.
    pub fn step(&mut self, now: &Now<'_>, lanes: &[Stripes], estimate: (LaneEstimate, f64)) {
        let on = lanes.iter().find_map(|l| l.lane_at(now.level.at_m));
        let strip = |k: LaneKind| {
            matches!(k, LaneKind::Median | LaneKind::Verge | LaneKind::Sidewalk | LaneKind::Shoulder)
        };
        if on.is_none_or(|(_, kind)| strip(kind)) || now.level.speed_mps == 0.0 {
            return;
        }
        let truth = now.drive.truth(now.time_s, OWN_RANGE_M);
        self.steps.push(Step::new(now.run, now.frame, estimate, truth));
    }

    /// What was found of a group of vehicles in scene number `k`.
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
        let text = |n: Option<i32>| n.map_or_else(String::new, |n| n.to_string());
        for pass in passes.vehicles.iter().filter(|p| p.counts && p.there > 0) {
            let Some(spoken) = spoken(pass, 0) else {
                scene.missed += 1;
                continue;
            };
            let (name, class, true_lane) = (&pass.name, &pass.class, spoken.true_lane);
            let (title, mut cause) = (scene.name.clone(), None);
            let who: [&dyn Display; 4] = [&title, &run, &g, name];
            let mut lanes = [const { String::new() }; 3];
            for (reading, lane) in lanes.iter_mut().enumerate() {
                let Some(s) = self::spoken(pass, reading) else { continue };
                let seen = &s.given[reading];
                let why = scene.tables[reading].record(KIND, s.true_lane, seen, Some(&s.from_truth));
                *lane = text(seen.number());
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
                    let places =
                        [s.range_m, s.aspect_rad.to_degrees(), s.across_m[0], s.across_m[1], s.along_m[1]];
                    let [range, aspect, across, moved, along] = places.map(|x| format!("{x:.2}"));
                    let (frame, truly, lane, why) =
                        (s.frame, s.true_lane, text(s.given[0].number()), why.name());
                    let at: [&dyn Display; 9] =
                        [&frame, &truly, &lane, &why, &range, &aspect, &across, &moved, &along];
                    self.wrong_scans.row(&[&who[..], &at].concat());
                }
                scene.errors.push(TrackError { across_m: s.across_m, aspect_rad: s.aspect_rad });
            }
            let n = pass.scans.len();
            let mean = |of: &dyn Fn(&Scan) -> f64| pass.scans.iter().map(of).sum::<f64>() / n as f64;
            let probability = spoken.given[0].lane.as_ref().map_or(0.0, |l| l.probability);
            let why = cause.map_or("", Cause::name);
            let ([lane, by_axis, unmoved], right) = (&lanes, u8::from(cause.is_none()));
            let [range, aspect] = [mean(&|s| s.range_m), mean(&|s| s.aspect_rad).to_degrees()];
            let [range, aspect, probability] =
                [format!("{range:.1}"), format!("{aspect:.1}"), format!("{probability:.4}")];
            let [across, moved] = [0, 1].map(|k| format!("{:.3}", mean(&|s| s.across_m[k])));
            let seen: [&dyn Display; 7] = [class, &pass.there, &n, &true_lane, lane, &right, &probability];
            let other: [&dyn Display; 7] = [by_axis, unmoved, &why, &range, &aspect, &across, &moved];
            self.vehicles.row(&[&who[..], &seen, &other].concat());
            if cause.is_some() {
                let (detail, given) = (detail(pass, spoken), text(spoken.given[0].number()));
                let what: [&dyn Display; 5] = [class, &true_lane, &given, &why, &detail];
                self.wrong.row(&[&who[..], &what].concat());
                let lane = if given.is_empty() { "none".into() } else { given };
                self.notes.push(format!(
                    "Wrong in {} (run {run}, group {g}): {name} ({class}) in lane {true_lane} was given {lane}, cause {why}: \
                     {detail}.",
                    scene.name
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
            rows(&mut trial.rows, s, self.settings);
            for (reading, name) in READINGS.iter().enumerate() {
                let t = s.tally(reading);
                let [low, high] =
                    t.interval95().map_or([None; 2], |i| i.map(|x| Some(x).filter(|x| x.is_finite())));
                let shares = [t.accuracy(), low, high, s.document.map(|d| d.1 / 100.0)];
                let [share, low, high, document] = shares.map(|x| fixed(x.map(|x| 100.0 * x), 2));
                let (all, right) = (t.counted(), t.right);
                accuracy.row(&[&s.name, name, &all, &right, &share, &low, &high, &document]);
            }
        }
        trial.rows.extend(common_rows(&self.steps));
        if self.scenes.iter().all(|s| s.tally(0).counted() + s.missed == 0) {
            trial.notes.push("No vehicle was on a lane of the map in the radar's field of view.".into());
        }
        trial.notes.push(format!(
            "Map: points every {} m or less with {} m of error across; radar's position {} m, azimuth {} deg \
             (standard deviations). Tracks come from the whole chain. Intervals are Wilson's, 95 %. A \
             vehicle's lane is the one with the greatest sum of probabilities over its scans. Causes: \
             measurement, right from the true position; method, wrong from there too; dropped, beside all \
             lanes.",
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

/// The cause why a scan was assigned a wrong lane or none; None where it is right.
fn cause_of(s: &Scan) -> Option<Cause> {
    AccuracyTable::default().record(KIND, s.true_lane, &s.given[0], Some(&s.from_truth))
}

/// The scan that represents a vehicle, in one reading.
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

fn rows(rows: &mut Vec<Row>, s: &Scene, settings: &Settings) {
    let name = &s.name;
    let percent = |t: &Tally| t.accuracy().map(|a| 100.0 * a);
    let t = s.tally(0);
    let interval = t.interval95();
    let [low, high] = interval.unwrap_or([0.0; 2]).map(|x| 100.0 * x);
    let row = rows.one(format!("{name}: vehicles in the right lane"), "%", percent(t));
    row.half = interval.map(|[low, high]| 50.0 * (high - low));
    row.document(s.document.map(|d| d.1)).why(format!(
        "{} of {}; 95 % interval {low:.1} to {high:.1} %",
        t.right,
        t.counted()
    ));
    rows.one(format!("{name}: vehicles"), "", Some(f64::from(t.counted() + s.missed)))
        .document(s.document.map(|d| f64::from(d.0)))
        .why(format!("{} of them without a track", s.missed));
    if t.counted() == 0 {
        return;
    }
    let mut row = |what: &str, unit: &str, value: Option<f64>, why: String| {
        rows.one(format!("{name}: {what}"), unit, value).why(why);
    };
    let other = s.tally(1);
    let why = format!("{} of {}; the document's line across the road", other.right, other.counted());
    row("the same, by the line square to the radar's axis", "%", percent(other), why);
    if settings.to_middle {
        let plain = s.tally(2);
        let why = format!("{} of {}", plain.right, plain.counted());
        row("the same, tracks not moved to the middle of a car", "%", percent(plain), why);
    }
    let [right, all] = s.scans[0];
    let share = 100.0 * f64::from(right) / f64::from(all.max(1));
    let why = format!("{right} of {all}, each track of a counted vehicle at each time");
    row("scans in the right lane", "%", Some(share), why);
    for cause in Cause::ALL {
        let n = s.wrong_scans[cause as usize];
        if n > 0 {
            let what = format!("scans wrong by {}", cause.name());
            row(&what, "", Some(f64::from(n)), "listed in wrong_scans.csv".into());
        }
    }
    let across = |k: usize| s.errors.iter().map(move |e| e.across_m[k]);
    row("error of tracks across the vehicle (rms)", "m", rms(across(1)), String::new());
    let why = "after the step to the middle of a car";
    row("its mean, towards the radar", "m", mean(across(1)), why.into());
    row("its mean without that step", "m", mean(across(0)), String::new());
    for cause in Cause::ALL {
        let n = t.wrong_by(cause);
        if n > 0 {
            row(&format!("wrong by {}", cause.name()), "vehicles", Some(f64::from(n)), String::new());
        }
    }
    let why = format!("of {} frames of tracks without a vehicle; they count for none", s.strays[0]);
    row("tracks without a vehicle that were assigned a lane", "", Some(f64::from(s.strays[1])), why);
}

/// Error across by the angle between the line of sight and the vehicle.
fn errors_by_aspect(scenes: &[Scene]) -> Sheet {
    let columns = "scene aspect_from_deg aspect_to_deg scans mean_m rms_m mean_moved_m rms_moved_m";
    let mut sheet = Sheet::new("errors_by_aspect", columns)
        .noted("across the vehicle, positive towards the radar; moved: to the middle of a car");
    for s in scenes {
        for low in (0..90).step_by(5) {
            let degrees = f64::from(low)..f64::from(low + 5);
            let within = |e: &&TrackError| degrees.contains(&e.aspect_rad.to_degrees());
            let part: Vec<&TrackError> = s.errors.iter().filter(within).collect();
            if part.is_empty() {
                continue;
            }
            let across = |k: usize| part.iter().map(move |e| e.across_m[k]);
            let figures = [mean(across(0)), rms(across(0)), mean(across(1)), rms(across(1))];
            let [m0, r0, m1, r1] = figures.map(|x| fixed(x, 3));
            sheet.row(&[&s.name, &low, &(low + 5), &part.len(), &m0, &r0, &m1, &r1]);
        }
    }
    sheet
}
