//! Registers who works in a dataset: each run holds a lock on the folder, which the system releases when its
//! process ends in any way.

use catseye::base::error::{BadInput, Result};
use std::fs::{File, TryLockError};
use std::path::Path;

/// A share in the folder, given back when dropped.
pub struct Hold {
    /// The locked folder; None where folders cannot be locked (some network disks, Windows), and nothing is
    /// then known of others.
    folder: Option<File>,
}

impl Hold {
    /// Takes a share, after waiting for anybody who clears up.
    pub fn share(dir: &Path) -> Hold {
        Hold { folder: File::open(dir).ok().filter(|f| f.lock_shared().is_ok()) }
    }

    /// Whether no other run is at work; then none begins before this is dropped. None where that cannot be
    /// known.
    pub fn alone(&self) -> Option<bool> {
        match self.folder.as_ref()?.try_lock() {
            Ok(()) => Some(true),
            Err(TryLockError::WouldBlock) => Some(false),
            Err(TryLockError::Error(_)) => None,
        }
    }

    /// Takes a share for changing what others rely on. Returns an error if others are at work.
    pub fn only(dir: &Path) -> Result<Hold> {
        let hold = Hold { folder: File::open(dir).ok() };
        match hold.alone() {
            Some(false) => Err(BadInput::new("another run is working in this folder")
                .file(dir)
                .remedy("wait until it ends, or stop it")
                .into()),
            _ => Ok(hold),
        }
    }
}
