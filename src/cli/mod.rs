//! The command line: one file per subcommand. Parses, calls the library, prints; no physics.

mod angles;
mod bar;
mod bench;
mod calibrate;
mod convert;
mod cube_args;
mod dataset;
mod demo;
mod devices;
mod export;
mod footprint;
mod frames;
mod init;
mod lane;
mod plot;
mod process;
mod rcs;
mod reflector;
mod scene;
mod simulate;
mod study;
mod target;
mod validate;
mod verify;

pub use frames::draw_frame;

use bar::{Bar, Kept};

use crate::engine::{Engine, Precision};
use crate::error::{BadInput, Error, Result};
use clap::{Args, Parser, Subcommand, ValueEnum};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// Automotive-radar simulator: glTF road scenes to radar cross sections, ADC cubes, detections and points.
#[derive(Debug, Parser)]
#[command(name = "catseye", version, max_term_width = 110)]
struct Cli {
    #[command(flatten)]
    global: Global,
    #[command(subcommand)]
    command: Command,
}

/// Options of every command.
#[derive(Debug, Clone, Args)]
pub struct Global {
    /// auto: a hardware GPU, else the cpu; cpu; gpu: a hardware GPU; or part of an adapter's name
    #[arg(long, global = true, default_value = "auto", value_name = "auto|cpu|gpu|NAME")]
    pub device: String,
    /// Of cube, FFT and detection on the cpu engine (geometry, phase and fields are always f64)
    #[arg(long, global = true, default_value = "f32")]
    pub precision: PrecisionName,
    /// Print one machine-readable object on stdout
    #[arg(long, global = true)]
    pub json: bool,
    /// No progress and no messages on stderr
    #[arg(long, global = true)]
    pub quiet: bool,
    /// Seed of all random numbers
    #[arg(long, global = true, value_name = "N")]
    pub seed: Option<u64>,
    /// Replace an existing result
    #[arg(long, global = true)]
    pub force: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum PrecisionName {
    F32,
    F64,
}

impl Global {
    pub fn engine(&self) -> Result<Engine> {
        let engine = Engine::open(&self.device, self.precision())?;
        self.say(&format!("engine: {}", engine.describe()));
        Ok(engine)
    }

    /// Of the cpu engine.
    pub fn precision(&self) -> Precision {
        match self.precision {
            PrecisionName::F32 => Precision::F32,
            PrecisionName::F64 => Precision::F64,
        }
    }

    /// A message for people, on stderr.
    pub fn say(&self, message: &str) {
        if !self.quiet {
            eprintln!("{message}");
        }
    }

    /// Progress on stderr, as a bar or as lines; `length` 0 where it is not known (yet).
    fn bar(&self, label: &str, length: u64, kept: Kept) -> Bar {
        Bar::new(label, length, kept, self.quiet)
    }
}

#[allow(clippy::large_enum_variant)] // one exists in a run
#[derive(Debug, Subcommand)]
enum Command {
    Demo(demo::Demo),
    Devices(devices::Devices),
    Init(init::Init),
    Reflector(reflector::MakeReflector),
    Scene(scene::MakeScene),
    Rcs(rcs::Rcs),
    Study(study::RunStudy),
    Simulate(simulate::Simulate),
    Dataset(dataset::Dataset),
    Lane(lane::Lane),
    Verify(verify::Verify),
    Process(process::Process),
    Convert(convert::Convert),
    Export(export::Export),
    Calibrate(calibrate::Calibrate),
    Plot(plot::Plot),
    Validate(validate::Validate),
    Bench(bench::Bench),
}

/// Runs the program: 0 done, 2 bad input (one line on stderr), 130 interrupted, 1 anything else.
pub fn run() -> ExitCode {
    crate::gpu::quieten_loader();
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(e) => return usage(&e),
    };
    let g = &cli.global;
    if let Some(remark) = crate::machine::start_threads() {
        g.say(&remark);
    }
    if let Err(e) = bar::watch() {
        g.say(&format!("Ctrl-C ends the program without a word: {e}"));
    }
    if let Some(remark) = crate::machine::start_threads() {
        g.say(&remark);
    }
    let result = match &cli.command {
        Command::Demo(c) => c.run(g),
        Command::Devices(c) => c.run(g),
        Command::Init(c) => c.run(g),
        Command::Reflector(c) => c.run(g),
        Command::Scene(c) => c.run(g),
        Command::Rcs(c) => c.run(g),
        Command::Study(c) => c.run(g),
        Command::Simulate(c) => c.run(g),
        Command::Dataset(c) => c.run(g),
        Command::Lane(c) => c.run(g),
        Command::Verify(c) => c.run(g),
        Command::Process(c) => c.run(g),
        Command::Convert(c) => c.run(g),
        Command::Export(c) => c.run(g),
        Command::Calibrate(c) => c.run(g),
        Command::Plot(c) => c.run(g),
        Command::Validate(c) => c.run(g),
        Command::Bench(c) => c.run(g),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(Error::Io { source, .. }) if source.kind() == std::io::ErrorKind::BrokenPipe => ExitCode::SUCCESS,
        Err(e) => complain(&e),
    }
}

/// Whether stdout has its object.
static PRINTED: AtomicBool = AtomicBool::new(false);

/// An error is one line on stderr, and with `--json` one object on stdout, too, unless what was found stands there.
fn complain(e: &Error) -> ExitCode {
    eprintln!("error: {e}");
    // Read from the words themselves: a command line that clap refuses, or that a command reads by itself, has its `--json`, too.
    if !PRINTED.load(Relaxed) && std::env::args_os().any(|a| a == "--json") {
        // Nothing can be said where stdout is closed.
        let _ = print_json(&e.json());
    }
    ExitCode::from(e.exit_code())
}

/// Help and version go to stdout; a wrong command line is one line on stderr.
fn usage(e: &clap::Error) -> ExitCode {
    if !e.use_stderr() {
        let _ = e.print();
        return ExitCode::SUCCESS;
    }
    if e.kind() == clap::error::ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        let _ = e.print();
        return ExitCode::from(2);
    }
    let text = e.render().to_string();
    let parts: Vec<&str> = text
        .lines()
        .map(str::trim)
        .filter(|l| !l.is_empty() && !l.starts_with("Usage:") && !l.starts_with("For more information"))
        .collect();
    let line = parts.join(" ");
    complain(&BadInput::new(line.strip_prefix("error: ").unwrap_or(&line)).remedy("see --help").into())
}

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
