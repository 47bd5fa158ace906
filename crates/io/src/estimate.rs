//! What a dataset will take in time and on disk, from some of its frames (`catseye dataset --dry-run`).

use super::dataset::{drawn_scene, frames_of, prepared};
use super::datasheet;
use super::drawn_scene::DrawnScene;
use super::produce::layout_of;
use super::recipe::Recipe;
use super::rows;
use super::store::{DatasetLayout, Format, Record};
use super::usage::{Meter, Part, StageSeconds};
use catseye::base::control::Control;
use catseye::base::error::{Error, Result};
use catseye::engine::{Engine, Stage};
use catseye::scene::{Scene, Shape};
use catseye::simulate::Prepared;
use catseye::simulate::products::{Product, Products};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::time::Instant;

/// Largest number of frames that an estimate makes.
const TRIED: u32 = 8;
/// Number of scenes of which the cost of each class is measured, and largest number of classes.
const CLASSED: u32 = 2;
const CLASSES: usize = 6;

/// Cost of the objects of one class.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct ClassCost {
    /// The class; "" for objects without one.
    pub class: String,
    /// Number of its objects with a mesh in a scene, mean.
    pub objects: f64,
    /// Number of their triangles in a scene, mean.
    pub triangles: f64,
    /// Processor time that a frame takes less when the radar does not see them, s: refining, placing and tracing.
    pub core_s: f64,
}

/// Estimate of a dataset's size and time from some of its frames.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Estimate {
    /// Number of scenes of the recipe.
    pub scenes: u32,
    /// Number of frames of the dataset.
    pub frames: u64,
    /// Number of shards of the dataset.
    pub shards: u64,
    /// Number of frames of which this is the mean: one each of scenes spread over the recipe.
    pub frames_tried: u32,
    /// Number of processors.
    pub processors: usize,
    /// Processor time of a frame without its scene, s.
    pub core_seconds_a_frame: f64,
    /// Processor time of drawing, building and refining a scene, s; its frames share it.
    pub core_seconds_a_scene: f64,
    /// Processor time of a frame by stage, s; of scenes that of one scene.
    pub stages: StageSeconds,
    /// Processor time by class of objects, the costliest first. What two classes share counts for both, or for neither.
    pub classes: Vec<ClassCost>,
    /// Time on all processors for one frame, with its share of its scene, s.
    pub seconds_a_frame: f64,
    /// Time on all processors for the whole dataset, s.
    pub seconds: f64,
    /// Largest memory of a worker, bytes.
    pub worker_bytes: u64,
    /// Size of a frame's arrays before compression, bytes.
    pub array_bytes_a_frame: u64,
    /// Size of a frame as it is stored, with its tables and their files, bytes.
    pub bytes_a_frame: u64,
    /// Approximate size of the datasheet with its pictures and of the checksums, bytes.
    pub datasheet_bytes: u64,
    /// Size of the whole dataset, bytes.
    pub bytes: u64,
}

/// A folder that is removed when this is dropped.
struct Scratch(PathBuf);

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Does work number 0 to `count`, as many at a time as there are processors, each on one thread, so that its time is processor time: a
/// worker of a pool that waits for another pool would take up further work meanwhile.
fn each_on_one_thread<T: Send>(count: u32, work: impl Fn(u32) -> Result<T> + Sync) -> Result<Vec<T>> {
    let next = AtomicU32::new(0);
    let run = || -> Result<Vec<(u32, T)>> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
        let pool = pool.map_err(|e| Error::Failed(format!("threads: {e}")))?;
        let mut done = Vec::new();
        loop {
            let k = next.fetch_add(1, Ordering::Relaxed);
            if k >= count {
                return Ok(done);
            }
            done.push((k, pool.install(|| work(k))?));
        }
    };
    let threads = count.min(rayon::current_num_threads() as u32);
    let done: Vec<Result<Vec<(u32, T)>>> = std::thread::scope(|s| {
        let threads: Vec<_> = (0..threads).map(|_| s.spawn(run)).collect();
        threads
            .into_iter()
            .map(|t| t.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
            .collect()
    });
    let mut all: Vec<(u32, T)> =
        done.into_iter().collect::<Result<Vec<_>>>()?.into_iter().flatten().collect();
    all.sort_by_key(|(k, _)| *k);
    Ok(all.into_iter().map(|(_, made)| made).collect())
}

/// Makes a frame of some scenes, the second where there is one, writes them to the temporary folder as the dataset would, and measures time
/// and size; and traces some of them without the objects of each class. `progress` is called with the number of steps that are done, and of all.
///
/// # Errors
/// Returns an error if the format is not built in, if a scene cannot be drawn or built, and the errors of
/// simulating and writing a frame.
pub fn estimate(engine: &Engine, recipe: &Recipe, progress: &(dyn Fn(u64, u64) + Sync)) -> Result<Estimate> {
    recipe.check_built()?;
    let tried = TRIED.min(recipe.scenes);
    let is_traced = recipe.keep.products().reaches(Stage::Trace) && recipe.kept.is_none();
    let classed = if is_traced { CLASSED.min(tried) } else { 0 };
    let steps = u64::from(tried + classed);
    let (radars, done, peak) = (AtomicU64::new(0), AtomicU64::new(0), AtomicU64::new(0));
    let step = || progress(done.fetch_add(1, Ordering::Relaxed) + 1, steps);
    progress(0, steps);
    let meter = Meter::start(engine);
    let scene_of = |k: u32| (u64::from(k) * u64::from(recipe.scenes) / u64::from(tried)) as u32;
    let make = |k: u32| -> Result<Record> {
        let (site, prepared) = meter.timed(Part::Scenes, || -> Result<_> {
            let site = drawn_scene(recipe, scene_of(k))?;
            let prepared = prepared(recipe, &site)?;
            Ok((site, prepared))
        })?;
        let timed = |number: u32| -> Result<_> {
            let start = Instant::now();
            let frames = frames_of(engine, &site, &prepared, number, Control::default())?;
            Ok((frames, start.elapsed().as_secs_f64()))
        };
        let (mut frames, first_s) = timed(0)?;
        // What the first frame finds the others share: meshes in their own frames, bodies at rest.
        if recipe.frames_per_scene > 1 {
            let second_s;
            (frames, second_s) = timed(1)?;
            meter.add(Part::Scenes, (first_s - second_s).max(0.0));
        }
        radars.store(frames.len() as u64, Ordering::Relaxed);
        for frame in &frames {
            meter.add_frame(frame);
            let radar = &site.scenario.radars[frame.radar];
            let bytes = engine.memory(radar, frame.echoes.list.len()).peak_bytes;
            peak.fetch_max(bytes as u64, Ordering::Relaxed);
        }
        let record = meter.timed(Part::Records, || rows::record(recipe, &site, u64::from(k), frames))?;
        step();
        Ok(record)
    };
    let records = each_on_one_thread(tried, make)?;
    let costs = each_on_one_thread(classed, |k| {
        let costs = class_costs(engine, &drawn_scene(recipe, scene_of(k))?)?;
        step();
        Ok(costs)
    })?;
    let layout = DatasetLayout {
        frames: u64::from(tried),
        frames_per_shard: recipe.frames_per_shard.min(u64::from(tried)),
        ..layout_of(recipe, &drawn_scene(recipe, 0)?, &records[0])
    };
    let scratch = Scratch(std::env::temp_dir().join(format!("catseye-dry-run-{}", std::process::id())));
    layout.create(&scratch.0)?;
    let mut left = records.into_iter();
    let (mut bytes, mut files) = (0, 0);
    for shard in 0..layout.shards() {
        let mut next = |_| left.next().ok_or_else(|| Error::Failed("a frame is missing".into()));
        let written = meter.timed(Part::Writing, || layout.write_shard(&scratch.0, shard, &mut next))?;
        bytes += written.iter().map(|f| f.bytes).sum::<u64>();
        files += written.len() as u64;
    }
    let files = match recipe.format {
        Format::Frames => files * recipe.frames() / u64::from(tried),
        Format::Zarr | Format::Hdf5 => files * recipe.frames().div_ceil(recipe.frames_per_shard),
    };
    let radars = radars.load(Ordering::Relaxed) as usize;
    let datasheet_bytes = datasheet::expected_bytes(recipe, radars, files);
    let bytes_a_frame = bytes / u64::from(tried);
    let usage = meter.usage(engine, 1, u64::from(tried));
    let stages = usage.stages.per(f64::from(tried));
    let core_seconds_a_frame = stages.total_s() - stages.scenes_s;
    let core_s = stages.scenes_s * f64::from(recipe.scenes) + core_seconds_a_frame * recipe.frames() as f64;
    let seconds = core_s / usage.processors as f64;
    Ok(Estimate {
        scenes: recipe.scenes,
        frames: recipe.frames(),
        shards: recipe.frames().div_ceil(recipe.frames_per_shard),
        frames_tried: tried,
        processors: usage.processors,
        core_seconds_a_frame,
        core_seconds_a_scene: stages.scenes_s,
        stages,
        classes: mean_costs(&costs),
        seconds_a_frame: seconds / recipe.frames() as f64,
        seconds,
        worker_bytes: peak.load(Ordering::Relaxed),
        array_bytes_a_frame: layout.array_bytes() as u64,
        bytes_a_frame,
        datasheet_bytes,
        bytes: bytes_a_frame * recipe.frames() + datasheet_bytes,
    })
}

/// Time of refining, placing and tracing frame 0 for all radars, s.
fn trace_seconds(engine: &Engine, site: &DrawnScene, scene: &Scene) -> Result<f64> {
    let start = Instant::now();
    let traced = Products::default().with(Product::Returns);
    let prepared = Prepared::new(&site.scenario, scene)?.making(traced).without_cut_power();
    frames_of(engine, site, &prepared, 0, Control::default())?;
    Ok(start.elapsed().as_secs_f64())
}

/// The cost of each class: what a frame costs less without its meshes.
fn class_costs(engine: &Engine, site: &DrawnScene) -> Result<Vec<ClassCost>> {
    let mut classes: BTreeMap<&str, (f64, f64)> = BTreeMap::new();
    for object in site.scene.objects.iter().filter(|o| o.radar) {
        if let Shape::Mesh(mesh) = object.shape {
            let of = classes.entry(&object.class).or_default();
            of.0 += 1.0;
            of.1 += site.scene.meshes[mesh].triangles.len() as f64;
        }
    }
    let mut classes: Vec<(&str, (f64, f64))> = classes.into_iter().collect();
    classes.sort_by(|a, b| b.1.1.total_cmp(&a.1.1));
    let all_s = trace_seconds(engine, site, &site.scene)?;
    classes
        .into_iter()
        .take(CLASSES)
        .map(|(class, (objects, triangles))| {
            let mut without = Scene::clone(&site.scene);
            for object in without.objects.iter_mut().filter(|o| o.class == class) {
                if matches!(object.shape, Shape::Mesh(_)) {
                    object.radar = false;
                }
            }
            let is_empty = !without.objects.iter().any(|o| o.radar);
            let without_s = if is_empty { 0.0 } else { trace_seconds(engine, site, &without)? };
            let core_s = (all_s - without_s).max(0.0);
            Ok(ClassCost { class: class.to_string(), objects, triangles, core_s })
        })
        .collect()
}

/// Means over scenes, the costliest first.
fn mean_costs(scenes: &[Vec<ClassCost>]) -> Vec<ClassCost> {
    let mut by_class: BTreeMap<&str, ClassCost> = BTreeMap::new();
    let share = 1.0 / scenes.len().max(1) as f64;
    for cost in scenes.iter().flatten() {
        let mean = by_class.entry(&cost.class).or_default();
        mean.class.clone_from(&cost.class);
        mean.objects += share * cost.objects;
        mean.triangles += share * cost.triangles;
        mean.core_s += share * cost.core_s;
    }
    let mut list: Vec<ClassCost> = by_class.into_values().collect();
    list.sort_by(|a, b| b.core_s.total_cmp(&a.core_s));
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One more at a time than there are processors would count the time that each waits for the others.
    #[test]
    fn no_more_run_than_there_are_processors() {
        let (now, most) = (AtomicU32::new(0), AtomicU32::new(0));
        let work = |k: u32| {
            most.fetch_max(now.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
            assert_eq!(rayon::current_num_threads(), 1);
            std::thread::sleep(std::time::Duration::from_millis(2));
            now.fetch_sub(1, Ordering::SeqCst);
            Ok(k * k)
        };
        assert_eq!(each_on_one_thread(20, work).unwrap(), (0..20).map(|k| k * k).collect::<Vec<_>>());
        assert!(most.load(Ordering::SeqCst) as usize <= rayon::current_num_threads());
        let failed = each_on_one_thread(4, |k| if k == 2 { Err(Error::Failed("two".into())) } else { Ok(k) });
        assert!(failed.unwrap_err().to_string().contains("two"));
    }
}
