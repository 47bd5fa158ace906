//! JSON documents: truth of frames, manifests, reports.

use super::differences::{Difference, DifferenceTally, Tolerances};
use super::measure::Measure;
use catseye::base::error::{BadInput, Result, json_in_words};
use catseye::formats::{input, text};
use serde_json::{Map, Value};
use std::path::Path;

/// Keys of manifests and reports that state what made a result, when and where, and not its content.
const OF_THE_MAKING: [&str; 15] = [
    "catseye",
    "checksums",
    "device",
    "driver",
    "engine",
    "folder",
    "kind",
    "radar",
    "repaired",
    "resumed",
    "scenario",
    "scenario_name",
    "sources",
    "synthesis",
    "trace",
];

fn is_of_the_making(key: &str) -> bool {
    OF_THE_MAKING.contains(&key) || key.starts_with("seconds")
}

/// Reads a JSON file; a file with one document per line gives the list of them.
///
/// # Errors
/// Returns `BadInput` with the line for a file that is not JSON.
pub fn read(path: &Path) -> Result<Value> {
    let text = text::read(path, "a JSON file", input::LARGEST_TEXT)?;
    let several = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("jsonl"));
    let read: serde_json::Result<Value> = match several {
        true => serde_json::Deserializer::from_str(&text).into_iter::<Value>().collect(),
        false => serde_json::from_str(&text),
    };
    read.map_err(|e| {
        BadInput::new(format!("damaged: {}", json_in_words(&e)))
            .file(path)
            .line(e.line())
            .remedy("bring back the file that was written")
            .into()
    })
}

/// A key with the path of its value.
struct At<'a> {
    file: &'a str,
    /// The last key, whose ending is the unit.
    name: &'a str,
    /// Path with the indices of elements.
    path: String,
    /// Path without them.
    what: String,
    /// Whether numbers are levels in dB, as a unit beside them states.
    is_level: bool,
    /// Size of the longest component if the value is part of a vector.
    scale: f64,
}

impl<'a> At<'a> {
    fn key(&self, name: &'a str) -> At<'a> {
        let dot = if self.path.is_empty() { "" } else { "." };
        At {
            name,
            path: format!("{}{dot}{name}", self.path),
            what: format!("{}{dot}{name}", self.what),
            scale: 0.0,
            ..*self
        }
    }

    fn element(&self, i: usize, scale: f64) -> At<'a> {
        At { path: format!("{}[{i}]", self.path), what: format!("{}[]", self.what), scale, ..*self }
    }

    fn unequal(&self, a: &Value, b: &Value) -> Difference {
        // For tables and lists the length is enough.
        let short = |v: &Value| match v {
            Value::Array(list) => Value::String(format!("{} elements", list.len())),
            Value::Object(keys) => Value::String(format!("{} keys", keys.len())),
            v => v.clone(),
        };
        let what = if self.what.is_empty() { "document" } else { &self.what };
        Difference::unequal(self.file, what, &*self.path, short(a), short(b))
    }
}

fn longest(list: &[Value]) -> f64 {
    list.iter().filter_map(Value::as_f64).fold(0.0, |most, x| most.max(x.abs()))
}

fn is_level(keys: &Map<String, Value>) -> bool {
    keys.get("unit").and_then(Value::as_str).is_some_and(|u| u.starts_with("dB"))
}

fn walk(
    at: &At<'_>,
    a: &Value,
    b: &Value,
    skip: fn(&str) -> bool,
    t: &Tolerances,
    found: &mut DifferenceTally,
) {
    match (a, b) {
        (Value::Object(x), Value::Object(y)) => {
            let level = is_level(x) && is_level(y);
            for (key, value) in x.iter().filter(|(k, _)| !skip(k)) {
                let at = At { is_level: level, ..at.key(key) };
                match y.get(key) {
                    Some(other) => walk(&at, value, other, skip, t, found),
                    None => found.note(at.unequal(value, &Value::Null)),
                }
            }
            for (key, value) in y.iter().filter(|(k, _)| !x.contains_key(*k) && !skip(k)) {
                found.note(at.key(key).unequal(&Value::Null, value));
            }
        }
        (Value::Array(x), Value::Array(y)) if x.len() == y.len() => {
            let scale = longest(x).max(longest(y));
            for (i, (value, other)) in x.iter().zip(y).enumerate() {
                walk(&at.element(i, scale), value, other, skip, t, found);
            }
        }
        (Value::Number(x), Value::Number(y)) => {
            found.values += 1;
            let measure = if at.is_level { Measure::level(t) } else { Measure::of(at.name, t) };
            let number = |n: &serde_json::Number| n.as_f64().unwrap_or(f64::NAN);
            let d = measure.apart(number(x), number(y), at.scale);
            if d.is_too_far() {
                found.note(at.unequal(a, b).by(d.apart, d.allowed, d.unit));
            }
        }
        (a, b) => {
            found.values += 1;
            if a != b {
                found.note(at.unequal(a, b));
            }
        }
    }
}

/// Compares two documents key by key.
pub fn compare(file: &str, a: &Value, b: &Value, t: &Tolerances, found: &mut DifferenceTally) {
    walk(&top(file), a, b, |_| false, t, found);
}

/// Compares the content of two manifests or reports, but not what made them, when and where.
pub fn compare_figures(file: &str, a: &Value, b: &Value, t: &Tolerances, found: &mut DifferenceTally) {
    walk(&top(file), a, b, is_of_the_making, t, found);
}

fn top(file: &str) -> At<'_> {
    At { file, name: "", path: String::new(), what: String::new(), is_level: false, scale: 0.0 }
}
