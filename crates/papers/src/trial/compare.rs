//! `catseye lane compare`: all methods on the same drives. Each radar's frame is simulated once; what it gives, and what the vehicle's
//! other sensors give, goes to every method that takes it. Lines are judged against the two lines of the vehicle's own lane, or against
//! the road's edges where a method finds these; a line that lies on another true line (of a neighbouring lane, a rail, a wall, a row of
//! markers) is no mistake.

use crate::trial::drive::own_alone;
use crate::trial::edges::Edges;
use crate::trial::pictures::{self, Draw};
use crate::trial::ready::{Finds, SPEED_STD_MPS};
use crate::trial::report::{QUANTITIES, common_rows, fixed, number, usual_refusal};
use crate::trial::result_folder::{ResultFolder, RunOptions, RunReport, scenario};
use crate::trial::sensors::{Bus, KeptPoint, TrackFollower, kept_points, lane_points};
use crate::trial::stats::{draws, timed};
use crate::trial::{
    Drive, LaneTable, Method, OwnedInput, ReadyMethod, Rows, Sheet, Step, Trial, TrialContext,
};
use catseye::engine::Engine;
use catseye::error::{Error, Result};
use catseye::road::site::Site;
use catseye::scene::scenario::Scenario;
use catseye::simulate::Frame;
use catseye_lane::LaneEstimator;
use catseye_lane::score::{Figure, TrueLanes};
use catseye_plot::{Axis, Chart, Mark, Pen, curve_pen};
use serde::{Deserialize, Serialize};
use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

const YAW_RATE_STD_DEG_PER_S: f64 = 0.2;

/// A method as a comparison drives it.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct MethodVariant {
    pub method: Method,
    /// Sensors and light, for a method that drives with several; empty otherwise.
    pub variant: String,
}

impl MethodVariant {
    /// As tables name it.
    pub fn name(&self) -> String {
        match self.variant.as_str() {
            "" => self.method.name().into(),
            variant => format!("{} ({variant})", self.method.name()),
        }
    }

    /// Its folder.
    fn file_name(&self) -> String {
        let plain = |c: char| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' };
        match self.variant.as_str() {
            "" => self.method.name().into(),
            variant => {
                format!("{}_{}", self.method.name(), variant.replace(", ", "_")).chars().map(plain).collect()
            }
        }
    }
}

/// Of one method on one drive: its steps, or why it cannot take the scenario.
type Course = std::result::Result<Vec<Step>, String>;

/// A method after a drive, with the looks that it was given.
pub struct Driven {
    pub entrant: MethodVariant,
    pub estimator: Box<dyn LaneEstimator + Send>,
    pub looks: Vec<OwnedInput>,
}

/// The first drive of a scenario file: every method that can take it, with its looks.
///
/// Errors: those of the file.
pub fn driven(engine: &Engine, path: &Path, frames: u32) -> Result<Vec<Driven>> {
    let table = LaneTable::load(path)?;
    let mut scenario = Scenario::load(path)?;
    scenario.frames.count = frames;
    let given = TrialContext { scenario: &scenario, path, engine, runs: 1, keep: None, watch: &|_, _| {} };
    let mut looks: BTreeMap<MethodVariant, Vec<OwnedInput>> = BTreeMap::new();
    let mut told = |entrant: &MethodVariant, look: &OwnedInput| {
        looks.entry(entrant.clone()).or_default().push(look.clone())
    };
    let (methods, _) = drive_once(&given, &table, 0, &mut told, &mut || {})?;
    Ok(methods
        .into_iter()
        .map(|(entrant, method)| {
            let looks = looks.remove(&entrant).unwrap_or_default();
            Driven { entrant, estimator: method.estimator, looks }
        })
        .collect())
}

/// One drive with all methods. `seen` is called with each look, `told` after each frame.
fn drive_once(
    given: &TrialContext<'_>,
    table: &LaneTable,
    run: u32,
    seen: &mut dyn FnMut(&MethodVariant, &OwnedInput),
    told: &mut dyn FnMut(),
) -> Result<(BTreeMap<MethodVariant, ReadyMethod>, BTreeMap<MethodVariant, Course>)> {
    let site = Site::new(&given.scenario_of(run))?;
    let drive = Drive::new(&site, given.engine)?;
    let mut methods = BTreeMap::new();
    let mut out: BTreeMap<MethodVariant, Course> = BTreeMap::new();
    for method in Method::ALL {
        match table.method(method).ready(given, &drive, run) {
            Ok(found) => {
                for (variant, ready) in found {
                    let entrant = MethodVariant { method, variant };
                    methods.insert(entrant.clone(), ready);
                    out.insert(entrant, Ok(Vec::new()));
                }
            }
            // What a scenario lacks for a method is a result; what is wrong with a file or a device is not.
            Err(Error::Input(why)) => {
                out.insert(
                    MethodVariant { method, variant: String::new() },
                    Err(why.problem.clone() + &why.remedy.map_or(String::new(), |r| format!(" ({r})"))),
                );
            }
            Err(e) => return Err(e),
        }
    }
    let scenario = &site.scenario;
    let edges = Edges::of(&site.scene, site.road.as_ref());
    let yaw_rate = (draws(scenario.seed, 0x6759_726f), YAW_RATE_STD_DEG_PER_S);
    let mut bus = Bus::new(scenario.seed, [SPEED_STD_MPS, 0.0], yaw_rate);
    let mut followers: BTreeMap<usize, TrackFollower> = BTreeMap::new();
    for index in 0..drive.frames() {
        let time_s = drive.time_s(index);
        let level = drive.level(time_s);
        let read = bus.read(&level);
        let [speed_mps, yaw_rate_rad_per_s] = read.map(Some);
        let base = OwnedInput { time_s, speed_mps, yaw_rate_rad_per_s, ..OwnedInput::default() };
        let mut frames: BTreeMap<usize, (Frame, Vec<KeptPoint>)> = BTreeMap::new();
        let mut tracks = BTreeMap::new();
        for method in methods.values() {
            let Some(which) = method.radar else { continue };
            if let Entry::Vacant(free) = frames.entry(which) {
                let frame = drive.frame(which, index)?;
                let seen = kept_points(&frame);
                free.insert((frame, seen));
            }
            if method.tracks && !tracks.contains_key(&which) {
                let follower = match followers.entry(which) {
                    Entry::Occupied(o) => o.into_mut(),
                    Entry::Vacant(v) => v.insert(TrackFollower::new()?),
                };
                let seen = &frames[&which].1;
                tracks.insert(which, follower.step(scenario, drive.radar(which), index, seen, read)?);
            }
        }
        let truth = own_lines(&drive, &edges, time_s);
        let bounds = TrueLanes { also: truth.also.clone(), ..edges.truth(&level, RANGE_M) };
        for (entrant, method) in &mut methods {
            let mut look = base.clone();
            let frame = method.radar.and_then(|w| frames.get(&w));
            if let (true, Some(which), Some((_, seen))) = (method.points, method.radar, frame) {
                look.points = lane_points(drive.radar(which), seen);
            }
            if let (true, Some(which)) = (method.tracks, method.radar) {
                look.tracks = tracks.get(&which).cloned().unwrap_or_default();
            }
            if let Some(sense) = &mut method.sense {
                sense(&drive, frame.map(|f| &f.0), index, &mut look)?;
            }
            seen(entrant, &look);
            let estimate = timed(|| method.estimator.estimate(&look.input()));
            let truth = match method.finds {
                Finds::OwnLines => &truth,
                Finds::RoadEdges => &bounds,
            };
            if let Some(Ok(course)) = out.get_mut(entrant) {
                course.push(Step::new(run, index, estimate, truth.clone()));
            }
        }
        told();
    }
    Ok((methods, out))
}

/// Distances within which lines are judged, m.
const RANGE_M: [f64; 2] = [5.0, 40.0];

/// The lines of the vehicle's own lane, and beside them all else that is a true line of the road.
fn own_lines(drive: &Drive<'_>, edges: &Edges, time_s: f64) -> TrueLanes {
    let all = drive.truth(time_s, RANGE_M);
    let mut own = own_alone(&all);
    // Radars and cameras look ahead: what lies behind is not to be found.
    own.lines.iter_mut().for_each(|line| line.retain(|p| p[0] > 0.0));
    own.also = all.lines;
    own.also.extend(drive.rows(time_s).into_iter().map(|r| r.1));
    let near = edges.near(&drive.level(time_s), RANGE_M[1] + 20.0);
    own.also.extend(near.sides.into_iter().flatten());
    own
}

/// What the table says of a method on a scenario.
#[derive(Debug, Clone, Serialize)]
struct Standing {
    scenario: String,
    entrant: MethodVariant,
    /// Why there is nothing.
    cannot: Option<String>,
    looks: usize,
    /// Of each of [`QUANTITIES`]: mean and half of the 95 % interval over runs.
    figures: [Option<Figure>; QUANTITIES.len()],
    /// The reason that was given most often where no lane was stated.
    reason: Option<String>,
}

fn standing(name: &str, entrant: &MethodVariant, steps: &[Step], cannot: Option<String>) -> Standing {
    Standing {
        scenario: name.into(),
        entrant: entrant.clone(),
        cannot,
        looks: steps.len(),
        figures: QUANTITIES.each_ref().map(|q| q.figure(steps)),
        reason: usual_refusal(steps).map(|r| r.0),
    }
}

fn shown(figure: Option<Figure>) -> String {
    match figure {
        None => "–".into(),
        Some(f) if f.half.is_finite() => format!("{} ± {}", number(Some(f.mean)), number(Some(f.half))),
        Some(f) => number(Some(f.mean)),
    }
}

/// Places in [`QUANTITIES`].
const FOUND: usize = 0;
const F1: usize = 3;
const LATERAL_20_M: usize = 5;

fn cells(s: &Standing) -> Vec<String> {
    let mut out = vec![s.scenario.clone(), s.entrant.name()];
    for (q, figure) in QUANTITIES.iter().zip(s.figures).filter(|(q, _)| !q.head.is_empty()) {
        out.push(shown(figure.map(|f| Figure { mean: q.factor * f.mean, half: q.factor * f.half, ..f })));
    }
    out
}

fn markdown(standings: &[Standing]) -> String {
    let quantities = QUANTITIES.iter().map(|q| q.head).filter(|head| !head.is_empty());
    let heads: Vec<&str> = ["scenario", "method"].into_iter().chain(quantities).collect();
    let mut out = format!("| {} |\n|{}\n", heads.join(" | "), "---|".repeat(heads.len()));
    for s in standings {
        match &s.cannot {
            None => out += &format!("| {} |\n", cells(s).join(" | ")),
            Some(why) => {
                out +=
                    &format!("| {} | {} | cannot: {why} |{}\n", s.scenario, s.entrant.name(), " |".repeat(10))
            }
        }
    }
    out
}

fn sheet(standings: &[Standing]) -> Sheet {
    let mut sheet = Sheet::new("compare", "scenario method cannot looks");
    for q in &QUANTITIES {
        sheet.columns.extend([q.column.to_string(), format!("{}_half", q.column)]);
    }
    sheet.columns.push("reason".into());
    for s in standings {
        let mut row = vec![
            s.scenario.clone(),
            s.entrant.name(),
            s.cannot.clone().unwrap_or_default(),
            s.looks.to_string(),
        ];
        for f in s.figures {
            row.extend([f.map(|f| f.mean), f.map(|f| f.half)].map(|v| fixed(v.filter(|v| v.is_finite()), 6)));
        }
        row.push(s.reason.clone().unwrap_or_default());
        sheet.rows.push(row);
    }
    sheet
}

/// F1 of each method on each scenario, with intervals.
fn chart(standings: &[Standing], scenarios: &[String]) -> Chart {
    let variants: Vec<&MethodVariant> =
        standings.iter().map(|s| &s.entrant).collect::<BTreeSet<_>>().into_iter().collect();
    let names = variants.iter().enumerate().map(|(i, e)| (i as f64, e.name()));
    let x = Axis::new("F1 (%)", 0.0, 105.0);
    // The first on top.
    let y = Axis::new("", variants.len() as f64 - 0.4, -0.6).named(names);
    let mut chart = Chart::new("F1 of the own lane's lines within 0.3 m", x, y);
    let step = 0.6 / scenarios.len().max(1) as f64;
    for (k, name) in scenarios.iter().enumerate() {
        let pen = curve_pen(k);
        let mut dots = Vec::new();
        for s in standings.iter().filter(|s| s.scenario == *name) {
            let place = variants.iter().position(|e| **e == s.entrant).unwrap_or(0) as f64;
            let at = place + step * (k as f64 - 0.5 * (scenarios.len() as f64 - 1.0));
            if let Some(f) = s.figures[F1] {
                let half = if f.half.is_finite() { f.half } else { 0.0 };
                // A share is no more than all of it.
                let bar = vec![[(f.mean - half).max(0.0), at], [(f.mean + half).min(100.0), at]];
                chart.line(bar, Pen::solid(pen.colour, 2.0));
                dots.push([f.mean, at]);
            }
        }
        chart.marks(name.clone(), dots, Mark::Dot { radius: 4.0 }, pen.colour);
    }
    chart
}

/// Compares all methods on scenario files, into `out`. An interrupted comparison goes on when the same is asked for again.
///
/// Errors: those of the files. A scenario that a method cannot take is no error: the table says what it lacks.
pub fn compare(engine: &Engine, paths: &[PathBuf], out: &Path, o: &RunOptions<'_>) -> Result<RunReport> {
    let paths: Vec<&Path> = paths.iter().map(PathBuf::as_path).collect();
    let loaded =
        paths.iter().map(|p| Ok((LaneTable::load(p)?, scenario(p, o)?))).collect::<Result<Vec<_>>>()?;
    let shop = ResultFolder::open("lane compare", &paths, engine, out, o)?;
    let all: u64 = loaded
        .iter()
        .map(|(t, s)| u64::from(o.runs.or(t.runs).unwrap_or(1)) * u64::from(s.frames.count))
        .sum();
    let mut done = 0;
    let mut standings = Vec::new();
    let mut names: Vec<String> = Vec::new();
    let mut trial = Trial::new("compare", "Lane methods on the same drives");
    let mut timed: BTreeMap<String, Trial> = BTreeMap::new();
    for (number, ((table, scenario), path)) in loaded.iter().zip(&paths).enumerate() {
        let name = match names.contains(&scenario.name) {
            false => scenario.name.clone(),
            true => format!("{} ({})", scenario.name, number + 1),
        };
        let runs = o.runs.or(table.runs).unwrap_or(1);
        let mut courses: BTreeMap<MethodVariant, Vec<(u32, Course)>> = BTreeMap::new();
        for run in 0..runs {
            let given =
                TrialContext { scenario, path, engine, runs, keep: Some(shop.keep.clone()), watch: o.watch };
            let before = done;
            let made: Vec<(MethodVariant, Course)> =
                given.kept(&format!("scenario{number}_run{run}"), || {
                    // Frames of a drive that is part of preparing a method are not told.
                    let inner = TrialContext { watch: &|_, _| {}, keep: None, scenario, path, engine, runs };
                    let mut told = || {
                        done += 1;
                        (o.watch)(done, all);
                    };
                    let (_, courses) = drive_once(&inner, table, run, &mut |_, _| {}, &mut told)?;
                    Ok(courses.into_iter().collect())
                })?;
            done = before + u64::from(scenario.frames.count);
            (o.watch)(done, all);
            for (entrant, course) in made {
                courses.entry(entrant).or_default().push((run, course));
            }
        }
        let mut middle: Vec<(MethodVariant, Step)> = Vec::new();
        for (entrant, of_entrant) in courses {
            let mut steps = Vec::new();
            let mut cannot = None;
            for (run, course) in of_entrant {
                match course {
                    Err(why) => cannot = Some(why),
                    Ok(kept) => {
                        if run == 0
                            && let Some(k) = kept.get(kept.len() / 2)
                        {
                            middle.push((entrant.clone(), k.clone()));
                        }
                        steps.extend(kept);
                    }
                }
            }
            let s = standing(&name, &entrant, &steps, cannot);
            if s.cannot.is_none() {
                for (q, figure) in [F1, LATERAL_20_M].map(|k| (&QUANTITIES[k], s.figures[k])) {
                    let quantity = format!("{name}, {}: {}", entrant.name(), q.name);
                    trial.rows.figure(quantity, q.unit, figure);
                }
            }
            standings.push(s);
            timed.entry(entrant.method.name().into()).or_default().steps.extend(steps.iter().cloned());
            let mut own = Trial::new(entrant.method.name(), format!("{name}: {}", entrant.name()));
            own.steps = steps;
            if !own.steps.is_empty() {
                own.rows = common_rows(&own.steps);
                let folder = shop.path().join(format!("{}_{}", number + 1, entrant.file_name()));
                std::fs::create_dir_all(&folder).map_err(|e| Error::io(&folder, e))?;
                own.write(&folder)?;
            }
        }
        // One line for each method; those of a method with several variants beside each other.
        let several = |e: &MethodVariant| middle.iter().filter(|m| m.0.method == e.method).count() > 1;
        let first =
            |e: &MethodVariant| middle.iter().find(|m| m.0.method == e.method).is_some_and(|m| m.0 == *e);
        let of: [(&str, Vec<&(MethodVariant, Step)>); 2] = [
            ("lanes", middle.iter().filter(|m| first(&m.0)).collect()),
            ("variants", middle.iter().filter(|m| several(&m.0)).collect()),
        ];
        for (file, shown) in of {
            let shown: Vec<_> = shown.iter().map(|(e, k)| (e.name(), &k.estimate, &k.truth)).collect();
            if !shown.is_empty() {
                let chart = pictures::all_methods(&name, &shown);
                trial.pictures.push((format!("{file}_{}", number + 1), chart.draw()?));
            }
        }
        names.push(name);
    }
    trial.rows.retain(|r| r.ours.is_some());
    trial.notes.push(markdown(&standings));
    for s in standings.iter().filter(|s| s.reason.is_some()) {
        let share = s.figures[FOUND].map_or(0.0, |f| 100.0 - f.mean);
        trial.notes.push(format!(
            "{}, {}: no lane in {}% of looks, most often: {}.",
            s.scenario,
            s.entrant.name(),
            number(Some(share)),
            s.reason.clone().unwrap_or_default()
        ));
    }
    trial.sheets.push(sheet(&standings));
    trial.pictures.insert(0, ("f1".into(), chart(&standings, &names).draw()?));
    trial.write(shop.path())?;
    let trials: Vec<(String, &Trial)> = timed.iter().map(|(k, v)| (k.clone(), v)).collect();
    let seed = loaded.first().map_or(0, |l| l.1.seed);
    let folder = shop.finish(engine, "lane compare", (seed, o.runs.unwrap_or(0)), &paths, &trials)?;
    Ok(RunReport {
        folder,
        method: "compare".into(),
        title: trial.title,
        rows: trial.rows,
        notes: trial.notes,
    })
}
