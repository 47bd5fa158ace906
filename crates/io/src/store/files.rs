//! Files of shards in a dataset, and the errors about those that are missing or damaged.

use super::record::Record;
use catseye::base::error::{BadInput, Error, Result};
use catseye::formats::stage::{sha256_of_file, sha256_of_parts, sync_folder};
use std::fs::File;
use std::io::{ErrorKind, Write};
use std::path::Path;

/// A file of a shard in the dataset.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct ShardFile {
    /// Path below the dataset's folder, with forward slashes.
    pub path: String,
    /// Size of the file, bytes.
    pub bytes: u64,
    /// SHA-256 in 64 hexadecimal digits.
    pub sha256: String,
}

/// A shard under construction. Dropped without `finish`, it leaves no file.
pub trait ShardWriter {
    /// Appends the next frame, which is already checked against the layout.
    fn push(&mut self, record: &Record) -> Result<()>;
    /// Gives all files their final names and describes them.
    fn finish(self: Box<Self>) -> Result<Vec<ShardFile>>;
}

/// Length and checksum of a file, which is then safe on the disk.
pub fn describe(path: &Path, relative: String) -> Result<ShardFile> {
    let sha256 = sha256_of_file(path)?;
    let file = File::options().append(true).open(path).map_err(|e| Error::io(path, e))?;
    file.sync_all().map_err(|e| Error::io(path, e))?;
    let bytes = file.metadata().map_err(|e| Error::io(path, e))?.len();
    Ok(ShardFile { path: relative, bytes, sha256 })
}

/// Writes a file of these parts, which is then safe on the disk, with its length and checksum: nothing is read back.
pub fn write_parts(path: &Path, relative: String, parts: &[&[u8]]) -> Result<ShardFile> {
    let io = |e| Error::io(path, e);
    let mut file = File::create(path).map_err(io)?;
    for part in parts {
        file.write_all(part).map_err(io)?;
    }
    let sha256 = sha256_of_parts(parts);
    file.sync_all().map_err(io)?;
    Ok(ShardFile { path: relative, bytes: parts.iter().map(|p| p.len() as u64).sum(), sha256 })
}

/// Makes the name of `path` in its folder durable on the disk.
pub fn sync_name(path: &Path) -> Result<()> {
    sync_folder(path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new(".")))
}

/// Error for a stored file that cannot be what was written.
pub fn broken(path: &Path, problem: impl Into<String>) -> Error {
    BadInput::new(format!("broken: {}", problem.into()))
        .file(path)
        .remedy("delete the file and run `catseye dataset` again, which makes its shard again")
        .into()
}

/// Error for a file of a shard that cannot be opened.
pub fn missing(path: &Path, e: std::io::Error) -> Error {
    if !matches!(e.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) {
        return Error::io(path, e);
    }
    BadInput::new("the shard is missing")
        .file(path)
        .remedy("run `catseye dataset` again, which makes the missing shard")
        .into()
}
