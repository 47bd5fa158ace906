//! `catseye dataset`: frames of scenes that are drawn from a recipe.

use super::frames::draw_frame;
use super::{Global, print, print_json};
use crate::dataset::produce::{Options, Progress, Report, produce};
use crate::dataset::recipe::Recipe;
use crate::error::{BadInput, Error, Result};
use crate::formats::stage;
use clap::Args;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

/// Between two lines about the progress where there is no terminal.
const REPORT_EVERY: Duration = Duration::from_secs(30);

/// Make a dataset: scenes drawn from a recipe, their frames with labels in shards
#[derive(Debug, Args)]
pub struct Dataset {
    /// Recipe TOML (`catseye init recipe` writes one)
    pub recipe: PathBuf,
    /// Folder to write; an interrupted run goes on when the same command is given again
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Write one drawn scene as files for `catseye simulate` and make no frames
    #[arg(long, value_name = "N", conflicts_with_all = ["shards", "jobs"])]
    pub scene: Option<u32>,
    /// Shards to make, first:end without the end; others are left to other runs
    #[arg(long, value_name = "A:B")]
    pub shards: Option<String>,
    /// Workers, each with its share of the cores (default: one a core, on a GPU one)
    #[arg(long, value_name = "N")]
    pub jobs: Option<usize>,
    /// Go on with a dataset that another device began
    #[arg(long)]
    pub mixed_devices: bool,
}

impl Dataset {
    pub fn run(&self, global: &Global) -> Result<()> {
        let recipe = Recipe::load(&self.recipe, global.seed)?;
        if let Some(scene) = self.scene {
            return write_scene(&recipe, scene, &self.output, global);
        }
        if self.jobs == Some(0) {
            return Err(BadInput::new("nobody would work")
                .key("--jobs")
                .value(0)
                .allowed("1 or more")
                .into());
        }
        let shards = self.shards.as_deref().map(shard_range).transpose()?;
        let engine = global.engine()?;
        let bar = global.bar("frames", 0).with_style(
            indicatif::ProgressStyle::with_template(
                "{msg} {bar:30} {pos}/{len} {elapsed} ({per_sec}, left {eta})",
            )
            .unwrap_or_else(|_| indicatif::ProgressStyle::default_bar()),
        );
        let lines = Lines::new(bar.is_hidden());
        let progress = |p: Progress| {
            bar.set_length(p.all);
            bar.set_position(p.done);
            if let Some(line) = lines.line(p) {
                global.say(&line);
            }
        };
        let report = produce(
            &engine,
            &recipe,
            &self.output,
            &Options {
                jobs: self.jobs,
                shards,
                mixed_devices: self.mixed_devices,
                force: global.force,
                cancel: &AtomicBool::new(false),
                progress: &progress,
                pictures: &draw_frame,
            },
        )?;
        bar.finish_and_clear();
        summary(&report, global)
    }
}

fn shard_range(text: &str) -> Result<Range<u64>> {
    let bad = || -> Error {
        BadInput::new("is no range of shards")
            .key("--shards")
            .value(format!("'{text}'"))
            .allowed("first:end, as in 0:16, without the end")
            .into()
    };
    let (a, b) = text.split_once(':').ok_or_else(bad)?;
    let number = |t: &str| t.parse::<u64>().map_err(|_| bad());
    Ok(number(a)?..number(b)?)
}

fn write_scene(recipe: &Recipe, scene: u32, out: &Path, global: &Global) -> Result<()> {
    let drawn = recipe.draw(scene)?;
    for (name, text) in drawn.files()? {
        let written = stage::write_file(out.join(name), global.force, text.as_bytes())?;
        print(&format!("wrote {}", written.display()))?;
    }
    for (name, path) in recipe.files()? {
        let bytes = std::fs::read(&path).map_err(|e| Error::io(&path, e))?;
        let written = stage::write_file(out.join(name), global.force, &bytes)?;
        print(&format!("wrote {}", written.display()))?;
    }
    if drawn.redrawn + drawn.dropped > 0 {
        global.say(&format!(
            "vehicles that stood in others: {} draws were repeated, {} vehicles left out",
            drawn.redrawn, drawn.dropped
        ));
    }
    Ok(())
}

/// Progress where no bar can be drawn.
struct Lines {
    start: Instant,
    last: Mutex<Option<Instant>>,
}

impl Lines {
    fn new(wanted: bool) -> Lines {
        let start = Instant::now();
        Lines { start, last: Mutex::new(wanted.then_some(start)) }
    }

    /// A line when it is time for one.
    fn line(&self, p: Progress) -> Option<String> {
        let mut last = self.last.lock().unwrap_or_else(|e| e.into_inner());
        let now = Instant::now();
        if now.duration_since((*last)?) < REPORT_EVERY {
            return None;
        }
        *last = Some(now);
        let rate = p.done as f64 / self.start.elapsed().as_secs_f64();
        let left = (p.all - p.done) as f64 / rate;
        Some(format!("{} of {} frames, {rate:.1} frames/s, {left:.0} s left", p.done, p.all))
    }
}

fn summary(report: &Report, global: &Global) -> Result<()> {
    if global.json {
        return print_json(report);
    }
    if report.shards_resumed > 0 {
        global.say(&format!("{} shards were complete from an earlier run", report.shards_resumed));
    }
    if report.shards_repaired > 0 {
        global.say(&format!("{} shards had lost files and were made again", report.shards_repaired));
    }
    let t = &report.tally;
    if t.redrawn + t.dropped > 0 {
        global.say(&format!(
            "vehicles that stood in others: {} draws were repeated, {} vehicles left out",
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
    match report.complete {
        true => print(&format!("wrote {}", report.folder.display())),
        false => print("the dataset is ended by the run that makes its last shard"),
    }
}
