//! How a run used its machine: seconds by stage, utilisation of processors and device, and what limited it.

use super::board::Waited;
use catseye::engine::Engine;
use catseye::simulate::Frame;
use serde::Serialize;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Share of a resource's time from which it is said to limit the run.
const LIMITING: f64 = 0.85;
/// Share of the workers' time that they may wait without its being what limits the run.
const WAITING: f64 = 0.1;

/// Seconds of the stages of a run, added up over its workers and writers.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct StageSeconds {
    /// Drawing, building and refining of scenes, s.
    pub scenes_s: f64,
    /// Placing and tracing of frames, s.
    pub trace_s: f64,
    /// Synthesis of samples, s; on a device with what follows up to the detected cells.
    pub synthesis_s: f64,
    /// Transforms and detection, s.
    pub processing_s: f64,
    /// Directions and labels, s.
    pub points_s: f64,
    /// Tables and arrays of the dataset's frames, s.
    pub records_s: f64,
    /// Writing and checksums, s.
    pub writing_s: f64,
    /// Description of the dataset with its pictures, s.
    pub datasheet_s: f64,
}

impl StageSeconds {
    /// Their sum, s.
    pub fn total_s(&self) -> f64 {
        self.list().iter().map(|(_, s)| s).sum()
    }

    /// The same divided by a number of frames.
    #[must_use]
    pub fn per(&self, frames: f64) -> StageSeconds {
        StageSeconds {
            scenes_s: self.scenes_s / frames,
            trace_s: self.trace_s / frames,
            synthesis_s: self.synthesis_s / frames,
            processing_s: self.processing_s / frames,
            points_s: self.points_s / frames,
            records_s: self.records_s / frames,
            writing_s: self.writing_s / frames,
            datasheet_s: self.datasheet_s / frames,
        }
    }

    /// Names and seconds.
    pub fn list(&self) -> [(&'static str, f64); 8] {
        [
            ("scenes", self.scenes_s),
            ("trace", self.trace_s),
            ("synthesis", self.synthesis_s),
            ("processing", self.processing_s),
            ("points", self.points_s),
            ("records", self.records_s),
            ("writing", self.writing_s),
            ("datasheet", self.datasheet_s),
        ]
    }
}

/// How a run used its machine.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Usage {
    /// Time of the run, s.
    pub wall_s: f64,
    /// Time of all processors, s; None where the system does not tell.
    pub core_s: Option<f64>,
    /// Number of processors that the run may use.
    pub processors: usize,
    /// Number of workers.
    pub workers: usize,
    /// Share of the processors' time in which they worked for this run, 0 to 1.
    pub processor_utilisation: Option<f64>,
    /// Share of the run in which the device had work, 0 to 1; None without a device.
    pub device_utilisation: Option<f64>,
    /// Seconds by stage.
    pub stages: StageSeconds,
    /// Time for which workers waited for scenes that others were preparing, s.
    pub waited_for_scenes_s: f64,
    /// Time for which workers waited for frames to be written, s.
    pub waited_for_writers_s: f64,
    /// Time for which workers waited for other runs in the same folder, each worker counted, s.
    pub waited_for_runs_s: f64,
    /// Number of frames that the run made.
    pub frames_made: u64,
    /// What limited the run.
    pub limited_by: &'static str,
}

/// Processor time of this process so far, s; None where the system does not tell.
pub fn cpu_seconds() -> Option<f64> {
    #[cfg(unix)]
    {
        use rustix::time::{ClockId, clock_gettime};
        let now = clock_gettime(ClockId::ProcessCPUTime);
        Some(now.tv_sec as f64 + 1e-9 * now.tv_nsec as f64)
    }
    #[cfg(not(unix))]
    None
}

/// A stage of which only the sum over threads is measured.
#[derive(Debug, Clone, Copy)]
pub(super) enum Part {
    Scenes,
    Trace,
    Synthesis,
    Processing,
    Points,
    Records,
    Writing,
    Datasheet,
}

const PARTS: usize = 8;

/// Measures a run from now on.
pub(super) struct Meter {
    start: Instant,
    core_s: Option<f64>,
    device_s: Option<f64>,
    parts_ns: [AtomicU64; PARTS],
    /// Time of this process in which it waited for other runs in the same folder, ns.
    for_runs_ns: AtomicU64,
    /// What the board adds its workers' waiting to.
    pub waited: Waited,
}

impl Meter {
    pub fn start(engine: &Engine) -> Meter {
        Meter {
            start: Instant::now(),
            core_s: cpu_seconds(),
            device_s: engine.device_busy_s(),
            parts_ns: Default::default(),
            for_runs_ns: AtomicU64::new(0),
            waited: Waited::default(),
        }
    }

    /// Adds seconds to a stage.
    pub fn add(&self, part: Part, seconds: f64) {
        self.parts_ns[part as usize].fetch_add((1e9 * seconds) as u64, Ordering::Relaxed);
    }

    /// Does something and adds its time to a stage.
    pub fn timed<T>(&self, part: Part, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let made = work();
        self.add(part, start.elapsed().as_secs_f64());
        made
    }

    /// Sleeps so long, because the whole run waits for other runs in the same folder, and adds the time.
    pub fn wait_for_runs(&self, interval: Duration) {
        let start = Instant::now();
        std::thread::sleep(interval);
        self.for_runs_ns.fetch_add(start.elapsed().as_nanos() as u64, Ordering::Relaxed);
    }

    /// Adds the stages of a frame.
    pub fn add_frame(&self, frame: &Frame) {
        let s = &frame.stages;
        self.add(Part::Trace, s.geometry_s + s.trace_s);
        self.add(Part::Synthesis, s.synthesis_s);
        self.add(Part::Processing, s.processing_s);
        self.add(Part::Points, s.angles_s);
    }

    /// What was measured so far, of a run with so many workers that made so many frames.
    pub fn usage(&self, engine: &Engine, workers: usize, frames_made: u64) -> Usage {
        let of = |part: Part| 1e-9 * self.parts_ns[part as usize].load(Ordering::Relaxed) as f64;
        let waited = |ns: &AtomicU64| 1e-9 * ns.load(Ordering::Relaxed) as f64;
        let wall_s = self.start.elapsed().as_secs_f64();
        let processors = rayon::current_num_threads();
        let core_s = cpu_seconds().zip(self.core_s).map(|(now, then)| now - then);
        let device = engine.device_busy_s().zip(self.device_s).map(|(now, then)| (now - then) / wall_s);
        let mut usage = Usage {
            wall_s,
            core_s,
            processors,
            workers,
            processor_utilisation: core_s.map(|s| s / (wall_s * processors as f64)),
            device_utilisation: device,
            stages: StageSeconds {
                scenes_s: of(Part::Scenes),
                trace_s: of(Part::Trace),
                synthesis_s: of(Part::Synthesis),
                processing_s: of(Part::Processing),
                points_s: of(Part::Points),
                records_s: of(Part::Records),
                writing_s: of(Part::Writing),
                datasheet_s: of(Part::Datasheet),
            },
            waited_for_scenes_s: waited(&self.waited.for_scenes_ns),
            waited_for_writers_s: waited(&self.waited.for_writers_ns),
            waited_for_runs_s: waited(&self.for_runs_ns) * workers as f64,
            frames_made,
            limited_by: "",
        };
        usage.limited_by = usage.limit();
        usage
    }
}

impl Usage {
    fn limit(&self) -> &'static str {
        let workers_s = self.wall_s * self.workers.max(1) as f64;
        let reaches = |share: Option<f64>| share.is_some_and(|share| share >= LIMITING);
        let waited_long = |seconds: f64| seconds > WAITING * workers_s;
        match () {
            // What is left of such a run, such as reading shards, may keep the processors busy, but limits no frame.
            () if self.frames_made == 0 && !waited_long(self.waited_for_runs_s) => {
                "nothing: no frame was left to make"
            }
            () if reaches(self.device_utilisation) => "the device",
            () if reaches(self.processor_utilisation) => "the processors",
            () if waited_long(self.waited_for_runs_s) => "other runs, which made shards of the same folder",
            () if waited_long(self.waited_for_writers_s) => "writing",
            () if waited_long(self.waited_for_scenes_s) => "too few scenes for so many workers",
            () if self.device_utilisation.is_some() => {
                "neither device nor processors: use more workers (--jobs)"
            }
            () => "other work of this machine, or the disk",
        }
    }

    /// One line for people.
    pub fn line(&self) -> String {
        let percent = |share: f64| format!("{:.0} %", 100.0 * share);
        let busy = self.processor_utilisation.map_or_else(String::new, |u| {
            format!(", {} of {} processors' time", percent(u), self.processors)
        });
        let device =
            self.device_utilisation.map_or_else(String::new, |u| format!(", the device {}", percent(u)));
        let waited_s = self.waited_for_scenes_s + self.waited_for_writers_s;
        let seconds: Vec<String> = self
            .stages
            .list()
            .into_iter()
            .chain([("waiting", waited_s), ("waiting for other runs", self.waited_for_runs_s)])
            .filter(|(_, seconds)| *seconds >= 0.005)
            .map(|(name, seconds)| format!("{name} {seconds:.2}"))
            .collect();
        format!(
            "{:.1} s{busy}{device}; limited by {}; seconds of all workers: {}",
            self.wall_s,
            self.limited_by,
            seconds.join(", ")
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_limits_a_run() {
        let run = Usage { wall_s: 10.0, workers: 4, frames_made: 1, ..Usage::default() };
        let limit = |usage: Usage| usage.limit();
        assert_eq!(limit(Usage { processor_utilisation: Some(0.9), ..run.clone() }), "the processors");
        assert_eq!(limit(Usage { device_utilisation: Some(0.9), ..run.clone() }), "the device");
        assert_eq!(limit(Usage { waited_for_writers_s: 8.0, ..run.clone() }), "writing");
        assert!(limit(Usage { waited_for_scenes_s: 8.0, ..run.clone() }).starts_with("too few scenes"));
        assert!(limit(Usage { device_utilisation: Some(0.2), ..run.clone() }).contains("--jobs"));
        assert!(limit(run).starts_with("other work"));
    }

    #[test]
    fn other_runs_and_a_complete_folder_limit_a_run() {
        let run = Usage { wall_s: 10.0, workers: 4, frames_made: 1, ..Usage::default() };
        let limit = |usage: Usage| usage.limit();
        // Four workers waited for 8 of 10 s, and that comes before what they waited for inside this run.
        let waited = Usage { waited_for_runs_s: 32.0, waited_for_writers_s: 8.0, ..run.clone() };
        assert!(limit(waited.clone()).starts_with("other runs"));
        let line = Usage { limited_by: waited.limit(), ..waited.clone() }.line();
        assert!(
            line.contains("limited by other runs") && line.contains("waiting for other runs 32.00"),
            "{line}"
        );
        // The device idles then, and more workers would not help.
        assert!(limit(Usage { device_utilisation: Some(0.1), ..waited.clone() }).starts_with("other runs"));
        assert_eq!(limit(Usage { waited_for_runs_s: 3.0, ..waited.clone() }), "writing");
        // All frames were made by others while this run waited.
        assert!(limit(Usage { frames_made: 0, ..waited }).starts_with("other runs"));
        // The folder was complete: the processors read it, and no frame was left.
        let complete = Usage { frames_made: 0, processor_utilisation: Some(0.95), ..run };
        assert!(limit(complete).starts_with("nothing: no frame"));
    }

    #[test]
    fn waiting_for_other_runs_counts_each_worker() {
        let engine = Engine::Cpu(catseye::engine::Precision::F32);
        let meter = Meter::start(&engine);
        meter.wait_for_runs(Duration::from_millis(20));
        let usage = meter.usage(&engine, 3, 0);
        assert!(usage.waited_for_runs_s >= 0.06 && usage.waited_for_runs_s <= 3.0 * usage.wall_s);
        assert!(usage.limited_by.starts_with("other runs"), "{}", usage.limited_by);
    }
}
