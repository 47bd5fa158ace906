//! The adapters of this machine, which one `auto` takes, and their compiled pipelines.

use super::{Engine, Purpose, all_kernels};
use crate::base::error::{Error, Result};
use crate::gpu::{AdapterReport, Gpu, Want, adapters};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// An adapter and what it says to the self-test.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Device {
    /// The adapter.
    #[serde(flatten)]
    pub adapter: AdapterReport,
    /// "passed", or what is wrong.
    pub self_test: String,
}

/// All devices of this machine.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Listing {
    /// "gpu" or "cpu".
    pub auto: String,
    /// The same for frames of scenes ([`Purpose::Frames`](super::Purpose)).
    pub auto_frames: String,
    /// Threads that the cpu engine would use.
    pub cpu_threads: usize,
    /// Adapters in the order in which `auto` prefers them.
    pub adapters: Vec<Device>,
}

/// Opens every adapter once.
pub fn listing() -> Listing {
    let found = adapters();
    let has_gpu = found.iter().any(|a| a.is_hardware);
    let of = |purpose: Purpose| if has_gpu && purpose.rule().0 { "gpu" } else { "cpu" };
    let (auto, auto_frames) = (of(Purpose::General).into(), of(Purpose::Frames).into());
    let adapters = found
        .into_iter()
        .map(|adapter| Device {
            self_test: match Gpu::open(Want::Described(&adapter)) {
                Ok(_) => "passed".into(),
                Err(e) => e.to_string(),
            },
            adapter,
        })
        .collect();
    Listing { auto, auto_frames, cpu_threads: rayon::current_num_threads(), adapters }
}

/// All kernels compiled for one adapter.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Warmed {
    /// The adapter.
    #[serde(flatten)]
    pub adapter: AdapterReport,
    /// Number of kernels.
    pub kernels: usize,
    /// Time from the opened device to the last pipeline, s.
    pub pipelines_s: f64,
    /// File that keeps the pipelines for later starts; None where they are not kept.
    pub cache_file: Option<PathBuf>,
    /// Why they are not kept.
    pub problem: Option<String>,
}

/// Compiles the pipelines of all kernels for the engine's adapter, and keeps them in the user's cache folder; None for the cpu engine.
///
/// # Errors
/// Returns an error for a kernel that the adapter refuses. A cache that cannot be written is no error, but [`Warmed::problem`].
pub fn warm(engine: &Engine) -> Result<Option<Warmed>> {
    let Engine::Gpu(gpu) = engine else { return Ok(None) };
    let (kernels, start) = (all_kernels(), Instant::now());
    gpu.prepare(&kernels)?;
    let pipelines_s = start.elapsed().as_secs_f64();
    let (cache_file, problem) = match gpu.write_cache() {
        Ok(Some(file)) => (Some(file), None),
        Ok(None) => (None, Some("the cache is turned off, or the adapter has no pipeline cache".to_string())),
        Err(e) => (None, Some(e.to_string())),
    };
    Ok(Some(Warmed {
        adapter: gpu.report().clone(),
        kernels: kernels.len(),
        pipelines_s,
        cache_file,
        problem,
    }))
}

/// Times of one start of a device.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Start {
    /// Time from opening the adapter to the result of the first kernel, the self-test's, s.
    pub first_result_s: f64,
    /// Time in which the pipelines of all other kernels are made, s.
    pub pipelines_s: f64,
}

/// Times of the starts of a device without and with a cache of its pipelines.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Starts {
    /// Number of kernels.
    pub kernels: usize,
    /// A start with an empty cache. The driver may have a cache of its own, which is as it is.
    pub cold: Start,
    /// A start with the cache that the cold one wrote.
    pub warm: Start,
    /// Size of the cache, bytes; None where the adapter has no pipeline cache.
    pub cache_bytes: Option<u64>,
}

/// Starts the engine's device twice anew, with a cache in `folder`, which has to be empty; None for the cpu engine.
///
/// # Errors
/// Returns an error if the adapter cannot be opened again or refuses a kernel, or if the cache cannot be written.
pub fn starts(engine: &Engine, folder: &Path) -> Result<Option<Starts>> {
    let Engine::Gpu(gpu) = engine else { return Ok(None) };
    let kernels = all_kernels();
    let start = || -> Result<(Start, Option<PathBuf>)> {
        let begin = Instant::now();
        let gpu = Gpu::open_with_cache(Want::Described(gpu.report()), Some(folder))?;
        let first_result_s = begin.elapsed().as_secs_f64();
        gpu.prepare(&kernels)?;
        let pipelines_s = begin.elapsed().as_secs_f64() - first_result_s;
        Ok((Start { first_result_s, pipelines_s }, gpu.write_cache()?))
    };
    let ((cold, file), (warm, _)) = (start()?, start()?);
    let size = |file: PathBuf| std::fs::metadata(&file).map(|m| m.len()).map_err(|e| Error::io(&file, e));
    Ok(Some(Starts { kernels: kernels.len(), cold, warm, cache_bytes: file.map(size).transpose()? }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::Precision;
    use crate::gpu::compare::opened_for_tests;

    #[test]
    fn a_device_starts_cold_and_warm() {
        let t = tempfile::tempdir().unwrap();
        let engine = Engine::Gpu(Box::new(opened_for_tests()));
        let found = starts(&engine, t.path()).unwrap().unwrap();
        assert_eq!(found.kernels, all_kernels().len());
        assert!([found.cold, found.warm].iter().all(|s| s.first_result_s > 0.0 && s.pipelines_s > 0.0));
        assert_eq!(std::fs::read_dir(t.path()).unwrap().count(), usize::from(found.cache_bytes.is_some()));
        // This engine keeps nothing.
        let warmed = warm(&engine).unwrap().unwrap();
        assert!(warmed.cache_file.is_none() && warmed.problem.unwrap().contains("turned off"));
        let cpu = Engine::Cpu(Precision::F32);
        assert!(warm(&cpu).unwrap().is_none() && starts(&cpu, t.path()).unwrap().is_none());
    }
}
