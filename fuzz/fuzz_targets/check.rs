//! What every reader owes: a result, or one line about the input.

use catseye::Result;

/// Passes on what was read. Panics where the complaint is not one line about the input.
#[allow(dead_code)] // each target takes its share
pub fn read<T>(result: Result<T>) -> Option<T> {
    match result {
        Ok(value) => Some(value),
        Err(e) => {
            let line = e.to_string();
            assert_eq!(e.exit_code(), 2, "not the input's fault: {line}");
            assert!(!line.contains('\n'), "more than a line: {line}");
            for word in ["usize", "isize", "f64", "f32", "u32", "i64", "u64"] {
                // What stands in the input may name one.
                assert!(!line.contains(&format!("expected {word}")), "names a type: {line}");
            }
            None
        }
    }
}

/// A file of this process that holds the bytes.
#[allow(dead_code)]
pub fn file(name: &str, bytes: &[u8]) -> std::path::PathBuf {
    let path = std::env::temp_dir().join(format!("catseye-fuzz-{}-{name}", std::process::id()));
    std::fs::write(&path, bytes).expect("the folder for temporary files takes a file");
    path
}
