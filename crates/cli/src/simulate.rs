//! `catseye simulate`: a scenario to frames.

use super::bar::Kept;
use super::frames::draw_frame;
use super::global::{Global, print, print_json};
use catseye::base::convention::MAX_BOUNCES;
use catseye::base::error::{BadInput, Error, Result};
use catseye::base::machine;
use catseye::base::units::{db_from_power, power_from_db};
use catseye::engine::Purpose;
use catseye::formats::stage::distinct;
use catseye::road::site::Site;
use catseye::scene::scenario::Scenario;
use catseye::simulate::Prepared;
use catseye_io::files::expected_bytes;
use catseye_io::kept_run::KeptRun;
use catseye_io::manifest::{FrameRecord, RunTrace};
use catseye_io::run::{RunOptions, RunReport, run};
use clap::Args;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Simulate the frames of a scenario: ADC samples, range-Doppler maps, points, truth, plots
#[derive(Debug, Args)]
pub struct Simulate {
    /// Scenario file (TOML; `catseye init scenario` writes one)
    pub scenario: PathBuf,
    /// Folder to write; the same command continues an interrupted run
    #[arg(short, long, value_name = "DIR", required_unless_present = "dry_run")]
    pub output: Option<PathBuf>,
    /// Number of frames (default: as in the scenario)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub frames: Option<u32>,
    /// Maximum number of frames that a GPU computes at once, as far as memory allows (default: 64); the results do not depend on
    /// it, and the CPU computes one
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub batch: Option<u32>,
    /// Replay the cached echoes of this run instead of tracing: it was made with output.echoes = true at the
    /// same position. Radar, waveform, array, front end and seed are those of this scenario
    #[arg(long, value_name = "RUN", conflicts_with_all = ["dry_run", "convergence"])]
    pub from: Option<PathBuf>,
    /// Print the number of echoes and the memory and disk space of a frame, and write nothing
    #[arg(long)]
    pub dry_run: bool,
    /// Convergence test: report the change of each object's peak when the coherent sums are 16 times more
    /// accurate (takes three times as long)
    #[arg(long)]
    pub convergence: bool,
}

/// The scenario with what the command line changes.
pub fn load(path: &Path, frames: Option<u32>, seed: Option<u64>) -> Result<Scenario> {
    let mut scenario = Scenario::load(path)?;
    if let Some(n) = frames {
        scenario.frames.count = n;
    }
    if let Some(seed) = seed {
        scenario.seed = seed;
    }
    Ok(scenario)
}

impl Simulate {
    pub fn run(&self, global: &Global) -> Result<()> {
        let scenario = load(&self.scenario, self.frames, global.seed)?;
        if self.dry_run {
            return dry_run(&scenario, global).map_err(|e| of_scenario(e, &self.scenario));
        }
        let output = self
            .output
            .clone()
            .ok_or_else(|| BadInput::new("no output folder is given").key("-o").remedy("write -o DIR"))?;
        let source = catseye::scene::toml_file::read_text(&self.scenario)?;
        if let Some(from) = &self.from {
            distinct(&[&output], &[from])?;
        }
        let from = self.from.as_deref().map(KeptRun::open).transpose()?;
        let work = Work { convergence: self.convergence, batch: self.batch.map(|n| n as usize), from };
        let report = simulate(&scenario, Some(source), &output, &work, global)
            .map_err(|e| of_scenario(e, &self.scenario))?;
        summary(&report, global)
    }
}

/// Names the scenario's file in a complaint about its vehicle, which is made when the scene is built.
fn of_scenario(e: Error, file: &Path) -> Error {
    match &e {
        Error::Input(b) if b.key.as_ref().is_some_and(|k| k.starts_with("ego.")) => e.in_file(file),
        _ => e,
    }
}

/// How a scenario is run.
#[derive(Debug, Default)]
pub struct Work {
    /// Whether convergence is measured.
    pub convergence: bool,
    /// Largest number of frames that are made together.
    pub batch: Option<usize>,
    /// Run whose echoes are taken; None traces.
    pub from: Option<KeptRun>,
}

/// Runs a scenario with a progress bar.
pub fn simulate(
    scenario: &Scenario,
    source: Option<String>,
    output: &Path,
    work: &Work,
    global: &Global,
) -> Result<RunReport> {
    let (engine, rule) = global.engine_for(Purpose::Frames)?;
    let bar = global.bar("frames", scenario.frames.count as u64, Kept::All);
    let report = run(
        &engine,
        scenario,
        output,
        &RunOptions {
            kind: "run",
            force: global.force,
            convergence: work.convergence,
            batch: work.batch,
            from: work.from.as_ref(),
            rule,
            source,
            pictures: &draw_frame,
            progress: &|done, found| {
                bar.found(found.into());
                bar.set_position(done.into());
            },
            add: None,
        },
    )?;
    drop(bar);
    tell(&report.remarks, global);
    if report.resumed > 0 {
        global.say(&format!("{} frames were complete from an earlier run", report.resumed));
    }
    if report.repaired > 0 {
        global.say(&format!(
            "{} frames of an earlier run had changed since and were made again",
            report.repaired
        ));
    }
    for f in &report.frames {
        if f.front_end.dropped > 0 {
            global.say(&format!(
                "frame {}: {} echoes or faces are outside the receiver's band and were left out",
                f.index, f.front_end.dropped
            ));
        }
        if f.front_end.broken > 0 {
            global.say(&format!(
                "warning: frame {}: {} echoes are not finite numbers and were left out; please report this \
                    with the scene",
                f.index, f.front_end.broken
            ));
        }
    }
    for (why, n) in RunTrace::of(engine.tracing(), &report.frames).fallbacks {
        global.say(&format!(
            "warning: the host traced {n} of {} frames in f64, because the device met {why}; --trace host \
                traces all frames on the host",
            report.frames.len()
        ));
    }
    let bearable = power_from_db(scenario.trace.accuracy_db) - 1.0;
    let cut = |f: &FrameRecord| f.front_end.cut_power_w > bearable * f.front_end.power_w;
    if let (Some(first), many) =
        (report.frames.iter().find(|f| cut(f)), report.frames.iter().filter(|f| cut(f)).count())
        && first.front_end.bounces < MAX_BOUNCES as u64
        && first.front_end.power_w > 0.0
    {
        global.say(&format!(
            "warning: {many} frames, the first {}, are traced up to {} bounces, and one more would add about \
             {:.0} dB of the frame's power; trace more with trace.bounces, up to {MAX_BOUNCES}",
            first.index,
            first.front_end.bounces,
            db_from_power(first.front_end.cut_power_w / first.front_end.power_w)
        ));
    }
    Ok(report)
}

/// What the scene's meshes have that may show in its frames.
pub fn tell(remarks: &[String], global: &Global) {
    remarks.iter().for_each(|r| global.say(&format!("warning: {r}")));
}

/// What was written.
pub fn summary(report: &RunReport, global: &Global) -> Result<()> {
    if global.json {
        return print_json(report);
    }
    const SHOWN: usize = 20;
    for f in report.frames.iter().take(SHOWN) {
        print(&format!(
            "frame {}: {} triangles, {} echoes, {}{:.2} s (trace {:.2}, synthesis {:.2}, processing {:.2})",
            f.index,
            f.triangles,
            f.returns,
            f.points.map_or_else(String::new, |n| format!("{n} points, ")),
            f.seconds.total_s(),
            f.seconds.trace_s,
            f.seconds.synthesis_s,
            f.seconds.processing_s
        ))?;
        let seen = &f.front_end;
        if seen.bounces > 0 && seen.cut_power_w > 0.0 && seen.power_w > 0.0 {
            print(&format!(
                "    {} bounces were followed; one more would bring about {:.0} dB of the power",
                seen.bounces,
                db_from_power(seen.cut_power_w / seen.power_w)
            ))?;
        }
        if let Some(worst) =
            f.convergence.iter().max_by(|a, b| a.change_db.abs().total_cmp(&b.change_db.abs()))
        {
            print(&format!(
                "    16 times finer, and with the {} weak echoes that were left out, the peak of object {} ({}) moves most, by {:.2} dB; \
                 manifest.json lists all {}",
                f.front_end.left_out,
                worst.object_id,
                worst.class,
                worst.change_db,
                f.convergence.len()
            ))?;
        }
    }
    if report.frames.len() > SHOWN {
        print(&format!("... {} frames in all", report.frames.len()))?;
    }
    print(&format!("wrote {}", report.folder.display()))
}

#[derive(Default, serde::Serialize)]
struct DryRun {
    frames: u32,
    triangles: usize,
    echoes: usize,
    cube_bytes: u64,
    /// Size of the spectrum of the radar whose spectrum is largest, with both transforms' lengths, bytes.
    spectrum_bytes: u64,
    map_bytes: u64,
    /// The most that a frame holds at once; radars take turns.
    peak_bytes: u64,
    /// What the machine has, where that is known.
    available_bytes: Option<u64>,
    /// With arrays, tables and pictures.
    disk_bytes_per_frame: u64,
    /// Points, echoes and truth.
    table_bytes_per_frame: u64,
    picture_bytes_per_frame: u64,
    disk_bytes: u64,
    echo_bytes: u64,
    /// Tracing time of frame 0 for all radars on this machine, s.
    trace_s_per_frame: f64,
    /// What the scene's meshes have that may show in the frames.
    remarks: Vec<String>,
}

fn dry_run(scenario: &Scenario, global: &Global) -> Result<()> {
    let site = Site::new(scenario)?;
    let (scenario, scene) = (&site.scenario, &site.scene);
    let (engine, prepared) = (global.engine_for(Purpose::Frames)?.0, Prepared::new(scenario, scene)?);
    let available_bytes = machine::available_bytes();
    let remarks = prepared.remarks()?;
    tell(&remarks, global);
    let mut d = DryRun { frames: scenario.frames.count, available_bytes, remarks, ..Default::default() };
    scenario.radars.iter().try_for_each(|r| engine.check_memory(r, 0))?;
    for (which, radar) in scenario.radars.iter().enumerate() {
        let start = Instant::now();
        let received = prepared.echoes(&engine, which, 0)?;
        d.trace_s_per_frame += start.elapsed().as_secs_f64();
        let echoes = received.echoes.list.len();
        let needs = engine.memory(radar, echoes);
        needs.check(radar)?;
        d.triangles = received.triangles;
        d.echoes += echoes;
        d.cube_bytes += needs.cube_bytes as u64;
        d.spectrum_bytes = d.spectrum_bytes.max(needs.spectrum_bytes as u64);
        d.map_bytes += needs.map_bytes as u64;
        d.peak_bytes = d.peak_bytes.max(needs.peak_bytes as u64);
        d.echo_bytes += needs.echo_bytes as u64;
        let expected = expected_bytes(scenario, scene, which, received, site.road.as_ref())?;
        d.table_bytes_per_frame += expected.tables;
        d.picture_bytes_per_frame += expected.pictures;
        d.disk_bytes_per_frame += expected.arrays + expected.tables + expected.pictures;
    }
    d.disk_bytes = d.disk_bytes_per_frame * u64::from(scenario.frames.count);
    if global.json {
        return print_json(&d);
    }
    let mib = |b: u64| b as f64 / (1 << 20) as f64;
    let frames = if d.frames == 1 { "frame" } else { "frames" };
    print(&format!("{} {frames}, {} triangles, {} echoes a frame", d.frames, d.triangles, d.echoes))?;
    print(&format!(
        "tracing {:.2} s for frame 0, {:.0} s in all if every frame is like it; synthesis, processing and writing come on top",
        d.trace_s_per_frame,
        d.trace_s_per_frame * f64::from(d.frames)
    ))?;
    print(&format!(
        "cube {:.1} MiB, spectrum {:.1} MiB, maps {:.1} MiB, echoes {:.1} MiB",
        mib(d.cube_bytes),
        mib(d.spectrum_bytes),
        mib(d.map_bytes),
        mib(d.echo_bytes)
    ))?;
    let there = d.available_bytes.map_or(String::new(), |b| format!(" of {:.1} MiB that are free", mib(b)));
    print(&format!("memory {:.1} MiB at most at one time{there}", mib(d.peak_bytes)))?;
    print(&format!(
        "disk about {:.1} MiB a frame, of it tables {:.1} MiB and pictures {:.1} MiB; {:.1} MiB in all",
        mib(d.disk_bytes_per_frame),
        mib(d.table_bytes_per_frame),
        mib(d.picture_bytes_per_frame),
        mib(d.disk_bytes)
    ))
}
