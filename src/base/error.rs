//! One error type. Bad input is a single line that says where, what, the value, what is allowed
//! and what to do (exit code 2); everything else is exit code 1.

use std::fmt;
use std::path::{Path, PathBuf};

/// A result whose error is [`Error`] unless said otherwise.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// A complaint about something the user gave. Prints as one line of at most [`MAX_CHARS`] characters:
/// `FILE:LINE: KEY = VALUE: problem; allowed; remedy`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BadInput {
    /// File that the complaint is about.
    pub file: Option<PathBuf>,
    /// Line in it, from 1.
    pub line: Option<usize>,
    /// Key, argument or column.
    pub key: Option<String>,
    /// Value that was given.
    pub value: Option<String>,
    /// What is wrong with it.
    pub problem: String,
    /// The allowed range or the list of allowed values.
    pub allowed: Option<String>,
    /// What to do about it.
    pub remedy: Option<String>,
    /// The list of allowed values is printed to its end, however long the line gets.
    pub allowed_whole: bool,
}

impl BadInput {
    /// A complaint with its problem in words.
    pub fn new(problem: impl Into<String>) -> Self {
        BadInput { problem: problem.into(), ..Default::default() }
    }
    /// Adds the file.
    pub fn file(mut self, file: impl AsRef<Path>) -> Self {
        self.file = Some(file.as_ref().to_path_buf());
        self
    }
    /// Adds the line, from 1.
    pub fn line(mut self, line: usize) -> Self {
        self.line = Some(line);
        self
    }
    /// Adds the key, argument or column.
    pub fn key(mut self, key: impl Into<String>) -> Self {
        self.key = Some(key.into());
        self
    }
    /// Adds the value that was given.
    pub fn value(mut self, value: impl fmt::Display) -> Self {
        self.value = Some(value.to_string());
        self
    }
    /// Adds what would be allowed.
    pub fn allowed(mut self, allowed: impl Into<String>) -> Self {
        self.allowed = Some(allowed.into());
        self
    }
    /// States the allowed values as [`BadInput::allowed`] does, in a list that is never cut.
    pub fn allowed_whole(mut self, allowed: impl Into<String>) -> Self {
        self.allowed_whole = true;
        self.allowed(allowed)
    }
    /// Adds what to do about it.
    pub fn remedy(mut self, remedy: impl Into<String>) -> Self {
        self.remedy = Some(remedy.into());
        self
    }
}

/// Largest number of characters of one error: 300 with the "error: " before it.
pub const MAX_CHARS: usize = 293;

impl fmt::Display for BadInput {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let whole = self.line_of(&self.allowed);
        if self.allowed_whole || whole.chars().count() <= MAX_CHARS {
            return f.write_str(&whole);
        }
        // What says most comes last to be cut: long values and paths first, then the list of what is allowed.
        let mut short = BadInput {
            value: self.value.as_deref().map(|v| shortened(v, 60)),
            problem: String::new(),
            remedy: self.remedy.as_deref().map(|r| shortened(r, 70)),
            key: self.key.as_deref().map(|k| shortened(k, 50)),
            file: self.file.as_deref().map(|p| shortened_path(p, 80).into()),
            ..self.clone()
        };
        let least = if self.allowed.is_some() {
            120
        } else {
            MAX_CHARS.saturating_sub(short.line_of(&None).chars().count())
        };
        short.problem = shortened(&self.problem, least.max(60));
        let frame = short.line_of(&None).chars().count();
        let room = MAX_CHARS.saturating_sub(frame + "; allowed: ".len());
        let allowed = self.allowed.as_deref().and_then(|a| self.shortened_list(a, room));
        let line = short.line_of(&allowed);
        f.write_str(&shortened(&line, MAX_CHARS))
    }
}

impl BadInput {
    /// All that is known, with this in place of what is allowed. One line, whatever a library's message or a file's name holds.
    fn line_of(&self, allowed: &Option<String>) -> String {
        let mut out = String::new();
        if let Some(file) = &self.file {
            out += &file.display().to_string();
            if let Some(line) = self.line {
                out += &format!(":{line}");
            }
            out += ": ";
        }
        match (&self.key, &self.value) {
            (Some(k), Some(v)) => out += &format!("{k} = {v}: "),
            (Some(k), None) => out += &format!("{k}: "),
            (None, Some(v)) => out += &format!("{v}: "),
            (None, None) => {}
        }
        out += &self.problem;
        if let Some(a) = allowed {
            out += &format!("; allowed: {a}");
        }
        if let Some(r) = &self.remedy {
            out += &format!("; {r}");
        }
        out.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
    }

    /// The complaint about the value at `place`, whose file, line, key and value it takes.
    pub fn placed(self, place: BadInput) -> BadInput {
        BadInput { file: place.file, line: place.line, key: place.key, value: place.value, ..self }
    }

    /// As many of the allowed words as `room` characters hold: those nearest to the value (or the key) first, "… and N more" behind
    /// them. None when not even one fits.
    fn shortened_list(&self, allowed: &str, room: usize) -> Option<String> {
        if allowed.chars().count() <= room {
            return Some(allowed.to_string());
        }
        let mut words: Vec<&str> = allowed.split(", ").collect();
        let key = self.key.as_deref().and_then(|k| k.rsplit('.').next());
        let given = self.value.as_deref().or(key).unwrap_or("").trim_matches('"').to_lowercase();
        words.sort_by_key(|w| edit_distance(&given, w));
        let mut list = String::new();
        for (i, word) in words.iter().enumerate() {
            let more = format!("{list}{}{word}", if i == 0 { "" } else { ", " });
            if more.chars().count() + " … and 9999 more".chars().count() > room {
                return (i > 0).then(|| format!("{list} … and {} more", words.len() - i));
            }
            list = more;
        }
        Some(list)
    }

    /// As JSON: each part that is known, and the line as people read it.
    fn json(&self) -> serde_json::Map<String, serde_json::Value> {
        let mut map = serde_json::Map::new();
        let text = |s: &String| serde_json::Value::from(s.clone());
        let parts = [
            ("file", self.file.as_ref().map(|f| f.display().to_string().into())),
            ("line", self.line.map(serde_json::Value::from)),
            ("key", self.key.as_ref().map(text)),
            ("value", self.value.as_ref().map(text)),
            ("problem", Some(text(&self.problem))),
            ("allowed", self.allowed.as_ref().map(text)),
            ("remedy", self.remedy.as_ref().map(text)),
        ];
        map.extend(parts.into_iter().filter_map(|(k, v)| Some((k.to_string(), v?))));
        map
    }
}

/// The name that an output will have, for a path in it while it is made (`formats/stage.rs`): nobody knows the hidden one.
fn final_name(path: &Path) -> PathBuf {
    let mut out = PathBuf::new();
    let mut parts = path.components().peekable();
    while let Some(part) = parts.next() {
        let shown = part.as_os_str().to_string_lossy();
        let hidden = shown.strip_prefix('.').unwrap_or("");
        if let Some((name, _)) = hidden.rsplit_once(".partial-") {
            out.push(name);
        } else if let Some(name) = hidden.strip_suffix(".unfinished") {
            out.push(name);
            parts.next_if(|p| p.as_os_str() == "result");
        } else {
            out.push(part);
        }
    }
    out
}

/// Shortens `text` to at most `most` characters, leaving out its end.
fn shortened(text: &str, most: usize) -> String {
    match text.chars().count() <= most {
        true => text.to_string(),
        false => text.chars().take(most - 1).chain(['…']).collect(),
    }
}

/// Shortens a path to at most `most` characters, leaving out its beginning: its end says which file it is.
fn shortened_path(path: &Path, most: usize) -> String {
    let text = path.display().to_string();
    let count = text.chars().count();
    match count <= most {
        true => text,
        false => std::iter::once('…').chain(text.chars().skip(count + 1 - most)).collect(),
    }
}

/// All errors of the library.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The user's input is at fault: exit code 2.
    #[error("{0}")]
    Input(Box<BadInput>),
    /// The adapter failed or was refused: exit code 1.
    #[error("gpu: {problem} (kernel {kernel}, adapter {adapter}, driver {driver})")]
    Gpu {
        /// What failed.
        problem: String,
        /// The shader at work, empty where there is none.
        kernel: String,
        /// Name of the adapter.
        adapter: String,
        /// Its driver.
        driver: String,
    },
    /// Reading or writing failed: exit code 1.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A result that cannot be right (NaN, an accuracy not reached): exit code 1.
    #[error("{}", shortened(.0, MAX_CHARS))]
    Failed(String),
    /// Ended by Ctrl-C, with what is kept and how to go on: exit code 130.
    #[error("interrupted: {0}")]
    Interrupted(String),
}

impl Error {
    /// The error of reading or writing the file at `path`.
    pub fn io(path: impl AsRef<Path>, source: std::io::Error) -> Self {
        let source = match source.kind() {
            kind @ std::io::ErrorKind::FileTooLarge => {
                let remedy = "raise the limit of file sizes (ulimit -f)";
                std::io::Error::new(kind, format!("{source}; {remedy}"))
            }
            _ => source,
        };
        Error::Io { path: final_name(path.as_ref()), source }
    }
    /// The exit code of the program: 2 for bad input, 1 for all else.
    pub fn exit_code(&self) -> u8 {
        match self {
            Error::Input(_) => 2,
            Error::Interrupted(_) => 130,
            _ => 1,
        }
    }

    /// Adds the file that was at fault, where none is named.
    pub fn in_file(self, file: &Path) -> Error {
        match self {
            Error::Input(b) if b.file.is_none() => b.file(file).into(),
            e => e,
        }
    }

    /// The error as JSON, for `--json`: `{"error": {"message": …, "exit_code": …}}`; for a bad input file also line,
    /// key, value, problem, what is allowed and the remedy, as far as they are known.
    pub fn json(&self) -> serde_json::Value {
        let mut error = serde_json::Map::new();
        error.insert("message".into(), self.to_string().into());
        match self {
            Error::Input(b) => error.extend(b.json()),
            Error::Io { path, .. } => {
                error.insert("file".into(), path.display().to_string().into());
            }
            Error::Gpu { .. } | Error::Failed(_) | Error::Interrupted(_) => {}
        }
        error.insert("exit_code".into(), self.exit_code().into());
        serde_json::json!({ "error": error })
    }
}

impl From<Box<BadInput>> for Error {
    fn from(b: Box<BadInput>) -> Self {
        Error::Input(b)
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

/// Puts a complaint of serde into words of the file: what is wrong, and what is allowed.
pub fn in_words(message: &str) -> (String, Option<String>) {
    let message = one_line(message);
    let Some((found, expected)) = message.split_once(", expected ") else { return (message, None) };
    let count = |words: &str| -> Option<String> {
        Some(words.split(' ').find(|w| w.bytes().all(|b| b.is_ascii_digit()))?.to_string())
    };
    let allowed = match expected {
        "u8" => "a whole number from 0 to 255".into(),
        "u16" => "a whole number from 0 to 65535".into(),
        "u32" => "a whole number from 0 to 4294967295".into(),
        "u64" | "usize" | "u128" => "a whole number from 0".into(),
        "i8" => "a whole number from -128 to 127".into(),
        "i16" => "a whole number from -32768 to 32767".into(),
        "i32" => "a whole number from -2147483648 to 2147483647".into(),
        "i64" | "isize" | "i128" => "a whole number".into(),
        "f32" | "f64" => "a number".into(),
        "a boolean" => "true or false".into(),
        "a string" | "string" => "text in quotes".into(),
        "a sequence" | "a list" => "a list in brackets".into(),
        "a map" | "map" => "a table".into(),
        "string or table" | "string or map" => "a name in quotes".into(),
        _ if expected.starts_with("struct ") => "a table".into(),
        _ if expected.starts_with("an array of length ") || expected.starts_with("a tuple of size ") => {
            format!("a list of {}", count(expected).unwrap_or_default())
        }
        _ if expected.starts_with("tuple ") || expected.starts_with("enum ") => {
            "what the manual names".into()
        }
        other => other.to_string(),
    };
    let problem = if let Some(n) = found.strip_prefix("invalid length ") {
        format!("has {n} {}", if n == "1" { "element" } else { "elements" })
    } else if found.starts_with("invalid value: integer ") {
        "is out of range".into()
    } else if let Some(kind) = found.strip_prefix("invalid type: ") {
        let kind = match kind.split(' ').next().unwrap_or("") {
            "floating" => "a number with a decimal point or exponent",
            "integer" => "a whole number",
            "boolean" => "true or false",
            "string" => "text",
            "sequence" => "a list",
            "map" => "a table",
            _ => "a value of another kind",
        };
        format!("is {kind}")
    } else if let Some(word) = found.split('`').nth(1).filter(|_| found.starts_with("unknown ")) {
        // Short words only: what a file of something else holds stays in it.
        let short = word.len() <= 32 && word.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_');
        let kind = if found.starts_with("unknown field") { "a key" } else { "a word" };
        format!("has {kind} that is not known{}", if short { format!(" ('{word}')") } else { String::new() })
    } else {
        "is not allowed".into()
    };
    (problem, Some(allowed))
}

/// Puts an error of a JSON document into words, in one line without the place.
pub fn json_in_words(e: &serde_json::Error) -> String {
    let message = e.to_string();
    match in_words(message.split(" at line ").next().unwrap_or_default()) {
        (problem, Some(allowed)) => format!("a value {problem}, where {allowed} is needed"),
        (problem, None) => problem,
    }
}

/// The text on one line, with control characters made visible.
pub fn one_line(s: &str) -> String {
    s.split_whitespace().collect::<Vec<_>>().join(" ")
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
    fn no_more_than_300_characters() {
        let words: Vec<String> = (0..60).map(|i| format!("quantity_{i:02}")).collect();
        let e = BadInput::new("is not a quantity")
            .file("a.toml")
            .line(3)
            .key("quantity")
            .value("\"quantity_31x\"")
            .allowed(words.join(", "))
            .remedy("choose one");
        let s = e.to_string();
        assert!(s.chars().count() <= MAX_CHARS, "{s}");
        assert!(
            s.contains("allowed: quantity_31, ") && s.contains(" … and ") && s.ends_with("; choose one"),
            "{s}"
        );
        let long = |n: usize| "ä/".repeat(n);
        let e = BadInput::new(long(500))
            .file(long(900))
            .key(long(300))
            .value(long(400))
            .allowed(long(9))
            .remedy(long(99));
        assert!(e.to_string().chars().count() <= MAX_CHARS);
        assert!(Error::Failed(long(900)).to_string().chars().count() <= MAX_CHARS);
        let whole = BadInput::new("no material").allowed_whole(words.join(", ")).to_string();
        assert!(words.iter().all(|w| whole.contains(w)));
    }

    #[test]
    fn hidden_names_are_not_shown() {
        for (made, shown) in [
            ("/a/.out.csv.partial-12-0", "/a/out.csv"),
            (".run.unfinished/result/frame_000000/adc.npy", "run/frame_000000/adc.npy"),
            (".run.unfinished/notes", "run/notes"),
            ("./.hidden/x.toml", "./.hidden/x.toml"),
            ("/dev/full", "/dev/full"),
        ] {
            assert_eq!(final_name(Path::new(made)), Path::new(shown));
        }
        let full = || std::io::Error::from(std::io::ErrorKind::StorageFull);
        assert!(Error::io("b/.cube.npy.partial-7-3", full()).to_string().starts_with("b/cube.npy: "));
    }

    #[test]
    fn as_json() {
        let e =
            Error::from(BadInput::new("must be positive").file("a.toml").line(3).key("samples").value(-1));
        let expect = serde_json::json!({ "error": { "message": "a.toml:3: samples = -1: must be positive", "file": "a.toml", "line": 3,
            "key": "samples", "value": "-1", "problem": "must be positive", "exit_code": 2 } });
        assert_eq!(e.json(), expect);
        assert_eq!(Error::Failed("x".into()).json()["error"]["exit_code"], 1);
    }

    #[test]
    fn nearest_name() {
        assert_eq!(nearest("aluminum", ["steel", "aluminium"]), Some("aluminium"));
        assert_eq!(nearest("xyz", ["steel", "aluminium"]), None);
    }
}
