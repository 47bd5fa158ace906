//! Commands as data, and the one place that runs them. A recorder that has met an error ignores
//! further commands; `submit` returns the first error.
//!
//! Commands run in their order, so a buffer that nobody holds any more while commands are still recorded is dead after those there
//! are: its memory serves the next buffer of its size class. The temporaries of many frames of one submission thus take the memory
//! of one frame's.

use super::arena::{Arena, Counters, GroupKey, KeptBuffer, size_class};
use super::context::Gpu;
use super::kernel::Kernel;
use super::profile::{KernelUse, Timing};
use crate::base::error::{Error, Result};
use bytemuck::Pod;
use std::collections::BTreeMap;
use std::marker::PhantomData;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, Weak};
use std::time::Instant;

/// What a poisoned buffer holds before anything is written: a NaN with a recognisable payload.
pub const POISON: u32 = 0x7FC0_DEAD;

/// Bytes behind an empty buffer, since wgpu binds none of size zero: room for one element of any
/// struct. Kernels take their counts from their uniform and never from `arrayLength`.
const EMPTY_BYTES: u64 = 256;

/// Contents below so many bytes are copied before all commands, into memory that is theirs: a copy between kernels parts the pass in
/// which they run.
const SMALL_FILL_BYTES: u64 = 1 << 20;

/// A buffer of `len` values of `T` on the device. Cloning shares the memory, which lives as long as it is referred to,
/// also beyond the recorder that made it.
pub struct Buffer<T> {
    /// None after a failed allocation, which the recorder reports.
    raw: Option<Arc<Raw>>,
    len: usize,
    values: PhantomData<fn() -> T>,
}

impl<T> Clone for Buffer<T> {
    fn clone(&self) -> Self {
        Buffer { raw: self.raw.clone(), len: self.len, values: PhantomData }
    }
}

impl<T> Buffer<T> {
    /// Number of elements of the buffer.
    pub fn len(&self) -> usize {
        self.len
    }
    /// Whether the buffer has no element.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }
}

mod sealed {
    use crate::gpu::arena::{Arena, KeptBuffer};

    /// Memory of the arena, which goes back when nobody refers to it.
    pub struct Memory {
        /// None only while it is dropped.
        pub(super) kept: Option<KeptBuffer>,
        pub(super) arena: std::sync::Arc<Arena>,
    }

    /// What a buffer is of its memory.
    #[derive(Clone)]
    pub struct Raw {
        pub(super) memory: std::sync::Arc<Memory>,
        /// Bytes that it holds, of those that the memory has room for.
        pub(super) bytes: u64,
        pub(super) label: &'static str,
    }

    impl Drop for Memory {
        fn drop(&mut self) {
            if let Some(kept) = self.kept.take() {
                self.arena.give(kept);
            }
        }
    }

    pub trait Sealed {
        fn raw(&self) -> Option<&std::sync::Arc<Raw>>;
    }
}
use sealed::{Memory, Raw};

impl<T> sealed::Sealed for Buffer<T> {
    fn raw(&self) -> Option<&Arc<Raw>> {
        self.raw.as_ref()
    }
}

/// A buffer of any type, to be bound.
pub trait AnyBuffer: sealed::Sealed {}
impl<T> AnyBuffer for Buffer<T> {}

/// Number of threads of a dispatch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Threads {
    /// A one-dimensional range, spread over x and y workgroups where it has more than one dimension
    /// holds. The shader gets its index from `linear_id` and compares it with the count.
    Linear(u64),
    /// Threads along each axis, rounded up to workgroups.
    Grid([u32; 3]),
    /// So many workgroups along each axis.
    Workgroups([u32; 3]),
}

impl Threads {
    /// Workgroups along each axis; any zero means no work. None if they do not fit.
    fn workgroups(self, size: [u32; 3], per_dimension: u32) -> Option<[u32; 3]> {
        let groups = match self {
            Threads::Linear(threads) => {
                let groups = threads.div_ceil(size.iter().map(|&s| u64::from(s)).product::<u64>().max(1));
                let rows = groups.div_ceil(u64::from(per_dimension));
                let columns = if rows == 0 { 0 } else { groups.div_ceil(rows) };
                // linear_id is a u32
                let in_range = threads <= 1 << 32;
                [u32::try_from(columns).ok().filter(|_| in_range)?, u32::try_from(rows).ok()?, 1]
            }
            Threads::Grid(threads) => [0, 1, 2].map(|i| threads[i].div_ceil(size[i].max(1))),
            Threads::Workgroups(groups) => groups,
        };
        groups.iter().all(|&g| g <= per_dimension).then_some(groups)
    }
}

/// A read-back that is later taken from `Done`.
#[derive(Debug)]
pub struct Pending<T> {
    recorder: u64,
    index: usize,
    len: usize,
    values: PhantomData<fn() -> T>,
}

/// What a new buffer holds.
enum Fill {
    /// Whatever was there.
    Unspecified,
    Zeros,
    /// What lies at the beginning of this one, which the host has written.
    Upload(KeptBuffer),
}

impl Fill {
    /// The buffer that the host has written, if it is filled from one.
    fn staged(self) -> Option<KeptBuffer> {
        match self {
            Fill::Upload(from) => Some(from),
            Fill::Unspecified | Fill::Zeros => None,
        }
    }

    fn encode(&self, encoder: &mut wgpu::CommandEncoder, to: &Raw) {
        let Some(kept) = &to.memory.kept else { return };
        match self {
            Fill::Unspecified => {}
            Fill::Zeros => encoder.clear_buffer(&kept.buffer, 0, Some(to.bytes)),
            Fill::Upload(from) => {
                let bytes = to.bytes.min(from.size);
                encoder.copy_buffer_to_buffer(&from.buffer, 0, &kept.buffer, 0, bytes);
            }
        }
    }
}

enum Command {
    Dispatch {
        kernel: &'static Kernel,
        /// Where its uniform lies in the recorder's uniforms.
        params: (u64, u64),
        storage: Vec<Raw>,
        workgroups: [u32; 3],
    },
    Read {
        from: Raw,
        to: KeptBuffer,
    },
    /// Of memory that earlier commands use for another buffer.
    Fill {
        to: Raw,
        fill: Fill,
    },
}

/// Memory that a recorder has taken, and the buffer that had it last.
struct Taken {
    memory: Arc<Memory>,
    last: Weak<Raw>,
}

/// The commands of one submission, in order. Later commands see what earlier ones wrote.
pub struct Recorder<'a> {
    gpu: &'a Gpu,
    label: &'static str,
    id: u64,
    /// Buffers of new memory, with what they begin with: before all commands.
    fills: Vec<(Raw, Fill)>,
    /// Memory that was taken for it, by size class.
    taken: BTreeMap<u64, Vec<Taken>>,
    commands: Vec<Command>,
    uniforms: Vec<u8>,
    reads: usize,
    /// Bytes of the buffers that were taken for it.
    bytes: u64,
    error: Option<Error>,
}

/// Use of a buffer that kernels read and write.
const STORAGE: wgpu::BufferUsages =
    wgpu::BufferUsages::STORAGE.union(wgpu::BufferUsages::COPY_SRC).union(wgpu::BufferUsages::COPY_DST);
/// Use of a buffer of uniforms.
const UNIFORM: wgpu::BufferUsages = wgpu::BufferUsages::UNIFORM.union(wgpu::BufferUsages::COPY_DST);
/// Use of a buffer that the host writes.
const UPLOAD: wgpu::BufferUsages = wgpu::BufferUsages::MAP_WRITE.union(wgpu::BufferUsages::COPY_SRC);
/// Use of a buffer that the host reads.
const READ_BACK: wgpu::BufferUsages = wgpu::BufferUsages::MAP_READ.union(wgpu::BufferUsages::COPY_DST);

impl Gpu {
    /// An empty list of commands; `label` names it in errors.
    pub fn recorder(&self, label: &'static str) -> Recorder<'_> {
        Recorder::new(self, label)
    }
}

impl<'a> Recorder<'a> {
    fn new(gpu: &'a Gpu, label: &'static str) -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        let id = NEXT.fetch_add(1, Ordering::Relaxed);
        Recorder {
            gpu,
            label,
            id,
            fills: Vec::new(),
            taken: BTreeMap::new(),
            commands: Vec::new(),
            uniforms: Vec::new(),
            reads: 0,
            bytes: 0,
            error: None,
        }
    }

    /// Bytes of all memory that the submission needs at once, that for uploads and read-backs included, and uniforms left out.
    /// Memory that serves several buffers in turn counts once.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Makes a buffer with these contents, which may be empty.
    pub fn upload<T: Pod>(&mut self, label: &'static str, data: &[T]) -> Buffer<T> {
        let bytes = bytemuck::cast_slice(data);
        self.new_buffer(label, data.len(), |r| match bytes.is_empty() {
            true => Ok(Fill::Unspecified),
            false => r.staged(label, bytes).map(Fill::Upload),
        })
    }

    /// Makes a buffer whose contents are unspecified (see [`Gpu::with_poisoned_buffers`]).
    pub fn buffer<T: Pod>(&mut self, label: &'static str, len: usize) -> Buffer<T> {
        let bytes = len * size_of::<T>();
        let is_poisoned = self.gpu.poison() && bytes > 0;
        self.new_buffer(label, len, |r| match is_poisoned {
            true => {
                let poison = vec![POISON; bytes.div_ceil(4)];
                r.staged(label, bytemuck::cast_slice(&poison)).map(Fill::Upload)
            }
            false => Ok(Fill::Unspecified),
        })
    }

    /// Makes a buffer of zero bytes.
    pub fn zeros<T: Pod>(&mut self, label: &'static str, len: usize) -> Buffer<T> {
        self.new_buffer(label, len, |_| Ok(Fill::Zeros))
    }

    fn new_buffer<T: Pod>(
        &mut self,
        label: &'static str,
        len: usize,
        fill: impl FnOnce(&Self) -> Result<Fill>,
    ) -> Buffer<T> {
        let failed = Buffer { raw: None, len, values: PhantomData };
        if self.error.is_some() {
            return failed;
        }
        let bytes = match (len as u64).saturating_mul(size_of::<T>() as u64) {
            0 => EMPTY_BYTES,
            bytes => bytes.next_multiple_of(4),
        };
        if bytes > self.gpu.limits.max_buffer_size {
            let limit = self.gpu.limits.max_buffer_size;
            self.fail(
                self.label,
                format!("buffer {label} of {bytes} bytes is larger than the adapter's {limit}"),
            );
            return failed;
        }
        let made = fill(self).and_then(|fill| self.filled(label, bytes, fill));
        match made {
            Ok(raw) => Buffer { raw: Some(raw), len, values: PhantomData },
            Err(e) => {
                self.error = Some(e);
                failed
            }
        }
    }

    /// A buffer in memory of its size class that is dead, or else in memory of its own.
    fn filled(&mut self, label: &'static str, bytes: u64, fill: Fill) -> Result<Arc<Raw>> {
        let of_upload = if let Fill::Upload(from) = &fill { from.size } else { 0 };
        let is_unspecified = matches!(fill, Fill::Unspecified);
        if is_unspecified || bytes >= SMALL_FILL_BYTES {
            let class = self.taken.get_mut(&size_class(bytes, self.gpu.limits.max_buffer_size));
            let dead = class.and_then(|class| class.iter_mut().find(|t| t.last.strong_count() == 0));
            if let Some(taken) = dead {
                let raw = Arc::new(Raw { memory: taken.memory.clone(), bytes, label });
                taken.last = Arc::downgrade(&raw);
                if !is_unspecified {
                    self.commands.push(Command::Fill { to: Raw::clone(&raw), fill });
                }
                self.bytes += of_upload;
                return Ok(raw);
            }
        }
        let kept = self.kept(label, bytes, STORAGE)?;
        let size = kept.size;
        self.bytes += size + of_upload;
        let memory = Arc::new(Memory { kept: Some(kept), arena: self.gpu.arena.clone() });
        let raw = Arc::new(Raw { memory: memory.clone(), bytes, label });
        self.fills.push((Raw::clone(&raw), fill));
        self.taken.entry(size).or_default().push(Taken { memory, last: Arc::downgrade(&raw) });
        Ok(raw)
    }

    /// A buffer of the arena for `bytes`, or a new one. One that the host writes is mapped.
    fn kept(&self, label: &str, bytes: u64, usage: wgpu::BufferUsages) -> Result<KeptBuffer> {
        let gpu = self.gpu;
        let size = size_class(bytes, gpu.limits.max_buffer_size);
        if let Some(kept) = gpu.arena.take(usage, size) {
            return Ok(kept);
        }
        let descriptor =
            wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: usage == UPLOAD };
        let make = || gpu.scoped(self.label, || gpu.device.create_buffer(&descriptor));
        // Memory that idle buffers hold may be what is missing.
        let buffer = make().or_else(|_| {
            gpu.arena.clear();
            make()
        })?;
        Ok(gpu.arena.adopt(buffer))
    }

    /// A buffer that the host has filled with these bytes, to be copied to where they belong.
    fn staged(&self, label: &str, contents: &[u8]) -> Result<KeptBuffer> {
        let kept = self.kept(label, (contents.len() as u64).next_multiple_of(4), UPLOAD)?;
        let mut view = kept
            .buffer
            .get_mapped_range_mut(..)
            .map_err(|e| self.gpu.error(self.label, format!("buffer {label} cannot be written: {e}")))?;
        view.slice(..contents.len()).copy_from_slice(contents);
        drop(view);
        self.gpu.scoped(self.label, || kept.buffer.unmap())?;
        Counters::add(&self.gpu.arena.counters.uploaded_bytes, contents.len() as u64);
        Ok(kept)
    }

    fn fail(&mut self, kernel: &str, problem: String) {
        if self.error.is_none() {
            self.error = Some(self.gpu.error(kernel, problem));
        }
    }

    /// Runs `kernel` on `threads` threads. `params` is `&()` for a kernel without a uniform. Zero
    /// threads do nothing.
    pub fn dispatch<P: Pod>(
        &mut self,
        kernel: &'static Kernel,
        params: &P,
        storage: &[&dyn AnyBuffer],
        threads: Threads,
    ) {
        if self.error.is_some() {
            return;
        }
        match self.dispatch_command(kernel, bytemuck::bytes_of(params), storage, threads) {
            Ok(Some(command)) => self.commands.push(command),
            Ok(None) => {}
            Err(problem) => self.fail(kernel.stem, problem),
        }
    }

    fn dispatch_command(
        &mut self,
        kernel: &'static Kernel,
        params: &[u8],
        storage: &[&dyn AnyBuffer],
        threads: Threads,
    ) -> Result<Option<Command>, String> {
        let expected = kernel.params.map_or(0, |p| p.size);
        if params.len() != expected {
            return Err(format!("Params of {} bytes given, {expected} expected", params.len()));
        }
        if storage.len() != kernel.storage.len() {
            return Err(format!(
                "{} storage buffers given, {} expected",
                storage.len(),
                kernel.storage.len()
            ));
        }
        let per_dimension = self.gpu.limits.max_compute_workgroups_per_dimension;
        let workgroups = threads
            .workgroups(kernel.workgroup, per_dimension)
            .ok_or_else(|| format!("{threads:?} needs more than {per_dimension} workgroups along an axis"))?;
        let storage: Vec<_> = storage.iter().filter_map(|b| b.raw().map(|raw| Raw::clone(raw))).collect();
        if storage.len() != kernel.storage.len() {
            return Err("a storage buffer comes from a recorder that failed".to_string());
        }
        let limit = self.gpu.max_binding_bytes();
        if let Some(raw) = storage.iter().find(|raw| raw.bytes > limit.max(EMPTY_BYTES)) {
            return Err(format!(
                "buffer {} of {} bytes exceeds the {limit} that one binding holds",
                raw.label, raw.bytes
            ));
        }
        if workgroups.contains(&0) {
            return Ok(None);
        }
        let alignment = self.gpu.limits.min_uniform_buffer_offset_alignment as usize;
        self.uniforms.resize(self.uniforms.len().next_multiple_of(alignment), 0);
        let at = self.uniforms.len() as u64;
        self.uniforms.extend_from_slice(params);
        Ok(Some(Command::Dispatch { kernel, params: (at, params.len() as u64), storage, workgroups }))
    }

    /// Records a copy of the buffer, as it is at this point of the commands, back to the host.
    pub fn read<T: Pod>(&mut self, buffer: &Buffer<T>) -> Pending<T> {
        let pending = Pending { recorder: self.id, index: self.reads, len: buffer.len, values: PhantomData };
        self.reads += 1;
        if self.error.is_some() {
            return pending;
        }
        let Some(from) = buffer.raw.clone() else {
            self.fail(self.label, "a buffer to be read comes from a recorder that failed".to_string());
            return pending;
        };
        match self.kept(from.label, from.bytes, READ_BACK) {
            Ok(to) => {
                self.bytes += to.size;
                self.commands.push(Command::Read { from: Raw::clone(&from), to });
            }
            Err(e) => self.error = Some(e),
        }
        pending
    }

    /// The kernels that an error can come from, for its message.
    fn kernels(&self) -> String {
        let mut stems = Vec::new();
        for command in &self.commands {
            if let Command::Dispatch { kernel, .. } = command
                && !stems.contains(&kernel.stem)
            {
                stems.push(kernel.stem);
            }
        }
        if stems.is_empty() { self.label.to_string() } else { stems.join("+") }
    }

    /// Runs all commands in one submission and waits for them.
    ///
    /// # Errors
    /// Returns the first error that was recorded, or an error if the adapter fails.
    pub fn submit(mut self) -> Result<Done> {
        if let Some(e) = self.error.take() {
            return Err(e);
        }
        let kernels = self.kernels();
        let gpu = self.gpu;
        let Encoded { commands, uniforms, mut staged, timing } = self.encode()?;
        let used = if gpu.profiler.is_some() { self.used() } else { Vec::new() };
        let mut reads: Vec<ReadBack> = Vec::with_capacity(self.reads);
        let mut dispatches = 0;
        // Buffers of commands go back to the arena when the device is done with them.
        let mut in_use = Vec::with_capacity(self.commands.len());
        for command in self.commands {
            match command {
                Command::Read { from, to } => {
                    Counters::add(&gpu.arena.counters.read_bytes, from.bytes);
                    reads.push(ReadBack { view: None, kept: Some(to), arena: gpu.arena.clone() });
                    in_use.push(from);
                }
                Command::Fill { to, fill } => {
                    in_use.push(to);
                    staged.extend(fill.staged());
                }
                Command::Dispatch { storage, .. } => {
                    dispatches += 1;
                    in_use.extend(storage);
                }
            }
        }
        for (raw, fill) in self.fills {
            in_use.push(raw);
            staged.extend(fill.staged());
        }
        let counters = &gpu.arena.counters;
        Counters::add(&counters.submits, 1);
        Counters::add(&counters.dispatches, dispatches);

        let busy = counters.begin();
        let start = Instant::now();
        let index = gpu.scoped(&kernels, || gpu.queue.submit([commands]))?;
        gpu.lose_if_asked();
        let refused = Arc::new(Mutex::new(None));
        // Those that the host writes are mapped again for the next time, once the device has read them.
        let writable: Vec<Arc<AtomicBool>> = staged.iter().map(|_| Arc::default()).collect();
        gpu.scoped(&kernels, || {
            for read in &reads {
                let refused = Arc::clone(&refused);
                let Some(kept) = &read.kept else { continue };
                kept.buffer.map_async(wgpu::MapMode::Read, .., move |result| {
                    if let (Err(e), Ok(mut refused)) = (result, refused.lock()) {
                        *refused = Some(e.to_string());
                    }
                });
            }
            if let Some(timing) = &timing {
                timing.map(Arc::clone(&refused));
            }
            for (kept, is_mapped) in staged.iter().zip(&writable) {
                let is_mapped = Arc::clone(is_mapped);
                kept.buffer.map_async(wgpu::MapMode::Write, .., move |result| {
                    is_mapped.store(result.is_ok(), Ordering::Release);
                });
            }
        })?;
        // wgpu panics when the device is lost while it waits.
        let waited = catch_unwind(AssertUnwindSafe(|| {
            gpu.device.poll(wgpu::PollType::Wait { submission_index: Some(index), timeout: None })
        }));
        let seconds = start.elapsed().as_secs_f64();
        drop(busy);
        gpu.check_sink(&kernels)?;
        match waited {
            Ok(Ok(_)) => {}
            // A submission that was accepted can be waited for, unless the device is lost, which its own notice may say later.
            Ok(Err(e)) => return Err(gpu.lost(&kernels, &e.to_string())),
            Err(_) => return Err(gpu.lost(&kernels, "while it was waited for")),
        }
        // Nor are its results refused otherwise: what is wrong with a buffer was told above.
        if let Some(e) = refused.lock().ok().and_then(|mut r| r.take()) {
            return Err(gpu.lost(&kernels, &format!("results cannot be read: {e}")));
        }
        for read in &mut reads {
            let Some(kept) = &read.kept else { continue };
            let view = kept
                .buffer
                .get_mapped_range(..)
                .map_err(|e| gpu.error(&kernels, format!("results cannot be read: {e}")))?;
            read.view = Some(view);
        }
        if let Some(profiler) = &gpu.profiler {
            let seconds = match &timing {
                None => Vec::new(),
                Some(timing) => timing
                    .seconds(gpu.queue.get_timestamp_period())
                    .map_err(|e| gpu.error(&kernels, format!("timestamps cannot be read: {e}")))?,
            };
            let seconds = seconds.into_iter().map(Some).chain(std::iter::repeat(None));
            profiler.add(used.into_iter().zip(seconds).map(|(used, seconds)| KernelUse { seconds, ..used }));
        }
        drop(in_use);
        gpu.arena.give(uniforms);
        for (kept, is_mapped) in staged.into_iter().zip(writable) {
            if is_mapped.load(Ordering::Acquire) {
                gpu.arena.give(kept);
            }
        }
        gpu.arena.trim();
        Ok(Done { recorder: self.id, reads, seconds })
    }

    /// What each dispatch does, in order, without its time.
    fn used(&self) -> Vec<KernelUse> {
        let of = |command: &Command| match command {
            Command::Read { .. } | Command::Fill { .. } => None,
            Command::Dispatch { kernel, params, storage, workgroups } => {
                let workgroups = workgroups.iter().map(|w| u64::from(*w)).product();
                let threads: u64 = kernel.workgroup.iter().map(|t| u64::from(*t)).product();
                Some(KernelUse {
                    kernel: kernel.stem,
                    dispatches: 1,
                    workgroups,
                    threads: workgroups * threads,
                    bound_bytes: params.1 + storage.iter().map(|raw| raw.bytes).sum::<u64>(),
                    seconds: None,
                })
            }
        };
        self.commands.iter().filter_map(of).collect()
    }

    fn encode(&self) -> Result<Encoded> {
        let gpu = self.gpu;
        let bytes = (self.uniforms.len() as u64).next_multiple_of(16).max(16);
        let uniforms = self.kept("params", bytes, UNIFORM)?;
        let mut staged = Vec::new();
        if !self.uniforms.is_empty() {
            staged.push(self.staged("params", &self.uniforms)?);
        }
        let kernels = self.commands.iter().filter_map(|command| match command {
            Command::Dispatch { kernel, .. } => Some(*kernel),
            Command::Read { .. } | Command::Fill { .. } => None,
        });
        gpu.prepare_submission(&kernels.collect::<Vec<_>>())?;
        // Pipelines and bind groups first, each in its own scope, so that an error names the kernel.
        let mut prepared = Vec::new();
        for command in &self.commands {
            let Command::Dispatch { kernel, params, storage, .. } = command else { continue };
            let pipeline = gpu.pipeline(kernel)?;
            let uniform = kernel.params.map(|_| (&uniforms, params.0, params.1));
            let buffers = storage.iter().filter_map(|raw| Some((raw.memory.kept.as_ref()?, 0, raw.bytes)));
            let bound: Vec<(&KeptBuffer, u64, u64)> = uniform.into_iter().chain(buffers).collect();
            let key: GroupKey =
                (kernel.stem, bound.iter().map(|(kept, offset, size)| [kept.id, *offset, *size]).collect());
            let first = u32::from(uniform.is_none());
            let group = gpu.arena.group(key, || {
                let entries: Vec<_> = bound
                    .iter()
                    .zip(first..)
                    .map(|((kept, offset, size), binding)| wgpu::BindGroupEntry {
                        binding,
                        resource: wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                            buffer: &kept.buffer,
                            offset: *offset,
                            size: std::num::NonZeroU64::new(*size),
                        }),
                    })
                    .collect();
                gpu.scoped(kernel.stem, || {
                    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                        label: Some(kernel.stem),
                        layout: &pipeline.layout,
                        entries: &entries,
                    })
                })
            })?;
            prepared.push((pipeline, group));
        }
        let is_timed = gpu.profiler.as_ref().is_some_and(|p| p.has_timestamps) && !prepared.is_empty();
        let timing = match is_timed {
            true => Some(gpu.scoped(&self.kernels(), || Timing::new(&gpu.device, prepared.len()))?),
            false => None,
        };
        if let Some(timing) = &timing {
            Counters::add(&gpu.arena.counters.query_sets, timing.sets());
        }
        let commands = gpu.scoped(&self.kernels(), || {
            let label = Some(self.label);
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label });
            if let Some(from) = staged.first() {
                let bytes = (self.uniforms.len() as u64).next_multiple_of(4);
                encoder.copy_buffer_to_buffer(&from.buffer, 0, &uniforms.buffer, 0, bytes);
            }
            for (to, fill) in &self.fills {
                fill.encode(&mut encoder, to);
            }
            let mut prepared = prepared.iter().enumerate();
            let mut first = 0;
            let mut commands = self.commands.iter().peekable();
            while let Some(command) = commands.next() {
                match command {
                    Command::Read { from, to } => {
                        if let Some(kept) = &from.memory.kept {
                            encoder.copy_buffer_to_buffer(&kept.buffer, 0, &to.buffer, 0, from.bytes);
                        }
                    }
                    Command::Fill { to, fill } => fill.encode(&mut encoder, to),
                    Command::Dispatch { workgroups, .. } => {
                        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                            label,
                            timestamp_writes: timing.as_ref().and_then(|t| t.writes(first)),
                        });
                        let mut workgroups = Some(workgroups);
                        while let Some([x, y, z]) = workgroups
                            && let Some((index, (pipeline, group))) = prepared.next()
                        {
                            pass.set_pipeline(&pipeline.pipeline);
                            pass.set_bind_group(0, group, &[]);
                            pass.dispatch_workgroups(*x, *y, *z);
                            first = index + 1;
                            workgroups = match commands.peek() {
                                // What is timed has a pass of its own.
                                Some(Command::Dispatch { workgroups, .. }) if timing.is_none() => {
                                    commands.next();
                                    Some(workgroups)
                                }
                                _ => None,
                            };
                        }
                    }
                }
            }
            if let Some(timing) = &timing {
                timing.resolve(&mut encoder);
            }
            encoder.finish()
        })?;
        Ok(Encoded { commands, uniforms, staged, timing })
    }
}

/// Commands ready for the device, and the buffers that are theirs alone.
struct Encoded {
    commands: wgpu::CommandBuffer,
    uniforms: KeptBuffer,
    /// Those that the host has written.
    staged: Vec<KeptBuffer>,
    /// None unless kernels are timed.
    timing: Option<Timing>,
}

/// A buffer that came back, and what it holds.
struct ReadBack {
    view: Option<wgpu::BufferView>,
    kept: Option<KeptBuffer>,
    arena: Arc<Arena>,
}

impl Drop for ReadBack {
    fn drop(&mut self) {
        // Only what was mapped was read by the device to its end; anything else is an error's and goes for good.
        if let (Some(view), Some(kept)) = (self.view.take(), self.kept.take()) {
            drop(view);
            kept.buffer.unmap();
            self.arena.give(kept);
        }
    }
}

/// The results of a submission that succeeded.
pub struct Done {
    recorder: u64,
    reads: Vec<ReadBack>,
    seconds: f64,
}

impl Done {
    /// The values read back, in the host's memory.
    ///
    /// # Panics
    /// If `pending` comes from another recorder.
    pub fn take<T: Pod>(&mut self, pending: Pending<T>) -> Vec<T> {
        assert_eq!(pending.recorder, self.recorder, "a Pending of another recorder");
        let mut values = vec![T::zeroed(); pending.len];
        if let Some(view) = &self.reads[pending.index].view {
            let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut values);
            let len = bytes.len();
            bytes.copy_from_slice(&view[..len]);
        }
        values
    }

    /// Host time from submission to completion, pipelines already built, read-backs included, in s.
    pub fn seconds(&self) -> f64 {
        self.seconds
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::compare::{is_poison, test_device_name, test_gpu};
    use crate::gpu::{Access, Gpu, Tolerance, Want};
    use crate::gpu_struct;

    gpu_struct! {
        struct ScaleParams { count: u32, scale: f32 }
    }

    const LINEAR: &str = include_str!("../../shaders/shared/linear.wgsl");
    const EXACT: Tolerance = Tolerance { relative_l2: 0.0, reason: "integers" };

    /// out[i] = scale * in[i] + i
    static SCALE: Kernel = Kernel {
        stem: "test/scale",
        sources: &[
            LINEAR,
            "struct ScaleParams { count: u32, scale: f32 }
            @group(0) @binding(0) var<uniform> params: ScaleParams;
            @group(0) @binding(1) var<storage, read> input: array<f32>;
            @group(0) @binding(2) var<storage, read_write> output: array<f32>;
            @compute @workgroup_size(64) fn main(@builtin(workgroup_id) wg: vec3<u32>,
                @builtin(num_workgroups) nwg: vec3<u32>, @builtin(local_invocation_index) li: u32) {
                let i = linear_id(wg, nwg, li, 64u);
                if i < params.count { output[i] = params.scale * input[i] + f32(i); }
            }",
        ],
        workgroup: [64, 1, 1],
        params: Some(ScaleParams::LAYOUT),
        storage: &[Access::Read, Access::ReadWrite],
        structs: &[],
        tolerance: EXACT,
    };

    /// counts[i] += 1, for Linear dispatches beyond one dimension
    static VISIT: Kernel = Kernel {
        stem: "test/visit",
        sources: &[
            LINEAR,
            "struct ScaleParams { count: u32, scale: f32 }
            @group(0) @binding(0) var<uniform> params: ScaleParams;
            @group(0) @binding(1) var<storage, read_write> counts: array<u32>;
            @compute @workgroup_size(1) fn main(@builtin(workgroup_id) wg: vec3<u32>,
                @builtin(num_workgroups) nwg: vec3<u32>, @builtin(local_invocation_index) li: u32) {
                let i = linear_id(wg, nwg, li, 1u);
                if i < params.count { counts[i] += 1u; }
            }",
        ],
        workgroup: [1, 1, 1],
        storage: &[Access::ReadWrite],
        params: Some(ScaleParams::LAYOUT),
        structs: &[],
        tolerance: EXACT,
    };

    #[test]
    fn a_chain_of_dispatches_sees_earlier_writes() {
        let gpu = test_gpu();
        let n = 1000;
        let input: Vec<f32> = (0..n).map(|i| i as f32).collect();
        let mut r = gpu.recorder("chain");
        let a = r.upload("a", &input);
        let b = r.buffer::<f32>("b", n);
        let c = r.zeros::<f32>("c", n + 8);
        let early = r.read(&c);
        r.dispatch(
            &SCALE,
            &ScaleParams { count: n as u32, scale: 2.0 },
            &[&a, &b],
            Threads::Linear(n as u64),
        );
        r.dispatch(
            &SCALE,
            &ScaleParams { count: n as u32 - 8, scale: -1.0 },
            &[&b, &c],
            Threads::Grid([n as u32, 1, 1]),
        );
        let (b, c) = (r.read(&b), r.read(&c));
        let mut done = r.submit().unwrap();
        assert!(done.seconds() > 0.0);
        assert_eq!(done.take(early), vec![0.0; n + 8]);
        assert_eq!(done.take(b), (0..n).map(|i| 3.0 * i as f32).collect::<Vec<_>>());
        let expected = (0..n + 8).map(|i| if i < n - 8 { -2.0 * i as f32 } else { 0.0 });
        assert_eq!(done.take(c), expected.collect::<Vec<_>>());
    }

    #[test]
    fn buffers_outlive_their_recorder_and_odd_sizes_come_back() {
        let gpu = test_gpu();
        let mut r = gpu.recorder("first");
        let bytes: Vec<u8> = (0..7).collect();
        let kept = r.upload("kept", &bytes);
        r.submit().unwrap();
        let mut r = gpu.recorder("second");
        let (pending, empty) = (r.read(&kept), r.upload::<[f32; 4]>("empty", &[]));
        let empty_read = r.read(&empty);
        let mut done = r.submit().unwrap();
        assert_eq!(done.take(pending), bytes);
        assert!(empty.is_empty() && done.take(empty_read).is_empty());
    }

    /// The same commands again take the same buffers and bind groups, zeros are zeros again, and nothing is allocated.
    #[test]
    fn commands_that_come_again_allocate_nothing() {
        let gpu = Gpu::open(Want::Named(&test_device_name())).unwrap();
        let run = |n: usize| {
            let before = gpu.counts();
            let mut r = gpu.recorder("again");
            let input = r.upload("input", &vec![2.0_f32; n]);
            let (output, counts) = (r.buffer::<f32>("output", n), r.zeros::<u32>("counts", n));
            let p = ScaleParams { count: n as u32, scale: 1.0 };
            r.dispatch(&SCALE, &p, &[&input, &output], Threads::Linear(n as u64));
            r.dispatch(&VISIT, &p, &[&counts], Threads::Linear(n as u64));
            let (output, counts) = (r.read(&output), r.read(&counts));
            let mut done = r.submit().unwrap();
            assert_eq!(done.take(counts), vec![1; n]);
            let expected: Vec<f32> = (0..n).map(|i| 2.0 + i as f32).collect();
            assert_eq!(done.take(output), expected);
            drop(done);
            gpu.counts().since(&before)
        };
        let first = run(1000);
        assert!(first.buffers > 5 && first.bind_groups == 2 && first.submits == 1 && first.dispatches == 2);
        assert_eq!(first.read_bytes, 8000);
        for _ in 0..3 {
            let again = run(1000);
            assert_eq!((again.buffers, again.bind_groups, again.submits), (0, 0, 1), "{again:?}");
            assert_eq!(again.read_bytes, first.read_bytes);
        }
        // A little more fits the same buffers; what is given up is made anew.
        assert_eq!(run(1010).buffers, 0);
        assert!(gpu.arena.idle_bytes() > 0);
        gpu.arena.clear();
        assert_eq!(gpu.arena.idle_bytes(), 0);
        assert!(run(1000).buffers >= first.buffers);
    }

    /// Without profiling no query is made. With it each kernel has its counts, and a time where the adapter has a clock, also
    /// where there are more dispatches than one query set times.
    #[test]
    fn profiles_count_and_time_each_kernel() {
        let n = 4096;
        let run = |gpu: &Gpu, times: usize| {
            let mut r = gpu.recorder("profile");
            let (a, b) = (r.upload("a", &vec![1.0_f32; n]), r.buffer::<f32>("b", n));
            let counts = r.zeros::<u32>("counts", n);
            let p = ScaleParams { count: n as u32, scale: 1.0 };
            for _ in 0..times {
                r.dispatch(&SCALE, &p, &[&a, &b], Threads::Linear(n as u64));
            }
            r.dispatch(&VISIT, &p, &[&counts], Threads::Linear(n as u64));
            let counts = r.read(&counts);
            let start = Instant::now();
            assert_eq!(r.submit().unwrap().take(counts), vec![1; n]);
            start.elapsed().as_secs_f64()
        };
        let gpu = Gpu::open(Want::Named(&test_device_name())).unwrap();
        run(&gpu, 2);
        assert!(gpu.profile().is_none());
        assert_eq!(gpu.counts().query_sets, 0);

        let gpu = gpu.with_profiling();
        for (times, sets) in [(2, 1), (4500, 3)] {
            let (before, counts) = (gpu.profile().unwrap(), gpu.counts());
            let wall_s = run(&gpu, times);
            let profile = gpu.profile().unwrap().since(&before);
            let [scale, visit] = profile.kernels[..] else { panic!("{profile:?}") };
            assert_eq!((scale.kernel, visit.kernel), ("test/scale", "test/visit"));
            let n = n as u64;
            let times = times as u64;
            assert_eq!((scale.dispatches, visit.dispatches), (times, 1));
            assert_eq!((scale.workgroups, scale.threads), (times * n / 64, times * n));
            assert_eq!((scale.bound_bytes, visit.bound_bytes), (times * (8 + 8 * n), 8 + 4 * n));
            let made = gpu.counts().since(&counts).query_sets;
            match gpu.report().timestamp {
                false => assert_eq!((profile.seconds(), scale.seconds, made), (None, None, 0)),
                true => {
                    let sum = profile.seconds().unwrap();
                    assert!(scale.seconds > Some(0.0) && visit.seconds > Some(0.0), "{profile:?}");
                    assert!(sum > 0.0 && sum <= wall_s, "{sum} s in {wall_s} s: {profile:?}");
                    assert_eq!(made, sets);
                }
            }
        }
    }

    /// Buffers that nobody holds any more give their memory to later ones of the same recorder, which begin as they should; those
    /// that are held keep theirs.
    #[test]
    fn dead_buffers_serve_later_commands() {
        let n = SMALL_FILL_BYTES as usize / 4;
        let gpu = test_gpu();
        let ones = vec![1.0_f32; n];
        let step = |r: &mut Recorder<'_>, scale: f32| {
            let input = r.upload("input", &ones);
            let between = r.buffer::<f32>("between", n);
            let sum = r.zeros::<f32>("sum", n);
            let params = ScaleParams { count: n as u32, scale };
            r.dispatch(&SCALE, &params, &[&input, &between], Threads::Linear(n as u64));
            // Half of the last one keeps its zeros.
            let params = ScaleParams { count: n as u32 / 2, scale: 1.0 };
            r.dispatch(&SCALE, &params, &[&between, &sum], Threads::Linear(n as u64 / 2));
            (sum.clone(), r.read(&sum))
        };
        let mut r = gpu.recorder("steps");
        let (held, first) = step(&mut r, 0.0);
        let of_one = r.bytes();
        let mut later = Vec::new();
        for k in 1..9 {
            let before = r.bytes();
            later.push(step(&mut r, k as f32).1);
            // What the host writes and reads, and once the memory of the buffer that is held.
            let own = if k == 1 { 3 } else { 2 };
            // With poison a buffer that nobody has written costs an upload.
            let poison = if gpu.poison() { 1 } else { 0 };
            assert_eq!(r.bytes() - before, (own + poison) * SMALL_FILL_BYTES, "{k}");
        }
        assert_eq!(r.bytes(), of_one + (8 * 2 + 1 + if gpu.poison() { 8 } else { 0 }) * SMALL_FILL_BYTES);
        let last = r.read(&held);
        let mut done = r.submit().unwrap();
        let expected = |k: f32| -> Vec<f32> {
            (0..n).map(|i| if i < n / 2 { k + 2.0 * i as f32 } else { 0.0 }).collect()
        };
        assert!(done.take(first) == expected(0.0) && done.take(last) == expected(0.0));
        for (k, sum) in (1..9).zip(later) {
            assert!(done.take(sum) == expected(k as f32), "{k}");
        }
    }

    #[test]
    fn unwritten_values_show() {
        let gpu = test_gpu();
        let mut r = gpu.recorder("poison");
        let (a, b) = (r.upload("a", &[1.0_f32; 64]), r.buffer::<f32>("b", 64));
        r.dispatch(&SCALE, &ScaleParams { count: 60, scale: 1.0 }, &[&a, &b], Threads::Linear(60));
        let b = r.read(&b);
        let b = r.submit().unwrap().take(b);
        assert!(b[..60].iter().all(|v| v.is_finite()) && b[60..].iter().all(is_poison));
    }

    #[test]
    fn linear_reaches_every_index_once() {
        let n = 65_535 * 3 + 7;
        let gpu = test_gpu();
        let mut r = gpu.recorder("linear");
        let counts = r.zeros::<u32>("counts", n);
        r.dispatch(
            &VISIT,
            &ScaleParams { count: n as u32, scale: 0.0 },
            &[&counts],
            Threads::Linear(n as u64),
        );
        r.dispatch(&VISIT, &ScaleParams { count: n as u32, scale: 0.0 }, &[&counts], Threads::Linear(0));
        let counts = r.read(&counts);
        assert_eq!(r.submit().unwrap().take(counts), vec![1; n]);
    }

    #[test]
    fn workgroup_counts() {
        let w = |t: Threads, size| t.workgroups(size, 65_535);
        assert_eq!(w(Threads::Linear(65), [64, 1, 1]), Some([2, 1, 1]));
        assert_eq!(w(Threads::Linear(65_536), [1, 1, 1]), Some([32_768, 2, 1]));
        assert_eq!(w(Threads::Linear(0), [64, 1, 1]), Some([0, 0, 1]));
        assert_eq!(w(Threads::Linear((1 << 32) + 1), [64, 1, 1]), None);
        assert_eq!(w(Threads::Grid([9, 8, 1]), [8, 8, 1]), Some([2, 1, 1]));
        assert_eq!(w(Threads::Workgroups([65_536, 1, 1]), [1, 1, 1]), None);
    }

    fn error_of(f: impl FnOnce(&mut Recorder<'_>)) -> String {
        let mut r = test_gpu().recorder("faulty");
        f(&mut r);
        let e = r.submit().err().expect("must fail");
        assert_eq!(e.exit_code(), 1);
        let text = e.to_string();
        assert!(text.contains(&test_gpu().report().name) && !text.contains('\n'), "{text}");
        text
    }

    #[test]
    fn faults_are_errors_that_name_the_kernel() {
        static BROKEN: Kernel =
            Kernel { stem: "test/broken", sources: &["fn main() { return 1; }"], ..SCALE };
        static LIES: Kernel = Kernel { stem: "test/lies", storage: &[Access::Read, Access::Read], ..SCALE };
        let p = ScaleParams { count: 4, scale: 1.0 };
        let four = Threads::Linear(4);
        for (kernel, name) in [(&BROKEN, "test/broken"), (&LIES, "test/lies")] {
            let text = error_of(|r| {
                let (a, b) = (r.zeros::<f32>("a", 4), r.zeros::<f32>("b", 4));
                r.dispatch(kernel, &p, &[&a, &b], four);
                r.dispatch(&SCALE, &p, &[&a, &b], four);
            });
            assert!(text.contains(name), "{text}");
        }
        // The same buffer read and written
        let text = error_of(|r| {
            let a = r.zeros::<f32>("a", 4);
            r.dispatch(&SCALE, &p, &[&a, &a], four);
        });
        assert!(text.contains("test/scale"), "{text}");
        let text = error_of(|r| {
            let a = r.zeros::<f32>("a", 4);
            r.dispatch(&SCALE, &p, &[&a], four);
        });
        assert!(text.contains("1 storage buffers given, 2 expected"), "{text}");
        let text = error_of(|r| {
            let a = r.zeros::<u32>("a", 4);
            r.dispatch(&VISIT, &1u32, &[&a], four);
        });
        assert!(text.contains("Params of 4 bytes given, 8 expected"), "{text}");
        let text = error_of(|r| drop(r.zeros::<u8>("huge", 1 << 50)));
        assert!(text.contains("buffer huge of 1125899906842624 bytes"), "{text}");
        // and the device goes on working
        let mut r = test_gpu().recorder("after");
        let a = r.upload("a", &[5u32]);
        let a = r.read(&a);
        assert_eq!(r.submit().unwrap().take(a), [5]);
    }

    #[test]
    fn binding_limit_is_enforced() {
        let gpu = Gpu::open(Want::Named(&test_device_name())).unwrap().with_binding_limit(1024);
        assert_eq!(gpu.max_binding_bytes(), 1024);
        for (len, good) in [(256, true), (257, false)] {
            let mut r = gpu.recorder("limit");
            let counts = r.zeros::<u32>("counts", len);
            r.dispatch(&VISIT, &ScaleParams { count: 4, scale: 0.0 }, &[&counts], Threads::Linear(4));
            let result = r.submit();
            assert_eq!(result.is_ok(), good);
            if let Err(e) = result {
                assert!(e.to_string().contains("counts of 1028 bytes exceeds the 1024"), "{e}");
            }
        }
    }
}
