//! The result folder of a command over scenario files: resumable, with a manifest.

use crate::trial::context::Watch;
use crate::trial::report::{Row, Trial};
use catseye::base::error::{Error, Result};
use catseye::engine::{Engine, EngineReport};
use catseye::formats::stage::{StagedDir, sha256_of_bytes};
use catseye::scene::scenario::Scenario;
use catseye::scene::toml_file::read_text;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Options of a run.
pub struct RunOptions<'a> {
    /// Whether an existing result is replaced.
    pub force: bool,
    /// Number of runs in place of the scenario's.
    pub runs: Option<u32>,
    /// Number of frames in place of the scenario's.
    pub frames: Option<u32>,
    /// Seed in place of the scenario's.
    pub seed: Option<u64>,
    /// Function that is told the number of finished frames and the total.
    pub watch: Watch<'a>,
}

/// Report on a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunReport {
    /// Folder of the result.
    #[serde(serialize_with = "catseye::formats::path_text")]
    pub folder: PathBuf,
    /// Name of the method.
    pub method: String,
    /// Title of the report.
    pub title: String,
    /// Values of the report.
    pub rows: Vec<Row>,
    /// Remarks, one a line.
    pub notes: Vec<String>,
}

/// The folder's `manifest.json`.
#[derive(Serialize)]
pub struct Manifest<'a> {
    pub catseye: &'a str,
    pub engine: EngineReport,
    pub command: &'a str,
    pub seed: u64,
    pub runs: u32,
    /// Texts of the scenario files.
    pub scenarios: BTreeMap<String, String>,
    /// Time that one look took the estimator on this machine, s: median and worst, by method.
    pub seconds_per_look: BTreeMap<String, [f64; 2]>,
}

/// A folder under construction for a command over some scenario files, and the place of its finished frames.
pub struct ResultFolder<'a> {
    staged: StagedDir,
    /// Folder of finished frames.
    pub keep: PathBuf,
    engine: &'a Engine,
    command: &'a str,
    paths: &'a [&'a Path],
}

impl<'a> ResultFolder<'a> {
    /// Opens the folder of a command over the scenario files `paths`.
    ///
    /// # Errors
    /// Returns an error if a file cannot be read, or if the folder exists and must not be replaced.
    pub fn open(
        command: &'a str,
        paths: &'a [&'a Path],
        engine: &'a Engine,
        out: &Path,
        o: &RunOptions<'_>,
    ) -> Result<Self> {
        // All that determines the bytes: a run with another one of these does not continue this one.
        let (version, RunOptions { runs, frames, seed, .. }) = (env!("CARGO_PKG_VERSION"), o);
        let mut identity = format!("{version} {command} {:?} {runs:?} {frames:?} {seed:?}", engine.report());
        for path in paths {
            identity += &read_text(path)?;
        }
        let identity = sha256_of_bytes(identity.as_bytes());
        let (staged, keep) = StagedDir::resumable(out, o.force, "lane", &identity)?;
        Ok(ResultFolder { staged, keep, engine, command, paths })
    }

    pub fn path(&self) -> &Path {
        self.staged.path()
    }

    /// Writes the results of `trial` and the manifest with the times of the steps by method, and gives the
    /// folder its final name.
    ///
    /// # Errors
    /// Returns an error if a file cannot be written.
    pub fn finish(
        self,
        (seed, runs): (u64, u32),
        trial: Trial,
        steps: BTreeMap<String, Vec<f64>>,
    ) -> Result<RunReport> {
        let dir = self.staged.path();
        trial.write(dir)?;
        let mut scenarios = BTreeMap::new();
        for path in self.paths {
            let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
            scenarios.insert(name, read_text(path)?);
        }
        let middle = |mut v: Vec<f64>| {
            v.sort_by(f64::total_cmp);
            [v.get(v.len() / 2).copied().unwrap_or(0.0), v.last().copied().unwrap_or(0.0)]
        };
        let manifest = Manifest {
            catseye: env!("CARGO_PKG_VERSION"),
            engine: self.engine.report(),
            command: self.command,
            seed,
            runs,
            scenarios,
            seconds_per_look: steps.into_iter().map(|(k, v)| (k, middle(v))).collect(),
        };
        let text =
            serde_json::to_vec_pretty(&manifest).map_err(|e| Error::Failed(format!("manifest: {e}")))?;
        let path = dir.join("manifest.json");
        std::fs::write(&path, text).map_err(|e| Error::io(&path, e))?;
        let folder = self.staged.commit()?;
        let Trial { method, title, rows, notes, .. } = trial;
        Ok(RunReport { folder, method, title, rows, notes })
    }
}

/// Loads the scenario of a file with the caller's changes.
pub fn scenario(path: &Path, o: &RunOptions<'_>) -> Result<Scenario> {
    let mut scenario = Scenario::load(path)?;
    if let Some(n) = o.frames {
        scenario.frames.count = n;
    }
    if let Some(seed) = o.seed {
        scenario.seed = seed;
    }
    Ok(scenario)
}
