//! The keys of TOML files, from their schemas.

use catseye::base::error::{BadInput, Error, Result};
use serde_json::{Value, json};

/// Kinds of files and their schemas, which tests hold to be those of the readers.
const SCHEMAS: [(&str, &str); 5] = [
    ("scenario", include_str!("../../../../schema/scenario.schema.json")),
    ("road", include_str!("../../../../schema/road_scene.schema.json")),
    ("radar", include_str!("../../../../schema/radar.schema.json")),
    ("recipe", include_str!("../../../../schema/recipe.schema.json")),
    ("study", include_str!("../../../../schema/study.schema.json")),
];

/// A key of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Key {
    /// Kind of file.
    pub kind: &'static str,
    /// Name with those of its tables; `[]` follows an array of tables.
    pub name: String,
    /// Type of the value.
    pub of: String,
    /// Default, where the schema states one.
    pub default: Option<Value>,
    /// Whether its table must have it.
    pub required: bool,
    /// What it means.
    pub about: String,
}

/// Names of the kinds.
pub fn kinds() -> [&'static str; 5] {
    SCHEMAS.map(|s| s.0)
}

/// The kind that a call names.
///
/// # Errors
/// Returns `BadInput` for a name that is no kind's.
pub fn kind(name: &str) -> Result<&'static str> {
    let found = kinds().into_iter().find(|k| *k == name);
    found.ok_or_else(|| {
        BadInput::new("is not a kind of file").key("kind").value(name).allowed(kinds().join(", ")).into()
    })
}

fn schema(kind: &str) -> Result<Value> {
    let text = SCHEMAS.iter().find(|s| s.0 == kind).map_or("null", |s| s.1);
    serde_json::from_str(text).map_err(|e| Error::Failed(format!("schema of a {kind}: {e}")))
}

/// The keys at the top of a kind of file.
pub fn top(kind: &str) -> Result<Vec<String>> {
    let schema = schema(kind)?;
    Ok(schema["properties"].as_object().map(|p| p.keys().cloned().collect()).unwrap_or_default())
}

/// All keys of a kind of file, in the order of its schema.
pub fn all(kind: &'static str) -> Result<Vec<Key>> {
    let root = schema(kind)?;
    let mut out = Vec::new();
    walk(&root, &root, &mut Place { kind, name: String::new(), within: Vec::new() }, &mut out);
    Ok(out)
}

struct Place {
    kind: &'static str,
    name: String,
    /// Definitions that the place lies in: a table that holds itself is walked once.
    within: Vec<String>,
}

/// The schema that a reference stands for, with the definition's name.
fn resolved<'a>(root: &'a Value, schema: &'a Value) -> (&'a Value, Option<&'a str>) {
    let name = schema["$ref"].as_str().and_then(|r| r.strip_prefix("#/$defs/"));
    name.map_or((schema, None), |n| (&root["$defs"][n], Some(n)))
}

/// The schemas one of which a value has, without null.
fn choices(schema: &Value) -> Vec<&Value> {
    let of = |name: &str| schema[name].as_array().map(|l| l.iter().collect::<Vec<_>>());
    let list = of("anyOf").or_else(|| of("oneOf")).or_else(|| of("allOf")).unwrap_or_else(|| vec![schema]);
    list.into_iter().filter(|s| s["type"] != "null").collect()
}

/// Adds the keys of the tables that a value of this schema may be.
fn walk(root: &Value, schema: &Value, at: &mut Place, out: &mut Vec<Key>) {
    let (schema, name) = resolved(root, schema);
    if let Some(name) = name {
        if at.within.iter().any(|w| w == name) {
            return;
        }
        at.within.push(name.into());
    }
    if let Some(keys) = schema["properties"].as_object() {
        let required = schema["required"].as_array().map(Vec::as_slice).unwrap_or_default();
        let table = at.name.clone();
        for (key, value) in keys {
            at.name = if table.is_empty() { key.clone() } else { format!("{table}.{key}") };
            let (target, _) = resolved(root, value);
            let about = value["description"].as_str().or_else(|| target["description"].as_str());
            let found = Key {
                kind: at.kind,
                name: at.name.clone(),
                of: type_of(root, value, 0),
                default: value.get("default").cloned(),
                required: required.iter().any(|r| r == key),
                about: about.unwrap_or_default().replace('\n', " "),
            };
            // Two tables that a value may be have some keys in common.
            if !out.contains(&found) {
                out.push(found);
            }
            walk(root, value, at, out);
        }
        at.name = table;
    }
    if schema["items"].is_object() {
        let table = at.name.clone();
        at.name += "[]";
        walk(root, &schema["items"], at, out);
        at.name = table;
    }
    for choice in choices(schema) {
        if !std::ptr::eq(choice, schema) {
            walk(root, choice, at, out);
        }
    }
    if name.is_some() {
        at.within.pop();
    }
}

/// A type in words: number, "a" | "b", list of number, table.
fn type_of(root: &Value, schema: &Value, depth: usize) -> String {
    let (schema, _) = resolved(root, schema);
    if depth > 6 {
        return "value".into();
    }
    if let Some(word) = schema.get("const") {
        return word.to_string();
    }
    if let Some(words) = schema["enum"].as_array() {
        return words.iter().filter(|w| !w.is_null()).map(Value::to_string).collect::<Vec<_>>().join(" | ");
    }
    let choices = choices(schema);
    if !(choices.len() == 1 && std::ptr::eq(choices[0], schema)) {
        let mut words: Vec<String> = choices.iter().map(|s| type_of(root, s, depth + 1)).collect();
        words.dedup();
        return words.join(" | ");
    }
    let list = || match schema["items"].is_object() {
        true => format!("list of {}", type_of(root, &schema["items"], depth + 1)),
        false => "list".into(),
    };
    let word = |name: &str| match name {
        "array" => list(),
        "object" => "table".into(),
        other => other.to_string(),
    };
    match &schema["type"] {
        Value::String(name) => word(name),
        Value::Array(names) => {
            let names = names.iter().filter_map(Value::as_str).filter(|n| *n != "null");
            names.map(word).collect::<Vec<_>>().join(" | ")
        }
        _ => "value".into(),
    }
}

/// The keys of one kind or of all, filtered by a word, as a table.
///
/// # Errors
/// Returns `BadInput` for an unknown kind, or where there are more keys than `most`.
pub fn table(of: Option<&str>, word: Option<&str>, most: usize) -> Result<Value> {
    let chosen = match of {
        Some(name) => vec![kind(name)?],
        None => kinds().to_vec(),
    };
    let word = word.unwrap_or_default().trim().to_lowercase();
    let mut rows = Vec::new();
    for kind in chosen {
        for key in all(kind)? {
            if key.name.to_lowercase().contains(&word) || key.about.to_lowercase().contains(&word) {
                rows.push(json!([key.kind, key.name, key.of, key.default, key.required, key.about]));
            }
        }
    }
    if rows.len() > most {
        return Err(BadInput::new(format!("{} keys exceed the length of one answer", rows.len()))
            .key("word")
            .value(format!("'{word}'"))
            .allowed(format!("up to {most}"))
            .remedy("give a kind of file and a word to search for")
            .into());
    }
    Ok(json!({
        "columns": ["file", "key", "type", "default", "required", "description"],
        "count": rows.len(),
        "rows": rows,
        "note": "[] follows an array of tables; unknown keys are errors; units are in the names (SI, degrees where a name ends in _deg)",
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_found_with_type_default_and_meaning() {
        let keys = all("scenario").unwrap();
        let key = |name: &str| keys.iter().find(|k| k.name == name).unwrap_or_else(|| panic!("no {name}"));
        assert_eq!(key("seed").default, Some(json!(0)));
        assert_eq!(key("seed").of, "integer");
        assert!(key("point[].rcs_dbsm").of.contains("number"), "{:?}", key("point[].rcs_dbsm"));
        assert!(key("frames.count").about.len() > 5);
        let road = all("road").unwrap();
        assert!(road.iter().any(|k| k.name == "road[].plan[].length_m"));
        let kind = road.iter().find(|k| k.name == "road[].plan[].kind").unwrap();
        assert_eq!(kind.of, "\"straight\" | \"arc\" | \"clothoid\"");
        for name in kinds() {
            let keys = all(kind_of(name)).unwrap();
            assert!(keys.len() > 15, "{name}: {}", keys.len());
            let mut names: Vec<&str> = keys.iter().map(|k| k.name.as_str()).collect();
            names.sort_unstable();
            assert!(top(name).unwrap().iter().all(|t| names.contains(&t.as_str())), "{name}");
        }
        assert!(table(None, None, 10).unwrap_err().to_string().contains("exceed the length of one answer"));
        assert!(table(Some("car"), None, 10).unwrap_err().to_string().contains("kind = car"));
        let found = table(Some("radar"), Some("BANDWIDTH_HZ"), 2000).unwrap();
        assert!(found["count"].as_u64().unwrap() > 0 && found["rows"][0][0] == "radar", "{found}");
    }

    fn kind_of(name: &str) -> &'static str {
        kind(name).unwrap()
    }
}
