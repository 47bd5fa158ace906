//! `catseye init`: a commented file to start from.

use super::global::{Global, print, print_json};
use catseye::base::error::Result;
use catseye::formats::{check_extension, stage};
use catseye::scene::radar_figures::RadarFigures;
use catseye::scene::radar_toml;
use catseye::scene::scenario::template;
use clap::Args;
use std::path::{Path, PathBuf};

/// Write a commented file to start from
#[derive(Debug, Args)]
pub struct Init {
    /// Kind of file: scenario, road, radar, study or recipe
    pub kind: String,
    /// File to write (default: KIND.toml); - writes to stdout
    #[arg(short, long)]
    pub output: Option<PathBuf>,
}

impl Init {
    pub fn run(&self, global: &Global) -> Result<()> {
        let text = template(&self.kind)?;
        let path = self.output.clone().unwrap_or_else(|| format!("{}.toml", self.kind).into());
        if path.as_os_str() == "-" {
            return match global.json {
                true => print_json(&serde_json::json!({ "text": text })),
                false => print(text.trim_end()),
            };
        }
        check_extension(&path, &["toml"])?;
        let written = stage::write_file(&path, global.force, text.as_bytes())?;
        let sector = (self.kind == "radar").then(|| sector(text)).flatten();
        global.answer(&serde_json::json!({ "file": written, "unambiguous_azimuth_deg": sector }), || {
            let sector =
                sector.map(|deg| format!("; its array confuses no two azimuths within +-{deg:.0} deg"));
            format!("wrote {}{}", written.display(), sector.unwrap_or_default())
        })
    }
}

/// Half the sector in which the array of a radar's text confuses no two azimuths, degrees.
fn sector(text: &str) -> Option<f64> {
    let radar = radar_toml::parse(Path::new("radar.toml"), text).ok()?;
    RadarFigures::of(&radar).unambiguous_deg[0]
}
