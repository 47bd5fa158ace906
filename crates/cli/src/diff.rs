//! `catseye diff`: whether two results are alike within tolerances.

use super::bar::Kept;
use super::global::{Global, print, print_json};
use catseye::base::error::{BadInput, Error, Result};
use catseye::formats::{check_extension, stage};
use catseye_io::diff::{Difference, Quantity, Report, Tolerances, diff};
use catseye_plot::{PICTURE_EXTENSIONS, overlay_files};
use clap::Args;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Compare two results of one kind within tolerances: table of differences; exit code 0 if they agree, 1 if they differ
#[derive(Debug, Args)]
pub struct Diff {
    /// First result: a folder of simulate, process, dataset, study or lane, a frame's folder, or a .csv, .npy, .json, .h5 or .bin file
    pub a: PathBuf,
    /// Second result, of the same kind
    pub b: PathBuf,
    /// Tolerance of values in dBsm, dBm and dB, and of the ratio of powers in W, dB
    #[arg(long, value_name = "DB", default_value_t = Tolerances::default().tolerance_db)]
    pub tolerance_db: f64,
    /// RCS tables: compare cross sections only where one of them is at most this far below the maximum of both tables, dB
    #[arg(long, value_name = "DB", default_value_t = Tolerances::default().above_db)]
    pub above_db: f64,
    /// RCS tables: tolerance of phases where cross sections are compared, degrees [default: not compared]
    #[arg(long, value_name = "DEG")]
    pub phase_deg: Option<f64>,
    /// Relative tolerance: of arrays to their norm, of each element to the array's peak, and of other numbers
    #[arg(long, value_name = "SHARE", default_value_t = Tolerances::default().relative)]
    pub relative: f64,
    /// Tolerance of lengths, m
    #[arg(long, value_name = "M", default_value_t = Tolerances::default().tolerance_m)]
    pub tolerance_m: f64,
    /// Tolerance of velocities, m/s
    #[arg(long, value_name = "MPS", default_value_t = Tolerances::default().tolerance_mps)]
    pub tolerance_mps: f64,
    /// Tolerance of angles, degrees
    #[arg(long, value_name = "DEG", default_value_t = Tolerances::default().tolerance_deg)]
    pub tolerance_deg: f64,
    /// Maximum difference in range of matching points, m [default: the radar's cell, 0.5 if unknown]
    #[arg(long, value_name = "M")]
    pub match_m: Option<f64>,
    /// Maximum difference in range rate of matching points, m/s [default: the radar's cell, 0.5 if unknown]
    #[arg(long, value_name = "MPS")]
    pub match_mps: Option<f64>,
    /// Maximum difference in azimuth of matching points, degrees
    #[arg(long, value_name = "DEG", default_value_t = Tolerances::default().match_deg)]
    pub match_deg: f64,
    /// Maximum number of rows of the printed table; --json contains all
    #[arg(long, value_name = "N", default_value_t = 20)]
    pub max_rows: usize,
    /// Print the result as Markdown, for a summary or a comment on a pull request
    #[arg(long)]
    pub markdown: bool,
    /// Plot both results (PNG, SVG or PDF by extension): RCS tables, points.csv, returns.csv; for folders the points of the first frame
    /// that differs
    #[arg(long, value_name = "F.png|F.svg|F.pdf")]
    pub plot: Option<PathBuf>,
}

const HEADER: [&str; 8] = ["file", "what", "places", "A", "B", "apart", "allowed", "largest difference at"];
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

/// A distance with its unit; a dash where no number states it.
fn distance(x: Option<f64>, unit: &str) -> String {
    x.map_or("-".into(), |x| match unit {
        "" | "relative" => short(x),
        unit => format!("{} {unit}", short(x)),
    })
}

fn row(d: &Difference) -> [String; 8] {
    let number = |x| distance(x, &d.unit);
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

/// Text that Markdown shows as it is: names of files and cells of tables come from whoever wrote them.
fn plain(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '<' => out += "&lt;",
            '&' => out += "&amp;",
            // A mention would call somebody.
            '@' => out += "&#64;",
            c if c.is_control() => out.push(' '),
            '|' | '`' | '*' | '_' | '[' | ']' | '\\' | '!' | '#' | '~' => out.extend(['\\', c]),
            c => out.push(c),
        }
    }
    out
}

fn markdown_row(cells: impl IntoIterator<Item = impl AsRef<str>>) -> String {
    cells.into_iter().fold("|".into(), |line, cell| line + " " + cell.as_ref() + " |")
}

fn quantity(q: &Quantity) -> [String; 7] {
    // A distance that is no number is one between a number and NaN or an infinity.
    let endless = |x: Option<f64>| if x.is_none() { "not finite".into() } else { distance(x, &q.unit) };
    [
        plain(&q.what),
        q.places.to_string(),
        endless(q.largest),
        endless(q.median),
        distance(q.allowed, &q.unit),
        q.beyond.to_string(),
        plain(&q.place),
    ]
}

/// The report as Markdown: the verdict, the distances of each column where two tables were compared, and what differs.
fn markdown(r: &Report, most: usize) -> Vec<String> {
    let verdict = if r.alike { "Within the tolerance" } else { "**Outside the tolerance**" };
    let (files, kind) = (if r.files == 1 { "file" } else { "files" }, plain(&r.kind));
    let [a, b] = [&r.a, &r.b].map(|p| plain(&p.display().to_string()));
    let mut lines = vec![
        format!("{verdict}: {} values of {} {files} (kind '{kind}').", r.values, r.files),
        format!("A is {a}, B is {b}."),
    ];
    let head =
        |names: &[&str]| [String::new(), markdown_row(names), markdown_row(names.iter().map(|_| "---"))];
    if !r.quantities.is_empty() {
        lines.extend(head(&["what", "places", "max", "median", "allowed", "beyond it", "max at"]));
        lines.extend(r.quantities.iter().map(|q| markdown_row(quantity(q))));
    }
    if !r.differences.is_empty() {
        lines.extend(head(&HEADER));
        lines.extend(r.differences.iter().take(most).map(|d| markdown_row(row(d).map(|c| plain(&c)))));
    }
    if r.differences.len() > most {
        lines.extend([String::new(), format!("… and {} more differences.", r.differences.len() - most)]);
    }
    lines
}

/// The two tables that a picture shows: the results themselves, or of two folders the points of the first frame that differs;
/// of the first frame where none does.
fn pictured(r: &Report) -> Result<[PathBuf; 2]> {
    if !r.a.is_dir() {
        return Ok([r.a.clone(), r.b.clone()]);
    }
    let is_points = |name: &str| Path::new(name).file_name().is_some_and(|n| n == "points.csv");
    let both: Vec<String> =
        stage::files_of(&r.a)?.into_iter().filter(|n| is_points(n) && r.b.join(n).is_file()).collect();
    let differs = |name: &&String| r.differences.iter().any(|d| d.file == **name);
    match both.iter().find(differs).or(both.first()) {
        Some(name) => Ok([r.a.join(name), r.b.join(name)]),
        None => {
            Err(BadInput::new("the two results have no points.csv in common, so there is nothing to draw")
                .file(&r.a)
                .key("--plot")
                .remedy("leave out --plot, or compare runs that write points")
                .into())
        }
    }
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
        if global.json && self.markdown {
            return Err(BadInput::new("--json and --markdown exclude each other")
                .key("--markdown")
                .allowed("--json or --markdown")
                .into());
        }
        if let Some(out) = &self.plot {
            check_extension(out, &PICTURE_EXTENSIONS)?;
            stage::distinct(&[out], &[&self.a, &self.b])?;
        }
        let bar = global.bar("files", 0, Kept::Nothing);
        let report = diff(&self.a, &self.b, &tolerances, &|all| {
            bar.set_length(all);
            bar.inc(1);
        })?;
        drop(bar);
        if let Some(out) = &self.plot {
            let [a, b] = pictured(&report)?;
            let name = a.strip_prefix(&report.a).ok().filter(|n| !n.as_os_str().is_empty());
            let title = name.unwrap_or(report.b.as_path()).display().to_string();
            overlay_files(&title, &a, &b)?.write(out, global.force)?;
        }
        if global.json {
            print_json(&report)?;
        } else if self.markdown {
            markdown(&report, self.max_rows).iter().try_for_each(|line| print(line))?;
        } else if report.alike {
            print(&format!(
                "equal (kind '{}'): {} files, {} values",
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
