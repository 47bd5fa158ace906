//! Settings and results of a workload.

use catseye::base::error::Result;
use catseye::base::tasks::{self, WorkAndSpan};
use catseye::engine::{Engine, EngineReport};
use catseye::gpu::{GpuCounts, Profile};
use catseye_io::usage::cpu_seconds;
use serde::Serialize;
use serde_json::{Map, Value};
use std::time::Instant;

/// Name and content of each workload.
pub const WORKLOADS: [(&str, &str); 17] = [
    ("W1", "trihedral 0.1 m, 77 GHz, azimuth -45..0 deg in 0.1 deg at elevation 35.2644 deg"),
    ("W2", "type 1 reflector 160 x 4 mm, elevation 0..5 deg in 0.1 deg x azimuth -40..40 deg in 0.5 deg"),
    ("W3-static", "one frame of the road with rails, posts, markers and cars, all at rest"),
    ("W3-moving", "the same with the ego at 10 m/s and cars at 10, 5 and 15 m/s"),
    ("W4", "cube of 12 x 512 x 1024: FFT, power, OS-CFAR, 64 beams for 2,000 cells"),
    ("W4s", "cube of 16 x 2048 x 2048 by blocks of channels: FFT, power, OS-CFAR, snapshots"),
    ("W5", "100 frames of W3-moving in a row, the ego 0.1 m farther in each, samples and points written"),
    ("W6", "closest hits on a terrain of a million triangles, 1080p coherent and as many random rays"),
    ("W7", "one frame of a road that bends, with rails, walls, markers and cars, the ego at 20 m/s"),
    ("W8", "one frame of 180,000 triangles of hills beside a flat road, with W3's posts and moving cars"),
    ("W8-curve", "frames of W8 with its hills cut into 1e4, 3e4, 1e5, 3e5, 1e6 and 2e6 triangles"),
    ("W9", "one frame of a street with three curved cars at 10, 25 and 40 m, accuracy 0.2 dB"),
    ("W10", "a dataset of 1,024 small frames of the recipe small_road, written to disk"),
    ("W11", "a dataset of 40 frames in 10 scenes of the recipe that `catseye init recipe` writes"),
    ("W12", "the frame of W7 with 12 x 16 antennas: 192 virtual channels, 256 chirps, 512 samples"),
    ("W13", "one frame of the recipe awr1843_street: cars, cyclists and people for a small radar"),
    ("W14", "a dataset of 1,000 frames of 128 moving points, 12 x 128 x 256, that keeps the samples alone"),
];

/// Settings of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// Whether to use fewer directions, rays and frames.
    pub quick: bool,
    /// Seed of all draws.
    pub seed: u64,
}

/// Time of one stage: of the only run when that takes longer than [`LONG_S`], otherwise the median of
/// [`RUNS`] runs after a warm-up.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Stage {
    /// Name of the stage.
    pub name: &'static str,
    /// Median time of the runs, s.
    pub seconds: f64,
    /// CPU time of all threads of this process per run, s; None where the system does not report it.
    pub core_seconds: Option<f64>,
    /// Number of runs.
    pub runs: usize,
    /// Work and span of one more run on one thread; only of the stages of a frame on the cpu engine.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub tasks: Option<WorkAndSpan>,
    /// What the last run asked of the device, where there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub device: Option<GpuCounts>,
}

/// Duration above which a run is not repeated, s.
pub const LONG_S: f64 = 2.0;

/// Number of runs of a shorter stage.
pub const RUNS: usize = 3;

/// The time that one workload took and the accuracy of its result.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outcome {
    /// Name of the workload.
    pub workload: &'static str,
    /// Description of the workload.
    pub title: &'static str,
    /// The engine that ran it.
    pub device: EngineReport,
    /// Times of its stages.
    pub stages: Vec<Stage>,
    /// Total time of the stages that make up the workload, s.
    pub total_seconds: f64,
    /// CPU time of all threads of this process in those stages, s; None where the system does not report it.
    /// It does not include GPU time.
    pub core_seconds: Option<f64>,
    /// Work and span of those stages after each other, of a frame on the cpu engine.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub tasks: Option<WorkAndSpan>,
    /// Counts, by name.
    pub counts: Map<String, Value>,
    /// Measures of accuracy, by name.
    pub accuracy: Map<String, Value>,
    /// What each kernel did in the last run of each stage that counts for the total; None unless the engine profiles its
    /// kernels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kernels: Option<Profile>,
    /// Remarks, one a line.
    pub notes: Vec<String>,
}

/// Results of one workload while it runs.
pub(super) struct Sheet<'a> {
    pub(super) outcome: Outcome,
    pub(super) say: &'a dyn Fn(&str),
    engine: &'a Engine,
}

impl<'a> Sheet<'a> {
    pub(super) fn new(name: &'static str, engine: &'a Engine, say: &'a dyn Fn(&str)) -> Sheet<'a> {
        let title = WORKLOADS.iter().find(|w| w.0 == name).map_or("", |w| w.1);
        say(&format!("{name}: {title}"));
        let outcome = Outcome {
            workload: name,
            title,
            device: engine.report(),
            stages: Vec::new(),
            total_seconds: 0.0,
            core_seconds: Some(0.0),
            tasks: None,
            counts: Map::new(),
            accuracy: Map::new(),
            kernels: None,
            notes: Vec::new(),
        };
        Sheet { outcome, say, engine }
    }

    /// Times a stage of the workload.
    pub(super) fn stage<T>(&mut self, name: &'static str, f: impl FnMut() -> Result<T>) -> Result<T> {
        let mut f = f;
        let mut before = None;
        let (out, stage) = self.watched(name, || {
            before = self.profile();
            f()
        })?;
        self.add(stage);
        self.add_kernels(before);
        Ok(out)
    }

    /// Times a stage of a frame and, on the cpu engine, measures its work and span.
    pub(super) fn frame_stage<T: Send>(
        &mut self,
        name: &'static str,
        f: impl FnMut() -> Result<T> + Send,
    ) -> Result<T> {
        let mut f = f;
        let out = self.stage(name, &mut f)?;
        if let Engine::Cpu(_) = self.engine {
            // Two results are never in memory together.
            drop(out);
            let (out, cost) = tasks::measured(f)?;
            if let Some(stage) = self.outcome.stages.last_mut() {
                stage.tasks = Some(cost);
            }
            let before = self.outcome.tasks.unwrap_or_default();
            self.outcome.tasks = Some(before.then(&cost));
            return Ok(out);
        }
        Ok(out)
    }

    /// What the kernels did up to now, where they are profiled.
    pub(super) fn profile(&self) -> Option<Profile> {
        self.engine.profile()
    }

    /// Adds what the kernels did after `before` was taken.
    pub(super) fn add_kernels(&mut self, before: Option<Profile>) {
        let Some((now, before)) = self.profile().zip(before) else { return };
        let used = now.since(&before);
        match &mut self.outcome.kernels {
            None => self.outcome.kernels = Some(used),
            Some(kernels) => kernels.add(&used),
        }
    }

    /// Adds a stage of the workload that was timed elsewhere.
    pub(super) fn add(&mut self, stage: Stage) {
        let o = &mut self.outcome;
        o.total_seconds += stage.seconds;
        o.core_seconds = o.core_seconds.zip(stage.core_seconds).map(|(all, one)| all + one);
        self.put(stage);
    }

    /// Times something that is part of another stage.
    pub(super) fn part<T>(&mut self, name: &'static str, f: impl FnMut() -> Result<T>) -> Result<T> {
        let (out, stage) = self.watched(name, f)?;
        self.put(stage);
        Ok(out)
    }

    fn watched<T>(&self, name: &'static str, mut f: impl FnMut() -> Result<T>) -> Result<(T, Stage)> {
        let mut device = None;
        let (out, stage) = timed(name, || {
            let before = self.engine.device_counts();
            let out = f()?;
            device = self.engine.device_counts().zip(before).map(|(after, before)| after.since(&before));
            Ok(out)
        })?;
        Ok((out, Stage { device, ..stage }))
    }

    fn put(&mut self, stage: Stage) {
        (self.say)(&format!("  {}: {:.4} s", stage.name, stage.seconds));
        self.outcome.stages.push(stage);
    }

    pub(super) fn count(&mut self, name: &str, value: impl Into<Value>) {
        self.outcome.counts.insert(name.into(), value.into());
    }

    pub(super) fn accuracy(&mut self, name: &str, value: impl Into<Value>) {
        self.outcome.accuracy.insert(name.into(), value.into());
    }

    pub(super) fn note(&mut self, text: impl Into<String>) {
        self.outcome.notes.push(text.into());
    }

    pub(super) fn finish(self) -> Outcome {
        self.outcome
    }
}

fn timed<T>(name: &'static str, mut f: impl FnMut() -> Result<T>) -> Result<(T, Stage)> {
    let (mut out, first) = once(name, &mut f)?;
    if first.seconds > LONG_S {
        return Ok((out, first));
    }
    let (mut all, mut cores) = (Vec::with_capacity(RUNS), Vec::with_capacity(RUNS));
    for _ in 0..RUNS {
        // The previous result is dropped first, so that two never are in memory together.
        drop(out);
        let (o, stage) = once(name, &mut f)?;
        out = o;
        all.push(stage.seconds);
        cores.extend(stage.core_seconds);
    }
    let core_seconds = (cores.len() == RUNS).then(|| median(&mut cores));
    Ok((out, Stage { name, seconds: median(&mut all), core_seconds, runs: RUNS, tasks: None, device: None }))
}

/// Times one run.
pub(super) fn once<T>(name: &'static str, f: impl FnOnce() -> Result<T>) -> Result<(T, Stage)> {
    let (start, before) = (Instant::now(), cpu_seconds());
    let out = f()?;
    let core_seconds = cpu_seconds().zip(before).map(|(after, before)| after - before);
    Ok((
        out,
        Stage {
            name,
            seconds: start.elapsed().as_secs_f64(),
            core_seconds,
            runs: 1,
            tasks: None,
            device: None,
        },
    ))
}

/// Peak resident memory of the process, bytes; None where the system does not report it.
pub(super) fn peak_memory() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find(|l| l.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok().map(|k| k << 10)
}

/// Median of the values, the upper one of two; NaN for none.
pub(super) fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Relative L2 error sqrt(sum |got - want|² / sum |want|²).
pub fn relative_l2(got: impl IntoIterator<Item = f64>, want: impl IntoIterator<Item = f64>) -> f64 {
    let (mut error, mut norm) = (0.0, 0.0);
    for (g, w) in got.into_iter().zip(want) {
        error += (g - w) * (g - w);
        norm += w * w;
    }
    if error == 0.0 { 0.0 } else { (error / norm).sqrt() }
}
