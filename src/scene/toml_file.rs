//! TOML with serde such that each error is one line: file, line, key, value, what is allowed and what
//! to do. Fields that are checked after reading are [`At`], which remembers where its value stands.

use super::bounds;
use super::toml_value::{SPANNED, Value, Wrong, take_span};
use crate::base::error::{BadInput, Error, Result, in_words, nearest, one_line};
use crate::formats::text::number_hint;
pub use crate::formats::text::read as read_text_of;
use schemars::JsonSchema;
use serde::de::{DeserializeOwned, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt::Display;
use std::marker::PhantomData;
use std::ops::{Range, RangeBounds};
use std::path::{Component, Path, PathBuf};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// What a file of TOML is called in errors.
const WHAT: &str = "a TOML file";

/// Larger files are refused before they are read.
const MAX_BYTES: u64 = 16 << 20;

/// A value and the bytes of the file from which it came (empty when it did not come from a file).
#[derive(Debug, Clone, Default)]
pub struct At<T> {
    /// The value.
    pub value: T,
    /// Bytes of the value in the file.
    pub span: Range<usize>,
}

impl<T> From<T> for At<T> {
    fn from(value: T) -> Self {
        At { value, span: 0..0 }
    }
}

impl<T: PartialEq> PartialEq for At<T> {
    fn eq(&self, other: &Self) -> bool {
        self.value == other.value
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for At<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_newtype_struct(SPANNED, AtVisitor(PhantomData))
    }
}

struct AtVisitor<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for AtVisitor<T> {
    type Value = At<T>;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a value")
    }

    fn visit_newtype_struct<D: Deserializer<'de>>(self, deserializer: D) -> Result<At<T>, D::Error> {
        let span = take_span();
        T::deserialize(deserializer).map(|value| At { value, span })
    }
}

impl<T: Serialize> Serialize for At<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.value.serialize(serializer)
    }
}

impl<T: JsonSchema> JsonSchema for At<T> {
    fn inline_schema() -> bool {
        T::inline_schema()
    }
    fn schema_name() -> std::borrow::Cow<'static, str> {
        T::schema_name()
    }
    fn schema_id() -> std::borrow::Cow<'static, str> {
        T::schema_id()
    }
    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        T::json_schema(generator)
    }
}

/// A TOML file that has been parsed, and knows where each key stands.
pub struct Document<'a> {
    file: PathBuf,
    text: &'a str,
    tree: Spanned<DeValue<'a>>,
}

/// Reads the text of a TOML file.
///
/// # Errors
/// Returns an error if the path is no regular file, or if the file is larger than 16 MiB or not UTF-8.
pub fn read_text(path: &Path) -> Result<String> {
    read_text_of(path, WHAT, MAX_BYTES)
}

/// Path and text of a file that `name` gives below the folder of the document.
///
/// # Errors
/// Returns an error for a name that leaves the folder.
pub fn read_beside(doc: &Document<'_>, name: &At<String>) -> Result<(PathBuf, String)> {
    let relative = Path::new(&name.value);
    if !relative.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir)) {
        return Err(doc
            .bad(&name.span, "leaves the folder of the radar file")
            .allowed("a name below that folder")
            .remedy("copy the file beside the radar file")
            .into());
    }
    let path = doc.beside(name)?;
    let text = read_text(&path)?;
    Ok((path, text))
}

/// The path that a value of the TOML file `of` names, relative to its folder; for readers that have let go of the
/// document.
///
/// # Errors
/// Returns an error, with its place in the file, if there is no such file.
pub fn referred(of: &Path, name: &At<String>) -> Result<PathBuf> {
    Document::parse(of, &read_text(of)?)?.beside(name)
}

impl<'a> Document<'a> {
    /// Parses `text`; `file` is named in errors.
    ///
    /// # Errors
    /// Returns an error with file and line if the text is not TOML.
    pub fn parse(file: impl AsRef<Path>, text: &'a str) -> Result<Self> {
        let file = file.as_ref().to_path_buf();
        match DeTable::parse(text) {
            Ok(tree) => {
                let span = tree.span();
                Ok(Document { file, text, tree: Spanned::new(span, DeValue::Table(tree.into_inner())) })
            }
            Err(e) => {
                let at = e.span().map_or(0, |s| s.start);
                let line = line_of(text, at);
                let mut b = BadInput::new(format!("is not TOML: {}", one_line(e.message())));
                // The line may be one of another kind of file, given by mistake or by somebody else: of its contents only a key
                // is repeated.
                let said = text.lines().nth(line - 1).and_then(|l| l.split_once('='));
                let key = said.map(|(key, _)| key.trim());
                let word = said.and_then(|(_, value)| value.split_whitespace().next());
                let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
                match is_toml(&file) {
                    true => b.key = key.filter(|k| k.chars().all(plain)).map(clip),
                    false => b.problem = "is not TOML".into(),
                }
                let hint = word.and_then(number_hint).unwrap_or("see https://toml.io for the syntax");
                Err(b.file(file).line(line).remedy(hint).into())
            }
        }
    }

    /// The file.
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// The path of a file that this one names, relative to its folder.
    ///
    /// # Errors
    /// Returns an error, with its place in the file, if there is no such file.
    pub fn beside(&self, name: &At<String>) -> Result<PathBuf> {
        let path = self.file.parent().unwrap_or(Path::new("")).join(&name.value);
        self.existing(&name.span, &path)?;
        Ok(path)
    }

    /// Checks that a file is there.
    ///
    /// # Errors
    /// Returns an error if the file at `path`, which the value at `span` names, is not there.
    pub fn existing(&self, span: &Range<usize>, path: &Path) -> Result<()> {
        match std::fs::metadata(path) {
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => Err(self
                .bad(span, format!("{}: no such file", path.display()))
                .remedy("paths are relative to the folder of the file that names them")
                .into()),
            _ => Ok(()),
        }
    }

    /// Reads the document as `T`, and compares each number and list with the bounds that the fields of `T` state
    /// (`#[schemars(range(…))]`).
    ///
    /// # Errors
    /// Returns an error for unknown keys (with the nearest), missing keys, wrong types, lists that are too long or too
    /// short, and for the first value outside its bounds, with what the key means.
    pub fn read<T: DeserializeOwned + JsonSchema + 'static>(&self) -> Result<T> {
        let read = self.read_unbounded()?;
        match bounds::first_violation(&self.tree, &bounds::schema::<T>()) {
            None => Ok(read),
            Some(v) => Err(self.bad(&v.span, v.problem).allowed(v.allowed).remedy(v.meaning).into()),
        }
    }

    /// Reads the document as `T`, whose own code checks the values.
    ///
    /// # Errors
    /// Returns the errors of [`Document::read`], except those about bounds.
    pub fn read_unbounded<T: DeserializeOwned>(&self) -> Result<T> {
        T::deserialize(Value(&self.tree))
            .map_err(|Wrong { message, span }| self.complaint(&message, span).into())
    }

    /// Compares settings that were not read from a file with the bounds that their type states, as [`Document::read`] does; `key` is
    /// that of their table, as in `lane.markers`.
    ///
    /// # Errors
    /// Returns an error for the first value outside its bounds, with its key and what that means.
    pub fn check_bounds<T: Serialize + JsonSchema + 'static>(key: &str, settings: &T) -> Result<()> {
        let failed = |e: toml::ser::Error| Error::Failed(format!("{key} as TOML: {e}"));
        let own = toml::Value::try_from(settings).map_err(failed)?;
        let nested = key
            .rsplit('.')
            .fold(own, |inner, name| toml::Value::Table(toml::Table::from_iter([(name.to_string(), inner)])));
        let text = toml::to_string(&nested).map_err(failed)?;
        // The name says that values may be repeated in errors.
        let doc = Document::parse("settings.toml", &text)?;
        let mut table = &doc.tree;
        for name in key.split('.') {
            match table.get_ref() {
                DeValue::Table(outer) if outer.contains_key(name) => table = &outer[name],
                _ => return Ok(()),
            }
        }
        match bounds::first_violation(table, &bounds::schema::<T>()) {
            None => Ok(()),
            Some(v) => {
                let bad = doc.bad(&v.span, v.problem).allowed(v.allowed).remedy(v.meaning);
                Err(BadInput { file: None, line: None, ..bad }.into())
            }
        }
    }

    /// A complaint about the value at `span`: file, line, key and value are filled in.
    pub fn bad(&self, span: &Range<usize>, problem: impl Into<String>) -> BadInput {
        let mut b = BadInput::new(problem).file(&self.file);
        if span.is_empty() {
            return b;
        }
        b = b.line(line_of(self.text, span.start));
        if let Some(found) = self.locate(span) {
            b = b.key(found.path);
            if let Some(v) = self.text.get(found.value).filter(|_| !found.is_table && is_toml(&self.file)) {
                b = b.value(clip(v));
            }
        }
        b
    }

    /// Returns the value if it lies in the range.
    ///
    /// # Errors
    /// Returns an error of one line with the range if the value lies outside it.
    pub fn in_range<T, R>(&self, at: &At<T>, range: R, remedy: &str) -> Result<T>
    where
        T: PartialOrd + Copy + Display,
        R: RangeBounds<T> + RangeText,
    {
        if range.contains(&at.value) {
            return Ok(at.value);
        }
        Err(self.bad(&at.span, "is out of range").allowed(range.text()).remedy(remedy).into())
    }

    /// Returns the value if it is finite.
    ///
    /// # Errors
    /// Returns an error with file, line, key and value if the value is not finite.
    pub fn finite(&self, at: &At<f64>, remedy: &str) -> Result<f64> {
        if at.value.is_finite() {
            return Ok(at.value);
        }
        Err(self.bad(&at.span, "is not a finite number").remedy(remedy).into())
    }

    /// Checks three numbers: finite and no larger than a million (metres, metres per second).
    ///
    /// # Errors
    /// Returns an error with file, line, key and value if a number is not finite or too large.
    pub fn vector(&self, at: &At<[f64; 3]>) -> Result<glam::DVec3> {
        if at.value.iter().all(|x| x.abs() <= 1e6) {
            return Ok(at.value.into());
        }
        Err(self
            .bad(&at.span, "must be three finite numbers")
            .allowed("-1e6..=1e6 each")
            .remedy("give [x, y, z]: forward, left, up")
            .into())
    }

    fn complaint(&self, message: &str, span: Option<Range<usize>>) -> BadInput {
        let span = span.unwrap_or(0..0);
        let line = line_of(self.text, span.start);
        let found = self.locate(&span);
        let quoted: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
        let mut b = BadInput::default().file(&self.file).line(line);
        if let Some(rest) = message.strip_prefix("unknown field ") {
            let (word, known) = (quoted.first().copied().unwrap_or(""), quoted.get(1..).unwrap_or(&[]));
            b = b.key(found.map_or(word.to_string(), |f| f.path));
            b.problem = "unknown key".into();
            if !known.is_empty() && !rest.is_empty() {
                b = b.allowed(known.join(", "));
            }
            return b.remedy(match nearest(word, known.iter().copied()) {
                Some(n) => format!("did you mean '{n}'?"),
                None => "remove the key".into(),
            });
        }
        if message.starts_with("missing field ") {
            let word = quoted.first().copied().unwrap_or("");
            // The whole file has no span, and the first table of one that begins with a table would answer to it.
            let key = match found.filter(|_| !span.is_empty()) {
                Some(f) => format!("{}.{word}", f.path),
                None => word.to_string(),
            };
            b.problem = "is missing".into();
            return b.key(key).remedy("add it (catseye init writes a commented example)");
        }
        if let Some(f) = found {
            if let Some(v) = self.text.get(f.value).filter(|_| !f.is_table && is_toml(&self.file)) {
                b = b.value(clip(v));
            }
            b = b.key(f.path);
        }
        if message.starts_with("unknown variant ") {
            let (word, known) = (quoted.first().copied().unwrap_or(""), quoted.get(1..).unwrap_or(&[]));
            b.problem = "is not one of the choices".into();
            b = b.allowed(known.join(", "));
            if let Some(n) = nearest(word, known.iter().copied()) {
                b = b.remedy(format!("did you mean '{n}'?"));
            }
            return b;
        }
        let (problem, allowed) = in_words(message);
        b.problem = problem;
        b.allowed = allowed;
        b
    }

    /// The innermost key whose name or value covers `span`.
    fn locate(&self, span: &Range<usize>) -> Option<LocatedKey> {
        let mut best = None;
        if let DeValue::Table(table) = self.tree.get_ref() {
            search(table, "", span, &mut best);
        }
        best
    }
}

/// A key of the file: its path, where its value stands, whether that is a table, and the length of its span.
struct LocatedKey {
    path: String,
    value: Range<usize>,
    is_table: bool,
    len: usize,
}

fn search(table: &DeTable<'_>, prefix: &str, span: &Range<usize>, best: &mut Option<LocatedKey>) {
    for (key, value) in table {
        let name = key.get_ref();
        let path = if prefix.is_empty() { name.to_string() } else { format!("{prefix}.{name}") };
        visit(&path, Some(key.span()), value, span, best);
    }
}

fn visit(
    path: &str,
    key: Option<Range<usize>>,
    value: &Spanned<DeValue<'_>>,
    span: &Range<usize>,
    best: &mut Option<LocatedKey>,
) {
    let covers = |r: &Range<usize>| r.start <= span.start && span.end <= r.end && !r.is_empty();
    for r in [key, Some(value.span())].into_iter().flatten() {
        if covers(&r) && best.as_ref().is_none_or(|b| r.len() <= b.len) {
            let is_table = matches!(value.get_ref(), DeValue::Table(_));
            *best = Some(LocatedKey { path: path.into(), value: value.span(), is_table, len: r.len() });
        }
    }
    match value.get_ref() {
        DeValue::Table(t) => search(t, path, span, best),
        DeValue::Array(a) => {
            for (i, v) in a.iter().enumerate() {
                visit(&format!("{path}[{i}]"), None, v, span, best);
            }
        }
        _ => {}
    }
}

fn line_of(text: &str, at: usize) -> usize {
    text.as_bytes()[..at.min(text.len())].iter().filter(|b| **b == b'\n').count() + 1
}

/// Whether a file's name says that it is one of ours, whose contents a message may repeat.
fn is_toml(file: &Path) -> bool {
    file.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"))
}

/// Shortens a text to at most 60 characters of one line.
pub(crate) fn clip(s: &str) -> String {
    let s: String = s.trim().chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    if s.chars().count() <= 60 { s } else { s.chars().take(57).chain("...".chars()).collect() }
}

/// Writes ranges for people.
pub trait RangeText {
    /// The range in words.
    fn text(&self) -> String;
}

impl<T: Display> RangeText for std::ops::RangeInclusive<T> {
    fn text(&self) -> String {
        format!("{}..={}", self.start(), self.end())
    }
}

/// A range of values more than `low`, and at most `high`.
pub struct Above<T> {
    /// Excluded lower end.
    pub low: T,
    /// Included upper end.
    pub high: T,
}

impl<T: PartialOrd> RangeBounds<T> for Above<T> {
    fn start_bound(&self) -> std::ops::Bound<&T> {
        std::ops::Bound::Excluded(&self.low)
    }
    fn end_bound(&self) -> std::ops::Bound<&T> {
        std::ops::Bound::Included(&self.high)
    }
}

impl<T: Display> RangeText for Above<T> {
    fn text(&self) -> String {
        format!("more than {}, at most {}", self.low, self.high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[derive(Debug, Deserialize, JsonSchema)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code)] // read by serde only
    struct File {
        samples: At<u32>,
        part: Vec<Part>,
        sampling: Option<Kind>,
    }
    #[derive(Debug, Deserialize, JsonSchema)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code)]
    struct Part {
        power_dbm: At<f64>,
        position_m: Option<At<[f64; 3]>>,
    }
    #[derive(Debug, Deserialize, JsonSchema)]
    #[serde(rename_all = "lowercase")]
    enum Kind {
        Real,
        Iq,
    }

    fn complaint(text: &str) -> String {
        let r = Document::parse("a.toml", text).and_then(|d| d.read::<File>().map(|_| ()));
        r.unwrap_err().to_string()
    }

    #[test]
    fn every_error_says_where_what_and_the_remedy() {
        let ok = "samples = 4\n[[part]]\npower_dbm = 1\n";
        let doc = Document::parse("a.toml", ok).unwrap();
        let file: File = doc.read().unwrap();
        assert_eq!(file.part[0].power_dbm.value, 1.0);
        assert_eq!(
            doc.in_range(&file.part[0].power_dbm, 5.0..=9.0, "more").unwrap_err().to_string(),
            "a.toml:3: part[0].power_dbm = 1: is out of range; allowed: 5..=9; more"
        );
        assert_eq!(
            complaint("samples = 4\nsampels = 5\npart = []"),
            "a.toml:2: sampels: unknown key; allowed: samples, part, sampling; did you mean 'samples'?"
        );
        assert_eq!(
            complaint("samples = 4\n[[part]]\npower_dbm = 1\npower_dbw = 1\n"),
            "a.toml:4: part[0].power_dbw: unknown key; allowed: power_dbm, position_m; did you mean 'power_dbm'?"
        );
        let e = complaint("part = []\n\nsamples = -4");
        assert_eq!(
            e,
            "a.toml:3: samples = -4: is out of range; allowed: a whole number from 0 to 4294967295"
        );
        let e = complaint("part = []\nsamples = \"x\"");
        assert!(e.starts_with("a.toml:2: samples = \"x\": is text; allowed: a whole number from 0"), "{e}");
        for (list, n) in [("[1, 2, 3, 9]", 4), ("[1, 2]", 2), ("[]", 0), ("[[1, 2, 3], 4, 5, 6]", 4)] {
            let e = complaint(&format!("samples = 1\n[[part]]\npower_dbm = 1\nposition_m = {list}\n"));
            let expect = match list.starts_with("[[") {
                true => {
                    "a.toml:4: part[0].position_m[0] = [1, 2, 3]: is a list; allowed: a number".to_string()
                }
                false => {
                    format!("a.toml:4: part[0].position_m = {list}: has {n} elements; allowed: a list of 3")
                }
            };
            assert_eq!(e, expect);
        }
        let e = complaint("samples = 1\n[[part]]\n");
        assert!(e.contains("part[0].power_dbm: is missing"), "{e}");
        let e = complaint("[[part]]\npower_dbm = 1\n");
        assert!(e.starts_with("a.toml:1: samples: is missing"), "{e}");
        let e = complaint("samples = 1\nsampling = \"iqq\"\npart = []");
        assert_eq!(
            e,
            "a.toml:2: sampling = \"iqq\": is not one of the choices; allowed: real, iq; did you mean 'iq'?"
        );
        let e = complaint("samples = 1\nx = = 2\n");
        assert!(e.starts_with("a.toml:2: x: is not TOML"), "{e}");
        let e = complaint("samples = 1\nx = 77,0e9 # Hz\n");
        assert!(
            e.starts_with("a.toml:2: x: is not TOML") && e.ends_with("write the decimal mark as a point"),
            "{e}"
        );
        let e = complaint("samples = 1\nsamples = 2\n");
        assert!(e.starts_with("a.toml:2: ") && e.contains("duplicate key"), "{e}");
    }

    #[test]
    fn hostile_files() {
        let dir = tempfile::tempdir().unwrap();
        assert!(read_text(dir.path()).unwrap_err().to_string().contains("is a directory"));
        let missing = read_text(&dir.path().join("x.toml")).unwrap_err();
        assert_eq!(missing.exit_code(), 2);
        let p = dir.path().join("latin.toml");
        std::fs::write(&p, b"a = 1\nname = \"\xe4\"\n").unwrap();
        assert!(read_text(&p).unwrap_err().to_string().contains("latin.toml:2: is not UTF-8"));
        // A mark and the line ends say nothing.
        for text in
            ["\u{feff}samples = 4\npart = []\n", "samples = 4\r\npart = []\r\n", "samples = 4\rpart = []\r"]
        {
            std::fs::write(&p, text).unwrap();
            let text = read_text(&p).unwrap();
            let file: File = Document::parse(&p, &text).unwrap().read().unwrap();
            assert_eq!((file.samples.value, file.samples.span.start), (4, 10));
        }
    }

    proptest! {
        #[test]
        fn text_never_panics_and_errors_are_one_line(text in "[ -~\n\"\\[\\]=.a-z0-9]{0,120}") {
            if let Err(e) = Document::parse("a.toml", &text).and_then(|d| d.read::<File>().map(|_| ())) {
                prop_assert!(!e.to_string().contains('\n'), "{}", e);
            }
        }
    }
}
