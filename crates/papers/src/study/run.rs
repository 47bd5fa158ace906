//! Runs studies into a folder: a CSV and a picture of each, one report, a manifest. What was finished before
//! an interruption is recognised by its content and used again.

use super::file::load;
use super::outcome::{Work, compute};
use super::report::{Column, Reflectors, StudyResult, columns, compare, csv, header, reflectors, section};
use super::search::{Design, best, designs_at_limits};
use super::solve::Cache;
use super::spec::Study;
use crate::comparison::Comparison;
use catseye::base::error::{BadInput, Error, Result};
use catseye::engine::solver::Solver;
use catseye::engine::{EngineReport, Purpose};
use catseye::formats::stage::{MANIFEST, StagedDir, sha256_of_bytes, write_file};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Function that draws the result of a study as PNG bytes.
pub type Picture<'a> = &'a dyn Fn(&Study, &StudyResult) -> Result<Vec<u8>>;

/// Options of [`run`].
pub struct RunOptions<'a> {
    /// Whether existing results are replaced.
    pub force: bool,
    /// Function that draws a study's picture.
    pub picture: Picture<'a>,
    /// Rule by which `auto` chose the engine, where it had a choice.
    pub rule: Option<&'static str>,
    /// Called with (study, number newly done, total); the total is known from the call with 0 newly done.
    pub progress: &'a (dyn Fn(&Study, u64, u64) + Sync),
}

/// Report on one study.
#[derive(Debug, Clone, Default, serde::Serialize)]
pub struct StudyReport {
    /// Name of the study.
    pub name: String,
    /// Title of the study.
    pub title: String,
    /// Source that the study is compared with.
    pub reference: String,
    /// Names of its files in the folder.
    pub files: Vec<String>,
    /// What the columns of its table hold; empty where it did not run.
    pub columns: Vec<Column>,
    /// The reflectors behind the rows of its table.
    pub reflectors: Reflectors,
    /// Its facts with this program's numbers, each with whether the two agree.
    #[serde(serialize_with = "judged")]
    pub facts: Vec<Comparison>,
    /// Limits of physical optics, and searches that ended at a limit of their range.
    pub remarks: Vec<String>,
    /// Front of a design search.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub front: Option<Vec<Design>>,
    /// The reason why it did not run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
}

/// Facts, each with whether it agrees with its document; null where the document gives no number.
fn judged<S: serde::Serializer>(facts: &[Comparison], s: S) -> std::result::Result<S::Ok, S::Error> {
    #[derive(serde::Serialize)]
    struct Judged<'a> {
        #[serde(flatten)]
        fact: &'a Comparison,
        agrees: Option<bool>,
    }
    s.collect_seq(facts.iter().map(|fact| Judged { fact, agrees: fact.agrees() }))
}

/// Report on a run.
#[derive(Debug, serde::Serialize)]
pub struct RunReport {
    /// Folder of the results.
    #[serde(serialize_with = "catseye::formats::path_text")]
    pub folder: PathBuf,
    /// Rule by which `auto` chose the engine, where it had a choice.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub engine_rule: Option<&'static str>,
    /// Reports of the studies.
    pub studies: Vec<StudyReport>,
    /// Error of the first study that did not run.
    #[serde(skip)]
    pub failed: Option<Error>,
}

impl RunReport {
    /// Number of facts for which the document gives a number, and those among them that do not agree here, as
    /// `study: fact`.
    pub fn disagreeing(&self) -> (usize, Vec<String>) {
        let facts = self.studies.iter().flat_map(|s| s.facts.iter().map(move |f| (s, f)));
        let judged: Vec<_> = facts.filter_map(|(s, f)| Some((s, f, f.agrees()?))).collect();
        let off = judged.iter().filter(|(.., agrees)| !agrees);
        (judged.len(), off.map(|(s, f, _)| format!("{}: {}", s.name, f.name)).collect())
    }
}

#[derive(serde::Serialize)]
struct Manifest<'a> {
    catseye: &'static str,
    engine: EngineReport,
    #[serde(skip_serializing_if = "Option::is_none")]
    engine_rule: Option<&'static str>,
    studies: &'a [StudyReport],
    /// Texts of the study files.
    sources: BTreeMap<String, String>,
}

/// The study files that a path names: the path itself, or every .toml of a folder in order of name.
///
/// # Errors
/// Returns an error for a folder that cannot be read or that has no study.
pub fn files(path: &Path) -> Result<Vec<PathBuf>> {
    if !path.is_dir() {
        return Ok(vec![path.to_path_buf()]);
    }
    let mut found = Vec::new();
    for entry in fs::read_dir(path).map_err(|e| Error::io(path, e))? {
        let p = entry.map_err(|e| Error::io(path, e))?.path();
        if p.extension().is_some_and(|e| e == "toml") && p.is_file() {
            found.push(p);
        }
    }
    found.sort();
    match found.is_empty() {
        true => {
            Err(BadInput::new("contains no study").file(path).remedy("give a folder with .toml files").into())
        }
        false => Ok(found),
    }
}

/// Loads the studies of `files`. The error of a single file is returned; of several files, those that cannot
/// run are returned beside the others.
///
/// # Errors
/// Returns the error of a single file, and an error if two studies have one name.
pub fn load_all(files: &[PathBuf], quick: bool) -> Result<Vec<(PathBuf, Result<Study>)>> {
    if let [one] = files {
        return Ok(vec![(one.clone(), Ok(load(one, quick)?))]);
    }
    let loaded: Vec<_> = files.iter().map(|f| (f.clone(), load(f, quick))).collect();
    let mut names: BTreeMap<&str, &Path> = BTreeMap::new();
    for (file, study) in &loaded {
        if let Ok(s) = study
            && let Some(other) = names.insert(&s.name, file)
        {
            let bad = BadInput::new(format!("{} has the same name", other.display())).file(file).key("name");
            return Err(bad.value(&s.name).remedy("give each study its own name").into());
        }
    }
    Ok(loaded)
}

/// The purpose for which the engine of these studies is opened: one engine takes all of them, so that one target which only the cpu engine
/// can take decides for all.
pub fn purpose(studies: &[(PathBuf, Result<Study>)]) -> Purpose {
    let loaded = studies.iter().filter_map(|(_, study)| study.as_ref().ok());
    loaded.map(target_purpose).find(|p| *p != Purpose::General).unwrap_or(Purpose::General)
}

/// Runs `studies` by `solver` into the folder `out`.
///
/// # Errors
/// Returns an error if the folder cannot be written, and with a single study that study's error.
pub fn run(
    solver: &dyn Solver,
    studies: Vec<(PathBuf, Result<Study>)>,
    out: &Path,
    options: &RunOptions<'_>,
) -> Result<RunReport> {
    let single = studies.len() == 1;
    // Finished work is recognised by its content, so any earlier start in this folder may be continued.
    let (staged, cache) = StagedDir::resumable(out, options.force, "study", "catseye studies 1")?;
    for old in fs::read_dir(staged.path()).map_err(|e| Error::io(staged.path(), e))? {
        // Results of an earlier start; what stays is their cache.
        let p = old.map_err(|e| Error::io(staged.path(), e))?.path();
        fs::remove_file(&p).map_err(|e| Error::io(&p, e))?;
    }
    let mut reports = Vec::new();
    let mut text = String::new();
    let mut failed = None;
    let mut sources = BTreeMap::new();
    for (file, study) in studies {
        let done = match study {
            Ok(study) => {
                sources.insert(study.name.clone(), study.source.clone());
                one(solver, &study, staged.path(), &cache, options)
                    .map_err(|e| (study.name.clone(), study.title.clone(), e))
            }
            Err(e) => {
                let name = file.file_stem().map_or(String::new(), |s| s.to_string_lossy().into_owned());
                Err((name.clone(), name, e))
            }
        };
        match done {
            Ok((report, part)) => {
                reports.push(report);
                text += &part;
            }
            Err((_, _, e)) if single => return Err(e),
            Err((name, title, e)) => {
                text += &format!("## {title}\n\nDid not run: {e}.\n\n");
                let error = Some(e.to_string());
                reports.push(StudyReport { name, title, error, ..StudyReport::default() });
                failed.get_or_insert(e);
            }
        }
    }
    let head = format!(
        "# Studies\n\nWritten by catseye {} on {}. \"Document\" is what the text set beside a study states; \"here\" is what this \
         program computes from the same description, with nothing tuned towards it.\n\n",
        env!("CARGO_PKG_VERSION"),
        described(&solver.report())
    );
    write_file(staged.path().join("REPORT.md"), true, format!("{head}{text}").as_bytes())?;
    let manifest = Manifest {
        catseye: env!("CARGO_PKG_VERSION"),
        engine: solver.report(),
        engine_rule: options.rule,
        studies: &reports,
        sources,
    };
    let json = serde_json::to_vec_pretty(&manifest).map_err(|e| Error::Failed(format!("manifest: {e}")))?;
    write_file(staged.path().join(MANIFEST), true, &json)?;
    let folder = staged.commit()?;
    Ok(RunReport { folder, engine_rule: options.rule, studies: reports, failed })
}

/// The purpose of one study. What cannot be built is `General`: the run itself reports the error.
fn target_purpose(study: &Study) -> Purpose {
    for study in designs_at_limits(study) {
        let Ok(work) = Work::collect(&study, study.points(), &|i| study.values_at(i)) else { continue };
        if let Ok(purpose) = work.purpose(study.accuracy_db)
            && purpose != Purpose::General
        {
            return purpose;
        }
    }
    Purpose::General
}

/// Describes the engine without the number of threads: equal results are equal bytes.
fn described(r: &EngineReport) -> String {
    match r.adapter == r.engine {
        true => format!("{} ({:?})", r.engine, r.precision).to_lowercase(),
        false => format!("{}: {} ({})", r.engine, r.adapter, r.driver),
    }
}

fn one(
    solver: &dyn Solver,
    study: &Study,
    folder: &Path,
    cache: &Path,
    options: &RunOptions<'_>,
) -> Result<(StudyReport, String)> {
    let r = solver.report();
    // The number of threads does not change a result.
    let EngineReport { engine: kind, precision, adapter, driver, .. } = &r;
    let version = env!("CARGO_PKG_VERSION");
    let prefix = format!("{version} {kind} {precision:?} {adapter} {driver} {:?}", study.convention);
    let given = match &study.search {
        None => {
            let kept = Cache { folder: cache, prefix };
            let progress = |done: u64, all: u64| (options.progress)(study, done, all);
            StudyResult::Table(compute(solver, study, Some(&kept), &progress)?)
        }
        Some(search) => {
            let all = search.front_values.value.len() as u64;
            (options.progress)(study, 0, all);
            let mut designs = Vec::new();
            for (i, &cost) in search.front_values.value.iter().enumerate() {
                let identity = format!(
                    "{prefix}|{:?}|{:?}|{:?}|{i}|{:x}",
                    study.fixed,
                    study.sweeps,
                    (search, study.options("none", 1.0, 0.0)?, &study.detection, &study.mounts),
                    cost.to_bits()
                );
                let file = cache.join(format!("{}.design", sha256_of_bytes(identity.as_bytes())));
                let known: Option<Design> =
                    fs::read(&file).ok().and_then(|b| serde_json::from_slice(&b).ok());
                let design = match known {
                    Some(d) => d,
                    None => {
                        let d = best(solver, study, search, cost, i as u32)?;
                        let json =
                            serde_json::to_vec(&d).map_err(|e| Error::Failed(format!("design: {e}")))?;
                        write_file(&file, true, &json)?;
                        d
                    }
                };
                (options.progress)(study, 1, all);
                designs.push(design);
            }
            StudyResult::Front(designs)
        }
    };
    let facts = compare(study, &given);
    let (table, picture) = (format!("{}.csv", study.name), format!("{}.png", study.name));
    let described = described(&r);
    write_file(folder.join(&table), true, &csv(study, &given, &described)?)?;
    write_file(folder.join(&picture), true, &(options.picture)(study, &given)?)?;
    let mut part = section(study, &given, &facts)?;
    part += &format!(
        "<details><summary>settings</summary>\n\n{}\n\n</details>\n\n",
        header(study, &described).join("  \n")
    );
    let remarks = given.remarks(study);
    let (columns, reflectors) = (columns(study, &given)?, reflectors(study, &given)?);
    let front = match given {
        StudyResult::Front(d) => Some(d),
        StudyResult::Table(_) => None,
    };
    let Study { name, title, reference, .. } = study.clone();
    Ok((
        StudyReport {
            name,
            title,
            reference,
            files: vec![table, picture],
            columns,
            reflectors,
            facts,
            remarks,
            front,
            error: None,
        },
        part,
    ))
}
