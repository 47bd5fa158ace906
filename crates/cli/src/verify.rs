//! `catseye verify`: whether a dataset or a run is whole.

use super::bar::Kept;
use super::global::{Global, print, print_json};
use catseye::base::error::{BadInput, Result};
use catseye_io::verify::verify;
use clap::Args;
use std::path::PathBuf;

/// Check a dataset or a run: every shard and file exists once with the written bytes, and no other file exists
#[derive(Debug, Args)]
pub struct Verify {
    /// Folder written by `catseye dataset` or `catseye simulate`
    pub folder: PathBuf,
}

impl Verify {
    pub fn run(&self, global: &Global) -> Result<()> {
        let bar = global.bar("files", 0, Kept::Nothing);
        let found = verify(&self.folder, &|all| {
            bar.set_length(all);
            bar.inc(1);
        })?;
        drop(bar);
        if global.json {
            print_json(&found)?;
        } else {
            for p in &found.problems {
                print(&p.line())?;
            }
        }
        if !found.problems.is_empty() {
            return Err(BadInput::new(match found.shards {
                0 => "the run is incomplete or damaged",
                _ => "the dataset is incomplete or damaged",
            })
            .file(&self.folder)
            .value(found.problems.iter().map(|p| p.problem).collect::<Vec<_>>().join(", "))
            .remedy("follow the hint of each problem; correct files are not changed")
            .into());
        }
        if global.json {
            return Ok(());
        }
        let shards = match found.shards {
            0 => String::new(),
            n => format!(" in {n} shards"),
        };
        print(&format!(
            "{}: '{}' is complete: {} frames{shards}, {} files, {} bytes",
            found.folder.display(),
            found.name,
            found.frames,
            found.files,
            found.bytes
        ))
    }
}
