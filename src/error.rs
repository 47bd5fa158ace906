//! One error type. Bad input is a single line that says where, what, the value, what is allowed
//! and what to do (exit code 2); everything else is exit code 1.

use std::fmt;
use std::path::{Path, PathBuf};

pub type Result<T, E = Error> = std::result::Result<T, E>;

/// A complaint about something the user gave. Prints as one line:
/// `FILE:LINE: KEY = VALUE: problem; allowed; remedy`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BadInput {
    pub file: Option<PathBuf>,
    pub line: Option<usize>,
    pub key: Option<String>,
    pub value: Option<String>,
    /// What is wrong with it.
    pub problem: String,
    /// The allowed range or the list of allowed values.
    pub allowed: Option<String>,
    /// What to do about it.
    pub remedy: Option<String>,
}

impl BadInput {
    pub fn new(problem: impl Into<String>) -> Self {
        BadInput { problem: problem.into(), ..Default::default() }
    }
    pub fn file(mut self, file: impl AsRef<Path>) -> Self {
        self.file = Some(file.as_ref().to_path_buf());
        self
    }
    pub fn line(mut self, line: usize) -> Self {
        self.line = Some(line);
        self
    }
    pub fn key(mut self, key: impl Into<String>) -> Self {
        self.key = Some(key.into());
        self
    }
    pub fn value(mut self, value: impl fmt::Display) -> Self {
        self.value = Some(value.to_string());
        self
    }
    pub fn allowed(mut self, allowed: impl Into<String>) -> Self {
        self.allowed = Some(allowed.into());
        self
    }
    pub fn remedy(mut self, remedy: impl Into<String>) -> Self {
        self.remedy = Some(remedy.into());
        self
    }
}

impl fmt::Display for BadInput {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(file) = &self.file {
            write!(f, "{}", file.display())?;
            if let Some(line) = self.line {
                write!(f, ":{line}")?;
            }
            write!(f, ": ")?;
        }
        match (&self.key, &self.value) {
            (Some(k), Some(v)) => write!(f, "{k} = {v}: ")?,
            (Some(k), None) => write!(f, "{k}: ")?,
            (None, Some(v)) => write!(f, "{v}: ")?,
            (None, None) => {}
        }
        // One line whatever a library's message holds.
        write!(f, "{}", self.problem.replace('\n', " "))?;
        if let Some(a) = &self.allowed {
            write!(f, "; allowed: {a}")?;
        }
        if let Some(r) = &self.remedy {
            write!(f, "; {r}")?;
        }
        Ok(())
    }
}

#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The user's input is at fault: exit code 2.
    #[error("{0}")]
    Input(Box<BadInput>),
    /// The adapter failed or was refused: exit code 1.
    #[error("gpu: {problem} (kernel {kernel}, adapter {adapter}, driver {driver})")]
    Gpu { problem: String, kernel: String, adapter: String, driver: String },
    /// Reading or writing failed: exit code 1.
    #[error("{}: {source}", path.display())]
    Io { path: PathBuf, source: std::io::Error },
    /// A result that cannot be right (NaN, an accuracy not reached): exit code 1.
    #[error("{0}")]
    Failed(String),
}

impl Error {
    pub fn io(path: impl AsRef<Path>, source: std::io::Error) -> Self {
        Error::Io { path: path.as_ref().to_path_buf(), source }
    }
    pub fn exit_code(&self) -> u8 {
        match self {
            Error::Input(_) => 2,
            _ => 1,
        }
    }
}

impl From<BadInput> for Error {
    fn from(b: BadInput) -> Self {
        Error::Input(Box::new(b))
    }
}

/// The nearest of `known` to `word` by edit distance, for "did you mean".
pub fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    known
        .into_iter()
        .map(|k| (edit_distance(word, k), k))
        .filter(|(d, k)| *d <= 1 + k.len().max(word.len()) / 3)
        .min()
        .map(|(_, k)| k)
}

fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, cb) in b.iter().enumerate() {
            let cost = diagonal + usize::from(ca != *cb);
            diagonal = row[j + 1];
            row[j + 1] = cost.min(row[j] + 1).min(row[j + 1] + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_line_with_everything() {
        let e = BadInput::new("must be\npositive")
            .file("a.toml")
            .line(3)
            .key("samples")
            .value(-1)
            .allowed("1..=65536")
            .remedy("give a count");
        let s = Error::from(e);
        assert_eq!(
            s.to_string(),
            "a.toml:3: samples = -1: must be positive; allowed: 1..=65536; give a count"
        );
        assert_eq!(s.exit_code(), 2);
    }

    #[test]
    fn nearest_name() {
        assert_eq!(nearest("aluminum", ["steel", "aluminium"]), Some("aluminium"));
        assert_eq!(nearest("xyz", ["steel", "aluminium"]), None);
    }
}
