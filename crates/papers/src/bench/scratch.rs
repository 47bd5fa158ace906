//! A temporary folder for the files that a workload writes.

use catseye::base::error::{Error, Result};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

/// A folder that is removed when this value is dropped.
pub(super) struct Scratch(PathBuf);

impl Scratch {
    /// Names a workload's folder below the system's temporary folder, without creating it.
    pub(super) fn new(workload: &str) -> Scratch {
        // Two threads may run the same workload.
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        Scratch(std::env::temp_dir().join(format!("catseye-{workload}-{}-{number}", std::process::id())))
    }

    /// Creates the folder and writes these files into it, given as (name, text).
    ///
    /// # Errors
    /// Returns an error if the folder or a file cannot be written.
    pub(super) fn with(workload: &str, files: &[(&str, &str)]) -> Result<Scratch> {
        let scratch = Scratch::new(workload);
        fs::create_dir_all(&scratch.0).map_err(|e| Error::io(&scratch.0, e))?;
        for (name, text) in files {
            let path = scratch.0.join(name);
            fs::write(&path, text).map_err(|e| Error::io(&path, e))?;
        }
        Ok(scratch)
    }

    pub(super) fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}
