//! Files that state what a dataset is made from and which shards are complete, and the making of scenes and
//! their frames.

use super::drawn_scene::DrawnScene;
use super::kept_radar::{KeptRadar, RadarsOfScenes};
use super::recipe::{Recipe, SplitRule, VERSION};
use super::store::{DatasetLayout, ShardFile};
use super::tally::Tally;
use catseye::base::control::Control;
use catseye::base::error::{BadInput, Error, Result, json_in_words};
use catseye::engine::{Engine, EngineReport, Tracing};
use catseye::formats::stage;
use catseye::simulate::{Frame, Prepared};
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::Path;
use std::sync::Arc;

/// Name of the file that states what a dataset is made from.
pub const DATASET: &str = "dataset.json";
/// Name of the folder of the markers.
pub const SHARDS: &str = "shards";

/// The properties of an engine that determine the bytes of its results.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Device {
    /// `cpu` or `gpu`.
    pub engine: String,
    /// `f32` or `f64`.
    pub precision: String,
    /// Name of the adapter; empty on the CPU.
    pub adapter: String,
    /// Driver of the adapter; empty on the CPU.
    pub driver: String,
    /// Where the beams of frames are followed. Datasets made before December 2026 say nothing here; they had the host.
    #[serde(default = "on_host")]
    pub trace: Tracing,
}

fn on_host() -> Tracing {
    Tracing::Host
}

impl Device {
    /// The device of an engine's report.
    pub fn of(report: &EngineReport) -> Device {
        // Of the cpu engine the driver is a number of threads, on which no byte depends.
        let driver = match report.engine {
            "cpu" => String::new(),
            _ => format!("{} {}", report.driver, report.driver_info),
        };
        Device {
            engine: report.engine.into(),
            precision: format!("{:?}", report.precision).to_lowercase(),
            adapter: report.adapter.clone(),
            driver,
            trace: report.trace,
        }
    }
}

impl std::fmt::Display for Device {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let name = format!("{} {} {}", self.adapter, self.driver, self.precision);
        let beams = match (self.engine.as_str(), self.trace) {
            ("gpu", Tracing::Host) => ", beams on the host",
            ("gpu", Tracing::Lines) => ", beams by lines",
            _ => "",
        };
        write!(f, "{}{beams}", name.replace("  ", " "))
    }
}

/// Content of `dataset.json`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DatasetFile {
    /// Version of the format ([`VERSION`]); absent in version 1.
    #[serde(default = "version_1")]
    pub version: u32,
    /// Version of the program.
    pub catseye: String,
    /// Name of the dataset.
    pub name: String,
    /// Licence of the data, where the recipe names one.
    pub licence: Option<String>,
    /// SHA-256 of the recipe, its seed, the files that it names, and the version.
    pub recipe: String,
    /// Seed of all draws.
    pub seed: u64,
    /// Number of scenes.
    pub scenes: u32,
    /// Frames of each scene.
    pub frames_per_scene: u32,
    /// Device that made it.
    pub device: Device,
    /// The recipe as it was read.
    pub recipe_text: String,
    /// The radars of scene 0; those of scenes that differ are in the markers of their shards. None in version 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radars: Option<Vec<KeptRadar>>,
}

fn version_1() -> u32 {
    1
}

impl DatasetFile {
    /// Reads a dataset's `dataset.json`.
    ///
    /// # Errors
    /// Returns an error if the file is missing, cannot be read, or is damaged.
    pub fn read(dir: &Path) -> Result<DatasetFile> {
        let path = dir.join(DATASET);
        let bytes = match fs::read(&path) {
            Ok(b) => b,
            Err(e)
                if matches!(e.kind(), std::io::ErrorKind::NotFound | std::io::ErrorKind::NotADirectory) =>
            {
                return Err(BadInput::new("is not a dataset: it has no dataset.json")
                    .file(dir)
                    .remedy("name the folder that `catseye dataset` wrote")
                    .into());
            }
            Err(e) => return Err(Error::io(path, e)),
        };
        let damaged = |e: serde_json::Error| {
            BadInput::new(format!("damaged: {}", json_in_words(&e)))
                .file(&path)
                .remedy("bring back the file that was written")
        };
        let value: serde_json::Value = serde_json::from_slice(&bytes).map_err(damaged)?;
        let version = value.get("version").and_then(serde_json::Value::as_u64);
        if let Some(later) = version.filter(|v| *v > VERSION.into()) {
            return Err(BadInput::new("written by a later version")
                .file(&path)
                .key("version")
                .value(later)
                .allowed(format!("up to {VERSION}"))
                .remedy("read it with that version of catseye")
                .into());
        }
        Ok(serde_json::from_slice(&bytes).map_err(damaged)?)
    }

    /// The recipe that it was made from, with the splits of its version.
    ///
    /// # Errors
    /// Returns the errors of a recipe file for a text that was changed.
    pub fn recipe(&self, dir: &Path) -> Result<Recipe> {
        let rule = if self.version < 2 { SplitRule::Ranked } else { SplitRule::Stable };
        Recipe::parse_split(&dir.join(DATASET), &self.recipe_text, Some(self.seed), rule)
    }

    /// The radars of each scene of a shard that differ from [`radars`](DatasetFile::radars).
    ///
    /// # Errors
    /// Returns `BadInput` for a shard without a readable marker.
    pub fn radars_of_shard(dir: &Path, shard: u64) -> Result<RadarsOfScenes> {
        #[derive(Deserialize)]
        struct Only {
            #[serde(default)]
            radars: RadarsOfScenes,
        }
        let path = dir.join(Marker::name(shard));
        let bad = |problem: String| {
            BadInput::new(problem)
                .file(&path)
                .remedy("run the same `catseye dataset` command, which makes the shard again")
        };
        let bytes = fs::read(&path).map_err(|e| match e.kind() {
            std::io::ErrorKind::NotFound => bad("the shard is not complete: it has no marker".into()).into(),
            _ => Error::io(&path, e),
        })?;
        let only: Only =
            serde_json::from_slice(&bytes).map_err(|e| bad(format!("damaged: {}", json_in_words(&e))))?;
        Ok(only.radars)
    }
}

/// Content of `shards/000012.json`, which marks a shard as complete.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Marker {
    /// Number of the shard.
    pub shard: u64,
    /// Number of the first frame.
    pub first_frame: u64,
    /// Number of frames.
    pub frames: u64,
    /// Identity of the recipe, as in `dataset.json`.
    pub recipe: String,
    /// Device that made it.
    pub device: Device,
    /// Rule by which `auto` chose the engine of the run that made it, where it had a choice.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub engine_rule: Option<String>,
    /// Its files with their checksums.
    pub files: Vec<ShardFile>,
    /// Counts over its frames.
    pub tally: Tally,
    /// SHA-256 of all that determines its bytes, with its scenes as they were drawn; by it a shard is
    /// recognised when the recipe was changed.
    #[serde(default)]
    pub drawn_from: String,
    /// Radars of its scenes that differ from those of `dataset.json`; empty where radars are not drawn.
    #[serde(default, skip_serializing_if = "RadarsOfScenes::is_empty")]
    pub radars: RadarsOfScenes,
}

impl Marker {
    /// Name of the marker of a shard, relative to the dataset's folder.
    pub fn name(shard: u64) -> String {
        format!("{SHARDS}/{shard:06}.json")
    }

    /// Reads the marker of a shard; None if it is missing or cannot be read.
    pub fn read(dir: &Path, shard: u64) -> Option<Marker> {
        serde_json::from_slice(&fs::read(dir.join(Marker::name(shard))).ok()?).ok()
    }

    /// Whether it describes this shard, with all files present and of their stated length.
    pub fn holds(&self, dir: &Path, shard: u64, layout: &DatasetLayout, recipe: &str) -> bool {
        let frames = layout.frames_of(shard);
        let there =
            |f: &ShardFile| fs::metadata(dir.join(&f.path)).is_ok_and(|m| m.is_file() && m.len() == f.bytes);
        self.shard == shard
            && self.recipe == recipe
            && self.first_frame == frames.start
            && self.frames == frames.end - frames.start
            && self.files.iter().all(there)
    }
}

/// Builds a scene of a recipe.
///
/// # Errors
/// Returns the errors of the scene's readers and builders, with the scene's number.
pub fn drawn_scene(recipe: &Recipe, scene: u32) -> Result<DrawnScene> {
    DrawnScene::new(recipe.draw(scene)?).map_err(|e| match e {
        Error::Input(mut b) => {
            b.problem += &format!(" in scene {scene}");
            b.file = b.file.or_else(|| Some(recipe.path().to_path_buf()));
            Error::Input(b)
        }
        e => e,
    })
}

/// A scene made ready for its frames, whose echoes are traced or come from where the recipe says. They are made for all products.
///
/// # Errors
/// Returns the errors of [`Prepared::new`].
pub fn ready<'a>(recipe: &'a Recipe, site: &DrawnScene) -> Result<Prepared<'a>> {
    let prepared = Prepared::shared(&site.scenario, &site.scene)?;
    let Some(kept) = &recipe.kept else { return Ok(prepared) };
    let (scene, scenario) = (site.number, Arc::clone(&site.scenario));
    Ok(prepared.recalling(Box::new(move |which, index| {
        let radars = &scenario.radars;
        (kept.give)(scene, index, &radars[which].name, radars.len() == 1)
    })))
}

/// [`ready`] for frames that have what the dataset keeps, and nothing else.
///
/// # Errors
/// Returns the errors of [`Prepared::new`].
pub fn prepared<'a>(recipe: &'a Recipe, site: &DrawnScene) -> Result<Prepared<'a>> {
    // No table of a dataset has the power that the limit of bounces cuts off.
    Ok(ready(recipe, site)?.making(recipe.keep.products()).without_cut_power())
}

/// Simulates a frame of all radars.
///
/// # Errors
/// Returns the errors of the simulation, with scene and frame.
pub fn frames_of(
    engine: &Engine,
    site: &DrawnScene,
    prepared: &Prepared<'_>,
    index: u32,
    control: Control<'_>,
) -> Result<Vec<Frame>> {
    (0..site.scenario.radars.len()).map(|which| prepared.frame(engine, which, index, control)).collect()
}

/// Writes a JSON file below the dataset's folder, complete or not at all.
///
/// # Errors
/// Returns an error if the value cannot be serialized or the file cannot be written.
pub fn write_json(dir: &Path, name: &str, value: &impl Serialize) -> Result<()> {
    let mut text = serde_json::to_string_pretty(value).map_err(|e| Error::Failed(format!("{name}: {e}")))?;
    text.push('\n');
    stage::write_file(dir.join(name), true, text.as_bytes()).map(|_| ())
}
