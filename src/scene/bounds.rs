//! Bounds of the keys of TOML files.
//!
//! A bound is stated once, beside the field of a table: `#[schemars(range(min = 1, max = 24))]`, or
//! `#[schemars(extend("exclusiveMinimum" = 0.0))]` where the end itself is excluded, or `#[schemars(length(max = 64))]` for
//! a list. From there it is in the JSON schema, with which editors check a file, in the reference pages, and in this
//! check: [`first_violation`] compares a document with the schema of its type. Bounds that depend on other keys are
//! checked where the table is built.

use schemars::JsonSchema;
use serde_json::{Map, Value as Json};
use std::any::TypeId;
use std::collections::HashMap;
use std::ops::Range;
use std::sync::{Arc, LazyLock, Mutex, PoisonError};
use toml::Spanned;
use toml::de::DeValue;

/// A value outside its bounds.
#[derive(Debug, PartialEq)]
pub(super) struct Violation {
    /// Bytes of the value in the file.
    pub span: Range<usize>,
    /// What is wrong.
    pub problem: String,
    /// The bounds in words.
    pub allowed: String,
    /// What the key means, from its description.
    pub meaning: String,
}

/// The schema of a type. To make one takes as long as all the rest of reading a small file, so that it is made once.
pub(super) fn schema<T: JsonSchema + 'static>() -> Arc<Json> {
    static SCHEMAS: LazyLock<Mutex<HashMap<TypeId, Arc<Json>>>> = LazyLock::new(Mutex::default);
    let mut schemas = SCHEMAS.lock().unwrap_or_else(PoisonError::into_inner);
    schemas.entry(TypeId::of::<T>()).or_insert_with(|| Arc::new(schemars::schema_for!(T).to_value())).clone()
}

/// The first value of a document, in the order of the file, that is outside the bounds that the schema of its type states.
pub(super) fn first_violation(document: &Spanned<DeValue<'_>>, schema: &Json) -> Option<Violation> {
    let walk = Walk { definitions: schema.get("$defs").and_then(Json::as_object) };
    walk.visit(document, schema, "")
}

struct Walk<'s> {
    definitions: Option<&'s Map<String, Json>>,
}

impl Walk<'_> {
    fn visit(&self, value: &Spanned<DeValue<'_>>, node: &Json, description: &str) -> Option<Violation> {
        // The description beside a reference is that of the key, and comes before that of the type.
        let own = node.get("description").and_then(Json::as_str).unwrap_or("");
        let description = if description.is_empty() { own } else { description };
        if let Some(definition) = self.referred(node) {
            return self.visit(value, definition, description);
        }
        for union in ["anyOf", "oneOf"] {
            let options = node.get(union).and_then(Json::as_array).into_iter().flatten();
            let mut violations = (options.filter(|option| self.holds(value, option)))
                .map(|option| self.visit(value, option, description))
                .peekable();
            if violations.peek().is_some() {
                // A value is right if one of the alternatives has nothing against it.
                return violations.collect::<Option<Vec<_>>>()?.into_iter().next();
            }
        }
        let violation = |problem: String, allowed: String| Violation {
            span: value.span(),
            problem,
            allowed,
            meaning: meaning(description),
        };
        match value.get_ref() {
            DeValue::Integer(_) | DeValue::Float(_) => {
                let (bounds, x) = (Bounds::of(node), number(value.get_ref())?);
                (!bounds.contain(x)).then(|| violation("is out of range".into(), bounds.text()))
            }
            DeValue::Array(list) => {
                let count = |key: &str| node.get(key).and_then(Json::as_u64);
                let (min, max) = (count("minItems").unwrap_or(0), count("maxItems"));
                let number = list.len() as u64;
                if number < min || max.is_some_and(|max| number > max) {
                    let allowed = match max {
                        Some(max) if max == min => format!("a list of {max}"),
                        Some(max) => format!("{min} to {max} elements"),
                        None if min == 1 => "one element or more".into(),
                        None => format!("{min} elements or more"),
                    };
                    return Some(violation(format!("has {number} elements"), allowed));
                }
                let items = node.get("items")?;
                list.iter().find_map(|element| self.visit(element, items, description))
            }
            DeValue::Table(table) => {
                let (named, others) = (node.get("properties"), node.get("additionalProperties"));
                let of_key = |key: &str| named.and_then(|n| n.get(key)).or(others);
                let all =
                    table.iter().filter_map(|(key, value)| self.visit(value, of_key(key.get_ref())?, ""));
                all.min_by_key(|violation| violation.span.start)
            }
            _ => None,
        }
    }

    fn referred(&self, node: &Json) -> Option<&Json> {
        let name = node.get("$ref")?.as_str()?.rsplit('/').next()?;
        self.definitions?.get(name)
    }

    /// Whether a value has the shape of an alternative, whatever its bounds.
    fn holds(&self, value: &Spanned<DeValue<'_>>, node: &Json) -> bool {
        if let Some(definition) = self.referred(node) {
            return self.holds(value, definition);
        }
        if let Some(options) = node.get("anyOf").or(node.get("oneOf")).and_then(Json::as_array) {
            return options.iter().any(|option| self.holds(value, option));
        }
        let word = |allowed: &Json| match value.get_ref() {
            DeValue::String(text) => allowed.as_str() == Some(text),
            _ => true,
        };
        let words = node.get("enum").and_then(Json::as_array);
        if node.get("const").is_some_and(|c| !word(c)) || words.is_some_and(|all| !all.iter().any(word)) {
            return false;
        }
        let types: Vec<&str> = match node.get("type") {
            Some(Json::String(one)) => vec![one],
            Some(Json::Array(all)) => all.iter().filter_map(Json::as_str).collect(),
            _ => return true,
        };
        let is = |name: &str| types.contains(&name);
        match value.get_ref() {
            DeValue::Integer(_) => is("integer") || is("number"),
            DeValue::Float(_) => is("number"),
            DeValue::Boolean(_) => is("boolean"),
            DeValue::Array(_) => is("array"),
            DeValue::String(_) | DeValue::Datetime(_) => is("string"),
            DeValue::Table(table) => {
                let named = node.get("properties").and_then(Json::as_object);
                let is_closed = node.get("additionalProperties") == Some(&Json::Bool(false));
                let known = |key: &str, value: &Spanned<DeValue<'_>>| match named.and_then(|n| n.get(key)) {
                    Some(node) => self.holds(value, node),
                    None => !is_closed,
                };
                is("object") && table.iter().all(|(key, value)| known(key.get_ref(), value))
            }
        }
    }
}

/// Bounds of a number, as a schema states them.
struct Bounds<'s> {
    min: Option<&'s Json>,
    above: Option<&'s Json>,
    max: Option<&'s Json>,
    below: Option<&'s Json>,
}

impl<'s> Bounds<'s> {
    fn of(node: &'s Json) -> Self {
        Bounds {
            min: node.get("minimum"),
            above: node.get("exclusiveMinimum"),
            max: node.get("maximum"),
            below: node.get("exclusiveMaximum"),
        }
    }

    /// Whether a number keeps every bound; NaN keeps none.
    fn contain(&self, x: f64) -> bool {
        let keeps = |bound: Option<&Json>, holds: fn(f64, f64) -> bool| {
            bound.and_then(Json::as_f64).is_none_or(|bound| holds(x, bound))
        };
        keeps(self.min, |x, b| x >= b)
            && keeps(self.above, |x, b| x > b)
            && keeps(self.max, |x, b| x <= b)
            && keeps(self.below, |x, b| x < b)
    }

    /// The bounds in words.
    fn text(&self) -> String {
        let low = match (self.min, self.above) {
            (_, Some(above)) => Some(format!("more than {}", digits(above))),
            (Some(min), None) if self.max.is_some() => return self.closed(min),
            (Some(min), None) => Some(format!("at least {}", digits(min))),
            (None, None) => None,
        };
        let high = match (self.max, self.below) {
            (_, Some(below)) => Some(format!("less than {}", digits(below))),
            (Some(max), None) => Some(format!("at most {}", digits(max))),
            (None, None) => None,
        };
        low.into_iter().chain(high).collect::<Vec<_>>().join(", ")
    }

    fn closed(&self, min: &Json) -> String {
        format!("{}..={}", digits(min), self.max.map(digits).unwrap_or_default())
    }
}

/// A number as TOML has it, short.
fn digits(number: &Json) -> String {
    match number.as_f64() {
        Some(x) if number.is_f64() && x != 0.0 && !(1e-3..1e6).contains(&x.abs()) => format!("{x:e}"),
        Some(x) if number.is_f64() => format!("{x}"),
        _ => number.to_string(),
    }
}

fn number(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Float(x) => x.as_str().parse().ok(),
        DeValue::Integer(i) => i128::from_str_radix(i.as_str(), i.radix()).ok().map(|x| x as f64),
        _ => None,
    }
}

/// The first clause of a key's description: what the value is, with its unit.
fn meaning(description: &str) -> String {
    let text = description.split_whitespace().collect::<Vec<_>>().join(" ");
    // Keys that belong to one kind begin with its word.
    let text = match text.strip_prefix('"').and_then(|rest| rest.split_once("\": ")) {
        Some((word, rest)) if !word.contains(' ') => rest,
        _ => &text,
    };
    let ends = ["; ", ". ", ": ", " (default", " (negative", " Default"];
    let end = ends.iter().filter_map(|e| text.find(e)).min().unwrap_or(text.len());
    let clause = text[..end].trim_end_matches('.');
    let mut letters = clause.chars();
    match (letters.next(), letters.clone().next()) {
        (Some(first), Some(second)) if second.is_lowercase() || second == ' ' => {
            first.to_lowercase().chain(letters).collect()
        }
        _ => clause.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::toml_file::{At, Document};
    use schemars::JsonSchema;
    use serde::Deserialize;
    use std::collections::BTreeMap;

    #[derive(Debug, Deserialize, JsonSchema)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code)] // read by serde only
    struct File {
        /// Centre frequency of the sweep, Hz; as in 77e9.
        #[schemars(range(min = 1e8, max = 3e12))]
        carrier_hz: At<f64>,
        /// "os": rank of the cell.
        #[schemars(range(min = 1))]
        rank: Option<At<usize>>,
        /// Duration of a ramp, s.
        #[serde(default)]
        #[schemars(range(max = 1.0), extend("exclusiveMinimum" = 0.0))]
        time_s: Option<f64>,
        /// Parts of it.
        #[serde(default)]
        #[schemars(length(max = 2))]
        part: Vec<Part>,
        #[serde(default)]
        named: BTreeMap<String, Part>,
        either: Option<Either>,
    }

    /// A part.
    #[derive(Debug, Deserialize, JsonSchema)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code)]
    struct Part {
        /// Gains of the channels, dB.
        #[schemars(inner(range(min = -40.0, max = 40.0)))]
        gain_db: Vec<f64>,
    }

    #[derive(Debug, Deserialize, JsonSchema)]
    #[serde(untagged)]
    #[allow(dead_code)]
    enum Either {
        Word(String),
        Part(Part),
    }

    fn error(text: &str) -> Option<String> {
        let read = |text| Document::parse("a.toml", text)?.read::<File>();
        read(text).err().map(|e| e.to_string())
    }

    #[test]
    fn a_value_outside_its_bounds_is_one_line() {
        let ok = "carrier_hz = 77e9\nrank = 1\ntime_s = 1.0\neither = \"x\"\n[[part]]\ngain_db = [-40, 40]\n";
        assert_eq!(error(ok), None);
        let is = |text: &str, want: &str| assert_eq!(error(text).as_deref(), Some(want));
        is(
            "carrier_hz = 77\n",
            "a.toml:1: carrier_hz = 77: is out of range; allowed: 1e8..=3e12; centre frequency of the sweep, Hz",
        );
        is(
            "carrier_hz = nan\n",
            "a.toml:1: carrier_hz = nan: is out of range; allowed: 1e8..=3e12; centre frequency of the sweep, Hz",
        );
        is(
            "carrier_hz = 77e9\nrank = 0\n",
            "a.toml:2: rank = 0: is out of range; allowed: at least 1; rank of the cell",
        );
        is(
            "carrier_hz = 77e9\ntime_s = 0.0\n",
            "a.toml:2: time_s = 0.0: is out of range; allowed: more than 0, at most 1; duration of a ramp, s",
        );
        // In the order of the file, not in that of the names.
        is(
            "time_s = 2\ncarrier_hz = 77\n",
            "a.toml:1: time_s = 2: is out of range; allowed: more than 0, at most 1; duration of a ramp, s",
        );
        let gain = "is out of range; allowed: -40..=40; gains of the channels, dB";
        let head = "carrier_hz = 77e9\n";
        is(
            &format!("{head}[[part]]\ngain_db = [1]\n[[part]]\ngain_db = [1, 41]\n"),
            &format!("a.toml:5: part[1].gain_db[1] = 41: {gain}"),
        );
        is(
            &format!("{head}named.x = {{ gain_db = [-inf] }}\n"),
            &format!("a.toml:2: named.x.gain_db[0] = -inf: {gain}"),
        );
        is(
            &format!("{head}either = {{ gain_db = [99] }}\n"),
            &format!("a.toml:2: either.gain_db[0] = 99: {gain}"),
        );
        is(
            &format!("{head}part = [{{ gain_db = [] }}, {{ gain_db = [] }}, {{ gain_db = [] }}]\n"),
            "a.toml:2: part = [{ gain_db = [] }, { gain_db = [] }, { gain_db = [] }]: has 3 elements; \
             allowed: 0 to 2 elements; parts of it",
        );
    }
}
