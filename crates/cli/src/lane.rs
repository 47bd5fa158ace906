//! `catseye lane`: lane estimators on scenarios, and their comparison.

use super::bar::Kept;
use super::global::{Global, print, print_json};
use catseye::base::error::{BadInput, Result};
use catseye::engine::Purpose;
use catseye_papers::trial::report::number;
use catseye_papers::trial::{Method, Row, RunOptions, compare, run};
use clap::Args;
use std::path::PathBuf;

/// Estimate lanes with a method on a simulated drive, or compare all methods: estimates, scores, report, plots
#[derive(Debug, Args)]
#[command(after_help = help())]
pub struct Lane {
    /// Method, or compare for all methods
    #[arg(value_name = "METHOD|compare")]
    pub method: String,
    /// Scenario file (TOML) with an optional table `[lane]`; compare accepts several
    #[arg(required = true, value_name = "SCENARIO")]
    pub scenarios: Vec<PathBuf>,
    /// Folder to write; the same command continues an interrupted run
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Number of drives, each with a different seed (default: as in the scenario)
    #[arg(long, value_name = "N")]
    pub runs: Option<u32>,
    /// Number of frames of a drive (default: as in the scenario)
    #[arg(long, value_name = "N")]
    pub frames: Option<u32>,
}

fn help() -> String {
    use clap::ValueEnum;
    let mut text = String::from("Methods:\n");
    for m in Method::ALL {
        let about = m.to_possible_value().and_then(|v| v.get_help().map(|h| h.to_string()));
        text += &format!("    {:14} {}\n", m.name(), about.unwrap_or_default());
    }
    text + "    compare        all methods on the same drives, one table\n"
}

/// A number that must be at least 1.
fn at_least_one(key: &str, value: Option<u32>) -> Result<()> {
    match value {
        Some(0) => Err(BadInput::new("is out of range").key(key).value(0).allowed("1 or more").into()),
        _ => Ok(()),
    }
}

impl Lane {
    pub fn run(&self, global: &Global) -> Result<()> {
        at_least_one("--runs", self.runs)?;
        at_least_one("--frames", self.frames)?;
        let method = match self.method.as_str() {
            "compare" => None,
            name => Some(Method::named(name)?),
        };
        if let Some(method) = method {
            method.check_built()?;
        }
        if let (Some(_), [_, second, ..]) = (method, self.scenarios.as_slice()) {
            return Err(BadInput::new("a method runs on one scenario")
                .key("SCENARIO")
                .value(second.display())
                .remedy("give one, or compare")
                .into());
        }
        let (engine, _) = global.engine_for(Purpose::Frames)?;
        let bar = global.bar("preparing the methods", 0, Kept::Parts);
        let options = RunOptions {
            force: global.force,
            runs: self.runs,
            frames: self.frames,
            seed: global.seed,
            watch: &|done, all| {
                bar.set_message("looks");
                bar.set_length(all);
                bar.set_position(done);
            },
        };
        let report = match method {
            Some(method) => run(&engine, method, &self.scenarios[0], &self.output, &options)?,
            None => compare::compare(&engine, &self.scenarios, &self.output, &options)?,
        };
        drop(bar);
        if global.json {
            return print_json(&report);
        }
        print(&report.title)?;
        for row in &report.rows {
            print(&line(row))?;
        }
        for note in &report.notes {
            print(note)?;
        }
        print(&format!("wrote {}", report.folder.display()))
    }
}

fn line(row: &Row) -> String {
    let ours = match row.ours {
        None => "none".to_string(),
        ours => number(ours),
    };
    let half = row.half.map_or_else(String::new, |h| format!(" ± {}", number(Some(h))));
    let document = row.document.map_or_else(String::new, |d| format!(" (document: {})", number(Some(d))));
    format!("    {}: {ours}{half} {}{document}", row.quantity, row.unit)
}
