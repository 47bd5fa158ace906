//! The folder of studies that `catseye study` writes: their tables over axes, their facts, and the reflectors behind their rows.

use super::{Page, pack};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use catseye::base::error::{BadInput, Result, json_in_words};
use catseye::formats::csv::Table;
use catseye::formats::input::{LARGEST_TEXT, read};
use catseye::formats::stage::MANIFEST;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// What of a folder's manifest a page needs.
#[derive(Deserialize)]
struct Manifest {
    #[serde(default)]
    catseye: String,
    #[serde(default)]
    engine: Value,
    studies: Vec<StudyNote>,
    /// Texts of the study files by name.
    #[serde(default)]
    sources: HashMap<String, String>,
}

#[derive(Deserialize)]
struct StudyNote {
    name: String,
    #[serde(default)]
    title: String,
    #[serde(default)]
    reference: String,
    #[serde(default)]
    files: Vec<String>,
    #[serde(default)]
    columns: Vec<Column>,
    #[serde(default)]
    reflectors: Reflectors,
    #[serde(default)]
    facts: Vec<Fact>,
    #[serde(default)]
    remarks: Vec<String>,
    #[serde(default)]
    error: Option<String>,
}

#[derive(Deserialize)]
struct Column {
    name: String,
    #[serde(default)]
    label: String,
    /// Values of an axis; empty for a quantity.
    #[serde(default)]
    values: Vec<Value>,
    #[serde(default)]
    names: Vec<String>,
}

#[derive(Deserialize, Serialize, Default)]
struct Reflectors {
    specs: Vec<String>,
    #[serde(default)]
    of_row: Vec<usize>,
}

/// A fact beside this program's number; `agrees` is None where the document gives no number.
#[derive(Deserialize, Serialize)]
struct Fact {
    text: String,
    #[serde(default)]
    document: Value,
    #[serde(default)]
    ours: Option<f64>,
    #[serde(default)]
    unit: String,
    #[serde(default)]
    agrees: Option<bool>,
    #[serde(default)]
    why: String,
}

/// The page of a folder of studies.
///
/// # Errors
/// Returns `BadInput` for a manifest that is none of studies, and for tables that are missing, cut short or do not fit to it.
pub fn page(folder: &Path) -> Result<Page> {
    let path = folder.join(MANIFEST);
    let bytes = read(&path, "a manifest of studies", LARGEST_TEXT)?;
    let manifest: Manifest = serde_json::from_slice(&bytes).map_err(|e| {
        BadInput::new(format!("is not a manifest of studies: {}", json_in_words(&e)))
            .file(&path)
            .remedy("give a folder that `catseye study` completed")
    })?;
    if manifest.studies.is_empty() {
        return Err(BadInput::new("contains no study")
            .file(&path)
            .key("studies")
            .remedy("run the study again")
            .into());
    }
    let studies = manifest
        .studies
        .iter()
        .map(|s| study(folder, &path, s, manifest.sources.get(&s.name)))
        .collect::<Result<Vec<Value>>>()?;
    let title = match manifest.studies.as_slice() {
        [one] if !one.title.is_empty() => one.title.clone(),
        [one] => one.name.clone(),
        several => format!("{} studies", several.len()),
    };
    let data = json!({
        "kind": "study",
        "title": title,
        "about": { "catseye": manifest.catseye, "engine": manifest.engine },
        "studies": studies,
    });
    Ok(Page::still(title, data))
}

/// A file of the folder by the name that the manifest gives; None where it gives none or the file is not there.
fn file_of(folder: &Path, manifest: &Path, note: &StudyNote, ending: &str) -> Result<Option<PathBuf>> {
    let Some(name) = note.files.iter().find(|f| f.ends_with(ending)) else { return Ok(None) };
    // A manifest is not trusted to name files elsewhere.
    if Path::new(name).file_name() != Some(name.as_ref()) {
        let bad =
            BadInput::new("is not the name of a file in this folder").file(manifest).key("files").value(name);
        return Err(bad.allowed("names without folders").remedy("run the study again").into());
    }
    let path = folder.join(name);
    Ok(path.is_file().then_some(path))
}

fn study(folder: &Path, manifest: &Path, note: &StudyNote, source: Option<&String>) -> Result<Value> {
    let mut out = json!({
        "name": note.name,
        "title": if note.title.is_empty() { &note.name } else { &note.title },
        "reference": note.reference,
        "remarks": note.remarks,
        "facts": note.facts,
        "error": note.error,
        "source": source,
    });
    if note.error.is_some() {
        return Ok(out);
    }
    match file_of(folder, manifest, note, ".csv")? {
        Some(path) => {
            let table = Table::read(&path)?;
            out["settings"] =
                json!(table.comments.iter().filter(|c| !c.starts_with("remark:")).collect::<Vec<_>>());
            if note.columns.is_empty() {
                let bad = BadInput::new(
                    "does not state which columns are axes: it was written by an older catseye",
                )
                .file(manifest);
                return Err(bad.key("columns").remedy("run `catseye study` again with --force").into());
            }
            out["columns"] = columns(&path, manifest, note, &table)?;
            out["rows"] = json!(table.len());
            let Reflectors { specs, of_row } = &note.reflectors;
            let whole =
                of_row.is_empty() || of_row.len() == table.len() && of_row.iter().all(|i| *i < specs.len());
            if !whole {
                let bad =
                    BadInput::new("does not fit the table's rows").file(manifest).key("reflectors.of_row");
                return Err(bad
                    .value(of_row.len())
                    .allowed(table.len().to_string())
                    .remedy("run the study again")
                    .into());
            }
            out["reflectors"] = json!(note.reflectors);
        }
        // A picture is better than nothing.
        None => match file_of(folder, manifest, note, ".png")? {
            Some(path) => {
                let bytes = read(&path, "a picture", LARGEST_TEXT)?;
                out["picture"] = json!(format!("data:image/png;base64,{}", STANDARD.encode(bytes)));
            }
            None => {
                let bad =
                    BadInput::new("the study has neither a table nor a chart").file(folder).key(&note.name);
                return Err(bad.remedy("run the study again").into());
            }
        },
    }
    Ok(out)
}

/// The columns with their values: of an axis its own values and each row's place on it, of a quantity each row's number or text.
fn columns(path: &Path, manifest: &Path, note: &StudyNote, table: &Table) -> Result<Value> {
    let mut points = 1;
    let mut out = Vec::new();
    for c in &note.columns {
        let cells = table.text(&c.name)?;
        let mut own = Map::new();
        own.insert("name".into(), json!(c.name));
        own.insert("label".into(), json!(if c.label.is_empty() { &c.name } else { &c.label }));
        if c.values.is_empty() {
            let numbers: Option<Vec<f64>> = cells
                .iter()
                .map(|cell| match cell.trim() {
                    "" => Some(f64::NAN),
                    word => word.parse().ok(),
                })
                .collect();
            own.insert(
                "cells".into(),
                match numbers {
                    // Packed at any length: levels may be infinite, for which JSON has no word.
                    Some(numbers) => pack::f64s(numbers),
                    None => json!(cells),
                },
            );
            out.push(Value::Object(own));
            continue;
        }
        if c.values.len() != c.names.len() {
            let bad = BadInput::new("the numbers of names and values differ").file(manifest).key(&c.name);
            return Err(bad
                .value(c.names.len())
                .allowed(c.values.len().to_string())
                .remedy("run the study again")
                .into());
        }
        points *= c.values.len();
        let places: HashMap<&str, u32> = c.names.iter().zip(0..).map(|(n, i)| (n.as_str(), i)).collect();
        let mut at = Vec::with_capacity(cells.len());
        for (row, cell) in cells.iter().enumerate() {
            let Some(place) = places.get(cell.as_ref()) else {
                let bad = BadInput::new("is not a value of this axis")
                    .file(path)
                    .key(&c.name)
                    .value(cell.to_string());
                let bad = BadInput { line: Some(table.line(row)), ..bad };
                return Err(bad.allowed(c.names.join(", ")).remedy("run the study again").into());
            };
            at.push(*place);
        }
        // Words have no place between each other: such an axis counts its names.
        let numbers: Option<Vec<f64>> = c.values.iter().map(Value::as_f64).collect();
        own.insert("numbers".into(), json!(numbers));
        own.insert("names".into(), json!(c.names));
        own.insert("at".into(), pack::u32s(at));
        out.push(Value::Object(own));
    }
    if table.len() != points {
        let bad =
            BadInput::new("the number of rows differs from the number of points of the axes").file(path);
        return Err(bad
            .value(table.len())
            .allowed(points.to_string())
            .remedy("run the study again, since the file is truncated or changed")
            .into());
    }
    Ok(json!(out))
}

#[cfg(test)]
mod tests {
    use super::*;
    use catseye::base::error::Error;

    const ABOUT: &str = r#"{"catseye": "0.1.0", "kind": "study", "engine": {"engine": "cpu"}, "studies": [{"name": "s", "title": "T",
        "reference": "R", "files": ["s.csv", "s.png"], "columns": [
        {"name": "azimuth_deg", "label": "azimuth (deg)", "values": [0.0, 1.5], "names": ["0", "1.5"]},
        {"name": "ground", "label": "ground", "values": ["none", "pec"], "names": ["alone", "on metal"]},
        {"name": "rcs_dbsm", "label": "RCS (dBsm)"}],
        "reflectors": {"specs": ["type1:height_m=0.004"]},
        "facts": [{"text": "f", "document": 3.0, "ours": 5.5, "unit": "dB", "why": "", "agrees": false}], "remarks": ["m"]}],
        "sources": {"s": "name = \"s\"\n"}}"#;
    const TABLE: &str = "# fixed: a = 1\n# remark: m\nazimuth_deg,ground,rcs_dbsm\n0,alone,-1.25\n0,on metal,-inf\n1.5,alone,\n1.5,on metal,7\n";

    fn folder(manifest: &str, table: Option<&str>) -> tempfile::TempDir {
        let t = tempfile::tempdir().unwrap();
        std::fs::write(t.path().join(MANIFEST), manifest).unwrap();
        if let Some(table) = table {
            std::fs::write(t.path().join("s.csv"), table).unwrap();
        }
        t
    }

    fn told(manifest: &str, table: Option<&str>) -> String {
        match page(folder(manifest, table).path()) {
            Err(Error::Input(e)) => e.to_string(),
            Err(e) => panic!("{e}"),
            Ok(_) => panic!("no complaint"),
        }
    }

    #[test]
    fn a_study_has_its_numbers_axes_and_facts() {
        let t = folder(ABOUT, Some(TABLE));
        let page = page(t.path()).unwrap();
        let s = &page.data["studies"][0];
        assert_eq!((page.title.as_str(), &s["rows"]), ("T", &json!(4)));
        assert_eq!(s["settings"], json!(["fixed: a = 1"]));
        let [azimuth, ground, rcs] = s["columns"].as_array().unwrap().as_slice() else { panic!("{s}") };
        assert_eq!((&azimuth["numbers"], &azimuth["at"]), (&json!([0.0, 1.5]), &pack::u32s([0, 0, 1, 1])));
        assert_eq!((&ground["numbers"], &ground["names"]), (&Value::Null, &json!(["alone", "on metal"])));
        assert_eq!(rcs["cells"], pack::f64s([-1.25, f64::NEG_INFINITY, f64::NAN, 7.0]));
        assert_eq!(s["facts"][0]["agrees"], json!(false));
        assert_eq!(s["reflectors"]["specs"][0], "type1:height_m=0.004");
    }

    #[test]
    fn what_does_not_fit_is_told_of() {
        let cut = told(ABOUT, Some(TABLE.trim_end_matches("1.5,on metal,7\n")));
        assert!(cut.contains("s.csv") && cut.contains('3') && cut.contains('4'), "{cut}");
        let word = told(ABOUT, Some(&TABLE.replace("1.5,alone", "2.5,alone")));
        assert!(word.contains("azimuth_deg") && word.contains("2.5") && word.contains("s.csv:6"), "{word}");
        let column = told(ABOUT, Some(&TABLE.replace("rcs_dbsm", "level")));
        assert!(column.contains("rcs_dbsm"), "{column}");
        let nothing = told(ABOUT, None);
        assert!(nothing.contains("neither a table nor a chart"), "{nothing}");
        let away = told(&ABOUT.replace("[\"s.csv\"", "[\"../s.csv\""), Some(TABLE));
        assert!(away.contains("../s.csv") && away.contains("files"), "{away}");
        let old = told(&ABOUT.replace("\"columns\"", "\"columns_of_old\""), Some(TABLE));
        assert!(old.contains("older catseye") && old.contains("catseye study"), "{old}");
        let rows =
            told(&ABOUT.replace("\"specs\": [", "\"of_row\": [0, 0, 0, 9], \"specs\": ["), Some(TABLE));
        assert!(rows.contains("reflectors.of_row"), "{rows}");
        assert!(told("{\"kind\": \"study\"}", Some(TABLE)).contains("studies"));
    }

    #[test]
    fn a_picture_stands_in_for_a_missing_table() {
        let t = folder(ABOUT, None);
        std::fs::write(t.path().join("s.png"), b"\x89PNG").unwrap();
        let page = page(t.path()).unwrap();
        assert_eq!(page.data["studies"][0]["picture"], "data:image/png;base64,iVBORw==");
    }
}
