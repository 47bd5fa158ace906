//! What the machine has: memory that work may take, and threads.

use crate::base::error::BadInput;
use std::path::Path;
use std::sync::mpsc::{Sender, channel};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Gibibytes that may be used, in place of what the system says.
pub const MEMORY_VARIABLE: &str = "CATSEYE_MEMORY_GIB";
/// Time for which an answer of the system's stands.
const ANSWER_HOLDS: Duration = Duration::from_millis(50);
const GIB: f64 = (1u64 << 30) as f64;

/// Bytes that this process can still take: the least of the system's free memory and swap, the limits of its control groups
/// and the limits of its address space and data. `CATSEYE_MEMORY_GIB` stands in place of all of them. None where neither is
/// known (not Linux).
pub fn available_bytes() -> Option<u64> {
    if let Some(gib) = std::env::var(MEMORY_VARIABLE).ok().and_then(|v| v.trim().parse::<f64>().ok()) {
        return Some((gib.max(0.0) * GIB) as u64);
    }
    let asked = || [free_bytes(), group_bytes(), limit_bytes()].into_iter().flatten().min();
    // A browser's page has no clock.
    if cfg!(target_family = "wasm") {
        return asked();
    }
    // Each answer reads a dozen files, and frames of a dataset ask a thousand times a second.
    static LAST: Mutex<Option<(Instant, Option<u64>)>> = Mutex::new(None);
    let mut last = LAST.lock().unwrap_or_else(PoisonError::into_inner);
    match *last {
        Some((when, bytes)) if when.elapsed() < ANSWER_HOLDS => bytes,
        _ => {
            let bytes = asked();
            *last = Some((Instant::now(), bytes));
            bytes
        }
    }
}

/// The number behind `key` in a file of the kernel's, times 1024.
fn kibibytes(path: &str, key: &str) -> Option<u64> {
    let text = std::fs::read_to_string(path).ok()?;
    let line = text.lines().find_map(|l| l.strip_prefix(key))?;
    Some(line.split_whitespace().next()?.parse::<u64>().ok()? << 10)
}

fn free_bytes() -> Option<u64> {
    let swap = kibibytes("/proc/meminfo", "SwapFree:").unwrap_or(0);
    kibibytes("/proc/meminfo", "MemAvailable:").map(|free| free + swap)
}

/// What the control groups of this process leave, of version 2 (each on the way to the root) and of version 1.
fn group_bytes() -> Option<u64> {
    let groups = std::fs::read_to_string("/proc/self/cgroup").ok()?;
    let mut least = None;
    for line in groups.lines() {
        let mut fields = line.splitn(3, ':').skip(1);
        let (controllers, path) = (fields.next()?, fields.next()?);
        let (root, limit, used) = match controllers {
            "" => ("/sys/fs/cgroup", "memory.max", "memory.current"),
            c if c.split(',').any(|c| c == "memory") => {
                ("/sys/fs/cgroup/memory", "memory.limit_in_bytes", "memory.usage_in_bytes")
            }
            _ => continue,
        };
        let own = Path::new(root).join(path.trim_start_matches('/'));
        for folder in own.ancestors().take_while(|f| f.starts_with(root)) {
            let number = |name: &str| -> Option<u64> {
                std::fs::read_to_string(folder.join(name)).ok()?.trim().parse().ok()
            };
            let Some(limit) = number(limit) else { continue };
            // Pages of files that the kernel gives up when memory is short.
            let stat = std::fs::read_to_string(folder.join("memory.stat")).unwrap_or_default();
            let cache = ["inactive_file ", "active_file "].iter().filter_map(|key| {
                stat.lines().find_map(|l| l.strip_prefix(key)).and_then(|n| n.trim().parse::<u64>().ok())
            });
            let used = number(used).unwrap_or(0).saturating_sub(cache.sum());
            let left = limit.saturating_sub(used);
            least = Some(least.map_or(left, |l: u64| l.min(left)));
        }
    }
    least
}

/// Limits of the process, as `ulimit` sets and the kernel names them, and what is used of them.
const LIMITS: [(&str, &str, &str); 2] =
    [("ulimit -v", "Max address space", "VmSize:"), ("ulimit -d", "Max data size", "VmData:")];

/// Those that are set, with what is used: (name, bytes, bytes).
fn limits() -> Vec<(&'static str, u64, u64)> {
    let text = std::fs::read_to_string("/proc/self/limits").unwrap_or_default();
    let of = |(name, key, used): (&'static str, &str, &str)| {
        let soft = text.lines().find_map(|l| l.strip_prefix(key))?.split_whitespace().next()?;
        Some((name, soft.parse().ok()?, kibibytes("/proc/self/status", used).unwrap_or(0)))
    };
    LIMITS.into_iter().filter_map(of).collect()
}

/// What `ulimit -v` and `ulimit -d` leave.
fn limit_bytes() -> Option<u64> {
    limits().iter().map(|(_, limit, used)| limit.saturating_sub(*used)).min()
}

/// What the program takes of its address space before it works, and with each thread: the allocator reserves room that is
/// never written.
const LEAST_GIB: f64 = 1.0;
const THREAD_GIB: f64 = 0.125;

/// Checks the process's limits of memory.
///
/// # Errors
/// Returns an error if the process has limits under which any work may run out of memory halfway, without a message.
pub fn check_limits() -> Result<(), Box<BadInput>> {
    let least = GIB * (LEAST_GIB + THREAD_GIB * rayon::current_num_threads() as f64);
    match limits().into_iter().find(|(_, limit, _)| (*limit as f64) < least) {
        Some((name, limit, _)) => Err(BadInput::new("leaves too little memory to work in")
            .key(name)
            .value(format!("{} KiB", limit / 1024))
            .allowed(format!("from {} KiB", (least / 1024.0).ceil()))
            .remedy("raise the limit, or use one thread (RAYON_NUM_THREADS=1)")
            .into()),
        None => Ok(()),
    }
}

/// Formats a number of bytes for people.
pub fn sized(bytes: f64) -> String {
    match bytes / GIB {
        gib if gib >= 0.1 => format!("{gib:.1} GiB"),
        gib => format!("{:.1} MiB", gib * 1024.0),
    }
}

/// Refuses work that needs more memory than the machine has. The caller adds the key that asks for it.
///
/// # Errors
/// Returns an error if `bytes` is more than [`available_bytes`]; `what` needs them.
pub fn require(bytes: f64, what: &str) -> Result<(), Box<BadInput>> {
    match available_bytes() {
        Some(there) if bytes > there as f64 => {
            Err(BadInput::new(format!("{what} need {} of memory", sized(bytes)))
                .allowed(format!("up to {}, which is free here", sized(there as f64)))
                .remedy(format!("ask for less, or free memory; {MEMORY_VARIABLE}=N lets N GiB be used"))
                .into())
        }
        _ => Ok(()),
    }
}

/// Most threads for each core, and most where there are few cores.
const PER_CORE: usize = 4;
const FEW_CORES: usize = 64;

/// Makes the threads on which all work is shared: as many as there are cores, or as RAYON_NUM_THREADS says, up to a bound. Where
/// the system lets fewer begin, these share the work, and where it lets none begin the calling thread does it all. Gives a remark
/// where it is not what was asked for. Only the first call in a process does anything.
pub fn start_threads() -> Option<String> {
    let cores = std::thread::available_parallelism().map_or(1, |n| n.get());
    let most = (PER_CORE * cores).max(FEW_CORES);
    let asked = std::env::var("RAYON_NUM_THREADS").ok().filter(|text| !text.is_empty());
    let (wanted, mut remark) = match asked.as_deref().map(|text| (text, text.trim().parse::<usize>())) {
        None | Some((_, Ok(0))) => (cores, None),
        Some((_, Ok(n))) if n <= most => (n, None),
        Some((text, Ok(_))) => {
            let why = format!(
                "RAYON_NUM_THREADS = {text}: {most} threads are used, at most {PER_CORE} for each core"
            );
            (most, Some(why))
        }
        Some((text, Err(_))) => {
            let why = format!("RAYON_NUM_THREADS = {text}: is not a number; {cores} threads are used");
            (cores, Some(why))
        }
    };
    // Threads begin first and are told what they are afterwards: a pool that fails halfway cannot be made again.
    let mut waiting: Vec<Sender<rayon::ThreadBuilder>> = Vec::with_capacity(wanted);
    for _ in 0..wanted {
        let (to, from) = channel::<rayon::ThreadBuilder>();
        let work = move || {
            if let Ok(thread) = from.recv() {
                thread.run();
            }
        };
        match std::thread::Builder::new().spawn(work) {
            Ok(_) => waiting.push(to),
            Err(_) => break,
        }
    }
    if waiting.len() < wanted {
        // Some are left to what else begins one: writers, drivers of adapters.
        let begun = waiting.len();
        waiting.truncate(begun - (begun / 4).max(2).min(begun));
        let shown = waiting.len().max(1);
        remark = Some(format!("only {begun} of {wanted} threads could be started: {shown} share the work"));
    }
    let pool = rayon::ThreadPoolBuilder::new();
    let made = if waiting.is_empty() {
        pool.num_threads(1).use_current_thread().build_global()
    } else {
        let threads = waiting.len();
        let tell = |thread| {
            let to = waiting.pop().ok_or_else(|| std::io::Error::other("no thread is available"))?;
            to.send(thread).map_err(|_| std::io::Error::other("the thread has ended"))
        };
        pool.num_threads(threads).spawn_handler(tell).build_global()
    };
    // A pool that is there already serves as well.
    made.ok().and(remark)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_and_refusals() {
        assert_eq!(sized(1.5 * GIB), "1.5 GiB");
        assert_eq!(sized(1024.0 * 1024.0), "1.0 MiB");
        assert!(require(0.0, "nothing").is_ok());
        if let Some(there) = available_bytes() {
            assert!(there > 0);
            let e = require(1e18, "samples").unwrap_err().to_string();
            assert!(e.starts_with("samples need 931322574.6 GiB of memory; allowed: up to "), "{e}");
        }
    }
}
