//! A lock beside an output while it is made: the second process is told who holds it. The system frees it when its holder ends,
//! however it ends.

use crate::base::error::{BadInput, Error, Result};
use std::fs::{File, TryLockError};
use std::io::{Read, Seek, Write};
use std::path::{Path, PathBuf};

/// A lock that is held until it is dropped, which also removes its file.
#[derive(Debug)]
pub struct Lock {
    path: PathBuf,
    _file: File,
}

impl Lock {
    /// Takes the lock in the file `path`, for the output `of`.
    ///
    /// # Errors
    /// Returns `BadInput` with the holder's process and command while another process has it, and if the folder cannot
    /// be written to.
    pub fn take(of: &Path, path: PathBuf) -> Result<Lock> {
        match Lock::attempt(of, path)? {
            Ok(lock) => Ok(lock),
            Err(holder) => Err(BadInput::new(format!("is being written by {holder}"))
                .file(of)
                .remedy("wait until it ends, or give another name for the output")
                .into()),
        }
    }

    /// [`Lock::take`] that gives the holder's process and command while another one has the lock.
    ///
    /// # Errors
    /// Returns an error if the folder cannot be written to.
    pub fn attempt(of: &Path, path: PathBuf) -> Result<std::result::Result<Lock, String>> {
        let io = |e| Error::io(of, e);
        loop {
            let mut file = File::options()
                .read(true)
                .write(true)
                .create(true)
                .truncate(false)
                .open(&path)
                .map_err(|e| no_place(of, e))?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => {
                    let mut holder = String::new();
                    let _ = file.read_to_string(&mut holder);
                    return Ok(Err(match holder.is_empty() {
                        true => "another process".to_string(),
                        false => holder,
                    }));
                }
                // A file system without locks: as without this.
                Err(TryLockError::Error(e)) if e.kind() == std::io::ErrorKind::Unsupported => {}
                Err(TryLockError::Error(e)) => return Err(io(e)),
            }
            // The holder before may have taken the name away between our two steps.
            if !is_at(&file, &path) {
                continue;
            }
            file.set_len(0).and_then(|()| file.rewind()).map_err(io)?;
            let command: Vec<String> =
                std::env::args_os().take(4).map(|a| a.to_string_lossy().into_owned()).collect();
            write!(file, "process {} ({})", std::process::id(), command.join(" ")).map_err(io)?;
            return Ok(Ok(Lock { path, _file: file }));
        }
    }
}

/// The complaint about an output beside which nothing can be written.
fn no_place(of: &Path, e: std::io::Error) -> Error {
    use std::io::ErrorKind::{NotADirectory, NotFound, PermissionDenied, ReadOnlyFilesystem};
    match e.kind() {
        PermissionDenied | ReadOnlyFilesystem | NotFound | NotADirectory => {
            BadInput::new(format!("cannot be written: {e}"))
                .file(of)
                .remedy("give an output in a folder with write permission")
                .into()
        }
        _ => Error::io(of, e),
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // While it is held, so that nobody's else is removed.
        let _ = std::fs::remove_file(&self.path);
    }
}

#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    match (file.metadata(), std::fs::metadata(path)) {
        (Ok(a), Ok(b)) => (a.dev(), a.ino()) == (b.dev(), b.ino()),
        _ => false,
    }
}

/// An open file keeps its name elsewhere.
#[cfg(not(unix))]
fn is_at(_: &File, _: &Path) -> bool {
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_second_is_told_who_holds_it() {
        let t = tempfile::tempdir().unwrap();
        let (of, path) = (t.path().join("out"), t.path().join(".out.lock"));
        let held = Lock::take(&of, path.clone()).unwrap();
        let e = Lock::take(&of, path.clone()).unwrap_err();
        assert_eq!(e.exit_code(), 2);
        assert!(e.to_string().contains(&format!("process {}", std::process::id())), "{e}");
        drop(held);
        assert!(!path.exists());
        // What a dead process left locks nobody out.
        std::fs::write(&path, "process 1 (long gone, with a longer name than the next one)").unwrap();
        let held = Lock::take(&of, path.clone()).unwrap();
        assert!(
            std::fs::read_to_string(&path).unwrap().starts_with(&format!("process {} (", std::process::id()))
        );
        drop(held);
        assert!(!path.exists());
    }

    #[test]
    fn an_output_without_a_folder_is_bad_input() {
        let t = tempfile::tempdir().unwrap();
        let file = t.path().join("file");
        std::fs::write(&file, "").unwrap();
        for parent in [&file, &t.path().join("none")] {
            let of = parent.join("out");
            let e = Lock::take(&of, parent.join(".out.lock")).unwrap_err();
            let text = e.to_string();
            assert!(
                e.exit_code() == 2
                    && text.contains(of.to_str().unwrap())
                    && text.contains("write permission"),
                "{text}"
            );
            assert!(!text.contains(".lock"), "{text}");
        }
    }
}
