//! `catseye lane compare`: all methods on the same drives. Each radar's frame is simulated once, and its
//! output and that of the vehicle's other sensors go to every method that uses them. Lines are compared with
//! the two lines of the vehicle's own lane, or with the road's edges where a method finds these. A line that
//! lies on another true line (of a neighbouring lane, a rail, a wall, a row of markers) is no mistake.

use crate::trial::compared_drive::{MethodVariant, drive_once};
use crate::trial::pictures::{self, Draw};
use crate::trial::report::{QUANTITIES, common_rows, fixed, number, usual_refusal};
use crate::trial::result_folder::{ResultFolder, RunOptions, RunReport, scenario};
use crate::trial::{LaneTable, Rows, Sheet, Step, Trial, TrialContext};
use catseye::base::error::{Error, Result};
use catseye::engine::Engine;
use catseye_lane::score::Figure;
use catseye_plot::{Axis, Chart, Mark, Pen, curve_pen};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Result of one method on one drive: its steps, or the reason why it cannot use the scenario.
type Course = std::result::Result<Vec<Step>, String>;

/// Entry of the table for a method on a scenario.
#[derive(Debug, Clone, Serialize)]
struct Standing {
    scenario: String,
    variant: MethodVariant,
    /// The reason why there is no result.
    cannot: Option<String>,
    looks: usize,
    /// Mean and half of the 95 % interval over runs for each of [`QUANTITIES`].
    figures: [Option<Figure>; QUANTITIES.len()],
    /// The most frequent reason for looks without a lane.
    reason: Option<String>,
}

fn shown(figure: Option<Figure>) -> String {
    match figure {
        None => "–".into(),
        Some(f) if f.half.is_finite() => format!("{} ± {}", number(Some(f.mean)), number(Some(f.half))),
        Some(f) => number(Some(f.mean)),
    }
}

/// Indices in [`QUANTITIES`].
const FOUND: usize = 0;
const F1: usize = 3;
const LATERAL_20_M: usize = 5;

fn cells(s: &Standing) -> Vec<String> {
    let mut out = vec![s.scenario.clone(), s.variant.name()];
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
                // What a user wrote must not end a cell.
                let (name, rest, why) = (s.variant.name(), " |".repeat(10), why.replace('|', "\\|"));
                out += &format!("| {} | {name} | not possible: {why} |{rest}\n", s.scenario);
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
        let cannot = s.cannot.clone().unwrap_or_default();
        let mut row = vec![s.scenario.clone(), s.variant.name(), cannot, s.looks.to_string()];
        for f in s.figures {
            row.extend([f.map(|f| f.mean), f.map(|f| f.half)].map(|v| fixed(v.filter(|v| v.is_finite()), 6)));
        }
        row.push(s.reason.clone().unwrap_or_default());
        sheet.rows.push(row);
    }
    sheet
}

/// Chart of F1 of each method on each scenario, with intervals.
fn chart(standings: &[Standing], scenarios: &[String]) -> Chart {
    let variants: Vec<&MethodVariant> =
        standings.iter().map(|s| &s.variant).collect::<BTreeSet<_>>().into_iter().collect();
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
            let place = variants.iter().position(|e| **e == s.variant).unwrap_or(0) as f64;
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

/// Compares all methods on scenario files and writes the result to `out`. An interrupted comparison continues
/// when it is started again with the same arguments.
///
/// # Errors
/// Returns the errors of the files and of the frames. A scenario that a method cannot use is no error: the
/// table states what it lacks.
pub fn compare(engine: &Engine, paths: &[PathBuf], out: &Path, o: &RunOptions<'_>) -> Result<RunReport> {
    let paths: Vec<&Path> = paths.iter().map(PathBuf::as_path).collect();
    let loaded =
        paths.iter().map(|p| Ok((LaneTable::load(p)?, scenario(p, o)?))).collect::<Result<Vec<_>>>()?;
    let results = ResultFolder::open("lane compare", &paths, engine, out, o)?;
    let all: u64 = loaded
        .iter()
        .map(|(t, s)| u64::from(o.runs.or(t.runs).unwrap_or(1)) * u64::from(s.frames.count))
        .sum();
    let mut done = 0;
    let mut standings = Vec::new();
    let mut names: Vec<String> = Vec::new();
    let mut trial = Trial::new("compare", "Lane methods on the same drives");
    let mut seconds: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for (number, ((table, scenario), path)) in loaded.iter().zip(&paths).enumerate() {
        let name = match names.contains(&scenario.name) {
            false => scenario.name.clone(),
            true => format!("{} ({})", scenario.name, number + 1),
        };
        let runs = o.runs.or(table.runs).unwrap_or(1);
        let mut by_variant: BTreeMap<MethodVariant, Vec<(u32, Course)>> = BTreeMap::new();
        for run in 0..runs {
            let keep = Some(results.keep.clone());
            let given = TrialContext { scenario, path, engine, runs, keep, watch: o.watch };
            let before = done;
            let made: Vec<(MethodVariant, Course)> =
                given.kept(&format!("scenario{number}_run{run}"), || {
                    // Frames of a drive that is part of preparing a method are not told.
                    let inner = TrialContext { watch: &|_, _| {}, keep: None, ..given };
                    let mut told = |frames| (o.watch)(before + u64::from(frames), all);
                    let made =
                        drive_once(&inner, table, run, false, &mut told).map_err(|e| e.in_file(path))?;
                    let cannot = made.cannot.into_iter().map(|(variant, why)| (variant, Err(why)));
                    Ok(made.driven.into_iter().map(|d| (d.variant, Ok(d.steps))).chain(cannot).collect())
                })?;
            done = before + u64::from(scenario.frames.count);
            (o.watch)(done, all);
            for (variant, course) in made {
                by_variant.entry(variant).or_default().push((run, course));
            }
        }
        let mut middle: Vec<(MethodVariant, Step)> = Vec::new();
        for (variant, of_variant) in by_variant {
            let mut steps = Vec::new();
            let mut cannot = None;
            for (run, course) in of_variant {
                match course {
                    Err(why) => cannot = Some(why),
                    Ok(kept) => {
                        if run == 0
                            && let Some(k) = kept.get(kept.len() / 2)
                        {
                            middle.push((variant.clone(), k.clone()));
                        }
                        steps.extend(kept);
                    }
                }
            }
            let (figures, looks) = (QUANTITIES.each_ref().map(|q| q.figure(&steps)), steps.len());
            let (reason, scenario) = (usual_refusal(&steps).map(|r| r.0), name.clone());
            let s = Standing { scenario, variant: variant.clone(), cannot, looks, figures, reason };
            if s.cannot.is_none() {
                for (q, figure) in [F1, LATERAL_20_M].map(|k| (&QUANTITIES[k], s.figures[k])) {
                    let quantity = format!("{name}, {}: {}", variant.name(), q.name);
                    trial.rows.figure(quantity, q.unit, figure);
                }
            }
            standings.push(s);
            seconds.entry(variant.method.name().into()).or_default().extend(steps.iter().map(|s| s.seconds));
            let mut own = Trial::new(variant.method.name(), format!("{name}: {}", variant.name()));
            own.steps = steps;
            if !own.steps.is_empty() {
                own.rows = common_rows(&own.steps);
                let folder = results.path().join(format!("{}_{}", number + 1, variant.file_name()));
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
            s.variant.name(),
            number(Some(share)),
            s.reason.clone().unwrap_or_default()
        ));
    }
    trial.sheets.push(sheet(&standings));
    trial.pictures.insert(0, ("f1".into(), chart(&standings, &names).draw()?));
    let seed = loaded.first().map_or(0, |l| l.1.seed);
    results.finish((seed, o.runs.unwrap_or(0)), trial, seconds)
}
