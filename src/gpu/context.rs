//! Adapters and the opened device.

use super::arena::{Arena, GpuCounts, lock};
use super::cache::DiskCache;
use super::kernel::{Kernel, Pipeline, build_pipeline};
use super::profile::{Profile, Profiler};
use super::validation;
use crate::base::error::{BadInput, Error, Result};
use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

/// One adapter as the driver describes it.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct AdapterReport {
    /// Name of the adapter.
    pub name: String,
    /// `DiscreteGpu`, `IntegratedGpu`, `VirtualGpu`, `Cpu` or `Other`.
    pub device_type: String,
    /// Interface to it, as Vulkan.
    pub backend: String,
    /// Driver and its version.
    pub driver: String,
    /// Version; two versions of one software driver often share a name.
    pub driver_info: String,
    /// Largest storage binding, bytes.
    pub max_storage_binding_bytes: u64,
    /// Largest buffer, bytes.
    pub max_buffer_bytes: u64,
    /// Threads of a workgroup.
    pub max_workgroup_size: u32,
    /// Memory of a workgroup, bytes.
    pub shared_bytes: u32,
    /// Whether shaders can calculate in f64.
    pub shader_f64: bool,
    /// Whether passes can be timed.
    pub timestamp: bool,
    /// A GPU and not a software driver.
    pub is_hardware: bool,
}

impl AdapterReport {
    fn new(adapter: &wgpu::Adapter) -> Self {
        let (info, limits, features) = (adapter.get_info(), adapter.limits(), adapter.features());
        use wgpu::DeviceType::{DiscreteGpu, IntegratedGpu, VirtualGpu};
        AdapterReport {
            is_hardware: matches!(info.device_type, DiscreteGpu | IntegratedGpu | VirtualGpu),
            name: info.name,
            device_type: format!("{:?}", info.device_type),
            backend: info.backend.to_string(),
            driver: info.driver,
            driver_info: info.driver_info,
            max_storage_binding_bytes: limits.max_storage_buffer_binding_size,
            max_buffer_bytes: limits.max_buffer_size,
            max_workgroup_size: limits.max_compute_invocations_per_workgroup,
            shared_bytes: limits.max_compute_workgroup_storage_size,
            shader_f64: features.contains(wgpu::Features::SHADER_F64),
            timestamp: features.contains(wgpu::Features::TIMESTAMP_QUERY),
        }
    }

    fn matches(&self, name: &str) -> bool {
        let name = name.to_lowercase();
        [&self.name, &self.driver, &self.driver_info].iter().any(|s| s.to_lowercase().contains(&name))
    }

    /// Order of choice among hardware: discrete, integrated, virtual.
    fn rank(&self) -> u8 {
        match self.device_type.as_str() {
            "DiscreteGpu" => 0,
            "IntegratedGpu" => 1,
            _ => 2,
        }
    }
}

/// Which adapter to open.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Want<'a> {
    /// The best GPU; software drivers are not considered.
    Hardware,
    /// The first whose name, driver or driver version contains this, in any case.
    Named(&'a str),
    /// The first that is described so, among several of one name too.
    Described(&'a AdapterReport),
}

/// Keeps Mesa's device-select layer, which only reorders adapters for desktops, from complaining on stderr
/// where there is no desktop session. To be called first in `main`, before any thread is started.
#[allow(unsafe_code, clippy::disallowed_methods)] // once, at the start of the program; tests never call it
pub fn quieten_loader() {
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // SAFETY: no other thread runs yet that could read the environment.
        unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    }
}

fn found_adapters() -> Vec<(wgpu::Adapter, AdapterReport)> {
    let instance = validation::instance();
    pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()))
        .into_iter()
        .map(|adapter| {
            let report = AdapterReport::new(&adapter);
            (adapter, report)
        })
        .collect()
}

/// All adapters, in the driver's order. No device is opened.
pub fn adapters() -> Vec<AdapterReport> {
    found_adapters().into_iter().map(|(_, report)| report).collect()
}

/// Index of the adapter that is wanted.
fn choose(reports: &[AdapterReport], want: Want<'_>) -> Result<usize> {
    let listed = match reports {
        [] => "no adapter was found".to_string(),
        _ => reports
            .iter()
            .map(|r| format!("{} ({} {})", r.name, r.driver, r.driver_info))
            .collect::<Vec<_>>()
            .join(", "),
    };
    match want {
        Want::Hardware => reports
            .iter()
            .enumerate()
            .filter(|(_, r)| r.is_hardware)
            .min_by_key(|(i, r)| (r.rank(), *i))
            .map(|(i, _)| i)
            .ok_or_else(|| {
                BadInput::new("there is no hardware GPU")
                    .key("device")
                    .value("gpu")
                    .allowed(listed)
                    .remedy("name one of these adapters, or use --device cpu")
                    .into()
            }),
        Want::Named(name) => {
            reports.iter().position(|r| !name.is_empty() && r.matches(name)).ok_or_else(|| {
                BadInput::new("the name of no adapter contains this text")
                    .key("device")
                    .value(name)
                    .allowed(listed)
                    .remedy("`catseye devices` lists the adapters")
                    .into()
            })
        }
        Want::Described(report) => reports.iter().position(|r| r == report).ok_or_else(|| {
            BadInput::new("the adapter is no longer available")
                .key("device")
                .value(&report.name)
                .allowed(listed)
                .remedy("`catseye devices` lists the adapters")
                .into()
        }),
    }
}

/// What went wrong outside any error scope.
#[derive(Default)]
struct Sink {
    errors: Vec<String>,
    /// Why the device is gone for good.
    lost: Option<String>,
}

impl Sink {
    /// Notes that the device is lost; the first reason stays.
    fn lose(&mut self, why: &str) {
        self.lost.get_or_insert_with(|| {
            format!(
                "the device was lost ({why}), for example because its driver was reset, it was removed or its memory ran out: run the same \
                 command again (runs, datasets and studies continue); if it is lost again, use a smaller --batch or another --device"
            )
        });
    }
}

/// The pipeline of one kernel. Whoever builds it holds the lock, so that it is built once.
type Slot = Arc<Mutex<Option<Arc<Pipeline>>>>;

/// An opened device that has passed the self-test. May be shared between threads.
pub struct Gpu {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    pub(super) limits: wgpu::Limits,
    report: AdapterReport,
    binding_limit: u64,
    poison: bool,
    /// Whether a software driver takes the ways that hardware takes.
    pretends: bool,
    has_f64: bool,
    /// Whether the beams of frames are left to the host.
    host_traces: bool,
    lines: bool,
    /// The submission in which the device is lost, where a test wants that.
    lost_at: Option<u64>,
    /// None unless kernels are profiled.
    pub(super) profiler: Option<Profiler>,
    pipelines: Mutex<HashMap<&'static str, Slot>>,
    pub(super) info: wgpu::AdapterInfo,
    /// None where pipelines are not kept between starts.
    cache: Option<DiskCache>,
    sink: Arc<Mutex<Sink>>,
    pub(super) arena: Arc<Arena>,
}

impl std::fmt::Debug for Gpu {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Gpu").field("report", &self.report).finish_non_exhaustive()
    }
}

impl Gpu {
    pub(super) fn open_untested(want: Want<'_>) -> Result<Gpu> {
        let found = found_adapters();
        let reports: Vec<_> = found.iter().map(|(_, r)| r.clone()).collect();
        let index = choose(&reports, want)?;
        let (adapter, report) = &found[index];
        // Kernels get by with these of WebGPU's defaults (`tests/house.rs`): a device opened with them refuses what would not run everywhere.
        let everywhere = wgpu::Limits::default();
        let limits = wgpu::Limits {
            max_storage_buffers_per_shader_stage: everywhere.max_storage_buffers_per_shader_stage,
            max_compute_workgroup_storage_size: everywhere.max_compute_workgroup_storage_size,
            max_compute_invocations_per_workgroup: everywhere.max_compute_invocations_per_workgroup,
            ..adapter.limits()
        };
        let mut wanted =
            wgpu::Features::TIMESTAMP_QUERY | wgpu::Features::PIPELINE_CACHE | wgpu::Features::SHADER_F64;
        let info = adapter.get_info();
        if info.backend == wgpu::Backend::Vulkan {
            wanted |= wgpu::Features::PASSTHROUGH_SHADERS;
        }
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("catseye"),
            // It costs nothing where no query is made.
            required_features: adapter.features() & wanted,
            required_limits: limits.clone(),
            experimental_features: wgpu::ExperimentalFeatures::disabled(),
            memory_hints: wgpu::MemoryHints::Performance,
            trace: wgpu::Trace::Off,
        }))
        .map_err(|e| error(report, "none", format!("the device cannot be opened: {e}")))?;
        let sink = Arc::new(Mutex::new(Sink::default()));
        let errors = Arc::clone(&sink);
        device.on_uncaptured_error(Arc::new(move |e: wgpu::Error| lock(&errors).errors.push(e.to_string())));
        let lost = Arc::clone(&sink);
        device.set_device_lost_callback(move |reason, message| {
            let why = format!("{reason:?} {message}");
            lock(&lost).lose(why.trim_end());
        });
        Ok(Gpu {
            device,
            queue,
            binding_limit: limits.max_storage_buffer_binding_size,
            limits,
            report: report.clone(),
            poison: cfg!(any(test, debug_assertions)),
            pretends: false,
            has_f64: report.shader_f64,
            host_traces: false,
            lines: false,
            lost_at: None,
            profiler: None,
            pipelines: Mutex::default(),
            info,
            cache: None,
            sink,
            arena: Arc::default(),
        })
    }

    /// The adapter as the driver describes it.
    pub fn report(&self) -> &AdapterReport {
        &self.report
    }

    /// What all submissions did so far.
    pub fn counts(&self) -> GpuCounts {
        self.arena.counters.now()
    }

    /// Time in which the device had at least one submission to work on, s.
    pub fn busy_seconds(&self) -> f64 {
        1e-9 * self.arena.counters.busy_ns() as f64
    }

    /// Bytes that one storage binding may hold. A stage with more data works in chunks.
    pub fn max_binding_bytes(&self) -> u64 {
        self.binding_limit
    }

    /// Pretends that the adapter's limit is smaller, to test chunking.
    pub fn with_binding_limit(mut self, bytes: u64) -> Gpu {
        self.binding_limit = self.binding_limit.min(bytes);
        self
    }

    /// Whether kernels are chosen and sized as for hardware.
    pub fn is_hardware(&self) -> bool {
        self.report.is_hardware || self.pretends
    }

    /// Takes the ways that only hardware takes (larger tiles, more threads, memory of workgroups), on a software driver too, so that tests
    /// without a GPU reach them.
    pub fn with_pretended_hardware(mut self) -> Gpu {
        self.pretends = true;
        self
    }

    /// Computes in pairs of f32 where kernels would take f64, as adapters without f64 do. To be called before any kernel runs.
    pub fn with_pairs(mut self) -> Gpu {
        self.has_f64 = false;
        self
    }

    /// Whether the beams of frames are followed on the host, and not here.
    pub fn traces_on_host(&self) -> bool {
        self.host_traces
    }

    /// Leaves the beams of frames to the host, or takes them back.
    pub fn with_tracing_on_host(mut self, on_host: bool) -> Gpu {
        self.host_traces = on_host;
        self
    }

    /// Whether frames are traced by lines, and not by polygons.
    pub fn traces_by_lines(&self) -> bool {
        self.lines
    }

    /// Traces frames by lines, or by polygons again.
    pub fn with_lines(mut self, lines: bool) -> Gpu {
        self.lines = lines;
        self
    }

    /// Loses the device for good while it works on its submission number `number`, counted from now on and from 1, to test what becomes of
    /// the work. For one thread at a time: wgpu takes the memory of all buffers then, also what another thread is just reading.
    pub fn with_loss_in_submission(mut self, number: u64) -> Gpu {
        self.lost_at = Some(self.counts().submits + number);
        self
    }

    /// Destroys the device if a test wants that in this submission.
    pub(super) fn lose_if_asked(&self) {
        if self.lost_at.is_some_and(|at| self.counts().submits >= at) {
            self.device.destroy();
        }
    }

    /// Counts from now on what each kernel does, and times it where the adapter has timestamp queries. Each dispatch then
    /// has a pass of its own and waits for the one before it, so that submissions take somewhat longer.
    pub fn with_profiling(mut self) -> Gpu {
        self.profiler = Some(Profiler::new(self.report.timestamp));
        self
    }

    /// What each kernel did since [`Gpu::with_profiling`]; None without it.
    pub fn profile(&self) -> Option<Profile> {
        self.profiler.as_ref().map(Profiler::now)
    }

    /// Fills buffers whose contents are unspecified with the bits [`super::recorder::POISON`], to show
    /// what a kernel leaves unwritten. Always on in this crate's unit tests and in debug builds.
    pub fn with_poisoned_buffers(mut self) -> Gpu {
        self.poison = true;
        self
    }

    pub(super) fn poison(&self) -> bool {
        self.poison
    }

    /// An error about `kernel` that shows in a device that is lost.
    pub(super) fn lost(&self, kernel: &str, why: &str) -> Error {
        lock(&self.sink).lose(why);
        self.error(kernel, why)
    }

    /// An error about `kernel`. Where the device is lost, that is the problem, whatever it shows in.
    pub(super) fn error(&self, kernel: &str, problem: impl Into<String>) -> Error {
        let lost = lock(&self.sink).lost.clone();
        error(&self.report, kernel, lost.unwrap_or_else(|| problem.into()))
    }

    /// The same device, which keeps its pipelines between starts in a file of `folder`. Without effect on an adapter that has no pipeline
    /// cache, and where the folder cannot be used.
    pub(super) fn with_cache(mut self, folder: &Path) -> Gpu {
        let opened = self.scoped("pipeline cache", || DiskCache::open(&self.device, &self.info, folder));
        self.cache = opened.ok().flatten();
        self
    }

    /// Writes the pipelines that were compiled since the cache was read or written, and returns the name of its file; None where pipelines
    /// are not kept. Also done when the device is dropped, and by the first submission that needs no new pipeline.
    ///
    /// # Errors
    /// Returns an error if the file cannot be written. That changes no result.
    pub fn write_cache(&self) -> Result<Option<PathBuf>> {
        self.cache.as_ref().map(|cache| cache.write().map(Path::to_path_buf)).transpose()
    }

    /// Builds the pipelines of those kernels that have none yet, on several threads, and returns their number.
    ///
    /// # Errors
    /// Returns `Error::Gpu` for a kernel that the adapter refuses.
    pub fn prepare(&self, kernels: &[&'static Kernel]) -> Result<usize> {
        let mut missing: Vec<&'static Kernel> = Vec::new();
        {
            let pipelines = lock(&self.pipelines);
            let is_built = |stem| {
                // What another thread builds is waited for below, where the others are not held up.
                pipelines.get(stem).is_some_and(|slot| slot.try_lock().is_ok_and(|slot| slot.is_some()))
            };
            for kernel in kernels {
                if missing.iter().all(|k| k.stem != kernel.stem) && !is_built(kernel.stem) {
                    missing.push(kernel);
                }
            }
        }
        if missing.is_empty() {
            return Ok(0);
        }
        let next = AtomicUsize::new(0);
        let work = || -> Result<()> {
            while let Some(kernel) = missing.get(next.fetch_add(1, Ordering::Relaxed)) {
                self.pipeline(kernel)?;
            }
            Ok(())
        };
        // Not those of rayon, which would take up other work that may ask for one of these pipelines.
        let threads = rayon::current_num_threads().min(missing.len());
        std::thread::scope(|scope| {
            let others: Vec<_> = (1..threads).map(|_| scope.spawn(work)).collect();
            let own = work();
            let ends = others.into_iter().map(|t| t.join().unwrap_or_else(|e| std::panic::resume_unwind(e)));
            ends.fold(own, Result::and)
        })?;
        Ok(missing.len())
    }

    /// Builds what these kernels of a submission lack. When they lack nothing, the cache has what it will have for some time.
    pub(super) fn prepare_submission(&self, kernels: &[&'static Kernel]) -> Result<()> {
        if self.prepare(kernels)? == 0 && !kernels.is_empty() {
            let _ = self.write_cache();
        }
        Ok(())
    }

    pub(super) fn pipeline(&self, kernel: &'static Kernel) -> Result<Arc<Pipeline>> {
        let slot = Arc::clone(lock(&self.pipelines).entry(kernel.stem).or_default());
        let mut slot = lock(&slot);
        if let Some(built) = &*slot {
            return Ok(Arc::clone(built));
        }
        let cache = self.cache.as_ref();
        let built = self.scoped(kernel.stem, || {
            build_pipeline(&self.device, kernel, self.has_f64, cache.map(|c| &c.driver))
        })?;
        let built = Arc::new(built.map_err(|problem| self.error(kernel.stem, problem))?);
        *slot = Some(Arc::clone(&built));
        if let Some(cache) = cache {
            cache.add(kernel);
        }
        Ok(built)
    }

    /// Runs `f` and turns whatever wgpu reports meanwhile into an error about `kernel`.
    pub(super) fn scoped<T>(&self, kernel: &str, f: impl FnOnce() -> T) -> Result<T> {
        use wgpu::ErrorFilter::{Internal, OutOfMemory, Validation};
        let guards = [Validation, OutOfMemory, Internal].map(|filter| self.device.push_error_scope(filter));
        let value = f();
        let mut first = None;
        for guard in guards.into_iter().rev() {
            first = pollster::block_on(guard.pop()).or(first);
        }
        self.check_sink(kernel)?;
        match first {
            Some(e @ wgpu::Error::OutOfMemory { .. }) => {
                let source = std::error::Error::source(&e).map(|s| format!(": {s}")).unwrap_or_default();
                Err(self.error(kernel, format!("the adapter's memory is exhausted{source}")))
            }
            Some(e) => {
                // Buffers of a lost device are invalid before the notice of its loss is out, which comes while it is polled.
                let _ = catch_unwind(AssertUnwindSafe(|| self.device.poll(wgpu::PollType::Poll)));
                Err(self.error(kernel, e.to_string()))
            }
            None => Ok(value),
        }
    }

    /// Fails if the device was lost, or if an error came from outside a scope since the last call or from the validation layer at any time.
    pub(super) fn check_sink(&self, kernel: &str) -> Result<()> {
        let (errors, is_lost) = {
            let mut sink = lock(&self.sink);
            sink.errors.extend(validation::said());
            (std::mem::take(&mut sink.errors), sink.lost.is_some())
        };
        match errors.is_empty() && !is_lost {
            true => Ok(()),
            false => Err(self.error(kernel, errors.join("; "))),
        }
    }
}

impl Drop for Gpu {
    fn drop(&mut self) {
        let _ = self.write_cache();
    }
}

fn error(report: &AdapterReport, kernel: &str, problem: impl Into<String>) -> Error {
    Error::Gpu {
        // One line whatever a driver's or parser's message holds.
        problem: problem.into().split_whitespace().collect::<Vec<_>>().join(" "),
        kernel: kernel.to_string(),
        adapter: report.name.clone(),
        driver: format!("{} {}", report.driver, report.driver_info),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::compare::{opened_for_tests, test_device_name, test_gpu};

    fn fake(name: &str, device_type: &str, driver_info: &str) -> AdapterReport {
        AdapterReport {
            name: name.into(),
            device_type: device_type.into(),
            backend: "vulkan".into(),
            driver: "d".into(),
            driver_info: driver_info.into(),
            max_storage_binding_bytes: 1 << 27,
            max_buffer_bytes: 1 << 31,
            max_workgroup_size: 1024,
            shared_bytes: 32768,
            shader_f64: false,
            timestamp: false,
            is_hardware: device_type.ends_with("Gpu"),
        }
    }

    #[test]
    fn choice_of_adapter() {
        let all = [
            fake("llvmpipe", "Cpu", "Mesa 25.0.7"),
            fake("Iris", "IntegratedGpu", "1"),
            fake("H100", "DiscreteGpu", "2"),
        ];
        assert_eq!(choose(&all, Want::Hardware).unwrap(), 2);
        assert_eq!(choose(&all, Want::Named("LLVMpipe")).unwrap(), 0);
        assert_eq!(choose(&all, Want::Named("mesa 25")).unwrap(), 0);
        assert_eq!(choose(&all[..2], Want::Hardware).unwrap(), 1);
        for (reports, want) in
            [(&all[..1], Want::Hardware), (&all[..], Want::Named("Arc")), (&all[..], Want::Named(""))]
        {
            let e = choose(reports, want).unwrap_err();
            assert_eq!(e.exit_code(), 2);
            assert!(e.to_string().contains("llvmpipe (d Mesa 25.0.7)"), "{e}");
        }
    }

    #[test]
    fn opens_the_test_device() {
        let report = test_gpu().report();
        assert!(report.matches(&test_device_name()), "{report:?}");
        assert!(adapters().contains(report));
        assert!(report.max_workgroup_size >= 256 && report.shared_bytes >= 16384, "{report:?}");
    }

    #[test]
    fn a_lost_device_is_an_error() {
        let gpu = Gpu::open_untested(Want::Named(&test_device_name())).unwrap();
        gpu.device.destroy();
        let mut recorder = gpu.recorder("lost");
        let buffer = recorder.upload("data", &[1.0_f32; 8]);
        let _ = recorder.read(&buffer);
        let e = recorder.submit().err().expect("a lost device must not succeed");
        assert_eq!(e.exit_code(), 1);
        assert!(e.to_string().contains("lost") && e.to_string().contains(&gpu.report.name), "{e}");
    }

    /// A device that is lost at work says so for the submission that it was lost in and for all later ones; what came before is whole.
    #[test]
    fn a_device_that_is_lost_at_work_stays_lost() {
        let gpu = opened_for_tests().with_loss_in_submission(3);
        let submit = |value: f32| {
            let mut recorder = gpu.recorder("work");
            let buffer = recorder.upload("data", &[value; 4096]);
            let read = recorder.read(&buffer);
            recorder.submit().map(|mut done| done.take(read))
        };
        for value in [1.0, 2.0] {
            assert!(submit(value).unwrap().iter().all(|v| *v == value));
        }
        let submitted = gpu.counts().submits;
        for _ in 0..3 {
            let text = submit(3.0).unwrap_err().to_string();
            let parts = ["the device was lost (", "run the same command again", &gpu.report.name];
            assert!(parts.iter().all(|part| text.contains(part)), "{text}");
        }
        // Nothing is given to a device that is gone.
        assert_eq!(gpu.counts().submits, submitted + 1);
    }

    /// Many threads ask for the same pipelines at once, and each is built once; a kernel that no adapter takes is an error of its name.
    #[test]
    fn pipelines_are_prepared_by_several_threads() {
        let t = tempfile::tempdir().unwrap();
        let want = Want::Described(test_gpu().report());
        let gpu = Gpu::open_with_cache(want, Some(t.path())).unwrap();
        let all = crate::engine::all_kernels();
        std::thread::scope(|scope| {
            for _ in 0..3 {
                scope.spawn(|| gpu.prepare(&all).unwrap());
            }
        });
        assert_eq!(gpu.prepare(&all).unwrap(), 0);
        let built: Vec<_> = all.iter().map(|k| gpu.pipeline(k).unwrap()).collect();
        assert!(all.iter().zip(&built).all(|(k, p)| Arc::ptr_eq(p, &gpu.pipeline(k).unwrap())));
        let cold = std::fs::metadata(gpu.write_cache().unwrap().unwrap()).unwrap().len();
        drop(gpu);
        let gpu = Gpu::open_with_cache(want, Some(t.path())).unwrap();
        assert_eq!(gpu.prepare(&all).unwrap(), all.len() - 1, "the self-test made its own");
        let path = gpu.write_cache().unwrap().unwrap();
        assert_eq!(std::fs::metadata(path).unwrap().len(), cold);
        let wrong: &'static Kernel =
            Box::leak(Box::new(Kernel { stem: "test/wrong", sources: &["fn main( {"], ..*all[0] }));
        let e = gpu.prepare(&[all[1], wrong, all[2]]).unwrap_err().to_string();
        assert!(e.contains("test/wrong"), "{e}");
    }
}
