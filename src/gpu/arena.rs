//! Buffers and bind groups that are kept between submissions, so that a frame like the one before it allocates nothing; and counts
//! of what submissions did.
//!
//! A buffer goes back when the last that refers to it is dropped, and is taken again by whoever asks for one of its size class and
//! use. The lowest number is taken first: the same commands get the same buffers again, and with them the same bind groups.

use std::collections::{BTreeMap, HashMap};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Submissions after which an idle buffer is given up.
const OLDEST: u64 = 64;
/// Bytes of idle buffers above which the oldest are given up.
const MOST_IDLE_BYTES: u64 = 1 << 30;
/// Bind groups that are kept.
const MOST_GROUPS: usize = 4096;
/// Size classes from one power of two to the next: a buffer is at most an eighth larger than what it holds.
const CLASSES: u64 = 8;
/// Smallest buffer that is made, bytes.
const SMALLEST: u64 = 256;

// A panic elsewhere leaves these maps and lists whole.
pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What the submissions of a device did since it was opened.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize)]
pub struct GpuCounts {
    /// Submissions, each of which was waited for.
    pub submits: u64,
    /// Kernels that were started.
    pub dispatches: u64,
    /// Bytes that went from the host to the device, uniforms included.
    pub uploaded_bytes: u64,
    /// Bytes that came back to the host.
    pub read_bytes: u64,
    /// Buffers that were allocated.
    pub buffers: u64,
    /// Their bytes.
    pub buffer_bytes: u64,
    /// Bind groups that were made.
    pub bind_groups: u64,
    /// Query sets that were made: none unless kernels are profiled.
    pub query_sets: u64,
}

impl GpuCounts {
    /// What was done after `before` was taken.
    #[must_use]
    pub fn since(&self, before: &GpuCounts) -> GpuCounts {
        GpuCounts {
            submits: self.submits - before.submits,
            dispatches: self.dispatches - before.dispatches,
            uploaded_bytes: self.uploaded_bytes - before.uploaded_bytes,
            read_bytes: self.read_bytes - before.read_bytes,
            buffers: self.buffers - before.buffers,
            buffer_bytes: self.buffer_bytes - before.buffer_bytes,
            bind_groups: self.bind_groups - before.bind_groups,
            query_sets: self.query_sets - before.query_sets,
        }
    }
}

/// Counters behind [`GpuCounts`].
#[derive(Default)]
pub(super) struct Counters {
    pub submits: AtomicU64,
    pub dispatches: AtomicU64,
    pub uploaded_bytes: AtomicU64,
    pub read_bytes: AtomicU64,
    pub buffers: AtomicU64,
    pub buffer_bytes: AtomicU64,
    pub bind_groups: AtomicU64,
    pub query_sets: AtomicU64,
    under_way: Mutex<UnderWay>,
}

/// Submissions that are under way.
#[derive(Default)]
struct UnderWay {
    count: u32,
    since: Option<Instant>,
    busy_ns: u64,
}

/// A submission that is under way until this is dropped.
pub(super) struct Busy<'a>(&'a Counters);

impl Drop for Busy<'_> {
    fn drop(&mut self) {
        let mut all = lock(&self.0.under_way);
        all.count -= 1;
        if all.count == 0
            && let Some(since) = all.since.take()
        {
            all.busy_ns += since.elapsed().as_nanos() as u64;
        }
    }
}

impl Counters {
    /// Time in which at least one submission was under way, ns, without those that still are.
    pub fn busy_ns(&self) -> u64 {
        lock(&self.under_way).busy_ns
    }

    /// Notes that a submission begins.
    pub fn begin(&self) -> Busy<'_> {
        let mut all = lock(&self.under_way);
        all.count += 1;
        all.since.get_or_insert_with(Instant::now);
        Busy(self)
    }

    pub fn add(counter: &AtomicU64, n: u64) {
        counter.fetch_add(n, Ordering::Relaxed);
    }

    pub fn now(&self) -> GpuCounts {
        let of = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        GpuCounts {
            submits: of(&self.submits),
            dispatches: of(&self.dispatches),
            uploaded_bytes: of(&self.uploaded_bytes),
            read_bytes: of(&self.read_bytes),
            buffers: of(&self.buffers),
            buffer_bytes: of(&self.buffer_bytes),
            bind_groups: of(&self.bind_groups),
            query_sets: of(&self.query_sets),
        }
    }
}

/// A buffer of the arena.
pub(super) struct KeptBuffer {
    pub buffer: wgpu::Buffer,
    /// Its own among all buffers of the arena.
    pub id: u64,
    /// Bytes that it has room for.
    pub size: u64,
}

/// What a bind group binds: the kernel, and of each buffer its number, first byte and bytes.
pub(super) type GroupKey = (&'static str, Vec<[u64; 3]>);

#[derive(Default)]
struct Idle {
    /// By use and size, then by number; with the submission after which each was last needed.
    buffers: BTreeMap<(u32, u64), BTreeMap<u64, (KeptBuffer, u64)>>,
    bytes: u64,
    groups: HashMap<GroupKey, wgpu::BindGroup>,
}

/// The idle buffers and the bind groups of a device.
#[derive(Default)]
pub(super) struct Arena {
    idle: Mutex<Idle>,
    next: AtomicU64,
    pub counters: Counters,
}

/// The size class that holds so many bytes, at most `limit`.
pub(super) fn size_class(bytes: u64, limit: u64) -> u64 {
    let step = (bytes.max(SMALLEST).next_power_of_two() / 2 / CLASSES).max(4);
    bytes.max(SMALLEST).next_multiple_of(step).min(limit.max(bytes))
}

impl Arena {
    /// An idle buffer of this use and class.
    pub fn take(&self, usage: wgpu::BufferUsages, size: u64) -> Option<KeptBuffer> {
        let mut idle = lock(&self.idle);
        let (kept, _) = idle.buffers.get_mut(&(usage.bits(), size))?.pop_first()?.1;
        idle.bytes -= kept.size;
        Some(kept)
    }

    /// A buffer that has just been allocated, under a number of its own.
    pub fn adopt(&self, buffer: wgpu::Buffer) -> KeptBuffer {
        let size = buffer.size();
        Counters::add(&self.counters.buffers, 1);
        Counters::add(&self.counters.buffer_bytes, size);
        KeptBuffer { id: self.next.fetch_add(1, Ordering::Relaxed), size, buffer }
    }

    /// Takes a buffer back that nobody refers to. One that hosts write has to be mapped, one that they read unmapped.
    pub fn give(&self, kept: KeptBuffer) {
        let now = self.counters.submits.load(Ordering::Relaxed);
        let mut idle = lock(&self.idle);
        idle.bytes += kept.size;
        let class = (kept.buffer.usage().bits(), kept.size);
        idle.buffers.entry(class).or_default().insert(kept.id, (kept, now));
    }

    /// The bind group of this key, made by `make` where it is new.
    pub fn group<E>(
        &self,
        key: GroupKey,
        make: impl FnOnce() -> Result<wgpu::BindGroup, E>,
    ) -> Result<wgpu::BindGroup, E> {
        if let Some(group) = lock(&self.idle).groups.get(&key) {
            return Ok(group.clone());
        }
        let group = make()?;
        Counters::add(&self.counters.bind_groups, 1);
        let mut idle = lock(&self.idle);
        if idle.groups.len() >= MOST_GROUPS {
            idle.groups.clear();
        }
        idle.groups.insert(key, group.clone());
        Ok(group)
    }

    /// Gives up buffers that were idle for long, and the oldest where all together are too large.
    pub fn trim(&self) {
        let now = self.counters.submits.load(Ordering::Relaxed);
        let mut idle = lock(&self.idle);
        let ages = idle.buffers.values().flatten().map(|(_, (_, since))| *since);
        let least = if idle.bytes > MOST_IDLE_BYTES {
            // Half of what was used least.
            let mut ages: Vec<u64> = ages.collect();
            ages.sort_unstable();
            ages.get(ages.len() / 2).map_or(now, |middle| (*middle + 1).min(now))
        } else if ages.min().is_some_and(|oldest| oldest + OLDEST < now) {
            now - OLDEST
        } else {
            return;
        };
        self.give_up(&mut idle, |since| since < least);
    }

    /// Gives up all idle buffers: memory has run out.
    pub fn clear(&self) {
        self.give_up(&mut lock(&self.idle), |_| true);
    }

    fn give_up(&self, idle: &mut Idle, is_old: impl Fn(u64) -> bool) {
        let before = idle.bytes;
        for class in idle.buffers.values_mut() {
            class.retain(|_, (_, since)| !is_old(*since));
        }
        idle.buffers.retain(|_, class| !class.is_empty());
        idle.bytes = idle.buffers.values().flatten().map(|(_, (kept, _))| kept.size).sum();
        if idle.bytes < before {
            // A bind group keeps its buffers.
            idle.groups.clear();
        }
    }

    /// Bytes of the idle buffers.
    #[cfg(test)]
    pub fn idle_bytes(&self) -> u64 {
        lock(&self.idle).bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_hold_their_bytes_and_little_more() {
        for bytes in (0..4000).chain([1 << 20, (1 << 20) + 1, 12_582_912, (1 << 31) - 4]) {
            let size = size_class(bytes, u64::MAX);
            assert!(size >= bytes && size.is_multiple_of(4), "{bytes}: {size}");
            assert!(size <= (bytes + bytes / CLASSES + 4).max(SMALLEST), "{bytes}: {size}");
            assert_eq!(size_class(size, u64::MAX), size);
        }
        // The adapter's largest buffer stays possible.
        assert_eq!(size_class(1_000_000, 1_000_000), 1_000_000);
    }
}
