//! Progress of a command: a bar on a terminal, lines elsewhere; and what Ctrl-C says.

use catseye::base::error::{Error, Result};
use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use std::fmt::Write;
use std::ops::Deref;
use std::process::exit;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, LazyLock, Mutex, MutexGuard};
use std::thread::{Builder, JoinHandle, sleep};
use std::time::{Duration, Instant};

/// Exit code of a program that was interrupted (128 + SIGINT).
pub const INTERRUPTED: i32 = 130;
/// How often a bar is drawn anew, and how often somebody looks whether the user wants an end.
const TICK: Duration = Duration::from_millis(200);
/// When lines are said without a terminal, s after the start; then every `LINES_APART_S`.
const LINES_S: [u64; 4] = [2, 5, 10, 20];
const LINES_APART_S: u64 = 30;
/// No estimate before so much time has passed, s.
const FIRST_ESTIMATE_S: f64 = 0.5;

fn lock<T>(m: &Mutex<T>) -> MutexGuard<'_, T> {
    m.lock().unwrap_or_else(|e| e.into_inner())
}

/// What an interruption leaves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kept {
    /// The same command begins anew.
    Nothing,
    /// Finished parts, whatever the bar counts.
    Parts,
    /// All that the bar counts.
    All,
    /// The command looks at [`cancel`], ends at a safe point and says what is kept.
    Itself,
}

/// Progress of one command.
pub struct Bar {
    bar: ProgressBar,
    estimate: Arc<Mutex<Estimate>>,
    /// Set at the end, for who says the lines.
    ended: Arc<(Mutex<bool>, Condvar)>,
    lines: Option<JoinHandle<()>>,
}

impl Bar {
    /// `length` 0: it is not known, or not yet. A quiet one shows nothing.
    pub fn new(label: &str, length: u64, kept: Kept, quiet: bool) -> Bar {
        let bar = if quiet { ProgressBar::hidden() } else { ProgressBar::new(length) };
        let estimate = Arc::new(Mutex::new(Estimate::new(Instant::now())));
        let ended = Arc::new((Mutex::new(false), Condvar::new()));
        bar.set_message(label.to_string());
        let mut made = Bar { bar, estimate, ended, lines: None };
        made.set_length(length);
        if !quiet && made.bar.is_hidden() {
            let (bar, estimate, ended) = (made.bar.clone(), made.estimate.clone(), made.ended.clone());
            // Where no thread can begin the work goes on without a word.
            made.lines = small().spawn(move || say_lines(&bar, &estimate, &ended)).ok();
        } else if !quiet {
            made.bar.enable_steady_tick(TICK);
        }
        *lock(&AT_WORK) = Some((made.bar.clone(), kept));
        made
    }

    /// How much there is to do in all.
    pub fn set_length(&self, length: u64) {
        if self.bar.length() == Some(length) && length > 0 {
            return;
        }
        if self.bar.length() == Some(0) {
            // What was done before anybody knew how much there is, such as preparing, tells nothing about the rest.
            let mut estimate = lock(&self.estimate);
            *estimate = Estimate { found: estimate.found, ..Estimate::new(Instant::now()) };
        }
        self.bar.set_length(length);
        let estimate = self.estimate.clone();
        let left = move |s: &ProgressState, out: &mut dyn Write| {
            let left = lock(&estimate).left_s(s.pos(), s.len().unwrap_or(0), Instant::now());
            let _ = out.write_str(&left.map_or("...".into(), |s| words(s.round())));
        };
        let template = match length {
            0 => "{spinner} {msg} {elapsed}",
            _ => "{msg} {bar:30} {pos}/{len} {elapsed} (left {left})",
        };
        let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
        self.bar.set_style(style.with_key("left", left));
    }

    /// So many of those that are done took no time: they were found complete.
    pub fn found(&self, n: u64) {
        lock(&self.estimate).found = n;
    }
}

impl Deref for Bar {
    type Target = ProgressBar;
    fn deref(&self) -> &ProgressBar {
        &self.bar
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
        let mut at_work = lock(&AT_WORK);
        // A command that was asked to end and says itself what is kept must not be overtaken by who watches.
        if !(cancel().load(Ordering::Relaxed) && matches!(*at_work, Some((_, Kept::Itself)))) {
            *at_work = None;
        }
        drop(at_work);
        *lock(&self.ended.0) = true;
        self.ended.1.notify_all();
        if let Some(lines) = self.lines.take() {
            let _ = lines.join();
        }
    }
}

fn say_lines(bar: &ProgressBar, estimate: &Mutex<Estimate>, ended: &(Mutex<bool>, Condvar)) {
    let start = Instant::now();
    let mut next = 0;
    let mut over = lock(&ended.0);
    loop {
        // Woken often, so that the estimate sees when each part was done.
        over = ended.1.wait_timeout(over, TICK).unwrap_or_else(|e| e.into_inner()).0;
        if *over {
            return;
        }
        let (pos, all, now) = (bar.position(), bar.length().unwrap_or(0), Instant::now());
        let left = lock(estimate).left_s(pos, all, now);
        let due = match LINES_S.get(next) {
            Some(s) => *s,
            None => LINES_S[LINES_S.len() - 1] + (next + 1 - LINES_S.len()) as u64 * LINES_APART_S,
        };
        if now.duration_since(start) < Duration::from_secs(due) {
            continue;
        }
        next += 1;
        // What comes after the last part has no estimate, and one that has run out says nothing.
        let left = match left.map(f64::round) {
            _ if all > 0 && pos >= all => ", finishing".into(),
            Some(s) if s >= 1.0 => format!(", {} left", words(s)),
            _ => String::new(),
        };
        let after = words(now.duration_since(start).as_secs_f64().round());
        eprintln!(
            "{}",
            match all {
                0 => format!("{}: at work for {after}", bar.message()),
                _ => format!("{}: {pos} of {all} after {after}{left}", bar.message()),
            }
        );
    }
}

/// Seconds as people say them.
fn words(s: f64) -> String {
    match s as u64 {
        s @ 0..=119 => format!("{s} s"),
        s @ 120..=7199 => format!("{} min", (s + 30) / 60),
        s => format!("{:.1} h", s as f64 / 3600.0),
    }
}

/// How long the rest will take, from what was done, without jumps.
struct Estimate {
    start: Instant,
    /// Parts that are done, when the last of them was, and how many of them took no time.
    done: u64,
    last: Instant,
    found: u64,
    /// The longest time between two advances, s.
    longest_s: f64,
    /// What was said last, s, and when.
    said: Option<(f64, Instant)>,
}

impl Estimate {
    fn new(now: Instant) -> Estimate {
        Estimate { start: now, done: 0, last: now, found: 0, longest_s: 0.0, said: None }
    }

    /// None as long as nothing is known.
    fn left_s(&mut self, done: u64, all: u64, now: Instant) -> Option<f64> {
        if done < self.done {
            // Another row of parts.
            *self = Estimate::new(now);
        }
        if done != self.done {
            self.longest_s = self.longest_s.max(now.duration_since(self.last).as_secs_f64());
            (self.done, self.last) = (done, now);
        }
        let elapsed_s = now.duration_since(self.start).as_secs_f64();
        let worked = done.saturating_sub(self.found);
        if worked == 0 || elapsed_s < FIRST_ESTIMATE_S {
            return None;
        }
        let each_s = self.last.duration_since(self.start).as_secs_f64() / worked as f64;
        let since_s = now.duration_since(self.last).as_secs_f64();
        let rest = all.saturating_sub(done) as f64;
        let new_s = match since_s > 1.5 * self.longest_s {
            // It goes slower than it did.
            true => rest * elapsed_s / worked as f64,
            false => (rest * each_s - since_s).max(0.0),
        };
        // Workers end their parts together: what was said moves towards the new value, the slower the longer it runs.
        let left_s = match self.said {
            None => new_s,
            Some((said_s, at)) => {
                let dt_s = now.duration_since(at).as_secs_f64();
                let counted_s = (said_s - dt_s).max(0.0);
                counted_s + (new_s - counted_s) * (1.0 - (-dt_s / (0.5 + 0.1 * elapsed_s)).exp())
            }
        };
        self.said = Some((left_s, now));
        Some(left_s)
    }
}

/// The bar of the command at work.
static AT_WORK: Mutex<Option<(ProgressBar, Kept)>> = Mutex::new(None);
static ASKED: LazyLock<Arc<AtomicBool>> = LazyLock::new(Default::default);

/// Set once the user wants an end.
pub fn cancel() -> &'static AtomicBool {
    &ASKED
}

/// From now on Ctrl-C and SIGTERM say what is kept and end the program; given twice, at once. A file over the limit of file sizes is an
/// error of writing like a full disk. Errors: the system refuses.
pub fn watch() -> Result<()> {
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        let flag = || ASKED.clone();
        signal_hook::flag::register_conditional_shutdown(signal, INTERRUPTED, flag())
            .and_then(|_| signal_hook::flag::register(signal, flag()))
            .map_err(|e| Error::Failed(format!("signals: {e}")))?;
    }
    // Without somebody who takes it, the signal of a file that outgrows `ulimit -f` ends the program without a word. When it is taken, the
    // write fails, and whoever wrote says which file it was.
    #[cfg(unix)]
    signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::new(AtomicBool::new(false)))
        .map_err(|e| Error::Failed(format!("signals: {e}")))?;
    let watching = small().spawn(|| {
        while !cancel().load(Ordering::Relaxed) {
            sleep(TICK / 4);
        }
        let at_work = lock(&AT_WORK).clone();
        let said = match at_work {
            None => "interrupted; the same command starts again from the beginning".to_string(),
            Some((bar, Kept::Itself)) => {
                return bar.suspend(|| eprintln!("stopping at a safe point; press Ctrl-C again to stop at once"));
            }
            Some((bar, kept)) => {
                let (pos, all, label) = (bar.position(), bar.length().unwrap_or(0), bar.message());
                bar.finish_and_clear();
                match kept {
                    Kept::All => {
                        format!("interrupted: {pos} of {all} {label} are complete; the same command continues")
                    }
                    Kept::Parts => {
                        format!(
                            "interrupted at {pos} of {all} ({label}): finished parts are kept; the same command continues"
                        )
                    }
                    _ if all == 0 => {
                        format!("interrupted ({label}): nothing is kept; the same command starts again from the beginning")
                    }
                    _ => format!(
                        "interrupted at {pos} of {all} {label}: nothing is kept; the same command starts again from the beginning"
                    ),
                }
            }
        };
        eprintln!("{said}");
        #[expect(
            clippy::disallowed_methods,
            reason = "the command itself cannot be told, and keeps nothing that is open"
        )]
        exit(INTERRUPTED);
    });
    watching.map(|_| ()).map_err(|e| {
        Error::Failed(format!(
            "cannot start the thread that waits for Ctrl-C: {e}; raise the limits of threads (ulimit -u) and \
                of memory (ulimit -v)"
        ))
    })
}

/// A thread that says lines needs little.
fn small() -> Builder {
    Builder::new().stack_size(256 << 10)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sixteen workers that end together each 1.6 s: 100 parts take 11.2 s. From the first on the estimate stays near the
    /// truth and never jumps.
    #[test]
    fn estimates_do_not_jump() {
        let start = Instant::now();
        let mut e = Estimate::new(start);
        let mut before: Option<(f64, f64)> = None;
        for tick in 0..110 {
            let t_s = 0.1 * f64::from(tick);
            let done = (16 * (t_s / 1.6) as u64).min(100);
            let left = e.left_s(done, 100, start + Duration::from_secs_f64(t_s));
            assert_eq!(left.is_some(), t_s >= 1.6, "{t_s}");
            let Some(left) = left else { continue };
            assert!((left - (10.0 - t_s)).abs() < 1.7, "{left} s left after {t_s}");
            if let Some((old, at)) = before {
                assert!((left - (old - (t_s - at))).abs() < 0.4, "{old} to {left}");
            }
            before = Some((left, t_s));
        }
        // Parts that take longer than those before: the rest is never said to be over while nothing advances.
        let mut e = Estimate::new(start);
        for s in 1..=80 {
            e.left_s(s, 180, start + Duration::from_secs(s));
        }
        let mut left = 0.0;
        for s in 81..=1000 {
            left = e.left_s(80, 180, start + Duration::from_secs(s)).unwrap();
            assert!(left > 60.0, "{left} s left after {s} s");
        }
        assert!((900.0..1300.0).contains(&left), "{left}");
        // What was found complete tells nothing about the rest.
        let mut e = Estimate::new(start);
        e.found = 40;
        assert_eq!(e.left_s(40, 100, start + Duration::from_secs(1)), None);
        let left = e.left_s(42, 100, start + Duration::from_secs(2)).unwrap();
        assert!((left - 58.0).abs() < 1e-9, "{left}");
    }

    /// A comparison of lane methods prepares them for a minute before its first look of 1 s: 39 looks take 39 s, not 40 minutes.
    #[test]
    fn preparing_is_not_counted_as_the_first_part() {
        let bar = Bar::new("looks", 0, Kept::Parts, true);
        let minute = Duration::from_secs(60);
        lock(&bar.estimate).start -= minute;
        lock(&bar.estimate).last -= minute;
        bar.set_length(40);
        let left = lock(&bar.estimate).left_s(1, 40, Instant::now() + Duration::from_secs(1)).unwrap();
        assert!((left - 39.0).abs() < 1.0, "{left}");
    }
}
