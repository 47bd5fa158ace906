//! Results of a trial: estimates, scores, values beside the document's, tables and pictures, in one folder.

use crate::trial::stats::{mean, over_runs, rms};
use catseye::base::error::{Error, Result};
use catseye::formats::csv::Writer;
use catseye_lane::score::{DISTANCES_M, Figure, Score, TrueLanes, score};
use catseye_lane::{LaneEstimate, Measured};
use catseye_plot::Picture;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt::{Display, Write as _};
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// One look of a trial.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// Number of the run; runs differ in their seed.
    pub run: u32,
    /// Number of the frame.
    pub frame: u32,
    /// Estimate of the method.
    pub estimate: LaneEstimate,
    /// The truth.
    pub truth: TrueLanes,
    /// Score of the estimate.
    pub score: Score,
    /// Time that the estimator took, s; not reproducible.
    pub seconds: f64,
}

impl Step {
    /// Makes a step by scoring an estimate, given with the seconds that it took, against the truth.
    pub fn new(run: u32, frame: u32, (estimate, seconds): (LaneEstimate, f64), truth: TrueLanes) -> Step {
        let score = score(&estimate, &truth);
        Step { run, frame, estimate, truth, score, seconds }
    }
}

/// One value of the report.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Name of the value.
    pub quantity: String,
    /// Its unit.
    pub unit: String,
    /// Value of the document, where it gives one.
    pub document: Option<f64>,
    /// Value of this trial; None where there is none.
    pub ours: Option<f64>,
    /// Half the width of the 95 % interval of our value over runs.
    pub half: Option<f64>,
    /// Remark of one line on the difference, or on how the value was taken.
    pub why: String,
}

impl Row {
    fn new(quantity: impl Into<String>, unit: &str, ours: Option<f64>) -> Row {
        let (quantity, unit, ours) = (quantity.into(), unit.into(), ours.filter(|v| v.is_finite()));
        Row { quantity, unit, document: None, ours, half: None, why: String::new() }
    }

    /// Sets the document's value, where it states one.
    pub fn document(&mut self, value: impl Into<Option<f64>>) -> &mut Row {
        self.document = value.into();
        self
    }

    /// Sets the remark: one line on the difference, or on how the value was taken.
    pub fn why(&mut self, why: impl Into<String>) -> &mut Row {
        self.why = why.into();
        self
    }
}

/// The values of a report: ours beside those of the document. New rows are added at the end.
pub trait Rows {
    /// Adds a row with one value, which may be missing.
    fn one(&mut self, quantity: impl Into<String>, unit: &str, ours: Option<f64>) -> &mut Row;

    /// Adds a row with a mean over runs and its interval.
    fn figure(&mut self, quantity: impl Into<String>, unit: &str, figure: Option<Figure>) -> &mut Row;

    /// Adds a row with the mean of a value over runs.
    fn mean(&mut self, quantity: impl Into<String>, unit: &str, values: &[f64]) -> &mut Row;
}

impl Rows for Vec<Row> {
    fn one(&mut self, quantity: impl Into<String>, unit: &str, ours: Option<f64>) -> &mut Row {
        let at = self.len();
        self.push(Row::new(quantity, unit, ours));
        &mut self[at]
    }

    fn figure(&mut self, quantity: impl Into<String>, unit: &str, figure: Option<Figure>) -> &mut Row {
        let row = self.one(quantity, unit, figure.map(|f| f.mean));
        row.half = figure.map(|f| f.half).filter(|h| h.is_finite());
        row
    }

    fn mean(&mut self, quantity: impl Into<String>, unit: &str, values: &[f64]) -> &mut Row {
        self.figure(quantity, unit, Figure::of(values))
    }
}

/// A table, written as CSV.
#[derive(Debug, Clone, PartialEq)]
pub struct Sheet {
    /// Name of the file, without `.csv`.
    pub name: String,
    /// Comment lines in front of the table.
    pub comments: Vec<String>,
    /// Names of the columns.
    pub columns: Vec<String>,
    /// Cells, row after row.
    pub rows: Vec<Vec<String>>,
}

impl Sheet {
    /// Makes a table; `columns` are names separated by spaces.
    pub fn new(name: &str, columns: &str) -> Sheet {
        let columns = columns.split_whitespace().map(String::from).collect();
        Sheet { name: name.into(), comments: Vec::new(), columns, rows: Vec::new() }
    }

    /// Adds a comment line in front of the table.
    pub fn noted(mut self, comment: impl Into<String>) -> Sheet {
        self.comments.push(comment.into());
        self
    }

    /// Adds a row with one value for each column.
    pub fn row(&mut self, cells: &[&dyn Display]) {
        debug_assert_eq!(cells.len(), self.columns.len(), "{}", self.name);
        self.rows.push(cells.iter().map(|c| c.to_string()).collect());
    }
}

/// Results of a method on a scenario.
#[derive(Debug, Clone, Default)]
pub struct Trial {
    /// Name of the method, as on the command line.
    pub method: String,
    /// Title of the report.
    pub title: String,
    /// Values of the report.
    pub rows: Vec<Row>,
    /// Its looks, scored.
    pub steps: Vec<Step>,
    /// Its tables.
    pub sheets: Vec<Sheet>,
    /// Pictures with their file names, without `.png`.
    pub pictures: Vec<(String, Picture)>,
    /// Remarks below the table.
    pub notes: Vec<String>,
}

/// Text of a number with this many decimals; empty for None.
pub fn fixed(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(String::new, |v| format!("{v:.digits$}"))
}

/// Text of a number with a suitable number of digits; empty for None.
pub fn number(value: Option<f64>) -> String {
    match value {
        None => String::new(),
        Some(v) if v == 0.0 || (0.001..1e6).contains(&v.abs()) => {
            let digits = (3 - v.abs().max(1e-3).log10().floor() as i32).clamp(0, 6) as usize;
            let text = format!("{v:.digits$}");
            match text.contains('.') {
                true => text.trim_end_matches('0').trim_end_matches('.').into(),
                false => text,
            }
        }
        Some(v) => format!("{v:.3e}"),
    }
}

impl Trial {
    /// Makes a trial without looks.
    pub fn new(method: &str, title: impl Into<String>) -> Trial {
        Trial { method: method.into(), title: title.into(), ..Trial::default() }
    }

    /// The report as Markdown.
    pub fn markdown(&self) -> String {
        let mut out = format!("# {}\n\nMethod: {}\n\n", self.title, self.method);
        out += "| quantity | unit | document | here | ± | remark |\n|---|---|---|---|---|---|\n";
        for r in &self.rows {
            let cells = [&r.quantity, &r.unit, &number(r.document), &number(r.ours), &number(r.half), &r.why];
            let _ = writeln!(out, "| {} |", cells.map(|c| c.replace('|', "\\|")).join(" | "));
        }
        for note in &self.notes {
            let _ = write!(out, "\n{note}\n");
        }
        if !self.pictures.is_empty() {
            out.push('\n');
            for (name, _) in &self.pictures {
                let _ = writeln!(out, "![{name}]({name}.png)");
            }
        }
        out
    }

    /// Writes `report.md`, `report.json`, `estimates.jsonl`, `scores.csv`, the tables and the pictures into
    /// an existing folder.
    ///
    /// # Errors
    /// Returns an error if a file cannot be written or a picture cannot be encoded.
    pub fn write(&self, dir: &Path) -> Result<()> {
        let put = |name: &str, bytes: &[u8]| {
            let path = dir.join(name);
            std::fs::write(&path, bytes).map_err(|e| Error::io(&path, e))
        };
        let json = |e: serde_json::Error| Error::Failed(format!("report: {e}"));
        put("report.md", self.markdown().as_bytes())?;
        #[derive(Serialize)]
        struct Report<'a> {
            method: &'a str,
            title: &'a str,
            rows: &'a [Row],
            notes: &'a [String],
        }
        let Trial { method, title, rows, notes, .. } = self;
        put(
            "report.json",
            &serde_json::to_vec_pretty(&Report { method, title, rows, notes }).map_err(json)?,
        )?;
        if !self.steps.is_empty() {
            #[derive(Serialize)]
            struct Line<'a> {
                run: u32,
                frame: u32,
                estimate: &'a LaneEstimate,
                score: &'a Score,
            }
            let mut lines = String::new();
            for Step { run, frame, estimate, score, .. } in &self.steps {
                let line = Line { run: *run, frame: *frame, estimate, score };
                lines += &serde_json::to_string(&line).map_err(json)?;
                lines.push('\n');
            }
            put("estimates.jsonl", lines.as_bytes())?;
            write_sheet(dir, &scores(&self.steps))?;
        }
        self.sheets.iter().try_for_each(|sheet| write_sheet(dir, sheet))?;
        for (name, picture) in &self.pictures {
            put(&format!("{name}.png"), &picture.png()?)?;
        }
        Ok(())
    }
}

fn write_sheet(dir: &Path, sheet: &Sheet) -> Result<()> {
    let path = dir.join(format!("{}.csv", sheet.name));
    let wrong = |e| Error::io(&path, e);
    let out = File::create(&path).map_err(wrong)?;
    let columns: Vec<&str> = sheet.columns.iter().map(String::as_str).collect();
    let mut writer = Writer::new(BufWriter::new(out), &sheet.comments, &columns).map_err(wrong)?;
    for row in &sheet.rows {
        writer.row(row.iter().map(|c| c as &dyn Display)).map_err(wrong)?;
    }
    writer.finish().map_err(wrong)?;
    Ok(())
}

/// The score of each look.
fn scores(steps: &[Step]) -> Sheet {
    let distances = DISTANCES_M.map(|d| format!("lateral_error_{d}_m")).join(" ");
    let columns = format!(
        "run frame time_s lane precision recall f1 {distances} offset_m true_offset_m heading_deg true_heading_deg \
         curvature_per_m true_curvature_per_m lane_number true_lane_number confidence no_lane"
    );
    let mut sheet = Sheet::new("scores", &columns);
    for Step { run, frame, estimate: e, truth: t, score, .. } in steps {
        let told = |m: Option<Measured>| m.map(|m| m.value);
        let degrees = |rad: Option<f64>| rad.map(f64::to_degrees);
        let whole = |v: Option<i32>| v.map_or_else(String::new, |v| v.to_string());
        let own = [
            [told(e.offset_m), t.offset_m],
            [degrees(told(e.heading_rad)), degrees(t.heading_rad)],
            [told(e.curvature_per_m), t.curvature_per_m],
        ];
        let lane = u8::from(e.no_lane.is_none()).to_string();
        let mut row = vec![run.to_string(), frame.to_string(), format!("{:.4}", e.time_s), lane];
        let figures = [score.precision, score.recall, score.f1].into_iter().chain(score.lateral_m);
        row.extend(figures.chain(own.into_iter().flatten()).map(|v| fixed(v, 6)));
        row.extend([e.lane_number, t.lane_number].map(whole));
        row.push(fixed(Some(e.confidence), 6));
        row.push(e.no_lane.as_ref().map_or_else(String::new, |w| w.to_string()));
        sheet.rows.push(row);
    }
    sheet
}

/// Root mean square of a step's value over each run; one value per run.
pub fn rms_of_runs(steps: &[Step], of: impl Fn(&Step) -> Option<f64>) -> Vec<f64> {
    over_runs(steps, |s| s.run, |run| rms(run.iter().filter_map(|s| of(s))))
}

/// Mean of a step's value over each run; one value per run.
pub fn mean_of_runs(steps: &[Step], of: impl Fn(&Step) -> Option<f64>) -> Vec<f64> {
    over_runs(steps, |s| s.run, |run| mean(run.iter().filter_map(|s| of(s))))
}

/// Mean of a step's value over each run, in percent; one value per run.
pub fn percent_of_runs(steps: &[Step], of: impl Fn(&Step) -> Option<f64>) -> Vec<f64> {
    mean_of_runs(steps, of).iter().map(|v| 100.0 * v).collect()
}

/// Returns 1 for a step with a lane, 0 for one without.
pub fn has_lane(s: &Step) -> Option<f64> {
    Some(f64::from(u8::from(s.estimate.no_lane.is_none())))
}

/// A value that every method has on every drive.
pub struct Quantity {
    /// Name in the report of a method.
    pub name: &'static str,
    /// Unit of the figure.
    pub unit: &'static str,
    /// Name in the head of the comparison's table; "" where it is not shown there.
    pub head: &'static str,
    /// Factor from the unit of the file to that of the head.
    pub factor: f64,
    /// Column in the comparison's file.
    pub column: &'static str,
    of: fn(&Step) -> Option<f64>,
}

impl Quantity {
    /// The value over runs: for percentages the mean, otherwise the root mean square.
    pub fn figure(&self, steps: &[Step]) -> Option<Figure> {
        Figure::of(&match self.unit {
            "%" => percent_of_runs(steps, self.of),
            _ => rms_of_runs(steps, self.of),
        })
    }
}

const fn shared(
    (name, unit): (&'static str, &'static str),
    (head, factor): (&'static str, f64),
    column: &'static str,
    of: fn(&Step) -> Option<f64>,
) -> Quantity {
    Quantity { name, unit, head, factor, column, of }
}

fn lateral<const K: usize>(s: &Step) -> Option<f64> {
    s.score.lateral_m[K]
}

/// The values by which all methods are compared.
pub const QUANTITIES: [Quantity; 12] = [
    shared(("looks with a lane", "%"), ("looks with a lane, %", 1.0), "found_percent", has_lane),
    shared(("precision of lines within 0.3 m", "%"), ("precision, %", 1.0), "precision_percent", |s| {
        s.score.precision
    }),
    shared(("recall of lines within 0.3 m", "%"), ("recall, %", 1.0), "recall_percent", |s| s.score.recall),
    shared(("F1 within 0.3 m", "%"), ("F1, %", 1.0), "f1_percent", |s| s.score.f1),
    shared(("lateral error at 10 m (rms)", "m"), ("at 10 m, m", 1.0), "lateral_10_m", lateral::<0>),
    shared(("lateral error at 20 m (rms)", "m"), ("at 20 m, m", 1.0), "lateral_20_m", lateral::<1>),
    shared(("lateral error at 40 m (rms)", "m"), ("at 40 m, m", 1.0), "lateral_40_m", lateral::<2>),
    shared(("lateral error at 60 m (rms)", "m"), ("", 1.0), "lateral_60_m", lateral::<3>),
    shared(("offset error (rms)", "m"), ("offset, m", 1.0), "offset_m", |s| s.score.offset_error_m),
    shared(("heading error (rms)", "deg"), ("heading, deg", 1.0), "heading_deg", |s| {
        s.score.heading_error_rad.map(f64::to_degrees)
    }),
    shared(("curvature error (rms)", "1/m"), ("curvature, 1/km", 1e3), "curvature_per_m", |s| {
        s.score.curvature_error_per_m
    }),
    shared(("lane number right", "%"), ("lane number, %", 1.0), "lane_percent", |s| {
        s.score.lane_right.map(|r| f64::from(u8::from(r)))
    }),
];

/// Rows of the values common to all methods, over runs.
pub fn common_rows(steps: &[Step]) -> Vec<Row> {
    let mut rows = Vec::new();
    for q in &QUANTITIES {
        rows.figure(q.name, q.unit, q.figure(steps));
    }
    rows.retain(|r| r.ours.is_some());
    rows
}

/// The most frequent reason of looks without a lane, and their number.
pub fn usual_refusal<'a>(steps: impl IntoIterator<Item = &'a Step>) -> Option<(String, usize)> {
    let mut count: BTreeMap<String, usize> = BTreeMap::new();
    for why in steps.into_iter().filter_map(|s| s.estimate.no_lane.as_ref()) {
        *count.entry(why.to_string()).or_default() += 1;
    }
    count.into_iter().max_by_key(|c| c.1)
}
