//! The command line: one file per subcommand. Parses, calls the library, prints; no physics.

mod angles;
mod bar;
mod bench;
mod calibrate;
mod completions;
mod convert;
mod cube_args;
mod dataset;
mod demo;
mod devices;
mod diff;
mod examples;
mod export;
mod fit_sensor;
mod footprint;
mod frames;
mod global;
mod help;
mod init;
mod lane;
mod learn;
mod live;
mod local_http;
mod man;
mod mcp;
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
mod view;

pub use frames::{draw_frame, outlines};

use catseye::base::error::{BadInput, Error};
use clap::parser::ValueSource;
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use global::{Global, PRINTED, print_json};
use std::io::Write as _;
use std::process::ExitCode;
use std::sync::LazyLock;
use std::sync::atomic::Ordering::Relaxed;

/// Automotive-radar simulator: glTF road scenes to radar cross sections, ADC cubes, detections and points.
#[derive(Debug, Parser)]
#[command(name = "catseye", version = VERSION.as_str(), max_term_width = 110, disable_help_subcommand = true)]
struct Cli {
    #[command(flatten)]
    global: Global,
    #[command(subcommand)]
    command: Command,
}

/// The version and what this build can do beyond the plain one.
static VERSION: LazyLock<String> = LazyLock::new(|| {
    let features = [
        ("hdf5", cfg!(feature = "hdf5")),
        ("learn", cfg!(feature = "learn")),
        ("mcap", cfg!(feature = "mcap")),
        ("mcp", cfg!(feature = "mcp")),
        ("osi", cfg!(feature = "osi")),
        ("parquet", cfg!(feature = "parquet")),
        ("zarr", cfg!(feature = "zarr")),
    ];
    let built: Vec<&str> = features.iter().filter(|f| f.1).map(|f| f.0).collect();
    let built = if built.is_empty() { "none".into() } else { built.join(", ") };
    format!("{} (features: {built})", env!("CARGO_PKG_VERSION"))
});

/// The global options that act for each command. The others are not in its help, and it says that they change nothing.
const ACTING: [(&str, &[&str]); 27] = [
    ("demo", &["device", "precision", "trace", "json", "quiet", "seed"]),
    ("devices", &["device", "json", "quiet"]),
    ("init", &["json", "quiet", "force"]),
    ("examples", &["json", "quiet", "force"]),
    ("reflector", &["json", "quiet", "seed", "force"]),
    ("scene", &["json", "quiet", "force"]),
    ("rcs", &["device", "precision", "json", "quiet", "force"]),
    ("study", &["device", "precision", "json", "quiet", "force"]),
    ("simulate", &["device", "precision", "trace", "json", "quiet", "seed", "force"]),
    ("dataset", &["device", "precision", "trace", "json", "quiet", "seed", "force"]),
    ("lane", &["device", "precision", "trace", "json", "quiet", "seed", "force"]),
    ("learn", &["device", "json", "quiet", "seed", "force"]),
    ("verify", &["json", "quiet"]),
    ("diff", &["json", "quiet", "force"]),
    ("process", &["device", "precision", "json", "quiet", "force"]),
    ("convert", &["json", "quiet", "force"]),
    ("export", &["json", "quiet", "force"]),
    ("calibrate", &["device", "precision", "trace", "json", "quiet", "seed", "force"]),
    ("fit-sensor", &["json", "quiet", "seed", "force"]),
    ("plot", &["json", "quiet", "force"]),
    ("view", &["device", "precision", "trace", "json", "quiet", "seed", "force"]),
    ("validate", &["device", "precision", "trace", "json", "quiet", "seed", "force"]),
    ("bench", &["device", "precision", "trace", "json", "quiet", "seed"]),
    ("completions", &[]),
    ("man", &["json", "quiet", "force"]),
    ("mcp", &["device", "precision", "trace", "quiet"]),
    ("help", &[]),
];

/// The global options that do not act for a command.
fn idle<'a>(root: &'a clap::Command, command: &str) -> impl Iterator<Item = &'a clap::Arg> {
    let acting = ACTING.iter().find(|(name, _)| *name == command).map_or(&[][..], |row| row.1);
    root.get_arguments().filter(move |a| a.is_global_set() && !acting.contains(&a.get_id().as_str()))
}

/// The command line: each command with the global options that act for it, and with numbers that may be negative, so that what
/// a number may be is said by whoever reads it.
fn command() -> clap::Command {
    let negative = |a: clap::Arg| match a.get_action().takes_values() {
        true => a.allow_negative_numbers(true),
        false => a,
    };
    let root = Cli::command().mut_args(negative);
    let mut out = root.clone();
    for (name, _) in ACTING {
        out = out.mut_subcommand(name, |c| {
            let c = c.mut_args(negative);
            c.args(idle(&root, name).map(|a| a.clone().hide(true)))
        });
    }
    out
}

/// What is on the command line, with a remark on the global options that the command knows and does not heed: scripts give the same
/// ones to all commands. Errors: what clap refuses.
fn parse() -> std::result::Result<(Cli, Option<String>), ExitCode> {
    let matches = command().try_get_matches_from_mut(std::env::args_os()).map_err(|e| usage(&e))?;
    let remark = matches.subcommand_name().and_then(|name| {
        let root = Cli::command();
        let given =
            |a: &&clap::Arg| matches.value_source(a.get_id().as_str()) == Some(ValueSource::CommandLine);
        let idle: Vec<String> =
            idle(&root, name).filter(given).map(|a| format!("--{}", a.get_id())).collect();
        (!idle.is_empty()).then(|| format!("note: {} has no effect on '{name}'", idle.join(", ")))
    });
    Ok((Cli::from_arg_matches(&matches).map_err(|e| usage(&e))?, remark))
}

#[allow(clippy::large_enum_variant)] // one exists in a run
#[derive(Debug, Subcommand)]
enum Command {
    Demo(demo::Demo),
    Devices(devices::Devices),
    Init(init::Init),
    Examples(examples::Examples),
    Reflector(reflector::MakeReflector),
    Scene(scene::MakeScene),
    Rcs(rcs::Rcs),
    Study(study::RunStudy),
    Simulate(simulate::Simulate),
    Dataset(dataset::Dataset),
    Lane(lane::Lane),
    Learn(learn::Learn),
    Verify(verify::Verify),
    Diff(diff::Diff),
    Process(process::Process),
    Convert(convert::Convert),
    Export(export::Export),
    Calibrate(calibrate::Calibrate),
    FitSensor(fit_sensor::FitSensor),
    Plot(plot::Plot),
    View(view::View),
    Validate(validate::Validate),
    Bench(bench::Bench),
    Completions(completions::Completions),
    Man(man::Man),
    Mcp(mcp::Mcp),
    Help(help::Help),
}

/// Runs the program: 0 done, 2 bad input (one line on stderr), 130 interrupted, 1 anything else.
pub fn run() -> ExitCode {
    catseye::gpu::quieten_loader();
    let (cli, remark) = match parse() {
        Ok(parsed) => parsed,
        Err(code) => return code,
    };
    let g = &cli.global;
    if let Some(remark) = remark {
        g.say(&remark);
    }
    if let Some(remark) = catseye::base::machine::start_threads() {
        g.say(&remark);
    }
    if let Err(e) = bar::watch() {
        g.say(&format!("Ctrl-C will end the program without a message: {e}"));
    }
    let result = match &cli.command {
        Command::Demo(c) => c.run(g),
        Command::Devices(c) => c.run(g),
        Command::Init(c) => c.run(g),
        Command::Examples(c) => c.run(g),
        Command::Reflector(c) => c.run(g),
        Command::Scene(c) => c.run(g),
        Command::Rcs(c) => c.run(g),
        Command::Study(c) => c.run(g),
        Command::Simulate(c) => c.run(g),
        Command::Dataset(c) => c.run(g),
        Command::Lane(c) => c.run(g),
        Command::Learn(c) => c.run(g),
        Command::Verify(c) => c.run(g),
        Command::Diff(c) => c.run(g),
        Command::Process(c) => c.run(g),
        Command::Convert(c) => c.run(g),
        Command::Export(c) => c.run(g),
        Command::Calibrate(c) => c.run(g),
        Command::FitSensor(c) => c.run(g),
        Command::Plot(c) => c.run(g),
        Command::View(c) => c.run(g),
        Command::Validate(c) => c.run(g),
        Command::Bench(c) => c.run(g),
        Command::Completions(c) => c.run(command()),
        Command::Man(c) => c.run(g, command()),
        Command::Mcp(c) => c.run(g),
        Command::Help(c) => c.run(command()),
    };
    ended(result)
}

/// Who reads stdout may stop to do so at any time.
fn ended(result: catseye::base::error::Result<()>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(Error::Io { source, .. }) if source.kind() == std::io::ErrorKind::BrokenPipe => ExitCode::SUCCESS,
        Err(e) => complain(&e),
    }
}

/// An error is one line on stderr, and with `--json` one object on stdout, too, unless what was found stands there.
fn complain(e: &Error) -> ExitCode {
    match e {
        Error::Interrupted(_) => eprintln!("{e}"),
        e => eprintln!("error: {e}"),
    }
    // Read from the words themselves: a command line that clap refuses, or that a command reads by itself, has its `--json`, too.
    if !PRINTED.load(Relaxed) && std::env::args_os().any(|a| a == "--json") {
        // Nothing can be said where stdout is closed.
        let _ = print_json(&e.json());
    }
    ExitCode::from(e.exit_code())
}

/// A value that clap cannot read, in the words of all other complaints.
fn unreadable(e: &clap::Error) -> Option<BadInput> {
    use clap::error::{ContextKind, ContextValue, ErrorKind};
    let text = |kind: ContextKind| match e.get(kind)? {
        ContextValue::String(text) => Some(text.clone()),
        ContextValue::Strings(words) => Some(words.join(", ")),
        _ => None,
    };
    let (option, value) = (text(ContextKind::InvalidArg)?, text(ContextKind::InvalidValue)?);
    let (problem, allowed) = match e.kind() {
        ErrorKind::InvalidValue if value.is_empty() => return None,
        ErrorKind::InvalidValue => ("is not one of the choices", text(ContextKind::ValidValue)?),
        ErrorKind::ValueValidation => {
            // What the parsers of numbers say; they have no other way to tell what they read.
            let why = std::error::Error::source(e)?.to_string();
            match why.split_once(" is not in ") {
                // A parser names the largest number of its type where the range has no upper end.
                Some((_, range)) => ("is out of range", open_ended(range)),
                None if why.contains("float") => ("is not a number", "a number such as 0.5 or 77e9".into()),
                None if value.parse::<i128>().is_ok() => {
                    ("is out of range", "a whole number, 0 or more".into())
                }
                None => ("is not a whole number", "a whole number, 0 or more".into()),
            }
        }
        _ => return None,
    };
    let bad = BadInput::new(problem).key(option.split(' ').next()?).value(format!("'{value}'"));
    let bad = bad.allowed(allowed);
    Some(match text(ContextKind::SuggestedValue) {
        Some(near) => bad.remedy(format!("did you mean '{near}'?")),
        None => bad,
    })
}

/// `1..=4294967295` in words, 1 or more; any other range as it is.
fn open_ended(range: &str) -> String {
    match range.split_once("..=") {
        Some((least, most)) if most == u32::MAX.to_string() || most == u64::MAX.to_string() => {
            format!("a whole number, {least} or more")
        }
        _ => range.into(),
    }
}

/// Help and version go to stdout; a wrong command line is one line on stderr.
fn usage(e: &clap::Error) -> ExitCode {
    if !e.use_stderr() {
        let printed = e.print().and_then(|()| std::io::stdout().flush());
        return ended(printed.map_err(|e| Error::io("stdout", e)));
    }
    if e.kind() == clap::error::ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        let _ = e.print();
        return ExitCode::from(2);
    }
    if let Some(bad) = unreadable(e) {
        return complain(&bad.into());
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

#[cfg(test)]
mod tests {
    use super::global::GLOBAL_HEADING;
    use super::*;

    fn walk(command: &clap::Command, look: &mut impl FnMut(&clap::Command)) {
        look(command);
        command.get_subcommands().for_each(|c| walk(c, look));
    }

    /// Each argument says what it is, those of a command stand apart from the global ones, and of these a command shows those
    /// that act and no others.
    #[test]
    fn every_option_is_described_under_its_heading() {
        let mut root = command();
        root.build();
        root.clone().debug_assert();
        let names: Vec<&str> = root.get_subcommands().map(clap::Command::get_name).collect();
        assert_eq!(names, ACTING.map(|row| row.0), "one row of ACTING for each command, in their order");
        let globals: Vec<String> = Cli::command()
            .get_arguments()
            .filter(|a| a.is_global_set())
            .map(|a| a.get_id().to_string())
            .collect();
        assert_eq!(globals.len(), 7);
        let mut seen = 0;
        // Commands below another may have the name of one that stands alone.
        let stands_alone = |c: &clap::Command| root.get_subcommands().any(|top| std::ptr::eq(top, c));
        walk(&root, &mut |c| {
            assert!(c.get_about().is_some_and(|a| !a.to_string().is_empty()), "{}", c.get_name());
            for a in c.get_arguments() {
                let (id, place) = (a.get_id().as_str(), format!("{} {}", c.get_name(), a.get_id()));
                assert!(a.get_help().is_some_and(|h| h.to_string().len() > 3), "{place} has no help");
                let global = globals.iter().any(|g| g == id);
                assert_eq!(a.get_help_heading() == Some(GLOBAL_HEADING), global, "{place}");
                // The heading of a group of options would go on for those after it.
                assert!(id != "output" || a.get_help_heading().is_none(), "{place}");
                let row = ACTING.iter().find(|row| row.0 == c.get_name() && global && stands_alone(c));
                if let Some((_, acting)) = row {
                    assert_eq!(a.is_hide_set(), !acting.contains(&id), "{place}");
                }
                seen += 1;
            }
        });
        assert!(seen > 150, "{seen}");
        for (name, acting) in ACTING {
            assert!(acting.iter().all(|a| globals.iter().any(|g| g == a)), "{name}: {acting:?}");
        }
    }
}
