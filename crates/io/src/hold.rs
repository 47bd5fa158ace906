//! Who is at work in a dataset: each run holds a lock on the folder, which the system takes back when its process ends,
//! however that comes about.

use catseye::base::error::{BadInput, Result};
use std::fs::{File, TryLockError};
use std::path::Path;

/// A share in the folder. Dropped, it is given back.
pub struct Hold {
    /// None where folders cannot be locked (some network disks, Windows): then nothing is known of others.
    folder: Option<File>,
}

impl Hold {
    /// Waits as long as somebody clears up.
    pub fn share(dir: &Path) -> Hold {
        Hold { folder: File::open(dir).ok().filter(|f| f.lock_shared().is_ok()) }
    }

    /// Whether no other run is at work: then none begins before this is dropped. None where that cannot be known.
    pub fn alone(&self) -> Option<bool> {
        match self.folder.as_ref()?.try_lock() {
            Ok(()) => Some(true),
            Err(TryLockError::WouldBlock) => Some(false),
            Err(TryLockError::Error(_)) => None,
        }
    }

    /// A share of one that changes what others rely on. Errors: others are at work.
    pub fn only(dir: &Path) -> Result<Hold> {
        let hold = Hold { folder: File::open(dir).ok() };
        match hold.alone() {
            Some(false) => Err(BadInput::new("another run is at work in it")
                .file(dir)
                .remedy("wait for its end, or stop it")
                .into()),
            _ => Ok(hold),
        }
    }
}
