//! What every command shares: the global options and how results are printed.

use super::bar::{Bar, Kept};
use catseye::base::error::{Error, Result};
use catseye::engine::{Engine, Precision, Purpose, Tracing};
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

pub const GLOBAL_HEADING: &str = "Global options";

/// Options of several commands, before or after the command's name. `ACTING` says which of them a command has.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = GLOBAL_HEADING)]
pub struct Global {
    /// Device. auto: a hardware GPU, else the CPU; cpu; gpu: a hardware GPU; or part of an adapter's name
    #[arg(long, global = true, default_value = "auto", value_name = "auto|cpu|gpu|NAME")]
    pub device: String,
    /// Precision of cube, FFT and detection on the CPU engine (geometry, phase and fields are always f64)
    #[arg(long, global = true, default_value = "f32", value_parser = choice(&[("f32", Precision::F32), ("f64", Precision::F64)]))]
    pub precision: Precision,
    /// Where the beams of frames are traced. device: on the GPU (default on a GPU); host: on the CPU in f64
    /// (always on the cpu device; faster than a software driver); lines: on the GPU, with lines in place of
    /// polygons (experimental)
    #[arg(long, global = true, value_parser = choice(&[("host", Tracing::Host), ("device", Tracing::Device), ("lines", Tracing::Lines)]))]
    pub trace: Option<Tracing>,
    /// Print one machine-readable JSON object on stdout, also on an error
    #[arg(long, global = true)]
    pub json: bool,
    /// Suppress progress and messages on stderr
    #[arg(long, global = true)]
    pub quiet: bool,
    /// Seed of all random numbers
    #[arg(long, global = true, value_name = "N")]
    pub seed: Option<u64>,
    /// Replace an existing result
    #[arg(long, global = true)]
    pub force: bool,
}

/// Reads an option that takes one of these words.
pub fn choice<T: Copy + Send + Sync>(
    words: &'static [(&'static str, T)],
) -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(words.iter().map(|(word, _)| *word))
        .map(|given| words[words.iter().position(|(word, _)| *word == given).unwrap_or(0)].1)
}

impl Global {
    pub fn engine(&self) -> Result<Engine> {
        Ok(self.engine_for(Purpose::General)?.0)
    }

    /// [`Global::engine_for`] of a purpose that is found out only where `auto` has a choice.
    pub fn engine_for_target(
        &self,
        purpose: impl FnOnce() -> Result<Purpose>,
    ) -> Result<(Engine, Option<&'static str>)> {
        match Engine::has_choice(&self.device, self.precision) {
            true => self.engine_for(purpose()?),
            false => self.engine_for(Purpose::General),
        }
    }

    /// The engine for some work, with the rule by which `auto` chose it where there was a choice.
    pub fn engine_for(&self, purpose: Purpose) -> Result<(Engine, Option<&'static str>)> {
        // Who says where beams are traced wants the engine that can.
        let is_traced = self.trace.is_some_and(|trace| trace != Tracing::Host);
        let purpose = if is_traced { Purpose::General } else { purpose };
        let (mut engine, rule) = Engine::open_for(&self.device, self.precision, purpose)?;
        if let Some(trace) = self.trace {
            engine = engine.with_tracing(trace)?;
        }
        self.say(&format!("engine: {}", engine.describe()));
        if let Some(rule) = rule {
            self.say(rule);
        }
        Ok((engine, rule))
    }

    /// A message for people, on stderr.
    pub fn say(&self, message: &str) {
        if !self.quiet {
            eprintln!("{message}");
        }
    }

    /// Progress on stderr, as a bar or as lines; `length` 0 where it is not known (yet).
    pub fn bar(&self, label: &str, length: u64, kept: Kept) -> Bar {
        Bar::new(label, length, kept, self.quiet)
    }

    /// Prints what a command found: the object with `--json`, else the text.
    pub fn answer(&self, object: &impl serde::Serialize, text: impl FnOnce() -> String) -> Result<()> {
        if self.json { print_json(object) } else { print(&text()) }
    }
}

/// Whether stdout has its object.
pub static PRINTED: AtomicBool = AtomicBool::new(false);

/// Prints a JSON object on stdout.
pub fn print_json(value: &impl serde::Serialize) -> Result<()> {
    let text = serde_json::to_string_pretty(value).map_err(|e| Error::Failed(format!("JSON: {e}")))?;
    PRINTED.store(true, Relaxed);
    print(&text)
}

/// Prints a line on stdout; a closed pipe is an `Error::Io` that ends the program quietly.
pub fn print(text: &str) -> Result<()> {
    use std::io::Write;
    writeln!(std::io::stdout(), "{text}").map_err(|e| Error::io("stdout", e))
}
