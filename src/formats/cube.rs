//! temp
use crate::error::{BadInput, Error, Result};
use std::fs::File;
use std::path::Path;
/// Opens a file that has to exist.
pub(super) fn open_file(path: &Path) -> Result<File> {
    let bad = |problem: &str| Error::from(BadInput::new(problem).file(path));
    match File::open(path) {
        Ok(f) => match f.metadata() {
            Ok(m) if !m.is_file() => Err(bad("is not a file")),
            Err(e) => Err(Error::io(path, e)),
            Ok(_) => Ok(f),
        },
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Err(bad("no such file")),
        Err(e) => Err(Error::io(path, e)),
    }
}
