//! `catseye study`: parameter sweeps, maps, detection ranges and design searches, with a report.

use super::bar::Kept;
use super::global::{Global, print, print_json};
use catseye::base::error::{Error, Result};
use catseye::base::units::level_text;
use catseye_papers::study::parameter;
use catseye_papers::study::report::{StudyResult, searched, short};
use catseye_papers::study::run::{self, RunOptions};
use catseye_papers::study::spec::{PictureKind, Study};
use catseye_plot::{Panel, study_picture};
use clap::Args;
use std::path::PathBuf;

/// Run studies: parameter sweeps, maps, detection ranges, design optimisation; CSV, plots and report
#[derive(Debug, Args)]
#[command(after_help = help())]
pub struct RunStudy {
    /// Study file (TOML; `catseye init study` writes one), or a folder of study files
    pub study: PathBuf,
    /// Folder to write; the same command continues an interrupted run
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Use grids that are four times as coarse
    #[arg(long)]
    pub quick: bool,
    /// Exit with 1 if a reference value is not met: values in dB within 1 dB, other numbers within a tenth.
    /// Without it reference values are shown only
    #[arg(long)]
    pub strict: bool,
}

fn help() -> String {
    let mut text = String::from("Parameters of a study:\n");
    for p in &parameter::PARAMETERS {
        text += &format!("    {:22} {}\n", p.name, p.label);
    }
    text + "    target.NAME            a parameter of the reflector, as in target.height_m\n"
}

impl RunStudy {
    pub fn run(&self, global: &Global) -> Result<()> {
        let files = run::files(&self.study)?;
        let studies = run::load_all(&files, self.quick)?;
        let (engine, rule) = global.engine_for_target(|| Ok(run::purpose(&studies)))?;
        let bar = global.bar("study", 0, Kept::Parts);
        let report = run::run(
            &engine,
            studies,
            &self.output,
            &RunOptions {
                force: global.force,
                picture: &picture,
                rule,
                progress: &|study, done, all| {
                    if done == 0 {
                        bar.reset();
                        bar.set_length(all);
                        bar.set_message(study.name.clone());
                    }
                    bar.inc(done);
                },
            },
        )?;
        drop(bar);
        if global.json {
            print_json(&report)?;
        } else {
            for s in &report.studies {
                match &s.error {
                    None => print(&format!("{}: {}", s.name, s.title))?,
                    Some(e) => print(&format!("{}: did not run: {e}", s.name))?,
                }
                for r in &s.remarks {
                    print(&format!("    remark: {r}"))?;
                }
                for f in &s.facts {
                    let ours = match f.ours {
                        x if x.is_nan() => "none".to_string(),
                        x if f.unit.starts_with("dB") => level_text(x, 2),
                        x => short(x).replace('−', "-"),
                    };
                    let document = f.expected.as_ref().map_or("not given".to_string(), |d| d.to_string());
                    print(&format!("    {}: {ours} {} (document: {document})", f.name, f.unit))?;
                }
                for d in s.front.iter().flatten() {
                    let worth = level_text(d.worth, 2);
                    print(&format!("    {}: {worth} at {:?}", d.cost, d.parameters))?;
                }
            }
            print(&format!("wrote {}", report.folder.display()))?;
        }
        let (judged, off) = report.disagreeing();
        match report.failed {
            Some(e) => Err(e),
            None if self.strict && !off.is_empty() => Err(Error::Failed(format!(
                "{} of {judged} reference values do not agree with their documents: {}",
                off.len(),
                off.join("; ")
            ))),
            None => Ok(()),
        }
    }
}

/// The picture of what a study gave.
pub fn picture(study: &Study, given: &StudyResult) -> Result<Vec<u8>> {
    let outcome = match given {
        StudyResult::Front(designs) => {
            let search = searched(study)?;
            let curve = |label: &str, only_front: bool| catseye_plot::Curve {
                label: label.into(),
                points: designs
                    .iter()
                    .filter(|d| !only_front || d.is_on_front(designs))
                    .map(|d| [d.cost, d.worth])
                    .collect(),
            };
            let panel = Panel::Curves {
                title: study.title.clone(),
                x_label: parameter::label(&search.front.value),
                y_label: search.goal.label().into(),
                curves: vec![curve("best found", false), curve("front", true)],
                limits: study.picture.limits(),
                decibels: false,
            };
            return study_picture(&[panel], 1)?.png();
        }
        StudyResult::Table(outcome) => outcome,
    };
    let axes = &outcome.axes;
    let n = |i: usize| axes.get(i).map_or(1, |a| a.values.len());
    let named = |i: usize, k: usize| axes.get(i).map_or(String::new(), |a| value_name(a, k));
    let at =
        |field: usize, a: usize, b: usize, c: usize| outcome.fields[field].values[(a * n(1) + b) * n(2) + c];
    let mut panels = Vec::new();
    if study.picture.kind == PictureKind::Map {
        for (f, field) in outcome.fields.iter().enumerate() {
            for c in 0..n(2) {
                let parts = [study.title.clone(), named(2, c)];
                let title = parts.iter().filter(|p| !p.is_empty()).cloned().collect::<Vec<_>>().join(": ");
                panels.push(Panel::Map {
                    title: if outcome.fields.len() > 1 { format!("{title}, {}", field.label) } else { title },
                    x: parameter::axis_in_si(&axes[0].label, &axes[0].places()),
                    y: parameter::axis_in_si(&axes[1].label, &axes[1].places()),
                    // Rows are the upward axis.
                    values: (0..n(1))
                        .flat_map(|b| (0..n(0)).map(move |a| (a, b)))
                        .map(|(a, b)| at(f, a, b, c))
                        .collect(),
                    label: field.label.clone(),
                    limits: study.picture.limits(),
                    contours: study.picture.contours.clone(),
                });
            }
        }
        return study_picture(&panels, study.picture.columns)?.png();
    }
    let (x_label, x) = parameter::axis_in_si(&axes[0].label, &axes[0].places());
    for c in 0..n(2) {
        // Quantities of one unit share a panel.
        let mut groups: Vec<(String, Vec<usize>)> = Vec::new();
        for (f, field) in outcome.fields.iter().enumerate() {
            let unit = unit_of(&field.name).to_string();
            match groups.iter_mut().find(|g| g.0 == unit) {
                Some(g) => g.1.push(f),
                None => groups.push((unit, vec![f])),
            }
        }
        for (unit, fields) in groups {
            let mut curves = Vec::new();
            for &f in &fields {
                // What does not depend on the second axis is drawn once.
                let alike = fields.len() > 1
                    && (1..n(1)).all(|b| (0..n(0)).all(|a| at(f, a, b, c) == at(f, a, 0, c)));
                for b in 0..if alike { 1 } else { n(1) } {
                    let mut parts = Vec::new();
                    if fields.len() > 1 {
                        parts.push(outcome.fields[f].label.clone());
                    }
                    if !alike {
                        parts.push(named(1, b));
                    }
                    curves.push(catseye_plot::Curve {
                        label: parts.into_iter().filter(|p| !p.is_empty()).collect::<Vec<_>>().join(", "),
                        points: x.iter().enumerate().map(|(a, x)| [*x, at(f, a, b, c)]).collect(),
                    });
                }
            }
            let parts = [study.title.clone(), named(2, c)];
            panels.push(Panel::Curves {
                title: parts.iter().filter(|p| !p.is_empty()).cloned().collect::<Vec<_>>().join(": "),
                x_label: x_label.clone(),
                y_label: match (fields.len(), unit.as_str()) {
                    (1, _) => outcome.fields[fields[0]].label.clone(),
                    (_, "dBsm") => "RCS (dBsm)".into(),
                    _ => format!("({unit})"),
                },
                curves,
                // Limits are those of the first unit asked for.
                limits: study.picture.limits().filter(|_| unit == unit_of(&outcome.fields[0].name)),
                decibels: unit.starts_with("dB"),
            });
        }
    }
    study_picture(&panels, study.picture.columns)?.png()
}

/// "H = 4 mm" from the names that the study gives, else the parameter's label with its value and unit.
fn value_name(axis: &catseye_papers::study::StudySweep, k: usize) -> String {
    let own = axis.values[k].to_string() != axis.names[k];
    match axis.numbers() {
        Some(numbers) if !own => parameter::value_in_si(&axis.label, &numbers, k),
        _ => axis.names[k].clone(),
    }
}

fn unit_of(field: &str) -> &'static str {
    match field.rsplit_once('_').map(|p| p.1) {
        Some("dbsm") => "dBsm",
        Some("db") => "dB",
        Some("deg") => "deg",
        Some("m") => "m",
        _ => "1",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use catseye_papers::study::StudySweep;
    use catseye_papers::study::parameter::Value;

    #[test]
    fn legends_have_units() {
        let axis = |label: &str, values: &[f64], names: Option<&[&str]>| StudySweep {
            parameter: "frequency_hz".into(),
            label: label.into(),
            values: values.iter().map(|x| Value::Number(*x)).collect(),
            names: names.map_or(values.iter().map(f64::to_string).collect(), |n| {
                n.iter().map(|n| n.to_string()).collect()
            }),
            reduce: None,
        };
        assert_eq!(value_name(&axis("frequency (Hz)", &[24e9, 77e9], None), 0), "frequency = 24 GHz");
        assert_eq!(value_name(&axis("frequency (Hz)", &[24e9], Some(&["low"])), 0), "low");
    }
}
