//! Work and span of a computation: how many processors it can use, counted on any machine.
//!
//! The work is the time of all its parts, the span that of the longest chain of parts that wait for each other, so that it cannot take
//! less than its span on any number of processors, nor keep more than work / span of them busy (Brent 1974, doi 10.1145/321812.321815).
//! [`measured`] runs it on one thread, where nothing overlaps, and adds up both: what the operations of [`Tasks`] call may
//! run at the same time, everything else is a chain.

use crate::base::error::{Error, Result};
use rayon::iter::{FilterMap, Map, ParallelIterator};
use rayon::slice::ParallelSlice;
use std::cell::RefCell;
use std::sync::atomic::{AtomicU64, Ordering};
#[cfg(not(test))]
use std::{sync::LazyLock, time::Instant};
#[cfg(test)]
use tests::now_s;

/// Time of a computation, s.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize)]
pub struct WorkAndSpan {
    /// Time of all its parts.
    pub work_s: f64,
    /// Time of the longest chain of parts that wait for each other.
    pub span_s: f64,
}

impl WorkAndSpan {
    /// Number of processors that it can keep busy.
    pub fn parallelism(&self) -> f64 {
        self.work_s / self.span_s
    }

    /// Both after each other.
    pub fn then(&self, next: &WorkAndSpan) -> WorkAndSpan {
        WorkAndSpan { work_s: self.work_s + next.work_s, span_s: self.span_s + next.span_s }
    }
}

/// Time since some moment, s.
#[cfg(not(test))]
fn now_s() -> f64 {
    static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    START.elapsed().as_secs_f64()
}

/// What of a task has run so far, and since when it has been running.
struct Strand {
    done: WorkAndSpan,
    since_s: f64,
}

impl Strand {
    fn new() -> Strand {
        Strand { done: WorkAndSpan::default(), since_s: now_s() }
    }

    /// Adds what ran since the last mark.
    fn mark(&mut self) {
        let now = now_s();
        let s = now - self.since_s;
        self.done = self.done.then(&WorkAndSpan { work_s: s, span_s: s });
        self.since_s = now;
    }
}

thread_local! {
    /// The task that this thread measures. None where nothing is measured.
    static STRAND: RefCell<Option<Strand>> = const { RefCell::new(None) };
}

/// Runs `f` on one thread and measures its work and span.
///
/// # Errors
/// Returns the error of `f`, and one if the thread cannot be started.
pub fn measured<T: Send>(f: impl FnOnce() -> Result<T> + Send) -> Result<(T, WorkAndSpan)> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let pool = pool.map_err(|e| Error::Failed(format!("cannot start a thread: {e}")))?;
    pool.install(|| {
        STRAND.set(Some(Strand::new()));
        let out = f();
        let strand = STRAND.take();
        let mut strand =
            strand.ok_or_else(|| Error::Failed("the time measurement of a task was lost".into()))?;
        strand.mark();
        Ok((out?, strand.done))
    })
}

/// A place where a task divides into others; they are together again when it is dropped.
struct Fork {
    /// Span of the longest of them, ns; None where nothing is measured.
    longest_ns: Option<AtomicU64>,
}

impl Fork {
    #[inline]
    fn new() -> Fork {
        let is_measured = STRAND.with_borrow(Option::is_some);
        Fork { longest_ns: is_measured.then(AtomicU64::default) }
    }

    /// Runs one of the tasks.
    #[inline]
    fn run<T>(&self, task: impl FnOnce() -> T) -> T {
        // One call, so that it stands where it runs.
        let outer = if self.longest_ns.is_some() { Fork::begin() } else { None };
        let out = task();
        if let Some(longest_ns) = &self.longest_ns {
            Fork::end(longest_ns, outer);
        }
        out
    }

    /// Begins a task; returns the one around it.
    #[cold]
    fn begin() -> Option<Strand> {
        let mut outer = STRAND.replace(Some(Strand::new()));
        if let Some(outer) = &mut outer {
            outer.mark();
        }
        outer
    }

    /// Ends a task and goes on with the one around it.
    #[cold]
    fn end(longest_ns: &AtomicU64, mut outer: Option<Strand>) {
        if let (Some(mut own), Some(outer)) = (STRAND.take(), &mut outer) {
            own.mark();
            outer.done.work_s += own.done.work_s;
            outer.since_s = own.since_s;
            longest_ns.fetch_max((own.done.span_s * 1e9) as u64, Ordering::Relaxed);
        }
        STRAND.set(outer);
    }
}

impl Drop for Fork {
    fn drop(&mut self) {
        if let Some(longest_ns) = &mut self.longest_ns {
            let longest_s = *longest_ns.get_mut() as f64 * 1e-9;
            STRAND.with_borrow_mut(|strand| {
                if let Some(strand) = strand {
                    strand.done.span_s += longest_s;
                }
            });
        }
    }
}

/// Operations of rayon's iterators in which each item is a task of its own for [`measured`]: none waits for another. Elsewhere they are
/// rayon's.
pub trait Tasks: ParallelIterator {
    /// [`ParallelIterator::map`] by tasks.
    fn map_tasks<R: Send>(
        self,
        f: impl Fn(Self::Item) -> R + Send + Sync,
    ) -> Map<Self, impl Fn(Self::Item) -> R + Send + Sync> {
        let fork = Fork::new();
        self.map(move |x| fork.run(|| f(x)))
    }

    /// [`ParallelIterator::filter_map`] by tasks.
    fn filter_map_tasks<R: Send>(
        self,
        f: impl Fn(Self::Item) -> Option<R> + Send + Sync,
    ) -> FilterMap<Self, impl Fn(Self::Item) -> Option<R> + Send + Sync> {
        let fork = Fork::new();
        self.filter_map(move |x| fork.run(|| f(x)))
    }

    /// [`ParallelIterator::for_each`] by tasks.
    fn for_each_tasks(self, f: impl Fn(Self::Item) + Send + Sync) {
        let fork = Fork::new();
        self.for_each(|x| fork.run(|| f(x)));
    }

    /// [`ParallelIterator::for_each_init`] by tasks.
    fn for_each_init_tasks<T>(
        self,
        init: impl Fn() -> T + Send + Sync,
        f: impl Fn(&mut T, Self::Item) + Send + Sync,
    ) {
        let fork = Fork::new();
        self.for_each_init(init, |scratch, x| fork.run(|| f(scratch, x)));
    }

    /// [`ParallelIterator::map_init`] by tasks.
    fn map_init_tasks<T, R: Send>(
        self,
        init: impl Fn() -> T + Send + Sync,
        f: impl Fn(&mut T, Self::Item) -> R + Send + Sync,
    ) -> impl ParallelIterator<Item = R> {
        let fork = Fork::new();
        self.map_init(init, move |scratch, x| fork.run(|| f(scratch, x)))
    }
}

impl<I: ParallelIterator> Tasks for I {}

/// Items of which one task of [`in_parts`] takes care: what is done with each is too little for a task.
pub const PART: usize = 256;

/// `f` of each item, in their order, by tasks that take many of them.
pub fn in_parts<'a, X: Sync, R: Send>(list: &'a [X], f: impl Fn(&'a X) -> R + Send + Sync) -> Vec<R> {
    let parts: Vec<Vec<R>> = list.par_chunks(PART).map_tasks(|part| part.iter().map(&f).collect()).collect();
    let mut all = Vec::with_capacity(list.len());
    parts.into_iter().for_each(|part| all.extend(part));
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use rayon::prelude::*;
    use std::cell::Cell;

    thread_local! {
        /// Time of tests, ms, which work alone lets pass.
        static CLOCK_MS: Cell<u64> = const { Cell::new(0) };
    }

    pub fn now_s() -> f64 {
        CLOCK_MS.get() as f64 * 1e-3
    }

    fn work(ms: u64) {
        CLOCK_MS.set(CLOCK_MS.get() + ms);
    }

    fn assert_is(have_s: f64, want_ms: f64) {
        assert!((have_s - 1e-3 * want_ms).abs() < 1e-8, "{have_s} s, {want_ms} ms");
    }

    #[test]
    fn tasks_count_by_the_longest_of_them() {
        let nested = |ms: u64| {
            work(1);
            (0..3u64).into_par_iter().for_each_tasks(|_| work(ms));
        };
        let (list, cost) = measured(|| {
            work(2);
            let list: Vec<u64> = [4u64, 8, 2]
                .into_par_iter()
                .map_tasks(|ms| {
                    nested(ms);
                    ms
                })
                .collect();
            work(1);
            Ok(list)
        })
        .unwrap();
        assert_eq!(list, [4, 8, 2]);
        assert_is(cost.work_s, 2.0 + 3.0 + 3.0 * 14.0 + 1.0);
        assert_is(cost.span_s, 2.0 + (1.0 + 8.0) + 1.0);
        assert_is(1e-3 * cost.parallelism(), 48.0 / 12.0);
    }

    #[test]
    fn what_is_no_task_is_a_chain() {
        let (_, cost) = measured(|| {
            (0..4).into_par_iter().for_each(|_| work(2));
            Ok(())
        })
        .unwrap();
        assert_is(cost.span_s, 8.0);
        assert_is(cost.work_s, 8.0);
    }

    #[test]
    fn nothing_is_measured_otherwise() {
        let sum: u32 = (0..100u32).into_par_iter().map_tasks(|i| i).sum();
        let mut list = [0u32; 64];
        list.par_iter_mut().enumerate().for_each_init_tasks(Vec::new, |v, (i, x)| {
            v.push(1);
            *x = i as u32;
        });
        assert_eq!((sum, list[63]), (4950, 63));
        assert!(STRAND.with_borrow(Option::is_none));
    }

    #[test]
    fn parts_are_in_order() {
        let list: Vec<usize> = (0..3 * PART + 5).collect();
        assert_eq!(in_parts(&list, |i| i + 1), (1..=list.len()).collect::<Vec<_>>());
        assert!(in_parts(&[0; 0], |i: &i32| *i).is_empty());
    }

    #[test]
    fn errors_come_through() {
        let e = measured(|| Err::<(), _>(Error::Failed("none".into()))).unwrap_err();
        assert!(e.to_string().contains("none"));
    }
}
