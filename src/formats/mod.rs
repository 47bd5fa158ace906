//! Files: NumPy arrays and CSV tables, what is read of others, and results that appear under their name only when
//! complete.
//!
//! Readers refuse what they cannot represent, with file and line, instead of converting it; columns have their unit at
//! the end of their name ([`column::unit`]).

pub mod column;
pub mod csv;
pub mod input;
pub mod lock;
pub mod npy;
#[cfg(feature = "parquet")]
pub mod parquet_table;
pub mod rcs_csv;
pub mod stage;
pub mod text;

use crate::base::error::{BadInput, Result};
use std::path::Path;

/// Serialises a path as text. Where its bytes are not UTF-8, U+FFFD stands in their place, since JSON holds nothing else.
///
/// # Errors
/// Returns an error if the serialiser fails.
pub fn path_text<S: serde::Serializer>(path: &Path, serializer: S) -> std::result::Result<S::Ok, S::Error> {
    serializer.serialize_str(&path.to_string_lossy())
}

/// Checks an output's extension.
///
/// # Errors
/// Returns an error if the name of an output ends otherwise than what is written into it. A name without an extension
/// is left as it is.
pub fn check_extension(path: &Path, written: &[&str]) -> Result<()> {
    let Some(extension) = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()) else {
        return Ok(());
    };
    if written.contains(&extension.as_str()) {
        return Ok(());
    }
    let list = written.iter().map(|e| format!(".{e}")).collect::<Vec<_>>().join(", ");
    Err(BadInput::new(format!("cannot be written as .{extension}"))
        .file(path)
        .allowed(list)
        .remedy("give the output a name with an allowed extension")
        .into())
}
