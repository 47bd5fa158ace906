//! `catseye help`: a command's help, or what has a name: reflectors with their parameters, materials, radars.

use super::global::print;
use catseye::base::error::{BadInput, Result, nearest};
use catseye::road::reflector;
use catseye::scene::radar_figures::RadarFigures;
use catseye::scene::{material, radar_toml};
use clap::Args;

/// Print the help of a command, or list reflectors with their parameters, materials or radars
#[derive(Debug, Args)]
pub struct Help {
    /// A command, or one of reflectors, materials, radars
    #[arg(value_name = "COMMAND|reflectors|materials|radars")]
    pub topic: Option<String>,
    /// With reflectors: list only this kind
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
    rows + "\nLayers with their thickness in metres follow the material, as in aluminium+water:0.0005.\n"
}

/// The built-in radars: what each can do, as computed from it, and the first sentence that its file says about it.
fn radars() -> String {
    let head = format!(
        "{:12} {:>13} {:>7} {:>7} {:>7} {:>7} {:>7} {:>11} {:>7}\n{:12} {:>13} {:>7} {:>7} {:>7} {:>7} {:>7} {:>11} {:>7}\n",
        "name",
        "band",
        "tx x rx",
        "range",
        "resol.",
        "speed",
        "resol.",
        "beam",
        "sector",
        "",
        "GHz",
        "",
        "m",
        "m",
        "+-m/s",
        "m/s",
        "deg",
        "+-deg"
    );
    let rows: String = radar_toml::PRESETS.into_iter().map(radar_row).collect();
    let foot = "\nRange and speed: maximum unambiguous values. Resol.: resolution, c/2B and the wavelength over twice the frame or burst. \
                Beam: half-power\nbeamwidth in azimuth x elevation, uniform weights. Sector: to each side of boresight, without ambiguous \
                directions.\ncatseye examples presets/NAME writes \
                the file, which names its sources.\n";
    head + &rows + foot
}

fn radar_row((name, text): (&str, &str)) -> String {
    let about: Vec<&str> = text.lines().map_while(|l| l.strip_prefix("# ")).collect();
    let about = about.join(" ");
    let about = about.split(". ").next().unwrap_or_default().trim_end_matches('.');
    let Ok(radar) = radar_toml::preset(name) else { return format!("{name:12} {about}\n") };
    let f = RadarFigures::of(&radar);
    let number = |x: Option<f64>, places: usize| x.map_or("-".into(), |x| format!("{x:.places$}"));
    let band = f.band_hz.map(|hz| format!("{:.2}", hz / 1e9)).join("..");
    let antennas = f.antennas.map(|n| n.to_string()).join(" x ");
    let beam = f.beam_deg.map(|b| number(b, 1)).join(" x ");
    let sector = f.unambiguous_deg.map(|b| number(b, 0)).join(" x ");
    format!(
        "{name:12} {band:>13} {antennas:>7} {:>7} {:>7} {:>7} {:>7} {beam:>11} {sector:>7}  {about}\n",
        number(Some(f.max_range_m), 1),
        number(Some(f.range_resolution_m), 2),
        number(f.max_speed_mps, 1),
        number(f.speed_resolution_mps, 2),
    )
}
