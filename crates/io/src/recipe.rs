//! The recipe TOML: a road scene and a scenario in which any value may be a distribution, the number of
//! scenes drawn from them, and what is kept. Each scene is two plain texts that the ordinary readers parse.

use super::draw::{Changes, Draws, Node, Origin, Tree, word};
use super::echo_file::KeptEchoes;
use super::kept_radar::{KeptRadar, RadarsOfScenes};
use super::store::{ColumnKind, ColumnSpec, Compression, DatasetLayout, Format, TableSpec};
use super::traffic::{Sizes, first_clash};
use catseye::base::error::{BadInput, Error, Result};
use catseye::formats::stage::{sha256_of_bytes, sha256_of_file};
use catseye::road::plan::ScenePlan;
use catseye::road::scene_toml;
use catseye::scene::radar::Radar;
use catseye::scene::scenario::{self, Scenario};
use catseye::scene::toml_file::{At, Document, read_text};
use catseye::simulate::products::Products;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::{Component, Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

/// Version of the format of datasets. Version 1 contains no radars, and its scenes are split by their rank among all. A reader of a later
/// version reads earlier ones; a dataset is continued by the version that began it.
pub const VERSION: u32 = 2;
/// Number of times that a vehicle that overlaps another is drawn again before it is left out.
pub const REDRAWS: u32 = 30;
/// Names of the parts of a dataset, in this order.
pub const SPLITS: [&str; 3] = ["train", "validation", "test"];
/// Name of the road file of a drawn scene that is written for `catseye simulate`.
pub const ROAD_FILE: &str = "road.toml";
/// Name of the scenario file of a drawn scene.
pub const SCENARIO_FILE: &str = "scenario.toml";

/// A recipe: randomly drawn scenes, and the data that is kept of their frames.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "catseye recipe")]
pub struct RecipeFile {
    /// Name of the dataset, shown in results.
    pub name: String,
    /// Licence of the data, stated in its README, as in "CC-BY-4.0".
    pub licence: Option<String>,
    /// Seed of all draws, noise and speckle; default 0.
    #[serde(default)]
    pub seed: At<u64>,
    /// Number of scenes.
    #[schemars(range(min = 1, max = 10_000_000))]
    pub scenes: u32,
    /// Number of frames of each scene; `scenario.frames.interval_s` is the time between them.
    #[schemars(range(min = 1, max = 1_000_000))]
    pub frames_per_scene: u32,
    /// Split of the scenes into training, validation and test.
    #[serde(default)]
    pub split: At<SplitTable>,
    /// Storage format of the frames.
    #[serde(default)]
    pub store: StoreTable,
    /// Data that is kept of each frame.
    #[serde(default)]
    pub keep: Keep,
    /// Named draws whose value is used in several keys.
    #[serde(default)]
    pub draw: BTreeMap<String, serde_json::Value>,
    /// Contents of a road scene file (`catseye scene`), without its name.
    pub road: Option<At<serde_json::Value>>,
    /// Contents of a scenario file (`catseye simulate`), without name, seed, frames.count and output; also
    /// without scene if there is a road.
    pub scenario: At<serde_json::Value>,
}

/// Split of the scenes: shares that add up to 1, or lists of scenes. Frames of one scene are in one part.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SplitTable {
    /// Share of scenes for training.
    #[serde(default)]
    pub train: At<Share>,
    /// Share of scenes for validation.
    #[serde(default)]
    pub validation: At<Share>,
    /// Share of scenes for testing.
    #[serde(default)]
    pub test: At<Share>,
}

impl Default for SplitTable {
    fn default() -> Self {
        let part = |p| Share::Part(p).into();
        SplitTable { train: part(0.64), validation: part(0.16), test: part(0.20) }
    }
}

/// A share of all scenes, or a list of scenes.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "a share, as in 0.64, or a list of scenes, as in [3, \"10:20\"]")]
pub enum Share {
    /// A share, 0 to 1.
    Part(f64),
    /// List of scene numbers.
    Scenes(Vec<Scenes>),
}

impl Default for Share {
    fn default() -> Self {
        Share::Part(0.0)
    }
}

/// A scene number, or a range "first:end" without `end`.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Scenes {
    /// One scene.
    One(u32),
    /// Scenes from `first` to `end` - 1.
    Run(String),
}

/// Storage format of the frames.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct StoreTable {
    /// Format: frames (default; in every build), zarr or hdf5 (in builds with that feature).
    pub format: At<Format>,
    /// Compression of arrays. Default zstd:1 for zarr, deflate:3 for hdf5; the format frames compresses only grids and masks, as .npz.
    pub compression: Option<At<Compression>>,
    /// Number of frames in a shard, which one task writes; default whole scenes, 100 frames or more.
    #[schemars(range(min = 1, max = 1_000_000))]
    pub frames_per_shard: Option<u32>,
}

/// Data that is kept of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Keep {
    /// true: ADC samples; default false.
    pub adc: bool,
    /// true: range-Doppler power maps; default true.
    pub range_doppler: bool,
    /// true: points; default true.
    pub points: bool,
    /// true: the table of all echoes; default false.
    pub returns: bool,
    /// true: all echoes with all values (cached echoes), from which `catseye dataset --from` computes the frames of other
    /// radars; default false.
    pub echoes: bool,
    /// true: boxes, lanes, lines and markers; default true.
    pub truth: bool,
    /// true: grids of the area in front of the radar, with their points and the class of each cell; default false.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub masks: bool,
    /// true: points of the scenario's ideal lidar, in the tables `lidar` and `lidars`; default false.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub lidar: bool,
}

impl Default for Keep {
    fn default() -> Self {
        Keep {
            adc: false,
            range_doppler: true,
            points: true,
            returns: false,
            echoes: false,
            truth: true,
            masks: false,
            lidar: false,
        }
    }
}

impl Keep {
    /// The products that these keys keep.
    pub fn products(&self) -> Products {
        Products::by_key(|key| match key {
            "adc" => self.adc,
            "range_doppler" => self.range_doppler,
            "points" => self.points,
            "returns" => self.returns,
            "echoes" => self.echoes,
            "truth" => self.truth,
            "masks" => self.masks,
            "lidar" => self.lidar,
            _ => false,
        })
    }
}

/// Number of frames of a shard when the recipe does not state it, rounded up to whole scenes.
const FRAMES_PER_SHARD: u64 = 100;

/// A recipe that was read and checked as far as no scene is needed.
#[derive(Debug)]
pub struct Recipe {
    tree: Tree,
    /// Name of the dataset.
    pub name: String,
    /// Seed of all draws.
    pub seed: u64,
    /// Number of scenes.
    pub scenes: u32,
    /// Frames of each scene.
    pub frames_per_scene: u32,
    /// Licence of the data.
    pub licence: Option<String>,
    /// Format of the shards.
    pub format: Format,
    /// The error where this build cannot write that format.
    unbuilt: Option<BadInput>,
    /// Compression of arrays.
    pub compression: Compression,
    /// Whether grids and masks are compressed one by one: in the format `frames`, unless the recipe states a compression.
    pub pack_grids: bool,
    /// Number of frames of a shard.
    pub frames_per_shard: u64,
    /// Data that is kept of each frame.
    pub keep: Keep,
    /// Where the echoes of its frames come from; None where they are traced.
    pub kept: Option<KeptEchoes>,
    /// Index in [`SPLITS`] of each scene.
    split: Vec<u8>,
    sizes: Mutex<Sizes>,
}

/// One scene of a recipe.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawn {
    /// Number of the scene.
    pub scene: u32,
    /// Text of a road scene file.
    pub road: Option<String>,
    /// Text of a scenario file, whose scene is the road's file where there is a road.
    pub scenario: String,
    /// The road scene, where the recipe draws one.
    pub plan: Option<ScenePlan>,
    /// The scenario, read from the text.
    pub parsed: Scenario,
    /// Number of draws that were repeated because vehicles overlapped.
    pub redrawn: u32,
    /// Number of vehicles that were left out because no draw gave them room.
    pub dropped: u32,
}

impl Recipe {
    /// Loads a recipe; `seed` replaces its own.
    ///
    /// # Errors
    /// Returns an error of one line with file, line, key, value and remedy.
    pub fn load(path: &Path, seed: Option<u64>) -> Result<Recipe> {
        Recipe::parse(path, &read_text(path)?, seed)
    }

    /// Parses a recipe from text; files that it names are looked for beside `path`. `seed` replaces its own.
    ///
    /// # Errors
    /// Returns the errors of [`Recipe::load`].
    pub fn parse(path: &Path, text: &str, seed: Option<u64>) -> Result<Recipe> {
        Recipe::parse_split(path, text, seed, SplitRule::Stable)
    }

    /// [`Recipe::parse`] with a rule of splits.
    ///
    /// # Errors
    /// Returns the errors of [`Recipe::load`].
    pub fn parse_split(path: &Path, text: &str, seed: Option<u64>, rule: SplitRule) -> Result<Recipe> {
        let doc = Document::parse(path, text)?;
        let file: RecipeFile = doc.read()?;
        let tree = Tree::parse(path, text)?;
        let (scenes, frames_per_scene) = (file.scenes, file.frames_per_scene);
        let whole_scenes =
            FRAMES_PER_SHARD.div_ceil(u64::from(frames_per_scene)) * u64::from(frames_per_scene);
        let frames_per_shard = file.store.frames_per_shard.map_or(whole_scenes, u64::from);
        let (format, compression, unbuilt) = stored(&doc, &file.store)?;
        if !(file.keep.adc
            || file.keep.range_doppler
            || file.keep.points
            || file.keep.returns
            || file.keep.echoes
            || file.keep.truth
            || file.keep.masks
            || file.keep.lidar)
        {
            return Err(BadInput::new("the dataset keeps nothing")
                .file(path)
                .key("keep")
                .allowed("at least one of adc, range_doppler, points, returns, echoes, truth, masks, lidar")
                .into());
        }
        let seed = seed.unwrap_or(file.seed.value);
        let split = split(&doc, &file.split, scenes, seed, rule)?;
        let recipe = Recipe {
            tree,
            name: file.name,
            seed,
            scenes,
            frames_per_scene,
            licence: file.licence,
            format,
            unbuilt,
            compression,
            pack_grids: format == Format::Frames && file.store.compression.is_none(),
            frames_per_shard,
            keep: file.keep,
            kept: None,
            split,
            sizes: Mutex::default(),
        };
        recipe.check_keys(&doc)?;
        Ok(recipe)
    }

    /// Checks for keys of the two files that the recipe determines itself.
    fn check_keys(&self, doc: &Document<'_>) -> Result<()> {
        let refuse = |node: Option<&Node>, problem: &str, remedy: &str| match node {
            Some(n) => Err(Error::from(doc.bad(n.span(), problem).remedy(remedy))),
            None => Ok(()),
        };
        let scenario = self.tree.get("scenario");
        let of = |key: &str| scenario.and_then(|s| s.get(key));
        refuse(
            of("seed"),
            "is set by the recipe: each scene has its own seed",
            "give seed at the top of the recipe",
        )?;
        refuse(of("output"), "is set by [keep]", "remove it")?;
        let count = of("frames").and_then(|f| f.get("count"));
        refuse(count, "is set by frames_per_scene", "remove it")?;
        if self.tree.get("road").is_some() {
            refuse(of("scene"), "scenario.scene and [road] exclude each other", "remove one of them")?;
        }
        Ok(())
    }

    /// The file from which it was read.
    pub fn path(&self) -> &Path {
        self.tree.file()
    }

    /// The text as read.
    pub fn text(&self) -> &str {
        self.tree.text()
    }

    fn folder(&self) -> &Path {
        self.path().parent().unwrap_or(Path::new(""))
    }

    /// Checks that this build can write the recipe's format; its scenes can be drawn in any case.
    ///
    /// # Errors
    /// Returns `BadInput` with the line of the format and the feature to build with.
    pub fn check_built(&self) -> Result<()> {
        self.unbuilt.clone().map_or(Ok(()), |b| Err(b.into()))
    }

    /// Number of frames of the dataset.
    pub fn frames(&self) -> u64 {
        u64::from(self.scenes) * u64::from(self.frames_per_scene)
    }

    /// Scene of a frame, and the frame's index in it.
    pub fn place(&self, frame: u64) -> (u32, u32) {
        let n = u64::from(self.frames_per_scene);
        ((frame / n) as u32, (frame % n) as u32)
    }

    /// Part of the dataset that a scene belongs to: one of [`SPLITS`].
    pub fn split(&self, scene: u32) -> &'static str {
        SPLITS[self.split.get(scene as usize).copied().unwrap_or(0) as usize]
    }

    /// Number of scenes of each of [`SPLITS`].
    pub fn split_counts(&self) -> [u32; 3] {
        let mut counts = [0; 3];
        self.split.iter().for_each(|k| counts[*k as usize] += 1);
        counts
    }

    /// Seed of a scene's noise and speckle, below 2^63 so that tables of signed integers hold it.
    pub fn scene_seed(&self, scene: u32) -> u64 {
        word(self.seed, scene, "seed", 0) >> 1
    }

    /// The files below the recipe's folder that it names, and those that they name: path as written, and path
    /// of the file.
    ///
    /// # Errors
    /// Returns an error if a named file cannot be read.
    pub fn files(&self) -> Result<BTreeMap<String, PathBuf>> {
        let mut texts: BTreeSet<String> = BTreeSet::new();
        for part in ["draw", "road", "scenario"] {
            texts.extend(self.tree.get(part).map(Node::texts).unwrap_or_default());
        }
        let mut found = BTreeMap::new();
        let mut todo: Vec<(PathBuf, String)> = texts.into_iter().map(|t| (PathBuf::new(), t)).collect();
        while let Some((below, name)) = todo.pop() {
            let relative = below.join(&name);
            let plain = relative.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
            let path = self.folder().join(&relative);
            // Longer names are no paths on any system.
            if name.is_empty() || name.len() > 4096 || !plain || !path.is_file() {
                continue;
            }
            let key = relative.to_string_lossy().replace('\\', "/");
            if found.insert(key, path.clone()).is_none() {
                let beside = relative.parent().unwrap_or(Path::new("")).to_path_buf();
                todo.extend(texts_in(&path)?.into_iter().map(|t| (beside.clone(), t)));
            }
        }
        Ok(found)
    }

    /// SHA-256 of all that determines the frames: the text, the seed, the files that it names, this version
    /// of the program.
    ///
    /// # Errors
    /// Returns an error if a named file cannot be read.
    pub fn identity(&self) -> Result<String> {
        let version = format!("{} {VERSION}", env!("CARGO_PKG_VERSION"));
        let mut all = format!("{version}\n{}\n{}\n", self.seed, self.text());
        all += self.kept.as_ref().map_or("", |kept| &kept.digest);
        for (name, path) in self.files()? {
            all += &format!("{name} {}\n", sha256_of_file(&path)?);
        }
        Ok(sha256_of_bytes(all.as_bytes()))
    }

    /// Draws every scene and has its readers check it, on all cores. `drawn` is called after each. Ends early
    /// when `cancel` is set.
    ///
    /// # Errors
    /// Returns the error of the first scene that is refused, with the number of others.
    pub fn check(&self, cancel: &AtomicBool, drawn: &(dyn Fn() + Sync)) -> Result<()> {
        let first = self.draw(0).ok();
        let refused = |scene: u32| {
            if cancel.load(Ordering::Relaxed) {
                return None;
            }
            let drawn_scene = self.draw(scene);
            let e = match (drawn_scene, &first) {
                (Ok(drawn), Some(first)) => self.check_shapes(first, &drawn).err(),
                (drawn, _) => drawn.err(),
            };
            drawn();
            Some((scene, 1, e?))
        };
        let least = |a: (u32, u64, Error), b: (u32, u64, Error)| {
            let n = a.1 + b.1;
            let first = if a.0 <= b.0 { a } else { b };
            (first.0, n, first.2)
        };
        match (0..self.scenes).into_par_iter().filter_map(refused).reduce_with(least) {
            None => Ok(()),
            Some((_, n, Error::Input(mut b))) if n > 1 => {
                b.problem += &format!(" ({n} of {} scenes are refused)", self.scenes);
                Err(Error::Input(b))
            }
            Some((_, _, e)) => Err(e),
        }
    }

    /// Shapes of the arrays that depend on radars: what each holds, and shape.
    fn shapes(&self, radars: &[Radar]) -> Vec<(String, Vec<usize>)> {
        let mut shapes = Vec::new();
        for radar in radars {
            let of = |what: &str| match radars {
                [_] => what.to_string(),
                _ => format!("{what} of '{}'", radar.name),
            };
            if self.keep.range_doppler {
                let map = |i: usize| {
                    let part = radar.part(i);
                    (of("range_doppler"), vec![part.doppler_rows(), part.range_bins()])
                };
                shapes.extend((0..radar.waveform.parts()).map(map));
            }
            if self.keep.adc {
                shapes.push((of("adc"), vec![radar.rows(), radar.channels(), radar.samples]));
            }
        }
        shapes
    }

    /// Checks that the frames of a scene have arrays of the same shape as those of scene 0.
    fn check_shapes(&self, first: &Drawn, other: &Drawn) -> Result<()> {
        let of = |drawn: &Drawn| self.shapes(&drawn.parsed.radars);
        let (wanted, found) = (of(first), of(other));
        if wanted == found {
            return Ok(());
        }
        let names = |all: &[(String, Vec<usize>)]| {
            let names: Vec<&str> = all.iter().map(|(name, _)| name.as_str()).collect();
            if names.is_empty() { "no array".into() } else { names.join(", ") }
        };
        let unlike = wanted.iter().zip(&found).find(|(a, b)| a != b);
        let problem = match unlike.filter(|(a, b)| a.0 == b.0) {
            Some((a, b)) => {
                format!("scene {} has {} in the shape {:?}, scene 0 {:?}", other.scene, a.0, b.1, a.1)
            }
            None => format!("scene {} has {}, and scene 0 {}", other.scene, names(&found), names(&wanted)),
        };
        let mut bad = BadInput::new(problem).file(self.path()).key("scenario.radar");
        if let Some(UnlikeDraw { key, value, first, span }) = self.unlike_draw(first, other)? {
            bad = bad.key(format!("scenario.{key}")).value(value).allowed(format!("{first}, as in scene 0"));
            bad.line = self.tree.document()?.bad(&span, "").line;
        }
        Err(bad.remedy("give one value, and make a dataset for each value").into())
    }

    /// The drawn key of a radar whose values in two scenes differ, those that shape arrays first.
    fn unlike_draw(&self, first: &Drawn, other: &Drawn) -> Result<Option<UnlikeDraw>> {
        const SHAPING: [&str; 8] =
            ["samples", "chirps", "sampling", "range_fft", "doppler_fft", "position_m", "name", "radar"];
        fn leaves(at: &str, value: &toml::Value, found: &mut BTreeMap<String, String>) {
            match value {
                toml::Value::Table(t) => t.iter().for_each(|(name, v)| {
                    leaves(&if at.is_empty() { name.clone() } else { format!("{at}.{name}") }, v, found);
                }),
                toml::Value::Array(a) if !a.is_empty() => {
                    a.iter().enumerate().for_each(|(i, v)| leaves(&format!("{at}[{i}]"), v, found));
                }
                plain => _ = found.insert(at.into(), plain.to_string()),
            }
        }
        let of = |drawn: &Drawn| -> Result<BTreeMap<String, String>> {
            let table: toml::Table = toml::from_str(&drawn.scenario)
                .map_err(|e| Error::Failed(format!("scene {} as TOML: {e}", drawn.scene)))?;
            let mut found = BTreeMap::new();
            leaves("", &table.into(), &mut found);
            Ok(found)
        };
        let (a, b) = (of(first)?, of(other)?);
        let origins = self.texts(other.scene, &Changes::default())?.scenario_origins;
        let value =
            |all: &BTreeMap<String, String>, key: &String| all.get(key).cloned().unwrap_or("absent".into());
        let keys: BTreeSet<&String> = a.keys().chain(b.keys()).collect();
        let mut unlike: Vec<&String> =
            keys.into_iter().filter(|k| k.starts_with("radar") && a.get(*k) != b.get(*k)).collect();
        // The keys that shape arrays first.
        let last = |key: &str| key.rsplit('.').next().unwrap_or(key).to_string();
        unlike.sort_by_key(|key| {
            SHAPING.iter().position(|s| last(key).starts_with(s)).unwrap_or(SHAPING.len())
        });
        Ok(unlike.into_iter().find_map(|key| {
            let mut at = key.as_str();
            let origin = loop {
                match (origins.get(at), at.rfind(['.', '['])) {
                    (Some(origin), _) => break origin,
                    (None, Some(end)) => at = &at[..end],
                    (None, None) => return None,
                }
            };
            Some(UnlikeDraw {
                key: key.clone(),
                value: value(&b, key),
                first: value(&a, key),
                span: origin.span.clone(),
            })
        }))
    }

    /// Text of what determines the bytes of all frames: this version of the program, what is kept, and the
    /// contents of the files that the recipe names.
    ///
    /// # Errors
    /// Returns an error if a named file cannot be read.
    pub fn basis(&self) -> Result<String> {
        let mut all = format!("{} {VERSION}\n{:?}\n", env!("CARGO_PKG_VERSION"), self.keep);
        all += self.kept.as_ref().map_or("", |kept| &kept.digest);
        for (name, path) in self.files()? {
            all += &format!("{name} {}\n", sha256_of_file(&path)?);
        }
        Ok(all)
    }

    /// SHA-256 of what determines the bytes of some frames in addition to [`Recipe::basis`]: their scenes as
    /// drawn. Also the radars of these scenes that differ from `usual`, those of scene 0.
    ///
    /// # Errors
    /// Returns the errors of [`Recipe::draw`].
    pub fn drawn_from(
        &self,
        basis: &str,
        frames: Range<u64>,
        usual: &[KeptRadar],
    ) -> Result<(String, RadarsOfScenes)> {
        let mut all = basis.to_string();
        let mut others = RadarsOfScenes::new();
        let mut at = frames.start;
        while at < frames.end {
            let (scene, first) = self.place(at);
            let end = frames.end.min(at + u64::from(self.frames_per_scene - first));
            let d = self.draw(scene)?;
            let road = d.road.as_deref().unwrap_or_default();
            all += &format!("{at} {end} {first} {} {} {}\n", self.split(scene), d.redrawn, d.dropped);
            all += &format!("{} {road}\n{} {}\n", road.len(), d.scenario.len(), d.scenario);
            let radars = KeptRadar::all(&d.parsed.radars)?;
            if radars != usual {
                others.insert(scene, radars);
            }
            at = end;
        }
        Ok((sha256_of_bytes(all.as_bytes()), others))
    }

    /// Draws a scene.
    ///
    /// # Errors
    /// Returns an error for a scene that its readers refuse, with its number, the key and the drawn value.
    pub fn draw(&self, scene: u32) -> Result<Drawn> {
        if scene >= self.scenes {
            return Err(BadInput::new("there is no such scene")
                .file(self.path())
                .key("scene")
                .value(scene)
                .allowed(format!("0..={}", self.scenes - 1))
                .into());
        }
        let mut changes = Changes::default();
        let mut redrawn = 0;
        loop {
            let texts = self.texts(scene, &changes)?;
            let plan = match &texts.road {
                Some(road) => Some(
                    scene_toml::parse(self.path(), road)
                        .map_err(|e| self.explain(scene, "road", &texts.road_origins, e))?,
                ),
                None => None,
            };
            let unwritten = texts.road.as_ref().map(|_| ROAD_FILE);
            let parsed = scenario::parse_with_road(self.path(), &texts.scenario, unwritten)
                .map_err(|e| self.explain(scene, "scenario", &texts.scenario_origins, e))?;
            let clash = match &plan {
                Some(plan) => {
                    // A copy: scenes are drawn on all cores at once.
                    let known = || self.sizes.lock().unwrap_or_else(|e| e.into_inner());
                    let mut sizes = known().clone();
                    let clash = first_clash(plan, &parsed, &mut sizes);
                    known().add(sizes);
                    clash?
                }
                None => None,
            };
            let Some((first, second)) = clash else {
                let dropped = changes.dropped.len() as u32;
                return Ok(Drawn {
                    scene,
                    road: texts.road,
                    scenario: texts.scenario,
                    plan,
                    parsed,
                    redrawn,
                    dropped,
                });
            };
            // The later vehicle moves, unless only the earlier one can.
            let origin = |(i, j): (usize, usize)| texts.road_origins.get(&format!("road[{i}].vehicle[{j}]"));
            let movable = |at| self.redrawable(&texts, at);
            let id = [Some(second), first].into_iter().flatten().find(|v| movable(*v)).and_then(origin);
            let Some(id) = id.map(|o| o.id.clone()) else {
                let doc = self.tree.document()?;
                let span = origin(second).map_or(0..0, |o| o.span.clone());
                let other = if first.is_none() { "the radar's vehicle" } else { "another vehicle" };
                return Err(doc
                    .bad(
                        &span,
                        format!(
                            "scene {scene}: the vehicle overlaps {other}, and no value of either is drawn"
                        ),
                    )
                    .remedy("move one of them")
                    .into());
            };
            let times = changes.again.entry(id.clone()).or_insert(0);
            if *times < REDRAWS {
                *times += 1;
                redrawn += 1;
            } else {
                changes.dropped.insert(id);
            }
        }
    }

    fn redrawable(&self, texts: &Texts, (i, j): (usize, usize)) -> bool {
        let below = format!("road[{i}].vehicle[{j}]");
        texts.road_origins.iter().any(|(path, o)| o.drawn && path.starts_with(&below))
    }

    fn texts(&self, scene: u32, changes: &Changes) -> Result<Texts> {
        let mut draws = Draws::new(&self.tree, self.seed, scene, changes.clone())?;
        let name = format!("{}, scene {scene}", self.name);
        let plain = |draws: &mut Draws<'_>, part: &str| -> Result<Option<toml::Table>> {
            let Some(node) = self.tree.get(part) else { return Ok(None) };
            match draws.plain(node, part)? {
                Some(toml::Value::Table(mut t)) => {
                    t.entry("name").or_insert_with(|| name.clone().into());
                    Ok(Some(t))
                }
                Some(_) => {
                    let doc = self.tree.document()?;
                    Err(doc.bad(node.span(), format!("is not a table [{part}]")).into())
                }
                None => Ok(None),
            }
        };
        let road = plain(&mut draws, "road")?;
        let Some(mut scenario) = plain(&mut draws, "scenario")? else {
            return Err(BadInput::new("the scenario is missing").file(self.path()).key("scenario").into());
        };
        scenario.insert("seed".into(), toml::Value::Integer(self.scene_seed(scene) as i64));
        if road.is_some() {
            let path = toml::Table::from_iter([("road".to_string(), ROAD_FILE.into())]);
            scenario.insert("scene".into(), path.into());
        }
        let frames = scenario.entry("frames").or_insert_with(|| toml::Table::new().into());
        if let toml::Value::Table(t) = frames {
            t.insert("count".into(), toml::Value::Integer(self.frames_per_scene.into()));
        }
        let text = |t: &toml::Table| {
            toml::to_string(t).map_err(|e| Error::Failed(format!("scene {scene} as TOML: {e}")))
        };
        let (road, scenario) = (road.as_ref().map(text).transpose()?, text(&scenario)?);
        let mut parts: [BTreeMap<String, Origin>; 2] = Default::default();
        for (path, origin) in draws.origins() {
            for (part, prefix) in parts.iter_mut().zip(["road.", "scenario."]) {
                if let Some(rest) = path.strip_prefix(prefix) {
                    part.insert(rest.to_string(), origin.clone());
                }
            }
        }
        let [road_origins, scenario_origins] = parts;
        Ok(Texts { road, scenario, road_origins, scenario_origins })
    }

    /// Text at a place of the recipe, in one line.
    fn excerpt(&self, span: &Range<usize>) -> String {
        const MOST: usize = 80;
        let text = self.text().get(span.clone()).unwrap_or_default();
        let line = text.split_whitespace().collect::<Vec<_>>().join(" ");
        match line.char_indices().nth(MOST) {
            Some((end, _)) => format!("{}...", &line[..end]),
            None => line,
        }
    }

    /// Adds the place in the recipe to a reader's error about a drawn text.
    fn explain(&self, scene: u32, part: &str, origins: &BTreeMap<String, Origin>, e: Error) -> Error {
        let Error::Input(b) = e else { return e };
        // Complaints about other files say their own place.
        if b.file.as_deref().is_some_and(|f| f != self.path()) {
            return Error::Input(b);
        }
        let mut key = b.key.clone().unwrap_or_default();
        let origin = loop {
            if let Some(o) = origins.get(&key) {
                break Some(o);
            }
            match key.rfind(['.', '[']) {
                Some(at) => key.truncate(at),
                None => break None,
            }
        };
        let how = match origin.filter(|o| o.drawn).map(|o| self.excerpt(&o.span)) {
            Some(text) if text.starts_with('{') => format!(" (drawn from {text})"),
            Some(_) => " (drawn)".into(),
            None => String::new(),
        };
        let mut here = BadInput::new(format!("{}{how} in scene {scene}", b.problem)).file(self.path());
        if let (Some(o), Ok(doc)) = (origin, self.tree.document()) {
            here.line = doc.bad(&o.span, "").line;
        }
        here.key = Some(b.key.map_or(part.to_string(), |k| format!("{part}.{k}")));
        (here.value, here.allowed, here.remedy) = (b.value, b.allowed, b.remedy);
        here.into()
    }
}

/// Format and compression that fit together in this build.
fn stored(doc: &Document<'_>, t: &StoreTable) -> Result<(Format, Compression, Option<BadInput>)> {
    let format = t.format.value;
    let compression = match (&t.compression, format) {
        (Some(c), _) => c.value,
        (None, Format::Zarr) => Compression::Zstd(1),
        (None, Format::Hdf5) => Compression::Deflate(3),
        (None, Format::Frames) => Compression::None,
    };
    // Frames and shards are of no matter to these two.
    let trial = DatasetLayout {
        format,
        compression,
        frames: 1,
        frames_per_shard: 1,
        arrays: Vec::new(),
        tables: vec![TableSpec {
            name: "frames".into(),
            columns: vec![ColumnSpec::new("scene", ColumnKind::U32)],
            about: String::new(),
        }],
        attributes: serde_json::Map::new(),
    };
    let here = |b: Box<BadInput>| {
        let span = match &t.compression {
            Some(c) if b.key.as_deref() == Some("compression") => &c.span,
            _ => &t.format.span,
        };
        let mut here = doc.bad(span, b.problem);
        here.file = Some(doc.file().to_path_buf());
        here.key = here.key.or(b.key);
        (here.allowed, here.remedy) = (b.allowed, b.remedy);
        here
    };
    match trial.check() {
        Err(Error::Input(b)) => return Err(here(b).into()),
        Err(e) => return Err(e),
        Ok(()) => {}
    }
    match trial.check_built() {
        Err(Error::Input(b)) => Ok((format, compression, Some(here(b)))),
        Err(e) => Err(e),
        Ok(()) => Ok((format, compression, None)),
    }
}

struct Texts {
    road: Option<String>,
    scenario: String,
    road_origins: BTreeMap<String, Origin>,
    scenario_origins: BTreeMap<String, Origin>,
}

impl Drawn {
    /// The files for `catseye simulate`: name and text.
    pub fn files(&self) -> Vec<(&'static str, &str)> {
        let road = self.road.as_deref().map(|road| (ROAD_FILE, road));
        road.into_iter().chain([(SCENARIO_FILE, &self.scenario[..])]).collect()
    }
}

/// The texts in a file that may name other files: TOML and glTF.
fn texts_in(path: &Path) -> Result<BTreeSet<String>> {
    fn texts(v: &serde_json::Value, found: &mut BTreeSet<String>) {
        match v {
            serde_json::Value::String(s) => _ = found.insert(s.clone()),
            serde_json::Value::Array(a) => a.iter().for_each(|v| texts(v, found)),
            serde_json::Value::Object(o) => o.values().for_each(|v| texts(v, found)),
            _ => {}
        }
    }
    // What is no TOML or JSON is refused by the reader that needs it.
    let value: Option<serde_json::Value> = match path.extension().and_then(|e| e.to_str()) {
        Some("toml") => toml::from_str(&read_text(path)?).ok(),
        Some("gltf") => serde_json::from_slice(&catseye::scene::gltf::read_bytes(path)?).ok(),
        _ => None,
    };
    let mut found = BTreeSet::new();
    value.iter().for_each(|v| texts(v, &mut found));
    Ok(found)
}

/// A key of a radar whose drawn values in two scenes differ.
struct UnlikeDraw {
    /// Key below `scenario`.
    key: String,
    /// Value in the later scene.
    value: String,
    /// Value in scene 0.
    first: String,
    /// Place of the draw in the recipe.
    span: Range<usize>,
}

/// How shares become parts of the scenes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SplitRule {
    /// Scenes are ranked by a hash of seed and number, and each part takes its share of the ranks: that of datasets of version 1.
    Ranked,
    /// Each scene is drawn in the order of numbers among the parts that lack scenes, so it is in the same part however many follow.
    Stable,
}

/// Parts of scenes by shares, of which the first `n` scenes have the same parts for all numbers of scenes: scene `s` is drawn among the parts
/// with a chance in proportion to how many scenes each lacks, `share (s + 1) - count`, where that is positive. So a part never has a scene more
/// than its share, or two fewer.
fn stable_split(shares: [f64; 3], scenes: u32, seed: u64) -> Vec<u8> {
    let mut counts = [0u32; 3];
    let mut of = Vec::with_capacity(scenes as usize);
    for scene in 0..scenes {
        let lack: [f64; 3] =
            std::array::from_fn(|k| (shares[k] * f64::from(scene + 1) - f64::from(counts[k])).max(0.0));
        // The upper 53 bits as a number from 0 to 1.
        let uniform = (word(seed, scene, "split", 0) >> 11) as f64 / (1u64 << 53) as f64;
        let mut left = uniform * lack.iter().sum::<f64>();
        let last = (0..3).rev().find(|k| lack[*k] > 0.0).unwrap_or(0);
        let part = (0..last)
            .find(|k| {
                left -= lack[*k];
                left < 0.0
            })
            .unwrap_or(last);
        counts[part] += 1;
        of.push(part as u8);
    }
    of
}

/// The part of each scene. Each share holds to within two scenes.
fn split(
    doc: &Document<'_>,
    table: &At<SplitTable>,
    scenes: u32,
    seed: u64,
    rule: SplitRule,
) -> Result<Vec<u8>> {
    let shares = [&table.value.train, &table.value.validation, &table.value.test];
    let parts: Vec<Option<f64>> = shares
        .iter()
        .map(|s| match s.value {
            Share::Part(p) => Some(p),
            Share::Scenes(_) => None,
        })
        .collect();
    if parts.iter().all(Option::is_some) {
        let parts: Vec<f64> = parts.into_iter().flatten().collect();
        for (share, p) in shares.iter().zip(&parts) {
            if !(0.0..=1.0).contains(p) {
                return Err(doc.bad(&share.span, "is not a share").allowed("0..=1").into());
            }
        }
        let sum: f64 = parts.iter().sum();
        if (sum - 1.0).abs() > 1e-9 {
            return Err(doc
                .bad(&table.span, format!("the shares add up to {sum}"))
                .allowed("1")
                .remedy("give shares as in train = 0.64, validation = 0.16, test = 0.2; a missing share is 0")
                .into());
        }
        if rule == SplitRule::Stable {
            return Ok(stable_split([parts[0], parts[1], parts[2]], scenes, seed));
        }
        let mut order: Vec<u32> = (0..scenes).collect();
        order.sort_by_cached_key(|s| (word(seed, *s, "split", 0), *s));
        let end = |share: f64| (share * f64::from(scenes)).round() as usize;
        let (first, second) = (end(parts[0]), end(parts[0] + parts[1]));
        let mut of = vec![0; scenes as usize];
        for (rank, s) in order.into_iter().enumerate() {
            of[s as usize] = u8::from(rank >= first) + u8::from(rank >= second);
        }
        return Ok(of);
    }
    let mut of = vec![u8::MAX; scenes as usize];
    for (k, share) in shares.iter().enumerate() {
        let list = match &share.value {
            Share::Scenes(list) => list.as_slice(),
            Share::Part(0.0) => &[],
            Share::Part(_) => {
                return Err(doc
                    .bad(&share.span, "is a share, and others are lists")
                    .remedy("give shares, or lists of scenes")
                    .into());
            }
        };
        for pick in list {
            let range = match pick {
                Scenes::One(s) => Some(*s..s.saturating_add(1)),
                Scenes::Run(text) => range(text, scenes),
            };
            let range = range.filter(|r| r.end <= scenes && r.start < r.end);
            let Some(range) = range else {
                return Err(doc
                    .bad(&share.span, "names a scene that does not exist")
                    .allowed(format!("0..={} and \"first:end\"", scenes - 1))
                    .into());
            };
            for s in range {
                let at = &mut of[s as usize];
                if *at != u8::MAX {
                    return Err(doc.bad(&share.span, format!("scene {s} is listed twice")).into());
                }
                *at = k as u8;
            }
        }
    }
    match of.iter().position(|k| *k == u8::MAX) {
        Some(s) => Err(doc
            .bad(&table.span, format!("scene {s} is not in any part"))
            .remedy("list every scene, as in train = [\"0:64\"]")
            .into()),
        None => Ok(of),
    }
}

/// "first:end", either of which may be left out, within 0:all.
pub fn range(text: &str, all: u32) -> Option<std::ops::Range<u32>> {
    let (a, b) = text.split_once(':')?;
    let number = |t: &str, default: u32| match t.trim() {
        "" => Some(default),
        t => t.parse().ok(),
    };
    Some(number(a, 0)?..number(b, all)?)
}

/// JSON schema of the file: (file name in `schema/`, text).
pub fn schema() -> (&'static str, String) {
    let schema = schemars::schema_for!(RecipeFile);
    ("recipe.schema.json", serde_json::to_string_pretty(&schema).unwrap_or_default() + "\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    const TINY: &str = include_str!("../../../scenes/recipes/tiny.toml");

    fn place() -> PathBuf {
        Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("scenes/recipes/r.toml")
    }

    fn parse(text: &str) -> Result<Recipe> {
        Recipe::parse(&place(), text, None)
    }

    #[test]
    fn the_recipes_draw() {
        for name in ["template", "tiny", "small_road", "highways", "awr1843_street"] {
            let path = place().with_file_name(format!("{name}.toml"));
            // A build without Zarr draws them too.
            let mut recipe: toml::Table = std::fs::read_to_string(&path).unwrap().parse().unwrap();
            recipe.insert("store".into(), toml::toml! { format = "frames" }.into());
            let recipe = Recipe::parse(&path, &recipe.to_string(), None).unwrap();
            for scene in 0..recipe.scenes.min(12) {
                let drawn = recipe.draw(scene).unwrap();
                assert_eq!(drawn.parsed.frames.count, recipe.frames_per_scene);
                assert_eq!(drawn.parsed.seed, recipe.scene_seed(scene));
                assert_eq!(drawn, recipe.draw(scene).unwrap());
            }
        }
    }

    /// A drawn scene's file stands for the drawn values: parsed again it is the same road.
    #[test]
    fn written_scenes_are_the_drawn_ones() {
        let recipe = parse(TINY).unwrap();
        let drawn = recipe.draw(2).unwrap();
        let files = drawn.files();
        assert_eq!(files.iter().map(|f| f.0).collect::<Vec<_>>(), [ROAD_FILE, SCENARIO_FILE]);
        assert_eq!(scene_toml::parse(&place(), files[0].1).unwrap(), drawn.plan.clone().unwrap());
        let scenario: toml::Table = toml::from_str(files[1].1).unwrap();
        assert_eq!(scenario["scene"]["road"].as_str(), Some(ROAD_FILE));
        let named = recipe.files().unwrap();
        assert_eq!(named.keys().collect::<Vec<_>>(), ["tiny_radar.toml"]);
    }

    #[test]
    fn shares_hold_to_a_scene_and_lists_as_they_are() {
        let with = |split: &str, scenes: u32| {
            parse(
                &TINY
                    .replace("scenes = 4", &format!("scenes = {scenes}"))
                    .replace("train = [0, 2]\nvalidation = [1]\ntest = [3]", split),
            )
        };
        let r = with("train = 0.64\nvalidation = 0.16\ntest = 0.2", 1000).unwrap();
        for (count, share) in r.split_counts().into_iter().zip([640.0, 160.0, 200.0]) {
            assert!((f64::from(count) - share).abs() < 2.0, "{:?}", r.split_counts());
        }
        // Extended, it keeps the parts of the scenes that it has.
        let longer = with("train = 0.64\nvalidation = 0.16\ntest = 0.2", 1200).unwrap();
        (0..1000).for_each(|s| assert_eq!(longer.split(s), r.split(s), "{s}"));
        // Drawn, not the first scenes: the middle of a part's numbers lies near that of all.
        let test: Vec<f64> = (0..1000).filter(|s| r.split(*s) == "test").map(f64::from).collect();
        let mean = test.iter().sum::<f64>() / 200.0;
        assert!((mean - 500.0).abs() < 4.5 * 1000.0 / (12.0f64 * 200.0).sqrt(), "{mean}");
        let r = with("train = [\"0:8\", 9]\ntest = [8]", 10).unwrap();
        assert_eq!((r.split_counts(), r.split(8), r.split(9)), ([9, 0, 1], "test", "train"));
        for (split, says) in [
            ("train = 0.5", "the shares add up to 0.5"),
            ("train = 1.5\ntest = -0.5", "is not a share"),
            ("train = [0, 1]\ntest = 0.5", "is a share, and others are lists"),
            ("train = [\"0:9\"]", "scene 9 is not in any part"),
            ("train = [\"0:10\", 3]", "scene 3 is listed twice"),
            ("train = [\"0:11\"]", "names a scene that does not exist"),
            ("train = [\"5\"]", "names a scene that does not exist"),
            ("train = \"all\"", "a share, as in 0.64, or a list of scenes"),
        ] {
            let e = with(split, 10).unwrap_err().to_string();
            assert!(e.contains(says) && e.contains("r.toml:"), "{split}: {e}");
        }
    }

    #[test]
    fn contradictions_are_refused() {
        let more = |at: &str, line: &str| TINY.replace(at, &format!("{at}\n{line}"));
        for (text, says) in [
            (TINY.replace("scenes = 4", "scenes = 0"), "allowed: 1..="),
            (TINY.replace("seed = 3", "seed = -3"), "seed = -3"),
            (TINY.replace("seed = 3", "sead = 3"), "did you mean 'seed'?"),
            (more("interval_s = 0.1", "count = 3"), "is set by frames_per_scene"),
            (more("[scenario]", "seed = 3"), "is set by the recipe"),
            (more("[scenario]", "output = { adc = true }"), "is set by [keep]"),
            (
                more("[scenario]", "scene = { builtin = \"w3\" }"),
                "scenario.scene and [road] exclude each other",
            ),
            (more("format = \"frames\"", "compression = \"zstd:3\""), "cannot be had in the format frames"),
            (more("format = \"frames\"", "compression = \"lzma\""), "is no compression"),
            (TINY.replace("\"frames\"", "\"tar\""), "is not one of the choices"),
            (
                TINY.replace(
                    "adc = true\nreturns = true",
                    "range_doppler = false\npoints = false\ntruth = false",
                ),
                "the dataset keeps nothing",
            ),
        ] {
            let e = parse(&text).unwrap_err();
            assert!(e.exit_code() == 2 && e.to_string().contains(says), "{says}: {e}");
        }
    }

    /// Each part has its share of the first scenes to within two, however many there are, and datasets of version 1 keep their parts.
    #[test]
    fn shares_hold_for_all_numbers_of_scenes() {
        for (seed, shares) in
            [(0, [0.64, 0.16, 0.2]), (7, [0.5, 0.5, 0.0]), (3, [0.0, 0.0, 1.0]), (5, [0.98, 0.01, 0.01])]
        {
            let mut counts = [0.0; 3];
            for (s, part) in (1..).zip(stable_split(shares, 2000, seed)) {
                counts[usize::from(part)] += 1.0;
                for (count, share) in counts.into_iter().zip(shares) {
                    let lack: f64 = share * f64::from(s) - count;
                    assert!(lack > -1.0 && lack < 2.0, "seed {seed}, scene {s}: {counts:?}");
                }
            }
        }
        let text = TINY.replace("scenes = 4", "scenes = 1000");
        let text = text.replace(
            "train = [0, 2]\nvalidation = [1]\ntest = [3]",
            "train = 0.64\nvalidation = 0.16\ntest = 0.2",
        );
        let old = Recipe::parse_split(&place(), &text, None, SplitRule::Ranked).unwrap();
        assert_eq!(old.split_counts(), [640, 160, 200]);
    }

    /// Draws that change the shape of an array are refused before the first frame, with key and line; others are not.
    #[test]
    fn drawn_shapes_are_refused() {
        let radar = include_str!("../../../scenes/recipes/tiny_radar.toml");
        let inline = |old: &str, new: &str| {
            let radar: String = radar
                .replace(old, new)
                .replace("\n[", "\n[scenario.radar.")
                .replace("[scenario.radar.[", "[[scenario.radar.");
            let scenario =
                TINY.replace("radar = \"tiny_radar.toml\"\n", "").replace("scenes = 4", "scenes = 8");
            let scenario = scenario.replace("train = [0, 2]\nvalidation = [1]\ntest = [3]", "train = 1");
            format!("{scenario}\n[scenario.radar]\n{radar}")
        };
        let check = |text: &str| parse(text).unwrap().check(&AtomicBool::new(false), &|| ());
        let noise = inline("noise_figure_db = 13", "noise_figure_db = { uniform = [10, 16] }");
        check(&noise).unwrap();
        for (old, new, key) in [
            ("\nsamples = 64", "\nsamples = { choice = [64, 128] }", "scenario.radar.receiver.samples"),
            ("chirps = 16", "chirps = { choice = [16, 32] }", "scenario.radar.waveform.chirps"),
        ] {
            let text = inline(old, new);
            let line = text.lines().position(|l| l == new.trim()).unwrap() + 1;
            let e = check(&text).unwrap_err().to_string();
            for part in
                [&format!("r.toml:{line}: {key} = "), "scene 0 [", "as in scene 0", "make a dataset for each"]
            {
                assert!(e.contains(part), "{part}: {e}");
            }
        }
    }

    #[test]
    fn refused_scenes_name_scene_key_and_value() {
        let text = TINY.replace("width_m = { uniform = [3, 4] }", "width_m = { uniform = [-3, -2] }");
        let line = text.lines().position(|l| l.starts_with("right =")).unwrap() + 1;
        let e = parse(&text).unwrap().draw(2).unwrap_err().to_string();
        assert!(e.contains(&format!("r.toml:{line}: road.road[0].right[0].width_m = -2.")), "{e}");
        assert!(
            e.contains(
                "is not a lane width (drawn from { uniform = [-3, -2] }) in scene 2; allowed: 0..=1000"
            ),
            "{e}"
        );
        let text = TINY.replace("spacing_m = { uniform", "spacing = { uniform");
        let e = parse(&text).unwrap().draw(0).unwrap_err().to_string();
        assert!(e.contains("road.road[0].markers[0].spacing") && e.contains("unknown key"), "{e}");
        let text = TINY.replace("rcs_dbsm = { uniform = [0, 10] }", "rcs_dbsm = { uniform = [900, 910] }");
        let e = parse(&text).unwrap().draw(1).unwrap_err().to_string();
        assert!(e.contains("scenario.point[0].rcs_dbsm = 90") && e.contains("in scene 1"), "{e}");
        assert!(parse(TINY).unwrap().draw(4).unwrap_err().to_string().contains("allowed: 0..=3"));
    }

    #[test]
    fn vehicles_stand_apart_or_are_left_out() {
        let text =
            TINY.replace("repeat = { integer = [0, 2] }", "repeat = 12").replace("scenes = 4", "scenes = 20");
        let text = text.replace("train = [0, 2]\nvalidation = [1]\ntest = [3]", "train = 1");
        let recipe = parse(&text).unwrap();
        let (mut dropped, mut redrawn, mut kept) = (0, 0, 0);
        for scene in 0..20 {
            let d = recipe.draw(scene).unwrap();
            let clash = first_clash(d.plan.as_ref().unwrap(), &d.parsed, &mut Sizes::default()).unwrap();
            assert_eq!(clash, None, "scene {scene}");
            let vehicles = d.plan.unwrap().roads[0].things.len() as u32;
            assert_eq!(vehicles + d.dropped, 12);
            (dropped, redrawn, kept) = (dropped + d.dropped, redrawn + d.redrawn, kept + vehicles);
        }
        // Twelve cars of 4.5 m do not fit 43 m of one lane, some do.
        assert!(dropped > 20 && redrawn > dropped * REDRAWS && kept > 60, "{dropped} {redrawn} {kept}");
        let two = "[[road.road.vehicle]]\nkind = \"sedan\"\ns_m = 30\nlateral = { lane = 1 }\n";
        let fixed = TINY.replace("repeat = { integer = [0, 2] }", "repeat = 0");
        let e = parse(&format!("{fixed}\n{two}{two}")).unwrap().draw(0).unwrap_err().to_string();
        assert!(e.contains("the vehicle overlaps another vehicle, and no value of either is drawn"), "{e}");
    }

    #[test]
    fn identities_follow_text_seed_and_named_files() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("r.toml");
        std::fs::copy(place().with_file_name("tiny_radar.toml"), dir.path().join("tiny_radar.toml")).unwrap();
        let of = |text: &str, seed| Recipe::parse(&path, text, seed).unwrap().identity().unwrap();
        let first = of(TINY, None);
        assert_eq!((of(TINY, None), of(TINY, Some(3))), (first.clone(), first.clone()));
        assert_ne!(of(TINY, Some(4)), first);
        assert_ne!(of(&TINY.replace("0.3]", "0.4]"), None), first);
        let radar = std::fs::read_to_string(dir.path().join("tiny_radar.toml")).unwrap();
        std::fs::write(dir.path().join("tiny_radar.toml"), radar.replace("power_dbm = 12", "power_dbm = 11"))
            .unwrap();
        assert_ne!(of(TINY, None), first);
    }

    #[test]
    fn the_schema_is_what_the_types_say() {
        let (name, text) = schema();
        let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("schema").join(name);
        if std::env::var_os("CATSEYE_WRITE_SCHEMA").is_some() {
            std::fs::write(&path, &text).unwrap();
        }
        let kept = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(kept == text, "{name} is out of date: run this test with CATSEYE_WRITE_SCHEMA=1");
    }

    /// Each of the 255 choices of `[keep]` asks for the products of its keys, and for the stages that they need.
    #[test]
    fn what_is_kept_decides_what_is_made() {
        use catseye::engine::Stage;
        use catseye::simulate::products::Product;
        for chosen in 1u32..256 {
            let on = |bit: u32| chosen >> bit & 1 == 1;
            let keep = Keep {
                adc: on(0),
                range_doppler: on(1),
                points: on(2),
                returns: on(3),
                echoes: on(4),
                truth: on(5),
                masks: on(6),
                lidar: on(7),
            };
            let products = keep.products();
            let wanted = [
                (Product::Samples, Some(Stage::Synthesis)),
                (Product::Map, Some(Stage::Transform)),
                (Product::Points, Some(Stage::Labels)),
                (Product::Returns, Some(Stage::Trace)),
                (Product::Echoes, Some(Stage::Trace)),
                (Product::Truth, Some(Stage::Trace)),
                (Product::Masks, Some(Stage::Angles)),
                (Product::Lidar, None),
            ];
            for (bit, (product, _)) in (0..).zip(wanted) {
                assert_eq!(products.has(product), on(bit), "{product:?} of {chosen:#b}");
            }
            let last = (0..).zip(wanted).filter(|(bit, _)| on(*bit)).filter_map(|(_, (_, last))| last).max();
            assert_eq!(products.last_stage(), last, "{chosen:#b}");
        }
    }
}
