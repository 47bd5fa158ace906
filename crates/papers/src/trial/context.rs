//! What a trial is given: a scenario, an engine, how often to drive it, and where finished frames are kept.

use catseye::base::error::{Error, Result};
use catseye::engine::Engine;
use catseye::scene::scenario::Scenario;
use catseye::scene::toml_file::{Document, read_text};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The settings of `catseye lane` in a scenario file: its table `lane`, whose keys `T` names; `T`'s default where the table is missing.
///
/// # Errors
/// Keys and values that `T` does not know, with their line.
pub fn settings<T: DeserializeOwned + Default>(scenario: &Path) -> Result<T> {
    #[derive(Deserialize)]
    struct File<T> {
        lane: Option<T>,
    }
    let text = read_text(scenario)?;
    Ok(Document::parse(scenario, &text)?.read::<File<T>>()?.lane.unwrap_or_default())
}

/// Called with (done, of all) while a trial runs.
pub type Watch<'a> = &'a (dyn Fn(u64, u64) + Sync);

/// What a trial is given.
pub struct TrialContext<'a> {
    /// The scenario.
    pub scenario: &'a Scenario,
    /// The scenario's file: names in its settings are relative to it.
    pub path: &'a Path,
    /// The engine.
    pub engine: &'a Engine,
    /// How often the drive is made; run k has the scenario's seed plus k.
    pub runs: u32,
    /// Where finished frames are kept, so that an interrupted trial goes on; None: nowhere.
    pub keep: Option<PathBuf>,
    /// Is told how many frames are done, of how many.
    pub watch: Watch<'a>,
}

impl TrialContext<'_> {
    /// The scenario of run number `run`.
    pub fn scenario_of(&self, run: u32) -> Scenario {
        let mut scenario = self.scenario.clone();
        scenario.seed = scenario.seed.wrapping_add(u64::from(run));
        scenario
    }

    /// Tells the watcher that frame `index` of `frames` in run `run` is done.
    pub fn told(&self, run: u32, index: u32, frames: u32) {
        let frames = u64::from(frames);
        (self.watch)(u64::from(run) * frames + u64::from(index) + 1, u64::from(self.runs) * frames);
    }

    /// What `make` gives; or what it gave when this trial ran before and was interrupted. Keys are names of files and name the
    /// run and the frame. Values have no NaN.
    ///
    /// # Errors
    /// Those of `make`; the file cannot be written.
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
        // Complete, or not there.
        let unfinished = folder.join(format!("{key}.unfinished"));
        std::fs::write(&unfinished, text).map_err(|e| Error::io(&unfinished, e))?;
        std::fs::rename(&unfinished, &path).map_err(|e| Error::io(&path, e))?;
        Ok(made)
    }
}
