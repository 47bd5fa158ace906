//! A file of a shard under construction: written under a hidden name, synchronised with the disk, and renamed
//! when complete.

use super::files::{ShardFile, broken, describe, missing, sync_name};
use catseye::base::error::{Error, Result};
use catseye::formats::stage::StagedFile;
use std::fs::{self, File};
use std::io::ErrorKind;
use std::path::Path;

/// A file under construction.
pub struct Part {
    staged: StagedFile,
    relative: String,
}

impl Part {
    /// Begins a file at `relative` below `dir`, with forward slashes. What an interrupted run left of the
    /// same file is removed.
    pub fn create(dir: &Path, relative: &str) -> Result<Part> {
        let path = dir.join(relative);
        remove_leftovers(&path)?;
        Ok(Part { staged: StagedFile::new(&path, true)?, relative: relative.into() })
    }

    /// Path to which the content is written.
    pub fn path(&self) -> &Path {
        self.staged.path()
    }

    /// Makes an error about the file under construction, under its final name.
    pub fn failed(&self, e: std::io::Error) -> Error {
        Error::io(self.staged.final_path(), e)
    }

    /// Gives the file, which must be closed or flushed, its final name once the disk has it.
    pub fn commit(self) -> Result<ShardFile> {
        let file = describe(self.staged.path(), self.relative.clone()).map_err(|e| match e {
            Error::Io { source, .. } => self.failed(source),
            other => other,
        })?;
        let path = self.staged.commit()?;
        sync_name(&path)?;
        Ok(file)
    }
}

/// Removes `.NAME.partial-…` beside `path`.
fn remove_leftovers(path: &Path) -> Result<()> {
    let (Some(folder), Some(name)) = (path.parent(), path.file_name().and_then(|n| n.to_str())) else {
        return Ok(());
    };
    let prefix = format!(".{name}.partial-");
    let entries = match fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(()),
        Err(e) => return Err(Error::io(folder, e)),
    };
    for entry in entries {
        let entry = entry.map_err(|e| Error::io(folder, e))?;
        if entry.file_name().to_str().is_some_and(|n| n.starts_with(&prefix)) {
            match fs::remove_file(entry.path()) {
                Err(e) if e.kind() != ErrorKind::NotFound => return Err(Error::io(entry.path(), e)),
                _ => {}
            }
        }
    }
    Ok(())
}

/// Opens a file of a shard for reading.
///
/// # Errors
/// Returns `BadInput` if the file is missing.
pub fn open(path: &Path) -> Result<File> {
    // Checked first, as a pipe would wait for its writer.
    match std::fs::metadata(path) {
        Ok(m) if m.is_file() => File::open(path).map_err(|e| missing(path, e)),
        Ok(_) => Err(broken(path, "is not a file")),
        Err(e) => Err(missing(path, e)),
    }
}
