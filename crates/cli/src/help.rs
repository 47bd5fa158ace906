//! `catseye help`: a command's help, or what has a name: reflectors with their parameters, materials, radars.

use super::global::print;
use catseye::base::error::{BadInput, Result, nearest};
use catseye::road::reflector;
use catseye::scene::{material, radar_toml};
use clap::Args;

/// Print the help of a command, or list reflectors with their parameters, materials or radars
#[derive(Debug, Args)]
pub struct Help {
    /// A command, or one of reflectors, materials, radars
    #[arg(value_name = "COMMAND|reflectors|materials|radars")]
    pub topic: Option<String>,
    /// With reflectors: only this one
    #[arg(value_name = "KIND")]
    pub kind: Option<String>,
}

/// What has names that users write, and its list.
type Topic = (&'static str, fn() -> String);
const TOPICS: [Topic; 3] = [("reflectors", reflector::help), ("materials", materials), ("radars", radars)];

impl Help {
    /// `root` is the whole command line.
    pub fn run(&self, mut root: clap::Command) -> Result<()> {
        root.build();
        let Some(name) = self.topic.as_deref() else {
            return print(&root.render_long_help().to_string());
        };
        let text = match (TOPICS.iter().find(|t| t.0 == name), &self.kind) {
            (Some(("reflectors", _)), Some(kind)) => reflector::help_of(reflector::kind_named(kind)?),
            (_, Some(kind)) => {
                return Err(BadInput::new("only reflectors have a KIND").key("KIND").value(kind).into());
            }
            (Some((_, list)), None) => list(),
            (None, None) => match root.find_subcommand_mut(name) {
                Some(command) => command.render_long_help().to_string(),
                None => return Err(unknown(name, &root).into()),
            },
        };
        print(text.trim_end())
    }
}

fn unknown(name: &str, root: &clap::Command) -> BadInput {
    let names = || root.get_subcommands().map(clap::Command::get_name).chain(TOPICS.iter().map(|t| t.0));
    let bad = BadInput::new("is neither a command nor a list")
        .key("COMMAND")
        .value(format!("'{name}'"))
        .allowed(names().collect::<Vec<_>>().join(", "));
    match nearest(name, names()) {
        Some(n) => bad.remedy(format!("did you mean '{n}'?")),
        None => bad,
    }
}

/// The table of materials: name, frequencies for which it holds, source.
fn materials() -> String {
    let row = |m: &material::Material| {
        let (lo, hi) = m.valid_hz;
        let band = match hi.is_finite() {
            true => format!("{:.4}..{:.4} GHz", lo / 1e9, hi / 1e9),
            false => "all frequencies".into(),
        };
        format!("{:20} {band:24} {}\n", m.name, m.source)
    };
    let rows: String = material::table().iter().map(row).collect();
    rows + "\nLayers of so many metres lie on a material as in aluminium+water:0.0005.\n"
}

/// The built-in radars, each with the first sentence that its file says about it.
fn radars() -> String {
    let row = |(name, text): (&str, &str)| {
        let about: Vec<&str> = text.lines().map_while(|l| l.strip_prefix("# ")).collect();
        let about = about.join(" ");
        format!("{name:10} {}\n", about.split(". ").next().unwrap_or_default().trim_end_matches('.'))
    };
    radar_toml::PRESETS.into_iter().map(row).collect()
}
