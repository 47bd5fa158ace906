//! Files of a shard: written under a hidden name, synchronised with the disk, renamed when complete.

use crate::error::{BadInput, Error, Result};
use crate::formats::stage::{StagedFile, sha256_of_file};
use std::fs::{self, File};
use std::io::ErrorKind;
use std::path::Path;

/// A file of a shard as it stands in the dataset.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct ShardFile {
    /// Below the dataset's folder, with forward slashes.
    pub path: String,
    pub bytes: u64,
    /// 64 hexadecimal digits.
    pub sha256: String,
}

/// A file under construction.
pub struct Part {
    staged: StagedFile,
    relative: String,
}

impl Part {
    /// `relative` is below `dir`, with forward slashes. What an interrupted run left of the same file is removed.
    pub fn create(dir: &Path, relative: &str) -> Result<Part> {
        let path = dir.join(relative);
        remove_leftovers(&path)?;
        Ok(Part { staged: StagedFile::new(&path, true)?, relative: relative.into() })
    }

    /// The name to write to.
    pub fn path(&self) -> &Path {
        self.staged.path()
    }

    /// An error about the file under construction, under the name that it will have.
    pub fn failed(&self, e: std::io::Error) -> Error {
        Error::io(self.staged.final_path(), e)
    }

    /// Puts the file, which must be closed or flushed, under its name once the disk has it.
    pub fn commit(self) -> Result<ShardFile> {
        let file = describe(self.staged.path(), self.relative.clone()).map_err(|e| match e {
            Error::Io { source, .. } => self.failed(source),
            other => other,
        })?;
        let path = self.staged.commit()?;
        sync_folder(&path)?;
        Ok(file)
    }
}

/// Length and checksum of a file that is then safe on the disk.
pub fn describe(path: &Path, relative: String) -> Result<ShardFile> {
    let sha256 = sha256_of_file(path)?;
    let file = File::options().append(true).open(path).map_err(|e| Error::io(path, e))?;
    file.sync_all().map_err(|e| Error::io(path, e))?;
    let bytes = file.metadata().map_err(|e| Error::io(path, e))?.len();
    Ok(ShardFile { path: relative, bytes, sha256 })
}

/// Has the disk keep the names in the folder of `path`.
pub fn sync_folder(path: &Path) -> Result<()> {
    // Elsewhere folders cannot be opened as files.
    if cfg!(unix) {
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        File::open(folder).and_then(|f| f.sync_all()).map_err(|e| Error::io(folder, e))?;
    }
    Ok(())
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

/// A stored file that cannot be what was written.
pub fn broken(path: &Path, problem: impl Into<String>) -> Error {
    BadInput::new(format!("broken: {}", problem.into()))
        .file(path)
        .remedy("delete the file and run `catseye dataset` again, which makes its shard anew")
        .into()
}

/// Opens a file of a shard for reading.
///
/// # Errors
/// `BadInput` where it is missing.
pub fn open(path: &Path) -> Result<File> {
    match File::open(path) {
        Ok(file) if file.metadata().map_err(|e| Error::io(path, e))?.is_file() => Ok(file),
        Ok(_) => Err(broken(path, "is not a file")),
        Err(e) => Err(missing(path, e)),
    }
}

/// The error of a file of a shard that cannot be opened.
pub fn missing(path: &Path, e: std::io::Error) -> Error {
    if !matches!(e.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) {
        return Error::io(path, e);
    }
    BadInput::new("the shard is missing")
        .file(path)
        .remedy("run `catseye dataset` again, which makes what is missing")
        .into()
}
