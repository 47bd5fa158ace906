//! Recognises the kind of a file or folder for comparison.

use super::document;
use crate::dataset::DATASET;
use crate::store::LAYOUT;
use catseye::base::error::{BadInput, Error, Result};
use catseye::formats::stage::MANIFEST;
use catseye::formats::text::split_comment;
use catseye::formats::{csv, input, rcs_csv};
use serde_json::Value;
use std::fmt;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// Largest size of the comments and header of a table, bytes.
const HEADER_BYTES: u64 = 1 << 20;

/// Kind of a result, which can be compared with another of its kind.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Kind {
    /// Cross sections, as `catseye rcs` writes them.
    Rcs,
    /// Points, as in `points.csv`.
    Points,
    /// Echoes, as in `returns.csv`.
    Echoes,
    /// The table of a study.
    Study,
    /// Another CSV table.
    Table,
    /// A NumPy array.
    Array,
    /// Samples in another format.
    Cube,
    /// The report that `catseye study --json` prints.
    Report,
    /// Another JSON document.
    Document,
    /// A folder with a layout.
    Dataset,
    /// A folder of a frame.
    Frame,
    /// A folder with a manifest, and the kind that it names.
    Folder(String),
    /// A picture or a page, which is not compared.
    Shown,
    /// A file that is compared by its bytes only.
    Other,
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Kind::Rcs => "RCS table",
            Kind::Points => "table of points",
            Kind::Echoes => "table of echoes",
            Kind::Study => "study table",
            Kind::Table => "table",
            Kind::Array => "array",
            Kind::Cube => "cube of samples",
            Kind::Report => "study report",
            Kind::Document => "JSON document",
            Kind::Dataset => "dataset",
            Kind::Frame => "frame",
            Kind::Folder(kind) => kind,
            Kind::Shown => "picture",
            Kind::Other => "file",
        })
    }
}

fn of_table(path: &Path) -> Result<Kind> {
    let file = input::open(path, "a CSV table")?;
    let mut lines = BufReader::new(file.take(HEADER_BYTES));
    let mut line = Vec::new();
    let mut is_study = false;
    loop {
        line.clear();
        let n = lines.read_until(b'\n', &mut line).map_err(|e| Error::io(path, e))?;
        let text = String::from_utf8_lossy(&line);
        let text = text.trim_start_matches('\u{feff}').trim();
        if let Some(comment) = text.strip_prefix('#') {
            is_study |= comment.trim().starts_with("study:");
        }
        if n == 0 {
            return Err(csv::no_header(path).into());
        }
        if text.is_empty() || text.starts_with('#') {
            continue;
        }
        let names: Vec<&str> = split_comment(text).0.split(',').map(|c| c.trim().trim_matches('"')).collect();
        let has = |list: &[&str]| list.iter().all(|c| names.contains(c));
        return Ok(match () {
            () if is_study => Kind::Study,
            () if has(&rcs_csv::COLUMNS) => Kind::Rcs,
            () if has(&super::points::PLACE) && has(&["chain"]) => Kind::Echoes,
            () if has(&super::points::PLACE) => Kind::Points,
            () => Kind::Table,
        });
    }
}

fn of_folder(path: &Path) -> Result<Kind> {
    if path.join(DATASET).is_file() || path.join(LAYOUT).is_file() {
        return Ok(Kind::Dataset);
    }
    let manifest = path.join(MANIFEST);
    if manifest.is_file() {
        return match document::read(&manifest)?.get("kind") {
            Some(Value::String(kind)) => Ok(Kind::Folder(kind.clone())),
            _ => Err(BadInput::new("does not state the kind of the result")
                .file(manifest)
                .key("kind")
                .remedy("bring back the file that was written")
                .into()),
        };
    }
    if ["adc.npy", "range_doppler.npy", "points.csv", "returns.csv", "truth.json"]
        .iter()
        .any(|f| path.join(f).is_file())
    {
        return Ok(Kind::Frame);
    }
    Err(BadInput::new("is not a result: it has no manifest.json, no dataset.json and no files of a frame")
        .file(path)
        .remedy("name a file or a folder that catseye wrote")
        .into())
}

impl Kind {
    /// The kind of a file or folder that a user names.
    ///
    /// # Errors
    /// Returns `BadInput` for what is no result of catseye, or is damaged.
    pub fn of(path: &Path) -> Result<Kind> {
        if path.is_dir() {
            return of_folder(path);
        }
        input::regular(path, "a result of catseye")?;
        match Kind::of_file(path)? {
            Kind::Shown | Kind::Other => Err(BadInput::new("diff cannot compare files of this kind")
                .file(path)
                .allowed("a folder that catseye wrote, .csv, .npy, .json, .jsonl, .h5, .bin (with a .cfg), .parquet")
                .into()),
            kind => Ok(kind),
        }
    }

    /// The kind of a file in a folder.
    ///
    /// # Errors
    /// Returns `BadInput` for a table or document that is damaged.
    pub fn of_file(path: &Path) -> Result<Kind> {
        let extension =
            path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
        Ok(match extension.as_str() {
            "csv" => of_table(path)?,
            "npy" => Kind::Array,
            "h5" | "hdf5" | "bin" => Kind::Cube,
            "parquet" => Kind::Rcs,
            "json" | "jsonl" => match document::read(path)?.get("studies") {
                Some(_) => Kind::Report,
                None => Kind::Document,
            },
            "png" | "jpg" | "svg" | "html" | "md" => Kind::Shown,
            _ => Kind::Other,
        })
    }
}
