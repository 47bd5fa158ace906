//! A temporary folder for what a workload writes.

use catseye::base::error::{Error, Result};
use std::fs;
use std::path::{Path, PathBuf};

/// A folder that is removed when the work ends.
pub(super) struct Scratch(PathBuf);

impl Scratch {
    /// Names the folder of a workload, which does not exist yet, below the system's folder for temporary files.
    pub(super) fn new(workload: &str) -> Scratch {
        Scratch(std::env::temp_dir().join(format!("catseye-{workload}-{}", std::process::id())))
    }

    /// Makes the folder and writes these files into it, each a name and a text.
    ///
    /// # Errors
    /// What the disk says.
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
