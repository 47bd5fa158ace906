//! The dataset engine, which makes frames of drawn scenes into shards. A shard is complete when its marker
//! stands in `shards/`; the marker is renamed into place last. A run that was killed at any moment continues
//! with what is missing, and the bytes are the same whatever the order, the number of workers and the
//! interruptions.

use super::board::{Board, Claim, Queue};
use super::cards::CROISSANT;
use super::dataset::{
    DATASET, DatasetFile, Device, Marker, SHARDS, drawn_scene, frames_of, prepared, write_json,
};
use super::datasheet;
use super::drawn_scene::DrawnScene;
use super::hold::Hold;
use super::kept_radar::{KeptRadar, RadarsOfScenes};
use super::recipe::{Recipe, VERSION};
use super::rows;
use super::run::{Pictures, batch_of};
use super::store::{DatasetLayout, LAYOUT, Record};
use super::tally::Tally;
use super::usage::{Meter, Part, Usage};
use catseye::base::control::Control;
use catseye::base::error::{BadInput, Error, Result};
use catseye::base::machine;
use catseye::engine::Engine;
use catseye::formats::lock::Lock;
use catseye::formats::stage::{self, MANIFEST};
use catseye::simulate::{Frame, Prepared, Wanted, frames, remarks};
use rayon::ThreadPool;
use rayon::prelude::*;
use serde::Serialize;
use std::collections::{BTreeMap, VecDeque};
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread::Scope;
use std::time::{Duration, Instant};

/// Options of [`produce`].
pub struct Options<'a> {
    /// Number of workers, each with its share of the cores; default one per core on the CPU, one on a GPU.
    pub jobs: Option<usize>,
    /// Largest number of frames of a shard that are made together, each with all its radars; default [`BATCH`](super::run::BATCH) on a
    /// GPU, where they share submissions, and one on the CPU, where no other number changes anything. Memory may allow fewer. The
    /// bytes do not depend on it.
    pub batch: Option<usize>,
    /// Range of shards to make; default all.
    pub shards: Option<Range<u64>>,
    /// Whether to continue a dataset that another device began.
    pub mixed_devices: bool,
    /// Whether to restart in a folder that holds another dataset.
    pub force: bool,
    /// Flag that ends the run at the next safe point when it is set.
    pub cancel: &'a AtomicBool,
    /// Function that is called after each checked scene and each frame, from any thread.
    pub progress: &'a (dyn Fn(Progress) + Sync),
    /// Function that draws the pictures of a frame.
    pub pictures: Pictures<'a>,
    /// Rule by which `auto` chose the engine, where it had a choice.
    pub rule: Option<&'static str>,
    /// Function that is called with one line for the user while the run goes on.
    pub say: &'a (dyn Fn(&str) + Sync),
}

/// Phase of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// All scenes are drawn and read before the first frame.
    Checks,
    /// Frames are made.
    Frames,
}

/// Progress in checked scenes, or in frames of the shards that were missing when the run began, whoever makes them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Phase of the run.
    pub phase: Phase,
    /// Number that are done.
    pub done: u64,
    /// Total number.
    pub all: u64,
}

/// Report on a run.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Report {
    /// Folder of the dataset.
    #[serde(serialize_with = "catseye::formats::path_text")]
    pub folder: PathBuf,
    /// Number of frames of the dataset.
    pub frames: u64,
    /// Number of shards of the dataset.
    pub shards: u64,
    /// Number of shards of the whole dataset that are complete.
    pub shards_complete: u64,
    /// Number of shards that were found complete.
    pub shards_resumed: u64,
    /// Number of shards that an earlier recipe had made and that are the same in this one.
    pub shards_kept: u64,
    /// Number of shards that had a marker without their files and were made again.
    pub shards_repaired: u64,
    /// Number of shards that another run made in the same folder while this one was at work.
    pub shards_of_others: u64,
    /// Number of frames that this run made.
    pub frames_made: u64,
    /// Whether manifest and datasheet are written.
    pub complete: bool,
    /// Whether the run was interrupted.
    pub cancelled: bool,
    /// Properties of the meshes of the first scene that may show in frames, one line each.
    pub remarks: Vec<String>,
    /// Counts over the complete shards.
    pub tally: Tally,
    /// Size of the dataset, bytes.
    pub bytes: u64,
    /// How the run used its machine.
    pub usage: Usage,
}

/// Makes what is missing of the dataset in `out`. Several runs of the same recipe may work in one folder: each shard is made by the first
/// that comes to it, and the others wait at their end until it is complete, or make it themselves where its maker gave it up.
///
/// # Errors
/// Returns an error for a folder of something else, or of another recipe or device; for shards that do not
/// exist; for a scene that cannot be drawn, built or simulated; and for files that cannot be read or written.
/// What is complete stays.
pub fn produce(engine: &Engine, recipe: &Recipe, out: &Path, options: &Options<'_>) -> Result<Report> {
    if options.force && options.shards.is_some() {
        return Err(BadInput::new("--force would remove the shards of other runs")
            .key("--force")
            .remedy("leave out --force or --shards")
            .into());
    }
    recipe.check_built()?;
    let identity = recipe.identity()?;
    let radars = KeptRadar::all(&recipe.draw(0)?.parsed.radars)?;
    let file = DatasetFile {
        version: VERSION,
        catseye: env!("CARGO_PKG_VERSION").into(),
        name: recipe.name.clone(),
        licence: recipe.licence.clone(),
        recipe: identity.clone(),
        seed: recipe.seed,
        scenes: recipe.scenes,
        frames_per_scene: recipe.frames_per_scene,
        device: Device::of(&engine.report()),
        recipe_text: recipe.text().to_string(),
        radars: Some(radars.clone()),
    };
    let begun = begin(out, &file, options)?;
    let same = matches!(begun, Begun::Same);
    if !same {
        let checked = AtomicU64::new(0);
        let (phase, all) = (Phase::Checks, u64::from(recipe.scenes));
        recipe.check(options.cancel, &|| {
            let done = checked.fetch_add(1, Ordering::Relaxed) + 1;
            (options.progress)(Progress { phase, done, all });
        })?;
        if options.cancel.load(Ordering::Relaxed) {
            return Ok(Report {
                folder: out.to_path_buf(),
                frames: recipe.frames(),
                shards: recipe.frames().div_ceil(recipe.frames_per_shard),
                cancelled: true,
                ..Report::default()
            });
        }
    }
    let first = drawn_scene(recipe, 0)?;
    let remarks = remarks(&first.scenario, &first.scene, 0)?;
    drop(first);
    let basis = recipe.basis()?;
    let layout = layout(engine, recipe, same.then_some(out))?;
    let all = 0..layout.shards();
    let wanted = options.shards.clone().unwrap_or(all.clone());
    if wanted.start >= wanted.end || wanted.end > all.end {
        return Err(BadInput::new("there are no such shards")
            .key("--shards")
            .value(format!("{}:{}", wanted.start, wanted.end))
            .allowed(format!("0:{}", all.end))
            .into());
    }
    fs::create_dir_all(out).map_err(|e| Error::io(out, e))?;
    let basis = format!("{basis}{}\n", without_frames(&layout)?);
    let mender = Mender { recipe, radars: &radars, basis: &basis, layout: &layout, out, identity: &identity };
    match begun {
        Begun::Nothing => write_json(out, DATASET, &file)?,
        Begun::Same => {}
        Begun::Other { refusal } => {
            let hold = Hold::only(out)?;
            if options.force {
                only_ours(out)?;
                fs::remove_dir_all(out)
                    .and_then(|()| fs::create_dir_all(out))
                    .map_err(|e| Error::io(out, e))?;
            } else {
                mender.mend(refusal)?;
            }
            write_json(out, DATASET, &file)?;
            drop(hold);
        }
    }
    let hold = Hold::share(out);
    // Another run may have begun something else here since this one looked.
    let found = DatasetFile::read(out)?;
    if found.recipe != file.recipe || (found.device != file.device && !options.mixed_devices) {
        return Err(BadInput::new("another run has begun a different dataset in this folder")
            .file(out)
            .remedy("give another folder, or the same recipe, seed and device")
            .into());
    }
    layout.create(out)?;
    let shards = out.join(SHARDS);
    fs::create_dir_all(&shards).map_err(|e| Error::io(&shards, e))?;
    // Also what an earlier run that mended did not come to.
    let kept = mender.adopt(wanted.clone())?;

    let complete = |shard: u64| match Marker::read(out, shard) {
        Some(m) => m.holds(out, shard, &layout, &identity),
        None => false,
    };
    let missing: Vec<u64> = wanted.clone().filter(|s| !complete(*s)).collect();
    let is_broken = |s: &u64| {
        let of_another = Marker::read(out, *s).is_some_and(|m| m.recipe != identity);
        !of_another && out.join(Marker::name(*s)).exists()
    };
    let repaired = missing.iter().filter(|s| is_broken(s)).count() as u64;
    let cores = rayon::current_num_threads();
    let jobs = options.jobs.unwrap_or(default_jobs(engine, cores)).max(1);
    let count = |s: &u64| layout.frames_of(*s).end - layout.frames_of(*s).start;
    let meter = Meter::start(engine);
    let frames = FrameCount::new(missing.iter().map(count).sum(), options.progress);
    let claims =
        ShardClaims { out, layout: &layout, identity: &identity, frames: &frames, state: Mutex::default() };
    let mut left = missing.clone();
    let mut failure = None;
    let mut of_others = 0;
    let mut announced = false;
    while !left.is_empty() && failure.is_none() {
        let run = Run {
            engine,
            recipe,
            out,
            layout: &layout,
            file: &file,
            rule: options.rule,
            radars: &radars,
            jobs,
            batch: batch_of(engine, options.batch),
            basis: &basis,
            cancel: options.cancel,
            board: Board::new(
                recipe,
                &layout,
                &left,
                jobs,
                waiting_frames(&layout),
                Box::new(|shard| claims.claim(shard)),
            ),
            frames: &frames,
            stop: AtomicBool::new(false),
            failure: Mutex::new(None),
            meter: &meter,
            claims: &claims,
        };
        failure = run.all()?;
        drop(run);
        let Claimed { elsewhere, complete, failed, .. } = claims.take();
        failure = failure.or(failed);
        of_others += complete;
        left = elsewhere.keys().copied().collect();
        if let (Some((shard, holder)), false) = (elsewhere.first_key_value(), announced) {
            announced = true;
            (options.say)(&format!(
                "{holder} makes shard {shard} of the same folder: this run waits until it is complete"
            ));
        }
        // Until one of them is complete or given up.
        while failure.is_none()
            && !left.is_empty()
            && !options.cancel.load(Ordering::Relaxed)
            && left.iter().all(|shard| claims.is_made_elsewhere(*shard))
        {
            meter.wait_for_runs(OTHERS_INTERVAL);
        }
        if options.cancel.load(Ordering::Relaxed) {
            break;
        }
    }
    let frames_made = frames.made();

    let markers: Vec<Option<Marker>> =
        all.clone().map(|s| Marker::read(out, s).filter(|m| m.holds(out, s, &layout, &identity))).collect();
    let there = markers.iter().flatten().count() as u64;
    if let Some(e) = failure {
        return Err(match e {
            Error::Io { .. } => Error::Failed(format!(
                "{e}; {there} of {} shards are complete and kept; run the same command to make the others",
                all.end
            )),
            e => e,
        });
    }
    let mut tally = Tally::default();
    markers.iter().flatten().for_each(|m| tally.add(&m.tally));
    let bytes = markers.iter().flatten().flat_map(|m| &m.files).map(|f| f.bytes).sum();
    let cancelled = options.cancel.load(Ordering::Relaxed);
    let markers: Option<Vec<Marker>> = if cancelled { None } else { markers.into_iter().collect() };
    if let Some(markers) = &markers {
        let made = datasheet::Made { recipe, file: &file, layout: &layout, markers, tally: &tally, bytes };
        // One of several runs at a time: each writes the same.
        let mut waited = false;
        let lock = loop {
            match Lock::attempt(out, out.join(DATASHEET_LOCK))? {
                Ok(lock) => break lock,
                Err(_) if options.cancel.load(Ordering::Relaxed) => {
                    return Err(Error::Interrupted(
                        "all shards are complete and another run is writing the datasheet; run the same command to check it".into(),
                    ));
                }
                Err(_) => meter.wait_for_runs(OTHERS_INTERVAL),
            }
            waited = true;
        };
        let start = Instant::now();
        // Whoever was waited for has described the same shards.
        if !(waited && out.join(MANIFEST).exists()) {
            datasheet::write(engine, &made, out, options.pictures)?;
        }
        drop(lock);
        meter.add(Part::Datasheet, start.elapsed().as_secs_f64());
        // The last one who leaves clears up after all.
        if hold.alone() == Some(true) {
            datasheet::tidy(out, true)?;
        }
    }
    if markers.is_none() && !cancelled && options.shards.is_none() {
        return Err(Error::Failed(format!(
            "{}: {there} of {} shards are complete, because another run changed the folder; run the same \
                command again",
            out.display(),
            all.end
        )));
    }
    Ok(Report {
        folder: out.to_path_buf(),
        frames: layout.frames,
        shards: all.end,
        shards_complete: there,
        shards_resumed: wanted.end - wanted.start - missing.len() as u64,
        shards_kept: kept,
        shards_repaired: repaired,
        shards_of_others: of_others,
        frames_made,
        complete: markers.is_some(),
        cancelled,
        remarks,
        tally,
        bytes,
        usage: meter.usage(engine, jobs, frames_made),
    })
}

/// Interval at which a run looks whether others have ended what they make in its folder.
const OTHERS_INTERVAL: Duration = Duration::from_millis(100);
/// Name of the lock of whoever describes the dataset.
const DATASHEET_LOCK: &str = ".datasheet.partial-lock";

/// Number of workers where none is given: one for each processor on the CPU and one on a software driver, which computes on the same
/// processors. On a GPU one for two processors, up to eight: while some wait for the device, others prepare frames and hand them on.
fn default_jobs(engine: &Engine, cores: usize) -> usize {
    match engine {
        Engine::Cpu(_) => cores,
        Engine::Gpu(gpu) if gpu.is_hardware() => (cores / 2).clamp(1, 8),
        Engine::Gpu(_) => 1,
    }
}

/// Content of the output folder.
enum Begun {
    Nothing,
    /// This dataset was begun.
    Same,
    /// A dataset was begun with something else; `refusal` is the error if it can be neither mended nor
    /// removed.
    Other {
        refusal: Error,
    },
}

/// Finds out what stands in `out`, and changes nothing. Returns an error for something that is no dataset, or
/// another device.
fn begin(out: &Path, file: &DatasetFile, options: &Options<'_>) -> Result<Begun> {
    if out.as_os_str().is_empty() {
        return Err(BadInput::new("the output has no name").key("-o").into());
    }
    let bad = |problem: String| BadInput::new(problem).file(out);
    let entries = match fs::read_dir(out) {
        Ok(entries) => entries,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Begun::Nothing),
        Err(_) if out.is_file() => {
            return Err(bad("is a file, and the output is a folder".into())
                .remedy("give another name")
                .into());
        }
        Err(e) => return Err(Error::io(out, e)),
    };
    let names = entries.map(|e| e.map(|e| e.file_name().to_string_lossy().into_owned()));
    let names: Vec<String> = names.collect::<std::io::Result<_>>().map_err(|e| Error::io(out, e))?;
    if !names.iter().any(|n| n == DATASET) {
        // A run that was killed before its first file leaves that one unfinished.
        if names.iter().all(|n| n.starts_with(&format!(".{DATASET}."))) {
            return Ok(Begun::Nothing);
        }
        return Err(bad(
            "is a folder that holds something other than a dataset (no dataset.json), so nothing is written there".into(),
        )
        .remedy("give another name for the output")
        .into());
    }
    let found = DatasetFile::read(out)?;
    if found.recipe != file.recipe {
        let why = if found.recipe_text != file.recipe_text {
            format!(
                "holds a dataset of another recipe ('{}'), and none of its shards has the same contents in this one",
                found.name
            )
        } else if found.seed != file.seed {
            format!("holds a dataset of seed {}", found.seed)
        } else if found.version != file.version {
            format!(
                "holds a dataset of format version {}, and this catseye writes version {}",
                found.version, file.version
            )
        } else if found.catseye != file.catseye {
            format!("holds a dataset that catseye {} began", found.catseye)
        } else {
            "holds a dataset of the same recipe, but a file that it names has changed".into()
        };
        if found.device != file.device && !options.mixed_devices && !options.force {
            return Err(another_device(out, &found.device, &file.device));
        }
        let refusal = bad(why).remedy("give another folder, or --force to remove the existing dataset");
        return Ok(Begun::Other { refusal: refusal.into() });
    }
    if found.device != file.device && !options.mixed_devices {
        let refusal = another_device(out, &found.device, &file.device);
        if options.force {
            return Ok(Begun::Other { refusal });
        }
        return Err(refusal);
    }
    Ok(Begun::Same)
}

fn another_device(out: &Path, found: &Device, here: &Device) -> Error {
    BadInput::new(format!("was begun on another device ({found})"))
        .file(out)
        .value(here)
        .remedy(
            "give --mixed-devices to continue; the bytes of a shard then depend on the device that made it",
        )
        .into()
}

/// The layout as far as it determines the bytes of a shard.
fn without_frames(layout: &DatasetLayout) -> Result<String> {
    let layout = DatasetLayout { frames: 0, ..layout.clone() };
    serde_json::to_string(&layout).map_err(|e| Error::Failed(format!("layout: {e}")))
}

/// Whether a file, or a marker, belongs to a frame or shard of this layout from these numbers on.
fn is_of(layout: &DatasetLayout, name: &str, frames: u64, shards: u64) -> bool {
    let number = |text: Option<&str>| text.and_then(|t| t.split('.').next()?.parse::<u64>().ok());
    let part = |text: &str| number(text.strip_prefix("part-"));
    let parts: Vec<&str> = name.split('/').collect();
    match parts[..] {
        [SHARDS, marker] => number(Some(marker)).is_some_and(|n| n >= shards),
        ["data", file] | ["tables", _, file] => part(file).is_some_and(|n| n >= shards),
        [array, "c", n, ..] => layout.array(array).is_ok() && number(Some(n)).is_some_and(|n| n >= shards),
        [folder, _] => number(folder.strip_prefix("frame_")).is_some_and(|n| n >= frames),
        _ => false,
    }
}

/// Returns an error for a file that no dataset has, so that the folder is not removed.
fn only_ours(out: &Path) -> Result<()> {
    let layout = DatasetLayout::open(out).ok();
    let is_ours = |name: &String| {
        datasheet::is_own(name, 0)
            || name.split('/').any(datasheet::is_unfinished)
            || layout.as_ref().is_some_and(|l| is_of(l, name, 0, 0))
    };
    match stage::files_of(out)?.into_iter().find(|name| !is_ours(name)) {
        Some(foreign) => Err(BadInput::new(format!(
            "holds '{foreign}', which catseye did not write, so it is not replaced"
        ))
        .file(out)
        .remedy("give another name for the output")
        .into()),
        None => Ok(()),
    }
}

/// Takes over shards of an earlier recipe that are the same in the new one.
struct Mender<'a> {
    recipe: &'a Recipe,
    /// Radars of scene 0.
    radars: &'a [KeptRadar],
    basis: &'a str,
    layout: &'a DatasetLayout,
    out: &'a Path,
    identity: &'a str,
}

impl Mender<'_> {
    /// Whether a marker of any recipe stands for what this recipe would make.
    fn is_same(&self, marker: &Marker, shard: u64) -> Result<bool> {
        if shard >= self.layout.shards() || !marker.holds(self.out, shard, self.layout, &marker.recipe) {
            return Ok(false);
        }
        Ok(marker.drawn_from == self.drawn_from(shard)?.0)
    }

    fn drawn_from(&self, shard: u64) -> Result<(String, RadarsOfScenes)> {
        self.recipe.drawn_from(self.basis, self.layout.frames_of(shard), self.radars)
    }

    /// Removes from the folder what belongs to the earlier recipe alone, if a shard of it can stay or none is
    /// complete. Shards that are made again stay until then. Returns `refusal` otherwise, and nothing is
    /// changed.
    fn mend(&self, refusal: Error) -> Result<()> {
        let earlier = match self.out.join(LAYOUT).exists() {
            true => Some(DatasetLayout::open(self.out)?),
            // Killed before it had one, so it has no shards.
            false => None,
        };
        let shards = earlier.as_ref().map_or(0, DatasetLayout::shards);
        let markers: Vec<(u64, Marker)> =
            (0..shards).filter_map(|s| Some((s, Marker::read(self.out, s)?))).collect();
        let same: Vec<bool> = markers.par_iter().map(|(s, m)| self.is_same(m, *s)).collect::<Result<_>>()?;
        if !markers.is_empty() && !same.contains(&true) {
            return Err(refusal);
        }
        for name in [MANIFEST, LAYOUT, CROISSANT, datasheet::README, datasheet::SCHEMA, datasheet::STATISTICS]
        {
            remove(&self.out.join(name))?;
        }
        let previews = self.out.join(datasheet::PREVIEWS);
        if previews.exists() {
            fs::remove_dir_all(&previews).map_err(|e| Error::io(&previews, e))?;
        }
        // What lies behind the new end; all where no shard was complete, for then the layout may be another one.
        let (frames, shards) = match markers.is_empty() {
            true => (0, 0),
            false => (self.layout.frames, self.layout.shards()),
        };
        if let Some(earlier) = &earlier {
            for name in stage::files_of(self.out)? {
                let is_metadata = name == "zarr.json" || name.ends_with("/zarr.json");
                if is_of(earlier, &name, frames, shards) || (markers.is_empty() && is_metadata) {
                    let path = self.out.join(&name);
                    remove(&path)?;
                    // A folder goes with its last file; others hold more and stay.
                    let _ = path.parent().map(fs::remove_dir);
                }
            }
        }
        Ok(())
    }

    /// Updates the markers of an earlier recipe to this one where they are the same, and returns their
    /// number.
    fn adopt(&self, shards: Range<u64>) -> Result<u64> {
        let adopt = |shard: u64| -> Result<u64> {
            match Marker::read(self.out, shard) {
                Some(m) if m.recipe != self.identity && self.is_same(&m, shard)? => {
                    // Scene 0, from which others differ, may have other radars in the new recipe.
                    let radars = self.drawn_from(shard)?.1;
                    let marker = Marker { recipe: self.identity.into(), radars, ..m };
                    write_json(self.out, &Marker::name(shard), &marker)?;
                    Ok(1)
                }
                _ => Ok(0),
            }
        };
        shards.into_par_iter().map(adopt).sum()
    }
}

/// The layout of a frame of this dataset: that in the folder, or else that of its first frame.
fn layout(engine: &Engine, recipe: &Recipe, begun: Option<&Path>) -> Result<DatasetLayout> {
    // A run that was killed between the two files has none.
    if let Some(dir) = begun.filter(|d| d.join(LAYOUT).exists()) {
        return DatasetLayout::open(dir);
    }
    let site = drawn_scene(recipe, 0)?;
    let prepared = prepared(recipe, &site)?;
    let record = rows::record(recipe, &site, 0, frames_of(engine, &site, &prepared, 0, Control::default())?)?;
    Ok(layout_of(recipe, &site, &record))
}

/// The layout of a dataset whose frames hold the same as this one.
pub(super) fn layout_of(recipe: &Recipe, site: &DrawnScene, record: &Record) -> DatasetLayout {
    DatasetLayout {
        format: recipe.format,
        compression: recipe.compression,
        frames: recipe.frames(),
        frames_per_shard: recipe.frames_per_shard,
        arrays: record.arrays.iter().map(|a| rows::array_spec(a, recipe.pack_grids)).collect(),
        tables: rows::table_specs(recipe, site),
        attributes: [("name".to_string(), recipe.name.clone().into())].into_iter().collect(),
    }
}

fn remove(path: &Path) -> Result<()> {
    match fs::remove_file(path) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(Error::io(path, e)),
        _ => Ok(()),
    }
}

/// Counts the frames of the shards that were missing when the run began, so that its progress ends at all of them also where others make
/// some.
struct FrameCount<'a> {
    /// Number of frames of those shards.
    all: u64,
    /// Number of frames that this run made.
    made: AtomicU64,
    /// Number of frames that are made, by whomever.
    done: AtomicU64,
    progress: &'a (dyn Fn(Progress) + Sync),
}

impl<'a> FrameCount<'a> {
    fn new(all: u64, progress: &'a (dyn Fn(Progress) + Sync)) -> FrameCount<'a> {
        FrameCount { all, made: AtomicU64::new(0), done: AtomicU64::new(0), progress }
    }

    /// Counts a frame that this run made.
    fn count_own(&self) {
        self.made.fetch_add(1, Ordering::Relaxed);
        self.count(1);
    }

    /// Counts frames that are made; those of a shard that another run completed, once.
    fn count(&self, frames: u64) {
        let done = self.done.fetch_add(frames, Ordering::Relaxed) + frames;
        (self.progress)(Progress { phase: Phase::Frames, done, all: self.all });
    }

    /// Number of frames that this run made.
    fn made(&self) -> u64 {
        self.made.load(Ordering::Relaxed)
    }
}

/// Which shards this run makes, in a folder in which others may be at work.
struct ShardClaims<'a> {
    out: &'a Path,
    layout: &'a DatasetLayout,
    identity: &'a str,
    frames: &'a FrameCount<'a>,
    state: Mutex<Claimed>,
}

#[derive(Default)]
struct Claimed {
    /// The locks of the shards that this run makes.
    held: BTreeMap<u64, Lock>,
    /// Shards that another run makes, with its process and command.
    elsewhere: BTreeMap<u64, String>,
    /// Number of shards that another run had made when this one came to them.
    complete: u64,
    /// Why a shard could not be begun.
    failed: Option<Error>,
}

impl ShardClaims<'_> {
    fn state(&self) -> MutexGuard<'_, Claimed> {
        self.state.lock().unwrap_or_else(|e| e.into_inner())
    }

    fn lock(&self, shard: u64) -> Result<std::result::Result<Lock, String>> {
        Lock::attempt(self.out, self.out.join(SHARDS).join(format!(".{shard:06}.partial-lock")))
    }

    fn is_complete(&self, shard: u64) -> bool {
        Marker::read(self.out, shard).is_some_and(|m| m.holds(self.out, shard, self.layout, self.identity))
    }

    /// Whether this run makes a shard: it is not complete, and nobody else is at it.
    fn claim(&self, shard: u64) -> bool {
        let made = self.lock(shard).and_then(|lock| {
            let Ok(lock) = lock else { return Ok(lock) };
            if self.is_complete(shard) {
                self.state().complete += 1;
                let frames = self.layout.frames_of(shard);
                self.frames.count(frames.end - frames.start);
                return Ok(Err(String::new()));
            }
            // A marker that does not hold says nothing while its shard is made again.
            remove(&self.out.join(Marker::name(shard)))?;
            Ok(Ok(lock))
        });
        let mut state = self.state();
        match made {
            Ok(Ok(lock)) => {
                state.held.insert(shard, lock);
                return true;
            }
            Ok(Err(holder)) if holder.is_empty() => {}
            Ok(Err(holder)) => drop(state.elsewhere.insert(shard, holder)),
            Err(e) => drop(state.failed.get_or_insert(e)),
        }
        false
    }

    /// Gives up a shard that is complete.
    fn release(&self, shard: u64) {
        self.state().held.remove(&shard);
    }

    /// Whether another run is still at a shard.
    fn is_made_elsewhere(&self, shard: u64) -> bool {
        !self.is_complete(shard) && matches!(self.lock(shard), Ok(Err(_)))
    }

    /// What was claimed so far; the shards that are not complete are given up.
    fn take(&self) -> Claimed {
        std::mem::take(&mut self.state())
    }
}

/// A frame on its way to the writer, or an error.
type Item = Result<(Record, Tally)>;

/// A scene that is ready for its frames.
struct ReadyScene<'a> {
    site: DrawnScene,
    prepared: Prepared<'a>,
}

impl<'a> ReadyScene<'a> {
    fn new(recipe: &'a Recipe, scene: u32) -> Result<ReadyScene<'a>> {
        let site = drawn_scene(recipe, scene)?;
        let prepared = prepared(recipe, &site)?;
        Ok(ReadyScene { site, prepared })
    }
}

/// Frames of a scene that a worker has claimed.
type FrameClaim<'a> = Claim<Item, ReadyScene<'a>>;

/// A claimed frame of the dataset.
struct Slot<'c, 'a> {
    claim: &'c FrameClaim<'a>,
    site: &'c DrawnScene,
    /// Number of the frame in its scene, and in the dataset.
    index: u32,
    number: u64,
    /// Number of its radars.
    radars: usize,
}

/// What succeeded before the first failure, and that failure.
fn until_error<T>(list: Vec<Result<T>>) -> (Vec<T>, Option<Error>) {
    let mut good = Vec::with_capacity(list.len());
    for one in list {
        match one {
            Ok(one) => good.push(one),
            Err(e) => return (good, Some(e)),
        }
    }
    (good, None)
}

/// The share of the free memory that frames may take which wait to be written, and the bounds of what that is, bytes.
const WAITING_SHARE: u64 = 4;
const WAITING_BYTES: [u64; 2] = [256 << 20, 8 << 30];
/// What a frame's tables take, about, bytes.
const TABLES_BYTES: u64 = 256 << 10;

/// Number of frames that may be made and wait to be written.
fn waiting_frames(layout: &DatasetLayout) -> u64 {
    let [least, most] = WAITING_BYTES;
    let bytes = machine::available_bytes().map_or(least, |free| (free / WAITING_SHARE).clamp(least, most));
    bytes / (layout.array_bytes() as u64 + TABLES_BYTES)
}

/// Ends all claims if a worker panics, so that no writer waits for its frames.
struct CloseOnPanic<'b, 'a>(&'b Board<'a, Item, ReadyScene<'a>>);

impl Drop for CloseOnPanic<'_, '_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.close();
        }
    }
}

struct Run<'a> {
    engine: &'a Engine,
    recipe: &'a Recipe,
    out: &'a Path,
    layout: &'a DatasetLayout,
    file: &'a DatasetFile,
    /// Rule by which `auto` chose the engine.
    rule: Option<&'static str>,
    /// Radars of scene 0.
    radars: &'a [KeptRadar],
    jobs: usize,
    /// Largest number of frames that a worker makes together.
    batch: usize,
    basis: &'a str,
    cancel: &'a AtomicBool,
    board: Board<'a, Item, ReadyScene<'a>>,
    frames: &'a FrameCount<'a>,
    stop: AtomicBool,
    failure: Mutex<Option<Error>>,
    meter: &'a Meter,
    claims: &'a ShardClaims<'a>,
}

impl<'a> Run<'a> {
    /// Runs all and returns the first failure, if any.
    fn all(&self) -> Result<Option<Error>> {
        let cores = rayon::current_num_threads();
        let jobs = self.jobs.min(usize::try_from(self.frames.all).unwrap_or(usize::MAX).max(1));
        // A frame is small: threads of its own for each worker cost less than sharing every step among all.
        let threads = (cores / jobs).max(1);
        let pool = || {
            let built = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            built.map_err(|e| Error::Failed(format!("threads: {e}")))
        };
        let pools: Vec<ThreadPool> = (0..jobs).map(|_| pool()).collect::<Result<_>>()?;
        std::thread::scope(|scope| {
            for pool in &pools {
                self.begin(scope, move || pool.install(|| self.compute(scope)));
            }
        });
        Ok(self.failure().take())
    }

    /// Starts a thread of the run. If the system has none left, the run fails.
    fn begin<'scope>(&self, scope: &'scope Scope<'scope, '_>, work: impl FnOnce() + Send + 'scope) {
        if let Err(e) = std::thread::Builder::new().spawn_scoped(scope, work) {
            self.fail(Error::Failed(format!("threads: {e}")));
        }
    }

    fn failure(&self) -> MutexGuard<'_, Option<Error>> {
        self.failure.lock().unwrap_or_else(|e| e.into_inner())
    }

    fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed) || self.cancel.load(Ordering::Relaxed)
    }

    fn fail(&self, e: Error) {
        // What stopping others causes is no failure of its own.
        if !self.stopped() {
            self.failure().get_or_insert(e);
        }
        self.stop.store(true, Ordering::Relaxed);
        self.board.close();
    }

    /// Makes frames until none is left, and starts the writers of the shards that they open.
    fn compute<'scope>(&'scope self, scope: &'scope Scope<'scope, '_>) {
        let _guard = CloseOnPanic(&self.board);
        let mut own = None;
        while let Some((claims, begun)) =
            self.board.claim(own, self.batch as u64, &|| self.stopped(), &self.meter.waited)
        {
            if let Some(queue) = begun {
                own = Some(queue.shard());
                self.begin(scope, move || self.write_shard(queue).unwrap_or_else(|e| self.fail(e)));
            }
            own = claims.first().map(|c| c.shard).or(own);
            if let Err(e) = self.frames(&claims) {
                // Before the claims are given up, which their writer would take for the failure.
                self.fail(e);
            }
        }
        if self.stopped() {
            self.board.close();
        }
    }

    /// Makes the claimed frames as long as they are wanted, and sends them in their order.
    fn frames(&self, claims: &[FrameClaim<'a>]) -> Result<()> {
        let mut new: Vec<u32> = claims.iter().filter(|c| c.prepared.is_none()).map(|c| c.scene).collect();
        new.dedup();
        let make_ready = |scene: &u32| -> Result<(u32, Arc<ReadyScene<'a>>)> {
            let made = self.meter.timed(Part::Scenes, || ReadyScene::new(self.recipe, *scene));
            let ready = Arc::new(made?);
            self.board.ready(*scene, &ready);
            Ok((*scene, ready))
        };
        // What comes before a scene that fails is made all the same.
        let (ready, sooner) = until_error(new.par_iter().map(make_ready).collect());
        let ready: BTreeMap<u32, Arc<ReadyScene<'a>>> = ready.into_iter().collect();
        let of_scene = u64::from(self.recipe.frames_per_scene);
        // The frames of all radars, and which of these make up each frame of the dataset.
        let (mut wanted, mut slots) = (Vec::new(), VecDeque::new());
        for claim in claims {
            let Some(scene) = claim.prepared.as_ref().or_else(|| ready.get(&claim.scene)) else { break };
            for index in claim.frames.clone() {
                let number = u64::from(claim.scene) * of_scene + u64::from(index);
                debug_assert_eq!(self.layout.shard_of(number), claim.shard);
                let radars = scene.site.scenario.radars.len();
                let prepared = &scene.prepared;
                wanted.extend((0..radars).map(|which| Wanted { prepared, which, index }));
                slots.push_back(Slot { claim, site: &scene.site, index, number, radars });
            }
        }
        let control = Control { progress: None, cancel: Some(self.cancel) };
        let (mut done, mut held) = (0, VecDeque::new());
        while done < wanted.len() {
            if self.stopped() {
                return Ok(());
            }
            let radars = slots.iter().take(self.batch).map(|s| s.radars).sum::<usize>() - held.len();
            let (made, failure) = until_error(frames(self.engine, &wanted[done..done + radars], control));
            done += made.len();
            made.iter().for_each(|frame| self.meter.add_frame(frame));
            held.extend(made);
            let mut whole: Vec<(Slot<'_, 'a>, Vec<Frame>)> = Vec::new();
            while slots.front().is_some_and(|s| s.radars <= held.len())
                && let Some(slot) = slots.pop_front()
            {
                let radars = held.drain(..slot.radars).collect();
                whole.push((slot, radars));
            }
            let items = whole.into_par_iter().map(|(slot, radars)| {
                let item = self.meter.timed(Part::Records, || self.item(&slot, radars));
                (slot.claim, slot.index, item)
            });
            for (claim, index, item) in items.collect::<Vec<_>>() {
                if !claim.send(index, Ok(item?)) || self.stopped() {
                    return Ok(());
                }
            }
            failure.map_or(Ok(()), Err)?;
        }
        sooner.map_or(Ok(()), Err)
    }

    fn item(&self, slot: &Slot<'_, 'a>, radars: Vec<Frame>) -> Result<(Record, Tally)> {
        let tally = Tally::of(slot.site, self.recipe.split(slot.claim.scene), &radars);
        Ok((rows::record(self.recipe, slot.site, slot.number, radars)?, tally))
    }

    fn write_shard(&self, mut queue: Queue<Item>) -> Result<()> {
        let shard = queue.shard();
        let mut tally = Tally::default();
        // What is not waiting for the next frame.
        let (start, mut waited_s) = (Instant::now(), 0.0);
        let files = self.layout.write_shard(self.out, shard, &mut |_| {
            let asked = Instant::now();
            let frame = queue.take(&self.board);
            waited_s += asked.elapsed().as_secs_f64();
            let (record, mut counts) = frame.ok_or_else(|| Error::Failed("the run was stopped".into()))??;
            counts.note_rows(&record.tables);
            tally.add(&counts);
            self.frames.count_own();
            Ok(record)
        })?;
        let frames = self.layout.frames_of(shard);
        let (drawn_from, radars) = self.recipe.drawn_from(self.basis, frames.clone(), self.radars)?;
        let marker = Marker {
            shard,
            first_frame: frames.start,
            frames: frames.end - frames.start,
            recipe: self.file.recipe.clone(),
            device: Device::of(&self.engine.report()),
            engine_rule: self.rule.map(str::to_string),
            files,
            tally,
            drawn_from,
            radars,
        };
        write_json(self.out, &Marker::name(shard), &marker)?;
        self.claims.release(shard);
        self.meter.add(Part::Writing, start.elapsed().as_secs_f64() - waited_s);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::{Compression, Format};

    fn device() -> Device {
        Device::of(&Engine::Cpu(catseye::engine::Precision::F32).report())
    }

    /// A run makes the first of three shards and finds the others complete, one at once and one later: its progress ends at all frames.
    #[test]
    fn progress_counts_the_shards_of_other_runs() {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path();
        fs::create_dir_all(out.join(SHARDS)).unwrap();
        let layout = DatasetLayout {
            format: Format::Frames,
            compression: Compression::None,
            frames: 10,
            frames_per_shard: 4,
            arrays: Vec::new(),
            tables: Vec::new(),
            attributes: Default::default(),
        };
        let complete = |shard: u64| {
            let frames = layout.frames_of(shard);
            let marker = Marker {
                shard,
                first_frame: frames.start,
                frames: frames.end - frames.start,
                recipe: "recipe".into(),
                device: device(),
                engine_rule: None,
                files: Vec::new(),
                tally: Tally::default(),
                drawn_from: String::new(),
                radars: RadarsOfScenes::default(),
            };
            write_json(out, &Marker::name(shard), &marker).unwrap();
        };
        let said = Mutex::new(Vec::new());
        let progress = |p: Progress| {
            assert_eq!((p.phase, p.all), (Phase::Frames, 10));
            said.lock().unwrap().push(p.done);
        };
        let frames = FrameCount::new(10, &progress);
        let claims = ShardClaims {
            out,
            layout: &layout,
            identity: "recipe",
            frames: &frames,
            state: Mutex::default(),
        };
        assert!(claims.claim(0));
        complete(1);
        assert!(!claims.claim(1));
        (0..4).for_each(|_| frames.count_own());
        // Another run is still at the last one, which counts when it is complete and not before.
        let other = claims.lock(2).unwrap().unwrap();
        assert!(!claims.claim(2) && claims.is_made_elsewhere(2));
        assert_eq!(*said.lock().unwrap(), [4, 5, 6, 7, 8]);
        complete(2);
        drop(other);
        assert!(!claims.is_made_elsewhere(2) && !claims.claim(2));
        assert_eq!(*said.lock().unwrap(), [4, 5, 6, 7, 8, 10]);
        assert_eq!((frames.made(), claims.take().complete), (4, 2));
    }
}
