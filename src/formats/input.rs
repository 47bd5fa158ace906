//! Files that are read: regular files only, and none larger than it should be.

use crate::base::error::{BadInput, Error, Result};
use std::fs::{File, Metadata};
use std::io::Read;
use std::path::Path;

/// Tables, documents and sidecars that are read whole.
pub const LARGEST_TEXT: u64 = 1 << 30;

/// The metadata of a file that has to be there. A pipe, a device or a socket is refused before it is opened: a pipe waits for its writer, and
/// a device may never end. `what` it should be is named in the remedy, as in "a TOML file".
///
/// # Errors
/// Returns `BadInput` if there is no regular file.
pub fn regular(path: &Path, what: &str) -> Result<Metadata> {
    let bad = |problem: &str| BadInput::new(problem).file(path);
    match std::fs::metadata(path) {
        Ok(m) if m.is_file() => Ok(m),
        Ok(m) if m.is_dir() => Err(bad("is a directory").remedy(format!("give {what}")).into()),
        Ok(m) => Err(bad("is not a regular file")
            .value(kind(&m))
            .remedy("write its data to a file first, and give that file")
            .into()),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
            Err(bad("no such file").remedy("check the path").into())
        }
        Err(e) => Err(Error::io(path, e)),
    }
}

#[cfg(unix)]
fn kind(m: &Metadata) -> &'static str {
    use std::os::unix::fs::FileTypeExt;
    let t = m.file_type();
    match () {
        () if t.is_fifo() => "a pipe",
        () if t.is_socket() => "a socket",
        () => "a device",
    }
}

#[cfg(not(unix))]
fn kind(_: &Metadata) -> &'static str {
    "a device"
}

/// Opens a regular file.
///
/// # Errors
/// Returns the errors of [`regular`], and an error if the file cannot be opened.
pub fn open(path: &Path, what: &str) -> Result<File> {
    regular(path, what)?;
    File::open(path).map_err(|e| Error::io(path, e))
}

/// Reads a regular file of at most `most` bytes.
///
/// # Errors
/// Returns the errors of [`regular`], and an error if the file is larger than `most` or than memory, or cannot be read.
pub fn read(path: &Path, what: &str, most: u64) -> Result<Vec<u8>> {
    let length = regular(path, what)?.len();
    let too_large = |length: u64| {
        BadInput::new(format!("is too large for {what}"))
            .file(path)
            .value(format!("{length} bytes"))
            .allowed(format!("up to {most} bytes"))
    };
    if length > most {
        return Err(too_large(length).into());
    }
    crate::base::machine::require(length as f64, "its bytes").map_err(|e| e.file(path))?;
    let file = File::open(path).map_err(|e| Error::io(path, e))?;
    let mut bytes = Vec::with_capacity(length as usize);
    // It may have grown, and files of the kernel's own say that they are empty.
    file.take(most + 1).read_to_end(&mut bytes).map_err(|e| Error::io(path, e))?;
    if bytes.len() as u64 > most {
        return Err(too_large(bytes.len() as u64).into());
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_regular_files_of_a_bounded_size() {
        let dir = tempfile::tempdir().unwrap();
        let complaint = |path: &Path| read(path, "a table", 3).unwrap_err();
        assert!(complaint(dir.path()).to_string().ends_with("is a directory; give a table"));
        assert_eq!(complaint(&dir.path().join("none")).exit_code(), 2);
        let path = dir.path().join("a");
        std::fs::write(&path, "four").unwrap();
        assert!(complaint(&path).to_string().contains("4 bytes: is too large for a table; allowed: up to 3"));
        std::fs::write(&path, "abc").unwrap();
        assert_eq!(read(&path, "a table", 3).unwrap(), b"abc");
        #[cfg(unix)]
        assert!(complaint(Path::new("/dev/zero")).to_string().contains("a device: is not a regular file"));
    }
}
