//! `catseye verify`: whether a dataset is whole.

use super::{Global, print, print_json};
use crate::dataset::verify::verify;
use crate::error::{BadInput, Result};
use clap::Args;
use std::path::PathBuf;

/// Check a dataset: every shard there, once, with the bytes that were written, and nothing else beside
#[derive(Debug, Args)]
pub struct Verify {
    /// Folder that `catseye dataset` wrote
    pub folder: PathBuf,
}

impl Verify {
    pub fn run(&self, global: &Global) -> Result<()> {
        let bar = global.bar("files", 0);
        let found = verify(&self.folder, &|all| {
            bar.set_length(all);
            bar.inc(1);
        })?;
        bar.finish_and_clear();
        if global.json {
            print_json(&found)?;
        } else {
            for p in &found.problems {
                print(&p.line())?;
            }
        }
        if !found.problems.is_empty() {
            return Err(BadInput::new("the dataset is not whole")
                .file(&self.folder)
                .value(found.problems.iter().map(|p| p.problem).collect::<Vec<_>>().join(", "))
                .remedy("what is right stays as it is")
                .into());
        }
        if global.json {
            return Ok(());
        }
        print(&format!(
            "{}: '{}' is whole: {} frames in {} shards, {} files, {} bytes",
            found.folder.display(),
            found.name,
            found.frames,
            found.shards,
            found.files,
            found.bytes
        ))
    }
}
