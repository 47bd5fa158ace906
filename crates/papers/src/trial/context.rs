//! Input of a trial: a scenario, an engine, the number of drives, and the place for finished frames.

use catseye::base::error::{Error, Result};
use catseye::engine::Engine;
use catseye::scene::scenario::Scenario;
use catseye::scene::toml_file::{Document, read_text};
use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Reads the settings of `catseye lane` from a scenario file: its table `lane` with the keys of `T`, or `T`'s
/// default where the table is missing.
///
/// # Errors
/// Returns an error if the file cannot be read, or for keys and values that `T` does not know, with their
/// line.
pub fn settings<T: DeserializeOwned + Default + JsonSchema + 'static>(scenario: &Path) -> Result<T> {
    #[derive(Deserialize, JsonSchema)]
    struct File<T> {
        lane: Option<T>,
    }
    let text = read_text(scenario)?;
    Ok(Document::parse(scenario, &text)?.read::<File<T>>()?.lane.unwrap_or_default())
}

/// Function that is called with (done, total) frames while a trial runs.
pub type Watch<'a> = &'a (dyn Fn(u64, u64) + Sync);

/// Input of a trial.
pub struct TrialContext<'a> {
    /// The scenario.
    pub scenario: &'a Scenario,
    /// The scenario's file; names in its settings are relative to it.
    pub path: &'a Path,
    /// The engine.
    pub engine: &'a Engine,
    /// Number of drives; run k has the scenario's seed plus k.
    pub runs: u32,
    /// Folder of finished frames, so that an interrupted trial continues; None to keep nothing.
    pub keep: Option<PathBuf>,
    /// Function that is told the number of finished frames and the total.
    pub watch: Watch<'a>,
}

impl TrialContext<'_> {
    /// The scenario of run number `run`.
    pub fn scenario_of(&self, run: u32) -> Scenario {
        let mut scenario = self.scenario.clone();
        scenario.seed = scenario.seed.wrapping_add(u64::from(run));
        scenario
    }

    /// Reports that frame `index` of `frames` in run `run` is done.
    pub fn report_frame(&self, run: u32, index: u32, frames: u32) {
        let frames = u64::from(frames);
        (self.watch)(u64::from(run) * frames + u64::from(index) + 1, u64::from(self.runs) * frames);
    }

    /// Returns the result of `make`, or the kept one if this trial ran before and was interrupted. Keys are
    /// file names that contain the run and the frame. Values must not contain NaN.
    ///
    /// # Errors
    /// Returns the errors of `make`, and an error if the file cannot be written.
    pub fn kept<T: Serialize + DeserializeOwned>(
        &self,
        key: &str,
        make: impl FnOnce() -> Result<T>,
    ) -> Result<T> {
        let Some(folder) = &self.keep else { return make() };
        let path = folder.join(format!("{key}.json"));
        if let Some(known) = std::fs::read(&path).ok().and_then(|b| serde_json::from_slice(&b).ok()) {
            return Ok(known);
        }
        let made = make()?;
        let text = serde_json::to_vec(&made).map_err(|e| Error::Failed(format!("{key}: {e}")))?;
        // The file is complete or absent.
        let unfinished = folder.join(format!("{key}.unfinished"));
        std::fs::write(&unfinished, text).map_err(|e| Error::io(&unfinished, e))?;
        std::fs::rename(&unfinished, &path).map_err(|e| Error::io(&path, e))?;
        Ok(made)
    }
}
