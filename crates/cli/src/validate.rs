//! `catseye validate`: the canonical table, measured here and now.

use super::bar::Kept;
use super::global::{Global, print, print_json};
use catseye::base::error::{Error, Result};
use catseye::base::units::{LEAST_DB, level_text};
use catseye::formats::stage::StagedDir;
use catseye::road::vehicle::Kind;
use catseye_papers::comparison::{Comparison, Tolerance};
use catseye_papers::measured::{DOWN_TO_DB, Residual, residuals};
use catseye_papers::validate::GROUPS;
use catseye_papers::vehicles::look::Grid;
use catseye_papers::vehicles::report::{looks_csv, picture, statistics_csv, summary};
use catseye_papers::vehicles::scatter::statistics;
use clap::Args;
use std::path::PathBuf;
use std::time::Instant;

/// Check known targets and radar quantities on the chosen engine against acceptance limits
#[derive(Debug, Args)]
#[command(
    after_help = "Exit code 1 when a row fails. Cross sections are at 77 GHz, far field, three bounces; \
                        a row without a polarisation is VV, one without a convention is 'every'."
)]
pub struct Validate {
    /// Show instead the deviation from measured cross sections, on the CPU engine in f64; without acceptance limits
    #[arg(long)]
    pub measured: bool,
    #[command(flatten)]
    pub scatter: Scatter,
}

/// The scatter of vehicles and people.
#[derive(Debug, Args)]
pub struct Scatter {
    /// Show instead the statistics of cross sections and point positions over many vehicles, people and
    /// directions, beside published statistics; without acceptance limits
    #[arg(long, conflicts_with = "measured")]
    pub vehicles: bool,
    /// --vehicles: kinds of the library, separated by commas (default: all)
    #[arg(long, requires = "vehicles", value_delimiter = ',', value_name = "LIST")]
    pub kinds: Vec<String>,
    /// --vehicles: distances from the radar, m, separated by commas
    #[arg(long, requires = "vehicles", value_delimiter = ',', value_name = "LIST", default_values_t = [7.0, 15.0, 30.0])]
    pub distances: Vec<f64>,
    /// --vehicles: number of directions around each body
    #[arg(long, requires = "vehicles", value_name = "N", default_value_t = 12)]
    pub aspects: usize,
    /// --vehicles: number of frames in each direction, each with its own body: metal, bumper, tilt, position and noise vary
    #[arg(long, requires = "vehicles", value_name = "N", default_value_t = 1)]
    pub bodies: usize,
    /// --vehicles: folder for statistics.csv, looks.csv and scatter.png
    #[arg(short, long, requires = "vehicles", value_name = "DIR")]
    pub output: Option<PathBuf>,
}

#[derive(serde::Serialize)]
struct JsonRow {
    group: &'static str,
    what: String,
    unit: String,
    expected: Option<f64>,
    measured: f64,
    gate: Tolerance,
    source: String,
    error: Option<f64>,
    /// null for a row without a gate.
    passed: Option<bool>,
}

impl JsonRow {
    fn new(group: &'static str, r: Comparison) -> JsonRow {
        JsonRow {
            group,
            expected: r.expected_number(),
            error: r.error(),
            passed: r.passes(),
            what: r.name,
            unit: r.unit,
            measured: r.ours,
            gate: r.tolerance,
            source: r.source,
        }
    }
}

impl Validate {
    pub fn run(&self, global: &Global) -> Result<()> {
        if self.measured {
            return measured(global);
        }
        if self.scatter.vehicles {
            return self.scatter.run(global);
        }
        let engine = global.engine()?;
        let start = Instant::now();
        let bar = global.bar("groups", GROUPS.len() as u64, Kept::Nothing);
        let mut rows = Vec::new();
        for group in &GROUPS {
            bar.set_message(group.name);
            let measured = group.measure(&engine)?;
            if !global.json {
                bar.suspend(|| measured.iter().try_for_each(|r| print(&line(group.name, r))))?;
            }
            rows.extend(measured.into_iter().map(|r| (group.name, r)));
            bar.inc(1);
        }
        drop(bar);
        let failed = rows.iter().filter(|r| r.1.passes() == Some(false)).count();
        let shown = rows.iter().filter(|r| r.1.passes().is_none()).count();
        let seconds = start.elapsed().as_secs_f64();
        if global.json {
            let rows: Vec<JsonRow> = rows.into_iter().map(|(group, r)| JsonRow::new(group, r)).collect();
            print_json(&serde_json::json!({
                "engine": engine.report(),
                "seconds": seconds,
                "failed": failed,
                "rows": rows,
            }))?;
        } else {
            let gated = rows.len() - shown;
            print(&format!(
                "{} of {gated} values are within their acceptance limits, {shown} more have no limit, {seconds:.1} s",
                gated - failed
            ))?;
        }
        match failed {
            0 => Ok(()),
            n => Err(Error::Failed(format!(
                "{n} values of the canonical table exceed their acceptance limits"
            ))),
        }
    }
}

impl Scatter {
    fn run(&self, global: &Global) -> Result<()> {
        let kinds = match &self.kinds[..] {
            [] => Kind::ALL.to_vec(),
            names => names.iter().map(|n| n.trim().parse()).collect::<Result<Vec<Kind>>>()?,
        };
        let grid = Grid {
            kinds,
            distances_m: self.distances.clone(),
            aspects: self.aspects,
            bodies: self.bodies,
            seed: global.seed.unwrap_or(0),
        };
        grid.check()?;
        let staged = match &self.output {
            Some(folder) => Some(StagedDir::new(folder, global.force, "vehicles")?),
            None => None,
        };
        let engine = global.engine()?;
        let start = Instant::now();
        let bar = global.bar("looks", grid.looks() as u64, Kept::Nothing);
        let looks = grid.run(&engine, &|| bar.inc(1))?;
        drop(bar);
        let rows = statistics(&looks);
        let seconds = start.elapsed().as_secs_f64();
        let folder = match staged {
            Some(staged) => {
                let write = |file: &str, bytes: &[u8]| {
                    let path = staged.path().join(file);
                    std::fs::write(&path, bytes).map_err(|e| Error::io(&path, e))
                };
                write("statistics.csv", statistics_csv(&rows).as_bytes())?;
                write("looks.csv", looks_csv(&looks).as_bytes())?;
                write("scatter.png", &picture(&grid, &looks)?.png()?)?;
                Some(staged.commit()?)
            }
            None => None,
        };
        let object = serde_json::json!({
            "engine": engine.report(),
            "seconds": seconds,
            "grid": grid,
            "folder": folder.as_ref().map(|f| f.display().to_string()),
            "statistics": rows,
        });
        global.answer(&object, || {
            let wrote = folder.map_or(String::new(), |f| format!("; wrote {}", f.display()));
            format!("{}\n{seconds:.0} s{wrote}", summary(&grid, &looks, &rows))
        })
    }
}

/// The residuals of all measured cuts.
fn measured(global: &Global) -> Result<()> {
    let rows = residuals()?;
    let object = serde_json::json!({ "engine": "cpu, f64", "down_to_db": DOWN_TO_DB, "rows": rows });
    global.answer(&object, || {
        let head = format!(
            "ours minus measured (Austin RCS Benchmark Suite), at the peaks of measured lobes within {DOWN_TO_DB} dB of the highest\n\
             {:22} {:>9} {:>4} {:>10} {:>10} {:>8} {:>9} {:>8}",
            "target", "GHz", "", "lobes", "highest dB", "rms dB", "worst dB", "at deg"
        );
        let line = |r: &Residual| {
            format!(
                "{:22} {:9.2} {:>4} {:10} {:+10.2} {:8.2} {:9.2} {:8.1}",
                r.target,
                r.frequency_hz / 1e9,
                r.polarisation,
                r.lobes,
                r.at_highest_db,
                r.rms_db,
                r.worst_db,
                r.worst_azimuth_deg
            )
        };
        std::iter::once(head).chain(rows.iter().map(line)).collect::<Vec<_>>().join("\n")
    })
}

/// Short and long numbers in the same column.
fn number(x: f64) -> String {
    match x.abs() {
        0.0 => "0".into(),
        a if (1e-2..1e5).contains(&a) => format!("{x:.4}"),
        _ => format!("{x:.3e}"),
    }
}

fn line(group: &str, r: &Comparison) -> String {
    let level = |x: f64| match r.unit.starts_with("dB") && x < LEAST_DB {
        true => level_text(x, 0),
        false => number(x),
    };
    let gate = match r.tolerance {
        Tolerance::Within(g) => format!("+-{}", number(g)),
        Tolerance::Share(g) => format!("+-{:.2} %", 100.0 * g),
        Tolerance::AtMost(g) => format!("<= {}", number(g)),
        Tolerance::Shown => "-".into(),
    };
    let error = match (r.tolerance, r.error()) {
        (Tolerance::Share(_), Some(e)) => format!("{:.3} %", 100.0 * e),
        (_, Some(e)) => number(e),
        (_, None) => "-".into(),
    };
    let verdict = match r.passes() {
        Some(true) => "pass",
        Some(false) => "FAIL",
        None => "shown",
    };
    format!(
        "{verdict:5} {:15} {:62} {:>11} {:4} expected {:>11} error {:>10} gate {:>11}  ({})",
        group,
        r.name,
        level(r.ours),
        r.unit,
        r.expected_number().map_or("-".into(), level),
        error,
        gate,
        r.source,
    )
}
