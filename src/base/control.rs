//! Watching and stopping long work.

use std::sync::atomic::AtomicBool;

/// How a caller watches a long piece of work, and stops it.
#[derive(Default, Clone, Copy)]
pub struct Control<'a> {
    /// Called with (parts done, parts in all), from any thread. The work says what a part is.
    pub progress: Option<&'a (dyn Fn(u64, u64) + Sync)>,
    /// When it is set, the work ends with an error at the next part.
    pub cancel: Option<&'a AtomicBool>,
}
