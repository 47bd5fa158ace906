//! `catseye init`: a commented file to start from.

use super::global::{Global, print, print_json};
use catseye::base::error::Result;
use catseye::formats::{check_extension, stage};
use catseye::scene::scenario::template;
use clap::Args;
use std::path::PathBuf;

/// Write a commented file to start from
#[derive(Debug, Args)]
pub struct Init {
    /// scenario, road, radar, study or recipe
    pub kind: String,
    /// File to write (default: KIND.toml); - prints it
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
        global.answer(&serde_json::json!({ "file": written }), || format!("wrote {}", written.display()))
    }
}
