//! Files of shards as they stand in a dataset, and what is said about those that do not.

use super::record::Record;
use catseye::base::error::{BadInput, Error, Result};
use catseye::formats::stage::{sha256_of_file, sync_folder};
use std::fs::File;
use std::io::ErrorKind;
use std::path::Path;

/// A file of a shard as it stands in the dataset.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct ShardFile {
    /// Below the dataset's folder, with forward slashes.
    pub path: String,
    /// Size, bytes.
    pub bytes: u64,
    /// 64 hexadecimal digits.
    pub sha256: String,
}

/// A shard under construction. Dropped without `finish`, it leaves no file.
pub trait ShardWriter {
    /// The next frame, already checked against the layout.
    fn push(&mut self, record: &Record) -> Result<()>;
    /// Puts all files under their names.
    fn finish(self: Box<Self>) -> Result<Vec<ShardFile>>;
}

/// Length and checksum of a file that is then safe on the disk.
pub fn describe(path: &Path, relative: String) -> Result<ShardFile> {
    let sha256 = sha256_of_file(path)?;
    let file = File::options().append(true).open(path).map_err(|e| Error::io(path, e))?;
    file.sync_all().map_err(|e| Error::io(path, e))?;
    let bytes = file.metadata().map_err(|e| Error::io(path, e))?.len();
    Ok(ShardFile { path: relative, bytes, sha256 })
}

/// Has the disk keep the name of `path` in its folder.
pub fn sync_name(path: &Path) -> Result<()> {
    sync_folder(path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new(".")))
}

/// A stored file that cannot be what was written.
pub fn broken(path: &Path, problem: impl Into<String>) -> Error {
    BadInput::new(format!("broken: {}", problem.into()))
        .file(path)
        .remedy("delete the file and run `catseye dataset` again, which makes its shard anew")
        .into()
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
