//! The program as tests run it.

use std::path::Path;
use std::process::{Command, Output};

pub fn catseye(dir: &Path, args: &[&str]) -> Output {
    // The user's cache is left alone.
    let mut command = Command::new(env!("CARGO_BIN_EXE_catseye"));
    command.env("CATSEYE_CACHE", "off").current_dir(dir).args(args).output().unwrap()
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Exit code 0; what was printed.
pub fn done(dir: &Path, args: &[&str]) -> String {
    let out = catseye(dir, args);
    assert_eq!(out.status.code(), Some(0), "{args:?}: {}", text(&out.stderr));
    text(&out.stdout)
}

/// The project's folder.
pub fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}

/// Exit code 2, and one line that says all of `parts`.
pub fn refused(dir: &Path, args: &[&str], parts: &[&str]) -> String {
    let out = catseye(dir, args);
    let err = text(&out.stderr);
    assert_eq!(out.status.code(), Some(2), "{args:?}: {err}");
    let lines: Vec<&str> = err.lines().filter(|l| l.starts_with("error:")).collect();
    assert_eq!(lines.len(), 1, "{args:?}: {err}");
    for p in parts {
        assert!(lines[0].contains(p), "{args:?}: '{p}' is not in: {err}");
    }
    lines[0].to_string()
}
