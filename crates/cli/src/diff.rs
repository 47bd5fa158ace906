//! `catseye diff`: whether two results are alike within tolerances.

use super::bar::Kept;
use super::global::{Global, print, print_json};
use catseye::base::error::{Error, Result};
use catseye_io::diff::{Difference, Report, Tolerances, diff};
use clap::Args;
use serde_json::Value;
use std::path::PathBuf;

/// Compare two results of one kind within tolerances: a table of what differs; exit code 0 when they are alike, 1 when not
#[derive(Debug, Args)]
pub struct Diff {
    /// The first: folder of simulate, process, dataset, study or lane, a frame's folder, or a .csv, .npy, .json, .h5 or .bin file
    pub a: PathBuf,
    /// The second, of the same kind
    pub b: PathBuf,
    /// Levels (dBsm, dBm, dB) may differ by this, and powers in W by this ratio, dB
    #[arg(long, value_name = "DB", default_value_t = Tolerances::default().tolerance_db)]
    pub tolerance_db: f64,
    /// RCS tables: levels count only where one is above the greatest of both tables less this, dB
    #[arg(long, value_name = "DB", default_value_t = Tolerances::default().above_db)]
    pub above_db: f64,
    /// RCS tables: phases may differ by this where levels count, degrees [default: not compared]
    #[arg(long, value_name = "DEG")]
    pub phase_deg: Option<f64>,
    /// Arrays may differ by this share of their norm, and anywhere by this share of their peak; other numbers by this share
    #[arg(long, value_name = "SHARE", default_value_t = Tolerances::default().relative)]
    pub relative: f64,
    /// Lengths may differ by this, m
    #[arg(long, value_name = "M", default_value_t = Tolerances::default().tolerance_m)]
    pub tolerance_m: f64,
    /// Velocities may differ by this, m/s
    #[arg(long, value_name = "MPS", default_value_t = Tolerances::default().tolerance_mps)]
    pub tolerance_mps: f64,
    /// Angles may differ by this, degrees
    #[arg(long, value_name = "DEG", default_value_t = Tolerances::default().tolerance_deg)]
    pub tolerance_deg: f64,
    /// Points are the same point within this of range, m [default: the radar's cell, 0.5 where it is not known]
    #[arg(long, value_name = "M")]
    pub match_m: Option<f64>,
    /// Points are the same point within this of range rate, m/s [default: the radar's cell, 0.5 where it is not known]
    #[arg(long, value_name = "MPS")]
    pub match_mps: Option<f64>,
    /// Points are the same point within this of azimuth, degrees
    #[arg(long, value_name = "DEG", default_value_t = Tolerances::default().match_deg)]
    pub match_deg: f64,
    /// Rows of the printed table; --json has all
    #[arg(long, value_name = "N", default_value_t = 20)]
    pub max_rows: usize,
}

const HEADER: [&str; 8] = ["file", "what", "places", "A", "B", "apart", "allowed", "farthest apart at"];
/// Longest cell; the end of a longer one is left out.
const CELL: usize = 48;

fn short(number: f64) -> String {
    match number.abs() {
        0.0 => "0".into(),
        1e-3..1e6 => format!("{}", (number * 1e4).round() / 1e4),
        _ => format!("{number:.2e}"),
    }
}

fn value(v: &Value) -> String {
    match v {
        Value::Null => "-".into(),
        Value::Number(n) => n.as_f64().filter(|_| n.is_f64()).map_or_else(|| n.to_string(), short),
        Value::String(s) => s.clone(),
        // Real and imaginary part.
        Value::Array(parts) if parts.iter().any(Value::is_f64) => {
            parts.iter().map(value).collect::<Vec<_>>().join(" + j ")
        }
        v => v.to_string(),
    }
}

fn row(d: &Difference) -> [String; 8] {
    let number = |x: Option<f64>| {
        x.map_or("-".into(), |x| match d.unit.as_str() {
            "" | "relative" => short(x),
            unit => format!("{} {unit}", short(x)),
        })
    };
    let cells = [
        d.file.clone(),
        d.what.clone(),
        d.places.to_string(),
        value(&d.a),
        value(&d.b),
        number(d.apart),
        number(d.allowed),
        d.place.clone(),
    ];
    cells.map(|cell| match cell.chars().count() > CELL {
        true => cell.chars().take(CELL - 1).chain(['…']).collect(),
        false => cell,
    })
}

/// A table of the first rows, and how many there are more.
fn table(differences: &[Difference], most: usize) -> Vec<String> {
    let rows: Vec<[String; 8]> =
        std::iter::once(HEADER.map(String::from)).chain(differences.iter().take(most).map(row)).collect();
    let width = |c: usize| rows.iter().map(|r| r[c].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..HEADER.len()).map(width).collect();
    let line = |r: &[String; 8]| {
        let cells: Vec<String> = r.iter().zip(&widths).map(|(cell, w)| format!("{cell:w$}")).collect();
        cells.join("  ").trim_end().to_string()
    };
    let mut lines: Vec<String> = rows.iter().map(line).collect();
    if differences.len() > most {
        lines.push(format!("… and {} more; --max-rows prints more, --json all", differences.len() - most));
    }
    lines
}

/// How much differs, in one line.
fn summary(r: &Report) -> String {
    let mut names: Vec<&str> = r.differences.iter().map(|d| d.file.as_str()).collect();
    names.dedup();
    let first = names.iter().take(3).copied().collect::<Vec<_>>().join(", ");
    let more = match names.len().saturating_sub(3) {
        0 => String::new(),
        n => format!(" and {n} more"),
    };
    let (count, kind) = (r.differences.len(), &r.kind);
    let ways = if count == 1 { "way" } else { "ways" };
    format!("the results differ (kind '{kind}') in {count} {ways}: {first}{more}")
}

impl Diff {
    pub fn run(&self, global: &Global) -> Result<()> {
        let tolerances = Tolerances {
            tolerance_db: self.tolerance_db,
            above_db: self.above_db,
            phase_deg: self.phase_deg,
            relative: self.relative,
            tolerance_m: self.tolerance_m,
            tolerance_mps: self.tolerance_mps,
            tolerance_deg: self.tolerance_deg,
            match_m: self.match_m,
            match_mps: self.match_mps,
            match_deg: self.match_deg,
        };
        let bar = global.bar("files", 0, Kept::Nothing);
        let report = diff(&self.a, &self.b, &tolerances, &|all| {
            bar.set_length(all);
            bar.inc(1);
        })?;
        drop(bar);
        if global.json {
            print_json(&report)?;
        } else if report.alike {
            print(&format!(
                "alike (kind '{}'): {} files, {} values",
                report.kind, report.files, report.values
            ))?;
        } else {
            table(&report.differences, self.max_rows).iter().try_for_each(|line| print(line))?;
        }
        match report.alike {
            true => Ok(()),
            false => Err(Error::Failed(summary(&report))),
        }
    }
}
