//! What each kernel did on the device, and how long the device took, by queries of its clock. Nothing here is made unless
//! [`super::Gpu::with_profiling`] was called.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

/// What the dispatches of one kernel did together.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct KernelUse {
    /// Stem of the kernel, such as `dsp/fft`.
    pub kernel: &'static str,
    /// How often it was started.
    pub dispatches: u64,
    /// Workgroups of all dispatches.
    pub workgroups: u64,
    /// Threads of all dispatches, with those that workgroups are filled up with.
    pub threads: u64,
    /// Bytes of all buffers that the dispatches bound, the uniform included. A kernel that reads or writes every value
    /// of its buffers once moves so many bytes.
    pub bound_bytes: u64,
    /// Time on the device between the beginning and the end of the dispatches, s. It is None where the adapter has no
    /// timestamp queries.
    pub seconds: Option<f64>,
}

/// What the kernels of some submissions did.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Profile {
    /// Whether the adapter times its passes. If it does not, every [`KernelUse::seconds`] is None.
    pub has_timestamps: bool,
    /// The kernels that ran, in the order of their stems.
    pub kernels: Vec<KernelUse>,
}

impl Profile {
    /// What was done after `before` was taken of the same device.
    #[must_use]
    pub fn since(&self, before: &Profile) -> Profile {
        let earlier = |kernel| before.kernels.iter().find(|k| k.kernel == kernel);
        let kernels = self
            .kernels
            .iter()
            .map(|k| match earlier(k.kernel) {
                None => *k,
                Some(b) => KernelUse {
                    kernel: k.kernel,
                    dispatches: k.dispatches - b.dispatches,
                    workgroups: k.workgroups - b.workgroups,
                    threads: k.threads - b.threads,
                    bound_bytes: k.bound_bytes - b.bound_bytes,
                    seconds: k.seconds.map(|s| s - b.seconds.unwrap_or(0.0)),
                },
            })
            .filter(|k| k.dispatches > 0)
            .collect();
        Profile { has_timestamps: self.has_timestamps, kernels }
    }

    /// Adds what other submissions of the same device did.
    pub fn add(&mut self, other: &Profile) {
        for k in &other.kernels {
            add_to(&mut self.kernels, k);
        }
        self.kernels.sort_by_key(|k| k.kernel);
    }

    /// Time of all kernels on the device, s. It is None where the adapter has no timestamp queries.
    pub fn seconds(&self) -> Option<f64> {
        self.has_timestamps.then(|| self.kernels.iter().filter_map(|k| k.seconds).sum())
    }
}

fn add_to(kernels: &mut Vec<KernelUse>, more: &KernelUse) {
    match kernels.iter_mut().find(|k| k.kernel == more.kernel) {
        None => kernels.push(*more),
        Some(k) => {
            k.dispatches += more.dispatches;
            k.workgroups += more.workgroups;
            k.threads += more.threads;
            k.bound_bytes += more.bound_bytes;
            k.seconds = k.seconds.zip(more.seconds).map(|(a, b)| a + b);
        }
    }
}

/// Adds up what the submissions of a device did.
pub(super) struct Profiler {
    pub has_timestamps: bool,
    kernels: Mutex<BTreeMap<&'static str, KernelUse>>,
}

impl Profiler {
    pub fn new(has_timestamps: bool) -> Profiler {
        Profiler { has_timestamps, kernels: Mutex::default() }
    }

    pub fn add(&self, used: impl IntoIterator<Item = KernelUse>) {
        let mut kernels = super::arena::lock(&self.kernels);
        for more in used {
            let mut one: Vec<KernelUse> = kernels.remove(more.kernel).into_iter().collect();
            add_to(&mut one, &more);
            kernels.extend(one.into_iter().map(|k| (k.kernel, k)));
        }
    }

    pub fn now(&self) -> Profile {
        let kernels = super::arena::lock(&self.kernels).values().copied().collect();
        Profile { has_timestamps: self.has_timestamps, kernels }
    }
}

/// Dispatches that one query set times, each at its beginning and its end.
const PER_SET: usize = wgpu::QUERY_SET_MAX_QUERIES as usize / 2;

/// The queries of one submission: each dispatch has a pass of its own, whose beginning and end the device notes.
pub(super) struct Timing {
    sets: Vec<wgpu::QuerySet>,
    dispatches: usize,
    /// Ticks as the device resolves them, and where the host reads them.
    resolved: wgpu::Buffer,
    read: wgpu::Buffer,
}

impl Timing {
    /// Queries for so many dispatches, at least one. To be called inside error scopes.
    pub fn new(device: &wgpu::Device, dispatches: usize) -> Timing {
        let label = Some("timestamps");
        let sets = (0..dispatches.div_ceil(PER_SET))
            .map(|set| {
                device.create_query_set(&wgpu::QuerySetDescriptor {
                    label,
                    ty: wgpu::QueryType::Timestamp,
                    count: 2 * (dispatches - set * PER_SET).min(PER_SET) as u32,
                })
            })
            .collect();
        let size = (2 * dispatches) as u64 * u64::from(wgpu::QUERY_SIZE);
        let buffer = |usage| {
            device.create_buffer(&wgpu::BufferDescriptor { label, size, usage, mapped_at_creation: false })
        };
        Timing {
            sets,
            dispatches,
            resolved: buffer(wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC),
            read: buffer(wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST),
        }
    }

    pub fn sets(&self) -> u64 {
        self.sets.len() as u64
    }

    /// Where the pass of a dispatch notes its beginning and its end.
    pub fn writes(&self, dispatch: usize) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        let first = 2 * (dispatch % PER_SET) as u32;
        Some(wgpu::ComputePassTimestampWrites {
            query_set: self.sets.get(dispatch / PER_SET)?,
            beginning_of_pass_write_index: Some(first),
            end_of_pass_write_index: Some(first + 1),
        })
    }

    /// Records the copies of all ticks to where the host reads them.
    pub fn resolve(&self, encoder: &mut wgpu::CommandEncoder) {
        for (set, queries) in self.sets.iter().enumerate() {
            let count = 2 * (self.dispatches - set * PER_SET).min(PER_SET) as u32;
            let offset = (2 * set * PER_SET) as u64 * u64::from(wgpu::QUERY_SIZE);
            encoder.resolve_query_set(queries, 0..count, &self.resolved, offset);
        }
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.read, 0, self.read.size());
    }

    /// Asks for the ticks, which are there once the submission is done; a refusal goes to `refused`.
    pub fn map(&self, refused: Arc<Mutex<Option<String>>>) {
        self.read.map_async(wgpu::MapMode::Read, .., move |result| {
            if let Err(e) = result {
                *super::arena::lock(&refused) = Some(e.to_string());
            }
        });
    }

    /// Time of each dispatch, s, for a clock with `period_ns` between two ticks.
    pub fn seconds(&self, period_ns: f32) -> Result<Vec<f64>, String> {
        let view = self.read.get_mapped_range(..).map_err(|e| e.to_string())?;
        let ticks: Vec<u64> = bytemuck::pod_collect_to_vec(&view);
        let seconds = |pair: &[u64]| pair[1].saturating_sub(pair[0]) as f64 * 1e-9 * f64::from(period_ns);
        Ok(ticks.chunks_exact(2).map(seconds).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn used(kernel: &'static str, n: u64, seconds: Option<f64>) -> KernelUse {
        KernelUse { kernel, dispatches: n, workgroups: 2 * n, threads: 128 * n, bound_bytes: 4 * n, seconds }
    }

    #[test]
    fn what_is_added_can_be_taken_apart() {
        let profiler = Profiler::new(true);
        profiler.add([used("b", 1, Some(0.25)), used("a", 2, Some(0.5)), used("b", 3, Some(1.0))]);
        let before = profiler.now();
        assert_eq!(before.kernels, [used("a", 2, Some(0.5)), used("b", 4, Some(1.25))]);
        profiler.add([used("b", 1, Some(0.5)), used("c", 1, Some(2.0))]);
        let mut after = profiler.now().since(&before);
        assert_eq!(after.kernels, [used("b", 1, Some(0.5)), used("c", 1, Some(2.0))]);
        assert_eq!(after.seconds(), Some(2.5));
        after.add(&before);
        assert_eq!(after, profiler.now());
    }

    #[test]
    fn without_timestamps_there_is_no_time() {
        let profiler = Profiler::new(false);
        profiler.add([used("a", 1, None), used("a", 1, None)]);
        assert_eq!(profiler.now().kernels, [used("a", 2, None)]);
        assert_eq!(profiler.now().seconds(), None);
    }
}
