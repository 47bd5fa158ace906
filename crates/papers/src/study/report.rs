//! The tables and the report of studies.

use super::outcome::Outcome;
use super::parameter::{self, TARGET_PREFIX, Value, Values, word_of};
use super::search::Design;
use super::solve::reflector_spec;
use super::spec::{Fact, SearchTable, Study};
use crate::comparison::{Comparison, Tolerance};
use catseye::base::error::{Error, Result};
use catseye::base::units::level_text;
use catseye::formats::csv::Writer;
use std::collections::HashMap;
use std::fmt::{Display, Write};

/// Result of one study.
#[derive(Debug, Clone)]
pub enum StudyResult {
    /// A table of quantities over axes.
    Table(Outcome),
    /// The best designs over cost.
    Front(Vec<Design>),
}

impl StudyResult {
    /// Limits of physical optics, and searches that ended at a limit of their range, one line each.
    pub fn remarks(&self, study: &Study) -> Vec<String> {
        let mut out: Vec<String> = Vec::new();
        let designs = match self {
            StudyResult::Table(outcome) => return outcome.remarks.clone(),
            StudyResult::Front(designs) => designs,
        };
        for d in designs {
            for remark in d.remarks.iter().map(String::as_str).chain(d.limits.iter().map(String::as_str)) {
                let front = study.search.as_ref().map_or("", |s| s.front.value.as_str());
                out.push(format!("{front} = {}: {remark}", d.cost));
            }
        }
        out
    }
}

/// Compares each fact of a study with this program's number.
pub fn compare(study: &Study, given: &StudyResult) -> Vec<Comparison> {
    let StudyResult::Table(outcome) = given else { return Vec::new() };
    let row = |f: &Fact| Comparison {
        name: f.text.clone(),
        expected: f.document.clone(),
        ours: f.ours(outcome),
        unit: f.unit.clone(),
        tolerance: Tolerance::Shown,
        source: f.why.clone(),
    };
    study.facts.iter().map(row).collect()
}

/// Header lines common to CSV and report.
pub fn header(study: &Study, engine: &str) -> Vec<String> {
    let mut lines = vec![format!("study: {} ({})", study.name, study.title)];
    if !study.reference.is_empty() {
        lines.push(format!("beside: {}", study.reference));
    }
    let fixed: Vec<String> = study.fixed.iter().map(|(n, v)| format!("{n} = {v}")).collect();
    lines.push(format!("fixed: {}", fixed.join(", ")));
    if study.quick {
        lines.push("grids: a quarter of the steps (quick)".into());
    }
    if study.needs_rcs() {
        lines.push(format!(
            "solver: physical optics, {} bounces, convention {}, diffraction {}, accuracy {} dB",
            study.bounces,
            format!("{:?}", study.convention).to_lowercase(),
            format!("{:?}", study.diffraction).to_lowercase(),
            study.accuracy_db
        ));
    }
    lines.push(format!("engine: {engine}"));
    lines.push(format!("version: catseye {}", env!("CARGO_PKG_VERSION")));
    lines
}

/// CSV of one row for each point: the axes, then the quantities; an empty cell where there is no value.
///
/// # Errors
/// Returns an error if the table cannot be written to memory, or for a front of a study without a search.
pub fn csv(study: &Study, given: &StudyResult, engine: &str) -> Result<Vec<u8>> {
    let failed = |e: std::io::Error| Error::Failed(format!("the table cannot be written: {e}"));
    let mut comments = header(study, engine);
    comments.extend(given.remarks(study).iter().map(|r| format!("remark: {r}")));
    let mut rows: Vec<Vec<String>> = Vec::new();
    let columns: Vec<String> = match given {
        StudyResult::Table(o) => {
            let shape = o.shape();
            let points: usize = shape.iter().product();
            for i in 0..points {
                let mut rest = i;
                let mut row = vec![String::new(); shape.len()];
                for a in (0..shape.len()).rev() {
                    row[a] = o.axes[a].names[rest % shape[a]].clone();
                    rest /= shape[a];
                }
                row.extend(o.fields.iter().map(|f| rounded(f.values[i])));
                rows.push(row);
            }
            let fields = o.fields.iter().map(|f| f.name.clone());
            o.axes.iter().map(|a| a.parameter.clone()).chain(fields).collect()
        }
        StudyResult::Front(designs) => {
            let search = searched(study)?;
            for d in designs {
                let mut row = vec![d.cost.to_string()];
                row.extend(d.parameters.iter().map(f64::to_string));
                row.push(rounded(d.worth));
                row.push(u8::from(d.is_on_front(designs)).to_string());
                row.push(d.tried.to_string());
                rows.push(row);
            }
            let names = std::iter::once(&search.front)
                .chain(search.parameter.iter().map(|l| &l.name))
                .map(|n| n.value.clone());
            names.chain([search.goal.name(), "on_front", "designs_tried"].map(String::from)).collect()
        }
    };
    let header: Vec<&str> = columns.iter().map(String::as_str).collect();
    let mut w = Writer::new(Vec::new(), &comments, &header).map_err(failed)?;
    for r in &rows {
        w.row(r.iter().map(|c| c as &dyn Display)).map_err(failed)?;
    }
    w.finish().map_err(failed)
}

/// The search of a study that has one.
///
/// # Errors
/// Returns an error if the study has no search.
pub fn searched(study: &Study) -> Result<&SearchTable> {
    study.search.as_ref().ok_or_else(|| Error::Failed("a front without a search".into()))
}

/// What a column of a study's table holds.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Column {
    /// Name of the column in the table.
    pub name: String,
    /// Label in pictures, with the unit.
    pub label: String,
    /// The values of an axis in order; empty for a quantity.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub values: Vec<Value>,
    /// What the table calls these values, one name for each; empty for a quantity.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub names: Vec<String>,
}

/// The columns of a study's table, in its order.
///
/// # Errors
/// Returns an error for a front of a study without a search.
pub fn columns(study: &Study, given: &StudyResult) -> Result<Vec<Column>> {
    let quantity =
        |name: &str, label: String| Column { name: name.into(), label, values: vec![], names: vec![] };
    Ok(match given {
        StudyResult::Table(o) => {
            let axes = o.axes.iter().map(|a| Column {
                name: a.parameter.clone(),
                label: a.label.clone(),
                values: a.values.clone(),
                names: a.names.clone(),
            });
            axes.chain(o.fields.iter().map(|f| quantity(&f.name, f.label.clone()))).collect()
        }
        StudyResult::Front(designs) => {
            let search = searched(study)?;
            let name = &search.front.value;
            let front = Column {
                values: designs.iter().map(|d| Value::Number(d.cost)).collect(),
                names: designs.iter().map(|d| d.cost.to_string()).collect(),
                ..quantity(name, parameter::label(name))
            };
            let sought =
                search.parameter.iter().map(|l| quantity(&l.name.value, parameter::label(&l.name.value)));
            let last = [
                quantity(search.goal.name(), search.goal.label().into()),
                quantity("on_front", "on the front".into()),
                quantity("designs_tried", "designs tried".into()),
            ];
            std::iter::once(front).chain(sought).chain(last).collect()
        }
    })
}

/// The reflectors behind a table's rows.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize)]
pub struct Reflectors {
    /// Their specifications, each once.
    pub specs: Vec<String>,
    /// Index of each row's specification; empty where all rows have the first one.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub of_row: Vec<usize>,
}

/// The reflectors behind the rows of a study's table; none where its target is no reflector, and where a row stands for several.
///
/// # Errors
/// Returns an error for a reflector that cannot be built, and for a front of a study without a search.
pub fn reflectors(study: &Study, given: &StudyResult) -> Result<Reflectors> {
    let of_target = |name: &str| name == "target" || name.starts_with(TARGET_PREFIX);
    let mut rows: Vec<Values> = Vec::new();
    match given {
        StudyResult::Table(o) => {
            if study.sweeps.iter().any(|s| s.reduce.is_some() && of_target(&s.parameter)) {
                return Ok(Reflectors::default());
            }
            let shape = o.shape();
            for i in 0..shape.iter().product() {
                let (mut rest, mut values) = (i, Values::new());
                for (axis, n) in o.axes.iter().zip(&shape).rev() {
                    if of_target(&axis.parameter) {
                        values.insert(axis.parameter.clone(), axis.values[rest % n].clone());
                    }
                    rest /= n;
                }
                rows.push(values);
            }
        }
        StudyResult::Front(designs) => {
            if study.sweeps.iter().any(|s| of_target(&s.parameter)) {
                return Ok(Reflectors::default());
            }
            let search = searched(study)?;
            for d in designs {
                let names = search.parameter.iter().map(|l| &l.name.value).zip(&d.parameters);
                let all = std::iter::once((&search.front.value, &d.cost)).chain(names);
                let own = all.filter(|(n, _)| of_target(n));
                rows.push(own.map(|(n, v)| (n.clone(), Value::Number(*v))).collect());
            }
        }
    }
    let (mut out, mut known) = (Reflectors::default(), HashMap::new());
    for own in rows {
        let key: Vec<String> = own.iter().map(|(n, v)| format!("{n}={v}")).collect();
        let at = match known.get(&key) {
            Some(at) => *at,
            None => {
                let mut values = study.fixed.clone();
                values.extend(own);
                let Some(spec) = reflector_spec(&values)? else { return Ok(Reflectors::default()) };
                out.specs.push(spec);
                known.insert(key, out.specs.len() - 1);
                out.specs.len() - 1
            }
        };
        out.of_row.push(at);
    }
    if out.specs.len() == 1 {
        out.of_row.clear();
    }
    Ok(out)
}

/// Text of a number rounded to a millionth; empty for NaN.
fn rounded(x: f64) -> String {
    if x.is_nan() { String::new() } else { ((x * 1e6).round() / 1e6 + 0.0).to_string() }
}

/// Section of the report on one study.
///
/// # Errors
/// Returns an error if the result is a front and the study has no search.
pub fn section(study: &Study, given: &StudyResult, facts: &[Comparison]) -> Result<String> {
    let mut t = format!("## {}\n\n", study.title);
    if !study.reference.is_empty() {
        let _ = writeln!(t, "Set beside {}.\n", study.reference);
    }
    let _ = writeln!(t, "Files: [{0}.csv]({0}.csv), [{0}.png]({0}.png).\n", study.name);
    if !study.note.is_empty() {
        let _ = writeln!(t, "{}\n", study.note.trim());
    }
    let _ = writeln!(t, "![{}]({}.png)\n", study.title.replace(['[', ']'], ""), study.name);
    match given {
        StudyResult::Table(_) => {
            if !facts.is_empty() {
                let _ =
                    writeln!(t, "| fact | document | here | difference | remark |\n|---|---|---|---|---|");
                for f in facts {
                    let number = |x: f64| if x.is_nan() { "none".into() } else { with_unit(x, &f.unit) };
                    let document = match &f.expected {
                        Some(Value::Number(d)) => with_unit(*d, &f.unit),
                        Some(Value::Word(w)) => w.clone(),
                        None => "not given".into(),
                    };
                    let (ours, difference) = (number(f.ours), f.error().filter(|e| !e.is_nan()));
                    let difference = difference.map_or("–".into(), number);
                    let cell = |s: &str| s.replace('|', "\\|").replace('\n', " ");
                    let _ = writeln!(
                        t,
                        "| {} | {} | {ours} | {difference} | {} |",
                        cell(&f.name),
                        cell(&document),
                        cell(&f.source)
                    );
                }
                t.push('\n');
            }
        }
        StudyResult::Front(designs) => {
            let search = searched(study)?;
            let names: Vec<&str> = search.parameter.iter().map(|l| l.name.value.as_str()).collect();
            let _ = writeln!(
                t,
                "The front of {} against {} ({} designs tried):\n\n| {} | {} | {} |\n|{}",
                search.front.value,
                search.goal.label(),
                designs.iter().map(|d| d.tried).sum::<u64>(),
                search.front.value,
                names.join(" | "),
                search.goal.name(),
                "---|".repeat(names.len() + 2)
            );
            for d in designs.iter().filter(|d| d.is_on_front(designs)) {
                let p: Vec<String> = d.parameters.iter().map(|x| short(*x)).collect();
                let _ = writeln!(t, "| {} | {} | {} |", short(d.cost), p.join(" | "), short(d.worth));
            }
            t.push('\n');
        }
    }
    for remark in given.remarks(study) {
        let _ = writeln!(t, "{remark}.\n");
    }
    if study.convention == catseye::base::convention::Convention::Last {
        t.push_str("Only the bounce from which a ray leaves radiates here.\n\n");
    }
    let alone = word_of(&study.fixed, "ground").is_some_and(|g| g == "none");
    if alone && matches!(given, StudyResult::Table(o) if !o.targets.is_empty()) {
        t.push_str("The target alone, without ground.\n\n");
    }
    Ok(t)
}

fn with_unit(x: f64, unit: &str) -> String {
    match unit {
        "" => short(x),
        u if u.starts_with("dB") => {
            let decimals = if x.abs() < 9.995 { 2 } else { 1 };
            format!("{} {u}", level_text(x + 0.0, decimals)).replace('-', "−")
        }
        u => format!("{} {u}", short(x)),
    }
}

/// Text of a number with three or four digits.
pub fn short(x: f64) -> String {
    if x == 0.0 {
        return "0".into();
    }
    let decimals = match x.abs() {
        a if !(1e-4..1e6).contains(&a) => return format!("{x:.3e}"),
        a if a >= 1000.0 => 0,
        a if a >= 10.0 => 1,
        a if a >= 0.1 => 2,
        _ => 5,
    };
    format!("{x:.decimals$}").replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        assert_eq!(short(-14.536), "−14.5");
        assert_eq!(short(0.0043), "0.00430");
        assert_eq!(short(7.5e6), "7.500e6");
        assert_eq!(short(0.0), "0");
        assert_eq!(with_unit(-0.0137, "dB"), "−0.01 dB");
        assert_eq!(with_unit(-347.1, "dBsm"), "< −200 dBsm");
        assert_eq!(rounded(-0.0), "0");
        assert_eq!(rounded(f64::NAN), "");
    }
}
