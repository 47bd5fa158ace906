//! `catseye dataset`: frames of scenes that are drawn from a recipe.

use super::bar::{self, Kept};
use super::frames::draw_frame;
use super::global::{Global, print, print_json};
use catseye::base::error::{BadInput, Error, Result};
use catseye::engine::Purpose;
use catseye::formats::stage;
use catseye_io::estimate::{Estimate, estimate};
use catseye_io::kept_dataset::KeptDataset;
use catseye_io::produce::{Options, Phase, Progress, Report, produce};
use catseye_io::recipe::Recipe;
use clap::Args;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// Make a dataset: scenes randomly drawn from a recipe, and their frames with labels, in shards
#[derive(Debug, Args)]
pub struct Dataset {
    /// Recipe file (TOML; `catseye init recipe` writes one)
    pub recipe: PathBuf,
    /// Folder to write; the same command continues an interrupted run
    #[arg(short, long, value_name = "DIR", required_unless_present = "dry_run")]
    pub output: Option<PathBuf>,
    /// Write one drawn scene as files for `catseye simulate`, and make no frames
    #[arg(long, value_name = "N", conflicts_with_all = ["shards", "jobs", "batch"])]
    pub scene: Option<u32>,
    /// Make one frame of up to eight scenes, report the estimated time and disk space of the dataset, and keep nothing
    #[arg(long, conflicts_with_all = ["scene", "shards", "jobs", "batch"])]
    pub dry_run: bool,
    /// Shards to make, first:end without `end`; other runs make the others
    #[arg(long, value_name = "A:B")]
    pub shards: Option<String>,
    /// Number of workers, which share the cores (default: one per core; on a GPU one)
    #[arg(long, value_name = "N")]
    pub jobs: Option<usize>,
    /// Maximum number of frames that a GPU computes at once, as far as memory allows (default: 64); the results do not depend on
    /// it, and the CPU computes one
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub batch: Option<u32>,
    /// Replay the cached echoes of this dataset instead of tracing: its recipe drew the same scenes with
    /// keep.echoes = true. Radar, waveform, array and front end are those of this recipe
    #[arg(long, value_name = "DATA", conflicts_with_all = ["scene", "dry_run"])]
    pub from: Option<PathBuf>,
    /// Continue a dataset that was begun on another device
    #[arg(long)]
    pub mixed_devices: bool,
}

impl Dataset {
    pub fn run(&self, global: &Global) -> Result<()> {
        let recipe = Recipe::load(&self.recipe, global.seed)?;
        if self.dry_run {
            let (engine, _) = global.engine_for(Purpose::Frames)?;
            let bar = global.bar("steps of the estimate", 0, Kept::Itself);
            let made = estimate(&engine, &recipe, &|done, all| {
                bar.set_length(all);
                bar.set_position(done);
            })?;
            drop(bar);
            return foretell(&made, global);
        }
        let output = self
            .output
            .as_deref()
            .ok_or_else(|| BadInput::new("no output folder is given").key("-o").remedy("write -o DIR"))?;
        if let Some(scene) = self.scene {
            return write_scene(&recipe, scene, output, global);
        }
        if self.jobs == Some(0) {
            return Err(BadInput::new("at least one worker is needed")
                .key("--jobs")
                .value(0)
                .allowed("1 or more")
                .into());
        }
        let recipe = match &self.from {
            Some(from) => {
                stage::distinct(&[output], &[from])?;
                KeptDataset::open(from)?.serving(recipe)?
            }
            None => recipe,
        };
        let shards = self.shards.as_deref().map(shard_range).transpose()?;
        let (engine, rule) = global.engine_for(Purpose::Frames)?;
        let bar = global.bar("scenes checked", 0, Kept::Itself);
        let frames = AtomicBool::new(false);
        let progress = |p: Progress| {
            if p.phase == Phase::Frames && !frames.swap(true, Ordering::Relaxed) {
                bar.reset();
                bar.set_message("frames");
            }
            bar.set_length(p.all);
            // Frames of several threads: the latest word is not always the highest.
            if p.done > bar.position() || bar.position() > p.all {
                bar.set_position(p.done);
            }
        };
        let report = produce(
            &engine,
            &recipe,
            output,
            &Options {
                jobs: self.jobs,
                batch: self.batch.map(|n| n as usize),
                shards,
                mixed_devices: self.mixed_devices,
                force: global.force,
                cancel: bar::cancel(),
                progress: &progress,
                pictures: &draw_frame,
                rule,
                say: &|line| bar.suspend(|| global.say(line)),
            },
        )?;
        drop(bar);
        report.remarks.iter().for_each(|r| global.say(&format!("warning: first scene: {r}")));
        for (why, n) in &report.tally.trace_fallbacks {
            global.say(&format!(
                "warning: the host traced {n} frames in f64, because the device met {why}; --trace host \
                    traces all frames on the host"
            ));
        }
        if report.cancelled && !report.complete {
            let complete = match report.tally.frames {
                0 if report.shards_complete == 0 => "no frame is complete".to_string(),
                n => format!("{n} of {} frames are complete", report.frames),
            };
            return Err(Error::Interrupted(format!("{complete}; the same command continues")));
        }
        summary(&report, global)
    }
}

fn shard_range(text: &str) -> Result<Range<u64>> {
    let bad = || -> Error {
        BadInput::new("is not a range of shards")
            .key("--shards")
            .value(format!("'{text}'"))
            .allowed("first:end, where end is not included, as in 0:16")
            .into()
    };
    let (a, b) = text.split_once(':').ok_or_else(bad)?;
    let number = |t: &str| t.parse::<u64>().map_err(|_| bad());
    Ok(number(a)?..number(b)?)
}

fn write_scene(recipe: &Recipe, scene: u32, out: &Path, global: &Global) -> Result<()> {
    let drawn = recipe.draw(scene)?;
    let mut written = Vec::new();
    for (name, text) in drawn.files() {
        written.push(stage::write_file(out.join(name), global.force, text.as_bytes())?);
    }
    for (name, path) in recipe.files()? {
        let bytes = catseye::formats::input::read(&path, "a file of the recipe", u64::MAX - 1)?;
        written.push(stage::write_file(out.join(name), global.force, &bytes)?);
    }
    match global.json {
        true => print_json(&serde_json::json!({ "files": written }))?,
        false => written.iter().try_for_each(|f| print(&format!("wrote {}", f.display())))?,
    }
    if drawn.redrawn + drawn.dropped > 0 {
        global.say(&format!(
            "vehicles that overlapped others: {} draws were repeated, {} vehicles were left out",
            drawn.redrawn, drawn.dropped
        ));
    }
    Ok(())
}

fn foretell(e: &Estimate, global: &Global) -> Result<()> {
    let mib = |b: u64| b as f64 / (1 << 20) as f64;
    global.answer(e, || {
        let stages: Vec<String> = e
            .stages
            .list()
            .into_iter()
            .filter(|(name, s)| *name != "scenes" && *s >= 5e-5)
            .map(|(name, s)| format!("{name} {s:.4}"))
            .collect();
        let mut lines = vec![
            format!("{} frames of {} scenes in {} shards", e.frames, e.scenes, e.shards),
            format!(
                "{:.2} MiB a frame with its tables ({:.2} MiB of arrays before compression), {:.1} MiB in all with the datasheet's pictures",
                mib(e.bytes_a_frame),
                mib(e.array_bytes_a_frame),
                mib(e.bytes),
            ),
            format!(
                "{:.4} core-seconds a frame ({}) and {:.3} a scene, from {} frames",
                e.core_seconds_a_frame,
                stages.join(", "),
                e.core_seconds_a_scene,
                e.frames_tried
            ),
        ];
        for c in e.classes.iter().filter(|c| c.core_s >= 5e-5) {
            lines.push(format!(
                "    {}: {:.4} core-seconds a frame to refine and trace, {:.1} objects of {:.0} triangles in all",
                if c.class.is_empty() { "(no class)" } else { &c.class },
                c.core_s,
                c.objects,
                c.triangles
            ));
        }
        lines.push(format!("about {:.0} MiB of memory for the arrays of a worker", mib(e.worker_bytes)));
        lines.push(format!(
            "{:.4} s a frame on the {} processors of this machine, {:.0} s in all",
            e.seconds_a_frame, e.processors, e.seconds
        ));
        lines.join("\n")
    })
}

fn summary(report: &Report, global: &Global) -> Result<()> {
    if global.json {
        return print_json(report);
    }
    if report.shards_resumed > 0 {
        global.say(&format!("{} shards were complete from an earlier run", report.shards_resumed));
    }
    if report.shards_kept > 0 {
        global.say(&format!(
            "{} shards of the earlier recipe are the same in this one and were kept",
            report.shards_kept
        ));
    }
    if report.shards_of_others > 0 {
        global
            .say(&format!("{} shards were made by another run in the same folder", report.shards_of_others));
    }
    if report.shards_repaired > 0 {
        global.say(&format!("{} shards had lost files and were made again", report.shards_repaired));
    }
    let t = &report.tally;
    if t.redrawn + t.dropped > 0 {
        global.say(&format!(
            "vehicles that overlapped others: {} draws were repeated, {} vehicles were left out",
            t.redrawn, t.dropped
        ));
    }
    print(&format!(
        "made {} frames; {} of {} shards are complete, {:.0} bytes a frame",
        report.frames_made,
        report.shards_complete,
        report.shards,
        report.bytes as f64 / t.frames.max(1) as f64
    ))?;
    if report.frames_made > 0 || report.usage.waited_for_runs_s > 0.0 {
        global.say(&report.usage.line());
    }
    match report.complete {
        true => print(&format!("wrote {}", report.folder.display())),
        false => print("the run that makes the last shard completes the dataset"),
    }
}
