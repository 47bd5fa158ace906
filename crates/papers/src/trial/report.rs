//! What a trial leaves: estimates, scores, figures beside the document's, tables and pictures, in one folder.

use crate::trial::stats::{mean, over_runs, rms};
use catseye::error::{Error, Result};
use catseye::formats::csv::Writer;
use catseye_lane::LaneEstimate;
use catseye_lane::score::{DISTANCES_M, Figure, Score, TrueLanes, score};
use catseye_plot::Picture;
use serde::{Deserialize, Serialize};
use std::fmt::{Display, Write as _};
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// One look of a trial.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Number of the run; runs differ in their seed.
    pub run: u32,
    pub frame: u32,
    pub estimate: LaneEstimate,
    pub truth: TrueLanes,
    pub score: Score,
    /// That the estimator took; not part of what is reproducible.
    pub seconds: f64,
}

impl Step {
    /// Judges an estimate that took so many seconds by the truth.
    pub fn new(run: u32, frame: u32, (estimate, seconds): (LaneEstimate, f64), truth: TrueLanes) -> Step {
        let score = score(&estimate, &truth);
        Step { run, frame, estimate, truth, score, seconds }
    }
}

/// One figure of the report.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    pub quantity: String,
    pub unit: String,
    /// The document's, where it gives one.
    pub document: Option<f64>,
    /// None where there is none.
    pub ours: Option<f64>,
    /// Half the width of the 95 % interval of ours over runs.
    pub half: Option<f64>,
    /// One line on the difference, or on how it was taken.
    pub why: String,
}

impl Row {
    pub fn new(quantity: impl Into<String>, unit: &str, ours: Option<f64>) -> Row {
        let ours = ours.filter(|v| v.is_finite());
        Row {
            quantity: quantity.into(),
            unit: unit.into(),
            document: None,
            ours,
            half: None,
            why: String::new(),
        }
    }

    /// Mean of a value over runs.
    pub fn mean(quantity: impl Into<String>, unit: &str, values: &[f64]) -> Row {
        let figure = Figure::of(values);
        let half = figure.map(|f| f.half).filter(|h| h.is_finite());
        Row { half, ..Row::new(quantity, unit, figure.map(|f| f.mean)) }
    }

    /// With the document's value, where it states one.
    pub fn document(self, value: impl Into<Option<f64>>) -> Row {
        Row { document: value.into(), ..self }
    }

    pub fn why(self, why: impl Into<String>) -> Row {
        Row { why: why.into(), ..self }
    }
}

/// A table, written as CSV.
#[derive(Debug, Clone, PartialEq)]
pub struct Sheet {
    /// Of the file, without `.csv`.
    pub name: String,
    /// Lines in front of the table.
    pub comments: Vec<String>,
    pub columns: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

impl Sheet {
    pub fn new(name: &str, columns: &str) -> Sheet {
        let columns = columns.split_whitespace().map(String::from).collect();
        Sheet { name: name.into(), comments: Vec::new(), columns, rows: Vec::new() }
    }

    /// One value for each column.
    pub fn row(&mut self, cells: &[&dyn Display]) {
        debug_assert_eq!(cells.len(), self.columns.len(), "{}", self.name);
        self.rows.push(cells.iter().map(|c| c.to_string()).collect());
    }
}

/// What a method did on a scenario.
#[derive(Debug, Clone, Default)]
pub struct Trial {
    /// As on the command line.
    pub method: String,
    pub title: String,
    pub rows: Vec<Row>,
    pub steps: Vec<Step>,
    pub sheets: Vec<Sheet>,
    /// Names of files, without `.png`.
    pub pictures: Vec<(String, Picture)>,
    /// Sentences below the table.
    pub notes: Vec<String>,
}

/// A number with as many digits as help; empty for none.
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
    pub fn new(method: &str, title: impl Into<String>) -> Trial {
        Trial { method: method.into(), title: title.into(), ..Trial::default() }
    }

    /// The table as Markdown.
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

    /// Writes `report.md`, `report.json`, `estimates.jsonl`, `scores.csv`, the tables and the pictures into a folder that is there.
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
        let report =
            Report { method: &self.method, title: &self.title, rows: &self.rows, notes: &self.notes };
        put("report.json", &serde_json::to_vec_pretty(&report).map_err(json)?)?;
        if !self.steps.is_empty() {
            let mut lines = String::new();
            for s in &self.steps {
                #[derive(Serialize)]
                struct Line<'a> {
                    run: u32,
                    frame: u32,
                    estimate: &'a LaneEstimate,
                    score: &'a Score,
                }
                let line = Line { run: s.run, frame: s.frame, estimate: &s.estimate, score: &s.score };
                lines += &serde_json::to_string(&line).map_err(json)?;
                lines.push('\n');
            }
            put("estimates.jsonl", lines.as_bytes())?;
            write_sheet(dir, &scores(&self.steps))?;
        }
        for sheet in &self.sheets {
            write_sheet(dir, sheet)?;
        }
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
    let mut sheet = Sheet::new("scores", "run frame time_s lane precision recall f1");
    sheet.columns.extend(DISTANCES_M.map(|d| format!("lateral_error_{d}_m")));
    let rest = "offset_m true_offset_m heading_deg true_heading_deg curvature_per_m true_curvature_per_m lane_number \
                true_lane_number confidence no_lane";
    sheet.columns.extend(rest.split_whitespace().map(String::from));
    for s in steps {
        let (e, t) = (&s.estimate, &s.truth);
        let text = |v: Option<f64>| v.map_or_else(String::new, |v| format!("{v:.6}"));
        let mut row = vec![
            s.run.to_string(),
            s.frame.to_string(),
            format!("{:.4}", e.time_s),
            u8::from(e.no_lane.is_none()).to_string(),
            text(s.score.precision),
            text(s.score.recall),
            text(s.score.f1),
        ];
        row.extend(s.score.lateral_m.map(text));
        let whole = |v: Option<i32>| v.map_or_else(String::new, |v| v.to_string());
        row.extend([
            text(e.offset_m.map(|m| m.value)),
            text(t.offset_m),
            text(e.heading_rad.map(|m| m.value.to_degrees())),
            text(t.heading_rad.map(f64::to_degrees)),
            text(e.curvature_per_m.map(|m| m.value)),
            text(t.curvature_per_m),
            whole(e.lane_number),
            whole(t.lane_number),
            text(Some(e.confidence)),
            e.no_lane.as_ref().map_or_else(String::new, |w| w.to_string()),
        ]);
        sheet.rows.push(row);
    }
    sheet
}

/// Root mean square of what a step gives, over each run; the runs' values.
pub fn rms_of_runs(steps: &[Step], of: impl Fn(&Step) -> Option<f64>) -> Vec<f64> {
    over_runs(steps, |s| s.run, |run| rms(run.iter().filter_map(|s| of(s))))
}

/// Mean of what a step gives, over each run; the runs' values.
pub fn mean_of_runs(steps: &[Step], of: impl Fn(&Step) -> Option<f64>) -> Vec<f64> {
    over_runs(steps, |s| s.run, |run| mean(run.iter().filter_map(|s| of(s))))
}

/// Mean of what a step gives, in percent, over each run; the runs' values.
pub fn percent_of_runs(steps: &[Step], of: impl Fn(&Step) -> Option<f64>) -> Vec<f64> {
    mean_of_runs(steps, of).iter().map(|v| 100.0 * v).collect()
}

/// The figures that all methods share, over runs.
pub fn common_rows(steps: &[Step]) -> Vec<Row> {
    let percent = |quantity: &str, of: &dyn Fn(&Step) -> Option<f64>| {
        Row::mean(quantity, "%", &percent_of_runs(steps, of))
    };
    let rms = |quantity: &str, unit: &str, of: &dyn Fn(&Step) -> Option<f64>| {
        Row::mean(quantity, unit, &rms_of_runs(steps, of))
    };
    let mut rows = vec![
        percent("looks with a lane", &|s| Some(f64::from(u8::from(s.estimate.no_lane.is_none())))),
        percent("precision of lines within 0.3 m", &|s| s.score.precision),
        percent("recall of lines within 0.3 m", &|s| s.score.recall),
        percent("F1 within 0.3 m", &|s| s.score.f1),
    ];
    for (k, d) in DISTANCES_M.iter().enumerate() {
        rows.push(rms(&format!("lateral error at {d} m (rms)"), "m", &|s| s.score.lateral_m[k]));
    }
    rows.extend([
        rms("offset error (rms)", "m", &|s| s.score.offset_error_m),
        rms("heading error (rms)", "deg", &|s| s.score.heading_error_rad.map(f64::to_degrees)),
        rms("curvature error (rms)", "1/m", &|s| s.score.curvature_error_per_m),
        percent("lane number right", &|s| s.score.lane_right.map(|r| f64::from(u8::from(r)))),
    ]);
    rows.retain(|r| r.ours.is_some());
    rows
}
