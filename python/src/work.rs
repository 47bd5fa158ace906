//! Long work beside the interpreter: it holds no lock of Python's, and Ctrl-C ends it.

use crate::errors::{Failed, raised};
use catseye::base::control::Control;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Interval at which signals are checked and progress is reported.
const POLL: Duration = Duration::from_millis(20);
/// What cancelled work has to end; later it ends by itself, and its result is dropped.
const GRACE: Duration = Duration::from_secs(1);
/// As of a main thread: descents through trees of a scene may be deep.
const STACK_BYTES: usize = 8 << 20;

/// What work and the one who waits for it share.
#[derive(Default)]
pub struct Watch {
    cancelled: AtomicBool,
    done: AtomicU64,
    all: AtomicU64,
}

/// What unwinds from work that cannot return early.
struct Cancelled;

impl Watch {
    /// Steps in all.
    pub fn expect(&self, all: u64) {
        self.all.store(all, Ordering::Relaxed);
    }

    pub fn set(&self, done: u64) {
        self.done.store(done, Ordering::Relaxed);
    }

    pub fn cancelled(&self) -> &AtomicBool {
        &self.cancelled
    }

    /// Counts progress; does not return when the work was cancelled.
    pub fn step(&self, n: u64) {
        self.done.fetch_add(n, Ordering::Relaxed);
        if self.cancelled.load(Ordering::Relaxed) {
            // Without the panic hook's message.
            resume_unwind(Box::new(Cancelled));
        }
    }

    pub fn control(&self) -> Control<'_> {
        Control { progress: None, cancel: Some(&self.cancelled) }
    }
}

/// The threads of this process. A fork leaves the parent's behind, so a child makes its own.
fn pool() -> PyResult<Arc<ThreadPool>> {
    static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);
    let mut pool = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    let here = std::process::id();
    if let Some((pid, pool)) = &*pool
        && *pid == here
    {
        return Ok(pool.clone());
    }
    let made = ThreadPoolBuilder::new()
        .stack_size(STACK_BYTES)
        .thread_name(|i| format!("catseye {i}"))
        .build()
        .map_err(|e| Failed::new_err(format!("threads: {e}")))?;
    let made = Arc::new(made);
    // A parent's pool has no threads here that could be asked to end.
    std::mem::forget(pool.replace((here, made.clone())));
    Ok(made)
}

/// What becomes of work that was cancelled.
#[derive(Clone, Copy, PartialEq)]
pub enum Afterwards {
    /// It may end by itself later, and its result is dropped.
    LeftAlone,
    /// It leaves files, so that its end is waited for (a second Ctrl-C does not).
    Awaited,
}

/// Does `f` on the pool's threads while Python goes on. `progress` is called with the number of steps done and how many there
/// are, on the calling thread.
///
/// Errors: what `f` says; what a signal handler or `progress` raises, which cancels the work.
pub fn run<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    f: impl FnOnce(&Watch) -> catseye::Result<T> + Send + 'static,
) -> PyResult<T> {
    run_to(py, progress, Afterwards::LeftAlone, f)
}

/// [`run`] of work that is cancelled in another way.
pub fn run_to<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    afterwards: Afterwards,
    f: impl FnOnce(&Watch) -> catseye::Result<T> + Send + 'static,
) -> PyResult<T> {
    let watch = Arc::new(Watch::default());
    let (sender, mut receiver) = channel();
    let seen = watch.clone();
    pool()?.spawn(move || {
        // Nobody listens to a cancelled one.
        let _ = sender.send(catch_unwind(AssertUnwindSafe(|| f(&seen))));
    });
    let mut told = 0;
    let mut tell = |watch: &Watch| -> PyResult<()> {
        let done = watch.done.load(Ordering::Relaxed);
        match progress {
            Some(call) if done != told => {
                told = done;
                call.call1((done, watch.all.load(Ordering::Relaxed))).map(drop)
            }
            _ => Ok(()),
        }
    };
    let wait = |receiver: Receiver<_>, time| {
        py.detach(move || {
            let got = receiver.recv_timeout(time);
            (receiver, got)
        })
    };
    loop {
        let got;
        (receiver, got) = wait(receiver, POLL);
        match got {
            Ok(Ok(result)) => {
                let result = result.map_err(|e| raised(py, e))?;
                tell(&watch)?;
                return Ok(result);
            }
            Ok(Err(_)) | Err(RecvTimeoutError::Disconnected) => {
                return Err(Failed::new_err("internal error: a thread panicked; its message is on stderr"));
            }
            Err(RecvTimeoutError::Timeout) => {
                let Err(e) = py.check_signals().and_then(|()| tell(&watch)) else { continue };
                watch.cancelled.store(true, Ordering::Relaxed);
                let mut again = wait(receiver, GRACE);
                while afterwards == Afterwards::Awaited
                    && again.1.as_ref().is_err_and(|e| *e == RecvTimeoutError::Timeout)
                    && py.check_signals().is_ok()
                {
                    again = wait(again.0, POLL);
                }
                return Err(e);
            }
        }
    }
}
