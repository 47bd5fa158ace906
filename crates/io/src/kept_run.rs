//! A run whose frames hold their echoes, from which frames of other radars are made.

use super::echo_file::{AGAIN, ORIGIN, TABLE, read_from};
use super::files::frame_name;
use super::manifest::{EchoSource, PerRadar};
use catseye::base::error::{BadInput, Result, json_in_words};
use catseye::formats::input::{LARGEST_TEXT, read};
use catseye::formats::stage::{MANIFEST, sha256_of_bytes, sha256_of_file};
use catseye::scene::scenario::SitedScenario;
use catseye::simulate::kept::KeptTrace;
use serde::Deserialize;
use serde::de::IgnoredAny;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A run whose frames hold their echoes.
#[derive(Debug)]
pub struct KeptRun {
    folder: PathBuf,
    /// Names of its radars, where it has several.
    radars: Option<Vec<String>>,
    frames: u32,
    checksums: BTreeMap<String, String>,
    /// What the run is.
    pub source: EchoSource,
}

/// What of a run's `manifest.json` matters here.
#[derive(Deserialize)]
struct RunManifest {
    #[serde(default)]
    scenario_name: String,
    radar: PerRadar<IgnoredAny>,
    frames: Vec<FrameNumber>,
    checksums: BTreeMap<String, String>,
}

#[derive(Deserialize)]
struct FrameNumber {
    index: u32,
}

impl KeptRun {
    /// Opens the folder of a run.
    ///
    /// # Errors
    /// Returns `BadInput` for a folder that holds no run, or one whose first frame has no echoes.
    pub fn open(folder: &Path) -> Result<KeptRun> {
        let path = folder.join(MANIFEST);
        if !path.is_file() {
            return Err(BadInput::new("is not a run: it has no manifest.json")
                .file(folder)
                .key("--from")
                .remedy("give the folder that `catseye simulate` wrote")
                .into());
        }
        let bytes = read(&path, "a run's manifest", LARGEST_TEXT)?;
        let run: RunManifest = serde_json::from_slice(&bytes).map_err(|e| {
            BadInput::new(format!("is not the manifest of a run: {}", json_in_words(&e)))
                .file(&path)
                .remedy("give the folder that `catseye simulate` wrote")
        })?;
        Ok(KeptRun {
            folder: folder.into(),
            radars: match run.radar {
                PerRadar::One(_) => None,
                PerRadar::Several(by_name) => Some(by_name.into_keys().collect()),
            },
            frames: run.frames.iter().map(|f| f.index + 1).max().unwrap_or(0),
            checksums: run.checksums,
            source: EchoSource { scenario_name: run.scenario_name, manifest_sha256: sha256_of_bytes(&bytes) },
        })
    }

    /// Refuses a scenario that has more frames than the run, or radars of other names.
    ///
    /// # Errors
    /// Returns `BadInput` that says what is missing.
    pub fn check(&self, scenario: &SitedScenario) -> Result<()> {
        if scenario.frames.count > self.frames {
            return Err(BadInput::new("the scenario has more frames than the run")
                .file(&self.folder)
                .key("frames.count")
                .value(scenario.frames.count)
                .allowed(format!("up to {}", self.frames))
                .remedy("give --frames N, or simulate more frames there")
                .into());
        }
        for radar in &scenario.radars {
            self.place(scenario, &radar.name, 0)?;
        }
        Ok(())
    }

    /// Path of a radar's frame below the folder.
    fn place(&self, scenario: &SitedScenario, radar: &str, index: u32) -> Result<String> {
        let frame = frame_name(index);
        match &self.radars {
            None if scenario.radars.len() == 1 => Ok(frame),
            Some(names) if names.iter().any(|n| n == radar) => Ok(format!("{frame}/{radar}")),
            names => Err(BadInput::new("the run has no radar of this name")
                .file(&self.folder)
                .key("radars.name")
                .value(radar)
                .allowed(names.as_ref().map_or("one radar alone".into(), |n| n.join(", ")))
                .remedy("use the name of the radar in the run")
                .into()),
        }
    }

    /// The echoes of a radar's frame.
    ///
    /// # Errors
    /// Returns the errors of [`read_from`], and `BadInput` for files that changed since the run wrote them.
    pub fn trace(&self, scenario: &SitedScenario, radar: &str, index: u32) -> Result<KeptTrace> {
        let place = self.place(scenario, radar, index)?;
        let dir = self.folder.join(&place);
        for name in [TABLE, ORIGIN] {
            let path = dir.join(name);
            let known = self.checksums.get(&format!("{place}/{name}"));
            if let (Some(known), true) = (known, path.is_file())
                && sha256_of_file(&path)? != *known
            {
                return Err(BadInput::new("has changed since the run wrote it")
                    .file(&path)
                    .remedy(AGAIN)
                    .into());
            }
        }
        read_from(&dir)
    }
}
