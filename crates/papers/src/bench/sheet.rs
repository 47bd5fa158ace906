//! What a workload is run with and what it notes.

use catseye::engine::{Engine, EngineReport};
use catseye::error::Result;
use serde::Serialize;
use serde_json::{Map, Value};
use std::time::Instant;

/// Name and content of each workload.
pub const WORKLOADS: [(&str, &str); 8] = [
    ("W1", "trihedral 0.1 m, 77 GHz, azimuth -45..0 deg in 0.1 deg at elevation 35.2644 deg"),
    ("W2", "type 1 reflector 160 x 4 mm, elevation 0..5 deg in 0.1 deg x azimuth -40..40 deg in 0.5 deg"),
    ("W3-static", "one frame of the road with rails, posts, markers and cars, all at rest"),
    ("W3-moving", "the same with the ego at 10 m/s and cars at 10, 5 and 15 m/s"),
    ("W4", "cube of 12 x 512 x 1024: FFT, power, OS-CFAR, 64 beams for 2,000 cells"),
    ("W4s", "cube of 16 x 2048 x 2048 by blocks of channels: FFT, power, OS-CFAR, snapshots"),
    ("W5", "100 frames of W3-moving in a row, the ego 0.1 m farther in each, samples and points written"),
    ("W6", "closest hits on a terrain of a million triangles, 1080p coherent and as many random rays"),
];

/// What a run may vary.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// Fewer directions and rays.
    pub quick: bool,
    /// Seed of all draws.
    pub seed: u64,
}

/// Seconds of one stage: of the only run when that takes longer than [`LONG_S`], otherwise the median of
/// [`RUNS`] after one that warms up.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Stage {
    /// Name of the stage.
    pub name: &'static str,
    /// Median of the runs, s.
    pub seconds: f64,
    /// Number of runs.
    pub runs: usize,
}

/// A run that takes longer is not repeated.
pub const LONG_S: f64 = 2.0;

/// Runs of shorter ones.
pub const RUNS: usize = 3;

/// What one workload took and how good its result is.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outcome {
    /// Name of the workload.
    pub workload: &'static str,
    /// What it is.
    pub title: &'static str,
    /// The engine that ran it.
    pub device: EngineReport,
    /// Seconds of its stages.
    pub stages: Vec<Stage>,
    /// Of the stages that make up the workload.
    pub total_seconds: f64,
    /// `total_seconds` times the threads; None on a hardware GPU.
    pub core_seconds: Option<f64>,
    /// Counts, by name.
    pub counts: Map<String, Value>,
    /// How good the result is, by name.
    pub accuracy: Map<String, Value>,
    /// Remarks, one a line.
    pub notes: Vec<String>,
}

/// One workload on its way.
pub(super) struct Sheet<'a> {
    pub(super) outcome: Outcome,
    threads: Option<usize>,
    pub(super) say: &'a dyn Fn(&str),
}

impl<'a> Sheet<'a> {
    pub(super) fn new(name: &'static str, engine: &Engine, say: &'a dyn Fn(&str)) -> Sheet<'a> {
        let title = WORKLOADS.iter().find(|w| w.0 == name).map_or("", |w| w.1);
        say(&format!("{name}: {title}"));
        let threads = match engine {
            Engine::Gpu(gpu) if gpu.report().is_hardware => None,
            _ => Some(rayon::current_num_threads()),
        };
        let outcome = Outcome {
            workload: name,
            title,
            device: engine.report(),
            stages: Vec::new(),
            total_seconds: 0.0,
            core_seconds: None,
            counts: Map::new(),
            accuracy: Map::new(),
            notes: Vec::new(),
        };
        Sheet { outcome, threads, say }
    }

    /// Times a stage of the workload.
    pub(super) fn stage<T>(&mut self, name: &'static str, f: impl FnMut() -> Result<T>) -> Result<T> {
        let (out, stage) = timed(name, f)?;
        self.outcome.total_seconds += stage.seconds;
        self.put(stage);
        Ok(out)
    }

    /// Times something that is part of another stage.
    pub(super) fn part<T>(&mut self, name: &'static str, f: impl FnMut() -> Result<T>) -> Result<T> {
        let (out, stage) = timed(name, f)?;
        self.put(stage);
        Ok(out)
    }

    pub(super) fn put(&mut self, stage: Stage) {
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

    pub(super) fn finish(mut self) -> Outcome {
        self.outcome.core_seconds = self.threads.map(|n| n as f64 * self.outcome.total_seconds);
        self.outcome
    }
}

fn timed<T>(name: &'static str, mut f: impl FnMut() -> Result<T>) -> Result<(T, Stage)> {
    let mut run = || {
        let start = Instant::now();
        let out = f()?;
        Ok::<_, catseye::Error>((out, start.elapsed().as_secs_f64()))
    };
    let (mut out, seconds) = run()?;
    if seconds > LONG_S {
        return Ok((out, Stage { name, seconds, runs: 1 }));
    }
    let mut all = Vec::with_capacity(RUNS);
    for _ in 0..RUNS {
        // The previous result goes first, so that two never lie in memory together.
        drop(out);
        let (o, seconds) = run()?;
        out = o;
        all.push(seconds);
    }
    Ok((out, Stage { name, seconds: median(&mut all), runs: RUNS }))
}

/// The middle of the values, the upper one of two; NaN for none.
pub(super) fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// sqrt(sum |got - want|² / sum |want|²).
pub(super) fn relative_l2(got: impl IntoIterator<Item = f64>, want: impl IntoIterator<Item = f64>) -> f64 {
    let (mut error, mut norm) = (0.0, 0.0);
    for (g, w) in got.into_iter().zip(want) {
        error += (g - w) * (g - w);
        norm += w * w;
    }
    if error == 0.0 { 0.0 } else { (error / norm).sqrt() }
}
